//! Landing sites that a mission chose on maps.

use std::any::Any;
use std::sync::{Arc, LazyLock};

use serde::{Deserialize, Serialize};

/// A site that was chosen before the flight was posed, and the choice that it comes from.
#[derive(Clone)]
pub struct ChosenSite {
    /// The site in the summary of a mission.
    pub summary: SiteSummary,
    /// The choice with its map, as a type of the crate that made it; found at its first use where the site was read from a file.
    choice: Arc<Choice>,
}

type Made = Option<Arc<dyn Any + Send + Sync>>;
type Choice = LazyLock<Made, Box<dyn FnOnce() -> Made + Send>>;

impl ChosenSite {
    /// A site and the choice that it comes from.
    pub fn new(summary: SiteSummary, choice: impl Any + Send + Sync) -> Self {
        let made: Arc<dyn Any + Send + Sync> = Arc::new(choice);
        Self::kept(summary, move || Some(made))
    }

    /// A site that was chosen earlier, whose choice is made again where it is asked for.
    pub(crate) fn kept(summary: SiteSummary, again: impl FnOnce() -> Made + Send + 'static) -> Self {
        Self { summary, choice: Arc::new(LazyLock::new(Box::new(again))) }
    }

    pub(crate) fn choice(&self) -> Made {
        (**self.choice).clone()
    }

    /// The choice as a type of the crate that made it, for elevation maps `SiteSelection` of `apsides-terrain`; none where it is of another
    /// type, and where it cannot be made again.
    #[must_use]
    pub fn choice_as<T: Any>(&self) -> Option<&T> {
        (**self.choice).as_ref()?.downcast_ref()
    }
}

impl std::fmt::Debug for ChosenSite {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ChosenSite").field("summary", &self.summary).finish_non_exhaustive()
    }
}

/// A choice of a site in the summary of a mission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SiteSummary {
    /// The name of the map.
    pub map: String,
    /// Part of the known pixels that is safe.
    pub safe_fraction: f64,
    /// The verdict on the place below the lander, in words.
    pub below: String,
    /// Candidates that diverts were planned to, and how many of them are within reach.
    pub candidates: [usize; 2],
    /// East, north and up from the ground below the lander to the site, m.
    pub offset_m: [f64; 3],
    /// Distance of the site from what is not safe, m; none if all of the map is safe.
    pub clearance_m: Option<f64>,
    /// Propellant of the planned divert, and how much of it the cheapest candidate would save, kg.
    pub propellant_kg: [f64; 2],
    /// Tilt on the four pads at the worst heading, deg.
    pub tilt_deg: Option<f64>,
    /// The reason for which the criteria of the choice are not to be trusted, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub warning: Option<String>,
}

impl std::fmt::Display for SiteSummary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [all, reached] = self.candidates;
        let [east, north, up] = self.offset_m;
        write!(
            f,
            "{} map: {:.1} % safe; the ground below is {}; {reached} of {all} candidates within reach; site {:.1} m {} and \
             {:.1} m {}, {:.1} m {}",
            self.map,
            100.0 * self.safe_fraction,
            self.below,
            east.abs(),
            if east < 0.0 { "west" } else { "east" },
            north.abs(),
            if north < 0.0 { "south" } else { "north" },
            up.abs(),
            if up < 0.0 { "lower" } else { "higher" }
        )?;
        if let Some(clearance) = self.clearance_m {
            write!(f, ", {clearance:.1} m clear")?;
        }
        let [propellant, more] = self.propellant_kg;
        write!(f, "; divert {propellant:.2} kg, {more:.2} kg more than to the cheapest")
    }
}
