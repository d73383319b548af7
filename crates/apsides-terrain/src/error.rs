//! Reasons to refuse a request.

use std::borrow::Cow;
use std::io;

use crate::MapUnit;

/// The reasons why a map could not be read, made or used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TerrainError {
    /// Reading or writing failed.
    #[error("{doing}: {source}")]
    Io {
        /// The kind of file that was read or written.
        doing: &'static str,
        /// The reader's or writer's own error.
        source: io::Error,
    },
    /// The bytes are not what their format promises.
    #[error("{format}, {place}: {problem}")]
    Malformed {
        /// Name of the format.
        format: &'static str,
        /// Where: a tag, a line, a keyword.
        place: String,
        /// The defect there, and the values allowed.
        problem: String,
    },
    /// The file is sound but uses what is not read.
    #[error("{format}: {feature} is not supported; supported: {supported}")]
    Unsupported {
        /// Name of the format.
        format: &'static str,
        /// The feature that the file uses.
        feature: String,
        /// The features that are supported instead.
        supported: &'static str,
    },
    /// More pixels than the caller allows.
    #[error(
        "map of {rows} x {cols} pixels: more than the limit of {limit} pixels; read it in windows or raise the limit"
    )]
    TooLarge {
        /// Rows of the map.
        rows: u64,
        /// Columns of the map.
        cols: u64,
        /// Most pixels that may be held.
        limit: u64,
    },
    /// A raster without pixels, or with another number of values than pixels.
    #[error(
        "raster of {rows} x {cols} pixels with {values} values: there must be one value for each pixel and at least one pixel"
    )]
    Shape {
        /// Rows stated.
        rows: usize,
        /// Columns stated.
        cols: usize,
        /// Values given.
        values: usize,
    },
    /// A number outside its range.
    #[error("{name} is {}: {allowed}", short(*value))]
    Number {
        /// Its name.
        name: &'static str,
        /// The number given.
        value: f64,
        /// The range allowed, in words, and what to do.
        allowed: Cow<'static, str>,
    },
    /// Pixels in degrees, or not square, where a square pixel in metres is needed.
    #[error(
        "pixels of {east} x {south} {unit}: square pixels in metres are needed; state the size of a pixel or resample the map"
    )]
    Pixel {
        /// Extent of a pixel to the east.
        east: f64,
        /// Extent of a pixel to the south.
        south: f64,
        /// Its unit.
        unit: MapUnit,
    },
    /// A file that states no size of its pixels, read without [`ReadOptions::pixel_m`](crate::io::ReadOptions::pixel_m).
    #[error("{format}, size of a pixel: the file states none: give one (ReadOptions::pixel_m)")]
    NoPixelSize {
        /// Name of the format.
        format: &'static str,
    },
    /// A pixel or window outside the map.
    #[error("row {row}, column {col} is outside the map of {rows} x {cols} pixels")]
    Outside {
        /// Row asked for.
        row: usize,
        /// Column asked for.
        col: usize,
        /// Rows of the map.
        rows: usize,
        /// Columns of the map.
        cols: usize,
    },
    /// A map without a single height, where one is needed.
    #[error("the map has no height at all: all of its {pixels} pixels are gaps")]
    Empty {
        /// Pixels of the map.
        pixels: usize,
    },
}

/// A number in few digits: hundreds of them say less than an exponent.
pub(crate) fn short(value: f64) -> String {
    let digits = value == 0.0 || !value.is_finite() || (1e-7..1e15).contains(&value.abs());
    if digits { value.to_string() } else { format!("{value:.3e}") }
}
