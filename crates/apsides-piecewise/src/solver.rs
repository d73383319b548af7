//! Equal lengths, free lengths from several starts, passes of the transcription, refinement.

use std::sync::Arc;

use apsides_basis::Barycentric;
use apsides_nlp::{Observer, SolveReport, Status};
use apsides_ocp::{Guess, Mesh, Ocp, PhaseMesh, PiecewisePolynomial, Segment, Sense, Trajectory, Unmet};
use apsides_shooting::ShootingError;
use apsides_shooting::direct::{
    MultipleShooting, MultipleShootingSettings, SegmentEnds, ShootingRecord, ShootingSolution,
};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

use crate::inequality::{Excess, Inequality, excess, inequalities, transcribed};
use crate::settings::{Constraints, Lengths, PiecewiseSettings, Transcription};

/// Random lengths are equal ones times `exp(s)`, `s` between this and its negative.
const SPREAD: f64 = 1.5;
/// Least lengths where segments of a solution are divided: what remains to be found is close.
const LEAST_OF_DIVIDED: f64 = 0.5;
/// Solves between two looks at what divisions have gained: one with the segments at hand, two with more.
const DIVISIONS: usize = 3;
/// A division is to bring the estimate down by this factor, as twice as many segments do with a smooth control.
const DIVISION: f64 = 4.0;
/// The remainder by extrapolation is trusted to this factor: finer segments may show what coarse ones hide, such as a switch.
const MARGIN: f64 = 2.0;
/// `eps` and `tau` shrink by this factor when the constraints hold, `tau` alone by the other one when they do not.
const NEXT_EPSILON: f64 = 0.1;
const NEXT_TAU: f64 = 0.5;
/// Most constraint points of a segment; they double between.
const MOST_POINTS: usize = 17;
/// `eps` is so much larger where the first pass fails, so many times.
const LARGER_EPSILON: f64 = 10.0;
const LARGER_TRIES: usize = 2;
/// Most values of `tau` for one `eps`.
const MOST_TAUS: usize = 12;
/// Most iterations of a pass.
const MOST_ITERATIONS: usize = 500;

/// The method: piecewise-constant controls.
///
/// ```
/// # use apsides_ad::{Dynamics, Scalar};
/// # use apsides_ocp::{At, Bounds, Guess, Ocp, Phase, State, Variable};
/// # struct Cart;
/// # impl Dynamics<2, 1> for Cart {
/// #     fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
/// #         [x[1], u[0]]
/// #     }
/// # }
/// use apsides_piecewise::{FreeLengths, Lengths, PiecewiseConstant, PiecewiseSettings};
///
/// // A cart from rest to rest over 1 m in least time: full ahead for 1 s, full astern for 1 s.
/// let phase = Phase::new("move", Cart)
///     .states([State::new("x", "m").starts_at(0.0).ends_at(1.0), State::new("v", "m/s").starts_at(0.0).ends_at(0.0)])
///     .controls([Variable::new("u", "m/s2").within(-1.0, 1.0)])
///     .final_time(Bounds::new(0.1, 10.0));
/// let ocp = Ocp::builder("cart").phase(phase).minimize("time", "s", At::FinalTime("move")).build()?;
/// let lengths = Lengths::Free(FreeLengths::default());
/// let method = PiecewiseConstant { settings: PiecewiseSettings { intervals: 3, lengths, ..Default::default() } };
/// let solution = method.solve(&ocp, &Guess::linear(&ocp))?;
/// assert!((solution.trajectory.objective - 2.0).abs() < 1e-7);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct PiecewiseConstant {
    /// Settings.
    pub settings: PiecewiseSettings,
}

/// One start of free lengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StartRecord {
    /// The status at its end.
    pub status: Status,
    /// Objective in its own sense.
    pub objective: f64,
}

/// One pass of the `L_eps` transcription.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassRecord {
    /// `eps` and `tau` (see [`Transcription`]).
    pub epsilon: f64,
    /// See there.
    pub tau: f64,
    /// The status at its end.
    pub status: Status,
    /// Objective in its own sense.
    pub objective: f64,
    /// Largest violation of a constraint along the trajectory, relative to its scale.
    pub excess: f64,
}

/// The result of a solve.
#[derive(Clone, Debug)]
pub struct PiecewiseSolution {
    /// The best trajectory. Its controls are polynomials of degree 0. With `L_eps`, costates are there only if the problem has no
    /// inequalities along its phases.
    pub trajectory: Trajectory,
    /// The status of its solve.
    pub status: Status,
    /// The constraint that could not be met, when that solve did not succeed.
    pub unmet: Option<Unmet>,
    /// Largest error of the steps, relative to the scales of the states.
    pub integration_error: f64,
    /// Gain that more segments would bring, relative to the objective: by extrapolation from the last division, by an estimate where there
    /// was none.
    pub gain: f64,
    /// Largest violation of path constraints and bounds on states along the trajectory.
    pub excess: Excess,
    /// True if steps and constraints, and with refinement the gain, are within their tolerances.
    pub accurate: bool,
    /// Starts of free lengths.
    pub starts: Vec<StartRecord>,
    /// Passes of the transcription.
    pub passes: Vec<PassRecord>,
    /// Every program that was solved.
    pub meshes: Vec<ShootingRecord>,
    /// Report of the one that gave the trajectory.
    pub report: SolveReport,
}

impl PiecewiseConstant {
    /// Solves from a guess.
    ///
    /// # Errors
    /// When the request is ill-posed. Not converging is a status of the solution.
    pub fn solve(&self, ocp: &Ocp, guess: &Guess) -> Result<PiecewiseSolution, ShootingError> {
        self.solve_observed(ocp, guess, &mut ())
    }

    /// The same with an observer, which sees every iteration and can stop the solve.
    ///
    /// # Errors
    /// When the request is ill-posed.
    pub fn solve_observed(
        &self,
        ocp: &Ocp,
        guess: &Guess,
        observer: &mut dyn Observer,
    ) -> Result<PiecewiseSolution, ShootingError> {
        self.settings.check()?;
        guess.check(ocp)?;
        let inequalities = inequalities(ocp, guess);
        let mut run = Run {
            settings: &self.settings,
            ocp,
            guess,
            observer,
            problem: None,
            points: match self.settings.constraints {
                Constraints::Points(points) => Some(points),
                Constraints::LEpsilon(_) => None,
            },
            least_steps: 1,
            gain: None,
            starts: Vec::new(),
            passes: Vec::new(),
            meshes: Vec::new(),
            inequalities,
        };
        let best = run.solve()?;
        run.finish(best)
    }
}

struct Run<'a> {
    settings: &'a PiecewiseSettings,
    ocp: &'a Ocp,
    guess: &'a Guess,
    observer: &'a mut dyn Observer,
    inequalities: Vec<Inequality>,
    /// The problem of the present pass, where it is another than the user's.
    problem: Option<Ocp>,
    /// Constraint points of each segment.
    points: Option<usize>,
    /// Steps per segment that the smoothing needs.
    least_steps: usize,
    /// Gain that more segments would bring, by extrapolation.
    gain: Option<f64>,
    starts: Vec<StartRecord>,
    passes: Vec<PassRecord>,
    meshes: Vec<ShootingRecord>,
}

impl Run<'_> {
    fn solve(&mut self) -> Result<ShootingSolution, ShootingError> {
        let smoothing = match self.settings.constraints {
            Constraints::LEpsilon(t) if !self.inequalities.is_empty() => Some(t),
            _ => None,
        };
        let mut epsilon = smoothing.map_or(1.0, |t| t.epsilon);
        if let Some(t) = smoothing {
            self.smooth(epsilon, t.tau);
        }
        let mesh = Mesh::uniform(self.ocp, self.settings.intervals, 1)?;
        let mut best = self.shoot(self.guess, mesh.clone(), SegmentEnds::Fixed, None)?;
        for t in smoothing.iter().cycle().take(LARGER_TRIES) {
            if best.status.is_success() || best.status == Status::Interrupted {
                break;
            }
            epsilon *= LARGER_EPSILON;
            self.smooth(epsilon, t.tau);
            best = self.shoot(self.guess, mesh.clone(), SegmentEnds::Fixed, None)?;
        }
        let ends = match self.settings.lengths {
            Lengths::Equal => SegmentEnds::Fixed,
            Lengths::Free(free) => SegmentEnds::Free { least_length: free.least },
        };
        if let Lengths::Free(free) = self.settings.lengths {
            best = self.best_of_starts(best, &mesh, ends, free.starts, free.seed)?;
        }
        if best.status == Status::Interrupted {
            return Ok(best);
        }
        let mut last = (1.0, 1.0);
        if let Some(t) = smoothing {
            (best, last) = self.shrink(best, ends, (epsilon, t.tau), &t)?;
        }
        if self.settings.max_refinements > 0 && best.status.is_success() {
            let ends = match ends {
                SegmentEnds::Free { least_length } => {
                    SegmentEnds::Free { least_length: least_length.max(LEAST_OF_DIVIDED) }
                }
                SegmentEnds::Fixed => ends,
            };
            best = self.refine(best, ends)?;
            if let Some(t) = smoothing {
                (best, _) = self.shrink(best, ends, last, &t)?;
            }
        }
        Ok(best)
    }

    /// Divides the segments with most to gain by the estimate, or all in two where it sees none. What `n` segments miss the optimum by
    /// falls with `n^2`, so that `n'` of them leave `|J' - J| / ((n' / n)^2 - 1)`.
    fn refine(
        &mut self,
        first: ShootingSolution,
        ends: SegmentEnds,
    ) -> Result<ShootingSolution, ShootingError> {
        let mut best = first;
        for _ in 0..self.settings.max_refinements {
            let gain = estimate(&best);
            if self.gain.unwrap_or(gain) <= self.settings.tolerance {
                break;
            }
            let count = segments_of(&best.trajectory);
            let mut next = self.again(&best, ends, Some(gain / DIVISION))?;
            if next.status.is_success() && segments_of(&next.trajectory) == count {
                if 2 * count > self.settings.max_intervals {
                    break;
                }
                let phases = next.trajectory.phases.iter().map(|p| halved(&p.mesh));
                let mesh = Mesh { phases: phases.collect::<Result<_, _>>()? };
                next = self.shoot(&Guess::earlier(&next.trajectory), mesh, ends, None)?;
            }
            if !next.status.is_success() {
                // The trajectory is one of earlier segments.
                best.status = if next.status == Status::Interrupted { next.status } else { best.status };
                break;
            }
            let (before, after) = (best.trajectory.objective, next.trajectory.objective);
            let size = after.abs().max(self.ocp.objective.scale.unwrap_or(0.0));
            let ratio = segments_of(&next.trajectory) as f64 / count as f64;
            self.gain = Some(MARGIN * (after - before).abs() / ((ratio * ratio - 1.0) * size));
            best = next;
        }
        Ok(best)
    }

    /// True if violations are smoothed, so that they are judged after the last pass.
    fn smooths(&self) -> bool {
        self.problem.is_some()
    }

    /// Takes the problem with `eps` and `tau` from here on.
    fn smooth(&mut self, epsilon: f64, tau: f64) {
        // A constraint that is active in one instant is so within the square root of `eps`, relative to the phase.
        self.least_steps = (epsilon.powf(-0.5) / self.settings.intervals as f64).ceil().max(1.0) as usize;
        self.problem = Some(transcribed(self.ocp, &self.inequalities, self.guess, epsilon, tau));
    }

    /// Solves, with more constraint points as long as limits are exceeded between them.
    fn shoot(
        &mut self,
        guess: &Guess,
        mesh: Mesh,
        ends: SegmentEnds,
        divide: Option<f64>,
    ) -> Result<ShootingSolution, ShootingError> {
        let mut solution = self.shoot_with(guess, mesh, ends, divide)?;
        while solution.status.is_success() && !self.holds(&solution.trajectory) {
            let Some(points) = self.points.filter(|&p| p < MOST_POINTS) else { break };
            self.points = Some((2 * points).saturating_sub(1).clamp(3, MOST_POINTS));
            let (guess, mesh) = (Guess::earlier(&solution.trajectory), mesh_of(&solution.trajectory));
            solution = self.shoot_with(&guess, mesh, ends, divide)?;
        }
        Ok(solution)
    }

    /// True if all inequalities hold along a trajectory.
    fn holds(&self, trajectory: &Trajectory) -> bool {
        excess(self.ocp, &self.inequalities, trajectory).amount <= self.settings.shooting.path_tolerance
    }

    fn shoot_with(
        &mut self,
        guess: &Guess,
        mesh: Mesh,
        segment_ends: SegmentEnds,
        divide: Option<f64>,
    ) -> Result<ShootingSolution, ShootingError> {
        let segments: usize = mesh.phases.iter().map(PhaseMesh::intervals).sum();
        let mut nlp = self.settings.shooting.nlp.clone();
        if self.problem.is_some() {
            nlp.max_iterations = nlp.max_iterations.min(MOST_ITERATIONS);
        }
        let settings = MultipleShootingSettings {
            nlp,
            intervals: self.settings.intervals,
            points: 1,
            max_points: 1,
            continuous_controls: false,
            constraint_points: self.points,
            segment_ends,
            // A gain that no segment has.
            tolerance: divide.unwrap_or(f64::MAX),
            least_steps: self.least_steps.max(self.settings.shooting.least_steps),
            max_refinements: if divide.is_some() {
                DIVISIONS - 1
            } else {
                self.settings.shooting.max_refinements
            },
            max_intervals: if divide.is_some() {
                self.settings.max_intervals.max(segments)
            } else {
                segments
            },
            ..self.settings.shooting.clone()
        };
        let ocp = self.problem.as_ref().unwrap_or(self.ocp);
        let solution = MultipleShooting { settings }.solve_on(ocp, guess, mesh, &mut *self.observer)?;
        self.meshes.extend(solution.meshes.iter().cloned());
        Ok(solution)
    }

    /// From a solution on.
    fn again(
        &mut self,
        from: &ShootingSolution,
        ends: SegmentEnds,
        divide: Option<f64>,
    ) -> Result<ShootingSolution, ShootingError> {
        self.shoot(&Guess::earlier(&from.trajectory), mesh_of(&from.trajectory), ends, divide)
    }

    /// Free lengths from the solution with equal ones, then from random lengths, with the states and controls of that solution and of
    /// the guess in turn.
    fn best_of_starts(
        &mut self,
        equal: ShootingSolution,
        mesh: &Mesh,
        ends: SegmentEnds,
        starts: usize,
        seed: u64,
    ) -> Result<ShootingSolution, ShootingError> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut cold = equal.trajectory.clone();
        cold.phases.iter_mut().for_each(|p| p.costate = None);
        let cold = Guess::earlier(&cold);
        let solved = equal.status.is_success();
        let mut best = equal;
        for start in 0..starts {
            if best.status == Status::Interrupted {
                break;
            }
            let candidate = if start == 0 && solved {
                self.again(&best, ends, None)?
            } else {
                let lengths = mesh.phases.iter().map(|m| random_lengths(m, &mut random));
                let phases = lengths.collect::<Result<_, _>>()?;
                let guess = if solved && start % 2 == 1 { &cold } else { self.guess };
                self.shoot(guess, Mesh { phases }, ends, None)?
            };
            self.starts
                .push(StartRecord { status: candidate.status, objective: candidate.trajectory.objective });
            if self.is_better(&candidate, &best) {
                best = candidate;
            }
        }
        Ok(best)
    }

    fn is_better(&self, candidate: &ShootingSolution, best: &ShootingSolution) -> bool {
        if candidate.status == Status::Interrupted {
            return true;
        }
        let lower = match self.ocp.objective.sense {
            Sense::Minimize => candidate.trajectory.objective < best.trajectory.objective,
            Sense::Maximize => candidate.trajectory.objective > best.trajectory.objective,
        };
        let good =
            |s: &ShootingSolution| (s.status.is_success(), self.smooths() || self.holds(&s.trajectory));
        good(candidate) > good(best) || (good(candidate) == good(best) && lower)
    }

    /// Smaller `eps` as long as the constraints hold, smaller `tau` where they do not, until they hold with the least `eps`.
    /// The last solution for which they do is taken.
    fn shrink(
        &mut self,
        first: ShootingSolution,
        ends: SegmentEnds,
        (mut epsilon, mut tau): (f64, f64),
        transcription: &Transcription,
    ) -> Result<(ShootingSolution, (f64, f64)), ShootingError> {
        let mut found: Option<(ShootingSolution, (f64, f64))> = None;
        let (mut present, mut taus) = (first, 1);
        let (least, most) = (transcription.least_epsilon, transcription.max_refinements + 1);
        for pass in 0..most {
            let excess = excess(self.ocp, &self.inequalities, &present.trajectory).amount;
            let (status, objective) = (present.status, present.trajectory.objective);
            self.passes.push(PassRecord { epsilon, tau, status, objective, excess });
            if !status.is_success() {
                break;
            }
            let holds = excess <= self.settings.shooting.path_tolerance;
            if holds {
                found = Some((present.clone(), (epsilon, tau)));
            }
            if (holds && epsilon <= least) || pass + 1 == most || (!holds && taus == MOST_TAUS) {
                break;
            }
            if holds {
                epsilon = (epsilon * NEXT_EPSILON).max(least);
                taus = 1;
            } else {
                tau *= NEXT_TAU;
                taus += 1;
            }
            self.smooth(epsilon, tau);
            present = self.again(&present, ends, None)?;
        }
        Ok(found.unwrap_or((present, (epsilon, tau))))
    }

    fn finish(self, solution: ShootingSolution) -> Result<PiecewiseSolution, ShootingError> {
        let ShootingSolution { mut trajectory, status, unmet, meshes, report, .. } = solution;
        let excess = excess(self.ocp, &self.inequalities, &trajectory);
        let start = Arc::new(Barycentric::new(&[-1.0])?);
        for (phase, t) in self.ocp.phases.iter().zip(&mut trajectory.phases) {
            // The value of a segment is that at its start.
            let pieces = t.control.segments().iter();
            let pieces = pieces.map(|s| Segment { basis: Arc::clone(&start), values: s.values.clone() });
            t.control = PiecewisePolynomial::new(
                t.control.dimension(),
                t.control.breaks().to_vec(),
                pieces.collect(),
            )?;
            if self.problem.is_some() {
                t.costate = None;
                t.path_multipliers = None;
                if let Some(multipliers) = &mut t.integral_multipliers {
                    multipliers.truncate(phase.integrals.len());
                }
            }
        }
        let last = meshes.last();
        let gain = self.gain.unwrap_or(last.map_or(f64::NAN, |m| m.control_gain));
        let integration_error = last.map_or(f64::NAN, |m| m.integration_error);
        let enough = self.settings.max_refinements == 0 || gain <= self.settings.tolerance;
        Ok(PiecewiseSolution {
            integration_error,
            gain,
            accurate: enough
                && integration_error <= self.settings.shooting.integration_tolerance
                && excess.amount <= self.settings.shooting.path_tolerance,
            trajectory,
            status,
            unmet,
            excess,
            starts: self.starts,
            passes: self.passes,
            meshes: self.meshes,
            report,
        })
    }
}

fn segments_of(trajectory: &Trajectory) -> usize {
    trajectory.phases.iter().map(|p| p.mesh.intervals()).sum()
}

/// Each segment in two equal parts.
fn halved(mesh: &PhaseMesh) -> Result<PhaseMesh, ShootingError> {
    let ends = mesh.fractions();
    let inner = ends.windows(2).flat_map(|w| [0.5 * (w[0] + w[1]), w[1]]);
    let fractions = ends[..1].iter().copied().chain(inner).collect();
    Ok(PhaseMesh::new(fractions, mesh.points().iter().flat_map(|&p| [p, p]).collect())?)
}

fn mesh_of(trajectory: &Trajectory) -> Mesh {
    Mesh { phases: trajectory.phases.iter().map(|p| p.mesh.clone()).collect() }
}

/// Relative gain of richer controls by the estimate of shooting.
fn estimate(solution: &ShootingSolution) -> f64 {
    solution.meshes.last().map_or(f64::NAN, |m| m.control_gain)
}

/// Segments whose lengths are equal ones times random factors.
fn random_lengths(mesh: &PhaseMesh, random: &mut Xoshiro256PlusPlus) -> Result<PhaseMesh, ShootingError> {
    let mut uniform = || (random.next_u64() >> 11) as f64 * (0.5 * f64::EPSILON);
    let mut ends = vec![0.0];
    for k in 0..mesh.intervals() {
        ends.push(ends[k] + (SPREAD * (2.0 * uniform() - 1.0)).exp());
    }
    let whole = ends[mesh.intervals()];
    let fractions = ends.iter().map(|e| e / whole).collect();
    Ok(PhaseMesh::new(fractions, mesh.points().to_vec())?)
}
