//! Deviating landings: without deviations they are the plan; laws land where the thrust of the plan does not.
#![allow(clippy::unwrap_used)]

use apsides_control::guidance::feed_forward::FeedForward;
use apsides_pipeline::dispersion::{Deviations, Dispersed, Guidance, Onboard, Replanning};

use crate::registry;

/// Discretisation: the end of an undisturbed flight, m and m/s, and its mass, kg.
const END: f64 = 2e-3;
const END_KG: f64 = 1e-5;
/// Discretisation: deviations that are small enough to be linear, relative.
const NEARLY_LINEAR: f64 = 1e-3;
/// Discretisation: speed (m/s) and height (m) at the end of a law whose command is held for the last seconds.
const TOUCHDOWN: f64 = 0.05;

fn flights(mission: &str) -> Box<dyn Dispersed> {
    let mission = registry().load(mission, &[]).unwrap();
    let plan = mission.solve(None, &mut ()).unwrap();
    mission.mission().dispersed(&plan.trajectory).unwrap().unwrap()
}

fn anew() -> Guidance {
    Guidance::Replanned(Replanning { at_s: vec![0.0], every_s: Some(200.0) })
}

#[test]
fn without_deviations_every_steering_is_the_plan() {
    for mission in ["lunar-perilune", "lunar-direct", "lunar-two-phase", "lunar-coast", "lunar-transfer"] {
        let flights = flights(mission);
        let onboard = Onboard::default();
        let open = flights.fly(&Deviations::default(), &Guidance::OpenLoop, &onboard).unwrap();
        assert!(open[..7].iter().all(|v| v.abs() < END), "{mission}: {open:?}");
        let new = flights.fly(&Deviations::default(), &anew(), &onboard).unwrap();
        assert!(new[..6].iter().all(|v| v.abs() < 10.0 * END), "{mission}: {new:?}");
        assert!((new[7] - open[7]).abs() < END_KG, "{mission}: {new:?} {open:?}");
    }
}

#[test]
fn laws_land_where_the_thrust_of_the_plan_does_not() {
    let flights = flights("lunar-perilune");
    let d = Deviations {
        position_m: [300.0, -200.0, 400.0],
        velocity_m_s: [1.0, -1.0, 2.0],
        thrust: 0.004,
        mass_kg: -0.5,
        ..Deviations::default()
    };
    let onboard = Onboard::default();
    let fly = |guidance: &Guidance| flights.fly(&d, guidance, &onboard).unwrap();
    let open = fly(&Guidance::OpenLoop);
    assert!(open[0].abs() > 100.0, "{open:?}");
    for guidance in [anew(), Guidance::LinearRadial(FeedForward::default())] {
        let end = fly(&guidance);
        // Height and all three speeds are those of the touchdown; the range is free.
        assert!(end[0].abs() < TOUCHDOWN, "{guidance:?}: {end:?}");
        assert!([end[3], end[4], end[5]].iter().all(|v| v.abs() < TOUCHDOWN), "{guidance:?}: {end:?}");
    }
    // An optimal flight takes less than the law.
    assert!(fly(&anew())[7] > fly(&Guidance::LinearRadial(FeedForward::default()))[7]);
    // No acceleration of free size with thrust of one size; no flight without mass.
    assert!(flights.fly(&d, &Guidance::Polynomial, &onboard).is_none());
    let none = Deviations { mass_kg: -1000.0, ..Deviations::default() };
    assert!(flights.fly(&none, &Guidance::OpenLoop, &onboard).is_none());
}

#[test]
fn small_deviations_are_those_of_the_matrix() {
    let flights = flights("lunar-perilune");
    let sigma = Deviations { velocity_m_s: [0.0, 1e-4, 0.0], ..Deviations::default() };
    let covariance = flights.linear_covariance(&sigma).unwrap();
    let base = flights.fly(&Deviations::default(), &Guidance::OpenLoop, &Onboard::default()).unwrap();
    let moved = flights.fly(&sigma, &Guidance::OpenLoop, &Onboard::default()).unwrap();
    for k in 0..6 {
        let (linear, found) = (covariance[k * 6 + k].sqrt(), (moved[k] - base[k]).abs());
        assert!(
            (linear - found).abs() < NEARLY_LINEAR * covariance[0].sqrt().max(1e-4),
            "{k}: {linear} {found}"
        );
    }
}
