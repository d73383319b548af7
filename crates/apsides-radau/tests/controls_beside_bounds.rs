//! Controls that come close to a bound and are never pushed against it.
#![allow(clippy::unwrap_used)]

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Guess, Ocp, Phase, State, Variable};
use apsides_radau::Radau;

/// Discretisation: what certificates allow of the slope of the Hamiltonian, whose largest term is near one.
const STATIONARY: f64 = 1e-5;

/// Virus particles, in a day, that a cell makes of what it is infected with.
const BURST: f64 = 7.2;

/// Healthy cells, infected ones and virus under a therapy that keeps infected cells from making virus (D. Kirschner, S. Lenhart, S. Serbin, Journal
/// of Mathematical Biology 35 (1997) 775, doi 10.1007/s002850050076).
struct Infection;
impl Dynamics<3, 1> for Infection {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], u: &[S; 1], _p: &[S; 0]) -> [S; 3] {
        let [healthy, infected, virus] = *x;
        let met = virus * healthy * 2.4e-5;
        let growth = healthy * 0.03 * (-(healthy + infected) / 1500.0 + 1.0);
        let made = infected * BURST * (-u[0] + 1.0);
        [-healthy * 0.02 + growth - met + 10.0, met - infected * 0.3, made - virus * 2.4]
    }
}

/// The cost of the therapy less the healthy cells, in thousands.
struct Cost;
impl PathFunction<3, 1, 1> for Cost {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 3], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0].square() * 0.5 - x[0] * 1e-3]
    }
}

/// The best therapy fades from five thousandths to nothing: the barrier of the bound at zero holds it off by as much.
#[test]
fn what_fades_towards_its_bound_is_where_the_hamiltonian_is_stationary() {
    let state = |name: &str, start: f64, most: f64| State::new(name, "-").within(0.0, most).starts_at(start);
    let phase = Phase::new("therapy", Infection)
        .states([
            state("healthy", 800.0, 2000.0),
            state("infected", 4.0, 1000.0),
            state("virus", 150.0, 5000.0),
        ])
        .controls([Variable::new("u", "-").within(0.0, 0.9)])
        .integral(Variable::new("cost", "-"), Cost)
        .final_time(Bounds::fixed(20.0));
    let ocp = Ocp::builder("therapy").phase(phase).minimize_integral("therapy", "cost").build().unwrap();
    let solution = Radau::default().solve(&ocp, &Guess::linear(&ocp)).unwrap();
    assert!(solution.accurate);
    let found = &solution.trajectory.phases[0];
    let costate = found.costate.as_ref().unwrap();
    let mut largest = 0.0_f64;
    for segment in 0..found.control.segments().len() {
        for t in found.control.node_times(segment) {
            let (mut x, mut u, mut lambda) = ([0.0; 3], [0.0; 1], [0.0; 3]);
            found.state.evaluate_in(segment, t, &mut x);
            found.control.evaluate_in(segment, t, &mut u);
            costate.evaluate_in(segment, t, &mut lambda);
            largest = largest.max((u[0] - lambda[2] * BURST * x[1]).abs());
        }
    }
    assert!(largest < STATIONARY, "{largest:e}");
}
