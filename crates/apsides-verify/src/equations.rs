//! The functions of one phase at one point, and the gradient of its Lagrangian.

use apsides_ad::NodeFunction;
use apsides_ocp::{Ocp, Phase, Sense};

/// `+1` for a minimised objective, `-1` for a maximised one, which is minimised negated.
pub(crate) fn sign(ocp: &Ocp) -> f64 {
    match ocp.objective.sense {
        Sense::Minimize => 1.0,
        Sense::Maximize => -1.0,
    }
}

/// Dynamics, integrands and path functions of one phase with their arrays.
pub(crate) struct Equations<'a> {
    pub(crate) phase: &'a Phase,
    /// Number of states, controls, static parameters.
    pub(crate) nx: usize,
    pub(crate) nu: usize,
    pub(crate) np: usize,
    /// Weight of each integral in the minimised objective, plus the multiplier of its bounds.
    weights: Vec<f64>,
    /// `[x, u, p, t]` and `[x, u, t]`.
    full: Vec<f64>,
    bare: Vec<f64>,
    values: Vec<f64>,
    entries: Vec<f64>,
}

/// `H = lambda . f + weighted integrands` at one point.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Hamiltonian {
    pub(crate) value: f64,
    /// Largest magnitude among its terms.
    pub(crate) largest_term: f64,
}

impl<'a> Equations<'a> {
    pub(crate) fn new(ocp: &'a Ocp, phase_index: usize, parameters: &[f64]) -> Self {
        let phase = &ocp.phases[phase_index];
        let (nx, nu, np) = (phase.states.len(), phase.controls.len(), parameters.len());
        let mut weights = vec![0.0; phase.integrals.len()];
        for &(p, q, w) in &ocp.objective.integrals {
            if p == phase_index {
                weights[q] += sign(ocp) * w;
            }
        }
        let mut full = vec![0.0; nx + nu + np + 1];
        full[nx + nu..nx + nu + np].copy_from_slice(parameters);
        let values = vec![0.0; phase.functions().map(|f| f.outputs()).max().unwrap_or(0)];
        let entries = vec![0.0; phase.functions().map(|f| f.pattern().jacobian_len()).max().unwrap_or(0)];
        Self { phase, nx, nu, np, weights, full, bare: vec![0.0; nx + nu + 1], values, entries }
    }

    /// Adds the multipliers of the bounds on the integrals to their weights in the Hamiltonian.
    pub(crate) fn with_integral_multipliers(mut self, multipliers: Option<&Vec<f64>>) -> Self {
        for (weight, multiplier) in self.weights.iter_mut().zip(multipliers.into_iter().flatten()) {
            *weight += multiplier;
        }
        self
    }

    /// Number of inputs `[x, u, p, t]`.
    pub(crate) fn width(&self) -> usize {
        self.full.len()
    }

    /// Weight of an integral in the Hamiltonian.
    pub(crate) fn weight(&self, integral: usize) -> f64 {
        self.weights[integral]
    }

    /// The static parameters.
    pub(crate) fn parameters(&self) -> &[f64] {
        &self.full[self.nx + self.nu..self.nx + self.nu + self.np]
    }

    /// Goes to a point.
    pub(crate) fn set(&mut self, t: f64, x: &[f64], u: &[f64]) {
        let (nx, nu) = (self.nx, self.nu);
        for z in [&mut self.full, &mut self.bare] {
            z[..nx].copy_from_slice(x);
            z[nx..nx + nu].copy_from_slice(u);
            if let Some(last) = z.last_mut() {
                *last = t;
            }
        }
    }

    fn point(&self, function: &dyn NodeFunction) -> &[f64] {
        if self.phase.takes_parameters(function) { &self.full } else { &self.bare }
    }

    /// Rates of the states, then the integrands.
    pub(crate) fn rates(&self, out: &mut [f64]) {
        let (rates, integrands) = out.split_at_mut(self.nx);
        let dynamics = self.phase.dynamics.as_ref();
        dynamics.value(self.point(dynamics), rates);
        for (q, out) in self.phase.integrals.iter().zip(integrands.chunks_mut(1)) {
            q.function.value(self.point(q.function.as_ref()), out);
        }
    }

    /// All path constraint rows.
    pub(crate) fn path(&self, out: &mut [f64]) {
        let mut rest = out;
        for p in &self.phase.path {
            let (rows, others) = rest.split_at_mut(p.rows.len());
            p.function.value(self.point(p.function.as_ref()), rows);
            rest = others;
        }
    }

    /// Hamiltonian, and the gradient of `H + mu . c` with respect to `[x, u, p, t]`.
    pub(crate) fn lagrangian(
        &mut self,
        costate: &[f64],
        multipliers: &[f64],
        gradient: &mut [f64],
    ) -> Hamiltonian {
        gradient.fill(0.0);
        let mut h = Hamiltonian::default();
        let phase = self.phase;
        self.add(phase.dynamics.as_ref(), costate, gradient, Some(&mut h));
        for (k, q) in phase.integrals.iter().enumerate() {
            let weight = self.weights[k];
            if weight != 0.0 {
                self.add(q.function.as_ref(), &[weight], gradient, Some(&mut h));
            }
        }
        let mut rest = multipliers;
        for p in &phase.path {
            let (rows, others) = rest.split_at(p.rows.len());
            if rows.iter().any(|m| *m != 0.0) {
                self.add(p.function.as_ref(), rows, gradient, None);
            }
            rest = others;
        }
        h
    }

    /// The Hamiltonian alone.
    pub(crate) fn hamiltonian(&mut self, costate: &[f64]) -> f64 {
        let phase = self.phase;
        let mut h = self.weighted(phase.dynamics.as_ref(), costate);
        for (k, q) in phase.integrals.iter().enumerate() {
            let weight = self.weights[k];
            if weight != 0.0 {
                h += self.weighted(q.function.as_ref(), &[weight]);
            }
        }
        h
    }

    fn weighted(&mut self, function: &dyn NodeFunction, weights: &[f64]) -> f64 {
        let z = if self.phase.takes_parameters(function) { &self.full } else { &self.bare };
        let values = &mut self.values[..function.outputs()];
        function.value(z, values);
        weights.iter().zip(&*values).map(|(w, v)| w * v).sum()
    }

    /// Returns true if there is a path constraint row of this index and no control enters it.
    pub(crate) fn is_free_of_controls(&self, row: usize) -> bool {
        let controls = self.nx..self.nx + self.nu;
        self.path_row(row).is_some_and(|(function, output)| {
            let pattern = function.pattern();
            let columns = &pattern.columns[pattern.row_offsets[output]..pattern.row_offsets[output + 1]];
            columns.iter().all(|c| !controls.contains(c))
        })
    }

    /// Returns true if there is a path constraint row of this index, and controls alone enter it and those beside it, by value or by derivative:
    /// what switches at a time has no slope in it.
    pub(crate) fn is_of_controls_alone(&self, row: usize) -> bool {
        let controls = self.nx..self.nx + self.nu;
        let formula = self.path_row(row).and_then(|(function, _)| function.formula().ok());
        formula.is_some_and(|formula| {
            let operands = formula.operations().iter().flat_map(|operation| operation.operands());
            let mut values = operands.chain(formula.outputs().iter().copied());
            values.all(|v| v >= formula.inputs() || controls.contains(&v))
        })
    }

    /// The states that a path constraint row takes.
    pub(crate) fn states_of_row(&self, row: usize) -> impl Iterator<Item = usize> {
        let columns = self.path_row(row).map(|(function, output)| {
            let pattern = function.pattern();
            pattern.columns[pattern.row_offsets[output]..pattern.row_offsets[output + 1]].to_vec()
        });
        let nx = self.nx;
        columns.into_iter().flatten().filter(move |c| *c < nx)
    }

    /// Value of a path constraint row, and its gradient with respect to `[x, u, p, t]`; NaN where there is no such row.
    pub(crate) fn row_gradient(&mut self, row: usize, gradient: &mut [f64]) -> f64 {
        let Some((function, output)) = self.path_row(row) else { return f64::NAN };
        gradient.fill(0.0);
        let mut weights = vec![0.0; function.outputs()];
        weights[output] = 1.0;
        self.add(function, &weights, gradient, None);
        self.values[output]
    }

    /// The functions that enter the Lagrangian, with the weights of their outputs: costates of the rates, weights of the integrals,
    /// multipliers of path constraints.
    pub(crate) fn weighted_functions<'w>(
        &'w self,
        costate: &'w [f64],
        multipliers: &'w [f64],
    ) -> impl Iterator<Item = (&'a dyn NodeFunction, &'w [f64])> + 'w {
        let phase = self.phase;
        let integrals = phase.integrals.iter().zip(self.weights.chunks(1));
        let mut first = 0;
        let path = phase.path.iter().map(move |p| {
            let rows = first..first + p.rows.len();
            first = rows.end;
            (p.function.as_ref(), &multipliers[rows])
        });
        std::iter::once((phase.dynamics.as_ref(), costate))
            .chain(integrals.map(|(q, weight)| (q.function.as_ref(), weight)))
            .chain(path)
    }

    /// Values of a function of the phase's inputs, and the Jacobian by rows with respect to `[x, u, p, t]`.
    pub(crate) fn values_and_jacobian(&self, function: &dyn NodeFunction) -> (Vec<f64>, Vec<Vec<f64>>) {
        let (z, width) = (self.point(function), self.full.len());
        let pattern = function.pattern();
        let (mut values, mut entries) = (vec![0.0; function.outputs()], vec![0.0; pattern.jacobian_len()]);
        function.jacobian(z, &mut values, &mut entries);
        let mut rows = vec![vec![0.0; width]; values.len()];
        for ((row, column), entry) in pattern.jacobian_entries().zip(&entries) {
            rows[row][place_of(column, z.len(), width)] += entry;
        }
        (values, rows)
    }

    /// Value of an integrand, and its gradient with respect to `[x, u, p, t]`.
    pub(crate) fn integrand_gradient(&mut self, integral: usize, gradient: &mut [f64]) -> f64 {
        gradient.fill(0.0);
        self.add(self.phase.integrals[integral].function.as_ref(), &[1.0], gradient, None);
        self.values[0]
    }

    /// Rates of the states, and their Jacobian by rows with respect to `[x, u, p, t]`.
    pub(crate) fn dynamics_jacobian(&mut self, rates: &mut [f64], jacobian: &mut [f64]) {
        jacobian.fill(0.0);
        let phase = self.phase;
        let function = phase.dynamics.as_ref();
        let z = if phase.takes_parameters(function) { &self.full } else { &self.bare };
        let width = self.full.len();
        let entries = &mut self.entries[..function.pattern().jacobian_len()];
        function.jacobian(z, rates, entries);
        for ((row, column), entry) in function.pattern().jacobian_entries().zip(&*entries) {
            jacobian[row * width + place_of(column, z.len(), width)] += entry;
        }
    }

    /// Hessian of the Hamiltonian and of `mu . c`, each a full matrix by rows over `[x, u, p, t]`.
    pub(crate) fn curvature(
        &self,
        costate: &[f64],
        multipliers: &[f64],
        hamiltonian: &mut [f64],
        path: &mut [f64],
    ) {
        hamiltonian.fill(0.0);
        path.fill(0.0);
        let phase = self.phase;
        self.add_hessian(phase.dynamics.as_ref(), costate, hamiltonian);
        for (q, weight) in phase.integrals.iter().zip(&self.weights).filter(|(_, w)| **w != 0.0) {
            self.add_hessian(q.function.as_ref(), &[*weight], hamiltonian);
        }
        let mut rest = multipliers;
        for p in &phase.path {
            let (rows, others) = rest.split_at(p.rows.len());
            if rows.iter().any(|m| *m != 0.0) {
                self.add_hessian(p.function.as_ref(), rows, path);
            }
            rest = others;
        }
    }

    /// Adds the Hessian of one path constraint row times a weight.
    pub(crate) fn add_row_hessian(&self, row: usize, weight: f64, out: &mut [f64]) {
        if let Some((function, output)) = self.path_row(row) {
            let mut weights = vec![0.0; function.outputs()];
            weights[output] = weight;
            self.add_hessian(function, &weights, out);
        }
    }

    fn add_hessian(&self, function: &dyn NodeFunction, weights: &[f64], out: &mut [f64]) {
        let z = self.point(function);
        let mut entries = vec![0.0; function.pattern().hessian_len()];
        function.hessian(z, weights, &mut entries);
        let width = self.full.len();
        for (&(i, j), v) in function.pattern().hessian.iter().zip(&entries) {
            let (i, j) = (place_of(i, z.len(), width), place_of(j, z.len(), width));
            out[i * width + j] += v;
            if i != j {
                out[j * width + i] += v;
            }
        }
    }

    /// Function and output of a path constraint row.
    pub(crate) fn path_row(&self, row: usize) -> Option<(&'a dyn NodeFunction, usize)> {
        let phase = self.phase;
        let mut first = 0;
        for p in &phase.path {
            if row < first + p.rows.len() {
                return Some((p.function.as_ref(), row - first));
            }
            first += p.rows.len();
        }
        None
    }

    fn add(
        &mut self,
        function: &dyn NodeFunction,
        weights: &[f64],
        gradient: &mut [f64],
        hamiltonian: Option<&mut Hamiltonian>,
    ) {
        let full = self.phase.takes_parameters(function);
        let z = if full { &self.full } else { &self.bare };
        let pattern = function.pattern();
        let (values, entries) =
            (&mut self.values[..function.outputs()], &mut self.entries[..pattern.jacobian_len()]);
        function.jacobian(z, values, entries);
        let inputs = z.len();
        for ((row, column), entry) in pattern.jacobian_entries().zip(&*entries) {
            gradient[place_of(column, inputs, gradient.len())] += weights[row] * entry;
        }
        if let Some(h) = hamiltonian {
            for (w, v) in weights.iter().zip(&*values) {
                h.value += w * v;
                h.largest_term = h.largest_term.max((w * v).abs());
            }
        }
    }

    /// Returns true if no function that enters the Lagrangian depends on time explicitly.
    pub(crate) fn is_autonomous(&self) -> bool {
        let integrands = self
            .phase
            .integrals
            .iter()
            .zip(&self.weights)
            .filter(|(_, w)| **w != 0.0)
            .map(|(q, _)| &q.function);
        std::iter::once(&self.phase.dynamics)
            .chain(self.phase.path.iter().map(|p| &p.function))
            .chain(integrands)
            .all(|f| !f.pattern().columns.contains(&(f.inputs() - 1)))
    }
}

/// Column of an input of a function with `inputs` inputs among `width` of `[x, u, p, t]`: time comes last in both.
fn place_of(column: usize, inputs: usize, width: usize) -> usize {
    if column + 1 == inputs { width - 1 } else { column }
}
