//! Files of the sites that were chosen on maps: a picture and the candidates of each.

use apsides_pipeline::ChosenSite;
use apsides_terrain::ElevationMap;
use apsides_terrain::hazard::Verdict;
use apsides_terrain::site::selection::SiteSelection;

use crate::ReportError;
use crate::files::{Item, table_error};
use crate::hazard_picture::HazardPicture;
use crate::map_picture::MapPicture;

/// Names of the files of the maps that missions have.
const NAMES: [(&str, &str, &str); 2] =
    [("coarse", "coarse_map.png", "coarse_sites.csv"), ("fine", "fine_map.png", "fine_sites.csv")];

const COLUMNS: [&str; 13] = [
    "candidate",
    "chosen",
    "row",
    "col",
    "east_m",
    "north_m",
    "up_m",
    "clearance_m",
    "hazard",
    "outcome",
    "propellant_kg",
    "flight_time_s",
    "cost_kg",
];

/// Files of all maps; those without a choice of a site must not stay.
pub(crate) fn site_files(sites: &[ChosenSite]) -> Result<Vec<Item>, ReportError> {
    let mut items = Vec::new();
    for (map, picture, table) in NAMES {
        let mut on_maps = sites.iter().filter_map(ChosenSite::choice_as::<SiteSelection>);
        let site = on_maps.find(|s| s.name == map);
        items.push((picture, site.map(drawn).transpose()?));
        items.push((table, site.map(|s| candidates(table, s)).transpose()?));
    }
    Ok(items)
}

/// Pixels on a side of the part of a map that a page shows.
const PART: usize = 400;

/// The ground around the chosen site of a map, with all candidates there.
pub(crate) struct SitePicture {
    pub(crate) title: String,
    png: Vec<u8>,
    /// Edges, m from the chosen site.
    east: [f64; 2],
    north: [f64; 2],
}

impl SitePicture {
    pub(crate) fn picture(&self) -> MapPicture<'_> {
        let Self { png, east, north, .. } = self;
        MapPicture { png, origin: "the chosen site", east: *east, north: *north }
    }
}

/// The ground around the chosen site of each map.
pub(crate) fn site_pictures(sites: &[ChosenSite]) -> Result<Vec<SitePicture>, ReportError> {
    sites.iter().filter_map(ChosenSite::choice_as::<SiteSelection>).map(part).collect()
}

fn part(s: &SiteSelection) -> Result<SitePicture, ReportError> {
    let refused = |source| ReportError::Map { map: s.name.into(), source };
    let geometry = s.map.geometry();
    let site = &s.site().site;
    // A window around the site that stays on the map.
    let window = |middle: usize, all: usize| {
        let size = PART.min(all);
        (middle.saturating_sub(size / 2).min(all - size), size)
    };
    let ((row, rows), (col, cols)) = (window(site.row, geometry.rows()), window(site.col, geometry.cols()));
    let map = s.map.window(row, col, rows, cols).map_err(refused)?;
    let verdict = s.hazards.verdict().window(row, col, rows, cols).map_err(refused)?;
    let png = picture_of(s, &map, verdict.data(), [row, col])?;
    let pixel = geometry.square_pixel().map_err(refused)?;
    // From the centre of the site's pixel to the edge before a pixel.
    let distance = |edge: usize, site: usize| pixel * (edge as f64 - site as f64 - 0.5);
    Ok(SitePicture {
        title: format!("{} map around the chosen site: {}", s.name, HazardPicture::LEGEND),
        png,
        east: [distance(col, site.col), distance(col + cols, site.col)],
        north: [-distance(row + rows, site.row), -distance(row, site.row)],
    })
}

fn drawn(s: &SiteSelection) -> Result<Vec<u8>, ReportError> {
    picture_of(s, &s.map, s.hazards.verdict().data(), [0, 0])
}

/// A part of a map that begins at a pixel, with its verdicts and the candidates on it, the chosen one first.
fn picture_of(
    s: &SiteSelection,
    map: &ElevationMap,
    verdict: &[Verdict],
    from: [usize; 2],
) -> Result<Vec<u8>, ReportError> {
    let refused = |source| ReportError::Map { map: s.name.into(), source };
    let geometry = map.geometry();
    let mut picture = HazardPicture::new(geometry);
    picture.rows(map, 0, verdict).map_err(refused)?;
    let others = s.candidates.iter().enumerate().filter(|(k, _)| *k != s.chosen).map(|(_, c)| c);
    let inside = |row: usize, col: usize| {
        let [down, right] = [row.checked_sub(from[0])?, col.checked_sub(from[1])?];
        (down < geometry.rows() && right < geometry.cols()).then_some([down, right])
    };
    let places = [s.site()].into_iter().chain(others).filter_map(|c| inside(c.site.row, c.site.col));
    let pixel = geometry.square_pixel().map_err(refused)?;
    let mut bytes = Vec::new();
    picture.write(&mut bytes, places, s.hazards.criteria().clearance_min_m / pixel).map_err(refused)?;
    Ok(bytes)
}

fn candidates(file: &'static str, s: &SiteSelection) -> Result<Vec<u8>, ReportError> {
    let mut table = csv::Writer::from_writer(Vec::new());
    let failed = |e: csv::Error| table_error(file, e);
    table.write_record(COLUMNS).map_err(failed)?;
    for (k, c) in s.candidates.iter().enumerate() {
        let [east, north, up] = c.offset;
        let propellant = c.divert.propellant.unwrap_or(f64::NAN);
        let numbers = [propellant, c.divert.flight_time, c.cost.unwrap_or(f64::INFINITY)];
        let record = [
            (k + 1).to_string(),
            (k == s.chosen).to_string(),
            c.site.row.to_string(),
            c.site.col.to_string(),
            east.to_string(),
            north.to_string(),
            up.to_string(),
            c.site.clearance_m.to_string(),
            c.hazard.to_string(),
            c.divert.outcome().to_owned(),
        ];
        table.write_record(record.into_iter().chain(numbers.map(|n| n.to_string()))).map_err(failed)?;
    }
    table.into_inner().map_err(|e| table_error(file, e.into_error()))
}
