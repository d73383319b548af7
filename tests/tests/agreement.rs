//! Collocation, direct multiple shooting and indirect shooting agree: objectives and costates of the gallery.
//!
//! Costates are compared at 21 equal fractions of each phase, relative to the largest of the same state along the phase; those that
//! are zero throughout relative to the largest of the phase, both in units of the states' scales. The reference is indirect shooting
//! where it applies, else direct shooting. `--nocapture` prints the differences.
//!
//! Collocation has the least accurate costates of smooth problems, worst at the ends of a phase: its default mesh tolerance, 1e-8, is
//! one of the states and leaves 1e-7 to 6e-5 of the costates. Where controls have kinks, direct shooting is worse by a power of ten
//! or more.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use apsides::nlp::Status;
use apsides::ocp::{Guess, Ocp, PhaseTrajectory, Scaling, Trajectory};
use apsides::radau::Radau;
use apsides_problems::{Case, GALLERY, Problem, Structure, find};
use apsides_shooting::direct::{MultipleShooting, MultipleShootingSettings};
use apsides_shooting::indirect::IndirectShooting;

/// Where indirect shooting starts, and its segments per phase.
#[derive(Clone, Copy)]
enum Indirect {
    /// At the trajectory of the collocation.
    FromRadau(usize),
    /// At that of direct shooting.
    FromShooting(usize),
    /// The problem has what the method does not cover.
    No,
}

use Indirect::{FromRadau, FromShooting, No};

/// The agreement of the methods.
struct Agreement {
    indirect: Indirect,
    /// Largest relative difference of two objectives.
    objective: f64,
    /// Largest relative difference of the costates of collocation and of direct shooting from the reference.
    radau: f64,
    shooting: f64,
    /// True if the ends of phases count. Where a state is given at a bound there, its costate may jump by the multiplier of that
    /// bound, and only the values inside are determined: with wider bounds those of the collocation of the slides agree there, too.
    ends: bool,
    /// States that stand on a bound along an arc, whose costates are not determined there.
    undetermined: &'static [&'static str],
    /// Tolerance of the mesh where costates are far apart in size and each is compared by itself.
    mesh: Option<f64>,
    /// True if a problem with jumps is shot with a tighter tolerance of its program.
    tight: bool,
}

impl Agreement {
    const fn new(indirect: Indirect, objective: f64, radau: f64, shooting: f64) -> Self {
        Self { indirect, objective, radau, shooting, ends: true, undetermined: &[], mesh: None, tight: true }
    }

    const fn inside(self) -> Self {
        Self { ends: false, ..self }
    }

    /// At the tip of a cone the tighter program settles or not with the last bit of its data.
    const fn at_default_tolerance(self) -> Self {
        Self { tight: false, ..self }
    }

    const fn meshed_to(self, tolerance: f64) -> Self {
        Self { mesh: Some(tolerance), ..self }
    }

    const fn without(self, undetermined: &'static [&'static str]) -> Self {
        Self { undetermined, ..self }
    }

    fn fractions(&self) -> impl Iterator<Item = f64> + Clone + use<> {
        let first = i32::from(!self.ends);
        (first..=20 - first).map(|k| f64::from(k) / 20.0)
    }
}

/// A costate below this part of the largest is zero.
const ZERO: f64 = 1e-6;

fn costate(p: &PhaseTrajectory, fraction: f64, state: usize) -> f64 {
    p.costate.as_ref().unwrap().component(p.time_at(fraction), state)
}

/// The largest difference of costates and where it is.
fn difference(ocp: &Ocp, a: &Trajectory, reference: &Trajectory, how: &Agreement) -> (f64, String) {
    let scaling = Scaling::new(ocp, &Guess::earlier(reference));
    let mut worst = (0.0, String::new());
    for (k, (phase, scales)) in ocp.phases.iter().zip(&scaling.phases).enumerate() {
        let (found, reference) = (&a.phases[k], &reference.phases[k]);
        let size = |s: usize| {
            how.fractions().fold(0.0_f64, |m, f| m.max((costate(reference, f, s) * scales.states[s]).abs()))
        };
        let sizes: Vec<f64> = (0..phase.states.len()).map(size).collect();
        let largest = sizes.iter().copied().fold(0.0, f64::max);
        for (s, state) in phase.states.iter().enumerate() {
            let name = &state.variable.name;
            if how.undetermined.contains(&name.as_str()) {
                continue;
            }
            let size = if sizes[s] < ZERO * largest { largest } else { sizes[s] };
            for f in how.fractions() {
                let off = (costate(found, f, s) - costate(reference, f, s)).abs() * scales.states[s] / size;
                // A value that is not a number is the worst.
                if off > worst.0 || off.is_nan() {
                    worst = (off, format!("{name} at {f} of `{}`", phase.name));
                }
            }
        }
    }
    worst
}

fn solved(name: &str, how: &Agreement) -> (&'static Problem, Case, Vec<(&'static str, Trajectory)>) {
    let problem = find(name).unwrap();
    let case = problem.pose().unwrap();
    let mut method = Radau::default();
    method.settings.tolerance = how.mesh.unwrap_or(method.settings.tolerance);
    let collocated = method.solve(&case.ocp, &case.guess).unwrap();
    assert_eq!(collocated.status, Status::Optimal, "{name}");
    let mut settings = MultipleShootingSettings::default();
    if problem.structure == Structure::BangBang && how.tight {
        // What the barrier loses on each side of a jump is the largest error.
        settings.nlp.tolerance = 1e-10;
    }
    let shot = MultipleShooting { settings }.solve(&case.ocp, &case.guess).unwrap();
    // Along a singular arc the multipliers settle to the acceptable tolerance in some solves.
    let usable = problem.structure == Structure::Singular && shot.status.is_success();
    assert!(usable || shot.status == Status::Optimal, "{name}: {}", shot.status);
    let start = match how.indirect {
        FromRadau(segments) => Some((&collocated.trajectory, segments)),
        FromShooting(segments) => Some((&shot.trajectory, segments)),
        No => None,
    };
    let exact = start.map(|(trajectory, segments)| {
        let s = IndirectShooting::default().solve_from(&case.ocp, trajectory, segments).unwrap();
        assert_eq!(s.status, Status::Optimal, "{name}: correction {:.1e}", s.correction);
        assert!(s.exceeded.is_empty(), "{name}: {:?}", s.exceeded);
        s.trajectory.unwrap()
    });
    let mut found = vec![("collocation", collocated.trajectory), ("direct", shot.trajectory)];
    found.extend(exact.map(|t| ("indirect", t)));
    (problem, case, found)
}

fn check(name: &str, how: &Agreement) {
    let (problem, case, found) = solved(name, how);
    let (last, reference) = found.last().unwrap();
    println!("{name}: reference {last}, objective {:.12}", reference.objective);
    let mut failures = Vec::new();
    for ((method, trajectory), tolerance) in found[..found.len() - 1].iter().zip([how.radau, how.shooting]) {
        let (costates, place) = difference(&case.ocp, trajectory, reference, how);
        let objective = (trajectory.objective - reference.objective).abs() / reference.objective.abs();
        let row = format!(
            "  {method:11} objective {objective:.1e} (tolerance {:.0e}), costates {costates:.1e} (tolerance {tolerance:.0e}): {place}",
            how.objective
        );
        println!("{row}");
        if !(objective <= how.objective && costates <= tolerance) {
            failures.push(row);
        }
    }
    for (method, t) in &found {
        assert!(problem.optimum.agrees_with(t.objective), "{name}, {method}: {}", t.objective);
    }
    assert!(failures.is_empty(), "{name}:\n{}", failures.join("\n"));
}

macro_rules! agreement {
    ($($name:ident: $how:expr,)*) => {
        $(#[test] fn $name() { check(stringify!($name), &$how); })*

        /// Problems that have a row.
        const LISTED: &[&str] = &[$(stringify!($name)),*];
    };
}

/// Unstable equations over ten thousand units of time: neither shooting can integrate its segments.
const BY_COLLOCATION_ALONE: &[&str] = &["hypersensitive_long"];

// Problem: start of indirect shooting and segments; tolerance of objectives; of costates by collocation; by direct shooting.
agreement! {
    lqr_scalar: Agreement::new(FromRadau(1), 1e-11, 5e-7, 1e-9),
    di_min_energy: Agreement::new(FromRadau(1), 1e-11, 1e-11, 1e-11),
    di_min_energy_free_speed: Agreement::new(FromShooting(1), 1e-11, 1e-11, 1e-11),
    brachistochrone_free_y: Agreement::new(FromRadau(1), 1e-9, 2e-6, 2e-6).inside(),
    brachistochrone_dymos: Agreement::new(FromRadau(1), 1e-9, 2e-6, 2e-6).inside(),
    linear_tangent: Agreement::new(FromShooting(1), 1e-10, 1e-5, 1e-7),
    hypersensitive: Agreement::new(FromShooting(4), 1e-9, 5e-6, 1e-8),
    orbit_raising: Agreement::new(FromRadau(1), 1e-9, 5e-7, 5e-7),
    cart_pole: Agreement::new(FromRadau(1), 1e-9, 5e-7, 5e-7),
    pvtol: Agreement::new(FromRadau(1), 1e-9, 5e-7, 5e-7),
    shuttle_reentry: Agreement::new(FromShooting(1), 1e-9, 5e-6, 1e-6),
    delta_iii: Agreement::new(FromShooting(1), 1e-9, 5e-5, 1e-6),
    // A bound on the control or a constraint with controls is active along an arc. Direct shooting meets the kinks by short
    // segments, collocation by breaks.
    shuttle_heat_limit: Agreement::new(FromRadau(4), 1e-7, 1e-5, 3e-4).meshed_to(1e-9),
    // Over one segment an error of the integration grows a thousandfold.
    van_der_pol: Agreement::new(FromRadau(4), 1e-7, 1e-7, 3e-5),
    rayleigh_path: Agreement::new(FromRadau(1), 3e-7, 1e-8, 2e-5).meshed_to(1e-9),
    // Jumps, which collocation and indirect shooting place exactly.
    di_bang_bang: Agreement::new(FromRadau(1), 1e-8, 1e-8, 1e-7),
    // Without thrust the mass stands on its upper bound.
    moon_lander_soft: Agreement::new(FromShooting(1), 3e-7, 1e-6, 1e-4).inside().without(&["m"]),
    catmix_arcs: Agreement::new(FromShooting(1), 1e-9, 5e-7, 1e-8),
    // A given value of an integral.
    hanging_chain: Agreement::new(No, 1e-9, 1e-4, 0.0),
    // The altitude stands on its lower bound for the first 6 % of the time: its costate is that of a state constraint there.
    min_time_climb: Agreement::new(No, 1e-7, 3e-3, 0.0).inside(),
    // Constraints on states: costates jump at contact, which direct shooting spreads over a segment.
    brachistochrone_wall: Agreement::new(No, 3e-7, 5e-2, 0.0).inside(),
    bryson_denham: Agreement::new(No, 3e-7, 1e-2, 0.0).inside(),
    // The costate of x jumps at one of the times that are compared.
    bryson_denham_contact: Agreement::new(No, 3e-7, 1e-2, 0.0).inside().without(&["x"]),
    // Jumps of several controls and of a thrust whose size is bounded on both sides, where indirect shooting does not converge.
    free_flying_robot: Agreement::new(No, 1e-6, 1e-3, 0.0),
    powered_descent: Agreement::new(No, 1e-7, 2e-4, 0.0),
    powered_descent_above_ground: Agreement::new(No, 1e-6, 1e-3, 0.0).inside().at_default_tolerance(),
    // The vehicle ends at the tip of the cone, which both methods may exceed by 5e-7 of its scale between their points.
    powered_descent_glide_slope: Agreement::new(No, 1e-6, 1e-3, 0.0).inside().at_default_tolerance(),
    // Singular arcs.
    di_singular_arc: Agreement::new(No, 1e-7, 3e-6, 0.0),
    catmix: Agreement::new(No, 3e-7, 2e-4, 0.0),
    catmix_reversed: Agreement::new(No, 3e-7, 2e-4, 0.0),
    // After the burn the mass stands on its lower bound.
    goddard_cops: Agreement::new(No, 1e-7, 1e-4, 0.0).inside().without(&["m"]),
}

#[test]
fn every_problem_has_a_row() {
    for problem in GALLERY {
        let listed = [LISTED, BY_COLLOCATION_ALONE].iter().filter(|l| l.contains(&problem.name)).count();
        assert_eq!(listed, 1, "{}", problem.name);
    }
}

/// Costates `dJ/dx` of all states at a time.
type Exact = fn(f64) -> Vec<f64>;

/// Closed forms, with the largest difference of each method relative to the largest costate.
///
/// `lqr_scalar`: `u = -(x / 2 + lambda)`, `x' = -lambda`, `lambda' = -x`. `di_min_energy`: `u = 6 - 12 t = -lambda_v`, with a free speed
/// `u = 3 (1 - t)`. `di_bang_bang`: the farthest point is `x(1)`, the switch is at 1/2, and a speed at the start adds `x = 1 - 1/2`
/// times itself, since it has to be lost. `hanging_chain`: `x = a cosh((t - b) / a) - mu` from its length and its ends.
#[test]
fn closed_forms_decide() {
    let cases: [(&str, Exact, [f64; 2], Option<f64>); 5] = [
        ("lqr_scalar", |t| vec![(1.0 - t).sinh() / 1_f64.cosh()], [5e-7, 1e-9], Some(1e-9)),
        ("di_min_energy", |t| vec![-12.0, 12.0 * t - 6.0], [1e-10, 1e-10], Some(1e-10)),
        ("di_min_energy_free_speed", |t| vec![-3.0, 3.0 * (t - 1.0)], [1e-10, 1e-10], Some(1e-10)),
        ("di_bang_bang", |t| vec![-1.0, t - 0.5], [1e-8, 1e-7], Some(1e-10)),
        (
            "hanging_chain",
            |t| {
                let (a, b) = (0.163_697_529_524_834_f64, 0.410_079_941_219_704);
                vec![-a * ((t - b) / a).sinh()]
            },
            [1e-4, 2e-5],
            None,
        ),
    ];
    for (name, exact, [collocation, direct], indirect) in cases {
        let start = if indirect.is_some() { FromRadau(1) } else { No };
        let (_, case, found) = solved(name, &Agreement::new(start, 0.0, 0.0, 0.0));
        let tolerances = [Some(collocation), Some(direct), indirect];
        for ((method, trajectory), tolerance) in found.iter().zip(tolerances.into_iter().flatten()) {
            let phase = &trajectory.phases[0];
            let at = |k: u32| {
                let fraction = f64::from(k) / 20.0;
                let found: Vec<f64> =
                    (0..case.ocp.phases[0].states.len()).map(|s| costate(phase, fraction, s)).collect();
                (found, exact(phase.time_at(fraction)))
            };
            let samples: Vec<_> = (0..=20).map(at).collect();
            let size = samples.iter().flat_map(|s| &s.1).fold(0.0_f64, |m, v| m.max(v.abs()));
            let off = samples.iter().flat_map(|(a, b)| a.iter().zip(b)).map(|(a, b)| (a - b).abs() / size);
            let worst = off.fold(0.0, |m: f64, v| if v > m || v.is_nan() { v } else { m });
            println!("{name}, {method}: {worst:.1e} from the closed form (tolerance {tolerance:.0e})");
            assert!(worst <= tolerance, "{name}, {method}: {worst:.1e}");
        }
    }
}
