//! Expressions that share their parts: formulas and their derivatives before they become a [`Program`].

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hash, Hasher};
use std::sync::Arc;

use crate::formula::Unary;
use crate::program::{Op, Program};
use crate::table::Table;

mod lowering;

/// A term of the graph: an index that is larger than those of its operands.
pub(crate) type Term = u32;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Vertex {
    op: Op,
    operands: [Term; 3],
    /// Bits of the number.
    number: u64,
}

impl Hash for Vertex {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        let [a, b, c] = self.operands;
        self.op.hash(hasher);
        hasher.write_u64(u64::from(a) << 32 | u64::from(b));
        hasher.write_u64(u64::from(c) ^ self.number);
    }
}

/// Hashes of terms: small numbers, of which every one counts. Building a graph is looking terms up, and the standard hash takes half of it.
#[derive(Debug, Default)]
struct Mixer(u64);

impl Hasher for Mixer {
    fn finish(&self) -> u64 {
        // The table takes its places from the low bits.
        self.0 ^ (self.0 >> 32)
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|b| self.write_u64(u64::from(*b)));
    }

    fn write_u8(&mut self, x: u8) {
        self.write_u64(u64::from(x));
    }

    fn write_u32(&mut self, x: u32) {
        self.write_u64(u64::from(x));
    }

    fn write_u64(&mut self, x: u64) {
        // An odd factor near 2^64 by the golden ratio.
        self.0 = (self.0.rotate_left(23) ^ x).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }

    fn write_usize(&mut self, x: usize) {
        self.write_u64(x as u64);
    }

    fn write_isize(&mut self, x: isize) {
        self.write_u64(x as u64);
    }
}

/// Terms that are written once. Functions of numbers are numbers.
#[derive(Debug)]
pub(crate) struct Graph {
    nodes: Vec<Vertex>,
    known: HashMap<Vertex, Term, BuildHasherDefault<Mixer>>,
    tables: Arc<[Arc<Table>]>,
}

impl Graph {
    pub(crate) fn new(tables: &[Arc<Table>]) -> Self {
        Self { nodes: Vec::new(), known: HashMap::default(), tables: tables.into() }
    }

    /// Number of terms.
    pub(crate) fn len(&self) -> usize {
        self.nodes.len()
    }

    fn term(&mut self, op: Op, operands: [Term; 3], number: f64) -> Term {
        let node = Vertex { op, operands, number: number.to_bits() };
        let next = self.nodes.len() as Term;
        let term = *self.known.entry(node).or_insert(next);
        if term == next {
            self.nodes.push(node);
        }
        term
    }

    pub(crate) fn input(&mut self, index: usize) -> Term {
        self.term(Op::Input, [index as Term, 0, 0], 0.0)
    }

    pub(crate) fn constant(&mut self, number: f64) -> Term {
        self.term(Op::Constant, [0; 3], number)
    }

    pub(crate) fn number(&self, term: Term) -> Option<f64> {
        let node = self.nodes[term as usize];
        (node.op == Op::Constant).then(|| f64::from_bits(node.number))
    }

    /// The term of an operation as it is, except that a function of numbers is a number.
    pub(crate) fn of(&mut self, op: Op, operands: &[Term], number: f64, table: usize) -> Term {
        let mut places = [0; 3];
        places[..operands.len()].copy_from_slice(operands);
        let mut numbers = [0.0; 3];
        let mut constant = true;
        for (x, &term) in numbers.iter_mut().zip(operands) {
            match self.number(term) {
                Some(c) => *x = c,
                None => constant = false,
            }
        }
        if constant {
            let table = self.tables.get(table).map(|t| &**t);
            return self.constant(op.apply(numbers, number, table));
        }
        if let Op::Curve(_) | Op::Surface(_) = op {
            places[2] = table as Term;
        }
        if matches!(op, Op::Add | Op::Mul) && places[1] < places[0] {
            places.swap(0, 1);
        }
        self.term(op, places, number)
    }

    /// The same for operations with operands alone.
    pub(crate) fn plain(&mut self, op: Op, operands: &[Term]) -> Term {
        self.of(op, operands, 0.0, 0)
    }

    pub(crate) fn unary(&mut self, function: Unary, a: Term) -> Term {
        self.plain(Op::Unary(function), &[a])
    }

    /// Sum of parts of derivatives, in which what is zero stays zero.
    pub(crate) fn add(&mut self, a: Term, b: Term) -> Term {
        match (self.number(a), self.number(b)) {
            (Some(0.0), _) => b,
            (_, Some(0.0)) => a,
            _ => match (self.opposite(a), self.opposite(b)) {
                (_, Some(b)) => self.plain(Op::Sub, &[a, b]),
                (Some(a), _) => self.plain(Op::Sub, &[b, a]),
                _ => self.plain(Op::Add, &[a, b]),
            },
        }
    }

    pub(crate) fn sub(&mut self, a: Term, b: Term) -> Term {
        let opposite = self.neg(b);
        self.add(a, opposite)
    }

    /// Product of parts of derivatives.
    pub(crate) fn mul(&mut self, a: Term, b: Term) -> Term {
        match (self.number(a), self.number(b)) {
            (Some(0.0), _) | (_, Some(0.0)) => self.constant(0.0),
            (Some(1.0), _) => b,
            (_, Some(1.0)) => a,
            (Some(-1.0), _) => self.neg(b),
            (_, Some(-1.0)) => self.neg(a),
            _ => {
                let (p, q) = (self.opposite(a), self.opposite(b));
                let product = self.plain(Op::Mul, &[p.unwrap_or(a), q.unwrap_or(b)]);
                if p.is_some() == q.is_some() { product } else { self.neg(product) }
            }
        }
    }

    /// Product with a number.
    pub(crate) fn scale(&mut self, a: Term, factor: f64) -> Term {
        let factor = self.constant(factor);
        self.mul(a, factor)
    }

    /// The product, zero where the first factor is zero whatever the second.
    pub(crate) fn guarded(&mut self, a: Term, b: Term) -> Term {
        if self.number(a).is_some() || self.number(b).is_some() {
            self.mul(a, b)
        } else {
            self.plain(Op::Guarded, &[a, b])
        }
    }

    pub(crate) fn neg(&mut self, a: Term) -> Term {
        match (self.number(a), self.opposite(a)) {
            (Some(c), _) => self.constant(-c),
            (_, Some(a)) => a,
            _ => self.unary(Unary::Neg, a),
        }
    }

    pub(crate) fn recip(&mut self, a: Term) -> Term {
        let one = self.constant(1.0);
        self.plain(Op::Div, &[one, a])
    }

    pub(crate) fn powi(&mut self, a: Term, n: i32) -> Term {
        match n {
            0 => self.constant(1.0),
            1 => a,
            2 => self.plain(Op::Mul, &[a, a]),
            _ => self.plain(Op::Powi(n), &[a]),
        }
    }

    /// The term that a term is the opposite of.
    fn opposite(&self, a: Term) -> Option<Term> {
        let node = self.nodes[a as usize];
        (node.op == Op::Unary(Unary::Neg)).then_some(node.operands[0])
    }

    /// The program that computes some terms.
    pub(crate) fn program(&self, outputs: &[Term]) -> Program {
        lowering::program(self, outputs)
    }
}
