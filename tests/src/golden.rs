//! Stored counters between which and a little less the counters of a solve stay: slow-downs and speed-ups show without timing.
//!
//! `tests/golden/counters.json` holds them by name. With `APSIDES_BLESS=1` in the environment the test that compares them writes the file
//! anew.

use std::collections::BTreeMap;
use std::path::PathBuf;

use apsides::nlp::Nlp;
use apsides::ocp::{Guess, Mesh, Ocp, Trajectory};
use apsides::radau::Transcription;
use serde::{Deserialize, Serialize};

use crate::Failure;

/// Work of one solve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Work {
    /// Meshes solved.
    pub meshes: usize,
    /// Interior-point iterations over all meshes.
    pub iterations: usize,
    /// Factorisations over all meshes.
    pub factorisations: usize,
    /// Entries of the lower triangle of the KKT matrix on the last mesh: Hessian, Jacobian, and the diagonal that regularisation fills.
    pub nonzeros: usize,
}

impl Work {
    /// No counter is above the stored one, and none is below it by more than a tenth, or by more than 1 where that is less than 1.
    #[must_use]
    pub fn is_near(&self, stored: &Self) -> bool {
        let near = |found: usize, stored: usize| found <= stored && found + (stored / 10).max(1) >= stored;
        near(self.meshes, stored.meshes)
            && near(self.iterations, stored.iterations)
            && near(self.factorisations, stored.factorisations)
            && near(self.nonzeros, stored.nonzeros)
    }
}

/// Entries of the lower triangle of the KKT matrix of a problem that is collocated on the mesh of a trajectory.
///
/// # Errors
/// When the mesh does not fit the problem.
pub fn kkt_nonzeros(ocp: &Ocp, trajectory: &Trajectory) -> Result<usize, Failure> {
    let mesh = Mesh { phases: trajectory.phases.iter().map(|p| p.mesh.clone()).collect() };
    let nlp = Transcription::new(ocp, &mesh, &Guess::linear(ocp))?;
    let diagonal = nlp.variables() + nlp.constraints();
    Ok(nlp.hessian_pattern().len() + nlp.jacobian_pattern().len() + diagonal)
}

/// Work by the name of the problem or mission.
pub type Counters = BTreeMap<String, Work>;

fn path() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("golden/counters.json")
}

/// True if the stored counters are to be written anew.
#[must_use]
pub fn blessing() -> bool {
    std::env::var_os("APSIDES_BLESS").is_some_and(|v| v == "1")
}

/// The stored counters.
///
/// # Errors
/// When the file is missing or not of the expected form.
pub fn load() -> Result<Counters, Failure> {
    Ok(serde_json::from_str(&std::fs::read_to_string(path())?)?)
}

/// Writes the counters.
///
/// # Errors
/// When the file cannot be written.
pub fn store(counters: &Counters) -> Result<(), Failure> {
    std::fs::write(path(), serde_json::to_string_pretty(counters)? + "\n")?;
    Ok(())
}
