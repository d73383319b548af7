//! Functions of end quantities: the end cost `Phi`, the endpoint constraints `g`, and `Phibar = Phi + nu^T g` with first and second
//! derivatives in terms of the unknowns.

use std::sync::Arc;

use apsides_ad::NodeFunction;
use apsides_ocp::{EndpointInput, Ocp, Sense};

use super::layout::Layout;

/// A function of a few unknowns.
struct EndFunction {
    function: Arc<dyn NodeFunction>,
    columns: Vec<usize>,
    /// First row, or none for a share of the cost.
    first_row: Option<usize>,
    inputs: Vec<f64>,
    values: Vec<f64>,
    entries: Vec<f64>,
    hessian: Vec<f64>,
}

/// All of them.
pub(super) struct Ends {
    functions: Vec<EndFunction>,
    /// Linear end cost.
    linear: Vec<(usize, f64)>,
    sign: f64,
    /// Rows with pairs of unknowns whose difference they are.
    durations: Vec<(usize, usize)>,
    /// Values of the rows.
    pub(super) rows: Vec<f64>,
    /// `(row, unknown, slope)`.
    pub(super) slopes: Vec<(usize, usize, f64)>,
    /// Gradient of `Phibar`, per unknown.
    pub(super) gradient: Vec<f64>,
    /// `(i, j, value)` of the Hessian of `Phibar`, both triangles.
    pub(super) curvature: Vec<(usize, usize, f64)>,
}

/// Sign that makes the objective one to minimise.
pub(super) fn sign(ocp: &Ocp) -> f64 {
    match ocp.objective.sense {
        Sense::Minimize => 1.0,
        Sense::Maximize => -1.0,
    }
}

impl Ends {
    pub(super) fn new(ocp: &Ocp, layout: &Layout) -> Self {
        let columns =
            |inputs: &[EndpointInput]| inputs.iter().map(|&i| layout.unknown(i)).collect::<Vec<_>>();
        let make = |function: &Arc<dyn NodeFunction>, inputs: &[EndpointInput], first_row| EndFunction {
            function: function.clone(),
            columns: columns(inputs),
            first_row,
            inputs: vec![0.0; function.inputs()],
            values: vec![0.0; function.outputs()],
            entries: vec![0.0; function.pattern().jacobian_len()],
            hessian: vec![0.0; function.pattern().hessian_len()],
        };
        let mut functions: Vec<EndFunction> =
            ocp.objective.functions.iter().map(|(inputs, f)| make(f, inputs, None)).collect();
        let mut row = 0;
        for c in &ocp.constraints {
            functions.push(make(&c.function, &c.inputs, Some(row)));
            row += c.rows.len();
        }
        let durations = layout.durations.iter().map(|&k| {
            let p = &layout.phases[k];
            (p.initial_time, p.final_time)
        });
        Self {
            functions,
            linear: ocp.objective.linear.iter().map(|&(i, w)| (layout.unknown(i), w)).collect(),
            sign: sign(ocp),
            durations: durations.collect(),
            rows: vec![0.0; layout.rows.len()],
            slopes: Vec::new(),
            gradient: vec![0.0; layout.unknowns],
            curvature: Vec::new(),
        }
    }

    /// End cost in its own sense.
    pub(super) fn cost(&mut self, z: &[f64]) -> f64 {
        let mut cost: f64 = self.linear.iter().map(|&(i, w)| w * z[i]).sum();
        for f in self.functions.iter_mut().filter(|f| f.first_row.is_none()) {
            f.fill(z);
            f.function.value(&f.inputs, &mut f.values);
            cost += f.values[0];
        }
        cost
    }

    /// Rows, their slopes, and gradient and, where asked for, Hessian of `Phibar` at the unknowns `z` with multipliers `nu`.
    pub(super) fn evaluate(&mut self, z: &[f64], nu: &[f64], second: bool) {
        self.gradient.fill(0.0);
        self.slopes.clear();
        self.curvature.clear();
        for &(i, weight) in &self.linear {
            self.gradient[i] += self.sign * weight;
        }
        let duration_rows = self.rows.len() - self.durations.len();
        for (k, &(start, end)) in self.durations.iter().enumerate() {
            let row = duration_rows + k;
            self.rows[row] = z[end] - z[start];
            for (unknown, slope) in [(start, -1.0), (end, 1.0)] {
                self.slopes.push((row, unknown, slope));
                self.gradient[unknown] += slope * nu[row];
            }
        }
        let cost_weight = [self.sign];
        for f in &mut self.functions {
            f.fill(z);
            f.function.jacobian(&f.inputs, &mut f.values, &mut f.entries);
            let weights = match f.first_row {
                Some(first) => {
                    self.rows[first..first + f.values.len()].copy_from_slice(&f.values);
                    &nu[first..first + f.values.len()]
                }
                None => &cost_weight[..],
            };
            for ((r, c), &v) in f.function.pattern().jacobian_entries().zip(&f.entries) {
                self.gradient[f.columns[c]] += weights[r] * v;
                if let Some(first) = f.first_row {
                    self.slopes.push((first + r, f.columns[c], v));
                }
            }
            if second && !f.hessian.is_empty() {
                f.function.hessian(&f.inputs, weights, &mut f.hessian);
                for (&(i, j), &v) in f.function.pattern().hessian.iter().zip(&f.hessian) {
                    self.curvature.push((f.columns[i], f.columns[j], v));
                    if i != j {
                        self.curvature.push((f.columns[j], f.columns[i], v));
                    }
                }
            }
        }
    }
}

impl EndFunction {
    fn fill(&mut self, z: &[f64]) {
        for (input, &c) in self.inputs.iter_mut().zip(&self.columns) {
            *input = z[c];
        }
    }
}
