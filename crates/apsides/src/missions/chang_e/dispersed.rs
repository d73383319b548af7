//! Flights that deviate from a planned main braking.

use apsides_ad::{Dual, Dynamics};
use apsides_dynamics::Engine;
use apsides_dynamics::cartesian::CartesianForce;
use apsides_dynamics::frames::{BodyFixed, Local};
use apsides_ocp::{PhaseTrajectory, Trajectory};
use apsides_ode::{Integrator, Linearised, OdeSettings, OdeSystem, Status, StmPropagator};

use super::lander::{Lander, Motion};
use crate::Error;
use crate::covariance::Transition;
use crate::dispersion::Deviations;
use crate::key::Values;
use crate::montecarlo::{Dispersed, Guidance, MonteCarlo};

mod laws;
mod replan;

/// What a flight amounts to: where and how fast it is at the planned end, relative to the plan, in the local axes there.
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
const N: usize = 7;
/// Number of results that it gives.
const LINEAR: usize = 6;
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
struct Vehicle {
    /// What plans and laws take for true, its full thrust included.
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
    pub(super) fn new(v: &Values, t: &Trajectory) -> Result<Self, Error> {
        let lander = Lander::of(v).map_err(Error::in_mission)?;
        if lander.motion == Motion::Plane || lander.descent.gravity.degree() > 0 {
            let reason = "Monte Carlo needs `motion` = \"space\" and `gravity` = \"central\"";
            return Err(Error::in_mission(reason));
        }
        let plan = t.phases.first().cloned().ok_or_else(|| Error::in_mission("the plan has no phase"))?;
        let frame = BodyFixed { rotation_rate: lander.descent.rotation_rate, epoch_angle: 0.0 };
        let at = |time: f64| -> [f64; N] {
            let x = plan.state_at(time);
            let local = Local::at(x[1], x[2]);
            let (p, v) =
                frame.to_inertial(time, local.up.map(|c| c * x[0]), local.vector([x[3], x[4], x[5]]));
            [p[0], p[1], p[2], v[0], v[1], v[2], x[6]]
        };
        let axes = |time: f64| {
            let x = plan.state_at(time);
            let turned = |v: [f64; 3]| frame.to_inertial(time, v, [0.0; 3]).0;
            course_axes(&Local::at(x[1], x[2]), lander.azimuth).map(turned)
        };
        let (start, end) = (at(plan.initial_time), at(plan.final_time));
        let (start_axes, end_axes) = (axes(plan.initial_time), axes(plan.final_time));
        Ok(Self { lander, plan, frame, start, end, start_axes, end_axes })
    }

    /// The thrust (N) in inertial axes of a plan along one interval of its controls.
    fn force(&self, plan: &PhaseTrajectory, leg: usize, time: f64, full_thrust: f64) -> [f64; 3] {
        let (mut x, mut u) = ([0.0; 7], [0.0; 3]);
        plan.state.evaluate(time, &mut x);
        plan.control.evaluate_in(leg, time, &mut u);
        let ((sin_course, cos_course), (sin_pitch, cos_pitch)) = (u[0].sin_cos(), u[1].sin_cos());
        let size = u[2] * full_thrust;
        let thrust = [size * sin_pitch, size * cos_pitch * sin_course, size * cos_pitch * cos_course];
        self.frame.to_inertial(time, Local::at(x[1], x[2]).vector(thrust), [0.0; 3]).0
    }

    /// The engine of a deviating flight in a run.
    fn vehicle(&self, d: &Deviations, run: &MonteCarlo) -> Vehicle {
        let mut known = self.lander.clone();
        let planned = known.descent.engine;
        let actual = Engine {
            thrust: run.onboard.full_thrust_n.unwrap_or(planned.thrust),
            exhaust_velocity: planned.exhaust_velocity * (1.0 + d.exhaust_velocity),
        };
        known.least_throttle *= planned.thrust / actual.thrust;
        known.descent.engine.thrust = actual.thrust;
        let mut thrust = 1.0 + d.thrust;
        if run.onboard.engine_known {
            known.descent.engine.thrust *= thrust;
            known.descent.engine.exhaust_velocity = actual.exhaust_velocity;
            thrust = 1.0;
        }
        let model = CartesianForce { body: self.lander.body, exhaust_velocity: actual.exhaust_velocity };
        Vehicle { known, planned: planned.thrust / actual.thrust, thrust, model }
    }

    /// A state from deviations of the planned start.
    fn deviating(&self, d: &Deviations) -> [f64; N] {
        let mut x = self.shifted(&self.start, &d.position_m, &d.velocity_m_s);
        x[6] += d.mass_kg;
        x
    }

    /// A state with position and velocity shifted along the axes of the start.
    fn shifted(&self, x: &[f64; N], position: &[f64; 3], velocity: &[f64; 3]) -> [f64; N] {
        let mut shifted = *x;
        for (k, axis) in self.start_axes.iter().enumerate() {
            for c in 0..3 {
                shifted[c] += position[k] * axis[c];
                shifted[3 + c] += velocity[k] * axis[c];
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
        let (p, v) = self.frame.to_fixed(time, [x[0], x[1], x[2]], [x[3], x[4], x[5]]);
        let (p, v) = self.frame.to_inertial(self.plan.final_time, p, v);
        let along = |v: [f64; 3], axis: &[f64; 3]| v.iter().zip(axis).map(|(a, b)| a * b).sum::<f64>();
        let place: [f64; 3] = std::array::from_fn(|c| p[c] - self.end[c]);
        let speed: [f64; 3] = std::array::from_fn(|c| v[c] - self.end[3 + c]);
        let radius = |x: &[f64]| x.iter().map(|c| c * c).sum::<f64>().sqrt();
        let mut results = vec![radius(&p) - radius(&self.end[..3])];
        results.extend(self.end_axes[1..].iter().map(|a| along(place, a)));
        results.extend(self.end_axes.iter().map(|a| along(speed, a)));
        results.push(results[1].hypot(results[2]));
        results.extend([x[6], time]);
        results
    }

    /// Transition from start to end in inertial axes, with the thrust of the plan; inputs are relative errors of thrust and exhaust
    /// velocity.
    fn transition(&self) -> Option<Transition> {
        let engine = self.lander.descent.engine;
        let model = CartesianForce { body: self.lander.body, exhaust_velocity: engine.exhaust_velocity };
        let mut x = self.start;
        let mut total = Transition::identity(N, 2);
        let mut propagator = StmPropagator::new(N, 2, settings()).ok()?;
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
    fn fly(&self, deviations: &Deviations, run: &MonteCarlo) -> Option<Vec<f64>> {
        match &run.guidance {
            Guidance::OpenLoop => self.fly_open_loop(deviations),
            Guidance::Replanned(times) => self.fly_replanned(deviations, run, times),
            Guidance::LinearRadial => self.fly_linear_radial(deviations, run),
            Guidance::Polynomial => self.fly_polynomial(deviations, run),
        }
    }

    fn linear_covariance(&self, dispersions: &Deviations) -> Option<Vec<f64>> {
        // From the axes at the start and to those at the end; the mass stays as it is.
        let mut axes = [[0.0; N * N]; 2];
        for k in 0..LINEAR {
            for c in 0..3 {
                let at = k / 3 * 3 + c;
                axes[0][k * N + at] = self.end_axes[k % 3][c];
                axes[1][at * N + k] = self.start_axes[k % 3][c];
            }
        }
        axes.iter_mut().for_each(|m| m[N * N - 1] = 1.0);
        let s = dispersions.values();
        let sigmas = [s[0], s[1], s[2], s[3], s[4], s[5], dispersions.mass_kg];
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
        2
    }

    /// Of the thrust by a factor, and of the exhaust velocity by another, which changes the mass flow alone.
    fn parameter_jacobian(&self, t: f64, x: &[f64], jac: &mut [f64]) {
        let force = (self.force)(t);
        let flow = force.iter().map(|f| f * f).sum::<f64>().sqrt() / self.model.exhaust_velocity;
        jac.fill(0.0);
        for c in 0..3 {
            jac[2 * (3 + c)] = force[c] / x[6];
        }
        jac[2 * 6] = -flow;
        jac[2 * 6 + 1] = flow;
    }
}

#[cfg(test)]
mod tests;
