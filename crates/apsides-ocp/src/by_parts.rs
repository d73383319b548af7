//! Magnitudes of controls by parts that have no kink.
//!
//! ```text
//! e = p - n,   |e| = p + n,   max(a, b) = b + p,   min(a, b) = b - n   with e = a - b,   p, n >= 0
//! ```
//!
//! holds where one of the parts is zero, as it is at an optimum that pays for the magnitude: a thruster to either side is two thrusters
//! (A. E. Bryson and Y.-C. Ho, Applied Optimal Control, Taylor and Francis 1975, section 3.9). Newton's method, which a kink at rest turns
//! back from either side, sees linear terms and bounds. How far the parts overlap is measured ([`ByParts::overlap`]): where they do, the
//! problem with parts is another one.

use std::collections::BTreeMap;
use std::sync::Arc;

use apsides_ad::formula::{Binary, Operation, Unary};
use apsides_ad::{AdError, Formula, FormulaBuilder, NodeFunction, Value, formula_node};

use crate::rewrite::rewrite;
use crate::{
    Bounds, Guess, Kink, Ocp, PathConstraint, Phase, PhaseGuess, PhaseTrajectory, Trajectory, Variable,
};

/// Points at which the parts of a guess are taken.
const SAMPLES: usize = 65;
/// Most magnitudes of a phase that get parts.
const MOST: usize = 8;

/// The magnitudes that get parts.
#[derive(Clone, Copy, PartialEq)]
enum Inputs {
    /// Those that a control enters.
    Controls,
    /// Those that a state enters, too.
    StatesToo,
}

/// A problem in which magnitudes of controls are stated by their parts.
pub struct ByParts {
    /// The problem with parts.
    pub ocp: Ocp,
    phases: Vec<PhaseParts>,
}

/// The magnitudes of a phase, with its sizes as it was posed.
struct PhaseParts {
    magnitudes: Vec<Magnitude>,
    controls: usize,
    rows: usize,
}

/// A difference `e = a - b` of controls, and its parts.
struct Magnitude {
    /// Place of the positive part among the controls; where the difference is a control, it is that one's.
    positive: usize,
    /// Place of the negative part.
    negative: usize,
    /// The control that the difference is, else `a`, and `b` if it is not zero, by states, controls, parameters and time as they were posed.
    difference: Origin,
}

enum Origin {
    Control(usize),
    Formula(Formula),
}

impl ByParts {
    /// The problem with parts; none where no magnitude of a control occurs.
    #[must_use]
    pub fn of(ocp: &Ocp) -> Option<Self> {
        Self::with(ocp, Inputs::Controls)
    }

    /// The problem with parts of the magnitudes of states, too; none where none occurs. Such a magnitude has a kink at one value of the state, which a
    /// mesh can follow where the state passes it, but not along an arc that stays there.
    #[must_use]
    pub fn of_states_too(ocp: &Ocp) -> Option<Self> {
        let count = |parts: &Self| parts.phases.iter().map(|p| p.magnitudes.len()).sum::<usize>();
        let of_controls = Self::of(ocp).as_ref().map_or(0, count);
        Self::with(ocp, Inputs::StatesToo).filter(|parts| count(parts) > of_controls)
    }

    fn with(ocp: &Ocp, among: Inputs) -> Option<Self> {
        let mut by_parts = ocp.clone();
        let mut phases = Vec::new();
        for (phase, posed) in by_parts.phases.iter_mut().zip(&ocp.phases) {
            let mut magnitudes = Vec::new();
            // Of a function that is no formula nothing is known, and a phase without magnitudes stays as it is.
            if let Some(Ok(split)) = Search::of(ocp, posed, among).map(|search| search.split()) {
                (*phase, magnitudes) = split;
                if among == Inputs::StatesToo {
                    phase.kinks.retain(|kink| matches!(kink, Kink::Time(_)));
                }
            }
            phases.push(PhaseParts { magnitudes, controls: posed.controls.len(), rows: posed.path_rows() });
        }
        phases.iter().any(|p| !p.magnitudes.is_empty()).then_some(Self { ocp: by_parts, phases })
    }

    /// A guess of the problem as it was posed, as one of the problem with parts.
    #[must_use]
    pub fn guess(&self, guess: &Guess) -> Guess {
        let phases = guess.phases.iter().zip(&self.phases).zip(&self.ocp.phases);
        let phases = phases.map(|((guess_of, parts), phase)| match parts.magnitudes.is_empty() {
            true => guess_of.clone(),
            false => parts.guess(guess_of, phase, &guess.parameters),
        });
        Guess { phases: phases.collect(), ..guess.clone() }
    }

    /// The mean size of the smaller part of a magnitude over its phase, which is none at a magnitude, relative to that of the larger part; the
    /// largest one of all magnitudes.
    #[must_use]
    pub fn overlap(&self, trajectory: &Trajectory) -> f64 {
        let mut overlap = 0.0_f64;
        for (phase, parts) in trajectory.phases.iter().zip(&self.phases) {
            let (breaks, nu) = (phase.control.breaks(), phase.control.dimension());
            for m in &parts.magnitudes {
                let (mut both, mut largest) = (0.0_f64, f64::MIN_POSITIVE);
                for (segment, ends) in phase.control.segments().iter().zip(breaks.windows(2)) {
                    let weight = (ends[1] - ends[0]) * nu as f64 / segment.values.len() as f64;
                    for u in segment.values.chunks(nu) {
                        let (p, n) = (u[m.positive], u[m.negative]);
                        both += weight * p.min(n).abs();
                        largest += weight * p.max(n);
                    }
                }
                overlap = overlap.max(both / largest);
            }
        }
        overlap
    }

    /// A trajectory of the problem with parts as one of the problem as it was posed.
    #[must_use]
    pub fn as_posed(&self, mut trajectory: Trajectory) -> Trajectory {
        for (t, parts) in trajectory.phases.iter_mut().zip(&self.phases) {
            if !parts.magnitudes.is_empty() {
                parts.as_posed(t);
            }
        }
        trajectory
    }
}

impl PhaseParts {
    fn guess(&self, guess: &PhaseGuess, phase: &Phase, parameters: &[f64]) -> PhaseGuess {
        let controls = phase.controls.len();
        let (begin, duration) = (guess.initial_time, guess.final_time - guess.initial_time);
        guess.with_samples(SAMPLES, |fraction, x, u| {
            let posed = u.clone();
            u.resize(controls, 0.0);
            for m in &self.magnitudes {
                let e = match &m.difference {
                    Origin::Control(j) => posed[*j],
                    Origin::Formula(f) => {
                        let mut z = [&*x, &posed].concat();
                        if f.inputs() > z.len() + 1 {
                            z.extend_from_slice(parameters);
                        }
                        z.push(begin + fraction * duration);
                        let values = f.evaluate(&z);
                        values[0] - values.get(1).copied().unwrap_or_default()
                    }
                };
                (u[m.positive], u[m.negative]) = (e.max(0.0), (-e).max(0.0));
            }
        })
    }

    fn as_posed(&self, t: &mut PhaseTrajectory) {
        t.control = t.control.map_nodes(self.controls, |solved, posed| {
            posed.copy_from_slice(&solved[..self.controls]);
            for m in &self.magnitudes {
                if let Origin::Control(j) = m.difference {
                    posed[j] = solved[m.positive] - solved[m.negative];
                }
            }
        });
        if let Some(solved) = &t.path_multipliers {
            let posed =
                solved.map_nodes(self.rows, |solved, posed| posed.copy_from_slice(&solved[..self.rows]));
            t.path_multipliers = Some(posed);
        }
        t.contacts.retain(|c| c.row < self.rows);
        t.mesh = t.mesh.clone().without_arcs();
    }
}

/// A magnitude where it was found: values of a formula, the second one absent where it is zero.
struct Found {
    formula: usize,
    values: (usize, Option<usize>),
    /// The control that the first value is, if the second one is zero.
    control: Option<usize>,
}

/// The magnitudes of controls in the functions of a phase.
struct Search<'a> {
    phase: &'a Phase,
    among: Inputs,
    parameters: Vec<Bounds>,
    /// Those of the equations of motion, the path constraints and the integrals.
    formulas: Vec<Formula>,
    found: Vec<Found>,
    /// Per formula, the magnitude of each operation that is one, and true where the parts of the difference change places.
    uses: Vec<BTreeMap<usize, (usize, bool)>>,
}

/// Numbers for expressions, the same for the same expression in all functions of a phase.
#[derive(Default)]
struct Numbers(BTreeMap<String, usize>);

impl Numbers {
    fn of(&mut self, expression: String) -> usize {
        let next = self.0.len();
        *self.0.entry(expression).or_insert(next)
    }
}

impl<'a> Search<'a> {
    fn of(ocp: &Ocp, phase: &'a Phase, among: Inputs) -> Option<Self> {
        let formulas: Vec<Formula> = phase.functions().map(|f| f.formula()).collect::<Result<_, _>>().ok()?;
        let parameters = ocp.parameters.iter().map(|p| p.bounds).collect();
        let mut search = Self { phase, among, parameters, formulas, found: Vec::new(), uses: Vec::new() };
        let (mut numbers, mut places) = (Numbers::default(), BTreeMap::new());
        for k in 0..search.formulas.len() {
            search.look(k, &mut numbers, &mut places);
        }
        (1..=MOST).contains(&search.found.len()).then_some(search)
    }

    /// Finds the magnitudes of a formula; `places` has those found so far by the numbers of their values.
    fn look(
        &mut self,
        k: usize,
        numbers: &mut Numbers,
        places: &mut BTreeMap<(usize, Option<usize>), usize>,
    ) {
        let (nx, nu) = (self.phase.states.len(), self.phase.controls.len());
        let formula = &self.formulas[k];
        let n = formula.inputs();
        let name = |i: usize| if i + 1 == n { "time".to_owned() } else { format!("input {i}") };
        let mut ids: Vec<usize> = (0..n).map(|i| numbers.of(name(i))).collect();
        let first = if self.among == Inputs::Controls { nx } else { 0 };
        let mut steered: Vec<bool> = (0..n).map(|i| (first..nx + nu).contains(&i)).collect();
        let mut uses = BTreeMap::new();
        for (operation_index, operation) in formula.operations().iter().enumerate() {
            let is_zero = |v: usize| {
                v.checked_sub(n).is_some_and(|o| formula.operations()[o] == Operation::Constant(0.0))
            };
            let magnitude = match *operation {
                Operation::Unary(Unary::Abs, a) => Some((a, None, false)),
                Operation::Binary(Binary::Min | Binary::Max, a, b) if is_zero(b) => Some((a, None, false)),
                Operation::Binary(Binary::Min | Binary::Max, a, b) if is_zero(a) => Some((b, None, true)),
                Operation::Binary(Binary::Min | Binary::Max, a, b) => Some((a, Some(b), false)),
                _ => None,
            };
            let magnitude = magnitude.filter(|(a, b, _)| steered[*a] || b.is_some_and(|b| steered[b]));
            let magnitude =
                magnitude.filter(|(_, b, _)| b.is_some() || !is_raised(formula, n + operation_index));
            if let Some((a, b, reversed)) = magnitude.map(|m| as_difference(formula, m)) {
                let key = (ids[a], b.map(|b| ids[b]));
                let swapped = key.1.and_then(|b| places.get(&(b, Some(key.0))));
                let place = match (places.get(&key), swapped) {
                    (Some(place), _) => (*place, reversed),
                    (None, Some(place)) => (*place, !reversed),
                    (None, None) => {
                        let control = a.checked_sub(nx).filter(|c| *c < nu && b.is_none());
                        places.insert(key, self.found.len());
                        self.found.push(Found { formula: k, values: (a, b), control });
                        (self.found.len() - 1, reversed)
                    }
                };
                uses.insert(operation_index, place);
            }
            let table = |t: usize| table_identity(formula, t);
            ids.push(numbers.of(format!("{:?}", operation.with_operands(|v| ids[v], table))));
            steered.push(operation.operands().any(|v| steered[v]));
        }
        self.uses.push(uses);
    }

    /// The phase with parts in place of magnitudes, and the magnitudes.
    fn split(&self) -> Result<(Phase, Vec<Magnitude>), AdError> {
        let phase = self.phase;
        let mut split = phase.clone();
        let mut magnitudes = Vec::new();
        for found in &self.found {
            let range = self.range(found)?;
            let named = |which: &str| match found.control {
                Some(j) => Variable {
                    name: format!("{which} part of {}", phase.controls[j].name),
                    ..phase.controls[j].clone()
                },
                None => Variable::new(format!("{which} part of magnitude {}", magnitudes.len() + 1), "-"),
            };
            let positive = Variable { bounds: Bounds::new(0.0, range[1].max(0.0)), ..named("positive") };
            let negative = Variable { bounds: Bounds::new(0.0, (-range[0]).max(0.0)), ..named("negative") };
            let place = match found.control {
                Some(j) => {
                    split.controls[j] = positive;
                    j
                }
                None => {
                    split.controls.push(positive);
                    split.controls.len() - 1
                }
            };
            split.controls.push(negative);
            let difference = match found.control {
                Some(j) => Origin::Control(j),
                None => Origin::Formula(self.values(found)?),
            };
            magnitudes.push(Magnitude { positive: place, negative: split.controls.len() - 1, difference });
        }
        let rewrite = |k: usize| Rewrite::of(self, &magnitudes, split.controls.len(), k);
        let mut functions = Vec::new();
        for k in 0..self.formulas.len() {
            functions.push(rewrite(k).function()?);
        }
        let mut functions = functions.into_iter();
        split.dynamics = functions.next().unwrap_or(split.dynamics);
        let path = split.path.iter_mut().map(|c| &mut c.function);
        for (old, new) in path.chain(split.integrals.iter_mut().map(|i| &mut i.function)).zip(functions) {
            *old = new;
        }
        for (k, (found, m)) in self.found.iter().zip(&magnitudes).enumerate() {
            if found.control.is_none() {
                let row = Variable::new(format!("parts of magnitude {}", k + 1), "-").equal_to(0.0);
                let function = rewrite(found.formula).balance(found, m)?;
                split.path.push(PathConstraint { rows: vec![row], function });
            }
        }
        Ok((split, magnitudes))
    }

    /// The two values of a magnitude, or the first alone, as a formula of the inputs as they were posed.
    fn values(&self, found: &Found) -> Result<Formula, AdError> {
        let formula = &self.formulas[found.formula];
        let tables = formula.tables().iter().map(|t| (**t).clone()).collect();
        let outputs = std::iter::once(found.values.0).chain(found.values.1).collect();
        Formula::new(formula.inputs(), formula.operations().to_vec(), tables, outputs)
    }

    /// Bounds of a difference over all that the phase allows.
    fn range(&self, found: &Found) -> Result<[f64; 2], AdError> {
        let formula = self.values(found)?;
        let (start, end) = self.phase.time_bounds();
        let states = self.phase.states.iter().map(|s| s.variable.bounds);
        let mut bounds: Vec<Bounds> = states.chain(self.phase.controls.iter().map(|c| c.bounds)).collect();
        if formula.inputs() > bounds.len() + 1 {
            bounds.extend(&self.parameters);
        }
        bounds.push(Bounds::new(start.lower, end.upper));
        let inputs: Vec<[f64; 2]> = bounds.iter().map(|b| [b.lower, b.upper]).collect();
        let values = formula.enclosure(&inputs);
        let second = values.get(1).copied().unwrap_or([0.0; 2]);
        Ok([values[0][0] - second[1], values[0][1] - second[0]])
    }
}

/// True where all that a value goes into is a power above one of it: of a magnitude, which vanishes at its kink, that has none.
fn is_raised(formula: &Formula, value: usize) -> bool {
    let is_power = |operation: &Operation| match *operation {
        Operation::Binary(Binary::Mul, a, b) => a == b,
        Operation::Powi(_, exponent) => exponent > 1,
        Operation::Powf(_, exponent) => exponent > 1.0,
        _ => false,
    };
    let mut uses = formula.operations().iter().filter(|o| o.operands().any(|v| v == value));
    !formula.outputs().contains(&value) && uses.all(is_power)
}

/// The identity of a table of a formula, the same wherever the table is shared.
fn table_identity(formula: &Formula, table: usize) -> usize {
    Arc::as_ptr(&formula.tables()[table]) as usize
}

/// A magnitude of one value by the values whose difference it is of: that of `-u` is that of `u` with parts that change places, and so is that of
/// `b - a` beside `a - b`. Parts of their own would be bound to those of the other one twice.
fn as_difference(
    formula: &Formula,
    (a, b, reversed): (usize, Option<usize>, bool),
) -> (usize, Option<usize>, bool) {
    let operation = a.checked_sub(formula.inputs()).map(|o| formula.operations()[o]);
    match (b, operation) {
        (None, Some(Operation::Unary(Unary::Neg, of))) => as_difference(formula, (of, None, !reversed)),
        (None, Some(Operation::Binary(Binary::Sub, one, other))) => (one, Some(other), reversed),
        _ => (a, b, reversed),
    }
}

/// A formula of a phase, written again with parts.
struct Rewrite<'a> {
    builder: FormulaBuilder,
    values: Vec<Value>,
    outputs: &'a [usize],
    states: usize,
}

impl<'a> Rewrite<'a> {
    fn of(search: &'a Search<'_>, magnitudes: &[Magnitude], controls: usize, k: usize) -> Self {
        let formula = &search.formulas[k];
        let (nx, nu) = (search.phase.states.len(), search.phase.controls.len());
        let mut builder = FormulaBuilder::new(formula.inputs() + controls - nu);
        let input = |b: &mut FormulaBuilder, i: usize| {
            let own = |m: &&Magnitude| matches!(m.difference, Origin::Control(j) if nx + j == i);
            match magnitudes.iter().find(own) {
                Some(m) => {
                    let (p, n) = (b.input(nx + m.positive), b.input(nx + m.negative));
                    b.sub(p, n)
                }
                None => b.input(if i < nx + nu { i } else { i + controls - nu }),
            }
        };
        let replace = |b: &mut FormulaBuilder, place: usize, values: &[Value]| {
            let (m, reversed) = search.uses[k].get(&place)?;
            let m = &magnitudes[*m];
            let (p, n) = (b.input(nx + m.positive), b.input(nx + m.negative));
            let (p, n) = if *reversed { (n, p) } else { (p, n) };
            match formula.operations()[place] {
                Operation::Unary(Unary::Abs, _) => Some(b.add(p, n)),
                Operation::Binary(Binary::Max, _, second) => Some(b.add(values[second], p)),
                Operation::Binary(Binary::Min, _, second) => Some(b.sub(values[second], n)),
                _ => None,
            }
        };
        let values = rewrite(formula, &mut builder, input, replace);
        Self { builder, values, outputs: formula.outputs(), states: nx }
    }

    fn function(self) -> Result<Arc<dyn NodeFunction>, AdError> {
        let outputs: Vec<Value> = self.outputs.iter().map(|k| self.values[*k]).collect();
        Ok(formula_node(self.builder.formula(&outputs)?))
    }

    /// `p - n - (a - b)`.
    fn balance(mut self, found: &Found, m: &Magnitude) -> Result<Arc<dyn NodeFunction>, AdError> {
        let b = &mut self.builder;
        let (p, n) = (b.input(self.states + m.positive), b.input(self.states + m.negative));
        let parts = b.sub(p, n);
        let mut balance = b.sub(parts, self.values[found.values.0]);
        if let Some(second) = found.values.1 {
            balance = b.add(balance, self.values[second]);
        }
        Ok(formula_node(b.formula(&[balance])?))
    }
}
