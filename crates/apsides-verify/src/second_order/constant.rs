//! The accessory problem where the controls keep one value over each interval of the trajectory's control.

use nalgebra::DMatrix;

use super::activity::Activity;
use super::arcs::Span;
use super::interval::{Instant, Interval};
use crate::optimality::{Lengths, PhaseConditions};

/// One interval for each of the trajectory's control, with one value of each control, from the parts that an interval was cut into.
///
/// Constraints along the phase are left out: the form on more changes than are admissible shows a minimum among those that are.
pub(super) fn joined(
    parts: &[Interval],
    conditions: &mut PhaseConditions<'_>,
    lengths: Lengths,
) -> Vec<Interval> {
    let segments = conditions.found.control.segments().len();
    let of_segment = |segment: usize| parts.iter().filter(move |p| p.span.segment == segment);
    (0..segments).filter_map(|s| join(of_segment(s), conditions, lengths)).collect()
}

fn join<'a>(
    parts: impl Iterator<Item = &'a Interval> + Clone,
    conditions: &mut PhaseConditions<'_>,
    lengths: Lengths,
) -> Option<Interval> {
    let (nx, nu, np) = (conditions.equations.nx, conditions.equations.nu, conditions.equations.np);
    let ni = conditions.equations.phase.integrals.len();
    let first = parts.clone().next()?;
    let own = first.span;
    // Over [x, c, xi_a, xi_b, p].
    let width = nx + nu + 2 + np;
    let (t0, tf) = (conditions.found.initial_time, conditions.found.final_time);
    let times = match lengths {
        Lengths::Free => [[1.0, 0.0], [0.0, 1.0]],
        Lengths::Given => [own.arc_start, own.arc_end].map(|t| {
            let part = (t - t0) / (tf - t0);
            [1.0 - part, part]
        }),
    };
    let mut state = DMatrix::zeros(nx, width);
    state.view_mut((0, 0), (nx, nx)).fill_with_identity();
    let mut curvature = DMatrix::zeros(width, width);
    let mut integrals = DMatrix::zeros(ni, width);
    let (mut weight, mut instants) = (0.0, Vec::new());
    for part in parts.clone() {
        let stages = part.weights.len();
        // Its own [x, U_1 .. U_s, xi_a, xi_b, p].
        let mut map = DMatrix::zeros(part.step.ncols(), width);
        map.view_mut((0, 0), (nx, width)).copy_from(&state);
        for i in 0..stages * nu {
            map[(nx + i, nx + i % nu)] = 1.0;
        }
        let (from, to) = (nx + stages * nu, nx + nu);
        for (i, row) in times.iter().enumerate() {
            for (j, v) in row.iter().enumerate() {
                map[(from + i, to + j)] = *v;
            }
        }
        for p in 0..np {
            map[(from + 2 + p, to + 2 + p)] = 1.0;
        }
        curvature += map.transpose() * &part.curvature * &map;
        let of_whole = |i: &Instant| Instant { gradient: map.transpose() * &i.gradient, ..*i };
        instants.extend(part.instants.iter().map(of_whole));
        integrals += &part.integrals * &map;
        state = &part.step * &map;
        weight += part.weights.iter().sum::<f64>();
    }
    let end = parts.clone().last().map_or(own.end, |p| p.span.end);
    let span = match lengths {
        Lengths::Free => Span { end, ..own },
        Lengths::Given => Span { end, arc: 0, arc_start: t0, arc_end: tf, ..own },
    };
    let slopes = conditions.mean_slopes(own.segment);
    let mut value = vec![0.0; nu];
    conditions.found.control.evaluate_in(own.segment, own.start, &mut value);
    let stand = |j: usize| {
        let bounds = &conditions.equations.phase.controls[j].bounds;
        let has_effect = state.column(nx + j).amax() > 0.0 || curvature.column(nx + j).amax() > 0.0;
        let stand = Activity::new(slopes[j], value[j], bounds, conditions.scaling.controls[j]);
        if has_effect { stand } else { Activity::Strong }
    };
    let controls = (0..nu).map(stand).collect();
    Some(Interval {
        span,
        controls,
        curvature,
        instants,
        step: state,
        rows: Vec::new(),
        integrals,
        weights: vec![weight],
        legendre: f64::INFINITY,
        at_bounds: vec![Activity::Free; nx],
    })
}
