//! The method: from a start with costates to a solution of the necessary conditions.

use apsides_nlp::{Observer, Status};
use apsides_ocp::method::Exceeded;
use apsides_ocp::{Guess, Ocp, PhaseGuess, Scaling, Trajectory};

use super::conditions::{Conditions, FailedSegment, PhaseFlight};
use super::ends::{self, Ends};
use super::extraction::{self, Extremal};
use super::flow::Flow;
use super::hamiltonian::{ControlSwitch, Hamiltonian};
use super::layout::MultipointLayout;
use super::newton::{self, Ended};
use super::settings::IndirectSettings;
use super::start::{IndirectStart, PhaseStart};
use crate::ShootingError;

/// Shooting by Pontryagin's conditions.
#[derive(Clone, Debug, Default)]
pub struct IndirectShooting {
    /// Settings.
    pub settings: IndirectSettings,
}

/// A solution of the necessary conditions, or the best point reached.
#[derive(Clone, Debug)]
pub struct IndirectSolution {
    /// States, controls, costates, multipliers. None where the best point cannot be flown.
    pub trajectory: Option<Trajectory>,
    /// [`Status::Optimal`]: the conditions hold to the tolerance; [`Status::Acceptable`]: as well as rounding allows.
    pub status: Status,
    /// Newton iterations.
    pub iterations: usize,
    /// Integrations of the whole problem.
    pub flights: usize,
    /// Largest residual, in units of the unknowns' sizes.
    pub residual: f64,
    /// Largest Newton correction at the end, in units of the unknowns' sizes.
    pub correction: f64,
    /// Number of unknowns.
    pub unknowns: usize,
    /// Switches of controls between their bounds, per phase.
    pub switches: Vec<Vec<ControlSwitch>>,
    /// Limits along the phases, which the method does not impose, that are exceeded.
    pub exceeded: Vec<Exceeded>,
    /// The segment that could not be flown, if that ended the solve.
    pub failure: Option<FailedSegment>,
    /// The nodes: a start for a neighbouring problem.
    pub nodes: IndirectStart,
}

impl IndirectShooting {
    /// Solves from a trajectory with costates, such as that of a collocation; `segments` equal ones per phase.
    ///
    /// # Errors
    /// As [`solve`](Self::solve).
    pub fn solve_from(
        &self,
        ocp: &Ocp,
        trajectory: &Trajectory,
        segments: usize,
    ) -> Result<IndirectSolution, ShootingError> {
        self.solve(ocp, &IndirectStart::from_trajectory(trajectory, segments)?, &mut ())
    }

    /// Solves the necessary conditions from a start.
    ///
    /// # Errors
    /// Settings out of range, a start that does not fit, limits that the method cannot impose.
    pub fn solve(
        &self,
        ocp: &Ocp,
        start: &IndirectStart,
        observer: &mut dyn Observer,
    ) -> Result<IndirectSolution, ShootingError> {
        self.settings.check()?;
        start.check(ocp)?;
        check_support(ocp)?;
        let (mut equations, mut z) = self.pose(ocp, start)?;
        let begin =
            newton::Begin { chained: start.chained, multipliers: start.constraint_multipliers.is_some() };
        let ended = newton::solve(&mut equations, &mut z, begin, &self.settings, observer);
        self.finish(ocp, equations, &z, ended)
    }

    /// The equations and the unknowns at the start.
    fn pose(&self, ocp: &Ocp, start: &IndirectStart) -> Result<(Conditions, Vec<f64>), ShootingError> {
        let guess = as_guess(start)?;
        let scaling = Scaling::new(ocp, &guess);
        let mut layout = MultipointLayout::new(ocp, start, &scaling, 1.0);
        let mut z = vec![0.0; layout.unknowns];
        for (p, s) in layout.phases.iter().zip(&start.phases) {
            for node in 0..s.fractions.len() {
                let first = p.node(node);
                z[first..first + p.states].copy_from_slice(&s.states[node]);
                z[first + p.states..first + 2 * p.states].copy_from_slice(&s.costates[node]);
            }
            (z[p.initial_time], z[p.final_time]) = (s.initial_time, s.final_time);
        }
        z[layout.first_parameter..layout.first_multiplier].copy_from_slice(&start.parameters);
        let mut ends = Ends::new(ocp, &layout);
        ends.evaluate(&z, &vec![0.0; layout.rows.len()], false);
        let objective = objective_scale(ocp, &scaling, &layout, &ends, start);
        layout = MultipointLayout::new(ocp, start, &scaling, objective);
        let mut changes = vec![0.0_f64; layout.rows.len()];
        for &(row, unknown, slope) in &ends.slopes {
            changes[row] = changes[row].max((slope * layout.scales[unknown]).abs());
        }
        layout.complete_scales(&changes);
        let mut flights = Vec::with_capacity(ocp.phases.len());
        for (k, p) in layout.phases.iter().enumerate() {
            let weights = integral_weights(ocp, k);
            let smoothing = self.settings.smoothing * objective;
            let hamiltonian = Hamiltonian::new(ocp, k, &weights, smoothing);
            let mut scales = layout.scales[p.node(0)..p.node(0) + 2 * p.states].to_vec();
            scales.resize(hamiltonian.dimension(), objective);
            let flow = Flow::new(hamiltonian, self.settings.integration_tolerance, &scales)?;
            let controls = &start.phases[k].controls;
            flights.push(PhaseFlight::new(flow, controls[..controls.len() - 1].to_vec()));
        }
        let mut equations = Conditions::new(ocp, layout, flights, self.settings.threads > 1);
        for (k, s) in start.phases.iter().enumerate() {
            let times = |node: usize| s.initial_time + s.fractions[node] * (s.final_time - s.initial_time);
            let flight = &mut equations.phases[k];
            for (node, control) in flight.controls.iter_mut().enumerate() {
                let h = flight.flow.hamiltonian.get_mut();
                h.start_control(control);
                h.scan(times(node), &s.states[node], &s.costates[node], &start.parameters);
                control.copy_from_slice(h.control());
            }
        }
        if let Some(multipliers) = &start.constraint_multipliers {
            for (value, m) in
                z[equations.layout.first_multiplier..].iter_mut().zip(multipliers.iter().flatten())
            {
                *value = *m;
            }
        }
        Ok((equations, z))
    }

    fn finish(
        &self,
        ocp: &Ocp,
        mut equations: Conditions,
        z: &[f64],
        ended: Ended,
    ) -> Result<IndirectSolution, ShootingError> {
        let tolerance = self.settings.integration_tolerance;
        equations.set_tolerance(tolerance);
        let extracted = extraction::extract(ocp, &mut equations, z, tolerance)?;
        let nodes = nodes(&equations, ocp, z);
        let mut status = ended.status;
        let (trajectory, switches, failure) = match extracted {
            Ok(Extremal { trajectory, switches, wrong_level }) => {
                // A switching function that starts at zero, as along a singular arc, may take the wrong sign without a switch.
                if wrong_level > WRONG_LEVEL && status.is_success() {
                    status = Status::StepTooSmall;
                }
                (Some(trajectory), switches, ended.failure)
            }
            Err(failure) => (None, vec![Vec::new(); ocp.phases.len()], Some(failure)),
        };
        Ok(IndirectSolution {
            exceeded: trajectory.as_ref().map_or(Vec::new(), |t| exceeded(ocp, t)),
            trajectory,
            status,
            iterations: ended.iterations,
            flights: ended.flights,
            residual: ended.residual,
            correction: ended.correction,
            unknowns: equations.layout.unknowns,
            switches,
            failure,
            nodes,
        })
    }
}

/// Refuses features that the conditions do not contain.
fn check_support(ocp: &Ocp) -> Result<(), ShootingError> {
    for phase in &ocp.phases {
        for q in &phase.integrals {
            let b = q.variable.bounds;
            if b.lower.is_finite() || b.upper.is_finite() {
                return Err(ShootingError::Unsupported {
                    place: format!("phase `{}`", phase.name),
                    what: format!("a bound on the integral `{}`", q.variable.name),
                    remedy: "make the integral a state with a bound at the end",
                });
            }
        }
    }
    Ok(())
}

/// Weights of the integrals of a phase in the minimised objective.
fn integral_weights(ocp: &Ocp, phase: usize) -> Vec<f64> {
    let mut weights = vec![0.0; ocp.phases[phase].integrals.len()];
    for &(p, q, w) in &ocp.objective.integrals {
        if p == phase {
            weights[q] += ends::sign(ocp) * w;
        }
    }
    weights
}

/// Straight lines through the nodes.
fn as_guess(start: &IndirectStart) -> Result<Guess, ShootingError> {
    let phase = |s: &PhaseStart| {
        let times: Vec<f64> =
            s.fractions.iter().map(|f| s.initial_time + f * (s.final_time - s.initial_time)).collect();
        PhaseGuess::samples(&times, s.states.clone(), s.controls.clone())
    };
    Ok(Guess {
        phases: start.phases.iter().map(phase).collect::<Result<_, _>>()?,
        parameters: start.parameters.clone(),
        constraint_multipliers: None,
    })
}

/// Stated, else the largest change of the end cost when an end quantity moves by its size, or the integrals at the start.
fn objective_scale(
    ocp: &Ocp,
    scaling: &Scaling,
    layout: &MultipointLayout,
    ends: &Ends,
    start: &IndirectStart,
) -> f64 {
    if let Some(scale) = scaling.objective {
        return scale;
    }
    let at_ends = (0..layout.first_multiplier).map(|i| (ends.gradient[i] * layout.scales[i]).abs());
    let at_ends = at_ends.fold(0.0_f64, |m, v| if v.is_finite() { m.max(v) } else { m });
    let mut along = 0.0;
    for &(k, q, weight) in &ocp.objective.integrals {
        let (phase, s) = (&ocp.phases[k], &start.phases[k]);
        let function = &phase.integrals[q].function;
        let parameters = if phase.takes_parameters(function.as_ref()) { &start.parameters[..] } else { &[] };
        let mut largest = 0.0_f64;
        for node in 0..s.fractions.len() {
            let inputs = [&s.states[node][..], &s.controls[node], parameters, &[s.initial_time]].concat();
            let mut value = [0.0];
            function.value(&inputs, &mut value);
            largest = largest.max(value[0].abs());
        }
        along += (weight * largest * (s.final_time - s.initial_time)).abs();
    }
    let scale = f64::max(at_ends, along);
    if scale > 0.0 && scale.is_finite() { scale } else { 1.0 }
}

/// The nodes of a point.
fn nodes(equations: &Conditions, ocp: &Ocp, z: &[f64]) -> IndirectStart {
    let layout = &equations.layout;
    let phases = layout.phases.iter().enumerate().map(|(k, p)| {
        let at = |offset: usize| -> Vec<Vec<f64>> {
            (0..p.fractions.len())
                .map(|node| z[p.node(node) + offset..p.node(node) + offset + p.states].to_vec())
                .collect()
        };
        let mut controls = equations.phases[k].controls.clone();
        controls.push(equations.phases[k].flow.hamiltonian.borrow().control().to_vec());
        PhaseStart {
            initial_time: z[p.initial_time],
            final_time: z[p.final_time],
            fractions: p.fractions.clone(),
            states: at(0),
            costates: at(p.states),
            controls,
        }
    });
    let mut rest = &z[layout.first_multiplier..];
    let multipliers = ocp.constraints.iter().map(|c| {
        let (rows, after) = rest.split_at(c.rows.len());
        rest = after;
        rows.to_vec()
    });
    let constraint_multipliers = Some(multipliers.collect());
    IndirectStart {
        phases: phases.collect(),
        parameters: z[layout.first_parameter..layout.first_multiplier].to_vec(),
        chained: false,
        constraint_multipliers,
    }
}

/// Relative gain by another level of a switching control that a solution may leave.
const WRONG_LEVEL: f64 = 1e-6;
/// Part of a scale by which a limit may be exceeded.
const EXCESS: f64 = 1e-6;

/// Bounds of states and rows of path constraints that the nodes of a trajectory exceed, the largest excess of each.
fn exceeded(ocp: &Ocp, trajectory: &Trajectory) -> Vec<Exceeded> {
    let mut found = Vec::new();
    for (phase, t) in ocp.phases.iter().zip(&trajectory.phases) {
        let rows = phase.path.iter().flat_map(|c| &c.rows);
        let limits: Vec<_> = phase.states.iter().map(|s| &s.variable).chain(rows).collect();
        let mut excess = vec![0.0_f64; limits.len()];
        for (time, segment) in t.nodes() {
            let x = t.state_at(time);
            let mut u = vec![0.0; phase.controls.len()];
            t.control.evaluate_in(segment, time, &mut u);
            let mut values = x.clone();
            for c in &phase.path {
                let takes = phase.takes_parameters(c.function.as_ref());
                let parameters = if takes { &trajectory.parameters[..] } else { &[] };
                let inputs = [&x[..], &u, parameters, &[time]].concat();
                let mut out = vec![0.0; c.rows.len()];
                c.function.value(&inputs, &mut out);
                values.extend(out);
            }
            for ((e, limit), value) in excess.iter_mut().zip(&limits).zip(values) {
                *e = e.max(limit.bounds.excess(value));
            }
        }
        for (amount, limit) in excess.into_iter().zip(limits) {
            if amount > EXCESS * limit.size().unwrap_or(1.0) {
                found.push(Exceeded {
                    phase: phase.name.clone(),
                    name: limit.name.clone(),
                    amount,
                    unit: limit.unit.clone(),
                });
            }
        }
    }
    found
}
