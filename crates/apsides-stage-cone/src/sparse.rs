//! A program over stages as one sparse program, for solvers that know no stages: as a check, or in its place.

use crate::row::Row;
use crate::stage::{Stage, StageProgram};

/// One number of the form `minimise q'x, A x + s = b, s in 0 x R+ x Q x Q x ...`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Entry {
    /// Cost of a variable.
    Cost {
        /// The variable.
        column: usize,
        /// Its cost.
        value: f64,
    },
    /// An entry of `A`.
    Matrix {
        /// The row.
        row: usize,
        /// The variable.
        column: usize,
        /// The entry.
        value: f64,
    },
    /// An entry of `b`.
    Constant {
        /// The row.
        row: usize,
        /// The entry.
        value: f64,
    },
    /// The rows up to here since the last cone are a second-order cone of this size.
    Cone {
        /// Number of rows.
        size: usize,
    },
}

impl<const NX: usize, const NW: usize, const NR: usize, const NE: usize> StageProgram<'_, NX, NW, NR, NE> {
    /// Variables, equations, linear rows of the sparse form.
    #[must_use]
    pub fn sparse_sizes(&self) -> [usize; 3] {
        let mut sizes = [0, NE, 0];
        for stage in self.stages {
            sizes[0] += stage.variables();
            sizes[1] += NX;
            sizes[2] += stage.linear;
        }
        sizes
    }

    /// Calls with each number of the sparse form: variables stage by stage without controls that are left out; rows of the equations of the
    /// states and of the end, then linear rows, then cones. Costs and constants that are zero come too.
    pub fn sparse(&self, mut f: impl FnMut(Entry)) {
        let [_, equations, linear] = self.sparse_sizes();
        let mut first = 0;
        let mut before: Option<(&Stage<NX, NW, NR>, usize)> = None;
        let mut row = 0;
        for stage in self.stages {
            (0..NW).filter_map(|c| stage.column(c).map(|column| (c, column))).for_each(|(c, column)| {
                f(Entry::Cost { column: first + column, value: stage.cost[c] });
            });
            for i in 0..NX {
                let state = Stage::<NX, NW, NR>::state(i);
                let column = first + stage.column(state).unwrap_or(state);
                f(Entry::Matrix { row, column, value: 1.0 });
                let mut value = self.start[i];
                if let Some((before, first)) = before {
                    before.write(&before.dynamics[i], row, first, &mut f);
                    value = before.offset[i];
                }
                f(Entry::Constant { row, value });
                row += 1;
            }
            before = Some((stage, first));
            first += stage.variables();
        }
        if let Some((last, first)) = before {
            for (end, &value) in self.end.iter().zip(&self.end_values) {
                for (i, &value) in end.iter().enumerate() {
                    let state = Stage::<NX, NW, NR>::state(i);
                    f(Entry::Matrix { row, column: first + last.column(state).unwrap_or(state), value });
                }
                f(Entry::Constant { row, value });
                row += 1;
            }
        }
        let (mut row, mut cone) = (equations, equations + linear);
        first = 0;
        for stage in self.stages {
            for r in 0..stage.length {
                let place = if r < stage.linear { &mut row } else { &mut cone };
                stage.write(&stage.rows[r], *place, first, &mut f);
                f(Entry::Constant { row: *place, value: stage.constants[r] });
                *place += 1;
            }
            for &size in &stage.cones[..stage.cone_count] {
                f(Entry::Cone { size: usize::from(size) });
            }
            first += stage.variables();
        }
    }
}

impl<const NX: usize, const NW: usize, const NR: usize> Stage<NX, NW, NR> {
    fn variables(&self) -> usize {
        NX + self.controls[..Self::CONTROLS].iter().filter(|c| **c).count()
    }

    /// Place among the variables of the stage, unless it is left out.
    fn column(&self, column: usize) -> Option<usize> {
        let left_out = |to: usize| self.controls[..to.min(Self::CONTROLS)].iter().filter(|c| !**c).count();
        let used = column >= Self::CONTROLS || self.controls[column];
        used.then(|| column - left_out(column))
    }

    fn write(&self, terms: &Row<NW>, row: usize, first: usize, f: &mut impl FnMut(Entry)) {
        for (c, v) in terms.terms() {
            if let Some(column) = self.column(c) {
                f(Entry::Matrix { row, column: first + column, value: -v });
            }
        }
    }
}
