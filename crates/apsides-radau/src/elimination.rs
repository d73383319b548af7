//! The elimination order of a phase.
//!
//! The points of an interval but the first: controls, states, rows; then interval by interval the first points. What an interval has
//! inside is eliminated independently of the other intervals, and alike in all that have as many points.
//!
//! Where [`RUNS`] runs of intervals are alike, the states between them come last: the runs are then independent of each other, too, and the
//! linear solver treats them side by side, one in each of its lanes. Their first states make the blocks larger.

/// Stages that an interval has inside, and as many at its first point.
const STAGES: u32 = 3;
/// Runs of intervals that are alike.
const RUNS: usize = 4;
/// Fewest intervals of a run: shorter ones gained nothing.
const FEWEST_INTERVALS: usize = 3;

/// Stages of a phase with so many intervals.
pub(crate) fn stages(intervals: usize) -> u32 {
    last_stage(0, intervals) + RUNS as u32 + 1
}

/// The stage of controls at a point of an interval, by its place in the interval, where the phase has so many intervals and this first stage;
/// states follow, then rows.
pub(crate) fn stage(first: u32, intervals: usize, interval: usize, local: usize) -> u32 {
    let of_interval = if local == 0 { intervals + interval } else { interval };
    first + STAGES * of_interval as u32
}

/// The first of the stages behind all intervals, for the states between runs.
pub(crate) fn last_stage(first: u32, intervals: usize) -> u32 {
    first + STAGES * (2 * intervals as u32 + 1)
}

/// The intervals with which the runs begin, and the one behind them, by the points of all intervals; none if there are no runs that are
/// alike. The first and the last interval are in no run: the ends of the phase are of their own kind.
pub(crate) fn ends_of_runs(points: &[usize]) -> Option<[usize; RUNS + 1]> {
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
        assert_eq!(ends_of_runs(&[3; 13]), None);
        assert_eq!(ends_of_runs(&[3; 14]), Some([1, 4, 7, 10, 13]));
        assert_eq!(ends_of_runs(&[4; 17]), Some([2, 5, 8, 11, 14]));
        // The same orders in each run, and others at the ends.
        let mut points = [3, 4, 5].repeat(5);
        assert_eq!(ends_of_runs(&points), Some([1, 4, 7, 10, 13]));
        (points[0], points[14]) = (7, 9);
        assert_eq!(ends_of_runs(&points), Some([1, 4, 7, 10, 13]));
        points[5] = 6;
        assert_eq!(ends_of_runs(&points), None);
        assert_eq!(ends_of_runs(&[]), None);
    }
}
