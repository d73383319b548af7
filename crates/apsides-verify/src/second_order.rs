//! Second-order conditions of a local minimum, from the second variation.
//!
//! ```text
//! 2 dJ = [de]' B'' [de] + int [dx; du]' L'' [dx; du] dt     over   dx' = f_x dx + f_u du,   active constraints linearised
//! ```
//!
//! `de` are free ends, free times, corners of the control and static parameters; `B` and `L` as in the first-order
//! conditions. A negative direction among changes that keep every active bound shows that the trajectory is no minimum: an
//! extremal beyond its conjugate point, a saddle, a wrong sequence of arcs. The form is coercive on all changes that keep the
//! bounds against which the solution pushes: then, with the strengthened condition of Legendre and Clebsch and the
//! minimum principle over all admissible controls, the trajectory is a strict local minimum. Where the control jumps, the times
//! of the jumps are unknowns of the form, which is the quadratic form in the switching times of a bang-bang control. Kinks of the
//! functions add terms of instants ([`mod@kinks`]), and where a switching function
//! touches zero a short time beyond is a change of its own ([`mod@needle`]). Where the flight rests at a place at
//! which second derivatives jump, nothing is claimed ([`mod@beside`]).
//!
//! A. E. Bryson and Y.-C. Ho, Applied Optimal Control, 1975, chapter 6; N. P. Osmolovskii and H. Maurer, Applications to Regular
//! and Bang-Bang Control, SIAM 2012, doi 10.1137/1.9781611972368, chapters 2 and 5; K. Malanowski and H. Maurer, Computational
//! Optimization and Applications 5 (1996) 253, doi 10.1007/BF00248265, for constraints along the phase.

mod activity;
mod arcs;
mod beside;
mod conjugate;
mod constant;
mod contacts;
mod control_scales;
mod form;
mod interval;
mod kinks;
mod needle;
mod stage;
mod sweep;

use apsides_ocp::{Ocp, Scaling, Trajectory};

use crate::certificate::{NO_CURVATURE, THROUGHOUT};
use crate::ends::EndScales;
use crate::optimality::{Among, PhaseConditions};
use crate::place::place;
use crate::{Check, CheckKind, VerifySettings};
use activity::Space;
pub(crate) use arcs::corners;
use form::Form;
pub(crate) use kinks::jump_on_the_way;

/// Exponents of ten at which the amount of negative curvature is looked for.
const DECADES: i32 = 3;

/// Intervals for each one that the nodes ask for, where the control is singular and the curvature negative.
const FINER: [usize; 2] = [2, 4];

/// The findings of the second-order conditions.
#[derive(Debug, Default)]
pub(crate) struct SecondOrder {
    pub(crate) checks: Vec<Check>,
    /// The reason why a strict minimum is not claimed.
    pub(crate) remark: Option<String>,
}

/// The words with which a remark of this module begins.
const FIRST_ORDER_ONLY: &str = "first order only";

/// Says whether a remark is of this module: where the problem is convex there is nothing to remark.
pub(crate) fn is_remark(remark: &str) -> bool {
    remark.starts_with(FIRST_ORDER_ONLY)
}

/// The second-order conditions of a trajectory that meets the first-order ones.
pub(crate) fn conditions(
    ocp: &Ocp,
    trajectory: &Trajectory,
    scaling: &Scaling,
    settings: &VerifySettings,
    conditions: &mut [PhaseConditions<'_>],
) -> SecondOrder {
    let scales = EndScales::new(ocp, scaling, settings);
    let not_tested = |why: &str| SecondOrder { checks: Vec::new(), remark: Some(why.to_owned()) };
    if conditions.iter().any(|c| c.equations.phase.path_rows() > 0 && c.found.path_multipliers.is_none()) {
        return not_tested("first order only: the trajectory has no multipliers of its path constraints");
    }
    if !ocp.constraints.is_empty() && trajectory.constraint_multipliers.is_none() {
        return not_tested("first order only: the trajectory has no multipliers of its endpoint constraints");
    }
    if let Some((fall, at)) = beside::jump(conditions) {
        let name = "jump of the functions beside the flight";
        let check = Check::new(name, CheckKind::Curvature, fall, settings.minimum_tolerance, "-", at);
        return SecondOrder { checks: vec![check], remark: None };
    }
    if conditions.iter().any(|c| c.ends_hide_curvature) {
        return not_tested(
            "first order only: a function of the ends has a kink there with other second derivatives on its sides",
        );
    }
    if let Some((c, jump)) = conditions.iter().find_map(|c| Some((c, c.jump?))) {
        let state = &c.equations.phase.states[jump.state].variable.name;
        let at = place(c.equations.phase, jump.time);
        return not_tested(&format!(
            "first order only: the equations of motion jump with {state} ({at}), where its costate jumps by {:.1e} of the largest",
            jump.size
        ));
    }
    let discretised = |conditions: &mut [PhaseConditions<'_>], fineness| {
        Form::new(ocp, trajectory, &scales, &scaling.parameters, conditions, settings, fineness)
    };
    let Some(mut form) = discretised(conditions, 1) else {
        return not_tested("first order only: the linearised equations of motion could not be solved");
    };
    if let Some(remark) = form.phases.iter().find_map(|p| p.remark.as_ref()) {
        return not_tested(remark);
    }
    let legendre: Vec<(f64, f64)> = (0..conditions.len()).map(|k| form.legendre(k)).collect();
    let least = legendre.iter().map(|l| l.0).fold(f64::INFINITY, f64::min);
    let is_singular = least.abs() < settings.curvature_tolerance;
    let limit =
        if is_singular { settings.singular_curvature_tolerance } else { settings.curvature_tolerance };
    // What is positive on the larger space, less more and with lower bounds of instants in it, is so on the smaller one.
    let bends_upwards = legendre.iter().all(|l| l.0 >= settings.curvature_tolerance);
    let is_coercive = bends_upwards && form.inertia(Space::Sufficient, settings.coercivity).is_positive();
    // Along a singular arc the curvature that the discretisation leaves falls with the length of its intervals, that of a saddle does not.
    let within = |form: &Form| form.inertia(Space::Necessary, -limit).is_positive();
    let mut is_within = is_coercive || within(&form);
    for fineness in FINER {
        if is_within || !is_singular {
            break;
        }
        let Some(finer) = discretised(conditions, fineness) else { break };
        is_within = within(&finer);
        form = finer;
    }
    let mut amount = 0.0;
    if !is_within {
        amount = limit;
        let mut trial = limit;
        for _ in 0..DECADES * 6 {
            trial *= 10f64.powf(0.5);
            if form.inertia(Space::Necessary, -trial).is_positive() {
                break;
            }
            amount = trial;
        }
        amount *= 10f64.powf(0.25);
    }
    let has_place = amount > 0.0 && conditions.iter().all(|c| c.among == Among::All);
    let at = if has_place { conjugate::place_of(ocp, &form, conditions) } else { String::new() };
    let mut second = SecondOrder::default();
    let name = "negative curvature of the second variation";
    second.checks.push(Check::new(name, CheckKind::Curvature, amount, limit, "-", at));
    if amount > 0.0 {
        return second;
    }
    for (k, (c, &(least, time))) in conditions.iter().zip(&legendre).enumerate() {
        if least < settings.curvature_tolerance {
            let place = match form.is_singular_throughout(k, settings.curvature_tolerance) {
                true => format!("{THROUGHOUT} `{}`", c.equations.phase.name),
                false => place(c.equations.phase, time),
            };
            let name = "first order only: the Hamiltonian is not strictly convex in the free controls";
            second.remark = Some(format!("{name} ({least:.1e}), {place}"));
            return second;
        }
    }
    if let Some(rival) = conditions.iter().find_map(|c| c.rival.as_ref()) {
        second.remark = Some(format!(
            "first order only: another control has the same Hamiltonian along an arc ({rival})"
        ));
        return second;
    }
    if is_coercive {
        second.remark = beside::remark(ocp, trajectory, &scales, conditions);
        if second.remark.is_some() {
            return second;
        }
        second.checks.push(Check::new(
            "second variation positive on all admissible changes",
            CheckKind::Strictness,
            0.0,
            0.0,
            "-",
            format!("at least {:.0e} of the square of the change", settings.coercivity),
        ));
    } else {
        second.remark = Some(NO_CURVATURE.to_owned());
    }
    second
}
