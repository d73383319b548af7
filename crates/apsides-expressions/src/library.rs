//! Definitions and tables, which formulas refer to besides the quantities at hand.

use crate::dimension::Dimension;
use crate::error::{ExpressionError, Span};
use crate::syntax::Expression;
use crate::token::is_name;

/// A named formula, with arguments or without.
#[derive(Clone, Debug, PartialEq)]
pub struct Definition {
    /// Its name.
    pub name: String,
    /// Names of its arguments; none of a quantity.
    pub arguments: Vec<String>,
    /// The formula that it stands for.
    pub body: Expression,
    /// The dimension that it must have, where one is stated.
    pub dimension: Option<Dimension>,
}

/// A table of one or two variables.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Its name.
    pub name: String,
    /// Dimensions of its variables, one or two.
    pub variables: Vec<Dimension>,
    /// Dimension of its values.
    pub dimension: Dimension,
}

/// Definitions and tables, which formulas refer to by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Library {
    /// Definitions in any order.
    pub definitions: Vec<Definition>,
    /// Tables; a recorder knows them by their index.
    pub tables: Vec<Table>,
}

/// The name and the arguments of `density(h)`; no arguments of `density`.
///
/// # Errors
/// A text that is no name, or arguments that are none; `number` tells the text from others.
pub fn heading(text: &str, number: usize) -> Result<(String, Vec<String>), ExpressionError> {
    let fail = |bytes: std::ops::Range<usize>, expected| ExpressionError::Syntax {
        at: Span { text: number, bytes: bytes.clone() },
        expected,
        found: format!("`{}`", &text[bytes]),
    };
    let (name, arguments) = match text.split_once('(') {
        None => (text.trim(), Vec::new()),
        Some((name, rest)) => {
            let Some(inside) = rest.trim_end().strip_suffix(')') else {
                return Err(fail(0..text.len(), "`)` at the end of the arguments, as in `density(h)`"));
            };
            (name.trim(), inside.split(',').map(|a| a.trim().to_owned()).collect())
        }
    };
    const NAME: &str = "a name of letters, digits and underscores that begins with a letter";
    if !is_name(name) || arguments.iter().any(|a: &String| !is_name(a)) {
        return Err(fail(0..text.len(), NAME));
    }
    if (1..arguments.len()).any(|k| arguments[..k].contains(&arguments[k])) {
        return Err(fail(0..text.len(), "arguments with different names"));
    }
    Ok((name.to_owned(), arguments))
}
