//! A file that is begun but not complete: what is missing, and the problem once it is there.
//!
//! The double integrator from rest to rest over 1 m in 1 s with the least effort: the optimum is 6 (u = 6 - 12 t).
#![allow(clippy::print_stdout)]

use apsides_problem_file::{ProblemError, ProblemFile};

const BEGUN: &str = r#"kind = "problem"
[phase.push]
time = { end = 1 }
states.x = { unit = "m", start = 0, end = 1 }
states.v = { unit = "m/s", end = 0 }
controls.u = "m/s2"
dynamics = { x = "v" }
integrals = { effort = "u^2/2" }
"#;

fn read(text: &str) -> Result<ProblemFile, ProblemError> {
    ProblemFile::parse(text, "push.toml", &|_| Err(std::io::ErrorKind::NotFound.into()), &[])
}

fn main() -> Result<(), ProblemError> {
    let Err(ProblemError::Missing { missing, .. }) = read(BEGUN) else { return Ok(()) };
    missing.iter().for_each(|m| println!("missing: {m}"));
    assert_eq!(missing.len(), 3);

    let complete =
        BEGUN.replace("end = 0 }", "start = 0, end = 0 }").replace("x = \"v\" }", "x = \"v\", v = \"u\" }");
    let posed = read(&format!("{complete}[objective]\nminimize = \"effort\"\n"))?.statement().pose(&[])?;
    let objective = &posed.ocp.objective;
    println!("minimise {} in {}", objective.name, objective.unit);
    assert_eq!((objective.name.as_str(), objective.unit.as_str()), ("effort", "m2/s3"));
    assert_eq!(posed.ocp.phases[0].controls[0].unit, "m/s2");
    Ok(())
}
