//! Results as files: written, altered, verified again.
#![allow(clippy::unwrap_used)]

mod support;

use std::path::Path;
use std::process::{Command, Output};

use support::{apsides, path, stderr, stdout};

/// Adds to one column of some rows.
fn tamper(csv: &str, column: &str, rows: std::ops::Range<usize>, change: f64) -> String {
    let index = csv.lines().next().unwrap().split(',').position(|h| h == column).unwrap();
    let line = |(k, line): (usize, &str)| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if rows.contains(&k) {
            cells[index] = (cells[index].parse::<f64>().unwrap() + change).to_string();
        }
        cells.join(",") + "\n"
    };
    csv.lines().enumerate().map(line).collect()
}

#[test]
fn results_are_written_and_verified_again() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("results");
    let o = apsides(&["solve", "lunar-two-phase", "--quiet", "--out", &path(&out)]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert!(stdout(&o).contains("certificate: strict-local-optimum"));
    assert!(stdout(&o).contains("report.html"));
    for file in ["summary.json", "trajectory.csv", "certificate.json", "mission.toml", "report.html"] {
        assert!(out.join(file).is_file(), "{file}");
    }
    let again = apsides(&["verify", &path(&out)]);
    assert_eq!(again.status.code(), Some(0), "{}{}", stdout(&again), stderr(&again));

    let csv = out.join("trajectory.csv");
    let text = std::fs::read_to_string(&csv).unwrap();
    std::fs::write(&csv, tamper(&text, "thrust_angle_rad", 10..20, 1e-4)).unwrap();
    let again = apsides(&["verify", &path(&out)]);
    assert_eq!(again.status.code(), Some(4), "{}", stdout(&again));
    assert!(stdout(&again).contains("certificate: rejected"));
    std::fs::write(&csv, "phase,interval\n").unwrap();
    assert_eq!(apsides(&["verify", &path(&out)]).status.code(), Some(2));
}

/// A flight from a directory is a start: the same optimum in fewer iterations; a flight of another mission is refused.
#[test]
fn a_solve_goes_on_from_an_earlier_flight() {
    let dir = tempfile::tempdir().unwrap();
    let out = path(&dir.path().join("earlier"));
    assert_eq!(apsides(&["solve", "lunar-perilune", "--quiet", "--out", &out]).status.code(), Some(0));
    let solved = |further: &[&str]| {
        let changed = ["solve", "lunar-perilune", "--json", "--set", "perilune_altitude_km=15.2"];
        let o = apsides(&[&changed, further].concat());
        assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
        let summary: serde_json::Value = serde_json::from_str(&stdout(&o)).unwrap();
        let number = |path: &str| summary.pointer(path).and_then(serde_json::Value::as_f64).unwrap();
        (number("/counters/iterations"), number("/objective/value"))
    };
    let (cold, warm) = (solved(&[]), solved(&["--from", &out]));
    assert!(warm.0 < cold.0, "{} iterations from a flight, {} from a guess", warm.0, cold.0);
    const ROUND_OFF: f64 = 1e-9;
    assert!((warm.1 - cold.1).abs() < ROUND_OFF * cold.1, "{} s, {} s", warm.1, cold.1);

    let other = apsides(&["solve", "lunar-two-phase", "--from", &out]);
    assert_eq!(other.status.code(), Some(2));
    assert!(stderr(&other).contains("no flight of `lunar-two-phase`"), "{}", stderr(&other));
    let nothing = apsides(&["solve", "lunar-perilune", "--from", &path(&dir.path().join("nothing"))]);
    assert_eq!(nothing.status.code(), Some(2));
}

/// Replaces a text in a file.
fn edit(file: &Path, from: &str, to: &str) {
    let text = std::fs::read_to_string(file).unwrap();
    assert!(text.contains(from), "{from}: {text}");
    std::fs::write(file, text.replacen(from, to, 1)).unwrap();
}

/// The sentence on an alteration of a result directory, which it makes.
type Alteration<'a> = (&'a str, &'a dyn Fn(&Path));

/// Results, certificates and trajectories that were altered, and files that are missing, are named, also where the digests were altered too.
#[test]
fn what_was_altered_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("results");
    let solve = ["solve", "lunar-two-phase", "--quiet", "--out", &path(&out)];
    let number = |text: &str, key: &str| {
        let rest = text.split_once(&format!("\"{key}\": ")).unwrap().1;
        rest.split([',', '\n']).next().unwrap().to_owned()
    };
    let alterations: [Alteration<'_>; 7] = [
        ("summary.json, `results.final_mass_kg` is 1", &|out| {
            let file = out.join("summary.json");
            let mass = number(&std::fs::read_to_string(&file).unwrap(), "final_mass_kg");
            let more = mass.parse::<f64>().unwrap() * (1.0 + 1e-5);
            edit(&file, &format!("\"final_mass_kg\": {mass}"), &format!("\"final_mass_kg\": {more}"));
        }),
        ("summary.json, `objective.value` is 1.0", &|out| {
            let file = out.join("summary.json");
            let text = std::fs::read_to_string(&file).unwrap();
            let value = number(&text[text.find("\"objective\"").unwrap()..], "value");
            edit(&file, &format!("\"value\": {value}"), "\"value\": 1.0");
        }),
        ("summary.json: the verdict is global-optimum, computed again strict-local-optimum", &|out| {
            edit(&out.join("summary.json"), "\"strict-local-optimum\"", "\"global-optimum\"");
        }),
        ("certificate.json has no certificate", &|out| {
            std::fs::write(out.join("certificate.json"), "{}").unwrap();
        }),
        ("certificate.json is missing", &|out| std::fs::remove_file(out.join("certificate.json")).unwrap()),
        ("trajectory.csv was changed since it was written", &|out| {
            let file = out.join("trajectory.csv");
            let text = std::fs::read_to_string(&file).unwrap();
            let costate =
                text.lines().next().unwrap().split(',').find(|h| h.starts_with("costate_mass")).unwrap();
            std::fs::write(&file, tamper(&text, costate, 10..11, 1e-9)).unwrap();
        }),
        ("report.html was changed since it was written", &|out| {
            edit(&out.join("report.html"), "</html>", "</html> ");
        }),
    ];
    for (sentence, alter) in alterations {
        assert_eq!(apsides(&solve).status.code(), Some(0));
        let o = apsides(&["verify", &path(&out)]);
        assert_eq!(o.status.code(), Some(0), "{}", stdout(&o));
        assert!(stdout(&o).contains("files and their numbers are those of the trajectory"), "{}", stdout(&o));
        alter(&out);
        let o = apsides(&["verify", &path(&out)]);
        assert_eq!(o.status.code(), Some(4), "{sentence}: {}{}", stdout(&o), stderr(&o));
        assert!(stdout(&o).contains(sentence), "{sentence}: {}", stdout(&o));
    }
    let json = apsides(&["verify", &path(&out), "--json"]);
    let found: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    assert_eq!(found["differences"][0], "report.html was changed since it was written");
    assert_eq!(found["verdict"], "strict-local-optimum");
}

/// Writes the digest of a file as it is now into `digests.json`.
fn seal_again(out: &Path, name: &str) {
    let sum = Command::new("sha256sum").arg(out.join(name)).output().unwrap();
    let sum = String::from_utf8(sum.stdout).unwrap().split_whitespace().next().unwrap().to_owned();
    let file = out.join("digests.json");
    let mut digests: serde_json::Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    digests["sha256"][name] = sum.into();
    std::fs::write(&file, digests.to_string()).unwrap();
}

/// Costates inside of an interval change no verdict: who alters them and makes the digest again is named by the costate equation.
#[cfg(target_os = "linux")]
#[test]
fn costates_that_were_altered_with_a_new_digest_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("results");
    let limits = ["--set", "inclination_deg=28.5", "--set", "max_flight_time_s=27000"];
    for (solve, phase) in [
        (&["solve", "geo-3-burn", "--quiet"][..], "coast-2"),
        (&["solve", "lunar-coast", "--quiet"], "coast"),
        (&["solve", "lunar-two-phase", "--quiet"], "braking"),
    ] {
        let limits = if solve[1] == "geo-3-burn" { &limits[..] } else { &[] };
        let o = apsides(&[solve, limits, &["--out", &path(&out)]].concat());
        assert_eq!(o.status.code(), Some(0), "{}{}", stdout(&o), stderr(&o));
        let verified = || apsides(&["verify", &path(&out)]);
        assert_eq!(verified().status.code(), Some(0), "{}", stdout(&verified()));
        let file = out.join("trajectory.csv");
        let text = std::fs::read_to_string(&file).unwrap();
        let heads: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        let interval = heads.iter().position(|h| *h == "interval").unwrap();
        let cell = |line: &str, k: usize| line.split(',').nth(k).unwrap().to_owned();
        // A row inside of an interval of the phase: with the same interval before and behind it.
        let lines: Vec<&str> = text.lines().collect();
        let inside = |k: &usize| {
            let of = |k: usize| (cell(lines[k], 0), cell(lines[k], interval));
            of(*k).0 == phase && [k - 1, k + 1].iter().all(|j| of(*j) == of(*k))
        };
        let row = (2..lines.len() - 1).find(inside).unwrap_or_else(|| panic!("{phase}: {text}"));
        // The largest costate of the row, changed by a tenth.
        let size = |k: usize| cell(lines[row], k).parse::<f64>().map_or(0.0, f64::abs);
        let costates = (0..heads.len()).filter(|k| heads[*k].starts_with("costate_") && size(*k) > 0.0);
        let mut named = 0;
        for k in costates {
            std::fs::write(&file, tamper(&text, heads[k], row..row + 1, 0.1 * size(k))).unwrap();
            seal_again(&out, "trajectory.csv");
            let o = verified();
            let said = stdout(&o);
            let differs = said.contains("of the largest costate from the costate equation");
            named += usize::from(differs && o.status.code() == Some(4));
        }
        assert!(named >= 1, "{phase}: {}", stdout(&verified()));
    }
}

/// Costates and multipliers of a phase with path constraints that were altered, each number by a tenth: the certificate is made by those of the
/// adjoint equation then, which is said, with the conditions that those in the files do not meet.
#[cfg(target_os = "linux")]
#[test]
fn costates_and_multipliers_beside_path_constraints_that_were_altered_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("results");
    let problem = |name: &str| format!("{}/../../tests/problems/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    for mission in ["capsule-reentry", &problem("moving_wall"), &problem("limit_until_a_time")] {
        let o = apsides(&["solve", mission, "--quiet", "--out", &path(&out)]);
        assert_eq!(o.status.code(), Some(0), "{}{}", stdout(&o), stderr(&o));
        let verified = || apsides(&["verify", &path(&out)]);
        assert_eq!(verified().status.code(), Some(0), "{}", stdout(&verified()));
        let file = out.join("trajectory.csv");
        let text = std::fs::read_to_string(&file).unwrap();
        let heads: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        let lines: Vec<Vec<&str>> = text.lines().map(|l| l.split(',').collect()).collect();
        let costates: Vec<usize> = (0..heads.len()).filter(|k| heads[*k].starts_with("costate_")).collect();
        let size = |row: usize, k: usize| lines[row][k].parse::<f64>().map_or(0.0, f64::abs);
        let mut unnamed: Vec<String> = Vec::new();
        let largest = |k: usize| (1..lines.len()).map(|row| size(row, k)).fold(0.0, f64::max);
        // Rows all along the phase, one costate after the other.
        for (n, row) in (1..lines.len()).step_by((lines.len() / 8).max(1)).enumerate() {
            let k = costates[n % costates.len()];
            std::fs::write(&file, tamper(&text, heads[k], row..row + 1, 0.1 * largest(k))).unwrap();
            seal_again(&out, "trajectory.csv");
            let o = verified();
            let said = stdout(&o);
            let is_named = o.status.code() == Some(4) && said.contains("costate");
            unnamed.extend((!is_named).then(|| format!("{}, row {row}: {said}", heads[k])));
        }
        std::fs::write(&file, &text).unwrap();
        seal_again(&out, "trajectory.csv");
        assert_eq!(verified().status.code(), Some(0), "{}", stdout(&verified()));
        assert!(unnamed.is_empty(), "{mission}: {}", unnamed.join("\n"));
        let file = out.join("multipliers.json");
        let good: serde_json::Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
        for place in numbers(&good) {
            let mut altered = good.clone();
            let number = altered.pointer_mut(&place).unwrap();
            *number = (1.1 * number.as_f64().unwrap()).into();
            std::fs::write(&file, altered.to_string()).unwrap();
            seal_again(&out, "multipliers.json");
            let o = verified();
            assert_eq!(o.status.code(), Some(4), "{mission}, {place}: {}", stdout(&o));
        }
    }
}

/// Pointers to multipliers that push: every fourth along a path where they are not what a barrier leaves, and all contacts.
fn numbers(multipliers: &serde_json::Value) -> Vec<String> {
    /// A multiplier of a problem of this size below is what a barrier leaves.
    const NOTHING: f64 = 1e-9;
    let all = |format: &dyn Fn(usize) -> String| -> Vec<(String, f64)> {
        let number = |k| Some((format(k), multipliers.pointer(&format(k))?.as_f64()?));
        (0..).map_while(number).collect()
    };
    let along = all(&|k| format!("/path/0/values/{k}/0"));
    let largest = along.iter().fold(NOTHING, |m: f64, (_, v)| m.max(v.abs()));
    let along = along.into_iter().filter(|(_, v)| v.abs() > 0.1 * largest).step_by(4);
    let contacts = all(&|k| format!("/contacts/{k}/value")).into_iter();
    along.chain(contacts).map(|(place, _)| place).collect()
}

/// Costates that jump, at contacts, at bounds of states and where the equations jump, are in the files: what was solved is vouched for.
#[test]
fn flights_whose_costates_jump_are_verified_from_their_files() {
    let dir = tempfile::tempdir().unwrap();
    for name in [
        "around_a_small_disc",
        "ceiling_touched_twice",
        "draining_tank",
        "gate_in_an_instant",
        "jerk_within_limits",
        "lunar_ascent_with_a_coast",
        "moving_wall",
        "oscillator_with_limited_speed",
        "race_car",
        "refraction_with_an_if",
        "string_over_a_wave",
        "two_media",
        "two_touches",
    ] {
        let file = format!("{}/../../tests/problems/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        let out = path(&dir.path().join(name));
        let o = apsides(&["solve", &file, "--quiet", "--out", &out]);
        assert_eq!(o.status.code(), Some(0), "{name}: {}{}", stdout(&o), stderr(&o));
        let o = apsides(&["verify", &out]);
        assert_eq!(o.status.code(), Some(0), "{name}: {}{}", stdout(&o), stderr(&o));
    }
}

/// The files hold the whole flight, also where only its burns were solved.
#[test]
fn a_flight_of_burns_and_coasts_is_written_and_verified_again() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("results");
    let limits = ["--set", "inclination_deg=28.5", "--set", "max_flight_time_s=27000"];
    let solve = ["solve", "geo-3-burn", "--quiet", "--sensitivity", "--out", &path(&out)];
    let o = apsides(&[&solve[..], &limits[..]].concat());
    assert_eq!(o.status.code(), Some(0), "{}{}", stdout(&o), stderr(&o));
    assert!(stdout(&o).contains("+1 s of max_flight_time_s"), "{}", stdout(&o));
    let csv = out.join("trajectory.csv");
    let text = std::fs::read_to_string(&csv).unwrap();
    assert!(text.contains("coast-2"));
    let again = apsides(&["verify", &path(&out), "-v"]);
    assert_eq!(again.status.code(), Some(0), "{}{}", stdout(&again), stderr(&again));
    assert!(stdout(&again).contains("flown in Cartesian coordinates"));
    std::fs::write(&csv, tamper(&text, "out_of_plane_thrust_angle_rad", 2..10, 1e-4)).unwrap();
    assert_eq!(apsides(&["verify", &path(&out)]).status.code(), Some(4));
}

/// Discretisation: the difference of flight times of two meshes against shooting, s.
const MESH_S: f64 = 1e-5;

#[test]
fn results_are_laid_beside_each_other() {
    let dir = tempfile::tempdir().unwrap();
    let [first, second, out] = ["first", "second", "compared"].map(|name| path(&dir.path().join(name)));
    for (out, altitude) in [(&first, "perilune_altitude_km=15"), (&second, "perilune_altitude_km=20")] {
        let o = apsides(&["solve", "lunar-perilune", "--quiet", "--set", altitude, "--out", out]);
        assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    }
    let o = apsides(&["compare", &first, &second, "--out", &out]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert!(stdout(&o).contains("  perilune_altitude_km: 15 | 20\n"), "{}", stdout(&o));
    let page = std::fs::read_to_string(Path::new(&out).join("compare.html")).unwrap();
    assert!(
        page.contains("<figcaption>altitude") && page.contains("<figcaption>Flight over the curved ground")
    );
    let v: serde_json::Value =
        serde_json::from_slice(&apsides(&["compare", &first, &second, "--json"]).stdout).unwrap();
    let time = |run: usize| v["runs"][run]["results"]["flight_time_s"].as_f64().unwrap();
    // 999.3569839960355 s and 997.3758488117479 s by indirect shooting (tests/references, cases S2_20km and S2_15km).
    assert!((time(1) - time(0) - 1.981_135_2).abs() < MESH_S, "{v}");
    assert_eq!(v["keys"]["perilune_altitude_km"], serde_json::json!(["15", "20"]));
    let o = apsides(&["compare", &first, &path(&dir.path().join("none"))]);
    assert_eq!(o.status.code(), Some(2));
    assert!(stderr(&o).contains("no result directory"), "{}", stderr(&o));
}

/// Methods whose states have more nodes than their controls.
#[test]
fn results_of_shooting_are_written_and_verified_again() {
    let dir = tempfile::tempdir().unwrap();
    // Feasible, with controls on a grid that are no extremal; constant ones are the best of their kind.
    let claim = "claim: strict-local-optimum among controls constant on each of";
    for (method, more, status, words) in [
        ("multiple-shooting", "motion=plane", 4, "feasible"),
        ("piecewise", "piecewise.max_refinements=0", 0, claim),
    ] {
        let out = path(&dir.path().join(method));
        let o = apsides(&[
            "solve",
            "chang-e-3-braking",
            "--set",
            "motion=plane",
            "--set",
            more,
            "--method",
            method,
            "--quiet",
            "--out",
            &out,
        ]);
        assert_eq!(o.status.code(), Some(status), "{}", stderr(&o));
        let again = apsides(&["verify", &out]);
        assert_eq!(again.status.code(), Some(status), "{}{}", stdout(&again), stderr(&again));
        assert!(stdout(&again).contains(words), "{}", stdout(&again));
    }
}

#[test]
fn a_trajectory_of_another_program_is_certified() {
    let dir = tempfile::tempdir().unwrap();
    // Rest to rest in one second with the least energy: u = 6 - 12 t, 6 units of energy.
    let mut optimal = String::from("time,x,v,u\n");
    let mut slow = String::from("time,x,v,u\n");
    for k in 0..=20 {
        let t = f64::from(k) / 20.0;
        let (x, v) = (3.0 * t * t - 2.0 * t.powi(3), 6.0 * t - 6.0 * t * t);
        optimal += &format!("{t},{x},{v},{}\n", 6.0 - 12.0 * t);
        slow += &format!("{t},{x},{v},{}\n", 5.0 - 12.0 * t);
    }
    let file = |name: &str, text: &str| {
        let file = dir.path().join(name);
        std::fs::write(&file, text).unwrap();
        path(&file)
    };
    let o = apsides(&["certify", "di_min_energy", &file("optimal.csv", &optimal)]);
    assert_eq!(o.status.code(), Some(0), "{}{}", stdout(&o), stderr(&o));
    assert!(stdout(&o).contains("certificate: global-optimum"), "{}", stdout(&o));
    let o = apsides(&["certify", "di_min_energy", &file("slow.csv", &slow), "--json"]);
    assert_eq!(o.status.code(), Some(4), "{}", stderr(&o));
    let v: serde_json::Value = serde_json::from_str(&stdout(&o)).unwrap();
    assert_eq!(v["certificate"]["verdict"], "rejected");
    assert!(v["feasible_to"].as_f64().unwrap() > 1e3);
    // Positions that are not those of the flight under these controls.
    let header = optimal.lines().next().unwrap().to_owned();
    let off = optimal.lines().skip(1).enumerate().map(|(k, line)| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if k == 10 {
            cells[1] = "0.51".into();
        }
        cells.join(",")
    });
    let off = std::iter::once(header).chain(off).collect::<Vec<_>>().join("\n");
    let o = apsides(&["certify", "di_min_energy", &file("off.csv", &off)]);
    assert_eq!(o.status.code(), Some(4), "{}", stdout(&o));
    assert!(stdout(&o).contains("certificate: rejected"), "{}", stdout(&o));
    let words = stdout(&o).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("it is not the flight that is stated"), "{words}");
    let o = apsides(&["certify", "di_min_energy", &file("none.csv", "time,x\n0,1\n")]);
    assert_eq!(o.status.code(), Some(2));
    assert!(stderr(&o).contains("no column `v`"), "{}", stderr(&o));
    let o = apsides(&["problems", "di_min_energy"]);
    assert!(stdout(&o).contains("optimum   6 "), "{}", stdout(&o));
}

/// The commands of docs/problems.md.
const OWN_PROBLEM: [&str; 8] = [
    "apsides new problem lander.toml",
    "apsides check lander.toml",
    "apsides solve lander.toml --out results",
    "apsides solve lander.toml --set constants.thrust=50 --sensitivity",
    "apsides sweep lander.toml --set constants.thrust=45,50,55 --out sweep",
    "apsides montecarlo lander.toml --sigma constants.thrust=0.5 --sigma constants.isp=2 --samples 50 --out cases",
    "apsides certify lander.toml results/trajectory.csv",
    "apsides verify results",
];

#[test]
fn a_problem_of_ones_own_is_begun_solved_swept_and_verified() {
    let dir = tempfile::tempdir().unwrap();
    let run = |command: &str| {
        let arguments = command.split(' ').skip(1);
        Command::new(env!("CARGO_BIN_EXE_apsides")).args(arguments).current_dir(dir.path()).output().unwrap()
    };
    for command in OWN_PROBLEM {
        let o = run(command);
        assert_eq!(o.status.code(), Some(0), "{command}: {}{}", stdout(&o), stderr(&o));
        if command.contains("--sensitivity") {
            assert!(stdout(&o).contains("+1 kN of constants.thrust"), "{}", stdout(&o));
        }
    }
    // The written file stands alone and has the values that were set.
    let o =
        run("apsides solve lander.toml --set constants.thrust=50 --set radau.points=6 --out other --quiet");
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    let written = std::fs::read_to_string(dir.path().join("other/mission.toml")).unwrap();
    assert!(written.contains("thrust = \"50.0 kN\"") && written.contains("points = 6"), "{written}");
    assert!(written.contains("# The rate of each state."), "comments stay: {written}");
    let again = run("apsides solve other/mission.toml --json --quiet");
    let first =
        run("apsides solve lander.toml --set constants.thrust=50 --set radau.points=6 --json --quiet");
    let objective = |o: &Output| {
        let json: serde_json::Value = serde_json::from_str(&stdout(o)).unwrap();
        json["objective"]["value"].as_f64().unwrap()
    };
    assert_eq!(objective(&again), objective(&first));
    // What is there stays.
    let o = run("apsides new problem lander.toml");
    assert_eq!(o.status.code(), Some(2));
    assert!(stderr(&o).contains("exists and stays as it is"), "{}", stderr(&o));
    let o = run("apsides solve lander.toml --set constants.thrst=50");
    assert!(stderr(&o).contains("the nearest is `constants.thrust`"), "{}", stderr(&o));
    // A mistake has its place.
    let text = std::fs::read_to_string(dir.path().join("lander.toml")).unwrap();
    std::fs::write(dir.path().join("wrong.toml"), text.replace("- gravity", "- gravity*3 [s]")).unwrap();
    let o = run("apsides check wrong.toml");
    assert_eq!(o.status.code(), Some(2));
    assert!(stderr(&o).contains("file `wrong.toml`, line 33, column 6: `-` takes"), "{}", stderr(&o));
}
