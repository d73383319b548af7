//! GeoTIFF: TIFF 6.0 and BigTIFF with the tags of OGC 19-008r4 and the two of GDAL (nodata, metadata with scale and offset).

use std::io::{Read, Seek};

pub(super) use super::chunks::NAME;
use super::chunks::{Chunks, Coding, Compression, Grid};
use super::raw::{Layout, Raw};
use super::sample::Sample;
use super::source::{Head, Store};
use super::{malformed, number};
use crate::TerrainError;

mod directory;
mod geo;
mod write;

use directory::Directory;
pub use write::{GeoTiffOptions, GeoTiffWriter, write_geotiff};

/// Tags, by their number in TIFF 6.0, GeoTIFF and GDAL.
mod tag {
    pub(super) const WIDTH: u16 = 256;
    pub(super) const LENGTH: u16 = 257;
    pub(super) const BITS: u16 = 258;
    pub(super) const COMPRESSION: u16 = 259;
    pub(super) const PHOTOMETRIC: u16 = 262;
    pub(super) const STRIP_OFFSETS: u16 = 273;
    pub(super) const SAMPLES: u16 = 277;
    pub(super) const ROWS_PER_STRIP: u16 = 278;
    pub(super) const STRIP_SIZES: u16 = 279;
    pub(super) const PREDICTOR: u16 = 317;
    pub(super) const TILE_WIDTH: u16 = 322;
    pub(super) const TILE_LENGTH: u16 = 323;
    pub(super) const TILE_OFFSETS: u16 = 324;
    pub(super) const TILE_SIZES: u16 = 325;
    pub(super) const SAMPLE_FORMAT: u16 = 339;
    pub(super) const PIXEL_SCALE: u16 = 33550;
    pub(super) const TIE_POINT: u16 = 33922;
    pub(super) const TRANSFORMATION: u16 = 34264;
    pub(super) const GEO_KEYS: u16 = 34735;
    pub(super) const GEO_DOUBLES: u16 = super::super::geo_keys::DOUBLES;
    pub(super) const GEO_TEXT: u16 = 34737;
    pub(super) const GDAL_METADATA: u16 = 42112;
    pub(super) const GDAL_NODATA: u16 = 42113;
    pub(super) const LERC: u16 = 50674;
    /// Tags whose values are read.
    pub(super) const READ: [u16; 24] = [
        WIDTH,
        LENGTH,
        BITS,
        COMPRESSION,
        PHOTOMETRIC,
        STRIP_OFFSETS,
        SAMPLES,
        ROWS_PER_STRIP,
        STRIP_SIZES,
        PREDICTOR,
        TILE_WIDTH,
        TILE_LENGTH,
        TILE_OFFSETS,
        TILE_SIZES,
        SAMPLE_FORMAT,
        PIXEL_SCALE,
        TIE_POINT,
        TRANSFORMATION,
        GEO_KEYS,
        GEO_DOUBLES,
        GEO_TEXT,
        GDAL_METADATA,
        GDAL_NODATA,
        LERC,
    ];
}

pub(super) fn open<R: Read + Seek>(mut reader: R, len: u64) -> Result<(Head, Store<R>), TerrainError> {
    let directory = Directory::read(&mut reader, len, &tag::READ)?;
    let side = |t: u16| {
        let side = directory.single(t, None)?;
        if u32::try_from(side).is_err() {
            return Err(malformed(NAME, format!("tag {t}"), format!("{side}: at most 2^32 - 1 is allowed")));
        }
        Ok(side)
    };
    let (rows, cols) = (side(tag::LENGTH)?, side(tag::WIDTH)?);
    if rows == 0 || cols == 0 {
        return Err(TerrainError::Shape { rows: rows as usize, cols: cols as usize, values: 0 });
    }
    let sample = sample(&directory)?;
    let lerc = directory.whole(tag::LERC)?;
    let compression = Compression::of(directory.single(tag::COMPRESSION, Some(1))?, lerc.as_deref())?;
    let predictor = directory.single(tag::PREDICTOR, Some(1))?;
    if !(matches!(predictor, 1 | 2) || (predictor == 3 && sample.is_real())) {
        return Err(TerrainError::Unsupported {
            format: NAME,
            feature: format!("predictor {predictor} of {sample:?} numbers"),
            supported: "none (1), horizontal (2), floating-point (3) of reals",
        });
    }
    let mut head = Head::plain(NAME, rows, cols, sample);
    if let Some(text) = directory.text(tag::GDAL_NODATA)? {
        let text = text.trim();
        // NaN and infinities are gaps anyway.
        let plain = text.trim_start_matches(['-', '+']).to_ascii_lowercase();
        if !["nan", "inf", "infinity", ""].contains(&plain.as_str()) {
            head.missing.push(number(NAME, "nodata (tag 42113)", text)?);
        }
    }
    if let Some(text) = directory.text(tag::GDAL_METADATA)? {
        metadata(&text, &mut head)?;
    }
    geo::place(&directory, &mut head)?;

    let grid = grid(&directory, rows, cols)?;
    let order = directory.order;
    if compression == Compression::None && predictor == 1 {
        let starts = grid.offsets.iter().zip(&grid.sizes).map(|(&o, &s)| (s > 0).then_some(o)).collect();
        let layout = Layout {
            format: NAME,
            sample,
            order,
            rows,
            cols,
            chunk_rows: grid.chunk_rows,
            chunk_cols: grid.chunk_cols,
            stride: grid.chunk_cols.saturating_mul(sample.size() as u64),
            starts,
            by_column: false,
        };
        return Ok((head, Store::Raw(Raw::new(reader, len, layout)?)));
    }
    let coding = Coding { sample, order, compression, predictor };
    Ok((head, Store::Chunks(Box::new(Chunks::new(reader, coding, grid)?))))
}

/// Type of the numbers of the only band.
fn sample(directory: &Directory) -> Result<Sample, TerrainError> {
    let bands = directory.single(tag::SAMPLES, Some(1))?;
    if bands != 1 {
        return Err(TerrainError::Unsupported {
            format: NAME,
            feature: format!("{bands} bands"),
            supported: "one band",
        });
    }
    let photometric = directory.single(tag::PHOTOMETRIC, None)?;
    if photometric != 1 {
        return Err(TerrainError::Unsupported {
            format: NAME,
            feature: format!("photometric interpretation {photometric}"),
            supported: "grey, black is zero (1)",
        });
    }
    let bits = directory.single(tag::BITS, Some(1))?;
    let kind = directory.single(tag::SAMPLE_FORMAT, Some(1))?;
    let sample = match kind {
        1 | 2 => Sample::integer(bits, kind == 2),
        3 => Sample::real(bits),
        _ => None,
    };
    sample.ok_or_else(|| TerrainError::Unsupported {
        format: NAME,
        feature: format!("numbers of {bits} bits and sample format {kind}"),
        supported: "integers of 8, 16 and 32 bits, reals of 32 and 64 bits",
    })
}

/// Strips or tiles.
fn grid(directory: &Directory, rows: u64, cols: u64) -> Result<Grid, TerrainError> {
    let tiled = directory.contains(tag::TILE_OFFSETS);
    let (offsets, sizes) =
        if tiled { (tag::TILE_OFFSETS, tag::TILE_SIZES) } else { (tag::STRIP_OFFSETS, tag::STRIP_SIZES) };
    let list = |t: u16| directory.whole(t)?.ok_or_else(|| malformed(NAME, format!("tag {t}"), "missing"));
    let (offsets, sizes) = (list(offsets)?, list(sizes)?);
    let (chunk_rows, chunk_cols) = if tiled {
        (directory.single(tag::TILE_LENGTH, None)?, directory.single(tag::TILE_WIDTH, None)?)
    } else {
        (directory.single(tag::ROWS_PER_STRIP, Some(rows))?, cols)
    };
    let place = if tiled { "tiles" } else { "strips" };
    for side in [chunk_rows, chunk_cols] {
        if side == 0 || u32::try_from(side).is_err() {
            return Err(malformed(NAME, place, format!("{chunk_rows} x {chunk_cols} pixels")));
        }
    }
    let expected = rows.div_ceil(chunk_rows) * cols.div_ceil(chunk_cols);
    if offsets.len() as u64 != expected || sizes.len() as u64 != expected {
        let problem = format!("{} offsets and {} sizes for {expected} of them", offsets.len(), sizes.len());
        return Err(malformed(NAME, place, problem));
    }
    // One strip may be declared longer than the map.
    let chunk_rows = if tiled { chunk_rows } else { chunk_rows.min(rows) };
    Ok(Grid { rows, cols, chunk_rows, chunk_cols, offsets, sizes })
}

/// Scale and offset of the first band from the metadata of GDAL, an XML list of items.
fn metadata(text: &str, head: &mut Head) -> Result<(), TerrainError> {
    let options = roxmltree::ParsingOptions { nodes_limit: 1 << 16, ..Default::default() };
    // Free text for people as a rule: what is no XML states no scale.
    let Ok(document) = roxmltree::Document::parse_with_options(text, options) else { return Ok(()) };
    for item in document.descendants().filter(|n| n.has_tag_name("Item")) {
        if item.attribute("sample").is_some_and(|s| s != "0") {
            continue;
        }
        let role = item.attribute("role").unwrap_or_default();
        let value = || number(NAME, "metadata (tag 42112)", item.text().unwrap_or_default());
        match role {
            "scale" => head.scale = value()?,
            "offset" => head.offset = value()?,
            _ => {}
        }
    }
    Ok(())
}
