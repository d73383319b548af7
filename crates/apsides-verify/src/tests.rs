//! Problems with closed-form solutions, exact and perturbed.

mod brachistochrone;
mod constant_controls;
mod contact;
mod end_conditions;
mod features_of_time;
mod kinks_of_states;
mod layers_of_states;
mod linked;
mod malformed;
mod minimum_energy;
mod minimum_time;
mod narrow_wells;
mod non_minima;
mod parts;
mod path;
mod sampled;
mod store;
mod touching_switches;
mod unstable_plant;
mod wells_beside_wide_controls;
mod worth;

use crate::{Certificate, Check, CheckKind, Verdict, VerifySettings, verify};
use apsides_ocp::{Ocp, Trajectory};

/// Discretisation: the part of its limit that a check of an exact solution may need.
const EXACT: f64 = 1e-3;

fn certify(ocp: &Ocp, trajectory: &Trajectory) -> Certificate {
    let certificate =
        verify(ocp, trajectory, &VerifySettings::default()).expect("the trajectory fits").certificate;
    for check in &certificate.checks {
        assert!(check.meaning().is_some(), "no sentence for `{}`", check.name);
    }
    certificate
}

/// The same by the stated costates alone.
fn certify_stated(ocp: &Ocp, trajectory: &Trajectory) -> Certificate {
    let settings = VerifySettings { adjoint: false, ..VerifySettings::default() };
    verify(ocp, trajectory, &settings).expect("the trajectory fits").certificate
}

/// The only check whose name contains `part`.
fn find<'a>(certificate: &'a Certificate, part: &str) -> &'a Check {
    let found: Vec<_> = certificate.checks.iter().filter(|c| c.name.contains(part)).collect();
    assert_eq!(found.len(), 1, "`{part}` in {:#?}", certificate.checks);
    found[0]
}

/// Names of the failed checks.
fn failed(certificate: &Certificate) -> Vec<&str> {
    certificate.checks.iter().filter(|c| !c.passed).map(|c| c.name.as_str()).collect()
}

/// Asserts a verified local optimum with every value far below its limit.
fn assert_exact(certificate: &Certificate) {
    assert!(certificate.verdict >= Verdict::Extremal, "{certificate:#?}");
    for c in &certificate.checks {
        assert!(c.value <= EXACT * c.limit, "{c:#?}");
        assert_eq!(c.margin, c.limit - c.value);
    }
}

/// Asserts that the checks whose names contain these parts fail and no others.
fn assert_failed(certificate: &Certificate, parts: &[&str]) {
    let names = failed(certificate);
    assert_eq!(names.len(), parts.len(), "{names:?}");
    for part in parts {
        assert!(names.iter().any(|n| n.contains(part)), "`{part}` in {names:?}");
    }
    let rejected = certificate.checks.iter().any(|c| !c.passed && c.kind == CheckKind::Feasibility);
    let expected = if rejected { Verdict::Rejected } else { Verdict::Feasible };
    if parts.is_empty() {
        assert!(certificate.is_verified(), "{certificate:#?}");
    } else {
        assert_eq!(certificate.verdict, expected);
    }
}
