//! Weighted Hessians by second-order adjoints: the model's formula is evaluated once and its operations are eliminated
//! from the last to the first (edge pushing: Gower & Mello 2012, doi 10.1080/10556788.2011.580098).
//!
//! The adjoint of a value `k` is `d(sum w f)/dk`, the second adjoint of a pair `(j, k)` the second derivative with respect to both,
//! the values before them being held. Eliminating `i = g(j, ..)` moves its adjoints to its operands:
//!
//! ```text
//! a_j += a_i g_j;   h_jk += a_i g_jk;   h_pj += h_pi g_j (p < i);   h_jk += h_ii g_j g_k
//! ```
//!
//! The formula alone tells which of them are not zero, so that all is one list of products, made once.

use std::collections::BTreeMap;

use crate::formula::{Binary, Formula, Operation, Unary};
use crate::{HyperDual, NodePattern, Scalar};

/// Most numbers, and most adjoints, of a plan: they stand on the stack.
const MAX_SLOTS: usize = 1024;

/// Place of a number: a constant, a value or a partial derivative.
type Slot = u16;

/// Evaluation of one operation, with its partial derivatives where they are not numbers that are there already.
#[derive(Clone, Copy, Debug)]
enum Step {
    Add(Slot, Slot),
    Sub(Slot, Slot),
    Mul(Slot, Slot),
    /// `[sin, cos, -sin, -cos]`.
    SinCos(Slot),
    /// `[g, g', g'']`.
    Unary(Unary, Slot),
    Powi(Slot, i32),
    Powf(Slot, f64),
    /// `[g, g_y, g_x, g_yy, g_yx, g_xx]`.
    Atan2(Slot, Slot),
}

/// `adjoints[target] += adjoints[source] * numbers[factor]`.
#[derive(Clone, Copy, Debug)]
struct Product {
    target: Slot,
    source: Slot,
    factor: Slot,
}

/// The list of operations that evaluates the weighted Hessian of a formula.
pub(crate) struct AdjointPlan {
    /// Inputs, then constants and results of steps; constants in their places, zero elsewhere.
    numbers: Vec<f64>,
    /// Steps with the first place of their results.
    steps: Vec<(Step, Slot)>,
    /// Adjoint of each output that takes part, and the output.
    seeds: Vec<(Slot, usize)>,
    products: Vec<Product>,
    /// Adjoint that each entry of the Hessian is; place 0 is always zero.
    entries: Vec<Slot>,
    adjoints: usize,
}

impl AdjointPlan {
    /// None where passes of hyper-dual numbers of `lanes` lanes are to be preferred.
    pub(crate) fn new(formula: &Formula, pattern: &NodePattern, lanes: usize) -> Option<Self> {
        let plan = Builder::new(formula).finish(pattern)?;
        let passes = pattern.hessian_len().div_ceil(lanes);
        // A lane costs a few products per operation.
        let worth = plan.products.len() <= passes * lanes * formula.operations().len();
        (worth && plan.numbers.len().max(plan.adjoints) <= MAX_SLOTS).then_some(plan)
    }

    /// Writes the Hessian entries in the order of the pattern.
    pub(crate) fn hessian(&self, z: &[f64], weights: &[f64], entries: &mut [f64]) {
        match self.numbers.len().max(self.adjoints) {
            0..=64 => self.evaluate::<64>(z, weights, entries),
            65..=128 => self.evaluate::<128>(z, weights, entries),
            129..=256 => self.evaluate::<256>(z, weights, entries),
            257..=512 => self.evaluate::<512>(z, weights, entries),
            _ => self.evaluate::<MAX_SLOTS>(z, weights, entries),
        }
    }

    fn evaluate<const N: usize>(&self, z: &[f64], weights: &[f64], entries: &mut [f64]) {
        // With a power of two the mask shows the compiler that an index is in range.
        const { assert!(N.is_power_of_two()) };
        let at = |slot: Slot| usize::from(slot) & (N - 1);
        let mut v = [0.0; N];
        v[..self.numbers.len()].copy_from_slice(&self.numbers);
        v[..z.len()].copy_from_slice(z);
        for &(step, first) in &self.steps {
            let t = at(first);
            match step {
                Step::Add(a, b) => v[t] = v[at(a)] + v[at(b)],
                Step::Sub(a, b) => v[t] = v[at(a)] - v[at(b)],
                Step::Mul(a, b) => v[t] = v[at(a)] * v[at(b)],
                Step::SinCos(a) => {
                    let (s, c) = v[at(a)].sin_cos();
                    v[t..t + 4].copy_from_slice(&[s, c, -s, -c]);
                }
                Step::Unary(g, a) => {
                    let x = v[at(a)];
                    v[t..t + 3].copy_from_slice(&derivatives(x, |x| g.apply(x)));
                }
                Step::Powi(a, n) => {
                    let x = v[at(a)];
                    v[t..t + 3].copy_from_slice(&derivatives(x, |x| x.powi(n)));
                }
                Step::Powf(a, n) => {
                    let x = v[at(a)];
                    v[t..t + 3].copy_from_slice(&derivatives(x, |x| x.powf(n)));
                }
                Step::Atan2(y, x) => {
                    let (y, x) = (v[at(y)], v[at(x)]);
                    v[t..t + 6].copy_from_slice(&derivatives_of_angle(y, x));
                }
            }
        }
        let mut w = [0.0; N];
        for &(slot, output) in &self.seeds {
            w[at(slot)] += weights[output];
        }
        for p in &self.products {
            w[at(p.target)] += w[at(p.source)] * v[at(p.factor)];
        }
        for (entry, &slot) in entries.iter_mut().zip(&self.entries) {
            *entry = w[at(slot)];
        }
    }
}

/// `[g, g', g'']` at `x`, from the rules of the scalar trait.
#[inline]
fn derivatives(x: f64, g: impl Fn(HyperDual<1>) -> HyperDual<1>) -> [f64; 3] {
    let y = g(HyperDual { re: x, e1: [1.0], e2: [1.0], e12: [0.0] });
    [y.re, y.e1[0], y.e12[0]]
}

fn derivatives_of_angle(y: f64, x: f64) -> [f64; 6] {
    let pairs = |re, e1, e2| HyperDual::<3> { re, e1, e2, e12: [0.0; 3] };
    // Lanes: both directions y; y and x; both x.
    let a = pairs(y, [1.0, 1.0, 0.0], [1.0, 0.0, 0.0]).atan2(pairs(x, [0.0, 0.0, 1.0], [0.0, 1.0, 1.0]));
    [a.re, a.e1[0], a.e1[2], a.e12[0], a.e12[1], a.e12[2]]
}

/// A value of the formula.
#[derive(Clone, Copy)]
enum Value {
    Constant(f64),
    /// Slot of its number, and the variable whose adjoints it shares: a shift by a constant has those of its operand.
    Variable(Slot, usize),
}

/// A quantity with adjoints.
#[derive(Default)]
struct Variable {
    /// Operands and the places of the partial derivatives.
    first: Vec<(usize, Slot)>,
    /// Pairs of operands and the places of the second derivatives, those of mixed ones once.
    second: Vec<(usize, usize, Slot)>,
}

struct Builder<'a> {
    formula: &'a Formula,
    numbers: Vec<f64>,
    constants: BTreeMap<u64, Slot>,
    steps: Vec<(Step, Slot)>,
    variables: Vec<Variable>,
    /// First place of sine and cosine, by the place of the angle.
    sines: BTreeMap<Slot, Slot>,
    values: Vec<Value>,
    products: Vec<Product>,
    first_adjoints: BTreeMap<usize, Slot>,
    /// Second adjoints by their pair of variables, the later one first.
    second_adjoints: BTreeMap<(usize, usize), Slot>,
    /// Place 0 stays zero.
    adjoints: usize,
}

impl<'a> Builder<'a> {
    fn new(formula: &'a Formula) -> Self {
        let n = formula.inputs();
        Self {
            formula,
            numbers: vec![0.0; n],
            constants: BTreeMap::new(),
            steps: Vec::new(),
            variables: (0..n).map(|_| Variable::default()).collect(),
            sines: BTreeMap::new(),
            values: (0..n).map(|k| Value::Variable(k as Slot, k)).collect(),
            products: Vec::new(),
            first_adjoints: BTreeMap::new(),
            second_adjoints: BTreeMap::new(),
            adjoints: 1,
        }
    }

    fn finish(mut self, pattern: &NodePattern) -> Option<AdjointPlan> {
        let formula = self.formula;
        for &operation in formula.operations() {
            let value = self.value_of(operation)?;
            self.values.push(value);
            if self.numbers.len() > MAX_SLOTS {
                return None;
            }
        }
        let mut seeds = Vec::new();
        for (output, &k) in formula.outputs().iter().enumerate() {
            if let Value::Variable(_, variable) = self.values[k] {
                seeds.push((self.first_adjoint(variable), output));
            }
        }
        for i in (formula.inputs()..self.variables.len()).rev() {
            self.eliminate(i);
            if self.adjoints > usize::from(Slot::MAX) / 2 {
                return None;
            }
        }
        let entries: Vec<Slot> =
            pattern.hessian.iter().map(|p| self.second_adjoints.get(p).copied().unwrap_or(0)).collect();
        let mut plan = AdjointPlan {
            numbers: self.numbers,
            steps: self.steps,
            seeds,
            products: self.products,
            entries,
            adjoints: self.adjoints,
        };
        plan.prune();
        Some(plan)
    }

    /// None for operations that such a plan has not.
    fn value_of(&mut self, operation: Operation) -> Option<Value> {
        Some(match operation {
            Operation::Constant(c) => Value::Constant(c),
            Operation::Unary(g, a) => match (g, self.values[a]) {
                (_, Value::Constant(c)) => Value::Constant(g.apply(c)),
                (Unary::Neg, v) => self.scaled(v, -1.0),
                (Unary::Sin | Unary::Cos, Value::Variable(x, i)) => {
                    let s = match self.sines.get(&x) {
                        Some(&s) => s,
                        None => self.step(Step::SinCos(x), 4),
                    };
                    self.sines.insert(x, s);
                    let k = if g == Unary::Sin { s } else { s + 1 };
                    self.variable(
                        k,
                        vec![(i, if g == Unary::Sin { s + 1 } else { s + 2 })],
                        vec![(i, i, k + 2)],
                    )
                }
                (_, Value::Variable(x, i)) => self.of_one(Step::Unary(g, x), i),
            },
            Operation::Powi(a, n) => match self.values[a] {
                Value::Constant(c) => Value::Constant(c.powi(n)),
                v if n == 2 => self.product(v, v),
                Value::Variable(x, i) => self.of_one(Step::Powi(x, n), i),
            },
            Operation::Powf(a, n) => match self.values[a] {
                Value::Constant(c) => Value::Constant(c.powf(n)),
                Value::Variable(x, i) => self.of_one(Step::Powf(x, n), i),
            },
            Operation::Binary(Binary::Pow | Binary::Min | Binary::Max, ..)
            | Operation::Select(..)
            | Operation::Curve(..)
            | Operation::Surface(..) => return None,
            Operation::Binary(g, a, b) => self.of_two(g, self.values[a], self.values[b]),
        })
    }

    fn of_two(&mut self, g: Binary, a: Value, b: Value) -> Value {
        if let (Value::Constant(a), Value::Constant(b)) = (a, b) {
            return Value::Constant(g.apply(a, b));
        }
        let (x, y) = (self.place(a), self.place(b));
        match g {
            Binary::Add | Binary::Sub => {
                let step = if g == Binary::Add { Step::Add(x, y) } else { Step::Sub(x, y) };
                let k = self.step(step, 1);
                let sign = self.constant(if g == Binary::Add { 1.0 } else { -1.0 });
                let one = self.constant(1.0);
                match (a, b) {
                    (Value::Variable(_, i), Value::Constant(_)) => Value::Variable(k, i),
                    (Value::Constant(_), Value::Variable(_, j)) if g == Binary::Add => Value::Variable(k, j),
                    _ => {
                        let first = variables([(a, one), (b, sign)]);
                        self.variable(k, first, vec![])
                    }
                }
            }
            Binary::Mul => self.product(a, b),
            Binary::Div => match b {
                Value::Constant(c) => self.scaled(a, 1.0 / c),
                Value::Variable(y, j) => {
                    let reciprocal = self.of_one(Step::Unary(Unary::Recip, y), j);
                    self.product(a, reciprocal)
                }
            },
            _ => {
                let k = self.step(Step::Atan2(x, y), 6);
                let first = variables([(a, k + 1), (b, k + 2)]);
                let second = match (a, b) {
                    (Value::Variable(_, i), Value::Variable(_, j)) => {
                        vec![(i, i, k + 3), (i, j, k + 4), (j, j, k + 5)]
                    }
                    (Value::Variable(_, i), _) => vec![(i, i, k + 3)],
                    (_, Value::Variable(_, j)) => vec![(j, j, k + 5)],
                    _ => vec![],
                };
                // A mixed pair of one variable with itself counts from both sides.
                let twice = second.iter().filter(|s| s.2 == k + 4 && s.0 == s.1).copied().collect::<Vec<_>>();
                self.variable(k, first, second.into_iter().chain(twice).collect())
            }
        }
    }

    fn product(&mut self, a: Value, b: Value) -> Value {
        match (a, b) {
            (Value::Constant(c), v) | (v, Value::Constant(c)) => self.scaled(v, c),
            (Value::Variable(x, i), Value::Variable(y, j)) => {
                let k = self.step(Step::Mul(x, y), 1);
                let one = self.constant(1.0);
                let times = if i == j { 2 } else { 1 };
                self.variable(k, vec![(i, y), (j, x)], vec![(i, j, one); times])
            }
        }
    }

    fn scaled(&mut self, v: Value, factor: f64) -> Value {
        match v {
            Value::Constant(c) => Value::Constant(c * factor),
            Value::Variable(x, i) => {
                let c = self.constant(factor);
                let k = self.step(Step::Mul(x, c), 1);
                self.variable(k, vec![(i, c)], vec![])
            }
        }
    }

    /// A function of one variable whose step gives value, first and second derivative.
    fn of_one(&mut self, step: Step, i: usize) -> Value {
        let k = self.step(step, 3);
        self.variable(k, vec![(i, k + 1)], vec![(i, i, k + 2)])
    }

    fn variable(&mut self, k: Slot, first: Vec<(usize, Slot)>, second: Vec<(usize, usize, Slot)>) -> Value {
        self.variables.push(Variable { first, second });
        Value::Variable(k, self.variables.len() - 1)
    }

    fn step(&mut self, step: Step, results: usize) -> Slot {
        let first = self.numbers.len() as Slot;
        self.numbers.resize(self.numbers.len() + results, 0.0);
        self.steps.push((step, first));
        first
    }

    fn constant(&mut self, c: f64) -> Slot {
        let numbers = &mut self.numbers;
        *self.constants.entry(c.to_bits()).or_insert_with(|| {
            numbers.push(c);
            (numbers.len() - 1) as Slot
        })
    }

    fn place(&mut self, v: Value) -> Slot {
        match v {
            Value::Constant(c) => self.constant(c),
            Value::Variable(slot, _) => slot,
        }
    }

    fn new_adjoint(&mut self) -> Slot {
        self.adjoints += 1;
        (self.adjoints - 1) as Slot
    }

    fn first_adjoint(&mut self, i: usize) -> Slot {
        match self.first_adjoints.get(&i) {
            Some(&slot) => slot,
            None => {
                let slot = self.new_adjoint();
                self.first_adjoints.insert(i, slot);
                slot
            }
        }
    }

    fn second_adjoint(&mut self, i: usize, j: usize) -> Slot {
        let pair = (i.max(j), i.min(j));
        match self.second_adjoints.get(&pair) {
            Some(&slot) => slot,
            None => {
                let slot = self.new_adjoint();
                self.second_adjoints.insert(pair, slot);
                slot
            }
        }
    }

    fn add(&mut self, target: Slot, source: Slot, factor: Slot) {
        self.products.push(Product { target, source, factor });
    }

    /// Moves the adjoints of a variable to its operands, which all stand before it.
    fn eliminate(&mut self, i: usize) {
        let Variable { first, second } = std::mem::take(&mut self.variables[i]);
        if let Some(&adjoint) = self.first_adjoints.get(&i) {
            for &(j, g) in &first {
                let target = self.first_adjoint(j);
                self.add(target, adjoint, g);
            }
            for &(j, k, g) in &second {
                let target = self.second_adjoint(j, k);
                self.add(target, adjoint, g);
            }
        }
        let pairs: Vec<(usize, Slot)> =
            self.second_adjoints.range((i, 0)..=(i, i)).map(|(&(_, p), &slot)| (p, slot)).collect();
        for (p, source) in pairs {
            if p < i {
                for &(j, g) in &first {
                    let target = self.second_adjoint(p, j);
                    // A diagonal entry is reached from both sides.
                    for _ in 0..if p == j { 2 } else { 1 } {
                        self.add(target, source, g);
                    }
                }
            } else {
                for (place, &(j, g)) in first.iter().enumerate() {
                    let half = self.new_adjoint();
                    self.add(half, source, g);
                    let target = self.second_adjoint(j, j);
                    self.add(target, half, g);
                    for &(k, g) in &first[place + 1..] {
                        let target = self.second_adjoint(j, k);
                        for _ in 0..if k == j { 2 } else { 1 } {
                            self.add(target, half, g);
                        }
                    }
                }
            }
        }
    }
}

fn variables<const N: usize>(operands: [(Value, Slot); N]) -> Vec<(usize, Slot)> {
    let variable = |(v, partial): (Value, Slot)| match v {
        Value::Variable(_, i) => Some((i, partial)),
        Value::Constant(_) => None,
    };
    operands.into_iter().filter_map(variable).collect()
}

impl AdjointPlan {
    /// Drops what reaches no entry of the Hessian, and numbers the adjoints that are left anew.
    fn prune(&mut self) {
        let mut needed = vec![false; self.adjoints];
        for &slot in &self.entries {
            needed[usize::from(slot)] = true;
        }
        let mut factors = vec![false; self.numbers.len()];
        let mut kept: Vec<Product> = Vec::with_capacity(self.products.len());
        for p in self.products.iter().rev() {
            if needed[usize::from(p.target)] {
                needed[usize::from(p.source)] = true;
                factors[usize::from(p.factor)] = true;
                kept.push(*p);
            }
        }
        kept.reverse();
        self.products = kept;
        self.seeds.retain(|&(slot, _)| needed[usize::from(slot)]);
        needed[0] = true;
        let mut place = vec![0; needed.len()];
        let mut next = 0;
        for (place, needed) in place.iter_mut().zip(&needed) {
            *place = next;
            next += Slot::from(*needed);
        }
        self.adjoints = usize::from(next);
        let new = |slot: &mut Slot| *slot = place[usize::from(*slot)];
        self.seeds.iter_mut().for_each(|(slot, _)| new(slot));
        self.entries.iter_mut().for_each(&new);
        for p in &mut self.products {
            new(&mut p.target);
            new(&mut p.source);
        }
        let mut steps = Vec::with_capacity(self.steps.len());
        for &(step, first) in self.steps.iter().rev() {
            let (operands, results) = step.shape();
            if factors[usize::from(first)..][..results].contains(&true) {
                operands.into_iter().flatten().for_each(|a| factors[usize::from(a)] = true);
                steps.push((step, first));
            }
        }
        steps.reverse();
        self.steps = steps;
    }
}

impl Step {
    /// Operands and number of results.
    fn shape(self) -> ([Option<Slot>; 2], usize) {
        match self {
            Self::Add(a, b) | Self::Sub(a, b) | Self::Mul(a, b) => ([Some(a), Some(b)], 1),
            Self::SinCos(a) => ([Some(a), None], 4),
            Self::Unary(_, a) | Self::Powi(a, _) | Self::Powf(a, _) => ([Some(a), None], 3),
            Self::Atan2(a, b) => ([Some(a), Some(b)], 6),
        }
    }
}
