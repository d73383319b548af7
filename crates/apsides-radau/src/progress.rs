//! The gain of meshes: a refinement that costs much and gains nothing for a few meshes will not do so later.

/// Meshes in a row without gain after which refinement ends.
const PATIENCE: usize = 3;

/// Growth of the number of points, since the mesh with the least error, from which on its want of gain is one of refinement: at fewer
/// points breaks still look for their places.
const GROWTH: usize = 2;

/// Part of the least error that a gain leaves at most.
const GAIN: f64 = 0.9;

/// Errors up to this many times the tolerance are close to it.
const CLOSE: f64 = 100.0;

/// Change of the objective, relative to its size where that is above one, by which a mesh still finds another solution.
const SAME: f64 = 1e-6;

/// Meshes after which an error that was never below this is that of a flight that no mesh will carry.
const MESHES_ADRIFT: usize = 4;
const ADRIFT: f64 = 0.1;

/// Errors, objectives and sizes of the meshes so far.
pub(crate) struct Progress {
    least_error: f64,
    /// Points of the mesh with the least error.
    points: usize,
    objective: f64,
    without_gain: usize,
    meshes: usize,
}

impl Progress {
    pub(crate) fn new() -> Self {
        Self { least_error: f64::INFINITY, points: 0, objective: f64::NAN, without_gain: 0, meshes: 0 }
    }

    /// True if the last mesh gained nothing, and the least error so far is close to the tolerance, but above it.
    pub(crate) fn hangs_above(&self, tolerance: f64) -> bool {
        let excess = self.least_error / tolerance;
        self.without_gain > 0 && excess > 1.0 && excess <= CLOSE
    }

    /// True if no mesh so far carries its flight at all. A coarse one has flights of its own, such as one that passes a centre of attraction
    /// unharmed, and each refinement follows it farther away.
    pub(crate) fn is_adrift(&self) -> bool {
        self.meshes >= MESHES_ADRIFT && self.least_error >= ADRIFT
    }

    /// Takes another mesh, of this error, which may be accurate; true if the last ones have many more points, no less error and the same
    /// objective. One that is accurate does not count: it is refined for other reasons than its error.
    pub(crate) fn has_stalled(
        &mut self,
        (error, is_accurate): (f64, bool),
        objective: f64,
        points: usize,
    ) -> bool {
        self.meshes += 1;
        let moved = (objective - self.objective).abs() > SAME * objective.abs().max(1.0);
        let better = error < GAIN * self.least_error;
        self.without_gain = match better || moved {
            true => 0,
            false => self.without_gain + usize::from(!is_accurate),
        };
        if better {
            (self.least_error, self.points) = (error, points);
        }
        self.objective = objective;
        !is_accurate && self.without_gain >= PATIENCE && points >= GROWTH * self.points
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_meshes_without_gain_are_the_end() {
        let mut progress = Progress::new();
        let meshes = [(1e-2, 40), (1e-3, 60), (2e-3, 90), (1e-3, 120)];
        assert!(meshes.iter().all(|&(error, points)| !progress.has_stalled((error, false), 1.0, points)));
        assert!(progress.has_stalled((1e-3, false), 1.0, 130));
    }

    #[test]
    fn errors_hang_after_a_mesh_without_gain_close_to_the_tolerance() {
        let mut progress = Progress::new();
        assert!(!progress.hangs_above(1e-8));
        progress.has_stalled((2e-7, false), 1.0, 40);
        assert!(!progress.hangs_above(1e-8), "the first mesh");
        progress.has_stalled((3e-7, false), 1.0, 60);
        assert!(progress.hangs_above(1e-8));
        assert!(!progress.hangs_above(1e-6), "a mesh met it");
        assert!(!progress.hangs_above(1e-10), "far from it");
        progress.has_stalled((1e-7, false), 1.0, 80);
        assert!(!progress.hangs_above(1e-8), "a gain");
    }

    #[test]
    fn large_errors_on_all_of_the_first_meshes_are_those_of_a_flight_adrift() {
        let adrift = |errors: &[f64]| {
            let mut progress = Progress::new();
            errors.iter().for_each(|error| {
                progress.has_stalled((*error, false), 1.0, 40);
            });
            progress.is_adrift()
        };
        assert!(
            adrift(&[0.4, 0.7, 0.2, 0.3]) && !adrift(&[0.4, 0.7, 0.2]) && !adrift(&[0.4, 0.7, 0.05, 0.3])
        );
    }

    #[test]
    fn a_falling_error_another_solution_and_few_points_go_on() {
        let mut progress = Progress::new();
        assert!((0..9).all(|k| !progress.has_stalled((0.5_f64.powi(k), false), 1.0, 1 << k)));
        assert!((0..9).all(|k| !progress.has_stalled((1.0, false), f64::from(k), 1000)));
        assert!((0..9).all(|_| !progress.has_stalled((1.0, false), 1.0, 300)));
    }

    #[test]
    fn accurate_meshes_do_not_count_as_ones_without_gain() {
        let mut progress = Progress::new();
        let accurate = [(1e-12, 40), (2e-11, 60), (2e-11, 70), (2e-11, 80)];
        assert!(accurate.iter().all(|&(error, points)| !progress.has_stalled((error, true), 1.0, points)));
        let above = [(2e-10, 90), (2e-10, 100)];
        assert!(above.iter().all(|&(error, points)| !progress.has_stalled((error, false), 1.0, points)));
        assert!(progress.has_stalled((2e-10, false), 1.0, 110));
    }
}
