//! The iteration.

use std::ops::ControlFlow;
use std::sync::Arc;

use apsides_basis::{Barycentric, chebyshev_lobatto};
use apsides_conic::Status as ConicStatus;
use apsides_iteration::{Evaluation, Flow, IterationRecord, Observer, Status};
use apsides_ocp::{
    Guess, Mesh, Ocp, PhaseTrajectory, PiecewisePolynomial, RowOrigin, Scaling, Segment, Trajectory, Unmet,
};
use apsides_ode::{Integrator, OdeSettings};

use super::flow::IntervalFlow;
use super::layout::Layout;
use super::linearisation::{LinearRow, Linearisation, Lineariser, RowKind, RowScales};
use super::settings::SuccessiveSettings;
use super::subproblem::Subproblem;
use crate::ConvexError;

/// One iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SuccessiveRecord {
    /// Objective in its own sense, at the point the step starts from.
    pub objective: f64,
    /// Largest violation there, in units of its scale.
    pub violation: f64,
    /// Decrease of the penalised objective that the convex model promises, in units of the objective's scale.
    pub predicted: f64,
    /// The decrease that came.
    pub actual: f64,
    /// Weight of the squared step.
    pub proximal_weight: f64,
    /// Price of violations.
    pub penalty: f64,
    /// Largest step, in units of the unknowns' scales.
    pub step: f64,
}

/// The result of a solve.
#[derive(Clone, Debug)]
pub struct SuccessiveSolution {
    /// The end of the solve. [`Status::Optimal`]: constraints are met, and the convex model promises no more; [`Status::Infeasible`]: it promises no
    /// more, but constraints are not met whatever the penalty; [`Status::StepTooSmall`]: the conic solver found no step;
    /// [`Status::EvaluationFailed`]: the equations of motion cannot be integrated from the guess.
    pub status: Status,
    /// The constraint that could not be met, of an infeasible problem.
    pub unmet: Option<Unmet>,
    /// The best point.
    pub trajectory: Trajectory,
    /// Largest violation, in units of its scale.
    pub violation: f64,
    /// Number of unknowns.
    pub variables: usize,
    /// Number of matching conditions and constraints.
    pub constraints: usize,
    /// Iterations.
    pub records: Vec<SuccessiveRecord>,
}

/// Successive convexification: settings and [`solve`](Self::solve).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SuccessiveConvexification {
    /// Settings.
    pub settings: SuccessiveSettings,
}

/// The weight of the squared step stays within these.
const WEIGHTS: [f64; 2] = [1e-6, 1e8];
const PENALTY_RAISES: usize = 5;
/// The penalty is so many times the largest multiplier once constraints are nearly met.
const PENALTY_MARGIN: f64 = 4.0;
const LEAST_PENALTY: f64 = 1e-2;
const NEARLY_MET: f64 = 1e-2;
/// Part of the promised decrease above which a step is good enough for a lighter weight; below it is corrected.
const GOOD: f64 = 0.8;
/// Polynomials of the states have this many nodes per interval.
const STATE_NODES: usize = 9;

impl SuccessiveConvexification {
    /// Solves a problem from a guess.
    ///
    /// # Errors
    /// [`ConvexError`] when settings or guess are ill-posed.
    pub fn solve(&self, ocp: &Ocp, guess: &Guess) -> Result<SuccessiveSolution, ConvexError> {
        self.solve_observed(ocp, guess, &mut ())
    }

    /// The same with an observer, which sees every iteration and can stop the solve.
    ///
    /// # Errors
    /// [`ConvexError`] when settings or guess are ill-posed.
    pub fn solve_observed(
        &self,
        ocp: &Ocp,
        guess: &Guess,
        observer: &mut dyn Observer,
    ) -> Result<SuccessiveSolution, ConvexError> {
        self.settings.check()?;
        guess.check(ocp)?;
        let layout = Layout::new(ocp, self.settings.intervals);
        let scales = layout.scales(&Scaling::new(ocp, guess));
        let lineariser = Lineariser::new(ocp, &layout, self.settings.integration_tolerance)?;
        let subproblem = Subproblem::new(ocp, &layout, scales.clone(), self.settings.conic);
        let mut z = layout.start(guess);
        subproblem.clamp(&mut z);
        Iteration::new(ocp, self.settings, lineariser, subproblem, scales, z, observer)?.run()
    }
}

struct Iteration<'a> {
    ocp: &'a Ocp,
    settings: SuccessiveSettings,
    lineariser: Lineariser<'a>,
    subproblem: Subproblem,
    scales: Vec<f64>,
    row_scales: RowScales,
    objective_scale: f64,
    records: Vec<SuccessiveRecord>,
    observer: &'a mut dyn Observer,
    /// The best point, and the rows there.
    z: Vec<f64>,
    here: Linearisation,
    step: Vec<f64>,
    /// The point that the step leads to, and the rows there.
    trial: Vec<f64>,
    there: Linearisation,
    /// The rows with their curvature along the step.
    corrected: Linearisation,
    penalty: f64,
    weight: f64,
    penalty_raises: usize,
}

/// The end of the iteration: its status, and the constraint that could not be met.
type End = ControlFlow<(Status, Option<Unmet>)>;

impl<'a> Iteration<'a> {
    fn new(
        ocp: &'a Ocp,
        settings: SuccessiveSettings,
        mut lineariser: Lineariser<'a>,
        subproblem: Subproblem,
        scales: Vec<f64>,
        z: Vec<f64>,
        observer: &'a mut dyn Observer,
    ) -> Result<Self, ConvexError> {
        let mut here = Linearisation::default();
        lineariser.evaluate(&z, &mut here)?;
        let row_scales = RowScales::new(ocp, &here, &scales, lineariser.layout);
        row_scales.apply(&mut here);
        let objective_scale = ocp.objective.scale.unwrap_or_else(|| objective_scale(&here, &scales));
        Ok(Self {
            ocp,
            settings,
            lineariser,
            subproblem,
            scales,
            row_scales,
            objective_scale,
            records: Vec::new(),
            observer,
            step: vec![0.0; z.len()],
            trial: z.clone(),
            z,
            here,
            there: Linearisation::default(),
            corrected: Linearisation::default(),
            penalty: settings.penalty,
            weight: settings.proximal_weight,
            penalty_raises: 0,
        })
    }

    fn run(mut self) -> Result<SuccessiveSolution, ConvexError> {
        let (status, unmet) = self.iterate()?;
        let violation = self.here.violation().1;
        let trajectory = self.trajectory(&self.z, &self.here)?;
        let (variables, constraints) = (self.z.len(), self.here.rows.len());
        let records = self.records;
        Ok(SuccessiveSolution { status, unmet, trajectory, violation, variables, constraints, records })
    }

    fn iterate(&mut self) -> Result<(Status, Option<Unmet>), ConvexError> {
        if !self.here.valid {
            return Ok((Status::EvaluationFailed(Evaluation::Constraints), None));
        }
        while self.here.valid && self.records.len() < self.settings.max_iterations {
            if let ControlFlow::Break(end) = self.advance()? {
                return Ok(end);
            }
        }
        Ok((Status::IterationLimit, None))
    }

    /// One iteration: a step of the convex model, judged by the rows where it leads.
    fn advance(&mut self) -> Result<End, ConvexError> {
        let before = self.merit(&self.here);
        let prices = (self.penalty, self.weight);
        let (conic, model, price) =
            self.subproblem.solve(&self.z, &self.here, self.objective_scale, prices, &mut self.step)?;
        let sizes = self.step.iter().zip(&self.scales).map(|(d, s)| (d / s).abs());
        let mut record = SuccessiveRecord {
            objective: self.lineariser.sign() * self.here.objective,
            violation: self.here.violation().1,
            predicted: before - model,
            actual: f64::NAN,
            proximal_weight: self.weight,
            penalty: self.penalty,
            step: sizes.fold(0.0, f64::max),
        };
        if !conic.has_solution() {
            return Ok(self.follow_no_step(record, conic));
        }
        // A heavy weight makes every promise small.
        if record.predicted * self.weight.max(1.0) <= self.settings.tolerance {
            return Ok(self.follow_no_promise(record));
        }
        record.actual = self.go(before)?;
        if self.there.valid && record.actual < GOOD * record.predicted {
            self.corrected.correct(&self.here, &self.there, &self.step);
            let rows = &self.corrected;
            let (conic, ..) =
                self.subproblem.solve(&self.z, rows, self.objective_scale, prices, &mut self.step)?;
            if conic.has_solution() {
                record.actual = self.go(before)?;
            }
        }
        Ok(self.judge(record, price))
    }

    fn merit(&self, rows: &Linearisation) -> f64 {
        rows.objective / self.objective_scale + self.penalty * rows.violation().0
    }

    /// Shortens the next step where the conic solver found none.
    fn follow_no_step(&mut self, record: SuccessiveRecord, conic: ConicStatus) -> End {
        let flow = self.record(record);
        if self.weight >= WEIGHTS[1] || conic == ConicStatus::Infeasible {
            return ControlFlow::Break((Status::StepTooSmall, None));
        }
        if flow == Flow::Stop {
            return ControlFlow::Break((Status::Interrupted, None));
        }
        self.weight = (10.0 * self.weight).min(WEIGHTS[1]);
        ControlFlow::Continue(())
    }

    /// Ends where the convex model promises no more, unless a larger penalty may still meet the constraints.
    fn follow_no_promise(&mut self, record: SuccessiveRecord) -> End {
        let flow = self.record(record);
        let (_, worst, at) = self.here.violation();
        if worst <= self.settings.feasibility_tolerance {
            return ControlFlow::Break((Status::Optimal, None));
        }
        if self.penalty_raises == PENALTY_RAISES {
            let unmet = self.unmet(&self.here.rows[at], &self.z);
            return ControlFlow::Break((Status::Infeasible, Some(unmet)));
        }
        if flow == Flow::Stop {
            return ControlFlow::Break((Status::Interrupted, None));
        }
        self.penalty_raises += 1;
        self.penalty *= 10.0;
        ControlFlow::Continue(())
    }

    /// Accepts or rejects the step, and chooses weight and penalty of the next one.
    fn judge(&mut self, record: SuccessiveRecord, price: f64) -> End {
        let ratio = record.actual / record.predicted;
        let flow = self.record(record);
        if ratio > 0.05 {
            std::mem::swap(&mut self.here, &mut self.there);
            std::mem::swap(&mut self.z, &mut self.trial);
        }
        if flow == Flow::Stop {
            return ControlFlow::Break((Status::Interrupted, None));
        }
        let factor = match ratio {
            r if r > GOOD => 0.25,
            r if r > 0.5 => 0.6,
            r if r > 0.2 => 1.5,
            _ => 4.0,
        };
        self.weight = (self.weight * factor).clamp(WEIGHTS[0], WEIGHTS[1]);
        // A penalty far above the multipliers makes every curvature of a constraint look large.
        if self.penalty_raises == 0 && self.here.violation().1 < NEARLY_MET {
            // The user's own may be below the least.
            self.penalty = (PENALTY_MARGIN * price).max(LEAST_PENALTY).min(self.settings.penalty);
        }
        ControlFlow::Continue(())
    }

    /// Keeps the record of an iteration and shows it to the observer.
    fn record(&mut self, record: SuccessiveRecord) -> Flow {
        let iteration = self.records.len();
        self.records.push(record);
        self.observer.iteration(&IterationRecord {
            iteration,
            objective: record.objective,
            primal_infeasibility: record.violation,
            dual_infeasibility: record.predicted,
            step_norm: record.step,
            regularisation: record.proximal_weight,
            ..IterationRecord::default()
        })
    }

    /// Takes the step and evaluates the rows there: the decrease of the merit, none where they cannot be evaluated.
    fn go(&mut self, before: f64) -> Result<f64, ConvexError> {
        for ((t, z), d) in self.trial.iter_mut().zip(&self.z).zip(&self.step) {
            *t = z + d;
        }
        self.subproblem.clamp(&mut self.trial);
        self.lineariser.evaluate(&self.trial, &mut self.there)?;
        self.row_scales.apply(&mut self.there);
        Ok(if self.there.valid { before - self.merit(&self.there) } else { f64::NEG_INFINITY })
    }

    fn unmet(&self, row: &LinearRow, z: &[f64]) -> Unmet {
        let phase = &self.ocp.phases[row.phase];
        let p = &self.lineariser.layout.phases[row.phase];
        let [t0, tf] = [z[p.times()], z[p.times() + 1]];
        let time = t0 + (tf - t0) * row.node as f64 / p.intervals as f64;
        let named = |name: String, unit: &str, time| RowOrigin {
            phase: Some(phase.name.clone()),
            name,
            unit: unit.into(),
            time,
        };
        let origin = match row.kind {
            RowKind::Motion(s) => {
                let state = &phase.states[s].variable;
                named(format!("equation of motion of {}", state.name), &state.unit, Some(time))
            }
            RowKind::Path(row) => match phase.path.iter().flat_map(|c| &c.rows).nth(row) {
                Some(v) => named(v.name.clone(), &v.unit, Some(time)),
                None => named(format!("path constraint {row}"), "", Some(time)),
            },
            RowKind::Integral(q) => {
                let v = &phase.integrals[q].variable;
                named(v.name.clone(), &v.unit, None)
            }
            RowKind::Endpoint(c, r) => {
                let constraint = &self.ocp.constraints[c];
                let row = &constraint.rows[r];
                let name = format!("{}: {}", constraint.name, row.name);
                RowOrigin { phase: None, name, unit: row.unit.clone(), time: None }
            }
        };
        let below = row.value < row.bounds.lower;
        let amount = if below { row.value - row.bounds.lower } else { row.value - row.bounds.upper };
        Unmet { origin, amount }
    }

    fn trajectory(&self, z: &[f64], rows: &Linearisation) -> Result<Trajectory, ConvexError> {
        let layout = self.lineariser.layout;
        let basis = |nodes: &[f64]| Barycentric::new(nodes).map(Arc::new);
        let nodes = chebyshev_lobatto(STATE_NODES)?;
        let (smooth, linear) = (basis(&nodes)?, basis(&[-1.0, 1.0])?);
        let mesh = Mesh::uniform(self.ocp, self.settings.intervals, 2)?;
        let mut phases = Vec::new();
        for ((phase, p), mesh) in self.ocp.phases.iter().zip(&layout.phases).zip(mesh.phases) {
            let (nx, nu) = (p.states, p.controls);
            let mut flow = IntervalFlow::new(phase, layout.parameters);
            let settings = OdeSettings::with_tolerance(self.settings.integration_tolerance);
            let mut integrator = Integrator::new(flow.outputs(), settings)?;
            let [t0, tf] = [z[p.times()], z[p.times() + 1]];
            let (mut states, mut controls) = (Vec::new(), Vec::new());
            flow.width = 1.0 / p.intervals as f64;
            for k in 0..p.intervals {
                flow.start = k as f64 * flow.width;
                let u: Vec<f64> =
                    [k, k + 1].iter().flat_map(|&n| &z[p.control(n)..][..nu]).copied().collect();
                flow.inputs[..2 * nu].copy_from_slice(&u);
                let rest = flow.inputs.len() - 2;
                flow.inputs[2 * nu..rest].copy_from_slice(&z[layout.first_parameter..]);
                flow.inputs[rest..].copy_from_slice(&[t0, tf]);
                let mut x = vec![0.0; flow.outputs()];
                x[..nx].copy_from_slice(&z[p.state(k)..][..nx]);
                let mut values = x[..nx].to_vec();
                for w in nodes.windows(2) {
                    let from = x.clone();
                    integrator.integrate(&flow, 0.5 * (w[0] + 1.0), &from, 0.5 * (w[1] + 1.0), &mut x)?;
                    values.extend_from_slice(&x[..nx]);
                }
                states.push(Segment { basis: Arc::clone(&smooth), values });
                controls.push(Segment { basis: Arc::clone(&linear), values: u });
            }
            let breaks: Vec<f64> = mesh.fractions().iter().map(|f| t0 * (1.0 - f) + tf * f).collect();
            phases.push(PhaseTrajectory {
                name: phase.name.clone(),
                initial_time: t0,
                final_time: tf,
                state: PiecewisePolynomial::new(nx, breaks.clone(), states)?,
                control: PiecewisePolynomial::new(nu, breaks, controls)?,
                mesh,
                costate: None,
                path_multipliers: None,
                contacts: Vec::new(),
                integral_multipliers: None,
                interval_errors: vec![0.0; p.intervals],
            });
        }
        Ok(Trajectory {
            phases,
            parameters: z[layout.first_parameter..].to_vec(),
            objective: self.lineariser.sign() * rows.objective,
            constraint_multipliers: None,
        })
    }
}

/// The largest change that a step of unit size makes.
fn objective_scale(rows: &Linearisation, scales: &[f64]) -> f64 {
    let reach = rows.gradient.iter().zip(scales).map(|(g, s)| (g * s).abs()).fold(0.0, f64::max);
    let size = reach.max(rows.objective.abs());
    if size > 0.0 && size.is_finite() { size } else { 1.0 }
}
