use proptest::prelude::*;

use crate::*;

/// Rounding of a few operations on numbers of order one.
const ROUNDING: f64 = 4e-16;
/// Published values, compared in double precision.
const PUBLISHED: f64 = 5e-16;
/// Sums of up to 60 rounded products.
const SUM: f64 = 5e-15;

fn close(actual: f64, expected: f64, tolerance: f64) {
    assert!((actual - expected).abs() <= tolerance, "{actual} is not {expected} within {tolerance}");
}

fn pairs(nodes: &[f64], weights: &[f64], table: &[(f64, f64)]) {
    assert_eq!(nodes.len(), table.len());
    for (k, &(x, w)) in table.iter().enumerate() {
        close(nodes[k], x, PUBLISHED);
        close(weights[k], w, PUBLISHED);
    }
}

/// Closed forms to 3 points; roots of `P_{N-1} + P_N` in 40 digits for more, the six printed digits of which agree
/// with the table in Weisstein, *CRC Concise Encyclopedia of Mathematics*, "Radau Quadrature".
#[test]
fn radau_published_values() {
    let s = 6f64.sqrt();
    let tables: [&[(f64, f64)]; 5] = [
        &[(-1.0, 2.0)],
        &[(-1.0, 0.5), (1.0 / 3.0, 1.5)],
        &[(-1.0, 2.0 / 9.0), ((1.0 - s) / 5.0, (16.0 + s) / 18.0), ((1.0 + s) / 5.0, (16.0 - s) / 18.0)],
        &[
            (-1.0, 0.125),
            (-0.57531892352169411205, 0.65768863996011948789),
            (0.18106627111853057827, 0.77638693768634376156),
            (0.82282408097459210521, 0.44092442235353675055),
        ],
        &[
            (-1.0, 0.08),
            (-0.7204802713124388957, 0.44620780216714148881),
            (-0.16718086473783364011, 0.62365304595148250816),
            (0.44631397272375234464, 0.56271203029892412038),
            (0.88579160777096463561, 0.28742712158245188265),
        ],
    ];
    for (n, table) in tables.iter().enumerate() {
        let lgr = Lgr::new(n + 1).unwrap();
        pairs(lgr.nodes(), lgr.weights(), table);
    }
    // 40-digit Newton on P_59 + P_60.
    let lgr = Lgr::new(60).unwrap();
    for (j, x, w) in [
        (1, -0.99796153035690930961, 0.003422479775948973633),
        (30, 0.013020607226506101008, 0.052357209634869060077),
        (59, 0.9991968500672738376, 0.0020608661569639098044),
    ] {
        close(lgr.nodes()[j], x, PUBLISHED);
        close(lgr.weights()[j], w, PUBLISHED);
    }
}

/// x^3 = 3/5 P1 + 2/5 P3 and x^4 = 1/5 P0 + 4/7 P2 + 8/35 P4.
#[test]
fn legendre_coefficients_of_powers() {
    let rule = Gauss::new(6).unwrap();
    let of = |power: i32| {
        rule.legendre_coefficients(&rule.nodes().iter().map(|x| x.powi(power)).collect::<Vec<_>>())
    };
    let cubic = [0.0, 0.6, 0.0, 0.4, 0.0, 0.0];
    let quartic = [0.2, 0.0, 4.0 / 7.0, 0.0, 8.0 / 35.0, 0.0];
    for (found, exact) in [(of(3), cubic), (of(4), quartic)] {
        found.iter().zip(exact).for_each(|(c, e)| close(*c, e, SUM));
    }
}

/// Abramowitz and Stegun, table 25.4.
#[test]
fn gauss_published_values() {
    let five = [
        (-0.9061798459386639928, 0.23692688505618908751),
        (-0.53846931010568309104, 0.47862867049936646804),
        (0.0, 128.0 / 225.0),
        (0.53846931010568309104, 0.47862867049936646804),
        (0.9061798459386639928, 0.23692688505618908751),
    ];
    let gauss = Gauss::new(5).unwrap();
    pairs(gauss.nodes(), gauss.weights(), &five);
    let gauss = Gauss::new(60).unwrap();
    close(gauss.nodes()[0], -0.99921012322743602203, PUBLISHED);
    close(gauss.weights()[0], 0.0020268119688737584964, PUBLISHED);
    close(gauss.nodes()[30], 0.025959772301247798589, PUBLISHED);
    close(gauss.weights()[30], 0.051907877631220639733, PUBLISHED);
}

/// Abramowitz and Stegun, table 25.6.
#[test]
fn lobatto_published_values() {
    let x = (3.0 / 7.0f64).sqrt();
    let five = [(-1.0, 0.1), (-x, 49.0 / 90.0), (0.0, 32.0 / 45.0), (x, 49.0 / 90.0), (1.0, 0.1)];
    let lobatto = Lobatto::new(5).unwrap();
    pairs(lobatto.nodes(), lobatto.weights(), &five);
    let lobatto = Lobatto::new(60).unwrap();
    close(lobatto.nodes()[1], -0.99792699191581099573, PUBLISHED);
    close(lobatto.weights()[1], 0.003480447968153144995, PUBLISHED);
    close(lobatto.nodes()[30], 0.026399667900479246653, PUBLISHED);
    close(lobatto.weights()[30], 0.052787068946106931708, PUBLISHED);
}

/// One rule seen without its type, so that the invariants are checked once.
struct Rule {
    nodes: Vec<f64>,
    weights: Vec<f64>,
    support: Vec<f64>,
    differentiation: Vec<f64>,
    integration: Vec<f64>,
    /// Abscissae of the rows of the integration matrix.
    targets: Vec<f64>,
    /// Degree of exactness of the quadrature.
    degree: usize,
}

fn rules() -> Vec<Rule> {
    let mut rules = Vec::new();
    for n in 1..=MAX_POINTS {
        let lgr = Lgr::new(n).unwrap();
        rules.push(Rule {
            nodes: lgr.nodes().to_vec(),
            weights: lgr.weights().to_vec(),
            support: lgr.support().to_vec(),
            differentiation: lgr.differentiation().to_vec(),
            integration: lgr.integration().to_vec(),
            targets: lgr.support()[1..].to_vec(),
            degree: 2 * n - 2,
        });
        let gauss = Gauss::new(n).unwrap();
        rules.push(Rule {
            nodes: gauss.nodes().to_vec(),
            weights: gauss.weights().to_vec(),
            support: gauss.support().to_vec(),
            differentiation: gauss.differentiation().to_vec(),
            integration: gauss.integration().to_vec(),
            targets: gauss.nodes().to_vec(),
            degree: 2 * n - 1,
        });
        if n >= 2 {
            let lobatto = Lobatto::new(n).unwrap();
            rules.push(Rule {
                nodes: lobatto.nodes().to_vec(),
                weights: lobatto.weights().to_vec(),
                support: lobatto.support().to_vec(),
                differentiation: lobatto.differentiation().to_vec(),
                integration: lobatto.integration().to_vec(),
                targets: lobatto.nodes()[1..].to_vec(),
                degree: 2 * n - 3,
            });
        }
    }
    rules
}

#[test]
fn nodes_ascend_and_weights_are_positive_of_sum_two() {
    for rule in rules() {
        assert!(rule.support.windows(2).all(|p| p[0] < p[1]));
        assert!(rule.support[0] == -1.0 && *rule.support.last().unwrap() <= 1.0);
        assert!(rule.weights.iter().all(|&w| w > 0.0));
        close(rule.weights.iter().sum(), 2.0, SUM);
    }
}

#[test]
fn quadrature_is_exact_to_its_degree() {
    for rule in rules() {
        for degree in 0..=rule.degree {
            let sum: f64 =
                rule.nodes.iter().zip(&rule.weights).map(|(x, w)| w * legendre(degree, *x).0).sum();
            close(sum, if degree == 0 { 2.0 } else { 0.0 }, SUM);
        }
        // One degree further it is not exact.
        let next = rule.degree + 1;
        let sum: f64 = rule.nodes.iter().zip(&rule.weights).map(|(x, w)| w * legendre(next, *x).0).sum();
        assert!(sum.abs() > 1e-3, "degree {next} on {} points: {sum}", rule.nodes.len());
    }
}

#[test]
fn differentiation_is_exact_to_the_degree_of_the_support() {
    // Values and slopes in twice the working precision: what is measured is the matrix.
    let exact_value = |degree: usize, x: f64| match degree {
        0 => 1.0,
        n => crate::legendre::legendre_double(n, x).1.value(),
    };
    for rule in rules() {
        let m = rule.support.len();
        for degree in 0..m {
            let values: Vec<f64> = rule.support.iter().map(|s| exact_value(degree, *s)).collect();
            for (row, &x) in rule.differentiation.chunks(m).zip(&rule.nodes) {
                let slope: f64 = row.iter().zip(&values).map(|(d, v)| d * v).sum();
                // P_n' = sum of (2 k + 1) P_k over k = n - 1, n - 3, ..
                let exact: f64 =
                    (0..degree).rev().step_by(2).map(|k| (2 * k + 1) as f64 * exact_value(k, x)).sum();
                // An entry of D is a product of m factors, the diagonal a sum of m entries.
                let size: f64 = row.iter().map(|d| d.abs()).sum();
                close(slope, exact, f64::EPSILON * m as f64 * size.max(1.0));
            }
        }
    }
}

#[test]
fn integration_is_exact_to_the_degree_of_the_rate() {
    for rule in rules() {
        let n = rule.nodes.len();
        for degree in 0..n {
            let values: Vec<f64> = rule.nodes.iter().map(|x| legendre(degree, *x).0).collect();
            for (row, &t) in rule.integration.chunks(n).zip(&rule.targets) {
                let sum: f64 = row.iter().zip(&values).map(|(a, v)| a * v).sum();
                let exact = if degree == 0 {
                    t + 1.0
                } else {
                    (legendre(degree + 1, t).0 - legendre(degree - 1, t).0) / (2 * degree + 1) as f64
                };
                close(sum, exact, SUM);
            }
        }
    }
}

#[test]
fn radau_integration_is_the_inverse_of_the_last_columns() {
    for n in [1, 2, 5, 13, 30, 60] {
        let lgr = Lgr::new(n).unwrap();
        let d = nalgebra::DMatrix::from_row_slice(n, n + 1, lgr.differentiation());
        let a = nalgebra::DMatrix::from_row_slice(n, n, lgr.integration());
        let inverse = d.columns(1, n).into_owned().try_inverse().unwrap();
        assert!((&a - inverse).amax() < 2500.0 * ROUNDING, "N = {n}");
        for j in 0..n {
            close(a[(n - 1, j)], lgr.weights()[j], 2.5 * ROUNDING);
        }
    }
}

/// Golub and Welsch (1969): the Gauss nodes are eigenvalues of the Jacobi matrix.
#[test]
fn gauss_nodes_are_the_eigenvalues_of_the_jacobi_matrix() {
    let n = 40;
    let matrix = nalgebra::DMatrix::from_fn(n, n, |i, j| {
        let k = i.max(j) as f64;
        if i.abs_diff(j) == 1 { k / (4.0 * k * k - 1.0).sqrt() } else { 0.0 }
    });
    let mut eigenvalues: Vec<f64> = matrix.symmetric_eigenvalues().iter().copied().collect();
    eigenvalues.sort_by(f64::total_cmp);
    for (e, x) in eigenvalues.iter().zip(Gauss::new(n).unwrap().nodes()) {
        close(*e, *x, 25.0 * ROUNDING);
    }
}

#[test]
fn legendre_values() {
    // P_4 = (35 x^4 - 30 x^2 + 3) / 8 and P_4' = (140 x^3 - 60 x) / 8.
    let x: f64 = 0.3;
    let (p, d) = legendre(4, x);
    close(p, (35.0 * x.powi(4) - 30.0 * x * x + 3.0) / 8.0, ROUNDING);
    close(d, (140.0 * x.powi(3) - 60.0 * x) / 8.0, 4.0 * ROUNDING);
    for n in 0..=120 {
        let half = (n * (n + 1)) as f64 / 2.0;
        assert_eq!(legendre(n, 1.0), (1.0, half));
        let sign = if n % 2 == 0 { 1.0 } else { -1.0 };
        assert_eq!(legendre(n, -1.0), (sign, -sign * half));
    }
    assert!(legendre(3, f64::NAN).0.is_nan());
}

#[test]
fn chebyshev_points_and_clenshaw_curtis() {
    // Clenshaw-Curtis of three points is Simpson's rule; of five: 1/15, 8/15, 4/5, 8/15, 1/15.
    let (x, w) = clenshaw_curtis(3).unwrap();
    pairs(&x, &w, &[(-1.0, 1.0 / 3.0), (0.0, 4.0 / 3.0), (1.0, 1.0 / 3.0)]);
    let (x, w) = clenshaw_curtis(5).unwrap();
    let r = 0.5f64.sqrt();
    let (a, b) = (1.0 / 15.0, 8.0 / 15.0);
    pairs(&x, &w, &[(-1.0, a), (-r, b), (0.0, 0.8), (r, b), (1.0, a)]);
    for n in 2..70 {
        let (x, w) = clenshaw_curtis(n).unwrap();
        assert!(x.windows(2).all(|p| p[0] < p[1]) && w.iter().all(|&w| w > 0.0));
        for degree in 0..n {
            let sum: f64 = x.iter().zip(&w).map(|(x, w)| w * legendre(degree, *x).0).sum();
            close(sum, if degree == 0 { 2.0 } else { 0.0 }, SUM);
        }
    }
    assert!(matches!(chebyshev_lobatto(1), Err(BasisError::PointCount { points: 1, min: 2, .. })));
    assert!(clenshaw_curtis(0).is_err() && clenshaw_curtis(4097).is_err());
}

/// Runge's function through Radau support points: the error falls like rho^-N, rho = (1 + sqrt 26) / 5.
#[test]
fn interpolation_of_runge_converges_geometrically() {
    let f = |x: f64| 1.0 / (1.0 + 25.0 * x * x);
    let slope = |x: f64| -50.0 * x / (1.0 + 25.0 * x * x).powi(2);
    let errors = |n: usize| {
        let lgr = Lgr::new(n).unwrap();
        let basis = lgr.support_basis();
        let values: Vec<f64> = basis.nodes().iter().flat_map(|&x| [f(x), 3.0]).collect();
        let (mut worst, mut worst_slope) = (0.0f64, 0.0f64);
        let (mut out, mut derivative) = ([0.0; 2], [0.0; 2]);
        for k in 0..=500 {
            let x = -1.0 + k as f64 / 250.0;
            basis.evaluate_all(&values, x, &mut out);
            assert_eq!(out[0], basis.evaluate(&values, 2, 0, x));
            close(out[1], 3.0, 25.0 * ROUNDING);
            basis.derivative_all(&values, x, &mut derivative);
            close(derivative[1], 0.0, 250000.0 * ROUNDING);
            worst = worst.max((out[0] - f(x)).abs());
            worst_slope = worst_slope.max((derivative[0] - slope(x)).abs());
        }
        (worst, worst_slope)
    };
    let rho = (1.0 + 26f64.sqrt()) / 5.0;
    for n in [20, 40, 60] {
        let (value, slope) = errors(n);
        assert!(value < 8.0 * rho.powi(-(n as i32)), "N = {n}: {value}");
        assert!(slope < 8.0 * (n * n) as f64 * rho.powi(-(n as i32)), "N = {n}: {slope}");
    }
}

#[test]
fn any_number_of_components_is_interpolated_as_each_alone() {
    let basis = Barycentric::new(&[-1.0, -0.4, 0.1, 0.7, 1.0]).unwrap();
    for count in 1..=10 {
        let values: Vec<f64> = (0..5 * count).map(|k| (0.7 * k as f64).sin()).collect();
        let mut out = vec![0.0; count];
        for x in [-1.0, -0.9, 0.1, 0.33, 1.0, 1.2] {
            basis.evaluate_all(&values, x, &mut out);
            for (c, found) in out.iter().enumerate() {
                assert_eq!(*found, basis.evaluate(&values, count, c, x), "{count} components at {x}");
            }
        }
    }
}

#[test]
fn interpolation_is_exact_at_nodes_and_smooth_beside_them() {
    let lgr = Lgr::new(24).unwrap();
    let basis = lgr.support_basis();
    let values: Vec<f64> = basis.nodes().iter().map(|x| (2.0 * x).sin()).collect();
    let matrix = basis.differentiation_matrix();
    let mut slope = [0.0];
    for (k, &x) in basis.nodes().iter().enumerate() {
        assert_eq!(basis.evaluate(&values, 1, 0, x), values[k]);
        basis.derivative_all(&values, x, &mut slope);
        let row: f64 = matrix[k * 25..(k + 1) * 25].iter().zip(&values).map(|(d, v)| d * v).sum();
        close(slope[0], row, 2500.0 * ROUNDING);
        for shift in [1e-15, 1e-12, 1e-9, 1e-6, 1e-3] {
            close(basis.evaluate(&values, 1, 0, x + shift), (2.0 * (x + shift)).sin(), 250.0 * ROUNDING);
            basis.derivative_all(&values, x + shift, &mut slope);
            close(slope[0], 2.0 * (2.0 * (x + shift)).cos(), 50000.0 * ROUNDING);
        }
    }
    // Far from zero and of another unit.
    let nodes: Vec<f64> = basis.nodes().iter().map(|x| 1e6 + 500.0 * x).collect();
    let scaled = Barycentric::new(&nodes).unwrap();
    close(scaled.evaluate(&values, 1, 0, 1e6 + 125.0), 0.5f64.sin(), 250.0 * ROUNDING);
}

#[test]
fn small_and_large_sets_of_nodes() {
    let one = Barycentric::new(&[2.0]).unwrap();
    let mut out = [f64::NAN];
    close(one.evaluate(&[7.0], 1, 0, 5.0), 7.0, 8.0 * ROUNDING);
    one.derivative_all(&[7.0], 5.0, &mut out);
    assert_eq!(out, [0.0]);
    assert_eq!(one.differentiation_matrix(), [0.0]);
    let two = Barycentric::new(&[0.0, 2.0]).unwrap();
    two.derivative_all(&[1.0, 5.0], 0.7, &mut out);
    close(out[0], 2.0, ROUNDING);
    // A thousand nodes on a wide range neither overflow nor underflow.
    let nodes: Vec<f64> = chebyshev_lobatto(1000).unwrap().iter().map(|x| 1e8 * x).collect();
    let many = Barycentric::new(&nodes).unwrap();
    let values: Vec<f64> = nodes.iter().map(|x| (3e-7 * x).cos()).collect();
    close(many.evaluate(&values, 1, 0, 1.234e7), 3.702f64.cos(), 25000.0 * ROUNDING);
    assert!(many.weights().iter().all(|w| w.is_finite() && *w != 0.0));
}

#[test]
fn ill_posed_requests_are_refused() {
    assert_eq!(
        Lgr::new(0).unwrap_err(),
        BasisError::PointCount { rule: "Legendre-Gauss-Radau", points: 0, min: 1, max: 60 }
    );
    assert!(Lgr::new(61).unwrap_err().to_string().contains("61 points requested, 1 to 60 are allowed"));
    assert!(Gauss::new(0).is_err() && Gauss::new(61).is_err());
    assert!(Lobatto::new(1).is_err() && Lobatto::new(61).is_err() && Lobatto::new(usize::MAX).is_err());
    assert_eq!(Barycentric::new(&[]), Err(BasisError::NoNodes));
    assert_eq!(
        Barycentric::new(&[1.0, 0.0, 1.0]),
        Err(BasisError::Coincident { first: 0, second: 2, value: 1.0 })
    );
    assert!(matches!(Barycentric::new(&[0.0, f64::NAN]), Err(BasisError::NotFinite { index: 1, .. })));
    assert!(matches!(Barycentric::new(&[f64::INFINITY]), Err(BasisError::NotFinite { index: 0, .. })));
    // Zero of either sign is the same node.
    assert!(Barycentric::new(&[0.0, -0.0]).is_err());
    let basis = Barycentric::new(&[-1.0, 1.0]).unwrap();
    assert!(basis.evaluate(&[1.0, 2.0], 1, 0, f64::NAN).is_nan());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Lagrange polynomials sum to one, reproduce the abscissa and agree with `evaluate`.
    #[test]
    fn basis_is_a_partition_of_unity(n in 1usize..=60, x in -1.0f64..1.0) {
        let lgr = Lgr::new(n).unwrap();
        let basis = lgr.support_basis();
        let mut l = vec![0.0; n + 1];
        basis.basis(x, &mut l);
        prop_assert!((l.iter().sum::<f64>() - 1.0).abs() < 250.0 * ROUNDING);
        let moment: f64 = l.iter().zip(lgr.support()).map(|(l, t)| l * t).sum();
        prop_assert!((moment - x).abs() < 250.0 * ROUNDING);
        let values: Vec<f64> = lgr.support().iter().map(|t| t.exp()).collect();
        let direct: f64 = l.iter().zip(&values).map(|(l, v)| l * v).sum();
        prop_assert!((direct - basis.evaluate(&values, 1, 0, x)).abs() < 250.0 * ROUNDING);
    }

    /// A polynomial of the degree of the nodes and its derivative come back, wherever the nodes lie.
    #[test]
    fn cubics_are_reproduced(a in -3.0f64..3.0, x in -3.0f64..3.0, gaps in prop::array::uniform3(0.3f64..1.0)) {
        let nodes = [a, a + gaps[0], a + gaps[0] + gaps[1], a + gaps.iter().sum::<f64>()];
        let f = |x: f64| ((x - 2.0) * x + 0.5) * x - 1.0;
        let basis = Barycentric::new(&nodes).unwrap();
        let values: Vec<f64> = nodes.iter().map(|&x| f(x)).collect();
        // The condition of extrapolation: the sum of the magnitudes of the Lagrange polynomials.
        let mut l = [0.0; 4];
        basis.basis(x, &mut l);
        let bound = 1e-12 * (1.0 + l.iter().map(|v| v.abs()).sum::<f64>());
        prop_assert!((basis.evaluate(&values, 1, 0, x) - f(x)).abs() < 50.0 * bound);
        let mut slope = [0.0];
        basis.derivative_all(&values, x, &mut slope);
        prop_assert!((slope[0] - ((3.0 * x - 4.0) * x + 0.5)).abs() < 500.0 * bound);
    }
}
