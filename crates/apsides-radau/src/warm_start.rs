//! Multipliers for a new mesh from the costates of an earlier trajectory: the covector mapping backwards.

use apsides_nlp::{Nlp, WarmStart};
use apsides_ocp::{Guess, Ocp, PhaseTrajectory};

use crate::layout::PhaseLayout;
use crate::transcription::Transcription;

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
        for (p, t) in self.layout.phases.iter().zip(earlier) {
            set_phase_multipliers(p, t, &x, &mut y);
        }
        for ((c, &first), values) in ocp
            .constraints
            .iter()
            .zip(&self.layout.endpoint_rows)
            .zip(guess.constraint_multipliers.iter().flatten())
        {
            if values.len() == c.rows.len() {
                y[first..first + values.len()].copy_from_slice(values);
            }
        }
        WarmStart::from_multipliers(self, x, y)
    }
}

fn set_phase_multipliers(p: &PhaseLayout, t: &PhaseTrajectory, x: &[f64], y: &mut [f64]) {
    let Some(costate) = &t.costate else { return };
    for (row, &multiplier) in p.integral_rows.iter().zip(t.integral_multipliers.iter().flatten()) {
        if let Some(r) = row {
            y[*r] = multiplier;
        }
    }
    let path_rows = p.rows_per_node - p.states;
    for (i, node) in p.nodes.iter().enumerate() {
        let time = t.time_at(node.fraction);
        let row = p.defect_row(i);
        // The weight of the rule on [-1, 1], as in the extraction.
        let w = p.rules[node.interval].weights()[node.local];
        let defects = &mut y[row..row + p.states];
        costate.evaluate(time, defects);
        defects.iter_mut().for_each(|v| *v *= -w);
        if let Some(m) = t.path_multipliers.as_ref().filter(|m| m.dimension() == path_rows) {
            let row = p.path_row(i);
            let rows = &mut y[row..row + path_rows];
            m.evaluate(time, rows);
            let seconds = node.weight * p.arc_duration(p.arc_of(i), x);
            for (k, v) in rows.iter_mut().enumerate() {
                *v *= if p.is_beside_touch(i, k) { 0.0 } else { seconds };
            }
        }
    }
    for c in t.contacts.iter().filter(|c| c.row < path_rows) {
        let fraction = t.mesh.fractions().get(c.end).copied().unwrap_or(f64::NAN);
        let distance = |i: usize| (p.nodes[i].fraction - fraction).abs();
        let nearest = |nodes: &mut dyn Iterator<Item = usize>| {
            nodes.min_by(|a, b| distance(*a).total_cmp(&distance(*b)))
        };
        // An impulse goes to the nearest touch point of its row, or to the nearest node.
        let mut touches = p.mesh.touch_points().iter().filter(|t| t.row == c.row).map(|t| p.touch_node(t));
        if let Some(node) = nearest(&mut touches).or_else(|| nearest(&mut (0..p.nodes.len()))) {
            y[p.path_row(node) + c.row] += c.multiplier;
        }
    }
}
