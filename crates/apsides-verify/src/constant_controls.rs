//! The optimality of a trajectory with piecewise-constant controls among all controls of that kind.
//!
//! Zero-order holds, as of control parameterisation, convex guidance or a digital autopilot, do not minimise the Hamiltonian between
//! their steps. They may still be the best controls that are constant on their intervals: the solution of a nonlinear program in the
//! constants, to which the first- and second-order conditions of this module belong. Another value of a constant, however far, is a control of that
//! kind too: none may have a smaller mean of the Hamiltonian over its interval.

use apsides_basis::Gauss;
use apsides_ocp::{Ocp, PiecewisePolynomial, Scaling, Trajectory};

use crate::certificate::Claim;
use crate::optimality::{self, Among, Lengths, PhaseConditions};
use crate::place::place;
use crate::worst::{Worst, relative};
use crate::{Certificate, Check, CheckKind, VerifySettings, second_order};

/// Values of a control over an interval that differ by less, relative to the largest one along the phase, are one.
const SAME: f64 = 1e-12;

/// Points at which the mean of the Hamiltonian over an interval is taken.
const POINTS: usize = 8;

/// Most intervals of a phase whose lengths are looked at as unknowns: the second variation takes the cube of their number for each of them.
const MOST_FREE: usize = 60;

/// Returns true if every control of a trajectory keeps one value over each of its intervals.
pub(crate) fn has_only(trajectory: &Trajectory) -> bool {
    let steps = |control: &PiecewisePolynomial| {
        let nu = control.dimension();
        let values = control.segments().iter().flat_map(|s| &s.values);
        let largest = values.fold(0.0, |m: f64, v| m.max(v.abs()));
        let is_constant = |values: &[f64]| {
            let first = &values[..nu.min(values.len())];
            values.iter().zip(first.iter().cycle()).all(|(v, f)| (v - f).abs() <= SAME * largest)
        };
        control.segments().iter().all(|s| is_constant(&s.values))
    };
    trajectory.phases.iter().all(|p| steps(&p.control))
        && trajectory.phases.iter().any(|p| p.control.dimension() > 0)
}

/// The strongest claim among constant controls on intervals of any lengths, else of the lengths at hand, or in one sentence what it fails by.
pub(crate) fn claim(
    ocp: &Ocp,
    trajectory: &Trajectory,
    scaling: &Scaling,
    settings: &VerifySettings,
) -> Result<Claim, Option<String>> {
    let among = |lengths| claim_among(ocp, trajectory, scaling, settings, lengths);
    let may_be_free = trajectory.phases.iter().all(|p| p.control.segments().len() <= MOST_FREE);
    let claim = match may_be_free {
        true => among(Lengths::Free).or_else(|_| among(Lengths::Given))?,
        false => among(Lengths::Given)?,
    };
    match better_constant(ocp, trajectory, scaling, settings) {
        Some(better) => Err(Some(failure(trajectory, &better))),
        None => Ok(claim),
    }
}

fn claim_among(
    ocp: &Ocp,
    trajectory: &Trajectory,
    scaling: &Scaling,
    settings: &VerifySettings,
    lengths: Lengths,
) -> Result<Claim, Option<String>> {
    let among = words(trajectory, lengths);
    let Some(mut conditions) = optimality::phases(ocp, trajectory, scaling, Among::Constant(lengths)) else {
        return Err(None);
    };
    if let Some(at) = conditions.iter_mut().find_map(second_order::jump_on_the_way) {
        let why = "costates and integrals jump with the functions that the flight comes to a jump of";
        return Err(Some(format!("nothing is known among {}: {why}, {at}", kind(trajectory))));
    }
    let mut checks = optimality::checks(ocp, trajectory, scaling, settings, &mut conditions);
    if checks.iter().all(|c| c.passed) {
        checks.extend(second_order::conditions(ocp, trajectory, scaling, settings, &mut conditions).checks);
    }
    // Feasibility is that of the certificate.
    let feasible = Check::new("feasible", CheckKind::Feasibility, 0.0, 0.0, "-", "");
    let verdict = Certificate::new(std::iter::once(feasible).chain(checks.clone()).collect()).verdict;
    match checks.iter().find(|c| !c.passed) {
        Some(c) => Err(Some(failure(trajectory, c))),
        None => Ok(Claim { among, verdict, checks }),
    }
}

/// The sentence on a condition that fails: an optimum among intervals of any lengths is one among those of the lengths at hand, so that it
/// holds for both.
fn failure(trajectory: &Trajectory, check: &Check) -> String {
    let Check { name, value, limit, at, .. } = check;
    let among = kind(trajectory);
    format!("no optimum among {among}, of these lengths or any: {name} {value:.1e} above {limit:.0e}, {at}")
}

/// The check of the mean Hamiltonian over an interval against other values of its constants, where it fails. The other values are the
/// controls of the least Hamiltonian at the times of the interval that are admissible all along it.
fn better_constant(
    ocp: &Ocp,
    trajectory: &Trajectory,
    scaling: &Scaling,
    settings: &VerifySettings,
) -> Option<Check> {
    let better = optimality::with_least_hamiltonian(ocp, trajectory, settings).ok().flatten()?;
    let mut conditions = optimality::phases(ocp, trajectory, scaling, Among::All)?;
    let rule = Gauss::shared(POINTS).ok()?;
    let mut worst = Worst::default();
    for (phase, better) in conditions.iter_mut().zip(&better.phases) {
        let nu = phase.equations.nu.max(1);
        for (interval, piece) in better.control.segments().iter().enumerate() {
            let mut values: Vec<&[f64]> = piece.values.chunks(nu).collect();
            values.dedup();
            for value in values {
                let Some(gain) = phase.mean_gain(interval, value, &rule, settings) else { continue };
                let at = || {
                    let start = place(phase.equations.phase, phase.found.control.breaks()[interval]);
                    let named = phase.equations.phase.controls.iter().zip(value);
                    let words: Vec<String> = named.map(|(c, v)| format!("{} {v:.6}", c.name)).collect();
                    format!("interval from {start}; smaller with {}", words.join(", "))
                };
                worst.consider(gain, settings.minimum_tolerance, "-", at);
            }
        }
    }
    worst
        .into_check("mean Hamiltonian above that of another constant", CheckKind::Optimality)
        .filter(|c| !c.passed)
}

impl PhaseConditions<'_> {
    /// The fall of the mean Hamiltonian over an interval by another constant control, relative to its largest term; none where
    /// path constraints exclude that.
    fn mean_gain(
        &mut self,
        interval: usize,
        control: &[f64],
        rule: &Gauss,
        settings: &VerifySettings,
    ) -> Option<f64> {
        let breaks = self.found.control.breaks();
        let (start, half) = (breaks[interval], 0.5 * (breaks[interval + 1] - breaks[interval]));
        let mut rows = vec![0.0; self.point.multipliers.len()];
        let mut gain = 0.0;
        for (tau, weight) in rule.nodes().iter().zip(rule.weights()) {
            let time = start + half * (tau + 1.0);
            let own = self.evaluate_within_bounds(interval, time).value;
            self.equations.set(self.point.time, &self.point.x, control);
            self.equations.path(&mut rows);
            let stated = self.equations.phase.path.iter().flat_map(|c| &c.rows);
            let excess = |((row, value), scale): ((&apsides_ocp::Variable, &f64), &f64)| {
                row.bounds.excess(*value) / scale
            };
            if stated.zip(&rows).zip(&self.scaling.path).map(excess).any(|e| e > settings.activity_tolerance)
            {
                return None;
            }
            gain += 0.5 * weight * (own - self.equations.hamiltonian(&self.point.costate));
        }
        Some(relative(gain, self.hamiltonian_size))
    }
}

fn words(trajectory: &Trajectory, lengths: Lengths) -> String {
    let of = match lengths {
        Lengths::Free => "of any lengths",
        Lengths::Given => "that are given parts of their phases",
    };
    format!("{} {of}", kind(trajectory))
}

fn kind(trajectory: &Trajectory) -> String {
    let controlled = trajectory.phases.iter().filter(|p| p.control.dimension() > 0);
    let count: usize = controlled.map(|p| p.control.segments().len()).sum();
    format!("controls constant on each of {count} intervals")
}
