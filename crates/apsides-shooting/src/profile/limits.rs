//! Bounded quantities of a problem: along the flight and at its end.

use apsides_ocp::{Bounds, Ocp, Phase, Variable};

use super::flight::Excess;

/// The quantity that is limited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// A path constraint row, by its index among all of the phase.
    Path(usize),
    /// A state along the flight.
    State(usize),
    /// A control along the flight.
    Control(usize),
    /// A row of the endpoint constraints, by its index among all.
    Endpoint(usize),
    /// An integral.
    Integral(usize),
    /// The end time, with the bounds on the duration.
    FinalTime,
}

/// A bounded quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// Its index.
    pub quantity: Quantity,
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Allowed values; those of the end time depend on the start time where a duration is bounded.
    pub bounds: Bounds,
    /// Size that an excess over a bound of zero is relative to.
    pub size: f64,
}

impl Limit {
    fn new(quantity: Quantity, variable: &Variable) -> Self {
        Self {
            quantity,
            name: variable.name.clone(),
            unit: variable.unit.clone(),
            bounds: variable.bounds,
            size: variable.size().unwrap_or(1.0),
        }
    }

    fn is_bounded(&self) -> bool {
        self.bounds.lower.is_finite() || self.bounds.upper.is_finite()
    }

    /// Excess of a value over given bounds.
    pub(crate) fn excess(&self, bounds: &Bounds, value: f64, time: f64) -> Excess {
        let (below, above) = (bounds.lower - value, value - bounds.upper);
        let (amount, bound) = if below > above { (below, bounds.lower) } else { (above, bounds.upper) };
        if value.is_nan() {
            return Excess { amount: f64::INFINITY, relative: f64::INFINITY, value, time };
        }
        let size = if bound == 0.0 || bound.is_infinite() { self.size } else { bound.abs() };
        Excess { amount, relative: amount / size, value, time }
    }
}

/// Path constraint rows, states and controls with a bound.
pub(crate) fn along(phase: &Phase) -> Vec<Limit> {
    let path = phase.path.iter().flat_map(|p| &p.rows).enumerate();
    let states = phase.states.iter().enumerate();
    let controls = phase.controls.iter().enumerate();
    (path.map(|(k, v)| Limit::new(Quantity::Path(k), v)))
        .chain(states.map(|(k, s)| Limit::new(Quantity::State(k), &s.variable)))
        .chain(controls.map(|(k, v)| Limit::new(Quantity::Control(k), v)))
        .filter(Limit::is_bounded)
        .collect()
}

/// Rows of the endpoint constraints, bounded integrals, the end time.
pub(crate) fn at_end(ocp: &Ocp, phase: &Phase) -> Vec<Limit> {
    let rows = ocp.constraints.iter().flat_map(|c| c.rows.iter().map(|r| (&c.name, r))).enumerate();
    let rows = rows.map(|(k, (name, row))| Limit {
        name: format!("{name}: {}", row.name),
        ..Limit::new(Quantity::Endpoint(k), row)
    });
    let integrals = phase.integrals.iter().enumerate();
    let integrals = integrals.map(|(k, q)| Limit::new(Quantity::Integral(k), &q.variable));
    let end =
        Variable { bounds: phase.time_bounds().1, ..Variable::new("final time", phase.time_unit.clone()) };
    let time = Limit::new(Quantity::FinalTime, &end);
    rows.chain(integrals.filter(Limit::is_bounded)).chain([time]).collect()
}
