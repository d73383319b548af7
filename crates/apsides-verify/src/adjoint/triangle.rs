//! Least squares along a chain: unknowns of one interval after the other, and unknowns shared by all.

use nalgebra::DMatrix;

/// Equations over `[current, shared | constant]`, each of which is to be zero, and the triangular systems already made of them.
pub(super) struct Triangle {
    nx: usize,
    shared: usize,
    /// Rows over `[current, shared, constant]`.
    rows: Vec<Vec<f64>>,
    /// Triangular systems over `[current, inner, next, shared, constant]`, each with the number of its first two kinds; the last over
    /// `[current, shared, constant]`.
    done: Vec<(usize, DMatrix<f64>)>,
}

impl Triangle {
    pub(super) fn new(nx: usize, shared: usize) -> Self {
        Self { nx, shared, rows: Vec::new(), done: Vec::new() }
    }

    /// Adds an equation over `[current, shared, 1]`.
    pub(super) fn add_current(&mut self, row: &[f64], weight: f64) {
        self.rows.push(row.iter().map(|v| v * weight).collect());
    }

    /// Adds rows over `[shared, constant]`.
    pub(super) fn add_remainder(&mut self, rows: Vec<Vec<f64>>) {
        self.rows.extend(rows);
    }

    /// Pulls every shared unknown to zero.
    pub(super) fn add_prior(&mut self, weight: f64) {
        for i in 0..self.shared {
            let mut row = vec![0.0; self.shared + 1];
            row[i] = weight;
            self.rows.push(row);
        }
    }

    /// Goes over an interval with further unknowns inside, by equations over `[current, inner, next, shared, 1]`: `current` becomes the unknown at its
    /// end. None when an equation is not finite.
    pub(super) fn advance(&mut self, inner: usize, equations: impl Iterator<Item = Vec<f64>>) -> Option<()> {
        let (nx, ns) = (self.nx, self.shared);
        let width = 2 * nx + inner + ns + 1;
        let mut rows: Vec<Vec<f64>> = std::mem::take(&mut self.rows)
            .into_iter()
            .map(|r| {
                let zeros = vec![0.0; inner + nx];
                r[..nx].iter().copied().chain(zeros).chain(r[nx..].iter().copied()).collect()
            })
            .collect();
        rows.extend(equations);
        let mut triangle = triangulate(rows, width)?;
        let keep = triangle.len().min(nx + inner);
        self.rows = triangle.split_off(keep).into_iter().map(|r| r[nx + inner..].to_vec()).collect();
        self.done.push((nx + inner, matrix(&triangle, width)));
        Some(())
    }

    /// Ends the chain, and gives the rows over `[shared, constant]` that are left.
    pub(super) fn close(&mut self) -> Option<Vec<Vec<f64>>> {
        let width = self.nx + self.shared + 1;
        let mut triangle = triangulate(std::mem::take(&mut self.rows), width)?;
        let keep = triangle.len().min(self.nx);
        let left = triangle.split_off(keep).into_iter().map(|r| r[self.nx..].to_vec()).collect();
        self.done.push((self.nx, matrix(&triangle, width)));
        Some(left)
    }

    /// The shared unknowns.
    pub(super) fn solve(&mut self) -> Option<Vec<f64>> {
        let width = self.shared + 1;
        let triangle = triangulate(std::mem::take(&mut self.rows), width)?;
        let triangle = matrix(&triangle, width);
        Some(substitute(&triangle, self.shared, &[1.0]))
    }

    /// The unknowns `[current, inner]` of all intervals, from the first to the last, and those at the end.
    pub(super) fn back(&self, shared: &[f64]) -> Vec<Vec<f64>> {
        let shared: Vec<f64> = shared.iter().copied().chain([1.0]).collect();
        let mut all: Vec<Vec<f64>> = Vec::with_capacity(self.done.len());
        for (unknowns, triangle) in self.done.iter().rev() {
            let next = all.last().map_or(&[][..], |v| &v[..self.nx]);
            let known: Vec<f64> = next.iter().chain(&shared).copied().collect();
            all.push(substitute(triangle, *unknowns, &known));
        }
        all.reverse();
        all
    }
}

fn matrix(rows: &[Vec<f64>], width: usize) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), width, |i, j| rows[i][j])
}

/// The nonzero rows of the triangular factor.
fn triangulate(rows: Vec<Vec<f64>>, width: usize) -> Option<Vec<Vec<f64>>> {
    if rows.iter().flatten().any(|v| !v.is_finite()) {
        return None;
    }
    let r = matrix(&rows, width).qr().r();
    Some((0..r.nrows()).map(|i| r.row(i).iter().copied().collect()).collect())
}

/// Solves `R [x, known] = 0` for the first `n`; an unknown without a pivot is zero.
fn substitute(triangle: &DMatrix<f64>, n: usize, known: &[f64]) -> Vec<f64> {
    let mut x = vec![0.0; n];
    for i in (0..n.min(triangle.nrows())).rev() {
        let pivot = triangle[(i, i)];
        let mut rest: f64 = (i + 1..n).map(|j| triangle[(i, j)] * x[j]).sum();
        rest += known.iter().enumerate().map(|(j, v)| triangle[(i, n + j)] * v).sum::<f64>();
        x[i] = if pivot == 0.0 { 0.0 } else { -rest / pivot };
    }
    x
}
