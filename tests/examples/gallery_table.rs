//! Prints a Markdown table: every problem of the gallery solved by Radau collocation with mesh refinement.
//!
//! Names given as arguments restrict the table.
#![allow(clippy::print_stdout)]

use apsides::radau::Radau;
use apsides_problems::GALLERY;
use apsides_tests::solve;

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    println!("# Gallery of benchmark problems\n");
    println!(
        "Radau collocation with mesh refinement. Statements, sources and evidence of the optima are in \
         `apsides-problems`; the settings are the default ones.\n"
    );
    println!(
        "| problem | optimum | found | relative difference | verdict | meshes | points | iterations | ms |"
    );
    println!("| --- | ---: | ---: | ---: | --- | ---: | ---: | ---: | ---: |");
    for problem in GALLERY {
        if !wanted.is_empty() && !wanted.iter().any(|w| w == problem.name) {
            continue;
        }
        match solve(problem, &Radau::default()) {
            Ok(run) => println!("{}", run.table_row()),
            Err(e) => println!("| {} | {} |", problem.name, e),
        }
    }
}
