//! `apsides terrain`, and reading maps.

use std::fs::File;
use std::io::{BufReader, Read as _};
use std::path::{Path, PathBuf};

use apsides::missions::data::body_radius_m;
use apsides::pipeline::memory::Foreseen;
use apsides::pipeline::regular_file;
use apsides::pipeline::whole_file::{WholeFile, write_whole};
use apsides::terrain::io::{Equirectangular, Format, GeoTiffOptions, GeoTiffWriter, ReadOptions, Windows};
use apsides::terrain::synthetic::{Limits, Synthetic, Terrain};
use apsides::terrain::{Geometry, MapUnit, TerrainError};
use serde::Serialize;

use crate::arguments::{GenArguments, Ground, MapArguments, Threads};
use crate::commands::{made, probe_directory};
use crate::exit::{Exit, Refusal, lost, refusal, unwritten};
use crate::output::{print, print_json, written};
use crate::progress::Progress;
use crate::sentence::name;
use crate::speech::is_json;
use crate::stop::{StopFlag, stopped};

/// A map file that is read in windows.
pub(crate) type MapFile = Windows<BufReader<File>>;

/// Longest label that is read, bytes.
const LONGEST_LABEL: u64 = 1 << 22;

/// Pixels of a band of rows that is made or read at once.
const BAND_PIXELS: usize = 1 << 22;

/// Hazards of the truth: craters this deep, boulders this high, m.
const TRUTH: Limits = Limits { crater_depth: 0.15, boulder_height: 0.15 };

impl MapArguments {
    /// Opens the map; `max_pixels` may be held at once. One in degrees stays so unless the body is given.
    pub(crate) fn open(&self, max_pixels: u64) -> Result<MapFile, Refusal> {
        let Some(body) = &self.body else { return self.open_on(None, max_pixels) };
        let radius = body_radius_m(body, "--body").map_err(refusal)?;
        let map = self.open_on(Some(radius), max_pixels)?;
        if map.projection().is_none() {
            let file = name(&self.map.to_string_lossy());
            return Err(
                format!("--body: {file} is not read in degrees and needs no body; leave it out").into()
            );
        }
        Ok(map)
    }

    /// Opens the map as ground in metres: one in degrees takes the radius that its file states where no body is given.
    pub(crate) fn open_ground(&self, max_pixels: u64) -> Result<MapFile, Refusal> {
        let map = self.open(max_pixels)?;
        match (map.geometry().unit(), map.stated_radius_m()) {
            (MapUnit::Metre, _) => Ok(map),
            (MapUnit::Degree, Some(radius)) => self.open_on(Some(radius), max_pixels),
            (MapUnit::Degree, None) => {
                let file = name(&self.map.to_string_lossy());
                Err(format!(
                    "{file}: the map is in degrees and states no radius: name its body, as with --body moon"
                )
                .into())
            }
        }
    }

    fn open_on(&self, body_radius_m: Option<f64>, max_pixels: u64) -> Result<MapFile, Refusal> {
        let options = ReadOptions {
            pixel_m: self.pixel,
            body_radius_m,
            z_scale: self.z_scale,
            nodata: self.nodata,
            max_pixels,
            ..ReadOptions::default()
        };
        let file = open(&self.map)?;
        let mut start = Vec::new();
        open(&self.map)?.take(512).read_to_end(&mut start).map_err(|e| self.unreadable(e))?;
        let is_label =
            ["lbl", "xml"].iter().any(|e| self.map.extension().is_some_and(|x| x.eq_ignore_ascii_case(e)));
        let opened = match Format::detect(&start) {
            Some(Format::Pds3 | Format::Pds4) if is_label => {
                let mut label = Vec::new();
                file.take(LONGEST_LABEL).read_to_end(&mut label).map_err(|e| self.unreadable(e))?;
                Windows::open_labelled(&label, BufReader::new(open(&self.raster()?)?), &options)
            }
            _ => Windows::open(BufReader::new(file), &options),
        };
        opened.map_err(|e| self.defect(e))
    }

    /// A sentence on what is wrong with the map.
    pub(crate) fn defect(&self, e: TerrainError) -> Refusal {
        let file = name(&self.map.to_string_lossy());
        refusal(match e {
            TerrainError::NoPixelSize { format } => {
                format!("{file}: {format}, size of a pixel: the file states none: give one with --pixel")
            }
            e => format!("{file}: {e}"),
        })
    }

    fn unreadable(&self, e: std::io::Error) -> Refusal {
        refusal(format!("{}: {e}", name(&self.map.to_string_lossy())))
    }

    /// The raster beside a label: the file of the same name with another ending.
    fn raster(&self) -> Result<PathBuf, Refusal> {
        let endings = ["img", "IMG", "Img", "dat", "DAT", "raw", "RAW", "tif", "TIF"];
        let found = endings.iter().map(|e| self.map.with_extension(e)).find(|p| p.is_file());
        found.ok_or_else(|| {
            let label = self.map.display();
            refusal(format!("{label}: the raster of the label is not beside it; expected the same name ending in .img or .dat"))
        })
    }
}

fn open(path: &Path) -> Result<File, Refusal> {
    let shown = name(&path.to_string_lossy());
    let file = regular_file::open(path).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => format!("{shown}: no such file"),
        _ => format!("{shown}: {e}"),
    })?;
    Ok(file)
}

/// The projection of a map that was in degrees.
#[derive(Serialize)]
struct Projection {
    name: &'static str,
    radius_m: f64,
    /// Along it metres to the east are true.
    latitude_deg: f64,
}

/// Summary of a map.
#[derive(Serialize)]
pub(crate) struct MapSummary {
    pub(crate) file: String,
    pub(crate) rows: usize,
    pub(crate) cols: usize,
    /// Extents of a pixel to the east and to the south.
    pixel: [f64; 2],
    /// Centre of the north-western pixel (east, north).
    north_west: [f64; 2],
    unit: &'static str,
    /// The projection of a map in degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    projection: Option<Projection>,
    pub(crate) height_min_m: Option<f64>,
    pub(crate) height_max_m: Option<f64>,
    pub(crate) gaps: u64,
}

impl MapSummary {
    /// Lengths to the east and to the north, in the unit of the map.
    pub(crate) fn extents(&self) -> [f64; 2] {
        [self.cols as f64 * self.pixel[0], self.rows as f64 * self.pixel[1]]
    }

    pub(crate) fn new(file: &Path, geometry: &Geometry, projection: Option<Equirectangular>) -> Self {
        Self {
            projection: projection.map(|p| Projection {
                name: "equirectangular",
                radius_m: p.radius_m,
                latitude_deg: p.latitude_deg,
            }),
            file: file.display().to_string(),
            rows: geometry.rows(),
            cols: geometry.cols(),
            pixel: geometry.pixel(),
            north_west: geometry.north_west(),
            unit: if geometry.unit() == MapUnit::Metre { "m" } else { "deg" },
            height_min_m: None,
            height_max_m: None,
            gaps: 0,
        }
    }

    /// Takes heights into account, m; gaps are none.
    pub(crate) fn add(&mut self, range: Option<[f64; 2]>, gaps: usize) {
        if let Some([low, high]) = range {
            self.height_min_m = Some(self.height_min_m.map_or(low, |z| z.min(low)));
            self.height_max_m = Some(self.height_max_m.map_or(high, |z| z.max(high)));
        }
        self.gaps += gaps as u64;
    }

    pub(crate) fn text(&self) -> String {
        let [east, south] = self.pixel;
        let size = if east == south { format!("{east}") } else { format!("{east} x {south}") };
        let unit = self.unit;
        let (width, height) = (self.cols as f64 * east, self.rows as f64 * south);
        let mut text = format!(
            "{}: {} x {} pixels of {size} {unit}, {width} {unit} from west to east, {height} {unit} from north to south\n",
            self.file, self.rows, self.cols
        );
        let [x, y] = self.north_west;
        if let Some(Projection { name, radius_m, latitude_deg }) = &self.projection {
            text += &format!(
                "in degrees on a sphere of {} km: {name}, true along latitude {latitude_deg:.6} deg\n",
                radius_m / 1e3
            );
        }
        text += &format!("centre of the north-western pixel: east {x} {unit}, north {y} {unit}\n");
        text += &match (self.height_min_m, self.height_max_m) {
            (Some(low), Some(high)) => format!("heights from {low:.3} to {high:.3} m"),
            _ => "no height".into(),
        };
        let pixels = (self.rows * self.cols) as f64;
        text += &format!(", gaps: {} ({:.2} %)\n", self.gaps, 100.0 * self.gaps as f64 / pixels);
        text
    }
}

/// Rows of bands of a map with `cols` columns.
fn bands(rows: usize, cols: usize) -> impl Iterator<Item = (usize, usize)> {
    let height = (BAND_PIXELS / cols).max(1);
    (0..rows).step_by(height).map(move |first| (first, height.min(rows - first)))
}

pub(crate) fn info(a: &MapArguments) -> Result<Exit, Refusal> {
    let mut map = a.open(ReadOptions::default().max_pixels)?;
    let geometry = *map.geometry();
    let mut summary = MapSummary::new(&a.map, &geometry, map.projection());
    let progress = Progress::counted(StopFlag::install(), geometry.rows() as u64, "rows");
    for (first, count) in bands(geometry.rows(), geometry.cols()) {
        let part = map.window(first, 0, count, geometry.cols()).map_err(|e| a.defect(e))?;
        summary.add(part.range(), part.gaps());
        progress.advance(count as u64);
    }
    progress.finish();
    if is_json() {
        print_json(&summary)?;
    } else {
        print(&summary.text());
    }
    Ok(Exit::Verified)
}

pub(crate) fn generate(a: &GenArguments) -> Result<Exit, Refusal> {
    let preset = match a.preset {
        Ground::Coarse => Terrain::coarse(),
        Ground::Fine => Terrain::fine(),
    };
    let terrain = Terrain {
        rows: a.rows.unwrap_or(preset.rows),
        cols: a.cols.unwrap_or(preset.cols),
        pixel: a.pixel.unwrap_or(preset.pixel),
        ..preset
    };
    let ground = Synthetic::new(terrain, a.run.seed).map_err(refusal)?;
    // Before the work, not after it. The features of a truth are written for the whole map.
    for (first, count) in bands(terrain.rows, terrain.cols).take(1) {
        let count = if a.truth.is_some() { terrain.rows } else { count };
        let bytes = ground.foreseen_memory(first, 0, count, terrain.cols);
        let bytes = bytes.map_err(|e| format!("terrain gen: {e}"))?;
        let cause = format!("--cols {} of {} m", terrain.cols, terrain.pixel);
        Foreseen { bytes, cause }.within(a.run.memory()).map_err(refusal)?;
    }
    if let Some(dir) = &a.truth {
        probe_directory(dir)?;
        made(dir)?;
    }
    let pool = pool(&a.run.threads)?;
    let stop = a.run.limit.stop();
    let (rows, cols) = (terrain.rows, terrain.cols);
    let progress = Progress::counted(stop, rows as u64, "rows");
    let mut summary = MapSummary::new(&a.out, ground.geometry(), None);
    let mut files = vec![a.out.clone()];
    let options = GeoTiffOptions { deflate: true, ..GeoTiffOptions::default() };
    let mut map = tiff(&a.out, ground.geometry(), options.clone())?;
    let mut hazards = match &a.truth {
        Some(dir) => {
            let path = dir.join("hazards.tif");
            files.push(path.clone());
            Some((tiff(&path, ground.geometry(), options)?, path))
        }
        None => None,
    };
    for (first, count) in bands(rows, cols) {
        let part = pool.install(|| ground.window(first, 0, count, cols)).map_err(refusal)?;
        summary.add(part.range(), part.gaps());
        let heights: Vec<f32> =
            part.relative().data().iter().map(|z| (part.datum() + f64::from(*z)) as f32).collect();
        map.write_rows(&heights).map_err(unwritten_raster(&a.out))?;
        if let Some((file, path)) = &mut hazards {
            let mask = pool.install(|| ground.hazards(first, 0, count, cols, &TRUTH)).map_err(refusal)?;
            let mask: Vec<f32> = mask.data().iter().map(|bits| f32::from(*bits)).collect();
            file.write_rows(&mask).map_err(unwritten_raster(path))?;
        }
        progress.advance(count as u64);
        if stop.is_set() {
            return Err(stopped("no file is written"));
        }
    }
    publish(&a.out, map)?;
    if let Some((file, path)) = hazards {
        publish(&path, file)?;
    }
    progress.finish();
    if let Some(dir) = &a.truth {
        files.extend(write_truth(dir, &ground, a.run.seed)?);
    }
    if is_json() {
        print_json(&serde_json::json!({ "map": summary, "files": files }))?;
    } else {
        print(&summary.text());
        print(&written(&files));
    }
    Ok(Exit::Verified)
}

/// A GeoTIFF to be written in bands.
pub(crate) fn tiff(
    path: &Path,
    geometry: &Geometry,
    options: GeoTiffOptions,
) -> Result<GeoTiffWriter<WholeFile>, Refusal> {
    let file = WholeFile::create(path).map_err(unwritten(path))?;
    GeoTiffWriter::new(file, *geometry, options).map_err(unwritten_raster(path))
}

/// Ends a GeoTIFF and puts it into its place.
pub(crate) fn publish(path: &Path, file: GeoTiffWriter<WholeFile>) -> Result<(), Refusal> {
    file.finish().map_err(unwritten_raster(path))?.publish().map_err(lost(path))
}

/// A raster that is not written: by the system's fault, or its own.
pub(crate) fn unwritten_raster(path: &Path) -> impl Fn(TerrainError) -> Refusal + use<> {
    let path = path.to_owned();
    move |e| match e {
        TerrainError::Io { source, .. } => unwritten(&path)(source),
        e => format!("{}: {e}", path.display()).into(),
    }
}

/// Threads of the work.
pub(crate) fn pool(threads: &Threads) -> Result<rayon::ThreadPool, Refusal> {
    rayon::ThreadPoolBuilder::new().num_threads(threads.count()).build().map_err(refusal)
}

/// Writes the craters and boulders of synthetic ground.
fn write_truth(dir: &Path, ground: &Synthetic, seed: u64) -> Result<Vec<PathBuf>, Refusal> {
    let (rows, cols) = (ground.geometry().rows(), ground.geometry().cols());
    let craters = ground.craters(0, 0, rows, cols).map_err(refusal)?;
    let boulders = ground.boulders(0, 0, rows, cols).map_err(refusal)?;
    #[derive(Serialize)]
    struct Truth<'a> {
        seed: u64,
        /// Lengths in m, angles in rad.
        terrain: &'a Terrain,
        craters: usize,
        boulders: usize,
        /// In hazards.tif: 1 in a crater at least so deep, 2 on a boulder at least so high, 3 both.
        crater_depth_min_m: f64,
        boulder_height_min_m: f64,
    }
    let truth = Truth {
        seed,
        terrain: ground.terrain(),
        craters: craters.len(),
        boulders: boulders.len(),
        crater_depth_min_m: TRUTH.crater_depth,
        boulder_height_min_m: TRUTH.boulder_height,
    };
    let mut text = serde_json::to_string_pretty(&truth).map_err(refusal)?;
    text.push('\n');
    let craters = craters.iter().map(|c| {
        let [east, north] = c.centre;
        format!("{east},{north},{},{},{}\n", c.diameter, c.depth, c.rim)
    });
    let boulders = boulders.iter().map(|b| {
        let ([east, north], [long, short]) = (b.centre, b.axes);
        format!("{east},{north},{},{long},{short},{},{}\n", b.diameter, b.azimuth.to_degrees(), b.height)
    });
    let craters = format!("east_m,north_m,diameter_m,depth_m,rim_m\n{}", craters.collect::<String>());
    let boulders = format!(
        "east_m,north_m,diameter_m,long_axis_m,short_axis_m,azimuth_deg,height_m\n{}",
        boulders.collect::<String>()
    );
    let files = [("terrain.json", text), ("craters.csv", craters), ("boulders.csv", boulders)];
    files.into_iter().map(|(name, text)| write(&dir.join(name), &text)).collect()
}

/// Writes a text file and returns its path.
pub(crate) fn write(path: &Path, text: &str) -> Result<PathBuf, Refusal> {
    write_whole(path, text.as_bytes()).map_err(lost(path))?;
    Ok(path.to_owned())
}
