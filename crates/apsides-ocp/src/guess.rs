//! Starting points: straight lines, samples, a flight with given controls, or an earlier trajectory.

mod controls;
mod flight;
mod moving;
mod starts;
pub(crate) mod stationary;

use crate::{Bounds, Ocp, OcpError, Phase, PhaseTrajectory, Trajectory, linkage};

/// A bound this many times what is known of an end says nothing of its size.
const FAR_WIDER: f64 = 1e3;

/// Guess of one phase on its normalised time from 0 to 1.
#[derive(Clone, Debug)]
pub struct PhaseGuess {
    /// Start time.
    pub initial_time: f64,
    /// End time.
    pub final_time: f64,
    profile: Profile,
}

#[derive(Clone, Debug)]
enum Profile {
    Samples { fractions: Vec<f64>, states: Vec<Vec<f64>>, controls: Vec<Vec<f64>> },
    Earlier(Box<PhaseTrajectory>),
}

impl PhaseGuess {
    /// Samples joined by straight lines: increasing times, one row of states and of controls per time.
    ///
    /// # Errors
    /// [`OcpError::Guess`] when times do not increase, rows differ in number or length, or a value is not finite.
    pub fn samples(times: &[f64], states: Vec<Vec<f64>>, controls: Vec<Vec<f64>>) -> Result<Self, OcpError> {
        let fail = |reason: &str| Err(OcpError::Guess { place: "a phase".into(), reason: reason.into() });
        let n = times.len();
        if n < 2 || states.len() != n || controls.len() != n {
            return fail("needs at least two times and one row of states and of controls per time");
        }
        if times.windows(2).any(|w| w[0] >= w[1]) {
            return fail("the times must increase");
        }
        let mut values = times.iter().chain(states.iter().flatten()).chain(controls.iter().flatten());
        if !values.all(|v| v.is_finite()) {
            return fail("every value must be finite");
        }
        let same_length = |rows: &[Vec<f64>]| rows.iter().all(|r| r.len() == rows[0].len());
        if !same_length(&states) || !same_length(&controls) {
            return fail("every row must have the same length");
        }
        let (first, last) = (times[0], times[n - 1]);
        let fractions = times.iter().map(|t| (t - first) / (last - first)).collect();
        Ok(Self {
            initial_time: first,
            final_time: last,
            profile: Profile::Samples { fractions, states, controls },
        })
    }

    /// Straight lines between what the bounds allow at both ends, with the constant controls that follow them best; static parameters
    /// are taken from the middle of their bounds.
    #[must_use]
    pub fn linear(phase: &Phase, parameters: &[f64]) -> Self {
        Self::following(phase, parameters, Self::straight(phase))
    }

    /// The straight lines between these times and states, with the controls that follow them best.
    fn following(phase: &Phase, parameters: &[f64], (times, ends): ((f64, f64), [Vec<f64>; 2])) -> Self {
        let (controls, final_time) = controls::fitted(phase, parameters, times, &ends);
        Self {
            initial_time: times.0,
            final_time,
            profile: Profile::Samples {
                fractions: vec![0.0, 1.0],
                states: ends.into(),
                controls: vec![controls.clone(), controls],
            },
        }
    }

    /// Times and states at both ends.
    fn straight(phase: &Phase) -> ((f64, f64), [Vec<f64>; 2]) {
        let initial_time = phase.initial_time.representative();
        let final_time = {
            let reach = Bounds::new(
                phase.final_time.lower.max(initial_time + phase.duration.lower),
                phase.final_time.upper.min(initial_time + phase.duration.upper),
            );
            let middle = reach.representative();
            if middle > initial_time { middle } else { initial_time + 1.0 }
        };
        let end = |bounds: fn(&crate::State) -> Bounds| -> Vec<f64> {
            let pick = |s: &crate::State| bounds(s).intersect(&s.variable.bounds).representative();
            phase.states.iter().map(pick).collect()
        };
        let mut ends = [end(|s| s.initial), end(|s| s.terminal)];
        // An end without a bound of its own takes the other end's value, one in a range far wider than all that is known the nearest to it.
        for (k, s) in phase.states.iter().enumerate() {
            let [start, end] = [ends[0][k], ends[1][k]];
            if let Some(near) = near_within(s.terminal, s.initial, start) {
                ends[1][k] = near;
            } else if let Some(near) = near_within(s.initial, s.terminal, end) {
                ends[0][k] = near;
            }
            if s.terminal == Bounds::FREE && s.initial != Bounds::FREE {
                ends[1][k] = ends[0][k];
            }
            if s.initial == Bounds::FREE && s.terminal != Bounds::FREE {
                ends[0][k] = ends[1][k];
            }
        }
        ((initial_time, final_time), ends)
    }

    /// An earlier trajectory of the same phase.
    #[must_use]
    pub fn earlier(trajectory: PhaseTrajectory) -> Self {
        Self {
            initial_time: trajectory.initial_time,
            final_time: trajectory.final_time,
            profile: Profile::Earlier(Box::new(trajectory)),
        }
    }

    /// The earlier trajectory that this guess stands on, if it does.
    #[must_use]
    pub fn as_trajectory(&self) -> Option<&PhaseTrajectory> {
        match &self.profile {
            Profile::Earlier(t) => Some(t),
            Profile::Samples { .. } => None,
        }
    }

    /// State at a fraction of the phase.
    pub fn state(&self, fraction: f64, out: &mut [f64]) {
        match &self.profile {
            Profile::Samples { fractions, states, .. } => interpolate(fractions, states, fraction, out),
            Profile::Earlier(t) => t.state.evaluate(t.time_at(fraction), out),
        }
    }

    /// Control at a fraction of the phase.
    pub fn control(&self, fraction: f64, out: &mut [f64]) {
        match &self.profile {
            Profile::Samples { fractions, controls, .. } => interpolate(fractions, controls, fraction, out),
            Profile::Earlier(t) => t.control.evaluate(t.time_at(fraction), out),
        }
    }

    /// The guess at so many fractions, 0 and 1 among them, each with its states and controls changed; their number may change.
    pub(crate) fn with_samples(
        &self,
        count: usize,
        mut change: impl FnMut(f64, &mut [f64], &mut Vec<f64>),
    ) -> Self {
        let (nx, nu) = self.widths();
        let fractions: Vec<f64> = (0..count).map(|k| k as f64 / (count - 1) as f64).collect();
        let sample = |fraction: &f64| {
            let (mut x, mut u) = (vec![0.0; nx], vec![0.0; nu]);
            self.state(*fraction, &mut x);
            self.control(*fraction, &mut u);
            change(*fraction, &mut x, &mut u);
            (x, u)
        };
        let (states, controls) = fractions.iter().map(sample).unzip();
        Self { profile: Profile::Samples { fractions, states, controls }, ..self.clone() }
    }

    /// Changes the states of each sample, by number and fraction, given its controls; an earlier trajectory stays.
    pub(crate) fn change_samples(&mut self, mut change: impl FnMut(usize, f64, &mut [f64], &[f64])) {
        if let Profile::Samples { fractions, states, controls } = &mut self.profile {
            for (k, ((fraction, x), u)) in fractions.iter().zip(states).zip(controls).enumerate() {
                change(k, *fraction, x, u);
            }
        }
    }

    /// The slopes of the states over the fraction at each sample, inside the mean of those of both sides; none of an earlier trajectory.
    pub(crate) fn slopes(&self) -> Vec<Vec<f64>> {
        let Profile::Samples { fractions, states, .. } = &self.profile else { return Vec::new() };
        let parts: Vec<Vec<f64>> = fractions
            .windows(2)
            .zip(states.windows(2))
            .map(|(f, x)| x[0].iter().zip(&x[1]).map(|(a, b)| (b - a) / (f[1] - f[0])).collect())
            .collect();
        let at = |k: usize| {
            let (before, after) = (&parts[k.saturating_sub(1)], &parts[k.min(parts.len() - 1)]);
            before.iter().zip(after).map(|(a, b)| 0.5 * (a + b)).collect()
        };
        (0..fractions.len()).map(at).collect()
    }

    /// At least so many intervals with the samples among their ends, of so many states, to which `extend` adds, and controls.
    pub(crate) fn refined(
        &self,
        intervals: usize,
        states: usize,
        controls: usize,
        mut extend: impl FnMut(f64, &mut Vec<f64>),
    ) -> Self {
        let own = match &self.profile {
            Profile::Samples { fractions, .. } => fractions.clone(),
            Profile::Earlier(_) => vec![0.0, 1.0],
        };
        let parts = intervals.div_ceil(own.len() - 1);
        let inner = |w: &[f64]| {
            let (a, b) = (w[0], w[1]);
            (0..parts).map(move |k| a + (b - a) * k as f64 / parts as f64).collect::<Vec<f64>>()
        };
        let fractions: Vec<f64> = own.windows(2).flat_map(inner).chain([1.0]).collect();
        let sample = |fraction: &f64| {
            let (mut x, mut u) = (vec![0.0; states], vec![0.0; controls]);
            self.state(*fraction, &mut x);
            self.control(*fraction, &mut u);
            extend(*fraction, &mut x);
            (x, u)
        };
        let (states, controls) = fractions.iter().map(sample).unzip();
        Self { profile: Profile::Samples { fractions, states, controls }, ..self.clone() }
    }

    pub(crate) fn widths(&self) -> (usize, usize) {
        match &self.profile {
            Profile::Samples { states, controls, .. } => (states[0].len(), controls[0].len()),
            Profile::Earlier(t) => (t.state.dimension(), t.control.dimension()),
        }
    }
}

/// The allowed value nearest to that of the other end, where the bounds are far wider than all that is known.
fn near_within(bounds: Bounds, other: Bounds, value: f64) -> Option<f64> {
    let [a, b] = [bounds.lower.abs(), bounds.upper.abs()];
    let near = bounds.clamp(value);
    let known = a.min(b).max(value.abs()).max(near.abs());
    let is_wide = a.max(b).is_finite() && known > 0.0 && a.max(b) > FAR_WIDER * known;
    (is_wide && other.is_fixed()).then_some(near)
}

fn interpolate(fractions: &[f64], rows: &[Vec<f64>], x: f64, out: &mut [f64]) {
    let k = fractions.partition_point(|f| *f <= x).clamp(1, fractions.len() - 1);
    let w = (x - fractions[k - 1]) / (fractions[k] - fractions[k - 1]);
    for (o, (a, b)) in out.iter_mut().zip(rows[k - 1].iter().zip(&rows[k])) {
        *o = a + w * (b - a);
    }
}

/// Guess of a whole problem.
#[derive(Clone, Debug)]
pub struct Guess {
    /// One guess per phase.
    pub phases: Vec<PhaseGuess>,
    /// Static parameters.
    pub parameters: Vec<f64>,
    /// Multipliers of the endpoint constraints, when the guess stands on an earlier solution.
    pub constraint_multipliers: Option<Vec<Vec<f64>>>,
}

impl Guess {
    /// Straight lines between what the bounds allow, with the constant controls that follow them best. Where nothing bounds a
    /// final time it is the one for which they do, if that makes a difference. A state without ends of its own stays at what its
    /// phase takes over from an earlier one.
    #[must_use]
    pub fn linear(ocp: &Ocp) -> Self {
        let parameters: Vec<f64> = ocp.parameters.iter().map(|p| p.bounds.representative()).collect();
        let mut phases: Vec<PhaseGuess> = Vec::with_capacity(ocp.phases.len());
        for (phase, sources) in ocp.phases.iter().zip(linkage::sources(ocp)) {
            let (times, mut ends) = PhaseGuess::straight(phase);
            for (k, (state, source)) in phase.states.iter().zip(sources).enumerate() {
                let bounds = state.variable.bounds;
                let Some(source) = source.filter(|_| state.has_free_ends()) else { continue };
                let mut from = vec![0.0; ocp.phases[source.phase].states.len()];
                phases[source.phase].state(1.0, &mut from);
                let value = bounds.clamp(from[source.state] + source.offset);
                ends.iter_mut().for_each(|end| end[k] = value);
            }
            phases.push(PhaseGuess::following(phase, &parameters, (times, ends)));
        }
        Self::from_phases(ocp, phases)
    }

    /// Given phases, parameters from the middle of their bounds.
    #[must_use]
    pub fn from_phases(ocp: &Ocp, phases: Vec<PhaseGuess>) -> Self {
        let parameters = ocp.parameters.iter().map(|p| p.bounds.representative()).collect();
        Self { phases, parameters, constraint_multipliers: None }.with_accumulated(ocp)
    }

    /// An earlier trajectory.
    #[must_use]
    pub fn earlier(trajectory: &Trajectory) -> Self {
        Self {
            phases: trajectory.phases.iter().cloned().map(PhaseGuess::earlier).collect(),
            parameters: trajectory.parameters.clone(),
            constraint_multipliers: trajectory.constraint_multipliers.clone(),
        }
    }

    /// The states, controls and times of a trajectory, joined by straight lines, and nothing else of it.
    ///
    /// # Errors
    /// [`OcpError::Guess`] when a value is not finite.
    pub fn along(trajectory: &Trajectory) -> Result<Self, OcpError> {
        let phase = |t: &PhaseTrajectory| {
            let mut times: Vec<f64> = t.nodes().map(|(time, _)| time).collect();
            times.dedup_by(|next, before| *next <= *before);
            let states = times.iter().map(|time| t.state_at(*time)).collect();
            let controls = times.iter().map(|time| t.control_at(*time)).collect();
            PhaseGuess::samples(&times, states, controls)
        };
        Ok(Self {
            phases: trajectory.phases.iter().map(phase).collect::<Result<_, _>>()?,
            parameters: trajectory.parameters.clone(),
            constraint_multipliers: None,
        })
    }

    /// Checks that the guess has the problem's sizes and positive durations.
    ///
    /// # Errors
    /// [`OcpError::Guess`] naming the phase.
    pub fn check(&self, ocp: &Ocp) -> Result<(), OcpError> {
        let fail = |place: &str, reason: String| Err(OcpError::Guess { place: place.into(), reason });
        if self.phases.len() != ocp.phases.len() || self.parameters.len() != ocp.parameters.len() {
            return fail(
                &ocp.name,
                format!(
                    "expected {} phases and {} parameters, found {} and {}",
                    ocp.phases.len(),
                    ocp.parameters.len(),
                    self.phases.len(),
                    self.parameters.len()
                ),
            );
        }
        for (g, p) in self.phases.iter().zip(&ocp.phases) {
            if let Some(missing) = p.controls.get(g.widths().1).filter(|_| g.widths().0 == p.states.len()) {
                return fail(&p.name, format!("it has no control `{}`", missing.name));
            }
            let (found, expected) = (g.widths(), (p.states.len(), p.controls.len()));
            if found != expected {
                return fail(
                    &p.name,
                    format!("expected (states, controls) = {expected:?} per row, found {found:?}"),
                );
            }
            let duration = g.final_time - g.initial_time;
            if !(duration > 0.0 && duration.is_finite()) {
                return fail(&p.name, format!("its duration {duration} {} must be positive", p.time_unit));
            }
        }
        Ok(())
    }
}
