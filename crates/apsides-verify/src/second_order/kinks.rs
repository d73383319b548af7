//! Kinks of the Lagrangian in states, time and parameters, where the trajectory passes them, touches them or rests at them.
//!
//! ```text
//! 2 dJ  gains   (c / |s'|) (s_x dx + s_t dt + s_p dp)^2     at an instant at which s passes zero,   [L_z] = c s_z
//! ```
//!
//! `s` is the argument of the kink, `[L_z]` the jump of the gradient of the Lagrangian from the side where it is negative to that where it is
//! positive: the second derivative of `L` holds `c` times Dirac's delta of `s`, the integral of which over time is `1 / |s'|`. Where `s'` differs
//! on both sides of the instant, since the control jumps there, or where the instant is an end of the phase, the term holds for one sign of the
//! change each, and the lesser one counts: with the opposite sign a change is as well a change.
//!
//! Where `s` touches zero without a rate, a change that moves it over the kink adds a power of 3/2 of its size, and where it rests there the
//! first power, both with the sign of `c`. Of a concave kink this is the limit of a small rate. A convex kink adds nothing below zero, and along a rest no
//! change that leaves it is critical.
//!
//! A root of zero, as in the length of a vector of states, is a kink that is not known so: where one is zero inside the phase, the second
//! variation is not known.
//!
//! The same expansion in terms of local corners: A. Griewank, Optim. Methods Softw. 28 (2013) 1139, doi 10.1080/10556788.2013.796683;
//! the instants as interior points of a phase: A. E. Bryson and Y.-C. Ho, Applied Optimal Control, 1975, section 3.7.

use std::sync::Arc;

use apsides_ad::{Formula, FormulaKink, NodeFunction, formula_node};

use crate::optimality::{PhaseConditions, SAMPLES};
use crate::place::place;

/// Samples over the nodes of an interval of a phase's control.
const SAMPLES_PER_NODE: usize = 3;
/// Arguments below this part of their size are zero.
const AT_KINK: f64 = 1e-6;
/// A part of the duration over which an argument that stays zero rests there.
const REST: f64 = 1e-3;
/// Instants of a rest that are looked at.
const OF_REST: usize = 5;
/// A jump of a rate times the duration, relative to the scale of its state, or of the Hamiltonian relative to its size, that is none.
const JUMPING: f64 = 1e-6;
/// The jump of a gradient times the size of the argument, relative to the Hamiltonian, that is none.
const NO_KINK: f64 = 1e-9;
/// Instants closer to an end of an interval of the control than this part of it are at the end.
const AT_BREAK: f64 = 1e-9;
const BISECTIONS: usize = 80;

/// An instant at which the trajectory is at a kink.
pub(super) struct Passage {
    /// Interval of the control on the side that was looked at.
    pub(super) segment: usize,
    pub(super) time: f64,
    /// Gradient of the argument over `[x, u, p, t]`, without its part in the controls.
    pub(super) gradient: Vec<f64>,
    /// Curvature along the gradient; none where the argument rests at a convex kink.
    pub(super) coefficient: Option<f64>,
    /// False where the curvature is a lower bound alone.
    pub(super) is_exact: bool,
}

/// The kinks of a phase.
#[derive(Default)]
pub(super) struct Kinks {
    pub(super) passages: Vec<Passage>,
    /// The reason why the second variation is not known.
    pub(super) remark: Option<String>,
}

/// A function of the phase with the arguments of its kinks.
struct Kinked {
    index: usize,
    formula: Formula,
    kinks: Vec<FormulaKink>,
    arguments: Arc<dyn NodeFunction>,
}

/// The arguments at a time.
struct Arguments {
    segment: usize,
    time: f64,
    values: Vec<f64>,
    rates: Vec<f64>,
}

/// The way in which a trajectory is at a kink.
#[derive(Clone, Copy, PartialEq)]
enum Stay {
    Passes,
    Touches,
    Rests,
    /// At the start or the end of the phase.
    Begins,
    Ends,
}

/// The jump of the gradient over that of the argument, on one side of an instant.
struct Strength {
    gradient: Vec<f64>,
    rate: f64,
    /// `c`; none where a function jumps.
    jump: Option<f64>,
    has_controls: bool,
}

/// The kinks that a phase is at; `is_first` of its problem, `moves` if times between its ends may change.
pub(super) fn find(conditions: &mut PhaseConditions<'_>, is_first: bool, moves: bool) -> Kinks {
    let mut found = Kinks { passages: Vec::new(), remark: root_of_zero(conditions) };
    for kinked in kinked_functions(conditions) {
        let samples = samples(conditions, &kinked);
        for k in 0..kinked.kinks.len() {
            let size = size(conditions, &kinked, k, &samples);
            if size > 0.0 {
                let mut one = OneKink { conditions: &mut *conditions, kinked: &kinked, k, size };
                let refined = one.with_extrema(&samples);
                for (stay, at) in one.stays(&refined) {
                    one.add(stay, &at, is_first, moves, &mut found);
                }
            }
        }
    }
    found
}

/// The formulas of the functions that enter the Lagrangian, with their indices.
fn formulas(conditions: &PhaseConditions<'_>) -> Vec<(usize, Formula)> {
    let PhaseConditions { equations, point, .. } = conditions;
    let functions = equations.weighted_functions(&point.costate, &point.multipliers).enumerate();
    functions.filter_map(|(index, (function, _))| Some((index, function.formula().ok()?))).collect()
}

/// Says whether controls alone enter an output of a function.
pub(super) fn is_of_controls_alone(
    conditions: &PhaseConditions<'_>,
    function: &dyn NodeFunction,
    k: usize,
) -> bool {
    let controls = conditions.equations.nx..conditions.equations.nx + conditions.equations.nu;
    let pattern = function.pattern();
    let mut columns = pattern.columns[pattern.row_offsets[k]..pattern.row_offsets[k + 1]].iter();
    columns.all(|c| controls.contains(c))
}

/// The first root of zero inside the phase, of more than controls, in words.
fn root_of_zero(conditions: &mut PhaseConditions<'_>) -> Option<String> {
    for (index, formula) in formulas(conditions) {
        let arguments = formula_node(formula.radicands());
        let radicands = (0..arguments.outputs())
            .filter(|k| !is_of_controls_alone(conditions, arguments.as_ref(), *k))
            .collect::<Vec<_>>();
        if radicands.is_empty() {
            continue;
        }
        let kinked = Kinked { index, formula, kinks: Vec::new(), arguments };
        let samples = samples(conditions, &kinked);
        for k in radicands {
            // A radicand is as the square of an argument.
            let size = AT_KINK * samples.iter().fold(0.0, |m: f64, s| m.max(s.values[k].abs()));
            let mut one = OneKink { conditions: &mut *conditions, kinked: &kinked, k, size };
            let values = one.with_extrema(&samples);
            let inside = values.get(1..values.len().saturating_sub(1)).unwrap_or_default();
            let zero = inside.iter().find(|v| one.is_zero(v)).map(|v| v.time);
            if let Some(time) = zero {
                let place = place(conditions.equations.phase, time);
                return Some(format!(
                    "first order only: a function of the phase takes a root of zero, {place}"
                ));
            }
        }
    }
    None
}

/// The functions that enter the Lagrangian and have kinks in more than controls or time.
fn kinked_functions(conditions: &PhaseConditions<'_>) -> Vec<Kinked> {
    let with_kinks = formulas(conditions).into_iter().filter_map(|(index, formula)| {
        let all = formula.kinks();
        let every = formula_node(formula.arguments_of(&all));
        let pattern = every.pattern();
        // Those of time alone are corners that do not move.
        let is_of_time_alone = |k: usize| {
            pattern.columns[pattern.row_offsets[k]..pattern.row_offsets[k + 1]] == [every.inputs() - 1]
        };
        let is_other = |k: usize| is_of_controls_alone(conditions, every.as_ref(), k) || is_of_time_alone(k);
        let kinks: Vec<FormulaKink> =
            all.iter().enumerate().filter(|(k, _)| !is_other(*k)).map(|(_, kink)| *kink).collect();
        let arguments = formula_node(formula.arguments_of(&kinks));
        (!kinks.is_empty()).then_some(Kinked { index, formula, kinks, arguments })
    });
    with_kinks.collect()
}

/// The place at which a phase comes to a jump of its functions, in words. There costates jump, which those of a program in constant controls do not.
pub(crate) fn jump_on_the_way(conditions: &mut PhaseConditions<'_>) -> Option<String> {
    kinked_functions(conditions).into_iter().find_map(|kinked| {
        let samples = samples(conditions, &kinked);
        let jumps = (0..kinked.kinks.len()).filter(|k| kinked.kinks[*k].jumps);
        let mut found = jumps.filter_map(|k| {
            let near = AT_KINK * samples.iter().fold(0.0, |m: f64, s| m.max(s.values[k].abs()));
            let side = |s: &Arguments| if s.values[k].abs() <= near { 0 } else { s.values[k].signum() as i8 };
            samples.windows(2).find(|w| side(&w[0]) == 0 || side(&w[0]) != side(&w[1])).map(|w| w[1].time)
        });
        found.next().map(|time| place(conditions.equations.phase, time))
    })
}

/// The arguments and their rates along the phase.
fn samples(conditions: &mut PhaseConditions<'_>, kinked: &Kinked) -> Vec<Arguments> {
    let times = conditions.sample_times(SAMPLES_PER_NODE);
    times.into_iter().map(|(segment, time)| sample(conditions, kinked, segment, time)).collect()
}

fn sample(conditions: &mut PhaseConditions<'_>, kinked: &Kinked, segment: usize, time: f64) -> Arguments {
    let (values, rows) = at(conditions, kinked.arguments.as_ref(), segment, time);
    let motion = motion(conditions, segment, time);
    let rates = rows.iter().map(|row| row.iter().zip(&motion).map(|(g, v)| g * v).sum()).collect();
    Arguments { segment, time, values, rates }
}

/// Values and gradients of a function at a time of an interval.
pub(super) fn at(
    conditions: &mut PhaseConditions<'_>,
    function: &dyn NodeFunction,
    segment: usize,
    time: f64,
) -> (Vec<f64>, Vec<Vec<f64>>) {
    conditions.evaluate_within_bounds(segment, time);
    conditions.equations.values_and_jacobian(function)
}

/// Rates of `[x, u, p, t]` at the point as it was evaluated.
fn motion(conditions: &mut PhaseConditions<'_>, segment: usize, time: f64) -> Vec<f64> {
    let (nx, nu) = (conditions.equations.nx, conditions.equations.nu);
    let mut rates = vec![0.0; nx + conditions.equations.phase.integrals.len()];
    conditions.equations.rates(&mut rates);
    let mut motion = vec![0.0; conditions.equations.width()];
    motion[..nx].copy_from_slice(&rates[..nx]);
    conditions.found.control.derivative_in(segment, time, &mut motion[nx..nx + nu]);
    if let Some(last) = motion.last_mut() {
        *last = 1.0;
    }
    motion
}

/// The largest change of an argument by the scales of what it takes.
fn size(conditions: &mut PhaseConditions<'_>, kinked: &Kinked, k: usize, samples: &[Arguments]) -> f64 {
    let scaling = conditions.scaling;
    let (nx, nu, np) = (conditions.equations.nx, conditions.equations.nu, conditions.equations.np);
    let parameters: Vec<f64> = conditions.equations.parameters().iter().map(|p| p.abs()).collect();
    let scales: Vec<f64> = (scaling.states[..nx].iter().chain(&scaling.controls[..nu]))
        .chain(&parameters[..np])
        .chain([&scaling.time])
        .copied()
        .collect();
    let stride = samples.len().div_ceil(SAMPLES as usize).max(1);
    let mut largest: f64 = 0.0;
    for s in samples.iter().step_by(stride) {
        let (_, rows) = at(conditions, kinked.arguments.as_ref(), s.segment, s.time);
        largest = largest.max(rows[k].iter().zip(&scales).map(|(g, scale)| (g * scale).abs()).sum());
    }
    largest
}

/// One kink of a function, and the size of its argument.
struct OneKink<'c, 'a, 'k> {
    conditions: &'c mut PhaseConditions<'a>,
    kinked: &'k Kinked,
    k: usize,
    size: f64,
}

/// The argument at a time.
#[derive(Clone, Copy)]
struct Argument {
    segment: usize,
    time: f64,
    value: f64,
    rate: f64,
}

impl OneKink<'_, '_, '_> {
    fn value(&mut self, segment: usize, time: f64) -> Argument {
        let s = sample(self.conditions, self.kinked, segment, time);
        Argument { segment, time, value: s.values[self.k], rate: s.rates[self.k] }
    }

    fn is_zero(&self, v: &Argument) -> bool {
        v.value.abs() <= AT_KINK * self.size
    }

    /// The samples, with the extrema between them at which the argument comes nearest to zero.
    fn with_extrema(&mut self, samples: &[Arguments]) -> Vec<Argument> {
        let k = self.k;
        let values: Vec<Argument> = samples
            .iter()
            .map(|s| Argument { segment: s.segment, time: s.time, value: s.values[k], rate: s.rates[k] })
            .collect();
        let mut refined = Vec::with_capacity(values.len());
        for (i, v) in values.iter().enumerate() {
            refined.push(*v);
            let Some(next) = values.get(i + 1).filter(|n| n.segment == v.segment) else { continue };
            let side = v.value.signum();
            let comes_near = v.value * next.value > 0.0 && side * v.rate < 0.0 && side * next.rate > 0.0;
            if comes_near && !(self.is_zero(v) && self.is_zero(next)) {
                let extremum = self.bisect(*v, *next, |m| side * m.rate < 0.0);
                refined.push(extremum);
            }
        }
        refined
    }

    /// The time up to which a condition holds, from where it does to where it does not.
    fn bisect(&mut self, from: Argument, to: Argument, holds: impl Fn(&Argument) -> bool) -> Argument {
        let (mut low, mut high) = (from.time, to.time);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if !(middle > low && middle < high) {
                break;
            }
            if holds(&self.value(from.segment, middle)) { low = middle } else { high = middle }
        }
        self.value(from.segment, high)
    }

    /// The instants at which the argument is zero, each with the values on its sides.
    fn stays(&mut self, values: &[Argument]) -> Vec<(Stay, Vec<Argument>)> {
        let mut stays = Vec::new();
        let (Some(first), Some(last)) = (values.first(), values.last()) else { return stays };
        let duration = last.time - first.time;
        let mut before: Option<usize> = None;
        let mut i = 0;
        while i <= values.len() {
            let here = values.get(i);
            if here.is_some_and(|v| self.is_zero(v) || v.value.is_nan()) {
                i += 1;
                continue;
            }
            // From the value before, or the start, to this one, or the end, all are zero.
            let zeros = &values[before.map_or(0, |b| b + 1)..i];
            let rests = matches!(zeros, [a, .., b] if b.time - a.time >= REST * duration);
            match (before.map(|b| values[b]), here) {
                _ if rests => stays.extend(spread(zeros).map(|v| (Stay::Rests, vec![v]))),
                (None, Some(_)) => stays.extend(zeros.first().map(|v| (Stay::Begins, vec![*v]))),
                (Some(_), None) => stays.extend(zeros.last().map(|v| (Stay::Ends, vec![*v]))),
                (Some(b), Some(v)) if b.value * v.value < 0.0 => {
                    let range = before.unwrap_or(0)..=i;
                    stays.extend(self.crossing(&values[range]).map(|sides| (Stay::Passes, sides)));
                }
                (Some(_), Some(_)) => {
                    let nearest = zeros.iter().min_by(|a, b| a.value.abs().total_cmp(&b.value.abs()));
                    stays.extend(nearest.map(|v| (Stay::Touches, vec![*v])));
                }
                (None, None) => {}
            }
            before = Some(i);
            i += 1;
        }
        stays
    }

    /// The instant between two values of opposite signs with nothing but zeros between, on both sides if it is an end of an interval; none
    /// where the argument jumps over zero.
    fn crossing(&mut self, values: &[Argument]) -> Option<Vec<Argument>> {
        let pairs = || values.windows(2).map(|w| (w[0], w[1]));
        if let Some((a, b)) = pairs().find(|(a, b)| a.segment != b.segment) {
            // The control may jump, and the argument with it.
            return (self.is_zero(&a) || self.is_zero(&b)).then(|| vec![a, b]);
        }
        let (a, b) = pairs().find(|(a, b)| a.value * b.value <= 0.0)?;
        let side = values.first()?.value.signum();
        let at = self.bisect(a, b, |m| side * m.value > 0.0);
        let breaks = self.conditions.found.control.breaks();
        let near = AT_BREAK * (breaks[at.segment + 1] - breaks[at.segment]);
        let intervals = breaks.len() - 1;
        let (start, end) = (breaks[at.segment], breaks[at.segment + 1]);
        if at.time - start < near && at.segment > 0 {
            return Some(vec![self.value(at.segment - 1, start), self.value(at.segment, start)]);
        }
        if end - at.time < near && at.segment + 1 < intervals {
            return Some(vec![self.value(at.segment, end), self.value(at.segment + 1, end)]);
        }
        Some(vec![at])
    }

    /// Adds what the second variation gains at an instant.
    fn add(&mut self, stay: Stay, sides: &[Argument], is_first: bool, moves: bool, found: &mut Kinks) {
        let strengths: Vec<Strength> = sides.iter().map(|v| self.strength(v)).collect();
        let (Some(first), Some(side)) = (strengths.first(), sides.first()) else { return };
        let is_still = !moves && first.gradient[..first.gradient.len() - 1].iter().all(|g| *g == 0.0);
        if is_still {
            return;
        }
        if strengths.iter().any(|s| s.jump.is_none()) {
            let place = place(self.conditions.equations.phase, side.time);
            found.remark.get_or_insert_with(|| {
                format!("first order only: the equations of the phase jump, {place}, not their slopes alone")
            });
            return;
        }
        let least_rate = AT_KINK * self.size / self.conditions.scaling.time;
        let term = |s: &Strength| s.jump.unwrap_or(f64::NAN) / s.rate.abs().max(least_rate);
        let lesser = strengths.iter().map(term).fold(f64::INFINITY, f64::min);
        let is_nothing = strengths.iter().all(|s| {
            s.jump.is_some_and(|c| (c * self.size).abs() <= NO_KINK * self.conditions.hamiltonian_size)
        });
        // A control holds its argument at a kink, or leaves it, as the minimum principle says.
        let is_of_controls = strengths.iter().any(|s| s.has_controls);
        let coefficient = match stay {
            Stay::Passes => Some(lesser),
            Stay::Begins | Stay::Ends => Some(lesser.min(0.0)),
            Stay::Touches | Stay::Rests if is_of_controls => return,
            Stay::Touches => Some(lesser.min(0.0)),
            Stay::Rests => (lesser < 0.0).then_some(lesser),
        };
        if is_nothing || coefficient == Some(0.0) {
            return;
        }
        found.passages.push(Passage {
            segment: side.segment,
            time: side.time,
            gradient: first.gradient.clone(),
            coefficient,
            // The start of a later phase is the end of the one before it, where the term stands already.
            is_exact: stay != Stay::Begins || is_first,
        });
    }

    fn strength(&mut self, v: &Argument) -> Strength {
        let (_, rows) = at(self.conditions, self.kinked.arguments.as_ref(), v.segment, v.time);
        let mut gradient = rows[self.k].clone();
        let node = formula_node(self.kinked.formula.jump_at(&self.kinked.kinks[self.k]));
        let PhaseConditions { equations, point, scaling, hamiltonian_size, .. } = &*self.conditions;
        let (values, rows) = equations.values_and_jacobian(node.as_ref());
        let (nx, nu) = (equations.nx, equations.nu);
        let weights = equations.weighted_functions(&point.costate, &point.multipliers).nth(self.kinked.index);
        let weights = weights.map_or(&[][..], |(_, weights)| weights);
        let is_dynamics = self.kinked.index == 0;
        let jumps = values.iter().zip(weights).enumerate().any(|(i, (value, weight))| {
            let of_state = is_dynamics && (value * scaling.time).abs() > JUMPING * scaling.states[i];
            of_state || (value * weight).abs() > JUMPING * hamiltonian_size
        });
        let has_controls = gradient[nx..nx + nu].iter().any(|g| *g != 0.0);
        let square: f64 = gradient.iter().map(|g| g * g).sum();
        let along = rows
            .iter()
            .zip(weights)
            .map(|(row, weight)| weight * row.iter().zip(&gradient).map(|(a, b)| a * b).sum::<f64>());
        let jump = along.sum::<f64>() / square;
        gradient[nx..nx + nu].fill(0.0);
        Strength { gradient, rate: v.rate, jump: (!jumps && jump.is_finite()).then_some(jump), has_controls }
    }
}

/// Some of the values of a rest, ends included.
fn spread(values: &[Argument]) -> impl Iterator<Item = Argument> + '_ {
    (0..OF_REST).map(|k| values[k * (values.len() - 1) / (OF_REST - 1)])
}
