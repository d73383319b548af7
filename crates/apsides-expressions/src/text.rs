//! Formulas as text again, for files: parts that are used several times, or stand deep in others, get names.

use std::fmt::Write;

use crate::syntax::{Expression, Operator, Part};

/// Parts in one another in the text of one formula.
const DEEPEST: usize = 40;

/// Writes formulas as text, and keeps the definitions that they use.
#[derive(Clone, Debug)]
pub struct TextWriter {
    prefix: String,
    /// Names and formulas of the definitions so far, each after those that it uses.
    pub definitions: Vec<(String, String)>,
}

impl TextWriter {
    /// A writer whose definitions have names that begin with `prefix`.
    #[must_use]
    pub fn new(prefix: &str) -> Self {
        Self { prefix: prefix.to_owned(), definitions: Vec::new() }
    }

    /// The text of a formula. `renamed` gives names of functions and quantities the form that they have in the text.
    pub fn text(&mut self, formula: &Expression, renamed: &dyn Fn(&str) -> String) -> String {
        let mut uses = vec![0_usize; formula.parts.len()];
        formula.parts.iter().flat_map(|(part, _)| part.operands()).for_each(|k| uses[k] += 1);
        // Text, depth, and whether it is a name, a number or a call, which needs no parentheses.
        let mut texts: Vec<(String, usize, bool)> = Vec::with_capacity(formula.parts.len());
        for (k, (part, _)) in formula.parts.iter().enumerate() {
            let of = |a: &usize| {
                let (text, _, closed) = &texts[*a];
                if *closed { text.clone() } else { format!("({text})") }
            };
            let depth = part.operands().map(|a| texts[a].1 + 1).max().unwrap_or(0);
            let (text, closed) = match part {
                Part::Number(number) if *number < 0.0 => (format!("{number:?}"), false),
                Part::Number(number) => (format!("{number:?}"), true),
                Part::Quantity(number, unit) => (format!("{:?}", number * unit.factor), false),
                Part::Name(name) => (renamed(name), true),
                Part::Negate(a) => (format!("-{}", of(a)), false),
                Part::Binary(operator, a, b) => {
                    let symbol = match operator {
                        Operator::Add => "+",
                        Operator::Subtract => "-",
                        Operator::Multiply => "*",
                        Operator::Divide => "/",
                        Operator::Power => "^",
                        Operator::Compare(comparison) => comparison.symbol(),
                    };
                    (format!("{} {symbol} {}", of(a), of(b)), false)
                }
                Part::Call(name, given) => {
                    let mut text = renamed(name);
                    for (place, a) in given.iter().enumerate() {
                        // Writing to a string does not fail.
                        let _ = write!(text, "{}{}", if place == 0 { "(" } else { ", " }, texts[*a].0);
                    }
                    (text + ")", true)
                }
            };
            let is_condition = matches!(part, Part::Binary(Operator::Compare(_), ..));
            let is_inside = k + 1 < formula.parts.len() && depth > 0 && !is_condition;
            texts.push(match is_inside && (uses[k] > 1 || depth > DEEPEST) {
                true => (self.define(text), 0, true),
                false => (text, depth, closed),
            });
        }
        texts.pop().map(|(text, ..)| text).unwrap_or_default()
    }

    /// The name of a definition; equal ones are kept once.
    fn define(&mut self, text: String) -> String {
        if let Some((name, _)) = self.definitions.iter().rev().take(64).find(|(_, known)| *known == text) {
            return name.clone();
        }
        let name = format!("{}{}", self.prefix, self.definitions.len() + 1);
        self.definitions.push((name.clone(), text));
        name
    }
}
