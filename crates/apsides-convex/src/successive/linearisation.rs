//! Values and derivatives of everything that is not a bound of an unknown: matching conditions, path constraints, integrals,
//! endpoint constraints, objective.

use std::collections::HashMap;

use apsides_ocp::{Bounds, EndpointTerm, Ocp, Sense, Variable};
use apsides_ode::{OdeSettings, Status, StmPropagator};

use super::flow::IntervalFlow;
use super::layout::Layout;
use crate::ConvexError;

/// The origin of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum RowKind {
    /// The end of an interval is the start of the next: state.
    Motion(usize),
    /// Path constraint row, in the phase's order.
    Path(usize),
    /// Integral.
    Integral(usize),
    /// Endpoint constraint and its row.
    Endpoint(usize, usize),
}

/// `lower <= value + entries . step <= upper`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LinearRow {
    pub(crate) phase: usize,
    pub(crate) kind: RowKind,
    pub(crate) node: usize,
    pub(crate) value: f64,
    pub(crate) bounds: Bounds,
    pub(crate) scale: f64,
    first: usize,
    last: usize,
}

/// All rows and the objective at one point.
#[derive(Clone, Debug, Default)]
pub(crate) struct Linearisation {
    pub(crate) rows: Vec<LinearRow>,
    entries: Vec<(usize, f64)>,
    /// In the minimised sense.
    pub(crate) objective: f64,
    pub(crate) gradient: Vec<f64>,
    /// True if every integration came to its end.
    pub(crate) valid: bool,
}

impl Linearisation {
    pub(crate) fn entries(&self, row: &LinearRow) -> &[(usize, f64)] {
        &self.entries[row.first..row.last]
    }

    /// Takes the derivatives of `here` and the values of `there`, a step away, so that the model is exact at the step: second-order
    /// correction (R. Fletcher, Practical Methods of Optimization, 1987, section 14.4).
    pub(crate) fn correct(&mut self, here: &Self, there: &Self, step: &[f64]) {
        self.clone_from(here);
        for (row, new) in self.rows.iter_mut().zip(&there.rows) {
            let change: f64 = here.entries(new).iter().map(|(c, v)| v * step[*c]).sum();
            row.value = new.value - change;
        }
    }

    /// Sum of all violations in units of their scales, and the largest with its row.
    pub(crate) fn violation(&self) -> (f64, f64, usize) {
        let (mut sum, mut worst, mut at) = (0.0, 0.0, 0);
        for (k, row) in self.rows.iter().enumerate() {
            let v = row.bounds.excess(row.value).max(0.0) / row.scale;
            sum += v;
            if v > worst {
                (worst, at) = (v, k);
            }
        }
        (sum, worst, at)
    }

    fn begin(&self) -> usize {
        self.entries.len()
    }

    fn push(&mut self, phase: usize, kind: RowKind, node: usize, first: usize, value: f64, row: &Variable) {
        let last = self.entries.len();
        let bounds = row.bounds;
        self.rows.push(LinearRow {
            phase,
            kind,
            node,
            value,
            bounds,
            scale: row.scale.unwrap_or(0.0),
            first,
            last,
        });
    }
}

/// Evaluates rows.
pub(crate) struct Lineariser<'a> {
    ocp: &'a Ocp,
    pub(crate) layout: &'a Layout,
    flows: Vec<(IntervalFlow, StmPropagator)>,
    endpoint: Vec<EndpointTerm>,
    sign: f64,
}

impl<'a> Lineariser<'a> {
    pub(crate) fn new(ocp: &'a Ocp, layout: &'a Layout, tolerance: f64) -> Result<Self, ConvexError> {
        let flows = ocp.phases.iter().map(|phase| {
            let flow = IntervalFlow::new(phase, ocp.parameters.len());
            let settings = OdeSettings { max_steps: 20_000, ..OdeSettings::with_tolerance(tolerance) };
            let propagator = StmPropagator::new(flow.outputs(), flow.inputs.len(), settings)?;
            Ok((flow, propagator))
        });
        let flows = flows.collect::<Result<_, ConvexError>>()?;
        let mut rows = Vec::with_capacity(ocp.constraints.len());
        let mut next = 0;
        for constraint in &ocp.constraints {
            rows.push(next);
            next += constraint.rows.len();
        }
        let sign = match ocp.objective.sense {
            Sense::Minimize => 1.0,
            Sense::Maximize => -1.0,
        };
        Ok(Self { ocp, layout, flows, endpoint: EndpointTerm::all(ocp, &rows, |i| layout.column(i)), sign })
    }

    pub(crate) fn sign(&self) -> f64 {
        self.sign
    }

    /// Writes all rows at a point.
    pub(crate) fn evaluate(&mut self, z: &[f64], out: &mut Linearisation) -> Result<(), ConvexError> {
        out.rows.clear();
        out.entries.clear();
        out.gradient.clear();
        out.gradient.resize(z.len(), 0.0);
        (out.objective, out.valid) = (0.0, true);
        for phase in 0..self.ocp.phases.len() {
            self.motion(phase, z, out)?;
            self.path(phase, z, out);
        }
        self.ends(z, out);
        let finite = out.rows.iter().all(|l| l.value.is_finite()) && out.objective.is_finite();
        out.valid &= finite && out.entries.iter().all(|e| e.1.is_finite());
        Ok(())
    }

    fn motion(&mut self, index: usize, z: &[f64], out: &mut Linearisation) -> Result<(), ConvexError> {
        let (phase, p) = (&self.ocp.phases[index], &self.layout.phases[index]);
        let (flow, propagator) = &mut self.flows[index];
        let (nx, nu, outputs) = (p.states, p.controls, flow.outputs());
        let inputs = flow.inputs.len();
        let mut totals = vec![0.0; outputs - nx];
        let mut gradients: Vec<Vec<(usize, f64)>> = vec![Vec::new(); outputs - nx];
        let mut start = vec![0.0; outputs];
        flow.width = 1.0 / p.intervals as f64;
        for k in 0..p.intervals {
            flow.start = k as f64 * flow.width;
            start[..nx].copy_from_slice(&z[p.state(k)..][..nx]);
            flow.inputs[..nu].copy_from_slice(&z[p.control(k)..][..nu]);
            flow.inputs[nu..2 * nu].copy_from_slice(&z[p.control(k + 1)..][..nu]);
            let np = flow.static_parameters();
            flow.inputs[2 * nu..][..np].copy_from_slice(&z[self.layout.first_parameter..][..np]);
            flow.inputs[2 * nu + np..].copy_from_slice(&z[p.times()..][..2]);
            let summary = propagator.propagate(flow, 0.0, &start, 1.0)?;
            out.valid &= summary.status == Status::Completed;
            let (end, stm, sensitivity) = (propagator.state(), propagator.stm(), propagator.sensitivity());
            let column = |c: usize| {
                if c < nu {
                    p.control(k) + c
                } else if c < 2 * nu {
                    p.control(k + 1) + c - nu
                } else if c < 2 * nu + np {
                    self.layout.first_parameter + c - 2 * nu
                } else {
                    p.times() + c - 2 * nu - np
                }
            };
            for r in 0..outputs {
                let states = (0..nx).map(|c| (p.state(k) + c, stm[r * outputs + c]));
                let others = (0..inputs).map(|c| (column(c), sensitivity[r * inputs + c]));
                let entries = states.chain(others);
                if r < nx {
                    let first = out.begin();
                    out.entries.extend(entries);
                    let next = p.state(k + 1) + r;
                    out.entries.push((next, -1.0));
                    let state = &phase.states[r].variable;
                    let row = Variable { bounds: Bounds::fixed(0.0), ..state.clone() };
                    out.push(index, RowKind::Motion(r), k + 1, first, end[r] - z[next], &row);
                } else {
                    totals[r - nx] += end[r];
                    gradients[r - nx].extend(entries);
                }
            }
        }
        for (q, (total, gradient)) in totals.iter().zip(gradients).enumerate() {
            let weights = self.ocp.objective.integrals.iter().filter(|w| (w.0, w.1) == (index, q));
            let weight = self.sign * weights.map(|w| w.2).sum::<f64>();
            out.objective += weight * total;
            for (c, v) in &gradient {
                out.gradient[*c] += weight * v;
            }
            let variable = &phase.integrals[q].variable;
            if variable.bounds != Bounds::FREE {
                let first = out.begin();
                out.entries.extend(gradient);
                out.push(index, RowKind::Integral(q), p.intervals, first, *total, variable);
            }
        }
        Ok(())
    }

    fn path(&self, index: usize, z: &[f64], out: &mut Linearisation) {
        let (phase, p) = (&self.ocp.phases[index], &self.layout.phases[index]);
        let (nx, nu) = (p.states, p.controls);
        let (t0, tf) = (z[p.times()], z[p.times() + 1]);
        for node in 0..=p.intervals {
            let fraction = node as f64 / p.intervals as f64;
            let mut row = 0;
            for constraint in &phase.path {
                let f = constraint.function.as_ref();
                let mut input = z[p.state(node)..][..nx + nu].to_vec();
                let parameters = f.inputs() - 1 - nx - nu;
                input.extend_from_slice(&z[self.layout.first_parameter..][..parameters]);
                input.push((1.0 - fraction) * t0 + fraction * tf);
                let (mut values, mut entries) =
                    (vec![0.0; f.outputs()], vec![0.0; f.pattern().jacobian_len()]);
                f.jacobian(&input, &mut values, &mut entries);
                for (r, variable) in constraint.rows.iter().enumerate() {
                    let first = out.begin();
                    for ((_, c), v) in
                        f.pattern().jacobian_entries().zip(&entries).filter(|((i, _), _)| *i == r)
                    {
                        if c + 1 == f.inputs() {
                            out.entries.push((p.times(), v * (1.0 - fraction)));
                            out.entries.push((p.times() + 1, v * fraction));
                        } else if c < nx + nu {
                            out.entries.push((p.state(node) + c, *v));
                        } else {
                            out.entries.push((self.layout.first_parameter + c - nx - nu, *v));
                        }
                    }
                    out.push(index, RowKind::Path(row + r), node, first, values[r], variable);
                }
                row += constraint.rows.len();
            }
        }
    }

    fn ends(&mut self, z: &[f64], out: &mut Linearisation) {
        for (input, weight) in &self.ocp.objective.linear {
            let column = self.layout.column(*input);
            out.objective += self.sign * weight * z[column];
            out.gradient[column] += self.sign * weight;
        }
        let rows: Vec<(usize, usize)> = (self.ocp.constraints.iter().enumerate())
            .flat_map(|(c, constraint)| (0..constraint.rows.len()).map(move |r| (c, r)))
            .collect();
        for term in &mut self.endpoint {
            term.refresh(z);
            if term.has_cost() {
                out.objective += term.add_values(z, &mut []);
                term.add_gradient(&mut out.gradient);
                continue;
            }
            term.each_value(|row, value| {
                let first = out.begin();
                term.each_jacobian(|r, c, v| {
                    if r == row {
                        out.entries.push((c, v));
                    }
                });
                let (c, r) = rows[row];
                let variable = &self.ocp.constraints[c].rows[r];
                out.push(0, RowKind::Endpoint(c, r), 0, first, value, variable);
            });
        }
    }
}

/// Scales of rows, settled at the first point: that of the row, for matching conditions that of the state, else the largest
/// change that a step of unit size makes.
pub(crate) struct RowScales(HashMap<(usize, RowKind), f64>);

impl RowScales {
    pub(crate) fn new(ocp: &Ocp, rows: &Linearisation, unknowns: &[f64], layout: &Layout) -> Self {
        let mut scales = HashMap::new();
        for row in &rows.rows {
            let key = (row.phase, row.kind);
            let stated = match row.kind {
                RowKind::Motion(r) => Some(unknowns[layout.phases[row.phase].state(0) + r]),
                RowKind::Path(r) => {
                    let mut limits = ocp.phases[row.phase].path.iter().flat_map(|p| &p.rows);
                    limits.nth(r).and_then(Variable::size)
                }
                RowKind::Integral(q) => ocp.phases[row.phase].integrals[q].variable.size(),
                RowKind::Endpoint(c, r) => ocp.constraints[c].rows[r].size(),
            };
            let reach = rows.entries(row).iter().map(|(c, v)| (v * unknowns[*c]).abs()).fold(0.0, f64::max);
            let scale = scales.entry(key).or_insert(0.0_f64);
            *scale = stated.unwrap_or(scale.max(reach));
        }
        Self(scales)
    }

    pub(crate) fn apply(&self, rows: &mut Linearisation) {
        for row in &mut rows.rows {
            let scale = self.0.get(&(row.phase, row.kind)).copied().unwrap_or(1.0);
            row.scale = if scale > 0.0 && scale.is_finite() { scale } else { 1.0 };
        }
    }
}
