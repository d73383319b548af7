//! The Hamiltonian of a phase, `H = L + lambda^T f`, minimised over the controls at one time, and its derivatives.
//!
//! With path constraints `g` that depend on the controls and their multipliers `mu`, `Hbar = H + mu^T g`:
//!
//! ```text
//! x' = f,   lambda' = -dHbar/dx,   q' = dHbar/dp,   dHbar/du = 0 for controls between their bounds
//! ```
//!
//! (A. E. Bryson, Y.-C. Ho, Applied Optimal Control, 1975, sections 2.8 and 3.10.) The last line is differentiated as it stands, so
//! that derivatives with respect to state and costate are exact whichever way the control was found.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

use apsides_ad::NodeFunction;
use apsides_ocp::{Bounds, Direction, Ocp};

use super::term::Term;

/// The place of a control or a row between its bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    Inside,
    Lower,
    Upper,
}

/// A switch of a control between its bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlSwitch {
    /// Time.
    pub time: f64,
    /// Index of the control.
    pub control: usize,
    /// True when it goes to its upper bound.
    pub rises: bool,
}

/// The way that a control is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ControlKind {
    /// By Newton's method.
    Smooth,
    /// The angle of a direction.
    Closed,
    /// The Hamiltonian is linear in it: it is at one of its bounds, by the sign of the switching function.
    Switching,
}

/// The Hamiltonian of one phase with storage for one time.
pub(super) struct Hamiltonian {
    pub(super) states: usize,
    pub(super) controls: usize,
    /// Parameters that functions of this phase take; none or all of the problem.
    pub(super) parameters: usize,
    pub(super) dynamics: Term,
    /// Integrands of the objective and their weights.
    integrands: Vec<(Term, f64)>,
    /// Path constraints that depend on controls.
    pub(super) rows: Vec<(Term, Vec<Bounds>)>,
    pub(super) row_count: usize,
    /// Rows of the phase that these are.
    row_origins: Vec<usize>,
    pub(super) bounds: Vec<Bounds>,
    pub(super) kinds: Vec<ControlKind>,
    directions: Vec<Direction>,
    /// Controls with a square added, which makes them smooth, and the weight of these squares.
    pub(super) smoothed: Vec<usize>,
    smoothing: f64,
    /// `[x, u, p, t]`.
    pub(super) z: Vec<f64>,
    pub(super) costate: Vec<f64>,
    /// Places of controls and rows.
    pub(super) control_places: Vec<Place>,
    pub(super) row_places: Vec<Place>,
    pub(super) row_values: Vec<f64>,
    pub(super) multipliers: Vec<f64>,
    /// Value of `H` at the last point.
    pub(super) value: f64,
    /// Gradient of `Hbar`.
    pub(super) gradient: Vec<f64>,
    /// Hessian of `Hbar`, all entries.
    pub(super) curvature: Vec<f64>,
    /// Slopes of the rates and of the rows, row-major by inputs; where nothing depends on an input they stay zero.
    pub(super) rate_slopes: Vec<f64>,
    pub(super) row_slopes: Vec<f64>,
    pub(super) scratch: Vec<f64>,
    pub(super) right: Vec<f64>,
    /// Derivatives of the controls with respect to `[x, lambda, p]`.
    pub(super) control_slopes: Vec<f64>,
    pub(super) multiplier_slopes: Vec<f64>,
}

impl Hamiltonian {
    /// The Hamiltonian of a phase of a problem; `weights` are those of its integrals in the minimised objective.
    pub(super) fn new(ocp: &Ocp, phase: usize, weights: &[f64], smoothing: f64) -> Self {
        let phase = &ocp.phases[phase];
        let (nx, nu) = (phase.states.len(), phase.controls.len());
        let base = nx + nu;
        let integrands = phase.integrals.iter().zip(weights).filter(|(_, w)| **w != 0.0);
        let takes = |f: &Arc<dyn NodeFunction>| phase.takes_parameters(f.as_ref());
        let any = takes(&phase.dynamics)
            || integrands.clone().any(|(q, _)| takes(&q.function))
            || phase.path.iter().any(|c| takes(&c.function));
        let np = if any { ocp.parameters.len() } else { 0 };
        let dynamics = Term::new(phase.dynamics.clone(), base, np);
        let integrands: Vec<_> =
            integrands.map(|(q, &w)| (Term::new(q.function.clone(), base, np), w)).collect();
        let mut rows: Vec<(Term, Vec<Bounds>)> = Vec::new();
        let mut row_origins = Vec::new();
        let mut first = 0;
        for c in &phase.path {
            let term = Term::new(c.function.clone(), base, np);
            if (nx..base).any(|u| term.depends_on(u)) {
                row_origins.extend(first..first + c.rows.len());
                rows.push((term, c.rows.iter().map(|r| r.bounds).collect()));
            }
            first += c.rows.len();
        }
        let row_count = row_origins.len();
        let bounds: Vec<Bounds> = phase.controls.iter().map(|c| c.bounds).collect();
        let is_closed = |u: usize| phase.directions.iter().any(|d| d.has(u));
        let is_linear = |u: usize| {
            let square = |t: &Term| t.is_nonlinear_in(nx + u, nx + u);
            !square(&dynamics)
                && !integrands.iter().any(|(t, _)| square(t))
                && !rows.iter().any(|(t, _)| t.depends_on(nx + u))
        };
        let smoothed = (0..nu).filter(|&u| smoothing > 0.0 && !is_closed(u) && is_linear(u)).collect();
        let kinds = (0..nu)
            .map(|u| match () {
                () if is_closed(u) => ControlKind::Closed,
                () if is_linear(u) && smoothing == 0.0 => ControlKind::Switching,
                () => ControlKind::Smooth,
            })
            .collect();
        let nz = base + np + 1;
        let kkt = nu + row_count;
        let columns = 2 * nx + np;
        let mut z = vec![0.0; nz];
        for (value, b) in z[nx..base].iter_mut().zip(&bounds) {
            *value = b.representative();
        }
        Self {
            states: nx,
            controls: nu,
            parameters: np,
            dynamics,
            integrands,
            rows,
            row_count,
            row_origins,
            kinds,
            directions: phase.directions.clone(),
            smoothed,
            smoothing,
            z,
            costate: vec![0.0; nx],
            control_places: vec![Place::Inside; nu],
            row_places: vec![Place::Inside; row_count],
            row_values: vec![0.0; row_count],
            multipliers: vec![0.0; row_count],
            value: 0.0,
            gradient: vec![0.0; nz],
            curvature: vec![0.0; nz * nz],
            rate_slopes: vec![0.0; nx * nz],
            row_slopes: vec![0.0; row_count * nz],
            scratch: vec![0.0; kkt * kkt],
            right: vec![0.0; kkt * columns.max(1)],
            control_slopes: vec![0.0; nu * columns],
            multiplier_slopes: vec![0.0; row_count * columns],
            bounds,
        }
    }

    /// Components of the canonical system: states, costates, and the integrals of `dHbar/dp`.
    pub(super) fn dimension(&self) -> usize {
        2 * self.states + self.parameters
    }

    pub(super) fn inputs(&self) -> usize {
        self.z.len()
    }

    /// Indices of the controls that the Hamiltonian is linear in.
    pub(super) fn switching(&self) -> Vec<usize> {
        (0..self.controls).filter(|&u| self.kinds[u] == ControlKind::Switching).collect()
    }

    /// The controls of the last point.
    pub(super) fn control(&self) -> &[f64] {
        &self.z[self.states..self.states + self.controls]
    }

    /// Sets the controls from which their search starts.
    pub(super) fn start_control(&mut self, control: &[f64]) {
        for (u, &value) in control.iter().enumerate() {
            if self.kinds[u] != ControlKind::Switching {
                self.z[self.states + u] = self.bounds[u].clamp(value);
            }
        }
        self.control_places.fill(Place::Inside);
        self.row_places.fill(Place::Inside);
        self.multipliers.fill(0.0);
    }

    /// Writes the multipliers of all path constraint rows of the phase.
    pub(super) fn write_multipliers(&self, out: &mut [f64]) {
        out.fill(0.0);
        for (&row, m) in self.row_origins.iter().zip(&self.multipliers) {
            out[row] = *m;
        }
    }

    fn set_point(&mut self, t: f64, x: &[f64], costate: &[f64], p: &[f64]) {
        let (nx, nu, np) = (self.states, self.controls, self.parameters);
        self.z[..nx].copy_from_slice(x);
        self.z[nx + nu..nx + nu + np].copy_from_slice(&p[..np]);
        self.z[nx + nu + np] = t;
        self.costate.copy_from_slice(costate);
    }

    /// Puts each switching control at the bound that the sign of its switching function asks for.
    pub(super) fn choose_levels(&mut self, t: f64, x: &[f64], costate: &[f64], p: &[f64]) {
        self.set_point(t, x, costate, p);
        for u in self.switching() {
            let mut value = self.switching_function(t, x, costate, p, u);
            if value == 0.0 {
                value = self.switching_rate(t, x, costate, p, u);
            }
            self.set_level(u, if value > 0.0 { Place::Lower } else { Place::Upper });
        }
    }

    /// Rate of change of the switching function of a control along the solution.
    fn switching_rate(&mut self, t: f64, x: &[f64], costate: &[f64], p: &[f64], u: usize) -> f64 {
        let (n, np) = (self.dimension(), self.parameters);
        let mut y = [x, costate].concat();
        y.resize(n, 0.0);
        let (mut rates, mut slopes) = (vec![0.0; n], vec![0.0; n * (n + np)]);
        self.rates_and_slopes(t, &y, p, &mut rates, &mut slopes);
        self.switching_slopes(u, &rates, &mut vec![0.0; n + np])
    }

    /// The largest `dH/du` at the current point that would have a switching control at its other bound, times the distance between its
    /// bounds.
    pub(super) fn wrong_level(&mut self) -> f64 {
        if !self.kinds.contains(&ControlKind::Switching) {
            return 0.0;
        }
        self.linearise();
        let mut wrong = 0.0_f64;
        for u in self.switching() {
            let slope = self.gradient[self.states + u] * (self.bounds[u].upper - self.bounds[u].lower);
            wrong = wrong.max(if self.control_places[u] == Place::Lower { -slope } else { slope });
        }
        wrong
    }

    /// Puts a switching control at a bound.
    pub(super) fn set_level(&mut self, u: usize, level: Place) {
        self.control_places[u] = level;
        self.z[self.states + u] =
            if level == Place::Lower { self.bounds[u].lower } else { self.bounds[u].upper };
    }

    /// Moves a control as a switch says.
    pub(super) fn apply_switch(&mut self, switch: &ControlSwitch) {
        self.set_level(switch.control, if switch.rises { Place::Upper } else { Place::Lower });
    }

    /// The working set of the pointwise minimisation: places of the controls, then of the rows.
    pub(super) fn places(&self) -> Vec<Place> {
        [&self.control_places[..], &self.row_places].concat()
    }

    /// The bound that a switching control is at.
    pub(super) fn level(&self, u: usize) -> Place {
        self.control_places[u]
    }

    /// `dH/du` of a switching control at the minimising values of the other controls.
    pub(super) fn switching_function(
        &mut self,
        t: f64,
        x: &[f64],
        costate: &[f64],
        p: &[f64],
        u: usize,
    ) -> f64 {
        self.find_control(t, x, costate, p);
        self.linearise();
        self.gradient[self.states + u]
    }

    /// The minimising controls at a point; [`value`](Self::value) is then that of `H`. False where none was found.
    pub(super) fn find_control(&mut self, t: f64, x: &[f64], costate: &[f64], p: &[f64]) -> bool {
        self.set_point(t, x, costate, p);
        for k in 0..self.directions.len() {
            self.apply_direction(self.directions[k]);
        }
        !self.kinds.contains(&ControlKind::Smooth) || self.minimise()
    }

    /// `H` at the current point.
    pub(super) fn hamiltonian(&mut self) -> f64 {
        self.dynamics.evaluate(&self.z);
        let mut h: f64 = self.dynamics.values.iter().zip(&self.costate).map(|(f, l)| f * l).sum();
        for (term, weight) in &mut self.integrands {
            term.evaluate(&self.z);
            h += *weight * term.values[0];
        }
        h
    }

    /// Fits `H = c + a cos + b sin (+ d)` through a few values and takes the direction opposite to `(a, b, d)`. Controls that scale the
    /// thrust are at their upper bounds meanwhile: the direction does not depend on it.
    fn apply_direction(&mut self, direction: Direction) {
        let nx = self.states;
        for u in 0..self.controls {
            if self.kinds[u] == ControlKind::Switching {
                self.z[nx + u] = self.bounds[u].upper;
            }
        }
        match direction {
            Direction::InPlane { angle } => {
                let before = self.z[nx + angle];
                let mut at = |value: f64| {
                    self.z[nx + angle] = value;
                    self.hamiltonian()
                };
                let (along, against, up) = (at(0.0), at(PI), at(FRAC_PI_2));
                let mean = 0.5 * (along + against);
                let (a, b) = (0.5 * (along - against), up - mean);
                self.z[nx + angle] = nearest_turn(f64::atan2(-b, -a), before);
            }
            Direction::InSpace { in_plane, out_of_plane } => {
                let before = self.z[nx + in_plane];
                let mut at = |a: f64, b: f64| {
                    self.z[nx + in_plane] = a;
                    self.z[nx + out_of_plane] = b;
                    self.hamiltonian()
                };
                let (along, against) = (at(0.0, 0.0), at(PI, 0.0));
                let (up, aside) = (at(FRAC_PI_2, 0.0), at(0.0, FRAC_PI_2));
                let mean = 0.5 * (along + against);
                let (a, b, d) = (0.5 * (along - against), up - mean, aside - mean);
                self.z[nx + in_plane] = nearest_turn(f64::atan2(-b, -a), before);
                self.z[nx + out_of_plane] = f64::atan2(-d, a.hypot(b));
            }
        }
        for u in 0..self.controls {
            if self.kinds[u] == ControlKind::Switching {
                self.set_level(u, self.control_places[u]);
            }
        }
    }

    /// Values and slopes of everything at the current point.
    pub(super) fn linearise(&mut self) {
        let nz = self.inputs();
        self.gradient.fill(0.0);
        self.dynamics.linearise(&self.z);
        self.value = self.dynamics.values.iter().zip(&self.costate).map(|(f, l)| f * l).sum();
        let (costate, gradient, slopes) = (&self.costate, &mut self.gradient, &mut self.rate_slopes);
        self.dynamics.each_slope(|row, c, v| {
            slopes[row * nz + c] = v;
            gradient[c] += costate[row] * v;
        });
        for (term, weight) in &mut self.integrands {
            term.linearise(&self.z);
            self.value += *weight * term.values[0];
            term.each_slope(|_, c, v| gradient[c] += *weight * v);
        }
        let mut first = 0;
        for (term, _) in &mut self.rows {
            term.linearise(&self.z);
            self.row_values[first..first + term.values.len()].copy_from_slice(&term.values);
            let (slopes, multipliers) = (&mut self.row_slopes, &self.multipliers);
            term.each_slope(|row, c, v| {
                slopes[(first + row) * nz + c] = v;
                gradient[c] += multipliers[first + row] * v;
            });
            first += term.values.len();
        }
        for &u in &self.smoothed {
            let (middle, half) = middle_and_half(&self.bounds[u]);
            let distance = (self.z[self.states + u] - middle) / half;
            self.value += self.square(u);
            self.gradient[self.states + u] += self.smoothing * distance / half;
        }
    }

    /// Hessian of `Hbar` at the last [`linearise`](Self::linearise).
    pub(super) fn curve(&mut self) {
        let nz = self.inputs();
        self.curvature.fill(0.0);
        let curvature = &mut self.curvature;
        let mut add = |weight: f64, i: usize, j: usize, v: f64| {
            curvature[i * nz + j] += weight * v;
            if i != j {
                curvature[j * nz + i] += weight * v;
            }
        };
        self.dynamics.each_curvature(&self.costate, |i, j, v| add(1.0, i, j, v));
        for (term, weight) in &mut self.integrands {
            term.each_curvature(&[1.0], |i, j, v| add(*weight, i, j, v));
        }
        let mut first = 0;
        for (term, _) in &mut self.rows {
            let count = term.values.len();
            term.each_curvature(&self.multipliers[first..first + count], |i, j, v| add(1.0, i, j, v));
            first += count;
        }
        for &u in &self.smoothed {
            let (_, half) = middle_and_half(&self.bounds[u]);
            add(self.smoothing / (half * half), self.states + u, self.states + u, 1.0);
        }
    }

    /// The term that smoothing adds for a control.
    pub(super) fn square(&self, u: usize) -> f64 {
        let (middle, half) = middle_and_half(&self.bounds[u]);
        0.5 * self.smoothing * ((self.z[self.states + u] - middle) / half).powi(2)
    }

    /// Bounds of the rows.
    pub(super) fn row_bounds(&self) -> impl Iterator<Item = Bounds> + '_ {
        self.rows.iter().flat_map(|(_, bounds)| bounds.iter().copied())
    }

    /// Controls between their bounds, then active rows.
    pub(super) fn working_set(&self) -> (Vec<usize>, Vec<usize>) {
        let free =
            |u: &usize| self.kinds[*u] != ControlKind::Switching && self.control_places[*u] == Place::Inside;
        let active =
            |(r, b): (usize, Bounds)| (b.is_fixed() || self.row_places[r] != Place::Inside).then_some(r);
        (
            (0..self.controls).filter(free).collect(),
            self.row_bounds().enumerate().filter_map(active).collect(),
        )
    }
}

/// Middle and half width of bounds, of one where a bound is missing.
fn middle_and_half(b: &Bounds) -> (f64, f64) {
    let half = 0.5 * (b.upper - b.lower);
    if half > 0.0 && half.is_finite() { (b.lower + half, half) } else { (b.representative(), 1.0) }
}

/// The angle plus whole turns that is nearest to another, so that it is continuous along a phase.
fn nearest_turn(angle: f64, to: f64) -> f64 {
    angle + TAU * ((to - angle) / TAU).round()
}
