//! Controls without effect, such as the direction of no thrust.
//!
//! Along a coast nothing says where they point: Newton's method leaves each node where it came to, and between the nodes a path constraint
//! that binds them, a direction of length one, is missed by much. They keep the values that they have where they begin to have none.

use std::sync::Arc;

use apsides_ad::NodeFunction;
use apsides_ocp::{
    Ocp, Phase, PhaseScaling, PhaseTrajectory, PiecewisePolynomial, Scaling, Segment, Trajectory,
};

/// A control that changes states and integrals over the duration by less than this part of their scales has no effect.
const IDLE: f64 = 1e-7;
/// Excess of a path constraint, relative to its scale, up to which kept controls meet it.
const MET: f64 = 1e-9;

/// Lets controls without effect along whole intervals keep their values, in phases in which path constraints bind controls to each other.
pub(crate) fn keep_idle(ocp: &Ocp, scaling: &Scaling, trajectory: &mut Trajectory) {
    for (k, phase) in ocp.phases.iter().enumerate() {
        if !phase.path.iter().any(|c| phase.binds_controls(c)) {
            continue;
        }
        let kept = Keeper::new(phase, &trajectory.phases[k], &trajectory.parameters).kept(&scaling.phases[k]);
        if let Some(control) = kept {
            trajectory.phases[k].control = control;
        }
    }
}

struct Keeper<'a> {
    phase: &'a Phase,
    found: &'a PhaseTrajectory,
    parameters: &'a [f64],
    inputs: Vec<f64>,
}

impl<'a> Keeper<'a> {
    fn new(phase: &'a Phase, found: &'a PhaseTrajectory, parameters: &'a [f64]) -> Self {
        Self { phase, found, parameters, inputs: Vec::new() }
    }

    /// The controls with those that are idle kept; none where none is.
    fn kept(&mut self, scaling: &PhaseScaling) -> Option<PiecewisePolynomial> {
        let nu = self.phase.controls.len();
        let idle: Vec<Vec<bool>> =
            (0..self.found.control.segments().len()).map(|segment| self.idle(segment, scaling)).collect();
        if !idle.iter().flatten().any(|idle| *idle) {
            return None;
        }
        let mut segments: Vec<Segment> = self.found.control.segments().to_vec();
        let mut any = false;
        for segment in 0..segments.len() {
            if !idle[segment].contains(&true) {
                continue;
            }
            let mut values = segments[segment].values.clone();
            for control in (0..nu).filter(|c| idle[segment][*c]) {
                // The last value before, which may be kept itself, else the first one behind.
                let before = segment.checked_sub(1).map(|s| &segments[s].values);
                let before = before.map(|v| v[v.len() - nu + control]);
                let behind = || {
                    let next = (segment + 1..segments.len()).find(|s| !idle[*s][control])?;
                    Some(segments[next].values[control])
                };
                if let Some(value) = before.or_else(behind) {
                    values.iter_mut().skip(control).step_by(nu).for_each(|v| *v = value);
                }
            }
            if self.changes_nothing(segment, &values, scaling)
                && self.is_admissible(segment, &values, scaling)
            {
                any |= values != segments[segment].values;
                segments[segment].values = values;
            }
        }
        let breaks = self.found.control.breaks().to_vec();
        any.then(|| PiecewisePolynomial::new(nu, breaks, segments).ok()).flatten()
    }

    /// Says of each control whether it has no effect at any node of an interval.
    fn idle(&mut self, segment: usize, scaling: &PhaseScaling) -> Vec<bool> {
        let (nx, nu) = (self.phase.states.len(), self.phase.controls.len());
        let values = self.found.control.segments()[segment].values.clone();
        let times: Vec<f64> = self.found.control.node_times(segment).collect();
        let mut idle = vec![true; nu];
        let duration = self.found.final_time - self.found.initial_time;
        for (function, scales) in self.functions(scaling) {
            let pattern = function.pattern();
            let (mut out, mut entries) = (vec![0.0; function.outputs()], vec![0.0; pattern.jacobian_len()]);
            for (time, u) in times.iter().zip(values.chunks(nu)) {
                self.go(segment, *time, u, function.inputs());
                function.jacobian(&self.inputs, &mut out, &mut entries);
                for ((row, column), entry) in pattern.jacobian_entries().zip(&entries) {
                    if let Some(c) = column.checked_sub(nx).filter(|c| *c < nu) {
                        let effect = (entry * scaling.controls[c] * duration / scales[row]).abs();
                        idle[c] &= effect <= IDLE;
                    }
                }
            }
        }
        idle
    }

    /// The functions that controls have an effect by, with the scales of their outputs.
    fn functions<'s>(
        &self,
        scaling: &'s PhaseScaling,
    ) -> impl Iterator<Item = (&'a Arc<dyn NodeFunction>, &'s [f64])> + use<'a, 's> {
        let integrals = self.phase.integrals.iter().zip(&scaling.integrals);
        let integrals = integrals.map(|(i, s)| (&i.function, std::slice::from_ref(s)));
        std::iter::once((&self.phase.dynamics, &scaling.states[..])).chain(integrals)
    }

    /// True if other controls have the same rates at the nodes of an interval: a control that is the best one has no slope there, and has an
    /// effect.
    fn changes_nothing(&mut self, segment: usize, values: &[f64], scaling: &PhaseScaling) -> bool {
        let nu = self.phase.controls.len();
        let own = self.found.control.segments()[segment].values.clone();
        let times: Vec<f64> = self.found.control.node_times(segment).collect();
        let duration = self.found.final_time - self.found.initial_time;
        for (function, scales) in self.functions(scaling) {
            let mut rates = [vec![0.0; function.outputs()], vec![0.0; function.outputs()]];
            for (time, both) in times.iter().zip(own.chunks(nu).zip(values.chunks(nu))) {
                for (u, out) in [both.0, both.1].into_iter().zip(&mut rates) {
                    self.go(segment, *time, u, function.inputs());
                    function.value(&self.inputs, out);
                }
                let mut all = rates[0].iter().zip(&rates[1]).zip(scales);
                if !all.all(|((a, b), scale)| (a - b).abs() * duration / scale <= IDLE) {
                    return false;
                }
            }
        }
        true
    }

    /// True if the path constraints with controls hold at the nodes of an interval with other ones.
    fn is_admissible(&mut self, segment: usize, values: &[f64], scaling: &PhaseScaling) -> bool {
        let (nx, nu) = (self.phase.states.len(), self.phase.controls.len());
        let times: Vec<f64> = self.found.control.node_times(segment).collect();
        let mut first = 0;
        for c in &self.phase.path {
            let scales = &scaling.path[first..first + c.rows.len()];
            first += c.rows.len();
            if !c.function.pattern().columns.iter().any(|i| (nx..nx + nu).contains(i)) {
                continue;
            }
            let mut rows = vec![0.0; c.rows.len()];
            for (time, u) in times.iter().zip(values.chunks(nu)) {
                self.go(segment, *time, u, c.function.inputs());
                c.function.value(&self.inputs, &mut rows);
                let mut all = c.rows.iter().zip(&rows).zip(scales);
                if !all.all(|((row, value), scale)| row.bounds.excess(*value) <= MET * scale) {
                    return false;
                }
            }
        }
        true
    }

    /// The inputs of a function at a time with given controls.
    fn go(&mut self, segment: usize, time: f64, u: &[f64], inputs: usize) {
        self.inputs.resize(self.phase.states.len(), 0.0);
        self.found.state.evaluate_in(segment, time, &mut self.inputs);
        self.inputs.extend_from_slice(u);
        if inputs > self.inputs.len() + 1 {
            self.inputs.extend_from_slice(self.parameters);
        }
        self.inputs.push(time);
    }
}
