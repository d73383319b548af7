//! From the burns to the whole flight: coasts in closed form, with their costates.
//!
//! Along a coast all elements are constant but the true longitude. With the time `T(x, L2)` left until the next ignition at `L2`, and
//! `J` the minimised objective, which depends on when the ignition is where the flight time is limited:
//!
//! ```text
//! dJ/dx along the coast = dJ/dx at the ignition + dJ/dt dT/dx,     dJ/dt = -H
//! ```
//!
//! Without a limit `H = 0`: the costates of the elements are constant, that of the longitude is zero.

use std::f64::consts::PI;
use std::sync::Arc;

use apsides_ad::Dual;
use apsides_basis::{Barycentric, Lgr};
use apsides_dynamics::equinoctial::{ECCENTRICITY_F, ECCENTRICITY_G, SEMI_LATUS_RECTUM, TRUE_LONGITUDE};
use apsides_ocp::{
    EndpointConstraint, EndpointInput, Ocp, Phase, PhaseMesh, PhaseTrajectory, PiecewisePolynomial, Segment,
    Trajectory,
};

use super::coast::Conic;
use super::injection::GeoInjection;
use super::phases::{FLIGHT_TIME, coast_name};
use apsides_pipeline::Error;

/// Collocation points of each interval of a coast, and the eccentric longitude that an interval spans at most: the polynomials are
/// exact to rounding.
const POINTS: usize = 12;
const INTERVAL_ANGLE: f64 = PI / 10.0;

/// The whole flight of a solution of the problem with the burns alone.
pub(super) fn expand(
    injection: &GeoInjection,
    reduced: &Ocp,
    whole: &Ocp,
    solution: &Trajectory,
) -> Result<Trajectory, Error> {
    let n = solution.phases.len();
    let mut phases: Vec<PhaseTrajectory> = Vec::with_capacity(2 * n - 1);
    let hamiltonian =
        if injection.flight_time_limit.is_some() { hamiltonian(reduced, solution) } else { 0.0 };
    for (k, burn) in solution.phases.iter().enumerate() {
        let begin = phases.last().map_or(0.0, |p| p.final_time);
        phases.push(shifted(burn, begin - burn.initial_time)?);
        let Some(next) = solution.phases.get(k + 1) else { break };
        let coast = Coast { injection, burn, next, hamiltonian };
        phases.push(coast.trajectory(k, begin + burn.final_time - burn.initial_time)?);
    }
    let costates = phases.iter().all(|p| p.costate.is_some());
    let constraint_multipliers = match &solution.constraint_multipliers {
        Some(given) if costates => Some(multipliers(reduced, given, whole, &phases, hamiltonian)),
        _ => None,
    };
    Ok(Trajectory {
        phases,
        parameters: solution.parameters.clone(),
        objective: solution.objective,
        constraint_multipliers,
    })
}

/// The burns of a whole flight, each from the earliest time at which it may begin, as a start of the problem that has them alone.
pub(super) fn reduce(reduced: &Ocp, flight: &Trajectory) -> Result<Trajectory, Error> {
    let burns = flight.phases.iter().step_by(2).zip(&reduced.phases);
    let burns = burns.map(|(burn, phase)| shifted(burn, phase.initial_time.clamp(0.0) - burn.initial_time));
    Ok(Trajectory {
        phases: burns.collect::<Result<_, _>>()?,
        constraint_multipliers: None,
        ..flight.clone()
    })
}

/// The same phase, later.
fn shifted(phase: &PhaseTrajectory, delay: f64) -> Result<PhaseTrajectory, Error> {
    let later = |p: &PiecewisePolynomial| {
        let breaks = p.breaks().iter().map(|t| t + delay).collect();
        PiecewisePolynomial::new(p.dimension(), breaks, p.segments().to_vec())
    };
    let optional = |p: &Option<PiecewisePolynomial>| p.as_ref().map(later).transpose();
    Ok(PhaseTrajectory {
        initial_time: phase.initial_time + delay,
        final_time: phase.final_time + delay,
        state: later(&phase.state)?,
        control: later(&phase.control)?,
        costate: optional(&phase.costate)?,
        path_multipliers: optional(&phase.path_multipliers)?,
        ..phase.clone()
    })
}

/// The Hamiltonian of the whole flight: minus the multiplier of the limit on its time, else that of the burns.
fn hamiltonian(reduced: &Ocp, solution: &Trajectory) -> f64 {
    let limit = reduced.constraints.iter().position(|c| c.name == FLIGHT_TIME);
    if let Some((k, multipliers)) = limit.zip(solution.constraint_multipliers.as_ref()) {
        return -multipliers[k][0];
    }
    let means =
        reduced.phases.iter().zip(&solution.phases).filter_map(|(p, found)| mean_hamiltonian(p, found));
    means.sum::<f64>() / solution.phases.len() as f64
}

/// `H = lambda . f`, the mean over the nodes of a phase.
fn mean_hamiltonian(phase: &Phase, found: &PhaseTrajectory) -> Option<f64> {
    let costate = found.costate.as_ref()?;
    let (mut sum, mut count) = (0.0, 0.0);
    let mut lambda = vec![0.0; phase.states.len()];
    let mut rate = lambda.clone();
    for (t, segment) in found.nodes() {
        let mut z = found.state_at(t);
        let mut u = vec![0.0; phase.controls.len()];
        found.control.evaluate_in(segment, t, &mut u);
        costate.evaluate(t, &mut lambda);
        z.extend(u);
        z.push(t);
        phase.dynamics.value(&z, &mut rate);
        sum += lambda.iter().zip(&rate).map(|(l, r)| l * r).sum::<f64>();
        count += 1.0;
    }
    Some(sum / count)
}

/// A coast between two burns of a solution.
struct Coast<'a> {
    injection: &'a GeoInjection,
    burn: &'a PhaseTrajectory,
    next: &'a PhaseTrajectory,
    hamiltonian: f64,
}

impl Coast<'_> {
    fn trajectory(&self, k: usize, begin: f64) -> Result<PhaseTrajectory, Error> {
        let mu = self.injection.mu();
        let dimension = self.injection.coast_states().len();
        let longitude = self.injection.longitude_index();
        let refuse = |reason: String| Error::Conflict { place: coast_name(k), reason };
        let mut state = self.burn.final_state();
        state.truncate(dimension);
        let (from, to) = (state[longitude], self.next.state_at(self.next.initial_time)[longitude]);
        let orbit = self.injection.elements(&state);
        let conic = Conic::new(orbit.semi_latus_rectum, orbit.f, orbit.g);
        if !conic.is_ellipse() {
            return Err(refuse("the orbit before it is not an ellipse".into()));
        }
        let rate = conic.time_per_radian(mu);
        let [first, last] = [from, to].map(|l| conic.eccentric_longitude(l));
        let [mean, end] = [first, last].map(|e| conic.mean_longitude(e));
        let duration = (end - mean) * rate;
        if !(duration > 0.0 && duration.is_finite()) {
            return Err(refuse(format!("its duration is {duration} s")));
        }
        let intervals = (((last - first) / INTERVAL_ANGLE).ceil() as usize).max(1);
        let mut fractions = Vec::with_capacity(intervals + 1);
        for i in 0..=intervals {
            let eccentric = first + (last - first) * i as f64 / intervals as f64;
            fractions.push((conic.mean_longitude(eccentric) - mean) * rate / duration);
        }
        (fractions[0], fractions[intervals]) = (0.0, 1.0);
        let mesh = PhaseMesh::new(fractions, vec![POINTS; intervals])?;
        let final_time = begin + duration;
        let breaks: Vec<f64> = mesh.fractions().iter().map(|f| (1.0 - f) * begin + f * final_time).collect();
        let rule = Lgr::shared(POINTS).map_err(apsides_radau::RadauError::from)?;
        let support = Arc::new(rule.support_basis().clone());
        let nodes = Arc::new(Barycentric::new(rule.nodes()).map_err(apsides_radau::RadauError::from)?);
        let ignition = self.ignition_costate(dimension);
        let (mut states, mut controls, mut costates) = (Vec::new(), Vec::new(), Vec::new());
        let mut nearby = first;
        for w in breaks.windows(2) {
            let (mut x, mut lambda) = (Vec::new(), Vec::new());
            for node in support.nodes() {
                let time = w[0] + 0.5 * (w[1] - w[0]) * (node + 1.0) - begin;
                nearby = conic.eccentric_at(mean + time / rate, nearby);
                state[longitude] = conic.true_longitude(nearby);
                x.extend_from_slice(&state);
                if let Some(ignition) = &ignition {
                    lambda.extend(self.costate(ignition, &state, to));
                }
            }
            states.push(Segment { basis: Arc::clone(&support), values: x });
            controls.push(Segment { basis: Arc::clone(&nodes), values: Vec::new() });
            costates.push(Segment { basis: Arc::clone(&support), values: lambda });
        }
        let polynomial = |dimension, segments| PiecewisePolynomial::new(dimension, breaks.clone(), segments);
        Ok(PhaseTrajectory {
            name: coast_name(k),
            initial_time: begin,
            final_time,
            mesh,
            state: polynomial(dimension, states)?,
            control: polynomial(0, controls)?,
            costate: if ignition.is_some() { Some(polynomial(dimension, costates)?) } else { None },
            path_multipliers: None,
            contacts: Vec::new(),
            integral_multipliers: Some(Vec::new()),
            interval_errors: vec![0.0; intervals],
        })
    }

    /// Costate at the next ignition, where the longitude is free but for its time.
    fn ignition_costate(&self, dimension: usize) -> Option<Vec<f64>> {
        let costate = self.next.costate.as_ref()?;
        let mut lambda = vec![0.0; costate.dimension()];
        costate.evaluate(self.next.initial_time, &mut lambda);
        lambda.truncate(dimension);
        Some(lambda)
    }

    fn costate(&self, ignition: &[f64], state: &[f64], to: f64) -> Vec<f64> {
        let longitude = self.injection.longitude_index();
        let mut lambda = ignition.to_vec();
        lambda[longitude] = 0.0;
        if self.hamiltonian != 0.0 {
            let v = |value, lane| Dual::<4>::variable(value, lane);
            let orbit = self.injection.elements(state);
            let conic = Conic::new(v(orbit.semi_latus_rectum, 0), v(orbit.f, 1), v(orbit.g, 2));
            let left = conic.time(self.injection.mu(), v(orbit.true_longitude, 3), Dual::from(to));
            let quantities = [SEMI_LATUS_RECTUM, ECCENTRICITY_F, ECCENTRICITY_G, TRUE_LONGITUDE];
            for (q, slope) in quantities.into_iter().zip(left.eps) {
                if let Some(i) = q.position_in(self.injection.coast_states()) {
                    lambda[i] -= self.hamiltonian * slope;
                }
            }
        }
        lambda
    }
}

/// Multipliers of the whole flight's end conditions: those of the links are the costates where a phase begins, and the Hamiltonian;
/// the others are the solution's own.
fn multipliers(
    reduced: &Ocp,
    given: &[Vec<f64>],
    whole: &Ocp,
    phases: &[PhaseTrajectory],
    hamiltonian: f64,
) -> Vec<Vec<f64>> {
    let of = |c: &EndpointConstraint| {
        if let Some(k) = reduced.constraints.iter().position(|r| r.name == c.name) {
            return given[k].clone();
        }
        let multiplier = match c.inputs.as_slice() {
            [EndpointInput::FinalState { .. }, EndpointInput::InitialState { phase, state }] => {
                let found = &phases[*phase];
                found.costate.as_ref().map_or(f64::NAN, |l| l.component(found.initial_time, *state))
            }
            _ => -hamiltonian,
        };
        vec![multiplier]
    };
    whole.constraints.iter().map(of).collect()
}
