//! Complementarity constraints as `g h <= 0`, `g, h >= 0`, from the collection MacMPEC (Leyffer 2000): no feasible
//! point satisfies the constraint qualification of Mangasarian and Fromovitz.

use crate::support::{Dense, INF, Jet, assert_success};

/// Solver: without multipliers an objective is known to the root of the tolerance at best, and some strategies end
/// earlier.
const SOLVER: f64 = 1e-3;

/// Solves by every strategy; `values` are those of the local minima.
fn assert_minimum<const N: usize, const M: usize>(problem: &Dense<N, M>, values: &[f64]) {
    assert_success(problem, |report| {
        let near = values.iter().any(|value| (report.objective - value).abs() < SOLVER);
        assert!(near, "{} at {:?}", report.objective, report.x);
    });
}

/// Two complementary variables.
fn pair(start: [f64; 2], objective: fn(&[Jet<2>; 2]) -> Jet<2>) -> Dense<2, 1> {
    Dense {
        start,
        lower: [0.0; 2],
        upper: [INF; 2],
        constraint_lower: [-INF],
        constraint_upper: [0.0],
        objective,
        constraints: |x| [x[0] * x[1]],
    }
}

/// `0 <= x1` complementary to `x1 - x0 >= 0`.
fn pair_with_difference(objective: fn(&[Jet<2>; 2]) -> Jet<2>) -> Dense<2, 2> {
    Dense {
        start: [1.0, 1.0],
        lower: [-INF, 0.0],
        upper: [INF; 2],
        constraint_lower: [0.0, -INF],
        constraint_upper: [INF, 0.0],
        objective,
        constraints: |x| [x[1] - x[0], x[1] * (x[1] - x[0])],
    }
}

#[test]
fn kth1() {
    assert_minimum(&pair([1.0, 1.0], |x| x[0] + x[1]), &[0.0]);
}

#[test]
fn kth2() {
    assert_minimum(&pair([1.0, 1.0], |x| x[0] + (x[1] - 1.0).powi(2)), &[0.0]);
}

#[test]
fn kth3() {
    let problem = pair([1.0, 1.0], |x| 0.5 * (x[0] - 1.0).powi(2) + (x[1] - 1.0).powi(2));
    assert_minimum(&problem, &[0.5, 1.0]);
}

/// From a start on the diagonal the iterates may stay there by symmetry; the corner is stationary along it.
#[test]
fn scholtes3() {
    let from = |start| pair(start, |x| 0.5 * ((x[0] - 1.0).powi(2) + (x[1] - 1.0).powi(2)));
    for start in [[0.5, 0.4], [3.0, 0.0], [1.0, 1.1]] {
        assert_minimum(&from(start), &[0.5]);
    }
    for start in [[0.0, 0.0], [1.0, 1.0]] {
        assert_minimum(&from(start), &[0.5, 1.0]);
    }
}

#[test]
fn scholtes4() {
    let problem = Dense {
        start: [0.0, 1.0, 0.0],
        lower: [0.0, 0.0, -INF],
        upper: [INF; 3],
        constraint_lower: [-INF; 3],
        constraint_upper: [0.0; 3],
        objective: |x| x[0] + x[1] - x[2],
        constraints: |x| [x[2] - 4.0 * x[0], x[2] - 4.0 * x[1], x[0] * x[1]],
    };
    assert_minimum(&problem, &[0.0]);
}

/// The minimum is at the corner, and not strongly stationary.
#[test]
fn ralph1() {
    let problem = Dense { lower: [0.0; 2], ..pair_with_difference(|x| 2.0 * x[0] - x[1]) };
    assert_minimum(&problem, &[0.0]);
}

#[test]
fn jr1() {
    assert_minimum(&pair_with_difference(|x| (x[0] - 1.0).powi(2) + x[1].powi(2)), &[0.5]);
}

#[test]
fn jr2() {
    assert_minimum(&pair_with_difference(|x| (x[1] - 1.0).powi(2) + x[0].powi(2)), &[0.5]);
}

#[test]
fn gauvin() {
    let problem = Dense {
        start: [7.5, 7.5, 1.0],
        lower: [0.0; 3],
        upper: [15.0, INF, INF],
        constraint_lower: [0.0, 0.0, -INF],
        constraint_upper: [0.0, INF, 0.0],
        objective: |x| x[0].powi(2) + (x[1] - 10.0).powi(2),
        constraints: |x| {
            let room = 20.0 - x[0] - x[1];
            [4.0 * (x[0] + 2.0 * x[1] - 30.0) + x[2], room, x[2] * room]
        },
    };
    assert_minimum(&problem, &[20.0]);
}

/// Variables `x`, `y` and the three multipliers of the lower level.
#[test]
fn bard1() {
    let problem = Dense {
        start: [1.0; 5],
        lower: [0.0; 5],
        upper: [INF; 5],
        constraint_lower: [0.0, 0.0, 0.0, 0.0, -INF, -INF, -INF],
        constraint_upper: [0.0, INF, INF, INF, 0.0, 0.0, 0.0],
        objective: |x| (x[0] - 5.0).powi(2) + (2.0 * x[1] + 1.0).powi(2),
        constraints: |x| {
            let room = [3.0 * x[0] - x[1] - 3.0, 0.5 * x[1] - x[0] + 4.0, 7.0 - x[0] - x[1]];
            let stationarity = 2.0 * (x[1] - 1.0) - 1.5 * x[0] + x[2] - 0.5 * x[3] + x[4];
            [stationarity, room[0], room[1], room[2], room[0] * x[2], room[1] * x[3], room[2] * x[4]]
        },
    };
    assert_minimum(&problem, &[17.0]);
}
