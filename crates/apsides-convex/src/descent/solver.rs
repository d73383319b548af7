//! Flight time, mass reference, and what is lacking when the target is not reached.

use apsides_basis::try_golden_section;
use apsides_conic::{ConicData, Status};

use super::problem::DescentProblem;
use super::program::DescentProgram;
use super::settings::{DescentSettings, FlightTime};
use super::solution::{DescentSolution, Outcome};
use crate::ConvexError;

/// Solves powered descents by lossless convexification; keeps the conic program for further solves.
#[derive(Debug)]
pub struct DescentSolver {
    program: DescentProgram,
    settings: DescentSettings,
    solves: usize,
    iterations: u32,
    mass_change: f64,
}

impl DescentSolver {
    /// # Errors
    /// [`ConvexError`] when problem or settings are ill-posed.
    pub fn new(problem: &DescentProblem, settings: DescentSettings) -> Result<Self, ConvexError> {
        problem.check()?;
        settings.check()?;
        let program = DescentProgram::new(problem, &settings);
        Ok(Self { program, settings, solves: 0, iterations: 0, mass_change: 0.0 })
    }

    /// Chooses the flight time and solves. If the target is not reached, the least miss is returned, and whether more propellant
    /// would help is found by a second search.
    ///
    /// # Errors
    /// [`ConvexError`] of the conic solver.
    pub fn solve(&mut self) -> Result<DescentSolution, ConvexError> {
        (self.solves, self.iterations) = (0, 0);
        let status = self.best_flight()?;
        let mut outcome = self.outcome(status);
        let mut solution = self.solution(outcome);
        if outcome != Outcome::Landed
            && let Some((needed, time)) = self.flight_with_more_propellant()?
        {
            let available = self.program.problem().propellant();
            if needed > available {
                let distance = self.program_miss(&solution);
                solution.outcome = Outcome::TooLittlePropellant { needed, available, distance };
            } else {
                // The flight is possible after all, at a time that the first search has passed over.
                self.program.reset_reference(time);
                let status = self.passes(time, self.settings.mass_passes)?;
                outcome = self.outcome(status);
                solution = self.solution(outcome);
            }
        }
        if solution.outcome == Outcome::Landed
            && let Some(relaxed) = solution.relaxed(self.program.problem().thrust[0])
        {
            solution.outcome = relaxed;
        }
        (solution.solves, solution.iterations) = (self.solves, self.iterations);
        Ok(solution)
    }

    /// Solves for one flight time with so many mass passes, from the reference of the last solve if there is one.
    ///
    /// # Errors
    /// [`ConvexError`] when the time is not positive, or of the conic solver.
    ///
    /// # Examples
    /// ```
    /// use apsides_convex::{DescentProblem, DescentSettings, DescentSolver};
    ///
    /// // The landing on Mars of Acikmese and Ploen, without a search for the time.
    /// let mut solver = DescentSolver::new(&DescentProblem::mars_lander(), DescentSettings::default())?;
    /// let short = solver.solve_at(60.0, 3)?;
    /// let long = solver.solve_at(72.0, 3)?;
    /// assert!(long.propellant < short.propellant);
    /// # Ok::<(), apsides_convex::ConvexError>(())
    /// ```
    pub fn solve_at(&mut self, flight_time: f64, passes: usize) -> Result<DescentSolution, ConvexError> {
        let valid = flight_time > 0.0 && flight_time.is_finite();
        crate::error::require(valid, "flight time", flight_time, "s", "positive and finite")?;
        (self.solves, self.iterations) = (0, 0);
        if self.program.value.is_infinite() {
            self.program.reset_reference(flight_time);
        }
        let status = self.passes(flight_time, passes.max(1))?;
        let mut solution = self.solution(self.outcome(status));
        (solution.solves, solution.iterations) = (self.solves, self.iterations);
        Ok(solution)
    }

    /// Starts the next solve from another state, as when plans are renewed in flight: the analysis of the program and its typical sizes
    /// stay.
    ///
    /// # Errors
    /// [`ConvexError`] when it is not finite, has no propellant or is outside the limits.
    pub fn set_start(
        &mut self,
        position: [f64; 3],
        velocity: [f64; 3],
        mass: f64,
    ) -> Result<(), ConvexError> {
        self.program.set_start(position, velocity, mass)
    }

    /// Lands the next solve at another target.
    ///
    /// # Errors
    /// [`ConvexError`] when it is not finite or the start is outside the glide slope to it.
    pub fn set_target(&mut self, target: [f64; 3]) -> Result<(), ConvexError> {
        self.program.set_target(target)
    }

    /// Variables and rows of the conic program, after a solve.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        self.program.size()
    }

    /// Data and workspace of the conic program, bytes; none with a solver that owns its memory.
    #[must_use]
    pub fn bytes(&self) -> Option<usize> {
        self.program.bytes()
    }

    /// The conic program of the last solve in the form of a general solver, for a check by another one.
    #[must_use]
    pub fn conic_data(&self) -> ConicData {
        self.program.data()
    }

    fn best_flight(&mut self) -> Result<Status, ConvexError> {
        let range = self.program.problem().time_range();
        let time = match self.settings.flight_time {
            FlightTime::Fixed(t) => t,
            FlightTime::GoldenSection { range: given, solves } => {
                let mut started = false;
                let [time, _] = try_golden_section(given.unwrap_or(range), solves, |t| {
                    // The first reference is far off: one more pass, so that values can be compared.
                    if !started {
                        self.program.reset_reference(t);
                    }
                    let passes = if started { 1 } else { 2 };
                    started = self.passes(t, passes)?.has_solution();
                    Ok::<_, ConvexError>(self.program.value)
                })?;
                time
            }
        };
        if self.program.value.is_infinite() {
            self.program.reset_reference(time);
        }
        self.passes(time, self.settings.mass_passes)
    }

    fn passes(&mut self, flight_time: f64, passes: usize) -> Result<Status, ConvexError> {
        let mut status = Status::NotSolved;
        for _ in 0..passes {
            status = self.program.solve(flight_time)?;
            self.solves += 1;
            self.iterations += self.program.report().map_or(0, |r| r.iterations);
            if !status.has_solution() {
                break;
            }
            self.mass_change = self.program.adopt_reference();
        }
        Ok(status)
    }

    fn solution(&self, outcome: Outcome) -> DescentSolution {
        let solution = DescentSolution::of(&self.program, outcome);
        DescentSolution { mass_change: self.mass_change, ..solution }
    }

    fn program_miss(&self, solution: &DescentSolution) -> f64 {
        let (target, end) = (self.program.problem().target, solution.positions[solution.positions.len() - 1]);
        (end[0] - target[0]).hypot(end[1] - target[1])
    }

    fn outcome(&self, status: Status) -> Outcome {
        if !status.has_solution() {
            return Outcome::NoFlight(status);
        }
        outcome_of(&self.program, self.settings.miss_tolerance)
    }

    /// Propellant with which the target would be reached, up to nine tenths of the mass, and the flight time, if there is such a flight.
    fn flight_with_more_propellant(&mut self) -> Result<Option<(f64, f64)>, ConvexError> {
        let problem =
            DescentProblem { dry_mass: 0.1 * self.program.problem().mass, ..*self.program.problem() };
        if problem.dry_mass >= self.program.problem().dry_mass {
            return Ok(None);
        }
        let mut other = Self::new(&problem, self.settings)?;
        let status = other.best_flight()?;
        self.solves += other.solves;
        self.iterations += other.iterations;
        if other.outcome(status) != Outcome::Landed {
            return Ok(None);
        }
        let solution = other.solution(Outcome::Landed);
        Ok(Some((solution.propellant, solution.flight_time)))
    }
}

/// By how much the end of the last solve misses the target.
pub(crate) fn outcome_of(program: &DescentProgram, tolerance: f64) -> Outcome {
    let p = program.problem();
    let end = program.states[program.states.len() - 1];
    let distance = (end[0] - p.target[0]).hypot(end[1] - p.target[1]);
    let height = end[2] - p.target[2];
    let speed = (0..3).map(|c| (end[3 + c] - p.target_velocity[c]).powi(2)).sum::<f64>().sqrt();
    if height.abs() > tolerance || speed > tolerance {
        Outcome::NoArrival { distance, height, speed }
    } else if distance > tolerance {
        Outcome::OutOfReach { distance }
    } else {
        Outcome::Landed
    }
}
