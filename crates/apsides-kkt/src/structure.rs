//! Where the values of the permuted matrix stand: those of bundles lane by lane, then the others by columns.

use pulp::{Arch, Simd, WithSimd};

use crate::KktError;
use crate::bundle::Bundles;
use crate::lane_entries::{Columns, LaneEntries, Outside};
use crate::pattern::Pattern;
use crate::twins::{LANES, MOST_ROWS};

/// Structure of a symmetric `n` x `n` matrix with the rows of bundles first.
pub(crate) struct Structure {
    pub(crate) n: usize,
    /// Entries between rows of the same lane, then those with rows outside, each as a vector of all lanes.
    inner: Columns,
    outer: Columns,
    bundles: Vec<Outside>,
    /// Places of rows outside, by lane.
    outer_rows: Vec<[u32; LANES]>,
    arch: Arch,
    /// Upper triangle of the rows that are in no bundle, counted from the first of them.
    pub(crate) rest: Pattern,
    /// Position of the first value of `rest`.
    pub(crate) rest_at: usize,
    /// Position of the value of each triplet, and of each diagonal entry.
    pub(crate) triplet_position: Vec<u32>,
    pub(crate) diagonal: Vec<u32>,
}

impl Structure {
    /// Structure of the triplets with row `i` moved to `position[i]`. Duplicates share one position; the diagonal is
    /// always present. The caller has checked that every index is below `n` and that `rows` and `cols` have equal length.
    pub(crate) fn new(
        n: usize,
        rows: &[usize],
        cols: &[usize],
        position: &[u32],
        bundles: &mut Bundles,
    ) -> Result<Self, KktError> {
        // Every lane of a bundle has a place for each entry that one of them has: no more than there are in the blocks.
        if rows.len() + n + bundles.nonzeros() > i32::MAX as usize {
            return Err(KktError::TooLarge { n });
        }
        let begin = bundles.rows();
        let mut triplet_position = vec![0; rows.len()];
        let (mut rest_rows, mut rest_cols, mut rest_triplets) = (Vec::new(), Vec::new(), Vec::new());
        let mut places = bundles.places();
        for (t, (&row, &col)) in rows.iter().zip(cols).enumerate() {
            let (a, b) = (position[row], position[col]);
            let (first, second) = (a.min(b) as usize, a.max(b) as usize);
            if first < begin {
                // Its value and its lane, until values have positions.
                triplet_position[t] = places.touch(first, second) * LANES as u32 + (first % LANES) as u32;
            } else {
                rest_rows.push(first - begin);
                rest_cols.push(second - begin);
                rest_triplets.push(t);
            }
        }
        let mut diagonal: Vec<u32> = (0..begin).map(|row| places.touch(row, row)).collect();
        let LaneEntries { inner, outer, bundles, outer_rows, position: lane_position } = places.finish();
        let rest_at = (inner.row.len() + outer.row.len()) * LANES;
        for (row, diagonal) in diagonal.iter_mut().enumerate() {
            *diagonal = lane_position[*diagonal as usize] + (row % LANES) as u32;
        }
        let identity: Vec<u32> = (0..(n - begin) as u32).collect();
        let rest = Pattern::new(n - begin, &rest_rows, &rest_cols, &identity)?;
        if rest_triplets.len() < rows.len() {
            for triplet in &mut triplet_position {
                let (value, lane) = (*triplet as usize / LANES, *triplet % LANES as u32);
                *triplet = lane_position[value] + lane;
            }
        }
        for (t, p) in rest_triplets.into_iter().zip(&rest.triplet_position) {
            triplet_position[t] = rest_at as u32 + p;
        }
        diagonal.extend((0..rest.n).map(|row| (rest_at + rest.diagonal(row)) as u32));
        Ok(Self {
            n,
            inner,
            outer,
            bundles,
            outer_rows,
            arch: Arch::new(),
            rest,
            rest_at,
            triplet_position,
            diagonal,
        })
    }

    /// Values that are stored.
    pub(crate) fn values(&self) -> usize {
        self.rest_at + self.rest.nonzeros()
    }

    /// Rows that are in bundles.
    fn begin(&self) -> usize {
        self.n - self.rest.n
    }

    /// Row and column of every value, the row of the upper triangle first.
    pub(crate) fn entries(&self) -> (Vec<usize>, Vec<usize>) {
        let (mut rows, mut cols) = (Vec::with_capacity(self.values()), Vec::with_capacity(self.values()));
        for (column, entry) in self.inner.entries() {
            let row = self.inner.row[entry] as usize;
            rows.extend((0..LANES).map(|lane| column * LANES + lane));
            cols.extend((0..LANES).map(|lane| row + lane));
        }
        for Outside { columns, rows: outside } in &self.bundles {
            for column in columns.clone() {
                for entry in self.outer.column(column) {
                    rows.extend((0..LANES).map(|lane| column * LANES + lane));
                    let row = outside.start + self.outer.row[entry] as usize;
                    cols.extend(self.outer_rows[row].map(|row| row as usize));
                }
            }
        }
        let begin = self.begin();
        for column in 0..self.rest.n {
            for p in self.rest.column(column) {
                rows.push(begin + self.rest.row_idx[p] as usize);
                cols.push(begin + column);
            }
        }
        (rows, cols)
    }

    /// `out -= A x` for the symmetric matrix with these values, for each of `R` vectors.
    pub(crate) fn subtract_product<const R: usize>(
        &self,
        values: &[f64],
        x: [&[f64]; R],
        mut out: [&mut [f64]; R],
    ) {
        self.arch.dispatch(SubtractLanes { structure: self, values, x, out: &mut out });
        let begin = self.begin();
        for (x, out) in x.into_iter().zip(out) {
            self.rest.subtract_product(&values[self.rest_at..], &x[begin..], &mut out[begin..]);
        }
    }

    #[inline(always)]
    fn subtract_lanes<const R: usize>(&self, values: &[f64], x: [&[f64]; R], out: &mut [&mut [f64]; R]) {
        let (lanes, _) = values.as_chunks::<LANES>();
        let (inner, outer) = lanes.split_at(self.inner.row.len());
        let mut x_outside = [[[0.0; LANES]; R]; MOST_ROWS];
        let mut sums = [[[0.0; LANES]; R]; MOST_ROWS];
        for Outside { columns, rows } in &self.bundles {
            let outside = &self.outer_rows[rows.clone()];
            for ((x_outside, sums), places) in x_outside.iter_mut().zip(&mut sums).zip(outside) {
                for k in 0..R {
                    for lane in 0..LANES {
                        x_outside[k][lane] = x[k][places[lane] as usize];
                    }
                }
                *sums = [[0.0; LANES]; R];
            }
            for column in columns.clone() {
                let at = column * LANES;
                let mut xj = [[0.0; LANES]; R];
                for k in 0..R {
                    xj[k] = lanes_of(x[k], at);
                }
                let mut sum = [[0.0; LANES]; R];
                for entry in self.inner.column(column) {
                    let (row, a) = (self.inner.row[entry] as usize, inner[entry]);
                    for k in 0..R {
                        let xi = lanes_of(x[k], row);
                        for lane in 0..LANES {
                            sum[k][lane] += a[lane] * xi[lane];
                        }
                        if row != at {
                            let out = &mut out[k][row..row + LANES];
                            for lane in 0..LANES {
                                out[lane] -= a[lane] * xj[k][lane];
                            }
                        }
                    }
                }
                for entry in self.outer.column(column) {
                    let (row, a) = (self.outer.row[entry] as usize, outer[entry]);
                    let (xi, row_sums) = (&x_outside[row], &mut sums[row]);
                    for k in 0..R {
                        for lane in 0..LANES {
                            sum[k][lane] += a[lane] * xi[k][lane];
                            row_sums[k][lane] += a[lane] * xj[k][lane];
                        }
                    }
                }
                for k in 0..R {
                    let out = &mut out[k][at..at + LANES];
                    for lane in 0..LANES {
                        out[lane] -= sum[k][lane];
                    }
                }
            }
            for (places, sums) in outside.iter().zip(&sums) {
                for (out, sum) in out.iter_mut().zip(sums) {
                    for (&row, sum) in places.iter().zip(sum) {
                        out[row as usize] -= sum;
                    }
                }
            }
        }
    }

    /// Writes `S A S`.
    pub(crate) fn scale(&self, values: &[f64], scaled: &mut [f64], scale: &[f64]) {
        self.scale_or_measure::<true, true>(values, scaled, scale, &mut []);
    }

    /// The largest magnitude in each row of `S A S`, which is not stored.
    pub(crate) fn measure_scaled(&self, values: &[f64], scale: &[f64], largest: &mut [f64]) {
        self.scale_or_measure::<false, true>(values, &mut [], scale, largest);
    }

    /// The largest magnitude in each row of `A`.
    pub(crate) fn measure(&self, values: &[f64], largest: &mut [f64]) {
        self.scale_or_measure::<false, false>(values, &mut [], &[], largest);
    }

    /// Writes the one of `scaled` and `largest` that is asked for; the other is empty, and so is `scale` where the matrix is taken as it is.
    fn scale_or_measure<const STORES: bool, const SCALES: bool>(
        &self,
        values: &[f64],
        scaled: &mut [f64],
        scale: &[f64],
        largest: &mut [f64],
    ) {
        largest.fill(0.0);
        let (scaled_lanes, sizes) = (&mut *scaled, &mut *largest);
        self.arch.dispatch(ScaleLanes::<STORES, SCALES> {
            structure: self,
            values,
            scaled: scaled_lanes,
            scale,
            largest: sizes,
        });
        let begin = self.begin();
        let (scale, values) = (scale.get(begin..).unwrap_or_default(), &values[self.rest_at..]);
        let (scaled, largest) =
            if STORES { (&mut scaled[self.rest_at..], largest) } else { (scaled, &mut largest[begin..]) };
        for j in 0..self.rest.n {
            let mut column_largest = 0.0;
            for p in self.rest.column(j) {
                let i = self.rest.row_idx[p] as usize;
                let value = if SCALES { values[p] * (scale[i] * scale[j]) } else { values[p] };
                if STORES {
                    scaled[p] = value;
                } else {
                    largest[i] = larger(value.abs(), largest[i]);
                    column_largest = larger(value.abs(), column_largest);
                }
            }
            if !STORES {
                largest[j] = larger(column_largest, largest[j]);
            }
        }
    }

    #[inline(always)]
    fn scale_lanes<const STORES: bool, const SCALES: bool>(
        &self,
        values: &[f64],
        scaled: &mut [f64],
        scale: &[f64],
        largest: &mut [f64],
    ) {
        let (lanes, _) = values.as_chunks::<LANES>();
        let outer_at = self.inner.row.len();
        let (inner, outer) = lanes.split_at(outer_at);
        let (scaled, _) = scaled.as_chunks_mut::<LANES>();
        let (mut scale_outside, mut sizes) = ([[0.0; LANES]; MOST_ROWS], [[0.0; LANES]; MOST_ROWS]);
        for Outside { columns, rows } in &self.bundles {
            let outside = &self.outer_rows[rows.clone()];
            for ((scale_outside, size), places) in scale_outside.iter_mut().zip(&mut sizes).zip(outside) {
                if SCALES {
                    for lane in 0..LANES {
                        scale_outside[lane] = scale[places[lane] as usize];
                    }
                }
                *size = [0.0; LANES];
            }
            for column in columns.clone() {
                let at = column * LANES;
                let sj = if SCALES { lanes_of(scale, at) } else { [1.0; LANES] };
                let mut column_size = [0.0; LANES];
                for entry in self.inner.column(column) {
                    let (row, a) = (self.inner.row[entry] as usize, inner[entry]);
                    let value = if SCALES { product(a, lanes_of(scale, row), sj) } else { a };
                    if STORES {
                        scaled[entry] = value;
                        continue;
                    }
                    raise(&mut column_size, value);
                    let mut size = lanes_of(largest, row);
                    raise(&mut size, value);
                    if let Some(largest) = largest[row..].first_chunk_mut() {
                        *largest = size;
                    }
                }
                for entry in self.outer.column(column) {
                    let (k, a) = (self.outer.row[entry] as usize, outer[entry]);
                    let value = if SCALES { product(a, scale_outside[k], sj) } else { a };
                    if STORES {
                        scaled[outer_at + entry] = value;
                        continue;
                    }
                    raise(&mut column_size, value);
                    raise(&mut sizes[k], value);
                }
                if STORES {
                    continue;
                }
                let largest = &mut largest[at..at + LANES];
                for lane in 0..LANES {
                    largest[lane] = larger(column_size[lane], largest[lane]);
                }
            }
            if STORES {
                continue;
            }
            for (places, size) in outside.iter().zip(sizes) {
                for (&row, size) in places.iter().zip(size) {
                    largest[row as usize] = larger(size, largest[row as usize]);
                }
            }
        }
    }
}

/// Compiled for the vectors of the machine; lanes are treated alike by all of them.
struct SubtractLanes<'a, 'b, const R: usize> {
    structure: &'a Structure,
    values: &'a [f64],
    x: [&'a [f64]; R],
    out: &'a mut [&'b mut [f64]; R],
}

impl<const R: usize> WithSimd for SubtractLanes<'_, '_, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.structure.subtract_lanes(self.values, self.x, self.out);
    }
}

/// The same for [`Structure::scale_or_measure`].
struct ScaleLanes<'a, const STORES: bool, const SCALES: bool> {
    structure: &'a Structure,
    values: &'a [f64],
    scaled: &'a mut [f64],
    scale: &'a [f64],
    largest: &'a mut [f64],
}

impl<const STORES: bool, const SCALES: bool> WithSimd for ScaleLanes<'_, STORES, SCALES> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.structure.scale_lanes::<STORES, SCALES>(self.values, self.scaled, self.scale, self.largest);
    }
}

/// The lanes that begin at a place.
#[inline(always)]
fn lanes_of(values: &[f64], at: usize) -> [f64; LANES] {
    // As an array: copies of slices are calls where a crate is built without link-time optimisation.
    values[at..at + LANES].first_chunk().copied().unwrap_or_default()
}

/// Entries with the scales of their rows and of their columns.
#[inline(always)]
fn product(a: [f64; LANES], si: [f64; LANES], sj: [f64; LANES]) -> [f64; LANES] {
    let mut product = [0.0; LANES];
    for lane in 0..LANES {
        product[lane] = a[lane] * (si[lane] * sj[lane]);
    }
    product
}

/// Raises sizes to the magnitudes of some values.
#[inline(always)]
fn raise(sizes: &mut [f64; LANES], values: [f64; LANES]) {
    for lane in 0..LANES {
        sizes[lane] = larger(values[lane].abs(), sizes[lane]);
    }
}

/// The larger of two numbers that are not NaN: one instruction, where `f64::max` takes several.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}
