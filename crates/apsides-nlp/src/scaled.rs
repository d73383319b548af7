//! The user's problem in the form of the engine: fixed variables and free constraints removed, slacks added,
//! everything scaled. This is the only place that knows the user's units.

use std::time::{Duration, Instant};

use apsides_iteration::{Counters, ScalingFactors};

use crate::error::NlpError;
use crate::model::{BarrierModel, ResidualUnits, Structure, UnitVariable};
use crate::problem::{Nlp, Pattern, Stages};
use crate::scaling::{choose_units, gradient_factors};
use crate::selection::Selection;
use crate::settings::{NlpSettings, ScalingMethod};
use crate::vector::in_vectors;

/// Part of the tolerance for constraints that the relaxation of their bounds may take.
const RELAXED_PART: f64 = 0.1;

/// Scaled problem over the free variables and the slacks.
pub(crate) struct ScaledProblem<'a> {
    nlp: &'a mut dyn Nlp,
    structure: Structure,
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// Index of each free variable in the user's vector.
    free: Vec<usize>,
    /// Index of each kept constraint in the user's vector.
    kept: Vec<usize>,
    /// Both in runs.
    free_runs: Selection,
    kept_runs: Selection,
    /// Equality value of each kept constraint, scaled; zero for inequalities.
    target: Vec<f64>,
    /// Structural Jacobian and Hessian values in the user's arrays.
    jacobian_source: Source,
    hessian_source: Source,
    units: ResidualUnits,
    factors: ScalingFactors,
    variable_bounds: (Vec<f64>, Vec<f64>),
    constraint_bounds: (Vec<f64>, Vec<f64>),
    /// Pattern of the user's Jacobian.
    jacobian_pattern: Pattern,
    /// The point at which the problem was last evaluated, scaled and in the user's units.
    point: Vec<f64>,
    x: Vec<f64>,
    /// Work vectors in the user's units.
    gradient: Vec<f64>,
    constraints: Vec<f64>,
    multipliers: Vec<f64>,
    jacobian: Vec<f64>,
    hessian: Vec<f64>,
    pub(crate) counters: Counters,
    pub(crate) time: Duration,
}

fn check_bounds(
    kind: &'static str,
    lower: &mut [f64],
    upper: &mut [f64],
    infinite: f64,
) -> Result<(), NlpError> {
    for (index, (low, high)) in lower.iter_mut().zip(upper).enumerate() {
        let ordered = *low <= *high && *low < f64::INFINITY && *high > f64::NEG_INFINITY;
        if !ordered {
            return Err(NlpError::Bounds { kind, index, lower: *low, upper: *high });
        }
        if *low <= -infinite {
            *low = f64::NEG_INFINITY;
        }
        if *high >= infinite {
            *high = f64::INFINITY;
        }
    }
    Ok(())
}

/// Entries of an array of the user's, with their scaling factors.
struct Source {
    entries: Selection,
    factors: Vec<f64>,
}

/// The pattern of the part of the matrix that is kept, and where its values come from.
fn restrict(
    pattern: &Pattern,
    row_index: &[usize],
    col_index: &[usize],
    factor: impl Fn(usize, usize) -> f64,
) -> (Pattern, Source) {
    let is_kept =
        |(row, col): (&usize, &usize)| row_index[*row] != usize::MAX && col_index[*col] != usize::MAX;
    let entries = Selection::of_those(pattern.rows.iter().zip(&pattern.cols).map(is_kept));
    let room = pattern.len();
    let mut kept = Pattern { rows: Vec::with_capacity(room), cols: Vec::with_capacity(room) };
    let mut factors = Vec::with_capacity(room);
    for (_, run) in entries.runs() {
        let (rows, cols) = (&pattern.rows[run.clone()], &pattern.cols[run]);
        kept.rows.extend(rows.iter().map(|row| row_index[*row]));
        kept.cols.extend(cols.iter().map(|col| col_index[*col]));
        factors.extend(rows.iter().zip(cols).map(|(row, col)| factor(*row, *col)));
    }
    (kept, Source { entries, factors })
}

/// Position of each of `total` indices in the sorted list `kept`; `usize::MAX` where it is not in the list.
fn inverse_index(kept: &[usize], total: usize) -> Vec<usize> {
    let mut inverse = vec![usize::MAX; total];
    for (position, &index) in kept.iter().enumerate() {
        inverse[index] = position;
    }
    inverse
}

/// The problem as the user states it, checked.
struct Stated {
    /// Lower and upper bounds.
    variables: (Vec<f64>, Vec<f64>),
    constraints: (Vec<f64>, Vec<f64>),
    jacobian: Pattern,
    /// Lower triangle.
    hessian: Pattern,
}

impl Stated {
    fn read(nlp: &dyn Nlp, settings: &NlpSettings) -> Result<Self, NlpError> {
        let (n, m) = (nlp.variables(), nlp.constraints());
        let (mut xl, mut xu) = (vec![f64::NAN; n], vec![f64::NAN; n]);
        nlp.variable_bounds(&mut xl, &mut xu);
        check_bounds("variable", &mut xl, &mut xu, settings.infinite_bound)?;
        let (mut cl, mut cu) = (vec![f64::NAN; m], vec![f64::NAN; m]);
        nlp.constraint_bounds(&mut cl, &mut cu);
        check_bounds("constraint", &mut cl, &mut cu, settings.infinite_bound)?;
        let jacobian = nlp.jacobian_pattern();
        jacobian.check("Jacobian", m, n)?;
        let hessian = nlp.hessian_pattern();
        hessian.check("Hessian", n, n)?;
        if let Some(entry) = hessian.first_beyond(|row, col| row < col) {
            return Err(NlpError::UpperTriangle {
                entry,
                row: hessian.rows[entry],
                col: hessian.cols[entry],
            });
        }
        Ok(Self { variables: (xl, xu), constraints: (cl, cu), jacobian, hessian })
    }

    /// The starting point, `given` or the problem's own, with fixed variables at their values.
    fn start(&self, nlp: &dyn Nlp, given: Option<&[f64]>) -> Result<Vec<f64>, NlpError> {
        let (lower, upper) = &self.variables;
        let mut x = vec![f64::NAN; lower.len()];
        match given {
            Some(given) if given.len() != x.len() => {
                return Err(NlpError::Length { what: "warm start x", found: given.len(), expected: x.len() });
            }
            Some(given) => x.copy_from_slice(given),
            None => nlp.initial_point(&mut x),
        }
        for (index, value) in x.iter_mut().enumerate() {
            if !value.is_finite() {
                return Err(NlpError::Start { what: "initial point", index, value: *value });
            }
            if lower[index] == upper[index] {
                *value = lower[index];
            }
        }
        Ok(x)
    }

    /// Indices of the variables that are not fixed.
    fn free(&self) -> Vec<usize> {
        let (lower, upper) = &self.variables;
        (0..lower.len()).filter(|&i| lower[i] != upper[i]).collect()
    }

    /// Indices of the constraints that have a bound.
    fn kept(&self) -> Vec<usize> {
        let (lower, upper) = &self.constraints;
        (0..lower.len()).filter(|&i| lower[i].is_finite() || upper[i].is_finite()).collect()
    }
}

/// The kept constraints as equalities, with slacks for the inequalities, and the bounds of variables and slacks.
struct Rows {
    units: Vec<UnitVariable>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    target: Vec<f64>,
    /// Residuals relative to the problem's own sizes: what is left are the reductions by the gradients.
    residuals: ResidualUnits,
}

impl Rows {
    fn new(
        stated: &Stated,
        free: &[usize],
        kept: &[usize],
        factors: &ScalingFactors,
        sizes: &ScalingFactors,
        settings: &NlpSettings,
    ) -> Self {
        let ((xl, xu), (cl, cu)) = (&stated.variables, &stated.constraints);
        let mut lower: Vec<f64> = free.iter().map(|&i| xl[i] * factors.variables[i]).collect();
        let mut upper: Vec<f64> = free.iter().map(|&i| xu[i] * factors.variables[i]).collect();
        let reduction = factors.objective / sizes.objective;
        let mut dual: Vec<f64> =
            free.iter().map(|&i| factors.variables[i] / sizes.variables[i] / reduction).collect();
        let mut primal = Vec::with_capacity(kept.len());
        let mut target = vec![0.0; kept.len()];
        let mut units = Vec::new();
        for (row, &i) in kept.iter().enumerate() {
            let factor = factors.constraints[i];
            primal.push(sizes.constraints[i] / factor);
            if cl[i] == cu[i] {
                target[row] = cl[i] * factor;
            } else {
                units.push(UnitVariable { row, sign: -1.0 });
                // No wider than the tolerance of the unscaled problem.
                let most = RELAXED_PART * settings.constraint_tolerance * factor / sizes.constraints[i];
                let relax = |bound: f64| (settings.bound_relaxation * bound.abs().max(1.0)).min(most);
                let (low, high) = (cl[i] * factor, cu[i] * factor);
                lower.push(low - relax(low));
                upper.push(high + relax(high));
                dual.push(factor / sizes.constraints[i] / reduction);
            }
        }
        let (complementarity, objective) = (1.0 / reduction, 1.0 / factors.objective);
        let residuals = ResidualUnits { dual, primal, complementarity, objective };
        Self { units, lower, upper, target, residuals }
    }
}

impl<'a> ScaledProblem<'a> {
    /// Reads and checks the structure, chooses the scaling at the starting point `start` (the problem's own if none)
    /// unless its `factors` are given.
    pub(crate) fn new(
        nlp: &'a mut dyn Nlp,
        settings: &NlpSettings,
        start: Option<&[f64]>,
        factors: Option<&ScalingFactors>,
    ) -> Result<Self, NlpError> {
        let stated = Stated::read(nlp, settings)?;
        let x = stated.start(nlp, start)?;
        let (n, m) = (nlp.variables(), nlp.constraints());
        let (free, kept) = (stated.free(), stated.kept());
        let (mut counters, mut time) = (Counters::default(), Duration::ZERO);
        let user_scaling = match settings.scaling {
            ScalingMethod::User | ScalingMethod::UserThenGradient { .. } => nlp.scaling(),
            _ => None,
        };
        let sizes = choose_units(user_scaling, n, m)?;
        let factors = match (factors, settings.scaling) {
            (Some(factors), _) => factors.clone(),
            (None, ScalingMethod::Gradient { max } | ScalingMethod::UserThenGradient { max }) => {
                let mut factors = sizes.clone();
                let clock = Instant::now();
                gradient_factors(nlp, &x, &free, &stated.jacobian, max, &mut factors);
                counters.gradient += 1;
                counters.jacobian += 1;
                time += clock.elapsed();
                factors
            }
            (None, _) => sizes.clone(),
        };

        let (free_index, kept_index) = (inverse_index(&free, n), inverse_index(&kept, m));
        // The units of the variables divide: d/d(scaled x) = (1 / factor) d/dx.
        let step: Vec<f64> = factors.variables.iter().map(|factor| 1.0 / factor).collect();
        let (jacobian, jacobian_source) = restrict(&stated.jacobian, &kept_index, &free_index, |row, col| {
            factors.constraints[row] * step[col]
        });
        let (hessian, hessian_source) =
            restrict(&stated.hessian, &free_index, &free_index, |row, col| step[row] * step[col]);
        let Rows { units: slack_of_row, lower, upper, target, residuals } =
            Rows::new(&stated, &free, &kept, &factors, &sizes, settings);
        Ok(Self {
            structure: Structure {
                variables: free.len(),
                slacks: slack_of_row.len(),
                units: slack_of_row,
                constraints: kept.len(),
                jacobian,
                hessian,
            },
            lower,
            upper,
            target,
            jacobian_source,
            hessian_source,
            units: residuals,
            // No point is equal to this one.
            point: vec![f64::NAN; free.len()],
            x,
            free_runs: Selection::of(&free),
            kept_runs: Selection::of(&kept),
            gradient: vec![0.0; n],
            constraints: vec![0.0; m],
            multipliers: vec![0.0; m],
            jacobian: vec![0.0; stated.jacobian.len()],
            hessian: vec![0.0; stated.hessian.len()],
            nlp,
            free,
            kept,
            factors,
            variable_bounds: stated.variables,
            constraint_bounds: stated.constraints,
            jacobian_pattern: stated.jacobian,
            counters,
            time,
        })
    }

    pub(crate) fn scaling_factors(&self) -> &ScalingFactors {
        &self.factors
    }

    /// The user's indices of the free variables.
    pub(crate) fn free(&self) -> &[usize] {
        &self.free
    }

    /// The user's indices of the kept constraints.
    pub(crate) fn kept(&self) -> &[usize] {
        &self.kept
    }

    /// The user's bounds on the variables.
    pub(crate) fn variable_bounds(&self) -> (&[f64], &[f64]) {
        (&self.variable_bounds.0, &self.variable_bounds.1)
    }

    /// The user's bounds on the constraints.
    pub(crate) fn constraint_bounds(&self) -> (&[f64], &[f64]) {
        (&self.constraint_bounds.0, &self.constraint_bounds.1)
    }

    /// The bounds of variables and slacks as the user states them, scaled: not widened.
    pub(crate) fn exact_bounds(&self) -> (Vec<f64>, Vec<f64>) {
        let side = |relaxed: &[f64], exact: &[f64]| {
            let mut bounds = relaxed.to_vec();
            let slacks = &mut bounds[self.structure.variables..];
            for (bound, unit) in slacks.iter_mut().zip(&self.structure.units) {
                let row = self.kept[unit.row];
                *bound = exact[row] * self.factors.constraints[row];
            }
            bounds
        };
        let (lower, upper) = &self.constraint_bounds;
        (side(&self.lower, lower), side(&self.upper, upper))
    }

    /// The starting point, scaled, free variables only.
    pub(crate) fn scaled_start(&self, v: &mut [f64]) {
        for (value, &i) in v.iter_mut().zip(&self.free) {
            *value = self.x[i] * self.factors.variables[i];
        }
    }

    /// `c(x)` of the kept constraints, scaled, without subtracting slack or target.
    pub(crate) fn scaled_constraints(&mut self, v: &[f64], values: &mut [f64]) {
        self.set_point(v);
        let clock = Instant::now();
        self.nlp.constraint_values(&self.x, &mut self.constraints);
        self.time += clock.elapsed();
        self.counters.constraints += 1;
        for (kept, i) in self.kept_runs.runs() {
            let (own, factors) = (&self.constraints[i.clone()], &self.factors.constraints[i]);
            for ((value, own), factor) in values[kept].iter_mut().zip(own).zip(factors) {
                *value = own * factor;
            }
        }
    }

    /// Stages of the rows of the linear system, if the problem has them.
    pub(crate) fn stages(&self) -> Result<Option<Vec<u32>>, NlpError> {
        let Some(Stages { variables, constraints }) = self.nlp.stages() else { return Ok(None) };
        let (n, m) = (self.gradient.len(), self.constraints.len());
        if variables.len() != n {
            return Err(NlpError::Length {
                what: "stages of the variables",
                found: variables.len(),
                expected: n,
            });
        }
        if constraints.len() != m {
            let found = constraints.len();
            return Err(NlpError::Length { what: "stages of the constraints", found, expected: m });
        }
        let free = self.free.iter().map(|&i| variables[i]);
        Ok(Some(free.chain(self.kept.iter().map(|&i| constraints[i])).collect()))
    }

    /// The size of an objective: at least one, scaled or in the user's units, whichever is less. Large terms that cancel make the
    /// scaled one small.
    pub(crate) fn size_of_objective(&self, scaled: f64) -> f64 {
        scaled.abs().max(self.factors.objective.min(1.0))
    }

    /// The user's point of a scaled one.
    pub(crate) fn user_point(&mut self, v: &[f64]) -> Vec<f64> {
        self.set_point(v);
        self.x.clone()
    }

    /// The same, put back between the user's bounds.
    pub(crate) fn user_point_inside(&mut self, v: &[f64]) -> Vec<f64> {
        let mut x = self.user_point(v);
        let (lower, upper) = &self.variable_bounds;
        for (i, value) in x.iter_mut().enumerate() {
            *value = value.max(lower[i]).min(upper[i]);
        }
        x
    }

    /// Puts the variables of a scaled point back between the user's bounds; returns true if any has moved.
    pub(crate) fn move_inside(&self, v: &mut [f64]) -> bool {
        let (lower, upper) = &self.variable_bounds;
        let mut moved = false;
        for (value, &i) in v.iter_mut().zip(&self.free) {
            let factor = self.factors.variables[i];
            let inside = value.max(lower[i] * factor).min(upper[i] * factor);
            moved |= inside != *value;
            *value = inside;
        }
        moved
    }

    /// Objective and constraints at a point in the user's units.
    pub(crate) fn user_values(&mut self, x: &[f64]) -> (f64, Vec<f64>) {
        let clock = Instant::now();
        let objective = self.nlp.objective(x);
        self.nlp.constraint_values(x, &mut self.constraints);
        self.time += clock.elapsed();
        self.counters.objective += 1;
        self.counters.constraints += 1;
        (objective, self.constraints.clone())
    }

    /// `grad f + J^T y` at a point in the user's units: the multipliers of the fixed variables.
    pub(crate) fn user_dual_residual(&mut self, x: &[f64], y: &[f64]) -> Vec<f64> {
        let clock = Instant::now();
        self.nlp.gradient(x, &mut self.gradient);
        self.nlp.jacobian(x, &mut self.jacobian);
        let mut residual = self.gradient.clone();
        let pattern = &self.jacobian_pattern;
        for ((&row, &col), value) in pattern.rows.iter().zip(&pattern.cols).zip(&self.jacobian) {
            residual[col] += value * y[row];
        }
        self.time += clock.elapsed();
        self.counters.gradient += 1;
        self.counters.jacobian += 1;
        residual
    }

    /// The Hessian without the objective, for the restoration phase.
    pub(crate) fn constraint_hessian(&mut self, v: &[f64], y: &[f64], values: &mut [f64]) {
        self.lagrangian_hessian(v, 0.0, y, values);
    }

    fn lagrangian_hessian(&mut self, v: &[f64], objective_factor: f64, y: &[f64], values: &mut [f64]) {
        self.set_point(v);
        for (kept, i) in self.kept_runs.runs() {
            let (own, factors) = (&mut self.multipliers[i.clone()], &self.factors.constraints[i]);
            for ((own, y), factor) in own.iter_mut().zip(&y[kept]).zip(factors) {
                *own = y * factor;
            }
        }
        let clock = Instant::now();
        self.nlp.hessian(&self.x, objective_factor, &self.multipliers, &mut self.hessian);
        self.time += clock.elapsed();
        self.counters.hessian += 1;
        let Source { entries, factors } = &self.hessian_source;
        entries.scale(&self.hessian, factors, values);
    }

    fn set_point(&mut self, v: &[f64]) {
        let v = &v[..self.free.len()];
        if self.point == v {
            return;
        }
        self.point.copy_from_slice(v);
        in_vectors(|| {
            for (kept, i) in self.free_runs.runs() {
                let (x, factors) = (&mut self.x[i.clone()], &self.factors.variables[i]);
                for ((x, value), factor) in x.iter_mut().zip(&v[kept]).zip(factors) {
                    *x = value / factor;
                }
            }
        });
    }
}

impl BarrierModel for ScaledProblem<'_> {
    fn structure(&self) -> &Structure {
        &self.structure
    }

    fn lower(&self) -> &[f64] {
        &self.lower
    }

    fn upper(&self) -> &[f64] {
        &self.upper
    }

    fn objective(&mut self, v: &[f64]) -> f64 {
        self.set_point(v);
        let clock = Instant::now();
        let value = self.nlp.objective(&self.x);
        self.time += clock.elapsed();
        self.counters.objective += 1;
        value * self.factors.objective
    }

    fn gradient(&mut self, v: &[f64], gradient: &mut [f64]) {
        self.set_point(v);
        let clock = Instant::now();
        self.nlp.gradient(&self.x, &mut self.gradient);
        self.time += clock.elapsed();
        self.counters.gradient += 1;
        let (x, slacks) = gradient.split_at_mut(self.free.len());
        let objective = self.factors.objective;
        in_vectors(|| {
            for (kept, i) in self.free_runs.runs() {
                let (own, factors) = (&self.gradient[i.clone()], &self.factors.variables[i]);
                for ((value, own), factor) in x[kept].iter_mut().zip(own).zip(factors) {
                    *value = own * objective / factor;
                }
            }
        });
        slacks.fill(0.0);
    }

    fn constraints(&mut self, v: &[f64], values: &mut [f64]) {
        self.scaled_constraints(v, values);
        for (value, target) in values.iter_mut().zip(&self.target) {
            *value -= target;
        }
        for (unit, slack) in self.structure.units.iter().zip(&v[self.free.len()..]) {
            values[unit.row] -= slack;
        }
    }

    fn jacobian(&mut self, v: &[f64], values: &mut [f64]) {
        self.set_point(v);
        let clock = Instant::now();
        self.nlp.jacobian(&self.x, &mut self.jacobian);
        self.time += clock.elapsed();
        self.counters.jacobian += 1;
        let Source { entries, factors } = &self.jacobian_source;
        entries.scale(&self.jacobian, factors, values);
    }

    fn hessian(&mut self, v: &[f64], y: &[f64], values: &mut [f64], diagonal: &mut [f64]) {
        self.lagrangian_hessian(v, self.factors.objective, y, values);
        diagonal.fill(0.0);
    }

    fn residual_units(&self) -> Option<&ResidualUnits> {
        Some(&self.units)
    }
}
