//! Hazard maps of a raw file of heights: times, and layers for comparison.

use std::io::{Write, stdout};
use std::path::PathBuf;
use std::time::Instant;
use std::{fs, thread};

use apsides_benches::landing::Failure;
use apsides_terrain::hazard::{HazardOptions, Layer, LayerChoice, SiteCriteria, hazard_map_with};
use apsides_terrain::site::{SiteRequest, choose_sites};
use apsides_terrain::{ElevationMap, Geometry, Raster};
use clap::Parser;
use serde::Serialize;

/// Full layers of slope, roughness and contact slope, verdicts, distances to the nearest hazard and the site on the spiral.
#[derive(Debug, Parser)]
#[command(name = "hazard")]
struct Arguments {
    /// Heights, m, `f32` in the order of this machine, row by row.
    map: PathBuf,
    /// Columns.
    #[arg(long)]
    cols: usize,
    /// Size of a pixel, m.
    #[arg(long)]
    pixel: f64,
    /// Preset of the criteria.
    #[arg(long)]
    preset: String,
    /// Threads.
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// Runs; the least time counts.
    #[arg(long, default_value_t = 5)]
    repeat: usize,
    /// File for slope, roughness, contact slope and clearance, `f32`, one after the other.
    #[arg(long)]
    layers: Option<PathBuf>,
    /// Verdicts and clearance without full layers.
    #[arg(long)]
    verdicts: bool,
}

#[derive(Debug, Serialize)]
struct Report {
    seconds: f64,
    all_seconds: Vec<f64>,
    safe: u64,
    known: u64,
    site: Option<(usize, usize, u64)>,
}

fn main() -> Result<(), Failure> {
    let arguments = Arguments::parse();
    let criteria = SiteCriteria::preset(&arguments.preset).ok_or("there is no such preset")?;
    let bytes = fs::read(&arguments.map)?;
    let (values, _) = bytes.as_chunks::<4>();
    let heights: Vec<f64> = values.iter().map(|b| f64::from(f32::from_ne_bytes(*b))).collect();
    let geometry = Geometry::square(heights.len() / arguments.cols, arguments.cols, arguments.pixel)?;
    let map = ElevationMap::from_heights(geometry, &heights)?;
    let layers = if arguments.verdicts { LayerChoice::None } else { LayerChoice::Tested };
    let options = HazardOptions { layers, plane: None };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads).build()?;
    let mut all_seconds = Vec::new();
    let mut last = None;
    for _ in 0..arguments.repeat.max(1) {
        drop(last.take());
        let clock = Instant::now();
        let hazards = pool.install(|| hazard_map_with(&map, &criteria, &options))?;
        let choice = choose_sites(&map, &hazards, &SiteRequest::default())?;
        all_seconds.push(clock.elapsed().as_secs_f64());
        last = Some((hazards, choice));
        thread::yield_now();
    }
    let (hazards, choice) = last.ok_or("there was no run")?;
    if let Some(path) = &arguments.layers {
        let mut out = Vec::new();
        let mut append =
            |raster: &Raster<f32>| out.extend(raster.data().iter().flat_map(|v| v.to_ne_bytes()));
        for layer in [Layer::Slope, Layer::Roughness, Layer::FootpadSlope] {
            append(hazards.layer(layer).ok_or("the layer was not kept")?);
        }
        append(hazards.clearance());
        fs::write(path, out)?;
    }
    let counts = hazards.counts();
    let report = Report {
        seconds: all_seconds.iter().copied().fold(f64::INFINITY, f64::min),
        all_seconds,
        safe: counts.safe,
        known: counts.safe + counts.unsafe_,
        site: choice.sites.first().map(|site| (site.row, site.col, site.visited)),
    };
    writeln!(stdout(), "{}", serde_json::to_string(&report)?)?;
    Ok(())
}
