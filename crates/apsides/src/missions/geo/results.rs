//! Scalars and curves of an injection.

use std::collections::BTreeMap;

use apsides_ocp::{PhaseTrajectory, Trajectory};

use super::checks::Switching;
use super::impulsive::Impulses;
use super::injection::Injection;
use super::phases::is_burn;
use crate::Curve;

/// Samples per interval for figures.
const SAMPLES: usize = 12;

pub(super) fn results(injection: &Injection, t: &Trajectory) -> BTreeMap<String, f64> {
    let mut results = BTreeMap::new();
    let Some(last) = t.phases.last() else { return results };
    let mut put = |key: String, value: f64| {
        results.insert(key, value);
    };
    let [_, mass] = injection.longitude_and_mass();
    let engine = injection.engine();
    let final_mass = last.final_state()[mass];
    let impulses = Impulses::of(injection).velocity_change();
    let velocity_change = engine.velocity_change(injection.mass, final_mass);
    put("propellant_kg".into(), injection.mass - final_mass);
    put("final_mass_kg".into(), final_mass);
    put("impulsive_propellant_kg".into(), injection.mass - engine.mass_after(injection.mass, impulses));
    put("velocity_change_m_s".into(), velocity_change);
    put("impulsive_velocity_change_m_s".into(), impulses);
    put("losses_m_s".into(), velocity_change - impulses);
    put("flight_time_h".into(), last.final_time / 3600.0);
    let mut burn_time = 0.0;
    for (k, p) in t.phases.iter().filter(|p| is_burn(&p.name)).enumerate() {
        let n = k + 1;
        let duration = p.final_time - p.initial_time;
        burn_time += duration;
        put(format!("burn_{n}_time_s"), duration);
        put(format!("burn_{n}_ignition_time_s"), p.initial_time);
        let orbit = Orbit::of(injection, &p.final_state());
        let surface = injection.flight.body.radius;
        put(format!("orbit_{n}_semi_major_axis_km"), orbit.semi_major_axis / 1e3);
        put(format!("orbit_{n}_eccentricity"), orbit.eccentricity);
        put(format!("orbit_{n}_perigee_altitude_km"), (orbit.apsis(-1.0) - surface) / 1e3);
        put(format!("orbit_{n}_apogee_altitude_km"), (orbit.apsis(1.0) - surface) / 1e3);
        put(format!("orbit_{n}_inclination_deg"), orbit.inclination.to_degrees());
    }
    put("burn_time_s".into(), burn_time);
    if let Some(switching) = Switching::of(injection, t) {
        if let Some(burns) = switching.burns {
            put("switching_function_on_burns_max".into(), burns.value);
        }
        if let Some(coasts) = switching.coasts {
            put("switching_function_on_coasts_min".into(), coasts.value);
        }
    }
    results
}

/// Size, form and tilt of an orbit, in m and rad.
struct Orbit {
    semi_major_axis: f64,
    eccentricity: f64,
    inclination: f64,
}

impl Orbit {
    fn of(injection: &Injection, state: &[f64]) -> Self {
        let eccentricity = state[1].hypot(state[2]);
        Self {
            semi_major_axis: state[0] / (1.0 - eccentricity * eccentricity),
            eccentricity,
            inclination: if injection.is_spatial() { 2.0 * state[3].hypot(state[4]).atan() } else { 0.0 },
        }
    }

    /// Distance of an apsis from the centre: -1 perigee, 1 apogee.
    fn apsis(&self, side: f64) -> f64 {
        self.semi_major_axis * (1.0 + side * self.eccentricity)
    }
}

/// Altitude over time, and the flight in its orbital plane.
pub(super) fn curves(injection: &Injection, t: &Trajectory) -> Vec<Curve> {
    let [longitude, _] = injection.longitude_and_mass();
    let surface = injection.flight.body.radius;
    let radius = |x: &[f64]| x[0] / (1.0 + x[1] * x[longitude].cos() + x[2] * x[longitude].sin());
    let series = |point: &dyn Fn(f64, &[f64]) -> [f64; 2]| {
        t.phases.iter().map(|p| (p.name.clone(), samples(p, point))).collect::<Vec<_>>()
    };
    let unit = |name: &str, unit: &str| (name.to_owned(), unit.to_owned());
    vec![
        Curve {
            title: "Altitude over time".into(),
            x: unit("time", "h"),
            y: unit("altitude", "km"),
            series: series(&|time, x| [time / 3600.0, (radius(x) - surface) / 1e3]),
        },
        Curve {
            title: "Flight in the orbital plane".into(),
            x: unit("x", "km"),
            y: unit("y", "km"),
            series: series(&|_, x| [x[longitude].cos(), x[longitude].sin()].map(|c| c * radius(x) / 1e3)),
        },
    ]
}

fn samples(p: &PhaseTrajectory, point: &dyn Fn(f64, &[f64]) -> [f64; 2]) -> Vec<[f64; 2]> {
    let mut points = Vec::new();
    let mut x = vec![0.0; p.state.dimension()];
    for w in p.state.breaks().windows(2) {
        for k in 0..=SAMPLES {
            let time = w[0] + (w[1] - w[0]) * k as f64 / SAMPLES as f64;
            p.state.evaluate(time, &mut x);
            points.push(point(time, &x));
        }
    }
    points
}
