//! The elimination order of a phase.
//!
//! The points of an interval but the first: controls, states, rows; then interval by interval the first points. What an interval has
//! inside is eliminated independently of the other intervals, and alike in all that have as many points.
//!
//! Where [`RUNS`] runs of intervals are alike, the states between them come last: the runs are then independent of each other, too, and the
//! linear solver treats them side by side. Their first states make the blocks larger, so that this pays for as many runs as there are lanes.

use apsides_nlp::Stages;

use crate::layout::CollocationPhase;

/// Stages that an interval has inside, and as many at its first point.
const STAGES: u32 = 3;
/// Runs of intervals that are alike.
const RUNS: usize = 4;
/// Fewest intervals of a run.
const FEWEST_INTERVALS: usize = 2;

/// Stages of a phase with so many intervals.
pub(crate) fn stages(intervals: usize) -> u32 {
    STAGES * (2 * intervals as u32 + 1) + RUNS as u32 + 1
}

/// Sets the stages of the columns and rows of a phase.
pub(crate) fn set_stages(phase: &CollocationPhase, stages: &mut Stages) {
    let Stages { variables, constraints } = stages;
    let intervals = phase.mesh.intervals() as u32;
    let between = phase.first_stage + STAGES * intervals;
    let stage_of = |interval: usize, local: usize| {
        (if local == 0 { between } else { phase.first_stage }) + STAGES * interval as u32
    };
    for node in 0..=phase.nodes.len() {
        let (interval, local) =
            phase.nodes.get(node).map_or((phase.mesh.intervals(), 0), |n| (n.interval, n.local));
        let stage = stage_of(interval, local);
        variables[phase.state_column(node)..][..phase.states].fill(stage + 1);
        if node < phase.nodes.len() {
            variables[phase.control_column(node)..][..phase.controls].fill(stage);
            constraints[phase.defect_row(node)..][..phase.rows_per_node].fill(stage + 2);
        }
    }
    for &(row, interval, _) in &phase.degree_rows {
        constraints[row] = stage_of(interval, 0) + 2;
    }
    for rate in &phase.rate_rows {
        constraints[rate.at] = stage_of(rate.interval, 0) + 2;
    }
    // Arcs have times of their own, and such rows belong to some intervals alone.
    let is_uniform = phase.arcs.len() <= 1
        && phase.pinned_rows.is_empty()
        && phase.degree_rows.is_empty()
        && phase.rate_rows.is_empty();
    if let Some(ends) = ends_of_runs(phase.mesh.points()).filter(|_| is_uniform) {
        let last = between + STAGES * (intervals + 1);
        for (stage, interval) in (last..).zip(ends) {
            let column = phase.state_column(phase.interval_start(interval));
            variables[column..][..phase.states].fill(stage);
        }
    }
}

/// The intervals with which the runs begin, and the one behind them, by the points of all intervals; none if there are no runs that are
/// alike. The first and the last interval are in no run: the ends of the phase are of their own kind.
fn ends_of_runs(points: &[usize]) -> Option<[usize; RUNS + 1]> {
    let inner = points.len().saturating_sub(2);
    let length = inner / RUNS;
    if length < FEWEST_INTERVALS {
        return None;
    }
    let first = 1 + (inner - RUNS * length) / 2;
    let mut runs = points[first..].chunks_exact(length).take(RUNS);
    let example = runs.next()?;
    runs.all(|run| run == example).then(|| std::array::from_fn(|k| first + k * length))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_alike_and_leave_both_ends_out() {
        assert_eq!(ends_of_runs(&[3; 9]), None);
        assert_eq!(ends_of_runs(&[3; 10]), Some([1, 3, 5, 7, 9]));
        assert_eq!(ends_of_runs(&[4; 13]), Some([2, 4, 6, 8, 10]));
        // The same orders in each run, and others at the ends.
        assert_eq!(ends_of_runs(&[7, 3, 4, 3, 4, 3, 4, 3, 4, 9]), Some([1, 3, 5, 7, 9]));
        assert_eq!(ends_of_runs(&[3, 3, 3, 3, 5, 3, 3, 3, 3, 3]), None);
        assert_eq!(ends_of_runs(&[]), None);
    }
}
