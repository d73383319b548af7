//! From one state to many candidate sites: one conic program, whose right-hand side and flight time change.

use apsides_basis::try_golden_section;
use apsides_conic::Status;

use super::flight_time::valley;
use super::problem::DescentProblem;
use super::program::DescentProgram;
use super::settings::DescentSettings;
use super::solution::Outcome;
use super::solver::outcome_of;
use crate::ConvexError;
use crate::error::require;

/// Settings of a [`DivertPlanner`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DivertSettings {
    /// Discretisation; `flight_time` and `mass_passes` are not used.
    pub descent: DescentSettings,
    /// Most solves per site, default 7.
    pub solves: usize,
    /// Solves for the first site, default 16.
    pub first_solves: usize,
    /// First step of the flight time, relative, default 0.02.
    pub time_step: f64,
}

impl Default for DivertSettings {
    fn default() -> Self {
        let descent = DescentSettings { intervals: 20, block: 5, ..DescentSettings::default() };
        Self { descent, solves: 7, first_solves: 16, time_step: 0.02 }
    }
}

/// The flight to a site, and its cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Divert {
    /// The site, m.
    pub target: [f64; 3],
    /// The outcome: a site is reached or missed; propellant shortage shows as a miss here.
    pub outcome: Outcome,
    /// Propellant, kg.
    pub propellant: f64,
    /// Flight time, s.
    pub flight_time: f64,
    /// Largest `1 - |u| / s`.
    pub relaxation_gap: f64,
}

/// Plans from one state to candidate sites. Sites should come ordered so that neighbours are near: each search starts from the flight time
/// and the masses of the one before.
#[derive(Debug)]
pub struct DivertPlanner {
    program: DescentProgram,
    settings: DivertSettings,
    time: Option<f64>,
    solves: usize,
}

impl DivertPlanner {
    /// A planner from the start of `problem`; its target is only a typical one.
    ///
    /// # Errors
    /// [`ConvexError`] when problem or settings are ill-posed.
    pub fn new(problem: &DescentProblem, settings: DivertSettings) -> Result<Self, ConvexError> {
        problem.check()?;
        settings.descent.check()?;
        require(settings.solves >= 3, "solves per site", settings.solves as f64, "", "at least 3")?;
        let step = settings.time_step;
        require(step > 0.0 && step < 1.0, "time step", step, "", "above 0 and below 1")?;
        let program = DescentProgram::new(problem, &settings.descent);
        Ok(Self { program, settings, time: None, solves: 0 })
    }

    /// Starts from another state: the analysis of the program and its typical sizes stay.
    ///
    /// # Errors
    /// [`ConvexError`] when it is not finite, has no propellant or is outside the limits.
    pub fn set_start(
        &mut self,
        position: [f64; 3],
        velocity: [f64; 3],
        mass: f64,
    ) -> Result<(), ConvexError> {
        self.program.set_start(position, velocity, mass)?;
        self.time = None;
        Ok(())
    }

    /// Conic programs solved so far.
    #[must_use]
    pub fn solves(&self) -> usize {
        self.solves
    }

    /// Plans to one site.
    ///
    /// # Errors
    /// [`ConvexError`] when the site is not finite or the start is outside the glide slope to it; of the conic solver.
    pub fn divert(&mut self, target: [f64; 3]) -> Result<Divert, ConvexError> {
        self.program.set_target(target)?;
        let range = self.program.problem().time_range();
        let time = match self.time {
            None => {
                let mut started = false;
                let (program, solves) = (&mut self.program, &mut self.solves);
                let [time, _] = try_golden_section(range, self.settings.first_solves, |t| {
                    if !started {
                        program.reset_reference(t);
                        program.solve(t)?;
                        program.adopt_reference();
                        *solves += 1;
                    }
                    started |= solve(program, solves, t)?.has_solution();
                    Ok::<_, ConvexError>(program.value)
                })?;
                time
            }
            Some(t) => {
                let (program, solves) = (&mut self.program, &mut self.solves);
                let most = self.settings.solves - 1;
                valley(t, self.settings.time_step * t, range, most, |t| {
                    solve(program, solves, t)?;
                    Ok(program.value)
                })?
            }
        };
        let status = solve(&mut self.program, &mut self.solves, time)?;
        if !status.has_solution() {
            let outcome = Outcome::NoFlight(status);
            let nan = f64::NAN;
            return Ok(Divert { target, outcome, propellant: nan, flight_time: time, relaxation_gap: nan });
        }
        self.time = Some(time);
        let program = &self.program;
        let end = program.states[program.states.len() - 1];
        let gap = |u: &[f64; 4]| 1.0 - (u[0] * u[0] + u[1] * u[1] + u[2] * u[2]).sqrt() / u[3];
        Ok(Divert {
            target,
            outcome: outcome_of(program, self.settings.descent.miss_tolerance),
            propellant: -program.problem().mass * end[6].exp_m1(),
            flight_time: time,
            relaxation_gap: program.controls.iter().map(gap).fold(0.0, f64::max),
        })
    }

    /// Plans to each site, in order.
    ///
    /// # Errors
    /// As [`divert`](Self::divert).
    pub fn plan(&mut self, targets: &[[f64; 3]]) -> Result<Vec<Divert>, ConvexError> {
        targets.iter().map(|&t| self.divert(t)).collect()
    }
}

fn solve(program: &mut DescentProgram, solves: &mut usize, time: f64) -> Result<Status, ConvexError> {
    let status = program.solve(time)?;
    *solves += 1;
    if status.has_solution() {
        program.adopt_reference();
    }
    Ok(status)
}
