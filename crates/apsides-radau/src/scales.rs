//! Warnings where a scale is far from what the functions do at the start.

pub use apsides_ocp::method::ScaleWarning;
use apsides_ocp::{Bounds, Ocp, RowOrigin};
use apsides_transcription::Changes;

use crate::transcription::Transcription;

/// Ratio of a scale to what it should be that calls for a warning: the tolerance of the solver is then off by as much.
const EXTREME: f64 = 1e6;

/// Part of a scale below which a size is round-off of zero, such as the cosine of a right angle: it says nothing of what is usual.
const ROUNDING: f64 = 1e-14;

/// True for a size that is neither zero nor what rounding leaves of it.
fn is_known(size: f64, scale: f64) -> bool {
    size > ROUNDING * scale && size.is_finite()
}

/// Scales that are extreme at the start, the worst row of each constraint.
pub(crate) fn scale_warnings(nlp: &mut Transcription, ocp: &Ocp) -> Vec<ScaleWarning> {
    let Changes { rows, objective } = nlp.changes();
    let mut warnings = Vec::new();
    let mut add = |warning: ScaleWarning| {
        if !is_known(warning.size, warning.scale) || warning.factor() < EXTREME {
            return;
        }
        let same = |w: &&mut ScaleWarning| w.subject == warning.subject && w.phase == warning.phase;
        match warnings.iter_mut().find(same) {
            Some(known) if known.factor() < warning.factor() => *known = warning,
            Some(_) => {}
            None => warnings.push(warning),
        }
    };
    let is_of_arcs = |r: &usize| nlp.layout.phases.iter().any(|p| p.arc_rows().contains(r));
    // The least duration of an arc is no bound that anyone stated.
    let own: Vec<bool> = (0..rows.len()).map(|r| is_of_arcs(&r)).collect();
    // Nor is that of a phase.
    let phases = || ocp.phases.iter().zip(&nlp.layout.phases);
    let durations: Vec<(usize, Bounds)> =
        phases().filter_map(|(phase, p)| Some((p.ends.duration_row?, phase.duration))).collect();
    let stated_duration = |r: usize| durations.iter().find(|(row, _)| *row == r).map(|(_, stated)| stated);
    for (r, change) in rows.into_iter().enumerate().filter(|(r, _)| !own[*r]) {
        let scale = nlp.scales.constraints[r];
        let bound = stated_duration(r).map_or_else(
            || largest_bound(nlp.row_limits.lower[r], nlp.row_limits.upper[r]),
            |stated| largest_bound(stated.lower, stated.upper),
        );
        let off = |size: f64| is_known(size, scale) && (size / scale).max(scale / size) >= EXTREME;
        if !off(change) && !off(bound) {
            continue;
        }
        let Some(RowOrigin { phase, name, unit, .. }) = nlp.row_origin(ocp, r, &nlp.start) else {
            continue;
        };
        let (size, size_is) = if off(change) {
            (change, "with every variable moved by its scale it changes by")
        } else {
            (bound, "its bound is")
        };
        add(ScaleWarning { subject: format!("constraint `{name}`"), phase, scale, size, size_is, unit });
    }
    variable_warnings(nlp, ocp, &mut add);
    add(ScaleWarning {
        subject: format!("objective `{}`", ocp.objective.name),
        phase: None,
        scale: nlp.scales.objective,
        size: objective,
        size_is: "with every variable moved by its scale it changes by",
        unit: ocp.objective.unit.clone(),
    });
    warnings
}

fn variable_warnings(nlp: &Transcription, ocp: &Ocp, add: &mut impl FnMut(ScaleWarning)) {
    let largest = |columns: &mut dyn Iterator<Item = usize>| {
        columns.fold(0.0_f64, |largest, c| largest.max(nlp.start[c].abs()))
    };
    for (phase, p) in ocp.phases.iter().zip(&nlp.layout.phases) {
        let states = phase.states.iter().map(|s| &s.variable).enumerate();
        let states = states.map(|(s, v)| ("state", v, p.state_column(0) + s, p.nodes.len() + 1));
        let controls = phase.controls.iter().enumerate();
        let controls = controls.map(|(c, v)| ("control", v, p.control_column(0) + c, p.nodes.len()));
        for (kind, variable, first, count) in states.chain(controls) {
            let stride = p.states + p.controls;
            add(ScaleWarning {
                subject: format!("{kind} `{}`", variable.name),
                phase: Some(phase.name.clone()),
                scale: nlp.scales.variables[first],
                size: largest(&mut (0..count).map(|k| first + k * stride)),
                size_is: "its guess is of the size",
                unit: variable.unit.clone(),
            });
        }
    }
    for (k, variable) in ocp.parameters.iter().enumerate() {
        let column = nlp.layout.first_parameter + k;
        add(ScaleWarning {
            subject: format!("parameter `{}`", variable.name),
            phase: None,
            scale: nlp.scales.variables[column],
            size: nlp.start[column].abs(),
            size_is: "its guess is of the size",
            unit: variable.unit.clone(),
        });
    }
}

/// Zero without a finite bound.
fn largest_bound(lower: f64, upper: f64) -> f64 {
    [lower, upper].into_iter().filter(|b| b.is_finite()).fold(0.0, |largest, b| largest.max(b.abs()))
}
