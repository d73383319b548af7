//! Scalars and curves of a landing.

use apsides_dynamics::frames::central_angle;
use apsides_ocp::{PhaseTrajectory, Trajectory};

use super::lander::{Lander, Motion};
use crate::Curve;
use crate::missions::Scalars;

/// Samples of a phase for curves.
const SAMPLES: usize = 400;

/// Of the main braking.
pub(super) fn braking(lander: &Lander, t: &Trajectory) -> Scalars {
    let (Some(first), Some(last)) = (t.phases.first(), t.phases.last()) else { return Scalars::new() };
    let (start, end) = (first.state_at(first.initial_time), last.final_state());
    let mut results = Scalars::new();
    let mut put = |key: &str, value: f64| results.insert(key.into(), value);
    let [perilune_speed, apolune_speed] = lander.orbit_speeds();
    put("perilune_speed_m_s", perilune_speed);
    put("apolune_speed_m_s", apolune_speed);
    put("start_speed_m_s", lander.start_speed);
    put("flight_time_s", last.final_time);
    let mass = end[end.len() - 1];
    put("final_mass_kg", mass);
    put("propellant_kg", lander.initial_mass - mass);
    let angle = match lander.motion {
        Motion::Plane => end[1],
        Motion::Space => {
            // In inertial space: the site has moved on with the Moon.
            let turned = lander.descent.rotation_rate * last.final_time;
            central_angle([start[1], start[2]], [end[1] + turned, end[2]])
        }
    };
    put("central_angle_deg", angle.to_degrees());
    put("downrange_km", angle * lander.body.radius / 1e3);
    match lander.motion {
        Motion::Plane => {
            put("gate_upward_speed_m_s", end[3]);
            put("gate_horizontal_speed_m_s", end[2]);
        }
        Motion::Space => {
            put("gate_upward_speed_m_s", end[3]);
            put("gate_eastward_speed_m_s", end[4]);
            put("gate_northward_speed_m_s", end[5]);
            let (longitude, latitude) = (start[1].to_degrees(), start[2].to_degrees());
            put("perilune_longitude_deg", wrapped(longitude));
            put("perilune_latitude_deg", latitude);
            // On the plane of the orbit, at the same time in axes that coincide with those of the Moon at the start.
            put("apolune_longitude_deg", wrapped(longitude + 180.0));
            put("apolune_latitude_deg", -latitude);
        }
    }
    results
}

/// Of the whole landing: those of the braking, and of each phase its time and propellant.
pub(super) fn landing(lander: &Lander, t: &Trajectory) -> Scalars {
    let Some(first) = t.phases.first() else { return Scalars::new() };
    let only_first = Trajectory { phases: vec![first.clone()], ..t.clone() };
    let mut results = braking(lander, &only_first);
    let mass = |p: &PhaseTrajectory, time: f64| p.state_at(time).last().copied().unwrap_or(f64::NAN);
    for p in &t.phases {
        let name = p.name.replace('-', "_");
        results.insert(format!("{name}_time_s"), p.final_time - p.initial_time);
        results.insert(format!("{name}_propellant_kg"), mass(p, p.initial_time) - mass(p, p.final_time));
    }
    if let Some(last) = t.phases.last() {
        let end = mass(last, last.final_time);
        results.insert("flight_time_s".into(), last.final_time);
        results.insert("final_mass_kg".into(), end);
        results.insert("propellant_kg".into(), lander.initial_mass - end);
        // Free fall from the cut-off.
        let fall =
            lander.body.gravitational_parameter * (lander.body.radius.recip() - lander.cutoff_radius.recip());
        results.insert("touchdown_speed_m_s".into(), (2.0 * fall).sqrt());
    }
    results
}

/// Into -180 to 180.
fn wrapped(degrees: f64) -> f64 {
    degrees - 360.0 * (degrees / 360.0).round()
}

/// Altitude over the way on the ground, and the thrust over time.
pub(super) fn curves(lander: &Lander, t: &Trajectory) -> Vec<Curve> {
    let radius = lander.body.radius;
    let way = |start: &[f64], x: &[f64]| match lander.motion {
        Motion::Plane => x[1] * radius,
        Motion::Space => central_angle([start[1], start[2]], [x[1], x[2]]) * radius,
    };
    let times = |p: &PhaseTrajectory| -> Vec<f64> {
        (0..=SAMPLES).map(|k| p.time_at(k as f64 / SAMPLES as f64)).collect()
    };
    let Some(start) = t.phases.first().map(|p| p.state_at(p.initial_time)) else { return Vec::new() };
    let steered = t.phases.iter().rev().find(|p| p.state.dimension() > 3);
    let end = steered.map_or(f64::NAN, |p| way(&start, &p.final_state()));
    let profile = |p: &PhaseTrajectory| {
        let point = |time: f64| {
            let x = p.state_at(time);
            // Vertical flight is above the site.
            let place = if x.len() > 3 { way(&start, &x) } else { end };
            [place, x[0] - radius]
        };
        (p.name.clone(), times(p).into_iter().map(point).collect())
    };
    let thrust = |p: &PhaseTrajectory| {
        let point = |time: f64| {
            let throttle = p.control_at(time).last().copied().unwrap_or(f64::NAN);
            [time, throttle * lander.descent.engine.thrust]
        };
        (p.name.clone(), times(p).into_iter().map(point).collect())
    };
    vec![
        Curve {
            title: "Altitude over distance on the ground".into(),
            x: ("distance".into(), "m".into()),
            y: ("altitude".into(), "m".into()),
            series: t.phases.iter().map(profile).collect(),
        },
        Curve {
            title: "Thrust".into(),
            x: ("time".into(), "s".into()),
            y: ("thrust".into(), "N".into()),
            series: t.phases.iter().map(thrust).collect(),
        },
    ]
}
