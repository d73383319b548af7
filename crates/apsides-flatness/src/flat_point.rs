//! The flat map at one normalised time of a phase, composed with the splines: quantities and their derivatives.
//!
//! With the coefficients `c_ij` of output `i`, the duration `T = tf - t0` and the normalised time `s`
//!
//! ```text
//! y_i^(d) = T^-d sum_j B_j^(d)(s) c_ij,     t = (1 - s) t0 + s tf,     [x, u, r] = F(y, p, t)
//! ```
//!
//! The chain rule from the inputs of `F` to coefficients, times and parameters is applied here and nowhere else.

use std::sync::Arc;

use apsides_ad::NodeFunction;

use crate::FlatSystem;
use crate::layout::{Layout, Time};
use crate::spline_mesh::SplineMesh;

/// Index of a quantity of a point: states, controls, residuals, then static parameters, time, duration.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quantities {
    pub(crate) states: usize,
    pub(crate) controls: usize,
    pub(crate) residuals: usize,
    pub(crate) parameters: usize,
}

impl Quantities {
    /// Outputs of the flat map: the quantities that are not linear in the variables.
    pub(crate) fn mapped(&self) -> usize {
        self.states + self.controls + self.residuals
    }

    pub(crate) fn control(&self, k: usize) -> usize {
        self.states + k
    }

    pub(crate) fn residual(&self, k: usize) -> usize {
        self.states + self.controls + k
    }

    pub(crate) fn parameter(&self, k: usize) -> usize {
        self.mapped() + k
    }

    pub(crate) fn time(&self) -> usize {
        self.mapped() + self.parameters
    }

    pub(crate) fn duration(&self) -> usize {
        self.time() + 1
    }

    pub(crate) fn len(&self) -> usize {
        self.duration() + 1
    }

    /// Quantity of each input of a function of the problem, `[x, u, p, t]` with all parameters or none.
    pub(crate) fn inputs(&self, function: &dyn NodeFunction) -> Vec<usize> {
        let (n, base) = (function.inputs(), self.states + self.controls);
        let of = |k: usize| match k {
            k if k < base => k,
            k if k + 1 < n => self.parameter(k - base),
            _ => self.time(),
        };
        (0..n).map(of).collect()
    }
}

/// One input of the flat map as a function of the local variables.
struct Input {
    /// Derivative number of a jet entry; 0 for parameters and time.
    derivative: usize,
    /// Coefficients that matter: local variable and weight on normalised time.
    coefficients: Vec<(usize, f64)>,
    /// Local variables and derivatives, refreshed.
    slopes: Vec<(usize, f64)>,
}

/// The flat map at one point.
pub(crate) struct FlatPoint {
    map: Arc<dyn NodeFunction>,
    pub(crate) fraction: f64,
    pub(crate) quantities: Quantities,
    initial_time: Time,
    final_time: Time,
    first_parameter: usize,
    /// Column of each local variable.
    pub(crate) columns: Vec<usize>,
    /// Local variables of start and end time.
    local_times: (Option<usize>, Option<usize>),
    inputs: Vec<Input>,
    /// Local variables that each quantity depends on, ascending.
    supports: Vec<Vec<usize>>,
    z: Vec<f64>,
    duration: f64,
    /// Powers of the rate of normalised time, one per derivative.
    powers: Vec<f64>,
    /// Values of the quantities.
    pub(crate) values: Vec<f64>,
    entries: Vec<f64>,
    /// Row-major quantities by local variables.
    jacobian: Vec<f64>,
    /// Multipliers of the mapped quantities.
    pub(crate) weights: Vec<f64>,
    /// Second derivatives of functions of the quantities, lower triangle, in any order.
    pub(crate) second_derivatives: Vec<(usize, usize, f64)>,
    map_hessian: Vec<f64>,
    slope: Vec<f64>,
    /// Row-major inputs by local variables.
    products: Vec<f64>,
    hessian: Vec<f64>,
}

impl FlatPoint {
    pub(crate) fn new(
        system: &FlatSystem,
        mesh: &SplineMesh,
        layout: &Layout,
        phase: usize,
        fraction: f64,
    ) -> Self {
        let p = &layout.phases[phase];
        let parameters = layout.variables - layout.first_parameter;
        let quantities = Quantities {
            states: system.states,
            controls: system.controls,
            residuals: system.residuals,
            parameters,
        };
        let (mut columns, mut inputs) = (Vec::new(), Vec::new());
        for (basis, &first) in mesh.bases.iter().zip(&p.outputs) {
            let k = basis.order();
            let mut rows = vec![0.0; k * system.jet_rows];
            let start = first + basis.derivatives(fraction, &mut rows);
            for (d, row) in rows.chunks(k).enumerate() {
                let weight = |(j, w): (usize, &f64)| (*w != 0.0).then_some((columns.len() + j, *w));
                let coefficients = row.iter().enumerate().filter_map(weight).collect();
                let slopes = Vec::with_capacity(k + 2);
                inputs.push(Input { derivative: d, coefficients, slopes });
            }
            columns.extend(start..start + k);
        }
        let mut local = |column: Option<usize>| {
            column.map(|c| {
                columns.push(c);
                columns.len() - 1
            })
        };
        let local_times = (local(p.initial_time.column()), local(p.final_time.column()));
        let first_local_parameter = columns.len();
        columns.extend(layout.first_parameter..layout.variables);
        for k in 0..system.parameters {
            let coefficients = vec![(first_local_parameter + k, 1.0)];
            inputs.push(Input { derivative: 0, coefficients, slopes: Vec::new() });
        }
        let by_time = [(local_times.0, 1.0 - fraction), (local_times.1, fraction)];
        let by_time: Vec<(usize, f64)> =
            by_time.iter().filter_map(|(l, w)| l.filter(|_| *w != 0.0).map(|l| (l, *w))).collect();
        inputs.push(Input { derivative: 0, coefficients: by_time.clone(), slopes: Vec::new() });

        let supports = supports(system, &quantities, &inputs, local_times, first_local_parameter, &by_time);
        let (m, n) = (quantities.len(), columns.len());
        let mut flat_point = Self {
            fraction,
            quantities,
            initial_time: p.initial_time,
            final_time: p.final_time,
            first_parameter: layout.first_parameter,
            local_times,
            z: vec![0.0; inputs.len()],
            duration: 0.0,
            powers: vec![1.0; system.jet_rows],
            values: vec![0.0; m],
            entries: vec![0.0; system.map.pattern().jacobian_len()],
            jacobian: vec![0.0; m * n],
            weights: vec![0.0; quantities.mapped()],
            second_derivatives: Vec::new(),
            map_hessian: vec![0.0; system.map.pattern().hessian_len()],
            slope: vec![0.0; inputs.len()],
            products: vec![0.0; inputs.len() * n],
            hessian: vec![0.0; n * n],
            map: Arc::clone(&system.map),
            inputs,
            supports,
            columns,
        };
        // What is linear in the variables never changes.
        for k in 0..parameters {
            flat_point.jacobian[quantities.parameter(k) * n + first_local_parameter + k] = 1.0;
        }
        for (l, w) in by_time {
            flat_point.jacobian[quantities.time() * n + l] = w;
        }
        for (l, sign) in [(flat_point.local_times.0, -1.0), (flat_point.local_times.1, 1.0)] {
            if let Some(l) = l {
                flat_point.jacobian[quantities.duration() * n + l] = sign;
            }
        }
        flat_point
    }

    /// Values of the quantities at `x`.
    pub(crate) fn set_values(&mut self, x: &[f64]) {
        self.set_inputs(x);
        let mapped = self.quantities.mapped();
        self.map.value(&self.z, &mut self.values[..mapped]);
    }

    /// Inputs of the map, and what is linear in the variables.
    fn set_inputs(&mut self, x: &[f64]) {
        let (t0, tf) = (self.initial_time.value(x), self.final_time.value(x));
        self.duration = tf - t0;
        let q = self.quantities;
        for k in 0..q.parameters {
            self.values[q.parameter(k)] = x[self.first_parameter + k];
        }
        let t = (1.0 - self.fraction) * t0 + self.fraction * tf;
        self.values[q.time()] = t;
        self.values[q.duration()] = self.duration;
        let rate = self.duration.recip();
        for d in 1..self.powers.len() {
            self.powers[d] = self.powers[d - 1] * rate;
        }
        for (z, input) in self.z.iter_mut().zip(&self.inputs) {
            let sum: f64 = input.coefficients.iter().map(|&(l, w)| w * x[self.columns[l]]).sum();
            *z = sum * self.powers[input.derivative];
        }
        if let Some(last) = self.z.last_mut() {
            *last = t;
        }
    }

    /// Values and first derivatives of the quantities at `x`.
    pub(crate) fn set_derivatives(&mut self, x: &[f64]) {
        self.set_inputs(x);
        let rate = self.duration.recip();
        for (input, z) in self.inputs.iter_mut().zip(&self.z) {
            let scale = self.powers[input.derivative];
            input.slopes.clear();
            input.slopes.extend(input.coefficients.iter().map(|&(l, w)| (l, w * scale)));
            if input.derivative > 0 {
                let by_duration = -(input.derivative as f64) * z * rate;
                input.slopes.extend(self.local_times.0.map(|l| (l, -by_duration)));
                input.slopes.extend(self.local_times.1.map(|l| (l, by_duration)));
            }
        }
        let (m, n) = (self.quantities.mapped(), self.columns.len());
        self.map.jacobian(&self.z, &mut self.values[..m], &mut self.entries);
        self.jacobian[..m * n].fill(0.0);
        for ((f, input), v) in self.map.pattern().jacobian_entries().zip(&self.entries) {
            for &(l, slope) in &self.inputs[input].slopes {
                self.jacobian[f * n + l] += v * slope;
            }
        }
    }

    /// Columns that a quantity depends on, and the derivatives.
    pub(crate) fn gradient(&self, quantity: usize) -> impl Iterator<Item = (usize, f64)> + Clone + '_ {
        let row = &self.jacobian[quantity * self.columns.len()..];
        self.supports[quantity].iter().map(move |&l| (self.columns[l], row[l]))
    }

    /// An input of the flat map: its value, columns and derivatives.
    pub(crate) fn input(&self, index: usize) -> (f64, impl Iterator<Item = (usize, f64)> + '_) {
        (self.z[index], self.inputs[index].slopes.iter().map(|&(l, v)| (self.columns[l], v)))
    }

    /// Forgets what functions of the quantities added.
    pub(crate) fn clear(&mut self) {
        self.weights.fill(0.0);
        self.second_derivatives.clear();
    }

    /// Adds a multiplier to a quantity.
    pub(crate) fn add_weight(&mut self, quantity: usize, weight: f64) {
        if let Some(w) = self.weights.get_mut(quantity) {
            *w += weight;
        }
    }

    /// Positions of the entries of [`hessian`](Self::hessian).
    pub(crate) fn hessian_positions(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let c = &self.columns;
        (0..c.len()).flat_map(move |i| (0..=i).map(move |j| (c[i].max(c[j]), c[i].min(c[j]))))
    }

    /// Lower triangle, row by row, of the Hessian of what the weights and the outer second derivatives say, after
    /// [`set_derivatives`](Self::set_derivatives) at the same point.
    pub(crate) fn hessian(&mut self, mut emit: impl FnMut(f64)) {
        let n = self.columns.len();
        if self.second_derivatives.is_empty() && self.weights.iter().all(|w| *w == 0.0) {
            (0..n * (n + 1) / 2).for_each(|_| emit(0.0));
            return;
        }
        self.hessian.fill(0.0);
        let h = &mut self.hessian;
        self.map.hessian(&self.z, &self.weights, &mut self.map_hessian);
        // Second derivatives of the map times the slopes of its inputs, from the right and then from the left.
        self.products.fill(0.0);
        for (&(a, b), &v) in self.map.pattern().hessian.iter().zip(&self.map_hessian) {
            self.inputs[b].slopes.iter().for_each(|&(l, s)| self.products[a * n + l] += v * s);
            if a != b {
                self.inputs[a].slopes.iter().for_each(|&(l, s)| self.products[b * n + l] += v * s);
            }
        }
        for (input, product) in self.inputs.iter().zip(self.products.chunks(n)) {
            for &(i, s) in &input.slopes {
                h[i * n..=i * n + i].iter_mut().zip(product).for_each(|(h, p)| *h += s * p);
            }
        }
        self.slope.fill(0.0);
        for ((f, input), v) in self.map.pattern().jacobian_entries().zip(&self.entries) {
            self.slope[input] += self.weights[f] * v;
        }
        // Second derivatives of the jet in coefficients and duration.
        let rate = self.duration.recip();
        for ((input, z), &g) in self.inputs.iter().zip(&self.z).zip(&self.slope) {
            let d = input.derivative as f64;
            if d == 0.0 || g == 0.0 {
                continue;
            }
            let times = [(self.local_times.0, -1.0), (self.local_times.1, 1.0)];
            let times = times.iter().filter_map(|&(l, sign)| l.map(|l| (l, sign)));
            let twice = g * d * (d + 1.0) * z * rate * rate;
            for (l, sign) in times.clone() {
                for &(c, slope) in &input.slopes[..input.coefficients.len()] {
                    h[l * n + c] -= sign * g * d * slope * rate;
                }
                for (other, other_sign) in times.clone().filter(|(o, _)| *o <= l) {
                    h[l * n + other] += sign * other_sign * twice;
                }
            }
        }
        for &(a, b, v) in &self.second_derivatives {
            for &i in &self.supports[a] {
                let share = v * self.jacobian[a * n + i];
                for &j in &self.supports[b] {
                    add_pair(h, n, share * self.jacobian[b * n + j], a == b, i, j);
                }
            }
        }
        for i in 0..n {
            h[i * n..=i * n + i].iter().for_each(|v| emit(*v));
        }
    }
}

/// Adds one pair of `f g' + g f'`, or of `f f'` for the same function, to the lower triangle: met once for `(i, j)` and, for
/// the same function, once for `(j, i)`.
#[inline]
fn add_pair(h: &mut [f64], n: usize, value: f64, same: bool, i: usize, j: usize) {
    if same {
        if i >= j {
            h[i * n + j] += value;
        }
    } else {
        h[i.max(j) * n + i.min(j)] += if i == j { 2.0 * value } else { value };
    }
}

fn supports(
    system: &FlatSystem,
    quantities: &Quantities,
    inputs: &[Input],
    times: (Option<usize>, Option<usize>),
    first_parameter: usize,
    by_time: &[(usize, f64)],
) -> Vec<Vec<usize>> {
    let mut supports = vec![Vec::new(); quantities.len()];
    for (f, input) in system.map.pattern().jacobian_entries() {
        let input = &inputs[input];
        supports[f].extend(input.coefficients.iter().map(|(l, _)| *l));
        if input.derivative > 0 {
            supports[f].extend(times.0.iter().chain(&times.1));
        }
    }
    for k in 0..quantities.parameters {
        supports[quantities.parameter(k)].push(first_parameter + k);
    }
    supports[quantities.time()].extend(by_time.iter().map(|(l, _)| *l));
    supports[quantities.duration()].extend(times.0.iter().chain(&times.1));
    for s in &mut supports {
        s.sort_unstable();
        s.dedup();
    }
    supports
}
