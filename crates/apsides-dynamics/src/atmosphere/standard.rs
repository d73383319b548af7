//! The US Standard Atmosphere 1976 (NASA-TM-X-74335): up to 86 km [its seven layers](super::layers); above, up to 1000 km,
//! [its equations of diffusion](super::thermosphere), integrated once and kept as splines.
//!
//! The molecular temperature `T M0 / M` makes density, pressure and speed of sound those of one gas everywhere. The standard gives no
//! speed of sound above 86 km; here it goes on by this temperature.
//!
//! Geometric altitudes. Below -5 km, where the standard's tables begin, density and temperature go on along their tangents;
//! above 1000 km the temperatures stay and the density falls with the last scale height, down to a floor.

use super::constants::{BASE, BOTTOM, Jet};
use super::{Gas, layers, thermosphere};

/// Least natural logarithm of a density in kg/m3: far outside every use, and its roots and their derivatives are finite.
const FLOOR: f64 = -200.0;

/// Table 8: molar mass by that at sea level, every 500 m from 80 km.
const MOLAR_MASS_RATIO: [f64; 13] = [
    1.0, 0.999_996, 0.999_989, 0.999_971, 0.999_941, 0.999_909, 0.999_870, 0.999_829, 0.999_786, 0.999_741,
    0.999_694, 0.999_641, 0.999_579,
];

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
    below(altitude, layers::density)
}

/// Molecular temperature, K, at a geometric altitude (m).
#[inline]
pub(super) fn molecular_temperature(altitude: f64) -> Jet {
    if altitude > BASE {
        thermosphere::molecular_temperature(altitude)
    } else {
        below(altitude, layers::temperature)
    }
}

/// A quantity of the layers, with its tangent below them.
#[inline(always)]
fn below(altitude: f64, quantity: impl Fn(f64) -> Jet) -> Jet {
    if altitude < BOTTOM {
        let [value, slope, _] = quantity(BOTTOM);
        return [value + slope * (altitude - BOTTOM), slope, 0.0];
    }
    quantity(altitude)
}

/// Density, kg/m3, and speed of sound, m/s, at a geometric altitude (m), with derivatives up to an order.
#[inline(always)]
pub(super) fn density_and_sound(altitude: f64, order: usize) -> [Jet; 2] {
    // The rest is a call, so that little stands where most flights are. What it gives is taken apart, or all would go through memory.
    if (BOTTOM..=BASE).contains(&altitude) {
        layers::density_and_sound(altitude, order)
    } else {
        let [[rho, rho1, rho2], [a, a1, a2]] = outside_layers(altitude);
        [[rho, rho1, rho2], [a, a1, a2]]
    }
}

#[inline(never)]
fn outside_layers(altitude: f64) -> [Jet; 2] {
    let [t, t1, t2] = molecular_temperature(altitude);
    let a = Gas::AIR.speed_of_sound(t);
    let rate = 0.5 * t1 / t;
    [density(altitude), [a, a * rate, a * (0.5 * t2 / t - rate * rate)]]
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

/// Geometric altitudes, m, at which a gradient jumps: the boundaries of the layers and of the law above 86 km.
pub(super) fn kinks() -> impl Iterator<Item = f64> {
    layers::boundaries().chain([BASE])
}
