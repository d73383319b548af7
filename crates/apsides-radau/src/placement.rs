//! The part of the program at the nodes of a phase: start, bounds, scales, constant entries, multipliers, names, stages.

use apsides_basis::legendre;
use apsides_nlp::{Scaling as NlpScaling, Stages};
use apsides_ocp::{Contact, Phase, PhaseGuess, PhaseScaling, PhaseTrajectory, RowOrigin, Variable};
use apsides_transcription::{ConstantEntry, Limits, PhaseEnds, PhaseLayout, PhaseStart, phase_row};

use crate::arc_rates;
use crate::bounds;
use crate::elimination;
use crate::layout::CollocationPhase;

impl PhaseLayout for CollocationPhase {
    fn ends(&self) -> &PhaseEnds {
        &self.ends
    }

    fn quantities(&self) -> Vec<Vec<usize>> {
        let nodes = self.nodes.len();
        let states = (0..self.states).map(|s| (0..=nodes).map(|k| self.state_column(k) + s).collect());
        let controls = (0..self.controls).map(|c| (0..nodes).map(|k| self.control_column(k) + c).collect());
        let breaks = self.break_times().map(|column| vec![column]);
        states.chain(controls).chain(breaks).collect()
    }

    fn lasts(&self, x: &[f64]) -> bool {
        (0..self.arcs.len()).all(|k| self.arc_duration(k, x) > 0.0)
    }

    fn set_start(&self, guess: &PhaseGuess, x: &mut [f64]) {
        for node in 0..=self.nodes.len() {
            let fraction = self.nodes.get(node).map_or(1.0, |n| n.fraction);
            let (a, b) = (self.state_column(node), self.control_column(node));
            guess.state(fraction, &mut x[a..b]);
            if node < self.nodes.len() {
                guess.control(fraction, &mut x[b..b + self.controls]);
            }
        }
        for (column, at) in self.break_times().zip(self.mesh.breaks()) {
            let f = self.mesh.fractions()[at.end];
            x[column] = (1.0 - f) * guess.initial_time + f * guess.final_time;
        }
    }

    fn set_bounds(&self, start: &PhaseStart<'_>, variables: &mut Limits, rows: &mut Limits) {
        bounds::set_variables(self, start, variables);
        bounds::set_rows(self, start, rows);
    }

    fn set_scales(&self, phase: &Phase, s: &PhaseScaling, scales: &mut NlpScaling) {
        let NlpScaling { variables, constraints, .. } = scales;
        for node in 0..=self.nodes.len() {
            variables[self.state_column(node)..][..self.states].copy_from_slice(&s.states);
            if node < self.nodes.len() {
                variables[self.control_column(node)..][..self.controls].copy_from_slice(&s.controls);
                constraints[self.defect_row(node)..][..self.states].copy_from_slice(&s.states);
                for (k, row) in phase.path.iter().flat_map(|c| &c.rows).enumerate() {
                    let unit = if self.rate_arc_at(node, k).is_some() { s.time } else { 1.0 };
                    constraints[self.path_row(node) + k] = row.size().unwrap_or(f64::NAN) / unit;
                }
            }
        }
        for column in self.break_times() {
            variables[column] = s.time;
        }
        constraints[self.arc_rows()].fill(s.time);
        for &(row, ..) in &self.pinned_rows {
            constraints[row] = s.time;
        }
        for &(row, _, c) in &self.degree_rows {
            constraints[row] = s.controls[c];
        }
        for rate in &self.rate_rows {
            constraints[rate.at] = constraints[self.path_row(self.interval_start(rate.interval)) + rate.row];
        }
    }

    fn constant_entries(&self) -> Vec<ConstantEntry> {
        let mut entries = Vec::new();
        for (i, node) in self.nodes.iter().enumerate() {
            let n = self.mesh.points()[node.interval];
            let start = i - node.local;
            let row = &self.rules[node.interval].differentiation()[node.local * (n + 1)..][..n + 1];
            for s in 0..self.states {
                for (j, &d) in row.iter().enumerate() {
                    entries.push((self.defect_row(i) + s, self.state_column(start + j) + s, d));
                }
            }
        }
        for (r, arc) in self.arc_rows().zip(&self.arcs) {
            entries.extend([(r, arc.start_time, -1.0), (r, arc.end_time, 1.0)]);
        }
        let (start, end) = (self.ends.initial_time, self.ends.final_time);
        for &(r, column, f) in &self.pinned_rows {
            entries.extend([(r, column, 1.0), (r, start, f - 1.0), (r, end, -f)]);
        }
        for &(r, interval, c) in &self.degree_rows {
            let (rule, first) = (&self.rules[interval], self.interval_start(interval));
            for (j, (&tau, w)) in rule.nodes().iter().zip(rule.weights()).enumerate() {
                let (value, _) = legendre(rule.points() - 1, tau);
                entries.push((r, self.control_column(first + j) + c, w * value));
            }
        }
        entries
    }

    fn row_origin(&self, phase: &Phase, row: usize, x: &[f64]) -> Option<RowOrigin> {
        let end = self.first_row + self.nodes.len() * self.rows_per_node;
        if (self.first_row..end).contains(&row) {
            return Some(node_row_origin(phase, self, row - self.first_row, x));
        }
        if self.arc_rows().contains(&row) {
            return Some(phase_row(phase, "duration between switches", &phase.time_unit));
        }
        if self.pinned_rows.iter().any(|r| r.0 == row) {
            return Some(phase_row(phase, "start of an arc", &phase.time_unit));
        }
        if let Some(rate) = self.rate_rows.iter().find(|r| r.at == row) {
            let v = phase.path.iter().flat_map(|c| &c.rows).nth(rate.row)?;
            return Some(phase_row(phase, format!("rate of {} where it meets its bound", v.name), &v.unit));
        }
        let (_, _, c) = self.degree_rows.iter().find(|r| r.0 == row)?;
        let v = &phase.controls[*c];
        Some(phase_row(phase, format!("degree of {}", v.name), &v.unit))
    }

    /// The covector mapping of the extraction, backwards.
    fn set_multipliers(&self, phase: &Phase, t: &PhaseTrajectory, x: &[f64], y: &mut [f64]) {
        let Some(costate) = &t.costate else { return };
        let path_rows = self.rows_per_node - self.states;
        for (i, node) in self.nodes.iter().enumerate() {
            let time = t.time_at(node.fraction);
            let row = self.defect_row(i);
            // The weight of the rule on [-1, 1], as in the extraction.
            let w = self.rules[node.interval].weights()[node.local];
            let defects = &mut y[row..row + self.states];
            costate.evaluate(time, defects);
            defects.iter_mut().for_each(|v| *v *= -w);
            if let Some(m) = t.path_multipliers.as_ref().filter(|m| m.dimension() == path_rows) {
                let row = self.path_row(i);
                let rows = &mut y[row..row + path_rows];
                m.evaluate(time, rows);
                let seconds = node.weight * self.arc_duration(self.arc_of(i), x);
                for (k, v) in rows.iter_mut().enumerate() {
                    let is_left_out = self.is_beside_touch(i, k) || self.exit_at(i, k).is_some();
                    *v *= if is_left_out { 0.0 } else { seconds };
                }
            }
        }
        arc_rates::set_multipliers(phase, self, t, x, y);
        let has_rates = |c: &&Contact| self.rate_arcs.iter().any(|a| arc_rates::is_of(self, a, t, c));
        for c in t.contacts.iter().filter(|c| c.row < path_rows && !has_rates(c)) {
            let fraction = t.mesh.fractions().get(c.end).copied().unwrap_or(f64::NAN);
            let distance = |i: usize| (self.nodes[i].fraction - fraction).abs();
            let nearest = |nodes: &mut dyn Iterator<Item = usize>| {
                nodes.min_by(|a, b| distance(*a).total_cmp(&distance(*b)))
            };
            // An impulse goes to the nearest touch point of its row, or to the nearest node.
            let mut touches =
                self.mesh.touch_points().iter().filter(|t| t.row == c.row).map(|t| self.touch_node(t));
            if let Some(node) = nearest(&mut touches).or_else(|| nearest(&mut (0..self.nodes.len()))) {
                y[self.path_row(node) + c.row] += c.multiplier;
            }
        }
    }

    fn set_stages(&self, stages: &mut Stages) {
        let Stages { variables, constraints } = stages;
        let (first, intervals) = (self.first_stage, self.mesh.intervals());
        let stage_of = |interval: usize, local: usize| elimination::stage(first, intervals, interval, local);
        for node in 0..=self.nodes.len() {
            let (interval, local) = self.nodes.get(node).map_or((intervals, 0), |n| (n.interval, n.local));
            let stage = stage_of(interval, local);
            variables[self.state_column(node)..][..self.states].fill(stage + 1);
            if node < self.nodes.len() {
                variables[self.control_column(node)..][..self.controls].fill(stage);
                constraints[self.defect_row(node)..][..self.rows_per_node].fill(stage + 2);
            }
        }
        for &(row, interval, _) in &self.degree_rows {
            constraints[row] = stage_of(interval, 0) + 2;
        }
        for rate in &self.rate_rows {
            constraints[rate.at] = stage_of(rate.interval, 0) + 2;
        }
        // Arcs have times of their own, and such rows belong to some intervals alone.
        let is_uniform = self.arcs.len() <= 1
            && self.pinned_rows.is_empty()
            && self.degree_rows.is_empty()
            && self.rate_rows.is_empty();
        if let Some(ends) = elimination::ends_of_runs(self.mesh.points()).filter(|_| is_uniform) {
            for (stage, interval) in (elimination::last_stage(first, intervals)..).zip(ends) {
                let column = self.state_column(self.interval_start(interval));
                variables[column..][..self.states].fill(stage);
            }
        }
    }
}

fn node_row_origin(phase: &Phase, p: &CollocationPhase, offset: usize, x: &[f64]) -> RowOrigin {
    let (node, k) = (offset / p.rows_per_node, offset % p.rows_per_node);
    let time = p.time(node, x);
    let (name, unit) = if k < p.states {
        let v = &phase.states[k].variable;
        (format!("equation of motion of {}", v.name), v.unit.clone())
    } else {
        let row = phase.path.iter().flat_map(|c| &c.rows).nth(k - p.states);
        let is_rate = p.rate_arc_at(node, k - p.states).is_some();
        let name = |v: &Variable| if is_rate { format!("rate of {}", v.name) } else { v.name.clone() };
        row.map_or_else(Default::default, |v| (name(v), v.unit.clone()))
    };
    RowOrigin { phase: Some(phase.name.clone()), name, unit, time: Some(time) }
}
