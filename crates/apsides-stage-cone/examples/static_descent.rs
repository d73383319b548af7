//! Propellant-optimal fall to a stop without any allocation: how little thrust is needed, in a workspace of fixed size?
//!
//! A vehicle at 100 m, falling at 10 m/s under 1.6 m/s2, has thrust accelerations up to 4 m/s2 in steps of 1 s over 20 s, and must stop at the
//! ground. The sum of accelerations follows from the change of speed: 20 x 1.6 + 10 = 42 m/s whatever the profile.
#![allow(clippy::print_stdout)]

use apsides_stage_cone::{
    Row, Stage, StageError, StageProgram, StageSettings, StageWork, Status, solve_stages,
};

const STEPS: usize = 20;
/// Control `a`, states `h`, `v`.
type Fall = Stage<2, 3, 2>;

fn main() -> Result<(), StageError> {
    let mut stage = Fall::EMPTY;
    stage.cost[0] = 1.0;
    stage.dynamics = [Row::of(&[(1, 1.0), (2, 1.0), (0, 0.5)]), Row::of(&[(2, 1.0), (0, 1.0)])];
    stage.offset = [-0.8, -1.6];
    stage.add_linear(Row::of(&[(0, 1.0)]), 0.0);
    stage.add_linear(Row::of(&[(0, -1.0)]), 4.0);
    let mut stages = [stage; STEPS + 1];
    // The last stage has no control.
    stages[STEPS] = Fall::EMPTY;
    stages[STEPS].controls[0] = false;
    let end = [[1.0, 0.0], [0.0, 1.0]];
    let program = StageProgram { stages: &stages, start: [100.0, -10.0], end, end_values: [0.0, 0.0] };
    let mut work = [StageWork::ZERO; STEPS + 1];
    let report = solve_stages(&program, &mut work, &StageSettings::default())?;
    println!("{:?} after {} iterations: {:.6} m/s", report.status, report.iterations, report.objective);
    println!("{} bytes of workspace", size_of_val(&work));
    assert_eq!(report.status, Status::Solved);
    assert!((report.objective - 42.0).abs() < 1e-6);
    Ok(())
}
