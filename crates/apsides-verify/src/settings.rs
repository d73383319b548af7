//! Tolerances and effort of a verification.

use apsides_ocp::State;

use crate::VerifyError;

/// Tolerances and effort of a verification. Every number must be positive and finite.
#[derive(Clone, Debug, PartialEq)]
pub struct VerifySettings {
    /// Relative local error per step of the re-simulation; default 1e-12. The absolute one is this times the scale of
    /// each state.
    pub integration_tolerance: f64,
    /// Steps allowed in each interval of the control polynomial; default 100 000. More end the re-simulation as failed.
    pub max_steps: usize,
    /// Allowed miss at the ends of phases, relative to the scale of the quantity; default 1e-7. A state that states its
    /// own tolerance keeps it. So much, of their scales, may controls change to join the pieces in which an unstable plant is flown.
    pub end_tolerance: f64,
    /// Allowed violation of bounds and path constraints along a phase, relative to the stated scale of the row, else
    /// the width of its bounds, else the larger finite bound, else the largest value met; default 1e-6. Allowed too,
    /// times the scale of the state, between the states of the trajectory at their nodes and the re-simulated path.
    pub path_tolerance: f64,
    /// Points per interval of the control polynomial at which bounds and path constraints are looked at, at least 2;
    /// default 16. The surroundings of the worst one are then searched by golden section.
    pub scan_points: usize,
    /// Allowed difference of the recomputed objective, relative to the larger of its value and its scale; default 1e-7. Allowed too is what
    /// states and controls within `path_tolerance`, and end quantities within `end_tolerance`, change to second order.
    pub objective_tolerance: f64,
    /// Allowed residual of the costate equation over one interval, relative to the largest costate of the phase, each
    /// costate times the scale of its state, and to 1e-4 of the Hamiltonian times the duration where all costates are less;
    /// default 1e-5.
    pub costate_tolerance: f64,
    /// Allowed slope of the Hamiltonian in a control (or in a static parameter), relative to its largest term divided by
    /// the scale of the control; default 1e-5. Where the slope pushes against a bound, the smaller of slope and relative
    /// distance to that bound counts. Multipliers of path constraints are held to the same limit.
    pub stationarity_tolerance: f64,
    /// Allowed excess of the Hamiltonian over its least value for any admissible control at the same state and costate,
    /// relative to its largest term; default 1e-5.
    pub minimum_tolerance: f64,
    /// Allowed variation of the Hamiltonian along a phase, less what explicit time adds to it, relative to its largest
    /// term; default 1e-5.
    pub hamiltonian_tolerance: f64,
    /// Allowed negative curvature of the second variation, relative to the largest term of the Hamiltonian times the duration, for
    /// changes of the controls, free ends, corners and parameters of the size of their scales; default 1e-5. The Hessian
    /// of the Hamiltonian in the free controls must exceed it for the strengthened condition of Legendre and Clebsch.
    pub curvature_tolerance: f64,
    /// The same where the Hamiltonian is linear in a free control: along a singular arc nothing damps what the discretisation of the
    /// control leaves, and no strict minimum is claimed; default 1e-3.
    pub singular_curvature_tolerance: f64,
    /// Least curvature, in the same measure, that shows a strict minimum; default 1e-5. Along a family of optima it is zero but for the
    /// discretisation, which leaves some 1e-6.
    pub coercivity: f64,
    /// Allowed residual of the transversality conditions, relative to the largest costate times the scale of its state
    /// (for times: to the largest term of the Hamiltonian); default 1e-5.
    pub transversality_tolerance: f64,
    /// Allowed rate of a path constraint where it touches its bound, times the duration of the phase and relative to the scale of
    /// the row as for `path_tolerance`; default 1e-4. Where the multiplier of the contact, times that scale and relative
    /// to the largest costate, is smaller, it counts.
    pub contact_tolerance: f64,
    /// Allowed worth of what the trajectory misses of its constraints and equations of motion, relative to the size of the objective: the sum of the
    /// misses times their multipliers; default 1e-5.
    pub worth_tolerance: f64,
    /// A state bound along a phase, or a bound on a duration, counts as active within this times the scale; default
    /// 1e-6. Its multiplier is not part of a trajectory: of the costate only the sign of what drives it is checked there.
    pub activity_tolerance: f64,
    /// Take costates from the adjoint equation along the trajectory where it states none or they fail; default true.
    pub adjoint: bool,
}

impl Default for VerifySettings {
    fn default() -> Self {
        Self {
            integration_tolerance: 1e-12,
            max_steps: 100_000,
            end_tolerance: 1e-7,
            path_tolerance: 1e-6,
            scan_points: 16,
            objective_tolerance: 1e-7,
            costate_tolerance: 1e-5,
            stationarity_tolerance: 1e-5,
            minimum_tolerance: 1e-5,
            hamiltonian_tolerance: 1e-5,
            curvature_tolerance: 1e-5,
            singular_curvature_tolerance: 1e-3,
            coercivity: 1e-5,
            transversality_tolerance: 1e-5,
            contact_tolerance: 1e-4,
            worth_tolerance: 1e-5,
            activity_tolerance: 1e-6,
            adjoint: true,
        }
    }
}

impl VerifySettings {
    /// The distance from the re-simulated flight that a stated state is allowed, by its scale.
    pub(crate) fn limit_of_state(&self, state: &State, scale: f64) -> f64 {
        (self.path_tolerance * scale).max(state.tolerance.unwrap_or(0.0))
    }

    /// Checks every number.
    ///
    /// # Errors
    /// [`VerifyError::Setting`] naming the first that is not allowed.
    pub fn check(&self) -> Result<(), VerifyError> {
        let positive = [
            ("integration_tolerance", self.integration_tolerance),
            ("end_tolerance", self.end_tolerance),
            ("path_tolerance", self.path_tolerance),
            ("objective_tolerance", self.objective_tolerance),
            ("costate_tolerance", self.costate_tolerance),
            ("stationarity_tolerance", self.stationarity_tolerance),
            ("minimum_tolerance", self.minimum_tolerance),
            ("hamiltonian_tolerance", self.hamiltonian_tolerance),
            ("curvature_tolerance", self.curvature_tolerance),
            ("singular_curvature_tolerance", self.singular_curvature_tolerance),
            ("coercivity", self.coercivity),
            ("transversality_tolerance", self.transversality_tolerance),
            ("contact_tolerance", self.contact_tolerance),
            ("worth_tolerance", self.worth_tolerance),
            ("activity_tolerance", self.activity_tolerance),
        ];
        for (name, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(VerifyError::Setting { name, value, allowed: "a positive finite number" });
            }
        }
        if self.max_steps == 0 {
            return Err(VerifyError::Setting { name: "max_steps", value: 0.0, allowed: "at least 1" });
        }
        if self.scan_points < 2 {
            let value = self.scan_points as f64;
            return Err(VerifyError::Setting { name: "scan_points", value, allowed: "at least 2" });
        }
        Ok(())
    }
}
