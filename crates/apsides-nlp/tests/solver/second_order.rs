//! The end of a solve: saddles and maxima are left, weakly active bounds are met exactly.
#![allow(clippy::unwrap_used)]

use apsides_nlp::{InteriorPoint, NlpSettings, SolveReport, Status};

use crate::support::{Dense, INF, Jet};

/// Round-off of Newton's method at its end.
const ROUNDING: f64 = 1e-12;

/// Solver: an objective with a slope at a bound.
const SOLVER: f64 = 1e-7;

/// Solver: the same at a corner, with the multipliers of both bounds.
const SOLVER_CORNER: f64 = 1e-6;

/// Solver: an objective without slope.
const SOLVER_STATIONARY: f64 = 1e-9;

fn solve<const N: usize, const M: usize>(problem: &Dense<N, M>, settings: NlpSettings) -> SolveReport {
    InteriorPoint::new(settings).solve(&mut problem.clone()).unwrap()
}

fn escaping() -> NlpSettings {
    NlpSettings { max_saddle_escapes: 3, ..NlpSettings::default() }
}

/// `x^4 - x^2` is stationary at 0 and has its minima of -1/4 at `x^2 = 1/2`.
#[test]
fn a_maximum_is_left() {
    let problem = Dense::unconstrained([0.0], |x: &[Jet<1>; 1]| x[0].powi(4) - x[0].powi(2));
    let stays = solve(&problem, NlpSettings::default());
    assert_eq!((stays.status, stays.objective), (Status::Optimal, 0.0));
    let leaves = solve(&problem, escaping());
    assert_eq!(leaves.status, Status::Optimal);
    assert!((leaves.objective + 0.25).abs() < ROUNDING, "{}", leaves.objective);
}

/// `-x^2` between -1 and 1: the minima are both bounds.
#[test]
fn a_concave_cost_ends_at_a_bound() {
    let problem = Dense {
        start: [0.0],
        lower: [-1.0],
        upper: [1.0],
        constraint_lower: [],
        constraint_upper: [],
        objective: |x: &[Jet<1>; 1]| -(x[0].powi(2)),
        constraints: |_| [],
    };
    let report = solve(&problem, escaping());
    assert_eq!(report.status, Status::Optimal);
    assert!((report.objective + 1.0).abs() < SOLVER, "{}", report.objective);
}

/// A saddle of `x y` on the line `x + y = 0` is its maximum there; on `x - y = 0` it is the minimum.
#[test]
fn curvature_counts_on_the_constraints_alone() {
    let on = |sign: fn(&[Jet<2>; 2]) -> [Jet<2>; 1]| Dense {
        start: [0.0; 2],
        lower: [-2.0; 2],
        upper: [2.0; 2],
        constraint_lower: [0.0],
        constraint_upper: [0.0],
        objective: |x: &[Jet<2>; 2]| x[0] * x[1],
        constraints: sign,
    };
    let down = solve(&on(|x| [x[0] + x[1]]), escaping());
    assert!((down.objective + 4.0).abs() < SOLVER_CORNER, "{}", down.objective);
    let up = solve(&on(|x| [x[0] - x[1]]), escaping());
    assert!(up.objective.abs() < SOLVER_STATIONARY, "{}", up.objective);
}

#[test]
fn an_unbounded_problem_is_called_diverging() {
    let problem = Dense::unconstrained([0.0], |x: &[Jet<1>; 1]| -(x[0].powi(2)));
    assert_eq!(solve(&problem, escaping()).status, Status::Diverging);
}

/// `x^2 + (y - 1)^2` with `x >= 0`, where slack and multiplier vanish: the barrier leaves `x` at the root of its parameter.
#[test]
fn a_weakly_active_bound_is_met_exactly() {
    let problem = Dense {
        start: [1.0, 0.0],
        lower: [0.0, -INF],
        upper: [INF, INF],
        constraint_lower: [],
        constraint_upper: [],
        objective: |x: &[Jet<2>; 2]| x[0].powi(2) + (x[1] - 1.0).powi(2),
        constraints: |_| [],
    };
    let rough = solve(&problem, NlpSettings::default());
    assert!(rough.x[0] > 1e-6, "{:?}", rough.x);
    let exact = solve(&problem, NlpSettings { polish: 0.05, ..NlpSettings::default() });
    assert_eq!(exact.status, Status::Optimal);
    assert!(exact.x[0].abs() < ROUNDING && (exact.x[1] - 1.0).abs() < ROUNDING, "{:?}", exact.x);
}

/// `x = s^2 / 1000` and `s = t`, `t = 1/1000`, all non-negative, beside `(y - 1)^2`: `x` is a billionth off its bound, where its multiplier is larger than
/// its slack, and is not active.
#[test]
fn a_bound_that_is_close_and_not_active_has_no_multiplier() {
    let problem = Dense {
        start: [1.0, 1.0, 0.0],
        lower: [0.0, 0.0, -INF],
        upper: [INF; 3],
        constraint_lower: [0.0, 1e-3],
        constraint_upper: [0.0, 1e-3],
        objective: |x: &[Jet<3>; 3]| (x[2] - 1.0).powi(2) + x[0],
        constraints: |x: &[Jet<3>; 3]| [x[0] - x[1].powi(2) * 1e-3, x[1]],
    };
    let rough = solve(&problem, NlpSettings::default());
    assert!(rough.lower_multipliers[0] > rough.x[0], "{:?}", rough.lower_multipliers);
    let exact = solve(&problem, NlpSettings { polish: 1.0, ..NlpSettings::default() });
    assert_eq!(exact.status, Status::Optimal);
    assert_eq!(exact.lower_multipliers[0], 0.0);
    assert!((exact.x[0] - 1e-9).abs() < ROUNDING, "{:?}", exact.x);
}
