//! The discretised problem: a sparse nonlinear program.
//!
//! Between the nodes of a phase the state follows from the node before by Runge-Kutta steps, the discrete map `phi`, and
//!
//! ```text
//! x_{k+1} - phi(x_k, c_k, p, t0, tf) = 0
//! ```
//!
//! Path constraints hold at their points, with the state of the steps there. All derivatives are those of the discrete map.

use apsides_ocp::{Guess, Ocp, OcpError};
use apsides_ode::Method;
use apsides_transcription::{Discretisation, StartingPoint, Workers, write_next};

use super::layout::{ShootingLayout, ShootingPhase, shooting_layout};
use super::plan::PhasePlan;
use super::settings::MultipleShootingSettings;
use super::shot::{Share, Shot};
use crate::error::ShootingError;

/// The quantities that are known of the shots.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
enum Known {
    Nothing,
    Values,
    Derivatives,
}

/// A problem with its segments, as a nonlinear program that [`apsides_nlp::InteriorPoint`] or any other solver can take.
///
/// The structure is found once; evaluations write into the caller's slices and, on one thread, allocate nothing.
pub(crate) type Transcription = apsides_transcription::Transcription<Shots>;

/// The segments of all phases in order, integrated at one point.
pub(crate) struct Shots {
    pub(crate) all: Vec<Shot>,
    /// Point of the last evaluation, and how far it went.
    evaluated_at: Vec<f64>,
    known: Known,
    workers: Workers,
}

/// Discretises a problem.
///
/// # Errors
/// When plans or guess do not fit the problem.
pub(crate) fn transcribe(
    ocp: &Ocp,
    plans: &[PhasePlan],
    guess: &Guess,
    settings: &MultipleShootingSettings,
) -> Result<Transcription, ShootingError> {
    let (layout, shots) = place(ocp, plans, guess, settings)?;
    Ok(Transcription::assemble(ocp, guess, layout, shots, StartingPoint::BetweenBounds))
}

/// The places of a problem and its segments, which know nothing yet.
///
/// # Errors
/// As [`transcribe`].
pub(crate) fn place(
    ocp: &Ocp,
    plans: &[PhasePlan],
    guess: &Guess,
    settings: &MultipleShootingSettings,
) -> Result<(ShootingLayout, Shots), ShootingError> {
    guess.check(ocp)?;
    if plans.len() != ocp.phases.len() {
        let place = format!("mesh of problem `{}`", ocp.name);
        let (expected, found) = (ocp.phases.len(), plans.len());
        return Err(OcpError::Dimension { place, what: "phases", expected, found }.into());
    }
    let layout = shooting_layout(ocp, plans, settings)?;
    let shots = Shots {
        all: shots(ocp, &layout, settings.method)?,
        evaluated_at: vec![f64::NAN; layout.variables],
        known: Known::Nothing,
        workers: Workers::default(),
    };
    Ok((layout, shots))
}

impl Shots {
    /// Makes all that is needed known at `x`; false when it was already.
    fn evaluate(&mut self, x: &[f64], needed: Known) -> bool {
        if self.evaluated_at == x && self.known >= needed {
            return false;
        }
        if needed == Known::Derivatives {
            self.workers.each(&mut self.all, |s| s.differentiate(x));
        } else {
            self.workers.each(&mut self.all, |s| s.run(x));
        }
        self.evaluated_at.copy_from_slice(x);
        self.known = needed;
        true
    }
}

impl Discretisation for Shots {
    type Phase = ShootingPhase;

    fn share(&mut self, workers: &Workers) {
        self.workers = workers.clone();
    }

    fn add_patterns(&mut self, jacobian: &mut Vec<(usize, usize)>, hessian: &mut Vec<(usize, usize)>) {
        for s in &self.all {
            s.each_jacobian(|r, c, _| jacobian.push((r, c)));
            s.each_hessian(|i, j, _| hessian.push((i, j)));
        }
    }

    fn run(&mut self, x: &[f64]) {
        self.evaluate(x, Known::Values);
    }

    fn refresh(&mut self, x: &[f64]) -> bool {
        self.evaluate(x, Known::Derivatives)
    }

    fn cost(&mut self, _x: &[f64]) -> f64 {
        self.all.iter().map(Shot::cost).sum()
    }

    fn add_gradient(&self, _x: &[f64], gradient: &mut [f64]) {
        for s in &self.all {
            s.add_gradient(gradient);
        }
    }

    fn add_values(&mut self, x: &[f64], rows: &mut [f64]) {
        for s in &self.all {
            s.add_values(x, rows);
        }
    }

    fn fill_jacobian(&mut self, _x: &[f64], entries: &mut [f64]) {
        let mut next = entries.iter_mut();
        for s in &self.all {
            s.each_jacobian(|_, _, v| write_next(&mut next, v));
        }
    }

    fn fill_hessian(&mut self, _x: &[f64], cost: f64, multipliers: &[f64], entries: &mut [f64]) {
        self.workers.each(&mut self.all, |s| s.evaluate_hessian(cost, multipliers));
        let mut next = entries.iter_mut();
        for s in &self.all {
            s.each_hessian(|_, _, v| write_next(&mut next, v));
        }
    }
}

fn shots(ocp: &Ocp, layout: &ShootingLayout, method: Method) -> Result<Vec<Shot>, ShootingError> {
    let sign = ocp.objective.sense.sign();
    let mut shots = Vec::new();
    for (index, (phase, p)) in ocp.phases.iter().zip(&layout.phases).enumerate() {
        let weight = |integral: usize| sign * ocp.objective.integral_weight(index, integral);
        let shares = p.ends.integral_rows.iter().enumerate();
        let shares: Vec<Share> = shares
            .map(|(integral, &row)| Share { integral, row, cost: weight(integral) })
            .filter(|s| s.row.is_some() || s.cost != 0.0)
            .collect();
        for k in 0..p.segments.len() {
            shots.push(Shot::new(phase, p, k, layout, &shares, method)?);
        }
    }
    Ok(shots)
}

#[cfg(test)]
mod tests;
