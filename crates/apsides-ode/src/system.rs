//! The right-hand side `x' = f(t, x)`.

/// An ordinary differential equation `x' = f(t, x)`.
pub trait OdeSystem {
    /// Number of components of `x`.
    fn dimension(&self) -> usize;

    /// Writes `f(t, x)` to `dx`; both slices have [`dimension`](Self::dimension) components.
    ///
    /// Outside the domain of `f`, write NaN: the integrator then tries a shorter step.
    fn rate(&self, t: f64, x: &[f64], dx: &mut [f64]);
}

/// A system with its partial derivatives, for the variational equations.
pub trait Linearised: OdeSystem {
    /// Writes `df/dx`, row-major `n x n`, to `jac`. Every entry is to be written.
    fn jacobian(&self, t: f64, x: &[f64], jac: &mut [f64]);

    /// Number `p` of parameters with respect to which sensitivities are wanted.
    fn parameters(&self) -> usize {
        0
    }

    /// Writes `df/dp`, row-major `n x p`, to `jac`. Every entry is to be written. Not called when `p` is zero.
    fn parameter_jacobian(&self, _t: f64, _x: &[f64], jac: &mut [f64]) {
        jac.fill(0.0);
    }
}

impl<S: OdeSystem + ?Sized> OdeSystem for &S {
    fn dimension(&self) -> usize {
        (**self).dimension()
    }

    #[inline]
    fn rate(&self, t: f64, x: &[f64], dx: &mut [f64]) {
        (**self).rate(t, x, dx);
    }
}

impl<S: Linearised + ?Sized> Linearised for &S {
    fn jacobian(&self, t: f64, x: &[f64], jac: &mut [f64]) {
        (**self).jacobian(t, x, jac);
    }

    fn parameters(&self) -> usize {
        (**self).parameters()
    }

    fn parameter_jacobian(&self, t: f64, x: &[f64], jac: &mut [f64]) {
        (**self).parameter_jacobian(t, x, jac);
    }
}

/// A closure as a system.
#[derive(Debug, Clone, Copy)]
pub struct FnSystem<F> {
    dimension: usize,
    rate: F,
}

impl<F: Fn(f64, &[f64], &mut [f64])> FnSystem<F> {
    /// The system of `dimension` components whose rate `rate(t, x, dx)` writes to `dx`.
    pub fn new(dimension: usize, rate: F) -> Self {
        Self { dimension, rate }
    }
}

impl<F: Fn(f64, &[f64], &mut [f64])> OdeSystem for FnSystem<F> {
    fn dimension(&self) -> usize {
        self.dimension
    }

    #[inline]
    fn rate(&self, t: f64, x: &[f64], dx: &mut [f64]) {
        (self.rate)(t, x, dx);
    }
}
