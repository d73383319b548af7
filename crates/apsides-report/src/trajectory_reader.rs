//! Reads `trajectory.csv` back: polynomials of states, controls and costates from the nodes alone.
//!
//! The state (and costate) of an interval is the polynomial through its collocation points and the first point of
//! the next interval, or the end of the phase; the control is the one through its collocation points. Where the
//! points of an interval are those of the Legendre-Gauss-Radau rule up to rounding, as every method of this
//! workspace writes them, the exact points of the rule are used.

use std::collections::HashMap;
use std::io::Read;
use std::sync::Arc;

use apsides_basis::{Barycentric, Lgr};
use apsides_ocp::{Ocp, PhaseMesh, PhaseTrajectory, PiecewisePolynomial, Segment, Trajectory};

use crate::columns::{COLLOCATED, Columns, INTERVAL, INTERVAL_ERROR, PHASE};
use crate::{Multipliers, ReportError};

/// Rebuilds the trajectory of `ocp` that [`write_trajectory`](crate::write_trajectory) wrote.
///
/// Columns may stand in any order; unknown ones are ignored. Constraint multipliers are not part of the file and
/// come from `multipliers`, if given.
///
/// # Errors
/// [`ReportError::Trajectory`] with the line of a truncated, malformed or unfit file, or of a value other than the objective that is not a
/// finite number; [`ReportError::Multipliers`] when these do not fit the problem or the nodes.
pub fn read_trajectory<R: Read>(
    csv: R,
    ocp: &Ocp,
    multipliers: Option<&Multipliers>,
) -> Result<Trajectory, ReportError> {
    let mut table = Table::open(csv, ocp)?;
    let nodes = table.nodes(ocp)?;
    let mut bases = Bases::default();
    let mut phases = Vec::with_capacity(ocp.phases.len());
    for (index, phase) in ocp.phases.iter().enumerate() {
        let of_phase: Vec<&Node> = nodes.iter().filter(|n| n.phase == index).collect();
        if of_phase.is_empty() {
            return refuse(table.last_line, format!("the file ends without phase `{}`", phase.name));
        }
        phases.push(rebuild_phase(&phase.name, &of_phase, &mut bases)?);
    }
    let constants = table.constants.take().unwrap_or_default();
    let mut trajectory = Trajectory {
        phases,
        parameters: constants.parameters,
        objective: constants.objective,
        constraint_multipliers: None,
    };
    if let Some(multipliers) = multipliers {
        multipliers.give_to(ocp, &mut trajectory)?;
    }
    Ok(trajectory)
}

fn refuse<T>(line: u64, reason: impl Into<String>) -> Result<T, ReportError> {
    Err(ReportError::Trajectory { line, reason: reason.into() })
}

/// One row.
struct Node {
    line: u64,
    phase: usize,
    interval: usize,
    collocated: bool,
    time: f64,
    state: Vec<f64>,
    control: Vec<f64>,
    costate: Option<Vec<f64>>,
    interval_error: Option<f64>,
}

/// Values that are the same in every row.
#[derive(Default)]
struct Constants {
    parameters: Vec<f64>,
    objective: f64,
}

impl PartialEq for Constants {
    /// To the bit: the objective of a solve that failed may not be a number.
    fn eq(&self, other: &Self) -> bool {
        self.parameters == other.parameters && self.objective.to_bits() == other.objective.to_bits()
    }
}

/// The file, its columns found.
struct Table<R> {
    reader: csv::Reader<R>,
    columns: Columns,
    positions: HashMap<String, usize>,
    constants: Option<Constants>,
    last_line: u64,
}

impl<R: Read> Table<R> {
    fn open(csv: R, ocp: &Ocp) -> Result<Self, ReportError> {
        let mut reader = csv::Reader::from_reader(csv);
        let headers = reader.headers().map_err(|e| malformed(&e, 1))?;
        let mut positions = HashMap::new();
        for (k, header) in headers.iter().enumerate() {
            if positions.insert(header.to_owned(), k).is_some() {
                return refuse(1, format!("column `{header}` stands twice"));
            }
        }
        let mut columns = Columns::new(ocp, true);
        let has_costate = |header: &String| positions.contains_key(header);
        let with_costates = columns.phases.iter().flat_map(|p| &p.costates).any(has_costate);
        if !with_costates {
            columns = Columns::new(ocp, false);
        }
        match columns.all.iter().find(|header| !positions.contains_key(*header)) {
            Some(missing) => refuse(1, format!("column `{missing}` is missing")),
            None => Ok(Self { reader, columns, positions, constants: None, last_line: 1 }),
        }
    }

    fn nodes(&mut self, ocp: &Ocp) -> Result<Vec<Node>, ReportError> {
        let mut nodes: Vec<Node> = Vec::new();
        let mut record = csv::StringRecord::new();
        while self.reader.read_record(&mut record).map_err(|e| malformed(&e, self.last_line + 1))? {
            let line = record.position().map_or(self.last_line + 1, csv::Position::line);
            self.last_line = line;
            let row = Row { record: &record, positions: &self.positions, line };
            let node = self.node(ocp, &row)?;
            check_order(nodes.last(), &node, ocp)?;
            let constants = Constants {
                parameters: row.numbers(&self.columns.parameters)?,
                objective: row.any_number(&self.columns.objective)?,
            };
            match &self.constants {
                None => self.constants = Some(constants),
                Some(first) if *first != constants => {
                    return refuse(line, "the parameters and the objective must be the same in every row");
                }
                Some(_) => {}
            }
            nodes.push(node);
        }
        match nodes.last() {
            None => refuse(1, "no row follows the header"),
            Some(last) if last.collocated => {
                refuse(last.line, "the file ends before the phase does (a row with `collocated` 0)")
            }
            Some(_) => Ok(nodes),
        }
    }

    fn node(&self, ocp: &Ocp, row: &Row<'_>) -> Result<Node, ReportError> {
        let name = row.cell(PHASE);
        let Some(phase) = ocp.phase_index(name) else {
            let known: Vec<_> = ocp.phases.iter().map(|p| format!("`{}`", p.name)).collect();
            return refuse(row.line, format!("no phase is named `{name}`; known: {}", known.join(", ")));
        };
        let headers = &self.columns.phases[phase];
        let costate = match headers.costates.iter().all(|h| row.cell(h).is_empty()) {
            true => None,
            false => Some(row.numbers(&headers.costates)?),
        };
        let interval_error = match row.cell(INTERVAL_ERROR) {
            "" => None,
            text => match text.parse() {
                Ok(error) => Some(error), // An estimate that failed is not finite, and harmless.
                Err(_) => return refuse(row.line, format!("`{text}` in `{INTERVAL_ERROR}` is no number")),
            },
        };
        Ok(Node {
            line: row.line,
            phase,
            interval: match row.cell(INTERVAL).parse() {
                Ok(interval) => interval,
                Err(_) => {
                    let text = row.cell(INTERVAL);
                    return refuse(row.line, format!("`{text}` in `{INTERVAL}` is no index"));
                }
            },
            collocated: match row.cell(COLLOCATED) {
                "1" => true,
                "0" => false,
                text => return refuse(row.line, format!("`{text}` in `{COLLOCATED}` must be 1 or 0")),
            },
            time: row.number(&headers.time)?,
            state: row.numbers(&headers.states)?,
            control: row.numbers(&headers.controls)?,
            costate,
            interval_error,
        })
    }
}

/// One record with names for its cells; every name has been checked against the header.
struct Row<'a> {
    record: &'a csv::StringRecord,
    positions: &'a HashMap<String, usize>,
    line: u64,
}

impl Row<'_> {
    fn cell(&self, header: &str) -> &str {
        self.positions.get(header).and_then(|k| self.record.get(*k)).map_or("", str::trim)
    }

    fn number(&self, header: &str) -> Result<f64, ReportError> {
        match self.any_number(header)? {
            value if value.is_finite() => Ok(value),
            _ => {
                let text = self.cell(header);
                refuse(self.line, format!("`{text}` in `{header}` is not a finite number"))
            }
        }
    }

    fn any_number(&self, header: &str) -> Result<f64, ReportError> {
        let text = self.cell(header);
        match text.parse::<f64>() {
            Ok(value) => Ok(value),
            Err(_) if text.is_empty() => refuse(self.line, format!("`{header}` is empty")),
            Err(_) => refuse(self.line, format!("`{text}` in `{header}` is no number")),
        }
    }

    fn numbers(&self, headers: &[String]) -> Result<Vec<f64>, ReportError> {
        headers.iter().map(|header| self.number(header)).collect()
    }
}

fn malformed(error: &csv::Error, line: u64) -> ReportError {
    let line = error.position().map_or(line, csv::Position::line);
    let reason = match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("{len} cells, expected {expected_len}: is the file truncated?")
        }
        csv::ErrorKind::Utf8 { .. } => "is not UTF-8 text".into(),
        _ => error.to_string(),
    };
    ReportError::Trajectory { line, reason }
}

/// Phases in the problem's order, intervals counted from zero, times increasing, one end per phase.
fn check_order(previous: Option<&Node>, node: &Node, ocp: &Ocp) -> Result<(), ReportError> {
    let same_phase = previous.filter(|p| p.phase == node.phase);
    let Some(before) = same_phase else {
        let expected = previous.map_or(0, |p| p.phase + 1);
        let name = &ocp.phases[node.phase].name;
        return match previous {
            Some(p) if p.collocated => {
                refuse(p.line, "the phase must end with a row that has `collocated` 0")
            }
            _ if node.phase != expected => {
                refuse(node.line, format!("phase `{name}` is not in the problem's order"))
            }
            _ if node.interval != 0 || !node.collocated => {
                refuse(node.line, format!("phase `{name}` must start with a collocation point of interval 0"))
            }
            _ => Ok(()),
        };
    };
    if !before.collocated {
        return refuse(node.line, "a row follows the end of its phase");
    }
    let next = if node.collocated { before.interval + 1 } else { before.interval };
    if node.interval != before.interval && node.interval != next {
        return refuse(node.line, format!("interval {} follows interval {}", node.interval, before.interval));
    }
    if node.time <= before.time {
        return refuse(
            node.line,
            format!("time {} does not exceed the time before, {}", node.time, before.time),
        );
    }
    if node.costate.is_some() != before.costate.is_some() {
        return refuse(node.line, "the costates must be given in every row of a phase, or in none");
    }
    Ok(())
}

fn rebuild_phase(name: &str, nodes: &[&Node], bases: &mut Bases) -> Result<PhaseTrajectory, ReportError> {
    // `check_order` has seen at least one collocation point and the end.
    let (start, end) = (nodes[0], nodes[nodes.len() - 1]);
    let points = &nodes[..nodes.len() - 1];
    let intervals: Vec<&[&Node]> = points.chunk_by(|a, b| a.interval == b.interval).collect();
    let mut breaks: Vec<f64> = intervals.iter().map(|nodes| nodes[0].time).collect();
    breaks.push(end.time);

    let (mut state, mut control, mut costate) = (Vec::new(), Vec::new(), Vec::new());
    let mut first = 0;
    for (k, interval) in intervals.iter().enumerate() {
        let support = &nodes[first..=first + interval.len()];
        first += interval.len();
        let times: Vec<f64> = support.iter().map(|n| n.time).collect();
        let (of_state, of_control) = bases
            .of(&times, breaks[k], breaks[k + 1])
            .map_err(|reason| ReportError::Trajectory { line: interval[0].line, reason })?;
        let values = |pick: &dyn Fn(&Node) -> &[f64], nodes: &[&Node]| -> Vec<f64> {
            nodes.iter().flat_map(|n| pick(n).iter().copied()).collect()
        };
        costate.push(Segment {
            basis: Arc::clone(&of_state),
            values: values(&|n| n.costate.as_deref().unwrap_or_default(), support),
        });
        state.push(Segment { basis: of_state, values: values(&|n| &n.state, support) });
        control.push(Segment { basis: of_control, values: values(&|n| &n.control, interval) });
    }

    let unfit =
        |e: apsides_ocp::OcpError| ReportError::Trajectory { line: start.line, reason: e.to_string() };
    let duration = end.time - start.time;
    let mut fractions: Vec<f64> = breaks.iter().map(|b| (b - start.time) / duration).collect();
    fractions[intervals.len()] = 1.0;
    let mesh = PhaseMesh::new(fractions, intervals.iter().map(|i| i.len()).collect()).map_err(unfit)?;
    let errors: Vec<Option<f64>> = intervals.iter().map(|i| i[0].interval_error).collect();
    let interval_errors = if errors.iter().all(Option::is_none) {
        Vec::new()
    } else {
        errors.into_iter().map(|e| e.unwrap_or(f64::NAN)).collect()
    };
    let polynomial =
        |dimension, segments| PiecewisePolynomial::new(dimension, breaks.clone(), segments).map_err(unfit);
    Ok(PhaseTrajectory {
        name: name.to_owned(),
        initial_time: start.time,
        final_time: end.time,
        mesh,
        state: polynomial(start.state.len(), state)?,
        control: polynomial(start.control.len(), control)?,
        costate: match start.costate {
            Some(_) => Some(polynomial(start.state.len(), costate)?),
            None => None,
        },
        path_multipliers: None,
        contacts: Vec::new(),
        integral_multipliers: None,
        interval_errors,
    })
}

type StateAndControl = (Arc<Barycentric>, Arc<Barycentric>);

/// Bases of intervals; those of a Radau rule are made once.
#[derive(Default)]
struct Bases {
    radau: HashMap<usize, Option<(Arc<Lgr>, StateAndControl)>>,
}

impl Bases {
    /// Bases through all of `times` and through all but the last, for the interval from `start` to `end`.
    fn of(&mut self, times: &[f64], start: f64, end: f64) -> Result<StateAndControl, String> {
        let points = times.len() - 1;
        let local: Vec<f64> = times.iter().map(|t| ((t - start) - (end - t)) / (end - start)).collect();
        let rule = self.radau.entry(points).or_insert_with(|| {
            let rule = Lgr::shared(points).ok()?;
            let bases = bases_through(rule.support()).ok()?;
            Some((rule, bases))
        });
        // What the rounding of the times does to a point on [-1, 1].
        let rounding = 8.0 * f64::EPSILON * (1.0 + start.abs().max(end.abs()) / (end - start));
        match rule {
            Some((rule, bases))
                if rule.support().iter().zip(&local).all(|(a, b)| (a - b).abs() <= rounding) =>
            {
                Ok(bases.clone())
            }
            _ => bases_through(&local),
        }
    }
}

fn bases_through(support: &[f64]) -> Result<StateAndControl, String> {
    let through = |nodes: &[f64]| Barycentric::new(nodes).map(Arc::new).map_err(|e| e.to_string());
    Ok((through(support)?, through(&support[..support.len() - 1])?))
}
