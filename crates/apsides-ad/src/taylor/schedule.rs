//! The order of the recurrences, which go together, and the sums of products that they need.

use super::convolutions::{Convolution, Weight};
use super::lanes::{Lanes, WIDTH};
use super::lowering::{Lowered, Rule, Start};
use super::rules::{Item, Kind};

/// Sums of values with weights, one after the other.
#[derive(Clone, Debug, Default)]
pub(super) struct Sums {
    /// Values that they are; the end of their terms; the number of terms that are fixed, which stand first and count at order zero alone.
    pub(super) sums: Vec<(usize, usize, usize)>,
    /// Weights and values.
    pub(super) terms: Vec<(f64, usize)>,
    /// Terms whose weight is times a fixed value, that value, the factor.
    pub(super) by: Vec<(usize, usize, f64)>,
}

/// Values that are computed together.
#[derive(Clone, Debug)]
pub(super) enum Group {
    Sums(Sums),
    /// Values of one rule, and the place of their first sum of products.
    Rules(Kind, usize, Vec<Item>),
    Lanes(Lanes),
}

/// A term of a sum while sums are put together: constant factor, fixed factor if any, value.
type Addend = (f64, Option<usize>, usize);

/// The sums of products that the rules of the groups need, in their order.
pub(super) fn convolutions(groups: &mut [Group]) -> Vec<Convolution> {
    let mut all = Vec::new();
    for group in groups {
        let Group::Rules(kind, from, items) = group else { continue };
        *from = all.len();
        for item in items {
            all.push(match kind {
                Kind::Square | Kind::Product => Convolution::new(item.first, Weight::One, item.second),
                Kind::Quotient => Convolution::new(item.second, Weight::One, item.out),
                Kind::Power => Convolution::new(item.first, Weight::Power(item.exponent), item.out),
                Kind::Integral => Convolution::new(item.first, Weight::Order, item.second),
            });
        }
    }
    all
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
            if inner.is_empty() || (by.is_some() && inner.iter().any(|t| t.1.is_some())) {
                all.push((factor, by, value));
            } else {
                all.extend(inner.iter().map(|&(c, inner, v)| (factor * c, by.or(inner), v)));
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
            let ready = !terms[v].is_empty() && terms[v].iter().all(|t| done[t.2]);
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
        for items in items.chunks(WIDTH) {
            groups.push(match items {
                [_] => Group::Rules(kind, 0, items.to_vec()),
                _ => Group::Lanes(Lanes::new(kind, items)),
            });
        }
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
            open.extend(terms[v].iter().map(|t| t.2));
        }
    }
    needed
}

impl Sums {
    fn push(&mut self, lowered: &Lowered, out: usize, terms: &[Addend]) {
        let (moving, fixed): (Vec<&Addend>, Vec<&Addend>) = terms.iter().partition(|t| lowered.moves[t.2]);
        for &&(factor, by, value) in fixed.iter().chain(&moving) {
            if let Some(by) = by {
                self.by.push((self.terms.len(), by, factor));
            }
            self.terms.push((factor, value));
        }
        self.sums.push((out, self.terms.len(), fixed.len()));
    }

    /// Takes the weights that are fixed values from the coefficients of order zero.
    pub(super) fn weigh(&mut self, row: &[f64]) {
        self.by.iter().for_each(|&(k, value, factor)| self.terms[k].0 = factor * row[value]);
    }

    #[inline(always)]
    pub(super) fn advance(&self, k: usize, row: &mut [f64]) {
        let mut from = 0;
        for &(out, to, fixed) in &self.sums {
            let start = if k == 0 { from } else { from + fixed };
            if let Some(((weight, value), rest)) = self.terms[start..to].split_first() {
                row[out] = rest.iter().fold(weight * row[*value], |sum, &(w, v)| sum + w * row[v]);
            }
            from = to;
        }
    }
}

fn item(lowered: &Lowered, out: usize) -> Option<(Kind, Item)> {
    let item = |first, second| Item {
        out,
        first,
        second,
        exponent: 0.0,
        start: Start::Zero,
        by: None,
        zeroth: [0.0; 2],
        inverse: 0.0,
    };
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
