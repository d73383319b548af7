//! The paper's rule for a landing site on an elevation map, beside criteria on slope, roughness and footpads.
//!
//! Coarse: a pixel is safe within 50 m of the plane of least median of squares and off the edges that Canny's detector finds with the threshold
//! 0.4; the site is the first safe one on the clockwise spiral from the middle. Fine: the median angle between the normals of pairs of pixels
//! within a radius and the plane's normal is below 2 deg besides. Maps are generated, so that what a site is like is known.

use apsides_terrain::hazard::{
    HazardOptions, Layer, LayerChoice, Plane, RobustFit, SiteCriteria, Verdict, hazard_map_with,
    median_normal_angle,
};
use apsides_terrain::site::spiral;
use apsides_terrain::synthetic::{Synthetic, Terrain};
use apsides_terrain::{ElevationMap, Raster, TerrainError};

use super::edges::edges;
use crate::Error;
use crate::sheet::Sheet;
use crate::stop::Stop;

/// Largest height above or below the plane, m.
const RELATIVE_M: f64 = 50.0;
/// Largest median angle of normals, deg, and radius of their pairs, pixels.
const NORMAL_DEG: f64 = 2.0;
const NORMAL_PIXELS: f64 = 5.0;
/// Pixels on each side of the maps, and their seeds.
const SIDE: usize = 400;
const SEEDS: [u64; 3] = [1, 2, 3];
/// Every so many rows and columns are looked at for the parts of a map.
const STRIDE: usize = 7;

/// A kind of map with the criteria that it is held against.
struct Height {
    name: &'static str,
    terrain: fn() -> Terrain,
    criteria: SiteCriteria,
    normals: bool,
}

const HEIGHTS: [Height; 2] = [
    Height {
        name: "coarse, 1 m",
        terrain: Terrain::coarse,
        criteria: SiteCriteria::CHANG_E_3_COARSE,
        normals: false,
    },
    Height {
        name: "fine, 0.1 m",
        terrain: Terrain::fine,
        criteria: SiteCriteria::CHANG_E_3_FINE,
        normals: true,
    },
];

/// The paper's verdict on pixels of a map.
struct Rule<'a> {
    map: &'a ElevationMap,
    plane: Plane,
    edges: Raster<bool>,
    normals: bool,
}

impl Rule<'_> {
    fn is_safe(&self, row: usize, col: usize) -> Result<bool, TerrainError> {
        let geometry = self.map.geometry();
        let Some(height) = self.map.height(row, col) else { return Ok(false) };
        let position = geometry.position(row as f64, col as f64);
        if (height - self.plane.height_at(position)).abs() >= RELATIVE_M || self.edges.get(row, col) {
            return Ok(false);
        }
        if !self.normals {
            return Ok(true);
        }
        let pixel = geometry.square_pixel()?;
        let angle = median_normal_angle(self.map, &self.plane, row, col, NORMAL_PIXELS * pixel)?;
        Ok(angle.is_some_and(|a| a < NORMAL_DEG.to_radians()))
    }
}

pub(super) fn sheet() -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "hazards",
        "Hazard avoidance on generated maps of 400 x 400 pixels: the paper's rule (unsafe) beside slope, footpads and roughness",
        "map, rule",
        &[
            ("safe_percent", 1),
            ("false_safe_percent", 1),
            ("divert_m", 1),
            ("slope_deg", 2),
            ("footpad_slope_deg", 2),
            ("roughness_m", 2),
            ("clearance_m", 1),
        ],
    );
    let mut unsafe_sites = 0;
    for height in &HEIGHTS {
        for seed in SEEDS {
            unsafe_sites +=
                usize::from(!rows(&mut sheet, height, seed).map_err(|e| Error::in_mission(e.to_string()))?);
        }
    }
    sheet.findings.push(format!(
        "the paper's rule chooses ground that breaks a limit of slope, footpads or roughness on {unsafe_sites} of {} maps: heights within 50 m of a \
         plane exclude nothing on a map of this size, and an angle from the plane of the map is not one from gravity",
        HEIGHTS.len() * SEEDS.len()
    ));
    sheet.findings.push(
        "false safe: pixels that the paper's rule calls safe and that break a limit; maps have no errors, so that limits are held against the \
         ground itself"
            .into(),
    );
    Ok(sheet)
}

/// The rows of one map; true if the site by the paper's rule keeps all limits.
fn rows(sheet: &mut Sheet, height: &Height, seed: u64) -> Result<bool, TerrainError> {
    let map = Synthetic::new(Terrain { rows: SIDE, cols: SIDE, ..(height.terrain)() }, seed)?.map()?;
    let layers = LayerChoice::These(vec![Layer::Slope, Layer::FootpadSlope, Layer::Roughness]);
    let hazards =
        hazard_map_with(&map, &height.criteria, &HazardOptions { layers, ..HazardOptions::default() })?;
    let plane = RobustFit::default().fit(&map)?.plane;
    let rule = Rule { map: &map, plane, edges: edges(map.relative())?, normals: height.normals };
    let pixel = map.geometry().square_pixel()?;
    let middle = [SIDE / 2; 2];
    let (mut all, mut safe, mut wrong, mut ours) = (0.0, 0.0, 0.0, 0.0);
    for row in (0..SIDE).step_by(STRIDE) {
        for col in (0..SIDE).step_by(STRIDE) {
            let verdict = hazards.verdict().get(row, col);
            if verdict == Verdict::Unknown {
                continue;
            }
            all += 1.0;
            ours += f64::from(u8::from(verdict == Verdict::Safe));
            if rule.is_safe(row, col)? {
                safe += 1.0;
                wrong += f64::from(u8::from(verdict != Verdict::Safe));
            }
        }
    }
    let mut keeps = false;
    let mut push = |name: &str, part: f64, wrong: Option<f64>, site: Option<[usize; 2]>| {
        let layer = |l: Layer, factor: f64| {
            let [row, col] = site?;
            Some(f64::from(hazards.layer(l)?.get(row, col)) * factor).filter(|v| v.is_finite())
        };
        let degrees = 180.0 / std::f64::consts::PI;
        let values = vec![
            Some(100.0 * part),
            wrong,
            site.map(|[r, c]| pixel * (r as f64 - middle[0] as f64).hypot(c as f64 - middle[1] as f64)),
            layer(Layer::Slope, degrees),
            layer(Layer::FootpadSlope, degrees),
            layer(Layer::Roughness, 1.0),
            site.map(|[r, c]| f64::from(hazards.clearance().get(r, c))),
        ];
        sheet.push(format!("{}, map {seed}, {name}", height.name), values);
    };
    let first = |is_safe: &dyn Fn(usize, usize) -> Result<bool, TerrainError>| {
        for [row, col] in spiral(middle, SIDE, SIDE) {
            if is_safe(row, col)? {
                return Ok::<_, TerrainError>(Some([row, col]));
            }
        }
        Ok(None)
    };
    let theirs = first(&|row, col| rule.is_safe(row, col))?;
    if let Some([row, col]) = theirs {
        keeps = hazards.verdict().get(row, col) == Verdict::Safe;
    }
    push("paper", safe / all, (safe > 0.0).then(|| 100.0 * wrong / safe), theirs);
    let least = height.criteria.clearance_min_m;
    let own = first(&|row, col| {
        Ok(f64::from(hazards.clearance().get(row, col)) >= least
            && hazards.verdict().get(row, col) == Verdict::Safe)
    })?;
    push("slope, footpads, roughness, clearance", ours / all, None, own);
    Ok(keeps)
}
