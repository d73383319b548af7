//! A landing against the maps that its sites were chosen on: clearance along the path, thresholds at the sites, rest on the four pads.

use apsides_dynamics::great_circle::{central_angle, initial_course};
use apsides_ocp::Trajectory;
use apsides_terrain::contact::Ground;
use apsides_terrain::hazard::Layer;
use apsides_terrain::site::selection::SiteSelection;
use apsides_verify::{Check, CheckKind};

use super::divert::Divert;
use super::flight_state::{Across, FlightState};
use super::keys::FINE;
use super::lander::Lander;
use super::landing::SixStageLanding;
use super::phases::{ADJUSTMENT, AVOIDANCE, DESCENT, FINE_AVOIDANCE};

/// Samples of a phase for the clearance of its path.
const SAMPLES: usize = 400;
/// Where the engine is cut off the path comes this near to the altitude of the cut-off: rough ground below the pads, by the height.
const CUTOFF_PART: f64 = 0.5;

/// A divert over a map: the phases that fly it, and where on the map it starts.
struct Leg {
    phases: &'static [&'static str],
    divert: Divert,
    /// Position on the map above which it starts, m, the height of the map there and the distance of that ground from the centre.
    start: [f64; 2],
    level: f64,
    ground_radius: f64,
    /// Least height above the ground, m.
    required: f64,
}

/// Checks of the certificate.
pub(super) fn of(landing: &SixStageLanding, sites: &[&SiteSelection], t: &Trajectory) -> Vec<Check> {
    let mut checks = Vec::new();
    for site in sites {
        let Ok(ground) = Ground::new(&site.map) else { continue };
        for leg in legs(landing, site, sites) {
            checks.extend(path_clearance(&landing.lander, site, &ground, &leg, t));
        }
        checks.extend(thresholds(site));
        checks.push(Check::new(
            format!("{} site: tilt at rest on four pads", site.name),
            CheckKind::Feasibility,
            site.site().tilt.map_or(f64::NAN, f64::to_degrees),
            site.hazards.criteria().tilt_at_rest_max().to_degrees(),
            "deg",
            "steepest of 18 headings",
        ));
    }
    checks
}

/// The phases that are flown over a map: over the coarse one the way to its site and, where there is no fine one, the rest.
fn legs(landing: &SixStageLanding, site: &SiteSelection, sites: &[&SiteSelection]) -> Vec<Leg> {
    let surface = landing.lander.body.radius;
    let (coarse, fine) = (landing.coarse_divert(), landing.fine_divert());
    let to_coarse = |start, level| Leg {
        phases: &[ADJUSTMENT, AVOIDANCE],
        divert: coarse,
        start,
        level,
        ground_radius: surface,
        required: CUTOFF_PART * (landing.hover_radius() - surface - coarse.rise),
    };
    let ground_radius = surface + coarse.rise;
    let to_fine = |start, level| Leg {
        phases: &[FINE_AVOIDANCE, DESCENT],
        divert: fine,
        start,
        level,
        ground_radius,
        required: CUTOFF_PART * (landing.cutoff_radius() - ground_radius - fine.rise),
    };
    let [row, col] = site.below;
    let below = site.map.geometry().position(row as f64, col as f64);
    let Some(level) = site.map.height(row, col) else { return Vec::new() };
    if site.name == FINE.name {
        return vec![to_fine(below, level)];
    }
    let mut legs = vec![to_coarse(below, level)];
    if !sites.iter().any(|s| s.name == FINE.name) {
        let chosen = &site.site().site;
        legs.push(to_fine(chosen.position_m, chosen.height_m));
    }
    legs
}

/// Thresholds of the criteria at a site.
fn thresholds(selection: &SiteSelection) -> Vec<Check> {
    let (site, criteria) = (&selection.site().site, selection.hazards.criteria());
    let at = format!("row {}, column {} of the {} map", site.row, site.col, selection.name);
    let check = |what: &str, value: f64, limit: f64, unit: &str| {
        let name = format!("{} site: {what}", selection.name);
        Check::new(name, CheckKind::Feasibility, value, limit, unit, at.clone())
    };
    let layers = site.layers.iter().filter_map(|(layer, value)| {
        let limit = criteria.limit(*layer).filter(|_| *layer != Layer::BellyClearance)?;
        Some(check(layer.name(), layer.in_unit(*value).abs(), layer.in_unit(limit), layer.unit()))
    });
    let lacking = (criteria.clearance_min_m - site.clearance_m).max(0.0);
    layers.chain([check("clearance lacking", lacking, 0.0, "m")]).collect()
}

/// The part of a required height above the ground that is lacking along the path; none where it is never above the map.
fn path_clearance(
    lander: &Lander,
    site: &SiteSelection,
    ground: &Ground,
    leg: &Leg,
    t: &Trajectory,
) -> Option<Check> {
    let ([east, north], required) = (leg.start, leg.required);
    let mut least: Option<(f64, String)> = None;
    for p in t.phases.iter().filter(|p| leg.phases.contains(&p.name.as_str())) {
        let times: Vec<f64> = (0..=SAMPLES).map(|k| p.time_at(k as f64 / SAMPLES as f64)).collect();
        let point = |time: f64| {
            let state = FlightState::at(lander.motion, p, time)?;
            let [x, y] = way(lander, state.across, &leg.divert);
            Some([east + x, north + y, leg.level + state.radius - leg.ground_radius])
        };
        // A path leaves the map sideways only above where it is watched.
        let points: Vec<[f64; 3]> = times.iter().filter_map(|t| point(*t)).collect();
        let inside =
            points.iter().position(|&[x, y, _]| ground.height([x, y]).is_some()).unwrap_or(points.len());
        let Some(clearance) = ground.path_clearance(&points[inside..]) else {
            if inside < points.len() {
                least = Some((f64::NAN, format!("phase `{}`: above a gap or beside the map", p.name)));
            }
            continue;
        };
        if least.as_ref().is_none_or(|(l, _)| clearance.height < *l) {
            let at = format!(
                "phase `{}`: {:.2} m above ground, {required:.2} m asked for",
                p.name, clearance.height
            );
            least = Some((clearance.height, at));
        }
    }
    let (height, at) = least?;
    let way = if leg.phases.contains(&ADJUSTMENT) { "to its site" } else { "to the ground" };
    let name = format!("{} map: height above the ground that is lacking on the way {way}", site.name);
    Some(Check::new(name, CheckKind::Feasibility, (required - height).max(0.0), 0.0, "m", at))
}

/// The way east and north of where a divert starts, m.
fn way(lander: &Lander, across: Across, divert: &Divert) -> [f64; 2] {
    let (course, angle) = match across {
        Across::Space { longitude, latitude, .. } => {
            let place = [longitude, latitude];
            (initial_course(divert.from, place), central_angle(divert.from, place))
        }
        Across::Divert { angle } | Across::Plane { angle, .. } => (divert.course, angle),
        // Above the end of the divert, or its start where it has no length.
        Across::Above => (divert.course, divert.angle),
    };
    let (sin, cos) = course.sin_cos();
    let way = angle * lander.body.radius;
    [way * sin, way * cos]
}
