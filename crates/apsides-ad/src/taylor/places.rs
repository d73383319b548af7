//! Values of one order by their places.

/// Values that are computed at once.
pub(super) const WIDTH: usize = 4;
/// Values of one order that fit into a row whose places need no check.
pub(super) const SMALL: usize = 256;

/// Values of one order.
pub(super) trait Places {
    fn at(&self, place: u32) -> f64;
    fn put(&mut self, place: u32, value: f64);
    /// Puts values at places from four times this one on.
    fn put_all(&mut self, fourth: usize, values: [f64; WIDTH]);
    /// Copies the first values, a multiple of four.
    fn copy_to(&self, values: &mut [f64]);
}

impl Places for [f64] {
    #[inline(always)]
    fn at(&self, place: u32) -> f64 {
        self[place as usize]
    }

    #[inline(always)]
    fn put(&mut self, place: u32, value: f64) {
        self[place as usize] = value;
    }

    #[inline(always)]
    fn put_all(&mut self, fourth: usize, values: [f64; WIDTH]) {
        self.as_chunks_mut().0[fourth] = values;
    }

    #[inline(always)]
    fn copy_to(&self, values: &mut [f64]) {
        for (to, from) in values.as_chunks_mut::<WIDTH>().0.iter_mut().zip(self.as_chunks().0) {
            *to = *from;
        }
    }
}

impl Places for [f64; SMALL] {
    #[inline(always)]
    fn at(&self, place: u32) -> f64 {
        self[place as usize % SMALL]
    }

    #[inline(always)]
    fn put(&mut self, place: u32, value: f64) {
        self[place as usize % SMALL] = value;
    }

    #[inline(always)]
    fn put_all(&mut self, fourth: usize, values: [f64; WIDTH]) {
        self.as_chunks_mut().0[fourth % (SMALL / WIDTH)] = values;
    }

    #[inline(always)]
    fn copy_to(&self, values: &mut [f64]) {
        for (to, from) in values.as_chunks_mut::<WIDTH>().0.iter_mut().zip(self.as_chunks().0) {
            *to = *from;
        }
    }
}
