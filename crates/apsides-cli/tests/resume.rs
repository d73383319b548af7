//! Work that is killed or interrupted goes on to what it would have been.
#![allow(clippy::unwrap_used)]
#![cfg(unix)]

mod support;

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use support::{apsides, path, signal, spawn, stderr, stdout};

/// Solves that are kept in a directory.
fn kept(dir: &Path) -> usize {
    let ends = |e: &fs::DirEntry| e.path().extension().is_some_and(|x| x == "json");
    fs::read_dir(dir).map_or(0, |entries| entries.filter_map(Result::ok).filter(ends).count())
}

/// Starts a command and ends it by a signal once so many solves are kept.
fn ended(arguments: &[&str], solves: &Path, count: usize, name: &str) {
    let mut child = spawn(arguments);
    let begin = Instant::now();
    while kept(solves) < count {
        assert!(
            child.try_wait().unwrap().is_none() && begin.elapsed() < Duration::from_secs(60),
            "{arguments:?}"
        );
        std::thread::sleep(Duration::from_millis(2));
    }
    signal(&child, name);
    let code = child.wait().unwrap().code();
    assert_eq!(code, if name == "-KILL" { None } else { Some(130) }, "{arguments:?}");
    assert!(kept(solves) >= count, "{arguments:?}");
}

/// The rows of a table without the columns of wall-clock times.
fn table(file: &Path) -> Vec<Vec<String>> {
    let text = fs::read_to_string(file).unwrap();
    let heads: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let row = |line: &str| {
        let cells = line.split(',').map(str::to_owned).zip(&heads);
        cells.filter(|(_, head)| !head.ends_with("_ms")).map(|(cell, _)| cell).collect()
    };
    text.lines().map(row).collect()
}

#[test]
fn a_sweep_that_is_killed_goes_on_case_by_case() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let altitudes = "perilune_altitude_km=50,45,40,35,30,25,20,15,10,5";
    let sweep = |file: &str| {
        let mut all: Vec<String> =
            ["sweep", "lunar-perilune", "--quiet", "--sensitivity", "--set", altitudes]
                .map(str::to_owned)
                .into();
        all.extend(["--out".into(), path(&at(file))]);
        all
    };
    let words = |all: &[String]| all.iter().map(String::as_str).collect::<Vec<_>>().join("\n");
    let (whole, parted) = (words(&sweep("whole")), words(&sweep("parted")));
    let (whole, parted): (Vec<&str>, Vec<&str>) = (whole.lines().collect(), parted.lines().collect());
    let o = apsides(&whole);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert!(!stdout(&o).contains("earlier run"), "{}", stdout(&o));
    let solves = at("parted/.apsides-solves");
    ended(&parted, &solves, 2, "-KILL");
    assert!(!at("parted/sweep.csv").exists());
    ended(&parted, &solves, 5, "-INT");
    // Rows so far, and the solves from which it goes on.
    assert!(table(&at("parted/sweep.csv")).len() >= 5);
    let o = apsides(&parted);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert_eq!(table(&at("parted/sweep.csv")), table(&at("whole/sweep.csv")));
    assert!(stdout(&o).contains("taken over from an earlier run: "), "{}", stdout(&o));
    assert!(!solves.exists() && !at("whole/.apsides-solves").exists());
}

#[test]
fn a_footprint_that_is_killed_goes_on() {
    let dir = tempfile::tempdir().unwrap();
    let [whole, parted] = ["whole", "parted"].map(|name| dir.path().join(name));
    let of = |out: &Path| {
        let mut all: Vec<String> =
            ["footprint", "capsule-reentry", "--bearings", "3", "--quiet"].map(str::to_owned).into();
        for limit in ["dynamic_pressure_limit_kpa=inf", "load_limit_m_s2=inf", "heat_rate_limit_kw_m2=inf"] {
            all.extend(["--set".into(), limit.into()]);
        }
        all.extend(["--out".into(), path(out)]);
        all
    };
    let (a, b) = (of(&whole), of(&parted));
    let [a, b] = [&a, &b].map(|all| all.iter().map(String::as_str).collect::<Vec<_>>());
    let o = apsides(&a);
    assert!(matches!(o.status.code(), Some(0 | 4)), "{}", stderr(&o));
    ended(&b, &parted.join(".apsides-solves"), 3, "-KILL");
    let again = apsides(&b);
    assert_eq!(again.status.code(), o.status.code(), "{}", stderr(&again));
    for file in ["footprint.csv", "footprint.json"] {
        assert_eq!(fs::read(whole.join(file)).unwrap(), fs::read(parted.join(file)).unwrap(), "{file}");
    }
    assert!(!parted.join(".apsides-solves").exists() && !parted.join(".apsides-lock").exists());
}

#[test]
fn a_reproduction_that_is_killed_goes_on() {
    let dir = tempfile::tempdir().unwrap();
    let [whole, parted] = ["whole", "parted"].map(|name| path(&dir.path().join(name)));
    let of = |out| ["reproduce", "lunar-landing", "--quiet", "--out", out];
    assert_eq!(apsides(&of(&whole)).status.code(), Some(0));
    ended(&of(&parted), &Path::new(&parted).join(".apsides-solves"), 4, "-KILL");
    let o = apsides(&of(&parted));
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    let [a, b] = [&whole, &parted].map(|out| fs::read(Path::new(out).join("reproduction.csv")).unwrap());
    assert!(a == b, "{}", String::from_utf8_lossy(&b));
}

#[test]
fn a_monte_carlo_run_that_is_killed_goes_on() {
    let dir = tempfile::tempdir().unwrap();
    let [whole, parted] = ["whole", "parted"].map(|name| dir.path().join(name));
    let of = |samples: &str, out: &Path| {
        let all = ["montecarlo", "chang-e-3-braking", "--position-m", "333", "--quiet", "--samples"];
        let mut all: Vec<String> = all.map(str::to_owned).into();
        all.extend([samples.to_owned(), "--out".into(), path(out)]);
        all
    };
    let run = |all: &[String]| apsides(&all.iter().map(String::as_str).collect::<Vec<_>>());
    // Killed at times that fall anywhere: before the first sample, between two, in a line.
    for (k, name) in ["-KILL", "-TERM", "-KILL"].into_iter().enumerate() {
        let all = of("1000000", &parted);
        let mut child = spawn(&all.iter().map(String::as_str).collect::<Vec<_>>());
        std::thread::sleep(Duration::from_millis(300 + 170 * k as u64));
        signal(&child, name);
        child.wait().unwrap();
    }
    let rows = |out: &Path| fs::read_to_string(out.join("montecarlo.csv")).unwrap();
    let count = rows(&parted).lines().count() + 50;
    let samples = count.to_string();
    assert_eq!(run(&of(&samples, &parted)).status.code(), Some(0));
    assert_eq!(run(&of(&samples, &whole)).status.code(), Some(0));
    assert!(rows(&whole) == rows(&parted));
    let statistics = |out: &Path| fs::read(out.join("montecarlo.json")).unwrap();
    assert!(statistics(&whole) == statistics(&parted));
}

#[test]
fn two_processes_on_one_directory_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let out = path(dir.path());
    let mut first = spawn(&[
        "montecarlo",
        "chang-e-3-braking",
        "--quiet",
        "--samples",
        "10000000",
        "--position-m",
        "9",
        "--out",
        &out,
    ]);
    let begin = Instant::now();
    while !dir.path().join("montecarlo.csv").exists() && begin.elapsed() < Duration::from_secs(30) {
        std::thread::sleep(Duration::from_millis(5));
    }
    for arguments in [
        &["solve", "lunar-direct", "--quiet", "--out", &out][..],
        &["simulate", "moving-mass-cross", "--out", &out],
        &["reproduce", "lunar-landing", "--quiet", "--out", &out],
    ] {
        let o = apsides(arguments);
        assert_eq!(o.status.code(), Some(2), "{}", stderr(&o));
        let holder = format!("is in use by process {} (apsides montecarlo chang-e-3-braking)", first.id());
        assert!(stderr(&o).contains(&holder), "{}", stderr(&o));
    }
    // The lock of a process that was killed holds nobody off.
    first.kill().unwrap();
    first.wait().unwrap();
    assert!(dir.path().join(".apsides-lock").exists());
    let o = apsides(&["solve", "lunar-direct", "--quiet", "--out", &out]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert!(!dir.path().join(".apsides-lock").exists());
}
