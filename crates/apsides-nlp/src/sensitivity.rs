//! Post-optimal sensitivity: how a solution moves with a parameter `p` of its problem (Pirnay, Lopez-Negrete and
//! Biegler 2012, eqs. 4 to 9).
//!
//! With `w` the free variables, `l` and `u` their bounds and `Sl = zl / (x - l)`, `Su = zu / (u - x)` at the solution,
//! the derivative of the optimality conditions is one more solve with the matrix of the search direction:
//!
//! ```text
//! [ H + Sl + Su   J^T ] [dx/dp]     [d(grad_w L)/dp - Sl dl/dp - Su du/dp]
//! [ J              0  ] [dy/dp] = - [dc/dp - (bound of an active row)'   ]
//! ```
//!
//! The derivative of the objective needs the multipliers only (envelope theorem):
//! `df/dp + y^T dc/dp - (active row bounds)'^T y + zl^T dl/dp - zu^T du/dp`.
//!
//! Both hold as long as the set of active bounds stays; at a bound that is about to become active or inactive they are
//! the derivatives of the barrier problem with the final barrier parameter.

use apsides_iteration::{ScalingFactors, SolveReport};

use crate::augmented::{AugmentedSystem, Newton};
use crate::error::NlpError;
use crate::model::{BarrierModel, Structure};
use crate::problem::Nlp;
use crate::scaled::ScaledProblem;
use crate::settings::NlpSettings;
use crate::step::SINGULAR_RESIDUAL;

/// Derivatives of the data of a problem with respect to one parameter, at the solution and in the user's units, with the
/// free variables and all multipliers held.
///
/// Fixed variables (equal bounds) may move with the parameter: their derivative stands in `fixed_variables`, and the
/// derivatives of the functions include what follows from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Perturbation {
    /// Derivative of the objective.
    pub objective: f64,
    /// Derivative of the gradient of the Lagrangian `grad f + J^T y`, length `n`; entries of fixed variables are not used.
    pub gradient: Vec<f64>,
    /// Derivatives of the constraint functions, length `m`.
    pub constraints: Vec<f64>,
    /// Derivatives of the values of the fixed variables, length `n`; zero for free variables.
    pub fixed_variables: Vec<f64>,
    /// Derivatives of the lower bounds of the free variables, length `n`; zero for fixed variables.
    pub variable_lower: Vec<f64>,
    /// Derivatives of the upper bounds of the free variables, length `n`; zero for fixed variables.
    pub variable_upper: Vec<f64>,
    /// Derivatives of the lower bounds of the constraints, length `m`.
    pub constraint_lower: Vec<f64>,
    /// Derivatives of the upper bounds of the constraints, length `m`; equal to `constraint_lower` for equalities.
    pub constraint_upper: Vec<f64>,
}

impl Perturbation {
    /// No change of a problem with `n` variables and `m` constraints, to be filled in.
    pub fn none(n: usize, m: usize) -> Self {
        Self {
            objective: 0.0,
            gradient: vec![0.0; n],
            constraints: vec![0.0; m],
            fixed_variables: vec![0.0; n],
            variable_lower: vec![0.0; n],
            variable_upper: vec![0.0; n],
            constraint_lower: vec![0.0; m],
            constraint_upper: vec![0.0; m],
        }
    }

    /// The difference quotient of the data of two problems whose parameter differs by `width`, both evaluated at the
    /// solution in `report`. Nothing is solved: the functions are differenced, not a solver. The error is of second
    /// order in `width` if the parameter of the solved problem lies in the middle.
    ///
    /// # Errors
    /// Problems of other sizes than the solution's, bounds that are fixed or infinite in one problem only, functions
    /// that are not finite, a width that is not positive.
    pub fn between<A: Nlp + ?Sized, B: Nlp + ?Sized>(
        before: &mut A,
        after: &mut B,
        report: &SolveReport,
        width: f64,
    ) -> Result<Self, NlpError> {
        if !(width > 0.0 && width.is_finite()) {
            let reason = "the width of a difference must be positive";
            return Err(NlpError::Perturbation { what: "width", index: 0, reason });
        }
        let (a, b) = (Data::of(&mut { before }, report)?, Data::of(&mut { after }, report)?);
        if let Some(index) = (0..a.fixed.len()).find(|&i| a.fixed[i] != b.fixed[i]) {
            let reason = "the variable is fixed on one side only";
            return Err(NlpError::Perturbation { what: "variable bounds", index, reason });
        }
        let slope = |what: &'static str, a: &[f64], b: &[f64]| {
            let entry = |(index, (a, b)): (usize, (&f64, &f64))| {
                let change = if a == b { 0.0 } else { (b - a) / width };
                let reason = "the difference is not finite";
                if change.is_finite() {
                    Ok(change)
                } else {
                    Err(NlpError::Perturbation { what, index, reason })
                }
            };
            a.iter().zip(b).enumerate().map(entry).collect::<Result<Vec<f64>, _>>()
        };
        let only = |mut slopes: Vec<f64>, fixed: bool| {
            for (slope, is_fixed) in slopes.iter_mut().zip(&a.fixed) {
                if *is_fixed != fixed {
                    *slope = 0.0;
                }
            }
            slopes
        };
        let lower = slope("variable lower bound", &a.lower, &b.lower)?;
        Ok(Self {
            objective: slope("objective", &[a.objective], &[b.objective])?[0],
            gradient: slope("gradient of the Lagrangian", &a.gradient, &b.gradient)?,
            constraints: slope("constraint", &a.constraints, &b.constraints)?,
            fixed_variables: only(lower.clone(), true),
            variable_lower: only(lower, false),
            variable_upper: only(slope("variable upper bound", &a.upper, &b.upper)?, false),
            constraint_lower: slope("constraint lower bound", &a.row_lower, &b.row_lower)?,
            constraint_upper: slope("constraint upper bound", &a.row_upper, &b.row_upper)?,
        })
    }

    /// Derivative of the optimal objective with respect to the parameter. Needs no factorisation.
    ///
    /// # Errors
    /// A vector of another length than the solution's.
    pub fn objective_derivative(&self, report: &SolveReport) -> Result<f64, NlpError> {
        self.check_lengths(report.x.len(), report.constraint_values.len())?;
        let mut derivative = self.objective;
        for (i, &y) in report.constraint_multipliers.iter().enumerate() {
            let bound = if y > 0.0 { self.constraint_upper[i] } else { self.constraint_lower[i] };
            derivative += y * (self.constraints[i] - bound);
        }
        for i in 0..report.x.len() {
            derivative += report.lower_multipliers[i] * self.variable_lower[i]
                - report.upper_multipliers[i] * self.variable_upper[i];
        }
        Ok(derivative)
    }

    fn check_lengths(&self, n: usize, m: usize) -> Result<(), NlpError> {
        let vectors = [
            ("perturbation gradient", &self.gradient, n),
            ("perturbation fixed_variables", &self.fixed_variables, n),
            ("perturbation variable_lower", &self.variable_lower, n),
            ("perturbation variable_upper", &self.variable_upper, n),
            ("perturbation constraints", &self.constraints, m),
            ("perturbation constraint_lower", &self.constraint_lower, m),
            ("perturbation constraint_upper", &self.constraint_upper, m),
        ];
        for (what, values, expected) in vectors {
            if values.len() != expected {
                return Err(NlpError::Length { what, found: values.len(), expected });
            }
            if let Some(index) = values.iter().position(|value| !value.is_finite()) {
                return Err(NlpError::Perturbation { what, index, reason: "a finite number is needed" });
            }
        }
        Ok(())
    }
}

/// The data that enter the optimality conditions of a problem at the solution of another one.
struct Data {
    objective: f64,
    gradient: Vec<f64>,
    constraints: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    row_lower: Vec<f64>,
    row_upper: Vec<f64>,
    fixed: Vec<bool>,
}

impl Data {
    /// Everything at the free variables and multipliers of the report and the problem's own fixed variables.
    fn of(nlp: &mut dyn Nlp, report: &SolveReport) -> Result<Self, NlpError> {
        let (n, m) = (nlp.variables(), nlp.constraints());
        check_report(report, n, m)?;
        let (mut lower, mut upper) = (vec![f64::NAN; n], vec![f64::NAN; n]);
        nlp.variable_bounds(&mut lower, &mut upper);
        let (mut row_lower, mut row_upper) = (vec![f64::NAN; m], vec![f64::NAN; m]);
        nlp.constraint_bounds(&mut row_lower, &mut row_upper);
        let fixed: Vec<bool> = lower.iter().zip(&upper).map(|(l, u)| l == u).collect();
        let mut x = report.x.clone();
        for i in (0..n).filter(|&i| fixed[i]) {
            x[i] = lower[i];
        }
        let objective = nlp.objective(&x);
        let mut constraints = vec![f64::NAN; m];
        nlp.constraint_values(&x, &mut constraints);
        let mut gradient = vec![f64::NAN; n];
        nlp.gradient(&x, &mut gradient);
        let pattern = nlp.jacobian_pattern();
        pattern.check("Jacobian", m, n)?;
        let mut jacobian = vec![f64::NAN; pattern.len()];
        nlp.jacobian(&x, &mut jacobian);
        for ((&row, &col), value) in pattern.rows.iter().zip(&pattern.cols).zip(&jacobian) {
            gradient[col] += value * report.constraint_multipliers[row];
        }
        for i in (0..n).filter(|&i| fixed[i]) {
            gradient[i] = 0.0;
        }
        Ok(Self { objective, gradient, constraints, lower, upper, row_lower, row_upper, fixed })
    }
}

fn check_report(report: &SolveReport, n: usize, m: usize) -> Result<(), NlpError> {
    let vectors = [
        ("x of the report", &report.x, n),
        ("lower_multipliers of the report", &report.lower_multipliers, n),
        ("upper_multipliers of the report", &report.upper_multipliers, n),
        ("scaling.variables of the report", &report.scaling.variables, n),
        ("constraint_values of the report", &report.constraint_values, m),
        ("constraint_multipliers of the report", &report.constraint_multipliers, m),
        ("scaling.constraints of the report", &report.scaling.constraints, m),
    ];
    for (what, values, expected) in vectors {
        if values.len() != expected {
            return Err(NlpError::Length { what, found: values.len(), expected });
        }
    }
    Ok(())
}

/// Derivative of a solution with respect to a parameter, per unit of the parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct SolutionDerivative {
    /// Derivative of the optimal objective.
    pub objective: f64,
    /// Derivatives of the variables, length `n`.
    pub x: Vec<f64>,
    /// Derivatives of the constraint multipliers, length `m`.
    pub constraint_multipliers: Vec<f64>,
}

/// The optimality conditions of a solution, factorised: each parameter costs one solve.
///
/// Made by [`InteriorPoint::sensitivity`](crate::InteriorPoint::sensitivity).
pub struct Sensitivity {
    report: SolveReport,
    structure: Structure,
    /// None without free variables.
    system: Option<AugmentedSystem>,
    /// Scaled Jacobian.
    jacobian: Vec<f64>,
    free: Vec<usize>,
    kept: Vec<usize>,
    is_fixed: Vec<bool>,
    /// Multiplier over distance of every variable and slack to its bounds.
    lower_ratio: Vec<f64>,
    upper_ratio: Vec<f64>,
    /// Multipliers of these bounds, scaled.
    lower_multipliers: Vec<f64>,
    upper_multipliers: Vec<f64>,
    /// Right-hand sides and solution, scaled.
    primal: Vec<f64>,
    dual: Vec<f64>,
    dv: Vec<f64>,
    dy: Vec<f64>,
}

/// Part of the derivative of an objective that may come from bounds which the point leaves.
const LEFT_BEHIND: f64 = 1e-4;

/// The active constraints of a solution, factorised: whether the multipliers are the only ones.
///
/// Constraints that depend on each other share their multipliers in any way, as two equal ones do, and an interior-point method leaves them
/// between. The derivative of the objective with respect to a parameter that moves one of them is then another one to each side, or there is
/// none, as the value of the objective has a kink, or no feasible point is left (J. Gauvin, Operations Research Letters 1977; A. V. Fiacco,
/// Introduction to Sensitivity and Stability Analysis, 1983). Two equal constraints that move alike share what does not matter.
///
/// Made by [`InteriorPoint::active_constraints`](crate::InteriorPoint::active_constraints).
pub struct ActiveConstraints(Sensitivity);

impl ActiveConstraints {
    pub(crate) fn new(
        nlp: &mut dyn Nlp,
        settings: &NlpSettings,
        report: &SolveReport,
    ) -> Result<Self, NlpError> {
        Sensitivity::new(nlp, settings, report, Curvature::OfDistance).map(Self)
    }

    /// Returns true if the derivative of the objective along a perturbation holds to both sides: the active constraints can follow the
    /// parameter, up or down by `step`.
    ///
    /// # Errors
    /// A perturbation that does not fit the problem.
    pub fn follow(&mut self, p: &Perturbation, step: f64) -> Result<bool, NlpError> {
        self.0.is_followed(&Perturbation { gradient: vec![0.0; p.gradient.len()], ..p.clone() }, step)
    }
}

/// The quadratic form of a factorised system.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Curvature {
    /// The Hessian of the Lagrangian: the solution moves to the next optimum.
    OfLagrangian,
    /// One for each scaled variable: the point moves as little as the constraints ask for.
    OfDistance,
}

impl Sensitivity {
    pub(crate) fn new(
        nlp: &mut dyn Nlp,
        settings: &NlpSettings,
        report: &SolveReport,
        curvature: Curvature,
    ) -> Result<Self, NlpError> {
        settings.validate()?;
        if !report.status.is_success() {
            return Err(NlpError::NoDerivative { reason: "the solve did not end at a solution" });
        }
        check_report(report, nlp.variables(), nlp.constraints())?;
        let mut problem = ScaledProblem::new(nlp, settings, Some(&report.x), Some(&report.scaling))?;
        let structure = problem.structure().clone();
        let (free, kept) = (problem.free().to_vec(), problem.kept().to_vec());
        let mut is_fixed = vec![true; report.x.len()];
        free.iter().for_each(|&i| is_fixed[i] = false);
        let (n, m) = (structure.primal(), structure.constraints);
        let mut v = vec![0.0; n];
        problem.scaled_start(&mut v);
        let (mut y, mut zl, mut zu) = (vec![0.0; m], vec![0.0; n], vec![0.0; n]);
        set_scaled_multipliers(report, &structure, &free, &kept, (&mut y, &mut zl, &mut zu));
        for (k, unit) in structure.units.iter().enumerate() {
            let i = kept[unit.row];
            v[structure.variables + k] = report.constraint_values[i] * report.scaling.constraints[i];
        }
        let relaxation = settings.bound_relaxation;
        let ratio = |z: &[f64], bounds: &[f64], sign: f64| -> Vec<f64> {
            let entry = |i: usize| {
                // The problem's bounds are relaxed already; a point put back on the user's bound lies that far inside.
                let distance = sign * (v[i] - bounds[i]);
                let margin = relaxation * bounds[i].abs().max(1.0);
                complementarity_ratio(z[i], distance, margin, report.barrier)
            };
            (0..n).map(entry).collect()
        };
        let lower_ratio = ratio(&zl, problem.lower(), 1.0);
        let upper_ratio = ratio(&zu, problem.upper(), -1.0);
        let mut jacobian = vec![0.0; structure.jacobian.len()];
        let mut hessian = vec![0.0; structure.hessian.len()];
        let mut diagonal = vec![0.0; n];
        let mut system = None;
        if structure.variables > 0 {
            problem.jacobian(&v, &mut jacobian);
            match curvature {
                Curvature::OfLagrangian => problem.hessian(&v, &y, &mut hessian, &mut diagonal),
                Curvature::OfDistance => diagonal.fill(1.0),
            }
            if jacobian.iter().chain(&hessian).any(|value| !value.is_finite()) {
                return Err(NlpError::NoDerivative { reason: "a derivative of the problem is not finite" });
            }
            for ((d, l), u) in diagonal.iter_mut().zip(&lower_ratio).zip(&upper_ratio) {
                *d += l + u;
            }
            let mut made = AugmentedSystem::of(&problem, settings)?;
            made.load(Some(&hessian), &diagonal, &jacobian);
            factor(&mut made, &structure, &diagonal, settings.dual_regularisation)?;
            system = Some(made);
        }
        Ok(Self {
            report: report.clone(),
            system,
            jacobian,
            free,
            kept,
            is_fixed,
            lower_ratio,
            upper_ratio,
            lower_multipliers: zl,
            upper_multipliers: zu,
            primal: vec![0.0; n],
            dual: vec![0.0; m],
            dv: vec![0.0; n],
            dy: vec![0.0; m],
            structure,
        })
    }

    /// The derivative of the solution with respect to the parameter of a perturbation.
    ///
    /// # Errors
    /// A perturbation that does not fit the problem; [`NlpError::NoDerivative`] if the solution cannot follow the
    /// parameter: dependent constraints, or a valley of the objective.
    pub fn solve(&mut self, p: &Perturbation) -> Result<SolutionDerivative, NlpError> {
        let objective = p.objective_derivative(&self.report)?;
        self.move_along(p)?;
        let mut x = p.fixed_variables.clone();
        let mut constraint_multipliers = vec![0.0; p.constraints.len()];
        if self.system.is_some() {
            let scaling = &self.report.scaling;
            for (value, &i) in self.dv.iter().zip(&self.free) {
                x[i] = value / scaling.variables[i];
            }
            for (value, &i) in self.dy.iter().zip(&self.kept) {
                constraint_multipliers[i] = value * scaling.constraints[i] / scaling.objective;
            }
        }
        Ok(SolutionDerivative { objective, x, constraint_multipliers })
    }

    /// Solves the system for a perturbation: the moves of variables, slacks and multipliers, scaled.
    fn move_along(&mut self, p: &Perturbation) -> Result<(), NlpError> {
        p.check_lengths(self.is_fixed.len(), self.report.constraint_values.len())?;
        let moving = |values: &[f64], fixed: bool| {
            (0..values.len()).find(|&i| values[i] != 0.0 && self.is_fixed[i] == fixed)
        };
        let bounds = moving(&p.variable_lower, true).or_else(|| moving(&p.variable_upper, true));
        if let Some(index) = bounds {
            let reason = "the variable is fixed; its derivative belongs into `fixed_variables`";
            return Err(NlpError::Perturbation { what: "variable bounds", index, reason });
        }
        if let Some(index) = moving(&p.fixed_variables, false) {
            let reason = "the variable is free";
            return Err(NlpError::Perturbation { what: "fixed_variables", index, reason });
        }
        let Some(system) = &mut self.system else { return Ok(()) };
        fill_right_hand_side(
            p,
            &self.report.scaling,
            &self.structure,
            (&self.free, &self.kept),
            (&self.lower_ratio, &self.upper_ratio),
            (&mut self.primal, &mut self.dual),
        );
        let newton = Newton { primal: &self.primal, dual: &self.dual, dv: &mut self.dv, dy: &mut self.dy };
        let [residual] = system.solve(&self.structure, &self.jacobian, [newton]);
        if residual > SINGULAR_RESIDUAL {
            return Err(NlpError::NoDerivative {
                reason: "the optimality conditions are singular in its direction",
            });
        }
        Ok(())
    }

    /// True if the multipliers that the derivative of the objective takes are the only ones: the active constraints can follow the parameter
    /// both ways.
    fn is_followed(&mut self, p: &Perturbation, step: f64) -> Result<bool, NlpError> {
        match self.move_along(p) {
            Ok(()) => {}
            Err(NlpError::NoDerivative { .. }) => return Ok(false),
            Err(e) => return Err(e),
        }
        let scaling = &self.report.scaling;
        let mut left_behind = 0.0;
        let mut consider = |k: usize, lower: f64, upper: f64| {
            let (below, above) = (self.dv[k] - lower, upper - self.dv[k]);
            for (change, ratio, z) in [
                (below, self.lower_ratio[k], self.lower_multipliers[k]),
                (above, self.upper_ratio[k], self.upper_multipliers[k]),
            ] {
                // A bound that goes on pushing moves with the point but for a small change of its multiplier.
                if ratio * change.abs() * step > z {
                    left_behind += z * change.abs();
                }
            }
        };
        for (k, &i) in self.free.iter().enumerate() {
            let factor = scaling.variables[i];
            consider(k, factor * p.variable_lower[i], factor * p.variable_upper[i]);
        }
        for (unit, k) in self.structure.units.iter().zip(self.structure.variables..) {
            let i = self.kept[unit.row];
            let factor = scaling.constraints[i];
            consider(k, factor * p.constraint_lower[i], factor * p.constraint_upper[i]);
        }
        let objective = p.objective_derivative(&self.report)?.abs() * scaling.objective.abs();
        let value = (self.report.objective * scaling.objective).abs().max(1.0);
        let is_nothing = left_behind * step <= f64::EPSILON * value;
        Ok(is_nothing || left_behind <= LEFT_BEHIND * (objective + left_behind))
    }
}

/// Multipliers of the engine's form: those of the slacks follow from their constraints.
fn set_scaled_multipliers(
    report: &SolveReport,
    structure: &Structure,
    free: &[usize],
    kept: &[usize],
    (y, zl, zu): (&mut [f64], &mut [f64], &mut [f64]),
) {
    let scaling = &report.scaling;
    for (k, &i) in free.iter().enumerate() {
        let factor = scaling.objective / scaling.variables[i];
        zl[k] = report.lower_multipliers[i] * factor;
        zu[k] = report.upper_multipliers[i] * factor;
    }
    for (y, &i) in y.iter_mut().zip(kept) {
        *y = report.constraint_multipliers[i] * scaling.objective / scaling.constraints[i];
    }
    for (k, unit) in structure.units.iter().enumerate() {
        zl[structure.variables + k] = (-y[unit.row]).max(0.0);
        zu[structure.variables + k] = y[unit.row].max(0.0);
    }
}

/// Multiplier over distance, not less than on the central path. `distance` includes the relaxation `margin`: within it
/// the report has put the point back on the bound, and the distance follows from the complementarity.
fn complementarity_ratio(multiplier: f64, distance: f64, margin: f64, barrier: f64) -> f64 {
    if distance == f64::INFINITY {
        return 0.0;
    }
    let mut distance = distance;
    // Rounding of `distance` is large compared with the margin.
    if distance <= 1.001 * margin && multiplier > 0.0 {
        let central = barrier / multiplier;
        distance = if margin > 0.0 { margin.min(central) } else { central };
    }
    let distance = distance.max(f64::EPSILON * barrier.max(f64::EPSILON));
    multiplier.max(barrier / distance) / distance
}

/// Factorises without regularisation; with that of dependent constraints if there are any.
fn factor(
    system: &mut AugmentedSystem,
    structure: &Structure,
    diagonal: &[f64],
    dual_regularisation: f64,
) -> Result<(), NlpError> {
    for shift in [0.0, dual_regularisation] {
        let inertia = system.factor(structure, diagonal, 0.0, shift);
        let Some(inertia) = inertia.filter(|inertia| inertia.zero == 0) else { continue };
        if inertia.negative == structure.constraints {
            return Ok(());
        }
    }
    let reason = "its reduced Hessian is not positive definite, so that it is not an isolated minimum";
    Err(NlpError::NoDerivative { reason })
}

/// Right-hand sides of the linear system, scaled.
fn fill_right_hand_side(
    p: &Perturbation,
    scaling: &ScalingFactors,
    structure: &Structure,
    (free, kept): (&[usize], &[usize]),
    (lower_ratio, upper_ratio): (&[f64], &[f64]),
    (primal, dual): (&mut [f64], &mut [f64]),
) {
    for (k, &i) in free.iter().enumerate() {
        let factor = scaling.variables[i];
        primal[k] = p.gradient[i] * scaling.objective / factor
            - factor * (lower_ratio[k] * p.variable_lower[i] + upper_ratio[k] * p.variable_upper[i]);
    }
    for (dual, &i) in dual.iter_mut().zip(kept) {
        // The target of an equality; corrected below for inequalities.
        *dual = (p.constraints[i] - p.constraint_lower[i]) * scaling.constraints[i];
    }
    for (unit, k) in structure.units.iter().zip(structure.variables..) {
        let i = kept[unit.row];
        let factor = scaling.constraints[i];
        dual[unit.row] = p.constraints[i] * factor;
        primal[k] =
            -factor * (lower_ratio[k] * p.constraint_lower[i] + upper_ratio[k] * p.constraint_upper[i]);
    }
}
