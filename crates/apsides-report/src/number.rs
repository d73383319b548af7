//! Numbers for readers: significant digits, powers of ten with raised exponents, words for what is not a number.

use crate::units::superscript;

/// `value` with up to `digits` significant digits, trailing zeros dropped; `not a number` and `infinite` in words.
pub(crate) fn readable(value: f64, digits: usize) -> String {
    if value.is_nan() {
        return "not a number".into();
    }
    if value.is_infinite() {
        return if value > 0.0 { "infinite".into() } else { "\u{2212}infinite".into() };
    }
    if value == 0.0 {
        return "0".into();
    }
    let digits = digits.max(1);
    // Rounded first, so that 9.9996 with four digits is 10 and not 10.00.
    let rounded = format!("{:.*e}", digits - 1, value);
    let (mantissa, exponent) = rounded.split_once('e').unwrap_or((&rounded, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let text = if (-4..digits.max(6) as i32).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        without_trailing_zeros(&format!("{value:.decimals$}")).to_owned()
    } else {
        format!("{} × {}", without_trailing_zeros(mantissa), power_of_ten(exponent))
    };
    text.replace('-', "\u{2212}")
}

/// `10⁻⁸`.
pub(crate) fn power_of_ten(exponent: i32) -> String {
    format!("10{}", exponent.to_string().chars().map(superscript).collect::<String>())
}

fn without_trailing_zeros(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn significant_digits() {
        assert_eq!(readable(1005.41234, 7), "1005.412");
        assert_eq!(readable(9.9996, 4), "10");
        assert_eq!(readable(-0.5, 4), "\u{2212}0.5");
        assert_eq!(readable(1.234e-8, 3), "1.23 × 10⁻⁸");
        assert_eq!(readable(300.0, 2), "300");
        assert_eq!(readable(1.7374e6, 7), "1737400");
        assert_eq!(readable(-2e19, 3), "\u{2212}2 × 10¹⁹");
        assert_eq!(readable(0.0, 3), "0");
        assert_eq!(readable(f64::NAN, 3), "not a number");
        assert_eq!(readable(f64::INFINITY, 3), "infinite");
    }
}
