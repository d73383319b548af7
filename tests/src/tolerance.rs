//! Named tolerances by class. Tolerances of single optima stand in the gallery, beside their sources.

/// Flight times against an independent indirect solution, s.
pub const FLIGHT_TIME_S: f64 = 1e-5;

/// Flight times by flat outputs, s: the relative change of the objective that their refinement allows, 1e-8, is ten times this.
pub const FLAT_TIME_S: f64 = 1e-6;

/// Final masses against an independent indirect solution, kg.
pub const FINAL_MASS_KG: f64 = 1e-5;

/// Final masses that a reference prints to a tenth of a gram, kg.
pub const PRINTED_MASS_KG: f64 = 1e-4;

/// Final masses where the structure of the thrust is left open or differs from that of the reference, kg.
pub const OPEN_STRUCTURE_MASS_KG: f64 = 1e-3;

/// Total times of two phases, s: the time of the switch between them is flat at the optimum.
pub const TWO_PHASE_TIME_S: f64 = 1e-4;

/// Speed at the gate between two phases, m/s.
pub const GATE_SPEED_M_S: f64 = 1e-4;

/// Miss of a re-simulated landing, m.
pub const POSITION_MISS_M: f64 = 1e-3;

/// Miss of the speed of a re-simulated landing, m/s.
pub const SPEED_MISS_M_S: f64 = 1e-6;

/// Propellant of injections against indirect shooting, kg.
pub const PROPELLANT_KG: f64 = 1e-5;

/// Propellant of injections against a collocation alone, kg.
pub const COLLOCATION_PROPELLANT_KG: f64 = 1e-3;

/// Single burns of an injection, s: seconds moved from one burn to the next are worth micrograms.
pub const BURN_TIME_S: f64 = 1e-4;

/// Ignitions of an injection, s: nearly flat, as the place of a whole burn is.
pub const IGNITION_TIME_S: f64 = 1e-3;
