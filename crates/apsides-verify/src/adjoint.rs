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
//! Slopes in controls at their bounds and the multipliers of state bounds have a sign: inequalities, each of which counts by the square of what it is
//! missed by. The sum of squares is convex, and Newton's method takes the missed ones as equations, pass by pass (O. L. Mangasarian, Journal
//! of Optimization Theory and Applications 121 (2004) 1, doi 10.1023/B:JOTA.0000026128.34294.77).
//!
//! The conditions of an optimum ask for *some* costates that satisfy them. Found in this way they are held to the same checks as
//! those that a trajectory states, so that a trajectory without costates, or with inaccurate ones, can be certified.

mod chain;
mod held;
mod leg;
mod triangle;

use std::sync::Arc;

use apsides_ocp::{Bounds, EndpointInput, Ocp, PiecewisePolynomial, Scaling, Segment, Trajectory};

use crate::VerifySettings;
use crate::ends::{EndGradient, EndScales, Ends};
use crate::equations::Equations;
use crate::optimality::{self, Among};
use crate::second_order::corners;
use chain::Chain;
use held::{BoundSide, best_part};
use leg::Legs;
use triangle::Triangle;

/// Weight of the stated costates, which decide where nothing else does.
const PRIOR_WEIGHT: f64 = 1e-7;
/// Passes over the inequalities, at most: each takes a triangulation of the whole.
const PASSES: usize = 50;

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
    let mut chains = Vec::new();
    for (k, conditions) in conditions.iter_mut().enumerate() {
        let equations = Equations::new(ocp, k, &trajectory.parameters);
        let (found, scaling) = (&stated.phases[k], &scaling.phases[k]);
        let local = globals.integrals_of(k);
        let size = conditions.hamiltonian_size;
        let legs = Legs::new(equations, found, scaling, local, globals.len(), size, settings)?;
        chains.push(Chain::new(k, &ocp.phases[k], found, scaling, &free_ends, legs, &corners(conditions))?);
    }
    let mut multipliers = Vec::new();
    for _ in 0..PASSES {
        let mut shared = Triangle::new(0, globals.len());
        for chain in &mut chains {
            shared.add_remainder(chain.triangulate()?);
        }
        // Multipliers that nothing decides are zero.
        shared.add_prior(PRIOR_WEIGHT);
        multipliers = shared.solve()?;
        chains.iter_mut().for_each(|chain| chain.evaluate(&multipliers));
        let part = best_part(chains.iter().flat_map(Chain::conditions));
        let changed: usize = chains.iter_mut().map(|chain| chain.settle(part)).sum();
        if changed == 0 {
            break;
        }
    }
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
        !bounds.is_fixed() && self.side(input, bounds).is_none()
    }

    /// The bound that an end quantity is at.
    fn side(&self, input: EndpointInput, bounds: Bounds) -> Option<BoundSide> {
        BoundSide::of(self.ends.value(input), &bounds, self.tolerance * self.scales.scale(input))
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
