//! Quadrature nodes and barycentric interpolation for collocation on `[-1, 1]`, B-splines, and the minimum of a
//! function of one variable.
//!
//! A state is a polynomial through `N + 1` support points, its rate is given at `N` collocation points:
//!
//! ```text
//! x'(tau_i) = sum_j D_ij x_j        x(tau_i) = x(-1) + sum_j A_ij f_j        integral f = sum_j w_j f_j
//! ```
//!
//! The crate makes nodes `tau`, weights `w`, the differentiation matrix `D` and the integration matrix `A` for the
//! Legendre-Gauss-Radau, Gauss and Lobatto rules, and interpolates through arbitrary nodes. It knows no meshes,
//! phases or states: matrices are row-major slices of `f64`.
//!
//! ```
//! use apsides_basis::Lgr;
//!
//! // x' = -x, x(-1) = 1, collocated at five Radau points: (D x)_i + x_i = 0.
//! let lgr = Lgr::new(5)?;
//! let exact: Vec<f64> = lgr.support().iter().map(|t| (-(t + 1.0)).exp()).collect();
//! for (i, row) in lgr.differentiation().chunks(6).enumerate() {
//!     let rate: f64 = row.iter().zip(&exact).map(|(d, x)| d * x).sum();
//!     assert!((rate + exact[i]).abs() < 3e-3);
//! }
//! // Quadrature is exact to degree 2 N - 2 = 8: the integral of t^8 is 2 / 9.
//! let integral: f64 = lgr.nodes().iter().zip(lgr.weights()).map(|(t, w)| w * t.powi(8)).sum();
//! assert!((integral - 2.0 / 9.0).abs() < 1e-15);
//! // Interpolation of the state anywhere in between.
//! assert!((lgr.support_basis().evaluate(&exact, 1, 0, 0.1) - (-1.1f64).exp()).abs() < 2e-4);
//! # Ok::<(), apsides_basis::BasisError>(())
//! ```
//!
//! | name | subject |
//! | --- | --- |
//! | [`Lgr`] | Legendre-Gauss-Radau points: -1 included, +1 excluded |
//! | [`Gauss`] | Legendre-Gauss points: both ends excluded |
//! | [`Lobatto`] | Legendre-Gauss-Lobatto points: both ends included |
//! | [`Barycentric`] | interpolation and differentiation through arbitrary distinct nodes |
//! | [`Resampling`] | interpolation from the nodes of one rule to fixed points |
//! | [`chebyshev_lobatto`], [`clenshaw_curtis`] | Chebyshev extreme points and their quadrature weights |
//! | [`Bspline`] | B-splines of any order and continuity: derivatives, knot insertion, degree elevation |
//! | [`legendre`] | a Legendre polynomial and its derivative |
//! | [`golden_section`], [`golden_sections`] | the minimum of a function of one variable, of many at once |
//!
//! References: D. Garg et al., *Automatica* 46 (2010) 1843, doi:10.1016/j.automatica.2010.06.048 (Radau
//! collocation, `A = D[:, 1..]^-1`); J.-P. Berrut and L. N. Trefethen, *SIAM Review* 46 (2004) 501,
//! doi:10.1137/S0036144502417715 (barycentric formulas).
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

mod barycentric;
mod bspline;
mod chebyshev;
mod double;
mod error;
mod gauss;
mod golden_section;
mod legendre;
mod lobatto;
mod quadrature;
mod radau;
mod resampling;
mod shared;
#[cfg(test)]
mod tests;

pub use barycentric::Barycentric;
pub use bspline::{Bspline, MAX_ORDER};
pub use chebyshev::{chebyshev_lobatto, clenshaw_curtis};
pub use error::BasisError;
pub use gauss::Gauss;
pub use golden_section::{golden_section, golden_sections, try_golden_section};
pub use legendre::legendre;
pub use lobatto::Lobatto;
pub use radau::Lgr;
pub use resampling::Resampling;

/// Largest number of points of a [`Lgr`], [`Gauss`] or [`Lobatto`] rule.
pub const MAX_POINTS: usize = 60;
