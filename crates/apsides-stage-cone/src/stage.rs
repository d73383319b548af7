//! Data of a program: stages, and the program that they make.

use crate::error::StageError;
use crate::row::Row;

/// One stage: `NW` variables `w = (u, x)`, controls first, the `NX` states last; at most `NR` rows of constraints.
///
/// ```text
/// cost . w,   x_next = dynamics w + offset,   rows w + constants in R+ x Q x Q x ...
/// ```
///
/// `Q = {(t, v): |v| <= t}`. Linear rows come first, then the cones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stage<const NX: usize, const NW: usize, const NR: usize> {
    /// Cost of each variable.
    pub cost: [f64; NW],
    /// State of the next stage as a function of the variables; without use in the last stage.
    pub dynamics: [Row<NW>; NX],
    /// Constant part of the state of the next stage.
    pub offset: [f64; NX],
    /// Controls that are variables; the others are zero, and must have no cost and no entry in a row. By default all are.
    pub controls: [bool; NW],
    pub(crate) rows: [Row<NW>; NR],
    pub(crate) constants: [f64; NR],
    pub(crate) length: usize,
    pub(crate) linear: usize,
    pub(crate) cones: [u8; NR],
    pub(crate) cone_count: usize,
    malformed: bool,
}

impl<const NX: usize, const NW: usize, const NR: usize> Default for Stage<NX, NW, NR> {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl<const NX: usize, const NW: usize, const NR: usize> Stage<NX, NW, NR> {
    /// No cost, no constraint, a next state of zero.
    pub const EMPTY: Self = {
        assert!(
            NX <= NW && NW <= 255 && NR <= 255,
            "states are the last of the variables; at most 255 variables and rows"
        );
        Self {
            cost: [0.0; NW],
            dynamics: [Row::ZERO; NX],
            offset: [0.0; NX],
            controls: [true; NW],
            rows: [Row::ZERO; NR],
            constants: [0.0; NR],
            length: 0,
            linear: 0,
            cones: [0; NR],
            cone_count: 0,
            malformed: false,
        }
    };
    /// Number of controls.
    pub const CONTROLS: usize = NW - NX;

    /// Column of a state.
    #[must_use]
    pub const fn state(index: usize) -> usize {
        NW - NX + index
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.length
    }

    /// Number of linear rows, which are the first.
    #[must_use]
    pub fn linear_rows(&self) -> usize {
        self.linear
    }

    /// Sizes of the cones after the linear rows.
    #[must_use]
    pub fn cone_sizes(&self) -> &[u8] {
        &self.cones[..self.cone_count]
    }

    /// Rows and constants, in order.
    pub fn constraints(&self) -> impl Iterator<Item = (&Row<NW>, f64)> {
        self.rows[..self.length].iter().zip(self.constants[..self.length].iter().copied())
    }

    /// Removes all constraints.
    pub fn clear(&mut self) {
        (self.length, self.linear, self.cone_count, self.malformed) = (0, 0, 0, false);
    }

    /// Adds `row w + constant >= 0`. After a cone, or beyond `NR` rows, the program is refused.
    pub fn add_linear(&mut self, row: Row<NW>, constant: f64) {
        if self.cone_count > 0 {
            self.malformed = true;
        }
        self.push(row, constant);
        self.linear = self.length;
    }

    /// Adds `|(row w + constant)_1..| <= (row w + constant)_0`. A cone without rows is none, one of one row is `>= 0`.
    pub fn add_cone(&mut self, rows: &[(Row<NW>, f64)]) {
        if rows.is_empty() {
            return;
        }
        for &(row, constant) in rows {
            self.push(row, constant);
        }
        if self.malformed {
            return;
        }
        self.cones[self.cone_count] = rows.len() as u8;
        self.cone_count += 1;
    }

    fn push(&mut self, row: Row<NW>, constant: f64) {
        if self.length == NR {
            self.malformed = true;
            return;
        }
        (self.rows[self.length], self.constants[self.length]) = (row, constant);
        self.length += 1;
    }

    fn check(&self, stage: usize, last: bool) -> Result<(), StageError> {
        let finite = |values: &[f64]| values.iter().all(|v| v.is_finite());
        if self.malformed {
            return Err(StageError::Rows { stage, most: NR });
        }
        let rows = &self.rows[..self.length];
        let moved: &[Row<NW>] = if last { &[] } else { &self.dynamics };
        if !rows.iter().chain(moved).all(Row::is_valid) {
            return Err(StageError::Row { stage, columns: NW });
        }
        if !(finite(&self.cost) && finite(&self.constants[..self.length]) && (last || finite(&self.offset))) {
            return Err(StageError::Value { stage });
        }
        let used = |c: usize| c >= Self::CONTROLS || self.controls[c];
        let priced = (0..NW).any(|c| !used(c) && self.cost[c] != 0.0);
        if priced || rows.iter().chain(moved).any(|r| r.terms().any(|(c, _)| !used(c))) {
            return Err(StageError::Control { stage });
        }
        Ok(())
    }
}

/// A program over stages one after another, from a given state.
///
/// ```text
/// minimise sum_k cost_k . w_k   subject to x_0 = start,  x_k+1 = dynamics_k w_k + offset_k,  constraints of each stage,
///                                          end x_last = end_values
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StageProgram<'a, const NX: usize, const NW: usize, const NR: usize, const NE: usize> {
    /// The stages, at least one.
    pub stages: &'a [Stage<NX, NW, NR>],
    /// State of the first stage.
    pub start: [f64; NX],
    /// Equations on the state of the last stage.
    pub end: [[f64; NX]; NE],
    /// Their values.
    pub end_values: [f64; NE],
}

impl<const NX: usize, const NW: usize, const NR: usize, const NE: usize> StageProgram<'_, NX, NW, NR, NE> {
    pub(crate) fn check(&self) -> Result<(), StageError> {
        if self.stages.is_empty() {
            return Err(StageError::NoStage);
        }
        for (k, stage) in self.stages.iter().enumerate() {
            stage.check(k, k + 1 == self.stages.len())?;
        }
        let ends = self.end.iter().flatten().chain(&self.end_values).chain(&self.start);
        if ends.copied().all(f64::is_finite) { Ok(()) } else { Err(StageError::Ends) }
    }
}
