//! Pivots: they are shifted, their signs are counted, and those that are zero to rounding replaced.

use crate::Inertia;

/// Multiples of the size of a row: a pivot up to the first counts as zero and is replaced by the second.
pub(crate) const ZERO_PIVOT: f64 = f64::EPSILON;
const REPLACED_PIVOT: f64 = 1e-8;

/// Shift of each pivot, positive in primal rows and negative in dual ones (zero too), and the size of a row.
#[derive(Clone, Copy)]
pub(crate) struct Diagonal<'a> {
    pub(crate) shifts: &'a [f64],
    pub(crate) unit: f64,
}

/// A pivot of a primal row is shifted if it is at most so many shifts: a shift costs accuracy. Those of dual rows are always shifted, which
/// gives the last one of equations that say the same a sign beyond rounding.
const SHIFTED: f64 = 3.0;

/// Shifts a pivot, then counts it, or replaces it if it is zero to rounding. `None` after an overflow.
#[inline(always)]
pub(crate) fn pivot(value: &mut f64, shift: f64, unit: f64, inertia: &mut Inertia) -> Option<f64> {
    if shift.is_sign_negative() || value.abs() <= SHIFTED * shift {
        *value += shift;
    }
    inertia.count(*value, ZERO_PIVOT * unit);
    if value.abs() <= ZERO_PIVOT * unit {
        *value = REPLACED_PIVOT * unit;
    }
    (value.is_finite() && (1.0 / *value).is_finite()).then_some(*value)
}
