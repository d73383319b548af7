//! The conic program of one flight time.
//!
//! Variables per control point: `u = T/m` and `s >= |u|`; states, as far as the solver keeps them; two distances by which the end misses the target,
//! `t_h` on the horizontal plane and `t_a` in height and velocity. With `d = ln(m / m(0))` and its reference `d*`,
//!
//! ```text
//! minimise -d(tf) + w_h t_h + w_a t_a
//! |u| <= s,   m1 (1 - e [+ e^2/2]) <= s <= m2 (1 - e),   e = d - d*,   m_i = T_i / (m(0) exp d*)
//! u_z >= cos(pointing) s,   d(tf) >= ln(dry mass / m(0)),   |M_k+1 u_k+1 - M_k u_k| <= thrust rate h,   M = m(0) exp d*
//! |r - target|_h tan(e) <= r_z - target_z,   |v| <= speed
//! |(x, y)(tf) - target| <= t_h,   |(z, v)(tf) - target| <= t_a
//! ```
//!
//! Lengths, times and accelerations are divided by typical sizes of the problem.

use apsides_conic::{ConicData, ConicReport, Status};

use super::blocks::BlockDescent;
use super::posed::{LOG_MASS, Posed, STATES};
use super::problem::DescentProblem;
use super::settings::{ConeSolver, DescentSettings};
use super::stages::StageDescent;
use super::transition::{Hold, Transition};
use crate::ConvexError;

/// The program as its solver takes it.
#[derive(Debug)]
enum Engine {
    Stages(StageDescent),
    Blocks(Box<BlockDescent>),
}

/// The program, its data and its last solution. Owns all storage.
#[derive(Debug)]
pub(crate) struct DescentProgram {
    posed: Posed,
    engine: Engine,
    report: Option<ConicReport>,
    /// States at the nodes and controls of the last solve, SI; log of mass ratio last.
    pub(crate) states: Vec<[f64; STATES]>,
    pub(crate) controls: Vec<[f64; 4]>,
    pub(crate) miss: [f64; 2],
    pub(crate) value: f64,
}

impl DescentProgram {
    pub(crate) fn new(problem: &DescentProblem, settings: &DescentSettings) -> Self {
        let posed = Posed::new(problem, settings);
        let engine = match settings.cone_solver {
            ConeSolver::Stages => Engine::Stages(StageDescent::new(&posed, settings)),
            ConeSolver::Clarabel => Engine::Blocks(Box::new(BlockDescent::new(&posed, settings))),
        };
        let (nodes, inputs) = (posed.intervals + 1, posed.inputs());
        Self {
            posed,
            engine,
            report: None,
            states: vec![[0.0; STATES]; nodes],
            controls: vec![[0.0; 4]; inputs],
            miss: [0.0; 2],
            value: f64::INFINITY,
        }
    }

    pub(crate) fn problem(&self) -> &DescentProblem {
        &self.posed.problem
    }

    /// Another target; the pattern stays.
    pub(crate) fn set_target(&mut self, target: [f64; 3]) -> Result<(), ConvexError> {
        let problem = DescentProblem { target, ..self.posed.problem };
        problem.check()?;
        self.posed.problem = problem;
        Ok(())
    }

    /// Another start; pattern and units stay. The reference, relative to the mass at the start, no longer fits.
    pub(crate) fn set_start(
        &mut self,
        position: [f64; 3],
        velocity: [f64; 3],
        mass: f64,
    ) -> Result<(), ConvexError> {
        let problem = DescentProblem { position, velocity, mass, ..self.posed.problem };
        problem.check()?;
        self.posed.problem = problem;
        self.value = f64::INFINITY;
        Ok(())
    }

    pub(crate) fn node_time(&self, node: usize) -> f64 {
        self.posed.duration * node as f64 / self.posed.intervals as f64
    }

    /// Reference of the paper: full thrust from the start, until the propellant is gone.
    pub(crate) fn reset_reference(&mut self, duration: f64) {
        self.posed.reset_reference(duration);
    }

    /// Takes the masses of the last solve as the reference; returns the largest change.
    pub(crate) fn adopt_reference(&mut self) -> f64 {
        let mut change = 0.0_f64;
        for (r, x) in self.posed.reference.iter_mut().zip(&self.states) {
            change = change.max((*r - x[LOG_MASS]).abs());
            *r = x[LOG_MASS];
        }
        change
    }

    /// Solves for a flight time, with the present reference.
    pub(crate) fn solve(&mut self, duration: f64) -> Result<Status, ConvexError> {
        self.posed.duration = duration;
        let report = match &mut self.engine {
            Engine::Stages(stages) => stages.solve(&self.posed)?,
            Engine::Blocks(blocks) => blocks.solve(&self.posed)?,
        };
        self.report = Some(report);
        self.value = f64::INFINITY;
        if report.status.has_solution() {
            self.value = report.objective;
            self.read_solution();
        } else {
            self.states.fill([f64::NAN; STATES]);
            self.controls.fill([f64::NAN; 4]);
        }
        Ok(report.status)
    }

    pub(crate) fn report(&self) -> Option<ConicReport> {
        self.report
    }

    /// Variables and rows.
    pub(crate) fn size(&self) -> (usize, usize) {
        match &self.engine {
            Engine::Stages(stages) => stages.size(),
            Engine::Blocks(blocks) => blocks.size(),
        }
    }

    /// The data of the last solve as one sparse program.
    pub(crate) fn data(&self) -> ConicData {
        match &self.engine {
            Engine::Stages(stages) => stages.data(&self.posed),
            Engine::Blocks(blocks) => blocks.data(),
        }
    }

    /// Data and workspace, bytes; none where another library owns them.
    pub(crate) fn bytes(&self) -> Option<usize> {
        match &self.engine {
            Engine::Stages(stages) => Some(stages.bytes()),
            Engine::Blocks(_) => None,
        }
    }

    fn read_solution(&mut self) {
        self.miss = match &mut self.engine {
            Engine::Stages(stages) => stages.read(&mut self.controls),
            Engine::Blocks(blocks) => blocks.read(&self.posed, &mut self.controls),
        };
        let posed = &self.posed;
        self.controls.iter_mut().flatten().for_each(|u| *u *= posed.units.acceleration);
        let p = &posed.problem;
        let mut state = [0.0; STATES];
        for c in 0..3 {
            (state[c], state[3 + c]) = (p.position[c], p.velocity[c]);
        }
        self.states[0] = state;
        // One interval after another: the eliminated states.
        let w = p.rotation;
        let h = posed.step();
        let step = Transition::new(&w, h, posed.hold);
        for k in 0..posed.intervals {
            let a = self.controls[k];
            let b = if posed.hold == Hold::First { self.controls[k + 1] } else { a };
            let old = state;
            for r in 0..6 {
                let free: f64 = (0..6).map(|c| step.phi[r][c] * old[c]).sum();
                let forced = |c: usize| {
                    step.first[r][c] * a[c] + step.last[r][c] * b[c] + step.constant[r][c] * p.gravity[c]
                };
                state[r] = free + (0..3).map(forced).sum::<f64>();
            }
            state[LOG_MASS] = old[LOG_MASS] - 0.5 * h * (a[3] + b[3]) / p.exhaust_velocity;
            self.states[k + 1] = state;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::problem::DescentLimits;
    use super::*;

    /// Allocations of a solve that is not the first.
    fn allocations(cone_solver: ConeSolver, limits: DescentLimits) -> u64 {
        let problem = DescentProblem { limits, ..DescentProblem::mars_lander() };
        let settings = DescentSettings { cone_solver, ..DescentSettings::default() };
        let mut program = DescentProgram::new(&problem, &settings);
        program.reset_reference(78.0);
        program.solve(78.0).unwrap();
        program.adopt_reference();
        let measured = allocation_counter::measure(|| {
            program.set_target([10.0, 5.0, 0.0]).unwrap();
            assert!(program.solve(80.0).unwrap().has_solution());
            program.adopt_reference();
        });
        measured.count_total
    }

    #[test]
    fn a_second_solve_allocates_nothing_but_what_clarabel_does() {
        let usual =
            DescentLimits { glide_slope: Some(0.05), pointing: Some(1.4), ..DescentLimits::default() };
        let full = DescentLimits { speed: Some(200.0), thrust_rate: Some(5000.0), ..usual };
        assert_eq!(allocations(ConeSolver::Stages, usual), 0);
        assert_eq!(allocations(ConeSolver::Stages, full), 0);
        assert!(allocations(ConeSolver::Clarabel, usual) > 0);
    }
}
