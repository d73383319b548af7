//! A map with its hazards and sites as a picture: shaded relief, tinted by verdict, rings around sites.

use std::io::Write;

use apsides_terrain::hazard::Verdict;
use apsides_terrain::io::{Mark, ReliefPicture, Tint};
use apsides_terrain::light::{Sun, incidence};
use apsides_terrain::{ElevationMap, Geometry, TerrainError};

/// Most dots on a side.
const SIDE: usize = 2000;

/// Light of the relief: from the north-west, half up.
const SUN: [f64; 2] = [-std::f64::consts::FRAC_PI_4, std::f64::consts::FRAC_PI_4];

/// Colours that stay apart for people with a colour vision deficiency (M. Okabe, K. Ito, 2008): vermilion, blue.
const UNSAFE: Tint = Tint { colour: [213, 94, 0], strength: 0.45 };
const SAFE: Tint = Tint { colour: [0, 114, 178], strength: 0.35 };
const UNKNOWN: Tint = Tint { colour: [40, 40, 40], strength: 0.6 };
/// Colours of the rings: the first site, the others.
const FIRST: [u8; 3] = [255, 255, 255];
const OTHERS: [u8; 3] = [240, 228, 66];

/// A picture in the making, row by row from north to south.
#[derive(Debug)]
pub struct HazardPicture(ReliefPicture);

impl HazardPicture {
    /// The meaning of its colours.
    pub const LEGEND: &'static str =
        "blue safe, orange unsafe, dark unknown; rings: least clearance around each site, the first white";

    /// A picture of a map, of at most 2000 dots on a side.
    #[must_use]
    pub fn new(geometry: &Geometry) -> Self {
        Self(ReliefPicture::new(geometry, SIDE))
    }

    /// The next rows. `heights` has them after `skip` rows, with those before and after that shading needs; verdicts come row by row.
    ///
    /// # Errors
    /// As [`incidence`] and [`ReliefPicture::row`].
    pub fn rows(
        &mut self,
        heights: &ElevationMap,
        skip: usize,
        verdicts: &[Verdict],
    ) -> Result<(), TerrainError> {
        let light = incidence(heights, &Sun::new(SUN[0], SUN[1])?)?;
        let cols = heights.geometry().cols();
        for (row, verdicts) in verdicts.chunks_exact(cols).enumerate() {
            let row = skip + row;
            let heights = heights.relative().row(row);
            self.0.row(light.row(row), SUN[1].sin(), |col| match verdicts[col] {
                Verdict::Safe => Some(SAFE),
                Verdict::Unsafe(_) => Some(UNSAFE),
                Verdict::Unknown => (!heights[col].is_nan()).then_some(UNKNOWN),
            })?;
        }
        Ok(())
    }

    /// Draws rings of a radius (pixels) around sites, given by row and column, the best first, and writes the picture as PNG.
    ///
    /// # Errors
    /// As [`ReliefPicture::write`].
    pub fn write(
        self,
        out: impl Write,
        sites: impl IntoIterator<Item = [usize; 2]>,
        ring: f64,
    ) -> Result<(), TerrainError> {
        let mark = |(k, [row, col]): (usize, [usize; 2])| {
            let colour = if k == 0 { FIRST } else { OTHERS };
            Mark { row, col, radius: ring, number: k + 1, colour }
        };
        let marks: Vec<Mark> = sites.into_iter().enumerate().map(mark).collect();
        self.0.write(out, &marks)
    }
}
