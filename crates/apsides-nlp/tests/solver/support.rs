//! Test problems written as plain formulas, with dense derivatives.
// Shared with the benches and the tests of `apsides-optimality`, each of which uses a part.
#![allow(dead_code, unreachable_pub, clippy::print_stderr, clippy::unwrap_used)]

use std::ops::{Add, Div, Mul, Neg, Sub};

use apsides_ad::{HyperDual, Scalar};
use apsides_nlp::{
    BarrierOracle, BarrierStrategy, Flow, InteriorPoint, IterationRecord, Nlp, NlpSettings, Pattern, Scaling,
    SolveReport, Status,
};

pub const INF: f64 = f64::INFINITY;

/// A value with first and second derivatives with respect to `N` variables, for formulas with numbers on either side.
#[derive(Debug, Clone, Copy)]
pub struct Jet<const N: usize>(HyperDual<N>);

impl<const N: usize> Jet<N> {
    pub fn constant(value: f64) -> Self {
        Self(HyperDual::constant(value))
    }

    /// The variables, with the second derivatives by `first` and each other one.
    fn seeded(x: &[f64], first: usize) -> [Self; N] {
        std::array::from_fn(|i| {
            let mut jet = HyperDual::constant(x[i]);
            jet.e1 = [f64::from(u8::from(i == first)); N];
            jet.e2[i] = 1.0;
            Self(jet)
        })
    }

    pub fn powi(self, n: i32) -> Self {
        Self(self.0.powi(n))
    }

    pub fn powf(self, k: f64) -> Self {
        Self(self.0.powf(k))
    }
}

macro_rules! functions {
    ($($name:ident)*) => {
        impl<const N: usize> Jet<N> {
            $(pub fn $name(self) -> Self {
                Self(self.0.$name())
            })*
        }
    };
}

functions!(exp ln sqrt sin cos);

macro_rules! operators {
    ($($operator:ident $method:ident)*) => {$(
        impl<const N: usize> $operator for Jet<N> {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                Self(self.0.$method(other.0))
            }
        }
        impl<const N: usize> $operator<f64> for Jet<N> {
            type Output = Self;
            fn $method(self, other: f64) -> Self {
                Self(self.0.$method(other))
            }
        }
        impl<const N: usize> $operator<Jet<N>> for f64 {
            type Output = Jet<N>;
            fn $method(self, other: Jet<N>) -> Jet<N> {
                Jet::constant(self).$method(other)
            }
        }
    )*};
}

operators!(Add add Sub sub Mul mul Div div);

impl<const N: usize> Neg for Jet<N> {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

/// A dense problem of `N` variables and `M` constraints.
#[derive(Clone)]
pub struct Dense<const N: usize, const M: usize> {
    pub start: [f64; N],
    pub lower: [f64; N],
    pub upper: [f64; N],
    pub constraint_lower: [f64; M],
    pub constraint_upper: [f64; M],
    pub objective: fn(&[Jet<N>; N]) -> Jet<N>,
    pub constraints: fn(&[Jet<N>; N]) -> [Jet<N>; M],
}

impl<const N: usize> Dense<N, 0> {
    /// No constraints, no bounds.
    pub fn unconstrained(start: [f64; N], objective: fn(&[Jet<N>; N]) -> Jet<N>) -> Self {
        Self {
            start,
            lower: [-INF; N],
            upper: [INF; N],
            constraint_lower: [],
            constraint_upper: [],
            objective,
            constraints: |_| [],
        }
    }
}

impl<const N: usize, const M: usize> Nlp for Dense<N, M> {
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
        (self.objective)(&Jet::seeded(x, 0)).0.re
    }
    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        gradient.copy_from_slice(&(self.objective)(&Jet::seeded(x, 0)).0.e2);
    }
    fn constraint_values(&mut self, x: &[f64], values: &mut [f64]) {
        let jets = (self.constraints)(&Jet::seeded(x, 0));
        for (value, jet) in values.iter_mut().zip(&jets) {
            *value = jet.0.re;
        }
    }
    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        let jets = (self.constraints)(&Jet::seeded(x, 0));
        for (row, jet) in values.chunks_mut(N).zip(&jets) {
            row.copy_from_slice(&jet.0.e2);
        }
    }
    fn hessian(&mut self, x: &[f64], objective_factor: f64, multipliers: &[f64], values: &mut [f64]) {
        let mut entries = values.iter_mut();
        for i in 0..N {
            let variables = Jet::seeded(x, i);
            let mut sum = (self.objective)(&variables) * objective_factor;
            for (jet, multiplier) in (self.constraints)(&variables).into_iter().zip(multipliers) {
                sum = sum + jet * *multiplier;
            }
            entries.by_ref().zip(&sum.0.e12[..=i]).for_each(|(entry, second)| *entry = *second);
        }
    }
}

/// A problem in other units: `x = x' * variables`, and so on.
pub struct Units<P> {
    pub problem: P,
    pub scaling: Scaling,
}

impl<P: Nlp> Units<P> {
    fn inner(&self, x: &[f64]) -> Vec<f64> {
        x.iter().zip(&self.scaling.variables).map(|(x, unit)| x / unit).collect()
    }
}

impl<P: Nlp> Nlp for Units<P> {
    fn variables(&self) -> usize {
        self.problem.variables()
    }
    fn constraints(&self) -> usize {
        self.problem.constraints()
    }
    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        self.problem.variable_bounds(lower, upper);
        for (i, unit) in self.scaling.variables.iter().enumerate() {
            lower[i] *= unit;
            upper[i] *= unit;
        }
    }
    fn constraint_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        self.problem.constraint_bounds(lower, upper);
        for (i, unit) in self.scaling.constraints.iter().enumerate() {
            lower[i] *= unit;
            upper[i] *= unit;
        }
    }
    fn initial_point(&self, x: &mut [f64]) {
        self.problem.initial_point(x);
        x.iter_mut().zip(&self.scaling.variables).for_each(|(x, unit)| *x *= unit);
    }
    fn jacobian_pattern(&self) -> Pattern {
        self.problem.jacobian_pattern()
    }
    fn hessian_pattern(&self) -> Pattern {
        self.problem.hessian_pattern()
    }
    fn objective(&mut self, x: &[f64]) -> f64 {
        let x = self.inner(x);
        self.problem.objective(&x) * self.scaling.objective
    }
    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        let x = self.inner(x);
        self.problem.gradient(&x, gradient);
        for (value, unit) in gradient.iter_mut().zip(&self.scaling.variables) {
            *value *= self.scaling.objective / unit;
        }
    }
    fn constraint_values(&mut self, x: &[f64], values: &mut [f64]) {
        let x = self.inner(x);
        self.problem.constraint_values(&x, values);
        values.iter_mut().zip(&self.scaling.constraints).for_each(|(value, unit)| *value *= unit);
    }
    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        let x = self.inner(x);
        self.problem.jacobian(&x, values);
        let pattern = self.jacobian_pattern();
        for ((value, &row), &col) in values.iter_mut().zip(&pattern.rows).zip(&pattern.cols) {
            *value *= self.scaling.constraints[row] / self.scaling.variables[col];
        }
    }
    fn hessian(&mut self, x: &[f64], factor: f64, multipliers: &[f64], values: &mut [f64]) {
        let x = self.inner(x);
        let inner: Vec<f64> = multipliers.iter().zip(&self.scaling.constraints).map(|(y, u)| y * u).collect();
        self.problem.hessian(&x, factor * self.scaling.objective, &inner, values);
        let pattern = self.hessian_pattern();
        for ((value, &row), &col) in values.iter_mut().zip(&pattern.rows).zip(&pattern.cols) {
            *value /= self.scaling.variables[row] * self.scaling.variables[col];
        }
    }
    fn scaling(&self) -> Option<Scaling> {
        Some(self.scaling.clone())
    }
}

/// Problem 71 of Hock and Schittkowski: optimum 17.0140173 at (1, 4.743, 3.8211, 1.3794).
pub fn hs71() -> Dense<4, 2> {
    Dense {
        start: [1.0, 5.0, 5.0, 1.0],
        lower: [1.0; 4],
        upper: [5.0; 4],
        constraint_lower: [25.0, 40.0],
        constraint_upper: [INF, 40.0],
        objective: |x| x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2],
        constraints: |x| [x[0] * x[1] * x[2] * x[3], x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3]],
    }
}

/// Every strategy for the barrier parameter.
pub fn strategies() -> [NlpSettings; 4] {
    let adaptive = |barrier_oracle| NlpSettings {
        barrier: BarrierStrategy::Adaptive,
        barrier_oracle,
        ..NlpSettings::default()
    };
    [
        NlpSettings::default(),
        adaptive(BarrierOracle::QualityFunction),
        adaptive(BarrierOracle::Probing),
        adaptive(BarrierOracle::Loqo),
    ]
}

/// Ipopt's table on the standard error output when `NLP_LOG` is set.
pub fn log(record: &IterationRecord) -> Flow {
    if std::env::var_os("NLP_LOG").is_some() {
        eprintln!(
            "{:4}{} {:15.8e} {:9.2e} {:9.2e} {:5.1} {:9.2e} {:9.2e} {:8.2e} {:8.2e}{} {}",
            record.iteration,
            if record.restoration { 'r' } else { ' ' },
            record.objective,
            record.primal_infeasibility,
            record.dual_infeasibility,
            record.barrier.log10(),
            record.step_norm,
            record.regularisation,
            record.dual_step,
            record.primal_step,
            record.step_kind,
            record.line_search_trials
        );
    }
    Flow::Continue
}

pub fn solve_with<const N: usize, const M: usize>(
    problem: &Dense<N, M>,
    settings: &NlpSettings,
) -> SolveReport {
    InteriorPoint::new(settings.clone()).solve_observed(&mut problem.clone(), &mut log).unwrap()
}

pub fn solve<const N: usize, const M: usize>(problem: &Dense<N, M>) -> SolveReport {
    solve_with(problem, &NlpSettings::default())
}

pub fn assert_near(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    let near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= tolerance);
    assert!(near, "{found:?} instead of {expected:?}");
}

fn assert_by_all<const N: usize, const M: usize>(
    problem: &Dense<N, M>,
    is_right: impl Fn(Status) -> bool,
    check: impl Fn(&SolveReport),
) {
    for settings in strategies() {
        let report = solve_with(problem, &settings);
        let strategy = (settings.barrier, settings.barrier_oracle);
        assert!(is_right(report.status), "{strategy:?}: {} at {:?}", report.status, report.x);
        check(&report);
    }
}

/// Solves by every strategy; checks the status, and by `check` what was found.
pub fn solve_by_all<const N: usize, const M: usize>(
    problem: &Dense<N, M>,
    status: Status,
    check: impl Fn(&SolveReport),
) {
    assert_by_all(problem, |found| found == status, check);
}

/// The same with any status that calls the point a solution.
pub fn assert_success<const N: usize, const M: usize>(problem: &Dense<N, M>, check: impl Fn(&SolveReport)) {
    assert_by_all(problem, Status::is_success, check);
}
