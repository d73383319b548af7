//! Lists of operations that hold none twice.

use std::collections::HashMap;
use std::sync::Arc;

use crate::formula::{Binary, Formula, Operation, Unary};
use crate::table::Table;

/// The operations of a formula as they come.
#[derive(Debug, Default)]
pub(crate) struct Tape {
    inputs: usize,
    operations: Vec<Operation>,
    tables: Vec<Arc<Table>>,
    /// Value of each operation; numbers by their bits.
    known: HashMap<Key, usize>,
    /// Tables by their fingerprints.
    known_tables: HashMap<u64, Vec<usize>>,
}

#[derive(Debug, PartialEq, Eq, Hash)]
enum Key {
    Constant(u64),
    Unary(Unary, usize),
    Binary(Binary, usize, usize),
    Powi(usize, i32),
    Powf(usize, u64),
    Select(usize, usize, usize),
    Curve(usize, usize),
    Surface(usize, usize, usize),
}

impl Tape {
    pub(crate) fn new(inputs: usize) -> Self {
        Self { inputs, ..Self::default() }
    }

    pub(crate) fn inputs(&self) -> usize {
        self.inputs
    }

    /// Number of values so far.
    pub(crate) fn values(&self) -> usize {
        self.inputs + self.operations.len()
    }

    pub(crate) fn tables(&self) -> &[Arc<Table>] {
        &self.tables
    }

    /// The operation that a value comes from; none for an input.
    pub(crate) fn operation(&self, value: usize) -> Option<Operation> {
        self.operations.get(value.checked_sub(self.inputs)?).copied()
    }

    /// The value of an operation, which is that of an equal one before it.
    pub(crate) fn push(&mut self, operation: Operation) -> usize {
        let key = match operation {
            Operation::Constant(c) => Key::Constant(c.to_bits()),
            Operation::Unary(op, a) => Key::Unary(op, a),
            Operation::Binary(op, a, b) => Key::Binary(op, a, b),
            Operation::Powi(a, n) => Key::Powi(a, n),
            Operation::Powf(a, n) => Key::Powf(a, n.to_bits()),
            Operation::Select(c, a, b) => Key::Select(c, a, b),
            Operation::Curve(t, a) => Key::Curve(t, a),
            Operation::Surface(t, a, b) => Key::Surface(t, a, b),
        };
        let next = self.inputs + self.operations.len();
        let value = *self.known.entry(key).or_insert(next);
        if value == next {
            self.operations.push(operation);
        }
        value
    }

    /// The index of a table, which is that of an equal one before it.
    pub(crate) fn table(&mut self, table: Arc<Table>) -> usize {
        let known = self.known_tables.entry(table.fingerprint()).or_default();
        match known.iter().find(|&&k| self.tables[k] == table) {
            Some(&k) => k,
            None => {
                known.push(self.tables.len());
                self.tables.push(table);
                self.tables.len() - 1
            }
        }
    }

    pub(crate) fn formula(&self, outputs: &[usize]) -> Formula {
        Formula::pruned(self.inputs, &self.operations, &self.tables, outputs)
    }
}
