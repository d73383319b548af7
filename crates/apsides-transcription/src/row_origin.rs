//! Rows of the discretised problem in the words of its statement.

use apsides_nlp::{SolveReport, Violation};
use apsides_ocp::{Ocp, Phase, RowOrigin, Unmet};

use crate::discretisation::Discretisation;
use crate::phase::PhaseLayout;
use crate::places::PhaseEnds;
use crate::transcription::Transcription;

/// A violation below this part of the scale of its row is rounding.
const ROUNDING: f64 = 1e-12;

/// The origin of a row that belongs to a phase as a whole.
#[must_use]
pub fn phase_row(phase: &Phase, name: impl Into<String>, unit: &str) -> RowOrigin {
    RowOrigin { phase: Some(phase.name.clone()), name: name.into(), unit: unit.into(), time: None }
}

impl<D: Discretisation> Transcription<D> {
    /// The origin of a row; the point `x` gives the times. None for a row that the program does not have.
    #[must_use]
    pub fn row_origin(&self, ocp: &Ocp, row: usize, x: &[f64]) -> Option<RowOrigin> {
        for (phase, p) in ocp.phases.iter().zip(&self.layout.phases) {
            let origin = p.row_origin(phase, row, x).or_else(|| end_row(phase, p.ends(), row));
            if origin.is_some() {
                return origin;
            }
        }
        ocp.constraints.iter().zip(&self.layout.endpoint_rows).find_map(|(c, &first)| {
            let v = c.rows.get(row.checked_sub(first)?)?;
            let name = format!("{}: {}", c.name, v.name);
            Some(RowOrigin { phase: None, name, unit: v.unit.clone(), time: None })
        })
    }

    /// The constraint that the point of a report violates most; none where that is met but for rounding.
    #[must_use]
    pub fn unmet(&self, ocp: &Ocp, report: &SolveReport) -> Option<Unmet> {
        let is_violated = |v: &Violation| v.amount.abs() > ROUNDING * self.scales.constraints[v.constraint];
        let worst = report.worst_constraint.filter(is_violated)?;
        let origin = self.row_origin(ocp, worst.constraint, &report.x)?;
        Some(Unmet { origin, amount: worst.amount })
    }
}

fn end_row(phase: &Phase, ends: &PhaseEnds, row: usize) -> Option<RowOrigin> {
    if ends.duration_row == Some(row) {
        return Some(phase_row(phase, "duration", &phase.time_unit));
    }
    let k = ends.integral_rows.iter().position(|r| *r == Some(row))?;
    let v = &phase.integrals[k].variable;
    Some(phase_row(phase, &v.name, &v.unit))
}
