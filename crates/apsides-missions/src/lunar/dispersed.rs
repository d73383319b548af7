//! Flights that deviate from a planned landing: with the thrust of the plan, planned anew, and by a law with a linear radial acceleration.
//!
//! The plan is planar; a deviating flight is in space. A new plan, and the law, fly in the plane of position and velocity where they
//! begin, so that the speed across the course is braked, too. The range is free in every landing: the site is where the flight ends.

use apsides_ad::vector;
use apsides_control::guidance::feed_forward::{AngleCorrections, thrust_direction};
use apsides_control::guidance::linear_radial::{DescentState, LinearRadialLaw};
use apsides_dynamics::Engine;
use apsides_dynamics::cartesian::CartesianForce;
use apsides_dynamics::planar::{
    HORIZONTAL_SPEED, MASS, POLAR_ANGLE, RADIAL_SPEED, RADIUS, STATES, VERTICAL_STATES,
};
use apsides_ephemeris::Motion;
use apsides_ocp::{Bounds, Guess, Mesh, Ocp, Phase, PhaseGuess, PhaseTrajectory, Trajectory};
use apsides_ode::Integrator;
use apsides_pipeline::Error;
use apsides_pipeline::covariance::Transition;
use apsides_pipeline::dispersion::{Deviations, Dispersed, Guidance, Onboard, Replanning};
use apsides_radau::Radau;

use super::LunarLander;
use super::motion::LandingMotion;
use crate::deviating_flight::{
    N, PlannedEnds, Pushed, ThrustArc, fly, fly_by, fly_legs, joined, parts, rest_of, settings,
};

/// No new plan in the last seconds of a phase.
const LAST_S: f64 = 5.0;

/// Poses the rest of a landing: the number of its first phase, the first time and the first state there.
type Rest = Box<dyn Fn(&LunarLander, usize, f64, &[f64]) -> Result<Ocp, Error> + Send + Sync>;

/// A planned landing and what is needed to fly it again.
pub(super) struct PlannedLanding {
    lander: LunarLander,
    planned: FlownPlan,
    rest: Rest,
    ends: PlannedEnds,
}

/// A plan that is flown: the phases from one of the planned ones on, in a plane of its own.
#[derive(Clone)]
struct FlownPlan {
    phases: Vec<PhaseTrajectory>,
    /// Number of the first one among the planned phases.
    first: usize,
    /// Axes of polar angle zero and of a quarter of a turn.
    axes: [[f64; 3]; 2],
    motion: LandingMotion,
}

impl FlownPlan {
    fn end(&self) -> f64 {
        self.phases.last().map_or(0.0, |p| p.final_time)
    }

    /// The start, s.
    fn start(&self) -> f64 {
        self.phases.first().map_or(0.0, |p| p.initial_time)
    }

    /// The thrust (N) along one leg of a phase.
    fn force(&self, k: usize, leg: usize, time: f64) -> [f64; 3] {
        let Some(phase) = self.phases.get(k) else { return [0.0; 3] };
        let mut control = vec![0.0; phase.control.dimension()];
        if !control.is_empty() {
            phase.control.evaluate_in(leg, time, &mut control);
        }
        let point = self.motion.point(self.first + k, time, &phase.state_at(time), &control);
        let [x, y, _] = point.and_then(|p| p.thrust).unwrap_or_default();
        vector::add(&vector::scale(&self.axes[0], x), &vector::scale(&self.axes[1], y))
    }

    /// The pieces of all phases, with their thrust times a factor.
    fn legs(&self, factor: f64) -> impl Iterator<Item = ThrustArc<impl Fn(f64) -> [f64; 3]>> {
        self.phases.iter().enumerate().flat_map(move |(k, phase)| {
            legs(phase).windows(2).enumerate().map(move |(leg, ends)| ThrustArc {
                times: [ends[0], ends[1]],
                force: move |t: f64| self.force(k, leg, t).map(|f| f * factor),
            })
        })
    }

    /// The phase that a time is in.
    fn phase_at(&self, time: f64) -> Option<usize> {
        self.phases.iter().position(|p| time < p.final_time)
    }
}

/// Starts and ends of the pieces on which the controls of a phase are smooth.
fn legs(phase: &PhaseTrajectory) -> &[f64] {
    if phase.control.dimension() > 0 { phase.control.breaks() } else { phase.state.breaks() }
}

impl PlannedLanding {
    /// # Errors
    /// A plan without phases.
    pub(super) fn new(lander: &LunarLander, plan: &Trajectory, rest: Rest) -> Result<Self, Error> {
        let no_plan = || Error::in_mission("the plan has no phase");
        let motion = LandingMotion::of(lander, plan).ok_or_else(no_plan)?;
        let at = |k: usize, p: &PhaseTrajectory, time: f64| {
            let point = motion.point(k, time, &p.state_at(time), &p.control_at(time)).ok_or_else(no_plan)?;
            let up = vector::scale(&point.position, vector::norm(&point.position, 0.0).recip());
            // In the plane of the plan, ahead is a quarter of a turn on; the right of the course is below it.
            let axes = [up, [-up[1], up[0], 0.0], [0.0, 0.0, -1.0]];
            let mass = point.mass.ok_or_else(no_plan)?;
            Ok::<_, Error>((joined(point.position, point.velocity, mass), axes))
        };
        let (first, last) = plan.phases.first().zip(plan.phases.last()).ok_or_else(no_plan)?;
        let (start, start_axes) = at(0, first, first.initial_time)?;
        let (end, end_axes) = at(plan.phases.len() - 1, last, last.final_time)?;
        let ends = PlannedEnds { start, end, start_axes, end_axes };
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let planned = FlownPlan { phases: plan.phases.clone(), first: 0, axes, motion };
        Ok(Self { lander: *lander, planned, rest, ends })
    }

    fn model(&self, d: &Deviations) -> CartesianForce {
        let exhaust_velocity = self.lander.flight.engine.exhaust_velocity * (1.0 + d.exhaust_velocity);
        CartesianForce { body: self.lander.flight.body, exhaust_velocity }
    }

    fn results(&self, x: &[f64; N], time: f64) -> Vec<f64> {
        let (p, v, mass) = parts(x);
        self.ends.results(p, v, mass, time)
    }

    fn fly_open_loop(&self, d: &Deviations) -> Option<Vec<f64>> {
        let (plan, mut x) = (&self.planned, self.ends.deviating(d));
        fly_legs(plan.legs(1.0 + d.thrust), self.model(d), &mut x, [plan.start(), plan.end()])?;
        Some(self.results(&x, plan.end()))
    }

    /// The engine that plans and laws take for true, and the true thrust by theirs.
    fn known(&self, d: &Deviations, onboard: &Onboard) -> (Engine, f64) {
        let mut engine = self.lander.flight.engine;
        if !onboard.engine_known {
            return (engine, 1.0 + d.thrust);
        }
        engine.thrust *= 1.0 + d.thrust;
        engine.exhaust_velocity *= 1.0 + d.exhaust_velocity;
        (engine, 1.0)
    }

    fn fly_replanned(&self, d: &Deviations, onboard: &Onboard, replanning: &Replanning) -> Option<Vec<f64>> {
        let (engine, unknown) = self.known(d, onboard);
        let mut lander = self.lander;
        lander.flight.engine = engine;
        let (mut plan, mut x) = (self.planned.clone(), self.ends.deviating(d));
        let mut factor = 1.0 + d.thrust;
        let mut now = plan.start();
        for time in replanning.times(plan.end()) {
            let Some(k) = plan.phase_at(time + LAST_S) else { break };
            fly_legs(plan.legs(factor), self.model(d), &mut x, [now, time])?;
            now = time;
            let believed = self.ends.shifted(&x, &d.navigation_position_m, &d.navigation_velocity_m_s);
            // A flight without a new plan goes on with the one it has.
            let in_phase = plan.phases.get(k).is_some_and(|p| p.initial_time <= time);
            if in_phase && let Some(new) = self.replan(&lander, &plan, k, time, &believed) {
                plan = new;
                factor = unknown * engine.thrust / self.lander.flight.engine.thrust;
            }
        }
        fly_legs(plan.legs(factor), self.model(d), &mut x, [now, plan.end()])?;
        Some(self.results(&x, plan.end()))
    }

    /// The best plan from a state in a phase at a time on.
    fn replan(
        &self,
        lander: &LunarLander,
        earlier: &FlownPlan,
        k: usize,
        time: f64,
        x: &[f64; N],
    ) -> Option<FlownPlan> {
        let rest = earlier.phases.get(k..)?;
        let current = rest.first()?;
        let (p, v, mass) = parts(x);
        let radius = vector::norm(&p, 0.0);
        let up = vector::scale(&p, radius.recip());
        let climb = vector::dot(&v, &up);
        let across = vector::add(&v, &vector::scale(&up, -climb));
        let speed = vector::norm(&across, 0.0);
        let ahead = vector::scale(&across, speed.recip());
        let mut state = current.state_at(time);
        let angle = if state.len() == VERTICAL_STATES.len() {
            state.copy_from_slice(&[radius, climb, mass]);
            earlier.motion.last_angle()
        } else {
            let values = [(RADIUS, radius), (HORIZONTAL_SPEED, speed), (RADIAL_SPEED, climb), (MASS, mass)];
            for (q, value) in values {
                *state.get_mut(q.position_in(&STATES)?)? = value;
            }
            *state.get(POLAR_ANGLE.position_in(&STATES)?)?
        };
        let ocp = (self.rest)(lander, earlier.first + k, time, &state).ok()?;
        let mut meshes: Vec<_> = rest.iter().map(|p| p.mesh.clone()).collect();
        *meshes.first_mut()? = rest_of(&current.mesh, current, time).ok()?;
        let mut phases: Vec<PhaseTrajectory> = rest.to_vec();
        phases.first_mut()?.initial_time = time;
        let guess = Guess::from_phases(&ocp, phases.into_iter().map(PhaseGuess::earlier).collect());
        let solution = Radau::default().solve_on(&ocp, &guess, Mesh { phases: meshes }, &mut ()).ok()?;
        let (sin, cos) = angle.sin_cos();
        let axis = |a: f64, b: f64| vector::add(&vector::scale(&up, a), &vector::scale(&ahead, b));
        solution.status.is_success().then(|| FlownPlan {
            motion: earlier.motion.of_rest(&solution.trajectory.phases),
            phases: solution.trajectory.phases,
            first: earlier.first + k,
            axes: [axis(cos, -sin), axis(sin, cos)],
        })
    }

    /// The plan up to its last inclined braking, the law to the end of that, and the plan behind it.
    fn fly_linear_radial(
        &self,
        d: &Deviations,
        onboard: &Onboard,
        corrections: AngleCorrections,
    ) -> Option<Vec<f64>> {
        let plan = &self.planned;
        let k = plan.phases.iter().rposition(|p| p.state.dimension() >= STATES.len())?;
        let braking = plan.phases.get(k)?;
        let (engine, unknown) = self.known(d, onboard);
        let end = braking.final_state();
        let of = |q: apsides_dynamics::Quantity| end.get(q.position_in(&STATES)?).copied();
        let law = LinearRadialLaw {
            gravitational_parameter: self.lander.flight.body.gravitational_parameter,
            engine,
            radius: of(RADIUS)?,
            radial_speed: of(RADIAL_SPEED)?,
            horizontal_speed: of(HORIZONTAL_SPEED)?,
        };
        let mut x = self.ends.deviating(d);
        let (start, planned_end) = (plan.start(), braking.final_time);
        fly_legs(plan.legs(1.0 + d.thrust), self.model(d), &mut x, [start, braking.initial_time])?;
        let command = |_: f64, x: &[f64; N], guess: f64| {
            let believed = self.ends.shifted(x, &d.navigation_position_m, &d.navigation_velocity_m_s);
            let (p, v, mass) = parts(&believed);
            let radius = vector::norm(&p, 0.0);
            let up = vector::scale(&p, radius.recip());
            let radial_speed = vector::dot(&v, &up);
            let across = vector::add(&v, &vector::scale(&up, -radial_speed));
            let horizontal_speed = vector::norm(&across, 0.0);
            let state = DescentState { radius, radial_speed, horizontal_speed, mass };
            let command = law.command(&state, Some(guess)).ok()?;
            let back = vector::scale(&across, -1.0);
            let direction = thrust_direction(&up, &back, command.pitch, corrections)?;
            Some((vector::scale(&direction, engine.thrust), command.time_to_go))
        };
        let push = |_: f64, thrust: [f64; 3]| thrust.map(|f| f * unknown);
        let (now, mut x) = fly_by(self.model(d), (braking.initial_time, x), planned_end, command, push)?;
        // What follows is flown as planned, later or earlier, upright over the place that was reached.
        let late = now - planned_end;
        let mut integrator = Integrator::new(N, settings()).ok()?;
        for (j, phase) in plan.phases.iter().enumerate().skip(k + 1) {
            for (leg, ends) in legs(phase).windows(2).enumerate() {
                let up = vector::scale(&parts(&x).0, vector::norm(&parts(&x).0, 0.0).recip());
                let force = |t: f64| {
                    let size = vector::norm(&plan.force(j, leg, t - late), 0.0) * (1.0 + d.thrust);
                    vector::scale(&up, size)
                };
                let system = Pushed { force, model: self.model(d) };
                fly(&mut integrator, &system, &mut x, ends[0] + late, ends[1] + late)?;
            }
        }
        Some(self.results(&x, plan.end() + late))
    }

    /// Transition from start to end, with the thrust of the plan; inputs are relative errors of thrust and exhaust velocity.
    fn transition(&self) -> Option<Transition> {
        self.ends.transition(self.planned.legs(1.0), self.model(&Deviations::default()))
    }
}

impl Dispersed for PlannedLanding {
    fn fly(&self, deviations: &Deviations, guidance: &Guidance, onboard: &Onboard) -> Option<Vec<f64>> {
        if !self.ends.can_fly(deviations) {
            return None;
        }
        match guidance {
            Guidance::OpenLoop => self.fly_open_loop(deviations),
            Guidance::Replanned(times) => self.fly_replanned(deviations, onboard, times),
            Guidance::LinearRadial(_) => {
                self.fly_linear_radial(deviations, onboard, guidance.corrections(deviations))
            }
            // The thrust of a landing has one size: no acceleration linear in time.
            Guidance::Polynomial => None,
        }
    }

    fn refused(&self, guidance: &Guidance) -> Option<&'static str> {
        let reason = "an acceleration linear in time takes a throttle, and the thrust of this landing has one size: fly in open loop, \
                      re-plan, or correct the plan linearly";
        matches!(guidance, Guidance::Polynomial).then_some(reason)
    }

    fn linear_covariance(&self, dispersions: &Deviations) -> Option<Vec<f64>> {
        self.ends.covariance(self.transition()?, dispersions)
    }
}

/// A phase that begins at a time in a state.
pub(super) fn begun(mut phase: Phase, time: f64, state: &[f64]) -> Phase {
    for (s, value) in phase.states.iter_mut().zip(state) {
        s.initial = Bounds::fixed(*value);
        let bounds = &mut s.variable.bounds;
        (bounds.lower, bounds.upper) = (bounds.lower.min(*value), bounds.upper.max(*value));
    }
    phase.initial_time(Bounds::fixed(time))
}

#[cfg(test)]
mod tests;
