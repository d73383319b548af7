//! The motion about a body: which formulas are position and velocity, so that ephemerides are made of a flight.
//!
//! The formulas of a phase are one function of its states, controls, parameters and time, in SI: position (m) and velocity (m/s), and mass (kg)
//! and thrust (N) where they are stated.

use std::ops::Range;
use std::sync::Arc;

use apsides_ad::{NodeFunction, Table};
use apsides_expressions::suggestion::suggested_name;
use apsides_expressions::{Dimension, Expression, Unit};

use crate::amounts::Amounts;
use crate::error::ProblemError;
use crate::model::{Model, MotionAxes, MotionPart, Phase, StatedMotion};
use crate::pose::{Inputs, TIME, time_unit};

const VELOCITY: Dimension = Dimension::new([1.0, 0.0, -1.0, 0.0, 0.0, 0.0]);
const FORCE: Dimension = Dimension::new([1.0, 1.0, -2.0, 0.0, 0.0, 0.0]);

/// Components of a vector.
pub(crate) const VECTOR: usize = 3;

/// The motion of a vehicle at an instant, in the axes that its problem states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VehicleMotion {
    /// Position, m.
    pub position: [f64; 3],
    /// Velocity, m/s.
    pub velocity: [f64; 3],
    /// Mass, kg, where the problem states it.
    pub mass: Option<f64>,
    /// Thrust, N, where the problem states it.
    pub thrust: Option<[f64; 3]>,
}

/// The stated motion of a problem, for values of its constants.
#[derive(Clone)]
pub struct PosedMotion {
    /// The axes of positions, velocities and thrusts.
    pub axes: MotionAxes,
    /// Longitude and geodetic latitude (rad) of the site and its height (m), if there is one.
    pub site: Option<[f64; 3]>,
    functions: Vec<Arc<dyn NodeFunction>>,
    has_mass: bool,
    has_thrust: bool,
}

impl PosedMotion {
    /// The motion in a phase (by its place) at a state, a control, the parameters and a time (s), all in SI; none where there is no such phase,
    /// or where the sizes are not those of the phase.
    #[must_use]
    pub fn at(
        &self,
        phase: usize,
        [state, control, parameters]: [&[f64]; 3],
        time: f64,
    ) -> Option<VehicleMotion> {
        let function = self.functions.get(phase)?;
        let z = [state, control, parameters, &[time]].concat();
        let mut out = vec![f64::NAN; function.outputs()];
        if z.len() != function.inputs() {
            return None;
        }
        function.value(&z, &mut out);
        let mut values = out.into_iter();
        let mut next = || values.next().unwrap_or(f64::NAN);
        let mut vector = || [next(), next(), next()];
        let (position, velocity) = (vector(), vector());
        let thrust = self.has_thrust.then(&mut vector);
        let mass = self.has_mass.then(&mut next);
        Some(VehicleMotion { position, velocity, mass, thrust })
    }
}

/// The motion that a problem states, if it does.
pub(crate) fn motion(
    amounts: &mut Amounts<'_>,
    tables: &[Table],
) -> Result<Option<PosedMotion>, ProblemError> {
    let model = amounts.model;
    let Some(stated) = &model.motion else { return Ok(None) };
    if !model.has_units {
        let reason =
            "positions about a body are lengths, and no unit is declared: give the quantities their units";
        return Err(amounts.conflict(&stated.at, reason));
    }
    for part in stated.parts() {
        let phases: Vec<&str> = model.phases.iter().map(|p| p.name.as_str()).collect();
        if let Some(name) = part.phase.as_deref().filter(|name| !phases.contains(name)) {
            let reason = format!("no phase is named `{name}`{}", suggested_name(name, "phases", &phases));
            return Err(amounts.conflict(&part.at, reason));
        }
    }
    let site = site(amounts, stated)?;
    let functions = model.phases.iter().map(|phase| of_phase(amounts, stated, phase, tables));
    Ok(Some(PosedMotion {
        axes: stated.axes,
        site,
        functions: functions.collect::<Result<_, _>>()?,
        has_mass: !stated.mass.is_empty(),
        has_thrust: !stated.thrust.is_empty(),
    }))
}

fn site(amounts: &mut Amounts<'_>, stated: &StatedMotion) -> Result<Option<[f64; 3]>, ProblemError> {
    let Some(site) = &stated.site else { return Ok(None) };
    let units = ["deg", "deg", "m"].map(|unit| Unit::parse(unit).unwrap_or_else(|_| Unit::none()));
    let mut values = [0.0; VECTOR];
    let parts = [Some(&site.longitude), Some(&site.latitude), site.altitude.as_ref()];
    for (((part, unit), name), value) in
        parts.into_iter().zip(&units).zip(["longitude", "latitude", "altitude"]).zip(&mut values)
    {
        let Some(part) = part else { continue };
        *value = amounts.finite(part, unit, &format!("the {name} of the site"))?;
    }
    if values[1].abs() > std::f64::consts::FRAC_PI_2 {
        let reason = format!(
            "the latitude of the site is {} deg, allowed are -90 to 90: a number without a unit is in deg",
            values[1].to_degrees()
        );
        return Err(amounts.conflict(&site.latitude.at, reason));
    }
    Ok(Some(values))
}

/// The function of a phase: position, velocity, and thrust and mass where they are stated.
fn of_phase(
    amounts: &Amounts<'_>,
    stated: &StatedMotion,
    phase: &Phase,
    tables: &[Table],
) -> Result<Arc<dyn NodeFunction>, ProblemError> {
    if time_unit(amounts, phase).dimension != Dimension::TIME {
        let reason = format!(
            "times of a motion about a body are in s or min, and those of phase `{}` have no unit",
            phase.name
        );
        return Err(amounts.conflict(&stated.at, reason));
    }
    let free = [f64::NEG_INFINITY, f64::INFINITY];
    let mut inputs = Inputs::new(amounts, phase, free, tables);
    for name in of_other_phases(amounts.model, phase) {
        let reason = format!(
            "`{name}` is no quantity of phase `{}`: state the formulas by phase, `{{ {} = .., .. }}`",
            phase.name, phase.name
        );
        inputs.compiler.refuse(name, &reason);
    }
    let quantities = [
        ("position", &stated.position, Dimension::LENGTH, VECTOR),
        ("velocity", &stated.velocity, VELOCITY, VECTOR),
        ("thrust", &stated.thrust, FORCE, VECTOR),
        ("mass", &stated.mass, Dimension::MASS, 1),
    ];
    let mut outputs = Vec::new();
    for (what, parts, dimension, size) in quantities {
        if parts.is_empty() {
            continue;
        }
        let is_of = |part: &&MotionPart| part.phase.as_ref().is_none_or(|name| *name == phase.name);
        let Some(part) = parts.iter().find(is_of) else {
            let at = parts.first().map_or(&stated.at, |part| &part.at);
            let reason = format!(
                "`motion.{what}` has nothing of phase `{}`: state it for each phase, or once for all",
                phase.name
            );
            return Err(amounts.conflict(at, reason));
        };
        for (formula, axis) in part.components.iter().zip(["first", "second", "third"]) {
            let role =
                if size == 1 { format!("the {what}") } else { format!("the {axis} component of the {what}") };
            let compiled = inputs.compiler.compile(formula, Some(dimension), &role);
            outputs.push(compiled.map_err(|e| amounts.formula_error(e))?);
        }
    }
    let formula = inputs.formula(&outputs);
    let at = |at: &Range<usize>| amounts.source.place(at);
    let formula = formula.map_err(|source| ProblemError::Program { at: at(&stated.at), source })?;
    Ok(apsides_ad::formula_node(formula))
}

/// States and controls that other phases have and this one has not.
fn of_other_phases<'a>(model: &'a Model, phase: &'a Phase) -> impl Iterator<Item = &'a str> {
    let names = |p: &'a Phase| p.states.iter().chain(&p.controls).map(|v| v.name.as_str());
    let is_known = move |name: &&str| *name == TIME || names(phase).any(|own| own == *name);
    model.phases.iter().flat_map(names).filter(move |name| !is_known(name))
}

impl StatedMotion {
    /// All parts.
    pub(crate) fn parts(&self) -> impl Iterator<Item = &MotionPart> {
        [&self.position, &self.velocity, &self.thrust, &self.mass].into_iter().flatten()
    }

    /// The keys of its formulas in a file, with their parts.
    pub(crate) fn named_parts(&self) -> [(&'static str, &[MotionPart]); 4] {
        [
            ("position", &self.position),
            ("velocity", &self.velocity),
            ("thrust", &self.thrust),
            ("mass", &self.mass),
        ]
    }
}

impl MotionPart {
    /// The components of a quantity in all phases.
    #[must_use]
    pub fn of_all(components: Vec<Expression>, at: Range<usize>) -> Self {
        Self { phase: None, at, components }
    }
}
