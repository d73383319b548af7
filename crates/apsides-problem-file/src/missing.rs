//! Everything that a problem still needs, in one message.

use std::fmt;

use crate::model::{Model, Phase};

/// A part that a problem still needs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Missing {
    /// There is no phase.
    Phase,
    /// A phase has neither end time nor duration.
    EndTime(String),
    /// A phase has no states.
    States(String),
    /// A phase has a state without a start; the phase before it in the file, if there is one.
    Start(String, String, Option<String>),
    /// A phase has a state without a rate.
    Rate(String, String),
    /// There is no objective.
    Objective,
}

impl fmt::Display for Missing {
    /// Writes what is missing, and how a file states it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Phase => f.write_str("a phase: a table [phase.NAME] with `time`, `states`, `dynamics`"),
            Self::EndTime(name) => write!(
                f,
                "the end time of phase `{name}`: time = {{ end = 10 }} for a fixed one, {{ end = [1, 100] }} for a free one"
            ),
            Self::States(name) => {
                write!(f, "the states of phase `{name}`: [phase.{name}.states] with one key for each")
            }
            Self::Start(name, state, before) => {
                write!(
                    f,
                    "the start of `{state}` in phase `{name}`: start = 0 for a value, [0, 1] for a range, \"free\" for any"
                )?;
                let Some(before) = before else { return Ok(()) };
                write!(f, "; where phase `{before}` goes on in it: [links] with {before} = \"{name}\"")
            }
            Self::Rate(name, state) => write!(
                f,
                "the rate of `{state}` in phase `{name}`: {state} = \"a formula\" in [phase.{name}.dynamics]"
            ),
            Self::Objective => f.write_str(
                "the objective: [objective] with minimize = \"a formula\" or maximize = \"a formula\"",
            ),
        }
    }
}

/// The parts that are missing.
pub(crate) fn missing(model: &Model) -> Vec<Missing> {
    let mut missing = Vec::new();
    if model.phases.is_empty() {
        missing.push(Missing::Phase);
    }
    for phase in &model.phases {
        of_phase(model, phase, &mut missing);
    }
    if model.objective.is_none() {
        missing.push(Missing::Objective);
    }
    missing
}

fn of_phase(model: &Model, phase: &Phase, missing: &mut Vec<Missing>) {
    let name = &phase.name;
    if phase.times.as_ref().is_none_or(|t| t.end.is_none() && t.duration.is_none()) {
        missing.push(Missing::EndTime(name.clone()));
    }
    if phase.states.is_empty() {
        missing.push(Missing::States(name.clone()));
    }
    let before: Vec<&Phase> = model
        .links
        .iter()
        .filter(|l| l.to == *name)
        .filter_map(|l| {
            model.phases.iter().find(|p| p.name == l.from && !l.free.iter().any(|(f, _)| f == name))
        })
        .collect();
    for state in &phase.states {
        let joined = before.iter().any(|p| p.states.iter().any(|s| s.name == state.name));
        if state.start.is_none() && !joined {
            let earlier = model.phases.iter().take_while(|p| p.name != *name).last();
            let goes_on = earlier.filter(|p| p.states.iter().any(|s| s.name == state.name));
            let goes_on = goes_on.map(|p| p.name.clone());
            missing.push(Missing::Start(name.clone(), state.name.clone(), goes_on));
        }
        if !phase.dynamics.iter().any(|(rate, ..)| *rate == state.name) {
            missing.push(Missing::Rate(name.clone(), state.name.clone()));
        }
    }
}
