//! Ends within reach against the extreme latitudes of the re-entry reference, found by CasADi and Ipopt (Radau collocation of degree 3).
#![allow(clippy::unwrap_used)]

mod common;

use std::cell::Cell;

use apsides_missions::registry;

use apsides_pipeline::footprint::{BoundaryPoint, PointKind, footprint};
use apsides_pipeline::{Error, Pipeline};
use common::Panicking;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-12;

/// Metres in 5e-6 deg: 0.6. The reference is collocated on a coarser mesh.
const LATITUDE_DEG: f64 = 5e-6;
const RADIUS_KM: f64 = 6378.137;
const TARGET_LATITUDE_DEG: f64 = 22.98;

const UNLIMITED: [&str; 3] =
    ["dynamic_pressure_limit_kpa=inf", "load_limit_m_s2=inf", "heat_rate_limit_kw_m2=inf"];

/// Discretisation: the chords of an outline against the nearest of its points, relative.
const OUTLINE: f64 = 0.02;

fn mission(set: &[String]) -> Pipeline {
    let set: Vec<String> = UNLIMITED.iter().map(|s| (*s).to_owned()).chain(set.iter().cloned()).collect();
    registry().load("capsule-reentry", &set).unwrap()
}

/// Lift and drag coefficient, largest and least latitude at the longitude of the target.
const LATITUDES: [[f64; 4]; 7] = [
    [0.379, 1.30136, 22.892_406_172_082_86, 19.252_769_601_936_397],
    [0.40815, 1.2569, 23.343_999_583_005_616, 18.594_618_267_158_488],
    [0.3, 1.2, 22.216_700_187_381_637, 20.218_862_435_854_23],
    [0.325, 1.3, 22.183_124_340_610_455, 20.308_237_673_595_258],
    [0.364, 1.3, 22.726_074_776_231_634, 19.493_115_830_076_2],
    [0.39, 1.3, 23.016_106_654_654_493, 19.075_090_003_924_522],
    [0.42155, 1.23698, 23.546_398_385_273_18, 18.298_800_524_739_107],
];

#[test]
fn the_reach_along_the_meridian_is_that_of_the_reference() {
    for [lift, drag, north, south] in LATITUDES {
        for (bearing, sign, latitude) in [(0, 1.0, north), (180, -1.0, south)] {
            let set = [
                format!("lift_coefficient={lift}"),
                format!("drag_coefficient={drag}"),
                "goal=reach".into(),
                format!("reach_bearing_deg={bearing}"),
                "reach_half_width_km=0".into(),
            ];
            let outcome = mission(&set).solve(None, &mut ()).unwrap();
            assert!(outcome.summary.certificate.is_verified(), "{lift} {drag} {bearing}");
            let reach = outcome.summary.objective.value;
            let found = TARGET_LATITUDE_DEG + sign * (reach / RADIUS_KM).to_degrees();
            assert!((found - latitude).abs() < LATITUDE_DEG, "{lift} {drag} {bearing}: {found}");
        }
    }
}

#[test]
fn an_outline_surrounds_the_target() {
    let bearings = 8;
    let mut told = 0;
    let found = footprint(&mission(&[]), bearings, &mut (), |case| {
        told += usize::from(case.point.is_some());
        true
    })
    .unwrap();
    assert!(found.complete && found.failures.is_empty(), "{:?}", found.failures);
    assert_eq!(told, found.points.len());
    let of = |kind| found.points.iter().filter(move |p| p.kind == kind);
    assert_eq!([PointKind::Extreme, PointKind::Ray].map(|k| of(k).count()), [bearings; 2]);
    assert!(found.points.windows(2).all(|p| p[0].bearing_deg <= p[1].bearing_deg));
    let [longitude, latitude] = found.target_deg;
    assert!((longitude - 59.99).abs() < ROUNDING && (latitude - TARGET_LATITUDE_DEG).abs() < ROUNDING);
    let first = found.track_deg.first().unwrap();
    assert!((first[0] - 41.5).abs() < 1e3 * ROUNDING && (first[1] - 40.5).abs() < 1e3 * ROUNDING);
    // The nearest end is less than 40.52 km away, the distance along the meridian to latitude 23.344 deg of the reference, and it is
    // where the farthest end to its bearing is: no other end is farther that way.
    let nearest: Vec<&BoundaryPoint> = of(PointKind::Nearest).collect();
    assert_eq!(nearest.len(), 1);
    let position = |p: &BoundaryPoint| {
        let east = (p.longitude_deg - longitude).to_radians() * latitude.to_radians().cos() * RADIUS_KM;
        [east, (p.latitude_deg - latitude).to_radians() * RADIUS_KM]
    };
    let [east, north] = position(nearest[0]);
    let distance = east.hypot(north);
    assert!(
        found.target_inside && (found.target_margin_km - distance).abs() < OUTLINE * distance,
        "{distance}"
    );
    assert!(distance < 40.52);
    for p in &found.points {
        let [x, y] = position(p);
        assert!((x * east + y * north) / distance < distance + 0.1, "{p:?}");
    }
    assert!(found.length_km() > 1400.0 && found.width_km() > 300.0);
}

#[test]
fn a_footprint_that_is_stopped_keeps_what_there_is() {
    let mut left = 5;
    let found = footprint(&mission(&[]), 12, &mut (), |_| {
        left -= 1;
        left > 0
    })
    .unwrap();
    assert!(!found.complete);
    assert_eq!(found.points.len(), 4);
    assert!(found.area_km2 > 0.0);
}

#[test]
fn requests_without_an_outline_are_refused() {
    let lunar = registry().load("lunar-direct", &[]).unwrap();
    let refused = lunar.check_footprint().unwrap_err();
    assert!(
        matches!(refused, Error::Conflict { .. }) && refused.to_string().contains("`capsule-reentry`"),
        "{refused}"
    );
    assert!(footprint(&lunar, 8, &mut (), |_| true).is_err());
    assert!(footprint(&mission(&[]), 2, &mut (), |_| true).is_err());
}

/// A panic costs its own case: that is named, and all others are there.
#[test]
fn a_panic_is_an_end_that_failed() {
    for faulty in [0, 2] {
        let (told, planted) = (Cell::new(0), Cell::new(faulty == 0));
        let mut names = Vec::new();
        let found = footprint(&mission(&[]), 3, &mut Panicking(&planted), |case| {
            told.set(told.get() + 1);
            planted.set(told.get() == faulty);
            names.push((case.name.to_owned(), case.status.to_owned()));
            true
        })
        .unwrap();
        let (name, status) = &names[faulty];
        assert!(status.starts_with("a fault of the program (planted in iteration"), "{status}");
        assert_eq!(found.failures, [format!("{name}: {status}")]);
        assert!(found.complete && found.points.len() >= 5, "{:?}", found.points.len());
        assert_eq!(names.iter().filter(|(_, status)| status.contains("planted")).count(), 1, "{names:?}");
    }
}
