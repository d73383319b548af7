//! Functions of end quantities: the end cost `Phi`, the endpoint constraints `g`, and `Phibar = Phi + nu^T g` with first and second
//! derivatives in terms of the unknowns.

use apsides_ocp::{EndpointTerm, Ocp, Sense};

use super::layout::MultipointLayout;

/// All of them.
pub(super) struct Ends {
    terms: Vec<EndpointTerm>,
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
    pub(super) fn new(ocp: &Ocp, layout: &MultipointLayout) -> Self {
        let mut next = 0;
        let first_rows = ocp.constraints.iter().map(|c| {
            let first = next;
            next += c.rows.len();
            first
        });
        let first_rows: Vec<usize> = first_rows.collect();
        let durations = layout.durations.iter().map(|&k| {
            let p = &layout.phases[k];
            (p.initial_time, p.final_time)
        });
        Self {
            terms: EndpointTerm::all(ocp, &first_rows, |input| layout.unknown(input)),
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
        let linear: f64 = self.linear.iter().map(|&(i, w)| w * z[i]).sum();
        let functions = self.terms.iter_mut().filter(|t| t.has_cost());
        linear + self.sign * functions.map(|t| t.add_values(z, &mut [])).sum::<f64>()
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
        let Self { terms, rows, slopes, gradient, curvature, .. } = self;
        for term in terms {
            term.refresh(z);
            term.each_value(|row, v| rows[row] = v);
            term.each_jacobian(|row, unknown, v| {
                slopes.push((row, unknown, v));
                gradient[unknown] += nu[row] * v;
            });
            term.add_gradient(gradient);
            if second {
                term.each_hessian(1.0, nu, |i, j, v| {
                    curvature.push((i, j, v));
                    if i != j {
                        curvature.push((j, i, v));
                    }
                });
            }
        }
    }
}
