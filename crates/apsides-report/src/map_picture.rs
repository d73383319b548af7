//! A picture of a map in a frame with distances and a bar of scale.

use crate::axis_layout::AxisLayout;
use crate::canvas::{Anchor, Baseline, Canvas};
use crate::figure::Axis;
use crate::palette::{BODY, FRAME, INK};
use crate::svg::WIDTH;

/// A picture of a part of a map, north up, and the distances of its edges from a place of the map.
#[derive(Clone, Copy, Debug)]
pub struct MapPicture<'a> {
    /// Bytes of the picture in PNG.
    pub png: &'a [u8],
    /// The place that distances count from, such as `the site`.
    pub origin: &'a str,
    /// Western and eastern edge, m to the east of the origin.
    pub east: [f64; 2],
    /// Southern and northern edge, m to the north of the origin.
    pub north: [f64; 2],
}

const LEFT: f64 = 56.0;
const RIGHT: f64 = WIDTH - 18.0;
const TOP: f64 = 28.0;
/// Room below the picture for the labels of its axis.
const FOOT: f64 = 44.0;
/// Height of a picture by its width, at most and at least: long strips are drawn in less than their length.
const SHAPE: [f64; 2] = [0.1, 3.0];
/// Length of a tick.
const TICK: f64 = 4.0;
/// Place of the bar of scale from the lower left corner of the picture, and its thickness.
const BAR: [f64; 2] = [14.0, 12.0];
const THICK: f64 = 5.0;

impl MapPicture<'_> {
    /// The picture as an SVG element with a title.
    pub(crate) fn to_svg(self, title: &str) -> String {
        let shape = (self.north[1] - self.north[0]) / (self.east[1] - self.east[0]);
        let shape = if shape.is_finite() { shape.clamp(SHAPE[0], SHAPE[1]) } else { 1.0 };
        let tall = (RIGHT - LEFT) * shape;
        let bottom = TOP + tall;
        let axis = |way: &str, ends: [f64; 2], ticks| {
            let axis = Axis::new(format!("{way} of {}", self.origin), "m");
            AxisLayout::new(&axis, ends.into_iter(), 0.0, ticks)
        };
        let (x, y) = (axis("east", self.east, 6), axis("north", self.north, (tall / 60.0).ceil() as usize));
        let across = |position: f64| LEFT + position * (RIGHT - LEFT);
        let up = |position: f64| bottom - position * tall;

        let mut canvas = Canvas::default();
        canvas.png((LEFT, TOP), (RIGHT, bottom), self.png);
        let frame = [(LEFT, TOP), (RIGHT, TOP), (RIGHT, bottom), (LEFT, bottom), (LEFT, TOP)];
        canvas.line(&frame, FRAME, 1.0);
        for tick in &x.ticks {
            let at = across(tick.position);
            canvas.line(&[(at, bottom), (at, bottom + TICK)], FRAME, 1.0);
            canvas.text(&tick.label, (at, bottom + 6.0), Anchor::Middle, Baseline::Below);
        }
        for tick in &y.ticks {
            let at = up(tick.position);
            canvas.line(&[(LEFT - TICK, at), (LEFT, at)], FRAME, 1.0);
            canvas.text(&tick.label, (LEFT - 6.0, at), Anchor::End, Baseline::Centred);
        }
        canvas.text(&y.title, (6.0, 6.0), Anchor::Start, Baseline::Below);
        let foot = bottom + FOOT;
        canvas.text(&x.title, (0.5 * (LEFT + RIGHT), foot - 6.0), Anchor::Middle, Baseline::Above);
        // As long as the ticks are apart, whose numbers tell its length.
        if let [first, second, ..] = x.ticks.as_slice() {
            let (left, right) =
                (LEFT + BAR[0], LEFT + BAR[0] + across(second.position) - across(first.position));
            let height = bottom - BAR[1];
            canvas.line(&[(left, height), (right, height)], INK, THICK);
            canvas.line(&[(left, height), (right, height)], BODY, THICK - 2.0);
        }
        canvas.finish([WIDTH, foot], title, "")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_stand_at_the_edges_of_the_picture() {
        let picture = MapPicture {
            png: &[1, 2, 3],
            origin: "the <site>",
            east: [-200.0, 200.0],
            north: [-50.0, 150.0],
        };
        let svg = picture.to_svg("a map");
        assert!(
            svg.contains("east of the &lt;site&gt; (m)") && svg.contains("<title>a map</title>"),
            "{svg}"
        );
        for tick in ["\u{2212}200", "\u{2212}100", "100", "200"] {
            assert!(svg.contains(&format!(">{tick}</text>")), "{tick}: {svg}");
        }
        // Half as high as wide: 486 by 243.
        assert!(svg.contains("<image x=\"560\" y=\"280\" width=\"4860\" height=\"2430\""), "{svg}");
        assert!(svg.contains("base64,AQID"));
    }

    #[test]
    fn strips_and_nothing_are_drawn() {
        for (east, north) in [([0.0, 1e6], [0.0, 1.0]), ([0.0, 1.0], [0.0, 1e9]), ([0.0; 2], [f64::NAN; 2])] {
            let svg = MapPicture { png: &[], origin: "a corner", east, north }.to_svg("");
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }
}
