//! Controls with a limited rate.
//!
//! A control may jump at any time, so that its value at an instant, as at an end, changes neither flight nor cost. One whose rate has
//! limits has such a value: it is a state, and its rate is the control.

use apsides_expressions::Unit;
use apsides_expressions::build::ExpressionBuilder;

use crate::error::ProblemError;
use crate::model::{End, Model, Phase, Variable};
use crate::place::Source;

/// The problem in which each control with a limited rate is a state, and its rate, `u_rate`, the control.
pub(crate) fn with_limited_rates(source: &Source, mut model: Model) -> Result<Model, ProblemError> {
    let has_units = model.has_units;
    for phase in &mut model.phases {
        for k in 0..phase.controls.len() {
            limit(source, phase, k, has_units)?;
        }
    }
    Ok(model)
}

fn limit(source: &Source, phase: &mut Phase, k: usize, has_units: bool) -> Result<(), ProblemError> {
    let control = &mut phase.controls[k];
    let Some([least, most]) = control.rate.take() else {
        let keys = [
            ("start", control.start.is_some()),
            ("end", control.end.is_some()),
            ("tolerance", control.tolerance.is_some()),
        ];
        return match keys.into_iter().find(|(_, is_stated)| *is_stated) {
            None => Ok(()),
            Some((key, _)) => Err(ProblemError::Conflict {
                at: source.place(&control.at),
                reason: format!(
                    "control `{}` has `{key}`, but a control may jump at any time and has no value at an end: limit its rate, \
                     `rate = [least, most]`, or make it a state",
                    control.name
                ),
            }),
        };
    };
    let unit = if has_units { control.unit.per_second() } else { Unit::none() };
    let rate = Variable {
        least: Some(least),
        most: Some(most),
        ..Variable::new(format!("{}_rate", control.name), control.at.clone(), unit)
    };
    let mut formula = ExpressionBuilder::new(0);
    let part = formula.name(&rate.name);
    let mut state = std::mem::replace(control, rate);
    state.start.get_or_insert(End::Free);
    phase.dynamics.push((state.name.clone(), state.at.clone(), formula.expression(part)));
    phase.states.push(state);
    Ok(())
}
