use proptest::prelude::*;

use super::*;

/// A few operations on numbers of order one.
const ROUNDING: f64 = 4e-15;
/// The same for derivatives, relative to their largest value.
const DERIVATIVE: f64 = 2e-12;

fn close(actual: f64, expected: f64, tolerance: f64) {
    assert!((actual - expected).abs() <= tolerance, "{actual} is not {expected} within {tolerance}");
}

fn value(basis: &Bspline, c: &[f64], derivative: usize, x: f64) -> f64 {
    let mut out = [0.0];
    basis.evaluate(c, derivative, x, &mut out);
    out[0]
}

/// Bases with simple, multiple and not clamped knots, and with a jump.
fn bases() -> Vec<Bspline> {
    vec![
        Bspline::clamped_uniform(1, 4).unwrap(),
        Bspline::clamped_uniform(2, 3).unwrap(),
        Bspline::clamped_uniform(6, 10).unwrap(),
        Bspline::clamped(4, &[0.0, 0.2, 0.5, 0.6, 1.0], &[1, 3, 4]).unwrap(),
        Bspline::new(4, vec![-3.0, -2.0, -1.0, 0.0, 0.7, 1.0, 1.0, 2.0, 3.5, 4.0]).unwrap(),
        Bspline::clamped(12, &[0.0, 0.3, 1.0], &[10]).unwrap(),
    ]
}

fn points(basis: &Bspline) -> Vec<f64> {
    let (a, b) = basis.interval();
    let mut points: Vec<f64> = (0..=57).map(|j| a + (b - a) * f64::from(j) / 57.0).collect();
    points.extend(basis.breaks());
    points
}

/// Closed forms of the uniform quadratic and cubic B-spline (de Boor 2001, chapter X, example 1).
#[test]
fn cardinal_splines() {
    let quadratic = Bspline::new(3, (-2..=3).map(f64::from).collect()).unwrap();
    let mut out = [0.0; 9];
    for x in [0.0, 0.25, 0.5, 0.9] {
        assert_eq!(quadratic.derivatives(x, &mut out), 0);
        let expected = [0.5 * (1.0 - x) * (1.0 - x), 0.5 + x - x * x, 0.5 * x * x];
        let slopes = [x - 1.0, 1.0 - 2.0 * x, x];
        for j in 0..3 {
            close(out[j], expected[j], ROUNDING);
            close(out[3 + j], slopes[j], ROUNDING);
            close(out[6 + j], [1.0, -2.0, 1.0][j], ROUNDING);
        }
    }
    let cubic = Bspline::new(4, (-3..=4).map(f64::from).collect()).unwrap();
    let mut out = [0.0; 4];
    cubic.values(0.0, &mut out);
    for (v, e) in out.iter().zip([1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0, 0.0]) {
        close(*v, e, ROUNDING);
    }
}

/// Without inner knots the basis is that of Bernstein: `C(3, j) x^j (1 - x)^(3 - j)`.
#[test]
fn bernstein() {
    let basis = Bspline::clamped_uniform(4, 1).unwrap();
    let mut out = [0.0; 4];
    for x in [0.0, 0.3, 1.0] {
        basis.values(x, &mut out);
        let y = 1.0 - x;
        for (v, e) in out.iter().zip([y * y * y, 3.0 * x * y * y, 3.0 * x * x * y, x * x * x]) {
            close(*v, e, ROUNDING);
        }
    }
}

#[test]
fn partition_of_unity_and_its_derivatives() {
    for basis in bases() {
        let k = basis.order();
        let mut out = vec![0.0; 4 * k];
        for x in points(&basis) {
            let first = basis.derivatives(x, &mut out);
            assert!(first + k <= basis.len());
            assert!(out[..k].iter().all(|v| *v >= -ROUNDING), "{x}: {out:?}");
            close(out[..k].iter().sum(), 1.0, ROUNDING);
            for row in out[k..].chunks(k) {
                let largest = row.iter().fold(1.0_f64, |a, v| a.max(v.abs()));
                close(row.iter().sum(), 0.0, DERIVATIVE * largest);
            }
        }
    }
}

/// Marsden: `(y - x)^(k-1) = sum_j psi_j(y) B_j(x)`, `psi_j(y) = prod_{r=1}^{k-1} (y - t_{j+r})`, for any `y`
/// (de Boor 2001, chapter IX, eq. 14).
#[test]
fn marsden_identity() {
    for basis in bases() {
        let degree = basis.order() - 1;
        for y in [-0.7, 0.4, 1.9] {
            let psi = |j: usize| basis.knots()[j + 1..=j + degree].iter().map(|t| y - t).product::<f64>();
            let c: Vec<f64> = (0..basis.len()).map(psi).collect();
            let size = c.iter().fold(1.0_f64, |a, v| a.max(v.abs()));
            for x in points(&basis) {
                close(value(&basis, &c, 0, x), (y - x).powi(degree as i32), 4.0 * ROUNDING * size);
            }
        }
    }
}

/// Coefficients from the Greville abscissae give the identity function; derivatives of Marsden's identity are closed forms.
#[test]
fn derivatives_against_closed_forms() {
    for basis in bases().into_iter().filter(|b| b.order() > 1) {
        let greville = basis.greville().unwrap();
        let degree = basis.order() - 1;
        let y = 1.3;
        let psi: Vec<f64> = (0..basis.len())
            .map(|j| basis.knots()[j + 1..=j + degree].iter().map(|t| y - t).product())
            .collect();
        for x in points(&basis) {
            let size = x.abs().max(1.0);
            close(value(&basis, &greville, 0, x), x, 4.0 * ROUNDING * size);
            close(value(&basis, &greville, 1, x), 1.0, 25.0 * ROUNDING);
            close(value(&basis, &greville, 2, x), 0.0, 25000.0 * ROUNDING);
            let mut factor = 1.0;
            for d in 0..=degree.min(4) {
                let expected = factor * (y - x).powi((degree - d) as i32);
                let scale = 5.0_f64.powi(degree as i32) * 40.0_f64.powi(d as i32);
                close(value(&basis, &psi, d, x), expected, ROUNDING * scale);
                factor *= -((degree - d) as f64);
            }
            assert_eq!(value(&basis, &psi, degree + 1, x), 0.0);
        }
    }
}

/// Rows of basis derivatives and de Boor's algorithm on coefficients are two ways to one number.
#[test]
fn rows_agree_with_the_algorithm_on_coefficients() {
    for basis in bases() {
        let (k, n) = (basis.order(), basis.len());
        let c: Vec<f64> = (0..2 * n).map(|j| (1.7 * j as f64).sin()).collect();
        let mut rows = vec![0.0; 3 * k];
        for x in points(&basis) {
            let first = basis.derivatives(x, &mut rows);
            for d in 0..3 {
                let mut out = [0.0; 2];
                basis.evaluate(&c, d, x, &mut out);
                for component in 0..2 {
                    let row = &rows[d * k..(d + 1) * k];
                    let sum: f64 =
                        row.iter().enumerate().map(|(j, b)| b * c[(first + j) * 2 + component]).sum();
                    let size = row.iter().fold(1.0_f64, |a, v| a.max(v.abs()));
                    close(sum, out[component], DERIVATIVE * size);
                }
            }
        }
    }
}

/// At a knot of multiplicity `m` derivatives up to `k - 1 - m` are continuous and the next one is not.
#[test]
fn continuity_per_knot() {
    let breaks = [0.0, 0.2, 0.5, 0.6, 1.0];
    let basis = Bspline::clamped(4, &breaks, &[1, 3, 4]).unwrap();
    let c: Vec<f64> = (0..basis.len()).map(|j| (2.3 * j as f64).cos()).collect();
    for (x, multiplicity) in [(0.2, 1), (0.5, 3), (0.6, 4)] {
        assert_eq!(basis.multiplicity(x), multiplicity);
        let right = basis.span(x);
        let left = right - multiplicity;
        for d in 0..4 {
            let side = |span| {
                let mut out = [0.0];
                basis.evaluate_in(span, &c, d, x, &mut out);
                out[0]
            };
            let jump = (side(right) - side(left)).abs();
            assert_eq!(jump > 1e-6, d + multiplicity >= 4, "derivative {d} at {x} jumps by {jump}");
        }
    }
}

#[test]
fn ends_of_clamped_splines_are_coefficients() {
    let basis = Bspline::clamped_uniform(6, 10).unwrap();
    assert_eq!(basis.len(), 15);
    let c: Vec<f64> = (0..15).map(f64::from).collect();
    assert_eq!(value(&basis, &c, 0, 0.0), 0.0);
    assert_eq!(value(&basis, &c, 0, 1.0), 14.0);
    // First derivative at the start: degree times the difference over the first knot interval.
    close(value(&basis, &c, 1, 0.0), 5.0 / 0.1, 250.0 * ROUNDING);
    let greville = basis.greville().unwrap();
    assert_eq!((greville[0], greville[14]), (0.0, 1.0));
    close(greville[1], 0.02, ROUNDING);
}

#[test]
fn insertion_and_elevation_leave_the_curve() {
    for basis in bases() {
        let c: Vec<f64> = (0..2 * basis.len()).map(|j| (1.1 * j as f64).sin()).collect();
        let (start, end) = basis.interval();
        let inner = basis.breaks()[1];
        let mut finer = (basis.clone(), c.clone());
        for x in [start + 0.41 * (end - start), start + 0.77 * (end - start), inner] {
            if finer.0.multiplicity(x) < basis.order() {
                finer = finer.0.insert_knot(x, &finer.1).unwrap();
            }
        }
        let elevated = basis.elevate(&c).unwrap();
        let twice = elevated.0.elevate(&elevated.1).unwrap();
        let both = finer.0.elevate(&finer.1).unwrap();
        for (other, coefficients) in [&finer, &elevated, &twice, &both] {
            assert_eq!(coefficients.len(), 2 * other.len());
            for x in points(&basis) {
                let (mut before, mut after) = ([0.0; 2], [0.0; 2]);
                for d in 0..basis.order().min(3) {
                    basis.evaluate(&c, d, x, &mut before);
                    other.evaluate(coefficients, d, x, &mut after);
                    let size = 60.0_f64.powi(d as i32);
                    close(after[0], before[0], 4.0 * ROUNDING * size);
                    close(after[1], before[1], 4.0 * ROUNDING * size);
                }
            }
        }
        assert_eq!(elevated.0.order(), basis.order() + 1);
    }
}

#[test]
fn elevation_keeps_continuity() {
    let basis = Bspline::clamped(4, &[0.0, 0.2, 0.5, 0.6, 1.0], &[1, 3, 4]).unwrap();
    let (elevated, _) = basis.elevate(&vec![0.0; basis.len()]).unwrap();
    let multiplicities = [0.0, 0.2, 0.5, 0.6, 1.0].map(|x| elevated.multiplicity(x));
    assert_eq!(multiplicities, [5, 2, 4, 5, 5]);
}

#[test]
fn bad_requests_are_named_with_the_allowed_range() {
    let message = |e: Result<Bspline, BasisError>| e.unwrap_err().to_string();
    let uniform = |order, segments| message(Bspline::clamped_uniform(order, segments));
    assert_eq!(uniform(0, 3), "B-splines: order 0 requested, 1 to 32 are allowed");
    assert_eq!(uniform(33, 3), "B-splines: order 33 requested, 1 to 32 are allowed");
    assert!(matches!(Bspline::clamped_uniform(4, 0), Err(BasisError::KnotCount { min: 8, .. })));
    assert!(matches!(
        Bspline::clamped(4, &[0.0, 0.5, 1.0], &[]),
        Err(BasisError::KnotCount { knots: 8, min: 9, .. })
    ));
    assert_eq!(
        message(Bspline::clamped(4, &[0.0, 0.5, 1.0], &[5])),
        "B-splines: knot 0.5 has multiplicity 5, 1 to 4 (the order) are allowed"
    );
    assert!(matches!(
        Bspline::clamped(4, &[0.0, 0.5, 1.0], &[0]),
        Err(BasisError::Multiplicity { multiplicity: 0, .. })
    ));
    for breaks in [[0.0, f64::NAN, 1.0], [0.0, 0.5, f64::INFINITY], [0.0, -0.5, 1.0], [0.0, 0.0, 1.0]] {
        assert!(matches!(Bspline::clamped(2, &breaks, &[1]), Err(BasisError::Knot { .. })), "{breaks:?}");
    }
    assert!(matches!(Bspline::new(3, vec![0.0; 5]), Err(BasisError::KnotCount { min: 6, .. })));
    assert!(matches!(Bspline::new(3, vec![0.0; 6]), Err(BasisError::Multiplicity { .. })));
    let empty = Bspline::new(2, vec![0.0, 1.0, 1.0, 2.0]);
    assert!(matches!(empty, Err(BasisError::Knot { index: 2, .. })));
    assert!(matches!(Bspline::clamped(3, &[0.0], &[]), Err(BasisError::KnotCount { knots: 3, min: 6, .. })));
    let basis = Bspline::clamped_uniform(3, 2).unwrap();
    let c = vec![0.0; basis.len()];
    assert!(matches!(basis.insert_knot(1.5, &c), Err(BasisError::Knot { .. })));
    assert!(matches!(basis.insert_knot(f64::NAN, &c), Err(BasisError::Knot { .. })));
    assert!(matches!(basis.insert_knot(0.0, &c), Err(BasisError::Multiplicity { multiplicity: 4, .. })));
    assert!(matches!(basis.insert_knot(0.5, &c[1..]), Err(BasisError::CoefficientCount { rows: 4, .. })));
    assert!(matches!(
        Bspline::clamped_uniform(1, 2).unwrap().greville(),
        Err(BasisError::SplineOrder { order: 1, min: 2, .. })
    ));
    let highest = Bspline::clamped_uniform(MAX_ORDER, 1).unwrap();
    assert!(matches!(highest.elevate(&[0.0; MAX_ORDER]), Err(BasisError::SplineOrder { order: 33, .. })));
}

#[test]
fn outside_and_not_a_number() {
    let basis = Bspline::clamped_uniform(3, 2).unwrap();
    let greville = basis.greville().unwrap();
    close(value(&basis, &greville, 0, 1.5), 1.5, ROUNDING);
    close(value(&basis, &greville, 0, -0.5), -0.5, ROUNDING);
    assert!(value(&basis, &greville, 0, f64::NAN).is_nan());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// A spline lies between its least and largest coefficient, and insertion anywhere keeps it.
    #[test]
    fn convex_hull_and_insertion(
        order in 2_usize..9,
        c in proptest::collection::vec(-1.0..1.0_f64, 14),
        x in 0.0..1.0_f64,
        knot in 0.001..0.999_f64,
    ) {
        let basis = Bspline::clamped_uniform(order, 15 - order).unwrap();
        let v = value(&basis, &c, 0, x);
        let (least, most) = c.iter().fold((1.0_f64, -1.0_f64), |(a, b), v| (a.min(*v), b.max(*v)));
        prop_assert!(least - ROUNDING <= v && v <= most + ROUNDING);
        let (finer, refined) = basis.insert_knot(knot, &c).unwrap();
        prop_assert!((value(&finer, &refined, 0, x) - v).abs() <= ROUNDING);
    }
}
