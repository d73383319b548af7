//! Formulas made into operations: names resolved, definitions put in their places, dimensions checked, numbers computed.

use std::collections::HashMap;

use crate::dimension::Dimension;
use crate::error::{ExpressionError, Span};
use crate::function::{Binary, CONSTANTS, Known, Rule, Unary, constant_names, function_names, known};
use crate::library::Library;
use crate::quantity::{Quantity, Value};
use crate::recorder::Recorder;
use crate::suggestion::suggested_name;
use crate::syntax::{Expression, Operator, Part};
use crate::token::Comparison;

/// Parts of all formulas that are walked: a definition that uses another twice, which uses another twice, doubles with each.
const MOST_PARTS: usize = 2_000_000;

const NO_VALUE: &str =
    "a comparison has no value: it stands in `if(a < b, then, otherwise)`, or alone as a constraint";

/// Definitions in definitions.
const DEEPEST: usize = 100;

/// A part of a formula that was walked.
#[derive(Clone, Copy)]
enum Item<V> {
    Quantity(Quantity<V>),
    Condition(Comparison, Quantity<V>, Quantity<V>),
}

/// A definition and the arguments that it was given, as far as they can be compared.
type Use<V> = (usize, Vec<(Option<V>, u64, [u64; 6], bool)>);

/// Makes operations of formulas, for one recorder and one set of quantities.
pub struct Compiler<'a, R: Recorder> {
    recorder: R,
    library: &'a Library,
    quantities: HashMap<String, Quantity<R::Value>>,
    refused: HashMap<String, String>,
    checks_units: bool,
    made: HashMap<Use<R::Value>, Quantity<R::Value>>,
    open: Vec<usize>,
    parts: usize,
}

impl<'a, R: Recorder> Compiler<'a, R> {
    /// A compiler that knows the definitions and tables of a library. Units are checked only where `checks_units` is true.
    #[must_use]
    pub fn new(recorder: R, library: &'a Library, checks_units: bool) -> Self {
        Self {
            recorder,
            library,
            quantities: HashMap::new(),
            refused: HashMap::new(),
            checks_units,
            made: HashMap::new(),
            open: Vec::new(),
            parts: 0,
        }
    }

    /// Gives a quantity a name. It hides a number that every formula knows.
    pub fn name(&mut self, name: &str, quantity: Quantity<R::Value>) {
        self.quantities.insert(name.to_owned(), quantity);
    }

    /// Gives a name that has no value here the sentence that refuses it.
    pub fn refuse(&mut self, name: &str, reason: &str) {
        self.refused.insert(name.to_owned(), reason.to_owned());
    }

    /// Makes operations of a formula. Where `wanted` is a dimension, the formula must have it; `role` says in the message what it is.
    ///
    /// # Errors
    /// The first mistake, with its place.
    pub fn compile(
        &mut self,
        formula: &Expression,
        wanted: Option<Dimension>,
        role: &str,
    ) -> Result<Quantity<R::Value>, ExpressionError> {
        let found = self.evaluate(formula, &[])?;
        if let Some(wanted) = wanted.filter(|w| self.differ(&found, *w)) {
            let reason = format!("{role} has the unit {}, this is {}", named(wanted), named(found.dimension));
            return Err(ExpressionError::Dimension { at: formula.at(), reason });
        }
        Ok(found)
    }

    /// The difference of two quantities that a comparison joins.
    ///
    /// # Errors
    /// Units that differ; `at` is the place of the comparison.
    pub fn difference(
        &mut self,
        left: Quantity<R::Value>,
        comparison: Comparison,
        right: Quantity<R::Value>,
        at: &Span,
    ) -> Result<Quantity<R::Value>, ExpressionError> {
        self.same(&[left, right], comparison.symbol(), &|| at.clone())?;
        self.operate(Operator::Subtract, left, right, &|| at.clone())
    }

    /// The number of a formula of numbers alone.
    ///
    /// # Errors
    /// The first mistake, with its place; one that depends on more than constants is refused by `reason`.
    pub fn number(
        &mut self,
        formula: &Expression,
        wanted: Option<Dimension>,
        role: &str,
        reason: &str,
    ) -> Result<f64, ExpressionError> {
        let found = self.compile(formula, wanted, role)?;
        found.number().ok_or_else(|| ExpressionError::Misplaced { at: formula.at(), reason: reason.into() })
    }

    /// The value of a quantity for the recorder.
    pub fn recorded(&mut self, quantity: Quantity<R::Value>) -> R::Value {
        match quantity.value {
            Value::Number(number) => self.recorder.constant(number),
            Value::Recorded(value) => value,
        }
    }

    /// The recorder.
    pub fn recorder(&mut self) -> &mut R {
        &mut self.recorder
    }

    /// Gives the recorder back.
    #[must_use]
    pub fn finish(self) -> R {
        self.recorder
    }

    fn differ(&self, quantity: &Quantity<R::Value>, dimension: Dimension) -> bool {
        self.checks_units && !quantity.zero && quantity.dimension != dimension
    }

    fn evaluate(
        &mut self,
        formula: &Expression,
        arguments: &[(&str, Quantity<R::Value>)],
    ) -> Result<Quantity<R::Value>, ExpressionError> {
        let mut items: Vec<Item<R::Value>> = Vec::with_capacity(formula.parts.len());
        for (part, bytes) in &formula.parts {
            let at = || Span { text: formula.text, bytes: bytes.clone() };
            self.parts += 1;
            if self.parts > MOST_PARTS {
                return Err(ExpressionError::Limit {
                    at: at(),
                    what: "all formulas together, definitions put in their places, have",
                    limit: MOST_PARTS,
                    advice: "operations are too many for a problem; use tables for what is known",
                });
            }
            let of = |k: usize| match items[k] {
                Item::Quantity(q) => Ok(q),
                Item::Condition(..) => Err(ExpressionError::Misplaced {
                    at: Span { text: formula.text, bytes: formula.parts[k].1.clone() },
                    reason: NO_VALUE.into(),
                }),
            };
            let item = match part {
                Part::Number(number) => Item::Quantity(Quantity {
                    zero: *number == 0.0,
                    ..Quantity::new(Value::Number(*number), Dimension::NONE)
                }),
                Part::Quantity(number, unit) => {
                    Item::Quantity(Quantity::new(Value::Number(number * unit.factor), unit.dimension))
                }
                Part::Name(name) => Item::Quantity(self.named(name, arguments, &at)?),
                Part::Negate(a) => {
                    let a = of(*a)?;
                    let negated = self.unary(Unary::Negate, a, a.dimension, &at)?;
                    Item::Quantity(Quantity { zero: a.zero, ..negated })
                }
                Part::Binary(Operator::Compare(comparison), a, b) => {
                    let (a, b) = (of(*a)?, of(*b)?);
                    self.same(&[a, b], comparison.symbol(), &at)?;
                    Item::Condition(*comparison, a, b)
                }
                Part::Binary(operator, a, b) => {
                    Item::Quantity(self.operate(*operator, of(*a)?, of(*b)?, &at)?)
                }
                Part::Call(name, given) if known(name) == Some(Known::If) => {
                    count(name, 3, given.len(), &at)?;
                    let Item::Condition(comparison, a, b) = items[given[0]] else {
                        let reason =
                            "the first argument of `if` is a comparison, as in `if(a < b, then, otherwise)`"
                                .into();
                        return Err(ExpressionError::Misplaced { at: at(), reason });
                    };
                    Item::Quantity(self.choose(comparison, [a, b, of(given[1])?, of(given[2])?], &at)?)
                }
                Part::Call(name, given) => {
                    let given = given.iter().map(|&k| of(k)).collect::<Result<Vec<_>, _>>()?;
                    Item::Quantity(self.call(name, &given, &at)?)
                }
            };
            items.push(item);
        }
        match items.last() {
            Some(Item::Quantity(whole)) => Ok(*whole),
            _ => Err(ExpressionError::Misplaced { at: formula.at(), reason: NO_VALUE.into() }),
        }
    }

    /// The quantity of a name: an argument, a quantity at hand, a definition, a constant.
    fn named(
        &mut self,
        name: &str,
        arguments: &[(&str, Quantity<R::Value>)],
        at: &dyn Fn() -> Span,
    ) -> Result<Quantity<R::Value>, ExpressionError> {
        if let Some((_, argument)) = arguments.iter().find(|(n, _)| *n == name) {
            return Ok(*argument);
        }
        if let Some(quantity) = self.quantities.get(name) {
            return Ok(*quantity);
        }
        if let Some(reason) = self.refused.get(name) {
            return Err(ExpressionError::Misplaced { at: at(), reason: reason.clone() });
        }
        if let Some(index) = self.library.definitions.iter().position(|d| d.name == name) {
            return self.define(index, &[], at);
        }
        if let Some((_, number, dimension)) = CONSTANTS.iter().find(|(n, ..)| *n == name) {
            return Ok(Quantity::new(Value::Number(*number), *dimension));
        }
        let called = if self.library.tables.iter().any(|t| t.name == name) || known(name).is_some() {
            Some(format!("`{name}` is a function: give it arguments, as in `{name}(x)`"))
        } else {
            None
        };
        Err(match called {
            Some(reason) => ExpressionError::Misplaced { at: at(), reason },
            None => {
                let mut names: Vec<&str> = arguments.iter().map(|(n, _)| *n).collect();
                names.extend(self.quantities.keys().map(String::as_str));
                names.extend(
                    self.library
                        .definitions
                        .iter()
                        .filter(|d| d.arguments.is_empty())
                        .map(|d| d.name.as_str()),
                );
                constant_names().for_each(|n| names.push(n));
                names.sort_unstable();
                names.dedup();
                ExpressionError::UnknownName {
                    at: at(),
                    what: "quantity",
                    name: name.into(),
                    suggestion: suggested_name(name, "known here", &names),
                }
            }
        })
    }

    /// The value of a definition at arguments.
    fn define(
        &mut self,
        index: usize,
        given: &[Quantity<R::Value>],
        at: &dyn Fn() -> Span,
    ) -> Result<Quantity<R::Value>, ExpressionError> {
        let library = self.library;
        let definition = &library.definitions[index];
        count(&definition.name, definition.arguments.len(), given.len(), at)?;
        let key = |q: &Quantity<R::Value>| match q.value {
            Value::Number(number) => (None, number.to_bits(), q.dimension.bits(), q.zero),
            Value::Recorded(value) => (Some(value), 0, q.dimension.bits(), q.zero),
        };
        let key = (index, given.iter().map(key).collect());
        if let Some(made) = self.made.get(&key) {
            return Ok(*made);
        }
        if let Some(first) = self.open.iter().position(|&k| k == index) {
            let round = self.open[first..].iter().chain([&index]);
            let path =
                round.map(|&k| format!("`{}`", library.definitions[k].name)).collect::<Vec<_>>().join(" -> ");
            return Err(ExpressionError::Circle { at: at(), name: definition.name.clone(), path });
        }
        if self.open.len() >= DEEPEST {
            return Err(ExpressionError::Limit {
                at: at(),
                what: "definitions use each other in chains of",
                limit: DEEPEST,
                advice: "join some of them",
            });
        }
        let arguments: Vec<_> =
            definition.arguments.iter().map(String::as_str).zip(given.iter().copied()).collect();
        self.open.push(index);
        let value = self.evaluate(&definition.body, &arguments)?;
        self.open.pop();
        if let Some(wanted) = definition.dimension.filter(|w| self.differ(&value, *w)) {
            let reason = format!(
                "the definition `{}` has the unit {}, this is {}",
                definition.name,
                named(wanted),
                named(value.dimension)
            );
            return Err(ExpressionError::Dimension { at: definition.body.at(), reason });
        }
        self.made.insert(key, value);
        Ok(value)
    }

    /// A call of a function that every formula knows, of a definition or of a table.
    fn call(
        &mut self,
        name: &str,
        given: &[Quantity<R::Value>],
        at: &dyn Fn() -> Span,
    ) -> Result<Quantity<R::Value>, ExpressionError> {
        let library = self.library;
        if let Some(index) = library.definitions.iter().position(|d| d.name == name) {
            if library.definitions[index].arguments.is_empty() {
                let reason =
                    format!("`{name}` is a quantity, no function: write `{name} * (..)` for a product");
                return Err(ExpressionError::Misplaced { at: at(), reason });
            }
            return self.define(index, given, at);
        }
        if let Some(index) = library.tables.iter().position(|t| t.name == name) {
            return self.look_up(index, given, at);
        }
        if self.quantities.contains_key(name) {
            let reason = format!("`{name}` is a quantity, no function: write `{name} * (..)` for a product");
            return Err(ExpressionError::Misplaced { at: at(), reason });
        }
        let Some(function) = known(name) else {
            let mut names: Vec<&str> = function_names().collect();
            names.extend(
                library.definitions.iter().filter(|d| !d.arguments.is_empty()).map(|d| d.name.as_str()),
            );
            names.extend(library.tables.iter().map(|t| t.name.as_str()));
            return Err(ExpressionError::UnknownName {
                at: at(),
                what: "function",
                name: name.into(),
                suggestion: suggested_name(name, "functions", &names),
            });
        };
        self.built_in(name, function, given, at)
    }

    fn built_in(
        &mut self,
        name: &str,
        function: Known,
        given: &[Quantity<R::Value>],
        at: &dyn Fn() -> Span,
    ) -> Result<Quantity<R::Value>, ExpressionError> {
        let most = usize::MAX;
        let (least, most) = match function {
            Known::Unary(..) | Known::Log10 => (1, 1),
            Known::Atan2 | Known::Power => (2, 2),
            Known::Hypot | Known::Extreme(_) => (2, most),
            Known::If | Known::Clamp => (3, 3),
        };
        if given.len() < least || given.len() > most {
            count(name, least, given.len(), at)?;
        }
        match function {
            Known::Unary(f, rule) => {
                let x = given[0];
                let dimension = match (f, rule) {
                    (Unary::Sqrt, _) => x.dimension.power(0.5),
                    (Unary::Cbrt, _) => x.dimension.power(1.0 / 3.0),
                    (_, Rule::Keeps) => x.dimension,
                    (_, Rule::Number | Rule::Any) => Dimension::NONE,
                };
                if rule == Rule::Number {
                    self.pure(&x, name, at)?;
                }
                self.unary(f, x, dimension, at)
            }
            Known::Log10 => {
                self.pure(&given[0], name, at)?;
                let log = self.unary(Unary::Ln, given[0], Dimension::NONE, at)?;
                let tenth = Quantity::new(Value::Number(std::f64::consts::LOG10_E), Dimension::NONE);
                self.binary(Binary::Multiply, log, tenth, Dimension::NONE, at)
            }
            Known::Atan2 => {
                self.same(given, name, at)?;
                self.binary(Binary::Atan2, given[0], given[1], Dimension::NONE, at)
            }
            Known::Power => self.operate(Operator::Power, given[0], given[1], at),
            Known::Hypot => {
                let dimension = self.same(given, name, at)?;
                let two = Quantity::new(Value::Number(2.0), Dimension::NONE);
                let mut sum = self.operate(Operator::Power, given[0], two, at)?;
                for x in &given[1..] {
                    let square = self.operate(Operator::Power, *x, two, at)?;
                    sum = self.binary(Binary::Add, sum, square, dimension.power(2.0), at)?;
                }
                self.unary(Unary::Sqrt, sum, dimension, at)
            }
            Known::Extreme(f) => {
                let dimension = self.same(given, name, at)?;
                given[1..].iter().try_fold(given[0], |a, b| self.binary(f, a, *b, dimension, at))
            }
            Known::Clamp => {
                let dimension = self.same(given, name, at)?;
                let raised = self.binary(Binary::Max, given[0], given[1], dimension, at)?;
                self.binary(Binary::Min, raised, given[2], dimension, at)
            }
            Known::If => count(name, 3, given.len(), at).and_then(|()| {
                let reason = "the first argument of `if` is a comparison".into();
                Err(ExpressionError::Misplaced { at: at(), reason })
            }),
        }
    }

    fn look_up(
        &mut self,
        index: usize,
        given: &[Quantity<R::Value>],
        at: &dyn Fn() -> Span,
    ) -> Result<Quantity<R::Value>, ExpressionError> {
        let table = &self.library.tables[index];
        count(&table.name, table.variables.len(), given.len(), at)?;
        for (k, (x, wanted)) in given.iter().zip(&table.variables).enumerate() {
            if self.differ(x, *wanted) {
                let (wanted, found) = (named(*wanted), named(x.dimension));
                let reason = format!(
                    "variable {} of the table `{}` has the unit {wanted}, this is {found}",
                    k + 1,
                    table.name
                );
                return Err(ExpressionError::Dimension { at: at(), reason });
            }
        }
        let at: Vec<_> = given.iter().map(|q| self.recorded(*q)).collect();
        Ok(Quantity::new(Value::Recorded(self.recorder.table(index, &at)), table.dimension))
    }

    fn operate(
        &mut self,
        operator: Operator,
        a: Quantity<R::Value>,
        b: Quantity<R::Value>,
        at: &dyn Fn() -> Span,
    ) -> Result<Quantity<R::Value>, ExpressionError> {
        match operator {
            Operator::Add | Operator::Subtract => {
                let (f, symbol) =
                    if operator == Operator::Add { (Binary::Add, "+") } else { (Binary::Subtract, "-") };
                let dimension = self.same(&[a, b], symbol, at)?;
                let sum = self.binary(f, a, b, dimension, at)?;
                Ok(Quantity { zero: a.zero && b.zero, ..sum })
            }
            Operator::Multiply => {
                let product = self.binary(Binary::Multiply, a, b, a.dimension * b.dimension, at)?;
                Ok(Quantity { zero: a.zero || b.zero, ..product })
            }
            Operator::Divide => {
                if a.number().is_none() && b.number() == Some(0.0) {
                    let what = "a division by 0".to_owned();
                    return Err(ExpressionError::NotFinite { at: at(), what, value: f64::INFINITY });
                }
                let quotient = self.binary(Binary::Divide, a, b, a.dimension / b.dimension, at)?;
                Ok(Quantity { zero: a.zero, ..quotient })
            }
            Operator::Power => {
                self.pure(&b, "an exponent", at)?;
                let Some(exponent) = b.number() else {
                    self.pure(&a, "what is raised to a power that is not constant", at)?;
                    return self.binary(Binary::Power, a, b, Dimension::NONE, at);
                };
                let dimension = a.dimension.power(exponent);
                match a.value {
                    Value::Number(x) => {
                        finite(Binary::Power.at(x, exponent), dimension, at, || format!("{x}^{exponent}"))
                    }
                    Value::Recorded(x) => {
                        Ok(Quantity::new(Value::Recorded(self.recorder.power(x, exponent)), dimension))
                    }
                }
            }
            Operator::Compare(_) => Ok(a),
        }
    }

    /// `then` where the first two compare so, else the last.
    fn choose(
        &mut self,
        comparison: Comparison,
        [a, b, then, otherwise]: [Quantity<R::Value>; 4],
        at: &dyn Fn() -> Span,
    ) -> Result<Quantity<R::Value>, ExpressionError> {
        let dimension = self.same(&[then, otherwise], "if", at)?;
        let holds = |a: f64, b: f64| match comparison {
            Comparison::Less => Some(a < b),
            Comparison::AtMost => Some(a <= b),
            Comparison::Greater => Some(a > b),
            Comparison::AtLeast => Some(a >= b),
            Comparison::Equal => None,
        };
        if comparison == Comparison::Equal {
            let reason = "`==` in `if` holds at single points alone: use <, <=, > or >=".into();
            return Err(ExpressionError::Misplaced { at: at(), reason });
        }
        if let (Some(a), Some(b)) = (a.number(), b.number()) {
            let chosen = if holds(a, b) == Some(true) { then } else { otherwise };
            return Ok(Quantity { dimension, ..chosen });
        }
        let [a, b, then, otherwise] = [a, b, then, otherwise].map(|q| self.recorded(q));
        let value = self.recorder.select(comparison, a, b, then, otherwise);
        Ok(Quantity::new(Value::Recorded(value), dimension))
    }

    fn unary(
        &mut self,
        f: Unary,
        x: Quantity<R::Value>,
        dimension: Dimension,
        at: &dyn Fn() -> Span,
    ) -> Result<Quantity<R::Value>, ExpressionError> {
        match x.value {
            Value::Number(x) => finite(f.at(x), dimension, at, || format!("{f:?} of {x}").to_lowercase()),
            Value::Recorded(x) => Ok(Quantity::new(Value::Recorded(self.recorder.unary(f, x)), dimension)),
        }
    }

    fn binary(
        &mut self,
        f: Binary,
        a: Quantity<R::Value>,
        b: Quantity<R::Value>,
        dimension: Dimension,
        at: &dyn Fn() -> Span,
    ) -> Result<Quantity<R::Value>, ExpressionError> {
        if let (Some(x), Some(y)) = (a.number(), b.number()) {
            return finite(f.at(x, y), dimension, at, || format!("{f:?} of {x} and {y}").to_lowercase());
        }
        let (a, b) = (self.recorded(a), self.recorded(b));
        Ok(Quantity::new(Value::Recorded(self.recorder.binary(f, a, b)), dimension))
    }

    /// The dimension that all share.
    fn same(
        &self,
        given: &[Quantity<R::Value>],
        operation: &str,
        at: &dyn Fn() -> Span,
    ) -> Result<Dimension, ExpressionError> {
        let first = given.iter().find(|q| !q.zero).or(given.first());
        let Some(first) = first else { return Ok(Dimension::NONE) };
        if let Some(other) = given.iter().find(|q| self.differ(q, first.dimension)) {
            let (a, b) = (named(first.dimension), named(other.dimension));
            let reason = format!("`{operation}` takes quantities of one unit, these are {a} and {b}");
            return Err(ExpressionError::Dimension { at: at(), reason });
        }
        Ok(first.dimension)
    }

    fn pure(&self, x: &Quantity<R::Value>, role: &str, at: &dyn Fn() -> Span) -> Result<(), ExpressionError> {
        if self.differ(x, Dimension::NONE) {
            let role =
                if known(role).is_some() { format!("the argument of `{role}`") } else { role.to_owned() };
            let reason = format!("{role} is a number or an angle, this is {}", named(x.dimension));
            return Err(ExpressionError::Dimension { at: at(), reason });
        }
        Ok(())
    }
}

/// A dimension in a sentence.
fn named(dimension: Dimension) -> String {
    if dimension.is_none() { "1 (no unit)".into() } else { dimension.to_string() }
}

fn count(name: &str, expected: usize, found: usize, at: &dyn Fn() -> Span) -> Result<(), ExpressionError> {
    if expected == found {
        return Ok(());
    }
    Err(ExpressionError::Arguments { at: at(), function: name.into(), expected, found })
}

fn finite<V>(
    value: f64,
    dimension: Dimension,
    at: &dyn Fn() -> Span,
    what: impl Fn() -> String,
) -> Result<Quantity<V>, ExpressionError> {
    if value.is_finite() {
        return Ok(Quantity::new(Value::Number(value), dimension));
    }
    Err(ExpressionError::NotFinite { at: at(), what: what(), value })
}
