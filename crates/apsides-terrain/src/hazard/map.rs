//! Layers, verdicts and clearance of a map.

use serde::{Deserialize, Serialize};

use super::edges::edge_strength;
use super::plan::{LAYERS, Plan, slot};
use super::tile::Rows;
use super::{HazardOptions, Layer, Plane, RobustFit, SiteCriteria, Verdict, Watch};
use crate::distance::to_nearest;
use crate::{ElevationMap, Geometry, Raster, TerrainError};

/// Layers, verdicts and clearance, all with the geometry of the map.
#[derive(Clone, Debug)]
pub struct HazardMap {
    criteria: SiteCriteria,
    plane: Option<Plane>,
    layers: [Option<Raster<f32>>; LAYERS],
    verdict: Raster<Verdict>,
    clearance: Raster<f32>,
}

/// Number of pixels by verdict.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// No threshold broken.
    pub safe: u64,
    /// A threshold broken.
    pub unsafe_: u64,
    /// Footprint partly in gaps or outside the map.
    pub unknown: u64,
}

impl Counts {
    /// Counts verdicts.
    #[must_use]
    pub fn of(verdicts: &[Verdict]) -> Counts {
        let mut counts = Counts::default();
        for verdict in verdicts {
            match verdict {
                Verdict::Safe => counts.safe += 1,
                Verdict::Unsafe(_) => counts.unsafe_ += 1,
                Verdict::Unknown => counts.unknown += 1,
            }
        }
        counts
    }

    /// Safe pixels as part of those with a verdict; 0 if there are none.
    #[must_use]
    pub fn safe_fraction(&self) -> f64 {
        self.safe as f64 / (self.safe + self.unsafe_).max(1) as f64
    }
}

/// The hazard map of `map` with the layers that `criteria` test.
///
/// # Errors
/// As [`hazard_map_with`].
pub fn hazard_map(map: &ElevationMap, criteria: &SiteCriteria) -> Result<HazardMap, TerrainError> {
    hazard_map_with(map, criteria, &HazardOptions::default())
}

/// The hazard map of `map`.
///
/// # Errors
/// Criteria outside their range, by name; pixels that are not square, in metres; a map of gaps alone where a plane has to be fitted.
pub fn hazard_map_with(
    map: &ElevationMap,
    criteria: &SiteCriteria,
    options: &HazardOptions,
) -> Result<HazardMap, TerrainError> {
    hazard_map_watched(map, criteria, options, &|_| true)
}

/// The hazard map of `map` as far as `watch` lets the work go on: the clearance is that to what is assessed and safe.
///
/// # Errors
/// As [`hazard_map_with`].
pub fn hazard_map_watched(
    map: &ElevationMap,
    criteria: &SiteCriteria,
    options: &HazardOptions,
    watch: Watch<'_>,
) -> Result<HazardMap, TerrainError> {
    criteria.check()?;
    let mut options = options.clone();
    let is_tested = |layer| criteria.limit(layer).is_some();
    let asked = |layer| is_tested(layer) || options.layers.keeps(layer, is_tested(layer));
    let over_plane = asked(Layer::RelativeElevation) || is_tested(Layer::NormalSlope);
    if options.plane.is_none() && over_plane {
        options.plane = Some(RobustFit::default().fit(map)?.plane);
    }
    let geometry = *map.geometry();
    let plan = Plan::new(&geometry, map.datum(), criteria, &options)?;
    let pixels = geometry.pixels();
    let mut layers = plan.kept.map(|kept| vec![0.0; if kept { pixels } else { 0 }]);
    let mut verdict = vec![Verdict::Unknown; pixels];
    let source = Rows { data: map.relative().data(), first: 0, map: [geometry.rows(), geometry.cols()] };
    plan.rows(&source, 0, geometry.rows(), &mut layers, &mut verdict, watch);
    let mut rasters = [const { None }; LAYERS];
    if let Some(threshold) = criteria.edges_max {
        let strength = edge_strength(map.relative())?;
        for (verdict, strength) in verdict.iter_mut().zip(strength.data()) {
            if *verdict == Verdict::Safe && Layer::Edges.breaks(*strength, threshold) {
                *verdict = Verdict::Unsafe(Layer::Edges);
            }
        }
        if options.layers.keeps(Layer::Edges, true) {
            rasters[slot(Layer::Edges)] = Some(strength);
        }
    }
    let clearance = to_nearest(&geometry, geometry.square_pixel()?, |k| verdict[k] != Verdict::Safe)?;
    for (raster, (layer, kept)) in rasters.iter_mut().zip(layers.into_iter().zip(plan.kept)) {
        if kept {
            *raster = Some(Raster::new(geometry, layer)?);
        }
    }
    Ok(HazardMap {
        criteria: *criteria,
        plane: options.plane,
        layers: rasters,
        verdict: Raster::new(geometry, verdict)?,
        clearance,
    })
}

impl HazardMap {
    /// The places of the pixels.
    pub fn geometry(&self) -> &Geometry {
        self.verdict.geometry()
    }

    /// The criteria that the map was made for.
    pub fn criteria(&self) -> &SiteCriteria {
        &self.criteria
    }

    /// The plane of [`Layer::RelativeElevation`] and [`Layer::NormalSlope`].
    pub fn plane(&self) -> Option<&Plane> {
        self.plane.as_ref()
    }

    /// A layer, if it was kept; NaN where a footprint is not known.
    pub fn layer(&self, layer: Layer) -> Option<&Raster<f32>> {
        self.layers[slot(layer)].as_ref()
    }

    /// Layers that were kept.
    pub fn layers(&self) -> impl Iterator<Item = (Layer, &Raster<f32>)> {
        Layer::ALL.into_iter().filter_map(|layer| Some((layer, self.layer(layer)?)))
    }

    /// Verdicts.
    pub fn verdict(&self) -> &Raster<Verdict> {
        &self.verdict
    }

    /// Distance to the centre of the nearest pixel that is not safe, m; infinite if all are safe.
    pub fn clearance(&self) -> &Raster<f32> {
        &self.clearance
    }

    /// Number of pixels by verdict.
    pub fn counts(&self) -> Counts {
        Counts::of(self.verdict.data())
    }
}
