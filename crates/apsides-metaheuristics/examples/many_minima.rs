//! The least of some ten thousand minima: Rastrigin's function in four variables, by two algorithms with the same budget.
#![allow(clippy::print_stdout)]

use apsides_metaheuristics::{
    CmaEsSettings, DifferentialEvolutionSettings, Evaluation, Method, Search, SearchError, SearchSpace,
};

fn main() -> Result<(), SearchError> {
    let rastrigin = |x: &[f64]| {
        let wave = |x: &f64| 10.0 + x * x - 10.0 * (std::f64::consts::TAU * x).cos();
        Evaluation::new(x.iter().map(wave).sum())
    };
    let space = SearchSpace::cube(4, -5.12, 5.12)?;
    let methods = [
        ("differential evolution", Method::DifferentialEvolution(DifferentialEvolutionSettings::default())),
        ("CMA-ES", Method::CmaEs(CmaEsSettings::default())),
    ];
    for (name, method) in methods {
        let search = Search { method, seed: 1, target: Some(1e-6), ..Search::default() };
        let report = search.minimize(&space, &rastrigin)?;
        println!("{name}: {} evaluations, {:?}, {:?}", report.evaluations, report.stop, report.best);
        assert!(report.feasible().is_some_and(|best| best.evaluation.objective <= 1e-6));
        // The same seed gives the same search.
        assert_eq!(search.minimize(&space, &rastrigin)?.best, report.best);
    }
    Ok(())
}
