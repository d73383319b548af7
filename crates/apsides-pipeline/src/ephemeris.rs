//! Ephemerides of solutions and records: both are flights that can be asked at any time.

mod recorded;
mod solved;

use apsides_ephemeris::{Ephemeris, EphemerisError, Flight, Format, NEEDED, Sampling};
use apsides_ocp::{Ocp, Trajectory};

use crate::Error;
use crate::memory::Foreseen;
use crate::outcome::Decisions;
use crate::pipeline::Pipeline;
use crate::placing::Whereabouts;

pub use recorded::RecordedFlight;
pub use solved::SolvedFlight;

/// Bytes that rows may take where nobody says.
const UNSTATED: u64 = 8 << 30;

impl Pipeline {
    /// Refuses formats of an ephemeris that need what the flights of the mission do not have.
    ///
    /// # Errors
    /// The sentence says what would be needed.
    pub fn check_formats(&self, formats: &[Format]) -> Result<(), Error> {
        let (placed, turned, needed) = match self.mission().whereabouts() {
            Whereabouts::Nowhere => (false, false, NEEDED),
            Whereabouts::NotSo(why) => (false, false, why),
            Whereabouts::Point => (true, false, ""),
            Whereabouts::Attitude => (true, true, ""),
        };
        let flight = || format!("`{}`", self.name());
        for format in formats.iter().copied() {
            if format.needs_place() && !placed {
                return Err(EphemerisError::NoPlace { format, flight: flight(), needed }.into());
            }
            if format == Format::Aem && !turned {
                return Err(EphemerisError::NoAttitude { format, flight: flight() }.into());
            }
        }
        Ok(())
    }

    /// The ephemeris of a solution of the whole flight `ocp` with its decisions.
    ///
    /// # Errors
    /// More rows than memory is allowed for; states that are not finite.
    pub fn ephemeris(
        &self,
        decisions: &Decisions,
        ocp: &Ocp,
        trajectory: &Trajectory,
        sampling: Sampling,
    ) -> Result<Ephemeris, Error> {
        let decided = self.decided(decisions)?;
        let motion = decided.mission().motion(trajectory);
        self.rows(&SolvedFlight::new(ocp, trajectory, motion), sampling)
    }

    /// The ephemeris of the record of a simulated flight, by the headers of its columns, the first being the time.
    ///
    /// # Errors
    /// A record without columns that a flight has; more rows than memory is allowed for.
    pub fn ephemeris_of_record(
        &self,
        headers: &[String],
        rows: &[Vec<f64>],
        sampling: Sampling,
    ) -> Result<Ephemeris, Error> {
        let flight = RecordedFlight::new(headers, rows, self.mission().record_about())?;
        self.rows(&flight, sampling)
    }

    fn rows(&self, flight: &dyn Flight, sampling: Sampling) -> Result<Ephemeris, Error> {
        let spans = flight.spans();
        let cause = match sampling {
            Sampling::Step(step) => format!("`--step` = {step} s, {:.3e} rows", sampling.rows(&spans)),
            Sampling::Points(points) => format!("`--points` = {points}"),
        };
        Foreseen { bytes: sampling.bytes(&spans), cause }.within(self.memory().unwrap_or(UNSTATED))?;
        Ok(Ephemeris::of(self.name(), flight, self.placing(), sampling)?)
    }
}
