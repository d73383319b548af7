//! Flights that deviate from a plan, in inertial axes: position, velocity, mass.

use apsides_ad::{Dual, Dynamics};
use apsides_dynamics::cartesian::{self, CartesianForce};
use apsides_dynamics::planar::MASS;
use apsides_ocp::{OcpError, PhaseMesh, PhaseTrajectory};
use apsides_ode::{Integrator, Linearised, OdeSettings, OdeSystem, Status, StmPropagator};
use apsides_pipeline::covariance::Transition;
use apsides_pipeline::dispersion::Deviations;

/// The results of a flight: where and how fast it is at the planned end, relative to the plan, in the local axes there.
pub(crate) const COLUMNS: &[&str] = &[
    "up_m",
    "along_m",
    "across_m",
    "up_speed_m_s",
    "along_speed_m_s",
    "across_speed_m_s",
    "horizontal_miss_m",
    "final_mass_kg",
    "flight_time_s",
];

/// Number of components of the state that the state-transition matrix maps: position, velocity, mass.
pub(crate) const N: usize = cartesian::STATES.len();
/// Number of components of a vector in space.
const AXES: usize = 3;
/// The first places of velocity and mass in it.
pub(crate) const VELOCITY_AT: usize = cartesian::VELOCITY[0].index_in(&cartesian::STATES);
pub(crate) const MASS_AT: usize = MASS.index_in(&cartesian::STATES);
/// Number of constant errors: of thrust and of exhaust velocity, in this order.
pub(crate) const ERRORS: usize = 2;
/// Number of results that the matrix gives.
pub(crate) const LINEAR: usize = 2 * AXES;
/// Relative accuracy of flights, and of positions (m), velocities (m/s) and masses (kg).
const ACCURACY: f64 = 1e-11;

/// Time for which a command is flown, its thrust along the same direction in space.
const CYCLE_S: f64 = 0.1;
/// The last command of a long burn is flown for the last seconds: the laws divide by the time to go.
pub(crate) const HELD_S: f64 = 2.0;
/// For as long at most where the law has no command any more.
const MOST_HELD_S: f64 = 10.0;
/// Longest flight by its planned time.
const LONGEST: f64 = 2.0;

/// Intervals shorter than this part of what is left are joined to the next.
const SHORTEST_INTERVAL: f64 = 1e-3;

pub(crate) fn settings() -> OdeSettings {
    OdeSettings::with_tolerance(ACCURACY)
}

/// Planned ends of a flight.
pub(crate) struct PlannedEnds {
    /// Position, velocity and mass in inertial axes at start and end.
    pub(crate) start: [f64; N],
    pub(crate) end: [f64; N],
    /// Local axes at start and end: up, along the course, across it to the right, in inertial axes.
    pub(crate) start_axes: [[f64; 3]; 3],
    pub(crate) end_axes: [[f64; 3]; 3],
}

impl PlannedEnds {
    /// Neither an engine without thrust nor a lander without mass flies anywhere.
    pub(crate) fn can_fly(&self, d: &Deviations) -> bool {
        let left = [1.0 + d.thrust, 1.0 + d.exhaust_velocity, self.start[MASS_AT] + d.mass_kg];
        left.iter().all(|v| *v > 0.0)
    }

    /// A state from deviations of the planned start.
    pub(crate) fn deviating(&self, d: &Deviations) -> [f64; N] {
        let mut x = self.shifted(&self.start, &d.position_m, &d.velocity_m_s);
        x[MASS_AT] += d.mass_kg;
        x
    }

    /// A state with position and velocity shifted along the axes of the start.
    pub(crate) fn shifted(&self, x: &[f64; N], position: &[f64; 3], velocity: &[f64; 3]) -> [f64; N] {
        let mut shifted = *x;
        for (k, axis) in self.start_axes.iter().enumerate() {
            for c in 0..AXES {
                shifted[c] += position[k] * axis[c];
                shifted[VELOCITY_AT + c] += velocity[k] * axis[c];
            }
        }
        shifted
    }

    /// [`COLUMNS`] of a position and a velocity at the planned end, a mass and a time.
    pub(crate) fn results(&self, p: [f64; 3], v: [f64; 3], mass: f64, time: f64) -> Vec<f64> {
        let (planned, planned_velocity, _) = parts(&self.end);
        let along = |v: [f64; 3], axis: &[f64; 3]| v.iter().zip(axis).map(|(a, b)| a * b).sum::<f64>();
        let place: [f64; 3] = std::array::from_fn(|c| p[c] - planned[c]);
        let speed: [f64; 3] = std::array::from_fn(|c| v[c] - planned_velocity[c]);
        let radius = |x: &[f64]| x.iter().map(|c| c * c).sum::<f64>().sqrt();
        let [_, course, right] = &self.end_axes;
        let up = radius(&p) - radius(&planned);
        let (ahead, across) = (along(place, course), along(place, right));
        let [up_speed, ahead_speed, across_speed] = self.end_axes.map(|axis| along(speed, &axis));
        vec![up, ahead, across, up_speed, ahead_speed, across_speed, ahead.hypot(across), mass, time]
    }

    /// Transition from start to end along legs; inputs are relative errors of thrust and exhaust velocity.
    pub(crate) fn transition<F: Fn(f64) -> [f64; 3]>(
        &self,
        legs: impl Iterator<Item = ThrustArc<F>>,
        model: CartesianForce,
    ) -> Option<Transition> {
        let mut x = self.start;
        let mut total = Transition::identity(N, ERRORS);
        let mut propagator = StmPropagator::new(N, ERRORS, settings()).ok()?;
        for ThrustArc { times: [start, end], force } in legs {
            let summary = propagator.propagate(&Pushed { force, model }, start, &x, end).ok()?;
            if summary.status != Status::Completed {
                return None;
            }
            x.copy_from_slice(propagator.state());
            total = total.then(propagator.stm(), propagator.sensitivity());
        }
        Some(total)
    }

    /// Covariance of the first six [`COLUMNS`] by the transition from start to end in inertial axes, row-major.
    pub(crate) fn covariance(&self, transition: Transition, dispersions: &Deviations) -> Option<Vec<f64>> {
        // From the axes at the start and to those at the end; the mass stays as it is.
        let mut axes = [[0.0; N * N]; 2];
        for k in 0..LINEAR {
            for c in 0..AXES {
                let at = k / AXES * AXES + c;
                axes[0][k * N + at] = self.end_axes[k % AXES][c];
                axes[1][at * N + k] = self.start_axes[k % AXES][c];
            }
        }
        axes.iter_mut().for_each(|m| m[MASS_AT * N + MASS_AT] = 1.0);
        let sigmas = joined(dispersions.position_m, dispersions.velocity_m_s, dispersions.mass_kg);
        let start: Vec<f64> =
            (0..N * N).map(|k| if k % (N + 1) == 0 { sigmas[k / N].powi(2) } else { 0.0 }).collect();
        let inputs = [dispersions.thrust, dispersions.exhaust_velocity];
        let all = transition.between(&axes[0], &axes[1]).covariance(&start, &inputs).ok()?;
        Some((0..LINEAR * LINEAR).map(|k| all[k / LINEAR * N + k % LINEAR]).collect())
    }
}

/// A piece of a plan along which its thrust is smooth.
pub(crate) struct ThrustArc<F> {
    /// Its start and end, s.
    pub(crate) times: [f64; 2],
    /// The thrust (N) in inertial axes at a time.
    pub(crate) force: F,
}

/// Flies legs, as far as they are between two times, in place.
pub(crate) fn fly_legs<F: Fn(f64) -> [f64; 3]>(
    legs: impl Iterator<Item = ThrustArc<F>>,
    model: CartesianForce,
    x: &mut [f64; N],
    [from, to]: [f64; 2],
) -> Option<()> {
    let mut integrator = Integrator::new(N, settings()).ok()?;
    for ThrustArc { times: [start, end], force } in legs {
        let (start, end) = (start.max(from), end.min(to));
        if start < end {
            fly(&mut integrator, &Pushed { force, model }, x, start, end)?;
        }
    }
    Some(())
}

/// Integrates one leg in place.
pub(crate) fn fly(
    integrator: &mut Integrator,
    system: &impl OdeSystem,
    x: &mut [f64; N],
    start: f64,
    end: f64,
) -> Option<()> {
    let from = *x;
    let summary = integrator.integrate(system, start, &from, end, x).ok()?;
    (summary.status == Status::Completed).then_some(())
}

/// Flies a law from a time and a state on and returns those of the end. The law gives a thrust (N) in axes of its own for a time, a state and
/// a guess of the time to go, and how long is to go, s; `push` is the true thrust in inertial axes for the commanded one.
pub(crate) fn fly_by(
    model: CartesianForce,
    begin: (f64, [f64; N]),
    planned_end: f64,
    law: impl Fn(f64, &[f64; N], f64) -> Option<([f64; 3], f64)>,
    push: impl Fn(f64, [f64; 3]) -> [f64; 3],
) -> Option<(f64, [f64; N])> {
    let mut integrator = Integrator::new(N, settings()).ok()?;
    fly_law(begin, planned_end, HELD_S, law, |now, x, thrust, step| {
        let force = push(now, thrust);
        fly(&mut integrator, &Pushed { force: |_| force, model }, x, now, now + step)?;
        Some((now + step, true))
    })
}

/// The same with the motion of the caller: `advance` flies a state in place from a time on with a commanded thrust for some seconds, and says
/// when it ends and whether the flight goes on. The last command is held for `held` seconds.
pub(crate) fn fly_law(
    (mut now, mut x): (f64, [f64; N]),
    planned_end: f64,
    held: f64,
    law: impl Fn(f64, &[f64; N], f64) -> Option<([f64; 3], f64)>,
    mut advance: impl FnMut(f64, &mut [f64; N], [f64; 3], f64) -> Option<(f64, bool)>,
) -> Option<(f64, [f64; N])> {
    let mut guess = planned_end - now;
    let mut earlier = None;
    while now < LONGEST * planned_end {
        let commanded = law(now, &x, guess);
        // Errors of the engine that the law does not know can bring a part of the target early.
        let out_of_law = commanded.is_none() && guess <= MOST_HELD_S;
        let (thrust, to_go) = commanded.or(earlier.filter(|_| out_of_law))?;
        let last = out_of_law || to_go <= held + CYCLE_S;
        let step = if last { to_go } else { CYCLE_S };
        let (end, goes_on) = advance(now, &mut x, thrust, step)?;
        now = end;
        if last || !goes_on {
            return Some((now, x));
        }
        guess = to_go - step;
        earlier = Some((thrust, guess));
    }
    None
}

/// The intervals of a plan behind a time; what is known of its switches is left out, since the rest may have others.
pub(crate) fn rest_of(mesh: &PhaseMesh, plan: &PhaseTrajectory, time: f64) -> Result<PhaseMesh, OcpError> {
    let part = (time - plan.initial_time) / (plan.final_time - plan.initial_time);
    let (mut ends, mut points) = (vec![0.0], Vec::new());
    for (end, n) in mesh.fractions()[1..].iter().zip(mesh.points()) {
        let end = if *end == 1.0 { 1.0 } else { (end - part) / (1.0 - part) };
        if end > SHORTEST_INTERVAL {
            ends.push(end);
            points.push(*n);
        }
    }
    PhaseMesh::new(ends, points)
}

/// A thrust that is a function of time.
pub(crate) struct Pushed<F> {
    pub(crate) force: F,
    pub(crate) model: CartesianForce,
}

impl<F: Fn(f64) -> [f64; 3]> OdeSystem for Pushed<F> {
    fn dimension(&self) -> usize {
        N
    }

    fn rate(&self, t: f64, x: &[f64], dx: &mut [f64]) {
        let Ok(state) = <&[f64; N]>::try_from(x) else { return };
        dx.copy_from_slice(&self.model.rate(t, state, &(self.force)(t), &[]));
    }
}

impl<F: Fn(f64) -> [f64; 3]> Linearised for Pushed<F> {
    fn jacobian(&self, t: f64, x: &[f64], jac: &mut [f64]) {
        let state: [Dual<N>; N] = std::array::from_fn(|k| Dual::variable(x[k], k));
        let force = (self.force)(t).map(Dual::constant);
        let rates = self.model.rate(Dual::constant(t), &state, &force, &[]);
        for (row, rate) in jac.chunks_exact_mut(N).zip(rates) {
            row.copy_from_slice(&rate.eps);
        }
    }

    fn parameters(&self) -> usize {
        ERRORS
    }

    /// Derivatives with respect to a factor on the thrust, and to one on the exhaust velocity, which changes the mass flow alone.
    fn parameter_jacobian(&self, t: f64, x: &[f64], jac: &mut [f64]) {
        let force = (self.force)(t);
        let flow = force.iter().map(|f| f * f).sum::<f64>().sqrt() / self.model.exhaust_velocity;
        jac.fill(0.0);
        for (c, force) in force.iter().enumerate() {
            jac[ERRORS * (VELOCITY_AT + c)] = force / x[MASS_AT];
        }
        jac[ERRORS * MASS_AT] = -flow;
        jac[ERRORS * MASS_AT + 1] = flow;
    }
}

/// Position, velocity and mass of a state in inertial axes.
pub(crate) fn parts(&[x, y, z, vx, vy, vz, mass]: &[f64; N]) -> ([f64; 3], [f64; 3], f64) {
    ([x, y, z], [vx, vy, vz], mass)
}

/// A state in inertial axes from its position, velocity and mass.
pub(crate) fn joined([x, y, z]: [f64; 3], [vx, vy, vz]: [f64; 3], mass: f64) -> [f64; N] {
    [x, y, z, vx, vy, vz, mass]
}
