//! Operators with a number on the left, and smooth functions with a stated width.

use apsides_ad::{Dual, HyperDual, Scalar};

/// Round-off of a few operations.
const ROUNDING: f64 = 1e-15;

#[test]
fn numbers_stand_on_the_left() {
    let x = Dual::<1>::variable(4.0, 0);
    assert_eq!((1.0 + x, 1.0 - x), (x + 1.0, -x + 1.0));
    assert_eq!((3.0 * x).eps, [3.0]);
    assert_eq!((2.0 / x).re, 0.5);
    assert!(((2.0 / x).eps[0] + 0.125).abs() <= ROUNDING);
    let _: HyperDual<1> = 1.0 - HyperDual::<1>::from(2.0);
}

#[test]
fn smooth_functions_are_off_by_their_width_and_no_more() {
    assert_eq!(0.0_f64.smooth_abs(1e-3), 1e-3);
    // Far from zero by width^2 / (2 |x|).
    assert!((2.0_f64.smooth_abs(1e-3) - 2.0 - 2.5e-7).abs() < 1e3 * ROUNDING);
    assert_eq!(1.0_f64.smooth_max(1.0, 0.1), 1.05);
    assert_eq!(1.0_f64.smooth_min(1.0, 0.1), 0.95);
    assert_eq!((3.0_f64.smooth_max(-5.0, 0.0), 3.0_f64.smooth_min(-5.0, 0.0)), (3.0, -5.0));
    // Derivative by the closed form, x / sqrt(x^2 + width^2).
    let slope = Dual::<1>::variable(3.0, 0).smooth_abs(4.0);
    assert!((slope.re - 5.0).abs() <= ROUNDING && (slope.eps[0] - 0.6).abs() <= ROUNDING);
}
