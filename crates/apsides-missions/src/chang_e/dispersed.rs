//! Flights that deviate from a planned main braking.

use apsides_ad::{Dual, Dynamics};
use apsides_dynamics::Engine;
use apsides_dynamics::cartesian::{self, CartesianForce};
use apsides_dynamics::frames::{BodyFixed, Local};
use apsides_dynamics::planar::MASS;
use apsides_dynamics::powered_descent::{self, AngledThrust};
use apsides_ocp::{PhaseTrajectory, Trajectory};
use apsides_ode::{Integrator, Linearised, OdeSettings, OdeSystem, Status, StmPropagator};
use apsides_pipeline::Error;
use apsides_pipeline::covariance::Transition;
use apsides_pipeline::dispersion::{Deviations, Dispersed, Guidance, Onboard};

use super::flight_state::{Across, FlightState};
use super::lander::{Lander, Motion};

mod laws;
mod replan;

/// The results of a flight: where and how fast it is at the planned end, relative to the plan, in the local axes there.
pub(super) const COLUMNS: &[&str] = &[
    "up_m",
    "along_m",
    "across_m",
    "up_m_s",
    "along_m_s",
    "across_m_s",
    "horizontal_miss_m",
    "final_mass_kg",
    "flight_time_s",
];

/// Number of components of the state that the state-transition matrix maps: position, velocity, mass.
const N: usize = cartesian::STATES.len();
/// Number of components of a vector in space.
const AXES: usize = 3;
/// The first places of velocity and mass in it.
const VELOCITY_AT: usize = cartesian::VELOCITY[0].index_in(&cartesian::STATES);
const MASS_AT: usize = MASS.index_in(&cartesian::STATES);
/// Number of constant errors: of thrust and of exhaust velocity, in this order.
const ERRORS: usize = 2;
/// Number of results that it gives.
const LINEAR: usize = 2 * AXES;
/// Relative accuracy of flights, and of positions (m), velocities (m/s) and masses (kg).
const ACCURACY: f64 = 1e-11;

/// A planned main braking and what is needed to fly it again.
pub(super) struct PlannedBraking {
    lander: Lander,
    plan: PhaseTrajectory,
    frame: BodyFixed,
    /// Position, velocity and mass in inertial axes at start and end.
    start: [f64; N],
    end: [f64; N],
    /// Local axes at start and end: up, along the course, across it to the right, in inertial axes.
    start_axes: [[f64; 3]; 3],
    end_axes: [[f64; 3]; 3],
}

/// The engine of a flight, and what is known of it.
struct FlownVehicle {
    /// The lander that plans and laws take for true, its full thrust included.
    known: Lander,
    /// Thrust of plans by the full one: what is above is a reserve.
    planned: f64,
    /// Thrust by the commanded one.
    thrust: f64,
    /// The equations of motion as they are.
    model: CartesianForce,
}

impl PlannedBraking {
    /// # Errors
    /// Missions in the plane, and those with a field of higher degree.
    pub(super) fn new(lander: &Lander, t: &Trajectory) -> Result<Self, Error> {
        if lander.motion == Motion::Plane || lander.descent.gravity.degree() > 0 {
            let reason = "Monte Carlo needs `motion` = \"space\" and `gravity` = \"central\"";
            return Err(Error::in_mission(reason));
        }
        let no_plan = || Error::in_mission("the plan has no phase");
        let plan = t.phases.first().cloned().ok_or_else(no_plan)?;
        let frame = BodyFixed { rotation_rate: lander.descent.rotation_rate, epoch_angle: 0.0 };
        let at = |time: f64| {
            let OverGround { position, velocity, mass, local } =
                OverGround::at(&plan, time).ok_or_else(no_plan)?;
            let (position, velocity) = frame.to_inertial(time, position, velocity);
            let axes =
                course_axes(&local, lander.azimuth).map(|axis| frame.to_inertial(time, axis, [0.0; 3]).0);
            Ok::<_, Error>((joined(position, velocity, mass), axes))
        };
        let ((start, start_axes), (end, end_axes)) = (at(plan.initial_time)?, at(plan.final_time)?);
        Ok(Self { lander: lander.clone(), plan, frame, start, end, start_axes, end_axes })
    }

    /// The thrust (N) in inertial axes of a plan along one interval of its controls.
    fn force(&self, plan: &PhaseTrajectory, leg: usize, time: f64, full_thrust: f64) -> [f64; 3] {
        let (mut x, mut u) = ([0.0; powered_descent::STATES.len()], [0.0; AngledThrust::CONTROLS.len()]);
        plan.state.evaluate(time, &mut x);
        plan.control.evaluate_in(leg, time, &mut u);
        let ([_, longitude, latitude, ..], [course, pitch, throttle]) = (x, u);
        let ((sin_course, cos_course), (sin_pitch, cos_pitch)) = (course.sin_cos(), pitch.sin_cos());
        let size = throttle * full_thrust;
        let thrust = [size * sin_pitch, size * cos_pitch * sin_course, size * cos_pitch * cos_course];
        self.frame.to_inertial(time, Local::at(longitude, latitude).vector(thrust), [0.0; 3]).0
    }

    /// The engine of a deviating flight.
    fn vehicle(&self, d: &Deviations, onboard: &Onboard) -> FlownVehicle {
        let mut known = self.lander.clone();
        let planned = known.descent.engine;
        let actual = Engine {
            thrust: onboard.full_thrust_n.unwrap_or(planned.thrust),
            exhaust_velocity: planned.exhaust_velocity * (1.0 + d.exhaust_velocity),
        };
        known.least_throttle *= planned.thrust / actual.thrust;
        known.descent.engine.thrust = actual.thrust;
        let mut thrust = 1.0 + d.thrust;
        if onboard.engine_known {
            known.descent.engine.thrust *= thrust;
            known.descent.engine.exhaust_velocity = actual.exhaust_velocity;
            thrust = 1.0;
        }
        let model = CartesianForce { body: self.lander.body, exhaust_velocity: actual.exhaust_velocity };
        FlownVehicle { known, planned: planned.thrust / actual.thrust, thrust, model }
    }

    /// A state from deviations of the planned start.
    fn deviating(&self, d: &Deviations) -> [f64; N] {
        let mut x = self.shifted(&self.start, &d.position_m, &d.velocity_m_s);
        x[MASS_AT] += d.mass_kg;
        x
    }

    /// A state with position and velocity shifted along the axes of the start.
    fn shifted(&self, x: &[f64; N], position: &[f64; 3], velocity: &[f64; 3]) -> [f64; N] {
        let mut shifted = *x;
        for (k, axis) in self.start_axes.iter().enumerate() {
            for c in 0..AXES {
                shifted[c] += position[k] * axis[c];
                shifted[VELOCITY_AT + c] += velocity[k] * axis[c];
            }
        }
        shifted
    }

    /// Flies the thrust of a plan from one time to another.
    fn fly_plan(
        &self,
        plan: &PhaseTrajectory,
        full_thrust: f64,
        model: CartesianForce,
        x: &mut [f64; N],
        times: [f64; 2],
    ) -> Option<()> {
        let mut integrator = Integrator::new(N, settings()).ok()?;
        for (leg, ends) in plan.control.breaks().windows(2).enumerate() {
            let (start, end) = (ends[0].max(times[0]), ends[1].min(times[1]));
            if start < end {
                let force = |t: f64| self.force(plan, leg, t, full_thrust);
                fly(&mut integrator, &Pushed { force, model }, x, start, end)?;
            }
        }
        Some(())
    }

    fn fly_open_loop(&self, d: &Deviations) -> Option<Vec<f64>> {
        let engine = self.lander.descent.engine;
        let exhaust_velocity = engine.exhaust_velocity * (1.0 + d.exhaust_velocity);
        let model = CartesianForce { body: self.lander.body, exhaust_velocity };
        let mut x = self.deviating(d);
        let times = [self.plan.initial_time, self.plan.final_time];
        self.fly_plan(&self.plan, engine.thrust * (1.0 + d.thrust), model, &mut x, times)?;
        Some(self.results(&x, self.plan.final_time))
    }

    /// The end of a flight at a time of its own relative to the planned end, which is a place on the ground and moves on with the body.
    fn results(&self, x: &[f64; N], time: f64) -> Vec<f64> {
        let (p, v, mass) = parts(x);
        let (p, v) = self.frame.to_fixed(time, p, v);
        let (p, v) = self.frame.to_inertial(self.plan.final_time, p, v);
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

    /// Transition from start to end in inertial axes, with the thrust of the plan; inputs are relative errors of thrust and exhaust
    /// velocity.
    fn transition(&self) -> Option<Transition> {
        let engine = self.lander.descent.engine;
        let model = CartesianForce { body: self.lander.body, exhaust_velocity: engine.exhaust_velocity };
        let mut x = self.start;
        let mut total = Transition::identity(N, ERRORS);
        let mut propagator = StmPropagator::new(N, ERRORS, settings()).ok()?;
        for (leg, ends) in self.plan.control.breaks().windows(2).enumerate() {
            let force = |t: f64| self.force(&self.plan, leg, t, engine.thrust);
            let summary = propagator.propagate(&Pushed { force, model }, ends[0], &x, ends[1]).ok()?;
            if summary.status != Status::Completed {
                return None;
            }
            x.copy_from_slice(propagator.state());
            total = total.then(propagator.stm(), propagator.sensitivity());
        }
        Some(total)
    }
}

fn settings() -> OdeSettings {
    OdeSettings::with_tolerance(ACCURACY)
}

/// Up, along a course and across it to the right.
fn course_axes(local: &Local, azimuth: f64) -> [[f64; 3]; 3] {
    let (sin, cos) = azimuth.sin_cos();
    [local.up, local.vector([0.0, sin, cos]), local.vector([0.0, cos, -sin])]
}

/// Integrates one leg in place.
fn fly(
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

impl Dispersed for PlannedBraking {
    fn fly(&self, deviations: &Deviations, guidance: &Guidance, onboard: &Onboard) -> Option<Vec<f64>> {
        // Neither an engine without thrust nor a lander without mass flies anywhere.
        let left = [
            1.0 + deviations.thrust,
            1.0 + deviations.exhaust_velocity,
            self.start[MASS_AT] + deviations.mass_kg,
        ];
        if !left.iter().all(|v| *v > 0.0) {
            return None;
        }
        match guidance {
            Guidance::OpenLoop => self.fly_open_loop(deviations),
            Guidance::Replanned(times) => self.fly_replanned(deviations, onboard, times),
            Guidance::LinearRadial => self.fly_linear_radial(deviations, onboard),
            Guidance::Polynomial => self.fly_polynomial(deviations, onboard),
        }
    }

    fn linear_covariance(&self, dispersions: &Deviations) -> Option<Vec<f64>> {
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
        let all = self.transition()?.between(&axes[0], &axes[1]).covariance(&start, &inputs).ok()?;
        Some((0..LINEAR * LINEAR).map(|k| all[k / LINEAR * N + k % LINEAR]).collect())
    }
}

/// A thrust that is a function of time.
struct Pushed<F> {
    force: F,
    model: CartesianForce,
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

/// Position and velocity relative to the body in its axes, mass and local axes of a plan.
struct OverGround {
    position: [f64; 3],
    velocity: [f64; 3],
    mass: f64,
    local: Local,
}

impl OverGround {
    fn at(plan: &PhaseTrajectory, time: f64) -> Option<Self> {
        let state = FlightState::at(Motion::Space, plan, time)?;
        let Across::Space { longitude, latitude, eastward, northward } = state.across else { return None };
        let local = Local::at(longitude, latitude);
        let (position, velocity) =
            (local.up.map(|c| c * state.radius), local.vector([state.upward, eastward, northward]));
        Some(Self { position, velocity, mass: state.mass, local })
    }
}

/// Position, velocity and mass of a state in inertial axes.
fn parts(&[x, y, z, vx, vy, vz, mass]: &[f64; N]) -> ([f64; 3], [f64; 3], f64) {
    ([x, y, z], [vx, vy, vz], mass)
}

/// A state in inertial axes from its position, velocity and mass.
fn joined([x, y, z]: [f64; 3], [vx, vy, vz]: [f64; 3], mass: f64) -> [f64; N] {
    [x, y, z, vx, vy, vz, mass]
}

#[cfg(test)]
mod tests;
