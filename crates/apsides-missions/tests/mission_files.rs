//! Mission files: what is read, what is refused, and how it is said.
#![allow(clippy::unwrap_used)]

use apsides_missions::registry;
use apsides_pipeline::key::Value;
use apsides_pipeline::{Error, Pipeline, sweep};

const PERILUNE: &str = "mission = \"lunar-perilune\"\n";

fn refused(text: &str) -> String {
    match registry().parse(text, "file `x.toml`", &[]) {
        Err(e) => e.to_string(),
        Ok(m) => panic!("accepted: {m:?}"),
    }
}

#[test]
fn every_mission_of_the_program_is_well_posed() {
    for (name, _) in registry().files() {
        let mission = registry().load(name, &[]).unwrap();
        if mission.is_simulated() {
            mission.mission().check_simulation().unwrap();
        } else {
            mission.pose().unwrap();
        }
        // Written out and read again it is the same mission.
        assert_eq!(registry().parse(&mission.to_file(), "written", &[]).unwrap(), mission);
    }
}

#[test]
fn what_is_said_of_a_run_stays_when_a_value_changes() {
    let mission = registry().load("lunar-perilune", &[]).unwrap();
    let mission = mission.with_threads(3).with_seed(7).with_tolerance_from(1e-5);
    let mut changed = mission.with("thrust_n", 500.0).unwrap();
    changed.set("method", "two-layer").unwrap_err();
    changed.set("isp_s", 311.0).unwrap();
    let settings = &changed.methods().radau.settings;
    assert_eq!((settings.threads, settings.tolerance), (3, 1e-5));
    assert_eq!((changed.seed(), changed.methods().search_settings().seed), (7, 7));
    // A file that asks for less keeps it.
    changed.set("radau.tolerance", 1e-3).unwrap();
    assert_eq!(changed.methods().radau.settings.tolerance, 1e-3);
}

#[test]
fn mistakes_name_line_key_and_remedy() {
    let line2 = |text: &str| refused(&format!("{PERILUNE}{text}\n"));
    let cases = [
        (
            "perilune_altitude_kn = 15.0",
            "file `x.toml`, line 2: mission `lunar-perilune` has no key `perilune_altitude_kn`; in its unit it is `perilune_altitude_km`",
        ),
        (
            "perilune_altitude = 15.0",
            "file `x.toml`, line 2: mission `lunar-perilune` has no key `perilune_altitude`; its unit is missing: `perilune_altitude_km`",
        ),
        (
            "thurst_n = 440.0",
            "file `x.toml`, line 2: mission `lunar-perilune` has no key `thurst_n`; the nearest is `thrust_n`",
        ),
        ("thrust_n = \"high\"", "file `x.toml`, line 2: `thrust_n` is \"high\", allowed is a number above 0"),
        (
            "initial_mass_kg = -300.0",
            "file `x.toml`, line 2: `initial_mass_kg` is -300, allowed is a number above 0",
        ),
        ("isp_s = 0", "file `x.toml`, line 2: `isp_s` is 0, allowed is a number above 0"),
        ("isp_s = nan", "file `x.toml`, line 2: `isp_s` is NaN, allowed is a number above 0"),
        ("isp_s = inf", "file `x.toml`, line 2: `isp_s` is inf, allowed is a number above 0"),
        ("isp_s = [310.0]", "file `x.toml`, line 2: `isp_s` is a list, allowed is a number above 0"),
        (
            "perilune_altitude_km = -3.0",
            "file `x.toml`, line 2: `perilune_altitude_km` is -3, allowed is a number at least 0",
        ),
        (
            "\n[radau]\npoints = 4.5",
            "file `x.toml`, line 4: `radau.points` is 4.5, allowed is a whole number from 1 to 60",
        ),
        (
            "[radau]\npionts = 4",
            "file `x.toml`, line 3: mission `lunar-perilune` has no key `radau.pionts`; the nearest is `radau.points`",
        ),
        (
            "max_pitch_rate_deg_s = 0.0",
            "file `x.toml`, line 2: `max_pitch_rate_deg_s` is 0, allowed is a number above 0, or inf",
        ),
        (
            "max_pitch_rate_deg_s = -2.0",
            "file `x.toml`, line 2: `max_pitch_rate_deg_s` is -2, allowed is a number above 0, or inf",
        ),
        (
            "max_pitch_rate_deg_s = -inf",
            "file `x.toml`, line 2: `max_pitch_rate_deg_s` is -inf, allowed is a number above 0, or inf",
        ),
        (
            "throttle = \"half\"",
            "file `x.toml`, line 2: `throttle` is \"half\", allowed is \"full\" or \"coast\" or \"free\"",
        ),
        (
            "touchdown_thrust = 90",
            "file `x.toml`, line 2: `touchdown_thrust` is 90, allowed is \"free\" or \"vertical\"",
        ),
        (
            "method = \"newton\"",
            "file `x.toml`, line 2: `method` is \"newton\", allowed is \"radau\" or \"flatness\" or \"multiple-shooting\" or \"indirect\" or \"piecewise\" or \"two-layer\" or \"successive-convexification\"",
        ),
        (
            "[flatness]\nplacement = \"even\"",
            "file `x.toml`, line 3: `flatness.placement` is \"even\", allowed is \"gauss-per-segment\" or \"uniform\" or \"gauss\" or \"lobatto\" or \"chebyshev\" or \"greville\"",
        ),
        (
            "[flatness]\npoints = 0",
            "file `x.toml`, line 3: `flatness.points` is 0, allowed is a whole number from 1 to 1000",
        ),
        (
            "[flatness]\nmax_refinements = true",
            "file `x.toml`, line 3: `flatness.max_refinements` is true, allowed is a whole number from 0 to 999",
        ),
    ];
    for (text, message) in cases {
        assert_eq!(line2(text), message);
    }
}

#[test]
fn what_no_flight_can_mend_is_a_conflict() {
    let says = |text: &str, part: &str| {
        let message = refused(&format!("{PERILUNE}{text}\n"));
        assert!(message.contains(part), "{message}");
    };
    says("thrust_n = 90.0", "cannot stop the vehicle: even empty (`dry_mass_kg` = 60) it weighs 97.5 N");
    says("initial_mass_kg = 50.0", "must be below the mass at ignition, 50.000 kg");
    says("dry_mass_kg = 250.0", "1634.0 m/s must be braked");
    says("perilune_altitude_km = 120.0", "must be below the parking orbit");
    says("touchdown_thrust = \"vertical\"", "`max_pitch_rate_deg_s` is inf");
    let transfer =
        |floor: &str| refused(&format!("mission = \"lunar-transfer\"\nperilune_floor_km = {floor}\n"));
    assert!(transfer("100.0").contains("`perilune_floor_km` is 100, it must be below the parking orbit"));
    assert_eq!(
        transfer("-1.0"),
        "file `x.toml`, line 2: `perilune_floor_km` is -1, allowed is a number at least 0"
    );
    let direct = refused("mission = \"lunar-direct\"\nthrottle = \"coast\"\n");
    assert!(direct.contains("allowed is \"full\" or \"free\""), "{direct}");
    let gate = "mission = \"lunar-two-phase\"\ngate_altitude_km = 20.0\n";
    assert!(refused(gate).contains("must be below the perilune"));
}

/// The refusal of a model stands where the first of its keys does.
#[test]
fn refusals_of_models_have_their_places() {
    assert_eq!(
        refused(&format!("{PERILUNE}thrust_n = 440.0\nisp_s = 1e308\n")),
        "file `x.toml`, line 3 (mission `lunar-perilune`): `isp_s`, `standard_gravity_m_s2`, `thrust_n`: \
         exhaust velocity is inf m/s, allowed is a positive finite number"
    );
    let body = refused("mission = \"chang-e-3-braking\"\n\ngravitational_parameter_km3_s2 = 1e300\n");
    assert!(
        body.starts_with(
            "file `x.toml`, line 3 (mission `chang-e-3-braking`): `gravitational_parameter_km3_s2`, "
        ),
        "{body}"
    );
    let stage = refused("mission = \"geo-injection\"\nisp_s = 1e308\n");
    assert!(
        stage.starts_with("file `x.toml`, line 2 (mission `geo-injection`): `isp_s`, `thrust_n`: "),
        "{stage}"
    );
    let error = registry().load("lunar-perilune", &["isp_s=1e308".into()]).unwrap_err();
    assert!(error.to_string().starts_with("--set isp_s=1e308 (mission `lunar-perilune`): "), "{error}");
    // What the model said is kept.
    assert!(std::error::Error::source(&error).unwrap().is::<apsides_dynamics::DynamicsError>());
}

/// Settings that are refused for what they make of the problem, before any iteration.
#[test]
fn splines_that_cannot_land_are_refused() {
    let says = |overrides: &[&str], message: &str| {
        let overrides: Vec<String> =
            ["method=flatness"].iter().chain(overrides).map(|o| (*o).to_owned()).collect();
        match registry().load("lunar-perilune", &overrides).and_then(|m| m.solve(None, &mut ())) {
            Err(e) => assert_eq!(e.to_string(), message),
            Ok(outcome) => panic!("solved: {:?}", outcome.summary),
        }
    };
    says(
        &["flatness.order=1"],
        "flatness: phase `braking`: flatness setting `order` is 1, allowed is 3 to 32 (the flat map takes derivative 2, so that the order must be above it)",
    );
    says(
        &["flatness.placement=uniform", "flatness.points=200"],
        "flatness: phase `braking`: 200 points make 207 equality constraints for 19 variables of the whole problem; allowed are 7 to 12 points",
    );
    says(
        &["throttle=free"],
        "mission `lunar-perilune`: `method` is \"flatness\", which flies full thrust in a direction that may jump; choose `throttle` = \"full\" and `max_pitch_rate_deg_s` = inf, or `method` = \"radau\"",
    );
}

#[test]
fn files_that_are_no_missions() {
    assert_eq!(
        refused(""),
        "file `x.toml`: `mission` is missing, allowed is one of `lunar-direct`, `lunar-perilune`, `lunar-two-phase`, `lunar-transfer`, `geo-injection`, `capsule-reentry`, `chang-e-3-braking`, `chang-e-3`, `moving-mass-cross`, `moving-mass-radial`; other files begin with `kind = \"problem\"`"
    );
    assert!(refused("mission = 3").contains("line 1: `mission` is 3"));
    assert!(refused("mission = \"mars\"").contains("no mission is named `mars`; known: `lunar-direct`"));
    assert!(refused("mission = \"lunar-dir").contains("line 1"), "truncated");
    assert!(refused("mission = \"lunar-direct\"\nthrust_n = 4 4").contains("line 2"));
    let duplicate = refused("mission = \"lunar-direct\"\nthrust_n = 440\nthrust_n = 450");
    assert!(duplicate.contains("line 3"), "{duplicate}");

    let dir = tempfile::tempdir().unwrap();
    let load =
        |path: &std::path::Path| registry().load(&path.to_string_lossy(), &[]).unwrap_err().to_string();
    assert!(load(dir.path()).contains("not a file"));
    assert!(load(&dir.path().join("absent.toml")).contains("no such file, and no mission of this name"));
    let big = dir.path().join("big.toml");
    std::fs::File::create(&big).unwrap().set_len(100 << 20).unwrap();
    assert!(load(&big).contains("has 104857600 bytes; a mission file has at most 1048576"));
    let binary = dir.path().join("binary.toml");
    std::fs::write(&binary, [0xff, 0xfe, 0x00]).unwrap();
    assert!(load(&binary).contains("is not UTF-8 text"));
}

#[test]
fn overrides_replace_values_and_are_checked_alike() {
    let load = |set: &str| registry().load("lunar-perilune", &[set.to_owned()]);
    assert_ne!(load("thrust_n=450").unwrap(), load("thrust_n=440").unwrap());
    assert!(load("method=radau").is_ok(), "a word needs no quotes");
    assert!(matches!(load("thrust_n"), Err(Error::Syntax { .. })));
    assert!(matches!(load("thrust=1"), Err(Error::UnknownKey { .. })));
    let message = load("thrust_n=-1").unwrap_err().to_string();
    assert_eq!(message, "--set thrust_n=-1: `thrust_n` is -1, allowed is a number above 0");
}

#[test]
fn sweeps_run_through_neighbours_and_refuse_before_solving() {
    let axes =
        [sweep::Axis::parse("thrust_n=440,450").unwrap(), sweep::Axis::parse("isp_s=300,310,320").unwrap()];
    let cases = sweep::cases(&registry(), "lunar-perilune", &axes).unwrap();
    let order: Vec<_> = cases.iter().map(|c| c.overrides.join(" ")).collect();
    assert_eq!(order[2], "thrust_n=440 isp_s=320");
    assert_eq!(order[3], "thrust_n=450 isp_s=320");
    assert_eq!(order.len(), 6);
    assert!(sweep::Axis::parse("thrust_n=440,,450").is_err());
    assert!(
        sweep::cases(&registry(), "lunar-perilune", &[sweep::Axis::parse("thrust_n=440,-1").unwrap()])
            .is_err()
    );
}

const GEO: &str = "mission = \"geo-injection\"\n";

/// Values of the mission file go before those of the vehicle; a path is looked up beside the mission file.
#[test]
fn vehicles_give_what_the_mission_file_does_not() {
    let mass = |m: &Pipeline| m.values().get("initial_mass_kg").unwrap().clone();
    let breeze = registry().parse(GEO, "x", &[]).unwrap();
    let fregat = registry().parse(&format!("{GEO}vehicle = \"fregat\"\n"), "x", &[]).unwrap();
    let heavier = registry().parse(&format!("{GEO}initial_mass_kg = 22170.0\n"), "x", &[]).unwrap();
    let over = registry().parse(GEO, "x", &["vehicle=fregat".into()]).unwrap();
    assert_eq!(mass(&breeze), Value::Number(22100.0));
    assert_eq!(mass(&fregat), Value::Number(7480.0));
    assert_eq!(mass(&heavier), Value::Number(22170.0));
    assert_eq!(over, fregat);
    let dir = tempfile::tempdir().unwrap();
    let stage = "thrust_n = 1e5\nisp_s = 407.9\npropellant_kg = 9000.0\ninitial_mass_kg = 12000.0\nremarks = \"a test\"\n";
    std::fs::write(dir.path().join("stage.toml"), stage).unwrap();
    let file = dir.path().join("mine.toml");
    std::fs::write(&file, format!("{GEO}vehicle = \"stage.toml\"\n")).unwrap();
    let own = registry().load(&file.to_string_lossy(), &[]).unwrap();
    assert_eq!(mass(&own), Value::Number(12000.0));
    assert_eq!(registry().parse(&own.to_file(), "written", &[]).unwrap(), own);
}

#[test]
fn mistakes_in_vehicles_name_their_place() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("stage.toml");
    let load = |text: &str| {
        std::fs::write(&path, text).unwrap();
        registry().parse(GEO, "x", &[format!("vehicle={}", path.display())]).unwrap_err().to_string()
    };
    let cases = [
        ("thrust_n = 1.0\n", "`initial_mass_kg` is missing, allowed is a number above 0"),
        ("thrust_n = 0\n", "line 1: `thrust_n` is 0, allowed is a number above 0"),
        ("\nthurst_n = 1.0\n", "line 2: a vehicle has no key `thurst_n`; the nearest is `thrust_n`"),
        ("thrust_n = 1.0\nsource = 5\n", "line 2: `source` is 5, allowed is text"),
    ];
    for (text, part) in cases {
        let message = load(text);
        assert!(message.contains(part), "{message}");
    }
    let message = registry().parse(GEO, "x", &["vehicle=saturn".into()]).unwrap_err().to_string();
    assert!(
        message.starts_with("--set vehicle=saturn: `vehicle` is \"saturn\", allowed is one of `block-dm`"),
        "{message}"
    );
}

/// Six upper stages inject; landers and capsules lack what an injection needs, and the message names it.
#[test]
fn every_upper_stage_of_the_program_flies() {
    let registry = registry();
    let load = |name: &str| registry.load("geo-3-burn", &[format!("vehicle={name}")]);
    let mut stages = 0;
    for name in registry.data("vehicle").unwrap().names() {
        match load(name) {
            Ok(mission) => {
                mission.pose().unwrap();
                stages += 1;
            }
            Err(e) => assert!(e.to_string().contains("is missing"), "{name}: {e}"),
        }
    }
    assert_eq!(stages, 6);
}

/// A key without a near neighbour is answered by a few that share its words, and by where all of them are listed.
#[test]
fn an_unknown_key_is_answered_in_short() {
    let refused = |name: &str, set: &str| registry().load(name, &[set.to_owned()]).unwrap_err().to_string();
    assert_eq!(
        refused("lunar-throttled", "mass=1"),
        "--set mass=1: mission `lunar-throttled` has no key `mass`; similar are `dry_mass_kg`, `initial_mass_kg`; \
         all keys: `apsides missions lunar-throttled`"
    );
    assert_eq!(
        refused("geo-3-burn", "foobarbaz=3"),
        "--set foobarbaz=3: mission `geo-3-burn` has no key `foobarbaz`; none is similar; all keys: `apsides missions geo-3-burn`"
    );
    assert_eq!(
        refused("geo-3-burn", "thurst_n=3"),
        "--set thurst_n=3: mission `geo-3-burn` has no key `thurst_n`; the nearest is `thrust_n`"
    );
    for (name, set, found) in [
        ("capsule-reentry", "heat_limit=2", "`heat_rate_limit_kw_m2`"),
        ("capsule-reentry", "heat_rate=2", "`heat_rate_limit_kw_m2`"),
        ("moving-mass-cross", "moving_masses=3", "`moving_mass_kg`"),
        ("chang-e-3", "gate=2", "`gate_altitude_km`"),
    ] {
        let error = refused(name, set);
        assert!(error.contains(found) && error.contains(&format!("mission `{name}` has no key")), "{error}");
        assert!(error.len() < 350, "{error}");
    }
    // A file is answered with its line, and with its own path.
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("my.toml").display().to_string();
    std::fs::write(&file, format!("{PERILUNE}mass = 300.0\n")).unwrap();
    let error = registry().load(&file, &[]).unwrap_err().to_string();
    assert!(
        error.starts_with(&format!("file `{file}`, line 2: mission `lunar-perilune` has no key `mass`; ")),
        "{error}"
    );
    assert!(error.ends_with(&format!("all keys: `apsides missions {file}`")), "{error}");
}

/// A flight of more steps than anyone waits for is refused before it begins.
#[test]
fn flights_of_too_many_steps_are_refused() {
    let load = |set: &[&str]| {
        registry().load("moving-mass-cross", &set.iter().map(|s| (*s).to_owned()).collect::<Vec<_>>())
    };
    let error = load(&["sample_time_s=1e-4", "max_flight_time_s=1e5"]).unwrap_err().to_string();
    assert_eq!(
        error,
        "--set sample_time_s=1e-4 (mission `moving-mass-cross`): `sample_time_s`, `steps_per_sample` and `max_flight_time_s` make \
         1.0e9 steps, at most 2e7 are flown: 1 every 0.0001 s for up to 100000 s; raise the first or lower the others"
    );
    assert!(load(&["steps_per_sample=1000"]).is_err());
    assert!(load(&["sample_time_s=1e-4"]).is_ok());
}

/// Sizes that no quantity has, and tolerances below rounding, are refused where they stand.
#[test]
fn absurd_numbers_are_refused_with_what_is_allowed() {
    let cases = [
        (
            "capsule-reentry",
            "heat_rate_limit_kw_m2=1e-300",
            "`heat_rate_limit_kw_m2` is 1e-300, allowed is a number above 0, or inf; in size 1e-30 to 1e30",
        ),
        (
            "moving-mass-cross",
            "pid.attack_p=1e300",
            "`pid.attack_p` is 1e300, allowed is a finite number; in size 0 or 1e-30 to 1e30",
        ),
        (
            "lunar-perilune",
            "radau.tolerance=1e-300",
            "`radau.tolerance` is 1e-300, allowed is a number at least 1e-14 and below 1",
        ),
        (
            "geo-3-burn",
            "thrust_n=1e15",
            "`thrust_n` is 1e15, it burns the propellant (`propellant_kg` = 19800) in 6.450e-8 s; this must be at least 1 s: reduce the thrust",
        ),
    ];
    for (mission, set, message) in cases {
        let found = registry().load(mission, &[set.to_owned()]).unwrap_err().to_string();
        assert!(found.ends_with(message), "{found}");
    }
}
