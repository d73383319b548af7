//! Names and units of states and controls: labels of figures and headers of files come from here.

/// A named quantity with its SI unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quantity {
    /// Name in the field's words.
    pub name: &'static str,
    /// SI unit, `-` for none.
    pub unit: &'static str,
}

impl Quantity {
    /// A name with a unit.
    #[must_use]
    pub const fn new(name: &'static str, unit: &'static str) -> Self {
        Self { name, unit }
    }
}
