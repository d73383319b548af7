//! Features of time: pulses, jumps and kinks of what the equations make of time alone, which nodes far apart would not see.
//!
//! A cost that is high for six minutes of a day, a thrust that is off in eclipse, a table of wind over time: their formulas tell where they
//! are ([`apsides_ad::Divisions`]). A mesh gets interval ends there, a trajectory ends of its pieces, so that whatever looks at a few
//! points of each interval sees them. Functions without a formula tell nothing.

use std::sync::Arc;

use apsides_ad::{Divisions, Formula, NodeFunction};

use crate::{
    Bounds, Guess, Kink, Mesh, Ocp, OcpError, Phase, PhaseTrajectory, PiecewisePolynomial, Trajectory,
};

/// An interval end at a jump stands this many roundings of the largest time behind it, so that the node there does not fall before it.
const BEHIND: f64 = 16.0;
/// Ends within this many roundings are the same.
const SAME: f64 = 64.0;
/// Step of a parameter, relative to its size.
const STEP: f64 = 1e-6;
/// An interval end of a mesh this close to a jump, as a part of the phase, is moved there.
const NEAR: f64 = 1e-9;

/// Width of so many roundings of times.
fn roundings(number: f64, times: [f64; 2]) -> f64 {
    number * f64::EPSILON * times[0].abs().max(times[1].abs())
}

/// The time from which on nothing of what is before a jump at this time is seen.
#[must_use]
pub fn behind(time: f64) -> f64 {
    time + roundings(BEHIND, [time, time])
}

/// The mesh with interval ends at the features of time that its nodes do not see, for the times and parameters of a guess; none where it
/// has them all. Interval ends at jumps stand where they are, in phases whose ends do.
///
/// # Errors
/// [`OcpError::Mesh`] when the meshes do not fit the phases.
pub fn divided_mesh(ocp: &Ocp, guess: &Guess, mesh: &Mesh) -> Result<Option<Mesh>, OcpError> {
    let mut divided = None;
    for (k, (phase, of_phase)) in guess.phases.iter().zip(&mesh.phases).enumerate() {
        let times = [phase.initial_time, phase.final_time];
        let duration = times[1] - times[0];
        let features = features(ocp, k, &guess.parameters, times);
        let of_mesh: Vec<f64> = of_phase.fractions().iter().map(|f| times[0] + f * duration).collect();
        let ends = features.unseen(&ocp.phases[k], &of_mesh, of_phase.points(), NEAR * duration);
        let mut next = of_phase.with_ends(&fractions(&ends, times))?;
        if ocp.phases[k].has_fixed_times() {
            next = next.with_fixed_ends(&fractions(&features.instants, times), NEAR)?;
        }
        if next != *of_phase {
            divided.get_or_insert_with(|| mesh.clone()).phases[k] = next;
        }
    }
    Ok(divided)
}

/// The trajectory with ends of its pieces at the features of time that its nodes do not see; none where it has them all. The polynomials
/// are the same.
///
/// # Errors
/// [`OcpError::Mesh`] when polynomials and meshes do not fit.
pub fn divided_trajectory(ocp: &Ocp, trajectory: &Trajectory) -> Result<Option<Trajectory>, OcpError> {
    let mut divided = None;
    for (k, phase) in trajectory.phases.iter().enumerate() {
        let control = &phase.control;
        let nodes: Vec<usize> = control.segments().iter().map(|s| s.basis.nodes().len()).collect();
        let times = [phase.initial_time, phase.final_time];
        let features = features(ocp, k, &trajectory.parameters, times);
        let ends = features.unseen(&ocp.phases[k], control.breaks(), &nodes, roundings(SAME, times));
        if !ends.is_empty() {
            let divided = divided.get_or_insert_with(|| trajectory.clone());
            divided.phases[k] = phase.divided_at(&ends)?;
        }
    }
    Ok(divided)
}

impl PhaseTrajectory {
    /// The fraction of the phase on its mesh at a time.
    #[must_use]
    pub fn fraction_at(&self, t: f64) -> f64 {
        let (ends, breaks) = (self.mesh.fractions(), self.control.breaks());
        if ends.len() != breaks.len() {
            return (t - self.initial_time) / (self.final_time - self.initial_time);
        }
        // Ends of the mesh and of the pieces may differ by rounding.
        let k = self.control.segment_at(t);
        ends[k] + (t - breaks[k]) / (breaks[k + 1] - breaks[k]) * (ends[k + 1] - ends[k])
    }

    /// The same phase with an end of a piece at each of these times, which increase within the phase; but for those that are too close to
    /// an end for its mesh to tell them apart.
    pub(crate) fn divided_at(&self, times: &[f64]) -> Result<Self, OcpError> {
        let ends = self.mesh.fractions();
        let at = times.iter().map(|t| (*t, self.fraction_at(*t)));
        let is_end = |place: f64| ends.binary_search_by(|end| end.total_cmp(&place)).is_ok();
        let mut apart: Vec<(f64, f64)> = at.filter(|(_, place)| !is_end(*place)).collect();
        apart.dedup_by_key(|(_, place)| *place);
        let (times, places): (Vec<f64>, Vec<f64>) = apart.into_iter().unzip();
        let times = &times[..];
        let control = self.control.divided_at(times)?;
        let divided = |p: &Option<PiecewisePolynomial>| p.as_ref().map(|p| p.divided_at(times)).transpose();
        let mesh = self.mesh.with_ends(&places)?;
        // The error of an interval is that of its parts.
        let error = |w: &[f64]| {
            let k = self.mesh.fractions().partition_point(|f| *f <= 0.5 * (w[0] + w[1]));
            self.interval_errors.get(k.saturating_sub(1)).copied().unwrap_or(f64::NAN)
        };
        let mut contacts = self.contacts.clone();
        for contact in &mut contacts {
            let at = self.contact_time(contact);
            contact.end = control.breaks().partition_point(|b| *b < at);
        }
        Ok(Self {
            interval_errors: mesh.fractions().windows(2).map(error).collect(),
            mesh,
            state: self.state.divided_at(times)?,
            costate: divided(&self.costate)?,
            path_multipliers: divided(&self.path_multipliers)?,
            control,
            contacts,
            ..self.clone()
        })
    }
}

/// The problem and the guess with the fixed start times of phases behind the jumps that stand there, of which a phase has the side behind alone; none
/// where no jump stands at a start.
#[must_use]
pub fn starting_behind_jumps(ocp: &Ocp, guess: &Guess) -> Option<(Ocp, Guess)> {
    let (mut behind, mut any) = ((ocp.clone(), guess.clone()), false);
    for (k, (phase, of_phase)) in ocp.phases.iter().zip(&guess.phases).enumerate() {
        let start = of_phase.initial_time;
        let duration = of_phase.final_time - start;
        // A jump shows between times on both sides of it.
        let times = [start - duration, start + duration];
        let is_at_start = |t: &&f64| (**t - start).abs() <= roundings(SAME, times);
        let usable = phase.initial_time.is_fixed() && duration > 0.0 && start == phase.initial_time.lower;
        let instants = if usable { instants(ocp, k, &guess.parameters, times) } else { Vec::new() };
        if let Some(at) = instants.iter().find(is_at_start) {
            behind.0.phases[k].initial_time = Bounds::fixed(*at);
            behind.1.phases[k].initial_time = *at;
            any = true;
        }
    }
    any.then_some(behind)
}

fn fractions(ends: &[f64], [start, end]: [f64; 2]) -> Vec<f64> {
    ends.iter().map(|t| (t - start) / (end - start)).collect()
}

/// Indices of those inner ends, of a phase or of its pieces, at which the equations have a jump or a kink of time.
#[must_use]
pub fn ends_at_instants(ocp: &Ocp, k: usize, parameters: &[f64], ends: &[f64]) -> Vec<usize> {
    let Some((first, last)) = ends.first().zip(ends.last()) else { return Vec::new() };
    let times = [*first, *last];
    let same = roundings(SAME, times);
    let instants = instants(ocp, k, parameters, times);
    let is_instant = |end: f64| instants.iter().any(|at| (end - at).abs() <= same);
    (1..ends.len() - 1).filter(|&k| is_instant(ends[k])).collect()
}

/// The rates at which the times of jumps and kinks move with the parameters, by the indices of [`ends_at_instants`]: for each of them one
/// number for each parameter.
#[must_use]
pub fn rates_of_instants(
    ocp: &Ocp,
    k: usize,
    parameters: &[f64],
    ends: &[f64],
    at: &[usize],
) -> Vec<Vec<f64>> {
    let mut rates = vec![vec![0.0; parameters.len()]; at.len()];
    let Some((first, last)) = ends.first().zip(ends.last()).filter(|_| !at.is_empty()) else { return rates };
    for (i, p) in parameters.iter().enumerate() {
        let step = STEP * ocp.parameters[i].size().unwrap_or(1.0).max(p.abs());
        let [below, above] = [p - step, p + step].map(|p| {
            let mut moved = parameters.to_vec();
            moved[i] = p;
            instants(ocp, k, &moved, [*first, *last])
        });
        let nearest = |instants: &[f64], end: f64| {
            let closer = |a: &&f64, b: &&f64| (*a - end).abs().total_cmp(&(*b - end).abs());
            instants.iter().min_by(closer).copied().unwrap_or(end)
        };
        for (rates, end) in rates.iter_mut().zip(at.iter().map(|k| ends[*k])) {
            let moved = nearest(&above, end) - nearest(&below, end);
            // What does not move differs by rounding.
            rates[i] =
                if moved.abs() > roundings(SAME, [*first, *last]) { moved / (2.0 * step) } else { 0.0 };
        }
    }
    rates
}

/// Times from which on nothing of what is before a jump or a kink of time is seen, in increasing order.
fn instants(ocp: &Ocp, k: usize, parameters: &[f64], times: [f64; 2]) -> Vec<f64> {
    let of = |f: &Arc<dyn NodeFunction>| {
        let InTime { formula, time, fixed } = InTime::of(ocp, k, parameters, f)?;
        Some(formula.instants(time, times, &fixed))
    };
    merged(ocp.phases[k].functions().filter_map(of).flatten(), times)
}

/// Those of several functions, each a little behind the jump.
fn merged(instants: impl Iterator<Item = [f64; 2]>, times: [f64; 2]) -> Vec<f64> {
    let mut instants: Vec<f64> = instants.map(|[_, after]| after + roundings(BEHIND, times)).collect();
    instants.sort_by(f64::total_cmp);
    instants.dedup_by(|next, last| *next - *last <= roundings(SAME, times));
    instants
}

/// The features of time of a phase.
struct Features {
    /// As [`instants`].
    instants: Vec<f64>,
    /// Intervals that hide nothing.
    parts: Vec<[f64; 2]>,
}

fn features(ocp: &Ocp, k: usize, parameters: &[f64], times: [f64; 2]) -> Features {
    let of = |f: &Arc<dyn NodeFunction>| {
        let InTime { formula, time, fixed } = InTime::of(ocp, k, parameters, f)?;
        Some(formula.divisions(time, times, &fixed))
    };
    let all: Vec<Divisions> = ocp.phases[k].functions().filter_map(of).collect();
    let instants = merged(all.iter().flat_map(|d| d.instants.iter().copied()), times);
    Features { instants, parts: all.into_iter().flat_map(|d| d.parts).collect() }
}

impl Features {
    /// Times at which intervals with these ends and numbers of nodes need further ends, in increasing order; ends within a distance are the
    /// same.
    fn unseen(&self, phase: &Phase, known: &[f64], nodes: &[usize], same: f64) -> Vec<f64> {
        let (start, end) = (known[0], known[nodes.len()]);
        // Where the ends of the phase move, a method that knows the kinks has interval ends of these times.
        let is_followed = |t: f64| {
            let is_here =
                |k: &Kink| matches!(k, Kink::Time(v) if (v - t).abs() <= roundings(SAME, [start, end]));
            !phase.has_fixed_times() && phase.kinks.iter().any(is_here)
        };
        let mut ends: Vec<f64> = self.instants.iter().copied().filter(|t| !is_followed(*t)).collect();
        for [a, b] in &self.parts {
            let k = known.partition_point(|t| *t <= 0.5 * (a + b)).clamp(1, nodes.len());
            let spacing = (known[k] - known[k - 1]) / nodes[k - 1] as f64;
            if b - a < spacing {
                ends.extend([a, b]);
            }
        }
        ends.sort_by(f64::total_cmp);
        ends.dedup_by(|next, last| *next - *last <= same);
        ends.retain(|t| known.iter().all(|end| (t - end).abs() > same) && *t > start && *t < end);
        ends
    }
}

/// A function of time and parameters.
struct InTime {
    formula: Formula,
    /// Index of the time among the inputs.
    time: usize,
    /// Numbers of the parameters among the inputs.
    fixed: Vec<(usize, f64)>,
}

impl InTime {
    /// None where the function has no formula.
    fn of(ocp: &Ocp, k: usize, parameters: &[f64], function: &Arc<dyn NodeFunction>) -> Option<Self> {
        let formula = function.formula().ok()?;
        // Time is the last input, after the parameters.
        let time = function.inputs() - 1;
        let taken = if ocp.phases[k].takes_parameters(function.as_ref()) { parameters } else { &[] };
        let fixed = (time - taken.len()..time).zip(taken.iter().copied()).collect();
        Some(Self { formula, time, fixed })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{At, Bounds, Break, PhaseArc, PhaseMesh, State, Variable};
    use apsides_ad::{Dynamics, Scalar};

    const JUMP: f64 = 2.5;

    /// `x' = u`, and none before the jump.
    struct Late;
    impl Dynamics<1, 1> for Late {
        fn rate<S: Scalar>(&self, t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
            [((t - JUMP).sign() * 0.5 + 0.5) * u[0]]
        }
    }

    fn late(end: Bounds) -> Ocp {
        let phase = Phase::new("late", Late)
            .states([State::new("x", "m").starts_at(0.0)])
            .controls([Variable::new("u", "m/s").within(-1.0, 1.0)])
            .final_time(end)
            .kinks([Kink::Time(JUMP)]);
        Ocp::builder("late")
            .phase(phase)
            .minimize("x", "m", At::FinalState("late", "x"))
            .build()
            .expect("posed")
    }

    /// Two features of a trajectory may be closer to each other than its mesh tells fractions apart.
    #[test]
    fn ends_that_are_there_already_are_no_further_ones() {
        let mesh = PhaseMesh::new(vec![0.0, 0.25, 1.0], vec![3, 4]).expect("a mesh");
        let divided = mesh.with_ends(&[0.25, 0.5, 0.5]).expect("one end more");
        assert_eq!((divided.fractions(), divided.points()), (&[0.0, 0.25, 0.5, 1.0][..], &[3, 4, 4][..]));
        assert_eq!(mesh.with_ends(&[0.0, 0.25, 1.0]).expect("none more"), mesh);
        assert!(mesh.with_ends(&[f64::NAN]).is_err() && mesh.with_ends(&[1.5]).is_err());
    }

    #[test]
    fn meshes_get_an_end_behind_a_jump_where_the_ends_of_the_phase_stay() {
        let ocp = late(Bounds::fixed(10.0));
        let guess = Guess::linear(&ocp);
        let mesh = Mesh::uniform(&ocp, 3, 4).expect("a mesh");
        let divided = divided_mesh(&ocp, &guess, &mesh).expect("it fits").expect("an end more");
        let found = 10.0 * divided.phases[0].fractions()[1];
        assert!(found > JUMP && found - JUMP < 1e-13, "{found}");
        assert_eq!(divided.phases[0].points(), [4; 4]);
        assert_eq!(divided_mesh(&ocp, &guess, &divided).expect("it fits"), None);

        // A break that is almost there is moved there, and its time is no unknown.
        let breaks = vec![Break { end: 1, free: true, is_tangent: false }];
        let near = PhaseMesh::new(vec![0.0, 0.25 - 1e-11, 1.0], vec![4; 2]).expect("a mesh");
        let near = near.with_arcs(breaks, vec![PhaseArc::default(); 2]).expect("a break");
        let moved =
            divided_mesh(&ocp, &guess, &Mesh { phases: vec![near] }).expect("it fits").expect("moved");
        let moved = &moved.phases[0];
        assert!(10.0 * moved.fractions()[1] > JUMP && moved.intervals() == 2 && !moved.breaks()[0].free);

        // So is one that is beside it, at either side.
        for beside in [0.245, 0.255] {
            let mut ends = vec![0.0, 0.2, 0.25, 0.3, 1.0];
            let k = ends.partition_point(|end| *end < beside);
            ends.insert(k, beside);
            let breaks = vec![Break { end: k, free: true, is_tangent: false }];
            let mesh = PhaseMesh::new(ends, vec![4; 5]).expect("a mesh");
            let mesh = mesh.with_arcs(breaks, vec![PhaseArc::default(); 2]).expect("a break");
            let found =
                divided_mesh(&ocp, &guess, &Mesh { phases: vec![mesh] }).expect("it fits").expect("moved");
            let found = &found.phases[0];
            assert_eq!((found.intervals(), found.breaks()[0].end, found.breaks()[0].free), (4, 2, false));
        }

        // Where they move the time of the jump is one that methods follow.
        assert_eq!(divided_mesh(&late(Bounds::new(1.0, 20.0)), &guess, &mesh).expect("it fits"), None);
    }
}
