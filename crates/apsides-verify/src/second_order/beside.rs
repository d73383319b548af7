//! Curvature of the functions a short way beside the flight, where it is less than on it.
//!
//! The second variation has the second derivatives on the flight. Where these jump there, as those of `x abs(x)` do at zero, they tell one
//! side alone, and where they hold for a way that no change keeps to, none:
//!
//! ```text
//! (L_z(z + h d) - L_z(z)) d / h  <  d' L_zz(z) d     for steps h of 1e-4, 1e-5 and 1e-6 of the scales, by more than part of it
//! ```
//!
//! The difference falls with the step where functions are smooth, to a tenth each time; here it keeps half of its amount. A flight that passes such
//! a place is there for an instant, which changes nothing: it counts where the flight rests.

use std::sync::Arc;

use apsides_ad::formula::{Binary, Operation, Unary};
use apsides_ad::{NodeFunction, formula_node};
use apsides_ocp::{Bounds, Ocp, Trajectory};

use super::kinks;
use crate::ends::{EndScales, Ends, allowed};
use crate::equations::sign;
use crate::optimality::PhaseConditions;
use crate::place::place;
use crate::worst::relative;

/// Steps, in the scales of the quantities.
const STEPS: [f64; 3] = [1e-4, 1e-5, 1e-6];
/// Part of what is less after one step that is less after a tenth of it.
const LASTING: f64 = 0.5;
/// Parts of the curvature itself, and of the largest curvature in any quantity, that are none.
const NONE: [f64; 2] = [1e-3, 1e-6];
/// Part of the sizes of the terms that is rounding in a difference over the shortest step.
const ROUNDING: f64 = 1e-8;
/// A fall of the Hamiltonian, relative to its size, that is none of rounding or of slopes.
const EVIDENT: f64 = 1e-6;
/// Instants of a phase that are looked at, and those in a row that make a rest.
const INSTANTS: usize = 60;
const AT_REST: usize = 3;
/// A radicand that is everywhere above this part of its largest value has roots whose curvature hardly changes over the steps.
const FAR: f64 = 1e-2;
/// Directions beside those along single quantities.
const DIRECTIONS: usize = 16;

/// Where the curvature is less beside the flight than on it, in words.
pub(super) fn remark(
    ocp: &Ocp,
    trajectory: &Trajectory,
    scales: &EndScales<'_>,
    conditions: &mut [PhaseConditions<'_>],
) -> Option<String> {
    let along = conditions.iter_mut().find_map(rest);
    let at = along.or_else(|| at_ends(ocp, trajectory, scales))?;
    Some(format!(
        "first order only: the curvature of the functions is less a short way beside the flight, {at}"
    ))
}

/// The first rest of a phase at such a place.
fn rest(conditions: &mut PhaseConditions<'_>) -> Option<String> {
    let times = conditions.sample_times(1);
    let stride = times.len().div_ceil(INSTANTS).max(1);
    let times: Vec<(usize, f64)> = times.into_iter().step_by(stride).collect();
    if is_smooth(conditions, &times) {
        return None;
    }
    let mut row = 0;
    for (segment, time) in times {
        row = if is_less_at(conditions, segment, time) { row + 1 } else { 0 };
        if row == AT_REST {
            return Some(place(conditions.equations.phase, time));
        }
    }
    None
}

/// The largest fall of the Hamiltonian, relative to its size, that stays however short the way beside the flight is, and its place: the flight
/// rests at the edge of what it would gain by. None where no formula has jumps, or the flight only passes one.
pub(super) fn jump(conditions: &mut [PhaseConditions<'_>]) -> Option<(f64, String)> {
    let of_phase = |conditions: &mut PhaseConditions<'_>| {
        let phase = conditions.equations.phase;
        let rates = std::iter::once(&phase.dynamics).chain(phase.integrals.iter().map(|q| &q.function));
        let jumps = |f: &Arc<dyn NodeFunction>| {
            f.formula().is_ok_and(|formula| formula.kinks().iter().any(|kink| kink.jumps))
        };
        if !rates.into_iter().any(jumps) {
            return None;
        }
        let times = conditions.sample_times(1);
        let stride = times.len().div_ceil(INSTANTS).max(1);
        let (mut row, mut least) = (0, f64::INFINITY);
        for (segment, time) in times.into_iter().step_by(stride) {
            let fall = fall_at(conditions, segment, time);
            (row, least) = if fall > 0.0 { (row + 1, least.min(fall)) } else { (0, f64::INFINITY) };
            if row == AT_REST {
                return Some((least, place(phase, time)));
            }
        }
        None
    };
    conditions.iter_mut().filter_map(of_phase).max_by(|a, b| a.0.total_cmp(&b.0))
}

/// The fall of the Hamiltonian over the shortest way along the states, relative to its size; zero where it is less than over longer ways, as a
/// slope makes it.
fn fall_at(conditions: &mut PhaseConditions<'_>, segment: usize, time: f64) -> f64 {
    let here = conditions.evaluate_within_bounds(segment, time).value;
    let PhaseConditions { equations, point, scaling, hamiltonian_size, .. } = conditions;
    let states = &equations.phase.states;
    let mut x = point.x.clone();
    let mut largest = 0.0_f64;
    for direction in directions(states.len()) {
        let mut falls = [0.0; STEPS.len()];
        for (fall, h) in falls.iter_mut().zip(STEPS) {
            for (i, state) in states.iter().enumerate() {
                x[i] = point.x[i] + h * direction[i] * scaling.states[i];
                if leaves(&state.variable.bounds, point.x[i], x[i]) {
                    x[i] = point.x[i];
                }
            }
            equations.set(point.time, &x, &point.u);
            *fall = here - equations.hamiltonian(&point.costate);
        }
        let [far, .., near] = falls;
        if near > LASTING * far.abs() {
            largest = largest.max(near);
        }
    }
    let size = hamiltonian_size.max(here.abs()).max(largest);
    let fall = relative(largest, size);
    if fall > EVIDENT { fall } else { 0.0 }
}

/// Says whether the functions of the phase are formulas whose second derivatives jump nowhere near the trajectory.
fn is_smooth(conditions: &mut PhaseConditions<'_>, times: &[(usize, f64)]) -> bool {
    let phase = conditions.equations.phase;
    phase.functions().all(|function| {
        function.formula().is_ok_and(|formula| {
            if !formula.operations().iter().all(is_smooth_operation) || !formula.kinks().is_empty() {
                return false;
            }
            let radicands = formula_node(formula.radicands());
            let mut extrema = vec![[f64::INFINITY, 0.0_f64]; radicands.outputs()];
            for (segment, time) in times {
                let (values, _) = kinks::at(conditions, radicands.as_ref(), *segment, *time);
                for ([least, largest], value) in extrema.iter_mut().zip(&values) {
                    // What is no number is far from nothing.
                    (*least, *largest) = (least.min(value.abs()), largest.max(value.abs()));
                }
            }
            extrema.iter().enumerate().all(|(k, [least, largest])| {
                kinks::is_of_controls_alone(conditions, radicands.as_ref(), k) || *least > FAR * largest
            })
        })
    })
}

/// Operations with all derivatives where they have values, but for roots at zero.
fn is_smooth_operation(operation: &Operation) -> bool {
    match operation {
        Operation::Constant(_) | Operation::Powi(..) => true,
        Operation::Powf(_, exponent) => *exponent < 2.0,
        Operation::Unary(f, _) => {
            !matches!(f, Unary::Abs | Unary::Sign | Unary::Asin | Unary::Acos | Unary::Acosh)
        }
        Operation::Binary(f, ..) => matches!(f, Binary::Add | Binary::Sub | Binary::Mul | Binary::Div),
        Operation::Select(..) | Operation::Curve(..) | Operation::Surface(..) => false,
    }
}

/// Says whether the curvature along the states is less beside a time of the phase.
fn is_less_at(conditions: &mut PhaseConditions<'_>, segment: usize, time: f64) -> bool {
    conditions.evaluate_within_bounds(segment, time);
    let PhaseConditions { equations, point, scaling, control_scales, hamiltonian_size, .. } = conditions;
    let (nx, nu, width) = (equations.nx, equations.nu, equations.width());
    let scales = &scaling.states[..nx];
    let (mut hessian, mut of_path) = (vec![0.0; width * width], vec![0.0; width * width]);
    equations.curvature(&point.costate, &point.multipliers, &mut hessian, &mut of_path);
    let entry = |i: usize, j: usize| hessian[i * width + j] + of_path[i * width + j];
    let scaled = (0..nx * nx).map(|k| entry(k / nx, k % nx) * scales[k / nx] * scales[k % nx]).collect();
    let of_controls = (0..nu).map(|k| (entry(nx + k, nx + k) * control_scales[k].powi(2)).abs());
    let curve = Curve {
        slopes: point.gradient.iter().zip(scales).map(|(g, s)| g * s).collect(),
        hessian: scaled,
        of_others: of_controls.fold(0.0, f64::max),
        size: *hamiltonian_size,
    };
    let (mut x, mut gradient) = (point.x.clone(), vec![0.0; width]);
    let states = &equations.phase.states;
    curve.is_less_beside(|step, slopes| {
        for i in 0..nx {
            x[i] = point.x[i] + step[i] * scales[i];
            if leaves(&states[i].variable.bounds, point.x[i], x[i]) {
                return false;
            }
        }
        equations.set(point.time, &x, &point.u);
        equations.lagrangian(&point.costate, &point.multipliers, &mut gradient);
        slopes.iter_mut().zip(&gradient).zip(scales).for_each(|((slope, g), s)| *slope = g * s);
        true
    })
}

/// The first function of the ends whose curvature is less beside them.
fn at_ends(ocp: &Ocp, trajectory: &Trajectory, scales: &EndScales<'_>) -> Option<String> {
    let ends = Ends::of(trajectory);
    let cost = [sign(ocp)];
    let objective = &ocp.objective;
    let of_cost = objective.functions.iter().map(|(inputs, f)| (inputs, f, &cost[..], &objective.name));
    let multipliers = trajectory.constraint_multipliers.as_deref().unwrap_or_default();
    let constraints = ocp.constraints.iter().zip(multipliers);
    let constraints = constraints.map(|(c, m)| (&c.inputs, &c.function, &m[..], &c.name));
    for (inputs, function, weights, name) in of_cost.chain(constraints) {
        let bounds: Vec<Bounds> = inputs.iter().map(|i| allowed(ocp, *i)).collect();
        let sizes = inputs.iter().zip(&bounds);
        let sizes: Vec<f64> = sizes.map(|(i, b)| if b.is_fixed() { 0.0 } else { scales.scale(*i) }).collect();
        let z: Vec<f64> = inputs.iter().map(|i| ends.value(*i)).collect();
        let pattern = function.pattern();
        let (mut values, mut entries) = (vec![0.0; function.outputs()], vec![0.0; pattern.jacobian_len()]);
        let mut slopes_at = |z: &[f64], slopes: &mut [f64]| {
            function.jacobian(z, &mut values, &mut entries);
            slopes.fill(0.0);
            for ((row, column), v) in pattern.jacobian_entries().zip(&entries) {
                slopes[column] += weights[row] * v * sizes[column];
            }
        };
        let n = z.len();
        let mut slopes = vec![0.0; n];
        slopes_at(&z, &mut slopes);
        let (mut curvature, mut hessian) = (vec![0.0; pattern.hessian_len()], vec![0.0; n * n]);
        function.hessian(&z, weights, &mut curvature);
        for (&(i, j), v) in pattern.hessian.iter().zip(&curvature) {
            hessian[i * n + j] = v * sizes[i] * sizes[j];
            hessian[j * n + i] = hessian[i * n + j];
        }
        let size = slopes.iter().fold(0.0, |m: f64, s| m.max(s.abs()));
        let curve = Curve { slopes, hessian, of_others: 0.0, size };
        let mut beside = z.clone();
        let is_less = curve.is_less_beside(|step, slopes| {
            for i in 0..n {
                beside[i] = z[i] + step[i] * sizes[i];
                if leaves(&bounds[i], z[i], beside[i]) {
                    return false;
                }
            }
            slopes_at(&beside, slopes);
            true
        });
        if is_less {
            return Some(format!("in `{name}` at the ends"));
        }
    }
    None
}

/// Says whether a step leads out of bounds, or farther out.
fn leaves(bounds: &Bounds, from: f64, to: f64) -> bool {
    bounds.excess(to) > bounds.excess(from).max(0.0)
}

/// Slopes and curvature of a function at a point, in the scales of its quantities.
struct Curve {
    slopes: Vec<f64>,
    /// By rows.
    hessian: Vec<f64>,
    /// The largest curvature in quantities that stay.
    of_others: f64,
    /// Size of its terms.
    size: f64,
}

impl Curve {
    /// Says whether the curvature is less beside the point along some direction. `slopes_at` writes the slopes a step away; false where that is
    /// not admissible.
    fn is_less_beside(&self, mut slopes_at: impl FnMut(&[f64], &mut [f64]) -> bool) -> bool {
        let n = self.slopes.len();
        let (mut step, mut slopes) = (vec![0.0; n], vec![0.0; n]);
        directions(n).any(|direction| {
            let stated: f64 = (0..n * n).map(|k| direction[k / n] * self.hessian[k] * direction[k % n]).sum();
            let mut before = 0.0;
            for h in STEPS {
                step.iter_mut().zip(&direction).for_each(|(s, d)| *s = h * d);
                if !slopes_at(&step, &mut slopes) {
                    return false;
                }
                let change = |k: usize| direction[k] * (slopes[k] - self.slopes[k]);
                let curvature = (0..n).map(change).sum::<f64>() / h;
                let [part, of_largest] = NONE;
                let own = stated.abs().max(curvature.abs());
                let none = (part * own).max(of_largest * self.of_others).max(ROUNDING * self.size);
                let less = stated - curvature;
                // Slopes that are not known show nothing.
                if !(less > none && less > LASTING * before) {
                    return false;
                }
                before = less;
            }
            true
        })
    }
}

/// Directions both ways along each quantity, and across them.
fn directions(n: usize) -> impl Iterator<Item = Vec<f64>> {
    let along = (0..2 * n).map(move |k| {
        let mut direction = vec![0.0; n];
        direction[k / 2] = if k % 2 == 0 { 1.0 } else { -1.0 };
        direction
    });
    // Equidistributed, by the golden ratio.
    let across = (0..if n > 1 { DIRECTIONS } else { 0 }).map(move |k| {
        let turn = |i: usize| (0.5 + (k * n + i) as f64 * 0.618_033_988_749_894_9).fract();
        (0..n).map(|i| 2.0 * turn(i) - 1.0).collect()
    });
    along.chain(across)
}
