//! A solution as a flight.

use apsides_ephemeris::{About, Column, Flight, Instant, Motion, Span};
use apsides_ocp::{Ocp, Phase, Trajectory};

/// The trajectory of a problem: states and controls at any time from their polynomials, and the motion that a mission makes of them.
///
/// At an end of an interval of the mesh the controls are those of the later one, at the end of a phase those of the last.
pub struct SolvedFlight<'a> {
    trajectory: &'a Trajectory,
    motion: Option<Box<dyn Motion + 'a>>,
    columns: Vec<Column>,
    /// Columns of the states and of the controls of each phase.
    places: Vec<[Vec<usize>; 2]>,
}

impl<'a> SolvedFlight<'a> {
    /// A trajectory of `ocp`, with the motion of a mission if it has one.
    #[must_use]
    pub fn new(ocp: &Ocp, trajectory: &'a Trajectory, motion: Option<Box<dyn Motion + 'a>>) -> Self {
        let mut columns: Vec<Column> = Vec::new();
        let mut place = |name: &str, unit: &str| {
            let column = Column::new(name, unit);
            columns.iter().position(|known| *known == column).unwrap_or_else(|| {
                columns.push(column);
                columns.len() - 1
            })
        };
        let mut of_phase = |phase: &Phase| {
            let states = phase.states.iter().map(|s| place(&s.variable.name, &s.variable.unit)).collect();
            let controls = phase.controls.iter().map(|u| place(&u.name, &u.unit)).collect();
            [states, controls]
        };
        let places = ocp.phases.iter().map(&mut of_phase).collect();
        Self { trajectory, motion, columns, places }
    }
}

impl Flight for SolvedFlight<'_> {
    fn spans(&self) -> Vec<Span> {
        let span = |p: &apsides_ocp::PhaseTrajectory| Span {
            name: p.name.clone(),
            times: [p.initial_time, p.final_time],
        };
        self.trajectory.phases.iter().map(span).collect()
    }

    fn about(&self) -> Option<About> {
        self.motion.as_ref().map(|motion| motion.about())
    }

    fn own(&self) -> Vec<Column> {
        self.columns.clone()
    }

    fn at(&self, phase: usize, time: f64) -> Instant {
        let mut own = vec![f64::NAN; self.columns.len()];
        let (Some(flown), Some([of_states, of_controls])) =
            (self.trajectory.phases.get(phase), self.places.get(phase))
        else {
            return Instant { point: None, own };
        };
        let (state, control) = (flown.state_at(time), flown.control_at(time));
        let columns = of_states.iter().zip(&state).chain(of_controls.iter().zip(&control));
        columns.for_each(|(column, value)| own[*column] = *value);
        let point = self.motion.as_ref().and_then(|motion| motion.point(phase, time, &state, &control));
        Instant { point, own }
    }
}
