//! The main braking of Chang'e-3 in the plane by piecewise-constant controls. The optimum is that of an independent indirect solution,
//! the gaps those of an independent program with multiple shooting by CasADi and IPOPT, flown again by DOP853; with free lengths the
//! best of its starts. Angles are constant in the local frame along a segment. `references/chang_e_segments.py` prints those of equal lengths.
#![allow(clippy::unwrap_used)]

use apsides::Outcome;
use apsides::verify::Verdict;

const OPTIMUM_KG: f64 = 1_345.831_672_241_5;

/// Solver: it stops at 1e-10 of the scaled problem, some 1e-5 kg.
const SOLVER_KG: f64 = 5e-5;
/// Solver: how far a mass may be above the optimum, kg.
const ABOVE_OPTIMUM_KG: f64 = 1e-6;
/// Discretisation: the gap that refinement leaves, kg.
const REFINED_KG: f64 = 1e-3;

/// Segments, gap with equal and with free lengths in kg.
const GAPS: [(usize, f64, f64); 6] = [
    (2, 2.030_192, 1.922_719),
    (5, 0.273_453, 0.247_349),
    (10, 0.068_220, 0.061_371),
    (20, 0.018_251, 0.016_272),
    (30, 0.007_791, 0.007_451),
    (60, 0.001_948, 0.0017),
];

fn load(overrides: &[&str]) -> Result<apsides::Pipeline, apsides::Error> {
    let all = ["motion=plane", "method=piecewise"].iter().chain(overrides);
    apsides::load("chang-e-3-braking", &all.map(|o| (*o).to_owned()).collect::<Vec<_>>())
}

/// Flown as planned; of the optimum nothing is claimed.
fn gap(overrides: &[&str]) -> (f64, Outcome) {
    let outcome = load(overrides).unwrap().solve(None, &mut ()).unwrap();
    assert_eq!(outcome.summary.status, "optimal", "{overrides:?}: {:?}", outcome.explanation);
    let certificate = &outcome.summary.certificate;
    assert_eq!(
        certificate.verdict,
        Verdict::Feasible,
        "{overrides:?}: {:#?}",
        certificate.failures().collect::<Vec<_>>()
    );
    (OPTIMUM_KG - outcome.summary.results["final_mass_kg"], outcome)
}

#[test]
fn gaps_of_equal_and_of_free_lengths() {
    for (n, equal, free) in GAPS {
        let segments = format!("piecewise.intervals={n}");
        let (found, _) = gap(&[&segments, "piecewise.max_refinements=0"]);
        // The solver stops at 1e-10 of the scaled problem, some 1e-5 kg.
        assert!((found - equal).abs() < SOLVER_KG, "{n} equal: {found} {equal}");
        let (loose, _) = gap(&[&segments, "piecewise.max_refinements=0", "piecewise.lengths=free"]);
        assert!(loose < free + SOLVER_KG && loose <= found, "{n} free: {loose} {free}");
    }
}

/// Least thrust for 14.65 s, then the largest.
#[test]
fn refined_below_a_gram() {
    for lengths in ["equal", "free"] {
        let (found, outcome) = gap(&[&format!("piecewise.lengths={lengths}")]);
        assert!((-ABOVE_OPTIMUM_KG..REFINED_KG).contains(&found), "{lengths}: {found} kg");
        let phase = &outcome.trajectory.phases[0];
        let throttle: Vec<f64> = phase.control.segments().iter().map(|s| s.values[1]).collect();
        let full = throttle.iter().position(|t| *t > 0.999).unwrap();
        assert!(throttle[full..].iter().all(|t| *t > 0.999), "{throttle:?}");
        if lengths == "free" {
            assert!(full > 0 && throttle[..full].iter().all(|t| *t < 0.201), "{throttle:?}");
            let time = phase.control.breaks()[full];
            assert!((time - 14.65).abs() < 0.5, "{time} s");
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_flight() {
    let run = || {
        gap(&["piecewise.intervals=5", "piecewise.lengths=free", "piecewise.max_refinements=0"]).0.to_bits()
    };
    assert_eq!(run(), run());
}

/// Over the rotating Moon the method takes the same problem; against 1345.830856 kg by collocation.
#[test]
fn over_the_rotating_moon() {
    let (_, outcome) = gap(&["motion=space", "piecewise.intervals=20", "piecewise.max_refinements=0"]);
    let found = 1_345.830_856_263 - outcome.summary.results["final_mass_kg"];
    assert!((0.0..0.05).contains(&found), "{found} kg");
}

#[test]
fn bad_settings_are_refused_by_name() {
    for (key, value) in [
        ("piecewise.intervals", "0"),
        ("piecewise.epsilon", "-0.001"),
        ("piecewise.epsilon", "nan"),
        ("piecewise.least_length", "0"),
        ("piecewise.starts", "0"),
        ("piecewise.lengths", "other"),
        ("piecewise.tolerance", "nan"),
    ] {
        let text = match load(&[&format!("{key}={value}")]) {
            Err(e) => e.to_string(),
            Ok(_) => panic!("{key} = {value} is accepted"),
        };
        assert!(text.contains(key), "{text}");
    }
}
