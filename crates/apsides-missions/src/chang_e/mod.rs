//! Landings in the manner of Chang'e-3, from the perilune of an elliptic orbit, with an engine that cannot be shut down below its least
//! thrust (problem A of the Chinese undergraduate contest in mathematical modelling, 2014).

use std::sync::Arc;

use apsides_ocp::Trajectory;
use apsides_pipeline::dispersion::Dispersed;
use apsides_pipeline::method::MethodName;
use apsides_pipeline::mission::EasierCase;
use apsides_pipeline::placing::Whereabouts;
use apsides_pipeline::values::Values;
use apsides_pipeline::{Cancellation, Curve, Decisions, Error, Kind, Mission, Offers, Posed, Scalars};
use apsides_verify::Check;

use crate::data::point_about;
use dispersed::{PlannedBraking, PlannedStages};
use motion::DescentMotion;

mod braking;
mod clearance;
mod decisions;
mod dispersed;
mod divert;
mod flight_state;
mod guess;
mod keys;
mod lander;
mod landing;
mod motion;
mod one_plane;
mod phases;
mod results;
mod site_checks;
mod stages;
mod terrain;

pub use divert::Divert;
pub use lander::{GateDirection, Lander, Motion};
pub use landing::{SixStageLanding, StageOrder};
pub use terrain::{MapSource, SiteMap};

/// Main braking from the perilune of a lunar orbit to a gate above the site with least propellant.
#[derive(Clone, Debug)]
pub struct MainBraking {
    /// The vehicle, its orbit, its site and the gate above it.
    pub lander: Lander,
}

impl Mission for MainBraking {
    fn kind() -> Kind {
        Kind::new::<Self>(
            "chang-e-3-braking",
            "Main braking from the perilune of a lunar orbit to a gate above the site with least propellant",
            &[keys::VEHICLE, keys::MOON, keys::ORBIT, keys::SITE, keys::GATE],
        )
        .offering(Offers {
            dispersed: crate::deviating_flight::COLUMNS,
            ephemeris: true,
            ..Offers::default()
        })
    }

    fn read(values: &Values) -> Result<Self, Error> {
        Ok(Self { lander: Lander::read(values)? })
    }

    fn pose(&self, _method: MethodName) -> Result<Posed, Error> {
        self.lander.braking()
    }

    /// Constant controls, which have local optima with and without least thrust in the first seconds, begin from the collocation of the same
    /// braking too.
    fn approach(&self, method: MethodName) -> Vec<EasierCase> {
        match method {
            MethodName::Piecewise => {
                vec![EasierCase { mission: Arc::new(self.clone()), method: MethodName::Radau }]
            }
            _ => Vec::new(),
        }
    }

    fn results(&self, solution: &Trajectory) -> Scalars {
        results::braking(&self.lander, solution)
    }

    fn datum(&self) -> Option<f64> {
        Some(self.lander.body.radius)
    }

    fn whereabouts(&self) -> Whereabouts {
        point_about(self.lander.body.gravitational_parameter)
    }

    fn motion<'a>(&'a self, solution: &'a Trajectory) -> Option<Box<dyn apsides_ephemeris::Motion + 'a>> {
        Some(Box::new(DescentMotion::of(&self.lander, solution, [None; 2])))
    }

    fn headline(&self) -> Vec<&str> {
        vec!["final_mass_kg", "flight_time_s", "perilune_speed_m_s", "central_angle_deg"]
    }

    fn curves(&self, solution: &Trajectory) -> Vec<Curve> {
        results::braking_curves(&self.lander, solution)
    }

    fn dispersed(&self, plan: &Trajectory) -> Result<Option<Box<dyn Dispersed>>, Error> {
        Ok(Some(Box::new(PlannedBraking::new(&self.lander, plan)?)))
    }
}

impl Mission for SixStageLanding {
    fn kind() -> Kind {
        Kind::new::<Self>(
            "chang-e-3",
            "Landing in six stages from the perilune of a lunar orbit to the cut-off of the engine with least propellant",
            &[
                keys::VEHICLE,
                keys::MOON,
                keys::ORBIT,
                keys::SITE,
                keys::GATE,
                keys::STAGES_BELOW,
                keys::TERRAIN,
                keys::DECIDED,
            ],
        )
        .nothing_at_zero(&[keys::HOVER_TIME, keys::PATH_WEIGHT])
        .offering(Offers { dispersed: &dispersed::COLUMNS, ephemeris: true, ..Offers::default() })
    }

    fn read(values: &Values) -> Result<Self, Error> {
        Self::of(values)
    }

    fn pose(&self, _method: MethodName) -> Result<Posed, Error> {
        self.problem()
    }

    fn results(&self, solution: &Trajectory) -> Scalars {
        results::landing(self, solution)
    }

    fn datum(&self) -> Option<f64> {
        Some(self.lander.body.radius)
    }

    fn whereabouts(&self) -> Whereabouts {
        point_about(self.lander.body.gravitational_parameter)
    }

    fn motion<'a>(&'a self, solution: &'a Trajectory) -> Option<Box<dyn apsides_ephemeris::Motion + 'a>> {
        let diverts = [self.coarse_divert(), self.fine_divert()].map(Some);
        Some(Box::new(DescentMotion::of(&self.lander, solution, diverts)))
    }

    fn headline(&self) -> Vec<&str> {
        vec!["final_mass_kg", "propellant_kg", "flight_time_s", "touchdown_speed_m_s"]
    }

    fn curves(&self, solution: &Trajectory) -> Vec<Curve> {
        results::landing_curves(self, solution)
    }

    fn checks(&self, decisions: &Decisions, solution: &Trajectory) -> Vec<Check> {
        let sites: Vec<_> = decisions.sites.iter().filter_map(|s| s.choice_as()).collect();
        site_checks::of(self, &sites, solution)
    }

    fn approach(&self, method: MethodName) -> Vec<EasierCase> {
        if method != MethodName::Radau {
            return Vec::new();
        }
        let lighter = self.lighter_paths().into_iter();
        lighter.map(|mission| EasierCase { mission: Arc::new(mission), method }).collect()
    }

    fn dispersed(&self, plan: &Trajectory) -> Result<Option<Box<dyn Dispersed>>, Error> {
        Ok(Some(Box::new(PlannedStages::new(self, plan)?)))
    }

    fn decide(&self, cancellation: &Cancellation) -> Result<Decisions, Error> {
        decisions::decide(self, cancellation)
    }
}
