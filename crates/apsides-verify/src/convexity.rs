//! Problems in which every extremal is a global optimum.
//!
//! Over fixed times, with equations of motion that are affine in states, controls and parameters, and constraints and a cost that are convex
//! in them, the set of admissible trajectories is convex and so is the cost: the minimum principle is sufficient (O. L. Mangasarian,
//! SIAM J. Control 4 (1966) 139, doi 10.1137/0304013). All of this is read from the formulas ([`mod@curvature`]), at every point of their
//! range; of a function without formula it is not said.

mod curvature;

use apsides_ad::{Formula, NodeFunction};
use apsides_ocp::cones::with_lengths;
use apsides_ocp::{Bounds, EndpointInput, Ocp, Phase};

use crate::ends::allowed;
use crate::equations::sign;
use crate::{Check, CheckKind};
use curvature::{Curvature, curvatures};

/// The check that the problem is convex; none if it is not.
pub(crate) fn check(ocp: &Ocp) -> Option<Check> {
    let convex = (0..ocp.phases.len()).all(|k| phase_is_convex(ocp, k)) && ends_are_convex(ocp);
    convex.then(|| {
        let words = "affine equations over fixed times, convex constraints, convex cost";
        Check::new("convex problem", CheckKind::Convexity, 0.0, 0.0, "-", words)
    })
}

/// Returns true if the rules call the sum of the outputs, each times its weight, convex in all inputs over a box.
pub(crate) fn sum_is_convex(formula: &Formula, weights: &[f64], bounds: &[[f64; 2]]) -> bool {
    let curvatures = curvature::by_rules(formula, bounds);
    curvatures.into_iter().zip(weights).all(|(c, weight)| c.weighted(*weight).is_convex())
}

fn interval(bounds: &Bounds) -> [f64; 2] {
    [bounds.lower, bounds.upper]
}

/// Returns true if the values of a function that are within bounds are those of a convex set.
fn keeps_convex(curvature: Curvature, bounds: &Bounds) -> bool {
    curvature.is_affine()
        || (bounds.lower == f64::NEG_INFINITY && curvature.is_convex())
        || (bounds.upper == f64::INFINITY && curvature.is_concave())
}

/// Curvature in states, controls and parameters of a function along a phase.
fn along(ocp: &Ocp, phase: &Phase, function: &dyn NodeFunction) -> Vec<Curvature> {
    let states = phase.states.iter().map(|s| interval(&s.variable.bounds));
    let mut bounds: Vec<[f64; 2]> =
        states.chain(phase.controls.iter().map(|c| interval(&c.bounds))).collect();
    if phase.takes_parameters(function) {
        bounds.extend(ocp.parameters.iter().map(|p| interval(&p.bounds)));
    }
    let mut is_variable = vec![true; bounds.len()];
    bounds.push([phase.initial_time.lower, phase.final_time.upper]);
    is_variable.push(false);
    curvatures(function, &bounds, &is_variable)
}

fn phase_is_convex(ocp: &Ocp, k: usize) -> bool {
    let phase = &ocp.phases[k];
    if !phase.has_fixed_times() {
        return false;
    }
    let sign = sign(ocp);
    along(ocp, phase, phase.dynamics.as_ref()).into_iter().all(Curvature::is_affine)
        && phase.path.iter().all(|p| {
            let by_length = with_lengths(phase, p);
            let p = by_length.as_ref().unwrap_or(p);
            let rows = along(ocp, phase, p.function.as_ref()).into_iter().zip(&p.rows);
            rows.into_iter().all(|(curvature, row)| keeps_convex(curvature, &row.bounds))
        })
        && phase.integrals.iter().enumerate().all(|(q, integral)| {
            let weight = sign * ocp.objective.integral_weight(k, q);
            let curvature = along(ocp, phase, integral.function.as_ref());
            curvature
                .into_iter()
                .all(|c| c.weighted(weight).is_convex() && keeps_convex(c, &integral.variable.bounds))
        })
}

fn ends_are_convex(ocp: &Ocp) -> bool {
    let of = |function: &dyn NodeFunction, inputs: &[EndpointInput]| {
        let bounds: Vec<[f64; 2]> = inputs.iter().map(|input| interval(&allowed(ocp, *input))).collect();
        curvatures(function, &bounds, &vec![true; inputs.len()])
    };
    let sign = sign(ocp);
    ocp.constraints.iter().all(|c| {
        let rows = of(c.function.as_ref(), &c.inputs).into_iter().zip(&c.rows);
        rows.into_iter().all(|(curvature, row)| keeps_convex(curvature, &row.bounds))
    }) && (ocp.objective.functions.iter()).all(|(inputs, f)| {
        of(f.as_ref(), inputs).into_iter().all(|curvature| curvature.weighted(sign).is_convex())
    })
}
