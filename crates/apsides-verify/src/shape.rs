//! Refuses a trajectory that does not fit its problem, so that the checks can index without looking.

use apsides_ocp::{Guess, Ocp, PhaseTrajectory, PiecewisePolynomial, Trajectory};

use crate::VerifyError;

/// Largest difference between the ends of a polynomial and of its phase, relative to the duration: rounding.
const SPAN_TOLERANCE: f64 = 1e-10;

/// Checks sizes and spans of everything in the trajectory.
pub(crate) fn check(ocp: &Ocp, trajectory: &Trajectory, guess: &Guess) -> Result<(), VerifyError> {
    guess.check(ocp)?;
    for (phase, found) in ocp.phases.iter().zip(&trajectory.phases) {
        let polynomials = [
            ("state", Some(&found.state), phase.states.len()),
            ("control", Some(&found.control), phase.controls.len()),
            ("costate", found.costate.as_ref(), phase.states.len()),
            ("path multipliers", found.path_multipliers.as_ref(), phase.path_rows()),
        ];
        for (what, polynomial, expected) in polynomials {
            let Some(polynomial) = polynomial else { continue };
            if polynomial.dimension() != expected {
                return Err(VerifyError::Dimension {
                    place: format!("phase `{}`, {what}", phase.name),
                    what: "components",
                    expected,
                    found: polynomial.dimension(),
                });
            }
            span(&phase.name, what, polynomial, found)?;
        }
    }
    for (phase, found) in ocp.phases.iter().zip(&trajectory.phases) {
        let expected = phase.integrals.len();
        if let Some(found) = found.integral_multipliers.as_ref().map(Vec::len).filter(|n| *n != expected) {
            let place = format!("phase `{}`, integral multipliers", phase.name);
            return Err(VerifyError::Dimension { place, what: "integrals", expected, found });
        }
    }
    let Some(multipliers) = &trajectory.constraint_multipliers else { return Ok(()) };
    let (expected, found) = (ocp.constraints.len(), multipliers.len());
    if expected != found {
        let place = "multipliers of the endpoint constraints".into();
        return Err(VerifyError::Dimension { place, what: "constraints", expected, found });
    }
    for (constraint, rows) in ocp.constraints.iter().zip(multipliers) {
        let (expected, found) = (constraint.rows.len(), rows.len());
        if expected != found {
            let place = format!("multipliers of constraint `{}`", constraint.name);
            return Err(VerifyError::Dimension { place, what: "rows", expected, found });
        }
    }
    Ok(())
}

fn span(
    phase: &str,
    what: &'static str,
    polynomial: &PiecewisePolynomial,
    found: &PhaseTrajectory,
) -> Result<(), VerifyError> {
    let (initial_time, final_time) = (found.initial_time, found.final_time);
    let breaks = polynomial.breaks();
    let (first, last) = (breaks[0], breaks[breaks.len() - 1]);
    // Times far from zero carry their own rounding.
    let allowed = SPAN_TOLERANCE * (final_time - initial_time) + 4.0 * f64::EPSILON * final_time.abs();
    if (first - initial_time).abs() <= allowed && (last - final_time).abs() <= allowed {
        Ok(())
    } else {
        Err(VerifyError::Span { phase: phase.into(), what, first, last, initial_time, final_time })
    }
}
