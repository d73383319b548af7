//! The interface of all algorithms: an algorithm asks for results at points and is told them.

use crate::error::require;
use crate::{Candidate, Evaluation, Generator, Points, Population, SearchError, SearchSpace};
use serde::{Deserialize, Serialize};

/// A search without derivatives in generations of points.
///
/// All random numbers are drawn in `ask` and `tell`, so that a search does not depend on where points are evaluated. An algorithm
/// compares results by [`Evaluation::order`] alone.
///
/// Without a [`Search`](crate::Search), for results that come from elsewhere:
///
/// ```
/// use apsides_metaheuristics::{Algorithm, Evaluation, Method, Points, SearchSpace, Task};
///
/// let space = SearchSpace::cube(2, -1.0, 1.0)?;
/// let task = Task { space: &space, start: &Points::new(2), seed: 1, budget: 4000 };
/// let mut engine = Method::default().start(&task)?;
/// let mut points = Points::new(2);
/// for _ in 0..100 {
///     engine.ask(&mut points);
///     let results: Vec<_> = points.rows().map(|x| Evaluation::new(x[0] * x[0] + x[1] * x[1])).collect();
///     engine.tell(&points, &results);
/// }
/// assert!(engine.best().is_some_and(|best| best.evaluation.objective < 1e-8));
/// # Ok::<(), apsides_metaheuristics::SearchError>(())
/// ```
pub trait Algorithm: Send {
    /// Puts the points of the next generation, all inside of the box, into `points`, which is cleared first. Memory is allocated
    /// in the first generations only.
    fn ask(&mut self, points: &mut Points);

    /// Takes the results of the points of the last `ask`, in their order.
    fn tell(&mut self, points: &Points, evaluations: &[Evaluation]);

    /// The best point so far, `None` while there is none or all failed.
    fn best(&self) -> Option<&Candidate>;

    /// Adds copies of the `count` best members of the population to `into`, best first.
    fn emigrants(&self, count: usize, into: &mut Population);

    /// Takes members of another population in, in place of its own worst. Called between `tell` and `ask`.
    fn immigrate(&mut self, migrants: &Population);

    /// The extent of the population: the standard deviation of a coordinate as a part of the box, the mean over coordinates.
    fn spread(&self) -> f64;

    /// The reason why nothing more is to be gained, `None` while there is.
    fn converged(&self) -> Option<Convergence> {
        None
    }
}

/// The reason why an algorithm has nothing more to gain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Convergence {
    /// The population or its steps have shrunk to rounding.
    Spread,
    /// Results no longer differ.
    FlatObjective,
    /// The model of the objective is too ill-conditioned to go on.
    Condition,
}

/// The problem that an algorithm starts from.
#[derive(Clone, Debug, PartialEq)]
pub struct Task<'a> {
    /// The box.
    pub space: &'a SearchSpace,
    /// Points of the first generation, inside of the box; the rest are random.
    pub start: &'a Points,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Evaluations of the whole search, for settings that change on the way.
    pub budget: usize,
}

impl Task<'_> {
    /// The first generation: the start points, then random ones.
    pub fn first_points(&self, count: usize, generator: &mut Generator) -> Points {
        let mut points = Points::new(self.space.dimension());
        points.extend(self.start);
        points.truncate(count);
        generator.fill(self.space, count, &mut points);
        points
    }
}

/// Members of a population at most, far above what is useful and far below what memory holds.
const LARGEST: usize = 1_000_000;

/// Refuses a population that is too small or too large.
pub(crate) fn require_population(
    method: &'static str,
    found: usize,
    least: usize,
) -> Result<(), SearchError> {
    if found < least {
        return Err(SearchError::Population { method, found, least });
    }
    require(method, found as f64, found <= LARGEST, "at most 1000000 is allowed")
}
