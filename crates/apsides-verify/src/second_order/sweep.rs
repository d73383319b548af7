//! The second variation of one phase, brought by a backward sweep to its ends.
//!
//! The value over `w = [x, y, i, xi, p]` is a quadratic form: `x` state at a time, `y` multipliers of the state at the end,
//! `i` those of the integrals, `xi` times of the ends and corners, `p` static parameters. One step inserts
//! `x_next = step v` and eliminates the controls of an interval with the multipliers of its rows. By the additivity of inertia
//! (E. V. Haynsworth, Linear Algebra Appl. 1 (1968) 73, doi 10.1016/0024-3795(68)90050-5) the negative eigenvalues of all blocks
//! eliminated and of what remains are those of the whole form. This is the Riccati equation without its poles.

use nalgebra::{DMatrix, DVector};

use super::activity::Space;
use super::interval::Interval;

/// Pivot of a row's multiplier relative to a row of unit length, at the ends: lets dependent rows pass.
pub(super) const ROW_SHIFT: f64 = 1e-12;
/// Rows of unit length with a smaller part in the controls of an interval are left to earlier ones.
const RANK: f64 = 1e-8;
/// Eigenvalues below this part of the largest one are zero.
pub(super) const ZERO: f64 = 1e-14;

/// Sizes of `w` and of an interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sizes {
    pub(super) states: usize,
    pub(super) integrals: usize,
    /// Ends and corners.
    pub(super) times: usize,
    pub(super) parameters: usize,
}

impl Sizes {
    pub(super) fn value(&self) -> usize {
        self.times_at() + self.times + self.parameters
    }

    /// Place of the multipliers of the state at the end.
    pub(super) fn end_at(&self) -> usize {
        self.states
    }

    pub(super) fn integrals_at(&self) -> usize {
        2 * self.states
    }

    pub(super) fn times_at(&self) -> usize {
        2 * self.states + self.integrals
    }

    pub(super) fn parameters_at(&self) -> usize {
        self.times_at() + self.times
    }
}

/// The form at the start of a phase.
pub(super) struct Swept {
    pub(super) value: DMatrix<f64>,
    /// Constraints on `w` that no control could meet.
    pub(super) rows: Vec<DVector<f64>>,
    /// Negative eigenvalues met, beside those that the rows account for.
    pub(super) negative: isize,
    /// A block was singular.
    pub(super) singular: bool,
}

/// Sweeps back over `intervals`, each divided by `size`, less `shift` times the square norm of the controls.
pub(super) fn sweep(
    intervals: &[Interval],
    sizes: Sizes,
    size: f64,
    space: Space,
    shift: f64,
    contacts: &[(usize, DMatrix<f64>)],
) -> Swept {
    let nx = sizes.states;
    let nw = sizes.value();
    let mut value = DMatrix::zeros(nw, nw);
    for i in 0..nx {
        value[(i, sizes.end_at() + i)] = 1.0;
        value[(sizes.end_at() + i, i)] = 1.0;
    }
    let mut swept = Swept { value, rows: Vec::new(), negative: 0, singular: false };
    for (k, interval) in intervals.iter().enumerate().rev() {
        // Curvature of contacts at the end of the interval.
        for (_, h) in contacts.iter().filter(|(end, _)| *end == k + 1) {
            add_contact(&mut swept.value, h, sizes, interval, size);
        }
        step(&mut swept, interval, sizes, size, space, shift);
    }
    swept
}

/// Adds a Hessian over `[x, xi_a, xi_b, p]`.
fn add_contact(value: &mut DMatrix<f64>, h: &DMatrix<f64>, sizes: Sizes, interval: &Interval, size: f64) {
    let places = places(sizes, interval.span.arc);
    let at: Vec<usize> = (0..sizes.states).chain(places).collect();
    for i in 0..h.nrows() {
        for j in 0..h.ncols() {
            value[(at[i], at[j])] += h[(i, j)] / size;
        }
    }
}

/// Places in `w` of `[xi_a, xi_b, p]`.
fn places(sizes: Sizes, arc: usize) -> Vec<usize> {
    let times = sizes.times_at();
    [times + arc, times + arc + 1]
        .into_iter()
        .chain((0..sizes.parameters).map(|k| sizes.parameters_at() + k))
        .collect()
}

fn step(swept: &mut Swept, interval: &Interval, sizes: Sizes, size: f64, space: Space, shift: f64) {
    let (nx, nw) = (sizes.states, sizes.value());
    let nu = interval.controls.len();
    // Places of v = [x, U, xi_a, xi_b, p] in [w, U].
    let at: Vec<usize> =
        (0..nx).chain((0..nu).map(|j| nw + j)).chain(places(sizes, interval.span.arc)).collect();
    let total = nw + nu;
    let mut form = with_step(&swept.value, interval, &at, total);
    for (i, a) in at.iter().enumerate() {
        for (j, b) in at.iter().enumerate() {
            form[(*a, *b)] += interval.curvature[(i, j)] / size;
        }
        for q in 0..sizes.integrals {
            let integral = sizes.integrals_at() + q;
            form[(*a, integral)] += interval.integrals[(q, i)];
            form[(integral, *a)] += interval.integrals[(q, i)];
        }
    }
    for instant in interval.instants.iter().filter(|i| i.is_exact || space == Space::Sufficient) {
        for (a, g) in at.iter().zip(instant.gradient.iter()) {
            for (b, h) in at.iter().zip(instant.gradient.iter()) {
                form[(*a, *b)] += instant.coefficient / size * g * h;
            }
        }
    }
    let controls_of_stage = nu / interval.weights.len();
    for j in 0..nu {
        form[(nw + j, nw + j)] -= shift * interval.weights[j / controls_of_stage.max(1)];
    }
    let free: Vec<usize> = (0..nu).filter(|j| !interval.controls[*j].is_fixed_in(space)).collect();
    let pending = std::mem::take(&mut swept.rows);
    let spread = |mut full: DVector<f64>, gradient: &DVector<f64>| {
        for (place, g) in at.iter().zip(gradient.iter()) {
            full[*place] += g;
        }
        full
    };
    let of_next = |row: DVector<f64>| {
        let by_step = interval.step.tr_mul(&row.rows(0, nx));
        let mut full = row.resize_vertically(total, 0.0);
        full.rows_mut(0, nx).fill(0.0);
        spread(full, &by_step)
    };
    let mut rows: Vec<DVector<f64>> = pending.into_iter().map(of_next).collect();
    let held = interval.rows.iter().filter(|r| r.activity.is_fixed_in(space));
    rows.extend(held.map(|row| spread(DVector::zeros(total), &row.gradient)));
    let Split { here, earlier } = split(rows, nw, &free);
    swept.rows = earlier;
    if free.is_empty() {
        swept.value = form.view((0, 0), (nw, nw)).into_owned();
        return;
    }
    let (form, rest) = with_rows_met(&form, nw, &free, &here);
    let remaining = form.view((0, 0), (nw, nw)).into_owned();
    if rest == 0 {
        swept.value = remaining;
        return;
    }
    let eigen = form.view((nw, nw), (rest, rest)).into_owned().symmetric_eigen();
    let largest = eigen.eigenvalues.amax();
    let unscaled = eigen.eigenvectors.tr_mul(&form.view((nw, 0), (rest, nw)));
    let mut scaled = unscaled.clone();
    for (i, lambda) in eigen.eigenvalues.iter().enumerate() {
        if lambda.abs() <= ZERO * largest || !lambda.is_finite() {
            swept.singular = true;
            scaled.row_mut(i).fill(0.0);
            continue;
        }
        if *lambda < 0.0 {
            swept.negative += 1;
        }
        scaled.row_mut(i).scale_mut(1.0 / lambda);
    }
    let value = remaining - unscaled.tr_mul(&scaled);
    // Rounding would make it unsymmetric.
    swept.value = (&value + value.transpose()) * 0.5;
}

/// A form over `w` at the end of an interval as one over `[w, U]` with `x_next = step v`, `v` at these places of `[w, U]`.
fn with_step(value: &DMatrix<f64>, interval: &Interval, at: &[usize], total: usize) -> DMatrix<f64> {
    let (step, nw) = (&interval.step, value.nrows());
    let nx = step.nrows();
    let others = nw - nx;
    let mut form = DMatrix::zeros(total, total);
    form.view_mut((nx, nx), (others, others)).copy_from(&value.view((nx, nx), (others, others)));
    let of_states = step.tr_mul(&(value.view((0, 0), (nx, nx)) * step));
    let mixed = value.view((nx, 0), (others, nx)) * step;
    for (i, a) in at.iter().enumerate() {
        for (j, b) in at.iter().enumerate() {
            form[(*a, *b)] += of_states[(i, j)];
        }
        for k in 0..others {
            form[(nx + k, *a)] += mixed[(k, i)];
            form[(*a, nx + k)] += mixed[(k, i)];
        }
    }
    form
}

/// The form over `[w, b]` and the number of `b`: the controls `U = Z b - Y r` meet rows `Y' U + r = 0`, the columns of `Y` orthonormal
/// and those of `Z` their complement. The rows and as many controls have as many negative eigenvalues as rows between them, so that those of
/// the rest decide.
fn with_rows_met(
    form: &DMatrix<f64>,
    nw: usize,
    free: &[usize],
    rows: &[DVector<f64>],
) -> (DMatrix<f64>, usize) {
    let (nf, nr) = (free.len(), rows.len());
    if nr == 0 {
        let kept: Vec<usize> = (0..nw).chain(free.iter().map(|control| nw + control)).collect();
        return (form.select_rows(&kept).select_columns(&kept), nf);
    }
    let by_rows = DMatrix::from_fn(nf, nr, |i, r| rows[r][nw + free[i]]);
    let complement = (DMatrix::identity(nf, nf) - &by_rows * by_rows.transpose()).symmetric_eigen();
    let kept: Vec<usize> = (0..nf).filter(|k| complement.eigenvalues[*k] > 0.5).collect();
    let mut map = DMatrix::zeros(form.nrows(), nw + kept.len());
    map.view_mut((0, 0), (nw, nw)).fill_with_identity();
    let of_w = DMatrix::from_fn(nr, nw, |r, j| rows[r][j]);
    let met = -&by_rows * of_w;
    for (i, control) in free.iter().enumerate() {
        map.view_mut((nw + control, 0), (1, nw)).copy_from(&met.row(i));
        for (column, k) in kept.iter().enumerate() {
            map[(nw + control, nw + column)] = complement.eigenvectors[(i, *k)];
        }
    }
    (map.transpose() * form * map, kept.len())
}

/// Rows that the controls of an interval can meet, and those that are left to earlier ones.
struct Split {
    here: Vec<DVector<f64>>,
    earlier: Vec<DVector<f64>>,
}

/// Combines rows over `[w, U]` so that their parts in the free controls are orthonormal or zero.
fn split(rows: Vec<DVector<f64>>, nw: usize, free: &[usize]) -> Split {
    let rows: Vec<_> = rows.into_iter().filter(|r| r.norm() > 0.0).map(|r| r.normalize()).collect();
    let mut split = Split { here: Vec::new(), earlier: Vec::new() };
    let combine = |weights: &[f64]| {
        weights.iter().zip(&rows).fold(DVector::zeros(rows[0].len()), |sum, (w, row)| sum + row * *w)
    };
    if rows.is_empty() {
        return split;
    }
    let n = rows.len();
    // A square matrix, so that all left singular vectors are there.
    let width = free.len().max(n);
    let part = DMatrix::from_fn(n, width, |i, j| free.get(j).map_or(0.0, |f| rows[i][nw + f]));
    let svd = part.svd(true, false);
    let Some(left) = svd.u else { return split };
    for (k, sigma) in svd.singular_values.iter().enumerate() {
        let weights: Vec<f64> = left.column(k).iter().copied().collect();
        let row = combine(&weights);
        if *sigma > RANK {
            split.here.push(row / *sigma);
        } else {
            let earlier = row.rows(0, nw).into_owned();
            if earlier.norm() > RANK {
                split.earlier.push(earlier);
            }
        }
    }
    split
}
