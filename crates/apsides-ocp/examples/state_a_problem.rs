//! A problem is stated once, for any method: a brachistochrone, its sizes, its start, and what is said of one that is ill-posed.
#![allow(clippy::print_stdout)]

use apsides_ad::{Dynamics, Scalar};
use apsides_ocp::{At, Bounds, Guess, Ocp, OcpError, Phase, State, Variable};

struct Brachistochrone {
    gravity: f64,
}

impl Dynamics<3, 1> for Brachistochrone {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], u: &[S; 1], _p: &[S; 0]) -> [S; 3] {
        let (sin, cos) = u[0].sin_cos();
        [x[2] * sin, x[2] * cos, cos * self.gravity]
    }
}

/// Least time from rest over 10 m and down to a depth, m.
fn slide_to(depth: f64) -> Result<Ocp, OcpError> {
    let slide = Phase::new("slide", Brachistochrone { gravity: 9.80665 })
        .states([
            State::new("x", "m").within(0.0, 20.0).starts_at(0.0).ends_at(10.0),
            State::new("depth", "m").within(0.0, 20.0).starts_at(0.0).ends_at(depth),
            State::new("speed", "m/s").within(0.0, 30.0).starts_at(0.0),
        ])
        .controls([Variable::new("angle", "rad").within(0.0, 3.2)])
        .final_time(Bounds::new(0.1, 10.0));
    Ocp::builder("brachistochrone").phase(slide).minimize("time", "s", At::FinalTime("slide")).build()
}

fn main() -> Result<(), OcpError> {
    let ocp = slide_to(5.0)?;
    let phase = &ocp.phases[0];
    let pattern = phase.dynamics.pattern();
    println!(
        "{}: {} non-zeros of the Jacobian, {} of the Hessian",
        ocp.name,
        pattern.jacobian_len(),
        pattern.hessian_len()
    );
    // Position depends on speed and angle, speed on the angle.
    assert_eq!(pattern.jacobian_len(), 5);
    assert_eq!(phase.state_index("speed"), Some(2));
    // Methods start from straight lines between the ends where nothing better is known.
    let _start = Guess::linear(&ocp);

    let refusal = slide_to(25.0).err().map(|e| e.to_string()).unwrap_or_default();
    println!("depth of 25 m: {refusal}");
    assert!(refusal.contains("depth"));
    Ok(())
}
