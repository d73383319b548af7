//! Segments above the ground: lines of sight, clearance of a path, sweeps of a body.

use super::{Body, Ground, positive};
use crate::TerrainError;

/// A line that enters the ground by less than this is not blocked, m: rounding of a line that lies in it.
const GRAZE: f64 = 1e-9;

/// The first thing between two points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sight {
    /// Nothing.
    Clear,
    /// The ground.
    Blocked {
        /// The point where the line enters it (for a body: its middle then).
        point: [f64; 3],
        /// Distance from the first point, m.
        distance: f64,
    },
    /// A hole or the edge of the map, with nothing before it.
    Unknown {
        /// The point where the line comes to it.
        point: [f64; 3],
        /// Distance from the first point, m.
        distance: f64,
    },
}

/// The least height of a path above the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearance {
    /// The height, m; negative where the path is in the ground.
    pub height: f64,
    /// The point of the path.
    pub point: [f64; 3],
    /// Its distance from the start, along the path, m.
    pub distance: f64,
}

/// A stretch of a segment above one triangle; the height above it is linear.
struct Stretch {
    /// Parts of the way.
    ends: [f64; 2],
    /// Heights above the ground at the ends; none in a hole or outside the map.
    heights: Option<[f64; 2]>,
}

impl Ground {
    /// Finds what the straight line from one point to another meets first. A point on the ground sees from it.
    ///
    /// Exact for the triangles: the line is cut where it crosses their edges in plan.
    ///
    /// # Examples
    /// ```
    /// use apsides_terrain::contact::{Ground, Sight};
    /// use apsides_terrain::{ElevationMap, Geometry};
    ///
    /// // A wall of 5 m on the flat, along the column 20 m east.
    /// let geometry = Geometry::square(41, 41, 1.0)?;
    /// let heights: Vec<f64> = (0..41 * 41).map(|k| if k % 41 == 20 { 5.0 } else { 0.0 }).collect();
    /// let map = ElevationMap::from_heights(geometry, &heights)?;
    /// let ground = Ground::new(&map)?;
    /// // From 2 m above the ground over the wall.
    /// let Sight::Blocked { point, .. } = ground.line_of_sight([10.0, -20.0, 2.0], [30.0, -20.0, 2.0]) else { panic!("seen") };
    /// assert!((point[0] - 19.4).abs() < 1e-9);
    /// assert_eq!(ground.line_of_sight([10.0, -20.0, 6.0], [30.0, -20.0, 6.0]), Sight::Clear);
    /// # Ok::<(), apsides_terrain::TerrainError>(())
    /// ```
    pub fn line_of_sight(&self, from: [f64; 3], to: [f64; 3]) -> Sight {
        let met = self.first_met(self.local(from), self.local(to));
        sight(from, to, met)
    }

    /// The least vertical distance between a polyline and the ground below it, and its place (the first, if there are several).
    ///
    /// None if a part of the path is above a hole or outside the map, or if there is no point.
    pub fn path_clearance(&self, path: &[[f64; 3]]) -> Option<Clearance> {
        let mut least = None::<Clearance>;
        let mut start = 0.0;
        let mut known = true;
        let single = path.len() == 1;
        let pairs = path.windows(2).map(|pair| (pair[0], pair[1]));
        for (from, to) in pairs.chain(single.then(|| (path[0], path[0]))) {
            let length = distance(from, to);
            self.walk(self.local(from), self.local(to), |stretch| {
                let Some(heights) = stretch.heights else {
                    known = false;
                    return false;
                };
                for (t, height) in stretch.ends.into_iter().zip(heights) {
                    if least.is_none_or(|l| height < l.height) {
                        least = Some(Clearance {
                            height,
                            point: between(from, to, t),
                            distance: start + t * length,
                        });
                    }
                }
                true
            });
            start += length;
        }
        if known { least } else { None }
    }

    /// Finds what a body meets first whose middle moves straight from one point to another without turning, through parry's cast; holes and
    /// the outside of the map count where they are under the body.
    ///
    /// The cast iterates: the place is exact to about 1e-7 of the way, and a body that no more than grazes may pass. The line of the
    /// body's middle is tested exactly beside it.
    ///
    /// # Errors
    /// A size that is not positive and finite, a point that is not finite.
    pub fn sweep(&self, body: &Body, from: [f64; 3], to: [f64; 3]) -> Result<Sight, TerrainError> {
        let radius = match *body {
            Body::Ball { radius } => radius,
            Body::Cylinder { radius, height } => {
                positive("height of the cylinder", height)?;
                radius
            }
        };
        positive("radius of the body", radius)?;
        for value in from.into_iter().chain(to) {
            if !value.is_finite() {
                return Err(TerrainError::Number {
                    name: "coordinate of a sweep",
                    value,
                    allowed: "it must be finite".into(),
                });
            }
        }
        let (start, end) = (self.local(from), self.local(to));
        let unknown = self.first_unknown(start, end, radius);
        let mut met = self.field.sweep(body, start, end);
        if let Some((t, true)) = self.first_met(start, end) {
            met = Some(met.map_or(t, |m| m.min(t)));
        }
        Ok(match (met, unknown) {
            (Some(t), None) => sight(from, to, Some((t, true))),
            (Some(t), Some(gap)) if t < gap => sight(from, to, Some((t, true))),
            (_, gap) => sight(from, to, gap.map(|gap| (gap, false))),
        })
    }

    /// Part of the way at which a line meets the ground (true) or the unknown (false).
    fn first_met(&self, from: [f64; 3], to: [f64; 3]) -> Option<(f64, bool)> {
        let mut met = None;
        self.walk(from, to, |stretch| {
            let [t0, t1] = stretch.ends;
            met = match stretch.heights {
                None => Some((t0, false)),
                Some([h0, _]) if h0 < -GRAZE => Some((t0, true)),
                Some([h0, h1]) if h1 < -GRAZE => {
                    Some((t0 + (t1 - t0) * (h0.max(0.0) / (h0.max(0.0) - h1)), true))
                }
                Some(_) => None,
            };
            met.is_none()
        });
        met
    }

    /// Part of the way at which a disk first may have a hole or the outside of the map under it.
    fn first_unknown(&self, from: [f64; 3], to: [f64; 3], radius: f64) -> Option<f64> {
        let (a, b) = (self.cell_coordinates([from[0], from[1]]), self.cell_coordinates([to[0], to[1]]));
        let reach = radius / self.pixel;
        let d = [b[0] - a[0], b[1] - a[1]];
        let length = d[0].hypot(d[1]);
        let [rows, cols] = self.field.cells();
        let mut first = f64::INFINITY;
        for (i, n) in [rows, cols].into_iter().enumerate() {
            let (low, high) = (reach, n as f64 - reach);
            if !(low - 1e-9..=high + 1e-9).contains(&a[i]) {
                first = 0.0;
            } else if b[i] > high + 1e-9 {
                first = first.min(((high - a[i]) / d[i]).max(0.0));
            } else if b[i] < low - 1e-9 {
                first = first.min(((low - a[i]) / d[i]).max(0.0));
            }
        }
        if self.field.holes() {
            // A cell is within the circle about it.
            let reach = reach + std::f64::consts::FRAC_1_SQRT_2;
            let span = |i: usize, n: usize| {
                let low = (a[i].min(b[i]) - reach).max(0.0) as usize;
                low..((a[i].max(b[i]) + reach).max(0.0) as usize + 1).min(n)
            };
            for row in span(0, rows) {
                for col in span(1, cols).filter(|&col| self.field.is_hole(row, col)) {
                    let c = [row as f64 + 0.5 - a[0], col as f64 + 0.5 - a[1]];
                    let along = if length > 0.0 { (c[0] * d[0] + c[1] * d[1]) / length } else { 0.0 };
                    let nearest = along.clamp(0.0, length);
                    let beside =
                        (c[0].hypot(c[1]).powi(2) - along * along).max(0.0) + (along - nearest).powi(2);
                    if beside <= reach * reach {
                        let t = if length > 0.0 { ((along - reach) / length).max(0.0) } else { 0.0 };
                        first = first.min(t);
                    }
                }
            }
        }
        first.is_finite().then_some(first)
    }

    /// Visits a segment triangle by triangle until told to stop or the segment leaves the map.
    fn walk(&self, from: [f64; 3], to: [f64; 3], mut visit: impl FnMut(Stretch) -> bool) {
        let unknown = |t: f64| Stretch { ends: [t, t], heights: None };
        let [row, col] = self.cell_coordinates([from[0], from[1]]);
        if from.iter().chain(&to).any(|x| !x.is_finite()) || self.cell(row, col).is_none() {
            visit(unknown(0.0));
            return;
        }
        let [end_row, end_col] = self.cell_coordinates([to[0], to[1]]);
        let (d_row, d_col) = (end_row - row, end_col - col);
        // Crossings are at whole rows, whole columns, and on the diagonals where row + column is whole.
        let mut edges = [
            Crossings::new(row, d_row),
            Crossings::new(col, d_col),
            Crossings::new(row + col, d_row + d_col),
        ];
        let mut t0 = 0.0;
        loop {
            let next = edges.iter().map(|e| e.next).fold(f64::INFINITY, f64::min);
            let t1 = next.clamp(t0, 1.0);
            if t1 > t0 {
                let middle = 0.5 * (t0 + t1);
                let cell = self.cell(row + middle * d_row, col + middle * d_col);
                let Some(cell) = cell.filter(|&[i, j]| !self.field.is_hole(i, j)) else {
                    visit(unknown(t0));
                    return;
                };
                let height = |t: f64| {
                    let ground = self.height_in_cell(cell, row + t * d_row, col + t * d_col);
                    from[2] + t * (to[2] - from[2]) - ground
                };
                if !visit(Stretch { ends: [t0, t1], heights: Some([height(t0), height(t1)]) }) {
                    return;
                }
            }
            if next >= 1.0 {
                return;
            }
            t0 = t1;
            for edge in &mut edges {
                if edge.next <= next {
                    edge.advance();
                }
            }
        }
    }
}

/// Parts of the way at which start + t change is a whole number.
struct Crossings {
    start: f64,
    change: f64,
    whole: f64,
    next: f64,
}

impl Crossings {
    fn new(start: f64, change: f64) -> Crossings {
        let whole = if change > 0.0 { start.floor() } else { start.ceil() };
        let mut edges = Crossings { start, change, whole, next: f64::INFINITY };
        if change != 0.0 {
            edges.advance();
        }
        edges
    }

    fn advance(&mut self) {
        self.whole += self.change.signum();
        self.next = (self.whole - self.start) / self.change;
    }
}

fn between(from: [f64; 3], to: [f64; 3], t: f64) -> [f64; 3] {
    [0, 1, 2].map(|i| from[i] + t * (to[i] - from[i]))
}

fn distance(from: [f64; 3], to: [f64; 3]) -> f64 {
    let d = [0, 1, 2].map(|i| to[i] - from[i]);
    d[0].hypot(d[1]).hypot(d[2])
}

fn sight(from: [f64; 3], to: [f64; 3], met: Option<(f64, bool)>) -> Sight {
    let Some((t, ground)) = met else { return Sight::Clear };
    let (point, distance) = (between(from, to, t), t * distance(from, to));
    if ground { Sight::Blocked { point, distance } } else { Sight::Unknown { point, distance } }
}
