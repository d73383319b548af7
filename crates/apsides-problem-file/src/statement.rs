//! A problem as it is stated, and the problem that values of its constants make of it.

use apsides_ad::{AdError, BicubicSpline, CubicSpline, Outside, Pchip, Table};
use apsides_expressions::suggestion::suggested_name;
use apsides_ocp::not_finite::NamedFormula;
use apsides_ocp::{Guess, Ocp, OcpBuilder};

use crate::amounts::Amounts;
use crate::error::ProblemError;
use crate::missing::missing;
use crate::model::{Bounded, Constant, Model, Row, Shape, StatedMotion, TableData};
use crate::motion::{PosedMotion, motion};
use crate::place::{Place, Source, StatedIn};
use crate::rates::with_limited_rates;
use crate::reader::Texts;
use crate::{ends, guess, names, pose};

/// A complete problem: its parts, each with its place in a file or in a program.
#[derive(Clone, Debug)]
pub struct Statement {
    pub(crate) source: Source,
    texts: Texts,
    pub(crate) model: Model,
    tables: Vec<Table>,
}

/// A problem with a start.
#[derive(Clone)]
pub struct PosedProblem {
    /// The problem, in coherent SI units.
    pub ocp: Ocp,
    /// The point where a method starts.
    pub guess: Guess,
    /// The motion about a body, if one is stated.
    pub motion: Option<PosedMotion>,
}

/// A quantity in the unit that the problem declares.
#[derive(Clone, Debug, PartialEq)]
pub struct DeclaredUnit {
    /// The unit as written; `-` for none.
    pub name: String,
    /// Its size in the coherent SI unit.
    pub factor: f64,
}

impl Statement {
    /// The problem of parts that a program states. `source` names it in messages about the whole, and `places` are those that parts and
    /// formulas refer to by their index.
    ///
    /// # Errors
    /// A name that stands for two things, a table without a curve; all that is missing at once.
    pub fn new(model: Model, source: &str, places: Vec<Place>) -> Result<Self, ProblemError> {
        let source = Source { name: source.to_owned(), stated: StatedIn::Program(places) };
        Self::checked(source, Texts::default(), model)
    }

    pub(crate) fn checked(source: Source, texts: Texts, model: Model) -> Result<Self, ProblemError> {
        let model = with_limited_rates(&source, model)?;
        names::check(&source, &model)?;
        let missing = missing(&model);
        if !missing.is_empty() {
            return Err(ProblemError::Missing { file: source.name, missing });
        }
        let table = |t: &TableData| {
            curve(t).map_err(|e| ProblemError::Table {
                at: source.place(&t.at),
                name: t.name.clone(),
                source: e,
            })
        };
        let tables = model.tables.iter().map(table).collect::<Result<_, _>>()?;
        Ok(Self { source, texts, model, tables })
    }

    /// Name of the problem; `problem` where none is stated.
    #[must_use]
    pub fn name(&self) -> &str {
        self.model.name.as_deref().unwrap_or("problem")
    }

    /// The purpose of the problem, in one line.
    #[must_use]
    pub fn title(&self) -> &str {
        self.model.title.as_deref().unwrap_or("problem with equations of its own")
    }

    /// The constants in order.
    #[must_use]
    pub fn constants(&self) -> &[Constant] {
        &self.model.constants
    }

    /// The place of a constant.
    #[must_use]
    pub fn place_of(&self, constant: &Constant) -> Place {
        *self.source.place(&constant.at)
    }

    /// The place of a formula.
    #[must_use]
    pub fn place_of_formula(&self, formula: &NamedFormula) -> Option<Place> {
        let phase = |name: &str| self.model.phases.iter().find(|p| p.name == name);
        let of_row = |rows: &[Row], name: &str| {
            let row = rows.iter().find(|row| row.name == name)?;
            Some(match &row.formula {
                Bounded::Relation(relation) => {
                    relation.sides.iter().find(|s| s.names().next().is_some())?.at()
                }
                Bounded::Keys { value, .. } => value.at(),
            })
        };
        let span = match formula {
            NamedFormula::Rate(of, state) => {
                let phase = phase(of)?;
                match phase.dynamics.iter().find(|(name, ..)| name == state) {
                    Some((_, _, rate)) => rate.at(),
                    // An integral that the ends take is a state.
                    None => of_row(&phase.integrals, state)?,
                }
            }
            NamedFormula::Path(of, name) => of_row(&phase(of)?.path, name)?,
            NamedFormula::Integrand(of, name) => of_row(&phase(of)?.integrals, name)?,
            NamedFormula::Boundary(name) => of_row(&self.model.boundary, name)?,
            NamedFormula::Objective => self.model.objective.as_ref()?.formula.at(),
        };
        Some(*self.source.place(&self.texts.bytes(&span)))
    }

    /// The stated motion about a body, if there is one.
    #[must_use]
    pub fn motion(&self) -> Option<&StatedMotion> {
        self.model.motion.as_ref()
    }

    /// The place of the name of the body, if a motion is stated.
    #[must_use]
    pub fn place_of_body(&self) -> Option<Place> {
        self.motion().map(|motion| *self.source.place(&motion.body_at))
    }

    /// The unit in which a state, a control, a path constraint or an integral of a phase is declared.
    #[must_use]
    pub fn unit_of(&self, phase: &str, name: &str) -> Option<DeclaredUnit> {
        let phase = self.model.phases.iter().find(|p| p.name == phase)?;
        let variables = phase.states.iter().chain(&phase.controls).map(|v| (&v.name, Some(&v.unit)));
        let rows = phase.path.iter().chain(&phase.integrals).map(|r| (&r.name, r.unit.as_ref()));
        variables.chain(rows).find(|(n, _)| *n == name).and_then(|(_, unit)| unit.map(declared))
    }

    /// The unit in which a parameter is declared.
    #[must_use]
    pub fn parameter_unit(&self, name: &str) -> Option<DeclaredUnit> {
        self.model.parameters.iter().find(|p| p.name == name).map(|p| declared(&p.unit))
    }

    /// The unit in which the times of a phase are stated.
    #[must_use]
    pub fn time_unit(&self, phase: &str) -> Option<DeclaredUnit> {
        let phase = self.model.phases.iter().find(|p| p.name == phase)?;
        let stated = phase.times.as_ref().and_then(|t| t.unit.as_ref()).map(declared);
        let usual = if self.model.has_units { "s" } else { "-" };
        Some(stated.unwrap_or_else(|| DeclaredUnit { name: usual.into(), factor: 1.0 }))
    }

    /// The problem and a start, for values of the constants in their units and in their order.
    ///
    /// # Errors
    /// The first mistake in a formula, a bound or the guess, with its place.
    pub fn pose(&self, constants: &[f64]) -> Result<PosedProblem, ProblemError> {
        let mut amounts = Amounts::new(&self.source, &self.texts, &self.model, constants);
        let mut builder = Ocp::builder(self.name());
        for phase in pose::phases(&mut amounts, &self.tables)? {
            builder = builder.phase(phase);
        }
        for parameter in pose::parameters(&mut amounts)? {
            builder = builder.parameter(parameter);
        }
        builder = self.link(&mut amounts, builder)?;
        builder = ends::boundary(&mut amounts, &self.tables, builder)?;
        builder = ends::objective(&mut amounts, &self.tables, builder)?;
        let problem = |source| ProblemError::Problem { file: self.source.name.clone(), source };
        let ocp = builder.build().map_err(problem)?;
        let guess = guess::guess(&mut amounts, &self.tables, &ocp)?;
        let motion = motion(&mut amounts, &self.tables)?;
        Ok(PosedProblem { ocp, guess, motion })
    }

    fn link(&self, amounts: &mut Amounts<'_>, mut builder: OcpBuilder) -> Result<OcpBuilder, ProblemError> {
        for link in &self.model.links {
            let phase = |name: &str| self.model.phases.iter().find(|p| p.name == name);
            // Names were checked when the file was read.
            let (Some(from), Some(to)) = (phase(&link.from), phase(&link.to)) else { continue };
            let phases = [from, to];
            if link.from == link.to {
                return Err(
                    amounts.conflict(&link.at, format!("phase `{}` cannot be linked to itself", link.from))
                );
            }
            let shared: Vec<&str> = (phases[0].states.iter())
                .filter(|s| phases[1].states.iter().any(|o| o.name == s.name))
                .map(|s| s.name.as_str())
                .collect();
            let stated = link
                .jumps
                .iter()
                .map(|(name, at, _)| (name, at))
                .chain(link.free.iter().map(|(n, at)| (n, at)));
            for (name, at) in stated {
                if !shared.contains(&name.as_str()) {
                    let suggestion = suggested_name(name, "states of both", &shared);
                    let reason = format!("`{name}` is no state of both phases{suggestion}");
                    return Err(amounts.conflict(at, reason));
                }
            }
            for state in &phases[0].states {
                let other = phases[1].states.iter().find(|o| o.name == state.name);
                if let Some(other) = other.filter(|o| o.unit.dimension != state.unit.dimension) {
                    let (a, b) = (&state.unit, &other.unit);
                    let reason =
                        format!("`{}` has the unit {a} in one phase and {b} in the other", state.name);
                    return Err(amounts.conflict(&link.at, reason));
                }
            }
            let mut jumps: Vec<(&str, f64)> = Vec::new();
            for (name, _, stated) in &link.jumps {
                let unit = phases[0].states.iter().find(|s| s.name == *name).map(|s| s.unit.clone());
                let unit = unit.unwrap_or_else(apsides_expressions::Unit::none);
                jumps.push((name, amounts.finite(stated, &unit, &format!("the jump of `{name}`"))?));
            }
            let free = |name: &str| link.free.iter().any(|(n, _)| n == name);
            let jump = |name: &str| match jumps.iter().find(|(n, _)| *n == name) {
                Some((_, jump)) => Some(*jump),
                None => (!free(name)).then_some(0.0),
            };
            builder = builder.link_with_jumps(&link.from, &link.to, jump);
        }
        Ok(builder)
    }
}

fn declared(unit: &apsides_expressions::Unit) -> DeclaredUnit {
    DeclaredUnit { name: unit.to_string(), factor: unit.factor }
}

/// The curve through the data of a table.
///
/// # Errors
/// Too few values, knots that do not increase, numbers that are not finite.
pub fn curve(t: &TableData) -> Result<Table, AdError> {
    Ok(match (t.y.is_empty(), t.shape) {
        (true, Shape::Spline) => CubicSpline::new(&t.x, &t.values)?.into(),
        (true, Shape::Monotone) => Pchip::new(&t.x, &t.values, Outside::Constant)?.into(),
        (false, _) => BicubicSpline::new(&t.x, &t.y, &t.values)?.into(),
    })
}
