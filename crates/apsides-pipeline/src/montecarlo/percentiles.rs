//! Percentiles, exact, in bounded memory: by passes over the values, each of which narrows where a rank is.
//!
//! A number is a key of 64 bits in the order of the numbers. Values are kept until they are too many; then they are counted by the next 16 bits
//! of their keys (a radix search). The next pass looks at those alone that have the bits of a wanted rank, so that four passes do for any
//! values, and two for a million of usual ones.

/// Values that are kept before they are counted.
const MOST_KEPT: usize = 1 << 16;
/// Bits of a key that are counted by.
const BITS: u32 = 16;
/// Bits of a key.
const KEY: u32 = u64::BITS;

/// The key of a number: keys are ordered as numbers are by `f64::total_cmp`.
fn key_of(v: f64) -> u64 {
    let bits = v.to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

fn number_of(key: u64) -> f64 {
    f64::from_bits(if key >> 63 == 1 { key & !(1 << 63) } else { !key })
}

/// Values whose keys begin with the same bits.
#[derive(Clone, Debug)]
struct Cell {
    /// Number of these bits.
    fixed: u32,
    prefix: u64,
    /// Number of smaller values.
    below: u64,
    content: Content,
}

#[derive(Clone, Debug)]
enum Content {
    Kept(Vec<u64>),
    Counted(Vec<u64>),
}

impl Cell {
    fn new(fixed: u32, prefix: u64, below: u64) -> Self {
        Self { fixed, prefix, below, content: Content::Kept(Vec::new()) }
    }

    fn holds(&self, key: u64) -> bool {
        // A shift by all bits is none.
        self.fixed == 0 || key >> (KEY - self.fixed) == self.prefix
    }

    fn part(&self, key: u64) -> usize {
        (key >> (KEY - self.fixed - BITS) & ((1 << BITS) - 1)) as usize
    }

    fn add(&mut self, key: u64) {
        let part = self.part(key);
        match &mut self.content {
            Content::Kept(kept) if kept.len() < MOST_KEPT => kept.push(key),
            Content::Counted(counts) => counts[part] += 1,
            Content::Kept(kept) => {
                let kept = std::mem::take(kept);
                let mut counts = vec![0; 1 << BITS];
                for key in kept.into_iter().chain([key]) {
                    counts[self.part(key)] += 1;
                }
                self.content = Content::Counted(counts);
            }
        }
    }

    /// The value of a rank, or the cell in which it is looked for next.
    fn find(&mut self, rank: u64) -> Result<f64, Self> {
        let mut within = rank - self.below;
        match &mut self.content {
            Content::Kept(kept) => {
                kept.sort_unstable();
                Ok(kept.get(within as usize).map_or(f64::NAN, |key| number_of(*key)))
            }
            Content::Counted(counts) => {
                let (fixed, mut below) = (self.fixed + BITS, self.below);
                for (part, count) in counts.iter().enumerate() {
                    if within < *count {
                        let prefix = if self.fixed == 0 { 0 } else { self.prefix << BITS } | part as u64;
                        return if fixed == KEY {
                            Ok(number_of(prefix))
                        } else {
                            Err(Self::new(fixed, prefix, below))
                        };
                    }
                    within -= count;
                    below += count;
                }
                Ok(f64::NAN)
            }
        }
    }
}

/// The search of values by their ranks. Values are added pass by pass, all of them in each, until nothing is open.
#[derive(Clone, Debug)]
pub(super) struct RankSearch {
    cells: Vec<Cell>,
    /// Ranks, counted from 0, with the values that were found.
    ranks: Vec<(u64, Option<f64>)>,
}

impl RankSearch {
    pub(super) fn new() -> Self {
        Self { cells: vec![Cell::new(0, 0, 0)], ranks: Vec::new() }
    }

    pub(super) fn add(&mut self, v: f64) {
        let key = key_of(v);
        if let Some(cell) = self.cells.iter_mut().find(|cell| cell.holds(key)) {
            cell.add(key);
        }
    }

    /// Ends the first pass: the ranks among the values that were added.
    pub(super) fn ask(&mut self, ranks: impl Iterator<Item = u64>) {
        self.ranks = ranks.map(|rank| (rank, None)).collect();
        self.narrow();
    }

    /// Ends a pass.
    pub(super) fn narrow(&mut self) {
        let mut next: Vec<Cell> = Vec::new();
        for (rank, found) in self.ranks.iter_mut().filter(|(_, found)| found.is_none()) {
            // Cells are apart: the last that begins at the rank or below has it.
            let cell = self.cells.iter_mut().filter(|cell| cell.below <= *rank).max_by_key(|cell| cell.below);
            match cell.map_or(Ok(f64::NAN), |cell| cell.find(*rank)) {
                Ok(value) => *found = Some(value),
                Err(cell) if next.iter().any(|c| c.prefix == cell.prefix && c.fixed == cell.fixed) => {}
                Err(cell) => next.push(cell),
            }
        }
        self.cells = next;
    }

    /// True while a further pass is needed.
    pub(super) fn is_open(&self) -> bool {
        !self.cells.is_empty()
    }

    /// The value at a part of `count` values, between neighbours by a straight line; none of no values.
    pub(super) fn percentile(&self, part: f64, count: u64) -> f64 {
        let [low, high] = ranks_of(part, count);
        let value = |rank: u64| self.ranks.iter().find(|(r, _)| *r == rank).and_then(|(_, found)| *found);
        match (value(low), value(high)) {
            (Some(a), Some(b)) => a + (place(part, count) - low as f64) * (b - a),
            _ => f64::NAN,
        }
    }
}

fn place(part: f64, count: u64) -> f64 {
    part * count.saturating_sub(1) as f64
}

/// The ranks between which a part of `count` values is.
pub(super) fn ranks_of(part: f64, count: u64) -> [u64; 2] {
    let place = place(part, count);
    [place.floor() as u64, place.ceil() as u64]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(values: &[f64], parts: &[f64]) -> (Vec<f64>, usize) {
        let mut search = RankSearch::new();
        values.iter().for_each(|v| search.add(*v));
        let count = values.len() as u64;
        search.ask(parts.iter().flat_map(|p| ranks_of(*p, count)).filter(|rank| *rank < count));
        let mut passes = 1;
        while search.is_open() {
            values.iter().for_each(|v| search.add(*v));
            search.narrow();
            passes += 1;
        }
        (parts.iter().map(|p| search.percentile(*p, count)).collect(), passes)
    }

    fn sorted(values: &[f64], part: f64) -> f64 {
        let mut values = values.to_vec();
        values.sort_by(f64::total_cmp);
        let place = part * (values.len() as f64 - 1.0);
        let (low, high) = (place.floor() as usize, place.ceil() as usize);
        values[low] + (place - low as f64) * (values[high] - values[low])
    }

    const PARTS: [f64; 5] = [0.0, 0.01, 0.5, 0.99, 1.0];

    #[test]
    fn few_values_take_one_pass() {
        let values: Vec<f64> = (0..=100).map(f64::from).collect();
        assert_eq!(found(&values, &[0.01, 0.5, 0.995]), (vec![1.0, 50.0, 99.5], 1));
        assert!(found(&[], &[0.5]).0[0].is_nan());
        assert_eq!(found(&[3.0], &PARTS).0, [3.0; 5]);
    }

    #[test]
    fn many_values_are_found_exactly() {
        let n = 3 * MOST_KEPT;
        let wave = |k: usize| ((k as f64 * 0.618_033_988_749).fract() - 0.5) * 10f64.powi((k % 7) as i32 - 3);
        let close = |k: usize| 1e6 + f64::from((k * 7919 % 1000) as u32) * 1e-9;
        for value in [&wave as &dyn Fn(usize) -> f64, &close] {
            let values: Vec<f64> = (0..n).map(value).collect();
            let (ours, passes) = found(&values, &PARTS);
            assert_eq!(ours, PARTS.map(|p| sorted(&values, p)));
            assert!((2..=4).contains(&passes), "{passes}");
        }
        // All alike: no pass can tell them apart.
        let (ours, passes) = found(&vec![-7.25; n], &PARTS);
        assert_eq!((ours, passes), (vec![-7.25; 5], 4));
        // Zeros of both signs, and numbers without measure.
        let edge: Vec<f64> = (0..n).map(|k| [0.0, -0.0, f64::MAX, -f64::MAX, 5e-324][k % 5]).collect();
        assert_eq!(found(&edge, &PARTS).0, PARTS.map(|p| sorted(&edge, p)));
    }
}
