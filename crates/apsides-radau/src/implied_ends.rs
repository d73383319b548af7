//! Final states that the motion implies: an attitude quaternion that ends at given values of all four components says one of them twice.
//!
//! Where the motion keeps a function (see [`crate::invariants`]) whose states are all fixed at both ends of a phase, one final state follows from
//! the others. Collocation keeps quadratic functions to the error of its mesh alone, so that such ends contradict each other a little; their
//! multipliers are not unique. So the final state that depends on the others most clearly is free, on its side of the other value that the
//! function allows.

use apsides_ocp::{Bounds, Ocp, Phase};

use crate::invariants::{Monomial, Terms, kept, scales};

/// A function has the same value at both ends within this, relative to its terms.
const KEPT: f64 = 1e-9;
/// Least part of its terms by which a function changes with a final state that follows from it, per scale of the state.
const CLEAR: f64 = 1e-2;
/// A final value this close to a bound along the phase, relative to the scale of its state, is at it: there the bound holds it as well.
const AT_BOUND: f64 = 1e-6;

/// A final state that follows from others.
#[derive(Debug, PartialEq)]
pub(crate) struct ImpliedEnd {
    pub(crate) state: usize,
    /// Its value and scale.
    pub(crate) value: f64,
    pub(crate) scale: f64,
    /// On the side of the other value that the function allows.
    pub(crate) side: Bounds,
}

/// The final states of a phase that follow from the others.
pub(crate) fn implied_ends(ocp: &Ocp, phase: &Phase) -> Vec<ImpliedEnd> {
    let is_fixed = |s: &usize| phase.states[*s].initial.is_fixed() && phase.states[*s].terminal.is_fixed();
    let fixed: Vec<usize> = (0..phase.states.len()).filter(is_fixed).collect();
    if fixed.is_empty() {
        return Vec::new();
    }
    let scales = scales(phase);
    let found = kept(ocp, phase, &scales, &fixed);
    let at = |end: fn(&Phase, usize) -> f64| -> Vec<f64> {
        scales.iter().enumerate().map(|(s, scale)| end(phase, s) / scale).collect()
    };
    let start = at(|phase, s| phase.states[s].initial.lower);
    let end = at(|phase, s| phase.states[s].terminal.lower);
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let mut implied: Vec<ImpliedEnd> = Vec::new();
    for terms in found.linear.iter().chain(&found.quadratic) {
        let size = terms.iter().map(|term| value(term, &end).abs()).fold(0.0, f64::max);
        let change: f64 = terms.iter().map(|term| value(term, &end) - value(term, &start)).sum();
        if change.abs() > KEPT * size {
            continue;
        }
        let mut slopes = slopes(terms, &end);
        // The part of it that says nothing about those that follow already.
        for (row, done) in rows.iter().zip(&implied) {
            let factor = slopes[done.state] / row[done.state];
            slopes.iter_mut().zip(row).for_each(|(slope, other)| *slope -= factor * other);
        }
        let is_away = |s: &usize| {
            let Bounds { lower, upper } = phase.states[*s].variable.bounds;
            let (value, room) = (phase.states[*s].terminal.lower, AT_BOUND * scales[*s]);
            value - room > lower && value + room < upper
        };
        let is_new = |s: &usize| implied.iter().all(|done| done.state != *s);
        let candidates = fixed.iter().copied().filter(|s| is_new(s) && is_away(s));
        let clearest = candidates.max_by(|a, b| slopes[*a].abs().total_cmp(&slopes[*b].abs()));
        let Some(state) = clearest.filter(|s| slopes[*s].abs() > CLEAR * size) else { continue };
        let (value, scale) = (phase.states[state].terminal.lower, scales[state]);
        implied.push(ImpliedEnd { state, value, scale, side: side(terms, &end, state, scale) });
        rows.push(slopes);
    }
    implied
}

/// The value of a term.
fn value(&((first, second), c): &(Monomial, f64), x: &[f64]) -> f64 {
    c * x[first] * second.map_or(1.0, |j| x[j])
}

/// The derivatives of a function.
fn slopes(terms: &Terms, x: &[f64]) -> Vec<f64> {
    let mut slopes = vec![0.0; x.len()];
    for ((first, second), c) in terms {
        slopes[*first] += c * second.map_or(1.0, |j| x[j]);
        if let Some(j) = second {
            slopes[*j] += c * x[*first];
        }
    }
    slopes
}

/// The values of a state that are closer to that at the end than to the other one that the function allows.
fn side(terms: &Terms, end: &[f64], state: usize, scale: f64) -> Bounds {
    let square: f64 =
        terms.iter().filter(|((i, j), _)| (*i, *j) == (state, Some(state))).map(|(_, c)| c).sum();
    if square == 0.0 {
        return Bounds::FREE;
    }
    // The middle between both is where the derivative vanishes.
    let middle = end[state] - slopes(terms, end)[state] / (2.0 * square);
    if end[state] > middle { Bounds::at_least(middle * scale) } else { Bounds::at_most(middle * scale) }
}

#[cfg(test)]
mod tests {
    use apsides_ad::{Dynamics, Scalar};
    use apsides_ocp::{At, State, Variable};

    use super::*;

    /// Middles between two roots are found by a division.
    const ROUND: f64 = 1e-12;

    /// A vector of constant length, and a state with half the rate of its first component.
    struct Turn;

    impl Dynamics<3, 1> for Turn {
        fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], u: &[S; 1], _p: &[S; 0]) -> [S; 3] {
            [-x[1] * u[0], x[0] * u[0], -x[1] * u[0] * 0.5]
        }
    }

    fn turn(ends: [f64; 3]) -> Ocp {
        let state = |name: &str, start: f64, end: f64| State::new(name, "m").starts_at(start).ends_at(end);
        let phase = Phase::new("turn", Turn)
            .states([state("c", 2.0, ends[0]), state("s", 0.0, ends[1]), state("half", 1.0, ends[2])])
            .controls([Variable::new("w", "rad/s").within(-1.0, 1.0)])
            .final_time(Bounds::new(0.0, 9.0));
        let built = Ocp::builder("turn").phase(phase).minimize("time", "s", At::FinalTime("turn")).build();
        built.unwrap()
    }

    #[test]
    fn one_end_follows_from_each_function_that_is_kept() {
        // Half of c less half: linear. Then c^2 + s^2, of which s is left.
        let ocp = turn([1.2, -1.6, 0.6]);
        let found = implied_ends(&ocp, &ocp.phases[0]);
        let [linear, quadratic] = &found[..] else { panic!("{found:?}") };
        assert!([0, 2].contains(&linear.state) && linear.side == Bounds::FREE, "{found:?}");
        assert_eq!(quadratic.state, 1);
        assert!(
            quadratic.side.upper.abs() <= ROUND && quadratic.side.lower == f64::NEG_INFINITY,
            "{found:?}"
        );
    }

    #[test]
    fn ends_that_are_out_of_reach_are_left() {
        let ocp = turn([1.2, -1.7, 0.7]);
        assert_eq!(implied_ends(&ocp, &ocp.phases[0]), []);
    }
}
