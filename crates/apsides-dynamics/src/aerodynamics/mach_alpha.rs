//! Coefficients of axisymmetric bodies over Mach number and total angle of attack.
//!
//! Axial force is an even function of the total angle of attack, normal force and moment are odd ones. They are evaluated as functions of
//! the square of the angle, normal force and moment divided by the angle, so that nothing is singular in axial flow.

use std::cell::Cell;

use apsides_ad::{CubicSpline, Outside, Pchip, Scalar};

use super::apollo;
use crate::error::{finite_column, increasing, positive_column, short};
use crate::{DynamicsError, Quantity};

/// Mach number.
pub const MACH: Quantity = Quantity::new("Mach number", "-");
/// Angle between the axis of a body and the air.
pub const TOTAL_ATTACK: Quantity = Quantity::new("total angle of attack", "rad");

/// The interpolation of a table between its knots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// Two continuous derivatives: a cubic spline in the angle, even or odd about zero; in the Mach number, where data scatter, quintics
    /// with the slopes of [`Pchip`] and no curvature at the knots, which do not overshoot.
    #[default]
    Smooth,
    /// Straight lines in both variables, as simulations of the moving-mass problem have them: continuous, with kinks at the knots, and of the
    /// axial force one at angle zero.
    Linear,
}

/// A quantity that has left the range of a table.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{} is {value} {}, the table covers {} to {}", quantity.name, quantity.unit, range[0], range[1])]
pub struct RangeLeft {
    /// The quantity.
    pub quantity: Quantity,
    /// Its value.
    pub value: f64,
    /// Lowest and highest value of the table.
    pub range: [f64; 2],
}

/// Coefficients at one Mach number and total angle of attack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisymmetricCoefficients<S> {
    /// Axial force, towards the rear.
    pub axial: S,
    /// Normal force by the total angle of attack, 1/rad.
    pub normal_by_angle: S,
    /// Pitching moment about the point of reference by the total angle of attack, 1/rad; negative moments reduce the angle.
    pub moment_by_angle: S,
}

/// Terms of a cell in powers of the Mach number (rows) and of the angle (columns), both from the lower corner of the cell.
type Terms = [[f64; 4]; 6];
/// The same of straight lines.
type Lines = [[f64; 2]; 2];

/// Per interval of the Mach number, then of the angle: axial force, normal force, moment.
#[derive(Clone, Debug, PartialEq)]
enum Cells {
    Smooth(Vec<[Terms; 3]>),
    Straight(Vec<[Lines; 3]>),
}

/// Coefficients of an axisymmetric body as a table. Beyond an edge they are those at the edge; [`MachAlphaTable::range_left`] says when.
#[derive(Clone, Debug, PartialEq)]
pub struct MachAlphaTable {
    mach: Knots,
    attack: Knots,
    cells: Cells,
}

/// A place in the table.
#[derive(Clone, Copy)]
struct CellPoint {
    cell: usize,
    /// Mach number and angle from the lower corner of the cell.
    x: f64,
    y: f64,
    angle: f64,
    /// Says whether Mach number and angle are inside the table.
    inside: bool,
    covered: bool,
    /// Says whether the cell is at angle zero.
    first: bool,
}

/// A polynomial in the angle in one cell.
#[derive(Clone, Copy)]
struct Column {
    terms: [f64; 4],
    /// Says whether the square and the cube are absent.
    straight: bool,
    /// Angle from the lower end of the interval.
    y: f64,
    first: bool,
    /// Beyond the last angle.
    beyond: bool,
}

impl MachAlphaTable {
    /// A table with one row per Mach number and one column per total angle of attack (rad, from 0), at least four of each, both increasing:
    /// coefficients of axial force, normal force and moment, row after row.
    ///
    /// # Errors
    /// When a number is not finite, a Mach number or an axial force not positive, a Mach number or an angle not above the one before it, the
    /// first angle not zero, or a normal force or moment at angle zero not zero: names the quantity and the row, counted from 1.
    pub fn new(
        mach: &[f64],
        attack: &[f64],
        [axial, normal, moment]: [&[f64]; 3],
        interpolation: Interpolation,
    ) -> Result<Self, DynamicsError> {
        increasing(MACH.name, mach)?;
        positive_column(MACH.name, mach, mach.len())?;
        increasing(TOTAL_ATTACK.name, attack)?;
        let (rows, columns) = (mach.len(), attack.len());
        if rows.min(columns) < 4 {
            return Err(short("Mach number and total angle of attack", rows.min(columns), 4));
        }
        zero("first total angle of attack", attack[0], 0)?;
        positive_column("coefficient of axial force", axial, rows * columns)?;
        for (what, values) in [("coefficient of normal force", normal), ("coefficient of moment", moment)] {
            finite_column(what, values, rows * columns)?;
            for (row, values) in values.chunks(columns).enumerate() {
                zero(what, values[0], row)?;
            }
        }
        let cells = match interpolation {
            Interpolation::Linear => {
                Cells::Straight(together([axial, normal, moment].map(|values| linear(mach, attack, values))))
            }
            Interpolation::Smooth => Cells::Smooth(together(
                [(axial, 1.0), (normal, -1.0), (moment, -1.0)]
                    .map(|(values, parity)| smooth(mach, attack, values, parity)),
            )),
        };
        let (mach, attack) = (Knots::new(MACH.name, mach)?, Knots::new(TOTAL_ATTACK.name, attack)?);
        Ok(Self { mach, attack, cells })
    }

    /// The command module of Apollo, heat shield forward, Mach 0.4 to 9, up to 30 deg; moments about the aft point of reference on the axis.
    ///
    /// Data: polmes/aether (<https://github.com/polmes/aether>, MIT licence).
    #[must_use]
    #[expect(clippy::expect_used, reason = "invariant: the table of this module is complete and increases")]
    pub fn apollo(interpolation: Interpolation) -> Self {
        let attack = apollo::ATTACK_DEG.map(f64::to_radians);
        let [axial, normal, moment] =
            [&apollo::AXIAL, &apollo::NORMAL, &apollo::MOMENT].map(|t| t.as_flattened());
        Self::new(&apollo::MACH, &attack, [axial, normal, moment], interpolation)
            .expect("invariant: the table is complete and increases")
    }

    /// Mach numbers of the table.
    #[must_use]
    pub fn mach_knots(&self) -> &[f64] {
        &self.mach.at
    }

    /// Total angles of attack of the table, rad.
    ///
    /// # Examples
    /// ```
    /// use apsides_dynamics::aerodynamics::{Interpolation, MachAlphaTable};
    ///
    /// // 15 Mach numbers by 13 angles, to 30 deg.
    /// let table = MachAlphaTable::apollo(Interpolation::Linear);
    /// assert_eq!((table.mach_knots().len(), table.attack_knots().len()), (15, 13));
    /// assert_eq!(table.attack_knots()[12], 30_f64.to_radians());
    /// ```
    #[must_use]
    pub fn attack_knots(&self) -> &[f64] {
        &self.attack.at
    }

    /// Lowest and highest Mach number.
    #[must_use]
    pub fn mach_range(&self) -> [f64; 2] {
        self.mach.range()
    }

    /// Lowest and highest total angle of attack, rad.
    #[must_use]
    pub fn attack_range(&self) -> [f64; 2] {
        self.attack.range()
    }

    /// The range that a Mach number and a total angle of attack (rad) leave, if any; numbers that are not finite leave it.
    ///
    /// # Errors
    /// The quantity that has left the table.
    pub fn range_left(&self, mach: f64, attack: f64) -> Result<(), RangeLeft> {
        for (quantity, value, range) in
            [(MACH, mach, self.mach.range()), (TOTAL_ATTACK, attack, self.attack.range())]
        {
            if !(range[0]..=range[1]).contains(&value) {
                return Err(RangeLeft { quantity, value, range });
            }
        }
        Ok(())
    }

    /// Coefficients at a Mach number and the square of the total angle of attack (rad2).
    #[inline]
    pub fn coefficients<S: Scalar>(&self, mach: S, square: S) -> AxisymmetricCoefficients<S> {
        self.coefficients_at(mach, square, &Cell::new(None))
    }

    /// The same where the value of the angle is known when `square` is, which saves the wait for its root.
    #[inline(always)]
    pub(super) fn coefficients_at<S: Scalar>(
        &self,
        mach: S,
        square: S,
        angle: &Cell<Option<f64>>,
    ) -> AxisymmetricCoefficients<S> {
        let [axial, normal_by_angle, moment_by_angle] = mach.map2_all(square, |m, q| {
            let place = self.place(m, angle.get().unwrap_or_else(|| q.sqrt()));
            if S::ORDER == 0 {
                let [axial, normal, moment] = self.values(place);
                let alone = |value| [value, 0.0, 0.0, 0.0, 0.0, 0.0];
                return [alone(axial), alone(normal), alone(moment)];
            }
            [self.jet(0, place, even), self.jet(1, place, odd), self.jet(2, place, odd)]
        });
        AxisymmetricCoefficients { axial, normal_by_angle, moment_by_angle }
    }

    /// The cell of a Mach number and an angle.
    #[inline(always)]
    fn place(&self, mach: f64, angle: f64) -> CellPoint {
        let (i, x, inside) = self.mach.locate(mach);
        let (j, y, covered) = self.attack.locate(angle);
        CellPoint { cell: i * (self.attack.at.len() - 1) + j, x, y, angle, inside, covered, first: j == 0 }
    }

    /// Axial force, and normal force and moment by the angle.
    #[inline(always)]
    fn values(&self, place: CellPoint) -> [f64; 3] {
        let found = |axial: Column, normal: Column, moment: Column| {
            [axial.value(), normal.by_angle(place.angle), moment.by_angle(place.angle)]
        };
        match &self.cells {
            Cells::Straight(cells) => {
                let [axial, normal, moment] = &cells[place.cell];
                let line = |terms| place.line(line_at_mach(terms, place.x));
                found(line(axial), line(normal), line(moment))
            }
            Cells::Smooth(cells) => {
                let [axial, normal, moment] = &cells[place.cell];
                let cubic = |terms| place.cubic(at_mach(terms, place.x));
                found(cubic(axial), cubic(normal), cubic(moment))
            }
        }
    }

    /// A quantity of the table with its derivatives by Mach number and square of the angle; `by_square` makes of a polynomial in the angle
    /// the function of the square and its derivatives.
    #[inline(always)]
    fn jet(
        &self,
        quantity: usize,
        place: CellPoint,
        by_square: impl Fn(Column, f64) -> [f64; 3],
    ) -> [f64; 6] {
        let CellPoint { cell, x, angle, inside, .. } = place;
        match &self.cells {
            Cells::Straight(cells) => {
                let terms = &cells[cell][quantity];
                let column = |terms| by_square(place.line(terms), angle);
                let [value, by_q, by_qq] = column(line_at_mach(terms, x));
                let [by_m, by_mq, _] = if inside { column(terms[1]) } else { [0.0; 3] };
                [value, by_m, by_q, 0.0, by_mq, by_qq]
            }
            Cells::Smooth(cells) => {
                let terms = &cells[cell][quantity];
                let column = |terms| by_square(place.cubic(terms), angle);
                let [value, by_q, by_qq] = column(at_mach(terms, x));
                if !inside {
                    return [value, 0.0, by_q, 0.0, 0.0, by_qq];
                }
                let [by_m, by_mq, _] = column(slope(terms, x));
                let [by_mm, ..] = column(curvature(terms, x));
                [value, by_m, by_q, by_mm, by_mq, by_qq]
            }
        }
    }
}

impl CellPoint {
    /// A straight line over the interval of the angle.
    #[inline(always)]
    fn line(&self, [a, b]: [f64; 2]) -> Column {
        Column {
            terms: [a, b, 0.0, 0.0],
            straight: true,
            y: self.y,
            first: self.first,
            beyond: !self.covered,
        }
    }

    /// A cubic.
    #[inline(always)]
    fn cubic(&self, terms: [f64; 4]) -> Column {
        Column { terms, straight: false, y: self.y, first: self.first, beyond: !self.covered }
    }
}

impl Column {
    #[inline(always)]
    fn value(&self) -> f64 {
        let Self { terms: [a, b, c, d], y, .. } = self;
        let line = a + y * b;
        if self.straight { line } else { line + y * y * (c + y * d) }
    }

    /// The value by the angle of what is zero at angle zero.
    #[inline(always)]
    fn by_angle(&self, angle: f64) -> f64 {
        let Self { terms: [_, b, c, d], y, .. } = self;
        if !self.first {
            self.value() / angle
        } else if self.straight {
            *b
        } else {
            // No constant term: the angle divides the polynomial.
            b + y * (c + y * d)
        }
    }
}

/// Least angle, rad, at which the direction of the angle is told; below, what is not smooth at zero counts as flat.
const AXIAL_FLOW: f64 = 1e-8;

/// An even function of the angle by its square.
#[inline(always)]
fn even(column: Column, angle: f64) -> [f64; 3] {
    let Column { terms: [_, b, c, d], y, first, beyond, .. } = column;
    let value = column.value();
    if beyond {
        return [value, 0.0, 0.0];
    }
    if first {
        if angle < AXIAL_FLOW {
            return [value, c, 0.0];
        }
        let slope = b / (2.0 * angle) + c + 1.5 * d * angle;
        return [value, slope, (0.75 * d - b / (4.0 * angle * angle)) / angle];
    }
    let (by, byy) = (b + y * (2.0 * c + y * 3.0 * d), 2.0 * c + 6.0 * d * y);
    [value, by / (2.0 * angle), (byy - by / angle) / (4.0 * angle * angle)]
}

/// An odd function of the angle, divided by it, by its square.
#[inline(always)]
fn odd(column: Column, angle: f64) -> [f64; 3] {
    let Column { terms: [_, b, c, d], y, first, beyond, .. } = column;
    let value = column.by_angle(angle);
    if first {
        let kink = if angle < AXIAL_FLOW { 0.0 } else { c / (2.0 * angle) };
        let curve = if angle < AXIAL_FLOW { 0.0 } else { -kink / (2.0 * angle * angle) };
        return [value, kink + d, curve];
    }
    let (by, byy) =
        if beyond { (0.0, 0.0) } else { (b + y * (2.0 * c + y * 3.0 * d), 2.0 * c + 6.0 * d * y) };
    let slope = (by - value) / angle;
    let second = (byy - 2.0 * slope) / angle;
    [value, slope / (2.0 * angle), (second - slope / angle) / (4.0 * angle * angle)]
}

/// A line in the angle at a place in the Mach number.
#[inline(always)]
fn line_at_mach([[a, b], [c, d]]: &Lines, x: f64) -> [f64; 2] {
    [a + x * c, b + x * d]
}

/// Terms in the angle at a place in the Mach number; by pairs of powers, which wait less for each other than Horner's scheme.
#[inline(always)]
fn at_mach(terms: &Terms, x: f64) -> [f64; 4] {
    let xx = x * x;
    std::array::from_fn(|k| {
        let pair = |p: usize| terms[p][k] + x * terms[p + 1][k];
        pair(0) + xx * (pair(2) + xx * pair(4))
    })
}

/// Their derivative.
#[inline]
fn slope(terms: &Terms, x: f64) -> [f64; 4] {
    std::array::from_fn(|k| (1..6).rev().fold(0.0, |sum, p| sum * x + p as f64 * terms[p][k]))
}

/// Their second derivative.
#[inline]
fn curvature(terms: &Terms, x: f64) -> [f64; 4] {
    std::array::from_fn(|k| (2..6).rev().fold(0.0, |sum, p| sum * x + (p * (p - 1)) as f64 * terms[p][k]))
}

/// Increasing knots with the interval of a number by direct index.
#[derive(Clone, Debug, PartialEq)]
struct Knots {
    at: Vec<f64>,
    /// Per bin of equal width the interval at its lower end.
    bins: Vec<u32>,
    per_unit: f64,
}

/// Most bins of a set of knots.
const MOST_BINS: f64 = 65_536.0;

impl Knots {
    /// Increasing knots of a quantity.
    ///
    /// # Errors
    /// When two are closer than `1 / MOST_BINS` of their range.
    fn new(what: &'static str, at: &[f64]) -> Result<Self, DynamicsError> {
        let span = at[at.len() - 1] - at[0];
        let (row, narrowest) = at
            .windows(2)
            .enumerate()
            .map(|(k, w)| (k + 2, w[1] - w[0]))
            .fold((0, f64::INFINITY), |least, next| if next.1 < least.1 { next } else { least });
        // Narrower than the narrowest interval: never two knots in one bin.
        let count = (1.01 * span / narrowest).ceil();
        if count > MOST_BINS {
            let reason = format!("{} is too close to the row before for a range of {span}", at[row - 1]);
            return Err(DynamicsError::Table { what, row, reason });
        }
        let per_unit = count / span;
        let last = at.len() - 2;
        let bins = (0..=count as usize)
            .map(|bin| {
                let start = at[0] + bin as f64 / per_unit;
                at[1..=last].partition_point(|knot| *knot <= start) as u32
            })
            .collect();
        Ok(Self { at: at.into(), bins, per_unit })
    }

    fn range(&self) -> [f64; 2] {
        [self.at[0], self.at[self.at.len() - 1]]
    }

    /// The interval of a number, its place in the interval from the lower end, and whether it is inside; of numbers outside, those of the
    /// end, of what is no number those of the lower end.
    #[inline(always)]
    fn locate(&self, x: f64) -> (usize, f64, bool) {
        let [low, high] = self.range();
        let inside = x >= low && x <= high;
        // Not `max` and `min`, whose care for what is no number costs more than the rest.
        let held = if x > low { x } else { low };
        let held = if held < high { held } else { high };
        // Branches, which processors foresee along a flight. Angles are often in the first interval, for which nothing waits.
        let mut k = 0;
        if held >= self.at[1] {
            k = self.bins[((held - low) * self.per_unit) as u32 as usize] as usize;
            // The knot in the bin, and what rounding does at the ends of the bin.
            if held < self.at[k] {
                k -= 1;
            } else if k + 2 < self.at.len() && held >= self.at[k + 1] {
                k += 1;
            }
        }
        (k, held - self.at[k], inside)
    }
}

/// Refuses what is not zero.
fn zero(what: &'static str, value: f64, row: usize) -> Result<(), DynamicsError> {
    if value == 0.0 {
        return Ok(());
    }
    Err(DynamicsError::Table { what, row: row + 1, reason: format!("{value} is not 0 at angle zero") })
}

/// Straight lines in both variables.
fn linear(mach: &[f64], attack: &[f64], values: &[f64]) -> Vec<Lines> {
    let at = |i: usize, j: usize| values[i * attack.len() + j];
    cells(mach, attack, |i, j| {
        let (dm, da) = (mach[i + 1] - mach[i], attack[j + 1] - attack[j]);
        let (low, high) = ((at(i, j + 1) - at(i, j)) / da, (at(i + 1, j + 1) - at(i + 1, j)) / da);
        [[at(i, j), low], [(at(i + 1, j) - at(i, j)) / dm, (high - low) / dm]]
    })
}

/// Quintics in the Mach number, of which a spline in the angle is made; `parity` is 1 of even and -1 of odd functions.
fn smooth(mach: &[f64], attack: &[f64], values: &[f64], parity: f64) -> Vec<Terms> {
    let columns = attack.len();
    let mirrored: Vec<f64> = attack[1..].iter().rev().map(|a| -a).chain(attack.iter().copied()).collect();
    // Terms in the Mach number per interval and column of the table.
    let mut in_mach = vec![[0.0; 6]; (mach.len() - 1) * columns];
    for j in 0..columns {
        let column: Vec<f64> = values.iter().skip(j).step_by(columns).copied().collect();
        for (i, terms) in quintics(mach, &column).into_iter().enumerate() {
            in_mach[i * columns + j] = terms;
        }
    }
    // The spline is linear in its values: it may be made of each term.
    let splines: Vec<Option<CubicSpline>> = (0..(mach.len() - 1) * 6)
        .map(|k| {
            let row = &in_mach[k / 6 * columns..][..columns];
            let half = row.iter().map(|terms| terms[k % 6]);
            let values: Vec<f64> = half.clone().skip(1).rev().map(|v| parity * v).chain(half).collect();
            CubicSpline::new(&mirrored, &values).ok()
        })
        .collect();
    cells(mach, attack, |i, j| {
        let (low, high) = (attack[j], attack[j + 1]);
        std::array::from_fn(|p| {
            let Some(spline) = &splines[i * 6 + p] else { return [0.0; 4] };
            let ([a, b, c], [.., end]) = (spline.derivatives(low), spline.derivatives(high));
            let mut terms = [a, b, 0.5 * c, (end - c) / (6.0 * (high - low))];
            if j == 0 {
                // Exactly what the symmetry says.
                let absent: &[usize] = if parity > 0.0 { &[1] } else { &[0, 2] };
                absent.iter().for_each(|k| terms[*k] = 0.0);
            }
            terms
        })
    })
}

/// Terms of the quintics with the slopes of a shape-preserving cubic and no curvature at the knots.
fn quintics(knots: &[f64], values: &[f64]) -> Vec<[f64; 6]> {
    let slopes = Pchip::new(knots, values, Outside::Constant);
    let slope = |x: f64| slopes.as_ref().map_or(0.0, |table| table.derivatives(x)[1]);
    (0..knots.len() - 1)
        .map(|k| {
            let h = knots[k + 1] - knots[k];
            let (rise, a, b) = ((values[k + 1] - values[k]) / h, slope(knots[k]), slope(knots[k + 1]));
            // Value, slope and curvature at both ends (E. Hermite's conditions).
            let [c3, c4, c5] = [
                10.0 * rise - 6.0 * a - 4.0 * b,
                -15.0 * rise + 8.0 * a + 7.0 * b,
                6.0 * rise - 3.0 * a - 3.0 * b,
            ];
            [values[k], a, 0.0, c3 / h.powi(2), c4 / h.powi(3), c5 / h.powi(4)]
        })
        .collect()
}

/// Terms per cell.
fn cells<T>(mach: &[f64], attack: &[f64], terms: impl Fn(usize, usize) -> T) -> Vec<T> {
    let columns = attack.len() - 1;
    (0..(mach.len() - 1) * columns).map(|k| terms(k / columns, k % columns)).collect()
}

/// Three quantities per cell, of tables of one each.
fn together<T: Copy>([axial, normal, moment]: [Vec<T>; 3]) -> Vec<[T; 3]> {
    axial.into_iter().zip(normal).zip(moment).map(|((a, n), m)| [a, n, m]).collect()
}

#[cfg(test)]
mod tests;
