//! `multipliers.json`: the multipliers of endpoint and path constraints, which the trajectory file does not hold.

use std::sync::Arc;

use apsides_ocp::{Contact, Ocp, Phase, PhaseTrajectory, PiecewisePolynomial, Segment, Trajectory};
use serde::{Deserialize, Serialize};

use crate::ReportError;

/// Multipliers of the minimised objective, with the names that they belong to.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Multipliers {
    /// Per endpoint constraint of the problem; absent when the method gives none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub constraints: Option<Vec<ConstraintMultipliers>>,
    /// Per phase whose path constraints have multipliers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub path: Vec<PathMultipliers>,
    /// Every instant at which a path constraint touches its bound, phase by phase.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub contacts: Vec<ContactMultiplier>,
    /// Every interval end at which costates jump, phase by phase: at a contact, at a bound of a state, where the equations jump.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub jumps: Vec<CostateJump>,
    /// Per phase with integrals.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub integrals: Vec<IntegralMultipliers>,
}

/// Costates just before an interval end, of which a trajectory file has those behind it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CostateJump {
    /// Name of the phase.
    pub phase: String,
    /// Index of the interval end, from 0 at the start of the phase.
    pub interval_end: usize,
    /// Its time, for readers of the file.
    pub time: f64,
    /// One costate for each state, in the units of the costates of the trajectory file.
    pub before: Vec<f64>,
}

/// Multipliers of the bounds on the integrals of one phase, in objective unit per unit of the integral.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IntegralMultipliers {
    /// Name of the phase.
    pub phase: String,
    /// Names of the integrals.
    pub integrals: Vec<String>,
    /// One multiplier per integral.
    pub values: Vec<f64>,
}

/// Multipliers of one endpoint constraint, in objective unit per unit of the row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConstraintMultipliers {
    /// Name of the constraint.
    pub constraint: String,
    /// Names of its rows.
    pub rows: Vec<String>,
    /// One multiplier per row.
    pub values: Vec<f64>,
}

/// Multipliers of the path constraints of one phase, per unit time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PathMultipliers {
    /// Name of the phase.
    pub phase: String,
    /// Names of the path constraint rows.
    pub rows: Vec<String>,
    /// Per collocation point of the phase: one multiplier per row.
    pub values: Vec<Vec<f64>>,
}

/// Multiplier of a path constraint that touches its bound in one instant, in objective unit per unit of the row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactMultiplier {
    /// Name of the phase.
    pub phase: String,
    /// Name of the path constraint row.
    pub row: String,
    /// Index of the interval end, from 0 at the start of the phase.
    pub interval_end: usize,
    /// Its time, for readers of the file.
    pub time: f64,
    /// The multiplier.
    pub value: f64,
}

impl Multipliers {
    /// The multipliers of a trajectory; none when it has none.
    #[must_use]
    pub fn of(ocp: &Ocp, trajectory: &Trajectory) -> Option<Self> {
        let constraints = trajectory.constraint_multipliers.as_ref().map(|multipliers| {
            let named = ocp.constraints.iter().zip(multipliers);
            named
                .map(|(c, values)| ConstraintMultipliers {
                    constraint: c.name.clone(),
                    rows: c.rows.iter().map(|r| r.name.clone()).collect(),
                    values: values.clone(),
                })
                .collect()
        });
        let path: Vec<_> = ocp
            .phases
            .iter()
            .zip(&trajectory.phases)
            .filter_map(|(phase, t)| {
                let multipliers = t.path_multipliers.as_ref()?;
                let rows = row_names(phase).cloned().collect();
                let values = (0..t.control.segments().len())
                    .flat_map(|k| t.control.node_times(k).map(move |time| (k, time)))
                    .map(|(k, time)| {
                        let mut row = vec![0.0; multipliers.dimension()];
                        multipliers.evaluate_in(k, time, &mut row);
                        row
                    })
                    .collect();
                Some(PathMultipliers { phase: phase.name.clone(), rows, values })
            })
            .collect();
        let integrals: Vec<_> = (ocp.phases.iter().zip(&trajectory.phases))
            .filter(|(phase, _)| !phase.integrals.is_empty())
            .filter_map(|(phase, t)| {
                Some(IntegralMultipliers {
                    phase: phase.name.clone(),
                    integrals: phase.integrals.iter().map(|q| q.variable.name.clone()).collect(),
                    values: t.integral_multipliers.clone()?,
                })
            })
            .collect();
        let contacts: Vec<_> = (ocp.phases.iter().zip(&trajectory.phases))
            .flat_map(|(phase, t)| t.contacts.iter().map(move |c| (phase, t, c)))
            .filter_map(|(phase, t, c)| {
                Some(ContactMultiplier {
                    phase: phase.name.clone(),
                    row: row_names(phase).nth(c.row)?.clone(),
                    interval_end: c.end,
                    time: t.contact_time(c),
                    value: c.multiplier,
                })
            })
            .collect();
        let jumps: Vec<_> = trajectory.phases.iter().flat_map(costate_jumps).collect();
        let any = constraints.is_some()
            || [path.is_empty(), contacts.is_empty(), jumps.is_empty(), integrals.is_empty()]
                .contains(&false);
        any.then_some(Self { constraints, path, contacts, jumps, integrals })
    }

    /// Puts the multipliers into a trajectory of the same problem and nodes.
    ///
    /// # Errors
    /// [`ReportError::Multipliers`] when a name or a count does not fit.
    pub(crate) fn give_to(&self, ocp: &Ocp, trajectory: &mut Trajectory) -> Result<(), ReportError> {
        if let Some(constraints) = &self.constraints {
            trajectory.constraint_multipliers = Some(endpoint_values(ocp, constraints)?);
        }
        for path in &self.path {
            let Some(index) = ocp.phase_index(&path.phase) else {
                return refuse(&path.phase, "the problem has no such phase".into());
            };
            let rows = ocp.phases[index].path_rows();
            let phase = &mut trajectory.phases[index];
            phase.path_multipliers = Some(path_polynomial(path, rows, phase)?);
        }
        for contact in &self.contacts {
            let Some(index) = ocp.phase_index(&contact.phase) else {
                return refuse(&contact.phase, "the problem has no such phase".into());
            };
            let phase = &mut trajectory.phases[index];
            let Some(row) = row_names(&ocp.phases[index]).position(|name| *name == contact.row) else {
                return refuse(&contact.row, format!("no path constraint of phase `{}`", contact.phase));
            };
            if contact.interval_end > phase.mesh.intervals() {
                return refuse(&contact.row, format!("{} is no interval end", contact.interval_end));
            }
            let (end, multiplier) = (contact.interval_end, contact.value);
            phase.contacts.push(Contact { end, row, multiplier });
        }
        for jump in &self.jumps {
            let Some(index) = ocp.phase_index(&jump.phase) else {
                return refuse(&jump.phase, "the problem has no such phase".into());
            };
            let phase = &mut trajectory.phases[index];
            phase.costate = Some(with_jump(phase, jump)?);
        }
        for found in &self.integrals {
            let Some(index) = ocp.phase_index(&found.phase) else {
                return refuse(&found.phase, "the problem has no such phase".into());
            };
            let names = ocp.phases[index].integrals.iter().map(|q| &q.variable.name);
            if !found.integrals.iter().eq(names) || found.values.len() != found.integrals.len() {
                return refuse(&found.phase, "its integrals do not fit the problem".into());
            }
            trajectory.phases[index].integral_multipliers = Some(found.values.clone());
        }
        Ok(())
    }
}

/// Names of the path constraint rows of a phase.
fn row_names(phase: &Phase) -> impl Iterator<Item = &String> {
    phase.path.iter().flat_map(|p| &p.rows).map(|r| &r.name)
}

/// A costate jumps where it changes by more than this part of its largest value: less is rounding.
const JUMP: f64 = 1e-12;

/// The interval ends of a phase at which costates jump.
fn costate_jumps(t: &PhaseTrajectory) -> Vec<CostateJump> {
    let Some(costate) = &t.costate else { return Vec::new() };
    let n = costate.dimension();
    let mut largest = vec![0.0_f64; n];
    for row in costate.segments().iter().flat_map(|s| s.values.chunks(n.max(1))) {
        largest.iter_mut().zip(row).for_each(|(most, value)| *most = most.max(value.abs()));
    }
    let (breaks, mut after) = (costate.breaks(), vec![0.0; n]);
    let jumps = (1..costate.segments().len()).filter_map(|end| {
        let mut before = vec![0.0; n];
        let time = *breaks.get(end)?;
        costate.evaluate_in(end - 1, time, &mut before);
        costate.evaluate_in(end, time, &mut after);
        let differs = |((a, b), most): ((&f64, &f64), &f64)| (a - b).abs() > JUMP * most;
        let jumps = before.iter().zip(&after).zip(&largest).any(differs);
        jumps.then(|| CostateJump { phase: t.name.clone(), interval_end: end, time, before })
    });
    jumps.collect()
}

/// The costates of a phase with those before a jump at the end of its interval, which were taken for those behind it.
fn with_jump(phase: &PhaseTrajectory, jump: &CostateJump) -> Result<PiecewisePolynomial, ReportError> {
    let Some(costate) = &phase.costate else {
        return refuse(&jump.phase, "jumps of costates that the trajectory does not have".into());
    };
    let n = costate.dimension();
    if jump.before.len() != n {
        return refuse(&jump.phase, format!("expected {n} costates at a jump, found {}", jump.before.len()));
    }
    let mut segments = costate.segments().to_vec();
    let before = jump.interval_end.checked_sub(1).filter(|_| jump.interval_end < segments.len());
    let Some(segment) = before.and_then(|k| segments.get_mut(k)) else {
        return refuse(&jump.phase, format!("{} is no interval end inside of it", jump.interval_end));
    };
    // The last node is the end.
    let last = segment.values.len().saturating_sub(n);
    if let Some(end) = segment.values.get_mut(last..) {
        end.copy_from_slice(&jump.before);
    }
    PiecewisePolynomial::new(n, costate.breaks().to_vec(), segments)
        .or_else(|e| refuse(&jump.phase, e.to_string()))
}

fn refuse<T>(place: &str, reason: String) -> Result<T, ReportError> {
    Err(ReportError::Multipliers { place: format!("`{place}`"), reason })
}

fn endpoint_values(ocp: &Ocp, constraints: &[ConstraintMultipliers]) -> Result<Vec<Vec<f64>>, ReportError> {
    if constraints.len() != ocp.constraints.len() {
        let (expected, found) = (ocp.constraints.len(), constraints.len());
        return refuse(&ocp.name, format!("expected {expected} endpoint constraints, found {found}"));
    }
    let pairs = constraints.iter().zip(&ocp.constraints);
    pairs
        .map(|(found, expected)| {
            let names = expected.rows.iter().map(|r| &r.name);
            if found.constraint != expected.name || !found.rows.iter().eq(names) {
                let place = &found.constraint;
                refuse(place, format!("expected constraint `{}` and its rows here", expected.name))
            } else if found.values.len() != expected.rows.len() {
                let (expected, found_count) = (expected.rows.len(), found.values.len());
                refuse(&found.constraint, format!("expected {expected} values, found {found_count}"))
            } else {
                Ok(found.values.clone())
            }
        })
        .collect()
}

fn path_polynomial(
    path: &PathMultipliers,
    rows: usize,
    phase: &PhaseTrajectory,
) -> Result<PiecewisePolynomial, ReportError> {
    let points = phase.mesh.total_points();
    if path.values.len() != points {
        let found = path.values.len();
        return refuse(&path.phase, format!("expected {points} collocation points, found {found}"));
    }
    if let Some(k) = path.values.iter().position(|v| v.len() != rows) {
        let found = path.values[k].len();
        return refuse(&path.phase, format!("expected {rows} values at point {k}, found {found}"));
    }
    let mut remaining = path.values.as_slice();
    let segments = phase
        .control
        .segments()
        .iter()
        .map(|s| {
            let (here, rest) = remaining.split_at(s.basis.nodes().len());
            remaining = rest;
            Segment { basis: Arc::clone(&s.basis), values: here.concat() }
        })
        .collect();
    PiecewisePolynomial::new(rows, phase.control.breaks().to_vec(), segments)
        .or_else(|e| refuse(&path.phase, e.to_string()))
}
