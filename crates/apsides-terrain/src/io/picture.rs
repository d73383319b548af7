//! Rasters as coloured pictures.

use std::io::Write;

use png::{BitDepth, ColorType, Encoder};

use super::digits::{ADVANCE, HEIGHT, dots};
use crate::{Raster, TerrainError};

/// Colours from the least value to the largest, straight lines in sRGB between equidistant control points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ColourMap {
    /// Black to white.
    Grey,
    /// Blue over green to yellow; perceptually uniform (S. van der Walt, N. Smith, 2015, CC0).
    Viridis,
    /// Black over red to white; perceptually uniform (S. van der Walt, N. Smith, 2015, CC0).
    Magma,
    /// Blue over grey to yellow, alike for people with and without colour vision deficiency (Nunez et al., PLoS ONE 13(7), 2018).
    Cividis,
}

impl ColourMap {
    fn points(self) -> &'static [u32] {
        match self {
            ColourMap::Grey => &[0x000000, 0xffffff],
            ColourMap::Viridis => {
                &[0x440154, 0x472d7b, 0x3b528b, 0x2c728e, 0x21918c, 0x28ae80, 0x5ec962, 0xaddc30, 0xfde725]
            }
            ColourMap::Magma => {
                &[0x000004, 0x1d1147, 0x51127c, 0x832681, 0xb73779, 0xe75263, 0xfc8961, 0xfec488, 0xfcfdbf]
            }
            ColourMap::Cividis => &[
                0x00224e, 0x083370, 0x35456c, 0x4f576c, 0x666970, 0x7d7c78, 0x948e77, 0xaea371, 0xc8b866,
                0xe5cf52, 0xfee838,
            ],
        }
    }

    /// Red, green and blue at `share` of the way from the least to the largest value; shares outside 0 to 1 are clamped.
    pub fn colour(self, share: f64) -> [u8; 3] {
        let points = self.points();
        let place = share.clamp(0.0, 1.0) * (points.len() - 1) as f64;
        let first = (place as usize).min(points.len() - 2);
        let part = place - first as f64;
        [16, 8, 0].map(|shift| {
            let level = |point: u32| f64::from(point >> shift & 0xff);
            (level(points[first]) * (1.0 - part) + level(points[first + 1]) * part).round() as u8
        })
    }
}

/// A colour bar beside the picture, its ends labelled with the range of values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Legend {
    /// Unit behind the numbers: `m`, `deg`, `%`; letters other than those of these, of `rad`, `km` and `m/s` stay blank.
    pub unit: String,
}

const BLACK: [u8; 4] = [0, 0, 0, 255];
const WHITE: [u8; 4] = [255; 4];
/// Gaps are transparent: no colour of a map can be taken for one.
const CLEAR: [u8; 4] = [0; 4];

/// Writes a raster as a PNG (RGBA, 8 bits), one picture element for each pixel, row 0 on top. `range` are the values of the first and the
/// last colour, by default the least and the largest value; values outside take the colour of the end. Gaps (NaN) are transparent.
///
/// # Errors
/// The writer's; a range that is not finite or ascending; sides of 2^31 or more.
pub fn write_png<W: Write>(
    writer: W,
    raster: &Raster<f32>,
    colours: ColourMap,
    range: Option<[f64; 2]>,
    legend: Option<&Legend>,
) -> Result<(), TerrainError> {
    let range = match range {
        Some([low, high]) if !(low.is_finite() && high.is_finite() && low < high) => {
            let allowed = "the range of colours must be finite and ascending";
            return Err(TerrainError::Number {
                name: "end of the range",
                value: high,
                allowed: allowed.into(),
            });
        }
        Some(range) => Some(range),
        None => extremes(raster),
    };
    let (rows, cols) = (raster.geometry().rows(), raster.geometry().cols());
    let bar = legend.map(|l| Bar::new(rows, cols, colours, range, &l.unit));
    let (height, extra) = bar.as_ref().map_or((rows, 0), |b| (b.height, b.width));
    let side = |n: usize| u32::try_from(n).ok().filter(|&n| n < 1 << 31);
    let (Some(picture_width), Some(picture_height)) = (side(cols + extra), side(height)) else {
        return Err(TerrainError::TooLarge { rows: rows as u64, cols: cols as u64, limit: (1 << 31) - 1 });
    };

    let failed = |e: png::EncodingError| TerrainError::Io { doing: "writing a picture", source: e.into() };
    let mut encoder = Encoder::new(writer, picture_width, picture_height);
    encoder.set_color(ColorType::Rgba);
    encoder.set_depth(BitDepth::Eight);
    let mut png = encoder.write_header().map_err(failed)?;
    let mut stream = png.stream_writer().map_err(failed)?;
    let mut line: Vec<u8> = Vec::with_capacity((cols + extra) * 4);
    let [low, high] = range.unwrap_or([0.0; 2]);
    for row in 0..height {
        line.clear();
        if row < rows {
            for &value in raster.row(row) {
                line.extend(if value.is_nan() {
                    CLEAR
                } else {
                    let share = if high > low { (f64::from(value) - low) / (high - low) } else { 0.5 };
                    opaque(colours.colour(share))
                });
            }
        } else {
            line.resize(cols * 4, 0);
        }
        if let Some(bar) = &bar {
            line.extend(bar.pixels[row * bar.width..(row + 1) * bar.width].iter().flatten());
        }
        stream.write_all(&line).map_err(super::unwritable)?;
    }
    stream.finish().map_err(failed)?;
    png.finish().map_err(failed)
}

fn opaque([r, g, b]: [u8; 3]) -> [u8; 4] {
    [r, g, b, 255]
}

/// Least and largest finite value.
fn extremes(raster: &Raster<f32>) -> Option<[f64; 2]> {
    let values = raster.data().iter().filter(|v| v.is_finite());
    let (low, high) = values.fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), &v| (l.min(v), h.max(v)));
    (low <= high).then(|| [f64::from(low), f64::from(high)])
}

/// The drawn legend, to the right of the picture.
struct Bar {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 4]>,
}

impl Bar {
    fn new(rows: usize, cols: usize, colours: ColourMap, range: Option<[f64; 2]>, unit: &str) -> Bar {
        // Dots of a letter grow with the picture.
        let dot = (rows.min(cols) / 250).clamp(1, 16);
        let labels: Vec<String> = range.map_or_else(Vec::new, |[low, high]| {
            [high, low]
                .iter()
                .map(|v| format!("{} {unit}", brief(*v, high - low)).trim_end().to_owned())
                .collect()
        });
        let letters = labels.iter().map(|l| l.chars().count()).max().unwrap_or(0);
        // Margin, bar, margin, text, margin, in dots.
        let (margin, bar) = (4, 10);
        let width = (3 * margin + bar + letters * ADVANCE) * dot;
        let height = rows.max((2 * HEIGHT + 4) * dot);
        let mut drawn = Bar { width, height, pixels: vec![WHITE; width * height] };
        for row in 0..height {
            let share = 1.0 - row as f64 / (height - 1).max(1) as f64;
            for col in margin * dot..(margin + bar) * dot {
                drawn.pixels[row * width + col] = opaque(colours.colour(share));
            }
        }
        for (label, top) in labels.iter().zip([dot, height - (HEIGHT + 1) * dot]) {
            let left = (2 * margin + bar) * dot;
            for (row, col) in dots(label) {
                for r in 0..dot {
                    let at = (top + row * dot + r) * width + left + col * dot;
                    drawn.pixels[at..at + dot].fill(BLACK);
                }
            }
        }
        drawn
    }
}

/// A number with digits that tell values apart in a range of extent `extent`.
fn brief(value: f64, extent: f64) -> String {
    let large = value.abs().max(extent);
    if large >= 1e6 || (large < 1e-3 && large > 0.0) {
        return format!("{value:.2e}");
    }
    let places = if extent > 0.0 { (2.0 - extent.log10().floor()).clamp(0.0, 6.0) as usize } else { 3 };
    format!("{value:.places$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_control_points_have_their_published_colours() {
        assert_eq!(ColourMap::Viridis.colour(0.0), [0x44, 0x01, 0x54]);
        assert_eq!(ColourMap::Viridis.colour(0.5), [0x21, 0x91, 0x8c]);
        assert_eq!(ColourMap::Viridis.colour(7.0), [0xfd, 0xe7, 0x25]);
        assert_eq!(ColourMap::Grey.colour(0.25), [64; 3]);
    }

    #[test]
    fn labels_tell_the_ends_apart() {
        assert_eq!(brief(-4472.67, 34.79), "-4472.7");
        assert_eq!(brief(0.0123, 0.01), "0.0123");
        assert_eq!(brief(2.5e7, 1.0), "2.50e7");
        assert_eq!(brief(12.0, 12.0), "12.0");
    }
}
