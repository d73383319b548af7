//! The missions that come with the program.

use std::collections::BTreeMap;
use std::sync::Arc;

use apsides_flatness::FlatSystem;
use apsides_ocp::{Bounds, Guess, Ocp, Trajectory};
use apsides_radau::Explanation;
use apsides_shooting::profile::{Independent, Steering};
use apsides_verify::Check;

use crate::key::{Key, Values};
use crate::montecarlo::Dispersed;
use crate::site_selection::SiteSelection;
use crate::{Curve, Error, Mission, method, moving_mass};

mod chang_e;
mod geo;
mod internal_masses;
pub(crate) mod lunar;
pub(crate) mod reentry;

/// A problem with a start.
pub struct Posed {
    /// The problem that a method solves.
    pub ocp: Ocp,
    /// Where a method starts.
    pub guess: Guess,
    /// Costates (of the minimised objective) at start and end of each phase of the guess, if they are known.
    pub costates: Option<Vec<[Vec<f64>; 2]>>,
    /// The flat description of each phase, if all have one.
    pub flat_systems: Option<Vec<FlatSystem>>,
    /// The whole flight, where the problem is a reduction of it.
    pub expansion: Option<Expansion>,
    /// Control profiles that a search can fly, if there are any.
    pub search: Option<ProfileSearch>,
}

impl Posed {
    /// A problem that is the whole flight, with a start.
    #[must_use]
    pub fn new(ocp: Ocp, guess: Guess) -> Self {
        Self { ocp, guess, costates: None, flat_systems: None, expansion: None, search: None }
    }

    /// The whole flight as a problem.
    #[must_use]
    pub fn flight(&self) -> &Ocp {
        self.expansion.as_ref().map_or(&self.ocp, |e| &e.ocp)
    }

    /// The whole flight of a solution.
    ///
    /// # Errors
    /// When the trajectory cannot be continued between its phases, for instance one of a solve that failed.
    pub fn expand(&self, solution: &Trajectory) -> Result<Trajectory, Error> {
        match &self.expansion {
            Some(expansion) => (expansion.expand)(&expansion.ocp, solution),
            None => Ok(solution.clone()),
        }
    }
}

/// Control profiles of a problem of one phase, and how a search flies them.
#[derive(Clone, Debug)]
pub struct ProfileSearch {
    /// The energy that profiles are functions of.
    pub energy: Independent,
    /// Allowed values of each component of a profile.
    pub bounds: Vec<Bounds>,
    /// From the components to the controls.
    pub steering: Steering,
    /// The state that ends a flight where it reaches its end value.
    pub stop: &'static str,
    /// Distance (km) that one unit of each state missed at the end stands for.
    pub km_per_unit: Vec<f64>,
}

impl ProfileSearch {
    /// Distance (km) from where a flight should end, from what each state misses.
    #[must_use]
    pub fn miss_km(&self, misses: &[f64]) -> f64 {
        misses.iter().zip(&self.km_per_unit).map(|(miss, km)| (miss * km).powi(2)).sum::<f64>().sqrt()
    }
}

/// The trajectory of a whole flight from the solution of its reduction.
pub(crate) type Expand = dyn Fn(&Ocp, &Trajectory) -> Result<Trajectory, Error> + Send + Sync;

/// A whole flight whose optimum follows from that of a smaller problem.
#[derive(Clone)]
pub struct Expansion {
    /// The whole flight as a problem.
    pub ocp: Ocp,
    pub(crate) expand: Arc<Expand>,
}

/// What a mission decides on the way: sites on maps, the end of a stage that is optimised for itself.
#[derive(Clone, Debug)]
pub struct Decisions {
    /// All values, with those that were decided.
    pub(crate) values: Values,
    /// Sites, in the order of the flight.
    pub sites: Arc<[SiteSelection]>,
}

impl Default for Decisions {
    /// None, of a mission without values.
    fn default() -> Self {
        Self::new(Values(BTreeMap::new()), Vec::new())
    }
}

impl Decisions {
    pub(crate) fn new(values: Values, sites: Vec<SiteSelection>) -> Self {
        Self { values, sites: sites.into() }
    }
}

/// Decides what is open in the values of a mission.
pub(crate) type Decide = fn(&Values) -> Result<Decisions, Error>;

/// Scalars by name; the unit ends the key.
pub(crate) type Scalars = BTreeMap<String, f64>;

/// A kind of mission: its keys, and what is made of them.
pub(crate) struct Kind {
    pub(crate) name: &'static str,
    pub(crate) title: &'static str,
    /// Keys of the vehicle and the flight.
    pub(crate) flight_keys: &'static [&'static [Key]],
    /// Values that do not go together, in words.
    pub(crate) check: fn(&Values) -> Result<(), String>,
    /// What is made of the values.
    pub(crate) flown: Flown,
}

/// What is made of the values of a mission.
pub(crate) enum Flown {
    /// A problem that a method solves.
    Optimised(Optimised),
    /// A flight under a law.
    Simulated(Simulated),
}

/// How the values of a mission make a problem, and what its results are.
pub(crate) struct Optimised {
    /// Numbers that change the problem where they leave zero, so that they have no price there.
    pub(crate) nothing_at_zero: &'static [&'static str],
    pub(crate) pose: fn(&Values) -> Result<Posed, Error>,
    /// Easier cases with the same phases that lead to this one, each the start of the next.
    pub(crate) approach: fn(&Values) -> Vec<Values>,
    /// Scalars for the summary; the unit ends the key.
    pub(crate) results: fn(&Values, &Trajectory) -> Scalars,
    /// Results that name a case in a table.
    pub(crate) headline: &'static [&'static str],
    /// Figures besides the standard ones.
    pub(crate) curves: fn(&Values, &Trajectory) -> Vec<Curve>,
    /// Checks of the certificate besides those that every problem has.
    pub(crate) checks: fn(&Values, &Trajectory) -> Vec<Check>,
    /// A sentence on what is missing, besides the requirements that conflict.
    pub(crate) missing: fn(&Mission, &Explanation) -> Option<String>,
    /// What is decided before the flight is posed, where something is.
    pub(crate) decide: Option<Decide>,
    /// Checks of the certificate against the maps that sites were chosen on.
    pub(crate) site_checks: fn(&Values, &[SiteSelection], &Trajectory) -> Vec<Check>,
    /// Scalars that take solves of their own, of a mission that is solved.
    pub(crate) margins: fn(&Mission, &Trajectory) -> Result<Scalars, Error>,
    /// How its ends over ground are sought and read, where they are free to choose.
    pub(crate) reach: Option<Reach>,
    /// Flights that deviate from a solved one.
    pub(crate) deviating: Option<Deviating>,
    /// Flies the solution with what the problem leaves out.
    pub(crate) simulate: Option<Simulate>,
}

/// Solves a mission and flies the solution.
pub(crate) type Simulate = fn(&Mission) -> Result<crate::simulation::Simulated, Error>;

/// How the values of a mission are simulated.
pub(crate) struct Simulated {
    /// The case of the values, with a seed of what is random.
    pub(crate) case: fn(&Values, u64) -> Result<moving_mass::Case, Error>,
}

/// How flights deviate from a solved one.
pub(crate) struct Deviating {
    /// Names of the results of a flight, the unit at the end; `up_m`, `along_m`, `across_m` are among them.
    pub(crate) columns: &'static [&'static str],
    /// The flights.
    pub(crate) flights: fn(&Values, &Trajectory) -> DispersedFlights,
}

pub(crate) type DispersedFlights = Result<Box<dyn Dispersed>, Error>;

/// How far the flights of a kind of mission reach over ground; results are `flight_time_s`, `downrange_km` and `crossrange_km`.
/// Places are longitude and latitude in deg.
pub(crate) struct Reach {
    /// The mission whose optimum ends farthest past a place along a bearing.
    pub(crate) past: fn(&Values, &Past) -> Values,
    /// Start, target and size of the ground that the flights are over.
    pub(crate) ground: fn(&Values) -> Result<Ground, String>,
    /// Places under a flight, the end last.
    pub(crate) track: fn(&Trajectory) -> Vec<[f64; 2]>,
}

/// A place and a bearing along which a flight is to end far away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Past {
    /// The place, deg.
    pub(crate) place: [f64; 2],
    /// The bearing, deg from north towards east.
    pub(crate) bearing: f64,
    /// Farthest from the line through the place along the bearing, km.
    pub(crate) half_width: f64,
}

/// The ground under a mission. Places are longitude and latitude in deg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ground {
    /// Under the start.
    pub(crate) start: [f64; 2],
    /// Under the target.
    pub(crate) target: [f64; 2],
    /// Radius of the planet, km.
    pub(crate) radius: f64,
    /// Altitude of the ends, km.
    pub(crate) altitude: f64,
}

/// Of a mission without margins.
pub(crate) fn no_margins(_: &Mission, _: &Trajectory) -> Result<Scalars, Error> {
    Ok(Scalars::new())
}

impl std::fmt::Debug for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

impl PartialEq for Kind {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Kind {
    pub(crate) fn keys(&self) -> impl Iterator<Item = &'static Key> + use<> {
        let of_method = self.as_optimised().is_some().then(method::keys);
        self.flight_keys.iter().copied().flatten().chain(of_method.into_iter().flatten())
    }

    /// What is optimised, if something is.
    pub(crate) fn as_optimised(&self) -> Option<&Optimised> {
        match &self.flown {
            Flown::Optimised(optimised) => Some(optimised),
            Flown::Simulated(_) => None,
        }
    }

    /// What is optimised.
    ///
    /// # Errors
    /// Of a mission that is simulated.
    pub(crate) fn optimised(&self) -> Result<&Optimised, Error> {
        self.as_optimised().ok_or_else(|| {
            self.refused("it is simulated under its law, not optimised: use `apsides simulate`")
        })
    }

    /// What is simulated.
    ///
    /// # Errors
    /// Of a mission that is optimised.
    pub(crate) fn simulated(&self) -> Result<&Simulated, Error> {
        match &self.flown {
            Flown::Simulated(simulated) => Ok(simulated),
            Flown::Optimised(_) => Err(self.refused("it is optimised, not simulated: use `apsides solve`")),
        }
    }

    fn refused(&self, reason: &str) -> Error {
        Error::Conflict { place: format!("mission `{}`", self.name), reason: reason.into() }
    }
}

const KINDS: &[Kind] = &[
    lunar::DIRECT,
    lunar::PERILUNE,
    lunar::TWO_PHASE,
    lunar::TRANSFER,
    geo::INJECTION,
    reentry::REENTRY,
    chang_e::BRAKING,
    chang_e::LANDING,
    internal_masses::CROSS,
    internal_masses::RADIAL,
];

/// Files by their names; one that is not named like its kind says what is special about it.
const FILES: &[(&str, &str)] = &[
    ("lunar-direct", include_str!("../../missions/lunar-direct.toml")),
    ("lunar-perilune", include_str!("../../missions/lunar-perilune.toml")),
    ("lunar-two-phase", include_str!("../../missions/lunar-two-phase.toml")),
    ("lunar-transfer", include_str!("../../missions/lunar-transfer.toml")),
    ("lunar-coast", include_str!("../../missions/lunar-coast.toml")),
    ("lunar-throttled", include_str!("../../missions/lunar-throttled.toml")),
    ("lunar-vertical", include_str!("../../missions/lunar-vertical.toml")),
    ("geo-1-burn", include_str!("../../missions/geo-1-burn.toml")),
    ("geo-2-burn", include_str!("../../missions/geo-2-burn.toml")),
    ("geo-3-burn", include_str!("../../missions/geo-3-burn.toml")),
    ("geo-4-burn", include_str!("../../missions/geo-4-burn.toml")),
    ("geo-5-burn", include_str!("../../missions/geo-5-burn.toml")),
    ("geo-6-burn", include_str!("../../missions/geo-6-burn.toml")),
    ("geo-7-burn", include_str!("../../missions/geo-7-burn.toml")),
    ("geo-8-burn", include_str!("../../missions/geo-8-burn.toml")),
    ("chang-e-3", include_str!("../../missions/chang-e-3.toml")),
    ("chang-e-3-flat", include_str!("../../missions/chang-e-3-flat.toml")),
    ("chang-e-3-braking", include_str!("../../missions/chang-e-3-braking.toml")),
    ("capsule-reentry", include_str!("../../missions/capsule-reentry.toml")),
    ("capsule-reentry-steered", include_str!("../../missions/capsule-reentry-steered.toml")),
    ("capsule-reentry-us76", include_str!("../../missions/capsule-reentry-us76.toml")),
    ("moving-mass-cross", include_str!("../../missions/moving-mass-cross.toml")),
    ("moving-mass-radial", include_str!("../../missions/moving-mass-radial.toml")),
];

pub(crate) fn kind(name: &str) -> Option<&'static Kind> {
    KINDS.iter().find(|k| k.name == name)
}

/// The kinds of mission that have a footprint.
pub(crate) fn with_reach() -> String {
    let has = |k: &&Kind| k.as_optimised().is_some_and(|o| o.reach.is_some());
    let names = KINDS.iter().filter(has).map(|k| format!("`{}`", k.name));
    names.collect::<Vec<_>>().join(", ")
}

/// The kinds of mission whose flights may deviate.
pub(crate) fn with_dispersion() -> String {
    let has = |k: &&Kind| k.as_optimised().is_some_and(|o| o.deviating.is_some());
    let names = KINDS.iter().filter(has).map(|k| format!("`{}`", k.name));
    names.collect::<Vec<_>>().join(", ")
}

pub(crate) fn file(name: &str) -> Option<&'static str> {
    FILES.iter().find(|f| f.0 == name).map(|f| f.1)
}

pub(crate) fn names() -> String {
    KINDS.iter().map(|k| format!("`{}`", k.name)).collect::<Vec<_>>().join(", ")
}

/// Name and title of every mission file; the title is its first line.
pub fn list() -> impl Iterator<Item = (&'static str, &'static str)> {
    FILES
        .iter()
        .map(|(name, text)| (*name, text.lines().next().map_or("", |line| line.trim_start_matches("# "))))
}
