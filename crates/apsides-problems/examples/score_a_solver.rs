//! A solver against the collection of Hock and Schittkowski, and what the gallery of optimal control has to offer.
#![allow(clippy::print_stdout)]

use apsides_nlp::{InteriorPoint, NlpError, Status};
use apsides_problems::nlp::hock_schittkowski::collection;
use apsides_problems::{GALLERY, Structure};

fn main() -> Result<(), NlpError> {
    let (mut solved, mut total) = (0, 0);
    for mut program in collection() {
        let report = InteriorPoint::default().solve(&mut program)?;
        total += 1;
        if report.status == Status::Optimal && program.agrees_with(report.objective) {
            solved += 1;
        } else {
            println!("problem {}: {} with {:.8}", program.number, report.status, report.objective);
        }
    }
    println!("{solved} of {total} solved to the published optimum");
    // Where it is not, another local minimum is found.
    assert!(solved * 100 >= total * 90);

    let bang_bang = GALLERY.iter().filter(|p| p.structure == Structure::BangBang);
    for problem in bang_bang {
        println!("{}: {} {}, {}", problem.name, problem.optimum.value, problem.optimum.unit, problem.title);
    }
    Ok(())
}
