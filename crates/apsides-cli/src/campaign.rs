//! `apsides campaign`: a large run as shards, by the engines that machines have.

mod engine;
mod keys;
mod plan;
mod rhythm;

use std::collections::BTreeSet;
use std::io::{BufRead as _, IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use apsides::pipeline::lock::DirectoryLock;
use apsides::pipeline::regular_file;
use apsides::pipeline::shard::Shard;
use apsides::pipeline::sweep::cases;
use apsides::pipeline::whole_file::write_whole;
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::arguments::{CampaignArguments, Command, MergeArguments, OnInterrupt};
use crate::commands::{claim, made};
use crate::exit::{Exit, Refusal, refusal, unwritten};
use crate::montecarlo::table_of;
use crate::output::{print, print_json, say};
use crate::progress::Progress;
use crate::speech::{is_json, is_quiet};
use crate::stop::StopFlag;
use engine::{Dask, Engine, Local, Slurm};
use plan::{EngineWord, Plan, complete};
use rhythm::Rhythm;

/// Time between two looks at the shards.
const PERIOD: Duration = Duration::from_millis(200);

/// Least time between two lines of progress, where stderr is no terminal.
const BETWEEN_LINES: Duration = Duration::from_secs(5);

/// Longest time for which a shard waits for another process that has it: one whose worker was killed.
const LONGEST_WAIT: Duration = Duration::from_secs(3600);

pub(crate) fn campaign(a: &CampaignArguments) -> Result<Exit, Refusal> {
    let plan = Plan::read(&a.file)?;
    if a.shards {
        if is_json() {
            print_json(&json!({ "shards": plan.shards() }))?;
        } else {
            print(&format!("{}\n", plan.shards()));
        }
        return Ok(Exit::Verified);
    }
    if let Some(shard) = a.shard {
        return shards_of_task(&plan, shard as usize, a.of.map(|of| of as usize));
    }
    if a.merge {
        return merge(&plan);
    }
    pilot(&plan, a)
}

/// The shard of a number, and each so many behind it.
fn shards_of_task(plan: &Plan, first: usize, step: Option<usize>) -> Result<Exit, Refusal> {
    if first >= plan.shards() {
        return Err(format!("--shard {first}: the campaign has {} shards, from 0 on", plan.shards()).into());
    }
    let mut worst = Exit::Verified;
    for shard in (first..plan.shards()).step_by(step.unwrap_or(plan.shards()).max(1)) {
        let exit = compute(plan, shard)?;
        worst = worst.or(exit);
        if !matches!(exit, Exit::Verified | Exit::Failures) {
            break;
        }
    }
    Ok(worst)
}

/// Computes a shard, or waits for the process that does.
fn compute(plan: &Plan, shard: usize) -> Result<Exit, Refusal> {
    let begun = Instant::now();
    let directory = plan.shard_place(shard);
    let command = plan.parsed(shard)?;
    made(&plan.shards_directory())?;
    let stop = StopFlag::install();
    loop {
        if let Some(complete) = plan.complete(shard) {
            tell(&format!("shard {shard} is complete\n"));
            return Ok(of_complete(&complete));
        }
        match DirectoryLock::take(&directory, "apsides campaign") {
            // By the process that had it.
            Ok(_) if plan.complete(shard).is_some() => continue,
            Ok(lock) => {
                drop(lock);
                match run(&command) {
                    // Another one took it in between.
                    Err(e) if e.sentence.contains("is in use by process") => {}
                    // Where all cases of a sweep are there, that of the worst is no status of the shard.
                    Ok(exit) => return Ok(plan.complete(shard).map_or(exit, |all| of_complete(&all))),
                    refused => return refused,
                }
            }
            Err(e)
                if e.kind() == std::io::ErrorKind::InvalidInput && e.to_string().contains("is in use by") => {
            }
            Err(e) => return Err(unwritten(&directory)(e)),
        }
        if stop.is_set() || begun.elapsed() > LONGEST_WAIT {
            let sentence = format!("shard {shard} is computed by another process");
            return Err(Refusal { exit: Exit::NotSolved, sentence });
        }
        std::thread::sleep(PERIOD);
    }
}

/// The status of a shard or a run that is complete.
fn of_complete(shard: &Shard) -> Exit {
    if shard.failed > 0 { Exit::Failures } else { Exit::Verified }
}

/// Runs the command of a shard.
fn run(command: &Command) -> Result<Exit, Refusal> {
    match command {
        Command::Montecarlo(command) => crate::montecarlo::montecarlo(command),
        Command::Sweep(command) => crate::sweep::run_sweep(command),
        _ => Err("a campaign is one of `montecarlo` or `sweep`".into()),
    }
}

fn merge(plan: &Plan) -> Result<Exit, Refusal> {
    crate::merge::merge(&MergeArguments {
        parts: vec![plan.shards_directory()],
        out: plan.merged(),
        partly: false,
        format: plan.format,
    })
}

/// Says on stdout how the work goes, unless one JSON object is asked for.
fn tell(text: &str) {
    if !is_json() {
        print(text);
    }
}

/// The knowledge of a pilot that is started again.
#[derive(Default, Serialize, Deserialize)]
struct Memory {
    /// Digest of all that decides the samples.
    digest: String,
    /// Jobs of a queue.
    jobs: Vec<String>,
}

impl Memory {
    fn place(plan: &Plan) -> PathBuf {
        plan.out().join("campaign.json")
    }

    fn read(place: &Path) -> Option<Self> {
        serde_json::from_str(&regular_file::read_text(place).ok()?).ok()
    }

    fn write(&self, place: &Path) -> Result<(), Refusal> {
        let text = serde_json::to_string_pretty(self).map_err(refusal)? + "\n";
        write_whole(place, text.as_bytes()).map_err(unwritten(place))
    }
}

fn pilot(plan: &Plan, a: &CampaignArguments) -> Result<Exit, Refusal> {
    check(plan)?;
    let out = plan.out();
    let _lock = claim(&out)?;
    for directory in ["log", "jobs", "shards"] {
        made(&out.join(directory))?;
    }
    let place = Memory::place(plan);
    let earlier = Memory::read(&place).unwrap_or_default();
    if place.exists() && earlier.digest != plan.digest() {
        let shown = out.display();
        return Err(format!(
            "`{shown}` has shards of another campaign (command, mission, arguments, samples, seed or shard size differ): name another `out`, \
             or remove it"
        )
        .into());
    }
    let mut open: BTreeSet<usize> =
        (0..plan.shards()).filter(|shard| plan.complete(*shard).is_none()).collect();
    let begun = plan.shards() - open.len();
    tell(&format!(
        "{} {} in {} shards, {begun} of them complete; {}\n",
        plan.total(),
        plan.command.counted(),
        plan.shards(),
        out.display()
    ));
    if open.is_empty() {
        return merge(plan);
    }
    let shards: Vec<usize> = open.iter().copied().collect();
    let mut engine: Box<dyn Engine + '_> = match plan.engine {
        EngineWord::Local => Box::new(Local::new(plan, &shards)),
        EngineWord::Dask => Box::new(Dask::start(plan, &shards)?),
        EngineWord::Slurm => match Slurm::of_earlier(&earlier.jobs) {
            Some(queued) => Box::new(queued),
            None => Box::new(Slurm::submit(plan, &shards)?),
        },
    };
    Memory { digest: plan.digest(), jobs: engine.jobs() }.write(&place)?;
    if !engine.jobs().is_empty() {
        tell(&format!("jobs {}\n", engine.jobs().join(", ")));
    }
    if let Some(exit) = follow(plan, a, &mut *engine, &mut open)? {
        return Ok(exit);
    }
    if !open.is_empty() {
        let list: Vec<String> = open.iter().take(5).map(usize::to_string).collect();
        let more = if open.len() > list.len() { ", .." } else { "" };
        let sentence = format!(
            "{} shards are not complete ({}{more}): see {}; the same command goes on with them",
            open.len(),
            list.join(", "),
            out.join("log").display()
        );
        return Err(Refusal { exit: Exit::NotSolved, sentence });
    }
    match complete(&plan.merged()).filter(|_| !engine.jobs().is_empty()) {
        // A job of the queue did it.
        Some(joined) => {
            let (done, failed, counted) = (joined.done, joined.failed, plan.command.counted());
            let merged = plan.merged();
            if is_json() {
                print_json(&json!({ counted: done, "without_result": failed, "merged": merged }))?;
            } else {
                print(&format!("{done} {counted}, {failed} without a result: {}\n", merged.display()));
            }
            Ok(of_complete(&joined))
        }
        None => merge(plan),
    }
}

/// Refuses, before anything is submitted, what every shard would refuse.
fn check(plan: &Plan) -> Result<(), Refusal> {
    table_of(plan.format)?;
    match plan.parsed(0)? {
        Command::Montecarlo(command) => command.mission.load().map(drop),
        Command::Sweep(command) => {
            cases(&apsides::registry(), &command.mission, &command.axes()?).map(drop).map_err(refusal)
        }
        _ => Err(format!("{}: `mission` is a name or a file", plan.file.display()).into()),
    }
}

/// Follows the shards until nothing is at work; the status where the work is left or cancelled before.
fn follow(
    plan: &Plan,
    a: &CampaignArguments,
    engine: &mut dyn Engine,
    open: &mut BTreeSet<usize>,
) -> Result<Option<Exit>, Refusal> {
    let stop = StopFlag::install();
    let progress = Progress::counted(stop, plan.total() as u64, plan.command.counted());
    let done = |open: &BTreeSet<usize>| {
        plan.total() - open.iter().map(|shard| plan.indices(*shard).len()).sum::<usize>()
    };
    let (first, begun) = (done(open), Instant::now());
    let mut told = begun;
    progress.advance(first as u64);
    let mut looks = Rhythm::start();
    loop {
        let at_work = engine.poll()?;
        let before = done(open);
        if looks.is_due() || !at_work {
            open.retain(|shard| plan.complete(*shard).is_none());
        }
        let now = done(open);
        if now > before {
            progress.advance((now - before) as u64);
            let rate = (now - first) as f64 / begun.elapsed().as_secs_f64();
            let left = (plan.total() - now) as f64 / rate;
            if !is_quiet() && told.elapsed() >= if progress.is_line() { PERIOD } else { BETWEEN_LINES } {
                progress.note(&format!(
                    "{now} of {} {}, {} left",
                    plan.total(),
                    plan.command.counted(),
                    duration(left)
                ));
                told = Instant::now();
            }
        }
        if !at_work {
            progress.finish();
            return Ok(None);
        }
        if stop.was_asked() {
            progress.finish();
            match on_interrupt(a.on_interrupt) {
                OnInterrupt::Leave => {
                    say(&format!("{}; the same command follows them again", engine.left()));
                    return Ok(Some(Exit::Interrupted));
                }
                _ => {
                    engine.cancel();
                    say(
                        "what was at work is cancelled; complete shards stay, the same command goes on with the others",
                    );
                    return Ok(Some(Exit::Interrupted));
                }
            }
        }
        std::thread::sleep(PERIOD);
    }
}

/// The fate of work where a signal ends the pilot: as the flag says, or as somebody at the terminal does; left without either.
fn on_interrupt(flag: OnInterrupt) -> OnInterrupt {
    let is_terminal = std::io::stdin().is_terminal() && std::io::stderr().is_terminal();
    if flag != OnInterrupt::Ask || !is_terminal {
        return if flag == OnInterrupt::Cancel { flag } else { OnInterrupt::Leave };
    }
    let _ = write!(std::io::stderr().lock(), "\nwork is under way: [l]eave it, or [c]ancel it? ");
    let mut answer = String::new();
    let _ = std::io::stdin().lock().read_line(&mut answer);
    if answer.trim_start().starts_with(['c', 'C']) { OnInterrupt::Cancel } else { OnInterrupt::Leave }
}

/// A time in words.
fn duration(seconds: f64) -> String {
    let whole = seconds.round().max(0.0) as u64;
    match whole {
        0..60 => format!("{whole} s"),
        60..3600 => format!("{} min {} s", whole / 60, whole % 60),
        _ => format!("{} h {} min", whole / 3600, whole % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::duration;

    #[test]
    fn times_have_two_units() {
        assert_eq!([0.4, 59.6, 61.0, 7300.0].map(duration), ["0 s", "1 min 0 s", "1 min 1 s", "2 h 1 min"]);
    }
}
