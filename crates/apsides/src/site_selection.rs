//! A landing site that is chosen in flight: hazards of an elevation map, candidates, a convex divert to each, the best mix of safety and
//! propellant.
//!
//! Map coordinates are horizontal distances from the pixel below the lander, to the east and to the north, on great circles through it; heights
//! count from the ground there.

use apsides_convex::{DescentLimits, Divert, DivertPlanner, DivertSettings, Outcome, PoweredDescent};
use apsides_terrain::contact::{Ground, Lander};
use apsides_terrain::hazard::{HazardMap, Layer, SiteCriteria, Verdict, hazard_map};
use apsides_terrain::site::{ScoreWeights, Site, SiteRequest, SiteRule, choose_sites};
use apsides_terrain::{ElevationMap, TerrainError};
use serde::{Deserialize, Serialize};

/// Headings of the footpads at which a touchdown is tried, in a quarter turn.
const HEADINGS: usize = 18;

/// What the choice of a site is made from.
#[derive(Clone, Debug)]
pub struct SelectionRequest {
    /// Which map, in messages and names of files: `coarse`.
    pub name: &'static str,
    /// The map; the lander is above its middle.
    pub map: ElevationMap,
    /// What a site must fulfil.
    pub criteria: SiteCriteria,
    /// The lander above the middle of the map, which is the origin; its target is a place above the ground there.
    pub descent: PoweredDescent,
    /// Candidates that diverts are planned to.
    pub candidates: usize,
    /// Least distance between candidates, m.
    pub separation: f64,
    /// Propellant that a site without any hazard is worth more than one that is just allowed, kg.
    pub hazard_worth: f64,
    /// Expected propellant of a divert by its length, kg/m: how far candidates are looked for.
    pub divert_cost: f64,
    /// Distance of the footpads, their radius and the centre of mass above them.
    pub lander: Lander,
    /// Key of the tilt that limits a divert, for messages.
    pub tilt_key: &'static str,
}

/// A candidate.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The site on its map.
    pub site: Site,
    /// East, north and up from the ground below the lander, m.
    pub offset: [f64; 3],
    /// What it takes to fly there.
    pub divert: Divert,
    /// Half of the least margin to a threshold and of the room around the site, both from 0 to 1, as what they lack: 0 to 1.
    pub hazard: f64,
    /// Propellant above that of the cheapest candidate and the worth of the hazard, kg; infinite when it cannot be reached.
    pub cost: f64,
    /// Largest tilt on the four pads over all headings, rad; none where the pads stand on a gap or the lander topples. Tried
    /// only until a candidate stands.
    pub tilt: Option<f64>,
}

/// A choice of a site.
#[derive(Clone, Debug)]
pub struct SiteSelection {
    /// Which map.
    pub name: &'static str,
    /// The map.
    pub map: ElevationMap,
    /// Its hazards.
    pub hazards: HazardMap,
    /// Row and column below the lander.
    pub below: [usize; 2],
    /// All candidates, cheapest first.
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

    /// What is said of the place below the lander: safe or the threshold that it breaks.
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

/// A choice of a site in the summary of a mission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SiteSummary {
    /// Which map.
    pub map: String,
    /// Part of the known pixels that is safe.
    pub safe_fraction: f64,
    /// What is said of the place below the lander.
    pub below: String,
    /// Candidates that diverts were planned to, and how many of them are within reach.
    pub candidates: [usize; 2],
    /// East, north and up from the ground below the lander to the site, m.
    pub offset_m: [f64; 3],
    /// Distance of the site from what is not safe, m; none if all of the map is safe.
    pub clearance_m: Option<f64>,
    /// Propellant of the planned divert, and how much of it the cheapest candidate would save, kg.
    pub propellant_kg: [f64; 2],
    /// Tilt on the four pads at the worst heading, deg.
    pub tilt_deg: Option<f64>,
}

impl From<&SiteSelection> for SiteSummary {
    fn from(s: &SiteSelection) -> Self {
        let (site, reached) = (s.site(), || s.candidates.iter().filter(|c| c.cost.is_finite()));
        let least = reached().map(|c| c.divert.propellant).fold(f64::INFINITY, f64::min);
        Self {
            map: s.name.into(),
            safe_fraction: s.hazards.counts().safe_fraction(),
            below: s.below_verdict(),
            candidates: [s.candidates.len(), reached().count()],
            offset_m: site.offset,
            clearance_m: Some(site.site.clearance_m).filter(|c| c.is_finite()),
            propellant_kg: [site.divert.propellant, site.divert.propellant - least],
            tilt_deg: site.tilt.map(f64::to_degrees),
        }
    }
}

impl std::fmt::Display for SiteSummary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [all, reached] = self.candidates;
        write!(
            f,
            "{} map: {:.1} % safe; the ground below is {}; {reached} of {all} candidates within reach; site {}, {:.1} m {}",
            self.map,
            100.0 * self.safe_fraction,
            self.below,
            place(self.offset_m),
            self.offset_m[2].abs(),
            if self.offset_m[2] < 0.0 { "lower" } else { "higher" }
        )?;
        if let Some(clearance) = self.clearance_m {
            write!(f, ", {clearance:.1} m clear")?;
        }
        let [propellant, more] = self.propellant_kg;
        write!(f, "; divert {propellant:.2} kg, {more:.2} kg more than to the cheapest")
    }
}

/// A value above its threshold, in the units of criteria.
fn exceeded(layer: Layer, value: f64, limit: f64) -> String {
    let (factor, unit) = if layer.is_angle() { (180.0 / std::f64::consts::PI, "deg") } else { (1.0, "m") };
    format!("{} {:.3} {unit} where {} is allowed", layer.name(), value * factor, limit * factor)
}

fn place([east, north, _]: [f64; 3]) -> String {
    let (x, y) = (if east < 0.0 { "west" } else { "east" }, if north < 0.0 { "south" } else { "north" });
    format!("{:.1} m {x} and {:.1} m {y}", east.abs(), north.abs())
}

/// Chooses a site, or says in words why there is none and what is nearest to one.
///
/// # Errors
/// The sentence.
pub fn select(request: SelectionRequest) -> Result<SiteSelection, String> {
    let name = request.name;
    let text = |e: TerrainError| format!("{name} map: {e}");
    let hazards = hazard_map(&request.map, &request.criteria).map_err(text)?;
    let geometry = *request.map.geometry();
    let below = [geometry.rows() / 2, geometry.cols() / 2];
    let Some(ground) = request.map.height(below[0], below[1]) else {
        return Err(format!(
            "{name} map: its middle, below the lander, is a gap; choose a map with a height there"
        ));
    };
    let choice = choose_sites(
        &request.map,
        &hazards,
        &SiteRequest {
            rule: SiteRule::Score(ScoreWeights {
                margin: 0.5,
                clearance: 0.5,
                divert_per_m: request.divert_cost / request.hazard_worth,
            }),
            start: Some(below),
            count: request.candidates,
            separation_m: request.separation,
            rivals: 0,
        },
    )
    .map_err(text)?;
    if choice.sites.is_empty() {
        return Err(no_safe_site(&request, &hazards, below));
    }
    let origin = geometry.position(below[0] as f64, below[1] as f64);
    let mut candidates: Vec<Candidate> = Vec::with_capacity(choice.sites.len());
    let mut planner = DivertPlanner::new(&request.descent, DivertSettings::default())
        .map_err(|e| format!("{name} map: {e}"))?;
    let above = request.descent.target[2];
    for site in choice.sites {
        let [east, north] = [0, 1].map(|k| site.position_m[k] - origin[k]);
        let offset = [east, north, site.height_m - ground];
        let divert =
            planner.divert([east, north, offset[2] + above]).map_err(|e| format!("{name} map: {e}"))?;
        let hazard = 1.0 - site.value - request.divert_cost / request.hazard_worth * site.divert_m;
        candidates.push(Candidate { site, offset, divert, hazard, cost: f64::INFINITY, tilt: None });
    }
    let landed = |c: &Candidate| c.divert.outcome == Outcome::Landed;
    let least =
        candidates.iter().filter(|c| landed(c)).map(|c| c.divert.propellant).fold(f64::INFINITY, f64::min);
    if least.is_infinite() {
        return Err(out_of_reach(&request, &candidates));
    }
    for c in candidates.iter_mut().filter(|c| c.divert.outcome == Outcome::Landed) {
        c.cost = c.divert.propellant - least + request.hazard_worth * c.hazard;
    }
    candidates.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let chosen = standing(&request, &mut candidates)?;
    Ok(SiteSelection { name, map: request.map, hazards, below, candidates, chosen })
}

/// The first candidate within reach on which the lander stands on its pads, whatever its heading.
fn standing(request: &SelectionRequest, candidates: &mut [Candidate]) -> Result<usize, String> {
    let name = request.name;
    let text = |e: TerrainError| format!("{name} map: {e}");
    let ground = Ground::new(&request.map).map_err(text)?;
    let most = request.criteria.tilt_at_rest_max();
    let mut tried = 0;
    for (k, c) in candidates.iter_mut().enumerate().filter(|(_, c)| c.cost.is_finite()) {
        tried += 1;
        c.tilt = steepest(&ground, &request.lander, c.site.position_m).map_err(text)?;
        if c.tilt.is_some_and(|tilt| tilt <= most) {
            return Ok(k);
        }
    }
    let best = candidates.iter().filter_map(|c| c.tilt).fold(f64::INFINITY, f64::min);
    Err(format!(
        "{name} map: on none of the {tried} candidates within reach does the lander stand on its four pads with a tilt of at most \
         {:.1} deg; the least is {:.2} deg",
        most.to_degrees(),
        best.to_degrees()
    ))
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

/// Why a map has no site, and what comes nearest to one.
fn no_safe_site(request: &SelectionRequest, hazards: &HazardMap, below: [usize; 2]) -> String {
    let (name, counts, criteria) = (request.name, hazards.counts(), &request.criteria);
    let offset = |row: usize, col: usize| {
        let geometry = request.map.geometry();
        let [origin, at] = [below, [row, col]].map(|[r, c]| geometry.position(r as f64, c as f64));
        place([at[0] - origin[0], at[1] - origin[1], 0.0])
    };
    let (rows, cols) = (hazards.geometry().rows(), hazards.geometry().cols());
    let pixels = || (0..rows).flat_map(|row| (0..cols).map(move |col| (row, col)));
    if counts.safe > 0 {
        let (mut widest, mut at) = (0.0_f32, [0, 0]);
        for (row, col) in pixels() {
            let clearance = hazards.clearance().get(row, col);
            if clearance > widest {
                (widest, at) = (clearance, [row, col]);
            }
        }
        return format!(
            "{name} map: no site: {:.2} % of it is safe, but nothing has {} m around it that is safe throughout; the widest place, {}, has {widest:.2} m",
            100.0 * counts.safe_fraction(),
            criteria.clearance_min_m,
            offset(at[0], at[1])
        );
    }
    // The pixel whose worst threshold is exceeded least.
    let mut nearest: Option<(f64, [usize; 2], Layer, f64)> = None;
    for (row, col) in pixels().filter(|&(r, c)| hazards.verdict().get(r, c) != Verdict::Unknown) {
        let parts = hazards.layers().filter_map(|(layer, raster)| {
            let limit = criteria.limit(layer).filter(|_| layer != Layer::BellyClearance)?;
            let value = f64::from(raster.get(row, col)).abs();
            Some((value / limit, layer, value))
        });
        let Some((ratio, layer, value)) = parts.max_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
        if nearest.is_none_or(|n| ratio < n.0) {
            nearest = Some((ratio, [row, col], layer, value));
        }
    }
    match nearest {
        Some((ratio, [row, col], layer, value)) => format!(
            "{name} map: no safe site among {} pixels; the nearest to one, {}, has {}: thresholds raised by {:.1} % would allow it",
            counts.unsafe_,
            offset(row, col),
            exceeded(layer, value, criteria.limit(layer).unwrap_or(f64::NAN)),
            100.0 * (ratio - 1.0)
        ),
        None => format!("{name} map: no pixel of it has a whole footprint of known heights"),
    }
}

/// Safe sites that no divert reaches.
fn out_of_reach(request: &SelectionRequest, candidates: &[Candidate]) -> String {
    let miss = |c: &Candidate| match c.divert.outcome {
        Outcome::OutOfReach { distance } | Outcome::NoArrival { distance, .. } => distance,
        Outcome::TooLittlePropellant { distance, .. } => distance,
        Outcome::Landed | Outcome::NoFlight(_) => f64::INFINITY,
    };
    let nearest = candidates.iter().min_by(|a, b| miss(a).total_cmp(&miss(b)));
    let DescentLimits { pointing, .. } = request.descent.limits;
    let tilt = pointing.map_or(180.0, f64::to_degrees);
    let mut text = format!(
        "{} map: none of {} safe sites is within reach with a tilt of at most {tilt} deg and {:.1} kg of propellant",
        request.name,
        candidates.len(),
        request.descent.propellant()
    );
    if let Some(c) = nearest {
        text += &format!(
            "; the nearest to it, {} ({:.1} m away): {}; raise `{}` or choose a site nearer to it",
            place(c.offset),
            c.offset[0].hypot(c.offset[1]),
            c.divert.outcome,
            request.tilt_key
        );
    }
    text
}
