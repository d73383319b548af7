//! Nodes whose control is at a local minimum of the Hamiltonian while another one admissible there has a smaller Hamiltonian.
//!
//! At a solution of the discretised problem the control of each node is stationary in the Hamiltonian of that node, or at its bounds. An angle
//! between bounds a turn apart, caught at one of them, or a node beyond a corner is so too. Pontryagin's minimum principle tells the two
//! apart; from the better control the same mesh leads to a lower cost. An angle that differs by turns from node to node means the same at
//! each node, but not between them: it is made continuous.

use std::f64::consts::TAU;

use apsides_ocp::{
    Bounds, Ocp, PathConstraint, Phase, PhaseTrajectory, PiecewisePolynomial, Segment, Trajectory, Variable,
};

/// Values of each control between its bounds that are tried.
const GRID: usize = 8;

/// Controls of other nodes that are tried.
const ELSEWHERE: usize = 16;

/// A Hamiltonian that is lower by more than this part of its largest term is.
const EVIDENT: f64 = 1e-6;

/// Controls are apart if they differ by more than this part of their range.
const APART: f64 = 0.05;

/// Largest part of the nodes of a phase that are caught: where more are, it is not in single nodes that the solution is no minimum.
const MOST: f64 = 0.5;

/// Excess of a path constraint with controls, relative to its scale, up to which a control is admissible.
const ADMISSIBLE: f64 = 1e-6;

/// Rates that differ by less, relative to their size, are the same after a turn.
const SAME: f64 = 1e-9;

/// A trajectory with better controls.
pub(crate) struct Better {
    pub(crate) trajectory: Trajectory,
    /// True if the cost has to fall, false where angles were made continuous alone.
    pub(crate) costs_less: bool,
}

/// The trajectory with better controls at the nodes that have one; none if there is none.
pub(crate) fn with_lower_hamiltonian(ocp: &Ocp, trajectory: &Trajectory) -> Option<Better> {
    let mut better = trajectory.clone();
    let (mut any, mut costs_less) = (false, false);
    for (k, phase) in ocp.phases.iter().enumerate() {
        let weights: Vec<f64> = (0..phase.integrals.len())
            .map(|q| ocp.objective.sense.sign() * ocp.objective.integral_weight(k, q))
            .collect();
        let found = &trajectory.phases[k];
        let Some(mut node) = NodeHamiltonian::new(phase, found, &weights, &trajectory.parameters) else {
            continue;
        };
        if let Some((control, is_lower)) = node.better_controls() {
            better.phases[k].control = control;
            (any, costs_less) = (true, costs_less | is_lower);
        }
    }
    any.then_some(Better { trajectory: better, costs_less })
}

/// Makes an angle continuous from node to node; false if it is, or its bounds leave no room.
fn unwind(values: &mut [f64], width: usize, c: usize, bounds: &Bounds) -> bool {
    let mut angles: Vec<f64> = values.iter().skip(c).step_by(width).copied().collect();
    for k in 1..angles.len() {
        angles[k] -= ((angles[k] - angles[k - 1]) / TAU).round() * TAU;
    }
    let turns = [0.0, TAU, -TAU].into_iter().find(|t| angles.iter().all(|a| bounds.excess(a + t) <= 0.0));
    let Some(turns) = turns else { return false };
    let mut turned = false;
    for (v, a) in values.iter_mut().skip(c).step_by(width).zip(angles) {
        turned |= (*v - (a + turns)).abs() > 1.0;
        *v = a + turns;
    }
    turned
}

/// The Hamiltonian of one phase at its nodes.
struct NodeHamiltonian<'a> {
    phase: &'a Phase,
    found: &'a PhaseTrajectory,
    costate: &'a PiecewisePolynomial,
    /// Weights of the integrals in the cost and in the conditions on them.
    weights: Vec<f64>,
    parameters: &'a [f64],
    /// Interval and time of the states and costates at hand.
    place: Option<(usize, f64)>,
    state: Vec<f64>,
    rates: Vec<f64>,
    multipliers: Vec<f64>,
    inputs: Vec<f64>,
    rows: Vec<f64>,
}

impl<'a> NodeHamiltonian<'a> {
    fn new(
        phase: &'a Phase,
        found: &'a PhaseTrajectory,
        weights: &[f64],
        parameters: &'a [f64],
    ) -> Option<Self> {
        let (nx, nu) = (phase.states.len(), phase.controls.len());
        let stated = found.integral_multipliers.as_deref();
        let multiplier = |q: usize| stated.and_then(|m| m.get(q)).copied().unwrap_or(0.0);
        let rows = phase.path.iter().map(|c| c.rows.len()).max().unwrap_or(0);
        (nu > 0).then_some(())?;
        Some(Self {
            phase,
            found,
            costate: found.costate.as_ref()?,
            weights: weights.iter().enumerate().map(|(q, w)| w + multiplier(q)).collect(),
            parameters,
            place: None,
            state: vec![0.0; nx],
            rates: vec![0.0; nx],
            multipliers: vec![0.0; nx],
            inputs: Vec::new(),
            rows: vec![0.0; rows],
        })
    }

    /// The controls with those of the caught nodes replaced and continuous angles, and whether any node was caught.
    fn better_controls(&mut self) -> Option<(PiecewisePolynomial, bool)> {
        let nu = self.phase.controls.len();
        let p = &self.found.control;
        let times: Vec<Vec<f64>> = (0..p.segments().len()).map(|k| p.node_times(k).collect()).collect();
        let values: Vec<f64> = p.segments().iter().flat_map(|s| s.values.iter().copied()).collect();
        let places: Vec<(usize, f64)> =
            times.iter().enumerate().flat_map(|(k, times)| times.iter().map(move |t| (k, *t))).collect();
        let size = places.iter().zip(values.chunks(nu)).map(|(at, u)| self.size(*at, u)).fold(0.0, f64::max);
        let mut better = values.clone();
        let mut caught = 0;
        for (n, at) in places.iter().enumerate() {
            let own = &values[n * nu..(n + 1) * nu];
            // Across a break the control may jump.
            let same_arc =
                |m: &usize| places.get(*m).is_some_and(|other| self.arc(other.0) == self.arc(at.0));
            let neighbours = [n.checked_sub(1).filter(same_arc), Some(n + 1).filter(same_arc)];
            let held = self.held(at.0);
            let neighbours = neighbours.into_iter().flatten().map(|m| {
                let theirs = values[m * nu..(m + 1) * nu].iter().zip(own).zip(&held);
                theirs.map(|((theirs, own), held)| if *held { *own } else { *theirs }).collect()
            });
            let candidates = neighbours.chain(self.grid(&held, own)).chain(self.beyond(&held, own, &values));
            let candidates = candidates.filter(|u| self.are_apart(u, own) && self.is_within_bounds(u));
            let candidates: Vec<Vec<f64>> = candidates.collect();
            let stated = self.value(*at, own);
            let mut least = stated - EVIDENT * size;
            for u in candidates {
                let h = self.value(*at, &u);
                if h < least
                    && self.is_admissible(*at, &u)
                    && !self.is_affine(*at, [(own, stated), (&u, h)], size)
                {
                    least = h;
                    better[n * nu..(n + 1) * nu].copy_from_slice(&u);
                }
            }
            caught += usize::from(least < stated - EVIDENT * size);
        }
        if caught as f64 > MOST * places.len() as f64 {
            return None;
        }
        let mut turned = false;
        for c in 0..nu {
            if self.is_angle(c, &places, &values) {
                turned |= unwind(&mut better, nu, c, &self.phase.controls[c].bounds);
            }
        }
        if caught == 0 && !turned {
            return None;
        }
        let mut rest = better.as_slice();
        let segments = p.segments().iter().map(|s| {
            let (own, others) = rest.split_at(s.values.len());
            rest = others;
            Segment { basis: std::sync::Arc::clone(&s.basis), values: own.to_vec() }
        });
        let control = PiecewisePolynomial::new(nu, p.breaks().to_vec(), segments.collect()).ok()?;
        Some((control, caught > 0))
    }

    /// Says whether the Hamiltonian is linear from one control to another, and those between are admissible: then no minimum in between
    /// keeps a solution at the wrong one, and the time of its switch is an unknown of its own.
    fn is_affine(&mut self, at: (usize, f64), [(a, ha), (b, hb)]: [(&[f64], f64); 2], size: f64) -> bool {
        let middle: Vec<f64> = a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).collect();
        (self.value(at, &middle) - 0.5 * (ha + hb)).abs() <= SAME * size && self.is_admissible(at, &middle)
    }

    /// Says whether a turn of a control changes nothing, and its bounds leave room for one.
    fn is_angle(&mut self, c: usize, places: &[(usize, f64)], values: &[f64]) -> bool {
        let nu = self.phase.controls.len();
        let Bounds { lower, upper } = self.phase.controls[c].bounds;
        if upper - lower < TAU {
            return false;
        }
        let mut before = self.rates.clone();
        places.iter().zip(values.chunks(nu)).all(|(at, u)| {
            let (value, largest) = self.terms(*at, u);
            before.copy_from_slice(&self.rates);
            let mut turned = u.to_vec();
            turned[c] += TAU;
            let (other, _) = self.terms(*at, &turned);
            let same = |a: f64, b: f64, size: f64| (a - b).abs() <= SAME * size.max(a.abs());
            let size = before.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            same(value, other, largest) && before.iter().zip(&self.rates).all(|(a, b)| same(*a, *b, size))
        })
    }

    /// Index of the arc that an interval belongs to.
    fn arc(&self, interval: usize) -> usize {
        self.found.mesh.breaks().partition_point(|b| b.end <= interval)
    }

    /// Says of each control whether the mesh holds it at a bound.
    fn held(&self, interval: usize) -> Vec<bool> {
        let courses = &self.found.mesh.arcs()[self.arc(interval)].controls;
        let held = |(c, v): (usize, &Variable)| {
            courses.get(c).copied().flatten().is_some_and(|course| course.held(&v.bounds).is_some())
        };
        self.phase.controls.iter().enumerate().map(held).collect()
    }

    /// Controls with one of those that are not held elsewhere between its bounds.
    fn grid(&self, held: &[bool], own: &[f64]) -> Vec<Vec<f64>> {
        let mut grid = Vec::new();
        for (c, (control, held)) in self.phase.controls.iter().zip(held).enumerate() {
            let (lower, upper) = (control.bounds.lower, control.bounds.upper);
            if *held || !(upper - lower).is_finite() || upper <= lower {
                continue;
            }
            for k in 0..=GRID {
                let mut u = own.to_vec();
                u[c] = lower + (upper - lower) * k as f64 / GRID as f64;
                grid.push(u);
            }
        }
        grid
    }

    /// Where path constraints bind controls to each other, the opposite of all that are not held, and the controls of some of the nodes:
    /// those of a grid would seldom be admissible.
    fn beyond(&self, held: &[bool], own: &[f64], values: &[f64]) -> Vec<Vec<f64>> {
        let (nx, nu) = (self.phase.states.len(), own.len());
        let binds = |c: &PathConstraint| {
            c.function.pattern().columns.iter().filter(|i| (nx..nx + nu).contains(i)).nth(1).is_some()
        };
        if !self.phase.path.iter().any(binds) {
            return Vec::new();
        }
        let but_held = |u: &[f64]| -> Vec<f64> {
            u.iter().zip(own).zip(held).map(|((u, own), held)| if *held { *own } else { *u }).collect()
        };
        let opposite: Vec<f64> = own.iter().map(|u| -u).collect();
        let stride = (values.len() / nu).div_ceil(ELSEWHERE).max(1);
        std::iter::once(opposite.as_slice()).chain(values.chunks(nu).step_by(stride)).map(but_held).collect()
    }

    fn are_apart(&self, one: &[f64], other: &[f64]) -> bool {
        self.phase.controls.iter().zip(one).zip(other).any(|((c, a), b)| {
            let width = c.bounds.upper - c.bounds.lower;
            let range =
                if width.is_finite() { width } else { c.size().unwrap_or(1.0).max(a.abs()).max(b.abs()) };
            (a - b).abs() > APART * range
        })
    }

    fn is_within_bounds(&self, u: &[f64]) -> bool {
        self.phase.controls.iter().zip(u).all(|(c, u)| c.bounds.excess(*u) <= 0.0)
    }

    /// Goes to a place with a control.
    fn go(&mut self, place: (usize, f64), u: &[f64], inputs: usize) {
        if self.place != Some(place) {
            self.found.state.evaluate_in(place.0, place.1, &mut self.state);
            self.costate.evaluate_in(place.0, place.1, &mut self.multipliers);
            self.place = Some(place);
        }
        self.inputs.clear();
        self.inputs.extend_from_slice(&self.state);
        self.inputs.extend_from_slice(u);
        if inputs > self.inputs.len() + 1 {
            self.inputs.extend_from_slice(self.parameters);
        }
        self.inputs.push(place.1);
    }

    fn terms(&mut self, at: (usize, f64), u: &[f64]) -> (f64, f64) {
        let phase = self.phase;
        self.go(at, u, phase.dynamics.inputs());
        phase.dynamics.value(&self.inputs, &mut self.rates);
        let (mut sum, mut largest) = (0.0, 0.0f64);
        for (l, f) in self.multipliers.iter().zip(&self.rates) {
            sum += l * f;
            largest = largest.max((l * f).abs());
        }
        for (q, integral) in phase.integrals.iter().enumerate() {
            let mut value = [0.0];
            self.go(at, u, integral.function.inputs());
            integral.function.value(&self.inputs, &mut value);
            let term = self.weights[q] * value[0];
            sum += term;
            largest = largest.max(term.abs());
        }
        (sum, largest)
    }

    /// The Hamiltonian; infinite where it is no number.
    fn value(&mut self, at: (usize, f64), u: &[f64]) -> f64 {
        let (sum, _) = self.terms(at, u);
        if sum.is_nan() { f64::INFINITY } else { sum }
    }

    /// The largest term of the Hamiltonian.
    fn size(&mut self, at: (usize, f64), u: &[f64]) -> f64 {
        self.terms(at, u).1
    }

    /// Says whether path constraints with controls are met, at the bounds that the mesh holds them at: where these switch is an unknown of its
    /// own.
    fn is_admissible(&mut self, at: (usize, f64), u: &[f64]) -> bool {
        let (nx, nu) = (self.phase.states.len(), u.len());
        let mut first = 0;
        let courses = &self.found.mesh.arcs()[self.arc(at.0)].rows;
        for c in &self.phase.path {
            let courses = courses.get(first..first + c.rows.len());
            first += c.rows.len();
            if !c.function.pattern().columns.iter().any(|i| (nx..nx + nu).contains(i)) {
                continue;
            }
            self.go(at, u, c.function.inputs());
            c.function.value(&self.inputs, &mut self.rows[..c.rows.len()]);
            let is_met = c.rows.iter().zip(&self.rows).enumerate().all(|(k, (row, value))| {
                let margin = ADMISSIBLE * row.size().unwrap_or_else(|| value.abs().max(1.0));
                let held = courses.and_then(|courses| courses[k]?.held(&row.bounds));
                row.bounds.excess(*value) <= margin && held.is_none_or(|held| (value - held).abs() <= margin)
            });
            if !is_met {
                return false;
            }
        }
        true
    }
}
