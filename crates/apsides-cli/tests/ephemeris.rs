//! Ephemerides: dense rows of solves, of results on disk and of simulated flights, their formats, and requests that make none.
#![allow(clippy::unwrap_used)]

mod support;

use std::path::Path;

use support::{apsides, path, stderr, stdout};

/// Round-off of sums of numbers in files.
const ROUNDING: f64 = 1e-6;
/// Solver: end conditions of the flight, m and m/s.
const ENDS: f64 = 1e-5;

/// A column of a CSV file by its header.
fn column(file: &Path, header: &str) -> Vec<String> {
    let text = std::fs::read_to_string(file).unwrap();
    let index = text.lines().next().unwrap().split(',').position(|h| h == header);
    let index = index.unwrap_or_else(|| panic!("no {header} in {}", text.lines().next().unwrap()));
    text.lines().skip(1).map(|line| line.split(',').nth(index).unwrap().to_owned()).collect()
}

fn numbers(file: &Path, header: &str) -> Vec<f64> {
    column(file, header).iter().map(|cell| cell.parse().unwrap()).collect()
}

fn read(dir: &Path, name: &str) -> Vec<u8> {
    std::fs::read(dir.join(name)).unwrap()
}

/// A message without the time at which it was made.
fn message(dir: &Path, name: &str) -> String {
    let text = String::from_utf8(read(dir, name)).unwrap();
    text.lines().filter(|line| !line.starts_with("CREATION_DATE")).collect::<Vec<_>>().join("\n")
}

#[test]
fn a_landing_is_written_densely_and_exported_again() {
    let dir = tempfile::tempdir().unwrap();
    let (plain, out, again) = (dir.path().join("plain"), dir.path().join("out"), dir.path().join("again"));
    let o = apsides(&["solve", "lunar-two-phase", "--quiet", "--out", &path(&plain)]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    let solve =
        ["solve", "lunar-two-phase", "--quiet", "--step", "1s", "--format", "csv,oem,opm,npz,json,czml"];
    let o = apsides(&[&solve[..], &["--out", &path(&out)]].concat());
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    // What was written before is as it was: the mission says nothing of epochs that nobody stated.
    for file in ["trajectory.csv", "mission.toml", "multipliers.json", "certificate.json"] {
        assert_eq!(read(&plain, file), read(&out, file), "{file}");
    }
    let csv = out.join("ephemeris.csv");
    let times = numbers(&csv, "time_s");
    let phases = column(&csv, "phase");
    let boundary = phases.iter().position(|p| p == "descent").unwrap();
    assert!((times[boundary - 1] - times[boundary]).abs() < ROUNDING);
    let mut steps = times.windows(2).map(|w| w[1] - w[0]);
    assert!(steps.all(|step| (-ROUNDING..1.0 + ROUNDING).contains(&step)) && times.len() > 1020);
    let last = |header: &str| *numbers(&csv, header).last().unwrap();
    assert!(last("altitude_m").abs() < ENDS && (last("flight_path_angle_deg") + 90.0).abs() < ENDS);
    assert!((last("speed_m_per_s") - 5.0).abs() < ENDS);
    assert!((last("time_s") - 1_020.655_345).abs() < ENDS);
    let [mass, spent] = ["mass_kg", "delta_v_m_per_s"].map(|header| numbers(&csv, header));
    let first = mass[0];
    for (mass, spent) in mass.iter().zip(&spent) {
        assert!((310.0 * 9.807 * (first / mass).ln() - spent).abs() < ROUNDING, "{mass} {spent}");
    }
    assert!(numbers(&csv, "thrust_N").iter().all(|thrust| (thrust - 440.0).abs() < ROUNDING));
    // No cell is empty: quantities of one phase alone are not columns.
    assert!(!std::fs::read_to_string(&csv).unwrap().contains(",,"));

    let export = ["export", &path(&out), "--step", "1", "--format", "opm,csv,oem,npz,json,czml"];
    let o = apsides(&[&export[..], &["--out", &path(&again)]].concat());
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert!(stdout(&o).contains("ephemeris.oem") && stdout(&o).contains("final.opm"));
    for file in ["ephemeris.csv", "ephemeris.npz", "ephemeris.json", "ephemeris.czml"] {
        assert_eq!(read(&out, file), read(&again, file), "{file}");
    }
    for file in ["ephemeris.oem", "initial.opm", "final.opm"] {
        assert_eq!(message(&out, file), message(&again, file), "{file}");
    }
    let o = apsides(&["verify", &path(&out)]);
    assert_eq!(o.status.code(), Some(0), "{}", stdout(&o));

    // Another epoch turns the axes, and nothing else.
    let o = apsides(&[
        "export",
        &path(&out),
        "--points",
        "2",
        "--set",
        "epoch=2027-01-01T00:00:00 UTC",
        "--out",
        &path(&again),
    ]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    let other = again.join("ephemeris.csv");
    assert_eq!(column(&other, "epoch_utc")[0], "2027-01-01T00:00:00");
    assert_ne!(numbers(&other, "position_icrf_x_m")[0], numbers(&csv, "position_icrf_x_m")[0]);
    assert_eq!(numbers(&other, "mass_kg")[0], first);

    // A solve without rows leaves none of an earlier flight.
    let o = apsides(&["solve", "lunar-two-phase", "--quiet", "--out", &path(&out)]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert!(!csv.exists() && !out.join("final.opm").exists());
}

#[test]
fn a_simulated_descent_has_an_attitude_over_the_ellipsoid() {
    let dir = tempfile::tempdir().unwrap();
    let out = path(&dir.path().join("descent"));
    let flown =
        ["simulate", "moving-mass-cross", "--quiet", "--out", &out, "--step", "0.5", "--format", "aem,csv"];
    let o = apsides(&flown);
    assert_eq!(o.status.code(), Some(2));
    assert!(stderr(&o).contains("`--set earth=ellipsoid` has"), "{}", stderr(&o));
    let o = apsides(&[&flown[..], &["--set", "earth=ellipsoid"]].concat());
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    let csv = dir.path().join("descent/ephemeris.csv");
    let [altitude, latitude] = ["altitude_m", "latitude_deg"].map(|header| numbers(&csv, header));
    assert!((latitude[0] - 35.0).abs() < ROUNDING && (altitude.last().unwrap() - 3000.0).abs() < 10.0);
    let first = read(dir.path(), "descent/ephemeris.aem");
    let o = apsides(&["export", &out, "--step", "0.5", "--format", "aem"]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    let strip =
        |text: &[u8]| String::from_utf8_lossy(text).lines().skip(3).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(strip(&first), strip(&read(dir.path(), "descent/ephemeris.aem")));
}

#[test]
fn problems_of_ones_own_have_their_states_and_controls() {
    let dir = tempfile::tempdir().unwrap();
    let (file, out) = (path(&dir.path().join("p.toml")), dir.path().join("out"));
    assert_eq!(apsides(&["new", "problem", &file]).status.code(), Some(0));
    let o =
        apsides(&["solve", &file, "--quiet", "--out", &path(&out), "--points", "101", "--format", "csv,npz"]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    // Two of the rows stand on the other side of the switches of the thrust.
    assert_eq!(numbers(&out.join("ephemeris.csv"), "time_s").len(), 101 + 2);
    let o = apsides(&["solve", &file, "--quiet", "--out", &path(&out), "--points", "101", "--format", "oem"]);
    assert_eq!(o.status.code(), Some(2));
    assert!(
        stderr(&o).contains("a table [motion] with body, position and velocity would say them"),
        "{}",
        stderr(&o)
    );
    assert!(stderr(&o).contains("csv, json and npz have its own states"));
}

#[test]
fn requests_that_make_no_ephemeris_say_what_is_allowed() {
    let dir = tempfile::tempdir().unwrap();
    let out = path(&dir.path().join("out"));
    let refused = |arguments: &[&str], words: &str| {
        let o = apsides(arguments);
        assert_eq!(o.status.code(), Some(2), "{arguments:?}: {}", stderr(&o));
        assert!(stderr(&o).contains(words), "{arguments:?}: {}", stderr(&o));
    };
    let solve = |rest: &[&str], words: &str| {
        refused(&[&["solve", "lunar-perilune", "--quiet", "--out", &out][..], rest].concat(), words);
        assert!(!dir.path().join("out").exists(), "{rest:?}");
    };
    for step in ["0", "-1s", "nan", "inf", "soon", "10m"] {
        solve(&[&format!("--step={step}")], "a time above 0 is expected");
    }
    solve(&["--points", "1"], "is not in 2..");
    solve(&["--points", "5", "--step", "1s"], "cannot be used with");
    solve(&["--format", "oem"], "required");
    solve(&["--step", "1s", "--format", "xlsx"], "formats: csv, json, npz, oem, opm, aem, czml");
    solve(&["--step", "1s", "--format", "aem"], "needs an attitude");
    solve(&["--step", "1s", "--set", "epoch=tomorrow"], "must end with TAI, TT, TDB or UTC");
    solve(&["--step", "1s", "--set", "epoch=1970-01-01T00:00:00 UTC"], "begins with 1972");
    solve(&["--set", "frame.inclination_deg=200"], "at least 0 and at most 180");
    let other_body = ["--step", "1s", "--format", "oem", "--set", "gravitational_parameter_km3_s2=6000"];
    solve(&other_body, "its body is none of Earth, Moon and Mars");
    refused(&["solve", "lunar-perilune", "--quiet", "--step", "1s"], "--out DIR");
    refused(&["export", &path(dir.path()), "--step", "1s"], "no result directory");
}

/// A flight of too many rows is written without them, and a place that cannot be written has its status.
#[test]
fn a_solution_is_not_lost_with_its_ephemeris() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let solve = ["solve", "lunar-perilune", "--quiet", "--out", &path(&out), "--step", "1us"];
    let o = apsides(&solve);
    assert_eq!(o.status.code(), Some(2), "{}", stderr(&o));
    assert!(stderr(&o).contains("`--step` = 0.000001 s, 9.974e8 rows: this takes about"), "{}", stderr(&o));
    assert!(out.join("trajectory.csv").is_file() && !out.join("ephemeris.csv").exists());
    let export = |rest: &[&str]| apsides(&[&["export", &path(&out)][..], rest].concat());
    let o = export(&["--step", "0.01", "--memory", "1"]);
    assert!(o.status.code() == Some(2) && stderr(&o).contains("0.001 GiB are allowed"), "{}", stderr(&o));
    let o = export(&[]);
    assert!(o.status.code() == Some(2) && stderr(&o).contains("--step 10s, or --points"), "{}", stderr(&o));
    let o = export(&["--step", "10s", "--set", "thrust_n=500"]);
    assert!(o.status.code() == Some(2) && stderr(&o).contains("by solving again"), "{}", stderr(&o));
    let o = export(&["--step", "10s", "--out", "/dev/full/there"]);
    assert_eq!(o.status.code(), Some(2), "{}", stderr(&o));
    if cfg!(target_os = "linux") {
        let o = export(&["--step", "10s", "--out", "/proc/nothing"]);
        assert_eq!(o.status.code(), Some(5), "{}", stderr(&o));
    }
}

#[test]
fn the_schema_has_every_key_of_every_mission() {
    let o = apsides(&["schema"]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    let schema: serde_json::Value = serde_json::from_slice(&o.stdout).unwrap();
    let registry = apsides::registry();
    for kind in registry.kinds() {
        for key in kind.all_keys().iter() {
            let mut at = &schema["$defs"][&*kind.name];
            for name in key.path.split('.') {
                at = &at["properties"][name];
            }
            assert!(at["description"].as_str().is_some_and(|d| d.contains(&*key.meaning)), "{}", key.path);
        }
    }
    assert_eq!(schema["$defs"]["lunar-perilune"]["properties"]["perilune_altitude_km"]["default"], 15.0);
    // A problem with equations of its own: its tables, the keys of ephemerides and of methods, and no others.
    let own = &schema["$defs"]["kind-problem"];
    let motion = &own["properties"]["motion"];
    assert_eq!(motion["required"], serde_json::json!(["body", "position", "velocity"]));
    assert_eq!([&own["additionalProperties"], &motion["additionalProperties"]], [false, false]);
    assert_eq!(motion["properties"]["position"]["minItems"], 3);
    assert_eq!(own["properties"]["frame"]["properties"]["inclination_deg"]["maximum"], 180.0);
    assert_eq!(own["properties"]["radau"]["properties"]["points"]["type"], "integer");
}

#[test]
fn both_sides_of_a_switch_have_a_row() {
    let dir = tempfile::tempdir().unwrap();
    let file =
        format!("{}/../../tests/problems/double_integrator_from_speed.toml", env!("CARGO_MANIFEST_DIR"));
    let out = path(&dir.path().join("out"));
    let o = apsides(&["solve", &file, "--quiet", "--out", &out, "--step", "1s", "--format", "csv"]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    let table = dir.path().join("out/ephemeris.csv");
    let (times, controls) = (numbers(&table, "time_s"), numbers(&table, "u"));
    // It brakes until v + sqrt(v^2 / 2 + x), then pushes: rows at 0 to 6 s, the switch twice, 7 to 10 s, the end.
    let switch = 3.0 + 14.5_f64.sqrt();
    assert_eq!((times.len(), controls.len()), (14, 14), "{times:?}");
    assert!(times[7] == times[8] && (times[7] - switch).abs() < ENDS, "{times:?}");
    let is_full = |sign: f64, part: &[f64]| part.iter().all(|u| (u - sign).abs() < ENDS);
    assert!(is_full(-1.0, &controls[..8]) && is_full(1.0, &controls[8..]), "{controls:?}");
    assert!(times.windows(2).all(|t| t[0] <= t[1]));
}
