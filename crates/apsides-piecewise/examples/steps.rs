//! The price of constant controls: least effort of a cart that moves 1 m in 1 s from rest to rest with `n` equal steps of acceleration.
//!
//! The best steps are the means of `6 - 12 t`, of which `n` make 1 m only when they are larger by `1 / (1 - 1/n^2)`: the effort is
//! `6 / (1 - 1/n^2)`.
#![allow(clippy::print_stdout)]

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Guess, Ocp, Phase, State, Variable};
use apsides_piecewise::{PiecewiseConstant, PiecewiseSettings};

struct Cart;

impl Dynamics<2, 1> for Cart {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0]]
    }
}

impl PathFunction<2, 1, 1> for Cart {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0].square() * 0.5]
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let phase = Phase::new("move", Cart)
        .states([
            State::new("x", "m").starts_at(0.0).ends_at(1.0),
            State::new("v", "m/s").starts_at(0.0).ends_at(0.0),
        ])
        .controls([Variable::new("a", "m/s2")])
        .final_time(Bounds::fixed(1.0))
        .integral(Variable::new("effort", "m2/s3"), Cart);
    let ocp = Ocp::builder("cart").phase(phase).minimize_integral("move", "effort").build()?;
    for segments in [2, 4, 8, 16] {
        let settings = PiecewiseSettings { intervals: segments, ..PiecewiseSettings::default() };
        let effort = PiecewiseConstant { settings }.solve(&ocp, &Guess::linear(&ocp))?.trajectory.objective;
        let closed = 6.0 / (1.0 - 1.0 / (segments * segments) as f64);
        println!("{segments:2} steps: effort {effort:.9} m2/s3, closed form {closed:.9} m2/s3");
        assert!((effort - closed).abs() < 1e-7);
    }
    Ok(())
}
