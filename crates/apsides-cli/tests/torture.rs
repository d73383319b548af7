//! Any key of any mission at values that nobody means: a documented status in time, and a sentence that names the key.
//!
//! A sample runs with the tests, all of it by `cargo xtask torture`.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod support;

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use support::apsides;

/// Longest time of an answer.
const IN_TIME: Duration = Duration::from_secs(20);

/// One of so many values is in the sample; a prime, so that all kinds of values and keys are met.
const ONE_OF: usize = 101;
/// One of so many of these is solved too.
const SOLVED_ONE_OF: usize = 11;

fn lines(arguments: &[&str]) -> Vec<String> {
    let o = apsides(arguments);
    assert_eq!(o.status.code(), Some(0), "{arguments:?}");
    String::from_utf8(o.stdout).unwrap().lines().map(str::to_owned).collect()
}

/// A mission with one key at one value.
struct Trial {
    mission: String,
    key: String,
    value: String,
    simulated: bool,
}

/// Values of a key: those that are extreme for all, its limits, and just outside of them.
fn values(allowed: &str) -> Vec<String> {
    let mut values: Vec<String> =
        ["0", "-1", "1e-300", "1e300", "-1e300", "nan", "inf", "-inf", "0x10", "a word", "\"\""]
            .map(str::to_owned)
            .into();
    let is_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+' | 'e');
    let limits =
        allowed.split(|c: char| !is_number(c)).filter_map(|t| t.trim_end_matches('.').parse::<f64>().ok());
    for limit in limits {
        let step = 1e-9 * limit.abs() + 1e-12;
        values.extend([limit, limit - step, limit + step].map(|v| v.to_string()));
    }
    values
}

fn trials() -> Vec<Trial> {
    let mut all = Vec::new();
    for line in lines(&["missions"]) {
        let mission = line.split_whitespace().next().unwrap().to_owned();
        let simulated = mission.starts_with("moving-mass");
        for line in lines(&["missions", &mission]).iter().filter(|l| l.contains(" = ")) {
            let key = line.split_whitespace().next().unwrap().to_owned();
            if key == "mission" || key.ends_with(':') {
                continue;
            }
            let allowed = line.rsplit_once('(').map_or("", |(_, allowed)| allowed);
            for value in values(allowed) {
                all.push(Trial { mission: mission.clone(), key: key.clone(), value, simulated });
            }
        }
    }
    all
}

/// Counts of statuses, the longest time, and all that is not as it should be.
#[derive(Default)]
struct Account {
    statuses: BTreeMap<String, usize>,
    longest: Duration,
    failures: Vec<String>,
}

impl Account {
    fn run(&mut self, trial: &Trial, command: &[&str], allowed: &[i32]) -> Option<i32> {
        let set = format!("{}={}", trial.key, trial.value);
        let arguments = [&[command[0], &trial.mission, "--set", &set], &command[1..]].concat();
        let begin = Instant::now();
        let o = apsides(&arguments);
        let time = begin.elapsed();
        let (code, text) = (o.status.code(), String::from_utf8_lossy(&o.stderr).into_owned());
        *self.statuses.entry(format!("{} {code:?}", command[0])).or_default() += 1;
        self.longest = self.longest.max(time);
        let mut fail =
            |what: &str| self.failures.push(format!("{what}: {arguments:?}: {code:?} {time:?} {text}"));
        if !code.is_some_and(|code| allowed.contains(&code)) {
            fail("status");
        }
        if time > IN_TIME {
            fail("time");
        }
        // A sentence; of a problem's own equations the line in its file below it.
        let is_sentence = text.lines().skip(1).all(|line| line.starts_with("  "));
        if code == Some(2) && (!text.contains(&trial.key) || !is_sentence || text.len() > 1500) {
            fail("sentence");
        }
        code
    }

    fn close(self) {
        println!("{:?}, longest {:?}", self.statuses, self.longest);
        assert!(self.failures.is_empty(), "{} failures:\n{}", self.failures.len(), self.failures.join("\n"));
    }
}

const CHECK: [&str; 3] = ["check", "--time-limit", "10"];
const SOLVE: [&str; 6] = ["solve", "--quiet", "--time-limit", "2", "--memory", "1024"];
const SIMULATE: [&str; 4] = ["simulate", "--quiet", "--time-limit", "2"];

fn torture(every: usize, solved_every: usize) {
    let mut account = Account::default();
    let mut taken = 0;
    for (k, trial) in trials().iter().enumerate() {
        if k % every != 0 || account.run(trial, &CHECK, &[0, 2, 3]) != Some(0) {
            continue;
        }
        taken += 1;
        if taken % solved_every == 0 {
            let command = if trial.simulated { &SIMULATE[..] } else { &SOLVE };
            account.run(trial, command, &[0, 2, 3, 4]);
        }
    }
    account.close();
}

#[test]
fn a_sample_of_keys_at_values_that_nobody_means() {
    torture(ONE_OF, SOLVED_ONE_OF);
}

#[test]
#[ignore = "hours; `cargo xtask torture` runs it"]
fn every_key_at_every_value_that_nobody_means() {
    torture(1, 1);
}
