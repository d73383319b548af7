//! The equilibrium of a model and how it oscillates there, by Newton's method on the exact Jacobian: a pendulum under a constant torque.
#![allow(clippy::print_stdout)]

use apsides_ad::{Dynamics, Scalar, dynamics_node};

/// Angle (rad) and rate (rad/s) under a torque by the moment of inertia (1/s2).
struct Pendulum {
    gravity: f64,
    length: f64,
}

impl Dynamics<2, 1> for Pendulum {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0] - x[0].sin() * (self.gravity / self.length)]
    }
}

fn main() {
    let node = dynamics_node(Pendulum { gravity: 9.81, length: 2.0 });
    let pattern = node.pattern();
    let torque = 2.0;
    let (mut angle, mut rate) = (0.0, [0.0; 2]);
    let mut jacobian = vec![0.0; pattern.jacobian_len()];
    let mut stiffness = 0.0;
    for iteration in 0..20 {
        // Inputs are states, controls, parameters, time.
        node.jacobian(&[angle, 0.0, torque, 0.0], &mut rate, &mut jacobian);
        let by_angle = pattern.jacobian_entries().position(|entry| entry == (1, 0));
        stiffness = by_angle.map_or(0.0, |k| jacobian[k]);
        println!("{iteration}: angle {angle:.15} rad, acceleration {:+.1e} 1/s2", rate[1]);
        if rate[1].abs() < 1e-14 {
            break;
        }
        angle -= rate[1] / stiffness;
    }
    let period = std::f64::consts::TAU / (-stiffness).sqrt();
    println!("small oscillations have a period of {period:.6} s");
    // sin(angle) = torque length / gravity.
    assert!((angle - (torque * 2.0 / 9.81_f64).asin()).abs() < 1e-14);
    assert!((period - std::f64::consts::TAU / (9.81 / 2.0 * angle.cos()).sqrt()).abs() < 1e-12);
}
