use apsides_ad::{Dynamics, PathFunction, Scalar, VectorFunction};
use apsides_nlp::{Nlp, check_derivatives};
use apsides_ocp::{At, Bounds, Guess, Ocp, Phase, PhaseMesh, Sense, State, Term, Variable};
use apsides_ode::Method;

use super::*;
use crate::direct::settings::SegmentEnds;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-13;

/// Explicit time, parameter, nonlinear everywhere.
struct Everything;

impl Dynamics<2, 1, 1> for Everything {
    fn rate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 1], p: &[S; 1]) -> [S; 2] {
        [x[1] * (t * x[0]).sin() + p[0] * u[0], u[0].exp() * t.square() - x[0] * x[1] * p[0]]
    }
}

impl PathFunction<2, 1, 2, 1> for Everything {
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 1], p: &[S; 1]) -> [S; 2] {
        [x[0] * u[0] + t.square(), p[0] * x[1].cos() * t]
    }
}

impl PathFunction<2, 1, 1, 1> for Everything {
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 1], p: &[S; 1]) -> [S; 1] {
        [(x[0] * t).exp() + u[0] * x[1] * p[0]]
    }
}

impl VectorFunction<4, 1> for Everything {
    fn evaluate<S: Scalar>(&self, z: &[S; 4]) -> [S; 1] {
        [z[0] * z[1].sin() + z[2].exp() * z[3]]
    }
}

/// A constraint on the state alone.
struct Product;

impl PathFunction<2, 1, 1> for Product {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 2], _u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [x[0] * x[1].exp()]
    }
}

fn phase(name: &str) -> Phase {
    Phase::new(name, Everything)
        .states([State::new("a", "-").within(-9.0, 9.0), State::new("b", "-")])
        .controls([Variable::new("u", "-")])
        .initial_time(Bounds::new(0.0, 0.5))
        .final_time(Bounds::new(0.6, 3.0))
        .duration(Bounds::new(0.2, 2.0))
        .path::<_, 2, 1, 2, 1>(
            [Variable::new("c", "-").at_most(9.0), Variable::new("d", "-").at_least(-9.0)],
            Everything,
        )
        .path([Variable::new("product", "-").at_most(99.0)], Product)
        .integral(Variable::new("q", "-").at_most(50.0), Everything)
        .integral(Variable::new("r", "-"), Everything)
}

fn everything() -> Ocp {
    let at =
        || [At::InitialTime("one"), At::FinalTime("two"), At::FinalState("one", "a"), At::Parameter("p")];
    Ocp::builder("everything")
        .parameter(Variable::new("p", "-").within(0.1, 2.0))
        .phase(phase("one"))
        .phase(phase("two"))
        .link("one", "two")
        .constrain("ends", [Variable::new("e", "-").at_most(4.0)], at(), Everything)
        .objective(
            Sense::Maximize,
            "mixed",
            "-",
            [
                Term::Integral("one", "q", 0.7),
                Term::Integral("two", "r", -0.4),
                Term::function(at(), Everything),
                Term::End(At::InitialState("two", "b"), 2.0),
            ],
        )
        .build()
        .unwrap()
}

fn plans(points: [usize; 3]) -> Vec<PhasePlan> {
    let mesh = |fractions: Vec<f64>, points: &[usize]| PhaseMesh::new(fractions, points.to_vec()).unwrap();
    let mut plans = vec![
        PhasePlan::new(mesh(vec![0.0, 0.3, 1.0], &points[..2]), 2),
        PhasePlan::new(mesh(vec![0.0, 1.0], &points[2..]), 3),
    ];
    plans[0].inner_bounds[1] = true;
    plans
}

fn transcribed(points: [usize; 3], method: Method, continuous_controls: bool) -> Transcription {
    let settings = MultipleShootingSettings { method, continuous_controls, ..Default::default() };
    transcribed_by(points, &settings)
}

fn transcribed_by(points: [usize; 3], settings: &MultipleShootingSettings) -> Transcription {
    let ocp = everything();
    transcribe(&ocp, &plans(points), &Guess::linear(&ocp), settings).unwrap()
}

/// Unknown segment ends, rows at points of their own.
fn loose(constraint_points: Option<usize>) -> MultipleShootingSettings {
    let segment_ends = SegmentEnds::Free { least_length: 0.1 };
    MultipleShootingSettings { segment_ends, constraint_points, ..Default::default() }
}

fn somewhere(variables: usize) -> Vec<f64> {
    (0..variables).map(|k| 0.4 + 0.3 * (1.7 * k as f64).sin()).collect()
}

#[test]
fn derivatives_agree_with_differences() {
    for (points, method, continuous) in [
        ([4, 3, 2], Method::Dop853, false),
        ([4, 3, 5], Method::Dopri5, true),
        ([1, 1, 1], Method::Dop853, false),
        ([1, 2, 4], Method::Dopri5, false),
    ] {
        let mut nlp = transcribed(points, method, continuous);
        let x = somewhere(nlp.variables());
        let report = check_derivatives(&mut nlp, &x).unwrap();
        assert!(report.is_within(1e-6), "{points:?} {report:?}");
    }
}

#[test]
fn derivatives_agree_with_differences_where_segment_ends_are_unknowns() {
    for (points, rows) in [([4, 3, 2], None), ([1, 1, 1], Some(3)), ([2, 1, 7], Some(4))] {
        let mut nlp = transcribed_by(points, &loose(rows));
        let x = somewhere(nlp.variables());
        let report = check_derivatives(&mut nlp, &x).unwrap();
        assert!(report.is_within(1e-6), "{points:?} {rows:?} {report:?}");
    }
}

/// With three constraint points: controls 1 + 1 + 1, one inner end, two least lengths; mixed rows 2 (3 + 3 + 3), product 5 + 3.
#[test]
fn unknown_ends_and_constraint_points_are_counted() {
    let nlp = transcribed_by([1, 1, 1], &loose(Some(3)));
    assert_eq!(nlp.variables(), 10 + 3 + 1 + 4 + 1);
    assert_eq!(nlp.constraints(), 6 + 18 + 8 + 1 + 2 + 2 + 2 + 3 + 1);
    let single = transcribed_by([1, 1, 1], &MultipleShootingSettings::default());
    assert_eq!(single.variables(), 10 + 3 + 4 + 1);
}

/// Where the unknown ends are where the mesh has them, both forms are the same.
#[test]
fn unknown_ends_at_the_mesh_give_the_same_rows() {
    let mut fixed = transcribed([4, 3, 2], Method::Dop853, false);
    let mut free = transcribed_by([4, 3, 2], &loose(None));
    let (x, mut z) = (somewhere(fixed.variables()), Vec::new());
    let first = &free.layout.phases[0];
    let (time, length_rows) =
        (first.segments[1].times.0, [0, 1].map(|k| first.segments[k].length_row.unwrap()));
    let (t0, tf) = (x[fixed.layout.phases[0].ends.initial_time], x[fixed.layout.phases[0].ends.final_time]);
    z.extend_from_slice(&x[..time]);
    z.push(0.7 * t0 + 0.3 * tf);
    z.extend_from_slice(&x[time..]);
    let (mut a, mut b) = (vec![0.0; fixed.constraints()], vec![0.0; free.constraints()]);
    fixed.constraint_values(&x, &mut a);
    free.constraint_values(&z, &mut b);
    let lengths: Vec<f64> = length_rows.iter().map(|r| b[*r]).collect();
    for (length, width) in lengths.iter().zip([0.3, 0.7]) {
        assert!((length - 0.9 * width * (tf - t0)).abs() < 0.1 * ROUNDING, "{lengths:?}");
    }
    let rest = b.iter().enumerate().filter(|(r, _)| !length_rows.contains(r)).map(|(_, v)| v);
    for (a, b) in a.iter().zip(rest) {
        assert!((a - b).abs() < ROUNDING, "{a} {b}");
    }
    assert!((fixed.objective(&x) - free.objective(&z)).abs() < ROUNDING);
}

/// Rows shared at nodes are stated once: the state constraint at every node, the mixed one for both controls there.
#[test]
fn rows_and_columns_are_counted() {
    let count = |continuous| {
        let nlp = transcribed([4, 3, 2], Method::Dop853, continuous);
        (nlp.variables(), nlp.constraints())
    };
    // States 2 (3 + 2), controls 4 + 3 + 2, times 4, parameter; matching 6, mixed 2 (4 + 3 + 2), product 6 + 2, bound 1, integrals
    // 2, durations 2, link 3, end 1.
    assert_eq!(count(false), (10 + 9 + 4 + 1, 6 + 18 + 8 + 1 + 2 + 2 + 3 + 1));
    assert_eq!(count(true), (10 + 8 + 4 + 1, 6 + 16 + 8 + 1 + 2 + 2 + 3 + 1));
}

#[test]
fn evaluations_do_not_depend_on_their_order_or_on_threads() {
    let bits = |v: &[f64]| v.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    let evaluate = |mut nlp: Transcription, astray: bool| {
        let x = somewhere(nlp.variables());
        let y: Vec<f64> = (0..nlp.constraints()).map(|k| (k as f64).cos()).collect();
        let mut all = vec![vec![nlp.objective(&x)], vec![0.0; y.len()], vec![0.0; x.len()]];
        nlp.constraint_values(&x, &mut all[1]);
        nlp.gradient(&x, &mut all[2]);
        if astray {
            let elsewhere: Vec<f64> = x.iter().map(|v| v + 0.1).collect();
            let _ = nlp.objective(&elsewhere);
        }
        let mut jacobian = vec![f64::NAN; nlp.jacobian_pattern().len()];
        nlp.jacobian(&x, &mut jacobian);
        let mut hessian = vec![f64::NAN; nlp.hessian_pattern().len()];
        nlp.hessian(&x, 1.5, &y, &mut hessian);
        all.extend([jacobian, hessian]);
        all.iter().map(|v| bits(v)).collect::<Vec<_>>()
    };
    let make = || transcribed([4, 3, 5], Method::Dop853, false);
    let one = evaluate(make(), false);
    assert!(one.iter().flatten().all(|b| *b != f64::NAN.to_bits()));
    assert_eq!(evaluate(make(), true), one);
    for threads in [1, 2, 3] {
        assert_eq!(evaluate(make().with_threads(threads), false), one, "{threads} threads");
    }
}

/// A model that is defined on one side alone gives numbers that the solver can see are none.
#[test]
fn what_cannot_be_evaluated_is_not_a_number() {
    let mut nlp = transcribed([2, 2, 2], Method::Dop853, false);
    let mut x = somewhere(nlp.variables());
    x[0] = f64::NAN;
    let mut rows = vec![0.0; nlp.constraints()];
    nlp.constraint_values(&x, &mut rows);
    assert!(rows[0].is_nan());
}

#[test]
fn a_plan_for_another_problem_is_refused() {
    let ocp = everything();
    let few = &plans([2, 2, 2])[..1];
    assert!(transcribe(&ocp, few, &Guess::linear(&ocp), &MultipleShootingSettings::default()).is_err());
}

#[test]
fn evaluations_on_one_thread_allocate_nothing() {
    let mut nlp = transcribed([4, 3, 5], Method::Dop853, false);
    let (n, m) = (nlp.variables(), nlp.constraints());
    let mut x = somewhere(n);
    let (mut gradient, mut rows, y) = (vec![0.0; n], vec![0.0; m], vec![1.0; m]);
    let mut jacobian = vec![0.0; nlp.jacobian_pattern().len()];
    let mut hessian = vec![0.0; nlp.hessian_pattern().len()];
    let counted = allocation_counter::measure(|| {
        for k in 0..3 {
            x[3] += 1e-3 * f64::from(k);
            let _ = nlp.objective(&x);
            nlp.constraint_values(&x, &mut rows);
            nlp.gradient(&x, &mut gradient);
            nlp.jacobian(&x, &mut jacobian);
            nlp.hessian(&x, 1.0, &y, &mut hessian);
        }
    });
    assert_eq!(counted.count_total, 0);
}
