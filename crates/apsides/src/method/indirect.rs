//! Pontryagin's conditions by `apsides-shooting`.

use apsides_nlp::{Observer, Status};
use apsides_ocp::{Guess, Trajectory};
use apsides_shooting::indirect::{IndirectSettings, IndirectShooting, IndirectSolution, IndirectStart};

use super::{Shortfall, Solution};
use crate::key::{Key, Range};
use crate::missions::Posed;
use crate::{Counters, Error, Mission};

pub(super) const KEYS: &[Key] = &[
    Key::count("indirect.segments", 1, 1, 1000, "shooting segments per phase"),
    Key::number("indirect.tolerance", 1e-9, Range::open(0.0, 1.0), "largest scaled correction of a solution"),
    Key::number(
        "indirect.integration_tolerance",
        1e-11,
        Range::open(0.0, 1.0),
        "relative tolerance of the integration",
    ),
];

impl Mission {
    /// Solves from the costates of `start`, else of the mission's own guess. Where there are none, or where they lead nowhere, those of
    /// a collocation are taken.
    pub(super) fn solve_by_indirect_shooting(
        &self,
        posed: &Posed,
        guess: &Guess,
        start: Option<&Trajectory>,
        observer: &mut dyn Observer,
    ) -> Result<Solution, Error> {
        let method = self.indirect_shooting();
        let segments = self.values.count("indirect.segments");
        let ocp = &posed.ocp;
        let known = match (start.filter(|t| t.phases.iter().all(|p| p.costate.is_some())), &posed.costates) {
            (Some(t), _) => Some(IndirectStart::from_trajectory(t, segments)?),
            (None, Some(costates)) if start.is_none() => {
                Some(IndirectStart::from_guess(ocp, guess, costates, segments)?.chained())
            }
            _ => None,
        };
        let mut spent = 0;
        let mut warnings = Vec::new();
        if let Some(start) = known {
            let solution = method.solve(ocp, &start, observer)?;
            spent = solution.iterations;
            let good = solution.status.is_success() && solution.exceeded.is_empty();
            match solution.trajectory.clone() {
                Some(t) if good || solution.status == Status::Interrupted => {
                    return Ok(of_shooting(&solution, t, spent, warnings));
                }
                _ => warnings.push(format!(
                    "shooting from the costates at hand gave no flight in {spent} iterations; it starts from a collocation"
                )),
            }
        }
        let collocated = self.solve_by_radau(ocp, guess, start, observer)?;
        if !collocated.status.is_success() {
            return Ok(collocated);
        }
        let start = IndirectStart::from_trajectory(&collocated.trajectory, segments)?;
        let solution = method.solve(ocp, &start, observer)?;
        warnings.extend(collocated.warnings.iter().cloned());
        if let Some(t) = solution.trajectory.clone().filter(|_| solution.status.is_success()) {
            spent += collocated.counters.iterations + solution.iterations;
            return Ok(of_shooting(&solution, t, spent, warnings));
        }
        let text = format!(
            "shooting from the costates of a collocation: {}; this is the collocation. Raise `indirect.segments`, or set `method` = \
             \"radau\" where controls are neither between bounds by themselves nor switch between them (singular arcs)",
            solution.status
        );
        let shortfall = Some(Shortfall { status: "not-converged", text });
        Ok(Solution { warnings, shortfall, ..collocated })
    }

    fn indirect_shooting(&self) -> IndirectShooting {
        IndirectShooting {
            settings: IndirectSettings {
                tolerance: self.values.number("indirect.tolerance"),
                integration_tolerance: self.values.number("indirect.integration_tolerance"),
                threads: self.threads,
                ..IndirectSettings::default()
            },
        }
    }
}

/// A trajectory found by shooting in so many iterations of all methods.
fn of_shooting(
    solution: &IndirectSolution,
    trajectory: Trajectory,
    iterations: usize,
    warnings: Vec<String>,
) -> Solution {
    let exceeded: Vec<String> = solution
        .exceeded
        .iter()
        .map(|e| format!("phase `{}`, `{}` by {:.3e} {}", e.phase, e.name, e.amount, e.unit))
        .collect();
    let shortfall = (!exceeded.is_empty()).then(|| Shortfall {
        status: "limits-exceeded",
        text: format!(
            "limits along the flight that indirect shooting does not impose are exceeded ({}); set `method` = \"radau\"",
            exceeded.join("; ")
        ),
    });
    let switches = solution.switches.iter().enumerate().flat_map(|(k, list)| {
        list.iter().map(move |s| {
            let to = if s.rises { "upper" } else { "lower" };
            format!("phase {}, control {}: to its {to} bound at {:.6} s", k + 1, s.control + 1, s.time)
        })
    });
    Solution {
        trajectory,
        status: solution.status,
        shortfall,
        counters: Counters {
            iterations,
            factorisations: iterations,
            variables: solution.unknowns,
            constraints: solution.unknowns,
            mesh_iterations: 1,
        },
        report: None,
        unmet: None,
        warnings,
        switches: switches.collect(),
        search: None,
    }
}
