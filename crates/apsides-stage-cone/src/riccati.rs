//! The linear system of an iteration by a sweep over the stages.
//!
//! ```text
//! [ 0   F'   -R'  ] [w]   [bw]      F: states of the stages,   R: rows of the constraints
//! [ F   0    0    ] [y] = [by]
//! [-R   0   -W^2  ] [z]   [bz]
//! ```
//!
//! With `z = -W^-2 (R w + bz)` it is a linear-quadratic problem with Hessian `H = R' W^-2 R`. From the last stage to the first the cost to go
//! `x'Px/2 + p'x + nu'Pi'x`, `nu` multipliers of the end equations, is taken through the dynamics `M` and minimised over the controls by a partial
//! Cholesky factorisation `U'U` of `H + M'PM`; states, multipliers of states `y = -(Px + p + Pi nu)` and of rows follow forward (A. Bryson, Y. Ho, Applied
//! Optimal Control, 1975, section 5.3; G. Frison, J. Jorgensen, Efficient implementation of the Riccati recursion, CCA 2013).

use crate::cone::{Cones, sqrt};
use crate::stage::{Stage, StageProgram};
use crate::work::StageWork;

/// Added to the curvature along controls, so that one without any has a factor.
const REGULARISATION: f64 = 1e-13;

/// Least part of a diagonal entry that the elimination leaves of it: less is rounding.
const LEAST_PIVOT: f64 = 1e-12;
/// Most corrections of a solution.
const REFINEMENTS: usize = 3;

/// The small dense system of the multipliers of the end equations.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EndSystem<const NE: usize> {
    /// Upper Cholesky factor.
    matrix: [[f64; NE]; NE],
}

impl<const NE: usize> EndSystem<NE> {
    pub(crate) const ZERO: Self = Self { matrix: [[0.0; NE]; NE] };
}

impl<const NX: usize, const NW: usize, const NR: usize> Stage<NX, NW, NR> {
    pub(crate) fn cones(&self) -> Cones<'_> {
        Cones { linear: self.linear, sizes: &self.cones[..self.cone_count] }
    }

    /// `out -= R' v`.
    #[inline(always)]
    pub(crate) fn subtract_transposed(&self, v: &[f64; NR], out: &mut [f64; NW]) {
        for (v, row) in v.iter().zip(&self.rows[..self.length]) {
            row.add_to(-v, out);
        }
    }

    /// `out += M' v`.
    #[inline(always)]
    pub(crate) fn add_dynamics_transposed(&self, v: &[f64; NX], out: &mut [f64; NW]) {
        for (v, row) in v.iter().zip(&self.dynamics) {
            row.add_to(*v, out);
        }
    }
}

/// Factors all stages, with the scalings of the present point or those that are there; false if the point is not inside the cones, or a pivot
/// not finite.
#[inline(always)]
pub(crate) fn factor<const NX: usize, const NW: usize, const NR: usize, const NE: usize>(
    program: &StageProgram<'_, NX, NW, NR, NE>,
    work: &mut [StageWork<NX, NW, NR, NE>],
    system: &mut EndSystem<NE>,
    rescale: bool,
) -> bool {
    let controls = NW - NX;
    let mut sum = [[0.0; NE]; NE];
    for k in (0..program.stages.len()).rev() {
        let (head, tail) = work.split_at_mut(k + 1);
        let (here, stage) = (&mut head[k], &program.stages[k]);
        if rescale && !here.scaling.update(stage.cones(), &here.slack, &here.point.z) {
            return false;
        }
        here.assemble(stage);
        if let Some(next) = tail.first() {
            here.join(stage, next);
        } else {
            for (e, row) in program.end.iter().enumerate() {
                for (c, ends) in here.ends.iter_mut().enumerate() {
                    ends[e] = if c < controls { 0.0 } else { row[c - controls] };
                }
            }
        }
        if !here.eliminate(&mut sum) {
            return false;
        }
    }
    let diagonal: [f64; NE] = core::array::from_fn(|i| sum[i][i]);
    for i in 0..NE {
        let pivot = sum[i][i].max(LEAST_PIVOT * diagonal[i].abs()).max(REGULARISATION);
        if !pivot.is_finite() {
            return false;
        }
        let root = sqrt(pivot);
        sum[i][i] = root;
        for j in i + 1..NE {
            sum[i][j] /= root;
        }
        for r in i + 1..NE {
            for c in r..NE {
                sum[r][c] -= sum[i][r] * sum[i][c];
            }
        }
    }
    system.matrix = sum;
    true
}

impl<const NX: usize, const NW: usize, const NR: usize, const NE: usize> StageWork<NX, NW, NR, NE> {
    /// Upper triangle of `H = R' W^-2 R`.
    #[inline(always)]
    fn assemble(&mut self, stage: &Stage<NX, NW, NR>) {
        let h = &mut self.factor;
        for (i, row) in h.iter_mut().enumerate() {
            row.fill(0.0);
            if i < NW - NX {
                row[i] = if stage.controls[i] { REGULARISATION } else { 1.0 };
            }
        }
        let cones = stage.cones();
        for r in 0..cones.linear {
            add_square(&stage.rows[r], self.scaling.row(r), h);
        }
        cones.each(|from, to| {
            let (scale, point) = self.scaling.cone(from, to);
            let mut along = [0.0; NW];
            for (i, row) in stage.rows[from..to].iter().enumerate() {
                row.add_to(if i == 0 { point[0] } else { -point[i] }, &mut along);
                add_square(row, if i == 0 { -scale } else { scale }, h);
            }
            for i in 0..NW {
                let factor = 2.0 * scale * along[i];
                if factor != 0.0 {
                    for j in i..NW {
                        h[i][j] += factor * along[j];
                    }
                }
            }
        });
    }

    /// Adds the cost to go from the next stage.
    #[inline(always)]
    fn join(&mut self, stage: &Stage<NX, NW, NR>, next: &Self) {
        let controls = NW - NX;
        // U = P M, row by row; the upper triangle of M' U.
        let mut product = [[0.0; NW]; NX];
        for (product, cost) in product.iter_mut().zip(&next.factor[controls..]) {
            for (row, factor) in stage.dynamics.iter().zip(&cost[controls..]) {
                row.add_to(*factor, product);
            }
        }
        for (row, product) in stage.dynamics.iter().zip(&product) {
            for (i, v) in row.terms() {
                for j in i..NW {
                    self.factor[i][j] += v * product[j];
                }
            }
        }
        if NE > 0 {
            self.ends = [[0.0; NE]; NW];
            for (row, ends) in stage.dynamics.iter().zip(&next.ends[controls..]) {
                for (i, v) in row.terms() {
                    for e in 0..NE {
                        self.ends[i][e] += v * ends[e];
                    }
                }
            }
        }
    }

    /// Eliminates the controls, and leaves their gains; adds to the system of the end equations.
    #[inline(always)]
    fn eliminate(&mut self, sum: &mut [[f64; NE]; NE]) -> bool {
        let controls = NW - NX;
        let h = &mut self.factor;
        let diagonal: [f64; NW] = core::array::from_fn(|i| h[i][i]);
        for i in 0..controls {
            let pivot = h[i][i].max(LEAST_PIVOT * diagonal[i].abs()).max(REGULARISATION);
            if !pivot.is_finite() {
                return false;
            }
            let root = 1.0 / sqrt(pivot);
            let mut row = h[i];
            for j in i..NW {
                row[j] *= root;
            }
            // The inverse of the diagonal entry is what solves need.
            for r in i + 1..NW {
                let factor = row[r];
                if factor != 0.0 {
                    for c in r..NW {
                        h[r][c] -= factor * row[c];
                    }
                }
            }
            row[i] = root;
            h[i] = row;
            if NE > 0 {
                let mut ends = self.ends[i];
                ends.iter_mut().for_each(|e| *e *= root);
                self.ends[i] = ends;
                for r in i + 1..NW {
                    for e in 0..NE {
                        self.ends[r][e] -= row[r] * ends[e];
                    }
                }
                for a in 0..NE {
                    for b in a..NE {
                        sum[a][b] += ends[a] * ends[b];
                    }
                }
            }
        }
        for i in controls..NW {
            for j in i + 1..NW {
                h[j][i] = h[i][j];
            }
        }
        // Gains `U^-1 K`, so that sweeps need no substitution between one stage and the next.
        for i in (0..controls).rev() {
            for j in i + 1..controls {
                let (factor, gains, ends) = (h[i][j], h[j], self.ends[j]);
                for c in controls..NW {
                    h[i][c] -= factor * gains[c];
                }
                for e in 0..NE {
                    self.ends[i][e] -= factor * ends[e];
                }
            }
            let root = h[i][i];
            h[i][controls..].iter_mut().chain(&mut self.ends[i]).for_each(|v| *v *= root);
        }
        true
    }
}

/// Adds a multiple of `row row'` to an upper triangle.
#[inline(always)]
fn add_square<const NW: usize>(row: &crate::row::Row<NW>, factor: f64, h: &mut [[f64; NW]; NW]) {
    for (at, (i, a)) in row.terms().enumerate() {
        let scaled = factor * a;
        for (j, b) in row.terms().skip(at) {
            h[i][j] += scaled * b;
        }
    }
}

/// Solves for the right-hand side in `right` and `ends`; the solution is in `step` and `ends`. Returns its product with the data, `c'w + f'y + a'z`.
///
/// `W^-2` spans many orders of magnitude near a solution, and the condensed right-hand side loses as many digits of the first row: what it is
/// then off by, more than `tolerance`, is solved for again. The other rows hold to rounding.
#[inline(always)]
pub(crate) fn solve<const NX: usize, const NW: usize, const NR: usize, const NE: usize>(
    program: &StageProgram<'_, NX, NW, NR, NE>,
    work: &mut [StageWork<NX, NW, NR, NE>],
    system: &EndSystem<NE>,
    ends: &mut [f64; NE],
    tolerance: f64,
) -> f64 {
    let wanted = *ends;
    let mut value = sweep::<true, NX, NW, NR, NE>(program, work, system, ends);
    if tolerance == f64::INFINITY {
        return value;
    }
    let mut before = f64::INFINITY;
    for _ in 0..REFINEMENTS {
        let mut more = wanted;
        let error = remaining(program, work, ends, &mut more);
        if !(error > tolerance && error < 0.5 * before) {
            break;
        }
        before = error;
        value += sweep::<false, NX, NW, NR, NE>(program, work, system, &mut more);
        for w in work.iter_mut() {
            add(&w.correction.w, &mut w.step.w);
            add(&w.correction.y, &mut w.step.y);
            add(&w.correction.z, &mut w.step.z);
        }
        add(&more, ends);
    }
    value
}

/// Writes what the first row and the end equations are off by into `correction` and `more`; returns the largest.
#[inline(always)]
fn remaining<const NX: usize, const NW: usize, const NR: usize, const NE: usize>(
    program: &StageProgram<'_, NX, NW, NR, NE>,
    work: &mut [StageWork<NX, NW, NR, NE>],
    ends: &[f64; NE],
    more: &mut [f64; NE],
) -> f64 {
    let controls = NW - NX;
    let mut error = 0.0_f64;
    for (k, stage) in program.stages.iter().enumerate() {
        let next = work.get(k + 1).map(|w| w.step.y);
        let here = &mut work[k];
        let (right, step) = (&here.right, &here.step);
        let mut off = right.w;
        for (z, row) in step.z.iter().zip(&stage.rows[..stage.length]) {
            row.add_to(*z, &mut off);
        }
        for i in 0..NX {
            off[controls + i] -= step.y[i];
        }
        if let Some(next) = next {
            stage.add_dynamics_transposed(&next, &mut off);
        } else {
            for (e, row) in program.end.iter().enumerate() {
                for i in 0..NX {
                    off[controls + i] -= row[i] * ends[e];
                }
                more[e] -= inner(row, &step.w[controls..]);
                error = error.max(more[e].abs());
            }
        }
        for i in 0..controls {
            if !stage.controls[i] {
                off[i] = 0.0;
            }
        }
        error = off.iter().fold(error, |m, v| m.max(v.abs()));
        here.correction.w = off;
    }
    error
}

/// Solves for the right-hand side in `right` into `step`, or for that of the first row alone in `correction` in its place. Returns the product with
/// the data.
#[inline(always)]
fn sweep<const FIRST: bool, const NX: usize, const NW: usize, const NR: usize, const NE: usize>(
    program: &StageProgram<'_, NX, NW, NR, NE>,
    work: &mut [StageWork<NX, NW, NR, NE>],
    system: &EndSystem<NE>,
    ends: &mut [f64; NE],
) -> f64 {
    let controls = NW - NX;
    let stages = program.stages;
    // What the end equations are off by at controls of zero but for their multipliers.
    let mut end = ends.map(|e| -e);
    // Gradient of the cost to go from the next stage.
    let mut p = [0.0; NX];
    for k in (0..stages.len()).rev() {
        let last = k + 1 == stages.len();
        if FIRST && !last {
            let next = &work[k + 1];
            let by = &next.right.y;
            for (cost, by) in next.factor[controls..].iter().zip(by) {
                for i in 0..NX {
                    p[i] += cost[controls + i] * by;
                }
            }
            for e in 0..NE {
                for i in 0..NX {
                    end[e] += next.ends[controls + i][e] * by[i];
                }
            }
        }
        let (here, stage) = (&mut work[k], &stages[k]);
        let source = if FIRST { &here.right } else { &here.correction };
        let mut g: [f64; NW] = core::array::from_fn(|i| -source.w[i]);
        if FIRST {
            let mut weighted = source.z;
            here.scaling.inverse_square(stage.cones(), &mut weighted);
            for (v, row) in weighted.iter().zip(&stage.rows[..stage.length]) {
                row.add_to(*v, &mut g);
            }
        }
        if !last {
            stage.add_dynamics_transposed(&p, &mut g);
        }
        p.copy_from_slice(&g[controls..]);
        for i in 0..controls {
            for (p, gain) in p.iter_mut().zip(&here.factor[i][controls..]) {
                *p -= gain * g[i];
            }
            for e in 0..NE {
                end[e] -= here.ends[i][e] * g[i];
            }
        }
        // Controls at a state of zero.
        for i in 0..controls {
            for j in 0..i {
                g[i] -= here.factor[j][i] * g[j];
            }
            g[i] *= here.factor[i][i];
        }
        for i in (0..controls).rev() {
            for j in i + 1..controls {
                g[i] -= here.factor[i][j] * g[j];
            }
            g[i] *= here.factor[i][i];
        }
        g[controls..].copy_from_slice(&p);
        if FIRST {
            here.step.w = g;
        } else {
            here.correction.w = g;
        }
    }
    let mut x = if FIRST { work[0].right.y } else { [0.0; NX] };
    for e in 0..NE {
        for i in 0..NX {
            end[e] += work[0].ends[controls + i][e] * x[i];
        }
    }
    // nu: S nu = end, S = U'U.
    let upper = &system.matrix;
    for i in 0..NE {
        for j in 0..i {
            end[i] -= upper[j][i] * end[j];
        }
        end[i] /= upper[i][i];
    }
    for i in (0..NE).rev() {
        for j in i + 1..NE {
            end[i] -= upper[i][j] * end[j];
        }
        end[i] /= upper[i][i];
    }
    *ends = end;
    let mut value = inner(&program.end_values, ends);
    let mut origin = &program.start;
    for k in 0..stages.len() {
        let (here, stage) = (&mut work[k], &stages[k]);
        let solution = if FIRST { &mut here.step } else { &mut here.correction };
        let mut w = [0.0; NW];
        w[controls..].copy_from_slice(&x);
        for i in 0..controls {
            let shift = solution.w[i] + inner(&here.ends[i], ends);
            w[i] = -(shift + inner(&here.factor[i][controls..], &x));
        }
        let mut y: [f64; NX] =
            core::array::from_fn(|i| -(solution.w[controls + i] + inner(&here.ends[controls + i], ends)));
        for (cost, x) in here.factor[controls..].iter().zip(&x) {
            for i in 0..NX {
                y[i] -= cost[controls + i] * x;
            }
        }
        solution.y = y;
        solution.w = w;
        for (r, row) in stage.rows[..stage.length].iter().enumerate() {
            let own = if FIRST { here.right.z[r] } else { 0.0 };
            solution.z[r] = -(own + row.dot(&w));
        }
        here.scaling.inverse_square(stage.cones(), &mut solution.z);
        let rows = stage.length;
        value +=
            inner(&stage.cost, &w) + inner(origin, &y) + inner(&stage.constants[..rows], &solution.z[..rows]);
        origin = &stage.offset;
        if let Some(next) = work.get(k + 1) {
            for (i, (x, row)) in x.iter_mut().zip(&stage.dynamics).enumerate() {
                *x = row.dot(&w) + if FIRST { next.right.y[i] } else { 0.0 };
            }
        }
    }
    value
}

/// The sum in two parts, so that neither waits for each term of the other.
#[inline(always)]
fn inner(a: &[f64], b: &[f64]) -> f64 {
    let (a, b) = (a.chunks_exact(2), b.chunks_exact(2));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    let sums = a.zip(b).fold([rest, 0.0], |sums, (a, b)| [sums[0] + a[0] * b[0], sums[1] + a[1] * b[1]]);
    sums[0] + sums[1]
}

#[inline(always)]
fn add(direction: &[f64], out: &mut [f64]) {
    for (out, d) in out.iter_mut().zip(direction) {
        *out += d;
    }
}
