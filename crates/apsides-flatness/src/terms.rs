//! Functions of the problem composed with the flat map: path constraints and integrands at a point, functions of end quantities.

use std::sync::Arc;

use apsides_ad::NodeFunction;

use crate::flat_point::FlatPoint;

/// Values and derivatives of a function of the problem, and where its outputs go.
pub(crate) struct Evaluated {
    function: Arc<dyn NodeFunction>,
    /// Row of each output.
    pub(crate) rows: Vec<Option<usize>>,
    /// Share of each output in the cost.
    cost: f64,
    inputs: Vec<f64>,
    pub(crate) values: Vec<f64>,
    entries: Vec<f64>,
    weights: Vec<f64>,
    hessian: Vec<f64>,
}

impl Evaluated {
    fn new(function: &Arc<dyn NodeFunction>, rows: Vec<Option<usize>>, cost: f64) -> Self {
        Self {
            inputs: vec![0.0; function.inputs()],
            values: vec![0.0; function.outputs()],
            entries: vec![0.0; function.pattern().jacobian_len()],
            weights: vec![0.0; function.outputs()],
            hessian: vec![0.0; function.pattern().hessian_len()],
            function: Arc::clone(function),
            rows,
            cost,
        }
    }

    fn weigh(&mut self, factor: f64, cost: f64, multipliers: &[f64]) {
        for (w, row) in self.weights.iter_mut().zip(&self.rows) {
            *w = factor * (row.map_or(0.0, |r| multipliers[r]) + cost * self.cost);
        }
    }
}

/// A function of the quantities of one point.
pub(crate) struct PathTerm {
    pub(crate) flat_point: usize,
    /// Quantity of each input.
    quantities: Vec<usize>,
    /// Outputs are multiplied by this and, for an integral, by the duration.
    factor: f64,
    integral: bool,
    pub(crate) evaluated: Evaluated,
}

impl PathTerm {
    /// A path function; one row per output, where it has one.
    pub(crate) fn path(
        function: &Arc<dyn NodeFunction>,
        flat_point: usize,
        quantities: Vec<usize>,
        rows: Vec<Option<usize>>,
    ) -> Self {
        let evaluated = Evaluated::new(function, rows, 0.0);
        Self { flat_point, quantities, factor: 1.0, integral: false, evaluated }
    }

    /// An integrand with its quadrature weight on normalised time.
    pub(crate) fn integrand(
        function: &Arc<dyn NodeFunction>,
        flat_point: usize,
        quantities: Vec<usize>,
        weight: f64,
        row: Option<usize>,
        cost: f64,
    ) -> Self {
        let evaluated = Evaluated::new(function, vec![row], cost);
        Self { flat_point, quantities, factor: weight, integral: true, evaluated }
    }

    pub(crate) fn has_cost(&self) -> bool {
        self.evaluated.cost != 0.0
    }

    fn fill_inputs(&mut self, flat_point: &FlatPoint) -> f64 {
        for (z, &q) in self.evaluated.inputs.iter_mut().zip(&self.quantities) {
            *z = flat_point.values[q];
        }
        let duration = if self.integral { flat_point.values[flat_point.quantities.duration()] } else { 1.0 };
        self.factor * duration
    }

    /// Adds the outputs to the rows and returns the share of the cost.
    pub(crate) fn add_values(&mut self, flat_point: &FlatPoint, rows: &mut [f64]) -> f64 {
        let factor = self.fill_inputs(flat_point);
        let e = &mut self.evaluated;
        e.function.value(&e.inputs, &mut e.values);
        if !rows.is_empty() {
            for (row, v) in e.rows.iter().zip(&e.values) {
                if let Some(r) = row {
                    rows[*r] += factor * v;
                }
            }
        }
        factor * e.cost * e.values.first().copied().unwrap_or(0.0)
    }

    pub(crate) fn refresh(&mut self, flat_point: &FlatPoint) {
        self.fill_inputs(flat_point);
        let e = &mut self.evaluated;
        e.function.jacobian(&e.inputs, &mut e.values, &mut e.entries);
    }

    /// `emit(output, column, value)` of the first derivatives, entries of one position summed by the receiver.
    fn each_derivative(&self, flat_point: &FlatPoint, mut emit: impl FnMut(usize, usize, f64)) {
        let duration = flat_point.quantities.duration();
        let scale = if self.integral { self.factor * flat_point.values[duration] } else { self.factor };
        let e = &self.evaluated;
        for ((output, input), v) in e.function.pattern().jacobian_entries().zip(&e.entries) {
            for (column, slope) in flat_point.gradient(self.quantities[input]) {
                emit(output, column, scale * v * slope);
            }
        }
        if self.integral {
            for (output, v) in e.values.iter().enumerate() {
                for (column, slope) in flat_point.gradient(duration) {
                    emit(output, column, self.factor * v * slope);
                }
            }
        }
    }

    pub(crate) fn each_jacobian(&self, flat_point: &FlatPoint, mut emit: impl FnMut(usize, usize, f64)) {
        self.each_derivative(flat_point, |output, column, v| {
            if let Some(r) = self.evaluated.rows[output] {
                emit(r, column, v);
            }
        });
    }

    pub(crate) fn add_gradient(&self, flat_point: &FlatPoint, gradient: &mut [f64]) {
        let cost = self.evaluated.cost;
        self.each_derivative(flat_point, |_, column, v| gradient[column] += cost * v);
    }

    /// Hands second derivatives and multipliers to the point.
    pub(crate) fn add_curvature(&mut self, flat_point: &mut FlatPoint, cost: f64, multipliers: &[f64]) {
        let duration = flat_point.quantities.duration();
        let scale = if self.integral { flat_point.values[duration] } else { 1.0 };
        let e = &mut self.evaluated;
        e.weigh(self.factor, cost, multipliers);
        if e.weights.iter().all(|w| *w == 0.0) {
            return;
        }
        e.function.hessian(&e.inputs, &e.weights, &mut e.hessian);
        for (&(i, j), h) in e.function.pattern().hessian.iter().zip(&e.hessian) {
            flat_point.second_derivatives.push((self.quantities[i], self.quantities[j], scale * h));
        }
        for ((output, input), v) in e.function.pattern().jacobian_entries().zip(&e.entries) {
            let g = e.weights[output] * v;
            flat_point.add_weight(self.quantities[input], scale * g);
            if self.integral {
                flat_point.second_derivatives.push((duration, self.quantities[input], g));
            }
        }
    }
}

/// The form of an end quantity in the discretised problem.
#[derive(Clone, Copy, Debug)]
pub(crate) enum EndQuantity {
    /// A quantity of a point.
    At(usize, usize),
    /// A variable.
    Column(usize),
    /// A number.
    Constant(f64),
}

impl EndQuantity {
    pub(crate) fn value(self, flat_points: &[FlatPoint], x: &[f64]) -> f64 {
        match self {
            Self::At(s, q) => flat_points[s].values[q],
            Self::Column(c) => x[c],
            Self::Constant(v) => v,
        }
    }

    /// Columns and derivatives.
    pub(crate) fn each(self, flat_points: &[FlatPoint], mut emit: impl FnMut(usize, f64)) {
        match self {
            Self::At(s, q) => flat_points[s].gradient(q).for_each(|(c, v)| emit(c, v)),
            Self::Column(c) => emit(c, 1.0),
            Self::Constant(_) => {}
        }
    }
}

/// A function of end quantities: boundary conditions, linkages, end costs.
pub(crate) struct EndTerm {
    inputs: Vec<EndQuantity>,
    pub(crate) evaluated: Evaluated,
}

impl EndTerm {
    pub(crate) fn new(
        function: &Arc<dyn NodeFunction>,
        inputs: Vec<EndQuantity>,
        rows: Vec<Option<usize>>,
        cost: f64,
    ) -> Self {
        Self { inputs, evaluated: Evaluated::new(function, rows, cost) }
    }

    pub(crate) fn has_cost(&self) -> bool {
        self.evaluated.cost != 0.0
    }

    fn fill_inputs(&mut self, flat_points: &[FlatPoint], x: &[f64]) {
        for (z, input) in self.evaluated.inputs.iter_mut().zip(&self.inputs) {
            *z = input.value(flat_points, x);
        }
    }

    pub(crate) fn add_values(&mut self, flat_points: &[FlatPoint], x: &[f64], rows: &mut [f64]) -> f64 {
        self.fill_inputs(flat_points, x);
        let e = &mut self.evaluated;
        e.function.value(&e.inputs, &mut e.values);
        if !rows.is_empty() {
            for (row, v) in e.rows.iter().zip(&e.values) {
                if let Some(r) = row {
                    rows[*r] += v;
                }
            }
        }
        e.cost * e.values.first().copied().unwrap_or(0.0)
    }

    pub(crate) fn refresh(&mut self, flat_points: &[FlatPoint], x: &[f64]) {
        self.fill_inputs(flat_points, x);
        let e = &mut self.evaluated;
        e.function.jacobian(&e.inputs, &mut e.values, &mut e.entries);
    }

    fn each_derivative(&self, flat_points: &[FlatPoint], mut emit: impl FnMut(usize, usize, f64)) {
        let e = &self.evaluated;
        for ((output, input), v) in e.function.pattern().jacobian_entries().zip(&e.entries) {
            self.inputs[input].each(flat_points, |c, slope| emit(output, c, v * slope));
        }
    }

    pub(crate) fn each_jacobian(&self, flat_points: &[FlatPoint], mut emit: impl FnMut(usize, usize, f64)) {
        self.each_derivative(flat_points, |output, c, v| {
            if let Some(r) = self.evaluated.rows[output] {
                emit(r, c, v);
            }
        });
    }

    pub(crate) fn add_gradient(&self, flat_points: &[FlatPoint], gradient: &mut [f64]) {
        let cost = self.evaluated.cost;
        self.each_derivative(flat_points, |_, c, v| gradient[c] += cost * v);
    }

    /// Hands multipliers to the points and emits the products of first derivatives.
    pub(crate) fn each_hessian(
        &mut self,
        flat_points: &mut [FlatPoint],
        cost: f64,
        multipliers: &[f64],
        mut emit: impl FnMut(usize, usize, f64),
    ) {
        let e = &mut self.evaluated;
        e.weigh(1.0, cost, multipliers);
        e.function.hessian(&e.inputs, &e.weights, &mut e.hessian);
        for ((output, input), v) in e.function.pattern().jacobian_entries().zip(&e.entries) {
            if let EndQuantity::At(s, q) = self.inputs[input] {
                flat_points[s].add_weight(q, e.weights[output] * v);
            }
        }
        for (&(i, j), &h) in e.function.pattern().hessian.iter().zip(&e.hessian) {
            self.inputs[i].each(flat_points, |a, va| {
                self.inputs[j].each(flat_points, |b, vb| {
                    let value = h * va * vb;
                    if i != j {
                        // Both orders of the pair fall on the diagonal where the columns agree.
                        emit(a.max(b), a.min(b), if a == b { 2.0 * value } else { value });
                    } else if a >= b {
                        emit(a, b, value);
                    }
                });
            });
        }
    }
}
