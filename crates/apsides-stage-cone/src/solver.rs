//! The interior-point method: homogeneous self-dual embedding, Nesterov-Todd scaling, predictor and corrector.
//!
//! ```text
//! F'y - R'z + c tau = 0,   F w = f tau,   s = R w + a tau,   c'w + f'y + a'z + kappa = 0,   s, z in K,  tau, kappa >= 0
//! ```
//!
//! A solution with `tau > 0` gives the optimum, one with `kappa > 0` a certificate that there is none.

use crate::error::StageError;
use crate::report::{StageReport, Status};
use crate::riccati::{EndSystem, factor, solve};
use crate::settings::StageSettings;
use crate::stage::{Stage, StageProgram};
use crate::work::{Direction, StageWork};

/// A step stays away from the boundary by this part of what the predictor's step lacks of a whole one, and by the least part at least: points
/// beside it are badly centred, and the steps after them short, or the systems there too badly conditioned.
const AWAY: f64 = 0.1;
const LEAST_AWAY: f64 = 1e-2;
/// Least part of the mean complementarity that the corrector aims at.
const LEAST_CENTRING: f64 = 1e-4;
/// Longest step that is looked for: one that stays away from the boundary is still whole.
const LONGEST: f64 = 1.0 / (1.0 - AWAY);
/// Residual of the linear system, as part of that which a solution may have.
const ACCURACY: f64 = 1e-2;
/// Shortest step that counts as progress.
const SHORTEST: f64 = 1e-7;
/// Gap and residuals that a reduced solution may have.
const REDUCED: [f64; 2] = [5e-5, 1e-4];

/// Residual of a certificate that is rounding, as part of its largest number, and the largest part of its value that such a residual may have.
const ROUNDING: f64 = 16.0 * f64::EPSILON;
const CERTAIN: f64 = 1e-6;

/// Norms of the data that residuals are held against.
#[derive(Clone, Copy, Debug)]
struct Sizes {
    cost: f64,
    constants: f64,
}

/// Scalars of an iterate.
#[derive(Clone, Copy, Debug)]
struct Iterate<const NE: usize> {
    tau: f64,
    kappa: f64,
    end: [f64; NE],
}

/// Residuals and objectives at an iterate, not yet divided by `tau`.
#[derive(Clone, Copy, Debug)]
struct Measures<const NE: usize> {
    end: [f64; NE],
    gap: f64,
    /// `s'z`.
    complementarity: f64,
    /// `c'w`, `f'y + a'z`.
    cost: f64,
    price: f64,
    /// Largest `F'y - R'z + c tau`, `F'y - R'z`.
    dual: f64,
    homogeneous_dual: f64,
    /// Largest `F w - f tau`, `s - R w - a tau`, and without `tau`.
    primal: f64,
    homogeneous_primal: f64,
    /// Largest of variables and slacks, and of multipliers.
    variables: f64,
    multipliers: f64,
}

/// Solves a program in a workspace of as many stages, and leaves the solution there. Nothing is allocated; the number of iterations is limited,
/// and the most work of one depends on sizes alone.
///
/// # Errors
/// [`StageError`] when data or settings are ill-posed.
pub fn solve_stages<const NX: usize, const NW: usize, const NR: usize, const NE: usize>(
    program: &StageProgram<'_, NX, NW, NR, NE>,
    work: &mut [StageWork<NX, NW, NR, NE>],
    settings: &StageSettings,
) -> Result<StageReport<NE>, StageError> {
    settings.check()?;
    program.check()?;
    let (stages, workspace) = (program.stages.len(), work.len());
    if stages != workspace {
        return Err(StageError::Workspace { stages, workspace });
    }
    Ok(in_vectors(Solver {
        program,
        work,
        settings,
        system: EndSystem::ZERO,
        iterate: Iterate { tau: 1.0, kappa: 1.0, end: [0.0; NE] },
        ahead: 0.0,
    }))
}

/// Runs with the vector instructions that the machine has. All functions on the way are inlined, so that they are compiled for these; none joins
/// multiplications and additions, so that every machine has the same bits.
#[cfg(feature = "std")]
fn in_vectors<const NX: usize, const NW: usize, const NR: usize, const NE: usize>(
    solver: Solver<'_, '_, NX, NW, NR, NE>,
) -> StageReport<NE> {
    pulp::Arch::new().dispatch(solver)
}

#[cfg(not(feature = "std"))]
fn in_vectors<const NX: usize, const NW: usize, const NR: usize, const NE: usize>(
    solver: Solver<'_, '_, NX, NW, NR, NE>,
) -> StageReport<NE> {
    solver.run()
}

#[cfg(feature = "std")]
impl<const NX: usize, const NW: usize, const NR: usize, const NE: usize> pulp::WithSimd
    for Solver<'_, '_, NX, NW, NR, NE>
{
    type Output = StageReport<NE>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> StageReport<NE> {
        self.run()
    }
}

struct Solver<'a, 'b, const NX: usize, const NW: usize, const NR: usize, const NE: usize> {
    program: &'a StageProgram<'b, NX, NW, NR, NE>,
    work: &'a mut [StageWork<NX, NW, NR, NE>],
    settings: &'a StageSettings,
    system: EndSystem<NE>,
    iterate: Iterate<NE>,
    /// Step that the stages have not gone yet.
    ahead: f64,
}

impl<const NX: usize, const NW: usize, const NR: usize, const NE: usize> Solver<'_, '_, NX, NW, NR, NE> {
    #[inline(always)]
    fn run(mut self) -> StageReport<NE> {
        let sizes = self.sizes();
        let degree = self.program.stages.iter().map(|s| s.cones().degree()).sum::<usize>() + 1;
        let mut iterations = 0;
        let started = self.start();
        loop {
            let measures = self.measure();
            let mut report = self.judge(&measures, &sizes);
            report.iterations = iterations;
            if matches!(report.status, Status::Solved | Status::Infeasible | Status::Unbounded) {
                return self.finish(report, &measures);
            }
            if iterations == self.settings.max_iterations {
                return self.give_up(report, &measures, Status::IterationLimit);
            }
            let size = (sizes.cost * self.iterate.tau + measures.multipliers).max(self.iterate.tau);
            // A certificate is held against its own value.
            let size = if measures.price < 0.0 && self.iterate.kappa > self.iterate.tau {
                size.min(-measures.price)
            } else {
                size
            };
            let tolerance = ACCURACY * self.settings.feasibility_tolerance * size;
            if !started || !self.advance(&measures, tolerance, degree) {
                return self.give_up(report, &measures, Status::Stalled);
            }
            iterations += 1;
        }
    }

    fn sizes(&self) -> Sizes {
        let mut sizes = Sizes { cost: 0.0, constants: largest(0.0, &self.program.start) };
        sizes.constants = largest(sizes.constants, &self.program.end_values);
        let last = self.program.stages.len() - 1;
        for (k, stage) in self.program.stages.iter().enumerate() {
            sizes.cost = largest(sizes.cost, &stage.cost);
            sizes.constants = largest(sizes.constants, &stage.constants[..stage.length]);
            if k < last {
                sizes.constants = largest(sizes.constants, &stage.offset);
            }
        }
        sizes
    }

    /// The point of least squares of the rows, and the least multipliers, moved into the cones.
    #[inline(always)]
    fn start(&mut self) -> bool {
        let stages = self.program.stages;
        for (work, stage) in self.work.iter_mut().zip(stages) {
            *work = StageWork::ZERO;
            work.scaling.reset(stage.cones());
        }
        if !factor(self.program, self.work, &mut self.system, false) {
            return false;
        }
        for k in 0..stages.len() {
            let (stage, right) = (&stages[k], &mut self.work[k].right);
            right.z[..stage.length].copy_from_slice(&stage.constants[..stage.length]);
            right.y = if k == 0 { self.program.start } else { stages[k - 1].offset };
        }
        let mut ends = self.program.end_values;
        solve(self.program, self.work, &self.system, &mut ends, f64::INFINITY);
        let (mut primal, mut dual) = (f64::INFINITY, f64::INFINITY);
        for (work, stage) in self.work.iter_mut().zip(stages) {
            work.point.w = work.step.w;
            work.slack = work.step.z.map(|z| -z);
            primal = primal.min(stage.cones().margin(&work.slack));
            work.right = Direction { w: stage.cost.map(|c| -c), ..Direction::ZERO };
        }
        self.iterate.end.fill(0.0);
        solve(self.program, self.work, &self.system, &mut self.iterate.end, f64::INFINITY);
        for (work, stage) in self.work.iter_mut().zip(stages) {
            (work.point.y, work.point.z) = (work.step.y, work.step.z);
            dual = dual.min(stage.cones().margin(&work.point.z));
        }
        let shift = |margin: f64| if margin > 0.0 { 0.0 } else { 1.0 - margin };
        for (work, stage) in self.work.iter_mut().zip(stages) {
            stage.cones().add_unit(shift(primal), &mut work.slack);
            stage.cones().add_unit(shift(dual), &mut work.point.z);
        }
        true
    }

    /// Goes the step ahead, and measures where that leads.
    #[inline(always)]
    fn measure(&mut self) -> Measures<NE> {
        let ahead = core::mem::take(&mut self.ahead);
        self.work[0].go(ahead);
        let Iterate { tau, kappa, end } = self.iterate;
        let program = self.program;
        let controls = NW - NX;
        let mut m = Measures {
            end: [0.0; NE],
            gap: 0.0,
            complementarity: 0.0,
            cost: 0.0,
            price: inner(&program.end_values, &end),
            dual: 0.0,
            homogeneous_dual: 0.0,
            primal: 0.0,
            homogeneous_primal: 0.0,
            variables: 0.0,
            multipliers: largest(0.0, &end),
        };
        let last = program.stages.len() - 1;
        let mut state = [0.0; NX];
        let mut origin = program.start;
        for (k, stage) in program.stages.iter().enumerate() {
            let next = self.work.get_mut(k + 1).map(|next| {
                next.go(ahead);
                next.point.y
            });
            let work = &mut self.work[k];
            let point = &work.point;
            m.cost += inner(&stage.cost, &point.w);
            m.price += inner(&origin, &point.y);
            m.multipliers = largest(m.multipliers, &point.y);
            m.variables = largest(m.variables, &point.w);
            let mut dual = [0.0; NW];
            dual[controls..].copy_from_slice(&point.y);
            stage.subtract_transposed(&point.z, &mut dual);
            if let Some(next) = next {
                stage.add_dynamics_transposed(&next.map(|y| -y), &mut dual);
            } else {
                for (e, row) in program.end.iter().enumerate() {
                    m.end[e] = inner(row, &point.w[controls..]);
                    for i in 0..NX {
                        dual[controls + i] += row[i] * end[e];
                    }
                }
            }
            m.homogeneous_dual = largest(m.homogeneous_dual, &dual);
            for i in 0..NW {
                dual[i] += stage.cost[i] * tau;
                if i < controls && !stage.controls[i] {
                    dual[i] = 0.0;
                }
            }
            m.dual = largest(m.dual, &dual);
            work.residual.w = dual;
            for i in 0..NX {
                let homogeneous = point.w[controls + i] - state[i];
                m.homogeneous_primal = m.homogeneous_primal.max(homogeneous.abs());
                work.residual.y[i] = homogeneous - origin[i] * tau;
            }
            m.primal = largest(m.primal, &work.residual.y);
            for r in 0..stage.length {
                let (s, z, a) = (work.slack[r], point.z[r], stage.constants[r]);
                let homogeneous = s - stage.rows[r].dot(&point.w);
                let residual = homogeneous - a * tau;
                m.price += a * z;
                m.complementarity += s * z;
                m.homogeneous_primal = m.homogeneous_primal.max(homogeneous.abs());
                m.primal = m.primal.max(residual.abs());
                m.variables = m.variables.max(s.abs());
                m.multipliers = m.multipliers.max(z.abs());
                work.residual.z[r] = residual;
            }
            if k < last {
                for (state, row) in state.iter_mut().zip(&stage.dynamics) {
                    *state = row.dot(&point.w);
                }
                origin = stage.offset;
            }
        }
        m.homogeneous_primal = largest(m.homogeneous_primal, &m.end);
        for (end, value) in m.end.iter_mut().zip(&program.end_values) {
            *end -= value * tau;
        }
        m.primal = largest(m.primal, &m.end);
        m.gap = m.cost + m.price + kappa;
        m
    }

    fn judge(&self, m: &Measures<NE>, sizes: &Sizes) -> StageReport<NE> {
        let tau = self.iterate.tau;
        let (objective, dual_objective) = (m.cost / tau, -m.price / tau);
        let primal_residual = m.primal / tau / (sizes.constants + m.variables / tau).max(1.0);
        let dual_residual = m.dual / tau / (sizes.cost + m.multipliers / tau).max(1.0);
        let mut report = StageReport {
            status: Status::IterationLimit,
            iterations: 0,
            objective,
            dual_objective,
            primal_residual,
            dual_residual,
            certificate_residual: f64::NAN,
            end_multipliers: self.iterate.end,
        };
        let gap = relative_gap(objective, dual_objective);
        let feasible = self.settings.feasibility_tolerance;
        if gap <= self.settings.gap_tolerance && primal_residual.max(dual_residual) <= feasible {
            report.status = Status::Solved;
        } else if is_certain(m.price, m.homogeneous_dual, m.multipliers, feasible) {
            report.status = Status::Infeasible;
            report.certificate_residual = -m.homogeneous_dual / m.price;
            (report.objective, report.dual_objective) = (f64::INFINITY, f64::INFINITY);
        } else if is_certain(m.cost, m.homogeneous_primal, m.variables, feasible) {
            report.status = Status::Unbounded;
            report.certificate_residual = -m.homogeneous_primal / m.cost;
            (report.objective, report.dual_objective) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        }
        report
    }

    fn give_up(self, mut report: StageReport<NE>, m: &Measures<NE>, status: Status) -> StageReport<NE> {
        let gap = relative_gap(report.objective, report.dual_objective);
        let reduced = gap <= REDUCED[0] && report.primal_residual.max(report.dual_residual) <= REDUCED[1];
        report.status = if reduced { Status::SolvedReduced } else { status };
        self.finish(report, m)
    }

    /// Brings the solution, or the certificate, to its size.
    fn finish(self, mut report: StageReport<NE>, m: &Measures<NE>) -> StageReport<NE> {
        let by = match report.status {
            Status::Infeasible => -m.price,
            Status::Unbounded => -m.cost,
            _ => self.iterate.tau,
        };
        for work in self.work.iter_mut() {
            let point = &mut work.point;
            let values = point.w.iter_mut().chain(&mut point.y).chain(&mut point.z).chain(&mut work.slack);
            values.for_each(|v| *v /= by);
        }
        report.end_multipliers.iter_mut().for_each(|v| *v /= by);
        report
    }

    #[inline(always)]
    fn advance(&mut self, m: &Measures<NE>, tolerance: f64, degree: usize) -> bool {
        let stages = self.program.stages;
        if !factor(self.program, self.work, &mut self.system, true) {
            return false;
        }
        let mut constant = self.program.end_values;
        for k in 0..stages.len() {
            let (stage, right) = (&stages[k], &mut self.work[k].right);
            right.w = stage.cost.map(|c| -c);
            right.y = if k == 0 { self.program.start } else { stages[k - 1].offset };
            right.z = stage.constants;
        }
        let share = solve(self.program, self.work, &self.system, &mut constant, tolerance);
        // Predictor.
        for work in self.work.iter_mut() {
            work.constant = work.step;
            let r = &work.residual;
            work.right.w = r.w.map(|v| -v);
            work.right.y = r.y.map(|v| -v);
            for (i, z) in work.right.z.iter_mut().enumerate() {
                *z = work.slack[i] - r.z[i];
            }
        }
        let mut end = m.end.map(|v| -v);
        let value = solve(self.program, self.work, &self.system, &mut end, f64::INFINITY);
        let Iterate { tau, kappa, .. } = self.iterate;
        let below = kappa / tau - share;
        let tau_predicted = (m.gap - kappa + value) / below;
        let kappa_predicted = -kappa - kappa / tau * tau_predicted;
        let step = self.predict(tau_predicted, kappa_predicted);
        if !tau_predicted.is_finite() {
            return false;
        }
        let rest = 1.0 - step.min(1.0);
        let sigma = (rest * rest).max(LEAST_CENTRING);
        let mean = (m.complementarity + kappa * tau) / degree as f64;
        let keep = 1.0 - sigma;
        // Corrector.
        for (work, stage) in self.work.iter_mut().zip(stages) {
            let r = &work.residual;
            let mut corrected = work.step.z;
            work.scaling.correct(stage.cones(), sigma * mean, &mut corrected);
            work.right.w = r.w.map(|v| -keep * v);
            work.right.y = r.y.map(|v| -keep * v);
            for (i, z) in work.right.z.iter_mut().enumerate() {
                *z = work.slack[i] - keep * r.z[i] - corrected[i];
            }
        }
        let mut end = m.end.map(|v| -keep * v);
        let value = solve(self.program, self.work, &self.system, &mut end, tolerance);
        let product = sigma * mean - kappa * tau - kappa_predicted * tau_predicted;
        let tau_step = (keep * m.gap + product / tau + value) / below;
        let kappa_step = (product - kappa * tau_step) / tau;
        let part = 1.0 - (AWAY * rest).max(LEAST_AWAY);
        let step = (part * self.join(tau_step, kappa_step, keep)).min(1.0);
        if !(step > SHORTEST && tau_step.is_finite()) {
            return false;
        }
        self.ahead = step;
        for e in 0..NE {
            self.iterate.end[e] += step * (end[e] + tau_step * constant[e]);
        }
        self.iterate.tau += step * tau_step;
        self.iterate.kappa += step * kappa_step;
        true
    }

    /// Adds the part of `tau` to the predictor of variables and multipliers. Returns the longest step within the cones, at most [`LONGEST`].
    #[inline(always)]
    fn predict(&mut self, tau_step: f64, kappa_step: f64) -> f64 {
        let mut step = self.scalar_step(tau_step, kappa_step);
        for (work, stage) in self.work.iter_mut().zip(self.program.stages) {
            add(tau_step, &work.constant.w, &mut work.step.w);
            add(tau_step, &work.constant.z, &mut work.step.z);
            step = work.longest(stage, tau_step, 1.0, step);
        }
        step
    }

    /// Adds the part of `tau` to the step. Returns as [`predict`](Self::predict).
    #[inline(always)]
    fn join(&mut self, tau_step: f64, kappa_step: f64, keep: f64) -> f64 {
        let mut step = self.scalar_step(tau_step, kappa_step);
        for (work, stage) in self.work.iter_mut().zip(self.program.stages) {
            add(tau_step, &work.constant.w, &mut work.step.w);
            add(tau_step, &work.constant.y, &mut work.step.y);
            add(tau_step, &work.constant.z, &mut work.step.z);
            step = work.longest(stage, tau_step, keep, step);
        }
        step
    }

    #[inline(always)]
    fn scalar_step(&self, tau_step: f64, kappa_step: f64) -> f64 {
        let mut step = LONGEST;
        for (v, d) in [(self.iterate.tau, tau_step), (self.iterate.kappa, kappa_step)] {
            if v + step * d < 0.0 {
                step = -v / d;
            }
        }
        step
    }
}

impl<const NX: usize, const NW: usize, const NR: usize, const NE: usize> StageWork<NX, NW, NR, NE> {
    /// The step of the slacks, by which their residuals fall to one part less `keep`; the longest step within the cones, at most `step`.
    #[inline(always)]
    fn longest(&mut self, stage: &Stage<NX, NW, NR>, tau_step: f64, keep: f64, step: f64) -> f64 {
        for r in 0..stage.length {
            let moved = stage.rows[r].dot(&self.step.w) + stage.constants[r] * tau_step;
            self.slack_step[r] = moved - keep * self.residual.z[r];
        }
        let cones = stage.cones();
        let step = cones.largest_step(&self.slack, &self.slack_step, step);
        cones.largest_step(&self.point.z, &self.step.z, step)
    }

    /// Goes a step.
    #[inline(always)]
    fn go(&mut self, step: f64) {
        add(step, &self.step.w, &mut self.point.w);
        add(step, &self.step.y, &mut self.point.y);
        add(step, &self.step.z, &mut self.point.z);
        add(step, &self.slack_step, &mut self.slack);
    }
}

/// True for a certificate of a value whose residual is tolerated, or is what rounding leaves of numbers of a size.
fn is_certain(value: f64, residual: f64, size: f64, tolerance: f64) -> bool {
    value < 0.0 && (residual <= -tolerance * value || residual <= (ROUNDING * size).min(-CERTAIN * value))
}

fn relative_gap(objective: f64, dual: f64) -> f64 {
    (objective - dual).abs() / objective.abs().min(dual.abs()).max(1.0)
}

#[inline(always)]
fn largest(most: f64, values: &[f64]) -> f64 {
    values.iter().fold(most, |m, v| if v.abs() > m || v.is_nan() { v.abs() } else { m })
}

#[inline(always)]
fn inner(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[inline(always)]
fn add(factor: f64, direction: &[f64], out: &mut [f64]) {
    for (out, d) in out.iter_mut().zip(direction) {
        *out += factor * d;
    }
}
