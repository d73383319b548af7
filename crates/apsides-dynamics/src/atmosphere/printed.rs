//! The US Standard Atmosphere 1976 as many flight programs have it: its layers up to 86 km, above them its printed densities with straight
//! lines between their logarithms.

use super::constants::BASE;
use super::standard;

/// Altitude (m) and density (kg/m3) of the standard's table, every 5 km up to 130 km and every 10 km beyond (NASA-TM-X-74335, 1976).
const PRINTED: [(f64, f64); 17] = [
    (86e3, 6.958e-6),
    (90e3, 3.416e-6),
    (95e3, 1.393e-6),
    (100e3, 5.604e-7),
    (105e3, 2.325e-7),
    (110e3, 9.708e-8),
    (115e3, 4.289e-8),
    (120e3, 2.222e-8),
    (125e3, 1.291e-8),
    (130e3, 8.152e-9),
    (140e3, 3.831e-9),
    (150e3, 2.076e-9),
    (160e3, 1.233e-9),
    (170e3, 7.815e-10),
    (180e3, 5.194e-10),
    (190e3, 3.581e-10),
    (200e3, 2.541e-10),
];

/// Highest altitude of the table, m.
pub(super) const TOP: f64 = PRINTED[PRINTED.len() - 1].0;

/// Density, kg/m3, with its derivatives. The last line goes on above the table.
pub(super) fn density(altitude: f64) -> [f64; 3] {
    if altitude <= BASE {
        return standard::density(altitude);
    }
    let above = PRINTED.partition_point(|row| row.0 <= altitude).clamp(1, PRINTED.len() - 1);
    let ((low, first), (high, last)) = (PRINTED[above - 1], PRINTED[above]);
    // Continuous with the layers, of which the table has four digits.
    let first = if above == 1 { standard::density(BASE)[0] } else { first };
    let slope = (last / first).ln() / (high - low);
    let density = first * (slope * (altitude - low)).exp();
    [density, slope * density, slope * slope * density]
}

/// Altitudes, m, at which a derivative jumps.
pub(super) fn kinks() -> impl Iterator<Item = f64> {
    standard::kinks().chain(PRINTED[1..PRINTED.len() - 1].iter().map(|row| row.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-12;

    /// Discretisation: what the density changes over a micrometre.
    const JOINED: f64 = 1e-9;

    /// Discretisation: straight lines of the logarithm between the rows.
    const CHORD: f64 = 0.03;

    /// Published: the digits of the rows, and the accuracy to which this crate solves the equations of the standard.
    const PUBLISHED: f64 = 2e-3;

    #[test]
    fn not_a_number_stays_one() {
        assert!(density(f64::NAN)[0].is_nan());
    }

    #[test]
    fn layers_below_and_straight_lines_above() {
        for z in [-1e3, 0.0, 33_333.0, 85_999.0] {
            assert_eq!(density(z), standard::density(z));
        }
        for pair in PRINTED[1..].windows(2) {
            let middle = density(0.5 * (pair[0].0 + pair[1].0))[0];
            assert!((middle / (pair[0].1 * pair[1].1).sqrt() - 1.0).abs() < ROUNDING);
            assert!((density(pair[1].0)[0] / pair[1].1 - 1.0).abs() < ROUNDING);
        }
        assert!((density(BASE + 1e-6)[0] / density(BASE)[0] - 1.0).abs() < JOINED);
        // The standard itself is convex between the rows.
        let exact = standard::density(112_500.0)[0];
        assert!((density(112_500.0)[0] / exact - 1.0).abs() < CHORD && density(112_500.0)[0] > exact);
        // The rows are those of the standard, whose equations are solved in this crate, to their digits and its accuracy.
        for (z, printed) in PRINTED {
            assert!((printed / standard::density(z)[0] - 1.0).abs() < PUBLISHED, "{z}: {printed}");
        }
        assert!(density(1e6)[0] > 0.0 && density(1e7)[0].is_finite());
    }
}
