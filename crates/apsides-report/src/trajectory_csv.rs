//! Writes `trajectory.csv`: one row per node, enough to rebuild the polynomials.
//!
//! Columns: `phase`, `interval` (from zero in each phase), the time, states, controls, costates if there are any,
//! static parameters and the objective (constant), the error estimate of the interval, and `collocated`: 1 at
//! collocation points, 0 in the row that ends a phase. Headers carry the unit: `time_s`,
//! `horizontal_speed_m_per_s`, `costate_radius_kg_per_m`. Phases with other quantities leave cells empty. Values
//! have the fewest digits that give the same `f64` again.

use std::collections::HashMap;
use std::io::Write;

use apsides_ocp::{Ocp, Phase, PhaseTrajectory, PiecewisePolynomial, Trajectory};

use crate::ReportError;
use crate::columns::{COLLOCATED, Columns, INTERVAL, INTERVAL_ERROR, PHASE, PhaseColumns};
use crate::files::{TRAJECTORY, table_error};

/// Writes the nodes of a trajectory of `ocp` as CSV: one row per node, columns `phase`, `interval`, time, states,
/// controls, costates (if any), parameters, objective, error estimate of the interval, `collocated`.
///
/// Headers carry the unit, as `horizontal_speed_m_per_s`; cells of quantities that a phase does not have are empty.
/// The control at the end of a phase is the extrapolated polynomial of the last interval: no method collocates there.
///
/// # Errors
/// [`ReportError::Shape`] when the trajectory does not have the sizes of the problem, or its polynomials are not
/// determined by its nodes (each interval starts at a node, states have at most one node more than controls);
/// [`ReportError::Table`] when `out` cannot be written.
pub fn write_trajectory<W: Write>(out: W, ocp: &Ocp, trajectory: &Trajectory) -> Result<(), ReportError> {
    check_sizes(ocp, trajectory)?;
    trajectory.phases.iter().try_for_each(check_nodes)?;
    let with_costates = trajectory.phases.iter().any(|p| p.costate.is_some());
    let columns = Columns::new(ocp, with_costates);
    let position: HashMap<&str, usize> =
        columns.all.iter().enumerate().map(|(k, header)| (header.as_str(), k)).collect();
    let mut writer = csv::Writer::from_writer(out);
    let failed = |e: csv::Error| table_error(TRAJECTORY, e);
    writer.write_record(&columns.all).map_err(failed)?;
    for (phase, headers) in trajectory.phases.iter().zip(&columns.phases) {
        let end = phase.mesh.total_points();
        let (mut current, mut first) = (0, 0); // Interval and its first node.
        for (node, (time, interval)) in phase.nodes().enumerate() {
            let mut row = vec![String::new(); columns.all.len()];
            let mut put = |header: &str, text: String| row[position[header]] = text;
            put(PHASE, phase.name.clone());
            put(INTERVAL, interval.to_string());
            put(COLLOCATED, u8::from(node < end).to_string());
            put(&headers.time, shortest(time));
            if interval != current {
                (current, first) = (interval, node);
            }
            put_values(&mut put, phase, headers, Place { interval, node: node - first, time });
            for (header, value) in columns.parameters.iter().zip(&trajectory.parameters) {
                put(header, shortest(*value));
            }
            put(&columns.objective, shortest(trajectory.objective));
            if let Some(error) = phase.interval_errors.get(interval) {
                put(INTERVAL_ERROR, shortest(*error));
            }
            writer.write_record(&row).map_err(failed)?;
        }
    }
    writer.flush().map_err(|e| table_error(TRAJECTORY, e))
}

/// A node of an interval.
#[derive(Clone, Copy)]
struct Place {
    interval: usize,
    node: usize,
    time: f64,
}

fn put_values(
    put: &mut impl FnMut(&str, String),
    phase: &PhaseTrajectory,
    headers: &PhaseColumns,
    place: Place,
) {
    // Coordinate of the node on [-1, 1]; the end of a phase comes after the collocation points.
    let of_control = phase.control.segments()[place.interval].basis.nodes();
    let coordinate = of_control.get(place.node).copied().unwrap_or(1.0);
    let mut put_all = |headers: &[String], polynomial: &PiecewisePolynomial| {
        let values = node_values(polynomial, coordinate, place);
        for (header, value) in headers.iter().zip(values) {
            put(header, shortest(value));
        }
    };
    put_all(&headers.states, &phase.state);
    put_all(&headers.controls, &phase.control);
    if let Some(costate) = &phase.costate {
        put_all(&headers.costates, costate);
    }
}

/// The stored values where the polynomial has this node, which evaluation at the rounded time would round again.
fn node_values(polynomial: &PiecewisePolynomial, coordinate: f64, place: Place) -> Vec<f64> {
    let segment = &polynomial.segments()[place.interval];
    let size = polynomial.dimension();
    if segment.basis.nodes().get(place.node) == Some(&coordinate) {
        return segment.values[place.node * size..(place.node + 1) * size].to_vec();
    }
    let mut values = vec![0.0; size];
    polynomial.evaluate_in(place.interval, place.time, &mut values);
    values
}

/// Fewest digits that give the same number again, with an exponent for very large and very small ones.
pub(crate) fn shortest(value: f64) -> String {
    format!("{value:?}")
}

/// Refuses what does not fit the problem.
pub(crate) fn check_sizes(ocp: &Ocp, trajectory: &Trajectory) -> Result<(), ReportError> {
    let counts = [
        ("phases", ocp.phases.len(), trajectory.phases.len()),
        ("parameters", ocp.parameters.len(), trajectory.parameters.len()),
    ];
    expect_counts(&format!("problem `{}`", ocp.name), &counts)?;
    for (phase, t) in ocp.phases.iter().zip(&trajectory.phases) {
        check_phase(phase, t)?;
    }
    Ok(())
}

fn check_phase(phase: &Phase, t: &PhaseTrajectory) -> Result<(), ReportError> {
    let place = format!("phase `{}`", phase.name);
    let refuse = |reason: String| Err(ReportError::Shape { place: place.clone(), reason });
    if t.name != phase.name {
        return refuse(format!("expected this phase, found `{}`", t.name));
    }
    let intervals = t.control.segments().len();
    let mut counts = vec![
        ("states", phase.states.len(), t.state.dimension()),
        ("controls", phase.controls.len(), t.control.dimension()),
        ("intervals of the mesh", intervals, t.mesh.intervals()),
        ("intervals of the state", intervals, t.state.segments().len()),
    ];
    if let Some(costate) = &t.costate {
        counts.push(("costates", phase.states.len(), costate.dimension()));
        counts.push(("intervals of the costate", intervals, costate.segments().len()));
    }
    if let Some(path) = &t.path_multipliers {
        counts.push(("path multipliers", phase.path_rows(), path.dimension()));
        counts.push(("intervals of the path multipliers", intervals, path.segments().len()));
    }
    if !t.interval_errors.is_empty() {
        counts.push(("interval errors", intervals, t.interval_errors.len()));
    }
    expect_counts(&place, &counts)?;
    for k in 0..intervals {
        let points = t.control.segments()[k].basis.nodes().len();
        expect_counts(&format!("{place}, interval {k}"), &[("points", points, t.mesh.points()[k])])?;
        let (start, end) = (t.control.breaks()[k], t.control.breaks()[k + 1]);
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-12 * (start.abs() + end.abs());
        if t.control.node_times(k).next().is_none_or(|first| !close(first, start)) {
            return refuse(format!("interval {k} has no node at its start"));
        }
        if !close(t.state.breaks()[k], start) || !close(t.state.breaks()[k + 1], end) {
            return refuse(format!("interval {k} of states and controls has different ends"));
        }
    }
    Ok(())
}

/// Refuses states that the nodes of the controls do not determine.
fn check_nodes(t: &PhaseTrajectory) -> Result<(), ReportError> {
    for (k, (control, state)) in t.control.segments().iter().zip(t.state.segments()).enumerate() {
        let (support, held) = (state.basis.nodes().len(), control.basis.nodes().len() + 1);
        if support > held {
            let reason = format!("interval {k} has {support} state nodes, the file holds {held} of them");
            return Err(ReportError::Shape { place: format!("phase `{}`", t.name), reason });
        }
    }
    Ok(())
}

fn expect_counts(place: &str, counts: &[(&str, usize, usize)]) -> Result<(), ReportError> {
    match counts.iter().find(|(_, expected, found)| expected != found) {
        Some((what, expected, found)) => Err(ReportError::Shape {
            place: place.to_owned(),
            reason: format!("expected {expected} {what}, found {found}"),
        }),
        None => Ok(()),
    }
}
