//! Two layers: a search without derivatives over control profiles finds a start, collocation finishes.

use std::sync::Arc;
use std::time::Duration;

use apsides_metaheuristics::{
    AnnealingSettings, AntColonySettings, CmaEsSettings, Constraints, CooperationSettings,
    DifferentialEvolutionSettings, Exchange, GeneticSettings, IslandsSettings, Method as Algorithm,
    ParticleSwarmSettings, Search,
};
use apsides_ocp::Method;
use apsides_ocp::method::SearchRecord;
use apsides_radau::RadauSettings;
use apsides_shooting::profile::{Independent, MeshWish, ProfileStart};
use apsides_two_layer::{Checkpoint, ProfileModel, Ranking, TwoLayer, TwoLayerSettings};

use super::{Entry, MethodName, MethodSettings, PosedCase};
use crate::Error;
use crate::key::{Key, Range};
use crate::memory::Foreseen;
use crate::observer::Observer;
use crate::outcome::SearchSummary;
use crate::values::Values;

mod checkpoint;

const ALGORITHM: &str = "search.algorithm";
const COOPERATION: &str = "cooperation";
const AFTER_CYCLE: &str = "after-cycle";
const AT_ONCE: &str = "at-once";
const GENETIC: &str = "genetic";
const SWARM: &str = "particle-swarm";
const COLONY: &str = "ant-colony";
const EVOLUTION: &str = "differential-evolution";
const CMA_ES: &str = "cma-es";
const ANNEALING: &str = "annealing";
const ISLANDS: &str = "islands";

const ENERGY: &str = "energy";
const FEASIBILITY: &str = "feasibility";

/// Largest population.
const POPULATION: u32 = 100_000;
const GENERATIONS: u32 = 1_000_000;

pub(super) const ENTRY: Entry = Entry {
    name: MethodName::TwoLayer,
    keys: KEYS,
    names: super::radau::ENTRY.names,
    refuses: Some(|posed, values| posed.profile.is_none().then(|| values.refused(NO_PROFILES))),
    read: |values| Ok(Arc::new(TwoLayerMethod::read(values)?)),
};

const KEYS: &[Key] = &[
    Key::choice(
        ALGORITHM,
        &[COOPERATION, GENETIC, SWARM, COLONY, EVOLUTION, CMA_ES, ANNEALING, ISLANDS],
        "algorithm of the search; \"cooperation\": particle swarm, ant colony and genetic algorithm that exchange their best; \"islands\": \
         these and differential evolution side by side, each sending its best to the next from time to time",
    ),
    Key::count("search.evaluations", 3000, 1, 100_000_000, "flights of the search"),
    Key::count(
        "search.population",
        30,
        4,
        POPULATION,
        "flights of a generation of genetic algorithm, swarm and colony, alone or in the cooperation; the others choose their own",
    ),
    Key::count("search.island_interval", 10, 1, GENERATIONS, "generations between migrations of the islands"),
    Key::count("search.island_migrants", 1, 0, POPULATION, "points that an island sends to the next"),
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
    Key::count("search.degree", 1, 0, 5, "degree of the polynomials; with the next key the least one"),
    Key::optional(
        "search.most_degree",
        Range::closed(0.0, 5.0),
        "largest degree: the degree of each sub-interval is searched from `search.degree` up to it; without it all have that one",
    ),
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
    Key::choice(
        "search.exchange",
        &[AFTER_CYCLE, AT_ONCE],
        "exchange of the cooperation: after the three turns of a cycle, better migrants in place of the worst; or at once, the genetic algorithm \
         begins its turn with the best of the others, and migrants replace the worst without condition",
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

/// The best start of a search, and how it was found.
#[derive(Clone, Debug)]
pub struct Found {
    /// The start; none where all flights failed.
    pub start: Option<ProfileStart>,
    /// The record of the search that found it.
    pub summary: SearchSummary,
}

/// Settings of the search.
#[derive(Clone, Debug)]
pub(super) struct TwoLayerMethod {
    search: Search,
    algorithm: String,
    /// True if misses and excesses come before the objective.
    by_rules: bool,
    degree: usize,
    most_degree: Option<usize>,
    intervals: [usize; 2],
    free_lengths: bool,
    continuous: bool,
    over_energy: bool,
    price_of_miss: f64,
    price_of_excess: f64,
}

impl TwoLayerMethod {
    pub(super) fn read(v: &Values) -> Result<Self, Error> {
        let limit = v.limit("search.time_limit_s")?;
        let search = Search {
            method: algorithm(v)?,
            budget: v.count("search.evaluations")?,
            time_limit: limit.map(|limit| Duration::from_secs_f64(limit.min(1e9))),
            constraints: Constraints::FeasibilityRules,
            ..Search::default()
        };
        Ok(Self {
            search,
            algorithm: v.word(ALGORITHM)?.into(),
            by_rules: v.word("search.constraints")? == FEASIBILITY,
            degree: v.count("search.degree")?,
            most_degree: most_degree(v)?,
            intervals: [v.count("search.least_intervals")?, v.count("search.most_intervals")?],
            free_lengths: v.flag("search.free_lengths")?,
            continuous: v.flag("search.continuous")?,
            over_energy: v.word("search.profile")? == ENERGY,
            price_of_miss: v.number("search.price_of_miss")?,
            price_of_excess: v.number("search.price_of_excess")?,
        })
    }

    /// The search.
    pub(super) fn search_settings(&self, threads: usize, seed: u64) -> Search {
        Search { threads, seed, ..self.search.clone() }
    }

    /// A search for a start, then collocation.
    fn two_layers(&self, case: &PosedCase<'_>) -> Result<TwoLayer, Error> {
        let model = case.posed.profile.as_ref().ok_or_else(|| Error::in_mission(NO_PROFILES))?;
        let [least_intervals, most_intervals] = self.intervals;
        let RadauSettings { intervals, points, .. } = case.radau.settings;
        let independent = if self.over_energy { model.independent.clone() } else { Independent::Time };
        let checkpoint = case.checkpoint.map(|file| Arc::new(file.clone()) as Arc<dyn Checkpoint>);
        Ok(TwoLayer {
            settings: TwoLayerSettings {
                search: self.search_settings(case.threads, case.seed),
                degree: self.degree,
                most_degree: self.most_degree,
                least_intervals,
                most_intervals,
                free_lengths: self.free_lengths,
                continuous: self.continuous,
                ranking: if self.by_rules { Ranking::FeasibilityFirst } else { Ranking::Penalty },
                price_of_miss: self.price_of_miss,
                price_of_excess: self.price_of_excess,
                mesh: MeshWish { intervals, points, joints: false },
            },
            profile: ProfileModel { independent, ..model.clone() },
            second: Box::new(case.radau.method()),
            checkpoint,
        })
    }

    /// The search layer alone.
    pub(super) fn search(&self, case: &PosedCase<'_>, observer: &mut dyn Observer) -> Result<Found, Error> {
        let found = self.two_layers(case)?.search(&case.posed.ocp, observer).map_err(Error::method)?;
        Ok(Found { start: found.start, summary: self.summary(found.record) })
    }

    fn summary(&self, record: SearchRecord) -> SearchSummary {
        SearchSummary {
            algorithm: self.algorithm.clone(),
            variables: record.variables,
            evaluations: record.evaluations,
            generations: record.generations,
            failures: record.failures,
            stop: record.end.word().into(),
            objective: record.objective,
            miss_km: record.miss,
            time_ms: record.time.as_secs_f64() * 1e3,
            history: record.history,
            remark: record.not_saved.map(|e| e.to_string()),
        }
    }
}

impl MethodSettings for TwoLayerMethod {
    fn method(&self, case: &PosedCase<'_>) -> Result<Box<dyn Method>, Error> {
        Ok(Box::new(self.two_layers(case)?))
    }

    /// That of the collocation at the end.
    fn foreseen(&self, case: &PosedCase<'_>) -> Foreseen {
        case.radau.foreseen(&case.posed.ocp)
    }

    /// Refuses intervals that do not go together.
    fn check(&self, values: &Values) -> Result<(), Error> {
        let [least, most] = self.intervals;
        if least > most {
            return Err(values.refused(&format!(
                "`search.least_intervals` is {least}, it must not be above `search.most_intervals` = {most}"
            )));
        }
        Ok(())
    }

    fn search_summary(&self, record: SearchRecord) -> Option<SearchSummary> {
        Some(self.summary(record))
    }
}

/// The largest degree, a whole number that is not below the least.
fn most_degree(v: &Values) -> Result<Option<usize>, Error> {
    let Some(most) = v.optional("search.most_degree")? else { return Ok(None) };
    if most.fract() != 0.0 {
        return Err(
            v.conflict(format!("`search.most_degree` is {most}, it must be a whole number from 0 to 5"))
        );
    }
    let least = v.count("search.degree")?;
    if most < least as f64 {
        return Err(v.conflict(format!(
            "`search.most_degree` is {most}, it must not be below `search.degree` = {least}"
        )));
    }
    Ok(Some(most as usize))
}

const NO_PROFILES: &str =
    "`method` is \"two-layer\", which searches control profiles of a re-entry; choose `method` = \"radau\"";

fn algorithm(v: &Values) -> Result<Algorithm, Error> {
    let population = v.count("search.population")?;
    let genetic = GeneticSettings { population, ..GeneticSettings::default() };
    let swarm = ParticleSwarmSettings { particles: population, ..ParticleSwarmSettings::default() };
    let colony = AntColonySettings { archive: population, ants: population, ..AntColonySettings::default() };
    Ok(match v.word(ALGORITHM)? {
        GENETIC => Algorithm::Genetic(genetic),
        SWARM => Algorithm::ParticleSwarm(swarm),
        COLONY => Algorithm::AntColony(colony),
        EVOLUTION => Algorithm::DifferentialEvolution(DifferentialEvolutionSettings::default()),
        CMA_ES => Algorithm::CmaEs(CmaEsSettings::default()),
        ANNEALING => Algorithm::SimulatedAnnealing(AnnealingSettings::default()),
        ISLANDS => Algorithm::Islands(IslandsSettings {
            islands: vec![
                Algorithm::ParticleSwarm(swarm),
                Algorithm::AntColony(colony),
                Algorithm::Genetic(genetic),
                Algorithm::DifferentialEvolution(DifferentialEvolutionSettings::default()),
            ],
            interval: v.count("search.island_interval")?,
            migrants: v.count("search.island_migrants")?,
            ..IslandsSettings::default()
        }),
        _ => Algorithm::Cooperation(CooperationSettings {
            swarm,
            colony,
            genetic,
            exchange: match v.word("search.exchange")? {
                AT_ONCE => Exchange::AtOnce,
                // The key takes no other words.
                _ => Exchange::AfterCycle,
            },
            swarm_generations: v.count("search.swarm_generations")?,
            colony_generations: v.count("search.colony_generations")?,
            genetic_generations: v.count("search.genetic_generations")?,
            swarm_to_genetic: v.count("search.swarm_to_genetic")?,
            colony_to_genetic: v.count("search.colony_to_genetic")?,
            genetic_to_colony: v.count("search.genetic_to_colony")?,
            genetic_to_swarm: v.count("search.genetic_to_swarm")?,
        }),
    })
}
