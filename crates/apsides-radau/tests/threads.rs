//! The same numbers, bit by bit, for any number of threads, on a mesh that is fine enough to be shared between them.
#![allow(clippy::unwrap_used)]

use apsides_nlp::Nlp;
use apsides_ocp::Mesh;
use apsides_problems::find;
use apsides_radau::{Radau, RadauSettings, Transcription};

/// Equations of motion alone; with an integral as the cost; with a path constraint.
const PROBLEMS: [&str; 3] = ["shuttle_reentry", "bryson_denham", "brachistochrone_wall"];
/// Times 4 points: above the least number of nodes that is shared.
const INTERVALS: usize = 800;

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|v| v.to_bits()).collect()
}

#[test]
fn solves_do_not_depend_on_threads() {
    for name in PROBLEMS {
        let case = find(name).unwrap().pose().unwrap();
        let solve = |threads| {
            let settings = RadauSettings {
                threads,
                intervals: INTERVALS,
                max_refinements: 0,
                ..RadauSettings::default()
            };
            Radau { settings }.solve(&case.ocp, &case.guess).unwrap()
        };
        let one = solve(1);
        assert!(one.status.is_success(), "{name}: {}", one.status);
        for threads in [2, 3] {
            let several = solve(threads);
            assert_eq!(several.report.counters.iterations, one.report.counters.iterations, "{name}");
            assert_eq!(bits(&several.report.x), bits(&one.report.x), "{name}, {threads} threads");
            assert_eq!(
                bits(&several.report.constraint_multipliers),
                bits(&one.report.constraint_multipliers),
                "{name}, {threads} threads"
            );
            for t in [0.0, 0.1234, 0.5, 1.0] {
                let at = |s: &apsides_radau::RadauSolution| {
                    let p = &s.trajectory.phases[0];
                    let time = p.initial_time + t * (p.final_time - p.initial_time);
                    [bits(&p.state_at(time)), bits(&p.control_at(time))]
                };
                assert_eq!(at(&several), at(&one), "{name}, {threads} threads");
            }
        }
    }
}

#[test]
fn evaluations_do_not_depend_on_threads() {
    for name in PROBLEMS {
        let case = find(name).unwrap().pose().unwrap();
        let mesh = Mesh::uniform(&case.ocp, INTERVALS, 4).unwrap();
        let evaluate = |threads| {
            let mut nlp = Transcription::new(&case.ocp, &mesh, &case.guess).unwrap().with_threads(threads);
            let mut x = vec![0.0; nlp.variables()];
            nlp.initial_point(&mut x);
            x.iter_mut().zip(0..).for_each(|(v, k)| *v *= 1.0 + 1e-3 * f64::sin(f64::from(k)));
            let y: Vec<f64> = (0..nlp.constraints()).map(|k| (k as f64).cos()).collect();
            let mut gradient = vec![0.0; x.len()];
            let mut rows = vec![0.0; y.len()];
            let mut jacobian = vec![f64::NAN; nlp.jacobian_pattern().len()];
            let mut hessian = vec![f64::NAN; nlp.hessian_pattern().len()];
            let cost = nlp.objective(&x);
            nlp.gradient(&x, &mut gradient);
            nlp.constraint_values(&x, &mut rows);
            nlp.jacobian(&x, &mut jacobian);
            nlp.hessian(&x, 1.5, &y, &mut hessian);
            let all = [vec![cost], gradient, rows, jacobian, hessian].map(|v| bits(&v));
            // Nothing is left as it was.
            assert!(all.iter().flatten().all(|b| *b != f64::NAN.to_bits()), "{name}");
            all
        };
        let one = evaluate(1);
        for threads in [2, 3, 7] {
            assert_eq!(evaluate(threads), one, "{name}, {threads} threads");
        }
    }
}

#[test]
fn no_threads_are_refused() {
    let case = find("bryson_denham").unwrap().pose().unwrap();
    for threads in [0, 1025] {
        let method = Radau { settings: RadauSettings { threads, ..RadauSettings::default() } };
        assert!(method.solve(&case.ocp, &case.guess).is_err());
    }
}
