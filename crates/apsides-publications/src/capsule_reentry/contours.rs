//! Contour lines of functions of two variables by marching squares.

use std::collections::BTreeMap;

/// Lines of one level over the square `[-size, size]^2`, from values at the corners of `cells` times `cells` squares, straight within each: lines one
/// after the other, with a point that is not a number between them.
pub(super) fn contour(f: impl Fn([f64; 2]) -> f64, size: f64, cells: usize, level: f64) -> Vec<[f64; 2]> {
    let at = |k: usize| size * (2.0 * k as f64 / cells as f64 - 1.0);
    let values: Vec<Vec<f64>> =
        (0..=cells).map(|j| (0..=cells).map(|i| f([at(i), at(j)]) - level).collect()).collect();
    // An edge starts at a corner, along x or along y.
    let point = |(i, j, along_y): Edge| {
        let (next_i, next_j) = if along_y { (i, j + 1) } else { (i + 1, j) };
        let (a, b) = (values[j][i], values[next_j][next_i]);
        let part = a / (a - b);
        [at(i) + part * (at(next_i) - at(i)), at(j) + part * (at(next_j) - at(j))]
    };
    let mut pieces = Vec::new();
    for j in 0..cells {
        for i in 0..cells {
            pieces.extend(
                crossed([values[j][i], values[j][i + 1], values[j + 1][i + 1], values[j + 1][i]]).map(
                    |side| match side {
                        0 => (i, j, false),
                        1 => (i + 1, j, true),
                        2 => (i, j + 1, false),
                        _ => (i, j, true),
                    },
                ),
            );
        }
    }
    let mut line = Vec::new();
    for edges in joined(&pieces) {
        if !line.is_empty() {
            line.push([f64::NAN; 2]);
        }
        line.extend(edges.into_iter().map(point));
    }
    line
}

type Edge = (usize, usize, bool);

/// Sides of a square that a level of zero crosses, in pairs that belong together: below, right, above, left of corners that are numbered from the
/// lower left one on, counter-clockwise.
fn crossed(corners: [f64; 4]) -> impl Iterator<Item = usize> {
    let above = corners.map(|v| v >= 0.0);
    let sides: Vec<usize> = (0..4).filter(|k| above[*k] != above[(k + 1) % 4]).collect();
    // A saddle: the middle tells which corners are joined.
    let turned = sides.len() == 4 && (corners.iter().sum::<f64>() >= 0.0) == above[0];
    let order: Vec<usize> = match (sides.len(), turned) {
        (4, true) => vec![0, 1, 2, 3],
        (4, false) => vec![3, 0, 1, 2],
        _ => sides,
    };
    order.into_iter()
}

/// Edges in the order of lines, from pairs of edges that a square joins.
fn joined(pieces: &[Edge]) -> Vec<Vec<Edge>> {
    let mut of_edge: BTreeMap<Edge, Vec<usize>> = BTreeMap::new();
    for (k, pair) in pieces.chunks_exact(2).enumerate() {
        pair.iter().for_each(|edge| of_edge.entry(*edge).or_default().push(k));
    }
    let mut used = vec![false; pieces.len() / 2];
    let mut lines = Vec::new();
    // Lines that end at the border first, from there; what is left are rings.
    let border = of_edge.values().filter(|of| of.len() == 1).map(|of| of[0]);
    for first in border.chain(0..used.len()) {
        if used[first] {
            continue;
        }
        let (mut k, [mut from, mut to]) = (first, [pieces[2 * first], pieces[2 * first + 1]]);
        if of_edge.get(&to).is_some_and(|of| of.len() == 1) {
            (from, to) = (to, from);
        }
        let mut line = vec![from, to];
        loop {
            used[k] = true;
            let Some(next) = of_edge.get(&to).and_then(|of| of.iter().find(|n| !used[**n])) else { break };
            k = *next;
            let [a, b] = [pieces[2 * k], pieces[2 * k + 1]];
            to = if a == to { b } else { a };
            line.push(to);
        }
        lines.push(line);
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Straight lines across cells of a hundredth: what a circle bends within one.
    const WITHIN_A_CELL: f64 = 2e-4;

    /// A circle is one ring, a pair of branches of a hyperbola two lines that end at the border, a level that is not met nothing.
    #[test]
    fn a_circle_a_hyperbola_and_nothing() {
        let circle = contour(|[x, y]| x * x + y * y, 1.0, 100, 0.49);
        assert!(circle.iter().all(|[x, y]| (x.hypot(*y) - 0.7).abs() < WITHIN_A_CELL));
        assert_eq!(circle.first(), circle.last());
        let length: f64 = circle.windows(2).map(|w| (w[0][0] - w[1][0]).hypot(w[0][1] - w[1][1])).sum();
        assert!((length / (1.4 * std::f64::consts::PI) - 1.0).abs() < WITHIN_A_CELL, "{length}");
        let branches = contour(|[x, y]| x * y, 1.0, 100, 0.1);
        assert_eq!(branches.iter().filter(|p| p[0].is_nan()).count(), 1);
        let ends = [branches[0], branches[branches.len() - 1]];
        assert!(ends.iter().all(|[x, y]| (x.abs().max(y.abs()) - 1.0).abs() < WITHIN_A_CELL), "{ends:?}");
        assert!(contour(|[x, y]| x + y, 1.0, 100, 3.0).is_empty());
        // A saddle between the corners: both lines, and no crossing.
        assert_eq!(contour(|[x, y]| x * y, 1.0, 1, 0.1).iter().filter(|p| p[0].is_nan()).count(), 1);
    }
}
