//! Everything that a problem still needs, in one message.

use crate::model::{Model, Phase};

/// The parts that are missing, and how to state each.
pub(crate) fn missing(model: &Model) -> Vec<String> {
    let mut missing = Vec::new();
    if model.phases.is_empty() {
        missing.push("a phase: a table [phase.NAME] with `time`, `states`, `dynamics`".into());
    }
    for phase in &model.phases {
        of_phase(model, phase, &mut missing);
    }
    if model.objective.is_none() {
        missing.push(
            "the objective: [objective] with minimize = \"a formula\" or maximize = \"a formula\"".into(),
        );
    }
    missing
}

fn of_phase(model: &Model, phase: &Phase, missing: &mut Vec<String>) {
    let name = &phase.name;
    if phase.times.as_ref().is_none_or(|t| t.end.is_none() && t.duration.is_none()) {
        missing.push(format!(
            "the end time of phase `{name}`: time = {{ end = 10 }} for a fixed one, {{ end = [1, 100] }} for a free one"
        ));
    }
    if phase.states.is_empty() {
        missing.push(format!("the states of phase `{name}`: [phase.{name}.states] with one key for each"));
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
            missing.push(format!(
                "the start of `{}` in phase `{name}`: start = 0 for a value, [0, 1] for a range, \"free\" for any",
                state.name
            ));
        }
        if !phase.dynamics.iter().any(|(rate, ..)| *rate == state.name) {
            missing.push(format!(
                "the rate of `{0}` in phase `{name}`: {0} = \"a formula\" in [phase.{name}.dynamics]",
                state.name
            ));
        }
    }
}
