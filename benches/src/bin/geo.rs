//! Times injections into geostationary orbit by any method of the missions: one JSON object per line and mission.

use std::io::{Write, stdout};

use apsides::pipeline::key::KeyKind;
use apsides_benches::CpuTime;
use apsides_benches::landing::Failure;
use clap::Parser;
use serde::Serialize;

/// Solves injections into geostationary orbit again and again and prints what it took, one line of JSON for each.
#[derive(Debug, Parser)]
#[command(name = "geo")]
struct Arguments {
    /// Missions.
    #[arg(default_values = ["geo-2-burn", "geo-3-burn", "geo-5-burn"])]
    missions: Vec<String>,
    /// Word of the key `method`.
    #[arg(long, default_value = "radau")]
    method: String,
    /// Other keys of the missions.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Timed repetitions.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    repeat: u32,
    /// Print the words of the key `method` and end.
    #[arg(long)]
    methods: bool,
}

/// Result of all repetitions. Times are in microseconds, one entry per repetition.
#[derive(Serialize)]
struct Line<'a> {
    case: &'a str,
    method: &'a str,
    status: String,
    propellant_kg: f64,
    iterations: usize,
    variables: usize,
    /// From the mission file to its checked values, CPU time.
    load_us: Vec<f64>,
    /// From the values to problem and guess, wall clock.
    build_us: Vec<f64>,
    /// From problem and guess to the trajectory, without expansion and certificate, wall clock.
    solve_us: Vec<f64>,
    /// All of the above with expansion and certificate, CPU time.
    call_us: Vec<f64>,
    /// The mission file with every value written out.
    mission_file: String,
}

fn main() -> Result<(), Failure> {
    let arguments = Arguments::parse();
    if arguments.methods {
        let first = arguments.missions.first().ok_or("no mission")?;
        writeln!(stdout(), "{}", serde_json::to_string(methods(&apsides::load(first, &[])?))?)?;
        return Ok(());
    }
    for case in &arguments.missions {
        writeln!(stdout(), "{}", serde_json::to_string(&timed(&arguments, case)?)?)?;
    }
    Ok(())
}

/// The words of the key `method`.
fn methods(mission: &apsides::Pipeline) -> &'static [&'static str] {
    let words = mission.keys().find(|k| k.path == "method").map(|k| k.kind);
    if let Some(KeyKind::Choice(words)) = words { words } else { &[] }
}

fn timed<'a>(arguments: &'a Arguments, case: &'a str) -> Result<Line<'a>, Failure> {
    let mut overrides = vec![format!("method={}", arguments.method)];
    overrides.extend(arguments.set.iter().cloned());
    let mut line = Line {
        case,
        method: &arguments.method,
        status: String::new(),
        propellant_kg: f64::NAN,
        iterations: 0,
        variables: 0,
        load_us: Vec::new(),
        build_us: Vec::new(),
        solve_us: Vec::new(),
        call_us: Vec::new(),
        mission_file: String::new(),
    };
    for _ in 0..arguments.repeat {
        let clock = CpuTime::start();
        let mission = apsides::load(case, &overrides)?;
        line.load_us.push(1e3 * clock.milliseconds());
        let outcome = mission.solve(None, &mut ())?;
        line.call_us.push(1e3 * clock.milliseconds());
        let summary = outcome.summary;
        line.build_us.push(1e3 * summary.timing_ms.build);
        line.solve_us.push(1e3 * summary.timing_ms.solve);
        line.status = summary.status;
        line.propellant_kg = summary.results.get("propellant_kg").copied().ok_or("no propellant")?;
        line.iterations = summary.counters.iterations;
        line.variables = summary.counters.variables;
        line.mission_file = outcome.mission_file;
    }
    Ok(line)
}
