//! The start of an injection: how near its orbits and costates are to the optimum.
#![allow(clippy::unwrap_used)]

use apsides::Mission;

#[test]
fn costates_of_the_guess() {
    for (name, inclination) in [("geo-2-burn", 0.0), ("geo-3-burn", 0.0), ("geo-6-burn", 0.0), ("geo-3-burn", 28.5), ("geo-2-burn",28.5)] {
        let mission = Mission::load(name, &[format!("inclination_deg={inclination}")]).unwrap();
        let guessed = mission.pose().unwrap().costates.unwrap();
        let outcome = mission.solve(None, &mut ()).unwrap();
        for (phase, ends) in outcome.solved().1.phases.iter().zip(&guessed) {
            let costate = phase.costate.as_ref().unwrap();
            for (t, guess) in [phase.initial_time, phase.final_time].into_iter().zip(ends) {
                let mut found = vec![0.0; costate.dimension()];
                costate.evaluate(t, &mut found);
                eprintln!("{name} {} {t:.0}\n  {found:.4e?}\n  {guess:.4e?}", phase.name);
            }
        }
    }
}
