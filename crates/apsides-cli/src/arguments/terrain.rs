//! Arguments of `terrain` and `hazard`.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

use super::{RunArguments, Threads, TimeLimit};

/// Commands for elevation maps.
#[derive(Debug, Subcommand)]
pub(crate) enum TerrainCommand {
    /// Make a synthetic map as GeoTIFF: rolling ground with craters and boulders.
    #[command(after_help = "Examples:\n  \
        apsides terrain gen map.tif --preset coarse --seed 7\n  \
        apsides terrain gen map.tif --rows 500 --cols 500 --truth truth")]
    Gen(GenArguments),
    /// Describe a map: size, place, heights, gaps.
    #[command(after_help = "Examples:\n  \
        apsides terrain info map.tif\n  \
        apsides terrain info scene.npy --pixel 0.1 --json")]
    Info(MapArguments),
}

/// An elevation map and what its file may not say.
#[derive(Debug, Args)]
pub(crate) struct MapArguments {
    /// Map: GeoTIFF, TIFF, ESRI ASCII grid, .npy, PDS3, PDS4 or PNG; of a label, the raster of the same name beside it is read.
    pub(crate) map: PathBuf,
    /// Size of a square pixel, m; replaces the geometry of the file.
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub(crate) pixel: Option<f64>,
    /// Body of a map in degrees: a name that `apsides bodies` lists, or a path that ends with .toml. Its radius makes square pixels in
    /// metres, by the equirectangular projection that is true along the middle latitude.
    #[arg(long, value_name = "BODY")]
    pub(crate) body: Option<String>,
    /// Factor of the heights of the file, m for each of its units.
    #[arg(long, value_name = "M", default_value_t = 1.0, allow_negative_numbers = true)]
    pub(crate) z_scale: f64,
    /// A number that stands for a gap, beside those the file states.
    #[arg(long, value_name = "V", allow_negative_numbers = true)]
    pub(crate) nodata: Option<f64>,
}

/// Arguments of `hazard`.
#[derive(Debug, Args)]
pub(crate) struct HazardArguments {
    #[command(flatten)]
    pub(crate) map: MapArguments,
    /// Preset (chang-e-3-coarse, chang-e-3-fine, alhat; contest-coarse and contest-fine, which are unsafe, to compare) or file; by default
    /// chang-e-3-fine for pixels below 0.5 m, else chang-e-3-coarse.
    #[arg(long, value_name = "PRESET|FILE")]
    pub(crate) criteria: Option<String>,
    /// Pixel from which sites are sought and diverts are counted; by default the middle.
    #[arg(long, value_name = "ROW,COL", value_parser = pixel, allow_hyphen_values = true)]
    pub(crate) start: Option<[usize; 2]>,
    /// Rule that ranks the sites.
    #[arg(long, value_name = "RULE", value_enum, default_value_t = Rule::Spiral)]
    pub(crate) rule: Rule,
    /// Find craters with diameters in this range, m.
    #[arg(long, value_name = "MIN,MAX", value_parser = range)]
    pub(crate) craters: Option<[f64; 2]>,
    /// Least depth of a crater as a part of its diameter.
    #[arg(long, value_name = "PART", default_value_t = 0.05, allow_negative_numbers = true)]
    pub(crate) crater_depth: f64,
    /// Find boulders of at least this height over the ground around, m.
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub(crate) boulders: Option<f64>,
    /// Largest diameter of a boulder, m.
    #[arg(long, value_name = "M", default_value_t = 3.0, allow_negative_numbers = true)]
    pub(crate) boulder_diameter: f64,
    /// Give the probability of a safe landing at each pixel, where heights have white noise of this standard deviation, m.
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub(crate) noise: Option<f64>,
    /// Standard deviation of the touchdown point to the east and to the north, m, in the probability of a safe landing.
    #[arg(long, value_name = "M", default_value_t = 0.0, requires = "noise", allow_negative_numbers = true)]
    pub(crate) navigation_error: f64,
    /// Number of sites.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) sites: u32,
    /// Least distance between sites, m; by default twice the least clearance.
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub(crate) separation: Option<f64>,
    /// Write hazard.html, hazard.json, sites.csv, the layers as GeoTIFF and PNG, and the map with hazards and sites as PNG into this directory.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) threads: Threads,
    #[command(flatten)]
    pub(crate) limit: TimeLimit,
    /// Memory for pixels, MiB; a map that needs more is read in bands (rule spiral only, no PNG of layers).
    #[arg(long, value_name = "MIB", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) memory: u32,
}

/// Rule that ranks the sites.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Rule {
    /// The first on the clockwise square spiral from the start.
    Spiral,
    /// The largest clearance.
    Clearance,
    /// Margin to the thresholds and clearance against divert.
    Score,
}

/// Arguments of `terrain gen`.
#[derive(Debug, Args)]
pub(crate) struct GenArguments {
    /// GeoTIFF to write.
    pub(crate) out: PathBuf,
    /// Kind of ground: coarse is 2300 x 2300 pixels of 1 m, fine 1000 x 1000 of 0.1 m.
    #[arg(long, value_enum, default_value_t = Ground::Fine)]
    pub(crate) preset: Ground,
    /// Rows, instead of the preset's.
    #[arg(long, value_name = "N")]
    pub(crate) rows: Option<usize>,
    /// Columns, instead of the preset's.
    #[arg(long, value_name = "N")]
    pub(crate) cols: Option<usize>,
    /// Size of a pixel, m, instead of the preset's.
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub(crate) pixel: Option<f64>,
    /// Write what the ground is made of into this directory: terrain.json, craters.csv, boulders.csv, hazards.tif.
    #[arg(long, value_name = "DIR")]
    pub(crate) truth: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) run: RunArguments,
}

/// Kinds of ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Ground {
    /// Craters of 8 to 300 m, boulders of 1 to 8 m.
    Coarse,
    /// Craters of 1 to 30 m, boulders of 0.2 to 3 m.
    Fine,
}

fn range(text: &str) -> Result<[f64; 2], String> {
    let numbers = text.split_once(',').map(|(low, high)| (low.trim().parse(), high.trim().parse()));
    match numbers {
        Some((Ok(low), Ok(high))) => Ok([low, high]),
        _ => Err("two numbers are expected: least,largest".into()),
    }
}

fn pixel(text: &str) -> Result<[usize; 2], String> {
    let numbers = text.split_once(',').map(|(row, col)| (row.trim().parse(), col.trim().parse()));
    match numbers {
        Some((Ok(row), Ok(col))) => Ok([row, col]),
        _ => Err("two whole numbers from 0 are expected: row,column".into()),
    }
}
