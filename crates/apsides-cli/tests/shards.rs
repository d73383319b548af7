//! Parts of large runs: joined to the bits of a single run, or refused by name.
#![allow(clippy::unwrap_used)]

mod support;

use std::fs;
use std::path::Path;
use std::process::Output;

use apsides::pipeline::digest::sha256;
use apsides::pipeline::shard::{SHARD, Shard, ShardState};
use support::{apsides, path, stderr, stdout, table};

/// All files of a run.
const FILES: [&str; 6] = [
    "montecarlo.csv",
    "montecarlo.toml",
    "montecarlo.json",
    "montecarlo.svg",
    "montecarlo.html",
    "shard.json",
];

const RUN: [&str; 9] = [
    "montecarlo",
    "chang-e-3-braking",
    "--position-m",
    "333",
    "--velocity-m-s",
    "1",
    "--quiet",
    "--samples",
    "60",
];

fn part(out: &Path, first: &str, count: &str, more: &[&str]) -> Output {
    apsides(&[&RUN[..], &["--first", first, "--count", count, "--out", &path(out)], more].concat())
}

fn merge(parts: &[&Path], out: &Path) -> Output {
    let parts: Vec<String> = parts.iter().map(|p| path(p)).collect();
    let parts: Vec<&str> = parts.iter().map(String::as_str).collect();
    apsides(&[&["merge"], &parts[..], &["--out", &path(out), "--quiet"]].concat())
}

fn assert_same(a: &Path, b: &Path, files: &[&str]) {
    for file in files {
        assert!(fs::read(a.join(file)).unwrap() == fs::read(b.join(file)).unwrap(), "{file}");
    }
}

/// The sentence of a merge that is refused, which has written nothing.
fn refusal(parts: &[&Path], out: &Path) -> String {
    let o = merge(parts, out);
    assert_eq!(o.status.code(), Some(2), "{}{}", stdout(&o), stderr(&o));
    assert!(!out.exists());
    stderr(&o)
}

#[test]
fn parts_are_joined_to_the_bits_of_a_single_run() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let whole = apsides(&[&RUN[..], &["--out", &path(&at("whole"))]].concat());
    assert_eq!(whole.status.code(), Some(0), "{}", stderr(&whole));
    for (first, count, threads) in [("0", "17", "1"), ("17", "1", "2"), ("18", "42", "3")] {
        let o = part(&at(&format!("parts/{first}")), first, count, &["--threads", threads]);
        assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    }
    let o = merge(&[&at("parts")], &at("merged"));
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert_same(&at("whole"), &at("merged"), &FILES);
    assert_eq!(stdout(&o).replace("merged", "whole"), stdout(&whole));
    // In any order, and by way of larger parts.
    let [a, b, c] = ["0", "17", "18"].map(|first| at("parts").join(first));
    let partly = ["merge", &path(&c), &path(&b), "--partly", "--out", &path(&at("larger"))];
    assert_eq!(apsides(&partly).status.code(), Some(0));
    assert_eq!(merge(&[&at("larger"), &a], &at("again")).status.code(), Some(0));
    assert_same(&at("whole"), &at("again"), &FILES);
    let v: serde_json::Value =
        serde_json::from_slice(&fs::read(at("whole").join("montecarlo.json")).unwrap()).unwrap();
    assert_eq!((&v["success"]["count"], &v["success"]["of"]), (&60.into(), &60.into()));
    assert!(v["spreads"][0]["least"]["sample"].is_u64() && v["covariance"][0].is_f64());

    // What does not make the whole, by name.
    let out = at("refused");
    assert!(refusal(&[&a, &c], &out).contains("index 17 of 60 are in no part"));
    assert!(refusal(&[&b, &c], &out).contains("indices 0 to 16 of 60 are in no part"));
    assert!(refusal(&[&a, &b], &out).contains("indices 18 to 59 of 60 are in no part"));
    let overlap = refusal(&[&a, &b, &c, &b], &out);
    assert!(overlap.contains("overlap: both have index 17") && overlap.contains(&path(&b)), "{overlap}");
    assert!(refusal(&[&at("nowhere")], &out).contains("is not there: parts are made by"));
    let same = merge(&[&a, &b, &c], &a);
    assert_eq!(same.status.code(), Some(2));
    assert!(stderr(&same).contains("is one of the parts"), "{}", stderr(&same));
}

#[test]
fn parts_of_other_runs_are_refused_by_name() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let (a, b, out) = (at("a"), at("b"), at("out"));
    assert_eq!(part(&a, "0", "30", &[]).status.code(), Some(0));
    for (more, words) in [
        (&["--seed", "1"][..], "the seed is 0 of the one, 1 of the other"),
        (&["--mass-kg", "1"], "`sigma of mass_kg` is 0.0 of the one, 1.0 of the other"),
        (&["--set", "isp_s=311"], "values of the mission differ"),
        (&["--guidance", "polynomial"], "values of the mission differ"),
    ] {
        let _ = fs::remove_dir_all(&b);
        let o = part(&b, "30", "30", more);
        assert!(matches!(o.status.code(), Some(0 | 6)), "{}", stderr(&o));
        let sentence = refusal(&[&a, &b], &out);
        assert!(sentence.contains(words) && sentence.contains("are not of one run"), "{sentence}");
    }
    let _ = fs::remove_dir_all(&b);
    assert_eq!(part(&b, "30", "30", &[]).status.code(), Some(0));
    let manifest = b.join(SHARD);
    let sound = Shard::read(&manifest).unwrap();
    let stated = |change: &dyn Fn(&mut Shard)| {
        let mut other = sound.clone();
        change(&mut other);
        fs::write(&manifest, other.to_file()).unwrap();
        refusal(&[&a, &b], &out)
    };
    assert!(
        stated(&|s| s.version = "0.0.9".into())
            .contains(concat!("the version of the program is ", env!("CARGO_PKG_VERSION")))
    );
    assert!(stated(&|s| s.total = 61).contains("the number of samples or cases is 60 of the one, 61"));
    assert!(stated(&|s| s.done = 29).contains("has 29 of 30 by its manifest, and is complete"));
    // A manifest that somebody edited.
    let text = sound.to_file();
    fs::write(&manifest, text.replace("\"first\": 30", "\"first\": 31")).unwrap();
    assert!(refusal(&[&a, &b], &out).contains("was altered"));
    fs::write(&manifest, &text[..100]).unwrap();
    assert!(refusal(&[&a, &b], &out).contains("is no manifest of a part"));
    fs::write(&manifest, &text).unwrap();
    // Another processor is of no consequence; other arithmetic is told, and no reason to refuse.
    let mut elsewhere = sound.clone();
    for (vectors, arithmetic, told) in [("x86-64-v5", &*sound.arithmetic, false), ("x86-64", "0", true)] {
        (elsewhere.vectors, elsewhere.arithmetic) = (vectors.into(), arithmetic.into());
        fs::write(&manifest, elsewhere.to_file()).unwrap();
        let o = merge(&[&a, &b], &at("told"));
        assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
        assert_eq!(stderr(&o).contains("machines whose arithmetic differs"), told, "{}", stderr(&o));
    }
}

/// Rows that are not those of the manifest.
#[test]
fn rows_that_were_altered_or_exchanged_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let (a, b, out) = (at("a"), at("b"), at("out"));
    assert_eq!(part(&a, "0", "30", &[]).status.code(), Some(0));
    assert_eq!(part(&b, "30", "30", &[]).status.code(), Some(0));
    assert_eq!(part(&at("seed"), "30", "30", &["--seed", "1"]).status.code(), Some(0));
    let rows = b.join("montecarlo.csv");
    let sound = fs::read_to_string(&rows).unwrap();
    let lines: Vec<&str> = sound.split_inclusive('\n').collect();
    let with = |text: &str| {
        fs::write(&rows, text).unwrap();
        refusal(&[&a, &b], &out)
    };
    // One of another seed, each of its rows sound by itself.
    let other = fs::read_to_string(at("seed").join("montecarlo.csv")).unwrap();
    assert!(with(&other).contains("has samples that are not those of its manifest"));
    let altered = lines[4].replacen('1', "2", 1);
    assert!(with(&sound.replace(lines[4], &altered)).contains("of index 33") || altered.starts_with("2"));
    assert!(with(&sound[..sound.len() - 1]).contains("no row of sample 59 where it should be"));
    assert!(with(&sound[..sound.len() / 2]).contains("no row of sample"));
    assert!(with(&lines[..10].concat()).contains("no row of sample 39 where it should be"));
    assert!(with(&[lines[0], lines[2], lines[1]].concat()).contains("no row of sample 30"));
    assert!(with("").contains("other columns"));
    fs::remove_file(&rows).unwrap();
    assert!(refusal(&[&a, &b], &out).contains("cannot read"));
    fs::write(&rows, &sound).unwrap();
    fs::write(b.join("montecarlo.toml"), "mission = \"lunar-direct\"\n").unwrap();
    assert!(refusal(&[&a, &b], &out).contains("is not the statement of its manifest"));
}

/// Failed flights and work that is not at its end have different statuses, and the manifest says which.
#[test]
fn a_status_tells_failures_from_work_that_is_left() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("flights");
    // Masses that are too slow for an unstable capsule.
    let slow = ["--set", "damping=unstable", "--set", "rate_limit_m_s=0.3", "--offset-m", "0.003"];
    let failing = [&["montecarlo", "moving-mass-cross", "--quiet", "--samples", "6"], &slow[..]].concat();
    let o = apsides(&[&failing[..], &["--out", &path(&out)]].concat());
    assert_eq!(o.status.code(), Some(6), "{}{}", stdout(&o), stderr(&o));
    let shard = Shard::read(&out.join(SHARD)).unwrap();
    assert_eq!((shard.state, shard.done), (ShardState::CompleteWithFailures, 6));
    assert!(shard.failed > 0 && stdout(&o).contains("% ended; 95 % confidence: "), "{}", stdout(&o));
    assert_eq!(merge(&[&out], &dir.path().join("merged")).status.code(), Some(6));

    let out = dir.path().join("limited");
    let shown = path(&out);
    let limited = [&RUN[..7], &["--samples", "10000000", "--time-limit", "0.5", "--out", &shown]].concat();
    let o = apsides(&limited);
    assert_eq!(o.status.code(), Some(3), "{}", stderr(&o));
    let shard = Shard::read(&out.join(SHARD)).unwrap();
    assert_eq!(shard.state, ShardState::Interrupted);
    assert!(shard.done > 0 && shard.done < shard.count && shard.rows_sha256.is_none());
    let o = merge(&[&out], &dir.path().join("some"));
    assert_eq!(o.status.code(), Some(3), "{}", stderr(&o));
    let told = format!("(interrupted) has {} of 10000000 samples", shard.done);
    assert!(stderr(&o).contains(&told), "{}", stderr(&o));

    for (range, words) in [
        (&["--first", "60"][..], "--first 60: the run has --samples 60, of indices 0 to 59"),
        (&["--first", "59", "--count", "2"], "--first 59 --count 2: the run has --samples 60"),
    ] {
        let o = apsides(&[&RUN[..], range].concat());
        assert_eq!(o.status.code(), Some(2));
        assert!(stderr(&o).contains(words), "{}", stderr(&o));
    }
}

/// A limit on the size of files stands for a full disk under one part.
#[cfg(unix)]
#[test]
fn faults_of_a_part_that_was_killed_are_kept() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("part");
    assert_eq!(part(&out, "0", "20", &[]).status.code(), Some(0));
    // As a kill would leave it: half of the rows, no manifest, faults of samples that are there and of one that is not, a line that was cut.
    let rows = fs::read_to_string(out.join("montecarlo.csv")).unwrap();
    let half: String = rows.lines().take(11).map(|line| format!("{line}\n")).collect();
    fs::write(out.join("montecarlo.csv"), half).unwrap();
    fs::remove_file(out.join(SHARD)).unwrap();
    let fault = |index: usize| format!("{{\"index\":{index},\"seed\":0,\"message\":\"broke off\"}}\n");
    let faults = out.join("faults.jsonl");
    fs::write(&faults, [fault(3), fault(15), "{\"index\":16,".into()].concat()).unwrap();
    let o = part(&out, "0", "20", &[]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert!(stderr(&o).contains("sample 3 of seed 0 has no result by a fault of the program (broke off)"));
    let shard = Shard::read(&out.join(SHARD)).unwrap();
    assert_eq!(shard.faults.iter().map(|fault| fault.index).collect::<Vec<_>>(), [3]);
    assert_eq!(fs::read_to_string(out.join("montecarlo.csv")).unwrap(), rows);
    assert!(!faults.exists());
    // The manifest has them from now on.
    assert!(stderr(&part(&out, "0", "20", &[])).contains("sample 3 of seed 0"));
}

#[test]
fn a_full_disk_under_one_part_is_told_and_loses_no_other() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let out = path(&at("parts/1"));
    let second = [&RUN[..], &["--first", "20", "--count", "40", "--out", &out]].concat();
    assert_eq!(part(&at("parts/0"), "0", "20", &[]).status.code(), Some(0));
    let script = "trap '' XFSZ; ulimit -f 20; exec \"$@\"";
    let o = std::process::Command::new("sh")
        .args(["-c", script, "sh", support::PROGRAM])
        .args(&second)
        .output()
        .unwrap();
    assert_eq!(o.status.code(), Some(5), "{}", stderr(&o));
    assert!(stderr(&o).contains("montecarlo.csv"), "{}", stderr(&o));
    let o = merge(&[&at("parts")], &at("some"));
    assert_eq!(o.status.code(), Some(3), "{}", stderr(&o));
    assert!(stderr(&o).contains("parts/1` (at work, or killed) has "), "{}", stderr(&o));
    // With room again the same command goes on from what is there.
    let o = apsides(&second);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert!(stdout(&o).contains("of them read from the file"), "{}", stdout(&o));
    let whole = apsides(&[&RUN[..], &["--out", &path(&at("whole"))]].concat());
    assert_eq!(whole.status.code(), Some(0));
    assert_eq!(merge(&[&at("parts")], &at("merged")).status.code(), Some(0));
    assert_same(&at("whole"), &at("merged"), &FILES);
    // Nor is there half a result where the disk of the merge is full.
    let merged = path(&at("full"));
    let o = std::process::Command::new("sh")
        .args(["-c", script, "sh", support::PROGRAM, "merge", &path(&at("parts")), "--out", &merged])
        .output()
        .unwrap();
    assert_eq!(o.status.code(), Some(5), "{}", stderr(&o));
    assert!(!at("full").exists(), "{:?}", fs::read_dir(at("full")).map(|d| d.count()));
}

/// Whole rows of a part that was killed count, with the faults among them; the manifest is that of its beginning then.
#[test]
fn rows_of_a_part_that_was_killed_are_joined() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let (a, b) = (at("parts/a"), at("parts/b"));
    assert_eq!(part(&a, "0", "20", &[]).status.code(), Some(0));
    assert_eq!(part(&b, "20", "40", &[]).status.code(), Some(0));
    let sound = fs::read_to_string(a.join("montecarlo.csv")).unwrap();
    let cut: String = sound.lines().take(12).map(|line| format!("{line}\n")).collect();
    fs::write(a.join("montecarlo.csv"), cut + "11,0.5").unwrap();
    let complete = Shard::read(&a.join(SHARD)).unwrap();
    let begun = Shard {
        state: ShardState::Running,
        done: 0,
        rows_sha256: None,
        linear_covariance: None,
        ..complete.clone()
    };
    fs::write(a.join(SHARD), begun.to_file()).unwrap();
    let fault = |index: usize| format!("{{\"index\":{index},\"seed\":0,\"message\":\"broke off\"}}\n");
    fs::write(a.join("faults.jsonl"), fault(3) + &fault(15)).unwrap();
    let o = merge(&[&at("parts")], &at("some"));
    assert_eq!(o.status.code(), Some(3), "{}", stderr(&o));
    let told = stderr(&o).replace('\n', " ");
    for words in [
        "(at work, or killed) has 11 of 20 samples, 9 are missing",
        "apsides montecarlo .. --first 0 --count 20 --out",
        "sample 3 of seed 0",
    ] {
        assert!(told.contains(words), "{words}: {told}");
    }
    assert!(!told.contains("sample 15") && stdout(&o).contains("51 flights of"), "{told}{}", stdout(&o));
    let joined = Shard::read(&at("some").join(SHARD)).unwrap();
    assert_eq!((joined.state, joined.done, joined.count), (ShardState::Interrupted, 51, 60));
    assert_eq!(joined.linear_covariance, complete.linear_covariance);
    // The rows of all parts, in their order.
    let rows = fs::read_to_string(at("some").join("montecarlo.csv")).unwrap();
    let indices: Vec<usize> =
        rows.lines().skip(1).map(|row| row.split(',').next().unwrap().parse().unwrap()).collect();
    assert_eq!(indices, (0..11).chain(20..60).collect::<Vec<_>>());
    // The command of the part goes on, and the same merge is complete.
    fs::remove_file(a.join("faults.jsonl")).unwrap();
    assert_eq!(part(&a, "0", "20", &[]).status.code(), Some(0));
    assert_eq!(fs::read_to_string(a.join("montecarlo.csv")).unwrap(), sound);
    assert_eq!(merge(&[&at("parts")], &at("some")).status.code(), Some(0));
    assert_eq!(Shard::read(&at("some").join(SHARD)).unwrap().state, ShardState::Complete);
}

#[test]
fn parts_of_a_sweep_are_joined() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let sweep = |file: &str, more: &[&str]| {
        let set = ["sweep", "lunar-perilune", "--quiet", "--set", "perilune_altitude_km=50,40,30,20,10"];
        apsides(&[&set[..], more, &["--out", &path(&at(file))]].concat())
    };
    for (file, more) in [
        ("whole", &["--chain", "2"][..]),
        ("parts/0", &["--chain", "2", "--count", "2"]),
        ("parts/1", &["--chain", "2", "--first", "2", "--count", "2"]),
        ("parts/2", &["--chain", "2", "--first", "4"]),
        ("neighbours", &[]),
        ("one-chain", &["--chain", "5"]),
    ] {
        let o = sweep(file, more);
        assert_eq!(o.status.code(), Some(0), "{file}: {}", stderr(&o));
    }
    let o = merge(&[&at("parts")], &at("merged"));
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert_eq!(table(&at("merged/sweep.csv")), table(&at("whole/sweep.csv")));
    // Without chains all cases are one, as they were.
    assert_eq!(table(&at("neighbours/sweep.csv")), table(&at("one-chain/sweep.csv")));
    assert!(!at("neighbours/shard.json").exists() && at("one-chain/shard.json").exists());
    let gap = refusal(&[&at("parts/0"), &at("parts/2")], &at("none"));
    assert!(gap.contains("indices 2 to 3 of 5 are in no part"), "{gap}");
    let other = refusal(&[&at("parts/0"), &at("one-chain")], &at("none"));
    assert!(other.contains("`--chain` is 5 of the one, 2 of the other"), "{other}");
    let text = fs::read_to_string(at("parts/1/sweep.csv")).unwrap();
    fs::write(at("parts/1/sweep.csv"), text.replace("optimal", "acceptable")).unwrap();
    assert!(refusal(&[&at("parts")], &at("none")).contains("its rows are not those of its manifest"));
    // A part whose last case was ended has one case less, and counts with the others.
    fs::write(at("parts/1/sweep.csv"), &text).unwrap();
    let sound = Shard::read(&at("parts/1/shard.json")).unwrap();
    let ended: Vec<&str> = text.lines().collect();
    let ended = format!("{}\n{}\n{}\n", ended[0], ended[1], ended[2].replace("optimal", "interrupted"));
    fs::write(at("parts/1/sweep.csv"), &ended).unwrap();
    let rows_sha256 = Some(sha256(ended.as_bytes()));
    let part = Shard { done: 1, state: ShardState::Interrupted, rows_sha256, ..sound };
    fs::write(at("parts/1/shard.json"), part.to_file()).unwrap();
    let o = merge(&[&at("parts")], &at("some"));
    assert_eq!(o.status.code(), Some(3), "{}", stderr(&o));
    assert!(stderr(&o).contains("(interrupted) has 1 of 2 cases, 1 are missing"), "{}", stderr(&o));
    assert_eq!(table(&at("some/sweep.csv")).len(), table(&at("whole/sweep.csv")).len() - 1);
    let some = Shard::read(&at("some/shard.json")).unwrap();
    assert_eq!((some.done, some.count, some.state), (4, 5, ShardState::Interrupted));
    let within = sweep("parts/x", &["--chain", "2", "--first", "1"]);
    assert_eq!(within.status.code(), Some(2));
    assert!(stderr(&within).contains("case 1 is not the first of a chain of 2 cases"), "{}", stderr(&within));
    assert_eq!(sweep("parts/x", &["--first", "2"]).status.code(), Some(2));
    let beyond = sweep("parts/x", &["--chain", "2", "--first", "6"]);
    assert!(stderr(&beyond).contains("the sweep has 5 cases"), "{}", stderr(&beyond));
}
