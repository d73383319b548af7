//! The US Standard Atmosphere 1976 as many flight programs have it: its layers up to 86 km, above them its printed densities.

use apsides_dynamics::DynamicsError;
use apsides_dynamics::atmosphere::{Atmosphere, AtmosphereTable, Gas};

/// Top of the layers, m.
const LAYERS_TOP: f64 = 86_000.0;
/// Spacing of the table, m: its interpolation is then that of the layers, and linear in the logarithm above them.
const SPACING: f64 = 100.0;

/// Printed densities above the layers: altitude in km and kg/m3 (NASA-TM-X-74335, table VIII, every 5 km, every 10 km from 130 km on).
const PRINTED: [(f64, f64); 17] = [
    (86.0, 6.958e-6),
    (90.0, 3.416e-6),
    (95.0, 1.393e-6),
    (100.0, 5.604e-7),
    (105.0, 2.325e-7),
    (110.0, 9.708e-8),
    (115.0, 4.289e-8),
    (120.0, 2.222e-8),
    (125.0, 1.291e-8),
    (130.0, 8.152e-9),
    (140.0, 3.831e-9),
    (150.0, 2.076e-9),
    (160.0, 1.233e-9),
    (170.0, 7.815e-10),
    (180.0, 5.194e-10),
    (190.0, 3.581e-10),
    (200.0, 2.541e-10),
];

/// The layers of the standard, and logarithms of the printed densities with straight lines between them, up to 200 km. Temperatures are
/// those of the standard.
pub(super) fn us_1976_printed() -> Result<AtmosphereTable, DynamicsError> {
    let standard = Atmosphere::UsStandard1976;
    let layers = (0..).map(|k| f64::from(k) * SPACING).take_while(|z| *z < LAYERS_TOP);
    let mut rows: Vec<[f64; 2]> = layers.map(|z| [z, standard.density(z)]).collect();
    for pair in PRINTED.windows(2) {
        let ([low, first], [high, last]) = ([pair[0].0 * 1e3, pair[0].1], [pair[1].0 * 1e3, pair[1].1]);
        let steps = ((high - low) / SPACING).round();
        rows.extend((0..steps as usize).map(|k| {
            let part = k as f64 / steps;
            [low + part * (high - low), first * (last / first).powf(part)]
        }));
    }
    let (top, density) = PRINTED[PRINTED.len() - 1];
    rows.push([top * 1e3, density]);
    let column = |k: usize| rows.iter().map(|r| r[k]).collect::<Vec<_>>();
    let temperatures: Vec<f64> = rows.iter().map(|r| standard.temperature(r[0])).collect();
    AtmosphereTable::new(&column(0), &column(1), &temperatures, Gas::AIR)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_below_and_straight_lines_above() {
        let (table, standard) = (us_1976_printed().unwrap(), Atmosphere::UsStandard1976);
        // The slope jumps between layers, at 11.019 km first; a cubic rounds that off.
        let cases = [
            (0.0, 1e-6),
            (10_750.0, 1e-6),
            (10_950.0, 2e-4),
            (33_333.0, 1e-6),
            (71_600.0, 1e-6),
            (85_000.0, 1e-6),
        ];
        for (z, tolerance) in cases {
            let (found, expected): (f64, f64) = (table.density(z), standard.density(z));
            assert!((found / expected - 1.0).abs() < tolerance, "{z}: {found} {expected}");
        }
        let middle: f64 = table.density(112_500.0);
        assert!((middle / (9.708e-8_f64 * 4.289e-8).sqrt() - 1.0).abs() < 1e-9);
        // The standard itself is convex there.
        let exact: f64 = standard.density(112_500.0);
        assert!((middle / exact - 1.0).abs() < 0.03 && middle > exact);
    }
}
