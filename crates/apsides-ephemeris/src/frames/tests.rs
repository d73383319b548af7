#![allow(clippy::unwrap_used)]

use super::*;

/// Round-off of positions (m) of planetary size.
const ROUNDING: f64 = 1e-8;
/// Round-off of unit vectors.
const UNIT_ROUNDING: f64 = 1e-12;
/// Discretisation: the rate by a difference quotient over two seconds.
const DIFFERENCES: f64 = 1e-12;

fn frames(body: CentralBody, plane: &Plane) -> Frames {
    Frames::new(body, "2030-01-01T00:00:00 TDB".parse().unwrap(), plane)
}

const EQUATOR: Plane = Plane { reference: Reference::Body, node: 0.0, inclination: 0.0, argument: 0.0 };

#[test]
fn states_there_and_back() {
    let (r, v) = ([1.2e6, -0.8e6, 0.9e6], [100.0, -1500.0, 30.0]);
    for body in CentralBody::ALL {
        let axes = frames(body, &EQUATOR).orientation(12_345.6);
        let (fixed, over_ground) = axes.to_fixed(r, v);
        let (again, speed) = axes.to_icrf(fixed, over_ground);
        for k in 0..3 {
            assert!((again[k] - r[k]).abs() < ROUNDING && (speed[k] - v[k]).abs() < ROUNDING);
        }
    }
}

#[test]
fn the_rate_is_that_of_the_axes() {
    for body in CentralBody::ALL {
        let at = |time| frames(body, &EQUATOR).orientation(time);
        let (before, now, after) = (at(99.0), at(100.0), at(101.0));
        for i in 0..3 {
            for k in 0..3 {
                let quotient = 0.5 * (after.matrix[i][k] - before.matrix[i][k]);
                assert!((now.rate[i][k] - quotient).abs() < DIFFERENCES, "{body:?} {i} {k}");
            }
        }
    }
}

/// With no angles the first axis of a mission at the epoch is the prime meridian on the equator.
#[test]
fn the_plane_of_a_mission_is_turned_from_the_body_at_the_epoch() {
    let frames = |plane: Plane| frames(CentralBody::Moon, &plane);
    let fixed = |frames: &Frames, v| times(&frames.orientation(0.0).matrix, frames.inertial_to_icrf(v));
    let close = |a: [f64; 3], b: [f64; 3]| {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < UNIT_ROUNDING), "{a:?} {b:?}");
    };
    close(fixed(&frames(EQUATOR), [1.0, 0.0, 0.0]), [1.0, 0.0, 0.0]);
    // A polar orbit that begins 30 deg north of the node at 90 deg east.
    let polar = Plane {
        node: 90_f64.to_radians(),
        inclination: 90_f64.to_radians(),
        argument: 30_f64.to_radians(),
        ..EQUATOR
    };
    close(fixed(&frames(polar), [1.0, 0.0, 0.0]), [0.0, 0.75_f64.sqrt(), 0.5]);
    close(fixed(&frames(polar), [0.0, 0.0, 1.0]), [1.0, 0.0, 0.0]);
    let icrf = frames(Plane { reference: Reference::Icrf, ..EQUATOR });
    close(icrf.inertial_to_icrf([0.1, 0.2, 0.3]), [0.1, 0.2, 0.3]);
    let polar = frames(polar);
    close(polar.icrf_to_inertial(polar.inertial_to_icrf([0.1, 0.2, 0.3])), [0.1, 0.2, 0.3]);
}

#[test]
fn topocentric_axes_point_east_north_and_up() {
    let surface = Ellipsoid::WGS84;
    let (longitude, latitude) = (0.7, -0.4);
    let site = Topocentric::at(&surface, longitude, latitude, 250.0);
    let above = surface.position(longitude, latitude, 1250.0);
    let [east, north, up] = site.components(above);
    assert!(east.abs() < ROUNDING && north.abs() < ROUNDING && (up - 1000.0).abs() < ROUNDING);
    let [east, north, _] = site.components(surface.position(longitude + 1e-5, latitude, 250.0));
    assert!(east > 50.0 && north.abs() < 1.0);
    let [east, north, _] = site.components(surface.position(longitude, latitude + 1e-5, 250.0));
    assert!(north > 50.0 && east.abs() < ROUNDING);
}
