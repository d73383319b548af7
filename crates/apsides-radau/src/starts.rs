//! Second starts, where the first mesh could not be solved from a guess.
//!
//! Far from a solution an objective leads astray: a least time pulls to times that no control can meet, and Newton's method wanders
//! among stationary points of the discretised problem. An easier problem has the same constraints, and asks for the controls and times
//! closest to the guess. Its solution is a start that meets all constraints. Equalities of controls, such as a direction of length one,
//! have no gradient in the middle of what they enclose: the problem in which they hold to one side alone has that middle inside.

use apsides_ad::{FormulaBuilder, formula_node};
use apsides_nlp::{Observer, Side, Status};
use apsides_ocp::{EndpointInput, Guess, Integral, Mesh, Objective, Ocp, Scaling, Sense, Variable};

use crate::RadauError;
use crate::flown::{Flight, fly};
use crate::least_relaxation::Relaxer;
use crate::solver::{MeshRecord, Radau, RadauSolution, may_go_on};
use crate::spread_flights::{closest_flights, has_free_starts};
use crate::state_bounds::without_arcs;

/// Iterations on a first mesh from a guess, before another start is tried.
const MOST_ITERATIONS: usize = 300;

/// Iterations on a first mesh from a guess that was moved to where constraints have a gradient, when the problem looks infeasible.
const MOST_ITERATIONS_WITHOUT_GRADIENT: usize = 100;

/// Ways around what constraints forbid that are solved on finer meshes, and the work of one, in points times iterations, after which there is no other.
const MOST_WAYS: usize = 2;
const MOST_WORK: usize = 100_000;

/// A gain of the objective, relative, by which a solution is another one.
const LEAST_GAIN: f64 = 1e-6;

/// A second start.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Second {
    /// The solution of the problem whose equalities of controls hold to one side alone.
    OneSided(Side),
    /// The guess itself, with short steps.
    Careful,
    /// The guess with swinging controls.
    Swung,
    /// The feasible trajectory closest to the guess.
    Closest,
    /// The guess itself, with all iterations of the settings.
    Patient,
}

impl Second {
    /// The starts to try after one that ended so.
    fn after(status: Status) -> &'static [Self] {
        use Second::{Careful, Closest, OneSided, Patient, Swung};
        match status {
            // The guess itself may have no way out, or the objective may have led to times that are too short.
            Status::Infeasible => &[OneSided(Side::Upper), OneSided(Side::Lower), Swung, Closest],
            Status::IterationLimit => {
                &[OneSided(Side::Upper), OneSided(Side::Lower), Careful, Closest, Patient]
            }
            _ => &[OneSided(Side::Upper), OneSided(Side::Lower), Careful, Closest],
        }
    }
}

/// Solves of a problem from one start after the other.
struct Solves<'a> {
    ocp: &'a Ocp,
    mesh: &'a Mesh,
    observer: &'a mut dyn Observer,
    /// The meshes of all of them.
    meshes: Vec<MeshRecord>,
}

impl Solves<'_> {
    fn solve(
        &mut self,
        radau: &Radau,
        ocp: &Ocp,
        guess: Guess,
        most: usize,
    ) -> Result<RadauSolution, RadauError> {
        let most = most.min(radau.settings.nlp.max_iterations);
        let solution = radau.solve_from_guess(ocp, guess, self.mesh.clone(), most, self.observer)?;
        self.meshes.extend(solution.meshes.iter().cloned());
        Ok(solution)
    }

    /// The solution of another problem on the first mesh as a start; an error of an attempt that must not go on is its status.
    fn through(
        &mut self,
        radau: &Radau,
        other: &Ocp,
        guess: &Guess,
    ) -> Result<Result<Option<Guess>, Status>, RadauError> {
        let mut once = radau.clone();
        once.settings.max_refinements = 0;
        let solution = self.solve(&once, other, guess.clone(), MOST_ITERATIONS)?;
        Ok(match solution.status {
            s if s.is_success() => Ok(Some(Guess::along(&solution.trajectory)?)),
            s if may_go_on(s) => Ok(None),
            s => Err(s),
        })
    }

    /// A solution from a bend of the guess around what path constraints forbid along it, if there is any: that bend whose solution on the first mesh
    /// costs least, or the next one where finer meshes show that this leaps over a wall. An error of an attempt that must not go on is
    /// its status.
    fn around(
        &mut self,
        radau: &Radau,
        guess: &Guess,
    ) -> Result<Result<Option<RadauSolution>, Status>, RadauError> {
        let sign = self.ocp.objective.sense.sign();
        let mut once = radau.clone();
        once.settings.max_refinements = 0;
        let mut ways: Vec<(f64, Guess)> = Vec::new();
        for start in guess.around(self.ocp) {
            let found = self.solve(&once, self.ocp, start, MOST_ITERATIONS)?;
            if !may_go_on(found.status) {
                return Ok(Err(found.status));
            }
            if found.status.is_success() {
                ways.push((sign * found.trajectory.objective, Guess::along(&found.trajectory)?));
            }
        }
        ways.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut best: Option<RadauSolution> = None;
        for (_, start) in ways.into_iter().take(MOST_WAYS) {
            let found = self.solve(radau, self.ocp, start, MOST_ITERATIONS)?;
            if !may_go_on(found.status) {
                return Ok(Err(found.status));
            }
            let is_accurate = found.accurate;
            let work: usize = found.meshes.iter().map(|m| m.points * m.counters.iterations).sum();
            if found.status.is_success() && (best.is_none() || is_accurate) {
                best = Some(found);
            }
            if is_accurate || work > MOST_WORK {
                break;
            }
        }
        Ok(Ok(best))
    }

    /// The better one of a solution and that from the feasible trajectory closest to the guess.
    fn or_from_closest(
        &mut self,
        radau: &Radau,
        guess: &Guess,
        first: RadauSolution,
    ) -> Result<RadauSolution, RadauError> {
        let before = self.meshes.len();
        let found = self.better_from_closest(radau, guess, &first)?;
        let mut meshes = std::mem::take(&mut self.meshes);
        Ok(match found {
            Ok(second) => RadauSolution { meshes, ..second },
            Err(status) => {
                // Work that led nowhere counts with the first mesh, as that of a look beyond a saddle does with its own.
                for spent in meshes.drain(before..).collect::<Vec<_>>() {
                    if let Some(record) = meshes.first_mut() {
                        record.add_work_of(&spent);
                    }
                }
                let status = if may_go_on(status) { first.status } else { status };
                RadauSolution { meshes, status, ..first }
            }
        })
    }

    /// A better solution from the feasible trajectory closest to the guess; an error where there is none, with the status of the last solve.
    fn better_from_closest(
        &mut self,
        radau: &Radau,
        guess: &Guess,
        first: &RadauSolution,
    ) -> Result<Result<RadauSolution, Status>, RadauError> {
        let Some(other) = easier(self.ocp, guess) else { return Ok(Err(first.status)) };
        let start = match self.through(radau, &other, guess)? {
            Ok(Some(start)) => start,
            Ok(None) => return Ok(Err(first.status)),
            Err(status) => return Ok(Err(status)),
        };
        let sign = self.ocp.objective.sense.sign();
        let gain = |before: f64, after: f64| {
            let size = before.abs().max(after.abs());
            if size > 0.0 { sign * (before - after) / size } else { 0.0 }
        };
        // On the same mesh the same optimum has the same objective.
        let mut once = radau.clone();
        once.settings.max_refinements = 0;
        let coarse = self.solve(&once, self.ocp, start, MOST_ITERATIONS)?;
        let before = first.meshes.first().map_or(f64::NAN, |m| m.objective);
        if !(coarse.status.is_success() && gain(before, coarse.trajectory.objective) > LEAST_GAIN) {
            return Ok(Err(coarse.status));
        }
        let start = Guess::along(&coarse.trajectory)?;
        let second = self.solve(radau, self.ocp, start, MOST_ITERATIONS)?;
        let least = if first.accurate { LEAST_GAIN } else { -LEAST_GAIN };
        let is_better = second.status.is_success()
            && (second.accurate || !first.accurate)
            && gain(first.trajectory.objective, second.trajectory.objective) > least;
        Ok(if is_better { Ok(second) } else { Err(second.status) })
    }
}

impl Radau {
    /// Solves from a guess; where that leads nowhere on the first mesh, from other starts, and where a mesh that need not carry the
    /// motion leaves no feasible point, on one that does.
    pub(crate) fn solve_with_starts(
        &self,
        ocp: &Ocp,
        guess: &Guess,
        mesh: &Mesh,
        observer: &mut dyn Observer,
    ) -> Result<RadauSolution, RadauError> {
        let mut solution = self.solve_on_first_mesh(ocp, guess, mesh, observer)?;
        let is_stuck = |s: &RadauSolution| s.status == Status::Infeasible && self.is_patient();
        // A start that is free, such as a velocity after an impulse, says more of the flight than a mesh that carries the motion from any.
        let starts_anywhere = has_free_starts(ocp);
        if starts_anywhere && is_stuck(&solution) {
            solution = self.solve_from_flights(ocp, guess, mesh, solution, observer)?;
        }
        if is_stuck(&solution) {
            solution = self.solve_on_mesh_of_motion(ocp, guess, mesh, solution, observer)?;
        }
        if !starts_anywhere && is_stuck(&solution) {
            solution = self.solve_from_flights(ocp, guess, mesh, solution, observer)?;
        }
        Ok(solution)
    }

    /// Solves from flights that are spread over what the bounds of controls and times allow; the solution as it is where none leads on.
    fn solve_from_flights(
        &self,
        ocp: &Ocp,
        guess: &Guess,
        mesh: &Mesh,
        mut infeasible: RadauSolution,
        observer: &mut dyn Observer,
    ) -> Result<RadauSolution, RadauError> {
        for start in closest_flights(ocp, guess, mesh)? {
            let most = MOST_ITERATIONS.min(self.settings.nlp.max_iterations);
            let solution = self.solve_from_guess(ocp, start, mesh.clone(), most, observer)?;
            infeasible.meshes.extend(solution.meshes.iter().cloned());
            if solution.report.status.is_success() || !may_go_on(solution.status) {
                return Ok(RadauSolution { meshes: infeasible.meshes, ..solution });
            }
        }
        Ok(infeasible)
    }

    /// True unless the settings allow few iterations: then a solve that led nowhere was one of several, and ends at once.
    fn is_patient(&self) -> bool {
        MOST_ITERATIONS < self.settings.nlp.max_iterations
    }

    /// Solves on a mesh that carries the motion, from where it meets all requirements; the solution as it is where they conflict on such
    /// a mesh too, with the motion that misses them least as its trajectory.
    ///
    /// On a coarse mesh the collocated equations are not those of the motion: an oscillation that turns by radians in an interval
    /// is damped or lost, and no polynomial of the mesh meets the ends.
    fn solve_on_mesh_of_motion(
        &self,
        ocp: &Ocp,
        guess: &Guess,
        mesh: &Mesh,
        mut infeasible: RadauSolution,
        observer: &mut dyn Observer,
    ) -> Result<RadauSolution, RadauError> {
        let reached = &infeasible.trajectory;
        let mut starts = vec![(Guess::earlier(reached), without_arcs(reached.mesh()))];
        match fly(ocp, guess, mesh)? {
            Flight::IsCarried(_) => return Ok(infeasible),
            Flight::TakesMore(flown, finer) => starts.insert(0, (flown, finer)),
            Flight::Fails => {}
        }
        let relaxer = Relaxer::for_start(ocp, &self.settings)?;
        let mut least = f64::INFINITY;
        let mut unsolved = None;
        for (start, mesh) in starts {
            let nearest = relaxer.relax(&start, &mesh, None, observer)?;
            infeasible.meshes.extend(nearest.meshes.iter().cloned());
            let status = nearest.result.report.status;
            if !may_go_on(status) {
                return Ok(RadauSolution { status, ..infeasible });
            }
            if !status.is_success() {
                continue;
            }
            let motion = nearest.nlp.trajectory(ocp, &nearest.result.report)?;
            if nearest.meets_all() {
                let start = Guess::along(&motion)?;
                let solution = self.solve_from_guess(ocp, start, nearest.mesh, usize::MAX, observer)?;
                infeasible.meshes.extend(solution.meshes.iter().cloned());
                if solution.report.status.is_success() || !may_go_on(solution.status) {
                    return Ok(RadauSolution { meshes: infeasible.meshes, ..solution });
                }
                unsolved = Some(RadauSolution { trajectory: motion, unmet: None, ..solution });
            } else if nearest.result.report.objective < least {
                least = nearest.result.report.objective;
                infeasible.trajectory = motion;
            }
        }
        // What meets all requirements is not infeasible, though nothing better was found from there.
        Ok(match unsolved {
            Some(solution) => RadauSolution { meshes: infeasible.meshes, ..solution },
            None => infeasible,
        })
    }

    /// Solves from a guess; where that leads nowhere on the first mesh, from other starts.
    fn solve_on_first_mesh(
        &self,
        ocp: &Ocp,
        guess: &Guess,
        mesh: &Mesh,
        observer: &mut dyn Observer,
    ) -> Result<RadauSolution, RadauError> {
        if guess.phases.iter().any(|g| g.as_trajectory().is_some()) {
            return self.solve_from_guess(ocp, guess.clone(), mesh.clone(), usize::MAX, observer);
        }
        let leads_on =
            |s: &RadauSolution| s.status.is_success() || s.meshes.len() > 1 || !may_go_on(s.status);
        let mut solves = Solves { ocp, mesh, observer, meshes: Vec::new() };
        let mut first = solves.solve(self, ocp, guess.clone(), MOST_ITERATIONS)?;
        let is_missed = !first.status.is_success()
            || (!first.accurate && Guess::earlier(&first.trajectory).is_blocked(ocp));
        if is_missed && may_go_on(first.status) {
            match solves.around(self, guess)? {
                Ok(Some(around)) => return Ok(RadauSolution { meshes: solves.meshes, ..around }),
                Ok(None) => {}
                Err(status) => first.status = status,
            }
        }
        // By way of the constraints alone: the objective had no say in which of several optima that led to.
        if first.status.is_success() && first.meshes.first().is_some_and(|m| m.restorations > 0) {
            return solves.or_from_closest(self, guess, first);
        }
        if leads_on(&first) {
            return Ok(first);
        }
        let has_free_times = ocp.phases.iter().any(|phase| !phase.final_time.is_fixed());
        for second in Second::after(first.status) {
            let mut most = MOST_ITERATIONS;
            let mut radau = self.clone();
            let start = match second {
                Second::OneSided(side) => match one_sided(ocp, *side) {
                    Some(other) => solves.through(self, &other, guess)?,
                    None => Ok(None),
                },
                // For an objective that moves no times the constraints are as hard to meet.
                Second::Closest if first.status == Status::Infeasible && !has_free_times => Ok(None),
                Second::Closest => match easier(ocp, guess) {
                    Some(other) => solves.through(self, &other, guess)?,
                    None => Ok(None),
                },
                Second::Careful => {
                    radau.settings = self.settings.careful();
                    Ok(Some(guess.clone()))
                }
                Second::Swung => {
                    most = MOST_ITERATIONS_WITHOUT_GRADIENT;
                    Ok(guess.swung(ocp))
                }
                Second::Patient => {
                    most = usize::MAX;
                    Ok(self.is_patient().then(|| guess.clone()))
                }
            };
            let start = match start {
                Ok(Some(start)) => start,
                Ok(None) => continue,
                Err(status) => return Ok(RadauSolution { meshes: solves.meshes, status, ..first }),
            };
            let solution = solves.solve(&radau, solves.ocp, start, most)?;
            if leads_on(&solution) || *second == Second::Patient {
                return Ok(RadauSolution { meshes: solves.meshes, ..solution });
            }
        }
        Ok(RadauSolution { meshes: solves.meshes, ..first })
    }
}

/// The problem in which equalities of path constraints that controls enter nonlinearly hold to one side alone; none if there are none.
fn one_sided(ocp: &Ocp, side: Side) -> Option<Ocp> {
    let mut other = ocp.clone();
    let mut any = false;
    for phase in &mut other.phases {
        let binding: Vec<bool> = phase.path.iter().map(|c| phase.binds_controls(c)).collect();
        for (constraint, _) in phase.path.iter_mut().zip(binding).filter(|(_, binds)| *binds) {
            for row in constraint.rows.iter_mut().filter(|row| row.bounds.is_fixed()) {
                any = true;
                match side {
                    Side::Upper => row.bounds.lower = f64::NEG_INFINITY,
                    Side::Lower => row.bounds.upper = f64::INFINITY,
                }
            }
        }
    }
    any.then_some(other)
}

/// The problem with the mean square distance of its controls from the constant ones in the middle of the guess, in their scales, and the
/// squares of relative changes of final times as objective; none where it has neither.
pub(crate) fn easier(ocp: &Ocp, guess: &Guess) -> Option<Ocp> {
    let scaling = Scaling::new(ocp, guess);
    let mut easier = Ocp { objective: distance(), ..ocp.clone() };
    for (k, (phase, guess)) in easier.phases.iter_mut().zip(&guess.phases).enumerate() {
        let duration = guess.final_time - guess.initial_time;
        let first = phase.states.len();
        let mut middle = vec![0.0; phase.controls.len()];
        guess.control(0.5, &mut middle);
        let mut formula = FormulaBuilder::new(first + middle.len() + 1);
        let mut parts = Vec::new();
        for ((c, middle), scale) in middle.iter().enumerate().zip(&scaling.phases[k].controls) {
            let control = formula.input(first + c);
            parts.push(square_of_change(&mut formula, control, *middle, *scale));
        }
        if let Some(sum) = parts.into_iter().reduce(|a, b| formula.add(a, b)) {
            let variable =
                Variable::new("distance of the controls", phase.time_unit.clone()).scaled_by(duration);
            phase
                .integrals
                .push(Integral { variable, function: formula_node(formula.formula(&[sum]).ok()?) });
            easier.objective.integrals.push((k, phase.integrals.len() - 1, 1.0 / duration));
        }
        if !phase.final_time.is_fixed() {
            let mut formula = FormulaBuilder::new(1);
            let end = formula.input(0);
            let change = square_of_change(&mut formula, end, guess.final_time, duration);
            let function = formula_node(formula.formula(&[change]).ok()?);
            easier.objective.functions.push((vec![EndpointInput::FinalTime { phase: k }], function));
        }
    }
    let has_any = !(easier.objective.integrals.is_empty() && easier.objective.functions.is_empty());
    has_any.then_some(easier)
}

fn square_of_change(
    formula: &mut FormulaBuilder,
    value: apsides_ad::Value,
    from: f64,
    scale: f64,
) -> apsides_ad::Value {
    let (from, weight) = (formula.constant(from), formula.constant(1.0 / scale));
    let change = formula.sub(value, from);
    let change = formula.mul(change, weight);
    formula.square(change)
}

fn distance() -> Objective {
    Objective {
        name: "distance from the guess".into(),
        unit: "-".into(),
        sense: Sense::Minimize,
        linear: Vec::new(),
        integrals: Vec::new(),
        functions: Vec::new(),
        scale: None,
    }
}
