//! A landing site that is chosen in flight: hazards of an elevation map, candidates, a divert to each, the best mix of safety and propellant.
//!
//! The caller is asked what a divert takes, who knows the lander. Map coordinates are horizontal distances from the pixel below the lander, to
//! the east and to the north, on great circles through it; heights count from the ground there.
//!
//! The cost of a candidate is `m - m_min + w h`, kg, with the propellant `m` of its divert, the least one of all candidates `m_min`, the hazard `h`
//! from 0 to 1 and the worth `w` of a site without hazard. The site is the first in order of cost on which the lander stands on its four pads
//! at every heading. By the other rule it is the first of them on the spiral from the pixel below the lander.

use super::{ScoreWeights, SiteRequest, SiteRule, choose_sites};
use crate::contact::{Ground, Lander};
use crate::hazard::{HazardMap, HazardOptions, Layer, SiteCriteria, Verdict, Watch, hazard_map_watched};
use crate::{ElevationMap, TerrainError};

mod candidate;
mod no_site;

pub use candidate::{Candidate, Divert, Unreached};
pub use no_site::NoSite;

use no_site::exceeded;

/// Headings of the footpads at which a touchdown is tried, in a quarter turn.
const HEADINGS: usize = 18;

/// The order in which candidates within reach are tried.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SelectionRule {
    /// The least sum of propellant and hazard first.
    #[default]
    Weighed,
    /// In the order of the clockwise square spiral from the pixel below the lander.
    Spiral,
}

/// The data that the choice of a site is made from.
#[derive(Clone, Debug)]
pub struct SelectionRequest {
    /// The name of the map in checks and files: `coarse`.
    pub name: &'static str,
    /// The map; the lander is above its middle.
    pub map: ElevationMap,
    /// The criteria that a site must meet.
    pub criteria: SiteCriteria,
    /// The order of the candidates.
    pub rule: SelectionRule,
    /// Number of candidates that diverts are planned to.
    pub candidates: usize,
    /// Least distance between candidates, m.
    pub separation: f64,
    /// Propellant that a site without any hazard is worth more than one that is just allowed, kg.
    pub hazard_worth: f64,
    /// Expected propellant of a divert by its length, kg/m: how far candidates are looked for.
    pub divert_cost: f64,
    /// Distance of the footpads, their radius and the centre of mass above them.
    pub lander: Lander,
}

/// A choice of a site.
#[derive(Clone, Debug)]
pub struct SiteSelection {
    /// The name of the map.
    pub name: &'static str,
    /// The map.
    pub map: ElevationMap,
    /// Its hazards.
    pub hazards: HazardMap,
    /// Row and column below the lander.
    pub below: [usize; 2],
    /// All candidates in the order in which they were tried, those within reach first.
    pub candidates: Vec<Candidate>,
    /// Index of the site among them.
    pub chosen: usize,
}

impl SiteSelection {
    /// The site.
    #[must_use]
    pub fn site(&self) -> &Candidate {
        &self.candidates[self.chosen]
    }

    /// Says whether the place below the lander is safe, or which threshold it breaks.
    #[must_use]
    pub fn below_verdict(&self) -> String {
        let [row, col] = self.below;
        match self.hazards.verdict().get(row, col) {
            Verdict::Safe => "safe".into(),
            Verdict::Unknown => "unknown".into(),
            Verdict::Unsafe(layer) => {
                let value = self.hazards.layer(layer).map_or(f64::NAN, |l| f64::from(l.get(row, col)));
                let limit = self.hazards.criteria().limit(layer).unwrap_or(f64::NAN);
                format!("unsafe, {}", exceeded(layer, value, limit))
            }
        }
    }
}

/// Chooses a site; the inner error says why there is none and what is nearest to one.
///
/// `divert` plans a flight to a place: east, north and up from the ground below the lander, m. `watch` may end the work, on the map and between
/// flights: then there is no site, and the best so far is named.
///
/// # Errors
/// A map, criteria or a lander that are ill-posed, and errors of `divert`.
pub fn select_site<E: From<TerrainError>>(
    request: SelectionRequest,
    watch: Watch<'_>,
    mut divert: impl FnMut([f64; 3]) -> Result<Divert, E>,
) -> Result<Result<SiteSelection, NoSite>, E> {
    let hazards = hazard_map_watched(&request.map, &request.criteria, &HazardOptions::default(), watch)?;
    if !watch(0) {
        return Ok(Err(NoSite::Ended { candidates: 0, planned: 0, best: None }));
    }
    let geometry = *request.map.geometry();
    let below = [geometry.rows() / 2, geometry.cols() / 2];
    let Some(ground) = request.map.height(below[0], below[1]) else {
        return Ok(Err(NoSite::NothingBelow));
    };
    let weights = ScoreWeights {
        margin: 0.5,
        clearance: 0.5,
        divert_per_m: request.divert_cost / request.hazard_worth,
    };
    let choice = choose_sites(
        &request.map,
        &hazards,
        &SiteRequest {
            rule: match request.rule {
                SelectionRule::Weighed => SiteRule::Score(weights),
                SelectionRule::Spiral => SiteRule::Spiral,
            },
            start: Some(below),
            count: request.candidates,
            separation_m: request.separation,
            rivals: 0,
        },
    )?;
    if choice.sites.is_empty() {
        return Ok(Err(no_safe_site(&request, &hazards, below)));
    }
    let origin = geometry.position(below[0] as f64, below[1] as f64);
    let number = choice.sites.len();
    let mut candidates: Vec<Candidate> = Vec::with_capacity(number);
    for site in choice.sites {
        if !watch(0) {
            let planned = candidates.len();
            let best =
                ranked(candidates, &request).into_iter().next().filter(|c| c.cost.is_some()).map(Box::new);
            return Ok(Err(NoSite::Ended { candidates: number, planned, best }));
        }
        let [east, north] = [0, 1].map(|k| site.position_m[k] - origin[k]);
        let offset = [east, north, site.height_m - ground];
        let divert = divert(offset)?;
        let hazard = 1.0 - weights.of_site(&hazards, site.row, site.col);
        candidates.push(Candidate { site, offset, divert, hazard, cost: None, tilt: None });
    }
    let mut candidates = ranked(candidates, &request);
    if candidates.iter().all(|c| c.cost.is_none()) {
        return Ok(Err(out_of_reach(candidates)));
    }
    let chosen = standing(&request, &mut candidates)?;
    let SelectionRequest { name, map, .. } = request;
    Ok(chosen.map(|chosen| SiteSelection { name, map, hazards, below, candidates, chosen }))
}

/// Candidates with their costs in the order of the rule; those out of reach are the last.
fn ranked(mut candidates: Vec<Candidate>, request: &SelectionRequest) -> Vec<Candidate> {
    let least = candidates.iter().filter_map(|c| c.divert.reached()).fold(f64::INFINITY, f64::min);
    for c in &mut candidates {
        c.cost = c.divert.reached().map(|propellant| propellant - least + request.hazard_worth * c.hazard);
    }
    let order = |c: &Candidate| match (c.cost, request.rule) {
        (None, _) => f64::INFINITY,
        (Some(cost), SelectionRule::Weighed) => cost,
        (Some(_), SelectionRule::Spiral) => c.site.visited as f64,
    };
    candidates.sort_by(|a, b| order(a).total_cmp(&order(b)));
    candidates
}

/// The first candidate within reach on which the lander stands on its pads, whatever its heading.
fn standing(
    request: &SelectionRequest,
    candidates: &mut [Candidate],
) -> Result<Result<usize, NoSite>, TerrainError> {
    let ground = Ground::new(&request.map)?;
    let most = request.criteria.tilt_at_rest_max();
    let mut tried = 0;
    for (k, c) in candidates.iter_mut().enumerate().filter(|(_, c)| c.cost.is_some()) {
        tried += 1;
        c.tilt = steepest(&ground, &request.lander, c.site.position_m)?;
        if c.tilt.is_some_and(|tilt| tilt <= most) {
            return Ok(Ok(k));
        }
    }
    let least = candidates.iter().filter_map(|c| c.tilt).min_by(f64::total_cmp);
    Ok(Err(NoSite::NoStance { tried, most, least }))
}

/// Largest tilt of a lander at rest over all headings, rad; none if it topples or stands on a gap at one of them.
fn steepest(ground: &Ground, lander: &Lander, position: [f64; 2]) -> Result<Option<f64>, TerrainError> {
    let mut worst: f64 = 0.0;
    for k in 0..HEADINGS {
        let heading = std::f64::consts::FRAC_PI_2 * k as f64 / HEADINGS as f64;
        let touchdown = ground.touchdown(lander, position, heading)?;
        match touchdown.as_ref().and_then(|t| t.worst()) {
            Some(rest) => worst = worst.max(rest.tilt),
            None => return Ok(None),
        }
    }
    Ok(Some(worst))
}

/// Returns the reason for which a map has no site, and what comes nearest to one.
fn no_safe_site(request: &SelectionRequest, hazards: &HazardMap, below: [usize; 2]) -> NoSite {
    let (counts, criteria) = (hazards.counts(), &request.criteria);
    let offset = |[row, col]: [usize; 2]| {
        let geometry = request.map.geometry();
        let [origin, at] = [below, [row, col]].map(|[r, c]| geometry.position(r as f64, c as f64));
        let [height, ground] = [[row, col], below].map(|[r, c]| request.map.height(r, c).unwrap_or(f64::NAN));
        [at[0] - origin[0], at[1] - origin[1], height - ground]
    };
    let (rows, cols) = (hazards.geometry().rows(), hazards.geometry().cols());
    let pixels = || (0..rows).flat_map(|row| (0..cols).map(move |col| [row, col]));
    if counts.safe > 0 {
        let (mut widest, mut at) = (0.0_f32, [0, 0]);
        for [row, col] in pixels() {
            let clearance = hazards.clearance().get(row, col);
            if clearance > widest {
                (widest, at) = (clearance, [row, col]);
            }
        }
        return NoSite::NoRoom {
            safe_fraction: counts.safe_fraction(),
            required: criteria.clearance_min_m,
            offset: offset(at),
            widest: f64::from(widest),
        };
    }
    // The pixel whose worst threshold is exceeded least.
    let mut nearest: Option<(f64, NoSite)> = None;
    for [row, col] in pixels().filter(|&[r, c]| hazards.verdict().get(r, c) != Verdict::Unknown) {
        let parts = hazards.layers().filter_map(|(layer, raster)| {
            let limit = criteria.limit(layer).filter(|_| layer != Layer::BellyClearance)?;
            let value = f64::from(raster.get(row, col)).abs();
            Some((value / limit, layer, value, limit))
        });
        let Some((ratio, layer, value, limit)) = parts.max_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
        if nearest.as_ref().is_none_or(|n| ratio < n.0) {
            let (pixels, offset) = (counts.unsafe_, offset([row, col]));
            nearest = Some((ratio, NoSite::Unsafe { pixels, offset, layer, value, limit }));
        }
    }
    nearest.map_or(NoSite::Unknown, |(_, nearest)| nearest)
}

/// Safe sites that no divert reaches.
fn out_of_reach(candidates: Vec<Candidate>) -> NoSite {
    let miss = |c: &Candidate| c.divert.unreached.as_ref().and_then(|u| u.distance).unwrap_or(f64::INFINITY);
    let number = candidates.len();
    match candidates.into_iter().min_by(|a, b| miss(a).total_cmp(&miss(b))) {
        Some(nearest) => NoSite::OutOfReach { candidates: number, nearest: Box::new(nearest) },
        None => NoSite::Unknown,
    }
}

#[cfg(test)]
mod tests;
