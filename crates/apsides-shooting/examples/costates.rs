//! Least effort of a cart that moves 1 m in 1 s from rest to rest, by direct shooting and, from its multipliers, by Pontryagin's principle.
//!
//! In closed form `a = 6 - 12 t`; the costate of the speed is `-a`, and the effort is 6 m2/s3.
#![allow(clippy::print_stdout)]

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Guess, Ocp, Phase, State, Variable};
use apsides_shooting::{direct::MultipleShooting, indirect::IndirectShooting};

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

    let direct = MultipleShooting::default().solve(&ocp, &Guess::linear(&ocp))?;
    println!("direct:   effort {:.12} m2/s3", direct.trajectory.objective);
    let indirect = IndirectShooting::default().solve_from(&ocp, &direct.trajectory, 1)?;
    let exact = indirect.trajectory.ok_or("indirect shooting has not converged")?;
    println!("indirect: effort {:.12} m2/s3", exact.objective);
    for k in 0..=4 {
        let t = f64::from(k) / 4.0;
        let acceleration = exact.phases[0].control_at(t)[0];
        println!("t {t:.2} s: a {acceleration:+.12} m/s2");
        assert!((acceleration - (6.0 - 12.0 * t)).abs() < 1e-9);
    }
    assert!((exact.objective - 6.0).abs() < 1e-10);
    Ok(())
}
