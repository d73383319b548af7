//! Names of layers and verdicts.

use std::fmt;

use serde::{Deserialize, Serialize};

/// One number for each pixel: the lander with its centre there. NaN where the map does not tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Layer {
    /// Angle between gravity and the normal of the least-squares plane over the footprint, rad.
    Slope,
    /// Angle between gravity and the normal of the lander on its four footpads, rad: the largest over all headings.
    ///
    /// The lander stands on the higher of its two diagonals and tips to the side that is worse: with heights `p0..p3` around the
    /// circle of radius `rho`, `m` the mean of the higher diagonal `(i, k)` and `j` a pad of the other,
    /// `tan^2 = ((p_i - p_k) / 2 rho)^2 + (max_j |p_j - m| / rho)^2`. A height is the bilinear one of the map whose pixels are the
    /// largest heights under a footpad; at the edge of the map, of the part of the footpad that is inside.
    FootpadSlope,
    /// The same, the least over all headings, rad.
    FootpadSlopeLeast,
    /// Largest distance of a height of the footprint from the least-squares plane, normal to it, m.
    Roughness,
    /// Root mean square distance of the heights of the footprint from the least-squares plane, normal to it, m.
    RoughnessRms,
    /// Difference between the largest and the least height of the footprint, m.
    Step,
    /// Distance between ground and underside of the lander, normal to the least-squares plane of the footprint, m.
    ///
    /// The lander is parallel to that plane and as low as the higher diagonal of its footpads (the mean of the two heights) lets it
    /// come, in the heading that is worst; the ground is the highest above the plane within the disk of the underside.
    BellyClearance,
    /// Height above the robust plane of the map, m.
    RelativeElevation,
    /// Median angle between the normal of the robust plane of the map and the normals of pairs of pixels around the centre, rad. It is not
    /// the slope of the ground ([`median_normal_angle`](super::median_normal_angle)).
    NormalSlope,
    /// Largest threshold, as a part of the largest gradient of the map, at which Canny's detector has an edge there; 0 off ridges of the
    /// gradient.
    Edges,
}

impl Layer {
    /// All layers, in the order in which they are tested.
    pub const ALL: [Layer; 10] = [
        Layer::Slope,
        Layer::FootpadSlope,
        Layer::Roughness,
        Layer::RoughnessRms,
        Layer::Step,
        Layer::BellyClearance,
        Layer::RelativeElevation,
        Layer::FootpadSlopeLeast,
        Layer::NormalSlope,
        Layer::Edges,
    ];

    /// Name in files and tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Layer::Slope => "slope",
            Layer::FootpadSlope => "footpad-slope",
            Layer::FootpadSlopeLeast => "footpad-slope-least",
            Layer::Roughness => "roughness",
            Layer::RoughnessRms => "roughness-rms",
            Layer::Step => "step",
            Layer::BellyClearance => "belly-clearance",
            Layer::RelativeElevation => "relative-elevation",
            Layer::NormalSlope => "median-normal-slope",
            Layer::Edges => "edges",
        }
    }

    /// Tells whether values are angles in rad; else lengths in m, or numbers.
    #[must_use]
    pub fn is_angle(self) -> bool {
        matches!(self, Layer::Slope | Layer::FootpadSlope | Layer::FootpadSlopeLeast | Layer::NormalSlope)
    }

    /// Unit in files and tables, where angles are in degrees; empty for a number.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Layer::Edges => "",
            _ if self.is_angle() => "deg",
            _ => "m",
        }
    }

    /// A value in [`unit`](Self::unit): angles in degrees.
    #[must_use]
    pub fn in_unit(self, value: f64) -> f64 {
        if self.is_angle() { value.to_degrees() } else { value }
    }

    /// A value with its unit.
    pub(crate) fn show(self, value: f64) -> String {
        format!("{:.3} {}", self.in_unit(value), self.unit()).trim_end().into()
    }

    /// Tells whether a value breaks a threshold.
    pub(crate) fn breaks(self, value: f32, limit: f64) -> bool {
        let value = f64::from(value);
        match self {
            Layer::BellyClearance => value < limit,
            Layer::RelativeElevation => value.abs() > limit,
            // Of the detector: an edge from its threshold on.
            Layer::Edges => value >= limit,
            _ => value > limit,
        }
    }
}

impl fmt::Display for Layer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The verdict on a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// No threshold is broken.
    Safe,
    /// The first layer, in the order of [`Layer::ALL`], whose threshold is broken.
    Unsafe(Layer),
    /// Part of the footprint is a gap or outside the map. Never safe.
    #[default]
    Unknown,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Verdict::Safe => f.write_str("safe"),
            Verdict::Unsafe(layer) => write!(f, "unsafe: {layer}"),
            Verdict::Unknown => f.write_str("unknown"),
        }
    }
}
