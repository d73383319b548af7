//! The iteration.

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
        let records = Vec::new();
        Iteration { ocp, settings: self.settings, lineariser, subproblem, scales, records, observer }.run(z)
    }
}

struct Iteration<'a> {
    ocp: &'a Ocp,
    settings: SuccessiveSettings,
    lineariser: Lineariser<'a>,
    subproblem: Subproblem,
    scales: Vec<f64>,
    records: Vec<SuccessiveRecord>,
    observer: &'a mut dyn Observer,
}

impl Iteration<'_> {
    fn run(mut self, mut z: Vec<f64>) -> Result<SuccessiveSolution, ConvexError> {
        let s = self.settings;
        let (mut here, mut there, mut corrected) =
            (Linearisation::default(), Linearisation::default(), Linearisation::default());
        self.lineariser.evaluate(&z, &mut here)?;
        let row_scales = RowScales::new(self.ocp, &here, &self.scales, self.lineariser.layout);
        row_scales.apply(&mut here);
        let scale = self.ocp.objective.scale.unwrap_or_else(|| self.objective_scale(&here));
        let (mut penalty, mut weight, mut raises) = (s.penalty, s.proximal_weight, 0);
        let mut step = vec![0.0; z.len()];
        let mut trial = z.clone();
        let mut status = if here.valid {
            Status::IterationLimit
        } else {
            Status::EvaluationFailed(Evaluation::Constraints)
        };
        let mut unmet = None;
        while here.valid && self.records.len() < s.max_iterations {
            let merit = |rows: &Linearisation| rows.objective / scale + penalty * rows.violation().0;
            let before = merit(&here);
            let (conic, model, price) =
                self.subproblem.solve(&z, &here, scale, (penalty, weight), &mut step)?;
            let mut record = SuccessiveRecord {
                objective: self.lineariser.sign() * here.objective,
                violation: here.violation().1,
                predicted: before - model,
                actual: f64::NAN,
                proximal_weight: weight,
                penalty,
                step: step.iter().zip(&self.scales).map(|(d, s)| (d / s).abs()).fold(0.0, f64::max),
            };
            if !conic.has_solution() {
                let flow = self.record(record);
                if weight >= WEIGHTS[1] || conic == ConicStatus::Infeasible {
                    status = Status::StepTooSmall;
                    break;
                }
                if flow == Flow::Stop {
                    status = Status::Interrupted;
                    break;
                }
                weight = (10.0 * weight).min(WEIGHTS[1]);
                continue;
            }
            // A heavy weight makes every promise small.
            if record.predicted * weight.max(1.0) <= s.tolerance {
                let flow = self.record(record);
                let (_, worst, at) = here.violation();
                if worst <= s.feasibility_tolerance {
                    status = Status::Optimal;
                    break;
                }
                if raises == PENALTY_RAISES {
                    status = Status::Infeasible;
                    unmet = Some(self.unmet(&here.rows[at], &z));
                    break;
                }
                if flow == Flow::Stop {
                    status = Status::Interrupted;
                    break;
                }
                raises += 1;
                penalty *= 10.0;
                continue;
            }
            self.go(&z, &step, &mut trial, &mut there, &row_scales)?;
            record.actual = if there.valid { before - merit(&there) } else { f64::NEG_INFINITY };
            if there.valid && record.actual < GOOD * record.predicted {
                corrected.correct(&here, &there, &step);
                let (conic, ..) =
                    self.subproblem.solve(&z, &corrected, scale, (penalty, weight), &mut step)?;
                if conic.has_solution() {
                    self.go(&z, &step, &mut trial, &mut there, &row_scales)?;
                    let actual = if there.valid { before - merit(&there) } else { f64::NEG_INFINITY };
                    record.actual = actual;
                }
            }
            let ratio = record.actual / record.predicted;
            let flow = self.record(record);
            if ratio > 0.05 {
                std::mem::swap(&mut here, &mut there);
                std::mem::swap(&mut z, &mut trial);
            }
            if flow == Flow::Stop {
                status = Status::Interrupted;
                break;
            }
            let factor = match ratio {
                r if r > GOOD => 0.25,
                r if r > 0.5 => 0.6,
                r if r > 0.2 => 1.5,
                _ => 4.0,
            };
            weight = (weight * factor).clamp(WEIGHTS[0], WEIGHTS[1]);
            // A penalty far above the multipliers makes every curvature of a constraint look large.
            if raises == 0 && here.violation().1 < NEARLY_MET {
                // The user's own may be below the least.
                penalty = (PENALTY_MARGIN * price).max(LEAST_PENALTY).min(s.penalty);
            }
        }
        let violation = here.violation().1;
        let trajectory = self.trajectory(&z, &here)?;
        let (variables, constraints) = (z.len(), here.rows.len());
        let records = self.records;
        Ok(SuccessiveSolution { status, unmet, trajectory, violation, variables, constraints, records })
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

    /// Takes a step and evaluates the rows there.
    fn go(
        &mut self,
        z: &[f64],
        step: &[f64],
        trial: &mut [f64],
        there: &mut Linearisation,
        scales: &RowScales,
    ) -> Result<(), ConvexError> {
        for ((t, z), d) in trial.iter_mut().zip(z).zip(step) {
            *t = z + d;
        }
        self.subproblem.clamp(trial);
        self.lineariser.evaluate(trial, there)?;
        scales.apply(there);
        Ok(())
    }

    /// The largest change that a step of unit size makes.
    fn objective_scale(&self, rows: &Linearisation) -> f64 {
        let reach = rows.gradient.iter().zip(&self.scales).map(|(g, s)| (g * s).abs()).fold(0.0, f64::max);
        let size = reach.max(rows.objective.abs());
        if size > 0.0 && size.is_finite() { size } else { 1.0 }
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
