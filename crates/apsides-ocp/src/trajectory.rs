//! Solutions: states, controls and costates of every phase as piecewise polynomials.

use std::sync::Arc;

use apsides_basis::{Barycentric, BasisError, chebyshev_lobatto};

use crate::{EndpointInput, Mesh, Ocp, OcpError, PhaseMesh, PiecewisePolynomial};

/// An instant at which a path constraint row without controls touches its bound: the costates jump there,
/// `lambda(t-) = lambda(t+) + multiplier * dg/dx`.
///
/// A. E. Bryson, W. F. Denham, S. E. Dreyfus, AIAA Journal 1 (1963) 2544, doi 10.2514/3.2107; R. F. Hartl, S. P. Sethi,
/// R. G. Vickson, SIAM Review 37 (1995) 181, doi 10.1137/1037043.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Index of its time, an interval end, among the breaks of the control polynomial. At an end of the phase the multiplier joins what the
    /// end cost gives there ([`crate::PathEnds`]).
    pub end: usize,
    /// Index of the path constraint row, in the phase's order.
    pub row: usize,
    /// Multiplier of the minimised objective, not negative at an upper bound, not positive at a lower one, in objective unit
    /// per unit of the row.
    pub multiplier: f64,
}

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
    /// Multipliers of the path constraint rows per unit time, at the nodes of the control; without those of the contacts.
    pub path_multipliers: Option<PiecewisePolynomial>,
    /// Where path constraint rows touch their bounds, in order of time.
    pub contacts: Vec<Contact>,
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

    /// Time of a contact; NaN if there is no such interval end.
    #[must_use]
    pub fn contact_time(&self, contact: &Contact) -> f64 {
        self.control.breaks().get(contact.end).copied().unwrap_or(f64::NAN)
    }

    /// Control at a time.
    #[must_use]
    pub fn control_at(&self, t: f64) -> Vec<f64> {
        let mut u = vec![0.0; self.control.dimension()];
        self.control.evaluate(t, &mut u);
        u
    }

    /// The same phase, with its controls at all nodes of the states but the last of each interval where those are more, and at Chebyshev
    /// points where a node of the controls stands at the end of its interval: the nodes of the controls and the ends then determine the
    /// states too, and no two of them have the same time.
    ///
    /// # Errors
    /// [`OcpError::Mesh`] when states and controls differ in their intervals.
    pub fn with_controls_at_state_nodes(&self) -> Result<Self, OcpError> {
        let pieces = self.control.segments().iter().zip(self.state.segments());
        let bases = pieces.map(|(control, state)| {
            let inner = state.basis.nodes().split_last().map_or(&[][..], |(_, inner)| inner);
            let own = control.basis.nodes();
            let fail = |e: BasisError| OcpError::Mesh {
                place: format!("phase `{}`", self.name),
                reason: e.to_string(),
            };
            if inner.len() <= own.len() {
                if own.last().is_none_or(|last| *last < 1.0) {
                    return Ok(Arc::clone(&control.basis));
                }
                let mut nodes = chebyshev_lobatto(own.len() + 1).map_err(fail)?;
                nodes.pop();
                return Barycentric::new(&nodes).map(Arc::new).map_err(fail);
            }
            Barycentric::new(inner).map(Arc::new).map_err(fail)
        });
        let bases: Vec<_> = bases.collect::<Result<_, _>>()?;
        let points = bases.iter().map(|b| b.nodes().len()).collect();
        Ok(Self {
            mesh: self.mesh.clone().with_points(points)?,
            control: self.control.on(bases)?,
            ..self.clone()
        })
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
    /// The mesh of the solution.
    #[must_use]
    pub fn mesh(&self) -> Mesh {
        Mesh { phases: self.phases.iter().map(|p| p.mesh.clone()).collect() }
    }

    /// Returns true if every phase has costates.
    #[must_use]
    pub fn has_costates(&self) -> bool {
        self.phases.iter().all(|p| p.costate.is_some())
    }

    /// A quantity at an end of a phase, or a static parameter.
    #[must_use]
    pub fn end_value(&self, input: EndpointInput) -> f64 {
        let start = |phase: usize| self.phases[phase].initial_time;
        match input {
            EndpointInput::InitialTime { phase } => start(phase),
            EndpointInput::FinalTime { phase } => self.phases[phase].final_time,
            EndpointInput::InitialState { phase, state } => {
                self.phases[phase].state.component(start(phase), state)
            }
            EndpointInput::FinalState { phase, state } => self.phases[phase].final_state()[state],
            EndpointInput::Parameter { index } => self.parameters[index],
        }
    }

    /// The phase of a name.
    #[must_use]
    pub fn phase(&self, ocp: &Ocp, name: &str) -> Option<&PhaseTrajectory> {
        ocp.phase_index(name).and_then(|k| self.phases.get(k))
    }
}
