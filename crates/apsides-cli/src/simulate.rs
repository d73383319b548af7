//! `apsides simulate`.

use std::fmt::Write as _;

use apsides::pipeline::simulation::SimulationSummary;
use apsides_report::{curve_figures, write_simulation};

use crate::arguments::SimulateArguments;
use crate::commands::{claim, probe_directory};
use crate::ephemeris::files;
use crate::exit::{Exit, Refusal, refusal};
use crate::output::{number, print, print_json, print_words, say, written};
use crate::progress::Progress;
use crate::speech::{is_json, is_verbose, warned};

pub(crate) fn simulate(a: &SimulateArguments) -> Result<Exit, Refusal> {
    let stop = a.limit.stop();
    let mission = a.mission.load()?.with_seed(a.seed).with_cancellation(stop.cancellation());
    if let Some(dir) = &a.out {
        probe_directory(dir)?;
    }
    let _lock = a.out.as_deref().map(claim).transpose()?;
    let ephemeris = a.ephemeris.asked(&mission, a.out.as_deref())?;
    let progress = Progress::clock(stop);
    let clock = progress.clone();
    let watch = move |time: f64| {
        clock.tell(|| format!("{time:.1} s of flight"));
        !stop.is_set()
    };
    let flight = mission.simulate_watched(&mut progress.clone(), &watch).map_err(refusal)?;
    progress.finish();
    let mut exit = if flight.summary.status == "completed" { Exit::Verified } else { Exit::NotSolved };
    if is_json() {
        print_json(&flight.summary)?;
    } else {
        print_words(&text(&flight.summary));
    }
    if let Some(dir) = &a.out {
        let further = ephemeris.as_ref().map(|(sampling, formats)| {
            let table = mission.ephemeris_of_record(&flight.headers(), &flight.rows, *sampling);
            files(&table.map_err(refusal)?, formats)
        });
        let (further, refused) = match further.transpose() {
            Ok(further) => (further.unwrap_or_default(), None),
            Err(refused) => (Vec::new(), Some(refused)),
        };
        let files = write_simulation(dir, &flight, &curve_figures(&flight.curves), further)?;
        if !is_json() {
            print(&written(&files));
        }
        if let Some(Refusal { exit: worse, sentence }) = refused {
            say(&format!("the flight is written, its ephemeris is not: {sentence}"));
            exit = exit.or(worse);
        }
    }
    Ok(exit)
}

fn text(s: &SimulationSummary) -> String {
    let mut text = format!("mission {} under {}: {}\n", s.mission, s.law, s.status);
    let _ = writeln!(text, "{}, at {:.3} s", s.ending, s.end_time_s);
    for warning in &s.warnings {
        text += &format!("{} {warning}\n", warned("warning:"));
    }
    text.push('\n');
    let width = s.results.keys().map(String::len).max().unwrap_or(0);
    for (key, value) in &s.results {
        let _ = writeln!(text, "  {key:<width$}  {:>14}", number(*value));
    }
    if !s.margins.is_empty() {
        let _ = writeln!(
            text,
            "\nmargins of the linear loop, the least of both angles\n  {:>9}  {:>8}  {:<8}  {:>9}  {:>9}  {:>9}  {:>12}",
            "height km", "q kPa", "loop", "gain", "phase deg", "delay s", "crossover Hz"
        );
    }
    for m in &s.margins {
        let cell = |v: Option<f64>| v.map_or_else(|| "-".into(), number);
        let _ = writeln!(
            text,
            "  {:>9.1}  {:>8.4}  {:<8}  {:>9}  {:>9}  {:>9}  {:>12}",
            m.altitude_km,
            m.dynamic_pressure_kpa,
            if m.stable { "stable" } else { "unstable" },
            cell(m.gain),
            cell(m.phase_deg),
            cell(m.delay_s),
            cell(m.crossover_hz)
        );
    }
    if is_verbose() {
        let _ = writeln!(text, "\n{:.1} ms", s.time_ms);
    }
    text
}
