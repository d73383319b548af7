//! Craters, boulders and the probability of a safe landing, where `apsides hazard` is asked for them.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use apsides::terrain::detect::{BoulderSearch, CraterSearch, FoundBoulder, FoundCrater, boulders, craters};
use apsides::terrain::hazard::SiteCriteria;
use apsides::terrain::io::GeoTiffOptions;
use apsides::terrain::probability::{Criteria, DECISION, safe_landing, with_navigation_error};
use apsides::terrain::{ElevationMap, Geometry, Raster, TerrainError};
use serde::Serialize;

use crate::arguments::HazardArguments;
use crate::exit::Refusal;
use crate::hazard_files::{csv, write_picture};
use crate::hazard_watch::Watched;
use crate::output::warn;
use crate::stop::reason;
use crate::terrain::{publish, tiff, unwritten_raster, write};

/// A crater or a boulder: its centre (east, north), its diameter, and its depth or height, m.
#[derive(Serialize)]
struct Feature {
    east_m: f64,
    north_m: f64,
    diameter_m: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    depth_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    height_m: Option<f64>,
}

impl Feature {
    fn crater(found: &FoundCrater) -> Self {
        let [east_m, north_m] = found.centre;
        Self { east_m, north_m, diameter_m: found.diameter, depth_m: Some(found.depth), height_m: None }
    }

    fn boulder(found: &FoundBoulder) -> Self {
        let [east_m, north_m] = found.centre;
        Self { east_m, north_m, diameter_m: found.diameter, depth_m: None, height_m: Some(found.height) }
    }
}

/// The probability of a safe landing over the map.
#[derive(Serialize)]
struct Probability {
    /// Standard deviation of the heights, m.
    noise_m: f64,
    /// Standard deviation of the touchdown point along each axis, m.
    navigation_error_m: f64,
    largest: f64,
    /// Part of the known pixels where it is at least 0.97.
    fraction_declared_safe: f64,
    #[serde(skip)]
    raster: Raster<f32>,
}

/// Craters, boulders and probabilities of a map; none of them where they were not asked for.
#[derive(Default, Serialize)]
pub(crate) struct Features {
    #[serde(skip_serializing_if = "Option::is_none")]
    craters: Option<Vec<Feature>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    boulders: Option<Vec<Feature>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    probability: Option<Probability>,
}

impl Features {
    /// The first option that asks for any of them.
    pub(crate) fn asked(a: &HazardArguments) -> Option<&'static str> {
        [
            ("--craters", a.craters.is_some()),
            ("--boulders", a.boulders.is_some()),
            ("--noise", a.noise.is_some()),
        ]
        .into_iter()
        .find_map(|(option, asked)| asked.then_some(option))
    }

    /// Passes over the map that these take, for the display.
    pub(crate) fn passes(a: &HazardArguments) -> u64 {
        u64::from(a.boulders.is_some()) + 2 * u64::from(a.noise.is_some())
    }

    /// Finds what was asked for, as far as the time goes. The limits of a safe landing are those of the criteria.
    pub(crate) fn find(
        a: &HazardArguments,
        criteria: &SiteCriteria,
        map: &ElevationMap,
        watched: &Watched,
    ) -> Result<Self, Refusal> {
        let watch = |pixels| watched.goes_on(pixels);
        let refused = |option: &'static str| move |e: TerrainError| format!("{option}: {e}");
        let mut features = Self::default();
        if let Some(diameters) = a.craters.filter(|_| in_time(watched, "--craters")) {
            let search = CraterSearch { diameters, depth: a.crater_depth };
            let found = craters(map, &search).map_err(refused("--craters"))?;
            features.craters = Some(found.iter().map(Feature::crater).collect());
        }
        if let Some(height) = a.boulders.filter(|_| in_time(watched, "--boulders")) {
            let search = BoulderSearch { height, diameter: a.boulder_diameter };
            let found = boulders(map, &search, &watch).map_err(refused("--boulders"))?;
            features.boulders = Some(found.iter().map(Feature::boulder).collect());
        }
        if let Some(noise) = a.noise.filter(|_| in_time(watched, "--noise")) {
            let limits = limits(criteria, noise)?;
            let safe = safe_landing(map, &limits, &watch).map_err(refused("--noise"))?;
            let raster = with_navigation_error(&safe, a.navigation_error, &watch);
            let raster = raster.map_err(refused("--navigation-error"))?;
            let known = || raster.data().iter().copied().filter(|p| !p.is_nan());
            let declared = known().filter(|p| f64::from(*p) >= DECISION).count();
            features.probability = Some(Probability {
                noise_m: noise,
                navigation_error_m: a.navigation_error,
                largest: f64::from(known().fold(0.0, f32::max)),
                fraction_declared_safe: declared as f64 / known().count().max(1) as f64,
                raster,
            });
        }
        Ok(features)
    }

    /// Writes `craters.csv`, `boulders.csv` and the probability as `probability.tif` and `probability.png`, and returns the paths.
    pub(crate) fn write(
        &self,
        dir: &Path,
        geometry: &Geometry,
        options: &GeoTiffOptions,
    ) -> Result<Vec<PathBuf>, Refusal> {
        let mut paths = Vec::new();
        let tables =
            [("craters.csv", "depth_m", &self.craters), ("boulders.csv", "height_m", &self.boulders)];
        for (name, vertical, features) in tables {
            let Some(features) = features else { continue };
            let heads = ["east_m", "north_m", "diameter_m", vertical].map(str::to_owned);
            let row = |f: &Feature| {
                let vertical = f.depth_m.or(f.height_m).unwrap_or_default();
                [f.east_m, f.north_m, f.diameter_m, vertical].map(|v| v.to_string()).to_vec()
            };
            paths.push(write(&dir.join(name), &csv(heads.into_iter(), features.iter().map(row))?)?);
        }
        if let Some(Probability { raster, .. }) = &self.probability {
            let path = dir.join("probability.tif");
            let mut file = tiff(&path, geometry, options.clone())?;
            file.write_rows(raster.data()).map_err(unwritten_raster(&path))?;
            publish(&path, file)?;
            paths.push(path);
            paths.push(write_picture(dir, "probability", raster, "-")?);
        }
        Ok(paths)
    }

    pub(crate) fn text(&self) -> String {
        let mut text = String::new();
        for (name, features) in [("craters", &self.craters), ("boulders", &self.boulders)] {
            let Some(features) = features else { continue };
            let widest = features.iter().map(|f| f.diameter_m).fold(0.0, f64::max);
            let _ = writeln!(text, "\n{name}: {}, the widest {widest:.2} m across", features.len());
        }
        if let Some(p) = &self.probability {
            let _ = writeln!(
                text,
                "\nprobability of a safe landing with noise of {} m and a touchdown error of {} m: at most {:.4}; at least {DECISION} \
                 on {:.3} % of the known pixels",
                p.noise_m,
                p.navigation_error_m,
                p.largest,
                100.0 * p.fraction_declared_safe
            );
        }
        text
    }
}

/// Says whether there is time for an option, and on stderr if not.
fn in_time(watched: &Watched, option: &str) -> bool {
    let goes_on = watched.goes_on(0);
    if !goes_on {
        warn(&format!("{}: nothing is found for {option}", reason()));
    }
    goes_on
}

/// The limits of a safe landing: the smaller one of the two slopes, and the roughness.
fn limits(criteria: &SiteCriteria, noise: f64) -> Result<Criteria, Refusal> {
    let slopes = [criteria.slope_max_deg, criteria.footpad_slope_max_deg];
    let slope = slopes.into_iter().flatten().reduce(f64::min);
    let (Some(slope), Some(roughness)) = (slope, criteria.roughness_max_m) else {
        return Err("--noise: criteria with a largest slope and a largest roughness are needed".into());
    };
    let footpads = criteria.footpad_slope_max_deg.map(|_| criteria.footpad_circle_radius_m);
    Ok(Criteria {
        radius: criteria.footprint_radius_m,
        slope: slope.to_radians(),
        roughness,
        footpads,
        noise,
    })
}
