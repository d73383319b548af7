//! The choice of an algorithm, and any of them behind one type that can be saved.

mod islands;

pub use islands::{Islands, IslandsSettings, Topology};

use crate::{
    Algorithm, Annealing, AnnealingSettings, AntColony, AntColonySettings, Candidate, CmaEs, CmaEsSettings,
    Convergence, Cooperation, CooperationSettings, DifferentialEvolution, DifferentialEvolutionSettings,
    Evaluation, Genetic, GeneticSettings, ParticleSwarm, ParticleSwarmSettings, Points, Population,
    SearchError, Task,
};
use serde::{Deserialize, Serialize};

/// An algorithm with its settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Method {
    /// Genetic algorithm.
    Genetic(GeneticSettings),
    /// Particle swarm.
    ParticleSwarm(ParticleSwarmSettings),
    /// Ant colony.
    AntColony(AntColonySettings),
    /// Simulated annealing.
    SimulatedAnnealing(AnnealingSettings),
    /// Particle swarm, ant colony and genetic algorithm that exchange their best.
    Cooperation(CooperationSettings),
    /// Any of these side by side.
    Islands(IslandsSettings),
    /// Differential evolution.
    DifferentialEvolution(DifferentialEvolutionSettings),
    /// Covariance matrix adaptation.
    CmaEs(CmaEsSettings),
}

impl Default for Method {
    fn default() -> Self {
        Self::ParticleSwarm(ParticleSwarmSettings::default())
    }
}

impl Method {
    /// The algorithm before its first generation.
    ///
    /// # Errors
    /// Settings out of range.
    pub fn start(&self, task: &Task<'_>) -> Result<Engine, SearchError> {
        Ok(match self {
            Self::Genetic(settings) => Engine::Genetic(Genetic::new(settings, task)?),
            Self::ParticleSwarm(settings) => Engine::ParticleSwarm(ParticleSwarm::new(settings, task)?),
            Self::AntColony(settings) => Engine::AntColony(AntColony::new(settings, task)?),
            Self::SimulatedAnnealing(settings) => Engine::SimulatedAnnealing(Annealing::new(settings, task)?),
            Self::Cooperation(settings) => Engine::Cooperation(Box::new(Cooperation::new(settings, task)?)),
            Self::Islands(settings) => Engine::Islands(Islands::new(settings, task)?),
            Self::DifferentialEvolution(settings) => {
                Engine::DifferentialEvolution(DifferentialEvolution::new(settings, task)?)
            }
            Self::CmaEs(settings) => Engine::CmaEs(Box::new(CmaEs::new(settings, task)?)),
        })
    }
}

/// Any algorithm of this crate with its whole state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Engine {
    /// Genetic algorithm.
    Genetic(Genetic),
    /// Particle swarm.
    ParticleSwarm(ParticleSwarm),
    /// Ant colony.
    AntColony(AntColony),
    /// Simulated annealing.
    SimulatedAnnealing(Annealing),
    /// Particle swarm, ant colony and genetic algorithm that exchange their best.
    Cooperation(Box<Cooperation>),
    /// Any of these side by side.
    Islands(Islands),
    /// Differential evolution.
    DifferentialEvolution(DifferentialEvolution),
    /// Covariance matrix adaptation.
    CmaEs(Box<CmaEs>),
}

/// The same expression for whichever algorithm it is.
macro_rules! each {
    ($engine:expr, $algorithm:ident => $expression:expr) => {
        match $engine {
            Engine::Genetic($algorithm) => $expression,
            Engine::ParticleSwarm($algorithm) => $expression,
            Engine::AntColony($algorithm) => $expression,
            Engine::SimulatedAnnealing($algorithm) => $expression,
            Engine::Cooperation($algorithm) => $expression,
            Engine::Islands($algorithm) => $expression,
            Engine::DifferentialEvolution($algorithm) => $expression,
            Engine::CmaEs($algorithm) => $expression,
        }
    };
}

impl Algorithm for Engine {
    fn ask(&mut self, points: &mut Points) {
        each!(self, a => a.ask(points));
    }

    fn tell(&mut self, points: &Points, evaluations: &[Evaluation]) {
        each!(self, a => a.tell(points, evaluations));
    }

    fn best(&self) -> Option<&Candidate> {
        each!(self, a => a.best())
    }

    fn emigrants(&self, count: usize, into: &mut Population) {
        each!(self, a => a.emigrants(count, into));
    }

    fn immigrate(&mut self, migrants: &Population) {
        each!(self, a => a.immigrate(migrants));
    }

    fn spread(&self) -> f64 {
        each!(self, a => a.spread())
    }

    fn converged(&self) -> Option<Convergence> {
        each!(self, a => a.converged())
    }
}
