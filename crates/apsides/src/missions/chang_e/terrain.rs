//! Elevation maps of a landing: from files or from the generator.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use apsides_terrain::ElevationMap;
use apsides_terrain::io::{ReadOptions, read};
use apsides_terrain::synthetic::{Synthetic, Terrain};

use super::keys;
use crate::Error;
use crate::key::Values;

/// The map seen at the end of the adjustment.
pub(super) fn coarse(v: &Values) -> Result<ElevationMap, Error> {
    let terrain = sized(Terrain::coarse(), v.number(keys::COARSE_WIDTH), v.number(keys::COARSE_PIXEL));
    map(v, keys::COARSE_MAP, keys::COARSE_PIXEL, terrain)
}

/// The map seen at the hover.
pub(super) fn fine(v: &Values) -> Result<ElevationMap, Error> {
    let terrain = sized(Terrain::fine(), v.number(keys::FINE_WIDTH), v.number(keys::FINE_PIXEL));
    map(v, keys::FINE_MAP, keys::FINE_PIXEL, terrain)
}

fn sized(terrain: Terrain, width: f64, pixel: f64) -> Terrain {
    let pixel = if pixel.is_finite() { pixel } else { terrain.pixel };
    let side = (width / pixel).round() as usize;
    Terrain { rows: side, cols: side, pixel, ..terrain }
}

fn map(v: &Values, key: &str, pixel_key: &str, terrain: Terrain) -> Result<ElevationMap, Error> {
    let word = v.word(key);
    if word == keys::GENERATED {
        let seed = v.count(keys::TERRAIN_SEED) as u64;
        let made = Synthetic::new(terrain, seed).and_then(|s| s.map());
        return made.map_err(|e| Error::in_mission(format!("`{key}`: {e}")));
    }
    let path = Path::new(word);
    let file = File::open(path).map_err(|e| Error::File {
        path: path.into(),
        reason: format!("{e}; `{key}` takes \"{}\", \"{}\" or a map file", keys::NO_MAP, keys::GENERATED),
    })?;
    let pixel_m = Some(v.number(pixel_key)).filter(|p| p.is_finite());
    let options = ReadOptions { pixel_m, ..ReadOptions::default() };
    read(BufReader::new(file), &options).map_err(|e| {
        let reason =
            e.to_string().replace("give one (ReadOptions::pixel_m)", &format!("give one with `{pixel_key}`"));
        Error::File { path: path.into(), reason }
    })
}
