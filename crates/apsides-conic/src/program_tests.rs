//! Solves, updates, statuses and refusals.

use proptest::prelude::*;

use super::*;

/// Solver: the tolerances at which the iterations stop.
const SOLVER: f64 = 1e-7;

/// `min 1/2 |x|^2 - c.x` subject to `lower <= x <= upper`: the nearest point of a box.
fn box_program(c: &[f64], lower: f64, upper: f64) -> ConicData {
    let n = c.len();
    let (mut quadratic, mut matrix) = (Triplets::default(), Triplets::default());
    for k in 0..n {
        quadratic.push(k, k, 1.0);
        matrix.push(k, k, 1.0);
        matrix.push(n + k, k, -1.0);
    }
    ConicData {
        linear: c.iter().map(|c| -c).collect(),
        quadratic,
        matrix,
        right_hand_side: [vec![upper; n], vec![-lower; n]].concat(),
        cones: vec![Cone::NonNegative(2 * n)],
    }
}

/// Largest distance from the optimum of a point whose objective is within the gap of it, `curvature |x - x*|^2 / 2 <= gap`.
fn distance(report: &ConicReport, curvature: f64) -> f64 {
    let gap = ConicSettings::default().gap_tolerance * (1.0 + report.objective.abs());
    (2.0 * gap / curvature).sqrt()
}

proptest! {
    #[test]
    fn the_nearest_point_of_a_box_is_the_clamped_one(c in prop::collection::vec(-3.0..3.0_f64, 1..6)) {
        let mut program = ConicProgram::new(&box_program(&c, -1.0, 1.0), ConicSettings::default()).unwrap();
        prop_assert_eq!(program.solve(), Status::Solved);
        let report = program.report();
        for (x, c) in program.x().iter().zip(&c) {
            prop_assert!((x - c.clamp(-1.0, 1.0)).abs() < distance(&report, 1.0));
        }
        prop_assert!((report.objective - report.dual_objective).abs() < SOLVER * (1.0 + report.objective.abs()));
        prop_assert!(report.primal_residual < 0.1 * SOLVER && report.dual_residual < 0.1 * SOLVER);
    }

    #[test]
    fn updated_data_give_what_new_data_give(a in prop::collection::vec(-3.0..3.0_f64, 4), b in prop::collection::vec(-3.0..3.0_f64, 4)) {
        let mut old = ConicProgram::new(&box_program(&a, -1.0, 1.0), ConicSettings::default()).unwrap();
        old.solve();
        let mut data = box_program(&b, -0.5, 2.0);
        data.quadratic.values.fill(2.0);
        data.matrix.values.iter_mut().for_each(|v| *v *= 4.0);
        old.set_linear(&data.linear).unwrap();
        old.set_quadratic(&data.quadratic.values).unwrap();
        old.set_matrix(&data.matrix.values).unwrap();
        old.set_right_hand_side(&data.right_hand_side).unwrap();
        prop_assert_eq!(old.report().status, Status::NotSolved);
        prop_assert_eq!(old.solve(), Status::Solved);
        let distance = distance(&old.report(), 2.0);
        for (x, b) in old.x().iter().zip(&b) {
            prop_assert!((x - (0.5 * b).clamp(-0.125, 0.5)).abs() < distance);
        }
    }
}

#[test]
fn entries_of_one_place_add_up_and_zeros_keep_their_place() {
    let mut data = box_program(&[3.0], -1.0, 1.0);
    data.quadratic.push(0, 0, 0.0);
    data.quadratic.push(0, 0, 5.0);
    let mut program = ConicProgram::new(&data, ConicSettings::default()).unwrap();
    program.solve();
    assert!((program.x()[0] - 0.5).abs() < SOLVER);
    program.set_quadratic(&[1.0, 3.0, 0.0]).unwrap();
    program.solve();
    assert!((program.x()[0] - 0.75).abs() < SOLVER);
}

#[test]
fn programs_without_a_solution_have_a_status() {
    // x <= 1 and x >= 2.
    let mut program = ConicProgram::new(&box_program(&[0.0], 2.0, 1.0), ConicSettings::default()).unwrap();
    assert_eq!(program.solve(), Status::Infeasible);
    assert!(!Status::Infeasible.has_solution());
    let mut free = box_program(&[1.0], -1.0, 1.0);
    free.quadratic.values.fill(0.0);
    free.matrix.values.fill(0.0);
    assert_eq!(ConicProgram::new(&free, ConicSettings::default()).unwrap().solve(), Status::Unbounded);
    let few = ConicSettings { max_iterations: 1, ..ConicSettings::default() };
    let data = box_program(&[2.0, 0.3], -1.0, 1.0);
    assert_eq!(ConicProgram::new(&data, few).unwrap().solve(), Status::IterationLimit);
}

#[test]
fn multipliers_are_those_of_the_rows() {
    // min x^2/2 - 3x with x <= 1: x - 3 + z = 0, z = 2.
    let mut program = ConicProgram::new(&box_program(&[3.0], -1.0, 1.0), ConicSettings::default()).unwrap();
    program.solve();
    assert!((program.dual()[0] - 2.0).abs() < 10.0 * SOLVER && program.dual()[1].abs() < 10.0 * SOLVER);
    assert!(program.slack()[0].abs() < 10.0 * SOLVER && (program.slack()[1] - 2.0).abs() < 10.0 * SOLVER);
}

fn refusal(change: impl FnOnce(&mut ConicData)) -> String {
    let mut data = box_program(&[1.0, 2.0], -1.0, 1.0);
    change(&mut data);
    ConicProgram::new(&data, ConicSettings::default()).unwrap_err().to_string()
}

#[test]
fn ill_posed_data_are_refused_by_name() {
    assert!(refusal(|d| d.linear.clear()).contains("no variable"));
    assert!(refusal(|d| d.linear[1] = f64::NAN).contains("linear term: number 1 is NaN"));
    assert!(refusal(|d| d.right_hand_side[0] = f64::INFINITY).contains("right-hand side: number 0 is inf"));
    assert!(refusal(|d| d.right_hand_side.truncate(3)).contains("length 3, expected 4"));
    assert!(refusal(|d| d.cones.push(Cone::Zero(0))).contains("cone 1: 0 components"));
    assert!(refusal(|d| d.cones.push(Cone::SecondOrder(1))).contains("cone 1: 1 components"));
    assert!(refusal(|d| d.matrix.push(4, 0, 1.0)).contains("entry 4 at (4, 0) lies outside 4 x 2"));
    assert!(refusal(|d| d.matrix.rows.truncate(1)).contains("matrix: length 1, expected 4"));
    assert!(refusal(|d| d.quadratic.push(1, 0, 1.0)).contains("entry 2 at (1, 0) is below the diagonal"));
    let data = box_program(&[1.0], -1.0, 1.0);
    for settings in [
        ConicSettings { gap_tolerance: f64::NAN, ..ConicSettings::default() },
        ConicSettings { feasibility_tolerance: 0.0, ..ConicSettings::default() },
        ConicSettings { max_iterations: 0, ..ConicSettings::default() },
    ] {
        assert!(matches!(ConicProgram::new(&data, settings), Err(ConicError::Setting { .. })));
    }
}

#[test]
fn refused_updates_leave_the_program_as_it_was() {
    let mut program = ConicProgram::new(&box_program(&[0.5], -1.0, 1.0), ConicSettings::default()).unwrap();
    assert!(program.set_linear(&[f64::NAN]).is_err());
    assert!(program.set_matrix(&[1.0]).is_err());
    assert!(program.set_quadratic(&[f64::INFINITY]).is_err());
    assert!(program.set_right_hand_side(&[]).is_err());
    assert_eq!(program.solve(), Status::Solved);
    assert!((program.x()[0] - 0.5).abs() < SOLVER);
}
