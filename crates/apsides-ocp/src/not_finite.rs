//! Formulas of a problem that have no value along a trajectory, such as the logarithm of a negative number.

use std::fmt;

use apsides_ad::NodeFunction;

use crate::variable::behind_number;
use crate::{EndpointInput, Ocp, Phase, PhaseTrajectory, Trajectory, Variable};

/// A formula of a problem, by names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NamedFormula {
    /// The rate of a state in a phase.
    Rate(String, String),
    /// A path constraint of a phase.
    Path(String, String),
    /// The integrand of an integral over a phase.
    Integrand(String, String),
    /// A condition on end quantities.
    Boundary(String),
    /// The objective.
    Objective,
}

impl fmt::Display for NamedFormula {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rate(phase, name) => write!(f, "the rate of `{name}` in phase `{phase}`"),
            Self::Path(phase, name) => write!(f, "the path constraint `{name}` of phase `{phase}`"),
            Self::Integrand(phase, name) => write!(f, "the integrand of `{name}` in phase `{phase}`"),
            Self::Boundary(name) => write!(f, "the condition `{name}`"),
            Self::Objective => f.write_str("the objective"),
        }
    }
}

/// A formula without a value, or without a slope, and what it takes there.
#[derive(Clone, Debug, PartialEq)]
pub struct NotFinite {
    /// The formula.
    pub formula: NamedFormula,
    /// True if it has a value there, and no slope.
    pub is_slope: bool,
    /// Name, value and unit of each quantity that it takes.
    pub at: Vec<(String, f64, String)>,
}

impl fmt::Display for NotFinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = if self.is_slope { "slope" } else { "value" };
        write!(f, "{} has no finite {what}", self.formula)?;
        for (k, (name, value, unit)) in self.at.iter().enumerate() {
            let joint = if k == 0 { " at" } else { "," };
            write!(f, "{joint} {name} = {value}{}", behind_number(unit))?;
        }
        Ok(())
    }
}

/// The first formula that has no finite value along a trajectory, else the first without a finite slope; none if all have both.
#[must_use]
pub fn not_finite(ocp: &Ocp, trajectory: &Trajectory) -> Option<NotFinite> {
    [false, true].into_iter().find_map(|is_slope| {
        let along = ocp.phases.iter().zip(&trajectory.phases);
        let mut along = along.filter_map(|(phase, flown)| in_phase(ocp, phase, flown, trajectory, is_slope));
        along.next().or_else(|| at_ends(ocp, trajectory, is_slope))
    })
}

fn in_phase(
    ocp: &Ocp,
    phase: &Phase,
    flown: &PhaseTrajectory,
    trajectory: &Trajectory,
    is_slope: bool,
) -> Option<NotFinite> {
    let own = |name: &str| (phase.name.clone(), name.to_owned());
    let rates = phase.states.iter().map(|s| own(&s.variable.name)).map(|(p, n)| NamedFormula::Rate(p, n));
    let mut functions = vec![(&phase.dynamics, rates.collect::<Vec<_>>())];
    for constraint in &phase.path {
        let rows = constraint.rows.iter().map(|r| own(&r.name)).map(|(p, n)| NamedFormula::Path(p, n));
        functions.push((&constraint.function, rows.collect()));
    }
    for integral in &phase.integrals {
        let (p, n) = own(&integral.variable.name);
        functions.push((&integral.function, vec![NamedFormula::Integrand(p, n)]));
    }
    functions.into_iter().find_map(|(function, formulas)| {
        let takes_parameters = phase.takes_parameters(function.as_ref());
        flown.nodes().find_map(|(time, _)| {
            let mut z = [flown.state_at(time), flown.control_at(time)].concat();
            if takes_parameters {
                z.extend_from_slice(&trajectory.parameters);
            }
            z.push(time);
            let (output, inputs) = first(function.as_ref(), &z, is_slope)?;
            let states = phase.states.iter().map(|s| &s.variable);
            let parameters = ocp.parameters.iter().filter(|_| takes_parameters).map(named);
            let named: Vec<(String, String)> = (states.chain(&phase.controls).map(named))
                .chain(parameters)
                .chain([("time".to_owned(), phase.time_unit.clone())])
                .collect();
            let at = inputs.into_iter().chain([z.len() - 1]);
            let mut at: Vec<(String, f64, String)> =
                at.map(|i| (named[i].0.clone(), z[i], named[i].1.clone())).collect();
            at.dedup_by(|a, b| a.0 == b.0);
            Some(NotFinite { formula: formulas.get(output)?.clone(), is_slope, at })
        })
    })
}

fn named(variable: &Variable) -> (String, String) {
    (variable.name.clone(), variable.unit.clone())
}

fn at_ends(ocp: &Ocp, trajectory: &Trajectory, is_slope: bool) -> Option<NotFinite> {
    let conditions = ocp.constraints.iter().map(|c| {
        let rows = c.rows.iter().map(|r| NamedFormula::Boundary(r.name.clone())).collect::<Vec<_>>();
        (&c.inputs, &c.function, rows)
    });
    let costs = ocp.objective.functions.iter().map(|(i, f)| (i, f, vec![NamedFormula::Objective]));
    conditions.chain(costs).find_map(|(ends, function, formulas)| {
        let taken: Vec<(String, f64, String)> =
            ends.iter().map(|end| end_of(ocp, trajectory, *end)).collect();
        let z: Vec<f64> = taken.iter().map(|(_, value, _)| *value).collect();
        let (output, inputs) = first(function.as_ref(), &z, is_slope)?;
        let at = inputs.into_iter().map(|i| taken[i].clone()).collect();
        Some(NotFinite { formula: formulas.get(output)?.clone(), is_slope, at })
    })
}

/// Name, value and unit of an end quantity.
fn end_of(ocp: &Ocp, trajectory: &Trajectory, end: EndpointInput) -> (String, f64, String) {
    let of_state = |word: &str, phase: usize, state: usize, time: f64| {
        let variable = &ocp.phases[phase].states[state].variable;
        let value = trajectory.phases[phase].state_at(time)[state];
        (format!("{word}.{}", variable.name), value, variable.unit.clone())
    };
    let unit = |phase: usize| ocp.phases[phase].time_unit.clone();
    match end {
        EndpointInput::InitialTime { phase } => {
            ("start.time".to_owned(), trajectory.phases[phase].initial_time, unit(phase))
        }
        EndpointInput::FinalTime { phase } => {
            ("end.time".to_owned(), trajectory.phases[phase].final_time, unit(phase))
        }
        EndpointInput::InitialState { phase, state } => {
            of_state("start", phase, state, trajectory.phases[phase].initial_time)
        }
        EndpointInput::FinalState { phase, state } => {
            of_state("end", phase, state, trajectory.phases[phase].final_time)
        }
        EndpointInput::Parameter { index } => {
            let (name, unit) = named(&ocp.parameters[index]);
            (name, trajectory.parameters[index], unit)
        }
    }
}

/// The first output without a finite value, or slope, and the inputs that it depends on.
fn first(function: &dyn NodeFunction, z: &[f64], is_slope: bool) -> Option<(usize, Vec<usize>)> {
    let pattern = function.pattern();
    let (mut values, mut slopes) = (vec![0.0; function.outputs()], vec![0.0; pattern.jacobian_len()]);
    function.jacobian(z, &mut values, &mut slopes);
    function.value(z, &mut values);
    let output = match is_slope {
        false => values.iter().position(|v| !v.is_finite())?,
        true => pattern.jacobian_entries().zip(&slopes).find(|(_, s)| !s.is_finite())?.0.0,
    };
    let inputs = pattern.jacobian_entries().filter(|(row, _)| *row == output).map(|(_, column)| column);
    Some((output, inputs.collect()))
}
