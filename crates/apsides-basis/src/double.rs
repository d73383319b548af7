//! Twice the precision for the Legendre recurrence at the roots: `hi + lo`, about 32 digits.
//!
//! In plain `f64` the recurrence loses a factor of the degree in the weights. Error-free transformations of Knuth
//! and Dekker (T. J. Dekker, *Numer. Math.* 18 (1971) 224, doi:10.1007/BF01397083).

/// An unevaluated sum with `|lo| <= ulp(hi) / 2`.
#[derive(Clone, Copy)]
pub(crate) struct Double {
    hi: f64,
    lo: f64,
}

impl Double {
    pub(crate) fn new(value: f64) -> Self {
        Self { hi: value, lo: 0.0 }
    }

    pub(crate) fn value(self) -> f64 {
        self.hi + self.lo
    }

    pub(crate) fn plus(self, other: Self) -> Self {
        let sum = self.hi + other.hi;
        let part = sum - self.hi;
        let error = (self.hi - (sum - part)) + (other.hi - part);
        Self::normalised(sum, error + self.lo + other.lo)
    }

    pub(crate) fn times(self, factor: f64) -> Self {
        let (product, error) = exact_product(self.hi, factor);
        Self::normalised(product, error + self.lo * factor)
    }

    pub(crate) fn over(self, divisor: f64) -> Self {
        let quotient = self.hi / divisor;
        let (product, error) = exact_product(quotient, divisor);
        Self::normalised(quotient, ((self.hi - product) - error + self.lo) / divisor)
    }

    fn normalised(large: f64, small: f64) -> Self {
        let hi = large + small;
        Self { hi, lo: small - (hi - large) }
    }
}

/// `a b` as a rounded product and its error.
fn exact_product(a: f64, b: f64) -> (f64, f64) {
    let split = |v: f64| {
        let scaled = 134217729.0 * v; // 2^27 + 1
        let high = scaled - (scaled - v);
        (high, v - high)
    };
    let ((a1, a2), (b1, b2)) = (split(a), split(b));
    let product = a * b;
    (product, ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2)
}
