//! The commands.

use std::io::Write as _;
use std::path::Path;

use apsides::sweep::{Axis, Case, cases, sweep};
use apsides::{Mission, Outcome};
use apsides_report::{read_outcome_trajectory, write_outcome};

use crate::arguments::{MissionArguments, SolveArguments, SweepArguments};
use crate::figures::figures;
use crate::output::{Exit, certificate, outcome, prices, print, titles, written};
use crate::progress::{Progress, StopFlag};

/// One sentence for the reader; exit status 2.
pub(crate) type Refusal = String;

pub(crate) fn refusal(e: impl std::fmt::Display) -> Refusal {
    e.to_string()
}

impl MissionArguments {
    fn load(&self) -> Result<Mission, Refusal> {
        let mut overrides = self.set.clone();
        overrides.extend(self.method.iter().map(|m| format!("method={m}")));
        Mission::load(&self.mission, &overrides).map_err(refusal)
    }
}

pub(crate) fn solve(a: &SolveArguments) -> Result<Exit, Refusal> {
    let mut mission = a.mission.load()?.with_threads(a.run.threads as usize).with_seed(a.run.seed);
    if let Some(file) = &a.checkpoint {
        mission = mission.with_checkpoint(file.clone());
    }
    if let Some(dir) = &a.out {
        // Before the work, not after it.
        probe_directory(dir)?;
    }
    if a.sensitivity {
        mission.check_prices().map_err(refusal)?;
    }
    if a.explain {
        explain_guess(&mission)?;
    }
    let mut progress = Progress::table(a.run.quiet, StopFlag::install());
    let mut solved = mission.solve(None, &mut progress).map_err(refusal)?;
    if a.sensitivity && solved.report.as_ref().is_some_and(|report| report.status.is_success()) {
        let keys: Vec<&str> = mission.priced_keys().map(|k| k.path).collect();
        solved.summary.sensitivity = Some(mission.sensitivities(&solved, &keys).map_err(refusal)?);
    }
    let exit = Exit::of(&solved.summary);
    if a.json {
        let text = serde_json::to_string_pretty(&solved.summary).map_err(refusal)?;
        print(&format!("{text}\n"));
    } else {
        print(&outcome(&solved));
        print(&prices(&solved));
    }
    if let Some(dir) = &a.out {
        let files = write_outcome(dir, &solved, &figures(&solved)).map_err(refusal)?;
        if !a.json {
            print(&written(&files));
        }
    }
    Ok(exit)
}

/// Constraints named by `--explain`.
const WORST_RESIDUALS: usize = 8;

fn explain_guess(mission: &Mission) -> Result<(), Refusal> {
    let worst = mission.guess_residuals(WORST_RESIDUALS).map_err(refusal)?;
    let mut err = std::io::stderr().lock();
    // A closed stderr must not end the solve.
    let _ = writeln!(err, "largest residuals of the initial guess, relative to their scale:");
    for unmet in worst {
        let _ = writeln!(err, "  {unmet}");
    }
    let _ = writeln!(err);
    Ok(())
}

/// Refuses a directory that cannot be written.
pub(crate) fn probe_directory(dir: &Path) -> Result<(), Refusal> {
    let fail = |e: std::io::Error| format!("--out {}: {e}", dir.display());
    if dir.exists() && !dir.is_dir() {
        return Err(format!("--out {}: is a file; give a directory", dir.display()));
    }
    std::fs::create_dir_all(dir).map_err(fail)?;
    let probe = dir.join(format!(".apsides-{}", std::process::id()));
    std::fs::File::create(&probe).map_err(fail)?;
    std::fs::remove_file(&probe).map_err(fail)
}

pub(crate) fn run_sweep(a: &SweepArguments) -> Result<Exit, Refusal> {
    let mut axes = a.set.iter().map(|t| Axis::parse(t)).collect::<Result<Vec<_>, _>>().map_err(refusal)?;
    if let Some(m) = &a.method {
        axes.push(Axis { key: "method".into(), values: vec![m.clone()] });
    }
    let mut cases = cases(&a.mission, &axes).map_err(refusal)?;
    for case in &mut cases {
        case.mission = case.mission.clone().with_threads(a.run.threads as usize).with_seed(a.run.seed);
    }
    let mut csv = a.out.as_deref().map(SweepFile::create).transpose()?;
    let stop = StopFlag::install();
    let mut progress = Progress::line(a.run.quiet, stop.clone(), cases.len() as u64);
    let ticker = progress.clone();
    let mut worst = Exit::Verified;
    let mut failure = None;
    let mut first = true;
    print(&format!("sweep of {} cases: {}\n", cases.len(), a.mission));
    sweep(&cases, &mut progress, |case, solved| {
        if std::mem::take(&mut first) {
            ticker.above(&sweep_header(&axes, solved));
        }
        ticker.above(&sweep_row(case, solved));
        ticker.step();
        worst = worse(worst, Exit::of(&solved.summary));
        if let Some(file) = &mut csv
            && let Err(e) = file.row(&axes, case, solved)
        {
            failure = Some(e);
        }
        failure.is_none() && !stop.is_set()
    })
    .map_err(refusal)?;
    if let Some(e) = failure {
        return Err(e);
    }
    if let Some(file) = csv {
        print(&format!("written: {}\n", file.finish()?));
    }
    Ok(worst)
}

fn worse(a: Exit, b: Exit) -> Exit {
    let rank = |e| match e {
        Exit::Verified => 0,
        Exit::NotVerified => 1,
        Exit::NotSolved => 2,
        Exit::BadInput => 3,
    };
    if rank(b) > rank(a) { b } else { a }
}

fn sweep_header(axes: &[Axis], solved: &Outcome) -> String {
    let mut text = String::new();
    for axis in axes {
        text += &format!("{:>22} ", axis.key);
    }
    for key in solved.headline {
        text += &format!("{key:>24} ");
    }
    text + "iterations  ms      status, certificate\n"
}

fn sweep_row(case: &Case, solved: &Outcome) -> String {
    let mut text = String::new();
    for o in &case.overrides {
        text += &format!("{:>22} ", o.split_once('=').map_or("", |(_, v)| v));
    }
    let s = &solved.summary;
    for key in solved.headline {
        text += &format!("{:>24.8} ", s.results.get(*key).copied().unwrap_or(f64::NAN));
    }
    let why = solved.explanation.as_ref().map_or(String::new(), |e| format!("; {e}"));
    text + &format!(
        "{:>10}  {:<6.1}  {}, {}{why}\n",
        s.counters.iterations, s.timing_ms.solve, s.status, s.certificate.verdict
    )
}

/// A CSV file that grows next to its final place and is renamed at the end: what was there before stays until then,
/// and what was computed is never lost.
struct SweepFile {
    path: std::path::PathBuf,
    partial: std::path::PathBuf,
    writer: csv::Writer<std::fs::File>,
    header: bool,
}

impl SweepFile {
    fn create(path: &Path) -> Result<Self, Refusal> {
        if path.is_dir() {
            return Err(format!("--out {}: is a directory; give a file", path.display()));
        }
        let mut name = path.as_os_str().to_owned();
        name.push(".partial");
        let partial = std::path::PathBuf::from(name);
        let writer =
            csv::Writer::from_path(&partial).map_err(|e| format!("--out {}: {e}", path.display()))?;
        Ok(Self { path: path.into(), partial, writer, header: false })
    }

    fn row(&mut self, axes: &[Axis], case: &Case, solved: &Outcome) -> Result<(), Refusal> {
        let s = &solved.summary;
        let fail = |e: csv::Error| e.to_string();
        if !std::mem::replace(&mut self.header, true) {
            let header = axes
                .iter()
                .map(|a| a.key.as_str())
                .chain(s.results.keys().map(String::as_str))
                .chain(["status", "verdict", "iterations", "mesh_iterations", "solve_ms"]);
            self.writer.write_record(header).map_err(fail)?;
        }
        let values = case.overrides.iter().map(|o| o.split_once('=').map_or("", |(_, v)| v).to_owned());
        let results = s.results.values().map(f64::to_string);
        let last = [
            s.status.clone(),
            s.certificate.verdict.to_string(),
            s.counters.iterations.to_string(),
            s.counters.mesh_iterations.to_string(),
            s.timing_ms.solve.to_string(),
        ];
        self.writer.write_record(values.chain(results).chain(last)).map_err(fail)?;
        self.writer.flush().map_err(refusal)
    }

    fn finish(mut self) -> Result<String, Refusal> {
        self.writer.flush().map_err(refusal)?;
        std::fs::rename(&self.partial, &self.path).map_err(|e| {
            format!("--out {}: {e}; the rows are in {}", self.path.display(), self.partial.display())
        })?;
        Ok(self.path.display().to_string())
    }
}

pub(crate) fn missions(name: Option<&str>) -> Result<Exit, Refusal> {
    let Some(name) = name else {
        print(&titles(apsides::missions::list()));
        return Ok(Exit::Verified);
    };
    let mission = Mission::load(name, &[]).map_err(refusal)?;
    print(&format!("{}: {}\n\n", mission.name(), mission.title()));
    let width = mission.keys().map(|k| k.path.len()).max().unwrap_or(0);
    for key in mission.keys() {
        let value = mission.values.iter().find(|(k, _)| *k == key.path).map(|(_, v)| v.to_string());
        let (value, allowed) = (value.unwrap_or_default(), key.allowed());
        print(&format!("{:<width$} = {value:<10}  {} ({allowed})\n", key.path, key.meaning));
    }
    Ok(Exit::Verified)
}

pub(crate) fn check(a: &MissionArguments) -> Result<Exit, Refusal> {
    let mission = a.load()?;
    mission.pose().map_err(refusal)?;
    print(&format!("{} is well-posed: {}\n\n{}", a.mission, mission.title(), mission.to_file()));
    Ok(Exit::Verified)
}

pub(crate) fn verify(directory: &Path, json: bool) -> Result<Exit, Refusal> {
    let file = directory.join("mission.toml");
    let mission = Mission::load(&file.to_string_lossy(), &[]).map_err(refusal)?;
    let posed = mission.pose().map_err(refusal)?;
    let trajectory = read_outcome_trajectory(directory, posed.flight()).map_err(refusal)?;
    let found = mission.verify(&trajectory).map_err(refusal)?;
    if json {
        let text = serde_json::to_string_pretty(&found).map_err(refusal)?;
        print(&format!("{text}\n"));
    } else {
        print(&format!("{}: mission {}\n", directory.display(), mission.name()));
        print(&certificate(&found));
    }
    let _ = std::io::stdout().flush();
    Ok(if found.is_verified() { Exit::Verified } else { Exit::NotVerified })
}
