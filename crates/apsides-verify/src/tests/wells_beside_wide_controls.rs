//! Two wells of the Hamiltonian in one control beside another one of large range, whose terms are large.

use super::parts::{breaks, phase, trajectory};
use super::{assert_failed, certify};
use crate::{Certificate, Verdict, VerifySettings, with_least_hamiltonian};
use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Ocp, Phase, State, Trajectory, Variable};

/// Iterations of Newton's method.
const NEWTON: usize = 50;

/// Solver: a control found by search on its own scale.
const SEARCHED: f64 = 1e-3;

/// `x' = u`, `y' = w`.
struct Rates;
impl Dynamics<2, 2> for Rates {
    fn rate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 2], _p: &[S; 0]) -> [S; 2] {
        [u[0], u[1]]
    }
}

/// `4 (u^2 - 0.64)^2 + 0.47 u + w^2`.
struct Wells;
impl PathFunction<2, 2, 1> for Wells {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 2], _p: &[S; 0]) -> [S; 1] {
        let well = u[0] * u[0] - 0.64;
        [well * well * 4.0 + u[0] * 0.47 + u[1] * u[1]]
    }
}

/// The bottom of the well on one side.
fn bottom(side: f64) -> f64 {
    (0..NEWTON).fold(0.8 * side, |u, _| u - (16.0 * u * (u * u - 0.64) + 0.47) / (48.0 * u * u - 10.24))
}

/// In the well on one side, with `w` as it must be.
fn in_well(side: f64, way: f64) -> (Ocp, Trajectory) {
    let wide = Variable { bounds: Bounds::new(-1e6, 1e6), ..Variable::new("w", "-") };
    let phase_of_problem = Phase::new("arc", Rates)
        .states([State::new("x", "-").starts_at(0.0), State::new("y", "-").starts_at(0.0).ends_at(way)])
        .controls([Variable::new("u", "-").within(-1.0, 1.0), wide])
        .integral(Variable::new("cost", "-"), Wells)
        .final_time(Bounds::fixed(1.0));
    let ocp = Ocp::builder("wells")
        .phase(phase_of_problem)
        .minimize_integral("arc", "cost")
        .build()
        .expect("well-posed");
    let u = bottom(side);
    let well = u * u - 0.64;
    let arc = phase(
        "arc",
        &breaks(0.0, 1.0, 5),
        4,
        |_, t| vec![u * t, way * t],
        |_, _| vec![u, way],
        |_, _| vec![0.0, -2.0 * way],
    );
    (ocp, trajectory(vec![arc], 4.0 * well * well + 0.47 * u + way * way))
}

fn certificate(side: f64, way: f64) -> Certificate {
    let (ocp, trajectory) = in_well(side, way);
    certify(&ocp, &trajectory)
}

/// The upper well is 0.746 above the lower one, whatever the other control costs.
#[test]
fn the_upper_well_is_no_extremal_beside_a_control_that_costs_much() {
    for way in [3.0, 300.0] {
        assert_failed(&certificate(1.0, way), &["least Hamiltonian"]);
        let certificate = certificate(-1.0, way);
        assert_eq!(certificate.verdict, Verdict::StrictLocalOptimum, "{certificate:#?}");
    }
}

#[test]
fn the_better_controls_are_in_the_lower_well() {
    let (ocp, trajectory) = in_well(1.0, 300.0);
    let better = with_least_hamiltonian(&ocp, &trajectory, &VerifySettings::default()).expect("it fits");
    let better = better.expect("better controls");
    for u in better.phases[0].control.segments().iter().flat_map(|s| s.values.chunks(2)) {
        assert!((u[0] - bottom(-1.0)).abs() < SEARCHED && (u[1] - 300.0).abs() < 300.0 * SEARCHED, "{u:?}");
    }
}
