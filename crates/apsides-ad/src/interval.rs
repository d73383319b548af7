//! Arithmetic of intervals (R. E. Moore, R. B. Kearfott, M. J. Cloud: Introduction to Interval Analysis, SIAM 2009): all values that a
//! function takes over intervals, valid to rounding.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::formula::{Binary, Unary};

/// All that a value can be, least and largest.
pub(crate) type Interval = [f64; 2];

pub(crate) const ALL: Interval = [f64::NEG_INFINITY, f64::INFINITY];
pub(crate) const ZERO: Interval = [0.0, 0.0];
pub(crate) const ONE: Interval = [1.0, 1.0];

/// The interval, or all where an end is not known.
#[inline]
pub(crate) fn known(x: Interval) -> Interval {
    if x[0].is_nan() || x[1].is_nan() { ALL } else { x }
}

#[inline]
pub(crate) fn contains_zero(x: Interval) -> bool {
    x[0] <= 0.0 && x[1] >= 0.0
}

#[inline]
pub(crate) fn add(x: Interval, y: Interval) -> Interval {
    known([x[0] + y[0], x[1] + y[1]])
}

#[inline]
pub(crate) fn minus(x: Interval) -> Interval {
    [-x[1], -x[0]]
}

#[inline]
pub(crate) fn scale(x: Interval, factor: f64) -> Interval {
    product(x, [factor; 2])
}

#[inline]
pub(crate) fn square(x: Interval) -> Interval {
    power(x, 2)
}

#[inline]
pub(crate) fn hull(a: Interval, b: Interval) -> Interval {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// A function that grows, on the part of the interval where it is defined.
fn growing(x: Interval, domain: Interval, f: impl Fn(f64) -> f64) -> Interval {
    let [a, b] = [x[0].max(domain[0]), x[1].min(domain[1])];
    if a <= b { [f(a), f(b)] } else { ALL }
}

pub(crate) fn unary(f: Unary, x: Interval) -> Interval {
    let apply = |v: f64| f.apply(v);
    match f {
        Unary::Neg => minus(x),
        Unary::Sin => wave(x, FRAC_PI_2, f64::sin),
        Unary::Cos => wave(x, 0.0, f64::cos),
        // Between two poles it grows.
        Unary::Tan if ((x[0] + FRAC_PI_2) / PI).floor() == ((x[1] + FRAC_PI_2) / PI).floor() => {
            let [a, b] = x.map(f64::tan);
            if a <= b { [a, b] } else { ALL }
        }
        Unary::Tan => ALL,
        Unary::Asin | Unary::Atanh => growing(x, [-1.0, 1.0], apply),
        Unary::Acos => {
            let [a, b] = growing(x, [-1.0, 1.0], |v| v);
            [b.acos(), a.acos()]
        }
        Unary::Atan | Unary::Cbrt | Unary::Exp | Unary::Sinh | Unary::Tanh | Unary::Asinh | Unary::Sign => {
            growing(x, ALL, apply)
        }
        Unary::Sqrt | Unary::Ln => growing(x, [0.0, f64::INFINITY], apply),
        Unary::Acosh => growing(x, [1.0, f64::INFINITY], apply),
        Unary::Cosh => growing(unary(Unary::Abs, x), ALL, apply),
        Unary::Recip => quotient([1.0, 1.0], x),
        Unary::Abs if x[0] >= 0.0 => x,
        Unary::Abs if x[1] <= 0.0 => minus(x),
        Unary::Abs => [0.0, x[1].max(-x[0])],
    }
}

pub(crate) fn binary(f: Binary, x: Interval, y: Interval) -> Interval {
    match f {
        Binary::Add => [x[0] + y[0], x[1] + y[1]],
        Binary::Sub => [x[0] - y[1], x[1] - y[0]],
        Binary::Mul => product(x, y),
        Binary::Div => quotient(x, y),
        Binary::Atan2 => angle(x, y),
        Binary::Pow if x[0] > 0.0 => {
            let exponent = product(unary(Unary::Ln, x), y);
            unary(Unary::Exp, exponent)
        }
        Binary::Pow => [0.0, f64::INFINITY],
        Binary::Min => [x[0].min(y[0]), x[1].min(y[1])],
        Binary::Max => [x[0].max(y[0]), x[1].max(y[1])],
    }
}

#[inline]
pub(crate) fn product(x: Interval, y: Interval) -> Interval {
    let is_zero = |x: Interval| x[0] == 0.0 && x[1] == 0.0;
    if is_zero(x) || is_zero(y) {
        return ZERO;
    }
    // Nothing times anything finite is nothing, however large that is.
    let times = |a: f64, b: f64| if a == 0.0 || b == 0.0 { 0.0 } else { a * b };
    let corners = [times(x[0], y[0]), times(x[0], y[1]), times(x[1], y[0]), times(x[1], y[1])];
    corners.into_iter().fold([f64::INFINITY, f64::NEG_INFINITY], |all, v| [all[0].min(v), all[1].max(v)])
}

pub(crate) fn quotient(x: Interval, y: Interval) -> Interval {
    if y[0] < 0.0 && y[1] > 0.0 || y == [0.0, 0.0] {
        return ALL;
    }
    // An end at zero is approached from within.
    let inverse = |v: f64, sign: f64| if v == 0.0 { sign * f64::INFINITY } else { v.recip() };
    let sign = if y[1] > 0.0 { 1.0 } else { -1.0 };
    product(x, [inverse(y[1], sign), inverse(y[0], sign)])
}

pub(crate) fn power(x: Interval, n: i32) -> Interval {
    match n {
        0 => [1.0, 1.0],
        n if n < 0 => quotient([1.0, 1.0], power(x, -n)),
        n if n % 2 == 0 => growing(unary(Unary::Abs, x), ALL, |v| v.powi(n)),
        n => growing(x, ALL, |v| v.powi(n)),
    }
}

pub(crate) fn real_power(x: Interval, p: f64) -> Interval {
    let grown = growing(x, [0.0, f64::INFINITY], |v| v.powf(p.abs()));
    if p < 0.0 { quotient([1.0, 1.0], grown) } else { grown }
}

/// Sine or cosine: its largest value, one, is at `peak` and whole turns from it.
fn wave(x: Interval, peak: f64, f: impl Fn(f64) -> f64) -> Interval {
    // An infinite end has no sine.
    if x[1] - x[0] >= TAU || x.iter().any(|v| !v.is_finite()) {
        return [-1.0, 1.0];
    }
    let meets = |at: f64| ((x[1] - at) / TAU).floor() >= ((x[0] - at) / TAU).ceil();
    let [a, b] = x.map(f);
    [if meets(peak + PI) { -1.0 } else { a.min(b) }, if meets(peak) { 1.0 } else { a.max(b) }]
}

/// Angle of the points with ordinates `y` and abscissae `x`.
fn angle(y: Interval, x: Interval) -> Interval {
    let turned = |side: f64, ratio: Interval| {
        let [a, b] = unary(Unary::Atan, ratio);
        [side - b, side - a]
    };
    if x[0] > 0.0 {
        unary(Unary::Atan, quotient(y, x))
    } else if y[0] > 0.0 {
        turned(FRAC_PI_2, quotient(x, y))
    } else if y[1] < 0.0 {
        turned(-FRAC_PI_2, quotient(x, y))
    } else {
        [-PI, PI]
    }
}
