//! `hazard` and `certify` ended at any time: what is there is whole, and the same command makes the same.
#![allow(clippy::unwrap_used, clippy::print_stdout)]
#![cfg(unix)]

mod support;

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use support::{PROGRAM, signal, stderr};

/// Moments at which each signal comes, spread over the time of a run to its end.
const MOMENTS: u32 = 6;

fn start(dir: &Path, arguments: &[&str]) -> Child {
    let mut command = Command::new(PROGRAM);
    command.current_dir(dir).args(arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

fn whole(dir: &Path, arguments: &[&str]) -> (Output, Duration) {
    let begin = Instant::now();
    (Command::new(PROGRAM).current_dir(dir).args(arguments).output().unwrap(), begin.elapsed())
}

/// Runs a command, whose status is `judged` where it comes to its end, and ends it by a signal at several moments of its time; gives the
/// statuses.
fn ended_at_all_moments(
    dir: &Path,
    arguments: &[&str],
    time: Duration,
    judged: Option<i32>,
    mut after: impl FnMut(&str),
) -> BTreeMap<String, u32> {
    let mut statuses = BTreeMap::new();
    for name in ["-INT", "-TERM", "-KILL"] {
        for k in 0..MOMENTS {
            let mut child = start(dir, arguments);
            std::thread::sleep(time * k / MOMENTS);
            signal(&child, name);
            let code = child.wait().unwrap().code();
            *statuses.entry(format!("{name} {code:?}")).or_default() += 1;
            // At the first moment the program may not have its handlers yet: the signal ends it.
            let by_signal = name == "-KILL" || k == 0;
            let ended = if name == "-KILL" { None } else { Some(130) };
            assert!(code == ended || code == judged || (by_signal && code.is_none()), "{name} {k}: {code:?}");
            after(name);
        }
    }
    println!("{arguments:?}: {time:?} to the end, {statuses:?}");
    statuses
}

/// Names and bytes of the files of a directory, without those that are in the making.
fn files(dir: &Path) -> BTreeMap<String, Vec<u8>> {
    let Ok(entries) = std::fs::read_dir(dir) else { return BTreeMap::new() };
    let files = entries.filter_map(Result::ok).map(|e| (e.file_name().into_string().unwrap(), e.path()));
    files
        .filter(|(name, _)| !name.starts_with(".apsides-"))
        .map(|(name, at)| (name, std::fs::read(at).unwrap()))
        .collect()
}

/// Hazards in bands and in memory: after a signal each file is that of the whole run or not there, and the same command ends as if nothing
/// had been.
#[test]
fn hazards_that_are_interrupted_leave_whole_files() {
    let dir = tempfile::tempdir().unwrap();
    let [first, second] = ["first", "second"].map(|name| dir.path().join(name));
    for place in [&first, &second] {
        std::fs::create_dir(place).unwrap();
        let gen_map =
            ["terrain", "gen", "map.tif", "--rows", "700", "--cols", "900", "--quiet", "--seed", "2"];
        assert_eq!(whole(place, &gen_map).0.status.code(), Some(0));
    }
    for (memory, out) in [("1024", "in-memory"), ("24", "in-bands")] {
        let arguments = ["hazard", "map.tif", "--quiet", "--memory", memory, "--out", out];
        let (o, time) = whole(&first, &arguments);
        assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
        let expected = files(&first.join(out));
        assert!(expected.len() >= 6, "{:?}", expected.keys());
        let statuses = ended_at_all_moments(&second, &arguments, time, Some(0), |name| {
            for (file, bytes) in files(&second.join(out)) {
                assert!(expected.get(&file) == Some(&bytes), "{name}: {file} is a part");
            }
        });
        assert!(statuses.iter().any(|(status, _)| status.contains("130")), "{statuses:?}");
        let (o, _) = whole(&second, &arguments);
        assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
        assert!(files(&second.join(out)) == expected);
        let left: Vec<_> =
            std::fs::read_dir(second.join(out)).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert_eq!(left.len(), expected.len(), "{left:?}");
    }
}

/// A judgement writes no file: it ends with the status of an interrupt, and the next one is the same as before.
#[test]
fn a_judgement_that_is_interrupted_has_the_status_of_an_interrupt() {
    let dir = tempfile::tempdir().unwrap();
    let solve = ["solve", "lunar-two-phase", "--quiet", "--out", "results"];
    assert_eq!(whole(dir.path(), &solve).0.status.code(), Some(0));
    let arguments = ["certify", "lunar-two-phase", "results/trajectory.csv"];
    let (before, time) = whole(dir.path(), &arguments);
    // The nodes of the intervals give back the controls of the solution.
    let judged = before.status.code();
    assert_eq!(judged, Some(0), "{}", stderr(&before));
    ended_at_all_moments(dir.path(), &arguments, time, judged, |_| {});
    let (after, _) = whole(dir.path(), &arguments);
    assert_eq!((after.status.code(), after.stdout), (judged, before.stdout));
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1, "the results alone");
}
