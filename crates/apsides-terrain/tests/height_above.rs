//! A flight over a slope with its height above the map as a path constraint, against a closed form.
#![allow(clippy::unwrap_used)]

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Guess, Ocp, Phase, State, Variable};
use apsides_radau::Radau;
use apsides_terrain::interpolation::{HeightAbove, PositionStates, Smoothness, Surface};
use apsides_terrain::{ElevationMap, Geometry};

/// Relative agreement of a refined mesh with the closed form.
const MESH: f64 = 1e-6;
/// Speed to the east, m/s.
const SPEED: f64 = 100.0;
/// Rise of the ground to the east; with the pixel below, heights are exact numbers.
const SLOPE: f64 = 0.125;
const PIXEL: f64 = 8.0;

/// Discretisation: the least height between the nodes, on samples, m.
const LEAST_M: f64 = 1e-4;

/// `east' = 100 m/s, north' = 0, up' = v, v' = a`.
struct Overflight;

impl Dynamics<4, 1> for Overflight {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 4], u: &[S; 1], _p: &[S; 0]) -> [S; 4] {
        [S::from(SPEED), S::from(0.0), x[3], u[0]]
    }
}

/// `a^2 / 2`.
struct Effort;

impl PathFunction<4, 1, 1> for Effort {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 4], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0].square() * 0.5]
    }
}

/// In the height above the slope this is the problem of Bryson and Denham with the ceiling `l`, upside down: 2 + 6 (1 - 4 l)^2 where it is
/// touched in one instant, `1/6 <= l <= 1/4` (A. E. Bryson, W. Denham, S. Dreyfus, AIAA Journal 1 (1963) 2544, doi 10.2514/3.2107).
#[test]
fn least_effort_over_a_slope() {
    const LEAST: f64 = 0.2;
    let geometry = Geometry::square(5, 20, PIXEL).unwrap();
    let height = |k: usize| SLOPE * geometry.position((k / 20) as f64, (k % 20) as f64)[0];
    let heights: Vec<f64> = (0..100).map(height).collect();
    let map = ElevationMap::from_heights(geometry, &heights).unwrap();
    let surface = Surface::new(&map, Smoothness::C2).unwrap();
    let rise = SLOPE * SPEED;
    let phase = Phase::new("overflight", Overflight)
        .states([
            State::new("east", "m").within(0.0, 150.0).starts_at(0.0),
            State::new("north", "m").within(-32.0, 0.0).starts_at(-16.0),
            State::new("up", "m").within(-10.0, 30.0).starts_at(0.0).ends_at(rise),
            State::new("climb", "m/s").within(-50.0, 50.0).starts_at(rise - 1.0).ends_at(rise + 1.0),
        ])
        .controls([Variable::new("acceleration", "m/s2").within(-50.0, 50.0)])
        .final_time(Bounds::fixed(1.0))
        .integral(Variable::new("effort", "m2/s3"), Effort)
        .path::<_, 4, 1, 1, 0>(
            [Variable::new("height above the map", "m").at_least(-LEAST)],
            HeightAbove::new(surface.clone(), PositionStates([0, 1, 2])),
        );
    let ocp =
        Ocp::builder("overflight").phase(phase).minimize_integral("overflight", "effort").build().unwrap();
    let solved = Radau::default().solve(&ocp, &Guess::linear(&ocp)).unwrap();
    assert!(solved.status.is_success());
    let expected = 2.0 + 6.0 * (1.0_f64 - 4.0 * LEAST).powi(2);
    let found = solved.trajectory.objective;
    assert!((found / expected - 1.0).abs() < MESH, "{found} instead of {expected}");
    let flight = &solved.trajectory.phases[0];
    let least = (0..=1000)
        .map(|k| {
            let mut x = [0.0; 4];
            flight.state.evaluate(f64::from(k) / 1000.0, &mut x);
            x[2] - surface.height_at([x[0], x[1]]).unwrap()
        })
        .fold(f64::INFINITY, f64::min);
    assert!((least + LEAST).abs() < LEAST_M, "{least}");
}
