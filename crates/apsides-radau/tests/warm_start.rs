//! Solution, multipliers and barrier parameter of one solve start the next: fewer interior-point iterations than from
//! the problem's own guess, on a refined mesh and with a changed bound.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use apsides_nlp::Status;
use apsides_ocp::{Bounds, Guess, Mesh, Ocp, Trajectory};
use apsides_problems::{Case, find};
use apsides_radau::{Radau, RadauSettings, RadauSolution};

/// One of each kind: landing with one switch, bang-bang, ceiling on a state, path constraint, smooth re-entry.
const PROBLEMS: [&str; 6] = [
    "moon_lander_soft",
    "di_bang_bang",
    "bryson_denham",
    "brachistochrone_wall",
    "shuttle_reentry",
    "linear_tangent",
];

/// Discretisation: objectives from two starts, relative.
const MESH: f64 = 1e-6;

fn pose(name: &str) -> Case {
    find(name).unwrap().pose().unwrap()
}

/// One mesh, no refinement.
fn solve(ocp: &Ocp, guess: &Guess, mesh: &Mesh) -> RadauSolution {
    let method = Radau { settings: RadauSettings { max_refinements: 0, ..RadauSettings::default() } };
    let solution = method.solve_on(ocp, guess, mesh.clone(), &mut ()).unwrap();
    assert_eq!(solution.status, Status::Optimal, "{}", ocp.name);
    solution
}

/// Iterations with the multipliers of all warm starts may be this part of those from the problems' own guesses.
const MOST_OF_COLD: f64 = 0.7;

/// Iterations from the problem's own guess, and with the multipliers of the earlier solution; no more with these.
fn compare(what: &str, ocp: &Ocp, own: &Guess, earlier: &Trajectory, mesh: &Mesh) -> [usize; 2] {
    let mut states = earlier.clone();
    states.phases.iter_mut().for_each(|p| p.costate = None);
    let cold = solve(ocp, own, mesh);
    let primal = solve(ocp, &Guess::earlier(&states), mesh);
    let warm = solve(ocp, &Guess::earlier(earlier), mesh);
    let iterations = |s: &RadauSolution| s.report.counters.iterations;
    let counts = [&cold, &primal, &warm].map(iterations);
    println!(
        "{what:<14} {:<22} cold {:>3}, states alone {:>3}, warm {:>3}",
        ocp.name, counts[0], counts[1], counts[2]
    );
    assert!(counts[2] <= counts[0], "{what}, {}: warm {}, cold {}", ocp.name, counts[2], counts[0]);
    let (a, b) = (cold.trajectory.objective, warm.trajectory.objective);
    assert!((a - b).abs() <= MESH * a.abs().max(1e-3), "{what}, {}: cold {a}, warm {b}", ocp.name);
    [counts[0], counts[2]]
}

/// Fewer iterations of each problem, of which there are so many counts, and far fewer in all.
fn assert_fewer(counts: &[[usize; 2]], of_each: usize) {
    let sums = |counts: &[[usize; 2]]| [0, 1].map(|k| counts.iter().map(|c| c[k]).sum::<usize>());
    for (name, counts) in PROBLEMS.into_iter().zip(counts.chunks(of_each)) {
        let [cold, warm] = sums(counts);
        assert!(warm < cold, "{name}: cold {cold}, warm {warm}");
    }
    let [cold, warm] = sums(counts);
    println!("cold {cold}, warm {warm}");
    assert!(warm as f64 <= MOST_OF_COLD * cold as f64, "cold {cold}, warm {warm}");
}

#[test]
fn refined_meshes() {
    let mut counts = Vec::new();
    for name in PROBLEMS {
        let Case { ocp, guess } = pose(name);
        let coarse = solve(&ocp, &guess, &Mesh::uniform(&ocp, 10, 4).unwrap());
        let fine = Mesh::uniform(&ocp, 20, 4).unwrap();
        counts.push(compare("refined mesh", &ocp, &guess, &coarse.trajectory, &fine));
        let higher = Mesh::uniform(&ocp, 10, 6).unwrap();
        counts.push(compare("more points", &ocp, &guess, &coarse.trajectory, &higher));
    }
    assert_fewer(&counts, 2);
}

#[test]
fn changed_bounds() {
    let change: [fn(&mut Ocp); 6] = [
        |o| o.phases[0].controls[0].bounds.upper *= 1.05,
        |o| o.phases[0].controls[0].bounds = Bounds::new(-1.03, 0.97),
        |o| o.phases[0].states[0].variable.bounds.upper = 0.12,
        |o| o.phases[0].path[0].rows[0].bounds.upper = 0.02,
        |o| o.phases[0].controls[1].bounds.lower = -70.0_f64.to_radians(),
        |o| o.phases[0].states[1].terminal = Bounds::fixed(0.98 * o.phases[0].states[1].terminal.lower),
    ];
    let mut counts = Vec::new();
    for (name, change) in PROBLEMS.into_iter().zip(change) {
        let Case { mut ocp, guess } = pose(name);
        let mesh = Mesh::uniform(&ocp, 20, 4).unwrap();
        let first = solve(&ocp, &guess, &mesh);
        change(&mut ocp);
        counts.push(compare("changed bound", &ocp, &guess, &first.trajectory, &mesh));
    }
    assert_fewer(&counts, 1);
}
