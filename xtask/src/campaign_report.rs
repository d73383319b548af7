//! Times of campaigns: the same flights in a single run, by processes, by Slurm and by Dask on this machine, and joins by their rows.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use crate::command::{cargo, run};
use crate::engines::{Case, Slurm, WORKERS, compare, dask_keys, python_with_dask};
use crate::processor_time::Counter;
use crate::workspace::Workspace;

const MISSION: &str = "chang-e-3-braking";

/// Time between two looks at the memory of a process.
const BETWEEN: Duration = Duration::from_millis(10);

/// Measures, prints and writes the tables; an engine that cannot be installed is left out.
pub(crate) fn report(workspace: &Workspace, arguments: &[String]) -> Result<(), String> {
    let cases = cases(arguments)?;
    run(&mut cargo(&workspace.root, ["build", "--release", "--locked", "-p", "apsides-cli"]))?;
    let folder = workspace.target.join("campaign-report");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let bench = Bench {
        root: &workspace.root,
        program: workspace.target.join("release/apsides"),
        python: python_with_dask(&workspace.target),
        folder: &folder,
        counter: Counter::start("apsides-campaign-report"),
    };
    let mut text = format!("Flights of {MISSION}, {WORKERS} workers on {} cores.\n", cores());
    let file = workspace.target.join("campaign-report.md");
    for case in &cases {
        let rows = bench.measure(case)?;
        let joins = bench.joins(case)?;
        let table = tables(case, bench.counter.name(), &rows, &joins);
        println!("{table}");
        text += &table;
        // After each case: what was measured is kept if the next one fails.
        std::fs::write(&file, &text).map_err(|e| format!("{}: {e}", file.display()))?;
    }
    println!("written: {}", file.display());
    Ok(())
}

/// The cases that the arguments ask for.
fn cases(arguments: &[String]) -> Result<Vec<Case>, String> {
    let (mut open_loop, mut replanned, mut shards) = (1_000_000, 20_000, 20);
    for pair in arguments.chunks(2) {
        let [name, value] = pair else { return Err(format!("{} has no value", pair.join(" "))) };
        let value =
            value.parse().map_err(|_| format!("{name} {value}: not a number of flights or shards"))?;
        match name.as_str() {
            "--open-loop" => open_loop = value,
            "--replanned" => replanned = value,
            "--shards" => shards = value,
            _ => return Err(format!("{name}: allowed are --open-loop, --replanned and --shards")),
        }
    }
    let case = |name, arguments, samples: usize| Case {
        name,
        mission: MISSION,
        arguments,
        samples,
        shard_size: samples.div_ceil(shards),
    };
    if shards == 0 || [open_loop, replanned].iter().any(|n| (1..2).contains(n)) {
        return Err("at least two flights, in at least one shard".into());
    }
    let open = case("open-loop", &["--position-m", "333", "--velocity-m-s", "1"], open_loop);
    let again = case(
        "replanned",
        &["--position-m", "333", "--velocity-m-s", "1", "--guidance", "replanned"],
        replanned,
    );
    Ok([open, again].into_iter().filter(|case| case.samples > 0).collect())
}

/// Times of a run.
struct Measured {
    engine: &'static str,
    wall_s: f64,
    /// Processor time of all its processes.
    processor_s: f64,
    /// Outcome of the comparison with the single run.
    same: Result<(), String>,
}

/// Time and memory of a join.
struct Join {
    rows: usize,
    wall_s: f64,
    peak_mb: f64,
}

struct Bench<'a> {
    root: &'a Path,
    program: PathBuf,
    python: Result<PathBuf, String>,
    folder: &'a Path,
    counter: Counter,
}

impl Bench<'_> {
    fn measure(&self, case: &Case) -> Result<Vec<Measured>, String> {
        let folder = self.folder.join(case.name);
        std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        let whole = folder.join("whole");
        let mut rows = vec![self.timed("single run", &mut case.whole(&self.program, &whole), || Ok(()))?];
        let mut engine = |name: &'static str, keys: &str, slurm: Option<&Slurm>| -> Result<(), String> {
            let file = case.write(&folder, name, name, keys)?;
            let merged = file.with_extension("").join("merged");
            let mut pilot = Case::pilot(&self.program, &file, slurm);
            rows.push(self.timed(name, &mut pilot, || compare(&whole, &merged))?);
            Ok(())
        };
        engine("local", "", None)?;
        match Slurm::start(self.root, folder.join("slurm-cluster"))? {
            Ok(slurm) => engine("slurm", "", Some(&slurm))?,
            Err(why) => println!("slurm skipped: {why}"),
        }
        match &self.python {
            Ok(python) => engine("dask", &dask_keys(python), None)?,
            Err(why) => println!("dask skipped: {why}"),
        }
        // The speed of a machine drifts over such times.
        let again = folder.join("again");
        let mut single = case.whole(&self.program, &again);
        rows.push(self.timed("single run, again", &mut single, || compare(&whole, &again))?);
        Ok(rows)
    }

    /// Runs a command with its times.
    fn timed(
        &self,
        engine: &'static str,
        command: &mut Command,
        same: impl FnOnce() -> Result<(), String>,
    ) -> Result<Measured, String> {
        println!("{engine} ..");
        let (begun, before) = (Instant::now(), self.counter.seconds()?);
        let status = command.status().map_err(|e| format!("{engine}: {e}"))?;
        let (wall_s, processor_s) = (begun.elapsed().as_secs_f64(), self.counter.seconds()? - before);
        if !is_complete(status) {
            return Err(format!("{engine}: ended with {status}"));
        }
        println!("{engine}: {wall_s:.1} s, processors {processor_s:.1} s");
        Ok(Measured { engine, wall_s, processor_s, same: same() })
    }

    /// Joins one shard, a quarter of them, and all.
    fn joins(&self, case: &Case) -> Result<Vec<Join>, String> {
        let folder = self.folder.join(case.name);
        let shards = case.samples.div_ceil(case.shard_size);
        let mut counts = vec![1, shards.div_ceil(4), shards];
        counts.dedup();
        let join = |count: usize| {
            let out = folder.join(format!("joined-{count}"));
            let parts = (0..count).map(|k| folder.join("local/shards").join(format!("{k:06}")));
            let mut merge = Command::new(&self.program);
            merge.arg("merge").args(parts).args(["--partly", "--quiet", "--out"]).arg(&out);
            let (wall_s, peak_mb) = with_memory(&mut merge)?;
            let rows = (count * case.shard_size).min(case.samples);
            Ok(Join { rows, wall_s, peak_mb })
        };
        counts.into_iter().map(join).collect()
    }
}

/// All flights are there; some of them may have no result.
fn is_complete(status: ExitStatus) -> bool {
    matches!(status.code(), Some(0 | 6))
}

/// Wall-clock time in s and peak memory in MB of a process.
fn with_memory(command: &mut Command) -> Result<(f64, f64), String> {
    let begun = Instant::now();
    let mut child = command.stdout(Stdio::null()).spawn().map_err(|e| e.to_string())?;
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0.0_f64;
    loop {
        if let Some(ended) = child.try_wait().map_err(|e| e.to_string())? {
            let wall = begun.elapsed().as_secs_f64();
            return if is_complete(ended) {
                Ok((wall, peak))
            } else {
                Err(format!("merge ended with {ended}"))
            };
        }
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let high = text.lines().find_map(|line| line.strip_prefix("VmHWM:")?.split_whitespace().next());
        peak = peak.max(high.and_then(|kib| kib.parse().ok()).map_or(0.0, |kib: f64| kib * 1024e-6));
        std::thread::sleep(BETWEEN);
    }
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

fn tables(case: &Case, processors: &str, rows: &[Measured], joins: &[Join]) -> String {
    let mut text = format!(
        "\n{} flights, {}, shards of {}: `{}`\n\n| | wall, s | over | {processors} | over | files |\n\
         | --- | --- | --- | --- | --- | --- |\n",
        case.samples,
        case.name,
        case.shard_size,
        case.arguments.join(" ")
    );
    let Some(first) = rows.first() else { return text };
    for (k, row) in rows.iter().enumerate() {
        let over = |mine: f64, single: f64| match k {
            0 => "-".to_owned(),
            _ => format!("{:+.1} %", 100.0 * (mine / single - 1.0)),
        };
        let same = match &row.same {
            _ if k == 0 => "-",
            Ok(()) => "the same bytes",
            Err(why) => why,
        };
        let _ = writeln!(
            text,
            "| {} | {:.1} | {} | {:.1} | {} | {same} |",
            row.engine,
            row.wall_s,
            over(row.wall_s, first.wall_s),
            row.processor_s,
            over(row.processor_s, first.processor_s)
        );
    }
    text += "\n| rows joined | s | peak memory, MB |\n| --- | --- | --- |\n";
    for join in joins {
        let _ = writeln!(text, "| {} | {:.2} | {:.0} |", join.rows, join.wall_s, join.peak_mb);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<String> {
        text.split_whitespace().map(str::to_owned).collect()
    }

    #[test]
    fn cases_are_those_asked_for() {
        let all = cases(&[]).unwrap();
        assert_eq!(all.iter().map(|case| case.samples).collect::<Vec<_>>(), [1_000_000, 20_000]);
        let one = cases(&words("--open-loop 1001 --replanned 0 --shards 10")).unwrap();
        assert_eq!((one.len(), one[0].samples, one[0].shard_size), (1, 1001, 101));
        for (refused, why) in [
            ("--open-loop", "no value"),
            ("--open 3", "allowed are"),
            ("--shards x", "not a number"),
            ("--shards 0", "at least"),
        ] {
            assert!(cases(&words(refused)).unwrap_err().contains(why), "{refused}");
        }
    }

    #[test]
    fn overhead_is_relative_to_the_single_run() {
        let row = |engine, wall_s| Measured { engine, wall_s, processor_s: 2.0 * wall_s, same: Ok(()) };
        let text = tables(
            &cases(&[]).unwrap()[0],
            "processors, s",
            &[row("single run", 100.0), row("slurm", 103.0)],
            &[Join { rows: 50_000, wall_s: 0.5, peak_mb: 20.0 }],
        );
        assert!(text.contains("| slurm | 103.0 | +3.0 % | 206.0 | +3.0 % | the same bytes |"), "{text}");
        assert!(text.contains("| 50000 | 0.50 | 20 |"), "{text}");
    }
}
