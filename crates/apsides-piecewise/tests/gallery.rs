//! Problems of the gallery by piecewise-constant controls.
//!
//! Where the optimal control is smooth or has kinks only, the optimum is missed by `O(h^2)`, since it is stationary: a change of the
//! control by `O(h)` changes the objective by its square. Optima are those of `apsides-problems`.
#![allow(clippy::unwrap_used)]

use apsides_ocp::Sense;
use apsides_piecewise::{
    Constraints, FreeLengths, Lengths, PiecewiseConstant, PiecewiseSettings, PiecewiseSolution, Transcription,
};

/// Discretisation: the objective with 40 segments, relative.
const FORTY_SEGMENTS: f64 = 2e-3;

/// Solver: `PiecewiseSettings::path_tolerance`.
const EXCESS: f64 = 5e-7;

/// Discretisation: two treatments of constraints between the points, relative to the objective.
const TREATMENTS: f64 = 5e-4;

/// Discretisation: the same where controls enter a constraint.
const TREATMENTS_WITH_CONTROLS: f64 = 2e-3;

/// Solver: objectives and times that constant controls give exactly.
const SOLVER: f64 = 1e-6;

/// Solver: an objective at its optimum, relative.
const SOLVER_OPTIMUM: f64 = 1e-7;

/// Discretisation: the gain at which segments are no longer divided, relative.
const TOLERANCE: f64 = 1e-4;

/// The miss of an optimum in the sense that is no gain, relative to it; the program may gain its tolerance.
fn solved(name: &str, settings: PiecewiseSettings) -> (PiecewiseSolution, f64) {
    let problem = apsides_problems::find(name).unwrap();
    let case = problem.pose().unwrap();
    let solution = PiecewiseConstant { settings }.solve(&case.ocp, &case.guess).unwrap();
    assert!(solution.status.is_success(), "{name}: {}", solution.status);
    assert!(solution.accurate, "{name}: {} at {:?}", solution.integration_error, solution.excess);
    let difference = problem.optimum.relative_difference(solution.trajectory.objective);
    let gap = if case.ocp.objective.sense == Sense::Minimize { difference } else { -difference };
    assert!(gap > -1e-7, "{name}: better than the optimum by {gap}");
    (solution, gap)
}

fn segments(segments: usize) -> PiecewiseSettings {
    PiecewiseSettings { intervals: segments, ..Default::default() }
}

fn smoothed(segments: usize) -> PiecewiseSettings {
    let constraints = Constraints::LEpsilon(Transcription::default());
    PiecewiseSettings { intervals: segments, constraints, ..Default::default() }
}

fn free(segments: usize) -> PiecewiseSettings {
    let lengths = Lengths::Free(FreeLengths::default());
    PiecewiseSettings { intervals: segments, lengths, ..Default::default() }
}

/// Smooth controls, constrained arcs of first and second order, a contact, four phases.
#[test]
fn the_gap_falls_with_the_square_of_the_segment_length() {
    for name in [
        "brachistochrone_free_y",
        "linear_tangent",
        "brachistochrone_wall",
        "bryson_denham",
        "bryson_denham_contact",
        "delta_iii",
    ] {
        let gaps = [10, 20, 40].map(|n| solved(name, segments(n)).1);
        for pair in gaps.windows(2) {
            let ratio = pair[0] / pair[1];
            assert!((3.5..4.5).contains(&ratio), "{name}: {gaps:?}");
        }
        assert!(gaps[2] < FORTY_SEGMENTS, "{name}: {gaps:?}");
    }
}

/// The constraint transcription keeps the constraints all along, as far from their bounds as its `eps` says.
#[test]
fn both_treatments_of_constraints_agree() {
    for name in ["brachistochrone_wall", "bryson_denham", "bryson_denham_contact"] {
        let mut last = f64::INFINITY;
        for n in [10, 20] {
            let (at_points, gap) = solved(name, segments(n));
            let (smooth, smooth_gap) = solved(name, smoothed(n));
            assert!(smooth.excess.amount <= EXCESS && at_points.excess.amount <= EXCESS);
            assert!((smooth_gap - gap).abs() < TREATMENTS, "{name}, {n} segments: {gap} {smooth_gap}");
            assert!(smooth_gap < 0.5 * last, "{name}, {n} segments: {last} {smooth_gap}");
            last = smooth_gap;
            assert!(at_points.passes.is_empty() && at_points.trajectory.phases[0].costate.is_some());
            assert!(smooth.trajectory.phases[0].costate.is_none());
            let found = smooth.passes.last().unwrap();
            assert_eq!(found.epsilon, 1e-4);
            assert!(smooth.passes.windows(2).all(|p| p[1].epsilon <= p[0].epsilon && p[1].tau <= p[0].tau));
        }
    }
}

/// A mixed constraint of inputs and states.
#[test]
fn a_constraint_with_controls() {
    let gaps = [10, 20, 40].map(|n| solved("rayleigh_path", segments(n)).1);
    assert!(gaps[1] < 0.5 * gaps[0] && gaps[2] < 0.5 * gaps[1], "{gaps:?}");
    let (_, gap) = solved("rayleigh_path", smoothed(10));
    assert!((gap - gaps[0]).abs() < TREATMENTS_WITH_CONTROLS, "{gap} {gaps:?}");
}

/// A switch in the middle of one of five equal segments.
#[test]
fn free_lengths_find_a_switch() {
    let problem = apsides_problems::find("di_bang_bang").unwrap();
    let case = problem.pose().unwrap();
    let equal = PiecewiseConstant { settings: segments(5) }.solve(&case.ocp, &case.guess).unwrap();
    let found = problem.optimum.relative_difference(equal.trajectory.objective).abs();
    assert!((found - 0.04).abs() < SOLVER, "{found}");
    let (solution, gap) = solved("di_bang_bang", free(5));
    assert!(gap.abs() < SOLVER_OPTIMUM, "{gap}");
    let phase = &solution.trajectory.phases[0];
    let middle = 0.5 * (phase.initial_time + phase.final_time);
    assert!(
        phase.control.breaks().iter().any(|t| (t - middle).abs() < SOLVER),
        "{:?}",
        phase.control.breaks()
    );
}

#[test]
fn free_lengths_are_never_worse() {
    for name in ["bryson_denham", "bryson_denham_contact", "brachistochrone_wall", "van_der_pol", "delta_iii"]
    {
        let ((_, equal), (solution, gap)) = (solved(name, segments(10)), solved(name, free(10)));
        assert!(gap <= equal + 1e-9, "{name}: {equal} {gap}");
        assert_eq!(solution.starts.len(), 6);
        let t = &solution.trajectory.phases[0];
        let least = 0.05 * (t.final_time - t.initial_time) / 10.0;
        assert!(t.control.breaks().windows(2).all(|w| w[1] - w[0] > least - 1e-6), "{name}");
    }
    // An arc below the ceiling needs fewer segments than those beside it.
    let ((_, equal), (_, gap)) = (solved("bryson_denham", segments(10)), solved("bryson_denham", free(10)));
    assert!(gap < 0.5 * equal, "{equal} {gap}");
}

#[test]
fn the_same_seed_gives_the_same_bits() {
    let run = || solved("van_der_pol", free(10)).0;
    let (one, other) = (run(), run());
    assert_eq!(one.starts, other.starts);
    assert_eq!(one.trajectory.objective.to_bits(), other.trajectory.objective.to_bits());
}

#[test]
fn segments_are_divided_until_nothing_is_to_be_gained() {
    for (name, lengths) in [
        ("brachistochrone_free_y", Lengths::Equal),
        ("bryson_denham", Lengths::Equal),
        ("bryson_denham", Lengths::Free(FreeLengths::default())),
        ("linear_tangent", Lengths::Free(FreeLengths::default())),
    ] {
        let settings =
            PiecewiseSettings { tolerance: TOLERANCE, max_refinements: 100, lengths, ..segments(4) };
        let (solution, gap) = solved(name, settings);
        assert!(
            gap < TOLERANCE && solution.gain <= TOLERANCE,
            "{name}: gap {gap}, expected {}",
            solution.gain
        );
    }
    let problem = apsides_problems::find("linear_tangent").unwrap();
    let case = problem.pose().unwrap();
    let settings =
        PiecewiseSettings { tolerance: 1e-9, max_refinements: 100, max_intervals: 20, ..segments(4) };
    let solution = PiecewiseConstant { settings }.solve(&case.ocp, &case.guess).unwrap();
    assert!(solution.status.is_success() && !solution.accurate);
    assert!(solution.trajectory.phases[0].mesh.intervals() <= 20);
}

#[test]
fn controls_are_constant_from_the_start_of_each_segment() {
    let (solution, _) = solved("linear_tangent", segments(7));
    let control = &solution.trajectory.phases[0].control;
    assert_eq!(control.segments().len(), 7);
    for (k, segment) in control.segments().iter().enumerate() {
        assert_eq!(segment.values.len(), control.dimension());
        assert_eq!(control.node_times(k).next(), Some(control.breaks()[k]));
    }
}

#[test]
fn bad_settings_are_refused_by_name() {
    let case = apsides_problems::find("bryson_denham").unwrap().pose().unwrap();
    let refused = |settings: PiecewiseSettings, name: &str| {
        let error = PiecewiseConstant { settings }.solve(&case.ocp, &case.guess).unwrap_err().to_string();
        assert!(error.contains(&format!("`{name}`")), "{error}");
    };
    refused(segments(0), "intervals");
    refused(PiecewiseSettings { constraints: Constraints::Points(0), ..segments(3) }, "constraints");
    refused(PiecewiseSettings { tolerance: f64::NAN, ..segments(3) }, "tolerance");
    refused(PiecewiseSettings { max_intervals: 0, ..segments(3) }, "max_intervals");
    let length = |free: FreeLengths| PiecewiseSettings { lengths: Lengths::Free(free), ..segments(3) };
    refused(length(FreeLengths { least: 0.0, ..Default::default() }), "least");
    refused(length(FreeLengths { least: f64::NAN, ..Default::default() }), "least");
    refused(length(FreeLengths { starts: 0, ..Default::default() }), "starts");
    let smooth =
        |t: Transcription| PiecewiseSettings { constraints: Constraints::LEpsilon(t), ..segments(3) };
    refused(smooth(Transcription { epsilon: -1e-3, ..Default::default() }), "epsilon");
    refused(smooth(Transcription { epsilon: f64::NAN, ..Default::default() }), "epsilon");
    refused(smooth(Transcription { least_epsilon: 0.1, ..Default::default() }), "least_epsilon");
    refused(smooth(Transcription { tau: f64::INFINITY, ..Default::default() }), "tau");
    refused(smooth(Transcription { max_refinements: 1000, ..Default::default() }), "max_refinements");
    let mut threads = segments(3);
    threads.shooting.threads = 0;
    refused(threads, "threads");
}
