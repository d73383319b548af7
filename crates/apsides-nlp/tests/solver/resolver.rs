//! Programs of one structure and other data, each from the last solution.

use apsides_nlp::{Nlp, NlpError, NlpSettings, Pattern, Resolver, Status, WarmStart, Way};

/// Solver: closed forms.
const CLOSED_FORM: f64 = 1e-8;

/// The point of the disc of a radius that is next to a target, with bounds.
#[derive(Clone)]
struct Nearest {
    target: [f64; 2],
    radius: f64,
    lower: [f64; 2],
}

impl Nlp for Nearest {
    fn variables(&self) -> usize {
        2
    }
    fn constraints(&self) -> usize {
        1
    }
    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.lower);
        upper.fill(f64::INFINITY);
    }
    fn constraint_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.fill(f64::NEG_INFINITY);
        upper.fill(self.radius * self.radius);
    }
    fn initial_point(&self, x: &mut [f64]) {
        x.copy_from_slice(&[0.1, 0.2]);
    }
    fn jacobian_pattern(&self) -> Pattern {
        Pattern::dense(1, 2)
    }
    fn hessian_pattern(&self) -> Pattern {
        Pattern::from_pairs([(0, 0), (1, 1)])
    }
    fn objective(&mut self, x: &[f64]) -> f64 {
        x.iter().zip(&self.target).map(|(x, t)| (x - t).powi(2)).sum()
    }
    fn gradient(&mut self, x: &[f64], g: &mut [f64]) {
        for ((g, x), t) in g.iter_mut().zip(x).zip(&self.target) {
            *g = 2.0 * (x - t);
        }
    }
    fn constraint_values(&mut self, x: &[f64], c: &mut [f64]) {
        c[0] = x[0] * x[0] + x[1] * x[1];
    }
    fn jacobian(&mut self, x: &[f64], j: &mut [f64]) {
        j.copy_from_slice(&[2.0 * x[0], 2.0 * x[1]]);
    }
    fn hessian(&mut self, _: &[f64], factor: f64, y: &[f64], h: &mut [f64]) {
        h.fill(2.0 * (factor + y[0]));
    }
}

const BEYOND: Nearest = Nearest { target: [3.0, 4.0], radius: 1.0, lower: [-5.0, -5.0] };

fn assert_at(x: &[f64], expected: [f64; 2]) {
    for (x, e) in x.iter().zip(expected) {
        assert!((x - e).abs() <= CLOSED_FORM, "{x} for {e}");
    }
}

/// Through a target that turns, a disc that grows beyond it, and a bound that becomes active and inactive again.
#[test]
fn the_active_set_follows_the_data() {
    let mut resolver = Resolver::new(NlpSettings::default());
    let first = resolver.solve(&mut BEYOND.clone(), &mut ()).unwrap();
    assert_eq!(first.way, Way::Cold);
    assert_at(&first.report.x, [0.6, 0.8]);

    let turned = Nearest { target: [4.0, 3.0], ..BEYOND };
    let next = resolver.solve(&mut turned.clone(), &mut ()).unwrap();
    assert_eq!(next.way, Way::ActiveSet);
    assert!(next.report.counters.iterations <= 5, "{:?}", next.report.counters);
    assert_at(&next.report.x, [0.8, 0.6]);

    // The least first coordinate is beyond the point of the disc.
    let bounded = Nearest { lower: [0.9, -5.0], ..turned.clone() };
    let next = resolver.solve(&mut bounded.clone(), &mut ()).unwrap();
    assert_at(&next.report.x, [0.9, 0.19_f64.sqrt()]);
    assert!(next.report.lower_multipliers[0] > 0.0);

    let next = resolver.solve(&mut turned.clone(), &mut ()).unwrap();
    assert_at(&next.report.x, [0.8, 0.6]);
    assert_eq!(next.report.lower_multipliers[0].max(0.0), next.report.lower_multipliers[0]);

    let inside = Nearest { target: [0.3, 0.2], ..BEYOND };
    let next = resolver.solve(&mut inside.clone(), &mut ()).unwrap();
    assert_at(&next.report.x, [0.3, 0.2]);
    assert!(next.report.constraint_multipliers[0].abs() <= CLOSED_FORM);
}

/// A solution without its history, as from a file, is gone on from too.
#[test]
fn a_stored_solution_is_gone_on_from() {
    let mut first = Resolver::new(NlpSettings::default());
    let stored = WarmStart::from(&first.solve(&mut BEYOND.clone(), &mut ()).unwrap().report);
    let mut resolver = Resolver::from_solution(NlpSettings::default(), stored).unwrap();
    let next = resolver.solve(&mut Nearest { target: [3.1, 4.0], ..BEYOND }, &mut ()).unwrap();
    assert_eq!(next.way, Way::ActiveSet);
    let length = 3.1_f64.hypot(4.0);
    assert_at(&next.report.x, [3.1 / length, 4.0 / length]);
}

/// Fixed variables make another structure; no feasible point leaves the last solution as it was.
#[test]
fn other_structures_and_failures_are_survived() {
    let mut resolver = Resolver::new(NlpSettings::default());
    resolver.solve(&mut BEYOND.clone(), &mut ()).unwrap();
    let empty = Nearest { lower: [2.0, 2.0], ..BEYOND };
    assert!(resolver.follow(&mut empty.clone()).unwrap().is_none());
    let next = resolver.solve(&mut empty.clone(), &mut ()).unwrap();
    assert_eq!(next.report.status, Status::Infeasible);
    let next = resolver.solve(&mut BEYOND.clone(), &mut ()).unwrap();
    assert_eq!(next.way, Way::ActiveSet);
    assert_at(&next.report.x, [0.6, 0.8]);
}

/// A change of a millionth needs no factor but that of the last solution, until another one was made by the interior point method.
#[test]
fn the_factor_of_the_last_solution_serves() {
    const SMALL: f64 = 1e-6;
    let mut resolver = Resolver::new(NlpSettings::default());
    resolver.solve(&mut BEYOND.clone(), &mut ()).unwrap();
    let turned = |change: f64| Nearest { target: [3.0 + change, 4.0], ..BEYOND };
    let mut factorisations = |change: f64| {
        let next = resolver.solve(&mut turned(change), &mut ()).unwrap();
        assert_eq!(next.way, Way::ActiveSet);
        let length = (3.0 + change).hypot(4.0);
        assert_at(&next.report.x, [(3.0 + change) / length, 4.0 / length]);
        next.report.counters.factorisations
    };
    assert!(factorisations(0.1) > 0);
    assert_eq!(factorisations(0.1 + SMALL), 0);
    assert_eq!(factorisations(0.1 - SMALL), 0);

    let empty = Nearest { lower: [2.0, 2.0], ..BEYOND };
    assert_eq!(resolver.solve(&mut empty.clone(), &mut ()).unwrap().report.status, Status::Infeasible);
    let next = resolver.solve(&mut turned(0.1), &mut ()).unwrap();
    assert_eq!(next.way, Way::ActiveSet);
    assert!(next.report.counters.factorisations > 0);
}

#[test]
fn numbers_that_are_not_finite_are_refused() {
    let start = WarmStart {
        x: vec![0.0, f64::NAN],
        constraint_multipliers: vec![0.0],
        lower_multipliers: vec![0.0; 2],
        upper_multipliers: vec![0.0; 2],
        barrier: None,
    };
    let refused = Resolver::from_solution(NlpSettings::default(), start);
    assert!(matches!(refused.err(), Some(NlpError::Start { index: 1, .. })));
    let mut resolver = Resolver::new(NlpSettings::default());
    resolver.solve(&mut BEYOND.clone(), &mut ()).unwrap();
    assert!(resolver.solve(&mut Nearest { radius: f64::NAN, ..BEYOND }, &mut ()).is_err());
}
