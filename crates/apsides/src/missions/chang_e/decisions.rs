//! What is decided in flight: the velocity at the gate where stages are optimised one by one, and the sites on the maps.
//!
//! The main braking and the adjustment are flown for the site that is aimed at. Above it, at the end of the adjustment, the coarse map is
//! seen; the flight goes on to the site that is chosen on it. Above that one, at the hover, the fine map is seen, and the flight goes on to
//! the landing site. What was flown before a decision stays as it was planned: the velocity there is fixed.

use apsides_convex::{DescentLimits, PoweredDescent};
use apsides_ocp::Trajectory;
use apsides_radau::Radau;
use apsides_terrain::{ElevationMap, contact};

use super::lander::{Divert, Lander, Motion, Order};
use super::landing::AFTER_FINE_AVOIDANCE;
use super::phases::ADJUSTMENT;
use super::{keys, terrain};
use crate::key::Values;
use crate::missions::{Decisions, Posed};
use crate::site_selection::{SelectionRequest, SiteSelection, select};
use crate::{Error, site_criteria};

/// A map of the landing: when it is seen, and what is wanted on it.
pub(super) struct Stage {
    pub(super) name: &'static str,
    map: fn(&Values) -> Result<ElevationMap, Error>,
    criteria: &'static str,
    hazard_worth: &'static str,
    tilt: &'static str,
    /// Key of the altitude above the site where the divert ends, m.
    end: &'static str,
    /// Upward speed there.
    end_speed: f64,
    /// Propellant of a divert by its length, kg/m.
    divert_cost: f64,
}

/// At the end of the adjustment; a divert takes 8.1 kg for 1000 m.
pub(super) const COARSE: Stage = Stage {
    name: "coarse",
    map: terrain::coarse,
    criteria: keys::COARSE_CRITERIA,
    hazard_worth: keys::COARSE_WORTH,
    tilt: keys::COARSE_TILT,
    end: keys::HOVER_ALTITUDE,
    end_speed: 0.0,
    divert_cost: 0.008,
};

/// At the hover; a divert takes 2.8 kg for 70 m.
pub(super) const FINE: Stage = Stage {
    name: "fine",
    map: terrain::fine,
    criteria: keys::FINE_CRITERIA,
    hazard_worth: keys::FINE_WORTH,
    tilt: keys::FINE_TILT,
    end: keys::FINE_ALTITUDE,
    end_speed: AFTER_FINE_AVOIDANCE,
    divert_cost: 0.03,
};

/// Least distance between candidates, by the least clearance of a site.
const SEPARATION: f64 = 2.0;

/// Decides what the values leave open.
pub(super) fn decide(v: &Values) -> Result<Decisions, Error> {
    let mut values = v.clone();
    let lander = Lander::of_landing(v).map_err(Error::in_mission)?;
    if lander.order == Order::Stages && lander.gate_velocity.is_none() {
        let end = solved(&lander.braking()?, "the main braking alone")?.phases[0].final_state();
        let velocity = match lander.motion {
            Motion::Plane => [end[3], 0.0, end[2]],
            Motion::Space => [end[3], end[4], end[5]],
        };
        put(&mut values, keys::GATE_VELOCITY, velocity);
    }
    let mut sites = Vec::new();
    let open = |key: [&str; 3]| key.iter().any(|k| v.number(k).is_infinite());
    let coarse = v.word(keys::COARSE_MAP) != keys::NO_MAP && open(keys::COARSE_SITE);
    let fine = v.word(keys::FINE_MAP) != keys::NO_MAP && open(keys::FINE_SITE);
    if !coarse && !fine {
        return Ok(Decisions::new(values, sites));
    }
    // The plan without maps, as far as the end of the adjustment.
    let lander = Lander::of_landing(&values).map_err(Error::in_mission)?;
    let plan = solved(&lander.landing()?, "the landing at the site aimed at")?;
    let adjusted = plan.phases.iter().find(|p| p.name == ADJUSTMENT).map(|p| p.final_state());
    let Some(&[_, _, _, upward, _, _, mass]) = adjusted.as_deref() else {
        return Err(Error::in_mission("maps need a flight in space"));
    };
    put(&mut values, [keys::ADJUSTED_SPEED], [upward]);
    let mut mass_at_hover = None;
    if coarse {
        let seen = Seen {
            lander: &lander,
            divert: &lander.coarse_divert,
            radius: lander.coarse_radius,
            upward,
            mass,
        };
        let site = seen.select(v, &COARSE)?;
        put(&mut values, keys::COARSE_SITE, site.site().offset);
        mass_at_hover = Some(mass - site.site().divert.propellant);
        sites.push(site);
    }
    if fine {
        let lander = Lander::of_landing(&values).map_err(Error::in_mission)?;
        let mass = match mass_at_hover {
            Some(mass) => mass,
            None => mass_before_fine(&lander, &plan),
        };
        let mass = lander.descent.engine.mass_after(mass, lander.hover_time * lander.body.surface_gravity());
        let seen = Seen {
            lander: &lander,
            divert: &lander.fine_divert,
            radius: lander.hover_radius,
            upward: 0.0,
            mass,
        };
        let site = seen.select(v, &FINE)?;
        put(&mut values, keys::FINE_SITE, site.site().offset);
        sites.push(site);
    }
    Ok(Decisions::new(values, sites))
}

/// Mass at the end of the coarse avoidance of a plan, kg.
fn mass_before_fine(lander: &Lander, plan: &Trajectory) -> f64 {
    let avoidance = plan.phases.iter().find(|p| p.name == super::phases::AVOIDANCE);
    avoidance.and_then(|p| p.final_state().last().copied()).unwrap_or(lander.dry_mass)
}

fn put<const N: usize>(values: &mut Values, paths: [&'static str; N], numbers: [f64; N]) {
    for (path, number) in paths.into_iter().zip(numbers) {
        *values = values.with_number(path, number);
    }
}

fn solved(posed: &Posed, what: &str) -> Result<Trajectory, Error> {
    let solved = Radau::default().solve(&posed.ocp, &posed.guess)?;
    if solved.status.is_success() {
        return Ok(solved.trajectory);
    }
    Err(Error::in_mission(format!("{what} has no solution: {}", solved.status)))
}

/// The lander above the middle of a map.
struct Seen<'a> {
    lander: &'a Lander,
    /// From here on, without a length yet.
    divert: &'a Divert,
    radius: f64,
    upward: f64,
    mass: f64,
}

impl Seen<'_> {
    /// The descent that is ahead, in axes to the east, to the north and upwards from the ground below.
    fn descent(&self, above_site: f64, end_speed: f64) -> PoweredDescent {
        let Lander { descent, body, .. } = self.lander;
        let [longitude, latitude] = self.divert.from;
        let ground = body.radius + self.lander.coarse_divert.rise;
        let [up, east, north] = descent.gravity.acceleration(self.radius, longitude, latitude);
        let (sin, cos) = latitude.sin_cos();
        let turn = descent.rotation_rate;
        let centrifugal = self.radius * turn * turn * cos;
        PoweredDescent {
            gravity: [east, north - centrifugal * sin, up + centrifugal * cos],
            rotation: [0.0, turn * cos, turn * sin],
            mass: self.mass,
            dry_mass: self.lander.dry_mass,
            exhaust_velocity: descent.engine.exhaust_velocity,
            thrust: [self.lander.least_throttle, 1.0].map(|throttle| throttle * descent.engine.thrust),
            position: [0.0, 0.0, self.radius - ground],
            velocity: [0.0, 0.0, self.upward],
            target: [0.0, 0.0, above_site],
            target_velocity: [0.0, 0.0, end_speed],
            limits: DescentLimits { pointing: Some(self.divert.tilt), ..DescentLimits::default() },
        }
    }

    fn select(&self, v: &Values, stage: &Stage) -> Result<SiteSelection, Error> {
        let criteria = site_criteria::load(v.word(stage.criteria))?;
        let request = SelectionRequest {
            name: stage.name,
            map: (stage.map)(v)?,
            criteria,
            descent: self.descent(v.number(stage.end), stage.end_speed),
            candidates: v.count(keys::CANDIDATES),
            separation: SEPARATION * criteria.clearance_min_m,
            hazard_worth: v.number(stage.hazard_worth),
            divert_cost: stage.divert_cost,
            lander: contact::Lander {
                pad_distance: criteria.footpad_circle_radius_m,
                pad_radius: criteria.footpad_radius_m,
                centre_of_mass_height: v.number(keys::CENTRE_OF_MASS),
                belly: None,
            },
            tilt_key: stage.tilt,
        };
        select(request).map_err(Error::in_mission)
    }
}
