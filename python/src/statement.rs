//! The parts of a problem, from dictionaries that Python's classes make.

use std::sync::Arc;

use apsides_expressions::{Dimension, Library, Relation, Unit};
use apsides_problem_file::model::{
    self, Amount, Bounded, Constant, End, Guess, Link, Model, Objective, Profile, Row, Stated, TableData,
    Times, at_place,
};
use apsides_problem_file::{Missing, Place, Statement};
use pyo3::prelude::*;

use crate::error::{ProblemError, of_problem, refused};
use crate::functions::expression;
use crate::mission::Mission;
use crate::motion::MotionIn;
use crate::symbol::{Condition, Leaf, Operand, Scope};
use crate::table::Tables;

/// A value at an end.
#[derive(FromPyObject)]
enum EndIn {
    Between((Operand, Operand)),
    One(Operand),
    Word(String),
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct VariableIn {
    name: String,
    at: usize,
    unit: String,
    lower: Option<Operand>,
    upper: Option<Operand>,
    scale: Option<Operand>,
    guard: (bool, bool),
    start: Option<EndIn>,
    end: Option<EndIn>,
    tolerance: Option<Operand>,
    guess: Option<Operand>,
    rate: Option<(Operand, Operand)>,
}

#[derive(FromPyObject)]
enum BoundedIn {
    Condition(Condition),
    Formula(Operand),
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct RowIn {
    name: String,
    at: usize,
    formula: BoundedIn,
    unit: Option<String>,
    lower: Option<Operand>,
    upper: Option<Operand>,
    scale: Option<Operand>,
    guard: (bool, bool),
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct TimesIn {
    start: Option<EndIn>,
    end: Option<EndIn>,
    duration: Option<EndIn>,
    unit: Option<String>,
    at: usize,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct PhaseIn {
    name: String,
    at: usize,
    time: TimesIn,
    states: Vec<VariableIn>,
    controls: Vec<VariableIn>,
    dynamics: Vec<(String, usize, Operand)>,
    path: Vec<RowIn>,
    integrals: Vec<RowIn>,
    kinks: Vec<(String, usize, Vec<Operand>)>,
    directions: Vec<(Vec<String>, usize)>,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct ConstantIn {
    name: String,
    at: usize,
    value: f64,
    unit: String,
    lower: Option<f64>,
    upper: Option<f64>,
    meaning: String,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct LinkIn {
    from: String,
    to: String,
    at: usize,
    jump: Vec<(String, Operand)>,
    free: Vec<String>,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct ObjectiveIn {
    maximize: bool,
    formula: Operand,
    name: Option<String>,
    unit: Option<String>,
    scale: Option<Operand>,
    at: usize,
}

#[derive(FromPyObject)]
enum ProfileIn {
    Samples(Vec<f64>),
    Formula(Operand),
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct GuessIn {
    phase: String,
    at: usize,
    time: Option<Vec<f64>>,
    profiles: Vec<(String, usize, ProfileIn)>,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct ProblemIn {
    owner: u64,
    name: String,
    title: Option<String>,
    constants: Vec<ConstantIn>,
    parameters: Vec<VariableIn>,
    phases: Vec<PhaseIn>,
    links: Vec<LinkIn>,
    boundary: Vec<RowIn>,
    objective: Option<ObjectiveIn>,
    guess: Vec<GuessIn>,
    motion: Option<MotionIn>,
    places: Vec<(String, usize, String)>,
}

/// A mission of a problem that Python states.
#[pyfunction]
pub(crate) fn state(py: Python<'_>, problem: ProblemIn) -> PyResult<Mission> {
    let source = format!("problem `{}`", problem.name);
    let mut reader =
        Reader { owner: problem.owner, places: Vec::new(), tables: Tables::default(), has_units: false };
    reader.places =
        problem.places.iter().map(|(file, line, text)| Place::of_line(file.clone(), *line, text)).collect();
    let model = reader.model(problem)?;
    let places = reader.places;
    py.detach(|| {
        let statement = Statement::new(model, &source, places).map_err(|e| of_problem(&e))?;
        let pipeline = apsides::missions::problem::pipeline(Arc::new(statement)).map_err(refused)?;
        Ok(Mission::new(pipeline))
    })
}

/// The missing parts, as Python states them.
pub(crate) fn in_python(missing: &Missing) -> String {
    match missing {
        Missing::Phase => "a phase: phase = problem.phase(\"name\", duration=(1, 10))".into(),
        Missing::EndTime(phase) => format!(
            "the end time of phase `{phase}`: duration=10 or end=10 for a fixed one, duration=(1, 100) for a free one"
        ),
        Missing::States(phase) => format!("the states of phase `{phase}`: x = phase.state(\"x\", start=0)"),
        Missing::Start(phase, state, before) => {
            let goes_on = before.as_ref().map_or_else(String::new, |before| {
                format!("; where phase `{before}` goes on in it: problem.link({before}, {phase})")
            });
            format!(
                "the start of `{state}` in phase `{phase}`: start=0 for a value, start=(0, 1) for a range, start=\"free\" for any{goes_on}"
            )
        }
        Missing::Rate(phase, state) => {
            format!("the rate of `{state}` in phase `{phase}`: phase.dynamics({state}=..)")
        }
        Missing::Objective => "the objective: problem.minimize(..) or problem.maximize(..)".into(),
    }
}

/// Where a formula stands, which says what its leaves are called.
#[derive(Clone, Copy)]
pub(crate) enum Where<'a> {
    /// Numbers of constants.
    Amount,
    /// Along a phase.
    Phase(&'a str),
    /// Boundary conditions and objective.
    Ends,
}

pub(crate) struct Reader {
    owner: u64,
    places: Vec<Place>,
    tables: Tables,
    has_units: bool,
}

impl Reader {
    fn unit(&mut self, name: &str, at: usize) -> PyResult<Unit> {
        if name.is_empty() || name == "-" {
            return Ok(Unit::none());
        }
        self.has_units = true;
        Unit::parse(name).map_err(|e| self.refused(at, &format!("the unit \"{name}\": {}", e.reason)))
    }

    pub(crate) fn refused(&self, at: usize, reason: &str) -> PyErr {
        let place = self.places.get(at);
        let (before, after) = place.map_or_else(Default::default, |p| (format!("{p}: "), p.caret()));
        ProblemError::new_err(format!("{before}{reason}{after}"))
    }

    /// The name of a leaf where a formula stands.
    fn name(&self, leaf: &Leaf, place: Where<'_>, at: usize) -> PyResult<String> {
        let name = &leaf.name;
        if leaf.owner != self.owner {
            return Err(self.refused(at, &format!("`{name}` belongs to another problem")));
        }
        let wrong = |reason: String| Err(self.refused(at, &reason));
        match (&leaf.scope, place) {
            (Scope::Problem, _) => Ok(name.clone()),
            (Scope::Phase(own), Where::Phase(phase)) if own == phase => Ok(name.clone()),
            (Scope::Phase(own), Where::Phase(phase)) => wrong(format!(
                "`{name}` is a quantity of phase `{own}`, and this is a formula of phase `{phase}`"
            )),
            (Scope::Phase(own), Where::Ends) => wrong(format!(
                "`{name}` has many values along phase `{own}`: write {name}.end or {name}.start of a state, {own}.final_time for the time, \
                 or an integral; a control has such a value where it has a `rate`"
            )),
            (Scope::End, Where::Ends) => Ok(name.clone()),
            (Scope::End, Where::Phase(_)) => wrong(format!(
                "`{name}` is a quantity of an end: it stands in constrain(), minimize() and maximize(); along a phase a parameter does its work"
            )),
            (Scope::Phase(_) | Scope::End, Where::Amount) => wrong(format!(
                "`{name}` is no constant: bounds, ends and scales are numbers or formulas of constants"
            )),
            (Scope::Input(_), _) => wrong(format!("`{name}` belongs to a function that is traced elsewhere")),
        }
    }

    pub(crate) fn formula(
        &mut self,
        formula: Operand,
        place: Where<'_>,
        at: usize,
    ) -> PyResult<apsides_expressions::Expression> {
        let mut tables = std::mem::take(&mut self.tables);
        let found = expression(&formula.symbol(), at, &mut tables, &|leaf| self.name(leaf, place, at));
        self.tables = tables;
        found
    }

    pub(crate) fn stated(&mut self, amount: Operand, at: usize) -> PyResult<Stated> {
        let amount = match amount {
            Operand::Number(number) => Amount::Number(number),
            symbol => Amount::Formula(self.formula(symbol, Where::Amount, at)?),
        };
        Ok(Stated { amount, at: at_place(at) })
    }

    pub(crate) fn optional(&mut self, amount: Option<Operand>, at: usize) -> PyResult<Option<Stated>> {
        amount.map(|a| self.stated(a, at)).transpose()
    }

    fn end(&mut self, end: Option<EndIn>, at: usize) -> PyResult<Option<End>> {
        Ok(Some(match end {
            None => return Ok(None),
            Some(EndIn::One(value)) => End::Fixed(self.stated(value, at)?),
            Some(EndIn::Between((least, most))) => {
                End::Between(self.stated(least, at)?, self.stated(most, at)?)
            }
            Some(EndIn::Word(word)) if word == "free" => End::Free,
            Some(EndIn::Word(word)) => {
                return Err(self
                    .refused(at, &format!("an end is a number, (least, most) or \"free\", not \"{word}\"")));
            }
        }))
    }

    fn variable(&mut self, v: VariableIn) -> PyResult<model::Variable> {
        let at = v.at;
        Ok(model::Variable {
            unit: self.unit(&v.unit, at)?,
            name: v.name,
            at: at_place(at),
            least: self.optional(v.lower, at)?,
            most: self.optional(v.upper, at)?,
            scale: self.optional(v.scale, at)?,
            guards: v.guard.into(),
            start: self.end(v.start, at)?,
            end: self.end(v.end, at)?,
            tolerance: self.optional(v.tolerance, at)?,
            guess: self.optional(v.guess, at)?,
            rate: v
                .rate
                .map(|(a, b)| Ok::<_, PyErr>([self.stated(a, at)?, self.stated(b, at)?]))
                .transpose()?,
        })
    }

    fn variables(&mut self, all: Vec<VariableIn>) -> PyResult<Vec<model::Variable>> {
        all.into_iter().map(|v| self.variable(v)).collect()
    }

    fn row(&mut self, row: RowIn, place: Where<'_>) -> PyResult<Row> {
        let at = row.at;
        let formula = match row.formula {
            BoundedIn::Formula(formula) => Bounded::Keys {
                value: self.formula(formula, place, at)?,
                least: self.optional(row.lower, at)?,
                most: self.optional(row.upper, at)?,
            },
            BoundedIn::Condition(Condition { left, comparison, right }) => Bounded::Relation(Relation {
                sides: vec![
                    self.formula(Operand::Symbol(left), place, at)?,
                    self.formula(Operand::Symbol(right), place, at)?,
                ],
                comparisons: vec![comparison],
            }),
        };
        Ok(Row {
            unit: row.unit.map(|u| self.unit(&u, at)).transpose()?,
            name: row.name,
            at: at_place(at),
            formula,
            scale: self.optional(row.scale, at)?,
            guards: row.guard.into(),
        })
    }

    fn phase(&mut self, phase: PhaseIn) -> PyResult<model::Phase> {
        let name = phase.name;
        let along = Where::Phase(&name);
        let time = phase.time;
        let times = Times {
            start: self.end(time.start, time.at)?,
            end: self.end(time.end, time.at)?,
            duration: self.end(time.duration, time.at)?,
            unit: time.unit.map(|u| self.unit(&u, time.at)).transpose()?,
            at: at_place(time.at),
        };
        let rates = phase.dynamics.into_iter();
        let rates = rates.map(|(state, at, rate)| Ok((state, at_place(at), self.formula(rate, along, at)?)));
        let dynamics = rates.collect::<PyResult<_>>()?;
        let path = phase.path.into_iter().map(|row| self.row(row, along)).collect::<PyResult<_>>()?;
        let integrals =
            phase.integrals.into_iter().map(|row| self.row(row, along)).collect::<PyResult<_>>()?;
        let kinks = phase.kinks.into_iter().map(|(state, at, values)| {
            let values = values.into_iter().map(|v| self.stated(v, at)).collect::<PyResult<_>>()?;
            Ok((state, at_place(at), values))
        });
        let kinks = kinks.collect::<PyResult<_>>()?;
        Ok(model::Phase {
            at: at_place(phase.at),
            times: Some(times),
            states: self.variables(phase.states)?,
            controls: self.variables(phase.controls)?,
            dynamics,
            path,
            integrals,
            kinks,
            directions: phase.directions.into_iter().map(|(names, at)| (names, at_place(at))).collect(),
            name,
        })
    }

    fn model(&mut self, problem: ProblemIn) -> PyResult<Model> {
        let constants = problem.constants.into_iter().map(|c| {
            let unit = self.unit(&c.unit, c.at)?;
            let range = [c.lower.unwrap_or(f64::NEG_INFINITY), c.upper.unwrap_or(f64::INFINITY)];
            if !(c.value.is_finite() && range[0] <= c.value && c.value <= range[1]) {
                let [least, most] = range;
                let reason = format!(
                    "constant `{}` is {}, allowed is a finite number from {least} to {most}",
                    c.name, c.value
                );
                return Err(self.refused(c.at, &reason));
            }
            Ok(Constant { name: c.name, value: c.value, unit, range, meaning: c.meaning, at: at_place(c.at) })
        });
        let constants = constants.collect::<PyResult<_>>()?;
        let parameters = self.variables(problem.parameters)?;
        let only = problem.phases.first().map(|p| p.name.clone()).unwrap_or_default();
        let motion = problem.motion.map(|motion| self.motion(motion, &only)).transpose()?;
        let phases = problem.phases.into_iter().map(|p| self.phase(p)).collect::<PyResult<_>>()?;
        let links = problem.links.into_iter().map(|l| {
            let at = at_place(l.at);
            let jumps = l.jump.into_iter().map(|(state, by)| Ok((state, at.clone(), self.stated(by, l.at)?)));
            let jumps = jumps.collect::<PyResult<_>>()?;
            let free = l.free.into_iter().map(|name| (name, at.clone())).collect();
            Ok(Link { from: l.from, to: l.to, at: at.clone(), jumps, free })
        });
        let links = links.collect::<PyResult<_>>()?;
        let boundary =
            problem.boundary.into_iter().map(|r| self.row(r, Where::Ends)).collect::<PyResult<_>>()?;
        let objective = problem.objective.map(|o| {
            Ok::<_, PyErr>(Objective {
                maximize: o.maximize,
                formula: self.formula(o.formula, Where::Ends, o.at)?,
                name: o.name,
                unit: o.unit.map(|u| self.unit(&u, o.at)).transpose()?,
                scale: self.optional(o.scale, o.at)?,
            })
        });
        let objective = objective.transpose()?;
        let guess = problem.guess.into_iter().map(|g| self.guess(g)).collect::<PyResult<_>>()?;
        let (tables, data) = self.tables();
        Ok(Model {
            name: Some(problem.name),
            title: problem.title,
            constants,
            library: Library { definitions: Vec::new(), tables },
            definitions: Vec::new(),
            tables: data,
            parameters,
            phases,
            links,
            boundary,
            objective,
            guess,
            motion,
            has_units: self.has_units,
            // Numbers of Python have no units that could be checked.
            checks_units: false,
        })
    }

    fn guess(&mut self, guess: GuessIn) -> PyResult<Guess> {
        let GuessIn { phase, at, time, profiles } = guess;
        let number = |at: usize| move |v: f64| Stated { amount: Amount::Number(v), at: at_place(at) };
        let profiles = profiles.into_iter().map(|(name, at, profile)| {
            let profile = match profile {
                ProfileIn::Samples(values) => Profile::Samples(values.into_iter().map(number(at)).collect()),
                ProfileIn::Formula(Operand::Number(value)) => Profile::Samples(vec![number(at)(value)]),
                ProfileIn::Formula(symbol) => {
                    Profile::Formula(self.formula(symbol, Where::Phase(&phase), at)?)
                }
            };
            Ok((name, at_place(at), profile))
        });
        let profiles = profiles.collect::<PyResult<_>>()?;
        let times = time.map(|t| t.into_iter().map(number(at)).collect());
        Ok(Guess { phase: Some(phase), at: at_place(at), times, profiles })
    }

    /// The tables that formulas use.
    fn tables(&mut self) -> (Vec<apsides_expressions::Table>, Vec<TableData>) {
        let tables = std::mem::take(&mut self.tables).0;
        let named = tables.iter().enumerate().map(|(k, table)| {
            let variables = if table.y.is_empty() { 1 } else { 2 };
            let variables = vec![Dimension::NONE; variables];
            let stated =
                apsides_expressions::Table { name: Tables::of(k), variables, dimension: Dimension::NONE };
            (stated, TableData { name: Tables::of(k), at: at_place(usize::MAX), ..TableData::clone(table) })
        });
        named.unzip()
    }
}
