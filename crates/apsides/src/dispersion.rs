//! Deviations of a flight from its plan: their sizes, and samples of them by a seed.

use apsides_metaheuristics::Generator;
use serde::Serialize;

use crate::moving_mass::Case;

/// Deviations of one flight at its start, or the standard deviations of many, which are normal and independent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Deviations {
    /// Position upwards, along the course and across it (to the right), m.
    pub position_m: [f64; 3],
    /// Velocity along the same axes, m/s.
    pub velocity_m_s: [f64; 3],
    /// Thrust, relative.
    pub thrust: f64,
    /// Exhaust velocity, relative.
    pub exhaust_velocity: f64,
    /// Mass, kg.
    pub mass_kg: f64,
    /// What navigation takes the position to be more than it is, along the axes of the start, constant over the flight, m. Open loop
    /// knows nothing of it.
    pub navigation_position_m: [f64; 3],
    /// The same of the velocity, m/s.
    pub navigation_velocity_m_s: [f64; 3],
}

/// Number of deviations.
const NUMBER: usize = 15;

/// Steps between the seeds of two samples: 2^64 by the golden ratio, so that neighbours have nothing in common.
const STEP: u64 = 0x9E37_79B9_7F4A_7C15;

impl Deviations {
    /// The deviations of the sample of an index, these being standard deviations: a function of seed and index alone, whatever is sampled
    /// before it.
    #[must_use]
    pub fn sample(&self, seed: u64, index: usize) -> Self {
        let mut random = Generator::new(seed.wrapping_add(STEP.wrapping_mul(index as u64 + 1)));
        let mut draw = |sigma: f64| sigma * random.normal();
        Self {
            position_m: self.position_m.map(&mut draw),
            velocity_m_s: self.velocity_m_s.map(&mut draw),
            thrust: draw(self.thrust),
            exhaust_velocity: draw(self.exhaust_velocity),
            mass_kg: draw(self.mass_kg),
            navigation_position_m: self.navigation_position_m.map(&mut draw),
            navigation_velocity_m_s: self.navigation_velocity_m_s.map(&mut draw),
        }
    }

    /// All of them, in the order of the fields.
    #[must_use]
    pub fn values(&self) -> [f64; NUMBER] {
        let ([a, b, c], [d, e, f]) = (self.position_m, self.velocity_m_s);
        let ([g, h, i], [j, k, l]) = (self.navigation_position_m, self.navigation_velocity_m_s);
        [a, b, c, d, e, f, self.thrust, self.exhaust_velocity, self.mass_kg, g, h, i, j, k, l]
    }

    /// Their names in the same order, the unit at the end.
    #[must_use]
    pub const fn names() -> [&'static str; NUMBER] {
        [
            "start_up_m",
            "start_along_m",
            "start_across_m",
            "start_up_m_s",
            "start_along_m_s",
            "start_across_m_s",
            "thrust",
            "exhaust_velocity",
            "mass_kg",
            "navigation_up_m",
            "navigation_along_m",
            "navigation_across_m",
            "navigation_up_m_s",
            "navigation_along_m_s",
            "navigation_across_m_s",
        ]
    }
}

/// Deviations of a descent under its law, or the standard deviations of many, which are normal and independent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct DescentDeviations {
    /// Offset of the centre of mass along y and z, m.
    pub offset_m: [f64; 2],
    /// Angle of attack and sideslip at the entry, deg.
    pub entry_angles_deg: [f64; 2],
    /// Flight path angle at the entry, deg.
    pub path_angle_deg: f64,
    /// Gain of the sensors, relative.
    pub sensor_gain: f64,
    /// Damping in pitch and yaw, relative.
    pub damping: f64,
    /// Wind towards north and east at 12 km, m/s.
    pub wind_m_s: [f64; 2],
}

impl DescentDeviations {
    /// Names in the order of [`values`](Self::values), the unit at the end.
    pub const NAMES: &'static [&'static str] = &[
        "offset_y_m",
        "offset_z_m",
        "entry_attack_deg",
        "entry_sideslip_deg",
        "entry_path_angle_deg",
        "sensor_gain",
        "damping",
        "wind_north_m_s",
        "wind_east_m_s",
    ];

    /// The deviations of the sample of an index, these being standard deviations, and a seed for its noise: functions of seed and index alone.
    #[must_use]
    pub fn sample(&self, seed: u64, index: usize) -> (Self, u64) {
        let own = seed.wrapping_add(STEP.wrapping_mul(index as u64 + 1));
        let mut random = Generator::new(own);
        let mut draw = |sigma: f64| sigma * random.normal();
        let deviations = Self {
            offset_m: self.offset_m.map(&mut draw),
            entry_angles_deg: self.entry_angles_deg.map(&mut draw),
            path_angle_deg: draw(self.path_angle_deg),
            sensor_gain: draw(self.sensor_gain),
            damping: draw(self.damping),
            wind_m_s: self.wind_m_s.map(&mut draw),
        };
        (deviations, own.rotate_left(32))
    }

    /// All of them, in the order of the names.
    #[must_use]
    pub fn values(&self) -> [f64; 9] {
        let ([a, b], [c, d], [e, f]) = (self.offset_m, self.entry_angles_deg, self.wind_m_s);
        [a, b, c, d, self.path_angle_deg, self.sensor_gain, self.damping, e, f]
    }

    /// A case with these deviations.
    #[must_use]
    pub fn applied(&self, case: &Case) -> Case {
        let mut case = case.clone();
        for k in 0..2 {
            case.vehicle.offset[k] += self.offset_m[k];
            case.wind[k] += self.wind_m_s[k];
        }
        case.entry.attack += self.entry_angles_deg[0].to_radians();
        case.entry.sideslip += self.entry_angles_deg[1].to_radians();
        case.entry.path += self.path_angle_deg.to_radians();
        case.sensors.gain *= 1.0 + self.sensor_gain;
        case.vehicle.damping_factor *= 1.0 + self.damping;
        case
    }
}

#[cfg(test)]
mod tests {
    use super::{Deviations, NUMBER};

    #[test]
    fn samples_have_their_deviations_and_no_correlation() {
        let dispersions = Deviations {
            position_m: [100.0, 10.0, 1.0],
            velocity_m_s: [3.0; 3],
            thrust: 0.01,
            exhaust_velocity: 0.002,
            mass_kg: 5.0,
            navigation_position_m: [50.0, 20.0, 20.0],
            navigation_velocity_m_s: [0.1, 0.2, 0.3],
        };
        const N: usize = 20_000;
        let samples: Vec<[f64; NUMBER]> = (0..N).map(|k| dispersions.sample(7, k).values()).collect();
        let sigmas = dispersions.values();
        let mean_of = |f: &dyn Fn(&[f64; NUMBER]) -> f64| samples.iter().map(f).sum::<f64>() / N as f64;
        for i in 0..NUMBER {
            assert!(mean_of(&|s| s[i] / sigmas[i]).abs() < 0.03);
            assert!((mean_of(&|s| (s[i] / sigmas[i]).powi(2)) - 1.0).abs() < 0.05);
            for j in 0..i {
                assert!(mean_of(&|s| s[i] * s[j] / (sigmas[i] * sigmas[j])).abs() < 0.03);
            }
        }
        // The next sample of the same component as well.
        let successive = samples.windows(2).map(|w| w[0][0] * w[1][0]).sum::<f64>() / N as f64 / 1e4;
        assert!(successive.abs() < 0.03);
        assert_eq!(dispersions.sample(7, 12), dispersions.sample(7, 12));
        assert_ne!(dispersions.sample(7, 12), dispersions.sample(8, 12));
    }
}
