//! The start of an indirect solve: states and costates at the nodes of every phase.

use apsides_ocp::{Guess, Ocp, PhaseTrajectory, Trajectory};

use crate::ShootingError;

/// Nodes of one phase.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseStart {
    /// Start time.
    pub initial_time: f64,
    /// End time.
    pub final_time: f64,
    /// Nodes on the normalised time of the phase, from 0 to 1; a segment between each two.
    pub fractions: Vec<f64>,
    /// States per node.
    pub states: Vec<Vec<f64>>,
    /// Costates `dJ/dx` of the minimised objective per node.
    pub costates: Vec<Vec<f64>>,
    /// Controls per node, from where the pointwise minimisation starts.
    pub controls: Vec<Vec<f64>>,
}

/// Nodes of all phases, and what goes with them.
#[derive(Clone, Debug, PartialEq)]
pub struct IndirectStart {
    /// One per phase.
    pub phases: Vec<PhaseStart>,
    /// The nodes after the first of each phase are replaced by the flight from that one, where it can be flown.
    pub chained: bool,
    /// Static parameters.
    pub parameters: Vec<f64>,
    /// Multipliers of the endpoint constraints, per constraint and row; estimated from the costates when absent.
    pub constraint_multipliers: Option<Vec<Vec<f64>>>,
}

impl IndirectStart {
    /// From a trajectory with costates, such as one found by collocation; `segments` equal ones per phase.
    ///
    /// # Errors
    /// [`ShootingError::Start`] where a phase has no costates, [`ShootingError::Setting`] for no segments.
    pub fn from_trajectory(trajectory: &Trajectory, segments: usize) -> Result<Self, ShootingError> {
        let fractions = fractions(segments)?;
        let phase = |p: &PhaseTrajectory| {
            let Some(costate) = &p.costate else {
                return Err(ShootingError::Start {
                    place: format!("phase `{}`", p.name),
                    reason: "the trajectory has no costates; use that of a collocation method".into(),
                });
            };
            let at = |f: &f64| {
                let t = p.time_at(*f);
                let mut values = vec![0.0; costate.dimension()];
                costate.evaluate(t, &mut values);
                (p.state_at(t), values, p.control_at(t))
            };
            let nodes: Vec<_> = fractions.iter().map(at).collect();
            Ok(PhaseStart {
                initial_time: p.initial_time,
                final_time: p.final_time,
                fractions: fractions.clone(),
                states: nodes.iter().map(|n| n.0.clone()).collect(),
                costates: nodes.iter().map(|n| n.1.clone()).collect(),
                controls: nodes.into_iter().map(|n| n.2).collect(),
            })
        };
        Ok(Self {
            phases: trajectory.phases.iter().map(phase).collect::<Result<_, _>>()?,
            chained: false,
            parameters: trajectory.parameters.clone(),
            constraint_multipliers: trajectory.constraint_multipliers.clone(),
        })
    }

    /// From a guess of states and controls, and costates at both ends of each phase; `segments` equal ones per phase.
    ///
    /// # Errors
    /// [`ShootingError::Dimension`] where the costates do not fit, [`ShootingError::Setting`] for no segments.
    pub fn from_guess(
        ocp: &Ocp,
        guess: &Guess,
        costates: &[[Vec<f64>; 2]],
        segments: usize,
    ) -> Result<Self, ShootingError> {
        guess.check(ocp)?;
        let fractions = fractions(segments)?;
        if costates.len() != ocp.phases.len() {
            return Err(ShootingError::Dimension {
                place: format!("problem `{}`", ocp.name),
                what: "pairs of costates (one pair per phase)",
                expected: ocp.phases.len(),
                found: costates.len(),
            });
        }
        let phases = ocp.phases.iter().zip(&guess.phases).zip(costates).map(|((phase, g), [first, last])| {
            let between = |f: &f64| first.iter().zip(last).map(|(a, b)| a + f * (b - a)).collect();
            let row = |width: usize, fill: &dyn Fn(f64, &mut [f64])| -> Vec<Vec<f64>> {
                let at = |f: &f64| {
                    let mut values = vec![0.0; width];
                    fill(*f, &mut values);
                    values
                };
                fractions.iter().map(at).collect()
            };
            PhaseStart {
                initial_time: g.initial_time,
                final_time: g.final_time,
                states: row(phase.states.len(), &|f, out| g.state(f, out)),
                costates: fractions.iter().map(between).collect(),
                controls: row(phase.controls.len(), &|f, out| g.control(f, out)),
                fractions: fractions.clone(),
            }
        });
        let start = Self {
            phases: phases.collect(),
            chained: false,
            parameters: guess.parameters.clone(),
            constraint_multipliers: guess.constraint_multipliers.clone(),
        };
        start.check(ocp)?;
        Ok(start)
    }

    /// The same, with every phase flown from its first node.
    #[must_use]
    pub fn chained(self) -> Self {
        Self { chained: true, ..self }
    }

    /// Sizes, finite values, positive durations.
    pub(super) fn check(&self, ocp: &Ocp) -> Result<(), ShootingError> {
        let place = format!("problem `{}`", ocp.name);
        let sizes = |place: &str, list: &[(&'static str, usize, usize)]| {
            for &(what, expected, found) in list {
                if expected != found {
                    return Err(ShootingError::Dimension { place: place.into(), what, expected, found });
                }
            }
            Ok(())
        };
        sizes(
            &place,
            &[
                ("phases", ocp.phases.len(), self.phases.len()),
                ("static parameters", ocp.parameters.len(), self.parameters.len()),
            ],
        )?;
        for (phase, s) in ocp.phases.iter().zip(&self.phases) {
            let place = format!("phase `{}`", phase.name);
            let nodes = s.fractions.len();
            sizes(
                &place,
                &[
                    ("nodes with states", nodes, s.states.len()),
                    ("nodes with costates", nodes, s.costates.len()),
                    ("nodes with controls", nodes, s.controls.len()),
                ],
            )?;
            for node in 0..nodes {
                sizes(
                    &place,
                    &[
                        ("states", phase.states.len(), s.states[node].len()),
                        ("costates", phase.states.len(), s.costates[node].len()),
                        ("controls", phase.controls.len(), s.controls[node].len()),
                    ],
                )?;
            }
            let fail =
                |reason: &str| Err(ShootingError::Start { place: place.clone(), reason: reason.into() });
            let ends = s.fractions.first() == Some(&0.0) && s.fractions.last() == Some(&1.0);
            if nodes < 2 || !ends || !s.fractions.windows(2).all(|w| w[0] < w[1]) {
                return fail("the nodes must increase from 0 to 1");
            }
            let all = || s.states.iter().chain(&s.costates).chain(&s.controls).flatten();
            if !all().all(|v| v.is_finite()) {
                return fail("every state, costate and control must be finite");
            }
            if !(s.final_time > s.initial_time && (s.final_time - s.initial_time).is_finite()) {
                return fail("the end time must be after the start time");
            }
        }
        if !self.parameters.iter().all(|p| p.is_finite()) {
            return Err(ShootingError::Start { place, reason: "every parameter must be finite".into() });
        }
        if let Some(multipliers) = &self.constraint_multipliers {
            sizes(&place, &[("lists of multipliers", ocp.constraints.len(), multipliers.len())])?;
            for (c, m) in ocp.constraints.iter().zip(multipliers) {
                sizes(&format!("constraint `{}`", c.name), &[("multipliers", c.rows.len(), m.len())])?;
            }
        }
        Ok(())
    }
}

fn fractions(segments: usize) -> Result<Vec<f64>, ShootingError> {
    if segments == 0 {
        return Err(ShootingError::Setting { name: "segments", value: 0.0, allowed: "at least 1" });
    }
    Ok((0..=segments).map(|k| k as f64 / segments as f64).collect())
}
