//! Singular arcs that are none: a jump from bound to bound that a coarse mesh showed as an arc between them.
//!
//! Along such an arc the control costs nothing to first order, and its length next to nothing: it neither vanishes, nor do the costates
//! of its few nodes solve their equation.

use apsides_ocp::ArcKind;

use crate::activity::{CROSSING, Class, NodeSample, Run};
use crate::change::through;

/// Part of its mean slope over the interval beside it that a switching function has at the end of a jump at least. At that of a singular
/// arc it has none: the derivative of the function is continuous there, as the control is not in it, and it is zero along the arc
/// (A. Bryson, Y. Ho, Applied Optimal Control, Hemisphere 1975, chapter 8).
const STRAIGHT: f64 = 0.5;

/// Part of the interval beside it over which the slope at the end of an arc is taken.
const BESIDE: f64 = 0.01;

/// Leaves out singular arcs between opposite bounds, shorter than the intervals beside them, that the switching function crosses.
pub(crate) fn leave_crossed(samples: &[NodeSample], runs: &mut Vec<Run>) {
    let mut k = 1;
    while k + 1 < runs.len() {
        let [before, run, after] = [&runs[k - 1], &runs[k], &runs[k + 1]];
        let is_between = run.class == Class::Between && before.class.opposite(after.class);
        if is_between && is_crossed(samples, run) {
            runs.remove(k);
        } else {
            k += 1;
        }
    }
}

/// Returns true for a run, between two others, that is a singular arc of the mesh and is crossed.
fn is_crossed(samples: &[NodeSample], run: &Run) -> bool {
    let arc = &samples[run.first..=run.last];
    let length: f64 = arc.iter().map(|s| s.width).sum();
    let next = &samples[run.last + 1];
    // The first node of an interval stands at its start.
    arc.iter().all(|s| s.course == Some(ArcKind::Singular))
        && goes_straight(samples, run.first - 1, arc[0].fraction, length)
        && goes_straight(samples, run.last + 1, next.fraction, length)
}

/// Returns true if the switching function goes straight to an end of an arc, in the interval of the node beside it, which is held at a bound
/// and longer than the arc.
fn goes_straight(samples: &[NodeSample], beside: usize, edge: f64, length: f64) -> bool {
    let interval = samples[beside].interval;
    let nodes: Vec<&NodeSample> = samples.iter().filter(|s| s.interval == interval).collect();
    let is_long = nodes.iter().map(|s| s.width).sum::<f64>() > length;
    if nodes.len() <= CROSSING || !is_long || !nodes.iter().all(|s| s.is_held()) {
        return false;
    }
    let far = if nodes[0].fraction < edge { nodes[0] } else { nodes[nodes.len() - 1] };
    let slope_to = |at: f64| {
        let value = |f: f64| through(&nodes, |s| s.slope, f);
        (value(at) - value(edge)) / (at - edge)
    };
    let (mean, here) = (slope_to(far.fraction), slope_to(edge + BESIDE * (far.fraction - edge)));
    here * mean > STRAIGHT * mean.powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A control at its lower bound, along an arc from 0.5 on, and at its upper one, by its switching function.
    fn around_an_arc(length: f64, function: impl Fn(f64) -> f64) -> (Vec<NodeSample>, Vec<Run>) {
        let arcs = [
            (0.3, 0.5, Class::Lower, ArcKind::Lower),
            (0.5, 0.5 + length, Class::Between, ArcKind::Singular),
            (0.5 + length, 0.8, Class::Upper, ArcKind::Upper),
        ];
        let mut samples = Vec::new();
        for (interval, (start, end, class, course)) in arcs.into_iter().enumerate() {
            for place in [0.0, 0.15, 0.5, 0.85] {
                let fraction = start + place * (end - start);
                samples.push(NodeSample {
                    node: samples.len(),
                    fraction,
                    width: 0.25 * (end - start),
                    interval,
                    above_lower: 0.5,
                    below_upper: 0.5,
                    slope: function(fraction),
                    push: function(fraction).abs(),
                    is_concave: true,
                    class,
                    course: Some(course),
                    rests: false,
                });
            }
        }
        let run = |k: usize| Run { class: arcs[k].2, first: 4 * k, last: 4 * k + 3, is_pulse: false };
        (samples, (0..3).map(run).collect())
    }

    #[test]
    fn an_arc_where_the_function_crosses_zero_is_a_jump() {
        let (samples, mut runs) = around_an_arc(1e-3, |f| 0.5005 - f);
        leave_crossed(&samples, &mut runs);
        assert_eq!(runs.iter().map(|r| r.class).collect::<Vec<_>>(), [Class::Lower, Class::Upper]);
    }

    #[test]
    fn an_arc_that_the_function_touches_stays() {
        let touching =
            |length: f64| move |f: f64| (0.5 - f).max(0.0).powi(2) - (f - 0.5 - length).max(0.0).powi(2);
        for length in [1e-3, 0.05] {
            let (samples, mut runs) = around_an_arc(length, touching(length));
            leave_crossed(&samples, &mut runs);
            assert_eq!(runs.len(), 3, "{length}");
        }
        // Longer than the intervals beside it.
        let (samples, mut runs) = around_an_arc(0.25, |f| 0.6 - f);
        leave_crossed(&samples, &mut runs);
        assert_eq!(runs.len(), 3);
    }
}
