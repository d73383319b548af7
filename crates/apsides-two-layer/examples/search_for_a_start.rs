//! A vertical landing whose start is searched: thrust profiles of two constant pieces are flown by the hundred, and collocation finishes
//! from the best of them.
//!
//! ```sh
//! cargo run -p apsides-two-layer --example search_for_a_start
//! ```
#![allow(clippy::print_stdout)]

use apsides_ad::{Dynamics, Scalar};
use apsides_metaheuristics::Search;
use apsides_ocp::{At, Bounds, Guess, Method, Ocp, Phase, Start, State, Variable};
use apsides_radau::Radau;
use apsides_shooting::profile::{Independent, Steering};
use apsides_two_layer::{ProfileModel, TwoLayer, TwoLayerSettings};

struct Fall;

impl Dynamics<2, 1> for Fall {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0] - 1.62] // height, speed
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let phase = Phase::new("fall", Fall)
        .states([
            State::new("height", "m").within(-1.0, 200.0).starts_at(100.0).ends_at(0.0),
            State::new("speed", "m/s").within(-60.0, 60.0).starts_at(0.0).ends_at(0.0),
        ])
        .controls([Variable::new("thrust", "m/s2").within(0.0, 3.24)])
        .final_time(Bounds::new(1.0, 60.0));
    let ocp = Ocp::builder("landing").phase(phase).minimize("time", "s", At::FinalTime("fall")).build()?;
    let method = TwoLayer {
        settings: TwoLayerSettings {
            search: Search { budget: 300, ..Search::default() },
            degree: 0,
            least_intervals: 2,
            most_intervals: 2,
            ..TwoLayerSettings::default()
        },
        profile: ProfileModel {
            independent: Independent::Time,
            bounds: vec![Bounds::new(0.0, 3.24)],
            steering: Steering::Controls,
            stop: "height".into(),
            distance_per_unit: vec![1.0, 1.0],
        },
        second: Box::new(Radau::default()),
        checkpoint: None,
    };
    let solution = method.solve(&ocp, &Start::new(Guess::linear(&ocp)), &mut ())?;
    let search = solution.search.as_ref().ok_or("no search")?;
    println!("search: {} flights, best objective {:?}", search.evaluations, search.objective);
    // Free fall down to half the height, then twice the gravity upwards.
    let closed = 2.0 * (100.0_f64 / 1.62).sqrt();
    println!("time {:.6} s, closed form {closed:.6} s, {}", solution.trajectory.objective, solution.word());
    Ok(())
}
