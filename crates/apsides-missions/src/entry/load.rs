//! The loads of a flight: what is limited, reported, and made least.

use apsides_ad::{PathFunction, Scalar};
use apsides_dynamics::Quantity;
use apsides_dynamics::entry::{
    AERODYNAMIC_ACCELERATION, BodyLoads, DYNAMIC_PRESSURE, EntryLoads, EntryModel, NORMAL_ACCELERATION,
};
use apsides_dynamics::heating::HEAT_RATE;

/// One of the loads of a flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Load {
    /// Dynamic pressure, Pa.
    DynamicPressure,
    /// Aerodynamic force by mass, m/s2.
    TotalAcceleration,
    /// The part of the aerodynamic force across the axis of the body, by mass, m/s2.
    NormalAcceleration,
    /// Stagnation heat rate, W/m2.
    HeatRate,
}

impl Load {
    /// Name and unit of the load.
    #[must_use]
    pub const fn quantity(self) -> Quantity {
        match self {
            Self::DynamicPressure => DYNAMIC_PRESSURE,
            Self::TotalAcceleration => AERODYNAMIC_ACCELERATION,
            Self::NormalAcceleration => NORMAL_ACCELERATION,
            Self::HeatRate => HEAT_RATE,
        }
    }

    /// A usual value, in SI.
    pub(super) const fn scale(self) -> f64 {
        match self {
            Self::DynamicPressure => 1e4,
            Self::TotalAcceleration | Self::NormalAcceleration => 40.0,
            Self::HeatRate => 1e6,
        }
    }
}

/// One load of a model as a path function.
pub(super) struct LoadOf<M> {
    total: EntryLoads<M>,
    body: BodyLoads<M>,
    pub(super) load: Load,
}

impl<M: Clone> LoadOf<M> {
    pub(super) fn new(model: &M, load: Load) -> Self {
        Self { total: EntryLoads(model.clone()), body: BodyLoads(model.clone()), load }
    }
}

impl<M: EntryModel<NU>, const NU: usize> PathFunction<6, NU, 1> for LoadOf<M> {
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; 6], u: &[S; NU], p: &[S; 0]) -> [S; 1] {
        if self.load == Load::NormalAcceleration {
            let [normal, _] = self.body.evaluate(t, x, u, p);
            return [normal];
        }
        let [dynamic_pressure, acceleration, heat_rate] = self.total.evaluate(t, x, u, p);
        [match self.load {
            Load::DynamicPressure => dynamic_pressure,
            Load::HeatRate => heat_rate,
            Load::TotalAcceleration | Load::NormalAcceleration => acceleration,
        }]
    }
}
