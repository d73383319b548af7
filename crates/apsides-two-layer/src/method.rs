//! Both layers as a [`Method`].

use std::sync::Arc;

use apsides_iteration::Observer;
use apsides_ocp::method::Warning;
use apsides_ocp::{Method, MethodError, Ocp, Solution, Start};

use crate::error::TwoLayerError;
use crate::search::{self, Checkpoint, Found};
use crate::settings::{ProfileModel, TwoLayerSettings};

/// The name of the method.
const NAME: &str = "two-layer";

/// A search over control profiles, and the method that solves the problem from the best of them.
#[derive(Debug)]
pub struct TwoLayer {
    /// Settings of the search.
    pub settings: TwoLayerSettings,
    /// The profiles of the problem.
    pub profile: ProfileModel,
    /// The second layer, such as a collocation.
    pub second: Box<dyn Method>,
    /// Where the search is kept between two generations, if it is.
    pub checkpoint: Option<Arc<dyn Checkpoint>>,
}

impl TwoLayer {
    /// The first layer alone.
    ///
    /// # Errors
    /// When the request is ill-posed or the checkpoint cannot be used.
    pub fn search(&self, problem: &Ocp, observer: &mut dyn Observer) -> Result<Found, TwoLayerError> {
        search::search(problem, &self.profile, &self.settings, self.checkpoint.as_deref(), observer)
    }
}

impl Method for TwoLayer {
    fn name(&self) -> &'static str {
        NAME
    }

    /// An earlier trajectory replaces the search. Where every flight of the search fails, the second layer begins from the guess.
    fn solve(
        &self,
        problem: &Ocp,
        start: &Start,
        observer: &mut dyn Observer,
    ) -> Result<Solution, MethodError> {
        if start.earlier.is_some() {
            return self.second.solve(problem, start, observer);
        }
        let Found { start: best, record } = self.search(problem, observer).map_err(MethodError::by(NAME))?;
        let failed = best.is_none();
        let begin = match best {
            Some(best) => Start::new(best.guess).with_mesh(best.mesh),
            None => start.clone(),
        };
        let mut solution = self.second.solve(problem, &begin, observer)?;
        if failed {
            solution.warnings.push(Warning::SearchFailed);
        }
        Ok(Solution { search: Some(record), ..solution })
    }
}
