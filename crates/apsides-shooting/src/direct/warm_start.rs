//! Multipliers for new segments from the costates of an earlier trajectory.

use apsides_nlp::{Nlp, WarmStart};
use apsides_ocp::{Guess, Ocp, Phase, PhaseTrajectory};

use super::layout::PhaseLayout;
use super::transcription::Transcription;

impl Transcription {
    /// A start close to the solution, if every phase of the guess is an earlier trajectory with costates.
    ///
    /// The multipliers of the bounds are what the gradient of the Lagrangian leaves at the start.
    pub(crate) fn warm_start(&mut self, ocp: &Ocp, guess: &Guess) -> Option<WarmStart> {
        let earlier: Option<Vec<&PhaseTrajectory>> = guess.phases.iter().map(|g| g.as_trajectory()).collect();
        let earlier = earlier?;
        if earlier.iter().any(|t| t.costate.is_none()) {
            return None;
        }
        let mut x = vec![0.0; self.layout.variables];
        self.initial_point(&mut x);
        let mut y = vec![0.0; self.layout.constraints];
        for ((phase, p), t) in ocp.phases.iter().zip(&self.layout.phases).zip(earlier) {
            set_phase_multipliers(phase, p, t, &x, &mut y);
        }
        let multipliers = guess.constraint_multipliers.iter().flatten();
        for ((c, &first), values) in ocp.constraints.iter().zip(&self.layout.endpoint_rows).zip(multipliers) {
            if values.len() == c.rows.len() {
                y[first..first + values.len()].copy_from_slice(values);
            }
        }
        WarmStart::from_multipliers(self, x, y)
    }
}

fn set_phase_multipliers(phase: &Phase, p: &PhaseLayout, t: &PhaseTrajectory, x: &[f64], y: &mut [f64]) {
    let Some(costate) = &t.costate else { return };
    for (row, &multiplier) in p.integral_rows.iter().zip(t.integral_multipliers.iter().flatten()) {
        if let Some(r) = row {
            y[*r] = multiplier;
        }
    }
    let path_rows = phase.path_rows();
    let path = t.path_multipliers.as_ref().filter(|m| m.dimension() == path_rows);
    let mut values = vec![0.0; path_rows];
    for (k, segment) in p.segments.iter().enumerate() {
        let end = t.time_at(p.fraction(k + 1));
        // From the left: the costate of the segment that ends here.
        let middle = t.time_at(0.5 * (p.fraction(k) + p.fraction(k + 1)));
        let matching = &mut y[segment.matching_row..][..p.states];
        costate.evaluate_in(costate.segment_at(middle), end, matching);
        matching.iter_mut().for_each(|v| *v = -*v);
        let Some(path) = path else { continue };
        for (point, rows) in segment.path_rows.chunks(phase.path.len().max(1)).enumerate() {
            path.evaluate_in(
                path.segment_at(middle),
                t.time_at(p.fraction_in(k, segment.rows.place(point))),
                &mut values,
            );
            let seconds = segment.row_seconds(point, x);
            let mut first = 0;
            for (c, row) in phase.path.iter().zip(rows) {
                for (k, mu) in values[first..first + c.rows.len()].iter().enumerate() {
                    y[row + k] += seconds * mu;
                }
                first += c.rows.len();
            }
        }
    }
}
