use apsides_ad::Dual;

use super::*;

/// Discretisation: difference quotients, by their steps.
const DIFFERENCES: f64 = 2e-3;

/// Published: half a unit of the last digit that the source prints, or a few of them where it was computed with less.
const PUBLISHED: f64 = 5e-5;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-14;

/// Discretisation: derivatives a little to either side of an altitude without a kink, relative.
const SMOOTH: f64 = 1e-9;

/// Published: the last digit of the altitude of the tropopause, m.
const PUBLISHED_M: f64 = 0.01;

/// Round-off of the logarithm of a ratio near one.
const EXTRAPOLATED: f64 = 1e-10;

fn near(what: &str, found: f64, expected: f64, relative: f64) {
    assert!((found / expected - 1.0).abs() < relative, "{what}: {found:e} instead of {expected:e}");
}

/// NASA-TM-X-74335, table I: geometric altitude (km), kinetic temperature (K), pressure (Pa), density (kg/m3). The
/// last digit of the pressures at 15 and 80 km is cut, not rounded.
const LOWER: [(f64, f64, f64, f64); 14] = [
    (-5.0, 320.676, 1.7776e5, 1.9311),
    (0.0, 288.150, 1.013_25e5, 1.2250),
    (1.0, 281.651, 8.9876e4, 1.1117),
    (5.0, 255.676, 5.4048e4, 7.3643e-1),
    (10.0, 223.252, 2.6500e4, 4.1351e-1),
    (15.0, 216.650, 1.2111e4, 1.9476e-1),
    (20.0, 216.650, 5.5293e3, 8.8910e-2),
    (25.0, 221.552, 2.5492e3, 4.0084e-2),
    (30.0, 226.509, 1.1970e3, 1.8410e-2),
    (40.0, 250.350, 2.8714e2, 3.9957e-3),
    (50.0, 270.650, 7.9779e1, 1.0269e-3),
    (60.0, 247.021, 2.1958e1, 3.0968e-4),
    (70.0, 219.585, 5.2209, 8.2829e-5),
    (80.0, 198.639, 1.0524, 1.8458e-5),
];

/// The same above 86 km, densities to four digits.
const UPPER: [(f64, f64, f64); 24] = [
    (86.0, 186.87, 6.958e-6),
    (90.0, 186.87, 3.416e-6),
    (95.0, 188.42, 1.393e-6),
    (100.0, 195.08, 5.604e-7),
    (105.0, 208.84, 2.325e-7),
    (110.0, 240.00, 9.708e-8),
    (115.0, 300.00, 4.289e-8),
    (120.0, 360.00, 2.222e-8),
    (130.0, 469.27, 8.152e-9),
    (140.0, 559.63, 3.831e-9),
    (150.0, 634.39, 2.076e-9),
    (160.0, 696.29, 1.233e-9),
    (180.0, 790.07, 5.194e-10),
    (200.0, 854.56, 2.541e-10),
    (250.0, 941.33, 6.073e-11),
    (300.0, 976.01, 1.916e-11),
    (350.0, 990.06, 7.014e-12),
    (400.0, 995.83, 2.803e-12),
    (500.0, 999.24, 5.215e-13),
    (600.0, 999.85, 1.137e-13),
    (700.0, 999.97, 3.070e-14),
    (800.0, 999.99, 1.136e-14),
    (900.0, 1000.0, 5.759e-15),
    (1000.0, 1000.0, 3.561e-15),
];

#[test]
fn standard_layers_as_published() {
    for (km, temperature, pressure, density) in LOWER {
        let state = Atmosphere::UsStandard1976.state(km * 1e3).unwrap();
        assert!((state.temperature - temperature).abs() < 20.0 * PUBLISHED, "{km}: {state:?}");
        near("pressure", state.pressure, pressure, 2.0 * PUBLISHED);
        near("density", state.density, density, PUBLISHED);
    }
    near("sound at sea level", Atmosphere::UsStandard1976.speed_of_sound(0.0), 340.294, 0.02 * PUBLISHED);
    near("sound at 50 km", Atmosphere::UsStandard1976.speed_of_sound(50e3), 329.799, 0.04 * PUBLISHED);
}

#[test]
fn standard_thermosphere_as_published() {
    for (km, temperature, density) in UPPER {
        let state = Atmosphere::UsStandard1976.state(km * 1e3).unwrap();
        assert!((state.temperature - temperature).abs() < 120.0 * PUBLISHED, "{km}: {state:?}");
        near("density", state.density, density, if km <= 500.0 { 4e-4 } else { 1e-3 });
    }
    let state = |km: f64| Atmosphere::UsStandard1976.state(km * 1e3).unwrap();
    near("pressure at 100 km", state(100.0).pressure, 3.2011e-2, 2.0 * PUBLISHED);
    near("pressure at 200 km", state(200.0).pressure, 8.4736e-5, 2.0 * PUBLISHED);
    near("pressure at 500 km", state(500.0).pressure, 3.0236e-7, 4.0 * PUBLISHED);
}

/// An implementation with 287.05287 J/(kg K), where the standard's numbers make 287.05307: 7.4e-6 at 80 km.
#[test]
fn standard_as_in_another_implementation() {
    let reference = [
        (0.0, 1.225000018124288),
        (10e3, 0.4135103295925664),
        (20e3, 0.08890979566796656),
        (30e3, 0.01841012582773449),
        (50e3, 0.0010268735914327168),
        (70e3, 8.282812858987046e-5),
        (80e3, 1.8457895946854748e-5),
    ];
    for (altitude, density) in reference {
        near("density", Atmosphere::UsStandard1976.density(altitude), density, 0.16 * PUBLISHED);
    }
}

#[test]
fn continuous_and_defined_everywhere() {
    let standard = Atmosphere::UsStandard1976;
    let mut before = f64::INFINITY;
    for k in -200..12_000 {
        let altitude = f64::from(k) * 100.0;
        let density = standard.density(altitude);
        assert!(density < before, "{altitude}: {density} {before}");
        before = density;
    }
    for altitude in [constants::BOTTOM, 11_019.1, 20_063.1, 32_161.9, 47_350.1, 51_412.5, 71_802.0, 86e3, 1e6]
    {
        let (low, high) = (altitude - 0.1, altitude + 0.1);
        near("density", standard.density(low), standard.density(high), PUBLISHED);
        near("sound", standard.speed_of_sound(low), standard.speed_of_sound(high), PUBLISHED);
        near("temperature", standard.temperature(low), standard.temperature(high), 2.0 * PUBLISHED);
    }
    let table = AtmosphereTable::new(&[0.0, 1e4], &[1.0, 0.3], &[250.0; 2], Gas::AIR).unwrap();
    let models = [
        Atmosphere::Vacuum,
        Atmosphere::Exponential(Exponential::EARTH),
        Atmosphere::Exponential(Exponential::MARS),
        Atmosphere::Table(table),
        standard,
    ];
    for model in models {
        for altitude in [-1e6, -6e3, -1.0, 0.0, 5e4, 86e3, 1.2e5, 9e5, 1e6, 2e6, 1e9, 1e12] {
            let z = Dual::<1>::variable(altitude, 0);
            for value in [model.density(z), model.temperature(z), model.pressure(z)] {
                assert!(value.re.is_finite() && value.eps[0].is_finite(), "{model:?} {altitude}");
            }
            assert!(!model.speed_of_sound(z).re.is_nan());
        }
    }
}

/// Derivatives in closed form against differences of the values.
#[test]
fn derivatives_of_every_layer() {
    let altitudes =
        [-4e3, 5e3, 15e3, 25e3, 40e3, 49e3, 60e3, 75e3, 83.3e3, 88e3, 97.2e3, 115e3, 180e3, 700e3];
    for z in altitudes {
        for jet in [standard::density, standard::temperature, standard::molecular_temperature] {
            let h = 10.0;
            let [low, mid, high] = [z - h, z, z + h].map(jet);
            for order in 0..2 {
                let difference = (high[order] - low[order]) / (2.0 * h);
                let size = (mid[order + 1].abs()).max(1e-9 * mid[0].abs() / h);
                assert!(
                    (difference - mid[order + 1]).abs() < DIFFERENCES * size,
                    "{z} {order} {difference} {mid:?}"
                );
            }
        }
    }
}

#[test]
fn exponential_above_and_below_its_reference() {
    let law = Exponential::new(0.0158, 10e3, 9354.5, Gas::MARS, 3.71).unwrap();
    near("at", law.density(10e3), 0.0158, 0.1 * ROUNDING);
    near("below", law.density(-5e3), 0.0158 * (15e3_f64 / 9354.5).exp(), ROUNDING);
    // Hydrostatic: p = rho g H.
    let model = Atmosphere::Exponential(law);
    near("pressure", model.pressure(20e3), law.density(20e3) * 3.71 * 9354.5, ROUNDING);
}

#[test]
fn tables_keep_their_rows_and_go_on_with_the_last_scale_height() {
    let (z, rho, t) = ([0.0, 10e3, 30e3, 60e3], [1.2, 0.4, 0.018, 3e-4], [288.0, 223.0, 226.0, 247.0]);
    let table = AtmosphereTable::new(&z, &rho, &t, Gas::AIR).unwrap();
    for k in 0..4 {
        near("density", table.density(z[k]), rho[k], ROUNDING);
        near("temperature", table.temperature(z[k]), t[k], ROUNDING);
    }
    let scale = |a: f64, b: f64| (b - a) / (table.density(a) / table.density(b)).ln();
    near("scale height", scale(61e3, 62e3), scale(70e3, 90e3), EXTRAPOLATED);
    assert_eq!(table.temperature(1e6), 247.0);
}

#[test]
fn bad_input_is_refused_by_name() {
    let message = |z: &[f64], rho: &[f64], t: f64| {
        AtmosphereTable::new(z, rho, &vec![t; z.len()], Gas::AIR).unwrap_err().to_string()
    };
    assert_eq!(
        message(&[0.0, 2.0, 1.0], &[3.0, 2.0, 1.0], 250.0),
        "altitude in row 3 of the table: 1 is not above 2 of the row before"
    );
    assert_eq!(
        message(&[0.0, 1.0], &[3.0, -2.0], 250.0),
        "density in row 2 of the table: -2 is not positive"
    );
    assert_eq!(
        message(&[0.0, f64::NAN], &[3.0, 2.0], 250.0),
        "altitude in row 2 of the table: NaN is not finite"
    );
    assert_eq!(message(&[0.0, 1.0], &[3.0], 250.0), "density in row 2 of the table: 1 values for 2 rows");
    assert!(message(&[0.0], &[3.0], 250.0).contains("at least 2"));
    assert!(message(&[0.0, 1.0], &[3.0, 2.0], 0.0).contains("temperature in row 1"));
    let below = Atmosphere::UsStandard1976.state(-6e3).unwrap_err().to_string();
    assert_eq!(
        below,
        "altitude in the atmosphere is -6000 m, allowed is the range of the model of the atmosphere"
    );
    assert!(Atmosphere::UsStandard1976.state(f64::NAN).is_err());
    assert!(
        Exponential::new(1.0, 0.0, -7000.0, Gas::AIR, 9.8).unwrap_err().to_string().contains("scale height")
    );
    assert!(Gas::new(0.0, 1.4).unwrap_err().to_string().starts_with("gas constant is 0"));
    assert!(Gas::new(287.0, 1.0).unwrap_err().to_string().starts_with("ratio of the specific heats is 1"));
    assert!(Gas::new(287.0, f64::NAN).is_err() && Gas::new(287.0, 1.4).is_ok());
}

#[test]
fn first_derivatives_jump_at_the_kinks_alone() {
    let jump = |atmosphere: &Atmosphere, z: f64| {
        let slope = |z: f64| {
            let z = Dual::<1>::variable(z, 0);
            [atmosphere.density(z), atmosphere.speed_of_sound(z)].map(|v| v.eps[0] / v.re)
        };
        let (below, above) = (slope(z - 1e-3), slope(z + 1e-3));
        (below[0] - above[0]).abs().max((below[1] - above[1]).abs())
    };
    for atmosphere in [Atmosphere::UsStandard1976, Atmosphere::UsStandard1976Printed] {
        let kinks = atmosphere.kinks();
        assert!(kinks.windows(2).all(|w| w[0] < w[1]), "{kinks:?}");
        let least = if atmosphere == Atmosphere::UsStandard1976 { 1e-8 } else { 1e-7 };
        for &z in &kinks {
            assert!(jump(&atmosphere, z) > least, "{atmosphere:?}, {z} m: {}", jump(&atmosphere, z));
        }
        for z in (0..190)
            .map(|k| 500.0 + 1000.0 * f64::from(k))
            .filter(|z| kinks.iter().all(|k| (k - z).abs() > 1.0))
        {
            assert!(jump(&atmosphere, z) < SMOOTH, "{atmosphere:?}, {z} m: {}", jump(&atmosphere, z));
        }
    }
    // The tropopause: 11 km of geopotential height.
    assert!((Atmosphere::UsStandard1976.kinks()[0] - 11_019.07).abs() < PUBLISHED_M);
}
