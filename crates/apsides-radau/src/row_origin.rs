//! Rows of the discretised problem in the words of its statement.

use crate::layout::PhaseLayout;
use crate::transcription::Transcription;
use apsides_ocp::{Ocp, RowOrigin};

impl Transcription {
    /// Where row `row` comes from; `x` gives the times.
    #[must_use]
    pub fn row_origin(&self, ocp: &Ocp, row: usize, x: &[f64]) -> Option<RowOrigin> {
        for (phase, p) in ocp.phases.iter().zip(&self.layout.phases) {
            let end = p.first_row + p.nodes.len() * p.rows_per_node;
            if (p.first_row..end).contains(&row) {
                return Some(node_row_origin(phase, p, row - p.first_row, x));
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
            if p.first_arc_row.is_some_and(|r| (r..r + p.arcs.len()).contains(&row)) {
                return Some(whole("duration between switches".into(), &phase.time_unit));
            }
            if p.pinned_rows.iter().any(|r| r.0 == row) {
                return Some(whole("start of an arc".into(), &phase.time_unit));
            }
            if let Some((_, touch)) = p.rate_rows.iter().find(|r| r.0 == row) {
                let v = phase.path.iter().flat_map(|c| &c.rows).nth(touch.row)?;
                return Some(whole(format!("rate of {} where it touches its bound", v.name), &v.unit));
            }
            if let Some((_, _, c)) = p.degree_rows.iter().find(|r| r.0 == row) {
                let v = &phase.controls[*c];
                return Some(whole(format!("degree of {}", v.name), &v.unit));
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

fn node_row_origin(phase: &apsides_ocp::Phase, p: &PhaseLayout, offset: usize, x: &[f64]) -> RowOrigin {
    let (node, k) = (offset / p.rows_per_node, offset % p.rows_per_node);
    let time = p.time(node, x);
    let (name, unit) = if k < p.states {
        let v = &phase.states[k].variable;
        (format!("equation of motion of {}", v.name), v.unit.clone())
    } else {
        let row = phase.path.iter().flat_map(|c| &c.rows).nth(k - p.states);
        row.map_or_else(Default::default, |v| (v.name.clone(), v.unit.clone()))
    };
    RowOrigin { phase: Some(phase.name.clone()), name, unit, time: Some(time) }
}
