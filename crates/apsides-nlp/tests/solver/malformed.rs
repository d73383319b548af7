//! Ill-posed requests are errors that name the place, and never panics.

use apsides_nlp::{
    InteriorPoint, Nlp, NlpError, NlpSettings, Pattern, Scaling, ScalingMethod, Stages, WarmStart,
};

use crate::support::{Dense, INF, hs71};

/// Discretisation: difference quotients, by their steps.
const DIFFERENCES: f64 = 1e-7;

/// Problem 71 with one answer replaced.
struct Broken {
    problem: Dense<4, 2>,
    jacobian: Option<Pattern>,
    hessian: Option<Pattern>,
    scaling: Option<Scaling>,
    stages: Option<Stages>,
}

impl Broken {
    fn new() -> Self {
        Self { problem: hs71(), jacobian: None, hessian: None, scaling: None, stages: None }
    }
    fn error(mut self) -> NlpError {
        let settings = NlpSettings { scaling: ScalingMethod::User, ..NlpSettings::default() };
        InteriorPoint::new(settings).solve(&mut self).expect_err("the problem is ill-posed")
    }
}

impl Nlp for Broken {
    fn variables(&self) -> usize {
        4
    }
    fn constraints(&self) -> usize {
        2
    }
    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        self.problem.variable_bounds(lower, upper);
    }
    fn constraint_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        self.problem.constraint_bounds(lower, upper);
    }
    fn initial_point(&self, x: &mut [f64]) {
        self.problem.initial_point(x);
    }
    fn jacobian_pattern(&self) -> Pattern {
        self.jacobian.clone().unwrap_or_else(|| self.problem.jacobian_pattern())
    }
    fn hessian_pattern(&self) -> Pattern {
        self.hessian.clone().unwrap_or_else(|| self.problem.hessian_pattern())
    }
    fn objective(&mut self, x: &[f64]) -> f64 {
        Nlp::objective(&mut self.problem, x)
    }
    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        self.problem.gradient(x, gradient);
    }
    fn constraint_values(&mut self, x: &[f64], values: &mut [f64]) {
        self.problem.constraint_values(x, values);
    }
    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        self.problem.jacobian(x, values);
    }
    fn hessian(&mut self, x: &[f64], objective_factor: f64, multipliers: &[f64], values: &mut [f64]) {
        self.problem.hessian(x, objective_factor, multipliers, values);
    }
    fn scaling(&self) -> Option<Scaling> {
        self.scaling.clone()
    }
    fn stages(&self) -> Option<Stages> {
        self.stages.clone()
    }
}

#[test]
fn bounds() {
    for (low, high) in [(2.0, 1.0), (f64::NAN, 1.0), (0.0, f64::NAN), (INF, INF), (-INF, -INF)] {
        let mut broken = Broken::new();
        broken.problem.lower[2] = low;
        broken.problem.upper[2] = high;
        assert!(matches!(broken.error(), NlpError::Bounds { kind: "variable", index: 2, .. }));
        let mut broken = Broken::new();
        broken.problem.constraint_lower[1] = low;
        broken.problem.constraint_upper[1] = high;
        let error = broken.error();
        assert!(matches!(error, NlpError::Bounds { kind: "constraint", index: 1, .. }));
        assert!(error.to_string().starts_with("constraint 1 has the bounds ["), "{error}");
    }
}

#[test]
fn patterns() {
    let mut broken = Broken::new();
    broken.jacobian = Some(Pattern::from_pairs([(0, 0), (1, 4)]));
    assert!(matches!(
        broken.error(),
        NlpError::PatternRange { matrix: "Jacobian", entry: 1, row: 1, col: 4, .. }
    ));
    let mut broken = Broken::new();
    broken.jacobian = Some(Pattern { rows: vec![0, 1], cols: vec![0] });
    assert!(matches!(broken.error(), NlpError::Length { found: 1, expected: 2, .. }));
    let mut broken = Broken::new();
    broken.hessian = Some(Pattern::from_pairs([(0, 0), (4, 1)]));
    assert!(matches!(broken.error(), NlpError::PatternRange { matrix: "Hessian", entry: 1, .. }));
    let mut broken = Broken::new();
    broken.hessian = Some(Pattern::from_pairs([(0, 0), (1, 3)]));
    assert!(matches!(broken.error(), NlpError::UpperTriangle { entry: 1, row: 1, col: 3 }));
}

#[test]
fn starting_points() {
    let mut broken = Broken::new();
    broken.problem.start[3] = f64::NAN;
    assert!(matches!(broken.error(), NlpError::Start { index: 3, .. }));
    let good = WarmStart {
        x: vec![1.0; 4],
        constraint_multipliers: vec![0.0; 2],
        lower_multipliers: vec![0.0; 4],
        upper_multipliers: vec![0.0; 4],
        barrier: None,
    };
    let solve = |warm: &WarmStart| InteriorPoint::default().solve_from(&mut hs71(), warm, &mut ());
    assert!(solve(&good).is_ok());
    assert!(solve(&WarmStart { x: vec![1.0; 3], ..good.clone() }).is_err());
    assert!(solve(&WarmStart { constraint_multipliers: vec![], ..good.clone() }).is_err());
    assert!(solve(&WarmStart { lower_multipliers: vec![INF; 4], ..good.clone() }).is_err());
    assert!(solve(&WarmStart { barrier: Some(-1.0), ..good }).is_err());
}

#[test]
fn scaling_and_stages() {
    let good = Scaling { objective: 1.0, variables: vec![1.0; 4], constraints: vec![1.0; 2] };
    let error = |scaling: Scaling| {
        let mut broken = Broken::new();
        broken.scaling = Some(scaling);
        broken.error()
    };
    let mut scaling = good.clone();
    scaling.variables[1] = 0.0;
    assert!(matches!(error(scaling), NlpError::Scale { kind: "variable", index: 1, .. }));
    let mut scaling = good.clone();
    scaling.constraints[0] = f64::NAN;
    assert!(matches!(error(scaling), NlpError::Scale { kind: "constraint", index: 0, .. }));
    assert!(matches!(
        error(Scaling { objective: -1.0, ..good.clone() }),
        NlpError::Scale { kind: "objective", .. }
    ));
    assert!(matches!(
        error(Scaling { variables: vec![], ..good }),
        NlpError::Length { found: 0, expected: 4, .. }
    ));
    let mut broken = Broken::new();
    broken.stages = Some(Stages { variables: vec![0; 4], constraints: vec![0; 3] });
    assert!(matches!(broken.error(), NlpError::Length { found: 3, expected: 2, .. }));
}

#[test]
fn settings() {
    let good = NlpSettings::default();
    for (name, settings) in [
        ("tolerance", NlpSettings { tolerance: 0.0, ..good.clone() }),
        ("initial_barrier", NlpSettings { initial_barrier: f64::NAN, ..good.clone() }),
        ("barrier_decrease", NlpSettings { barrier_decrease: 1.5, ..good.clone() }),
        ("bound_fraction", NlpSettings { bound_fraction: 0.7, ..good.clone() }),
        ("scaling", NlpSettings { scaling: ScalingMethod::Gradient { max: -1.0 }, ..good.clone() }),
    ] {
        let error = InteriorPoint::new(settings).solve(&mut hs71()).unwrap_err();
        assert!(error.to_string().starts_with(&format!("setting `{name}` is ")), "{error}");
    }
}

#[test]
fn wrong_derivatives_are_found() {
    let mut problem = hs71();
    let report = apsides_nlp::check_derivatives(&mut problem, &[1.5, 4.0, 3.0, 2.0]).unwrap();
    assert!(report.is_within(1e-7), "{report:?}");
    let mut broken = Broken::new();
    // Entries in a wrong order: the transposed pattern.
    broken.hessian = Some(Pattern::from_pairs([
        (0, 0),
        (1, 0),
        (1, 1),
        (2, 0),
        (2, 1),
        (2, 2),
        (3, 0),
        (3, 2),
        (3, 1),
        (3, 3),
    ]));
    let report = apsides_nlp::check_derivatives(&mut broken, &[1.5, 4.0, 3.0, 2.0]).unwrap();
    assert!(report.gradient.error < DIFFERENCES && report.jacobian.error < DIFFERENCES);
    assert!(report.hessian.error > 1e-2 && report.hessian.row + report.hessian.col >= 4, "{report:?}");
    assert!(apsides_nlp::check_derivatives(&mut broken, &[1.0]).is_err());
}
