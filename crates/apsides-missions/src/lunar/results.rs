//! Scalars and curves of a lunar mission.

use apsides_ad::VectorFunction;
use apsides_dynamics::Quantity;
use apsides_dynamics::planar::{
    HORIZONTAL_SPEED, MASS, POLAR_ANGLE, RADIAL_SPEED, RADIUS, STATES, THRUST_ANGLE, VERTICAL_STATES,
};
use apsides_ocp::{PhaseTrajectory, Trajectory};
use apsides_pipeline::{Curve, Scalars};

use super::lander::LunarLander;
use super::phases::{BRAKING, COAST, DEORBIT, DESCENT, PITCH_UP, PeriluneAltitude};

impl LunarLander {
    /// Scalars of every landing, and those of the phases that it has.
    pub(super) fn results(&self, t: &Trajectory) -> Scalars {
        let mut results = Scalars::new();
        let mut put = |key: &str, value: Option<f64>| {
            if let Some(value) = value {
                results.insert(key.into(), value);
            }
        };
        self.of_any_landing(t, &mut put);
        of_phases(t, &mut put);
        self.of_the_coast(t, &mut put);
        results
    }

    fn of_any_landing(&self, t: &Trajectory, put: &mut impl FnMut(&str, Option<f64>)) {
        let (Some(first), Some(last)) = (t.phases.first(), t.phases.last()) else { return };
        let surface = self.flight.body.radius;
        let final_mass = at_end(last, MASS);
        put("flight_time_s", Some(last.final_time));
        put("final_mass_kg", final_mass);
        put("ignition_mass_kg", at_begin(first, MASS));
        // The one parameter that a landing may have.
        put("departure_impulse_m_s", t.parameters.first().copied());
        put("propellant_kg", final_mass.map(|mass| self.initial_mass - mass));
        if let Some(p) = planar(t).find(|p| p.name != COAST) {
            put("initial_thrust_angle_deg", thrust_angle(p, p.initial_time).map(f64::to_degrees));
        }
        if let Some(p) = planar(t).next_back() {
            let end = at_end(p, POLAR_ANGLE);
            put("final_thrust_angle_deg", thrust_angle(p, p.final_time).map(f64::to_degrees));
            put("downrange_angle_deg", end.map(f64::to_degrees));
            put("downrange_km", end.map(|angle| angle * (surface / 1e3)));
        }
        let altitudes = planar(t).flat_map(|p| sample_times(p).filter_map(move |s| value(p, s, RADIUS)));
        put("max_altitude_km", altitudes.map(|r| r - surface).reduce(f64::max).map(|h| h / 1e3));
    }

    /// The scalars of flight without thrust, in a phase of its own or by the throttle.
    fn of_the_coast(&self, t: &Trajectory, put: &mut impl FnMut(&str, Option<f64>)) {
        if let (Some(first), Some(last)) = (t.phases.first(), t.phases.last())
            && let (Some(begin), Some(end)) = (at_begin(first, MASS), at_end(last, MASS))
            && self.throttles()
        {
            // Time at full thrust that burns the same, and the rest.
            let burn = (begin - end) / self.flight.engine.mass_flow();
            put("burn_time_s", Some(burn));
            put("coast_time_s", Some(last.final_time - burn));
        }
        if let Some((coast, braking)) = phase(t, COAST).zip(phase(t, BRAKING))
            && let [Some(radius), Some(horizontal), Some(radial)] =
                [RADIUS, HORIZONTAL_SPEED, RADIAL_SPEED].map(|q| at_end(coast, q))
        {
            let [perilune] = PeriluneAltitude(self.flight).evaluate(&[radius, horizontal, radial]);
            put("perilune_altitude_km", Some(perilune / 1e3));
            put("ignition_time_s", Some(braking.initial_time));
            put("ignition_mass_kg", at_end(coast, MASS));
            put("ignition_altitude_km", Some((radius - self.flight.body.radius) / 1e3));
        }
    }

    /// Altitude over the downrange distance; the vertical descent stays at its place.
    pub(super) fn curves(&self, t: &Trajectory) -> Vec<Curve> {
        let surface = self.flight.body.radius;
        let gate = planar(t).next_back().and_then(|p| at_end(p, POLAR_ANGLE));
        let point = |p: &PhaseTrajectory, time: f64| {
            let angle = value(p, time, POLAR_ANGLE).or(gate)?;
            Some([angle * surface, value(p, time, RADIUS)? - surface])
        };
        let line = |p: &PhaseTrajectory| {
            (p.name.clone(), sample_times(p).filter_map(|time| point(p, time)).collect())
        };
        vec![Curve {
            title: "Altitude over downrange distance".into(),
            x: ("downrange distance".into(), "m".into()),
            y: ("altitude".into(), "m".into()),
            series: t.phases.iter().map(line).collect(),
        }]
    }
}

fn of_phases(t: &Trajectory, put: &mut impl FnMut(&str, Option<f64>)) {
    let durations = [
        (DEORBIT, "deorbit_time_s"),
        (COAST, "coast_time_s"),
        (BRAKING, "braking_time_s"),
        (PITCH_UP, "pitch_up_time_s"),
        (DESCENT, "descent_time_s"),
    ];
    for (name, key) in durations {
        // A landing of one phase is its flight time.
        if let Some(p) = phase(t, name).filter(|_| t.phases.len() > 1) {
            put(key, Some(p.final_time - p.initial_time));
        }
    }
    if let Some((_, p)) = phase(t, DESCENT).zip(planar(t).next_back()) {
        put("gate_radial_velocity_m_s", at_end(p, RADIAL_SPEED));
    }
    if let Some(p) = phase(t, PITCH_UP) {
        put("pitch_up_thrust_angle_deg", thrust_angle(p, p.initial_time).map(f64::to_degrees));
    }
}

fn phase<'a>(t: &'a Trajectory, name: &str) -> Option<&'a PhaseTrajectory> {
    t.phases.iter().find(|p| p.name == name)
}

/// Phases in the plane; the descent from a gate has fewer states.
fn planar(t: &Trajectory) -> impl DoubleEndedIterator<Item = &PhaseTrajectory> {
    t.phases.iter().filter(|p| !is_vertical(p))
}

fn is_vertical(p: &PhaseTrajectory) -> bool {
    p.state.dimension() == VERTICAL_STATES.len()
}

/// A state of a phase in the plane or of a vertical one; none where the phase does not have it.
fn value(p: &PhaseTrajectory, time: f64, quantity: Quantity) -> Option<f64> {
    let states: &[Quantity] = if is_vertical(p) { &VERTICAL_STATES } else { &STATES };
    quantity.position_in(states).map(|index| p.state.component(time, index))
}

fn at_begin(p: &PhaseTrajectory, quantity: Quantity) -> Option<f64> {
    value(p, p.initial_time, quantity)
}

fn at_end(p: &PhaseTrajectory, quantity: Quantity) -> Option<f64> {
    value(p, p.final_time, quantity)
}

/// States with a limited rate of the thrust angle.
const PITCHING_STATES: [Quantity; 6] = {
    let [radius, angle, horizontal, radial, mass] = STATES;
    [radius, angle, horizontal, radial, mass, THRUST_ANGLE]
};

/// The thrust angle of a phase with thrust in the plane, where it is a state or the first control.
fn thrust_angle(p: &PhaseTrajectory, time: f64) -> Option<f64> {
    if p.state.dimension() == PITCHING_STATES.len() {
        return Some(p.state.component(time, const { THRUST_ANGLE.index_in(&PITCHING_STATES) }));
    }
    p.control_at(time).first().copied()
}

/// Samples per interval for figures and the highest point.
const SAMPLES: usize = 50;

fn sample_times(p: &PhaseTrajectory) -> impl Iterator<Item = f64> + '_ {
    let instants = |w: &[f64]| {
        let (a, b) = (w[0], w[1]);
        (0..=SAMPLES).map(move |k| a + (b - a) * k as f64 / SAMPLES as f64)
    };
    p.state.breaks().windows(2).flat_map(instants)
}
