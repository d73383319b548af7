//! Where the unknowns of the boundary value problem are, and their typical sizes.

use apsides_ocp::{Bounds, EndpointInput, Ocp, Scaling};

use super::start::IndirectStart;

/// Unknowns of one phase: `[x, lambda]` at each node, then start and end time.
#[derive(Clone, Debug)]
pub(super) struct MultipointPhase {
    first: usize,
    pub(super) states: usize,
    /// Nodes on the normalised time of the phase.
    pub(super) fractions: Vec<f64>,
    pub(super) initial_time: usize,
    pub(super) final_time: usize,
}

impl MultipointPhase {
    /// First unknown of a node: its states, then its costates.
    pub(super) fn node(&self, node: usize) -> usize {
        self.first + 2 * self.states * node
    }

    pub(super) fn segments(&self) -> usize {
        self.fractions.len() - 1
    }

    /// Times of both ends of a segment.
    pub(super) fn segment_times(&self, z: &[f64], segment: usize) -> (f64, f64) {
        let (start, end) = (z[self.initial_time], z[self.final_time]);
        let at = |f: f64| if f == 1.0 { end } else { start + f * (end - start) };
        (at(self.fractions[segment]), at(self.fractions[segment + 1]))
    }
}

/// A row of an endpoint constraint, or a bound on a duration.
#[derive(Clone, Copy, Debug)]
pub(super) struct RowBounds {
    pub(super) bounds: Bounds,
    pub(super) scale: f64,
}

/// All unknowns.
#[derive(Clone, Debug)]
pub(super) struct MultipointLayout {
    pub(super) phases: Vec<MultipointPhase>,
    pub(super) first_parameter: usize,
    pub(super) parameters: usize,
    /// First multiplier of the rows below.
    pub(super) first_multiplier: usize,
    /// Rows of the endpoint constraints, then durations.
    pub(super) rows: Vec<RowBounds>,
    /// Phases whose duration is a row of its own.
    pub(super) durations: Vec<usize>,
    pub(super) unknowns: usize,
    /// Typical size per unknown.
    pub(super) scales: Vec<f64>,
    /// Bounds of end states, times and parameters; free for all others.
    pub(super) bounds: Vec<Bounds>,
    /// Typical size of the objective.
    pub(super) objective: f64,
}

impl MultipointLayout {
    pub(super) fn new(ocp: &Ocp, start: &IndirectStart, scaling: &Scaling, objective: f64) -> Self {
        let mut next = 0;
        let mut phases = Vec::with_capacity(ocp.phases.len());
        let (mut scales, mut bounds) = (Vec::new(), Vec::new());
        for ((phase, s), sizes) in ocp.phases.iter().zip(&start.phases).zip(&scaling.phases) {
            let n = phase.states.len();
            let nodes = s.fractions.len();
            let last = next + 2 * n * nodes;
            phases.push(MultipointPhase {
                first: next,
                states: n,
                fractions: s.fractions.clone(),
                initial_time: last,
                final_time: last + 1,
            });
            next = last + 2;
            for node in 0..nodes {
                scales.extend(&sizes.states);
                scales.extend(sizes.states.iter().map(|x| objective / x));
                let end = |s: &apsides_ocp::State| {
                    let at = match node {
                        0 => s.initial,
                        k if k + 1 == nodes => s.terminal,
                        _ => return Bounds::FREE,
                    };
                    at.intersect(&s.variable.bounds)
                };
                bounds.extend(phase.states.iter().map(end));
                bounds.extend(vec![Bounds::FREE; n]);
            }
            scales.extend([sizes.time; 2]);
            let (initial, terminal) = phase.time_bounds();
            bounds.extend([initial, terminal]);
        }
        let first_parameter = next;
        scales.extend(&scaling.parameters);
        bounds.extend(ocp.parameters.iter().map(|p| p.bounds));
        let first_multiplier = first_parameter + ocp.parameters.len();
        let mut rows: Vec<RowBounds> = ocp
            .constraints
            .iter()
            .flat_map(|c| &c.rows)
            .map(|r| RowBounds { bounds: r.bounds, scale: r.scale.unwrap_or(f64::NAN) })
            .collect();
        let durations: Vec<usize> =
            (0..ocp.phases.len()).filter(|&k| ocp.phases[k].needs_duration_row()).collect();
        rows.extend(
            durations
                .iter()
                .map(|&k| RowBounds { bounds: ocp.phases[k].duration, scale: scaling.phases[k].time }),
        );
        scales.resize(first_multiplier + rows.len(), f64::NAN);
        bounds.resize(first_multiplier + rows.len(), Bounds::FREE);
        Self {
            phases,
            first_parameter,
            parameters: ocp.parameters.len(),
            first_multiplier,
            unknowns: first_multiplier + rows.len(),
            rows,
            durations,
            scales,
            bounds,
            objective,
        }
    }

    /// The unknown that an end quantity is.
    pub(super) fn unknown(&self, input: EndpointInput) -> usize {
        match input {
            EndpointInput::InitialTime { phase } => self.phases[phase].initial_time,
            EndpointInput::FinalTime { phase } => self.phases[phase].final_time,
            EndpointInput::InitialState { phase, state } => self.phases[phase].node(0) + state,
            EndpointInput::FinalState { phase, state } => {
                let p = &self.phases[phase];
                p.node(p.segments()) + state
            }
            EndpointInput::Parameter { index } => self.first_parameter + index,
        }
    }

    /// Gives rows without a stated scale the largest change of theirs, and the multipliers their sizes.
    pub(super) fn complete_scales(&mut self, changes: &[f64]) {
        for (k, row) in self.rows.iter_mut().enumerate() {
            if row.scale.is_nan() {
                row.scale = changes.get(k).copied().filter(|c| *c > 0.0 && c.is_finite()).unwrap_or(1.0);
            }
            self.scales[self.first_multiplier + k] = self.objective / row.scale;
        }
    }
}
