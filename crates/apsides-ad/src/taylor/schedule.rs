//! The order of the recurrences.

use super::lowering::{Lowered, Rule, Start};
use super::rules::{Item, Kind};

/// A number times a value, and times a fixed value, if any.
#[derive(Clone, Copy, Debug)]
pub(super) struct Addend {
    pub(super) factor: f64,
    pub(super) by: Option<usize>,
    pub(super) value: usize,
}

/// Sums of terms, one after the other.
#[derive(Clone, Debug, Default)]
pub(super) struct Sums {
    /// Values that they are; the end of their terms; the number of terms that are fixed, which stand first and count at order zero alone.
    sums: Vec<(usize, usize, usize)>,
    terms: Vec<Addend>,
}

/// Values that are computed one after the other.
#[derive(Clone, Debug)]
pub(super) enum Group {
    Sums(Sums),
    /// Values of one rule.
    Rules(Kind, Vec<Item>),
}

impl Group {
    /// The values, in their order.
    pub(super) fn values(&self) -> Vec<usize> {
        match self {
            Self::Sums(sums) => sums.sums.iter().map(|sum| sum.0).collect(),
            Self::Rules(_, items) => items.iter().map(|item| item.out).collect(),
        }
    }

    /// Coefficients of order zero.
    pub(super) fn begin(&self, row: &mut [f64]) {
        match self {
            Self::Sums(sums) => sums.begin(row),
            Self::Rules(kind, items) => kind.begin(items, row),
        }
    }
}

/// The groups in an order in which every value stands after those that it is made of.
pub(super) fn groups(lowered: &Lowered) -> Vec<Group> {
    let uses = uses(lowered);
    let mut terms: Vec<Vec<Addend>> = Vec::with_capacity(lowered.rules.len());
    for rule in &lowered.rules {
        let mut all = Vec::new();
        // A sum that nothing else needs is a part of the one that needs it.
        let mut add = |factor: f64, by: Option<usize>, value: usize| {
            let inner: &[Addend] = if uses[value] == 1 { &terms[value] } else { &[] };
            if inner.is_empty() || (by.is_some() && inner.iter().any(|t| t.by.is_some())) {
                all.push(Addend { factor, by, value });
            } else {
                all.extend(inner.iter().map(|t| Addend { factor: factor * t.factor, by: by.or(t.by), ..*t }));
            }
        };
        match *rule {
            Rule::Sum { a, b, factor } => {
                add(1.0, None, a);
                add(factor, None, b);
            }
            Rule::Scaled { by, of } => match lowered.rules[by] {
                Rule::Fixed(crate::formula::Operation::Constant(c)) => add(c, None, of),
                _ => add(1.0, Some(by), of),
            },
            _ => {}
        }
        terms.push(all);
    }
    let needed = needed(lowered, &terms);
    let mut waiting: Vec<usize> = (0..lowered.rules.len())
        .filter(|&v| lowered.moves[v] && needed[v] && lowered.rules[v] != Rule::Input)
        .collect();
    let mut done: Vec<bool> =
        (0..lowered.rules.len()).map(|v| !lowered.moves[v] || lowered.rules[v] == Rule::Input).collect();
    let mut groups = Vec::new();
    while !waiting.is_empty() {
        let mut sums = Sums::default();
        // In their order, so that a sum may be of one before it.
        waiting.retain(|&v| {
            let ready = !terms[v].is_empty() && terms[v].iter().all(|t| done[t.value]);
            if ready {
                done[v] = true;
                sums.push(lowered, v, &terms[v]);
            }
            !ready
        });
        if !sums.sums.is_empty() {
            groups.push(Group::Sums(sums));
        }
        let ready: Vec<(Kind, Item)> = waiting
            .iter()
            .filter_map(|&v| item(lowered, v))
            .filter(|(kind, item)| {
                let start = if let Start::Atan2(x) = item.start { x } else { item.first };
                done[item.first] && done[start] && (*kind == Kind::Integral || done[item.second])
            })
            .collect();
        let count = |kind: Kind| ready.iter().filter(|r| r.0 == kind).count();
        // The rule with the most values that are ready; of equal ones the first.
        let Some(kind) = ready.iter().map(|r| r.0).rev().max_by_key(|&kind| count(kind)) else { break };
        let items: Vec<Item> = ready.iter().filter(|r| r.0 == kind).map(|r| r.1).collect();
        items.iter().for_each(|item| done[item.out] = true);
        groups.push(Group::Rules(kind, items));
        waiting.retain(|&v| !done[v]);
    }
    groups
}

/// Number of uses of each value by rules and outputs.
fn uses(lowered: &Lowered) -> Vec<usize> {
    let mut uses = vec![0; lowered.rules.len()];
    for (v, rule) in lowered.rules.iter().enumerate() {
        operands(lowered, v, rule).for_each(|a| uses[a] += 1);
    }
    lowered.outputs.iter().for_each(|&a| uses[a] += 2);
    uses
}

fn operands(lowered: &Lowered, v: usize, rule: &Rule) -> impl Iterator<Item = usize> {
    let operands = match *rule {
        Rule::Input | Rule::Fixed(_) => [None; 3],
        Rule::Sum { a, b, .. } | Rule::Product(a, b) | Rule::Quotient(a, b) => [Some(a), Some(b), None],
        Rule::Scaled { by, of } => [Some(by), Some(of), None],
        Rule::Power { of, by, .. } => [Some(of), by, None],
        Rule::Integral { of, start: Start::Atan2(x), .. } => [Some(of), Some(lowered.slopes[&v]), Some(x)],
        Rule::Integral { of, by, .. } => [Some(of), Some(lowered.slopes[&v]), by],
    };
    operands.into_iter().flatten()
}

/// The values that reach an output.
fn needed(lowered: &Lowered, terms: &[Vec<Addend>]) -> Vec<bool> {
    let mut needed = vec![false; lowered.rules.len()];
    let mut open = lowered.outputs.clone();
    while let Some(v) = open.pop() {
        if std::mem::replace(&mut needed[v], true) {
            continue;
        }
        if terms[v].is_empty() {
            open.extend(operands(lowered, v, &lowered.rules[v]));
        } else {
            open.extend(terms[v].iter().map(|t| t.value));
        }
    }
    needed
}

impl Sums {
    fn push(&mut self, lowered: &Lowered, out: usize, terms: &[Addend]) {
        let (moving, fixed): (Vec<&Addend>, Vec<&Addend>) =
            terms.iter().partition(|t| lowered.moves[t.value]);
        self.terms.extend(fixed.iter().chain(&moving).copied());
        self.sums.push((out, self.terms.len(), fixed.len()));
    }

    /// Each sum with the terms that move.
    pub(super) fn each(&self) -> impl Iterator<Item = (usize, &[Addend])> {
        let mut from = 0;
        self.sums.iter().map(move |&(out, to, fixed)| {
            let moving = &self.terms[from + fixed..to];
            from = to;
            (out, moving)
        })
    }

    fn begin(&self, row: &mut [f64]) {
        let mut from = 0;
        for &(out, to, _) in &self.sums {
            let value = |t: &Addend| t.by.map_or(t.factor, |by| t.factor * row[by]) * row[t.value];
            if let Some((first, rest)) = self.terms[from..to].split_first() {
                row[out] = rest.iter().fold(value(first), |sum, t| sum + value(t));
            }
            from = to;
        }
    }
}

fn item(lowered: &Lowered, out: usize) -> Option<(Kind, Item)> {
    let item = |first, second| Item { out, first, second, exponent: 0.0, start: Start::Zero, by: None };
    Some(match lowered.rules[out] {
        Rule::Product(a, b) if a == b => (Kind::Square, item(a, b)),
        Rule::Product(a, b) => (Kind::Product, item(a, b)),
        Rule::Quotient(a, b) => (Kind::Quotient, item(a, b)),
        Rule::Power { of, exponent, start, by } => {
            (Kind::Power, Item { exponent, start, by, ..item(of, of) })
        }
        Rule::Integral { of, start, by } => {
            (Kind::Integral, Item { start, by, ..item(of, lowered.slopes[&out]) })
        }
        Rule::Input | Rule::Fixed(_) | Rule::Sum { .. } | Rule::Scaled { .. } => return None,
    })
}
