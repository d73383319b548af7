//! The US Standard Atmosphere 1976 from 86 to 1000 km: temperature in closed form, and the number densities of six species by the
//! standard's equations of diffusion (NASA-TM-X-74335, section 1.3.3), integrated by Simpson's rule.
//!
//! Density agrees with the published table, four digits, to 0.03 % up to 500 km and to 0.1 % up to 1000 km, where the table's own
//! integration has larger steps. The density at 86 km, where both parts of the standard meet, is that of the layers: the two differ by
//! 8e-6.

use std::sync::LazyLock;

use apsides_ad::CubicSpline;

use super::constants::{BASE, GAS_CONSTANT, Jet, MOLAR_MASS, RADIUS, TOP};
use super::layers::cubic;
use super::panels::Panels;
use crate::engine::STANDARD_GRAVITY;

/// Step of the integration, m.
const STEP: f64 = 50.0;
/// Kilogram per kilomole to kilogram per particle.
const AVOGADRO: f64 = 6.022_169e26;
/// Kinetic temperature, K, up to 91 km.
const BASE_TEMPERATURE: f64 = 186.8673;
/// Altitude, m, up to which the air is mixed.
const MIXED: f64 = 100e3;

/// A species that diffuses: molar mass (kg/kmol), number density at 86 km (1/m3), coefficient and exponent of molecular diffusion,
/// factor of thermal diffusion (tables 3, 6 and 9), and the fit of the vertical transport (table 7, in km).
struct Species {
    molar_mass: f64,
    base: f64,
    diffusion: [f64; 2],
    thermal: f64,
    transport: [f64; 3],
}

const NITROGEN_MASS: f64 = 28.0134;
const NITROGEN_BASE: f64 = 1.129_794e20;
const OXYGEN_ATOM: Species = Species {
    molar_mass: 15.9994,
    base: 8.6e16,
    diffusion: [6.986e20, 0.75],
    thermal: 0.0,
    transport: [-5.809_644e-4, 56.903_11, 2.706_240e-5],
};
const OXYGEN: Species = Species {
    molar_mass: 31.9988,
    base: 3.030_898e19,
    diffusion: [4.863e20, 0.75],
    thermal: 0.0,
    transport: [1.366_212e-4, 86.0, 8.333_333e-5],
};
const ARGON: Species = Species {
    molar_mass: 39.948,
    base: 1.351_400e18,
    diffusion: [4.487e20, 0.87],
    thermal: 0.0,
    transport: [9.434_079e-5, 86.0, 8.333_333e-5],
};
const HELIUM: Species = Species {
    molar_mass: 4.0026,
    base: 7.581_73e14,
    diffusion: [1.7e21, 0.691],
    thermal: -0.4,
    transport: [-2.457_369e-4, 86.0, 6.666_667e-4],
};
/// Further transport of atomic oxygen below its third number, in km.
const OXYGEN_SINK: [f64; 3] = [-3.416_248e-3, 97.0, 5.008_765e-4];

const HYDROGEN_MASS: f64 = 1.007_97;
const HYDROGEN_DIFFUSION: [f64; 2] = [3.305e21, 0.5];
const HYDROGEN_THERMAL: f64 = -0.25;
/// Number density, 1/m3, at 500 km, and flux upwards, 1/(m2 s).
const HYDROGEN_AT_500_KM: f64 = 8e10;
const HYDROGEN_FLUX: f64 = 7.2e11;
/// Altitude, m, above which there is atomic hydrogen.
const HYDROGEN_FROM: f64 = 150e3;

/// The result of the integration, in powers of the altitude (m) above an interval's lower end: cubic splines.
struct Interval {
    from: f64,
    log_density: [f64; 4],
    molecular_temperature: [f64; 4],
    temperature: [f64; 4],
}

/// Where the width of the intervals changes, and the widths, m: half a kilometre where the functions bend, 10 km where they do not.
const RANGES: [f64; 4] = [BASE, 130e3, 200e3, TOP];
const WIDTHS: [f64; 3] = [500.0, 2000.0, 10e3];

static INTERVALS: LazyLock<Panels<Interval, 3>> = LazyLock::new(intervals);

/// Natural logarithm of the density in kg/m3, with its derivatives, above 86 km.
#[inline]
pub(super) fn log_density(altitude: f64) -> Jet {
    let [value, slope, curvature] = spline(altitude, |interval| &interval.log_density);
    if altitude > TOP { [value + slope * (altitude - TOP), slope, 0.0] } else { [value, slope, curvature] }
}

/// Molecular temperature, K, with its derivatives, above 86 km.
#[inline]
pub(super) fn molecular_temperature(altitude: f64) -> Jet {
    constant_beyond(altitude, |interval| &interval.molecular_temperature)
}

/// Kinetic temperature, K, with its derivatives, above 86 km.
#[inline]
pub(super) fn temperature(altitude: f64) -> Jet {
    constant_beyond(altitude, |interval| &interval.temperature)
}

#[inline]
fn constant_beyond(altitude: f64, quantity: impl Fn(&Interval) -> &[f64; 4]) -> Jet {
    let jet = spline(altitude, quantity);
    if altitude > TOP { [jet[0], 0.0, 0.0] } else { jet }
}

/// A quantity up to the end of the standard.
#[inline]
fn spline(altitude: f64, quantity: impl Fn(&Interval) -> &[f64; 4]) -> Jet {
    let altitude = altitude.min(TOP);
    let interval = INTERVALS.at(altitude);
    cubic(quantity(interval), altitude - interval.from)
}

/// Kinetic temperature (K) and its gradient (K/m), equations 25 to 31.
fn kinetic_temperature(altitude: f64) -> [f64; 2] {
    let km = altitude / 1000.0;
    if km <= 91.0 {
        [BASE_TEMPERATURE, 0.0]
    } else if km <= 110.0 {
        let (width, depth) = (19.9429, 76.3232);
        let x = (km - 91.0) / width;
        let root = (1.0 - x * x).sqrt();
        [263.1905 - depth * root, depth * x / (width * root) / 1000.0]
    } else if km <= 120.0 {
        [240.0 + 12.0 * (km - 110.0), 0.012]
    } else {
        let (limit, drop, decay) = (1000.0, 640.0, 12.0 / 640.0);
        let ratio = (RADIUS / 1000.0 + 120.0) / (RADIUS / 1000.0 + km);
        let rest = drop * (-decay * (km - 120.0) * ratio).exp();
        [limit - rest, rest * decay * ratio * ratio / 1000.0]
    }
}

/// Coefficient of eddy diffusion, m2/s, equations 7a to 7c.
fn eddy_diffusion(altitude: f64) -> f64 {
    let km = altitude / 1000.0;
    if km < 95.0 {
        120.0
    } else if km < 115.0 {
        120.0 * (1.0 - 400.0 / (400.0 - (km - 95.0).powi(2))).exp()
    } else {
        0.0
    }
}

/// Vertical transport, 1/m: `q x^2 exp(-w x^3)` at a distance `x` in km.
fn transport(q: f64, x: f64, w: f64) -> f64 {
    q * x * x * (-w * x.powi(3)).exp() / 1000.0
}

/// The quantities that all integrands share, at the nodes of the integration.
struct Nodes {
    altitude: Vec<f64>,
    temperature: Vec<f64>,
    gradient: Vec<f64>,
    /// `g / (R T)`, kmol/(kg m).
    inverse_height: Vec<f64>,
}

impl Nodes {
    fn new() -> Self {
        let intervals = ((TOP - BASE) / STEP).round() as usize;
        let altitude: Vec<f64> = (0..=intervals).map(|k| BASE + STEP * k as f64).collect();
        let (temperature, gradient): (Vec<f64>, Vec<f64>) =
            altitude.iter().map(|z| kinetic_temperature(*z)).map(|[t, g]| (t, g)).unzip();
        let inverse_height = altitude
            .iter()
            .zip(&temperature)
            .map(|(z, t)| STANDARD_GRAVITY * (RADIUS / (RADIUS + z)).powi(2) / (GAS_CONSTANT * t))
            .collect();
        Self { altitude, temperature, gradient, inverse_height }
    }

    /// The index of an altitude.
    fn index(&self, altitude: f64) -> usize {
        ((altitude - BASE) / STEP).round() as usize
    }

    /// The integrals from the base of a function of the index and of whether the air is mixed. Between two nodes the function is the
    /// parabola through these and the next one on the same side of the mixed air's end.
    fn integrals(&self, function: impl Fn(usize, bool) -> f64) -> Vec<f64> {
        let (last, mixed) = (self.altitude.len() - 1, self.index(MIXED));
        let mut integrals = vec![0.0; last + 1];
        for k in 0..last {
            let below = k < mixed;
            let f = |i: usize| function(i, below);
            let third = if k == last - 1 || k + 1 == mixed { f(k - 1) } else { f(k + 2) };
            let near = if k == last - 1 || k + 1 == mixed { [f(k + 1), f(k)] } else { [f(k), f(k + 1)] };
            integrals[k + 1] = integrals[k] + STEP * (5.0 * near[0] + 8.0 * near[1] - third) / 12.0;
        }
        integrals
    }

    /// Molecular nitrogen, equation 32 with mixing up to 100 km.
    fn nitrogen(&self) -> Vec<f64> {
        let exponents = self
            .integrals(|k, mixed| self.inverse_height[k] * if mixed { MOLAR_MASS } else { NITROGEN_MASS });
        self.densities(NITROGEN_BASE, &exponents)
    }

    /// A species that diffuses through a number density of others, equations 36 and 37.
    fn diffusing(&self, species: &Species, others: &[f64], sink: Option<[f64; 3]>) -> Vec<f64> {
        let exponents = self.integrals(|k, mixed| {
            let (km, eddy) = (self.altitude[k] / 1000.0, eddy_diffusion(self.altitude[k]));
            let [coefficient, exponent] = species.diffusion;
            let molecular = coefficient / others[k] * (self.temperature[k] / 273.15).powf(exponent);
            let mean = if mixed { MOLAR_MASS } else { NITROGEN_MASS };
            let thermal = species.thermal * self.gradient[k] / (self.inverse_height[k] * self.temperature[k]);
            let settling = self.inverse_height[k] * molecular / (molecular + eddy)
                * (species.molar_mass + mean * eddy / molecular + thermal);
            let [q, from, w] = species.transport;
            let below =
                sink.filter(|[_, to, _]| km <= *to).map_or(0.0, |[q, to, w]| transport(q, to - km, w));
            settling + transport(q, km - from, w) + below
        });
        self.densities(species.base, &exponents)
    }

    /// Atomic hydrogen, equation 39, from 150 km.
    fn hydrogen(&self, others: &[f64]) -> Vec<f64> {
        let at = self.index(500e3);
        let optical = self.integrals(|k, _| self.inverse_height[k] * HYDROGEN_MASS);
        let depth = |k: usize| optical[k] - optical[at];
        let warmth = |k: usize| (self.temperature[k] / self.temperature[at]).powf(1.0 + HYDROGEN_THERMAL);
        let [coefficient, exponent] = HYDROGEN_DIFFUSION;
        let flux = self.integrals(|k, _| {
            let molecular = coefficient / others[k] * (self.temperature[k] / 273.15).powf(exponent);
            HYDROGEN_FLUX / molecular * warmth(k) * depth(k).exp()
        });
        let from = self.index(HYDROGEN_FROM);
        (0..self.altitude.len())
            .map(|k| match k < from {
                true => 0.0,
                false => (HYDROGEN_AT_500_KM - (flux[k] - flux[at])) / warmth(k) * (-depth(k)).exp(),
            })
            .collect()
    }

    /// Number densities from that at the base and the exponents.
    fn densities(&self, base: f64, exponents: &[f64]) -> Vec<f64> {
        exponents
            .iter()
            .zip(&self.temperature)
            .map(|(e, t)| base * BASE_TEMPERATURE / t * (-e).exp())
            .collect()
    }
}

/// The splines.
#[expect(clippy::expect_used, reason = "invariant: the knots of this module increase")]
fn intervals() -> Panels<Interval, 3> {
    let nodes = Nodes::new();
    let sum = |parts: &[&[f64]]| -> Vec<f64> {
        (0..nodes.altitude.len()).map(|k| parts.iter().map(|p| p[k]).sum()).collect()
    };
    let nitrogen = nodes.nitrogen();
    let atomic = nodes.diffusing(&OXYGEN_ATOM, &nitrogen, Some(OXYGEN_SINK));
    let oxygen = nodes.diffusing(&OXYGEN, &nitrogen, None);
    let heavy = sum(&[&nitrogen, &atomic, &oxygen]);
    let argon = nodes.diffusing(&ARGON, &heavy, None);
    let helium = nodes.diffusing(&HELIUM, &heavy, None);
    let without_hydrogen = sum(&[&heavy, &argon, &helium]);
    let hydrogen = nodes.hydrogen(&without_hydrogen);
    let species = [
        (&nitrogen, NITROGEN_MASS),
        (&atomic, OXYGEN_ATOM.molar_mass),
        (&oxygen, OXYGEN.molar_mass),
        (&argon, ARGON.molar_mass),
        (&helium, HELIUM.molar_mass),
        (&hydrogen, HYDROGEN_MASS),
    ];
    let density = |k: usize| species.iter().map(|(n, m)| n[k] * m).sum::<f64>() / AVOGADRO;
    let molar_mass = |k: usize| density(k) * AVOGADRO / (without_hydrogen[k] + hydrogen[k]);
    let steps = |k: usize| ((RANGES[k + 1] - RANGES[k]) / WIDTHS[k]) as usize;
    let range = |k: usize| (0..steps(k)).map(move |i| RANGES[k] + i as f64 * WIDTHS[k]);
    let knots: Vec<f64> = (0..WIDTHS.len()).flat_map(range).chain([TOP]).collect();
    let join = super::layers::density(BASE)[0] / density(0);
    let table = |value: &dyn Fn(usize) -> f64| {
        let values: Vec<f64> = knots.iter().map(|z| value(nodes.index(*z))).collect();
        CubicSpline::new(&knots, &values).expect("invariant: the knots increase and the standard is finite")
    };
    let log_density = table(&|k| (join * density(k)).ln());
    let molecular_temperature = table(&|k| nodes.temperature[k] * MOLAR_MASS / molar_mass(k));
    let temperature = table(&|k| nodes.temperature[k]);
    Panels::new(
        |k| RANGES[k],
        WIDTHS,
        |_, ends| Interval {
            from: ends[0],
            log_density: terms(&log_density, ends),
            molecular_temperature: terms(&molecular_temperature, ends),
            temperature: terms(&temperature, ends),
        },
    )
}

/// A spline in powers of the altitude above the lower end of one of its intervals.
fn terms(spline: &CubicSpline, [from, to]: [f64; 2]) -> [f64; 4] {
    let ([a, b, c], [.., end]) = (spline.derivatives(from), spline.derivatives(to));
    [a, b, 0.5 * c, (end - c) / (6.0 * (to - from))]
}
