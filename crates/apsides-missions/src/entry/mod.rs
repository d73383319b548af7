//! Re-entry of a capsule to a target with least heat load under limits on dynamic pressure, acceleration and heat rate, steered by the
//! bank angle, from that of A. Alami Naeini and J. Roshanian (Modares Mechanical Engineering 14(13), 2014) on.
//!
//! ```text
//! min  integral of the heat rate,    dynamic pressure, acceleration, heat rate <= limits,    end at the target
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | `capsule` | [`CapsuleEntry`]: planet, vehicle, start, target, limits, goal |
//! | `reading`, `keys`, `atmosphere_table` | the capsule from a mission file |
//! | `load`, `steering` | the loads of a flight; the bank angle as a control |
//! | `problem`, `guess`, `search` | the optimal control problem and its starts |
//! | `expansion` | the bank angle from its cosine and sine |
//! | `motion` | positions, velocities and loads, for ephemerides |
//! | `results`, `margins` | what a flight amounts to; the limits of its reach |
//! | `reach` | ends over ground, for footprints |
//! | `steered` | the flight in six degrees of freedom, its lift pointed by moving masses |

use std::sync::Arc;

use apsides_ephemeris::{Epoch, Motion};
use apsides_ocp::Trajectory;
use apsides_pipeline::method::{MethodName, Methods};
use apsides_pipeline::mission::{EasierCase, Reach};
use apsides_pipeline::placing::Whereabouts;
use apsides_pipeline::simulation::Watch;
use apsides_pipeline::values::Values;
use apsides_pipeline::{
    Cancellation, Curve, Error, Expansion, Kind, Mission, Offers, Outcome, Posed, Scalars, Simulated,
};
use apsides_radau::Explanation;

use crate::data::point_about;
mod atmosphere_table;
mod capsule;
mod expansion;
mod guess;
mod keys;
mod load;
mod margins;
mod motion;
mod problem;
mod reach;
mod reading;
mod results;
#[cfg(feature = "two-layer")]
mod search;
mod steered;
mod steering;

use motion::EntryMotion;

pub use capsule::{CapsuleEntry, Goal, SteeredMasses, TrimmedShape};
pub use load::Load;
pub use steering::Steering;

impl Mission for CapsuleEntry {
    fn kind() -> Kind {
        let title = "Re-entry of a capsule to a target with least heat load under limits on its loads";
        Kind::new::<Self>("capsule-reentry", title, keys::ALL).offering(Offers {
            simulation: true,
            footprint: true,
            ephemeris: true,
            ..Offers::default()
        })
    }

    fn read(values: &Values) -> Result<Self, Error> {
        Self::of(values)
    }

    fn pose(&self, method: MethodName) -> Result<Posed, Error> {
        // The Hamiltonian of indirect shooting has the angle as its control.
        let steering = if method == MethodName::Indirect { Steering::Angle } else { self.steering };
        let ocp = self.problem(steering)?;
        let guess = self.straight_lines(&ocp, steering)?;
        let posed = Posed::new(ocp, guess);
        #[cfg(feature = "two-layer")]
        let posed = Posed { profile: self.profiles(), ..posed };
        if steering == Steering::Angle || self.goal == Goal::LeastLift {
            return Ok(posed);
        }
        let whole = self.problem(Steering::Angle)?;
        let expansion = Some(Expansion {
            ocp: whole,
            expand: Arc::new(|ocp, solution| Ok(expansion::expand(ocp, solution))),
            reduce: Arc::new(|_, flight| Ok(expansion::reduce(flight))),
        });
        Ok(Posed { expansion, ..posed })
    }

    fn results(&self, solution: &Trajectory) -> Scalars {
        results::results(self, solution)
    }

    fn headline(&self) -> Vec<&str> {
        vec![
            "heat_load_mj_m2",
            "flight_time_s",
            "peak_dynamic_pressure_kpa",
            "peak_load_m_s2",
            "peak_heat_rate_kw_m2",
        ]
    }

    fn curves(&self, solution: &Trajectory) -> Vec<Curve> {
        results::curves(self, solution)
    }

    fn start_epoch(&self) -> Option<Epoch> {
        self.epoch
    }

    fn whereabouts(&self) -> Whereabouts {
        point_about(self.flight.planet.body.gravitational_parameter)
    }

    fn motion<'a>(&'a self, _solution: &'a Trajectory) -> Option<Box<dyn Motion + 'a>> {
        Some(Box::new(EntryMotion::of(self)))
    }

    /// Indirect shooting, whose control is the bank angle itself, begins from the collocation of the bank vector.
    fn approach(&self, method: MethodName) -> Vec<EasierCase> {
        if method == MethodName::Indirect && self.steering == Steering::Vector {
            vec![EasierCase { mission: Arc::new(self.clone()), method: MethodName::Radau }]
        } else {
            Vec::new()
        }
    }

    fn missing(
        &self,
        methods: &Methods,
        _explanation: &Explanation,
        cancellation: &Cancellation,
    ) -> Option<String> {
        self.shortfall(methods, cancellation)
    }

    fn margins(
        &self,
        methods: &Methods,
        _solution: &Trajectory,
        cancellation: &Cancellation,
    ) -> Result<Scalars, Error> {
        self.lift_margins(methods, cancellation)
    }

    fn reach(&self) -> Option<&dyn Reach> {
        Some(self)
    }

    fn check_simulation(&self) -> Result<(), Error> {
        self.steered_entry()?.ready(None).map(|_| ())
    }

    fn simulate(&self, _seed: u64, plan: Option<&Outcome>, watch: &Watch<'_>) -> Result<Simulated, Error> {
        match plan {
            Some(plan) => self.fly_steered(plan, watch),
            None => Err(Error::in_mission(
                "the flight in six degrees of freedom follows a solution of the mission",
            )),
        }
    }
}
