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

use apsides_iteration::Status;

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

/// The least relaxation of the requirements listed in `elastic`, from the point `start`; all else is hard.
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
) -> Result<Relaxation, NlpError> {
    let mut nlp = nlp;
    let mut problem = Elastic::new(&mut nlp, requirements, elastic, start)?;
    let report = InteriorPoint { settings: settings.clone() }.solve(&mut problem)?;
    Ok(problem.relaxation(report, requirements.len()))
}

/// Names the requirements that conflict, then tries each of them and a few more that take part alone.
///
/// # Errors
/// As [`relax`].
pub fn diagnose<N: Nlp + ?Sized>(
    nlp: &mut N,
    requirements: &[Requirement],
    start: &[f64],
    settings: &NlpSettings,
) -> Result<Diagnosis, NlpError> {
    let all: Vec<usize> = (0..requirements.len()).collect();
    let together = relax(nlp, requirements, &all, start, settings)?;
    let status = together.report.status;
    let found = together.conflicts(requirements);
    let mut remedies = Vec::new();
    if status.is_success() && !found.is_empty() {
        for g in together.candidates(requirements, MOST_OTHERS) {
            let alone = relax(nlp, requirements, &[g], &together.report.x, settings)?;
            if alone.is_success() {
                remedies.push((g, alone.amounts[g]));
            }
        }
    }
    Ok(Diagnosis { status, conflicts: found.iter().map(|&g| (g, together.amounts[g])).collect(), remedies })
}
