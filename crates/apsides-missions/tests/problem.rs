//! A problem of its own file as a mission: keys, prices, draws, the file that is written.
#![allow(clippy::unwrap_used)]

use apsides_missions::problem::{OwnProblem, STARTER};
use apsides_missions::registry;
use apsides_pipeline::draws::Draws;
use apsides_pipeline::key::Value;
use apsides_pipeline::{Error, Pipeline};

fn load(overrides: &[&str]) -> Result<Pipeline, Error> {
    registry().parse(STARTER, "starter", &overrides.iter().map(ToString::to_string).collect::<Vec<_>>())
}

#[test]
fn constants_are_keys_with_units() {
    let mission = load(&["constants.thrust=50"]).unwrap();
    assert_eq!((mission.name(), mission.is_simulated()), ("soft-landing", false));
    let thrust = mission.keys().find(|k| k.path == "constants.thrust").unwrap();
    assert_eq!((&*thrust.unit(), thrust.default()), ("kN", Some(Value::Number(45.0))));
    assert_eq!(mission.values().number("constants.thrust").unwrap(), 50.0);
    let ocp = &mission.mission_as::<OwnProblem>().unwrap().posed().ocp;
    assert_eq!(ocp.phases[0].states[0].variable.bounds.upper, 5000.0);
    assert_eq!(mission.priced_keys().count(), 4);
    // The file that is written is the mission again.
    let written = mission.to_file();
    assert!(registry().parse(&written, "written", &[]).unwrap() == mission, "{written}");
    assert!(load(&[]).unwrap() != mission);
    for (wrong, part) in [
        ("constants.thrst=3", "the nearest is `constants.thrust`"),
        ("constants.thrust=much", "a finite number"),
        ("radau.points=0", "a whole number from 1"),
        ("method=flatness", "no flat outputs"),
    ] {
        let refused = load(&[wrong]).unwrap_err().to_string();
        assert!(refused.contains(part), "{refused}");
    }
    let refused = registry().parse("kind = \"problm\"\n", "f", &[]).unwrap_err().to_string();
    assert!(refused.contains("`kind` is \"problm\", allowed is `problem`"), "{refused}");
}

#[test]
fn draws_follow_the_prices_and_no_thread() {
    // Discretisation class: the mesh of a neighbour, and the curvature over a hundredth of a kilonewton.
    const NEIGHBOUR: f64 = 5e-3;
    let mission = load(&[]).unwrap();
    let plan = mission.solve(None, &mut ()).unwrap();
    let price = mission.sensitivities(&plan, &["constants.thrust"]).unwrap()[0].objective.unwrap();
    let draws =
        |threads| Draws { samples: 6, seed: 4, threads, sigmas: vec![("constants.thrust".into(), 0.01)] };
    let (samples, statistics) = draws(1).run(&mission, &plan, Vec::new(), |_| true).unwrap();
    assert_eq!((statistics.samples, statistics.failed), (6, 0));
    let column = Draws::columns(&plan).iter().position(|c| *c == "objective_m_kg").unwrap();
    for s in &samples {
        let change = s.results[column] - plan.trajectory.objective;
        assert!((change / (price * s.deviations[0]) - 1.0).abs() < NEIGHBOUR, "{change} {s:?}");
    }
    assert_eq!(draws(3).run(&mission, &plan, Vec::new(), |_| true).unwrap().0, samples);
    let mut wrong = draws(1);
    wrong.sigmas[0].0 = "constants.thrst".into();
    assert!(wrong.check(&mission).unwrap_err().to_string().contains("the nearest is `constants.thrust`"));
    wrong.sigmas[0] = ("method".into(), 1.0);
    assert!(wrong.check(&mission).unwrap_err().to_string().contains("allowed is a number"));
    wrong.sigmas[0] = ("constants.isp".into(), -1.0);
    assert!(wrong.check(&mission).unwrap_err().to_string().contains("finite and not negative"));
}
