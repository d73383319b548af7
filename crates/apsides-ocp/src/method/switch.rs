//! Jumps of controls and path constraints along a solution.

use std::fmt;

/// The place of a control or path constraint between its bounds along an arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Level {
    /// At its lower bound, of this value.
    Lower(f64),
    /// Between its bounds.
    Between,
    /// At its upper bound, of this value.
    Upper(f64),
}

/// A jump of a control or path constraint between a bound and another value.
#[derive(Clone, Debug, PartialEq)]
pub struct Switch {
    /// Name of the phase.
    pub phase: String,
    /// Name of the control or path constraint row.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its time, in the phase's unit of time.
    pub time: f64,
    /// Unit of `time`.
    pub time_unit: String,
    /// True if the time was an unknown of the last mesh: it is then as exact as the solution, else an estimate between two
    /// nodes.
    pub located: bool,
    /// The level before the switch.
    pub from: Level,
    /// The level after the switch.
    pub to: Level,
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Lower(v) | Self::Upper(v) => write!(f, "{v}"),
            Self::Between => f.write_str("between"),
        }
    }
}

impl fmt::Display for Switch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { phase, name, unit, time, time_unit, from, to, .. } = self;
        write!(f, "phase `{phase}`, {name}: {from} -> {to} {unit} at t = {time:.6} {time_unit}")
    }
}
