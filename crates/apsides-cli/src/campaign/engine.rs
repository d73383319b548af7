//! Engines that run the shards of a campaign: processes of this machine, an array job of Slurm, tasks of Dask.

use std::collections::VecDeque;
use std::fs::{File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use apsides::pipeline::whole_file::write_whole;

use super::plan::Plan;
use super::rhythm::Rhythm;
use crate::exit::{Exit, Refusal, refusal, unwritten};

/// A running campaign.
pub(crate) trait Engine {
    /// Goes on; true while there is something at work.
    fn poll(&mut self) -> Result<bool, Refusal>;
    /// Ends what is at work.
    fn cancel(&mut self);
    /// The work that goes on when the pilot ends, in words.
    fn left(&self) -> String;
    /// Jobs of a queue, by which a pilot that is started again finds them.
    fn jobs(&self) -> Vec<String> {
        Vec::new()
    }
}

/// The program itself.
fn program() -> Result<PathBuf, Refusal> {
    std::env::current_exe().map_err(|e| refusal(format!("the program does not find itself: {e}")))
}

/// The file that takes the words of a shard or an engine, at its end.
fn log(plan: &Plan, name: &str) -> Result<File, Refusal> {
    let path = plan.out().join("log").join(name);
    OpenOptions::new().create(true).append(true).open(&path).map_err(unwritten(&path))
}

/// A process whose words go into a log, out of reach of the signals of this terminal.
fn spawn(command: &mut Command, log: File) -> io::Result<Child> {
    let words = log.try_clone()?;
    command.stdin(Stdio::null()).stdout(words).stderr(log);
    #[cfg(unix)]
    {
        use std::os::unix::process::CommandExt as _;
        command.process_group(0);
    }
    command.spawn()
}

/// Asks a process to end.
fn ask_to_end(child: &mut Child) {
    let asked = Command::new("kill").args(["-TERM", &child.id().to_string()]).status();
    if !asked.is_ok_and(|status| status.success()) {
        let _ = child.kill();
    }
}

/// The last lines of a log.
fn last_words(plan: &Plan, name: &str) -> String {
    const LINES: usize = 3;
    let path = plan.out().join("log").join(name);
    let text =
        std::fs::read(&path).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default();
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
    lines.get(lines.len().saturating_sub(LINES)..).unwrap_or_default().join("\n")
}

/// Processes of this machine.
pub(crate) struct Local<'a> {
    plan: &'a Plan,
    waiting: VecDeque<(usize, u32)>,
    running: Vec<(usize, u32, Child)>,
}

impl<'a> Local<'a> {
    pub(crate) fn new(plan: &'a Plan, shards: &[usize]) -> Self {
        Self { plan, waiting: shards.iter().map(|shard| (*shard, 1)).collect(), running: Vec::new() }
    }
}

impl Engine for Local<'_> {
    fn poll(&mut self) -> Result<bool, Refusal> {
        let mut ended = Vec::new();
        self.running.retain_mut(|(shard, attempt, child)| match child.try_wait() {
            Ok(None) => true,
            status => {
                ended.push((*shard, *attempt, status));
                false
            }
        });
        for (shard, attempt, status) in ended {
            let status = status.map_err(|e| refusal(format!("shard {shard}: {e}")))?;
            let Some(status) = status else { continue };
            let name = format!("{shard:06}");
            let code = status.code();
            if code == Some(Exit::Verified as i32) || code == Some(Exit::Failures as i32) {
                continue;
            }
            if code == Some(Exit::BadInput as i32) || attempt >= self.plan.attempts {
                self.cancel();
                let how = code.map_or_else(|| status.to_string(), |code| format!("status {code}"));
                let words = last_words(self.plan, &name);
                let sentence = format!("shard {shard} ended with {how}, attempt {attempt}: {words}");
                let exit = if code == Some(Exit::BadInput as i32) { Exit::BadInput } else { Exit::NotSolved };
                return Err(Refusal { exit, sentence });
            }
            self.waiting.push_back((shard, attempt + 1));
        }
        while self.running.len() < self.plan.workers()
            && let Some((shard, attempt)) = self.waiting.pop_front()
        {
            let mut command = Command::new(program()?);
            command.arg("campaign").arg(&self.plan.file).args(["--shard", &shard.to_string()]);
            let log = log(self.plan, &format!("{shard:06}"))?;
            let child = spawn(&mut command, log).map_err(|e| refusal(format!("shard {shard}: {e}")))?;
            self.running.push((shard, attempt, child));
        }
        Ok(!self.running.is_empty())
    }

    fn cancel(&mut self) {
        for (_, _, child) in &mut self.running {
            ask_to_end(child);
        }
        for (_, _, child) in &mut self.running {
            let _ = child.wait();
        }
        self.running.clear();
        self.waiting.clear();
    }

    fn left(&self) -> String {
        format!("{} shards at work go on to their end, no others are begun", self.running.len())
    }
}

/// Tasks of Dask, by a program in Python.
pub(crate) struct Dask<'a> {
    plan: &'a Plan,
    child: Child,
}

/// The program.
const DASK: &str = include_str!("shards_dask.py");

const DASK_LOG: &str = "dask";

impl<'a> Dask<'a> {
    pub(crate) fn start(plan: &'a Plan, shards: &[usize]) -> Result<Self, Refusal> {
        let script = script(plan, "shards_dask.py", DASK)?;
        let list = script.with_file_name("shards");
        let lines: String = shards.iter().map(|shard| format!("{shard}\n")).collect();
        write_whole(&list, lines.as_bytes()).map_err(unwritten(&list))?;
        let mut command = Command::new(&plan.dask.python);
        command.arg(&script).arg(program()?).arg(&plan.file).arg(&list);
        command.args(["--workers", &plan.workers().to_string(), "--attempts", &plan.attempts.to_string()]);
        if let Some(scheduler) = &plan.dask.scheduler {
            command.args(["--scheduler", scheduler]);
        }
        let child = spawn(&mut command, log(plan, DASK_LOG)?);
        let child = child.map_err(|e| refusal(format!("`{}` does not start: {e}", plan.dask.python)))?;
        Ok(Self { plan, child })
    }
}

impl Engine for Dask<'_> {
    fn poll(&mut self) -> Result<bool, Refusal> {
        match self.child.try_wait().map_err(|e| refusal(format!("dask: {e}")))? {
            None => Ok(true),
            Some(status) if status.success() => Ok(false),
            Some(status) => {
                let sentence = format!("Dask ended with {status}: {}", last_words(self.plan, DASK_LOG));
                Err(Refusal { exit: Exit::NotSolved, sentence })
            }
        }
    }

    fn cancel(&mut self) {
        ask_to_end(&mut self.child);
        let _ = self.child.wait();
    }

    fn left(&self) -> String {
        format!("the tasks of Dask go on (process {})", self.child.id())
    }
}

/// Writes a script beside the shards.
fn script(plan: &Plan, name: &str, text: &str) -> Result<PathBuf, Refusal> {
    let path = plan.out().join("jobs").join(name);
    write_whole(&path, text.as_bytes()).map_err(unwritten(&path))?;
    Ok(path)
}

/// An array job of Slurm, and a job that joins the shards behind it.
pub(crate) struct Slurm {
    jobs: Vec<String>,
    looks: Rhythm,
}

/// The job of a shard.
const SLURM: &str = include_str!("shard.sbatch");

/// Tasks of an array at most, where Slurm does not say.
const USUAL_TASKS: usize = 1000;

impl Slurm {
    /// Hands the shards over to Slurm.
    pub(crate) fn submit(plan: &Plan, shards: &[usize]) -> Result<Self, Refusal> {
        let tasks = plan.shards().min(most_tasks());
        let mut own: Vec<usize> = shards.iter().map(|shard| shard % tasks).collect();
        own.sort_unstable();
        own.dedup();
        let script = script(plan, "shard.sbatch", SLURM)?;
        let program = program()?;
        let mut array = Command::new("sbatch");
        array.args(["--parsable", "--requeue", "--open-mode=append", "--job-name=apsides-shards"]);
        array.arg(format!("--array={}", ranges(&own)));
        array.arg(format!("--cpus-per-task={}", plan.threads));
        array.arg(format!("--output={}", plan.out().join("log/%a").display()));
        if let Some(memory) = plan.memory_mib {
            array.arg(format!("--mem={memory}M"));
        }
        array.args(&plan.slurm.options).arg(&script).arg(&program).arg(&plan.file);
        array.args([tasks.to_string(), plan.attempts.to_string()]);
        let shards = answer(&mut array)?;
        let mut merge = Command::new("sbatch");
        merge.args([
            "--parsable",
            "--job-name=apsides-merge",
            "--open-mode=append",
            "--kill-on-invalid-dep=yes",
        ]);
        merge.arg(format!("--dependency=afterok:{shards}"));
        merge.arg(format!("--output={}", plan.out().join("log/merge").display()));
        merge.args(&plan.slurm.options);
        merge.arg("--wrap").arg(format!("exec {} campaign {} --merge", quoted(&program), quoted(&plan.file)));
        match answer(&mut merge) {
            Ok(merge) => Ok(Self { jobs: vec![shards, merge], looks: Rhythm::start() }),
            Err(e) => {
                let _ = Command::new("scancel").arg(&shards).status();
                Err(e)
            }
        }
    }

    /// Jobs of an earlier pilot, if any of them is in the queue.
    pub(crate) fn of_earlier(jobs: &[String]) -> Option<Self> {
        let found = Self { jobs: jobs.to_vec(), looks: Rhythm::start() };
        (!jobs.is_empty() && found.is_queued()).then_some(found)
    }

    fn is_queued(&self) -> bool {
        let mut ask = Command::new("squeue");
        ask.args(["--noheader", "--format=%i", "--jobs", &self.jobs.join(",")]).stderr(Stdio::null());
        // A job that Slurm has forgotten is an error of its.
        ask.output().is_ok_and(|found| found.status.success() && !found.stdout.trim_ascii().is_empty())
    }
}

impl Engine for Slurm {
    /// The queue serves others, too: it is asked as rarely as its shards are looked at.
    fn poll(&mut self) -> Result<bool, Refusal> {
        Ok(!self.looks.is_due() || self.is_queued())
    }

    fn cancel(&mut self) {
        let _ = Command::new("scancel").args(&self.jobs).status();
    }

    fn left(&self) -> String {
        format!("the jobs {} go on", self.jobs.join(" and "))
    }

    fn jobs(&self) -> Vec<String> {
        self.jobs.clone()
    }
}

/// Tasks of an array at most.
fn most_tasks() -> usize {
    let told = Command::new("scontrol").args(["show", "config"]).output().ok();
    let text = told.map(|found| String::from_utf8_lossy(&found.stdout).into_owned()).unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("MaxArraySize")?.split('=').nth(1));
    // Indices are below that number.
    line.and_then(|n| n.trim().parse::<usize>().ok()).map_or(USUAL_TASKS, |n| n.saturating_sub(1)).max(1)
}

/// The number of the job that `sbatch` made.
fn answer(command: &mut Command) -> Result<String, Refusal> {
    let failed = |why: String| Refusal { exit: Exit::NotSolved, sentence: format!("sbatch: {why}") };
    let output = command.output().map_err(|e| failed(e.to_string()))?;
    if !output.status.success() {
        return Err(failed(String::from_utf8_lossy(&output.stderr).trim().into()));
    }
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    // With the cluster behind a semicolon, where there are several.
    Ok(text.trim().split(';').next().unwrap_or_default().to_owned())
}

fn quoted(path: &Path) -> String {
    format!("'{}'", path.display().to_string().replace('\'', "'\\''"))
}

/// Increasing numbers as ranges: `0-3,7`.
fn ranges(numbers: &[usize]) -> String {
    let mut all: Vec<[usize; 2]> = Vec::new();
    for n in numbers {
        match all.last_mut() {
            Some([_, last]) if *last + 1 == *n => *last = *n,
            _ => all.push([*n, *n]),
        }
    }
    let words: Vec<String> =
        all.iter().map(|[a, b]| if a == b { a.to_string() } else { format!("{a}-{b}") }).collect();
    words.join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_those_of_slurm() {
        assert_eq!(ranges(&[0, 1, 2, 3, 7, 9, 10]), "0-3,7,9-10");
        assert_eq!(ranges(&[5]), "5");
        assert_eq!(quoted(Path::new("it's")), "'it'\\''s'");
    }
}
