//! The intervals of one phase, joined one after the other.

use apsides_ocp::{Bounds, EndpointInput, Phase, PhaseScaling, PhaseTrajectory};

use super::held::LinearCondition;
use super::leg::{Leg, LegPoint, Legs};
use super::triangle::Triangle;
use super::{FreeEnds, PRIOR_WEIGHT};
use crate::optimality;

/// Weight of the end conditions against the stationarity at one node.
const END_WEIGHT: f64 = 1e2;
/// An inequality that is missed by less, relative to its largest term, is met.
const ROUNDING: f64 = 1e-13;

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
    /// Per interval, then at the start and at the end, which of the rows count: all equations, and the inequalities that were missed.
    counts: Vec<Vec<bool>>,
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
        let mut chain = Self {
            index,
            phase,
            found,
            scaling,
            ends,
            legs,
            flown: Vec::new(),
            start: Vec::new(),
            end: Vec::new(),
            counts: Vec::new(),
            triangle: Triangle::new(0, 0),
        };
        let breaks = found.control.breaks();
        for segment in 0..breaks.len() - 1 {
            chain.flown.push(chain.legs.fly(segment, corners.contains(&breaks[segment]))?);
        }
        chain.start = chain.at_start();
        chain.end = chain.at_end();
        let rows = chain.flown.iter().map(|leg| &leg.rows).chain([&chain.start, &chain.end]);
        chain.counts = rows.map(|rows| rows.iter().map(|r| !r.is_inequality).collect()).collect();
        Some(chain)
    }

    fn duration(&self) -> f64 {
        self.found.final_time - self.found.initial_time
    }

    /// Conditions for the initial states and time.
    fn at_start(&mut self) -> Vec<LinearCondition> {
        let phase = self.index;
        let states = self.phase.states.iter().enumerate();
        let states = states.filter_map(|(state, s)| {
            let bounds = s.initial.intersect(&s.variable.bounds);
            self.of_state(EndpointInput::InitialState { phase, state }, state, bounds, 1.0)
        });
        let mut rows: Vec<LinearCondition> = states.collect();
        let input = EndpointInput::InitialTime { phase };
        let bounds = self.phase.initial_time;
        rows.extend(self.of_time(input, self.legs.first_point(), bounds, -1.0));
        rows
    }

    /// Conditions for the final states and time.
    fn at_end(&mut self) -> Vec<LinearCondition> {
        let phase = self.index;
        let states = self.phase.states.iter().enumerate();
        let states = states.filter_map(|(state, s)| {
            let bounds = s.terminal.intersect(&s.variable.bounds);
            self.of_state(EndpointInput::FinalState { phase, state }, state, bounds, -1.0)
        });
        let mut rows: Vec<LinearCondition> = states.collect();
        let input = EndpointInput::FinalTime { phase };
        let bounds = self.phase.final_time;
        rows.extend(self.of_time(input, self.legs.last_point(), bounds, 1.0));
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

    /// Joins the intervals by the rows that count, and gives what is left for the unknowns that all phases share.
    pub(super) fn triangulate(&mut self) -> Option<Vec<Vec<f64>>> {
        let (nx, shared) = (self.phase.states.len(), self.ends.globals);
        self.triangle = Triangle::new(nx, shared);
        let costate = self.found.costate.as_ref()?;
        let breaks = self.found.control.breaks();
        let legs = self.flown.len();
        let ends = [(&self.start, &self.counts[legs]), (&self.end, &self.counts[legs + 1])];
        let [start, end] = ends.map(|(rows, counts)| rows.iter().zip(counts).filter(|(_, c)| **c));
        start.for_each(|(row, _)| self.triangle.add_current(&row.coefficients, row.weight));
        let mut prior = vec![0.0; nx];
        for (segment, (leg, counts)) in self.flown.iter().zip(&self.counts).enumerate() {
            optimality::evaluate_piece(costate, breaks.len() - 1, segment, breaks[segment], &mut prior);
            for (i, (prior, scale)) in prior.iter().zip(&self.scaling.states).enumerate() {
                let mut row = self.unit(i, 1.0);
                row.extend(vec![0.0; shared]);
                row.push(-prior * scale);
                self.triangle.add_current(&row, PRIOR_WEIGHT);
            }
            let rows = leg.rows.iter().zip(counts).filter(|(_, c)| **c);
            self.triangle.advance(
                leg.inner,
                rows.map(|(row, _)| row.coefficients.iter().map(|v| v * row.weight).collect()),
            )?;
        }
        end.for_each(|(row, _)| self.triangle.add_current(&row.coefficients, row.weight));
        self.triangle.close()
    }

    /// Lets the inequalities that the unknowns miss count from now on, and these alone. True if they are others than before.
    pub(super) fn settle(&mut self, multipliers: &[f64]) -> bool {
        let nx = self.phase.states.len();
        let found = self.triangle.back(multipliers);
        let shared: Vec<f64> = multipliers.iter().copied().chain([1.0]).collect();
        let mut changed = false;
        let mut settle = |rows: &[LinearCondition], unknowns: &[f64], counts: &mut [bool]| {
            for (row, counts) in rows.iter().zip(counts).filter(|(row, _)| row.is_inequality) {
                let terms = row.coefficients.iter().zip(unknowns).map(|(c, v)| (c * v).abs());
                let missed = row.value(unknowns) < -ROUNDING * terms.fold(0.0, f64::max);
                changed |= *counts != missed;
                *counts = missed;
            }
        };
        let legs = self.flown.len();
        for (k, leg) in self.flown.iter().enumerate() {
            let next = &found[k + 1][..nx];
            let unknowns: Vec<f64> = found[k].iter().chain(next).chain(&shared).copied().collect();
            settle(&leg.rows, &unknowns, &mut self.counts[k]);
        }
        for (at, rows, counts) in [(0, &self.start, legs), (legs, &self.end, legs + 1)] {
            let unknowns: Vec<f64> = found[at][..nx].iter().chain(&shared).copied().collect();
            settle(rows, &unknowns, &mut self.counts[counts]);
        }
        changed
    }

    pub(super) fn write(mut self, multipliers: &[f64], phase: &mut PhaseTrajectory) -> Option<()> {
        let found = self.triangle.back(multipliers);
        self.legs.write(&self.flown, &found, multipliers, phase)
    }
}
