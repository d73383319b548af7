//! The minimum of a function of one variable by golden section (J. Kiefer, *Proc. AMS* 4 (1953) 502, doi 10.2307/2032161).

use std::convert::Infallible;

/// Each evaluation shrinks the interval to this part: `(sqrt(5) - 1) / 2`.
const RATIO: f64 = 0.618_033_988_749_894_9;

/// The best point found within an interval and the value there, as `[x, f(x)]`, for a function with one minimum there.
///
/// Each of the `evaluations` beyond the second shrinks the interval to 0.618 of its length; at least two are made. An infinite
/// value is moved away from, and of two equal values the search goes on around the lower point.
///
/// ```
/// let [x, value] = apsides_basis::golden_section([0.0, 3.0], 40, |x| (x - 1.0).powi(2) + 2.0);
/// assert!((x - 1.0).abs() < 1e-7 && value - 2.0 < 1e-14);
/// ```
pub fn golden_section(interval: [f64; 2], evaluations: usize, mut f: impl FnMut(f64) -> f64) -> [f64; 2] {
    let Ok(found) = try_golden_section::<Infallible>(interval, evaluations, |x| Ok(f(x)));
    found
}

/// [`golden_section`] for a function that may fail.
///
/// # Errors
/// The first error of the function.
pub fn try_golden_section<E>(
    [mut a, mut b]: [f64; 2],
    evaluations: usize,
    mut f: impl FnMut(f64) -> Result<f64, E>,
) -> Result<[f64; 2], E> {
    let (mut left, mut right) = (b - RATIO * (b - a), a + RATIO * (b - a));
    let (mut at_left, mut at_right) = (f(left)?, f(right)?);
    for _ in 2..evaluations {
        if at_left <= at_right {
            (b, right, at_right) = (right, left, at_left);
            left = b - RATIO * (b - a);
            at_left = f(left)?;
        } else {
            (a, left, at_left) = (left, right, at_right);
            right = a + RATIO * (b - a);
            at_right = f(right)?;
        }
    }
    Ok(if at_left <= at_right { [left, at_left] } else { [right, at_right] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_bottom_of_a_valley_beside_infinite_values() {
        let f = |t: f64| if t > 9.0 { f64::INFINITY } else { (t - 3.0).powi(2) + 0.1 * (t - 3.0).abs() };
        let mut evaluations = 0;
        let [t, value] = golden_section([1.0, 20.0], 24, |t| {
            evaluations += 1;
            f(t)
        });
        assert!((t - 3.0).abs() < 19.0 * RATIO.powi(22) && evaluations == 24);
        assert_eq!(value, f(t));
    }

    #[test]
    fn an_error_ends_the_search() {
        let mut evaluations = 0;
        let found = try_golden_section([0.0, 1.0], 10, |t| {
            evaluations += 1;
            if evaluations < 4 { Ok(t) } else { Err(evaluations) }
        });
        assert_eq!(found, Err(4));
    }
}
