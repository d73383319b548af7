//! The commands.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use apsides::pipeline::lock::DirectoryLock;
use apsides::pipeline::method::MethodName;
use apsides::pipeline::record::{Record, SOLVES};
use apsides::pipeline::whole_file::{check_directory, check_file};
use apsides_ocp::Trajectory;
use apsides_report::{read_outcome_trajectory, write_outcome_with};

use crate::arguments::{MissionArguments, RunArguments, SolveArguments};
use crate::exit::{Exit, Refusal, refusal, unwritten_option};
use crate::figures::presentation;
use crate::output::{outcome, prices, print, print_json, print_words, say, warn, written};
use crate::progress::Progress;
use crate::speech::is_json;

impl MissionArguments {
    pub(crate) fn load(&self) -> Result<apsides::Pipeline, Refusal> {
        let mut overrides = self.set.clone();
        overrides.extend(self.method.iter().map(|m| format!("method={m}")));
        apsides::load(&self.mission, &overrides).map_err(refusal)
    }

    /// The mission with the threads, the seed and the memory of the arguments.
    pub(crate) fn load_for(&self, run: &RunArguments) -> Result<apsides::Pipeline, Refusal> {
        let mission = self.load()?.with_threads(run.threads.count());
        let stop = run.limit.stop();
        Ok(mission.with_seed(run.seed).with_memory(run.memory()).with_cancellation(stop.cancellation()))
    }
}

pub(crate) fn solve(a: &SolveArguments) -> Result<Exit, Refusal> {
    let mut mission = a.mission.load_for(&a.run)?;
    if let Some(file) = &a.checkpoint {
        if mission.methods().name != MethodName::TwoLayer {
            let name = mission.methods().name.word();
            return Err(refusal(format!(
                "--checkpoint keeps a search, and `{name}` has none: say --method two-layer"
            )));
        }
        probe_file("--checkpoint", file)?;
        mission = mission.with_checkpoint(file.clone());
    }
    if let Some(dir) = &a.out {
        // Before the work, not after it.
        probe_directory(dir)?;
    }
    let ephemeris = a.ephemeris.asked(&mission, a.out.as_deref())?;
    if a.sensitivity {
        mission.check_prices().map_err(refusal)?;
    }
    if a.explain {
        explain_guess(&mission)?;
    }
    let start = a.from.as_deref().map(|dir| start_of(&mission, &a.mission.mission, dir)).transpose()?;
    let _lock = a.out.as_deref().map(claim).transpose()?;
    let mut progress = Progress::of_solve(a.run.limit.stop());
    let mut solved = mission.solve(start.as_ref(), &mut progress).map_err(refusal)?;
    if a.sensitivity && solved.report.as_ref().is_some_and(|report| report.status.is_success()) {
        let keys: Vec<&str> = mission.priced_keys().map(|k| &*k.path).collect();
        solved.summary.sensitivity = Some(mission.sensitivities(&solved, &keys).map_err(refusal)?);
    }
    let mut exit = Exit::of(&solved.summary);
    progress.finish();
    if is_json() {
        print_json(&solved.summary)?;
    } else {
        print_words(&outcome(&solved));
        print_words(&prices(&solved));
    }
    if let Some(dir) = &a.out {
        // Rows that are refused, as too many, lose no solution.
        let further = ephemeris.as_ref().map(|(sampling, formats)| {
            let table = mission.ephemeris(&solved.decisions, &solved.ocp, &solved.trajectory, *sampling);
            crate::ephemeris::files(&table.map_err(refusal)?, formats)
        });
        let (further, refused) = match further.transpose() {
            Ok(further) => (further.unwrap_or_default(), None),
            Err(refused) => (Vec::new(), Some(refused)),
        };
        let shown = presentation(&a.mission.mission, &mission, &solved);
        let files = write_outcome_with(dir, &solved, &shown, further)?;
        if !is_json() {
            print(&written(&files));
        }
        if let Some(Refusal { exit: worse, sentence }) = refused {
            say(&format!("the solution is written, its ephemeris is not: {sentence}"));
            exit = exit.or(worse);
        }
    }
    if let Some(why) = solved.summary.search.as_ref().and_then(|s| s.remark.as_deref()) {
        say(&format!("the search is not kept: {why}"));
        exit = exit.or(Exit::Unwritten);
    }
    Ok(exit)
}

/// The flight of a result directory as a start of a mission.
fn start_of(mission: &apsides::Pipeline, name: &str, directory: &Path) -> Result<Trajectory, Refusal> {
    let posed = mission.pose().map_err(refusal)?;
    read_outcome_trajectory(directory, posed.flight())
        .map_err(|e| refusal(format!("--from {}: no flight of `{name}`: {e}", directory.display())))
}

/// Constraints named by `--explain`.
const WORST_RESIDUALS: usize = 8;

fn explain_guess(mission: &apsides::Pipeline) -> Result<(), Refusal> {
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

/// Refuses a directory that cannot be written, and leaves nothing there.
pub(crate) fn probe_directory(dir: &Path) -> Result<(), Refusal> {
    check_directory(dir).map_err(unwritten_option("--out", dir))
}

/// A directory that no other process writes into meanwhile.
pub(crate) fn claim(dir: &Path) -> Result<DirectoryLock, Refusal> {
    let words = std::env::args().skip(1).take(2).collect::<Vec<_>>().join(" ");
    DirectoryLock::take(dir, &format!("apsides {words}")).map_err(unwritten_option("--out", dir))
}

/// The directory of a command that keeps its solves there until all are done; none where nothing is written.
pub(crate) struct KeptWork {
    record: Option<Record>,
    solves: PathBuf,
    /// It ends last: with it goes the directory if nothing is left in it.
    _lock: Option<DirectoryLock>,
}

impl KeptWork {
    pub(crate) fn open(out: Option<&Path>) -> Result<Self, Refusal> {
        if let Some(dir) = out {
            // Before the work, not after it.
            probe_directory(dir)?;
        }
        let lock = out.map(claim).transpose()?;
        let solves = out.map(|dir| dir.join(SOLVES)).unwrap_or_default();
        let record = out.map(|_| keep_solves(&solves)).transpose()?;
        Ok(Self { record, solves, _lock: lock })
    }

    /// Ends the work as [`settle`] does.
    pub(crate) fn settle(self, complete: bool, exit: Exit) -> Exit {
        settle(self.record, &self.solves, complete, exit)
    }
}

/// Solves on disk, from which the same command goes on.
pub(crate) fn keep_solves(dir: &Path) -> Result<Record, Refusal> {
    Record::open(dir).map_err(unwritten_option("--out", dir))
}

/// Removes the solves of work that is complete; says where the others are, and which could not be kept.
pub(crate) fn settle(record: Option<Record>, dir: &Path, complete: bool, exit: Exit) -> Exit {
    let Some(record) = record else { return exit };
    if let Some(why) = record.lost() {
        say(&format!("solves are not kept: {why}"));
        return exit.or(Exit::Unwritten);
    }
    if record.found() > 0 && !is_json() {
        print(&format!("taken over from an earlier run: {} solves\n", record.found()));
    }
    if complete {
        record.remove();
    } else {
        warn(&format!("what is solved is kept in {}: the same command goes on from there", dir.display()));
    }
    exit
}

/// A directory, made where it is missing.
pub(crate) fn made(dir: &Path) -> Result<&Path, Refusal> {
    std::fs::create_dir_all(dir).map_err(unwritten_option("--out", dir))?;
    Ok(dir)
}

/// Refuses a file that cannot be written, and leaves nothing there.
pub(crate) fn probe_file(option: &str, file: &Path) -> Result<(), Refusal> {
    check_file(file).map_err(unwritten_option(option, file))
}
