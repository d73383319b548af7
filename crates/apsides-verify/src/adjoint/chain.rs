//! The intervals of one phase, joined one after the other.

use apsides_ocp::{Bounds, EndpointInput, Phase, PhaseScaling, PhaseTrajectory, State};

use super::held::LinearCondition;
use super::leg::{Leg, LegPoint, Legs};
use super::triangle::Triangle;
use super::{FreeEnds, PRIOR_WEIGHT};
use crate::optimality;

/// Weight of the end conditions against the stationarity at one node.
const END_WEIGHT: f64 = 1e2;

/// An end of a phase.
#[derive(Clone, Copy, PartialEq)]
enum Terminal {
    Start,
    End,
}

/// The conditions of one phase, and the unknowns that come closest to them.
pub(super) struct Chain<'a> {
    index: usize,
    phase: &'a Phase,
    found: &'a PhaseTrajectory,
    scaling: &'a PhaseScaling,
    ends: &'a FreeEnds<'a>,
    legs: Legs<'a>,
    flown: Vec<Leg>,
    /// Conditions at the start and at the end, over `[current, shared, 1]`.
    start: Vec<LinearCondition>,
    end: Vec<LinearCondition>,
    triangle: Triangle,
}

impl<'a> Chain<'a> {
    /// Integrates the adjoint equation over each interval; the Hamiltonian is continuous at the corners of the controls.
    pub(super) fn new(
        index: usize,
        phase: &'a Phase,
        found: &'a PhaseTrajectory,
        scaling: &'a PhaseScaling,
        ends: &'a FreeEnds<'a>,
        legs: Legs<'a>,
        corners: &[f64],
    ) -> Option<Self> {
        let triangle = Triangle::new(phase.states.len(), ends.globals);
        let (flown, start, end) = (Vec::new(), Vec::new(), Vec::new());
        let mut chain = Self { index, phase, found, scaling, ends, legs, flown, start, end, triangle };
        let breaks = found.control.breaks();
        for segment in 0..breaks.len() - 1 {
            chain.flown.push(chain.legs.fly(segment, corners.contains(&breaks[segment]))?);
        }
        (chain.start, chain.end) = (chain.at(Terminal::Start), chain.at(Terminal::End));
        Some(chain)
    }

    fn duration(&self) -> f64 {
        self.found.final_time - self.found.initial_time
    }

    /// Conditions for the states and the time at an end of the phase.
    fn at(&mut self, terminal: Terminal) -> Vec<LinearCondition> {
        let (index, phase) = (self.index, self.phase);
        let sign = if terminal == Terminal::Start { 1.0 } else { -1.0 };
        let of_state = |(state, s): (usize, &State)| {
            let (input, bounds) = match terminal {
                Terminal::Start => (EndpointInput::InitialState { phase: index, state }, s.initial),
                Terminal::End => (EndpointInput::FinalState { phase: index, state }, s.terminal),
            };
            self.of_state(input, state, bounds.intersect(&s.variable.bounds), sign)
        };
        let mut rows: Vec<LinearCondition> = phase.states.iter().enumerate().filter_map(of_state).collect();
        let (input, point, bounds) = match terminal {
            Terminal::Start => {
                (EndpointInput::InitialTime { phase: index }, self.legs.first_point(), phase.initial_time)
            }
            Terminal::End => {
                (EndpointInput::FinalTime { phase: index }, self.legs.last_point(), phase.final_time)
            }
        };
        rows.extend(self.of_time(input, point, bounds, -sign));
        rows
    }

    /// The condition for a state at an end: what it adds to the cost is nothing if it is free there, and else pushes it against its bound.
    fn of_state(
        &self,
        input: EndpointInput,
        state: usize,
        bounds: Bounds,
        sign: f64,
    ) -> Option<LinearCondition> {
        if bounds.is_fixed() {
            return None;
        }
        let mut row = self.unit(state, sign);
        row.extend(self.ends.row(input, self.scaling.states[state]));
        Some(match self.ends.side(input, bounds) {
            None => LinearCondition::equation(row, END_WEIGHT),
            Some(side) => {
                row.iter_mut().for_each(|v| *v *= -side.sign());
                LinearCondition::at_least_zero(row, END_WEIGHT)
            }
        })
    }

    /// The condition for the Hamiltonian at an end, if its time is free and the duration too.
    fn of_time(
        &mut self,
        input: EndpointInput,
        point: LegPoint,
        bounds: Bounds,
        sign: f64,
    ) -> Option<LinearCondition> {
        let duration = self.duration();
        let duration_is_free = self.phase.duration.excess(duration) < -self.ends.tolerance * duration;
        if !duration_is_free || !self.ends.is_free(input, bounds) {
            return None;
        }
        let (row, rest) = self.legs.hamiltonian(&point);
        let end = self.ends.row(input, duration);
        let costates = row.iter().map(|v| sign * v * duration);
        let rest = rest.iter().zip(&end).map(|(h, e)| e + sign * h * duration);
        Some(LinearCondition::equation(costates.chain(rest).collect(), END_WEIGHT))
    }

    fn unit(&self, state: usize, sign: f64) -> Vec<f64> {
        let mut row = vec![0.0; self.phase.states.len()];
        row[state] = sign;
        row
    }

    /// Joins the intervals by the conditions that count, and gives what is left for the unknowns that all phases share.
    pub(super) fn triangulate(&mut self) -> Option<Vec<Vec<f64>>> {
        let (nx, shared) = (self.phase.states.len(), self.ends.globals);
        self.triangle = Triangle::new(nx, shared);
        let costate = self.found.costate.as_ref()?;
        let breaks = self.found.control.breaks();
        for row in that_count(&self.start) {
            self.triangle.add_current(row, 1.0);
        }
        let mut prior = vec![0.0; nx];
        for (segment, leg) in self.flown.iter().enumerate() {
            optimality::evaluate_piece(costate, breaks.len() - 1, segment, breaks[segment], &mut prior);
            for (i, (prior, scale)) in prior.iter().zip(&self.scaling.states).enumerate() {
                let mut row = self.unit(i, 1.0);
                row.extend(vec![0.0; shared]);
                row.push(-prior * scale);
                self.triangle.add_current(&row, PRIOR_WEIGHT);
            }
            self.triangle.advance(leg.inner, that_count(&leg.rows).map(<[f64]>::to_vec))?;
        }
        for row in that_count(&self.end) {
            self.triangle.add_current(row, 1.0);
        }
        self.triangle.close()
    }

    /// Evaluates all conditions for the unknowns that come closest to those that count.
    pub(super) fn evaluate(&mut self, multipliers: &[f64]) {
        let nx = self.phase.states.len();
        let found = self.triangle.back(multipliers);
        let shared: Vec<f64> = multipliers.iter().copied().chain([1.0]).collect();
        let evaluate = |rows: &mut [LinearCondition], unknowns: &[f64]| {
            rows.iter_mut().for_each(|row| row.evaluate(unknowns));
        };
        for (leg, w) in self.flown.iter_mut().zip(found.windows(2)) {
            let unknowns: Vec<f64> = w[0].iter().chain(&w[1][..nx]).chain(&shared).copied().collect();
            evaluate(&mut leg.rows, &unknowns);
        }
        for (at, rows) in [(0, &mut self.start), (self.flown.len(), &mut self.end)] {
            let unknowns: Vec<f64> = found[at][..nx].iter().chain(&shared).copied().collect();
            evaluate(rows, &unknowns);
        }
    }

    pub(super) fn conditions(&self) -> impl Iterator<Item = &LinearCondition> {
        self.flown.iter().flat_map(|leg| &leg.rows).chain(&self.start).chain(&self.end)
    }

    /// Goes a part of the way to the unknowns, and lets the inequalities that are missed there count from now on, and these alone. Returns how many
    /// count that did not before, or do not any more.
    pub(super) fn settle(&mut self, part: f64) -> usize {
        let rows = self.flown.iter_mut().flat_map(|leg| &mut leg.rows);
        let rows = rows.chain(&mut self.start).chain(&mut self.end);
        rows.map(|row| usize::from(row.settle(part))).sum()
    }

    pub(super) fn write(mut self, multipliers: &[f64], phase: &mut PhaseTrajectory) -> Option<()> {
        let found = self.triangle.back(multipliers);
        self.legs.write(&self.flown, &found, multipliers, phase)
    }
}

/// The coefficients of the conditions that count.
fn that_count(rows: &[LinearCondition]) -> impl Iterator<Item = &[f64]> {
    rows.iter().filter(|row| row.counts).map(|row| &row.coefficients[..])
}
