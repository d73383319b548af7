//! Costates from a trajectory alone: those by which it comes closest to an extremal.
//!
//! ```text
//! lambda' = -H_x - mu . c_x,   H_u + mu . c_u = 0 for the controls away from their bounds,   H continuous at corners,
//! lambda(tf) = dB/dx_f,   lambda(t0) = -dB/dx_0,   H(tf) = -dB/dt_f,   H(t0) = dB/dt_0   for what is free at the ends
//! ```
//!
//! All of it is linear in costates and multipliers, so that one linear least-squares problem gives them: the adjoint equation is
//! integrated over each interval for every initial direction, and the intervals are joined by orthogonal triangulation, one after the
//! other (G. J. Bierman, Factorization Methods for Discrete Sequential Estimation, Academic Press 1977). Multipliers of path
//! constraints in which free controls occur follow from the costates point by point.
//!
//! The conditions of an optimum ask for *some* costates that satisfy them. Found in this way they are held to the same checks as
//! those that a trajectory states, so that a trajectory without costates, or with inaccurate ones, can be certified.

mod leg;
mod triangle;

use std::sync::Arc;

use apsides_ocp::{
    Bounds, EndpointInput, Ocp, Phase, PhaseScaling, PhaseTrajectory, PiecewisePolynomial, Scaling, Segment,
    Trajectory,
};

use crate::VerifySettings;
use crate::ends::{EndGradient, EndScales, Ends};
use crate::equations::Equations;
use crate::optimality::{self, Among};
use crate::second_order::corners;
use leg::{Leg, LegPoint, Legs};
use triangle::Triangle;

/// Weight of the end conditions against the stationarity at one node.
const END_WEIGHT: f64 = 1e2;
/// Weight of the adjoint equation.
const ADJOINT_WEIGHT: f64 = 1e4;
/// Weight of the stated costates, which decide where nothing else does.
const PRIOR_WEIGHT: f64 = 1e-7;

/// Unknowns that belong to no interval: multipliers of endpoint constraints, then of integrals.
struct Globals {
    /// Constraint and row of each active endpoint constraint.
    rows: Vec<(usize, usize)>,
    /// Phase and index of each active integral.
    integrals: Vec<(usize, usize)>,
}

impl Globals {
    fn len(&self) -> usize {
        self.rows.len() + self.integrals.len()
    }

    /// Unknown and index of each active integral of a phase.
    fn integrals_of(&self, phase: usize) -> Vec<(usize, usize)> {
        let integrals = self.integrals.iter().enumerate().filter(|(_, (p, _))| *p == phase);
        integrals.map(|(i, (_, q))| (self.rows.len() + i, *q)).collect()
    }
}

/// The trajectory with costates and multipliers of its own; none if the equations cannot be integrated.
pub(crate) fn with_costates(
    ocp: &Ocp,
    trajectory: &Trajectory,
    scaling: &Scaling,
    settings: &VerifySettings,
) -> Option<Trajectory> {
    let stated = with_any_costates(trajectory)?;
    let mut conditions = optimality::phases(ocp, &stated, scaling, Among::All)?;
    let ends = Ends::of(trajectory);
    let scales = EndScales::new(ocp, scaling, settings);
    let globals = globals(ocp, trajectory, &ends, &scales, settings);
    let free_ends = FreeEnds::new(ocp, &ends, &scales, &globals, settings);
    let mut shared = Triangle::new(0, globals.len());
    let mut chains = Vec::new();
    for (k, conditions) in conditions.iter_mut().enumerate() {
        let equations = Equations::new(ocp, k, &trajectory.parameters);
        let (found, scaling) = (&stated.phases[k], &scaling.phases[k]);
        let local = globals.integrals_of(k);
        let size = conditions.hamiltonian_size;
        let legs = Legs::new(equations, found, scaling, local, globals.len(), size, settings)?;
        let mut chain = Chain {
            index: k,
            phase: &ocp.phases[k],
            found,
            scaling,
            ends: &free_ends,
            legs,
            triangle: Triangle::new(ocp.phases[k].states.len(), globals.len()),
            flown: Vec::new(),
        };
        chain.start();
        chain.fly(&corners(conditions))?;
        chain.end();
        shared.add_remainder(chain.triangle.close()?);
        chains.push(chain);
    }
    // Multipliers that nothing decides are zero.
    shared.add_prior(PRIOR_WEIGHT);
    let multipliers = shared.solve()?;
    let mut result = stated.clone();
    for (chain, phase) in chains.into_iter().zip(&mut result.phases) {
        chain.write(&multipliers, phase)?;
    }
    write_globals(ocp, &globals, &free_ends.row_scales, &multipliers, &mut result);
    Some(result)
}

/// The trajectory with costates of zero where it has none.
fn with_any_costates(trajectory: &Trajectory) -> Option<Trajectory> {
    let mut result = trajectory.clone();
    for phase in &mut result.phases {
        if phase.costate.is_none() {
            phase.costate = Some(zero_like(&phase.state)?);
        }
    }
    Some(result)
}

/// Conditions for what is free at the ends of phases, linear in the multipliers of endpoint constraints.
struct FreeEnds<'a> {
    ends: &'a Ends,
    scales: &'a EndScales<'a>,
    tolerance: f64,
    /// Number of multipliers that belong to no interval.
    globals: usize,
    cost: EndGradient,
    /// Per endpoint constraint and row.
    row_scales: Vec<Vec<f64>>,
    /// The multipliers at each end quantity, with their coefficients.
    coefficients: Vec<(EndpointInput, usize, f64)>,
}

impl<'a> FreeEnds<'a> {
    fn new(
        ocp: &Ocp,
        ends: &'a Ends,
        scales: &'a EndScales<'a>,
        globals: &Globals,
        settings: &VerifySettings,
    ) -> Self {
        let row_scales: Vec<Vec<f64>> =
            (0..ocp.constraints.len()).map(|k| scales.row_scales(k, ends)).collect();
        let mut coefficients: Vec<(EndpointInput, usize, f64)> = Vec::new();
        for (g, &(k, r)) in globals.rows.iter().enumerate() {
            let c = &ocp.constraints[k];
            let entries = ends.jacobian(c.function.as_ref(), &c.inputs).into_iter();
            coefficients
                .extend(entries.filter(|e| e.0 == r).map(|(_, input, v)| (input, g, v / row_scales[k][r])));
        }
        Self {
            ends,
            scales,
            tolerance: settings.activity_tolerance,
            globals: globals.len(),
            cost: EndGradient::of_cost(ocp, ends),
            row_scales,
            coefficients,
        }
    }

    /// Derivative of the endpoint function by one quantity, times a scale: a coefficient per multiplier, then the rest.
    fn row(&self, input: EndpointInput, scale: f64) -> Vec<f64> {
        let mut row = vec![0.0; self.globals + 1];
        for &(_, g, v) in self.coefficients.iter().filter(|c| c.0 == input) {
            row[g] += v * scale;
        }
        row[self.globals] = self.cost.value(input).unwrap_or(0.0) * scale;
        row
    }

    fn is_free(&self, input: EndpointInput, bounds: Bounds) -> bool {
        let distance = -bounds.excess(self.ends.value(input));
        !bounds.is_fixed() && distance > self.tolerance * self.scales.scale(input)
    }
}

/// The intervals of one phase, joined one after the other.
struct Chain<'a> {
    index: usize,
    phase: &'a Phase,
    found: &'a PhaseTrajectory,
    scaling: &'a PhaseScaling,
    ends: &'a FreeEnds<'a>,
    legs: Legs<'a>,
    triangle: Triangle,
    flown: Vec<Leg>,
}

impl Chain<'_> {
    fn duration(&self) -> f64 {
        self.found.final_time - self.found.initial_time
    }

    /// Conditions for the initial states and time.
    fn start(&mut self) {
        let states = self.phase.states.iter().enumerate();
        for (i, bounds) in states.map(|(i, s)| (i, s.initial.intersect(&s.variable.bounds))) {
            self.add_state(EndpointInput::InitialState { phase: self.index, state: i }, i, bounds, 1.0);
        }
        let input = EndpointInput::InitialTime { phase: self.index };
        self.add_time(input, self.legs.first_point(), self.phase.initial_time, -1.0);
    }

    /// Conditions for the final states and time.
    fn end(&mut self) {
        let states = self.phase.states.iter().enumerate();
        for (i, bounds) in states.map(|(i, s)| (i, s.terminal.intersect(&s.variable.bounds))) {
            self.add_state(EndpointInput::FinalState { phase: self.index, state: i }, i, bounds, -1.0);
        }
        let input = EndpointInput::FinalTime { phase: self.index };
        self.add_time(input, self.legs.last_point(), self.phase.final_time, 1.0);
    }

    /// The condition for a state at an end, if it is free there.
    fn add_state(&mut self, input: EndpointInput, state: usize, bounds: Bounds, sign: f64) {
        if self.ends.is_free(input, bounds) {
            let row = self.unit(state, sign);
            self.triangle.add_current(&row, &self.ends.row(input, self.scaling.states[state]), END_WEIGHT);
        }
    }

    /// The condition for the Hamiltonian at an end, if its time is free and the duration too.
    fn add_time(&mut self, input: EndpointInput, point: LegPoint, bounds: Bounds, sign: f64) {
        let duration = self.duration();
        let duration_is_free = self.phase.duration.excess(duration) < -self.ends.tolerance * duration;
        if duration_is_free && self.ends.is_free(input, bounds) {
            let (row, rest) = self.legs.hamiltonian(&point);
            let end = self.ends.row(input, duration);
            let rest: Vec<f64> = rest.iter().zip(&end).map(|(h, e)| e + sign * h * duration).collect();
            let row: Vec<f64> = row.iter().map(|v| sign * v * duration).collect();
            self.triangle.add_current(&row, &rest, END_WEIGHT);
        }
    }

    /// Integrates the adjoint equation over each interval; the Hamiltonian is continuous at the corners.
    fn fly(&mut self, corners: &[f64]) -> Option<()> {
        let duration = self.duration();
        let costate = self.found.costate.as_ref()?;
        let breaks = self.found.control.breaks();
        for segment in 0..breaks.len() - 1 {
            let leg = self.legs.fly(segment)?;
            if corners.contains(&breaks[segment]) {
                let (row, rest) = self.legs.jump(segment);
                let row: Vec<f64> = row.iter().map(|v| v * duration).collect();
                let rest: Vec<f64> = rest.iter().map(|v| v * duration).collect();
                self.triangle.add_current(&row, &rest, 1.0);
            }
            let mut prior = vec![0.0; self.phase.states.len()];
            optimality::evaluate_piece(costate, breaks.len() - 1, segment, breaks[segment], &mut prior);
            for (i, (prior, scale)) in prior.iter().zip(&self.scaling.states).enumerate() {
                let mut rest = vec![0.0; self.ends.globals + 1];
                rest[self.ends.globals] = -prior * scale;
                let row = self.unit(i, 1.0);
                self.triangle.add_current(&row, &rest, PRIOR_WEIGHT);
            }
            self.triangle.advance(&leg, ADJOINT_WEIGHT)?;
            self.flown.push(leg);
        }
        Some(())
    }

    fn unit(&self, state: usize, sign: f64) -> Vec<f64> {
        let mut row = vec![0.0; self.phase.states.len()];
        row[state] = sign;
        row
    }

    fn write(mut self, multipliers: &[f64], phase: &mut PhaseTrajectory) -> Option<()> {
        let ends = self.triangle.back(multipliers);
        self.legs.write(&self.flown, &ends, multipliers, phase)
    }
}

/// Writes the multipliers that belong to no interval.
fn write_globals(
    ocp: &Ocp,
    globals: &Globals,
    row_scales: &[Vec<f64>],
    multipliers: &[f64],
    result: &mut Trajectory,
) {
    let mut constraint: Vec<Vec<f64>> = ocp.constraints.iter().map(|c| vec![0.0; c.rows.len()]).collect();
    for (&(k, r), v) in globals.rows.iter().zip(multipliers) {
        constraint[k][r] = v / row_scales[k][r];
    }
    result.constraint_multipliers = Some(constraint);
    for (&(p, q), v) in globals.integrals.iter().zip(&multipliers[globals.rows.len()..]) {
        let count = ocp.phases[p].integrals.len();
        result.phases[p].integral_multipliers.get_or_insert_with(|| vec![0.0; count])[q] = *v;
    }
}

fn zero_like(states: &PiecewisePolynomial) -> Option<PiecewisePolynomial> {
    let zero = |s: &Segment| Segment { basis: Arc::clone(&s.basis), values: vec![0.0; s.values.len()] };
    let segments = states.segments().iter().map(zero).collect();
    PiecewisePolynomial::new(states.dimension(), states.breaks().to_vec(), segments).ok()
}

fn globals(
    ocp: &Ocp,
    trajectory: &Trajectory,
    ends: &Ends,
    scales: &EndScales<'_>,
    settings: &VerifySettings,
) -> Globals {
    let mut rows = Vec::new();
    for (k, c) in ocp.constraints.iter().enumerate() {
        let values = ends.evaluate(c.function.as_ref(), &c.inputs);
        let sizes = scales.row_scales(k, ends);
        for (r, row) in c.rows.iter().enumerate() {
            if row.bounds.is_fixed()
                || row.bounds.excess(values[r]) >= -settings.activity_tolerance * sizes[r]
            {
                rows.push((k, r));
            }
        }
    }
    let mut integrals = Vec::new();
    for (p, phase) in ocp.phases.iter().enumerate() {
        let stated = trajectory.phases[p].integral_multipliers.as_ref();
        for (q, integral) in phase.integrals.iter().enumerate() {
            let active = stated.map_or(integral.variable.bounds != Bounds::FREE, |m| m[q] != 0.0);
            if active || integral.variable.bounds.is_fixed() {
                integrals.push((p, q));
            }
        }
    }
    Globals { rows, integrals }
}
