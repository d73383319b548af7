//! The convex program of one iteration, with a fixed pattern.
//!
//! In steps `d` of the unknowns divided by their scales, and violations `v >= 0` of rows (virtual controls for the matching conditions),
//!
//! ```text
//! minimise  gradient . d + penalty sum(v) + weight/2 |d|^2
//! lower <= value + entries . d + v- - v+ <= upper,   bounds of unknowns,   shortest duration
//! ```

use apsides_conic::{Cone, ConicProgram, ConicSettings, Status, Triplets};
use apsides_ocp::{Bounds, Ocp};

use super::layout::Layout;
use super::linearisation::Linearisation;
use crate::ConvexError;
use crate::rows::Rows;

/// A step may shorten a phase to this part.
const SHORTEST: f64 = 0.3;

pub(crate) struct Subproblem {
    rows: Rows,
    program: Option<ConicProgram>,
    settings: ConicSettings,
    bounds: Vec<Bounds>,
    scales: Vec<f64>,
    /// Start-time column and bounds of each duration.
    durations: Vec<(usize, Bounds)>,
    linear: Vec<f64>,
    quadratic: Triplets,
    violations: usize,
}

impl Subproblem {
    pub(crate) fn new(ocp: &Ocp, layout: &Layout, scales: Vec<f64>, settings: ConicSettings) -> Self {
        let mut bounds = vec![Bounds::FREE; layout.unknowns()];
        let mut durations = Vec::new();
        for (phase, p) in ocp.phases.iter().zip(&layout.phases) {
            for node in 0..=p.intervals {
                for (s, state) in phase.states.iter().enumerate() {
                    let end = match node {
                        0 => state.initial,
                        n if n == p.intervals => state.terminal,
                        _ => Bounds::FREE,
                    };
                    bounds[p.state(node) + s] = end.intersect(&state.variable.bounds);
                }
                for (c, control) in phase.controls.iter().enumerate() {
                    bounds[p.control(node) + c] = control.bounds;
                }
            }
            bounds[p.times()] = phase.initial_time;
            bounds[p.times() + 1] = phase.final_time;
            durations.push((p.times(), phase.duration));
        }
        for (k, parameter) in ocp.parameters.iter().enumerate() {
            bounds[layout.first_parameter + k] = parameter.bounds;
        }
        let mut quadratic = Triplets::default();
        (0..layout.unknowns()).for_each(|k| quadratic.push(k, k, 1.0));
        Self {
            rows: Rows::default(),
            program: None,
            settings,
            bounds,
            scales,
            durations,
            linear: Vec::new(),
            quadratic,
            violations: 0,
        }
    }

    /// The nearest point within the bounds of the unknowns.
    pub(crate) fn clamp(&self, z: &mut [f64]) {
        for (v, b) in z.iter_mut().zip(&self.bounds) {
            *v = b.clamp(*v);
        }
    }

    /// Solves at a point; `weights` are the prices of violations and of the squared step. Writes the step in the unknowns' units.
    /// Returns the status, the value of the convex model without the squared step, and the largest multiplier of a row, at most the
    /// penalty.
    pub(crate) fn solve(
        &mut self,
        z: &[f64],
        rows: &Linearisation,
        scale: f64,
        (penalty, weight): (f64, f64),
        step: &mut [f64],
    ) -> Result<(Status, f64, f64), ConvexError> {
        self.rows.start();
        self.violations = 0;
        let equations = self.equations(z, rows);
        self.rows.cone(Cone::Zero(equations));
        let before = self.rows.len();
        self.inequalities(z, rows);
        self.rows.cone(Cone::NonNegative(self.rows.len() - before));
        let n = z.len();
        self.linear.resize(n + self.violations, 0.0);
        for k in 0..n {
            self.linear[k] = rows.gradient[k] * self.scales[k] / scale;
        }
        self.linear[n..].fill(penalty);
        self.quadratic.values.fill(weight);
        let program = match &mut self.program {
            Some(p) => {
                p.set_linear(&self.linear)?;
                p.set_quadratic(&self.quadratic.values)?;
                p.set_matrix(self.rows.matrix_values())?;
                p.set_right_hand_side(self.rows.right_hand_side())?;
                p
            }
            none => {
                self.rows.end();
                let data = self.rows.data(self.linear.clone(), self.quadratic.clone());
                none.insert(ConicProgram::new(&data, self.settings)?)
            }
        };
        let status = program.solve();
        let x = program.x();
        let mut model = rows.objective / scale;
        for k in 0..n {
            step[k] = x[k] * self.scales[k];
            model += self.linear[k] * x[k];
        }
        model += penalty * x[n..].iter().map(|v| v.max(0.0)).sum::<f64>();
        // The rows `v >= 0` come last; their multipliers are what the penalty exceeds those of the rows by.
        let spare = &program.dual()[self.rows.len() - self.violations..];
        let price = penalty - spare.iter().copied().fold(penalty, f64::min);
        Ok((status, model, price))
    }

    fn violation(&mut self, unknowns: usize, sign: f64) {
        self.rows.term(unknowns + self.violations, sign);
        self.violations += 1;
    }

    /// Fixed unknowns and equality rows.
    fn equations(&mut self, z: &[f64], rows: &Linearisation) -> usize {
        for k in 0..z.len() {
            if self.bounds[k].is_fixed() {
                self.rows.term(k, 1.0);
                self.rows.constant((z[k] - self.bounds[k].lower) / self.scales[k]);
                self.rows.next();
            }
        }
        for row in rows.rows.iter().filter(|l| l.bounds.is_fixed()) {
            for &(c, v) in rows.entries(row) {
                self.rows.term(c, v * self.scales[c] / row.scale);
            }
            self.violation(z.len(), 1.0);
            self.violation(z.len(), -1.0);
            self.rows.constant((row.value - row.bounds.lower) / row.scale);
            self.rows.next();
        }
        self.rows.len()
    }

    fn inequalities(&mut self, z: &[f64], rows: &Linearisation) {
        for k in 0..z.len() {
            let Bounds { lower, upper } = self.bounds[k];
            for (bound, sign) in [(lower, 1.0), (upper, -1.0)] {
                if bound.is_finite() && lower != upper {
                    self.rows.term(k, sign);
                    self.rows.constant(sign * (z[k] - bound) / self.scales[k]);
                    self.rows.next();
                }
            }
        }
        for row in rows.rows.iter().filter(|l| !l.bounds.is_fixed()) {
            for (bound, sign) in [(row.bounds.lower, 1.0), (row.bounds.upper, -1.0)] {
                if bound.is_finite() {
                    for &(c, v) in rows.entries(row) {
                        self.rows.term(c, sign * v * self.scales[c] / row.scale);
                    }
                    self.violation(z.len(), 1.0);
                    self.rows.constant(sign * (row.value - bound) / row.scale);
                    self.rows.next();
                }
            }
        }
        for k in 0..self.durations.len() {
            let (start, bounds) = self.durations[k];
            let duration = z[start + 1] - z[start];
            for (bound, sign) in [(bounds.lower.max(SHORTEST * duration), 1.0), (bounds.upper, -1.0)] {
                if bound.is_finite() {
                    self.rows.term(start + 1, sign);
                    self.rows.term(start, -sign);
                    self.rows.constant(sign * (duration - bound) / self.scales[start]);
                    self.rows.next();
                }
            }
        }
        for v in 0..self.violations {
            self.rows.term(z.len() + v, 1.0);
            self.rows.next();
        }
    }
}
