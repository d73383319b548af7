//! Rest of a lander on its four pads.

use std::f64::consts::FRAC_PI_2;

use super::footprint::{Frame, cross, dot};
use super::{Ground, not_negative, positive};
use crate::TerrainError;

/// A pad nearer to the ground than this touches it, m.
const TOUCH: f64 = 1e-6;

/// Contact heights found to this, m, relative to heights of 1 m.
const SETTLED: f64 = 1e-12;

/// Rounds of the search for a plane on three pads.
const ROUNDS: usize = 200;

/// The largest turn of a search in one round that is not damped: the first rounds of a contraction.
const UNDAMPED_ROUNDS: usize = 40;

/// Three pads of four, by the one left out.
const TRIPLES: [[usize; 3]; 4] = [[1, 2, 3], [2, 3, 0], [3, 0, 1], [0, 1, 2]];

/// A rigid lander on four pads. Pad k stands at the angle heading + k 90 deg, counted from east towards north; a pad is a disk on a
/// joint, which stays level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lander {
    /// Distance of a pad's middle from the middle of the pads, m.
    pub pad_distance: f64,
    /// Radius of a pad, m; zero for points.
    pub pad_radius: f64,
    /// Height of the centre of mass above the plane of the pads, m; it lies above their middle.
    pub centre_of_mass_height: f64,
    /// Lower face of the body, if its clearance is wanted.
    pub belly: Option<LowerFace>,
}

/// The lower face of a body: a disk parallel to the plane of the pads, above their middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LowerFace {
    /// Its radius, m.
    pub radius: f64,
    /// Its height above the plane of the pads, m.
    pub height: f64,
}

/// The outcome of a touchdown at one place with one heading.
#[derive(Clone, Debug, PartialEq)]
pub struct Touchdown {
    /// Height of the ground under each pad of the level lander, m; the pad over the highest touches first.
    pub pad_heights: [f64; 4],
    /// Attitudes in which the lander stays, the steepest first. More than one if the lander rocks on a diagonal; none if it topples.
    pub rests: Vec<Rest>,
    /// Sets of three pads on which no attitude was found; zero except on ground that is far rougher than the pads are large.
    pub unsettled: usize,
}

/// A lander at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rest {
    /// Angle between the lander's axis and the vertical, rad.
    pub tilt: f64,
    /// Elevation of the axis to pad 0 above the horizontal, rad.
    pub pitch: f64,
    /// Elevation of the axis to pad 1 above the horizontal, rad.
    pub roll: f64,
    /// Unit vector along the lander's axis, (east, north, up).
    pub axis: [f64; 3],
    /// The pads that touch.
    pub pads: [bool; 4],
    /// Vertical distance between each pad and the ground, m.
    pub gaps: [f64; 4],
    /// Middle of the pads.
    pub middle: [f64; 3],
    /// The centre of mass.
    pub centre_of_mass: [f64; 3],
    /// Least distance of the belly from the ground along the lander's axis, m, negative if a rock is in the way.
    pub clearance: Option<f64>,
}

impl Touchdown {
    /// The steepest rest; none if the lander topples.
    pub fn worst(&self) -> Option<&Rest> {
        self.rests.first()
    }
}

impl Lander {
    fn check(&self) -> Result<(), TerrainError> {
        positive("distance of a pad from the middle", self.pad_distance)?;
        not_negative("radius of a pad", self.pad_radius)?;
        not_negative("height of the centre of mass", self.centre_of_mass_height)?;
        if let Some(belly) = self.belly {
            positive("radius of the belly", belly.radius)?;
            positive("height of the belly", belly.height)?;
        }
        Ok(())
    }
}

/// A plane of pads: its height at the middle and its gradient.
#[derive(Clone, Copy)]
struct PadPlane {
    height: f64,
    gradient: [f64; 2],
}

impl PadPlane {
    /// Body axes after the shortest turn from level to the plane.
    fn axes(&self, heading: f64) -> [[f64; 3]; 3] {
        let [a, b] = self.gradient;
        let norm = (1.0 + a * a + b * b).sqrt();
        let up = [-a / norm, -b / norm, 1.0 / norm];
        let turned = |angle: f64| {
            let v = [angle.cos(), angle.sin()];
            let along = (up[0] * v[0] + up[1] * v[1]) / (1.0 + up[2]);
            [v[0] - along * up[0], v[1] - along * up[1], -along * (1.0 + up[2])]
        };
        [turned(heading), turned(heading + FRAC_PI_2), up]
    }

    /// The plane through three points, heights at `middle`; none if they are in line in plan.
    fn through(points: [[f64; 3]; 3], middle: [f64; 2]) -> Option<PadPlane> {
        let [a, b, c] = points;
        let (p, q) = ([0, 1, 2].map(|i| b[i] - a[i]), [0, 1, 2].map(|i| c[i] - a[i]));
        let normal = cross(p, q);
        let gradient = [-normal[0] / normal[2], -normal[1] / normal[2]];
        let height = a[2] + gradient[0] * (middle[0] - a[0]) + gradient[1] * (middle[1] - a[1]);
        height.is_finite().then_some(PadPlane { height, gradient })
    }
}

/// The end of the search for a plane on three pads.
enum PlaneSearch {
    Found(PadPlane),
    NotFound,
    Unknown,
}

impl Ground {
    /// Lets a lander down vertically, the middle of its pads above (east, north), until it rests.
    ///
    /// The lander is rigid and turns about a horizontal axis from its level attitude; friction keeps it from sliding. A rest is an
    /// attitude in which three pads touch, the fourth is not in the ground, and the centre of mass is above the triangle of the
    /// three (plumb). If the centre of mass is in the plane of the pads, every lander whose pads are not coplanar has two rests, one on
    /// either side of the diagonal of pads that is higher.
    ///
    /// None if a hole or the outside of the map is under a pad or the belly.
    ///
    /// # Errors
    /// Sizes of the lander that are not positive (radius of a pad, height of the centre of mass: negative), a place or a
    /// heading that is not finite.
    pub fn touchdown(
        &self,
        lander: &Lander,
        position: [f64; 2],
        heading: f64,
    ) -> Result<Option<Touchdown>, TerrainError> {
        lander.check()?;
        for (name, value) in [("east", position[0]), ("north", position[1]), ("heading", heading)] {
            if !value.is_finite() {
                return Err(TerrainError::Number { name, value, allowed: "it must be finite".into() });
            }
        }
        Ok(self.settle(lander, position, heading))
    }

    fn settle(&self, lander: &Lander, position: [f64; 2], heading: f64) -> Option<Touchdown> {
        let [x, y, _] = self.local([position[0], position[1], 0.0]);
        let level = PadPlane { height: 0.0, gradient: [0.0; 2] };
        let mut ground = [0.0; 4];
        for (z, pad) in ground.iter_mut().zip(pads(lander, [x, y], heading, &level)) {
            *z = self.under_pad(lander, pad)?;
        }
        let mut touchdown =
            Touchdown { pad_heights: ground.map(|z| z + self.middle[2]), rests: Vec::new(), unsettled: 0 };
        for triple in TRIPLES {
            match self.plane_on(lander, [x, y], heading, triple, ground) {
                PlaneSearch::Unknown => return None,
                PlaneSearch::NotFound => touchdown.unsettled += 1,
                PlaneSearch::Found(plane) => {
                    let mut gaps = [0.0; 4];
                    let pads = pads(lander, [x, y], heading, &plane);
                    for (gap, pad) in gaps.iter_mut().zip(pads) {
                        *gap = pad[2] - self.under_pad(lander, pad)?;
                    }
                    let axes = plane.axes(heading);
                    let middle = [x, y, plane.height];
                    let mass = [0, 1, 2].map(|i| middle[i] + lander.centre_of_mass_height * axes[2][i]);
                    let stands = is_above(triple.map(|k| pads[k]), mass, 1e-9 * lander.pad_distance);
                    let known = touchdown.rests.iter().any(|rest| dot(rest.axis, axes[2]) > 1.0 - 1e-14);
                    if gaps.iter().any(|&gap| gap < -TOUCH) || !stands || known {
                        continue;
                    }
                    let clearance = match lander.belly {
                        Some(belly) => Some(self.belly_clearance(&belly, Frame { origin: middle, axes })?),
                        None => None,
                    };
                    touchdown.rests.push(Rest {
                        tilt: axes[2][0].hypot(axes[2][1]).atan2(axes[2][2]),
                        pitch: axes[0][2].asin(),
                        roll: axes[1][2].asin(),
                        axis: axes[2],
                        pads: gaps.map(|gap| gap <= TOUCH),
                        gaps,
                        middle: self.global(middle),
                        centre_of_mass: self.global(mass),
                        clearance,
                    });
                }
            }
        }
        touchdown.rests.sort_by(|a, b| b.tilt.total_cmp(&a.tilt));
        Some(touchdown)
    }

    /// Height of the highest ground under a level pad.
    fn under_pad(&self, lander: &Lander, [x, y, _]: [f64; 3]) -> Option<f64> {
        let radius = lander.pad_radius;
        Some(self.highest(&Frame::upright([x, y, 0.0]), radius, radius)?[2])
    }

    /// The plane on which three pads touch. Tilt draws the pads inwards by a part of the second order, so that the plane through
    /// the heights under the pads of the last plane is a contraction; it starts from the level lander.
    fn plane_on(
        &self,
        lander: &Lander,
        middle: [f64; 2],
        heading: f64,
        triple: [usize; 3],
        level: [f64; 4],
    ) -> PlaneSearch {
        let mut plane = PadPlane { height: 0.0, gradient: [0.0; 2] };
        let mut ground = triple.map(|k| level[k]);
        for round in 0..ROUNDS {
            let stands = pads(lander, middle, heading, &plane);
            let points = [0, 1, 2].map(|k| [stands[triple[k]][0], stands[triple[k]][1], ground[k]]);
            let Some(mut next) = PadPlane::through(points, middle) else { return PlaneSearch::NotFound };
            if round > UNDAMPED_ROUNDS {
                next.gradient = [0, 1].map(|i| 0.5 * (plane.gradient[i] + next.gradient[i]));
                next.height = 0.5 * (plane.height + next.height);
            }
            plane = next;
            let stands = pads(lander, middle, heading, &plane);
            let mut error = 0.0_f64;
            for k in 0..3 {
                let pad = stands[triple[k]];
                let Some(z) = self.under_pad(lander, pad) else { return PlaneSearch::Unknown };
                ground[k] = z;
                error = error.max((z - pad[2]).abs() / (1.0 + z.abs()));
            }
            if error <= SETTLED {
                return PlaneSearch::Found(plane);
            }
        }
        PlaneSearch::NotFound
    }

    fn belly_clearance(&self, belly: &LowerFace, frame: Frame) -> Option<f64> {
        // Ground up to the belly's height above or below the plane of the pads is under the belly; the tilt shifts it.
        let shift = belly.height * frame.axes[2][0].hypot(frame.axes[2][1]);
        Some(belly.height - self.highest(&frame, belly.radius, belly.radius + shift)?[2])
    }
}

/// Middles of the pads.
fn pads(lander: &Lander, [x, y]: [f64; 2], heading: f64, plane: &PadPlane) -> [[f64; 3]; 4] {
    let [ahead, left, _] = plane.axes(heading);
    let rho = lander.pad_distance;
    [(ahead, rho), (left, rho), (ahead, -rho), (left, -rho)]
        .map(|(axis, rho)| [x + rho * axis[0], y + rho * axis[1], plane.height + rho * axis[2]])
}

/// Tells whether a point is above a triangle, or less than `margin` beside it.
fn is_above(triangle: [[f64; 3]; 3], point: [f64; 3], margin: f64) -> bool {
    let sides = [0, 1, 2].map(|k| {
        let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        (dx * (point[1] - a[1]) - dy * (point[0] - a[0])) / dx.hypot(dy)
    });
    // The pads go round against the clock.
    sides.iter().all(|&side| side >= -margin)
}
