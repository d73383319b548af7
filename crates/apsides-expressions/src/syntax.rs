//! Formulas as lists of their parts, operands before what they are operands of: nothing that walks a formula descends into it.
//!
//! The parser is that of V. Pratt, Top down operator precedence, POPL 1973, doi 10.1145/512927.512931.

use std::collections::HashMap;
use std::ops::Range;

use crate::error::{ExpressionError, Span};
use crate::token::{Comparison, Token, Word, tokens};
use crate::unit::Unit;

/// Parentheses, powers and signs in one another.
const DEEPEST: usize = 200;

/// An operation of two operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Operator {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Compare(Comparison),
}

/// A part of a formula. Operands are earlier parts, by their index.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Part {
    Number(f64),
    Quantity(f64, Box<Unit>),
    Name(String),
    Negate(usize),
    Binary(Operator, usize, usize),
    /// A function and its arguments.
    Call(String, Vec<usize>),
}

/// A formula that was parsed; its last part is the whole.
#[derive(Clone, Debug, PartialEq)]
pub struct Expression {
    pub(crate) text: usize,
    pub(crate) parts: Vec<(Part, Range<usize>)>,
}

/// A formula, or several with comparisons between them: `a <= b <= c`.
#[derive(Clone, Debug, PartialEq)]
pub struct Relation {
    /// The formulas that are compared.
    pub sides: Vec<Expression>,
    /// The comparisons between them, one fewer.
    pub comparisons: Vec<Comparison>,
}

impl Expression {
    /// Parses a formula. `number` tells its text from others in messages.
    ///
    /// # Errors
    /// The first mistake, with its place.
    pub fn parse(text: &str, number: usize) -> Result<Self, ExpressionError> {
        let words = tokens(text, number)?;
        Parser::new(text, number, &words).whole()
    }

    /// A number with a unit.
    #[must_use]
    pub fn quantity(value: f64, unit: &Unit, number: usize) -> Self {
        Self { text: number, parts: vec![(Part::Quantity(value, Box::new(unit.clone())), 0..0)] }
    }

    /// The terms of a sum, each with its sign; the formula itself where it is no sum.
    #[must_use]
    pub fn terms(&self) -> Vec<(f64, Self)> {
        let mut terms = Vec::new();
        let mut uses = vec![0_usize; self.parts.len()];
        self.parts.iter().flat_map(|(part, _)| part.operands()).for_each(|k| uses[k] += 1);
        let mut open = vec![(1.0, self.parts.len() - 1)];
        while let Some((sign, part)) = open.pop() {
            match self.parts[part].0 {
                // A sum that is used several times would be taken apart as often, and sums of it again.
                _ if uses[part] > 1 => terms.push((sign, self.part(part))),
                Part::Binary(Operator::Add, a, b) => open.extend([(sign, b), (sign, a)]),
                Part::Binary(Operator::Subtract, a, b) => open.extend([(-sign, b), (sign, a)]),
                Part::Negate(a) => open.push((-sign, a)),
                _ => terms.push((sign, self.part(part))),
            }
        }
        terms
    }

    /// The operands of a product or quotient: `(a, b, true)` for `a * b`, `(a, b, false)` for `a / b`.
    #[must_use]
    pub fn factors(&self) -> Option<(Self, Self, bool)> {
        match self.parts.last()?.0 {
            Part::Binary(Operator::Multiply, a, b) => Some((self.part(a), self.part(b), true)),
            Part::Binary(Operator::Divide, a, b) => Some((self.part(a), self.part(b), false)),
            _ => None,
        }
    }

    /// The name, where the formula is one.
    #[must_use]
    pub fn as_name(&self) -> Option<&str> {
        match self.parts.as_slice() {
            [(Part::Name(name), _)] => Some(name),
            _ => None,
        }
    }

    /// The names in the formula, each with its place.
    pub fn names(&self) -> impl Iterator<Item = (&str, Span)> {
        self.parts.iter().filter_map(|(part, bytes)| match part {
            Part::Name(name) | Part::Call(name, _) => {
                Some((name.as_str(), Span { text: self.text, bytes: bytes.clone() }))
            }
            _ => None,
        })
    }

    /// The place of the whole.
    #[must_use]
    pub fn at(&self) -> Span {
        let bytes = self.parts.iter().map(|(_, bytes)| bytes.clone());
        let all = bytes.reduce(|a, b| a.start.min(b.start)..a.end.max(b.end));
        Span { text: self.text, bytes: all.unwrap_or(0..0) }
    }

    /// A part with all that it is made of, in the order of the whole.
    pub(crate) fn part(&self, root: usize) -> Self {
        let mut kept = vec![root];
        let mut places = HashMap::from([(root, 0)]);
        let mut next = 0;
        while let Some(part) = kept.get(next) {
            for operand in self.parts[*part].0.operands() {
                if places.insert(operand, 0).is_none() {
                    kept.push(operand);
                }
            }
            next += 1;
        }
        kept.sort_unstable();
        places.extend(kept.iter().enumerate().map(|(place, part)| (*part, place)));
        let moved = |part: &usize| {
            let (part, bytes) = &self.parts[*part];
            let part = match part {
                Part::Negate(a) => Part::Negate(places[a]),
                Part::Binary(op, a, b) => Part::Binary(*op, places[a], places[b]),
                Part::Call(name, arguments) => {
                    Part::Call(name.clone(), arguments.iter().map(|a| places[a]).collect())
                }
                leaf => leaf.clone(),
            };
            (part, bytes.clone())
        };
        Self { text: self.text, parts: kept.iter().map(moved).collect() }
    }
}

impl Part {
    pub(crate) fn operands(&self) -> impl Iterator<Item = usize> + '_ {
        let (one, two, many) = match self {
            Self::Negate(a) => (Some(*a), None, &[][..]),
            Self::Binary(_, a, b) => (Some(*a), Some(*b), &[][..]),
            Self::Call(_, arguments) => (None, None, &arguments[..]),
            Self::Number(_) | Self::Quantity(..) | Self::Name(_) => (None, None, &[][..]),
        };
        one.into_iter().chain(two).chain(many.iter().copied())
    }
}

impl Relation {
    /// Parses a formula or a chain of comparisons. `number` tells its text from others in messages.
    ///
    /// # Errors
    /// The first mistake, with its place.
    pub fn parse(text: &str, number: usize) -> Result<Self, ExpressionError> {
        let words = tokens(text, number)?;
        let (mut sides, mut comparisons) = (Vec::new(), Vec::new());
        let (mut start, mut depth) = (0, 0_usize);
        for (k, (token, _)) in words.iter().enumerate() {
            match token {
                Token::Open => depth += 1,
                Token::Close => depth = depth.saturating_sub(1),
                Token::Compare(comparison) if depth == 0 => {
                    sides.push(Parser::new(text, number, &words[start..k]).whole()?);
                    comparisons.push(*comparison);
                    start = k + 1;
                }
                _ => {}
            }
        }
        sides.push(Parser::new(text, number, &words[start..]).whole()?);
        Ok(Self { sides, comparisons })
    }
}

struct Parser<'a> {
    text: &'a str,
    number: usize,
    words: &'a [Word<'a>],
    at: usize,
    depth: usize,
    parts: Vec<(Part, Range<usize>)>,
}

/// Binding powers to the left and to the right.
fn binding(token: &Token<'_>) -> Option<(Operator, u8, u8)> {
    Some(match token {
        Token::Compare(c) => (Operator::Compare(*c), 1, 2),
        Token::Plus => (Operator::Add, 3, 4),
        Token::Minus => (Operator::Subtract, 3, 4),
        Token::Times => (Operator::Multiply, 5, 6),
        Token::Over => (Operator::Divide, 5, 6),
        // To the right, and stronger than a sign before it: -x^2 is -(x^2).
        Token::Power => (Operator::Power, 10, 9),
        _ => return None,
    })
}

/// Binding power of a sign.
const SIGN: u8 = 7;

impl<'a> Parser<'a> {
    fn new(text: &'a str, number: usize, words: &'a [Word<'a>]) -> Self {
        Self { text, number, words, at: 0, depth: 0, parts: Vec::new() }
    }

    fn whole(mut self) -> Result<Expression, ExpressionError> {
        self.expression(0)?;
        if self.at < self.words.len() {
            return Err(self.expected("an operator such as `*` or the end of the formula"));
        }
        Ok(Expression { text: self.number, parts: self.parts })
    }

    fn peek(&self) -> Option<&Token<'a>> {
        self.words.get(self.at).map(|(token, _)| token)
    }

    /// The bytes of the next word, or the end of those before.
    fn here(&self) -> Range<usize> {
        match (self.words.get(self.at), self.words.last()) {
            (Some((_, bytes)), _) => bytes.clone(),
            (None, Some((_, last))) => last.end..last.end,
            (None, None) => 0..self.text.len(),
        }
    }

    fn span(&self, bytes: Range<usize>) -> Span {
        Span { text: self.number, bytes }
    }

    fn expected(&self, expected: &'static str) -> ExpressionError {
        let bytes = self.here();
        let found = match self.words.get(self.at) {
            Some(_) => format!("`{}`", &self.text[bytes.clone()]),
            None if self.words.is_empty() => "nothing".into(),
            None => "the end".into(),
        };
        ExpressionError::Syntax { at: self.span(bytes), expected, found }
    }

    fn push(&mut self, part: Part, bytes: Range<usize>) -> usize {
        self.parts.push((part, bytes));
        self.parts.len() - 1
    }

    fn bytes(&self, part: usize) -> Range<usize> {
        self.parts[part].1.clone()
    }

    fn expression(&mut self, least: u8) -> Result<usize, ExpressionError> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(ExpressionError::Limit {
                at: self.span(self.here()),
                what: "parentheses, signs and powers are nested",
                limit: DEEPEST,
                advice: "state a part as a definition",
            });
        }
        let mut left = self.operand()?;
        while let Some((operator, to_left, to_right)) = self.peek().and_then(binding) {
            if to_left < least {
                break;
            }
            self.at += 1;
            let right = self.expression(to_right)?;
            let bytes = self.bytes(left).start..self.bytes(right).end;
            left = self.push(Part::Binary(operator, left, right), bytes);
        }
        self.depth -= 1;
        Ok(left)
    }

    fn operand(&mut self) -> Result<usize, ExpressionError> {
        let bytes = self.here();
        let token = self.peek().copied();
        match token {
            Some(Token::Number(value)) => {
                self.at += 1;
                let Some(Token::Unit(unit)) = self.peek().copied() else {
                    return Ok(self.push(Part::Number(value), bytes));
                };
                let inner = self.here();
                self.at += 1;
                let unit = Unit::parse(unit).map_err(|e| ExpressionError::Unit {
                    at: self.span(inner.start + 1 + e.offset..inner.end - 1),
                    reason: e.reason,
                })?;
                Ok(self.push(Part::Quantity(value, Box::new(unit)), bytes.start..inner.end))
            }
            Some(Token::Name(name)) => {
                self.at += 1;
                if self.peek() == Some(&Token::Open) {
                    return self.call(name, bytes);
                }
                Ok(self.push(Part::Name(name.to_owned()), bytes))
            }
            Some(Token::Minus) => {
                self.at += 1;
                let operand = self.expression(SIGN)?;
                let end = self.bytes(operand).end;
                Ok(self.push(Part::Negate(operand), bytes.start..end))
            }
            Some(Token::Plus) => {
                self.at += 1;
                self.expression(SIGN)
            }
            Some(Token::Open) => {
                self.at += 1;
                let inner = self.expression(0)?;
                self.close()?;
                // The parentheses belong to the part, so that a caret stands under all of it.
                self.parts[inner].1 = bytes.start..self.words[self.at - 1].1.end;
                Ok(inner)
            }
            _ => Err(self.expected("a number, a name or `(`")),
        }
    }

    fn call(&mut self, name: &str, bytes: Range<usize>) -> Result<usize, ExpressionError> {
        self.at += 1;
        let mut arguments = Vec::new();
        if self.peek() != Some(&Token::Close) {
            loop {
                arguments.push(self.expression(0)?);
                if self.peek() != Some(&Token::Comma) {
                    break;
                }
                self.at += 1;
            }
        }
        self.close()?;
        let end = self.words[self.at - 1].1.end;
        Ok(self.push(Part::Call(name.to_owned(), arguments), bytes.start..end))
    }

    fn close(&mut self) -> Result<(), ExpressionError> {
        if self.peek() != Some(&Token::Close) {
            return Err(self.expected("an operator, `,` or `)`"));
        }
        self.at += 1;
        Ok(())
    }
}
