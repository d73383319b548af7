//! The motion from the start of a guess with its controls, and a mesh that carries it.
//!
//! A step of the integrator of order eight is as long as an interval of the mesh may be: of a few points, it has about that order. So the
//! number of steps says how many intervals a motion needs, such as an oscillation that turns many times.

use std::cell::RefCell;

use apsides_basis::Lgr;
use apsides_ocp::{Guess, Mesh, Ocp, Phase, PhaseGuess, PhaseMesh, Scaling};
use apsides_ode::{DenseSolution, FnSystem, Integrator, OdeSettings, Status, Tolerance};

use crate::RadauError;

/// Relative error of a step: a start need not be closer.
const TOLERANCE: f64 = 1e-6;
/// Most steps of a phase: a stiff or a wild motion is no start.
const MOST_STEPS: usize = 1000;
/// Points of an interval that is as long as a step.
const POINTS: usize = 5;

/// A flight from the start of a guess.
pub(crate) enum Flight {
    /// The flight as a guess; the mesh at hand has an interval for each of its steps, on average.
    IsCarried(Guess),
    /// The flight as a guess, on a mesh with intervals as long as its steps.
    TakesMore(Guess, Mesh),
    /// There is none: the motion is not finite, or takes too many steps.
    Fails,
}

/// Flies each phase with the controls of a guess, for its duration. A phase starts where the one before it ends if it has as many states, and
/// a start that is not fixed.
pub(crate) fn fly(ocp: &Ocp, guess: &Guess, mesh: &Mesh) -> Result<Flight, RadauError> {
    let scaling = Scaling::new(ocp, guess);
    let mut flights: Vec<(PhaseGuess, PhaseMesh)> = Vec::new();
    let mut takes_more = false;
    let mut end: Option<(f64, Vec<f64>)> = None;
    for (k, (phase, steered)) in ocp.phases.iter().zip(&guess.phases).enumerate() {
        let mut start = vec![0.0; phase.states.len()];
        steered.state(0.0, &mut start);
        let mut initial_time = steered.initial_time;
        let is_open = phase.states.iter().any(|s| !s.initial.is_fixed());
        if let Some((time, state)) = end.filter(|(_, state)| is_open && state.len() == start.len()) {
            (initial_time, start) = (time, state);
        }
        let from = Start { time: initial_time, state: start, scales: &scaling.phases[k].states };
        let Some(dense) = from.flight(phase, steered, &guess.parameters) else { return Ok(Flight::Fails) };
        let steps = dense.times().len() - 1;
        takes_more |= steps > mesh.phases[k].intervals();
        let finer = if steps > mesh.phases[k].intervals() {
            PhaseMesh::new(fractions(&dense), vec![POINTS; steps])?
        } else {
            mesh.phases[k].clone()
        };
        let Some(flown) = sampled(phase, steered, &dense, &finer)? else { return Ok(Flight::Fails) };
        let mut last = vec![0.0; phase.states.len()];
        flown.state(1.0, &mut last);
        end = Some((flown.final_time, last));
        flights.push((flown, finer));
    }
    let (phases, meshes) = flights.into_iter().unzip();
    let flown = Guess { phases, constraint_multipliers: None, parameters: guess.parameters.clone() };
    Ok(if takes_more { Flight::TakesMore(flown, Mesh { phases: meshes }) } else { Flight::IsCarried(flown) })
}

struct Start<'a> {
    time: f64,
    state: Vec<f64>,
    scales: &'a [f64],
}

impl Start<'_> {
    fn flight(&self, phase: &Phase, steered: &PhaseGuess, parameters: &[f64]) -> Option<DenseSolution> {
        let (nx, nu) = (phase.states.len(), phase.controls.len());
        let duration = steered.final_time - steered.initial_time;
        let dynamics = phase.dynamics.as_ref();
        let inputs = RefCell::new(vec![0.0; dynamics.inputs()]);
        let system = FnSystem::new(nx, |t: f64, x: &[f64], rates: &mut [f64]| {
            let z = &mut *inputs.borrow_mut();
            z[..nx].copy_from_slice(x);
            steered.control((t - self.time) / duration, &mut z[nx..nx + nu]);
            if let Some((time, rest)) = z[nx + nu..].split_last_mut() {
                rest.copy_from_slice(&parameters[..rest.len()]);
                *time = t;
            }
            dynamics.value(z, rates);
        });
        let settings = OdeSettings {
            absolute_tolerance: Tolerance::PerComponent(self.scales.iter().map(|s| TOLERANCE * s).collect()),
            max_steps: MOST_STEPS,
            ..OdeSettings::with_tolerance(TOLERANCE)
        };
        let mut integrator = Integrator::new(nx, settings).ok()?;
        let (summary, dense) =
            integrator.solve_dense(&system, self.time, &self.state, self.time + duration).ok()?;
        (summary.status == Status::Completed).then_some(dense)
    }
}

/// The ends of the steps as fractions of the phase.
fn fractions(dense: &DenseSolution) -> Vec<f64> {
    let (start, end) = (dense.start(), dense.end());
    let last = dense.times().len() - 1;
    let fraction = |(k, t): (usize, &f64)| if k == last { 1.0 } else { (t - start) / (end - start) };
    dense.times().iter().enumerate().map(fraction).collect()
}

/// The flight at the nodes of a mesh; none if a value is not finite.
fn sampled(
    phase: &Phase,
    steered: &PhaseGuess,
    dense: &DenseSolution,
    mesh: &PhaseMesh,
) -> Result<Option<PhaseGuess>, RadauError> {
    let (start, duration) = (dense.start(), dense.end() - dense.start());
    let (mut times, mut states, mut controls) = (Vec::new(), Vec::new(), Vec::new());
    let mut sample = |fraction: f64| {
        let time = if fraction < 1.0 { start + fraction * duration } else { dense.end() };
        let (mut x, mut u) = (vec![0.0; phase.states.len()], vec![0.0; phase.controls.len()]);
        let flown = dense.evaluate(time, &mut x);
        steered.control(fraction, &mut u);
        times.push(time);
        states.push(x);
        controls.push(u);
        flown.is_ok()
    };
    let mut all = true;
    for (ends, &points) in mesh.fractions().windows(2).zip(mesh.points()) {
        for tau in Lgr::shared(points)?.nodes() {
            all &= sample(ends[0] + 0.5 * (tau + 1.0) * (ends[1] - ends[0]));
        }
    }
    all &= sample(1.0);
    Ok(if all { PhaseGuess::samples(&times, states, controls).ok() } else { None })
}
