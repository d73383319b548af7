use apsides_ad::Dual;

use super::*;

/// Published: half a unit of the last digit that the source prints, or a few of them where it was computed with less.
const PUBLISHED: f64 = 1e-4;

/// Discretisation: difference quotients, by their steps.
const DIFFERENCES: f64 = 1e-8;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-14;

/// Discretisation: coefficients a little below and above Mach 1.
const ACROSS_MACH_1: f64 = 1e-7;

/// Discretisation: a cap that lacks little of a hemisphere.
const NEARLY_A_HEMISPHERE: f64 = 1e-6;

fn near(what: &str, found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() < tolerance, "{what}: {found} instead of {expected}");
}

/// `scipy.interpolate.PchipInterpolator` 1.17.1 in the logarithm of the Mach number, with the end rows repeated at another Mach number.
#[test]
fn apollo_table_as_by_scipy() {
    let table = MachTable::apollo_10();
    let reference = [
        (0.25, 0.23196888375120348, 0.8293530410923072),
        (0.8, 0.27685014845763356, 1.0280494540736729),
        (1.0, 0.41099377805878623, 1.1387886785859258),
        (1.3, 0.5295157139282453, 1.2577903720435255),
        (2.2, 0.5128862365813105, 1.2732051454937645),
        (3.7, 0.4401518953010552, 1.2272930803011184),
        (7.0, 0.426007342672069, 1.231119319832168),
        (20.0, 0.389731848071294, 1.284042957503824),
        (29.5, 0.379, 1.30136),
    ];
    for (mach, lift, drag) in reference {
        let [found_lift, found_drag] = table.coefficients(mach);
        near("lift", found_lift, lift, ROUNDING);
        near("drag", found_drag, drag, ROUNDING);
    }
    assert_eq!(table.coefficients(0.0), [0.2317, 0.82584]);
    assert_eq!(table.coefficients(40.0), [0.379, 1.30136]);
    let [lift, drag] = table.coefficients(Dual::<1>::variable(0.0, 0));
    assert_eq!([lift.eps, drag.eps], [[0.0], [0.0]]);
    near("trim", MachTable::apollo_10_attack()[12][1].to_degrees(), 157.4, 100.0 * ROUNDING);
}

/// Derivatives against differences.
fn assert_derivatives(model: &Aerodynamics, mach: f64, attack: f64) {
    let h = 1e-5;
    let found = model.coefficients(Dual::<2>::variable(mach, 0), Dual::<2>::variable(attack, 1));
    let by_mach = [mach + h, mach - h].map(|m| model.coefficients(m, attack));
    let by_attack = [attack + h, attack - h].map(|a| model.coefficients(mach, a));
    for k in 0..2 {
        near("by Mach", found[k].eps[0], (by_mach[0][k] - by_mach[1][k]) / (2.0 * h), DIFFERENCES);
        near("by attack", found[k].eps[1], (by_attack[0][k] - by_attack[1][k]) / (2.0 * h), DIFFERENCES);
    }
}

#[test]
fn derivatives_of_every_model() {
    let cone = Newtonian::sphere_cone(0.6638, 1.325, 70_f64.to_radians(), 1.29).unwrap();
    for model in [Aerodynamics::Mach(MachTable::apollo_10()), attack_table(), Aerodynamics::Newtonian(cone)] {
        assert!(model.depends_on_mach());
        for mach in [0.05, 0.6, 0.99, 1.7, 6.0, 25.0] {
            for attack in [-0.3, 0.0, 0.21] {
                assert_derivatives(&model, mach, attack);
            }
        }
    }
}

/// Coefficients that cubic splines reproduce.
fn polynomial(mach: f64, attack: f64) -> [f64; 2] {
    let x = mach.ln();
    [(1.0 + x - 0.1 * x * x) * (attack + attack.powi(3)), 2.0 + 0.1 * x + attack * attack]
}

fn attack_table() -> Aerodynamics {
    let (mach, attack) = ([0.3, 0.8, 1.2, 4.0, 20.0], [-0.5, -0.2, 0.1, 0.3, 0.6]);
    let rows =
        |k: usize| -> Vec<f64> { mach.iter().flat_map(|m| attack.map(|a| polynomial(*m, a)[k])).collect() };
    Aerodynamics::Attack(AttackTable::new(&mach, &attack, &rows(0), &rows(1)).unwrap())
}

#[test]
fn attack_table_inside_and_beyond_its_edges() {
    let table = attack_table();
    let expect = |mach: f64, attack: f64, at: [f64; 2]| {
        let (found, expected) = (table.coefficients(mach, attack), polynomial(at[0], at[1]));
        near("lift", found[0], expected[0], 100.0 * ROUNDING);
        near("drag", found[1], expected[1], 100.0 * ROUNDING);
    };
    expect(2.5, 0.25, [2.5, 0.25]);
    expect(0.0, -0.3, [0.3, -0.3]);
    expect(30.0, 1.0, [20.0, 0.6]);
    expect(1.0, -2.0, [1.0, -0.5]);
}

/// NACA Report 1135: pressure ratios 1.8929 at Mach 1, 5.640 at 2, 129.2 at 10; 1.839 is the limit.
#[test]
fn stagnation_pressure_as_published() {
    let c = |mach: f64| stagnation_pressure_coefficient(mach, 1.4);
    near("Mach 0", c(0.0), 1.0, 0.1 * ROUNDING);
    near("series", c(0.1 - 1e-12), c(0.1 + 1e-12), 1e3 * ROUNDING);
    near("Mach 1", c(1.0), 0.8929 / 0.7, PUBLISHED);
    near("Mach 2", c(2.0), 4.640 / 2.8, 2.0 * PUBLISHED);
    near("Mach 10", c(10.0), 128.2 / 70.0, 10.0 * PUBLISHED);
    near("limit", c(1e6), 1.839, 5.0 * PUBLISHED);
    // Two continuous derivatives where the shock begins.
    let jet = |mach: f64| c_jet(mach);
    let (below, above) = (jet(1.0 - 1e-9), jet(1.0 + 1e-9));
    for k in 0..3 {
        near("Mach 1", below[k], above[k], ACROSS_MACH_1);
    }
}

fn c_jet(mach: f64) -> [f64; 3] {
    use apsides_ad::HyperDual;
    let seeded = HyperDual::<1> { re: mach, e1: [1.0], e2: [1.0], e12: [0.0] };
    let c = stagnation_pressure_coefficient(seeded, 1.4);
    [c.re, c.e1[0], c.e12[0]]
}

/// Normal and axial force by sums of the pressure over the surface, by the stagnation coefficient.
fn by_sums(nose: f64, base: f64, half_angle: f64, attack: f64) -> [f64; 2] {
    let (sin_a, cos_a) = attack.sin_cos();
    let turned = std::f64::consts::FRAC_PI_2 - half_angle;
    let n = 800;
    let mut forces = [0.0; 2];
    let mut add = |slope: f64, radius: f64, length: f64| {
        // A ring whose outward normal makes the angle `slope` with the axis.
        for j in 0..n {
            let around = std::f64::consts::TAU * (f64::from(j) + 0.5) / f64::from(n);
            let meets = slope.cos() * cos_a + slope.sin() * around.cos() * sin_a;
            assert!(meets > -1e-9, "shadow");
            let push = meets * meets * radius * length * std::f64::consts::TAU / f64::from(n);
            forces[0] += push * slope.sin() * around.cos();
            forces[1] += push * slope.cos();
        }
    };
    for i in 0..n {
        let part = (f64::from(i) + 0.5) / f64::from(n);
        add(turned * part, nose * (turned * part).sin(), nose * turned / f64::from(n));
        let from = nose * turned.sin();
        add(turned, from + (base - from) * part, (base - from) / half_angle.sin() / f64::from(n));
    }
    forces.map(|f| f / (std::f64::consts::PI * base * base))
}

#[test]
fn newtonian_forces_are_sums_of_the_pressure() {
    for (nose, base, half_angle, attack) in
        [(0.6, 1.3, 1.2, 0.3), (0.0, 1.0, 0.4, 0.35), (0.3, 1.0, 0.5, -0.5), (1.0, 0.9, 0.5, 0.2)]
    {
        let shape = Newtonian::sphere_cone(nose, base, half_angle, 1.4).unwrap();
        let (found, expected) =
            (shape.body_coefficients(8.0, attack), by_sums(nose, base, half_angle, attack));
        for k in 0..2 {
            near(
                "force",
                found[k] / stagnation_pressure_coefficient(8.0, 1.4),
                expected[k],
                0.02 * PUBLISHED,
            );
        }
        let [lift, drag] = shape.coefficients(8.0, attack);
        near("lift", lift, found[0] * attack.cos() - found[1] * attack.sin(), ROUNDING);
        near("drag", drag, found[0] * attack.sin() + found[1] * attack.cos(), ROUNDING);
    }
}

/// A sharp cone has `C sin^2` of its half angle; a hemisphere half the stagnation pressure; the heat shield of Apollo (4.694 m by 3.912 m)
/// a lift to drag of about 0.3 at 20 deg.
#[test]
fn newtonian_shapes() {
    let c = stagnation_pressure_coefficient(10.0, 1.4);
    let cone = Newtonian::sphere_cone(0.0, 1.0, 0.3, 1.4).unwrap();
    near("cone", cone.coefficients(10.0, 0.0)[1], c * 0.3_f64.sin().powi(2), ROUNDING);
    let nearly = Newtonian::segment(1.0, 1.0 - 1e-12, 1.4).unwrap();
    near("hemisphere", nearly.coefficients(10.0, 0.0)[1], c / 2.0, NEARLY_A_HEMISPHERE);
    let apollo = Newtonian::segment(4.694, 1.956, 1.4).unwrap();
    let [lift, drag] = apollo.coefficients(20.0, -20_f64.to_radians());
    assert!((0.25..0.35).contains(&(lift / drag)) && (1.2..1.5).contains(&drag), "{lift} {drag}");
    near("largest angle", apollo.largest_attack(), (1.956_f64 / 4.694).acos(), ROUNDING);
}

#[test]
fn bad_input_is_refused_by_name() {
    let message =
        |mach: &[f64], lift: &[f64], drag: &[f64]| MachTable::new(mach, lift, drag).unwrap_err().to_string();
    let ones = [1.0, 1.0, 1.0];
    assert_eq!(
        message(&[1.0, 3.0, 2.0], &ones, &ones),
        "Mach number in row 3 of the table: 2 is not above 3 of the row before"
    );
    assert!(message(&[-1.0, 2.0, 3.0], &ones, &ones).contains("Mach number in row 1"));
    assert!(message(&[1.0, 2.0, 3.0], &[0.0, f64::NAN, 0.0], &ones).contains("coefficient of lift in row 2"));
    assert!(message(&[1.0, 2.0, 3.0], &ones, &[1.0, 1.0, 0.0]).contains("coefficient of drag in row 3"));
    let few = AttackTable::new(&ones[..1], &[0.0, 1.0], &[1.0; 2], &[1.0; 2]).unwrap_err();
    assert!(few.to_string().contains("at least 2"), "{few}");
    let few = AttackTable::new(&[1.0, 2.0, 3.0], &[0.0, 1.0], &[1.0; 6], &[1.0; 6]).unwrap_err();
    assert!(few.to_string().contains("at least 4"), "{few}");

    let named = |error: DynamicsError, what: &str| assert!(error.to_string().starts_with(what), "{error}");
    let vehicle = |mass: f64, area: f64, nose: f64| {
        let model = Aerodynamics::constant(0.4, 1.2).unwrap();
        EntryVehicle::new(mass, area, nose, model).unwrap_err()
    };
    named(vehicle(-2800.0, 6.0, 3.0), "mass of the vehicle is -2800 kg");
    named(vehicle(f64::NAN, 6.0, 3.0), "mass of the vehicle is NaN kg");
    named(vehicle(1.0, 0.0, 3.0), "reference area is 0 m2");
    named(vehicle(1.0, 6.0, f64::INFINITY), "nose radius is inf m");
    named(Aerodynamics::constant(f64::NAN, 1.0).unwrap_err(), "coefficient of lift");
    named(Aerodynamics::constant(0.0, -1.0).unwrap_err(), "coefficient of drag");
    named(Newtonian::sphere_cone(2.0, 1.0, 0.5, 1.4).unwrap_err(), "radius of the nose");
    named(Newtonian::sphere_cone(0.1, 1.0, 2.0, 1.4).unwrap_err(), "half angle");
    named(Newtonian::sphere_cone(0.1, 1.0, 0.5, 1.0).unwrap_err(), "ratio of the specific heats");
    named(Newtonian::segment(1.0, 1.0, 1.4).unwrap_err(), "radius of the base");
    named(Newtonian::segment(f64::NAN, 1.0, 1.4).unwrap_err(), "radius of the nose");
}

/// At knots of the table, where CA, CN and Cm are the printed ones: Mach 9, 20 deg.
#[test]
fn trim_of_a_centre_of_mass_off_the_axis() {
    let shape = AxisymmetricAerodynamics::new(
        MachAlphaTable::apollo(Interpolation::Smooth),
        2.8,
        0.2406,
        Damping::constant(),
    )
    .unwrap();
    let angle = 20_f64.to_radians();
    let (sin, cos) = angle.sin_cos();
    let [lift, drag] = shape.lift_and_drag(9.0, angle);
    near("lift", lift, 1.4006 * sin - 0.0822 * cos, ROUNDING);
    near("drag", drag, 1.4006 * cos + 0.0822 * sin, ROUNDING);
    // Moment about the station of the centre of mass, and the offset that balances it.
    let offset = 2.8 * (0.0638 - 0.2406 * 0.0822) / 1.4006;
    let trims = shape.trims(offset).unwrap();
    let (mach, found) = trims.last().unwrap();
    assert_eq!(*mach, 9.0);
    near("trim", *found, angle, 100.0 * ROUNDING);
    let table = shape.trimmed(offset).unwrap();
    let [found_lift, found_drag] = table.coefficients(9.0);
    near("lift in trim", found_lift, lift, 100.0 * ROUNDING);
    near("drag in trim", found_drag, drag, 100.0 * ROUNDING);
    assert!(trims.windows(2).all(|w| w[0].0 < w[1].0));
    let far = shape.trimmed(0.3).unwrap_err().to_string();
    assert!(far.contains("offset of the centre of mass") && far.contains("0.3"), "{far}");
}
