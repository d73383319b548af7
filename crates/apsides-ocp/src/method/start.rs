//! The start of a solve.

use crate::{Guess, Mesh, Trajectory};

/// The start of a solve: a guess, and what else is known of the solution.
#[derive(Clone, Debug)]
pub struct Start {
    /// States, controls, times and parameters.
    pub guess: Guess,
    /// An earlier trajectory of the same phases, which the guess stands on. Where it has costates its multipliers warm-start a method that
    /// takes them, and its mesh is the first one.
    pub earlier: Option<Trajectory>,
    /// Costates `dJ/dx` of the minimised objective at start and end of each phase, in objective unit per state unit.
    pub costates: Option<Vec<[Vec<f64>; 2]>>,
    /// The first mesh; that of the settings where there is none and no earlier one.
    pub mesh: Option<Mesh>,
}

impl Start {
    /// Begins at a guess.
    #[must_use]
    pub fn new(guess: Guess) -> Self {
        Self { guess, earlier: None, costates: None, mesh: None }
    }

    /// Begins at an earlier trajectory, such as that of a neighbouring problem or of another method.
    #[must_use]
    pub fn from_trajectory(trajectory: Trajectory) -> Self {
        Self { earlier: Some(trajectory.clone()), ..Self::new(Guess::earlier(&trajectory)) }
    }

    /// Adds the costates at start and end of each phase.
    #[must_use]
    pub fn with_costates(self, costates: Vec<[Vec<f64>; 2]>) -> Self {
        Self { costates: Some(costates), ..self }
    }

    /// Adds the first mesh.
    #[must_use]
    pub fn with_mesh(self, mesh: Mesh) -> Self {
        Self { mesh: Some(mesh), ..self }
    }

    /// The earlier trajectory, if it has costates.
    #[must_use]
    pub fn earlier_with_costates(&self) -> Option<&Trajectory> {
        self.earlier.as_ref().filter(|t| t.has_costates())
    }

    /// The mesh to begin with where the start has one: the stated one, else that of an earlier trajectory with costates, since these mark
    /// a mesh that was made for collocation.
    #[must_use]
    pub fn first_mesh(&self) -> Option<Mesh> {
        self.mesh.clone().or_else(|| self.earlier_with_costates().map(Trajectory::mesh))
    }
}

impl From<Guess> for Start {
    fn from(guess: Guess) -> Self {
        Self::new(guess)
    }
}
