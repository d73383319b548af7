//! Path constraints of controls that leave their bounds with a jump, or without.
//!
//! A path constraint that a mesh holds at a bound, and whose multiplier says that it should not, is let go. Where the Hamiltonian has a
//! curvature in every direction of the controls that moves the constraint, what stands at a bound kept there, its minimum is a little away from
//! the bound: the constraint leaves it without a jump. Where there is a direction without curvature, as the length of a thrust in a free
//! direction, the constraint goes to its other bound.

use apsides_nlp::{Nlp, Pattern, SolveReport};
use apsides_ocp::{ArcKind, Bounds, Ocp, Phase};

use crate::activity::is_between;
use crate::layout::CollocationPhase;
use crate::transcription::Transcription;

/// A curvature below this part of the largest one of a node is rounding.
const ROUNDING: f64 = 1e-12;

/// Slopes and curvatures of a row by the controls of a node, each control in units of its size.
struct AtNode<'a> {
    slopes: &'a mut [f64],
    curvatures: &'a mut [f64],
    /// Slopes of the other rows that stay at their bounds.
    kept: Vec<&'a [f64]>,
    free: Vec<bool>,
}

/// Per constraint row, for path constraints with controls that arcs of the mesh hold at a bound: the least curvature of the Lagrangian without the row
/// along controls that move the row by one, zero where it is none or negative, infinity where they cannot move it. NaN for other rows.
pub(crate) fn row_bends(ocp: &Ocp, nlp: &mut Transcription, report: &SolveReport) -> Vec<f64> {
    let mut bends = vec![f64::NAN; report.constraint_values.len()];
    let arcs_hold = |nlp: &Transcription, k: usize, row: usize| {
        nlp.layout.phases[k].mesh.arcs().iter().any(|arc| is_held(&arc.rows, row))
    };
    let phases = ocp.phases.iter().enumerate();
    let rows = phases.flat_map(|(k, phase)| (0..phase.path_rows()).map(move |row| (k, row)));
    let held: Vec<(usize, usize)> = rows.filter(|&(k, row)| arcs_hold(nlp, k, row)).collect();
    if held.is_empty() {
        return bends;
    }
    let jacobian = nlp.jacobian_pattern();
    let mut slopes = vec![0.0; jacobian.len()];
    nlp.jacobian(&report.x, &mut slopes);
    for (k, row) in held {
        of_row(&ocp.phases[k], nlp, k, row, (&jacobian, &slopes), report, &mut bends);
    }
    bends
}

fn is_held(courses: &[Option<ArcKind>], index: usize) -> bool {
    matches!(courses.get(index), Some(Some(ArcKind::Lower | ArcKind::Upper)))
}

fn of_row(
    phase: &Phase,
    nlp: &mut Transcription,
    k: usize,
    row: usize,
    (jacobian, slopes): (&Pattern, &[f64]),
    report: &SolveReport,
    bends: &mut [f64],
) {
    let nu = phase.controls.len();
    let mut multipliers = report.constraint_multipliers.clone();
    let p = &nlp.layout.phases[k];
    (0..p.nodes.len()).for_each(|node| multipliers[p.path_row(node) + row] = 0.0);
    let hessian = nlp.hessian_pattern();
    let mut curvatures = vec![0.0; hessian.len()];
    nlp.hessian(&report.x, 1.0, &multipliers, &mut curvatures);
    let p = &nlp.layout.phases[k];
    let size = |c: usize| {
        let Bounds { lower, upper } = phase.controls[c].bounds;
        let width = upper - lower;
        if width.is_finite() { width } else { phase.controls[c].size().unwrap_or(1.0) }
    };
    let rows = p.rows_per_node - p.states;
    let mut of_rows = vec![0.0; p.nodes.len() * rows * nu];
    for ((&r, &c), v) in jacobian.rows.iter().zip(&jacobian.cols).zip(slopes) {
        if let (Some((node, c)), Some((at, r))) = (control_of(p, c), path_row_of(p, r))
            && node == at
        {
            of_rows[(node * rows + r) * nu + c] += v * size(c);
        }
    }
    let mut of_nodes = vec![0.0; p.nodes.len() * nu * nu];
    for ((&r, &c), v) in hessian.rows.iter().zip(&hessian.cols).zip(&curvatures) {
        if let (Some((node, i)), Some((other, j))) = (control_of(p, r), control_of(p, c))
            && node == other
        {
            let v = v * size(i) * size(j);
            of_nodes[(node * nu + i) * nu + j] += v;
            if i != j {
                of_nodes[(node * nu + j) * nu + i] += v;
            }
        }
    }
    for node in 0..p.nodes.len() {
        let courses = &p.mesh.arcs()[p.arc_of(node)];
        let of_row = |r: usize| &of_rows[(node * rows + r) * nu..][..nu];
        let stays = |r: &usize| *r != row && (is_fixed(phase, *r) || is_held(&courses.rows, *r));
        let values = &report.x[p.control_column(node)..];
        let is_free = |c: usize| !is_held(&courses.controls, c) && is_between(values[c], &phase.controls[c]);
        let at_node = AtNode {
            slopes: &mut of_row(row).to_vec(),
            curvatures: &mut of_nodes[node * nu * nu..][..nu * nu],
            kept: (0..rows).filter(stays).map(of_row).collect(),
            free: (0..nu).map(is_free).collect(),
        };
        bends[p.path_row(node) + row] = at_node.bend();
    }
}

fn is_fixed(phase: &Phase, row: usize) -> bool {
    phase.path.iter().flat_map(|c| &c.rows).nth(row).is_some_and(|r| r.bounds.is_fixed())
}

/// Node and control of a column.
fn control_of(p: &CollocationPhase, column: usize) -> Option<(usize, usize)> {
    let offset = column.checked_sub(p.state_column(0))?;
    let (node, place) = (offset / (p.states + p.controls), offset % (p.states + p.controls));
    (node < p.nodes.len() && place >= p.states).then(|| (node, place - p.states))
}

/// Node and path constraint row of a row.
fn path_row_of(p: &CollocationPhase, row: usize) -> Option<(usize, usize)> {
    let offset = row.checked_sub(p.first_row)?;
    let (node, place) = (offset / p.rows_per_node, offset % p.rows_per_node);
    (node < p.nodes.len() && place >= p.states).then(|| (node, place - p.states))
}

impl AtNode<'_> {
    /// The least curvature along controls that move the row by one.
    fn bend(self) -> f64 {
        let Self { slopes, curvatures, kept, free } = self;
        let n = free.len();
        let largest = curvatures.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        // Directions that what stays at its bound does not allow.
        let mut held: Vec<Vec<f64>> = (0..n)
            .filter(|c| !free[*c])
            .map(|c| (0..n).map(|i| f64::from(u8::from(i == c))).collect())
            .collect();
        for row in kept {
            let mut direction = row.to_vec();
            let before = norm(&direction);
            held.iter().for_each(|d| take_away(&mut direction, d));
            let rest = norm(&direction);
            if rest > ROUNDING.sqrt() * before {
                direction.iter_mut().for_each(|v| *v /= rest);
                held.push(direction);
            }
        }
        let size = norm(slopes);
        for d in &held {
            take_away(slopes, d);
            (0..n).for_each(|i| take_away(&mut curvatures[i * n..][..n], d));
            for j in 0..n {
                let along: f64 = (0..n).map(|i| d[i] * curvatures[i * n + j]).sum();
                (0..n).for_each(|i| curvatures[i * n + j] -= along * d[i]);
            }
        }
        if norm(slopes) <= ROUNDING.sqrt() * size || !largest.is_finite() {
            return f64::INFINITY;
        }
        for d in &held {
            (0..n * n).for_each(|k| curvatures[k] += largest * d[k / n] * d[k % n]);
        }
        (0..n).for_each(|i| curvatures[i * n + i] += ROUNDING * largest);
        compliance(curvatures, slopes).map_or(0.0, |c| 1.0 / c)
    }
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Takes the part along a direction of length one away.
fn take_away(v: &mut [f64], direction: &[f64]) {
    let along: f64 = v.iter().zip(direction).map(|(a, b)| a * b).sum();
    v.iter_mut().zip(direction).for_each(|(a, b)| *a -= along * b);
}

/// `g B^-1 g` for a symmetric matrix; none where it is not positive definite.
fn compliance(b: &mut [f64], g: &mut [f64]) -> Option<f64> {
    let n = g.len();
    let mut total = 0.0;
    for j in 0..n {
        let pivot = b[j * n + j];
        if pivot.is_nan() || pivot <= 0.0 {
            return None;
        }
        total += g[j] * g[j] / pivot;
        for i in j + 1..n {
            let factor = b[i * n + j] / pivot;
            g[i] -= factor * g[j];
            (j + 1..n).for_each(|k| b[i * n + k] -= factor * b[j * n + k]);
        }
    }
    Some(total)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of a few operations.
    const ROUND_OFF: f64 = 1e-9;

    /// The length of a thrust `(3, 4)` with a cost `a.T + |T|`: curvature along the circle alone.
    fn thrust(free: [bool; 2]) -> f64 {
        let mut slopes = [0.6, 0.8];
        let mut curvatures = [0.64 / 5.0, -0.48 / 5.0, -0.48 / 5.0, 0.36 / 5.0];
        let (slopes, curvatures) = (&mut slopes[..], &mut curvatures[..]);
        AtNode { slopes, curvatures, kept: Vec::new(), free: free.to_vec() }.bend()
    }

    #[test]
    fn the_length_of_a_free_direction_has_no_curvature_and_beside_a_bound_it_has() {
        assert!(thrust([true, true]).abs() < ROUND_OFF);
        // The second component alone moves the length by 0.8 for one.
        assert!((thrust([false, true]) - 0.36 / 5.0 / 0.64).abs() < ROUND_OFF);
        assert_eq!(thrust([false, false]), f64::INFINITY);
    }

    #[test]
    fn a_saddle_has_none_and_what_is_kept_takes_its_direction_out() {
        let bend = |diagonal: [f64; 2], kept: &[f64]| {
            let kept = if kept.is_empty() { Vec::new() } else { vec![kept] };
            let (mut slopes, mut curvatures) = ([1.0, 1.0], [diagonal[0], 0.0, 0.0, diagonal[1]]);
            AtNode { slopes: &mut slopes, curvatures: &mut curvatures, kept, free: vec![true; 2] }.bend()
        };
        assert_eq!(bend([2.0, -1.0], &[]), 0.0);
        // Least 2 x^2 + 3 y^2 with x + y = 1.
        assert!((bend([2.0, 3.0], &[]) - 1.2).abs() < ROUND_OFF);
        assert!((bend([2.0, -1.0], &[0.0, 7.0]) - 2.0).abs() < ROUND_OFF);
    }
}
