//! Bounds, and the named quantities of a problem: states, controls, parameters, constraint rows.

use crate::OcpError;

/// A unit behind a number, after a space; nothing where there is none.
#[must_use]
pub fn behind_number(unit: &str) -> String {
    if unit == "-" { String::new() } else { format!(" {unit}") }
}

/// A closed interval; infinite ends mean "no bound", equal ends fix the quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lower end.
    pub lower: f64,
    /// Upper end.
    pub upper: f64,
}

impl Bounds {
    /// No bound on either side.
    pub const FREE: Self = Self { lower: f64::NEG_INFINITY, upper: f64::INFINITY };

    /// Between two values. Order and NaN are checked when the problem is built.
    #[must_use]
    pub const fn new(lower: f64, upper: f64) -> Self {
        Self { lower, upper }
    }

    /// One value only.
    #[must_use]
    pub const fn fixed(value: f64) -> Self {
        Self { lower: value, upper: value }
    }

    /// Not below a value.
    #[must_use]
    pub const fn at_least(lower: f64) -> Self {
        Self { lower, upper: f64::INFINITY }
    }

    /// Not above a value.
    #[must_use]
    pub const fn at_most(upper: f64) -> Self {
        Self { lower: f64::NEG_INFINITY, upper }
    }

    /// Returns true if only one value is allowed.
    #[must_use]
    pub fn is_fixed(&self) -> bool {
        self.lower == self.upper
    }

    /// Common part of two intervals; may be reversed if there is none.
    #[must_use]
    pub fn intersect(&self, other: &Self) -> Self {
        Self { lower: self.lower.max(other.lower), upper: self.upper.min(other.upper) }
    }

    /// Middle, the finite end, or zero.
    #[must_use]
    pub fn representative(&self) -> f64 {
        match (self.lower.is_finite(), self.upper.is_finite()) {
            (true, true) => 0.5 * (self.lower + self.upper),
            (true, false) => self.lower,
            (false, true) => self.upper,
            (false, false) => 0.0,
        }
    }

    /// The nearest allowed value.
    #[must_use]
    pub fn clamp(&self, value: f64) -> f64 {
        value.max(self.lower).min(self.upper)
    }

    /// By how much `value` is outside (positive) or inside (negative, distance to the nearer end).
    #[must_use]
    pub fn excess(&self, value: f64) -> f64 {
        (self.lower - value).max(value - self.upper)
    }

    pub(crate) fn check(&self, place: impl Fn() -> String, unit: &str) -> Result<(), OcpError> {
        let ordered =
            self.lower <= self.upper && self.lower < f64::INFINITY && self.upper > f64::NEG_INFINITY;
        if ordered {
            Ok(())
        } else {
            Err(OcpError::Bounds { place: place(), lower: self.lower, upper: self.upper, unit: unit.into() })
        }
    }
}

impl Default for Bounds {
    fn default() -> Self {
        Self::FREE
    }
}

/// A named quantity with a unit, bounds and an optional scale: a control, a static parameter, one row of a
/// constraint, or the core of a [`State`].
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Name in the field's words, unique among its kind in its phase.
    pub name: String,
    /// Unit, `-` for none.
    pub unit: String,
    /// Allowed values.
    pub bounds: Bounds,
    /// Typical size in `unit`; derived from bounds and guess when absent.
    pub scale: Option<f64>,
    /// True for a lower, and for an upper bound that is a guard: no solution is meant to reach it, it keeps a solve where the equations hold.
    /// An explanation of an infeasible problem never asks to relax a guard.
    pub guards: [bool; 2],
}

impl Variable {
    /// A quantity without bounds.
    #[must_use]
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into(), bounds: Bounds::FREE, scale: None, guards: [false; 2] }
    }

    /// Allowed values `[lower, upper]`.
    #[must_use]
    pub fn within(self, lower: f64, upper: f64) -> Self {
        Self { bounds: Bounds::new(lower, upper), ..self }
    }

    /// Smallest allowed value.
    #[must_use]
    pub fn at_least(self, lower: f64) -> Self {
        Self { bounds: Bounds { lower, ..self.bounds }, ..self }
    }

    /// Largest allowed value.
    #[must_use]
    pub fn at_most(self, upper: f64) -> Self {
        Self { bounds: Bounds { upper, ..self.bounds }, ..self }
    }

    /// The only allowed value.
    #[must_use]
    pub fn equal_to(self, value: f64) -> Self {
        Self { bounds: Bounds::fixed(value), ..self }
    }

    /// Typical size in the quantity's unit.
    #[must_use]
    pub fn scaled_by(self, scale: f64) -> Self {
        Self { scale: Some(scale), ..self }
    }

    /// Both bounds are [guards](Self::guards).
    #[must_use]
    pub fn guarded(self) -> Self {
        Self { guards: [true; 2], ..self }
    }

    /// The upper bound is a [guard](Self::guards), the lower one is not.
    #[must_use]
    pub fn guarded_above(self) -> Self {
        Self { guards: [false, true], ..self }
    }

    /// The lower bound is a [guard](Self::guards), the upper one is not.
    #[must_use]
    pub fn guarded_below(self) -> Self {
        Self { guards: [true, false], ..self }
    }

    /// The size of a quantity with two finite bounds, of which `met` is the largest magnitude that is known: the width of the bounds, or `met`
    /// where they are so far apart that they say nothing of it. None without two bounds.
    #[must_use]
    pub fn size_within_bounds(&self, met: f64) -> Option<f64> {
        let width = self.bounds.upper - self.bounds.lower;
        if !(width > LEAST_WIDTH && width.is_finite()) {
            return None;
        }
        let is_known = met.is_finite() && met > NOISE * width.min(WIDE);
        let apart = if self.has_fence() { FAR_BESIDE_FENCE } else { FAR_APART };
        Some(if is_known && width > apart * met { met } else { width })
    }

    /// Says whether one of two bounds is a million times the other, and only keeps the quantity from going astray.
    fn has_fence(&self) -> bool {
        let [a, b] = [self.bounds.lower, self.bounds.upper].map(f64::abs);
        a.max(b).is_finite() && a.max(b) >= FENCE * a.min(b).max(1.0)
    }

    /// Stated scale, else the largest finite bound that is not zero; of two bounds of which one is a million times the other the smaller one,
    /// none where that is zero.
    #[must_use]
    pub fn size(&self) -> Option<f64> {
        let [a, b] = [self.bounds.lower, self.bounds.upper].map(f64::abs);
        let (near, far) = (a.min(b), a.max(b));
        let bound = [if self.has_fence() { near } else { far }, near];
        self.scale.or(bound.into_iter().find(|b| b.is_finite() && *b > 0.0))
    }

    pub(crate) fn check(&self, place: &str, kind: &'static str) -> Result<(), OcpError> {
        let here = || format!("{place}, {kind} `{}`", self.name);
        self.bounds.check(here, &self.unit)?;
        match self.scale {
            Some(s) if !(s > 0.0 && s.is_finite()) => {
                Err(OcpError::Scale { place: here(), what: "scale", value: s })
            }
            _ => Ok(()),
        }
    }
}

/// A bound of at least this many times the other one, and of at least this size, only keeps a quantity from going astray.
const FENCE: f64 = 1e6;
/// Bounds that are closer are one value.
const LEAST_WIDTH: f64 = 1e-12;
/// Bounds that are this many times farther apart than what lies between them are fences, not sizes.
const FAR_APART: f64 = 1e6;
/// The same where one of the bounds is a fence.
const FAR_BESIDE_FENCE: f64 = 1e3;
/// Values below this part of the width of bounds, or of wide ones if it is less, are what a solver leaves of zero.
const NOISE: f64 = 1e-8;
/// See there.
const WIDE: f64 = 1e2;

/// A state: bounds along the phase, at its start and at its end.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Name, unit, bounds along the phase, scale.
    pub variable: Variable,
    /// Allowed values at the start, within the bounds along the phase.
    pub initial: Bounds,
    /// Allowed values at the end, within the bounds along the phase.
    pub terminal: Bounds,
    /// Largest miss, in the state's unit, that a re-simulation may show; `1e-7` of the scale when absent.
    pub tolerance: Option<f64>,
}

impl State {
    /// True if nothing is asked of it at either end of the phase.
    #[must_use]
    pub fn has_free_ends(&self) -> bool {
        self.initial == Bounds::FREE && self.terminal == Bounds::FREE
    }

    /// A state without bounds.
    #[must_use]
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self {
            variable: Variable::new(name, unit),
            initial: Bounds::FREE,
            terminal: Bounds::FREE,
            tolerance: None,
        }
    }

    /// Allowed values along the phase.
    #[must_use]
    pub fn within(self, lower: f64, upper: f64) -> Self {
        Self { variable: self.variable.within(lower, upper), ..self }
    }

    /// Smallest allowed value along the phase.
    #[must_use]
    pub fn at_least(self, lower: f64) -> Self {
        Self { variable: self.variable.at_least(lower), ..self }
    }

    /// Largest allowed value along the phase.
    #[must_use]
    pub fn at_most(self, upper: f64) -> Self {
        Self { variable: self.variable.at_most(upper), ..self }
    }

    /// Fixed value at the start.
    #[must_use]
    pub fn starts_at(self, value: f64) -> Self {
        Self { initial: Bounds::fixed(value), ..self }
    }

    /// Fixed value at the end.
    #[must_use]
    pub fn ends_at(self, value: f64) -> Self {
        Self { terminal: Bounds::fixed(value), ..self }
    }

    /// Allowed values at the start.
    ///
    /// # Examples
    /// ```
    /// use apsides_ocp::{Bounds, State};
    ///
    /// // A launch from between 0 and 10 m, along heights up to 100 m, to at least 90 m.
    /// let height = State::new("height", "m").within(0.0, 100.0).starts_within(0.0, 10.0).ends_within(90.0, 100.0);
    /// assert_eq!(height.initial, Bounds::new(0.0, 10.0));
    /// assert_eq!(height.terminal, Bounds::new(90.0, 100.0));
    /// ```
    #[must_use]
    pub fn starts_within(self, lower: f64, upper: f64) -> Self {
        Self { initial: Bounds::new(lower, upper), ..self }
    }

    /// Allowed values at the end.
    #[must_use]
    pub fn ends_within(self, lower: f64, upper: f64) -> Self {
        Self { terminal: Bounds::new(lower, upper), ..self }
    }

    /// Typical size in the state's unit.
    #[must_use]
    pub fn scaled_by(self, scale: f64) -> Self {
        Self { variable: self.variable.scaled_by(scale), ..self }
    }

    /// Both bounds along the phase are [guards](Variable::guards).
    #[must_use]
    pub fn guarded(self) -> Self {
        Self { variable: self.variable.guarded(), ..self }
    }

    /// The upper bound along the phase is a [guard](Variable::guards), the lower one is not.
    #[must_use]
    pub fn guarded_above(self) -> Self {
        Self { variable: self.variable.guarded_above(), ..self }
    }

    /// The lower bound along the phase is a [guard](Variable::guards), the upper one is not.
    #[must_use]
    pub fn guarded_below(self) -> Self {
        Self { variable: self.variable.guarded_below(), ..self }
    }

    /// Largest miss that a re-simulation may show, in the state's unit.
    #[must_use]
    pub fn miss_below(self, tolerance: f64) -> Self {
        Self { tolerance: Some(tolerance), ..self }
    }

    pub(crate) fn check(&self, place: &str) -> Result<(), OcpError> {
        self.variable.check(place, "state")?;
        let Variable { name, unit, bounds, .. } = &self.variable;
        for (end, at) in [(self.initial, "start"), (self.terminal, "end")] {
            let here = || format!("{place}, state `{name}` at its {at}");
            end.check(here, unit)?;
            let common = end.intersect(bounds);
            if common.lower > common.upper {
                return Err(OcpError::Contradiction {
                    place: here(),
                    reason: format!(
                        "[{}, {}] {unit} has no value in common with the bounds along the phase, [{}, {}] {unit}",
                        end.lower, end.upper, bounds.lower, bounds.upper
                    ),
                });
            }
        }
        match self.tolerance {
            Some(t) if !(t > 0.0 && t.is_finite()) => Err(OcpError::Scale {
                place: format!("{place}, state `{name}`"),
                what: "tolerance",
                value: t,
            }),
            _ => Ok(()),
        }
    }
}
