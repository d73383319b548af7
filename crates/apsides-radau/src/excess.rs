//! The excess of bounds and path rows between the nodes.

use apsides_ocp::{PathConstraint, Phase, PhaseScaling, PhaseTrajectory, Variable};

use crate::RadauError;
use crate::along::Along;

/// The larger of two errors; a NaN counts as largest.
pub(crate) fn raise(error: &mut f64, found: f64) {
    *error = if found <= *error { *error } else { found };
}

/// Largest excess of bounds and path rows in an interval, relative to their scales.
#[derive(Clone, Copy, Default)]
pub(crate) struct Excess {
    /// The error of states and of rows without controls.
    pub(crate) of_states: f64,
    /// The excess of rows in the two intervals beside their touch points, which a better place of these removes first.
    pub(crate) beside_touch: f64,
    /// The excess of bounds on controls and of path constraints with controls, equalities among them.
    pub(crate) of_controls: f64,
}

/// Path constraints with the number of their first row, and room for their values at the points.
type Rows<'a> = Vec<(usize, &'a PathConstraint, Vec<f64>)>;

/// The excess in each interval half way between neighbouring nodes: there a polynomial strays farthest. That of controls is
/// looked at where switches are located, and at both ends of the interval too: the control has no node at the end, and along an arc
/// that has left its bounds out the node at the start may be beyond them.
pub(crate) fn excesses(
    phase: &Phase,
    scales: &PhaseScaling,
    parameters: &[f64],
    p: &PhaseTrajectory,
    with_controls: bool,
) -> Result<Vec<Excess>, RadauError> {
    let (mut with, mut without) = rows(phase);
    let is_bounded = |v: &Variable| v.bounds.lower.is_finite() || v.bounds.upper.is_finite();
    let looks_at_states = !without.is_empty() || phase.states.iter().any(|s| is_bounded(&s.variable));
    let looks_at_controls = with_controls && (!with.is_empty() || phase.controls.iter().any(is_bounded));
    let mut excesses = vec![Excess::default(); p.mesh.intervals()];
    if !looks_at_states && !looks_at_controls {
        return Ok(excesses);
    }
    let mut along = Along::new(phase, p, parameters, |k| {
        let nodes = p.state.segments()[k].basis.nodes();
        let middles = nodes.windows(2).map(|w| 0.5 * (w[0] + w[1]));
        Ok(middles.chain([-1.0, 1.0]).collect())
    });
    for (k, found) in excesses.iter_mut().enumerate() {
        along.go(k)?;
        let count = along.count();
        let is_beside_touch =
            |row: usize| p.mesh.touch_points().iter().any(|t| t.row == row && (t.end == k || t.end == k + 1));
        if looks_at_states {
            for x in along.states().chunks_exact(phase.states.len().max(1)).take(count - 2) {
                for ((state, v), scale) in phase.states.iter().zip(x).zip(&scales.states) {
                    raise(&mut found.of_states, state.variable.bounds.excess(*v) / scale);
                }
            }
            each_excess(&mut along, &mut without, scales, count - 2, |row, excess| {
                let beside = is_beside_touch(row);
                raise(if beside { &mut found.beside_touch } else { &mut found.of_states }, excess);
            });
        }
        if looks_at_controls {
            for u in along.controls().chunks_exact(phase.controls.len().max(1)) {
                for ((control, v), scale) in phase.controls.iter().zip(u).zip(&scales.controls) {
                    raise(&mut found.of_controls, control.bounds.excess(*v) / scale);
                }
            }
            each_excess(&mut along, &mut with, scales, count, |_, excess| {
                raise(&mut found.of_controls, excess);
            });
        }
    }
    Ok(excesses)
}

/// Path constraints with controls, and those without.
fn rows(phase: &Phase) -> (Rows<'_>, Rows<'_>) {
    let (nx, nu) = (phase.states.len(), phase.controls.len());
    let has_control = |(_, c, _): &(usize, &PathConstraint, Vec<f64>)| {
        c.function.pattern().columns.iter().any(|i| (nx..nx + nu).contains(i))
    };
    let firsts = phase.path.iter().scan(0, |next, c| {
        let first = *next;
        *next += c.rows.len();
        Some((first, c, Vec::new()))
    });
    firsts.partition(has_control)
}

/// Calls `emit` with number and excess of each row at the first points, relative to its scale.
fn each_excess<P: Fn(usize) -> Result<Vec<f64>, RadauError>>(
    along: &mut Along<'_, P>,
    rows: &mut Rows<'_>,
    scales: &PhaseScaling,
    points: usize,
    mut emit: impl FnMut(usize, f64),
) {
    for (first, c, values) in rows {
        values.resize(points * c.rows.len(), 0.0);
        along.values(c.function.as_ref(), values);
        for values in values.chunks_exact(c.rows.len()) {
            for ((index, row), v) in (*first..).zip(&c.rows).zip(values) {
                emit(index, row.bounds.excess(*v) / row.size().unwrap_or(scales.path[index]));
            }
        }
    }
}
