//! Allocation: where internal masses stand so that the centre of mass is where a law wants it.
//!
//! A vehicle of mass `M` carries two masses `m` in the plane of its y and z axes. Its centre of mass moves by
//!
//! ```text
//! cross:   y = m s_y / M,                          z = m s_z / M
//! radial:  y = m r (sin a_1 + sin a_2) / M,        z = m r (cos a_1 + cos a_2) / M
//! ```
//!
//! where `s` are positions along the axes and `a` angles on a rim of radius `r`, from the z axis toward the y axis. The radial layout is
//! inverted in closed form: with `phi = atan2(y, z)` and `h = acos(rho M / (2 m r))`, `rho = |(y, z)|`, the masses stand at `phi + h` and
//! `phi - h`. At the neutral `rho = 0` they stand opposite, and there the derivative of the centre of mass by the angles is singular: laws
//! that drive the angles directly ([`RadialLayout::direct`]) move it along one line alone.

use std::f64::consts::{PI, TAU};

use crate::error::{ControlError, not_negative, ordered, positive};

/// Positions of two masses and the centre of mass that they give.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Allocation {
    /// Position of each mass: m along its axis, or rad on the rim.
    pub positions: [f64; 2],
    /// Centre of mass `[y, z]` of these positions, m.
    pub centre: [f64; 2],
    /// Says whether the centre wanted is beyond the reach, and the nearest one in reach was taken.
    pub saturated: bool,
}

/// Two masses on linear tracks along the y and the z axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrossLayout {
    shift: f64,
    travel: [[f64; 2]; 2],
}

impl CrossLayout {
    /// Mass of each moving mass and of the whole vehicle (kg), least and greatest position on the y and on the z track (m).
    ///
    /// # Errors
    /// [`ControlError::Parameter`] where a mass is not positive, [`ControlError::Limits`] where a travel is not in order.
    pub fn new(mass: f64, total_mass: f64, travel: [[f64; 2]; 2]) -> Result<Self, ControlError> {
        positive("moving mass in kg", mass)?;
        positive("mass of the vehicle in kg", total_mass)?;
        for track in travel {
            ordered("travel of a mass in m", track)?;
        }
        Ok(Self { shift: mass / total_mass, travel })
    }

    /// Centre of mass `[y, z]` (m) of two positions.
    #[must_use]
    pub fn centre(&self, positions: &[f64; 2]) -> [f64; 2] {
        positions.map(|s| self.shift * s)
    }

    /// Positions for a centre of mass `[y, z]` (m).
    #[must_use]
    pub fn invert(&self, centre: &[f64; 2]) -> Allocation {
        let wanted = centre.map(|c| c / self.shift);
        let positions = std::array::from_fn(|k| wanted[k].clamp(self.travel[k][0], self.travel[k][1]));
        Allocation { positions, centre: self.centre(&positions), saturated: positions != wanted }
    }
}

/// Two masses on one rim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadialLayout {
    /// Shift of the centre of mass by one mass, m.
    shift: f64,
    least_distance: f64,
}

impl RadialLayout {
    /// Mass of each moving mass and of the whole vehicle (kg), radius of the rim (m), least angle between the masses (rad).
    ///
    /// # Errors
    /// [`ControlError::Parameter`] where a mass or the radius is not positive, or the angle not from 0 to below pi.
    pub fn new(mass: f64, total_mass: f64, radius: f64, least_distance: f64) -> Result<Self, ControlError> {
        positive("moving mass in kg", mass)?;
        positive("mass of the vehicle in kg", total_mass)?;
        positive("radius of the rim in m", radius)?;
        not_negative("least angle between the masses in rad", least_distance)?;
        if least_distance >= PI {
            let what = "least angle between the masses in rad";
            return Err(ControlError::Parameter { what, value: least_distance, allowed: "below pi" });
        }
        Ok(Self { shift: mass * radius / total_mass, least_distance })
    }

    /// Largest distance of the centre of mass from the axis, m.
    #[must_use]
    pub fn reach(&self) -> f64 {
        2.0 * self.shift * (0.5 * self.least_distance).cos()
    }

    /// Centre of mass `[y, z]` (m) of two angles (rad).
    #[must_use]
    pub fn centre(&self, angles: &[f64; 2]) -> [f64; 2] {
        let ((s1, c1), (s2, c2)) = (angles[0].sin_cos(), angles[1].sin_cos());
        [self.shift * (s1 + s2), self.shift * (c1 + c2)]
    }

    /// The angles as the outputs of two laws, added to a neutral position (rad): no inversion.
    #[must_use]
    pub fn direct(&self, neutral: &[f64; 2], command: &[f64; 2]) -> Allocation {
        let positions = std::array::from_fn(|k| neutral[k] + command[k]);
        Allocation { positions, centre: self.centre(&positions), saturated: false }
    }

    /// Angles for a centre of mass `[y, z]` (m), reached from the angles before.
    ///
    /// Angles are continued without jumps by full turns. Of the two ways to assign the masses, that with the shorter way is taken; on a
    /// straight way from `before` the masses do not pass each other, when they did not there (`0 < before[0] - before[1] < 2 pi`).
    /// Beyond the reach the centre goes to the rim of the disk, at the same direction. NaN gives NaN.
    #[must_use]
    pub fn invert(&self, centre: &[f64; 2], before: &[f64; 2]) -> Allocation {
        let [y, z] = *centre;
        let wanted = y.hypot(z);
        let rho = wanted.min(self.reach());
        let half = if wanted.is_nan() { f64::NAN } else { (rho / (2.0 * self.shift)).min(1.0).acos() };
        // At the centre any direction will do: keep that of before.
        let direction = if wanted == 0.0 { 0.5 * (before[0] + before[1]) } else { y.atan2(z) };
        // The first mass leads by 2 h, or by 2 pi - 2 h with both turned by pi: the same pair with the masses exchanged.
        let mean_before = 0.5 * (before[0] + before[1]);
        let candidate = |mean: f64, half: f64| {
            let mean = mean + TAU * ((mean_before - mean) / TAU).round();
            let positions = [mean + half, mean - half];
            let way = (positions[0] - before[0]).abs().max((positions[1] - before[1]).abs());
            (way, positions)
        };
        let (leading, trailing) = (candidate(direction, half), candidate(direction + PI, PI - half));
        let positions = if trailing.0 < leading.0 { trailing.1 } else { leading.1 };
        Allocation { positions, centre: self.centre(&positions), saturated: wanted > rho }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Round trip through arc cosine and back, relative to the reach.
    const ROUNDING: f64 = 1e-12;

    /// Most that a mass moves in one of two thousand steps through the centre; a jump is thousands of times as far.
    const WITHOUT_A_JUMP: f64 = 0.003;

    fn radial(least: f64) -> RadialLayout {
        RadialLayout::new(5.0, 500.0, 0.75, least).unwrap()
    }

    #[test]
    fn authority_of_both_layouts() {
        // m 0.7 / M per axis and 2 m r / M: 10 kg of 700 kg and 5 kg of 750 kg give 1 cm.
        let cross = CrossLayout::new(10.0, 700.0, [[-0.7, 0.7]; 2]).unwrap();
        assert!((cross.centre(&[0.7, -0.7])[0] - 0.01).abs() < 1e-5 * ROUNDING);
        let rim = RadialLayout::new(5.0, 750.0, 0.75, 0.0).unwrap();
        assert!((rim.reach() - 0.01).abs() < 1e-5 * ROUNDING);
        assert!((rim.centre(&[0.0, 0.0])[1] - 0.01).abs() < 1e-5 * ROUNDING);
        // Masses that are 60 deg apart at least reach cos 30 deg of it.
        assert!((radial(PI / 3.0).reach() - 0.015 * 0.75_f64.sqrt()).abs() < 1e-4 * ROUNDING);
    }

    #[test]
    fn cross_inverts_and_clamps_each_axis() {
        let cross = CrossLayout::new(10.0, 500.0, [[-0.7, 0.7], [0.0, 0.7]]).unwrap();
        let found = cross.invert(&[0.01, 0.002]);
        assert!(
            (found.positions[0] - 0.5).abs() < 1e-3 * ROUNDING
                && (found.positions[1] - 0.1).abs() < 1e-3 * ROUNDING
        );
        assert!(!found.saturated);
        let beyond = cross.invert(&[0.02, -0.01]);
        assert_eq!((beyond.positions, beyond.saturated), ([0.7, 0.0], true));
        assert!((beyond.centre[0] - 0.014).abs() < 1e-5 * ROUNDING);
    }

    #[test]
    fn direct_angles_at_the_balanced_neutral_move_one_line_alone() {
        // The derivative of the centre by the angles at (0, pi) has a zero row: z does not change to first order.
        let rim = radial(0.0);
        let [y, z] = rim.direct(&[0.0, PI], &[1e-4, -3e-4]).centre;
        assert!((y - 0.0075 * 4e-4).abs() < ROUNDING);
        assert!(z.abs() < 1e3 * ROUNDING);
    }

    #[test]
    fn through_the_centre_without_a_jump() {
        // From one side to the other through the centre: the masses pass the opposite stand and go on.
        let rim = radial(0.0);
        let mut before = rim.invert(&[0.0, 0.01], &[0.5 * PI, -0.5 * PI]).positions;
        for k in 1..=2000 {
            let z = 0.01 * (1.0 - f64::from(k) / 1000.0);
            let now = rim.invert(&[0.0, z], &before);
            assert!(!now.saturated && (now.centre[1] - z).abs() < 1e-4 * ROUNDING);
            for (a, b) in now.positions.iter().zip(&before) {
                assert!((a - b).abs() < WITHOUT_A_JUMP, "{k} {a} {b}");
            }
            before = now.positions;
        }
        assert!((before[0] - before[1] - (TAU - 2.0 * (2.0_f64 / 3.0).acos())).abs() < 1e3 * ROUNDING);
    }

    #[test]
    fn turns_are_counted() {
        let rim = radial(0.1);
        let mut before = [0.5 * PI, -0.5 * PI];
        let steps = 400;
        for k in 0..=3 * steps {
            let a = TAU * f64::from(k) / f64::from(steps);
            before = rim.invert(&[0.004 * a.sin(), 0.004 * a.cos()], &before).positions;
        }
        assert!((0.5 * (before[0] + before[1]) - 3.0 * TAU).abs() < 1e3 * ROUNDING, "{before:?}");
    }

    #[test]
    fn beyond_the_reach_the_nearest_in_reach() {
        let rim = radial(0.2);
        let found = rim.invert(&[0.03, 0.04], &[0.5, -0.5]);
        assert!(found.saturated);
        assert!((found.centre[0] - 0.6 * rim.reach()).abs() < 1e-3 * ROUNDING);
        assert!((found.centre[1] - 0.8 * rim.reach()).abs() < 1e-3 * ROUNDING);
        assert!((found.positions[0] - found.positions[1] - 0.2).abs() < ROUNDING);
    }

    #[test]
    fn refusals_and_nan() {
        assert!(CrossLayout::new(0.0, 1.0, [[-1.0, 1.0]; 2]).is_err());
        assert!(matches!(
            CrossLayout::new(1.0, 1.0, [[1.0, -1.0], [-1.0, 1.0]]),
            Err(ControlError::Limits { lower: 1.0, upper: -1.0, .. })
        ));
        assert!(RadialLayout::new(1.0, f64::NAN, 1.0, 0.0).is_err());
        assert!(RadialLayout::new(1.0, 1.0, -1.0, 0.0).is_err());
        assert!(RadialLayout::new(1.0, 1.0, 1.0, PI).is_err());
        assert!(radial(0.0).invert(&[f64::NAN, 0.0], &[1.0, -1.0]).positions[0].is_nan());
        let cross = CrossLayout::new(1.0, 1.0, [[-1.0, 1.0]; 2]).unwrap();
        assert!(cross.invert(&[f64::NAN, 0.0]).positions[0].is_nan());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]

        #[test]
        fn round_trip_over_the_disk(
            radius in 0.0..1.0_f64,
            direction in -PI..PI,
            start in -20.0..20.0_f64,
            apart in 0.3..5.9_f64,
        ) {
            let rim = radial(0.2);
            let rho = radius * rim.reach();
            let wanted = [rho * direction.sin(), rho * direction.cos()];
            let before = [start + apart, start];
            let found = rim.invert(&wanted, &before);
            prop_assert!(!found.saturated);
            for (c, w) in found.centre.iter().zip(&wanted) {
                prop_assert!((c - w).abs() < ROUNDING * rim.reach());
            }
            let distance = found.positions[0] - found.positions[1];
            prop_assert!((0.2 - 1e-9..=TAU - 0.2 + 1e-9).contains(&distance));
            // No way is longer than half a turn, and the masses do not exchange places.
            for (a, b) in found.positions.iter().zip(&before) {
                prop_assert!((a - b).abs() <= TAU);
            }
        }
    }
}
