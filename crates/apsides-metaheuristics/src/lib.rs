//! Search without derivatives in a box:
//!
//! ```text
//! minimise f(x)   subject to   v(x) <= 0,   lower <= x <= upper
//! ```
//!
//! with an objective `f` and a violation `v` of constraints that may be noisy, discontinuous, or fail.
//!
//! ```
//! use apsides_metaheuristics::{Search, SearchSpace};
//!
//! let space = SearchSpace::cube(5, -5.0, 5.0)?;
//! let sphere = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
//! let report = Search { seed: 1, ..Search::default() }.minimize(&space, &sphere)?;
//! assert!(report.best.is_some_and(|b| b.evaluation.objective < 1e-6));
//! # Ok::<(), apsides_metaheuristics::SearchError>(())
//! ```

mod algorithm;
mod annealing;
mod ant_colony;
mod cma_es;
mod cooperation;
mod differential_evolution;
mod error;
mod evaluation;
mod evaluator;
mod generator;
mod genetic;
mod history;
mod islands;
mod method;
mod number;
mod particle_swarm;
mod points;
mod run;
mod search;
mod space;

pub use algorithm::{Algorithm, Convergence, Task};
pub use annealing::{Annealing, AnnealingSettings};
pub use ant_colony::{AntColony, AntColonySettings};
pub use cma_es::{CmaBounds, CmaEs, CmaEsSettings, Restarts};
pub use cooperation::{Cooperation, CooperationSettings};
pub use differential_evolution::{
    DifferentialAdaptation, DifferentialBounds, DifferentialEvolution, DifferentialEvolutionSettings,
    DifferentialMutation,
};
pub use error::SearchError;
pub use evaluation::{Candidate, Evaluation, Objective};
pub use generator::Generator;
pub use genetic::{Genetic, GeneticSettings};
pub use history::HistoryPoint;
pub use islands::{Islands, IslandsSettings, Topology};
pub use method::{Engine, Method};
pub use particle_swarm::{Damping, Neighbourhood, ParticleSwarm, ParticleSwarmSettings};
pub use points::{Points, Population};
pub use run::Run;
pub use search::{Constraints, Noise, Progress, Search, SearchReport, Stagnation, StopReason};
pub use space::SearchSpace;
