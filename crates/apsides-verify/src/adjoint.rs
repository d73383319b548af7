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

use apsides_ocp::{Bounds, EndpointInput, Ocp, PiecewisePolynomial, Scaling, Segment, Trajectory};

use crate::VerifySettings;
use crate::ends::{EndGradient, EndScales, Ends};
use crate::equations::Equations;
use crate::optimality::{self, Among};
use crate::second_order::corners;
use leg::{Leg, Legs};
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
}

/// The trajectory with costates and multipliers of its own; none if the equations cannot be integrated.
pub(crate) fn with_costates(
    ocp: &Ocp,
    trajectory: &Trajectory,
    scaling: &Scaling,
    settings: &VerifySettings,
) -> Option<Trajectory> {
    let mut result = trajectory.clone();
    for phase in &mut result.phases {
        if phase.costate.is_none() {
            phase.costate = Some(zero_like(&phase.state)?);
        }
    }
    let stated = result.clone();
    let mut conditions = optimality::phases(ocp, &stated, scaling, Among::All)?;
    let ends = Ends::of(trajectory);
    let scales = EndScales::new(ocp, scaling, settings);
    let globals = globals(ocp, trajectory, &ends, &scales, settings);
    let ng = globals.len();
    let cost = EndGradient::of_cost(ocp, &ends);
    // Coefficients of the multipliers at each end quantity, and their scales.
    let row_scales: Vec<Vec<f64>> = (0..ocp.constraints.len()).map(|k| scales.row_scales(k, &ends)).collect();
    let mut coefficients: Vec<(EndpointInput, usize, f64)> = Vec::new();
    for (g, &(k, r)) in globals.rows.iter().enumerate() {
        let c = &ocp.constraints[k];
        let entries = ends.jacobian(c.function.as_ref(), &c.inputs).into_iter();
        coefficients
            .extend(entries.filter(|e| e.0 == r).map(|(_, input, v)| (input, g, v / row_scales[k][r])));
    }
    let end_row = |input: EndpointInput, scale: f64| {
        let mut row = vec![0.0; ng + 1];
        for &(_, g, v) in coefficients.iter().filter(|c| c.0 == input) {
            row[g] += v * scale;
        }
        row[ng] = cost.value(input).unwrap_or(0.0) * scale;
        row
    };
    let free = |input: EndpointInput, bounds: Bounds| {
        let distance = -bounds.excess(ends.value(input));
        !bounds.is_fixed() && distance > settings.activity_tolerance * scales.scale(input)
    };

    let mut shared = Triangle::new(0, ng);
    let mut chains = Vec::new();
    for (k, phase) in ocp.phases.iter().enumerate() {
        let found = &stated.phases[k];
        let equations = Equations::new(ocp, k, &trajectory.parameters);
        let corners = corners(&mut conditions[k]);
        let local: Vec<(usize, usize)> = (globals.integrals.iter().enumerate())
            .filter(|(_, (p, _))| *p == k)
            .map(|(i, (_, q))| (globals.rows.len() + i, *q))
            .collect();
        let mut legs = Legs::new(equations, found, &scaling.phases[k], local, ng, settings)?;
        let nx = phase.states.len();
        let costate = found.costate.as_ref()?;
        let mut triangle = Triangle::new(nx, ng);
        let duration = found.final_time - found.initial_time;
        // Initial states and time, then each interval, then the end.
        let (initial, last) = (legs.first_point(), legs.last_point());
        for (i, state) in phase.states.iter().enumerate() {
            let input = EndpointInput::InitialState { phase: k, state: i };
            if free(input, state.initial.intersect(&state.variable.bounds)) {
                let mut row = vec![0.0; nx];
                row[i] = 1.0;
                triangle.add_current(&row, &end_row(input, scaling.phases[k].states[i]), END_WEIGHT);
            }
        }
        let (t0, tf) = (EndpointInput::InitialTime { phase: k }, EndpointInput::FinalTime { phase: k });
        let duration_is_free = phase.duration.excess(duration) < -settings.activity_tolerance * duration;
        if duration_is_free && free(t0, phase.initial_time) {
            let (row, rest) = legs.hamiltonian(&initial);
            let end = end_row(t0, duration);
            let rest: Vec<f64> = rest.iter().zip(&end).map(|(h, e)| e - h * duration).collect();
            triangle.add_current(&row.iter().map(|v| -v * duration).collect::<Vec<_>>(), &rest, END_WEIGHT);
        }
        let breaks = found.control.breaks().to_vec();
        let mut flown: Vec<Leg> = Vec::new();
        for segment in 0..breaks.len() - 1 {
            let leg = legs.fly(segment)?;
            if corners.contains(&breaks[segment]) {
                let (row, rest) = legs.jump(segment);
                let row: Vec<f64> = row.iter().map(|v| v * duration).collect();
                triangle.add_current(&row, &rest.iter().map(|v| v * duration).collect::<Vec<_>>(), 1.0);
            }
            let mut prior = vec![0.0; nx];
            optimality::evaluate_piece(costate, breaks.len() - 1, segment, breaks[segment], &mut prior);
            for i in 0..nx {
                let mut row = vec![0.0; nx];
                row[i] = 1.0;
                let mut rest = vec![0.0; ng + 1];
                rest[ng] = -prior[i] * scaling.phases[k].states[i];
                triangle.add_current(&row, &rest, PRIOR_WEIGHT);
            }
            triangle.advance(&leg, ADJOINT_WEIGHT)?;
            flown.push(leg);
        }
        for (i, state) in phase.states.iter().enumerate() {
            let input = EndpointInput::FinalState { phase: k, state: i };
            if free(input, state.terminal.intersect(&state.variable.bounds)) {
                let mut row = vec![0.0; nx];
                row[i] = -1.0;
                triangle.add_current(&row, &end_row(input, scaling.phases[k].states[i]), END_WEIGHT);
            }
        }
        if duration_is_free && free(tf, phase.final_time) {
            let (row, rest) = legs.hamiltonian(&last);
            let end = end_row(tf, duration);
            let rest: Vec<f64> = rest.iter().zip(&end).map(|(h, e)| e + h * duration).collect();
            triangle.add_current(&row.iter().map(|v| v * duration).collect::<Vec<_>>(), &rest, END_WEIGHT);
        }
        shared.add_remainder(triangle.close()?);
        chains.push((triangle, flown, legs));
    }
    // Multipliers that nothing decides are zero.
    shared.add_prior(PRIOR_WEIGHT);
    let multipliers = shared.solve()?;
    for ((triangle, flown, mut legs), phase) in chains.into_iter().zip(&mut result.phases) {
        let ends = triangle.back(&multipliers);
        legs.write(&flown, &ends, &multipliers, phase)?;
    }
    let mut constraint: Vec<Vec<f64>> = ocp.constraints.iter().map(|c| vec![0.0; c.rows.len()]).collect();
    for (&(k, r), v) in globals.rows.iter().zip(&multipliers) {
        constraint[k][r] = v / row_scales[k][r];
    }
    result.constraint_multipliers = Some(constraint);
    for (&(p, q), v) in globals.integrals.iter().zip(&multipliers[globals.rows.len()..]) {
        let count = ocp.phases[p].integrals.len();
        result.phases[p].integral_multipliers.get_or_insert_with(|| vec![0.0; count])[q] = *v;
    }
    Some(result)
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
