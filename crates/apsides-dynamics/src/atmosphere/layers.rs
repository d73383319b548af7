//! The seven layers of the US Standard Atmosphere 1976, of constant gradient of the molecular temperature in geopotential height, as polynomials of
//! the geometric altitude on short panels.
//!
//! In a layer, with the height `H`, the base `b`, `T = T_b + L (H - H_b)` and `H = R z / (R + z)`,
//!
//! ```text
//! rho = rho_b (T / T_b)^(-1 - g0 M0 / (R* L)),   rho = rho_b exp(-g0 M0 (H - H_b) / (R* T_b)) where L = 0
//! ```
//!
//! (NASA-TM-X-74335, 1976, equations 18, 23, 33 and 42). Taylor's series about the middle of a panel of at most 400 m have all digits after eight
//! terms of the density and four of the temperature; a power and two quotients cost several times as much.

use std::sync::LazyLock;

use super::Gas;
use super::constants::{BASE, BOTTOM, GAS_CONSTANT, Jet, MOLAR_MASS, RADIUS};
use super::panels::Panels;
use crate::engine::STANDARD_GRAVITY;

/// Hydrostatic constant `g0 M0 / R*`, K/m.
const HYDROSTATIC: f64 = STANDARD_GRAVITY * MOLAR_MASS / GAS_CONSTANT;
/// Widest panel, m.
const WIDEST: f64 = 400.0;

/// Base of a layer.
struct Layer {
    /// Geopotential height, m.
    height: f64,
    /// Gradient of the molecular temperature, K/m.
    gradient: f64,
    /// Molecular temperature, K.
    temperature: f64,
    /// Density, kg/m3.
    density: f64,
}

const fn layer(height: f64, gradient: f64, temperature: f64, density: f64) -> Layer {
    Layer { height, gradient, temperature, density }
}

/// Table 4, with the densities that follow from 101325 Pa and 288.15 K at sea level.
const LAYERS: [Layer; 7] = [
    layer(0.0, -0.0065, 288.15, 1.2249991558877122),
    layer(11000.0, 0.0, 216.65, 0.36391777591155783),
    layer(20000.0, 0.001, 216.65, 0.08803480364710484),
    layer(32000.0, 0.0028, 228.65, 0.013224999644107832),
    layer(47000.0, 0.0, 270.65, 0.001427532512064436),
    layer(51000.0, -0.0028, 270.65, 0.0008616049125405525),
    layer(71000.0, -0.002, 214.65, 6.421098672004283e-05),
];

/// Terms of density (kg/m3), speed of sound (m/s) and molecular temperature (K) in powers of the altitude (m) above the middle of a panel.
struct Panel {
    middle: f64,
    density: [f64; 8],
    sound: [f64; 8],
    temperature: [f64; 4],
}

static PANELS: LazyLock<Panels<Panel, 7>> = LazyLock::new(|| {
    let ends = |k: usize| match k {
        0 => BOTTOM,
        7 => BASE,
        _ => LAYERS[k].altitude(),
    };
    Panels::new(ends, [WIDEST; 7], |k, [from, to]| LAYERS[k].panel(0.5 * (from + to)))
});

/// Density, kg/m3, at a geometric altitude (m) from -5 to 86 km.
#[inline]
pub(super) fn density(altitude: f64) -> Jet {
    let (panel, z) = locate(altitude);
    seventh_degree(&panel.density, z, 2)
}

/// Molecular temperature, K, there.
#[inline]
pub(super) fn temperature(altitude: f64) -> Jet {
    let (panel, z) = locate(altitude);
    cubic(&panel.temperature, z)
}

/// Density, kg/m3, and speed of sound, m/s, there, with derivatives up to an order.
#[inline(always)]
pub(super) fn density_and_sound(altitude: f64, order: usize) -> [Jet; 2] {
    let (panel, z) = locate(altitude);
    [seventh_degree(&panel.density, z, order), seventh_degree(&panel.sound, z, order)]
}

/// The panel of an altitude, and the altitude above its middle.
#[inline(always)]
fn locate(altitude: f64) -> (&'static Panel, f64) {
    let panel = PANELS.at(altitude);
    (panel, altitude - panel.middle)
}

/// Geometric altitudes, m, of the boundaries between the layers.
pub(super) fn boundaries() -> impl Iterator<Item = f64> {
    LAYERS[1..].iter().map(Layer::altitude)
}

impl Layer {
    /// Geometric altitude of the base, m.
    fn altitude(&self) -> f64 {
        RADIUS * self.height / (RADIUS - self.height)
    }

    /// Taylor's series at a geometric altitude (m).
    fn panel(&self, middle: f64) -> Panel {
        let u = RADIUS + middle;
        let height = RADIUS * middle / u;
        let by_u = RADIUS / u;
        // H = R - R^2 / u.
        let heights = [by_u * by_u, -by_u * by_u / u, by_u * by_u / (u * u)];
        let here = self.temperature + self.gradient * (height - self.height);
        let [a, b, c] = heights.map(|h| self.gradient * h);
        let warmth = [1.0, a / here, b / here, c / here, 0.0, 0.0, 0.0, 0.0];
        let density = if self.gradient == 0.0 {
            let rate = -HYDROSTATIC / self.temperature;
            let [h1, h2, h3] = heights.map(|h| rate * h);
            let value = self.density * (rate * (height - self.height)).exp();
            exponential(&[0.0, h1, h2, h3, 0.0, 0.0, 0.0, 0.0]).map(|term| value * term)
        } else {
            let exponent = -1.0 - HYDROSTATIC / self.gradient;
            // The power of a quotient would lose digits by its exponent, -35 in one layer.
            let warmer = self.gradient * (height - self.height) / self.temperature;
            let value = self.density * (exponent * warmer.ln_1p()).exp();
            power(&warmth, exponent).map(|term| value * term)
        };
        let sound = Gas::AIR.speed_of_sound(here);
        let sound = power(&warmth, 0.5).map(|term| sound * term);
        Panel { middle, density, sound, temperature: [here, a, b, c] }
    }
}

/// Terms of `exp(a)` of a series without constant term: `k e_k = sum j a_j e_(k-j)`.
fn exponential(a: &[f64; 8]) -> [f64; 8] {
    let mut e = [1.0; 8];
    for k in 1..8 {
        e[k] = (1..=k).map(|j| j as f64 * a[j] * e[k - j]).sum::<f64>() / k as f64;
    }
    e
}

/// Terms of a power of a series with constant term 1: `k p_k = sum (n j - k + j) a_j p_(k-j)` (J. C. P. Miller's recurrence).
fn power(a: &[f64; 8], n: f64) -> [f64; 8] {
    let mut p = [1.0; 8];
    for k in 1..8 {
        let term = |j: usize| (n * j as f64 - (k - j) as f64) * a[j] * p[k - j];
        p[k] = (1..=k).map(term).sum::<f64>() / k as f64;
    }
    p
}

/// A polynomial with derivatives up to an order; by pairs of powers, which wait less for each other than Horner's scheme.
#[inline(always)]
fn seventh_degree(a: &[f64; 8], z: f64, order: usize) -> Jet {
    let zz = z * z;
    let pairs = |t: [f64; 8]| {
        let pair = |k: usize| t[k] + z * t[k + 1];
        (pair(0) + zz * pair(2)) + zz * zz * (pair(4) + zz * pair(6))
    };
    if order == 0 {
        return [pairs(*a), 0.0, 0.0];
    }
    let slope = std::array::from_fn(|k| if k < 7 { (k + 1) as f64 * a[k + 1] } else { 0.0 });
    let curvature = std::array::from_fn(|k| if k < 6 { ((k + 1) * (k + 2)) as f64 * a[k + 2] } else { 0.0 });
    [pairs(*a), pairs(slope), pairs(curvature)]
}

/// A cubic with its derivatives.
#[inline(always)]
pub(super) fn cubic([a, b, c, d]: &[f64; 4], z: f64) -> Jet {
    [a + z * (b + z * (c + z * d)), b + z * (2.0 * c + z * 3.0 * d), 2.0 * c + z * 6.0 * d]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Discretisation: difference quotients, by their steps.
    const DIFFERENCES: f64 = 1e-9;

    /// The rounding of sums of eight terms.
    const ROUNDING: f64 = 5e-15;
    /// The rounding of the printed densities of the bases, each of which follows from the one below by a power up to 35.
    const ROUNDING_OF_BASES: f64 = 1e-14;

    /// The closed forms: density, molecular temperature.
    fn law(altitude: f64) -> [f64; 2] {
        let height = RADIUS * altitude / (RADIUS + altitude);
        let base = LAYERS.iter().rev().find(|l| l.height <= height).unwrap_or(&LAYERS[0]);
        let above = height - base.height;
        let temperature = base.temperature + base.gradient * above;
        let factor = if base.gradient == 0.0 {
            (-HYDROSTATIC / base.temperature * above).exp()
        } else {
            ((-1.0 - HYDROSTATIC / base.gradient) * (base.gradient * above / base.temperature).ln_1p()).exp()
        };
        [base.density * factor, temperature]
    }

    fn near(altitude: f64, found: f64, expected: f64, tolerance: f64) {
        assert!((found / expected - 1.0).abs() < tolerance, "{altitude}: {found} {expected}");
    }

    #[test]
    fn panels_are_the_closed_forms() {
        for k in 0..=91_000 {
            let altitude = -5000.0 + f64::from(k);
            let [rho, t] = law(altitude);
            let [[density, ..], [sound, ..]] = density_and_sound(altitude, 0);
            near(altitude, density, rho, ROUNDING);
            near(altitude, sound, Gas::AIR.speed_of_sound(t), ROUNDING);
            near(altitude, temperature(altitude)[0], t, ROUNDING);
        }
    }

    /// Both sides of every boundary, and what the rounding of an altitude makes of it.
    #[test]
    fn panels_meet() {
        for boundary in boundaries().chain([BASE]) {
            let [below, above] = [boundary.next_down(), boundary.next_up().min(BASE)];
            near(boundary, density(below)[0], density(above)[0], ROUNDING_OF_BASES);
            near(boundary, temperature(below)[0], temperature(above)[0], ROUNDING_OF_BASES);
        }
    }

    /// `d rho / dz = -rho (g0 M0 / R* + dT/dH) / T dH/dz`: equilibrium of gravity and pressure.
    #[test]
    fn derivatives_are_those_of_the_equilibrium() {
        for k in 0..910 {
            let altitude = -4950.0 + 100.0 * f64::from(k);
            let [[rho, rho1, rho2], [a, a1, a2]] = density_and_sound(altitude, 2);
            let [t, t1, t2] = temperature(altitude);
            let h1 = (RADIUS / (RADIUS + altitude)).powi(2);
            let h2 = -2.0 * h1 / (RADIUS + altitude);
            let rate = -(HYDROSTATIC * h1 + t1) / t;
            let change = -(HYDROSTATIC * h2 + t2 + rate * t1) / t;
            assert!(
                (rho1 / (rho * rate) - 1.0).abs() < 200.0 * ROUNDING,
                "{altitude}: {rho1} {}",
                rho * rate
            );
            let expected = rho * (rate * rate + change);
            assert!((rho2 / expected - 1.0).abs() < DIFFERENCES, "{altitude}: {rho2} {expected}");
            // a^2 is proportional to T.
            let (first, second) = (0.5 * a * t1 / t, 0.5 * a * (t2 / t - 0.5 * (t1 / t).powi(2)));
            assert!((a1 - first).abs() <= 200.0 * ROUNDING * first.abs(), "{altitude}: {a1} {first}");
            assert!((a2 - second).abs() <= DIFFERENCES * second.abs(), "{altitude}: {a2} {second}");
        }
    }
}
