//! Height and slope between the centres of pixels as smooth functions of scalars, and the height above them as a path constraint.

use apsides_ad::{PathFunction, Scalar};

use crate::{ElevationMap, Geometry, MapUnit, TerrainError};

/// The number of continuous derivatives of the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Smoothness {
    /// One: cubic convolution with slopes by central differences (Catmull-Rom; R. G. Keys, IEEE Trans. ASSP 29 (1981) 1153,
    /// doi 10.1109/TASSP.1981.1163711, a = -1/2). Each value depends on 4 x 4 pixels.
    C1,
    /// Two: the bicubic spline through all heights, with natural ends (C. de Boor, A Practical Guide to Splines, 2001). A height
    /// acts on its surroundings with a weight that falls by 0.27 per pixel.
    C2,
}

/// A surface through the heights at the centres of the pixels.
///
/// Both kinds pass through every height and reproduce planes. Beyond the outermost centres the surface goes on straight, with the
/// value and the slope that it has on the edge; [`Surface::contains`] tells where that is. Where one of the 4 x 4 pixels around a
/// point is a gap there is no value: the functions generic in [`Scalar`], which cannot branch, return NaN there, and
/// [`Surface::height_at`] and [`Surface::gradient_at`] return none.
#[derive(Clone, Debug)]
pub struct Surface {
    geometry: Geometry,
    datum: f64,
    smoothness: Smoothness,
    /// Heights (C1) or coefficients of B-splines (C2) above the datum, m; NaN is a gap.
    nodes: Vec<f64>,
}

/// Weights of four pixels along one axis in the value and its first three derivatives.
struct Taps {
    at: [usize; 4],
    weights: [[f64; 4]; 4],
}

impl Surface {
    /// The surface of a map whose pixels are in metres.
    ///
    /// # Errors
    /// Pixels in degrees, or a map of gaps alone.
    pub fn new(map: &ElevationMap, smoothness: Smoothness) -> Result<Surface, TerrainError> {
        let geometry = *map.geometry();
        if geometry.unit() != MapUnit::Metre {
            let [east, south] = geometry.pixel();
            return Err(TerrainError::Pixel { east, south, unit: geometry.unit() });
        }
        if map.gaps() == geometry.pixels() {
            return Err(TerrainError::Empty { pixels: geometry.pixels() });
        }
        let mut nodes: Vec<f64> = map.relative().data().iter().map(|&z| f64::from(z)).collect();
        if smoothness == Smoothness::C2 {
            spline_coefficients(&geometry, &mut nodes);
            for (node, z) in nodes.iter_mut().zip(map.relative().data()) {
                if z.is_nan() {
                    *node = f64::NAN;
                }
            }
        }
        Ok(Surface { geometry, datum: map.datum(), smoothness, nodes })
    }

    /// The places of the pixels.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Tells whether a point (east, north; m) lies between the outermost centres of pixels.
    pub fn contains(&self, position: [f64; 2]) -> bool {
        let [row, col] = self.geometry.row_col(position);
        (0.0..=(self.geometry.rows() - 1) as f64).contains(&row)
            && (0.0..=(self.geometry.cols() - 1) as f64).contains(&col)
    }

    /// Height, m, at a point (east, north; m); none beside a gap and outside the map.
    pub fn height_at(&self, [east, north]: [f64; 2]) -> Option<f64> {
        Some(self.height(east, north)).filter(|z| z.is_finite() && self.contains([east, north]))
    }

    /// Gradient of the height (to the east, to the north; m/m) at a point (east, north; m); none beside a gap and outside the map.
    ///
    /// # Examples
    /// ```
    /// use apsides_terrain::interpolation::{Smoothness, Surface};
    /// use apsides_terrain::{ElevationMap, Geometry};
    ///
    /// // Ground that rises by an eighth to the east.
    /// let geometry = Geometry::square(9, 9, 8.0)?;
    /// let heights: Vec<f64> = (0..81).map(|k| f64::from(k % 9)).collect();
    /// let surface = Surface::new(&ElevationMap::from_heights(geometry, &heights)?, Smoothness::C2)?;
    /// assert!(surface.gradient_at([20.0, -20.0]).is_some_and(|[e, n]| (e - 0.125).abs() < 1e-12 && n.abs() < 1e-12));
    /// assert_eq!(surface.gradient_at([-1.0, -20.0]), None, "outside of the map");
    /// # Ok::<(), apsides_terrain::TerrainError>(())
    /// ```
    pub fn gradient_at(&self, [east, north]: [f64; 2]) -> Option<[f64; 2]> {
        Some(self.gradient(east, north))
            .filter(|g| g.iter().all(|g| g.is_finite()) && self.contains([east, north]))
    }

    /// Height, m, at a point (east, north; m); NaN beside a gap.
    #[inline]
    pub fn height<S: Scalar>(&self, east: S, north: S) -> S {
        east.map2(north, |east, north| {
            let value = self.at(east, north);
            [value(0, 0) + self.datum, value(1, 0), value(0, 1), value(2, 0), value(1, 1), value(0, 2)]
        })
    }

    /// Gradient of the height (to the east, to the north; m/m) at a point (east, north; m); NaN beside a gap.
    #[inline]
    pub fn gradient<S: Scalar>(&self, east: S, north: S) -> [S; 2] {
        [[1, 0], [0, 1]].map(|[x, y]| {
            east.map2(north, |east, north| {
                let value = self.at(east, north);
                [[0, 0], [1, 0], [0, 1], [2, 0], [1, 1], [0, 2]].map(|[p, q]| value(p + x, q + y))
            })
        })
    }

    /// Squared tangent of the angle between the surface and the horizontal; smooth also on level ground.
    #[inline]
    pub fn slope_squared<S: Scalar>(&self, east: S, north: S) -> S {
        let [x, y] = self.gradient(east, north);
        x * x + y * y
    }

    /// Angle between the surface and the horizontal, rad. Its derivatives are infinite on level ground; a bound on the slope is
    /// better put on [`Surface::slope_squared`].
    #[inline]
    pub fn slope<S: Scalar>(&self, east: S, north: S) -> S {
        self.slope_squared(east, north).sqrt().atan()
    }

    /// The derivative of a given order to the east and to the north; three orders in all.
    fn at(&self, east: f64, north: f64) -> impl Fn(usize, usize) -> f64 + '_ {
        let [row, col] = self.geometry.row_col([east, north]);
        let [width, height] = self.geometry.pixel();
        let cols = self.geometry.cols();
        let rows = Taps::new(row, self.geometry.rows(), self.smoothness);
        let columns = Taps::new(col, cols, self.smoothness);
        let mut around = [[0.0; 4]; 4];
        for (values, row) in around.iter_mut().zip(rows.at) {
            *values = columns.at.map(|col| self.nodes[row * cols + col]);
        }
        // Rows count to the south.
        let (per_east, per_north) = (width.recip(), -height.recip());
        move |p, q| {
            let mut sum = 0.0;
            for i in 0..4 {
                for j in 0..4 {
                    sum += rows.weights[q][i] * columns.weights[p][j] * around[i][j];
                }
            }
            sum * per_east.powi(p as i32) * per_north.powi(q as i32)
        }
    }
}

/// The height of a vehicle above a surface, m: a path constraint of an optimal control problem.
///
/// Beside a gap the height is NaN, and beyond the map it counts from the straight continuation of the surface; bounds on the position
/// keep a flight on the map.
#[derive(Clone, Debug)]
pub struct HeightAbove<P> {
    surface: Surface,
    position: P,
}

impl<P> HeightAbove<P> {
    /// The height above a surface of a vehicle at a position to the east, to the north and upwards (m, in the coordinates of the map), a
    /// function of time, states, controls and parameters: [`PositionStates`] where states are these coordinates.
    pub fn new(surface: Surface, position: P) -> Self {
        Self { surface, position }
    }
}

impl<P, const NX: usize, const NU: usize, const NP: usize> PathFunction<NX, NU, 1, NP> for HeightAbove<P>
where
    P: PathFunction<NX, NU, 3, NP>,
{
    #[inline]
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; NX], u: &[S; NU], p: &[S; NP]) -> [S; 1] {
        let [east, north, up] = self.position.evaluate(t, x, u, p);
        [up - self.surface.height(east, north)]
    }
}

/// The position whose coordinates to the east, to the north and upwards are the states of these indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PositionStates(pub [usize; 3]);

impl<const NX: usize, const NU: usize, const NP: usize> PathFunction<NX, NU, 3, NP> for PositionStates {
    #[inline]
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; NX], _u: &[S; NU], _p: &[S; NP]) -> [S; 3] {
        self.0.map(|k| x[k])
    }
}

impl Taps {
    /// For `x` pixels from the first of `count` centres.
    fn new(x: f64, count: usize, smoothness: Smoothness) -> Taps {
        let last = count - 1;
        let inside = x.clamp(0.0, last as f64);
        let first = (inside as usize).min(last.saturating_sub(1));
        let mut weights = match smoothness {
            Smoothness::C1 => keys(inside - first as f64),
            Smoothness::C2 => b_spline(inside - first as f64),
        };
        // The node beyond an end continues the last two in a straight line.
        let has = |k: usize| first + k >= 1 && first + k <= last + 1;
        for w in &mut weights {
            if !has(2) {
                // One pixel: constant.
                *w = [0.0, w.iter().sum(), 0.0, 0.0];
                continue;
            }
            if !has(0) {
                *w = [0.0, w[1] + 2.0 * w[0], w[2] - w[0], w[3]];
            }
            if !has(3) {
                *w = [w[0], w[1] - w[3], w[2] + 2.0 * w[3], 0.0];
            }
        }
        if inside != x {
            // Straight on, outside the outermost centres.
            let [value, slope, ..] = weights;
            let beyond = x - inside;
            weights = [std::array::from_fn(|k| value[k] + beyond * slope[k]), slope, [0.0; 4], [0.0; 4]];
        }
        // A node that does not exist has no weight; any existing one may stand for it.
        let at = std::array::from_fn(|k| if has(k) { first + k - 1 } else { first });
        Taps { at, weights }
    }
}

/// Cubic convolution with a = -1/2 at `t` of the interval between the second and the third node.
fn keys(t: f64) -> [[f64; 4]; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        [
            -0.5 * t3 + t2 - 0.5 * t,
            1.5 * t3 - 2.5 * t2 + 1.0,
            -1.5 * t3 + 2.0 * t2 + 0.5 * t,
            0.5 * (t3 - t2),
        ],
        [-1.5 * t2 + 2.0 * t - 0.5, 4.5 * t2 - 5.0 * t, -4.5 * t2 + 4.0 * t + 0.5, 1.5 * t2 - t],
        [-3.0 * t + 2.0, 9.0 * t - 5.0, -9.0 * t + 4.0, 3.0 * t - 1.0],
        [-3.0, 9.0, -9.0, 3.0],
    ]
}

/// Uniform cubic B-splines at `t` of the interval between the second and the third node.
fn b_spline(t: f64) -> [[f64; 4]; 4] {
    let (s, t2, t3) = (1.0 - t, t * t, t * t * t);
    [
        [s * s * s / 6.0, 0.5 * t3 - t2 + 2.0 / 3.0, -0.5 * t3 + 0.5 * t2 + 0.5 * t + 1.0 / 6.0, t3 / 6.0],
        [-0.5 * s * s, 1.5 * t2 - 2.0 * t, -1.5 * t2 + t + 0.5, 0.5 * t2],
        [s, 3.0 * t - 2.0, 1.0 - 3.0 * t, t],
        [-1.0, 3.0, -3.0, 1.0],
    ]
}

/// Turns heights into the coefficients of B-splines through them. Gaps are filled along rows first.
fn spline_coefficients(geometry: &Geometry, nodes: &mut [f64]) {
    let (rows, cols) = (geometry.rows(), geometry.cols());
    fill_gaps(cols, nodes);
    let factors = elimination(cols.max(rows));
    for row in nodes.chunks_mut(cols) {
        solve(row.len(), 1, 0, row, &factors);
    }
    for col in 0..cols {
        solve(rows, cols, col, nodes, &factors);
    }
}

/// Upper factors of the tridiagonal matrix (1, 4, 1).
fn elimination(count: usize) -> Vec<f64> {
    let mut factors = Vec::with_capacity(count);
    let mut last = 0.0;
    for _ in 0..count {
        last = 1.0 / (4.0 - last);
        factors.push(last);
    }
    factors
}

/// Natural ends: the outermost coefficients are the heights, the inner ones solve (1, 4, 1) c = 6 z.
fn solve(count: usize, stride: usize, offset: usize, nodes: &mut [f64], factors: &[f64]) {
    if count < 3 {
        return;
    }
    let at = |k: usize| offset + k * stride;
    for k in 1..count - 1 {
        let before = nodes[at(k - 1)];
        let end = if k + 2 == count { nodes[at(k + 1)] } else { 0.0 };
        nodes[at(k)] = (6.0 * nodes[at(k)] - before - end) * factors[k - 1];
    }
    for k in (1..count - 2).rev() {
        nodes[at(k)] -= factors[k - 1] * nodes[at(k + 1)];
    }
}

/// Straight lines across the gaps of a row, its outermost heights beyond them; an empty row is that above it, or the first that is not.
fn fill_gaps(cols: usize, nodes: &mut [f64]) {
    for row in nodes.chunks_mut(cols) {
        let mut last: Option<usize> = None;
        for k in 0..cols {
            if row[k].is_nan() {
                continue;
            }
            let (from, start) = last.map_or((0, row[k]), |l| (l + 1, row[l]));
            let step = (row[k] - start) / (k + 1 - from) as f64;
            for gap in from..k {
                row[gap] = start + step * (gap + 1 - from) as f64;
            }
            last = Some(k);
        }
        if let Some(last) = last {
            let end = row[last];
            row[last + 1..].fill(end);
        }
    }
    let rows = nodes.len() / cols;
    let Some(first) = (0..rows).find(|r| !nodes[r * cols].is_nan()) else { return };
    for row in 0..rows {
        if nodes[row * cols].is_nan() {
            let source = if row < first { first } else { row - 1 };
            nodes.copy_within(source * cols..(source + 1) * cols, row * cols);
        }
    }
}

#[cfg(test)]
mod tests {
    use apsides_ad::{Dual, HyperDual};

    use super::*;

    /// Discretisation: difference quotients, by their steps.
    const DIFFERENCES: f64 = 1e-6;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-12;

    const KINDS: [Smoothness; 2] = [Smoothness::C1, Smoothness::C2];

    fn map(rows: usize, cols: usize, of: impl Fn(f64, f64) -> f64) -> ElevationMap {
        let geometry = Geometry::new(rows, cols, [0.5, 0.75], [10.0, -20.0], MapUnit::Metre).unwrap();
        let heights: Vec<f64> = (0..rows * cols)
            .map(|k| {
                let [e, n] = geometry.position((k / cols) as f64, (k % cols) as f64);
                of(e, n)
            })
            .collect();
        ElevationMap::from_heights(geometry, &heights).unwrap()
    }

    fn hills(rows: usize, cols: usize) -> ElevationMap {
        map(rows, cols, |e, n| 3.0 * (1.3 * e).sin() + 2.0 * (0.7 * n + e).cos() + 0.2 * n)
    }

    #[test]
    fn heights_are_met_and_planes_reproduced_inside_and_beyond() {
        for kind in KINDS {
            let hills = hills(9, 12);
            let surface = Surface::new(&hills, kind).unwrap();
            for (row, col) in [(0, 0), (8, 11), (4, 5), (0, 7), (3, 0)] {
                let found = surface.height_at(hills.geometry().position(row as f64, col as f64)).unwrap();
                assert!((found - hills.height(row, col).unwrap()).abs() < ROUNDING);
            }
            for (rows, cols) in [(9, 12), (2, 2), (3, 2), (4, 3)] {
                let plane = Surface::new(&map(rows, cols, |e, n| 0.25 * e - 0.5 * n + 1.0), kind).unwrap();
                for (e, n) in [(10.2, -20.3), (10.0, -20.0), (12.0, -22.0), (5.0, -10.0), (40.0, -40.0)] {
                    assert!(
                        (plane.height(e, n) - (0.25 * e - 0.5 * n + 1.0)).abs() < ROUNDING,
                        "{rows} {cols}"
                    );
                    assert!((plane.slope(e, n) - (0.3125_f64).sqrt().atan()).abs() < ROUNDING);
                }
                assert_eq!(plane.height_at([40.0, -40.0]), None);
            }
            let flat = Surface::new(&map(1, 1, |_, _| 7.0), kind).unwrap();
            assert_eq!((flat.height(3.0, 4.0), flat.slope_squared(3.0, 4.0)), (7.0, 0.0));
        }
    }

    /// Every derivative that dual numbers carry against central differences of the value one order below.
    #[test]
    fn derivatives_agree_with_differences() {
        let hills = hills(14, 15);
        let h = 1e-5;
        for kind in KINDS {
            let surface = Surface::new(&hills, kind).unwrap();
            for (e, n) in [(12.31, -23.17), (10.13, -20.2), (16.7, -30.1), (9.0, -19.0), (13.1, -45.0)] {
                let dual = surface.height(Dual::<2>::variable(e, 0), Dual::<2>::variable(n, 1));
                let gradient = surface.gradient(e, n);
                let differences = [
                    (surface.height(e + h, n) - surface.height(e - h, n)) / (2.0 * h),
                    (surface.height(e, n + h) - surface.height(e, n - h)) / (2.0 * h),
                ];
                for k in 0..2 {
                    assert_eq!(dual.eps[k], gradient[k]);
                    assert!((gradient[k] - differences[k]).abs() < DIFFERENCES, "{kind:?} {e} {n} {k}");
                }
                let by_duals = surface.gradient(Dual::<2>::variable(e, 0), Dual::<2>::variable(n, 1));
                let second = HyperDual::<1> { re: e, e1: [1.0], e2: [0.0], e12: [0.0] };
                let mixed = surface.height(second, HyperDual { re: n, e1: [0.0], e2: [1.0], e12: [0.0] });
                assert!((mixed.e12[0] - by_duals[0].eps[1]).abs() < ROUNDING);
                for k in 0..2 {
                    let by_east = (surface.gradient(e + h, n)[k] - surface.gradient(e - h, n)[k]) / (2.0 * h);
                    let by_north =
                        (surface.gradient(e, n + h)[k] - surface.gradient(e, n - h)[k]) / (2.0 * h);
                    assert!((by_duals[k].eps[0] - by_east).abs() < 10.0 * DIFFERENCES);
                    assert!((by_duals[k].eps[1] - by_north).abs() < 10.0 * DIFFERENCES);
                }
            }
        }
    }

    /// Across a line of pixel centres: C1 keeps the gradient, C2 also the curvature, and across the edge of the map.
    #[test]
    fn continuity_across_pixels_and_the_edge() {
        let hills = hills(9, 10);
        let d = 1e-9;
        for kind in KINDS {
            let surface = Surface::new(&hills, kind).unwrap();
            let curvature = |e: f64, n: f64| {
                surface.gradient(Dual::<1>::variable(e, 0), Dual::constant(n)).map(|g| g.eps[0])
            };
            for (e, n) in [(11.5, -22.1), (10.0, -23.3), (14.5, -24.4)] {
                let (left, right) = (surface.gradient(e - d, n), surface.gradient(e + d, n));
                assert!((0..2).all(|k| (left[k] - right[k]).abs() < DIFFERENCES), "{kind:?}");
                let (left, right) = (curvature(e - d, n), curvature(e + d, n));
                let jump = (left[0] - right[0]).abs();
                assert!(
                    if kind == Smoothness::C2 { jump < DIFFERENCES } else { jump > 1e-3 },
                    "{kind:?} {e}: {jump}"
                );
            }
        }
    }

    #[test]
    fn no_value_beside_a_gap() {
        let full = hills(12, 12);
        let mut relative = full.relative().clone();
        let hole = full.geometry().index(5, 6);
        relative.data_mut()[hole] = f32::NAN;
        let holed = ElevationMap::from_relative(relative, full.datum()).unwrap();
        for kind in KINDS {
            let surface = Surface::new(&holed, kind).unwrap();
            let whole = Surface::new(&full, kind).unwrap();
            let at = |row, col| full.geometry().position(row, col);
            for (row, col) in [(5.0, 6.0), (4.5, 5.5), (6.9, 6.0), (3.6, 7.9)] {
                assert_eq!(surface.height_at(at(row, col)), None, "{kind:?} {row} {col}");
                assert_eq!(surface.gradient_at(at(row, col)), None);
            }
            for (row, col) in [(2.9, 6.0), (7.1, 6.0), (5.0, 8.2), (5.0, 3.5), (9.0, 1.0)] {
                let (a, b) =
                    (surface.height_at(at(row, col)).unwrap(), whole.height_at(at(row, col)).unwrap());
                assert!((a - b).abs() < if kind == Smoothness::C2 { 0.05 } else { 1e-12 }, "{a} {b}");
            }
        }
        let empty = ElevationMap::from_heights(*full.geometry(), &[f64::NAN; 144]).unwrap();
        assert!(matches!(Surface::new(&empty, Smoothness::C1), Err(TerrainError::Empty { pixels: 144 })));
    }

    /// The C2 surface converges with the fourth power of the pixel, C1 with the third.
    #[test]
    fn order_of_convergence() {
        let f = |e: f64, n: f64| (e + 0.5 * n).sin();
        for (kind, order) in [(Smoothness::C1, 2.7), (Smoothness::C2, 3.7)] {
            let error = |pixel: f64| {
                let count = (8.0 / pixel) as usize + 1;
                let geometry = Geometry::square(count, count, pixel).unwrap();
                let heights: Vec<f64> = (0..count * count)
                    .map(|k| {
                        let [e, n] = geometry.position((k / count) as f64, (k % count) as f64);
                        f(e, n)
                    })
                    .collect();
                let surface =
                    Surface::new(&ElevationMap::from_heights(geometry, &heights).unwrap(), kind).unwrap();
                (0..50)
                    .map(|k| {
                        let (e, n) = (3.0 + 0.0411 * k as f64, -3.0 - 0.0371 * k as f64);
                        (surface.height(e, n) - f(e, n)).abs()
                    })
                    .fold(0.0, f64::max)
            };
            let found = (error(0.5) / error(0.25)).log2();
            assert!(found > order, "{kind:?}: order {found}");
        }
    }
}
