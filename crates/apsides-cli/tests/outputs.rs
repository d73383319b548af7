//! Outputs that cannot be written, interrupts, and the table of exit statuses.
#![allow(clippy::unwrap_used)]
#![cfg(unix)]

mod support;

use std::fs;
use std::os::unix::fs::{FileTypeExt as _, symlink};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use support::{PROGRAM, apsides, path, signal, spawn, stderr, stdout};

fn names(dir: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(dir).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// The bytes of a good file that stays.
const GOOD: &[u8] = b"a good map";

#[test]
fn a_stdout_that_takes_nothing_is_an_error_and_a_closed_pipe_is_none() {
    let full = || Stdio::from(fs::File::options().write(true).open("/dev/full").unwrap());
    let dir = tempfile::tempdir().unwrap();
    let out = path(&dir.path().join("results"));
    for arguments in [
        &["missions"][..],
        &["bodies"],
        &["problems"],
        &["reproduce"],
        &["--help"],
        &["--version"],
        &["check", "lunar-direct"],
        &["new", "problem", &path(&dir.path().join("problem.toml"))],
        &["solve", "lunar-direct", "--quiet", "--json"],
        &["solve", "lunar-direct", "--quiet", "--out", &out],
        &["verify", &out],
        &["sweep", "lunar-direct", "--quiet", "--set", "thrust_n=440"],
        &["terrain", "gen", &path(&dir.path().join("map.tif")), "--rows", "20", "--cols", "20", "--quiet"],
        &["terrain", "info", &path(&dir.path().join("map.tif"))],
    ] {
        let o = Command::new(PROGRAM).args(arguments).stdout(full()).output().unwrap();
        assert_eq!(o.status.code(), Some(5), "{arguments:?}: {}", stderr(&o));
        assert!(stderr(&o).contains("stdout could not be written: No space left"), "{}", stderr(&o));
    }
    // What went to the disk is there.
    assert!(Path::new(&out).join("trajectory.csv").is_file() && dir.path().join("map.tif").is_file());
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let o = Command::new(PROGRAM).args(["missions", "lunar-direct"]).stdout(writer).output().unwrap();
    assert_eq!((o.status.code(), stderr(&o)), (Some(0), String::new()));
}

/// Each way of naming an output: nothing but a file is replaced, and a link stays one.
#[test]
fn devices_are_refused_by_name_and_links_are_followed() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let pipe = at("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let pipe = path(&pipe);
    let made = |out: &str| apsides(&["terrain", "gen", out, "--rows", "20", "--cols", "20", "--quiet"]);
    let sweep = ["sweep", "lunar-direct", "--quiet", "--set", "thrust_n=440"];
    for o in [
        made(&pipe),
        apsides(&[&sweep[..], &["--sensitivity", "--figure", &pipe]].concat()),
        apsides(&["solve", "capsule-reentry", "--method", "two-layer", "--quiet", "--checkpoint", &pipe]),
    ] {
        assert_eq!(o.status.code(), Some(2), "{}{}", stdout(&o), stderr(&o));
        assert!(stderr(&o).contains("pipe: is a pipe; give a file"), "{}", stderr(&o));
        assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
    }
    // Directories in place of files, files in place of directories; nothing is left behind.
    for arguments in [
        &["solve", "lunar-direct", "--quiet", "--out", &pipe][..],
        &["simulate", "moving-mass-cross", "--out", &pipe],
        &["sweep", "lunar-direct", "--quiet", "--set", "thrust_n=440", "--out", &pipe],
        &["tune", "moving-mass-cross", "--out", &pipe],
        &["montecarlo", "geo-2-burn", "--out", &path(&at("mc"))],
        &[
            "montecarlo",
            "chang-e-3-braking",
            "--samples",
            "2",
            "--position-m",
            "-1",
            "--out",
            &path(&at("mc")),
        ],
        &["solve", "lunar-direct", "--method", "indirect", "--sensitivity", "--out", &path(&at("out"))],
        &["terrain", "gen", &path(&at("none/map.tif"))],
    ] {
        let o = apsides(arguments);
        assert_eq!(o.status.code(), Some(2), "{arguments:?}: {}{}", stdout(&o), stderr(&o));
    }
    assert_eq!(names(dir.path()), ["pipe"]);
    fs::create_dir(at("maps")).unwrap();
    symlink("maps/map.tif", at("link.tif")).unwrap();
    let o = made(&path(&at("link.tif")));
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert!(fs::symlink_metadata(at("link.tif")).unwrap().is_symlink());
    assert_eq!(names(&at("maps")), ["map.tif"]);
}

/// A limit on the size of files stands for a full disk.
#[test]
fn a_full_disk_leaves_what_was_there() {
    let dir = tempfile::tempdir().unwrap();
    let map = dir.path().join("map.tif");
    fs::write(&map, GOOD).unwrap();
    let limited = |blocks: &str, arguments: &[&str]| {
        let script = "trap '' XFSZ; ulimit -f \"$1\"; shift; exec \"$@\"";
        Command::new("sh").args(["-c", script, "sh", blocks, PROGRAM]).args(arguments).output().unwrap()
    };
    let o = limited("8", &["terrain", "gen", &path(&map), "--rows", "300", "--cols", "300", "--quiet"]);
    assert_eq!(o.status.code(), Some(5), "{}", stderr(&o));
    assert!(stderr(&o).contains("map.tif: File too large"), "{}", stderr(&o));
    assert_eq!((fs::read(&map).unwrap(), names(dir.path())), (GOOD.to_vec(), vec!["map.tif".to_owned()]));

    let results = dir.path().join("results");
    let solve = ["solve", "lunar-direct", "--quiet", "--out", &path(&results)];
    assert_eq!(apsides(&solve).status.code(), Some(0));
    let before: Vec<_> = names(&results).iter().map(|n| fs::read(results.join(n)).unwrap()).collect();
    let o = limited("4", &solve);
    assert_eq!(o.status.code(), Some(5), "{}", stderr(&o));
    assert!(stdout(&o).contains("certificate: "), "the answer is on stdout");
    let after: Vec<_> = names(&results).iter().map(|n| fs::read(results.join(n)).unwrap()).collect();
    assert!(before == after, "{:?}", names(&results));

    // A search goes on without its checkpoint, and says that it has none.
    let search =
        ["solve", "capsule-reentry", "--method", "two-layer", "--quiet", "--set", "search.evaluations=200"];
    let short = ["--set", "radau.max_refinements=0", "--set", "margins=false"];
    let file = path(&dir.path().join("search.json"));
    let o = limited("2", &[&search[..], &short, &["--checkpoint", &file]].concat());
    assert_eq!(o.status.code(), Some(5), "{}{}", stdout(&o), stderr(&o));
    assert!(
        stderr(&o).contains("the search is not kept: ") && stderr(&o).contains("search.json"),
        "{}",
        stderr(&o)
    );
    assert!(!Path::new(&file).exists());
}

/// A directory in which nobody can make a file, whoever runs the test.
#[cfg(target_os = "linux")]
#[test]
fn a_directory_that_takes_no_file_is_found_before_the_work() {
    for arguments in [
        &["solve", "lunar-direct", "--quiet", "--out", "/proc/apsides"][..],
        &["footprint", "capsule-reentry", "--quiet", "--out", "/proc/apsides"],
        &["simulate", "moving-mass-cross", "--out", "/proc/apsides"],
        &["size", "moving-mass-cross", "--out", "/proc/apsides"],
        &["reproduce", "lunar-landing", "--quiet", "--out", "/proc/apsides"],
        &["sweep", "lunar-direct", "--quiet", "--set", "thrust_n=440", "--out", "/proc/apsides"],
        &["terrain", "gen", "/proc/map.tif", "--quiet"],
    ] {
        let o = apsides(arguments);
        assert_eq!(o.status.code(), Some(5), "{arguments:?}: {}", stderr(&o));
        assert!(o.stdout.is_empty() && stderr(&o).contains("/proc/"), "{arguments:?}: {}", stderr(&o));
    }
}

/// Signals at several times leave the earlier file whole, and nothing beside it where the program could clean up.
#[test]
fn an_interrupted_map_is_the_earlier_one() {
    let dir = tempfile::tempdir().unwrap();
    let map = dir.path().join("map.tif");
    let arguments = ["terrain", "gen", &path(&map), "--rows", "40000", "--cols", "40000", "--quiet"];
    for (name, wait, code) in [("-INT", 100, Some(130)), ("-TERM", 300, Some(130)), ("-KILL", 200, None)] {
        fs::write(&map, GOOD).unwrap();
        let mut child = spawn(&arguments);
        std::thread::sleep(Duration::from_millis(wait));
        signal(&child, name);
        if code.is_some() {
            // A second one need not wait for the end of a band.
            std::thread::sleep(Duration::from_millis(50));
            signal(&child, name);
        }
        assert_eq!(child.wait().unwrap().code(), code, "{name}");
        assert_eq!(fs::read(&map).unwrap(), GOOD, "{name}");
        if code.is_some() {
            assert_eq!(names(dir.path()), ["map.tif"], "{name}");
        }
    }
}

/// A re-entry on a mesh that takes half a minute.
const LONG: [&str; 6] =
    ["capsule-reentry", "--quiet", "--set", "radau.points=20", "--set", "radau.intervals=80"];
/// Values of a key for a sweep of it.
const TWO_LIMITS: [&str; 2] = ["--set", "heat_rate_limit_kw_m2=900,850"];

/// Every long command ends with the same status after a signal.
#[test]
fn an_interrupt_has_one_status() {
    let dir = tempfile::tempdir().unwrap();
    let out = path(&dir.path().join("out"));
    for arguments in [
        &[&["solve"], &LONG[..]].concat()[..],
        &[&["sweep"], &LONG[..], &TWO_LIMITS].concat(),
        &["footprint", "capsule-reentry", "--quiet", "--out", &out],
        &["montecarlo", "chang-e-3-braking", "--quiet", "--samples", "10000000", "--position-m", "10"],
        &["reproduce", "capsule-reentry", "--quiet"],
        &["simulate", "moving-mass-cross", "--set", "sample_time_s=0.0001", "--set", "steps_per_sample=1"],
        &["tune", "moving-mass-cross", "--evaluations", "100000"],
        &["size", "moving-mass-cross", "--offsets-cm", "0.1,0.2,0.3,0.4,0.5,0.6,0.7,0.8,0.9,1,1.1,1.2,1.3"],
    ] {
        for name in ["-INT", "-TERM"] {
            let mut child = spawn(arguments);
            std::thread::sleep(Duration::from_millis(400));
            signal(&child, name);
            let code = child.wait().unwrap().code();
            assert_eq!(code, Some(130), "{name} {arguments:?}");
        }
    }
}

/// The best until then is shown and written.
#[test]
fn a_time_limit_ends_with_the_best_so_far() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| path(&dir.path().join(name));
    let limit = ["--time-limit", "0.3"];
    let search = ["--method", "two-layer", "--set", "search.evaluations=100000000"];
    for (arguments, file) in [
        (&[&["solve"], &LONG[..], &["--out", &at("a")]].concat()[..], "a/trajectory.csv"),
        (
            &[
                "solve",
                "capsule-reentry",
                "--quiet",
                "--out",
                &at("b"),
                search[0],
                search[1],
                search[2],
                search[3],
            ],
            "b/summary.json",
        ),
        (
            &["simulate", "moving-mass-cross", "--set", "sample_time_s=0.0001", "--out", &at("c")],
            "c/states.csv",
        ),
        (
            &[
                "montecarlo",
                "chang-e-3-braking",
                "--quiet",
                "--samples",
                "1000000",
                "--position-m",
                "9",
                "--out",
                &at("d"),
            ],
            "d/montecarlo.json",
        ),
        (&[&["sweep"], &LONG[..], &TWO_LIMITS, &["--out", &at("e")]].concat(), "e/sweep.csv"),
        (&["footprint", "capsule-reentry", "--quiet", "--out", &at("f")], "f/footprint.json"),
        (
            &["tune", "moving-mass-cross", "--directions", "0", "--evaluations", "100000", "--out", &at("g")],
            "g/mission.toml",
        ),
    ] {
        let begin = std::time::Instant::now();
        let o = apsides(&[arguments, &limit].concat());
        assert_eq!(o.status.code(), Some(3), "{arguments:?}: {}{}", stdout(&o), stderr(&o));
        assert!(dir.path().join(file).is_file(), "{arguments:?}: {}", stderr(&o));
        // What was missed so far is no verdict.
        let said = stdout(&o) + &stderr(&o);
        assert!(!said.contains("cannot be met"), "{arguments:?}: {said}");
        assert!(begin.elapsed() < Duration::from_secs(20), "{arguments:?}: {:?}", begin.elapsed());
    }
    for bad in ["0", "-1", "nan", "inf"] {
        let o = apsides(&["solve", "lunar-direct", "--time-limit", bad]);
        assert_eq!(o.status.code(), Some(2), "{bad}");
    }
}

/// Decisions in flight, flights of a plan and maps end in time too: without a result by a sentence, or with what is known until then.
#[test]
fn a_time_limit_ends_what_no_solve_is() {
    let dir = tempfile::tempdir().unwrap();
    for arguments in [
        &["check", "chang-e-3"][..],
        &["check", "chang-e-3", "--set", "optimised=by-stages"],
        &["solve", "chang-e-3", "--quiet"],
        &["simulate", "capsule-reentry", "--set", "aerodynamics=apollo-offset"],
        &["simulate", "capsule-reentry-steered"],
    ] {
        let o = apsides(&[arguments, &["--time-limit", "0.02"]].concat());
        assert_eq!(o.status.code(), Some(3), "{arguments:?}: {}{}", stdout(&o), stderr(&o));
        assert!(stderr(&o).contains("apsides: the time limit (--time-limit) is over: "), "{}", stderr(&o));
    }
    // Points that are far from any flight are not flown again for minutes.
    let begin = std::time::Instant::now();
    let o = apsides(&["solve", "geo-7-burn", "--quiet", "--set", "thrust_n=1e-12", "--time-limit", "0.3"]);
    assert_eq!(o.status.code(), Some(3), "{}{}", stdout(&o), stderr(&o));
    assert!(begin.elapsed() < Duration::from_secs(10), "{:?}", begin.elapsed());
    let map = path(&dir.path().join("map.tif"));
    let gen_map = ["terrain", "gen", &map, "--rows", "900", "--cols", "900", "--quiet"];
    assert_eq!(apsides(&gen_map).status.code(), Some(0));
    for memory in ["1024", "24"] {
        let out = dir.path().join(memory);
        let hazard = ["hazard", &map, "--quiet", "--memory", memory, "--out", &path(&out)];
        let o = apsides(&[&hazard[..], &["--time-limit", "1e-9"]].concat());
        assert_eq!(o.status.code(), Some(3), "{}{}", stdout(&o), stderr(&o));
        let text = stdout(&o);
        assert!(
            text.contains("0.000 % of the map is assessed") && text.contains("no safe site"),
            "{memory}: {text}"
        );
        let report: serde_json::Value =
            serde_json::from_slice(&fs::read(out.join("hazard.json")).unwrap()).unwrap();
        assert_eq!(report["assessed_fraction"], 0.0);
        assert_eq!(report["pixels"]["unknown"], 810_000);
        assert!(out.join("sites.csv").is_file() && out.join("hazard.html").is_file());
        // In memory the rest is gaps, and of a map in bands there are no rasters.
        let verdict = out.join("verdict.tif");
        let o = apsides(&["terrain", "info", &path(&verdict)]);
        let said = stdout(&o);
        assert!(if memory == "24" { !verdict.exists() } else { said.contains("gaps: 810000") }, "{said}");
        let o = apsides(&[&hazard[..], &["--time-limit", "1000"]].concat());
        assert_eq!(o.status.code(), Some(0), "{}{}", stdout(&o), stderr(&o));
        assert!(!stdout(&o).contains("is assessed"), "{}", stdout(&o));
    }
}

/// A judgement is there without the objective to compare with.
#[test]
fn a_time_limit_leaves_a_judgement_without_its_reference() {
    let dir = tempfile::tempdir().unwrap();
    let out = path(&dir.path().join("out"));
    assert_eq!(apsides(&["solve", "lunar-direct", "--quiet", "--out", &out]).status.code(), Some(0));
    let file = format!("{out}/trajectory.csv");
    let certify = ["certify", "lunar-direct", &file];
    let whole = apsides(&certify);
    assert!(stdout(&whole).contains(" % better than") || stdout(&whole).contains(" % worse than"));
    let o = apsides(&[&certify[..], &["--time-limit", "1e-9"]].concat());
    assert_eq!(o.status.code(), Some(3), "{}", stderr(&o));
    assert!(stdout(&o).contains("certificate: ") && !stdout(&o).contains(" than"), "{}", stdout(&o));
}

/// Input from what never ends, or has no measure, is refused by name.
#[test]
fn what_is_no_file_is_not_read() {
    let dir = tempfile::tempdir().unwrap();
    let pipe = path(&dir.path().join("pipe"));
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for (file, word) in [(pipe.as_str(), "is a pipe"), ("/dev/zero", "is a device"), ("/", "is a directory")]
    {
        for arguments in [
            &["terrain", "info", file][..],
            &["hazard", file, "--pixel", "1"],
            &["certify", "lunar-direct", file],
            &["check", "chang-e-3", "--set", &format!("terrain.coarse={file}")],
        ] {
            let o = apsides(arguments);
            assert_eq!(o.status.code(), Some(2), "{arguments:?}: {}", stderr(&o));
            assert!(stderr(&o).contains(word) && stderr(&o).lines().count() == 1, "{}", stderr(&o));
        }
    }
}

/// Documented maxima that took more than the machine has are answered at once, and nothing is written.
#[test]
fn memory_is_foreseen() {
    let dir = tempfile::tempdir().unwrap();
    let out = path(&dir.path().join("out"));
    let points = ["--set", "radau.intervals=100000", "--set", "radau.points=60"];
    let segments = ["--method", "multiple-shooting", "--set", "shooting.intervals=100000"];
    let little = ["--memory", "1"];
    for (arguments, cause) in [
        (
            [&["solve", "lunar-direct", "--out", &out][..], &points].concat(),
            "`radau.intervals` = 100000, `radau.points` = 60",
        ),
        (
            [&["solve", "lunar-direct", "--explain", "--out", &out][..], &points].concat(),
            "`radau.points` = 60",
        ),
        (
            [&["solve", "capsule-reentry", "--memory", "4096", "--out", &out][..], &segments].concat(),
            "`shooting.intervals` = 100000",
        ),
        (
            [&["sweep", "lunar-direct", "--set", "thrust_n=440,450"][..], &points].concat(),
            "`radau.points` = 60",
        ),
        (
            [&["montecarlo", "moving-mass-cross", "--samples", "10000000"][..], &little].concat(),
            "10000000 samples",
        ),
        ([&["footprint", "capsule-reentry", "--out", &out][..], &little].concat(), "`radau.intervals` = "),
        ([&["reproduce", "lunar-landing", "--out", &out][..], &little].concat(), "`lunar-landing` with "),
        (
            [&["terrain", "gen", &out, "--rows", "1", "--cols", "500000", "--pixel", "0.01"][..], &little]
                .concat(),
            "--cols 500000",
        ),
    ] {
        let begin = std::time::Instant::now();
        let o = apsides(&arguments);
        assert_eq!(o.status.code(), Some(2), "{arguments:?}: {}{}", stdout(&o), stderr(&o));
        let text = stderr(&o);
        let sentence = text.lines().last().unwrap();
        assert!(sentence.contains("this takes about ") && sentence.contains(" GiB are allowed: "), "{text}");
        assert!(sentence.contains(cause), "{cause}: {text}");
        assert!(begin.elapsed() < Duration::from_secs(20), "{arguments:?}");
    }
    assert!(names(dir.path()).is_empty());
    let o = apsides(&["terrain", "gen", &out, "--rows", "20", "--cols", "20", "--pixel", "1e18"]);
    assert_eq!(o.status.code(), Some(2), "{}", stderr(&o));
    let o = apsides(&["solve", "lunar-direct", "--quiet", "--json", "--memory", "64"]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
}

#[test]
fn the_table_of_statuses_is_in_the_help() {
    let o = apsides(&["--help"]);
    let text = stdout(&o);
    for status in [
        "    0  done",
        "    2  bad input",
        "    3  not solved",
        "    4  solved",
        "    5  an output",
        "    6  complete",
        "  130  interrupted",
    ] {
        assert!(text.contains(status), "{status}: {text}");
    }
}
