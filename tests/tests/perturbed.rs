//! Perturbed problems of the gallery that were refused once: each case is proved now, and on few meshes. The example `perturbed` runs more of them.
#![allow(clippy::unwrap_used)]

use apsides::radau::Radau;
use apsides::verify::{Verdict, VerifySettings, verify};
use apsides_problems::GALLERY;
use apsides_tests::perturbation::{perturb, why_unsolvable};

/// Solves cases of a problem: each has a verdict at least, on as many meshes at most.
fn are_proved(name: &str, cases: &[u64], least: Verdict, most_meshes: usize) {
    let problem = GALLERY.iter().find(|p| p.name == name).unwrap();
    for &case in cases {
        let mut posed = problem.pose().unwrap();
        perturb(&mut posed.ocp, case);
        let solution = Radau::default().solve(&posed.ocp, &posed.guess).unwrap();
        assert!(solution.status.is_success(), "{name} {case}: {}", solution.status);
        let certificate =
            verify(&posed.ocp, &solution.trajectory, &VerifySettings::default()).unwrap().certificate;
        assert!(certificate.verdict >= least, "{name} {case}: {}", certificate.verdict);
        let meshes = solution.meshes.len();
        assert!(meshes <= most_meshes, "{name} {case}: {meshes} meshes");
    }
}

/// A component of the thrust and its length are at their limits at once, and the length leaves its own without a jump; the corner lasts less than an
/// interval in the last case.
#[test]
fn corners_of_limits_of_controls() {
    are_proved("powered_descent", &[0, 11, 18], Verdict::StrictLocalOptimum, 11);
}

/// The costates before an arc along the wall, and at the start, where the bound of a state is close and not active.
#[test]
fn costates_beside_arcs_and_bounds() {
    are_proved("brachistochrone_wall", &[2, 20, 26], Verdict::StrictLocalOptimum, 5);
}

/// A climb that begins along the ground, with tables: the arc ends as exactly as the costates say.
#[test]
fn junctions_between_joints_of_tables() {
    are_proved("min_time_climb", &[0, 6, 13], Verdict::StrictLocalOptimum, 12);
}

/// Kinks that stand in their places while what is beside them is rounding.
#[test]
fn kinks_that_stay() {
    are_proved("van_der_pol", &[1, 22], Verdict::StrictLocalOptimum, 8);
}

/// Kinks on their way when the structure may change no more.
#[test]
fn kinks_on_their_way() {
    are_proved("shuttle_heat_limit", &[1, 21, 27], Verdict::StrictLocalOptimum, 14);
}

/// A switch whose function has another zero close by, to which the mesh puts it and from which it comes back: a singular arc between both.
#[test]
fn singular_arcs_between_two_zeros() {
    are_proved("free_flying_robot", &[0, 5, 16], Verdict::Extremal, 12);
}

/// An accurate solution on a mesh with breaks is not lost where the next breaks lead nowhere, and meshes without any come to no accurate one.
#[test]
fn accurate_solutions_are_kept() {
    are_proved("free_flying_robot", &[6, 24], Verdict::Feasible, 12);
}

/// Cases that are not solved have no solution, by a relaxation or their start, and only these.
#[test]
fn what_is_not_solved_has_no_solution() {
    // A launcher that is not solved takes most of a minute on one core: four cases hold one of each reason.
    for (name, cases) in [("powered_descent", 9), ("powered_descent_glide_slope", 9), ("delta_iii", 4)] {
        let problem = GALLERY.iter().find(|p| p.name == name).unwrap();
        let mut unsolved = 0;
        for case in 0..cases {
            let mut posed = problem.pose().unwrap();
            perturb(&mut posed.ocp, case);
            let solution = Radau::default().solve(&posed.ocp, &posed.guess).unwrap();
            let reason = why_unsolvable(name, &posed.ocp, &posed.guess).unwrap();
            assert_eq!(solution.status.is_success(), reason.is_none(), "{name} {case}: {reason:?}");
            unsolved += u64::from(reason.is_some());
        }
        assert!((1..cases).contains(&unsolved), "{name}: {unsolved}");
    }
}
