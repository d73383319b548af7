//! The methods behind the key `method`: their settings, read once from the values of a mission, and one way to call each.

use std::fmt::Debug;
use std::path::PathBuf;
use std::sync::Arc;

use apsides_ocp::method::SearchRecord;
use apsides_ocp::{Mesh, Method, Ocp, Solution, Start, Trajectory};

use crate::Error;
use crate::key::Key;
use crate::memory::Foreseen;
use crate::observer::Observer;
use crate::outcome::SearchSummary;
use crate::posed::Posed;
use crate::values::Values;

#[cfg(feature = "flatness")]
mod flatness;
#[cfg(feature = "indirect")]
mod indirect;
#[cfg(feature = "multiple-shooting")]
mod multiple_shooting;
#[cfg(feature = "piecewise")]
mod piecewise;
mod radau;
#[cfg(feature = "successive-convexification")]
mod successive_convexification;
#[cfg(feature = "two-layer")]
mod two_layer;

pub use radau::RadauMethod;
#[cfg(feature = "two-layer")]
pub use two_layer::Found;

/// Path of the key.
pub const KEY: &str = "method";

/// A method by its word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MethodName {
    /// Collocation at Radau points.
    Radau,
    /// Flat outputs on B-splines.
    Flatness,
    /// Direct multiple shooting.
    MultipleShooting,
    /// Pontryagin's conditions by shooting.
    Indirect,
    /// Piecewise-constant controls.
    Piecewise,
    /// A search of control profiles, then collocation.
    TwoLayer,
    /// A sequence of convex programs.
    SuccessiveConvexification,
}

impl MethodName {
    /// Those that the features of this crate bring, the default first.
    pub const ALL: &[Self] = &{
        let mut names = [Self::Radau; METHODS.len()];
        let mut k = 0;
        while k < names.len() {
            names[k] = METHODS[k].name;
            k += 1;
        }
        names
    };

    /// The word in files.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Radau => "radau",
            Self::Flatness => "flatness",
            Self::MultipleShooting => "multiple-shooting",
            Self::Indirect => "indirect",
            Self::Piecewise => "piecewise",
            Self::TwoLayer => "two-layer",
            Self::SuccessiveConvexification => "successive-convexification",
        }
    }

    /// The entry of the method, if a feature of this crate brings it.
    fn entry(self) -> Option<&'static Entry> {
        METHODS.iter().find(|entry| entry.name == self)
    }
}

/// The entry that a file in this folder offers.
struct Entry {
    name: MethodName,
    /// Its keys, the same for all missions.
    keys: &'static [Key],
    /// Keys of settings, by the names of their fields in the crate of the method.
    names: &'static [(&'static str, &'static str)],
    /// The reason that it cannot treat the problems of a mission, for a method that asks more of them than equations.
    refuses: Option<fn(&Posed, &Values) -> Option<Error>>,
    /// Its settings by the values of a mission.
    read: fn(&Values) -> Result<Arc<dyn MethodSettings>, Error>,
}

/// The methods, the default first.
const METHODS: &[Entry] = &[
    radau::ENTRY,
    #[cfg(feature = "flatness")]
    flatness::ENTRY,
    #[cfg(feature = "multiple-shooting")]
    multiple_shooting::ENTRY,
    #[cfg(feature = "indirect")]
    indirect::ENTRY,
    #[cfg(feature = "piecewise")]
    piecewise::ENTRY,
    #[cfg(feature = "two-layer")]
    two_layer::ENTRY,
    #[cfg(feature = "successive-convexification")]
    successive_convexification::ENTRY,
];

/// The settings of a method.
trait MethodSettings: Debug + Send + Sync {
    /// The method for a problem.
    ///
    /// # Errors
    /// A problem that the method cannot treat.
    fn method(&self, case: &PosedCase<'_>) -> Result<Box<dyn Method>, Error>;

    /// The memory of a solve of a case.
    fn foreseen(&self, case: &PosedCase<'_>) -> Foreseen;

    /// Refuses settings that do not go together; looked at where the mission names the method.
    fn check(&self, _values: &Values) -> Result<(), Error> {
        Ok(())
    }

    /// The summary of a search, for a method that begins with one.
    fn search_summary(&self, _record: SearchRecord) -> Option<SearchSummary> {
        None
    }
}

/// A problem, and what does not belong to the settings of one method.
#[cfg_attr(
    not(feature = "two-layer"),
    expect(dead_code, reason = "seed and checkpoint are those of searches")
)]
struct PosedCase<'a> {
    posed: &'a Posed,
    /// The collocation that other methods begin or end with.
    radau: &'a RadauMethod,
    threads: usize,
    seed: u64,
    checkpoint: Option<&'a CheckpointFile>,
}

/// The file of a search, for one mission and seed.
#[derive(Clone, Debug)]
#[cfg_attr(not(feature = "two-layer"), expect(dead_code, reason = "only searches have checkpoints"))]
pub(crate) struct CheckpointFile {
    path: PathBuf,
    /// All values of the mission, and the seed.
    mission: String,
}

impl CheckpointFile {
    /// The checkpoint of a mission, by its file with every value written out, and a seed.
    pub(crate) fn new(path: PathBuf, mission_file: &str, seed: u64) -> Self {
        Self { path, mission: format!("{mission_file}\nseed {seed}\n") }
    }
}

const WORDS: [&str; MethodName::ALL.len()] = {
    let mut words = [""; MethodName::ALL.len()];
    let mut k = 0;
    while k < words.len() {
        words[k] = MethodName::ALL[k].word();
        k += 1;
    }
    words
};

const METHOD: &[Key] = &[Key::choice(KEY, &WORDS, "how the problem is solved")];

/// Former paths of keys, each with the one of today.
pub(crate) const RENAMED: &[(&str, &str)] = &[
    ("flatness.refine", "flatness.max_refinements"),
    ("flatness.segments", "flatness.intervals"),
    ("indirect.segments", "indirect.intervals"),
    ("piecewise.max_segments", "piecewise.max_intervals"),
    ("piecewise.refine", "piecewise.max_refinements"),
    ("piecewise.segments", "piecewise.intervals"),
    ("radau.max_meshes", "radau.max_refinements"),
    ("radau.mesh_tolerance", "radau.tolerance"),
    ("shooting.control_points", "shooting.points"),
    ("shooting.max_meshes", "shooting.max_refinements"),
    ("shooting.segments", "shooting.intervals"),
];

/// The method that solves a mission, and the settings of all methods.
#[derive(Clone, Debug)]
pub struct Methods {
    /// The method that solves the mission.
    pub name: MethodName,
    /// Settings of collocation, which other methods begin or explain with.
    pub radau: RadauMethod,
    #[cfg(feature = "two-layer")]
    two_layer: Arc<two_layer::TwoLayerMethod>,
    all: Vec<(MethodName, Arc<dyn MethodSettings>)>,
    threads: usize,
    seed: u64,
}

impl Methods {
    /// Keys of the methods, the same for all missions.
    pub fn keys() -> impl Iterator<Item = &'static Key> {
        METHOD.iter().chain(METHODS.iter().flat_map(|entry| entry.keys))
    }

    /// The settings that values state.
    ///
    /// # Errors
    /// Settings that do not go together.
    pub fn read(values: &Values) -> Result<Self, Error> {
        let word = values.word(KEY)?;
        // The key takes no other words.
        let name = MethodName::ALL.iter().copied().find(|m| m.word() == word).unwrap_or(MethodName::Radau);
        let all = METHODS.iter().map(|entry| Ok((entry.name, (entry.read)(values)?)));
        let methods = Self {
            name,
            radau: RadauMethod::read(values)?,
            #[cfg(feature = "two-layer")]
            two_layer: Arc::new(two_layer::TwoLayerMethod::read(values)?),
            all: all.collect::<Result<_, Error>>()?,
            threads: 1,
            seed: 0,
        };
        methods.settings()?.check(values)?;
        Ok(methods)
    }

    /// The same with so many threads; no result depends on it.
    #[must_use]
    pub fn with_threads(mut self, threads: usize) -> Self {
        self.radau.settings.threads = threads;
        Self { threads, ..self }
    }

    /// The same with a seed of everything random.
    #[must_use]
    pub fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// The same with another method.
    #[must_use]
    pub fn with_method(self, name: MethodName) -> Self {
        Self { name, ..self }
    }

    /// The same, collocation being no more accurate between the points of the mesh than this.
    #[must_use]
    pub fn with_tolerance_from(mut self, least: f64) -> Self {
        let tolerance = &mut self.radau.settings.tolerance;
        *tolerance = tolerance.max(least);
        self
    }

    /// The first mesh of collocation.
    ///
    /// # Errors
    /// Never for settings that were read from values.
    pub fn first_mesh(&self, ocp: &Ocp) -> Result<Mesh, Error> {
        self.radau.first_mesh(ocp)
    }

    /// The settings of the method of the mission.
    fn settings(&self) -> Result<&dyn MethodSettings, Error> {
        let settings = self.all.iter().find(|(name, _)| *name == self.name);
        settings.map(|(_, settings)| &**settings).ok_or_else(|| {
            let word = self.name.word();
            Error::in_mission(format!(
                "`method` is \"{word}\", without which this program was built; build it with the feature `{word}`"
            ))
        })
    }

    /// Refuses a mission whose problems the method can never treat; `pose` poses one.
    pub(crate) fn check(
        &self,
        pose: impl FnOnce() -> Result<Posed, Error>,
        values: &Values,
    ) -> Result<(), Error> {
        match self.name.entry().and_then(|entry| entry.refuses) {
            Some(refuses) => refuses(&pose()?, values).map_or(Ok(()), Err),
            None => Ok(()),
        }
    }

    fn case<'a>(&'a self, posed: &'a Posed, checkpoint: Option<&'a CheckpointFile>) -> PosedCase<'a> {
        PosedCase { posed, radau: &self.radau, threads: self.threads, seed: self.seed, checkpoint }
    }

    /// The memory that a solve takes.
    ///
    /// # Errors
    /// A method without which the program was built.
    pub(crate) fn foreseen(&self, posed: &Posed) -> Result<Foreseen, Error> {
        Ok(self.settings()?.foreseen(&self.case(posed, None)))
    }

    /// Solves a problem. `start` replaces the guess of the mission; a search is kept in a checkpoint, where there is one.
    pub(crate) fn solve(
        &self,
        posed: &Posed,
        start: Option<&Trajectory>,
        checkpoint: Option<&CheckpointFile>,
        observer: &mut dyn Observer,
    ) -> Result<Solution, Error> {
        let own = || Start { costates: posed.costates.clone(), ..Start::new(posed.guess.clone()) };
        let start = start.map_or_else(own, |t| Start::from_trajectory(t.clone()));
        let method = self.settings()?.method(&self.case(posed, checkpoint))?;
        Ok(method.solve(&posed.ocp, &start, observer)?)
    }

    /// Solves a problem from another start than that of the mission.
    pub(crate) fn solve_from(
        &self,
        posed: &Posed,
        start: &Start,
        observer: &mut dyn Observer,
    ) -> Result<Solution, Error> {
        let method = self.settings()?.method(&self.case(posed, None))?;
        Ok(method.solve(&posed.ocp, start, observer)?)
    }

    /// The same, collocation taking at most so many iterations on a mesh.
    #[must_use]
    pub(crate) fn with_most_iterations(mut self, most: usize) -> Self {
        let iterations = &mut self.radau.settings.nlp.max_iterations;
        *iterations = most.min(*iterations);
        self
    }

    /// The same, collocation refining its mesh at most so many times.
    #[must_use]
    pub(crate) fn with_most_refinements(mut self, most: usize) -> Self {
        let refinements = &mut self.radau.settings.max_refinements;
        *refinements = most.min(*refinements);
        self
    }

    /// The key of a setting of the method, by the name of its field; that name where it has no key.
    pub(crate) fn key_of(&self, setting: &'static str) -> String {
        let names = self.name.entry().map_or(&[][..], |entry| entry.names);
        names.iter().find(|(name, _)| *name == setting).map_or(setting, |(_, key)| key).into()
    }

    /// The summary of a search, if the method of the mission begins with one.
    pub(crate) fn search_summary(&self, record: SearchRecord) -> Option<SearchSummary> {
        self.settings().ok()?.search_summary(record)
    }
}

#[cfg(feature = "two-layer")]
impl Methods {
    /// The search that finds a start, alone.
    ///
    /// # Errors
    /// A problem without control profiles, settings that the search refuses.
    pub fn search(&self, posed: &Posed, observer: &mut dyn Observer) -> Result<Found, Error> {
        self.two_layer.search(&self.case(posed, None), observer)
    }

    /// The settings of the search.
    #[must_use]
    pub fn search_settings(&self) -> apsides_metaheuristics::Search {
        self.two_layer.search_settings(self.threads, self.seed)
    }
}
