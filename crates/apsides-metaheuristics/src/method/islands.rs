//! Islands: several algorithms side by side that send each other their best points from time to time.

use crate::error::require;
use crate::{
    Algorithm, Candidate, Convergence, Engine, Evaluation, Generator, Method, Points, Population,
    SearchError, Task,
};
use serde::{Deserialize, Serialize};

/// The pairs of islands of which one sends to the other.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Topology {
    /// Each island to the next, the last to the first.
    Ring,
    /// Each to all others.
    Full,
    /// The first island to all others, and they to the first.
    Star,
    /// A list for each island of those it sends to, by index from 0.
    Custom(Vec<Vec<usize>>),
}

/// Settings of islands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IslandsSettings {
    /// The algorithm of each island, at least 1, also islands themselves; default four particle swarms.
    pub islands: Vec<Method>,
    /// Default a ring.
    pub topology: Topology,
    /// Generations between migrations, at least 1; default 10.
    pub interval: usize,
    /// Points that an island sends to each neighbour; default 1. With 0 the islands are alone.
    pub migrants: usize,
    /// Probability that an island sends at a migration; default 1.
    pub probability: f64,
}

impl Default for IslandsSettings {
    fn default() -> Self {
        Self {
            islands: vec![Method::default(); 4],
            topology: Topology::Ring,
            interval: 10,
            migrants: 1,
            probability: 1.0,
        }
    }
}

/// Algorithms side by side. One generation is one of every island.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Islands {
    islands: Vec<Engine>,
    /// Islands that each sends to.
    neighbours: Vec<Vec<usize>>,
    interval: usize,
    migrants: usize,
    probability: f64,
    generator: Generator,
    generations: usize,
    /// Points of each island in the present generation.
    parts: Vec<Points>,
    /// The members that each island sends.
    sent: Vec<Population>,
    best: Option<Candidate>,
}

impl Islands {
    /// Islands with random points of their own.
    ///
    /// # Errors
    /// No islands, settings of one of them out of range, and a list of neighbours that is not one for each island or names
    /// islands that are not there.
    pub fn new(settings: &IslandsSettings, task: &Task<'_>) -> Result<Self, SearchError> {
        let s = settings;
        let count = s.islands.len();
        require("islands: number of islands", count as f64, count > 0, "at least 1 is needed")?;
        require("islands: interval", s.interval as f64, s.interval > 0, "at least 1 is needed")?;
        let p = s.probability;
        require("islands: probability", p, (0.0..=1.0).contains(&p), "0 to 1 is needed")?;
        let mut generator = Generator::new(task.seed);
        // Settings that follow the budget see the share of one island.
        let budget = (task.budget / count).max(1);
        let islands = s.islands.iter().map(|method| {
            let own = Task { seed: generator.seed(), budget, ..task.clone() };
            method.start(&own)
        });
        let dimension = task.space.dimension();
        Ok(Self {
            islands: islands.collect::<Result<_, _>>()?,
            neighbours: neighbours(&s.topology, count)?,
            interval: s.interval,
            migrants: s.migrants,
            probability: s.probability,
            generator,
            generations: 0,
            parts: vec![Points::new(dimension); count],
            sent: vec![Population::new(dimension); count],
            best: None,
        })
    }

    fn migrate(&mut self) {
        for (island, sent) in self.islands.iter().zip(&mut self.sent) {
            sent.clear();
            if self.generator.chance(self.probability) {
                island.emigrants(self.migrants, sent);
            }
        }
        for (sent, neighbours) in self.sent.iter().zip(&self.neighbours) {
            for &neighbour in neighbours {
                self.islands[neighbour].immigrate(sent);
            }
        }
    }
}

/// Islands that each of `count` sends to.
fn neighbours(topology: &Topology, count: usize) -> Result<Vec<Vec<usize>>, SearchError> {
    let others = |island: usize| (0..count).filter(move |&other| other != island);
    Ok(match topology {
        Topology::Ring => {
            let next = |island: usize| (island + 1) % count;
            (0..count).map(|i| others(i).filter(|&other| other == next(i)).collect()).collect()
        }
        Topology::Full => (0..count).map(|i| others(i).collect()).collect(),
        Topology::Star => {
            (0..count).map(|i| others(i).filter(|&other| i == 0 || other == 0).collect()).collect()
        }
        Topology::Custom(lists) => {
            let lengths = lists.len() as f64;
            require(
                "islands: lists of neighbours",
                lengths,
                lists.len() == count,
                "one for each island is needed",
            )?;
            for &neighbour in lists.iter().flatten() {
                let allowed = "the index of an island, from 0, is needed";
                require("islands: neighbour", neighbour as f64, neighbour < count, allowed)?;
            }
            lists.clone()
        }
    })
}

impl Algorithm for Islands {
    fn ask(&mut self, points: &mut Points) {
        points.clear();
        for (island, part) in self.islands.iter_mut().zip(&mut self.parts) {
            island.ask(part);
            points.extend(part);
        }
    }

    fn tell(&mut self, points: &Points, evaluations: &[Evaluation]) {
        for (x, evaluation) in points.rows().zip(evaluations) {
            Candidate::improve(&mut self.best, x, evaluation);
        }
        let mut rest = evaluations;
        for (island, part) in self.islands.iter_mut().zip(&self.parts) {
            let (own, others) = rest.split_at(part.len());
            island.tell(part, own);
            rest = others;
        }
        self.generations += 1;
        if self.generations.is_multiple_of(self.interval) && self.migrants > 0 {
            self.migrate();
        }
    }

    fn best(&self) -> Option<&Candidate> {
        self.best.as_ref()
    }

    /// The best `count` of all islands.
    fn emigrants(&self, count: usize, into: &mut Population) {
        let first = into.len();
        self.islands.iter().for_each(|island| island.emigrants(count, into));
        into.keep_best(first, count);
    }

    /// All islands take the migrants in.
    fn immigrate(&mut self, migrants: &Population) {
        for (x, evaluation) in migrants.iter() {
            Candidate::improve(&mut self.best, x, evaluation);
        }
        self.islands.iter_mut().for_each(|island| island.immigrate(migrants));
    }

    /// The largest of all islands.
    fn spread(&self) -> f64 {
        self.islands.iter().map(Algorithm::spread).fold(0.0, f64::max)
    }

    /// It has converged when all islands have.
    fn converged(&self) -> Option<Convergence> {
        self.islands.iter().map(Algorithm::converged).reduce(|all, one| all.and(one)).flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ParticleSwarmSettings, SearchSpace};

    #[test]
    fn topologies() {
        let of = |topology| neighbours(&topology, 3).expect("a topology");
        assert_eq!(of(Topology::Ring), [[1], [2], [0]]);
        assert_eq!(of(Topology::Full), [[1, 2], [0, 2], [0, 1]]);
        assert_eq!(of(Topology::Star), [vec![1, 2], vec![0], vec![0]]);
        assert_eq!(neighbours(&Topology::Ring, 1).expect("a topology"), [[]; 1]);
        let bad =
            neighbours(&Topology::Custom(vec![vec![1], vec![2]]), 2).expect_err("island 2 is not there");
        assert_eq!(bad.to_string(), "islands: neighbour is 2; the index of an island, from 0, is needed");
        assert!(neighbours(&Topology::Custom(vec![vec![0]]), 2).is_err());
    }

    /// Islands that never move send one point along a chain, one island further at each migration.
    #[test]
    fn the_best_point_travels_along_the_lists() {
        let space = SearchSpace::cube(2, 0.0, 1.0).expect("a box");
        let swarm = ParticleSwarmSettings { particles: 4, largest_velocity: 1e-300, ..Default::default() };
        let settings = IslandsSettings {
            islands: vec![Method::ParticleSwarm(swarm); 4],
            topology: Topology::Custom(vec![vec![1], vec![2], vec![3], vec![]]),
            interval: 2,
            ..Default::default()
        };
        let task = Task { space: &space, start: &Points::new(2), seed: 1, budget: 1000 };
        let mut islands = Islands::new(&settings, &task).expect("islands");
        let mut points = Points::new(2);
        let mut best = Vec::new();
        for _ in 0..8 {
            islands.ask(&mut points);
            // The first particle of the first island is the best of all.
            let marked = |(k, x): (usize, &[f64])| Evaluation::new(if k == 0 { -1.0 } else { x[0] });
            let evaluations: Vec<_> = points.rows().enumerate().map(marked).collect();
            islands.tell(&points, &evaluations);
            let value = |e: &Engine| e.best().expect("a best point").evaluation.objective;
            best.push(islands.islands.iter().filter(|e| value(e) == -1.0).count());
        }
        assert_eq!(best, [1, 2, 2, 3, 3, 4, 4, 4]);
    }
}
