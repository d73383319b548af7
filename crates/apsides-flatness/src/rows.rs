//! Rows of the discretised problem in the words of its statement.

use apsides_ocp::{Bounds, Ocp, Phase, RowOrigin};

use crate::settings::BoundRows;

/// One row: its bounds, its scale (NaN where the statement gives none) and where it comes from.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    pub(crate) bounds: Bounds,
    pub(crate) scale: f64,
    /// Without a time, which changes with the variables.
    pub(crate) origin: RowOrigin,
    /// Normalised time of the row in its phase, where it has one.
    pub(crate) fraction: Option<f64>,
}

impl Row {
    pub(crate) fn new(
        phase: Option<&Phase>,
        name: String,
        unit: &str,
        fraction: Option<f64>,
        bounds: Bounds,
        scale: f64,
    ) -> Self {
        let phase = phase.map(|p| p.name.clone());
        Self { bounds, scale, origin: RowOrigin { phase, name, unit: unit.into(), time: None }, fraction }
    }
}

impl std::fmt::Display for Row {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(phase) = &self.origin.phase {
            write!(f, "phase `{phase}`, ")?;
        }
        write!(f, "constraint `{}`", self.origin.name)?;
        if let Some(s) = self.fraction {
            write!(f, " at {s:.4} of the phase")?;
        }
        Ok(())
    }
}

/// The bounds along a phase that are rows.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Active {
    pub(crate) states: Vec<bool>,
    pub(crate) controls: Vec<bool>,
    pub(crate) path: Vec<Vec<bool>>,
}

impl Active {
    /// Bounds to begin with.
    pub(crate) fn first(ocp: &Ocp, bounds: BoundRows) -> Vec<Self> {
        let keep = |b: &Bounds| match bounds {
            BoundRows::Everywhere => *b != Bounds::FREE,
            BoundRows::WhereExceeded => b.is_fixed(),
        };
        let phase = |p: &Phase| Self {
            states: p.states.iter().map(|s| keep(&s.variable.bounds)).collect(),
            controls: p.controls.iter().map(|c| keep(&c.bounds)).collect(),
            path: p.path.iter().map(|c| c.rows.iter().map(|r| keep(&r.bounds)).collect()).collect(),
        };
        ocp.phases.iter().map(phase).collect()
    }

    /// Adds what `other` has; says whether that is anything new.
    pub(crate) fn extend(&mut self, other: &Self) -> bool {
        let before = self.clone();
        let add = |a: &mut Vec<bool>, b: &[bool]| a.iter_mut().zip(b).for_each(|(a, b)| *a |= b);
        add(&mut self.states, &other.states);
        add(&mut self.controls, &other.controls);
        for (a, b) in self.path.iter_mut().zip(&other.path) {
            add(a, b);
        }
        *self != before
    }
}
