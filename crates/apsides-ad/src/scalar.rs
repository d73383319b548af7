//! The scalar trait that models are generic in, and its implementation for `f64`.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use crate::pchip::Pchip;
use crate::spline::{BicubicSpline, CubicSpline};

/// A number that a model can be evaluated on.
///
/// Everything follows from the arithmetic operators and the two composition rules [`Scalar::map`] and
/// [`Scalar::map2`]. There is no way to read the value of a scalar: a model must not branch on it, so that
/// derivatives and sparsity patterns hold everywhere. [`Scalar::abs`], [`Scalar::min`], [`Scalar::max`], [`Scalar::sign`] and
/// [`Scalar::select`] choose for it; their derivatives are those of the side that is chosen, and where they switch a problem has to
/// declare a kink ([`Formula::kinks`](crate::Formula::kinks) lists them).
pub trait Scalar:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + From<f64>
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
{
    /// Highest derivative that the scalar carries: of what [`Scalar::map`] and [`Scalar::map2`] get, it does not look at those beyond. A function
    /// whose derivatives cost much may leave them out.
    const ORDER: usize = 2;

    /// Composition with a function of one variable; `g` returns `[g(x), g'(x), g''(x)]`.
    fn map(self, g: impl Fn(f64) -> [f64; 3]) -> Self;

    /// Composition with a function of two variables; `g` returns `[g, g_x, g_y, g_xx, g_xy, g_yy]`.
    fn map2(self, other: Self, g: impl Fn(f64, f64) -> [f64; 6]) -> Self;

    /// [`Scalar::map`] with several functions that are found together; scalars with a value ask for them once.
    #[inline]
    fn map_all<const K: usize>(self, g: impl Fn(f64) -> [[f64; 3]; K]) -> [Self; K] {
        std::array::from_fn(|k| self.map(|x| g(x)[k]))
    }

    /// [`Scalar::map2`] with several functions that are found together; scalars with a value ask for them once.
    #[inline]
    fn map2_all<const K: usize>(self, other: Self, g: impl Fn(f64, f64) -> [[f64; 6]; K]) -> [Self; K] {
        std::array::from_fn(|k| self.map2(other, |x, y| g(x, y)[k]))
    }

    /// Sine (argument in rad).
    #[inline]
    fn sin(self) -> Self {
        self.map(|x| {
            let (s, c) = x.sin_cos();
            [s, c, -s]
        })
    }

    /// Cosine (argument in rad).
    #[inline]
    fn cos(self) -> Self {
        self.map(|x| {
            let (s, c) = x.sin_cos();
            [c, -s, -c]
        })
    }

    /// Sine and cosine (argument in rad).
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        (self.sin(), self.cos())
    }

    /// Tangent (argument in rad).
    #[inline]
    fn tan(self) -> Self {
        self.map(|x| {
            let t = x.tan();
            let d = 1.0 + t * t;
            [t, d, 2.0 * t * d]
        })
    }

    /// Arc sine, in rad.
    #[inline]
    fn asin(self) -> Self {
        self.map(|x| {
            let d = 1.0 / (1.0 - x * x).sqrt();
            [x.asin(), d, x * d * d * d]
        })
    }

    /// Arc cosine, in rad.
    #[inline]
    fn acos(self) -> Self {
        self.map(|x| {
            let d = -1.0 / (1.0 - x * x).sqrt();
            [x.acos(), d, x * d * d * d]
        })
    }

    /// Arc tangent, in rad.
    #[inline]
    fn atan(self) -> Self {
        self.map(|x| {
            let d = 1.0 / (1.0 + x * x);
            [x.atan(), d, -2.0 * x * d * d]
        })
    }

    /// Angle of the point (`x`, `self`) in (-pi, pi]; `self` is the ordinate as in `f64::atan2`.
    #[inline]
    fn atan2(self, x: Self) -> Self {
        self.map2(x, |y, x| {
            let r2 = x * x + y * y;
            let r4 = r2 * r2;
            [y.atan2(x), x / r2, -y / r2, -2.0 * x * y / r4, (y * y - x * x) / r4, 2.0 * x * y / r4]
        })
    }

    /// Square root; its derivatives are infinite at zero (see [`crate::vector::norm`] for norms).
    #[inline]
    fn sqrt(self) -> Self {
        self.map(|x| {
            let s = x.sqrt();
            [s, 0.5 / s, -0.25 / (s * x)]
        })
    }

    /// Exponential.
    #[inline]
    fn exp(self) -> Self {
        self.map(|x| {
            let e = x.exp();
            [e, e, e]
        })
    }

    /// Natural logarithm.
    #[inline]
    fn ln(self) -> Self {
        self.map(|x| [x.ln(), 1.0 / x, -1.0 / (x * x)])
    }

    /// Hyperbolic sine.
    #[inline]
    fn sinh(self) -> Self {
        self.map(|x| {
            let (s, c) = (x.sinh(), x.cosh());
            [s, c, s]
        })
    }

    /// Hyperbolic cosine.
    #[inline]
    fn cosh(self) -> Self {
        self.map(|x| {
            let (s, c) = (x.sinh(), x.cosh());
            [c, s, c]
        })
    }

    /// Hyperbolic tangent.
    #[inline]
    fn tanh(self) -> Self {
        self.map(|x| {
            let t = x.tanh();
            let d = 1.0 - t * t;
            [t, d, -2.0 * t * d]
        })
    }

    /// Inverse hyperbolic sine.
    #[inline]
    fn asinh(self) -> Self {
        self.map(|x| {
            let d = 1.0 / (1.0 + x * x).sqrt();
            [x.asinh(), d, -x * d * d * d]
        })
    }

    /// Inverse hyperbolic cosine.
    #[inline]
    fn acosh(self) -> Self {
        self.map(|x| {
            let d = 1.0 / ((x - 1.0) * (x + 1.0)).sqrt();
            [x.acosh(), d, -x * d * d * d]
        })
    }

    /// Inverse hyperbolic tangent.
    #[inline]
    fn atanh(self) -> Self {
        self.map(|x| {
            let d = 1.0 / ((1.0 - x) * (1.0 + x));
            [x.atanh(), d, 2.0 * x * d * d]
        })
    }

    /// Cube root; its derivatives are infinite at zero.
    #[inline]
    fn cbrt(self) -> Self {
        self.map(|x| {
            let c = x.cbrt();
            let d = 1.0 / (3.0 * c * c);
            [c, d, -2.0 / 3.0 * d / x]
        })
    }

    /// Reciprocal.
    #[inline]
    fn recip(self) -> Self {
        self.map(|x| {
            let r = 1.0 / x;
            [r, -r * r, 2.0 * r * r * r]
        })
    }

    /// Square.
    #[inline]
    fn square(self) -> Self {
        self * self
    }

    /// Smooth absolute value `sqrt(x^2 + width^2)`: `width` above `|x|` at zero, `width^2 / (2 |x|)` far from it. The width is
    /// positive and in the unit of the argument.
    #[inline]
    fn smooth_abs(self, width: f64) -> Self {
        self.map(|x| {
            let a = x.hypot(width);
            [a, x / a, (width / a) * (width / a) / a]
        })
    }

    /// Smooth maximum `(x + y + sqrt((x - y)^2 + width^2)) / 2`: `width / 2` above the maximum where both are equal, less elsewhere.
    #[inline]
    fn smooth_max(self, other: Self, width: f64) -> Self {
        (self + other + (self - other).smooth_abs(width)) * 0.5
    }

    /// Smooth minimum `(x + y - sqrt((x - y)^2 + width^2)) / 2`: `width / 2` below the minimum where both are equal, less elsewhere.
    #[inline]
    fn smooth_min(self, other: Self, width: f64) -> Self {
        (self + other - (self - other).smooth_abs(width)) * 0.5
    }

    /// Integer power.
    #[inline]
    fn powi(self, n: i32) -> Self {
        match n {
            0 => Self::from(1.0),
            1 => self,
            _ => {
                let k = f64::from(n);
                self.map(|x| {
                    let p2 = x.powi(n.saturating_sub(2));
                    [x.powi(n), k * (p2 * x), k * (k - 1.0) * p2]
                })
            }
        }
    }

    /// Power with a constant real exponent.
    #[inline]
    fn powf(self, n: f64) -> Self {
        self.map(|x| {
            let p = x.powf(n);
            // One power where the others follow from it to rounding.
            let (p1, p2) =
                if p.is_normal() { (p / x, p / x / x) } else { (x.powf(n - 1.0), x.powf(n - 2.0)) };
            [p, n * p1, n * (n - 1.0) * p2]
        })
    }

    /// Power of a non-negative number with an exponent that may vary. At zero the derivatives with respect to the exponent are those
    /// of a positive exponent, which are zero.
    #[inline]
    fn pow(self, exponent: Self) -> Self {
        self.map2(exponent, |x, y| {
            let (p, ln) = (x.powf(y), ln_or_zero(x));
            let p1 = x.powf(y - 1.0);
            let p2 = x.powf(y - 2.0);
            [p, guarded(y, p1), p * ln, guarded(y * (y - 1.0), p2), p1 * (1.0 + y * ln), p * ln * ln]
        })
    }

    /// Absolute value; at zero, where it has a kink, its derivative is zero.
    #[inline]
    fn abs(self) -> Self {
        self.map(|x| [x.abs(), sign(x), 0.0])
    }

    /// Sign: -1, 0 or 1. It jumps at zero, and its derivatives are zero.
    #[inline]
    fn sign(self) -> Self {
        self.map(|x| [sign(x), 0.0, 0.0])
    }

    /// The smaller of two numbers, the first where they are equal; a kink there.
    #[inline]
    fn min(self, other: Self) -> Self {
        self.map2(other, |x, y| {
            if precedes(x, y) { [x, 1.0, 0.0, 0.0, 0.0, 0.0] } else { [y, 0.0, 1.0, 0.0, 0.0, 0.0] }
        })
    }

    /// The larger of two numbers, the first where they are equal; a kink there.
    #[inline]
    fn max(self, other: Self) -> Self {
        self.map2(other, |x, y| {
            if follows(x, y) { [x, 1.0, 0.0, 0.0, 0.0, 0.0] } else { [y, 0.0, 1.0, 0.0, 0.0, 0.0] }
        })
    }

    /// `a` where this is at least zero, else `b`; NaN where it is NaN. What is not chosen may be anything, also not a number.
    #[must_use]
    fn select(self, a: Self, b: Self) -> Self;

    /// The value of a [`CubicSpline`], as an operation of its own.
    #[inline]
    fn cubic_spline(self, table: &CubicSpline) -> Self {
        self.map(|x| table.derivatives(x))
    }

    /// The value of a [`Pchip`], as an operation of its own.
    #[inline]
    fn pchip(self, table: &Pchip) -> Self {
        self.map(|x| table.derivatives(x))
    }

    /// The value of a [`BicubicSpline`] at this and `y`, as an operation of its own.
    #[inline]
    fn bicubic_spline(self, y: Self, table: &BicubicSpline) -> Self {
        self.map2(y, |x, y| table.derivatives(x, y))
    }
}

/// The sign of a number: -1, 0 or 1, or NaN.
#[inline]
pub(crate) fn sign(x: f64) -> f64 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        // Zero or NaN.
        x.abs()
    }
}

/// Says whether the first number is the smaller of two; NaN is what is not hidden.
#[inline]
pub(crate) fn precedes(x: f64, y: f64) -> bool {
    x <= y || x.is_nan()
}

/// Says whether the first number is the larger of two; NaN is what is not hidden.
#[inline]
pub(crate) fn follows(x: f64, y: f64) -> bool {
    x >= y || x.is_nan()
}

/// The product, zero where the first factor is zero, whatever the second.
#[inline]
pub(crate) fn guarded(x: f64, y: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x * y }
}

/// The natural logarithm, and zero at zero: it stands beside powers that vanish faster.
#[inline]
pub(crate) fn ln_or_zero(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.ln() }
}

/// Writes the functions that choose one of two scalars, given how to read the value.
macro_rules! branches {
    ($value:expr) => {
        #[inline]
        fn min(self, other: Self) -> Self {
            let value: fn(&Self) -> f64 = $value;
            if crate::scalar::precedes(value(&self), value(&other)) { self } else { other }
        }

        #[inline]
        fn max(self, other: Self) -> Self {
            let value: fn(&Self) -> f64 = $value;
            if crate::scalar::follows(value(&self), value(&other)) { self } else { other }
        }

        #[inline]
        fn select(self, a: Self, b: Self) -> Self {
            let value: fn(&Self) -> f64 = $value;
            let condition = value(&self);
            if condition >= 0.0 {
                a
            } else if condition.is_nan() {
                Self::from(f64::NAN)
            } else {
                b
            }
        }
    };
}
pub(crate) use branches;

impl Scalar for f64 {
    const ORDER: usize = 0;

    #[inline]
    fn map(self, g: impl Fn(f64) -> [f64; 3]) -> Self {
        g(self)[0]
    }

    #[inline]
    fn map2(self, other: Self, g: impl Fn(f64, f64) -> [f64; 6]) -> Self {
        g(self, other)[0]
    }

    #[inline(always)]
    fn map_all<const K: usize>(self, g: impl Fn(f64) -> [[f64; 3]; K]) -> [Self; K] {
        g(self).map(|jet| jet[0])
    }

    #[inline(always)]
    fn map2_all<const K: usize>(self, other: Self, g: impl Fn(f64, f64) -> [[f64; 6]; K]) -> [Self; K] {
        g(self, other).map(|jet| jet[0])
    }

    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        f64::sin_cos(self)
    }

    branches!(|x| *x);
}

/// Writes the operators that follow from `Add`, `Sub`, `Mul`, `Div` between scalars of one type.
macro_rules! derived_operators {
    ([$($generics:tt)*] $type:ty) => {
        impl<$($generics)*> std::ops::AddAssign for $type {
            #[inline]
            fn add_assign(&mut self, rhs: Self) {
                *self = *self + rhs;
            }
        }
        impl<$($generics)*> std::ops::SubAssign for $type {
            #[inline]
            fn sub_assign(&mut self, rhs: Self) {
                *self = *self - rhs;
            }
        }
        impl<$($generics)*> std::ops::MulAssign for $type {
            #[inline]
            fn mul_assign(&mut self, rhs: Self) {
                *self = *self * rhs;
            }
        }
        impl<$($generics)*> std::ops::DivAssign for $type {
            #[inline]
            fn div_assign(&mut self, rhs: Self) {
                *self = *self / rhs;
            }
        }
        impl<$($generics)*> std::ops::Sub<f64> for $type {
            type Output = Self;
            #[inline]
            fn sub(self, rhs: f64) -> Self {
                self + (-rhs)
            }
        }
        impl<$($generics)*> std::ops::Add<$type> for f64 {
            type Output = $type;
            #[inline]
            fn add(self, rhs: $type) -> $type {
                rhs + self
            }
        }
        impl<$($generics)*> std::ops::Sub<$type> for f64 {
            type Output = $type;
            #[inline]
            fn sub(self, rhs: $type) -> $type {
                -rhs + self
            }
        }
        impl<$($generics)*> std::ops::Mul<$type> for f64 {
            type Output = $type;
            #[inline]
            fn mul(self, rhs: $type) -> $type {
                rhs * self
            }
        }
        impl<$($generics)*> std::ops::Div<$type> for f64 {
            type Output = $type;
            #[inline]
            fn div(self, rhs: $type) -> $type {
                <$type>::from(self) / rhs
            }
        }
    };
}
pub(crate) use derived_operators;
