//! Cooperation of a particle swarm, an ant colony and a genetic algorithm, the search layer of Alami Naeini and Roshanian (2014).
//!
//! One cycle has six steps:
//!
//! 1. The swarm goes on for `nPSO` generations.
//! 2. The colony goes on for `nACO` generations.
//! 3. The genetic algorithm goes on for `nGA` generations.
//! 4. The best `nPtoG` of the swarm's points and the best `nAtoG` of the colony's archive go to the genetic algorithm, in place of
//!    its worst members.
//! 5. The best `nGtoA` members of the genetic algorithm go to the colony, in place of the worst of its archive.
//! 6. The best `nGtoP` members of the genetic algorithm go to the swarm, in place of its worst particles, which start there at rest.
//!
//! Members are copied before any arrives, so that the steps 4 to 6 have no order, and swarm and colony learn of each other
//! through the genetic algorithm alone, one cycle later. A migrant that is no better than whom it would replace, or is there
//! already, is dropped. That is [`Exchange::AfterCycle`]. The paper's own order is [`Exchange::AtOnce`]: the migrants of step 4 form the
//! population of the genetic algorithm with the best of its last generation before step 3, so that it hears of swarm and colony in the same
//! cycle; and whoever is sent replaces one of the worst without condition.

use crate::error::require;
use crate::{
    Algorithm, AntColony, AntColonySettings, Candidate, Convergence, Evaluation, Generator, Genetic,
    GeneticSettings, ParticleSwarm, ParticleSwarmSettings, Points, Population, SearchError, Task,
};
use serde::{Deserialize, Serialize};

/// The time and the rule of the exchange between the three algorithms of a cooperation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Exchange {
    /// After all three have had their turn; migrants that are better replace the worst.
    #[default]
    AfterCycle,
    /// The genetic algorithm takes in the best of swarm and colony before its turn, and sends its best behind it; migrants replace the worst
    /// without condition (Alami Naeini and Roshanian 2014).
    AtOnce,
}

/// Settings of the cooperation. The numbers of the paper stand in quotes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CooperationSettings {
    /// The swarm; default 30 particles.
    pub swarm: ParticleSwarmSettings,
    /// The colony; default an archive of 30 and 30 ants.
    pub colony: AntColonySettings,
    /// The genetic algorithm; default 30 members.
    pub genetic: GeneticSettings,
    /// "nPSO", generations of the swarm in a cycle; default 5. With 0 it takes no part.
    pub swarm_generations: usize,
    /// "nACO", generations of the colony in a cycle; default 5. With 0 it takes no part.
    pub colony_generations: usize,
    /// "nGA", generations of the genetic algorithm in a cycle; default 5. With 0 it takes no part.
    pub genetic_generations: usize,
    /// "nPtoG", points from the swarm to the genetic algorithm; default 6.
    pub swarm_to_genetic: usize,
    /// "nAtoG", points from the colony to the genetic algorithm; default 6.
    pub colony_to_genetic: usize,
    /// "nGtoA", members of the genetic algorithm to the colony; default 6.
    pub genetic_to_colony: usize,
    /// "nGtoP", members of the genetic algorithm to the swarm; default 6.
    pub genetic_to_swarm: usize,
    /// Time and rule of the exchange; default after the cycle.
    #[serde(default)]
    pub exchange: Exchange,
}

impl Default for CooperationSettings {
    fn default() -> Self {
        const MEMBERS: usize = 30;
        Self {
            swarm: ParticleSwarmSettings { particles: MEMBERS, ..Default::default() },
            colony: AntColonySettings { archive: MEMBERS, ants: MEMBERS, ..Default::default() },
            genetic: GeneticSettings { population: MEMBERS, ..Default::default() },
            swarm_generations: 5,
            colony_generations: 5,
            genetic_generations: 5,
            swarm_to_genetic: 6,
            colony_to_genetic: 6,
            genetic_to_colony: 6,
            genetic_to_swarm: 6,
            exchange: Exchange::AfterCycle,
        }
    }
}

/// Whose generations are next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Turn {
    Swarm,
    Colony,
    Genetic,
}

/// The cooperation of three algorithms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cooperation {
    settings: CooperationSettings,
    swarm: ParticleSwarm,
    colony: AntColony,
    genetic: Genetic,
    turn: Turn,
    /// Generations of this turn that are over.
    done: usize,
    to_genetic: Population,
    to_colony: Population,
    to_swarm: Population,
    best: Option<Candidate>,
}

impl Cooperation {
    /// Three populations with random points of their own.
    ///
    /// # Errors
    /// Settings out of range, and cycles without a generation.
    pub fn new(settings: &CooperationSettings, task: &Task<'_>) -> Result<Self, SearchError> {
        let s = settings;
        let longest = s.swarm_generations.max(s.colony_generations).max(s.genetic_generations);
        require("cooperation: generations of a cycle", longest as f64, longest > 0, "at least 1 is needed")?;
        let mut seeds = Generator::new(task.seed);
        let mut own = || Task { seed: seeds.seed(), ..task.clone() };
        let dimension = task.space.dimension();
        let mut cooperation = Self {
            swarm: ParticleSwarm::new(&s.swarm, &own())?,
            colony: AntColony::new(&s.colony, &own())?,
            genetic: Genetic::new(&s.genetic, &own())?,
            settings: s.clone(),
            turn: Turn::Swarm,
            done: 0,
            to_genetic: Population::new(dimension),
            to_colony: Population::new(dimension),
            to_swarm: Population::new(dimension),
            best: None,
        };
        cooperation.settle_turn();
        Ok(cooperation)
    }

    /// Generations of a turn.
    fn length(&self, turn: Turn) -> usize {
        match turn {
            Turn::Swarm => self.settings.swarm_generations,
            Turn::Colony => self.settings.colony_generations,
            Turn::Genetic => self.settings.genetic_generations,
        }
    }

    /// The next turn that has generations left; an exchange after the last turn of a cycle.
    fn settle_turn(&mut self) {
        while self.done >= self.length(self.turn) {
            self.done = 0;
            self.turn = match self.turn {
                Turn::Swarm => Turn::Colony,
                Turn::Colony => {
                    if self.settings.exchange == Exchange::AtOnce {
                        self.form_population();
                    }
                    Turn::Genetic
                }
                Turn::Genetic => {
                    match self.settings.exchange {
                        Exchange::AfterCycle => self.exchange(),
                        Exchange::AtOnce => self.send_back(),
                    }
                    Turn::Swarm
                }
            };
        }
    }

    /// Step 4 before step 3: the best of swarm and colony, and the best of the last generation.
    fn form_population(&mut self) {
        let Self { settings, to_genetic, .. } = self;
        to_genetic.clear();
        self.swarm.emigrants(settings.swarm_to_genetic, to_genetic);
        self.colony.emigrants(settings.colony_to_genetic, to_genetic);
        self.genetic.take_in(to_genetic);
    }

    /// Steps 5 and 6 without condition.
    fn send_back(&mut self) {
        let Self { settings, to_colony, to_swarm, .. } = self;
        to_colony.clear();
        to_swarm.clear();
        self.genetic.emigrants(settings.genetic_to_colony, to_colony);
        self.genetic.emigrants(settings.genetic_to_swarm, to_swarm);
        self.colony.take_in(to_colony);
        self.swarm.take_in(to_swarm);
    }

    /// Steps 4 to 6.
    fn exchange(&mut self) {
        let Self { settings, to_genetic, to_colony, to_swarm, .. } = self;
        to_genetic.clear();
        to_colony.clear();
        to_swarm.clear();
        self.swarm.emigrants(settings.swarm_to_genetic, to_genetic);
        self.colony.emigrants(settings.colony_to_genetic, to_genetic);
        self.genetic.emigrants(settings.genetic_to_colony, to_colony);
        self.genetic.emigrants(settings.genetic_to_swarm, to_swarm);
        self.genetic.immigrate(to_genetic);
        self.colony.immigrate(to_colony);
        self.swarm.immigrate(to_swarm);
    }

    /// Those that take part.
    fn members(&self) -> impl Iterator<Item = &dyn Algorithm> {
        let all: [(&dyn Algorithm, usize); 3] = [
            (&self.swarm, self.settings.swarm_generations),
            (&self.colony, self.settings.colony_generations),
            (&self.genetic, self.settings.genetic_generations),
        ];
        all.into_iter().filter(|(_, generations)| *generations > 0).map(|(member, _)| member)
    }

    fn active(&mut self) -> &mut dyn Algorithm {
        match self.turn {
            Turn::Swarm => &mut self.swarm,
            Turn::Colony => &mut self.colony,
            Turn::Genetic => &mut self.genetic,
        }
    }
}

impl Algorithm for Cooperation {
    fn ask(&mut self, points: &mut Points) {
        self.active().ask(points);
    }

    fn tell(&mut self, points: &Points, evaluations: &[Evaluation]) {
        for (x, evaluation) in points.rows().zip(evaluations) {
            Candidate::improve(&mut self.best, x, evaluation);
        }
        self.active().tell(points, evaluations);
        self.done += 1;
        self.settle_turn();
    }

    fn best(&self) -> Option<&Candidate> {
        self.best.as_ref()
    }

    /// The best `count` of all three populations.
    fn emigrants(&self, count: usize, into: &mut Population) {
        let first = into.len();
        self.members().for_each(|member| member.emigrants(count, into));
        into.keep_best(first, count);
    }

    /// All three take the migrants in.
    fn immigrate(&mut self, migrants: &Population) {
        for (x, evaluation) in migrants.iter() {
            Candidate::improve(&mut self.best, x, evaluation);
        }
        self.swarm.immigrate(migrants);
        self.colony.immigrate(migrants);
        self.genetic.immigrate(migrants);
    }

    /// The largest of the three.
    fn spread(&self) -> f64 {
        self.members().map(Algorithm::spread).fold(0.0, f64::max)
    }

    /// It has converged when all three have.
    fn converged(&self) -> Option<Convergence> {
        self.members().map(Algorithm::converged).reduce(|all, one| all.and(one)).flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SearchSpace;

    /// Turns of the generations of a cooperation on a sphere, and the cooperation.
    fn turns(settings: &CooperationSettings, generations: usize) -> (Vec<Turn>, Cooperation) {
        let space = SearchSpace::cube(3, -5.0, 5.0).expect("a box");
        let task = Task { space: &space, start: &Points::new(3), seed: 2, budget: 1000 };
        let mut cooperation = Cooperation::new(settings, &task).expect("a cooperation");
        let mut points = Points::new(3);
        let turns = (0..generations).map(|_| {
            let turn = cooperation.turn;
            cooperation.ask(&mut points);
            let sphere = |x: &[f64]| Evaluation::new(x.iter().map(|x| x * x).sum());
            let evaluations: Vec<_> = points.rows().map(sphere).collect();
            cooperation.tell(&points, &evaluations);
            turn
        });
        let turns = turns.collect();
        (turns, cooperation)
    }

    #[test]
    fn turns_have_their_lengths() {
        let lengths = |swarm_generations, colony_generations, genetic_generations| CooperationSettings {
            swarm_generations,
            colony_generations,
            genetic_generations,
            ..Default::default()
        };
        use Turn::{Colony, Genetic, Swarm};
        assert_eq!(turns(&lengths(2, 1, 1), 5).0, [Swarm, Swarm, Colony, Genetic, Swarm]);
        assert_eq!(turns(&lengths(0, 1, 2), 5).0, [Colony, Genetic, Genetic, Colony, Genetic]);
        assert_eq!(turns(&lengths(0, 0, 1), 2).0, [Genetic, Genetic]);
    }

    /// Before its turn the genetic algorithm has the best of the others, and behind it they have its best, whether better or not.
    #[test]
    fn at_once_the_population_is_formed_before_the_turn() {
        let settings = CooperationSettings {
            swarm_generations: 1,
            colony_generations: 1,
            genetic_generations: 1,
            swarm_to_genetic: 4,
            colony_to_genetic: 3,
            genetic_to_colony: 2,
            genetic_to_swarm: 5,
            exchange: Exchange::AtOnce,
            ..Default::default()
        };
        let all = |algorithm: &dyn Algorithm| {
            let mut members = Population::new(3);
            algorithm.emigrants(100, &mut members);
            members
        };
        let common = |a: &Population, b: &Population| {
            a.points.rows().filter(|x| b.points.rows().any(|y| y == *x)).count()
        };
        // After the second cycle's swarm and colony: both have sent.
        let (_, c) = turns(&settings, 5);
        assert_eq!(c.turn, Turn::Genetic);
        let (swarm, colony, genetic) = (all(&c.swarm), all(&c.colony), all(&c.genetic));
        assert_eq!([swarm.len(), colony.len(), genetic.len()], [30; 3]);
        assert!(common(&swarm, &genetic) >= 4 && common(&colony, &genetic) >= 3);
        // After the turn of the genetic algorithm: its best two and five are with the others.
        let (_, c) = turns(&settings, 6);
        assert_eq!(c.turn, Turn::Swarm);
        let mut best = Population::new(3);
        c.genetic.emigrants(5, &mut best);
        assert_eq!(common(&best, &all(&c.swarm)), 5);
        assert!(common(&best, &all(&c.colony)) >= 2);
        // In the first cycle the genetic algorithm has no generation yet: its first one begins with what was sent.
        let (_, mut c) = turns(&settings, 2);
        let mut first = Points::new(3);
        c.ask(&mut first);
        let mut sent = Population::new(3);
        c.swarm.emigrants(4, &mut sent);
        assert_eq!(sent.points.rows().filter(|x| first.rows().any(|y| y == *x)).count(), 4);
    }

    #[test]
    fn the_best_is_sent_as_the_numbers_say() {
        let base = CooperationSettings {
            swarm_generations: 1,
            colony_generations: 1,
            genetic_generations: 1,
            swarm_to_genetic: 0,
            colony_to_genetic: 0,
            genetic_to_colony: 0,
            genetic_to_swarm: 0,
            ..Default::default()
        };
        let all = |algorithm: &dyn Algorithm| {
            let mut members = Population::new(3);
            algorithm.emigrants(100, &mut members);
            members
        };
        let common = |a: &Population, b: &Population| {
            a.points.rows().filter(|x| b.points.rows().any(|y| y == *x)).count()
        };
        let count = |settings: &CooperationSettings| {
            let (_, c) = turns(settings, 3);
            let (swarm, colony, genetic) = (all(&c.swarm), all(&c.colony), all(&c.genetic));
            assert_eq!([swarm.len(), colony.len(), genetic.len()], [30; 3]);
            [common(&swarm, &genetic), common(&colony, &genetic), common(&swarm, &colony)]
        };
        assert_eq!(count(&base), [0, 0, 0]);
        assert_eq!(count(&CooperationSettings { swarm_to_genetic: 4, ..base.clone() }), [4, 0, 0]);
        assert_eq!(count(&CooperationSettings { colony_to_genetic: 3, ..base.clone() }), [0, 3, 0]);
        assert_eq!(count(&CooperationSettings { genetic_to_swarm: 5, ..base.clone() }), [5, 0, 0]);
        assert_eq!(count(&CooperationSettings { genetic_to_colony: 2, ..base.clone() }), [0, 2, 0]);
        // What the genetic algorithm sends, it chose before anything came in: the two exchanges are of different points.
        let both = CooperationSettings { swarm_to_genetic: 4, genetic_to_swarm: 5, ..base };
        assert_eq!(count(&both), [9, 0, 0]);
    }
}
