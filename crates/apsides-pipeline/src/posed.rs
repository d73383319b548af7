//! A mission posed as an optimal control problem, with a start.

use std::sync::Arc;

#[cfg(feature = "flatness")]
use apsides_flatness::FlatSystem;
use apsides_ocp::{Guess, Ocp, OcpError, Trajectory};
#[cfg(feature = "two-layer")]
use apsides_two_layer::ProfileModel;

use crate::Error;

/// A problem with a start.
pub struct Posed {
    /// The problem that a method solves.
    pub ocp: Ocp,
    /// The point where a method starts.
    pub guess: Guess,
    /// Costates (of the minimised objective) at start and end of each phase of the guess, if they are known.
    pub costates: Option<Vec<[Vec<f64>; 2]>>,
    /// The flat description of each phase, if all have one.
    #[cfg(feature = "flatness")]
    pub flat_systems: Option<Vec<FlatSystem>>,
    /// The description of each phase by all its states and controls as outputs, beside the flat one.
    #[cfg(feature = "flatness")]
    pub spline_systems: Option<Vec<FlatSystem>>,
    /// The whole flight, where the problem is a reduction of it.
    pub expansion: Option<Expansion>,
    /// Control profiles that a search can fly, if there are any; distances are in km.
    #[cfg(feature = "two-layer")]
    pub profile: Option<ProfileModel>,
}

impl Posed {
    /// A problem that is the whole flight, with a start.
    #[must_use]
    pub fn new(ocp: Ocp, guess: Guess) -> Self {
        Self {
            ocp,
            guess,
            costates: None,
            #[cfg(feature = "flatness")]
            flat_systems: None,
            #[cfg(feature = "flatness")]
            spline_systems: None,
            expansion: None,
            #[cfg(feature = "two-layer")]
            profile: None,
        }
    }

    /// The whole flight as a problem.
    #[must_use]
    pub fn flight(&self) -> &Ocp {
        self.expansion.as_ref().map_or(&self.ocp, |e| &e.ocp)
    }

    /// The whole flight of a solution.
    ///
    /// # Errors
    /// When the trajectory cannot be continued between its phases, for instance one of a solve that failed.
    pub fn expand(&self, solution: &Trajectory) -> Result<Trajectory, Error> {
        match &self.expansion {
            Some(expansion) => (expansion.expand)(&expansion.ocp, solution),
            None => Ok(solution.clone()),
        }
    }

    /// A trajectory as a start of the problem that is solved: of that problem itself, or of the whole flight that it is a reduction of.
    ///
    /// # Errors
    /// [`OcpError::Guess`] when it is neither.
    pub fn as_start(&self, trajectory: &Trajectory) -> Result<Trajectory, Error> {
        let misfit = match fits(&self.ocp, trajectory) {
            Ok(()) => return Ok(trajectory.clone()),
            Err(misfit) => misfit,
        };
        match &self.expansion {
            Some(expansion) if fits(&expansion.ocp, trajectory).is_ok() => {
                let reduced = (expansion.reduce)(&self.ocp, trajectory)?;
                fits(&self.ocp, &reduced)?;
                Ok(reduced)
            }
            _ => Err(misfit.into()),
        }
    }
}

/// Refuses a trajectory with other phases than those of a problem, by name, or of other sizes.
pub(crate) fn fits(ocp: &Ocp, trajectory: &Trajectory) -> Result<(), OcpError> {
    let names: Vec<&str> = ocp.phases.iter().map(|p| &*p.name).collect();
    let found: Vec<&str> = trajectory.phases.iter().map(|p| &*p.name).collect();
    if names != found {
        let reason = format!("expected the phases {}, found {}", names.join(", "), found.join(", "));
        return Err(OcpError::Guess { place: ocp.name.clone(), reason });
    }
    Guess::earlier(trajectory).check(ocp)
}

/// The trajectory of a whole flight from the solution of its reduction.
pub type Expand = dyn Fn(&Ocp, &Trajectory) -> Result<Trajectory, Error> + Send + Sync;

/// The trajectory of a reduction, for a problem that it is one of, from that of the whole flight.
pub type Reduce = dyn Fn(&Ocp, &Trajectory) -> Result<Trajectory, Error> + Send + Sync;

/// A whole flight whose optimum follows from that of a smaller problem.
#[derive(Clone)]
pub struct Expansion {
    /// The whole flight as a problem.
    pub ocp: Ocp,
    /// The trajectory of the whole flight, as a solution of `ocp`, from one of the smaller problem.
    pub expand: Arc<Expand>,
    /// The trajectory of the smaller problem, as a start, from one of the whole flight.
    pub reduce: Arc<Reduce>,
}
