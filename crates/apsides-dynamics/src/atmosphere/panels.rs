//! Functions of the altitude in pieces that are found by direct index.

/// Pieces of equal width in each of `N` ranges of the altitude that join.
pub(super) struct Panels<T, const N: usize> {
    ranges: [Range; N],
    panels: Vec<T>,
}

/// A range: its lower end, m, panels per metre, number of the first.
struct Range {
    from: f64,
    per_metre: f64,
    first: u32,
}

impl<T, const N: usize> Panels<T, N> {
    /// From one end of a range to the next (m), with the greatest width of a panel in each range; `panel` makes that of a range and an interval.
    pub(super) fn new(
        ends: impl Fn(usize) -> f64,
        widest: [f64; N],
        panel: impl Fn(usize, [f64; 2]) -> T,
    ) -> Self {
        let mut panels = Vec::new();
        let ranges = std::array::from_fn(|k| {
            let (from, to) = (ends(k), ends(k + 1));
            let first = panels.len() as u32;
            let count = ((to - from) / widest[k]).ceil();
            let width = (to - from) / count;
            let knot = |i: usize| from + i as f64 * width;
            // One more than the range needs: rounding may count one at its end.
            panels.extend((0..=count as usize).map(|i| panel(k, [knot(i), knot(i + 1)])));
            Range { from, per_metre: 1.0 / width, first }
        });
        Self { ranges, panels }
    }

    /// The panel of an altitude (m) in one of the ranges.
    #[inline(always)]
    pub(super) fn at(&self, altitude: f64) -> &T {
        // By branches, which processors foresee along a flight.
        let range = self.ranges[1..].iter().take_while(|range| range.from <= altitude).count();
        let Range { from, per_metre, first } = self.ranges[range];
        &self.panels[(first + ((altitude - from) * per_metre) as u32) as usize]
    }
}
