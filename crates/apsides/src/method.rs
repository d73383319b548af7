//! The methods behind the key `method`, with one face: what they take from the mission's values, and what a solution says.

use apsides_nlp::{SolveReport, Status};
use apsides_ocp::{Guess, Trajectory};

use crate::key::Key;
use crate::missions::Posed;
use crate::{Counters, Error, Mission, Observer, SearchSummary};

mod flatness;
mod indirect;
mod multiple_shooting;
mod piecewise;
mod radau;
mod two_layer;

pub(crate) const RADAU: &str = "radau";
pub(crate) const FLATNESS: &str = "flatness";
pub(crate) const MULTIPLE_SHOOTING: &str = "multiple-shooting";
pub(crate) const INDIRECT: &str = "indirect";
pub(crate) const PIECEWISE: &str = "piecewise";
pub(crate) const TWO_LAYER: &str = "two-layer";

/// Path of the key.
pub(crate) const KEY: &str = "method";

const METHOD: &[Key] = &[Key::choice(
    KEY,
    &[RADAU, FLATNESS, MULTIPLE_SHOOTING, INDIRECT, PIECEWISE, TWO_LAYER],
    "how the problem is solved",
)];

/// Keys of the methods, the same for all missions.
pub(crate) fn keys() -> impl Iterator<Item = &'static Key> {
    [
        METHOD,
        radau::KEYS,
        flatness::KEYS,
        multiple_shooting::KEYS,
        indirect::KEYS,
        piecewise::KEYS,
        two_layer::KEYS,
    ]
    .into_iter()
    .flatten()
}

/// A solution by any method.
pub(crate) struct Solution {
    pub(crate) trajectory: Trajectory,
    pub(crate) status: Status,
    /// What keeps a converged solution from being one of the problem.
    pub(crate) shortfall: Option<Shortfall>,
    pub(crate) counters: Counters,
    /// Of the last discretised problem, if the method solves one.
    pub(crate) report: Option<SolveReport>,
    /// The constraint that could not be met.
    pub(crate) unmet: Option<String>,
    pub(crate) warnings: Vec<String>,
    pub(crate) switches: Vec<String>,
    /// Before it.
    pub(crate) search: Option<SearchSummary>,
}

/// What keeps a converged solution from being one of the problem.
pub(crate) struct Shortfall {
    /// The word for scripts.
    pub(crate) status: &'static str,
    /// What it is, and what would mend it.
    pub(crate) text: String,
}

impl Shortfall {
    /// The discretisation is too coarse.
    fn mesh(text: String) -> Self {
        Self { status: "mesh-limit", text }
    }
}

impl Mission {
    /// Solves by the method of the mission's values. `start` replaces the mission's own guess.
    pub(crate) fn solve_by_method(
        &self,
        posed: &Posed,
        start: Option<&Trajectory>,
        observer: &mut dyn Observer,
    ) -> Result<Solution, Error> {
        let guess = start.map_or_else(|| posed.guess.clone(), Guess::earlier);
        match self.method() {
            FLATNESS => {
                let systems = posed.flat_systems.as_deref().ok_or_else(|| self.not_flat())?;
                flatness::solve(&self.values, &posed.ocp, systems, &guess, observer)
            }
            MULTIPLE_SHOOTING => self.solve_by_multiple_shooting(&posed.ocp, &guess, observer),
            PIECEWISE => self.solve_by_piecewise_controls(&posed.ocp, &guess, observer),
            TWO_LAYER => self.solve_by_two_layers(posed, &guess, start, observer),
            INDIRECT => self.solve_by_indirect_shooting(posed, &guess, start, observer),
            _ => self.solve_by_radau(&posed.ocp, &guess, start, observer),
        }
    }

    /// The word of the method.
    pub(crate) fn method(&self) -> &str {
        self.values.word(KEY)
    }

    /// Whether the method can fly the mission.
    pub(crate) fn check_method(&self) -> Result<(), Error> {
        if self.kind.as_optimised().is_none() {
            return Ok(());
        }
        match self.method() {
            FLATNESS if self.pose()?.flat_systems.is_none() => Err(self.not_flat()),
            TWO_LAYER if self.pose()?.search.is_none() => Err(self.not_searched()),
            TWO_LAYER => self.check_search(),
            _ => Ok(()),
        }
    }

    fn not_flat(&self) -> Error {
        let reason = if self.keys().any(|k| k.path == "throttle") {
            "`method` is \"flatness\", which flies full thrust in a direction that may jump; choose `throttle` = \
             \"full\" and `max_pitch_rate_deg_s` = inf, or `method` = \"radau\""
        } else {
            "`method` is \"flatness\", but the mission has no flat outputs; choose `method` = \"radau\""
        };
        Error::Conflict { place: format!("mission `{}`", self.name()), reason: reason.into() }
    }
}
