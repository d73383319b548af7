//! Problems in which every extremal is a global optimum.
//!
//! Over fixed times, with equations of motion, path constraints, endpoint constraints and bounded integrals that are affine in
//! states, controls and parameters, and a cost that is a convex quadratic function of them, the set of admissible trajectories is
//! convex and so is the cost: the minimum principle is sufficient (O. L. Mangasarian, SIAM J. Control 4 (1966) 139, doi
//! 10.1137/0304013). That a function is affine is read from the pattern of its second derivatives; that it is quadratic from its
//! second derivatives at points over the whole range of its inputs, which must agree to rounding.

use apsides_ad::NodeFunction;
use apsides_ocp::{Bounds, Ocp, Trajectory};
use nalgebra::DMatrix;

use crate::equations::sign;
use crate::{Check, CheckKind};

/// Points at which second derivatives are compared.
const POINTS: usize = 12;
/// Allowed difference between them, relative to the largest.
const ROUNDING: f64 = 1e-12;

/// The check that the problem is convex; none if it is not.
pub(crate) fn check(ocp: &Ocp, trajectory: &Trajectory) -> Option<Check> {
    let convex = ocp.phases.iter().enumerate().all(|(k, _)| phase_is_convex(ocp, trajectory, k))
        && ends_are_convex(ocp);
    convex.then(|| {
        let words = "affine equations and constraints over fixed times, convex quadratic cost";
        Check::new("convex problem", CheckKind::Convexity, 0.0, 0.0, "-", words)
    })
}

fn phase_is_convex(ocp: &Ocp, trajectory: &Trajectory, k: usize) -> bool {
    let phase = &ocp.phases[k];
    let found = &trajectory.phases[k];
    let fixed = phase.initial_time.is_fixed() && phase.final_time.is_fixed();
    let affine = |f: &dyn NodeFunction| {
        let time = f.inputs() - 1;
        f.pattern().hessian.iter().all(|&(i, j)| i == time || j == time)
    };
    if !fixed || !affine(phase.dynamics.as_ref()) || !phase.path.iter().all(|p| affine(p.function.as_ref())) {
        return false;
    }
    let sign = sign(ocp);
    // Inputs [x, u, p, t] at points over the phase, far from the trajectory too.
    let (nx, nu) = (phase.states.len(), phase.controls.len());
    let points: Vec<Vec<f64>> = (0..POINTS)
        .map(|n| {
            let t = found.time_at(n as f64 / (POINTS - 1) as f64);
            let spread = [0.0, 1.0, -1.0, 7.0][n % 4];
            let mut z = found.state_at(t);
            z.extend(found.control_at(t));
            z.extend(&trajectory.parameters);
            for (i, v) in z.iter_mut().enumerate() {
                *v += spread * (1.0 + v.abs()) * (0.3 + ((i * 7 + n * 3) % 5) as f64 / 5.0);
            }
            z.push(t);
            z
        })
        .collect();
    phase.integrals.iter().enumerate().all(|(q, integral)| {
        let function = integral.function.as_ref();
        let weight = sign * ocp.objective.integral_weight(k, q);
        if affine(function) {
            return true;
        }
        let bare = !phase.takes_parameters(function);
        let inputs = points.iter().map(|z| {
            let mut z = z.clone();
            if bare {
                z.drain(nx + nu..z.len() - 1);
            }
            z
        });
        // Bounded, it would be a constraint that is not affine.
        integral.variable.bounds == Bounds::FREE && is_convex_quadratic(function, weight, inputs)
    })
}

fn ends_are_convex(ocp: &Ocp) -> bool {
    let affine = |f: &dyn NodeFunction| f.pattern().hessian.is_empty();
    let sign = sign(ocp);
    let points =
        |n: usize| (0..POINTS).map(move |k| (0..n).map(|i| ((i * 7 + k * 3) % 11) as f64 - 5.0).collect());
    ocp.constraints.iter().all(|c| affine(c.function.as_ref()))
        && (ocp.objective.functions.iter()).all(|(inputs, f)| {
            affine(f.as_ref()) || is_convex_quadratic(f.as_ref(), sign, points(inputs.len()))
        })
}

/// Returns true if the weighted first output has one Hessian at all points, but for its last input where that is a time, and this
/// has no negative eigenvalue.
fn is_convex_quadratic(
    function: &dyn NodeFunction,
    weight: f64,
    points: impl Iterator<Item = Vec<f64>>,
) -> bool {
    let pairs = &function.pattern().hessian;
    let n = function.inputs();
    let mut first: Option<Vec<f64>> = None;
    for z in points {
        let mut entries = vec![0.0; pairs.len()];
        function.hessian(&z, &[weight], &mut entries);
        if !entries.iter().all(|v| v.is_finite()) {
            return false;
        }
        let largest = entries.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        match &first {
            Some(first) if first.iter().zip(&entries).any(|(a, b)| (a - b).abs() > ROUNDING * largest) => {
                return false;
            }
            Some(_) => {}
            None => first = Some(entries),
        }
    }
    let Some(entries) = first else { return false };
    let mut hessian = DMatrix::zeros(n, n);
    for (&(i, j), v) in pairs.iter().zip(&entries) {
        hessian[(i, j)] = *v;
        hessian[(j, i)] = *v;
    }
    let eigenvalues = hessian.symmetric_eigenvalues();
    eigenvalues.min() >= -ROUNDING * eigenvalues.amax()
}

#[cfg(test)]
mod tests {
    use super::*;
    use apsides_ad::{Scalar, VectorFunction, vector_node};

    struct Form(u8);
    impl VectorFunction<2, 1> for Form {
        fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
            let [a, b] = *z;
            [match self.0 {
                0 => a * a + a * b + b * b,
                1 => a * a + a * b * 3.0 + b * b,
                2 => a * a * a * a,
                _ => a.exp(),
            }]
        }
    }

    #[test]
    fn only_convex_quadratics_pass() {
        let points = || (0..8).map(|k| vec![f64::from(k) - 3.5, 0.3 * f64::from(k)]);
        for (form, weight, expected) in
            [(0, 1.0, true), (0, -1.0, false), (1, 1.0, false), (2, 1.0, false), (3, 1.0, false)]
        {
            let function = vector_node(Form(form));
            assert_eq!(is_convex_quadratic(function.as_ref(), weight, points()), expected, "{form} {weight}");
        }
    }
}
