//! Search without derivatives in a box:
//!
//! ```text
//! minimise f(x)   subject to   v(x) <= 0,   lower <= x <= upper
//! ```
//!
//! with an objective `f` and a violation `v` of constraints that may be noisy, discontinuous, or fail. Generations of points come
//! from an [`Algorithm`], are evaluated on all cores, and go back to it.
//!
//! ```
//! use apsides_metaheuristics::{AntColonySettings, Evaluation, Method, Search, SearchSpace, StopReason};
//!
//! // Least distance to (2, 2, 2) within a ball of radius 3 about the origin: 2 sqrt(3) - 3.
//! let distance = |x: &[f64]| {
//!     let [to, from] = [2.0, 0.0].map(|c| x.iter().map(|x| (x - c) * (x - c)).sum::<f64>().sqrt());
//!     Evaluation::constrained(to, &[from - 3.0])
//! };
//! let space = SearchSpace::cube(3, -5.0, 5.0)?;
//! let search = Search {
//!     method: Method::AntColony(AntColonySettings::default()),
//!     seed: 1,
//!     target: Some(0.4642),
//!     start: vec![vec![0.0; 3]],
//!     ..Search::default()
//! };
//! let report = search.minimize(&space, &distance)?;
//! assert_eq!(report.stop, StopReason::Target);
//! assert!(report.feasible().is_some_and(|best| best.evaluation.objective - (12_f64.sqrt() - 3.0) < 1e-4));
//! # Ok::<(), apsides_metaheuristics::SearchError>(())
//! ```
//!
//! The same seed gives the same result for any number of threads: all random numbers are drawn on one thread, and only evaluations
//! are spread. [`Run`] is a search in progress, whose whole state goes through serde and goes on to the same result. Algorithms are
//! free of the search, too: see the example of [`Algorithm`].
//!
//! It gives no proof that a minimum is global, and none that it is a minimum: a solver with derivatives polishes better. It has one
//! objective and no integers. Coordinates are searched along their axes by the genetic algorithm, the colony and annealing, which
//! therefore suffer from rotated valleys. Elementary functions are those of the platform: another one may differ in the last bits,
//! and then in everything.
//!
//! | module | subject |
//! | --- | --- |
//! | `space`, `points` | [`SearchSpace`]; [`Points`] in one array, [`Population`] with results |
//! | `evaluation` | [`Objective`], [`Evaluation`] and the order of results |
//! | `search` | [`Search`]: budget, ends, constraints, noise; [`SearchReport`] |
//! | `run`, `history`, `number` | [`Run`]: generation by generation, saved and resumed; its course; infinities in text |
//! | `evaluator` | evaluation on several threads, means, penalties |
//! | `algorithm`, `method` | [`Algorithm`], what all share; [`Method`], the choice, and [`Engine`], any of them |
//! | `genetic` | [`Genetic`]: simulated binary crossover, polynomial mutation, tournaments, elite |
//! | `particle_swarm` | [`ParticleSwarm`]: inertia or constriction, ring or all |
//! | `ant_colony` | [`AntColony`]: ACO_R |
//! | `annealing` | [`Annealing`]: steps that adapt in each coordinate |
//! | `differential_evolution` | [`DifferentialEvolution`]: classic, jDE, L-SHADE |
//! | `cma_es` | [`CmaEs`]: active update, restarts with growing and small populations |
//! | `cooperation` | [`Cooperation`] of swarm, colony and genetic algorithm, with its six steps |
//! | `islands` | [`Islands`]: any algorithms side by side, with migration |
//! | `generator` | [`Generator`] of random numbers, Latin hypercubes |
//! | `error` | [`SearchError`] |
//!
//! References:
//! * M. Alami Naeini, J. Roshanian, Modares Mechanical Engineering 14(13), 2014: the cooperation.
//! * E. Alba, M. Tomassini, IEEE Transactions on Evolutionary Computation 6, 2002, [10.1109/TEVC.2002.800880](https://doi.org/10.1109/TEVC.2002.800880): islands.
//! * D. Blackman, S. Vigna, ACM Transactions on Mathematical Software 47, 2021, [10.1145/3460772](https://doi.org/10.1145/3460772): xoshiro256++.
//! * J. Brest, S. Greiner, B. Boskovic, M. Mernik, V. Zumer, IEEE Transactions on Evolutionary Computation 10, 2006, [10.1109/TEVC.2006.872133](https://doi.org/10.1109/TEVC.2006.872133): jDE.
//! * M. Clerc, J. Kennedy, IEEE Transactions on Evolutionary Computation 6, 2002, [10.1109/4235.985692](https://doi.org/10.1109/4235.985692): constriction.
//! * A. Corana, M. Marchesi, C. Martini, S. Ridella, ACM Transactions on Mathematical Software 13, 1987, [10.1145/29380.29864](https://doi.org/10.1145/29380.29864): annealing.
//! * K. Deb, R. B. Agrawal, Complex Systems 9, 1995, 115-148: simulated binary crossover.
//! * K. Deb, M. Goyal, Computer Science and Informatics 26(4), 1996, 30-45: polynomial mutation.
//! * K. Deb, Computer Methods in Applied Mechanics and Engineering 186, 2000, [10.1016/S0045-7825(99)00389-8](https://doi.org/10.1016/S0045-7825(99)00389-8): feasibility rules.
//! * N. Hansen, The CMA Evolution Strategy: A Tutorial, 2016, [arXiv 1604.00772](https://arxiv.org/abs/1604.00772): CMA-ES.
//! * J. Kennedy, R. Eberhart, Proceedings of ICNN, 1995, [10.1109/ICNN.1995.488968](https://doi.org/10.1109/ICNN.1995.488968): particle swarm.
//! * M. D. McKay, R. J. Beckman, W. J. Conover, Technometrics 21, 1979, [10.2307/1268522](https://doi.org/10.2307/1268522): Latin hypercubes.
//! * Y. Shi, R. Eberhart, Proceedings of ICEC, 1998, [10.1109/ICEC.1998.699146](https://doi.org/10.1109/ICEC.1998.699146): inertia.
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

//! * K. Socha, M. Dorigo, European Journal of Operational Research 185, 2008, [10.1016/j.ejor.2006.06.046](https://doi.org/10.1016/j.ejor.2006.06.046): ACO_R.
//! * R. Tanabe, A. Fukunaga, Proceedings of CEC, 2014, [10.1109/CEC.2014.6900380](https://doi.org/10.1109/CEC.2014.6900380): L-SHADE.

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
mod method;
mod number;
mod particle_swarm;
mod points;
mod search;
mod space;

pub use algorithm::{Algorithm, Convergence, Task};
pub use annealing::{Annealing, AnnealingSettings};
pub use ant_colony::{AntColony, AntColonySettings};
pub use cma_es::{CmaBounds, CmaEs, CmaEsSettings, Restarts};
pub use cooperation::{Cooperation, CooperationSettings, Exchange};
pub use differential_evolution::{
    DifferentialAdaptation, DifferentialBounds, DifferentialEvolution, DifferentialEvolutionSettings,
    DifferentialMutation,
};
pub use error::SearchError;
pub use evaluation::{Candidate, Constraints, Evaluation, Noise, Objective};
pub use generator::Generator;
pub use genetic::{Genetic, GeneticSettings};
pub use history::HistoryPoint;
pub use method::{Engine, Islands, IslandsSettings, Method, Topology};
pub use particle_swarm::{Damping, Neighbourhood, ParticleSwarm, ParticleSwarmSettings};
pub use points::{Points, Population};
pub use search::{Progress, Run, Search, SearchReport, Stagnation, StopReason};
pub use space::SearchSpace;
