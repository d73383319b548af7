//! The phases of a problem: states, controls, equations of motion, constraints, integrals, kinks.

use std::ops::Range;
use std::sync::Arc;

use apsides_ad::{AdError, Formula, NodeFunction, Table, Value as AdValue, formula_node};
use apsides_expressions::suggestion::suggested_name;
use apsides_expressions::{Compiler, Dimension, Quantity, Unit, Value};
use apsides_ocp::{Bounds, Direction, Integral, Kink, PathConstraint, Phase, State, Variable};

use crate::amounts::Amounts;
use crate::error::ProblemError;
use crate::model;
use crate::program::Program;

/// Names that stand for the time in formulas.
pub(crate) const TIME: &str = "time";

/// The time that a phase is over, and that it begins at where that is stated.
type PhaseTimes = (Option<Bounds>, Bounds, Bounds);

/// Most jumps and kinks of time of a function that methods follow one by one; those of the longest time allowed, of which a solution may pass few.
const MOST_INSTANTS: usize = 64;

/// Builds the phases in the order of the file.
pub(crate) fn phases(amounts: &mut Amounts<'_>, tables: &[Table]) -> Result<Vec<Phase>, ProblemError> {
    let model = amounts.model;
    let times: Vec<PhaseTimes> = model.phases.iter().map(|p| times(amounts, p)).collect::<Result<_, _>>()?;
    let begins: Vec<Bounds> = model
        .phases
        .iter()
        .zip(&times)
        .map(|(phase, (start, ..))| {
            // A phase begins when the one before it ends.
            let before = model.links.iter().find(|l| l.to == phase.name);
            let before = before.and_then(|l| model.phases.iter().position(|p| p.name == l.from));
            start.unwrap_or_else(|| before.map_or(Bounds::fixed(0.0), |k| times[k].1))
        })
        .collect();
    let each = model.phases.iter().zip(&times).zip(begins);
    each.map(|((stated, (_, end, duration)), start)| phase(amounts, stated, [start, *end, *duration], tables))
        .collect()
}

/// Static parameters.
pub(crate) fn parameters(amounts: &mut Amounts<'_>) -> Result<Vec<Variable>, ProblemError> {
    let model = amounts.model;
    model.parameters.iter().map(|p| variable(amounts, p, &format!("parameter `{}`", p.name))).collect()
}

/// The unit that numbers of a time are in.
pub(crate) fn time_unit(amounts: &Amounts<'_>, phase: &model::Phase) -> Unit {
    let stated = phase.times.as_ref().and_then(|t| t.unit.clone());
    let usual = if amounts.model.has_units { Unit::second() } else { Unit::none() };
    stated.unwrap_or(usual)
}

fn times(amounts: &mut Amounts<'_>, phase: &model::Phase) -> Result<PhaseTimes, ProblemError> {
    let unit = time_unit(amounts, phase);
    let at_least_zero = Bounds::at_least(0.0);
    let Some(times) = &phase.times else { return Ok((None, at_least_zero, at_least_zero)) };
    let mut of = |end: Option<&model::End>, what: &str| -> Result<Option<Bounds>, ProblemError> {
        let role = format!("the {what} of phase `{}`", phase.name);
        end.map(|end| amounts.end(end, &unit, &role)).transpose()
    };
    let start = of(times.start.as_ref(), "start time")?;
    let end = of(times.end.as_ref(), "end time")?.unwrap_or(Bounds::FREE);
    let duration = of(times.duration.as_ref(), "duration")?.unwrap_or(Bounds::FREE);
    if duration.upper <= 0.0 {
        return Err(
            amounts.conflict(&times.at, format!("the duration of phase `{}` must be above zero", phase.name))
        );
    }
    Ok((start, end, duration.intersect(&at_least_zero)))
}

fn variable(amounts: &mut Amounts<'_>, v: &model::Variable, role: &str) -> Result<Variable, ProblemError> {
    Ok(Variable {
        name: v.name.clone(),
        unit: amounts.label(&v.unit),
        bounds: amounts.bounds([v.least.as_ref(), v.most.as_ref()], &v.unit, role)?,
        scale: amounts.positive(v.scale.as_ref(), &v.unit, &format!("the scale of {role}"))?,
        guards: v.guards,
    })
}

fn state(amounts: &mut Amounts<'_>, v: &model::Variable) -> Result<State, ProblemError> {
    let role = format!("state `{}`", v.name);
    let variable = variable(amounts, v, &role)?;
    let mut end = |end: Option<&model::End>, what: &str| -> Result<Bounds, ProblemError> {
        let Some(stated) = end else { return Ok(Bounds::FREE) };
        let found = amounts.end(stated, &v.unit, &format!("the {what} of {role}"))?;
        let common = found.intersect(&variable.bounds);
        if common.lower > common.upper {
            let number = |value: f64| {
                let value = value / v.unit.factor;
                let is_plain = value == 0.0 || !value.is_finite() || (1e-6..1e9).contains(&value.abs());
                if is_plain { value.to_string() } else { format!("{value:e}") }
            };
            let of = |b: Bounds| format!("[{}, {}] {}", number(b.lower), number(b.upper), v.unit);
            let (found, bounds) = (of(found), of(variable.bounds));
            return Err(amounts
                .conflict(&v.at, format!("the {what} of {role}, {found}, is outside its bounds {bounds}")));
        }
        Ok(found)
    };
    let (initial, terminal) = (end(v.start.as_ref(), "start")?, end(v.end.as_ref(), "end")?);
    let tolerance = amounts.positive(v.tolerance.as_ref(), &v.unit, &format!("the tolerance of {role}"))?;
    Ok(State { variable, initial, terminal, tolerance })
}

/// Inputs and their values at which a formula switches.
type Switches = Vec<(usize, f64)>;

/// A program over states, controls, parameters and time of a phase.
pub(crate) struct Inputs<'a> {
    pub(crate) compiler: Compiler<'a, Program>,
    /// Earliest and latest time.
    times: [f64; 2],
}

impl<'a> Inputs<'a> {
    pub(crate) fn new(
        amounts: &Amounts<'a>,
        phase: &model::Phase,
        times: [f64; 2],
        tables: &[Table],
    ) -> Self {
        let parameters = &amounts.model.parameters;
        let named = phase.states.iter().chain(&phase.controls).chain(parameters);
        let named: Vec<(&str, Dimension)> = named.map(|v| (v.name.as_str(), v.unit.dimension)).collect();
        let mut compiler = amounts.compiler(Program::new(named.len() + 1, tables));
        let time = (TIME, time_unit(amounts, phase).dimension);
        for (k, (name, dimension)) in named.into_iter().chain([time]).enumerate() {
            let input = compiler.recorder().builder.input(k);
            compiler.name(name, Quantity::new(Value::Recorded(input), dimension));
        }
        for end in ["start", "end"] {
            for v in phase.states.iter().map(|s| s.name.as_str()).chain([TIME]) {
                let reason =
                    format!("`{end}.{v}` is a quantity of an end: it stands in [boundary] and [objective]");
                compiler.refuse(&format!("{end}.{v}"), &reason);
            }
        }
        Self { compiler, times }
    }

    pub(crate) fn formula(&mut self, outputs: &[Quantity<AdValue>]) -> Result<Formula, AdError> {
        let values: Vec<AdValue> = outputs.iter().map(|q| self.compiler.recorded(*q)).collect();
        self.compiler.recorder().builder.formula(&values)
    }

    fn node(&mut self, outputs: &[Quantity<AdValue>]) -> Result<(Arc<dyn NodeFunction>, Switches), AdError> {
        let formula = self.formula(outputs)?;
        let time = formula.inputs() - 1;
        let mut kinks: Switches = formula.kinks().into_iter().filter_map(|k| k.input).collect();
        let instants = formula.instants(time, self.times, &[]);
        if !instants.is_empty() {
            kinks.retain(|(input, _)| *input != time);
        }
        if instants.len() <= MOST_INSTANTS {
            kinks.extend(instants.into_iter().map(|[_, after]| (time, after)));
        }
        Ok((formula_node(formula), kinks))
    }
}

fn phase(
    amounts: &mut Amounts<'_>,
    stated: &model::Phase,
    [start, end, duration]: [Bounds; 3],
    tables: &[Table],
) -> Result<Phase, ProblemError> {
    let states: Vec<State> = stated.states.iter().map(|s| state(amounts, s)).collect::<Result<_, _>>()?;
    let controls = stated.controls.iter().map(|c| variable(amounts, c, &format!("control `{}`", c.name)));
    let controls: Vec<Variable> = controls.collect::<Result<_, _>>()?;
    let times = Bounds::new(start.lower, end.upper);
    let mut inputs = Inputs::new(amounts, stated, [times.lower, times.upper], tables);
    let mut switches = Vec::new();
    let source = amounts.source;
    let program = |at: &Range<usize>| {
        let at = source.place(at);
        move |source| ProblemError::Program { at, source }
    };
    let names: Vec<&str> = stated.states.iter().map(|s| s.name.as_str()).collect();
    if let Some((name, at, _)) = stated.dynamics.iter().find(|(name, ..)| !names.contains(&name.as_str())) {
        let suggestion = suggested_name(name, "states", &names);
        return Err(
            amounts.conflict(at, format!("phase `{}` has no state `{name}`{suggestion}", stated.name))
        );
    }
    let time = time_unit(amounts, stated).dimension;
    let mut rates = Vec::new();
    for v in &stated.states {
        let Some((_, _, formula)) = stated.dynamics.iter().find(|(name, ..)| *name == v.name) else {
            continue;
        };
        let role = format!("the rate of `{}`", v.name);
        let rate = inputs.compiler.compile(formula, Some(v.unit.dimension / time), &role);
        rates.push(rate.map_err(|e| amounts.formula_error(e))?);
    }
    let (dynamics, found) = inputs.node(&rates).map_err(program(&stated.at))?;
    switches.extend(found);
    let mut path = Vec::new();
    if !stated.path.is_empty() {
        let (mut values, mut rows) = (Vec::new(), Vec::new());
        for row in &stated.path {
            let (value, variable) =
                amounts.row(&mut inputs.compiler, row, &format!("constraint `{}`", row.name))?;
            values.push(value);
            rows.push(variable);
        }
        let (function, found) = inputs.node(&values).map_err(program(&stated.path[0].at))?;
        switches.extend(found);
        path.push(PathConstraint { rows, function });
    }
    let mut integrals = Vec::new();
    for row in &stated.integrals {
        let (integral, found) = integral(amounts, &mut inputs, row, time)?;
        switches.extend(found);
        integrals.push(integral);
    }
    let kinks = kinks(amounts, stated, &states, times, switches)?;
    let directions = directions(amounts, stated)?;
    let time_unit = amounts.label(&time_unit(amounts, stated));
    Ok(Phase {
        name: stated.name.clone(),
        states,
        controls,
        initial_time: start,
        final_time: end,
        duration,
        time_unit,
        dynamics,
        path,
        integrals,
        directions,
        kinks,
        accumulated: Vec::new(),
    })
}

/// The formula of an integral has its unit per time.
fn integral(
    amounts: &mut Amounts<'_>,
    inputs: &mut Inputs<'_>,
    row: &model::Row,
    time: Dimension,
) -> Result<(Integral, Switches), ProblemError> {
    let model::Bounded::Keys { value, least, most } = &row.formula else {
        return Err(
            amounts.conflict(&row.at, "an integral is a formula, or a table with `value` and its bounds")
        );
    };
    let role = format!("what integral `{}` sums over time", row.name);
    let wanted = row.unit.as_ref().map(|u| u.dimension / time);
    let rate = inputs.compiler.compile(value, wanted, &role).map_err(|e| amounts.formula_error(e))?;
    let unit = amounts.unit_of(row.unit.as_ref(), rate.dimension * time);
    let role = format!("integral `{}`", row.name);
    let bounds = amounts.bounds([least.as_ref(), most.as_ref()], &unit, &role)?;
    let scale = amounts.positive(row.scale.as_ref(), &unit, &format!("the scale of {role}"))?;
    let variable =
        Variable { name: row.name.clone(), unit: amounts.label(&unit), bounds, scale, guards: row.guards };
    let found = inputs.node(&[rate]);
    let (function, kinks) =
        found.map_err(|source| ProblemError::Program { at: amounts.source.place(&row.at), source })?;
    Ok((Integral { variable, function }, kinks))
}

/// Kinks that the file states, and those of its formulas where one state or the time passes a value.
fn kinks(
    amounts: &mut Amounts<'_>,
    stated: &model::Phase,
    states: &[State],
    times: Bounds,
    switches: Switches,
) -> Result<Vec<Kink>, ProblemError> {
    let mut kinks = Vec::new();
    for (name, at, values) in &stated.kinks {
        let Some(state) = stated.states.iter().position(|s| s.name == *name) else {
            let names: Vec<&str> = stated.states.iter().map(|s| s.name.as_str()).collect();
            let suggestion = suggested_name(name, "states", &names);
            return Err(
                amounts.conflict(at, format!("phase `{}` has no state `{name}`{suggestion}", stated.name))
            );
        };
        for value in values {
            let unit = &stated.states[state].unit;
            let value = amounts.finite(value, unit, &format!("the kink of `{name}`"))?;
            kinks.push(Kink::State { state, value });
        }
    }
    let time = states.len() + stated.controls.len() + amounts.model.parameters.len();
    for (input, value) in switches {
        let kink = if input == time { Kink::Time(value) } else { Kink::State { state: input, value } };
        // A quantity that never passes the value has no kink there.
        let inside = |b: &Bounds| b.lower < value && value < b.upper;
        let passes = if input == time {
            inside(&times)
        } else {
            states.get(input).is_some_and(|s| inside(&s.variable.bounds))
        };
        if passes && !kinks.contains(&kink) {
            kinks.push(kink);
        }
    }
    Ok(kinks)
}

fn directions(amounts: &Amounts<'_>, stated: &model::Phase) -> Result<Vec<Direction>, ProblemError> {
    let names: Vec<&str> = stated.controls.iter().map(|c| c.name.as_str()).collect();
    let direction = |(angles, at): &(Vec<String>, Range<usize>)| {
        let index = |name: &String| {
            names.iter().position(|n| n == name).ok_or_else(|| {
                let suggestion = suggested_name(name, "controls", &names);
                amounts.conflict(at, format!("phase `{}` has no control `{name}`{suggestion}", stated.name))
            })
        };
        match &angles[..] {
            [angle] => Ok(Direction::InPlane { angle: index(angle)? }),
            [a, b] => Ok(Direction::InSpace { in_plane: index(a)?, out_of_plane: index(b)? }),
            _ => Err(amounts.conflict(at, "a direction has one angle in a plane, or two in space")),
        }
    };
    stated.directions.iter().map(direction).collect()
}
