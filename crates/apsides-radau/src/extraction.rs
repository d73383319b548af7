//! From the decision vector and its multipliers to a trajectory with costates.

use std::sync::Arc;

use apsides_basis::Barycentric;
use apsides_ocp::{Contact, Phase, PhaseMesh, PhaseTrajectory, PiecewisePolynomial, Segment};

use crate::RadauError;
use crate::arc_rates;
use crate::junction::Junction;
use crate::layout::CollocationPhase;
use crate::rate_term::RateTerm;

/// The trajectory of one phase at a point `x` with the multipliers `y` of the rows.
///
/// Costates follow from the covector mapping of the Radau scheme (Garg et al. 2010, section 5): with `y` the multiplier of a
/// defect and `w` the weight of its point, `lambda = -y / w`; at the end of an interval `lambda = -D_end^T y`. The multiplier of a
/// touch point is an impulse: it enters the discrete costate equation of its node as the difference between the costate there and
/// the one at the end of the interval before.
pub(crate) fn phase_trajectory(
    phase: &Phase,
    p: &CollocationPhase,
    x: &[f64],
    y: &[f64],
    rates: &[RateTerm],
    first_parameter: usize,
) -> Result<PhaseTrajectory, RadauError> {
    let mesh = moved_mesh(p, x)?;
    let (t0, tf) = told_apart(&mesh, x[p.ends.initial_time], x[p.ends.final_time]);
    let breaks = times(mesh.fractions(), [t0, tf]);
    let path_rows = p.rows_per_node - p.states;
    let mut y = y.to_vec();
    for term in rates.iter().filter(|t| p.rate_rows.iter().any(|r| r.at == t.constraint())) {
        term.move_into_equations(p, x, &mut y);
    }
    smooth_at_start(p, &mut y);
    let y = y.as_slice();
    let mut bases = std::collections::BTreeMap::new();
    let (mut state, mut control, mut costate, mut path) = (vec![], vec![], vec![], vec![]);
    let impulses = impulses(p, &mesh, x, y);
    let density_at = |row: usize| impulses.iter().find(|i| i.at == row).map(|i| i.density);
    for (k, rule) in p.rules.iter().enumerate() {
        let n = rule.points();
        if let std::collections::btree_map::Entry::Vacant(e) = bases.entry(n) {
            e.insert((Arc::new(rule.support_basis().clone()), Arc::new(Barycentric::new(rule.nodes())?)));
        }
        let (support, nodes) = &bases[&n];
        let first = p.interval_start(k);
        let mut segment = SegmentValues::default();
        for j in 0..=n {
            let column = p.state_column(first + j);
            segment.state.extend_from_slice(&x[column..column + p.states]);
        }
        for j in 0..n {
            let column = p.control_column(first + j);
            segment.control.extend_from_slice(&x[column..column + p.controls]);
            let w = rule.weights()[j];
            let row = p.defect_row(first + j);
            segment.costate.extend(y[row..row + p.states].iter().map(|y| -y / w));
            // Per unit of time, as in the Hamiltonian.
            let seconds = p.nodes[first + j].weight * p.arc_duration(p.arc_of(first + j), x);
            let row = p.path_row(first + j);
            let density = |r: usize| match p.rate_arc_at(first + j, r) {
                Some(_) => arc_rates::density(p, x, y, first + j, r),
                None => density_at(row + r).unwrap_or(y[row + r] / seconds),
            };
            segment.path.extend((0..path_rows).map(density));
        }
        let d = rule.differentiation();
        for s in 0..p.states {
            let end = (0..n).map(|i| -y[p.defect_row(first + i) + s] * d[i * (n + 1) + n]).sum();
            segment.costate.push(end);
        }
        arc_rates::add_to_costates(phase, p, x, y, (k, first_parameter), &mut segment.costate);
        state.push(Segment { basis: Arc::clone(support), values: segment.state });
        control.push(Segment { basis: Arc::clone(nodes), values: segment.control });
        costate.push(Segment { basis: Arc::clone(support), values: segment.costate });
        path.push(Segment { basis: Arc::clone(nodes), values: segment.path });
    }
    let mut contacts: Vec<Contact> = impulses.iter().filter_map(|i| i.contact).collect();
    contacts.sort_by_key(|c| (c.end, c.row));
    let polynomial = |dimension, segments| PiecewisePolynomial::new(dimension, breaks.clone(), segments);
    Ok(PhaseTrajectory {
        name: phase.name.clone(),
        initial_time: t0,
        final_time: tf,
        mesh,
        state: polynomial(p.states, state)?,
        control: polynomial(p.controls, control)?,
        costate: Some(polynomial(p.states, costate)?),
        path_multipliers: if path_rows > 0 { Some(polynomial(path_rows, path)?) } else { None },
        contacts,
        integral_multipliers: Some(p.ends.integral_multipliers(y)),
        interval_errors: vec![f64::NAN; p.mesh.intervals()],
    })
}

/// The ends of a phase, the last one moved so far that all ends of intervals are different numbers: a solve that failed can leave a phase without
/// a length.
fn told_apart(mesh: &PhaseMesh, initial_time: f64, final_time: f64) -> (f64, f64) {
    let least = mesh.fractions().windows(2).map(|w| w[1] - w[0]).fold(1.0, f64::min);
    let resolution = 4.0 * f64::EPSILON * initial_time.abs().max(final_time.abs()).max(f64::MIN_POSITIVE);
    let earliest = initial_time + resolution / least;
    (initial_time, if final_time < earliest { earliest } else { final_time })
}

/// Makes the multipliers smooth at the start of rows whose first rate the initial states imply. Along the first interval such
/// a row gives its rate at the first node, as the equations of motion do there: what the multiplier of one has more, those of the
/// other have less. The costates at the nodes after it say which part is that of the equations.
fn smooth_at_start(p: &CollocationPhase, y: &mut [f64]) {
    let (rule, count) = (&p.rules[0], p.mesh.points()[0]);
    let weights = rule.weights();
    for (row, coefficients) in p.implied_rates.iter().filter(|_| count > CONTINUED_FROM) {
        let size: f64 = coefficients.iter().map(|(_, c)| c * c).sum();
        let along = |node: usize| {
            let parts = coefficients.iter().map(|&(s, c)| -c * y[p.defect_row(node) + s] / weights[node]);
            parts.sum::<f64>() / size
        };
        let from: Vec<usize> = (1..=CONTINUED_FROM).collect();
        let excess = along(0) - continued(p, 0, &from, |i, part| part * along(i));
        let part = weights[0] * excess;
        coefficients.iter().for_each(|&(s, c)| y[p.defect_row(0) + s] += part * c);
        // The end of the interval is the first node of the next one.
        for node in 1..(count + 1).min(p.nodes.len()) {
            y[p.path_row(node) + row] -= part * rule.differentiation()[node];
        }
    }
}

/// The value at a node of the polynomial through the values at others, from the part that each of them has in it.
fn continued(p: &CollocationPhase, node: usize, from: &[usize], term: impl Fn(usize, f64) -> f64) -> f64 {
    let place = |node: usize| p.nodes[node].fraction;
    let terms = from.iter().map(|&i| {
        let others = from.iter().filter(|j| **j != i);
        let basis: f64 = others.map(|&j| (place(node) - place(j)) / (place(i) - place(j))).product();
        term(i, basis)
    });
    terms.sum()
}

/// A multiplier at the first node below this part of the largest of its row is what a barrier leaves.
const ACTIVE: f64 = 1e-6;

/// Nodes from which the density of a multiplier is continued to others.
const CONTINUED_FROM: usize = 4;

/// A multiplier of a path row at a node that is more or less than a density.
struct Impulse {
    /// Constraint row.
    at: usize,
    contact: Option<Contact>,
    /// The density of the multiplier there.
    density: f64,
}

/// The impulses at touch points and junctions. Where an arc begins along a bound, and where a row is held from the start of the phase on, the
/// multiplier of the first node is an impulse and a density, which is that of the nodes after it. Along a row of order one with continuous
/// controls the impulse is what the mesh leaves of the place of the junction.
fn impulses(p: &CollocationPhase, mesh: &PhaseMesh, x: &[f64], y: &[f64]) -> Vec<Impulse> {
    let seconds = |node: usize| p.nodes[node].weight * p.arc_duration(p.arc_of(node), x);
    let value = |node: usize, row: usize| y[p.path_row(node) + row];
    // The density at a node as the polynomial through nodes after it has it.
    let continued = |node: usize, first: usize, row: usize| {
        let interval = p.nodes[node].interval;
        let last = p.interval_start(interval) + p.mesh.points()[interval];
        let from: Vec<usize> = (first..last).take(CONTINUED_FROM).collect();
        continued(p, node, &from, |i, part| part * value(i, row) / seconds(i))
    };
    let alone = |end: usize, row: usize| {
        let at = p.path_row(p.interval_start(end)) + row;
        Impulse { at, contact: Some(Contact { end, row, multiplier: y[at] }), density: 0.0 }
    };
    let entry = |end: usize, row: usize| {
        let node = p.interval_start(end);
        let density = continued(node, node + 1, row);
        let multiplier = value(node, row) - density * seconds(node);
        Impulse { at: p.path_row(node) + row, contact: Some(Contact { end, row, multiplier }), density }
    };
    let implied = |&(node, row): &(usize, usize)| {
        let count = p.implied_rows.iter().filter(|(_, r)| *r == row).count();
        Impulse { at: p.path_row(node) + row, contact: None, density: continued(node, count, row) }
    };
    let touches = mesh.touch_points().iter().map(|t| alone(t.end, t.row));
    let along = |j: &Junction| p.rate_arcs.iter().find(|a| a.row == j.row && a.ends.contains(&j.end));
    let exits = p.junctions.iter().filter(|j| !j.is_entry).map(|j| {
        let mut exit = alone(j.end, j.row);
        if let Some((c, _)) = exit.contact.as_mut().zip(along(j)) {
            c.multiplier += arc_rates::of_rate(p, x, y, (j.end - 1, 1.0), j.row);
        }
        exit
    });
    let entries = p.junctions.iter().filter(|j| j.is_entry);
    let entries = entries.map(|j| match along(j) {
        Some(_) => {
            let multiplier = -arc_rates::of_rate(p, x, y, (j.end, -1.0), j.row);
            let at = p.path_row(p.interval_start(j.end)) + j.row;
            Impulse { at, contact: Some(Contact { end: j.end, row: j.row, multiplier }), density: f64::NAN }
        }
        None => entry(j.end, j.row),
    });
    let is_active_at_start = |row: &&usize| {
        let largest = (0..p.nodes.len()).fold(0.0_f64, |m, node| m.max(value(node, **row).abs()));
        value(0, **row).abs() > ACTIVE * largest && p.touch_at(0, **row).is_none()
    };
    let starts = p.rows_at_start.iter().filter(is_active_at_start).map(|row| entry(0, *row));
    touches.chain(exits).chain(entries).chain(starts).chain(p.implied_rows.iter().map(implied)).collect()
}

/// The times of fractions of a phase, apart as they are, though they be closer than rounding of the times.
fn times(fractions: &[f64], [start, end]: [f64; 2]) -> Vec<f64> {
    let mut times: Vec<f64> = fractions.iter().map(|f| (1.0 - f) * start + f * end).collect();
    separate(&mut times);
    times
}

/// Moves ends apart that rounding has made one, as of an arc that has come to nothing.
fn separate(fractions: &mut [f64]) {
    for i in 1..fractions.len() - 1 {
        fractions[i] = fractions[i].max(fractions[i - 1].next_up());
    }
    for i in (1..fractions.len() - 1).rev() {
        fractions[i] = fractions[i].min(fractions[i + 1].next_down());
    }
}

/// The mesh with its breaks where the point `x` has them.
fn moved_mesh(p: &CollocationPhase, x: &[f64]) -> Result<PhaseMesh, RadauError> {
    if p.arcs.len() == 1 {
        return Ok(p.stated_mesh.clone());
    }
    let (t0, tf) = (x[p.ends.initial_time], x[p.ends.final_time]);
    let old = p.mesh.fractions();
    let mut fractions = old.to_vec();
    let inner = 1..p.mesh.intervals();
    for (k, arc) in p.arcs.iter().enumerate() {
        let intervals = p.mesh.arc_intervals(k);
        let (first, last) = (old[intervals.start], old[intervals.end]);
        for i in (intervals.start..=intervals.end).filter(|i| inner.contains(i)) {
            let share = (old[i] - first) / (last - first);
            let time = (1.0 - share) * x[arc.start_time] + share * x[arc.end_time];
            fractions[i] = (time - t0) / (tf - t0);
        }
    }
    separate(&mut fractions);
    let mesh = PhaseMesh::new(fractions, p.mesh.points().to_vec())?;
    let mesh = mesh.with_arcs(p.stated_mesh.breaks().to_vec(), p.stated_mesh.arcs().to_vec())?;
    let mesh = mesh.with_touch_points(p.mesh.touch_points().to_vec())?;
    Ok(mesh.with_crossings(p.mesh.crossings().to_vec())?)
}

#[derive(Default)]
struct SegmentValues {
    state: Vec<f64>,
    control: Vec<f64>,
    costate: Vec<f64>,
    path: Vec<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_that_are_apart_stay_so_as_times() {
        let middle = 0.5_f64;
        let fractions = [0.0, middle.next_down(), middle, middle.next_up(), 1.0];
        for ends in [[0.5, 20.0], [1e6, 1e6 + 1.0], [-3.0, 4.0]] {
            let times = times(&fractions, ends);
            assert!(times.windows(2).all(|w| w[0] < w[1]), "{times:?}");
            assert_eq!([times[0], times[4]], ends);
        }
    }
}
