//! A search for the flight time with a fixed number of solves, from a time nearby.

use crate::ConvexError;

/// Walks from a time by growing steps until the function rises, then takes vertices of parabolas; at most so many solves. Returns
/// the best time.
pub(crate) fn valley(
    start: f64,
    step: f64,
    [least, most]: [f64; 2],
    solves: usize,
    mut f: impl FnMut(f64) -> Result<f64, ConvexError>,
) -> Result<f64, ConvexError> {
    let start = start.clamp(least, most);
    let mut points = [(start, f(start)?); 3];
    let mut used = 1;
    let mut step = if start + step > most { -step } else { step };
    // points[1] is the best so far, points[0] and points[2] its neighbours.
    let trial = (start + step).clamp(least, most);
    points[2] = (trial, f(trial)?);
    used += 1;
    if points[2].1 > points[1].1 || (points[2].1.is_infinite() && step > 0.0) {
        step = -step;
        points[0] = points[2];
    } else {
        (points[0], points[1]) = (points[1], points[2]);
    }
    while used < solves {
        let trial = (points[1].0 + step).clamp(least, most);
        if trial == points[1].0 {
            return Ok(trial);
        }
        let value = f(trial)?;
        used += 1;
        points[2] = (trial, value);
        if value > points[1].1 {
            break;
        }
        (points[0], points[1]) = (points[1], points[2]);
        step *= 1.6;
    }
    while used < solves && points.iter().all(|p| p.1.is_finite()) {
        let [(a, fa), (b, fb), (c, fc)] = points;
        let (p, q) = ((b - a) * (fb - fc), (b - c) * (fb - fa));
        let t = b - 0.5 * ((b - a) * p - (b - c) * q) / (p - q);
        let width = (a - c).abs();
        if !(t.is_finite() && t > a.min(c) && t < a.max(c)) || (t - b).abs() < 1e-3 * width {
            break;
        }
        let value = f(t)?;
        used += 1;
        let beyond = (t - b) * (c - b) > 0.0;
        match (value <= fb, beyond) {
            (true, true) => points = [(b, fb), (t, value), (c, fc)],
            (true, false) => points = [(a, fa), (t, value), (b, fb)],
            (false, true) => points[2] = (t, value),
            (false, false) => points[0] = (t, value),
        }
    }
    Ok(points[1].0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_bottom_of_a_valley() {
        let f = |t: f64| if t > 9.0 { f64::INFINITY } else { (t - 3.0).powi(2) + 0.1 * (t - 3.0).abs() };
        for start in [1.5, 2.9, 3.0, 8.0] {
            let mut solves = 0;
            let best = valley(start, 0.3, [1.0, 20.0], 10, |t| {
                solves += 1;
                Ok(f(t))
            });
            assert!((best.unwrap() - 3.0).abs() < 0.1 && solves <= 10, "{start}");
        }
    }
}
