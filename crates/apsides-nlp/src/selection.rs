//! Kept entries of a vector, in runs of neighbours: whole slices are treated at once, without an index for each entry.

use std::ops::Range;

use crate::vector::in_vectors;

/// Some entries of a vector, ascending or not, by their positions there.
#[derive(Debug, Clone, Default)]
pub(crate) struct Selection {
    runs: Vec<Run>,
}

/// Neighbours that are kept side by side.
#[derive(Debug, Clone)]
struct Run {
    /// Position of the first in the whole vector, and among what is kept.
    whole: usize,
    kept: usize,
    length: usize,
}

impl Selection {
    /// The entries at these positions.
    pub(crate) fn of(positions: &[usize]) -> Self {
        let mut selection = Self::default();
        positions.iter().for_each(|&position| selection.push(position));
        selection
    }

    /// The entries whose marks are true.
    pub(crate) fn of_those(are_kept: impl Iterator<Item = bool>) -> Self {
        let mut selection = Self::default();
        let (mut kept, mut begin, mut before) = (0, 0, false);
        for (position, is_kept) in are_kept.chain([false]).enumerate() {
            if is_kept == before {
                continue;
            }
            if before {
                let length = position - begin;
                selection.runs.push(Run { whole: begin, kept, length });
                kept += length;
            }
            (begin, before) = (position, is_kept);
        }
        selection
    }

    /// Keeps one more entry.
    fn push(&mut self, position: usize) {
        let kept = match self.runs.last_mut() {
            Some(last) if last.whole + last.length == position => {
                last.length += 1;
                return;
            }
            Some(last) => last.kept + last.length,
            None => 0,
        };
        self.runs.push(Run { whole: position, kept, length: 1 });
    }

    /// Ranges of what is kept, each with that in the whole vector.
    pub(crate) fn runs(&self) -> impl Iterator<Item = (Range<usize>, Range<usize>)> {
        self.runs.iter().map(|&Run { whole, kept, length }| (kept..kept + length, whole..whole + length))
    }

    /// Writes the kept entries of a vector, each times its factor.
    pub(crate) fn scale(&self, whole: &[f64], factors: &[f64], target: &mut [f64]) {
        in_vectors(|| {
            for (kept, from) in self.runs() {
                let factors = &factors[kept.clone()];
                for ((target, value), factor) in target[kept].iter_mut().zip(&whole[from]).zip(factors) {
                    *target = value * factor;
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_cover_what_is_kept_in_its_order() {
        for positions in [vec![], vec![0, 1, 2], vec![1, 2, 4, 5, 7], vec![3, 2, 0, 1], vec![6]] {
            let selection = Selection::of(&positions);
            let whole: Vec<f64> = (0..8_u8).map(f64::from).collect();
            let factors: Vec<f64> = (0..positions.len()).map(|k| 2.0 + k as f64).collect();
            let mut kept = vec![f64::NAN; positions.len()];
            selection.scale(&whole, &factors, &mut kept);
            let expected: Vec<f64> = positions.iter().zip(&factors).map(|(&i, f)| whole[i] * f).collect();
            assert_eq!(kept, expected, "{positions:?}");
        }
        assert_eq!(Selection::of(&[1, 2, 4, 5, 7]).runs().count(), 3);
    }

    #[test]
    fn marks_and_positions_keep_the_same() {
        for marks in
            [&[][..], &[false], &[true], &[true, true, false, true], &[false, true, true, false, false, true]]
        {
            let positions: Vec<usize> = (0..marks.len()).filter(|&k| marks[k]).collect();
            let of_marks: Vec<_> = Selection::of_those(marks.iter().copied()).runs().collect();
            assert_eq!(of_marks, Selection::of(&positions).runs().collect::<Vec<_>>());
        }
    }
}
