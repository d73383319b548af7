//! Re-entry under profiles of the bank angle.

use apsides_ocp::{Bounds, Ocp};
use apsides_ode::Method;
use apsides_shooting::profile::{
    Flight, FlightEnd, FlightRules, FlightSettings, MAX_DEGREE, MeshWish, ProfileShape, ProfileShooting,
};

use crate::capsule::{TARGET, bank, energy, in_energy, in_time, ocp, score};

/// Bank angle in degrees every 10 s from 0 to 560 s of the optimum with limits of 15 kPa, 40 m/s2, 800 kW/m2 (Radau collocation with 300
/// elements of degree 3 by CasADi and Ipopt).
const OPTIMUM: [f64; 57] = [
    6.349, 6.657, 7.031, 7.492, 8.044, 8.677, 9.486, 10.511, 11.817, 13.513, 15.805, 18.982, 23.506, 30.119,
    39.793, 53.027, 67.894, 79.473, 83.662, 79.363, 68.549, 56.875, 50.793, 57.126, 88.500, 59.518, 52.566,
    66.992, 38.630, 27.593, 22.786, 20.455, 19.278, 18.692, 18.415, 18.293, 18.232, 18.178, 18.105, 18.009,
    17.913, 17.862, 17.914, 18.131, 18.565, 19.241, 20.137, 21.173, 22.198, 22.997, 23.305, 22.885, 21.627,
    19.639, 17.199, 14.620, 12.135,
];

fn accurate(rules: FlightRules) -> FlightRules {
    let settings =
        FlightSettings { method: Method::Dop853, tolerance: 1e-11, samples: 20, ..FlightSettings::default() };
    FlightRules { settings, ..rules }
}

fn fly(ocp: &Ocp, rules: FlightRules, decision: &[f64]) -> Flight {
    ProfileShooting::new(ocp, rules).unwrap().flown(decision, Flight::clone).unwrap()
}

#[test]
fn probe() {
    let ocp = ocp();
    let shape = ProfileShape { continuous: true, ..ProfileShape::new(1, 56, bank()) };
    let mut decision: Vec<f64> = OPTIMUM.iter().map(|b| b.to_radians()).collect();
    decision.push(560.0);
    for rules in [accurate(in_time(shape.clone())), in_time(shape)] {
        let f = fly(&ocp, rules, &decision);
        println!("{f:#?}");
        println!("{} {}", f.final_state[1].to_degrees(), f.final_state[2].to_degrees());
    }
    for b in [0.0, 30.0, 45.0, 60.0, 90.0_f64] {
        for rules in
            [accurate(in_energy(ProfileShape::new(0, 1, bank()))), in_energy(ProfileShape::new(0, 1, bank()))]
        {
            let f = fly(&ocp, rules, &[b.to_radians()]);
            println!(
                "{b} {:?} {} {} {} {} steps {} evals {} v {}",
                f.end,
                f.final_time,
                f.objective / 1e6,
                f.peaks[2].value / 1e3,
                f.peaks[1].value,
                f.steps,
                f.evaluations,
                f.final_state[3]
            );
        }
    }
}
