//! Numbers of a problem: amounts in coherent SI units, bounds, the sides of comparisons.

use std::ops::Range;

use apsides_expressions::{
    Comparison, Compiler, Dimension, Expression, ExpressionError, Numbers, Quantity, Recorder, Unit, Value,
};
use apsides_ocp::{Bounds, Variable};

use crate::error::ProblemError;
use crate::model::{Amount, Bounded, End, Model, Row, Stated};
use crate::place::Source;
use crate::reader::Texts;

/// The file and what formulas of constants are made of.
pub(crate) struct Amounts<'a> {
    pub(crate) source: &'a Source,
    pub(crate) texts: &'a Texts,
    pub(crate) model: &'a Model,
    /// Values of the constants, in coherent SI units.
    pub(crate) constants: Vec<f64>,
    numbers: Compiler<'a, Numbers>,
}

const OF_CONSTANTS: &str = "it is made of constants and their definitions alone";

impl<'a> Amounts<'a> {
    /// `values` has the values of the constants in their units.
    pub(crate) fn new(source: &'a Source, texts: &'a Texts, model: &'a Model, values: &[f64]) -> Self {
        let constants: Vec<f64> =
            model.constants.iter().zip(values).map(|(c, v)| v * c.unit.factor).collect();
        let mut numbers = Compiler::new(Numbers, &model.library, model.checks_units);
        name_constants(&mut numbers, model, &constants);
        let refuse = |what: &str, name: &str| format!("`{name}` is {what}; {OF_CONSTANTS}");
        numbers.refuse("time", &refuse("no constant", "time"));
        for p in &model.parameters {
            numbers.refuse(&p.name, &refuse("a parameter, an unknown", &p.name));
        }
        for phase in &model.phases {
            phase.states.iter().for_each(|s| numbers.refuse(&s.name, &refuse("a state", &s.name)));
            phase.controls.iter().for_each(|c| numbers.refuse(&c.name, &refuse("a control", &c.name)));
        }
        Self { source, texts, model, constants, numbers }
    }

    /// A compiler of formulas over what a recorder has as inputs; it knows the constants.
    pub(crate) fn compiler<R: Recorder>(&self, recorder: R) -> Compiler<'a, R> {
        let mut compiler = Compiler::new(recorder, &self.model.library, self.model.checks_units);
        name_constants(&mut compiler, self.model, &self.constants);
        compiler
    }

    pub(crate) fn formula_error(&self, source: ExpressionError) -> ProblemError {
        let at = self.source.place(&self.texts.bytes(source.at()));
        ProblemError::Formula { at, source }
    }

    pub(crate) fn conflict(&self, at: &Range<usize>, reason: impl Into<String>) -> ProblemError {
        ProblemError::Conflict { at: self.source.place(at), reason: reason.into() }
    }

    /// The number of a formula of constants; none where it is none.
    pub(crate) fn constant(&mut self, formula: &Expression) -> Option<f64> {
        self.numbers.compile(formula, None, "").ok().and_then(|q| q.number())
    }

    /// An amount in the coherent unit of `unit`, which numbers are in.
    pub(crate) fn amount(&mut self, stated: &Stated, unit: &Unit, role: &str) -> Result<f64, ProblemError> {
        match &stated.amount {
            Amount::Number(number) if number.is_nan() => Err(self.value(stated, role, *number, "a number")),
            Amount::Number(number) => Ok(number * unit.factor),
            Amount::Formula(formula) => {
                let number = self.numbers.number(formula, Some(unit.dimension), role, OF_CONSTANTS);
                number.map_err(|e| self.formula_error(e))
            }
        }
    }

    pub(crate) fn optional(
        &mut self,
        stated: Option<&Stated>,
        unit: &Unit,
        role: &str,
    ) -> Result<Option<f64>, ProblemError> {
        stated.map(|s| self.amount(s, unit, role)).transpose()
    }

    /// An amount that is finite: a kink, a jump.
    pub(crate) fn finite(&mut self, stated: &Stated, unit: &Unit, role: &str) -> Result<f64, ProblemError> {
        let found = self.amount(stated, unit, role)?;
        if found.is_finite() { Ok(found) } else { Err(self.value(stated, role, found, "a finite number")) }
    }

    fn value(&self, stated: &Stated, role: &str, found: f64, allowed: &str) -> ProblemError {
        ProblemError::Value {
            at: self.source.place(&stated.at),
            what: role.into(),
            found: found.to_string(),
            allowed: allowed.into(),
        }
    }

    /// A positive amount: a scale, a tolerance.
    pub(crate) fn positive(
        &mut self,
        stated: Option<&Stated>,
        unit: &Unit,
        role: &str,
    ) -> Result<Option<f64>, ProblemError> {
        let Some(stated) = stated else { return Ok(None) };
        let found = self.amount(stated, unit, role)?;
        if found > 0.0 && found.is_finite() {
            return Ok(Some(found));
        }
        Err(self.value(stated, role, found, "a finite number above zero"))
    }

    pub(crate) fn bounds(
        &mut self,
        [least, most]: [Option<&Stated>; 2],
        unit: &Unit,
        role: &str,
    ) -> Result<Bounds, ProblemError> {
        let lower = self.optional(least, unit, role)?.unwrap_or(f64::NEG_INFINITY);
        let upper = self.optional(most, unit, role)?.unwrap_or(f64::INFINITY);
        let fine = lower <= upper && lower < f64::INFINITY && upper > f64::NEG_INFINITY;
        if let Some(at) = most.or(least).filter(|_| !fine) {
            let (lower, upper) = (lower / unit.factor, upper / unit.factor);
            let reason =
                format!("the bounds of {role} are [{lower}, {upper}] {unit}: the smaller one stands first");
            return Err(self.conflict(&at.at, reason));
        }
        Ok(Bounds::new(lower, upper))
    }

    pub(crate) fn end(&mut self, end: &End, unit: &Unit, role: &str) -> Result<Bounds, ProblemError> {
        match end {
            End::Free => Ok(Bounds::FREE),
            End::Fixed(stated) => {
                let value = self.amount(stated, unit, role)?;
                if !value.is_finite() {
                    let allowed = "a finite number, [least, most] or \"free\"";
                    return Err(self.value(stated, role, value, allowed));
                }
                Ok(Bounds::fixed(value))
            }
            End::Between(least, most) => self.bounds([Some(least), Some(most)], unit, role),
        }
    }

    /// A row of a constraint: what is bounded, with name, unit, bounds and scale.
    pub(crate) fn row<R: Recorder>(
        &mut self,
        compiler: &mut Compiler<'a, R>,
        row: &Row,
        role: &str,
    ) -> Result<(Quantity<R::Value>, Variable), ProblemError> {
        let wanted = row.unit.as_ref().map(|u| u.dimension);
        let (value, bounds) = match &row.formula {
            Bounded::Keys { value, least, most } => {
                let value = compiler.compile(value, wanted, role).map_err(|e| self.formula_error(e))?;
                let unit = self.unit_of(row.unit.as_ref(), value.dimension);
                (value, self.bounds([least.as_ref(), most.as_ref()], &unit, role)?)
            }
            Bounded::Relation(relation) => {
                let side = |s: &Expression| compiler.compile(s, wanted, role).map(|q| (q, s.at()));
                let sides: Vec<_> = relation
                    .sides
                    .iter()
                    .map(side)
                    .collect::<Result<_, _>>()
                    .map_err(|e| self.formula_error(e))?;
                let numbers: Vec<_> = sides.iter().map(|(q, _)| q.number()).collect();
                for (k, comparison) in relation.comparisons.iter().enumerate() {
                    compiler
                        .difference(sides[k].0, *comparison, sides[k + 1].0, &sides[k + 1].1)
                        .map_err(|e| self.formula_error(e))?;
                }
                match (&relation.comparisons[..], &numbers[..]) {
                    (_, all) if all.iter().all(Option::is_some) => {
                        return Err(
                            self.conflict(&row.at, "both sides are constants: nothing is left to choose")
                        );
                    }
                    ([c], [_, Some(limit)]) => (sides[0].0, side_of(*c, *limit)),
                    ([c], [Some(limit), _]) => (sides[1].0, side_of(flipped(*c), *limit)),
                    ([c], [None, None]) => {
                        let difference = compiler.difference(sides[0].0, *c, sides[1].0, &sides[1].1);
                        (difference.map_err(|e| self.formula_error(e))?, side_of(*c, 0.0))
                    }
                    ([a, b], [Some(first), None, Some(last)]) => {
                        let bounds = side_of(flipped(*a), *first).intersect(&side_of(*b, *last));
                        let same_way =
                            a.is_less() == b.is_less() && *a != Comparison::Equal && *b != Comparison::Equal;
                        if !same_way || bounds.lower > bounds.upper {
                            let reason = "a chain of comparisons goes one way and leaves values between: `1 <= x <= 2`";
                            return Err(self.conflict(&row.at, reason));
                        }
                        (sides[1].0, bounds)
                    }
                    _ => {
                        let reason =
                            "a chain of comparisons has constants at both ends and one formula between them";
                        return Err(self.conflict(&row.at, reason));
                    }
                }
            }
        };
        if bounds.lower == f64::INFINITY || bounds.upper == f64::NEG_INFINITY {
            let reason = format!("{role} is compared with a number that is not finite: nothing can hold it");
            return Err(self.conflict(&row.at, reason));
        }
        if let Value::Number(number) = value.value {
            let reason = format!("{role} is the number {number} everywhere: nothing is left to choose");
            return Err(self.conflict(&row.at, reason));
        }
        let unit = self.unit_of(row.unit.as_ref(), value.dimension);
        let scale = self.positive(row.scale.as_ref(), &unit, &format!("the scale of {role}"))?;
        let variable =
            Variable { name: row.name.clone(), unit: self.label(&unit), bounds, scale, guards: row.guards };
        Ok((value, variable))
    }

    /// The stated unit, else the coherent one of a dimension.
    pub(crate) fn unit_of(&self, stated: Option<&Unit>, dimension: Dimension) -> Unit {
        match stated {
            Some(unit) => unit.clone(),
            None if self.model.checks_units => Unit::coherent_of(dimension),
            None => Unit::none(),
        }
    }

    /// The coherent unit as a label.
    pub(crate) fn label(&self, unit: &Unit) -> String {
        if self.model.has_units { unit.coherent().to_owned() } else { "-".into() }
    }
}

fn name_constants<R: Recorder>(compiler: &mut Compiler<'_, R>, model: &Model, constants: &[f64]) {
    for (c, v) in model.constants.iter().zip(constants) {
        compiler.name(&c.name, Quantity::new(Value::Number(*v), c.unit.dimension));
    }
}

/// The values that are on the left of a comparison with a limit.
fn side_of(comparison: Comparison, limit: f64) -> Bounds {
    match comparison {
        Comparison::Less | Comparison::AtMost => Bounds::at_most(limit),
        Comparison::Greater | Comparison::AtLeast => Bounds::at_least(limit),
        Comparison::Equal => Bounds::fixed(limit),
    }
}

fn flipped(comparison: Comparison) -> Comparison {
    match comparison {
        Comparison::Less => Comparison::Greater,
        Comparison::AtMost => Comparison::AtLeast,
        Comparison::Greater => Comparison::Less,
        Comparison::AtLeast => Comparison::AtMost,
        Comparison::Equal => Comparison::Equal,
    }
}
