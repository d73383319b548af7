//! Values of TOML with their places: tables with known keys, texts of formulas, numbers, units.

use std::ops::Range;

use apsides_expressions::suggestion::suggested_name;
use apsides_expressions::{Expression, ExpressionError, Relation, Span, Unit, is_name};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::error::ProblemError;
use crate::model::{Amount, End, Stated};
use crate::place::Source;

/// Reads a file that is given by its path.
pub(crate) type Files<'f> = dyn Fn(&str) -> std::io::Result<String> + 'f;

/// A value in the file.
pub(crate) type Node<'a> = Spanned<DeValue<'a>>;

/// The texts of formulas, by number: where the characters of each stand in the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Texts(Vec<Text>);

#[derive(Clone, Debug, PartialEq)]
struct Text {
    /// The bytes of the whole value.
    at: Range<usize>,
    /// The first byte of the text; none where characters are escaped, so that bytes do not correspond.
    first: Option<usize>,
}

impl Texts {
    /// The bytes of a part of a formula in the file.
    pub(crate) fn bytes(&self, span: &Span) -> Range<usize> {
        match self.0.get(span.text) {
            Some(Text { first: Some(first), .. }) => first + span.bytes.start..first + span.bytes.end,
            Some(Text { at, first: None }) => at.clone(),
            // A formula that a program states has the number of its place.
            None => span.text..span.text,
        }
    }

    fn add(&mut self, text: &str, raw: &str, at: Range<usize>) -> usize {
        // Quotes, and the line break that may follow three of them.
        let first = raw.find(text).filter(|_| !raw.contains('\\')).map(|k| at.start + k);
        self.0.push(Text { at, first });
        self.0.len() - 1
    }
}

/// The value of a key, with the name of the key and the bytes of that.
pub(crate) struct Field<'t, 'a> {
    pub(crate) name: &'t str,
    pub(crate) at: Range<usize>,
    pub(crate) value: &'t Node<'a>,
}

/// The fields of a table in the order of the file.
pub(crate) fn fields<'t, 'a>(table: &'t DeTable<'a>) -> Vec<Field<'t, 'a>> {
    let field = |(key, value): (&'t Spanned<std::borrow::Cow<'a, str>>, &'t Node<'a>)| Field {
        name: key.get_ref(),
        at: key.span(),
        value,
    };
    let mut fields: Vec<_> = table.iter().map(field).collect();
    fields.sort_by_key(|f| f.at.start);
    fields
}

/// Reads values, and keeps the texts of formulas.
pub(crate) struct Reader<'s> {
    pub(crate) source: &'s Source,
    pub(crate) texts: Texts,
    pub(crate) has_units: bool,
}

impl Reader<'_> {
    pub(crate) fn refused(
        &self,
        at: &Range<usize>,
        what: &str,
        found: String,
        allowed: &str,
    ) -> ProblemError {
        ProblemError::Value { at: self.source.place(at), what: what.into(), found, allowed: allowed.into() }
    }

    pub(crate) fn conflict(&self, at: &Range<usize>, reason: impl Into<String>) -> ProblemError {
        ProblemError::Conflict { at: self.source.place(at), reason: reason.into() }
    }

    pub(crate) fn unknown(&self, field: &Field<'_, '_>, owner: &str, keys: &[&str]) -> ProblemError {
        ProblemError::UnknownKey {
            at: self.source.place(&field.at),
            owner: owner.into(),
            key: field.name.into(),
            suggestion: suggested_name(field.name, "keys", keys),
        }
    }

    fn formula_error(&self, source: ExpressionError) -> ProblemError {
        let at = self.source.place(&self.texts.bytes(source.at()));
        ProblemError::Formula { at, source }
    }

    /// The fields of a table.
    pub(crate) fn table<'t, 'a>(
        &self,
        value: &'t Node<'a>,
        what: &str,
    ) -> Result<Vec<Field<'t, 'a>>, ProblemError> {
        match value.get_ref() {
            DeValue::Table(table) => Ok(fields(table)),
            other => Err(self.refused(&value.span(), what, described(other), "a table")),
        }
    }

    /// The fields of a table that has no others than these.
    pub(crate) fn table_of<'t, 'a>(
        &self,
        value: &'t Node<'a>,
        what: &str,
        keys: &[&str],
    ) -> Result<Vec<Field<'t, 'a>>, ProblemError> {
        let fields = self.table(value, what)?;
        match fields.iter().find(|f| !keys.contains(&f.name)) {
            Some(field) => Err(self.unknown(field, what, keys)),
            None => Ok(fields),
        }
    }

    pub(crate) fn list<'t, 'a>(
        &self,
        value: &'t Node<'a>,
        what: &str,
    ) -> Result<Vec<&'t Node<'a>>, ProblemError> {
        match value.get_ref() {
            DeValue::Array(items) => Ok(items.iter().collect()),
            other => Err(self.refused(&value.span(), what, described(other), "a list in brackets")),
        }
    }

    pub(crate) fn string<'t>(&self, value: &'t Node<'_>, what: &str) -> Result<&'t str, ProblemError> {
        match value.get_ref() {
            DeValue::String(text) => Ok(text),
            other => Err(self.refused(&value.span(), what, described(other), "text in quotes")),
        }
    }

    /// A number; it may be infinite.
    pub(crate) fn number(&self, value: &Node<'_>, what: &str) -> Result<f64, ProblemError> {
        let written = match value.get_ref() {
            DeValue::Float(f) => f.as_str(),
            DeValue::Integer(i) if i.radix() == 10 => i.as_str(),
            other => return Err(self.refused(&value.span(), what, described(other), "a number")),
        };
        match written.replace('_', "").parse::<f64>() {
            Ok(v) if !v.is_nan() && (v.is_finite() || written.contains("inf")) => Ok(v),
            _ => Err(self.refused(&value.span(), what, written.into(), "a number")),
        }
    }

    /// A finite number.
    pub(crate) fn finite(&self, value: &Node<'_>, what: &str) -> Result<f64, ProblemError> {
        let number = self.number(value, what)?;
        if number.is_finite() {
            return Ok(number);
        }
        Err(self.refused(&value.span(), what, number.to_string(), "a finite number"))
    }

    /// A name of letters, digits and underscores.
    pub(crate) fn name(&self, field: &Field<'_, '_>, what: &str) -> Result<String, ProblemError> {
        if is_name(field.name) {
            return Ok(field.name.into());
        }
        let allowed = "letters, digits and underscores that begin with a letter";
        Err(self.refused(&field.at, what, format!("`{}`", field.name), allowed))
    }

    pub(crate) fn unit(&mut self, value: &Node<'_>, what: &str) -> Result<Unit, ProblemError> {
        let text = self.string(value, what)?;
        self.has_units = true;
        let number = self.texts.add(text, &self.source.text()[value.span()], value.span());
        Unit::parse(text).map_err(|e| {
            let bytes = self.texts.bytes(&Span { text: number, bytes: e.offset..text.len() });
            self.refused(&bytes, what, format!("\"{text}\""), &format!("a unit such as m/s2: {}", e.reason))
        })
    }

    pub(crate) fn formula(&mut self, value: &Node<'_>, what: &str) -> Result<Expression, ProblemError> {
        let (text, number) = self.text(value, what)?;
        Expression::parse(&text, number).map_err(|e| self.formula_error(e))
    }

    pub(crate) fn relation(&mut self, value: &Node<'_>, what: &str) -> Result<Relation, ProblemError> {
        let (text, number) = self.text(value, what)?;
        Relation::parse(&text, number).map_err(|e| self.formula_error(e))
    }

    /// The text of a formula, which may be a number, and the number of the text.
    fn text(&mut self, value: &Node<'_>, what: &str) -> Result<(String, usize), ProblemError> {
        let raw = &self.source.text()[value.span()];
        let text = match value.get_ref() {
            DeValue::String(text) => text.to_string(),
            DeValue::Float(_) | DeValue::Integer(_) => format!("{}", self.finite(value, what)?),
            other => return Err(self.refused(&value.span(), what, described(other), "a formula in quotes")),
        };
        // A unit in brackets is declared, too.
        self.has_units |= text.contains('[');
        let number = self.texts.add(&text, raw, value.span());
        Ok((text, number))
    }

    /// The number of the key of a definition, for messages.
    pub(crate) fn key_text(&mut self, field: &Field<'_, '_>) -> usize {
        self.texts.add(field.name, &self.source.text()[field.at.clone()], field.at.clone())
    }

    pub(crate) fn heading(&mut self, field: &Field<'_, '_>) -> Result<(String, Vec<String>), ProblemError> {
        let number = self.key_text(field);
        apsides_expressions::heading(field.name, number).map_err(|e| self.formula_error(e))
    }

    /// A number in the unit of its quantity, `"3 km"`, or a formula of constants.
    pub(crate) fn stated(&mut self, value: &Node<'_>, what: &str) -> Result<Stated, ProblemError> {
        let amount = match value.get_ref() {
            DeValue::String(text) => match quantity(text) {
                Some((number, unit)) => {
                    self.has_units = true;
                    let at = self.texts.add(text, &self.source.text()[value.span()], value.span());
                    Amount::Formula(Expression::quantity(number, &unit, at))
                }
                None => Amount::Formula(self.formula(value, what)?),
            },
            _ => Amount::Number(self.number(value, what)?),
        };
        Ok(Stated { amount, at: value.span() })
    }

    /// `[least, most]`.
    pub(crate) fn pair(&mut self, value: &Node<'_>, what: &str) -> Result<[Stated; 2], ProblemError> {
        match self.list(value, what)?[..] {
            [least, most] => Ok([self.stated(least, what)?, self.stated(most, what)?]),
            ref items => {
                let found = format!("a list of {}", items.len());
                Err(self.refused(&value.span(), what, found, "[least, most]"))
            }
        }
    }

    /// A value at an end: one, `[least, most]`, or `"free"`.
    pub(crate) fn end(&mut self, value: &Node<'_>, what: &str) -> Result<End, ProblemError> {
        match value.get_ref() {
            DeValue::String(text) if text == "free" => Ok(End::Free),
            DeValue::Array(_) => {
                let [least, most] = self.pair(value, what)?;
                Ok(End::Between(least, most))
            }
            _ => Ok(End::Fixed(self.stated(value, what)?)),
        }
    }
}

/// A number with its unit, `3.5 km/s`.
pub(crate) fn quantity(text: &str) -> Option<(f64, Unit)> {
    let text = text.trim();
    let (number, unit) = text.split_at(text.find(char::is_whitespace)?);
    let number = number.replace('_', "").parse::<f64>().ok().filter(|v| v.is_finite())?;
    let unit = unit.trim();
    // `3 - 2` is a formula.
    let begins = unit.starts_with(|c: char| c.is_alphabetic() || c == '1');
    begins.then(|| Unit::parse(unit).ok()).flatten().map(|unit| (number, unit))
}

/// The reason for which the unit behind a number is none.
pub(crate) fn wrong_unit(text: &str) -> Option<String> {
    let (number, unit) = text.trim().split_once(char::is_whitespace)?;
    let is_number = number.replace('_', "").parse::<f64>().is_ok();
    let begins = unit.trim().starts_with(char::is_alphabetic);
    (is_number && begins).then(|| Unit::parse(unit).err()).flatten().map(|e| e.reason)
}

/// A value in words.
pub(crate) fn described(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(s) if s.len() <= 40 => format!("\"{s}\""),
        DeValue::String(_) => "a long text".into(),
        DeValue::Integer(i) => i.as_str().into(),
        DeValue::Float(f) => f.as_str().into(),
        DeValue::Boolean(b) => b.to_string(),
        DeValue::Datetime(_) => "a date".into(),
        DeValue::Array(_) => "a list".into(),
        DeValue::Table(_) => "a table".into(),
    }
}
