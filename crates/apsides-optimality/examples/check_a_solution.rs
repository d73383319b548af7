//! A reported solution is held against the conditions of Karush, Kuhn and Tucker, and so is one that was changed.
#![allow(clippy::print_stdout)]

use apsides_nlp::{InteriorPoint, NlpError, NlpSettings};
use apsides_optimality::{Condition, violated};
use apsides_problems::nlp::hock_schittkowski::collection;

fn main() -> Result<(), NlpError> {
    let settings = NlpSettings::default();
    for mut program in collection().into_iter().filter(|p| [35, 43, 71].contains(&p.number)) {
        let mut report = InteriorPoint::new(settings.clone()).solve(&mut program)?;
        println!("problem {}: {} with {:.9}", program.number, report.status, report.objective);
        assert_eq!(violated(&mut program, &report, &settings), None);
        report.x[0] += 1e-2;
        let error = violated(&mut program, &report, &settings);
        println!("  after a change: {}", error.map(|e| e.to_string()).unwrap_or_default());
        assert!(error.is_some_and(|e| e.condition != Condition::Sign));
    }
    Ok(())
}
