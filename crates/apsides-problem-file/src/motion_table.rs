//! The table `[motion]` of a file.

use apsides_expressions::Expression;
use toml::de::DeValue;

use crate::error::ProblemError;
use crate::model::{MotionAxes, MotionPart, MotionSite, StatedMotion};
use crate::motion::VECTOR;
use crate::reader::{Field, Node, Reader};

pub(crate) const KEYS: [&str; 7] = ["body", "axes", "site", "position", "velocity", "thrust", "mass"];
pub(crate) const SITE: [&str; 3] = ["longitude", "latitude", "altitude"];

const VECTORS: &str = "three formulas, [\"x\", \"y\", 0], or a table of those of each phase";

impl Reader<'_> {
    pub(crate) fn motion(&mut self, field: &Field<'_, '_>) -> Result<StatedMotion, ProblemError> {
        let mut body = None;
        let mut motion = StatedMotion {
            at: field.at.clone(),
            body: String::new(),
            body_at: field.at.clone(),
            axes: MotionAxes::Inertial,
            site: None,
            position: Vec::new(),
            velocity: Vec::new(),
            thrust: Vec::new(),
            mass: Vec::new(),
        };
        for field in self.table_of(field.value, "motion", &KEYS)? {
            let (value, what) = (field.value, format!("motion.{}", field.name));
            match field.name {
                "body" => body = Some((self.string(value, &what)?.to_owned(), value.span())),
                "axes" => motion.axes = self.axes(value, &what)?,
                "site" => motion.site = Some(self.site(&field, &what)?),
                "position" => motion.position = self.parts(&field, &what, VECTOR)?,
                "velocity" => motion.velocity = self.parts(&field, &what, VECTOR)?,
                "thrust" => motion.thrust = self.parts(&field, &what, VECTOR)?,
                _ => motion.mass = self.parts(&field, &what, 1)?,
            }
        }
        let missing = |key: &str, allowed: &str| {
            Err(self.refused(&field.at, "motion", format!("without `{key}`"), allowed))
        };
        let Some((name, at)) = body else {
            return missing("body", "body = \"moon\", the name of one that `apsides bodies` lists");
        };
        (motion.body, motion.body_at) = (name, at);
        for (key, parts) in [("position", &motion.position), ("velocity", &motion.velocity)] {
            if parts.is_empty() {
                return missing(key, &format!("{key} = {VECTORS}"));
            }
        }
        match (motion.axes, motion.site.is_some()) {
            (MotionAxes::Site, false) => {
                missing("site", "site = { longitude = \"-19.5 deg\", latitude = \"44.1 deg\" } with axes = \"site\"")
            }
            (MotionAxes::Inertial | MotionAxes::Fixed, true) => Err(self.conflict(
                &field.at,
                "`motion.site` goes with axes = \"site\", whose components are to the east, to the north and upwards: add it, or leave the site away",
            )),
            _ => Ok(motion),
        }
    }

    fn axes(&self, value: &Node<'_>, what: &str) -> Result<MotionAxes, ProblemError> {
        let word = self.string(value, what)?;
        MotionAxes::of_word(word).ok_or_else(|| {
            let allowed =
                "\"inertial\", \"fixed\" (to the body) or \"site\" (to the east, to the north, upwards)";
            self.refused(&value.span(), what, format!("\"{word}\""), allowed)
        })
    }

    fn site(&mut self, field: &Field<'_, '_>, what: &str) -> Result<MotionSite, ProblemError> {
        let mut parts = [None, None, None];
        for field in self.table_of(field.value, what, &SITE)? {
            let part = self.stated(field.value, &format!("{what}.{}", field.name))?;
            if let Some((_, place)) = SITE.iter().zip(&mut parts).find(|(name, _)| **name == field.name) {
                *place = Some(part);
            }
        }
        match parts {
            [Some(longitude), Some(latitude), altitude] => Ok(MotionSite { longitude, latitude, altitude }),
            _ => {
                let allowed =
                    "{ longitude = \"-19.5 deg\", latitude = \"44.1 deg\", altitude = \"-2640 m\" }";
                Err(self.refused(&field.at, what, "without longitude and latitude".into(), allowed))
            }
        }
    }

    /// Formulas of all phases, or a table of those of each.
    fn parts(
        &mut self,
        field: &Field<'_, '_>,
        what: &str,
        size: usize,
    ) -> Result<Vec<MotionPart>, ProblemError> {
        let DeValue::Table(_) = field.value.get_ref() else {
            let components = self.components(field.value, what, size)?;
            return Ok(vec![MotionPart::of_all(components, field.at.clone())]);
        };
        let mut parts = Vec::new();
        for field in self.table(field.value, what)? {
            let components = self.components(field.value, &format!("{what}.{}", field.name), size)?;
            parts.push(MotionPart { phase: Some(field.name.to_owned()), at: field.at, components });
        }
        if parts.is_empty() {
            return Err(self.refused(&field.value.span(), what, "an empty table".into(), VECTORS));
        }
        Ok(parts)
    }

    fn components(
        &mut self,
        value: &Node<'_>,
        what: &str,
        size: usize,
    ) -> Result<Vec<Expression>, ProblemError> {
        if size == 1 {
            return Ok(vec![self.formula(value, what)?]);
        }
        let items = self.list(value, what)?;
        if items.len() != size {
            let found = format!("a list of {}", items.len());
            return Err(self.refused(&value.span(), what, found, VECTORS));
        }
        items.into_iter().map(|item| self.formula(item, what)).collect()
    }
}
