//! The program as a user meets it: output, files, exit status.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::process::{Command, Output};

fn apsides(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_apsides")).args(arguments).output().unwrap()
}

fn stderr(o: &Output) -> String {
    String::from_utf8_lossy(&o.stderr).into_owned()
}

fn stdout(o: &Output) -> String {
    String::from_utf8_lossy(&o.stdout).into_owned()
}

fn path(p: &Path) -> String {
    p.to_string_lossy().into_owned()
}

#[test]
fn solve_prints_one_json_object_with_stable_keys() {
    let o = apsides(&["solve", "lunar-perilune", "--json", "--quiet"]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert!(o.stderr.is_empty());
    let v: serde_json::Value = serde_json::from_slice(&o.stdout).unwrap();
    assert_eq!(v["mission"], "lunar-perilune");
    assert_eq!((&v["method"], &v["status"]), (&"radau".into(), &"optimal".into()));
    assert_eq!((&v["objective"]["name"], &v["objective"]["unit"]), (&"flight_time".into(), &"s".into()));
    // 997.3758488117479 s by indirect shooting (tests/references/lunar_landing.py, case S2_15km).
    assert!((v["results"]["flight_time_s"].as_f64().unwrap() - 997.375_848_811_747_9).abs() < 1e-5);
    for key in ["final_mass_kg", "final_thrust_angle_deg", "downrange_angle_deg"] {
        assert!(v["results"][key].is_f64(), "{key}");
    }
    for key in ["iterations", "factorisations", "variables", "constraints", "mesh_iterations"] {
        assert!(v["counters"][key].is_u64(), "{key}");
    }
    for key in ["build", "solve", "verify"] {
        assert!(v["timing_ms"][key].is_f64(), "{key}");
    }
    assert_eq!(v["certificate"]["verdict"], "strict-local-optimum");
    let check = &v["certificate"]["checks"][0];
    for key in ["name", "value", "limit", "margin", "unit", "at", "passed"] {
        assert!(!check[key].is_null(), "{key}");
    }
}

/// The JSON of a mission that cannot be flown has the sentence of the text, and its parts as data.
#[test]
fn json_says_what_the_text_says() {
    let o = apsides(&["solve", "lunar-transfer", "--set", "dry_mass_kg=154", "--json", "--quiet"]);
    assert_eq!(o.status.code(), Some(3), "{}", stderr(&o));
    let v: serde_json::Value = serde_json::from_slice(&o.stdout).unwrap();
    assert!(v["message"].as_str().unwrap().contains("mass at least 154 kg: short by"), "{v}");
    let conflict = &v["explanation"]["conflicts"][0];
    assert_eq!((&conflict["key"], &conflict["unit"]), (&"dry_mass_kg".into(), &"kg".into()));
    assert_eq!((&conflict["phase"], &conflict["relation"]), (&"braking".into(), &"at least".into()));
    assert_eq!(conflict["limit"], 154.0);
    // 153.7513 kg are left (tests/references/lunar_landing.py).
    assert!((conflict["relaxed_to"].as_f64().unwrap() - 153.7513).abs() < 1e-3, "{conflict}");
    assert!(conflict["amount"].is_f64() && conflict["time"].is_f64(), "{conflict}");
    let remedies = v["explanation"]["remedies"].as_array().unwrap();
    let floor = remedies.iter().find(|r| r["key"] == "perilune_floor_km").unwrap();
    assert_eq!((&floor["limit"], &floor["unit"]), (&15.0.into(), &"km".into()));
}

/// A solution is called by the method that gave it.
#[test]
fn a_solution_by_another_method_says_so() {
    let o = apsides(&["solve", "lunar-vertical", "--method", "indirect", "--quiet"]);
    let text = stdout(&o);
    assert!(text.starts_with("mission lunar-perilune by indirect: not-converged\n"), "{text}");
    assert!(text.contains("what follows is the solution by radau\n"), "{text}");
    assert!(text.contains("certificate of the solution by radau: "), "{text}");
    let o = apsides(&["solve", "lunar-vertical", "--method", "indirect", "--quiet", "--json"]);
    let v: serde_json::Value = serde_json::from_slice(&o.stdout).unwrap();
    assert_eq!((&v["method"], &v["solved_by"]), (&"indirect".into(), &"radau".into()));
    assert!(v["message"].as_str().unwrap().contains("that solution is returned"), "{v}");
}

/// A mission that is not there is answered by what may be meant, a request by the missions that take it.
#[test]
fn names_of_missions_are_suggested() {
    let refused = |arguments: &[&str]| {
        let o = apsides(arguments);
        assert_eq!(o.status.code(), Some(2), "{arguments:?}");
        stderr(&o)
    };
    assert!(refused(&["solve", "lunar-perilunee"]).contains("the nearest is `lunar-perilune`"));
    assert!(
        refused(&["solve", "geo-injection"]).contains("the kind of mission of `geo-1-burn`, `geo-2-burn`")
    );
    assert!(
        refused(&["solve", "lunar-direct.toml"]).contains("without its ending `lunar-direct` is a mission")
    );
    assert!(refused(&["solve", "xyz"]).contains("missions: `lunar-direct`, "));
    let able = "missions that have: `chang-e-3-braking`, `moving-mass-cross`, `moving-mass-radial`";
    assert!(refused(&["montecarlo", "lunar-perilune"]).contains(able));
    let o = apsides(&["missions", "lunar-throttled"]);
    let text = stdout(&o);
    assert!(text.starts_with("lunar-throttled: Soft landing from the perilune"), "{text}");
    assert!(text.contains("\nmission = \"lunar-perilune\": "), "{text}");
}

#[test]
fn prices_are_given_when_asked_for() {
    let dir = tempfile::tempdir().unwrap();
    let out = path(dir.path());
    let o = apsides(&["solve", "lunar-perilune", "--quiet", "--sensitivity", "--out", &out]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    let text = stdout(&o);
    let line = text.lines().find(|l| l.contains("+1 N of thrust_n:")).unwrap();
    // Half the difference of missions with 441 and 439 N: -2.844744 s, 0.0836475 kg, 0.0900799 deg.
    assert!(
        line.ends_with(" -2.845 s flight_time, +0.08365 kg final_mass, +0.09008 deg final_thrust_angle"),
        "{line}"
    );
    let file = std::fs::read(dir.path().join("sensitivity.json")).unwrap();
    let prices: serde_json::Value = serde_json::from_slice(&file).unwrap();

    let o = apsides(&["solve", "lunar-perilune", "--quiet", "--sensitivity", "--json"]);
    let v: serde_json::Value = serde_json::from_slice(&o.stdout).unwrap();
    assert_eq!(v["sensitivity"], prices);
    let thrust = prices.as_array().unwrap().iter().find(|p| p["key"] == "thrust_n").unwrap();
    assert_eq!(thrust["unit"], "N");
    // Less time with more thrust, and the landed mass follows from the flow of propellant.
    assert!(thrust["objective"].as_f64().unwrap() < 0.0);
    assert!(thrust["results"]["final_mass_kg"].is_f64());

    let o = apsides(&["solve", "lunar-perilune", "--quiet", "--json", "--out", &out]);
    let v: serde_json::Value = serde_json::from_slice(&o.stdout).unwrap();
    assert!(v.get("sensitivity").is_none());
    assert!(!dir.path().join("sensitivity.json").exists());
}

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
    let again = apsides(&["verify", &path(&out)]);
    assert_eq!(again.status.code(), Some(0), "{}{}", stdout(&again), stderr(&again));
    assert!(stdout(&again).contains("flown in Cartesian coordinates"));
    std::fs::write(&csv, tamper(&text, "out_of_plane_thrust_angle_rad", 10..20, 1e-4)).unwrap();
    assert_eq!(apsides(&["verify", &path(&out)]).status.code(), Some(4));
}

#[test]
fn bad_input_is_one_sentence_and_leaves_results_alone() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("results");
    std::fs::create_dir(&out).unwrap();
    std::fs::write(out.join("summary.json"), "earlier").unwrap();
    let mission = dir.path().join("m.toml");
    std::fs::write(&mission, "mission = \"lunar-direct\"\nthrust_kn = 0.44\n").unwrap();
    let o = apsides(&["solve", &path(&mission), "--out", &path(&out)]);
    assert_eq!(o.status.code(), Some(2));
    let text = stderr(&o);
    assert_eq!(text.lines().count(), 1, "{text}");
    assert!(text.contains("m.toml`, line 2") && text.contains("in its unit it is `thrust_n`"), "{text}");
    assert!(o.stdout.is_empty());
    assert_eq!(std::fs::read_to_string(out.join("summary.json")).unwrap(), "earlier");

    for bad in [
        vec!["solve", "no-such-mission"],
        vec!["solve", "lunar-direct", "--set", "isp_s=0"],
        vec!["solve", "lunar-direct", "--threads", "0"],
        vec!["solve"],
        vec!["fly", "lunar-direct"],
        vec!["sweep", "lunar-direct", "--set", "thrust_n="],
        vec!["check", "lunar-direct", "--set", "thrust_n=20"],
        vec!["verify", "no-such-directory"],
        vec!["missions", "mars"],
    ] {
        assert_eq!(apsides(&bad).status.code(), Some(2), "{bad:?}");
    }
    // A file in the place of the directory, and a directory that cannot be made.
    for bad in [path(&mission), path(&mission.join("below"))] {
        let o = apsides(&["solve", "lunar-direct", "--quiet", "--out", &bad]);
        assert_eq!(o.status.code(), Some(2));
        assert!(stderr(&o).contains(&bad), "{}", stderr(&o));
        assert!(o.stdout.is_empty(), "nothing is solved in vain");
    }
}

/// Refusals are one sentence of a line or two, name the key that was set, and answer at once.
#[test]
fn sentences_name_the_key_and_are_short() {
    let dir = tempfile::tempdir().unwrap();
    let refused = |arguments: &[&str]| {
        let begin = std::time::Instant::now();
        let o = apsides(arguments);
        assert_eq!(o.status.code(), Some(2), "{arguments:?}");
        assert!(begin.elapsed().as_secs() < 20);
        let text = stderr(&o);
        assert!(text.len() < 1000 && text.lines().count() == 1, "{text}");
        assert!(!text.trim_end().chars().any(char::is_control), "{text:?}");
        text
    };
    for (mission, set) in [
        ("lunar-two-phase", "gate_altitude_km=1e-300"),
        ("lunar-two-phase", "initial_mass_kg=1e300"),
        ("lunar-two-phase", "isp_s=1e300"),
        ("lunar-two-phase", "body_radius_km=1e-300"),
        ("lunar-two-phase", "gravitational_parameter_km3_s2=1e-12"),
        ("lunar-direct", "thrust_n=1e300"),
        ("moving-mass-cross", "moving_mass_kg=1e300"),
        ("moving-mass-cross", "offset_y_m=1e300"),
    ] {
        let text = refused(&["check", mission, "--set", set]);
        assert!(text.contains(set.split_once('=').unwrap().0), "{set}: {text}");
    }
    let file = |name: &str, text: &str| {
        let file = dir.path().join(name);
        std::fs::write(&file, text).unwrap();
        path(&file)
    };
    let long = format!("mission = \"lunar-direct\"\n{} = 1\n", "k".repeat(1_000_000));
    let text = refused(&["check", &file("long.toml", &long)]);
    assert!(text.contains("kkkk..(10000") && text.contains(" characters).."), "{text}");
    let value = format!("mission = \"lunar-direct\"\nmethod = \"{}\"\n", "m".repeat(1_000_000));
    assert!(refused(&["check", &file("value.toml", &value)]).contains("method"));
    let escaped = refused(&["terrain", "info", &file("a\u{1b}[31m\nb.asc", "\u{1b}[2J")]);
    assert!(escaped.contains("a\\u{1b}[31m\\nb.asc"), "{escaped}");
    // Integers of any base are numbers.
    for (set, shown) in [("thrust_n=0x1B8", "thrust_n = 440.0"), ("radau.points=0b110", "points = 6")] {
        let o = apsides(&["check", "lunar-direct", "--set", set]);
        assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
        assert!(stdout(&o).contains(shown), "{}", stdout(&o));
    }
}

#[test]
fn a_mission_that_cannot_be_flown_says_what_is_missing() {
    let o =
        apsides(&["solve", "lunar-perilune", "--quiet", "--set", "thrust_n=200", "--set", "dry_mass_kg=100"]);
    assert_eq!(o.status.code(), Some(3), "{}", stdout(&o));
    let text = stdout(&o);
    assert!(text.contains("phase `braking`: mass at least 100 kg: short by"), "{text}");
    assert!(text.contains("feasible if phase `braking`: mass is lowered from 100 to"), "{text}");
}

#[test]
fn the_residuals_of_the_guess_are_named_before_the_first_iteration() {
    let o = apsides(&["solve", "lunar-perilune", "--quiet", "--explain"]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    let text = stderr(&o);
    assert!(text.starts_with("largest residuals of the initial guess"), "{text}");
    assert!(text.contains("phase `braking`, constraint `equation of motion of"), "{text}");
}

#[test]
fn sweep_writes_a_row_per_case() {
    let dir = tempfile::tempdir().unwrap();
    let csv = dir.path().join("sweep.csv");
    let o =
        apsides(&["sweep", "lunar-perilune", "--set", "perilune_altitude_km=20,15", "--out", &path(&csv)]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    let text = std::fs::read_to_string(&csv).unwrap();
    let rows: Vec<&str> = text.lines().collect();
    assert_eq!(rows.len(), 3, "{text}");
    assert!(rows[0].starts_with("perilune_altitude_km,"));
    assert!(rows[1].starts_with("20,") && rows[2].starts_with("15,"));
    assert!(!dir.path().join("sweep.csv.partial").exists());
}

/// A transfer of three burns has results that one of two burns does not have; the table has the columns of both.
#[test]
fn cases_of_a_sweep_need_not_have_the_same_results() {
    let dir = tempfile::tempdir().unwrap();
    let csv = dir.path().join("sweep.csv");
    let o = apsides(&["sweep", "geo-2-burn", "--set", "burns=3,2", "--out", &path(&csv)]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    let mut table = csv::Reader::from_path(&csv).unwrap();
    let column = table.headers().unwrap().iter().position(|name| name == "burn_3_time_s").unwrap();
    let rows: Vec<csv::StringRecord> = table.records().collect::<Result<_, _>>().unwrap();
    assert_eq!(rows.len(), 2);
    assert!(rows[0][column].parse::<f64>().unwrap() > 0.0, "{rows:?}");
    assert_eq!(&rows[1][column], "", "{rows:?}");
}

#[test]
fn sweep_gives_prices_and_draws_them() {
    let dir = tempfile::tempdir().unwrap();
    let (csv, svg) = (dir.path().join("sweep.csv"), dir.path().join("prices.svg"));
    let thrusts = ["sweep", "lunar-perilune", "--set", "radau.points=5", "--set", "thrust_n=430,440,450"];
    let files = ["--sensitivity", "--out", &path(&csv), "--figure", &path(&svg)];
    let o = apsides(&[&thrusts[..], &files[..]].concat());
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert!(stdout(&o).contains("price_thrust_n"), "{}", stdout(&o));
    assert!(!stdout(&o).contains("price_radau.points"), "a setting has no price");
    let text = std::fs::read_to_string(&csv).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().map(|l| l.split(',').collect()).collect();
    let column = |name| rows[0].iter().position(|h| *h == name).unwrap();
    let number = |row: usize, name| rows[row][column(name)].parse::<f64>().unwrap();
    // Simpson's rule over the prices is the difference of the times.
    let price = |row| number(row, "price_thrust_n");
    let sum = 20.0 * (price(1) + 4.0 * price(2) + price(3)) / 6.0;
    let difference = number(3, "flight_time_s") - number(1, "flight_time_s");
    assert!((sum - difference).abs() < 1e-4 * difference.abs(), "{sum} {difference}");
    let drawn = std::fs::read_to_string(&svg).unwrap();
    assert!(drawn.contains("price (s per N)") && drawn.contains("flight time (s)"));
    assert_eq!(drawn.matches("<svg").count(), drawn.matches("</svg>").count());
    assert_eq!(drawn.matches("<svg").count(), 3);

    // A limit that is infinite has no price, and a word has none.
    let limits = ["sweep", "lunar-vertical", "--set", "throttle=full", "--sensitivity"];
    let o = apsides(&limits);
    assert_eq!(o.status.code(), Some(2));
    assert!(stderr(&o).contains("no swept key has a price"), "{}", stderr(&o));
    for figure in [path(dir.path()), path(&dir.path().join("none").join("f.svg"))] {
        let o = apsides(&[&thrusts[..], &["--sensitivity", "--figure", &figure]].concat());
        assert_eq!(o.status.code(), Some(2));
        assert!(o.stdout.is_empty() && stderr(&o).contains(&figure), "{}", stderr(&o));
    }
    assert_eq!(apsides(&[&thrusts[..], &["--figure", &path(&svg)]].concat()).status.code(), Some(2));
}

#[test]
fn a_footprint_is_written_with_a_map() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("footprint");
    let mut arguments = vec!["footprint", "capsule-reentry", "--bearings", "6", "--quiet"];
    for limit in ["dynamic_pressure_limit_kpa=inf", "load_limit_m_s2=inf", "heat_rate_limit_kw_m2=inf"] {
        arguments.extend(["--set", limit]);
    }
    let out = path(&out);
    let o = apsides(&[&arguments[..], &["--out", &out]].concat());
    assert!(matches!(o.status.code(), Some(0 | 4)), "{}{}", stdout(&o), stderr(&o));
    let text = stdout(&o);
    for part in
        ["from the centre along 300.0 deg", "along the entry course", "target                  inside, "]
    {
        assert!(text.contains(part), "{part}: {text}");
    }
    let read = |name: &str| std::fs::read_to_string(Path::new(&out).join(name)).unwrap();
    let v: serde_json::Value = serde_json::from_str(&read("footprint.json")).unwrap();
    let points = v["points"].as_array().unwrap().len();
    assert_eq!(points, 13);
    let csv = read("footprint.csv");
    assert!(csv.starts_with("kind,bearing_deg,distance_km,longitude_deg,latitude_deg,flight_time_s,"));
    assert_eq!(csv.lines().count(), 1 + points);
    assert_eq!(v["complete"], true);
    assert_eq!(o.status.code() == Some(0), v["verified"] == points);
    assert!(read("footprint.svg").contains("longitude (deg)"));

    let o = apsides(&["footprint", "lunar-direct", "--out", &path(&dir.path().join("none"))]);
    assert_eq!(o.status.code(), Some(2));
    assert!(stderr(&o).contains("missions with one: `capsule-reentry`"), "{}", stderr(&o));
    assert!(!dir.path().join("none").exists());
    assert_eq!(apsides(&["footprint", "capsule-reentry", "--bearings", "2"]).status.code(), Some(2));
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
fn a_descent_is_simulated_and_written() {
    let dir = tempfile::tempdir().unwrap();
    let out = path(&dir.path().join("descent"));
    let o = apsides(&["simulate", "moving-mass-cross", "--set", "moving_mass_kg=5", "--out", &out]);
    assert_eq!(o.status.code(), Some(0), "{}{}", stdout(&o), stderr(&o));
    for part in ["flown down to 3 km", "attack_rms_deg", "saturation_time_s", "phase deg", "stable"] {
        assert!(stdout(&o).contains(part), "{part}: {}", stdout(&o));
    }
    let read = |name: &str| std::fs::read_to_string(Path::new(&out).join(name)).unwrap();
    let v: serde_json::Value = serde_json::from_str(&read("summary.json")).unwrap();
    // The reference has 0.5906 deg.
    let rms = v["results"]["attack_rms_deg"].as_f64().unwrap();
    assert!((rms / 0.5906 - 1.0).abs() < 0.01, "{rms}");
    let csv = read("states.csv");
    assert!(
        csv.starts_with("time_s,altitude_m,angle_of_attack_rad,sideslip_rad,"),
        "{}",
        csv.lines().next().unwrap()
    );
    assert!(csv.lines().skip(1).all(|l| l.split(',').all(|n| n.parse::<f64>().unwrap().is_finite())));
    for part in ["angular velocity", "root locus of the angle of attack", "nominal gain"] {
        assert!(read("report.html").contains(part), "{part}");
    }
    let again = apsides(&["simulate", &format!("{out}/mission.toml"), "--json"]);
    let found: serde_json::Value = serde_json::from_slice(&again.stdout).unwrap();
    assert_eq!(found["results"], v["results"]);

    // What fails says why and when; nothing in its files is not finite.
    let o = apsides(&[
        "simulate",
        "moving-mass-cross",
        "--set",
        "damping=unstable",
        "--set",
        "rate_limit_m_s=0.2",
        "--out",
        &out,
    ]);
    assert_eq!(o.status.code(), Some(3));
    assert!(stdout(&o).contains("tumbling: the total angle of attack exceeds 90 deg, at "), "{}", stdout(&o));
    assert!(!read("states.csv").to_lowercase().contains("nan") && !read("summary.json").contains("NaN"));

    // What is simulated is not solved, and the other way round.
    for (arguments, part) in [
        (
            ["solve", "moving-mass-cross"],
            "it is simulated under its law, not optimised: use `apsides simulate`",
        ),
        (["simulate", "lunar-direct"], "it is optimised, not simulated: use `apsides solve`"),
        (["footprint", "moving-mass-radial"], "not optimised"),
    ] {
        let o = apsides(&arguments);
        assert_eq!(o.status.code(), Some(2), "{arguments:?}");
        assert!(stderr(&o).contains(part), "{}", stderr(&o));
    }
    let run = |threads| {
        let o = apsides(&[
            "montecarlo",
            "moving-mass-cross",
            "--samples",
            "6",
            "--offset-m",
            "0.003",
            "--json",
            "--quiet",
            "--threads",
            threads,
        ]);
        assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
        o.stdout
    };
    assert_eq!(run("1"), run("2"));
    let o = apsides(&["montecarlo", "moving-mass-cross", "--samples", "6", "--thrust-percent", "1"]);
    assert!(stderr(&o).contains("--thrust-percent"), "{}", stderr(&o));
}

#[test]
fn a_monte_carlo_without_deviations_and_a_table_that_ends_are_named() {
    let o = apsides(&["montecarlo", "moving-mass-cross", "--samples", "2"]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert!(stderr(&o).contains("no deviation is given (--offset-m, "), "{}", stderr(&o));
    // Mach 40.
    let o = apsides(&["simulate", "moving-mass-cross", "--set", "entry_speed_m_s=11000"]);
    assert_eq!(o.status.code(), Some(3), "{}", stderr(&o));
    assert!(
        stdout(&o).contains("the Mach number exceeds 9, where the table of coefficients ends, at 0.000 s")
    );
}

#[test]
fn samples_as_parquet_need_the_feature() {
    let dir = tempfile::tempdir().unwrap();
    let out = path(dir.path());
    let o = apsides(&[
        "montecarlo",
        "chang-e-3-braking",
        "--samples",
        "3",
        "--quiet",
        "--format",
        "parquet",
        "--out",
        &out,
    ]);
    if cfg!(feature = "parquet") {
        assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
        let bytes = std::fs::read(dir.path().join("montecarlo.parquet")).unwrap();
        assert!(bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1"));
    } else {
        assert_eq!(o.status.code(), Some(2));
        assert!(stderr(&o).contains("--features parquet"), "{}", stderr(&o));
    }
}

#[test]
fn missions_and_check_print_what_there_is() {
    let o = apsides(&["missions"]);
    assert_eq!(o.status.code(), Some(0));
    assert_eq!(stdout(&o).lines().count(), 23);
    assert!(stdout(&o).contains("lunar-vertical"));
    let keys = stdout(&apsides(&["missions", "lunar-two-phase"]));
    assert!(keys.contains("gate_altitude_km") && keys.contains("radau.points"), "{keys}");
    let o = apsides(&["check", "lunar-direct", "--set", "thrust_n=500"]);
    assert_eq!(o.status.code(), Some(0));
    assert!(stdout(&o).contains("thrust_n = 500.0"));
    for help in [
        vec!["--help"],
        vec!["solve", "--help"],
        vec!["sweep", "--help"],
        vec!["footprint", "--help"],
        vec!["verify", "--help"],
    ] {
        let o = apsides(&help);
        assert!(o.status.success() && stdout(&o).contains("Example"), "{help:?}");
    }
}

#[test]
fn a_publication_is_reproduced_with_findings() {
    let dir = tempfile::tempdir().unwrap();
    let o = apsides(&["reproduce", "lunar-landing", "--quiet", "--out", &path(dir.path())]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    let text = stdout(&o);
    for part in [
        "initial altitude (km): 15",
        "printed time below the minimum by 0.073 s: not a feasible trajectory",
        "(31 variables, 22 constraints), flown again, misses by +15.6 m, +0.75 m/s horizontally, -0.90 m/s radially",
        "printed mass above the largest possible by 0.249 kg",
        "the vehicle is 387 m above the ground at -4.98 m/s",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    for file in ["reproduction.md", "reproduction.csv", "table-2.svg", "table-3.svg"] {
        assert!(text.contains(file) && dir.path().join(file).is_file(), "{file}");
    }
    assert!(stdout(&apsides(&["reproduce"])).starts_with("lunar-landing  "));
    let refused = apsides(&["reproduce", "lunar"]);
    assert_eq!(refused.status.code(), Some(2));
    assert_eq!(
        stderr(&refused),
        "apsides: reproduce: `name` is \"lunar\", allowed is \"lunar-landing\" or \"geo-injection\" or \"capsule-reentry\" or \"chang-e-3\" or \"moving-mass\"\n"
    );
}

#[test]
fn the_same_mission_gives_the_same_bytes() {
    let run = |threads| {
        let o = apsides(&["solve", "lunar-direct", "--json", "--quiet", "--threads", threads]);
        let mut v: serde_json::Value = serde_json::from_slice(&o.stdout).unwrap();
        v["timing_ms"] = serde_json::Value::Null;
        v.to_string()
    };
    assert_eq!(run("1"), run("2"));
}

/// A search that is killed goes on from its file to what it would have found.
#[test]
fn a_killed_search_resumes_to_the_same_end() {
    let dir = tempfile::tempdir().unwrap();
    let file = path(&dir.path().join("search.json"));
    let arguments = [
        "solve",
        "capsule-reentry",
        "--method",
        "two-layer",
        "--json",
        "--quiet",
        "--seed",
        "7",
        "--set",
        "search.evaluations=20000",
        "--set",
        "radau.max_refinements=0",
        "--set",
        "margins=false",
    ];
    let resumable: Vec<&str> = arguments.iter().copied().chain(["--checkpoint", &file]).collect();
    let mut killed = Command::new(env!("CARGO_BIN_EXE_apsides"))
        .args(&resumable)
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let begin = std::time::Instant::now();
    while !Path::new(&file).exists() && begin.elapsed().as_secs() < 120 {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    killed.kill().unwrap();
    killed.wait().unwrap();
    let text = std::fs::read_to_string(&file).unwrap();
    let state: serde_json::Value = serde_json::from_str(&text).unwrap();
    let done = state["run"]["evaluations"].as_u64().unwrap();
    assert!(done > 0 && done < 20_000, "killed after {done} flights");
    let found = |o: &Output| {
        let v: serde_json::Value = serde_json::from_slice(&o.stdout).unwrap();
        let search = v["search"].clone();
        let of_search =
            ["evaluations", "generations", "objective", "miss_km", "history"].map(|k| search[k].clone());
        (of_search, v["objective"].clone(), v["results"].clone(), v["counters"].clone())
    };
    let resumed = apsides(&resumable);
    let whole = apsides(&arguments);
    assert_eq!(found(&resumed), found(&whole), "{}", stderr(&resumed));
    // With another seed the file is refused.
    let other: Vec<&str> = resumable.iter().map(|a| if *a == "7" { "8" } else { a }).collect();
    let o = apsides(&other);
    assert_eq!(o.status.code(), Some(2));
    assert!(stderr(&o).contains("belongs to a mission with other values or another seed"), "{}", stderr(&o));
}

#[test]
fn tune_prints_gains_and_writes_a_mission() {
    let dir = tempfile::tempdir().unwrap();
    let file = path(&dir.path().join("tuned.toml"));
    let few = ["--directions", "0", "--evaluations", "5", "--out", &file];
    let o = apsides(&[&["tune", "moving-mass-cross", "--set", "rate_limit_m_s=0.2"], &few[..]].concat());
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert!(
        stdout(&o).contains("1 of 1 held") && stdout(&o).contains("--set pid.attack_p="),
        "{}",
        stdout(&o)
    );
    let o = apsides(&["simulate", &file, "--json"]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    let v: serde_json::Value = serde_json::from_slice(&o.stdout).unwrap();
    assert_eq!(v["status"], "completed");
}

#[test]
fn tune_and_size_refuse_what_has_no_moving_masses() {
    for command in ["tune", "size"] {
        let o = apsides(&[command, "lunar-perilune"]);
        assert_eq!(o.status.code(), Some(2));
        assert!(stderr(&o).contains("lunar-perilune"), "{}", stderr(&o));
    }
    let o = apsides(&["size", "moving-mass-cross", "--margin", "0"]);
    assert_eq!(o.status.code(), Some(2));
    assert!(stderr(&o).contains("--margin is 0"), "{}", stderr(&o));
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
    "apsides sweep lander.toml --set constants.thrust=45,50,55 --out sweep.csv",
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
