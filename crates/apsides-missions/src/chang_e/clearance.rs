//! The height above a map as a path constraint of a divert.

use apsides_ad::{PathFunction, Scalar};
use apsides_ocp::{Phase, Variable};
use apsides_pipeline::Error;
use apsides_terrain::interpolation::{HeightAbove, Smoothness, Surface};
use apsides_terrain::synthetic::Terrain;

use super::divert::Divert;
use super::keys::MapKeys;
use super::landing::SixStageLanding;
use super::terrain::SiteMap;

/// The position over a map of a flight in the vertical plane of a divert, which starts above the middle of the map.
struct AlongDivert {
    /// Position of the middle, m, and the height of the map there.
    middle: [f64; 2],
    level: f64,
    /// Distance of the ground below the start from the centre, and the radius that angles are multiplied with, m.
    ground_radius: f64,
    radius: f64,
    course: f64,
}

impl PathFunction<5, 2, 3> for AlongDivert {
    /// States in the order of `VerticalPlaneThrust::STATES`.
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 5], _u: &[S; 2], _p: &[S; 0]) -> [S; 3] {
        let [radius, angle, ..] = *x;
        let (sin, cos) = self.course.sin_cos();
        let [east, north] = self.middle;
        let way = angle * self.radius;
        [way * sin + east, way * cos + north, radius + (self.level - self.ground_radius)]
    }
}

impl SixStageLanding {
    /// The phase of a divert, held above the map that its site is on where the mission says so. `ground_radius` is the distance of the ground
    /// below its start from the centre, m.
    pub(super) fn above_map(
        &self,
        phase: Phase,
        (map, keys, terrain): (&SiteMap, &MapKeys, Terrain),
        divert: &Divert,
        ground_radius: f64,
    ) -> Result<Phase, Error> {
        let Some(clearance) = map.clearance.filter(|_| divert.is_needed()) else { return Ok(phase) };
        let Some(elevations) = map.map(keys, terrain, self.seed)? else { return Ok(phase) };
        let geometry = *elevations.geometry();
        let [row, col] = [geometry.rows() / 2, geometry.cols() / 2];
        let Some(level) = elevations.height(row, col) else {
            return Err(Error::in_mission(format!(
                "`{}`: nothing is known of the ground in the middle",
                keys.map
            )));
        };
        let position = AlongDivert {
            middle: geometry.position(row as f64, col as f64),
            level,
            ground_radius,
            radius: self.lander.body.radius,
            course: divert.course,
        };
        let surface = Surface::new(&elevations, Smoothness::C2).map_err(Error::model)?;
        let height = Variable::new(format!("height above the {} map", keys.name), "m");
        Ok(phase.path::<_, 5, 2, 1, 0>(
            [height.at_least(clearance).scaled_by(100.0)],
            HeightAbove::new(surface, position),
        ))
    }
}
