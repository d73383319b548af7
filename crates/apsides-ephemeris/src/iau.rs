//! The axes of Earth, Moon and Mars in the ICRF, by the report of the IAU working group on cartographic coordinates and rotational elements.
//!
//! With the right ascension `alpha` and the declination `delta` of the pole and the angle `W` of the prime meridian, polynomials of time
//! with periodic terms (T in Julian centuries, d in days of TDB from J2000):
//!
//! ```text
//! alpha = a0 + a1 T + sum a sin(E),   delta = d0 + d1 T + sum d cos(E),   W = w0 + w1 d + w2 d^2 + sum w sin(E)
//! ```
//!
//! B. A. Archinal et al., *Celestial Mechanics and Dynamical Astronomy* 130 (2018) 22, doi 10.1007/s10569-017-9805-5, and its correction,
//! 131 (2019) 61. The axes of the Moon are those of its mean Earth direction, to 150 m on its surface; those of the Earth are the
//! frame `IAU_EARTH` of other programs, without nutation and the irregular part of its rotation: its prime meridian is 5 km at the equator from the
//! Earth rotation angle of the IERS Conventions in 2000, and 10 km in 2030.

use crate::Epoch;
use crate::orientation::{Orientation, Turning};

/// A body whose axes the report has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CentralBody {
    /// The Earth.
    Earth,
    /// The Moon.
    Moon,
    /// Mars.
    Mars,
}

/// Amplitudes (deg) of the pole's right ascension and declination and of the prime meridian, and the argument: its value at J2000 (deg)
/// and its rate (deg by Julian century).
type Term = ([f64; 3], [f64; 2]);

/// Pole and prime meridian: polynomials in deg, by century and by day, and periodic terms.
struct Elements {
    ascension: [f64; 2],
    declination: [f64; 2],
    meridian: [f64; 3],
    terms: &'static [Term],
}

const EARTH: Elements = Elements {
    ascension: [0.0, -0.641],
    declination: [90.0, -0.557],
    meridian: [190.147, 360.985_623_5, 0.0],
    terms: &[],
};

const MOON: Elements = Elements {
    ascension: [269.994_9, 0.003_1],
    declination: [66.539_2, 0.013_0],
    meridian: [38.321_3, 13.176_358_15, -1.4e-12],
    terms: &[
        ([-3.878_7, 1.541_9, 3.561_0], [125.045, -1_935.536_452_5]),
        ([-0.120_4, 0.023_9, 0.120_8], [250.089, -3_871.072_905]),
        ([0.070_0, -0.027_8, -0.064_2], [260.008, 475_263.332_872_5]),
        ([-0.017_2, 0.006_8, 0.015_8], [176.625, 487_269.629_985]),
        ([0.0, 0.0, 0.025_2], [357.529, 35_999.050_957_5]),
        ([0.007_2, -0.002_9, -0.006_6], [311.589, 964_468.499_31]),
        ([0.0, 0.000_9, -0.004_7], [134.963, 477_198.869_325]),
        ([0.0, 0.0, -0.004_6], [276.617, 12_006.300_765]),
        ([0.0, 0.0, 0.002_8], [34.226, 63_863.513_242_5]),
        ([-0.005_2, 0.000_8, 0.005_2], [15.134, -5_806.609_357_5]),
        ([0.0, 0.0, 0.004_0], [119.743, 131.840_64]),
        ([0.0, 0.0, 0.001_9], [239.961, 6_003.150_382_5]),
        ([0.004_3, -0.000_9, -0.004_4], [25.053, 473_327.796_42]),
    ],
};

const MARS: Elements = Elements {
    ascension: [317.269_202, -0.109_275_47],
    declination: [54.432_516, -0.058_271_05],
    meridian: [176.049_863, 350.891_982_443_297, 0.0],
    terms: &[
        ([0.000_068, 0.0, 0.0], [198.991_226, 19_139.481_998_5]),
        ([0.000_238, 0.0, 0.0], [226.292_679, 38_280.851_128_1]),
        ([0.000_052, 0.0, 0.0], [249.663_391, 57_420.725_159_3]),
        ([0.000_009, 0.0, 0.0], [266.183_510, 76_560.636_795_0]),
        ([0.419_057, 0.0, 0.0], [79.398_797, 0.504_261_5]),
        ([0.0, 0.000_051, 0.0], [122.433_576, 19_139.940_747_6]),
        ([0.0, 0.000_141, 0.0], [43.058_401, 38_280.875_327_2]),
        ([0.0, 0.000_031, 0.0], [57.663_379, 57_420.751_720_5]),
        ([0.0, 0.000_005, 0.0], [79.476_401, 76_560.649_500_4]),
        ([0.0, 1.591_274, 0.0], [166.325_722, 0.504_261_5]),
        ([0.0, 0.0, 0.000_145], [129.071_773, 19_140.032_824_4]),
        ([0.0, 0.0, 0.000_157], [36.352_167, 38_281.047_359_1]),
        ([0.0, 0.0, 0.000_040], [56.668_646, 57_420.929_536_0]),
        ([0.0, 0.0, 0.000_001], [67.364_003, 76_560.255_221_5]),
        ([0.0, 0.0, 0.000_001], [104.792_680, 95_700.438_757_8]),
        ([0.0, 0.0, 0.584_542], [95.391_654, 0.504_261_5]),
    ],
};

/// Seconds of a day and of a Julian century.
const DAY: f64 = 86_400.0;
const CENTURY: f64 = 36_525.0 * DAY;

impl CentralBody {
    /// All bodies.
    pub const ALL: [Self; 3] = [Self::Earth, Self::Moon, Self::Mars];

    /// The name of the body in files.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Earth => "EARTH",
            Self::Moon => "MOON",
            Self::Mars => "MARS",
        }
    }

    /// The body that has a gravitational parameter (m3/s2) to within one percent; none where it is another one.
    #[must_use]
    pub fn of_gravity(parameter: f64) -> Option<Self> {
        let is_near = |body: &Self| (parameter / body.gravitational_parameter() - 1.0).abs() < 0.01;
        Self::ALL.into_iter().find(is_near)
    }

    /// Gravitational parameter, m3/s2: WGS 84, GRGM1200A and MRO120D.
    #[must_use]
    pub const fn gravitational_parameter(self) -> f64 {
        match self {
            Self::Earth => 398_600.441_8e9,
            Self::Moon => 4_902.800_1e9,
            Self::Mars => 42_828.375_2e9,
        }
    }

    const fn elements(self) -> &'static Elements {
        match self {
            Self::Earth => &EARTH,
            Self::Moon => &MOON,
            Self::Mars => &MARS,
        }
    }

    /// The axes fixed to the body in those of the ICRF at an instant: the first towards the prime meridian, the third towards the pole.
    #[must_use]
    pub fn orientation(self, epoch: &Epoch) -> Orientation {
        let Elements { ascension, declination, meridian, terms } = self.elements();
        let (days, seconds) = epoch.tdb_days();
        let d = days + seconds / DAY;
        let t = d * DAY / CENTURY;
        // Whole turns in whole days are left out, so that no digits are lost.
        let turned = (meridian[1].rem_euclid(360.0) * days).rem_euclid(360.0) + meridian[1] * seconds / DAY;
        let mut angles = [
            ascension[0] + ascension[1] * t,
            declination[0] + declination[1] * t,
            meridian[0] + turned + meridian[2] * d * d,
        ];
        let mut rates =
            [ascension[1] / CENTURY, declination[1] / CENTURY, (meridian[1] + 2.0 * meridian[2] * d) / DAY];
        for ([a, b, c], [begin, rate]) in *terms {
            let (sin, cos) = (begin + rate * t).to_radians().sin_cos();
            let per_second = rate.to_radians() / CENTURY;
            angles[0] += a * sin;
            angles[1] += b * cos;
            angles[2] += c * sin;
            rates[0] += a * cos * per_second;
            rates[1] -= b * sin * per_second;
            rates[2] += c * cos * per_second;
        }
        let [alpha, delta, w] = [0, 1, 2].map(|k| Turning::degrees(angles[k], rates[k]));
        Orientation::of_pole(alpha, delta, w)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kilometres of the equator.
    const KILOMETRES_PER_DEGREE: f64 = 111.3;

    /// Kilometres that are said in whole ones.
    const ROUNDED: f64 = 0.6;

    /// Days of TDB from J2000 and the seconds from UT1 to TDB: the start of 2000 (IERS), and of 2030 with no leap second after 2017.
    const EPOCHS: [(f64, f64, f64); 2] = [(0.0, 63.8, 5.0), (10_957.5, 69.2, 10.0)];

    #[test]
    fn the_axes_of_the_earth_are_as_far_from_the_rotation_angle_as_is_said() {
        for (days, behind, kilometres) in EPOCHS {
            let centuries = days * DAY / CENTURY;
            // IERS Conventions (2010), eq. 5.15, deg: whole turns in whole days are left out.
            let ut1 = days - behind / DAY;
            let angle = 360.0 * (0.779_057_273_264_0 + 0.002_737_811_911_354_48 * ut1 + ut1.fract());
            let node = 90.0 + EARTH.ascension[0] + EARTH.ascension[1] * centuries;
            let meridian = node + EARTH.meridian[0] + EARTH.meridian[1] * days;
            let apart = (angle - meridian + 180.0).rem_euclid(360.0) - 180.0;
            assert!(
                (apart.abs() * KILOMETRES_PER_DEGREE - kilometres).abs() < ROUNDED,
                "{days}: {apart} deg"
            );
        }
    }
}
