//! Pivots: their signs are counted, and those that are zero to rounding replaced.

use crate::Inertia;

/// Multiples of the size of a row: a pivot up to the first counts as zero and is replaced by the second.
pub(crate) const ZERO_PIVOT: f64 = f64::EPSILON;
const REPLACED_PIVOT: f64 = 1e-8;

/// Counts a pivot, or replaces it if it is zero to rounding. `None` after an overflow.
#[inline(always)]
pub(crate) fn pivot(value: &mut f64, unit: f64, inertia: &mut Inertia) -> Option<f64> {
    inertia.count(*value, ZERO_PIVOT * unit);
    if value.abs() <= ZERO_PIVOT * unit {
        *value = REPLACED_PIVOT * unit;
    }
    (value.is_finite() && (1.0 / *value).is_finite()).then_some(*value)
}
