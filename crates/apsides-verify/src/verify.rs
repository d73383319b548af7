//! The verification of a trajectory: all checks in order.

use apsides_ocp::{ByCosine, ByDirection, Guess, Ocp, PathEnds, PhaseTrajectory, Scaling, Trajectory};
use apsides_ocp::{explicit_time, passed_features};

use crate::boundary::{self, Boundary};
use crate::ends::EndScales;
use crate::equations::Equations;
use crate::optimality::{self, Among, worth};
use crate::simulation::{self, Flight, Places, SimulatedPhase};
use crate::{
    Certificate, Check, CheckKind, Verdict, VerifyError, VerifySettings, adjoint, constant_controls,
    convexity, scan, second_order, shape,
};

/// A certificate and the re-simulated path on which it is based.
#[derive(Clone, Debug, PartialEq)]
pub struct Verification {
    /// Verdict and checks.
    pub certificate: Certificate,
    /// One per phase; of a phase whose re-simulation failed, the intervals that were flown.
    pub simulation: Vec<SimulatedPhase>,
}

/// Simulates a trajectory again and checks every requirement of the problem, and the first- and second-order conditions of a
/// local optimum if every phase has costates.
///
/// Used of the trajectory: initial states, controls, static parameters and times; its states only to be compared with
/// and, together with costates and multipliers, in the optimality conditions. A wrong trajectory, a NaN in it, or a
/// re-simulation that cannot be continued gives failing checks.
///
/// # Errors
/// [`VerifyError`] when the trajectory does not have the sizes of the problem or a setting is not allowed.
pub fn verify(
    ocp: &Ocp,
    trajectory: &Trajectory,
    settings: &VerifySettings,
) -> Result<Verification, VerifyError> {
    settings.check()?;
    shape::check(ocp, trajectory, &Guess::earlier(trajectory))?;
    let convex = convexity::check(ByCosine::of(ocp).as_ref().map_or(ocp, |c| &c.ocp));
    let (posed, stated) = (ocp, trajectory);
    let divided = explicit_time::divided_trajectory(ocp, trajectory)?;
    let trajectory = divided.as_ref().unwrap_or(trajectory);
    let divided = passed_features::divided_trajectory(ocp, trajectory)?;
    let trajectory = divided.as_ref().unwrap_or(trajectory);
    // Impulses at ends of phases are multipliers of constraints there.
    let with_ends = PathEnds::of_contacts(ocp, trajectory);
    let (ocp, trajectory) =
        with_ends.as_ref().map_or((ocp, trajectory), |(posed, meant)| (&posed.ocp, meant));
    let guess = Guess::earlier(trajectory);
    let scaling = Scaling::new(ocp, &guess);
    let end_scales = EndScales::new(ocp, &scaling, settings);
    let stays = |k: usize, flight: &Flight| {
        if flight.failure.is_some() {
            return false;
        }
        let ends = boundary::misses(ocp, trajectory, k, flight, &end_scales);
        let along =
            scan::deviation(&ocp.phases[k], &trajectory.phases[k], flight, &scaling.phases[k], settings);
        ends.iter().chain(&along).all(|check| check.passed)
    };
    let flights = simulation::fly_in_pieces(ocp, trajectory, &scaling, settings, Places::Nodes, stays);
    let boundary = Boundary { ocp, trajectory, flights: &flights, scaling: &scaling, settings };
    let mut checks = boundary.checks();
    for (k, (found, flight)) in trajectory.phases.iter().zip(&flights).enumerate() {
        if flight.failure.is_none() {
            let equations = Equations::new(ocp, k, &trajectory.parameters);
            checks.extend(scan::deviation(&ocp.phases[k], found, flight, &scaling.phases[k], settings));
            checks.extend(scan::checks(equations, found, flight, &scaling.phases[k], settings));
        }
    }
    let feasible = checks.iter().all(|c| c.passed);
    let fine = at_state_nodes(trajectory);
    // A bound of an angle pushes nothing where its cosine is stationary.
    let by_cosine = ByCosine::of(ocp);
    let with_values = by_cosine.as_ref().map(|c| (&c.ocp, c.with_values(&fine)));
    let (meant, of_meant) = with_values.as_ref().map_or((ocp, &fine), |(ocp, values)| (*ocp, values));
    // A length has no slope where the vector is nothing.
    let by_direction = ByDirection::of(meant);
    let split = by_direction.as_ref().map(|d| (&d.ocp, d.with_directions(of_meant)));
    let (smooth, of_smooth) = split.as_ref().map_or((meant, of_meant), |(ocp, split)| (*ocp, split));
    let in_form = (by_cosine.is_some() || by_direction.is_some())
        .then(|| Scaling::new(smooth, &Guess::earlier(of_smooth)));
    let of_form = in_form.as_ref().unwrap_or(&scaling);
    let shown = Shown { is_feasible: feasible, is_convex: convex.as_ref().is_some_and(|c| c.passed) };
    let (optimality, mut remarks) = optimum(smooth, of_smooth, of_form, &boundary, shown);
    remarks.splice(0..0, boundary.pieces());
    let is_extremal = feasible && !optimality.is_empty() && optimality.iter().all(|c| c.passed);
    checks.extend(optimality);
    if let Some(convex) = convex.filter(|_| is_extremal) {
        checks.push(convex);
        remarks.retain(|r| !second_order::is_remark(r));
    }
    let mut certificate = Certificate::new(checks).with_remarks(remarks);
    if certificate.verdict == Verdict::Feasible && constant_controls::has_only(stated) {
        let scaling = Scaling::new(posed, &Guess::earlier(stated));
        match constant_controls::claim(posed, &at_state_nodes(stated), &scaling, settings) {
            // Where another trajectory is better the best among constant controls is no answer.
            Ok(_) if certificate.names_something_better() => {}
            Ok(claim) => certificate = certificate.with_claim(Some(claim)),
            Err(reason) => certificate.remarks.extend(reason),
        }
    }
    let simulation = (trajectory.phases.iter().zip(&flights))
        .map(|(found, flight)| simulation::sample(found, flight, settings.scan_points))
        .collect();
    Ok(Verification { certificate, simulation })
}

/// The trajectory with its controls at the nodes that its states need: what a control has few nodes for, such as one that is constant over an
/// interval, must be optimal at every time. As it is where states and controls differ in their intervals.
fn at_state_nodes(trajectory: &Trajectory) -> Trajectory {
    let phase = |p: &PhaseTrajectory| p.with_controls_at_state_nodes().unwrap_or_else(|_| p.clone());
    Trajectory { phases: trajectory.phases.iter().map(phase).collect(), ..trajectory.clone() }
}

/// Facts that are shown before optimality is asked for.
#[derive(Clone, Copy)]
struct Shown {
    is_feasible: bool,
    /// The second variation of a convex problem is nowhere negative: what it comes out as is rounding.
    is_convex: bool,
}

/// Checks of optimality by the stated costates, or by those of the adjoint equation where there are none or they fail.
fn optimum(
    ocp: &Ocp,
    trajectory: &Trajectory,
    scaling: &Scaling,
    boundary: &Boundary<'_>,
    shown: Shown,
) -> (Vec<Check>, Vec<String>) {
    let settings = boundary.settings;
    let settled = optimality::with_vanished_phases(ocp, trajectory, scaling, settings);
    let trajectory = settled.as_ref().unwrap_or(trajectory);
    let stated = conditions(ocp, trajectory, scaling, boundary, shown);
    let fails = |checks: &[Check]| checks.is_empty() || checks.iter().any(|c| !c.passed);
    if !shown.is_feasible || !settings.adjoint || !fails(&stated.0) {
        return stated;
    }
    let Some(adjoint) = adjoint::with_costates(ocp, trajectory, scaling, settings) else { return stated };
    let (checks, mut remarks) = conditions(ocp, &adjoint, scaling, boundary, shown);
    let first_order = |checks: &[Check]| {
        let optimality = checks.iter().filter(|c| c.kind == CheckKind::Optimality);
        !checks.is_empty() && optimality.clone().count() > 0 && optimality.clone().all(|c| c.passed)
    };
    if !first_order(&checks) && !stated.0.is_empty() || first_order(&stated.0) {
        return stated;
    }
    remarks.insert(0, "costates and multipliers from the adjoint equation along the trajectory".to_owned());
    (checks, remarks)
}

fn conditions(
    ocp: &Ocp,
    trajectory: &Trajectory,
    scaling: &Scaling,
    boundary: &Boundary<'_>,
    shown: Shown,
) -> (Vec<Check>, Vec<String>) {
    let settings = boundary.settings;
    let Some(mut conditions) = optimality::phases(ocp, trajectory, scaling, Among::All) else {
        return (Vec::new(), Vec::new());
    };
    let mut checks = optimality::checks(ocp, trajectory, scaling, settings, &mut conditions);
    let mut remarks = Vec::new();
    // Of a trajectory that is no extremal the second variation says nothing.
    if shown.is_feasible && checks.iter().all(|c| c.passed) {
        let mut second = second_order::conditions(ocp, trajectory, scaling, settings, &mut conditions);
        if shown.is_convex {
            second.checks.retain(|check| check.passed);
        }
        checks.extend(second.checks);
        remarks.extend(second.remark);
        // Of one that something else beats it does not matter.
        if checks.iter().all(|c| c.passed || c.kind == CheckKind::Strictness) {
            checks.push(worth::check(boundary, trajectory, &mut conditions));
        }
    }
    (checks, remarks)
}
