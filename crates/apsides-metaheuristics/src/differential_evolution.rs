//! Differential evolution (Storn and Price 1997, <https://doi.org/10.1023/A:1008202821328>).
//!
//! Each member `x` has a trial point made of differences between members, which takes its place if it is not worse:
//!
//! ```text
//! v = b + F_l (l - b) + F (p - q),   u_j = v_j where a random number is below CR and for one random j, else x_j
//! ```
//!
//! with base `b`, leader `l` and the difference of two random members `p`, `q` as [`DifferentialMutation`] says, and with `F` and
//! `CR` as [`DifferentialAdaptation`] says. The default is L-SHADE.

mod control;

use crate::algorithm::require_population;
use crate::error::require;
use crate::{
    Algorithm, Candidate, Convergence, Evaluation, Generator, Points, Population, SearchError, SearchSpace,
    Task,
};
use control::Control;
use serde::{Deserialize, Serialize};

/// The points that trial points are made of; all but the first three letters are members at random.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum DifferentialMutation {
    /// `r + F (p - q)`: slow and thorough.
    Rand,
    /// `best + F (p - q)`: fast, and easily caught in a local minimum.
    Best,
    /// `x + F (best - x) + F (p - q)`.
    CurrentToBest,
    /// `x + F (l - x) + F (p - q)` with `l` among the best, and `q` a member or one that was replaced
    /// (JADE: Zhang and Sanderson 2009, <https://doi.org/10.1109/TEVC.2009.2014613>).
    CurrentToPBest {
        /// Part of the population that `l` is among, above 0 and at most 1; two members at least.
        part: f64,
    },
}

/// The source of the factor `F` and the crossover rate `CR`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum DifferentialAdaptation {
    /// The same for all.
    Fixed {
        /// `F`, above 0 and at most 2; 0.5 is common.
        factor: f64,
        /// `CR`, 0 to 1; 0.9 is common where variables depend on each other.
        crossover: f64,
    },
    /// jDE (Brest et al. 2006, <https://doi.org/10.1109/TEVC.2006.872133>): each member has its own, which change at random with
    /// a probability of 0.1 each, and stay with a trial that succeeds.
    SelfAdaptive,
    /// L-SHADE (Tanabe and Fukunaga 2014, <https://doi.org/10.1109/CEC.2014.6900380>): drawn near those that succeeded before,
    /// while the population shrinks linearly along the budget to its last 4 members.
    SuccessHistory {
        /// Entries of the memory, at least 1; the authors take 6.
        memory: usize,
        /// Members of the archive of replaced points as a multiple of the population, at least 0; the authors take 2.6.
        archive: f64,
    },
}

/// The treatment of a coordinate outside of the box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum DifferentialBounds {
    /// Half way between the bound and the member that the trial is for.
    #[default]
    Midpoint,
    /// Mirrored at the bound.
    Reflection,
}

/// Settings of differential evolution.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DifferentialEvolutionSettings {
    /// Members of the population, at least 4. Default `None`: 18 for each coordinate with L-SHADE, else 100, as in the comparisons
    /// of Brest et al.
    pub population: Option<usize>,
    /// Default current to p-best with a part of 0.11, as in L-SHADE.
    pub mutation: DifferentialMutation,
    /// Default L-SHADE with the settings of its authors.
    pub adaptation: DifferentialAdaptation,
    /// Default midpoint.
    pub bounds: DifferentialBounds,
}

impl Default for DifferentialEvolutionSettings {
    fn default() -> Self {
        Self {
            population: None,
            mutation: DifferentialMutation::CurrentToPBest { part: 0.11 },
            adaptation: DifferentialAdaptation::SuccessHistory { memory: 6, archive: 2.6 },
            bounds: DifferentialBounds::Midpoint,
        }
    }
}

impl DifferentialEvolutionSettings {
    /// Storn and Price's rand/1 with `F = 0.5` and `CR = 0.9`.
    ///
    /// # Examples
    /// ```
    /// use apsides_metaheuristics::{DifferentialEvolutionSettings, Evaluation, Method, Search, SearchSpace};
    ///
    /// let space = SearchSpace::cube(2, -5.0, 5.0)?;
    /// let valley = |x: &[f64]| Evaluation::new((1.0 - x[0]).powi(2) + 100.0 * (x[1] - x[0] * x[0]).powi(2));
    /// for settings in [DifferentialEvolutionSettings::classic(), DifferentialEvolutionSettings::self_adaptive()] {
    ///     let search = Search {
    ///         method: Method::DifferentialEvolution(settings),
    ///         budget: 20_000,
    ///         target: Some(1e-6),
    ///         ..Search::default()
    ///     };
    ///     assert!(search.minimize(&space, &valley)?.best.is_some_and(|best| best.evaluation.objective <= 1e-6));
    /// }
    /// # Ok::<(), apsides_metaheuristics::SearchError>(())
    /// ```
    pub fn classic() -> Self {
        Self {
            mutation: DifferentialMutation::Rand,
            adaptation: DifferentialAdaptation::Fixed { factor: 0.5, crossover: 0.9 },
            ..Self::default()
        }
    }

    /// jDE: rand/1 with factors that adapt themselves.
    pub fn self_adaptive() -> Self {
        Self {
            mutation: DifferentialMutation::Rand,
            adaptation: DifferentialAdaptation::SelfAdaptive,
            ..Self::default()
        }
    }

    fn check(&self) -> Result<(), SearchError> {
        if let DifferentialMutation::CurrentToPBest { part } = self.mutation {
            let holds = part > 0.0 && part <= 1.0;
            require("differential evolution: part", part, holds, "above 0 and at most 1 is needed")?;
        }
        match self.adaptation {
            DifferentialAdaptation::Fixed { factor, crossover } => {
                let holds = factor > 0.0 && factor <= 2.0;
                require("differential evolution: factor", factor, holds, "above 0 and at most 2 is needed")?;
                let holds = (0.0..=1.0).contains(&crossover);
                require("differential evolution: crossover", crossover, holds, "0 to 1 is needed")?;
            }
            DifferentialAdaptation::SelfAdaptive => {}
            DifferentialAdaptation::SuccessHistory { memory, archive } => {
                let entries = memory as f64;
                require("differential evolution: memory", entries, memory > 0, "at least 1 is needed")?;
                let holds = (0.0..=100.0).contains(&archive);
                require("differential evolution: archive", archive, holds, "0 to 100 is needed")?;
            }
        }
        Ok(())
    }

    fn members(&self, dimension: usize) -> usize {
        self.population.unwrap_or(match self.adaptation {
            DifferentialAdaptation::Fixed { .. } | DifferentialAdaptation::SelfAdaptive => 100,
            DifferentialAdaptation::SuccessHistory { .. } => (18 * dimension).max(LEAST),
        })
    }
}

/// Three other members are needed for each.
const LEAST: usize = 4;

/// Differential evolution.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DifferentialEvolution {
    settings: DifferentialEvolutionSettings,
    space: SearchSpace,
    generator: Generator,
    budget: usize,
    evaluations: usize,
    /// Members of the first generation.
    initial: usize,
    /// The points of the first generation, until they are asked for.
    first: Points,
    population: Population,
    control: Control,
    /// Replaced members, and how many there may be.
    archive: Points,
    capacity: usize,
    /// Indices of members, the best `leaders` first.
    ranked: Vec<usize>,
    best: Option<Candidate>,
}

impl DifferentialEvolution {
    /// A population at random points.
    ///
    /// # Errors
    /// Fewer than 4 members and settings out of range.
    pub fn new(settings: &DifferentialEvolutionSettings, task: &Task<'_>) -> Result<Self, SearchError> {
        settings.check()?;
        let dimension = task.space.dimension();
        let initial = settings.members(dimension);
        require_population("differential evolution", initial, LEAST)?;
        let mut generator = Generator::new(task.seed);
        let first = task.first_points(initial, &mut generator);
        let mut new = Self {
            settings: settings.clone(),
            space: task.space.clone(),
            generator,
            budget: task.budget,
            evaluations: 0,
            initial,
            first,
            population: Population::new(dimension),
            control: Control::new(settings.adaptation, initial),
            archive: Points::new(dimension),
            capacity: 0,
            ranked: (0..initial).collect(),
            best: None,
        };
        new.capacity = new.archive_capacity(initial);
        Ok(new)
    }

    fn archive_capacity(&self, members: usize) -> usize {
        match self.settings.adaptation {
            DifferentialAdaptation::SuccessHistory { archive, .. } => {
                (archive * members as f64).round() as usize
            }
            _ if matches!(self.settings.mutation, DifferentialMutation::CurrentToPBest { .. }) => {
                self.initial
            }
            _ => 0,
        }
    }

    /// The number of members that may lead.
    fn leaders(&self) -> usize {
        match self.settings.mutation {
            DifferentialMutation::Rand => 0,
            DifferentialMutation::Best | DifferentialMutation::CurrentToBest => 1,
            DifferentialMutation::CurrentToPBest { part } => {
                let count = self.population.len();
                ((part * count as f64).round() as usize).max(2).min(count)
            }
        }
    }

    /// Puts the leaders first.
    fn rank(&mut self, leaders: usize) {
        if leaders > 0 && leaders < self.ranked.len() {
            let evaluations = &self.population.evaluations;
            let order = |i: &usize, j: &usize| evaluations[*i].order(&evaluations[*j]).then(i.cmp(j));
            self.ranked.select_nth_unstable_by(leaders - 1, order);
        }
    }

    /// A random member that is none of `others`.
    fn other<const N: usize>(generator: &mut Generator, count: usize, others: [usize; N]) -> usize {
        loop {
            let k = generator.index(count);
            if !others.contains(&k) {
                return k;
            }
        }
    }

    /// Adds the trial point for a member.
    fn trial(&mut self, member: usize, leaders: usize, points: &mut Points) {
        let (factor, crossover) = self.control.draw(member, &mut self.generator);
        let generator = &mut self.generator;
        let members = &self.population.points;
        let count = members.len();
        let leader = if leaders > 0 { self.ranked[generator.index(leaders)] } else { member };
        let plus = Self::other(generator, count, [member]);
        let with_archive = matches!(self.settings.mutation, DifferentialMutation::CurrentToPBest { .. });
        let minus = Self::other(
            generator,
            if with_archive { count + self.archive.len() } else { count },
            [member, plus],
        );
        let base = match self.settings.mutation {
            DifferentialMutation::Rand => Self::other(generator, count, [member, plus, minus]),
            DifferentialMutation::Best => leader,
            DifferentialMutation::CurrentToBest | DifferentialMutation::CurrentToPBest { .. } => member,
        };
        let leader = if base == member { leader } else { base };
        let minus = if minus < count { members.row(minus) } else { self.archive.row(minus - count) };
        let (x, base, leader, plus) =
            (members.row(member), members.row(base), members.row(leader), members.row(plus));
        let u = points.add();
        let n = u.len();
        let (x, base, leader, plus, minus) = (&x[..n], &base[..n], &leader[..n], &plus[..n], &minus[..n]);
        let mutant = |j: usize| base[j] + factor * ((leader[j] - base[j]) + (plus[j] - minus[j]));
        // Comparisons of 16 bits: four coordinates for each number of the generator.
        let threshold = (crossover * f64::from(1_u32 << 16)) as u64;
        for start in (0..n).step_by(4) {
            let mut bits = generator.bits();
            for j in start..n.min(start + 4) {
                u[j] = if (bits & 0xffff) < threshold { mutant(j) } else { x[j] };
                bits >>= 16;
            }
        }
        let taken = generator.index(n);
        u[taken] = mutant(taken);
        let (lower, upper) = (&self.space.lower()[..n], &self.space.upper()[..n]);
        let outside = |j: usize, u: f64| !(lower[j] <= u && u <= upper[j]);
        if u.iter().enumerate().fold(false, |any, (j, &u)| any | outside(j, u)) {
            for j in 0..n {
                if !outside(j, u[j]) {
                    continue;
                }
                u[j] = match self.settings.bounds {
                    DifferentialBounds::Midpoint if u[j] > upper[j] => 0.5 * (x[j] + upper[j]),
                    DifferentialBounds::Midpoint => 0.5 * (x[j] + lower[j]),
                    DifferentialBounds::Reflection => self.space.reflect(j, u[j]),
                };
            }
        }
    }

    /// Keeps a replaced member, in place of a random one where the archive is full.
    fn keep(&mut self, member: usize) {
        if self.archive.len() < self.capacity {
            self.archive.push(self.population.points.row(member));
        } else if self.capacity > 0 {
            let slot = self.generator.index(self.capacity);
            self.archive.row_mut(slot).copy_from_slice(self.population.points.row(member));
        }
    }

    /// Removes the worst members as far as the budget says.
    fn shrink(&mut self) {
        if !matches!(self.settings.adaptation, DifferentialAdaptation::SuccessHistory { .. }) {
            return;
        }
        let done = (self.evaluations as f64 / self.budget.max(1) as f64).min(1.0);
        let size = self.initial as f64 + (LEAST as f64 - self.initial as f64) * done;
        let size = (size.round() as usize).max(LEAST);
        while self.population.len() > size {
            let Some(worst) = self.population.worst() else { break };
            self.population.swap_remove(worst);
        }
        if self.ranked.len() != self.population.len() {
            self.ranked.clear();
            self.ranked.extend(0..self.population.len());
            self.capacity = self.archive_capacity(self.population.len());
            while self.archive.len() > self.capacity {
                let dropped = self.generator.index(self.archive.len());
                self.archive.swap_remove(dropped);
            }
        }
    }
}

impl Algorithm for DifferentialEvolution {
    fn ask(&mut self, points: &mut Points) {
        points.clear();
        if self.population.is_empty() {
            points.extend(&self.first);
            return;
        }
        self.control.begin();
        let leaders = self.leaders();
        self.rank(leaders);
        for member in 0..self.population.len() {
            self.trial(member, leaders, points);
        }
    }

    fn tell(&mut self, points: &Points, evaluations: &[Evaluation]) {
        self.evaluations += evaluations.len();
        if self.population.is_empty() {
            for (x, evaluation) in points.rows().zip(evaluations) {
                self.population.push(x, *evaluation);
                Candidate::improve(&mut self.best, x, evaluation);
            }
            return;
        }
        for (member, (x, evaluation)) in points.rows().zip(evaluations).enumerate() {
            let old = self.population.evaluations[member];
            match evaluation.order(&old) {
                std::cmp::Ordering::Greater => continue,
                std::cmp::Ordering::Less => {
                    self.keep(member);
                    self.control.succeed(member, &old, evaluation);
                    Candidate::improve(&mut self.best, x, evaluation);
                }
                std::cmp::Ordering::Equal => self.control.stay(member),
            }
            self.population.set(member, x, *evaluation);
        }
        self.control.learn();
        self.shrink();
    }

    fn best(&self) -> Option<&Candidate> {
        self.best.as_ref()
    }

    fn emigrants(&self, count: usize, into: &mut Population) {
        self.population.copy_best(count, into);
    }

    fn immigrate(&mut self, migrants: &Population) {
        for (x, evaluation) in migrants.iter() {
            Candidate::improve(&mut self.best, x, evaluation);
        }
        self.population.replace_worst(migrants, |_, _| {});
    }

    fn spread(&self) -> f64 {
        let told = !self.population.is_empty();
        if told { self.population.points.spread(&self.space) } else { self.first.spread(&self.space) }
    }

    fn converged(&self) -> Option<Convergence> {
        // Differences of equal points are 0; those in the archive differ still.
        (!self.population.is_empty()
            && self.archive.is_empty()
            && self.population.points.coincide(&self.space))
        .then_some(Convergence::Spread)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sphere(points: &Points) -> Vec<Evaluation> {
        points.rows().map(|x| Evaluation::new(x.iter().map(|x| x * x).sum())).collect()
    }

    fn run(settings: &DifferentialEvolutionSettings, budget: usize) -> DifferentialEvolution {
        let space = SearchSpace::cube(5, -5.0, 5.0).expect("a box");
        let task = Task { space: &space, start: &Points::new(5), seed: 3, budget };
        let mut de = DifferentialEvolution::new(settings, &task).expect("a population");
        let mut points = Points::new(5);
        while de.evaluations < budget {
            de.ask(&mut points);
            let results = sphere(&points);
            de.tell(&points, &results);
        }
        de
    }

    #[test]
    fn the_population_of_l_shade_shrinks_linearly() {
        // 90 members at first and 4 at the end; half way 47.
        let half = run(&DifferentialEvolutionSettings::default(), 4000);
        assert_eq!(half.population.len(), LEAST);
        assert!(half.archive.len() <= (2.6 * LEAST as f64).round() as usize);
        let space = SearchSpace::cube(5, -5.0, 5.0).expect("a box");
        let task = Task { space: &space, start: &Points::new(5), seed: 3, budget: 4000 };
        let mut de =
            DifferentialEvolution::new(&DifferentialEvolutionSettings::default(), &task).expect("one");
        let mut points = Points::new(5);
        while de.evaluations < 2000 {
            de.ask(&mut points);
            let results = sphere(&points);
            de.tell(&points, &results);
        }
        let size = (90.0 - 86.0 * de.evaluations as f64 / 4000.0).round() as usize;
        assert_eq!(de.population.len(), size);
    }

    #[test]
    fn members_only_get_better() {
        for settings in [
            DifferentialEvolutionSettings::classic(),
            DifferentialEvolutionSettings::self_adaptive(),
            DifferentialEvolutionSettings {
                mutation: DifferentialMutation::Best,
                ..DifferentialEvolutionSettings::classic()
            },
        ] {
            let (early, late) = (run(&settings, 500), run(&settings, 5000));
            for (a, b) in early.population.evaluations.iter().zip(&late.population.evaluations) {
                assert!(b.order(a) != std::cmp::Ordering::Greater);
            }
        }
    }

    #[test]
    fn coordinates_outside_come_back_half_way_or_mirrored() {
        let space = SearchSpace::cube(1, 0.0, 1.0).expect("a box");
        for bounds in [DifferentialBounds::Midpoint, DifferentialBounds::Reflection] {
            // Members at 0.1 and 0.9 alone: 0.9 + 0.8 F and 0.1 - 0.8 F lie outside with F = 1.
            let mut start = Points::new(1);
            [0.1, 0.1, 0.9, 0.9].iter().for_each(|x| start.push(&[*x]));
            let task = Task { space: &space, start: &start, seed: 1, budget: 100 };
            let settings = DifferentialEvolutionSettings {
                population: Some(4),
                adaptation: DifferentialAdaptation::Fixed { factor: 1.0, crossover: 1.0 },
                mutation: DifferentialMutation::Rand,
                bounds,
            };
            let mut de = DifferentialEvolution::new(&settings, &task).expect("a population");
            let mut points = Points::new(1);
            de.ask(&mut points);
            de.tell(&points, &[Evaluation::new(1.0); 4]);
            let mut seen = std::collections::BTreeSet::new();
            for _ in 0..50 {
                de.ask(&mut points);
                seen.extend(points.values().iter().map(|x| (x * 1e6).round() as i64));
                de.tell(&points, &[Evaluation::new(2.0); 4]);
            }
            let expected: &[i64] = match bounds {
                DifferentialBounds::Midpoint => &[50_000, 100_000, 450_000, 550_000, 900_000, 950_000],
                DifferentialBounds::Reflection => &[100_000, 300_000, 700_000, 900_000],
            };
            assert!(seen.iter().all(|x| expected.contains(x)), "{bounds:?}: {seen:?}");
            assert!(seen.len() > 2, "{bounds:?}: {seen:?}");
        }
    }
}
