//! Systems of intervals that are alike, which are factored together, against dense elimination.

mod support;

use apsides_kkt::{Inertia, KktSettings, KktSystem, Ordering};
use proptest::prelude::*;
use support::{Random, Triplets, assert_close, dense_solve, solve};

/// Agreement of two solvers of a well-conditioned system.
const SOLVER: f64 = 1e-9;

/// Residual that refinement reaches.
const TOLERANCE: f64 = 1e-10;

/// Sizes of a system of intervals.
#[derive(Clone, Copy, Debug)]
struct Sizes {
    intervals: usize,
    /// States inside an interval, each with an equation, and how many of them every other interval lacks; controls; states at
    /// its ends.
    states: usize,
    fewer: usize,
    controls: usize,
    ends: usize,
    /// Parameters that enter every equation.
    parameters: usize,
}

/// A program over intervals with regular equations, and the stages of its rows: what intervals have inside, then their ends.
/// Each of the optional entries is there with this probability, so that intervals differ.
fn program(random: &mut Random, sizes: Sizes, probability: f64) -> (Triplets, Vec<u32>) {
    let Sizes { intervals, states, fewer, controls, ends, parameters } = sizes;
    let inside = states + controls;
    let primal = intervals * inside + (intervals + 1) * ends + parameters;
    let mut t = Triplets::new(primal + intervals * (states + ends), primal);
    let mut stages = vec![0; t.n];
    let end = |k: usize, i: usize| intervals * inside + k * ends + i;
    let parameter = |i: usize| intervals * inside + (intervals + 1) * ends + i;
    let equation = |k: usize, i: usize| primal + k * (states + ends) + i;
    let after = 3 * intervals as u32;
    for i in 0..primal {
        t.push(i, i, 3.0 + random.next());
    }
    for k in 0..intervals {
        let first = k * inside;
        let stage = 3 * k as u32;
        let lacks = |i: usize| k % 2 == 1 && i + fewer >= states && i < states;
        for i in 0..inside {
            stages[first + i] = stage + u32::from(i >= controls);
            for j in 0..i {
                if random.next() < 2.0 * probability - 1.0 {
                    t.push(first + i, first + j, 0.5 * random.next());
                }
            }
        }
        for i in 0..states + ends {
            let row = equation(k, i);
            if lacks(i) {
                // Its state and its equation stand alone.
                t.push(row, first + controls + i, 3.0);
                continue;
            }
            stages[row] = if i < states { stage + 2 } else { after + 3 * k as u32 + 1 };
            for j in (0..states).filter(|&j| !lacks(j)) {
                let own = if i == j { 3.0 } else { 0.0 };
                t.push(row, first + controls + j, own + random.next());
            }
            for j in 0..controls {
                t.push(row, first + j, random.next());
            }
            for j in 0..ends {
                if i == states + j || random.next() < 2.0 * probability - 1.0 {
                    let own = if i == states + j { 3.0 } else { 0.0 };
                    t.push(row, end(k, j), own + random.next());
                    t.push(row, end(k + 1, j), random.next());
                }
            }
            for j in 0..parameters {
                t.push(row, parameter(j), random.next());
            }
        }
    }
    for k in 0..=intervals {
        for i in 0..ends {
            stages[end(k, i)] = after + 3 * k as u32;
        }
    }
    for i in 0..parameters {
        stages[parameter(i)] = u32::MAX;
    }
    (t, stages)
}

fn agrees_with_dense_elimination(sizes: Sizes, probability: f64, seed: u64) {
    let mut random = Random(seed);
    let (t, stages) = program(&mut random, sizes, probability);
    let b = random.vector(t.n);
    let reference = dense_solve(t.dense(), &b);
    for equilibrate in [true, false] {
        let settings =
            KktSettings { ordering: Ordering::Stages(stages.clone()), equilibrate, ..KktSettings::default() };
        let mut system = t.analyse(settings);
        for _ in 0..2 {
            let inertia = system.factor(&t.values, 0.0, 0.0).expect("finite");
            let by_degree = t.analyse(KktSettings::default()).factor(&t.values, 0.0, 0.0).expect("finite");
            assert_eq!(inertia, by_degree, "{sizes:?}");
            let (x, quality) = solve(&mut system, &b);
            assert!(quality.residual <= TOLERANCE, "{sizes:?} {quality:?}");
            assert_close(&x, &reference, SOLVER);
        }
    }
}

#[test]
fn intervals_of_all_numbers_agree_with_dense_elimination() {
    // Below four intervals, bundles with all numbers of intervals left over, wide blocks, nothing between the intervals.
    for intervals in [1, 3, 4, 5, 6, 7, 8, 13] {
        for (states, controls, ends, parameters) in
            [(3, 1, 2, 1), (1, 0, 1, 0), (6, 2, 3, 2), (5, 3, 0, 0), (4, 0, 2, 3)]
        {
            let sizes = Sizes { intervals, states, fewer: 0, controls, ends, parameters };
            agrees_with_dense_elimination(sizes, 1.0, 11 + intervals as u64);
        }
    }
}

#[test]
fn blocks_of_many_rows_agree_with_dense_elimination() {
    for states in [20, 40] {
        let sizes = Sizes { intervals: 5, states, fewer: 0, controls: 4, ends: 3, parameters: 1 };
        agrees_with_dense_elimination(sizes, 1.0, 5);
    }
}

#[test]
fn negative_curvature_in_one_interval_is_counted() {
    let sizes = Sizes { intervals: 9, states: 3, fewer: 0, controls: 2, ends: 2, parameters: 1 };
    let (mut t, stages) = program(&mut Random(3), sizes, 1.0);
    let settings = KktSettings { ordering: Ordering::Stages(stages), ..KktSettings::default() };
    let mut system = t.analyse(settings);
    let (positive, negative) = (t.primal, t.n - t.primal);
    assert_eq!(system.factor(&t.values, 0.0, 0.0), Ok(Inertia { positive, negative, zero: 0 }));
    // A control of the sixth interval, much more concave than all else is convex.
    let control = 5 * (sizes.states + sizes.controls);
    t.values[control] = -1e3;
    let found = system.factor(&t.values, 0.0, 0.0).expect("finite");
    assert_eq!(found, t.analyse(KktSettings::default()).factor(&t.values, 0.0, 0.0).expect("finite"));
    assert_eq!(found.negative, negative + 1);
    assert_eq!(system.factor(&t.values, 1e4, 0.0), Ok(Inertia { positive, negative, zero: 0 }));
}

#[test]
fn zero_pivots_and_overflows_in_one_interval_are_told() {
    let sizes = Sizes { intervals: 8, states: 3, fewer: 0, controls: 1, ends: 2, parameters: 0 };
    let (mut t, stages) = program(&mut Random(7), sizes, 1.0);
    let settings =
        KktSettings { ordering: Ordering::Stages(stages), static_shift: 0.0, ..KktSettings::default() };
    let mut system = t.analyse(settings);
    let b = Random(8).vector(t.n);
    // Rows and columns of a state inside vanish.
    let state = 2 * (sizes.states + sizes.controls) + sizes.controls;
    let original = t.values.clone();
    for (k, value) in t.values.iter_mut().enumerate() {
        if t.rows[k] == state || t.cols[k] == state {
            *value = 0.0;
        }
    }
    assert_eq!(system.factor(&t.values, 0.0, 0.0).expect("finite").zero, 1);
    let (x, quality) = solve(&mut system, &b);
    assert!(quality.residual > SOLVER && x.iter().all(|v| v.is_finite()));
    // A regular matrix afterwards is solved as ever.
    assert_eq!(system.factor(&original, 0.0, 0.0).expect("finite").zero, 0);
    t.values = original;
    assert_close(&solve(&mut system, &b).0, &dense_solve(t.dense(), &b), SOLVER);
    let mut huge = t.values.clone();
    huge[state] = f64::MAX;
    let unscaled = KktSettings { equilibrate: false, ..KktSettings::default() };
    let mut system = t.analyse(unscaled);
    let _ = system.factor(&huge, 0.0, 0.0).expect("finite");
    let (x, _) = solve(&mut system, &b);
    assert!(x.iter().all(|v| v.is_finite()));
}

#[test]
fn nothing_is_allocated_for_intervals_after_the_first_call() {
    let sizes = Sizes { intervals: 10, states: 4, fewer: 0, controls: 2, ends: 3, parameters: 1 };
    let (t, stages) = program(&mut Random(9), sizes, 1.0);
    let settings = KktSettings { ordering: Ordering::Stages(stages), ..KktSettings::default() };
    let mut system = t.analyse(settings);
    let b = Random(10).vector(t.n);
    let mut x = vec![0.0; t.n];
    let mut round = |system: &mut KktSystem, shift| {
        system.factor(&t.values, shift, 0.0).expect("finite");
        system.solve(&b, &mut x).expect("factored");
    };
    round(&mut system, 0.0);
    let count = allocation_counter::measure(|| (1..5).for_each(|k| round(&mut system, 1e-3 * f64::from(k))));
    assert_eq!(count.count_total, 0);
}

proptest! {
    #[test]
    fn intervals_that_differ_agree_with_dense_elimination(
        intervals in 1_usize..20,
        states in 1_usize..6,
        fewer in 0_usize..3,
        controls in 0_usize..4,
        ends in 0_usize..4,
        parameters in 0_usize..3,
        probability in 0.3_f64..1.0,
        seed: u64,
    ) {
        let sizes = Sizes { intervals, states, fewer: fewer.min(states), controls, ends, parameters };
        agrees_with_dense_elimination(sizes, probability, seed);
    }
}
