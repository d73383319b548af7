//! `apsides montecarlo`.

use std::fmt::Write as _;

use apsides::dispersion::Deviations;
use apsides::montecarlo::{Ellipse, Guidance, MonteCarlo, Onboard, Replanning, Statistics};
use apsides_report::{SampleFile, write_statistics};

use crate::arguments::{GuidanceWord, MonteCarloArguments, SampleFormat};
use crate::commands::{Refusal, refusal};
use crate::output::{Exit, print, written};
use crate::progress::{Progress, StopFlag};

pub(crate) fn montecarlo(a: &MonteCarloArguments) -> Result<Exit, Refusal> {
    let mission = a.mission.load()?.with_threads(a.run.threads as usize).with_seed(a.run.seed);
    let run = MonteCarlo {
        samples: a.samples as usize,
        seed: a.run.seed,
        threads: a.run.threads as usize,
        dispersions: Deviations {
            position_m: [a.position; 3],
            velocity_m_s: [a.velocity; 3],
            thrust: a.thrust / 100.0,
            exhaust_velocity: a.exhaust_velocity / 100.0,
            mass_kg: a.mass,
            navigation_position_m: [a.navigation_position; 3],
            navigation_velocity_m_s: [a.navigation_velocity; 3],
        },
        guidance: guidance(a)?,
        onboard: Onboard { engine_known: !a.engine_unknown, full_thrust_n: a.full_thrust },
    };
    let columns = MonteCarlo::columns(&mission);
    if a.format == SampleFormat::Parquet && !cfg!(feature = "parquet") {
        return Err("this program is built without Parquet: build it with `--features parquet`".into());
    }
    let stop = StopFlag::install();
    let plan = mission.solve(None, &mut Progress::table(true, stop.clone())).map_err(refusal)?;
    if !plan.status.is_success() {
        return Err(format!("the mission itself is not solved ({}): no plan to deviate from", plan.status));
    }
    let (mut file, done) = match &a.out {
        Some(dir) => {
            let (file, done) = SampleFile::open(dir, &run, columns, &plan.mission_file).map_err(refusal)?;
            (Some(file), done)
        }
        None => (None, Vec::new()),
    };
    let first = done.len();
    let progress =
        Progress::counted(a.run.quiet, stop.clone(), run.samples.saturating_sub(first) as u64, "flights");
    let mut failure = None;
    let (samples, statistics) = run
        .run(&mission, &plan, done, |sample| {
            progress.step();
            if let Some(file) = &mut file
                && let Err(e) = file.add(sample)
            {
                failure = Some(refusal(e));
            }
            failure.is_none() && !stop.is_set()
        })
        .map_err(refusal)?;
    if let Some(e) = failure {
        return Err(e);
    }
    let mut files = Vec::new();
    if let (Some(dir), Some(file)) = (&a.out, file) {
        files.push(file.finish().map_err(refusal)?);
        #[cfg(feature = "parquet")]
        if a.format == SampleFormat::Parquet {
            files.push(apsides_report::write_parquet(dir, &samples, columns).map_err(refusal)?);
        }
        let title = format!("{}: ends of {} flights", a.mission.mission, samples.len());
        files.extend(write_statistics(dir, &title, &samples, columns, &statistics).map_err(refusal)?);
    }
    if a.json {
        let text = serde_json::to_string_pretty(&statistics).map_err(refusal)?;
        print(&format!("{text}\n"));
    } else {
        print(&text(&a.mission.mission, &statistics, first));
        if !files.is_empty() {
            print(&written(&files));
        }
    }
    Ok(if statistics.failed > 0 || samples.len() < run.samples { Exit::NotSolved } else { Exit::Verified })
}

fn guidance(a: &MonteCarloArguments) -> Result<Guidance, Refusal> {
    let times = !a.replan_at.is_empty() || a.replan_every.is_some();
    Ok(match a.guidance {
        GuidanceWord::Replanned if !times => Guidance::Replanned(Replanning::at_start()),
        GuidanceWord::Replanned => {
            Guidance::Replanned(Replanning { at_s: a.replan_at.clone(), every_s: a.replan_every })
        }
        _ if times => {
            return Err("`--replan-at` and `--replan-every` need `--guidance replanned`".into());
        }
        GuidanceWord::OpenLoop => Guidance::OpenLoop,
        GuidanceWord::LinearRadial => Guidance::LinearRadial,
        GuidanceWord::Polynomial => Guidance::Polynomial,
    })
}

fn text(mission: &str, s: &Statistics, first: usize) -> String {
    let mut text = format!("{} flights of {mission}", s.samples);
    if first > 0 {
        let _ = write!(text, ", {first} of them read from the file");
    }
    if s.failed > 0 {
        let _ = write!(text, ", {} did not end", s.failed);
    }
    let _ = writeln!(text, "\n{:.2} % within 1 m of the planned end\n", 100.0 * s.within_1_m);
    let _ = writeln!(
        text,
        "{:<20}{:>13}{:>13}{:>13}{:>13}{:>13}{:>13}{:>13}",
        "relative to the plan", "mean", "sigma", "linear sigma", "1 %", "50 %", "99 %", "largest"
    );
    for spread in &s.spreads {
        let _ = write!(text, "{:<20}{:>13}{:>13}", spread.name, number(spread.mean), number(spread.sigma));
        let _ = write!(text, "{:>13}", spread.linear_sigma.map_or_else(|| "-".into(), number));
        for p in spread.percentiles.iter().chain([&spread.largest]) {
            let _ = write!(text, "{:>13}", number(*p));
        }
        text.push('\n');
    }
    let mut ellipse = |name: &str, e: &Ellipse| {
        let _ = writeln!(
            text,
            "{name}: semi-axes {} and {} m, the larger one {:.1} deg right of the course",
            number(e.semi_axes_m[0]),
            number(e.semi_axes_m[1]),
            e.angle_deg
        );
    };
    if let Some(e) = &s.ellipse {
        ellipse("\nellipse of one sigma", e);
    }
    if let Some(e) = &s.linear_ellipse {
        ellipse("by the state-transition matrix", e);
    }
    text
}

/// Four decimals, or an exponent where these say little.
fn number(v: f64) -> String {
    if v == 0.0 || (1e-2..1e7).contains(&v.abs()) { format!("{v:.4}") } else { format!("{v:.3e}") }
}
