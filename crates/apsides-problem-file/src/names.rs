//! Names that stand for one thing only.

use std::collections::HashMap;
use std::ops::Range;

use apsides_expressions::function_names;
use apsides_expressions::suggestion::suggested_name;

use crate::error::ProblemError;
use crate::model::Model;
use crate::place::Source;

/// Names that formulas read in a way of their own.
const RESERVED: [&str; 5] = ["time", "start", "end", "duration", "if"];

/// Refuses a name that stands for two things, or for a function that every formula knows, and links of phases that do not exist.
pub(crate) fn check(source: &Source, model: &Model) -> Result<(), ProblemError> {
    let mut common = HashMap::new();
    let quantities = model.constants.iter().map(|c| (c.name.as_str(), &c.at, "a constant"));
    let definitions = model.library.definitions.iter().zip(&model.definitions);
    let definitions = definitions.map(|(d, at)| (d.name.as_str(), at, "a definition"));
    let tables = model.tables.iter().map(|t| (t.name.as_str(), &t.at, "a table"));
    let parameters = model.parameters.iter().map(|p| (p.name.as_str(), &p.at, "a parameter"));
    for entry in quantities.chain(definitions).chain(tables).chain(parameters) {
        add(source, &mut common, entry)?;
    }
    let phases: Vec<&str> = model.phases.iter().map(|p| p.name.as_str()).collect();
    for link in &model.links {
        if let Some(name) = [&link.from, &link.to].into_iter().find(|n| !phases.contains(&n.as_str())) {
            let reason = format!("no phase is named `{name}`{}", suggested_name(name, "phases", &phases));
            return Err(ProblemError::Conflict { at: source.place(&link.at), reason });
        }
    }
    for phase in &model.phases {
        let mut names = common.clone();
        let states = phase.states.iter().map(|s| (s.name.as_str(), &s.at, "a state"));
        let controls = phase.controls.iter().map(|c| (c.name.as_str(), &c.at, "a control"));
        for entry in states.chain(controls) {
            add(source, &mut names, entry)?;
        }
    }
    Ok(())
}

fn add<'a>(
    source: &Source,
    names: &mut HashMap<&'a str, &'static str>,
    (name, at, what): (&'a str, &Range<usize>, &'static str),
) -> Result<(), ProblemError> {
    let refused = |reason: String| Err(ProblemError::Conflict { at: source.place(at), reason });
    if RESERVED.contains(&name) || function_names().any(|f| f == name) {
        return refused(format!(
            "`{name}` has a meaning in formulas and cannot be the name of {what}: choose another"
        ));
    }
    match names.insert(name, what) {
        Some(before) => {
            refused(format!("`{name}` is {before} already and cannot be {what}, too: choose another name"))
        }
        None => Ok(()),
    }
}
