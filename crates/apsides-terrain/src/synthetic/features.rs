//! Craters and boulders: sizes, places and shapes, drawn cell by cell.

use std::f64::consts::{FRAC_PI_4, TAU};

use rand_distr::{Distribution, Poisson};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use serde::Serialize;

use super::fractal::{lattice, mix};
use super::{Boulders, Craters, Terrain};
use crate::TerrainError;

/// Distance over the radius at which the ejecta of a crater end.
const EJECTA: f64 = 3.0;

/// Mean number of features of a size class in a cell, where cells can be that small.
const PER_CELL: f64 = 8.0;

/// A crater.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Crater {
    /// Centre (east, north), m.
    pub centre: [f64; 2],
    /// Diameter of the rim, m.
    pub diameter: f64,
    /// From the rim to the floor, m.
    pub depth: f64,
    /// Height of the rim over the ground around, m.
    pub rim: f64,
}

/// A boulder: the upper half of an ellipsoid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Boulder {
    /// Centre (east, north), m.
    pub centre: [f64; 2],
    /// Diameter of the circle of the same area, m.
    pub diameter: f64,
    /// Longer and shorter horizontal axis (diameters), m.
    pub axes: [f64; 2],
    /// Direction of the longer axis, rad, clockwise from north.
    pub azimuth: f64,
    /// Height over the ground, m.
    pub height: f64,
}

/// A feature with a place and an outer limit.
pub(super) trait Feature: Copy + Send + Sync {
    fn centre(&self) -> [f64; 2];
    /// Half of the side of the square that it changes, m.
    fn reach(&self) -> f64;
    /// The height added to the ground at an offset (east, north; m) from the centre, m; zero outside.
    fn height_at(&self, offset: [f64; 2]) -> f64;
    /// Tells whether an offset is inside its rim or outline.
    fn covers(&self, offset: [f64; 2]) -> bool;
}

impl Feature for Crater {
    fn centre(&self) -> [f64; 2] {
        self.centre
    }

    fn reach(&self) -> f64 {
        0.5 * EJECTA * self.diameter
    }

    fn height_at(&self, [east, north]: [f64; 2]) -> f64 {
        let square = (east * east + north * north) / (0.25 * self.diameter * self.diameter);
        if square <= 1.0 {
            return self.rim - self.depth * (1.0 - square);
        }
        if square >= EJECTA * EJECTA {
            return 0.0;
        }
        // Falls with the third power, and to zero where the ejecta end.
        let end = EJECTA.powi(-3);
        self.rim * ((square * square.sqrt()).recip() - end) / (1.0 - end)
    }

    fn covers(&self, [east, north]: [f64; 2]) -> bool {
        east * east + north * north <= 0.25 * self.diameter * self.diameter
    }
}

impl Boulder {
    /// Squared distance from the centre in units of the outline.
    fn square(&self, [east, north]: [f64; 2]) -> f64 {
        let (s, c) = self.azimuth.sin_cos();
        let along = (east * s + north * c) / (0.5 * self.axes[0]);
        let across = (east * c - north * s) / (0.5 * self.axes[1]);
        along * along + across * across
    }
}

impl Feature for Boulder {
    fn centre(&self) -> [f64; 2] {
        self.centre
    }

    fn reach(&self) -> f64 {
        0.5 * self.axes[0]
    }

    fn height_at(&self, offset: [f64; 2]) -> f64 {
        self.height * (1.0 - self.square(offset)).max(0.0).sqrt()
    }

    fn covers(&self, offset: [f64; 2]) -> bool {
        self.square(offset) <= 1.0
    }
}

/// Random numbers of a cell.
struct Draw(Xoshiro256PlusPlus);

impl Draw {
    /// Uniform in [0, 1).
    fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (0.5 * f64::EPSILON)
    }

    fn between(&mut self, [low, high]: [f64; 2]) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// From the density `D^-(exponent + 1)` between two diameters.
    fn power_law(&mut self, [low, high]: [f64; 2], exponent: f64) -> f64 {
        let (a, b) = (low.powf(-exponent), high.powf(-exponent));
        (a - self.uniform() * (a - b)).powf(-exponent.recip())
    }
}

/// Features of diameters within a factor of two, with the cells that they are drawn in.
struct Class {
    diameters: [f64; 2],
    /// Mean number per m2.
    density: f64,
    /// Side of a cell, m.
    cell: f64,
    /// Largest reach, m.
    reach: f64,
    seed: u64,
}

impl Class {
    /// Classes between two diameters; `density` and `reach` of each from its two diameters.
    fn all(
        [low, high]: [f64; 2],
        seed: u64,
        density: impl Fn([f64; 2]) -> f64,
        reach: impl Fn(f64) -> f64,
    ) -> Vec<Class> {
        let mut classes = Vec::new();
        let mut from = low;
        while from < high {
            let diameters = [from, (2.0 * from).min(high)];
            let (density, reach) = (density(diameters), reach(diameters[1]));
            if density > 0.0 {
                // Small cells cost little where a window is small; each has a few features at least.
                let cell = (PER_CELL / density).sqrt().max(reach);
                let seed = mix(seed ^ mix(classes.len() as u64));
                classes.push(Class { diameters, density, cell, reach, seed });
            }
            from = diameters[1];
        }
        classes
    }

    /// Mean number of features whose cells may touch a box of (west, east, south, north) limits, at least.
    fn expected(&self, [west, east, south, north]: [f64; 4]) -> f64 {
        let side = |low: f64, high: f64| high - low + 2.0 * self.reach;
        self.density * side(west, east) * side(south, north)
    }

    /// Draws the features whose cells may touch a box of (east, north) limits, always in the same order.
    fn draw<F>(
        &self,
        [west, east, south, north]: [f64; 4],
        into: &mut Vec<F>,
        mut one: impl FnMut(&mut Draw, [f64; 2], [f64; 2]) -> Option<F>,
    ) {
        let index = |x: f64| (x / self.cell).floor() as i64;
        for j in index(south - self.reach)..=index(north + self.reach) {
            for i in index(west - self.reach)..=index(east + self.reach) {
                let mut draw = Draw(Xoshiro256PlusPlus::seed_from_u64(lattice(self.seed, i, j)));
                let Ok(poisson) = Poisson::new(self.density * self.cell * self.cell) else { continue };
                let count: f64 = poisson.sample(&mut draw.0);
                for _ in 0..count as usize {
                    let centre = [i, j].map(|k| (k as f64 + draw.uniform()) * self.cell);
                    into.extend(one(&mut draw, centre, self.diameters));
                }
            }
        }
    }
}

/// Tells whether a feature may change a box of (west, east, south, north).
fn touches(feature: &impl Feature, [west, east, south, north]: [f64; 4]) -> bool {
    let ([x, y], r) = (feature.centre(), feature.reach());
    x + r >= west && x - r <= east && y + r >= south && y - r <= north
}

/// Most features of a sort that are drawn at once: those of a thousand square kilometres of coarse ground, one or two gigabytes.
const MOST: f64 = 2e7;

/// Classes whose features in a box of (west, east, south, north) limits, m, memory holds.
fn classes_for(
    limits: [f64; 4],
    name: &'static str,
    classes: Vec<Class>,
) -> Result<Vec<Class>, TerrainError> {
    let value: f64 = classes.iter().map(|class| class.expected(limits)).sum();
    if value <= MOST {
        return Ok(classes);
    }
    let allowed = "at most 2e7 are drawn at once: take smaller pixels, or fewer of them at once";
    Err(TerrainError::Number { name, value: value.round(), allowed: allowed.into() })
}

fn crater_classes(law: &Craters, seed: u64, limits: [f64; 4]) -> Result<Vec<Class>, TerrainError> {
    let density = |[a, b]: [f64; 2]| law.density * (a.powf(-law.exponent) - b.powf(-law.exponent));
    let classes = Class::all(law.diameters, seed, density, |d| 0.5 * EJECTA * d);
    classes_for(limits, "number of craters on these pixels", classes)
}

/// Decay of the area of boulders over their diameter, 1/m; none without boulders.
fn decay(law: &Boulders) -> Option<f64> {
    (law.abundance > 0.0).then(|| 1.79 + 0.152 / law.abundance)
}

fn boulder_classes(law: &Boulders, seed: u64, limits: [f64; 4]) -> Result<Vec<Class>, TerrainError> {
    let Some(q) = decay(law) else { return Ok(Vec::new()) };
    // From the area k exp(-q D) follows the number per diameter, k q exp(-q D) / (pi D^2 / 4). It is drawn from 1 / D^2 and
    // thinned by the exponential.
    let density = |[a, b]: [f64; 2]| law.abundance * q * (-q * a).exp() / FRAC_PI_4 * (a.recip() - b.recip());
    let reach = |d: f64| 0.5 * d / law.least_aspect.sqrt();
    let classes = Class::all(law.diameters, seed, density, reach);
    classes_for(limits, "number of boulders on these pixels", classes)
}

/// Mean number of craters and boulders of a box of (west, east, south, north) limits, m.
///
/// # Errors
/// As of [`check`].
pub(super) fn expected(terrain: &Terrain, limits: [f64; 4]) -> Result<[f64; 2], TerrainError> {
    let count = |classes: Vec<Class>| classes.iter().map(|class| class.expected(limits)).sum();
    let craters = crater_classes(&terrain.craters, 0, limits)?;
    Ok([count(craters), count(boulder_classes(&terrain.boulders, 0, limits)?)])
}

/// Refuses a box of (west, east, south, north) limits, m, with more craters or boulders than memory holds.
pub(super) fn check(terrain: &Terrain, limits: [f64; 4]) -> Result<(), TerrainError> {
    crater_classes(&terrain.craters, 0, limits)?;
    boulder_classes(&terrain.boulders, 0, limits).map(drop)
}

/// Craters that may change a box of (west, east, south, north) limits, m, the smallest first.
///
/// # Errors
/// More craters than memory holds.
pub(super) fn craters(law: &Craters, seed: u64, limits: [f64; 4]) -> Result<Vec<Crater>, TerrainError> {
    let mut all = Vec::new();
    for class in crater_classes(law, seed, limits)? {
        class.draw(limits, &mut all, |draw, centre, diameters| {
            let diameter = draw.power_law(diameters, law.exponent);
            let fresh = draw.between([law.least_fresh, 1.0]);
            let crater = Crater {
                centre,
                diameter,
                depth: fresh * law.depth * diameter,
                rim: fresh * law.rim * diameter,
            };
            touches(&crater, limits).then_some(crater)
        });
    }
    Ok(all)
}

/// Boulders that may change a box of (west, east, south, north) limits, m, the smallest first.
///
/// # Errors
/// More boulders than memory holds.
pub(super) fn boulders(law: &Boulders, seed: u64, limits: [f64; 4]) -> Result<Vec<Boulder>, TerrainError> {
    let Some(q) = decay(law) else { return Ok(Vec::new()) };
    let mut all = Vec::new();
    for class in boulder_classes(law, seed, limits)? {
        class.draw(limits, &mut all, |draw, centre, diameters| {
            let diameter = draw.power_law(diameters, 1.0);
            let kept = draw.uniform() < (-q * (diameter - diameters[0])).exp();
            let aspect = draw.between([law.least_aspect, 1.0]).sqrt();
            let boulder = Boulder {
                centre,
                diameter,
                axes: [diameter / aspect, diameter * aspect],
                azimuth: draw.between([0.0, TAU]),
                height: diameter * draw.between(law.heights),
            };
            (kept && touches(&boulder, limits)).then_some(boulder)
        });
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-12;

    const SQUARE: f64 = 2000.0;

    /// Discretisation: what the height changes over a micrometre, m.
    const AT_RIM_M: f64 = 1e-6;

    /// Discretisation: what is left of the ejecta a millimetre before they end, m.
    const AT_END_M: f64 = 1e-4;

    fn inside<F: Feature>(all: &[F]) -> Vec<F> {
        let within = |x: f64| (0.0..SQUARE).contains(&x);
        all.iter().filter(|f| f.centre().iter().all(|&x| within(x))).copied().collect()
    }

    /// Number and exponent (maximum likelihood; A. Clauset et al., SIAM Rev. 51 (2009) 661) of the craters drawn.
    #[test]
    fn sizes_of_craters_follow_their_law() {
        for (exponent, density) in [(2.0, 0.0794), (1.8, 0.05), (3.0, 0.3)] {
            let law = Craters {
                density,
                exponent,
                diameters: [4.0, 400.0],
                depth: 0.2,
                rim: 0.036,
                least_fresh: 0.5,
            };
            let all = inside(&craters(&law, 11, [0.0, SQUARE, 0.0, SQUARE]).unwrap());
            let expected = density * (4.0_f64.powf(-exponent) - 400.0_f64.powf(-exponent)) * SQUARE * SQUARE;
            let count = all.len() as f64;
            assert!((count - expected).abs() < 4.0 * expected.sqrt(), "{count} {expected}");
            let fitted = count / all.iter().map(|c| (c.diameter / 4.0).ln()).sum::<f64>();
            assert!((fitted - exponent).abs() < 4.0 * exponent / count.sqrt() + 0.003, "{fitted} {exponent}");
            assert!(all.iter().all(|c| c.depth >= 0.0999 * c.diameter && c.depth <= 0.2 * c.diameter));
        }
    }

    /// The area covered by boulders above each diameter is that of Golombek and Rapp.
    #[test]
    fn areas_of_boulders_follow_their_law() {
        for k in [0.02, 0.05, 0.2] {
            let law =
                Boulders { abundance: k, diameters: [0.3, 5.0], heights: [0.4, 0.6], least_aspect: 0.5 };
            let q = 1.79 + 0.152 / k;
            let side: f64 = 400.0;
            let all: Vec<Boulder> = boulders(&law, 5, [0.0, side, 0.0, side])
                .unwrap()
                .into_iter()
                .filter(|b| b.centre.iter().all(|&x| (0.0..side).contains(&x)))
                .collect();
            for least in [0.3, 0.5, 0.8] {
                let above: Vec<f64> = all
                    .iter()
                    .filter(|b| b.diameter > least)
                    .map(|b| FRAC_PI_4 * b.axes[0] * b.axes[1])
                    .collect();
                let expected = k * ((-q * least).exp() - (-q * 5.0).exp());
                let found = above.iter().sum::<f64>() / (side * side);
                let spread = above.iter().map(|a| a * a).sum::<f64>().sqrt() / (side * side);
                assert!((found - expected).abs() < 4.0 * spread, "{k} {least}: {found} {expected} {spread}");
            }
        }
    }

    #[test]
    fn profiles_of_a_crater_and_a_boulder() {
        let crater = Crater { centre: [0.0; 2], diameter: 20.0, depth: 4.0, rim: 0.72 };
        assert!((crater.height_at([0.0, 0.0]) + 3.28).abs() < ROUNDING);
        assert!((crater.height_at([6.0, 8.0]) - 0.72).abs() < ROUNDING);
        assert!((crater.height_at([10.000001, 0.0]) - 0.72).abs() < AT_RIM_M);
        assert!(crater.height_at([29.999, 0.0]) < AT_END_M && crater.height_at([31.0, 0.0]) == 0.0);
        let boulder =
            Boulder { centre: [0.0; 2], diameter: 2.0, axes: [4.0, 1.0], azimuth: 0.0, height: 0.8 };
        assert_eq!(boulder.height_at([0.0, 0.0]), 0.8);
        assert!(boulder.covers([0.0, 1.99]) && !boulder.covers([0.51, 0.0]));
        assert!((boulder.height_at([0.0, 1.2]) - 0.64).abs() < ROUNDING);
    }
}
