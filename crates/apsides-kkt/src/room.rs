//! Places in an array that are used again: first fit among those that are free.

/// The places of an array.
#[derive(Debug, Default)]
pub(crate) struct Room {
    length: usize,
    /// Free places (start, end), ascending and apart from each other.
    free: Vec<(usize, usize)>,
}

impl Room {
    /// Length of the array.
    pub(crate) fn length(&self) -> usize {
        self.length
    }

    /// Takes so much room and answers where it begins.
    pub(crate) fn take(&mut self, size: usize) -> usize {
        if let Some(k) = self.free.iter().position(|&(begin, end)| end - begin >= size) {
            let begin = self.free[k].0;
            self.free[k].0 += size;
            if self.free[k].0 == self.free[k].1 {
                self.free.remove(k);
            }
            return begin;
        }
        // The free place at the end grows.
        let length = self.length;
        let begin = self.free.pop_if(|place| place.1 == length).map_or(length, |place| place.0);
        self.length = begin + size;
        begin
    }

    /// Gives room back, which joins the free places beside it.
    pub(crate) fn give_back(&mut self, mut begin: usize, size: usize) {
        if size == 0 {
            return;
        }
        let mut end = begin + size;
        let mut k = self.free.partition_point(|place| place.0 < begin);
        if k < self.free.len() && self.free[k].0 == end {
            end = self.free.remove(k).1;
        }
        if k > 0 && self.free[k - 1].1 == begin {
            k -= 1;
            begin = self.free.remove(k).0;
        }
        self.free.insert(k, (begin, end));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn room_that_was_given_back_is_used_again() {
        let mut room = Room::default();
        let places = [3, 4, 5].map(|size| room.take(size));
        assert_eq!((places, room.length()), ([0, 3, 7], 12));
        room.give_back(places[0], 3);
        room.give_back(places[1], 4);
        // Both together hold six, and one is left beside what is free at the end.
        assert_eq!((room.take(6), room.length()), (0, 12));
        room.give_back(places[2], 5);
        assert_eq!((room.take(8), room.length()), (6, 14));
        assert_eq!(room.take(0), 14);
    }
}
