//! The recurrences in lanes: up to four values of one rule at once.

use super::lowering::Start;
use crate::formula::Unary;

/// The rules that are convolutions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum Kind {
    Square,
    Product,
    Quotient,
    Power,
    Integral,
}

/// One value of a rule: its place, those of its operands (of an integral the second is its slope), exponent and start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    pub(super) out: usize,
    pub(super) first: usize,
    pub(super) second: usize,
    pub(super) exponent: f64,
    pub(super) start: Start,
    /// A fixed factor of the start.
    pub(super) by: Option<usize>,
}

/// Orders that there is room for; a power of two. The highest are never used.
pub(super) const ROOM: usize = 32;

/// `W` values of one rule, with the histories of what they are made of.
///
/// A coefficient that becomes known is multiplied at once with all earlier ones that it meets in a sum, and the products are added to the
/// sums of later orders: these additions wait for nothing, and the sum that is due lacks the terms of the newest coefficients alone.
#[derive(Clone, Debug)]
pub(super) struct Lanes<const W: usize> {
    kind: Kind,
    /// Orders from this one on are not needed.
    orders: usize,
    out: [usize; W],
    first: [usize; W],
    second: [usize; W],
    exponent: [f64; W],
    start: [Start; W],
    by: [Option<usize>; W],
    /// Sums of the orders to come.
    sums: History<W>,
    /// Coefficients of the operands, or of one and the result; up to three numbers after those that are known are zero.
    a: History<W>,
    b: History<W>,
    /// The same times their orders, for powers.
    moments: [History<W>; 2],
    /// Reciprocals of coefficients of order zero.
    inverse: [f64; W],
}

/// A number of each lane for each order.
type History<const W: usize> = Box<[[f64; W]; ROOM]>;

impl<const W: usize> Lanes<W> {
    /// Lanes without an item repeat the last one.
    pub(super) fn new(kind: Kind, items: &[Item], orders: usize) -> Self {
        let item = |l: usize| items[l.min(items.len() - 1)];
        let room = || Box::new([[0.0; W]; ROOM]);
        Self {
            kind,
            orders,
            out: std::array::from_fn(|l| item(l).out),
            first: std::array::from_fn(|l| item(l).first),
            second: std::array::from_fn(|l| item(l).second),
            exponent: std::array::from_fn(|l| item(l).exponent),
            start: std::array::from_fn(|l| item(l).start),
            by: std::array::from_fn(|l| item(l).by),
            sums: room(),
            a: room(),
            b: room(),
            moments: [room(), room()],
            inverse: [0.0; W],
        }
    }

    /// Coefficients of order `k` in `row`, given those of the order before in `before`.
    #[inline(always)]
    pub(super) fn advance(&mut self, k: usize, reciprocal: f64, before: &[f64], row: &mut [f64]) {
        if k == 0 {
            self.begin(row);
            return;
        }
        let (k, order) = (k % ROOM, k as f64);
        let first: [f64; W] = self.first.map(|v| row[v]);
        // What is multiplied by the newest coefficient first: nothing of it has to wait.
        let found: [f64; W] = match self.kind {
            Kind::Square => {
                let (zeroth, sum) = (self.a[0], self.sums[k]);
                let found = std::array::from_fn(|l| sum[l] + first[l] * (2.0 * zeroth[l]));
                self.meet_itself(k, &first);
                found
            }
            Kind::Product => {
                let second: [f64; W] = self.second.map(|v| row[v]);
                let (a, b, sum) = (self.a[0], self.b[0], self.sums[k]);
                let found = std::array::from_fn(|l| sum[l] + (first[l] * b[l] + a[l] * second[l]));
                self.meet(k, &first, &second);
                found
            }
            Kind::Quotient => {
                let by: [f64; W] = self.second.map(|v| row[v]);
                let (zeroth, sum) = (self.b[0], self.sums[k]);
                let found: [f64; W] =
                    std::array::from_fn(|l| (first[l] - (sum[l] + by[l] * zeroth[l])) * self.inverse[l]);
                self.meet(k, &by, &found);
                found
            }
            Kind::Power => {
                let (zeroth, sum) = (self.b[0], self.sums[k]);
                let found: [f64; W] = std::array::from_fn(|l| {
                    let newest = first[l] * (order * self.exponent[l] * zeroth[l]);
                    (sum[l] + newest) * (reciprocal * self.inverse[l])
                });
                self.meet_weighted(k, order, &first, &found);
                found
            }
            Kind::Integral => {
                let moment: [f64; W] = first.map(|v| v * order);
                let slope: [f64; W] = self.second.map(|v| before[v]);
                if k == 1 {
                    keep(&mut self.a, 0, &moment);
                    keep(&mut self.b, 0, &slope);
                    std::array::from_fn(|l| moment[l] * slope[l])
                } else {
                    let (a, b, sum) = (self.a[0], self.b[0], self.sums[k - 1]);
                    let found = std::array::from_fn(|l| {
                        ((sum[l] + a[l] * slope[l]) + first[l] * (order * b[l])) * reciprocal
                    });
                    self.meet(k - 1, &moment, &slope);
                    found
                }
            }
        };
        for l in 0..W {
            row[self.out[l]] = found[l];
        }
    }

    /// Coefficients of order zero.
    #[inline(never)]
    fn begin(&mut self, row: &mut [f64]) {
        self.sums[..self.orders].fill([0.0; W]);
        let (first, second) = (self.first.map(|v| row[v]), self.second);
        let found: [f64; W] = match self.kind {
            Kind::Square => {
                keep(&mut self.a, 0, &first);
                first.map(|v| v * v)
            }
            Kind::Product => {
                let second = second.map(|v| row[v]);
                keep(&mut self.a, 0, &first);
                keep(&mut self.b, 0, &second);
                std::array::from_fn(|l| first[l] * second[l])
            }
            Kind::Quotient => {
                let by = second.map(|v| row[v]);
                self.inverse = by.map(f64::recip);
                keep(&mut self.a, 0, &by);
                keep(&mut self.b, 0, &std::array::from_fn(|l| first[l] / by[l]));
                self.b[0]
            }
            Kind::Power => {
                self.inverse = first.map(f64::recip);
                let start = self.started(&first, row);
                keep(&mut self.a, 0, &first);
                keep(&mut self.b, 0, &start);
                self.moments.iter_mut().for_each(|m| keep(m, 0, &[0.0; W]));
                start
            }
            Kind::Integral => self.started(&first, row),
        };
        for l in 0..W {
            row[self.out[l]] = found[l];
        }
    }

    fn started(&self, first: &[f64; W], row: &[f64]) -> [f64; W] {
        std::array::from_fn(|l| {
            let start = match self.start[l] {
                Start::Unary(Unary::Sqrt) => first[l].sqrt(),
                Start::Unary(f) => f.apply(first[l]),
                Start::Powf(c) => first[l].powf(c),
                Start::Atan2(x) => first[l].atan2(row[x]),
                Start::Zero => 0.0,
            };
            self.by[l].map_or(start, |by| start * row[by])
        })
    }

    /// The numbers of each part, in lanes of four, that belong to the products of a coefficient of order `k` with earlier ones from order one
    /// on, as far as their sums are needed. Up to three more are zero in the parts.
    #[inline(always)]
    fn later(&self, k: usize) -> usize {
        let orders = (k - 1).min((self.orders - 1).saturating_sub(k));
        (orders * W).div_ceil(4) * 4
    }

    /// Adds the products of the coefficients of order `k` with those of orders from one on to the sums of later orders, and keeps them.
    #[inline(always)]
    fn meet(&mut self, k: usize, first: &[f64; W], second: &[f64; W]) {
        let n = self.later(k);
        let (a, b) = (part(&self.a, 1, n), part(&self.b, 1, n));
        let (first4, second4) = (four(first), four(second));
        for (sum, (a, b)) in part_mut(&mut self.sums, k + 1, n).iter_mut().zip(a.iter().zip(b)) {
            for l in 0..4 {
                sum[l] += first4[l] * b[l] + a[l] * second4[l];
            }
        }
        keep(&mut self.a, k, first);
        keep(&mut self.b, k, second);
        self.meet_own(k, first, second);
    }

    /// The same for squares.
    #[inline(always)]
    fn meet_itself(&mut self, k: usize, first: &[f64; W]) {
        let n = self.later(k);
        let twice = four(&first.map(|v| 2.0 * v));
        for (sum, a) in part_mut(&mut self.sums, k + 1, n).iter_mut().zip(part(&self.a, 1, n)) {
            for l in 0..4 {
                sum[l] += twice[l] * a[l];
            }
        }
        keep(&mut self.a, k, first);
        self.meet_own(k, first, first);
    }

    /// The same for the power `b` of `a`, where the product of `a[j]` and `b[i]` has the weight `c j - i`.
    #[inline(always)]
    fn meet_weighted(&mut self, k: usize, order: f64, first: &[f64; W], found: &[f64; W]) {
        let n = self.later(k);
        let ahead: [f64; W] = std::array::from_fn(|l| order * self.exponent[l] * first[l]);
        let by: [f64; W] = std::array::from_fn(|l| self.exponent[l] * found[l]);
        let moment = found.map(|v| order * v);
        let [of_a, of_b] = &self.moments;
        let of_a = part(&self.a, 1, n).iter().zip(part(of_a, 1, n));
        let of_b = part(&self.b, 1, n).iter().zip(part(of_b, 1, n));
        let (first4, ahead4, by4, moment4) = (four(first), four(&ahead), four(&by), four(&moment));
        let sums = part_mut(&mut self.sums, k + 1, n).iter_mut();
        for (sum, ((a, am), (b, bm))) in sums.zip(of_a.zip(of_b)) {
            for l in 0..4 {
                sum[l] += (ahead4[l] * b[l] - first4[l] * bm[l]) + (by4[l] * am[l] - moment4[l] * a[l]);
            }
        }
        keep(&mut self.a, k, first);
        keep(&mut self.b, k, found);
        keep(&mut self.moments[0], k, &first.map(|v| order * v));
        keep(&mut self.moments[1], k, &moment);
        self.meet_own(k, &std::array::from_fn(|l| ahead[l] - order * first[l]), found);
    }

    /// Adds the product of two coefficients of order `k` to the sum of twice the order.
    #[inline(always)]
    fn meet_own(&mut self, k: usize, a: &[f64; W], b: &[f64; W]) {
        if 2 * k < self.orders {
            let sum = &mut self.sums[2 * k];
            for l in 0..W {
                sum[l] += a[l] * b[l];
            }
        }
    }
}

/// Keeps the coefficients of an order, with zeros behind up to four numbers.
#[inline(always)]
fn keep<const W: usize>(row: &mut [[f64; W]; ROOM], k: usize, coefficients: &[f64; W]) {
    let four: [f64; 4] = std::array::from_fn(|l| if l < W { coefficients[l] } else { 0.0 });
    row.as_flattened_mut()[k * W..k * W + 4].copy_from_slice(&four);
}

/// The numbers of a part from an order on, `n` of them, by four.
#[inline(always)]
fn part<const W: usize>(row: &[[f64; W]; ROOM], order: usize, n: usize) -> &[[f64; 4]] {
    row.as_flattened()[order * W..order * W + n].as_chunks().0
}

#[inline(always)]
fn part_mut<const W: usize>(row: &mut [[f64; W]; ROOM], order: usize, n: usize) -> &mut [[f64; 4]] {
    row.as_flattened_mut()[order * W..order * W + n].as_chunks_mut().0
}

/// The numbers of the lanes, repeated.
#[inline(always)]
fn four<const W: usize>(lanes: &[f64; W]) -> [f64; 4] {
    std::array::from_fn(|l| lanes[l % W])
}
