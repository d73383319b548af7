//! The part of the stationarity in the controls that the barrier blurs.
//!
//! A control that comes close to a bound and is not pushed against it is held off by the barrier: slope of the Hamiltonian and distance to the bound have
//! the barrier parameter as their product, over the weight of the node, so that neither is small at the ends of short intervals. The objective does not
//! tell, and the mesh is not to blame.

use apsides_ocp::{Ocp, PhaseTrajectory};

use crate::mesh_solve::MeshSolve;

/// Certificates allow so much.
const BLURRED: f64 = 1e-5;

/// True if controls are farther from where the Hamiltonian is stationary than a certificate allows.
pub(crate) fn is_blurred(ocp: &Ocp, solve: &MeshSolve) -> bool {
    blur(ocp, solve) > BLURRED
}

/// The largest of the smaller of slope and distance over all controls at all nodes: the slope times the scale of the control relative to the largest
/// term of the Hamiltonian that a state makes, the distance relative to the scale. Zero without costates.
fn blur(ocp: &Ocp, solve: &MeshSolve) -> f64 {
    let phases = ocp.phases.iter().zip(&solve.nlp.layout.phases).zip(&solve.trajectory.phases).enumerate();
    let of_phase = phases.map(|(k, ((phase, p), t))| {
        let size = hamiltonian_size(t);
        let scales = &solve.nlp.quantity_scales.phases[k].controls;
        let report = &solve.report;
        let mut largest = 0.0_f64;
        for (node, n) in p.nodes.iter().enumerate() {
            let seconds = n.weight * p.arc_duration(p.arc_of(node), &report.x);
            for (c, (control, scale)) in phase.controls.iter().zip(scales).enumerate() {
                let column = p.control_column(node) + c;
                let slope = report.lower_multipliers[column] - report.upper_multipliers[column];
                let value = report.x[column];
                let bounds = control.bounds;
                let room = if slope > 0.0 { value - bounds.lower } else { bounds.upper - value };
                let slope = slope.abs() * scale / (seconds * size);
                // Without a term, or in an interval that has come to nothing, it tells nothing.
                let is_known = size > 0.0 && seconds > 0.0 && slope.is_finite();
                largest = largest.max(if is_known { slope.min(room / scale) } else { 0.0 });
            }
        }
        largest
    });
    of_phase.fold(0.0, f64::max)
}

/// The largest product of a costate and the rate of its state over the nodes.
fn hamiltonian_size(t: &PhaseTrajectory) -> f64 {
    let Some(costate) = &t.costate else { return 0.0 };
    let nx = t.state.dimension();
    let (mut rate, mut lambda) = (vec![0.0; nx], vec![0.0; nx]);
    let mut largest = 0.0_f64;
    for segment in 0..t.control.segments().len() {
        for time in t.control.node_times(segment) {
            t.state.derivative_in(segment, time, &mut rate);
            costate.evaluate_in(segment, time, &mut lambda);
            largest = rate.iter().zip(&lambda).fold(largest, |m, (f, l)| m.max((f * l).abs()));
        }
    }
    largest
}
