//! Covariance along a trajectory by its state-transition matrix: `P = Phi P0 Phi^T + Psi S Psi^T`.
//!
//! `Phi` is the derivative of a state with respect to that at the start, `Psi` that with respect to errors that are constant over the
//! flight: of controls, which are functions of time (open loop), and of parameters. Both come from the variational equations along the
//! trajectory as it is flown from its initial state and its controls (`apsides_ode::StmPropagator`); `S` is the covariance of
//! independent errors. References: Tapley, Schutz, Born, Statistical Orbit Determination, 2004, sections 1.2.5 and 4.2.

use std::cell::RefCell;

use apsides_ad::NodeFunction;
use apsides_ocp::{Ocp, PhaseTrajectory, Scaling, Trajectory};
use apsides_ode::{Linearised, OdeSettings, OdeSystem, Status, StmPropagator, Tolerance};

use crate::Error;

/// Derivatives of a state with respect to an earlier one and to constant errors of inputs.
#[derive(Clone, Debug, PartialEq)]
pub struct Transition {
    states: usize,
    inputs: usize,
    /// Row-major `states x states`.
    pub phi: Vec<f64>,
    /// Row-major `states x inputs`.
    pub psi: Vec<f64>,
}

impl Transition {
    /// The transition of no time at all.
    #[must_use]
    pub fn identity(states: usize, inputs: usize) -> Self {
        let phi = (0..states * states).map(|k| f64::from(u8::from(k % (states + 1) == 0))).collect();
        Self { states, inputs, phi, psi: vec![0.0; states * inputs] }
    }

    /// This one, and then a leg that is given by its two matrices.
    pub fn then(&self, phi: &[f64], psi: &[f64]) -> Self {
        let mut input = product(phi, self.states, &self.psi, self.inputs);
        for (sum, own) in input.iter_mut().zip(psi) {
            *sum += own;
        }
        Self { phi: product(phi, self.states, &self.phi, self.states), psi: input, ..*self }
    }

    /// In other coordinates: `to` times the matrices times `from`, row-major `rows x states` and `states x columns`.
    pub fn between(&self, to: &[f64], from: &[f64]) -> Self {
        let (rows, columns) = (to.len() / self.states, from.len() / self.states);
        debug_assert_eq!(rows, columns, "states have as many coordinates at both ends");
        let half = product(to, self.states, &self.phi, self.states);
        let phi = product(&half, self.states, from, columns);
        Self { states: rows, inputs: self.inputs, phi, psi: product(to, self.states, &self.psi, self.inputs) }
    }

    /// Covariance of the state, row-major, from that of the earlier one and the standard deviations of the inputs.
    ///
    /// # Errors
    /// When their numbers do not fit.
    pub fn covariance(&self, start: &[f64], sigmas: &[f64]) -> Result<Vec<f64>, Error> {
        let n = self.states;
        if start.len() != n * n || sigmas.len() != self.inputs {
            let reason = format!(
                "{} numbers for the start and {} for the inputs; it takes {n} x {n} and {}",
                start.len(),
                sigmas.len(),
                self.inputs
            );
            return Err(conflict(reason));
        }
        let half = product(&self.phi, n, start, n);
        let entry = |i: usize, j: usize| {
            let own: f64 = (0..n).map(|k| half[i * n + k] * self.phi[j * n + k]).sum();
            let (a, b) = (&self.psi[i * self.inputs..], &self.psi[j * self.inputs..]);
            own + a.iter().zip(b).zip(sigmas).map(|((a, b), s)| a * b * s * s).sum::<f64>()
        };
        Ok((0..n * n).map(|k| entry(k / n, k % n)).collect())
    }
}

/// `a` with `inner` columns times `b` with `columns`, row-major.
fn product(a: &[f64], inner: usize, b: &[f64], columns: usize) -> Vec<f64> {
    let entry = |i: usize, j: usize| (0..inner).map(|k| a[i * inner + k] * b[k * columns + j]).sum();
    (0..a.len() / inner.max(1) * columns).map(|k| entry(k / columns, k % columns)).collect()
}

/// Transitions along one phase from its start.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseTransitions {
    /// Start of the phase and ends of the intervals of its controls, s.
    pub times: Vec<f64>,
    /// One for each time. States in the order of the phase; inputs are the controls in its order, then the parameters of the problem.
    pub transitions: Vec<Transition>,
}

impl PhaseTransitions {
    /// Covariances of the states at all times, from that at the start of the phase and the standard deviations of constant errors of
    /// controls and parameters.
    ///
    /// # Errors
    /// When their numbers do not fit.
    ///
    /// # Examples
    /// ```
    /// use apsides_ad::{Dynamics, Scalar};
    /// use apsides_ocp::{At, Bounds, Guess, Ocp, Phase, State, Variable};
    /// use apsides_pipeline::covariance::along;
    /// use apsides_radau::Radau;
    ///
    /// /// A cart that is pushed.
    /// struct Cart;
    /// impl Dynamics<2, 1> for Cart {
    ///     fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
    ///         [x[1], u[0]]
    ///     }
    /// }
    ///
    /// let phase = Phase::new("push", Cart)
    ///     .states([State::new("x", "m").starts_at(0.0).ends_at(1.0), State::new("v", "m/s").starts_at(0.0).ends_at(0.0)])
    ///     .controls([Variable::new("a", "m/s2").within(-1.0, 1.0)])
    ///     .final_time(Bounds::new(0.5, 5.0));
    /// let ocp = Ocp::builder("cart").phase(phase).minimize("time", "s", At::FinalTime("push")).build()?;
    /// let solution = Radau::default().solve(&ocp, &Guess::linear(&ocp))?;
    /// // The place and the speed of the start are known to 3 cm and 2 cm/s, the acceleration to 1 cm/s2; the flight takes 2 s.
    /// let transitions = along(&ocp, &solution.trajectory, 0, 1e-10)?;
    /// let all = transitions.covariances(&[0.03_f64.powi(2), 0.0, 0.0, 0.02_f64.powi(2)], &[0.01])?;
    /// let variance = 0.03_f64.powi(2) + (2.0 * 0.02_f64).powi(2) + (0.5 * 4.0 * 0.01_f64).powi(2);
    /// assert!(all.last().is_some_and(|end| (end[0] / variance - 1.0).abs() < 1e-5));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn covariances(&self, start: &[f64], sigmas: &[f64]) -> Result<Vec<Vec<f64>>, Error> {
        self.transitions.iter().map(|t| t.covariance(start, sigmas)).collect()
    }
}

/// Transitions along a phase of any trajectory, flown from its initial state by its controls as functions of time, with a relative
/// accuracy.
///
/// # Errors
/// A phase that is not there, a trajectory of another problem, a flight that breaks off.
pub fn along(
    ocp: &Ocp,
    trajectory: &Trajectory,
    phase: usize,
    accuracy: f64,
) -> Result<PhaseTransitions, Error> {
    let (Some(of), Some(flown)) = (ocp.phases.get(phase), trajectory.phases.get(phase)) else {
        return Err(conflict(format!("there is no phase {phase}")));
    };
    let (n, controls, p) = (of.states.len(), of.controls.len(), trajectory.parameters.len());
    if flown.state.dimension() != n || flown.control.dimension() != controls || ocp.parameters.len() != p {
        return Err(conflict("the trajectory is not one of this problem".into()));
    }
    let scales = &Scaling::new(ocp, &apsides_ocp::Guess::earlier(trajectory)).phases[phase].states;
    let settings = OdeSettings {
        relative_tolerance: accuracy,
        absolute_tolerance: Tolerance::PerComponent(scales.iter().map(|s| accuracy * s).collect()),
        stiffness_interval: None,
        ..OdeSettings::default()
    };
    let broken = |e: apsides_ode::OdeError| conflict(e.to_string());
    let mut propagator = StmPropagator::new(n, controls + p, settings).map_err(broken)?;
    let mut x = flown.state_at(flown.initial_time);
    let breaks = flown.control.breaks();
    let mut total = Transition::identity(n, controls + p);
    let mut found = PhaseTransitions { times: vec![breaks[0]], transitions: vec![total.clone()] };
    for (leg, ends) in breaks.windows(2).enumerate() {
        let motion = Motion::new(of.dynamics.as_ref(), flown, leg, n, &trajectory.parameters);
        let summary = propagator.propagate(&motion, ends[0], &x, ends[1]).map_err(broken)?;
        if summary.status != Status::Completed {
            return Err(conflict(format!("the flight breaks off at {} s", summary.time)));
        }
        x.copy_from_slice(propagator.state());
        total = total.then(propagator.stm(), propagator.sensitivity());
        found.times.push(ends[1]);
        found.transitions.push(total.clone());
    }
    Ok(found)
}

/// The equations of motion of a phase along one interval of its controls.
struct Motion<'a> {
    dynamics: &'a dyn NodeFunction,
    flown: &'a PhaseTrajectory,
    leg: usize,
    states: usize,
    inputs: usize,
    scratch: RefCell<Scratch>,
}

/// States, controls, parameters and time; rates; entries of the Jacobian.
struct Scratch {
    z: Vec<f64>,
    rates: Vec<f64>,
    entries: Vec<f64>,
}

impl<'a> Motion<'a> {
    fn new(
        dynamics: &'a dyn NodeFunction,
        flown: &'a PhaseTrajectory,
        leg: usize,
        states: usize,
        parameters: &[f64],
    ) -> Self {
        let controls = flown.control.dimension();
        // Functions that do not take the parameters have none among their inputs.
        let taken = dynamics.inputs() - states - controls - 1;
        let mut z = vec![0.0; dynamics.inputs()];
        z[states + controls..][..taken].copy_from_slice(&parameters[..taken]);
        let rates = vec![0.0; dynamics.outputs()];
        let entries = vec![0.0; dynamics.pattern().jacobian_len()];
        let inputs = controls + parameters.len();
        Self { dynamics, flown, leg, states, inputs, scratch: RefCell::new(Scratch { z, rates, entries }) }
    }

    fn set(&self, t: f64, x: &[f64], z: &mut [f64]) {
        z[..self.states].copy_from_slice(x);
        let controls = self.flown.control.dimension();
        self.flown.control.evaluate_in(self.leg, t, &mut z[self.states..][..controls]);
        if let Some(time) = z.last_mut() {
            *time = t;
        }
    }

    /// Derivatives of the rates with respect to a range of the inputs of the dynamics, row-major.
    fn derivatives(&self, t: f64, x: &[f64], from: usize, columns: usize, jac: &mut [f64]) {
        let scratch = &mut *self.scratch.borrow_mut();
        self.set(t, x, &mut scratch.z);
        self.dynamics.jacobian(&scratch.z, &mut scratch.rates, &mut scratch.entries);
        jac.fill(0.0);
        let last = scratch.z.len() - 1;
        for ((row, column), entry) in self.dynamics.pattern().jacobian_entries().zip(&scratch.entries) {
            if (from..from + columns).contains(&column) && column != last {
                jac[row * columns + column - from] = *entry;
            }
        }
    }
}

impl OdeSystem for Motion<'_> {
    fn dimension(&self) -> usize {
        self.states
    }

    fn rate(&self, t: f64, x: &[f64], dx: &mut [f64]) {
        let scratch = &mut *self.scratch.borrow_mut();
        self.set(t, x, &mut scratch.z);
        self.dynamics.value(&scratch.z, dx);
    }
}

impl Linearised for Motion<'_> {
    fn jacobian(&self, t: f64, x: &[f64], jac: &mut [f64]) {
        self.derivatives(t, x, 0, self.states, jac);
    }

    fn parameters(&self) -> usize {
        self.inputs
    }

    fn parameter_jacobian(&self, t: f64, x: &[f64], jac: &mut [f64]) {
        self.derivatives(t, x, self.states, self.inputs, jac);
    }
}

fn conflict(reason: String) -> Error {
    Error::Conflict { place: "covariance".into(), reason }
}
