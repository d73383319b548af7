//! Problems whose magnitudes, lengths and cosines of controls are stated without kinks, and with bounds that push.

use crate::effective_controls::within_effect;
use crate::{ByCosine, ByDirection, ByParts, Guess, Ocp, Trajectory};

/// A problem with controls within their effect, cosines in place of angles, directions in place of vectors of controls, and parts in place of
/// magnitudes.
pub struct WithoutKinks {
    /// The problem without kinks.
    pub ocp: Ocp,
    cosines: Option<ByCosine>,
    directions: Option<ByDirection>,
    parts: Option<ByParts>,
}

impl WithoutKinks {
    /// The problem without kinks of controls; none where it has none.
    #[must_use]
    pub fn of(ocp: &Ocp) -> Option<Self> {
        Self::with(ocp, ByParts::of)
    }

    /// The same without kinks of magnitudes of states; none where there are none, as [`ByParts::of_states_too`] says.
    #[must_use]
    pub fn of_states_too(ocp: &Ocp) -> Option<Self> {
        Self::with(ocp, ByParts::of_states_too).filter(|w| w.parts.is_some())
    }

    fn with(ocp: &Ocp, parts: impl Fn(&Ocp) -> Option<ByParts>) -> Option<Self> {
        let within = within_effect(ocp);
        let cosines = ByCosine::of(within.as_ref().unwrap_or(ocp));
        let posed = cosines.as_ref().map(|c| &c.ocp).or(within.as_ref());
        let directions = ByDirection::of(posed.unwrap_or(ocp));
        let posed = directions.as_ref().map(|d| &d.ocp).or(posed);
        let parts = parts(posed.unwrap_or(ocp));
        let ocp = parts.as_ref().map(|p| &p.ocp).or(posed)?.clone();
        Some(Self { ocp, cosines, directions, parts })
    }

    /// A guess of the problem as it was posed, as one of the problem without kinks.
    #[must_use]
    pub fn guess(&self, guess: &Guess) -> Guess {
        let guess = self.cosines.as_ref().map_or_else(|| guess.clone(), |c| c.guess(guess));
        let guess = self.directions.as_ref().map_or_else(|| guess.clone(), |d| d.guess(&guess));
        self.parts.as_ref().map_or_else(|| guess.clone(), |p| p.guess(&guess))
    }

    /// The problem as it was posed with rounded lengths, as [`ByDirection::rounded`] says.
    #[must_use]
    pub fn rounded(&self) -> Option<&Ocp> {
        self.directions.as_ref().and_then(|d| d.rounded.as_ref())
    }

    /// The overlap of parts of magnitudes, as [`ByParts::overlap`] says.
    #[must_use]
    pub fn overlap(&self, trajectory: &Trajectory) -> f64 {
        self.parts.as_ref().map_or(0.0, |p| p.overlap(trajectory))
    }

    /// A trajectory of the problem without kinks as one of the problem as it was posed.
    #[must_use]
    pub fn as_posed(&self, trajectory: Trajectory) -> Trajectory {
        let trajectory = match &self.parts {
            Some(parts) => parts.as_posed(trajectory),
            None => trajectory,
        };
        let trajectory = match &self.directions {
            Some(directions) => directions.as_posed(&trajectory),
            None => trajectory,
        };
        match &self.cosines {
            Some(cosines) => cosines.as_posed(&trajectory),
            None => trajectory,
        }
    }
}
