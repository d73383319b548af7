//! Pontryagin's conditions by `apsides-shooting`.

use apsides_nlp::{Observer, Status};
use apsides_ocp::{Guess, Trajectory};
use apsides_shooting::indirect::{IndirectSettings, IndirectShooting, IndirectSolution, IndirectStart};

use super::Solution;
use crate::key::{Key, Range};
use crate::missions::Posed;
use crate::{Counters, Error, Mission};

pub(super) const KEYS: &[Key] = &[
    Key::count("indirect.segments", 1, 1, 1000, "shooting segments per phase"),
    Key::number("indirect.tolerance", 1e-9, Range::open(0.0, 1.0), "largest scaled correction of a solution"),
    Key::number(
        "indirect.integration_tolerance",
        1e-12,
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
                let start = IndirectStart::from_guess(ocp, guess, costates, segments)?;
                Some(method.fly_start(ocp, &start)?)
            }
            _ => None,
        };
        let first = known.map(|start| method.solve(ocp, &start, observer)).transpose()?;
        let (spent, stopped) =
            first.as_ref().map_or((0, false), |s| (s.iterations, s.status == Status::Interrupted));
        match first {
            Some(IndirectSolution { trajectory: Some(t), .. }) if stopped => {
                return Ok(Solution { status: Status::Interrupted, ..unsolved(t) });
            }
            Some(solution) if solution.status.is_success() && solution.exceeded.is_empty() => {
                return Ok(of_shooting(solution, 0, Vec::new()));
            }
            _ => {}
        }
        let collocated = self.solve_by_radau(ocp, guess, start, observer)?;
        if !collocated.status.is_success() {
            return Ok(collocated);
        }
        let mut warnings = collocated.warnings;
        if spent > 0 {
            warnings.push(format!(
                "shooting from the mission's own costates gave no solution in {spent} iterations; it starts from a collocation"
            ));
        }
        let start = IndirectStart::from_trajectory(&collocated.trajectory, segments)?;
        let solution = method.solve(ocp, &start, observer)?;
        let spent = spent + collocated.counters.iterations;
        if solution.trajectory.is_some() {
            return Ok(of_shooting(solution, spent, warnings));
        }
        let shortfall =
            "shooting from the costates of this collocation gave no solution; raise `indirect.segments`";
        Ok(Solution { warnings, shortfall: Some(shortfall.into()), ..unsolved(collocated.trajectory) })
    }

    fn indirect_shooting(&self) -> IndirectShooting {
        IndirectShooting {
            settings: IndirectSettings {
                tolerance: self.values.number("indirect.tolerance"),
                integration_tolerance: self.values.number("indirect.integration_tolerance"),
                ..IndirectSettings::default()
            },
        }
    }
}

/// A trajectory that is not a solution.
fn unsolved(trajectory: Trajectory) -> Solution {
    Solution {
        trajectory,
        status: Status::StepTooSmall,
        shortfall: None,
        counters: Counters::default(),
        report: None,
        unmet: None,
        warnings: Vec::new(),
        switches: Vec::new(),
    }
}

/// `spent` iterations came before.
fn of_shooting(solution: IndirectSolution, spent: usize, warnings: Vec<String>) -> Solution {
    let exceeded: Vec<String> = solution
        .exceeded
        .iter()
        .map(|e| format!("phase `{}`, `{}` by {:.3e} {}", e.phase, e.name, e.amount, e.unit))
        .collect();
    let shortfall = (!exceeded.is_empty()).then(|| {
        format!(
            "limits along the flight that indirect shooting does not impose are exceeded ({}); set `method` = \"radau\"",
            exceeded.join("; ")
        )
    });
    let failure = solution
        .failure
        .map(|f| format!("segment {} of phase {} cannot be integrated", f.segment + 1, f.phase + 1));
    let switches = solution.switches.iter().enumerate().flat_map(|(k, list)| {
        list.iter().map(move |s| {
            let to = if s.rises { "upper" } else { "lower" };
            format!("phase {}, control {}: to its {to} bound at {:.6} s", k + 1, s.control + 1, s.time)
        })
    });
    Solution {
        status: solution.status,
        shortfall,
        counters: Counters {
            iterations: spent + solution.iterations,
            factorisations: spent + solution.iterations,
            variables: solution.unknowns,
            constraints: solution.unknowns,
            mesh_iterations: 1,
        },
        report: None,
        unmet: failure,
        warnings,
        switches: switches.collect(),
        ..unsolved(solution.trajectory.unwrap_or_else(|| Trajectory {
            phases: Vec::new(),
            parameters: Vec::new(),
            objective: f64::NAN,
            constraint_multipliers: None,
        }))
    }
}
