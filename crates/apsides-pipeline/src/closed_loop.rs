//! Flights of missions under their laws.

use std::time::Instant;

use crate::Error;
use crate::observer::Observer;
use crate::pipeline::{Pipeline, milliseconds};
use crate::simulation::{Simulated, Watch};

impl Pipeline {
    /// Flies a mission that is simulated, or the solution of one that is optimised with what its problem leaves out, where that is
    /// modelled.
    ///
    /// # Errors
    /// A mission that is optimised and not modelled further, values that do not make a case, a problem without a solution. A flight that
    /// fails is not an error: see [`SimulationSummary::status`](crate::simulation::SimulationSummary::status).
    pub fn simulate(&self) -> Result<Simulated, Error> {
        self.simulate_watched(&mut (), &|_| true)
    }

    /// As [`simulate`](Self::simulate); the observer sees the solve of what is flown, `watch` the flight, and each may end it.
    ///
    /// # Errors
    /// As of [`simulate`](Self::simulate).
    pub fn simulate_watched(
        &self,
        observer: &mut dyn Observer,
        watch: &Watch<'_>,
    ) -> Result<Simulated, Error> {
        let offers = &self.kind().offers;
        if !offers.simulated_only && !offers.simulation {
            return Err(self.kind().refused("it is optimised, not simulated: use `apsides solve`"));
        }
        let begin = Instant::now();
        self.mission().check_simulation()?;
        let plan = match offers.simulated_only {
            true => None,
            // Margins take solves of their own.
            false => Some(self.solve_with(None, false, observer)?),
        };
        if let Some(plan) = plan.as_ref().filter(|plan| !plan.status.is_success()) {
            let reason = format!("the flight to follow has no solution: {}", plan.summary.status);
            return Err(Error::in_mission(reason));
        }
        let mut flight = self.mission().simulate(self.seed(), plan.as_ref(), watch)?;
        flight.summary.mission = self.name().into();
        flight.summary.time_ms = milliseconds(begin);
        flight.mission_file = self.to_file();
        Ok(flight)
    }
}
