use super::*;
use crate::{VectorFunction, vector, vector_node};
use proptest::prelude::*;

/// Every operator and function of [`Scalar`] once.
struct Everything;

impl VectorFunction<4, 7> for Everything {
    fn evaluate<S: Scalar>(&self, z: &[S; 4]) -> [S; 7] {
        let [a, b, c, d] = *z;
        let (s, k) = (a * b).sin_cos();
        let mut e = a;
        e += b;
        e -= c;
        e *= d;
        e /= a.cosh();
        [
            a * 2.0 - b / 4.0 + 1.0 - 0.3,
            s * c.exp() + k / (c.square() + 2.0),
            (a + 3.0).ln() * (b - 0.5).atan() - d.tanh(),
            d.atan2(c + 2.0) + (a * 0.1).asin() - (b * 0.1).acos(),
            (c + 4.0).sqrt().powi(-3) + (d + 5.0).powf(1.7) + (-a.sinh() - b.cosh()) * c.tan() + d.powi(1),
            vector::norm(&[a, b, c], 1e-3) + vector::dot(&[a, b], &[c, d]) - (d + 3.0).recip() + a.powi(0),
            e,
        ]
    }
}

proptest! {
    #[test]
    fn formulas_have_the_values_of_the_model(z in prop::array::uniform4(-2.0..2.0)) {
        let node = vector_node(Everything);
        let mut expected = [0.0; 7];
        node.value(&z, &mut expected);
        prop_assert_eq!(node.formula().unwrap().evaluate(&z), expected);
    }
}

struct Repeated;
impl VectorFunction<2, 3> for Repeated {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 3] {
        let _unused = z[0].exp() * 7.0;
        [(z[0] * z[1]).sin(), (z[0] * z[1]).sin() * 2.0, z[1]]
    }
}

#[test]
fn operations_are_written_once_and_reach_an_output() {
    let formula = vector_node(Repeated).formula().unwrap();
    let expected = [
        Operation::Binary(Binary::Mul, 0, 1),
        Operation::Unary(Unary::Sin, 2),
        Operation::Constant(2.0),
        Operation::Binary(Binary::Mul, 3, 4),
    ];
    assert_eq!(formula.operations(), expected);
    assert_eq!((formula.inputs(), formula.outputs()), (2, &[3, 5, 1][..]));
}

#[test]
fn json_has_powers_and_numbers_that_are_not_finite() {
    struct Limits;
    impl VectorFunction<1, 2> for Limits {
        fn evaluate<S: Scalar>(&self, z: &[S; 1]) -> [S; 2] {
            [z[0].powf(1.5) - f64::INFINITY, z[0].powi(-2) * 1e-300]
        }
    }
    let json = vector_node(Limits).formula().unwrap().to_json();
    let operations =
        r#"["powf",0,1.5],["constant","-inf"],["add",1,2],["powi",0,-2],["constant",1e-300],["mul",4,5]"#;
    assert_eq!(json, format!(r#"{{"inputs":1,"operations":[{operations}],"outputs":[3,6]}}"#));
}

#[test]
fn closures_are_named() {
    struct Table;
    impl VectorFunction<1, 1> for Table {
        fn evaluate<S: Scalar>(&self, z: &[S; 1]) -> [S; 1] {
            [z[0].map(|x| [x.cbrt(), 0.0, 0.0])]
        }
    }
    let error = vector_node(Table).formula().unwrap_err();
    assert!(error.name.contains("trace::tests::closures_are_named"), "{error}");
}

#[test]
fn a_model_may_record_another_one() {
    struct Outer;
    impl VectorFunction<1, 1> for Outer {
        fn evaluate<S: Scalar>(&self, z: &[S; 1]) -> [S; 1] {
            let twice = z[0] * 2.0;
            let inner = vector_node(Repeated).formula().unwrap();
            [twice + inner.operations().len() as f64]
        }
    }
    assert_eq!(vector_node(Outer).formula().unwrap().evaluate(&[3.0]), [10.0]);
}
