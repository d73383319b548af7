//! The motion of a problem about a body, from what Python states.

use apsides_problem_file::model::{MotionAxes, MotionPart, MotionSite, StatedMotion, at_place};
use pyo3::prelude::*;

use crate::statement::{Reader, Where};
use crate::symbol::Operand;

/// Formulas of a quantity in one phase, or in the only one: phase, place, components.
type PartIn = (Option<String>, usize, Vec<Operand>);

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct MotionIn {
    at: usize,
    body: String,
    axes: String,
    site: Option<(Operand, Operand, Option<Operand>)>,
    position: Vec<PartIn>,
    velocity: Vec<PartIn>,
    thrust: Vec<PartIn>,
    mass: Vec<PartIn>,
}

impl Reader {
    /// A motion; formulas without a phase are of `only`.
    pub(crate) fn motion(&mut self, motion: MotionIn, only: &str) -> PyResult<StatedMotion> {
        let MotionIn { at, body, axes, site, position, velocity, thrust, mass } = motion;
        let site = site.map(|(longitude, latitude, altitude)| {
            Ok::<_, PyErr>(MotionSite {
                longitude: self.stated(longitude, at)?,
                latitude: self.stated(latitude, at)?,
                altitude: self.optional(altitude, at)?,
            })
        });
        let site = site.transpose()?;
        let axes = MotionAxes::of_word(&axes).ok_or_else(|| {
            let words = MotionAxes::WORDS.map(|(word, _)| format!("\"{word}\"")).join(", ");
            self.refused(at, &format!("`axes` is \"{axes}\", allowed is one of {words}"))
        })?;
        let mut parts = |parts: Vec<PartIn>| {
            let part = |(phase, at, components): PartIn| {
                let along = Where::Phase(phase.as_deref().unwrap_or(only));
                let components = components.into_iter().map(|f| self.formula(f, along, at));
                Ok(MotionPart { components: components.collect::<PyResult<_>>()?, at: at_place(at), phase })
            };
            parts.into_iter().map(part).collect::<PyResult<Vec<_>>>()
        };
        let [position, velocity] = [parts(position)?, parts(velocity)?];
        let [thrust, mass] = [parts(thrust)?, parts(mass)?];
        let place = at_place(at);
        Ok(StatedMotion {
            body_at: place.clone(),
            at: place,
            body,
            axes,
            site,
            position,
            velocity,
            thrust,
            mass,
        })
    }
}
