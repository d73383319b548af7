//! First-order conditions of a local minimum (Pontryagin), from the costates of the trajectory.
//!
//! ```text
//! H = lambda . f + sum_q w_q g_q          L = H + mu . c          of the minimised objective
//! lambda' = -dL/dx,   dL/du = 0 (or pushing against a bound),   lambda(tf) = dB/dx_f,   lambda(t0) = -dB/dx_0,
//! H(u(t)) = min over all admissible controls,   dH/dt = dL/dt,
//! lambda(t-) = lambda(t+) + nu dg/dx              where a path constraint g without controls touches its bound (a contact)
//! H(tf) = -dB/dt_f,   H(t0) = dB/dt_0,                          B = Phi + nu . b
//! ```
//!
//! A. E. Bryson and Y.-C. Ho, Applied Optimal Control, Taylor and Francis 1975, sections 2.7, 3.5 and 3.8. A condition
//! `slope = 0` on a bounded quantity is measured by the natural residual `min(|slope|, room)`, where `room` is the
//! distance to the bound that the slope pushes towards, each divided by its scale: zero exactly where the first-order
//! condition holds, and free of a threshold for "at the bound" (F. Facchinei and J.-S. Pang, Finite-Dimensional
//! Variational Inequalities, Springer 2003, section 1.5, doi 10.1007/b97543).
//!
//! Not part of a trajectory, so not known here: multipliers of state bounds along a phase (what the costate equation lacks
//! where a state is at its bound must have their sign), of duration bounds.

mod branch_and_bound;
mod cone;
mod constant;
mod contact;
mod control_set;
mod costate;
mod kink;
mod minimum;
mod proof;
mod ridges;
mod search;
mod stated_costates;
mod stationarity;
mod touch;
mod transversality;
pub(crate) mod worth;

use apsides_ocp::curvature::rounding_of_costates;
use apsides_ocp::explicit_time::{ends_at_instants, rates_of_instants};
use apsides_ocp::{
    Bounds, Guess, Ocp, PhaseScaling, PhaseTrajectory, PiecewisePolynomial, Scaling, Trajectory,
};

use crate::boundary::row_scales;
use crate::equations::{Equations, Hamiltonian};
use crate::worst::relative;
use crate::{Check, CheckKind, VerifyError, VerifySettings, shape};
pub(crate) use constant::Lengths;
pub use stated_costates::{StatedCostate, stated_costates};
pub(crate) use touch::{Place, Touch};
pub(crate) use transversality::parameter_slopes;

const KIND: CheckKind = CheckKind::Optimality;
/// Abscissae on [0, 1] and weights of the five-point Gauss rule.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668_0, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_55, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332_0, 0.118_463_442_528_094_54),
];

/// The controls among which a trajectory is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Among {
    /// All that are admissible.
    All,
    /// Those that are constant on each interval of the trajectory's control.
    Constant(Lengths),
}

/// The phases with their costates; none unless every phase has some, because part of the conditions says nothing.
pub(crate) fn phases<'a>(
    ocp: &'a Ocp,
    trajectory: &'a Trajectory,
    scaling: &'a Scaling,
    among: Among,
) -> Option<Vec<PhaseConditions<'a>>> {
    let rounding = rounding_of_costates(ocp, trajectory, scaling);
    let phase = |k: usize| PhaseConditions::new(ocp, trajectory, k, &scaling.phases[k], among, rounding);
    (0..ocp.phases.len()).map(phase).collect()
}

/// The trajectory with the controls that have the least Hamiltonian at its states and costates, a start from which a solve may end lower: none
/// where no other controls have less, or a phase has no costates.
///
/// # Errors
/// [`VerifyError`] when the trajectory does not have the sizes of the problem.
pub fn with_least_hamiltonian(
    ocp: &Ocp,
    trajectory: &Trajectory,
    settings: &VerifySettings,
) -> Result<Option<Trajectory>, VerifyError> {
    let guess = Guess::earlier(trajectory);
    shape::check(ocp, trajectory, &guess)?;
    let scaling = Scaling::new(ocp, &guess);
    let Some(mut conditions) = phases(ocp, trajectory, &scaling, Among::All) else { return Ok(None) };
    let mut better = trajectory.clone();
    let mut any = false;
    for (phase, conditions) in better.phases.iter_mut().zip(&mut conditions) {
        if let Some(control) = conditions.least_controls(settings) {
            phase.control = control;
            any = true;
        }
    }
    Ok(any.then_some(better))
}

/// A phase shorter than this part of the whole flight, or of its longest duration, has come to nothing.
const VANISHED: f64 = 1e-7;

/// The trajectory with the controls of least Hamiltonian in phases that have come to nothing: there controls have no effect, and the question is
/// whether with the best of them the phase would rather last. None where there are no such phases.
pub(crate) fn with_vanished_phases(
    ocp: &Ocp,
    trajectory: &Trajectory,
    scaling: &Scaling,
    settings: &VerifySettings,
) -> Option<Trajectory> {
    let duration = |k: usize| trajectory.phases[k].final_time - trajectory.phases[k].initial_time;
    let flight = (0..ocp.phases.len()).map(duration).fold(0.0, f64::max);
    let has_vanished = |k: &usize| {
        let longest = ocp.phases[*k].longest();
        duration(*k) <= VANISHED * if longest.is_finite() { longest.max(flight) } else { flight }
    };
    let vanished: Vec<usize> = (0..ocp.phases.len()).filter(has_vanished).collect();
    if vanished.is_empty() {
        return None;
    }
    let mut conditions = phases(ocp, trajectory, scaling, Among::All)?;
    let mut settled = trajectory.clone();
    for k in vanished {
        if let Some(control) = conditions[k].least_controls(settings) {
            settled.phases[k].control = control;
        }
    }
    Some(settled)
}

/// All first-order checks.
pub(crate) fn checks(
    ocp: &Ocp,
    trajectory: &Trajectory,
    scaling: &Scaling,
    settings: &VerifySettings,
    conditions: &mut [PhaseConditions<'_>],
) -> Vec<Check> {
    let mut checks = Vec::new();
    for phase in &mut *conditions {
        checks.extend(phase.costate_equation(settings));
        match phase.among {
            Among::All => {
                let minimum = phase.minimum_principle(settings);
                checks.extend(phase.stationarity(settings));
                checks.extend(phase.path_multipliers(settings));
                checks.extend(minimum);
                checks.extend(phase.hamiltonian(settings));
            }
            Among::Constant(lengths) => {
                checks.extend(phase.mean_stationarity(settings));
                checks.extend(phase.path_multipliers(settings));
                // Where the intervals may change their lengths the Hamiltonian is continuous.
                checks.extend((lengths == Lengths::Free).then(|| phase.hamiltonian(settings)).flatten());
            }
        }
        checks.extend(phase.contact_rates(settings));
        checks.extend(phase.contact_hamiltonian(settings));
    }
    checks.extend(transversality::checks(ocp, trajectory, scaling, settings, conditions));
    checks
}

/// A change that is held against the range of the Hamiltonian over the controls counts this much, two percent at the default tolerance: costates, accurate relative to the largest of them,
/// are less so relative to a small range, as that of a weak thrust.
const RANGE_WEIGHT: f64 = 5e-4;
/// A range below this part of the largest term is taken as this part: costates may err by as much, and along an arc on which a control has no
/// effect the range is rounding.
const LEAST_RANGE: f64 = 1e-5;

/// Costates, times the scales of their states, are held against this part of the Hamiltonian times the duration where they are less.
/// A rate of the size of a state over the duration then adds less than this part to the Hamiltonian: such costates are rounding.
const SMALLEST_COSTATE: f64 = 1e-4;

/// A Hamiltonian that changes an objective by less than this part of it over the duration is rounding.
const ROUNDING: f64 = 1e-9;
/// Samples over the duration of a phase, at least.
pub(crate) const SAMPLES: f64 = 160.0;

/// An objective below is nothing in any unit that makes sense.
const NO_OBJECTIVE: f64 = 1e-15;

/// One phase with its costates, looked at in the nodes of its control.
pub(crate) struct PhaseConditions<'a> {
    pub(crate) equations: Equations<'a>,
    pub(crate) found: &'a PhaseTrajectory,
    pub(crate) costate: &'a PiecewisePolynomial,
    pub(crate) scaling: &'a PhaseScaling,
    pub(crate) nodes: Vec<Node>,
    /// Largest term of the Hamiltonian over the nodes.
    pub(crate) hamiltonian_size: f64,
    /// The same for its slopes, not below what quantities within their accuracy leave of an objective that is nothing.
    pub(crate) slope_size: f64,
    /// Largest change of the Hamiltonian by controls at one time, as far as the minimum principle has been looked at.
    control_range: f64,
    /// The same by each control alone.
    ranges_alone: Vec<f64>,
    /// Largest costate times the scale of its state over the nodes.
    pub(crate) costate_size: f64,
    /// Per row of the path constraints, its typical size.
    pub(crate) row_scales: Vec<f64>,
    pub(crate) point: Point,
    pub(crate) among: Among,
    /// Another control with the same Hamiltonian along an arc, in words.
    pub(crate) rival: Option<String>,
    /// Scales of the controls in the second variation.
    pub(crate) control_scales: Vec<f64>,
    /// Where a control at its bound is as good at the opposite one.
    pub(crate) touches: Vec<Touch>,
    /// The first jump of a costate where the equations of motion jump.
    pub(crate) jump: Option<costate::Jump>,
    /// True if a function of the ends has a kink there with other second derivatives on its sides.
    pub(crate) ends_hide_curvature: bool,
    /// Conditions at the contacts of the trajectory.
    impulses: Vec<contact::Impulse>,
    /// Indices among the ends of the control's pieces at which the equations jump or have a kink at a time.
    pub(crate) instants: Vec<usize>,
    /// The rates at which these move with the parameters.
    pub(crate) rates_of_instants: Vec<Vec<f64>>,
}

/// State, control, costate, path multipliers at one time, and the gradient of the Lagrangian there.
pub(crate) struct Point {
    /// The time, clear of what jumps at the ends of the control's pieces.
    pub(crate) time: f64,
    pub(crate) x: Vec<f64>,
    pub(crate) u: Vec<f64>,
    pub(crate) costate: Vec<f64>,
    pub(crate) multipliers: Vec<f64>,
    /// Gradient with respect to `[x, u, p, t]`.
    pub(crate) gradient: Vec<f64>,
}

pub(crate) struct Node {
    /// Index of its interval.
    segment: usize,
    pub(crate) time: f64,
    pub(crate) control: Vec<f64>,
    /// Gradient of the Lagrangian with respect to the controls.
    pub(crate) slope: Vec<f64>,
    pub(crate) hamiltonian: f64,
    pub(crate) path: Vec<f64>,
    pub(crate) multipliers: Vec<f64>,
}

impl<'a> PhaseConditions<'a> {
    fn new(
        ocp: &'a Ocp,
        trajectory: &'a Trajectory,
        k: usize,
        scaling: &'a PhaseScaling,
        among: Among,
        rounding: f64,
    ) -> Option<Self> {
        let found = &trajectory.phases[k];
        let equations = Equations::new(ocp, k, &trajectory.parameters)
            .with_integral_multipliers(found.integral_multipliers.as_ref());
        let (nx, nu, rows) = (equations.nx, equations.nu, equations.phase.path_rows());
        let point = Point {
            time: found.initial_time,
            x: vec![0.0; nx],
            u: vec![0.0; nu],
            costate: vec![0.0; nx],
            multipliers: vec![0.0; rows],
            gradient: vec![0.0; nx + nu + equations.np + 1],
        };
        let costate = found.costate.as_ref()?;
        let parameters = &trajectory.parameters;
        let instants = ends_at_instants(ocp, k, parameters, found.control.breaks());
        let mut conditions = Self {
            equations,
            found,
            costate,
            scaling,
            nodes: Vec::new(),
            hamiltonian_size: 0.0,
            slope_size: 0.0,
            control_range: 0.0,
            ranges_alone: vec![0.0; nu],
            costate_size: 0.0,
            row_scales: Vec::new(),
            point,
            among,
            rival: None,
            control_scales: scaling.controls.clone(),
            touches: Vec::new(),
            jump: None,
            ends_hide_curvature: false,
            impulses: Vec::new(),
            rates_of_instants: rates_of_instants(ocp, k, parameters, found.control.breaks(), &instants),
            instants,
        };
        for segment in 0..found.control.segments().len() {
            for time in found.control.node_times(segment) {
                conditions.add_node(segment, time);
            }
        }
        // Where cost and costates are nothing, what they leave is rounding of the objective.
        let objective = trajectory.objective.abs();
        let objective = if objective < NO_OBJECTIVE { 1.0 } else { objective };
        let duration = found.final_time - found.initial_time;
        conditions.hamiltonian_size = conditions.hamiltonian_size.max(ROUNDING * objective / duration);
        conditions.slope_size = conditions.hamiltonian_size.max(rounding / duration);
        // What is less has no part in the Hamiltonian but that of rounding.
        let least = (SMALLEST_COSTATE * conditions.hamiltonian_size * scaling.time).max(rounding);
        conditions.costate_size = conditions.costate_size.max(least);
        let largest = |r: usize| conditions.nodes.iter().fold(0.0, |m: f64, n| m.max(n.path[r].abs()));
        conditions.row_scales = row_scales(conditions.equations.phase, scaling, largest);
        conditions.find_impulses();
        Some(conditions)
    }

    /// Interval and time of samples along the phase, both ends of each interval of the control included.
    pub(crate) fn sample_times(&self, per_node: usize) -> Vec<(usize, f64)> {
        let control = &self.found.control;
        let breaks = control.breaks();
        let duration = breaks[breaks.len() - 1] - breaks[0];
        let times = breaks.windows(2).enumerate().flat_map(|(segment, ends)| {
            let (start, length) = (ends[0], ends[1] - ends[0]);
            let nodes = control.segments()[segment].basis.nodes().len();
            let n = ((SAMPLES * length / duration).ceil() as usize).max(per_node * nodes);
            let last = ends[1];
            (0..=n).map(move |j| (segment, if j == n { last } else { start + length * j as f64 / n as f64 }))
        });
        times.collect()
    }

    /// A change of the Hamiltonian that controls make, relative to its largest term, and to what controls can change of it.
    fn relative_to_controls(&self, change: f64) -> f64 {
        let of_range = self.relative_to_range(change, self.control_range);
        let of_terms = relative(change, self.hamiltonian_size);
        if of_range.abs() > of_terms.abs() { of_range } else { of_terms }
    }

    /// A change that one control makes alone, relative to what it can change alone: another one of large range would hide it.
    fn relative_to_control(&self, change: f64, control: usize) -> f64 {
        self.relative_to_range(change, self.ranges_alone[control])
    }

    fn relative_to_range(&self, change: f64, range: f64) -> f64 {
        RANGE_WEIGHT * relative(change, range.max(LEAST_RANGE * self.hamiltonian_size))
    }

    /// The largest change that is within a limit by [`relative_to_controls`](Self::relative_to_controls).
    fn allowed_gap(&self, limit: f64) -> f64 {
        let range = self.control_range.max(LEAST_RANGE * self.hamiltonian_size);
        (limit * self.hamiltonian_size).min(limit * range / RANGE_WEIGHT)
    }

    fn add_node(&mut self, segment: usize, time: f64) {
        let h = self.evaluate(segment, time);
        let (nx, nu) = (self.equations.nx, self.equations.nu);
        let mut path = vec![0.0; self.point.multipliers.len()];
        self.equations.path(&mut path);
        self.hamiltonian_size = self.hamiltonian_size.max(h.largest_term);
        for (lambda, scale) in self.point.costate.iter().zip(&self.scaling.states) {
            self.costate_size = self.costate_size.max((lambda * scale).abs());
        }
        self.nodes.push(Node {
            segment,
            time,
            control: self.point.u.clone(),
            slope: self.point.gradient[nx..nx + nu].to_vec(),
            hamiltonian: h.value,
            path,
            multipliers: self.point.multipliers.clone(),
        });
    }

    /// Fills the point at a time of a control interval and gives the Hamiltonian.
    fn evaluate(&mut self, segment: usize, t: f64) -> Hamiltonian {
        let control = &self.found.control;
        control.evaluate_in(segment, t, &mut self.point.u);
        self.evaluate_with_control(segment, t)
    }

    /// The same with the control held within its bounds, since an end that is not a node is an extrapolation.
    pub(crate) fn evaluate_within_bounds(&mut self, segment: usize, t: f64) -> Hamiltonian {
        self.found.control.evaluate_in(segment, t, &mut self.point.u);
        for (u, c) in self.point.u.iter_mut().zip(&self.equations.phase.controls) {
            // `clamp` of the bounds would turn a NaN into a bound.
            *u = if u.is_nan() { *u } else { c.bounds.clamp(*u) };
        }
        self.evaluate_with_control(segment, t)
    }

    fn evaluate_with_control(&mut self, segment: usize, t: f64) -> Hamiltonian {
        let Self { equations, found, costate, point, .. } = self;
        let pieces = found.control.segments().len();
        evaluate_piece(&found.state, pieces, segment, t, &mut point.x);
        evaluate_piece(costate, pieces, segment, t, &mut point.costate);
        if let Some(mu) = &found.path_multipliers {
            evaluate_piece(mu, pieces, segment, t, &mut point.multipliers);
        }
        point.time = found.control.within(segment, t);
        equations.set(point.time, &point.x, &point.u);
        equations.lagrangian(&point.costate, &point.multipliers, &mut point.gradient)
    }
}

/// Value in the piece of the control interval where both have the same intervals, else wherever `t` is.
pub(crate) fn evaluate_piece(
    p: &PiecewisePolynomial,
    pieces: usize,
    segment: usize,
    t: f64,
    out: &mut [f64],
) {
    if p.segments().len() == pieces {
        p.evaluate_in(segment, t, out);
    } else {
        p.evaluate(t, out);
    }
}

/// `min(|slope|, room)`: see the head of this module; `slope` is already relative.
fn natural_residual(slope: f64, value: f64, bounds: &Bounds, scale: f64) -> f64 {
    if slope.is_nan() || value.is_nan() {
        return f64::NAN;
    }
    // A violated bound is the subject of other checks.
    let value = bounds.clamp(value);
    let room = if slope > 0.0 { value - bounds.lower } else { bounds.upper - value };
    slope.abs().min(room / scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const LAST_BITS: f64 = 1e-15;

    #[test]
    fn natural_residual_by_case() {
        let b = Bounds::new(-1.0, 1.0);
        let cases = [
            (0.0, 0.5, 0.0),
            (0.3, 0.0, 0.3),
            (0.3, -1.0, 0.0),  // pushes down against the lower bound
            (-0.3, -1.0, 0.3), // pushes away from it
            (-0.3, 1.0, 0.0),
            (0.3, 1.0, 0.3),
            (0.3, -1.0 + 1e-9, 1e-9),
            (5.0, -2.0, 0.0),
            (-5.0, -2.0, 2.0),
        ];
        for (slope, value, expected) in cases {
            assert!(
                (natural_residual(slope, value, &b, 1.0) - expected).abs() < LAST_BITS,
                "{slope} {value}"
            );
        }
        assert!(natural_residual(f64::NAN, 0.0, &b, 1.0).is_nan());
        assert!(natural_residual(1.0, f64::NAN, &b, 1.0).is_nan());
        assert_eq!(natural_residual(-2.0, 0.0, &Bounds::FREE, 1.0), 2.0);
        for value in [2.9, 3.0, 3.1] {
            assert_eq!(natural_residual(-2.0, value, &Bounds::fixed(3.0), 1.0), 0.0);
        }
    }
}
