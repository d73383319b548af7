//! Missions: what a kind of mission reads from its file, and what is made of it.
//!
//! ```text
//! file -> Values -> Mission (a struct in SI units) -> problem and start, results, curves, checks
//! ```

use std::any::Any;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::sync::Arc;

use apsides_ephemeris::{About, Epoch, Motion};
use apsides_ocp::Trajectory;
use apsides_ocp::not_finite::NamedFormula;
use apsides_radau::Explanation;
use apsides_verify::Check;

use crate::Error;
use crate::cancellation::Cancellation;
use crate::dispersion::Dispersed;
use crate::file::written;
use crate::key::{Key, KeyKind};
use crate::method::{MethodName, Methods};
use crate::outcome::{Curve, Decisions, Outcome};
use crate::placing::{self, Whereabouts};
use crate::posed::Posed;
use crate::simulation::{Simulated, Watch};
use crate::values::Values;

/// Scalars by name; the unit ends the key.
pub type Scalars = BTreeMap<String, f64>;

/// The function that makes a mission of values.
type Reads = dyn Fn(&Values) -> Result<Arc<dyn Mission>, Error> + Send + Sync;

/// The text of a file with values.
type Writes = dyn Fn(&Values) -> String + Send + Sync;

/// A kind of mission: its name, its keys, and how values of these keys become a mission.
#[derive(Clone)]
pub struct Kind {
    /// Name, as in the first key of a mission file: `lunar-perilune`.
    pub name: Cow<'static, str>,
    /// The purpose of the mission, in one line.
    pub title: Cow<'static, str>,
    /// Keys of the vehicle and the flight.
    pub keys: Arc<[Key]>,
    /// Numbers that change the problem where they leave zero, so that they have no price there.
    pub nothing_at_zero: &'static [&'static str],
    /// Whole numbers of methods, such as those of a first mesh, that are others by default in missions of this kind.
    pub counts: &'static [(&'static str, u32)],
    /// Flights besides the solve that a mission of this kind offers.
    pub offers: Offers,
    reads: Arc<Reads>,
    writes: Option<Arc<Writes>>,
}

/// The flights that missions of a kind offer besides a solve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Offers {
    /// They are flown under a law of their own and not optimised.
    pub simulated_only: bool,
    /// Their solution can be flown with what the problem leaves out.
    pub simulation: bool,
    /// The ends over ground that they can reach make a footprint.
    pub footprint: bool,
    /// Their flights have a place about a body, from which ephemerides are made: they have keys of epoch and axes.
    pub ephemeris: bool,
    /// Names of the results of flights that deviate from a solved or a simulated one, the unit at the end; empty where there is no Monte
    /// Carlo.
    pub dispersed: &'static [&'static str],
}

impl Kind {
    /// A kind whose missions are optimised.
    #[must_use]
    pub fn new<M: Mission>(name: &'static str, title: &'static str, keys: &'static [&'static [Key]]) -> Self {
        Self {
            name: name.into(),
            title: title.into(),
            keys: keys.concat().into(),
            nothing_at_zero: &[],
            counts: &[],
            offers: Offers::default(),
            reads: Arc::new(|v| Ok(Arc::new(M::read(v)?))),
            writes: None,
        }
    }

    /// The kind of one file, which says itself which keys it has. `reads` makes the mission of values of these keys, `writes` the text of
    /// the file with values.
    pub fn of_file(
        name: String,
        title: String,
        keys: Vec<Key>,
        reads: impl Fn(&Values) -> Result<Arc<dyn Mission>, Error> + Send + Sync + 'static,
        writes: impl Fn(&Values) -> String + Send + Sync + 'static,
    ) -> Self {
        Self {
            name: name.into(),
            title: title.into(),
            keys: keys.into(),
            nothing_at_zero: &[],
            counts: &[],
            offers: Offers::default(),
            reads: Arc::new(reads),
            writes: Some(Arc::new(writes)),
        }
    }

    /// Returns true if it is the kind of one file, which says itself which keys it has.
    #[must_use]
    pub fn is_of_file(&self) -> bool {
        self.writes.is_some()
    }

    /// The same with what its missions offer.
    #[must_use]
    pub fn offering(self, offers: Offers) -> Self {
        Self { offers, ..self }
    }

    /// The same with numbers that have no price at zero.
    #[must_use]
    pub fn nothing_at_zero(self, nothing_at_zero: &'static [&'static str]) -> Self {
        Self { nothing_at_zero, ..self }
    }

    /// The same with other defaults of whole numbers of methods, each with its path.
    #[must_use]
    pub fn with_counts(self, counts: &'static [(&'static str, u32)]) -> Self {
        Self { counts, ..self }
    }

    /// The mission file with every value written out.
    #[must_use]
    pub fn written(&self, values: &Values) -> String {
        match &self.writes {
            Some(writes) => writes(values),
            None => written(&self.title, &self.name, values),
        }
    }

    /// The mission of values.
    ///
    /// # Errors
    /// Values that do not go together, and what no flight can mend, in words that name the keys.
    pub fn read(&self, values: &Values) -> Result<Arc<dyn Mission>, Error> {
        (self.reads)(values)
    }

    /// The numbers of vehicle and flight that have a price at these values: not a limit that is infinite or open, nor a zero that leaves
    /// something out of the problem.
    pub fn priced_keys<'a>(&'a self, values: &'a Values) -> impl Iterator<Item = &'a Key> {
        let has_price = move |k: &&Key| {
            let value = k.is_number().then(|| values.limit(&k.path).ok().flatten()).flatten();
            value.is_some_and(|v| v != 0.0 || !self.nothing_at_zero.contains(&&*k.path))
        };
        self.keys.iter().filter(has_price)
    }

    /// All keys: those of vehicle and flight, and those of the methods where something is optimised.
    #[must_use]
    pub fn all_keys(&self) -> Arc<[Key]> {
        let of_methods = (!self.offers.simulated_only).then(Methods::keys);
        let of_ephemeris = self.offers.ephemeris.then_some(placing::KEYS);
        let further = of_ephemeris.into_iter().flatten().chain(of_methods.into_iter().flatten());
        self.keys.iter().cloned().chain(further.cloned()).map(|key| self.with_default(key)).collect()
    }

    /// The key with the default that it has in missions of this kind.
    fn with_default(&self, key: Key) -> Key {
        let own = self.counts.iter().find(|(path, _)| *path == key.path);
        match (key.kind, own) {
            (KeyKind::Count(_, least, most), Some(&(_, count))) => {
                Key { kind: KeyKind::Count(count, least, most), ..key }
            }
            _ => key,
        }
    }

    /// A request that missions of this kind do not take, in words.
    #[must_use]
    pub fn refused(&self, reason: &str) -> Error {
        Error::Conflict { place: format!("mission `{}`", self.name), reason: reason.into() }
    }
}

impl Debug for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.name)
    }
}

impl PartialEq for Kind {
    fn eq(&self, other: &Self) -> bool {
        // The default of a number of a file is what the file states: values are compared by themselves.
        let paths = |kind: &Self| kind.keys.iter().map(|k| k.path.clone()).collect::<Vec<_>>();
        self.name == other.name && self.title == other.title && paths(self) == paths(other)
    }
}

/// A mission in SI units, read once from the values of its keys.
///
/// A kind of mission is a struct that implements this trait; a [`Registry`](crate::Registry) that it is added to reads it from files. Only
/// [`kind`](Self::kind), [`read`](Self::read), [`pose`](Self::pose) and [`results`](Self::results) are needed for missions that are
/// optimised; the rest says what else there is to a mission.
pub trait Mission: Any + Debug + Send + Sync {
    /// Name, title and keys.
    fn kind() -> Kind
    where
        Self: Sized;

    /// The mission of values.
    ///
    /// # Errors
    /// Values that do not go together, and what no flight can mend: [`Values::conflict`], in words that name the keys and say what to
    /// change.
    fn read(values: &Values) -> Result<Self, Error>
    where
        Self: Sized;

    /// The problem and a start, for a method.
    ///
    /// # Errors
    /// When the mission does not make a problem.
    fn pose(&self, _method: MethodName) -> Result<Posed, Error> {
        Err(Error::in_mission("it is simulated under its law, not optimised: use `apsides simulate`"))
    }

    /// Scalars of a solution for the summary; the unit ends the key.
    fn results(&self, _solution: &Trajectory) -> Scalars {
        Scalars::new()
    }

    /// Keys of the results that name a case in a table, in order.
    fn headline(&self) -> Vec<&str> {
        Vec::new()
    }

    /// Figures besides the standard ones.
    fn curves(&self, _solution: &Trajectory) -> Vec<Curve> {
        Vec::new()
    }

    /// Checks of the certificate besides those that every problem has, against the maps that sites were chosen on among others.
    fn checks(&self, _decisions: &Decisions, _solution: &Trajectory) -> Vec<Check> {
        Vec::new()
    }

    /// Decides what the values leave open before the flight is posed: a site on a map, the end of a stage that is optimised for itself.
    ///
    /// # Errors
    /// When the values do not make a problem, no site is fit, or the work is cancelled; the sentence names what comes nearest.
    fn decide(&self, _cancellation: &Cancellation) -> Result<Decisions, Error> {
        Ok(Decisions::default())
    }

    /// Easier cases with the same phases that lead to this one, each the start of the next.
    fn approach(&self, _method: MethodName) -> Vec<EasierCase> {
        Vec::new()
    }

    /// The distance from the centre of the body that altitudes count from, m, where distances of the problem are to be said as altitudes.
    fn datum(&self) -> Option<f64> {
        None
    }

    /// A sentence on what is missing, besides the requirements that conflict; what takes a solve ends when it is cancelled.
    fn missing(
        &self,
        _methods: &Methods,
        _explanation: &Explanation,
        _cancellation: &Cancellation,
    ) -> Option<String> {
        None
    }

    /// The place at which a formula is stated, and its text, where the mission has them from a file.
    fn place_of(&self, _formula: &NamedFormula) -> Option<String> {
        None
    }

    /// A sentence on why a trajectory that is not accurate enough stays so: what is the matter with the mission, and what would mend it.
    fn undetermined(&self, _solution: &Trajectory) -> Option<String> {
        None
    }

    /// Scalars that take solves of their own, of a mission that is solved; without those whose solves are cancelled.
    ///
    /// # Errors
    /// When one of these problems is refused.
    fn margins(
        &self,
        _methods: &Methods,
        _solution: &Trajectory,
        _cancellation: &Cancellation,
    ) -> Result<Scalars, Error> {
        Ok(Scalars::new())
    }

    /// The search and the reading of its ends over ground; for kinds that offer a footprint.
    fn reach(&self) -> Option<&dyn Reach> {
        None
    }

    /// The place that flights of the mission have about a body.
    fn whereabouts(&self) -> Whereabouts {
        Whereabouts::Nowhere
    }

    /// The epoch of the start where a message of the mission states it.
    fn start_epoch(&self) -> Option<Epoch> {
        None
    }

    /// The motion about a body of a solution; none of missions that have no place.
    fn motion<'a>(&'a self, _solution: &'a Trajectory) -> Option<Box<dyn Motion + 'a>> {
        None
    }

    /// The body that the records of simulated flights are about, in axes fixed to it, and the mass of the vehicle, kg; none of missions
    /// whose records have no place.
    fn record_about(&self) -> Option<(About, f64)> {
        None
    }

    /// Flights that deviate from a solved one; for kinds that offer a Monte Carlo.
    ///
    /// # Errors
    /// A plan that cannot be flown.
    fn dispersed(&self, _plan: &Trajectory) -> Result<Option<Box<dyn Dispersed>>, Error> {
        Ok(None)
    }

    /// Refuses a mission whose flight cannot be simulated, before the solve that the flight follows.
    ///
    /// # Errors
    /// A mission that cannot be flown.
    fn check_simulation(&self) -> Result<(), Error> {
        Ok(())
    }

    /// Flies the mission under its law with a seed of everything random, along the solution `plan` where one is optimised; for kinds that
    /// offer a simulation. A flight that `watch` ends has the status [`INTERRUPTED`](crate::simulation::INTERRUPTED).
    ///
    /// # Errors
    /// A mission that cannot be flown. A flight that fails is not an error: see
    /// [`SimulationSummary::status`](crate::simulation::SimulationSummary::status).
    fn simulate(&self, _seed: u64, _plan: Option<&Outcome>, _watch: &Watch<'_>) -> Result<Simulated, Error> {
        Err(Error::in_mission("it is optimised, not simulated: use `apsides solve`"))
    }
}

/// A mission as the struct of its kind, where it is of that kind.
#[must_use]
pub fn downcast<M: Mission>(mission: &dyn Mission) -> Option<&M> {
    (mission as &dyn Any).downcast_ref()
}

/// A case that is easier to solve than the one it leads to.
pub struct EasierCase {
    /// The mission.
    pub mission: Arc<dyn Mission>,
    /// The method that solves it.
    pub method: MethodName,
}

/// The ends over ground that the flights of a mission reach; their results are `flight_time_s`, `downrange_km` and `crossrange_km`. Places are
/// longitude and latitude in deg.
pub trait Reach {
    /// The mission whose optimum ends farthest past a place along a bearing.
    fn past(&self, past: &Past) -> Arc<dyn Mission>;
    /// Start, target and size of the ground that the flights are over.
    fn ground(&self) -> Ground;
    /// Places under a flight, the end last.
    fn track(&self, flight: &Trajectory) -> Vec<[f64; 2]>;
}

/// A place and a bearing along which a flight is to end far away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Past {
    /// The place, deg.
    pub place: [f64; 2],
    /// The bearing, deg from north towards east.
    pub bearing: f64,
    /// Largest distance from the line through the place along the bearing, km; none where it is free.
    pub half_width: Option<f64>,
}

/// The ground under a mission. Places are longitude and latitude in deg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// Place under the start.
    pub start: [f64; 2],
    /// Place under the target.
    pub target: [f64; 2],
    /// Radius of the planet, km.
    pub radius: f64,
    /// Altitude of the ends, km.
    pub altitude: f64,
}
