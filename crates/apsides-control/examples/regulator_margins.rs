//! A linear-quadratic regulator for an axis of a spacecraft, and how much gain, phase and delay its loop tolerates.
//!
//! For `x'' = u` with the costs 1 on angle and control, and none on the rate, the gains are `1` and `sqrt(2)`.
#![allow(clippy::print_stdout)]

use apsides_ad::{Dynamics, Scalar};
use apsides_control::linear::linearise;
use apsides_control::lqr::lqr;
use apsides_control::margins::LoopAnalysis;
use apsides_control::state_space::StateSpace;

struct Axis;

impl Dynamics<2, 1> for Axis {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0]]
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let plant = linearise(&Axis, 0.0, &[0.0; 2], &[0.0]);
    let regulator = lqr(&plant, &[[1.0, 0.0], [0.0, 0.0]], &[[1.0]])?;
    let gain = regulator.gain[0];
    println!("gains {gain:.9?}");
    assert!((gain[0] - 1.0).abs() < 1e-9 && (gain[1] - 2_f64.sqrt()).abs() < 1e-9);

    // The loop is broken at the control: K (s I - A)^-1 B.
    let open = StateSpace::of_plant(&plant, &[gain])?;
    let margins = LoopAnalysis::new(&open, 0.0, [1e-2, 1e2], 600)?.margins()?;
    let phase = margins.phase.ok_or("the loop has no crossing")?;
    let delay = margins.delay.ok_or("the loop has no crossing")?;
    println!("phase margin {:.3} deg at {:.4} rad/s", phase.margin.to_degrees(), phase.frequency);
    println!("delay margin {:.4} s", delay.margin);
    // Kalman's inequality: at least 60 deg, and no gain too large.
    assert!(margins.stable && phase.margin.to_degrees() > 60.0 && margins.gain.is_none());
    // |L| = 1 at w^4 = 1 + 2 w^2.
    assert!((phase.frequency - (1.0 + 2_f64.sqrt()).sqrt()).abs() < 1e-6);
    Ok(())
}
