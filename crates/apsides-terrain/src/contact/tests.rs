use std::f64::consts::{FRAC_PI_2, PI};

use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::query::{self, NonlinearRigidMotion, Ray, RayCast, ShapeCastOptions};
use parry3d_f64::shape::{Ball, Cylinder};
use proptest::prelude::*;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

use super::field::to_parry;
use super::*;
use crate::{Geometry, Raster};

/// Solver: the tolerance at which a way down to the ground and a rest on it are found.
const SOLVER: f64 = 1e-6;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-12;

/// Rows x cols pixels about the origin, heights from (east, north).
fn map(rows: usize, cols: usize, pixel: f64, height: impl Fn(f64, f64) -> f64) -> ElevationMap {
    let north_west = [-0.5 * (cols - 1) as f64 * pixel, 0.5 * (rows - 1) as f64 * pixel];
    let geometry = Geometry::new(rows, cols, [pixel; 2], north_west, crate::MapUnit::Metre).unwrap();
    let data = (0..rows)
        .flat_map(|r| (0..cols).map(move |c| (r, c)))
        .map(|(r, c)| geometry.position(r as f64, c as f64))
        .map(|[x, y]| height(x, y) as f32)
        .collect();
    ElevationMap::from_relative(Raster::new(geometry, data).unwrap(), 0.0).unwrap()
}

fn ground(rows: usize, cols: usize, pixel: f64, height: impl Fn(f64, f64) -> f64) -> Ground {
    Ground::new(&map(rows, cols, pixel, height)).unwrap()
}

fn uniform(random: &mut Xoshiro256PlusPlus, low: f64, high: f64) -> f64 {
    low + (high - low) * (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// White noise, heights in 1/1024 m so that they are exact in `f32`.
fn rough(seed: u64, size: usize, pixel: f64, amplitude: f64) -> ElevationMap {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut flat = map(size, size, pixel, |_, _| 0.0).relative().clone();
    for z in flat.data_mut() {
        *z = ((uniform(&mut random, -amplitude, amplitude) * 1024.0).round() / 1024.0) as f32;
    }
    ElevationMap::from_relative(flat, 0.0).unwrap()
}

const POINTS: Lander = Lander { pad_distance: 2.5, pad_radius: 0.0, centre_of_mass_height: 0.0, belly: None };
const PADS: Lander = Lander {
    pad_distance: 2.5,
    pad_radius: 0.25,
    centre_of_mass_height: 1.5,
    belly: Some(LowerFace { radius: 1.5, height: 0.75 }),
};

fn down(ground: &Ground, lander: &Lander, at: [f64; 2], heading: f64) -> Touchdown {
    ground.touchdown(lander, at, heading).unwrap().unwrap()
}

#[test]
fn rows_go_south_and_cells_are_cut_from_south_west_to_north_east() {
    let only = |r0: usize, c0: usize| {
        let mut relative = map(4, 3, 2.0, |_, _| 0.0).relative().clone();
        let index = relative.geometry().index(r0, c0);
        relative.data_mut()[index] = 1.0;
        Ground::new(&ElevationMap::from_relative(relative, 100.0).unwrap()).unwrap()
    };
    // Pixel (0, 0) is at (-2, 3), pixel (3, 2) at (2, -3); the cell between (0, 0) and (1, 1) has its middle at (-1, 2).
    assert_eq!(only(0, 0).height([-2.0, 3.0]), Some(101.0));
    assert_eq!(only(0, 0).height([-1.0, 2.0]), Some(100.0));
    assert_eq!(only(1, 1).height([-1.0, 2.0]), Some(100.0));
    assert_eq!(only(0, 1).height([-1.0, 2.0]), Some(100.5));
    assert_eq!(only(1, 0).height([-1.0, 2.0]), Some(100.5));
    assert_eq!(only(3, 2).height([2.0, -3.0]), Some(101.0));
    assert_eq!(only(3, 2).height([2.0, 3.0]), Some(100.0));
    assert_eq!(only(0, 0).height([-2.1, 3.0]), None);
    assert_eq!(only(0, 0).height([0.0, -3.1]), None);
    // parry's rays see the same surface.
    for (r, c) in [(0, 0), (0, 2), (2, 1), (3, 0)] {
        let ground = only(r, c);
        for (x, y) in [(-1.3, 2.2), (0.1, 0.4), (1.9, -2.9), (-1.2, -2.6)] {
            let ray = Ray::new(to_parry([x, y, 10.0]), -Vector::Y);
            let depth = ground.shape().cast_local_ray(&ray, 100.0, false).unwrap();
            assert!((110.0 - depth - ground.height([x, y]).unwrap()).abs() < ROUNDING);
        }
    }
}

#[test]
fn what_parry_does_not_do_on_height_fields() {
    let ground = ground(21, 21, 1.0, |x, y| if x.abs() <= 1.0 && y.abs() <= 1.0 { 3.0 } else { 0.0 });
    let (field, ball) = (ground.shape(), Ball::new(0.5));
    let start = Pose::translation(-8.0, 2.0, 0.0);
    assert!(query::distance(&Pose::IDENTITY, field, &start, &ball).is_err());
    assert!(query::closest_points(&Pose::IDENTITY, field, &start, &ball, 100.0).is_err());
    let still = NonlinearRigidMotion::constant_position(Pose::IDENTITY);
    let moving = NonlinearRigidMotion::new(start, Vector::ZERO, Vector::X, Vector::Y);
    assert!(query::cast_shapes_nonlinear(&still, field, &moving, &ball, 0.0, 20.0, true).is_err());
    // A level cast ends after the first cells and misses the block; the slightest descent finds it.
    let options = ShapeCastOptions::with_max_time_of_impact(16.0);
    let cast = |velocity| {
        query::cast_shapes(&Pose::IDENTITY, Vector::ZERO, field, &start, velocity, &ball, options).unwrap()
    };
    assert!(cast(Vector::X).is_none());
    // The side of the block rises from x = -2 to x = -1 with slope 3: the ball's middle is 0.5 from that plane at
    // x = -2 + 2 / 3 - 0.5 sqrt(10) / 3.
    let way = 6.0 + 2.0 / 3.0 - 0.5 * 10.0_f64.sqrt() / 3.0;
    let found = cast(Vector::new(1.0, -1e-9, 0.0)).unwrap().time_of_impact;
    assert!((found - way).abs() < SOLVER, "{found} {way}");
    let Sight::Blocked { distance, .. } =
        ground.sweep(&Body::Ball { radius: 0.5 }, [-8.0, 0.0, 2.0], [8.0, 0.0, 2.0]).unwrap()
    else {
        panic!("the block is in the way")
    };
    assert!((distance - way).abs() < SOLVER, "{distance} {way}");
}

#[test]
fn tilted_planes_are_recovered() {
    for degrees in [3.0_f64, 8.0, 15.0, 25.0] {
        for direction in [0.0_f64, 0.4, 2.0, 4.5] {
            // Gradients in 1/4096, so that heights are exact in `f32`.
            let part = |c: f64| (c * degrees.to_radians().tan() * 4096.0).round() / 4096.0;
            let (a, b) = (part(direction.cos()), part(direction.sin()));
            let ground = ground(41, 41, 0.25, |x, y| a * x + b * y);
            let tilt = a.hypot(b).atan();
            for lander in [POINTS, PADS] {
                for heading in [0.0, 0.3, 1.7, -2.0] {
                    let down = down(&ground, &lander, [0.3, -0.4], heading);
                    assert_eq!((down.rests.len(), down.unsettled), (1, 0));
                    let rest = down.worst().unwrap();
                    assert!(
                        (rest.tilt - tilt).to_degrees().abs() < 1e3 * ROUNDING,
                        "{degrees}: {}",
                        rest.tilt.to_degrees()
                    );
                    assert_eq!(rest.pads, [true; 4]);
                    assert!((rest.axis[0] + a * tilt.cos()).abs() < ROUNDING);
                    let (ahead, left) = (rest.pitch.sin(), rest.roll.sin());
                    assert!((ahead.hypot(left) - tilt.sin()).abs() < ROUNDING);
                    // Pads of radius r touch with their upper rim: the middle is r tan(tilt) above the plane.
                    let lift = lander.pad_radius * tilt.tan();
                    assert!((rest.middle[2] - (0.3 * a - 0.4 * b + lift)).abs() < 1e3 * ROUNDING);
                    if let Some(belly) = lander.belly {
                        let clearance = belly.height + lift * tilt.cos();
                        assert!((rest.clearance.unwrap() - clearance).abs() < 1e3 * ROUNDING);
                    }
                }
            }
        }
    }
}

#[test]
fn a_rock_under_one_pad() {
    let rock = |x: f64, y: f64| if (x - 2.5).abs() <= 0.5 && y.abs() <= 0.5 { 0.5 } else { 0.0 };
    let ground = ground(21, 21, 0.5, rock);
    let down = down(&ground, &POINTS, [0.0, 0.0], 0.0);
    assert_eq!(down.pad_heights, [0.5, 0.0, 0.0, 0.0]);
    assert_eq!(down.rests.len(), 2);
    for rest in &down.rests {
        // Heights of pads 0, 2 and 1 are 0.5, 0, 0: elevations of the two axes have sines 0.5 / 5 and -0.25 / 2.5.
        assert!((rest.tilt - 0.02_f64.sqrt().asin()).abs() < ROUNDING, "{}", rest.tilt.to_degrees());
        assert!((rest.pitch.sin() - 0.1).abs() < ROUNDING && (rest.roll.sin().abs() - 0.1).abs() < ROUNDING);
        assert!(rest.pads[0] && rest.pads[2] && rest.pads[1] != rest.pads[3]);
        assert!((rest.middle[2] - 0.25).abs() < ROUNDING);
    }
    // With the centre of mass above the pads both stay, until the shift of 0.1 h leaves the triangle.
    let rests = |height| {
        let lander = Lander { centre_of_mass_height: height, ..POINTS };
        ground.touchdown(&lander, [0.0, 0.0], 0.0).unwrap().unwrap().rests.len()
    };
    assert_eq!((rests(1.0), rests(30.0)), (2, 0));
}

#[test]
fn a_lander_topples_when_its_mass_leaves_the_pads() {
    let ground = ground(41, 41, 0.5, |x, _| 0.5 * x);
    let stays = |height| {
        let lander = Lander { centre_of_mass_height: height, ..POINTS };
        down(&ground, &lander, [0.0, 0.0], 0.0).worst().is_some()
    };
    // On a slope of 1/2 along the pads the mass leaves at h tan(tilt) = 2.5 m.
    assert!(stays(4.999) && !stays(5.001));
}

#[test]
fn a_cone_shaped_crater() {
    let slope = 0.25;
    let ground = ground(97, 97, 0.25, |x, y| slope * x.hypot(y));
    let lander = Lander { belly: Some(LowerFace { radius: 2.0, height: 0.5 }), pad_distance: 3.0, ..POINTS };
    let centred = down(&ground, &lander, [0.0, 0.0], 0.0);
    let rest = centred.worst().unwrap();
    assert_eq!((centred.rests.len(), rest.pads), (1, [true; 4]));
    assert!(rest.tilt < ROUNDING && (rest.middle[2] - 3.0 * slope).abs() < ROUNDING);
    // Chords of the cone are above it by at most slope pixel^2 / (8 radius) a side.
    let excess = 0.5 + 3.0 * slope - 2.0 * slope - rest.clearance.unwrap();
    assert!((0.0..slope * 0.25 * 0.25 / (4.0 * 2.0)).contains(&excess), "{excess}");

    // Displaced by d: pads 1 and 3 hold the lander at z = slope sqrt(d^2 + rho^2), and it tips to pad 0 or to pad 2.
    let (d, rho) = (1.0, 3.0);
    let tipped = down(&ground, &lander, [d, 0.0], 0.0);
    assert_eq!(tipped.rests.len(), 2);
    let z = slope * d.hypot(rho);
    let tilt = |sign: f64| {
        // rho sin t = slope (d + sign rho cos t) - z, pad 0 (sign 1) or -rho sin t for pad 2 (sign -1).
        let angle = slope.atan();
        angle + ((sign * slope * d - z) * angle.cos() / rho).asin()
    };
    let mut expected = [tilt(1.0).abs(), tilt(-1.0).abs()];
    expected.sort_by(|a, b| b.total_cmp(a));
    for (rest, expected) in tipped.rests.iter().zip(expected) {
        assert!((rest.tilt - expected).abs() < 0.1 * SOLVER, "{} {expected}", rest.tilt);
        assert!(rest.pads[1] && rest.pads[3] && (rest.middle[2] - z).abs() < 0.1 * SOLVER);
    }
}

#[test]
fn rests_on_rough_ground_touch_with_three_pads() {
    let ground = Ground::new(&rough(7, 101, 0.25, 0.25)).unwrap();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(8);
    let lander = Lander { centre_of_mass_height: 0.0, ..PADS };
    let mut largest = 0.0_f64;
    for _ in 0..300 {
        let at = [0; 2].map(|_| uniform(&mut random, -8.0, 8.0));
        let down = down(&ground, &lander, at, uniform(&mut random, -PI, PI));
        assert_eq!(down.unsettled, 0);
        assert!(!down.rests.is_empty());
        for rest in &down.rests {
            assert!(rest.pads.iter().filter(|&&pad| pad).count() >= 3);
            assert!(rest.gaps.iter().all(|&gap| gap > -TOUCH));
        }
        // The lander of a raster keeps the plan of its pads: contact on the higher diagonal, the worse of two tips.
        let [a, b, c, d] = down.pad_heights;
        let (p, q) = if a + c >= b + d { ([a, c], [b, d]) } else { ([b, d], [a, c]) };
        let middle = 0.5 * (p[0] + p[1]);
        let tip = (q[0] - middle).abs().max((q[1] - middle).abs());
        let raster = ((p[0] - p[1]) / 5.0).hypot(tip / 2.5).atan();
        largest = largest.max((down.rests[0].tilt - raster).abs());
    }
    // Tilts reach 9 deg here, so that pads move inwards by up to 3 cm on slopes of up to 60 deg.
    assert!(largest < 1.5_f64.to_radians(), "{} deg", largest.to_degrees());
}

/// Steepest slope of a raster's lander over 18 headings, and that of rigid landers in contact.
fn raster_and_contact(pad_radius: f64) -> Vec<(f64, f64)> {
    let terrain = crate::synthetic::Terrain { rows: 300, cols: 300, ..crate::synthetic::Terrain::fine() };
    let map = crate::synthetic::Synthetic::new(terrain, 5).unwrap().map().unwrap();
    let criteria = crate::hazard::SiteCriteria {
        footpad_radius_m: pad_radius,
        ..crate::hazard::SiteCriteria::CHANG_E_3_FINE
    };
    let hazards = crate::hazard::hazard_map(&map, &criteria).unwrap();
    let layer = hazards.layer(crate::hazard::Layer::FootpadSlope).unwrap();
    let ground = Ground::new(&map).unwrap();
    let lander = Lander { pad_radius, ..POINTS };
    let mut pairs = Vec::new();
    for row in (40..260).step_by(11) {
        for col in (40..260).step_by(11) {
            let at = map.geometry().position(row as f64, col as f64);
            let steepest = (0..18)
                .map(|k| down(&ground, &lander, at, f64::from(k) * 5.0_f64.to_radians()))
                .filter_map(|down| down.worst().map(|rest| rest.tilt))
                .fold(0.0, f64::max);
            pairs.push((f64::from(layer.get(row, col)), steepest));
        }
    }
    pairs
}

#[test]
fn slopes_of_a_raster_are_those_of_contact() {
    // A raster interpolates bilinearly, takes the highest pixel under a footpad (here the highest point), and does not draw the
    // footpads inwards as the lander tilts.
    for (radius, middle, largest) in [(0.0, 0.02, 0.5), (0.25, 0.05, 1.0)] {
        let pairs = raster_and_contact(radius);
        let mut apart: Vec<f64> = pairs.iter().map(|(a, b)| (a - b).to_degrees().abs()).collect();
        apart.sort_by(f64::total_cmp);
        assert!(apart[apart.len() / 2] < middle && apart[apart.len() - 1] < largest, "{radius}");
        let safe = |slope: f64| slope <= 8.0_f64.to_radians();
        assert!(pairs.iter().any(|(a, _)| safe(*a)) && pairs.iter().any(|(a, _)| !safe(*a)));
        assert!(pairs.iter().filter(|(a, b)| safe(*a) != safe(*b)).count() <= pairs.len() / 100);
    }
}

const TOUCH: f64 = 1e-6;

#[test]
fn footprints_agree_with_samples_and_with_parry() {
    let ground = Ground::new(&rough(3, 41, 0.5, 0.5)).unwrap();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(4);
    for _ in 0..200 {
        let at = [0; 2].map(|_| uniform(&mut random, -7.0, 7.0));
        let radius = uniform(&mut random, 0.01, 2.5);
        let top = ground.highest_under(at, radius).unwrap();
        assert!((ground.height([top[0], top[1]]).unwrap() - top[2]).abs() < 1e3 * ROUNDING);
        assert!((top[0] - at[0]).hypot(top[1] - at[1]) <= radius * (1.0 + 1e-12));
        for _ in 0..200 {
            let (r, angle) = (radius * uniform(&mut random, 0.0, 1.0).sqrt(), uniform(&mut random, -PI, PI));
            let z = ground.height([at[0] + r * angle.cos(), at[1] + r * angle.sin()]).unwrap();
            assert!(z <= top[2] + 1e-12);
        }
        let disk = Cylinder::new(0.5, radius);
        let start = to_parry([at[0], at[1], 3.0]);
        let pose = Pose::translation(start.x, start.y, start.z);
        let options = ShapeCastOptions::with_max_time_of_impact(10.0);
        let hit = query::cast_shapes(
            &Pose::IDENTITY,
            Vector::ZERO,
            ground.shape(),
            &pose,
            -Vector::Y,
            &disk,
            options,
        );
        let fall = hit.unwrap().unwrap().time_of_impact;
        assert!((2.5 - fall - top[2]).abs() < SOLVER, "{} {}", 2.5 - fall, top[2]);
        // The sweep of the same cylinder.
        let body = Body::Cylinder { radius, height: 1.0 };
        let Sight::Blocked { distance, .. } =
            ground.sweep(&body, [at[0], at[1], 3.0], [at[0], at[1], -7.0]).unwrap()
        else {
            panic!("the ground is in the way")
        };
        assert!((distance - fall).abs() < SOLVER);
    }
}

#[test]
fn lines_of_sight_agree_with_parry() {
    let ground = Ground::new(&rough(5, 61, 0.5, 0.5)).unwrap();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(6);
    let mut clear = 0;
    for _ in 0..2000 {
        let mut point = |low, high| {
            let [x, y] = [0; 2].map(|_| uniform(&mut random, -14.9, 14.9));
            [x, y, uniform(&mut random, low, high)]
        };
        let (from, to) = (point(0.6, 3.0), point(-0.6, 1.0));
        let ray = Ray::new(to_parry(from), to_parry(to) - to_parry(from));
        let met = ground.shape().cast_local_ray(&ray, 1.0, false);
        match (met, ground.line_of_sight(from, to)) {
            (None, Sight::Clear) => clear += 1,
            (Some(t), Sight::Blocked { point, distance }) => {
                assert!((distance - t * ray.dir.length()).abs() < 1e3 * ROUNDING);
                assert!((ground.height([point[0], point[1]]).unwrap() - point[2]).abs() < 1e3 * ROUNDING);
            }
            other => panic!("{other:?}"),
        }
    }
    assert!((200..1800).contains(&clear), "{clear}");
}

#[test]
fn a_wall_blocks_and_the_first_one_counts() {
    // Ridges 2 m and 4 m high along x = -2 and x = 3, their flanks one pixel wide.
    let ridges = |x: f64, _: f64| match x {
        -2.0 => 2.0,
        3.0 => 4.0,
        _ => 0.0,
    };
    let ground = ground(11, 21, 1.0, ridges);
    let see = |z0, z1| ground.line_of_sight([-8.0, 0.3, z0], [8.0, 0.3, z1]);
    assert_eq!(see(4.0, 4.0), Sight::Clear);
    let Sight::Blocked { point, distance } = see(1.0, 1.0) else { panic!() };
    assert!((point[0] + 2.5).abs() < ROUNDING && (distance - 5.5).abs() < ROUNDING);
    let Sight::Blocked { point, distance } = see(3.0, 3.0) else { panic!() };
    assert!((point[0] - 2.75).abs() < ROUNDING && (distance - 10.75).abs() < ROUNDING);
    // From the ground, along the ground, out of the ground.
    assert_eq!(ground.line_of_sight([-8.0, 0.0, 0.0], [-4.0, 3.0, 0.0]), Sight::Clear);
    assert_eq!(ground.line_of_sight([-8.0, 0.0, 0.0], [-8.0, 0.0, 90.0]), Sight::Clear);
    let Sight::Blocked { distance, .. } = ground.line_of_sight([-8.0, 0.0, -0.5], [-8.0, 0.0, 90.0]) else {
        panic!()
    };
    assert_eq!(distance, 0.0);
    let path = [[-8.0, 0.3, 3.0], [0.0, 0.3, 3.0], [0.0, 2.0, 3.0], [8.0, 2.0, 5.0]];
    let least = ground.path_clearance(&path).unwrap();
    assert!((least.height - (3.0 + 2.0 * 3.0 / 8.0 - 4.0)).abs() < ROUNDING);
    assert!((least.distance - (8.0 + 1.7 + 3.0 / 8.0 * 68.0_f64.sqrt())).abs() < ROUNDING);
    assert!((least.point[0] - 3.0).abs() < ROUNDING);
    assert_eq!(ground.path_clearance(&[]), None);
    assert_eq!(ground.path_clearance(&[[3.0, 0.0, 5.0]]).unwrap().height, 1.0);
}

#[test]
fn gaps_and_the_outside_are_unknown() {
    let mut relative = map(21, 21, 1.0, |_, _| 0.0).relative().clone();
    let index = relative.geometry().index(10, 10);
    relative.data_mut()[index] = f32::NAN;
    let ground = Ground::new(&ElevationMap::from_relative(relative, -50.0).unwrap()).unwrap();
    assert_eq!(ground.height([0.0, 0.0]), None);
    assert_eq!(ground.height([0.9, -0.9]), None);
    assert_eq!(ground.height([1.1, -0.9]), Some(-50.0));
    assert_eq!(ground.highest_under([3.0, 0.0], 1.9).map(|p| p[2]), Some(-50.0));
    assert_eq!(ground.highest_under([3.0, 0.0], 2.1), None);
    assert_eq!(ground.highest_under([9.0, 0.0], 1.1), None);
    assert!(ground.touchdown(&POINTS, [2.5, 0.0], 0.0).unwrap().is_none());
    assert!(ground.touchdown(&POINTS, [0.0, 0.0], 0.0).unwrap().is_some());
    assert!(ground.touchdown(&PADS, [0.0, 0.0], 0.0).unwrap().is_none(), "the hole is under the belly");
    assert!(ground.touchdown(&POINTS, [8.0, 0.0], 0.0).unwrap().is_none());
    let see = |from, to| ground.line_of_sight(from, to);
    let hole = Sight::Unknown { point: [-1.0, 0.0, -40.0], distance: 4.0 };
    assert_eq!(see([-5.0, 0.0, -40.0], [5.0, 0.0, -40.0]), hole);
    assert_eq!(see([-5.0, 2.0, -40.0], [5.0, 2.0, -40.0]), Sight::Clear);
    let edge = Sight::Unknown { point: [10.0, 2.0, -40.0], distance: 15.0 };
    assert_eq!(see([-5.0, 2.0, -40.0], [15.0, 2.0, -40.0]), edge);
    assert!(matches!(see([-5e300, 2.0, 0.0], [5.0, 2.0, 0.0]), Sight::Unknown { .. }));
    assert!(matches!(see([5.0, 2.0, f64::NAN], [5.0, 2.0, 0.0]), Sight::Unknown { .. }));
    assert_eq!(ground.path_clearance(&[[-5.0, 0.0, 0.0], [5.0, 0.0, 0.0]]), None);
    let ball = Body::Ball { radius: 0.5 };
    let sweep = |from, to| ground.sweep(&ball, from, to).unwrap();
    assert!(matches!(sweep([-5.0, 0.0, -40.0], [5.0, 0.0, -40.0]), Sight::Unknown { .. }));
    assert_eq!(sweep([-5.0, 4.0, -40.0], [5.0, 4.0, -40.0]), Sight::Clear);
    assert!(matches!(sweep([-5.0, 4.0, -40.0], [9.8, 4.0, -40.0]), Sight::Unknown { .. }));
    assert!(matches!(sweep([-5.0, 4.0, -49.0], [-5.0, 4.0, -60.0]), Sight::Blocked { .. }));
    assert!(
        matches!(sweep([-5.0, 4.0, -49.6], [-5.0, 4.0, -49.6]), Sight::Blocked { distance, .. } if distance == 0.0)
    );
}

#[test]
fn ill_posed_requests_are_refused() {
    let flat = ground(5, 5, 1.0, |_, _| 0.0);
    let number =
        |result: Result<Option<Touchdown>, TerrainError>| matches!(result, Err(TerrainError::Number { .. }));
    for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(number(flat.touchdown(&Lander { pad_distance: value, ..POINTS }, [0.0; 2], 0.0)));
        let belly = Some(LowerFace { radius: value, height: 1.0 });
        assert!(number(flat.touchdown(&Lander { belly, ..POINTS }, [0.0; 2], 0.0)));
        assert!(flat.sweep(&Body::Ball { radius: value }, [0.0; 3], [0.0; 3]).is_err());
    }
    assert!(number(flat.touchdown(&Lander { pad_radius: -1.0, ..POINTS }, [0.0; 2], 0.0)));
    assert!(number(flat.touchdown(&POINTS, [f64::NAN, 0.0], 0.0)));
    assert!(number(flat.touchdown(&POINTS, [0.0, 0.0], f64::INFINITY)));
    assert!(flat.sweep(&Body::Ball { radius: 1.0 }, [f64::NAN; 3], [0.0; 3]).is_err());
    assert!(matches!(Ground::new(&map(1, 5, 1.0, |_, _| 0.0)), Err(TerrainError::Number { .. })));
    assert!(matches!(Ground::new(&map(5, 5, 1.0, |_, _| f64::NAN)), Err(TerrainError::Empty { .. })));
    let oblong = Geometry::new(3, 3, [1.0, 2.0], [0.0; 2], crate::MapUnit::Metre).unwrap();
    let oblong = ElevationMap::from_heights(oblong, &[0.0; 9]).unwrap();
    assert!(matches!(Ground::new(&oblong), Err(TerrainError::Pixel { .. })));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn a_vertical_shift_changes_nothing(seed in 0_u64..1000, shift in -4000_i32..4000, heading in -3.0..3.0_f64) {
        let map = rough(seed, 41, 0.25, 0.25);
        let lifted = map.relative().map(|z| z + (shift as f32) / 1024.0);
        let [low, high] = [
            Ground::new(&map).unwrap(),
            Ground::new(&ElevationMap::from_relative(lifted, 300.0).unwrap()).unwrap(),
        ];
        let by = f64::from(shift) / 1024.0 + 300.0;
        let (a, b) = (down(&low, &PADS, [0.2, 0.1], heading), down(&high, &PADS, [0.2, 0.1], heading));
        prop_assert_eq!(a.rests.len(), b.rests.len());
        for (a, b) in a.rests.iter().zip(&b.rests) {
            prop_assert!((a.tilt - b.tilt).abs() < 1e3 * ROUNDING);
            prop_assert!((a.middle[2] + by - b.middle[2]).abs() < 1e3 * ROUNDING);
            prop_assert!((a.clearance.unwrap() - b.clearance.unwrap()).abs() < 1e3 * ROUNDING);
            prop_assert_eq!(a.pads, b.pads);
        }
    }

    #[test]
    fn a_quarter_turn_renames_the_pads(seed in 0_u64..1000, heading in -3.0..3.0_f64) {
        let ground = Ground::new(&rough(seed, 41, 0.25, 0.25)).unwrap();
        let a = down(&ground, &PADS, [0.2, 0.1], heading);
        let b = down(&ground, &PADS, [0.2, 0.1], heading + FRAC_PI_2);
        prop_assert_eq!(a.rests.len(), b.rests.len());
        for k in 0..4 {
            prop_assert!((a.pad_heights[(k + 1) % 4] - b.pad_heights[k]).abs() < 1e3 * ROUNDING);
        }
        for (a, b) in a.rests.iter().zip(&b.rests) {
            prop_assert!((a.tilt - b.tilt).abs() < 1e3 * ROUNDING);
            prop_assert!((a.roll - b.pitch).abs() < 1e3 * ROUNDING && (a.pitch + b.roll).abs() < 1e3 * ROUNDING);
            for k in 0..4 {
                prop_assert_eq!(a.pads[(k + 1) % 4], b.pads[k]);
            }
        }
    }

    #[test]
    fn path_clearance_is_the_least_of_its_samples(seed in 0_u64..1000) {
        let ground = Ground::new(&rough(seed, 41, 0.5, 0.5)).unwrap();
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let path = [(); 4].map(|()| [9.9, 9.9, 2.0].map(|limit| uniform(&mut random, -limit, limit)));
        let least = ground.path_clearance(&path).unwrap();
        let z = ground.height([least.point[0], least.point[1]]).unwrap();
        prop_assert!((least.point[2] - z - least.height).abs() < 1e3 * ROUNDING);
        let mut sampled = f64::INFINITY;
        for pair in path.windows(2) {
            for k in 0..=2000 {
                let t = f64::from(k) / 2000.0;
                let p = [0, 1, 2].map(|i| pair[0][i] + t * (pair[1][i] - pair[0][i]));
                sampled = sampled.min(p[2] - ground.height([p[0], p[1]]).unwrap());
            }
        }
        prop_assert!((-1e-9..0.05).contains(&(sampled - least.height)), "{} {}", sampled, least.height);
    }
}
