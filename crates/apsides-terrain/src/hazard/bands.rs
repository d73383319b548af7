//! Maps larger than memory, band by band.

use rayon::prelude::*;

use super::plan::{LAYERS, Plan, slot};
use super::tile::Rows;
use super::{Counts, HazardOptions, Layer, SiteCriteria, Verdict, Watch};
use crate::distance::{BAND, BandEdges, Envelope, Outside};
use crate::{ElevationMap, Geometry, TerrainError};

/// A map that is read by rows.
pub trait HeightSource {
    /// The places of the pixels of the whole map.
    fn geometry(&self) -> &Geometry;

    /// Height that the rows are relative to, m.
    fn datum(&self) -> f64;

    /// Replaces `heights` by those of rows `first..first + count` above the datum, m, row by row; what is not finite is a gap. Bands
    /// overlap by the margin of the footprint and come from north to south.
    ///
    /// # Errors
    /// The fault that keeps the source from being read.
    fn read_rows(&mut self, first: usize, count: usize, heights: &mut Vec<f32>) -> Result<(), TerrainError>;
}

impl HeightSource for &ElevationMap {
    fn geometry(&self) -> &Geometry {
        ElevationMap::geometry(self)
    }

    fn datum(&self) -> f64 {
        ElevationMap::datum(self)
    }

    fn read_rows(&mut self, first: usize, count: usize, heights: &mut Vec<f32>) -> Result<(), TerrainError> {
        let cols = ElevationMap::geometry(self).cols();
        heights.clear();
        heights.extend_from_slice(&self.relative().data()[first * cols..(first + count) * cols]);
        Ok(())
    }
}

/// Rows of a hazard map, the clearance excepted.
#[derive(Debug)]
pub struct HazardBand<'a> {
    /// First row in the map.
    pub first_row: usize,
    /// Verdicts, row by row.
    pub verdict: &'a [Verdict],
    layers: &'a [Vec<f32>; LAYERS],
    kept: [bool; LAYERS],
}

impl HazardBand<'_> {
    /// A layer, row by row, if it was kept; NaN where a footprint is not known.
    pub fn layer(&self, layer: Layer) -> Option<&[f32]> {
        self.kept[slot(layer)].then_some(&self.layers[slot(layer)][..])
    }
}

/// A receiver of finished rows.
pub trait HazardSink {
    /// Layers and verdicts, from north to south.
    ///
    /// # Errors
    /// The fault that keeps them from being taken.
    fn band(&mut self, band: &HazardBand) -> Result<(), TerrainError>;

    /// Distances to the nearest pixel that is not safe, m, from north to south, after all of the above: each depends on the whole map.
    ///
    /// # Errors
    /// The fault that keeps them from being taken.
    fn clearance(&mut self, first_row: usize, clearance: &[f32]) -> Result<(), TerrainError>;
}

/// The hazard map of a source, `band_rows` rows at a time, rounded up to a multiple of 128: the same numbers as
/// [`hazard_map_with`](super::hazard_map_with). In memory are one band of heights with its margin, one of results, and a bit for each
/// pixel of the map. `watch` may end the work: then the sink is told of the clearance of no more than
/// 128 rows beyond those that it had, and the counts are those of what it had.
///
/// # Errors
/// As [`hazard_map_with`](super::hazard_map_with), and those of source and sink; a threshold on relative elevation or on the angle
/// of normals without a plane, and one on edges.
pub fn hazard_bands(
    source: &mut impl HeightSource,
    criteria: &SiteCriteria,
    options: &HazardOptions,
    band_rows: usize,
    sink: &mut impl HazardSink,
    watch: Watch<'_>,
) -> Result<Counts, TerrainError> {
    let geometry = *source.geometry();
    const PLANE: &str = "a map in bands needs a plane that is given";
    const WHOLE: &str = "edges are relative to the largest gradient of a map, which bands do not have; take criteria without it, or the whole map";
    let has_plane = options.plane.is_some();
    let of_whole_map = [
        ("relative_elevation_max_m", criteria.relative_elevation_max_m.filter(|_| !has_plane), PLANE),
        ("normals.slope_max_deg", criteria.normals.map(|n| n.slope_max_deg).filter(|_| !has_plane), PLANE),
        ("edges_max", criteria.edges_max, WHOLE),
    ];
    for (name, value, allowed) in of_whole_map {
        if let Some(value) = value {
            return Err(TerrainError::Number { name, value, allowed: allowed.into() });
        }
    }
    let plan = Plan::new(&geometry, source.datum(), criteria, options)?;
    let pixel_m = geometry.square_pixel()?;
    let [rows, cols] = [geometry.rows(), geometry.cols()];
    let band_rows = band_rows.clamp(1, rows).next_multiple_of(BAND);
    let mut marks = Marks { words: cols.div_ceil(64), bits: Vec::new() };
    let mut counts = Counts::default();
    let mut edges = Vec::new();
    let mut heights = Vec::new();
    let mut layers: [Vec<f32>; LAYERS] = Default::default();
    let mut verdict = Vec::new();
    let mut flags: Vec<u8> = Vec::new();
    // Rows that are told of.
    let mut told = rows;
    for first in (0..rows).step_by(band_rows) {
        if !watch(0) {
            // The ground behind the last row is not safe.
            told = (first + BAND).min(rows);
            flags.clear();
            flags.resize((told - first) * cols, 1);
            edges.push(BandEdges::of(&flags, cols));
            flags.chunks_exact(cols).for_each(|row| marks.push(row));
            break;
        }
        let end = (first + band_rows).min(rows);
        let (from, to) = (first.saturating_sub(plan.halo), (end + plan.halo).min(rows));
        source.read_rows(from, to - from, &mut heights)?;
        if heights.len() != (to - from) * cols {
            return Err(TerrainError::Shape { rows: to - from, cols, values: heights.len() });
        }
        heights.par_iter_mut().filter(|z| !z.is_finite()).for_each(|z| *z = f32::NAN);
        for (layer, kept) in layers.iter_mut().zip(plan.kept) {
            layer.resize(if kept { (end - first) * cols } else { 0 }, 0.0);
        }
        verdict.resize((end - first) * cols, Verdict::Unknown);
        let here = Rows { data: &heights, first: from, map: [rows, cols] };
        plan.rows(&here, first, end, &mut layers, &mut verdict, watch);
        sink.band(&HazardBand { first_row: first, verdict: &verdict, layers: &layers, kept: plan.kept })?;
        let band = Counts::of(&verdict);
        counts.safe += band.safe;
        counts.unsafe_ += band.unsafe_;
        counts.unknown += band.unknown;
        flags.clear();
        flags.extend(verdict.iter().map(|v| u8::from(*v != Verdict::Safe)));
        edges.par_extend(flags.par_chunks(BAND * cols).map(|flags| BandEdges::of(flags, cols)));
        flags.chunks_exact(cols).for_each(|row| marks.push(row));
    }
    let outside = Outside::of_all(&edges);
    drop((edges, heights, layers, verdict));
    let mut clearance = Vec::new();
    for first in (0..told).step_by(band_rows) {
        let end = (first + band_rows).min(told);
        clearance.resize((end - first) * cols, 0.0);
        clearance.par_chunks_mut(BAND * cols).enumerate().for_each_init(
            || (Vec::new(), Envelope::default()),
            |(flags, envelope), (k, part)| {
                let row = first + k * BAND;
                marks.rows(row, part.len() / cols, cols, flags);
                envelope.distances(flags, &outside[row / BAND], pixel_m, part);
            },
        );
        sink.clearance(first, &clearance)?;
    }
    Ok(counts)
}

/// One bit for each pixel, set if it is not safe.
struct Marks {
    /// Words of a row.
    words: usize,
    bits: Vec<u64>,
}

impl Marks {
    /// Adds a row.
    fn push(&mut self, flags: &[u8]) {
        let word = |flags: &[u8]| (0..).zip(flags).fold(0, |word, (k, flag)| word | (u64::from(*flag) << k));
        self.bits.extend(flags.chunks(64).map(word));
    }

    /// Some rows as bytes.
    fn rows(&self, first: usize, count: usize, cols: usize, flags: &mut Vec<u8>) {
        flags.clear();
        for row in self.bits[first * self.words..].chunks_exact(self.words).take(count) {
            flags.extend((0..cols).map(|col| (row[col / 64] >> (col % 64)) as u8 & 1));
        }
    }
}
