//! Geographic tags of a GeoTIFF: size and place of pixels, geokeys (OGC 19-008r4).

use super::super::geo_keys::{
    ANGULAR_UNITS, DEGREE, GeoKeys, LINEAR_UNIT_SIZE, LINEAR_UNITS, METRE, MODEL_TYPE, RASTER_TYPE,
    SEMI_MAJOR_AXIS, USER_DEFINED, VERTICAL_UNITS,
};
use super::super::malformed;
use super::super::source::Head;
use super::directory::Directory;
use super::{NAME, tag};
use crate::{MapUnit, TerrainError};

/// Reads the three tags of the geokeys.
fn read_keys(directory: &Directory) -> Result<Option<GeoKeys>, TerrainError> {
    let Some(keys) = directory.whole(tag::GEO_KEYS)? else { return Ok(None) };
    let wrong = |problem: String| malformed(NAME, "geokeys (tag 34735)", problem);
    let keys: Result<Vec<u16>, _> = keys.into_iter().map(u16::try_from).collect();
    let keys = keys.map_err(|_| wrong("16-bit numbers are needed".to_owned()))?;
    let &[_, _, _, count, ..] = keys.as_slice() else {
        return Err(wrong("shorter than its head of four numbers".to_owned()));
    };
    if keys.len() < 4 * (usize::from(count) + 1) {
        return Err(wrong(format!("{count} keys do not fit into {} numbers", keys.len())));
    }
    Ok(Some(GeoKeys {
        directory: keys,
        doubles: directory.reals(tag::GEO_DOUBLES)?.unwrap_or_default(),
        text: directory.text(tag::GEO_TEXT)?.unwrap_or_default(),
    }))
}

/// Metres in a linear unit of EPSG.
fn metres(code: u16, defined: Option<f64>) -> Result<f64, TerrainError> {
    match code {
        0 | METRE => Ok(1.0),
        9002 => Ok(0.3048),
        9003 => Ok(1200.0 / 3937.0),
        9036 => Ok(1000.0),
        USER_DEFINED if defined.is_some_and(|d| d.is_finite() && d > 0.0) => Ok(defined.unwrap_or(1.0)),
        USER_DEFINED => Ok(1.0),
        _ => Err(TerrainError::Unsupported {
            format: NAME,
            feature: format!("linear unit {code}"),
            supported: "metre (9001), foot (9002), US survey foot (9003), kilometre (9036)",
        }),
    }
}

/// Puts size, place and unit of the pixels into `head`.
pub(super) fn place(directory: &Directory, head: &mut Head) -> Result<(), TerrainError> {
    let keys = read_keys(directory)?;
    let key = |k: u16| keys.as_ref().and_then(|g| g.short(k));
    let (unit, factor) = match key(MODEL_TYPE) {
        Some(2) => {
            let factor = match key(ANGULAR_UNITS).unwrap_or(DEGREE) {
                0 | DEGREE => 1.0,
                9101 => 180.0 / std::f64::consts::PI,
                code => {
                    return Err(TerrainError::Unsupported {
                        format: NAME,
                        feature: format!("angular unit {code}"),
                        supported: "radian (9101), degree (9102)",
                    });
                }
            };
            (MapUnit::Degree, factor)
        }
        Some(3) => {
            return Err(TerrainError::Unsupported {
                format: NAME,
                feature: "geocentric coordinates".to_owned(),
                supported: "projected and geographic coordinates",
            });
        }
        _ => {
            let defined = keys.as_ref().and_then(|g| g.double(LINEAR_UNIT_SIZE));
            (MapUnit::Metre, metres(key(LINEAR_UNITS).unwrap_or(METRE), defined)?)
        }
    };
    head.unit = unit;
    let radius = keys.as_ref().and_then(|g| g.double(SEMI_MAJOR_AXIS));
    head.radius_m = radius.filter(|r| unit == MapUnit::Degree && r.is_finite() && *r > 0.0);
    let height = metres(key(VERTICAL_UNITS).unwrap_or(METRE), None)?;
    head.scale *= height;
    head.offset *= height;
    // Raster coordinates of the centre of pixel (0, 0): pixels are areas unless stated otherwise.
    let centre = if key(RASTER_TYPE) == Some(2) { 0.0 } else { 0.5 };
    if let Some((pixel, north_west, south_up)) = affine(directory, centre, head.rows)? {
        head.pixel = Some(pixel.map(|p| p * factor));
        head.north_west = north_west.map(|c| c * factor);
        head.south_up = south_up;
    }
    let unit_key = if unit == MapUnit::Degree { (ANGULAR_UNITS, DEGREE) } else { (LINEAR_UNITS, METRE) };
    head.geo_keys = keys.map(|k| k.with(unit_key.0, unit_key.1).with(VERTICAL_UNITS, METRE));
    Ok(())
}

/// Size of a pixel, centre of the north-western pixel and whether the first row is the southernmost; none without geographic tags.
type Affine = ([f64; 2], [f64; 2], bool);

fn affine(directory: &Directory, centre: f64, rows: u64) -> Result<Option<Affine>, TerrainError> {
    if let Some(scale) = directory.reals(tag::PIXEL_SCALE)? {
        let place = "pixel scale (tag 33550)";
        let &[east, south, ..] = scale.as_slice() else {
            return Err(malformed(NAME, place, "fewer than two numbers"));
        };
        if !(east > 0.0 && south > 0.0) {
            return Err(malformed(NAME, place, format!("{east} x {south}: both must be positive")));
        }
        let tie = directory.reals(tag::TIE_POINT)?.unwrap_or_default();
        let north_west = match tie.as_slice() {
            // A scale without a place: the origin.
            [] => [0.0; 2],
            [i, j, _, x, y, _] => [x + (centre - i) * east, y - (centre - j) * south],
            _ => {
                return Err(TerrainError::Unsupported {
                    format: NAME,
                    feature: format!("a tie-point list of {} numbers with a pixel scale", tie.len()),
                    supported: "one tie point (six numbers)",
                });
            }
        };
        return Ok(Some(([east, south], north_west, false)));
    }
    if let Some(matrix) = directory.reals(tag::TRANSFORMATION)? {
        let place = "transformation (tag 34264)";
        let &[a, b, _, d, e, f, _, h, ..] = matrix.as_slice() else {
            return Err(malformed(NAME, place, "fewer than 16 numbers"));
        };
        if b.abs() > 1e-9 * a.abs() || e.abs() > 1e-9 * f.abs() {
            return Err(TerrainError::Unsupported {
                format: NAME,
                feature: "a rotated or sheared map".to_owned(),
                supported: "maps along the axes",
            });
        }
        if !(a > 0.0 && f != 0.0) {
            let problem = format!(
                "pixels of {a} to the east and {} to the south: a map that runs to the east with pixels of positive size is needed",
                -f
            );
            return Err(malformed(NAME, place, problem));
        }
        let south_up = f > 0.0;
        let northern = if south_up { centre + rows as f64 - 1.0 } else { centre };
        return Ok(Some(([a, f.abs()], [d + a * centre, h + f * northern], south_up)));
    }
    if directory.contains(tag::TIE_POINT) {
        return Err(TerrainError::Unsupported {
            format: NAME,
            feature: "tie points without a pixel scale".to_owned(),
            supported: "a pixel scale and one tie point, or a transformation",
        });
    }
    Ok(None)
}
