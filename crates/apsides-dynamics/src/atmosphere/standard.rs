//! The US Standard Atmosphere 1976 (NASA-TM-X-74335): up to 86 km its seven layers of constant gradient of the molecular temperature in
//! geopotential height; above, up to 1000 km, [its equations of diffusion](super::thermosphere), integrated once and kept as splines.
//!
//! The molecular temperature `T M0 / M` makes density, pressure and speed of sound those of one gas everywhere. The standard gives no
//! speed of sound above 86 km; here it goes on by this temperature.
//!
//! Geometric altitudes. Below -5 km, where the standard's tables begin, density and temperature go on along their tangents;
//! above 1000 km the temperatures stay and the density falls with the last scale height, down to a floor.

use super::thermosphere;
use crate::engine::STANDARD_GRAVITY;

/// Radius of the standard's geopotential, m.
pub(super) const RADIUS: f64 = 6_356_766.0;
/// Gas constant, J/(kmol K).
pub(super) const GAS_CONSTANT: f64 = 8314.32;
/// Molar mass at sea level, kg/kmol.
pub(super) const MOLAR_MASS: f64 = 28.9644;
/// Geometric altitude, m, where the layers end and diffusion begins.
pub(super) const BASE: f64 = 86e3;
/// Geometric altitude, m, of the end of the standard.
pub(super) const TOP: f64 = 1000e3;
/// Geometric altitude, m, of the lower end of the standard's tables.
pub(super) const BOTTOM: f64 = -5e3;
/// Hydrostatic constant `g0 M0 / R`, K/m.
const HYDROSTATIC: f64 = STANDARD_GRAVITY * MOLAR_MASS / GAS_CONSTANT;
/// Least natural logarithm of a density in kg/m3: far outside every use, and its roots and their derivatives are finite.
const FLOOR: f64 = -200.0;

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

/// Table 8: molar mass by that at sea level, every 500 m from 80 km.
const MOLAR_MASS_RATIO: [f64; 13] = [
    1.0, 0.999_996, 0.999_989, 0.999_971, 0.999_941, 0.999_909, 0.999_870, 0.999_829, 0.999_786, 0.999_741,
    0.999_694, 0.999_641, 0.999_579,
];

/// A function of one variable with its first two derivatives.
type Jet = [f64; 3];

/// Density, kg/m3, at a geometric altitude (m).
#[inline]
pub(super) fn density(altitude: f64) -> Jet {
    if altitude > BASE {
        let [l, l1, l2] = thermosphere::log_density(altitude);
        if l < FLOOR {
            return [FLOOR.exp(), 0.0, 0.0];
        }
        let rho = l.exp();
        return [rho, rho * l1, rho * (l2 + l1 * l1)];
    }
    if altitude < BOTTOM {
        let [rho, rho1, _] = layered_density(BOTTOM);
        return [rho + rho1 * (altitude - BOTTOM), rho1, 0.0];
    }
    layered_density(altitude)
}

/// The same in the layers.
#[inline]
fn layered_density(altitude: f64) -> Jet {
    let [height, h1, h2] = geopotential_height(altitude);
    let layer = at_height(height);
    let dh = height - layer.height;
    let (rho, rho1, rho2) = if layer.gradient == 0.0 {
        let rate = -HYDROSTATIC / layer.temperature;
        let rho = layer.density * (rate * dh).exp();
        (rho, rho * rate, rho * rate * rate)
    } else {
        let exponent = -1.0 - HYDROSTATIC / layer.gradient;
        let temperature = layer.temperature + layer.gradient * dh;
        let rho = layer.density * (temperature / layer.temperature).powf(exponent);
        let rate = layer.gradient / temperature;
        (rho, rho * exponent * rate, rho * exponent * (exponent - 1.0) * rate * rate)
    };
    [rho, rho1 * h1, rho2 * h1 * h1 + rho1 * h2]
}

/// Molecular temperature, K, at a geometric altitude (m).
#[inline]
pub(super) fn molecular_temperature(altitude: f64) -> Jet {
    if altitude > BASE {
        return thermosphere::molecular_temperature(altitude);
    }
    if altitude < BOTTOM {
        let [t, t1, _] = layered_temperature(BOTTOM);
        return [t + t1 * (altitude - BOTTOM), t1, 0.0];
    }
    layered_temperature(altitude)
}

/// The same in the layers.
#[inline]
fn layered_temperature(altitude: f64) -> Jet {
    let [height, h1, h2] = geopotential_height(altitude);
    let Layer { height: base, gradient, temperature, .. } = at_height(height);
    [temperature + gradient * (height - base), gradient * h1, gradient * h2]
}

/// Kinetic temperature, K, at a geometric altitude (m).
#[inline]
pub(super) fn temperature(altitude: f64) -> Jet {
    if altitude > BASE {
        return thermosphere::temperature(altitude);
    }
    let jet = molecular_temperature(altitude);
    let place = (altitude - 80e3) / 500.0;
    if place <= 0.0 {
        return jet;
    }
    let k = (place as usize).min(MOLAR_MASS_RATIO.len() - 2);
    let step = MOLAR_MASS_RATIO[k + 1] - MOLAR_MASS_RATIO[k];
    let (ratio, rate) = (MOLAR_MASS_RATIO[k] + step * (place - k as f64), step / 500.0);
    [jet[0] * ratio, jet[1] * ratio + jet[0] * rate, jet[2] * ratio + 2.0 * jet[1] * rate]
}

/// Geopotential height, m.
#[inline]
fn geopotential_height(altitude: f64) -> Jet {
    let q = RADIUS / (RADIUS + altitude);
    [q * altitude, q * q, -2.0 * q * q * q / RADIUS]
}

/// Geometric altitudes, m, at which a gradient jumps: the boundaries of the layers and of the law above 86 km.
pub(super) fn kinks() -> impl Iterator<Item = f64> {
    let layers = LAYERS[1..].iter().map(|layer| RADIUS * layer.height / (RADIUS - layer.height));
    layers.chain([BASE])
}

#[inline]
fn at_height(height: f64) -> &'static Layer {
    // All are compared: no branch depends on the height.
    let above = LAYERS[1..].iter().filter(|layer| layer.height <= height).count();
    &LAYERS[above]
}
