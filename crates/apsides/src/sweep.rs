//! Parameter sweeps: one case per combination of values, each started from its neighbour.

use apsides_ocp::Trajectory;

use crate::{Error, Mission, Observer, Outcome};

/// Values of one key.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Path of the key.
    pub key: String,
    /// Values, as written.
    pub values: Vec<String>,
}

impl Axis {
    /// Reads `key=a,b,c`.
    ///
    /// # Errors
    /// [`Error::Syntax`] when there is no key or no value.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let fail = || Error::Syntax {
            place: format!("--set {text}"),
            reason: "expected key=value or key=value,value,..".into(),
        };
        let (key, values) = text.split_once('=').ok_or_else(fail)?;
        let values: Vec<String> = values.split(',').map(|v| v.trim().to_owned()).collect();
        if key.trim().is_empty() || values.iter().any(String::is_empty) {
            return Err(fail());
        }
        Ok(Self { key: key.trim().into(), values })
    }
}

/// One case of a sweep.
pub struct Case {
    /// The overrides of this case, `key=value`.
    pub overrides: Vec<String>,
    /// The mission.
    pub mission: Mission,
}

/// Every combination of the axes' values, the last axis running fastest and back and forth, so that neighbours in the
/// list are neighbours in the values.
///
/// # Errors
/// The first case that is refused; no case has been solved then.
pub fn cases(file_or_name: &str, axes: &[Axis]) -> Result<Vec<Case>, Error> {
    let mut combinations: Vec<Vec<String>> = vec![Vec::new()];
    for axis in axes {
        let mut next = Vec::with_capacity(combinations.len() * axis.values.len());
        for (k, c) in combinations.iter().enumerate() {
            let mut add = |v: &String| {
                let mut longer = c.clone();
                longer.push(format!("{}={v}", axis.key));
                next.push(longer);
            };
            if k % 2 == 0 {
                axis.values.iter().for_each(&mut add)
            } else {
                axis.values.iter().rev().for_each(&mut add)
            }
        }
        combinations = next;
    }
    combinations
        .into_iter()
        .map(|overrides| Ok(Case { mission: Mission::load(file_or_name, &overrides)?, overrides }))
        .collect()
}

/// Solves the cases in order, each from the last one that was solved; `report` gets each outcome as soon as it is there and
/// ends the sweep by returning false.
///
/// # Errors
/// When a case is ill-posed.
pub fn sweep(
    cases: &[Case],
    observer: &mut dyn Observer,
    mut report: impl FnMut(&Case, &Outcome) -> bool,
) -> Result<(), Error> {
    let mut neighbour: Option<Trajectory> = None;
    for case in cases {
        // A word may change the phases; the neighbour is of no use then.
        let start = match &neighbour {
            Some(trajectory) if case.mission.has_phases_of(trajectory)? => Some(trajectory),
            _ => None,
        };
        let mut outcome = case.mission.solve(start, observer)?;
        if start.is_some() && outcome.explanation.is_some() {
            // A neighbour too far away may mislead; the mission's own guess decides.
            outcome = case.mission.solve(None, observer)?;
        }
        let go_on = report(case, &outcome);
        if outcome.explanation.is_none() {
            neighbour = Some(outcome.solved().1.clone());
        }
        if !go_on {
            break;
        }
    }
    Ok(())
}
