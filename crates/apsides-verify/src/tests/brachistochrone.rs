//! The brachistochrone, nonlinear in state and control: with `w = sqrt(g / R)` the control is `theta = w t / 2`, the
//! path the cycloid `x = R (w t - sin w t)`, `y = R (1 - cos w t)`, and from `H = -1`, `dH/dtheta = 0` follow
//! `lambda_x = -1 / (2 R w)`, `lambda_v = -(cos theta + lambda_y v) / g` with `lambda_y` from the free final speed.
//! A. E. Bryson and Y.-C. Ho, Applied Optimal Control, 1975, section 2.7, problem 6.

use super::parts::{self, trajectory};
use super::{assert_exact, assert_failed, certify, certify_stated};
use apsides_ad::{Dynamics, Scalar};
use apsides_ocp::{At, Bounds, Ocp, Phase, State, Trajectory, Variable};

const G: f64 = 9.806_65;
const RADIUS: f64 = 1.3;
const FINAL_PHI: f64 = 2.4;

struct Slide;
impl Dynamics<3, 1> for Slide {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], u: &[S; 1], _p: &[S; 0]) -> [S; 3] {
        let (sin, cos) = u[0].sin_cos();
        [x[2] * sin, x[2] * cos, cos * G]
    }
}

fn problem() -> Ocp {
    let slide = Phase::new("slide", Slide)
        .states([
            State::new("x", "m")
                .within(0.0, 20.0)
                .starts_at(0.0)
                .ends_at(RADIUS * (FINAL_PHI - FINAL_PHI.sin())),
            State::new("depth", "m")
                .within(0.0, 20.0)
                .starts_at(0.0)
                .ends_at(RADIUS * (1.0 - FINAL_PHI.cos())),
            State::new("speed", "m/s").within(0.0, 30.0).starts_at(0.0),
        ])
        .controls([Variable::new("angle", "rad").within(-0.1, 3.2)])
        .final_time(Bounds::new(0.1, 10.0));
    Ocp::builder("brachistochrone")
        .phase(slide)
        .minimize("time", "s", At::FinalTime("slide"))
        .build()
        .expect("well-posed")
}

/// The solution with `extra` added to the costate of the depth.
fn solution(extra: f64) -> Trajectory {
    let w = (G / RADIUS).sqrt();
    let tf = FINAL_PHI / w;
    let speed = move |t: f64| 2.0 * RADIUS * w * (0.5 * w * t).sin();
    let depth_costate = -(0.5 * FINAL_PHI).cos() / speed(tf) + extra;
    let x = move |_: usize, t: f64| {
        vec![RADIUS * (w * t - (w * t).sin()), RADIUS * (1.0 - (w * t).cos()), speed(t)]
    };
    let costate = move |_: usize, t: f64| {
        let speed_costate = -((0.5 * w * t).cos() + depth_costate * speed(t)) / G;
        vec![-0.5 / (RADIUS * w), depth_costate, speed_costate]
    };
    let u = move |_: usize, t: f64| vec![0.5 * w * t];
    trajectory(vec![parts::phase("slide", &parts::breaks(0.0, tf, 6), 8, x, u, costate)], tf)
}

#[test]
fn the_cycloid_is_verified() {
    assert_exact(&certify(&problem(), &solution(0.0)));
}

#[test]
fn only_transversality_tells_the_costate_of_the_depth() {
    // Every depth costate solves the costate equation with dH/dtheta = 0 and H = -1.
    assert_failed(&certify_stated(&problem(), &solution(1e-3)), &["transversality"]);
}
