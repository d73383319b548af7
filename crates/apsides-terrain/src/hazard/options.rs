//! Options on the contents of a hazard map.

use serde::{Deserialize, Serialize};

use super::{Layer, Plane};

/// The layers that are kept.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LayerChoice {
    /// None: verdicts and clearance alone. Pixels known to be unsafe are left out of further layers, with the same verdicts.
    None,
    /// Those that the criteria have a threshold for.
    #[default]
    Tested,
    /// All that the criteria define.
    All,
    /// These, as far as the criteria define them.
    These(Vec<Layer>),
}

impl LayerChoice {
    /// Tells whether a layer that the criteria define is kept.
    pub(super) fn keeps(&self, layer: Layer, is_tested: bool) -> bool {
        match self {
            LayerChoice::None => false,
            LayerChoice::Tested => is_tested,
            LayerChoice::All => true,
            LayerChoice::These(layers) => layers.contains(&layer),
        }
    }
}

/// Who looks on while a map is assessed: asked before each piece of so many pixels, from any thread, whether it is still to be assessed. Pixels
/// for which the answer is no are unknown ground.
pub type Watch<'a> = &'a (dyn Fn(usize) -> bool + Sync);

/// Options on the contents of a hazard map.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HazardOptions {
    /// Layers that are kept.
    pub layers: LayerChoice,
    /// The plane of [`Layer::RelativeElevation`] and [`Layer::NormalSlope`]; where one of them is asked for and there is none, it is fitted to
    /// the map.
    pub plane: Option<Plane>,
}
