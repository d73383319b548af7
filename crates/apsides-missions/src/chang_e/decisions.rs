//! The decisions in flight: the velocity at the gate where stages are optimised one by one, and the sites on the maps.
//!
//! The main braking and the adjustment are flown for the site that is aimed at. Above it, at the end of the adjustment, the coarse map is
//! seen; the flight goes on to the site that is chosen on it. Above that one, at the hover, the fine map is seen, and the flight goes on to
//! the landing site. What was flown before a decision stays as it was planned: the velocity there is fixed.

use apsides_convex::{DescentLimits, DescentProblem, DivertPlanner, DivertSettings, Outcome};
use apsides_ocp::{Guess, Trajectory};
use apsides_pipeline::error::Source;
use apsides_pipeline::{Cancellation, ChosenSite, Decisions, Error, Posed, SiteSummary};
use apsides_radau::Radau;
use apsides_terrain::contact;
use apsides_terrain::site::selection::{
    self, NoSite, SelectionRequest, SiteSelection, Unreached, select_site,
};
use apsides_terrain::synthetic::Terrain;

use super::divert::Divert;
use super::flight_state::{Across, FlightState};
use super::keys::{self, COARSE, FINE, MapKeys};
use super::lander::Lander;
use super::landing::{SixStageLanding, StageOrder};
use super::phases::{ADJUSTMENT, AVOIDANCE};
use super::stages::AFTER_FINE_AVOIDANCE;
use super::terrain::SiteMap;
use crate::site_criteria;

/// Propellant of a divert by its length, kg/m: at the end of the adjustment one of 1000 m takes 8.1 kg.
const COARSE_DIVERT_COST: f64 = 0.008;
/// The same at the hover, where one of 70 m takes 2.8 kg.
const FINE_DIVERT_COST: f64 = 0.03;

/// Least distance between candidates, by the least clearance of a site.
const SEPARATION: f64 = 2.0;

/// The plan without maps, in messages.
const AT_SITE_AIMED_AT: &str = "the landing at the site aimed at";

/// Decides what a landing leaves open.
pub(super) fn decide(landing: &SixStageLanding, cancellation: &Cancellation) -> Result<Decisions, Error> {
    let mut landing = landing.clone();
    let mut decisions = Decisions::default();
    let open = landing.lander.gate_velocity.is_none() || landing.gate_mass.is_none();
    if landing.order == StageOrder::ByStages && open {
        let braking = solved(&landing.lander.braking()?, None, "the main braking alone", cancellation)?;
        let end = braking.phases.first().and_then(|p| FlightState::end(landing.lander.motion, p));
        let (own, mass) = match end {
            Some(FlightState { upward, mass, across: Across::Plane { forward, .. }, .. }) => {
                ([upward, 0.0, forward], mass)
            }
            Some(FlightState { upward, mass, across: Across::Space { eastward, northward, .. }, .. }) => {
                ([upward, eastward, northward], mass)
            }
            _ => return Err(Error::in_mission("the main braking has no velocity at its end")),
        };
        let velocity = *landing.lander.gate_velocity.get_or_insert(own);
        let mass = *landing.gate_mass.get_or_insert(mass);
        decisions.values.extend(keys::GATE_VELOCITY.map(Into::into).into_iter().zip(velocity));
        decisions.values.push((keys::GATE_MASS.into(), mass));
    }
    let (coarse, fine) = (landing.coarse.is_open(), landing.fine.is_open());
    if !coarse && !fine {
        return Ok(decisions);
    }
    // The plan without maps, as far as the end of the adjustment.
    let mut start = None;
    for lighter in landing.lighter_paths() {
        start = Some(solved(&lighter.problem()?, start.as_ref(), AT_SITE_AIMED_AT, cancellation)?);
    }
    let plan = solved(&landing.problem()?, start.as_ref(), AT_SITE_AIMED_AT, cancellation)?;
    let adjusted = end_of(&plan, &landing.lander, ADJUSTMENT);
    let Some(FlightState { upward, mass, across: Across::Space { .. }, .. }) = adjusted else {
        return Err(Error::in_mission("maps need a flight in space"));
    };
    landing.adjusted_speed = Some(upward);
    decisions.values.push((keys::ADJUSTED_SPEED.into(), upward));
    let mut mass_at_hover = None;
    if coarse {
        let radius = landing.coarse_radius();
        let seen = LanderOverMap { keys: &COARSE, landing: &landing, radius, upward, mass, cancellation };
        let site = seen.select(&SiteWanted {
            map: &landing.coarse,
            terrain: Terrain::coarse(),
            from: landing.coarse_divert(),
            end_altitude: landing.hover_altitude,
            end_speed: 0.0,
            divert_cost: COARSE_DIVERT_COST,
        })?;
        let chosen = site.site();
        landing.coarse.site = chosen.offset.map(Some);
        mass_at_hover = chosen.divert.reached().map(|propellant| mass - propellant);
        decisions.values.extend(COARSE.site.map(Into::into).into_iter().zip(chosen.offset));
        decisions.sites.push(ChosenSite::new(summary(&site), site));
    }
    if fine {
        if let Some(reason) = landing.ground_too_high() {
            return Err(Error::in_mission(reason));
        }
        let Lander { body, descent, .. } = &landing.lander;
        let planned =
            || end_of(&plan, &landing.lander, AVOIDANCE).map_or(landing.lander.dry_mass, |s| s.mass);
        let before = mass_at_hover.unwrap_or_else(planned);
        let mass = descent.engine.mass_after(before, landing.hover_time * body.surface_gravity());
        let radius = landing.hover_radius();
        let seen = LanderOverMap { keys: &FINE, landing: &landing, radius, upward: 0.0, mass, cancellation };
        let site = seen.select(&SiteWanted {
            map: &landing.fine,
            terrain: Terrain::fine(),
            from: landing.fine_divert(),
            end_altitude: landing.fine_altitude,
            end_speed: AFTER_FINE_AVOIDANCE,
            divert_cost: FINE_DIVERT_COST,
        })?;
        decisions.values.extend(FINE.site.map(Into::into).into_iter().zip(site.site().offset));
        decisions.sites.push(ChosenSite::new(summary(&site), site));
    }
    Ok(decisions)
}

/// The choice of a site in the summary of the mission.
fn summary(s: &SiteSelection) -> SiteSummary {
    let site = s.site();
    let reached: Vec<f64> = s.candidates.iter().filter_map(|c| c.divert.reached()).collect();
    // A site that is chosen is within reach.
    let propellant = site.divert.reached().unwrap_or(f64::NAN);
    SiteSummary {
        map: s.name.into(),
        safe_fraction: s.hazards.counts().safe_fraction(),
        below: s.below_verdict(),
        candidates: [s.candidates.len(), reached.len()],
        offset_m: site.offset,
        clearance_m: Some(site.site.clearance_m).filter(|c| c.is_finite()),
        propellant_kg: [propellant, propellant - reached.iter().copied().fold(f64::INFINITY, f64::min)],
        tilt_deg: site.tilt.map(f64::to_degrees),
        warning: s.hazards.criteria().unsafe_because().map(|reason| format!("{} map: {reason}", s.name)),
    }
}

/// The state at the end of a phase of a plan.
fn end_of(plan: &Trajectory, lander: &Lander, phase: &str) -> Option<FlightState> {
    plan.phases.iter().find(|p| p.name == phase).and_then(|p| FlightState::end(lander.motion, p))
}

/// The solution of a problem, from that of an easier one if there is one.
fn solved(
    posed: &Posed,
    start: Option<&Trajectory>,
    what: &str,
    cancellation: &Cancellation,
) -> Result<Trajectory, Error> {
    let radau = Radau::default();
    let mut observer = cancellation.clone();
    let solved = match start {
        Some(start) => radau.solve_on(&posed.ocp, &Guess::earlier(start), start.mesh(), &mut observer)?,
        None => radau.solve_on(&posed.ocp, &posed.guess, radau.uniform_mesh(&posed.ocp)?, &mut observer)?,
    };
    if solved.status.is_success() {
        return Ok(solved.trajectory);
    }
    Err(Error::in_mission(format!("{what} has no solution: {}", solved.status)))
}

/// The choice that is wanted on a map.
struct SiteWanted<'a> {
    map: &'a SiteMap,
    /// The map where it is generated.
    terrain: Terrain,
    /// The divert from here on, without a length yet.
    from: Divert,
    /// Altitude above the site where the divert ends, m, and the upward speed there, m/s.
    end_altitude: f64,
    end_speed: f64,
    /// Propellant of a divert by its length, kg/m.
    divert_cost: f64,
}

/// The lander above the middle of a map.
struct LanderOverMap<'a> {
    keys: &'a MapKeys,
    landing: &'a SixStageLanding,
    radius: f64,
    upward: f64,
    mass: f64,
    cancellation: &'a Cancellation,
}

impl LanderOverMap<'_> {
    /// The descent that is ahead, in axes to the east, to the north and upwards from the ground below.
    fn descent(&self, wanted: &SiteWanted<'_>) -> DescentProblem {
        let Lander { descent, body, least_throttle, dry_mass, .. } = &self.landing.lander;
        let ground = body.radius + self.landing.coarse_divert().rise;
        let (gravity, rotation) = self.landing.lander.uniform_field(self.radius, wanted.from.from);
        DescentProblem {
            gravity,
            rotation,
            mass: self.mass,
            dry_mass: *dry_mass,
            exhaust_velocity: descent.engine.exhaust_velocity,
            thrust: [*least_throttle, 1.0].map(|throttle| throttle * descent.engine.thrust),
            position: [0.0, 0.0, self.radius - ground],
            velocity: [0.0, 0.0, self.upward],
            target: [0.0, 0.0, wanted.end_altitude],
            target_velocity: [0.0, 0.0, wanted.end_speed],
            limits: DescentLimits { pointing: Some(wanted.from.tilt), ..DescentLimits::default() },
        }
    }

    fn select(&self, wanted: &SiteWanted<'_>) -> Result<SiteSelection, Error> {
        let criteria = site_criteria::load(&wanted.map.criteria)?;
        let Some(map) = wanted.map.map(self.keys, wanted.terrain, self.landing.seed)? else {
            return Err(Error::in_mission(format!("`{}` names no map", self.keys.map)));
        };
        let request = SelectionRequest {
            name: self.keys.name,
            map,
            criteria,
            rule: self.landing.rule,
            candidates: self.landing.candidates,
            separation: SEPARATION * criteria.clearance_min_m,
            hazard_worth: wanted.map.hazard_worth,
            divert_cost: wanted.divert_cost,
            lander: contact::Lander {
                pad_distance: criteria.footpad_circle_radius_m,
                pad_radius: criteria.footpad_radius_m,
                centre_of_mass_height: self.landing.centre_of_mass_height,
                belly: None,
            },
        };
        let descent = self.descent(wanted);
        let refused = |reason: String| Error::in_mission(format!("{} map: {reason}", self.keys.name));
        let mut planner = None;
        let watch = |_| !self.cancellation.is_asked();
        let selection = select_site(request, &watch, |offset| plan_divert(&mut planner, &descent, offset));
        selection
            .map_err(|e| refused(e.to_string()))?
            .map_err(|none| refused(self.without_site(&none, &descent)))
    }

    /// Says in words for what reason there is no site.
    fn without_site(&self, none: &NoSite, descent: &DescentProblem) -> String {
        match none {
            NoSite::OutOfReach { candidates, nearest } => format!(
                "none of {candidates} safe sites is within reach with a tilt of at most {} deg and {:.1} kg of propellant; \
                 the nearest to it, {nearest}; raise `{}` or choose a site nearer to it",
                descent.limits.pointing.map_or(180.0, f64::to_degrees),
                descent.propellant(),
                self.keys.tilt
            ),
            other => other.to_string(),
        }
    }
}

/// The effort of a flight to a place above a site; `planner` is that of the descent from its first use on.
fn plan_divert(
    planner: &mut Option<DivertPlanner>,
    descent: &DescentProblem,
    [east, north, up]: [f64; 3],
) -> Result<selection::Divert, Source> {
    let planner = match planner {
        Some(planner) => planner,
        none => none.insert(DivertPlanner::new(descent, DivertSettings::default())?),
    };
    let [.., above] = descent.target;
    let divert = planner.divert([east, north, up + above])?;
    let distance = match divert.outcome {
        Outcome::OutOfReach { distance } | Outcome::NoArrival { distance, .. } => Some(distance),
        Outcome::TooLittlePropellant { distance, .. } => Some(distance).filter(|d| d.is_finite()),
        Outcome::Landed | Outcome::Relaxed { .. } | Outcome::NoFlight(_) => None,
    };
    let unreached = (divert.outcome != Outcome::Landed)
        .then(|| Unreached { reason: divert.outcome.to_string(), distance });
    Ok(selection::Divert {
        propellant: Some(divert.propellant).filter(|p| p.is_finite()),
        flight_time: divert.flight_time,
        unreached,
    })
}
