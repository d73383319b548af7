//! Shaded relief under a coloured layer, with marked places.

use std::io::Write;

use png::{BitDepth, ColorType, Encoder};

use super::digits::{ADVANCE, HEIGHT, dots};
use crate::{Geometry, TerrainError};

/// A transparent colour over the relief.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tint {
    /// Red, green, blue.
    pub colour: [u8; 3],
    /// 0 shows the relief alone, 1 the colour alone.
    pub strength: f64,
}

/// A ring with a number beside it, where there is room for one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// Row of the map.
    pub row: usize,
    /// Column of the map.
    pub col: usize,
    /// Radius in pixels of the map; drawn no smaller than three dots.
    pub radius: f64,
    /// The number.
    pub number: usize,
    /// Red, green, blue.
    pub colour: [u8; 3],
}

/// The factor by which a slope is drawn darker or brighter than level ground, for one unit of its brightness.
const CONTRAST: f64 = 2.0;

/// Grey of level ground, 0 to 1.
const LEVEL: f64 = 0.62;

/// A picture of a map that is painted row by row from the north, each dot the mean of a square of pixels where the map is larger than
/// the picture may be.
#[derive(Clone, Debug)]
pub struct ReliefPicture {
    rows: usize,
    cols: usize,
    /// Pixels to a side of a dot.
    step: usize,
    /// Sums of red, green, blue and the number of pixels, dot by dot.
    sums: Vec<[u32; 4]>,
    painted: usize,
}

impl ReliefPicture {
    /// An empty picture of a map, its sides at most `most` dots (at least 1).
    pub fn new(geometry: &Geometry, most: usize) -> ReliefPicture {
        let (rows, cols) = (geometry.rows(), geometry.cols());
        let step = rows.max(cols).div_ceil(most.max(1));
        let dots = rows.div_ceil(step) * cols.div_ceil(step);
        ReliefPicture { rows, cols, step, sums: vec![[0; 4]; dots], painted: 0 }
    }

    /// Paints the next row. `light` is the brightness of its pixels, for example of [`crate::light::incidence`], NaN where there is none:
    /// such pixels are black under their tint; `level` is the brightness of level ground.
    ///
    /// # Errors
    /// Another number of pixels than columns, or more rows than the map has.
    pub fn row(
        &mut self,
        light: &[f32],
        level: f64,
        tint: impl Fn(usize) -> Option<Tint>,
    ) -> Result<(), TerrainError> {
        if light.len() != self.cols || self.painted == self.rows {
            let rows = self.rows - self.painted;
            return Err(TerrainError::Shape { rows, cols: self.cols, values: light.len() });
        }
        let width = self.cols.div_ceil(self.step);
        let line = &mut self.sums[self.painted / self.step * width..][..width];
        for (col, &light) in light.iter().enumerate() {
            let grey = LEVEL + CONTRAST * (f64::from(light) - level);
            // A comparison with NaN is false.
            let grey = if grey > 0.0 { 255.0 * grey.min(1.0) } else { 0.0 };
            let sum = &mut line[col / self.step];
            let tint = tint(col);
            for k in 0..3 {
                let shown = tint.map_or(grey, |t| grey + t.strength * (f64::from(t.colour[k]) - grey));
                sum[k] += shown.round() as u32;
            }
            sum[3] += 1;
        }
        self.painted += 1;
        Ok(())
    }

    /// Writes the picture as PNG (RGB, 8 bits); rows that were not painted are black.
    ///
    /// # Errors
    /// The writer's.
    pub fn write<W: Write>(&self, writer: W, marks: &[Mark]) -> Result<(), TerrainError> {
        let (height, width) = (self.rows.div_ceil(self.step), self.cols.div_ceil(self.step));
        let mut dots: Vec<[u8; 3]> =
            self.sums.iter().map(|&[r, g, b, n]| [r, g, b].map(|sum| (sum / n.max(1)) as u8)).collect();
        let canvas = Canvas { height, width, dots: &mut dots };
        self.draw(canvas, marks);
        let failed =
            |e: png::EncodingError| TerrainError::Io { doing: "writing a picture", source: e.into() };
        let side = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        let mut encoder = Encoder::new(writer, side(width), side(height));
        encoder.set_color(ColorType::Rgb);
        encoder.set_depth(BitDepth::Eight);
        let mut png = encoder.write_header().map_err(failed)?;
        png.write_image_data(dots.as_flattened()).map_err(failed)?;
        png.finish().map_err(failed)
    }

    /// Draws rings, then numbers, which rings may not cover.
    fn draw(&self, mut canvas: Canvas<'_>, marks: &[Mark]) {
        let size = canvas.pen();
        let rings: Vec<Ring> = marks.iter().map(|mark| self.ring(mark, size)).collect();
        for (ring, mark) in rings.iter().zip(marks) {
            ring.draw(&mut canvas, size, mark.colour);
        }
        let mut taken = Vec::new();
        for (ring, mark) in rings.iter().zip(marks) {
            let text = mark.number.to_string();
            if let Some(label) = ring.label(&canvas, &text, &rings, &taken) {
                canvas.number(&text, label, mark.colour);
                taken.push(label);
            }
        }
    }

    fn ring(&self, mark: &Mark, size: f64) -> Ring {
        let place = |at: usize| (at as f64 + 0.5) / self.step as f64;
        let radius = (mark.radius / self.step as f64).max(3.0 * size);
        Ring { row: place(mark.row), col: place(mark.col), radius }
    }
}

/// Dots row by row.
struct Canvas<'a> {
    height: usize,
    width: usize,
    dots: &'a mut [[u8; 3]],
}

impl Canvas<'_> {
    /// Dots to a side of a dot of letters and to the thickness of rings.
    fn pen(&self) -> f64 {
        (self.height.min(self.width) / 300).clamp(1, 8) as f64
    }

    fn dot(&mut self, row: f64, col: f64, colour: [u8; 3]) {
        let (row, col) = (row.floor(), col.floor());
        if (0.0..self.height as f64).contains(&row) && (0.0..self.width as f64).contains(&col) {
            self.dots[row as usize * self.width + col as usize] = colour;
        }
    }

    fn number(&mut self, text: &str, label: Rectangle, colour: [u8; 3]) {
        let size = self.pen();
        for (rim, colour) in [(1.0, [0; 3]), (0.0, colour)] {
            for (r, c) in dots(text) {
                let (first, side) = (
                    [label.top + r as f64 * size - rim, label.left + c as f64 * size - rim],
                    size + 2.0 * rim,
                );
                for i in 0..side as usize {
                    for j in 0..side as usize {
                        self.dot(first[0] + i as f64, first[1] + j as f64, colour);
                    }
                }
            }
        }
    }
}

/// A part of a picture, in dots.
#[derive(Clone, Copy)]
struct Rectangle {
    top: f64,
    left: f64,
    height: f64,
    width: f64,
}

impl Rectangle {
    fn meets(&self, other: &Rectangle) -> bool {
        let apart = |a: f64, length: f64, b: f64, other: f64| a + length <= b || b + other <= a;
        !apart(self.top, self.height, other.top, other.height)
            && !apart(self.left, self.width, other.left, other.width)
    }
}

/// A ring, in dots.
struct Ring {
    row: f64,
    col: f64,
    radius: f64,
}

impl Ring {
    fn bounds(&self) -> Rectangle {
        let side = 2.0 * self.radius;
        Rectangle { top: self.row - self.radius, left: self.col - self.radius, height: side, width: side }
    }

    /// The place of a number beside the ring: inside the picture, on none that is `taken`, on as few rings as possible; none without room.
    fn label(
        &self,
        canvas: &Canvas<'_>,
        text: &str,
        rings: &[Ring],
        taken: &[Rectangle],
    ) -> Option<Rectangle> {
        let size = canvas.pen();
        let (width, height) = ((text.len() * ADVANCE) as f64 * size, HEIGHT as f64 * size);
        let gap = self.radius + 2.0 * size;
        let [right, left] = [self.col + gap, self.col - gap - width];
        let [below, above] = [self.row + gap, self.row - gap - height];
        // Beside a ring at an edge a number slides along that.
        let slid = |place: f64, length: f64, side: usize| place.clamp(0.0, (side as f64 - length).max(0.0));
        let middle = slid(self.col - 0.5 * width, width, canvas.width);
        let level = slid(self.row - 0.5 * height, height, canvas.height);
        // To the right first, then round.
        let places = [
            [level, right],
            [level, left],
            [above, middle],
            [below, middle],
            [above, right],
            [below, right],
            [above, left],
            [below, left],
        ];
        let inside = |r: &Rectangle| {
            r.top >= 0.0
                && r.left >= 0.0
                && r.top + height <= canvas.height as f64
                && r.left + width <= canvas.width as f64
        };
        let free = places
            .into_iter()
            .map(|[top, left]| Rectangle { top, left, height, width })
            .filter(|r| inside(r) && taken.iter().all(|other| !r.meets(other)));
        free.min_by_key(|r| rings.iter().filter(|ring| r.meets(&ring.bounds())).count())
    }

    fn draw(&self, canvas: &mut Canvas<'_>, size: f64, colour: [u8; 3]) {
        let around = (8.0 * (self.radius + size)).ceil() as usize;
        // A dark rim keeps the ring visible on bright ground.
        for (thick, colour) in [(size + 1.0, [0; 3]), (size, colour)] {
            for k in 0..around {
                let (s, c) = (k as f64 * std::f64::consts::TAU / around as f64).sin_cos();
                let mut r = self.radius - 0.5 * thick;
                while r <= self.radius + 0.5 * thick {
                    canvas.dot(self.row + r * s, self.col + r * c, colour);
                    r += 0.5;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(bytes: &[u8]) -> (u32, u32, Vec<u8>) {
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut data = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut data).unwrap();
        (info.width, info.height, data)
    }

    #[test]
    fn dots_are_means_of_pixels() {
        let geometry = Geometry::square(5, 6, 1.0).unwrap();
        let mut picture = ReliefPicture::new(&geometry, 3);
        let red = Tint { colour: [255, 0, 0], strength: 1.0 };
        for row in 0..5 {
            let light: Vec<f32> = (0..6).map(|c| if c == 5 { f32::NAN } else { 0.7 }).collect();
            picture.row(&light, 0.7, |col| (row < 2 && col == 0).then_some(red)).unwrap();
        }
        assert!(picture.row(&[0.0; 6], 0.7, |_| None).is_err());
        let mut bytes = Vec::new();
        picture.write(&mut bytes, &[]).unwrap();
        let (width, height, data) = decode(&bytes);
        assert_eq!((width, height), (3, 3));
        // Level ground is 0.62 x 255 = 158; half red, half ground; half ground, half without light.
        assert_eq!(data[..9], [206, 79, 79, 158, 158, 158, 79, 79, 79]);
    }

    #[test]
    fn marks_stay_inside_the_picture() {
        let geometry = Geometry::square(20, 20, 1.0).unwrap();
        let mut picture = ReliefPicture::new(&geometry, 100);
        assert!(picture.row(&[0.0; 19], 0.7, |_| None).is_err());
        for _ in 0..20 {
            picture.row(&[0.7; 20], 0.7, |_| None).unwrap();
        }
        let mark = |row, col| Mark { row, col, radius: 4.0, number: 12, colour: [255, 255, 0] };
        let mut bytes = Vec::new();
        picture.write(&mut bytes, &[mark(0, 0), mark(19, 19), mark(10, 5)]).unwrap();
        let (_, _, data) = decode(&bytes);
        let at = |row: usize, col: usize| &data[3 * (row * 20 + col)..][..3];
        assert_eq!(at(10, 9), [255, 255, 0]);
        assert_eq!(at(10, 5), [158; 3]);
    }

    #[test]
    fn numbers_keep_off_each_other_and_inside() {
        let rings: Vec<Ring> = (0..24)
            .map(|k| Ring { row: 150.0 + f64::from(k % 5) * 9.0, col: 3.0 + f64::from(k) * 4.0, radius: 4.0 })
            .collect();
        let mut dots = vec![[0; 3]; 300 * 300];
        let canvas = Canvas { height: 300, width: 300, dots: &mut dots };
        let mut taken: Vec<Rectangle> = Vec::new();
        for (k, ring) in rings.iter().enumerate() {
            if let Some(label) = ring.label(&canvas, &(k + 1).to_string(), &rings, &taken) {
                assert!(label.left >= 0.0 && taken.iter().all(|other| !label.meets(other)), "{k}");
                taken.push(label);
            }
        }
        assert_eq!(taken.len(), rings.len());
        // Of rings at one place as many have numbers as there are places around it.
        taken.clear();
        for k in 0..rings.len() {
            taken.extend(rings[12].label(&canvas, &(k + 1).to_string(), &rings[12..13], &taken));
        }
        assert!((4..=8).contains(&taken.len()), "{}", taken.len());
        // Alone, to the right.
        let alone = rings[12].label(&canvas, "1", &rings[12..13], &[]).unwrap();
        assert!((alone.left - (rings[12].col + 6.0)).abs() < f64::EPSILON);
    }
}
