//! Places on a map, and closed outlines of them.

/// Longitude and latitude, deg.
pub(super) type Place = [f64; 2];

/// A map that is true to scale at its middle: km to the east and to the north.
#[derive(Clone, Copy, Debug)]
pub(super) struct Map {
    pub(super) middle: Place,
    /// Radius of the planet, km.
    pub(super) radius: f64,
}

impl Map {
    /// East and north of the middle, km.
    pub(super) fn position(&self, place: Place) -> [f64; 2] {
        let east = wrapped(place[0] - self.middle[0]).to_radians() * self.middle[1].to_radians().cos();
        [east * self.radius, (place[1] - self.middle[1]).to_radians() * self.radius]
    }

    /// Distances (km) from the middle along a bearing (deg from north towards east) and to the right of it.
    pub(super) fn along(&self, bearing: f64, place: Place) -> [f64; 2] {
        let [east, north] = self.position(place);
        let (sin, cos) = bearing.to_radians().sin_cos();
        [east * sin + north * cos, east * cos - north * sin]
    }

    /// Bearing (deg from north towards east, 0 to 360) and distance (km) from the middle.
    pub(super) fn polar(&self, place: Place) -> [f64; 2] {
        let [east, north] = self.position(place);
        [east.atan2(north).to_degrees().rem_euclid(360.0), east.hypot(north)]
    }

    /// Distance (km) from the middle to the line through the places, closed; positive where the middle is inside.
    pub(super) fn depth(&self, outline: &[Place]) -> f64 {
        let mut nearest = f64::INFINITY;
        let mut inside = false;
        for ([ax, ay], [bx, by]) in edges(outline).map(|(a, b)| (self.position(a), self.position(b))) {
            let (dx, dy) = (bx - ax, by - ay);
            let square = dx * dx + dy * dy;
            let part = if square > 0.0 { (-(ax * dx + ay * dy) / square).clamp(0.0, 1.0) } else { 0.0 };
            nearest = nearest.min((ax + part * dx).hypot(ay + part * dy));
            // Each edge that crosses the half line to the east changes the side.
            if (ay > 0.0) != (by > 0.0) && ax - ay * dx / dy > 0.0 {
                inside = !inside;
            }
        }
        if inside { nearest } else { -nearest }
    }

    /// Distance (km) from the middle along a bearing (deg) to the line through the places, closed, which goes round the middle.
    pub(super) fn distance_along(&self, bearing: f64, outline: &[Place]) -> Option<f64> {
        let crossing = |(a, b): (Place, Place)| {
            let ([a, right_of_a], [b, right_of_b]) = (self.along(bearing, a), self.along(bearing, b));
            let crosses = (right_of_a > 0.0) != (right_of_b > 0.0);
            let at = a - right_of_a * (b - a) / (right_of_b - right_of_a);
            (crosses && at > 0.0).then_some(at)
        };
        edges(outline).filter_map(crossing).reduce(f64::max)
    }

    /// Area (km2) and centre of what the line through the places, closed, surrounds: on the cylindrical equal-area map, whose straight
    /// lines the edges are.
    pub(super) fn area(&self, outline: &[Place]) -> (f64, Place) {
        let sine = self.middle[1].to_radians().sin();
        let equal = |p: Place| {
            let east = wrapped(p[0] - self.middle[0]).to_radians();
            [east * self.radius, (p[1].to_radians().sin() - sine) * self.radius]
        };
        let (mut twice, mut moment) = (0.0, [0.0; 2]);
        for (a, b) in edges(outline).map(|(a, b)| (equal(a), equal(b))) {
            let cross = a[0] * b[1] - b[0] * a[1];
            twice += cross;
            moment = [0, 1].map(|k| moment[k] + cross * (a[k] + b[k]));
        }
        let [east, north] = moment.map(|m| m / (3.0 * twice) / self.radius);
        let centre = [self.middle[0] + east.to_degrees(), (sine + north).asin().to_degrees()];
        (0.5 * twice.abs(), centre)
    }
}

/// An angle in deg between -180 and 180.
fn wrapped(angle: f64) -> f64 {
    angle - 360.0 * (angle / 360.0).round()
}

fn edges(outline: &[Place]) -> impl Iterator<Item = (Place, Place)> + '_ {
    outline.iter().copied().zip(outline.iter().copied().cycle().skip(1))
}

#[cfg(test)]
mod tests {
    use super::{Map, Place};

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-12;

    const RADIUS: f64 = 6378.137;

    /// A square of 2 deg on the equator, with the date line in the middle.
    const SQUARE: [Place; 4] = [[179.0, -1.0], [-179.0, -1.0], [-179.0, 1.0], [179.0, 1.0]];

    #[test]
    fn the_area_is_that_on_the_sphere() {
        let map = Map { middle: [180.0, 0.0], radius: RADIUS };
        let (area, centre) = map.area(&SQUARE);
        // Between two parallels and two meridians: R^2 (sin b - sin a) (longitudes).
        let exact = RADIUS * RADIUS * 2.0 * 1f64.to_radians().sin() * 2f64.to_radians();
        assert!((area - exact).abs() < 1e3 * ROUNDING * exact, "{area}");
        assert!((centre[0] - 180.0).abs() < ROUNDING && centre[1].abs() < ROUNDING);
        // A triangle, whose centre is the mean of its corners on the map of equal areas.
        let (_, centre) = map.area(&[[180.0, 0.0], [-177.0, 0.0], [180.0, 3.0]]);
        assert!((centre[0] - 181.0).abs() < ROUNDING, "{centre:?}");
        let third = (3f64.to_radians().sin() / 3.0).asin().to_degrees();
        assert!((centre[1] - third).abs() < ROUNDING, "{centre:?}");
    }

    #[test]
    fn depths_have_a_sign() {
        let degree = RADIUS * 1f64.to_radians();
        let depth = |middle| Map { middle, radius: RADIUS }.depth(&SQUARE) / degree;
        assert!((depth([180.0, 0.0]) - 1.0).abs() < ROUNDING);
        assert!((depth([-179.75, 0.0]) - 0.75).abs() < ROUNDING);
        assert!((depth([180.0, 1.5]) + 0.5).abs() < ROUNDING);
        assert!((depth([176.0, 0.0]) + 3.0).abs() < ROUNDING);
    }

    #[test]
    fn bearings_count_from_north_towards_east() {
        let map = Map { middle: [10.0, 60.0], radius: RADIUS };
        let degree = RADIUS * 1f64.to_radians();
        let [bearing, distance] = map.polar([12.0, 60.0]);
        assert!((bearing - 90.0).abs() < ROUNDING && (distance - degree).abs() < 1e3 * ROUNDING);
        let [along, right] = map.along(45.0, [12.0, 61.0]);
        assert!((along - 2f64.sqrt() * degree).abs() < 1e3 * ROUNDING && right.abs() < 1e3 * ROUNDING);
        let square = [[8.0, 59.0], [12.0, 59.0], [12.0, 61.0], [8.0, 61.0]];
        assert!((map.distance_along(270.0, &square).unwrap_or(0.0) - degree).abs() < 1e3 * ROUNDING);
        assert_eq!(map.distance_along(270.0, &[[11.0, 59.0], [12.0, 59.0], [11.0, 61.0]]), None);
    }
}
