//! Tables 2 to 7 as printed.

use super::stage::{Orbit, Stage};

/// Initial mass of Table 1, kg.
pub(super) const STATED_MASS: f64 = 22_100.0;
/// Initial mass that the printed burn times have, kg.
pub(super) const USED_MASS: f64 = 22_170.0;

/// A burn of Tables 2 to 6.
pub(super) struct PrintedBurn {
    /// Semi-major axis after it, km.
    pub(super) axis_km: Option<f64>,
    pub(super) eccentricity: f64,
    /// Burn time, s.
    pub(super) time: f64,
    /// Propellant, kg.
    pub(super) propellant: f64,
}

/// One of Tables 2 to 6.
pub(super) struct BurnTable {
    pub(super) id: &'static str,
    pub(super) number: usize,
    pub(super) burns: &'static [PrintedBurn],
    /// Sum of the burn times, s, and half its last digit.
    pub(super) time: (f64, f64),
    /// Sum of the propellant, kg, and half its last digit.
    pub(super) propellant: (f64, f64),
}

impl PrintedBurn {
    const fn new(axis_km: f64, eccentricity: f64, time: f64, propellant: f64) -> Self {
        Self { axis_km: Some(axis_km), eccentricity, time, propellant }
    }

    /// Without a semi-major axis.
    const fn without(eccentricity: f64, time: f64, propellant: f64) -> Self {
        Self { axis_km: None, eccentricity, time, propellant }
    }

    /// The orbit after it, if it is printed.
    pub(super) fn orbit(&self) -> Option<Orbit> {
        Some(Orbit { axis: self.axis_km? * 1e3, eccentricity: self.eccentricity })
    }

    /// Burn time that the printed propellant takes, s: with more digits than the printed one.
    pub(super) fn time_of_propellant(&self, stage: &Stage) -> f64 {
        self.propellant / stage.mass_flow()
    }
}

impl BurnTable {
    /// Returns true if the orbit after each burn is printed.
    pub(super) fn has_orbits(&self) -> bool {
        self.burns.iter().all(|b| b.axis_km.is_some())
    }

    /// Orbit and mass (kg) at each ignition, as printed: up to the first orbit that is not.
    pub(super) fn ignitions(&self, stage: &Stage) -> Vec<(Orbit, f64)> {
        let mut ignitions = vec![(Orbit::circle(stage.parking_radius), stage.mass)];
        let mut mass = stage.mass;
        for burn in &self.burns[..self.burns.len() - 1] {
            let Some(orbit) = burn.orbit() else { break };
            mass -= burn.propellant;
            ignitions.push((orbit, mass));
        }
        ignitions
    }

    /// Orbit after each burn and its time (s): a start of sequences with free orbits. Without a semi-major axis the perigee is that of
    /// the parking orbit.
    pub(super) fn guess(&self, stage: &Stage) -> Vec<(Orbit, f64)> {
        let of = |b: &PrintedBurn| {
            let e = b.eccentricity;
            b.orbit().unwrap_or(Orbit { axis: stage.parking_radius / (1.0 - e), eccentricity: e })
        };
        self.burns.iter().map(|b| (of(b), b.time)).collect()
    }
}

/// The burns of Table 2.
pub(super) const TWO_BURNS: &[PrintedBurn; 2] =
    &[PrintedBurn::new(24588.0, 0.7142, 2033.0, 12480.0), PrintedBurn::new(42164.0, 0.0, 562.0, 3451.0)];

pub(super) const TABLES: [BurnTable; 5] = [
    BurnTable { id: "table-2", number: 2, burns: TWO_BURNS, time: (2595.0, 0.5), propellant: (15931.0, 0.5) },
    BurnTable {
        id: "table-3",
        number: 3,
        burns: &[
            PrintedBurn::new(8733.1, 0.2456, 905.0, 5554.6),
            PrintedBurn::new(24438.0, 0.7247, 1047.1, 6429.5),
            PrintedBurn::new(42164.0, 0.0, 600.6, 3687.8),
        ],
        time: (2552.4, 0.05),
        propellant: (15672.0, 0.5),
    },
    BurnTable {
        id: "table-4",
        number: 4,
        burns: &[
            PrintedBurn::new(7733.1, 0.1481, 574.0, 3525.3),
            PrintedBurn::new(10491.0, 0.3706, 650.0, 3991.0),
            PrintedBurn::new(24374.0, 0.7281, 703.0, 4316.4),
            PrintedBurn::new(42164.0, 0.0, 618.0, 3797.4),
        ],
        time: (2546.0, 0.5),
        propellant: (15630.0, 0.5),
    },
    BurnTable {
        id: "table-5",
        number: 5,
        burns: &[
            PrintedBurn::new(7363.1, 0.1039, 435.0, 2670.9),
            PrintedBurn::new(8365.6, 0.2107, 357.0, 2191.98),
            PrintedBurn::new(9895.6, 0.3317, 345.0, 2118.3),
            PrintedBurn::new(13251.0, 0.5002, 387.0, 2376.18),
            PrintedBurn::new(24394.0, 0.7283, 404.0, 2480.56),
            PrintedBurn::new(42164.0, 0.0, 612.0, 3757.68),
        ],
        time: (2540.0, 0.5),
        propellant: (15595.6, 0.05),
    },
    BurnTable {
        id: "table-6",
        number: 6,
        burns: &[
            PrintedBurn::without(0.1187, 474.0, 2913.1),
            PrintedBurn::without(0.2612, 456.0, 2802.5),
            PrintedBurn::without(0.4457, 466.0, 2862.6),
            PrintedBurn::without(0.728, 524.0, 3215.1),
            PrintedBurn::new(42164.0, 0.0, 621.0, 3811.2),
        ],
        time: (2541.0, 0.5),
        propellant: (15604.0, 0.5),
    },
];

/// Table 7, canonical units: distance, radial and horizontal speed at the end.
pub(super) const TABLE_7: [f64; 3] = [6.408, 7.0656e-4, 0.3954];
/// Cost of the error of Table 7 by the text, kg.
pub(super) const PRINTED_CORRECTION: f64 = 100.0;
/// Eccentricity after each burn and propellant (kg) of the five burns of reference [20], Bortakovskii and Konovalova 2013.
pub(super) const REFERENCE_20_BURNS: [(f64, f64); 5] =
    [(0.11689, 2934.9), (0.26119, 2941.0), (0.44576, 2953.3), (0.728, 3315.6), (0.00208, 3892.7)];
/// Propellant of five burns in the text's reference [20], to which it compares Table 6, kg.
pub(super) const REFERENCE_20: f64 = 16_037.5;
