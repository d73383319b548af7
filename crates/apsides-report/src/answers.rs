//! A certificate folded: one answer in plain words for each question that its checks decide.

use apsides_verify::{Check, CheckKind};

use crate::number::readable;
use crate::units::pretty;

/// Significant digits of values and limits.
const DIGITS: usize = 3;

/// A question that checks decide.
#[derive(Clone, Copy, Debug)]
struct Question {
    /// The answer where all of its checks pass.
    holds: &'static str,
    /// The answer where one of them fails.
    fails: &'static str,
    /// Returns true of its checks; the first question that takes a check has it.
    takes: fn(&Check) -> bool,
}

const QUESTIONS: [Question; 8] = [
    Question {
        holds: "Flown again with an independent integrator, it is the flight that is stated and ends where it is stated to end",
        fails: "Flown again with an independent integrator, it is not the flight that is stated",
        takes: |check| {
            let flown = ["re-simulated ", "against the re-simulation", "when its re-simulation", "flown in"];
            of(check, CheckKind::Feasibility) && flown.iter().any(|part| check.name.contains(part))
        },
    },
    Question {
        holds: "No limit on states, controls and what follows from them is exceeded anywhere on the way, between the nodes neither",
        fails: "A limit on states, controls or what follows from them is exceeded on the way",
        takes: |check| of(check, CheckKind::Feasibility) && check.name.contains(" along "),
    },
    Question {
        holds: "Start, end, times and what joins the phases are as required, and the objective is the one stated",
        fails: "Start, end, times, what joins the phases or the stated objective are not as required",
        takes: |check| {
            let ends = ["boundary conditions", "times of", "constraint ", "objective", "bounds on the "];
            of(check, CheckKind::Feasibility) && ends.iter().any(|part| check.name.starts_with(part))
        },
    },
    Question {
        holds: "What the mission asks for besides, of sites and ground among others, is met",
        fails: "Something that the mission asks for besides, of sites and ground among others, is not met",
        takes: |check| of(check, CheckKind::Feasibility),
    },
    Question {
        holds: "No admissible control does better at any time: Pontryagin's minimum principle holds",
        fails: "The conditions of an optimum are not met: Pontryagin's minimum principle does not hold",
        takes: |check| of(check, CheckKind::Optimality),
    },
    Question {
        holds: "No small change of the flight is found by which the objective gains in second order",
        fails: "There is a small change of the flight by which the objective gains",
        takes: |check| of(check, CheckKind::Curvature),
    },
    Question {
        holds: "Every small change of the flight that is allowed loses in second order",
        fails: "Not every small change of the flight that is allowed is shown to lose",
        takes: |check| of(check, CheckKind::Strictness),
    },
    Question {
        holds: "The problem is convex: what is an optimum among its neighbours is one among all",
        fails: "The problem is not shown to be convex",
        takes: |check| of(check, CheckKind::Convexity),
    },
];

fn of(check: &Check, kind: CheckKind) -> bool {
    check.kind == kind
}

/// The answer to one question, with the checks behind it.
#[derive(Clone, Debug)]
pub struct Answer<'a> {
    question: Question,
    /// Its checks, at least one, in the order of the certificate.
    pub checks: Vec<&'a Check>,
    /// The check that is closest to its limit, or farthest beyond it.
    pub worst: &'a Check,
}

impl Answer<'_> {
    /// Returns true if all of its checks pass.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.checks.iter().all(|check| check.passed)
    }

    /// The answer without numbers.
    #[must_use]
    pub fn words(&self) -> &'static str {
        if self.passed() { self.question.holds } else { self.question.fails }
    }

    /// The check that is closest to its limit in words: `radius at the end, 51 µm of 1 mm allowed`; none where nothing is off.
    #[must_use]
    pub fn closest(&self) -> Option<String> {
        let Check { name, value, limit, unit, .. } = self.worst;
        let is_off = *value != 0.0;
        is_off.then(|| format!("{name}, {} of {} allowed", measure(*value, unit), measure(*limit, unit)))
    }

    /// The answer with the check that is closest to its limit, as a sentence.
    #[must_use]
    pub fn sentence(&self) -> String {
        match self.closest() {
            Some(closest) if self.passed() => format!("{}. Closest to its limit: {closest}.", self.words()),
            Some(closest) => format!("{}. Farthest beyond its limit: {closest}.", self.words()),
            None => format!("{}.", self.words()),
        }
    }
}

/// The answers that checks give, in the order of the questions; a question without checks has none.
#[must_use]
pub fn answers(checks: &[Check]) -> Vec<Answer<'_>> {
    let place = |check: &Check| QUESTIONS.iter().position(|question| (question.takes)(check));
    let answer = |(k, question): (usize, &Question)| {
        let own: Vec<&Check> = checks.iter().filter(|check| place(check) == Some(k)).collect();
        let worst = own.iter().copied().max_by(|a, b| used(a).total_cmp(&used(b)))?;
        Some(Answer { question: *question, checks: own, worst })
    };
    QUESTIONS.iter().enumerate().filter_map(answer).collect()
}

/// The part of its limit that a check uses; infinite where it fails by a number that is none, or has no room at all.
fn used(check: &Check) -> f64 {
    match (check.passed, check.value / check.limit) {
        (true, part) if part.is_nan() => 0.0,
        (false, part) if part.is_nan() => f64::INFINITY,
        (_, part) => part,
    }
}

/// Prefixes of units, with their factors, for quantities below one.
const PREFIXES: [(f64, &str); 4] = [(1.0, ""), (1e3, "m"), (1e6, "\u{b5}"), (1e9, "n")];

/// A value with its unit and a prefix by which it is easy to read: `3.03 nm`, `1 mm/s`.
#[must_use]
pub fn measure(value: f64, unit: &str) -> String {
    let shown = |value: f64, unit: &str| format!("{} {unit}", readable(value, DIGITS)).trim_end().to_owned();
    let head = unit.split(['/', ' ']).next().unwrap_or_default();
    let size = value.abs();
    if !matches!(head, "m" | "s" | "N" | "W" | "Pa" | "J" | "rad") || size == 0.0 || !size.is_finite() {
        return shown(value, &pretty(unit));
    }
    // What is smaller than a thousandth of the last prefix is nothing that anybody measures: as a power of ten.
    match PREFIXES.iter().find(|(factor, _)| size * factor >= 1.0) {
        Some((factor, prefix)) => shown(value * factor, &format!("{prefix}{}", pretty(unit))),
        None => shown(value, &pretty(unit)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(name: &str, kind: CheckKind, value: f64, limit: f64) -> Check {
        Check::new(name, kind, value, limit, "m", "here")
    }

    #[test]
    fn checks_are_folded_by_what_they_decide() {
        use CheckKind::{Feasibility, Optimality, Strictness};
        let checks = [
            check("re-simulated radius at the end of braking", Feasibility, 3e-9, 1e-3),
            check("states along braking against the re-simulation", Feasibility, 5.1e-5, 0.115),
            check("boundary conditions of braking", Feasibility, 0.0, 1e-6),
            check("heat rate along entry", Feasibility, 2.0, 1.0),
            check("coarse site: slope", Feasibility, 1.0, 8.0),
            check("costate equation along braking", Optimality, 1e-7, 1e-5),
            check("second variation positive", Strictness, 0.0, 0.0),
        ];
        let found = answers(&checks);
        let counts: Vec<usize> = found.iter().map(|answer| answer.checks.len()).collect();
        assert_eq!(counts, [2, 1, 1, 1, 1, 1]);
        assert_eq!(counts.iter().sum::<usize>(), checks.len(), "each check has one question");
        let passed: Vec<bool> = found.iter().map(Answer::passed).collect();
        assert_eq!(passed, [true, false, true, true, true, true]);
        assert_eq!(
            found[0].closest().unwrap(),
            "states along braking against the re-simulation, 51 µm of 115 mm allowed"
        );
        assert!(
            found[1]
                .sentence()
                .ends_with("Farthest beyond its limit: heat rate along entry, 2 m of 1 m allowed.")
        );
        assert_eq!(found[2].closest(), None);
    }

    #[test]
    fn a_check_without_a_number_is_the_worst() {
        let kind = CheckKind::Feasibility;
        let checks = [check("times of a", kind, 5.0, 1.0), check("times of b", kind, f64::NAN, 1.0)];
        let found = answers(&checks);
        assert_eq!(found[0].worst.name, "times of b");
        assert!(found[0].sentence().contains("not a number"), "{}", found[0].sentence());
        assert!(answers(&[]).is_empty());
    }

    #[test]
    fn measures_have_prefixes() {
        let cases = [
            (3.03e-9, "m", "3.03 nm"),
            (1e-3, "m", "1 mm"),
            (0.0, "m", "0 m"),
            (1e-6, "m/s", "1 \u{b5}m/s"),
            (2.5e-13, "m", "2.5 × 10⁻¹³ m"),
            (12.0, "deg", "12 deg"),
            (1e-5, "-", "1 × 10⁻⁵"),
            (1.02e-9, "m/s2", "1.02 nm/s²"),
        ];
        for (value, unit, text) in cases {
            assert_eq!(measure(value, unit), text);
        }
    }
}
