//! Parameter sweeps: one case per combination of values, each started from its neighbour.

use std::ops::Range;

use apsides_ocp::Trajectory;

use crate::Error;
use crate::fault::guarded;
use crate::observer::Observer;
use crate::outcome::{Outcome, Price};
use crate::pipeline::Pipeline;
use crate::record;
use crate::registry::Registry;
use crate::values::place_of_option;

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
            place: place_of_option(text),
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
    pub mission: Pipeline,
}

/// Every combination of the axes' values, the last axis running fastest and back and forth, so that neighbours in the
/// list are neighbours in the values.
///
/// # Errors
/// The first case that is refused; no case has been solved then.
pub fn cases(registry: &Registry, file_or_name: &str, axes: &[Axis]) -> Result<Vec<Case>, Error> {
    let mut combinations: Vec<Vec<String>> = vec![Vec::new()];
    for (k, axis) in axes.iter().enumerate() {
        if axes[..k].iter().any(|earlier| earlier.key == axis.key) {
            return Err(Error::Syntax {
                place: place_of_option(&axis.key),
                reason: "the key varies twice; give all of its values at once, as key=a,b,c".into(),
            });
        }
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
        .map(|overrides| Ok(Case { mission: registry.load(file_or_name, &overrides)?, overrides }))
        .collect()
}

/// Solves the cases in order, each from the last one that was solved; `report` gets each outcome as soon as it is there and
/// ends the sweep by returning false. A case whose solve panics is a case without an outcome: `report` gets the message.
///
/// # Errors
/// When a case is ill-posed.
pub fn sweep(
    cases: &[Case],
    observer: &mut dyn Observer,
    report: impl FnMut(&Case, Result<&Outcome, &str>) -> bool,
) -> Result<(), Error> {
    sweep_in_chains(cases, 0..cases.len(), cases.len().max(1), observer, report)
}

/// As [`sweep`], of the cases of some indices, in chains: the cases of indices `0, chain, 2 chain, ..` start from the mission's own guess, so that
/// what is found of a case does not depend on those before its chain.
///
/// # Errors
/// When a case is ill-posed; indices that begin within a chain, which would start from another case than in the whole sweep.
pub fn sweep_in_chains(
    cases: &[Case],
    indices: Range<usize>,
    chain: usize,
    observer: &mut dyn Observer,
    mut report: impl FnMut(&Case, Result<&Outcome, &str>) -> bool,
) -> Result<(), Error> {
    let refused = |reason: String| Err(Error::Conflict { place: "sweep".into(), reason });
    if chain == 0 || !indices.start.is_multiple_of(chain) {
        let first = indices.start;
        return refused(format!(
            "case {first} is not the first of a chain of {chain} cases: begin at a multiple of that"
        ));
    }
    let Some(part) = cases.get(indices.clone()) else {
        return refused(format!("there are {} cases, not those of indices {indices:?}", cases.len()));
    };
    let mut neighbour: Option<Trajectory> = None;
    for (index, case) in indices.zip(part) {
        if index.is_multiple_of(chain) {
            neighbour = None;
        }
        // A word may change the phases; the neighbour is of no use then.
        let start = match &neighbour {
            Some(trajectory) if case.mission.has_phases_of(trajectory)? => Some(trajectory),
            _ => None,
        };
        let solved = guarded(|| {
            let outcome = case.mission.solve(start, observer)?;
            if start.is_some() && outcome.explanation.is_some() {
                // A neighbour too far away may mislead; the mission's own guess decides.
                return case.mission.solve(None, observer);
            }
            Ok::<_, Error>(outcome)
        });
        let outcome = match solved {
            Ok(outcome) => outcome?,
            Err(fault) => {
                if report(case, Err(&fault)) {
                    continue;
                }
                break;
            }
        };
        let go_on = report(case, Ok(&outcome));
        if outcome.explanation.is_none() {
            neighbour = Some(outcome.solved().1.clone());
        }
        if !go_on {
            break;
        }
    }
    Ok(())
}

/// Says for each axis whether its key has a price in any case of a sweep: numbers of vehicle and flight have one where they are finite.
///
/// # Errors
/// When none has one, or a method gives none.
pub fn priced_axes(axes: &[Axis], cases: &[Case]) -> Result<Vec<bool>, Error> {
    cases.iter().try_for_each(|case| case.mission.check_prices())?;
    let has_price =
        |axis: &Axis| cases.iter().any(|case| case.mission.priced_keys().any(|k| k.path == axis.key));
    let priced: Vec<bool> = axes.iter().map(has_price).collect();
    if priced.contains(&true) {
        return Ok(priced);
    }
    let place = axes.iter().map(|a| format!("--set {}=..", a.key)).collect::<Vec<_>>().join(" ");
    let reason =
        "no swept key has a price; numbers of vehicle and flight have one where they are finite".into();
    Err(Error::Conflict { place: format!("sensitivity, {place}"), reason })
}

/// Prices of the swept keys at a case, in the order of the axes: none for a word, for a limit that is infinite there, and where the case
/// is not solved.
///
/// # Errors
/// As of [`Pipeline::sensitivities`].
pub fn prices(axes: &[Axis], case: &Case, outcome: &Outcome) -> Result<Vec<Option<Price>>, Error> {
    let record = record::current().zip(outcome.kept.as_ref());
    let kept = record.as_ref().and_then(|(record, key)| record.find_prices(key));
    let has_report = outcome.report.as_ref().is_some_and(|report| report.status.is_success());
    let solved = has_report || kept.as_ref().is_some_and(|prices| !prices.is_empty());
    let is_priced = |key: &str| solved && case.mission.priced_keys().any(|k| k.path == key);
    let keys: Vec<&str> = axes.iter().map(|a| a.key.as_str()).filter(|key| is_priced(key)).collect();
    let mut found = match kept {
        Some(kept) => kept,
        None if keys.is_empty() => Vec::new(),
        None => case.mission.sensitivities(outcome, &keys)?,
    };
    if let Some((record, key)) = record {
        record.keep_prices(key, &found);
    }
    let mut price = |axis: &Axis| {
        let place = found.iter().position(|p| p.key == axis.key)?;
        Some(found.swap_remove(place))
    };
    Ok(axes.iter().map(&mut price).collect())
}
