//! The place of a quantity in words: phase and time.

use apsides_ocp::{Phase, behind_number};

/// Phase and time.
pub(crate) fn place(phase: &Phase, t: f64) -> String {
    let unit = behind_number(&phase.time_unit);
    format!("phase `{}`, t = {}{unit}", phase.name, significant(t))
}

/// Seven significant digits, without trailing zeros.
fn significant(v: f64) -> String {
    if v == 0.0 || !v.is_finite() {
        return format!("{v}");
    }
    let magnitude = v.abs().log10().floor();
    if !(-4.0..9.0).contains(&magnitude) {
        return format!("{v:.6e}");
    }
    let decimals = (6.0 - magnitude).max(0.0) as usize;
    let text = format!("{v:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seven_digits() {
        let cases = [
            (0.0, "0"),
            (2.0, "2"),
            (-0.5, "-0.5"),
            (1_005.412_345_6, "1005.412"),
            (123_456_789.0, "123456789"),
            (1e-9, "1.000000e-9"),
            (100.0, "100"),
        ];
        for (v, text) in cases {
            assert_eq!(significant(v), text);
        }
        assert_eq!(significant(f64::NAN), "NaN");
    }
}
