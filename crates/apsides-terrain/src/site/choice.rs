//! Choice of sites by a rule.

use serde::{Deserialize, Serialize};

use super::spiral::{place, spiral};
use crate::hazard::{HazardMap, Layer, Verdict};
use crate::{ElevationMap, TerrainError};

/// The rule for the best candidate. Among equals it is the first on the spiral from the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SiteRule {
    /// The first on the clockwise square spiral from the start.
    #[default]
    Spiral,
    /// The one with the largest clearance.
    Clearance,
    /// The one with the largest weighted score.
    Score(ScoreWeights),
}

/// Weights of a score: `margin * m + clearance * (1 - c_min / c) - divert_per_m * d`.
///
/// `m` is the least of `1 - value / limit` over the layers that are kept and tested with an upper limit, from 0 at a limit to 1, `c` the
/// clearance, at least `c_min`, and `d` the horizontal distance from the start, m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ScoreWeights {
    /// Weight of the margin to the thresholds.
    pub margin: f64,
    /// Weight of the clearance.
    pub clearance: f64,
    /// Cost of a metre of divert.
    pub divert_per_m: f64,
}

impl Default for ScoreWeights {
    fn default() -> Self {
        ScoreWeights { margin: 1.0, clearance: 1.0, divert_per_m: 1e-3 }
    }
}

impl ScoreWeights {
    /// The score of a pixel without its divert.
    pub(super) fn of_site(&self, hazards: &HazardMap, row: usize, col: usize) -> f64 {
        let criteria = hazards.criteria();
        let mut margin: f64 = 1.0;
        for (layer, raster) in hazards.layers() {
            if let (Some(limit), true) = (criteria.limit(layer), layer != Layer::BellyClearance) {
                margin = margin.min(1.0 - f64::from(raster.get(row, col)).abs() / limit);
            }
        }
        let clearance = f64::from(hazards.clearance().get(row, col));
        let room = 1.0 - (criteria.clearance_min_m / clearance).min(1.0);
        self.margin * margin + self.clearance * room
    }
}

/// A request for landing sites.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SiteRequest {
    /// The rule for the best candidate.
    pub rule: SiteRule,
    /// Row and column from which diverts are counted; the middle, `(rows / 2, cols / 2)`, if there is none.
    pub start: Option<[usize; 2]>,
    /// Number of sites.
    pub count: usize,
    /// Least distance between sites, m.
    pub separation_m: f64,
    /// Number of rivals that are reported.
    pub rivals: usize,
}

impl Default for SiteRequest {
    fn default() -> Self {
        SiteRequest { rule: SiteRule::Spiral, start: None, count: 1, separation_m: 0.0, rivals: 0 }
    }
}

/// A candidate with its numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Site {
    /// Row of the map.
    pub row: usize,
    /// Column of the map.
    pub col: usize,
    /// Map coordinates (east, north), m.
    pub position_m: [f64; 2],
    /// Height, m.
    pub height_m: f64,
    /// Distance to the nearest pixel that is not safe, m.
    pub clearance_m: f64,
    /// Horizontal distance from the start, m.
    pub divert_m: f64,
    /// Place on the spiral from the start, 1 at the start, counting pixels of the map alone where the rule is the spiral.
    pub visited: u64,
    /// The value that the rule compares, the larger the better: minus `visited`, the clearance in m, or the score.
    pub value: f64,
    /// Layers that were kept: rad or m.
    pub layers: Vec<(Layer, f64)>,
}

/// A candidate that is not among the sites.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rival {
    /// The candidate.
    pub site: Site,
    /// The last of the sites, to which it lost.
    pub lost_to: usize,
    /// By how much its value is less than that of the last site.
    pub by: f64,
}

/// The reason why a pixel is no site.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reason {
    /// Footprint partly in gaps or outside the map.
    Unknown,
    /// The first threshold that it breaks.
    Breaks(Layer),
    /// Too near to a pixel that is not safe.
    Clearance,
    /// Nearer to a better site than sites may be to each other.
    Separation,
}

/// Sites, best first, and why others lost.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SiteChoice {
    /// The sites.
    pub sites: Vec<Site>,
    /// The next best, separated from the sites and from each other as sites are.
    pub rivals: Vec<Rival>,
    /// Numbers of pixels that were passed over for each reason, up to the last site on the spiral, or on the whole map by other rules.
    pub passed_over: Vec<(Reason, u64)>,
}

/// The best sites of a hazard map.
///
/// # Errors
/// A start outside the map, a separation that is negative or not finite, weights that are not finite, maps of different sizes.
pub fn choose_sites(
    map: &ElevationMap,
    hazards: &HazardMap,
    request: &SiteRequest,
) -> Result<SiteChoice, TerrainError> {
    let geometry = hazards.geometry();
    let [rows, cols] = [geometry.rows(), geometry.cols()];
    if map.geometry() != geometry {
        return Err(TerrainError::Shape { rows, cols, values: map.geometry().pixels() });
    }
    let start = request.start.unwrap_or([rows / 2, cols / 2]);
    if start[0] >= rows || start[1] >= cols {
        return Err(TerrainError::Outside { row: start[0], col: start[1], rows, cols });
    }
    let number = |name, value: f64, fits: bool, allowed: &'static str| {
        if fits { Ok(()) } else { Err(TerrainError::Number { name, value, allowed: allowed.into() }) }
    };
    let separation = request.separation_m;
    number(
        "separation_m",
        separation,
        separation.is_finite() && separation >= 0.0,
        "it must not be negative",
    )?;
    if let SiteRule::Score(w) = request.rule {
        for (name, value) in
            [("margin", w.margin), ("clearance", w.clearance), ("divert_per_m", w.divert_per_m)]
        {
            number(name, value, value.is_finite(), "it must be finite")?;
        }
    }
    let search = SiteSearch { map, hazards, request, start, pixel_m: geometry.square_pixel()? };
    Ok(match request.rule {
        SiteRule::Spiral => search.along_spiral(),
        SiteRule::Clearance | SiteRule::Score(_) => search.best(),
    })
}

struct SiteSearch<'a> {
    map: &'a ElevationMap,
    hazards: &'a HazardMap,
    request: &'a SiteRequest,
    start: [usize; 2],
    pixel_m: f64,
}

/// Numbers of pixels by reason.
#[derive(Default)]
struct Tally(Vec<(Reason, u64)>);

impl Tally {
    fn add(&mut self, reason: Reason) {
        match self.0.iter_mut().find(|(r, _)| *r == reason) {
            Some((_, count)) => *count += 1,
            None => self.0.push((reason, 1)),
        }
    }

    fn sorted(mut self) -> Vec<(Reason, u64)> {
        self.0.sort_unstable_by_key(|&(reason, count)| (std::cmp::Reverse(count), reason));
        self.0
    }
}

impl SiteSearch<'_> {
    /// The reason why a pixel is no candidate.
    fn against(&self, row: usize, col: usize) -> Option<Reason> {
        match self.hazards.verdict().get(row, col) {
            Verdict::Unknown => Some(Reason::Unknown),
            Verdict::Unsafe(layer) => Some(Reason::Breaks(layer)),
            // In the precision of the layer, so that a clearance of exactly the threshold is enough.
            Verdict::Safe => {
                let least = self.hazards.criteria().clearance_min_m as f32;
                (self.hazards.clearance().get(row, col) < least).then_some(Reason::Clearance)
            }
        }
    }

    fn divert(&self, row: usize, col: usize) -> f64 {
        let [south, east] = [row.abs_diff(self.start[0]), col.abs_diff(self.start[1])];
        (south as f64).hypot(east as f64) * self.pixel_m
    }

    fn score(&self, weights: &ScoreWeights, row: usize, col: usize) -> f64 {
        weights.of_site(self.hazards, row, col) - weights.divert_per_m * self.divert(row, col)
    }

    fn site(&self, [row, col]: [usize; 2], visited: u64, value: f64) -> Site {
        let layers = self.hazards.layers().map(|(layer, raster)| (layer, f64::from(raster.get(row, col))));
        Site {
            row,
            col,
            position_m: self.map.geometry().position(row as f64, col as f64),
            // A candidate is no gap.
            height_m: self.map.height(row, col).unwrap_or(f64::NAN),
            clearance_m: f64::from(self.hazards.clearance().get(row, col)),
            divert_m: self.divert(row, col),
            visited,
            value,
            layers: layers.collect(),
        }
    }

    /// Tells whether a pixel is far enough from all sites and rivals so far.
    fn separate(&self, chosen: &[Site], [row, col]: [usize; 2]) -> bool {
        chosen.iter().all(|site| {
            let [south, east] = [site.row.abs_diff(row), site.col.abs_diff(col)];
            (south as f64).hypot(east as f64) * self.pixel_m >= self.request.separation_m
        })
    }

    /// Sites first, then rivals.
    fn enough(&self) -> usize {
        self.request.count.saturating_add(self.request.rivals)
    }

    fn along_spiral(&self) -> SiteChoice {
        let geometry = self.hazards.geometry();
        let mut chosen: Vec<Site> = Vec::new();
        let mut tally = Tally::default();
        let pixels = spiral(self.start, geometry.rows(), geometry.cols());
        for (visited, pixel) in (1_u64..).zip(pixels) {
            if chosen.len() >= self.enough() {
                break;
            }
            let separated = || (!self.separate(&chosen, pixel)).then_some(Reason::Separation);
            match self.against(pixel[0], pixel[1]).or_else(separated) {
                Some(reason) if chosen.len() < self.request.count => tally.add(reason),
                Some(_) => {}
                None => chosen.push(self.site(pixel, visited, -(visited as f64))),
            }
        }
        self.finish(chosen, tally)
    }

    fn best(&self) -> SiteChoice {
        let geometry = self.hazards.geometry();
        let mut tally = Tally::default();
        let mut candidates: Vec<(f64, u64, [usize; 2])> = Vec::new();
        for row in 0..geometry.rows() {
            for col in 0..geometry.cols() {
                match self.against(row, col) {
                    Some(reason) => tally.add(reason),
                    None => {
                        let value = match &self.request.rule {
                            SiteRule::Score(weights) => self.score(weights, row, col),
                            _ => f64::from(self.hazards.clearance().get(row, col)),
                        };
                        candidates.push((value, place(self.start, [row, col]), [row, col]));
                    }
                }
            }
        }
        candidates.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut chosen: Vec<Site> = Vec::new();
        for (value, order, pixel) in candidates {
            if chosen.len() >= self.enough() {
                break;
            }
            if self.separate(&chosen, pixel) {
                chosen.push(self.site(pixel, order + 1, value));
            } else if chosen.len() < self.request.count {
                tally.add(Reason::Separation);
            }
        }
        self.finish(chosen, tally)
    }

    fn finish(&self, mut sites: Vec<Site>, tally: Tally) -> SiteChoice {
        let rest = sites.split_off(self.request.count.min(sites.len()));
        let last = sites.len().saturating_sub(1);
        let best = sites.last().map_or(f64::INFINITY, |site| site.value);
        let rivals =
            rest.into_iter().map(|site| Rival { lost_to: last, by: best - site.value, site }).collect();
        SiteChoice { sites, rivals, passed_over: tally.sorted() }
    }
}
