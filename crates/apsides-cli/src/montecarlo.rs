//! `apsides montecarlo`.

use std::fmt::Write as _;
use std::ops::Range;
use std::path::{Path, PathBuf};

use apsides::control::guidance::feed_forward::FeedForward;
use apsides::missions::moving_mass::{DescentDeviations, Descents, case};
use apsides::pipeline::dispersion::{Deviations, Guidance, Onboard, Replanning};
use apsides::pipeline::draws::Draws;
use apsides::pipeline::fault::Fault;
use apsides::pipeline::memory::Foreseen;
use apsides::pipeline::montecarlo::{
    Batch, Ellipse, LinearCovariance, MonteCarlo, Sample, Statistics, statistics,
};
use apsides::pipeline::open_loop::OpenLoop;
use apsides::pipeline::shard::{SHARD, Shard, ShardState};
use apsides_report::{
    FaultFile, SampleFigure, SampleFile, SampleLayout, SampleTable, state_samples, write_samples, write_shard,
};

use crate::arguments::{GuidanceWord, MonteCarloArguments, SampleFormat};
use crate::commands::claim;
use crate::exit::{Exit, Refusal, refusal};
use crate::output::{print, print_json, print_words, warn, written};
use crate::progress::Progress;
use crate::speech::is_json;
use crate::stop::StopFlag;

pub(crate) fn montecarlo(a: &MonteCarloArguments) -> Result<Exit, Refusal> {
    let mission = a.mission.load_for(&a.run)?;
    if !a.sigma.is_empty() {
        return draws(a, &mission);
    }
    if !a.state.is_empty() || !a.vary.is_empty() {
        return open_loop(a, &mission);
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
    // Where a flight is thought to be changes nothing in open loop.
    let is_open = matches!(run.guidance, Guidance::OpenLoop);
    let of_navigation = if is_open { Vec::new() } else { a.of_navigation().to_vec() };
    let deviations = [a.of_plans().to_vec(), of_navigation].concat();
    warn_of_none(&deviations, "all flights are the same");
    // Before the work, not after it.
    run.check(&mission).map_err(refusal)?;
    let indices = a.indices()?;
    let stop = a.run.limit.stop();
    let plan = mission.solve(None, &mut Progress::silent(stop)).map_err(refusal)?;
    if !plan.status.is_success() {
        return Err(unsolved(plan.status, "no plan to deviate from"));
    }
    let own = |index| run.dispersions.sample(run.seed, index).values().to_vec();
    let steering = serde_json::to_string(&(&run.guidance, &run.onboard)).map_err(refusal)?;
    let frame = Frame {
        a,
        mission: mission.name(),
        indices,
        names: &Deviations::names(),
        sizes: &run.dispersions.values(),
        columns: mission.kind().offers.dispersed,
        statement: format!("# Steering: {steering}\n{}", plan.mission_file),
        figure: SampleFigure::Landing,
        stop,
    };
    frame.fly(own, |indices, take| run.fly(&mission, &plan, indices, take))
}

/// A run without any deviation is allowed, and rarely what is wanted.
fn warn_of_none(options: &[(&'static str, f64)], consequence: &str) {
    if options.iter().all(|(_, size)| *size == 0.0) {
        let names: Vec<&str> = options.iter().map(|(name, _)| *name).collect();
        warn(&format!("no deviation is given ({}): {consequence}", names.join(", ")));
    }
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
    if !a.state.is_empty() || !a.vary.is_empty() {
        return Err(
            "`--sigma` solves each sample anew, `--state` and `--vary` fly the plan: take one of them".into(),
        );
    }
    a.refuse(&a.of_plans(), "are of flights that deviate from a plan, not of optima (`--sigma`)")?;
    a.refuse(&a.of_descents(), "are of missions that are simulated")?;
    let run = Draws {
        samples: a.samples as usize,
        seed: a.run.seed,
        threads: a.run.threads.count(),
        sigmas: a.sigma.clone(),
    };
    run.check(mission).map_err(refusal)?;
    let indices = a.indices()?;
    // Each thread has a solve of its own.
    let one = mission.foreseen_memory().map_err(refusal)?;
    let cause = format!("{} on each of {} threads", one.cause, run.threads);
    let all = Foreseen { bytes: one.bytes * run.threads as f64, cause };
    all.within(a.run.memory()).map_err(refusal)?;
    let stop = a.run.limit.stop();
    let plan = mission.solve(None, &mut Progress::silent(stop)).map_err(refusal)?;
    if !plan.status.is_success() {
        return Err(unsolved(plan.status, "no optimum to begin with"));
    }
    let columns = Draws::columns(&plan);
    let names: Vec<&str> = a.sigma.iter().map(|(key, _)| key.as_str()).collect();
    let sizes: Vec<f64> = a.sigma.iter().map(|(_, sigma)| *sigma).collect();
    let frame = Frame {
        a,
        mission: mission.name(),
        indices,
        names: &names,
        sizes: &sizes,
        columns: &columns,
        statement: format!("# Draws: {:?}\n{}", a.sigma, plan.mission_file),
        figure: SampleFigure::Result(plan.headline.first().cloned().unwrap_or_default(), "optimum".into()),
        stop,
    };
    frame.fly(|index| run.deviations(index), |indices, take| run.fly(mission, &plan, indices, take))
}

/// Flights of any optimised mission along the controls of its plan.
fn open_loop(a: &MonteCarloArguments, mission: &apsides::Pipeline) -> Result<Exit, Refusal> {
    a.refuse(&a.of_plans(), "do not go with `--state` and `--vary`")?;
    a.refuse(&a.of_descents(), "are of missions that are simulated")?;
    if !matches!(a.guidance, GuidanceWord::OpenLoop) {
        return Err("`--state` and `--vary` deviate flights in open loop, without `--guidance`".into());
    }
    let run = OpenLoop {
        seed: a.run.seed,
        threads: a.run.threads.count(),
        states: a.state.clone(),
        keys: a.vary.clone(),
    };
    run.check(mission).map_err(refusal)?;
    let indices = a.indices()?;
    let stop = a.run.limit.stop();
    let plan = mission.solve(None, &mut Progress::silent(stop)).map_err(refusal)?;
    if !plan.status.is_success() {
        return Err(unsolved(plan.status, "no plan to deviate from"));
    }
    let (names, columns) = (run.names(), OpenLoop::columns(&plan));
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let columns: Vec<&str> = columns.iter().map(String::as_str).collect();
    let drawn = columns.first().copied().unwrap_or_default();
    let frame = Frame {
        a,
        mission: mission.name(),
        indices,
        names: &names,
        sizes: &run.sizes(),
        columns: &columns,
        statement: format!("# Open loop: {:?} {:?}\n{}", a.state, a.vary, plan.mission_file),
        figure: SampleFigure::Result(drawn.into(), "less that of the plan".into()),
        stop,
    };
    frame.fly(|index| run.deviations(index), |indices, take| run.fly(mission, &plan, indices, take))
}

/// Descents of a mission that is simulated.
fn descents(a: &MonteCarloArguments, mission: &apsides::Pipeline) -> Result<Exit, Refusal> {
    a.refuse(&a.of_plans(), "are of missions that are optimised")?;
    warn_of_none(&a.of_descents(), "flights differ by the noise of sensors alone");
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
    let results = [("attack_rms_deg", "attack"), ("sideslip_rms_deg", "sideslip")];
    let frame = Frame {
        a,
        mission: mission.name(),
        indices: a.indices()?,
        names: DescentDeviations::NAMES,
        sizes: &run.dispersions.values(),
        columns: Descents::COLUMNS,
        statement: mission.to_file(),
        figure: SampleFigure::Distribution {
            axis: "root mean square".into(),
            unit: "deg".into(),
            results: results.map(|(name, label)| (name.into(), label.into())).into(),
        },
        stop: a.run.limit.stop(),
    };
    frame.fly(own, |indices, take| run.fly(&case, indices, take))
}

impl MonteCarloArguments {
    /// The indices of the samples that are asked for.
    fn indices(&self) -> Result<Range<usize>, Refusal> {
        let [total, first] = [self.samples, self.first].map(|n| n as usize);
        let count = self.count.map_or(total.saturating_sub(first), |count| count as usize);
        if first + count <= total && count > 0 {
            return Ok(first..first + count);
        }
        let wanted = match self.count {
            Some(count) => format!("--first {first} --count {count}"),
            None => format!("--first {first}"),
        };
        Err(format!("{wanted}: the run has --samples {total}, of indices 0 to {}", total - 1).into())
    }

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

    /// Options of what a flight believes of itself, with their sizes.
    fn of_navigation(&self) -> [(&'static str, f64); 2] {
        [
            ("--navigation-position-m", self.navigation_position),
            ("--navigation-velocity-m-s", self.navigation_velocity),
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
    mission: &'a str,
    indices: Range<usize>,
    names: &'a [&'a str],
    /// Standard deviations, in the order of the names.
    sizes: &'a [f64],
    columns: &'a [&'a str],
    /// Mission and steering: what samples are of.
    statement: String,
    figure: SampleFigure,
    stop: StopFlag,
}

/// Who takes new samples, and says whether to go on.
type Take<'a> = &'a mut dyn FnMut(Sample) -> bool;

impl Frame<'_> {
    fn fly(
        &self,
        own: impl Fn(usize) -> Vec<f64>,
        run: impl FnOnce(Range<usize>, Take<'_>) -> Result<LinearCovariance, apsides::pipeline::Error>,
    ) -> Result<Exit, Refusal> {
        let a = self.a;
        let (statistics, earlier, files) = match &a.out {
            Some(dir) => self.fly_into(dir, own, run)?,
            None => (self.fly_in_memory(run)?, 0, Vec::new()),
        };
        for fault in &statistics.faults {
            warn(&fault.to_string());
        }
        show(&Shown { mission: self.mission, statistics: &statistics, earlier, files: &files })?;
        let complete = statistics.samples == self.indices.len();
        Ok(if complete { of_samples(&statistics) } else { Exit::NotSolved })
    }

    fn progress(&self, wanted: usize) -> Progress {
        Progress::counted(self.stop, wanted as u64, "flights")
    }

    fn fly_in_memory(
        &self,
        run: impl FnOnce(Range<usize>, Take<'_>) -> Result<LinearCovariance, apsides::pipeline::Error>,
    ) -> Result<Statistics, Refusal> {
        let foreseen = Batch::foreseen_memory(self.indices.len(), self.names.len(), self.columns.len());
        foreseen.within(self.a.run.memory()).map_err(refusal)?;
        let progress = self.progress(self.indices.len());
        let mut samples = Vec::new();
        let flown = run(self.indices.clone(), &mut |sample| {
            progress.step();
            samples.push(sample);
            !self.stop.is_set()
        });
        let linear_covariance = flown.map_err(refusal)?;
        let found = statistics(&samples, self.columns, linear_covariance);
        let faults = samples.iter().filter_map(|sample| sample.fault_of(self.a.run.seed)).collect();
        Ok(Statistics { faults, ..found })
    }

    /// The statistics, the number of samples that were there, and the files written.
    fn fly_into(
        &self,
        dir: &Path,
        own: impl Fn(usize) -> Vec<f64>,
        run: impl FnOnce(Range<usize>, Take<'_>) -> Result<LinearCovariance, apsides::pipeline::Error>,
    ) -> Result<(Statistics, usize, Vec<PathBuf>), Refusal> {
        let table = table_of(self.a.format)?;
        let _lock = claim(dir)?;
        let layout = SampleLayout {
            names: self.names,
            columns: self.columns,
            statement: &self.statement,
            first: self.indices.start,
        };
        let total = self.a.samples as usize;
        let seed = self.a.run.seed;
        let mut shard =
            Shard::begun("montecarlo", self.mission, &self.statement, seed, total, self.indices.clone());
        state_samples(&mut shard, &layout, self.sizes, &self.figure);
        let (mut file, there) = SampleFile::open(dir, &layout, own)?;
        let there = there.min(self.indices.len());
        let rest = self.indices.start + there..self.indices.end;
        // Those of samples that are there are told nowhere else.
        let (mut fault_file, mut faults) = FaultFile::open(dir, rest.start)?;
        faults.extend(earlier_faults(dir, &shard, rest.start));
        faults.sort_by_key(|fault| fault.index);
        faults.dedup_by_key(|fault| fault.index);
        shard.faults.clone_from(&faults);
        if !rest.is_empty() {
            write_shard(dir, &shard)?;
        }
        let progress = self.progress(rest.len());
        let (mut failure, mut flown_now) = (None, 0);
        let flown = run(rest, &mut |sample| {
            progress.step();
            // Before its row, which is counted as done.
            let told = match sample.fault_of(seed) {
                Some(fault) => fault_file.add(&fault).map(|()| faults.push(fault)),
                None => Ok(()),
            };
            match told.and_then(|()| file.add(&sample)) {
                Ok(()) => flown_now += 1,
                Err(e) => {
                    failure.get_or_insert_with(|| Refusal::from(e));
                }
            }
            failure.is_none() && !self.stop.is_set()
        });
        progress.finish();
        let linear_covariance = flown.map_err(refusal)?;
        if let Some(e) = failure {
            return Err(e);
        }
        shard.done = there + flown_now;
        shard.state = ShardState::Interrupted;
        shard.linear_covariance = linear_covariance.filter(|all| all.iter().all(|v| v.is_finite()));
        shard.faults = faults;
        let (statistics, files) = write_samples(dir, file.finish()?, &layout, &self.figure, shard, table)?;
        fault_file.remove();
        Ok((statistics, there, files))
    }
}

/// Faults of samples before an index, by the manifest of an earlier run of the same.
fn earlier_faults(dir: &Path, shard: &Shard, before: usize) -> Vec<Fault> {
    let earlier = Shard::read(&dir.join(SHARD)).ok();
    let same = earlier.filter(|e| e.statement_sha256 == shard.statement_sha256 && e.seed == shard.seed);
    let faults = same.map(|e| e.faults).unwrap_or_default();
    faults.into_iter().filter(|fault| fault.index < before).collect()
}

/// The status of samples that are all there.
pub(crate) fn of_samples(statistics: &Statistics) -> Exit {
    if statistics.failed > 0 { Exit::Failures } else { Exit::Verified }
}

/// The table beside CSV.
pub(crate) fn table_of(format: SampleFormat) -> Result<SampleTable, Refusal> {
    match format {
        SampleFormat::Csv => Ok(SampleTable::CsvAlone),
        #[cfg(feature = "parquet")]
        SampleFormat::Parquet => Ok(SampleTable::Parquet),
        #[cfg(not(feature = "parquet"))]
        SampleFormat::Parquet => {
            Err("this program is built without Parquet: build it with `--features parquet`".into())
        }
    }
}

/// Statistics with what is said beside them.
pub(crate) struct Shown<'a> {
    pub(crate) mission: &'a str,
    pub(crate) statistics: &'a Statistics,
    /// Samples that were read from a file.
    pub(crate) earlier: usize,
    pub(crate) files: &'a [PathBuf],
}

pub(crate) fn show(shown: &Shown<'_>) -> Result<(), Refusal> {
    if is_json() {
        print_json(shown.statistics)?;
        return Ok(());
    }
    print_words(&text(shown.mission, shown.statistics, shown.earlier));
    if !shown.files.is_empty() {
        print(&written(shown.files));
    }
    Ok(())
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
        GuidanceWord::LinearRadial => match a.feed_forward[..] {
            [] => Guidance::LinearRadial(FeedForward::default()),
            [along, along_speed, across, across_speed] => {
                let per_metre = |gain: f64| gain.to_radians() / 1e3;
                Guidance::LinearRadial(FeedForward {
                    along: per_metre(along),
                    along_speed: along_speed.to_radians(),
                    across: per_metre(across),
                    across_speed: across_speed.to_radians(),
                })
            }
            _ => {
                let found = a.feed_forward.len();
                return Err(format!(
                    "`--feed-forward` takes four gains, not {found}: deg/km and deg s/m along the course, the same across it, as in 0.5,1.2,0.3,0.9"
                )
                .into());
            }
        },
        _ if !a.feed_forward.is_empty() => {
            return Err("`--feed-forward` needs `--guidance linear-radial`".into());
        }
        GuidanceWord::OpenLoop => Guidance::OpenLoop,
        GuidanceWord::Polynomial => Guidance::Polynomial,
    })
}

/// Width of the names of results.
const NAME: usize = 18;

/// Four significant digits in nine characters.
fn number(v: f64) -> String {
    match v.abs() {
        0.0 => "0".into(),
        size if (1e-3..1e5).contains(&size) => {
            let decimals = (3.0 - size.log10().floor()).clamp(0.0, 6.0) as usize;
            format!("{v:.decimals$}")
        }
        _ => format!("{v:.1e}"),
    }
}

fn text(mission: &str, s: &Statistics, first: usize) -> String {
    let mut text = format!("{} flights of {mission}", s.samples);
    if first > 0 {
        let _ = write!(text, ", {first} of them read from the file");
    }
    if s.failed > 0 {
        let _ = write!(text, ", {} did not end", s.failed);
    }
    let interval =
        |[low, high]: [f64; 2]| format!("; 95 % confidence: {:.2} to {:.2} %\n", 100.0 * low, 100.0 * high);
    if s.failed > 0 {
        text +=
            &format!("\n{:.2} % ended{}", 100.0 * s.success.part, interval(s.success.interval).trim_end());
    }
    match (s.within_1_m, s.within_1_m_interval) {
        (Some(part), Some(within)) => {
            let _ =
                writeln!(text, "\n{:.2} % within 1 m of the planned end{}", 100.0 * part, interval(within));
        }
        _ => text.push_str("\n\n"),
    }
    let _ = writeln!(
        text,
        "{:<NAME$}{:>8}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}",
        if s.within_1_m.is_some() { "off the plan" } else { "result" },
        "mean",
        "sigma",
        "linear",
        "1 %",
        "50 %",
        "99 %",
        "largest"
    );
    for spread in &s.spreads {
        // A long name has a line of its own.
        let name = if spread.name.len() < NAME { spread.name.clone() } else { format!("{}\n", spread.name) };
        let _ = write!(
            text,
            "{name}{:width$}",
            "",
            width = if name.ends_with('\n') { NAME } else { NAME - name.len() }
        );
        let linear = spread.linear_sigma.map_or_else(|| "-".into(), number);
        let _ = write!(text, "{:>8}{:>9}{linear:>9}", number(spread.mean), number(spread.sigma));
        for p in spread.percentiles.iter().chain([&spread.largest]) {
            let _ = write!(text, "{:>9}", number(*p));
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
