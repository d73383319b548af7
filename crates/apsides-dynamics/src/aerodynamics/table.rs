//! Coefficients as tables.

use apsides_ad::{BicubicSpline, Outside, Pchip, Scalar};

use crate::DynamicsError;
use crate::error::{finite_column, increasing, positive_column, short};

/// Coefficients of lift and drag over the Mach number: [shape-preserving cubics](Pchip) in its logarithm, constant beyond the ends, which
/// they reach with slope zero.
#[derive(Clone, Debug, PartialEq)]
pub struct MachTable {
    lowest: f64,
    lift: Pchip,
    drag: Pchip,
}

/// Apollo 10 in trim: Mach number, angle of attack (deg), coefficients of lift and drag.
const APOLLO_10: [[f64; 4]; 14] = [
    [0.2, 170.95, 0.2317, 0.82584],
    [0.4, 167.63, 0.23412, 0.85478],
    [0.7, 165.01, 0.25619, 0.98912],
    [0.9, 162.33, 0.3118, 1.07015],
    [1.1, 155.72, 0.4805, 1.17974],
    [1.2, 155.87, 0.4669, 1.16503],
    [1.35, 154.73, 0.54953, 1.28744],
    [1.65, 153.92, 0.54084, 1.2744],
    [2.0, 153.98, 0.52572, 1.28613],
    [2.4, 154.42, 0.49986, 1.25612],
    [3.0, 154.87, 0.47174, 1.23227],
    [4.0, 156.77, 0.43414, 1.22682],
    [10.0, 157.4, 0.42155, 1.23698],
    [29.5, 160.7, 0.379, 1.30136],
];

impl MachTable {
    /// Coefficients of lift and drag at Mach numbers that increase, at least two.
    ///
    /// # Errors
    /// When a number is not finite, a Mach number or drag not positive, or a Mach number not above the one before it: names the quantity
    /// and the row, counted from 1. When the columns differ in length or have fewer than two rows.
    pub fn new(mach: &[f64], lift: &[f64], drag: &[f64]) -> Result<Self, DynamicsError> {
        let logarithms = logarithms(mach)?;
        finite_column("coefficient of lift", lift, mach.len())?;
        positive_column("coefficient of drag", drag, mach.len())?;
        let &[first, .., last] = &logarithms[..] else { return Err(short(MACH, mach.len(), 2)) };
        // End rows once more: the slope at the ends becomes that of the constants beyond.
        let knots = repeated_ends(&logarithms, [first - 1.0, last + 1.0]);
        let table = |values: &[f64]| {
            let padded = repeated_ends(values, [values[0], values[values.len() - 1]]);
            Pchip::new(&knots, &padded, Outside::Constant).map_err(|_| short(MACH, mach.len(), 2))
        };
        Ok(Self { lowest: mach[0], lift: table(lift)?, drag: table(drag)? })
    }

    /// The trim coefficients of the command module of Apollo 10, referred to its base of 3.9116 m diameter (NASA MSC Internal Note
    /// 69-FM-137, table I(d)).
    #[must_use]
    #[expect(
        clippy::expect_used,
        reason = "invariant: the Mach numbers of the table of this module increase"
    )]
    pub fn apollo_10() -> Self {
        let column = |k: usize| APOLLO_10.map(|row| row[k]);
        Self::new(&column(0), &column(2), &column(3))
            .expect("invariant: the Mach numbers of the table increase")
    }

    /// Angle of attack, rad, between the axis of Apollo 10 and the air in its trim: row by row, with the Mach number.
    ///
    /// # Examples
    /// ```
    /// use apsides_dynamics::aerodynamics::MachTable;
    ///
    /// // At Mach 10 the axis is 157.4 deg from the air, so that the heat shield is at 22.6 deg, and the lift is a third of the drag.
    /// let [mach, attack] = MachTable::apollo_10_attack()[12];
    /// assert_eq!(mach, 10.0);
    /// assert!((180.0 - attack.to_degrees() - 22.6).abs() < 1e-12);
    /// let [lift, drag] = MachTable::apollo_10().coefficients(mach);
    /// assert!((lift / drag - 0.341).abs() < 5e-4);
    /// ```
    #[must_use]
    pub fn apollo_10_attack() -> [[f64; 2]; 14] {
        APOLLO_10.map(|[mach, attack, ..]| [mach, attack.to_radians()])
    }

    /// Coefficients of lift and drag.
    #[inline]
    pub fn coefficients<S: Scalar>(&self, mach: S) -> [S; 2] {
        let x = mach.map(|m| within(m, [self.lowest, f64::INFINITY], LOGARITHM));
        [self.lift.at(x), self.drag.at(x)]
    }
}

/// Coefficients of lift and drag over Mach number and angle of attack: cubic splines in the logarithm of the Mach number and in the angle,
/// with two continuous derivatives. Beyond an edge, the value at the edge.
#[derive(Clone, Debug, PartialEq)]
pub struct AttackTable {
    mach: [f64; 2],
    attack: [f64; 2],
    lift: BicubicSpline,
    drag: BicubicSpline,
}

impl AttackTable {
    /// Coefficients with one row per Mach number and one column per angle of attack (rad), at least four of each, both increasing.
    ///
    /// # Errors
    /// As [`MachTable::new`]; coefficients are counted row after row.
    pub fn new(mach: &[f64], attack: &[f64], lift: &[f64], drag: &[f64]) -> Result<Self, DynamicsError> {
        let logarithms = logarithms(mach)?;
        increasing("angle of attack", attack)?;
        finite_column("coefficient of lift", lift, mach.len() * attack.len())?;
        positive_column("coefficient of drag", drag, mach.len() * attack.len())?;
        let table = |values: &[f64]| {
            BicubicSpline::new(&logarithms, attack, values)
                .map_err(|_| short("Mach number and angle of attack", mach.len().min(attack.len()), 4))
        };
        let ends = |column: &[f64]| [column[0], column[column.len() - 1]];
        Ok(Self { mach: ends(mach), attack: ends(attack), lift: table(lift)?, drag: table(drag)? })
    }

    /// Coefficients of lift and drag at a Mach number and an angle of attack (rad).
    #[inline]
    pub fn coefficients<S: Scalar>(&self, mach: S, attack: S) -> [S; 2] {
        let x = mach.map(|m| within(m, self.mach, LOGARITHM));
        let y = attack.map(|a| within(a, self.attack, |a| [a, 1.0, 0.0]));
        [self.lift.at(x, y), self.drag.at(x, y)]
    }
}

/// The values between two more.
fn repeated_ends(values: &[f64], [before, after]: [f64; 2]) -> Vec<f64> {
    std::iter::once(before).chain(values.iter().copied()).chain(std::iter::once(after)).collect()
}

/// The natural logarithm with its derivatives.
const LOGARITHM: fn(f64) -> [f64; 3] = |x| [x.ln(), 1.0 / x, -1.0 / (x * x)];

/// A function with its derivatives between two ends, constant beyond.
#[inline]
fn within(x: f64, [low, high]: [f64; 2], g: impl Fn(f64) -> [f64; 3]) -> [f64; 3] {
    if x < low {
        [g(low)[0], 0.0, 0.0]
    } else if x > high {
        [g(high)[0], 0.0, 0.0]
    } else {
        g(x)
    }
}

const MACH: &str = "Mach number";

/// Logarithms of Mach numbers.
fn logarithms(mach: &[f64]) -> Result<Vec<f64>, DynamicsError> {
    increasing(MACH, mach)?;
    positive_column(MACH, mach, mach.len())?;
    Ok(mach.iter().map(|m| m.ln()).collect())
}
