//! The lunar missions through the facade, against an independent solution.
//!
//! Reference numbers: indirect shooting (DOP853, 1e-13) of the same equations and constants, which an independent
//! collocation with 10 x 5 Radau points meets to 1e-9 s (one phase) and 2e-8 s (two phases). The throttled cases come from that
//! collocation in phases of no and full thrust (1e-7 kg; from the perilune confirmed by shooting), those with a limited pitch rate
//! from shooting with a turn at the largest rate (2e-7 kg). `references/lunar_landing.py` prints those of one and of two phases.
#![allow(clippy::unwrap_used)]

use apsides::pipeline::sweep;
use apsides::verify::Check;
use apsides::{Error, Outcome};
use apsides_tests::mission::{near, solve};
use apsides_tests::tolerance::{
    FINAL_MASS_KG, FLAT_TIME_S, FLIGHT_TIME_S, GATE_SPEED_M_S, OPEN_STRUCTURE_MASS_KG, POSITION_MISS_M,
    PRINTED_MASS_KG, SPEED_MISS_M_S, TWO_PHASE_TIME_S,
};

/// Discretisation: a coast at a flat optimum, s.
const COAST_TIME_S: f64 = 1e-2;
/// Solver: an attitude that is prescribed, deg.
const ATTITUDE_DEG: f64 = 1e-6;
/// Discretisation: a derivative against a difference of optima, relative.
const PRICE: f64 = 1e-3;
/// Another impulse than the best, m/s.
const STEP_M_S: f64 = 5.0;
/// Solver: the derivative of a key by itself.
const IDENTITY: f64 = 1e-6;

fn verified(outcome: &Outcome) {
    assert_eq!(outcome.summary.status, "optimal", "{:?}", outcome.explanation);
    assert!(outcome.explanation.is_none());
    let certificate = &outcome.summary.certificate;
    assert!(certificate.is_verified(), "{certificate:#?}");
    let misses: Vec<&Check> =
        certificate.checks.iter().filter(|c| c.name.starts_with("re-simulated")).collect();
    assert!(!misses.is_empty());
    for c in misses {
        let limit = match c.unit.as_str() {
            "m" => POSITION_MISS_M,
            "m/s" => SPEED_MISS_M_S,
            _ => c.limit,
        };
        assert!(c.value < limit, "{c:?}");
    }
}

fn single_phase(name: &str, overrides: &[&str], time: f64, mass: f64) {
    let outcome = solve(name, overrides);
    verified(&outcome);
    near(&outcome, "flight_time_s", time, FLIGHT_TIME_S);
    near(&outcome, "final_mass_kg", mass, FINAL_MASS_KG);
}

#[test]
fn direct_from_100_km() {
    single_phase("lunar-direct", &[], 1037.2005909330594, 149.8872563012772);
}

#[test]
fn from_perilune() {
    let cases = [
        ("50", 1012.291947788343, 152.37822362745808),
        ("25", 1001.3902427828095, 153.38599494117895),
        ("20", 999.3569839960355, 153.56519464235802),
        ("15", 997.3758488117479, 153.73649062922414),
        ("10", 995.4480792466301, 153.89970137117336),
        ("5", 993.5748653764407, 154.0546528425521),
    ];
    for (altitude, time, mass) in cases {
        single_phase("lunar-perilune", &[&format!("perilune_altitude_km={altitude}")], time, mass);
    }
}

/// The impulse that leaves the perilune as an unknown: its mass at touchdown is that of the same impulse given, and others nearby arrive with less.
/// A small impulse costs, a large one saves: none at all is an optimum, too, where the search stays that starts there.
#[test]
fn departure_by_the_best_impulse() {
    let result = |outcome: &Outcome, key: &str| outcome.summary.results[key];
    let given = |size: f64| {
        let impulse = format!("departure_impulse_m_s={size}");
        let outcome = solve("lunar-perilune", &[&impulse, "optimum_of=final-mass"]);
        verified(&outcome);
        result(&outcome, "final_mass_kg")
    };
    let free = solve("lunar-perilune", &["free_departure_impulse=true", "departure_impulse_m_s=300"]);
    verified(&free);
    let (impulse, mass) = (result(&free, "departure_impulse_m_s"), result(&free, "final_mass_kg"));
    assert!((given(impulse) - mass).abs() < FINAL_MASS_KG, "{} {mass}", given(impulse));
    for other in [0.0, 300.0, impulse - STEP_M_S, impulse + STEP_M_S] {
        assert!(given(other) < mass, "{other}: {} {mass}", given(other));
    }
    // The propellant of the impulse is that of the rocket equation.
    let before = result(&solve("lunar-perilune", &[]), "ignition_mass_kg");
    let after = before * (-impulse / (310.0 * 9.807)).exp();
    near(&free, "ignition_mass_kg", after, FINAL_MASS_KG);
    let none = solve("lunar-perilune", &["free_departure_impulse=true"]);
    verified(&none);
    near(&none, "departure_impulse_m_s", 0.0, SPEED_MISS_M_S);
    near(&none, "final_mass_kg", 153.73649062922414, FINAL_MASS_KG);
    assert!(given(STEP_M_S) < result(&none, "final_mass_kg"));
    let bounded =
        ["free_departure_impulse=true", "departure_impulse_m_s=600", "largest_departure_impulse_m_s=800"];
    near(&solve("lunar-perilune", &bounded), "departure_impulse_m_s", 800.0, SPEED_MISS_M_S);
}

#[test]
fn impulses_that_are_refused() {
    for (overrides, said) in [
        (
            ["departure_impulse_m_s=200", "largest_departure_impulse_m_s=100"],
            "must not be above `largest_departure_impulse_m_s`",
        ),
        (
            ["departure_impulse_m_s=200", "largest_departure_impulse_m_s=1800"],
            "below the speed at the perilune",
        ),
    ] {
        let stated: Vec<String> =
            overrides.iter().chain(&["free_departure_impulse=true"]).map(|o| (*o).to_owned()).collect();
        let refused = apsides::registry().load("lunar-perilune", &stated).unwrap_err().to_string();
        assert!(refused.contains(said), "{refused}");
    }
}

#[test]
fn two_phases() {
    let cases = [
        ("5", 1036.346337936439, -109.64263848880935, 148.096340501151),
        ("4", 1031.730449948327, -98.20080827163227, 148.7643921939081),
        ("3", 1026.5994207858944, -85.20648581660842, 149.5069996242394),
        ("2", 1020.6553452674615, -69.77251745004816, 150.36727823632705),
        ("1", 1013.1302850041927, -49.61513567030749, 151.45637079228223),
    ];
    for (gate, time, speed, mass) in cases {
        let outcome = solve("lunar-two-phase", &[&format!("gate_altitude_km={gate}")]);
        verified(&outcome);
        near(&outcome, "flight_time_s", time, TWO_PHASE_TIME_S);
        near(&outcome, "gate_radial_velocity_m_s", speed, GATE_SPEED_M_S);
        assert_eq!(outcome.summary.warnings, [""; 0], "nothing that a reader could change");
        near(&outcome, "final_mass_kg", mass, FINAL_MASS_KG);
    }
}

/// Deorbit burn, coast and braking in one optimisation, perilune of the coast at least the floor.
#[test]
fn whole_transfer() {
    let cases = [
        ("0", 154.24380971887453, [15.636360803261189, 991.4627231118769]),
        ("5", 154.08568958613373, [14.831247527087754, 993.3603638515469]),
        ("10", 153.92158357639818, [14.028659158313049, 995.2968389648644]),
        ("15", 153.75130678180147, [13.22858321146876, 997.2734385540116]),
        ("20", 153.5747078527068, [12.431007287585958, 999.2912207648216]),
        ("25", 153.39167067311791, [11.635919072854119, 1001.3510002119514]),
        ("50", 152.37827466680312, [7.697368519833297, 1012.2915874387033]),
    ];
    for (floor, mass, [deorbit, braking]) in cases {
        let outcome = solve("lunar-transfer", &[&format!("perilune_floor_km={floor}")]);
        verified(&outcome);
        near(&outcome, "final_mass_kg", mass, FINAL_MASS_KG);
        near(&outcome, "deorbit_time_s", deorbit, FLIGHT_TIME_S);
        near(&outcome, "braking_time_s", braking, FLIGHT_TIME_S);
        // The floor is what limits the perilune.
        near(&outcome, "perilune_altitude_km", floor.parse().unwrap(), POSITION_MISS_M);
    }
}

/// From high orbits the perilune is passed at up to 2.3 km/s, three times the speed of the orbit itself. Ignition at the perilune, by an
/// impulse, gives a little less: the same braking from 15 km, with the coast as it is.
#[test]
fn whole_transfer_from_high_orbits() {
    for (orbit, mass) in [("2000", 135.796026), ("7000", 125.063011), ("10000", 123.353083)] {
        let orbit = format!("orbit_altitude_km={orbit}");
        let outcome = solve("lunar-transfer", &[&orbit]);
        verified(&outcome);
        near(&outcome, "final_mass_kg", mass, FINAL_MASS_KG);
        let from_perilune = solve("lunar-perilune", &[&orbit]);
        verified(&from_perilune);
        let gain = mass - from_perilune.summary.results["final_mass_kg"];
        assert!((0.0..1.5).contains(&gain), "{gain}");
        // By another method, which has no mesh and no collocation.
        let other = solve("lunar-transfer", &[&orbit, "method=multiple-shooting"]);
        near(&other, "final_mass_kg", mass, FINAL_MASS_KG);
    }
}

/// Down from a high gate the descent is faster than half of the speed in orbit.
#[test]
fn descent_from_a_high_gate() {
    let keys = ["orbit_altitude_km=1000", "perilune_altitude_km=300", "gate_altitude_km=200"];
    let outcome = solve("lunar-two-phase", &keys);
    verified(&outcome);
    near(&outcome, "gate_radial_velocity_m_s", -836.181128, GATE_SPEED_M_S);
    near(&outcome, "flight_time_s", 1319.817213, TWO_PHASE_TIME_S);
}

/// A coast past the perilune, then full thrust.
#[test]
fn least_propellant_from_perilune() {
    let cases = [
        ("25", 91.65049989714122, 153.3916706919393),
        ("20", 115.64175043151964, 153.5747078867874),
        ("15", 140.84027160015142, 153.75130683922862),
        ("10", 167.19730953213218, 153.92158366800817),
        ("5", 194.63291069715171, 154.08568972574346),
    ];
    for (altitude, coast, mass) in cases {
        let altitude = format!("perilune_altitude_km={altitude}");
        let outcome = solve("lunar-perilune", &["throttle=coast", &altitude]);
        verified(&outcome);
        near(&outcome, "final_mass_kg", mass, FINAL_MASS_KG);
        // Nearly flat: a second of coast is worth micrograms.
        near(&outcome, "coast_time_s", coast, COAST_TIME_S);
    }
}

/// The same before the vertical descent. From a gate at 5 km the reference falls freely for 0.34 s at the gate.
#[test]
fn least_propellant_through_a_gate() {
    let cases = [
        ("1", 151.5019601211269, FINAL_MASS_KG),
        ("2", 150.43816094560435, FINAL_MASS_KG),
        ("3", 149.6047481238522, FINAL_MASS_KG),
        ("4", 148.89134068436803, FINAL_MASS_KG),
        ("5", 148.25527302630155, OPEN_STRUCTURE_MASS_KG),
    ];
    for (gate, mass, tolerance) in cases {
        let gate = format!("gate_altitude_km={gate}");
        let outcome = solve("lunar-two-phase", &["throttle=coast", &gate]);
        verified(&outcome);
        near(&outcome, "final_mass_kg", mass, tolerance);
    }
}

/// Nothing said of when the engine burns: masses and ignitions are those of the structures above.
#[test]
fn free_throttle_finds_the_known_structures() {
    let cases = [
        ("lunar-perilune", "perilune_altitude_km=15", 153.75130683922862, 1),
        ("lunar-perilune", "perilune_altitude_km=5", 154.08569, 1),
        ("lunar-two-phase", "gate_altitude_km=2", 150.43816094560435, 1),
        // Free fall for 0.34 s at the gate.
        ("lunar-two-phase", "gate_altitude_km=5", 148.25527302630155, 2),
        // Two burns; between them the flight grazes the surface, where costates jump.
        ("lunar-direct", "orbit_altitude_km=100", 154.24380971887453, 2),
    ];
    for (name, case, mass, switches) in cases {
        let outcome = solve(name, &["throttle=free", case]);
        if name != "lunar-direct" {
            verified(&outcome);
        }
        near(&outcome, "final_mass_kg", mass, FINAL_MASS_KG);
        assert_eq!(outcome.summary.switches.len(), switches, "{:?}", outcome.summary.switches);
    }
}

/// With a limited pitch rate and a vertical touchdown as well; the reference is a collocation of the same, to a gram.
#[test]
fn free_throttle_with_a_vertical_touchdown() {
    for (rate, mass) in [("2", 153.327), ("5", 153.585)] {
        let rate = format!("max_pitch_rate_deg_s={rate}");
        let outcome = solve("lunar-perilune", &["throttle=free", "touchdown_thrust=vertical", &rate]);
        verified(&outcome);
        near(&outcome, "final_mass_kg", mass, OPEN_STRUCTURE_MASS_KG);
    }
}

/// All rows of the paper by flat outputs.
#[test]
fn flat_outputs_agree() {
    let flat = "method=flatness";
    let cases = [
        ("lunar-direct", "orbit_altitude_km=100", 1037.2005909330594),
        ("lunar-perilune", "perilune_altitude_km=50", 1012.291947788343),
        ("lunar-perilune", "perilune_altitude_km=5", 993.5748653764407),
        ("lunar-two-phase", "gate_altitude_km=1", 1013.130285),
        ("lunar-two-phase", "gate_altitude_km=5", 1036.346338),
    ];
    for (name, case, time) in cases {
        let outcome = solve(name, &[flat, case]);
        assert_eq!(outcome.summary.status, "optimal");
        near(&outcome, "flight_time_s", time, FLAT_TIME_S);
        // Costates from the adjoint equation along the splines.
        assert!(outcome.summary.certificate.is_verified());
    }
}

/// Thrust vertical at touchdown, turning by at most 2 or 5 deg/s.
#[test]
fn vertical_touchdown() {
    let cases = [
        ("100", "2", 1038.771709359164, 149.6598702973741),
        ("100", "5", 1037.8198309693685, 149.79763446566406),
        ("50", "2", 1014.585760915434, 152.04624292377375),
        ("50", "5", 1013.1930702069374, 152.24780530737024),
        ("15", "2", 1000.3633000957483, 153.30412054302496),
        ("15", "5", 998.5464352604558, 153.56707311723255),
        ("5", "2", 996.7934151805767, 153.58883615670234),
        ("5", "5", 994.8350279259158, 153.87227109358113),
    ];
    for (altitude, rate, time, mass) in cases {
        let rate = format!("max_pitch_rate_deg_s={rate}");
        let perilune = format!("perilune_altitude_km={altitude}");
        let (name, start) = match altitude {
            "100" => ("lunar-direct", "orbit_altitude_km=100"),
            _ => ("lunar-perilune", perilune.as_str()),
        };
        let outcome = solve(name, &["touchdown_thrust=vertical", &rate, start]);
        verified(&outcome);
        near(&outcome, "flight_time_s", time, FLIGHT_TIME_S);
        near(&outcome, "final_mass_kg", mass, FINAL_MASS_KG);
        near(&outcome, "final_thrust_angle_deg", 90.0, ATTITUDE_DEG);
    }
}

/// The mission file with other rates than its own.
#[test]
fn vertical_touchdown_at_other_rates() {
    for (rate, mass) in [("1", 152.83923145584438), ("2", 153.30412054302496), ("10", 153.65234311230958)] {
        let outcome = solve("lunar-vertical", &[&format!("max_pitch_rate_deg_s={rate}")]);
        verified(&outcome);
        near(&outcome, "final_mass_kg", mass, FINAL_MASS_KG);
    }
    // Without a reference: a fast turn costs little more than a jump, 153.7365 kg.
    let outcome = solve("lunar-vertical", &["max_pitch_rate_deg_s=30"]);
    verified(&outcome);
    let mass = outcome.summary.results["final_mass_kg"];
    assert!((153.65234311230958..153.73649062922414).contains(&mass), "{mass}");
}

/// With a coast before the braking; the reference is a collocation with free throttle, to a gram.
#[test]
fn vertical_touchdown_with_least_propellant() {
    for (rate, mass) in [("2", 153.327), ("5", 153.585)] {
        let rate = format!("max_pitch_rate_deg_s={rate}");
        let outcome = solve("lunar-perilune", &["throttle=coast", "touchdown_thrust=vertical", &rate]);
        verified(&outcome);
        near(&outcome, "final_mass_kg", mass, OPEN_STRUCTURE_MASS_KG);
        // The whole transfer with a floor at this perilune ends alike: an impulse is a short burn.
        let transfer = solve("lunar-transfer", &["touchdown_thrust=vertical", &rate]);
        verified(&transfer);
        near(&transfer, "final_mass_kg", outcome.summary.results["final_mass_kg"], FINAL_MASS_KG);
    }
}

/// Upright before the gate, where the vertical descent begins.
#[test]
fn turning_before_the_gate() {
    let cases = [("1", 151.2593), ("2", 150.1549), ("3", 149.2815), ("4", 148.5267), ("5", 147.8471)];
    for (gate, mass) in cases {
        let gate = format!("gate_altitude_km={gate}");
        let outcome = solve("lunar-two-phase", &["max_pitch_rate_deg_s=5", &gate]);
        verified(&outcome);
        near(&outcome, "final_mass_kg", mass, PRINTED_MASS_KG);
    }
}

/// A limit that nothing reaches changes nothing.
#[test]
fn a_pitch_rate_that_is_not_needed() {
    for rate in ["5", "30", "1000"] {
        let outcome = solve("lunar-perilune", &[&format!("max_pitch_rate_deg_s={rate}")]);
        verified(&outcome);
        near(&outcome, "flight_time_s", 997.3758488117479, FLIGHT_TIME_S);
    }
}

/// The price of the floor is the slope of the masses above.
#[test]
fn price_of_the_floor() {
    let mission = apsides::load("lunar-transfer", &[]).unwrap();
    let outcome = mission.solve(None, &mut ()).unwrap();
    let prices = mission.sensitivities(&outcome, &["perilune_floor_km"]).unwrap();
    let slope = (153.5747078527068 - 153.92158357639818) / 10.0;
    let price = prices[0].objective.unwrap();
    assert!((price / slope - 1.0).abs() < PRICE, "{price} {slope}");
    assert!((prices[0].results["perilune_altitude_km"] - 1.0).abs() < IDENTITY);
    // A limit on the pitch rate that is infinite has no price.
    assert!(mission.priced_keys().all(|k| k.path != "max_pitch_rate_deg_s"));
    // At zero it leaves the path out, with other states.
    let flat = apsides::load("chang-e-3-flat", &[]).unwrap();
    assert!(flat.priced_keys().all(|k| k.path != "adjustment_path_weight_kg_m"));
}

/// Neighbours with other phases are no start.
#[test]
fn sweeps_across_structures() {
    let axes = ["throttle=full,coast", "max_pitch_rate_deg_s=inf,5", "touchdown_thrust=free"];
    let axes: Vec<_> = axes.iter().map(|a| sweep::Axis::parse(a).unwrap()).collect();
    let cases = sweep::cases(&apsides::registry(), "lunar-perilune", &axes).unwrap();
    let mut masses = Vec::new();
    sweep::sweep(&cases, &mut (), |_, outcome| {
        let outcome = outcome.unwrap();
        verified(outcome);
        masses.push(outcome.summary.results["final_mass_kg"]);
        true
    })
    .unwrap();
    let expected = [153.73649062922414, 153.73649062922414, 153.75130683922862, 153.75130683922862];
    assert!(masses.iter().zip(expected).all(|(m, e)| (m - e).abs() < FINAL_MASS_KG), "{masses:?}");
    assert_eq!(masses.len(), 4);
}

/// The change that would do is known from the masses above: 153.7513 kg are left, 154 kg with the floor at 7.634 km.
#[test]
fn too_much_dry_mass_is_explained_by_the_floor() {
    let outcome = solve("lunar-transfer", &["dry_mass_kg=154"]);
    assert_ne!(outcome.summary.status, "optimal");
    let explanation = outcome.explanation.unwrap();
    for part in [
        "phase `braking`: mass at least 154 kg: short by",
        "mass is lowered from 154 to 153.751 kg",
        "clearance of the coast: perilune altitude is lowered from 15 to 7.633",
    ] {
        assert!(explanation.contains(part), "{explanation}");
    }
    let lower = solve("lunar-transfer", &["perilune_floor_km=7.634"]);
    near(&lower, "final_mass_kg", 154.0, PRINTED_MASS_KG);
}

#[test]
fn too_little_thrust_is_explained() {
    let outcome = solve("lunar-direct", &["thrust_n=100", "dry_mass_kg=60"]);
    assert_ne!(outcome.summary.status, "optimal");
    let explanation = outcome.explanation.unwrap();
    for part in [
        "phase `braking`: mass is lowered from 60 to 45.",
        "(`dry_mass_kg`)",
        "`thrust_n` has to be about 132:",
    ] {
        assert!(explanation.contains(part), "{explanation}");
    }
    assert!(!outcome.summary.certificate.is_verified());
}

#[test]
fn contradictions_are_refused_with_numbers() {
    let cases: [(&[&str], &str); 4] = [
        (&["thrust_n=50"], "thrust_n"),
        (&["dry_mass_kg=300"], "dry_mass_kg"),
        (&["dry_mass_kg=200", "thrust_n=2000"], "propellant"),
        (&["perilune_altitude_km=100"], "perilune_altitude_km"),
    ];
    for (overrides, word) in cases {
        let overrides: Vec<String> = overrides.iter().map(|o| (*o).into()).collect();
        match apsides::load("lunar-perilune", &overrides) {
            Err(e @ Error::Conflict { .. }) => assert!(e.to_string().contains(word), "{e}"),
            other => panic!("{overrides:?}: {other:?}"),
        }
    }
}

#[test]
fn bad_input_is_refused_with_place_and_key() {
    let load = |o: &str| apsides::load("lunar-perilune", &[o.into()]).unwrap_err().to_string();
    for o in
        ["thrust_n=nan", "thrust_n=-1", "thrust_n=0", "thrust_n=inf", "thrust_n=\"strong\"", "radau.points=0"]
    {
        let message = load(o);
        assert!(message.contains(o.split('=').next().unwrap()), "{message}");
    }
    assert!(load("perilune_altitude=15").contains("perilune_altitude_km"));
    assert!(load("thrust_n").contains("key=value"));
    let message = apsides::load("lunar-perilun", &[]).unwrap_err().to_string();
    assert!(message.contains("lunar-perilune"), "{message}");
}
