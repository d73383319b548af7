//! The optimality of a trajectory with piecewise-constant controls among all controls of that kind.
//!
//! Zero-order holds, as of control parameterisation, convex guidance or a digital autopilot, do not minimise the Hamiltonian between
//! their steps. They may still be the best controls that are constant on their intervals: the solution of a nonlinear program in the
//! constants, to which the first- and second-order conditions of this module belong.

use apsides_ocp::{Ocp, PiecewisePolynomial, Scaling, Trajectory};

use crate::certificate::Claim;
use crate::optimality::{self, Among, Lengths};
use crate::{Certificate, Check, CheckKind, VerifySettings, second_order};

/// Values of a control over an interval that differ by less, relative to the largest one along the phase, are one.
const SAME: f64 = 1e-12;

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
    if !may_be_free {
        return among(Lengths::Given);
    }
    among(Lengths::Free).or_else(|_| among(Lengths::Given))
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
    let mut checks = optimality::checks(ocp, trajectory, scaling, settings, &mut conditions);
    if checks.iter().all(|c| c.passed) {
        checks.extend(second_order::conditions(ocp, trajectory, scaling, settings, &mut conditions).checks);
    }
    // Feasibility is that of the certificate.
    let feasible = Check::new("feasible", CheckKind::Feasibility, 0.0, 0.0, "-", "");
    let verdict = Certificate::new(std::iter::once(feasible).chain(checks.clone()).collect()).verdict;
    match checks.iter().find(|c| !c.passed) {
        Some(c) => {
            let Check { name, value, limit, at, .. } = c;
            Err(Some(format!("no optimum among {among}: {name} {value:.1e} above {limit:.0e}, {at}")))
        }
        None => Ok(Claim { among, verdict, checks }),
    }
}

fn words(trajectory: &Trajectory, lengths: Lengths) -> String {
    let controlled = trajectory.phases.iter().filter(|p| p.control.dimension() > 0);
    let count: usize = controlled.map(|p| p.control.segments().len()).sum();
    let of = match lengths {
        Lengths::Free => "intervals of any lengths",
        Lengths::Given => "intervals that are given parts of their phases",
    };
    format!("controls constant on each of {count} {of}")
}
