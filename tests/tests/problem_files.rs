//! The problems of the gallery as files: the same optima as those of the compiled statements, by the same method, in the same iterations.
#![allow(clippy::unwrap_used)]

use apsides::ocp::{Method, Start};
use apsides::radau::Radau;
use apsides_problems::{GALLERY, file};

/// Solver class: the tolerance of the interior-point method on two statements whose operations differ in their order.
const SOLVER: f64 = 1e-8;

/// Files that state the same in other numbers: metres for feet, a guess with other points, an expression that two formulas share.
const OTHERWISE: [&str; 4] = ["brachistochrone_free_y", "brachistochrone_wall", "delta_iii", "hanging_chain"];

/// Problems whose last meshes, or last iteration, are decided by rounding, which the order of operations changes.
const ROUNDED: [&str; 3] = ["catmix_arcs", "min_time_climb", "powered_descent"];

#[test]
fn each_file_has_the_optimum_of_the_compiled_problem() {
    let mut wrong = Vec::new();
    for problem in GALLERY {
        let method = Radau::default();
        let case = problem.pose().unwrap();
        let compiled = Method::solve(&method, &case.ocp, &Start::new(case.guess), &mut ()).unwrap();
        let read = apsides::parse(file(problem.name).unwrap(), problem.name, &[]).unwrap();
        let posed = read.pose().unwrap();
        let found = Method::solve(&method, &posed.ocp, &Start::new(posed.guess), &mut ()).unwrap();
        let (a, b) = (compiled.trajectory.objective, found.trajectory.objective);
        let difference = (b - a) / a.abs();
        if difference.is_nan() || difference.abs() > SOLVER || !found.status.is_success() {
            wrong.push(format!("{}: {b} instead of {a}, {}", problem.name, found.status));
        }
        let (a, b) = (compiled.counters.iterations, found.counters.iterations);
        if a != b && ![&OTHERWISE[..], &ROUNDED].concat().contains(&problem.name) {
            wrong.push(format!("{}: {b} iterations instead of {a}", problem.name));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// A file of the project.
fn read(path: &str) -> String {
    std::fs::read_to_string(format!("{}/../{path}", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

/// The block of a page that begins with a mark.
fn block<'a>(page: &'a str, mark: &str) -> &'a str {
    page.split("```").find_map(|part| part.strip_prefix(mark)).unwrap()
}

#[test]
fn the_page_on_problems_says_what_is_so() {
    let page = read("docs/problems.md");
    let solved =
        apsides::parse(block(&page, "toml\n"), "the page", &[]).unwrap().solve(None, &mut ()).unwrap();
    // Solver class: the closed form of the gallery's `linear_tangent` in other units, and the digits that the page shows.
    assert!((solved.trajectory.objective - 55.457_087_833_460_31).abs() < 100.0 * SOLVER);
    assert!(page.contains("55.4570878 s"));
    assert_eq!(solved.summary.certificate.verdict.to_string(), "strict-local-optimum");
    // Its commands are those that the tests of the program run.
    let run = read("crates/apsides-cli/tests/results.rs");
    for command in block(&page, "sh\n").lines() {
        assert!(run.contains(command), "{command}");
    }
    // Each function and unit is named.
    let words = apsides::missions::problem::function_names().chain(apsides::missions::problem::unit_names());
    for word in words {
        let named = |c: char| !c.is_alphanumeric();
        assert!(page.split(named).any(|w| w == word), "{word}");
    }
}
