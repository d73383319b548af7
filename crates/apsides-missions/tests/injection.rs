//! The start of an injection: how near its costates are to those of the optimum.
#![allow(clippy::unwrap_used)]

use apsides_missions::registry;

/// Size of the target orbit, m: it makes a costate of the semi-latus rectum one of a ratio.
const SIZE: f64 = 42_164e3;

/// The gradient of the impulsive cost is the limit for many short burns: it comes nearer as each becomes shorter.
#[test]
fn costates_of_the_guess_approach_those_of_the_optimum() {
    for (inclination, limits) in [("0", [0.20, 0.07, 0.05, 0.04]), ("28.5", [0.20, 0.08, 0.05, 0.04])] {
        for (name, limit) in ["geo-2-burn", "geo-3-burn", "geo-4-burn", "geo-6-burn"].iter().zip(limits) {
            let mission = registry().load(name, &[format!("inclination_deg={inclination}")]).unwrap();
            let guessed = mission.pose().unwrap().costates.unwrap();
            let outcome = mission.solve(None, &mut ()).unwrap();
            let phases = &outcome.solved().1.phases;
            assert_eq!(guessed.len(), phases.len());
            let (mut miss, mut size) = (0.0_f64, 0.0_f64);
            for (phase, ends) in phases.iter().zip(&guessed) {
                let costate = phase.costate.as_ref().unwrap();
                for (time, guess) in [phase.initial_time, phase.final_time].into_iter().zip(ends) {
                    let mut found = vec![0.0; costate.dimension()];
                    costate.evaluate(time, &mut found);
                    for (i, (f, g)) in found.iter().zip(guess).enumerate() {
                        let scale = if i == 0 { SIZE } else { 1.0 };
                        miss = miss.max((scale * (f - g)).abs());
                        size = size.max((scale * f).abs());
                    }
                    // Of the mass, which is of another order: minus what a kilogram more would arrive as.
                    let mass = found.len() - 1;
                    assert!((guess[mass] / found[mass] - 1.0).abs() < limit, "{name}: {guess:?} {found:?}");
                }
            }
            assert!(miss < limit * size, "{name}, {inclination} deg: {}", miss / size);
        }
    }
}
