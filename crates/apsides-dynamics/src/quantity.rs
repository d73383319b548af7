//! Names and units of states and controls: labels of figures and headers of files come from here.

/// A named quantity with its SI unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quantity {
    /// Name in the field's words.
    pub name: &'static str,
    /// SI unit, `-` for none.
    pub unit: &'static str,
}

impl Quantity {
    /// A name with a unit.
    #[must_use]
    pub const fn new(name: &'static str, unit: &'static str) -> Self {
        Self { name, unit }
    }

    /// Place of the quantity among others, such as the states of a model; meant for constants, so that a quantity that is not among them is
    /// an error of the build.
    #[must_use]
    #[expect(clippy::panic, reason = "an error of the build")]
    pub const fn index_in(self, all: &[Self]) -> usize {
        match self.position_in(all) {
            Some(place) => place,
            None => panic!("the quantity is not among them"),
        }
    }

    /// Place of the quantity, by its name, among others; none where it is not among them, as the inclination in the plane.
    #[must_use]
    pub const fn position_in(self, all: &[Self]) -> Option<usize> {
        let mut k = 0;
        while k < all.len() {
            if same(all[k].name.as_bytes(), self.name.as_bytes()) {
                return Some(k);
            }
            k += 1;
        }
        None
    }
}

const fn same(a: &[u8], b: &[u8]) -> bool {
    let mut k = 0;
    while k < a.len() && k < b.len() && a[k] == b[k] {
        k += 1;
    }
    k == a.len() && k == b.len()
}

#[cfg(test)]
mod tests {
    use crate::planar::{MASS, POLAR_ANGLE, RADIAL_SPEED, STATES, VERTICAL_STATES};

    #[test]
    fn quantities_have_their_places() {
        const SPEED: usize = RADIAL_SPEED.index_in(&STATES);
        assert_eq!([SPEED, MASS.index_in(&STATES)], [3, 4]);
        assert_eq!(MASS.position_in(&VERTICAL_STATES), Some(2));
        assert_eq!(POLAR_ANGLE.position_in(&VERTICAL_STATES), None);
    }
}
