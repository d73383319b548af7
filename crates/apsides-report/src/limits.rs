//! Limits of a flight and what is left of them: bounds of states and controls and path constraints, where the flight comes near to them.

use apsides_ocp::{Ocp, Phase, PhaseTrajectory, Trajectory, Variable};

/// Points of an interval at which limits are looked at.
const STEPS: usize = 12;
/// A limit with more room than this part of its range is none that the flight comes near to.
const NEAR: f64 = 0.1;
/// Within this part of the range a flight is at the limit.
const AT: f64 = 1e-4;

/// A limit that the flight comes near to.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Limit {
    /// Quantity, and its unit.
    pub(crate) name: String,
    pub(crate) unit: String,
    /// Phases in which it holds with this value.
    pub(crate) phases: Vec<String>,
    /// True of an upper limit.
    pub(crate) is_upper: bool,
    /// Value of the limit.
    pub(crate) value: f64,
    /// The value that comes closest, and its time.
    pub(crate) reached: f64,
    pub(crate) time: f64,
    /// The time for which the flight is at the limit.
    pub(crate) time_at: f64,
    /// Duration of the phases.
    pub(crate) duration: f64,
    /// Size by which margins are judged.
    range: f64,
    /// Path constraints are always told of.
    is_path: bool,
}

impl Limit {
    /// Room that is left, not negative but for what is exceeded.
    pub(crate) fn margin(&self) -> f64 {
        if self.is_upper { self.value - self.reached } else { self.reached - self.value }
    }

    fn is_worth_a_row(&self) -> bool {
        self.is_path || self.margin() <= NEAR * self.range
    }

    /// Takes the same limit of another phase.
    fn join(&mut self, other: Self) {
        if other.margin() < self.margin() {
            (self.reached, self.time) = (other.reached, other.time);
        }
        self.phases.extend(other.phases);
        self.time_at += other.time_at;
        self.duration += other.duration;
        self.range = self.range.max(other.range);
    }
}

/// The limits that a flight comes near to, in the order of phases; of path constraints all.
pub(crate) fn limits(ocp: &Ocp, trajectory: &Trajectory) -> Vec<Limit> {
    let mut found: Vec<Limit> = Vec::new();
    for (phase, flown) in ocp.phases.iter().zip(&trajectory.phases) {
        for limit in of_phase(phase, flown, &trajectory.parameters) {
            let same = |known: &&mut Limit| {
                known.name == limit.name && known.is_upper == limit.is_upper && known.value == limit.value
            };
            match found.iter_mut().find(same) {
                Some(known) => known.join(limit),
                None => found.push(limit),
            }
        }
    }
    found.retain(Limit::is_worth_a_row);
    found
}

fn of_phase(phase: &Phase, flown: &PhaseTrajectory, parameters: &[f64]) -> Vec<Limit> {
    let rows: Vec<(&Variable, bool)> = (phase.states.iter().map(|s| (&s.variable, false)))
        .chain(phase.controls.iter().map(|c| (c, false)))
        .chain(phase.path.iter().flat_map(|p| p.rows.iter().map(|row| (row, true))))
        .collect();
    let values = along(phase, flown, parameters);
    let mut found = Vec::new();
    for (k, (variable, is_path)) in rows.into_iter().enumerate() {
        let ends = [variable.bounds.lower, variable.bounds.upper];
        let column = || values.iter().filter_map(|(time, row)| Some((*time, *row.get(k)?)));
        for (side, value) in ends.into_iter().enumerate() {
            if !value.is_finite() || variable.guards[side] || ends[0] == ends[1] {
                continue;
            }
            let is_upper = side == 1;
            let room = |v: f64| if is_upper { value - v } else { v - value };
            let Some((time, reached)) = column().min_by(|a, b| room(a.1).total_cmp(&room(b.1))) else {
                continue;
            };
            let spread = column().fold(0.0_f64, |m, (_, v)| m.max((v - value).abs()));
            let range = if ends.iter().all(|e| e.is_finite()) { ends[1] - ends[0] } else { spread };
            let is_at = |(_, v): &(f64, f64)| room(*v) <= AT * range;
            let points: Vec<(f64, f64)> = column().collect();
            let time_at = points.windows(2).filter(|pair| pair.iter().all(is_at)).map(|pair| match pair {
                [a, b] => b.0 - a.0,
                _ => 0.0,
            });
            found.push(Limit {
                name: variable.name.clone(),
                unit: variable.unit.clone(),
                phases: vec![phase.name.clone()],
                is_upper,
                value,
                reached,
                time,
                time_at: time_at.sum(),
                duration: flown.final_time - flown.initial_time,
                range,
                is_path,
            });
        }
    }
    found
}

/// States, controls and path constraints at times along a phase.
fn along(phase: &Phase, flown: &PhaseTrajectory, parameters: &[f64]) -> Vec<(f64, Vec<f64>)> {
    let mut rows = Vec::new();
    for (k, ends) in flown.state.breaks().windows(2).enumerate() {
        let [from, to] = ends else { continue };
        for step in 0..=STEPS {
            let time = from + (to - from) * step as f64 / STEPS as f64;
            let mut row = vec![0.0; flown.state.dimension() + flown.control.dimension()];
            let (states, controls) = row.split_at_mut(flown.state.dimension());
            flown.state.evaluate_in(k, time, states);
            flown.control.evaluate(time, controls);
            let inputs: Vec<f64> = row.iter().chain(parameters).copied().chain([time]).collect();
            for path in &phase.path {
                let mut out = vec![0.0; path.rows.len()];
                if path.function.inputs() == inputs.len() && path.function.outputs() == out.len() {
                    path.function.value(&inputs, &mut out);
                } else {
                    out.fill(f64::NAN);
                }
                row.extend(out);
            }
            rows.push((time, row));
        }
    }
    rows
}
