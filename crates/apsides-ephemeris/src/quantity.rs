//! Names of columns: a quantity with its unit as one word.

/// A quantity of a table: its name in the field's words and its unit, `-` for none.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
}

impl Column {
    /// A name with a unit.
    #[must_use]
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into() }
    }

    /// The header of the column: name and unit as one word, `horizontal_speed_m_per_s`.
    #[must_use]
    pub fn header(&self) -> String {
        header(&self.name, &self.unit)
    }
}

/// The header of a quantity: name and unit as one word, `horizontal_speed_m_per_s`.
#[must_use]
pub fn header(name: &str, unit: &str) -> String {
    match header_text(unit) {
        unit if unit.is_empty() => header_text(name),
        unit => format!("{}_{unit}", header_text(name)),
    }
}

/// A name or unit made of letters, digits and underscores: `m/s^2` is `m_per_s2`, `-` is empty.
#[must_use]
pub fn header_text(text: &str) -> String {
    if text == "-" {
        return String::new();
    }
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '/' => out.push_str("_per_"),
            '%' => out.push_str("percent"),
            '^' | '(' | ')' => {}
            '-' if out.ends_with(char::is_alphabetic) && text.contains('^') => out.push_str("_minus"),
            c if c.is_alphanumeric() => out.push(c),
            _ => out.push('_'),
        }
    }
    while out.contains("__") {
        out = out.replace("__", "_");
    }
    out.trim_matches('_').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn header_texts() {
        for (text, header) in [
            ("m/s", "m_per_s"),
            ("m/s^2", "m_per_s2"),
            ("horizontal speed", "horizontal_speed"),
            ("kg s/m", "kg_s_per_m"),
            ("kg/(m s)", "kg_per_m_s"),
            ("s^-1", "s_minus1"),
            ("x,\"y\"\n", "x_y"),
            ("-", ""),
            ("1/rad", "1_per_rad"),
        ] {
            assert_eq!(header_text(text), header, "{text}");
        }
        assert_eq!(header("altitude", "m"), "altitude_m");
        assert_eq!(header("throttle", "-"), "throttle");
    }
}
