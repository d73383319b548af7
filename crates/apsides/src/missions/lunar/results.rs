//! Scalars and curves of a lunar mission.

use std::collections::BTreeMap;

use apsides_ad::VectorFunction;
use apsides_ocp::{PhaseTrajectory, Trajectory};

use super::phases::{BRAKING, COAST, DEORBIT, DESCENT, PITCH_UP, PeriluneAltitude, Steering};
use super::vehicle::Start;
use crate::Curve;
use crate::key::Values;

/// Those of every landing, and those of the phases that it has.
pub(super) fn results(v: &Values, t: &Trajectory) -> BTreeMap<String, f64> {
    let mut results = of_any_landing(v, t);
    results.extend(of_phases(t));
    if let Ok(start) = Start::direct(v) {
        results.extend(of_the_coast(v, &start, t));
    }
    results.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

fn phase<'a>(t: &'a Trajectory, name: &str) -> Option<&'a PhaseTrajectory> {
    t.phases.iter().find(|p| p.name == name)
}

/// Phases in the plane; the descent from a gate has fewer states.
fn planar(t: &Trajectory) -> impl DoubleEndedIterator<Item = &PhaseTrajectory> {
    t.phases.iter().filter(|p| p.state.dimension() >= 5)
}

fn of_any_landing(v: &Values, t: &Trajectory) -> BTreeMap<&'static str, f64> {
    let moon_radius_km = v.number("moon_radius_km");
    let mut results = BTreeMap::new();
    let (Some(first), Some(last)) = (t.phases.first(), t.phases.last()) else { return results };
    let final_mass = mass(last, last.final_time);
    results.insert("flight_time_s", last.final_time);
    results.insert("final_mass_kg", final_mass);
    results.insert("ignition_mass_kg", mass(first, first.initial_time));
    results.insert("propellant_kg", v.number("initial_mass_kg") - final_mass);
    if let Some(p) = planar(t).find(|p| p.name != COAST) {
        results.insert("initial_thrust_angle_deg", thrust_angle(p, p.initial_time).to_degrees());
    }
    if let Some(p) = planar(t).next_back() {
        let end = p.final_state()[1];
        results.insert("final_thrust_angle_deg", thrust_angle(p, p.final_time).to_degrees());
        results.insert("downrange_angle_deg", end.to_degrees());
        results.insert("downrange_km", end * moon_radius_km);
    }
    let altitudes = planar(t).map(|p| highest_altitude(p, moon_radius_km * 1e3));
    results.insert("max_altitude_km", altitudes.fold(f64::NEG_INFINITY, f64::max) / 1e3);
    results
}

fn of_phases(t: &Trajectory) -> BTreeMap<&'static str, f64> {
    let mut results = BTreeMap::new();
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
            results.insert(key, p.final_time - p.initial_time);
        }
    }
    if let Some((_, p)) = phase(t, DESCENT).zip(planar(t).next_back()) {
        results.insert("gate_radial_velocity_m_s", p.final_state()[3]);
    }
    if let Some(p) = phase(t, PITCH_UP) {
        results.insert("pitch_up_thrust_angle_deg", thrust_angle(p, p.initial_time).to_degrees());
    }
    results
}

/// Of flight without thrust, in a phase of its own or by the throttle.
fn of_the_coast(v: &Values, start: &Start, t: &Trajectory) -> BTreeMap<&'static str, f64> {
    let mut results = BTreeMap::new();
    if let Some((first, last)) = t.phases.first().zip(t.phases.last())
        && Steering::of(v).is_ok_and(|s| s.throttles())
    {
        // Time at full thrust that burns the same, and the rest.
        let burnt = mass(first, first.initial_time) - mass(last, last.final_time);
        let burn = burnt / start.flight.engine.mass_flow();
        results.insert("burn_time_s", burn);
        results.insert("coast_time_s", last.final_time - burn);
    }
    if let Some((coast, braking)) = phase(t, COAST).zip(phase(t, BRAKING)) {
        let end = coast.final_state();
        let [perilune] = PeriluneAltitude(start.flight).evaluate(&[end[0], end[2], end[3]]);
        results.insert("perilune_altitude_km", perilune / 1e3);
        results.insert("ignition_time_s", braking.initial_time);
        results.insert("ignition_mass_kg", end[4]);
        results.insert("ignition_altitude_km", (end[0] - start.body_radius()) / 1e3);
    }
    results
}

/// In planar and in vertical flight.
fn mass(p: &PhaseTrajectory, time: f64) -> f64 {
    p.state.component(time, if p.state.dimension() >= 5 { 4 } else { 2 })
}

/// Of a phase with thrust in the plane, where it is a state or the first control.
fn thrust_angle(p: &PhaseTrajectory, time: f64) -> f64 {
    match p.state.dimension() {
        6 => p.state.component(time, 5),
        _ => p.control_at(time).first().copied().unwrap_or(f64::NAN),
    }
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

fn highest_altitude(p: &PhaseTrajectory, body_radius: f64) -> f64 {
    sample_times(p).map(|t| p.state.component(t, 0) - body_radius).fold(f64::NEG_INFINITY, f64::max)
}

/// Altitude over the downrange distance; the vertical descent stays at its place.
pub(super) fn curves(v: &Values, t: &Trajectory) -> Vec<Curve> {
    let body_radius = v.number("moon_radius_km") * 1e3;
    let gate = planar(t).next_back().map_or(f64::NAN, |p| p.final_state()[1]);
    let place = |p: &PhaseTrajectory, time: f64| match p.state.dimension() {
        5.. => p.state.component(time, 1) * body_radius,
        _ => gate * body_radius,
    };
    let line = |p: &PhaseTrajectory| {
        let points = sample_times(p).map(|s| [place(p, s), p.state.component(s, 0) - body_radius]);
        (p.name.clone(), points.collect())
    };
    vec![Curve {
        title: "Altitude over downrange distance".into(),
        x: ("downrange distance".into(), "m".into()),
        y: ("altitude".into(), "m".into()),
        series: t.phases.iter().map(line).collect(),
    }]
}
