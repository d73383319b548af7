//! The pixels that are read for the footpads.

use super::SiteCriteria;
use crate::disk::{Disk, ROUNDING};

/// The place where the height under the centre of a footpad is read: the pixel to the north west and the fractions of the way to the next ones.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tap {
    pub(super) row: isize,
    pub(super) col: isize,
    pub(super) south: f64,
    pub(super) east: f64,
}

impl Tap {
    fn new(row: f64, col: f64) -> Tap {
        let split = |offset: f64| {
            let near = offset.round();
            let offset = if (offset - near).abs() < ROUNDING { near } else { offset };
            (offset.floor(), offset - offset.floor())
        };
        let ((row, south), (col, east)) = (split(row), split(col));
        Tap { row: row as isize, col: col as isize, south, east }
    }
}

/// Four footpads in all headings.
#[derive(Clone, Debug)]
pub(super) struct Footpads {
    /// Radius of the circle, m.
    pub(super) circle_m: f64,
    /// For each heading the pads around the circle.
    pub(super) headings: Vec<[Tap; 4]>,
    /// Pixels of a footpad.
    pub(super) pad: Disk,
    /// Pixels from the centre within which all taps are.
    pub(super) reach: usize,
}

impl Footpads {
    pub(super) fn new(criteria: &SiteCriteria, pixel_m: f64) -> Footpads {
        let circle = criteria.footpad_circle_radius_m / pixel_m;
        let heading = |k: usize| {
            let angle = std::f64::consts::FRAC_PI_2 * k as f64 / criteria.headings as f64;
            let (sin, cos) = angle.sin_cos();
            // Quarter turns by exchange, so that the four pads are exactly opposite.
            let (south, east) = (circle * sin, circle * cos);
            [Tap::new(south, east), Tap::new(east, -south), Tap::new(-south, -east), Tap::new(-east, south)]
        };
        Footpads {
            circle_m: criteria.footpad_circle_radius_m,
            headings: (0..criteria.headings).map(heading).collect(),
            pad: Disk::new(criteria.footpad_radius_m, pixel_m),
            reach: (circle - ROUNDING).ceil() as usize + 1,
        }
    }

    /// Offsets of all pixels with a weight, each once.
    pub(super) fn pixels(&self) -> Vec<(isize, isize)> {
        let mut offsets: Vec<_> = self.headings.iter().flatten().flat_map(corners).collect();
        offsets.sort_unstable();
        offsets.dedup();
        offsets
    }
}

/// The up to four pixels of a tap that have a weight.
fn corners(tap: &Tap) -> impl Iterator<Item = (isize, isize)> + use<> {
    let tap = *tap;
    let rows = 0..=isize::from(tap.south > 0.0);
    rows.flat_map(move |r| (0..=isize::from(tap.east > 0.0)).map(move |c| (tap.row + r, tap.col + c)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn disks_have_the_pixels_of_the_reference() {
        assert_eq!(Disk::new(5.0, 1.0).count, 81);
        assert_eq!(Disk::new(2.5, 0.1).count, 1961);
        assert_eq!((Disk::new(0.0, 1.0).count, Disk::new(0.25, 0.1).count), (1, 21));
        let disk = Disk::new(5.0, 1.0);
        let moment: isize = disk.chords().map(|(dy, w)| dy * dy * (2 * w as isize + 1)).sum();
        assert_eq!(disk.moment, moment as f64);
    }

    #[test]
    fn taps_on_pixels_read_one() {
        let pads = Footpads::new(&SiteCriteria::CHANG_E_3_FINE, 0.1);
        assert_eq!((pads.reach, pads.headings.len()), (26, 18));
        let first = &pads.headings[0];
        let offsets: Vec<_> = first.iter().flat_map(corners).collect();
        assert_eq!(offsets, [(0, 25), (25, 0), (0, -25), (-25, 0)]);
    }
}
