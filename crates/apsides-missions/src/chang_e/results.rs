//! Scalars and curves of a landing.

use apsides_dynamics::great_circle::central_angle;
use apsides_dynamics::powered_descent::VerticalPlaneThrust;
use apsides_ocp::{PhaseTrajectory, Trajectory};
use apsides_pipeline::{Curve, Scalars};

use super::flight_state::{Across, FlightState};
use super::lander::{Lander, Motion};
use super::landing::SixStageLanding;
use super::phases::{AVOIDANCE, FINE_AVOIDANCE};

/// Samples of a phase for curves.
const SAMPLES: usize = 400;

/// Scalars of the main braking, the first phase of a flight.
pub(super) fn braking(lander: &Lander, t: &Trajectory) -> Scalars {
    let Some(phase) = t.phases.first() else { return Scalars::new() };
    let start = FlightState::at(lander.motion, phase, phase.initial_time);
    let (Some(start), Some(end)) = (start, FlightState::end(lander.motion, phase)) else {
        return Scalars::new();
    };
    let mut results = Scalars::new();
    let mut put = |key: &str, value: f64| results.insert(key.into(), value);
    let [perilune_speed, apolune_speed] = lander.orbit_speeds();
    put("perilune_speed_m_s", perilune_speed);
    put("apolune_speed_m_s", apolune_speed);
    put("start_speed_m_s", lander.start_speed);
    put("flight_time_s", phase.final_time);
    put("final_mass_kg", end.mass);
    put("propellant_kg", lander.initial_mass - end.mass);
    put("gate_upward_speed_m_s", end.upward);
    let angle = match (start.across, end.across) {
        (
            Across::Space { longitude, latitude, .. },
            Across::Space { longitude: to_longitude, latitude: to_latitude, eastward, northward },
        ) => {
            put("gate_eastward_speed_m_s", eastward);
            put("gate_northward_speed_m_s", northward);
            put("perilune_longitude_deg", wrapped(longitude.to_degrees()));
            put("perilune_latitude_deg", latitude.to_degrees());
            // On the plane of the orbit, at the same time in axes that coincide with those of the Moon at the start.
            put("apolune_longitude_deg", wrapped(longitude.to_degrees() + 180.0));
            put("apolune_latitude_deg", -latitude.to_degrees());
            // In inertial space: the site has moved on with the Moon.
            let turned = lander.descent.rotation_rate * phase.final_time;
            central_angle([longitude, latitude], [to_longitude + turned, to_latitude])
        }
        (_, Across::Plane { angle, forward }) => {
            put("gate_horizontal_speed_m_s", forward);
            angle
        }
        _ => return results,
    };
    put("central_angle_deg", angle.to_degrees());
    put("downrange_km", angle * lander.body.radius / 1e3);
    results
}

/// Scalars of the whole landing: those of the braking, and of each phase its time and propellant.
pub(super) fn landing(landing: &SixStageLanding, t: &Trajectory) -> Scalars {
    let lander = &landing.lander;
    let mut results = braking(lander, t);
    let mass = |p: &PhaseTrajectory, time: f64| FlightState::at(lander.motion, p, time).map(|s| s.mass);
    for p in &t.phases {
        let name = p.name.replace('-', "_");
        results.insert(format!("{name}_time_s"), p.final_time - p.initial_time);
        if let (Some(start), Some(end)) = (mass(p, p.initial_time), mass(p, p.final_time)) {
            results.insert(format!("{name}_propellant_kg"), start - end);
        }
    }
    let Some(last) = t.phases.last() else { return results };
    results.insert("flight_time_s".into(), last.final_time);
    if let Some(end) = mass(last, last.final_time) {
        results.insert("final_mass_kg".into(), end);
        results.insert("propellant_kg".into(), lander.initial_mass - end);
    }
    for (name, divert) in [("coarse", landing.coarse_divert()), ("fine", landing.fine_divert())] {
        if divert.is_needed() {
            let way = divert.angle * lander.body.radius;
            results.insert(format!("{name}_divert_m"), way);
            results.insert(format!("{name}_divert_course_deg"), divert.course.to_degrees());
            results.insert(format!("{name}_site_rise_m"), divert.rise);
        }
    }
    results.insert("touchdown_speed_m_s".into(), landing.touchdown_speed());
    results
}

/// An angle in -180 to 180 deg.
fn wrapped(degrees: f64) -> f64 {
    degrees - 360.0 * (degrees / 360.0).round()
}

/// Altitude over the way on the ground and thrust over time, of the main braking alone.
pub(super) fn braking_curves(lander: &Lander, t: &Trajectory) -> Vec<Curve> {
    Profile { lander, diverts: [None; 2] }.curves(t)
}

/// The same of the whole landing.
pub(super) fn landing_curves(landing: &SixStageLanding, t: &Trajectory) -> Vec<Curve> {
    let models = [landing.coarse_divert(), landing.fine_divert()].map(|d| landing.lander.in_plane_of(&d));
    let [coarse, fine] = &models;
    Profile { lander: &landing.lander, diverts: [Some(coarse), Some(fine)] }.curves(t)
}

/// The data that curves are drawn from.
struct Profile<'a> {
    lander: &'a Lander,
    /// Flights in the vertical planes of both diverts, where there are any.
    diverts: [Option<&'a VerticalPlaneThrust>; 2],
}

impl Profile<'_> {
    /// The flight of a divert.
    fn divert(&self, p: &PhaseTrajectory) -> Option<&VerticalPlaneThrust> {
        let [coarse, fine] = self.diverts;
        match p.name.as_str() {
            AVOIDANCE => coarse,
            FINE_AVOIDANCE => fine,
            _ => None,
        }
    }

    /// Throttle along a phase; NaN at rest, where there is none.
    fn throttle(&self, p: &PhaseTrajectory, time: f64) -> f64 {
        match (self.lander.motion, &p.control_at(time)[..], self.divert(p)) {
            (Motion::Space, &[tilt, part], Some(divert)) => divert.throttle(tilt, part),
            (_, &[.., throttle], _) => throttle,
            _ => f64::NAN,
        }
    }

    /// Distance on the ground from the start of a flight; none of vertical flight, which stays where the phase before ended.
    fn distance(&self, start: [f64; 2], p: &PhaseTrajectory, across: Across) -> Option<f64> {
        let angle = match across {
            Across::Plane { angle, .. } => angle,
            Across::Space { longitude, latitude, .. } => central_angle(start, [longitude, latitude]),
            Across::Divert { angle } => central_angle(start, self.divert(p)?.place_at(angle)),
            Across::Above => return None,
        };
        Some(angle * self.lander.body.radius)
    }

    /// Altitude over the way on the ground, and the thrust over time.
    fn curves(&self, t: &Trajectory) -> Vec<Curve> {
        let Lander { motion, body, descent, .. } = self.lander;
        let times = |p: &PhaseTrajectory| -> Vec<f64> {
            (0..=SAMPLES).map(|k| p.time_at(k as f64 / SAMPLES as f64)).collect()
        };
        let first = t.phases.first().and_then(|p| FlightState::at(*motion, p, p.initial_time));
        let start = match first.map(|s| s.across) {
            Some(Across::Space { longitude, latitude, .. }) => [longitude, latitude],
            Some(_) => [0.0; 2],
            None => return Vec::new(),
        };
        let mut above = f64::NAN;
        let mut profiles = Vec::new();
        for p in &t.phases {
            let states = times(p).into_iter().filter_map(|time| FlightState::at(*motion, p, time));
            let points: Vec<[f64; 2]> = states
                .map(|s| [self.distance(start, p, s.across).unwrap_or(above), s.radius - body.radius])
                .collect();
            above = points.last().map_or(above, |[distance, _]| *distance);
            profiles.push((p.name.clone(), points));
        }
        let thrust = |p: &PhaseTrajectory| {
            let point = |time: f64| [time, self.throttle(p, time) * descent.engine.thrust];
            (p.name.clone(), times(p).into_iter().map(point).collect())
        };
        vec![
            Curve {
                title: "Altitude over distance on the ground".into(),
                x: ("distance".into(), "m".into()),
                y: ("altitude".into(), "m".into()),
                series: profiles,
            },
            Curve {
                title: "Thrust".into(),
                x: ("time".into(), "s".into()),
                y: ("thrust".into(), "N".into()),
                series: t.phases.iter().map(thrust).collect(),
            },
        ]
    }
}
