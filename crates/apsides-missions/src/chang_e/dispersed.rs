//! Flights that deviate from a planned main braking.

use apsides_dynamics::Engine;
use apsides_dynamics::cartesian::CartesianForce;
use apsides_dynamics::frames::{BodyFixed, Local};
use apsides_dynamics::powered_descent::{self, AngledThrust};
use apsides_ocp::{PhaseTrajectory, Trajectory};
use apsides_pipeline::Error;
use apsides_pipeline::covariance::Transition;
use apsides_pipeline::dispersion::{Deviations, Dispersed, Guidance, Onboard};

use super::flight_state::{Across, FlightState};
use super::lander::{Lander, Motion};
use crate::deviating_flight::{N, PlannedEnds, ThrustArc, fly_legs, joined, parts};

mod all_stages;
mod grounded;
mod laws;
mod replan;
mod stage_steering;

pub(super) use all_stages::{COLUMNS, PlannedStages};

/// Time and state of the end of a flight.
type FlownEnd = (f64, [f64; N]);

/// A planned main braking and what is needed to fly it again.
pub(super) struct PlannedBraking {
    lander: Lander,
    plan: PhaseTrajectory,
    frame: BodyFixed,
    ends: PlannedEnds,
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
        let ends = PlannedEnds { start, end, start_axes, end_axes };
        Ok(Self { lander: lander.clone(), plan, frame, ends })
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

    /// Flies the thrust of a plan from one time to another.
    fn fly_plan(
        &self,
        plan: &PhaseTrajectory,
        full_thrust: f64,
        model: CartesianForce,
        x: &mut [f64; N],
        times: [f64; 2],
    ) -> Option<()> {
        fly_legs(self.legs(plan, full_thrust), model, x, times)
    }

    /// The pieces of a plan.
    fn legs<'a>(
        &'a self,
        plan: &'a PhaseTrajectory,
        full_thrust: f64,
    ) -> impl Iterator<Item = ThrustArc<impl Fn(f64) -> [f64; 3] + 'a>> {
        plan.control.breaks().windows(2).enumerate().map(move |(leg, ends)| ThrustArc {
            times: [ends[0], ends[1]],
            force: move |t: f64| self.force(plan, leg, t, full_thrust),
        })
    }

    /// Flies the braking, steered so, to its end.
    fn flown(&self, d: &Deviations, guidance: &Guidance, onboard: &Onboard) -> Option<FlownEnd> {
        match guidance {
            Guidance::OpenLoop => self.fly_open_loop(d),
            Guidance::Replanned(times) => self.fly_replanned(d, onboard, times),
            Guidance::LinearRadial(_) => self.fly_linear_radial(d, onboard, guidance.corrections(d)),
            Guidance::Polynomial => self.fly_polynomial(d, onboard),
        }
    }

    fn fly_open_loop(&self, d: &Deviations) -> Option<FlownEnd> {
        let engine = self.lander.descent.engine;
        let exhaust_velocity = engine.exhaust_velocity * (1.0 + d.exhaust_velocity);
        let model = CartesianForce { body: self.lander.body, exhaust_velocity };
        let mut x = self.ends.deviating(d);
        let times = [self.plan.initial_time, self.plan.final_time];
        self.fly_plan(&self.plan, engine.thrust * (1.0 + d.thrust), model, &mut x, times)?;
        Some((self.plan.final_time, x))
    }

    /// The end of a flight at a time of its own relative to the planned end, which is a place on the ground and moves on with the body.
    fn results(&self, x: &[f64; N], time: f64) -> Vec<f64> {
        let (p, v, mass) = parts(x);
        let (p, v) = self.frame.to_fixed(time, p, v);
        let (p, v) = self.frame.to_inertial(self.plan.final_time, p, v);
        self.ends.results(p, v, mass, time)
    }

    /// Transition from start to end in inertial axes, with the thrust of the plan; inputs are relative errors of thrust and exhaust
    /// velocity.
    fn transition(&self) -> Option<Transition> {
        let engine = self.lander.descent.engine;
        let model = CartesianForce { body: self.lander.body, exhaust_velocity: engine.exhaust_velocity };
        self.ends.transition(self.legs(&self.plan, engine.thrust), model)
    }
}

/// Up, along a course and across it to the right.
fn course_axes(local: &Local, azimuth: f64) -> [[f64; 3]; 3] {
    let (sin, cos) = azimuth.sin_cos();
    [local.up, local.vector([0.0, sin, cos]), local.vector([0.0, cos, -sin])]
}

impl Dispersed for PlannedBraking {
    fn fly(&self, deviations: &Deviations, guidance: &Guidance, onboard: &Onboard) -> Option<Vec<f64>> {
        if !self.ends.can_fly(deviations) {
            return None;
        }
        let (time, x) = self.flown(deviations, guidance, onboard)?;
        Some(self.results(&x, time))
    }

    fn linear_covariance(&self, dispersions: &Deviations) -> Option<Vec<f64>> {
        self.ends.covariance(self.transition()?, dispersions)
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

#[cfg(test)]
mod tests;
