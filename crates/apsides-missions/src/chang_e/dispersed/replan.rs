//! Flights that are planned anew on their way.

use apsides_ad::{Scalar, VectorFunction};
use apsides_dynamics::frames::Local;
use apsides_dynamics::{planar, powered_descent};
use apsides_ocp::{
    At, Bounds, Guess, Mesh, Ocp, PhaseGuess, PhaseTrajectory, Sense, Term, Trajectory, Variable,
};
use apsides_pipeline::Error;
use apsides_pipeline::dispersion::{Deviations, Onboard, Replanning};
use apsides_radau::Radau;

use super::{FlownEnd, FlownVehicle, PlannedBraking};
use crate::chang_e::lander::Lander;
use crate::chang_e::phases::{ABOVE_M, BELOW_M, BRAKING, ends_at, state_of};
use crate::deviating_flight::{N, parts, rest_of};

/// The worth of a metre of miss of the end, kg, along each of its axes: more than any detour that is left to a flight that can still
/// reach the end, less than to throw the propellant away for it.
const PRICE_OF_MISS: f64 = 0.05;
/// An end this close is reached, m.
const REACHED_M: f64 = 1.0;
/// Parts in which a reserve of thrust is used.
const RESERVE_STEPS: u32 = 4;
/// No new plan in the last seconds of one.
const LAST_S: f64 = 5.0;
/// Amounts and names of the miss above and below, ahead and behind along each axis.
const MISSES: [&str; 6] = [
    "miss upwards",
    "miss downwards",
    "miss to the east",
    "miss to the west",
    "miss to the north",
    "miss to the south",
];

impl PlannedBraking {
    pub(super) fn fly_replanned(
        &self,
        d: &Deviations,
        onboard: &Onboard,
        replanning: &Replanning,
    ) -> Option<FlownEnd> {
        let vehicle = self.vehicle(d, onboard);
        let mut x = self.ends.deviating(d);
        let mut plan = self.plan.clone();
        let mut full_thrust = self.lander.descent.engine.thrust * (1.0 + d.thrust);
        let mut now = plan.initial_time;
        for time in replanning.times(self.plan.final_time) {
            if time > plan.final_time - LAST_S {
                break;
            }
            self.fly_plan(&plan, full_thrust, vehicle.model, &mut x, [now, time])?;
            now = time;
            let believed = self.ends.shifted(&x, &d.navigation_position_m, &d.navigation_velocity_m_s);
            // A flight without a new plan goes on with the one it has.
            if let Some((new, thrust)) = self.replan_within(&vehicle, &plan, time, &believed) {
                plan = new;
                full_thrust = thrust * vehicle.thrust;
            }
        }
        self.fly_plan(&plan, full_thrust, vehicle.model, &mut x, [now, plan.final_time])?;
        Some((plan.final_time, x))
    }

    /// The best plan from a state at a time on and its thrust at full throttle, N: that of the mission, and as little above it as reaches
    /// the end. A plan with the whole reserve would brake late and leave nothing for the next one.
    fn replan_within(
        &self,
        vehicle: &FlownVehicle,
        earlier: &PhaseTrajectory,
        time: f64,
        x: &[f64; N],
    ) -> Option<(PhaseTrajectory, f64)> {
        let mut last = None;
        for step in 0..=RESERVE_STEPS {
            let part = f64::from(step) / f64::from(RESERVE_STEPS);
            let factor = vehicle.planned + part * (1.0 - vehicle.planned);
            let mut lander = vehicle.known.clone();
            lander.descent.engine.thrust *= factor;
            lander.least_throttle /= factor;
            if let Some((plan, miss)) = self.replan(&lander, earlier, time, x) {
                last = Some((plan, lander.descent.engine.thrust));
                if miss <= REACHED_M {
                    break;
                }
            }
            if vehicle.planned >= 1.0 {
                break;
            }
        }
        last
    }

    /// The best plan from a state at a time on, and what it misses its end by, m.
    fn replan(
        &self,
        lander: &Lander,
        earlier: &PhaseTrajectory,
        time: f64,
        x: &[f64; N],
    ) -> Option<(PhaseTrajectory, f64)> {
        let (p, v, mass) = parts(x);
        let (p, v) = self.frame.to_fixed(time, p, v);
        let (r, longitude, latitude) = Local::spherical(p);
        let [w, e, n] = Local::at(longitude, latitude).components(v);
        let ocp = lander.replanning(time, [r, longitude, latitude, w, e, n, mass]).ok()?;
        let mesh = Mesh { phases: vec![rest_of(&earlier.mesh, earlier, time).ok()?] };
        let rest = PhaseTrajectory { initial_time: time, ..earlier.clone() };
        let guess = Guess::from_phases(&ocp, vec![PhaseGuess::earlier(rest)]);
        let solution = Radau::default().solve_on(&ocp, &guess, mesh, &mut ()).ok()?;
        let Trajectory { mut phases, parameters, .. } = solution.trajectory;
        let miss = parameters.iter().sum();
        solution.status.is_success().then(|| (phases.remove(0), miss))
    }
}

/// The miss of an end at the gate above the site, less the amounts that stand for it.
struct Misses {
    gate: [f64; 3],
}

impl VectorFunction<9, 3> for Misses {
    fn evaluate<S: Scalar>(&self, z: &[S; 9]) -> [S; 3] {
        let [radius, longitude, latitude] = self.gate;
        let [at_radius, at_longitude, at_latitude, above, below, east, west, north, south] = *z;
        [
            at_radius - radius - above + below,
            (at_longitude - longitude) * (radius * latitude.cos()) - east + west,
            (at_latitude - latitude) * radius - north + south,
        ]
    }
}

impl Lander {
    /// The main braking from any state (in the order of [`powered_descent::STATES`]) at a time to the gate above the site, or as close to it as is worth the propellant.
    fn replanning(&self, time: f64, start: [f64; N]) -> Result<Ocp, Error> {
        let mut phase = self.ending_at_site(self.braking_phase()).initial_time(Bounds::fixed(time));
        for (q, value) in powered_descent::STATES.into_iter().zip(start) {
            if let Some(s) = state_of(&mut phase, q) {
                s.initial = Bounds::fixed(value);
            }
        }
        let place = [planar::RADIUS, powered_descent::LONGITUDE, powered_descent::LATITUDE];
        ends_at(&mut phase, &place.map(|q| (q, Bounds::FREE)));
        // The guards are those of a start at the perilune.
        if let Some(s) = state_of(&mut phase, planar::RADIUS) {
            let (guard, [radius, ..]) = (&mut s.variable.bounds, start);
            guard.lower = guard.lower.min((radius - BELOW_M).max(self.body.radius));
            guard.upper = guard.upper.max(radius + ABOVE_M);
        }
        let ocp = self.with_gate_speed(Ocp::builder("main braking from a state").phase(phase));
        let ocp = MISSES
            .iter()
            .fold(ocp, |ocp, name| ocp.parameter(Variable::new(*name, "m").at_least(0.0).scaled_by(1e2)));
        let rows = ["up", "east", "north"].map(|name| Variable::new(name, "m").equal_to(0.0).scaled_by(1e2));
        let end = |q: apsides_dynamics::Quantity| At::FinalState(BRAKING, q.name);
        let [a, b, c, d, e, f] = MISSES.map(At::Parameter);
        let [radius, longitude, latitude] = place;
        let inputs = [end(radius), end(longitude), end(latitude), a, b, c, d, e, f];
        let gate = [self.gate_radius, self.site[0], self.site[1]];
        let mass = Term::End(At::FinalState(BRAKING, planar::MASS.name), 1.0);
        let misses = MISSES.iter().map(|name| Term::End(At::Parameter(name), -PRICE_OF_MISS));
        Ok(ocp
            .constrain("place", rows, inputs, Misses { gate })
            .objective(Sense::Maximize, "final_mass", "kg", std::iter::once(mass).chain(misses))
            .objective_scale(self.initial_mass)
            .build()?)
    }
}
