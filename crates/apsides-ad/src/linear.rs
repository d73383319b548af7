//! The partial derivatives of each operation of a formula, as terms of a graph.
//!
//! They are written like those of [`Scalar`](crate::Scalar), and no sums are merged: tangents have every bit of those of dual numbers.

use crate::formula::{Binary, Formula, Operation, Unary};
use crate::graph::{Graph, Term};
use crate::program::Op;

/// A quantity that depends on inputs: an input or the result of an operation.
#[derive(Clone, Debug, Default)]
pub(crate) struct Variable {
    /// Variables before it with the partial derivatives.
    pub(crate) first: Vec<(u32, Term)>,
    /// Pairs of variables, the later one first, with the second derivatives; mixed ones of two variables once, of a variable with itself
    /// from both sides.
    pub(crate) second: Vec<(u32, u32, Term)>,
    /// One of its operands is chosen: its derivatives are zero for the others, which may be anything.
    pub(crate) chooses: bool,
    /// A choice may leave it out.
    pub(crate) optional: bool,
}

/// A formula with the derivatives of its operations.
pub(crate) struct Linearised {
    pub(crate) graph: Graph,
    /// Inputs first, then operations in their order.
    pub(crate) variables: Vec<Variable>,
    pub(crate) inputs: usize,
    /// Term of each output, and its variable; none for a constant.
    pub(crate) outputs: Vec<(Term, Option<u32>)>,
}

/// A value of the formula. A shift by a constant has the variable of its operand.
#[derive(Clone, Copy)]
struct Operand {
    term: Term,
    variable: Option<u32>,
}

/// The derivatives that are asked for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Order {
    /// First ones.
    First,
    /// First and second ones; a quotient is a product with a reciprocal.
    Second,
}

struct Builder {
    order: Order,
    graph: Graph,
    variables: Vec<Variable>,
    values: Vec<Operand>,
}

impl Linearised {
    pub(crate) fn new(formula: &Formula, order: Order) -> Self {
        let mut graph = Graph::new(formula.tables());
        let inputs = formula.inputs();
        let values: Vec<Operand> =
            (0..inputs).map(|k| Operand { term: graph.input(k), variable: Some(k as u32) }).collect();
        let variables = vec![Variable::default(); inputs];
        let mut builder = Builder { order, graph, variables, values };
        for &operation in formula.operations() {
            let value = builder.value(operation);
            builder.values.push(value);
        }
        let Builder { graph, mut variables, values, .. } = builder;
        for i in (inputs..variables.len()).rev() {
            if variables[i].chooses || variables[i].optional {
                for k in 0..variables[i].first.len() {
                    let (j, _) = variables[i].first[k];
                    variables[j as usize].optional = true;
                }
            }
        }
        let outputs = formula.outputs().iter().map(|&k| (values[k].term, values[k].variable)).collect();
        Self { graph, variables, inputs, outputs }
    }
}

impl Builder {
    fn value(&mut self, operation: Operation) -> Operand {
        match operation {
            Operation::Constant(c) => self.constant(c),
            Operation::Unary(f, a) => self.unary(f, self.values[a]),
            Operation::Powi(a, n) => {
                let a = self.values[a];
                let term = self.graph.powi(a.term, n);
                match n {
                    1 => a,
                    _ => self.of_one(term, a, |graph, x, _| powi(graph, x, n)),
                }
            }
            Operation::Powf(a, n) => {
                let a = self.values[a];
                let term = self.graph.of(Op::Powf, &[a.term], n, 0);
                self.of_one(term, a, |graph, x, v| {
                    let first = graph.of(Op::LowerPower, &[v, v, x], n - 1.0, 0);
                    let second = graph.of(Op::LowerPower, &[v, first, x], n - 2.0, 0);
                    [graph.scale(first, n), graph.scale(second, n * (n - 1.0))]
                })
            }
            Operation::Binary(f, a, b) => self.binary(f, self.values[a], self.values[b]),
            Operation::Select(c, a, b) => {
                let [c, a, b] = [c, a, b].map(|k| self.values[k]);
                match self.graph.number(c.term) {
                    Some(c) if c >= 0.0 => a,
                    Some(c) if c < 0.0 => b,
                    _ => {
                        let term = self.graph.plain(Op::Select, &[c.term, a.term, b.term]);
                        let chosen = self.graph.plain(Op::IsNonNegative, &[c.term]);
                        self.choice(term, chosen, a, b)
                    }
                }
            }
            Operation::Curve(t, a) => {
                let a = self.values[a];
                let term = self.graph.of(Op::Curve(0), &[a.term], 0.0, t);
                self.of_one(term, a, |graph, x, _| [1, 2].map(|k| graph.of(Op::Curve(k), &[x], 0.0, t)))
            }
            Operation::Surface(t, a, b) => {
                let (a, b) = (self.values[a], self.values[b]);
                let mut part = |k| self.graph.of(Op::Surface(k), &[a.term, b.term], 0.0, t);
                let [term, x, y, xx, xy, yy] = [0, 1, 2, 3, 4, 5].map(&mut part);
                self.of_two(term, (a, b), [x, y], [xx, xy, yy])
            }
        }
    }

    fn unary(&mut self, f: Unary, a: Operand) -> Operand {
        let term = match f {
            Unary::Neg => self.graph.neg(a.term),
            Unary::Recip => self.graph.recip(a.term),
            _ => self.graph.unary(f, a.term),
        };
        self.of_one(term, a, |graph, x, v| unary(graph, f, x, v))
    }

    fn constant(&mut self, c: f64) -> Operand {
        Operand { term: self.graph.constant(c), variable: None }
    }

    fn binary(&mut self, f: Binary, a: Operand, b: Operand) -> Operand {
        let (x, y) = (a.term, b.term);
        let graph = &mut self.graph;
        let zero = graph.constant(0.0);
        let one = graph.constant(1.0);
        match f {
            Binary::Add | Binary::Sub => {
                let (op, sign) =
                    if f == Binary::Add { (Op::Add, one) } else { (Op::Sub, graph.constant(-1.0)) };
                let term = graph.plain(op, &[x, y]);
                match (a.variable, b.variable) {
                    (Some(i), None) => Operand { term, variable: Some(i) },
                    (None, Some(j)) if f == Binary::Add => Operand { term, variable: Some(j) },
                    _ => self.of_two(term, (a, b), [one, sign], [zero; 3]),
                }
            }
            Binary::Mul => {
                let term = graph.plain(Op::Mul, &[x, y]);
                self.of_two(term, (a, b), [y, x], [zero, one, zero])
            }
            Binary::Div => match (graph.number(y), self.order) {
                (Some(c), Order::Second) => {
                    let b = self.constant(1.0 / c);
                    self.binary(Binary::Mul, a, b)
                }
                (None, Order::Second) => {
                    let b = self.unary(Unary::Recip, b);
                    self.binary(Binary::Mul, a, b)
                }
                (_, Order::First) => {
                    let term = graph.plain(Op::Div, &[x, y]);
                    let by_x = graph.recip(y);
                    let quotient = graph.mul(x, by_x);
                    let product = graph.mul(quotient, by_x);
                    let by_y = graph.neg(product);
                    self.of_two(term, (a, b), [by_x, by_y], [zero; 3])
                }
            },
            Binary::Atan2 => {
                // The ordinate comes first.
                let term = graph.plain(Op::Atan2, &[x, y]);
                let (xx, yy) = (graph.mul(y, y), graph.mul(x, x));
                let square = graph.plain(Op::Add, &[xx, yy]);
                let by_ordinate = graph.plain(Op::Div, &[y, square]);
                let quotient = graph.plain(Op::Div, &[x, square]);
                let by_abscissa = graph.neg(quotient);
                let fourth = graph.mul(square, square);
                let twice = graph.scale(y, 2.0);
                let product = graph.mul(twice, x);
                let last = graph.plain(Op::Div, &[product, fourth]);
                let first = graph.neg(last);
                let difference = graph.plain(Op::Sub, &[yy, xx]);
                let mixed = graph.plain(Op::Div, &[difference, fourth]);
                self.of_two(term, (a, b), [by_ordinate, by_abscissa], [first, mixed, last])
            }
            Binary::Pow => self.power(a, b),
            Binary::Min | Binary::Max => {
                let (op, is) = if f == Binary::Min { (Op::Min, Op::IsMin) } else { (Op::Max, Op::IsMax) };
                let term = graph.plain(op, &[x, y]);
                let chosen = graph.plain(is, &[x, y]);
                self.choice(term, chosen, a, b)
            }
        }
    }

    fn power(&mut self, a: Operand, b: Operand) -> Operand {
        let (x, y) = (a.term, b.term);
        let graph = &mut self.graph;
        let p = graph.plain(Op::Pow, &[x, y]);
        let ln = graph.plain(Op::LnOrZero, &[x]);
        let (minus_one, minus_two, one) = (graph.constant(-1.0), graph.constant(-2.0), graph.constant(1.0));
        let lower = graph.plain(Op::Add, &[y, minus_one]);
        let lowest = graph.plain(Op::Add, &[y, minus_two]);
        let (p1, p2) = (graph.plain(Op::Pow, &[x, lower]), graph.plain(Op::Pow, &[x, lowest]));
        let by_x = graph.guarded(y, p1);
        let by_y = graph.mul(p, ln);
        let factor = graph.mul(y, lower);
        let xx = graph.guarded(factor, p2);
        let product = graph.mul(y, ln);
        let shifted = graph.add(product, one);
        let mixed = graph.mul(p1, shifted);
        let yy = graph.mul(by_y, ln);
        self.of_two(p, (a, b), [by_x, by_y], [xx, mixed, yy])
    }

    /// One of two values, the first where `chosen` is one, the second where it is zero.
    fn choice(&mut self, term: Term, chosen: Term, a: Operand, b: Operand) -> Operand {
        let (zero, one) = (self.graph.constant(0.0), self.graph.constant(1.0));
        let other = self.graph.sub(one, chosen);
        let value = self.of_two(term, (a, b), [chosen, other], [zero; 3]);
        if let Some(k) = value.variable {
            self.variables[k as usize].chooses = true;
        }
        value
    }

    fn of_one(
        &mut self,
        term: Term,
        a: Operand,
        derivatives: impl FnOnce(&mut Graph, Term, Term) -> [Term; 2],
    ) -> Operand {
        let Some(i) = a.variable else { return Operand { term, variable: None } };
        let [first, second] = derivatives(&mut self.graph, a.term, term);
        self.variable(term, vec![(i, first)], vec![(i, i, second)])
    }

    /// A function of two values with its first derivatives and its second ones: first, mixed, last.
    fn of_two(
        &mut self,
        term: Term,
        (a, b): (Operand, Operand),
        [x, y]: [Term; 2],
        [xx, xy, yy]: [Term; 3],
    ) -> Operand {
        let (first, second) = match (a.variable, b.variable) {
            (None, None) => return Operand { term, variable: None },
            (Some(i), None) => (vec![(i, x)], vec![(i, i, xx)]),
            (None, Some(j)) => (vec![(j, y)], vec![(j, j, yy)]),
            (Some(i), Some(j)) if i == j => {
                (vec![(i, x), (i, y)], vec![(i, i, xx), (i, i, xy), (i, i, yy), (i, i, xy)])
            }
            (Some(i), Some(j)) => {
                (vec![(i, x), (j, y)], vec![(i, i, xx), (i.max(j), i.min(j), xy), (j, j, yy)])
            }
        };
        self.variable(term, first, second)
    }

    fn variable(
        &mut self,
        term: Term,
        mut first: Vec<(u32, Term)>,
        mut second: Vec<(u32, u32, Term)>,
    ) -> Operand {
        let graph = &self.graph;
        first.retain(|&(_, g)| graph.number(g) != Some(0.0));
        second.retain(|&(_, _, g)| graph.number(g) != Some(0.0));
        if first.is_empty() && second.is_empty() {
            return Operand { term, variable: None };
        }
        self.variables.push(Variable { first, second, ..Variable::default() });
        Operand { term, variable: Some((self.variables.len() - 1) as u32) }
    }
}

/// First and second derivative of a function at `x`, where its value is `v`.
fn unary(graph: &mut Graph, f: Unary, x: Term, v: Term) -> [Term; 2] {
    let (zero, one) = (graph.constant(0.0), graph.constant(1.0));
    match f {
        Unary::Neg => [graph.constant(-1.0), zero],
        Unary::Sin => [graph.unary(Unary::Cos, x), graph.neg(v)],
        Unary::Cos => {
            let sine = graph.unary(Unary::Sin, x);
            [graph.neg(sine), graph.neg(v)]
        }
        Unary::Tan => {
            let square = graph.mul(v, v);
            let first = graph.add(square, one);
            let product = graph.mul(v, first);
            [first, graph.scale(product, 2.0)]
        }
        Unary::Tanh => {
            let square = graph.mul(v, v);
            let first = graph.sub(one, square);
            let product = graph.mul(v, first);
            [first, graph.scale(product, -2.0)]
        }
        Unary::Asin | Unary::Acos => {
            let square = graph.mul(x, x);
            let difference = graph.sub(one, square);
            let first = inverse_root(graph, difference);
            let second = cube(graph, first, x);
            if f == Unary::Asin { [first, second] } else { [graph.neg(first), graph.neg(second)] }
        }
        Unary::Atan => {
            let square = graph.mul(x, x);
            let sum = graph.add(square, one);
            let first = graph.recip(sum);
            let twice = graph.scale(x, -2.0);
            let product = graph.mul(twice, first);
            [first, graph.mul(product, first)]
        }
        Unary::Sqrt => {
            let half = graph.constant(0.5);
            let (product, quarter) = (graph.mul(v, x), graph.constant(-0.25));
            [graph.plain(Op::Div, &[half, v]), graph.plain(Op::Div, &[quarter, product])]
        }
        Unary::Cbrt => {
            let triple = graph.scale(v, 3.0);
            let square = graph.mul(triple, v);
            let first = graph.recip(square);
            let product = graph.scale(first, -2.0 / 3.0);
            [first, graph.plain(Op::Div, &[product, x])]
        }
        Unary::Exp => [v, v],
        Unary::Ln => {
            let (square, minus) = (graph.mul(x, x), graph.constant(-1.0));
            [graph.recip(x), graph.plain(Op::Div, &[minus, square])]
        }
        Unary::Sinh => [graph.unary(Unary::Cosh, x), v],
        Unary::Cosh => [graph.unary(Unary::Sinh, x), v],
        Unary::Asinh => {
            let square = graph.mul(x, x);
            let sum = graph.add(square, one);
            let first = inverse_root(graph, sum);
            let second = cube(graph, first, x);
            [first, graph.neg(second)]
        }
        Unary::Acosh => {
            let (below, above) = (graph.sub(x, one), graph.add(x, one));
            let product = graph.mul(below, above);
            let first = inverse_root(graph, product);
            let second = cube(graph, first, x);
            [first, graph.neg(second)]
        }
        Unary::Atanh => {
            let (below, above) = (graph.sub(one, x), graph.add(x, one));
            let product = graph.mul(below, above);
            let first = graph.recip(product);
            let twice = graph.scale(x, 2.0);
            let product = graph.mul(twice, first);
            [first, graph.mul(product, first)]
        }
        Unary::Recip => {
            let square = graph.mul(v, v);
            let first = graph.neg(square);
            let product = graph.mul(first, v);
            [first, graph.scale(product, -2.0)]
        }
        Unary::Abs => [graph.unary(Unary::Sign, x), zero],
        Unary::Sign => [zero, zero],
    }
}

fn inverse_root(graph: &mut Graph, x: Term) -> Term {
    let root = graph.unary(Unary::Sqrt, x);
    graph.recip(root)
}

/// `x d^3`.
fn cube(graph: &mut Graph, d: Term, x: Term) -> Term {
    let product = graph.mul(x, d);
    let square = graph.mul(product, d);
    graph.mul(square, d)
}

fn powi(graph: &mut Graph, x: Term, n: i32) -> [Term; 2] {
    let k = f64::from(n);
    match n {
        0 => [graph.constant(0.0); 2],
        2 => [graph.scale(x, 2.0), graph.constant(2.0)],
        _ => {
            let lower = graph.powi(x, n.saturating_sub(2));
            let product = graph.mul(lower, x);
            [graph.scale(product, k), graph.scale(lower, k * (k - 1.0))]
        }
    }
}
