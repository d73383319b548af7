//! The stages below the main braking by a guidance law, and planned anew.
//!
//! Both aim at the gate of the stage: place and velocity at the end of the same stage of the plan. The law is E-guidance; its acceleration at
//! the end is a part of what full thrust gives, so that the engine has a reserve. A new plan is a convex descent in uniform gravity (that of
//! the middle height) over a time that is sought around the planned one. It may lean within the tilt to fall faster, as the diverts by which sites
//! are chosen, which the plan of the mission must not.

use apsides_ad::vector;
use apsides_control::guidance::polynomial::{PolynomialLaw, Profile, Target, ThrustLimits};
use apsides_convex::{DescentLimits, DescentProblem, DescentSettings, DescentSolver, FlightTime};
use apsides_dynamics::frames::{BodyFixed, Local};
use apsides_pipeline::dispersion::{Deviations, Replanning};

use super::FlownVehicle;
use super::grounded::GroundedFlight;
use super::laws::free_acceleration;
use crate::deviating_flight::{N, PlannedEnds, fly_law, parts};

/// Part of the acceleration upwards of full thrust, less gravity, that the law has at the end of a stage.
const PART_OF_THRUST: f64 = 0.8;
/// The last command of the law is flown for so long, s.
const HELD_S: f64 = 0.2;
/// No new plan in the last seconds of one.
const LAST_S: f64 = 2.0;
/// Flight times of new plans by what is left of the earlier one, and the solves that find the best of them.
const TIMES: [f64; 2] = [0.6, 1.8];
const SOLVES: usize = 14;
/// Intervals of a new plan.
const INTERVALS: usize = 24;

/// The end of a stage as it is planned, in axes of the body.
#[derive(Clone, Debug)]
pub(super) struct StageEnd {
    /// Time that the stage takes, s.
    pub(super) duration: f64,
    pub(super) position: [f64; 3],
    pub(super) velocity: [f64; 3],
    /// Acceleration upwards of the plan there, m/s2.
    pub(super) climb: f64,
    /// Axes at its place.
    pub(super) local: Local,
    /// Largest tilt of the thrust from the vertical, rad.
    pub(super) tilt: f64,
    /// True if the time is given: a hover.
    pub(super) is_timed: bool,
}

/// The steering of the stages of one flight.
pub(super) struct StageSteering<'a> {
    pub(super) frame: &'a BodyFixed,
    pub(super) ends: &'a PlannedEnds,
    pub(super) vehicle: &'a FlownVehicle,
    pub(super) deviations: &'a Deviations,
}

/// A new plan: thrust (N) in axes of the body over time, linear between nodes.
struct StagePlan {
    times: Vec<f64>,
    thrusts: Vec<[f64; 3]>,
}

impl StagePlan {
    fn end(&self) -> f64 {
        self.times.last().copied().unwrap_or(f64::NEG_INFINITY)
    }

    fn thrust(&self, time: f64) -> [f64; 3] {
        let k = self.times.partition_point(|t| *t <= time).clamp(1, self.times.len().max(2) - 1);
        let ([Some(from), Some(to)], [Some(a), Some(b)]) =
            ([k - 1, k].map(|k| self.times.get(k)), [k - 1, k].map(|k| self.thrusts.get(k)))
        else {
            return [0.0; 3];
        };
        let part = ((time - from) / (to - from)).clamp(0.0, 1.0);
        vector::add(&vector::scale(a, 1.0 - part), &vector::scale(b, part))
    }
}

impl StageSteering<'_> {
    /// Position and velocity in axes of the body and the mass, as navigation has them.
    fn believed(&self, now: f64, x: &[f64; N]) -> ([f64; 3], [f64; 3], f64) {
        let d = self.deviations;
        let (p, v, mass) = parts(&self.ends.shifted(x, &d.navigation_position_m, &d.navigation_velocity_m_s));
        let (p, v) = self.frame.to_fixed(now, p, v);
        (p, v, mass)
    }

    /// The true thrust in inertial axes of one commanded in axes of the body.
    fn pushed(&self, now: f64, thrust: [f64; 3]) -> [f64; 3] {
        self.frame.to_inertial(now, thrust, [0.0; 3]).0.map(|f| f * self.vehicle.thrust)
    }

    /// Flies a stage by the law; where the law has no command the flight falls.
    pub(super) fn fly_by_law(&self, end: &StageEnd, flight: &mut GroundedFlight) -> Option<()> {
        let lander = &self.vehicle.known;
        let engine = lander.descent.engine;
        let limits = ThrustLimits::new(lander.least_throttle * engine.thrust, engine.thrust).ok()?;
        let up = end.local.up;
        let (_, _, mass) = parts(&flight.x);
        let gravity = vector::dot(&free_acceleration(lander, &end.position, &end.velocity), &up);
        let most = PART_OF_THRUST * (engine.thrust / mass + gravity);
        let climb = end.climb.min(most);
        let law = PolynomialLaw {
            target: Target {
                position: end.position,
                velocity: end.velocity,
                acceleration: vector::scale(&up, climb),
            },
            profile: Profile::Linear,
            axis: up,
            limits,
        };
        let begin = flight.now;
        let command = |now: f64, x: &[f64; N], guess: f64| {
            let (p, v, mass) = self.believed(now, x);
            let free = free_acceleration(lander, &p, &v);
            let (thrust, to_go) = if end.is_timed {
                let to_go = begin + end.duration - now;
                let wanted = vector::add(&law.acceleration(&p, &v, to_go), &vector::scale(&free, -1.0));
                (limits.limit(vector::scale(&wanted, mass)).0, to_go)
            } else {
                let command = law.command(&p, &v, mass, &free, guess).ok()?;
                (command.thrust, command.time_to_go)
            };
            Some((within_tilt(thrust, &up, end.tilt), to_go))
        };
        let start = (begin, flight.x);
        let flown = fly_law(start, begin + end.duration, HELD_S, command, |now, _x, thrust, step| {
            let force = self.pushed(now, thrust);
            flight.push(|_| force, now + step)?;
            *_x = flight.x;
            Some((flight.now, !flight.landed))
        });
        match flown {
            Some(_) => Some(()),
            None => flight.fall(),
        }
    }

    /// Flies a stage that is planned anew where it begins, and at times besides; without any plan `planned` flies it.
    pub(super) fn fly_replanned(
        &self,
        end: &StageEnd,
        flight: &mut GroundedFlight,
        replanning: &Replanning,
        planned: impl FnOnce(&mut GroundedFlight) -> Option<()>,
    ) -> Option<()> {
        let begin = flight.now;
        let Some(mut plan) = self.plan(end, flight, end.duration) else { return planned(flight) };
        let longest = begin + TIMES[1] * end.duration;
        for time in replanning.times(longest).into_iter().filter(|t| *t > begin) {
            if time > plan.end() - LAST_S {
                break;
            }
            flight.push(|t| self.pushed(t, plan.thrust(t)), time)?;
            // A flight without a new plan goes on with the one it has.
            if let Some(new) = self.plan(end, flight, plan.end() - time) {
                plan = new;
            }
        }
        flight.push(|t| self.pushed(t, plan.thrust(t)), plan.end())
    }

    /// The best flight to the end of a stage, of which so many seconds are left by the earlier plan.
    fn plan(&self, end: &StageEnd, flight: &GroundedFlight, left: f64) -> Option<StagePlan> {
        let lander = &self.vehicle.known;
        let (p, v, mass) = self.believed(flight.now, &flight.x);
        let east_north_up = |v: [f64; 3]| {
            let [up, east, north] = end.local.components(v);
            [east, north, up]
        };
        let (radius, ..) = Local::spherical(p);
        let (end_radius, longitude, latitude) = Local::spherical(end.position);
        let (gravity, rotation) = lander.uniform_field(0.5 * (radius + end_radius), [longitude, latitude]);
        let engine = lander.descent.engine;
        let problem = DescentProblem {
            gravity,
            rotation,
            mass,
            dry_mass: lander.dry_mass,
            exhaust_velocity: engine.exhaust_velocity,
            thrust: [lander.least_throttle, 1.0].map(|throttle| throttle * engine.thrust),
            position: east_north_up(vector::add(&p, &vector::scale(&end.position, -1.0))),
            velocity: east_north_up(v),
            target: [0.0; 3],
            target_velocity: east_north_up(end.velocity),
            limits: DescentLimits { pointing: Some(end.tilt), ..DescentLimits::default() },
        };
        let range = Some(TIMES.map(|part| part * left));
        let flight_time = match end.is_timed {
            true => FlightTime::Fixed(left),
            false => FlightTime::GoldenSection { range, solves: SOLVES },
        };
        let settings = DescentSettings { intervals: INTERVALS, flight_time, ..DescentSettings::default() };
        let solution = DescentSolver::new(&problem, settings).and_then(|mut solver| solver.solve()).ok()?;
        let limits = ThrustLimits::new(problem.thrust[0], problem.thrust[1]).ok()?;
        let in_body = |thrust: &[f64; 3]| {
            let ([east, north, up], _) = limits.limit(*thrust);
            end.local.vector([up, east, north])
        };
        let plan = StagePlan {
            times: solution.times.iter().map(|t| flight.now + t).collect(),
            thrusts: solution.thrusts.iter().map(in_body).collect(),
        };
        let is_flight = plan.end().is_finite() && plan.thrusts.iter().flatten().all(|f| f.is_finite());
        is_flight.then_some(plan)
    }
}

/// A thrust of the same size whose angle from the vertical is within a tilt, rad.
fn within_tilt(thrust: [f64; 3], up: &[f64; 3], tilt: f64) -> [f64; 3] {
    let (size, upward) = (vector::norm(&thrust, 0.0), vector::dot(&thrust, up));
    if upward >= size * tilt.cos() {
        return thrust;
    }
    let across = vector::add(&thrust, &vector::scale(up, -upward));
    let aside = vector::norm(&across, 0.0);
    if aside == 0.0 {
        return vector::scale(up, size);
    }
    let (sin, cos) = tilt.sin_cos();
    vector::add(&vector::scale(up, size * cos), &vector::scale(&across, size * sin / aside))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn thrusts_stay_within_their_tilt() {
        let up = [0.0, 0.0, 1.0];
        let (sin, cos) = 0.5_f64.sin_cos();
        assert_eq!(within_tilt([0.1, 0.0, 1.0], &up, 0.5), [0.1, 0.0, 1.0]);
        // Downwards, level and nothing at all.
        for thrust in [[3.0, 4.0, -12.0], [3.0, 4.0, 0.0]] {
            let size = vector::norm(&thrust, 0.0);
            let found = within_tilt(thrust, &up, 0.5);
            let expected = [0.6 * size * sin, 0.8 * size * sin, size * cos];
            assert!((0..3).all(|k| (found[k] - expected[k]).abs() < ROUNDING), "{found:?}");
        }
        assert_eq!(within_tilt([0.0, 0.0, -2.0], &up, 0.5), [0.0, 0.0, 2.0]);
        assert_eq!(within_tilt([0.0; 3], &up, 0.5), [0.0; 3]);
    }

    #[test]
    fn plans_are_linear_between_their_nodes() {
        let plan = StagePlan { times: vec![1.0, 2.0, 4.0], thrusts: vec![[0.0; 3], [2.0; 3], [6.0; 3]] };
        for (time, expected) in [(0.5, 0.0), (1.5, 1.0), (2.0, 2.0), (3.0, 4.0), (4.0, 6.0), (9.0, 6.0)] {
            assert_eq!(plan.thrust(time), [expected; 3], "{time}");
        }
        assert_eq!(StagePlan { times: Vec::new(), thrusts: Vec::new() }.thrust(1.0), [0.0; 3]);
    }
}
