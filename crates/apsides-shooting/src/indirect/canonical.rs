//! The canonical system of states and costates, with its variational equations.

use std::cell::RefCell;

use apsides_ode::OdeSystem;

use super::hamiltonian::Hamiltonian;

impl Hamiltonian {
    /// Rates of `y = [x, lambda, q]` at a time: `x' = f`, `lambda' = -dHbar/dx`, `q' = dHbar/dp`. NaN where no control was found.
    pub(super) fn rates(&mut self, t: f64, y: &[f64], p: &[f64], rates: &mut [f64]) {
        let nx = self.states;
        if !self.find_control(t, &y[..nx], &y[nx..2 * nx], p) {
            rates.fill(f64::NAN);
            return;
        }
        self.linearise();
        self.write_rates(rates);
    }

    fn write_rates(&self, rates: &mut [f64]) {
        let (nx, nu, np) = (self.states, self.controls, self.parameters);
        rates[..nx].copy_from_slice(&self.dynamics.values);
        for i in 0..nx {
            rates[nx + i] = -self.gradient[i];
        }
        rates[2 * nx..2 * nx + np].copy_from_slice(&self.gradient[nx + nu..nx + nu + np]);
    }

    /// The same with the matrix of derivatives with respect to `[y, p]`, row-major.
    pub(super) fn rates_and_slopes(
        &mut self,
        t: f64,
        y: &[f64],
        p: &[f64],
        rates: &mut [f64],
        slopes: &mut [f64],
    ) {
        let (nx, nu, np, nz) = (self.states, self.controls, self.parameters, self.inputs());
        if !self.find_control(t, &y[..nx], &y[nx..2 * nx], p) {
            rates.fill(f64::NAN);
            return;
        }
        self.linearise();
        self.curve();
        self.write_rates(rates);
        self.differentiate_control();
        let (n, columns) = (self.dimension(), 2 * nx + np);
        let width = n + np;
        slopes.fill(0.0);
        // Columns of [x, lambda, q, p] by those of [x, lambda, p].
        let place = |c: usize| if c < 2 * nx { c } else { n + c - 2 * nx };
        for i in 0..nx {
            let row = &mut slopes[i * width..(i + 1) * width];
            row[..nx].copy_from_slice(&self.rate_slopes[i * nz..i * nz + nx]);
            row[n..].copy_from_slice(&self.rate_slopes[i * nz + nx + nu..i * nz + nx + nu + np]);
        }
        for (i, input) in (0..nx).chain(nx + nu..nx + nu + np).enumerate() {
            // lambda' for a state, q' for a parameter.
            let (target, sign) = if i < nx { (nx + i, -1.0) } else { (nx + i, 1.0) };
            let row = &mut slopes[target * width..(target + 1) * width];
            for x in 0..nx {
                row[x] = sign * self.curvature[input * nz + x];
                row[nx + x] = sign * self.rate_slopes[x * nz + input];
            }
            for k in 0..np {
                row[n + k] = sign * self.curvature[input * nz + nx + nu + k];
            }
        }
        for u in 0..nu {
            let moved = &self.control_slopes[u * columns..(u + 1) * columns];
            for (c, &du) in moved.iter().enumerate().filter(|(_, du)| **du != 0.0) {
                let column = place(c);
                for i in 0..nx {
                    slopes[i * width + column] += self.rate_slopes[i * nz + nx + u] * du;
                    slopes[(nx + i) * width + column] -= self.curvature[i * nz + nx + u] * du;
                }
                for k in 0..np {
                    slopes[(2 * nx + k) * width + column] += self.curvature[(nx + nu + k) * nz + nx + u] * du;
                }
            }
        }
        for r in 0..self.row_count {
            let moved = &self.multiplier_slopes[r * columns..(r + 1) * columns];
            for (c, &dm) in moved.iter().enumerate().filter(|(_, dm)| **dm != 0.0) {
                let column = place(c);
                for i in 0..nx {
                    slopes[(nx + i) * width + column] -= self.row_slopes[r * nz + i] * dm;
                }
                for k in 0..np {
                    slopes[(2 * nx + k) * width + column] += self.row_slopes[r * nz + nx + nu + k] * dm;
                }
            }
        }
    }

    /// Derivatives of `dH/du` of a switching control with respect to `[y, p]` and its rate along the solution; needs
    /// [`rates_and_slopes`](Self::rates_and_slopes) at the point.
    pub(super) fn switching_slopes(&self, u: usize, rates: &[f64], slopes: &mut [f64]) -> f64 {
        let (nx, nu, np, nz) = (self.states, self.controls, self.parameters, self.inputs());
        let (n, columns) = (self.dimension(), 2 * nx + np);
        slopes.fill(0.0);
        for x in 0..nx {
            slopes[x] = self.curvature[(nx + u) * nz + x];
            slopes[nx + x] = self.rate_slopes[x * nz + nx + u];
        }
        for k in 0..np {
            slopes[n + k] = self.curvature[(nx + u) * nz + nx + nu + k];
        }
        for v in 0..nu {
            let mixed = self.curvature[(nx + u) * nz + nx + v];
            for c in 0..columns {
                let column = if c < 2 * nx { c } else { n + c - 2 * nx };
                slopes[column] += mixed * self.control_slopes[v * columns + c];
            }
        }
        let explicit = self.curvature[(nx + u) * nz + nx + nu + np];
        explicit + slopes[..n].iter().zip(rates).map(|(s, r)| s * r).sum::<f64>()
    }
}

/// `out = A moved + B` for `[A, B]` in the rows of `slopes` (`n x width`), with `moved` and `out` of `n x width` too: `B` has the last
/// columns. `W` is the width where it is known, so that loops unroll, else 0.
fn product<const W: usize>(n: usize, slopes: &[f64], moved: &[f64], out: &mut [f64], width: usize) {
    let width = if W > 0 { W } else { width };
    for (row, out) in slopes.chunks_exact(width).zip(out.chunks_exact_mut(width)) {
        out[..n].fill(0.0);
        out[n..].copy_from_slice(&row[n..]);
        for (&factor, from) in row[..n].iter().zip(moved.chunks_exact(width)) {
            // Half of the entries are zero.
            if factor != 0.0 {
                for k in 0..width {
                    out[k] += factor * from[k];
                }
            }
        }
    }
}

/// Calls a function with the width as a constant where it is a usual one.
macro_rules! with_width {
    ($width:expr, $function:ident($($argument:expr),*)) => {
        match $width {
            8 => $function::<8>($($argument),*, 8),
            10 => $function::<10>($($argument),*, 10),
            12 => $function::<12>($($argument),*, 12),
            14 => $function::<14>($($argument),*, 14),
            width => $function::<0>($($argument),*, width),
        }
    };
}

/// The canonical system of one phase at given parameters, alone or followed by its sensitivities
/// `[dy/dy0 (n x n), dy/dp (n x np)]` in one row-major matrix of `n x (n + np)`.
pub(super) struct Canonical<'a> {
    pub(super) hamiltonian: &'a RefCell<Hamiltonian>,
    pub(super) parameters: &'a [f64],
    pub(super) sensitivities: bool,
    slopes: RefCell<Vec<f64>>,
}

impl<'a> Canonical<'a> {
    pub(super) fn new(
        hamiltonian: &'a RefCell<Hamiltonian>,
        parameters: &'a [f64],
        sensitivities: bool,
    ) -> Self {
        let (n, np) = {
            let h = hamiltonian.borrow();
            (h.dimension(), h.parameters)
        };
        Self { hamiltonian, parameters, sensitivities, slopes: RefCell::new(vec![0.0; n * (n + np)]) }
    }

    /// Components of the system alone.
    fn components(&self) -> (usize, usize) {
        let h = self.hamiltonian.borrow();
        (h.dimension(), h.parameters)
    }
}

impl OdeSystem for Canonical<'_> {
    fn dimension(&self) -> usize {
        let (n, np) = self.components();
        if self.sensitivities { n * (1 + n + np) } else { n }
    }

    fn rate(&self, t: f64, z: &[f64], rates: &mut [f64]) {
        let mut h = self.hamiltonian.borrow_mut();
        if !self.sensitivities {
            h.rates(t, z, self.parameters, rates);
            return;
        }
        let (n, np) = (h.dimension(), h.parameters);
        let width = n + np;
        let (y, moved) = z.split_at(n);
        let (dy, dmoved) = rates.split_at_mut(n);
        let mut slopes = self.slopes.borrow_mut();
        h.rates_and_slopes(t, y, self.parameters, dy, &mut slopes);
        with_width!(width, product(n, &slopes, moved, dmoved));
    }
}

#[cfg(test)]
mod tests;
