//! The part of the ground that a sensor above it sees.

use crate::light::fill;
use crate::ray::{Meets, Ray, RayGround};
use crate::{ElevationMap, Raster, TerrainError};

/// Line of sight of a lidar or a camera at a point (east, north, height; m): 1 where the centre of a pixel is seen, 0 where ground
/// stands in between, NaN in gaps and where it depends on a gap. The point may be outside the map.
///
/// Rays are compared with the ground as those of [`crate::light::cast_shadow`]; the sensor's range and field of view are not
/// considered.
///
/// # Errors
/// Pixels that are not square or in degrees, or a point that is not finite.
pub fn visible(map: &ElevationMap, sensor: [f64; 3]) -> Result<Raster<f32>, TerrainError> {
    let [east, north, height] = sensor;
    map.geometry().square_pixel()?;
    if let Some(&value) = sensor.iter().find(|x| !x.is_finite()) {
        return Err(TerrainError::Number {
            name: "place of the sensor, m",
            value,
            allowed: "it must be finite".into(),
        });
    }
    let ground = RayGround::new(map.relative());
    let to = map.geometry().row_col([east, north]);
    let eye = height - map.datum();
    fill(map, |row, col| {
        let z = f64::from(map.relative().get(row, col));
        if z.is_nan() {
            return f32::NAN;
        }
        let way = [to[0] - row as f64, to[1] - col as f64];
        let length = way[0].abs().max(way[1].abs());
        if length <= 1.0 {
            // Nothing between neighbouring centres: seen from above.
            return if eye > z { 1.0 } else { 0.0 };
        }
        let step = if way[0].abs() > way[1].abs() {
            [way[0].signum(), way[1] / length]
        } else {
            [way[0] / length, way[1].signum()]
        };
        let ray = Ray { from: [row, col], height: z, step, rise: (eye - z) / length, length };
        match ground.meets(&ray) {
            Meets::Nothing => 1.0,
            Meets::Ground => 0.0,
            Meets::Gap => f32::NAN,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Geometry;
    use crate::light::{Sun, cast_shadow};
    use crate::ray::tests::rough;

    /// From 20 m over column 0 a wall of 10 m at column 20 hides 20 m behind its edge.
    #[test]
    fn a_wall_hides_what_is_behind_it() {
        let heights: Vec<f64> = (0..9 * 61).map(|k| if k % 61 == 20 { 10.0 } else { 0.0 }).collect();
        let map = ElevationMap::from_heights(Geometry::square(9, 61, 1.0).unwrap(), &heights).unwrap();
        let seen = visible(&map, [0.0, -4.0, 20.0]).unwrap();
        let hidden: Vec<usize> = (0..61).filter(|&c| seen.get(4, c) == 0.0).collect();
        assert_eq!(hidden, (21..=40).collect::<Vec<_>>());
        // From the top of the wall everything is seen, from below the ground nothing.
        assert!(visible(&map, [20.0, -4.0, 10.5]).unwrap().row(4).iter().all(|s| *s == 1.0));
        assert!(visible(&map, [3.0, -4.0, -1.0]).unwrap().data().iter().all(|s| *s == 0.0));
    }

    /// From very far away the line of sight is that to the Sun.
    #[test]
    fn a_far_sensor_sees_what_the_sun_lights() {
        let map = rough(50, 60, true);
        let sun = Sun::new(2.1, 0.25).unwrap();
        let far = 1e9;
        let sensor = sun.direction().map(|x| far * x);
        let (seen, lit) = (visible(&map, sensor).unwrap(), cast_shadow(&map, &sun).unwrap());
        let differ = seen
            .data()
            .iter()
            .zip(lit.data())
            .filter(|(a, b)| a.is_nan() != b.is_nan() || (!a.is_nan() && a != b))
            .count();
        assert_eq!(differ, 0);
        assert!(seen.data().contains(&0.0) && seen.data().contains(&1.0));
    }

    #[test]
    fn a_sensor_at_no_place_is_refused() {
        let map = rough(5, 5, false);
        assert!(matches!(visible(&map, [0.0, f64::NAN, 1.0]), Err(TerrainError::Number { .. })));
    }
}
