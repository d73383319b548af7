//! Particle swarm optimisation (Kennedy and Eberhart 1995).
//!
//! ```text
//! v <- w v + c1 r1 (p - x) + c2 r2 (l - x),   x <- x + v
//! ```
//!
//! with the particle's best point `p`, the best point `l` of its neighbours, and `r1`, `r2` uniform in [0, 1) for each coordinate.
//! Inertia (Shi and Eberhart 1998) lowers `w` along the budget; constriction (Clerc and Kennedy 2002) multiplies the whole
//! velocity by `chi = 2 / |2 - phi - sqrt(phi^2 - 4 phi)|` with `phi = c1 + c2 > 4`.

use crate::algorithm::require_population;
use crate::error::require;
use crate::{
    Algorithm, Candidate, Convergence, Evaluation, Generator, Points, Population, SearchError, SearchSpace,
    Task,
};
use serde::{Deserialize, Serialize};

/// The method that keeps velocities from growing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Damping {
    /// The factor of the old velocity goes linearly from `first` to `last` along the budget.
    Inertia {
        /// Factor at the first generation; 0.9 is common.
        first: f64,
        /// Factor at the end of the budget; 0.4 is common.
        last: f64,
    },
    /// The factor of Clerc and Kennedy on the whole velocity; the sum of both accelerations is above 4.
    Constriction,
}

/// The particles that share their best point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Neighbourhood {
    /// All of them: fast, and more easily caught in a local minimum.
    Global,
    /// Those next to each other on a ring.
    Ring {
        /// Neighbours on either side, at least 1.
        reach: usize,
    },
}

/// Settings of a particle swarm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParticleSwarmSettings {
    /// Number of particles, at least 2; default 40.
    pub particles: usize,
    /// Default constriction.
    pub damping: Damping,
    /// Acceleration `c1` to the particle's own best point; default 2.05.
    pub cognitive: f64,
    /// Acceleration `c2` to the best point of the neighbours; default 2.05.
    pub social: f64,
    /// Default a ring with 2 neighbours on either side.
    pub neighbourhood: Neighbourhood,
    /// Largest velocity as a part of the box; default 0.5.
    pub largest_velocity: f64,
}

impl Default for ParticleSwarmSettings {
    fn default() -> Self {
        Self {
            particles: 40,
            damping: Damping::Constriction,
            cognitive: 2.05,
            social: 2.05,
            neighbourhood: Neighbourhood::Ring { reach: 2 },
            largest_velocity: 0.5,
        }
    }
}

/// A particle swarm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParticleSwarm {
    settings: ParticleSwarmSettings,
    space: SearchSpace,
    generator: Generator,
    budget: usize,
    evaluations: usize,
    positions: Points,
    velocities: Points,
    /// The best point of each particle.
    memory: Population,
    best: Option<Candidate>,
}

impl ParticleSwarm {
    /// Lets migrants, which start at rest, be as many of its worst particles, whether they are better or not.
    pub(crate) fn take_in(&mut self, migrants: &Population) {
        let mut order: Vec<usize> = (0..self.memory.len()).collect();
        let evaluations = &self.memory.evaluations;
        order.sort_by(|&i, &j| evaluations[j].order(&evaluations[i]));
        for (particle, (x, evaluation)) in order.into_iter().zip(migrants.iter()) {
            Candidate::improve(&mut self.best, x, evaluation);
            self.memory.set(particle, x, *evaluation);
            self.positions.row_mut(particle).copy_from_slice(x);
            self.velocities.row_mut(particle).fill(0.0);
        }
    }

    /// A swarm at rest at random points.
    ///
    /// # Errors
    /// Fewer than 2 particles and settings out of range.
    pub fn new(settings: &ParticleSwarmSettings, task: &Task<'_>) -> Result<Self, SearchError> {
        let s = settings;
        require_population("particle swarm", s.particles, 2)?;
        let pull = s.cognitive + s.social;
        require("particle swarm: cognitive", s.cognitive, s.cognitive >= 0.0, "at least 0 is needed")?;
        require("particle swarm: social", s.social, s.social >= 0.0, "at least 0 is needed")?;
        let (v, allowed) = (s.largest_velocity, "above 0 and at most 1 is needed");
        require("particle swarm: largest_velocity", v, v > 0.0 && v <= 1.0, allowed)?;
        match s.damping {
            Damping::Constriction => {
                let allowed = "above 4 and finite is needed";
                require("particle swarm: cognitive + social", pull, pull > 4.0 && pull.is_finite(), allowed)?;
            }
            Damping::Inertia { first, last } => {
                for (name, w) in
                    [("particle swarm: first inertia", first), ("particle swarm: last inertia", last)]
                {
                    require(name, w, (0.0..=1.0).contains(&w), "0 to 1 is needed")?;
                }
            }
        }
        if let Neighbourhood::Ring { reach } = s.neighbourhood {
            require("particle swarm: reach", reach as f64, reach > 0, "at least 1 is needed")?;
        }
        let dimension = task.space.dimension();
        let mut generator = Generator::new(task.seed);
        let positions = task.first_points(s.particles, &mut generator);
        let mut velocities = Points::new(dimension);
        (0..s.particles).for_each(|_| {
            velocities.add();
        });
        Ok(Self {
            settings: s.clone(),
            space: task.space.clone(),
            generator,
            budget: task.budget,
            evaluations: 0,
            positions,
            velocities,
            memory: Population::new(dimension),
            best: None,
        })
    }

    /// The particle with the best memory among one and its neighbours.
    fn leader(&self, particle: usize, reach: usize) -> usize {
        let count = self.memory.len();
        let mut leader = particle;
        for step in 1..=reach.min(count / 2) {
            for other in [(particle + step) % count, (particle + count - step) % count] {
                if self.memory.evaluations[other].is_better_than(&self.memory.evaluations[leader]) {
                    leader = other;
                }
            }
        }
        leader
    }

    /// Factor of the old velocity and factor of the whole.
    fn factors(&self) -> (f64, f64) {
        match self.settings.damping {
            Damping::Inertia { first, last } => {
                let done = (self.evaluations as f64 / self.budget.max(1) as f64).min(1.0);
                (first + (last - first) * done, 1.0)
            }
            Damping::Constriction => {
                let phi = self.settings.cognitive + self.settings.social;
                (1.0, 2.0 / (2.0 - phi - (phi * phi - 4.0 * phi).sqrt()).abs())
            }
        }
    }

    fn fly(&mut self) {
        let (inertia, factor) = self.factors();
        let (cognitive, social) = (self.settings.cognitive, self.settings.social);
        let global = self.memory.best().unwrap_or(0);
        for particle in 0..self.memory.len() {
            let leader = match self.settings.neighbourhood {
                Neighbourhood::Global => global,
                Neighbourhood::Ring { reach } => self.leader(particle, reach),
            };
            let (own, led) = (self.memory.points.row(particle), self.memory.points.row(leader));
            let (x, v) = (self.positions.row_mut(particle), self.velocities.row_mut(particle));
            for i in 0..x.len() {
                let limit = self.settings.largest_velocity * self.space.width(i);
                let (r1, r2) = (self.generator.uniform(), self.generator.uniform());
                let pull = cognitive * r1 * (own[i] - x[i]) + social * r2 * (led[i] - x[i]);
                v[i] = (factor * (inertia * v[i] + pull)).clamp(-limit, limit);
                let target = x[i] + v[i];
                x[i] = self.space.reflect(i, target);
                if x[i] != target {
                    v[i] *= -0.5;
                }
            }
        }
    }
}

impl Algorithm for ParticleSwarm {
    fn ask(&mut self, points: &mut Points) {
        if !self.memory.is_empty() {
            self.fly();
        }
        points.clear();
        points.extend(&self.positions);
    }

    fn tell(&mut self, points: &Points, evaluations: &[Evaluation]) {
        self.evaluations += evaluations.len();
        for (k, (x, evaluation)) in points.rows().zip(evaluations).enumerate() {
            Candidate::improve(&mut self.best, x, evaluation);
            if k == self.memory.len() {
                self.memory.push(x, *evaluation);
            } else if evaluation.is_better_than(&self.memory.evaluations[k]) {
                self.memory.set(k, x, *evaluation);
            }
        }
    }

    fn best(&self) -> Option<&Candidate> {
        self.best.as_ref()
    }

    fn emigrants(&self, count: usize, into: &mut Population) {
        self.memory.copy_best(count, into);
    }

    fn immigrate(&mut self, migrants: &Population) {
        for (x, evaluation) in migrants.iter() {
            Candidate::improve(&mut self.best, x, evaluation);
        }
        let (positions, velocities, memory) = (&mut self.positions, &mut self.velocities, &mut self.memory);
        memory.replace_worst(migrants, |particle, x| {
            positions.row_mut(particle).copy_from_slice(x);
            velocities.row_mut(particle).fill(0.0);
        });
    }

    fn spread(&self) -> f64 {
        self.positions.spread(&self.space)
    }

    fn converged(&self) -> Option<Convergence> {
        // Points at rest at one place, where all of them have been best, move no more.
        (!self.memory.is_empty()
            && self.positions.coincide(&self.space)
            && self.memory.points.coincide(&self.space)
            && self.velocities.values().iter().all(|&v| v == 0.0))
        .then_some(Convergence::Spread)
    }
}
