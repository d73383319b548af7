//! Path constraints without controls that touch their bounds in one instant: the turn of Bryson and Denham below a ceiling
//! `l`, with ends of the speed that make it symmetric or not.
//!
//! Closed forms: `apsides_problems::bryson_denham`; without symmetry two cubics `x(0) = 0, x(c) = l, x(1) = 0` whose speed at `c`
//! vanishes and whose second derivatives are equal there, which is one equation for `c`.
#![allow(clippy::unwrap_used)]

use apsides_ad::{PathFunction, Scalar};
use apsides_ocp::{Bounds, Guess, Ocp, Phase, State, Variable};
use apsides_problems::double_integrator::{DoubleIntegrator, Effort};
use apsides_radau::{Radau, RadauSettings, RadauSolution};

/// Discretisation: objectives of polynomials between contacts.
const MESH: f64 = 1e-9;

/// Round-off of a state that a bound holds.
const ROUNDING: f64 = 1e-12;

/// Discretisation: times of a contact, and the objective with an arc.
const CONTACT: f64 = 1e-6;

/// Discretisation: a costate that jumps nearby.
const COSTATE: f64 = 1e-2;

/// `sign * x`.
struct Position {
    sign: f64,
}
impl PathFunction<2, 1, 1> for Position {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 2], _u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [x[0] * self.sign]
    }
}

/// The turn with a final speed, below a ceiling that is an upper bound of `x` or a lower one of `-x`.
fn turn(l: f64, final_speed: f64, upper: bool) -> Ocp {
    let ceiling = Variable::new("ceiling", "-");
    let (ceiling, sign) = if upper { (ceiling.at_most(l), 1.0) } else { (ceiling.at_least(-l), -1.0) };
    let phase = Phase::new("turn", DoubleIntegrator)
        .states([
            State::new("x", "-").within(-1.0, 1.0).starts_at(0.0).ends_at(0.0),
            State::new("v", "-").within(-3.0, 3.0).starts_at(1.0).ends_at(final_speed),
        ])
        .controls([Variable::new("u", "-").within(-20.0, 20.0)])
        .integral(Variable::new("effort", "-"), Effort)
        .path([ceiling], Position { sign })
        .final_time(Bounds::fixed(1.0));
    Ocp::builder("turn").phase(phase).minimize_integral("turn", "effort").build().unwrap()
}

fn solve(ocp: &Ocp, intervals: usize) -> RadauSolution {
    let mut settings = RadauSettings { intervals, ..RadauSettings::default() };
    // Multipliers of the distant bounds add up in the costates.
    settings.nlp.tolerance = 1e-10;
    Radau { settings }.solve(ocp, &Guess::linear(ocp)).unwrap()
}

fn close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found}, expected {expected}");
}

#[test]
fn a_ceiling_touched_in_the_middle() {
    // The ends of the range as well: at 1/6 an arc begins, at 1/4 the ceiling has no effect.
    for (l, upper) in [(1.0 / 6.0, true), (0.17, true), (0.2, true), (0.2, false), (0.24, true), (0.25, true)]
    {
        for intervals in [10, 7] {
            let solution = solve(&turn(l, -1.0, upper), intervals);
            assert!(solution.accurate && solution.meshes.len() <= 5, "{l} {:?}", solution.meshes);
            close(solution.trajectory.objective, 2.0 + 6.0 * (1.0 - 4.0 * l).powi(2), MESH);
            let t = &solution.trajectory.phases[0];
            let rise = 24.0 * (1.0 - 4.0 * l);
            let costate = t.costate.as_ref().unwrap();
            // A multiplier that is zero at an active bound is known to the root of the barrier parameter; where an arc begins, the
            // second derivative of the ceiling vanishes at the contact too, and its place is found to 6e-4 only.
            let tolerance = match l {
                _ if l >= 0.25 => 2e-4,
                _ if l < 0.17 => 1e-5 * rise,
                _ => 1e-6 * rise,
            };
            close(costate.component(0.1, 0), rise, tolerance);
            close(costate.component(0.9, 0), -rise, tolerance);
            if l < 0.25 {
                assert_eq!(t.contacts.len(), 1);
                let (time, sign) = (t.contact_time(&t.contacts[0]), if upper { 1.0 } else { -1.0 });
                close(time, 0.5, if l < 0.17 { 1e-3 } else { 1e-6 });
                close(t.contacts[0].multiplier, sign * 2.0 * rise, 2.0 * tolerance);
                close(t.state_at(time)[0], l, ROUNDING);
            }
        }
    }
}

/// Time of the contact and optimum with another final speed `-w`.
fn without_symmetry(l: f64, w: f64) -> (f64, f64) {
    // Second derivatives of a cubic of length T from (0, v0) to (l, 0): at its ends 6 l / T^2 - 4 v0 / T and 2 v0 / T - 6 l / T^2.
    let ends = |duration: f64, v0: f64| {
        [6.0 * l / duration.powi(2) - 4.0 * v0 / duration, 2.0 * v0 / duration - 6.0 * l / duration.powi(2)]
    };
    let miss = |c: f64| ends(c, 1.0)[1] - ends(1.0 - c, w)[1];
    let (mut low, mut high) = (0.3, 0.7);
    assert!(miss(low) * miss(high) < 0.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if miss(middle) * miss(low) > 0.0 { low = middle } else { high = middle }
    }
    let effort = |duration: f64, v0: f64| {
        let [a, b] = ends(duration, v0);
        duration * (a * a + a * b + b * b) / 6.0
    };
    (low, effort(low, 1.0) + effort(1.0 - low, w))
}

#[test]
fn a_contact_that_no_mesh_knows() {
    for (l, w) in [(0.155, 0.6), (0.17, 0.6), (0.19, 0.6), (0.22, 1.4)] {
        let (time, optimum) = without_symmetry(l, w);
        for intervals in [10, 7] {
            let solution = solve(&turn(l, -w, true), intervals);
            assert!(solution.accurate && solution.meshes.len() <= 6, "{l} {:?}", solution.meshes);
            let t = &solution.trajectory.phases[0];
            assert_eq!(t.contacts.len(), 1, "{l} {:?}", t.contacts);
            close(solution.trajectory.objective, optimum, MESH);
            close(t.contact_time(&t.contacts[0]), time, CONTACT);
        }
    }
}

#[test]
fn an_arc_has_contacts_at_its_ends_or_none() {
    // J = 4 / (9 l); the costate of x is zero along the arc and 2 / (9 l^2) before it.
    let l = 0.15;
    let solution = solve(&turn(l, -1.0, true), 10);
    assert!(solution.accurate);
    close(solution.trajectory.objective, 4.0 / (9.0 * l), CONTACT);
    let costate = solution.trajectory.phases[0].costate.as_ref().unwrap();
    close(costate.component(0.1, 0), 2.0 / (9.0 * l * l), COSTATE);
}
