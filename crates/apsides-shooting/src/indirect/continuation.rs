//! Continuation: a family of problems is followed from one that is solved to the one that is wanted.
//!
//! The nodes of the last two solutions are extrapolated to the next problem; a solve that fails halves the way, one that converges at
//! once doubles it (E. L. Allgower, K. Georg, Introduction to Numerical Continuation Methods, SIAM 2003, chapter 2).

use apsides_nlp::{Flow, IterationRecord, Observer, Status};
use apsides_ocp::Ocp;

use super::solver::{IndirectShooting, IndirectSolution};
use super::start::{IndirectStart, PhaseStart};
use crate::ShootingError;

/// Settings of the way through a family of problems.
#[derive(Clone, Debug)]
pub struct ContinuationSettings {
    /// First step of the parameter, which runs from 0 to 1; 0.25.
    pub first_step: f64,
    /// Shortest step, below which the family is given up; 1e-4.
    pub shortest_step: f64,
    /// Most problems solved; 200.
    pub max_iterations: usize,
    /// Newton iterations up to which the next step is twice as long; 4.
    pub easy: usize,
}

impl Default for ContinuationSettings {
    fn default() -> Self {
        Self { first_step: 0.25, shortest_step: 1e-4, max_iterations: 200, easy: 4 }
    }
}

/// One problem of a family, solved or not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContinuationRecord {
    /// Parameter of the family.
    pub parameter: f64,
    /// The status of its solve.
    pub status: Status,
    /// Newton iterations.
    pub iterations: usize,
}

/// The last problem that was solved, and the way there.
#[derive(Clone, Debug)]
pub struct Continued {
    /// Its solution; that of a failed solve if the first problem of the family was not solved.
    pub solution: IndirectSolution,
    /// Its parameter: 1 when the problem that is wanted was reached.
    pub parameter: f64,
    /// All solves.
    pub records: Vec<ContinuationRecord>,
}

impl Continued {
    /// True when the problem that is wanted is solved.
    #[must_use]
    pub fn reached(&self) -> bool {
        self.parameter >= 1.0 && self.solution.status.is_success()
    }
}

impl IndirectShooting {
    /// Follows `family(s)` from `s = 0`, solved from `start`, to `s = 1`.
    ///
    /// # Errors
    /// Those of the family and of [`solve`](Self::solve).
    pub fn follow<E: From<ShootingError>>(
        &self,
        family: impl Fn(f64) -> Result<Ocp, E>,
        start: &IndirectStart,
        settings: &ContinuationSettings,
        observer: &mut dyn Observer,
    ) -> Result<Continued, E> {
        let solve = |s: f64, start: &IndirectStart, observer: &mut dyn Observer| {
            Ok::<_, E>(self.solve(&family(s)?, start, observer)?)
        };
        follow_by(solve, start, settings, observer)
    }

    /// Makes the controls that the Hamiltonian is linear in smooth by the square of weight `weight` (see
    /// [`IndirectSettings::smoothing`](super::IndirectSettings)), takes the weight down a thousandfold, and solves at last without it.
    ///
    /// R. Bertrand, R. Epenoy, New smoothing techniques for solving bang-bang optimal control problems, Optim. Control Appl. Methods 23
    /// (2002), doi 10.1002/oca.709.
    ///
    /// # Errors
    /// As [`solve`](Self::solve).
    ///
    /// # Examples
    /// ```
    /// use apsides_shooting::indirect::{ContinuationSettings, IndirectShooting, IndirectStart};
    ///
    /// // The soft landing, from costates that are far from the solution's; its thrust is on from 0.239259 of the time.
    /// let case = apsides_problems::find("moon_lander_soft").ok_or("in the gallery")?.pose()?;
    /// let start = IndirectStart::from_guess(&case.ocp, &case.guess, &[[vec![0.5, -1.0, 0.5], vec![0.5, -1.0, 0.5]]], 1)?;
    /// let settings = ContinuationSettings::default();
    /// let continued = IndirectShooting::default().solve_smoothed(&case.ocp, &start, 1.0, &settings, &mut ())?;
    /// assert!(continued.solution.status.is_success());
    /// assert_eq!(continued.solution.switches[0].len(), 1);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn solve_smoothed(
        &self,
        ocp: &Ocp,
        start: &IndirectStart,
        weight: f64,
        settings: &ContinuationSettings,
        observer: &mut dyn Observer,
    ) -> Result<Continued, ShootingError> {
        let solve = |s: f64, start: &IndirectStart, observer: &mut dyn Observer| {
            let mut method = self.clone();
            method.settings.smoothing = weight * 1e-3_f64.powf(s);
            method.solve(ocp, start, observer)
        };
        let mut continued = follow_by(solve, start, settings, observer)?;
        if continued.solution.status.is_success() {
            let sharp = self.solve(ocp, &continued.solution.nodes, observer)?;
            continued.records.push(ContinuationRecord {
                parameter: f64::INFINITY,
                status: sharp.status,
                iterations: sharp.iterations,
            });
            continued.solution = sharp;
        }
        Ok(continued)
    }
}

fn follow_by<E>(
    solve: impl Fn(f64, &IndirectStart, &mut dyn Observer) -> Result<IndirectSolution, E>,
    start: &IndirectStart,
    settings: &ContinuationSettings,
    observer: &mut dyn Observer,
) -> Result<Continued, E> {
    let mut interrupted = false;
    let mut watch = |record: &IterationRecord| {
        let flow = observer.iteration(record);
        interrupted |= flow == Flow::Stop;
        flow
    };
    let first = solve(0.0, start, &mut watch)?;
    let record = |parameter: f64, s: &IndirectSolution| ContinuationRecord {
        parameter,
        status: s.status,
        iterations: s.iterations,
    };
    let mut continued = Continued { records: vec![record(0.0, &first)], solution: first, parameter: 0.0 };
    let mut before: Option<(f64, IndirectStart)> = None;
    let mut step = settings.first_step;
    while continued.solution.status.is_success()
        && continued.parameter < 1.0
        && continued.records.len() < settings.max_iterations
    {
        let next = (continued.parameter + step).min(1.0);
        let nodes = &continued.solution.nodes;
        let guess = match &before {
            Some((s, earlier)) => {
                extrapolated(earlier, nodes, (next - continued.parameter) / (continued.parameter - s))
            }
            None => nodes.clone(),
        };
        let solution = solve(next, &guess, &mut watch)?;
        continued.records.push(record(next, &solution));
        if solution.status.is_success() {
            if solution.iterations <= settings.easy {
                step *= 2.0;
            }
            let last = std::mem::replace(&mut continued.solution, solution);
            before = Some((continued.parameter, last.nodes));
            continued.parameter = next;
        } else {
            step *= 0.5;
            if solution.status == Status::Interrupted || step < settings.shortest_step {
                break;
            }
        }
    }
    Ok(continued)
}

/// `b + factor (b - a)`, where the times stay in order; else `b`.
fn extrapolated(a: &IndirectStart, b: &IndirectStart, factor: f64) -> IndirectStart {
    let value = |a: f64, b: f64| b + factor * (b - a);
    let row = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| value(*a, *b)).collect() };
    let rows = |a: &[Vec<f64>], b: &[Vec<f64>]| -> Vec<Vec<f64>> {
        a.iter().zip(b).map(|(a, b)| row(a, b)).collect()
    };
    let phase = |(a, b): (&PhaseStart, &PhaseStart)| PhaseStart {
        initial_time: value(a.initial_time, b.initial_time),
        final_time: value(a.final_time, b.final_time),
        fractions: b.fractions.clone(),
        states: rows(&a.states, &b.states),
        costates: rows(&a.costates, &b.costates),
        controls: b.controls.clone(),
    };
    let moved = IndirectStart {
        phases: a.phases.iter().zip(&b.phases).map(phase).collect(),
        chained: false,
        parameters: row(&a.parameters, &b.parameters),
        constraint_multipliers: match (&a.constraint_multipliers, &b.constraint_multipliers) {
            (Some(a), Some(b)) => Some(rows(a, b)),
            _ => None,
        },
    };
    let ordered = moved.phases.iter().all(|p| p.final_time > p.initial_time);
    if ordered { moved } else { b.clone() }
}
