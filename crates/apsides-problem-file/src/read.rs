//! The parts of a problem from the text of its file.

use apsides_expressions::toml_mistake::plain_words;
use apsides_expressions::{Definition, Dimension, Unit};
use toml::de::{DeTable, DeValue};

use crate::error::ProblemError;
use crate::model::{
    Bounded, Constant, Guess, Link, Model, Objective, Phase, Profile, Row, Stated, Times, Variable,
};
use crate::place::Source;
use crate::reader::{Field, Files, Node, Reader, Texts, described, fields, quantity, wrong_unit};
use crate::tables;

/// The tables and keys of a file.
pub(crate) const TOP: [&str; 14] = [
    "kind",
    "name",
    "title",
    "check_units",
    "constants",
    "definitions",
    "tables",
    "parameters",
    "phase",
    "links",
    "boundary",
    "objective",
    "guess",
    "motion",
];

const CONTROL: [&str; 9] = ["unit", "min", "max", "scale", "guard", "rate", "start", "end", "tolerance"];
const STATE: [&str; 8] = ["unit", "min", "max", "scale", "guard", "start", "end", "tolerance"];
const PARAMETER: [&str; 6] = ["unit", "min", "max", "scale", "guard", "guess"];
const ROW: [&str; 7] = ["value", "unit", "min", "max", "equals", "scale", "guard"];
const PHASE: [&str; 8] =
    ["time", "states", "controls", "dynamics", "path", "integrals", "kinks", "directions"];

/// Reads everything but what belongs to `others`.
pub(crate) fn read(
    source: &Source,
    files: &Files<'_>,
    others: &[&str],
) -> Result<(Model, Texts), ProblemError> {
    let table = DeTable::parse(source.text()).map_err(|e| ProblemError::Syntax {
        at: source.place(&e.span().unwrap_or(0..0)),
        reason: plain_words(e.message(), source.text(), e.span().map_or(0, |span| span.start)),
    })?;
    let mut reader = Reader { source, texts: Texts::default(), has_units: false };
    let mut model = Model::default();
    let mut checks_units = true;
    for field in fields(table.get_ref()) {
        let value = field.value;
        match field.name {
            "kind" => {}
            "name" => model.name = Some(reader.string(value, "name")?.to_owned()),
            "title" => model.title = Some(reader.string(value, "title")?.to_owned()),
            "check_units" => match value.get_ref() {
                DeValue::Boolean(checks) => checks_units = *checks,
                other => {
                    return Err(reader.refused(
                        &value.span(),
                        "check_units",
                        described(other),
                        "true or false",
                    ));
                }
            },
            "constants" => {
                for field in reader.table(value, "constants")? {
                    // What follows from other constants is a definition, wherever it stands.
                    match is_formula(field.value) {
                        true => reader.define(&mut model, field)?,
                        false => model.constants.push(reader.constant(&field)?),
                    }
                }
            }
            "definitions" => {
                for field in reader.table(value, "definitions")? {
                    reader.define(&mut model, field)?;
                }
            }
            "tables" => {
                for field in reader.table(value, "tables")? {
                    let (table, data) = tables::read(&mut reader, &field, files)?;
                    model.library.tables.push(table);
                    model.tables.push(data);
                }
            }
            "parameters" => model.parameters = reader.variables(value, "parameters", &PARAMETER)?,
            "phase" => {
                for field in reader.table(value, "phase")? {
                    model.phases.push(reader.phase(&field)?);
                }
            }
            "links" => {
                for field in reader.table(value, "links")? {
                    model.links.extend(reader.links(&field)?);
                }
            }
            "boundary" => model.boundary = reader.rows(value, "boundary", false)?,
            "objective" => model.objective = Some(reader.objective(value)?),
            "guess" => {
                for field in reader.table(value, "guess")? {
                    reader.guess(&field, &mut model.guess)?;
                }
            }
            "motion" => model.motion = Some(reader.motion(&field)?),
            other if others.contains(&other) => {}
            _ => {
                let known: Vec<&str> = TOP.iter().chain(others).copied().collect();
                return Err(reader.unknown(&field, "the file of a problem", &known));
            }
        }
    }
    model.has_units = reader.has_units;
    model.checks_units = checks_units && reader.has_units;
    Ok((model, reader.texts))
}

/// True for a text that is no number with a unit, nor one with a wrong unit.
fn is_formula(value: &Node<'_>) -> bool {
    matches!(value.get_ref(), DeValue::String(text) if quantity(text).is_none() && wrong_unit(text).is_none())
}

impl Reader<'_> {
    fn define(&mut self, model: &mut Model, field: Field<'_, '_>) -> Result<(), ProblemError> {
        let definition = self.definition(&field)?;
        model.library.definitions.push(definition);
        model.definitions.push(field.at);
        Ok(())
    }

    fn constant(&mut self, field: &Field<'_, '_>) -> Result<Constant, ProblemError> {
        let name = self.name(field, "the name of a constant")?;
        let what = format!("constants.{name}");
        let mut constant = Constant {
            value: f64::NAN,
            unit: Unit::none(),
            range: [f64::NEG_INFINITY, f64::INFINITY],
            meaning: String::new(),
            at: field.at.clone(),
            name,
        };
        let value = match field.value.get_ref() {
            DeValue::Table(_) => {
                let mut value = None;
                for field in self.table_of(field.value, &what, &["value", "unit", "min", "max", "meaning"])? {
                    match field.name {
                        "value" => value = Some(field.value),
                        "unit" => constant.unit = self.unit(field.value, &format!("{what}.unit"))?,
                        "min" => constant.range[0] = self.number(field.value, &format!("{what}.min"))?,
                        "max" => constant.range[1] = self.number(field.value, &format!("{what}.max"))?,
                        _ => {
                            constant.meaning =
                                self.string(field.value, &format!("{what}.meaning"))?.to_owned()
                        }
                    }
                }
                value.ok_or_else(|| {
                    self.refused(&field.at, &what, "without `value`".into(), "{ value = 3, unit = \"kg\" }")
                })?
            }
            _ => field.value,
        };
        constant.value = match value.get_ref() {
            DeValue::String(text) => {
                let Some((number, unit)) = quantity(text) else {
                    let mut allowed =
                        "a number, or one with its unit as in \"3500 N\"; what follows from others stands in [definitions]".to_owned();
                    if let Some(reason) = wrong_unit(text) {
                        allowed = format!("a number with a unit: {reason}");
                    }
                    return Err(self.refused(&value.span(), &what, described(value.get_ref()), &allowed));
                };
                self.has_units = true;
                if constant.unit != Unit::none() {
                    let reason = format!("`{what}` has its unit twice: leave one away");
                    return Err(self.conflict(&value.span(), reason));
                }
                constant.unit = unit;
                number
            }
            _ => self.finite(value, &what)?,
        };
        let [least, most] = constant.range;
        if !(least <= constant.value && constant.value <= most) {
            let allowed = format!("a number from {least} to {most}");
            return Err(self.refused(&value.span(), &what, constant.value.to_string(), &allowed));
        }
        Ok(constant)
    }

    fn definition(&mut self, field: &Field<'_, '_>) -> Result<Definition, ProblemError> {
        let (name, arguments) = self.heading(field)?;
        let what = format!("definitions.{name}");
        let (body, dimension) = match field.value.get_ref() {
            DeValue::Table(_) => {
                let (mut body, mut dimension) = (None, None);
                for field in self.table_of(field.value, &what, &["value", "unit"])? {
                    match field.name {
                        "value" => body = Some(self.formula(field.value, &what)?),
                        _ => dimension = Some(self.unit(field.value, &format!("{what}.unit"))?.dimension),
                    }
                }
                let missing = || {
                    self.refused(
                        &field.at,
                        &what,
                        "without `value`".into(),
                        "{ value = \"..\", unit = \"..\" }",
                    )
                };
                (body.ok_or_else(missing)?, dimension)
            }
            _ => (self.formula(field.value, &what)?, None),
        };
        Ok(Definition { name, arguments, body, dimension })
    }

    fn variables(
        &mut self,
        value: &Node<'_>,
        what: &str,
        keys: &[&str],
    ) -> Result<Vec<Variable>, ProblemError> {
        self.table(value, what)?.iter().map(|field| self.variable(field, what, keys)).collect()
    }

    /// A quantity: `"m"`, `[least, most]` or a table.
    fn variable(
        &mut self,
        field: &Field<'_, '_>,
        owner: &str,
        keys: &[&str],
    ) -> Result<Variable, ProblemError> {
        let name = self.name(field, "the name of a quantity")?;
        let what = format!("{owner}.{name}");
        let mut v = Variable::new(name, field.at.clone(), Unit::none());
        match field.value.get_ref() {
            DeValue::String(_) => v.unit = self.unit(field.value, &what)?,
            DeValue::Array(_) => {
                let [least, most] = self.pair(field.value, &what)?;
                (v.least, v.most) = (Some(least), Some(most));
            }
            DeValue::Table(_) => {
                for field in self.table_of(field.value, &what, keys)? {
                    let (value, what) = (field.value, format!("{what}.{}", field.name));
                    match field.name {
                        "unit" => v.unit = self.unit(value, &what)?,
                        "min" => v.least = Some(self.stated(value, &what)?),
                        "max" => v.most = Some(self.stated(value, &what)?),
                        "scale" => v.scale = Some(self.stated(value, &what)?),
                        "guard" => v.guards = self.guards(value, &what)?,
                        "start" => v.start = Some(self.end(value, &what)?),
                        "end" => v.end = Some(self.end(value, &what)?),
                        "rate" => v.rate = Some(self.pair(value, &what)?),
                        "tolerance" => v.tolerance = Some(self.stated(value, &what)?),
                        _ => v.guess = Some(self.stated(value, &what)?),
                    }
                }
            }
            other => {
                let allowed =
                    "its unit in quotes, [least, most], or a table { unit = \"m\", min = 0, max = 10 }";
                return Err(self.refused(&field.value.span(), &what, described(other), allowed));
            }
        }
        Ok(v)
    }

    fn guards(&self, value: &Node<'_>, what: &str) -> Result<[bool; 2], ProblemError> {
        Ok(match value.get_ref() {
            DeValue::String(text) if text == "min" => [true, false],
            DeValue::String(text) if text == "max" => [false, true],
            DeValue::Boolean(both) => [*both; 2],
            other => {
                return Err(self.refused(
                    &value.span(),
                    what,
                    described(other),
                    "true, false, \"min\" or \"max\"",
                ));
            }
        })
    }

    fn rows(&mut self, value: &Node<'_>, what: &str, integrals: bool) -> Result<Vec<Row>, ProblemError> {
        self.table(value, what)?.iter().map(|field| self.row(field, what, integrals)).collect()
    }

    /// A formula with bounds: `"a <= b"`, or a table; for an integral also a formula alone.
    fn row(&mut self, field: &Field<'_, '_>, owner: &str, integral: bool) -> Result<Row, ProblemError> {
        let name = self.name(field, "the name of a constraint")?;
        let what = format!("{owner}.{name}");
        let (mut unit, mut scale, mut guards) = (None, None, [false; 2]);
        let formula = match field.value.get_ref() {
            DeValue::Table(_) => {
                let (mut formula, mut least, mut most) = (None, None, None);
                for field in self.table_of(field.value, &what, &ROW)? {
                    let (value, what) = (field.value, format!("{what}.{}", field.name));
                    match field.name {
                        "value" => formula = Some(self.formula(value, &what)?),
                        "unit" => unit = Some(self.unit(value, &what)?),
                        "min" => least = Some(self.stated(value, &what)?),
                        "max" => most = Some(self.stated(value, &what)?),
                        "scale" => scale = Some(self.stated(value, &what)?),
                        "guard" => guards = self.guards(value, &what)?,
                        _ => {
                            let equals = self.stated(value, &what)?;
                            (least, most) = (Some(equals.clone()), Some(equals));
                        }
                    }
                }
                let Some(value) = formula else {
                    let allowed = "{ value = \"a formula\", min = .., max = .. }";
                    return Err(self.refused(&field.at, &what, "without `value`".into(), allowed));
                };
                if !integral && least.is_none() && most.is_none() {
                    return Err(self.refused(
                        &field.at,
                        &what,
                        "without a bound".into(),
                        "one of `min`, `max`, `equals`",
                    ));
                }
                Bounded::Keys { value, least, most }
            }
            _ if integral => {
                Bounded::Keys { value: self.formula(field.value, &what)?, least: None, most: None }
            }
            _ => {
                let relation = self.relation(field.value, &what)?;
                if relation.comparisons.is_empty() {
                    let found = "a formula without a comparison".into();
                    let allowed = "\"a <= b\", \"a <= b <= c\", \"a == b\", or a table { value = \"b\", min = 0, max = 1 }";
                    return Err(self.refused(&field.value.span(), &what, found, allowed));
                }
                Bounded::Relation(relation)
            }
        };
        Ok(Row { name, at: field.at.clone(), formula, unit, scale, guards })
    }

    fn phase(&mut self, field: &Field<'_, '_>) -> Result<Phase, ProblemError> {
        let name = self.name(field, "the name of a phase")?;
        let what = format!("phase.{name}");
        let mut phase = Phase {
            name,
            at: field.at.clone(),
            times: None,
            states: Vec::new(),
            controls: Vec::new(),
            dynamics: Vec::new(),
            path: Vec::new(),
            integrals: Vec::new(),
            kinks: Vec::new(),
            directions: Vec::new(),
        };
        for field in self.table_of(field.value, &what, &PHASE)? {
            let (value, what) = (field.value, format!("{what}.{}", field.name));
            match field.name {
                "time" => phase.times = Some(self.times(&field, &what)?),
                "states" => phase.states = self.variables(value, &what, &STATE)?,
                "controls" => phase.controls = self.variables(value, &what, &CONTROL)?,
                "dynamics" => {
                    for field in self.table(value, &what)? {
                        let formula = self.formula(field.value, &format!("{what}.{}", field.name))?;
                        phase.dynamics.push((field.name.to_owned(), field.at, formula));
                    }
                }
                "path" => phase.path = self.rows(value, &what, false)?,
                "integrals" => phase.integrals = self.rows(value, &what, true)?,
                "kinks" => {
                    for field in self.table(value, &what)? {
                        let what = format!("{what}.{}", field.name);
                        let values = match field.value.get_ref() {
                            DeValue::Array(_) => self.all_stated(field.value, &what)?,
                            _ => vec![self.stated(field.value, &what)?],
                        };
                        phase.kinks.push((field.name.to_owned(), field.at, values));
                    }
                }
                _ => {
                    for direction in self.list(value, &what)? {
                        let angles = match direction.get_ref() {
                            DeValue::Array(_) => self.list(direction, &what)?,
                            _ => vec![direction],
                        };
                        let names = angles.into_iter().map(|a| Ok(self.string(a, &what)?.to_owned()));
                        let names: Vec<String> = names.collect::<Result<_, ProblemError>>()?;
                        if !(1..=2).contains(&names.len()) {
                            let found = format!("a list of {}", names.len());
                            let allowed = "one control for an angle in a plane, or two for angles in space";
                            return Err(self.refused(&direction.span(), &what, found, allowed));
                        }
                        phase.directions.push((names, direction.span()));
                    }
                }
            }
        }
        Ok(phase)
    }

    fn all_stated(&mut self, value: &Node<'_>, what: &str) -> Result<Vec<Stated>, ProblemError> {
        self.list(value, what)?.into_iter().map(|v| self.stated(v, what)).collect()
    }

    fn times(&mut self, field: &Field<'_, '_>, what: &str) -> Result<Times, ProblemError> {
        let mut times = Times { start: None, end: None, duration: None, unit: None, at: field.at.clone() };
        for field in self.table_of(field.value, what, &["start", "end", "duration", "unit"])? {
            let (value, what) = (field.value, format!("{what}.{}", field.name));
            match field.name {
                "start" => times.start = Some(self.end(value, &what)?),
                "end" => times.end = Some(self.end(value, &what)?),
                "duration" => times.duration = Some(self.end(value, &what)?),
                _ => {
                    let unit = self.unit(value, &what)?;
                    if unit.dimension != Dimension::TIME && !unit.dimension.is_none() {
                        return Err(self.refused(
                            &value.span(),
                            &what,
                            format!("\"{unit}\""),
                            "a unit of time",
                        ));
                    }
                    times.unit = Some(unit);
                }
            }
        }
        Ok(times)
    }

    /// Links from one phase: the name of the next, a table, or a list of these.
    fn links(&mut self, field: &Field<'_, '_>) -> Result<Vec<Link>, ProblemError> {
        let what = format!("links.{}", field.name);
        let items = match field.value.get_ref() {
            DeValue::Array(items) => items.iter().collect(),
            _ => vec![field.value],
        };
        items.into_iter().map(|item| self.link(field, item, &what)).collect()
    }

    fn link(&mut self, field: &Field<'_, '_>, value: &Node<'_>, what: &str) -> Result<Link, ProblemError> {
        let from = field.name.to_owned();
        let mut link =
            Link { from, to: String::new(), at: value.span(), jumps: Vec::new(), free: Vec::new() };
        if let DeValue::String(to) = value.get_ref() {
            link.to = to.to_string();
            return Ok(link);
        }
        for field in self.table_of(value, what, &["to", "jump", "free"])? {
            let what = format!("{what}.{}", field.name);
            match field.name {
                "to" => link.to = self.string(field.value, &what)?.to_owned(),
                "jump" => {
                    for field in self.table(field.value, &what)? {
                        let jump = self.stated(field.value, &format!("{what}.{}", field.name))?;
                        link.jumps.push((field.name.to_owned(), field.at, jump));
                    }
                }
                _ => {
                    for name in self.list(field.value, &what)? {
                        link.free.push((self.string(name, &what)?.to_owned(), name.span()));
                    }
                }
            }
        }
        if link.to.is_empty() {
            return Err(self.refused(
                &value.span(),
                what,
                "without `to`".into(),
                "{ to = \"the next phase\" }",
            ));
        }
        Ok(link)
    }

    fn objective(&mut self, value: &Node<'_>) -> Result<Objective, ProblemError> {
        let (mut name, mut unit, mut scale) = (None, None, None);
        let mut formula = None;
        for field in self.table_of(value, "objective", &["minimize", "maximize", "name", "unit", "scale"])? {
            let (value, what) = (field.value, format!("objective.{}", field.name));
            match field.name {
                "minimize" | "maximize" => {
                    if formula.is_some() {
                        let reason = "the objective is either minimised or maximised: leave one away";
                        return Err(self.conflict(&field.at, reason));
                    }
                    formula = Some((field.name == "maximize", self.formula(value, &what)?));
                }
                "name" => name = Some(self.string(value, &what)?.to_owned()),
                "unit" => unit = Some(self.unit(value, &what)?),
                _ => scale = Some(self.stated(value, &what)?),
            }
        }
        let Some((maximize, formula)) = formula else {
            let allowed = "minimize = \"a formula\" or maximize = \"a formula\"";
            return Err(self.refused(&value.span(), "objective", "without a formula".into(), allowed));
        };
        Ok(Objective { maximize, formula, name, unit, scale })
    }

    /// A guess: of a quantity of the only phase, or a table of those of one phase.
    fn guess(&mut self, field: &Field<'_, '_>, guesses: &mut Vec<Guess>) -> Result<(), ProblemError> {
        if let DeValue::Table(_) = field.value.get_ref() {
            let what = format!("guess.{}", field.name);
            let mut guess = Guess {
                phase: Some(field.name.to_owned()),
                at: field.at.clone(),
                times: None,
                profiles: Vec::new(),
            };
            for field in self.table(field.value, &what)? {
                self.profile(&field, &what, &mut guess)?;
            }
            guesses.push(guess);
            return Ok(());
        }
        let only = match guesses.iter().position(|g| g.phase.is_none()) {
            Some(only) => only,
            None => {
                guesses.push(Guess { phase: None, at: field.at.clone(), times: None, profiles: Vec::new() });
                guesses.len() - 1
            }
        };
        self.profile(field, "guess", &mut guesses[only])
    }

    fn profile(&mut self, field: &Field<'_, '_>, owner: &str, guess: &mut Guess) -> Result<(), ProblemError> {
        let what = format!("{owner}.{}", field.name);
        if field.name == "time" {
            guess.times = Some(self.all_stated(field.value, &what)?);
            return Ok(());
        }
        let profile = match field.value.get_ref() {
            DeValue::Array(_) => Profile::Samples(self.all_stated(field.value, &what)?),
            DeValue::String(text) if quantity(text).is_none() => {
                Profile::Formula(self.formula(field.value, &what)?)
            }
            _ => Profile::Samples(vec![self.stated(field.value, &what)?]),
        };
        guess.profiles.push((field.name.to_owned(), field.at.clone(), profile));
        Ok(())
    }
}
