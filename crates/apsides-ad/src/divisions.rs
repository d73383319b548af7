//! Parts of the range of one input, such as time, within which what a formula makes of that input alone hides nothing.
//!
//! A function of time that is known at a few instants may have a pulse between them. Bounds of its derivatives over an interval ([`Expansion`])
//! tell: where it is monotone, or close to a quadratic, the ends and the middle show all there is; where not, the interval is halved.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use crate::Expansion;
use crate::formula::{Formula, Operation};

/// Most intervals of one value.
const MOST_PARTS: usize = 2000;
/// Most intervals that are looked at for the instants of one condition.
const MOST_LOOKS: usize = 10_000;
/// Part of the range of a value that may stay hidden in an interval.
const HIDDEN: f64 = 1e-3;
/// Intervals this short, relative to the range, are not halved.
const SHORT: f64 = 1e-9;
/// Width to which an instant is known, in roundings of the range.
const ROUNDINGS: f64 = 4.0;

/// The parts of a range.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Divisions {
    /// Where values jump or have a kink: the last number before, and the first one after.
    pub instants: Vec<[f64; 2]>,
    /// Intervals that hide nothing, those of each value in increasing order, one value after the other.
    pub parts: Vec<[f64; 2]>,
}

impl Formula {
    /// Divides a range of one input, for all values that depend on it and on the `fixed` inputs alone, whose numbers are given.
    ///
    /// # Panics
    /// When there are not as many inputs.
    #[must_use]
    pub fn divisions(&self, input: usize, range: [f64; 2], fixed: &[(usize, f64)]) -> Divisions {
        if !is_range(range) {
            return Divisions::default();
        }
        let alone = Alone::of(self, input, fixed);
        let instants = self.instants(input, range, fixed);
        let of_value = |value: usize| parts(alone.formula(self, value), range, &instants);
        Divisions { parts: alone.taken(self).into_iter().flat_map(of_value).collect(), instants }
    }

    /// The places of a range of one input at which values jump or have a kink since that input passes them: the last number before, and the
    /// first one after, in increasing order.
    ///
    /// # Panics
    /// When there are not as many inputs.
    #[must_use]
    pub fn instants(&self, input: usize, range: [f64; 2], fixed: &[(usize, f64)]) -> Vec<[f64; 2]> {
        let kinks = self.kinks();
        if kinks.is_empty() || !is_range(range) {
            return Vec::new();
        }
        let arguments = self.arguments_of(&kinks);
        let alone = Alone::of(&arguments, input, fixed);
        let of_argument = |place| zeros(&alone.formula(&arguments, place), range);
        let mut instants: Vec<[f64; 2]> =
            arguments.outputs().iter().filter_map(|k| alone.place(*k)).flat_map(of_argument).collect();
        instants.sort_by(|a, b| a[0].total_cmp(&b[0]));
        instants.dedup_by(|next, last| {
            let same = next[0] <= last[1];
            last[1] = if same { last[1].max(next[1]) } else { last[1] };
            same
        });
        instants
    }
}

fn is_range(range: [f64; 2]) -> bool {
    range[0] < range[1] && range.iter().all(|v| v.is_finite())
}

/// The operations of a formula on one input alone.
struct Alone {
    operations: Vec<Operation>,
    /// One for each value of the formula: its place here, if it depends on nothing else, and true if it depends on the input.
    places: Vec<Option<(usize, bool)>>,
}

impl Alone {
    fn of(formula: &Formula, input: usize, fixed: &[(usize, f64)]) -> Self {
        assert!(input < formula.inputs(), "the input is one of the formula");
        let mut alone = Self { operations: Vec::new(), places: vec![None; formula.inputs()] };
        alone.places[input] = Some((0, true));
        for &(k, number) in fixed {
            alone.places[k] = Some((alone.put(Operation::Constant(number)), false));
        }
        for &operation in formula.operations() {
            let operands: Option<Vec<_>> = operation.operands().map(|a| alone.places[a]).collect();
            let place = operands.map(|operands| {
                let depends = operands.iter().any(|(_, depends)| *depends);
                // All operands have a place.
                let here = operation.with_operands(|a| alone.places[a].map_or(0, |(at, _)| at), |t| t);
                (alone.put(here), depends)
            });
            alone.places.push(place);
        }
        alone
    }

    /// Appends an operation; the place of its value, after that of the input.
    fn put(&mut self, operation: Operation) -> usize {
        self.operations.push(operation);
        self.operations.len()
    }

    /// The place of a value that depends on the input and on no other.
    fn place(&self, value: usize) -> Option<usize> {
        self.places[value].filter(|(_, depends)| *depends).map(|(at, _)| at)
    }

    /// Places of the values that depend on the input alone and enter others that do not, or are outputs.
    fn taken(&self, formula: &Formula) -> Vec<usize> {
        let inputs = formula.inputs();
        let mixed =
            formula.operations().iter().enumerate().filter(|(k, _)| self.places[inputs + k].is_none());
        let operands = mixed.flat_map(|(_, operation)| operation.operands());
        let mut taken: Vec<usize> =
            operands.chain(formula.outputs().iter().copied()).filter_map(|k| self.place(k)).collect();
        taken.sort_unstable();
        taken.dedup();
        taken
    }

    /// One of the values as a formula of the input, with the tables of the whole.
    fn formula(&self, whole: &Formula, place: usize) -> Formula {
        Formula::pruned(1, &self.operations, whole.tables(), &[place])
    }
}

/// The zeros of a function, each between two numbers; none where it is zero along an interval.
fn zeros(function: &Formula, range: [f64; 2]) -> Vec<[f64; 2]> {
    let narrow = ROUNDINGS * f64::EPSILON * range[0].abs().max(range[1].abs());
    let mut found: Vec<[f64; 2]> = Vec::new();
    let mut left = vec![range];
    let mut looks = 0;
    while let Some([a, b]) = left.pop() {
        let [least, largest] = function.enclosure(&[[a, b]])[0];
        if least > 0.0 || largest < 0.0 {
            continue;
        }
        if b - a <= narrow {
            match found.last_mut() {
                Some(last) if last[1] >= a => last[1] = b,
                _ => found.push([a, b]),
            }
            continue;
        }
        looks += 1;
        if looks > MOST_LOOKS {
            return Vec::new();
        }
        let middle = 0.5 * (a + b);
        left.extend([[middle, b], [a, middle]]);
    }
    found
}

/// An interval and a bound of what it hides.
struct Hiding {
    bound: f64,
    ends: [f64; 2],
}

impl PartialEq for Hiding {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Hiding {}

impl PartialOrd for Hiding {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Hiding {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound.total_cmp(&other.bound).then(other.ends[0].total_cmp(&self.ends[0]))
    }
}

/// Intervals between the instants over which a function of one input hides little beside its range.
fn parts(function: Formula, range: [f64; 2], instants: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let (mut least, mut largest) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut expansion = Expansion::new(function);
    let mut look = |ends: [f64; 2]| {
        for at in [ends[0], 0.5 * (ends[0] + ends[1]), ends[1]] {
            let value = expansion.formula().evaluate(&[at])[0];
            if value.is_finite() {
                (least, largest) = (least.min(value), largest.max(value));
            }
        }
        expansion.set(&[ends]);
        (Hiding { bound: hidden(&expansion, ends[1] - ends[0]), ends }, largest - least)
    };
    let starts = std::iter::once(range[0]).chain(instants.iter().map(|i| i[1]));
    let ends = instants.iter().map(|i| i[0]).chain([range[1]]);
    let pieces: Vec<[f64; 2]> = starts.zip(ends).map(|(a, b)| [a, b]).filter(|[a, b]| a < b).collect();
    let (mut heap, mut done, mut size) = (BinaryHeap::new(), Vec::new(), 0.0);
    for piece in pieces {
        let (hiding, range) = look(piece);
        size = range;
        heap.push(hiding);
    }
    while let Some(hiding) = heap.pop() {
        let [a, b] = hiding.ends;
        if hiding.bound <= HIDDEN * size || heap.len() + done.len() >= MOST_PARTS {
            heap.push(hiding);
            break;
        }
        if b - a <= SHORT * (range[1] - range[0]) {
            done.push(hiding.ends);
            continue;
        }
        let middle = 0.5 * (a + b);
        for ends in [[a, middle], [middle, b]] {
            let (hiding, range) = look(ends);
            size = range;
            heap.push(hiding);
        }
    }
    done.extend(heap.into_iter().map(|h| h.ends));
    done.sort_by(|a, b| a[0].total_cmp(&b[0]));
    done
}

/// A bound of the distance of a function from what its values at the ends and in the middle of an interval of that width tell.
fn hidden(expansion: &Expansion, width: f64) -> f64 {
    let (value, slope, curvature) = (expansion.value(0), expansion.gradient(0)[0], expansion.hessian(0)[0]);
    if slope[0] >= 0.0 || slope[1] <= 0.0 {
        return 0.0;
    }
    // From the chord, by a slope between bounds; from a parabola, by a curvature between bounds.
    let from_chord = 0.25 * width * (slope[1] - slope[0]);
    let from_parabola = width * width / 16.0 * (curvature[1] - curvature[0]);
    let bounds = [value[1] - value[0], from_chord, from_parabola];
    bounds.into_iter().filter(|b| !b.is_nan()).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FormulaBuilder, Outside, Pchip, Value};

    const LAST_BITS: f64 = 1e-15;

    fn divided(build: impl Fn(&mut FormulaBuilder, Value, Value) -> Value, range: [f64; 2]) -> Divisions {
        let mut b = FormulaBuilder::new(2);
        let (x, t) = (b.input(0), b.input(1));
        let value = build(&mut b, x, t);
        b.formula(&[value]).expect("well formed").divisions(1, range, &[])
    }

    /// Height 1 at `at`, width `width`.
    fn pulse(b: &mut FormulaBuilder, t: Value, at: f64, width: f64) -> Value {
        let (at, width) = (b.constant(at), b.constant(width));
        let apart = b.sub(t, at);
        let ratio = b.div(apart, width);
        let square = b.square(ratio);
        let minus = b.neg(square);
        b.exp(minus)
    }

    #[test]
    fn a_narrow_pulse_is_found_in_a_wide_range() {
        let (at, width) = (0.323_456, 1e-5);
        let d = divided(
            |b, x, t| {
                let pulse = pulse(b, t, at, width);
                b.mul(pulse, x)
            },
            [0.0, 1.0],
        );
        assert!(d.instants.is_empty());
        let [a, b] = *d.parts.iter().find(|[a, b]| (*a..*b).contains(&at)).expect("a part is around it");
        assert!(b - a < width, "{a} to {b}");
        assert!(d.parts.len() < 40, "{}", d.parts.len());
        assert!(d.parts.windows(2).all(|w| w[0][1] == w[1][0]));
    }

    #[test]
    fn what_is_smooth_or_monotone_stays_whole() {
        let root = divided(
            |b, x, t| {
                let r = b.sqrt(t);
                b.mul(r, x)
            },
            [0.0, 4.0],
        );
        assert_eq!(root.parts, [[0.0, 4.0]]);
        let parabola = divided(
            |b, x, t| {
                let s = b.square(t);
                b.add(s, x)
            },
            [-1.0, 2.0],
        );
        assert_eq!(parabola.parts, [[-1.0, 2.0]]);
        let waves = divided(
            |b, x, t| {
                let s = b.sin(t);
                b.mul(s, x)
            },
            [0.0, 100.0],
        );
        // Some ten parts a turn, of which there are sixteen.
        assert!((100..400).contains(&waves.parts.len()), "{}", waves.parts.len());
    }

    #[test]
    fn jumps_and_kinks_of_time_are_instants_and_those_of_states_are_not() {
        let d = divided(
            |b, x, t| {
                let (c, k) = (b.constant(0.3), b.constant(0.8));
                let before = b.sub(c, t);
                let jump = b.select(before, x, t);
                let after = b.sub(t, k);
                let kink = b.abs(after);
                let of_state = b.abs(x);
                let sum = b.add(jump, kink);
                b.add(sum, of_state)
            },
            [0.0, 1.0],
        );
        assert_eq!(d.instants.len(), 2, "{:?}", d.instants);
        for ([before, after], at) in d.instants.iter().zip([0.3, 0.8]) {
            assert!(*before <= at && *after >= at && after - before < 16.0 * LAST_BITS);
        }
    }

    #[test]
    fn parameters_have_their_numbers_and_a_plateau_is_no_instant() {
        let mut b = FormulaBuilder::new(3);
        let (x, p, t) = (b.input(0), b.input(1), b.input(2));
        let after = b.sub(t, p);
        let clipped = b.max(after, p);
        let jump = b.select(after, x, clipped);
        let zero = b.constant(0.0);
        let flat = b.mul(zero, t);
        let plateau = b.abs(flat);
        let formula = b.formula(&[jump, plateau]).expect("well formed");
        let d = formula.divisions(2, [0.0, 1.0], &[(1, 0.25)]);
        let at: Vec<f64> = d.instants.iter().map(|i| i[1]).collect();
        assert_eq!(at.len(), 2, "{at:?}");
        assert!((at[0] - 0.25).abs() < LAST_BITS && (at[1] - 0.5).abs() < LAST_BITS);
        assert_eq!(formula.divisions(2, [0.0, f64::INFINITY], &[(1, 0.25)]), Divisions::default());
        assert_eq!(formula.divisions(2, [1.0, 0.0], &[(1, 0.25)]), Divisions::default());
    }

    #[test]
    fn a_peak_of_a_table_is_found() {
        let knots = [0.0, 0.4, 0.402, 0.404, 1.0, 3.0];
        let values = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
        let table = Pchip::new(&knots, &values, Outside::Constant).expect("a table");
        let mut b = FormulaBuilder::new(2);
        let (x, t) = (b.input(0), b.input(1));
        let table = b.table(table);
        let looked_up = b.curve(table, t);
        let value = b.mul(looked_up, x);
        let d = b.formula(&[value]).expect("well formed").divisions(1, [0.0, 3.0], &[]);
        let [a, b] = *d.parts.iter().find(|[a, b]| (*a..*b).contains(&0.402)).expect("a part");
        assert!(b - a < 0.01, "{a} to {b}");
        assert!(d.parts.len() < 200, "{}", d.parts.len());
    }
}
