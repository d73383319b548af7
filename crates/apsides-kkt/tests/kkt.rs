//! The public interface against dense elimination and known inertia.

mod support;

use apsides_kkt::{Inertia, KktError, KktSettings, KktSystem, Ordering};
use proptest::prelude::*;
use support::{Random, Triplets, assert_close, dense_solve, solve};

/// Solver: the tolerances at which the iterations stop.
const SOLVER: f64 = 1e-9;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-12;

/// Residual every well-posed test system must reach.
const TOLERANCE: f64 = 1e-10;

/// H = tridiagonal, diagonally dominant; J = identity part plus random entries: full row rank, inertia (nx, m, 0).
fn convex_kkt(random: &mut Random, nx: usize, m: usize) -> Triplets {
    let mut t = Triplets::new(nx + m, nx);
    for i in 0..nx {
        t.push(i, i, 3.0 + random.next());
        if i + 1 < nx {
            t.push(i + 1, i, random.next());
        }
    }
    for k in 0..m {
        t.push(nx + k, k, 2.0 + random.next());
        for j in m..nx {
            if random.next() > 0.6 {
                t.push(nx + k, j, random.next());
            }
        }
    }
    t
}

#[test]
fn agrees_with_dense_elimination_for_every_order() {
    let mut random = Random(1);
    for (nx, m) in [(1, 0), (1, 1), (5, 2), (20, 8), (60, 30), (90, 20)] {
        let t = convex_kkt(&mut random, nx, m);
        let n = nx + m;
        let b = random.vector(n);
        let reference = dense_solve(t.dense(), &b);
        let stages = (0..n).map(|i| if i < nx { i as u32 } else { (i - nx) as u32 }).collect();
        for ordering in [Ordering::Amd, Ordering::Stages(stages), Ordering::Custom((0..n).rev().collect())] {
            for equilibrate in [false, true] {
                let settings =
                    KktSettings { ordering: ordering.clone(), equilibrate, ..KktSettings::default() };
                let mut system = t.analyse(settings);
                let inertia = system.factor(&t.values, 0.0, 0.0).expect("finite");
                assert_eq!(inertia, Inertia { positive: nx, negative: m, zero: 0 });
                let (x, quality) = solve(&mut system, &b);
                assert!(quality.residual <= TOLERANCE && !quality.fallback, "{quality:?}");
                assert_close(&x, &reference, SOLVER);
            }
        }
    }
}

#[test]
fn shifts_belong_to_the_system() {
    let mut random = Random(2);
    let t = convex_kkt(&mut random, 12, 5);
    let b = random.vector(17);
    let mut dense = t.dense();
    for (i, row) in dense.iter_mut().enumerate() {
        row[i] += if i < 12 { 0.5 } else { -0.25 };
    }
    let mut system = t.analyse(KktSettings::default());
    system.factor(&t.values, 0.5, 0.25).expect("finite");
    let (x, _) = solve(&mut system, &b);
    assert_close(&x, &dense_solve(dense, &b), SOLVER);
}

#[test]
fn triangles_and_duplicates_are_one_matrix() {
    let mut random = Random(3);
    let t = convex_kkt(&mut random, 10, 4);
    let b = random.vector(14);
    let mut split = Triplets::new(14, 10);
    for (k, ((&i, &j), &v)) in t.rows.iter().zip(&t.cols).zip(&t.values).enumerate() {
        match k % 3 {
            0 => split.push(j, i, v),
            1 => {
                split.push(i, j, 0.25 * v);
                split.push(j, i, 0.75 * v);
            }
            _ => split.push(i, j, v),
        }
    }
    let (mut one, mut two) = (t.analyse(KktSettings::default()), split.analyse(KktSettings::default()));
    assert_eq!(one.factor_nonzeros(), two.factor_nonzeros());
    assert_eq!(one.factor(&t.values, 0.0, 0.0), two.factor(&split.values, 0.0, 0.0));
    assert_close(&solve(&mut one, &b).0, &solve(&mut two, &b).0, ROUNDING);
}

#[test]
fn indefinite_hessian_is_counted_and_repaired_by_the_primal_shift() {
    // H = diag(1, -2, 3), J = (1 0 0): on the null space of J, H has the eigenvalues -2 and 3.
    let mut t = Triplets::new(4, 3);
    for (i, h) in [1.0, -2.0, 3.0].into_iter().enumerate() {
        t.push(i, i, h);
    }
    t.push(3, 0, 1.0);
    let mut system = t.analyse(KktSettings::default());
    let inertia = system.factor(&t.values, 0.0, 0.0).expect("finite");
    assert_eq!(inertia, Inertia { positive: 2, negative: 2, zero: 0 });
    let inertia = system.factor(&t.values, 2.5, 0.0).expect("finite");
    assert_eq!(inertia, Inertia { positive: 3, negative: 1, zero: 0 });
}

/// A system with the same constraint twice.
fn with_one_row_twice() -> Triplets {
    let mut t = Triplets::new(4, 2);
    for (i, j, v) in [(0, 0, 1.0), (1, 1, 1.0), (2, 0, 1.0), (2, 1, 1.0), (3, 0, 1.0), (3, 1, 1.0)] {
        t.push(i, j, v);
    }
    t
}

#[test]
fn zero_pivots_are_reported_without_static_shift() {
    let t = with_one_row_twice();
    let settings = KktSettings {
        static_shift: 0.0,
        ordering: Ordering::Custom(vec![0, 1, 2, 3]),
        ..KktSettings::default()
    };
    let mut system = t.analyse(settings);
    let inertia = system.factor(&t.values, 0.0, 0.0).expect("finite");
    assert_eq!(inertia, Inertia { positive: 2, negative: 1, zero: 1 });
    // No solution exists: the residual says so.
    let (x, quality) = solve(&mut system, &[0.0, 0.0, 1.0, 2.0]);
    assert!(x.iter().all(|v| v.is_finite()));
    assert!(quality.residual > 1e-8, "{quality:?}");
    // A consistent right-hand side has solutions.
    let (x, _) = solve(&mut system, &[0.0, 0.0, 1.0, 1.0]);
    assert!(t.plain_residual(&x, &[0.0, 0.0, 1.0, 1.0]) < SOLVER);
    // The dual shift makes the system regular.
    let inertia = system.factor(&t.values, 0.0, 1e-6).expect("finite");
    assert_eq!(inertia, Inertia { positive: 2, negative: 2, zero: 0 });
    let (_, quality) = solve(&mut system, &[0.0, 0.0, 1.0, 2.0]);
    assert!(quality.residual <= TOLERANCE);
}

/// The second pivot of the given order cancels; the determinant is -1.
#[test]
fn zero_pivot_of_a_regular_matrix_is_no_zero_eigenvalue() {
    let mut t = Triplets::new(3, 3);
    for (i, j, v) in [(0, 0, 1.0), (1, 0, 1.0), (1, 1, 1.0), (2, 1, 1.0), (2, 2, 1.0)] {
        t.push(i, j, v);
    }
    let settings = KktSettings {
        static_shift: 0.0,
        ordering: Ordering::Custom(vec![0, 1, 2]),
        ..KktSettings::default()
    };
    let mut system = t.analyse(settings);
    let inertia = system.factor(&t.values, 0.0, 0.0).expect("finite");
    assert_eq!(inertia, Inertia { positive: 2, negative: 1, zero: 0 });
    let (x, quality) = solve(&mut system, &[1.0, 2.0, 3.0]);
    assert!(quality.residual <= TOLERANCE);
    assert!(t.plain_residual(&x, &[1.0, 2.0, 3.0]) < ROUNDING);
}

#[test]
fn inconsistent_singular_system_is_not_called_solved() {
    let t = with_one_row_twice();
    let mut system = t.analyse(KktSettings::default());
    system.factor(&t.values, 0.0, 0.0).expect("finite");
    let (_, quality) = solve(&mut system, &[0.0, 0.0, 1.0, 2.0]);
    assert!(quality.residual > 1e-8 && quality.fallback, "{quality:?}");
}

#[test]
fn pivots_that_were_of_no_use_are_not_tried_at_once_again() {
    let t = with_one_row_twice();
    let mut system = t.analyse(KktSettings::default());
    let mut tried = Vec::new();
    for _ in 0..8 {
        system.factor(&t.values, 0.0, 0.0).expect("finite");
        let (_, quality) = solve(&mut system, &[0.0, 0.0, 1.0, 2.0]);
        assert!(quality.residual > 1e-8, "{quality:?}");
        tried.push(quality.fallback);
    }
    // A pause of one factorisation, then of three.
    assert_eq!(tried, [true, false, true, false, false, false, true, false]);
    assert_eq!(system.counters().fallbacks, 3);
}

#[test]
fn zero_matrix_is_all_zero_inertia_without_shift() {
    let t = Triplets::new(3, 2);
    let mut system = t.analyse(KktSettings { static_shift: 0.0, ..KktSettings::default() });
    assert_eq!(system.factor(&[], 0.0, 0.0).expect("finite").zero, 3);
    let (x, quality) = solve(&mut system, &[1.0, 2.0, 3.0]);
    assert!(quality.residual > 0.1 && x.iter().all(|v| v.is_finite()));
    let inertia = system.factor(&[], 1.0, 1.0).expect("finite");
    assert_eq!(inertia, Inertia { positive: 2, negative: 1, zero: 0 });
}

#[test]
fn empty_and_scalar_systems() {
    let mut empty = KktSystem::analyse(0, 0, &[], &[], KktSettings::default()).expect("empty");
    assert_eq!(empty.solve(&[], &mut []), Err(KktError::NotFactored));
    assert_eq!(empty.factor(&[], 0.0, 0.0), Ok(Inertia::default()));
    assert_eq!(empty.solve(&[], &mut []).expect("empty").residual, 0.0);
    let mut scalar = KktSystem::analyse(1, 1, &[0], &[0], KktSettings::default()).expect("scalar");
    assert_eq!(scalar.factor(&[4.0], 0.0, 0.0).expect("finite").positive, 1);
    let (x, _) = solve(&mut scalar, &[2.0]);
    assert!((x[0] - 0.5).abs() < 0.1 * SOLVER);
}

#[test]
fn malformed_requests_are_errors() {
    let analyse = |n, primal, rows: &[usize], cols: &[usize], ordering| {
        KktSystem::analyse(n, primal, rows, cols, KktSettings { ordering, ..KktSettings::default() }).err()
    };
    assert_eq!(analyse(1, 2, &[], &[], Ordering::Amd), Some(KktError::PrimalRows { primal: 2, n: 1 }));
    let dimension = |what, found, expected| Some(KktError::Dimension { what, found, expected });
    assert_eq!(analyse(1, 1, &[0], &[], Ordering::Amd), dimension("cols", 0, 1));
    assert_eq!(
        analyse(2, 1, &[0, 2], &[0, 1], Ordering::Amd),
        Some(KktError::OutOfBounds { index: 1, row: 2, col: 1, n: 2 })
    );
    assert_eq!(analyse(2, 1, &[], &[], Ordering::Stages(vec![0])), dimension("stages", 1, 2));
    assert_eq!(analyse(2, 1, &[], &[], Ordering::Custom(vec![0])), dimension("elimination order", 1, 2));
    assert_eq!(
        analyse(2, 1, &[], &[], Ordering::Custom(vec![1, 1])),
        Some(KktError::Permutation { position: 1, row: 1, n: 2 })
    );
    for shift in [f64::NAN, -1.0, f64::INFINITY] {
        let settings = KktSettings { static_shift: shift, ..KktSettings::default() };
        assert!(matches!(KktSystem::analyse(1, 1, &[], &[], settings), Err(KktError::Negative { .. })));
    }
    let mut system = KktSystem::analyse(2, 1, &[0], &[1], KktSettings::default()).expect("well-posed");
    assert!(matches!(system.factor(&[], 0.0, 0.0), Err(KktError::Dimension { .. })));
    assert_eq!(system.factor(&[f64::NAN], 0.0, 0.0), Err(KktError::NotFinite { what: "values", index: 0 }));
    assert!(matches!(system.factor(&[1.0], -1.0, 0.0), Err(KktError::Negative { .. })));
    assert!(matches!(system.factor(&[1.0], 0.0, f64::NAN), Err(KktError::Negative { .. })));
    let mut x = [0.0; 2];
    assert_eq!(system.solve(&[1.0, 1.0], &mut x), Err(KktError::NotFactored));
    system.factor(&[1.0], 0.0, 0.0).expect("finite");
    assert!(matches!(system.solve(&[1.0], &mut x), Err(KktError::Dimension { .. })));
    assert!(matches!(system.solve(&[1.0, 1.0], &mut x[..1]), Err(KktError::Dimension { .. })));
    let nan = system.solve(&[1.0, f64::NAN], &mut x);
    assert_eq!(nan, Err(KktError::NotFinite { what: "rhs", index: 1 }));
    // A failed factorisation leaves no factor of earlier values behind.
    assert!(system.factor(&[f64::INFINITY], 0.0, 0.0).is_err());
    assert_eq!(system.solve(&[1.0, 1.0], &mut x), Err(KktError::NotFactored));
}

/// Chain of `stages` nodes of `nx` states and one control: x[k+1] - x[k] - B u[k] - C x[k] = 0, x[0] given, Hessian
/// zero except, if `barrier`, on the controls.
fn linear_chain(random: &mut Random, stages: usize, nx: usize, barrier: bool) -> (Triplets, Vec<u32>) {
    let (width, primal) = (nx + 1, stages * (nx + 1));
    let n = primal + stages * nx;
    let mut t = Triplets::new(n, primal);
    let mut stage = vec![0u32; n];
    for k in 0..stages {
        for i in 0..width {
            stage[k * width + i] = k as u32;
        }
        if barrier {
            t.push(k * width + nx, k * width + nx, 1.0 + random.next().abs());
        }
        for i in 0..nx {
            let dual = primal + k * nx + i;
            stage[dual] = k as u32;
            t.push(dual, k * width + i, 1.0);
            t.push(dual, k * width + nx, random.next());
            if k > 0 {
                for j in 0..nx {
                    let v = 0.1 * random.next() - if i == j { 0.9 } else { 0.0 };
                    t.push(dual, (k - 1) * width + j, v);
                }
            }
        }
    }
    (t, stage)
}

#[test]
fn free_linear_variables_with_equality_constraints() {
    // min c^T x, A x = b with A square and regular: the Hessian is zero, the KKT matrix regular.
    let mut random = Random(5);
    let m = 30;
    let mut t = Triplets::new(2 * m, m);
    for i in 0..m {
        t.push(m + i, i, 2.0 + random.next());
        for _ in 0..3 {
            t.push(m + i, random.below(m), 0.4 * random.next());
        }
    }
    let b = random.vector(2 * m);
    for ordering in [Ordering::Amd, Ordering::Custom((0..2 * m).collect())] {
        let mut system = t.analyse(KktSettings { ordering, ..KktSettings::default() });
        system.factor(&t.values, 0.0, 0.0).expect("finite");
        let (x, quality) = solve(&mut system, &b);
        assert!(quality.residual <= TOLERANCE, "{quality:?}");
        assert!(t.plain_residual(&x, &b) <= TOLERANCE);
    }
}

#[test]
fn chain_with_zero_hessian_diagonals() {
    let mut random = Random(6);
    for (stages, nx) in [(5, 3), (40, 5), (100, 4)] {
        let (t, stage) = linear_chain(&mut random, stages, nx, true);
        let b = random.vector(t.n);
        for ordering in [Ordering::Amd, Ordering::Stages(stage.clone())] {
            for equilibrate in [false, true] {
                let settings =
                    KktSettings { ordering: ordering.clone(), equilibrate, ..KktSettings::default() };
                let mut system = t.analyse(settings);
                let inertia = system.factor(&t.values, 0.0, 0.0).expect("finite");
                let (x, quality) = solve(&mut system, &b);
                assert_eq!(inertia, Inertia { positive: t.primal, negative: t.n - t.primal, zero: 0 });
                assert!(quality.residual <= TOLERANCE, "{quality:?}");
                assert!(!quality.fallback);
                assert!(t.plain_residual(&x, &b) <= TOLERANCE);
            }
        }
    }
}

#[test]
fn scales_from_1e_minus_12_to_1e12() {
    let mut random = Random(7);
    let t = convex_kkt(&mut random, 40, 15);
    // The same system in other units of every row and column.
    let units: Vec<f64> = (0..t.n).map(|_| 10f64.powf(6.0 * random.next())).collect();
    let mut scaled = t.clone();
    for (v, (&i, &j)) in scaled.values.iter_mut().zip(t.rows.iter().zip(&t.cols)) {
        *v *= units[i] * units[j];
    }
    let b = random.vector(t.n);
    let scaled_b: Vec<f64> = b.iter().zip(&units).map(|(b, u)| b * u).collect();
    let reference = dense_solve(t.dense(), &b);
    let mut system = scaled.analyse(KktSettings::default());
    let inertia = system.factor(&scaled.values, 0.0, 0.0).expect("finite");
    assert_eq!(inertia, Inertia { positive: 40, negative: 15, zero: 0 });
    let (x, quality) = solve(&mut system, &scaled_b);
    assert!(quality.residual <= TOLERANCE && !quality.fallback, "{quality:?}");
    let unscaled: Vec<f64> = x.iter().zip(&units).map(|(x, u)| x * u).collect();
    assert_close(&unscaled, &reference, 100.0 * SOLVER);
    // Right-hand sides tiny or huge.
    for unit in [1e-300, 1e-200, 1e200] {
        let mut system = t.analyse(KktSettings::default());
        system.factor(&t.values, 0.0, 0.0).expect("finite");
        let (x, quality) = solve(&mut system, &b.iter().map(|v| v * unit).collect::<Vec<_>>());
        assert!(quality.residual <= TOLERANCE && !quality.fallback);
        assert_close(&x.iter().map(|v| v / unit).collect::<Vec<_>>(), &reference, 10.0 * SOLVER);
    }
    // All entries tiny or huge.
    for unit in [1e-12, 1e12, 1e-150, 1e150] {
        let values: Vec<f64> = t.values.iter().map(|v| v * unit).collect();
        let mut system = t.analyse(KktSettings::default());
        system.factor(&values, 0.0, 0.0).expect("finite");
        let (x, quality) = solve(&mut system, &b);
        assert!(quality.residual <= TOLERANCE);
        let x: Vec<f64> = x.iter().map(|v| v * unit).collect();
        assert_close(&x, &reference, 10.0 * SOLVER);
    }
}

#[test]
fn barrier_terms_of_a_late_interior_point_iteration() {
    // Diagonal from 1e-10 (inactive) to 1e12 (active bound).
    let mut random = Random(8);
    let mut t = convex_kkt(&mut random, 50, 20);
    for i in 0..50 {
        t.push(i, i, 10f64.powf(1.0 + 11.0 * random.next()));
    }
    let b = random.vector(t.n);
    for equilibrate in [false, true] {
        let mut system = t.analyse(KktSettings { equilibrate, ..KktSettings::default() });
        let inertia = system.factor(&t.values, 0.0, 0.0).expect("finite");
        assert_eq!(inertia, Inertia { positive: 50, negative: 20, zero: 0 });
        let (_, quality) = solve(&mut system, &b);
        assert!(quality.residual <= TOLERANCE && !quality.fallback, "{equilibrate} {quality:?}");
    }
}

#[test]
fn pivoted_fallback_takes_over_when_refinement_cannot() {
    // Dense with a diagonal of 1e-13: without shift and pivoting, LDL^T loses all digits.
    let mut random = Random(10);
    let n = 12;
    let mut t = Triplets::new(n, n / 2);
    for i in 0..n {
        t.push(i, i, 1e-13);
        for j in 0..i {
            t.push(i, j, random.next());
        }
    }
    let b = random.vector(n);
    let reference = dense_solve(t.dense(), &b);
    let settings = KktSettings { static_shift: 0.0, max_refinements: 1, ..KktSettings::default() };
    let mut system = t.analyse(settings);
    for _ in 0..2 {
        system.factor(&t.values, 0.0, 0.0).expect("finite");
        let (x, quality) = solve(&mut system, &b);
        assert!(quality.fallback && quality.residual <= TOLERANCE, "{quality:?}");
        assert_close(&x, &reference, 10.0 * SOLVER);
        solve(&mut system, &b);
    }
    // One pivoted factorisation for each set of values, however many right-hand sides.
    assert_eq!(system.counters().fallbacks, 2);
}

#[test]
fn overflow_gives_finite_solutions_and_an_honest_residual() {
    let mut t = Triplets::new(2, 2);
    t.push(0, 0, 1e-200);
    t.push(1, 0, 1e200);
    t.push(1, 1, 1e-200);
    let settings = KktSettings {
        equilibrate: false,
        static_shift: 0.0,
        ordering: Ordering::Custom(vec![0, 1]),
        ..KktSettings::default()
    };
    let mut system = t.analyse(settings);
    let inertia = system.factor(&t.values, 0.0, 0.0).expect("finite values");
    assert_eq!(inertia.positive + inertia.negative + inertia.zero, 2);
    let (x, quality) = solve(&mut system, &[1.0, 1.0]);
    assert!(x.iter().all(|v| v.is_finite()) && quality.residual.is_finite(), "{quality:?}");
    assert!(quality.residual <= TOLERANCE || t.plain_residual(&x, &[1.0, 1.0]) > TOLERANCE);
}

#[test]
fn radau_interval_with_zero_hessian() {
    // 30 intervals of 2 points: D x - h (A x + B u) = 0 with D of the Radau points -1, 1/3 and the end point 1;
    // no Hessian but on the controls.
    let (intervals, nx) = (30, 3);
    let mut random = Random(11);
    let d = [[-2.0, 1.5, 0.5], [2.0, -4.5, 2.5]];
    let (nodes, width) = (2 * intervals, nx + 1);
    let primal = nodes * width + nx;
    let mut t = Triplets::new(primal + (nodes + 1) * nx, primal);
    let mut stage = vec![3 * nodes as u32; t.n];
    for node in 0..nodes {
        t.push(node * width + nx, node * width + nx, 0.1);
        for i in 0..=nx {
            stage[node * width + i] = 3 * node as u32 + u32::from(i < nx);
        }
        for i in 0..nx {
            let dual = primal + node * nx + i;
            stage[dual] = 3 * node as u32 + 2;
            for (m, &entry) in d[node % 2].iter().enumerate() {
                t.push(dual, (node - node % 2 + m) * width + i, entry);
            }
            for a in 0..width {
                t.push(dual, node * width + a, 0.02 * random.next());
            }
        }
    }
    for i in 0..nx {
        // Initial state given.
        t.push(primal + nodes * nx + i, i, 1.0);
    }
    let b = random.vector(t.n);
    let expected = Inertia { positive: primal, negative: t.n - primal, zero: 0 };
    for ordering in [Ordering::Amd, Ordering::Stages(stage.clone())] {
        let mut system = t.analyse(KktSettings { ordering, ..KktSettings::default() });
        assert_eq!(system.factor(&t.values, 0.0, 0.0), Ok(expected));
        let (x, quality) = solve(&mut system, &b);
        assert!(quality.residual <= TOLERANCE && !quality.fallback, "{quality:?}");
        assert!(t.plain_residual(&x, &b) <= TOLERANCE);
    }
    // Barrier terms from 1e-8 to 1e8, in the order that the crate documentation advises.
    for i in 0..primal {
        t.push(i, i, 10f64.powf(8.0 * random.next()));
    }
    let ordering = Ordering::Stages(stage.clone());
    let mut system = t.analyse(KktSettings { ordering, ..KktSettings::default() });
    assert_eq!(system.factor(&t.values, 0.0, 0.0), Ok(expected));
    let (_, quality) = solve(&mut system, &b);
    assert!(quality.residual <= TOLERANCE && !quality.fallback, "{quality:?}");
}

#[test]
fn unlimited_refinement_terminates() {
    let t = convex_kkt(&mut Random(12), 30, 10);
    let settings =
        KktSettings { max_refinements: usize::MAX, residual_tolerance: 0.0, ..KktSettings::default() };
    let mut system = t.analyse(settings);
    system.factor(&t.values, 0.0, 0.0).expect("finite");
    let (_, quality) = solve(&mut system, &[1.0; 40]);
    assert!(quality.residual < 1e-2 * ROUNDING && quality.refinements < 100, "{quality:?}");
}

#[test]
fn systems_move_between_threads() {
    fn movable<T: Send + Sync>() {}
    movable::<KktSystem>();
}

#[test]
fn counters_count() {
    let t = convex_kkt(&mut Random(9), 6, 2);
    let mut system = t.analyse(KktSettings::default());
    for _ in 0..3 {
        system.factor(&t.values, 0.0, 0.0).expect("finite");
        let (mut x, mut y) = ([0.0; 8], [0.0; 8]);
        system.solve(&[1.0; 8], &mut x).expect("factored");
        system.solve_columns([&[2.0; 8], &[3.0; 8]], [&mut x, &mut y]).expect("factored");
    }
    let counters = system.counters();
    assert_eq!((counters.factorisations, counters.solves, counters.fallbacks), (3, 9, 0));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    /// A = P^T L D L^T P with known signs of D: the inertia is known, and the solution by dense elimination.
    #[test]
    fn inertia_of_a_known_factorisation(
        seed in any::<u64>(),
        n in 1usize..30,
        equilibrate in any::<bool>(),
    ) {
        let mut random = Random(seed);
        let d: Vec<f64> = (0..n).map(|_| { let v = random.next(); v.signum() * (0.5 + v.abs()) }).collect();
        let mut l = vec![vec![0.0; n]; n];
        for i in 0..n {
            l[i][i] = 1.0;
            for j in 0..i {
                if random.next() > 0.5 {
                    l[i][j] = 0.5 * random.next();
                }
            }
        }
        let mut t = Triplets::new(n, random.below(n + 1));
        for i in 0..n {
            for j in 0..=i {
                let v: f64 = (0..=j).map(|k| l[i][k] * d[k] * l[j][k]).sum();
                if v != 0.0 {
                    t.push(i, j, v);
                }
            }
        }
        let settings = KktSettings {
            equilibrate,
            ..KktSettings::default()
        };
        let mut system = t.analyse(settings);
        let inertia = system.factor(&t.values, 0.0, 0.0).expect("finite");
        let positive = d.iter().filter(|&&v| v > 0.0).count();
        prop_assert_eq!(inertia, Inertia { positive, negative: n - positive, zero: 0 });
        let b = random.vector(n);
        let (x, quality) = solve(&mut system, &b);
        prop_assert!(quality.residual <= TOLERANCE, "{:?}", quality);
        let reference = dense_solve(t.dense(), &b);
        let size = reference.iter().fold(1.0f64, |m, v| m.max(v.abs()));
        for (x, y) in x.iter().zip(&reference) {
            prop_assert!((x - y).abs() <= 1e3 * SOLVER * size);
        }
    }

    /// Any elimination order solves the same system.
    #[test]
    fn order_does_not_change_the_solution(seed in any::<u64>(), nx in 1usize..25, m in 0usize..12) {
        let mut random = Random(seed);
        let m = m.min(nx);
        let t = convex_kkt(&mut random, nx, m);
        let n = nx + m;
        let mut order: Vec<usize> = (0..n).collect();
        for i in (1..n).rev() {
            order.swap(i, random.below(i + 1));
        }
        let b = random.vector(n);
        let mut amd = t.analyse(KktSettings::default());
        let mut custom = t.analyse(KktSettings { ordering: Ordering::Custom(order), ..KktSettings::default() });
        let one = amd.factor(&t.values, 0.0, 0.0);
        prop_assert_eq!(one, custom.factor(&t.values, 0.0, 0.0));
        let (x, y) = (solve(&mut amd, &b), solve(&mut custom, &b));
        prop_assert!(x.1.residual <= TOLERANCE && y.1.residual <= TOLERANCE);
        for (x, y) in x.0.iter().zip(&y.0) {
            prop_assert!((x - y).abs() <= 100.0 * SOLVER);
        }
    }
}
