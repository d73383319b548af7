//! Constants that follow from the dimension and the population (Hansen 2016, table 1).

use serde::{Deserialize, Serialize};

/// Weights by rank and learning rates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Weights {
    /// By rank, best first: the first half positive with sum 1, the rest negative where the update is active and 0 else.
    pub(super) ranked: Vec<f64>,
    /// Sum of all.
    pub(super) sum: f64,
    /// Members with a positive weight.
    pub(super) parents: usize,
    /// `mu_eff`, the variance-effective number of parents.
    pub(super) effective: f64,
    pub(super) c_sigma: f64,
    pub(super) d_sigma: f64,
    pub(super) c_c: f64,
    pub(super) c_1: f64,
    pub(super) c_mu: f64,
    /// Expected length of a standard normal vector.
    pub(super) length: f64,
}

impl Weights {
    pub(super) fn new(dimension: usize, population: usize, active: bool) -> Self {
        let (n, lambda) = (dimension as f64, population as f64);
        let parents = population / 2;
        let mut ranked: Vec<f64> =
            (1..=population).map(|i| ((lambda + 1.0) / 2.0).ln() - (i as f64).ln()).collect();
        let effective = |w: &[f64]| {
            let squares: f64 = w.iter().map(|w| w * w).sum();
            if squares > 0.0 { w.iter().sum::<f64>().powi(2) / squares } else { 0.0 }
        };
        let (mu_eff, mu_eff_minus) = (effective(&ranked[..parents]), effective(&ranked[parents..]));
        let c_c = (4.0 + mu_eff / n) / (n + 4.0 + 2.0 * mu_eff / n);
        let c_sigma = (mu_eff + 2.0) / (n + mu_eff + 5.0);
        let d_sigma = 1.0 + 2.0 * (((mu_eff - 1.0) / (n + 1.0)).max(0.0).sqrt() - 1.0).max(0.0) + c_sigma;
        let c_1 = 2.0 / ((n + 1.3).powi(2) + mu_eff);
        let c_mu = (2.0 * (mu_eff - 2.0 + 1.0 / mu_eff) / ((n + 2.0).powi(2) + mu_eff)).min(1.0 - c_1);
        let positive: f64 = ranked.iter().filter(|w| **w > 0.0).sum();
        let negative: f64 = -ranked.iter().filter(|w| **w < 0.0).sum::<f64>();
        let scale = if active && c_mu > 0.0 && negative > 0.0 {
            let by_rates = 1.0 + c_1 / c_mu;
            let by_mass = 1.0 + 2.0 * mu_eff_minus / (mu_eff + 2.0);
            let by_definiteness = (1.0 - c_1 - c_mu) / (n * c_mu);
            by_rates.min(by_mass).min(by_definiteness).max(0.0) / negative
        } else {
            0.0
        };
        ranked.iter_mut().for_each(|w| *w *= if *w > 0.0 { 1.0 / positive } else { scale });
        Self {
            sum: ranked.iter().sum(),
            ranked,
            parents,
            effective: mu_eff,
            c_sigma,
            d_sigma,
            c_c,
            c_1,
            c_mu,
            length: n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n)),
        }
    }

    /// Generations between decompositions of the covariance matrix, so that their cost for each evaluation is that of drawing a
    /// point: half of `1 / (c_1 + c_mu) n`, in which time the matrix changes little. That is the gap of the author's pycma
    /// (<https://doi.org/10.5281/zenodo.2559634>); Hansen 2016, section B.2, has a tenth.
    pub(super) fn lazy_gap(&self, dimension: usize) -> usize {
        let gap = 0.5 / ((self.c_1 + self.c_mu) * dimension as f64);
        gap.ceil().max(1.0) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-14;

    /// Published: half a unit of the last of the digits that were worked out by hand, relative.
    const PUBLISHED: f64 = 5e-4;

    #[test]
    fn constants_of_ten_dimensions() {
        // The formulas of the table worked out by hand for n = 10, lambda = 10, mu = 5.
        let w = Weights::new(10, 10, true);
        let near = |a: f64, b: f64| assert!((a - b).abs() < PUBLISHED * b.abs(), "{a} {b}");
        near(w.ranked[0], 0.4563);
        near(w.ranked[4], 0.0255);
        near(w.effective, 3.1673);
        near(w.c_sigma, 0.28443);
        near(w.d_sigma, 1.28443);
        near(w.c_c, 0.29499);
        near(w.c_1, 0.015284);
        near(w.c_mu, 0.020153);
        assert!((w.ranked[..5].iter().sum::<f64>() - 1.0).abs() < ROUNDING);
        assert!(w.ranked[5..].iter().all(|&w| w < 0.0));
        // Expected length, sqrt(2) gamma(5.5) / gamma(5).
        near(w.length, 3.0843);
    }

    #[test]
    fn without_the_active_update_no_weight_is_negative() {
        let w = Weights::new(5, 8, false);
        assert!(w.ranked.iter().all(|&w| w >= 0.0));
        assert!((w.sum - 1.0).abs() < ROUNDING);
    }

    #[test]
    fn the_matrix_stays_positive_definite() {
        // What negative weights take at most in one generation is less than what is left.
        for n in [1, 2, 5, 30, 100] {
            for lambda in [4, 10, 50, 500] {
                let w = Weights::new(n, lambda, true);
                let negative: f64 = -w.ranked.iter().filter(|w| **w < 0.0).sum::<f64>();
                assert!(w.c_mu * negative * n as f64 <= 1.0 - w.c_1 - w.c_mu + 1e-12, "{n} {lambda}");
            }
        }
    }
}
