//! Flights by guidance laws.

use apsides_ad::vector;
use apsides_control::ControlError;
use apsides_control::guidance::feed_forward::{AngleCorrections, thrust_direction};
use apsides_control::guidance::linear_radial::{DescentState, LinearRadialLaw};
use apsides_control::guidance::polynomial::{PolynomialLaw, Profile, Target, ThrustLimits};
use apsides_dynamics::frames::Local;
use apsides_dynamics::planar::THROTTLE;
use apsides_dynamics::powered_descent::AngledThrust;
use apsides_pipeline::dispersion::{Deviations, Onboard};

use super::{FlownEnd, FlownVehicle, OverGround, PlannedBraking, course_axes};
use crate::chang_e::flight_state::{Across, FlightState};
use crate::chang_e::lander::{Lander, Motion};
use crate::deviating_flight::{N, fly_by, parts};

/// Position and velocity relative to the body in its axes.
type Fixed = ([f64; 3], [f64; 3]);

impl PlannedBraking {
    pub(super) fn fly_linear_radial(
        &self,
        d: &Deviations,
        onboard: &Onboard,
        corrections: AngleCorrections,
    ) -> Option<FlownEnd> {
        let mut vehicle = self.vehicle(d, onboard);
        // The thrust of the plan, not a reserve: the range follows from it.
        let planned = self.lander.descent.engine.thrust;
        let known = &mut vehicle.known.descent.engine;
        known.thrust = if onboard.engine_known { planned * (1.0 + d.thrust) } else { planned };
        let engine = *known;
        let end = FlightState::end(Motion::Space, &self.plan)?;
        let Across::Space { eastward, northward, .. } = end.across else { return None };
        let target = [eastward, northward];
        let command = |(p, v): Fixed, mass: f64, guess: f64| {
            let (radius, longitude, latitude) = Local::spherical(p);
            let local = Local::at(longitude, latitude);
            let [radial_speed, east, north] = local.components(v);
            // Speeds against the velocity to be gained; what is across it is too little to bend the path upwards.
            let to_gain = [target[0] - east, target[1] - north];
            let size = to_gain[0].hypot(to_gain[1]);
            let against = |v: [f64; 2]| -(v[0] * to_gain[0] + v[1] * to_gain[1]) / size;
            let law = LinearRadialLaw {
                gravitational_parameter: self.lander.body.gravitational_parameter,
                engine,
                radius: end.radius,
                radial_speed: end.upward,
                horizontal_speed: against(target),
            };
            let state = DescentState { radius, radial_speed, horizontal_speed: against([east, north]), mass };
            let command = law.command(&state, Some(guess))?;
            let level = local.vector([0.0, to_gain[0], to_gain[1]]);
            let direction = thrust_direction(&local.up, &level, command.pitch, corrections);
            let no_azimuth = ControlError::NoTimeToGo { reason: "no horizontal speed is to be gained" };
            let thrust = direction.ok_or(no_azimuth)?.map(|c| c * engine.thrust);
            Ok((thrust, command.time_to_go))
        };
        let mut x = self.ends.deviating(d);
        let start = self.full_thrust_time();
        let times = [self.plan.initial_time, start];
        self.fly_plan(&self.plan, planned * (1.0 + d.thrust), vehicle.model, &mut x, times)?;
        self.fly_by(&vehicle, d, (start, x), command)
    }

    pub(super) fn fly_polynomial(&self, d: &Deviations, onboard: &Onboard) -> Option<FlownEnd> {
        let vehicle = self.vehicle(d, onboard);
        let engine = vehicle.known.descent.engine;
        let OverGround { position, velocity, mass, local } =
            OverGround::at(&self.plan, self.plan.final_time)?;
        let thrust = {
            let leg = self.plan.control.segments().len() - 1;
            let force = self.force(&self.plan, leg, self.plan.final_time, self.lander.descent.engine.thrust);
            self.frame.to_fixed(self.plan.final_time, force, [0.0; 3]).0
        };
        let free = free_acceleration(&self.lander, &position, &velocity);
        let acceleration = vector::add(&free, &vector::scale(&thrust, mass.recip()));
        let least = vehicle.known.least_throttle * engine.thrust;
        let [_, along, _] = course_axes(&local, self.lander.azimuth);
        let law = PolynomialLaw {
            target: Target { position, velocity, acceleration },
            profile: Profile::Linear,
            axis: along,
            limits: ThrustLimits::new(least, engine.thrust).ok()?,
        };
        let command = |(p, v): Fixed, mass: f64, guess: f64| {
            let free = free_acceleration(&self.lander, &p, &v);
            law.command(&p, &v, mass, &free, guess).map(|c| (c.thrust, c.time_to_go))
        };
        self.fly_by(&vehicle, d, (self.plan.initial_time, self.ends.deviating(d)), command)
    }

    /// Flies a law from a state on; it commands a thrust (N) in the axes of the body and says how long is to go, s.
    fn fly_by(
        &self,
        vehicle: &FlownVehicle,
        d: &Deviations,
        begin: (f64, [f64; N]),
        law: impl Fn(Fixed, f64, f64) -> Result<([f64; 3], f64), ControlError>,
    ) -> Option<FlownEnd> {
        let command = |now: f64, x: &[f64; N], guess: f64| {
            let (position, velocity, mass) =
                parts(&self.ends.shifted(x, &d.navigation_position_m, &d.navigation_velocity_m_s));
            law(self.frame.to_fixed(now, position, velocity), mass, guess).ok()
        };
        let push = |now: f64, thrust: [f64; 3]| {
            self.frame.to_inertial(now, thrust, [0.0; 3]).0.map(|f| f * vehicle.thrust)
        };
        fly_by(vehicle.model, begin, self.plan.final_time, command, push)
    }

    /// The time at which the plan goes to full thrust.
    fn full_thrust_time(&self) -> f64 {
        let plan = &self.plan;
        let middle = 0.5 * (1.0 + self.lander.least_throttle);
        let throttle = const { THROTTLE.index_in(&AngledThrust::CONTROLS) };
        let full = |ends: &&[f64]| plan.control.component(0.5 * (ends[0] + ends[1]), throttle) > middle;
        plan.control.breaks().windows(2).find(full).map_or(plan.initial_time, |ends| ends[0])
    }
}

/// Acceleration without thrust relative to the body in its axes: gravity, Coriolis and centrifugal acceleration.
pub(super) fn free_acceleration(lander: &Lander, p: &[f64; 3], v: &[f64; 3]) -> [f64; 3] {
    let square = vector::dot(p, p);
    let ([x, y, z], [vx, vy, _]) = (*p, *v);
    let gravity = -lander.body.gravitational_parameter / (square * square.sqrt());
    let turn = lander.descent.rotation_rate;
    let across = turn * turn;
    [(gravity + across) * x + 2.0 * turn * vy, (gravity + across) * y - 2.0 * turn * vx, gravity * z]
}
