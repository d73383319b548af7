//! The methods behind the key `method`: their settings, read once from the values of a mission, and one way to call each.

use std::sync::Arc;

use apsides_ocp::method::SearchRecord;
use apsides_ocp::{Mesh, Method, Ocp, Solution, Start, Trajectory};
use apsides_two_layer::Checkpoint;

use crate::Error;
use crate::key::Key;
use crate::observer::Observer;
use crate::outcome::SearchSummary;
use crate::posed::Posed;
use crate::values::Values;

mod flatness;
mod indirect;
mod multiple_shooting;
mod piecewise;
mod radau;
#[cfg(feature = "successive-convexification")]
mod successive_convexification;
mod two_layer;

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
    #[cfg(feature = "successive-convexification")]
    SuccessiveConvexification,
}

impl MethodName {
    /// All of them, the default first.
    pub const ALL: &[Self] = &[
        Self::Radau,
        Self::Flatness,
        Self::MultipleShooting,
        Self::Indirect,
        Self::Piecewise,
        Self::TwoLayer,
        #[cfg(feature = "successive-convexification")]
        Self::SuccessiveConvexification,
    ];

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
            #[cfg(feature = "successive-convexification")]
            Self::SuccessiveConvexification => "successive-convexification",
        }
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
    pub radau: radau::RadauMethod,
    flatness: flatness::FlatnessMethod,
    multiple_shooting: multiple_shooting::MultipleShootingMethod,
    indirect: indirect::IndirectMethod,
    piecewise: piecewise::PiecewiseMethod,
    two_layer: two_layer::TwoLayerMethod,
    #[cfg(feature = "successive-convexification")]
    convexification: successive_convexification::ConvexificationMethod,
}

impl Methods {
    /// Keys of the methods, the same for all missions.
    pub fn keys() -> impl Iterator<Item = &'static Key> {
        [
            METHOD,
            radau::KEYS,
            flatness::KEYS,
            multiple_shooting::KEYS,
            indirect::KEYS,
            piecewise::KEYS,
            two_layer::KEYS,
            #[cfg(feature = "successive-convexification")]
            successive_convexification::KEYS,
        ]
        .into_iter()
        .flatten()
    }

    /// The settings that values state.
    ///
    /// # Errors
    /// Settings that do not go together.
    pub fn read(values: &Values) -> Result<Self, Error> {
        let word = values.word(KEY)?;
        // The key takes no other words.
        let name = MethodName::ALL.iter().copied().find(|m| m.word() == word).unwrap_or(MethodName::Radau);
        let radau = radau::RadauMethod::read(values)?;
        let two_layer = two_layer::TwoLayerMethod::read(values)?;
        if name == MethodName::TwoLayer {
            two_layer.check(values)?;
        }
        Ok(Self {
            name,
            flatness: flatness::FlatnessMethod::read(values)?,
            multiple_shooting: multiple_shooting::MultipleShootingMethod::read(values)?,
            indirect: indirect::IndirectMethod::read(values)?,
            piecewise: piecewise::PiecewiseMethod::read(values)?,
            radau,
            two_layer,
            #[cfg(feature = "successive-convexification")]
            convexification: successive_convexification::ConvexificationMethod::read(values)?,
        })
    }

    /// The same with so many threads; no result depends on it.
    #[must_use]
    pub fn with_threads(mut self, threads: usize) -> Self {
        self.radau.settings.threads = threads;
        self.multiple_shooting.settings.threads = threads.clamp(1, 1024);
        self.indirect.settings.threads = threads;
        self.piecewise.settings.shooting.threads = threads.clamp(1, 1024);
        self.two_layer.search.threads = threads;
        self
    }

    /// The same with a seed of everything random.
    #[must_use]
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.two_layer.search.seed = seed;
        self
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

    /// Refuses a problem that the method cannot treat.
    pub(crate) fn check(&self, posed: &Posed, values: &Values) -> Result<(), Error> {
        match self.name {
            MethodName::Flatness if posed.flat_systems.is_none() => Err(not_flat(values)),
            MethodName::TwoLayer if posed.search.is_none() => Err(not_searched(values)),
            _ => Ok(()),
        }
    }

    /// The method of the mission, for its problem; a search is kept in a checkpoint, where there is one.
    fn method(
        &self,
        posed: &Posed,
        checkpoint: Option<Arc<dyn Checkpoint>>,
    ) -> Result<Box<dyn Method>, Error> {
        let refused = |reason: &str| Error::in_mission(reason);
        Ok(match self.name {
            MethodName::Flatness => {
                let systems = posed.flat_systems.clone().ok_or_else(|| refused(NO_FLAT_OUTPUTS))?;
                Box::new(self.flatness.method(systems))
            }
            MethodName::MultipleShooting => Box::new(self.multiple_shooting.method()),
            MethodName::Piecewise => Box::new(self.piecewise.method()),
            MethodName::TwoLayer => {
                let model = posed.search.as_ref().ok_or_else(|| refused(NO_PROFILES))?;
                Box::new(self.two_layer.method(&self.radau, model, checkpoint))
            }
            MethodName::Indirect => Box::new(self.indirect.method(&self.radau)),
            MethodName::Radau => Box::new(self.radau.method()),
            #[cfg(feature = "successive-convexification")]
            MethodName::SuccessiveConvexification => Box::new(self.convexification.method(&posed.ocp)?),
        })
    }

    /// Solves a problem. `start` replaces the guess of the mission; a search is kept in a checkpoint, where there is one.
    pub(crate) fn solve(
        &self,
        posed: &Posed,
        start: Option<&Trajectory>,
        checkpoint: Option<Arc<dyn Checkpoint>>,
        observer: &mut dyn Observer,
    ) -> Result<Solution, Error> {
        let own = || Start { costates: posed.costates.clone(), ..Start::new(posed.guess.clone()) };
        let start = start.map_or_else(own, |t| Start::from_trajectory(t.clone()));
        Ok(self.method(posed, checkpoint)?.solve(&posed.ocp, &start, observer)?)
    }

    /// The key of a setting of the method, by the name of its field; that name where it has no key.
    pub(crate) fn key_of(&self, setting: &'static str) -> String {
        let names = match self.name {
            MethodName::Flatness => flatness::NAMES,
            MethodName::MultipleShooting => multiple_shooting::NAMES,
            MethodName::Indirect => indirect::NAMES,
            MethodName::Piecewise => piecewise::NAMES,
            MethodName::Radau | MethodName::TwoLayer => radau::NAMES,
            #[cfg(feature = "successive-convexification")]
            MethodName::SuccessiveConvexification => successive_convexification::NAMES,
        };
        names.iter().find(|(name, _)| *name == setting).map_or(setting, |(_, key)| key).into()
    }

    /// The summary of a search.
    pub(crate) fn search_summary(&self, record: SearchRecord) -> SearchSummary {
        self.two_layer.summary(record)
    }

    /// The search that finds a start, alone.
    ///
    /// # Errors
    /// A problem without control profiles, settings that the search refuses.
    pub fn search(&self, posed: &Posed, observer: &mut dyn Observer) -> Result<two_layer::Found, Error> {
        let model = posed.search.as_ref().ok_or_else(|| Error::in_mission(NO_PROFILES))?;
        self.two_layer.search(&self.radau, &posed.ocp, model, observer)
    }

    /// The settings of the search.
    #[must_use]
    pub fn search_settings(&self) -> &apsides_metaheuristics::Search {
        &self.two_layer.search
    }
}

pub use radau::RadauMethod;
pub use two_layer::Found;

const NO_FLAT_OUTPUTS: &str =
    "`method` is \"flatness\", but the mission has no flat outputs; choose `method` = \"radau\"";
const NO_PROFILES: &str =
    "`method` is \"two-layer\", which searches control profiles of a re-entry; choose `method` = \"radau\"";

fn not_flat(values: &Values) -> Error {
    values.refused(if values.declares("throttle") {
        "`method` is \"flatness\", which flies full thrust in a direction that may jump; choose `throttle` = \
         \"full\" and `max_pitch_rate_deg_s` = inf, or `method` = \"radau\""
    } else {
        NO_FLAT_OUTPUTS
    })
}

fn not_searched(values: &Values) -> Error {
    values.refused(NO_PROFILES)
}
