//! The effect of thrust on states and costates of a coast, from the models of the plane and of space.

use std::f64::consts::FRAC_PI_2;

use apsides_ad::{Dual, Dynamics, Scalar};
use apsides_dynamics::equinoctial::{PlanarCoast, PlanarThrust, SpatialCoast, SpatialThrust};

use super::injection::GeoInjection;

impl GeoInjection {
    /// Switching function per mass flow, from the models: they are linear in the direction of the thrust.
    pub(super) fn switching_function(&self, x: &[f64], lambda: &[f64]) -> f64 {
        let forward = self.thrust_gain(x, lambda, [0.0, 0.0]);
        let up = self.thrust_gain(x, lambda, [FRAC_PI_2, 0.0]);
        let back = self.thrust_gain(x, lambda, [2.0 * FRAC_PI_2, 0.0]);
        // What does not turn with the direction is the mass.
        let mass = 0.5 * (forward + back);
        let out = if self.is_spatial() { self.thrust_gain(x, lambda, [0.0, FRAC_PI_2]) - mass } else { 0.0 };
        let size = (forward - mass).hypot(up - mass).hypot(out);
        (mass - size) / self.engine().mass_flow()
    }

    /// `lambda . (rate with thrust - rate without)` for angles of the thrust.
    fn thrust_gain(&self, x: &[f64], lambda: &[f64], angles: [f64; 2]) -> f64 {
        let with = self.rate_with_thrust(x, angles);
        let without = if self.is_spatial() {
            SpatialCoast(self.flight).rate(0.0, &std::array::from_fn(|i| x[i]), &[], &[]).to_vec()
        } else {
            PlanarCoast(self.flight).rate(0.0, &std::array::from_fn(|i| x[i]), &[], &[]).to_vec()
        };
        lambda.iter().zip(with.iter().zip(without)).map(|(l, (a, b))| l * (a - b)).sum()
    }

    /// Rate of the states of a coast with thrust at angles in and out of the orbital plane.
    pub(super) fn rate_with_thrust<S: Scalar>(&self, x: &[S], angles: [f64; 2]) -> Vec<S> {
        let [in_plane, out_of_plane] = angles.map(S::from);
        let t = S::from(0.0);
        if self.is_spatial() {
            let x = std::array::from_fn(|i| x[i]);
            SpatialThrust(self.flight).rate(t, &x, &[in_plane, out_of_plane], &[]).to_vec()
        } else {
            PlanarThrust(self.flight).rate(t, &std::array::from_fn(|i| x[i]), &[in_plane], &[]).to_vec()
        }
    }

    /// `-(df/dx)^T lambda` with thrust at fixed angles.
    pub(super) fn costate_rate(&self, x: &[f64], lambda: &[f64], angles: [f64; 2]) -> Vec<f64> {
        let seeded: Vec<Dual<7>> = x.iter().enumerate().map(|(i, x)| Dual::variable(*x, i)).collect();
        let rate = self.rate_with_thrust(&seeded, angles);
        (0..x.len()).map(|j| -rate.iter().zip(lambda).map(|(f, l)| l * f.eps[j]).sum::<f64>()).collect()
    }
}
