//! The conic program of one flight time for a general solver, with states eliminated inside blocks of intervals.
//!
//! The variables are those of [`program`](super::program), of the states those at the starts of blocks but the first. Every row is a function of
//! `(x, u, s)` at one point, so that its entries are those of the block: the state at the start of the block and the controls since.

use apsides_conic::{Cone, ConicData, ConicProgram, ConicReport, ConicSettings, Triplets};

use super::posed::{LOG_MASS, Posed, STATES};
use super::settings::{DescentSettings, LowerBound};
use super::transition::{BlockMaps, Hold};
use crate::ConvexError;
use crate::rows::Rows;

/// Rows and solver; owns all storage.
#[derive(Debug)]
pub(super) struct BlockDescent {
    block: usize,
    maps: BlockMaps,
    rows: Rows,
    linear: Vec<f64>,
    program: Option<ConicProgram>,
    settings: ConicSettings,
}

impl BlockDescent {
    pub(super) fn new(posed: &Posed, settings: &DescentSettings) -> Self {
        let block = settings.block.clamp(1, settings.intervals);
        let mut program = Self {
            block,
            maps: BlockMaps::new(block),
            rows: Rows::default(),
            linear: Vec::new(),
            program: None,
            settings: settings.conic,
        };
        program.linear = vec![0.0; program.writer(posed).miss_column() + 2];
        program
    }

    fn writer<'a>(&'a mut self, posed: &'a Posed) -> BlockWriter<'a> {
        let Self { block, maps, rows, linear, .. } = self;
        BlockWriter { posed, block: *block, maps, rows, linear }
    }

    /// Writes the data, and solves.
    pub(super) fn solve(&mut self, posed: &Posed) -> Result<ConicReport, ConvexError> {
        self.writer(posed).write();
        let program = match &mut self.program {
            Some(p) => {
                p.set_linear(&self.linear)?;
                p.set_matrix(self.rows.matrix_values())?;
                p.set_right_hand_side(self.rows.right_hand_side())?;
                p
            }
            none => {
                self.rows.end();
                none.insert(ConicProgram::new(
                    &self.rows.data(self.linear.clone(), Triplets::default()),
                    self.settings,
                )?)
            }
        };
        program.solve();
        Ok(program.report())
    }

    /// Control points, in units, and misses of the last solve.
    pub(super) fn read(&mut self, posed: &Posed, controls: &mut [[f64; 4]]) -> [f64; 2] {
        let writer = self.writer(posed);
        let (first, miss) = (writer.input_column(0), writer.miss_column());
        let Some(program) = &self.program else { return [f64::NAN; 2] };
        let x = program.x();
        for (control, values) in controls.iter_mut().zip(x[first..].chunks_exact(4)) {
            control.copy_from_slice(values);
        }
        [x[miss], x[miss + 1]]
    }

    /// The data of the last solve.
    pub(super) fn data(&self) -> ConicData {
        self.rows.data(self.linear.clone(), Triplets::default())
    }

    /// Variables and rows.
    pub(super) fn size(&self) -> (usize, usize) {
        (self.linear.len(), self.rows.len())
    }
}

/// Writes the rows of one program.
struct BlockWriter<'a> {
    posed: &'a Posed,
    block: usize,
    maps: &'a mut BlockMaps,
    rows: &'a mut Rows,
    linear: &'a mut [f64],
}

impl BlockWriter<'_> {
    // Places of variables.

    fn blocks(&self) -> usize {
        self.posed.intervals.div_ceil(self.block)
    }

    fn input_column(&self, input: usize) -> usize {
        (self.blocks() - 1) * STATES + 4 * input
    }

    fn miss_column(&self) -> usize {
        self.input_column(self.posed.inputs())
    }

    /// Block and offset of a node; the last node belongs to the last block.
    fn place(&self, node: usize) -> (usize, usize) {
        let block = (node / self.block).min(self.blocks() - 1);
        (block, node - block * self.block)
    }

    // Rows.

    /// `factor` times a state at a node, in units.
    fn state(&mut self, node: usize, s: usize, factor: f64) {
        let (block, offset) = self.place(node);
        self.block_state(block, offset, s, factor);
    }

    fn block_state(&mut self, block: usize, offset: usize, s: usize, factor: f64) {
        let start = block * self.block;
        let points = match self.posed.hold {
            Hold::Zero => offset,
            Hold::First if offset == 0 => 0,
            Hold::First => offset + 1,
        };
        if s == LOG_MASS {
            if block > 0 {
                self.rows.term((block - 1) * STATES + LOG_MASS, factor);
            }
            let share = self.posed.mass_share();
            for i in 0..points {
                let end = self.posed.hold == Hold::First && (i == 0 || i == offset);
                let weight = if end { 0.5 } else { 1.0 };
                self.rows.term(self.input_column(start + i) + 3, -factor * weight * share);
            }
            return;
        }
        let mut constant = 0.0;
        for c in 0..6 {
            let structural = self.posed.coupled || (c % 3 == s % 3 && c >= s / 3 * 3);
            if !structural {
                continue;
            }
            let entry = factor * self.maps.phi[offset][s][c];
            if block > 0 {
                self.rows.term((block - 1) * STATES + c, entry);
            } else {
                let p = &self.posed.problem;
                let start = if c < 3 { p.position[c] } else { p.velocity[c - 3] };
                constant += entry * start / self.posed.units.state(c);
            }
        }
        for a in 0..3 {
            let g = self.posed.problem.gravity[a] / self.posed.units.acceleration;
            constant += factor * self.maps.constant[offset][s][a] * g;
            if self.posed.coupled || a == s % 3 {
                for i in 0..points {
                    let entry = factor * self.maps.gain(offset, i)[s][a];
                    self.rows.term(self.input_column(start + i) + a, entry);
                }
            }
        }
        self.rows.constant(constant);
    }

    /// Writes all rows and the objective.
    fn write(&mut self) {
        self.maps.fill(&self.posed.transition());
        self.rows.start();
        self.equations();
        self.bounds();
        self.control_cones();
        self.state_cones();
        self.target_cones();
        self.objective();
    }

    fn equations(&mut self) {
        for block in 1..self.blocks() {
            for s in 0..STATES {
                self.block_state(block - 1, self.block, s, 1.0);
                self.rows.term((block - 1) * STATES + s, -1.0);
                self.rows.next();
            }
        }
        if self.posed.problem.limits.upright_end {
            for a in 0..2 {
                let column = self.input_column(self.posed.inputs() - 1) + a;
                self.rows.term(column, 1.0);
                self.rows.next();
            }
        }
        self.rows.cone(Cone::Zero(self.rows.len()));
    }

    /// `limit (1 - e)` at a node, of a thrust, with the sign.
    fn thrust_line(&mut self, node: usize, thrust: f64, sign: f64) {
        let reference = self.posed.reference[node];
        let limit = sign * self.posed.specific(thrust, reference);
        self.rows.constant(limit * (1.0 + reference));
        self.state(node, LOG_MASS, -limit);
    }

    fn bounds(&mut self) {
        let before = self.rows.len();
        let [least, most] = self.posed.problem.thrust;
        for i in 0..self.posed.inputs() {
            let column = self.input_column(i);
            self.thrust_line(i, most, 1.0);
            self.rows.term(column + 3, -1.0);
            self.rows.next();
            if self.posed.lower_bound == LowerBound::Tangent {
                self.thrust_line(self.posed.lower_node(i), least, -1.0);
                self.rows.term(column + 3, 1.0);
                self.rows.next();
            }
            if let Some(angle) = self.posed.problem.limits.pointing {
                self.rows.term(column + 2, 1.0);
                self.rows.term(column + 3, -angle.cos());
                self.rows.next();
            }
        }
        self.state(self.posed.intervals, LOG_MASS, 1.0);
        self.rows.constant(-self.posed.least_log_mass());
        self.rows.next();
        self.rows.cone(Cone::NonNegative(self.rows.len() - before));
    }

    fn control_cones(&mut self) {
        for i in 0..self.posed.inputs() {
            let column = self.input_column(i);
            for c in [3, 0, 1, 2] {
                self.rows.term(column + c, 1.0);
                self.rows.next();
            }
            self.rows.cone(Cone::SecondOrder(4));
            if self.posed.lower_bound == LowerBound::Quadratic {
                self.quadratic_bound(i);
            }
        }
        let Some(rate) = self.posed.problem.limits.thrust_rate else { return };
        for i in 1..self.posed.inputs() {
            self.rows.constant(self.posed.thrust_change(rate));
            self.rows.next();
            for a in 0..3 {
                for (input, sign) in [(i, 1.0), (i - 1, -1.0)] {
                    let mass = self.posed.reference[input].exp();
                    self.rows.term(self.input_column(input) + a, sign * mass);
                }
                self.rows.next();
            }
            self.rows.cone(Cone::SecondOrder(4));
        }
    }

    /// `y >= e^2/2` with `y = s/m1 - 1 + e`, as `|(e, y - 1/2)| <= y + 1/2`.
    fn quadratic_bound(&mut self, input: usize) {
        let node = self.posed.lower_node(input);
        let reference = self.posed.reference[node];
        let limit = self.posed.quadratic_limit(reference);
        for (part, shift) in [(0, -0.5), (1, 0.0), (2, -1.5)] {
            self.state(node, LOG_MASS, 1.0);
            self.rows.constant(-reference);
            if part != 1 {
                self.rows.term(self.input_column(input) + 3, 1.0 / limit);
                self.rows.constant(shift);
            }
            self.rows.next();
        }
        self.rows.cone(Cone::SecondOrder(3));
    }

    fn state_cones(&mut self) {
        let limits = self.posed.problem.limits;
        for node in 1..self.posed.intervals {
            if let Some(elevation) = limits.glide_slope {
                for (s, factor) in [(2, 1.0), (0, elevation.tan()), (1, elevation.tan())] {
                    self.offset_from_target(node, s, factor);
                }
                self.rows.cone(Cone::SecondOrder(3));
            }
            if let Some(speed) = limits.speed {
                self.rows.constant(speed / self.posed.units.speed);
                self.rows.next();
                for s in 3..6 {
                    self.state(node, s, 1.0);
                    self.rows.next();
                }
                self.rows.cone(Cone::SecondOrder(4));
            }
        }
    }

    fn offset_from_target(&mut self, node: usize, s: usize, factor: f64) {
        self.rows.constant(-factor * self.posed.goal(s));
        self.state(node, s, factor);
        self.rows.next();
    }

    fn target_cones(&mut self) {
        for (k, parts) in [&[0, 1][..], &[2, 3, 4, 5]].into_iter().enumerate() {
            self.rows.term(self.miss_column() + k, 1.0);
            self.rows.next();
            for &s in parts {
                self.offset_from_target(self.posed.intervals, s, 1.0);
            }
            self.rows.cone(Cone::SecondOrder(1 + parts.len()));
        }
    }

    fn objective(&mut self) {
        self.linear.fill(0.0);
        let share = self.posed.mass_share();
        for i in 0..self.posed.inputs() {
            let end = self.posed.hold == Hold::First && (i == 0 || i + 1 == self.posed.inputs());
            let column = self.input_column(i) + 3;
            self.linear[column] = if end { 0.5 * share } else { share };
        }
        let miss = self.miss_column();
        self.linear[miss] = self.posed.miss_price;
        self.linear[miss + 1] = 10.0 * self.posed.miss_price;
    }
}

#[cfg(test)]
mod tests {
    use super::super::problem::{DescentLimits, DescentProblem};
    use super::*;

    /// Our own code allocates nothing after the first solve; Clarabel allocates the same in each.
    #[test]
    fn a_second_solve_allocates_what_the_conic_solver_does() {
        let limits =
            DescentLimits { glide_slope: Some(0.05), pointing: Some(1.4), ..DescentLimits::default() };
        let problem = DescentProblem { limits, ..DescentProblem::mars_lander() };
        let settings = DescentSettings::default();
        let mut posed = Posed::new(&problem, &settings);
        posed.reset_reference(78.0);
        posed.duration = 78.0;
        let mut blocks = BlockDescent::new(&posed, &settings);
        blocks.solve(&posed).unwrap();
        posed.duration = 80.0;
        let conic = allocation_counter::measure(|| {
            blocks.program.as_mut().unwrap().solve();
        });
        let whole = allocation_counter::measure(|| {
            blocks.solve(&posed).unwrap();
        });
        assert_eq!(whole.count_total, conic.count_total);
    }
}
