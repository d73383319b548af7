//! Arcs along the bound of a path constraint row of order two, by the first rate of the row.
//!
//! The equations of motion and the row make differential-algebraic equations of index three along such an arc: at the points the control is a second
//! derivative of the row, and so are the errors of control and multiplier (Hairer, Wanner, Solving Ordinary Differential Equations II, section
//! VI.1). So the points have the first rate of the row, `g' = 0`, and the end of the arc the row itself: the index is two. With the multiplier `pi`
//! of the rate per unit of time the integral of `pi g'` is that of `-pi' g` and `pi g` between the ends (Hartl, Sethi, Vickson, SIAM Review 37 (1995)
//! 181, section 7, doi 10.1137/1037043): the multiplier of the row is `-pi'` along the arc, with impulses `-pi` at its start and `pi` at its
//! end, and the costates are those of the program with `pi dg/dx` added.

use std::sync::{Arc, Mutex, PoisonError};

use apsides_ad::trace::OpaqueFunction;
use apsides_ad::{Formula, NodeFunction, NodePattern};
use apsides_basis::{Barycentric, Gauss};
use apsides_ocp::{Contact, Phase, PhaseTrajectory};

use crate::junction::{RateArc, slopes_by_states};
use crate::layout::CollocationPhase;
use crate::row_rate::RowRate;

/// Impulses within this part of an arc before its start and behind its end are those of its ends.
const NEAR: f64 = 1e-3;

/// Points of the rule that integrates a density from one point to the next.
const BETWEEN: usize = 3;

/// The first rate of an output of a path function.
pub(crate) fn rate(
    phase: &Phase,
    function: &Arc<dyn NodeFunction>,
    output: usize,
    step: f64,
) -> Option<Arc<dyn NodeFunction>> {
    let rate = RowRate::new(function, output, &phase.dynamics)?;
    Some(Arc::new(rate.with_bends(step)))
}

/// The function with zeros for some of its outputs.
pub(crate) fn without(function: &Arc<dyn NodeFunction>, outputs: Vec<usize>) -> Arc<dyn NodeFunction> {
    if outputs.is_empty() { Arc::clone(function) } else { Arc::new(Without::new(function, outputs)) }
}

/// A function with zeros for some of its outputs.
struct Without {
    function: Arc<dyn NodeFunction>,
    outputs: Vec<usize>,
    pattern: NodePattern,
    /// The entries of the Jacobian that are left.
    kept: Vec<usize>,
    /// All entries of the Jacobian, and weights of the outputs.
    work: Mutex<(Vec<f64>, Vec<f64>)>,
}

impl Without {
    fn new(function: &Arc<dyn NodeFunction>, outputs: Vec<usize>) -> Self {
        let whole = function.pattern();
        let is_kept = |k: &usize| {
            let row = whole.row_offsets.partition_point(|first| first <= k) - 1;
            !outputs.contains(&row)
        };
        let kept: Vec<usize> = (0..whole.jacobian_len()).filter(is_kept).collect();
        let row_offsets = whole.row_offsets.iter().map(|first| kept.partition_point(|k| k < first)).collect();
        let columns = kept.iter().map(|k| whole.columns[*k]).collect();
        let pattern = NodePattern { row_offsets, columns, hessian: whole.hessian.clone() };
        let work = (vec![0.0; whole.jacobian_len()], vec![0.0; function.outputs()]);
        Self { function: Arc::clone(function), outputs, pattern, kept, work: work.into() }
    }

    fn clear(&self, values: &mut [f64]) {
        self.outputs.iter().for_each(|k| values[*k] = 0.0);
    }
}

impl NodeFunction for Without {
    fn inputs(&self) -> usize {
        self.function.inputs()
    }

    fn outputs(&self) -> usize {
        self.function.outputs()
    }

    fn pattern(&self) -> &NodePattern {
        &self.pattern
    }

    fn value(&self, z: &[f64], out: &mut [f64]) {
        self.function.value(z, out);
        self.clear(out);
    }

    fn jacobian(&self, z: &[f64], out: &mut [f64], entries: &mut [f64]) {
        let (whole, _) = &mut *self.work.lock().unwrap_or_else(PoisonError::into_inner);
        self.function.jacobian(z, out, whole);
        self.clear(out);
        entries.iter_mut().zip(&self.kept).for_each(|(entry, k)| *entry = whole[*k]);
    }

    fn hessian(&self, z: &[f64], weights: &[f64], entries: &mut [f64]) {
        let (_, own) = &mut *self.work.lock().unwrap_or_else(PoisonError::into_inner);
        own.copy_from_slice(weights);
        self.clear(own);
        self.function.hessian(z, own, entries);
    }

    fn formula(&self) -> Result<Formula, OpaqueFunction> {
        Err(OpaqueFunction { name: "path constraints along an arc".into() })
    }
}

/// Multipliers of the rate of a row per unit of time, over one interval of an arc along its bound.
struct RateMultipliers {
    basis: Barycentric,
    values: Vec<f64>,
    /// Half of the duration of the interval.
    half: f64,
}

impl RateMultipliers {
    fn new(p: &CollocationPhase, x: &[f64], y: &[f64], interval: usize, row: usize) -> Option<Self> {
        let (first, rule) = (p.interval_start(interval), &p.rules[interval]);
        let duration = p.arc_duration(p.arc_of(first), x);
        let values = (first..first + rule.points())
            .map(|node| y[p.path_row(node) + row] / (p.nodes[node].weight * duration));
        let half = 0.5 * p.nodes[first].width * duration;
        Some(Self { basis: Barycentric::new(rule.nodes()).ok()?, values: values.collect(), half })
    }

    /// The multiplier at a place between -1 and 1.
    fn at(&self, place: f64) -> f64 {
        let mut value = [0.0];
        self.basis.evaluate_all(&self.values, place, &mut value);
        value[0]
    }

    fn density(&self, place: f64) -> f64 {
        let mut slope = [0.0];
        self.basis.derivative_all(&self.values, place, &mut slope);
        -slope[0] / self.half
    }
}

/// The multiplier of a row per unit of time at a node of an arc that has its rate.
pub(crate) fn density(p: &CollocationPhase, x: &[f64], y: &[f64], node: usize, row: usize) -> f64 {
    let n = &p.nodes[node];
    let along = RateMultipliers::new(p, x, y, n.interval, row);
    along.map_or(f64::NAN, |along| along.density(p.rules[n.interval].nodes()[n.local]))
}

/// The multiplier of the rate of a row per unit of time at a place, from -1 to 1, of an interval of such an arc.
pub(crate) fn of_rate(
    p: &CollocationPhase,
    x: &[f64],
    y: &[f64],
    (interval, place): (usize, f64),
    row: usize,
) -> f64 {
    RateMultipliers::new(p, x, y, interval, row).map_or(f64::NAN, |along| along.at(place))
}

/// Adds to the costates at the support points of an interval what the row makes of them along such arcs.
pub(crate) fn add_to_costates(
    phase: &Phase,
    p: &CollocationPhase,
    x: &[f64],
    y: &[f64],
    (interval, first_parameter): (usize, usize),
    costates: &mut [f64],
) {
    let first = p.interval_start(interval);
    for arc in p.rate_arcs.iter().filter(|a| (a.ends[0]..a.ends[1]).contains(&interval)) {
        let Some(along) = RateMultipliers::new(p, x, y, interval, arc.row) else { continue };
        for (j, place) in p.rules[interval].support().iter().enumerate() {
            let node = first + j;
            // The end of an arc is a node of the next one, at the same time.
            let state = &x[p.state_column(node)..][..p.states];
            let time = if node < p.nodes.len() { p.time(node, x) } else { x[p.ends.final_time] };
            let parameters = x.get(first_parameter..).unwrap_or_default();
            let slopes = slopes_by_states(phase, arc.row, (state, parameters, time));
            let multiplier = along.at(*place);
            let own = &mut costates[j * p.states..(j + 1) * p.states];
            own.iter_mut().zip(slopes).for_each(|(l, g)| *l += multiplier * g);
        }
    }
}

/// Says whether a contact of a trajectory belongs to such an arc.
pub(crate) fn is_of(p: &CollocationPhase, arc: &RateArc, t: &PhaseTrajectory, contact: &Contact) -> bool {
    let [start, end] = arc.ends.map(|end| t.time_at(p.mesh.fractions()[end]));
    let near = NEAR * (end - start);
    arc.row == contact.row && (start - near..=end + near).contains(&t.contact_time(contact))
}

/// Puts the multipliers of a trajectory into those of the rates: `pi` is what is left of the impulse and of the integral of the density.
pub(crate) fn set_multipliers(
    phase: &Phase,
    p: &CollocationPhase,
    t: &PhaseTrajectory,
    x: &[f64],
    y: &mut [f64],
) {
    let Some(path) = t.path_multipliers.as_ref().filter(|m| m.dimension() == p.rows_per_node - p.states)
    else {
        return;
    };
    let Ok(rule) = Gauss::shared(BETWEEN) else { return };
    let mut multipliers = vec![0.0; path.dimension()];
    for arc in &p.rate_arcs {
        let nodes = p.arcs[arc.arc].nodes.clone();
        let time = |node: usize| t.time_at(p.nodes.get(node).map_or(1.0, |n| n.fraction));
        let [start, end] = arc.ends.map(|end| t.time_at(p.mesh.fractions()[end]));
        let impulses = |until: f64| -> f64 {
            let own = t.contacts.iter().filter(|c| is_of(p, arc, t, c));
            own.filter(|c| t.contact_time(c) <= until).map(|c| c.multiplier).sum()
        };
        let (mut from, mut integral) = (start, 0.0);
        let mut advance = |to: f64| {
            for (place, weight) in rule.nodes().iter().zip(rule.weights()) {
                path.evaluate(from + 0.5 * (to - from) * (place + 1.0), &mut multipliers);
                integral += 0.5 * (to - from) * weight * multipliers[arc.row];
            }
            from = to;
            integral
        };
        let mut state = vec![0.0; p.states];
        for node in nodes.clone() {
            let multiplier = -(advance(time(node)) + impulses(time(node)));
            y[p.path_row(node) + arc.row] = multiplier * p.nodes[node].weight * p.arc_duration(arc.arc, x);
            t.state.evaluate(time(node), &mut state);
            let slopes = slopes_by_states(phase, arc.row, (&state, &[], time(node)));
            let weight = p.rules[p.nodes[node].interval].weights()[p.nodes[node].local];
            // Without the parameters there may be no slopes.
            for (s, slope) in slopes.iter().enumerate().filter(|(_, slope)| slope.is_finite()) {
                y[p.defect_row(node) + s] += weight * multiplier * slope;
            }
        }
        if nodes.end < p.nodes.len() {
            y[p.path_row(nodes.end) + arc.row] = advance(end) + impulses(f64::INFINITY);
        }
    }
}

#[cfg(test)]
mod tests {
    use apsides_ad::{PathFunction, Scalar, path_node};

    use super::*;

    /// `x v`, `x^2 + u` and `v^3`.
    struct Rows;

    impl PathFunction<2, 1, 3> for Rows {
        fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 3] {
            [x[0] * x[1], x[0].square() + u[0], x[1] * x[1].square()]
        }
    }

    #[test]
    fn outputs_that_are_left_out_are_zero_with_all_derivatives() {
        let whole = path_node(Rows);
        let rest = without(&whole, vec![1]);
        let z = [2.0, 3.0, 5.0, 0.0];
        let (mut values, mut entries) = ([0.0; 3], vec![0.0; rest.pattern().jacobian_len()]);
        rest.jacobian(&z, &mut values, &mut entries);
        assert_eq!(values, [6.0, 0.0, 27.0]);
        assert_eq!(
            (&rest.pattern().row_offsets[..], &rest.pattern().columns[..]),
            (&[0, 2, 2, 3][..], &[0, 1, 1][..])
        );
        assert_eq!(entries, [3.0, 2.0, 27.0]);
        let mut bends = vec![0.0; rest.pattern().hessian_len()];
        rest.hessian(&z, &[1.0, 7.0, 1.0], &mut bends);
        let of = |pair| rest.pattern().hessian.iter().position(|p| *p == pair).map(|k| bends[k]);
        assert_eq!([of((0, 0)), of((1, 0)), of((1, 1))], [Some(0.0), Some(1.0), Some(18.0)]);
        let mut again = [1.0; 3];
        rest.value(&z, &mut again);
        assert_eq!(again, values);
    }
}
