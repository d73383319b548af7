//! Missions whose memory is foreseen.

use crate::Error;
use crate::memory::Foreseen;
use crate::pipeline::Pipeline;
use crate::posed::Posed;

impl Pipeline {
    /// The memory that a solve takes by the first discretisation.
    ///
    /// # Errors
    /// When the values do not make a problem.
    pub fn foreseen_memory(&self) -> Result<Foreseen, Error> {
        self.methods().foreseen(&self.pose()?)
    }

    /// Refuses a solve that takes more.
    pub(crate) fn check_memory(&self, posed: &Posed, most: Option<u64>) -> Result<(), Error> {
        most.map_or(Ok(()), |most| self.methods().foreseen(posed)?.within(most))
    }
}
