//! The injections into geostationary orbit through the facade, against independent solutions of the same equations and constants.
//!
//! Reference numbers: indirect shooting in modified equinoctial elements (CasADi, joint Newton on all burns, residual below 1e-12)
//! and Radau collocation with Ipopt, which agree to 1.3e-8 kg; a Cartesian DOP853 re-integration ends within 3e-7 km. Cases with an apogee
//! cap, oblateness or a limited flight time come from the collocation alone. `references/geo_injection.py` prints two to four burns.
#![allow(clippy::unwrap_used)]

use apsides::Outcome;
use apsides::pipeline::sweep;
use apsides::verify::{CheckKind, Verdict};
use apsides_tests::mission::{self, load, near, solve};
use apsides_tests::tolerance::{BURN_TIME_S, COLLOCATION_PROPELLANT_KG, IGNITION_TIME_S, PROPELLANT_KG};

/// Discretisation: the re-simulated flight misses the velocity of the target by less, m/s.
const MISS_M_S: f64 = 1e-3;
/// Solver: the first orbit, km.
const INNER_ORBIT_KM: f64 = 1e-4;
/// Solver: later orbits, whose burns move by seconds for micrograms, km.
const ORBIT_KM: f64 = 1e-3;
/// Solver: the eccentricity of an orbit.
const ECCENTRICITY: f64 = 1e-8;
/// Solver: flight times, h.
const FLIGHT_TIME_H: f64 = 1e-5;
/// Round-off, and the digits of constants: the closed form of two impulses, kg.
const IMPULSIVE_KG: f64 = 1e-6;
/// Solver: a cap on the apogees is kept to it, km.
const CAP_KM: f64 = 1e-3;
/// Solver: the eccentricity of the target.
const TARGET_ECCENTRICITY: f64 = 1e-9;
/// Solver: altitudes of the target, km.
const TARGET_KM: f64 = 1e-5;
/// Discretisation: a derivative against a difference of optima, relative.
const PRICE: f64 = 1e-4;
/// Discretisation: the same over a wide step, relative.
const PRICE_OF_TIME: f64 = 1e-2;

/// Verified, with the target orbit met in Cartesian coordinates to 1 m and 1 mm/s.
fn verified(outcome: &Outcome) {
    mission::verified(outcome);
    let certificate = &outcome.summary.certificate;
    for (start, limit) in [("position off the target", 1.0), ("velocity off the target", MISS_M_S)] {
        let check = certificate.checks.iter().find(|c| c.name.starts_with(start)).unwrap();
        assert!(check.value < limit && check.kind == CheckKind::Feasibility, "{check:?}");
    }
}

/// Verified with this propellant.
fn injected(name: &str, overrides: &[&str], propellant: f64, tolerance: f64) -> Outcome {
    let outcome = solve(name, overrides);
    verified(&outcome);
    near(&outcome, "propellant_kg", propellant, tolerance);
    outcome
}

fn has_check(outcome: &Outcome, name: &str) -> bool {
    outcome.summary.certificate.checks.iter().any(|c| c.name == name)
}

const ON_BURNS: &str = "switching function above zero on a burn";
const ON_COASTS: &str = "switching function below zero on a coast";

#[test]
fn equatorial_with_two_to_six_burns() {
    for (mass, name, propellant) in mission::EQUATORIAL_INJECTIONS {
        let outcome = injected(name, &[&format!("initial_mass_kg={mass}")], propellant, PROPELLANT_KG);
        assert!(has_check(&outcome, ON_BURNS) && has_check(&outcome, ON_COASTS));
    }
}

/// Burn times, coasts and orbits of the flight with three burns.
#[test]
fn burns_and_orbits() {
    let outcome = solve("geo-3-burn", &[]);
    let times = [
        ("burn_1_time_s", 1018.6038774667118),
        ("burn_2_time_s", 915.4690138049592),
        ("burn_3_time_s", 601.0529072090192),
    ];
    for (key, expected) in times {
        near(&outcome, key, expected, BURN_TIME_S);
    }
    near(&outcome, "burn_2_ignition_time_s", 1018.6038774667118 + 7976.974097046343, IGNITION_TIME_S);
    near(&outcome, "orbit_1_semi_major_axis_km", 9313.523981693497, INNER_ORBIT_KM);
    near(&outcome, "orbit_1_eccentricity", 0.28402627257330565, ECCENTRICITY);
    near(&outcome, "orbit_2_semi_major_axis_km", 24460.810412255388, ORBIT_KM);
    near(&outcome, "orbit_2_perigee_altitude_km", 6759.929047966637 - 6378.137, ORBIT_KM);
    near(&outcome, "orbit_2_apogee_altitude_km", 42161.69177654414 - 6378.137, ORBIT_KM);
    near(&outcome, "flight_time_h", 28797.00349912672 / 3600.0, FLIGHT_TIME_H);
    near(&outcome, "impulsive_propellant_kg", 15490.569408421608, IMPULSIVE_KG);
    // The whole flight: burns and coasts, though only the burns were solved.
    assert_eq!(outcome.trajectory.phases.len(), 5);
    assert_eq!(outcome.solved().1.phases.len(), 3);
}

#[test]
fn with_plane_change() {
    let cases = [
        ("geo-2-burn", "28.5", 16429.371201815775),
        ("geo-3-burn", "28.5", 16220.229740197341),
        ("geo-4-burn", "28.5", 16174.897616916338),
        ("geo-5-burn", "28.5", 16158.52181263645),
        ("geo-2-burn", "51.6", 17407.15532360812),
        ("geo-3-burn", "51.6", 17192.34952303349),
        ("geo-3-burn", "5", 15589.276317321352),
    ];
    for (name, inclination, propellant) in cases {
        injected(name, &[&format!("inclination_deg={inclination}")], propellant, PROPELLANT_KG);
    }
}

/// The six stages with two to four burns.
#[test]
fn all_stages() {
    let cases = [
        ("block-dm", [11602.808897469686, 11596.456570315775, 11595.277249610974]),
        ("fregat", [5295.10408183267, 5285.965197927631, 5284.239946576871]),
        ("fregat-sb", [9471.089845568382, 9422.6555178025, 9413.042488421137]),
        ("centaur-d", [13498.619767731914, 13495.377487193275, 13494.777222058425]),
        ("yastreb", [12893.99639520704, 12821.864469004835, 12807.667209512561]),
    ];
    for (vehicle, propellants) in cases {
        for (burns, propellant) in (2..).zip(propellants) {
            let name = format!("geo-{burns}-burn");
            injected(&name, &[&format!("vehicle={vehicle}")], propellant, PROPELLANT_KG);
        }
    }
}

/// Thrust along the velocity, all times optimised again: the penalties of 14.479, 2.521 and 1.050 kg.
#[test]
fn thrust_along_the_velocity() {
    let cases = [
        ("geo-2-burn", 15764.7267480627, 14.479412004593541),
        ("geo-3-burn", 15568.193503036879, 2.521100365440361),
        ("geo-4-burn", 15525.93621681205, 1.050068728516635),
    ];
    for (name, propellant, penalty) in cases {
        let aligned = injected(name, &["steering=velocity"], propellant, PROPELLANT_KG);
        let best = solve(name, &[]);
        let found = aligned.summary.results["propellant_kg"] - best.summary.results["propellant_kg"];
        assert!((found - penalty).abs() < PROPELLANT_KG, "{found}");
        assert!(!has_check(&aligned, ON_BURNS));
    }
}

/// One direction in inertial space per burn: without a reference, but worse than free steering, and less so with more burns.
#[test]
fn thrust_fixed_in_inertial_space() {
    let losses = ["geo-2-burn", "geo-3-burn", "geo-4-burn"].map(|name| {
        let (fixed, free) = (solve(name, &["steering=inertial-fixed"]), solve(name, &[]));
        verified(&fixed);
        fixed.summary.results["propellant_kg"] - free.summary.results["propellant_kg"]
    });
    assert!(losses[2] > 0.0 && losses[0] > losses[1] && losses[1] > losses[2], "{losses:?}");
    verified(&solve("geo-2-burn", &["steering=inertial-fixed", "inclination_deg=28.5"]));
}

#[test]
fn second_burn_at_apogee() {
    let cases =
        [("PAA", 15750.187451), ("PPAA", 15565.588877), ("PPPAA", 15524.796887), ("PPPPAA", 15510.008545)];
    for (pattern, propellant) in cases {
        let burns = format!("burns={}", pattern.len());
        injected("geo-3-burn", &[&burns, &format!("pattern={pattern}")], propellant, PROPELLANT_KG);
    }
}

/// Above the target and back, from 51.6 deg. The reference limits the orbits after the perigee burns alone; here that after the apogee
/// burn, 0.3 km higher there, is limited too.
#[test]
fn supersynchronous() {
    let cases = [
        ("PPAP", "80000", 16989.790826580447),
        ("PPAP", "100000", 16947.878080517672),
        ("PAP", "80000", 17275.785),
        ("PAP", "100000", 17254.871),
    ];
    for (pattern, cap, propellant) in cases {
        let burns = format!("burns={}", pattern.len());
        let (pattern, limit) = (format!("pattern={pattern}"), format!("apogee_cap_km={cap}"));
        let outcome = injected(
            "geo-3-burn",
            &[&burns, &pattern, &limit, "inclination_deg=51.6"],
            propellant,
            COLLOCATION_PROPELLANT_KG,
        );
        let highest = cap.parse::<f64>().unwrap() - 6378.137;
        let before_the_last =
            outcome.summary.results.iter().filter(|(key, _)| key.ends_with("apogee_altitude_km"));
        assert!(before_the_last.map(|(_, v)| *v).fold(0.0, f64::max) < highest + CAP_KM);
    }
}

/// Between osculating circular orbits.
#[test]
fn with_oblateness() {
    let cases = [
        ("geo-2-burn", "0", 15753.873689580467),
        ("geo-3-burn", "0", 15570.382241101845),
        ("geo-5-burn", "0", 15515.211327259814),
        ("geo-2-burn", "28.5", 16430.242554158343),
        ("geo-3-burn", "28.5", 16223.277870243845),
        ("geo-2-burn", "51.6", 17403.881097916103),
        ("geo-3-burn", "51.6", 17192.84348646184),
    ];
    for (name, inclination, propellant) in cases {
        let inclination = format!("inclination_deg={inclination}");
        injected(name, &["oblateness=true", &inclination], propellant, COLLOCATION_PROPELLANT_KG);
    }
}

/// Propellant over flight time. At 6.4 h three burns are worse in the reference than two, which take 5.76 h.
#[test]
fn limited_flight_time() {
    let cases = [
        ("geo-2-burn", "5.587012207606427", 15758.265970278992),
        ("geo-2-burn", "5.299021887626713", 15812.904415208372),
        ("geo-2-burn", "5.0110315676470005", 15930.912529687183),
        ("geo-2-burn", "4.607845119675402", 16227.128601920509),
        ("geo-3-burn", "7.759192610191799", 15568.555705547824),
        ("geo-3-burn", "7.199250875435689", 15608.541257343315),
        ("geo-4-burn", "10.139245421483245", 15528.293457622265),
        ("geo-4-burn", "9.707788169505234", 15536.4511879826),
    ];
    for (name, limit, propellant) in cases {
        let hours: f64 = limit.parse().unwrap();
        let time = format!("max_flight_time_s={}", hours * 3600.0);
        let outcome = injected(name, &[&time], propellant, COLLOCATION_PROPELLANT_KG);
        near(&outcome, "flight_time_h", hours, BURN_TIME_S / 3600.0);
    }
    // A limit above the optimum's own time changes nothing.
    injected("geo-3-burn", &["max_flight_time_s=32400"], 15565.672402671438, PROPELLANT_KG);
}

/// Limits that nothing reaches change nothing; others cost.
#[test]
fn limited_burns() {
    injected("geo-3-burn", &["max_burn_time_s=1100"], 15565.672402671438, PROPELLANT_KG);
    let outcome = solve("geo-4-burn", &["max_burn_time_s=650"]);
    verified(&outcome);
    near(&outcome, "burn_1_time_s", 650.0, BURN_TIME_S);
    let propellant = outcome.summary.results["propellant_kg"];
    assert!((15524.886148083533..15525.2).contains(&propellant), "{propellant}");
    // After a burn that must end the engine had better stay on.
    assert!(has_check(&outcome, ON_BURNS) && !has_check(&outcome, ON_COASTS));
}

/// An elliptical target is reached, by less propellant than the circle of the same size through a lower perigee.
#[test]
fn elliptical_target() {
    for inclination in ["inclination_deg=0", "inclination_deg=28.5"] {
        let outcome = solve("geo-3-burn", &["target_eccentricity=0.3", inclination]);
        verified(&outcome);
        near(&outcome, "orbit_3_eccentricity", 0.3, TARGET_ECCENTRICITY);
        near(&outcome, "orbit_3_perigee_altitude_km", 0.7 * 42164.0 - 6378.137, TARGET_KM);
    }
}

/// Each case from its neighbour, also where the burns are solved alone.
#[test]
fn sweeps_start_from_neighbours() {
    let axis = sweep::Axis::parse("initial_mass_kg=22100,22135,22170").unwrap();
    let cases = sweep::cases(&apsides::registry(), "geo-3-burn", &[axis]).unwrap();
    let mut propellants = Vec::new();
    sweep::sweep(&cases, &mut (), |_, outcome| {
        let outcome = outcome.unwrap();
        verified(outcome);
        propellants.push(outcome.summary.results["propellant_kg"]);
        true
    })
    .unwrap();
    assert!((propellants[0] - 15565.672402671438).abs() < PROPELLANT_KG);
    assert!((propellants[2] - 15615.431377139967).abs() < PROPELLANT_KG);
}

/// The price of the mass is the slope between 22.1 t and 22.17 t, that of a limit the slope of the propellant over the time.
#[test]
fn prices_of_mass_and_time() {
    let price = |name: &str, overrides: &[&str], key: &str| {
        let mission = load(name, overrides).unwrap();
        let outcome = mission.solve(None, &mut ()).unwrap();
        mission.sensitivities(&outcome, &[key]).unwrap().remove(0).results["propellant_kg"]
    };
    let slope = (15615.431377139967 - 15565.672402671438) / 70.0;
    let found = price("geo-3-burn", &["initial_mass_kg=22135"], "initial_mass_kg");
    assert!((found / slope - 1.0).abs() < PRICE, "{found} {slope}");
    // A difference over 0.115 h, so that its middle is known to a few thousandths.
    let slope = (15831.000979 - 15797.344) / ((5.2414 - 5.3566) * 3600.0);
    let found = price("geo-2-burn", &["max_flight_time_s=19076.4"], "max_flight_time_s");
    assert!((found / slope - 1.0).abs() < PRICE_OF_TIME, "{found} {slope}");
    // A plane without inclination is another problem.
    let mission = load("geo-3-burn", &[]).unwrap();
    assert!(mission.priced_keys().all(|k| k.path != "inclination_deg"));
}

/// A single burn takes more than all of the propellant, and 15550 kg are 15.672 kg too few for three.
#[test]
fn too_little_propellant_is_explained() {
    let one = solve("geo-1-burn", &[]);
    assert_eq!(
        (one.summary.status.as_str(), one.summary.certificate.verdict),
        ("infeasible", Verdict::Rejected)
    );
    let explanation = one.explanation.unwrap();
    assert!(explanation.contains("kg of propellant are missing"), "{explanation}");
    let three = solve("geo-3-burn", &["propellant_kg=15550"]);
    assert_eq!(three.summary.status, "infeasible");
    let explanation = three.explanation.unwrap();
    // c ln(6550 / 6534.3276) = 7.80 m/s.
    assert!(explanation.ends_with("15.7 kg of propellant are missing, 7.8 m/s"), "{explanation}");
    let refused = load("geo-3-burn", &["propellant_kg=15480"]).unwrap_err().to_string();
    // Impulses take 15490.569 kg and 3931.857 m/s.
    for part in ["`propellant_kg` is 15480", "15490.6 kg (3931.9 m/s)", "10.6 kg and 5.2 m/s are missing"] {
        assert!(refused.contains(part), "{refused}");
    }
}

#[test]
fn bad_input_is_refused_by_name() {
    let cases: [(&[&str], &str); 18] = [
        (&["burns=0"], "`burns` is 0"),
        (&["burns=9"], "`burns` is 9"),
        (&["target_eccentricity=1"], "`target_eccentricity` is 1"),
        (&["inclination_deg=200"], "`inclination_deg` is 200"),
        (&["inclination_deg=180"], "`inclination_deg` is 180"),
        (&["inclination_deg=-1"], "`inclination_deg` is -1"),
        (&["thrust_n=0"], "`thrust_n` is 0"),
        (&["isp_s=nan"], "`isp_s` is NaN"),
        (&["target_radius_km=6000"], "above the surface (`body_radius_km` = 6378.137)"),
        (&["target_eccentricity=0.9"], "above the surface"),
        (&["target_radius_km=6500"], "above the parking orbit"),
        (&["apogee_cap_km=40000"], "`apogee_cap_km` is 40000, it must not be below the apogee of the target"),
        (&["max_restarts=1"], "`max_restarts` is 1, but 3 burns (`burns`) take 2"),
        (&["max_burn_time_s=800"], "`max_burn_time_s` is 800, but already without losses 3 burns"),
        (&["max_flight_time_s=1800"], "`max_flight_time_s` is 1800"),
        (&["propellant_kg=23000"], "`propellant_kg` is 23000, it must be below `initial_mass_kg`"),
        (&["steering=velocity", "inclination_deg=5"], "cannot change the plane"),
        (&["method=flatness"], "no flat outputs"),
    ];
    for (overrides, part) in cases {
        let message = load("geo-3-burn", overrides).unwrap_err().to_string();
        assert!(message.contains(part), "{overrides:?}: {message}");
    }
    let patterns = [
        ("PAX", "letters must be P and A"),
        ("PA", "2 letters"),
        ("APP", "P.., then A.."),
        ("PAP", "`apogee_cap_km`"),
    ];
    for (pattern, part) in patterns {
        let message = load("geo-3-burn", &[&format!("pattern={pattern}")]).unwrap_err().to_string();
        assert!(message.contains("`pattern` ") && message.contains(part), "{message}");
    }
}

/// Propellant of impulses at the apogee of the usual transfer orbit (200 km): the vis-viva equation, kg.
const IMPULSES_KG: f64 = 1e-2;
/// Published: mass flow and gravitational parameter by their last digits, relative.
const ROUNDED: f64 = 1e-3;
/// Propellant beyond that of impulses with two burns from a transfer orbit, relative: losses below 0.5 m/s.
const TWO_BURNS: f64 = 3e-4;

/// From an elliptic orbit: an impulse at apogee by the vis-viva equation is a bound that more burns come nearer to, and the certificate of two says
/// that another one would pay.
#[test]
fn from_a_transfer_orbit() {
    let solve = |overrides: &[&str]| {
        let all: Vec<String> = overrides.iter().map(ToString::to_string).collect();
        apsides::load("geo-2-burn", &all).unwrap().solve(None, &mut ()).unwrap()
    };
    let eccentricity = 0.7306;
    let e = format!("parking_eccentricity={eccentricity}");
    let two = solve(&[&e, "pattern=AA"]);
    assert_eq!(two.summary.certificate.verdict, Verdict::Feasible);
    let failed: Vec<_> = two.summary.certificate.checks.iter().filter(|c| !c.passed).collect();
    assert!(failed.len() == 1 && failed[0].name == "switching function below zero on a coast", "{failed:?}");
    // From a fine mesh another optimum is reached, which is proved and takes more.
    let proved = solve(&[&e, "pattern=AA", "radau.intervals=3", "radau.points=10"]).summary;
    assert!(proved.certificate.is_verified(), "{:?}", proved.certificate.verdict);
    let of = |key: &str| two.summary.results[key];
    assert!(proved.results["propellant_kg"] > of("propellant_kg"));
    // mu of the Earth, perigee, and apogee of the start; radius of the target.
    let (mu, perigee, target) = (3.986_004_418e14, 6_578_137.0, 42_164e3);
    let apogee = perigee * (1.0 + eccentricity) / (1.0 - eccentricity);
    let speed = |r: f64, other: f64| (2.0 * mu * other / (r * (r + other))).sqrt();
    let change = (speed(apogee, target) - speed(apogee, perigee)).abs()
        + (speed(target, target) - speed(target, apogee)).abs();
    let impulses = 22_100.0 * (1.0 - (-change / (20_000.0_f64 / 6.14)).exp());
    assert!(
        (of("impulsive_propellant_kg") - impulses).abs() < ROUNDED * impulses,
        "{} {impulses}",
        of("impulsive_propellant_kg")
    );
    assert!(
        of("propellant_kg") > impulses - IMPULSES_KG && of("propellant_kg") < (1.0 + TWO_BURNS) * impulses
    );
    let propellant_of = |overrides: &[&str]| solve(overrides).summary.results["propellant_kg"];
    assert!(propellant_of(&[&e, "burns=1", "pattern=A"]) > of("propellant_kg"));
    let three = propellant_of(&[&e, "burns=3", "pattern=AAA"]);
    assert!(three > impulses - IMPULSES_KG && three < of("propellant_kg"), "{three}");
    // On a circle a burn at apogee has no place to begin.
    let refused = apsides::load("geo-2-burn", &["pattern=AA".into()]);
    assert!(refused.is_err());
}

/// Solver: one optimum from two starts, kg.
const SAME_MASS_KG: f64 = 1e-5;

/// The whole flight of a result, with its coasts, starts the problem that has the burns alone.
#[test]
fn a_flight_starts_its_mission_again() {
    let mission = apsides::load("geo-2-burn", &[]).unwrap();
    let first = mission.solve(None, &mut ()).unwrap();
    let again = mission.solve(Some(&first.trajectory), &mut ()).unwrap();
    assert!(again.status.is_success() && again.summary.certificate.is_verified(), "{:?}", again.status);
    let mass = |outcome: &apsides::Outcome| outcome.summary.results["final_mass_kg"];
    assert!((mass(&again) - mass(&first)).abs() < SAME_MASS_KG, "{} {}", mass(&again), mass(&first));
    // A flight with other phases is refused, not taken for one.
    let other = apsides::load("geo-3-burn", &[]).unwrap().solve(Some(&first.trajectory), &mut ());
    assert!(other.is_err_and(|e| e.to_string().contains("phases")));
}
