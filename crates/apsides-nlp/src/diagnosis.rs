//! Diagnosis of infeasible problems: the requirements that conflict, and the single ones whose relaxation restores feasibility.
//!
//! A requirement is a set of limits that move together by one amount `e >= 0`: a heat rate limit at every instant is one
//! requirement. Chosen requirements are made elastic, everything else stays hard:
//!
//! ```text
//! minimise sum_g w_g e_g / u_g   subject to   g_k(x) - e_g <= value_k  (upper),   g_k(x) + e_g >= value_k  (lower)
//! ```
//!
//! With all requirements elastic the sum of absolute values names few of them (Chinneck, Feasibility and Infeasibility
//! in Optimization, 2008, doi 10.1007/978-0-387-74932-7, chapter 6); the multipliers tell which others take part. With one of
//! them elastic the problem gives the least relaxation of that one that restores feasibility, or has no feasible point.

use apsides_iteration::{Observer, Status};

use crate::elastic::Elastic;
use crate::error::NlpError;
use crate::interior_point::InteriorPoint;
use crate::problem::Nlp;
use crate::requirement::{Relaxation, Requirement};
use crate::settings::NlpSettings;

/// Candidates tried besides the requirements that give way.
const MOST_OTHERS: usize = 5;

/// The requirements that conflict, and those whose relaxation alone restores feasibility.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnosis {
    /// Status of the solve with all requirements elastic; the conflicts mean nothing unless it succeeded.
    pub status: Status,
    /// Requirements that give way together, with their amounts in the user's units. None: the problem is feasible.
    pub conflicts: Vec<(usize, f64)>,
    /// Requirements each of which alone restores feasibility, with the least amount.
    pub remedies: Vec<(usize, f64)>,
}

/// The least relaxation of the requirements listed in `elastic`, from the point `start`; all else is hard. The observer sees every
/// iteration and can stop the solve.
///
/// Where a requirement bounds a variable or a constraint, the requirements replace the problem's own bounds on it.
///
/// # Errors
/// Indices, lengths or numbers that do not fit; hard requirements that contradict each other as bounds.
pub fn relax<N: Nlp + ?Sized>(
    nlp: &mut N,
    requirements: &[Requirement],
    elastic: &[usize],
    start: &[f64],
    settings: &NlpSettings,
    observer: &mut dyn Observer,
) -> Result<Relaxation, NlpError> {
    let mut nlp = nlp;
    let mut problem = Elastic::new(&mut nlp, requirements, elastic, start)?;
    let report = InteriorPoint { settings: settings.clone() }.solve_observed(&mut problem, observer)?;
    Ok(problem.relaxation(report, requirements.len()))
}

/// Names the requirements that conflict, then tries each of them and a few more that take part alone.
///
/// # Errors
/// As [`relax`].
///
/// # Examples
/// ```
/// use apsides_nlp::{Nlp, NlpSettings, Pattern, diagnose, requirements_of};
///
/// /// A number of at least 2 and at most 5, whose double is at most 3.
/// struct TooMuch;
///
/// impl Nlp for TooMuch {
///     fn variables(&self) -> usize { 1 }
///     fn constraints(&self) -> usize { 1 }
///     fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) { (lower[0], upper[0]) = (2.0, 5.0) }
///     fn constraint_bounds(&self, lower: &mut [f64], upper: &mut [f64]) { (lower[0], upper[0]) = (f64::NEG_INFINITY, 3.0) }
///     fn initial_point(&self, x: &mut [f64]) { x[0] = 3.0 }
///     fn jacobian_pattern(&self) -> Pattern { Pattern::dense(1, 1) }
///     fn hessian_pattern(&self) -> Pattern { Pattern::lower_triangle(1) }
///     fn objective(&mut self, x: &[f64]) -> f64 { x[0] }
///     fn gradient(&mut self, _: &[f64], gradient: &mut [f64]) { gradient[0] = 1.0 }
///     fn constraint_values(&mut self, x: &[f64], values: &mut [f64]) { values[0] = 2.0 * x[0] }
///     fn jacobian(&mut self, _: &[f64], values: &mut [f64]) { values[0] = 2.0 }
///     fn hessian(&mut self, _: &[f64], _: f64, _: &[f64], values: &mut [f64]) { values[0] = 0.0 }
/// }
///
/// // Bounds in the order of the variables, then the constraints: at least 2, at most 5, at most 3.
/// let requirements = requirements_of(&TooMuch);
/// let found = diagnose(&mut TooMuch, &requirements, &[3.0], &NlpSettings::default())?;
/// // The number would have to be lowered to 1.5, or the limit raised to 4.
/// let mut remedies = found.remedies;
/// remedies.sort_by_key(|(requirement, _)| *requirement);
/// let [(0, lowered), (2, raised)] = remedies[..] else { panic!("{remedies:?}") };
/// assert!((lowered - 0.5).abs() < 1e-5 && (raised - 1.0).abs() < 1e-5);
/// # Ok::<(), apsides_nlp::NlpError>(())
/// ```
pub fn diagnose<N: Nlp + ?Sized>(
    nlp: &mut N,
    requirements: &[Requirement],
    start: &[f64],
    settings: &NlpSettings,
) -> Result<Diagnosis, NlpError> {
    let all: Vec<usize> = (0..requirements.len()).collect();
    let together = relax(nlp, requirements, &all, start, settings, &mut ())?;
    let status = together.report.status;
    let found = together.conflicts(requirements);
    let mut remedies = Vec::new();
    if status.is_success() && !found.is_empty() {
        for g in together.candidates(requirements, MOST_OTHERS) {
            let alone = relax(nlp, requirements, &[g], &together.report.x, settings, &mut ())?;
            if alone.is_success() {
                remedies.push((g, alone.amounts[g]));
            }
        }
    }
    Ok(Diagnosis { status, conflicts: found.iter().map(|&g| (g, together.amounts[g])).collect(), remedies })
}
