//! Campaigns on this machine: shards by processes, killed and interrupted, joined to a single run.
#![allow(clippy::unwrap_used)]
#![cfg(unix)]

mod support;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Child;
use std::time::{Duration, Instant};

use support::{apsides, path, signal, spawn, stderr, stdout, table};

const SAMPLES: &str = "6000";

/// A campaign of twelve shards, two at a time.
fn file(dir: &Path, more: &str) -> PathBuf {
    let file = dir.join("run.toml");
    let text = format!(
        "mission = \"chang-e-3-braking\"\narguments = [\"--position-m\", \"333\"]\nsamples = {SAMPLES}\nshard_size = 500\n\
         workers = 2\n{more}"
    );
    fs::write(&file, text).unwrap();
    file
}

fn whole(dir: &Path) -> PathBuf {
    let out = dir.join("whole");
    let run =
        ["montecarlo", "chang-e-3-braking", "--position-m", "333", "--quiet", "--samples", SAMPLES, "--out"];
    assert_eq!(apsides(&[&run[..], &[&path(&out)]].concat()).status.code(), Some(0));
    out
}

fn assert_joined(dir: &Path, whole: &Path) {
    for file in ["montecarlo.csv", "montecarlo.json", "montecarlo.svg", "montecarlo.html", "shard.json"] {
        let merged = dir.join("run/merged").join(file);
        assert!(fs::read(whole.join(file)).unwrap() == fs::read(merged).unwrap(), "{file}");
    }
}

/// Processes that compute shards, by the locks.
fn at_work(dir: &Path) -> Vec<u32> {
    let shards = fs::read_dir(dir.join("run/shards")).into_iter().flatten().flatten();
    let locks = shards.filter_map(|shard| fs::read_to_string(shard.path().join(".apsides-lock")).ok());
    locks.filter_map(|words| words.split_whitespace().nth(1)?.parse().ok()).filter(|p| is_alive(*p)).collect()
}

fn is_alive(process: u32) -> bool {
    Path::new(&format!("/proc/{process}/exe")).exists()
}

/// Starts the pilot and waits until so many shards are at work.
fn begun(arguments: &[&str], dir: &Path, count: usize) -> (Child, Vec<u32>) {
    let mut pilot = spawn(arguments);
    let clock = Instant::now();
    loop {
        let processes = at_work(dir);
        if processes.len() >= count {
            return (pilot, processes);
        }
        assert!(pilot.try_wait().unwrap().is_none() && clock.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn kill(process: u32) {
    let _ = std::process::Command::new("kill").args(["-KILL", &process.to_string()]).status();
}

#[test]
fn a_killed_shard_and_a_killed_pilot_lose_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let whole = whole(dir.path());
    let file = path(&file(dir.path(), ""));
    assert_eq!(stdout(&apsides(&["campaign", &file, "--shards"])), "12\n");
    let campaign = ["campaign", &file, "--quiet"];
    // A shard: it is tried again.
    let (mut pilot, processes) = begun(&campaign, dir.path(), 1);
    kill(processes[0]);
    // The pilot: what was at work goes on without it.
    std::thread::sleep(Duration::from_millis(300));
    pilot.kill().unwrap();
    pilot.wait().unwrap();
    let o = apsides(&campaign);
    assert_eq!(o.status.code(), Some(0), "{}{}", stdout(&o), stderr(&o));
    assert_joined(dir.path(), &whole);
    // All is there: nothing is flown again.
    let manifest = dir.path().join("run/shards/000000/shard.json");
    let before = fs::metadata(&manifest).unwrap().modified().unwrap();
    let o = apsides(&campaign);
    assert!(stdout(&o).contains("12 shards, 12 of them complete"), "{}", stdout(&o));
    assert_eq!(fs::metadata(&manifest).unwrap().modified().unwrap(), before);

    // A single shard, as other schedulers compute it.
    fs::remove_dir_all(dir.path().join("run/shards/000007")).unwrap();
    let refused = apsides(&["campaign", &file, "--merge"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(stderr(&refused).contains("indices 3500 to 3999 of 6000 are in no part"), "{}", stderr(&refused));
    assert_eq!(apsides(&["campaign", &file, "--shard", "3", "--of", "4"]).status.code(), Some(0));
    assert_eq!(apsides(&["campaign", &file, "--merge"]).status.code(), Some(0));
    assert_joined(dir.path(), &whole);
    let o = apsides(&["campaign", &file, "--shard", "12"]);
    assert!(stderr(&o).contains("the campaign has 12 shards"), "{}", stderr(&o));
}

#[test]
fn an_interrupt_leaves_or_cancels_what_is_at_work() {
    let dir = tempfile::tempdir().unwrap();
    let file = path(&file(dir.path(), ""));
    for (what, left) in [("cancel", false), ("leave", true)] {
        let (mut pilot, processes) =
            begun(&["campaign", &file, "--quiet", "--on-interrupt", what], dir.path(), 1);
        signal(&pilot, "-INT");
        assert_eq!(pilot.wait().unwrap().code(), Some(130), "{what}");
        if !left {
            assert!(processes.iter().all(|process| !is_alive(*process)), "{what}");
        }
    }
    let o = apsides(&["campaign", &file, "--quiet"]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert_joined(dir.path(), &whole(dir.path()));
}

#[test]
fn a_sweep_is_joined_to_its_table() {
    let dir = tempfile::tempdir().unwrap();
    let set = ["--set", "perilune_altitude_km=50,40,30,20,10", "--chain", "2"];
    let whole = path(&dir.path().join("whole"));
    let o = apsides(&[&["sweep", "lunar-perilune", "--quiet", "--out", &whole], &set[..]].concat());
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    let file = dir.path().join("run.toml");
    let arguments = set.map(|word| format!("{word:?}")).join(", ");
    fs::write(
        &file,
        format!(
            "command = \"sweep\"\nmission = \"lunar-perilune\"\narguments = [{arguments}]\nshard_size = 2\n"
        ),
    )
    .unwrap();
    let o = apsides(&["campaign", &path(&file), "--shards"]);
    assert_eq!(stdout(&o), "3\n", "{}", stderr(&o));
    let o = apsides(&["campaign", &path(&file), "--shard", "1"]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    let o = apsides(&["campaign", &path(&file), "--quiet"]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert!(stdout(&o).starts_with("5 cases in 3 shards, 1 of them complete"), "{}", stdout(&o));
    let merged = dir.path().join("run/merged/sweep.csv");
    assert_eq!(table(&merged), table(&Path::new(&whole).join("sweep.csv")));
    assert_eq!(table(&merged).len(), 6);
    // Nothing but those of the shards.
    let shards = fs::read_dir(dir.path().join("run/shards")).unwrap();
    assert_eq!(shards.count(), 3);
}

#[test]
fn what_is_wrong_with_a_campaign_is_said_before_its_work() {
    let dir = tempfile::tempdir().unwrap();
    let refused = |text: &str| {
        let file = dir.path().join("run.toml");
        fs::write(&file, text).unwrap();
        let o = apsides(&["campaign", &path(&file), "--quiet"]);
        assert_eq!(o.status.code(), Some(2), "{text}: {}", stderr(&o));
        stderr(&o)
    };
    let sizes = "samples = 100\nshard_size = 50\n";
    for (text, words) in [
        ("mission = \"lunar\"\nshard_size = 1\n", "`samples` is missing: those of the whole run"),
        (
            "mission = \"lunar\"\ncommand = \"sweep\"\nsamples = 5\nshard_size = 1\n",
            "`samples` is of `montecarlo`",
        ),
        ("mission = \"lunar\"\ncommand = \"sweep\"\nshard_size = 1\n", "`arguments` need `--chain N`"),
        (
            "mission = \"lunar\"\ncommand = \"sweep\"\narguments = [\"--chain\", \"2\"]\nshard_size = 3\n",
            "a multiple of the chain, 2",
        ),
        (
            "mission = \"lunar-perilun\"\ncommand = \"sweep\"\narguments = [\"--chain\", \"2\"]\nshard_size = 2\n",
            "the nearest is `lunar-perilune`",
        ),
        (
            "mission = \"chang-e-3-braking\"\nsamples = 1\nshard_size = 1\n",
            "`samples` is 1, allowed is a whole number from 2 to",
        ),
        (
            "mission = \"chang-e-3-braking\"\nsamples = 10\nshard_size = 0\n",
            "`shard_size` is 0, allowed is a whole number from 1 to",
        ),
        (&format!("mission = \"chang-e-3-brakin\"\n{sizes}"), "the nearest is `chang-e-3-braking`"),
        (&format!("mission = \"--json\"\n{sizes}"), "`mission` or `arguments`"),
        (
            &format!("mission = \"chang-e-3-braking\"\narguments = [\"--seed\", \"1\"]\n{sizes}"),
            "`arguments` have --seed",
        ),
        (
            &format!("mission = \"chang-e-3-braking\"\narguments = [\"--positon-m\", \"1\"]\n{sizes}"),
            "--position-m",
        ),
        (&format!("mission = \"chang-e-3-braking\"\nworkers = 0\n{sizes}"), "`workers` is 0"),
        (
            &format!("mission = \"chang-e-3-braking\"\ntime_limit_s = nan\n{sizes}"),
            "run.toml`, line 2: `time_limit_s` is NaN, allowed is a number above 0",
        ),
    ] {
        let sentence = refused(text);
        assert!(sentence.contains(words), "{words}: {sentence}");
    }
    let o = apsides(&["campaign", &path(&dir.path().join("none.toml"))]);
    assert!(stderr(&o).contains("none.toml"), "{}", stderr(&o));
    // What a shard refuses ends the campaign, with its sentence.
    let sentence =
        refused(&format!("mission = \"chang-e-3-braking\"\narguments = [\"--position-m\", \"-1\"]\n{sizes}"));
    assert!(
        sentence.contains("shard 0 ended with status 2") && sentence.contains("standard deviation"),
        "{sentence}"
    );
    // Another campaign in the same directory.
    let sentence = refused(&format!("mission = \"chang-e-3-braking\"\nseed = 3\n{sizes}"));
    assert!(sentence.contains("has shards of another campaign"), "{sentence}");
}
