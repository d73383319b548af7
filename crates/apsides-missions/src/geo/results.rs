//! Scalars and curves of an injection.

use apsides_dynamics::elements::Equinoctial;
use apsides_dynamics::impulsive::Apsis;
use apsides_ocp::{PhaseTrajectory, Trajectory};
use apsides_pipeline::{Curve, Scalars};

use super::checks::Switching;
use super::injection::GeoInjection;
use super::phases::is_burn;

/// Samples per interval for figures.
const SAMPLES: usize = 12;

pub(super) fn results(injection: &GeoInjection, t: &Trajectory) -> Scalars {
    let mut results = Scalars::new();
    let Some(last) = t.phases.last() else { return results };
    let mut put = |key: String, value: f64| {
        results.insert(key, value);
    };
    let engine = injection.engine();
    let mass = injection.initial_mass;
    let final_mass = injection.mass_in(&last.final_state());
    let velocity_change = engine.velocity_change(mass, final_mass);
    put("propellant_kg".into(), mass - final_mass);
    put("final_mass_kg".into(), final_mass);
    put("velocity_change_m_s".into(), velocity_change);
    if let Ok(transfer) = injection.impulsive_transfer() {
        let impulses = transfer.velocity_change();
        put("impulsive_propellant_kg".into(), mass - engine.mass_after(mass, impulses));
        put("impulsive_velocity_change_m_s".into(), impulses);
        put("losses_m_s".into(), velocity_change - impulses);
    }
    put("flight_time_h".into(), last.final_time / 3600.0);
    let mut burn_time = 0.0;
    for (k, p) in t.phases.iter().filter(|p| is_burn(&p.name)).enumerate() {
        let n = k + 1;
        let duration = p.final_time - p.initial_time;
        burn_time += duration;
        put(format!("burn_{n}_time_s"), duration);
        put(format!("burn_{n}_ignition_time_s"), p.initial_time);
        let orbit = OrbitSize::of(&injection.elements(&p.final_state()));
        let surface = injection.flight.body.radius;
        put(format!("orbit_{n}_semi_major_axis_km"), orbit.semi_major_axis / 1e3);
        put(format!("orbit_{n}_eccentricity"), orbit.eccentricity);
        put(format!("orbit_{n}_perigee_altitude_km"), (orbit.radius(Apsis::Periapsis) - surface) / 1e3);
        put(format!("orbit_{n}_apogee_altitude_km"), (orbit.radius(Apsis::Apoapsis) - surface) / 1e3);
        put(format!("orbit_{n}_inclination_deg"), orbit.inclination.to_degrees());
    }
    put("burn_time_s".into(), burn_time);
    if let Some(switching) = Switching::of(injection, t) {
        if let Some(burns) = switching.burns {
            put("largest_switching_function_on_burns".into(), burns.value);
        }
        if let Some(coasts) = switching.coasts {
            put("least_switching_function_on_coasts".into(), coasts.value);
        }
    }
    results
}

/// Size, form and tilt of an orbit, in m and rad.
struct OrbitSize {
    semi_major_axis: f64,
    eccentricity: f64,
    inclination: f64,
}

impl OrbitSize {
    fn of(orbit: &Equinoctial) -> Self {
        let eccentricity = orbit.f.hypot(orbit.g);
        Self {
            semi_major_axis: orbit.semi_latus_rectum / (1.0 - eccentricity * eccentricity),
            eccentricity,
            inclination: 2.0 * orbit.h.hypot(orbit.k).atan(),
        }
    }

    /// Distance of an apsis from the centre, m.
    fn radius(&self, apsis: Apsis) -> f64 {
        self.semi_major_axis * (1.0 - apsis.side() * self.eccentricity)
    }
}

/// Altitude over time, and the flight in its orbital plane.
pub(super) fn curves(injection: &GeoInjection, t: &Trajectory) -> Vec<Curve> {
    let surface = injection.flight.body.radius;
    let place = |state: &[f64]| {
        let Equinoctial { semi_latus_rectum, f, g, true_longitude, .. } = injection.elements(state);
        let (sin, cos) = true_longitude.sin_cos();
        let radius = semi_latus_rectum / (1.0 + f * cos + g * sin);
        (radius, [cos, sin].map(|c| c * radius / 1e3))
    };
    let series = |point: &dyn Fn(f64, &[f64]) -> [f64; 2]| {
        t.phases.iter().map(|p| (p.name.clone(), samples(p, point))).collect::<Vec<_>>()
    };
    let unit = |name: &str, unit: &str| (name.to_owned(), unit.to_owned());
    vec![
        Curve {
            title: "Altitude over time".into(),
            x: unit("time", "s"),
            y: unit("altitude", "km"),
            series: series(&|time, state| [time, (place(state).0 - surface) / 1e3]),
        },
        Curve {
            title: "Flight in the orbital plane".into(),
            x: unit("x", "km"),
            y: unit("y", "km"),
            series: series(&|_, state| place(state).1),
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
