//! Constants of the US Standard Atmosphere 1976 (NASA-TM-X-74335) and the altitudes where its parts meet.

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
/// A function of one variable with its first two derivatives.
pub(super) type Jet = [f64; 3];
