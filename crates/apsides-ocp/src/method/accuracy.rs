//! The accuracy of a solution.

/// One measure of how accurate a solution is, and the tolerance asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Accuracy {
    /// The name of the measure, as it stands in a sentence: `error between the points`.
    pub measure: &'static str,
    /// Its value.
    pub reached: f64,
    /// Its largest allowed value.
    pub tolerance: f64,
    /// The setting that gives the tolerance, by the name of its field.
    pub setting: &'static str,
    /// Where along the solution, in words, if that is known.
    pub place: Option<String>,
}

impl Accuracy {
    /// A measure of the whole solution.
    #[must_use]
    pub fn new(measure: &'static str, reached: f64, tolerance: f64, setting: &'static str) -> Self {
        Self { measure, reached, tolerance, setting, place: None }
    }

    /// A measure at a place, as it stands in a sentence: `phase `turn`, rate, t = 3.2 s`.
    #[must_use]
    pub fn at(self, place: String) -> Self {
        Self { place: Some(place), ..self }
    }

    /// Returns true if the tolerance is met; NaN meets none.
    #[must_use]
    pub fn is_met(&self) -> bool {
        self.reached <= self.tolerance
    }
}
