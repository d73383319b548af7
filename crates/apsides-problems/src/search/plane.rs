//! Functions of two variables with many local minima (Haupt and Haupt, Practical Genetic Algorithms, 2nd ed. 2004,
//! appendix I), used by Alami Naeini and Roshanian (Modares Mechanical Engineering 14(13), 2014) to test searches.

use libm::j0;

/// One of them; variables in `[-10, 10]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlaneFunction {
    /// `J0(x^2 + y^2) + 0.1 abs(1 - x) + 0.1 abs(1 - y)`: rings of the Bessel function on two roofs.
    Bessel,
    /// `sqrt(r) sin(30 ((x + 0.5)^2 + y^2)^0.1) + abs(x) + abs(y)` with `r = sqrt(x^2 + y^2)`.
    ///
    /// The origin, often given as its minimum, is a strict local one with the value 0.
    RootWaves,
    /// `r sin(30 ((x + 0.5)^2 + y^2)^0.1) + abs(x) + abs(y)`: the same with the other reading of the exponent.
    ///
    /// Not negative, since `r <= abs(x) + abs(y)`; 0 at the origin and where the sine is -1 on an axis.
    LinearWaves,
}

impl PlaneFunction {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Bessel, Self::RootWaves, Self::LinearWaves];
    /// Largest size of both variables.
    pub const BOUND: f64 = 10.0;

    /// The value at `(x, y)`.
    #[must_use]
    pub fn value(self, [x, y]: [f64; 2]) -> f64 {
        let square = x * x + y * y;
        let waves = || (30.0 * ((x + 0.5).powi(2) + y * y).powf(0.1)).sin();
        match self {
            Self::Bessel => j0(square) + 0.1 * (1.0 - x).abs() + 0.1 * (1.0 - y).abs(),
            Self::RootWaves => square.powf(0.25) * waves() + x.abs() + y.abs(),
            Self::LinearWaves => square.sqrt() * waves() + x.abs() + y.abs(),
        }
    }

    /// The least value.
    #[must_use]
    pub fn least(self) -> f64 {
        match self {
            Self::Bessel => -0.335_586_525_247,
            Self::RootWaves => -0.247_405_194,
            Self::LinearWaves => 0.0,
        }
    }

    /// Position of the minimum; any one point of the many of [`Self::LinearWaves`].
    ///
    /// # Examples
    /// ```
    /// use apsides_problems::search::PlaneFunction;
    ///
    /// for function in PlaneFunction::ALL {
    ///     assert!(function.minimisers().iter().all(|at| (function.value(*at) - function.least()).abs() < 1e-9));
    /// }
    /// ```
    #[must_use]
    pub fn minimisers(self) -> &'static [[f64; 2]] {
        match self {
            Self::Bessel => &[[1.0, 1.660_605_32], [1.660_605_32, 1.0]],
            Self::RootWaves => &[[-0.202_149_94, 0.0]],
            Self::LinearWaves => &[[0.0, 0.0]],
        }
    }
}

#[cfg(test)]
mod tests {
    use libm::j1;

    use super::*;

    /// Solver: the tolerances at which the iterations stop.
    const SOLVER: f64 = 1e-9;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-12;

    /// Solver: the slope at a minimiser that is known to `SOLVER`, by the curvature of a hundred.
    const SLOPE: f64 = 1e-7;

    /// Least of a grid over the whole box and of ever finer ones around its best points.
    fn scanned(function: PlaneFunction) -> ([f64; 2], f64) {
        let n = 2000;
        let mut points: Vec<([f64; 2], f64)> = (0..=n * n)
            .map(|k| {
                let at = |i: usize| PlaneFunction::BOUND * (2.0 * i as f64 / n as f64 - 1.0);
                let point = [at(k % n), at(k / n)];
                (point, function.value(point))
            })
            .collect();
        points.sort_by(|a, b| a.1.total_cmp(&b.1));
        points.truncate(200);
        let mut width = 2.0 * PlaneFunction::BOUND / n as f64;
        while width > 1e-10 {
            for (point, value) in &mut points {
                let centre = *point;
                for i in -4..=4 {
                    for j in -4..=4 {
                        let near =
                            [centre[0] + width * f64::from(i) / 4.0, centre[1] + width * f64::from(j) / 4.0];
                        if function.value(near) < *value {
                            (*point, *value) = (near, function.value(near));
                        }
                    }
                }
            }
            width *= 0.5;
        }
        points.sort_by(|a, b| a.1.total_cmp(&b.1));
        points[0]
    }

    #[test]
    fn the_least_values_are_those_of_a_scan_of_the_whole_box() {
        for function in PlaneFunction::ALL {
            let (point, value) = scanned(function);
            assert!((value - function.least()).abs() < SOLVER, "{function:?}: {value:.12} at {point:?}");
            for minimiser in function.minimisers() {
                assert!((function.value(*minimiser) - function.least()).abs() < SOLVER, "{function:?}");
            }
            if function != PlaneFunction::LinearWaves {
                let near = |m: &[f64; 2]| (m[0] - point[0]).hypot(m[1] - point[1]) < 1e4 * SOLVER;
                assert!(function.minimisers().iter().any(near), "{function:?}: {point:?}");
            }
        }
    }

    #[test]
    fn the_rings_have_their_minimum_where_the_slope_vanishes() {
        // On x = 1: -2 y J1(1 + y^2) + 0.1 = 0.
        let y = PlaneFunction::Bessel.minimisers()[0][1];
        assert!((-2.0 * y * j1(1.0 + y * y) + 0.1).abs() < SLOPE);
    }

    #[test]
    fn the_origin_is_a_local_minimum_only_of_root_waves() {
        for k in 0..360 {
            for radius in [1e-6, 1e-3, 0.05, 0.1145] {
                let (y, x) = f64::from(k).to_radians().sin_cos();
                assert!(PlaneFunction::RootWaves.value([radius * x, radius * y]) > 0.0, "{k} {radius}");
            }
        }
        assert!(PlaneFunction::RootWaves.least() < PlaneFunction::RootWaves.value([0.0, 0.0]));
    }

    #[test]
    fn linear_waves_vanish_at_more_than_the_origin() {
        // 30 (0.5 + x)^0.2 = 3 pi / 2 + 8 pi on the positive axis.
        let x = (9.5 * std::f64::consts::PI / 30.0).powi(5) - 0.5;
        assert!(x > 0.1 && PlaneFunction::LinearWaves.value([x, 0.0]).abs() < ROUNDING, "{x}");
    }
}
