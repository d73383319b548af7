//! Statements that follow from others: bounds of controls and states that a path constraint of controls implies, and path constraints and
//! final states that the equations of motion keep.
//!
//! The components of a direction of length one need no bounds of one, nor those of an attitude quaternion that is a control in one of its
//! components, and the attitude quaternion of a rigid body keeps its length, so that its components stay within it. An altitude that starts at its
//! bound stays above it where the flight path may not point down.
//! Stated all the same, their gradients depend on those of the others: multipliers are not unique, and Newton's method converges slowly.
//! So such constraints are left out while the problem is solved, and such bounds are moved away.

use apsides_ocp::{Bounds, Mesh, Ocp, PathConstraint, Phase, Trajectory, Variable};

use crate::implied_ends::{ImpliedEnd, implied_ends};
use crate::invariants::largest_by_motion;
use crate::monotone::{Trend, trends};

/// Values that are equal to this, relative to their parts, differ by rounding or by the digits of a bound.
const ROUNDING: f64 = 1e-7;
/// A row is a sum of terms of one input each if it differs from it by less than this, relative to the terms.
const SUM: f64 = 1e-12;
/// A sum of products vanishes if it is less than this part of the largest sum that they could have: rounding alone.
const VANISHING: f64 = 1e-13;
/// A constraint is met at the start of a phase within this, relative to its size.
const MET: f64 = 1e-9;
/// Distance of a final state from where it was posed, relative to its scale, that is no error of a mesh.
const MISSED: f64 = 1e-5;
/// Part of the size of an input by which an implied bound is moved away: where it stands it guides the first iterations still.
const ROOM: f64 = 0.2;
/// Points at which a function is tried, as parts of the sizes of its inputs.
const PROBES: [f64; 6] = [0.31, -0.74, 1.0, -1.57, 0.08, 2.9];

/// A problem without statements that follow from its others.
pub(crate) struct Irredundant {
    pub(crate) ocp: Ocp,
    /// Per phase, for each row of the path constraints as they were posed, whether it is still there.
    kept: Vec<Vec<bool>>,
    /// Per phase, the final states that are left to the motion.
    ends: Vec<Vec<ImpliedEnd>>,
}

impl Irredundant {
    /// The problem without the statements that follow from its others; none if there are none.
    pub(crate) fn of(ocp: &Ocp) -> Option<Self> {
        let moved: Vec<Option<Vec<Variable>>> =
            ocp.phases.iter().map(|phase| inputs_between_wider_bounds(ocp, phase)).collect();
        let keeps = ocp.phases.iter().map(|phase| {
            let keeps = phase.path.iter().map(|c| !is_kept_by_motion(phase, c));
            keeps.collect::<Vec<bool>>()
        });
        let keeps: Vec<Vec<bool>> = keeps.collect();
        let ends: Vec<Vec<ImpliedEnd>> = ocp.phases.iter().map(|phase| implied_ends(ocp, phase)).collect();
        let has_all = keeps.iter().flatten().all(|keep| *keep) && ends.iter().all(Vec::is_empty);
        if moved.iter().all(Option::is_none) && has_all {
            return None;
        }
        let mut rest = ocp.clone();
        for (phase, ends) in rest.phases.iter_mut().zip(&ends) {
            for ImpliedEnd { state, side, .. } in ends {
                let state = &mut phase.states[*state];
                state.terminal = side.intersect(&state.variable.bounds);
            }
        }
        let mut kept = Vec::new();
        for ((phase, moved), keeps) in rest.phases.iter_mut().zip(moved).zip(keeps) {
            kept.push(phase.path.iter().zip(&keeps).flat_map(|(c, k)| vec![*k; c.rows.len()]).collect());
            let mut keep = keeps.into_iter();
            phase.path.retain(|_| keep.next().unwrap_or(true));
            let Some(mut states) = moved else { continue };
            phase.controls = states.split_off(phase.states.len());
            for (state, variable) in phase.states.iter_mut().zip(states) {
                // The row says nothing at the end of the phase.
                let along = state.variable.bounds;
                (state.initial, state.terminal) =
                    (state.initial.intersect(&along), state.terminal.intersect(&along));
                state.variable = variable;
            }
        }
        Some(Self { ocp: rest, kept, ends })
    }

    /// The same with the final states as they were posed.
    pub(crate) fn with_posed_ends(mut self, ocp: &Ocp) -> Self {
        for ((phase, posed), ends) in self.ocp.phases.iter_mut().zip(&ocp.phases).zip(&mut self.ends) {
            for ImpliedEnd { state, .. } in ends.drain(..) {
                phase.states[state].terminal = posed.states[state].terminal;
            }
        }
        self
    }

    /// True if a final state that was left to the motion is not where it was posed: the motion does not keep what it seemed to.
    pub(crate) fn misses_ends(&self, trajectory: &Trajectory) -> bool {
        self.ends.iter().zip(&trajectory.phases).any(|(ends, t)| {
            let reached = t.final_state();
            ends.iter().any(|end| (reached[end.state] - end.value).abs() > MISSED * end.scale)
        })
    }

    /// The mesh without the arcs of phases that have fewer rows.
    pub(crate) fn as_meant(&self, mesh: Mesh) -> Mesh {
        let phases = mesh.phases.into_iter().zip(&self.kept);
        let phases = phases.map(|(m, kept)| if kept.contains(&false) { m.without_arcs() } else { m });
        Mesh { phases: phases.collect() }
    }

    /// The trajectory as one of the problem as it was posed: the rows that were left out have multipliers of zero.
    pub(crate) fn as_posed(&self, mut trajectory: Trajectory) -> Trajectory {
        for (t, kept) in trajectory.phases.iter_mut().zip(&self.kept) {
            if !kept.contains(&false) {
                continue;
            }
            let posed: Vec<usize> = (0..kept.len()).filter(|row| kept[*row]).collect();
            t.contacts.iter_mut().for_each(|c| c.row = posed.get(c.row).copied().unwrap_or(c.row));
            t.mesh = t.mesh.clone().without_arcs();
            let solved = t.path_multipliers.take();
            // Without rows that were solved, the nodes are those of the control.
            let solved = solved.unwrap_or_else(|| t.control.map_nodes(0, |_, _| ()));
            t.path_multipliers = Some(solved.map_nodes(kept.len(), |solved, all| {
                posed.iter().zip(solved).for_each(|(row, multiplier)| all[*row] = *multiplier);
            }));
        }
        trajectory
    }
}

/// States and controls with the bounds moved away beyond which a row cannot be met, that the motion does not pass, or that a state leaves at the
/// start of the phase and cannot come back to; none if there are none.
fn inputs_between_wider_bounds(ocp: &Ocp, phase: &Phase) -> Option<Vec<Variable>> {
    let mut inputs = inputs(phase);
    let rows: Vec<(Separable, Bounds)> = (phase.path.iter())
        .flat_map(|c| {
            let rows = c.rows.iter().enumerate();
            rows.filter_map(|(k, row)| Some((Separable::of(phase, c, k)?, row.bounds)))
        })
        .collect();
    let mut any = false;
    let trends = trends(ocp, phase).into_iter().enumerate();
    for ((s, trend), (state, input)) in trends.zip(phase.states.iter().zip(&mut inputs)) {
        let (start, size) = (state.initial, input.size());
        let is_left = |bound: f64| {
            let is_there = start.is_fixed() && (start.lower - bound).abs() <= MET * size.unwrap_or(1.0);
            // Along an arc on which the rate vanishes bounds of other states do the same.
            is_there && !is_steered(phase, s)
        };
        let room = ROOM * size.unwrap_or(1.0);
        let Bounds { lower, upper } = input.bounds;
        match trend {
            Some(Trend::Grows) if is_left(lower) => input.bounds.lower = lower - room,
            Some(Trend::Falls) if is_left(upper) => input.bounds.upper = upper + room,
            _ => continue,
        }
        (input.scale, any) = (size, true);
    }
    for (state, most) in largest_by_motion(ocp, phase) {
        let input = &mut inputs[state];
        let (size, least) = (input.size(), most * (1.0 - MET));
        let room = ROOM * size.unwrap_or(1.0);
        let Bounds { lower, upper } = input.bounds;
        let is_above = upper >= least && upper.is_finite();
        let is_below = lower <= -least && lower.is_finite();
        input.bounds.upper = if is_above { upper + room } else { upper };
        input.bounds.lower = if is_below { lower - room } else { lower };
        if is_above || is_below {
            (input.scale, any) = (size, true);
        }
    }
    for (quadratic, bounds) in rows {
        for term in &quadratic.terms {
            for upper in [false, true] {
                let input = &inputs[term.input];
                let bound = if upper { input.bounds.upper } else { input.bounds.lower };
                if !bound.is_finite() || input.bounds.is_fixed() {
                    continue;
                }
                let beyond = if upper { Bounds::at_least(bound) } else { Bounds::at_most(bound) };
                if quadratic.is_met(&inputs, term.input, beyond, bounds) {
                    continue;
                }
                let (scale, room) = (input.size(), ROOM * input.size().unwrap_or(1.0));
                // One that is so far beyond is no trouble.
                let inner =
                    if upper { Bounds::at_least(bound - room) } else { Bounds::at_most(bound + room) };
                if !quadratic.is_met(&inputs, term.input, inner, bounds) {
                    continue;
                }
                let input = &mut inputs[term.input];
                let end = if upper { &mut input.bounds.upper } else { &mut input.bounds.lower };
                *end = if upper { bound + room } else { bound - room };
                input.scale = scale;
                any = true;
            }
        }
    }
    any.then_some(inputs)
}

/// Says whether a control enters the rate of a state.
fn is_steered(phase: &Phase, state: usize) -> bool {
    let (nx, pattern) = (phase.states.len(), phase.dynamics.pattern());
    let columns = &pattern.columns[pattern.row_offsets[state]..pattern.row_offsets[state + 1]];
    columns.iter().any(|c| (nx..nx + phase.controls.len()).contains(c))
}

/// States and controls.
fn inputs(phase: &Phase) -> Vec<Variable> {
    phase.states.iter().map(|s| &s.variable).chain(&phase.controls).cloned().collect()
}

/// A term `square u^2 + linear u`.
struct Term {
    input: usize,
    square: f64,
    linear: f64,
}

impl Term {
    /// Least value between bounds.
    fn least(&self, bounds: Bounds) -> f64 {
        let at = |u: f64| match (self.square, self.linear) {
            _ if u.is_finite() => u * (self.square * u + self.linear),
            (0.0, 0.0) => 0.0,
            (0.0, linear) => linear * u,
            (square, _) => square * f64::INFINITY,
        };
        let vertex = (self.square > 0.0).then(|| bounds.clamp(-self.linear / (2.0 * self.square)));
        vertex.map_or_else(|| at(bounds.lower).min(at(bounds.upper)), at)
    }

    fn negated(&self) -> Self {
        Self { square: -self.square, linear: -self.linear, ..*self }
    }
}

/// A row of controls, and of states besides, that is a sum of quadratic functions of one of them each.
struct Separable {
    constant: f64,
    terms: Vec<Term>,
}

impl Separable {
    fn of(phase: &Phase, constraint: &PathConstraint, row: usize) -> Option<Self> {
        let (nx, nu) = (phase.states.len(), phase.controls.len());
        let f = constraint.function.as_ref();
        let pattern = f.pattern();
        let entries = pattern.row_offsets[row]..pattern.row_offsets[row + 1];
        let columns = &pattern.columns[entries.clone()];
        let has_control = columns.iter().any(|c| (nx..nx + nu).contains(c));
        if columns.len() < 2 || !has_control || columns.iter().any(|c| *c >= nx + nu) {
            return None;
        }
        let mut weights = vec![0.0; f.outputs()];
        weights[row] = 1.0;
        let mut values = vec![0.0; f.outputs()];
        let (mut slopes, mut curvatures) =
            (vec![0.0; pattern.jacobian_len()], vec![0.0; pattern.hessian_len()]);
        let mut z = vec![0.0; f.inputs()];
        f.jacobian(&z, &mut values, &mut slopes);
        f.hessian(&z, &weights, &mut curvatures);
        let constant = values[row];
        let square = |c: usize| {
            let found = pattern.hessian.iter().zip(&curvatures).find(|((i, j), _)| i == j && *i == c);
            found.map_or(0.0, |(_, h)| 0.5 * h)
        };
        let terms: Vec<Term> = (columns.iter().zip(&slopes[entries]))
            .map(|(&c, &linear)| Term { input: c, square: square(c), linear })
            .collect();
        // What is not that sum at any of the probes is something else.
        let sizes: Vec<f64> = inputs(phase).iter().map(|v| v.size().unwrap_or(1.0)).collect();
        for (k, probe) in PROBES.iter().enumerate() {
            for (j, term) in terms.iter().enumerate() {
                let part = PROBES[(k + j) % PROBES.len()];
                z[term.input] = part * probe.abs() * sizes[term.input];
            }
            f.value(&z, &mut values);
            let parts = terms.iter().map(|t| {
                let u = z[t.input];
                u * (t.square * u + t.linear)
            });
            let (sum, size) = parts.fold((constant, constant.abs()), |(s, a), p| (s + p, a + p.abs()));
            let is_that_sum = (values[row] - sum).abs() <= SUM * size;
            if !is_that_sum {
                return None;
            }
        }
        Some(Self { constant, terms })
    }

    /// Says whether the row can be met, and not touched alone, where one input is in `region` and the others between their bounds.
    fn is_met(&self, inputs: &[Variable], input: usize, region: Bounds, row: Bounds) -> bool {
        let within = |t: &Term| if t.input == input { region } else { inputs[t.input].bounds };
        let size = [row.lower, row.upper, self.constant].map(f64::abs).into_iter().filter(|v| v.is_finite());
        let margin = ROUNDING * size.fold(0.0, f64::max);
        let least = self.constant + self.terms.iter().map(|t| t.least(within(t))).sum::<f64>();
        let largest = self.constant - self.terms.iter().map(|t| t.negated().least(within(t))).sum::<f64>();
        !(least >= row.upper - margin || largest <= row.lower + margin)
    }
}

/// Says whether all rows of a constraint hold at the fixed start of a phase, and keep their values by the equations of motion whatever
/// the controls are.
fn is_kept_by_motion(phase: &Phase, constraint: &PathConstraint) -> bool {
    let nx = phase.states.len();
    let (row, motion) = (constraint.function.as_ref(), phase.dynamics.as_ref());
    let columns = &row.pattern().columns;
    if columns.is_empty() || columns.iter().any(|c| *c >= nx || !phase.states[*c].initial.is_fixed()) {
        return false;
    }
    let mut z = vec![0.0; row.inputs().max(motion.inputs())];
    let mut values = vec![0.0; row.outputs()];
    let (mut slopes, mut rates) = (vec![0.0; row.pattern().jacobian_len()], vec![0.0; nx]);
    for (k, probe) in PROBES.iter().enumerate() {
        for (j, v) in z.iter_mut().enumerate() {
            *v = PROBES[(k * j + k + j) % PROBES.len()] * probe;
        }
        row.jacobian(&z[..row.inputs()], &mut values, &mut slopes);
        motion.value(&z[..motion.inputs()], &mut rates);
        let mut change = vec![(0.0, 0.0); row.outputs()];
        for ((r, c), slope) in row.pattern().jacobian_entries().zip(&slopes) {
            let part = slope * rates[c];
            change[r] = (change[r].0 + part, change[r].1 + f64::abs(part));
        }
        if !change.iter().all(|(sum, size): &(f64, f64)| sum.abs() <= VANISHING * size) {
            return false;
        }
    }
    z.iter_mut().zip(&phase.states).for_each(|(z, s)| *z = s.initial.representative());
    row.value(&z[..row.inputs()], &mut values);
    constraint.rows.iter().zip(&values).all(|(r, v)| r.bounds.excess(*v) <= MET * r.size().unwrap_or(1.0))
}

#[cfg(test)]
mod tests {
    use apsides_ad::{Dynamics, Scalar};
    use apsides_ocp::{At, State};

    use super::*;

    /// `h' = w`, `w' = u`, `m' = -u^2`.
    struct Climb;

    impl Dynamics<3, 1> for Climb {
        fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], u: &[S; 1], _p: &[S; 0]) -> [S; 3] {
            [x[1], u[0], -u[0].square()]
        }
    }

    fn climb(least_rate: f64) -> Ocp {
        let phase = Phase::new("climb", Climb)
            .states([
                State::new("h", "m").at_least(0.0).starts_at(0.0),
                State::new("w", "m/s").at_least(least_rate).starts_at(0.0),
                State::new("m", "kg").within(0.0, 1.0).starts_at(1.0),
            ])
            .controls([Variable::new("u", "m/s2").within(-1.0, 1.0)])
            .final_time(Bounds::fixed(1.0));
        let ocp = Ocp::builder("climb").phase(phase).maximize("height", "m", At::FinalState("climb", "h"));
        ocp.build().unwrap()
    }

    #[test]
    fn a_bound_that_a_state_cannot_come_back_to_is_moved_away() {
        let irredundant = Irredundant::of(&climb(0.0)).unwrap();
        let states = &irredundant.ocp.phases[0].states;
        assert!(states[0].variable.bounds.lower < 0.0);
        assert_eq!(states[1].variable.bounds.lower, 0.0);
        // Whether the mass stands still is up to a control alone.
        assert_eq!(states[2].variable.bounds.upper, 1.0);
        assert!(Irredundant::of(&climb(-1.0)).is_none());
    }
}
