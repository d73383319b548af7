//! Epochs and axes against ERFA and SPICE (`tests/references/ephemeris_axes.py`), flights of missions against Newton's law.
#![allow(clippy::unwrap_used)]

use apsides_ephemeris::{CentralBody, Ephemeris, Epoch, Sampling, TimeScale};

/// The numbers that the program printed.
const PRINTED: &str = include_str!("../references/ephemeris_axes.txt");

/// Published: TDB by the series of USNO Circular 179, s.
const SERIES: f64 = 2e-5;
/// Round-off of seconds over a century.
const SECONDS: f64 = 1e-6;
/// Round-off of the days of a century in the angle of the meridian, rad.
const ANGLE: f64 = 2e-11;
/// Round-off of a rate, 1/s.
const RATE: f64 = 1e-14;
/// Position (m) and velocity (m/s) that files are to agree to are 1 and 1e-3; round-off of the axes takes much less.
const POSITION: f64 = 2e-4;
const VELOCITY: f64 = 1e-6;

/// Words of the lines that begin with a word.
fn rows(kind: &str) -> impl Iterator<Item = Vec<&'static str>> {
    let words = |line: &'static str| line.split(' ').collect::<Vec<_>>();
    PRINTED.lines().map(words).filter(move |words| words[0] == kind)
}

fn numbers<const N: usize>(words: &[&str]) -> [f64; N] {
    std::array::from_fn(|k| words[k].parse().unwrap())
}

#[test]
fn time_scales_are_those_of_erfa() {
    let j2000: Epoch = "2000-01-01T12:00:00 TT".parse().unwrap();
    let mut count = 0;
    for words in rows("scales") {
        let epoch: Epoch = format!("{} {}", words[1], words[2]).parse().unwrap();
        let [tai, tt, tdb] = numbers(&words[3..]);
        assert!((epoch.since(&j2000) - tt).abs() < SERIES, "{words:?}");
        assert!((epoch.since(&j2000) - 32.184 - tai).abs() < SERIES, "{words:?}");
        assert!((epoch.tdb_seconds() - tdb).abs() < SERIES, "{words:?}");
        if words[2] != "TDB" {
            assert!((epoch.since(&j2000) - tt).abs() < SECONDS, "{words:?}");
        }
        // Written in another scale it is the same instant.
        for scale in TimeScale::ALL.into_iter().filter(|scale| epoch.is_in(*scale)) {
            let again: Epoch = epoch.in_scale(scale).to_string().parse().unwrap();
            assert!(again.since(&epoch).abs() < SECONDS, "{words:?} {again}");
        }
        count += 1;
    }
    assert_eq!(count, 10);
}

#[test]
fn axes_are_those_of_spice() {
    let mut count = 0;
    for words in rows("axes").chain(rows("state")) {
        let body = CentralBody::ALL.into_iter().find(|body| body.word() == words[1]).unwrap();
        let epoch: Epoch = format!("{} TDB", words[2]).parse().unwrap();
        let axes = body.orientation(&epoch);
        if words[0] == "axes" {
            let expected: [f64; 18] = numbers(&words[3..]);
            let (matrix, rate) = expected.split_at(9);
            for (found, expected) in axes.matrix.as_flattened().iter().zip(matrix) {
                assert!((found - expected).abs() < ANGLE, "{words:?}: {found}");
            }
            for (found, expected) in axes.rate.as_flattened().iter().zip(rate) {
                assert!((found - expected).abs() < RATE, "{words:?}: {found}");
            }
        } else {
            let [x, y, z, u, v, w, inertial @ ..]: [f64; 12] = numbers(&words[3..]);
            let (position, velocity) = axes.to_icrf([x, y, z], [u, v, w]);
            for k in 0..3 {
                assert!((position[k] - inertial[k]).abs() < POSITION, "{words:?}: {position:?}");
                assert!((velocity[k] - inertial[3 + k]).abs() < VELOCITY, "{words:?}: {velocity:?}");
            }
        }
        count += 1;
    }
    assert_eq!(count, 30);
}

/// Solves a mission with values and gives the rows of its flight.
fn flown(mission: &str, values: &[&str], step: f64) -> Ephemeris {
    let values: Vec<String> = values.iter().map(|v| (*v).to_owned()).collect();
    let mission = apsides::load(mission, &values).unwrap();
    let solved = mission.solve(None, &mut ()).unwrap();
    assert!(solved.status.is_success());
    mission.ephemeris(&solved.decisions, &solved.ocp, &solved.trajectory, Sampling::Step(step)).unwrap()
}

/// Mesh: `radau.tolerance` of the missions with thrust, the error of positions by the distance from the centre. Their rates err by as much in
/// a second, which is nearer than nodes are.
const MESH: f64 = 1e-10;
/// The same of the re-entry.
const MESH_OF_ENTRY: f64 = 1e-9;
/// Mesh: the force of the air by mass between the nodes, m/s2.
const AIR: f64 = 2e-4;
/// Published: a mission over the Moon turns with it by the sidereal month, the report's axes by librations too, 5e-9 rad/s at most, which at
/// 1.7 km/s is so much of the Coriolis acceleration, m/s2.
const LIBRATION: f64 = 2e-5;
/// Round-off of the times of rows, relative to their distance.
const EVEN: f64 = 1e-6;
/// Change of the thrust between rows, by its size, from which they are on both sides of a switch.
const SWITCH: f64 = 0.02;

/// Derivatives of positions and of velocities along rows that are equally spaced, at the middle ones, with these rows.
fn quotients(table: &Ephemeris) -> Vec<(usize, [f64; 3], [f64; 3])> {
    let thrust = table.column("thrust_N").unwrap();
    let largest = thrust.iter().fold(1e-9, |a, b| b.max(a));
    let mut found = Vec::new();
    for phase in &table.phases {
        for k in phase.rows.start + 2..phase.rows.end.saturating_sub(2) {
            let h = table.times[k + 1] - table.times[k];
            let even = (k - 2..k + 2).all(|j| (table.times[j + 1] - table.times[j] - h).abs() < EVEN * h);
            let steady = (k - 2..k + 2).all(|j| (thrust[j + 1] - thrust[j]).abs() < SWITCH * largest);
            if even && steady {
                let of = |pick: &dyn Fn(usize) -> [f64; 3]| {
                    std::array::from_fn(|i| {
                        let [a, b, c, d] = [k - 2, k - 1, k + 1, k + 2].map(|j| pick(j)[i]);
                        (a - 8.0 * b + 8.0 * c - d) / (12.0 * h)
                    })
                };
                found.push((k, of(&|j| table.states[j].position), of(&|j| table.states[j].velocity)));
            }
        }
    }
    found
}

/// Newton's law in inertial space: positions change by velocities, these by gravity and thrust, whatever coordinates a phase has.
#[test]
fn flights_obey_newtons_law_in_axes_of_the_icrf() {
    let cases: [(&str, &[&str], f64, f64); 6] = [
        ("lunar-two-phase", &["frame.inclination_deg=70"], 4_904.869_5e9, 1.0),
        ("lunar-transfer", &["frame.reference=icrf"], 4_904.869_5e9, 1.0),
        ("lunar-throttled", &["max_pitch_rate_deg_s=5"], 4_904.869_5e9, 1.0),
        ("chang-e-3-flat", &[], 4_902.793_455e9, 0.25),
        ("chang-e-3", &["epoch=2013-12-14T13:00:00 UTC"], 4_902.793_455e9, 0.25),
        ("geo-2-burn", &["inclination_deg=28.5"], 398_600.441_8e9, 5.0),
    ];
    for (mission, values, mu, step) in cases {
        let table = flown(mission, values, step);
        let rows = quotients(&table);
        assert!(rows.len() > 50, "{mission}: {} rows", rows.len());
        let vector =
            |k: usize| ["x", "y", "z"].map(|c| table.column(&format!("thrust_icrf_{c}_N")).unwrap()[k]);
        for (k, velocity, acceleration) in rows {
            let s = &table.states[k];
            let r = s.position.iter().map(|c| c * c).sum::<f64>().sqrt();
            let thrust = vector(k);
            for i in 0..3 {
                let expected = thrust[i] / s.mass.unwrap() - mu * s.position[i] / (r * r * r);
                let place = format!("{mission}, {} s of {}", table.times[k], table.phase_of(k));
                assert!(
                    (velocity[i] - s.velocity[i]).abs() < MESH * r,
                    "{place}: {velocity:?} {:?}",
                    s.velocity
                );
                let difference = acceleration[i] - expected;
                assert!(
                    difference.abs() < LIBRATION,
                    "{place}: {difference} of {acceleration:?}, thrust {thrust:?}"
                );
            }
        }
    }
}

/// The force of the air by mass is what gravity leaves of the acceleration, and the flight ends at its target.
#[test]
fn a_reentry_feels_gravity_and_the_air() {
    let table = flown("capsule-reentry", &["epoch=2026-05-04T03:02:01 UTC"], 0.25);
    let felt = table.column("aerodynamic_acceleration_m_per_s2").unwrap();
    for (k, velocity, acceleration) in quotients(&table) {
        let s = &table.states[k];
        let r = s.position.iter().map(|c| c * c).sum::<f64>().sqrt();
        let air: f64 = (0..3)
            .map(|i| (acceleration[i] + 398_600.441_8e9 * s.position[i] / (r * r * r)).powi(2))
            .sum::<f64>()
            .sqrt();
        assert!((air - felt[k]).abs() < AIR, "{} s: {air} {}", table.times[k], felt[k]);
        assert!(
            (0..3).all(|i| (velocity[i] - s.velocity[i]).abs() < MESH_OF_ENTRY * r),
            "{} s",
            table.times[k]
        );
    }
    for header in ["east_of_site_m", "north_of_site_m", "above_site_m"] {
        assert!(table.column(header).unwrap().last().unwrap().abs() < POSITION, "{header}");
    }
}
