//! Formulas built operation by operation, for models that are not written in Rust.
//!
//! ```
//! use apsides_ad::{CubicSpline, FormulaBuilder, formula_node};
//!
//! // The density (kg/m3) of a table up to 3 km, and drag by the square of the speed against the motion; altitude (km), speed (m/s).
//! let mut b = FormulaBuilder::new(2);
//! let [altitude, speed] = [0, 1].map(|k| b.input(k));
//! let table = b.table(CubicSpline::new(&[0.0, 1.0, 2.0, 3.0], &[1.225, 1.112, 1.007, 0.909])?);
//! let top = b.constant(3.0);
//! let inside = b.min(altitude, top);
//! let density = b.curve(table, inside);
//! let size = b.abs(speed);
//! let (square, half) = (b.mul(size, speed), b.constant(-0.5));
//! let pressure = b.mul(square, half);
//! let drag = b.mul(pressure, density);
//! let formula = b.formula(&[drag])?;
//!
//! let kinks: Vec<_> = formula.kinks().iter().map(|kink| kink.input).collect();
//! assert_eq!(kinks, [Some((0, 3.0)), Some((1, 0.0))]);
//! let (mut out, mut jacobian) = ([0.0], [0.0; 2]);
//! formula_node(formula).jacobian(&[5.0, -10.0], &mut out, &mut jacobian);
//! assert_eq!((out, jacobian), ([50.0 * 0.909], [0.0, -10.0 * 0.909]));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::error::AdError;
use crate::formula::{Binary, Formula, MAX_VALUES, Operation, Unary};
use crate::table::Table;
use crate::tape::Tape;

/// A value of a [`FormulaBuilder`]: a small handle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Value {
    place: u32,
    owner: u32,
}

/// Builds [`Formula`]s over common inputs.
///
/// Equal operations are kept once. Functions of constants are constants. Sums with zero, differences of a value with itself, products with zero and one, quotients by one,
/// opposites of opposites and powers with exponents 0, 1 and 2 are simplified, which is exact for finite numbers but for the sign of a
/// zero.
///
/// A mistake, such as a handle of another builder, is kept and returned by [`formula`](Self::formula), so that expressions can be nested;
/// [`error`](Self::error) tells at once.
#[derive(Debug)]
pub struct FormulaBuilder {
    tape: Tape,
    owner: u32,
    error: Option<AdError>,
}

/// Builders so far: handles know theirs.
static BUILDERS: AtomicU32 = AtomicU32::new(0);

/// Functions with one operand, by their variant.
macro_rules! unary {
    ($($(#[$doc:meta])* $name:ident $variant:ident;)*) => {$(
        $(#[$doc])*
        pub fn $name(&mut self, x: Value) -> Value {
            self.unary(Unary::$variant, x)
        }
    )*};
}

/// Functions with two operands, by their variant.
macro_rules! binary {
    ($($(#[$doc:meta])* $name:ident $variant:ident;)*) => {$(
        $(#[$doc])*
        pub fn $name(&mut self, x: Value, y: Value) -> Value {
            self.binary(Binary::$variant, x, y)
        }
    )*};
}

impl FormulaBuilder {
    /// A builder of formulas with a number of inputs.
    #[must_use]
    pub fn new(inputs: usize) -> Self {
        let owner = BUILDERS.fetch_add(1, Ordering::Relaxed);
        let (inputs, error) = if inputs < MAX_VALUES { (inputs, None) } else { (0, Some(AdError::TooLarge)) };
        Self { tape: Tape::new(inputs), owner, error }
    }

    /// Number of inputs.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.tape.inputs()
    }

    /// The first mistake so far.
    #[must_use]
    pub fn error(&self) -> Option<AdError> {
        self.error
    }

    /// An input.
    pub fn input(&mut self, index: usize) -> Value {
        let inputs = self.inputs();
        if index < inputs { self.handle(index) } else { self.refuse(AdError::Input { index, inputs }) }
    }

    /// A number; it may be infinite.
    pub fn constant(&mut self, number: f64) -> Value {
        self.push(Operation::Constant(number))
    }

    /// The number that a value is, if it does not depend on inputs.
    #[must_use]
    pub fn number(&self, value: Value) -> Option<f64> {
        match self.tape.operation(self.place(value)?)? {
            Operation::Constant(c) => Some(c),
            _ => None,
        }
    }

    unary! {
        /// Opposite number.
        neg Neg;
        /// Sine (argument in rad).
        sin Sin;
        /// Cosine (argument in rad).
        cos Cos;
        /// Tangent (argument in rad).
        tan Tan;
        /// Arc sine, in rad.
        asin Asin;
        /// Arc cosine, in rad.
        acos Acos;
        /// Arc tangent, in rad.
        atan Atan;
        /// Square root.
        sqrt Sqrt;
        /// Cube root.
        cbrt Cbrt;
        /// Exponential.
        exp Exp;
        /// Natural logarithm.
        ln Ln;
        /// Hyperbolic sine.
        sinh Sinh;
        /// Hyperbolic cosine.
        cosh Cosh;
        /// Hyperbolic tangent.
        tanh Tanh;
        /// Inverse hyperbolic sine.
        asinh Asinh;
        /// Inverse hyperbolic cosine.
        acosh Acosh;
        /// Inverse hyperbolic tangent.
        atanh Atanh;
        /// Reciprocal.
        recip Recip;
        /// Absolute value; a kink at zero.
        abs Abs;
        /// Sign: -1, 0 or 1; a jump at zero.
        sign Sign;
    }

    binary! {
        /// Sum.
        add Add;
        /// Difference.
        sub Sub;
        /// Product.
        mul Mul;
        /// Quotient.
        div Div;
        /// Angle of the point (`y`, `x`), in that order of names, in (-pi, pi]; the first operand is the ordinate.
        atan2 Atan2;
        /// The smaller of two values, the first where they are equal; a kink there.
        min Min;
        /// The larger of two values, the first where they are equal; a kink there.
        max Max;
    }

    /// Decimal logarithm.
    pub fn log10(&mut self, x: Value) -> Value {
        let (ln, ten) = (self.ln(x), self.constant(std::f64::consts::LN_10));
        self.div(ln, ten)
    }

    /// Binary logarithm.
    pub fn log2(&mut self, x: Value) -> Value {
        let (ln, two) = (self.ln(x), self.constant(std::f64::consts::LN_2));
        self.div(ln, two)
    }

    /// Square.
    pub fn square(&mut self, x: Value) -> Value {
        self.mul(x, x)
    }

    /// Square root of the sum of squares.
    pub fn hypot(&mut self, x: Value, y: Value) -> Value {
        let (a, b) = (self.square(x), self.square(y));
        let sum = self.add(a, b);
        self.sqrt(sum)
    }

    /// Integer power.
    pub fn powi(&mut self, x: Value, n: i32) -> Value {
        match n {
            0 => self.constant(1.0),
            1 => self.checked(x),
            2 => self.square(x),
            -1 => self.recip(x),
            _ => self.of_one(Operation::Powi(self.known(x), n), x),
        }
    }

    /// Power with a constant exponent; an integer one is taken as such.
    pub fn powf(&mut self, x: Value, exponent: f64) -> Value {
        let integer = exponent as i32;
        if f64::from(integer) == exponent && integer.abs() <= 1024 {
            self.powi(x, integer)
        } else if exponent == 0.5 {
            self.sqrt(x)
        } else {
            self.of_one(Operation::Powf(self.known(x), exponent), x)
        }
    }

    /// Power. Where the exponent depends on inputs, the base must not be negative, and at a base of zero the exponent must be positive.
    pub fn pow(&mut self, x: Value, exponent: Value) -> Value {
        match (self.number(x), self.number(exponent)) {
            (_, Some(n)) => self.powf(x, n),
            _ => self.binary(Binary::Pow, x, exponent),
        }
    }

    /// `a` where the condition is at least zero, else `b`; a jump where the condition is zero. What is not chosen may be anything, also
    /// not a number.
    pub fn select(&mut self, condition: Value, a: Value, b: Value) -> Value {
        if !self.own(&[condition, a, b]) {
            return self.checked(condition);
        }
        match self.number(condition) {
            Some(c) if c >= 0.0 => a,
            Some(_) => b,
            None if a == b => a,
            None => {
                self.push(Operation::Select(condition.place as usize, a.place as usize, b.place as usize))
            }
        }
    }

    /// Smooth absolute value `sqrt(x^2 + width^2)`, with `width` in the unit of `x`: too large by `width` at zero, and by
    /// `width^2 / (2 |x|)` far from it.
    pub fn smooth_abs(&mut self, x: Value, width: f64) -> Value {
        let width = self.width(width);
        self.hypot(x, width)
    }

    /// Smooth maximum `(a + b + smooth_abs(a - b)) / 2`: too large by half the width where both are equal.
    ///
    /// # Examples
    /// ```
    /// use apsides_ad::{FormulaBuilder, formula_node};
    ///
    /// // A throttle between a tenth and one, without kinks.
    /// let mut b = FormulaBuilder::new(1);
    /// let (x, least, most) = (b.input(0), b.constant(0.1), b.constant(1.0));
    /// let raised = b.smooth_max(x, least, 1e-3);
    /// let held = b.smooth_min(raised, most, 1e-3);
    /// let node = formula_node(b.formula(&[held])?);
    ///
    /// let mut held = [0.0; 3];
    /// node.values(3, &[-5.0, 0.5, 7.0], &mut held);
    /// assert!(held.iter().zip([0.1, 0.5, 1.0]).all(|(found, expected)| (found - expected).abs() < 1e-5));
    /// # Ok::<(), apsides_ad::AdError>(())
    /// ```
    pub fn smooth_max(&mut self, a: Value, b: Value, width: f64) -> Value {
        let (sum, difference) = (self.add(a, b), self.sub(a, b));
        let distance = self.smooth_abs(difference, width);
        let (twice, half) = (self.add(sum, distance), self.constant(0.5));
        self.mul(twice, half)
    }

    /// Smooth minimum `(a + b - smooth_abs(a - b)) / 2`: too small by half the width where both are equal.
    ///
    /// # Examples
    /// ```
    /// use apsides_ad::{FormulaBuilder, formula_node};
    ///
    /// let mut b = FormulaBuilder::new(2);
    /// let [x, y] = [0, 1].map(|k| b.input(k));
    /// let least = b.smooth_min(x, y, 0.2);
    /// let node = formula_node(b.formula(&[least])?);
    ///
    /// // Half the width too small where both are equal.
    /// let mut least = [0.0];
    /// node.values(1, &[3.0, 3.0], &mut least);
    /// assert!((least[0] - 2.9).abs() < 1e-15);
    /// # Ok::<(), apsides_ad::AdError>(())
    /// ```
    pub fn smooth_min(&mut self, a: Value, b: Value, width: f64) -> Value {
        let (sum, difference) = (self.add(a, b), self.sub(a, b));
        let distance = self.smooth_abs(difference, width);
        let (twice, half) = (self.sub(sum, distance), self.constant(0.5));
        self.mul(twice, half)
    }

    /// Smooth step `(1 + tanh(x / width)) / 2` from zero to one, with `width` in the unit of `x`: 0.12 at `-width`, 0.88 at `width`.
    pub fn smooth_step(&mut self, x: Value, width: f64) -> Value {
        let (width, half) = (self.width(width), self.constant(0.5));
        let scaled = self.div(x, width);
        let (tanh, one) = (self.tanh(scaled), self.constant(1.0));
        let twice = self.add(tanh, one);
        self.mul(twice, half)
    }

    /// `a` for large `x` and `b` for small `x`, with a [smooth step](Self::smooth_step) between.
    ///
    /// # Examples
    /// ```
    /// use apsides_ad::{FormulaBuilder, formula_node};
    ///
    /// // The drag coefficient rises from 0.3 to 0.5 at Mach 1.
    /// let mut b = FormulaBuilder::new(1);
    /// let (mach, one) = (b.input(0), b.constant(1.0));
    /// let beyond = b.sub(mach, one);
    /// let (supersonic, subsonic) = (b.constant(0.5), b.constant(0.3));
    /// let drag = b.smooth_select(beyond, supersonic, subsonic, 0.02);
    /// let node = formula_node(b.formula(&[drag])?);
    ///
    /// let mut drag = [0.0; 3];
    /// node.values(3, &[0.5, 1.0, 2.0], &mut drag);
    /// assert!(drag.iter().zip([0.3, 0.4, 0.5]).all(|(found, expected)| (found - expected).abs() < 1e-12));
    /// # Ok::<(), apsides_ad::AdError>(())
    /// ```
    pub fn smooth_select(&mut self, x: Value, a: Value, b: Value, width: f64) -> Value {
        let (step, difference) = (self.smooth_step(x, width), self.sub(a, b));
        let part = self.mul(step, difference);
        self.add(b, part)
    }

    /// Keeps a table, and returns its index. Equal tables are kept once.
    pub fn table(&mut self, table: impl Into<Table>) -> usize {
        self.tape.table(Arc::new(table.into()))
    }

    /// The value of a table of one variable, by its index.
    pub fn curve(&mut self, table: usize, x: Value) -> Value {
        if self.has_table(table, 1) {
            self.of_one(Operation::Curve(table, self.known(x)), x)
        } else {
            self.checked(x)
        }
    }

    /// The value of a table of two variables, by its index.
    pub fn surface(&mut self, table: usize, x: Value, y: Value) -> Value {
        if !self.has_table(table, 2) || !self.own(&[x, y]) {
            return self.checked(x);
        }
        self.push(Operation::Surface(table, x.place as usize, y.place as usize))
    }

    /// A function of one value.
    pub fn unary(&mut self, function: Unary, x: Value) -> Value {
        match (function, self.operation(x)) {
            (Unary::Neg, Some(Operation::Unary(Unary::Neg, y))) => self.handle(y),
            _ => self.of_one(Operation::Unary(function, self.known(x)), x),
        }
    }

    /// A function of two values.
    pub fn binary(&mut self, function: Binary, x: Value, y: Value) -> Value {
        if !self.own(&[x, y]) {
            return self.checked(x);
        }
        if let Some(simpler) = self.simpler(function, x, y) {
            return simpler;
        }
        let (mut a, mut b) = (x.place as usize, y.place as usize);
        if matches!(function, Binary::Add | Binary::Mul) && b < a {
            (a, b) = (b, a);
        }
        self.push(Operation::Binary(function, a, b))
    }

    /// The formula of some values, without what they do not need. Several formulas may come from one builder.
    ///
    /// # Errors
    /// The first mistake, or an output that belongs to another builder.
    pub fn formula(&self, outputs: &[Value]) -> Result<Formula, AdError> {
        if let Some(error) = self.error {
            return Err(error);
        }
        let places: Option<Vec<usize>> = outputs.iter().map(|&v| self.place(v)).collect();
        Ok(self.tape.formula(&places.ok_or(AdError::Foreign)?))
    }

    fn handle(&self, place: usize) -> Value {
        Value { place: place as u32, owner: self.owner }
    }

    fn place(&self, value: Value) -> Option<usize> {
        (value.owner == self.owner).then_some(value.place as usize)
    }

    /// Place of a value that is checked before its operation is kept.
    fn known(&self, value: Value) -> usize {
        value.place as usize
    }

    fn operation(&self, value: Value) -> Option<Operation> {
        self.tape.operation(self.place(value)?)
    }

    /// Keeps a mistake; what follows from it is never returned.
    fn refuse(&mut self, error: AdError) -> Value {
        self.error.get_or_insert(error);
        self.handle(0)
    }

    /// Checks that values belong to this builder.
    fn own(&mut self, values: &[Value]) -> bool {
        let own = values.iter().all(|v| v.owner == self.owner);
        if !own {
            self.refuse(AdError::Foreign);
        }
        own
    }

    fn checked(&mut self, value: Value) -> Value {
        if self.own(&[value]) { value } else { self.handle(0) }
    }

    fn has_table(&mut self, table: usize, variables: usize) -> bool {
        let known = self.tape.tables().get(table).is_some_and(|t| t.variables() == variables);
        if !known {
            let operation = self.tape.values() - self.inputs();
            self.refuse(AdError::Table { operation, table });
        }
        known
    }

    fn width(&mut self, width: f64) -> Value {
        if !(width > 0.0 && width.is_finite()) {
            return self.refuse(AdError::Width);
        }
        self.constant(width)
    }

    fn of_one(&mut self, operation: Operation, x: Value) -> Value {
        if self.own(&[x]) { self.push(operation) } else { self.handle(0) }
    }

    /// Keeps an operation on values of this builder.
    fn push(&mut self, operation: Operation) -> Value {
        // After a mistake handles lead anywhere.
        if self.error.is_some() {
            return self.handle(0);
        }
        let number = |k: usize| match self.tape.operation(k) {
            Some(Operation::Constant(c)) => Some(c),
            _ => None,
        };
        let constant = operation.operands().all(|k| number(k).is_some());
        let operation = if constant {
            let result = operation.apply(|k| number(k).unwrap_or(f64::NAN), self.tape.tables());
            if result.is_nan() {
                let operation = self.tape.values() - self.inputs();
                return self.refuse(AdError::NotANumber { operation });
            }
            Operation::Constant(result)
        } else if let Operation::Powf(_, n) = operation
            && n.is_nan()
        {
            let operation = self.tape.values() - self.inputs();
            return self.refuse(AdError::NotANumber { operation });
        } else {
            operation
        };
        if self.tape.values() >= MAX_VALUES {
            return self.refuse(AdError::TooLarge);
        }
        let place = self.tape.push(operation);
        self.handle(place)
    }

    /// A value that an operation on two values of this builder is equal to for finite numbers.
    fn simpler(&mut self, function: Binary, x: Value, y: Value) -> Option<Value> {
        let opposite = |v: Value| match self.operation(v) {
            Some(Operation::Unary(Unary::Neg, w)) => Some(self.handle(w)),
            _ => None,
        };
        let (of_x, of_y) = (opposite(x), opposite(y));
        let (a, b) = (self.number(x), self.number(y));
        if a.is_some() && b.is_some() {
            return None;
        }
        Some(match (function, a, b) {
            (Binary::Add, _, Some(0.0)) | (Binary::Sub, _, Some(0.0)) => x,
            (Binary::Add, Some(0.0), _) => y,
            (Binary::Sub, Some(0.0), _) => self.neg(y),
            (Binary::Add, _, _) if of_y.is_some() => self.sub(x, of_y?),
            (Binary::Add, _, _) if of_x.is_some() => self.sub(y, of_x?),
            (Binary::Sub, _, _) if of_y.is_some() => self.add(x, of_y?),
            (Binary::Mul | Binary::Div, _, Some(1.0)) => x,
            (Binary::Mul, Some(1.0), _) => y,
            (Binary::Mul | Binary::Div, _, Some(-1.0)) => self.neg(x),
            (Binary::Mul, Some(-1.0), _) => self.neg(y),
            (Binary::Mul, _, Some(0.0)) | (Binary::Mul | Binary::Div, Some(0.0), _) => self.constant(0.0),
            (Binary::Div, Some(1.0), _) => self.recip(y),
            (Binary::Min | Binary::Max, _, _) if x == y => x,
            (Binary::Sub, _, _) if x == y => self.constant(0.0),
            _ => return None,
        })
    }
}
