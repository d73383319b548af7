//! A problem on a mesh, written down once more as formulas and index lists: objective and constraints of the
//! nonlinear program of `apsides-radau` for a tool that has no models.
//!
//! ```text
//! rows = A x + sum over terms of their rows,  objective = c x + sum over terms of their cost
//! ```
//!
//! A term is one formula at many points. At point `i` its inputs are the listed columns of `x`, then, where it has
//! times, `(1 - s_i) x[initial] + s_i x[final]`. The outputs are multiplied by the factor of the point and, for rates,
//! by the duration `x[final] - x[initial]`; they are added to the listed rows, and with their weights to the objective.

use apsides::ad::{Formula, NodeFunction};
use apsides::basis::Lgr;
use apsides::ocp::{Bounds, EndpointInput, Mesh, Ocp, PhaseMesh, Sense};
use apsides::radau::Transcription;
use apsides_problems::nlp::Program;
use serde::{Serialize, Serializer};
use serde_json::Value;

use crate::landing::Failure;
use crate::numbers::Numbers;

/// A nonlinear program.
#[derive(Debug, Serialize)]
pub struct Formulas {
    /// Start, bounds, units.
    #[serde(flatten)]
    pub numbers: Numbers,
    /// -1 for a maximum, whose negative is minimised.
    pub sign: f64,
    /// Entries `(column, weight)` of the linear part of the objective.
    pub linear_cost: Vec<(usize, f64)>,
    /// Entries `(row, column, value)` of the linear part of the constraints.
    pub linear_rows: Vec<(usize, usize, f64)>,
    /// The nonlinear part.
    pub terms: Vec<Term>,
}

/// One formula at many points.
#[derive(Debug, Serialize)]
pub struct Term {
    /// It is written as by [`Formula::to_json`].
    #[serde(serialize_with = "as_json")]
    pub formula: Formula,
    /// Per point, the columns of the inputs.
    pub columns: Vec<Vec<usize>>,
    /// Columns of start and end time, when time is the last input.
    pub times: Option<(usize, usize)>,
    /// Per point, its normalised time.
    pub fractions: Vec<f64>,
    /// Per point, the factor of the outputs.
    pub factors: Vec<f64>,
    /// True if the outputs are rates.
    pub rate: bool,
    /// Per point and output, the row.
    pub rows: Vec<Vec<Option<usize>>>,
    /// Weight of each output in the objective.
    pub costs: Vec<f64>,
}

impl Formulas {
    /// A program of a collection: output 0 is the objective.
    ///
    /// # Errors
    /// When its function has no formula.
    pub fn of_program(program: &Program) -> Result<Self, Failure> {
        let inputs = (0..program.function().inputs()).collect();
        let constraints = program.function().outputs() - 1;
        let rows = std::iter::once(None).chain((0..constraints).map(Some)).collect();
        let costs = std::iter::once(1.0).chain(vec![0.0; constraints]).collect();
        Ok(Self {
            numbers: Numbers::new(&mut program.clone()),
            sign: 1.0,
            linear_cost: Vec::new(),
            linear_rows: Vec::new(),
            terms: vec![Term::at_once(program.function(), inputs, rows, costs)?],
        })
    }

    /// A problem on a mesh; `nlp` is its transcription.
    ///
    /// # Errors
    /// When a model has no formula, or places disagree with those of the transcription.
    pub fn of_problem(ocp: &Ocp, mesh: &Mesh, nlp: &mut Transcription) -> Result<Self, Failure> {
        let numbers = Numbers::new(nlp);
        let places = Places::new(ocp, mesh, nlp, &numbers.start);
        if (places.columns, places.rows) != (numbers.start.len(), numbers.row_lower.len()) {
            return Err("places differ from those of the transcription".into());
        }
        let sign = match ocp.objective.sense {
            Sense::Minimize => 1.0,
            Sense::Maximize => -1.0,
        };
        let mut all = Self {
            numbers,
            sign,
            linear_cost: (ocp.objective.linear.iter().map(|&(e, w)| (places.end(e), sign * w))).collect(),
            linear_rows: Vec::new(),
            terms: Vec::new(),
        };
        for k in 0..ocp.phases.len() {
            all.add_phase(ocp, k, &mesh.phases[k], &places)?;
        }
        let mut row = places.first_endpoint_row;
        let ends = |inputs: &[EndpointInput]| inputs.iter().map(|&e| places.end(e)).collect();
        for c in &ocp.constraints {
            let rows = (row..row + c.rows.len()).map(Some).collect();
            row += c.rows.len();
            all.terms.push(Term::at_once(&*c.function, ends(&c.inputs), rows, vec![0.0; c.rows.len()])?);
        }
        for (inputs, function) in &ocp.objective.functions {
            all.terms.push(Term::at_once(&**function, ends(inputs), vec![None], vec![sign])?);
        }
        Ok(all)
    }

    fn add_phase(&mut self, ocp: &Ocp, k: usize, mesh: &PhaseMesh, places: &Places) -> Result<(), Failure> {
        let (phase, place) = (&ocp.phases[k], &places.phases[k]);
        let (states, inputs) = (phase.states.len(), place.stride);
        let parameters = places.first_parameter..places.columns;
        let (mut columns, mut fractions) = (Vec::new(), Vec::new());
        let (mut half_widths, mut weights) = (Vec::new(), Vec::new());
        for (interval, &points) in mesh.points().iter().enumerate() {
            let rule = Lgr::new(points)?;
            let (a, b) = (mesh.fractions()[interval], mesh.fractions()[interval + 1]);
            let start = columns.len();
            for (i, (tau, w)) in rule.nodes().iter().zip(rule.weights()).enumerate() {
                for (j, &d) in rule.differentiation()[i * (points + 1)..][..points + 1].iter().enumerate() {
                    for s in 0..states {
                        let row = place.first_row + (start + i) * place.rows_per_node + s;
                        self.linear_rows.push((row, place.first_column + (start + j) * inputs + s, d));
                    }
                }
                let first = place.first_column + columns.len() * inputs;
                columns.push((first..first + inputs).chain(parameters.clone()).collect::<Vec<_>>());
                fractions.push(a + 0.5 * (b - a) * (tau + 1.0));
                half_widths.push(0.5 * (b - a));
                weights.push(0.5 * (b - a) * w);
            }
        }
        let nodes = columns.len();
        let mut add = |function: &dyn NodeFunction, factors, rate, rows: Vec<Vec<Option<usize>>>, cost| {
            self.terms.push(Term {
                formula: function.formula()?,
                costs: vec![cost; function.outputs()],
                columns: columns.clone(),
                times: Some((place.initial_time, place.initial_time + 1)),
                fractions: fractions.clone(),
                factors,
                rate,
                rows,
            });
            Ok::<(), Failure>(())
        };
        let rows_from = |offset: usize, count: usize| {
            let first = |i: usize| place.first_row + i * place.rows_per_node + offset;
            (0..nodes).map(|i| (first(i)..first(i) + count).map(Some).collect()).collect::<Vec<_>>()
        };
        add(&*phase.dynamics, half_widths.iter().map(|h| -h).collect(), true, rows_from(0, states), 0.0)?;
        let mut offset = states;
        for path in &phase.path {
            add(&*path.function, vec![1.0; nodes], false, rows_from(offset, path.rows.len()), 0.0)?;
            offset += path.rows.len();
        }
        for (index, integral) in phase.integrals.iter().enumerate() {
            let in_cost = ocp.objective.integrals.iter().filter(|w| (w.0, w.1) == (k, index));
            let cost = self.sign * in_cost.map(|w| w.2).sum::<f64>();
            let rows = vec![vec![place.integral_rows[index]]; nodes];
            add(&*integral.function, weights.clone(), true, rows, cost)?;
        }
        if let Some(row) = place.duration_row {
            self.linear_rows.push((row, place.initial_time, -1.0));
            self.linear_rows.push((row, place.initial_time + 1, 1.0));
        }
        Ok(())
    }
}

impl Term {
    /// A function of the listed columns, once.
    fn at_once(
        function: &dyn NodeFunction,
        columns: Vec<usize>,
        rows: Vec<Option<usize>>,
        costs: Vec<f64>,
    ) -> Result<Self, Failure> {
        Ok(Self {
            formula: function.formula()?,
            columns: vec![columns],
            times: None,
            fractions: vec![0.0],
            factors: vec![1.0],
            rate: false,
            rows: vec![rows],
            costs,
        })
    }
}

fn as_json<S: Serializer>(formula: &Formula, serializer: S) -> Result<S::Ok, S::Error> {
    let value: Value = serde_json::from_str(&formula.to_json()).map_err(serde::ser::Error::custom)?;
    value.serialize(serializer)
}

/// The places of variables and constraints in the transcription. Variables: per phase, node after node `[x, u]`, the end
/// node with `[x]` alone, start and end time; parameters last. Constraints: per phase, node after node `[defects, path rows]`,
/// integrals with bounds, the duration; those of the ends last.
struct Places {
    phases: Vec<PhasePlaces>,
    first_parameter: usize,
    columns: usize,
    first_endpoint_row: usize,
    rows: usize,
}

struct PhasePlaces {
    first_column: usize,
    /// Columns per node.
    stride: usize,
    /// Column of the first state of the end node.
    end_node: usize,
    initial_time: usize,
    first_row: usize,
    rows_per_node: usize,
    integral_rows: Vec<Option<usize>>,
    duration_row: Option<usize>,
}

impl Places {
    fn new(ocp: &Ocp, mesh: &Mesh, nlp: &Transcription, x: &[f64]) -> Self {
        let (mut column, mut row) = (0, 0);
        let mut phases = Vec::new();
        for (phase, mesh) in ocp.phases.iter().zip(&mesh.phases) {
            let nodes: usize = mesh.points().iter().sum();
            let stride = phase.states.len() + phase.controls.len();
            let rows_per_node = phase.states.len() + phase.path.iter().map(|p| p.rows.len()).sum::<usize>();
            let (first_column, first_row) = (column, row);
            let end_node = first_column + nodes * stride;
            let initial_time = end_node + phase.states.len();
            column = initial_time + 2;
            row += nodes * rows_per_node;
            let mut next = || {
                row += 1;
                row - 1
            };
            let bounded = |b: Bounds| b != Bounds::FREE;
            let integral_rows =
                phase.integrals.iter().map(|q| bounded(q.variable.bounds).then(&mut next)).collect();
            // Which phases have a row for the duration is a rule of the transcription.
            let has_duration = nlp.row_origin(ocp, row, x).is_some_and(|origin| {
                origin.phase.as_ref() == Some(&phase.name)
                    && origin.time.is_none()
                    && origin.name == "duration"
            });
            let duration_row = has_duration.then_some(row);
            row += usize::from(has_duration);
            phases.push(PhasePlaces {
                first_column,
                stride,
                end_node,
                initial_time,
                first_row,
                rows_per_node,
                integral_rows,
                duration_row,
            });
        }
        let ends: usize = ocp.constraints.iter().map(|c| c.rows.len()).sum();
        Self {
            phases,
            first_parameter: column,
            columns: column + ocp.parameters.len(),
            first_endpoint_row: row,
            rows: row + ends,
        }
    }

    fn end(&self, input: EndpointInput) -> usize {
        match input {
            EndpointInput::InitialTime { phase } => self.phases[phase].initial_time,
            EndpointInput::FinalTime { phase } => self.phases[phase].initial_time + 1,
            EndpointInput::InitialState { phase, state } => self.phases[phase].first_column + state,
            EndpointInput::FinalState { phase, state } => self.phases[phase].end_node + state,
            EndpointInput::Parameter { index } => self.first_parameter + index,
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use apsides_problems::GALLERY;
    use apsides_problems::nlp::hock_schittkowski::collection;

    use super::*;

    /// Round-off of the arithmetic: two orders of the same sums, relative to the size of a term.
    const ROUNDING: f64 = 1e-11;

    /// Rows and objective at `x`.
    fn values(all: &Formulas, x: &[f64]) -> (Vec<f64>, f64) {
        let mut rows = vec![0.0; all.numbers.row_units.len()];
        let mut objective: f64 = all.linear_cost.iter().map(|&(c, w)| w * x[c]).sum();
        for &(r, c, v) in &all.linear_rows {
            rows[r] += v * x[c];
        }
        for term in &all.terms {
            for (i, columns) in term.columns.iter().enumerate() {
                let mut z: Vec<f64> = columns.iter().map(|&c| x[c]).collect();
                let (start, end) = term.times.map_or((0.0, 1.0), |(a, b)| (x[a], x[b]));
                if term.times.is_some() {
                    z.push((1.0 - term.fractions[i]) * start + term.fractions[i] * end);
                }
                let factor = term.factors[i] * if term.rate { end - start } else { 1.0 };
                for (k, v) in term.formula.evaluate(&z).into_iter().enumerate() {
                    objective += term.costs[k] * factor * v;
                    if let Some(r) = term.rows[i][k] {
                        rows[r] += factor * v;
                    }
                }
            }
        }
        (rows, objective)
    }

    fn assert_sampled(name: &str, all: &Formulas) {
        for sample in &all.numbers.samples {
            let (rows, objective) = values(all, &sample.point);
            let close = |a: f64, b: f64, unit: f64| (a - b).abs() <= ROUNDING * (unit + b.abs());
            assert!(close(objective, sample.objective, all.numbers.objective_unit), "{name}: objective");
            for (k, (a, b)) in rows.iter().zip(&sample.rows).enumerate() {
                assert!(close(*a, *b, all.numbers.row_units[k]), "{name}: row {k}, {a} for {b}");
            }
        }
    }

    #[test]
    fn the_gallery_has_the_values_of_its_transcription() {
        for problem in GALLERY {
            let case = problem.pose().unwrap();
            let mesh = Mesh::uniform(&case.ocp, 3, 4).unwrap();
            let mut nlp = Transcription::new(&case.ocp, &mesh, &case.guess).unwrap();
            match Formulas::of_problem(&case.ocp, &mesh, &mut nlp) {
                Ok(formulas) => assert_sampled(problem.name, &formulas),
                // Its tables are functions without a formula.
                Err(e) => assert_eq!(problem.name, "min_time_climb", "{e}"),
            }
        }
    }

    #[test]
    fn the_collection_has_the_values_of_its_programs() {
        let all: Vec<_> = collection();
        let described = all.iter().filter_map(|program| {
            Formulas::of_program(program).ok().map(|formulas| (program.number.to_string(), formulas))
        });
        let mut count = 0;
        for (name, formulas) in described {
            assert_sampled(&name, &formulas);
            count += 1;
        }
        // Functions without a formula, as the normal distribution, are few.
        assert!(count * 10 > all.len() * 9, "{count} of {}", all.len());
    }
}
