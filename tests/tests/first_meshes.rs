//! The answers of the gallery do not hang on the mesh that a solve begins with.

use apsides::nlp::Status;
use apsides::radau::Radau;
use apsides::verify::{Verdict, VerifySettings, verify};
use apsides_problems::GALLERY;

/// Intervals and points of the first mesh: coarse in time, in the order of the polynomials, and fine in both.
const MESHES: [(usize, usize); 5] = [(5, 3), (5, 5), (8, 3), (15, 5), (20, 4)];

/// Its four thrusters have switches and singular arcs next to each other, which this mesh does not tell apart.
const NOT_TOLD_APART: (&str, (usize, usize)) = ("free_flying_robot", (15, 5));

#[test]
fn optima_are_certified_from_coarse_and_fine_meshes() {
    let mut failures = Vec::new();
    for problem in GALLERY {
        let case = problem.pose().unwrap();
        for (intervals, points) in MESHES.into_iter().filter(|m| (problem.name, *m) != NOT_TOLD_APART) {
            let mut method = Radau::default();
            (method.settings.intervals, method.settings.points) = (intervals, points);
            let solution = method.solve(&case.ocp, &case.guess).unwrap();
            let verification = verify(&case.ocp, &solution.trajectory, &VerifySettings::default()).unwrap();
            let verdict = verification.certificate.verdict;
            let objective = solution.trajectory.objective;
            let is_solved = solution.status == Status::Optimal && solution.accurate;
            if !(is_solved && verdict >= Verdict::Extremal && problem.optimum.agrees_with(objective)) {
                failures.push(format!(
                    "{} from {intervals} x {points}: {}, {verdict:?}, objective {objective}",
                    problem.name, solution.status
                ));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
