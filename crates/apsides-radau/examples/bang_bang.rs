//! Least time for a cart to move 1 m from rest to rest with an acceleration of at most 1 m/s2: 2 s, with one switch in the middle that the
//! mesh finds.
#![allow(clippy::print_stdout)]

use apsides_ad::{Dynamics, Scalar};
use apsides_ocp::{At, Bounds, Guess, Ocp, Phase, State, Variable};
use apsides_radau::Radau;

struct Cart;

impl Dynamics<2, 1> for Cart {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0]]
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let phase = Phase::new("move", Cart)
        .states([
            State::new("x", "m").within(-1.0, 2.0).starts_at(0.0).ends_at(1.0),
            State::new("v", "m/s").within(-2.0, 2.0).starts_at(0.0).ends_at(0.0),
        ])
        .controls([Variable::new("a", "m/s2").within(-1.0, 1.0)])
        .final_time(Bounds::new(0.5, 10.0));
    let ocp = Ocp::builder("cart").phase(phase).minimize("time", "s", At::FinalTime("move")).build()?;
    let solution = Radau::default().solve(&ocp, &Guess::linear(&ocp))?;

    let trajectory = &solution.trajectory;
    println!("{}, {} meshes, time {:.9} s", solution.status, solution.meshes.len(), trajectory.objective);
    for k in 0..=8 {
        let t = trajectory.objective * f64::from(k) / 8.0;
        let (x, u) = (trajectory.phases[0].state_at(t), trajectory.phases[0].control_at(t));
        println!("t {t:.3} s: x {:.6} m, v {:.6} m/s, a {:+.6} m/s2", x[0], x[1], u[0]);
    }
    println!("switches: {:?}", solution.switches);
    assert!((trajectory.objective - 2.0).abs() < 1e-6);
    Ok(())
}
