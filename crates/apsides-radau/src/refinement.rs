//! A better mesh from the error estimate: more points where the solution is smooth, more intervals where it is not.
//!
//! Patterson, Hager, Rao 2015 (doi 10.1002/oca.2114), with the number of points bounded so that an interval is divided when it would need
//! more than the largest number: into two where the motion is smooth, into short intervals of few points where it is not, or has limits without
//! controls.

use std::f64::consts::LN_2;

use apsides_ocp::{Break, Crossing, Mesh, Ocp, Phase, PhaseMesh, PhaseTrajectory, TouchPoint, Trajectory};

use crate::RadauError;
use crate::boundary_arcs::{POINTS, beside_bounds};
use crate::joints::{at_joints, inside};
use crate::junction::order;
use crate::mesh_solve::total_points;
use crate::settings::RadauSettings;
use crate::smoothness::decay;

/// Fewest points added to an interval: one at a time costs a mesh for little.
const LEAST_INCREASE: usize = 2;

/// Most points of an interval, times those it has, where the mesh would have too many.
const CAREFUL_GROWTH: f64 = 1.5;

/// Part of the tolerance that halves of a smooth interval are made for: their costates converge later than their states.
const MARGIN: f64 = 1e-2;

/// Intervals this short beside the phase are not divided: their ends would be one in double precision.
const LEAST_LENGTH: f64 = 1e-12;

/// The next mesh; equal to the last one when every interval meets the tolerance or is too short to be divided. An interval that does not, and
/// holds joints of tables, at these normalised times per phase, is divided there first.
///
/// The error of a motion that turns many times falls much faster with the points than by the order alone. So where the mesh would have more
/// points than the settings allow, intervals get at most half as many more.
pub(crate) fn refine(
    ocp: &Ocp,
    trajectory: &Trajectory,
    joints: &[Vec<f64>],
    settings: &RadauSettings,
) -> Result<Mesh, RadauError> {
    let within = |growth: f64| -> Result<Mesh, RadauError> {
        let phases = (ocp.phases.iter().zip(&trajectory.phases).zip(joints))
            .map(|((phase, t), joints)| refine_phase(phase, t, joints, settings, growth))
            .collect::<Result<_, _>>()?;
        Ok(Mesh { phases })
    };
    let mesh = within(f64::INFINITY)?;
    if total_points(&mesh) <= settings.max_total_points { Ok(mesh) } else { within(CAREFUL_GROWTH) }
}

fn refine_phase(
    phase: &Phase,
    trajectory: &PhaseTrajectory,
    joints: &[f64],
    settings: &RadauSettings,
    growth: f64,
) -> Result<PhaseMesh, RadauError> {
    let PhaseTrajectory { mesh, interval_errors: errors, .. } = trajectory;
    let ends = at_joints(mesh, joints);
    let long = beside_bounds(phase, mesh);
    // Where a limit without controls is met and left, the motion has corners, which many short intervals find.
    let may_halve = (0..phase.path_rows()).all(|row| order(phase, row).is_none());
    let mut fractions = vec![0.0];
    let mut points = Vec::new();
    let (mut breaks, mut touch_points, mut crossings) = (Vec::new(), Vec::new(), Vec::new());
    for (k, (&n, &error)) in mesh.points().iter().zip(errors).enumerate() {
        let (start, end) = (ends[k], ends[k + 1]);
        breaks.extend(mesh.breaks().iter().filter(|b| b.end == k).map(|b| Break { end: points.len(), ..*b }));
        let here = mesh.touch_points().iter().filter(|t| t.end == k);
        touch_points.extend(here.map(|t| TouchPoint { end: points.len(), ..*t }));
        let here = mesh.crossings().iter().filter(|c| c.end == k);
        crossings.extend(here.map(|c| Crossing { end: points.len(), ..*c }));
        if error <= settings.tolerance || end - start <= LEAST_LENGTH {
            fractions.push(end);
            points.push(n);
            continue;
        }
        let inside = inside(joints, start, end);
        if !inside.is_empty() {
            let mut last = start;
            for f in inside.into_iter().chain([end]) {
                fractions.push(f);
                let part = (n as f64 * (f - last) / (end - start)).ceil() as usize + LEAST_INCREASE;
                points.push(part.clamp(settings.min_points, settings.max_points));
                last = f;
            }
            continue;
        }
        // An interval of n points has an error of order n^-q for q more points (eq. 29); NaN asks for a division.
        let wanted = (error / settings.tolerance).ln() / (n.max(2) as f64).ln();
        let wanted =
            if wanted.is_finite() { n + (wanted.ceil() as usize).max(LEAST_INCREASE) } else { usize::MAX };
        let most = (growth * n as f64).ceil();
        let wanted = if most < settings.max_points as f64 { wanted.min(most as usize) } else { wanted };
        if wanted <= settings.max_points {
            fractions.push(end);
            points.push(wanted);
        } else if may_halve && let Some(decay) = decay(trajectory, k)? {
            let half = points_of_half(n, error / (MARGIN * settings.tolerance), decay);
            fractions.extend([start + 0.5 * (end - start), end]);
            points.extend([half.clamp(settings.min_points, settings.max_points); 2]);
        } else {
            let least = if long[k] { POINTS.min(settings.max_points) } else { settings.min_points };
            let parts = (wanted / least).clamp(2, settings.max_parts);
            for j in 1..=parts {
                let f = j as f64 / parts as f64;
                fractions.push(if j == parts { end } else { start + f * (end - start) });
                points.push(least);
            }
        }
    }
    let mesh = PhaseMesh::new(fractions, points)?.with_arcs(breaks, mesh.arcs().to_vec())?;
    Ok(mesh.with_touch_points(touch_points)?.with_crossings(crossings)?)
}

/// Points of each half of an interval of `n` points whose Legendre coefficients fall by `exp(decay)` per degree, and whose error is so many times
/// what it may be: in a half they fall twice as fast.
fn points_of_half(n: usize, excess: f64, decay: f64) -> usize {
    let n = n as f64;
    let left = excess.ln() - n * LN_2;
    (n + left / (decay + LN_2)).ceil().max(0.5 * n) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_have_the_points_that_their_error_needs() {
        // Twelve points of halves leave 2^-12 of the error; each further one takes a factor of 8 away.
        assert_eq!(points_of_half(12, 2f64.powi(12), 4f64.ln()), 12);
        assert_eq!(points_of_half(12, 2f64.powi(15), 4f64.ln()), 13);
        assert_eq!(points_of_half(12, 2f64.powi(9), 4f64.ln()), 11);
        assert_eq!(points_of_half(12, 1.0, 2f64.ln()), 6);
    }
}
