//! Sums of numbers and of products without rounding, the same for any order and any division into parts.
//!
//! A sum is an integer in units of `2^-2148`, the least product of two numbers of double precision, in digits of 32 bits that are carried late
//! (U. Kulisch, Computer Arithmetic and Validity, 2013, section 8: the long accumulator; R. Neal, Fast exact summation using small and large
//! superaccumulators, 2015, arXiv:1505.05571).

/// Digits of 32 bits: products take those below 132, the others are for carries.
const DIGITS: usize = 136;
/// Additions until digits are carried: each adds less than `2^33` to a digit, which holds `2^63`.
const MOST_PENDING: u32 = 1 << 29;
/// Exponent of the unit.
const UNIT: i32 = -2148;
/// The number of units in `2^-1074`, as an exponent of two.
const LEAST: usize = 1074;
/// Parts of a sum that are kept where it is multiplied: some 200 bits.
const PARTS: usize = 4;

/// A sum of numbers and products.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ExactSum {
    digits: [i64; DIGITS],
    pending: u32,
}

/// A finite number as `mantissa 2^(exponent - 1074)`, without its sign.
fn parts(v: f64) -> (u64, usize) {
    let bits = v.to_bits();
    let (exponent, fraction) = ((bits >> 52 & 0x7ff) as usize, bits & ((1 << 52) - 1));
    if exponent == 0 { (fraction, 0) } else { (fraction | 1 << 52, exponent - 1) }
}

impl ExactSum {
    pub(super) fn new() -> Self {
        Self { digits: [0; DIGITS], pending: 0 }
    }

    /// Adds a finite number.
    pub(super) fn add(&mut self, v: f64) {
        let (mantissa, exponent) = parts(v);
        self.accumulate(u128::from(mantissa), exponent + LEAST, v.is_sign_negative());
    }

    /// Adds the product of two finite numbers.
    pub(super) fn add_product(&mut self, a: f64, b: f64) {
        let ((m, e), (n, f)) = (parts(a), parts(b));
        self.accumulate(u128::from(m) * u128::from(n), e + f, a.is_sign_negative() != b.is_sign_negative());
    }

    /// Adds `magnitude 2^shift` units, `magnitude` of 106 bits at most.
    fn accumulate(&mut self, magnitude: u128, shift: usize, negative: bool) {
        let (first, offset) = (shift / 32, shift % 32);
        let sign = if negative { -1 } else { 1 };
        for k in 0..4 {
            let part = u64::from((magnitude >> (32 * k)) as u32) << offset;
            self.digits[first + k] += sign * (part & 0xffff_ffff) as i64;
            self.digits[first + k + 1] += sign * (part >> 32) as i64;
        }
        self.pending += 1;
        if self.pending == MOST_PENDING {
            self.carry();
        }
    }

    /// Brings all digits but the last into `0..2^32`.
    fn carry(&mut self) {
        let mut carry = 0;
        for digit in &mut self.digits[..DIGITS - 1] {
            let all = *digit + carry;
            carry = all >> 32;
            *digit = all & 0xffff_ffff;
        }
        self.digits[DIGITS - 1] += carry;
        self.pending = 0;
    }

    /// The nearest number; infinite beyond the largest.
    pub(super) fn rounded(&self) -> f64 {
        let mut sum = self.clone();
        sum.carry();
        let negative = sum.digits[DIGITS - 1] < 0;
        if negative {
            sum.digits.iter_mut().for_each(|digit| *digit = -*digit);
            sum.carry();
        }
        let Some(top) = sum.digits.iter().rposition(|digit| *digit != 0) else { return 0.0 };
        let last = top.saturating_sub(3);
        let mut leading = sum.digits[last..=top].iter().rev().fold(0_u128, |all, d| all << 32 | *d as u128);
        if sum.digits[..last].iter().any(|digit| *digit != 0) {
            // Far below the last bit of the result: it decides between two neighbours alone.
            leading |= 1;
        }
        let exponent = UNIT + 32 * last as i32;
        // In two steps, since the power itself may be no number.
        let half = exponent / 2;
        let magnitude = leading as f64 * power_of_two(half) * power_of_two(exponent - half);
        if negative { -magnitude } else { magnitude }
    }

    /// The largest parts of the sum, which add up to it as far as four numbers can.
    fn leading(&self) -> [f64; PARTS] {
        let mut rest = self.clone();
        [(); PARTS].map(|()| {
            let part = rest.rounded();
            if part.is_finite() {
                rest.add(-part);
            }
            part
        })
    }

    /// The covariance of `count` pairs by the sums of their products and of each: `(n S_ab - S_a S_b) / (n (n - 1))`, the numerator rounded once.
    pub(super) fn covariance(products: &Self, a: &Self, b: &Self, count: usize) -> f64 {
        let n = count as f64;
        let mut numerator = Self::new();
        let [products, a, b] = [products, a, b].map(Self::leading);
        if !products.iter().chain(&a).chain(&b).all(|part| part.is_finite()) {
            return f64::NAN;
        }
        for part in products {
            numerator.add_product(n, part);
        }
        for p in a {
            for q in b {
                numerator.add_product(-p, q);
            }
        }
        numerator.rounded() / (n * (n - 1.0))
    }
}

/// `2^exponent` for exponents above -1075.
fn power_of_two(exponent: i32) -> f64 {
    if exponent < -1022 {
        f64::from_bits(1 << (exponent + 1074))
    } else {
        f64::from_bits(((exponent + 1023) as u64) << 52)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(values: &[f64]) -> f64 {
        let mut sum = ExactSum::new();
        values.iter().for_each(|v| sum.add(*v));
        sum.rounded()
    }

    #[test]
    fn sums_are_exact_in_any_order() {
        assert_eq!(sum(&[]), 0.0);
        assert_eq!(sum(&[1e100, 1.0, -1e100]), 1.0);
        assert_eq!(sum(&[1.0, 1e100, 1.0, -1e100, -2.0, f64::from_bits(1)]), f64::from_bits(1));
        assert_eq!(sum(&[f64::MAX, f64::MAX, -f64::MAX]), f64::MAX);
        assert_eq!(sum(&[f64::MAX, f64::MAX]), f64::INFINITY);
        assert_eq!(sum(&[-f64::MAX, -f64::MAX]), f64::NEG_INFINITY);
        assert_eq!(sum(&[-0.1; 10]), -1.0);
        // Half of the last bit rounds to even, more than half rounds up.
        let last = f64::EPSILON;
        assert_eq!(sum(&[1.0, last / 2.0]), 1.0);
        assert_eq!(sum(&[1.0, last / 2.0, f64::from_bits(1)]), 1.0 + last);
        assert_eq!(sum(&[1.0 + last, last / 2.0]), 1.0 + 2.0 * last);
        for v in [f64::MIN_POSITIVE, 5e-324, 3e-310, 1e308, -2.5, 1.0 / 3.0] {
            assert_eq!(sum(&[v]), v);
        }
    }

    #[test]
    fn the_order_is_of_no_consequence() {
        let value = |k: i32| (f64::from(k) * 0.7).sin() * 10f64.powi(k % 40 - 20);
        let (mut forward, mut backward) = (ExactSum::new(), ExactSum::new());
        (0..1000).for_each(|k| forward.add(value(k)));
        (0..1000).rev().for_each(|k| backward.add(value(k)));
        assert_eq!(forward.leading(), backward.leading());
    }

    /// Squares of values far from zero lose all digits of their spread in double precision.
    #[test]
    fn covariances_keep_what_cancels() {
        for offset in [0.0, 1e9, 1e15, -1e15] {
            let values = [1.0, 2.0, 4.0].map(|v| v + offset);
            let (mut s, mut squares) = (ExactSum::new(), ExactSum::new());
            for v in values {
                s.add(v);
                squares.add_product(v, v);
            }
            // The variance of 1, 2, 4 is 7/3.
            assert_eq!(ExactSum::covariance(&squares, &s, &s, 3), 14.0 / 6.0, "{offset}");
        }
        // Products of which no double has the size.
        let (mut s, mut squares) = (ExactSum::new(), ExactSum::new());
        for v in [1e-200, 3e-200] {
            s.add(v);
            squares.add_product(v, v);
        }
        assert_eq!(ExactSum::covariance(&squares, &s, &s, 2), 0.0);
        let mut huge = ExactSum::new();
        huge.add_product(1e200, 1e200);
        huge.add_product(-1e200, 1e200);
        huge.add_product(3.0, 0.5);
        assert_eq!(huge.rounded(), 1.5);
    }
}
