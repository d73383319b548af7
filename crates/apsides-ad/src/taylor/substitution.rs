//! The coefficients of one order by substitution.
//!
//! A coefficient of order `k` is linear in the coefficients of that order that it is made of: with the products between orders one and
//! `k - 1` in `s`, that of a product is `s + a[k] b[0] + a[0] b[k]`. The factors, as `b[0]`, are the same at all orders. A value that no
//! product needs and one other value alone is a part of that one, and one that is another by a factor is not computed at all.

use std::ops::Range;

use super::history::{History, Products};
use super::places::{Places, WIDTH};
use super::rules::{Item, Kind};
use super::schedule::{Addend, Group};

/// The coefficient one.
const ONE: usize = 0;

/// A factor that is the same at all orders: one before it times a number times the value of order zero at a place, or divided by that.
#[derive(Clone, Copy, Debug)]
struct Coefficient {
    of: usize,
    number: f64,
    place: Option<usize>,
    inverse: bool,
}

/// `row[out] = row[start] + sum_i factor_i row[of_i]`.
#[derive(Clone, Copy, Debug)]
struct Step {
    factors: [f64; 2],
    coefficients: [u32; 2],
    of: [u32; 2],
    start: u32,
    out: u32,
    /// Starts from the value of the step before.
    goes_on: bool,
}

/// The recurrences of all values that are needed.
#[derive(Clone, Debug)]
pub(super) struct Substitution {
    coefficients: Vec<Coefficient>,
    /// The coefficients of the expansion.
    numbers: Vec<f64>,
    histories: Vec<History>,
    /// Place of the first sum of products.
    sums: usize,
    steps: Vec<Step>,
    /// Those of the rates.
    ends: Vec<Step>,
    /// States, and their rates that are kept or given.
    same: Vec<[u32; 2]>,
}

/// The parts of a value.
#[derive(Clone, Copy)]
enum Made<'a> {
    /// Input or fixed.
    Given,
    /// Its terms that move.
    Sum(&'a [Addend]),
    Rule(Kind, &'a Item),
}

impl Substitution {
    /// The recurrences of `groups`, where `moves` tells which values are the same all along the solution.
    pub(super) fn new(groups: &[Group], moves: &[bool], outputs: &[usize]) -> Self {
        let mut made = vec![Made::Given; moves.len()];
        for group in groups {
            match group {
                Group::Sums(sums) => {
                    sums.each().for_each(|(out, moving)| made[out] = Made::Sum(moving));
                }
                Group::Rules(kind, items) => {
                    items.iter().for_each(|item| made[item.out] = Made::Rule(*kind, item));
                }
            }
        }
        let mut builder = Assembly::new(made, moves);
        let order: Vec<usize> = groups.iter().flat_map(Group::values).collect();
        builder.count(&order, outputs);
        for &v in &order {
            if builder.is_kept[v] {
                builder.keep(v);
            }
        }
        for (state, &v) in outputs.iter().enumerate() {
            builder.end(state, v);
        }
        builder.finish()
    }

    /// Place of the first sum of products; those of order one are zero.
    pub(super) fn sums(&self) -> usize {
        self.sums
    }

    /// Length of a row.
    pub(super) fn places(&self) -> usize {
        self.sums + WIDTH * self.histories.len()
    }

    /// Takes the factors from the values of order zero.
    pub(super) fn take(&mut self, zeroth: &[f64]) {
        for (k, c) in self.coefficients.iter().enumerate() {
            let value = c.place.map_or(1.0, |place| zeroth[place]);
            let number = if k == ONE { 1.0 } else { self.numbers[c.of] * c.number };
            self.numbers[k] = if c.inverse { number / value } else { number * value };
        }
        for step in self.steps.iter_mut().chain(&mut self.ends) {
            step.factors = step.coefficients.map(|k| self.numbers[k as usize]);
        }
        self.histories.iter_mut().for_each(|history| history.scale(&self.numbers));
    }

    /// Puts the sums of products of order `k` above one into `row`, where `before` has all values of the order before.
    #[inline(always)]
    pub(super) fn sum<R: Places + ?Sized>(&mut self, k: usize, reciprocal: f64, before: &R, row: &mut R) {
        macro_rules! orders {
            ($($k:literal)*) => {
                match k {
                    $($k => self.sum_of::<$k, R>(reciprocal, before, row),)*
                    _ => {}
                }
            };
        }
        orders!(2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28);
    }

    #[inline(always)]
    fn sum_of<const K: usize, R: Places + ?Sized>(&mut self, reciprocal: f64, before: &R, row: &mut R) {
        let from = self.sums / WIDTH;
        for (k, history) in self.histories.iter_mut().enumerate() {
            row.put_all(from + k, history.advance::<K, R>(reciprocal, before));
        }
    }

    /// Computes the values of an order in `row`, which has its states, its time and its sums of products, and the states of the next order,
    /// of which `by` is the reciprocal, in `next`.
    #[inline(always)]
    pub(super) fn substitute<R: Places + ?Sized>(&self, by: f64, row: &mut R, next: &mut R) {
        let mut value = 0.0;
        for step in &self.steps {
            value = step.value(value, row);
            row.put(step.out, value);
        }
        for step in &self.ends {
            value = step.value(value, row);
            next.put(step.out, value * by);
        }
        for &[state, rate] in &self.same {
            next.put(state, row.at(rate) * by);
        }
    }
}

impl Step {
    /// The value, given that of the step before.
    #[inline(always)]
    fn value<R: Places + ?Sized>(&self, before: f64, row: &R) -> f64 {
        let [first, second] = self.factors;
        let start = if self.goes_on { before } else { row.at(self.start) };
        let newest = row.at(self.of[1]);
        (start + first * row.at(self.of[0])) + second * newest
    }
}

/// Sums of products by their places, and other values by their places and coefficients.
#[derive(Default)]
struct Terms {
    sums: Vec<usize>,
    terms: Vec<(usize, usize)>,
}

/// Substitutions while they are put together.
struct Assembly<'a> {
    made: Vec<Made<'a>>,
    moves: &'a [bool],
    is_kept: Vec<bool>,
    coefficients: Vec<Coefficient>,
    products: Vec<Products>,
    /// A place that is zero at all orders.
    zero: u32,
    steps: Vec<Step>,
    ends: Vec<Step>,
    same: Vec<[u32; 2]>,
    /// The number of steps after which a value is known.
    ranks: Vec<usize>,
}

impl<'a> Assembly<'a> {
    fn new(made: Vec<Made<'a>>, moves: &'a [bool]) -> Self {
        let one = Coefficient { of: ONE, number: 1.0, place: None, inverse: false };
        Self {
            is_kept: vec![false; made.len()],
            ranks: vec![0; made.len()],
            zero: made.len() as u32,
            made,
            moves,
            coefficients: vec![one],
            products: Vec::new(),
            steps: Vec::new(),
            ends: Vec::new(),
            same: Vec::new(),
        }
    }

    /// Place of the first sum of products.
    fn sums(&self) -> usize {
        (self.zero as usize + 1).next_multiple_of(WIDTH)
    }

    fn coefficient(&mut self, of: usize, number: f64, place: Option<usize>, inverse: bool) -> usize {
        if number == 1.0 && place.is_none() {
            return of;
        }
        self.coefficients.push(Coefficient { of, number, place, inverse });
        self.coefficients.len() - 1
    }

    /// The one value of which `v` is a multiple above order zero.
    fn multiple(&self, v: usize) -> Option<&'a Addend> {
        match self.made[v] {
            Made::Sum([term]) => Some(term),
            _ => None,
        }
    }

    /// The value of which `v` is a multiple, and the coefficient by that factor.
    fn resolve(&mut self, mut v: usize, mut coefficient: usize) -> (usize, usize) {
        while let Some(term) = self.multiple(v) {
            coefficient = self.coefficient(coefficient, term.factor, term.by, false);
            v = term.value;
        }
        (v, coefficient)
    }

    fn source(&self, mut v: usize) -> usize {
        while let Some(term) = self.multiple(v) {
            v = term.value;
        }
        v
    }

    /// Finds the values that are kept: outputs, those in products, and those that more than one value is made of.
    fn count(&mut self, order: &[usize], outputs: &[usize]) {
        let mut uses = vec![0; self.made.len()];
        outputs.iter().for_each(|&v| uses[self.source(v)] += 1);
        for &v in order {
            match self.made[v] {
                Made::Given => {}
                Made::Sum([_]) => {}
                Made::Sum(terms) => terms.iter().for_each(|t| uses[self.source(t.value)] += 1),
                Made::Rule(kind, item) => {
                    let (first, second) = (self.source(item.first), self.source(item.second));
                    match kind {
                        Kind::Square | Kind::Product | Kind::Integral => {
                            self.is_kept[first] = true;
                            self.is_kept[second] = true;
                        }
                        Kind::Quotient => {
                            uses[first] += 1;
                            self.is_kept[second] = true;
                            self.is_kept[v] = true;
                        }
                        Kind::Power => {
                            self.is_kept[first] = true;
                            self.is_kept[v] = true;
                        }
                    }
                }
            }
        }
        self.is_kept.iter_mut().zip(uses).for_each(|(is_kept, uses)| *is_kept |= uses > 1);
    }

    /// Adds the steps of a value.
    fn keep(&mut self, out: usize) {
        let mut terms = Terms::default();
        let parts = self.parts(out, ONE, &mut terms);
        self.add(parts, &mut terms);
        let steps = self.steps_of(out, terms);
        self.steps.extend(steps);
        self.ranks[out] = self.steps.len();
    }

    /// Adds the steps of the rate of a state.
    fn end(&mut self, state: usize, rate: usize) {
        if self.is_kept[rate] || matches!(self.made[rate], Made::Given) {
            self.same.push([state as u32, rate as u32]);
            return;
        }
        let mut terms = Terms::default();
        self.add(vec![(rate, ONE)], &mut terms);
        let steps = self.steps_of(state, terms);
        self.ends.extend(steps);
    }

    /// Adds parts of a value and what those that are not kept are made of.
    fn add(&mut self, parts: Vec<(usize, usize)>, terms: &mut Terms) {
        let mut open = parts;
        while let Some((part, c)) = open.pop() {
            let (part, c) = self.resolve(part, c);
            if !self.moves[part] {
                continue;
            }
            if self.is_kept[part] || matches!(self.made[part], Made::Given) {
                terms.terms.push((part, c));
            } else {
                open.extend(self.parts(part, c, terms));
            }
        }
    }

    /// The parts of a value times a coefficient; its sums of products are terms.
    fn parts(&mut self, v: usize, c: usize, terms: &mut Terms) -> Vec<(usize, usize)> {
        let mut parts = Vec::new();
        match self.made[v] {
            Made::Given => {}
            Made::Sum(all) => {
                parts.extend(all.iter().map(|t| (t.value, self.coefficient(c, t.factor, t.by, false))));
            }
            Made::Rule(kind, item) => {
                let sums = self.rule(kind, item, c, &mut parts);
                terms.sums.extend(sums.map(|sum| self.sums() + sum));
            }
        }
        parts
    }

    /// Steps that add up terms.
    fn steps_of(&self, out: usize, terms: Terms) -> Vec<Step> {
        let (start, more) = match terms.sums.split_first() {
            Some((&start, more)) => (start as u32, more),
            None => (self.zero, &[][..]),
        };
        let mut all = terms.terms;
        // A term that is found last is added last.
        all.sort_by_key(|&(place, _)| self.ranks.get(place).copied().unwrap_or_default());
        let mut all: Vec<(usize, usize)> = more.iter().map(|&place| (place, ONE)).chain(all).collect();
        if all.is_empty() {
            all.push((self.zero as usize, ONE));
        }
        if all.len() % 2 == 1 {
            all.insert(0, (self.zero as usize, ONE));
        }
        let step = |(k, pair): (usize, &[(usize, usize)])| {
            let [first, second] = *pair.first_chunk::<2>()?;
            Some(Step {
                factors: [0.0; 2],
                coefficients: [first.1 as u32, second.1 as u32],
                of: [first.0 as u32, second.0 as u32],
                start,
                out: out as u32,
                goes_on: k > 0,
            })
        };
        all.chunks_exact(2).enumerate().filter_map(step).collect()
    }

    /// The sums of products of a rule that counts by the coefficient `c`, and the other parts of its value.
    fn rule(&mut self, kind: Kind, item: &Item, c: usize, parts: &mut Vec<(usize, usize)>) -> Range<usize> {
        let Item { out, first, second, exponent, .. } = *item;
        let from = self.products.len();
        match kind {
            Kind::Square => {
                self.product(first, first, false, c);
                parts.push((first, self.coefficient(c, 2.0, Some(first), false)));
            }
            Kind::Product => {
                self.product(first, second, false, c);
                parts.push((first, self.coefficient(c, 1.0, Some(second), false)));
                parts.push((second, self.coefficient(c, 1.0, Some(first), false)));
            }
            Kind::Quotient => {
                let inverse = self.coefficient(c, 1.0, Some(second), true);
                let minus = self.coefficient(inverse, -1.0, None, false);
                self.product(second, out, false, minus);
                parts.push((first, inverse));
                parts.push((second, self.coefficient(minus, 1.0, Some(out), false)));
            }
            Kind::Power => {
                let inverse = self.coefficient(c, 1.0, Some(first), true);
                let (by_order, plain) = (
                    self.coefficient(inverse, exponent + 1.0, None, false),
                    self.coefficient(inverse, -1.0, None, false),
                );
                self.product(first, out, true, by_order);
                self.product(first, out, false, plain);
                parts.push((first, self.coefficient(inverse, exponent, Some(out), false)));
            }
            Kind::Integral => {
                self.product(first, second, true, c);
                parts.push((first, self.coefficient(c, 1.0, Some(second), false)));
            }
        }
        from..self.products.len()
    }

    fn product(&mut self, first: usize, second: usize, by_order: bool, c: usize) {
        let (first, c) = self.resolve(first, c);
        let (second, factor) = self.resolve(second, c);
        self.products.push(Products { first: first as u32, second: second as u32, by_order, factor });
    }

    fn finish(self) -> Substitution {
        Substitution {
            sums: self.sums(),
            numbers: vec![0.0; self.coefficients.len()],
            coefficients: self.coefficients,
            histories: self.products.chunks(WIDTH).map(History::new).collect(),
            steps: self.steps,
            ends: self.ends,
            same: self.same,
        }
    }
}
