//! Active bounds, and those that the solution pushes against.

use apsides_ocp::Bounds;

/// The stand of a bounded quantity to its bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Activity {
    /// Away from the bounds.
    Free,
    /// At a bound, without a multiplier that is surely not zero.
    Weak,
    /// At a bound, and pushing against it.
    Strong,
}

/// The space of changes over which the second variation is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Space {
    /// Changes that leave every active bound where it is: negative curvature among them shows that there is no minimum.
    Necessary,
    /// Changes that leave alone those bounds against which the solution pushes: positive curvature on all of them is sufficient.
    Sufficient,
}

/// A multiplier below this, relative as the slope of the first-order conditions, is not surely different from zero.
const STRICT: f64 = 1e-7;
/// Distance from a bound, relative to the scale, at which a quantity counts as being there.
const NEAR: f64 = 1e-5;

impl Activity {
    /// Classifies a quantity with a relative slope of the Lagrangian: it is at the bound where the distance is smaller than the slope
    /// (F. Facchinei, A. Fischer, C. Kanzow, SIAM J. Optim. 9 (1998) 14, doi 10.1137/S1052623496305882).
    pub(super) fn new(slope: f64, value: f64, bounds: &Bounds, scale: f64) -> Self {
        if bounds.is_fixed() {
            return Self::Strong;
        }
        let (below, above) = ((value - bounds.lower) / scale, (bounds.upper - value) / scale);
        let room = if slope > 0.0 { below } else { above };
        if slope.abs() > STRICT && room <= slope.abs() && room < NEAR.sqrt() {
            Self::Strong
        } else if below.min(above) <= NEAR {
            Self::Weak
        } else {
            Self::Free
        }
    }

    /// The stand of a quantity to a kink, whose smaller slope away from it is this one, relative.
    pub(super) fn of_kink(slope: f64) -> Self {
        if slope > STRICT { Self::Strong } else { Self::Weak }
    }

    /// The one of two stands that is farther from the bound.
    pub(super) fn weaker(self, other: Self) -> Self {
        match (self, other) {
            (Self::Free, _) | (_, Self::Free) => Self::Free,
            (Self::Weak, _) | (_, Self::Weak) => Self::Weak,
            (Self::Strong, Self::Strong) => Self::Strong,
        }
    }

    /// Returns true if the quantity does not change in a space.
    pub(super) fn is_fixed_in(self, space: Space) -> bool {
        match space {
            Space::Necessary => self != Self::Free,
            Space::Sufficient => self == Self::Strong,
        }
    }
}
