//! The control profiles that are searched, and the settings of the search.

use apsides_metaheuristics::Search;
use apsides_ocp::Bounds;
use apsides_shooting::profile::{Independent, MeshWish, Steering};

/// The control profiles of a problem of one phase, and how they are flown.
#[derive(Clone, Debug)]
pub struct ProfileModel {
    /// The variable that profiles are functions of.
    pub independent: Independent,
    /// Allowed values of each component of a profile.
    pub bounds: Vec<Bounds>,
    /// From the components to the controls.
    pub steering: Steering,
    /// Name of the state that ends a flight where it reaches its end value.
    pub stop: String,
    /// Distance that one unit of each state missed at the end stands for, in one unit of length for all; zero for a state whose miss costs
    /// nothing.
    pub distance_per_unit: Vec<f64>,
}

impl ProfileModel {
    /// Distance from where a flight should end, from what each state misses.
    #[must_use]
    pub fn miss(&self, misses: &[f64]) -> f64 {
        misses.iter().zip(&self.distance_per_unit).map(|(miss, d)| (miss * d).powi(2)).sum::<f64>().sqrt()
    }
}

/// The comparison of flights that miss their end or exceed limits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Ranking {
    /// The price of misses and excesses is added to the objective.
    #[default]
    Penalty,
    /// Misses and excesses count first, the objective among flights that have none.
    FeasibilityFirst,
}

/// Settings of the first layer and of the start that it hands over.
#[derive(Clone, Debug)]
pub struct TwoLayerSettings {
    /// Algorithm, budget, seed and threads of the search; those of [`Search::default`].
    pub search: Search,
    /// Degree of the polynomials, 0 to 5; 1.
    pub degree: usize,
    /// Largest degree: that of each sub-interval is searched from [`degree`](Self::degree) up to it; none: all have that one.
    pub most_degree: Option<usize>,
    /// Fewest sub-intervals; their number is searched up to the next setting; 3.
    pub least_intervals: usize,
    /// Most sub-intervals; 3.
    pub most_intervals: usize,
    /// True if the lengths of the sub-intervals are searched; false.
    pub free_lengths: bool,
    /// True if controls are continuous between sub-intervals, where no degree can be 0; true.
    pub continuous: bool,
    /// The way in which misses and excesses count; as a penalty.
    pub ranking: Ranking,
    /// Price of a miss, in the objective's unit per unit of length; 0.2.
    pub price_of_miss: f64,
    /// Price of a limit exceeded by its own size, in the objective's unit; 100.
    pub price_of_excess: f64,
    /// The mesh of the start for the second layer: 10 intervals of 5 points.
    pub mesh: MeshWish,
}

impl Default for TwoLayerSettings {
    fn default() -> Self {
        Self {
            search: Search::default(),
            degree: 1,
            most_degree: None,
            least_intervals: 3,
            most_intervals: 3,
            free_lengths: false,
            continuous: true,
            ranking: Ranking::Penalty,
            price_of_miss: 0.2,
            price_of_excess: 100.0,
            mesh: MeshWish { intervals: 10, points: 5, joints: false },
        }
    }
}
