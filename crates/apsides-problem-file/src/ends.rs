//! Formulas of quantities at the ends of phases: boundary conditions and the objective.

use apsides_ad::{NodeFunction, Table, Value as AdValue, formula_node};
use apsides_expressions::numbers::Nothing;
use apsides_expressions::suggestion::suggested_name;
use apsides_expressions::{
    Compiler, Dimension, Expression, ExpressionError, Numbers, Quantity, Recorder, Unit, Value,
};
use apsides_ocp::{At, OcpBuilder, Sense, Term};
use std::sync::Arc;

use crate::amounts::Amounts;
use crate::error::ProblemError;
use crate::model::{Model, Phase};
use crate::pose::{TIME, time_unit};
use crate::program::Program;

/// A quantity that formulas of ends may name.
#[derive(Clone, Debug, PartialEq)]
enum Named<'a> {
    End(At<'a>),
    Duration(&'a str),
    /// Phase and integral.
    Integral(&'a str, &'a str),
}

/// Every name, what it stands for and its dimension.
type Names<'a> = Vec<Entry<'a>>;

type Entry<'a> = (String, Named<'a>, Dimension);

/// Adds the boundary conditions.
pub(crate) fn boundary(
    amounts: &mut Amounts<'_>,
    tables: &[Table],
    mut builder: OcpBuilder,
) -> Result<OcpBuilder, ProblemError> {
    let model = amounts.model;
    let names = names(amounts);
    for row in &model.boundary {
        let formulas: Vec<&Expression> = match &row.formula {
            crate::model::Bounded::Relation(relation) => relation.sides.iter().collect(),
            crate::model::Bounded::Keys { value, .. } => vec![value],
        };
        let mut ends = Ends::new(amounts, &names, &formulas, tables);
        let found = amounts.row(&mut ends.compiler, row, &format!("boundary condition `{}`", row.name));
        let (value, variable) = found.map_err(|e| of_ends(e, &names))?;
        let function = ends.node(amounts, &[value], &row.at)?;
        builder = builder.constrain_node(row.name.clone(), vec![variable], &ends.inputs, function);
    }
    Ok(builder)
}

/// Adds the objective.
pub(crate) fn objective(
    amounts: &mut Amounts<'_>,
    tables: &[Table],
    builder: OcpBuilder,
) -> Result<OcpBuilder, ProblemError> {
    let model = amounts.model;
    let Some(objective) = &model.objective else { return Ok(builder) };
    let names = names(amounts);
    // All of it once, for names and units.
    let mut whole = Ends::new(amounts, &names, &[&objective.formula], tables);
    let wanted = objective.unit.as_ref().map(|u| u.dimension);
    let found = whole.compiler.compile(&objective.formula, wanted, "the objective");
    let found = found.map_err(|e| of_ends(amounts.formula_error(e), &names))?;
    let unit = match (&objective.unit, objective.formula.as_name().and_then(|n| declared(model, n))) {
        (Some(unit), _) => unit.clone(),
        (None, Some(unit)) if model.has_units => Unit::parse(unit.coherent()).unwrap_or(unit),
        // A quantity has its unit, also where units of formulas are not checked.
        (None, None) if model.has_units && objective.formula.as_name().is_some() => {
            Unit::coherent_of(found.dimension)
        }
        (None, _) => amounts.unit_of(None, found.dimension),
    };
    let (terms, others) = split(amounts, &names, &objective.formula, unit.factor);
    let mut all: Vec<Term<'_>> = Vec::new();
    // A function takes the end quantities along, so that a sum of them stays one formula where it is more than linear.
    let linear = others.is_empty();
    let mut functions: Vec<(f64, Expression)> = others;
    for (weight, named, sign, formula) in terms {
        match named {
            Named::Integral(phase, integral) => all.push(Term::Integral(phase, integral, weight)),
            Named::End(at) if linear => all.push(Term::End(at, weight)),
            Named::Duration(phase) if linear => {
                all.push(Term::End(At::FinalTime(phase), weight));
                all.push(Term::End(At::InitialTime(phase), -weight));
            }
            Named::End(_) | Named::Duration(_) => functions.push((sign, formula)),
        }
    }
    if !functions.is_empty() {
        let formulas: Vec<&Expression> = functions.iter().map(|(_, f)| f).collect();
        let mut ends = Ends::new(amounts, &names, &formulas, tables);
        let sum = ends.sum(&functions, unit.factor).map_err(|e| of_ends(amounts.formula_error(e), &names))?;
        let at = amounts.texts.bytes(&objective.formula.at());
        let function = ends.node(amounts, &[sum], &at)?;
        all.push(Term::Function(ends.inputs, function));
    }
    let last = |name: &str| name.rsplit('.').next().unwrap_or(name).to_owned();
    let name = objective.name.clone().or_else(|| objective.formula.as_name().map(last));
    let sense = if objective.maximize { Sense::Maximize } else { Sense::Minimize };
    let label = if model.has_units { unit.to_string() } else { "-".into() };
    let scale = amounts.positive(objective.scale.as_ref(), &unit, "the scale of the objective")?;
    let builder = builder.objective(sense, name.unwrap_or_else(|| "objective".into()), label, all);
    Ok(match scale {
        Some(scale) => builder.objective_scale(scale / unit.factor),
        None => builder,
    })
}

/// A term that is a weight times a named quantity: weight, quantity, sign and formula of the term.
type Weighted<'a> = (f64, Named<'a>, f64, Expression);

/// Terms of a sum that are weights times one quantity, and the others with their signs. Weights are in the unit of the objective.
fn split<'a>(
    amounts: &mut Amounts<'_>,
    names: &Names<'a>,
    formula: &Expression,
    unit: f64,
) -> (Vec<Weighted<'a>>, Vec<(f64, Expression)>) {
    let (mut terms, mut others) = (Vec::new(), Vec::new());
    for (sign, term) in formula.terms() {
        let (mut weight, mut rest) = (sign / unit, term.clone());
        let named = loop {
            if let Some(name) = rest.as_name() {
                break names.iter().find(|(n, ..)| n == name).map(|(_, named, _)| named.clone());
            }
            let Some((a, b, product)) = rest.factors() else { break None };
            rest = match (amounts.constant(&a), amounts.constant(&b)) {
                (Some(number), None) if product => {
                    weight *= number;
                    b
                }
                (None, Some(number)) => {
                    weight = if product { weight * number } else { weight / number };
                    a
                }
                _ => break None,
            };
        };
        match named {
            Some(named) => terms.push((weight, named, sign, term)),
            None => others.push((sign, term)),
        }
    }
    (terms, others)
}

/// A program over the end quantities that formulas name.
struct Ends<'n> {
    compiler: Compiler<'n, Program>,
    inputs: Vec<At<'n>>,
}

impl<'n> Ends<'n> {
    fn new(amounts: &Amounts<'n>, names: &Names<'n>, formulas: &[&Expression], tables: &[Table]) -> Self {
        let used = used(amounts.model, formulas);
        let mut inputs: Vec<At<'n>> = Vec::new();
        let mut place = |at: At<'n>| match inputs.iter().position(|i| *i == at) {
            Some(known) => known,
            None => {
                inputs.push(at);
                inputs.len() - 1
            }
        };
        let mut values: Vec<(&Entry<'n>, Vec<usize>)> = Vec::new();
        for entry in names.iter().filter(|(name, ..)| used.contains(&name.as_str())) {
            let places = match &entry.1 {
                Named::End(at) => vec![place(at.clone())],
                Named::Duration(phase) => vec![place(At::FinalTime(phase)), place(At::InitialTime(phase))],
                Named::Integral(phase, integral) => vec![place(At::Integral(phase, integral))],
            };
            values.push((entry, places));
        }
        if inputs.is_empty() {
            // A formula of constants alone still is a function of something.
            inputs.extend(amounts.model.phases.first().map(|p| At::FinalTime(&p.name)));
        }
        let mut compiler = amounts.compiler(Program::new(inputs.len(), tables));
        for ((name, named, dimension), places) in values {
            let builder = &mut compiler.recorder().builder;
            let value = match (named, &places[..]) {
                (Named::Duration(_), [end, start]) => {
                    let (end, start) = (builder.input(*end), builder.input(*start));
                    builder.sub(end, start)
                }
                (_, [k]) => builder.input(*k),
                _ => builder.input(0),
            };
            compiler.name(name, Quantity::new(Value::Recorded(value), *dimension));
        }
        refuse(&mut compiler, amounts.model);
        Self { compiler, inputs }
    }

    /// The sum of formulas with their signs, in a unit of this size.
    fn sum(
        &mut self,
        functions: &[(f64, Expression)],
        unit: f64,
    ) -> Result<Quantity<AdValue>, ExpressionError> {
        let mut sum = None;
        for (sign, formula) in functions {
            let found = self.compiler.compile(formula, None, "")?;
            let value = self.compiler.recorded(found);
            let builder = &mut self.compiler.recorder().builder;
            sum = Some(match sum {
                None if *sign < 0.0 => builder.neg(value),
                None => value,
                Some(sum) if *sign < 0.0 => builder.sub(sum, value),
                Some(sum) => builder.add(sum, value),
            });
        }
        let builder = &mut self.compiler.recorder().builder;
        let unit = builder.constant(unit);
        let sum = sum.unwrap_or(unit);
        let sum = builder.div(sum, unit);
        Ok(Quantity::new(Value::Recorded(sum), Dimension::NONE))
    }

    fn node(
        &mut self,
        amounts: &Amounts<'_>,
        outputs: &[Quantity<AdValue>],
        at: &std::ops::Range<usize>,
    ) -> Result<Arc<dyn NodeFunction>, ProblemError> {
        let values: Vec<AdValue> = outputs.iter().map(|q| self.compiler.recorded(*q)).collect();
        let formula = self.compiler.recorder().builder.formula(&values);
        let formula =
            formula.map_err(|source| ProblemError::Program { at: amounts.source.place(at), source })?;
        Ok(formula_node(formula))
    }
}

/// Names in formulas, and in the definitions that they use.
fn used<'e>(model: &'e Model, formulas: &[&'e Expression]) -> Vec<&'e str> {
    let mut used: Vec<&str> = Vec::new();
    let mut open: Vec<&Expression> = formulas.to_vec();
    while let Some(formula) = open.pop() {
        for (name, _) in formula.names() {
            if !used.contains(&name) {
                used.push(name);
                open.extend(model.library.definitions.iter().filter(|d| d.name == name).map(|d| &d.body));
            }
        }
    }
    used
}

/// All names of end quantities; with one phase its name may be left away.
fn names<'a>(amounts: &Amounts<'a>) -> Names<'a> {
    let model = amounts.model;
    let mut names: Names<'a> = Vec::new();
    let mut add = |phase: &str, name: String, named: Named<'a>, dimension: Dimension| {
        if model.phases.len() == 1 {
            names.push((name.clone(), named.clone(), dimension));
        }
        names.push((format!("{phase}.{name}"), named, dimension));
    };
    for phase in &model.phases {
        let (p, time) = (phase.name.as_str(), time_unit(amounts, phase).dimension);
        add(p, format!("start.{TIME}"), Named::End(At::InitialTime(p)), time);
        add(p, format!("end.{TIME}"), Named::End(At::FinalTime(p)), time);
        add(p, "duration".into(), Named::Duration(p), time);
        for s in &phase.states {
            let dimension = s.unit.dimension;
            add(p, format!("start.{}", s.name), Named::End(At::InitialState(p, &s.name)), dimension);
            add(p, format!("end.{}", s.name), Named::End(At::FinalState(p, &s.name)), dimension);
        }
        for q in &phase.integrals {
            let dimension = integral_dimension(amounts, phase, q, time);
            add(p, q.name.clone(), Named::Integral(p, &q.name), dimension);
        }
    }
    for p in &model.parameters {
        names.push((p.name.clone(), Named::End(At::Parameter(&p.name)), p.unit.dimension));
    }
    names
}

/// The stated unit of an integral, else that of its formula times that of time.
fn integral_dimension(
    amounts: &Amounts<'_>,
    phase: &Phase,
    q: &crate::model::Row,
    time: Dimension,
) -> Dimension {
    if let Some(unit) = &q.unit {
        return unit.dimension;
    }
    let crate::model::Bounded::Keys { value, .. } = &q.formula else { return Dimension::NONE };
    let named: Vec<_> = phase.states.iter().chain(&phase.controls).chain(&amounts.model.parameters).collect();
    let mut compiler = amounts.compiler(Numbers);
    for v in named {
        compiler.name(&v.name, Quantity::new(Value::Recorded(Nothing), v.unit.dimension));
    }
    compiler.name(TIME, Quantity::new(Value::Recorded(Nothing), time));
    // A mistake in it has been reported with the phase.
    compiler.compile(value, None, "").map_or(Dimension::NONE, |q| q.dimension * time)
}

/// The unit in which an end quantity is declared.
fn declared(model: &Model, name: &str) -> Option<Unit> {
    let last = name.rsplit('.').next()?;
    let states = model.phases.iter().flat_map(|p| &p.states).chain(&model.parameters);
    let mut found = states.filter(|s| s.name == last);
    found.next().map(|s| s.unit.clone())
}

/// Names that formulas of ends do not know, with what to write instead.
fn refuse<R: Recorder>(compiler: &mut Compiler<'_, R>, model: &Model) {
    let several = model.phases.len() > 1;
    for phase in &model.phases {
        let before = if several { format!("{}.", phase.name) } else { String::new() };
        for s in &phase.states {
            let name = &s.name;
            let reason = format!("`{name}` is a state: write `{before}end.{name}` or `{before}start.{name}`");
            compiler.refuse(name, &reason);
            if several {
                for end in ["start", "end"] {
                    let reason = format!(
                        "there are several phases: write `{before}{end}.{name}` with the one that is meant"
                    );
                    compiler.refuse(&format!("{end}.{name}"), &reason);
                }
            }
        }
        for c in &phase.controls {
            let name = &c.name;
            let reason = format!(
                "`{name}` is a control, which may jump at any time and has no value at an end: limit its rate, \
                 `controls.{name} = {{ rate = [least, most] }}`, or bound it by a path constraint; what it costs along the way is \
                 an integral, `integrals.NAME = \"a formula\"` of the phase, which the objective names"
            );
            for written in [name.clone(), format!("end.{name}"), format!("start.{name}")] {
                compiler.refuse(&format!("{}.{written}", phase.name), &reason);
                compiler.refuse(&written, &reason);
            }
        }
    }
    for end in ["start", "end"] {
        if several {
            let reason = format!("there are several phases: write `PHASE.{end}.time` with the name of one");
            compiler.refuse(&format!("{end}.time"), &reason);
        }
    }
    compiler.refuse(TIME, "`time` is that of a flight: at its ends it is `end.time` or `start.time`");
}

/// A name that no end quantity has: the nearest of those.
fn of_ends(error: ProblemError, names: &Names<'_>) -> ProblemError {
    let ProblemError::Formula {
        at,
        source: ExpressionError::UnknownName { at: span, what: "quantity", name, .. },
    } = error
    else {
        return error;
    };
    let known: Vec<&str> = names.iter().map(|(n, ..)| n.as_str()).collect();
    let suggestion = suggested_name(&name, "known here", &known);
    ProblemError::Formula {
        at,
        source: ExpressionError::UnknownName { at: span, what: "quantity", name, suggestion },
    }
}
