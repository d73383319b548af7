use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{At, Bounds, Ocp, Phase, State, Variable};
use proptest::prelude::*;

use super::*;

/// Discretisation: the tolerances of the integration and what its steps add up to.
const INTEGRATION: f64 = 1e-11;

/// The second control enters linearly, the first one with a square; time and a parameter explicitly.
struct Push;

impl Dynamics<2, 2, 1> for Push {
    fn rate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 2], p: &[S; 1]) -> [S; 2] {
        [x[1] + u[0] * p[0], u[1] * (x[0] * 0.2 + t * 0.1 + 1.0) * p[0] - x[1].square() * 0.1 + u[0] * 0.3]
    }
}

impl PathFunction<2, 2, 1, 1> for Push {
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 2], p: &[S; 1]) -> [S; 1] {
        [u[0].square() * p[0] + x[0].square() * (t + 0.5) + u[0] * u[1] * 0.2]
    }
}

fn flow() -> Flow {
    let phase = Phase::new("push", Push)
        .states([State::new("x", "-").starts_at(0.0), State::new("v", "-").starts_at(0.0)])
        .controls([Variable::new("aside", "-"), Variable::new("push", "-").within(-1.0, 1.0)])
        .final_time(Bounds::fixed(1.0))
        .integral(Variable::new("cost", "-"), Push);
    let ocp: Ocp = Ocp::builder("push")
        .parameter(Variable::new("p", "-").within(0.0, 2.0))
        .phase(phase)
        .minimize("time", "-", At::FinalTime("push"))
        .build()
        .unwrap();
    Flow::new(Hamiltonian::new(&ocp, 0, &[1.0], 0.0), 1e-13, &[1.0; 5]).unwrap()
}

fn fly(flow: &mut Flow, y: &[f64], p: f64, sensitivities: bool) -> SegmentFlight {
    let mut passage = SegmentFlight::default();
    flow.pass(&[p], (0.0, 1.0), y, &mut [0.0, 1.0], sensitivities, &mut passage).unwrap();
    passage
}

/// Step of central differences: with end states good to 1e-12 they are good to 1e-8.
const STEP: f64 = 1e-4;
const TOLERANCE: f64 = 2e-7;

proptest! {
    /// The end moves with start and parameter as the sensitivities say, which jump at the switch.
    #[test]
    fn sensitivities_cross_a_switch(
        x in prop::array::uniform2(-0.3..0.3),
        costate in (-2.0..-1.5, -0.9..-0.4),
        p in 0.8..1.2,
    ) {
        let mut flow = flow();
        let y = [x[0], x[1], costate.0, costate.1];
        let passage = fly(&mut flow, &y, p, true);
        prop_assert_eq!(passage.switches.len(), 1);
        let time = passage.switches[0].time;
        prop_assert!(time > 0.05 && time < 0.95, "{time}");
        let alone = fly(&mut flow, &y, p, false);
        for (a, b) in alone.end.iter().zip(&passage.end) {
            prop_assert!((a - b).abs() < INTEGRATION, "{a} {b}");
        }
        // Columns: states, costates, the integral of dH/dp, the parameter.
        for column in [0, 1, 2, 3, 5] {
            let [up, down] = [STEP, -STEP].map(|by| {
                let (mut y, mut p) = (y, p);
                if column < 4 { y[column] += by } else { p += by }
                fly(&mut flow, &y, p, false).end
            });
            for i in 0..5 {
                let (slope, difference) = (passage.moved[i * 6 + column], (up[i] - down[i]) / (2.0 * STEP));
                let size = slope.abs().max(1.0);
                prop_assert!((slope - difference).abs() < TOLERANCE * size, "row {i}, column {column}: {slope} {difference}");
            }
        }
    }
}
