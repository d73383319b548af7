//! Searches by every method.

mod bad_input;
mod ends;
mod memory;
mod minima;
mod properties;
mod resume;

use apsides_metaheuristics::{
    AnnealingSettings, AntColonySettings, CmaBounds, CmaEsSettings, CooperationSettings, Damping,
    DifferentialBounds, DifferentialEvolutionSettings, DifferentialMutation, GeneticSettings,
    IslandsSettings, Method, Neighbourhood, ParticleSwarmSettings, Restarts, Search, SearchReport, Topology,
};
use std::time::Duration;

/// Every method, some with several settings.
fn methods() -> Vec<(&'static str, Method)> {
    let swarm = ParticleSwarmSettings::default();
    let inertia = ParticleSwarmSettings {
        damping: Damping::Inertia { first: 0.9, last: 0.4 },
        cognitive: 2.0,
        social: 2.0,
        ..swarm.clone()
    };
    let global = ParticleSwarmSettings { neighbourhood: Neighbourhood::Global, ..swarm.clone() };
    let all = vec![
        Method::Genetic(GeneticSettings { population: 31, elite: Some(2), ..Default::default() }),
        Method::ParticleSwarm(global.clone()),
        Method::AntColony(AntColonySettings::default()),
        Method::SimulatedAnnealing(AnnealingSettings { walkers: 3, ..Default::default() }),
        Method::DifferentialEvolution(DifferentialEvolutionSettings::default()),
        Method::CmaEs(CmaEsSettings::default()),
    ];
    let rand = DifferentialEvolutionSettings::classic();
    let to_best = DifferentialEvolutionSettings {
        mutation: DifferentialMutation::CurrentToBest,
        bounds: DifferentialBounds::Reflection,
        ..rand.clone()
    };
    let cma = CmaEsSettings::default();
    let resampling =
        CmaEsSettings { bounds: CmaBounds::Resampling, restarts: Restarts::Increasing, ..cma.clone() };
    let islands =
        IslandsSettings { islands: all, topology: Topology::Star, interval: 5, ..Default::default() };
    vec![
        ("genetic", Method::Genetic(GeneticSettings::default())),
        (
            "genetic, generational",
            Method::Genetic(GeneticSettings { elite: Some(1), population: 31, ..Default::default() }),
        ),
        ("swarm", Method::ParticleSwarm(swarm)),
        ("swarm with inertia", Method::ParticleSwarm(inertia)),
        ("global swarm", Method::ParticleSwarm(global)),
        ("colony", Method::AntColony(AntColonySettings::default())),
        ("annealing", Method::SimulatedAnnealing(AnnealingSettings::default())),
        (
            "annealing, four walkers",
            Method::SimulatedAnnealing(AnnealingSettings { walkers: 4, ..Default::default() }),
        ),
        ("cooperation", Method::Cooperation(CooperationSettings::default())),
        ("islands", Method::Islands(islands)),
        ("differential evolution", Method::DifferentialEvolution(rand)),
        ("differential evolution towards the best", Method::DifferentialEvolution(to_best)),
        ("jDE", Method::DifferentialEvolution(DifferentialEvolutionSettings::self_adaptive())),
        ("L-SHADE", Method::DifferentialEvolution(DifferentialEvolutionSettings::default())),
        ("CMA-ES", Method::CmaEs(cma)),
        ("CMA-ES with resampling", Method::CmaEs(resampling)),
    ]
}

/// A search on the calling thread.
fn search(method: &Method, budget: usize) -> Search {
    Search { method: method.clone(), budget, threads: 1, seed: 11, ..Search::default() }
}

/// A report without the time it took.
fn timeless(mut report: SearchReport) -> SearchReport {
    report.elapsed = Duration::ZERO;
    report
}

/// Sum of squares, shifted: the minimum 0 stands at `0.3, 0.3, ...`.
fn sphere(x: &[f64]) -> f64 {
    x.iter().map(|x| (x - 0.3).powi(2)).sum()
}

/// Value of Rastrigin's function, minimum 0 at the origin, about `10^n` minima in `[-5.12, 5.12]^n`.
fn rastrigin(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x - 10.0 * (std::f64::consts::TAU * x).cos() + 10.0).sum()
}
