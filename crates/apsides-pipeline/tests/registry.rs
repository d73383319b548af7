//! Reading missions of a kind that is declared here: keys, named data, former names, places of mistakes.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;

use apsides_pipeline::key::{Key, Range};
use apsides_pipeline::named_data::NamedData;
use apsides_pipeline::simulation::{SimulationSummary, Watch};
use apsides_pipeline::values::Values;
use apsides_pipeline::{Error, Kind, Mission, Offers, Outcome, Pipeline, Registry, Simulated};

/// Discretisation: the tolerances of the integration and what its steps add up to.
const INTEGRATION: f64 = 1e-12;

const KEYS: &[&[Key]] = &[&[
    Key::text("vehicle", "light", "the name of a vehicle", "what is dropped"),
    Key::named("vehicle", "mass_kg", Range::POSITIVE, "mass"),
    Key::number("height_m", 100.0, Range::POSITIVE, "height of the drop"),
    Key::number("gravity_m_s2", 9.81, Range::POSITIVE, "acceleration"),
    Key::optional("floor_m", Range::from(0.0), "height of the floor; open: the ground"),
]];

const VEHICLES: NamedData = NamedData {
    key: "vehicle",
    keys: &[Key::number("mass_kg", 0.0, Range::POSITIVE, "mass")],
    files: &[("light", "mass_kg = 2.0\nsource = \"a shelf\""), ("old", "weight_kg = 2.0")],
};

/// A drop without drag.
#[derive(Debug, PartialEq)]
struct Drop {
    /// kg.
    mass: f64,
    /// m.
    height: f64,
    /// m/s2.
    gravity: f64,
    /// m.
    floor: Option<f64>,
}

impl Mission for Drop {
    fn kind() -> Kind {
        let offers = Offers { simulated_only: true, ..Offers::default() };
        Kind::new::<Self>("drop", "A drop without drag", KEYS).offering(offers)
    }

    fn read(v: &Values) -> Result<Self, Error> {
        let drop = Self {
            mass: v.number("mass_kg")?,
            height: v.number("height_m")?,
            gravity: v.number("gravity_m_s2")?,
            floor: v.optional("floor_m")?,
        };
        if drop.floor.is_some_and(|floor| floor >= drop.height) {
            return Err(v.conflict("`floor_m` must be below `height_m`"));
        }
        Ok(drop)
    }

    fn simulate(&self, _seed: u64, _plan: Option<&Outcome>, _watch: &Watch<'_>) -> Result<Simulated, Error> {
        let time = (2.0 * (self.height - self.floor.unwrap_or(0.0)) / self.gravity).sqrt();
        Ok(Simulated {
            summary: SimulationSummary {
                mission: String::new(),
                law: "none".into(),
                status: "completed".into(),
                ending: "on the floor".into(),
                end_time_s: time,
                results: BTreeMap::from([("energy_j".into(), self.mass * self.gravity * self.height)]),
                margins: Vec::new(),
                warnings: Vec::new(),
                time_ms: 0.0,
            },
            columns: vec![("time", "s")],
            rows: Vec::new(),
            curves: Vec::new(),
            root_locus: None,
            mission_file: String::new(),
        })
    }
}

fn registry() -> Registry {
    Registry::new()
        .with::<Drop>()
        .with_data(VEHICLES)
        .with_file("tower", "# From a tower.\nmission = \"drop\"\nheight_m = 20.0\n")
        .with_renamed(&[("altitude_m", "height_m"), ("weight_kg", "mass_kg")])
}

fn parse(text: &str, overrides: &[&str]) -> Result<Pipeline, Error> {
    let overrides: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
    registry().parse(text, "file `f`", &overrides)
}

fn message(text: &str, overrides: &[&str]) -> String {
    parse(text, overrides).unwrap_err().to_string()
}

const DROP: &str = "mission = \"drop\"\n";

#[test]
fn values_come_from_file_data_override_and_default() {
    let mission = registry().load("tower", &["gravity_m_s2=1.62".into()]).unwrap();
    let drop = mission.mission_as::<Drop>().unwrap();
    assert_eq!(*drop, Drop { mass: 2.0, height: 20.0, gravity: 1.62, floor: None });
    assert_eq!(registry().files().collect::<Vec<_>>(), [("tower", "From a tower.")]);
    // The mission's own number comes before that of the vehicle.
    let own = parse(DROP, &["mass_kg=3"]).unwrap();
    assert_eq!(own.mission_as::<Drop>().unwrap().mass, 3.0);
}

#[test]
fn what_is_written_is_read_again() {
    let mission = parse(DROP, &["floor_m=5"]).unwrap();
    let again = parse(&mission.to_file(), &[]).unwrap();
    assert_eq!(again, mission);
    // What is open stays so.
    let open = parse(DROP, &[]).unwrap();
    assert!(!open.to_file().contains("floor_m"));
    assert_eq!(parse(&open.to_file(), &[]).unwrap(), open);
}

#[test]
fn values_are_set_by_type() {
    let mut mission = parse(DROP, &[]).unwrap();
    mission.set("height_m", 45.0).unwrap();
    mission.set("floor_m", 5.0).unwrap();
    let flight = mission.simulate().unwrap();
    // sqrt(2 * 40 / 9.81)
    assert!((flight.summary.end_time_s - 2.855_686_245_854_129).abs() < INTEGRATION);
    assert_eq!((flight.summary.mission.as_str(), flight.mission_file), ("drop", mission.to_file()));
    // A refusal leaves the mission as it was.
    assert!(mission.set("floor_m", 50.0).unwrap_err().to_string().contains("must be below `height_m`"));
    assert!(mission.set("heigth_m", 5.0).unwrap_err().to_string().contains("the nearest is `height_m`"));
    assert!(mission.set("height_m", "high").is_err());
    assert_eq!(mission.mission_as::<Drop>().unwrap().floor, Some(5.0));
}

#[test]
fn mistakes_have_their_places() {
    assert_eq!(
        message(&format!("{DROP}height_m = 20.0\nfloor_m = 30.0\n"), &[]),
        "file `f`, line 3 (mission `drop`): `floor_m` must be below `height_m`"
    );
    assert_eq!(
        message(DROP, &["altitude_m=20"]),
        "--set altitude_m=20: mission `drop` has no key `altitude_m`; it is now `height_m`"
    );
    assert_eq!(
        message(DROP, &["vehicle=old"]),
        "vehicle `old`, line 1: a vehicle has no key `weight_kg`; it is now `mass_kg`"
    );
    assert!(message(DROP, &["vehicle=heavy"]).contains("one of `light`, `old`, or a path"));
    assert!(message(DROP, &["height_m=-1"]).starts_with("--set height_m=-1: `height_m` is -1"));
    assert!(message("height_m = 1", &[]).contains("`mission` is missing, allowed is one of `drop`"));
    assert!(message("mission = \"jump\"", &[]).contains("no mission is named `jump`; known: `drop`"));
    assert!(message("mission = 3", &[]).contains("line 1: `mission` is 3"));
    assert!(message("mission =", &[]).starts_with("file `f`, line 1"));
}

#[test]
fn a_mission_that_is_simulated_is_not_solved() {
    let error = parse(DROP, &[]).unwrap().solve(None, &mut ()).err().unwrap().to_string();
    assert_eq!(error, "mission `drop`: it is simulated under its law, not optimised: use `apsides simulate`");
    let error = message(DROP, &["method=radau"]);
    assert!(error.contains("has no key `method`"), "{error}");
}
