//! Seeded synthetic terrain whose hazards are known.
//!
//! The height of a pixel is a function of the seed and of the pixel's row and column alone: a plane, a fractal surface, craters and
//! boulders. Any window of a map can therefore be made by itself, bit for bit equal to the same part of the whole map, on any number
//! of threads; maps larger than memory are made in bands of rows.
//!
//! | part | law | source |
//! | --- | --- | --- |
//! | fractal surface | rms difference of heights over a distance `d` grows with `d^H` | M. K. Shepard et al., J. Geophys. Res. 106 (2001) 32777, doi 10.1029/2000JE001429 |
//! | sizes of craters | cumulative power law `N(>D) = c D^-b` per area | N. J. Trask, in Ranger VIII and IX, JPL TR 32-800 (1966): `c` = 10^10.9 per 10^6 km2 with `D` in m, `b` = 2 in equilibrium |
//! | shape of craters | paraboloid bowl, rim, ejecta falling with `r^-3` | R. J. Pike, in Impact and Explosion Cratering (1977) 489: depth 0.2 D, rim 0.036 D; T. R. McGetchin et al., Earth Planet. Sci. Lett. 20 (1973) 226 |
//! | sizes of boulders | covered area above `D`: `k exp(-q D)`, `q = 1.79 + 0.152 / k` | M. Golombek and D. Rapp, J. Geophys. Res. 102 (1997) 4117, doi 10.1029/96JE03319 |
//!
//! ```
//! use apsides_terrain::synthetic::{Synthetic, Terrain};
//!
//! let ground = Synthetic::new(Terrain { rows: 120, cols: 100, ..Terrain::fine() }, 7)?;
//! let map = ground.map()?;
//! let part = ground.window(30, 20, 50, 60)?;
//! assert_eq!(part, map.window(30, 20, 50, 60)?);
//! # Ok::<(), apsides_terrain::TerrainError>(())
//! ```

mod features;
mod fractal;
mod generator;

pub use features::{Boulder, Crater};
pub use generator::{BOULDER, CRATER, Limits, Synthetic};

use serde::{Deserialize, Serialize};

use crate::TerrainError;

/// The description of a synthetic terrain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Terrain {
    /// Rows of the map.
    pub rows: usize,
    /// Columns of the map.
    pub cols: usize,
    /// Size of a pixel, m.
    pub pixel: f64,
    /// Angle of the mean plane with the horizontal, rad.
    pub slope: f64,
    /// Direction in which the mean plane rises, rad, clockwise from north.
    pub upslope: f64,
    /// The fractal surface.
    pub relief: Relief,
    /// Craters.
    pub craters: Craters,
    /// Boulders.
    pub boulders: Boulders,
}

/// A fractal surface: octaves of gradient noise between a longest wavelength and twice the pixel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Relief {
    /// Hurst exponent, in (0, 1). Towards 1 the exponent found at a distance is smaller, since there are no waves beyond the longest
    /// (0.88 instead of 0.95 at a sixtieth of it).
    pub hurst: f64,
    /// Rms slope (rms difference of heights over the distance), tangent, at [`Relief::baseline`]; 0 for none.
    pub rms_slope: f64,
    /// Distance at which the rms slope holds, m.
    pub baseline: f64,
    /// Longest wavelength, m.
    pub longest: f64,
}

/// Craters with `N(>D) = density D^-exponent` per m2.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Craters {
    /// Craters per m2 larger than 1 m, if the law went that far; 0 for none. 0.0794 with exponent 2 in equilibrium.
    pub density: f64,
    /// Exponent of the cumulative law.
    pub exponent: f64,
    /// Smallest and largest diameter, m.
    pub diameters: [f64; 2],
    /// Depth from rim to floor of a fresh crater over its diameter.
    pub depth: f64,
    /// Height of the rim of a fresh crater over its diameter.
    pub rim: f64,
    /// Least part of depth and rim that degradation leaves; the part of each crater is uniform between it and 1.
    pub least_fresh: f64,
}

/// Boulders after Golombek and Rapp, half-ellipsoids.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Boulders {
    /// Part `k` of the area covered by rocks of all sizes, in [0, 1); 0 for none.
    pub abundance: f64,
    /// Smallest and largest diameter, m.
    pub diameters: [f64; 2],
    /// Least and largest height over the diameter; uniform in between. 0.5 is a hemisphere.
    pub heights: [f64; 2],
    /// Least ratio of the shorter to the longer horizontal axis; uniform up to 1. The product of the axes is that of a circle.
    pub least_aspect: f64,
}

impl Terrain {
    /// Like a map of 2300 x 2300 pixels of 1 m, seen from 2400 m: rolling ground with craters of 8 to 300 m and boulders of 1 to 8 m.
    #[must_use]
    pub fn coarse() -> Terrain {
        Terrain {
            rows: 2300,
            cols: 2300,
            pixel: 1.0,
            slope: 2.0_f64.to_radians(),
            upslope: 0.6,
            relief: Relief { hurst: 0.9, rms_slope: 0.06, baseline: 5.0, longest: 600.0 },
            craters: Craters {
                density: 0.04,
                exponent: 2.0,
                diameters: [8.0, 300.0],
                depth: 0.2,
                rim: 0.036,
                least_fresh: 0.15,
            },
            boulders: Boulders {
                abundance: 0.03,
                diameters: [1.0, 8.0],
                heights: [0.3, 0.5],
                least_aspect: 0.6,
            },
        }
    }

    /// Like a map of 1000 x 1000 pixels of 0.1 m, seen from 100 m: level ground with craters of 1 to 30 m and boulders of 0.2 to 3 m.
    #[must_use]
    pub fn fine() -> Terrain {
        Terrain {
            rows: 1000,
            cols: 1000,
            pixel: 0.1,
            slope: 1.5_f64.to_radians(),
            upslope: 2.5,
            relief: Relief { hurst: 0.85, rms_slope: 0.04, baseline: 1.0, longest: 60.0 },
            craters: Craters {
                density: 0.02,
                exponent: 2.0,
                diameters: [1.0, 30.0],
                depth: 0.2,
                rim: 0.036,
                least_fresh: 0.1,
            },
            boulders: Boulders {
                abundance: 0.02,
                diameters: [0.2, 3.0],
                heights: [0.3, 0.5],
                least_aspect: 0.6,
            },
        }
    }

    /// Every number in its range.
    fn check(&self) -> Result<(), TerrainError> {
        let positive = "it must be positive and finite";
        let part = "it must be from 0 to 1";
        let (r, c, b) = (&self.relief, &self.craters, &self.boulders);
        let finite = |x: f64| x.is_finite() && x > 0.0;
        let pair = |[low, high]: [f64; 2]| finite(low) && finite(high) && low < high;
        let order = "both must be positive, the second larger";
        let unit = |x: f64| (0.0..=1.0).contains(&x);
        let rules = [
            (
                "slope of the mean plane, rad",
                self.slope,
                (0.0..1.5).contains(&self.slope),
                "it must be in [0, 1.5)",
            ),
            ("direction of the mean plane, rad", self.upslope, self.upslope.is_finite(), "it must be finite"),
            ("Hurst exponent", r.hurst, r.hurst > 0.0 && r.hurst < 1.0, "it must be between 0 and 1"),
            ("rms slope", r.rms_slope, (0.0..=10.0).contains(&r.rms_slope), "it must be from 0 to 10"),
            ("baseline of the rms slope, m", r.baseline, finite(r.baseline), positive),
            ("longest wavelength, m", r.longest, finite(r.longest), positive),
            ("density of craters, per m2", c.density, (0.0..=1.0).contains(&c.density), part),
            (
                "exponent of the sizes of craters",
                c.exponent,
                finite(c.exponent) && c.exponent <= 10.0,
                "it must be in (0, 10]",
            ),
            ("diameter of a crater, m", c.diameters[0], pair(c.diameters), order),
            ("depth of a crater over its diameter", c.depth, unit(c.depth), part),
            (
                "rim of a crater over its diameter",
                c.rim,
                unit(c.rim) && c.rim <= c.depth,
                "it must be from 0 to the depth",
            ),
            ("least part that degradation leaves", c.least_fresh, unit(c.least_fresh), part),
            (
                "area covered by boulders",
                b.abundance,
                (0.0..0.9).contains(&b.abundance),
                "it must be in [0, 0.9)",
            ),
            ("diameter of a boulder, m", b.diameters[0], pair(b.diameters), order),
            (
                "height of a boulder over its diameter",
                b.heights[0],
                finite(b.heights[0]) && b.heights[1].is_finite() && b.heights[0] <= b.heights[1],
                "both must be positive, the second not smaller",
            ),
            (
                "ratio of the axes of a boulder",
                b.least_aspect,
                b.least_aspect > 0.1 && unit(b.least_aspect),
                "it must be in (0.1, 1]",
            ),
        ];
        match rules.into_iter().find(|(_, _, fits, _)| !fits) {
            Some((name, value, _, allowed)) => {
                Err(TerrainError::Number { name, value, allowed: allowed.into() })
            }
            None => Ok(()),
        }
    }
}
