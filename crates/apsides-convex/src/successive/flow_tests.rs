//! Derivatives against differences.

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Phase, State, Variable};
use apsides_ode::{OdeSettings, StmPropagator};

use super::*;

/// Discretisation: difference quotients, by their steps.
const DIFFERENCES: f64 = 1e-8;

struct Model;

impl Dynamics<2, 1, 1> for Model {
    fn rate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 1], p: &[S; 1]) -> [S; 2] {
        [x[1] * t, u[0] * p[0] - x[0] * x[1]]
    }
}

struct Cost;

impl PathFunction<2, 1, 1, 1> for Cost {
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 1], p: &[S; 1]) -> [S; 1] {
        [u[0] * u[0] + x[0] * p[0] * t]
    }
}

#[test]
fn derivatives_are_those_of_the_end_state_and_integrals() {
    let phase = Phase::new("a", Model)
        .states([State::new("x", "m"), State::new("v", "m/s")])
        .controls([Variable::new("u", "N")])
        .integral(Variable::new("cost", "J"), Cost);
    let mut flow = IntervalFlow::new(&phase, 1);
    (flow.start, flow.width) = (0.25, 0.25);
    let mut propagator = StmPropagator::new(3, 5, OdeSettings::with_tolerance(1e-13)).unwrap();
    let (x, inputs) = ([0.4, -0.7, 0.0], [0.3, 1.1, 0.8, 0.2, 2.6]);
    let mut end = |x: &[f64], inputs: &[f64]| {
        flow.inputs.copy_from_slice(inputs);
        propagator.propagate(&flow, 0.0, x, 1.0).unwrap();
        (propagator.state().to_vec(), propagator.stm().to_vec(), propagator.sensitivity().to_vec())
    };
    let (_, stm, sensitivity) = end(&x, &inputs);
    let h = 1e-5;
    for c in 0..2 {
        let shifted = |s: f64| std::array::from_fn::<f64, 3, _>(|k| x[k] + if k == c { s } else { 0.0 });
        let (plus, minus) = (end(&shifted(h), &inputs).0, end(&shifted(-h), &inputs).0);
        for r in 0..3 {
            assert!(
                ((plus[r] - minus[r]) / (2.0 * h) - stm[r * 3 + c]).abs() < DIFFERENCES,
                "state {c}, output {r}"
            );
        }
    }
    for c in 0..5 {
        let shifted = |s: f64| std::array::from_fn::<f64, 5, _>(|k| inputs[k] + if k == c { s } else { 0.0 });
        let (plus, minus) = (end(&x, &shifted(h)).0, end(&x, &shifted(-h)).0);
        for r in 0..3 {
            let difference = (plus[r] - minus[r]) / (2.0 * h);
            assert!((difference - sensitivity[r * 5 + c]).abs() < DIFFERENCES, "input {c}, output {r}");
        }
    }
}
