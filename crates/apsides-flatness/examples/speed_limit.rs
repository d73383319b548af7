//! Least effort of a cart that moves 1 m in 1 s from rest to rest with at most 1.25 m/s. A cart is flat: position and derivatives are all.
//!
//! The acceleration falls linearly to zero in `t1 = 3/2 (1 - 1/V)`, and the minimum of `1/2 int a^2` is `4 V^2 / (3 t1)`.
#![allow(clippy::print_stdout)]

use apsides_ad::{Dynamics, FlatMap, PathFunction, Scalar};
use apsides_flatness::{FlatSystem, Flatness};
use apsides_ocp::{Bounds, Guess, Ocp, Phase, State, Variable};

struct Cart;

impl Dynamics<2, 1> for Cart {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0]]
    }
}

/// One output, the position, with derivatives to number 2.
impl FlatMap<1, 3, 2, 1, 0> for Cart {
    fn evaluate<S: Scalar>(&self, _t: S, y: &[[S; 3]; 1], _p: &[S; 0]) -> ([S; 2], [S; 1], [S; 0]) {
        ([y[0][0], y[0][1]], [y[0][2]], [])
    }
    fn outputs(&self, _t: f64, x: &[f64; 2], _u: &[f64; 1], _p: &[f64; 0]) -> [f64; 1] {
        [x[0]]
    }
}

struct Effort;

impl PathFunction<2, 1, 1> for Effort {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0].square() * 0.5]
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    const LIMIT: f64 = 1.25;
    let phase = Phase::new("move", Cart)
        .states([
            State::new("x", "m").within(-1.0, 2.0).starts_at(0.0).ends_at(1.0),
            State::new("v", "m/s").within(-LIMIT, LIMIT).starts_at(0.0).ends_at(0.0),
        ])
        .controls([Variable::new("a", "m/s2")])
        .final_time(Bounds::fixed(1.0))
        .integral(Variable::new("effort", "m2/s3"), Effort);
    let ocp = Ocp::builder("cart").phase(phase).minimize_integral("move", "effort").build()?;
    let solution = Flatness::default().solve(&ocp, &[FlatSystem::new(Cart)], &Guess::linear(&ocp))?;

    let exact = 4.0 * LIMIT * LIMIT / (3.0 * 1.5 * (1.0 - 1.0 / LIMIT));
    let effort = solution.trajectory.objective;
    println!("effort {effort:.9} m2/s3, closed form {exact:.9} m2/s3");
    let fastest = (0..=1000).map(|k| solution.trajectory.phases[0].state_at(f64::from(k) / 1000.0)[1]);
    println!("fastest {:.9} m/s", fastest.fold(0.0, f64::max));
    assert!((effort / exact - 1.0).abs() < 1e-4);
    Ok(())
}
