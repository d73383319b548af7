use super::*;
use crate::Geometry;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-12;

/// A level map of 61 x 61 m with a step of 1 m at the pixel in its middle.
fn map(step: f64) -> ElevationMap {
    let geometry = Geometry::square(61, 61, 1.0).unwrap();
    let heights: Vec<f64> = (0..61 * 61).map(|k| if k == 61 * 30 + 30 { step } else { 0.0 }).collect();
    ElevationMap::from_heights(geometry, &heights).unwrap()
}

fn request(map: ElevationMap) -> SelectionRequest {
    let criteria = SiteCriteria {
        footprint_radius_m: 2.0,
        footpad_circle_radius_m: 1.5,
        footpad_radius_m: 0.0,
        headings: 18,
        slope_max_deg: Some(8.0),
        footpad_slope_max_deg: None,
        roughness_max_m: Some(0.1),
        roughness_rms_max_m: None,
        step_max_m: None,
        belly: None,
        relative_elevation_max_m: None,
        normals: None,
        edges_max: None,
        clearance_min_m: 1.0,
    };
    SelectionRequest {
        name: "level",
        map,
        criteria,
        rule: SelectionRule::Weighed,
        candidates: 12,
        separation: 4.0,
        hazard_worth: 1.0,
        divert_cost: 0.01,
        lander: Lander { pad_distance: 1.5, pad_radius: 0.0, centre_of_mass_height: 1.0, belly: None },
    }
}

/// 0.01 kg for a metre, eastwards alone.
fn eastwards([east, north, _]: [f64; 3]) -> Result<Divert, TerrainError> {
    let unreached = (east < 0.0).then(|| Unreached {
        reason: format!("target out of reach by {:.2} m", -east),
        distance: Some(-east),
    });
    Ok(Divert { propellant: Some(0.01 * east.hypot(north)), flight_time: 10.0, unreached })
}

#[test]
fn the_cheapest_site_within_reach_is_taken() {
    let selection = select_site(request(map(1.0)), &|_| true, eastwards).unwrap().unwrap();
    let site = selection.site();
    assert!(site.offset[0] >= 0.0 && site.tilt == Some(0.0), "{site:?}");
    // The ground below is on top of the step.
    assert_eq!(site.offset[2], -1.0);
    let costs: Vec<f64> = selection.candidates.iter().filter_map(|c| c.cost).collect();
    assert!(costs.is_sorted() && costs.len() < selection.candidates.len());
    assert_eq!(selection.candidates.len(), 12);
    assert!(selection.below_verdict().starts_with("unsafe, "), "{}", selection.below_verdict());
}

/// The first safe pixel of the spiral from the step in the middle on which the lander stands. The step of 1 m spoils the disks of 2 m around
/// it, so that the first candidate is 2 m east and 1 m north of it; from there a pad of the circle of 1.5 m comes so near to the step that the lander
/// tilts.
#[test]
fn the_first_on_the_spiral_within_reach_is_taken() {
    let spiral = || SelectionRequest { rule: SelectionRule::Spiral, ..request(map(1.0)) };
    let anywhere = |offset: [f64; 3]| Ok::<_, TerrainError>(Divert { unreached: None, ..eastwards(offset)? });
    let first = select_site(spiral(), &|_| true, anywhere).unwrap().unwrap();
    let visited: Vec<u64> = first.candidates.iter().map(|c| c.site.visited).collect();
    assert!(visited.is_sorted(), "{visited:?}");
    let most = first.hazards.criteria().tilt_at_rest_max();
    assert_eq!(first.candidates[0].offset, [2.0, 1.0, -1.0]);
    assert!(first.candidates[..first.chosen].iter().all(|c| c.tilt.is_none_or(|tilt| tilt > most)));
    assert!(first.site().tilt.unwrap() <= most);
    // What flights do not reach is tried last.
    let reached = select_site(spiral(), &|_| true, eastwards).unwrap().unwrap();
    assert!(reached.site().offset[0] >= 0.0);
    let costs: Vec<bool> = reached.candidates.iter().map(|c| c.cost.is_none()).collect();
    assert!(costs.is_sorted() && costs.contains(&true), "{costs:?}");
    // The hazard of a site does not depend on the rule.
    let weighed = select_site(request(map(1.0)), &|_| true, anywhere).unwrap().unwrap();
    let hazards = |s: &SiteSelection| -> Vec<(u64, f64)> {
        s.candidates.iter().map(|c| (c.site.visited, c.hazard)).collect()
    };
    let of_weighed = hazards(&weighed);
    let both = hazards(&first).into_iter().filter_map(|(k, h)| {
        let other = of_weighed.iter().find(|(other, _)| *other == k)?;
        Some((h, other.1))
    });
    assert!(
        both.clone().count() > 0 && both.clone().all(|(a, b)| (a - b).abs() < ROUNDING),
        "{of_weighed:?}"
    );
}

#[test]
fn what_keeps_a_map_from_having_a_site_is_said() {
    let none = |request| select_site(request, &|_| true, eastwards).unwrap().unwrap_err();
    assert_eq!(none(request(map(f64::NAN))), NoSite::NothingBelow);
    let criteria = SiteCriteria { clearance_min_m: 40.0, ..request(map(1.0)).criteria };
    let wide = none(SelectionRequest { criteria, ..request(map(1.0)) });
    assert!(matches!(wide, NoSite::NoRoom { required: 40.0, .. }), "{wide}");
    let nowhere = |_| {
        let unreached = Some(Unreached { reason: "no flight".into(), distance: None });
        Ok::<_, TerrainError>(Divert { propellant: None, flight_time: 10.0, unreached })
    };
    let far = select_site(request(map(1.0)), &|_| true, nowhere).unwrap().unwrap_err().to_string();
    assert!(far.starts_with("none of 12 safe sites is within reach; the nearest to it, "), "{far}");
    assert!(far.ends_with("m away): no flight"), "{far}");
    let hilly: Vec<f64> = (0..61 * 61).map(|k| f64::from(k % 7) * 0.5).collect();
    let hilly = ElevationMap::from_heights(*map(0.0).geometry(), &hilly).unwrap();
    let rough = none(request(hilly)).to_string();
    assert!(rough.starts_with("no safe site among") && rough.ends_with("would allow it"), "{rough}");
}

#[test]
fn a_choice_that_is_ended_names_the_best_so_far() {
    use std::sync::atomic::{AtomicUsize, Ordering};
    let ended_after = |questions: usize| {
        let left = AtomicUsize::new(questions);
        let watch = |_| left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| n.checked_sub(1)).is_ok();
        select_site(request(map(1.0)), &watch, eastwards).unwrap().unwrap_err()
    };
    let early = ended_after(0);
    assert_eq!(early, NoSite::Ended { candidates: 0, planned: 0, best: None });
    assert!(early.to_string().ends_with("before all of it was assessed"), "{early}");
    // One question for the only tile of the map, one after it, one before each flight.
    let late = ended_after(2 + 7);
    assert!(matches!(&late, NoSite::Ended { candidates: 12, planned: 7, best: Some(_) }), "{late:?}");
    assert!(
        late.to_string().contains("7 of 12 flights to safe sites are planned, the best until then "),
        "{late}"
    );
    let none = ended_after(2);
    assert!(none.to_string().ends_with("none of them within reach"), "{none}");
}
