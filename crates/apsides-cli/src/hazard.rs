//! `apsides hazard`.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use apsides::missions::site_criteria;
use apsides::pipeline::regular_file;
use apsides::terrain::hazard::{
    Counts, HazardBand, HazardOptions, HazardSink, Layer, SiteCriteria, Verdict, hazard_map_watched,
};
use apsides::terrain::io::{Equirectangular, GeoTiffOptions};
use apsides::terrain::site::{ScoreWeights, Site, SiteRequest, SiteRule, choose_sites};
use apsides::terrain::survey::{SurveyOptions, fits, survey};
use apsides::terrain::{Geometry, Raster, TerrainError};
use apsides_report::{HazardPicture, MapPicture, Page};
use serde::Serialize;

use crate::arguments::{HazardArguments, Rule};
use crate::commands::{claim, made, probe_directory};
use crate::exit::{Exit, Refusal, refusal};
use crate::hazard_features::Features;
use crate::hazard_files::{Files, Rows, csv, stem};
use crate::hazard_watch::Watched;
use crate::output::{heads, print, print_words, written};
use crate::sentence::name;
use crate::speech::{is_json, warned};
use crate::stop::reason;
use crate::terrain::{MapFile, MapSummary, pool, unwritten_raster, write};

/// From this size of a pixel a map is coarse, m.
const COARSE_PIXEL: f64 = 0.5;

/// Bytes of a pixel while it is read.
const PIXEL_BYTES: u64 = 12;

/// Result of the command.
#[derive(Serialize)]
struct Report {
    map: MapSummary,
    criteria_name: String,
    criteria: SiteCriteria,
    /// The reason for which ground that is called safe may not be, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    warning: Option<String>,
    /// Part of the map that was assessed before the time limit; the rest counts as unknown.
    assessed_fraction: f64,
    safe_fraction: f64,
    pixels: Pixels,
    /// Pixels by the first threshold that they break.
    unsafe_by: BTreeMap<String, u64>,
    start: [usize; 2],
    rule: &'static str,
    separation_m: f64,
    sites: Vec<SiteRow>,
    /// Craters, boulders and probabilities that were asked for.
    #[serde(flatten)]
    features: Features,
    files: Vec<String>,
}

#[derive(Serialize)]
struct Pixels {
    safe: u64,
    #[serde(rename = "unsafe")]
    not_safe: u64,
    unknown: u64,
}

#[derive(Serialize)]
struct SiteRow {
    row: usize,
    col: usize,
    east_m: f64,
    north_m: f64,
    /// Longitude and latitude on a map that was in degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    longitude_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    latitude_deg: Option<f64>,
    height_m: f64,
    /// None if all of the map is safe.
    clearance_m: Option<f64>,
    divert_m: f64,
    visited: u64,
    /// Layers with their unit.
    layers: BTreeMap<String, f64>,
}

impl SiteRow {
    fn new(site: &Site, projection: Option<Equirectangular>) -> Self {
        let [longitude_deg, latitude_deg] =
            projection.map_or([None; 2], |p| p.degrees(site.position_m).map(Some));
        let shown = |(layer, value): &(Layer, f64)| (stem(*layer), layer.in_unit(*value));
        Self {
            row: site.row,
            col: site.col,
            east_m: site.position_m[0],
            north_m: site.position_m[1],
            longitude_deg,
            latitude_deg,
            height_m: site.height_m,
            clearance_m: site.clearance_m.is_finite().then_some(site.clearance_m),
            divert_m: site.divert_m,
            visited: site.visited,
            layers: site.layers.iter().map(shown).collect(),
        }
    }
}

/// Counts, summary and files that are filled row by row.
struct Account {
    counts: Counts,
    by: BTreeMap<String, u64>,
    summary: MapSummary,
    files: Option<Files>,
}

impl Account {
    fn rows(&mut self, rows: &Rows<'_>) -> Result<(), TerrainError> {
        let counts = Counts::of(rows.verdict);
        self.counts.safe += counts.safe;
        self.counts.unsafe_ += counts.unsafe_;
        self.counts.unknown += counts.unknown;
        for layer in Layer::ALL {
            let count = rows.verdict.iter().filter(|v| **v == Verdict::Unsafe(layer)).count();
            if count > 0 {
                *self.by.entry(layer.name().into()).or_default() += count as u64;
            }
        }
        let cols = rows.heights.geometry().cols();
        let heights = rows.heights.relative().data();
        let heights = heights.get(rows.skip * cols..).and_then(|own| own.get(..rows.verdict.len()));
        let heights = heights.unwrap_or_default();
        let known = || heights.iter().filter(|z| !z.is_nan());
        let (low, high) =
            known().fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), z| (l.min(*z), h.max(*z)));
        let range = (low <= high).then(|| [low, high].map(|z| rows.heights.datum() + f64::from(z)));
        self.summary.add(range, heights.len() - known().count());
        self.files.as_mut().map_or(Ok(()), |files| files.rows(rows))
    }
}

/// Bands of a map that is larger than the memory.
struct Bands<'a> {
    account: &'a mut Account,
    /// The map once more, for the heights of a band.
    heights: MapFile,
    watched: &'a Watched,
    /// The reason for which the work ended, if that is not the map.
    failure: Option<Refusal>,
}

impl HazardSink for Bands<'_> {
    fn band(&mut self, band: &HazardBand) -> Result<(), TerrainError> {
        let (rows, cols) = (self.heights.geometry().rows(), self.heights.geometry().cols());
        let (first, count) = (band.first_row, band.verdict.len() / cols);
        let (top, bottom) = (first.saturating_sub(1), (first + count + 1).min(rows));
        let heights = self.heights.window(top, 0, bottom - top, cols)?;
        let layer = |layer: Layer| band.layer(layer);
        let written = self.account.rows(&Rows {
            heights: &heights,
            skip: first - top,
            verdict: band.verdict,
            layer: &layer,
        });
        self.or_end(written)?;
        self.unless_interrupted()
    }

    fn clearance(&mut self, _: usize, clearance: &[f32]) -> Result<(), TerrainError> {
        if let Some(files) = &mut self.account.files {
            let written = files.clearance(clearance);
            self.or_end(written)?;
        }
        self.watched.advance(clearance.len());
        self.unless_interrupted()
    }
}

impl Bands<'_> {
    /// Ends the work if the user asks to.
    fn unless_interrupted(&mut self) -> Result<(), TerrainError> {
        self.watched.unless_interrupted().map_err(|interrupted| self.end(interrupted))
    }

    /// Ends the work where a file could not be written.
    fn or_end(&mut self, written: Result<(), TerrainError>) -> Result<(), TerrainError> {
        written.map_err(|e| {
            let dir = self.account.files.as_ref().map_or(Path::new(""), Files::dir);
            self.end(unwritten_raster(dir)(e))
        })
    }

    fn end(&mut self, failure: Refusal) -> TerrainError {
        self.failure = Some(failure);
        TerrainError::Io { doing: "writing", source: std::io::ErrorKind::Interrupted.into() }
    }
}

pub(crate) fn hazard(a: &HazardArguments) -> Result<Exit, Refusal> {
    let memory = u64::from(a.memory) << 20;
    let mut map = a.map.open_ground(memory / PIXEL_BYTES)?;
    let geometry = *map.geometry();
    let pixel = geometry.square_pixel().map_err(|e| a.map.defect(e))?;
    let (criteria_name, criteria) = criteria(a, pixel)?;
    let work = Work::new(a, &criteria, &map)?;
    let in_memory = fits(&geometry, memory);
    if !in_memory {
        refuse_whole_map(a, &criteria, &geometry)?;
    }
    if let Some(dir) = &a.out {
        // Before the work, not after it.
        probe_directory(dir)?;
    }
    let _lock = a.out.as_deref().map(claim).transpose()?;
    let tested: Vec<Layer> = Layer::ALL.into_iter().filter(|l| criteria.limit(*l).is_some()).collect();
    let options = GeoTiffOptions { deflate: true, nodata: None, geo_keys: map.geo_keys().cloned() };
    let files = match &a.out {
        Some(dir) => Some(Files::new(made(dir)?, &geometry, &tested, &options)?),
        None => None,
    };
    let mut account = Account {
        counts: Counts::default(),
        by: BTreeMap::new(),
        summary: MapSummary::new(&a.map.map, &geometry, map.projection()),
        files,
    };
    let pool = pool(&a.threads)?;
    // Clearances of a map in bands come by themselves, after the hazards.
    let passes = if in_memory { Features::passes(a) } else { 1 };
    let pixels = geometry.pixels() as u64 * (1 + passes);
    let watched = Watched::new(a.limit.stop(), pixels);
    let found = pool.install(|| {
        if in_memory {
            work.in_memory(&mut map, &geometry, &mut account, &watched)
        } else {
            let sites = work.in_bands(&mut map, &geometry, memory, &mut account, &watched)?;
            Ok((sites, Features::default()))
        }
    });
    watched.finish();
    let (sites, features) = found?;
    watched.unless_interrupted()?;
    let fraction = watched.fraction(&geometry);
    // Rasters of a part of a map that is read in bands are none.
    let mut paths = match account.files.take().filter(|_| in_memory || fraction >= 1.0) {
        Some(files) => files.finish(&sites, criteria.clearance_min_m / pixel)?,
        None => Vec::new(),
    };
    if let Some(dir) = &a.out {
        paths.extend(features.write(dir, &geometry, &options)?);
    }
    let mut report = work.report(criteria_name, account, &sites, features, fraction);
    if let Some(dir) = &a.out {
        report.write(dir, &mut paths)?;
    }
    report.show(&paths)?;
    Ok(if report.sites.is_empty() { Exit::NotSolved } else { Exit::Verified })
}

/// Refuses options that need the whole map in memory.
fn refuse_whole_map(
    a: &HazardArguments,
    criteria: &SiteCriteria,
    geometry: &Geometry,
) -> Result<(), Refusal> {
    let (rows, cols, memory) = (geometry.rows(), geometry.cols(), a.memory);
    if a.rule != Rule::Spiral {
        return Err(format!(
            "--rule: a map of {rows} x {cols} pixels is read in bands with {memory} MiB, where sites are sought on the spiral only; \
             give more with --memory"
        ).into());
    }
    let criterion = criteria.seen_on_whole_map().map(|key| format!("--criteria: `{key}`"));
    if let Some(option) = Features::asked(a).map(str::to_owned).or(criterion) {
        return Err(format!(
            "{option}: needs the whole map in memory, {memory} MiB are too few for {rows} x {cols} pixels; give more with --memory"
        ).into());
    }
    Ok(())
}

fn criteria(a: &HazardArguments, pixel: f64) -> Result<(String, SiteCriteria), Refusal> {
    let default = if pixel < COARSE_PIXEL { "chang-e-3-fine" } else { "chang-e-3-coarse" };
    let name = a.criteria.as_deref().unwrap_or(default);
    let criteria = site_criteria::load(name).map_err(|e| format!("--criteria: {e}"))?;
    Ok((name.to_owned(), criteria))
}

/// The request, which the assessment in memory and the one in bands share.
struct Work<'a> {
    a: &'a HazardArguments,
    criteria: &'a SiteCriteria,
    start: [usize; 2],
    separation: f64,
    /// The projection of a map that was in degrees.
    projection: Option<Equirectangular>,
}

impl<'a> Work<'a> {
    fn new(a: &'a HazardArguments, criteria: &'a SiteCriteria, map: &MapFile) -> Result<Self, Refusal> {
        let geometry = map.geometry();
        let (rows, cols) = (geometry.rows(), geometry.cols());
        let start = a.start.unwrap_or([rows / 2, cols / 2]);
        if start[0] >= rows || start[1] >= cols {
            let (row, col) = (start[0], start[1]);
            return Err(format!("--start: {}", TerrainError::Outside { row, col, rows, cols }).into());
        }
        let separation = a.separation.unwrap_or(2.0 * criteria.clearance_min_m);
        if !(separation.is_finite() && separation >= 0.0) {
            return Err(format!("--separation: {separation} m; it must be finite and not negative").into());
        }
        Ok(Self { a, criteria, start, separation, projection: map.projection() })
    }

    fn in_memory(
        &self,
        map: &mut MapFile,
        geometry: &Geometry,
        account: &mut Account,
        watched: &Watched,
    ) -> Result<(Vec<Site>, Features), Refusal> {
        let defect = |e| self.a.map.defect(e);
        let map = map.window(0, 0, geometry.rows(), geometry.cols()).map_err(defect)?;
        if map.range().is_none() {
            return Err(defect(TerrainError::Empty { pixels: geometry.pixels() }));
        }
        let watch = |pixels| watched.assesses(pixels);
        let hazards = hazard_map_watched(&map, self.criteria, &HazardOptions::default(), &watch);
        let hazards = hazards.map_err(defect)?;
        watched.unless_interrupted()?;
        let layer = |layer| hazards.layer(layer).map(Raster::data);
        let rows = Rows { heights: &map, skip: 0, verdict: hazards.verdict().data(), layer: &layer };
        let dir = self.a.out.as_deref().unwrap_or(Path::new(""));
        account.rows(&rows).map_err(unwritten_raster(dir))?;
        if let Some(files) = &mut account.files {
            files.clearance(hazards.clearance().data()).map_err(unwritten_raster(dir))?;
            files.layer_pictures(&hazards)?;
        }
        let request = SiteRequest {
            rule: match self.a.rule {
                Rule::Spiral => SiteRule::Spiral,
                Rule::Clearance => SiteRule::Clearance,
                Rule::Score => SiteRule::Score(ScoreWeights::default()),
            },
            start: Some(self.start),
            count: self.a.sites as usize,
            separation_m: self.separation,
            ..SiteRequest::default()
        };
        let sites = choose_sites(&map, &hazards, &request).map_err(defect)?.sites;
        Ok((sites, Features::find(self.a, self.criteria, &map, watched)?))
    }

    fn in_bands(
        &self,
        map: &mut MapFile,
        geometry: &Geometry,
        memory: u64,
        account: &mut Account,
        watched: &Watched,
    ) -> Result<Vec<Site>, Refusal> {
        let options = SurveyOptions {
            memory,
            start: Some(self.start),
            count: self.a.sites as usize,
            separation_m: self.separation,
            ..SurveyOptions::default()
        };
        let heights = self.a.map.open_ground(memory / PIXEL_BYTES)?;
        let mut bands = Bands { account, heights, watched, failure: None };
        let found = survey(map, self.criteria, &options, &mut bands, &|pixels| watched.assesses(pixels));
        if let Some(failure) = bands.failure.take() {
            return Err(failure);
        }
        let (counts, sites) = found.map_err(|e| self.a.map.defect(e))?;
        let is_whole = watched.fraction(geometry) >= 1.0;
        if is_whole && counts.safe + counts.unsafe_ == 0 && account.summary.height_min_m.is_none() {
            return Err(self.a.map.defect(TerrainError::Empty { pixels: geometry.pixels() }));
        }
        Ok(sites)
    }

    fn report(
        &self,
        criteria_name: String,
        account: Account,
        sites: &[Site],
        features: Features,
        assessed_fraction: f64,
    ) -> Report {
        let counts = account.counts;
        let pixels = (account.summary.rows * account.summary.cols) as u64;
        Report {
            map: account.summary,
            criteria_name,
            criteria: *self.criteria,
            warning: self.criteria.unsafe_because(),
            assessed_fraction,
            safe_fraction: counts.safe_fraction(),
            pixels: Pixels {
                safe: counts.safe,
                not_safe: counts.unsafe_,
                unknown: pixels - counts.safe - counts.unsafe_,
            },
            unsafe_by: account.by,
            start: self.start,
            rule: match self.a.rule {
                Rule::Spiral => "spiral",
                Rule::Clearance => "clearance",
                Rule::Score => "score",
            },
            separation_m: self.separation,
            sites: sites.iter().map(|site| SiteRow::new(site, self.projection)).collect(),
            features,
            files: Vec::new(),
        }
    }
}

impl Report {
    /// Writes the report beside the other files, and lists them all.
    fn write(&mut self, dir: &Path, paths: &mut Vec<PathBuf>) -> Result<(), Refusal> {
        paths.push(write(&dir.join("sites.csv"), &self.csv()?)?);
        paths.extend(["hazard.json", "hazard.html"].map(|name| dir.join(name)));
        self.files = paths.iter().map(|p| p.display().to_string()).collect();
        write(&dir.join("hazard.json"), &self.json()?)?;
        write(&dir.join("hazard.html"), &self.page(dir)?)?;
        Ok(())
    }

    fn show(&self, paths: &[PathBuf]) -> Result<(), Refusal> {
        if is_json() {
            print(&self.json()?);
            return Ok(());
        }
        print_words(&self.text());
        if !paths.is_empty() {
            print(&written(paths));
            print_words(&format!("\ncolours of map.png: {}\n", HazardPicture::LEGEND));
        }
        Ok(())
    }

    fn json(&self) -> Result<String, Refusal> {
        Ok(format!("{}\n", serde_json::to_string_pretty(self).map_err(refusal)?))
    }

    /// The page: what is safe in a sentence, the map with hazards and sites, what makes it unsafe, the sites.
    fn page(&self, dir: &Path) -> Result<String, Refusal> {
        let mut page = Page::new(&format!("Hazards of {}", name(&self.map.file)));
        let known = (self.pixels.safe + self.pixels.not_safe) as f64;
        let percent = |count: u64| if known > 0.0 { 100.0 * count as f64 / known } else { 0.0 };
        page.lead(&format!(
            "{:.1} % of the known ground is safe by the criteria {}; {}.",
            percent(self.pixels.safe),
            self.criteria_name,
            match self.sites.len() {
                0 => "there is no safe site".to_owned(),
                1 => "one site is found".to_owned(),
                count => format!("{count} sites are found"),
            }
        ));
        if let Some(warning) = &self.warning {
            page.warning(warning);
        }
        let map = dir.join("map.png");
        if map.is_file() {
            let png = regular_file::read(&map).map_err(|e| refusal(format!("{}: {e}", map.display())))?;
            let [east, north] = self.map.extents();
            let picture = MapPicture {
                png: &png,
                origin: "the south-western corner",
                east: [0.0, east],
                north: [0.0, north],
            };
            page.map(&format!("Map: {}", HazardPicture::LEGEND), picture);
        }
        page.heading("What is unsafe");
        let row = |name: &str, count: u64| {
            vec![name.to_owned(), format!("{:.3}", percent(count)), count.to_string()]
        };
        let mut rows = vec![row("safe", self.pixels.safe), row("unsafe", self.pixels.not_safe)];
        rows.extend(self.unsafe_by.iter().map(|(name, count)| row(&format!("unsafe by {name}"), *count)));
        page.table(&["ground", "% of known pixels", "pixels"], &rows);
        if !self.sites.is_empty() {
            page.heading("Sites");
            let columns = self.columns();
            let heads = [
                "site",
                "row",
                "column",
                "east (m)",
                "north (m)",
                "height (m)",
                "clearance (m)",
                "divert (m)",
            ];
            let heads: Vec<&str> = heads.into_iter().chain(columns.iter().map(|c| c.as_str())).collect();
            let rows = self.sites.iter().enumerate().map(|(k, s)| {
                let clearance = s.clearance_m.map_or_else(|| "-".into(), |c| format!("{c:.3}"));
                let place = [k + 1, s.row, s.col].map(|n| n.to_string());
                let numbers = [s.east_m, s.north_m, s.height_m].map(|v| format!("{v:.3}"));
                let layers = columns
                    .iter()
                    .map(|c| s.layers.get(*c).map_or_else(|| "-".into(), |v| format!("{v:.3}")));
                let more = [clearance, format!("{:.2}", s.divert_m)].into_iter().chain(layers);
                place.into_iter().chain(numbers).chain(more).collect()
            });
            page.table(&heads, &rows.collect::<Vec<Vec<String>>>());
        }
        Ok(page.finish())
    }

    fn columns(&self) -> Vec<&String> {
        self.sites.first().map_or(Vec::new(), |site| site.layers.keys().collect())
    }

    fn csv(&self) -> Result<String, Refusal> {
        const HEADS: [&str; 9] =
            ["site", "row", "col", "east_m", "north_m", "height_m", "clearance_m", "divert_m", "visited"];
        let columns = self.columns();
        let in_degrees = self.sites.iter().any(|s| s.longitude_deg.is_some());
        let degrees = if in_degrees { &["longitude_deg", "latitude_deg"][..] } else { &[] };
        let heads = HEADS.into_iter().chain(columns.iter().map(|c| c.as_str()));
        let heads = heads.chain(degrees.iter().copied()).map(str::to_owned);
        let row = |(k, s): (usize, &SiteRow)| {
            let clearance = s.clearance_m.map_or(String::new(), |c| c.to_string());
            let place = [k + 1, s.row, s.col].map(|n| n.to_string());
            let numbers = [s.east_m, s.north_m, s.height_m].map(|n| n.to_string());
            let divert = [clearance, s.divert_m.to_string(), s.visited.to_string()];
            let layers = columns.iter().map(|c| s.layers.get(*c).map_or_else(String::new, f64::to_string));
            let degrees = [s.longitude_deg, s.latitude_deg].into_iter().flatten().map(|d| d.to_string());
            place.into_iter().chain(numbers).chain(divert).chain(layers).chain(degrees).collect::<Vec<_>>()
        };
        csv(heads, self.sites.iter().enumerate().map(row))
    }

    fn text(&self) -> String {
        let mut text = self.map.text();
        let all = (self.pixels.safe + self.pixels.not_safe + self.pixels.unknown) as f64;
        let mut line = |name: &str, count: u64, of: f64| {
            let part = if of > 0.0 { 100.0 * count as f64 / of } else { 0.0 };
            let _ = writeln!(text, "{name:<26}{part:>8.3} %{count:>13} pixels");
        };
        let known = (self.pixels.safe + self.pixels.not_safe) as f64;
        line("safe, of known pixels", self.pixels.safe, known);
        line("unsafe, of known pixels", self.pixels.not_safe, known);
        for (name, count) in &self.unsafe_by {
            line(&format!("  {name}"), *count, known);
        }
        line("unknown, of all pixels", self.pixels.unknown, all);
        if self.assessed_fraction < 1.0 {
            let percent = 100.0 * self.assessed_fraction;
            let _ = writeln!(
                text,
                "{}: {percent:.3} % of the map is assessed, the rest counts as unknown",
                reason()
            );
        }
        let [row, col] = self.start;
        let _ = writeln!(
            text,
            "\ncriteria {}, sites by {} from row {row}, column {col}, {} m apart\n",
            self.criteria_name, self.rule, self.separation_m
        );
        if let Some(warning) = &self.warning {
            let _ = writeln!(text, "{} {warning}\n", warned("warning:"));
        }
        if self.sites.is_empty() {
            text += "no safe site\n";
            text += &self.features.text();
            return text;
        }
        let columns = self.columns();
        let names = ["site", "row", "col", "east_m", "north_m", "height_m", "clearance_m", "divert_m"];
        let names: Vec<String> =
            names.into_iter().chain(columns.iter().map(|c| c.as_str())).map(str::to_owned).collect();
        text += &heads(&names, "");
        for (k, s) in self.sites.iter().enumerate() {
            let clearance = s.clearance_m.map_or("unlimited".into(), |c| format!("{c:.3}"));
            let place = [k + 1, s.row, s.col].map(|n| n.to_string());
            let [east, north, divert] = [s.east_m, s.north_m, s.divert_m].map(|v| format!("{v:.2}"));
            let layer = |c: &&String| format!("{:.3}", s.layers.get(*c).copied().unwrap_or(f64::NAN));
            let cells =
                place.into_iter().chain([east, north, format!("{:.3}", s.height_m), clearance, divert]);
            let cells: Vec<String> = cells.chain(columns.iter().map(layer)).collect();
            text += &crate::output::columns(&names, &cells);
            if let (Some(longitude), Some(latitude)) = (s.longitude_deg, s.latitude_deg) {
                text += &format!("  longitude {longitude:.6}, latitude {latitude:.6} deg");
            }
            text.push('\n');
        }
        text += &self.features.text();
        text
    }
}
