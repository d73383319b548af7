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
    interval: [f64; 2],
    evaluations: usize,
    mut f: impl FnMut(f64) -> Result<f64, E>,
) -> Result<[f64; 2], E> {
    let mut bracket = Bracket::new(interval);
    for count in 0..evaluations.max(2) {
        let value = f(bracket.next)?;
        bracket.take(count, value);
    }
    Ok(bracket.best)
}

/// [`golden_section`] for many functions, each on an interval of its own: `f` gives the values of all at one abscissa each, in their order.
///
/// ```
/// let found = apsides_basis::golden_sections(&[[0.0, 3.0], [-2.0, 1.0]], 40, |x| {
///     vec![(x[0] - 1.0).powi(2) + 2.0, (x[1] + 1.0).powi(2)]
/// });
/// assert!((found[0][0] - 1.0).abs() < 1e-7 && (found[1][0] + 1.0).abs() < 1e-7);
/// ```
pub fn golden_sections(
    intervals: &[[f64; 2]],
    evaluations: usize,
    mut f: impl FnMut(&[f64]) -> Vec<f64>,
) -> Vec<[f64; 2]> {
    let mut brackets: Vec<Bracket> = intervals.iter().copied().map(Bracket::new).collect();
    for count in 0..evaluations.max(2) {
        let abscissae: Vec<f64> = brackets.iter().map(|b| b.next).collect();
        brackets.iter_mut().zip(f(&abscissae)).for_each(|(bracket, value)| bracket.take(count, value));
    }
    brackets.iter().map(|b| b.best).collect()
}

/// An interval with two points inside, each with its value.
struct Bracket {
    ends: [f64; 2],
    left: [f64; 2],
    right: [f64; 2],
    /// The abscissa at which the function is wanted next, and the side of it.
    next: f64,
    is_left: bool,
    /// The better one of the two points, once both have values.
    best: [f64; 2],
}

impl Bracket {
    fn new([a, b]: [f64; 2]) -> Self {
        let [left, right] = [b - RATIO * (b - a), a + RATIO * (b - a)];
        let none = f64::NAN;
        Self {
            ends: [a, b],
            left: [left, none],
            right: [right, none],
            next: left,
            is_left: true,
            best: [none; 2],
        }
    }

    /// Takes the value at the abscissa that was wanted, the `count`th one; the interval shrinks from the second on.
    fn take(&mut self, count: usize, value: f64) {
        if self.is_left {
            self.left[1] = value;
        } else {
            self.right[1] = value;
        }
        if count == 0 {
            (self.next, self.is_left) = (self.right[0], false);
            return;
        }
        self.is_left = self.left[1] <= self.right[1];
        let [a, b] = &mut self.ends;
        if self.is_left {
            (self.best, *b, self.right) = (self.left, self.right[0], self.left);
            self.left[0] = *b - RATIO * (*b - *a);
            self.next = self.left[0];
        } else {
            (self.best, *a, self.left) = (self.right, self.left[0], self.right);
            self.right[0] = *a + RATIO * (*b - *a);
            self.next = self.right[0];
        }
    }
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
    fn many_functions_are_searched_as_each_alone() {
        let f = |k: usize, t: f64| (t - 0.3 - 0.1 * k as f64).powi(2) + (5.0 * t).sin();
        let intervals = [[0.0, 1.0], [-3.0, 2.0], [0.5, 0.5]];
        for evaluations in [0, 2, 3, 24] {
            let all = golden_sections(&intervals, evaluations, |t| (0..3).map(|k| f(k, t[k])).collect());
            let alone: Vec<[f64; 2]> =
                (0..3).map(|k| golden_section(intervals[k], evaluations, |t| f(k, t))).collect();
            assert_eq!(all, alone);
        }
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
