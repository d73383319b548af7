use super::*;
use crate::{OdeError, Status, StmPropagator, Tolerance, propagate_with_stm};

/// Round-off of the arithmetic.
const ROUND_OFF: f64 = 1e-14;

/// Discretisation: the tolerances of the integration and what its steps add up to.
const INTEGRATION: f64 = 1e-11;

/// An inclined, eccentric orbit with `mu = 1`.
const X0: [f64; 6] = [0.9, 0.1, 0.2, -0.1, 1.0, 0.3];

fn stm(t1: f64, settings: OdeSettings) -> crate::Stm {
    propagate_with_stm(&Kepler { axes: 3, mu: 1.0 }, 0.0, &X0, t1, settings).unwrap()
}

#[test]
fn end_state_is_that_of_the_state_alone() {
    for method in METHODS {
        let settings = OdeSettings { method, ..OdeSettings::with_tolerance(1e-10) };
        let result = stm(9.0, settings.clone());
        let mut x1 = [0.0; 6];
        let plain = Integrator::new(6, settings)
            .unwrap()
            .integrate(&Kepler { axes: 3, mu: 1.0 }, 0.0, &X0, 9.0, &mut x1)
            .unwrap();
        assert_eq!(plain.statistics.accepted, result.summary.statistics.accepted);
        assert!(distance(&result.state, &x1) < ROUND_OFF);
    }
}

/// `Phi^T J Phi = J` for a Hamiltonian system, and so a determinant of one.
#[test]
fn matrix_is_symplectic() {
    for (method, tolerance) in [(Method::Dop853, 1e-13), (Method::Dopri5, 1e-13)] {
        let phi = stm(10.0, OdeSettings { method, ..OdeSettings::with_tolerance(tolerance) }).phi;
        let at = |i: usize, j: usize| phi[6 * i + j];
        for i in 0..6 {
            for j in 0..6 {
                let product: f64 = (0..3).map(|k| at(k, i) * at(k + 3, j) - at(k + 3, i) * at(k, j)).sum();
                let expected = f64::from(i8::from(i + 3 == j)) - f64::from(i8::from(j + 3 == i));
                close(product, expected, 10.0 * INTEGRATION);
            }
        }
        close(determinant(&phi, 6), 1.0, 10.0 * INTEGRATION);
    }
}

/// Gaussian elimination with row pivoting.
fn determinant(matrix: &[f64], n: usize) -> f64 {
    let mut a = matrix.to_vec();
    let mut product = 1.0;
    for k in 0..n {
        let pivot = (k..n).max_by(|&p, &q| a[p * n + k].abs().total_cmp(&a[q * n + k].abs())).unwrap();
        if pivot != k {
            (0..n).for_each(|j| a.swap(k * n + j, pivot * n + j));
            product = -product;
        }
        product *= a[k * n + k];
        for i in k + 1..n {
            let factor = a[i * n + k] / a[k * n + k];
            (k..n).for_each(|j| a[i * n + j] -= factor * a[k * n + j]);
        }
    }
    product
}

/// With fixed steps the matrix is the derivative of the discrete map itself, whatever the error of the map.
#[test]
fn matrix_is_the_derivative_of_the_steps_taken() {
    let kepler = Kepler { axes: 3, mu: 1.0 };
    for (method, step) in [(Method::Dop853, 1.0), (Method::Dopri5, 0.5)] {
        let settings = OdeSettings { method, fixed_step: Some(step), ..OdeSettings::default() };
        let result = stm(5.0, settings.clone());
        let mut integrator = Integrator::new(6, settings).unwrap();
        let (mut plus, mut minus) = ([0.0; 6], [0.0; 6]);
        for j in 0..6 {
            let shift = 1e-5;
            let mut x = X0;
            x[j] += shift;
            integrator.integrate(&kepler, 0.0, &x, 5.0, &mut plus).unwrap();
            x[j] -= 2.0 * shift;
            integrator.integrate(&kepler, 0.0, &x, 5.0, &mut minus).unwrap();
            for i in 0..6 {
                let quotient = (plus[i] - minus[i]) / (2.0 * shift);
                close(result.phi[6 * i + j], quotient, 2e-8 * (1.0 + quotient.abs()));
            }
        }
        // The map itself is far less accurate than that.
        let exact = stm(5.0, OdeSettings::default());
        assert!(distance(&exact.state, &result.state) > 1e-6);
    }
}

#[test]
fn parameter_sensitivity_is_the_analytic_one() {
    let (w, t) = (1.3, 4.0);
    let mut propagator = StmPropagator::new(2, 1, OdeSettings::default()).unwrap();
    // Forward and, by the symmetry of the cosine, backward.
    for sign in [1.0, -1.0] {
        let t = sign * t;
        let summary = propagator.propagate(&Oscillator { frequency: w }, 0.0, &[1.0, 0.0], t).unwrap();
        assert_eq!(summary.status, Status::Completed);
        let (s, c) = (w * t).sin_cos();
        assert!(distance(propagator.state(), &[c, -w * s]) < INTEGRATION);
        assert!(distance(propagator.stm(), &[c, s / w, -w * s, c]) < INTEGRATION);
        assert!(distance(propagator.sensitivity(), &[-t * s, -s - w * t * c]) < INTEGRATION);
    }
}

#[test]
fn no_time_gives_the_identity_and_wrong_sizes_an_error() {
    let system = Oscillator { frequency: 1.0 };
    let mut propagator = StmPropagator::new(2, 1, OdeSettings::default()).unwrap();
    propagator.propagate(&system, 1.0, &[3.0, 4.0], 1.0).unwrap();
    assert_eq!((propagator.state(), propagator.sensitivity()), (&[3.0, 4.0][..], &[0.0, 0.0][..]));
    assert_eq!(propagator.stm(), [1.0, 0.0, 0.0, 1.0]);
    assert!(propagator.propagate(&system, 1.0, &[3.0], 2.0).is_err());
    assert!(propagator.propagate(&system, 1.0, &[3.0, f64::NAN], 2.0).is_err());
    let mut other = StmPropagator::new(2, 0, OdeSettings::default()).unwrap();
    assert!(matches!(other.propagate(&system, 0.0, &[1.0, 0.0], 1.0), Err(OdeError::Dimension { .. })));
    let per_component = |values: Vec<f64>| OdeSettings {
        absolute_tolerance: Tolerance::PerComponent(values),
        ..OdeSettings::default()
    };
    assert!(StmPropagator::new(2, 1, per_component(vec![1e-9; 2])).is_ok());
    assert!(StmPropagator::new(2, 1, per_component(vec![1e-9; 8])).is_ok());
    assert!(StmPropagator::new(2, 1, per_component(vec![1e-9; 3])).is_err());
}
