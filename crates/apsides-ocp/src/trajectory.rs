//! Solutions: states, controls and costates of every phase as piecewise polynomials.

use crate::{Ocp, PhaseMesh, PiecewisePolynomial};

/// One phase of a solution. The polynomials live on the mesh of the phase.
#[derive(Clone, Debug)]
pub struct PhaseTrajectory {
    /// Name of the phase.
    pub name: String,
    /// Start time.
    pub initial_time: f64,
    /// End time.
    pub final_time: f64,
    /// Mesh of the solution.
    pub mesh: PhaseMesh,
    /// States; continuous.
    pub state: PiecewisePolynomial,
    /// Controls; may jump between intervals.
    pub control: PiecewisePolynomial,
    /// Costates `dJ/dx` of the minimised objective (a maximised one is negated), in objective unit per state unit.
    pub costate: Option<PiecewisePolynomial>,
    /// Multipliers of the path constraint rows per unit time, at the nodes of the control.
    pub path_multipliers: Option<PiecewisePolynomial>,
    /// Multipliers of the bounds on the integrals, one per integral and zero where it has none, in objective unit per
    /// integral unit.
    pub integral_multipliers: Option<Vec<f64>>,
    /// Estimated relative error of each interval.
    pub interval_errors: Vec<f64>,
}

impl PhaseTrajectory {
    /// Time at a fraction of the phase.
    #[must_use]
    pub fn time_at(&self, fraction: f64) -> f64 {
        self.initial_time * (1.0 - fraction) + self.final_time * fraction
    }

    /// State at a time.
    #[must_use]
    pub fn state_at(&self, t: f64) -> Vec<f64> {
        let mut x = vec![0.0; self.state.dimension()];
        self.state.evaluate(t, &mut x);
        x
    }

    /// Control at a time.
    #[must_use]
    pub fn control_at(&self, t: f64) -> Vec<f64> {
        let mut u = vec![0.0; self.control.dimension()];
        self.control.evaluate(t, &mut u);
        u
    }

    /// State at the end.
    #[must_use]
    pub fn final_state(&self) -> Vec<f64> {
        self.state_at(self.final_time)
    }

    /// Node times and the interval of each: the collocation points, then the end.
    pub fn nodes(&self) -> impl Iterator<Item = (f64, usize)> + '_ {
        let last = self.control.segments().len() - 1;
        (0..=last)
            .flat_map(|k| self.control.node_times(k).map(move |t| (t, k)))
            .chain(std::iter::once((self.final_time, last)))
    }
}

/// A solution of a problem, or its best approximation so far.
#[derive(Clone, Debug)]
pub struct Trajectory {
    /// Phases in the problem's order.
    pub phases: Vec<PhaseTrajectory>,
    /// Static parameters.
    pub parameters: Vec<f64>,
    /// Objective in its own sense and unit.
    pub objective: f64,
    /// Multipliers of the endpoint constraints (of the minimised objective), per constraint and row.
    pub constraint_multipliers: Option<Vec<Vec<f64>>>,
}

impl Trajectory {
    /// The phase of a name.
    #[must_use]
    pub fn phase(&self, ocp: &Ocp, name: &str) -> Option<&PhaseTrajectory> {
        ocp.phase_index(name).and_then(|k| self.phases.get(k))
    }
}
