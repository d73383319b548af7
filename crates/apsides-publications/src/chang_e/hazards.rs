//! The paper's rule for a landing site on an elevation map, beside criteria on slope, roughness and footpads.
//!
//! Coarse: a pixel is safe within 50 m of the plane of least median of squares and off the edges that Canny's detector finds with the threshold
//! 0.4; the site is the first safe one on the clockwise spiral from the middle. Fine: the median angle between the normals of pairs of pixels
//! within a radius and the plane's normal is below 2 deg besides. These are the presets `contest-coarse` and `contest-fine` of the program. Maps are
//! generated, so that what a site is like is known.

use apsides_terrain::TerrainError;
use apsides_terrain::hazard::{
    HazardMap, HazardOptions, Layer, LayerChoice, SiteCriteria, Verdict, hazard_map, hazard_map_with,
};
use apsides_terrain::site::{SiteRequest, choose_sites};
use apsides_terrain::synthetic::{Synthetic, Terrain};

use crate::Error;
use crate::sheet::Sheet;
use crate::stop::Stop;

/// Pixels on each side of the maps, and their seeds.
const SIDE: usize = 400;
const SEEDS: [u64; 3] = [1, 2, 3];
/// The column of what is called safe and is not.
pub(super) const FALSE_SAFE: &str = "false_safe_percent";

/// A kind of map with the criteria that it is held against.
struct Height {
    name: &'static str,
    terrain: fn() -> Terrain,
    /// The paper's rule, and ours.
    contest: SiteCriteria,
    criteria: SiteCriteria,
}

const HEIGHTS: [Height; 2] = [
    Height {
        name: "coarse, 1 m",
        terrain: Terrain::coarse,
        contest: SiteCriteria::CONTEST_COARSE,
        criteria: SiteCriteria::CHANG_E_3_COARSE,
    },
    Height {
        name: "fine, 0.1 m",
        terrain: Terrain::fine,
        contest: SiteCriteria::CONTEST_FINE,
        criteria: SiteCriteria::CHANG_E_3_FINE,
    },
];

pub(super) fn sheet() -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "hazards",
        "Hazard avoidance on generated maps of 400 x 400 pixels: the paper's rule (unsafe) beside slope, footpads and roughness",
        "map, rule",
        &[
            ("safe_percent", 1),
            (FALSE_SAFE, 1),
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
    sheet.findings.push(
        "the paper's rule: `apsides hazard MAP --criteria contest-fine --rule spiral`; in flight `apsides solve chang-e-3 --set terrain.rule=spiral --set \
         terrain.coarse_criteria=contest-coarse --set terrain.fine_criteria=contest-fine`, which says that it is unsafe"
            .into(),
    );
    Ok(sheet)
}

/// The rows of one map; true if the site by the paper's rule keeps all limits.
fn rows(sheet: &mut Sheet, height: &Height, seed: u64) -> Result<bool, TerrainError> {
    let map = Synthetic::new(Terrain { rows: SIDE, cols: SIDE, ..(height.terrain)() }, seed)?.map()?;
    let layers = LayerChoice::These(vec![Layer::Slope, Layer::FootpadSlope, Layer::Roughness]);
    let options = HazardOptions { layers, ..HazardOptions::default() };
    let ours = hazard_map_with(&map, &height.criteria, &options)?;
    let theirs = hazard_map(&map, &height.contest)?;
    let is_safe = |hazards: &HazardMap, k: usize| hazards.verdict().data().get(k) == Some(&Verdict::Safe);
    let known = |k: &usize| ours.verdict().data().get(*k) != Some(&Verdict::Unknown);
    let (mut all, mut safe, mut wrong, mut kept) = (0.0, 0.0, 0.0, 0.0);
    for k in (0..SIDE * SIDE).filter(known) {
        let keeps = f64::from(u8::from(is_safe(&ours, k)));
        all += 1.0;
        kept += keeps;
        if is_safe(&theirs, k) {
            safe += 1.0;
            wrong += 1.0 - keeps;
        }
    }
    let mut push = |name: &str, part: f64, wrong: Option<f64>, hazards: &HazardMap| {
        let site = choose_sites(&map, hazards, &SiteRequest::default())?.sites.into_iter().next();
        let place = site.as_ref().map(|s| [s.row, s.col]);
        let layer = |layer: Layer| {
            let [row, col] = place?;
            Some(layer.in_unit(f64::from(ours.layer(layer)?.get(row, col)))).filter(|v| v.is_finite())
        };
        let values = vec![
            Some(100.0 * part),
            wrong,
            site.as_ref().map(|s| s.divert_m),
            layer(Layer::Slope),
            layer(Layer::FootpadSlope),
            layer(Layer::Roughness),
            place.map(|[row, col]| f64::from(ours.clearance().get(row, col))),
        ];
        sheet.push(format!("{}, map {seed}, {name}", height.name), values);
        Ok::<_, TerrainError>(place.is_some_and(|[row, col]| ours.verdict().get(row, col) == Verdict::Safe))
    };
    let keeps = push("paper", safe / all, (safe > 0.0).then(|| 100.0 * wrong / safe), &theirs)?;
    push("slope, footpads, roughness, clearance", kept / all, None, &ours)?;
    Ok(keeps)
}
