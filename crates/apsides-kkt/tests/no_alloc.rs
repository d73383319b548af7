//! After the first call, `factor` and `solve` allocate nothing.

use apsides_kkt::{KktSettings, KktSystem, Ordering};

/// min 1/2 |x|^2 with a chain of constraints x[k+1] - x[k] = 0 and, if `linear`, no Hessian on odd variables.
fn chain(n: usize, linear: bool) -> (Vec<usize>, Vec<usize>, Vec<f64>) {
    let (mut rows, mut cols, mut values) = (Vec::new(), Vec::new(), Vec::new());
    let mut push = |i, j, v| {
        rows.push(i);
        cols.push(j);
        values.push(v);
    };
    for i in 0..n {
        push(i, i, if linear && i % 2 == 1 { 0.0 } else { 1.0 });
        if i + 1 < n {
            push(n + i, i, -1.0);
            push(n + i, i + 1, 1.0);
        }
    }
    (rows, cols, values)
}

#[test]
fn factor_and_solve_allocate_nothing() {
    // Classical refinement; the pivoted fallback (no refinement allowed); GMRES (a shift that slows refinement).
    for (static_shift, max_refinements) in [(1e-9, 10), (1e-9, 0), (0.5, 10)] {
        for linear in [false, true] {
            let n = 60;
            let (rows, cols, values) = chain(n, linear);
            let stages = (0..n as u32).chain(0..n as u32 - 1).collect();
            let settings = KktSettings {
                static_shift,
                max_refinements,
                ordering: Ordering::Stages(stages),
                ..KktSettings::default()
            };
            let mut system = KktSystem::analyse(2 * n - 1, n, &rows, &cols, settings).expect("well-posed");
            let rhs: Vec<f64> = (0..2 * n - 1).map(|i| (i as f64).sin()).collect();
            let mut x = vec![0.0; 2 * n - 1];
            let mut other = x.clone();
            let mut round = |system: &mut KktSystem, shift| {
                system.factor(&values, shift, 0.0).expect("finite");
                system.solve(&rhs, &mut x).expect("factored");
                system.solve_columns([&rhs, &rhs], [&mut x, &mut other]).expect("factored");
            };
            round(&mut system, 0.0);
            let count = allocation_counter::measure(|| {
                for k in 0..5 {
                    round(&mut system, 1e-3 * f64::from(k));
                }
            });
            assert_eq!(count.count_total, 0, "linear {linear} shift {static_shift}");
            let counters = system.counters();
            assert!(counters.fallbacks > 0 || max_refinements > 0);
            assert!(
                counters.refinements > 3 * counters.solves || static_shift < 0.5,
                "{counters:?} {linear}"
            );
        }
    }
}
