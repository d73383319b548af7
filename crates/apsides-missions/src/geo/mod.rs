//! Injection of a restartable upper stage from a circular or elliptic parking orbit into geostationary orbit with one to eight burns, from that of
//! Alavipour, Nikkhah and Roshanian (Modares Mechanical Engineering 18(1)) on.
//!
//! All ignitions, burn times, thrust directions and coasts are free; the final mass is largest. Without oblateness the burns alone are
//! solved, since a coast changes nothing but the true longitude, and the whole flight follows from them.

use std::sync::Arc;

use apsides_dynamics::equinoctial::MASS;
use apsides_ephemeris::Motion;
use apsides_ocp::{Ocp, Trajectory};
use apsides_pipeline::method::{MethodName, Methods};
use apsides_pipeline::mission::EasierCase;
use apsides_pipeline::placing::Whereabouts;
use apsides_pipeline::values::Values;
use apsides_pipeline::{
    Cancellation, Curve, Decisions, Error, Expansion, Kind, Mission, Offers, Posed, Scalars,
};
use apsides_radau::{Explanation, Requirement, RequirementKind};
use apsides_verify::Check;

use crate::data::point_about;
use guess::ImpulsiveGuess;
use motion::InjectionMotion;

mod checks;
mod coast;
mod expansion;
mod guess;
mod injection;
mod keys;
mod motion;
mod phases;
mod results;
mod thrust;

pub use injection::{BurnSteering, GeoInjection};

/// Part by which a limit on the flight time is lowered at once: shorter flights have local optima beside the one that follows from
/// longer ones.
const LIMIT_STEP: f64 = 0.04;
/// First limit, relative to the time of the guess: it does not limit.
const FIRST_LIMIT: f64 = 1.2;

/// A burn is one smooth arc: one interval of some points, from which refinement goes on, begins closest to it.
const FIRST_MESH: [(&str, u32); 4] =
    [("radau.intervals", 1), ("radau.points", 6), ("shooting.intervals", 1), ("shooting.points", 8)];

impl Mission for GeoInjection {
    fn kind() -> Kind {
        Kind::new::<Self>(
            "geo-injection",
            "Injection from a parking orbit into geostationary orbit with several burns and least propellant",
            &[keys::STAGE, keys::FLIGHT],
        )
        .nothing_at_zero(&["inclination_deg", "target_eccentricity", "parking_eccentricity"])
        .with_counts(&FIRST_MESH)
        .offering(Offers { ephemeris: true, ..Offers::default() })
    }

    fn read(values: &Values) -> Result<Self, Error> {
        Self::from_values(values)
    }

    fn pose(&self, _method: MethodName) -> Result<Posed, Error> {
        self.check(&|reason| Error::in_mission(reason))?;
        let (start, models) = (ImpulsiveGuess::of(self)?, self.models());
        if self.has_coast_phases() {
            let ocp = self.whole(&models)?;
            let guess = start.whole(&ocp)?;
            return Ok(Posed::new(ocp, guess));
        }
        let (ocp, whole) = (self.reduced(&models)?, self.whole(&models)?);
        let guess = start.reduced(&ocp)?;
        let costates = Some(start.costates());
        let (injection, reduced) = (self.clone(), ocp.clone());
        let expand = move |whole: &Ocp, solution: &Trajectory| {
            expansion::expand(&injection, &reduced, whole, solution)
        };
        let reduce = |ocp: &Ocp, flight: &Trajectory| expansion::reduce(ocp, flight);
        let expansion = Some(Expansion { ocp: whole, expand: Arc::new(expand), reduce: Arc::new(reduce) });
        Ok(Posed { costates, expansion, ..Posed::new(ocp, guess) })
    }

    fn results(&self, solution: &Trajectory) -> Scalars {
        results::results(self, solution)
    }

    fn headline(&self) -> Vec<&str> {
        vec!["propellant_kg", "burn_time_s", "flight_time_h", "losses_m_s"]
    }

    fn curves(&self, solution: &Trajectory) -> Vec<Curve> {
        results::curves(self, solution)
    }

    fn whereabouts(&self) -> Whereabouts {
        point_about(self.flight.body.gravitational_parameter)
    }

    fn motion<'a>(&'a self, solution: &'a Trajectory) -> Option<Box<dyn Motion + 'a>> {
        Some(Box::new(InjectionMotion { injection: self, solution }))
    }

    fn checks(&self, _decisions: &Decisions, solution: &Trajectory) -> Vec<Check> {
        checks::checks(self, solution)
    }

    /// A limited flight time comes from longer ones.
    fn approach(&self, method: MethodName) -> Vec<EasierCase> {
        let Some(limit) = self.flight_time_limit.filter(|_| self.burns() > 1) else { return Vec::new() };
        let Ok(start) = ImpulsiveGuess::of(self) else { return Vec::new() };
        let first = FIRST_LIMIT * start.flight_time();
        let limits = std::iter::successors(Some(first), |longer| Some(longer * (1.0 - LIMIT_STEP)));
        let case = |longer| EasierCase {
            mission: Arc::new(Self { flight_time_limit: Some(longer), ..self.clone() }),
            method,
        };
        limits.take_while(|longer| *longer > limit).map(case).collect()
    }

    /// Propellant that no flight with these burns does without, in kg and m/s.
    fn missing(
        &self,
        _methods: &Methods,
        explanation: &Explanation,
        _cancellation: &Cancellation,
    ) -> Option<String> {
        let dry = self.dry_mass();
        let is_mass = |r: &Requirement| {
            r.name == MASS.name && matches!(r.kind, RequirementKind::State | RequirementKind::FinalState)
        };
        let alone = explanation.remedies.iter().find(|r| is_mass(&r.requirement)).map(|r| r.to);
        let together = || {
            let conflict = explanation.conflicts.iter().find(|c| is_mass(&c.requirement))?;
            Some(conflict.requirement.relaxed(conflict.amount))
        };
        let left = alone.or_else(together).filter(|left| (0.0..dry).contains(left))?;
        let short = self.engine().velocity_change(dry, left);
        Some(format!("{:.1} kg of propellant are missing, {short:.1} m/s", dry - left))
    }
}
