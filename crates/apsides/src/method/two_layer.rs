//! Two layers: a search without derivatives over control profiles finds a start, collocation finishes.

use std::time::{Duration, Instant};

use apsides_metaheuristics::{
    Algorithm, AnnealingSettings, AntColonySettings, CmaEsSettings, Constraints, CooperationSettings,
    DifferentialEvolutionSettings, Evaluation, GeneticSettings, Method, ParticleSwarmSettings, Progress, Run,
    Search, SearchSpace, StopReason,
};
use apsides_nlp::Flow;
use apsides_ocp::{Guess, Trajectory};
use apsides_shooting::profile::{
    FlightRules, MeshWish, ProfileScore, ProfileShape, ProfileShooting, ProfileStart, Stop,
};

use super::Solution;
use crate::checkpoint::Checkpoint;
use crate::key::{Key, Range, Values};
use crate::missions::{Posed, ProfileSearch};
use crate::outcome::SearchSummary;
use crate::{Error, Mission, Observer, SearchProgress};

const ALGORITHM: &str = "search.algorithm";
const COOPERATION: &str = "cooperation";
const GENETIC: &str = "genetic";
const SWARM: &str = "particle-swarm";
const COLONY: &str = "ant-colony";
const EVOLUTION: &str = "differential-evolution";
const CMA_ES: &str = "cma-es";
const ANNEALING: &str = "annealing";

const ENERGY: &str = "energy";
const FEASIBILITY: &str = "feasibility";

/// Largest population.
const POPULATION: u32 = 100_000;
const GENERATIONS: u32 = 1_000_000;

pub(super) const KEYS: &[Key] = &[
    Key::choice(
        ALGORITHM,
        &[COOPERATION, GENETIC, SWARM, COLONY, EVOLUTION, CMA_ES, ANNEALING],
        "algorithm of the search; \"cooperation\": particle swarm, ant colony and genetic algorithm that exchange their best",
    ),
    Key::count("search.evaluations", 3000, 1, 100_000_000, "flights of the search"),
    Key::count(
        "search.population",
        30,
        4,
        POPULATION,
        "flights of a generation of genetic algorithm, swarm and colony, alone or in the cooperation; the others choose their own",
    ),
    Key::number(
        "search.time_limit_s",
        f64::INFINITY,
        Range::POSITIVE_OR_UNLIMITED,
        "longest time of the search, looked at after each generation; inf: not limited. Results depend on it",
    ),
    Key::choice(
        "search.profile",
        &[ENERGY, "time"],
        "what the controls are polynomials of: normalised energy, or time",
    ),
    Key::count("search.degree", 1, 0, 5, "degree of the polynomials"),
    Key::count(
        "search.least_intervals",
        3,
        1,
        100,
        "fewest sub-intervals; their number is searched up to the next key",
    ),
    Key::count("search.most_intervals", 3, 1, 100, "most sub-intervals"),
    Key::flag("search.free_lengths", false, "whether the lengths of the sub-intervals are searched"),
    Key::flag("search.continuous", true, "whether the controls are continuous between sub-intervals"),
    Key::choice(
        "search.constraints",
        &["penalty", FEASIBILITY],
        "how misses and excesses count: added to the objective, or first of all",
    ),
    Key::number(
        "search.price_of_miss",
        0.2,
        Range::POSITIVE,
        "in the objective's unit per km that the end misses its target",
    ),
    Key::number(
        "search.price_of_excess",
        100.0,
        Range::POSITIVE,
        "in the objective's unit for a limit exceeded by its own size",
    ),
    Key::count(
        "search.swarm_generations",
        1,
        0,
        GENERATIONS,
        "of the particle swarm in a cycle of the cooperation",
    ),
    Key::count(
        "search.colony_generations",
        1,
        0,
        GENERATIONS,
        "of the ant colony in a cycle of the cooperation",
    ),
    Key::count(
        "search.genetic_generations",
        1,
        0,
        GENERATIONS,
        "of the genetic algorithm in a cycle of the cooperation",
    ),
    Key::count(
        "search.swarm_to_genetic",
        6,
        0,
        POPULATION,
        "particles that go to the genetic algorithm per cycle",
    ),
    Key::count(
        "search.colony_to_genetic",
        6,
        0,
        POPULATION,
        "ants that go to the genetic algorithm per cycle",
    ),
    Key::count(
        "search.genetic_to_colony",
        6,
        0,
        POPULATION,
        "individuals that go to the ant colony per cycle",
    ),
    Key::count(
        "search.genetic_to_swarm",
        6,
        0,
        POPULATION,
        "individuals that go to the particle swarm per cycle",
    ),
];

/// Time between two checkpoints at least.
const CHECKPOINT_INTERVAL: Duration = Duration::from_millis(200);

/// The best start of a search, and how it was found.
pub(crate) struct Found {
    pub(crate) start: Option<ProfileStart>,
    pub(crate) summary: SearchSummary,
}

impl Mission {
    /// Searches for a start, then solves by collocation from it. A `start` that is given replaces the search.
    pub(super) fn solve_by_two_layers(
        &self,
        posed: &Posed,
        guess: &Guess,
        start: Option<&Trajectory>,
        observer: &mut dyn Observer,
    ) -> Result<Solution, Error> {
        if start.is_some() {
            return self.solve_by_radau(&posed.ocp, guess, start, observer);
        }
        let found = self.search(posed, observer)?;
        let mut solution = match &found.start {
            Some(start) => self.solve_by_radau_on(&posed.ocp, &start.guess, start.mesh.clone(), observer)?,
            // Every flight failed: the mission's own guess is what is left.
            None => self.solve_by_radau(&posed.ocp, guess, None, observer)?,
        };
        if found.start.is_none() {
            solution.warnings.push(
                "every flight of the search failed; the solve began from the mission's own guess".into(),
            );
        }
        solution.search = Some(found.summary);
        Ok(solution)
    }

    /// The search layer alone.
    pub(crate) fn search(&self, posed: &Posed, observer: &mut dyn Observer) -> Result<Found, Error> {
        let begin = Instant::now();
        let model = posed.search.as_ref().ok_or_else(|| self.not_searched())?;
        let shooting = ProfileShooting::new(&posed.ocp, self.flight_rules(posed, model)?)?;
        let score = self.profile_score(&shooting, model);
        let (lower, upper) = shooting.space();
        let space = SearchSpace::new(lower.to_vec(), upper.to_vec())?;
        let by_rules = self.values.word("search.constraints") == FEASIBILITY;
        let evaluate = |x: &[f64]| {
            shooting
                .flown(x, |flight| {
                    let (objective, violation) = score.separate(flight);
                    if by_rules {
                        Evaluation { objective, violation }
                    } else {
                        Evaluation::from(objective + violation)
                    }
                })
                // Settings have been checked: what is left is a flight that failed.
                .unwrap_or(Evaluation::FAILED)
        };
        let search = self.search_settings();
        let checkpoint = self.checkpoint.as_ref().map(|path| Checkpoint::new(path, self));
        let mut run = match checkpoint.as_ref().map(Checkpoint::read).transpose()?.flatten() {
            Some(run) => run,
            None => Run::new(&search, &space)?,
        };
        let mut saved = Instant::now();
        let mut failure = None;
        let stop = loop {
            let stop = run.step(&evaluate)?;
            let interrupted = observer.generation(&progress(&run.progress(), search.budget)) == Flow::Stop;
            let ended = interrupted || stop.is_some();
            if let Some(checkpoint) = &checkpoint
                && (ended || saved.elapsed() > CHECKPOINT_INTERVAL)
            {
                // What is computed is worth more than the file.
                if let Err(e) = checkpoint.write(&run) {
                    failure = Some(e);
                }
                saved = Instant::now();
            }
            if ended {
                break stop.map_or("interrupted", stop_word);
            }
        };
        let report = run.report();
        let wish = MeshWish {
            intervals: self.values.count("radau.intervals"),
            points: self.values.count("radau.points"),
            joints: false,
        };
        let start = match &report.best {
            Some(best) => Some(shooting.start(&best.x, wish)?),
            None => None,
        };
        let misses = |start: &ProfileStart| model.miss_km(&start.flight.state_misses);
        let summary = SearchSummary {
            algorithm: self.values.word(ALGORITHM).into(),
            variables: lower.len(),
            evaluations: report.evaluations,
            generations: report.generations,
            failures: report.failures,
            stop: stop.into(),
            objective: start.as_ref().map(|s| s.flight.objective),
            miss_km: start.as_ref().map(misses),
            time_ms: begin.elapsed().as_secs_f64() * 1e3,
            history: report.history.iter().map(|h| [h.evaluations as f64, h.objective]).collect(),
            remark: failure.map(|e| e.to_string()),
        };
        Ok(Found { start, summary })
    }

    fn flight_rules(&self, posed: &Posed, model: &ProfileSearch) -> Result<FlightRules, Error> {
        let v = &self.values;
        let shape = ProfileShape {
            least_intervals: v.count("search.least_intervals"),
            free_lengths: v.flag("search.free_lengths"),
            continuous: v.flag("search.continuous") && v.count("search.degree") > 0,
            ..ProfileShape::new(
                v.count("search.degree"),
                v.count("search.most_intervals"),
                model.bounds.clone(),
            )
        };
        let stop = Stop::at_end(&posed.ocp.phases[0], model.stop)?;
        let rules = FlightRules::new(shape).steered(model.steering.clone()).until(stop);
        Ok(if v.word("search.profile") == ENERGY { rules.of(model.energy.clone()) } else { rules })
    }

    fn profile_score(&self, shooting: &ProfileShooting<'_>, model: &ProfileSearch) -> ProfileScore {
        let (miss, excess) =
            (self.values.number("search.price_of_miss"), self.values.number("search.price_of_excess"));
        ProfileScore {
            miss_weights: model.km_per_unit.iter().map(|km| miss * km).collect(),
            excess_weight: excess,
            ..ProfileScore::new(shooting, excess)
        }
    }

    pub(crate) fn search_settings(&self) -> Search {
        let v = &self.values;
        let limit = v.number("search.time_limit_s");
        Search {
            method: method(v),
            seed: self.seed,
            budget: v.count("search.evaluations"),
            time_limit: limit.is_finite().then(|| Duration::from_secs_f64(limit.min(1e9))),
            constraints: Constraints::FeasibilityRules,
            threads: self.threads,
            ..Search::default()
        }
    }

    pub(crate) fn not_searched(&self) -> Error {
        Error::Conflict {
            place: format!("mission `{}`", self.name()),
            reason: "`method` is \"two-layer\", which searches control profiles of a re-entry; choose `method` = \"radau\""
                .into(),
        }
    }

    pub(super) fn check_search(&self) -> Result<(), Error> {
        let (least, most) =
            (self.values.count("search.least_intervals"), self.values.count("search.most_intervals"));
        if least > most {
            return Err(Error::Conflict {
                place: format!("mission `{}`", self.name()),
                reason: format!(
                    "`search.least_intervals` is {least}, it must not be above `search.most_intervals` = {most}"
                ),
            });
        }
        Ok(())
    }
}

fn method(v: &Values) -> Method {
    let population = v.count("search.population");
    let genetic = GeneticSettings { population, ..GeneticSettings::default() };
    let swarm = ParticleSwarmSettings { particles: population, ..ParticleSwarmSettings::default() };
    let colony = AntColonySettings { archive: population, ants: population, ..AntColonySettings::default() };
    match v.word(ALGORITHM) {
        GENETIC => Method::Genetic(genetic),
        SWARM => Method::ParticleSwarm(swarm),
        COLONY => Method::AntColony(colony),
        EVOLUTION => Method::DifferentialEvolution(DifferentialEvolutionSettings::default()),
        CMA_ES => Method::CmaEs(CmaEsSettings::default()),
        ANNEALING => Method::SimulatedAnnealing(AnnealingSettings::default()),
        _ => Method::Cooperation(CooperationSettings {
            swarm,
            colony,
            genetic,
            swarm_generations: v.count("search.swarm_generations"),
            colony_generations: v.count("search.colony_generations"),
            genetic_generations: v.count("search.genetic_generations"),
            swarm_to_genetic: v.count("search.swarm_to_genetic"),
            colony_to_genetic: v.count("search.colony_to_genetic"),
            genetic_to_colony: v.count("search.genetic_to_colony"),
            genetic_to_swarm: v.count("search.genetic_to_swarm"),
        }),
    }
}

fn progress(p: &Progress<'_>, budget: usize) -> SearchProgress {
    SearchProgress {
        generation: p.generation,
        evaluations: p.evaluations,
        budget,
        best: p.best.map(|c| c.evaluation.objective),
        spread: p.engine.spread(),
    }
}

fn stop_word(stop: StopReason) -> &'static str {
    match stop {
        StopReason::Budget => "budget",
        StopReason::TimeLimit => "time-limit",
        StopReason::Stopped => "interrupted",
        StopReason::AllFailed => "all-failed",
        _ => "converged",
    }
}
