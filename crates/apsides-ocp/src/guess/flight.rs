//! Guesses that fly: the equations of motion integrated with given controls.

use crate::{Guess, Ocp, OcpError, Phase, PhaseGuess};

/// Steps of a flight, which are the intervals of the guess.
const STEPS: usize = 100;

/// A motion that leaves the sizes that are known by this runs away, if it grows in the second half of its time by [`GROWS`].
const RUNS_AWAY: f64 = 1e3;
/// A motion of powers of time grows less.
const GROWS: f64 = 1e2;

impl Guess {
    /// The flight of each phase with the controls that `control` gives for the index of the phase, the time and the states, from the
    /// start and for the duration that [`Guess::linear`] has. A phase starts where the one before it ends if it has as many states.
    ///
    /// # Errors
    /// [`OcpError::Guess`] when the flight or a control is not finite, or a control is missing.
    pub fn fly(ocp: &Ocp, control: impl Fn(usize, f64, &[f64]) -> Vec<f64>) -> Result<Self, OcpError> {
        Self::linear(ocp).flown(ocp, control)
    }

    /// The flight from the start of the guess with its controls, those with bounds on both sides in the middle of them, if it meets all
    /// that is asked of states and does not run away; the guess itself if it does not. A start that moves is nearer to an optimum than one at
    /// rest where nothing is asked at the end.
    #[must_use]
    pub fn in_motion(self, ocp: &Ocp) -> Self {
        if !ocp.constraints.is_empty() {
            return self;
        }
        let steady: Vec<Vec<f64>> = ocp.phases.iter().zip(&self.phases).map(steady_controls).collect();
        let stays = |flown: &Self| {
            let mut flights = ocp.phases.iter().zip(&self.phases).zip(&flown.phases);
            flights.all(|((phase, guess), flight)| is_within(flight, &sizes(phase, guess)))
        };
        match self.flown(ocp, |k, _, _| steady[k].clone()) {
            Ok(flown) if ocp.phases.iter().zip(&flown.phases).all(meets_bounds) && stays(&flown) => flown,
            _ => self,
        }
    }

    /// The flight with the times, parameters and start of the guess.
    fn flown(&self, ocp: &Ocp, control: impl Fn(usize, f64, &[f64]) -> Vec<f64>) -> Result<Self, OcpError> {
        let mut phases: Vec<PhaseGuess> = Vec::new();
        for (k, (phase, guess)) in ocp.phases.iter().zip(&self.phases).enumerate() {
            let mut start = vec![0.0; phase.states.len()];
            guess.state(0.0, &mut start);
            let duration = guess.final_time - guess.initial_time;
            let mut initial_time = guess.initial_time;
            let before = phases.last().filter(|_| ocp.phases[k - 1].states.len() == start.len());
            if let Some(before) = before {
                before.state(1.0, &mut start);
                initial_time = before.final_time;
            }
            let times = (initial_time, initial_time + duration);
            phases.push(flight(phase, &self.parameters, times, start, |t, x| control(k, t, x))?);
        }
        Ok(Self { phases, ..self.clone() })
    }
}

/// The controls of a guess in the middle of its phase, those with bounds on both sides in the middle of them.
fn steady_controls((phase, guess): (&Phase, &PhaseGuess)) -> Vec<f64> {
    let mut steady = vec![0.0; phase.controls.len()];
    guess.control(0.5, &mut steady);
    for (value, control) in steady.iter_mut().zip(&phase.controls) {
        if control.bounds.lower.is_finite() && control.bounds.upper.is_finite() {
            *value = control.bounds.representative();
        }
    }
    steady
}

/// True if the states of a flight are within their bounds, and at its end within those there.
fn meets_bounds((phase, flight): (&Phase, &PhaseGuess)) -> bool {
    let mut states = vec![0.0; phase.states.len()];
    (0..=STEPS).all(|step| {
        flight.state(step as f64 / STEPS as f64, &mut states);
        phase.states.iter().zip(&states).all(|(state, value)| {
            let asked = if step == STEPS { &state.terminal } else { &state.variable.bounds };
            asked.excess(*value) <= 0.0
        })
    })
}

/// The largest magnitude that is known of each state.
fn sizes(phase: &Phase, guess: &PhaseGuess) -> Vec<f64> {
    let (mut start, mut end) = (vec![0.0; phase.states.len()], vec![0.0; phase.states.len()]);
    guess.state(0.0, &mut start);
    guess.state(1.0, &mut end);
    let ends = start.iter().zip(&end).map(|(a, b)| a.abs().max(b.abs()));
    phase.states.iter().zip(ends).map(|(s, met)| s.variable.size().unwrap_or(1.0).max(met)).collect()
}

/// True unless a state leaves these sizes by far, as an exponential does: that of an unstable motion says nothing of that of a solution.
fn is_within(flight: &PhaseGuess, sizes: &[f64]) -> bool {
    let mut states = vec![0.0; sizes.len()];
    let mut largest = |steps: std::ops::RangeInclusive<usize>| {
        let mut largest = vec![0.0f64; sizes.len()];
        for step in steps {
            flight.state(step as f64 / STEPS as f64, &mut states);
            largest.iter_mut().zip(&states).for_each(|(largest, state)| *largest = largest.max(state.abs()));
        }
        largest
    };
    let (before, after) = (largest(0..=STEPS / 2), largest(STEPS / 2..=STEPS));
    let runs_away = |((before, after), size): ((&f64, &f64), &f64)| {
        *after > RUNS_AWAY * size && *after > GROWS * before.max(*size)
    };
    !before.iter().zip(&after).zip(sizes).any(runs_away)
}

/// One phase by the classical Runge-Kutta method.
fn flight(
    phase: &Phase,
    parameters: &[f64],
    times: (f64, f64),
    start: Vec<f64>,
    control: impl Fn(f64, &[f64]) -> Vec<f64>,
) -> Result<PhaseGuess, OcpError> {
    let fail = |reason: String| OcpError::Guess { place: phase.name.clone(), reason };
    let dynamics = phase.dynamics.as_ref();
    let steer = |t: f64, x: &[f64]| {
        let u = control(t, x);
        match phase.controls.get(u.len()) {
            Some(missing) => Err(fail(format!("the flight has no control `{}`", missing.name))),
            None => Ok(u),
        }
    };
    let rate = |t: f64, x: &[f64]| {
        let mut z = x.to_vec();
        z.extend(&steer(t, x)?[..phase.controls.len()]);
        if phase.takes_parameters(dynamics) {
            z.extend_from_slice(parameters);
        }
        z.push(t);
        let mut rates = vec![0.0; x.len()];
        dynamics.value(&z, &mut rates);
        Ok(rates)
    };
    let step = (times.1 - times.0) / STEPS as f64;
    let moved =
        |x: &[f64], rates: &[f64], h: f64| x.iter().zip(rates).map(|(x, r)| x + h * r).collect::<Vec<f64>>();
    let (mut at, mut states, mut controls) = (vec![times.0], vec![start], Vec::new());
    for k in 0..STEPS {
        let (t, x) = (at[k], &states[k]);
        controls.push(steer(t, x)?);
        let a = rate(t, x)?;
        let b = rate(t + 0.5 * step, &moved(x, &a, 0.5 * step))?;
        let c = rate(t + 0.5 * step, &moved(x, &b, 0.5 * step))?;
        let d = rate(t + step, &moved(x, &c, step))?;
        let mean: Vec<f64> = (0..x.len()).map(|i| (a[i] + 2.0 * (b[i] + c[i]) + d[i]) / 6.0).collect();
        let next = moved(x, &mean, step);
        if !next.iter().all(|v| v.is_finite()) {
            return Err(fail(format!("the flight is not finite after {t} {}", phase.time_unit)));
        }
        at.push(times.0 + (k + 1) as f64 * step);
        states.push(next);
    }
    controls.push(steer(times.1, &states[STEPS])?);
    PhaseGuess::samples(&at, states, controls)
}
