//! Files of `apsides hazard`: layers, and the map with hazards and sites.

use std::path::{Path, PathBuf};

use apsides::pipeline::whole_file::WholeFile;
use apsides::terrain::hazard::{HazardMap, Layer, Verdict};
use apsides::terrain::io::{ColourMap, GeoTiffOptions, GeoTiffWriter, Legend, write_png};
use apsides::terrain::site::Site;
use apsides::terrain::{ElevationMap, Geometry, Raster, TerrainError};
use apsides_report::HazardPicture;

use crate::exit::{Refusal, lost, refusal};
use crate::terrain::{publish, tiff, unwritten_raster};

/// A raster that is written row by row.
struct Target {
    path: PathBuf,
    file: GeoTiffWriter<WholeFile>,
}

/// Rows of a map with what was found on them.
pub(crate) struct Rows<'a> {
    /// Heights, with the rows before and after that shading needs.
    pub(crate) heights: &'a ElevationMap,
    /// Rows of `heights` before the first one.
    pub(crate) skip: usize,
    /// Verdicts, row by row.
    pub(crate) verdict: &'a [Verdict],
    /// A layer, row by row.
    pub(crate) layer: &'a dyn Fn(Layer) -> Option<&'a [f32]>,
}

/// Layers, verdicts, clearances and the picture, band by band.
pub(crate) struct Files {
    dir: PathBuf,
    layers: Vec<(Layer, Target)>,
    verdict: Target,
    clearance: Target,
    picture: HazardPicture,
    pictures: Vec<PathBuf>,
}

impl Files {
    pub(crate) fn new(
        dir: &Path,
        geometry: &Geometry,
        layers: &[Layer],
        options: &GeoTiffOptions,
    ) -> Result<Self, Refusal> {
        let target = |name: &str| {
            let path = dir.join(name);
            Ok::<_, Refusal>(Target { file: tiff(&path, geometry, options.clone())?, path })
        };
        let layers = layers.iter().map(|layer| Ok((*layer, target(&format!("{}.tif", stem(*layer)))?)));
        Ok(Self {
            dir: dir.to_owned(),
            layers: layers.collect::<Result<_, Refusal>>()?,
            verdict: target("verdict.tif")?,
            clearance: target("clearance_m.tif")?,
            picture: HazardPicture::new(geometry),
            pictures: Vec::new(),
        })
    }

    /// The directory of the files.
    pub(crate) fn dir(&self) -> &Path {
        &self.dir
    }

    /// The next rows, from north to south.
    pub(crate) fn rows(&mut self, rows: &Rows<'_>) -> Result<(), TerrainError> {
        let mut values = Vec::new();
        for (layer, target) in &mut self.layers {
            if let Some(layer_rows) = (rows.layer)(*layer) {
                values.clear();
                values.extend(layer_rows.iter().map(|v| shown(*layer, *v)));
                target.file.write_rows(&values)?;
            }
        }
        values.clear();
        values.extend(rows.verdict.iter().map(|v| code(*v)));
        self.verdict.file.write_rows(&values)?;
        self.picture.rows(rows.heights, rows.skip, rows.verdict)
    }

    /// The next rows of the distance to what is not safe, m.
    pub(crate) fn clearance(&mut self, rows: &[f32]) -> Result<(), TerrainError> {
        self.clearance.file.write_rows(rows)
    }

    /// Layers as pictures, of a map that is in memory.
    pub(crate) fn layer_pictures(&mut self, hazards: &HazardMap) -> Result<(), Refusal> {
        for (layer, raster) in hazards.layers() {
            self.picture_of(&stem(layer), &raster.map(|v| shown(layer, *v)), layer.unit())?;
        }
        self.picture_of("clearance_m", hazards.clearance(), "m")
    }

    fn picture_of(&mut self, name: &str, raster: &Raster<f32>, unit: &str) -> Result<(), Refusal> {
        self.pictures.push(write_picture(&self.dir, name, raster, unit)?);
        Ok(())
    }

    /// Ends all files, draws the sites and returns the paths.
    pub(crate) fn finish(self, sites: &[Site], ring: f64) -> Result<Vec<PathBuf>, Refusal> {
        let mut paths = Vec::new();
        let layers = self.layers.into_iter().map(|(_, target)| target);
        for target in layers.chain([self.verdict, self.clearance]) {
            publish(&target.path, target.file)?;
            paths.push(target.path);
        }
        let path = self.dir.join("map.png");
        let mut file = WholeFile::create(&path).map_err(lost(&path))?;
        let places = sites.iter().map(|s| [s.row, s.col]);
        self.picture.write(&mut file, places, ring).map_err(unwritten_raster(&path))?;
        file.publish().map_err(lost(&path))?;
        paths.extend(self.pictures);
        paths.push(path);
        Ok(paths)
    }
}

/// Writes a raster as a picture with a scale and returns its path.
pub(crate) fn write_picture(
    dir: &Path,
    name: &str,
    raster: &Raster<f32>,
    unit: &str,
) -> Result<PathBuf, Refusal> {
    let path = dir.join(format!("{name}.png"));
    let mut file = WholeFile::create(&path).map_err(lost(&path))?;
    let legend = Legend { unit: unit.into() };
    write_png(&mut file, raster, ColourMap::Viridis, None, Some(&legend)).map_err(unwritten_raster(&path))?;
    file.publish().map_err(lost(&path))?;
    Ok(path)
}

/// Name of a layer in files, with its unit.
pub(crate) fn stem(layer: Layer) -> String {
    format!("{} {}", layer.name().replace('-', "_"), layer.unit()).trim_end().replace(' ', "_")
}

/// A value of a layer in the unit of files.
fn shown(layer: Layer, value: f32) -> f32 {
    if layer.is_angle() { value.to_degrees() } else { value }
}

/// Number of a verdict in verdict.tif: 0 safe, k the k-th layer of [`Layer::ALL`], a gap for unknown.
fn code(verdict: Verdict) -> f32 {
    match verdict {
        Verdict::Safe => 0.0,
        Verdict::Unsafe(layer) => 1.0 + Layer::ALL.iter().position(|l| *l == layer).unwrap_or(0) as f32,
        Verdict::Unknown => f32::NAN,
    }
}

/// A table as CSV.
pub(crate) fn csv(
    heads: impl Iterator<Item = String>,
    rows: impl Iterator<Item = Vec<String>>,
) -> Result<String, Refusal> {
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(heads).map_err(refusal)?;
    for row in rows {
        table.write_record(row).map_err(refusal)?;
    }
    String::from_utf8(table.into_inner().map_err(refusal)?).map_err(refusal)
}
