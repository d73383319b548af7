//! Forces and moments on an axisymmetric body.

use std::cell::Cell;

use apsides_ad::vector::{cross, dot};
use apsides_ad::{Outside, Pchip, Scalar};

use super::MachTable;
use super::mach_alpha::{AxisymmetricCoefficients, Interpolation, MachAlphaTable};
use crate::DynamicsError;
use crate::error::{finite, finite_column, increasing, positive, positive_column, short};

/// A coefficient that depends on the Mach number alone.
#[derive(Clone, Debug, PartialEq)]
pub enum MachLaw {
    /// The same at every Mach number.
    Constant(f64),
    /// Constant between Mach numbers at which it jumps; derivatives know nothing of the jumps.
    Steps {
        /// Mach numbers of the jumps, increasing.
        at: Vec<f64>,
        /// Values: below the first jump, from each jump on.
        values: Vec<f64>,
    },
    /// A shape-preserving cubic, constant beyond its ends.
    Table(Pchip),
}

impl MachLaw {
    /// A law that jumps to `values[k + 1]` at `at[k]`, from `values[0]` below the first.
    ///
    /// # Errors
    /// When the Mach numbers are not positive, finite and increasing or the values, one more, not finite.
    pub fn steps(at: &[f64], values: &[f64]) -> Result<Self, DynamicsError> {
        positive_column("Mach number of a jump", at, at.len())?;
        if at.len() > 1 {
            increasing("Mach number of a jump", at)?;
        }
        finite_column("coefficient between jumps", values, at.len() + 1)?;
        Ok(Self::Steps { at: at.into(), values: values.into() })
    }

    /// A table over Mach numbers that increase, at least two.
    ///
    /// # Errors
    /// When a number is not finite or a Mach number not above the one before it.
    pub fn table(mach: &[f64], values: &[f64]) -> Result<Self, DynamicsError> {
        increasing("Mach number", mach)?;
        finite_column("coefficient", values, mach.len())?;
        let table = Pchip::new(mach, values, Outside::Constant);
        table.map(Self::Table).map_err(|_| short("Mach number", mach.len(), 2))
    }

    /// The coefficient at a Mach number.
    #[inline]
    pub fn at<S: Scalar>(&self, mach: S) -> S {
        match self {
            Self::Constant(value) => S::from(*value),
            Self::Steps { at, values } => {
                mach.map(|m| [values[at.iter().take_while(|jump| **jump <= m).count()], 0.0, 0.0])
            }
            Self::Table(table) => interpolated(table, mach),
        }
    }
}

/// Apart, so that the loads with laws that are no tables keep their numbers in registers.
#[cold]
fn interpolated<S: Scalar>(table: &Pchip, mach: S) -> S {
    table.at(mach)
}

/// Damping of the rotation: coefficients of moment by the rate times the diameter over twice the airspeed.
#[derive(Clone, Debug, PartialEq)]
pub struct Damping {
    /// The derivative of pitch and yaw alike; a negative one damps.
    pub pitch: MachLaw,
    /// The derivative of roll; a negative one damps.
    pub roll: MachLaw,
}

impl Damping {
    /// The constants of polmes/aether: -0.25 in pitch; -0.02 in roll.
    #[must_use]
    pub fn constant() -> Self {
        Self { pitch: MachLaw::Constant(-0.25), roll: MachLaw::Constant(-0.02) }
    }

    /// An assumed set that drives the oscillation between Mach 0.6 and 2.5: +0.20 there and -0.15 elsewhere in pitch; -0.02 in roll. Blunt
    /// capsules are dynamically unstable below about Mach 2 (D. B. Owens and V. V. Aubuchon, NTRS 20110015371).
    #[must_use]
    pub fn unstable() -> Self {
        let pitch = MachLaw::Steps { at: vec![0.6, 2.5], values: vec![-0.15, 0.20, -0.15] };
        Self { pitch, roll: MachLaw::Constant(-0.02) }
    }
}

/// Forces and moments on an axisymmetric body: a table of coefficients with its sizes and damping.
///
/// Body axes: x along the axis, towards the air at total angle of attack zero, y to the right, z downwards. With the airspeed components
/// `u, v, w`, `r = sqrt(v^2 + w^2)`, the total angle of attack `eta = atan2(r, u)` and `Q = rho V^2 S / 2`:
///
/// ```text
/// F = -Q (CA, CN v/r, CN w/r)
/// M = Q D (Clp p D / 2V, Cm w/r + Cmq q D / 2V, -Cm v/r + Cmq r D / 2V)   about the origin of the axes
/// ```
///
/// with `Cm = Cm_reference + (x / D) CN` at the origin, `x` ahead of the table's point of reference.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisymmetricAerodynamics {
    table: MachAlphaTable,
    /// Diameter, m.
    diameter: f64,
    /// Reference area, m2.
    area: f64,
    /// Origin of the body axes ahead of the table's point of reference, diameters.
    station: f64,
    damping: Damping,
    /// The derivatives of pitch and roll, where both are the same at every Mach number.
    constant_damping: Option<[f64; 2]>,
}

/// The force and the moment of the air on a body, in body axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AirLoads<S> {
    /// Force, N.
    pub force: [S; 3],
    /// Moment about the origin of the body axes, N m.
    pub moment: [S; 3],
}

/// Mach numbers per interval of the table at which trims are found.
const PER_INTERVAL: usize = 2;

/// Square of an airspeed, m2/s2, that is added so that angles exist at rest; far below what matters.
const AT_REST: f64 = 1e-18;

impl AxisymmetricAerodynamics {
    /// A table for a diameter (m), with the area of the circle, and the distance of the origin of the body axes ahead of the table's point of
    /// reference in diameters.
    ///
    /// # Errors
    /// When the diameter is not positive and finite or the station not finite.
    pub fn new(
        table: MachAlphaTable,
        diameter: f64,
        station: f64,
        damping: Damping,
    ) -> Result<Self, DynamicsError> {
        let diameter = positive("diameter", diameter, "m")?;
        let station = finite("station of the origin", station, "diameters")?;
        let constant_damping = match damping {
            Damping { pitch: MachLaw::Constant(pitch), roll: MachLaw::Constant(roll) } => Some([pitch, roll]),
            _ => None,
        };
        Ok(Self {
            table,
            diameter,
            area: 0.25 * std::f64::consts::PI * diameter * diameter,
            station,
            damping,
            constant_damping,
        })
    }

    /// The capsule of 1.5 m of the moving-mass problem: [`MachAlphaTable::apollo`] about 0.2406 diameters ahead of its point of reference.
    ///
    /// # Errors
    /// Never with these numbers.
    pub fn capsule(interpolation: Interpolation, damping: Damping) -> Result<Self, DynamicsError> {
        Self::new(MachAlphaTable::apollo(interpolation), 1.5, 0.2406, damping)
    }

    /// The table.
    #[must_use]
    pub fn table(&self) -> &MachAlphaTable {
        &self.table
    }

    /// Diameter, m.
    #[must_use]
    pub fn diameter(&self) -> f64 {
        self.diameter
    }

    /// Reference area, m2.
    #[must_use]
    pub fn area(&self) -> f64 {
        self.area
    }

    /// Coefficients at a Mach number and the square of the total angle of attack (rad2), the moment about the origin of the body axes.
    #[inline]
    pub fn coefficients<S: Scalar>(&self, mach: S, square: S) -> AxisymmetricCoefficients<S> {
        self.about_origin(self.table.coefficients(mach, square))
    }

    #[inline]
    fn about_origin<S: Scalar>(&self, at: AxisymmetricCoefficients<S>) -> AxisymmetricCoefficients<S> {
        AxisymmetricCoefficients {
            moment_by_angle: at.moment_by_angle + at.normal_by_angle * self.station,
            ..at
        }
    }

    /// Force and moment at a density (kg/m3), a speed of sound (m/s), the velocity relative to the air (m/s) and the angular velocity (rad/s),
    /// both in body axes.
    #[inline(always)]
    pub fn loads<S: Scalar>(&self, density: S, sound: S, air: &[S; 3], spin: &[S; 3]) -> AirLoads<S> {
        self.loads_at_speed(density, sound, dot(air, air), air, spin)
    }

    /// The same with the square of the airspeed (m2/s2), which may be known before the velocity is in body axes.
    #[inline(always)]
    pub(crate) fn loads_at_speed<S: Scalar>(
        &self,
        density: S,
        sound: S,
        square: S,
        air: &[S; 3],
        spin: &[S; 3],
    ) -> AirLoads<S> {
        let square = square + AT_REST;
        let speed = square.sqrt();
        let across = air[1].square() + air[2].square();
        // The angle itself, which has no derivative in axial flow, only tells the place in the table.
        let angle = Cell::new(None);
        let angle_by_across = air[0].map2(across, |u, p| {
            let jet = angle_by_crossflow(u, p);
            angle.set(Some(jet[0] * p.sqrt()));
            jet
        });
        let mach = speed * sound.recip();
        let at =
            self.about_origin(self.table.coefficients_at(mach, angle_by_across.square() * across, &angle));
        // Both halves of a product wait for less than its factors one by one.
        let size = density * square * (0.5 * self.area);
        let sideways = angle_by_across * size;
        let sideways = [air[1] * sideways, air[2] * sideways];
        let moment = at.moment_by_angle * self.diameter;
        let damping = density * speed * (0.25 * self.area * self.diameter * self.diameter);
        let [pitch, roll] = match self.constant_damping {
            Some(coefficients) => coefficients.map(|c| damping * c),
            None => [&self.damping.pitch, &self.damping.roll].map(|law| law.at(mach) * damping),
        };
        AirLoads {
            force: [-at.axial * size, -at.normal_by_angle * sideways[0], -at.normal_by_angle * sideways[1]],
            moment: [
                roll * spin[0],
                pitch * spin[1] + moment * sideways[1],
                pitch * spin[2] - moment * sideways[0],
            ],
        }
    }

    /// The least total angle of attack, rad, at which the moment about a centre of mass that is a distance (m) off the axis vanishes at a Mach
    /// number, with the offset in the plane of the angle; none where the table has none.
    #[must_use]
    pub fn trim_angle(&self, mach: f64, offset: f64) -> Option<f64> {
        let moment = |angle: f64| {
            let at = self.coefficients(mach, angle * angle);
            at.moment_by_angle * angle + at.axial * offset.abs() / self.diameter
        };
        if offset == 0.0 {
            return Some(0.0);
        }
        const STEPS: usize = 3000;
        let [_, last] = self.table.attack_range();
        let angle = |k: usize| last * k as f64 / STEPS as f64;
        let above = (1..=STEPS).find(|k| moment(angle(*k)) <= 0.0)?;
        let (mut low, mut high) = (angle(above - 1), angle(above));
        while high - low > 1e-14 {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            if moment(middle) > 0.0 { low = middle } else { high = middle }
        }
        Some(0.5 * (low + high))
    }

    /// Coefficients of lift and drag, across and along the air, at a Mach number and a total angle of attack (rad). The lift is in the plane of
    /// the angle; positive lift pulls to the side that the axis is turned away from, as that of blunt bodies does:
    ///
    /// ```text
    /// CL = CA sin(eta) - CN cos(eta),   CD = CA cos(eta) + CN sin(eta)
    /// ```
    #[must_use]
    pub fn lift_and_drag(&self, mach: f64, angle: f64) -> [f64; 2] {
        let at = self.coefficients(mach, angle * angle);
        let (sin, cos) = angle.sin_cos();
        let normal = at.normal_by_angle * angle;
        [at.axial * sin - normal * cos, at.axial * cos + normal * sin]
    }

    /// Mach numbers, the table's and some between them, with the total angle of attack (rad) of a centre of mass that is a distance (m) off
    /// the axis in trim.
    ///
    /// # Errors
    /// When the table has no trim at one of them.
    pub fn trims(&self, offset: f64) -> Result<Vec<(f64, f64)>, DynamicsError> {
        let knots = self.table.mach_knots();
        let between = |w: &[f64]| {
            let (low, high) = (w[0], w[1]);
            (0..PER_INTERVAL).map(move |k| low + (high - low) * k as f64 / PER_INTERVAL as f64)
        };
        let mach = knots.windows(2).flat_map(between).chain(knots.last().copied());
        let trim = |m: f64| {
            let allowed = "small enough for a trim at all Mach numbers of the table of coefficients";
            let (what, unit) = ("offset of the centre of mass", "m");
            let none = || DynamicsError::Parameter { what, value: offset, unit, allowed };
            Ok((m, self.trim_angle(m, offset).ok_or_else(none)?))
        };
        mach.map(trim).collect()
    }

    /// Lift and drag over the Mach number in the trim of a centre of mass that is a distance (m) off the axis.
    ///
    /// # Errors
    /// When the table has no trim at one of its Mach numbers.
    pub fn trimmed(&self, offset: f64) -> Result<MachTable, DynamicsError> {
        let trims = self.trims(offset)?;
        let mach: Vec<f64> = trims.iter().map(|(m, _)| *m).collect();
        let (lift, drag): (Vec<f64>, Vec<f64>) =
            trims.iter().map(|(m, angle)| self.lift_and_drag(*m, *angle).into()).unzip();
        MachTable::new(&mach, &lift, &drag)
    }

    /// Frequency of the oscillation of the angle of attack about zero, Hz, at a Mach number, a dynamic pressure (Pa) and a moment of inertia
    /// (kg m2), `sqrt(q S D |Cm_alpha| / I) / 2 pi`; none where the body is not stable.
    #[must_use]
    pub fn static_frequency(&self, mach: f64, dynamic_pressure: f64, inertia: f64) -> Option<f64> {
        let slope = self.coefficients(mach, 0.0).moment_by_angle;
        let stiffness = -slope * dynamic_pressure * self.area * self.diameter;
        (stiffness >= 0.0).then(|| (stiffness / inertia).sqrt() / std::f64::consts::TAU)
    }
}

/// A moment about the origin, seen from a point `at` (m).
#[inline]
pub fn transferred<S: Scalar>(loads: &AirLoads<S>, at: &[S; 3]) -> [S; 3] {
    let lever = cross(at, &loads.force);
    std::array::from_fn(|k| loads.moment[k] - lever[k])
}

/// Terms of the series of `atan(sqrt x) / sqrt x`, the sum of `(-x)^n / (2 n + 1)`, and of its first two derivatives: enough for all digits up to
/// `x = 0.01`.
const ARC_TANGENT: [[f64; 8]; 3] = {
    let mut terms = [[0.0; 8]; 3];
    let mut k = 0;
    while k < 8 {
        let mut order = 0;
        while order < 3 {
            let n: usize = k + order;
            let sign = if n.is_multiple_of(2) { 1.0 } else { -1.0 };
            let powers = [1, n, n * n.saturating_sub(1)][order];
            terms[order][k] = sign * powers as f64 / (2 * n + 1) as f64;
            order += 1;
        }
        k += 1;
    }
    terms
};

/// `atan2(r, u) / r` of the axial speed `u` and the square `p = r^2` of the crossflow, with derivatives: smooth at `p = 0` in flow from the
/// front. In flow along the axis from behind, where it is singular, and at rest it is held finite.
#[inline]
fn angle_by_crossflow(u: f64, p: f64) -> [f64; 6] {
    let by_u = 1.0 / u;
    let x = p * (by_u * by_u);
    let total = u * u + p;
    if u > 0.0 && x < 0.01 {
        let [value, slope, curvature] = ARC_TANGENT.map(|c| {
            let (xx, pair) = (x * x, |k: usize| c[k] + c[k + 1] * x);
            (pair(0) + xx * pair(2)) + xx * xx * (pair(4) + xx * pair(6))
        });
        return [
            value * by_u,
            -1.0 / total,
            slope * by_u.powi(3),
            2.0 * u / (total * total),
            1.0 / (total * total),
            curvature * by_u.powi(5),
        ];
    }
    angle_far_from_axis(u, p)
}

/// The same where the series has too many terms. Apart, so that loads near axial flow keep their numbers in registers.
#[cold]
fn angle_far_from_axis(u: f64, p: f64) -> [f64; 6] {
    let p = p.max(1e-16 * u * u).max(1e-60);
    let total = u * u + p;
    let r = p.sqrt();
    let value = r.atan2(u) / r;
    let by_p = (0.5 * u / total - 0.5 * value) / p;
    [
        value,
        -1.0 / total,
        by_p,
        2.0 * u / (total * total),
        1.0 / (total * total),
        (-0.5 * u / (total * total) - 1.5 * by_p) / p,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-15;

    /// Discretisation: difference quotients, by their steps.
    const DIFFERENCES: f64 = 1e-3;

    /// Round-off of a difference quotient where the derivative vanishes.
    const VANISHING: f64 = 1e-16;

    /// Against differences of the values and of the first derivatives.
    #[test]
    fn the_angle_by_the_crossflow_is_smooth() {
        for (u, p) in
            [(700.0, 0.0), (700.0, 480.0), (700.0, 495.0), (300.0, 2e4), (-20.0, 900.0), (1e-3, 50.0)]
        {
            let at = angle_by_crossflow(u, p);
            let r = f64::sqrt(p);
            if p > 0.0 {
                assert!((at[0] * r - r.atan2(u)).abs() < ROUNDING, "{u} {p}");
            }
            let h = [1e-4 * u.abs().max(1.0), 1e-4 * p.max(1.0)];
            let start = if p > 0.0 { -1.0 } else { 0.0 };
            let along = |k: usize, component: usize| {
                let moved = |s: f64| {
                    let (u, p) = if k == 0 { (u + s * h[0], p) } else { (u, p + s * h[1]) };
                    angle_by_crossflow(u, p)[component]
                };
                let from = if k == 0 { -1.0 } else { start };
                (moved(1.0) - moved(from)) / ((1.0 - from) * h[k])
            };
            for (found, expected) in [
                (along(0, 0), at[1]),
                (along(1, 0), at[2]),
                (along(0, 1), at[3]),
                (along(1, 1), at[4]),
                (along(0, 2), at[4]),
                (along(1, 2), at[5]),
            ] {
                assert!(
                    (found - expected).abs() < DIFFERENCES * expected.abs() + VANISHING,
                    "{u} {p}: {found} {expected}"
                );
            }
        }
        for (u, p) in [(0.0, 0.0), (-300.0, 0.0)] {
            assert!(angle_by_crossflow(u, p).iter().all(|v| v.is_finite()), "{u} {p}");
        }
    }

    #[test]
    fn laws_of_the_mach_number() {
        let Damping { pitch, .. } = Damping::unstable();
        assert_eq!([0.59, 0.6, 2.49, 2.5].map(|m| pitch.at(m)), [-0.15, 0.2, 0.2, -0.15]);
        assert_eq!(MachLaw::steps(&[0.6, 2.5], &[-0.15, 0.2, -0.15]), Ok(pitch));
        assert!(MachLaw::steps(&[2.5, 0.6], &[0.0; 3]).is_err());
        assert!(MachLaw::steps(&[0.6], &[0.0; 3]).is_err());
        assert_eq!(MachLaw::table(&[0.5, 1.0], &[0.2, 0.4]).unwrap().at(3.0), 0.4);
        assert!(MachLaw::table(&[0.5, 0.5], &[0.2, 0.4]).is_err());
    }
}
