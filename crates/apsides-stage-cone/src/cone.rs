//! Arithmetic of the cones of a stage: Nesterov-Todd scaling, products, steps to the boundary.
//!
//! The scaling of a linear row with slack `s` and multiplier `z` is `W = sqrt(s/z)`; that of a cone, with `J = diag(1, -1, ..)`,
//!
//! ```text
//! W = eta [w0, w1'; w1, I + w1 w1'/(1 + w0)],   W^2 = eta^2 (2 w w' - J),   W^-2 = eta^-2 (2 (Jw) (Jw)' - J)
//! ```
//!
//! with `w' J w = 1` and `W z = W^-1 s = lambda` (L. Vandenberghe, The CVXOPT linear and quadratic cone program solvers, 2010, section 4).

/// Rows of a stage by cones: so many linear ones, then cones of so many rows each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cones<'a> {
    pub(crate) linear: usize,
    pub(crate) sizes: &'a [u8],
}

/// The scaling at a point, and the scaled point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scaling<const NR: usize> {
    /// `w` of the cones.
    point: [f64; NR],
    /// `W` of linear rows; `eta` at the first row of a cone.
    size: [f64; NR],
    /// Their inverse squares.
    inverse: [f64; NR],
    lambda: [f64; NR],
}

impl<const NR: usize> Scaling<NR> {
    /// `W = I`.
    pub(crate) const IDENTITY: Self =
        Self { point: [0.0; NR], size: [1.0; NR], inverse: [1.0; NR], lambda: [0.0; NR] };

    pub(crate) fn reset(&mut self, cones: Cones<'_>) {
        *self = Self::IDENTITY;
        cones.each(|from, _| self.point[from] = 1.0);
    }

    /// The scaling at `s`, `z`; false if one is not inside its cone.
    #[inline(always)]
    pub(crate) fn update(&mut self, cones: Cones<'_>, s: &[f64; NR], z: &[f64; NR]) -> bool {
        for r in 0..cones.linear {
            if !(s[r] > 0.0 && z[r] > 0.0) {
                return false;
            }
            self.size[r] = sqrt(s[r] / z[r]);
            self.inverse[r] = z[r] / s[r];
            self.lambda[r] = sqrt(s[r] * z[r]);
        }
        let mut inside = true;
        cones.each(|from, to| {
            let (s, z) = (&s[from..to], &z[from..to]);
            let (a, b) = (determinant(s), determinant(z));
            if !(a > 0.0 && b > 0.0 && s[0] > 0.0 && z[0] > 0.0) {
                inside = false;
                return;
            }
            let (a, b) = (sqrt(a), sqrt(b));
            let product: f64 = s.iter().zip(z).map(|(s, z)| s * z).sum::<f64>() / (a * b);
            let gamma = sqrt(0.5 * (1.0 + product));
            let point = &mut self.point[from..to];
            let half = 0.5 / gamma;
            point[0] = half * (s[0] / a + z[0] / b);
            for i in 1..point.len() {
                point[i] = half * (s[i] / a - z[i] / b);
            }
            self.inverse[from] = b / a;
            self.size[from] = sqrt(a / b);
            let (head, tail) = (point[0], &point[1..]);
            let zeta: f64 = tail.iter().zip(&z[1..]).map(|(w, z)| w * z).sum();
            let eta = self.size[from];
            let lambda = &mut self.lambda[from..to];
            lambda[0] = eta * (head * z[0] + zeta);
            let share = z[0] + zeta / (1.0 + head);
            for i in 0..tail.len() {
                lambda[1 + i] = eta * (z[1 + i] + share * tail[i]);
            }
        });
        inside
    }

    /// `W^-2 v`.
    #[inline(always)]
    pub(crate) fn inverse_square(&self, cones: Cones<'_>, v: &mut [f64; NR]) {
        for r in 0..cones.linear {
            v[r] *= self.inverse[r];
        }
        cones.each(|from, to| {
            let (w, v) = (&self.point[from..to], &mut v[from..to]);
            let dot = 2.0 * (w[0] * v[0] - inner(&w[1..], &v[1..]));
            let scale = self.inverse[from];
            v[0] = scale * (dot * w[0] - v[0]);
            for i in 1..w.len() {
                v[i] = scale * (v[i] - dot * w[i]);
            }
        });
    }

    /// `W v`.
    #[inline(always)]
    fn apply(&self, from: usize, to: usize, v: &mut [f64]) {
        let w = &self.point[from..to];
        let eta = self.size[from];
        let zeta = inner(&w[1..], &v[1..]);
        let share = v[0] + zeta / (1.0 + w[0]);
        v[0] = eta * (w[0] * v[0] + zeta);
        for i in 1..w.len() {
            v[i] = eta * (v[i] + share * w[i]);
        }
    }

    /// The corrector's part of the slack: `W (lambda \ ((lambda + a) o a + centre e))`, `a = W dz` of the predictor, in place of `dz`.
    #[inline(always)]
    pub(crate) fn correct(&self, cones: Cones<'_>, centre: f64, dz: &mut [f64; NR]) {
        for r in 0..cones.linear {
            let a = self.size[r] * dz[r];
            dz[r] = self.size[r] * (a + (a * a + centre) / self.lambda[r]);
        }
        cones.each(|from, to| {
            let v = &mut dz[from..to];
            self.apply(from, to, v);
            let lambda = &self.lambda[from..to];
            // (lambda + a) o a = lambda o a + a o a, and lambda \ (lambda o a) = a.
            let square: f64 = v.iter().map(|a| a * a).sum::<f64>() + centre;
            let twice = 2.0 * v[0];
            let along = twice * inner(&lambda[1..], &v[1..]);
            let head = (lambda[0] * square - along) / determinant(lambda);
            for i in 1..lambda.len() {
                v[i] += (twice * v[i] - head * lambda[i]) / lambda[0];
            }
            v[0] += head;
            self.apply(from, to, v);
        });
    }

    /// `1/eta^2` and `w` of the cone from a row.
    pub(crate) fn cone(&self, from: usize, to: usize) -> (f64, &[f64]) {
        (self.inverse[from], &self.point[from..to])
    }

    /// `1/W^2` of a linear row.
    pub(crate) fn row(&self, row: usize) -> f64 {
        self.inverse[row]
    }
}

impl Cones<'_> {
    /// Calls with the first row of each cone and that after its last.
    #[inline(always)]
    pub(crate) fn each(self, mut f: impl FnMut(usize, usize)) {
        let mut from = self.linear;
        for &size in self.sizes {
            let to = from + usize::from(size);
            f(from, to);
            from = to;
        }
    }

    /// Linear rows and cones.
    pub(crate) fn degree(self) -> usize {
        self.linear + self.sizes.len()
    }

    /// The least of what the rows are inside their cones by.
    pub(crate) fn margin(self, v: &[f64]) -> f64 {
        let mut least = v[..self.linear].iter().copied().fold(f64::INFINITY, f64::min);
        self.each(|from, to| least = least.min(v[from] - norm(&v[from + 1..to])));
        least
    }

    /// Adds a multiple of the unit `e` of the cones.
    pub(crate) fn add_unit(self, factor: f64, v: &mut [f64]) {
        v[..self.linear].iter_mut().for_each(|v| *v += factor);
        self.each(|from, _| v[from] += factor);
    }

    /// The largest step, at most `most`, along which a point inside the cones stays in them.
    #[inline(always)]
    pub(crate) fn largest_step(self, v: &[f64], d: &[f64], most: f64) -> f64 {
        let mut step = most;
        for r in 0..self.linear {
            if v[r] + step * d[r] < 0.0 {
                step = -v[r] / d[r];
            }
        }
        self.each(|from, to| {
            let (v, d) = (&v[from..to], &d[from..to]);
            let b = v[0] * d[0] - inner(&v[1..], &d[1..]);
            let a = d[0] * d[0] - inner(&d[1..], &d[1..]);
            let c = determinant(v);
            let below = sqrt((b * b - a * c).max(0.0)) - b;
            if below * step > c {
                step = c / below;
            }
        });
        step.max(0.0)
    }
}

/// `v0^2 - |v1|^2`, without loss of digits near the boundary.
#[inline(always)]
fn determinant(v: &[f64]) -> f64 {
    let tail = norm(&v[1..]);
    (v[0] - tail) * (v[0] + tail)
}

#[inline(always)]
fn inner(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[inline(always)]
fn norm(v: &[f64]) -> f64 {
    sqrt(inner(v, v))
}

#[cfg(feature = "std")]
pub(crate) fn sqrt(v: f64) -> f64 {
    v.sqrt()
}

#[cfg(not(feature = "std"))]
pub(crate) fn sqrt(v: f64) -> f64 {
    libm::sqrt(v)
}
