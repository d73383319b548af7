//! Random nonconvex problems: every solve ends, and what is called optimal satisfies the optimality conditions.

use apsides_nlp::{BarrierStrategy, InteriorPoint, Nlp, NlpSettings, Pattern, SolveReport, Status};
use proptest::prelude::*;

use crate::support::INF;

const N: usize = 5;
const M: usize = 3;

/// Objective `q(x) + 0.1 sum x^4` and constraints `q_i(x)` with indefinite quadratics `q = x^T A x + b^T x`.
#[derive(Debug, Clone)]
struct Quadratics {
    matrices: Vec<[[f64; N]; N]>,
    vectors: Vec<[f64; N]>,
    lower: [f64; N],
    upper: [f64; N],
    constraint_lower: [f64; M],
    constraint_upper: [f64; M],
    start: [f64; N],
}

impl Quadratics {
    fn value(&self, k: usize, x: &[f64]) -> f64 {
        let quadratic = |i: usize| (0..N).map(|j| self.matrices[k][i][j] * x[i] * x[j]).sum::<f64>();
        (0..N).map(|i| quadratic(i) + self.vectors[k][i] * x[i]).sum()
    }
    fn slope(&self, k: usize, x: &[f64], i: usize) -> f64 {
        let symmetric = |j: usize| self.matrices[k][i][j] + self.matrices[k][j][i];
        (0..N).map(|j| symmetric(j) * x[j]).sum::<f64>() + self.vectors[k][i]
    }
}

impl Nlp for Quadratics {
    fn variables(&self) -> usize {
        N
    }
    fn constraints(&self) -> usize {
        M
    }
    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.lower);
        upper.copy_from_slice(&self.upper);
    }
    fn constraint_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.constraint_lower);
        upper.copy_from_slice(&self.constraint_upper);
    }
    fn initial_point(&self, x: &mut [f64]) {
        x.copy_from_slice(&self.start);
    }
    fn jacobian_pattern(&self) -> Pattern {
        Pattern::dense(M, N)
    }
    fn hessian_pattern(&self) -> Pattern {
        Pattern::lower_triangle(N)
    }
    fn objective(&mut self, x: &[f64]) -> f64 {
        self.value(M, x) + 0.1 * x.iter().map(|x| x.powi(4)).sum::<f64>()
    }
    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        for i in 0..N {
            gradient[i] = self.slope(M, x, i) + 0.4 * x[i].powi(3);
        }
    }
    fn constraint_values(&mut self, x: &[f64], values: &mut [f64]) {
        for k in 0..M {
            values[k] = self.value(k, x);
        }
    }
    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        for k in 0..M {
            for i in 0..N {
                values[N * k + i] = self.slope(k, x, i);
            }
        }
    }
    fn hessian(&mut self, x: &[f64], objective_factor: f64, multipliers: &[f64], values: &mut [f64]) {
        let mut entry = 0;
        for i in 0..N {
            for j in 0..=i {
                let part = |k: usize| self.matrices[k][i][j] + self.matrices[k][j][i];
                values[entry] = objective_factor * part(M);
                values[entry] += (0..M).map(|k| multipliers[k] * part(k)).sum::<f64>();
                if i == j {
                    values[entry] += objective_factor * 1.2 * x[i] * x[i];
                }
                entry += 1;
            }
        }
    }
}

/// Bounds of all kinds: none, one, two, equal.
fn interval() -> impl Strategy<Value = (f64, f64)> {
    (0..5, -2.0..2.0, 0.0..3.0).prop_map(|(kind, low, width)| match kind {
        0 => (-INF, INF),
        1 => (low, INF),
        2 => (-INF, low),
        3 => (low, low + width),
        _ => (low, low),
    })
}

fn problems() -> impl Strategy<Value = Quadratics> {
    let number = -1.0..1.0;
    let matrix = prop::array::uniform5(prop::array::uniform5(number.clone()));
    (
        prop::collection::vec(matrix, M + 1),
        prop::collection::vec(prop::array::uniform5(number), M + 1),
        prop::array::uniform5(interval()),
        prop::array::uniform3(interval()),
        prop::array::uniform5(-3.0..3.0),
    )
        .prop_map(|(matrices, vectors, bounds, constraint_bounds, start)| Quadratics {
            matrices,
            vectors,
            lower: bounds.map(|bound| bound.0),
            upper: bounds.map(|bound| bound.1),
            constraint_lower: constraint_bounds.map(|bound| bound.0),
            constraint_upper: constraint_bounds.map(|bound| bound.1),
            start,
        })
}

/// Largest violation of the first-order conditions, each term from the problem's own functions.
fn optimality_error(problem: &mut Quadratics, report: &SolveReport) -> f64 {
    let x = &report.x;
    let (zl, zu, y) = (&report.lower_multipliers, &report.upper_multipliers, &report.constraint_multipliers);
    let mut residual = [0.0; N];
    problem.gradient(x, &mut residual);
    let mut error = 0.0_f64;
    for i in 0..N {
        residual[i] += (0..M).map(|k| y[k] * problem.slope(k, x, i)).sum::<f64>() - zl[i] + zu[i];
        error = error.max(residual[i].abs()).max(problem.lower[i] - x[i]).max(x[i] - problem.upper[i]);
        for (multiplier, slack) in [(zl[i], x[i] - problem.lower[i]), (zu[i], problem.upper[i] - x[i])] {
            let product = if slack.is_finite() { multiplier * slack } else { multiplier };
            error = error.max(product.abs()).max(-multiplier);
        }
    }
    for k in 0..M {
        let value = problem.value(k, x);
        let (above, below) = (value - problem.constraint_lower[k], problem.constraint_upper[k] - value);
        error = error.max(-above).max(-below);
        // A multiplier of a bound that does not exist is a dual residual.
        let product = |multiplier: f64, slack: f64| {
            if slack.is_finite() { multiplier * slack.max(0.0) } else { multiplier }
        };
        error = error.max(product(y[k].max(0.0), below)).max(product((-y[k]).max(0.0), above));
    }
    error
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    #[test]
    fn optimal_means_optimal(problem in problems(), is_adaptive in any::<bool>()) {
        let barrier = if is_adaptive { BarrierStrategy::Adaptive } else { BarrierStrategy::Monotone };
        let settings = NlpSettings { barrier, max_iterations: 500, ..NlpSettings::default() };
        let mut problem = problem;
        let report = InteriorPoint::new(settings).solve(&mut problem).unwrap();
        prop_assert!(report.x.iter().all(|x| x.is_finite()));
        match report.status {
            Status::Optimal => {
                let size = report.constraint_multipliers.iter().fold(1.0_f64, |size, y| size.max(y.abs()));
                let error = optimality_error(&mut problem, &report);
                prop_assert!(error <= 1e-5 * size, "{error}");
            }
            Status::Infeasible => {
                prop_assert!(report.worst_constraint.is_some());
            }
            Status::Acceptable | Status::RestorationFailed | Status::IterationLimit | Status::StepTooSmall => {}
            status => prop_assert!(false, "{status}"),
        }
    }
}
