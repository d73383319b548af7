//! A problem with elastic limits, as a problem of its own.
//!
//! Variables `[x, e]`; constraints: those of the problem, hard, then one row per elastic limit. An elastic bound on a
//! variable becomes a row, so that bound and row never stand side by side.

use std::collections::HashMap;

use apsides_iteration::SolveReport;

use crate::error::NlpError;
use crate::problem::{Nlp, Pattern, Scaling, Stages};
use crate::requirement::{Limit, Place, Relaxation, Requirement, Side};

/// Weight of the mean squared distance from the start, in units of the variables: it decides what the relaxation
/// leaves open, and is too small to change the amounts.
const PROXIMITY: f64 = 1e-6;
/// A later one of equal requirements costs more by this, so that one of them is named and not a mixture.
const TIE_BREAK: f64 = 1e-2;

/// One elastic limit.
struct Row {
    limit: Limit,
    /// Index of its amount among the elastic requirements.
    amount: usize,
}

/// Lower and upper bounds of variables and constraints.
struct BoundsOfAll {
    variables: (Vec<f64>, Vec<f64>),
    constraints: (Vec<f64>, Vec<f64>),
}

impl BoundsOfAll {
    fn side(&mut self, limit: &Limit) -> &mut f64 {
        let (pair, i) = match limit.place {
            Place::Variable(i) => (&mut self.variables, i),
            Place::Constraint(i) => (&mut self.constraints, i),
        };
        match limit.side {
            Side::Lower => &mut pair.0[i],
            Side::Upper => &mut pair.1[i],
        }
    }
}

/// The elastic problem.
pub(crate) struct Elastic<'a> {
    nlp: &'a mut dyn Nlp,
    /// Variables and constraints of the problem itself.
    base: (usize, usize),
    elastic: Vec<usize>,
    /// Weight of each amount, per unit of the user.
    weights: Vec<f64>,
    units: Vec<f64>,
    rows: Vec<Row>,
    bounds: BoundsOfAll,
    start: Vec<f64>,
    scaling: Scaling,
    jacobian_pattern: Pattern,
    hessian_pattern: Pattern,
    base_jacobian: usize,
    base_hessian: usize,
    /// Entries of the problem's Jacobian that each row repeats.
    repeated: Vec<Vec<usize>>,
    multipliers: Vec<f64>,
}

impl<'a> Elastic<'a> {
    pub(crate) fn new(
        nlp: &'a mut dyn Nlp,
        requirements: &[Requirement],
        elastic: &[usize],
        start: &[f64],
    ) -> Result<Self, NlpError> {
        let (n, m) = (nlp.variables(), nlp.constraints());
        check(requirements, elastic, start, (n, m))?;
        let mut bounds = hard_bounds(nlp, requirements, elastic);
        let mut scaling = nlp.scaling().unwrap_or_else(|| Scaling {
            objective: 1.0,
            variables: vec![1.0; n],
            constraints: vec![1.0; m],
        });
        scaling.objective = 1.0;
        let mut values = vec![0.0; m];
        nlp.constraint_values(start, &mut values);
        let Pattern { rows: pattern_rows, cols: pattern_cols } = nlp.jacobian_pattern();
        let mut entries_of_row = vec![Vec::new(); m];
        for (entry, &r) in pattern_rows.iter().enumerate() {
            entries_of_row[r].push(entry);
        }
        let base_jacobian = pattern_rows.len();
        let mut jacobian: Vec<(usize, usize)> =
            pattern_rows.into_iter().zip(pattern_cols.iter().copied()).collect();
        let (mut rows, mut repeated, mut begin) = (Vec::new(), Vec::new(), start.to_vec());
        for (amount, &g) in elastic.iter().enumerate() {
            let mut largest = 0.0_f64;
            for &limit in &requirements[g].limits {
                let row = m + rows.len();
                let (value, entries, unit) = match limit.place {
                    Place::Variable(i) => {
                        jacobian.push((row, i));
                        (start[i], Vec::new(), scaling.variables[i])
                    }
                    Place::Constraint(i) => {
                        jacobian.extend(entries_of_row[i].iter().map(|&k| (row, pattern_cols[k])));
                        (values[i], entries_of_row[i].clone(), scaling.constraints[i])
                    }
                };
                jacobian.push((row, n + amount));
                largest = largest.max(limit.excess(value));
                scaling.constraints.push(unit);
                let infinite = (f64::NEG_INFINITY, f64::INFINITY);
                let (low, high) = match limit.side {
                    Side::Lower => (limit.value, infinite.1),
                    Side::Upper => (infinite.0, limit.value),
                };
                bounds.constraints.0.push(low);
                bounds.constraints.1.push(high);
                repeated.push(entries);
                rows.push(Row { limit, amount });
            }
            begin.push(largest);
            bounds.variables.0.push(0.0);
            bounds.variables.1.push(requirements[g].most);
            scaling.variables.push(requirements[g].unit);
        }
        let Pattern { rows: hessian_rows, cols: hessian_cols } = nlp.hessian_pattern();
        let base_hessian = hessian_rows.len();
        let hessian = hessian_rows.into_iter().zip(hessian_cols).chain((0..n).map(|i| (i, i)));
        let count = elastic.len().max(1) as f64;
        let weight = |(k, &g): (usize, &usize)| {
            requirements[g].weight * (1.0 + TIE_BREAK * k as f64 / count) / requirements[g].unit
        };
        Ok(Self {
            base: (n, m),
            weights: elastic.iter().enumerate().map(weight).collect(),
            units: scaling.variables.clone(),
            elastic: elastic.to_vec(),
            jacobian_pattern: Pattern::from_pairs(jacobian),
            hessian_pattern: Pattern::from_pairs(hessian),
            multipliers: vec![0.0; m],
            start: begin,
            nlp,
            rows,
            bounds,
            scaling,
            base_jacobian,
            base_hessian,
            repeated,
        })
    }

    /// The relaxation in terms of the problem and its requirements.
    pub(crate) fn relaxation(&self, mut report: SolveReport, requirements: usize) -> Relaxation {
        let (n, m) = self.base;
        let (mut amounts, mut shares) = (vec![0.0; requirements], vec![0.0; requirements]);
        for (k, &g) in self.elastic.iter().enumerate() {
            amounts[g] = report.x[n + k].max(0.0);
        }
        for (row, y) in self.rows.iter().zip(self.net_multipliers(&report.constraint_multipliers[m..])) {
            shares[self.elastic[row.amount]] += y / self.weights[row.amount];
        }
        for (row, y) in self.rows.iter().zip(report.constraint_multipliers[m..].to_vec()) {
            if let Place::Constraint(i) = row.limit.place {
                report.constraint_multipliers[i] += y;
            }
        }
        for list in [&mut report.x, &mut report.lower_multipliers, &mut report.upper_multipliers] {
            list.truncate(n);
        }
        report.constraint_values.truncate(m);
        report.constraint_multipliers.truncate(m);
        report.scaling.variables.truncate(n);
        report.scaling.constraints.truncate(m);
        report.worst_constraint = report.worst_constraint.filter(|v| v.constraint < m);
        Relaxation::new(amounts, shares, report)
    }

    /// Size of the multiplier of each row, without what limits on both sides of one quantity have in common: between them
    /// the interior point method leaves a sum open that means nothing.
    fn net_multipliers(&self, multipliers: &[f64]) -> Vec<f64> {
        let mut sums: HashMap<Place, [f64; 2]> = HashMap::new();
        for (row, y) in self.rows.iter().zip(multipliers) {
            sums.entry(row.limit.place).or_default()[row.limit.side as usize] += y.abs();
        }
        let net = |(row, y): (&Row, &f64)| {
            let sum = sums[&row.limit.place];
            let side = row.limit.side as usize;
            let rest = (sum[side] - sum[1 - side]).max(0.0);
            if rest > 0.0 { y.abs() * rest / sum[side] } else { 0.0 }
        };
        self.rows.iter().zip(multipliers).map(net).collect()
    }

    /// Distance of variable `i` from the start, in its unit.
    fn distance(&self, x: &[f64], i: usize) -> f64 {
        (x[i] - self.start[i]) / self.units[i]
    }

    fn proximity(&self) -> f64 {
        PROXIMITY / self.base.0.max(1) as f64
    }
}

fn check(
    requirements: &[Requirement],
    elastic: &[usize],
    start: &[f64],
    (n, m): (usize, usize),
) -> Result<(), NlpError> {
    if start.len() != n {
        return Err(NlpError::Length { what: "start", found: start.len(), expected: n });
    }
    if let Some(index) = start.iter().position(|v| !v.is_finite()) {
        return Err(NlpError::Start { what: "start", index, value: start[index] });
    }
    if let Some(&g) = elastic.iter().find(|&&g| g >= requirements.len()) {
        return Err(NlpError::Length {
            what: "list of requirements",
            found: requirements.len(),
            expected: g + 1,
        });
    }
    for (index, r) in requirements.iter().enumerate() {
        for value in [r.unit, r.weight] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(NlpError::Scale { kind: "requirement", index, value });
            }
        }
        if r.most.is_nan() || r.most < 0.0 {
            return Err(NlpError::Bounds { kind: "relaxation", index, lower: 0.0, upper: r.most });
        }
        for limit in &r.limits {
            let (what, i, size) = match limit.place {
                Place::Variable(i) => ("variables", i, n),
                Place::Constraint(i) => ("constraints", i, m),
            };
            if i >= size {
                return Err(NlpError::Length { what, found: size, expected: i + 1 });
            }
            if !limit.value.is_finite() {
                return Err(NlpError::Start { what: "limit of requirement", index, value: limit.value });
            }
        }
    }
    Ok(())
}

/// The bounds without those that a requirement states, then with those of the hard requirements.
fn hard_bounds(nlp: &dyn Nlp, requirements: &[Requirement], elastic: &[usize]) -> BoundsOfAll {
    let (n, m) = (nlp.variables(), nlp.constraints());
    let mut bounds =
        BoundsOfAll { variables: (vec![0.0; n], vec![0.0; n]), constraints: (vec![0.0; m], vec![0.0; m]) };
    nlp.variable_bounds(&mut bounds.variables.0, &mut bounds.variables.1);
    nlp.constraint_bounds(&mut bounds.constraints.0, &mut bounds.constraints.1);
    for limit in requirements.iter().flat_map(|r| &r.limits) {
        *bounds.side(limit) = match limit.side {
            Side::Lower => f64::NEG_INFINITY,
            Side::Upper => f64::INFINITY,
        };
    }
    for (_, r) in requirements.iter().enumerate().filter(|(g, _)| !elastic.contains(g)) {
        for limit in &r.limits {
            let bound = bounds.side(limit);
            *bound = match limit.side {
                Side::Lower => bound.max(limit.value),
                Side::Upper => bound.min(limit.value),
            };
        }
    }
    bounds
}

impl Nlp for Elastic<'_> {
    fn variables(&self) -> usize {
        self.base.0 + self.elastic.len()
    }

    fn constraints(&self) -> usize {
        self.base.1 + self.rows.len()
    }

    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.bounds.variables.0);
        upper.copy_from_slice(&self.bounds.variables.1);
    }

    fn constraint_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.bounds.constraints.0);
        upper.copy_from_slice(&self.bounds.constraints.1);
    }

    fn initial_point(&self, x: &mut [f64]) {
        x.copy_from_slice(&self.start);
    }

    fn jacobian_pattern(&self) -> Pattern {
        self.jacobian_pattern.clone()
    }

    fn hessian_pattern(&self) -> Pattern {
        self.hessian_pattern.clone()
    }

    fn objective(&mut self, x: &[f64]) -> f64 {
        let n = self.base.0;
        let relaxed: f64 = self.weights.iter().zip(&x[n..]).map(|(w, e)| w * e).sum();
        let moved: f64 = (0..n).map(|i| self.distance(x, i).powi(2)).sum();
        relaxed + 0.5 * self.proximity() * moved
    }

    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        let n = self.base.0;
        for i in 0..n {
            gradient[i] = self.proximity() * self.distance(x, i) / self.units[i];
        }
        gradient[n..].copy_from_slice(&self.weights);
    }

    fn constraint_values(&mut self, x: &[f64], values: &mut [f64]) {
        let (n, m) = self.base;
        let (base, elastic) = values.split_at_mut(m);
        self.nlp.constraint_values(&x[..n], base);
        for (row, value) in self.rows.iter().zip(elastic) {
            let e = x[n + row.amount];
            *value = match row.limit.place {
                Place::Variable(i) => x[i],
                Place::Constraint(i) => base[i],
            } + match row.limit.side {
                Side::Lower => e,
                Side::Upper => -e,
            };
        }
    }

    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        let (base, elastic) = values.split_at_mut(self.base_jacobian);
        self.nlp.jacobian(&x[..self.base.0], base);
        let mut next = 0;
        for (row, repeated) in self.rows.iter().zip(&self.repeated) {
            match row.limit.place {
                Place::Variable(_) => {
                    elastic[next] = 1.0;
                    next += 1;
                }
                Place::Constraint(_) => {
                    for (value, &k) in elastic[next..].iter_mut().zip(repeated) {
                        *value = base[k];
                    }
                    next += repeated.len();
                }
            }
            elastic[next] = if row.limit.side == Side::Lower { 1.0 } else { -1.0 };
            next += 1;
        }
    }

    fn hessian(&mut self, x: &[f64], objective_factor: f64, multipliers: &[f64], values: &mut [f64]) {
        let (n, m) = self.base;
        self.multipliers.copy_from_slice(&multipliers[..m]);
        for (row, y) in self.rows.iter().zip(&multipliers[m..]) {
            if let Place::Constraint(i) = row.limit.place {
                self.multipliers[i] += y;
            }
        }
        let (base, diagonal) = values.split_at_mut(self.base_hessian);
        self.nlp.hessian(&x[..n], 0.0, &self.multipliers, base);
        let factor = objective_factor * self.proximity();
        for (value, unit) in diagonal.iter_mut().zip(&self.units) {
            *value = factor / (unit * unit);
        }
    }

    fn scaling(&self) -> Option<Scaling> {
        Some(self.scaling.clone())
    }

    fn stages(&self) -> Option<Stages> {
        let mut stages = self.nlp.stages()?;
        let last = stages.variables.iter().chain(&stages.constraints).copied().max().unwrap_or(0);
        for row in &self.rows {
            let stage = match row.limit.place {
                Place::Variable(i) => stages.variables[i],
                Place::Constraint(i) => stages.constraints[i],
            };
            stages.constraints.push(stage);
        }
        stages.variables.extend(self.elastic.iter().map(|_| last));
        Some(stages)
    }
}
