//! Sets of descents that a law must hold: directions of the offset, angles at the entry, damping derivatives.

use std::f64::consts::TAU;

use super::{Case, DampingSet, Descent, Metrics, Record};
use apsides_pipeline::Error;

/// A set of descents around a case.
#[derive(Clone, Debug, PartialEq)]
pub struct CaseSet {
    /// Directions of the offset of the centre of mass, equally spaced from the y axis.
    pub directions: usize,
    /// Size of the offset, m.
    pub offset: f64,
    /// Angles of attack at the entry, rad.
    pub attacks: Vec<f64>,
    /// Damping derivatives.
    pub damping: Vec<DampingSet>,
}

/// One descent of a set with what it amounts to.
#[derive(Clone, Debug, PartialEq)]
pub struct SetFlight {
    /// Offset of the centre of mass, m.
    pub offset: [f64; 2],
    /// Angle of attack at the entry, rad.
    pub attack: f64,
    /// Damping derivatives.
    pub damping: DampingSet,
    /// Angles, times and travels of the flight.
    pub metrics: Metrics,
}

impl CaseSet {
    /// Eight directions with the larger component of a case's offset, at the case's angle of attack and at 10 deg.
    #[must_use]
    pub fn around(case: &Case) -> Self {
        let [y, z] = case.vehicle.offset;
        Self {
            directions: 8,
            offset: y.abs().max(z.abs()),
            attacks: vec![case.entry.attack, 10_f64.to_radians()],
            damping: vec![case.vehicle.damping],
        }
    }

    /// The same with either set of damping derivatives.
    #[must_use]
    pub fn with_all_damping(self) -> Self {
        Self { damping: vec![DampingSet::Constant, DampingSet::Unstable], ..self }
    }

    /// The descents of a set with everything else of a case, the case itself first.
    pub fn cases(&self, case: &Case) -> impl Iterator<Item = Case> {
        let damped = self.damping.iter().flat_map(move |damping| {
            self.attacks.iter().flat_map(move |attack| {
                (0..self.directions).map(move |k| {
                    let (sin, cos) = (TAU * k as f64 / self.directions as f64).sin_cos();
                    ([self.offset * cos, self.offset * sin], *attack, *damping)
                })
            })
        });
        let own = (case.vehicle.offset, case.entry.attack, case.vehicle.damping);
        let case = case.clone();
        std::iter::once(own).chain(damped).map(move |(offset, attack, damping)| {
            let mut turned = case.clone();
            (turned.vehicle.offset, turned.entry.attack, turned.vehicle.damping) = (offset, attack, damping);
            turned
        })
    }

    /// Flies all descents of a set.
    ///
    /// # Errors
    /// Those of [`Descent::new`] and [`Descent::fly`].
    pub fn fly(&self, case: &Case, record: &mut Record) -> Result<Vec<SetFlight>, Error> {
        self.cases(case)
            .map(|case| {
                let metrics = Descent::new(&case)?.fly(record)?;
                let (vehicle, attack) = (&case.vehicle, case.entry.attack);
                Ok(SetFlight { offset: vehicle.offset, attack, damping: vehicle.damping, metrics })
            })
            .collect()
    }

    /// Returns true if every descent is held with a root mean square of both angles below a limit (rad). Ends at the first that is not.
    ///
    /// # Errors
    /// Those of [`Descent::new`] and [`Descent::fly`].
    pub fn held(&self, case: &Case, limit: f64, record: &mut Record) -> Result<bool, Error> {
        for case in self.cases(case) {
            let metrics = Descent::new(&case)?.fly(record)?;
            let held = metrics.worst_rms() < limit;
            if !held {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// The flight with the largest root mean square of an angle; a flight that failed is larger than any.
#[must_use]
pub fn worst_flight(flights: &[SetFlight]) -> Option<&SetFlight> {
    flights.iter().max_by(|a, b| a.metrics.worst_rms().total_cmp(&b.metrics.worst_rms()))
}
