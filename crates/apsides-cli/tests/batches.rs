//! Many flights at once: sweeps, footprints, simulations, searches, publications.
#![allow(clippy::unwrap_used)]

mod support;

use std::path::Path;
use std::process::{Command, Output};

use support::{apsides, path, stderr, stdout};

/// Discretisation: Simpson's rule over the prices of three values, relative.
const SIMPSON: f64 = 1e-4;

/// Published: what the steps of the reference leave of its figures, relative.
const PUBLISHED: f64 = 0.01;

#[test]
fn sweep_writes_a_row_per_case() {
    let dir = tempfile::tempdir().unwrap();
    // No directory of this name is there before.
    let out = dir.path().join("runs/sweep");
    let csv = out.join("sweep.csv");
    let o =
        apsides(&["sweep", "lunar-perilune", "--set", "perilune_altitude_km=20,15", "--out", &path(&out)]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    let text = std::fs::read_to_string(&csv).unwrap();
    let rows: Vec<&str> = text.lines().collect();
    assert_eq!(rows.len(), 3, "{text}");
    assert!(rows[0].starts_with("perilune_altitude_km,"));
    assert!(rows[1].starts_with("20,") && rows[2].starts_with("15,"));
    let mut names: Vec<_> = std::fs::read_dir(&out).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["sweep.csv", "sweep.html"]);
    let page = std::fs::read_to_string(out.join("sweep.html")).unwrap();
    assert!(page.contains("<h1>Sweep of ") && page.contains("<figcaption>"), "{page}");
}

/// A transfer of three burns has results that one of two burns does not have; the table has the columns of both.
#[test]
fn cases_of_a_sweep_need_not_have_the_same_results() {
    let dir = tempfile::tempdir().unwrap();
    let csv = dir.path().join("sweep.csv");
    let o = apsides(&["sweep", "geo-2-burn", "--set", "burns=3,2", "--out", &path(dir.path())]);
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
    let files = ["--sensitivity", "--out", &path(dir.path()), "--figure", &path(&svg)];
    let o = apsides(&[&thrusts[..], &files[..]].concat());
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert_eq!(stdout(&o).matches("price").count(), 2, "a setting has no price: {}", stdout(&o));
    let text = std::fs::read_to_string(&csv).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().map(|l| l.split(',').collect()).collect();
    let column = |name| rows[0].iter().position(|h| *h == name).unwrap();
    let number = |row: usize, name| rows[row][column(name)].parse::<f64>().unwrap();
    // Simpson's rule over the prices is the difference of the times.
    let price = |row| number(row, "price_thrust_n");
    let sum = 20.0 * (price(1) + 4.0 * price(2) + price(3)) / 6.0;
    let difference = number(3, "flight_time_s") - number(1, "flight_time_s");
    assert!((sum - difference).abs() < SIMPSON * difference.abs(), "{sum} {difference}");
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
    assert!(
        read("footprint.svg").contains("longitude (deg)") && read("footprint.svg").contains("ground track")
    );
    assert!(read("footprint.html").contains("are within reach"), "{}", read("footprint.html"));

    let o = apsides(&["footprint", "lunar-direct", "--out", &path(&dir.path().join("none"))]);
    assert_eq!(o.status.code(), Some(2));
    assert!(stderr(&o).contains("missions with one: `capsule-reentry`"), "{}", stderr(&o));
    assert!(!dir.path().join("none").exists());
    assert_eq!(apsides(&["footprint", "capsule-reentry", "--bearings", "2"]).status.code(), Some(2));
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
    assert!((rms / 0.5906 - 1.0).abs() < PUBLISHED, "{rms}");
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
fn a_key_that_varies_twice_is_refused() {
    let varied = ["--set", "thrust_n=45000,46000", "--set", "thrust_n=47000"];
    let o = apsides(&[&["sweep", "lunar-perilune"][..], &varied].concat());
    assert_eq!(o.status.code(), Some(2), "{}", stderr(&o));
    assert!(stderr(&o).contains("the key varies twice"), "{}", stderr(&o));
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
    for file in [
        "reproduction.html",
        "reproduction.md",
        "reproduction.csv",
        "sheets.csv",
        "lunar-direct.toml",
        "table-2.svg",
        "table-3.svg",
    ] {
        assert!(text.contains(file) && dir.path().join(file).is_file(), "{file}");
    }
    assert!(stdout(&apsides(&["reproduce"])).starts_with("lunar-landing  "));
    let refused = apsides(&["reproduce", "lunar"]);
    assert_eq!(refused.status.code(), Some(2));
    assert_eq!(
        stderr(&refused),
        "apsides: reproduce: `name` is \"lunar\", allowed is \"lunar-landing\" or \"geo-injection\" or \"capsule-reentry\" or \"chang-e-3\" or \"moving-mass\" or \"powered-descent\"\n"
    );
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
    // The digest stands in the first line.
    let state: serde_json::Value = serde_json::from_str(text.split_once('\n').unwrap().1).unwrap();
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
    let tuned = path(&dir.path().join("tuned"));
    let few = ["--directions", "0", "--evaluations", "5", "--out", &tuned];
    let o = apsides(&[&["tune", "moving-mass-cross", "--set", "rate_limit_m_s=0.2"], &few[..]].concat());
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert!(
        stdout(&o).contains("1 of 1 held") && stdout(&o).contains("--set pid.attack_p="),
        "{}",
        stdout(&o)
    );
    let file = path(&dir.path().join("tuned/mission.toml"));
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
