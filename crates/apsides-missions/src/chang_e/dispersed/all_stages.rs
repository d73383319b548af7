//! Flights that deviate from a planned landing, carried through all of its stages to the ground.
//!
//! In open loop the thrust of the plan is flown over time, whatever the altitude. Steered flights end each stage at its gate, or where they
//! get; the next stage begins there. At the end of the last the engine is cut off and the lander falls. The ground is level, at the height of
//! the landing site; a flight that meets it before has landed there.

use apsides_ad::vector;
use apsides_dynamics::cartesian::CartesianForce;
use apsides_dynamics::frames::{BodyFixed, Local};
use apsides_dynamics::great_circle::central_angle;
use apsides_ephemeris::Motion as _;
use apsides_ocp::{PhaseTrajectory, Trajectory};
use apsides_pipeline::Error;
use apsides_pipeline::dispersion::{Deviations, Dispersed, Guidance, Onboard};

use super::grounded::GroundedFlight;
use super::laws::free_acceleration;
use super::stage_steering::{StageEnd, StageSteering};
use super::{FlownEnd, PlannedBraking, course_axes};
use crate::chang_e::flight_state::{Across, FlightState};
use crate::chang_e::lander::{Lander, Motion};
use crate::chang_e::landing::SixStageLanding;
use crate::chang_e::motion::DescentMotion;
use crate::chang_e::phases::{ADJUSTMENT, AVOIDANCE, BRAKING, DESCENT, FINE_AVOIDANCE, HOVER};
use crate::chang_e::terrain::MapSource;
use crate::deviating_flight::{COLUMNS as OF_END, PlannedEnds, ThrustArc, joined, parts};
use crate::site_criteria;

/// A touchdown is soft up to this part of the planned speed downwards, and up to this speed over the ground, m/s: assumptions.
const SOFT_PART: f64 = 1.2;
const SOFT_SIDEWAYS_M_S: f64 = 1.0;

/// The stages in their order; one without time is none of the plan.
const STAGES: [&str; 6] = [BRAKING, ADJUSTMENT, AVOIDANCE, HOVER, FINE_AVOIDANCE, DESCENT];
/// Numbers of the end of a stage: up, aside and speed.
const OF_A_STAGE: usize = 3;

/// The touchdown, and where the stages before the last ended against their gates: above it, aside of it, and the difference of the velocities.
const OF_STAGES: [&str; 21] = [
    // 1 for a touchdown that is soft, on the site and with propellant left, else 0.
    "success",
    "touchdown_speed_m_s",
    "touchdown_sideways_m_s",
    "site_distance_m",
    "propellant_kg",
    // Stages that ended above the ground.
    "stages_flown",
    "braking_up_m",
    "braking_aside_m",
    "braking_speed_m_s",
    "adjustment_up_m",
    "adjustment_aside_m",
    "adjustment_speed_m_s",
    "avoidance_up_m",
    "avoidance_aside_m",
    "avoidance_speed_m_s",
    "hover_up_m",
    "hover_aside_m",
    "hover_speed_m_s",
    "fine_avoidance_up_m",
    "fine_avoidance_aside_m",
    "fine_avoidance_speed_m_s",
];

/// The results of a flight: the state at the cut-off of the engine relative to the plan (or where the ground was met before), then those of the
/// touchdown and of the stages.
pub(in crate::chang_e) const COLUMNS: [&str; OF_END.len() + OF_STAGES.len()] = {
    let mut all = [""; OF_END.len() + OF_STAGES.len()];
    let mut k = 0;
    while k < all.len() {
        all[k] = if k < OF_END.len() { OF_END[k] } else { OF_STAGES[k - OF_END.len()] };
        k += 1;
    }
    all
};

/// A planned landing and what is needed to fly it again.
pub(in crate::chang_e) struct PlannedStages {
    landing: SixStageLanding,
    plan: Trajectory,
    braking: PlannedBraking,
    ends: PlannedEnds,
    /// The end of each phase of the plan.
    stages: Vec<StageEnd>,
    /// Distance from the site up to which a touchdown is on it, m.
    on_site: f64,
}

impl PlannedStages {
    /// # Errors
    /// Missions in the plane, those with a field of higher degree, and criteria that cannot be read.
    pub(in crate::chang_e) fn new(landing: &SixStageLanding, plan: &Trajectory) -> Result<Self, Error> {
        let no_plan = || Error::in_mission("the plan lacks a phase of the landing");
        let braking = PlannedBraking::new(&aiming_at_gate(&landing.lander, plan).ok_or_else(no_plan)?, plan)?;
        let stages: Option<Vec<StageEnd>> =
            plan.phases.iter().enumerate().map(|(k, phase)| stage_end(landing, plan, k, phase)).collect();
        let stages = stages.ok_or_else(no_plan)?;
        let (last, phase) = stages.last().zip(plan.phases.last()).ok_or_else(no_plan)?;
        let time = phase.final_time;
        let frame = &braking.frame;
        let (position, velocity) = frame.to_inertial(time, last.position, last.velocity);
        let mass = phase.state_at(time).last().copied().ok_or_else(no_plan)?;
        let axes = course_axes(&last.local, landing.lander.azimuth);
        let ends = PlannedEnds {
            start: braking.ends.start,
            start_axes: braking.ends.start_axes,
            end: joined(position, velocity, mass),
            end_axes: axes.map(|axis| frame.to_inertial(time, axis, [0.0; 3]).0),
        };
        let map = [&landing.fine, &landing.coarse].into_iter().find(|map| map.source != MapSource::None);
        let on_site = match map {
            Some(map) => {
                let criteria = site_criteria::load(&map.criteria)?;
                criteria.clearance_min_m.max(criteria.footpad_circle_radius_m)
            }
            None => f64::INFINITY,
        };
        Ok(Self { landing: landing.clone(), plan: plan.clone(), braking, ends, stages, on_site })
    }

    fn frame(&self) -> &BodyFixed {
        &self.braking.frame
    }

    /// The pieces of a phase of the plan, later by some seconds, with their thrust times a factor.
    fn legs<'a>(
        &'a self,
        k: usize,
        later: f64,
        factor: f64,
    ) -> Option<impl Iterator<Item = ThrustArc<impl Fn(f64) -> [f64; 3] + 'a>>> {
        let phase = self.plan.phases.get(k)?;
        let has_controls = phase.control.dimension() > 0;
        let breaks = if has_controls { phase.control.breaks() } else { phase.state.breaks() };
        let diverts = [self.landing.coarse_divert(), self.landing.fine_divert()].map(Some);
        let force = move |leg: usize, time: f64| {
            let mut control = vec![0.0; phase.control.dimension()];
            if has_controls {
                phase.control.evaluate_in(leg, time, &mut control);
            }
            let motion = DescentMotion::of(&self.landing.lander, &self.plan, diverts);
            let point = motion.point(k, time, &phase.state_at(time), &control);
            let thrust = point.and_then(|p| p.thrust).unwrap_or_default();
            self.frame().to_inertial(time + later, thrust, [0.0; 3]).0.map(|f| f * factor)
        };
        Some(breaks.windows(2).enumerate().map(move |(leg, ends)| ThrustArc {
            times: [ends[0] + later, ends[1] + later],
            force: move |time: f64| force(leg, time - later),
        }))
    }

    /// Flies the thrust of a phase of the plan, from the present time on.
    fn fly_planned(&self, k: usize, flight: &mut GroundedFlight, factor: f64) -> Option<()> {
        let later = flight.now - self.plan.phases.get(k)?.initial_time;
        for ThrustArc { times: [_, end], force } in self.legs(k, later, factor)? {
            flight.push(force, end)?;
        }
        Some(())
    }

    /// Flies a stage.
    fn fly_stage(
        &self,
        k: usize,
        flight: &mut GroundedFlight,
        d: &Deviations,
        (guidance, onboard): (&Guidance, &Onboard),
    ) -> Option<()> {
        let end = self.stages.get(k)?;
        if *guidance == Guidance::OpenLoop {
            return self.fly_planned(k, flight, 1.0 + d.thrust);
        }
        if k == 0 {
            flight.go_on_from(self.braking.flown(d, guidance, onboard)?);
            return Some(());
        }
        let vehicle = self.braking.vehicle(d, onboard);
        let steering =
            StageSteering { frame: self.frame(), ends: &self.ends, vehicle: &vehicle, deviations: d };
        match guidance {
            Guidance::Replanned(replanning) => steering
                .fly_replanned(end, flight, replanning, |flight| self.fly_planned(k, flight, 1.0 + d.thrust)),
            _ => steering.fly_by_law(end, flight),
        }
    }

    /// The end of a stage against its gate: above it and aside of it, m, and the difference of the velocities, m/s.
    fn against_gate(&self, k: usize, flight: &GroundedFlight) -> Option<[f64; OF_A_STAGE]> {
        let gate = self.stages.get(k)?;
        let (p, v, _) = parts(&flight.x);
        let (p, v) = self.frame().to_fixed(flight.now, p, v);
        let minus = |a: &[f64; 3], b: &[f64; 3]| vector::add(a, &vector::scale(b, -1.0));
        let [_, east, north] = gate.local.components(minus(&p, &gate.position));
        let up = vector::norm(&p, 0.0) - vector::norm(&gate.position, 0.0);
        Some([up, east.hypot(north), vector::norm(&minus(&v, &gate.velocity), 0.0)])
    }

    /// Speeds downwards and over the ground, m/s, and the distance from the site, m, at the ground.
    fn touchdown(&self, flight: &GroundedFlight) -> [f64; 3] {
        let (p, v, _) = parts(&flight.x);
        let (p, v) = self.frame().to_fixed(flight.now, p, v);
        let (_, longitude, latitude) = Local::spherical(p);
        let [climb, east, north] = Local::at(longitude, latitude).components(v);
        let away = central_angle([longitude, latitude], self.landing.fine_divert().to);
        [-climb, east.hypot(north), away * self.landing.ground_radius()]
    }

    /// [`COLUMNS`] up to the time of flight, of a state at a time.
    fn at_cutoff(&self, (time, x): FlownEnd) -> Vec<f64> {
        let (p, v, mass) = parts(&x);
        let (p, v) = self.frame().to_fixed(time, p, v);
        let planned = self.plan.phases.last().map_or(time, |phase| phase.final_time);
        let (p, v) = self.frame().to_inertial(planned, p, v);
        self.ends.results(p, v, mass, time)
    }
}

/// The lander that plans its braking to the gate of a plan, which is ahead of the site and has a velocity of its own.
fn aiming_at_gate(lander: &Lander, plan: &Trajectory) -> Option<Lander> {
    if lander.motion == Motion::Plane {
        // Refused with its reason where the braking is flown.
        return Some(lander.clone());
    }
    let end = FlightState::end(lander.motion, plan.phases.first()?)?;
    let Across::Space { longitude, latitude, eastward, northward } = end.across else { return None };
    let gate_velocity = Some([end.upward, eastward, northward]);
    Some(Lander { site: [longitude, latitude], gate_velocity, ..lander.clone() })
}

/// The end of a phase of a plan.
fn stage_end(
    landing: &SixStageLanding,
    plan: &Trajectory,
    k: usize,
    phase: &PhaseTrajectory,
) -> Option<StageEnd> {
    let lander = &landing.lander;
    let time = phase.final_time;
    let diverts = [landing.coarse_divert(), landing.fine_divert()];
    let motion = DescentMotion::of(lander, plan, diverts.map(Some));
    let control = if phase.control.dimension() > 0 { phase.control_at(time) } else { Vec::new() };
    let point = motion.point(k, time, &phase.state_at(time), &control)?;
    let (thrust, mass) = (point.thrust?, point.mass?);
    let (_, longitude, latitude) = Local::spherical(point.position);
    let local = Local::at(longitude, latitude);
    let free = free_acceleration(lander, &point.position, &point.velocity);
    let acceleration = vector::add(&free, &vector::scale(&thrust, mass.recip()));
    Some(StageEnd {
        duration: time - phase.initial_time,
        position: point.position,
        velocity: point.velocity,
        climb: vector::dot(&acceleration, &local.up),
        local,
        tilt: match phase.name.as_str() {
            ADJUSTMENT => landing.adjustment_tilt,
            AVOIDANCE => landing.coarse.tilt,
            _ => landing.fine.tilt,
        },
        is_timed: phase.name == HOVER,
    })
}

impl Dispersed for PlannedStages {
    fn fly(&self, deviations: &Deviations, guidance: &Guidance, onboard: &Onboard) -> Option<Vec<f64>> {
        if !self.ends.can_fly(deviations) {
            return None;
        }
        let lander = &self.landing.lander;
        let vehicle = self.braking.vehicle(deviations, onboard);
        let begin = self.plan.phases.first()?.initial_time;
        let start = self.ends.deviating(deviations);
        let initial_mass = parts(&start).2;
        let mut flight = GroundedFlight::new(begin, start, vehicle.model, self.landing.ground_radius())?;
        let mut of_stages = Vec::with_capacity(OF_A_STAGE * STAGES.len());
        let mut flown = 0;
        let mut phases = self.plan.phases.iter().enumerate().peekable();
        let mut gate = 0;
        for stage in STAGES {
            // A stage without time ends where the one before did.
            if let Some((k, _)) = phases.next_if(|(_, phase)| phase.name == stage) {
                gate = k;
                if !flight.landed {
                    self.fly_stage(k, &mut flight, deviations, (guidance, onboard))?;
                }
            }
            flown += usize::from(!flight.landed);
            of_stages.extend(self.against_gate(gate, &flight)?);
        }
        // The last is told in full.
        of_stages.truncate(OF_A_STAGE * (STAGES.len() - 1));
        let mut results = self.at_cutoff((flight.now, flight.x));
        flight.fall()?;
        let [down, sideways, away] = self.touchdown(&flight);
        let mass = parts(&flight.x).2;
        let soft = down <= SOFT_PART * self.landing.touchdown_speed() && sideways <= SOFT_SIDEWAYS_M_S;
        let success = soft && away <= self.on_site && mass >= lander.dry_mass && flown == STAGES.len();
        results.extend([
            f64::from(u8::from(success)),
            down,
            sideways,
            away,
            initial_mass - mass,
            flown as f64,
        ]);
        results.extend(of_stages);
        Some(results)
    }

    /// The matrix knows no ground: flights through it count as well.
    fn linear_covariance(&self, dispersions: &Deviations) -> Option<Vec<f64>> {
        let exhaust_velocity = self.landing.lander.descent.engine.exhaust_velocity;
        let model = CartesianForce { body: self.landing.lander.body, exhaust_velocity };
        let phases: Option<Vec<_>> = (0..self.plan.phases.len()).map(|k| self.legs(k, 0.0, 1.0)).collect();
        self.ends.covariance(self.ends.transition(phases?.into_iter().flatten(), model)?, dispersions)
    }
}

#[cfg(test)]
mod tests;
