//! Ten thousand random programs: every solve ends without a panic, what is called optimal satisfies the optimality
//! conditions, and where the answer is known it is found.

mod families;
mod program;
#[path = "../../../apsides-nlp/tests/solver/support.rs"]
mod support;

use std::time::{Duration, Instant};

use apsides_nlp::{InteriorPoint, Nlp, NlpSettings, Status};

use crate::support::{Units, strategies};
use families::Case;
use program::Random;

const CASES: usize = 400;

/// The status that is right.
#[derive(Clone, Copy)]
enum Answer {
    Optimal,
    Success,
    Infeasible,
    Diverging,
    NotEvaluated,
    Any,
}

impl Answer {
    fn is(self, status: Status) -> bool {
        match self {
            Self::Optimal => status == Status::Optimal,
            Self::Success => status.is_success(),
            Self::Infeasible => status == Status::Infeasible,
            Self::Diverging => status == Status::Diverging,
            Self::NotEvaluated => matches!(status, Status::EvaluationFailed(_)),
            Self::Any => true,
        }
    }
}

struct Family {
    name: &'static str,
    answer: Answer,
    /// Share of the cases, in percent, that must have the right status: what the method reaches.
    least: usize,
    generate: fn(&mut Random) -> Case,
}

const fn family(
    name: &'static str,
    answer: Answer,
    least: usize,
    generate: fn(&mut Random) -> Case,
) -> Family {
    Family { name, answer, least, generate }
}

const FAMILIES: [Family; 25] = [
    family("convex quadratic", Answer::Optimal, 99, families::convex_quadratic),
    family("linear", Answer::Optimal, 100, families::linear_program),
    family("convex nonlinear", Answer::Optimal, 100, families::convex_nonlinear),
    family("dependent equalities", Answer::Optimal, 100, families::dependent_equalities),
    family("nearly equal bounds", Answer::Optimal, 91, families::nearly_equal_bounds),
    family("fixed variables", Answer::Optimal, 100, families::fixed_variables),
    family("huge bounds", Answer::Optimal, 100, families::huge_bounds),
    family("far start", Answer::Optimal, 99, families::far_start),
    family("bad units", Answer::Success, 99, families::bad_units),
    family("logarithms", Answer::Optimal, 100, families::logarithms),
    family("square system", Answer::Optimal, 100, families::square_system),
    family("quartic", Answer::Optimal, 100, families::quartic),
    family("indefinite quadratic", Answer::Optimal, 100, families::indefinite_quadratic),
    family("infimum not attained", Answer::Success, 100, families::infimum_not_attained),
    family("empty interior", Answer::Success, 98, families::empty_interior),
    family("complementarity", Answer::Success, 100, families::complementarity),
    family("vanishing gradients", Answer::Success, 60, families::vanishing_gradients),
    family("inconsistent equalities", Answer::Infeasible, 100, families::inconsistent_equalities),
    family("row against bounds", Answer::Infeasible, 100, families::row_against_bounds),
    family("ball and half space", Answer::Infeasible, 100, families::ball_and_half_space),
    family("unbounded ray", Answer::Diverging, 100, families::unbounded_ray),
    family("unbounded concave", Answer::Diverging, 100, families::unbounded_concave),
    family("undefined start", Answer::NotEvaluated, 100, families::undefined_start),
    family("edge of the domain", Answer::Any, 100, families::edge_of_the_domain),
    family("anything", Answer::Any, 100, families::anything),
];

/// The outcome of one case.
struct Outcome {
    status: Status,
    iterations: usize,
    time: Duration,
    wrong: Option<String>,
}

fn generate(family: &Family, case: usize) -> Case {
    let seed =
        family.name.bytes().fold(case as u64, |seed, byte| seed.wrapping_mul(1_000_003) + u64::from(byte));
    (family.generate)(&mut Random::new(seed))
}

fn solve(family: &Family, case: usize) -> Outcome {
    let Case { program, units } = generate(family, case);
    let mut nlp: Box<dyn Nlp> = match units {
        Some(scaling) => Box::new(Units { problem: program, scaling }),
        None => Box::new(program),
    };
    let strategies = strategies();
    let settings = NlpSettings { max_iterations: 500, ..strategies[case % strategies.len()].clone() };
    let clock = Instant::now();
    let report = InteriorPoint::new(settings.clone())
        .solve_observed(nlp.as_mut(), &mut crate::support::log)
        .expect("the program is well posed");
    let time = clock.elapsed();
    let mut wrong = None;
    if !report.x.iter().all(|x| x.is_finite()) {
        wrong = Some("x is not finite".to_owned());
    } else if report.status == Status::Optimal {
        wrong = apsides_optimality::violated(nlp.as_mut(), &report, &settings).map(|e| e.to_string());
    }
    Outcome { status: report.status, iterations: report.counters.iterations, time, wrong }
}

/// Column of the table.
fn column(status: Status) -> usize {
    match status {
        Status::Optimal => 0,
        Status::Acceptable => 1,
        Status::Infeasible => 2,
        Status::Diverging => 3,
        Status::IterationLimit => 4,
        Status::RestorationFailed => 5,
        Status::EvaluationFailed(_) => 6,
        Status::StepTooSmall => 7,
        _ => 8,
    }
}

/// One case twice gives the same numbers: the first of the first family, or the one that `NLP_CASE="family number"` names. The
/// program is printed, and its iterations where `NLP_LOG` is set.
#[test]
fn one_case_twice_is_the_same() {
    let name = std::env::var("NLP_CASE").unwrap_or_else(|_| format!("{} 0", FAMILIES[0].name));
    let (name, case) = name.rsplit_once(' ').expect("a family and a number");
    let case = case.parse().expect("a number");
    let family = FAMILIES.iter().find(|family| family.name == name).expect("a family");
    eprintln!("{:#?}", generate(family, case).program);
    let [first, second] = [solve(family, case), solve(family, case)];
    eprintln!("{}, {} iterations, {:?}", first.status, first.iterations, first.wrong);
    assert_eq!((first.status, first.iterations), (second.status, second.iterations));
}

#[test]
fn every_answer_is_right() {
    let solve_all = |family: &Family| -> Vec<Outcome> {
        let half =
            |parity: usize| (parity..CASES).step_by(2).map(|case| solve(family, case)).collect::<Vec<_>>();
        std::thread::scope(|scope| {
            let odd = scope.spawn(|| half(1));
            let even = half(0);
            let odd = odd.join().expect("no solve panics");
            even.into_iter().zip(odd).flat_map(|(even, odd)| [even, odd]).collect()
        })
    };
    eprintln!(
        "{:24} optimal accept. infeas. diverg. limit restor. evalua. tiny other | right iterations time",
        "family"
    );
    let mut failures = Vec::new();
    for family in &FAMILIES {
        let outcomes = solve_all(family);
        let mut counts = [0; 9];
        outcomes.iter().for_each(|outcome| counts[column(outcome.status)] += 1);
        let right = outcomes.iter().filter(|outcome| family.answer.is(outcome.status)).count();
        let iterations = outcomes.iter().map(|outcome| outcome.iterations).max().unwrap_or(0);
        let time = outcomes.iter().map(|outcome| outcome.time).max().unwrap_or_default();
        let cells: String = counts.iter().map(|count| format!("{count:7}")).collect();
        eprintln!("{:24}{cells} | {right:4} {iterations:5} {:7.1} ms", family.name, 1e3 * time.as_secs_f64());
        if 100 * right < family.least * CASES {
            failures.push(format!("{}: {right} of {CASES} have the right status", family.name));
        }
        for (case, Outcome { status, iterations, wrong, .. }) in outcomes.iter().enumerate() {
            if let Some(wrong) = wrong {
                failures.push(format!("{} {case}, {status}, {iterations} iterations: {wrong}", family.name));
            } else if !family.answer.is(*status) && std::env::var_os("NLP_CASES").is_some() {
                eprintln!("    {case}: {status}, {iterations} iterations");
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
