use super::*;
use crate::vector;
use nalgebra::{SMatrix, SVector};
use num_dual::DualNum;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-13;

/// Every operator and elementary function once, with different dependence per output.
struct Everything;

impl VectorFunction<5, 6> for Everything {
    fn evaluate<S: Scalar>(&self, z: &[S; 5]) -> [S; 6] {
        let [a, b, c, d, _] = *z;
        let (s, k) = (a * b).sin_cos();
        [
            a * 2.0 - b / 4.0 + 1.0,
            s * c.exp() + k / (c.square() + 2.0),
            (a + 3.0).ln() * (b - 0.5).atan() - d.tanh(),
            d.atan2(c + 2.0) + (a * 0.1).asin() - (b * 0.1).acos(),
            (c + 4.0).sqrt().powi(3) + (d + 5.0).powf(1.7) + (a.sinh() - b.cosh()) * c.tan(),
            vector::norm(&[a, b, c], 1e-3) + vector::dot(&[a, b], &[c, d]) - (d + 3.0).recip(),
        ]
    }
}

/// The same formulas on the oracle's numbers, written with its own trait.
fn oracle<D: DualNum<Primitive = f64>>(z: [D; 5]) -> [D; 6] {
    let [a, b, c, d, _] = z;
    let ab = a.clone() * &b;
    [
        a.clone() * 2.0 - b.clone() / 4.0 + 1.0,
        ab.sin() * c.exp() + ab.cos() / (c.clone() * &c + 2.0),
        (a.clone() + 3.0).ln() * (b.clone() - 0.5).atan() - d.tanh(),
        d.atan2(c.clone() + 2.0) + (a.clone() * 0.1).asin() - (b.clone() * 0.1).acos(),
        (c.clone() + 4.0).sqrt().powi(3) + (d.clone() + 5.0).powf(1.7) + (a.sinh() - b.cosh()) * c.tan(),
        (a.clone() * &a + b.clone() * &b + c.clone() * &c + 1e-6).sqrt() + a * c + b * &d - (d + 3.0).recip(),
    ]
}

const POINT: [f64; 5] = [0.7, -0.4, 0.9, 1.3, 2.0];

#[test]
fn jacobian_agrees_with_num_dual() {
    let node = vector_node(Everything);
    let (_, expected) = num_dual::jacobian(
        |z: SVector<_, 5>| SVector::from(oracle(std::array::from_fn(|k| z[k]))),
        &SVector::from(POINT),
    );
    let expected: SMatrix<f64, 6, 5> = expected;
    let mut out = [0.0; 6];
    let mut entries = vec![f64::NAN; node.pattern().jacobian_len()];
    node.jacobian(&POINT, &mut out, &mut entries);
    let mut dense = SMatrix::<f64, 6, 5>::zeros();
    for ((r, c), v) in node.pattern().jacobian_entries().zip(&entries) {
        dense[(r, c)] = *v;
    }
    assert!((dense - expected).abs().max() < 0.1 * ROUNDING, "{dense} {expected}");
    let mut values = [0.0; 6];
    node.value(&POINT, &mut values);
    assert_eq!(values, out);
}

#[test]
fn weighted_hessian_agrees_with_num_dual() {
    let node = vector_node(Everything);
    let weights = [3.0, -1.0, 0.5, 2.0, 1.5, -0.7];
    let (_, _, expected) = num_dual::hessian(
        |z: SVector<_, 5>| {
            oracle(std::array::from_fn(|k| z[k]))
                .into_iter()
                .zip(weights)
                .map(|(v, w)| v * w)
                .reduce(|a, b| a + b)
                .unwrap()
        },
        &SVector::from(POINT),
    );
    let expected: SMatrix<f64, 5, 5> = expected;
    let mut entries = vec![f64::NAN; node.pattern().hessian_len()];
    node.hessian(&POINT, &weights, &mut entries);
    let mut dense = SMatrix::<f64, 5, 5>::zeros();
    for (&(i, j), v) in node.pattern().hessian.iter().zip(&entries) {
        dense[(i, j)] = *v;
        dense[(j, i)] = *v;
    }
    assert!((dense - expected).abs().max() < ROUNDING, "{dense} {expected}");
}

#[test]
fn pattern_holds_only_what_can_be_non_zero() {
    let node = vector_node(Everything);
    let pattern = node.pattern();
    let row = |r: usize| pattern.columns[pattern.row_offsets[r]..pattern.row_offsets[r + 1]].to_vec();
    assert_eq!(row(0), [0, 1]);
    assert_eq!(row(1), [0, 1, 2]);
    assert_eq!(row(2), [0, 1, 3]);
    assert!(pattern.hessian.iter().all(|&(i, j)| i < 4 && j <= i), "the unused input stays out");
}

struct Linear;
impl VectorFunction<3, 2> for Linear {
    fn evaluate<S: Scalar>(&self, z: &[S; 3]) -> [S; 2] {
        [z[0] * 3.0 - z[2], S::from(4.0)]
    }
}

#[test]
fn linear_and_constant_outputs_have_no_hessian() {
    let node = vector_node(Linear);
    assert!(node.pattern().hessian.is_empty());
    assert_eq!(node.pattern().columns, [0, 2]);
    let (mut out, mut entries) = ([0.0; 2], [0.0; 2]);
    node.jacobian(&[1.0, 2.0, 3.0], &mut out, &mut entries);
    assert_eq!((out, entries), ([0.0, 4.0], [3.0, -1.0]));
    node.hessian(&[1.0, 2.0, 3.0], &[1.0, 1.0], &mut []);
}

/// More inputs than lanes: the Jacobian takes several passes.
struct Wide;
impl VectorFunction<40, 2> for Wide {
    fn evaluate<S: Scalar>(&self, z: &[S; 40]) -> [S; 2] {
        let mut sum = S::from(0.0);
        for (k, &v) in z.iter().enumerate() {
            sum += v.square() * k as f64;
        }
        [sum, z[39] * z[0]]
    }
}

#[test]
fn jacobian_in_several_passes() {
    let node = vector_node(Wide);
    let z: Vec<f64> = (0..40).map(|k| 1.0 + f64::from(k)).collect();
    let (mut out, mut entries) = ([0.0; 2], vec![0.0; node.pattern().jacobian_len()]);
    node.jacobian(&z, &mut out, &mut entries);
    for ((r, c), v) in node.pattern().jacobian_entries().zip(&entries) {
        let expected = match (r, c) {
            (0, c) => 2.0 * c as f64 * z[c],
            (_, 0) => z[39],
            _ => z[0],
        };
        assert_eq!(*v, expected, "entry {r}, {c}");
    }
}

struct Rotor;
impl Dynamics<2, 1, 1> for Rotor {
    fn rate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 1], p: &[S; 1]) -> [S; 2] {
        [x[1] * p[0], u[0] * t]
    }
}
impl PathFunction<2, 1, 1, 1> for Rotor {
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; 2], _u: &[S; 1], _p: &[S; 1]) -> [S; 1] {
        [x[0] + t]
    }
}

#[test]
fn inputs_are_states_controls_parameters_time() {
    let node = dynamics_node(Rotor);
    assert_eq!((node.inputs(), node.outputs()), (5, 2));
    let entries: Vec<_> = node.pattern().jacobian_entries().collect();
    assert_eq!(entries, [(0, 1), (0, 3), (1, 2), (1, 4)]);
    assert_eq!(node.pattern().hessian, [(3, 1), (4, 2)]);
    let path = path_node::<_, 2, 1, 1, 1>(Rotor);
    assert_eq!(path.pattern().columns, [0, 4]);
}

#[test]
fn nan_stays_visible() {
    let node = vector_node(Everything);
    let mut out = [0.0; 6];
    node.value(&[f64::NAN, 0.0, 0.0, 0.0, 0.0], &mut out);
    assert!(out[0].is_nan());
}

/// Operations that formulas of models use beyond [`Everything`]: shifts, powers, quotients and angles of one variable.
struct Compositions;

impl VectorFunction<4, 4> for Compositions {
    fn evaluate<S: Scalar>(&self, z: &[S; 4]) -> [S; 4] {
        let [a, b, c, d] = *z;
        let shifted = a + 2.0;
        [
            shifted * (a - 1.0) * c / (shifted + 0.5) - (-b).exp() * 3.0,
            a.atan2(a + 1.0) + S::from(2.0).atan2(b) + c.atan2(S::from(3.0)) * (S::from(2.0).sqrt() - d),
            (b * c).powi(2).powi(-3) * d.powf(0.0) + (a * b + 4.0).powf(2.5),
            S::from(1.5),
        ]
    }
}

/// Second-order adjoints and hyper-dual numbers agree to rounding.
fn assert_both_agree<E: Seeded>(node: &Node<E>, z: &[f64]) {
    let plan = node.plan.as_ref().expect("a plan");
    let weights: Vec<f64> = (0..E::OUTPUTS).map(|k| 1.5 - 0.7 * k as f64).collect();
    let mut expected = vec![f64::NAN; node.pattern.hessian_len()];
    let mut found = expected.clone();
    node.hessian_in_lanes(z, &weights, &mut expected);
    plan.hessians(1, z, &weights, &mut found);
    let largest = expected.iter().fold(1.0_f64, |m, h| m.max(h.abs()));
    for ((a, b), pair) in found.iter().zip(&expected).zip(&node.pattern.hessian) {
        assert!((a - b).abs() < ROUNDING * largest, "{pair:?}: {a} and {b} at {z:?}");
    }
}

#[test]
fn adjoints_agree_with_hyper_dual_numbers() {
    let (everything, compositions) =
        (Node::new(VectorNode::<_, 5, 6>(Everything)), Node::new(VectorNode::<_, 4, 4>(Compositions)));
    for k in 0..20 {
        let s = f64::from(k) / 20.0;
        assert_both_agree(&everything, &[0.7 - s, 0.4 * s - 0.6, 0.9 + s, 1.3 - 2.0 * s, 2.0]);
        assert_both_agree(&compositions, &[0.3 + s, 0.8 - 0.5 * s, 1.1 + s, 0.6 + s]);
    }
}

/// Known by its values: passes of hyper-dual numbers remain.
#[test]
fn a_closure_has_no_adjoint_plan() {
    struct Opaque;
    impl VectorFunction<1, 1> for Opaque {
        fn evaluate<S: Scalar>(&self, z: &[S; 1]) -> [S; 1] {
            [z[0].map(|x| [x * x * x, 3.0 * x * x, 6.0 * x])]
        }
    }
    let node = Node::new(VectorNode::<_, 1, 1>(Opaque));
    assert!(node.plan.is_none());
    let mut h = [0.0];
    node.hessian(&[2.0], &[0.5], &mut h);
    assert_eq!(h, [6.0]);
}

/// Two outputs with two derivatives each, one parameter: `x = y0 + t`, `u = y0' y1''`, residual `p y1'`.
struct Flat;

impl crate::FlatMap<2, 3, 1, 1, 1, 1> for Flat {
    fn evaluate<S: Scalar>(&self, t: S, y: &[[S; 3]; 2], p: &[S; 1]) -> ([S; 1], [S; 1], [S; 1]) {
        ([y[0][0] + t], [y[0][1] * y[1][2]], [p[0] * y[1][1]])
    }

    fn outputs(&self, t: f64, x: &[f64; 1], _u: &[f64; 1], _p: &[f64; 1]) -> [f64; 2] {
        [x[0] - t, 0.0]
    }
}

#[test]
fn flat_maps_take_outputs_parameters_and_time() {
    let node = crate::flat_node(std::sync::Arc::new(Flat));
    assert_eq!((node.inputs(), node.outputs()), (8, 3));
    let mut out = [0.0; 3];
    node.value(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0], &mut out);
    assert_eq!(out, [1.0 + 8.0, 2.0 * 6.0, 7.0 * 5.0]);
    let entries: Vec<_> = node.pattern().jacobian_entries().collect();
    assert_eq!(entries, [(0, 0), (0, 7), (1, 1), (1, 5), (2, 4), (2, 6)]);
    assert_eq!(node.pattern().hessian, [(5, 1), (6, 4)]);
}
