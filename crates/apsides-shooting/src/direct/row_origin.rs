//! Rows of the discretised problem in the words of its statement.

use apsides_nlp::SolveReport;
use apsides_ocp::{Ocp, Phase, RowOrigin, Unmet};

use super::layout::PhaseLayout;
use super::transcription::Transcription;

impl Transcription {
    /// The constraint that a point violates most.
    pub(crate) fn unmet(&self, ocp: &Ocp, report: &SolveReport) -> Option<Unmet> {
        let worst = report.worst_constraint?;
        let origin = self.row_origin(ocp, worst.constraint, &report.x)?;
        Some(Unmet { origin, amount: worst.amount })
    }

    /// Where a row comes from; `x` gives the times.
    pub(crate) fn row_origin(&self, ocp: &Ocp, row: usize, x: &[f64]) -> Option<RowOrigin> {
        for (phase, p) in ocp.phases.iter().zip(&self.layout.phases) {
            if let Some(k) = p.segments.iter().position(|s| (s.matching_row..s.end_row).contains(&row)) {
                return segment_row_origin(phase, p, k, row, x);
            }
            let whole = |name: String, unit: &str| RowOrigin {
                phase: Some(phase.name.clone()),
                name,
                unit: unit.into(),
                time: None,
            };
            if p.duration_row == Some(row) {
                return Some(whole("duration".into(), &phase.time_unit));
            }
            if let Some(k) = p.integral_rows.iter().position(|r| *r == Some(row)) {
                let v = &phase.integrals[k].variable;
                return Some(whole(v.name.clone(), &v.unit));
            }
        }
        ocp.constraints.iter().zip(&self.layout.endpoint_rows).find_map(|(c, &first)| {
            let v = c.rows.get(row.checked_sub(first)?)?;
            let name = format!("{}: {}", c.name, v.name);
            Some(RowOrigin { phase: None, name, unit: v.unit.clone(), time: None })
        })
    }
}

fn segment_row_origin(phase: &Phase, p: &PhaseLayout, k: usize, row: usize, x: &[f64]) -> Option<RowOrigin> {
    let segment = &p.segments[k];
    let at = |place: f64, name: String, unit: &str| RowOrigin {
        phase: Some(phase.name.clone()),
        name,
        unit: unit.into(),
        time: Some(segment.time(x, place)),
    };
    if let Some(v) = phase.states.get(row - segment.matching_row).map(|s| &s.variable) {
        return Some(at(1.0, format!("equation of motion of {}", v.name), &v.unit));
    }
    if let Some(&(point, state, _)) = segment.bound_rows.iter().find(|b| b.2 == row) {
        let v = &phase.states[state].variable;
        return Some(at(segment.rows.place(point), v.name.clone(), &v.unit));
    }
    if segment.length_row == Some(row) {
        return Some(at(0.0, "least length of a segment".into(), &phase.time_unit));
    }
    let rows = segment.path_rows.chunks(phase.path.len().max(1)).enumerate();
    rows.flat_map(|(point, rows)| phase.path.iter().zip(rows).map(move |(c, &first)| (point, c, first)))
        .filter(|(_, _, first)| *first <= row)
        .find_map(|(point, c, first)| {
            let v = c.rows.get(row - first)?;
            Some(at(segment.rows.place(point), v.name.clone(), &v.unit))
        })
}
