//! Edges of the tables, what is refused, wind and the start of a flight.

use apsides_ad::Dynamics;
use apsides_dynamics::aerodynamics::{AxisymmetricAerodynamics, Damping, Interpolation, MachAlphaTable};
use apsides_dynamics::moving_mass::Layout;
use apsides_dynamics::rigid_body::{FlatEarth, Ground, Inertia, RigidBody, Start, Wind};
use apsides_dynamics::{Atmosphere, Ellipsoid, MovingMassVehicle};

use crate::{DEG, ENTRY, INERTIA, capsule, flat};

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-12;

fn body(ground: Ground) -> RigidBody {
    capsule(ground, Atmosphere::UsStandard1976, Interpolation::Smooth, Damping::constant(), [0.01, 0.0])
        .unwrap()
}

#[test]
fn rates_are_finite_where_tables_end() {
    for ground in [flat(), Ground::Ellipsoid(Ellipsoid::WGS84)] {
        let body = body(ground);
        let vehicle = MovingMassVehicle::new(body.clone(), Layout::CROSS, [10.0; 2], 0.2).unwrap();
        for (altitude, speed, attack, sideslip) in [
            (40e3, 12_700.0, 2.0, 2.0),
            (20e3, 300.0, 180.0, 0.0),
            (20e3, 300.0, 90.0, -40.0),
            (1e3, 0.0, 0.0, 0.0),
            (50e3, 1000.0, 0.0, 0.0),
            (2e6, 1000.0, 1.0, 0.0),
            (-6e3, 100.0, 1.0, 0.0),
        ] {
            let start = Start { altitude, speed, attack: attack * DEG, sideslip: sideslip * DEG, ..ENTRY };
            let x = ground.state(&start).unwrap();
            assert!(Dynamics::<13, 6>::rate(&vehicle, 0.0, &x, &[0.1; 6], &[]).iter().all(|r| r.is_finite()));
            assert!(vehicle.condition(&x).is_finite());
            let node = apsides_ad::dynamics_node(body.clone());
            let mut z = x.to_vec();
            z.push(0.0);
            let (mut out, mut jacobian) = ([0.0; 13], vec![0.0; node.pattern().jacobian_len()]);
            node.jacobian(&z, &mut out, &mut jacobian);
            assert!(jacobian.iter().all(|d| d.is_finite()), "{start:?}");
        }
    }
}

#[test]
fn what_leaves_its_range_is_named() {
    let body = body(flat());
    let vehicle = MovingMassVehicle::new(body, Layout::CROSS, [10.0; 2], 0.2).unwrap();
    let at = |altitude, speed, attack| {
        flat().state(&Start { altitude, speed, attack, sideslip: 0.0, ..ENTRY }).unwrap()
    };
    let inside = at(30e3, 1000.0, 0.1);
    assert_eq!(vehicle.range_left(&inside, [0.7, -0.7]), Ok(()));
    let fast = vehicle.range_left(&at(40e3, 12_700.0, 0.1), [0.0; 2]).unwrap_err();
    assert!(
        fast.quantity.name == "Mach number" && (fast.value - 40.0).abs() < 0.2 && fast.range == [0.4, 9.0]
    );
    let tumbled = vehicle.range_left(&at(30e3, 1000.0, 3.0), [0.0; 2]).unwrap_err();
    assert!(tumbled.quantity.name == "total angle of attack" && (tumbled.value - 3.0).abs() < ROUNDING);
    let travel = vehicle.range_left(&inside, [0.1, -0.71]).unwrap_err();
    assert_eq!(travel.to_string(), "mass along z is -0.71 m, the table covers -0.7 to 0.7");
    assert!(
        Layout::RADIAL.range_left([40.0, -90.0]).is_ok()
            && Layout::RADIAL.range_left([f64::NAN, 0.0]).is_err()
    );
}

#[test]
fn what_is_refused() {
    let aerodynamics =
        || AxisymmetricAerodynamics::capsule(Interpolation::Smooth, Damping::constant()).unwrap();
    let inertia = Inertia::principal(INERTIA).unwrap();
    let body =
        |mass, centre| RigidBody::new(flat(), Atmosphere::Vacuum, aerodynamics(), mass, inertia, centre);
    let text = |result: Result<RigidBody, apsides_dynamics::DynamicsError>| result.unwrap_err().to_string();
    assert!(text(body(0.0, [0.0; 3])).contains("mass of the vehicle is 0 kg"));
    assert!(text(body(500.0, [0.0, f64::NAN, 0.0])).contains("centre of mass is NaN"));
    let table = MachAlphaTable::apollo(Interpolation::Linear);
    assert!(AxisymmetricAerodynamics::new(table, -1.5, 0.24, Damping::constant()).is_err());
    let good = body(500.0, [0.0; 3]).unwrap();
    let masses = |layout, masses, station| {
        MovingMassVehicle::new(good.clone(), layout, masses, station).unwrap_err().to_string()
    };
    assert!(masses(Layout::Cross { travel: 0.0 }, [1.0; 2], 0.2).contains("travel of the masses is 0 m"));
    assert!(masses(Layout::Radial { radius: -1.0 }, [1.0; 2], 0.2).contains("radius of the rim is -1 m"));
    assert!(masses(Layout::CROSS, [-1.0, 1.0], 0.2).contains("moving mass is -1 kg"));
    assert!(masses(Layout::CROSS, [300.0, 200.0], 0.2).contains("mass without the moving masses is 0 kg"));
    // 100 kg at 2 m: more inertia than the vehicle has.
    assert!(masses(Layout::CROSS, [50.0, 50.0], 2.0).contains("inertia"));
    assert!(Wind::new(&[0.0, 0.0], &[1.0, 1.0], &[0.0, 0.0]).is_err());
    assert!(flat().state(&Start { speed: f64::INFINITY, ..ENTRY }).is_err());
    assert!(FlatEarth::wgs84(f64::NAN).is_err());
}

#[test]
fn a_flight_starts_as_stated() {
    for ground in [flat(), Ground::Ellipsoid(Ellipsoid::WGS84)] {
        let start = Start { azimuth: 130.0 * DEG, longitude: -1.3, bank: 0.4, ..ENTRY };
        let condition = body(ground).condition(&ground.state(&start).unwrap());
        assert!(
            (condition.altitude - 100e3).abs() < 1e6 * ROUNDING
                && (condition.airspeed - 700.0).abs() < 100.0 * ROUNDING
        );
        assert!(
            (condition.attack - 2.0 * DEG).abs() < 0.1 * ROUNDING
                && (condition.sideslip - 2.0 * DEG).abs() < 0.1 * ROUNDING
        );
    }
}

/// Close to the ground the ellipsoid and the plane are one, but for the rotation: `2 w v` and the turn of the horizon.
#[test]
fn the_plane_is_tangent_to_the_ellipsoid() {
    let earth = Ellipsoid::WGS84;
    let (round, plane) = (Ground::Ellipsoid(earth), flat());
    let [a, b] = [round, plane].map(|g| {
        let x = g.state(&Start { altitude: 10e3, ..ENTRY }).unwrap();
        let rate = body(g).rate(0.0, &x, &[], &[]);
        let local = g.local(&[x[0], x[1], x[2]]);
        let acceleration = [rate[3], rate[4], rate[5]];
        [local.up, local.north, local.east]
            .map(|axis| axis.iter().zip(acceleration).map(|(a, b)| a * b).sum::<f64>())
    });
    for k in 0..3 {
        assert!((a[k] - b[k]).abs() < 2.0 * earth.rotation_rate * 700.0 + 1e-4, "{a:?} {b:?}");
    }
}

/// In a wind the air does what it does to a body of that velocity relative to it.
#[test]
fn wind_is_a_velocity_of_the_air() {
    let calm = body(flat());
    let windy = calm.clone().in_wind(Wind::new(&[0.0, 30e3], &[12.0, 12.0], &[-5.0, -5.0]).unwrap());
    let x = flat().state(&Start { altitude: 12e3, speed: 200.0, ..ENTRY }).unwrap();
    let mut carried = x;
    carried[3] += 12.0;
    carried[4] -= 5.0;
    let (a, b) = (calm.rate(0.0, &x, &[], &[]), windy.rate(0.0, &carried, &[], &[]));
    assert!((3..13).all(|k| (a[k] - b[k]).abs() < ROUNDING * (1.0 + a[k].abs())));
    assert!((windy.condition(&carried).airspeed - 200.0).abs() < ROUNDING);
    // Over the ellipsoid the wind lies in the local horizontal.
    let round = Ground::Ellipsoid(Ellipsoid::WGS84);
    let still = Start { altitude: 12e3, speed: 0.0, ..ENTRY };
    let windy = body(round).in_wind(Wind::new(&[0.0, 30e3], &[12.0, 12.0], &[-5.0, -5.0]).unwrap());
    assert!((windy.condition(&round.state(&still).unwrap()).airspeed - 13.0).abs() < ROUNDING);
}
