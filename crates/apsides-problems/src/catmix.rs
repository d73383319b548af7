//! Catalyst mixing: share of a catalyst along a tubular reactor, bang, singular, bang.
//!
//! ```text
//! minimise x1(1) + x2(1) - 1,   x1' = u (10 x2 - x1),   x2' = u (x1 - 10 x2) - (1 - u) x2
//! 0 <= u <= 1,   x(0) = (1, 0)
//! ```
//!
//! COPS 3.0 (E. Dolan, J. More, T. Munson, ANL/MCS-TM-273, 2004) has -0.0480556. The optimum has a closed form. With
//! `x' = f + u g`, the costates annul `g` and `[f, g] = (-10 x2, x1)` along a singular arc, so that the two are parallel:
//! `x1^2 - 20 x1 x2 + 90 x2^2 = 0`, a ray `x2 = r x1`, which `u` must follow:
//!
//! ```text
//! r = (10 - sqrt 10)/90,   u = r/(1 - 8 r - 10 r^2) = 0.227142,   t1 = ln((1 + r)/(1 - 10 r))/11 = 0.136299
//! t2 = 1 + ln(10 r) = 0.725230,   x1(1) = (10 + (1 - 10 r)/(1 + r))/11 exp(u (10 r - 1) (t2 - t1))
//! J = x1(1) (1 + 10 r^2) - 1 = -0.0480556858608775
//! ```
//!
//! `u = 1` until `t1`, where the ray is met; `u = 0` from `t2`, where the costates are `(1, 10 r)`.
//!
//! [`PROBLEM`] is the statement as it stands. Radau collocation with the start of each interval as a point overestimates
//! it: -0.0480936 with 40 intervals of 8 points, -0.0480839 with 200 of 3. The control chatters between its bounds along
//! the arc. This is no better control: integrated with it, within its bounds, the states give -0.0477627. With `A` and `b` the
//! coefficients of the rule, a change `v` of the controls of an interval of length `h` changes the discrete objective by
//! `h^2 (l^T g_x g) v^T M v / 2` plus terms of third order, `M_ij = b_i a_ij + b_j a_ji - b_i b_j`. The product
//! `l^T g_x g` is positive along the arc. `M` vanishes for Gauss points, as in COPS; it is negative semidefinite for Radau
//! points with the start of the interval and positive semidefinite for those with its end. The gain of an interval is of
//! the order of `h^2` over the number of its points, that of a mesh the inverse of the number of all points. Once the arc is
//! found, controls of one degree less take the chattering away (`switches` of `apsides-radau`).
//!
//! [`REVERSED`] is the same statement from the outlet to the inlet, `s = 1 - t`. The points then include the end of each
//! interval in the sense of the flow, and chattering costs. [`ARCS`] states the three arcs as phases without control and
//! leaves their ends free; on the middle one `u` is the feedback that keeps the direction of `x` where `g` and `[f, g]`
//! are parallel: `u = 10 (x1 - 9 x2) x2 / ((x1 - 10 x2)^2 + 10 (x1 - 9 x2)^2)`.
//!
//! Guess: the inlet, `u = 1/2`.

use apsides_ad::{Dynamics, Scalar, VectorFunction};
use apsides_ocp::{At, Bounds, Ocp, OcpBuilder, OcpError, Phase, Sense, State, Term, Variable};

use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem as stated.
pub const PROBLEM: Problem = Problem {
    name: "catmix",
    title: "mixing of two catalysts along a reactor",
    structure: Structure::Singular,
    optimum: OPTIMUM,
    pose,
};

/// The problem from the outlet of the reactor to its inlet.
pub const REVERSED: Problem = Problem {
    name: "catmix_reversed",
    title: "mixing of two catalysts, from the outlet to the inlet",
    structure: Structure::Singular,
    optimum: OPTIMUM,
    pose: pose_reversed,
};

/// The problem with its three arcs as phases.
pub const ARCS: Problem = Problem {
    name: "catmix_arcs",
    title: "mixing of two catalysts: where the three arcs end",
    structure: Structure::Smooth,
    optimum: OPTIMUM,
    pose: pose_arcs,
};

const OPTIMUM: Optimum = Optimum {
    value: -0.048_055_685_860_877_5,
    unit: "-",
    relative_tolerance: 1e-6,
    evidence: Evidence::ClosedForm,
    source: "bang, singular, bang; statement: COPS 3.0",
};

/// `x'` for a share of the first catalyst.
fn reaction<S: Scalar>(x: &[S; 2], share: S) -> [S; 2] {
    let exchange = share * (x[1] * 10.0 - x[0]);
    [exchange, -exchange - (-share + 1.0) * x[1]]
}

/// The reactor along the flow, or against it.
struct Reactor {
    direction: f64,
}

impl Dynamics<2, 1> for Reactor {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        reaction(x, u[0]).map(|rate| rate * self.direction)
    }
}

/// The condition that decides the share of the first catalyst along an arc.
enum Arc {
    Bound(f64),
    Singular,
}

impl Dynamics<2, 0> for Arc {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], _u: &[S; 0], _p: &[S; 0]) -> [S; 2] {
        let share = match self {
            Self::Bound(share) => S::from(*share),
            Self::Singular => {
                let (nine, ten) = (x[0] - x[1] * 9.0, x[0] - x[1] * 10.0);
                nine * x[1] * 10.0 / (ten.square() + nine.square() * 10.0)
            }
        };
        reaction(x, share)
    }
}

struct Remainder;

impl VectorFunction<2, 1> for Remainder {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
        [z[0] + z[1] - 1.0]
    }
}

fn states() -> [State; 2] {
    ["x1", "x2"].map(|name| State::new(name, "-").within(0.0, 1.0))
}

fn states_from_inlet() -> [State; 2] {
    let [x1, x2] = states();
    [x1.starts_at(1.0), x2.starts_at(0.0)]
}

fn single_phase(direction: f64, states: [State; 2]) -> Phase {
    Phase::new("reactor", Reactor { direction })
        .states(states)
        .controls([Variable::new("u", "-").within(0.0, 1.0)])
        .final_time(Bounds::fixed(1.0))
        .time_unit("-")
}

/// The problem of some phases with the objective at the outlet.
fn least_remainder(builder: OcpBuilder, outlet: [At<'_>; 2]) -> Result<Case, OcpError> {
    let remainder = Term::function(outlet, Remainder);
    let ocp =
        builder.objective(Sense::Minimize, "remainder", "-", [remainder]).objective_scale(0.05).build()?;
    Ok(Case::from_bounds(ocp))
}

fn pose() -> Result<Case, OcpError> {
    let phase = single_phase(1.0, states_from_inlet());
    let outlet = [At::FinalState("reactor", "x1"), At::FinalState("reactor", "x2")];
    least_remainder(Ocp::builder(PROBLEM.name).phase(phase), outlet)
}

fn pose_reversed() -> Result<Case, OcpError> {
    let [x1, x2] = states();
    let phase = single_phase(-1.0, [x1.ends_at(1.0), x2.ends_at(0.0)]);
    let outlet = [At::InitialState("reactor", "x1"), At::InitialState("reactor", "x2")];
    least_remainder(Ocp::builder(REVERSED.name).phase(phase), outlet)
}

fn pose_arcs() -> Result<Case, OcpError> {
    let phase = |name: &str, arc: Arc| Phase::new(name, arc).states(states()).time_unit("-");
    let first = phase("first catalyst", Arc::Bound(1.0))
        .states(states_from_inlet())
        .final_time(Bounds::new(0.01, 0.5));
    let mixed =
        phase("mixed", Arc::Singular).initial_time(Bounds::new(0.01, 0.5)).final_time(Bounds::new(0.5, 0.99));
    let second = phase("second catalyst", Arc::Bound(0.0))
        .initial_time(Bounds::new(0.5, 0.99))
        .final_time(Bounds::fixed(1.0));
    let builder = Ocp::builder(ARCS.name)
        .phase(first)
        .phase(mixed)
        .phase(second)
        .link("first catalyst", "mixed")
        .link("mixed", "second catalyst");
    let outlet = [At::FinalState("second catalyst", "x1"), At::FinalState("second catalyst", "x2")];
    least_remainder(builder, outlet)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-15;

    #[test]
    fn the_optimum_is_that_of_the_closed_form() {
        let r = (10.0 - 10.0_f64.sqrt()) / 90.0;
        let u = r / (1.0 - 8.0 * r - 10.0 * r * r);
        let decay = (1.0 - 10.0 * r) / (1.0 + r);
        let (t1, t2) = (-decay.ln() / 11.0, 1.0 + (10.0 * r).ln());
        let x1 = (10.0 + decay) / 11.0 * (u * (10.0 * r - 1.0) * (t2 - t1)).exp();
        let objective = x1 * (1.0 + 10.0 * r * r) - 1.0;
        assert!((objective - OPTIMUM.value).abs() < ROUNDING);
        // On the ray the feedback is the constant share, and the direction of the state stays.
        let rate = Arc::Singular.rate(0.0, &[1.0, r], &[], &[]);
        let constant = reaction(&[1.0, r], u);
        assert!((rate[0] - constant[0]).abs() < ROUNDING && (rate[1] - r * rate[0]).abs() < ROUNDING);
    }
}
