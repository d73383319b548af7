//! Piecewise-constant controls by `apsides-piecewise`.

use apsides_nlp::Observer;
use apsides_ocp::{Guess, Ocp};
use apsides_piecewise::{
    Constraints, FreeLengths, Lengths, PiecewiseConstant, PiecewiseSettings, PiecewiseSolution, Transcription,
};
use apsides_shooting::direct::{MultipleShootingSettings, ShootingRecord};

use super::{Shortfall, Solution};
use crate::key::{Key, Range};
use crate::{Counters, Error, Mission};

const FREE: &str = "free";
const L_EPSILON: &str = "l-epsilon";

pub(super) const KEYS: &[Key] = &[
    Key::count("piecewise.segments", 30, 1, 10_000, "segments per phase at the start"),
    Key::choice("piecewise.lengths", &["equal", FREE], "lengths of the segments; free ones are unknowns"),
    Key::number(
        "piecewise.least_length",
        0.05,
        Range::open(0.0, 1.0),
        "least free length relative to that at the start",
    ),
    Key::count("piecewise.starts", 6, 1, 10_000, "starts of free lengths: the equal ones, then random ones"),
    Key::count("piecewise.seed", 1, 0, u32::MAX, "seed of the random lengths"),
    Key::choice(
        "piecewise.constraints",
        &["points", L_EPSILON],
        "how limits along the flight are kept: at points, or as an integral of the smoothed violation",
    ),
    Key::count("piecewise.points", 3, 1, 60, "points of each segment at which limits are kept"),
    Key::number(
        "piecewise.epsilon",
        1e-2,
        Range::open(0.0, 1.0),
        "relative width of the smoothing at the start",
    ),
    Key::number("piecewise.least_epsilon", 1e-4, Range::open(0.0, 1.0), "the same at the end"),
    Key::number(
        "piecewise.tau",
        0.1,
        Range::open(0.0, 1.0),
        "largest integral at the start, relative to `piecewise.epsilon` times the duration",
    ),
    Key::flag("piecewise.refine", true, "whether segments are divided until `piecewise.tolerance` is met"),
    Key::number(
        "piecewise.tolerance",
        5e-7,
        Range::open(0.0, 1.0),
        "what more segments would gain by extrapolation, relative to the objective",
    ),
    Key::count("piecewise.max_segments", 1000, 1, 100_000, "most segments of all phases after refinement"),
    Key::number(
        "piecewise.nlp_tolerance",
        1e-10,
        Range::open(0.0, 1.0),
        "scaled optimality error of each solve",
    ),
];

impl Mission {
    /// Solves by piecewise-constant controls.
    pub(super) fn solve_by_piecewise_controls(
        &self,
        ocp: &Ocp,
        guess: &Guess,
        observer: &mut dyn Observer,
    ) -> Result<Solution, Error> {
        let settings = self.piecewise_settings();
        let tolerance = settings.shooting.path_tolerance;
        let solution = PiecewiseConstant { settings }.solve_observed(ocp, guess, observer)?;
        Ok(of_piecewise(solution, tolerance))
    }

    fn piecewise_settings(&self) -> PiecewiseSettings {
        let values = &self.values;
        let lengths = if values.word("piecewise.lengths") == FREE {
            Lengths::Free(FreeLengths {
                least: values.number("piecewise.least_length"),
                starts: values.count("piecewise.starts"),
                seed: values.count("piecewise.seed") as u64,
            })
        } else {
            Lengths::Equal
        };
        let constraints = if values.word("piecewise.constraints") == L_EPSILON {
            Constraints::LEpsilon(Transcription {
                epsilon: values.number("piecewise.epsilon"),
                least_epsilon: values.number("piecewise.least_epsilon"),
                tau: values.number("piecewise.tau"),
                ..Transcription::default()
            })
        } else {
            Constraints::Points(values.count("piecewise.points"))
        };
        let mut shooting =
            MultipleShootingSettings { threads: self.threads.clamp(1, 1024), ..Default::default() };
        shooting.nlp.tolerance = values.number("piecewise.nlp_tolerance");
        PiecewiseSettings {
            intervals: values.count("piecewise.segments"),
            lengths,
            constraints,
            tolerance: values.flag("piecewise.refine").then(|| values.number("piecewise.tolerance")),
            max_intervals: values.count("piecewise.max_segments"),
            shooting,
        }
    }
}

fn of_piecewise(solution: PiecewiseSolution, path_tolerance: f64) -> Solution {
    let shortfall = (!solution.accurate).then(|| {
        let excess = &solution.excess;
        let beyond = if excess.amount > path_tolerance {
            format!("; {} is exceeded by {:.1e} of its scale at {:.3}", excess.place, excess.amount, excess.time)
        } else {
            String::new()
        };
        Shortfall::mesh(format!(
            "the integration error is {:.1e} and the expected gain of more segments {:.1e}{beyond}; raise `piecewise.segments`, \
             `piecewise.max_segments` or `piecewise.points`",
            solution.integration_error, solution.gain
        ))
    });
    let total = |count: fn(&ShootingRecord) -> usize| solution.meshes.iter().map(count).sum();
    let counters = Counters {
        iterations: total(|m| m.iterations),
        factorisations: total(|m| m.factorisations),
        variables: solution.meshes.last().map_or(0, |m| m.variables),
        constraints: solution.meshes.last().map_or(0, |m| m.constraints),
        mesh_iterations: solution.meshes.len(),
    };
    Solution {
        status: solution.status,
        shortfall,
        counters,
        unmet: solution.unmet.as_ref().map(ToString::to_string),
        warnings: Vec::new(),
        switches: Vec::new(),
        search: None,
        report: Some(solution.report),
        trajectory: solution.trajectory,
    }
}
