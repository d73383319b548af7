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

/// What a table is between its knots.
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

/// Coefficients of an axisymmetric body as a table. Beyond an edge they are those at the edge; [`MachAlphaTable::range_left`] says when.
#[derive(Clone, Debug, PartialEq)]
pub struct MachAlphaTable {
    mach: Knots,
    attack: Knots,
    /// Per interval of the Mach number, then of the angle: axial force, normal force, moment.
    cells: Vec<[Terms; 3]>,
    /// Whether all terms beyond the first powers are zero.
    straight: bool,
}

/// A place in the table.
#[derive(Clone, Copy)]
struct Place {
    cell: usize,
    /// Mach number and angle from the lower corner of the cell.
    x: f64,
    y: f64,
    angle: f64,
    /// Whether Mach number and angle are inside the table.
    inside: bool,
    covered: bool,
    /// Whether the cell is at angle zero.
    first: bool,
}

/// A polynomial in the angle in one cell.
#[derive(Clone, Copy)]
struct Column {
    terms: [f64; 4],
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
        let table = |values: &[f64], parity| match interpolation {
            Interpolation::Linear => linear(mach, attack, values),
            Interpolation::Smooth => smooth(mach, attack, values, parity),
        };
        let tables = [table(axial, 1.0), table(normal, -1.0), table(moment, -1.0)];
        let cells =
            (0..tables[0].len()).map(|k| [tables[0][k], tables[1][k], tables[2][k]]).collect::<Vec<_>>();
        let (mach, attack) = (Knots::new(MACH.name, mach)?, Knots::new(TOTAL_ATTACK.name, attack)?);
        Ok(Self { mach, attack, cells, straight: interpolation == Interpolation::Linear })
    }

    /// The command module of Apollo, heat shield forward, Mach 0.4 to 9, up to 30 deg; moments about the aft point of reference on the axis.
    ///
    /// Data: polmes/aether (<https://github.com/polmes/aether>, MIT licence).
    #[must_use]
    pub fn apollo(interpolation: Interpolation) -> Self {
        let attack = apollo::ATTACK_DEG.map(f64::to_radians);
        let [axial, normal, moment] =
            [&apollo::AXIAL, &apollo::NORMAL, &apollo::MOMENT].map(|t| t.as_flattened());
        Self::new(&apollo::MACH, &attack, [axial, normal, moment], interpolation)
            .expect("the table is complete and increases")
    }

    /// Mach numbers of the table.
    #[must_use]
    pub fn mach_knots(&self) -> &[f64] {
        &self.mach.at
    }

    /// Total angles of attack of the table, rad.
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
        // All three are at one place: it is found once.
        let found = Cell::new(None);
        let place = |m: f64, q: f64| {
            let place = found.get().unwrap_or_else(|| self.place(m, q));
            found.set(Some(place));
            place
        };
        AxisymmetricCoefficients {
            axial: mach.map2(square, |m, q| self.jet(0, place(m, q), even)),
            normal_by_angle: mach.map2(square, |m, q| self.jet(1, place(m, q), odd)),
            moment_by_angle: mach.map2(square, |m, q| self.jet(2, place(m, q), odd)),
        }
    }

    /// The cell of a Mach number and a square of the angle.
    #[inline(always)]
    fn place(&self, mach: f64, square: f64) -> Place {
        let angle = square.sqrt();
        let (i, x, inside) = self.mach.locate(mach);
        let (j, y, covered) = self.attack.locate(angle);
        Place { cell: i * (self.attack.at.len() - 1) + j, x, y, angle, inside, covered, first: j == 0 }
    }

    /// A quantity of the table with its derivatives by Mach number and square of the angle; `by_square` makes of a polynomial in the angle
    /// the function of the square and its derivatives.
    #[inline(always)]
    fn jet(
        &self,
        quantity: usize,
        Place { cell, x, y, angle, inside, covered, first }: Place,
        by_square: impl Fn(Column, f64) -> [f64; 3],
    ) -> [f64; 6] {
        let terms = &self.cells[cell][quantity];
        let column = |terms| by_square(Column { terms, y, first, beyond: !covered }, angle);
        let [value, by_q, by_qq] = column(if self.straight {
            [terms[0][0] + x * terms[1][0], terms[0][1] + x * terms[1][1], 0.0, 0.0]
        } else {
            at_mach(terms, x)
        });
        if !inside {
            return [value, 0.0, by_q, 0.0, 0.0, by_qq];
        }
        let [by_m, by_mq, _] = column(slope(terms, x));
        let [by_mm, ..] = column(curvature(terms, x));
        [value, by_m, by_q, by_mm, by_mq, by_qq]
    }
}

/// Least angle, rad, at which the direction of the angle is told; below, what is not smooth at zero counts as flat.
const AXIAL_FLOW: f64 = 1e-8;

/// An even function of the angle by its square.
#[inline(always)]
fn even(Column { terms: [a, b, c, d], y, first, beyond }: Column, angle: f64) -> [f64; 3] {
    let value = (a + y * b) + y * y * (c + y * d);
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
fn odd(Column { terms: [a, b, c, d], y, first, beyond }: Column, angle: f64) -> [f64; 3] {
    if first {
        // No constant term: the angle divides the polynomial.
        let value = b + y * (c + y * d);
        let kink = if angle < AXIAL_FLOW { 0.0 } else { c / (2.0 * angle) };
        let curve = if angle < AXIAL_FLOW { 0.0 } else { -kink / (2.0 * angle * angle) };
        return [value, kink + d, curve];
    }
    let value = ((a + y * b) + y * y * (c + y * d)) / angle;
    let (by, byy) =
        if beyond { (0.0, 0.0) } else { (b + y * (2.0 * c + y * 3.0 * d), 2.0 * c + 6.0 * d * y) };
    let slope = (by - value) / angle;
    let second = (byy - 2.0 * slope) / angle;
    [value, slope / (2.0 * angle), (second - slope / angle) / (4.0 * angle * angle)]
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
        let held = x.max(low).min(high);
        let bin = ((held - low) * self.per_unit) as usize;
        let mut k = self.bins[bin.min(self.bins.len() - 1)] as usize;
        // The knot in the bin, and what rounding does at the ends of the bin.
        k -= usize::from(self.at[k] > held);
        let last = self.at.len() - 2;
        k += usize::from(k < last && self.at[k + 1] <= held);
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
fn linear(mach: &[f64], attack: &[f64], values: &[f64]) -> Vec<Terms> {
    let at = |i: usize, j: usize| values[i * attack.len() + j];
    cells(mach, attack, |i, j| {
        let (dm, da) = (mach[i + 1] - mach[i], attack[j + 1] - attack[j]);
        let (low, high) = ((at(i, j + 1) - at(i, j)) / da, (at(i + 1, j + 1) - at(i + 1, j)) / da);
        let mut terms = Terms::default();
        terms[0][..2].copy_from_slice(&[at(i, j), low]);
        terms[1][..2].copy_from_slice(&[(at(i + 1, j) - at(i, j)) / dm, (high - low) / dm]);
        terms
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
fn cells(mach: &[f64], attack: &[f64], terms: impl Fn(usize, usize) -> Terms) -> Vec<Terms> {
    let columns = attack.len() - 1;
    (0..(mach.len() - 1) * columns).map(|k| terms(k / columns, k % columns)).collect()
}

#[cfg(test)]
mod tests;
