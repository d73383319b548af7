//! Hamiltonian of a phase and its gradient, in terms of the problem's own functions.

use apsides_ad::NodeFunction;
use apsides_ocp::Phase;

/// `L = lambda . f + sum_q w_q g_q + mu . c` of the minimised objective.
pub(crate) struct Lagrangian<'a> {
    pub(crate) phase: &'a Phase,
    /// Weight of each integral: in the minimised cost, and the multiplier of its bounds.
    weights: Vec<f64>,
    /// Inputs of a function with parameters and of one without.
    full: Vec<f64>,
    bare: Vec<f64>,
    values: Vec<f64>,
    entries: Vec<f64>,
    /// Derivatives by `[x, u]`, at the last point.
    pub(crate) gradient: Vec<f64>,
    /// Largest of `|lambda_i f_i|` and `|w_q g_q|` there.
    pub(crate) largest_term: f64,
}

impl<'a> Lagrangian<'a> {
    pub(crate) fn new(phase: &'a Phase, weights: Vec<f64>, parameters: &[f64]) -> Self {
        let base = phase.states.len() + phase.controls.len();
        let mut full = vec![0.0; base];
        full.extend_from_slice(parameters);
        full.push(0.0);
        Self {
            phase,
            weights,
            full,
            bare: vec![0.0; base + 1],
            values: vec![0.0; phase.functions().map(|f| f.outputs()).max().unwrap_or(0)],
            entries: vec![0.0; phase.functions().map(|f| f.pattern().jacobian_len()).max().unwrap_or(0)],
            gradient: vec![0.0; base],
            largest_term: 0.0,
        }
    }

    fn set(&mut self, t: f64, x: &[f64], u: &[f64]) {
        for z in [&mut self.full, &mut self.bare] {
            z[..x.len()].copy_from_slice(x);
            z[x.len()..x.len() + u.len()].copy_from_slice(u);
            if let Some(last) = z.last_mut() {
                *last = t;
            }
        }
    }

    /// All path constraint rows.
    pub(crate) fn path(&mut self, t: f64, x: &[f64], u: &[f64], out: &mut [f64]) {
        self.set(t, x, u);
        let mut first = 0;
        for c in &self.phase.path {
            let z = if self.phase.takes_parameters(c.function.as_ref()) { &self.full } else { &self.bare };
            c.function.value(z, &mut out[first..first + c.rows.len()]);
            first += c.rows.len();
        }
    }

    /// Fills [`gradient`](Self::gradient) and [`largest_term`](Self::largest_term).
    pub(crate) fn differentiate(
        &mut self,
        t: f64,
        x: &[f64],
        u: &[f64],
        costate: &[f64],
        multipliers: &[f64],
    ) {
        self.differentiate_path(t, x, u, multipliers);
        self.largest_term = 0.0;
        let phase = self.phase;
        self.add(phase.dynamics.as_ref(), costate, true);
        for (k, q) in phase.integrals.iter().enumerate() {
            self.add(q.function.as_ref(), &[self.weights[k]], true);
        }
    }

    /// Fills [`gradient`](Self::gradient) with that of `mu . c` alone.
    pub(crate) fn differentiate_path(&mut self, t: f64, x: &[f64], u: &[f64], multipliers: &[f64]) {
        self.set(t, x, u);
        self.gradient.fill(0.0);
        let phase = self.phase;
        let mut first = 0;
        for c in &phase.path {
            self.add(c.function.as_ref(), &multipliers[first..first + c.rows.len()], false);
            first += c.rows.len();
        }
    }

    fn add(&mut self, function: &dyn NodeFunction, weights: &[f64], in_hamiltonian: bool) {
        if weights.iter().all(|w| *w == 0.0) {
            return;
        }
        let z = if self.phase.takes_parameters(function) { &self.full } else { &self.bare };
        let values = &mut self.values[..function.outputs()];
        function.jacobian(z, values, &mut self.entries[..function.pattern().jacobian_len()]);
        for ((r, c), v) in function.pattern().jacobian_entries().zip(&self.entries) {
            if let Some(g) = self.gradient.get_mut(c) {
                *g += weights[r] * v;
            }
        }
        if in_hamiltonian {
            let terms = weights.iter().zip(&*values).map(|(w, v)| (w * v).abs());
            self.largest_term = terms.fold(self.largest_term, f64::max);
        }
    }
}
