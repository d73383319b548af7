//! Path constraint rows without controls at the ends of their phases, as constraints of these ends.
//!
//! Such a row holds at both ends of its phase, too, and may have an impulse of its multiplier there, as at a contact: the costates end at
//! what the end cost and the row give, `lambda(tf) = dphi/dx + nu dg/dx`. Trajectories state it as a [`Contact`] at an end of the phase.

use std::sync::{Arc, Mutex, PoisonError};

use apsides_ad::trace::OpaqueFunction;
use apsides_ad::{Formula, NodeFunction, NodePattern};

use crate::{Contact, EndpointConstraint, EndpointInput, Ocp, Trajectory};

/// A path constraint row at an end of its phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathEnd {
    /// Index of the phase.
    pub phase: usize,
    /// Index of the row, in the phase's order.
    pub row: usize,
    /// True at the end of the phase, false at its start.
    pub is_final: bool,
}

/// A problem with some path constraint rows as constraints of the ends of their phases, which come after its own.
#[derive(Clone)]
pub struct PathEnds {
    /// The problem with these constraints.
    pub ocp: Ocp,
    ends: Vec<PathEnd>,
    /// Number of constraints of the problem as it was posed.
    stated: usize,
}

impl PathEnds {
    /// The problem with constraints for these rows; those that do not exist or depend on controls are left out.
    #[must_use]
    pub fn new(ocp: &Ocp, ends: &[PathEnd]) -> Self {
        let mut with_ends = Self { ocp: ocp.clone(), ends: Vec::new(), stated: ocp.constraints.len() };
        for end in ends {
            if let Some(constraint) = constraint(ocp, *end) {
                with_ends.ocp.constraints.push(constraint);
                with_ends.ends.push(*end);
            }
        }
        with_ends
    }

    /// The problem with constraints for the contacts that a trajectory has at ends of phases, and the trajectory with their multipliers; none
    /// if it has none there.
    #[must_use]
    pub fn of_contacts(ocp: &Ocp, trajectory: &Trajectory) -> Option<(Self, Trajectory)> {
        let mut ends = Vec::new();
        for (phase, t) in trajectory.phases.iter().enumerate() {
            let last = t.control.segments().len();
            for c in t.contacts.iter().filter(|c| c.end == 0 || c.end == last) {
                ends.push((PathEnd { phase, row: c.row, is_final: c.end == last }, c.multiplier));
            }
        }
        if ends.is_empty() {
            return None;
        }
        let posed = Self::new(ocp, &ends.iter().map(|e| e.0).collect::<Vec<_>>());
        let mut meant = trajectory.clone();
        for (phase, t) in meant.phases.iter_mut().enumerate() {
            let last = t.control.segments().len();
            let is_constraint = |c: &Contact| {
                let end = PathEnd { phase, row: c.row, is_final: c.end == last };
                (c.end == 0 || c.end == last) && posed.ends.contains(&end)
            };
            t.contacts.retain(|c| !is_constraint(c));
        }
        let none = (posed.stated == 0).then(Vec::new);
        if let Some(multipliers) = meant.constraint_multipliers.take().or(none) {
            let added = posed.ends.iter().filter_map(|end| ends.iter().find(|e| e.0 == *end));
            meant.constraint_multipliers =
                Some(multipliers.into_iter().chain(added.map(|e| vec![e.1])).collect());
        }
        Some((posed, meant))
    }

    /// A trajectory of the problem with these constraints as one of the problem as it was posed, with contacts at ends.
    #[must_use]
    pub fn as_posed(&self, mut trajectory: Trajectory) -> Trajectory {
        let Some(multipliers) = trajectory.constraint_multipliers.as_mut() else { return trajectory };
        let added = multipliers.split_off(self.stated.min(multipliers.len()));
        for (end, values) in self.ends.iter().zip(added) {
            let t = &mut trajectory.phases[end.phase];
            let at = if end.is_final { t.control.segments().len() } else { 0 };
            t.contacts.extend(values.first().map(|&multiplier| Contact {
                end: at,
                row: end.row,
                multiplier,
            }));
            t.contacts.sort_by_key(|c| (c.end, c.row));
        }
        if multipliers.is_empty() {
            trajectory.constraint_multipliers = None;
        }
        trajectory
    }
}

fn constraint(ocp: &Ocp, end: PathEnd) -> Option<EndpointConstraint> {
    let PathEnd { phase, row, is_final } = end;
    let posed = ocp.phases.get(phase)?;
    let mut first = 0;
    let path = posed.path.iter().find(|c| {
        first += c.rows.len();
        row < first
    })?;
    let output = row + path.rows.len() - first;
    let (nx, nu) = (posed.states.len(), posed.controls.len());
    let function = RowAtEnd::new(&path.function, output, nx..nx + nu)?;
    let states = (0..nx).map(|state| match is_final {
        true => EndpointInput::FinalState { phase, state },
        false => EndpointInput::InitialState { phase, state },
    });
    let parameters = path.function.inputs() - 1 - nx - nu;
    let time =
        if is_final { EndpointInput::FinalTime { phase } } else { EndpointInput::InitialTime { phase } };
    let parameters = (0..parameters).map(|index| EndpointInput::Parameter { index });
    let variable = path.rows[output].clone();
    let which = if is_final { "end" } else { "start" };
    Some(EndpointConstraint {
        name: format!("{} at the {which} of {}", variable.name, posed.name),
        rows: vec![variable],
        inputs: states.chain(parameters).chain([time]).collect(),
        function: Arc::new(function),
    })
}

/// One output of a path function that does not depend on controls, of the states, the parameters and the time.
struct RowAtEnd {
    function: Arc<dyn NodeFunction>,
    output: usize,
    controls: std::ops::Range<usize>,
    pattern: NodePattern,
    /// Entries of the function's Jacobian and Hessian that are those of the row.
    jacobian: Vec<usize>,
    hessian: Vec<usize>,
    work: Mutex<Work>,
}

/// Inputs, outputs and derivatives of the whole function.
struct Work {
    inputs: Vec<f64>,
    values: Vec<f64>,
    weights: Vec<f64>,
    slopes: Vec<f64>,
    bends: Vec<f64>,
}

impl RowAtEnd {
    fn new(
        function: &Arc<dyn NodeFunction>,
        output: usize,
        controls: std::ops::Range<usize>,
    ) -> Option<Self> {
        let whole = function.pattern();
        let jacobian: Vec<usize> = (whole.row_offsets[output]..whole.row_offsets[output + 1]).collect();
        if jacobian.iter().any(|k| controls.contains(&whole.columns[*k])) {
            return None;
        }
        let is_own = |i: usize| jacobian.iter().any(|k| whole.columns[*k] == i);
        let hessian: Vec<usize> = (0..whole.hessian.len())
            .filter(|k| is_own(whole.hessian[*k].0) && is_own(whole.hessian[*k].1))
            .collect();
        let without = |i: usize| if i < controls.start { i } else { i - controls.len() };
        let pattern = NodePattern {
            row_offsets: vec![0, jacobian.len()],
            columns: jacobian.iter().map(|k| without(whole.columns[*k])).collect(),
            hessian: (hessian.iter().map(|k| whole.hessian[*k]))
                .map(|(i, j)| (without(i), without(j)))
                .collect(),
        };
        let work = Work {
            inputs: vec![0.0; function.inputs()],
            values: vec![0.0; function.outputs()],
            weights: vec![0.0; function.outputs()],
            slopes: vec![0.0; whole.jacobian_len()],
            bends: vec![0.0; whole.hessian_len()],
        };
        let function = Arc::clone(function);
        Some(Self { function, output, controls, pattern, jacobian, hessian, work: work.into() })
    }

    /// The work space with the inputs of the whole function; controls are zero.
    fn work(&self, z: &[f64]) -> std::sync::MutexGuard<'_, Work> {
        let mut work = self.work.lock().unwrap_or_else(PoisonError::into_inner);
        let (before, after) = z.split_at(self.controls.start);
        work.inputs[..before.len()].copy_from_slice(before);
        work.inputs[self.controls.end..].copy_from_slice(after);
        work
    }
}

impl NodeFunction for RowAtEnd {
    fn inputs(&self) -> usize {
        self.function.inputs() - self.controls.len()
    }

    fn outputs(&self) -> usize {
        1
    }

    fn pattern(&self) -> &NodePattern {
        &self.pattern
    }

    fn value(&self, z: &[f64], out: &mut [f64]) {
        let work = &mut *self.work(z);
        self.function.value(&work.inputs, &mut work.values);
        out[0] = work.values[self.output];
    }

    fn jacobian(&self, z: &[f64], out: &mut [f64], entries: &mut [f64]) {
        let work = &mut *self.work(z);
        self.function.jacobian(&work.inputs, &mut work.values, &mut work.slopes);
        out[0] = work.values[self.output];
        entries.iter_mut().zip(&self.jacobian).for_each(|(entry, k)| *entry = work.slopes[*k]);
    }

    fn hessian(&self, z: &[f64], weights: &[f64], entries: &mut [f64]) {
        let work = &mut *self.work(z);
        work.weights[self.output] = weights[0];
        self.function.hessian(&work.inputs, &work.weights, &mut work.bends);
        entries.iter_mut().zip(&self.hessian).for_each(|(entry, k)| *entry = work.bends[*k]);
    }

    fn formula(&self) -> Result<Formula, OpaqueFunction> {
        Err(OpaqueFunction { name: "path constraint at an end of its phase".into() })
    }
}
