//! Hazard layers and verdicts on whole maps.
//!
//! [`hazard_map`] makes the layers that [`SiteCriteria`] have thresholds for, a verdict for each pixel and the distance to the nearest
//! pixel that is not safe. Heights are `f32`, sums `f64`; where `f32` leaves open on which side of a threshold a slope on footpads or a
//! roughness is, it is computed again in `f64`.

mod angle;
mod bands;
mod criteria;
mod edges;
mod extremes;
mod farthest;
mod footprint;
mod layer;
mod map;
mod normals;
mod options;
mod plan;
mod plane;
mod residual;
mod robust;
mod stance;
mod tile;

pub use bands::{HazardBand, HazardSink, HeightSource, hazard_bands};
pub use criteria::{Belly, Normals, SiteCriteria};
pub use layer::{Layer, Verdict};
pub use map::{Counts, HazardMap, hazard_map, hazard_map_watched, hazard_map_with};
pub use normals::median_normal_angle;
pub use options::{HazardOptions, LayerChoice, Watch};
pub use robust::{Plane, RobustFit, RobustMethod, RobustPlane};
