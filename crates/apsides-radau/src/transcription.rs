//! The discretised problem: a sparse nonlinear program.
//!
//! Defects in differential form (Garg et al. 2010, eq. 8): at collocation point `i` of an interval of normalised width `h`
//!
//! ```text
//! sum_j D_ij x_j - (h / 2) (tf - t0) f(x_i, u_i, p, t_i) = 0
//! ```
//!
//! Where the mesh has breaks, `t0` and `tf` are the times of the breaks around the interval, which are variables.

use std::sync::Arc;

use apsides_ad::NodeFunction;
use apsides_nlp::SolveReport;
use apsides_ocp::{Guess, Mesh, Ocp, Trajectory};
use apsides_transcription::{Discretisation, Layout, StartingPoint, Transcribe, Workers, write_next};

use crate::RadauError;
use crate::arc_rates;
use crate::extraction::phase_trajectory;
use crate::layout::{CollocationPhase, collocation_layout};
use crate::node_term::{NodeTerm, Target};
use crate::rate_term::{RateTerm, rate_terms};

/// A problem on a mesh, as a nonlinear program that [`apsides_nlp::InteriorPoint`] or any other solver can take.
///
/// The structure is found once; evaluations write into the caller's slices and allocate nothing.
pub type Transcription = apsides_transcription::Transcription<Collocation>;

/// Step of differences along the flow, as a part of the phase.
const STEP: f64 = 1e-5;

/// The terms of a problem at its collocation points.
pub struct Collocation {
    node_terms: Vec<NodeTerm>,
    rate_terms: Vec<RateTerm>,
    /// Point of the last refresh of values and Jacobians at the nodes.
    refreshed_at: Vec<f64>,
    /// Threads for the nodes; none where the caller's does all.
    workers: Workers,
}

/// The program of a relaxation of the bounds: end times have derivatives even where they are fixed, and the start is not put
/// between the bounds.
pub(crate) fn with_movable_bounds(
    ocp: &Ocp,
    mesh: &Mesh,
    guess: &Guess,
) -> Result<Transcription, RadauError> {
    transcribe(ocp, mesh, guess, StartingPoint::AsGuessed)
}

fn transcribe(
    ocp: &Ocp,
    mesh: &Mesh,
    guess: &Guess,
    start: StartingPoint,
) -> Result<Transcription, RadauError> {
    guess.check(ocp)?;
    if mesh.phases.len() != ocp.phases.len() {
        return Err(apsides_ocp::OcpError::Dimension {
            place: format!("mesh of problem `{}`", ocp.name),
            what: "phases",
            expected: ocp.phases.len(),
            found: mesh.phases.len(),
        }
        .into());
    }
    let layout = collocation_layout(ocp, mesh)?;
    let collocation = Collocation {
        node_terms: node_terms(ocp, &layout, guess, start == StartingPoint::AsGuessed),
        rate_terms: rate_terms(ocp, &layout),
        refreshed_at: vec![f64::NAN; layout.variables],
        workers: Workers::default(),
    };
    Ok(Transcription::assemble(ocp, guess, layout, collocation, start))
}

impl Transcribe for Collocation {
    type Division = Mesh;
    type Error = RadauError;

    fn transcribe(ocp: &Ocp, mesh: &Mesh, guess: &Guess) -> Result<Transcription, RadauError> {
        transcribe(ocp, mesh, guess, StartingPoint::BetweenBounds)
    }

    fn trajectory(nlp: &Transcription, ocp: &Ocp, report: &SolveReport) -> Result<Trajectory, RadauError> {
        let x = nlp.usable_point(report);
        let phases = ocp.phases.iter().zip(&nlp.layout.phases);
        let (y, rates) = (&report.constraint_multipliers, &nlp.discretisation.rate_terms);
        let first_parameter = nlp.layout.first_parameter;
        let phases = phases.map(|(phase, p)| phase_trajectory(phase, p, x, y, rates, first_parameter));
        Ok(nlp.joined(ocp, report, x, phases.collect::<Result<_, _>>()?))
    }
}

impl Discretisation for Collocation {
    type Phase = CollocationPhase;

    fn share(&mut self, workers: &Workers) {
        let mut shared = false;
        for t in &mut self.node_terms {
            shared |= t.share(workers);
        }
        self.workers = if shared { workers.clone() } else { Workers::default() };
    }

    fn add_patterns(&mut self, jacobian: &mut Vec<(usize, usize)>, hessian: &mut Vec<(usize, usize)>) {
        for t in &mut self.node_terms {
            t.add_patterns(jacobian, hessian);
        }
        for t in &self.rate_terms {
            t.add_patterns(jacobian, hessian);
        }
    }

    /// Values are found as they are asked for.
    fn run(&mut self, _x: &[f64]) {}

    fn refresh(&mut self, x: &[f64]) -> bool {
        if self.refreshed_at == x {
            return false;
        }
        let terms = &mut self.node_terms;
        self.workers.run(|| terms.iter_mut().for_each(|t| t.refresh(x)));
        for t in &mut self.rate_terms {
            t.refresh(x);
        }
        self.refreshed_at.copy_from_slice(x);
        true
    }

    fn cost(&mut self, x: &[f64]) -> f64 {
        let costs = self.node_terms.iter_mut().filter(|t| t.has_cost());
        self.workers.run(|| costs.map(|t| t.add_values(x, &mut [])).sum())
    }

    fn add_gradient(&self, x: &[f64], gradient: &mut [f64]) {
        for t in self.node_terms.iter().filter(|t| t.has_cost()) {
            t.add_gradient(x, gradient);
        }
    }

    fn add_values(&mut self, x: &[f64], rows: &mut [f64]) {
        let terms = self.node_terms.iter_mut().filter(|t| t.has_rows());
        self.workers.run(|| {
            for t in terms {
                t.add_values(x, rows);
            }
        });
        for t in &mut self.rate_terms {
            t.add_values(x, rows);
        }
    }

    fn fill_jacobian(&mut self, x: &[f64], entries: &mut [f64]) {
        let terms = &mut self.node_terms;
        let rest = self.workers.run(|| terms.iter_mut().fold(entries, |rest, t| t.fill_jacobian(x, rest)));
        let mut next = rest.iter_mut();
        for t in &self.rate_terms {
            t.each_jacobian(|_, _, v| write_next(&mut next, v));
        }
    }

    fn fill_hessian(&mut self, x: &[f64], cost: f64, multipliers: &[f64], entries: &mut [f64]) {
        let terms = &mut self.node_terms;
        let rest = self
            .workers
            .run(|| terms.iter_mut().fold(entries, |rest, t| t.fill_hessian(x, cost, multipliers, rest)));
        let mut next = rest.iter_mut();
        for t in &mut self.rate_terms {
            t.each_hessian(multipliers, |_, _, v| write_next(&mut next, v));
        }
    }
}

fn node_terms(ocp: &Ocp, layout: &Layout<CollocationPhase>, guess: &Guess, movable: bool) -> Vec<NodeTerm> {
    let sign = ocp.objective.sense.sign();
    let mut terms = Vec::new();
    for (k, (phase, p)) in ocp.phases.iter().zip(&layout.phases).enumerate() {
        let (start, end) = phase.time_bounds();
        let mut add = |function: &dyn Fn(usize) -> Option<Arc<dyn NodeFunction>>,
                       is_rate,
                       target: &dyn Fn(usize) -> Target,
                       factor: &dyn Fn(usize) -> f64| {
            for (index, arc) in p.arcs.iter().enumerate() {
                let Some(function) = function(index) else { continue };
                // The times of breaks are free.
                let fixed =
                    (index == 0 && start.is_fixed(), index + 1 == p.arcs.len() && end.is_fixed() && !movable);
                let target = target(arc.nodes.start);
                terms.push(NodeTerm::new(
                    function,
                    is_rate,
                    target,
                    p,
                    arc,
                    layout.first_parameter,
                    fixed,
                    factor,
                ));
            }
        };
        let stride = p.rows_per_node;
        let rows_from =
            |offset: usize| move |node| Target::Rows { first: p.defect_row(node) + offset, stride };
        add(&|_| Some(Arc::clone(&phase.dynamics)), true, &rows_from(0), &|i| -0.5 * p.nodes[i].width);
        let mut offset = p.states;
        for c in &phase.path {
            let own = offset - p.states..offset - p.states + c.rows.len();
            let rates = p.rate_arcs.iter().filter(|a| own.contains(&a.row));
            let of_rates =
                |arc: usize| rates.clone().filter(move |a| a.arc == arc).map(|a| a.row - own.start);
            let function = |arc: usize| arc_rates::without(&c.function, of_rates(arc).collect());
            add(&|arc| Some(function(arc)), false, &rows_from(offset), &|_| 1.0);
            let step = STEP * (guess.phases[k].final_time - guess.phases[k].initial_time);
            for a in rates.clone() {
                let output = a.row - own.start;
                let rate = |arc: usize| {
                    (arc == a.arc).then(|| arc_rates::rate(phase, &c.function, output, step)).flatten()
                };
                add(&rate, false, &rows_from(p.states + a.row), &|_| 1.0);
            }
            offset += c.rows.len();
        }
        for (index, q) in phase.integrals.iter().enumerate() {
            let cost = sign * ocp.objective.integral_weight(k, index);
            let row = p.ends.integral_rows[index];
            if row.is_some() || cost != 0.0 {
                add(&|_| Some(Arc::clone(&q.function)), true, &|_| Target::Sum { row, cost }, &|i| {
                    p.nodes[i].weight
                });
            }
        }
    }
    terms
}
