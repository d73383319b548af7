//! Times at which the equations pass a joint of a table: between two pieces of a spline a third derivative jumps, or a second one.
//!
//! A polynomial across such a time comes closer to the solution by a power of its length alone, and the costates, and what a bound along an arc
//! adds to them, lose a power with each derivative. With interval ends there more points help as along smooth functions. What an interval end
//! leaves of the distance to a joint does little harm, so that these ends follow the trajectory from mesh to mesh.

use std::sync::Arc;

use apsides_ad::{NodeFunction, formula_node};
use apsides_ocp::{Ocp, PhaseMesh, PhaseTrajectory, Trajectory};

/// Halvings for the time of a joint.
const HALVINGS: usize = 40;

/// An interval end this close to a joint, as a part of the shorter interval beside it, is at it.
const NEAR: f64 = 0.05;

/// Functions that are zero at the joints of all tables of a problem.
pub(crate) struct Joints {
    /// Per phase, functions with an output for each joint.
    phases: Vec<Vec<Arc<dyn NodeFunction>>>,
}

impl Joints {
    /// Those of a problem; functions without a formula tell none.
    pub(crate) fn new(ocp: &Ocp) -> Self {
        let phases = ocp.phases.iter().map(|phase| {
            let arguments = |function: &Arc<dyn NodeFunction>| {
                let formula = function.formula().ok()?;
                let joints = formula.joints();
                (!joints.is_empty()).then(|| formula_node(formula.arguments_of(&joints)))
            };
            phase.functions().filter_map(arguments).collect()
        });
        Self { phases: phases.collect() }
    }

    /// Per phase, the normalised times on its mesh at which the trajectory passes a joint, in increasing order.
    pub(crate) fn along(&self, trajectory: &Trajectory) -> Vec<Vec<f64>> {
        let phases = self.phases.iter().zip(&trajectory.phases);
        let times = phases.map(|(functions, t)| {
            let passed = |f: &Arc<dyn NodeFunction>| passed(f.as_ref(), t, &trajectory.parameters);
            let mut times: Vec<f64> = functions.iter().flat_map(passed).collect();
            times.sort_by(f64::total_cmp);
            times
        });
        times.collect()
    }
}

/// The times at which outputs of a function change their sign.
fn passed(function: &dyn NodeFunction, t: &PhaseTrajectory, parameters: &[f64]) -> Vec<f64> {
    let (nx, nu) = (t.state.dimension(), t.control.dimension());
    let mut z = vec![0.0; function.inputs()];
    let time = z.len() - 1;
    z[nx + nu..time].copy_from_slice(&parameters[..time - nx - nu]);
    let mut at = |interval: usize, fraction: f64, out: &mut [f64]| {
        let (ends, breaks) = (t.mesh.fractions(), t.state.breaks());
        let share = (fraction - ends[interval]) / (ends[interval + 1] - ends[interval]);
        z[time] = breaks[interval] + share * (breaks[interval + 1] - breaks[interval]);
        let now = z[time];
        t.state.evaluate_in(interval, now, &mut z[..nx]);
        t.control.evaluate_in(interval, now, &mut z[nx..nx + nu]);
        function.value(&z, out);
    };
    let outputs = function.outputs();
    let (mut before, mut after, mut middle) = (vec![0.0; outputs], vec![0.0; outputs], vec![0.0; outputs]);
    let mut found = Vec::new();
    for (interval, (w, &n)) in t.mesh.fractions().windows(2).zip(t.mesh.points()).enumerate() {
        let place = |k: usize| w[0] + (w[1] - w[0]) * k as f64 / (n + 1) as f64;
        at(interval, place(0), &mut before);
        for k in 1..=n + 1 {
            at(interval, place(k), &mut after);
            for output in (0..outputs).filter(|o| before[*o] * after[*o] < 0.0) {
                let (mut low, mut high) = (place(k - 1), place(k));
                for _ in 0..HALVINGS {
                    let half = 0.5 * (low + high);
                    at(interval, half, &mut middle);
                    if middle[output] * before[output] > 0.0 { low = half } else { high = half }
                }
                found.push(0.5 * (low + high));
            }
            std::mem::swap(&mut before, &mut after);
        }
    }
    found
}

/// Says whether an inner end of intervals is at a joint of a table.
pub(crate) fn is_at_joint(ends: &[f64], k: usize, joints: &[f64]) -> bool {
    let near = NEAR * (ends[k] - ends[k - 1]).min(ends[k + 1] - ends[k]);
    joints.iter().any(|f| (f - ends[k]).abs() < near)
}

/// The ends of the intervals, those close to a joint moved there unless something else keeps them in their places.
pub(crate) fn at_joints(mesh: &PhaseMesh, joints: &[f64]) -> Vec<f64> {
    let mut ends = mesh.fractions().to_vec();
    for k in 1..mesh.intervals() {
        let is_kept = mesh.breaks().iter().any(|b| b.end == k)
            || mesh.touch_points().iter().any(|t| t.end == k)
            || mesh.crossings().iter().any(|c| c.end == k);
        let near = NEAR * (ends[k] - ends[k - 1]).min(ends[k + 1] - ends[k]);
        let distance = |f: &&f64| (**f - ends[k]).abs();
        let nearest = joints.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        if let Some(f) = nearest.filter(|f| !is_kept && distance(f) < near) {
            ends[k] = *f;
        }
    }
    ends
}

/// The joints within an interval, away from its ends and from each other.
pub(crate) fn inside(joints: &[f64], start: f64, end: f64) -> Vec<f64> {
    let room = NEAR * (end - start);
    let mut inside: Vec<f64> = Vec::new();
    for &f in joints.iter().filter(|f| (start + room..end - room).contains(f)) {
        if inside.last().is_none_or(|last| f - last > room) {
            inside.push(f);
        }
    }
    inside
}
