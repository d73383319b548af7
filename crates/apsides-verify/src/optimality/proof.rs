//! The least Hamiltonian over the control set, proved at some points of a phase by branch and bound on the formulas of the phase.

use apsides_ad::{Expansion, Formula, NodeFunction};

use super::PhaseConditions;
use super::branch_and_bound::{Between, Least, LimitedRow, Outcome, Part};
use super::control_set::ControlSet;
use super::search::{Found, Search};

/// Points of a phase at which the least Hamiltonian is proved, at most.
const POINTS: usize = 24;
/// Boxes of controls that are divided in a phase, and at one of its points, at most.
const BOXES: usize = 20_000;
const BOXES_OF_A_POINT: usize = 5_000;

/// The outcome of the proof.
#[derive(Default)]
pub(super) struct Proof {
    /// The controls with a smaller Hamiltonian than that of the trajectory and of those searched before: number of the point and Hamiltonian.
    pub(super) better: Vec<(usize, Found)>,
    /// The reason why it is no proof, in words.
    pub(super) remark: Option<String>,
    /// Infinite ranges of controls may hold something better.
    pub(super) is_open_far_away: bool,
}

/// A point at which the control set was searched.
pub(super) struct Searched<'s> {
    pub(super) segment: usize,
    pub(super) time: f64,
    /// The least Hamiltonian found, and its control.
    pub(super) least: &'s Found,
}

/// A function of a phase, in which controls may occur, and its part in the Hamiltonian.
struct PhaseFormula {
    formula: Formula,
    takes_parameters: bool,
    role: Role,
}

#[derive(Clone, Copy)]
enum Role {
    Motion,
    Integrand(usize),
    /// Path constraints from this row on.
    Path(usize),
}

impl PhaseConditions<'_> {
    /// Proves the least Hamiltonian at some of the points that were searched, to within `allowed`.
    pub(super) fn prove(&mut self, set: &ControlSet, points: &[Searched<'_>], allowed: f64) -> Proof {
        let mut proof = Proof::default();
        let Some(formulas) = self.formulas(set) else {
            proof.remark = Some("a function of the phase is no formula".to_owned());
            proof.is_open_far_away = true;
            return proof;
        };
        let mut budget = BOXES;
        for k in spread(points.len()) {
            let Searched { segment, time, least } = &points[k];
            let mut best: Found = (*least).clone();
            let mut left = budget.min(BOXES_OF_A_POINT);
            let before = left;
            let outcome = self.prove_at(set, &formulas, (*segment, *time), &mut best, allowed, &mut left);
            budget -= before - left;
            if best.0 < least.0 {
                proof.better.push((k, best));
            }
            if outcome != Outcome::Proved {
                let reason =
                    if left == 0 { format!(" with {before} boxes of controls") } else { String::new() };
                proof.remark.get_or_insert_with(|| format!("not settled at t = {time:.6}{reason}"));
            }
            proof.is_open_far_away |= outcome == Outcome::OpenFarAway;
        }
        proof
    }

    fn prove_at(
        &mut self,
        set: &ControlSet,
        formulas: &[PhaseFormula],
        (segment, time): (usize, f64),
        best: &mut Found,
        allowed: f64,
        budget: &mut usize,
    ) -> Outcome {
        self.evaluate(segment, time);
        let own = self.point.u.clone();
        let parts = formulas.iter().map(|f| self.part(f, set)).collect();
        let bounds = self.equations.phase.controls.iter().map(|c| [c.bounds.lower, c.bounds.upper]);
        let root: Vec<Between> = bounds.collect();
        let met: Vec<Between> = set.lower.iter().zip(&set.upper).map(|(a, b)| [*a, *b]).collect();
        let (lower, upper): (Vec<f64>, Vec<f64>) = root.iter().map(|[a, b]| (*a, *b)).unzip();
        let places = [self.place()];
        let search =
            Search { equations: &self.equations, set, lower: &lower, upper: &upper, places: &places };
        let mut improve = |middle: &[f64], steps: &[f64], than: f64| {
            let start = search.one(0, middle).filter(|(h, _)| *h < than)?;
            search.descend([(0, start)], steps).pop()
        };
        Least::new(parts, &own, &met).search(&root, best, allowed, budget, &mut improve)
    }

    /// The functions that enter the Hamiltonian, and the path constraints in which controls occur; none if one is no formula.
    fn formulas(&self, set: &ControlSet) -> Option<Vec<PhaseFormula>> {
        let phase = self.equations.phase;
        let mut formulas = Vec::new();
        let mut add = |function: &dyn NodeFunction, role: Role| -> Option<()> {
            let takes_parameters = phase.takes_parameters(function);
            formulas.push(PhaseFormula { formula: function.formula().ok()?, takes_parameters, role });
            Some(())
        };
        add(phase.dynamics.as_ref(), Role::Motion)?;
        for (q, integral) in phase.integrals.iter().enumerate() {
            if self.equations.weight(q) != 0.0 {
                add(integral.function.as_ref(), Role::Integrand(q))?;
            }
        }
        let mut first = 0;
        for path in &phase.path {
            let rows = first..first + path.rows.len();
            if set.rows.iter().any(|r| rows.contains(&r.row)) {
                add(path.function.as_ref(), Role::Path(first))?;
            }
            first = rows.end;
        }
        Some(formulas)
    }

    /// A function at the point as it was evaluated.
    fn part(&self, function: &PhaseFormula, set: &ControlSet) -> Part {
        let (equations, point) = (&self.equations, &self.point);
        let mut values: Vec<Option<f64>> = point.x.iter().map(|x| Some(*x)).collect();
        values.extend(vec![None; equations.nu]);
        if function.takes_parameters {
            values.extend(equations.parameters().iter().map(|p| Some(*p)));
        }
        values.push(Some(point.time));
        let formula = function.formula.specialised(&values);
        let outputs = formula.outputs().len();
        let (mut weights, mut rows) = (vec![0.0; outputs], Vec::new());
        match function.role {
            Role::Motion => weights.copy_from_slice(&point.costate),
            Role::Integrand(q) => weights[0] = equations.weight(q),
            Role::Path(first) => {
                let of_function = set.rows.iter().filter(|r| (first..first + outputs).contains(&r.row));
                rows.extend(of_function.map(|r| LimitedRow {
                    output: r.row - first,
                    lower: r.lower - r.tolerance,
                    upper: r.upper + r.tolerance,
                    multiplier: point.multipliers[r.row],
                }));
            }
        }
        Part { expansion: Expansion::new(formula), weights, rows }
    }
}

/// Some of a number of points, ends included.
fn spread(points: usize) -> Vec<usize> {
    let chosen = points.min(POINTS);
    (0..chosen).map(|k| if chosen < 2 { 0 } else { k * (points - 1) / (chosen - 1) }).collect()
}
