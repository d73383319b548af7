//! `apsides montecarlo`.

use std::fmt::Write as _;

use apsides::missions::moving_mass::{DescentDeviations, Descents, case};
use apsides::pipeline::dispersion::{Deviations, Guidance, Onboard, Replanning};
use apsides::pipeline::draws::Draws;
use apsides::pipeline::key::{name_of, unit_of};
use apsides::pipeline::memory::Foreseen;
use apsides::pipeline::montecarlo::{Batch, Ellipse, MonteCarlo, Sample, Statistics};
use apsides_report::{Axis, Figure, SampleFile, distribution_figure, landing_figure, write_statistics};

use crate::arguments::{GuidanceWord, MonteCarloArguments, SampleFormat};
use crate::commands::claim;
use crate::exit::{Exit, Refusal, refusal};
use crate::output::{number, print, warn, written};
use crate::progress::Progress;
use crate::stop::StopFlag;

pub(crate) fn montecarlo(a: &MonteCarloArguments) -> Result<Exit, Refusal> {
    let mission = a.mission.load_for(&a.run)?;
    if !a.sigma.is_empty() {
        return draws(a, &mission);
    }
    if mission.is_simulated() {
        return descents(a, &mission);
    }
    let run = MonteCarlo {
        samples: a.samples as usize,
        seed: a.run.seed,
        threads: a.run.threads.count(),
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
    a.refuse(&a.of_descents(), "are of missions that are simulated")?;
    // Before the work, not after it.
    run.check(&mission).map_err(refusal)?;
    let columns = mission.kind().offers.dispersed;
    if a.format == SampleFormat::Parquet && !cfg!(feature = "parquet") {
        return Err("this program is built without Parquet: build it with `--features parquet`".into());
    }
    let stop = a.run.limit.stop();
    let plan = mission.solve(None, &mut Progress::table(true, stop)).map_err(refusal)?;
    if !plan.status.is_success() {
        return Err(unsolved(plan.status, "no plan to deviate from"));
    }
    let own = |index| run.dispersions.sample(run.seed, index).values().to_vec();
    let steering = serde_json::to_string(&(&run.guidance, &run.onboard)).map_err(refusal)?;
    let statement = format!("# Steering: {steering}\n{}", plan.mission_file);
    let frame = Frame { a, names: &Deviations::names(), columns, statement, stop };
    frame.fly(
        own,
        |done, each| run.run(&mission, &plan, done, each).map_err(refusal),
        |title, samples, statistics| landing_figure(title, samples, columns, statistics),
    )
}

/// Nothing to fly samples of.
fn unsolved(status: impl std::fmt::Display, what: &str) -> Refusal {
    Refusal {
        exit: Exit::NotSolved,
        sentence: format!("the mission itself is not solved ({status}): {what}"),
    }
}

/// Optima of a mission whose numbers are drawn.
fn draws(a: &MonteCarloArguments, mission: &apsides::Pipeline) -> Result<Exit, Refusal> {
    a.refuse(&a.of_plans(), "are of flights that deviate from a plan, not of optima (`--sigma`)")?;
    a.refuse(&a.of_descents(), "are of missions that are simulated")?;
    let run = Draws {
        samples: a.samples as usize,
        seed: a.run.seed,
        threads: a.run.threads.count(),
        sigmas: a.sigma.clone(),
    };
    run.check(mission).map_err(refusal)?;
    // Each thread has a solve of its own.
    let one = mission.foreseen_memory().map_err(refusal)?;
    let cause = format!("{} on each of {} threads", one.cause, run.threads);
    let all = Foreseen { bytes: one.bytes * run.threads as f64, cause };
    all.within(a.run.memory()).map_err(refusal)?;
    let stop = a.run.limit.stop();
    let plan = mission.solve(None, &mut Progress::table(true, stop)).map_err(refusal)?;
    if !plan.status.is_success() {
        return Err(unsolved(plan.status, "no optimum to begin with"));
    }
    let columns = Draws::columns(&plan);
    let names: Vec<&str> = a.sigma.iter().map(|(key, _)| key.as_str()).collect();
    let shown = plan.headline.first().map_or("", String::as_str);
    let statement = format!("# Draws: {:?}\n{}", a.sigma, plan.mission_file);
    let frame = Frame { a, names: &names, columns: &columns, statement, stop };
    frame.fly(
        |index| run.deviations(index),
        |done, each| run.run(mission, &plan, done, each).map_err(refusal),
        |title, samples, _| {
            let axis = Axis::new(name_of(shown).replace('_', " "), unit_of(shown));
            distribution_figure(title, axis, samples, &columns, &[(shown, "optimum")])
        },
    )
}

/// Descents of a mission that is simulated.
fn descents(a: &MonteCarloArguments, mission: &apsides::Pipeline) -> Result<Exit, Refusal> {
    a.refuse(&a.of_plans(), "are of missions that are optimised")?;
    if a.of_descents().iter().all(|(_, size)| *size == 0.0) {
        let names = a.of_descents().map(|(name, _)| name).join(", ");
        warn(&format!("no deviation is given ({names}): flights differ by the noise of sensors alone"));
    }
    let case = case(mission).map_err(refusal)?;
    let run = Descents {
        samples: a.samples as usize,
        seed: a.run.seed,
        threads: a.run.threads.count(),
        dispersions: DescentDeviations {
            offset_m: [a.offset; 2],
            entry_angles_deg: [a.entry_angle; 2],
            path_angle_deg: a.path_angle,
            sensor_gain: a.sensor_gain / 100.0,
            damping: a.damping / 100.0,
            wind_m_s: [a.wind; 2],
        },
    };
    let own = |index| run.dispersions.sample(run.seed, index).0.values().to_vec();
    let columns = Descents::COLUMNS;
    let statement = mission.to_file();
    let names = DescentDeviations::NAMES;
    let frame = Frame { a, names, columns, statement, stop: a.run.limit.stop() };
    frame.fly(
        own,
        |done, each| run.run(&case, done, each).map_err(refusal),
        |title, samples, _| {
            let rms = [("attack_rms_deg", "attack"), ("sideslip_rms_deg", "sideslip")];
            let axis = Axis::new("root mean square", "deg").logarithmic();
            distribution_figure(title, axis, samples, columns, &rms)
        },
    )
}

impl MonteCarloArguments {
    /// Options of flights that deviate from a plan, with their sizes.
    fn of_plans(&self) -> [(&'static str, f64); 5] {
        [
            ("--position-m", self.position),
            ("--velocity-m-s", self.velocity),
            ("--thrust-percent", self.thrust),
            ("--exhaust-velocity-percent", self.exhaust_velocity),
            ("--mass-kg", self.mass),
        ]
    }

    /// Options of descents, with their sizes.
    fn of_descents(&self) -> [(&'static str, f64); 6] {
        [
            ("--offset-m", self.offset),
            ("--entry-angle-deg", self.entry_angle),
            ("--path-angle-deg", self.path_angle),
            ("--sensor-gain-percent", self.sensor_gain),
            ("--damping-percent", self.damping),
            ("--wind-m-s", self.wind),
        ]
    }

    fn refuse(&self, options: &[(&'static str, f64)], why: &str) -> Result<(), Refusal> {
        let given: Vec<&str> =
            options.iter().filter(|(_, size)| *size != 0.0).map(|(name, _)| *name).collect();
        match given.is_empty() {
            true => Ok(()),
            false => Err(format!(
                "{}: deviations of this name {why}, `{}` is not",
                given.join(", "),
                self.mission.mission
            )
            .into()),
        }
    }
}

/// The arguments and columns of a run, with its file, progress and results.
struct Frame<'a> {
    a: &'a MonteCarloArguments,
    names: &'a [&'a str],
    columns: &'a [&'a str],
    /// Mission and steering: what samples are of.
    statement: String,
    stop: StopFlag,
}

/// Samples that are done, and who sees new ones.
type Each<'a> = &'a mut dyn FnMut(&Sample) -> bool;

impl Frame<'_> {
    fn fly(
        &self,
        own: impl Fn(usize) -> Vec<f64>,
        run: impl FnOnce(Vec<Sample>, Each<'_>) -> Result<(Vec<Sample>, Statistics), Refusal>,
        figure: impl FnOnce(&str, &[Sample], &Statistics) -> Figure,
    ) -> Result<Exit, Refusal> {
        let (a, stop, wanted) = (self.a, self.stop, self.a.samples as usize);
        let foreseen = Batch::foreseen_memory(wanted, self.names.len(), self.columns.len());
        foreseen.within(a.run.memory()).map_err(refusal)?;
        let _lock = a.out.as_deref().map(claim).transpose()?;
        let (mut file, done) = match &a.out {
            Some(dir) => {
                let (file, done) = SampleFile::open(dir, self.names, own, self.columns, &self.statement)?;
                (Some(file), done)
            }
            None => (None, Vec::new()),
        };
        let first = done.len();
        let progress = Progress::counted(a.run.quiet, stop, wanted.saturating_sub(first) as u64, "flights");
        let mut failure = None;
        let (samples, statistics) = run(done, &mut |sample| {
            progress.step();
            if let Some(file) = &mut file
                && let Err(e) = file.add(sample)
            {
                failure = Some(Refusal::from(e));
            }
            failure.is_none() && !stop.is_set()
        })?;
        if let Some(e) = failure {
            return Err(e);
        }
        for fault in &statistics.faults {
            warn(&fault.to_string());
        }
        let mut files = Vec::new();
        if let (Some(dir), Some(file)) = (&a.out, file) {
            files.push(file.finish()?);
            #[cfg(feature = "parquet")]
            if a.format == SampleFormat::Parquet {
                let path = apsides_report::write_parquet(dir, &samples, self.names, self.columns);
                files.push(path?);
            }
            let title = format!("{}: {} flights", a.mission.mission, samples.len());
            let figure = figure(&title, &samples, &statistics);
            files.extend(write_statistics(dir, &figure, &statistics)?);
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
        Ok(if statistics.failed > 0 || samples.len() < wanted { Exit::NotSolved } else { Exit::Verified })
    }
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
    match s.within_1_m {
        Some(part) => {
            let _ = writeln!(text, "\n{:.2} % within 1 m of the planned end\n", 100.0 * part);
        }
        None => text.push_str("\n\n"),
    }
    let _ = writeln!(
        text,
        "{:<20}{:>13}{:>13}{:>13}{:>13}{:>13}{:>13}{:>13}",
        if s.within_1_m.is_some() { "relative to the plan" } else { "result" },
        "mean",
        "sigma",
        "linear sigma",
        "1 %",
        "50 %",
        "99 %",
        "largest"
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
