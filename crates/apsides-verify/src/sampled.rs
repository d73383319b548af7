//! Trajectories from samples: times, states and controls of whatever program.
//!
//! Between the samples the controls are constant, linear or cubic, or where the samples say of which intervals they are the nodes, the polynomials
//! through those, whichever leads the flight from the first sample closest to the others. The states are those of that flight, so that
//! everything else is judged as for any trajectory; whether the samples are those of it is a check of its own. Two samples at one time are a jump of the controls.

use std::borrow::Cow;
use std::sync::Arc;

use apsides_basis::{Barycentric, Lobatto};
use apsides_ocp::{
    Guess, Ocp, OcpError, PhaseMesh, PhaseTrajectory, PiecewisePolynomial, Scaling, Segment, Trajectory,
};

use crate::ends::Ends;
use crate::simulation::{self, Flight, Places};
use crate::worst::Worst;
use crate::{Check, CheckKind, VerifyError, VerifySettings};

/// Nodes of the states in each interval.
const NODES: usize = 6;

/// The samples of one phase.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseSamples {
    /// Times, not decreasing.
    pub times: Vec<f64>,
    /// States at each time, in the order of the phase. Integrals that are states, the last ones, may be left away.
    pub states: Vec<Vec<f64>>,
    /// Controls at each time, in the order of the phase.
    pub controls: Vec<Vec<f64>>,
    /// The interval of each sample, not decreasing, and whether it is a node of the control polynomial there, if that is known.
    pub nodes: Option<Vec<(usize, bool)>>,
}

/// The course of the controls between two samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// The control of the earlier sample.
    Constant,
    /// A straight line.
    Linear,
    /// The cubic through the nearest four samples without a jump between them.
    Cubic,
    /// The polynomial through the nodes of each interval ([`PhaseSamples::nodes`]); a cubic where they are not known.
    Polynomial,
}

impl Interpolation {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Constant, Self::Linear, Self::Cubic, Self::Polynomial];

    /// The word for it.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Linear => "linear",
            Self::Cubic => "cubic",
            Self::Polynomial => "polynomial",
        }
    }
}

/// A trajectory made of samples.
#[derive(Clone, Debug)]
pub struct Sampled {
    /// The flight under the interpolated controls.
    pub trajectory: Trajectory,
    /// The interpolation that was used.
    pub interpolation: Interpolation,
    /// Largest distance of a sampled state from the flight, relative to the scale of the state; infinite if the flight stops.
    pub deviation: f64,
    /// Name of the state of largest distance, with its time.
    pub place: String,
    /// Per phase that was flown, whether the samples are those of the flight. The certificate of [`Self::trajectory`] alone is that of the flight.
    pub checks: Vec<Check>,
}

/// Makes a trajectory of samples, by the interpolation given or the one that fits best.
///
/// # Errors
/// [`VerifyError::Trajectory`] when samples and problem differ in their sizes, times decrease, or a number is not finite.
pub fn sampled(
    ocp: &Ocp,
    phases: &[PhaseSamples],
    parameters: &[f64],
    interpolation: Option<Interpolation>,
    settings: &VerifySettings,
) -> Result<Sampled, VerifyError> {
    settings.check()?;
    check(ocp, phases, parameters)?;
    let extended: Vec<_> =
        ocp.phases.iter().zip(phases).map(|(phase, s)| with_integrals(phase, s, parameters)).collect();
    let has_nodes = phases.iter().any(|samples| samples.nodes.is_some());
    let known = Interpolation::ALL.into_iter().filter(|i| has_nodes || *i != Interpolation::Polynomial);
    let candidates = interpolation.map_or_else(|| known.collect(), |i| vec![i]);
    let mut best: Option<Sampled> = None;
    for interpolation in candidates {
        let found = fly(ocp, phases, &extended, parameters, interpolation, settings)?;
        if best.as_ref().is_none_or(|b| found.deviation < b.deviation) {
            best = Some(found);
        }
    }
    best.ok_or_else(|| unfit("no interpolation was given"))
}

fn unfit(reason: impl Into<String>) -> VerifyError {
    VerifyError::Trajectory(OcpError::Mesh { place: "samples".into(), reason: reason.into() })
}

fn check(ocp: &Ocp, phases: &[PhaseSamples], parameters: &[f64]) -> Result<(), VerifyError> {
    if phases.len() != ocp.phases.len() {
        return Err(unfit(format!("{} phases, expected {}", phases.len(), ocp.phases.len())));
    }
    if parameters.len() != ocp.parameters.len() {
        return Err(unfit(format!(
            "{} static parameters, expected {}",
            parameters.len(),
            ocp.parameters.len()
        )));
    }
    for (phase, samples) in ocp.phases.iter().zip(phases) {
        let name = &phase.name;
        let PhaseSamples { times, states, controls, nodes } = samples;
        if times.len() != states.len() || times.len() != controls.len() {
            let (x, u) = (states.len(), controls.len());
            return Err(unfit(format!("phase `{name}`: {} times, {x} states, {u} controls", times.len())));
        }
        if let Some(k) = times.windows(2).position(|w| w[1] < w[0]) {
            return Err(unfit(format!("phase `{name}`: the times decrease after sample {}", k + 1)));
        }
        if times.len() < 2 || times[0] >= times[times.len() - 1] {
            return Err(unfit(format!("phase `{name}`: at least two samples at different times are needed")));
        }
        if let Some(nodes) = nodes {
            let follows = |w: &[(usize, bool)]| w[0].0 <= w[1].0 && w[1].0 - w[0].0 <= 1;
            if nodes.len() != times.len() || !nodes.windows(2).all(follows) {
                return Err(unfit(format!(
                    "phase `{name}`: the intervals of the samples do not follow each other"
                )));
            }
        }
        let sizes = |rows: &[Vec<f64>], n: usize| rows.iter().all(|r| r.len() == n);
        let has_states = sizes(states, phase.model_states()) || sizes(states, phase.states.len());
        if !has_states || !sizes(controls, phase.controls.len()) {
            let (x, u) = (phase.model_states(), phase.controls.len());
            return Err(unfit(format!(
                "phase `{name}`: expected {x} states and {u} controls in every sample"
            )));
        }
        let finite = times.iter().chain(states.iter().flatten()).chain(controls.iter().flatten());
        if !finite.chain(parameters).all(|v| v.is_finite()) {
            return Err(unfit(format!("phase `{name}`: every number must be finite")));
        }
    }
    Ok(())
}

fn fly(
    ocp: &Ocp,
    phases: &[PhaseSamples],
    extended: &[Cow<'_, PhaseSamples>],
    parameters: &[f64],
    interpolation: Interpolation,
    settings: &VerifySettings,
) -> Result<Sampled, VerifyError> {
    let straight = |(phase, s): (&apsides_ocp::Phase, &Cow<'_, PhaseSamples>)| {
        let control = match (&s.nodes, interpolation) {
            (Some(nodes), Interpolation::Polynomial) => through_nodes(s, nodes, phase.controls.len())?,
            _ => controls(s, phase.controls.len(), interpolation)?,
        };
        let state = lines(s, phase.states.len())?;
        let (first, last) = (s.times[0], s.times[s.times.len() - 1]);
        let intervals = control.segments().len();
        let ends = control.breaks();
        let fractions = (0..=intervals).map(|k| match k {
            0 => 0.0,
            k if k == intervals => 1.0,
            k => (ends[k] - first) / (last - first),
        });
        Ok(PhaseTrajectory {
            name: phase.name.clone(),
            initial_time: first,
            final_time: last,
            mesh: PhaseMesh::new(fractions.collect(), vec![NODES - 1; intervals])?,
            state,
            control,
            costate: None,
            path_multipliers: None,
            contacts: Vec::new(),
            integral_multipliers: None,
            interval_errors: vec![0.0; intervals],
        })
    };
    let found: Result<Vec<_>, OcpError> = ocp.phases.iter().zip(extended).map(straight).collect();
    let mut trajectory = Trajectory {
        phases: found?,
        parameters: parameters.to_vec(),
        objective: f64::NAN,
        constraint_multipliers: None,
    };
    let scaling = Scaling::new(ocp, &Guess::earlier(&trajectory));
    let stays = |k: usize, flight: &Flight| {
        let worst = distances(&phases[k], &trajectory.phases[k], flight);
        let mut parts =
            worst.iter().zip(&scaling.phases[k].states).map(|((distance, _), scale)| distance / scale);
        flight.failure.is_none() && parts.all(|part| part <= settings.path_tolerance)
    };
    // The states flown are joined at the ends of intervals alone.
    let flights = simulation::fly_in_pieces(ocp, &trajectory, &scaling, settings, Places::Breaks, stays);
    let (mut deviation, mut place, mut checks) = (0.0f64, String::new(), Vec::new());
    for (k, (samples, flight)) in phases.iter().zip(&flights).enumerate() {
        if let Some(failure) = &flight.failure {
            deviation = f64::INFINITY;
            place = format!("phase `{}` stops at {}: {}", ocp.phases[k].name, failure.time, failure.reason);
            continue;
        }
        let phase = &ocp.phases[k];
        let mut worst = Worst::default();
        let states = phase.states.iter().zip(&scaling.phases[k].states);
        for ((state, scale), (distance, time)) in
            states.zip(distances(samples, &trajectory.phases[k], flight))
        {
            let at = || format!("{}, {}", state.variable.name, crate::place::place(phase, time));
            let limit = settings.limit_of_state(state, *scale);
            worst.consider(distance, limit, &state.variable.unit, at);
            if distance / scale > deviation {
                (deviation, place) = (distance / scale, at());
            }
        }
        let name = format!("samples along {} against the re-simulation", phase.name);
        checks.extend(worst.into_check(name, CheckKind::Feasibility));
        trajectory.phases[k].state = flown(&trajectory.phases[k], flight)?;
    }
    let integrals: Vec<_> = flights.iter().map(|f| f.integrals.clone()).collect();
    trajectory.objective = Ends::of(&trajectory).objective(ocp, &integrals);
    Ok(Sampled { trajectory, interpolation, deviation, place, checks })
}

/// The states with the integrals that are states, where they were left away, by the trapezoidal rule.
fn with_integrals<'a>(
    phase: &apsides_ocp::Phase,
    samples: &'a PhaseSamples,
    parameters: &[f64],
) -> Cow<'a, PhaseSamples> {
    if samples.states[0].len() == phase.states.len() {
        return Cow::Borrowed(samples);
    }
    let rates_at = |k: usize| {
        phase.integral_rates(&samples.states[k], &samples.controls[k], parameters, samples.times[k])
    };
    let mut extended = samples.clone();
    let mut before = rates_at(0);
    let mut sums = vec![0.0; before.len()];
    for (k, x) in extended.states.iter_mut().enumerate() {
        let here = rates_at(k);
        let step = if k == 0 { 0.0 } else { samples.times[k] - samples.times[k - 1] };
        for ((q, a), b) in sums.iter_mut().zip(&before).zip(&here) {
            let share = 0.5 * step * (a + b);
            // An integrand without a value leaves the flight to judge.
            *q += if share.is_finite() { share } else { 0.0 };
        }
        x.extend_from_slice(&sums);
        before = here;
    }
    Cow::Owned(extended)
}

/// Intervals between samples at different times: indices of the samples at their ends.
fn intervals(samples: &PhaseSamples) -> impl Iterator<Item = (usize, usize)> + '_ {
    (1..samples.times.len()).filter(|k| samples.times[*k] > samples.times[k - 1]).map(|k| (k - 1, k))
}

fn breaks(samples: &PhaseSamples) -> Vec<f64> {
    std::iter::once(samples.times[0]).chain(intervals(samples).map(|(_, k)| samples.times[k])).collect()
}

fn lines(samples: &PhaseSamples, states: usize) -> Result<PiecewisePolynomial, OcpError> {
    let basis = nodes(&[-1.0, 1.0])?;
    let segments = intervals(samples).map(|(a, b)| {
        let values = samples.states[a].iter().chain(&samples.states[b]).copied().collect();
        Segment { basis: Arc::clone(&basis), values }
    });
    PiecewisePolynomial::new(states, breaks(samples), segments.collect())
}

fn nodes(nodes: &[f64]) -> Result<Arc<Barycentric>, OcpError> {
    let fail =
        |e: apsides_basis::BasisError| OcpError::Mesh { place: "samples".into(), reason: e.to_string() };
    Barycentric::new(nodes).map(Arc::new).map_err(fail)
}

/// The polynomial through the nodes of each interval, which lasts from its first sample to that of the next one.
fn through_nodes(
    samples: &PhaseSamples,
    of: &[(usize, bool)],
    count: usize,
) -> Result<PiecewisePolynomial, OcpError> {
    let mut breaks = vec![samples.times[0]];
    let mut segments = Vec::new();
    let mut first = 0;
    for interval in of.chunk_by(|a, b| a.0 == b.0) {
        let (begin, next) = (first, first + interval.len());
        first = next;
        let (start, end) = (samples.times[begin], samples.times[next.min(samples.times.len() - 1)]);
        if end <= start {
            continue;
        }
        let chosen: Vec<usize> = (begin..next).filter(|k| of[*k].1).collect();
        let chosen = if chosen.is_empty() { vec![begin] } else { chosen };
        let places: Vec<f64> =
            chosen.iter().map(|k| 2.0 * (samples.times[*k] - start) / (end - start) - 1.0).collect();
        let values = chosen.iter().flat_map(|k| samples.controls[*k].iter().copied()).collect();
        breaks.push(end);
        segments.push(Segment { basis: nodes(&places)?, values });
    }
    PiecewisePolynomial::new(count, breaks, segments)
}

fn controls(
    samples: &PhaseSamples,
    count: usize,
    interpolation: Interpolation,
) -> Result<PiecewisePolynomial, OcpError> {
    // The same Gauss points everywhere, none at the ends, where a control may jump.
    let places = [
        -0.861_136_311_594_052_6,
        -0.339_981_043_584_856_26,
        0.339_981_043_584_856_26,
        0.861_136_311_594_052_6,
    ];
    let basis = nodes(&places)?;
    let all: Vec<_> = intervals(samples).collect();
    let mut segments = Vec::with_capacity(all.len());
    for (k, &(a, b)) in all.iter().enumerate() {
        let support: Vec<usize> = match interpolation {
            Interpolation::Constant => vec![a],
            Interpolation::Linear => vec![a, b],
            Interpolation::Cubic | Interpolation::Polynomial => {
                // Neighbours that are joined to the interval without a jump.
                let mut support = vec![a, b];
                let mut before = k;
                let mut after = k;
                while support.len() < 4 {
                    let earlier = before.checked_sub(1).filter(|i| all[*i].1 == all[before].0);
                    let later =
                        Some(after + 1).filter(|i| all.get(*i).is_some_and(|next| next.0 == all[after].1));
                    let balanced = k - before <= after - k;
                    match (earlier, later) {
                        (Some(i), _) if balanced || later.is_none() => {
                            support.insert(0, all[i].0);
                            before = i;
                        }
                        (_, Some(i)) => {
                            support.push(all[i].1);
                            after = i;
                        }
                        _ => break,
                    }
                }
                support
            }
        };
        let (start, end) = (samples.times[a], samples.times[b]);
        let times: Vec<f64> = support.iter().map(|i| samples.times[*i]).collect();
        let mut values = Vec::with_capacity(places.len() * count);
        for place in places {
            let t = start + 0.5 * (place + 1.0) * (end - start);
            for j in 0..count {
                values.push(lagrange(&times, |i| samples.controls[support[i]][j], t));
            }
        }
        segments.push(Segment { basis: Arc::clone(&basis), values });
    }
    PiecewisePolynomial::new(count, breaks(samples), segments)
}

fn lagrange(times: &[f64], value: impl Fn(usize) -> f64, t: f64) -> f64 {
    let term = |i: usize| {
        let others = (0..times.len()).filter(|k| *k != i);
        value(i) * others.map(|k| (t - times[k]) / (times[i] - times[k])).product::<f64>()
    };
    (0..times.len()).map(term).sum()
}

/// Largest distance of each state from the flight, with its time.
fn distances(samples: &PhaseSamples, found: &PhaseTrajectory, flight: &Flight) -> Vec<(f64, f64)> {
    let nx = found.state.dimension();
    let (mut scratch, mut x) = (vec![0.0; flight.dimension()], vec![0.0; nx]);
    let mut worst = vec![(0.0, found.initial_time); nx];
    for (t, sample) in samples.times.iter().zip(&samples.states) {
        flight.state(found.control.segment_at(*t), *t, &mut scratch, &mut x);
        for ((w, x), s) in worst.iter_mut().zip(&x).zip(sample) {
            if (x - s).abs() > w.0 {
                *w = ((x - s).abs(), *t);
            }
        }
    }
    worst
}

/// The states of a flight on Lobatto points of each interval.
fn flown(found: &PhaseTrajectory, flight: &Flight) -> Result<PiecewisePolynomial, VerifyError> {
    let nx = found.state.dimension();
    let rule = Lobatto::new(NODES).map_err(|e| unfit(e.to_string()))?;
    let basis = nodes(rule.nodes())?;
    let mut scratch = vec![0.0; flight.dimension()];
    let mut segments = Vec::new();
    for leg in 0..flight.legs() {
        let (a, b) = flight.leg_times(leg);
        let mut values = vec![0.0; NODES * nx];
        for (s, out) in basis.nodes().iter().zip(values.chunks_exact_mut(nx.max(1))) {
            flight.state(leg, a + 0.5 * (s + 1.0) * (b - a), &mut scratch, out);
        }
        segments.push(Segment { basis: Arc::clone(&basis), values });
    }
    Ok(PiecewisePolynomial::new(nx, found.control.breaks().to_vec(), segments)?)
}
