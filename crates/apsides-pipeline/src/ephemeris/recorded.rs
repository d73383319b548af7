//! The record of a simulated flight as a flight.

use apsides_ephemeris::{About, Column, Flight, Instant, Point, Span, header};

use crate::Error;

/// Headers of the columns that positions, velocities and attitudes stand in, in axes fixed to the body.
const POSITION: [&str; 3] = ["position x", "position y", "position z"];
const VELOCITY: [&str; 3] = ["velocity x", "velocity y", "velocity z"];
const ATTITUDE: [&str; 4] = ["attitude 0", "attitude 1", "attitude 2", "attitude 3"];

/// The record of a flight: between its moments positions follow cubics that have its velocities, attitudes turn evenly, all else
/// is on straight lines.
pub struct RecordedFlight<'a> {
    rows: &'a [Vec<f64>],
    columns: Vec<Column>,
    about: Option<About>,
    mass: f64,
    motion: [usize; 6],
    attitude: [usize; 4],
}

impl<'a> RecordedFlight<'a> {
    /// A record by the headers of its columns, the first being the time; with the body that it is about and the mass (kg) if it has a place.
    ///
    /// # Errors
    /// A record without rows, with rows of other lengths, or with times that do not increase; one without the columns of its place.
    pub fn new(headers: &[String], rows: &'a [Vec<f64>], about: Option<(About, f64)>) -> Result<Self, Error> {
        let refuse = |reason: &str| Err(Error::Conflict { place: "record".into(), reason: reason.into() });
        if rows.is_empty() || headers.is_empty() || rows.iter().any(|row| row.len() != headers.len()) {
            return refuse("it has no rows, or rows without all columns: is the file truncated?");
        }
        if rows.windows(2).any(|pair| pair[0][0] >= pair[1][0])
            || rows.iter().flatten().any(|v| !v.is_finite())
        {
            return refuse("its times must increase, and all its numbers be finite");
        }
        let place = |name: &str, unit: &str| headers.iter().position(|h| *h == header(name, unit));
        let motion = POSITION.map(|n| place(n, "m")).into_iter().chain(VELOCITY.map(|n| place(n, "m/s")));
        let motion: Option<Vec<usize>> = motion.collect();
        let attitude: Option<Vec<usize>> = ATTITUDE.into_iter().map(|n| place(n, "-")).collect();
        let (about, mass) = about.map_or((None, f64::NAN), |(about, mass)| (Some(about), mass));
        let [motion, attitude] = [motion, attitude].map(Option::unwrap_or_default);
        let (motion, attitude) = match (<[usize; 6]>::try_from(motion), <[usize; 4]>::try_from(attitude)) {
            (Ok(motion), Ok(attitude)) => (motion, attitude),
            _ if about.is_none() => ([0; 6], [0; 4]),
            _ => return refuse("it has no columns of position, velocity and attitude"),
        };
        // Headers have their units already.
        let columns = headers[1..].iter().map(|h| Column::new(h.as_str(), "-")).collect();
        Ok(Self { rows, columns, about, mass, motion, attitude })
    }

    /// The row at or before a time, the next one, and the part of the way between.
    fn between(&self, time: f64) -> (&[f64], &[f64], f64) {
        let next = self.rows.partition_point(|row| row[0] <= time).clamp(1, self.rows.len().max(2) - 1);
        let begin = &self.rows[next - 1];
        let end = self.rows.get(next).unwrap_or(begin);
        let length = end[0] - begin[0];
        (begin, end, if length > 0.0 { ((time - begin[0]) / length).clamp(0.0, 1.0) } else { 0.0 })
    }

    fn point(&self, begin: &[f64], end: &[f64], part: f64) -> Point {
        let length = end[0] - begin[0];
        let at = |row: &[f64], k: usize| row[self.motion[k]];
        let (s, s2, s3) = (part, part * part, part.powi(3));
        let cubic = |k: usize| {
            let [p0, p1, v0, v1] = [at(begin, k), at(end, k), at(begin, k + 3), at(end, k + 3)];
            let position =
                p0 + (3.0 * s2 - 2.0 * s3) * (p1 - p0) + length * ((s3 - 2.0 * s2 + s) * v0 + (s3 - s2) * v1);
            let velocity = match length > 0.0 {
                true => {
                    6.0 * (s - s2) * (p1 - p0) / length
                        + (3.0 * s2 - 4.0 * s + 1.0) * v0
                        + (3.0 * s2 - 2.0 * s) * v1
                }
                false => v0,
            };
            (position, velocity)
        };
        let motion = [0, 1, 2].map(cubic);
        let quaternions = [begin, end].map(|row| self.attitude.map(|k| row[k]));
        Point {
            position: motion.map(|(p, _)| p),
            velocity: motion.map(|(_, v)| v),
            thrust: Some([0.0; 3]),
            mass: Some(self.mass),
            delta_v: Some(0.0),
            attitude: Some(turned_evenly(quaternions, part)),
            loads: Vec::new(),
        }
    }
}

/// The attitude at a part of the way between two, along the shorter arc.
///
/// K. Shoemake, Computer Graphics 19 (1985) 245, doi 10.1145/325165.325242.
fn turned_evenly([a, b]: [[f64; 4]; 2], part: f64) -> [f64; 4] {
    let dot = |a: [f64; 4], b: [f64; 4]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let unit = |q: [f64; 4]| q.map(|c| c / dot(q, q).sqrt());
    let (a, mut b) = (unit(a), unit(b));
    let mut cosine = dot(a, b);
    if cosine < 0.0 {
        (b, cosine) = (b.map(|c| -c), -cosine);
    }
    let angle = cosine.min(1.0).acos();
    let weights = match angle > 1e-6 {
        true => [((1.0 - part) * angle).sin() / angle.sin(), (part * angle).sin() / angle.sin()],
        false => [1.0 - part, part],
    };
    unit([0, 1, 2, 3].map(|k| weights[0] * a[k] + weights[1] * b[k]))
}

impl Flight for RecordedFlight<'_> {
    fn spans(&self) -> Vec<Span> {
        let [first, last] = [self.rows.first(), self.rows.last()].map(|row| row.map_or(0.0, |row| row[0]));
        vec![Span { name: "flight".into(), times: [first, last] }]
    }

    fn about(&self) -> Option<About> {
        self.about.clone()
    }

    fn own(&self) -> Vec<Column> {
        self.columns.clone()
    }

    fn at(&self, _phase: usize, time: f64) -> Instant {
        let (begin, end, part) = self.between(time);
        let own = begin[1..].iter().zip(&end[1..]).map(|(a, b)| a + part * (b - a)).collect();
        let point = self.about.is_some().then(|| self.point(begin, end, part));
        Instant { point, own }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-9;

    fn headers() -> Vec<String> {
        let of = |names: &[&str], unit: &str| names.iter().map(|n| header(n, unit)).collect::<Vec<_>>();
        [vec!["time_s".into()], of(&POSITION, "m"), of(&VELOCITY, "m/s"), of(&ATTITUDE, "-")].concat()
    }

    /// A fall is a polynomial of second degree, and an even turn an even turn.
    #[test]
    fn between_its_moments_a_record_is_a_cubic_and_an_even_turn() {
        let about = About {
            gravitational_parameter: 3.986e14,
            surface: apsides_dynamics::Ellipsoid::WGS84,
            axes: apsides_ephemeris::Axes::Fixed,
            loads: Vec::new(),
            site: None,
        };
        let row = |t: f64| {
            let (sin, cos) = (0.15 * t).sin_cos();
            vec![t, 6.4e6 - 4.9 * t * t, 7.0 * t, 3.0, -9.8 * t, 7.0, 0.0, cos, 0.0, sin, 0.0]
        };
        let rows = [row(0.0), row(2.0), row(4.0)];
        let headers = headers();
        let flight = RecordedFlight::new(&headers, &rows, Some((about, 12.0))).unwrap();
        assert_eq!(flight.spans()[0].times, [0.0, 4.0]);
        for t in [0.0, 0.7, 2.0, 3.1, 4.0] {
            let Instant { point, own } = flight.at(0, t);
            let (point, expected) = (point.unwrap(), row(t));
            for k in 0..3 {
                assert!((point.position[k] - expected[1 + k]).abs() < ROUNDING, "{t}");
                assert!((point.velocity[k] - expected[4 + k]).abs() < ROUNDING, "{t}");
            }
            let attitude = point.attitude.unwrap();
            assert!((0..4).all(|k| (attitude[k] - expected[7 + k]).abs() < ROUNDING), "{t}");
            assert!((own[1] - 7.0 * t).abs() < ROUNDING);
        }
    }

    #[test]
    fn records_that_are_none_are_refused() {
        let names = vec!["time_s".to_owned(), "x_m".to_owned()];
        let message = |rows: &[Vec<f64>]| match RecordedFlight::new(&names, rows, None) {
            Ok(_) => String::new(),
            Err(e) => e.to_string(),
        };
        assert!(message(&[]).contains("no rows"));
        assert!(message(&[vec![0.0]]).contains("truncated"));
        assert!(message(&[vec![1.0, 0.0], vec![1.0, 0.0]]).contains("must increase"));
        assert!(message(&[vec![1.0, f64::NAN]]).contains("finite"));
        let single = [vec![1.0, 2.0]];
        let flight = RecordedFlight::new(&names, &single, None).unwrap();
        assert_eq!(flight.at(0, 5.0).own, [2.0]);
    }
}
