//! A plant whose errors grow by `e^40`: `x' = a x + u`, least integral of `x^2 + u^2` over 20 s from `x = 1`, with `a = 2`.
//!
//! ```text
//! x'' = w^2 x,  w^2 = a^2 + 1,   u = x' - a x,   lambda = -2 u,   u(T) = 0,   J = -u(0)
//! ```

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Ocp, Phase, State, Trajectory, Variable};

use super::parts::{self, breaks};
use super::{assert_failed, certify, find};
use crate::{Certificate, PhaseSamples, Verdict, VerifySettings, sampled};

const END: f64 = 20.0;
const INTERVALS: usize = 80;
const POINTS: usize = 8;
/// The limit of ends and jumps, of states whose scale is one.
const LIMIT: f64 = 1e-7;

#[derive(Clone, Copy)]
struct Plant(f64);
impl Dynamics<1, 1> for Plant {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [x[0] * self.0 + u[0]]
    }
}

struct Cost;
impl PathFunction<1, 1, 1> for Cost {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [x[0] * x[0] + u[0] * u[0]]
    }
}

impl Plant {
    fn problem(self) -> Ocp {
        let phase = Phase::new("hold", self)
            .states([State::new("x", "m").starts_at(1.0).scaled_by(1.0)])
            .controls([Variable::new("u", "m/s")])
            .integral(Variable::new("cost", "m2 s"), Cost)
            .final_time(Bounds::fixed(END));
        Ocp::builder("unstable plant")
            .phase(phase)
            .minimize_integral("hold", "cost")
            .build()
            .expect("well-posed")
    }

    /// State and its rate.
    fn course(self, t: f64) -> [f64; 2] {
        let w = (self.0 * self.0 + 1.0).sqrt();
        let ratio = (w + self.0) / (w - self.0) * (-w * END).exp();
        let down = 1.0 / (1.0 + ratio * (-w * END).exp());
        let (falling, rising) = (down * (-w * t).exp(), down * ratio * (w * (t - END)).exp());
        [falling + rising, w * (rising - falling)]
    }

    fn push(self, t: f64) -> f64 {
        let [x, rate] = self.course(t);
        rate - self.0 * x
    }

    /// The optimum, its stated states beside it by `error` of the interval.
    fn solution(self, error: impl Fn(usize) -> f64) -> Trajectory {
        let phase = parts::phase(
            "hold",
            &breaks(0.0, END, INTERVALS),
            POINTS,
            |k, t| vec![self.course(t)[0] + error(k)],
            |_, t| vec![self.push(t)],
            |_, t| vec![-2.0 * self.push(t)],
        );
        parts::trajectory(vec![phase], -self.push(0.0))
    }
}

fn from_half_way(error: f64) -> impl Fn(usize) -> f64 {
    move |interval| if interval < INTERVALS / 2 { 0.0 } else { error }
}

fn pieces(certificate: &Certificate) -> Vec<&String> {
    certificate.remarks.iter().filter(|r| r.contains("pieces")).collect()
}

#[test]
fn is_flown_in_pieces_and_verified() {
    let plant = Plant(2.0);
    let trajectory = plant.solution(|_| 0.0);
    // The root of the algebraic Riccati equation.
    assert!((trajectory.objective - (2.0 + 5f64.sqrt())).abs() < f64::EPSILON * 8.0);
    let certificate = certify(&plant.problem(), &trajectory);
    assert_eq!(certificate.verdict, Verdict::GlobalOptimum, "{certificate:#?}");
    assert!(find(&certificate, "joins the re-simulated pieces of hold").passed);
    // ln(1e2) / 2 = 2.3 s each; of growths of e^40 that of the last piece is not counted.
    let remark = pieces(&certificate);
    assert_eq!(remark.len(), 1);
    assert!(
        remark[0].contains("`hold` is re-simulated in 9 pieces: its errors grow up to 1e16 times"),
        "{}",
        remark[0]
    );
}

#[test]
fn what_lies_between_pieces_counts() {
    let plant = Plant(2.0);
    // A piece makes of an error up to a hundred.
    for (error, verdict) in [(LIMIT / 200.0, Verdict::GlobalOptimum), (LIMIT, Verdict::Rejected)] {
        let certificate = certify(&plant.problem(), &plant.solution(from_half_way(error)));
        assert_eq!(certificate.verdict, verdict, "{certificate:#?}");
    }
}

#[test]
fn samples_are_flown_in_pieces_too() {
    let plant = Plant(2.0);
    let control = &plant.solution(|_| 0.0).phases[0].control;
    let at_nodes = |k: usize| control.node_times(k).map(move |t| (t, (k, true)));
    let (mut times, mut nodes): (Vec<f64>, Vec<_>) = (0..INTERVALS).flat_map(at_nodes).unzip();
    times.push(END);
    nodes.push((INTERVALS - 1, false));
    let states = times.iter().map(|t| vec![plant.course(*t)[0]]).collect();
    let controls = times.iter().map(|t| vec![plant.push(*t)]).collect();
    let samples = PhaseSamples { times, states, controls, nodes: Some(nodes) };
    let settings = VerifySettings::default();
    let found = sampled(&plant.problem(), &[samples], &[], None, &settings).expect("fits");
    assert!(found.deviation < settings.path_tolerance, "{}", found.deviation);
    let certificate = certify(&plant.problem(), &found.trajectory);
    assert!(certificate.verdict > Verdict::Rejected && pieces(&certificate).len() == 1, "{certificate:#?}");
}

#[test]
fn a_stable_plant_is_flown_whole() {
    let plant = Plant(-2.0);
    let exact = certify(&plant.problem(), &plant.solution(|_| 0.0));
    assert_eq!(exact.verdict, Verdict::GlobalOptimum, "{exact:#?}");
    let wrong = certify(&plant.problem(), &plant.solution(from_half_way(1e2 * LIMIT)));
    assert_failed(&wrong, &["re-simulated x at the end", "states along hold against", "costate equation"]);
    assert!(pieces(&exact).is_empty() && pieces(&wrong).is_empty());
}

/// A landing craft that hovers by impulses that nobody gives: the speed of each second begins a little higher than the last one ended.
#[test]
fn a_shear_is_no_growth() {
    const GRAVITY: f64 = 1.62;
    const THRUST: f64 = 1.53;
    const SECONDS: usize = 100;
    struct Hover;
    impl Dynamics<2, 1> for Hover {
        fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
            [x[1], u[0] - GRAVITY]
        }
    }
    let end = SECONDS as f64;
    let height = State::new("height", "m").starts_at(0.0).ends_at(0.0).scaled_by(1.0).miss_below(0.1);
    let speed = State::new("speed", "m/s").starts_at(0.0).ends_at(0.0).scaled_by(100.0).miss_below(0.1);
    let phase = Phase::new("hover", Hover)
        .states([height, speed])
        .controls([Variable::new("thrust", "m/s2").within(0.0, 3.0)])
        .integral(parts::energy(), parts::Energy)
        .final_time(Bounds::fixed(end));
    let ocp =
        Ocp::builder("hover").phase(phase).minimize_integral("hover", "energy").build().expect("well-posed");
    let rate = THRUST - GRAVITY;
    let state = |k: usize, t: f64| {
        let since = t - k as f64;
        vec![0.5 * rate * since * (since - 1.0), rate * (since - 0.5)]
    };
    let found =
        parts::phase("hover", &breaks(0.0, end, SECONDS), 3, state, |_, _| vec![THRUST], |_, _| vec![0.0; 2]);
    let certificate = certify(&ocp, &parts::trajectory(vec![found], 0.5 * THRUST * THRUST * end));
    assert_eq!(certificate.verdict, Verdict::Rejected);
    assert!(pieces(&certificate).is_empty(), "{certificate:#?}");
}
