//! The conic program of one flight time as stages: a state and a control point each, and one for the end.
//!
//! With linear controls an interval has the controls of both its ends. States `y = x - B1 u` take the second one out,
//!
//! ```text
//! y_k+1 = Phi x_k + B0 u_k + G g,   x_k = y_k + B1 u_k  (x_0 = y_0)
//! ```
//!
//! so that all limits of a node and the equations to the next are functions of `(u_k, y_k)`. The last stage has the end of the flight as its
//! state and the two distances of the miss as its controls.

use apsides_conic::{Cone, ConicData, ConicReport, Status};
use apsides_stage_cone::sparse::Entry;
use apsides_stage_cone::{Row, Stage, StageProgram, StageSettings, StageWork, solve_stages};

use super::posed::{LOG_MASS, Posed, STATES};
use super::settings::{DescentSettings, LowerBound};
use super::transition::{Hold, Transition};
use crate::ConvexError;

/// Controls of a stage: `u` and `s`.
const CONTROLS: usize = 4;
/// Variables of a stage without and with the control before among its states.
const PLAIN: usize = STATES + CONTROLS;
const PREVIOUS: usize = PLAIN + 3;

/// The program in the sizes that its limits need.
#[derive(Debug)]
pub(super) enum StageDescent {
    /// Tangents of the least thrust, pointing, glide slope.
    Usual(Sized<STATES, PLAIN, 10>),
    /// Every limit.
    Full(Sized<{ STATES + 3 }, PREVIOUS, 20>),
}

impl StageDescent {
    pub(super) fn new(posed: &Posed, settings: &DescentSettings) -> Self {
        let limits = &posed.problem.limits;
        let usual = limits.speed.is_none()
            && limits.thrust_rate.is_none()
            && posed.lower_bound == LowerBound::Tangent;
        if usual { Self::Usual(Sized::new(posed, settings)) } else { Self::Full(Sized::new(posed, settings)) }
    }

    /// Writes the data, and solves.
    pub(super) fn solve(&mut self, posed: &Posed) -> Result<ConicReport, ConvexError> {
        match self {
            Self::Usual(program) => program.solve(posed),
            Self::Full(program) => program.solve(posed),
        }
    }

    /// Control points, in units, and misses of the last solve.
    pub(super) fn read(&self, controls: &mut [[f64; CONTROLS]]) -> [f64; 2] {
        match self {
            Self::Usual(program) => program.read(controls),
            Self::Full(program) => program.read(controls),
        }
    }

    /// Variables and rows.
    pub(super) fn size(&self) -> (usize, usize) {
        match self {
            Self::Usual(program) => program.size(),
            Self::Full(program) => program.size(),
        }
    }

    /// The data of the last solve as one sparse program.
    pub(super) fn data(&self, posed: &Posed) -> ConicData {
        match self {
            Self::Usual(program) => program.data(posed),
            Self::Full(program) => program.data(posed),
        }
    }

    /// Data and workspace, bytes.
    pub(super) fn bytes(&self) -> usize {
        match self {
            Self::Usual(program) => size_of_val(&*program.stages) + size_of_val(&*program.work),
            Self::Full(program) => size_of_val(&*program.stages) + size_of_val(&*program.work),
        }
    }
}

/// Stages with `NX` states, `NW` variables and at most `NR` rows.
#[derive(Debug)]
pub(super) struct Sized<const NX: usize, const NW: usize, const NR: usize> {
    stages: Vec<Stage<NX, NW, NR>>,
    work: Vec<StageWork<NX, NW, NR, 0>>,
    settings: StageSettings,
}

impl<const NX: usize, const NW: usize, const NR: usize> Sized<NX, NW, NR> {
    fn new(posed: &Posed, settings: &DescentSettings) -> Self {
        let count = posed.inputs() + 1;
        let mut stages = vec![Stage::EMPTY; count];
        if posed.problem.limits.upright_end {
            stages[count - 2].controls[..2].fill(false);
        }
        let end = &mut stages[count - 1];
        end.controls[2..CONTROLS].fill(false);
        let conic = &settings.conic;
        let settings = StageSettings {
            gap_tolerance: conic.gap_tolerance,
            feasibility_tolerance: conic.feasibility_tolerance,
            max_iterations: conic.max_iterations,
        };
        Self { stages, work: vec![StageWork::ZERO; count], settings }
    }

    fn solve(&mut self, posed: &Posed) -> Result<ConicReport, ConvexError> {
        self.write(posed);
        let program = StageProgram { stages: &self.stages, start: start(posed), end: [], end_values: [] };
        let report = solve_stages(&program, &mut self.work, &self.settings)?;
        use apsides_stage_cone::Status as Ended;
        let status = match report.status {
            Ended::Solved => Status::Solved,
            Ended::SolvedReduced => Status::SolvedReduced,
            Ended::Infeasible => Status::Infeasible,
            Ended::Unbounded => Status::Unbounded,
            Ended::IterationLimit => Status::IterationLimit,
            _ => Status::Stalled,
        };
        Ok(ConicReport {
            status,
            iterations: report.iterations,
            objective: report.objective,
            dual_objective: report.dual_objective,
            primal_residual: report.primal_residual,
            dual_residual: report.dual_residual,
        })
    }

    fn read(&self, controls: &mut [[f64; CONTROLS]]) -> [f64; 2] {
        for (control, work) in controls.iter_mut().zip(&self.work) {
            control.copy_from_slice(&work.variables()[..CONTROLS]);
        }
        let end = self.work[self.work.len() - 1].variables();
        [end[0], end[1]]
    }

    fn size(&self) -> (usize, usize) {
        let program = StageProgram { stages: &self.stages, start: [0.0; NX], end: [], end_values: [] };
        let [variables, equations, _] = program.sparse_sizes();
        (variables, equations + self.stages.iter().map(Stage::rows).sum::<usize>())
    }

    fn data(&self, posed: &Posed) -> ConicData {
        let program = StageProgram { stages: &self.stages, start: start(posed), end: [], end_values: [] };
        let [variables, equations, linear] = program.sparse_sizes();
        let mut data = ConicData { linear: vec![0.0; variables], ..ConicData::default() };
        data.cones = vec![Cone::Zero(equations), Cone::NonNegative(linear)];
        let mut constants = Vec::new();
        program.sparse(|entry| match entry {
            Entry::Cost { column, value } => data.linear[column] = value,
            Entry::Matrix { row, column, value } => data.matrix.push(row, column, value),
            Entry::Constant { row, value } => constants.push((row, value)),
            Entry::Cone { size } => data.cones.push(Cone::SecondOrder(size)),
        });
        data.right_hand_side = vec![0.0; constants.len()];
        constants.iter().for_each(|&(row, value)| data.right_hand_side[row] = value);
        data
    }

    fn write(&mut self, posed: &Posed) {
        let step = posed.transition();
        let count = self.stages.len();
        for k in 0..count - 1 {
            let mut writer = StageWriter { posed, step: &step, k, stage: &mut self.stages[k] };
            writer.dynamics();
            writer.stage.clear();
            writer.thrust();
            writer.cones();
        }
        end(posed, &mut self.stages[count - 1]);
    }
}

/// State at the start, in units.
fn start<const NX: usize>(posed: &Posed) -> [f64; NX] {
    let p = &posed.problem;
    let mut start = [0.0; NX];
    for c in 0..3 {
        start[c] = p.position[c] / posed.units.state(c);
        start[3 + c] = p.velocity[c] / posed.units.state(3 + c);
    }
    start
}

/// The last stage: price of propellant and miss, dry mass.
fn end<const NX: usize, const NW: usize, const NR: usize>(posed: &Posed, stage: &mut Stage<NX, NW, NR>) {
    let state = Stage::<NX, NW, NR>::state;
    stage.cost[state(LOG_MASS)] = -1.0;
    (stage.cost[0], stage.cost[1]) = (posed.miss_price, 10.0 * posed.miss_price);
    stage.clear();
    stage.add_linear(Row::of(&[(state(LOG_MASS), 1.0)]), -posed.least_log_mass());
    let part = |s: usize| (Row::of(&[(state(s), 1.0)]), -posed.goal(s));
    let miss = |control: usize| (Row::of(&[(control, 1.0)]), 0.0);
    stage.add_cone(&[miss(0), part(0), part(1)]);
    stage.add_cone(&[miss(1), part(2), part(3), part(4), part(5)]);
}

/// The stage of one control point.
struct StageWriter<'a, const NX: usize, const NW: usize, const NR: usize> {
    posed: &'a Posed,
    step: &'a Transition,
    k: usize,
    stage: &'a mut Stage<NX, NW, NR>,
}

impl<const NX: usize, const NW: usize, const NR: usize> StageWriter<'_, NX, NW, NR> {
    /// True if the states of the stage lack the share of its own control.
    fn lacks_share(&self) -> bool {
        self.posed.hold == Hold::First && self.k > 0
    }

    fn control(&self, row: &mut Row<NW>, control: usize, factor: f64) {
        if self.stage.controls[control] {
            row.add(control, factor);
        }
    }

    /// Adds a multiple of a state at the node.
    fn state(&self, row: &mut Row<NW>, s: usize, factor: f64) {
        row.add(Stage::<NX, NW, NR>::state(s), factor);
        if !self.lacks_share() {
            return;
        }
        if s == LOG_MASS {
            self.control(row, 3, -0.5 * factor * self.posed.mass_share());
            return;
        }
        for a in 0..3 {
            if self.posed.coupled || a == s % 3 {
                self.control(row, a, factor * self.step.last[s][a]);
            }
        }
    }

    fn state_row(&self, s: usize, factor: f64) -> Row<NW> {
        let mut row = Row::ZERO;
        self.state(&mut row, s, factor);
        row
    }

    fn control_row(&self, control: usize, factor: f64) -> Row<NW> {
        let mut row = Row::ZERO;
        self.control(&mut row, control, factor);
        row
    }

    fn dynamics(&mut self) {
        let posed = self.posed;
        // From the last control point of linear controls to the end of the flight there is no time left.
        let at_end = self.k == posed.intervals;
        for s in 0..STATES {
            let mut row = Row::ZERO;
            self.stage.offset[s] = 0.0;
            if at_end {
                self.state(&mut row, s, 1.0);
            } else if s == LOG_MASS {
                self.state(&mut row, s, 1.0);
                let part = if posed.hold == Hold::First { 0.5 } else { 1.0 };
                self.control(&mut row, 3, -part * posed.mass_share());
            } else {
                for c in (0..6).filter(|&c| posed.coupled || (c % 3 == s % 3 && c >= s / 3 * 3)) {
                    self.state(&mut row, c, self.step.phi[s][c]);
                }
                for a in (0..3).filter(|&a| posed.coupled || a == s % 3) {
                    self.control(&mut row, a, self.step.first[s][a]);
                }
                let gravity = posed.problem.gravity.map(|g| g / posed.units.acceleration);
                self.stage.offset[s] = (0..3).map(|a| self.step.constant[s][a] * gravity[a]).sum();
            }
            self.stage.dynamics[s] = row;
        }
        for a in 0..NX - STATES {
            self.stage.dynamics[STATES + a] = self.control_row(a, 1.0);
        }
    }

    /// The node where the least thrust holds, as a row of its logarithm of mass and the node's reference.
    fn lower_log_mass(&self) -> (Row<NW>, f64) {
        let mut row = self.state_row(LOG_MASS, 1.0);
        let node = self.posed.lower_node(self.k);
        if node != self.k {
            self.control(&mut row, 3, -self.posed.mass_share());
        }
        (row, self.posed.reference[node])
    }

    fn thrust(&mut self) {
        let posed = self.posed;
        let [least, most] = posed.problem.thrust;
        let reference = posed.reference[self.k];
        let limit = posed.specific(most, reference);
        let mut row = self.state_row(LOG_MASS, -limit);
        self.control(&mut row, 3, -1.0);
        self.stage.add_linear(row, limit * (1.0 + reference));
        if posed.lower_bound == LowerBound::Tangent {
            let (log_mass, reference) = self.lower_log_mass();
            let limit = posed.specific(least, reference);
            let mut row = scaled(&log_mass, limit);
            self.control(&mut row, 3, 1.0);
            self.stage.add_linear(row, -limit * (1.0 + reference));
        }
        if let Some(angle) = posed.problem.limits.pointing {
            let mut row = self.control_row(2, 1.0);
            self.control(&mut row, 3, -angle.cos());
            self.stage.add_linear(row, 0.0);
        }
    }

    fn cones(&mut self) {
        let posed = self.posed;
        let limits = &posed.problem.limits;
        let thrust = [3, 0, 1, 2].map(|c| (self.control_row(c, 1.0), 0.0));
        self.stage.add_cone(&thrust);
        if posed.lower_bound == LowerBound::Quadratic {
            self.quadratic_bound();
        }
        if let Some(rate) = limits.thrust_rate
            && self.k > 0
        {
            self.rate(rate);
        }
        if self.k == 0 || self.k >= posed.intervals {
            return;
        }
        if let Some(elevation) = limits.glide_slope {
            let tangent = elevation.tan();
            let rows = [(2, 1.0), (0, tangent), (1, tangent)];
            let rows = rows.map(|(s, factor)| (self.state_row(s, factor), -factor * posed.goal(s)));
            self.stage.add_cone(&rows);
        }
        if let Some(speed) = limits.speed {
            let part = |s| (self.state_row(s, 1.0), 0.0);
            let rows = [(Row::ZERO, speed / posed.units.speed), part(3), part(4), part(5)];
            self.stage.add_cone(&rows);
        }
    }

    /// `y >= e^2/2` with `y = s/m1 - 1 + e`, as `|(e, y - 1/2)| <= y + 1/2`.
    fn quadratic_bound(&mut self) {
        let (log_mass, reference) = self.lower_log_mass();
        let limit = self.posed.quadratic_limit(reference);
        let rows = [-0.5, 0.0, -1.5].map(|shift| {
            let mut row = log_mass;
            if shift != 0.0 {
                self.control(&mut row, 3, 1.0 / limit);
            }
            (row, shift - reference)
        });
        self.stage.add_cone(&rows);
    }

    /// The change of the thrust since the control point before, which is among the states.
    fn rate(&mut self, rate: f64) {
        let posed = self.posed;
        let masses = [self.k, self.k - 1].map(|node| posed.reference[node].exp());
        let part = |a: usize| {
            let mut row = self.control_row(a, masses[0]);
            row.add(Stage::<NX, NW, NR>::state(STATES + a), -masses[1]);
            (row, 0.0)
        };
        let rows = [(Row::ZERO, posed.thrust_change(rate)), part(0), part(1), part(2)];
        self.stage.add_cone(&rows);
    }
}

fn scaled<const NW: usize>(row: &Row<NW>, factor: f64) -> Row<NW> {
    let mut scaled = Row::ZERO;
    row.terms().for_each(|(c, v)| scaled.add(c, factor * v));
    scaled
}
