//! Pixels around a start, nearest rings first.

/// Pixels of a map of `rows` x `cols` along the clockwise square spiral from `start`, row and column: 1 step east, 1 south, 2 west,
/// 2 north, 3 east and so on. What is outside the map is left out.
pub fn spiral(start: [usize; 2], rows: usize, cols: usize) -> impl Iterator<Item = [usize; 2]> {
    const STEPS: [[i64; 2]; 4] = [[0, 1], [1, 0], [0, -1], [-1, 0]];
    let start = start.map(|k| k as i64);
    let last_leg = 4 * rows.max(cols) + 4;
    let mut at = start;
    let legs = (0..last_leg).flat_map(move |leg| {
        let [south, east] = STEPS[leg % 4];
        let from = at;
        let length = (leg / 2 + 1) as i64;
        at = [from[0] + south * length, from[1] + east * length];
        (1..=length).map(move |k| [from[0] + south * k, from[1] + east * k])
    });
    std::iter::once(start).chain(legs).filter_map(move |[row, col]| {
        let inside = row >= 0 && col >= 0 && row < rows as i64 && col < cols as i64;
        inside.then_some([row as usize, col as usize])
    })
}

/// Place of a pixel on the spiral, 0 at the start, those outside the map included.
pub(super) fn place(start: [usize; 2], pixel: [usize; 2]) -> u64 {
    let [row, col] = [0, 1].map(|k| pixel[k] as i64 - start[k] as i64);
    let ring = row.abs().max(col.abs());
    if ring == 0 {
        return 0;
    }
    let along = if col == ring && row > -ring {
        row + ring - 1
    } else if row == ring {
        3 * ring - 1 - col
    } else if col == -ring {
        5 * ring - 1 - row
    } else {
        7 * ring - 1 + col
    };
    ((2 * ring - 1) * (2 * ring - 1) + along) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn legs_turn_clockwise() {
        let found: Vec<_> = spiral([5, 5], 100, 100).take(11).collect();
        let expected =
            [[5, 5], [5, 6], [6, 6], [6, 5], [6, 4], [5, 4], [4, 4], [4, 5], [4, 6], [4, 7], [5, 7]];
        assert_eq!(found, expected);
        for (k, pixel) in spiral([60, 70], 200, 200).take(10_000).enumerate() {
            assert_eq!(place([60, 70], pixel), k as u64);
        }
    }

    #[test]
    fn every_pixel_comes_once() {
        for start in [[0, 0], [2, 3], [6, 0], [3, 10]] {
            let mut pixels: Vec<_> = spiral(start, 7, 11).collect();
            pixels.sort_unstable();
            assert_eq!(pixels, (0..77).map(|k| [k / 11, k % 11]).collect::<Vec<_>>());
        }
    }
}
