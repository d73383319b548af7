//! Problems of the gallery with other numbers: fixed ends and times move by up to 3 and 5 %, bounds of controls by up to 5 %.

use std::error::Error;

use apsides::radau::Radau;
use apsides_convex::{DescentLimits, DescentProblem, DescentSettings, DescentSolver, Outcome};
use apsides_ocp::{Bounds, EndpointInput, Guess, Ocp, Sense};
use apsides_problems::delta_iii::EARTH_RADIUS;

/// Relative change of ends, and of bounds and times.
const END: f64 = 0.03;
const BOUND: f64 = 0.05;

/// Numbers from -1 to 1 (D. E. Knuth's linear congruential generator).
struct Random(u64);

impl Random {
    /// The numbers of a case.
    fn of_case(case: u64) -> Self {
        let mut random = Self(case.wrapping_mul(7919).wrapping_add(12345));
        (0..10).for_each(|_| _ = random.next());
        random
    }

    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn moved(&mut self, bounds: Bounds, amount: f64) -> Bounds {
        let factor = 1.0 + amount * self.next();
        if bounds.is_fixed() { Bounds::fixed(bounds.lower * factor) } else { bounds }
    }
}

/// Moves the numbers of a problem to those of a case.
pub fn perturb(ocp: &mut Ocp, case: u64) {
    let mut random = Random::of_case(case);
    for phase in &mut ocp.phases {
        for state in &mut phase.states {
            let within = state.variable.bounds;
            for end in [&mut state.initial, &mut state.terminal] {
                *end = random.moved(*end, END);
                if end.is_fixed() {
                    *end = Bounds::fixed(within.clamp(end.lower));
                }
            }
        }
        for control in &mut phase.controls {
            let (factor, Bounds { lower, upper }) = (1.0 + BOUND * random.next(), control.bounds);
            if lower.is_finite() && upper.is_finite() {
                control.bounds = Bounds::new(lower * factor, upper * factor);
            }
        }
        if phase.initial_time.lower == 0.0 && phase.initial_time.is_fixed() {
            phase.final_time = random.moved(phase.final_time, BOUND);
        }
    }
}

/// The reason why a perturbed problem has no solution, by a relaxation of it or by its start; none where it is not known.
///
/// A descent is relaxed to a convex program, which lets go of the least thrust and of the limits of single components: what it cannot reach, no
/// flight can. A launcher that may arrive with next to no mass, and burn twice as long, has a flight of least time (by collocation: least among
/// those near it), which ends after its fuel; or it
/// starts many kilometres below the ground, in air through which no thrust carries it.
///
/// # Errors
/// Data that a solver refuses.
pub fn why_unsolvable(name: &str, ocp: &Ocp, guess: &Guess) -> Result<Option<String>, Box<dyn Error>> {
    let start: Vec<f64> = ocp.phases[0].states.iter().map(|s| s.initial.lower).collect();
    match name {
        "powered_descent" => descent(&start, None),
        "powered_descent_above_ground" => descent(&start, Some(0.0)),
        "powered_descent_glide_slope" => descent(&start, Some(SLOPE_DEG.to_radians())),
        "delta_iii" => launch(&start, ocp, guess),
        _ => Ok(None),
    }
}

/// Least elevation of the descent above its site.
const SLOPE_DEG: f64 = 4.0;
/// Depth at which the air of that problem is 16 times as dense as on the ground, m.
const DEEP: f64 = 20_000.0;
/// Part of its payload with which a launcher may arrive in the relaxed problem.
const NEXT_TO_NOTHING: f64 = 0.05;

fn descent(start: &[f64], glide_slope: Option<f64>) -> Result<Option<String>, Box<dyn Error>> {
    let &[x, z, vx, vz, mass] = start else { return Ok(None) };
    let problem = DescentProblem {
        mass,
        position: [z, 0.0, x],
        velocity: [vz, 0.0, vx],
        limits: DescentLimits { glide_slope, ..DescentLimits::default() },
        ..DescentProblem::mars_lander()
    };
    let outcome = DescentSolver::new(&problem, DescentSettings::default())?.solve()?.outcome;
    Ok((!matches!(outcome, Outcome::Landed)).then(|| outcome.to_string()))
}

fn launch(start: &[f64], ocp: &Ocp, guess: &Guess) -> Result<Option<String>, Box<dyn Error>> {
    let depth = EARTH_RADIUS - start[..3].iter().map(|r| r * r).sum::<f64>().sqrt();
    if depth > DEEP {
        return Ok(Some(format!("it starts {:.0} km below the ground", depth / 1e3)));
    }
    let mut relaxed = ocp.clone();
    for state in relaxed.phases.iter_mut().filter_map(|phase| phase.states.last_mut()) {
        let bounds = &mut state.variable.bounds;
        let payload = bounds.lower;
        bounds.lower *= NEXT_TO_NOTHING;
        for end in [&mut state.initial, &mut state.terminal].into_iter().filter(|e| e.lower == payload) {
            end.lower = bounds.lower;
        }
    }
    let last = relaxed.phases.len() - 1;
    let burn_out = relaxed.phases[last].final_time.upper;
    relaxed.phases[last].final_time.upper = 2.0 * burn_out;
    relaxed.objective.sense = Sense::Minimize;
    relaxed.objective.linear = vec![(EndpointInput::FinalTime { phase: last }, 1.0)];
    relaxed.objective.scale = Some(burn_out);
    let solution = Radau::default().solve(&relaxed, guess)?;
    let arrival = solution.trajectory.phases[last].final_time;
    let is_late = solution.status.is_success() && arrival > burn_out;
    Ok(is_late.then(|| {
        format!("it arrives at {arrival:.1} s at the earliest, after the end of its fuel at {burn_out:.1} s")
    }))
}
