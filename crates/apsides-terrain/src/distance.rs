//! Exact Euclidean distances to the nearest marked pixel.
//!
//! Columns first, then the lower envelope of parabolas along each row (Meijster, Roerdink, Hesselink, "A General Algorithm for Computing
//! Distance Transforms in Linear Time", 2000), in integers. Maps are cut into bands of rows; what a band needs of the others is the
//! distance from its edges to the nearest mark in each column.

use rayon::prelude::*;

use crate::{Geometry, Raster, TerrainError};

/// Rows of a band.
pub(crate) const BAND: usize = 128;

/// Distance to the centre of the nearest marked pixel, m; infinite without marks.
///
/// # Errors
/// Pixels that are not square, in metres.
///
/// # Examples
/// ```
/// use apsides_terrain::{Geometry, Raster, distance_to_nearest};
///
/// // One mark in the middle of pixels of 2 m.
/// let geometry = Geometry::square(9, 9, 2.0)?;
/// let mut marked = Raster::filled(geometry, false);
/// marked.data_mut()[geometry.index(4, 4)] = true;
/// let distance = distance_to_nearest(&marked)?;
/// assert_eq!((distance.get(4, 4), distance.get(0, 1)), (0.0, 10.0));
/// # Ok::<(), apsides_terrain::TerrainError>(())
/// ```
pub fn distance_to_nearest(marked: &Raster<bool>) -> Result<Raster<f32>, TerrainError> {
    to_nearest(marked.geometry(), marked.geometry().square_pixel()?, |k| marked.data()[k])
}

/// The same for marks by their index.
pub(crate) fn to_nearest(
    geometry: &Geometry,
    pixel_m: f64,
    marked: impl Fn(usize) -> bool + Sync,
) -> Result<Raster<f32>, TerrainError> {
    let cols = geometry.cols();
    let mut out = vec![0.0_f32; geometry.pixels()];
    let flags = |band: usize, length: usize, flags: &mut Vec<u8>| {
        let first = band * BAND * cols;
        flags.clear();
        flags.extend((first..first + length).map(|k| u8::from(marked(k))));
    };
    let edges: Vec<BandEdges> = out
        .par_chunks(BAND * cols)
        .enumerate()
        .map_init(Vec::new, |space, (band, part)| {
            flags(band, part.len(), space);
            BandEdges::of(space, cols)
        })
        .collect();
    let outside = Outside::of_all(&edges);
    out.par_chunks_mut(BAND * cols).enumerate().for_each_init(
        || (Vec::new(), Envelope::default()),
        |(space, envelope), (band, part)| {
            flags(band, part.len(), space);
            envelope.distances(space, &outside[band], pixel_m, part);
        },
    );
    Raster::new(*geometry, out)
}

/// No mark in a column. Sums of two of these fit.
const FAR: u32 = 1 << 30;

/// For each column of a band: rows from its first one down to the first mark, and from its last one up to the last mark.
#[derive(Debug)]
pub(crate) struct BandEdges {
    rows: u32,
    first: Vec<u32>,
    last: Vec<u32>,
}

impl BandEdges {
    /// The edges of rows of marks, which are not 0.
    pub(crate) fn of(flags: &[u8], cols: usize) -> BandEdges {
        let (mut first, mut last) = (vec![FAR; cols], vec![FAR; cols]);
        for (row, flags) in (0_u32..).zip(flags.chunks_exact(cols)) {
            for ((first, last), &flag) in first.iter_mut().zip(&mut last).zip(flags) {
                let near = if flag == 0 { FAR } else { row };
                *first = near.min(*first);
                *last = if flag == 0 { (*last + 1).min(FAR) } else { 0 };
            }
        }
        BandEdges { rows: (flags.len() / cols) as u32, first, last }
    }
}

/// For each column: rows from the first row of a band to the nearest mark above it, and from its last row to the nearest below.
#[derive(Debug)]
pub(crate) struct Outside {
    above: Vec<u32>,
    below: Vec<u32>,
}

impl Outside {
    /// The marks outside of each band, for all bands from north to south.
    pub(crate) fn of_all(edges: &[BandEdges]) -> Vec<Outside> {
        let cols = edges.first().map_or(0, |e| e.first.len());
        let next = |near: &[u32], from: &[u32], rows: u32| -> Vec<u32> {
            near.iter().zip(from).map(|(&near, &from)| (near + 1).min(from + rows).min(FAR)).collect()
        };
        let mut all = Vec::with_capacity(edges.len());
        let mut above = vec![FAR; cols];
        for edge in edges {
            let below_next = next(&edge.last, &above, edge.rows);
            all.push(Outside { above, below: Vec::new() });
            above = below_next;
        }
        let mut below = vec![FAR; cols];
        for (outside, edge) in all.iter_mut().zip(edges).rev() {
            let above_next = next(&edge.first, &below, edge.rows);
            outside.below = below;
            below = above_next;
        }
        all
    }
}

/// Memory for the distances of a band.
#[derive(Debug, Default)]
pub(crate) struct Envelope {
    /// Rows to the nearest mark in the column.
    rows: Vec<u32>,
    /// Squares of distances along a row.
    squares: Vec<f64>,
    /// Columns of the parabolas of the envelope, with the first column where each is the lowest.
    stack: Vec<(i64, i64)>,
}

impl Envelope {
    /// Distances of a band of marks, m.
    pub(crate) fn distances(&mut self, flags: &[u8], outside: &Outside, pixel_m: f64, out: &mut [f32]) {
        let cols = outside.above.len();
        self.rows.resize(flags.len(), 0);
        let mut above: &[u32] = &outside.above;
        let mut step = 0;
        for (row, flags) in self.rows.chunks_exact_mut(cols).zip(flags.chunks_exact(cols)) {
            for ((near, &above), &flag) in row.iter_mut().zip(above).zip(flags) {
                *near = if flag == 0 { (above + step).min(FAR) } else { 0 };
            }
            (above, step) = (row, 1);
        }
        let mut below: &[u32] = &outside.below;
        step = 0;
        for row in self.rows.chunks_exact_mut(cols).rev() {
            for (near, &below) in row.iter_mut().zip(below) {
                *near = (*near).min(below + step);
            }
            (below, step) = (row, 1);
        }
        self.squares.resize(cols, 0.0);
        for (row, out) in self.rows.chunks_exact(cols).zip(out.chunks_exact_mut(cols)) {
            let mut first = 0;
            // A mark in the row hides what is behind it: the pixels between two marks see nothing else.
            while first < cols {
                let end = row[first + 1..].iter().position(|&near| near == 0).map_or(cols, |k| first + 1 + k);
                between(&row[first..(end + 1).min(cols)], &mut self.stack, &mut self.squares[first..end]);
                first = end;
            }
            for (out, square) in out.iter_mut().zip(&self.squares) {
                *out = (square.sqrt() * pixel_m) as f32;
            }
        }
    }
}

/// Squares of the distances of the first pixels of a row, of which only the first and the last may be marks.
fn between(rows: &[u32], stack: &mut Vec<(i64, i64)>, squares: &mut [f64]) {
    if squares.len() == 1 && rows[0] == 0 {
        squares[0] = 0.0;
        return;
    }
    stack.clear();
    let end = squares.len() as i64;
    let height = |col: i64| {
        let near = i64::from(rows[col as usize]);
        near * near
    };
    for (col, _) in (0_i64..).zip(rows).filter(|(_, near)| **near < FAR) {
        let mut from = 0;
        while let Some(&(other, since)) = stack.last() {
            let square = |of: i64| (since - of) * (since - of) + height(of);
            if square(other) > square(col) {
                stack.pop();
                continue;
            }
            let sum = col * col - other * other + height(col) - height(other);
            from = sum.div_euclid(2 * (col - other)) + 1;
            break;
        }
        if from < end {
            stack.push((col, from));
        }
    }
    let mut last = end;
    if stack.is_empty() {
        squares.fill(f64::INFINITY);
    }
    for &(col, since) in stack.iter().rev() {
        let high = height(col);
        for k in since..last {
            squares[k as usize] = ((k - col) * (k - col) + high) as f64;
        }
        last = since.min(last);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn direct(marked: &[bool], rows: usize, cols: usize) -> Vec<f32> {
        let at = |k: usize| ((k / cols) as f64, (k % cols) as f64);
        (0..rows * cols)
            .map(|k| {
                let marks = (0..rows * cols).filter(|&m| marked[m]);
                let squares = marks.map(|m| (at(k).0 - at(m).0).powi(2) + (at(k).1 - at(m).1).powi(2));
                (squares.fold(f64::INFINITY, f64::min).sqrt() * 0.5) as f32
            })
            .collect()
    }

    proptest! {
        #[test]
        fn distances_are_those_to_the_nearest_mark(
            rows in 1_usize..30,
            cols in 1_usize..30,
            density in 0.0..0.3_f64,
            seed in any::<u64>(),
        ) {
            let mut state = seed;
            let marked: Vec<bool> = (0..rows * cols)
                .map(|_| {
                    state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                    ((state >> 33) as f64) < density * f64::from(1_u32 << 31)
                })
                .collect();
            let geometry = Geometry::square(rows, cols, 0.5).unwrap();
            let found = distance_to_nearest(&Raster::new(geometry, marked.clone()).unwrap()).unwrap();
            prop_assert_eq!(found.data(), direct(&marked, rows, cols));
        }
    }

    #[test]
    fn bands_are_joined() {
        let (rows, cols) = (3 * BAND + 5, 7);
        for marks in [vec![3], vec![(rows - 1) * cols], vec![2 * BAND * cols + 1, 6], vec![]] {
            let marked: Vec<bool> = (0..rows * cols).map(|k| marks.contains(&k)).collect();
            let geometry = Geometry::square(rows, cols, 0.5).unwrap();
            let found = distance_to_nearest(&Raster::new(geometry, marked.clone()).unwrap()).unwrap();
            assert_eq!(found.data(), direct(&marked, rows, cols));
        }
    }
}
