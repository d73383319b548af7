//! Scalars and curves of a re-entry.

use std::collections::BTreeMap;

use apsides_ad::PathFunction;
use apsides_basis::golden_section;
use apsides_dynamics::entry::{Banked, EntryState};
use apsides_dynamics::great_circle::{along_and_across, central_angle};
use apsides_ocp::{PhaseTrajectory, Trajectory};

use apsides_pipeline::Curve;

use super::capsule::CapsuleEntry;
use super::load::{Load, LoadOf};
use super::steering::Steering;

/// Samples per interval for figures, and for the search of peaks.
const SAMPLES: usize = 16;
/// Evaluations of the search around the largest sample: the bracket ends at 1e-9 of its length.
const SEARCH_EVALUATIONS: usize = 46;

/// A trajectory of the capsule with what follows from state and control.
struct Flown<'a> {
    capsule: &'a CapsuleEntry,
    phase: &'a PhaseTrajectory,
    steering: Steering,
    loads: [LoadOf<Banked>; 3],
}

impl<'a> Flown<'a> {
    fn of(capsule: &'a CapsuleEntry, t: &'a Trajectory) -> Option<Self> {
        let phase = t.phases.first()?;
        let steering = if phase.control.dimension() == 1 { Steering::Angle } else { Steering::Vector };
        let model = Banked(capsule.flight.clone());
        let loads = capsule.loads().map(|load| LoadOf::new(&model, load));
        Some(Self { capsule, phase, steering, loads })
    }

    fn bank(&self, segment: usize, time: f64) -> f64 {
        let mut controls = vec![0.0; self.phase.control.dimension()];
        self.phase.control.evaluate_in(segment, time, &mut controls);
        self.steering.bank_of(&controls)
    }

    fn state(&self, time: f64) -> [f64; 6] {
        let mut x = [0.0; 6];
        self.phase.state.evaluate(time, &mut x);
        x
    }

    fn load(&self, index: usize, segment: usize, time: f64) -> f64 {
        let x = self.state(time);
        let [value] = self.loads[index].evaluate(time, &x, &[self.bank(segment, time)], &[]);
        value
    }

    /// Points of a curve, from control interval, time and state.
    fn line(&self, point: impl Fn(usize, f64, &EntryState) -> [f64; 2]) -> Vec<[f64; 2]> {
        let mut points = Vec::new();
        for (k, [a, b]) in self.intervals() {
            for j in 0..=SAMPLES {
                let time = a + (b - a) * j as f64 / SAMPLES as f64;
                points.push(point(k, time, &self.state(time).into()));
            }
        }
        points
    }

    fn intervals(&self) -> impl Iterator<Item = (usize, [f64; 2])> + '_ {
        self.phase.control.breaks().windows(2).map(|w| [w[0], w[1]]).enumerate()
    }

    /// Time and value of the largest load, by golden section around the largest sample.
    fn peak(&self, index: usize) -> [f64; 2] {
        let mut largest = (f64::NEG_INFINITY, 0, 0.0, 0.0);
        for (k, [a, b]) in self.intervals() {
            let spacing = (b - a) / SAMPLES as f64;
            for j in 0..=SAMPLES {
                let time = a + spacing * j as f64;
                let value = self.load(index, k, time);
                if value > largest.0 {
                    largest = (value, k, time, spacing);
                }
            }
        }
        let (_, segment, time, spacing) = largest;
        let breaks = self.phase.control.breaks();
        let around = [(time - spacing).max(breaks[segment]), (time + spacing).min(breaks[segment + 1])];
        let [found, lowest] =
            golden_section(around, SEARCH_EVALUATIONS, |time| -self.load(index, segment, time));
        [found, -lowest]
    }
}

/// Name of a peak in the results, and its unit there.
fn key_of(load: Load) -> (&'static str, &'static str, f64) {
    match load {
        Load::DynamicPressure => ("dynamic_pressure", "kpa", 1e-3),
        Load::TotalAcceleration | Load::NormalAcceleration => ("load", "m_s2", 1.0),
        Load::HeatRate => ("heat_rate", "kw_m2", 1e-3),
    }
}

pub(super) fn results(capsule: &CapsuleEntry, t: &Trajectory) -> BTreeMap<String, f64> {
    let mut results = BTreeMap::new();
    let Some(flown) = Flown::of(capsule, t) else { return results };
    let mut put = |key: String, value: f64| {
        results.insert(key, value);
    };
    let end = EntryState::from(flown.state(flown.phase.final_time));
    let start = capsule.start;
    let radius_km = capsule.flight.planet.body.radius / 1e3;
    put("heat_load_mj_m2".into(), heat_load(&flown) / 1e6);
    put("flight_time_s".into(), flown.phase.final_time - flown.phase.initial_time);
    put("final_speed_m_s".into(), end.speed);
    put("final_path_angle_deg".into(), end.path_angle.to_degrees());
    put("final_azimuth_deg".into(), end.azimuth.to_degrees());
    for (index, load) in capsule.loads().into_iter().enumerate() {
        let (name, unit, factor) = key_of(load);
        let [time, value] = flown.peak(index);
        let at = EntryState::from(flown.state(time));
        put(format!("peak_{name}_{unit}"), value * factor);
        put(format!("peak_{name}_time_s"), time);
        put(format!("peak_{name}_altitude_km"), at.altitude / 1e3);
        put(format!("peak_{name}_speed_m_s"), at.speed);
    }
    let (from, to) = (start.place(), end.place());
    put("range_km".into(), central_angle(from, to) * radius_km);
    // Against the great circle of the velocity at entry.
    let [along, across] = along_and_across(from, to, capsule.flight.heading.of_course(start.azimuth));
    put("downrange_km".into(), along * radius_km);
    put("crossrange_km".into(), across * radius_km);
    put("target_miss_km".into(), capsule.distance_to_target(to) / 1e3);
    put("lift_to_drag".into(), capsule.lift_to_drag());
    results
}

/// States with bank angles (rad) in order of time.
pub(super) fn moments(capsule: &CapsuleEntry, t: &Trajectory) -> Vec<(EntryState, f64)> {
    let Some(flown) = Flown::of(capsule, t) else { return Vec::new() };
    let mut found = Vec::new();
    for (k, [a, b]) in flown.intervals() {
        // The control at the end of an interval belongs to the next, that at the end of the flight is extrapolated.
        for j in 0..SAMPLES {
            let time = a + (b - a) * j as f64 / SAMPLES as f64;
            found.push((flown.state(time).into(), flown.bank(k, time)));
        }
    }
    found
}

/// Integral of the heat rate, J/m2.
fn heat_load(flown: &Flown<'_>) -> f64 {
    let rule = match apsides_basis::Gauss::shared(QUADRATURE_POINTS) {
        Ok(rule) => rule,
        Err(_) => return f64::NAN,
    };
    let heat = flown.capsule.loads().iter().position(|l| *l == Load::HeatRate).unwrap_or(0);
    let mut sum = 0.0;
    for (k, [a, b]) in flown.intervals() {
        for (node, weight) in rule.nodes().iter().zip(rule.weights()) {
            let time = 0.5 * ((1.0 - node) * a + (1.0 + node) * b);
            sum += 0.5 * (b - a) * weight * flown.load(heat, k, time);
        }
    }
    sum
}

/// Points of the quadrature of each interval.
const QUADRATURE_POINTS: usize = 20;

pub(super) fn curves(capsule: &CapsuleEntry, t: &Trajectory) -> Vec<Curve> {
    let Some(flown) = Flown::of(capsule, t) else { return Vec::new() };
    let one = |points| vec![(flown.phase.name.clone(), points)];
    let curve = |title: &str, x: [&str; 2], y: [&str; 2], series| Curve {
        title: title.into(),
        x: (x[0].into(), x[1].into()),
        y: (y[0].into(), y[1].into()),
        series,
    };
    let loads = capsule.loads().into_iter().enumerate().map(|(index, load)| {
        let limit = capsule.limits().find(|(l, _)| *l == load);
        let size = limit.map_or_else(|| flown.peak(index)[1], |l| l.1);
        (load.quantity().name.to_owned(), flown.line(|k, time, _| [time, flown.load(index, k, time) / size]))
    });
    vec![
        curve(
            "Altitude over speed",
            ["speed", "m/s"],
            ["altitude", "km"],
            one(flown.line(|_, _, x| [x.speed, x.altitude / 1e3])),
        ),
        curve(
            "Ground track",
            ["longitude", "deg"],
            ["latitude", "deg"],
            one(flown.line(|_, _, x| x.place().map(f64::to_degrees))),
        ),
        curve(
            "Bank angle over time",
            ["time", "s"],
            ["bank angle", "deg"],
            one(flown.line(|k, time, _| [time, flown.bank(k, time).to_degrees()])),
        ),
        curve(
            "Loads relative to their limits, or to their peaks",
            ["time", "s"],
            ["load", "-"],
            loads.collect(),
        ),
    ]
}
