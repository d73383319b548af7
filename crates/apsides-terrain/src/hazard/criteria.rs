//! Thresholds of a site, each with its unit.

use serde::{Deserialize, Serialize};

use super::Layer;
use crate::TerrainError;

/// Underside of the lander.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Belly {
    /// Radius of the disk under which nothing may come too near, m.
    pub radius_m: f64,
    /// Height of the underside above the soles of the footpads, m.
    pub height_m: f64,
    /// Least distance between underside and ground, m.
    pub clearance_min_m: f64,
}

/// Slope as the median angle of normals.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Normals {
    /// Radius within which pairs of pixels are, m: 2 to 10 pixels.
    pub radius_m: f64,
    /// Largest median angle between their normals and that of the robust plane of the map, deg.
    pub slope_max_deg: f64,
}

/// Size of a lander and what it tolerates. A threshold that is `None` is not tested.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SiteCriteria {
    /// Radius of the disk of a fitted plane, of roughness and of step height, m.
    pub footprint_radius_m: f64,
    /// Radius of the circle of the four footpads, m.
    pub footpad_circle_radius_m: f64,
    /// Radius of a footpad, m; 0 is a point.
    #[serde(default)]
    pub footpad_radius_m: f64,
    /// Headings of the four footpads in a quarter turn, equally spaced from east.
    #[serde(default = "default_headings")]
    pub headings: usize,
    /// Largest slope of the fitted plane against gravity, deg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slope_max_deg: Option<f64>,
    /// Largest slope of the lander on its footpads, over all headings, deg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub footpad_slope_max_deg: Option<f64>,
    /// Largest distance of a height from the fitted plane, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub roughness_max_m: Option<f64>,
    /// Largest root mean square distance from the fitted plane, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub roughness_rms_max_m: Option<f64>,
    /// Largest difference of heights within the footprint, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step_max_m: Option<f64>,
    /// Underside of the lander.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub belly: Option<Belly>,
    /// Largest height above or below the robust plane of the map, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_elevation_max_m: Option<f64>,
    /// Slope as the median angle of normals.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normals: Option<Normals>,
    /// Threshold of Canny's detector from which on an edge is unsafe, a part of the largest gradient of the map.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub edges_max: Option<f64>,
    /// Least distance of a site from the nearest pixel that is not safe, m.
    pub clearance_min_m: f64,
}

fn default_headings() -> usize {
    18
}

/// The presets by name.
const PRESETS: [(&str, SiteCriteria); 5] = [
    ("chang-e-3-coarse", SiteCriteria::CHANG_E_3_COARSE),
    ("chang-e-3-fine", SiteCriteria::CHANG_E_3_FINE),
    ("alhat", SiteCriteria::ALHAT),
    ("contest-coarse", SiteCriteria::CONTEST_COARSE),
    ("contest-fine", SiteCriteria::CONTEST_FINE),
];

impl SiteCriteria {
    /// Chang'e-3 on a map of 1 m from 2.4 km: footpads on a circle of 2.5 m, slope 8 deg, and heights within 0.3 m of the plane over
    /// a disk of 5 m, which is what such a map resolves; a clear disk of 5 m.
    pub const CHANG_E_3_COARSE: SiteCriteria = SiteCriteria {
        footprint_radius_m: 5.0,
        footpad_circle_radius_m: 2.5,
        footpad_radius_m: 0.0,
        headings: 18,
        slope_max_deg: Some(8.0),
        footpad_slope_max_deg: Some(8.0),
        roughness_max_m: Some(0.30),
        roughness_rms_max_m: None,
        step_max_m: None,
        belly: None,
        relative_elevation_max_m: None,
        normals: None,
        edges_max: None,
        clearance_min_m: 5.0,
    };

    /// Chang'e-3 on a map of 0.1 m from 100 m: footpads of radius 0.25 m on a circle of 2.5 m, slope 8 deg, heights within 0.15 m of
    /// the plane over a disk of 2.5 m, a clear disk of 2.5 m.
    pub const CHANG_E_3_FINE: SiteCriteria = SiteCriteria {
        footprint_radius_m: 2.5,
        footpad_radius_m: 0.25,
        roughness_max_m: Some(0.15),
        clearance_min_m: 2.5,
        ..SiteCriteria::CHANG_E_3_COARSE
    };

    /// The requirements of ALHAT (Autonomous Landing and Hazard Avoidance Technology): slopes above 5 deg and objects above 0.3 m are
    /// hazards, local precision 3 m, here the clearance. The size of the lander is not part of them: footpads of radius 0.5 m on a
    /// circle of 5 m are an assumption.
    pub const ALHAT: SiteCriteria = SiteCriteria {
        footprint_radius_m: 5.0,
        footpad_circle_radius_m: 5.0,
        footpad_radius_m: 0.5,
        slope_max_deg: Some(5.0),
        footpad_slope_max_deg: Some(5.0),
        roughness_max_m: Some(0.30),
        clearance_min_m: 3.0,
        ..SiteCriteria::CHANG_E_3_COARSE
    };

    /// The rule of a published solution of problem A of the Chinese undergraduate contest in mathematical modelling, 2014, on a map of 1 m:
    /// heights within 50 m of the plane of least median of squares, off the edges of Canny's detector with the threshold 0.4.
    /// **It is unsafe** ([`unsafe_because`](Self::unsafe_because)); it is here to compare.
    pub const CONTEST_COARSE: SiteCriteria = SiteCriteria {
        slope_max_deg: None,
        footpad_slope_max_deg: None,
        roughness_max_m: None,
        relative_elevation_max_m: Some(50.0),
        edges_max: Some(0.4),
        clearance_min_m: 0.0,
        ..SiteCriteria::CHANG_E_3_COARSE
    };

    /// The same on a map of 0.1 m, where the median angle between the normals of pairs of pixels and the normal of the plane is below 2 deg
    /// besides. The radius of the pairs, 0.5 m, is an assumption: the text states none.
    pub const CONTEST_FINE: SiteCriteria = SiteCriteria {
        footprint_radius_m: SiteCriteria::CHANG_E_3_FINE.footprint_radius_m,
        footpad_radius_m: SiteCriteria::CHANG_E_3_FINE.footpad_radius_m,
        normals: Some(Normals { radius_m: 0.5, slope_max_deg: 2.0 }),
        ..SiteCriteria::CONTEST_COARSE
    };

    /// Least and largest part (%) of what the rules of the contest call safe that breaks a limit of slope, footpads or roughness, on six
    /// generated maps.
    pub const CONTEST_FALSE_SAFE_PERCENT: [f64; 2] = [20.0, 47.0];

    /// A preset by its name.
    #[must_use]
    pub fn preset(name: &str) -> Option<SiteCriteria> {
        PRESETS.iter().find(|(n, _)| *n == name).map(|(_, criteria)| *criteria)
    }

    /// Names of the presets.
    pub fn presets() -> impl Iterator<Item = &'static str> {
        PRESETS.iter().map(|(name, _)| *name)
    }

    /// Largest tilt (rad) of a lander at rest: the slope on its footpads, where that is not limited the slope, else a right angle.
    #[must_use]
    pub fn tilt_at_rest_max(&self) -> f64 {
        self.footpad_slope_max_deg.or(self.slope_max_deg).unwrap_or(90.0).to_radians()
    }

    /// Says in words for what reason ground that keeps all thresholds may be unsafe all the same; none where slopes are limited.
    ///
    /// An angle from a plane that is fitted to a map is no slope: where the map as a whole is inclined, ground that follows it passes.
    #[must_use]
    pub fn unsafe_because(&self) -> Option<String> {
        let [least, most] = Self::CONTEST_FALSE_SAFE_PERCENT;
        (self.slope_max_deg.is_none() && self.footpad_slope_max_deg.is_none()).then(|| {
            format!(
                "these criteria are unsafe: they limit neither the slope from gravity nor that on the footpads; of what the rules of the contest \
                 call safe {least} to {most} % breaks a limit of slope, footpads or roughness"
            )
        })
    }

    /// The first key whose threshold is held against something of the whole map: its robust plane or its largest gradient.
    #[must_use]
    pub fn seen_on_whole_map(&self) -> Option<&'static str> {
        let keys = [
            ("relative_elevation_max_m", self.relative_elevation_max_m.is_some()),
            ("normals.slope_max_deg", self.normals.is_some()),
            ("edges_max", self.edges_max.is_some()),
        ];
        keys.into_iter().find(|(_, is_tested)| *is_tested).map(|(key, _)| key)
    }

    /// The threshold of a layer: m, or rad for angles.
    #[must_use]
    pub fn limit(&self, layer: Layer) -> Option<f64> {
        match layer {
            Layer::Slope => self.slope_max_deg.map(f64::to_radians),
            Layer::FootpadSlope => self.footpad_slope_max_deg.map(f64::to_radians),
            Layer::FootpadSlopeLeast => None,
            Layer::Roughness => self.roughness_max_m,
            Layer::RoughnessRms => self.roughness_rms_max_m,
            Layer::Step => self.step_max_m,
            Layer::BellyClearance => self.belly.map(|b| b.clearance_min_m),
            Layer::RelativeElevation => self.relative_elevation_max_m,
            Layer::NormalSlope => self.normals.map(|n| n.slope_max_deg.to_radians()),
            Layer::Edges => self.edges_max,
        }
    }

    /// Checks every number.
    ///
    /// # Errors
    /// The first number that is outside its range, by its name.
    pub fn check(&self) -> Result<(), TerrainError> {
        const POSITIVE: &str = "it must be positive and finite";
        const NOT_NEGATIVE: &str = "it must not be negative, and finite";
        const ANGLE: &str = "it must be above 0 and below 90";
        let number = |name, value: f64, fits: bool, allowed: &'static str| {
            if fits { Ok(()) } else { Err(TerrainError::Number { name, value, allowed: allowed.into() }) }
        };
        let positive = |name, v: f64| number(name, v, v.is_finite() && v > 0.0, POSITIVE);
        let not_negative = |name, v: f64| number(name, v, v.is_finite() && v >= 0.0, NOT_NEGATIVE);
        let angle = |name, v: f64| number(name, v, v > 0.0 && v < 90.0, ANGLE);
        positive("footprint_radius_m", self.footprint_radius_m)?;
        positive("footpad_circle_radius_m", self.footpad_circle_radius_m)?;
        not_negative("footpad_radius_m", self.footpad_radius_m)?;
        let headings = self.headings as f64;
        number("headings", headings, (1..=360).contains(&self.headings), "it must be from 1 to 360")?;
        self.slope_max_deg.map_or(Ok(()), |v| angle("slope_max_deg", v))?;
        self.footpad_slope_max_deg.map_or(Ok(()), |v| angle("footpad_slope_max_deg", v))?;
        self.roughness_max_m.map_or(Ok(()), |v| positive("roughness_max_m", v))?;
        self.roughness_rms_max_m.map_or(Ok(()), |v| positive("roughness_rms_max_m", v))?;
        self.step_max_m.map_or(Ok(()), |v| positive("step_max_m", v))?;
        if let Some(belly) = self.belly {
            positive("belly.radius_m", belly.radius_m)?;
            not_negative("belly.height_m", belly.height_m)?;
            not_negative("belly.clearance_min_m", belly.clearance_min_m)?;
        }
        self.relative_elevation_max_m.map_or(Ok(()), |v| positive("relative_elevation_max_m", v))?;
        if let Some(normals) = self.normals {
            positive("normals.radius_m", normals.radius_m)?;
            angle("normals.slope_max_deg", normals.slope_max_deg)?;
        }
        let part = |v: f64| number("edges_max", v, v > 0.0 && v <= 1.0, "it must be above 0 and at most 1");
        self.edges_max.map_or(Ok(()), part)?;
        not_negative("clearance_min_m", self.clearance_min_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rules of the contest and a file that takes the limits of slopes away say that they are unsafe; the others do not.
    #[test]
    fn criteria_without_slopes_say_that_they_are_unsafe() {
        let said: Vec<&str> = SiteCriteria::presets()
            .filter(|name| SiteCriteria::preset(name).is_some_and(|c| c.unsafe_because().is_some()))
            .collect();
        assert_eq!(said, ["contest-coarse", "contest-fine"]);
        let none = SiteCriteria { slope_max_deg: None, footpad_slope_max_deg: None, ..SiteCriteria::ALHAT };
        assert!(none.unsafe_because().is_some_and(|words| words.contains("20 to 47 %")));
        assert_eq!(SiteCriteria::CONTEST_FINE.seen_on_whole_map(), Some("relative_elevation_max_m"));
        assert_eq!(SiteCriteria::ALHAT.seen_on_whole_map(), None);
    }

    #[test]
    fn presets_are_sound_and_numbers_are_refused_by_name() {
        for name in SiteCriteria::presets() {
            SiteCriteria::preset(name).unwrap().check().unwrap();
        }
        assert_eq!(SiteCriteria::preset("none"), None);
        let base = SiteCriteria::ALHAT;
        let name = |criteria: SiteCriteria| match criteria.check() {
            Err(TerrainError::Number { name, .. }) => name,
            other => panic!("{other:?}"),
        };
        assert_eq!(name(SiteCriteria { footprint_radius_m: 0.0, ..base }), "footprint_radius_m");
        assert_eq!(
            name(SiteCriteria { footpad_circle_radius_m: f64::NAN, ..base }),
            "footpad_circle_radius_m"
        );
        assert_eq!(name(SiteCriteria { footpad_radius_m: -1.0, ..base }), "footpad_radius_m");
        assert_eq!(name(SiteCriteria { headings: 0, ..base }), "headings");
        assert_eq!(name(SiteCriteria { slope_max_deg: Some(90.0), ..base }), "slope_max_deg");
        assert_eq!(name(SiteCriteria { roughness_max_m: Some(f64::INFINITY), ..base }), "roughness_max_m");
        assert_eq!(name(SiteCriteria { clearance_min_m: -1.0, ..base }), "clearance_min_m");
        assert_eq!(name(SiteCriteria { edges_max: Some(1.5), ..base }), "edges_max");
        assert_eq!(name(SiteCriteria { edges_max: Some(f64::NAN), ..base }), "edges_max");
        let normals = |radius_m, slope_max_deg| SiteCriteria {
            normals: Some(Normals { radius_m, slope_max_deg }),
            ..base
        };
        assert_eq!(name(normals(0.0, 2.0)), "normals.radius_m");
        assert_eq!(name(normals(0.5, f64::INFINITY)), "normals.slope_max_deg");
        let belly = Some(Belly { radius_m: -1.0, height_m: 1.0, clearance_min_m: 0.2 });
        assert_eq!(name(SiteCriteria { belly, ..base }), "belly.radius_m");
    }
}
