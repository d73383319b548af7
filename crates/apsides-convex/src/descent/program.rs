//! The conic program of one flight time, with states eliminated inside blocks of intervals.
//!
//! Variables per control point: `u = T/m` and `s >= |u|`; per block but the first, whose start is known, the state at its
//! start; two distances by which the end misses the target, `t_h` on the horizontal plane and `t_a` in height and velocity. With `d = ln(m / m(0))`
//! and its reference `d*`,
//!
//! ```text
//! minimise -d(tf) + w_h t_h + w_a t_a
//! |u| <= s,   m1 (1 - e [+ e^2/2]) <= s <= m2 (1 - e),   e = d - d*,   m_i = T_i / (m(0) exp d*)
//! u_z >= cos(pointing) s,   d(tf) >= ln(dry mass / m(0)),   |M_k+1 u_k+1 - M_k u_k| <= thrust rate h,   M = m(0) exp d*
//! |r - target|_h tan(e) <= r_z - target_z,   |v| <= speed
//! |(x, y)(tf) - target| <= t_h,   |(z, v)(tf) - target| <= t_a
//! ```
//!
//! Lengths, times and accelerations are divided by typical sizes of the problem. Every row is a function of `(x, u, s)` at one
//! point, so that its entries are those of the block: the state at the start of the block and the controls since.

use apsides_conic::{Cone, ConicProgram, ConicReport, Status, Triplets};

use super::problem::{DescentProblem, difference, norm};
use super::settings::{DescentSettings, LowerBound};
use super::transition::{BlockMaps, Hold, Transition};
use crate::ConvexError;
use crate::rows::Rows;

/// Position, velocity, logarithm of mass.
const STATES: usize = 7;
const LOG_MASS: usize = 6;
/// Price of a miss on the horizontal plane, in multiples of the propellant that its speed would take in the typical time; that of height and
/// velocity is ten times as high.
const MISS_PRICE: f64 = 100.0;

/// Typical sizes.
#[derive(Clone, Copy, Debug)]
struct Units {
    length: f64,
    speed: f64,
    acceleration: f64,
    time: f64,
}

impl Units {
    fn of(p: &DescentProblem) -> Self {
        let acceleration = p.thrust[1] / p.mass;
        let change = norm(&difference(&p.target_velocity, &p.velocity));
        let length = norm(&difference(&p.target, &p.position)).max(change * change / acceleration).max(1.0);
        let speed = (length * acceleration).sqrt();
        Self { length, speed, acceleration, time: speed / acceleration }
    }

    fn state(&self, s: usize) -> f64 {
        match s {
            0..3 => self.length,
            3..6 => self.speed,
            _ => 1.0,
        }
    }
}

/// The program, its data and the place of its variables. Owns all storage.
#[derive(Debug)]
pub(crate) struct DescentProgram {
    problem: DescentProblem,
    units: Units,
    intervals: usize,
    block: usize,
    hold: Hold,
    lower_bound: LowerBound,
    /// True if rotation couples the axes.
    coupled: bool,
    maps: BlockMaps,
    rows: Rows,
    linear: Vec<f64>,
    program: Option<ConicProgram>,
    settings: DescentSettings,
    /// Reference of the logarithm of mass at the nodes.
    pub(crate) reference: Vec<f64>,
    duration: f64,
    /// Propellant per speed, of the typical sizes.
    miss_price: f64,
    /// States at the nodes and controls of the last solve, SI; log of mass ratio last.
    pub(crate) states: Vec<[f64; STATES]>,
    pub(crate) controls: Vec<[f64; 4]>,
    pub(crate) miss: [f64; 2],
    pub(crate) value: f64,
}

impl DescentProgram {
    pub(crate) fn new(problem: &DescentProblem, settings: &DescentSettings) -> Self {
        let n = settings.intervals;
        let block = settings.block.clamp(1, n);
        let inputs = inputs(n, settings.hold);
        let units = Units::of(problem);
        let mut program = Self {
            problem: *problem,
            units,
            intervals: n,
            block,
            hold: settings.hold,
            lower_bound: settings.lower_bound,
            coupled: problem.rotation != [0.0; 3],
            maps: BlockMaps::new(block),
            rows: Rows::default(),
            linear: Vec::new(),
            program: None,
            settings: *settings,
            reference: vec![0.0; n + 1],
            duration: 0.0,
            miss_price: MISS_PRICE * units.speed / problem.exhaust_velocity,
            states: vec![[0.0; STATES]; n + 1],
            controls: vec![[0.0; 4]; inputs],
            miss: [0.0; 2],
            value: f64::INFINITY,
        };
        program.linear = vec![0.0; program.miss_column() + 2];
        program
    }

    pub(crate) fn problem(&self) -> &DescentProblem {
        &self.problem
    }

    /// Another target; the pattern stays.
    pub(crate) fn set_target(&mut self, target: [f64; 3]) -> Result<(), ConvexError> {
        let problem = DescentProblem { target, ..self.problem };
        problem.check()?;
        self.problem = problem;
        Ok(())
    }

    /// Another start; pattern and units stay. The reference, relative to the mass at the start, no longer fits.
    pub(crate) fn set_start(
        &mut self,
        position: [f64; 3],
        velocity: [f64; 3],
        mass: f64,
    ) -> Result<(), ConvexError> {
        let problem = DescentProblem { position, velocity, mass, ..self.problem };
        problem.check()?;
        self.problem = problem;
        self.value = f64::INFINITY;
        Ok(())
    }

    pub(crate) fn node_time(&self, node: usize) -> f64 {
        self.duration * node as f64 / self.intervals as f64
    }

    /// Reference of the paper: full thrust from the start, until the propellant is gone.
    pub(crate) fn reset_reference(&mut self, duration: f64) {
        let p = &self.problem;
        let flow = p.thrust[1] / p.exhaust_velocity;
        for (k, r) in self.reference.iter_mut().enumerate() {
            let t = duration * k as f64 / self.intervals as f64;
            *r = ((p.mass - flow * t).max(p.dry_mass) / p.mass).ln();
        }
    }

    /// Takes the masses of the last solve as the reference; returns the largest change.
    pub(crate) fn adopt_reference(&mut self) -> f64 {
        let mut change = 0.0_f64;
        for (r, x) in self.reference.iter_mut().zip(&self.states) {
            change = change.max((*r - x[LOG_MASS]).abs());
            *r = x[LOG_MASS];
        }
        change
    }

    /// Solves for a flight time, with the present reference.
    pub(crate) fn solve(&mut self, duration: f64) -> Result<Status, ConvexError> {
        self.duration = duration;
        self.write_rows();
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
                    self.settings.conic,
                )?)
            }
        };
        let status = program.solve();
        self.value = f64::INFINITY;
        if status.has_solution() {
            self.value = program.report().objective;
            self.read_solution();
        } else {
            self.states.fill([f64::NAN; STATES]);
            self.controls.fill([f64::NAN; 4]);
        }
        Ok(status)
    }

    pub(crate) fn report(&self) -> Option<ConicReport> {
        self.program.as_ref().map(ConicProgram::report)
    }

    /// Variables and rows.
    pub(crate) fn size(&self) -> (usize, usize) {
        (self.linear.len(), self.rows.len())
    }

    // Places of variables.

    fn blocks(&self) -> usize {
        self.intervals.div_ceil(self.block)
    }

    fn input_column(&self, input: usize) -> usize {
        (self.blocks() - 1) * STATES + 4 * input
    }

    fn miss_column(&self) -> usize {
        self.input_column(self.controls.len())
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
        let points = match self.hold {
            Hold::Zero => offset,
            Hold::First if offset == 0 => 0,
            Hold::First => offset + 1,
        };
        if s == LOG_MASS {
            if block > 0 {
                self.rows.term((block - 1) * STATES + LOG_MASS, factor);
            }
            let share = self.mass_share();
            for i in 0..points {
                let end = self.hold == Hold::First && (i == 0 || i == offset);
                let weight = if end { 0.5 } else { 1.0 };
                self.rows.term(self.input_column(start + i) + 3, -factor * weight * share);
            }
            return;
        }
        let mut constant = 0.0;
        for c in 0..6 {
            let structural = self.coupled || (c % 3 == s % 3 && c >= s / 3 * 3);
            if !structural {
                continue;
            }
            let entry = factor * self.maps.phi[offset][s][c];
            if block > 0 {
                self.rows.term((block - 1) * STATES + c, entry);
            } else {
                let p = &self.problem;
                let start = if c < 3 { p.position[c] } else { p.velocity[c - 3] };
                constant += entry * start / self.units.state(c);
            }
        }
        for a in 0..3 {
            let g = self.problem.gravity[a] / self.units.acceleration;
            constant += factor * self.maps.constant[offset][s][a] * g;
            if self.coupled || a == s % 3 {
                for i in 0..points {
                    let entry = factor * self.maps.gain(offset, i)[s][a];
                    self.rows.term(self.input_column(start + i) + a, entry);
                }
            }
        }
        self.rows.constant(constant);
    }

    /// Change of the logarithm of mass over an interval per unit of `s`.
    fn mass_share(&self) -> f64 {
        self.units.acceleration * self.duration / self.intervals as f64 / self.problem.exhaust_velocity
    }

    fn write_rows(&mut self) {
        let h = self.duration / self.intervals as f64 / self.units.time;
        let w = self.problem.rotation.map(|w| w * self.units.time);
        let step = Transition::new(&w, h, self.hold);
        self.maps.fill(&step);
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
        if self.problem.limits.upright_end {
            for a in 0..2 {
                let column = self.input_column(self.controls.len() - 1) + a;
                self.rows.term(column, 1.0);
                self.rows.next();
            }
        }
        self.rows.cone(Cone::Zero(self.rows.len()));
    }

    /// `limit (1 - e)` at a node, of a thrust, with the sign.
    fn thrust_line(&mut self, node: usize, thrust: f64, sign: f64) {
        let reference = self.reference[node];
        let limit = sign * self.specific(thrust, reference);
        self.rows.constant(limit * (1.0 + reference));
        self.state(node, LOG_MASS, -limit);
    }

    /// Acceleration of a thrust, in units.
    fn specific(&self, thrust: f64, log_mass: f64) -> f64 {
        thrust / (self.problem.mass * log_mass.exp() * self.units.acceleration)
    }

    /// Node where the least thrust holds: with constant controls the mass is least at the end of the interval.
    fn lower_node(&self, input: usize) -> usize {
        if self.hold == Hold::Zero { input + 1 } else { input }
    }

    fn bounds(&mut self) {
        let before = self.rows.len();
        let [least, most] = self.problem.thrust;
        for i in 0..self.controls.len() {
            let column = self.input_column(i);
            self.thrust_line(i, most, 1.0);
            self.rows.term(column + 3, -1.0);
            self.rows.next();
            if self.lower_bound == LowerBound::Tangent {
                self.thrust_line(self.lower_node(i), least, -1.0);
                self.rows.term(column + 3, 1.0);
                self.rows.next();
            }
            if let Some(angle) = self.problem.limits.pointing {
                self.rows.term(column + 2, 1.0);
                self.rows.term(column + 3, -angle.cos());
                self.rows.next();
            }
        }
        self.state(self.intervals, LOG_MASS, 1.0);
        self.rows.constant(-(self.problem.dry_mass / self.problem.mass).ln());
        self.rows.next();
        self.rows.cone(Cone::NonNegative(self.rows.len() - before));
    }

    fn control_cones(&mut self) {
        for i in 0..self.controls.len() {
            let column = self.input_column(i);
            for c in [3, 0, 1, 2] {
                self.rows.term(column + c, 1.0);
                self.rows.next();
            }
            self.rows.cone(Cone::SecondOrder(4));
            if self.lower_bound == LowerBound::Quadratic {
                self.quadratic_bound(i);
            }
        }
        let Some(rate) = self.problem.limits.thrust_rate else { return };
        let step = self.duration / self.intervals as f64;
        for i in 1..self.controls.len() {
            self.rows.constant(rate * step / (self.problem.mass * self.units.acceleration));
            self.rows.next();
            for a in 0..3 {
                for (input, sign) in [(i, 1.0), (i - 1, -1.0)] {
                    let mass = self.reference[input].exp();
                    self.rows.term(self.input_column(input) + a, sign * mass);
                }
                self.rows.next();
            }
            self.rows.cone(Cone::SecondOrder(4));
        }
    }

    /// `y >= e^2/2` with `y = s/m1 - 1 + e`, as `|(e, y - 1/2)| <= y + 1/2`.
    fn quadratic_bound(&mut self, input: usize) {
        let node = self.lower_node(input);
        let reference = self.reference[node];
        // A least thrust of zero gives |(e, -1/2 + s)| <= s + 1/2 of harmless size.
        let limit = self.specific(self.problem.thrust[0].max(1e-6 * self.problem.thrust[1]), reference);
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
        let limits = self.problem.limits;
        for node in 1..self.intervals {
            if let Some(elevation) = limits.glide_slope {
                for (s, factor) in [(2, 1.0), (0, elevation.tan()), (1, elevation.tan())] {
                    self.offset_from_target(node, s, factor);
                }
                self.rows.cone(Cone::SecondOrder(3));
            }
            if let Some(speed) = limits.speed {
                self.rows.constant(speed / self.units.speed);
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
        let p = &self.problem;
        let goal = if s < 3 { p.target[s] } else { p.target_velocity[s - 3] };
        self.rows.constant(-factor * goal / self.units.state(s));
        self.state(node, s, factor);
        self.rows.next();
    }

    fn target_cones(&mut self) {
        for (k, parts) in [&[0, 1][..], &[2, 3, 4, 5]].into_iter().enumerate() {
            self.rows.term(self.miss_column() + k, 1.0);
            self.rows.next();
            for &s in parts {
                self.offset_from_target(self.intervals, s, 1.0);
            }
            self.rows.cone(Cone::SecondOrder(1 + parts.len()));
        }
    }

    fn objective(&mut self) {
        self.linear.fill(0.0);
        let share = self.mass_share();
        for i in 0..self.controls.len() {
            let end = self.hold == Hold::First && (i == 0 || i + 1 == self.controls.len());
            let column = self.input_column(i) + 3;
            self.linear[column] = if end { 0.5 * share } else { share };
        }
        let miss = self.miss_column();
        self.linear[miss] = self.miss_price;
        self.linear[miss + 1] = 10.0 * self.miss_price;
    }

    fn read_solution(&mut self) {
        let Some(program) = &self.program else { return };
        let x = program.x();
        let (first, miss) = (self.input_column(0), self.miss_column());
        for (i, control) in self.controls.iter_mut().enumerate() {
            let values = &x[first + 4 * i..][..4];
            *control = std::array::from_fn(|c| values[c] * self.units.acceleration);
        }
        self.miss = [x[miss], x[miss + 1]];
        let p = &self.problem;
        let mut state = [0.0; STATES];
        for c in 0..3 {
            (state[c], state[3 + c]) = (p.position[c], p.velocity[c]);
        }
        self.states[0] = state;
        // One interval after another: the eliminated states.
        let w = p.rotation;
        let step = Transition::new(&w, self.duration / self.intervals as f64, self.hold);
        let h = self.duration / self.intervals as f64;
        for k in 0..self.intervals {
            let a = self.controls[k];
            let b = if self.hold == Hold::First { self.controls[k + 1] } else { a };
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

/// Control points of so many intervals.
pub(crate) fn inputs(intervals: usize, hold: Hold) -> usize {
    match hold {
        Hold::Zero => intervals,
        Hold::First => intervals + 1,
    }
}

#[cfg(test)]
mod tests {
    use super::super::problem::DescentLimits;
    use super::*;

    /// Our own code allocates nothing after the first solve; Clarabel allocates the same in each.
    #[test]
    fn a_second_solve_allocates_what_the_conic_solver_does() {
        let limits =
            DescentLimits { glide_slope: Some(0.05), pointing: Some(1.4), ..DescentLimits::default() };
        let problem = DescentProblem { limits, ..DescentProblem::mars_lander() };
        let mut program = DescentProgram::new(&problem, &DescentSettings::default());
        program.reset_reference(78.0);
        program.solve(78.0).unwrap();
        program.adopt_reference();
        let update = allocation_counter::measure(|| {
            program.duration = 80.0;
            program.set_target([10.0, 5.0, 0.0]).unwrap();
            program.write_rows();
            let conic = program.program.as_mut().unwrap();
            conic.set_linear(&program.linear).unwrap();
            conic.set_matrix(program.rows.matrix_values()).unwrap();
            conic.set_right_hand_side(program.rows.right_hand_side()).unwrap();
        });
        assert_eq!(update.count_total, 0);
        let conic = allocation_counter::measure(|| {
            program.program.as_mut().unwrap().solve();
        });
        let whole = allocation_counter::measure(|| {
            program.solve(80.0).unwrap();
            program.adopt_reference();
        });
        assert_eq!(whole.count_total, conic.count_total);
    }
}
