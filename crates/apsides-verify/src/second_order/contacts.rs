//! Curvature of the contacts of a phase: instants at which a path constraint row without controls touches its bound.

use apsides_ocp::Contact;
use nalgebra::DMatrix;

use super::arcs::Span;
use crate::optimality::PhaseConditions;

/// Distance from a bound, relative to the scale of a row, along an arc there.
const AT_BOUND: f64 = 1e-7;

/// Curvature and row of each contact, both over `[x, xi_a, xi_b, p]`.
pub(super) fn of(
    conditions: &mut PhaseConditions<'_>,
    parameters: &[f64],
    spans: &[Span],
    duration: f64,
) -> Vec<(usize, DMatrix<f64>, Vec<f64>)> {
    let found = conditions.found;
    let (nx, nu, np) = (conditions.equations.nx, conditions.equations.nu, conditions.equations.np);
    let width = nx + nu + np + 1;
    let mut all = Vec::new();
    for contact in &found.contacts {
        let time = found.contact_time(contact);
        let Some(end) = spans.iter().position(|s| s.end == time).map(|k| k + 1) else { continue };
        let span = spans[end - 1];
        conditions.evaluate_within_bounds(span.segment, time);
        let (mut gradient, mut hessian) = (vec![0.0; width], vec![0.0; width * width]);
        conditions.equations.row_gradient(contact.row, &mut gradient);
        conditions.equations.add_row_hessian(contact.row, 1.0, &mut hessian);
        if !begins_or_ends_arc(conditions, contact) {
            add_shift_of_contact(conditions, &gradient, &mut hessian);
        }
        hessian.iter_mut().for_each(|h| *h *= contact.multiplier);
        let theta = (time - span.arc_start) / (span.arc_end - span.arc_start);
        // Columns of [x, u, p, t] behind each of [x, xi_a, xi_b, p], with the factor.
        let column = |k: usize| match k {
            k if k < nx => (k, conditions.scaling.states[k]),
            k if k == nx => (width - 1, (1.0 - theta) * duration),
            k if k == nx + 1 => (width - 1, theta * duration),
            k => (k - 2 + nu, parameters[k - nx - 2]),
        };
        let n = nx + 2 + np;
        let h = DMatrix::from_fn(n, n, |i, j| {
            let ((a, fa), (b, fb)) = (column(i), column(j));
            hessian[a * width + b] * fa * fb
        });
        let row = (0..n)
            .map(|k| {
                let (a, f) = column(k);
                gradient[a] * f
            })
            .collect();
        all.push((end, h, row));
    }
    all
}

/// Says whether the row of a contact stays at its bound on one side: then no extremum of it moves.
fn begins_or_ends_arc(conditions: &PhaseConditions<'_>, contact: &Contact) -> bool {
    let breaks = conditions.found.control.breaks();
    let mut rows = conditions.equations.phase.path.iter().flat_map(|p| &p.rows);
    let Some(variable) = rows.nth(contact.row) else { return false };
    let scale = conditions.row_scales[contact.row];
    let stays = |interval: usize| {
        let inside = breaks[interval]..breaks[interval + 1];
        let nodes = conditions.nodes.iter().filter(|n| n.time > inside.start && n.time < inside.end);
        let mut nodes = nodes.peekable();
        nodes.peek().is_some()
            && nodes.all(|n| variable.bounds.excess(n.path[contact.row]) >= -AT_BOUND * scale)
    };
    (contact.end > 0 && stays(contact.end - 1)) || (contact.end + 1 < breaks.len() && stays(contact.end))
}

/// The value of a row at its extremum changes also because the extremum moves: `-(d g')^2 / g''` joins the Hessian of the row
/// over `[x, u, p, t]`, where no control occurs in `g'` (J. F. Bonnans and A. Hermant, SIAM J. Control Optim. 46 (2007) 1398,
/// doi 10.1137/06065756X).
fn add_shift_of_contact(conditions: &mut PhaseConditions<'_>, gradient: &[f64], hessian: &mut [f64]) {
    let (nx, nu, width) = (conditions.equations.nx, conditions.equations.nu, gradient.len());
    let (mut rates, mut jacobian) = (vec![0.0; nx], vec![0.0; nx * width]);
    conditions.equations.dynamics_jacobian(&mut rates, &mut jacobian);
    // Gradient of g' = g_x f + g_t.
    let slope = |k: usize| {
        let through_states =
            (0..nx).map(|i| hessian[i * width + k] * rates[i] + gradient[i] * jacobian[i * width + k]);
        through_states.sum::<f64>() + hessian[(width - 1) * width + k]
    };
    let slopes: Vec<f64> = (0..width).map(slope).collect();
    let second = slopes.iter().zip(&rates).map(|(s, f)| s * f).sum::<f64>() + slopes[width - 1];
    if slopes[nx..nx + nu].iter().any(|s| *s != 0.0) || second == 0.0 {
        return;
    }
    for i in 0..width {
        for j in 0..width {
            hessian[i * width + j] -= slopes[i] * slopes[j] / second;
        }
    }
}
