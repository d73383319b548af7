//! Requests that are refused, by name.

use apsides_metaheuristics::{
    AnnealingSettings, AntColonySettings, CmaEsSettings, Constraints, CooperationSettings, Damping,
    DifferentialAdaptation, DifferentialEvolutionSettings, DifferentialMutation, GeneticSettings,
    IslandsSettings, Method, Noise, ParticleSwarmSettings, Search, SearchSpace, Stagnation, Topology,
};

fn refusal(search: &Search) -> String {
    let space = SearchSpace::cube(2, 0.0, 1.0).expect("a box");
    let report = search.minimize(&space, &|x: &[f64]| x[0]);
    report.expect_err("the request is ill-posed").to_string()
}

#[test]
fn boxes() {
    let message = |lower: &[f64], upper: &[f64]| {
        SearchSpace::new(lower.to_vec(), upper.to_vec()).expect_err("no box").to_string()
    };
    assert_eq!(message(&[], &[]), "the box has no coordinates");
    assert_eq!(message(&[0.0, 0.0], &[1.0]), "upper bounds: 1 numbers instead of 2");
    for (lower, upper) in [
        (1.0, 0.0),
        (f64::NAN, 1.0),
        (0.0, f64::NAN),
        (f64::NEG_INFINITY, 0.0),
        (0.0, f64::INFINITY),
        (-1e308, 1e308),
    ] {
        let expected = format!(
            "bounds of coordinate 1: [{lower}, {upper}]; bounds in rising order, a finite width apart, are needed"
        );
        assert_eq!(message(&[0.0, lower], &[1.0, upper]), expected);
    }
}

#[test]
fn searches() {
    let base = Search::default;
    let cases = [
        (Search { budget: 0, ..base() }, "the budget is 0 evaluations; at least 1 is needed"),
        (Search { start: vec![vec![0.5]], ..base() }, "start point 0: 1 numbers instead of 2"),
        (
            Search { start: vec![vec![0.5, 0.5], vec![0.5, 2.0]], ..base() },
            "start point 1: coordinate 1 is 2, outside of [0, 1]",
        ),
        (
            Search { start: vec![vec![f64::NAN, 0.5]], ..base() },
            "start point 0: coordinate 0 is NaN, outside of [0, 1]",
        ),
        (
            Search { constraints: Constraints::Penalty { weight: 0.0 }, ..base() },
            "penalty: weight is 0; above 0 and finite is needed",
        ),
        (
            Search { noise: Noise::Mean { samples: 0 }, ..base() },
            "noise: samples is 0; 1 to the budget is needed",
        ),
        (
            Search { noise: Noise::Mean { samples: 10 }, budget: 9, ..base() },
            "noise: samples is 10; 1 to the budget is needed",
        ),
        (
            Search { noise: Noise::ConfirmBest { repeats: 0 }, ..base() },
            "noise: repeats is 0; at least 1 is needed",
        ),
        (
            Search { stagnation: Some(Stagnation { generations: 0, improvement: 0.0 }), ..base() },
            "stagnation: generations is 0; at least 1 is needed",
        ),
        (Search { target: Some(f64::NAN), ..base() }, "target is NaN; a number is needed"),
    ];
    for (search, message) in cases {
        assert_eq!(refusal(&search), message);
    }
}

#[test]
fn methods() {
    let genetic = GeneticSettings::default;
    let swarm = ParticleSwarmSettings::default;
    let colony = AntColonySettings::default;
    let annealing = AnnealingSettings::default;
    let islands = IslandsSettings::default;
    let cases = [
        (
            Method::Genetic(GeneticSettings { population: 1, ..genetic() }),
            "genetic algorithm: a population of 1; at least 2 are needed",
        ),
        (
            Method::Genetic(GeneticSettings { population: usize::MAX, ..genetic() }),
            "genetic algorithm is 18446744073709552000; at most 1000000 is allowed",
        ),
        (
            Method::Genetic(GeneticSettings { crossover: 1.5, ..genetic() }),
            "genetic algorithm: crossover is 1.5; 0 to 1 is needed",
        ),
        (
            Method::Genetic(GeneticSettings { mutation_index: f64::NAN, ..genetic() }),
            "genetic algorithm: mutation_index is NaN; at least 0 and finite is needed",
        ),
        (
            Method::ParticleSwarm(ParticleSwarmSettings { particles: 1, ..swarm() }),
            "particle swarm: a population of 1; at least 2 are needed",
        ),
        (
            Method::ParticleSwarm(ParticleSwarmSettings { social: 1.0, ..swarm() }),
            "particle swarm: cognitive + social is 3.05; above 4 and finite is needed",
        ),
        (
            Method::ParticleSwarm(ParticleSwarmSettings {
                damping: Damping::Inertia { first: 0.9, last: -0.1 },
                ..swarm()
            }),
            "particle swarm: last inertia is -0.1; 0 to 1 is needed",
        ),
        (
            Method::AntColony(AntColonySettings { archive: 1, ..colony() }),
            "ant colony: archive: a population of 1; at least 2 are needed",
        ),
        (
            Method::AntColony(AntColonySettings { ants: 0, ..colony() }),
            "ant colony: ants: a population of 0; at least 1 are needed",
        ),
        (
            Method::DifferentialEvolution(DifferentialEvolutionSettings {
                population: Some(3),
                ..Default::default()
            }),
            "differential evolution: a population of 3; at least 4 are needed",
        ),
        (
            Method::DifferentialEvolution(DifferentialEvolutionSettings {
                adaptation: DifferentialAdaptation::Fixed { factor: 0.0, crossover: 0.5 },
                ..Default::default()
            }),
            "differential evolution: factor is 0; above 0 and at most 2 is needed",
        ),
        (
            Method::DifferentialEvolution(DifferentialEvolutionSettings {
                mutation: DifferentialMutation::CurrentToPBest { part: f64::NAN },
                ..Default::default()
            }),
            "differential evolution: part is NaN; above 0 and at most 1 is needed",
        ),
        (
            Method::CmaEs(CmaEsSettings { population: Some(1), ..Default::default() }),
            "CMA-ES: a population of 1; at least 4 are needed",
        ),
        (
            Method::CmaEs(CmaEsSettings { step: 0.0, ..Default::default() }),
            "CMA-ES: step is 0; above 0 and at most 1 is needed",
        ),
        (
            Method::CmaEs(CmaEsSettings { tolerance: -1.0, ..Default::default() }),
            "CMA-ES: tolerance is -1; at least 0 is needed",
        ),
        (
            Method::SimulatedAnnealing(AnnealingSettings { cooling: Some(1.0), ..annealing() }),
            "simulated annealing: cooling is 1; above 0 and below 1 is needed",
        ),
        (
            Method::SimulatedAnnealing(AnnealingSettings { walkers: 30, ..annealing() }),
            "simulated annealing: first: a population of 20; at least 30 are needed",
        ),
        (
            Method::Cooperation(CooperationSettings {
                swarm_generations: 0,
                colony_generations: 0,
                genetic_generations: 0,
                ..Default::default()
            }),
            "cooperation: generations of a cycle is 0; at least 1 is needed",
        ),
        (
            Method::Islands(IslandsSettings { islands: vec![], ..islands() }),
            "islands: number of islands is 0; at least 1 is needed",
        ),
        (
            Method::Islands(IslandsSettings { interval: 0, ..islands() }),
            "islands: interval is 0; at least 1 is needed",
        ),
        (
            Method::Islands(IslandsSettings {
                topology: Topology::Custom(vec![vec![9], vec![], vec![], vec![]]),
                ..islands()
            }),
            "islands: neighbour is 9; the index of an island, from 0, is needed",
        ),
    ];
    for (method, message) in cases {
        assert_eq!(refusal(&Search::new(method)), message);
    }
}
