//! Words of a formula, each with its place.

use std::ops::Range;

use crate::error::{ExpressionError, Span};

/// A word of a formula.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Token<'a> {
    Number(f64),
    /// Letters, digits and underscores; names joined by dots are one: `ascent.end.h`.
    Name(&'a str),
    /// The text between brackets.
    Unit(&'a str),
    Plus,
    Minus,
    Times,
    Over,
    Power,
    Open,
    Close,
    Comma,
    Compare(Comparison),
}

/// A relation of two values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Comparison {
    /// `<`
    Less,
    /// `<=`
    AtMost,
    /// `>`
    Greater,
    /// `>=`
    AtLeast,
    /// `==`
    Equal,
}

impl Comparison {
    /// Returns true for `<` and `<=`.
    #[must_use]
    pub fn is_less(self) -> bool {
        matches!(self, Self::Less | Self::AtMost)
    }

    /// The text as written.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Less => "<",
            Self::AtMost => "<=",
            Self::Greater => ">",
            Self::AtLeast => ">=",
            Self::Equal => "==",
        }
    }
}

/// A token with its bytes.
pub(crate) type Word<'a> = (Token<'a>, Range<usize>);

/// The tokens of a text.
pub(crate) fn tokens(text: &str, number: usize) -> Result<Vec<Word<'_>>, ExpressionError> {
    let mut words = Vec::new();
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        if c.is_whitespace() {
            at += c.len_utf8();
            continue;
        }
        let start = at;
        let token = match c {
            '0'..='9' | '.' => {
                at = end_of_number(text, start);
                let written = &text[start..at];
                match written.replace('_', "").parse::<f64>() {
                    Ok(value) if value.is_finite() => Token::Number(value),
                    _ => return Err(unexpected(text, number, start..at, "a finite number")),
                }
            }
            c if c.is_alphabetic() || c == '_' => {
                at = end_of_name(text, start);
                Token::Name(&text[start..at])
            }
            '[' => {
                let Some(length) = text[start..].find(']') else {
                    return Err(unexpected(
                        text,
                        number,
                        start..start + 1,
                        "a unit in brackets, as in `3 [km]`",
                    ));
                };
                at = start + length + 1;
                Token::Unit(&text[start + 1..at - 1])
            }
            _ => {
                let rest = &text[start..];
                let pairs = [
                    ("**", Token::Power),
                    ("<=", Token::Compare(Comparison::AtMost)),
                    (">=", Token::Compare(Comparison::AtLeast)),
                    ("==", Token::Compare(Comparison::Equal)),
                    ("+", Token::Plus),
                    ("-", Token::Minus),
                    ("*", Token::Times),
                    ("/", Token::Over),
                    ("^", Token::Power),
                    ("(", Token::Open),
                    (")", Token::Close),
                    (",", Token::Comma),
                    ("<", Token::Compare(Comparison::Less)),
                    (">", Token::Compare(Comparison::Greater)),
                ];
                let Some((symbol, token)) = pairs.into_iter().find(|(symbol, _)| rest.starts_with(symbol))
                else {
                    let expected = match c {
                        '=' => "`==` for equal",
                        _ => "a number, a name or one of + - * / ^ ( ) , < <= > >= ==",
                    };
                    return Err(unexpected(text, number, start..start + c.len_utf8(), expected));
                };
                at += symbol.len();
                token
            }
        };
        words.push((token, start..at));
    }
    Ok(words)
}

fn unexpected(text: &str, number: usize, bytes: Range<usize>, expected: &'static str) -> ExpressionError {
    let found = format!("`{}`", &text[bytes.clone()]);
    ExpressionError::Syntax { at: Span { text: number, bytes }, expected, found }
}

/// Digits with a point and an exponent.
fn end_of_number(text: &str, start: usize) -> usize {
    let bytes = text.as_bytes();
    let digits = |mut at: usize| {
        while bytes.get(at).is_some_and(|b| b.is_ascii_digit() || *b == b'_') {
            at += 1;
        }
        at
    };
    let mut at = digits(start);
    if bytes.get(at) == Some(&b'.') {
        at = digits(at + 1);
    }
    if matches!(bytes.get(at), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(at + 1), Some(b'+' | b'-')));
        if bytes.get(at + 1 + sign).is_some_and(u8::is_ascii_digit) {
            at = digits(at + 1 + sign);
        }
    }
    at
}

fn end_of_name(text: &str, start: usize) -> usize {
    let mut at = start;
    let mut joined = false;
    for (k, c) in text[start..].char_indices() {
        let inside = c.is_alphanumeric() || c == '_';
        // A dot joins names; one that is followed by nothing is no part of it.
        let dot = c == '.' && !joined;
        if !inside && !dot {
            break;
        }
        joined = dot;
        if inside {
            at = start + k + c.len_utf8();
        }
    }
    at
}

/// Returns true for what names a quantity: a letter or an underscore, then letters, digits and underscores.
#[must_use]
pub fn is_name(text: &str) -> bool {
    let mut letters = text.chars();
    letters.next().is_some_and(|c| c.is_alphabetic() || c == '_')
        && letters.all(|c| c.is_alphanumeric() || c == '_')
}
