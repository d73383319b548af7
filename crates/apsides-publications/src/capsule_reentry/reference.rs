//! Solutions of another program for the same models: collocation with Ipopt on 40 to 300 elements, flown again, and its own searches.

const NONE: f64 = f64::INFINITY;

/// Limits and the optimum under them.
#[derive(Clone, Copy)]
pub(super) struct ReferenceRow {
    /// Dynamic pressure (kPa), acceleration (m/s2), heat rate (kW/m2).
    pub(super) limits: [f64; 3],
    /// MJ/m2.
    pub(super) heat_load: f64,
    /// s.
    pub(super) flight_time: f64,
    /// True for each limit that is active.
    pub(super) active: [bool; 3],
}

const fn row(limits: [f64; 3], heat_load: f64, flight_time: f64, active: [bool; 3]) -> ReferenceRow {
    ReferenceRow { limits, heat_load, flight_time, active }
}

/// Heat load without limits and with those of the paper on the finest mesh of the reference, and its error; MJ/m2.
pub(super) struct Fine {
    pub(super) none: [f64; 2],
    pub(super) base: [f64; 2],
}

/// The limits of the paper: 15 kPa, 40 m/s2, 800 kW/m2.
pub(super) const BASE: [f64; 3] = [15.0, 40.0, 800.0];

/// Model E on finer meshes of the reference's program than those of the tables (120 and 240 intervals of 4 points), MJ/m2.
pub(super) const FINER_E: [([f64; 3], f64); 4] = [
    ([15.0, NONE, NONE], 121.820_178),
    ([NONE, 40.0, NONE], 122.357_920),
    ([NONE, NONE, 825.0], 122.234_002),
    ([15.0, NONE, 800.0], 122.628_839),
];

/// Model E.
pub(super) const FINE_E: Fine = Fine { none: [121.6841, 2e-4], base: [122.9272, 5e-4] };
/// Model U.
pub(super) const FINE_U: Fine = Fine { none: [120.4488, 3e-4], base: [120.690, 3e-3] };

/// The mesh of the tables: intervals, and points of each, where the limits hold at the points alone.
pub(super) const MESH: [usize; 2] = [60, 4];
/// Accuracy of that mesh; MJ/m2.
pub(super) const TOLERANCE_E: f64 = 0.003;
pub(super) const TOLERANCE_U: f64 = 0.008;

pub(super) const TABLE_E: &[ReferenceRow] = &[
    row([NONE, NONE, NONE], 121.68409, 568.913, [false, false, false]),
    row([15.0, NONE, NONE], 121.81542, 570.682, [true, false, false]),
    row([14.0, NONE, NONE], 122.2357, 571.572, [true, false, false]),
    row([13.0, NONE, NONE], 122.77025, 571.185, [true, false, false]),
    row([12.0, NONE, NONE], 123.3855, 570.281, [true, false, false]),
    row([11.0, NONE, NONE], 124.13063, 568.937, [true, false, false]),
    row([NONE, 45.0, NONE], 121.6961, 569.677, [false, true, false]),
    row([NONE, 42.0, NONE], 122.02698, 571.32, [false, true, false]),
    row([NONE, 40.0, NONE], 122.35408, 571.607, [false, true, false]),
    row([NONE, 37.0, NONE], 122.9255, 570.957, [false, true, false]),
    row([NONE, 34.0, NONE], 123.59278, 569.949, [false, true, false]),
    row([NONE, NONE, 850.0], 121.92286, 570.385, [false, false, true]),
    row([NONE, NONE, 825.0], 122.22869, 569.552, [false, false, true]),
    row([NONE, NONE, 800.0], 122.60312, 568.412, [false, false, true]),
    row([NONE, NONE, 780.0], 122.93289, 567.18, [false, false, true]),
    row([NONE, NONE, 760.0], 123.29409, 565.82, [false, false, true]),
    row([15.0, 40.0, 800.0], 122.92609, 570.631, [false, true, true]),
    row([NONE, 40.0, 800.0], 122.92609, 570.631, [false, true, true]),
    row([15.0, NONE, 800.0], 122.6253, 569.394, [true, false, true]),
    row([15.0, 40.0, NONE], 122.35408, 571.607, [false, true, false]),
    row([12.0, 40.0, 800.0], 123.61696, 570.667, [true, false, true]),
    row([13.0, 40.0, 800.0], 123.1919, 570.824, [true, false, true]),
    row([15.0, 36.0, 800.0], 123.4394, 570.406, [false, true, true]),
    row([15.0, 38.0, 800.0], 123.16405, 570.679, [false, true, true]),
    row([15.0, 44.0, 800.0], 122.6253, 569.394, [true, false, true]),
    row([15.0, 40.0, 780.0], 123.22586, 569.746, [false, true, true]),
    row([15.0, 40.0, 770.0], 123.38978, 568.958, [false, true, true]),
    row([15.0, 40.0, 850.0], 122.39543, 571.732, [false, true, true]),
    row([12.0, 34.0, 780.0], 124.03129, 569.233, [false, true, true]),
];

/// The first row is of the finest mesh.
pub(super) const TABLE_U: &[ReferenceRow] = &[
    row([NONE, NONE, NONE], 120.4488, 577.808, [false, false, false]),
    row([11.0, NONE, NONE], 121.83124, 578.564, [true, false, false]),
    row([NONE, 45.0, NONE], 120.44873, 577.808, [false, false, false]),
    row([NONE, 42.0, NONE], 120.44873, 577.808, [false, false, false]),
    row([NONE, 40.0, NONE], 120.46206, 578.581, [false, true, false]),
    row([NONE, 37.0, NONE], 120.84722, 580.105, [false, true, false]),
    row([NONE, 34.0, NONE], 121.43622, 579.309, [false, true, false]),
    row([NONE, NONE, 850.0], 120.44873, 577.808, [false, false, false]),
    row([NONE, NONE, 825.0], 120.4701, 578.238, [false, false, true]),
    row([NONE, NONE, 800.0], 120.67835, 578.629, [false, false, true]),
    row([NONE, NONE, 780.0], 120.93858, 577.64, [false, false, true]),
    row([NONE, NONE, 760.0], 121.2497, 576.237, [false, false, true]),
    row([15.0, 40.0, 800.0], 120.68489, 578.839, [false, true, true]),
    row([NONE, 40.0, 800.0], 120.68489, 578.839, [false, true, true]),
    row([15.0, NONE, 800.0], 120.67835, 578.629, [false, false, true]),
    row([15.0, 40.0, NONE], 120.46206, 578.581, [false, true, false]),
    row([12.0, 40.0, 800.0], 121.23461, 580.09, [true, false, true]),
    row([13.0, 40.0, 800.0], 120.83152, 579.943, [true, false, true]),
    row([15.0, 36.0, 800.0], 121.1072, 580.331, [false, true, true]),
    row([15.0, 38.0, 800.0], 120.84244, 579.977, [false, true, true]),
    row([15.0, 40.0, 780.0], 120.9452, 578.098, [false, true, true]),
    row([15.0, 40.0, 770.0], 121.09172, 577.513, [false, true, true]),
    row([15.0, 40.0, 850.0], 120.46206, 578.581, [false, true, false]),
    row([12.0, 34.0, 780.0], 121.60331, 579.376, [false, true, true]),
];

/// Statistics of ten searches with 6000 flights each.
pub(super) struct ReferenceSearch {
    /// Median of the excess over the optimum, %.
    pub(super) excess: f64,
    /// Median of the flights to an excess of 5, 2 and 1 %, of the searches that got there, and their number.
    pub(super) reached: [(f64, f64); 3],
}

const fn search(excess: f64, reached: [(f64, f64); 3]) -> Option<ReferenceSearch> {
    Some(ReferenceSearch { excess, reached })
}

/// Searches over profiles in energy by form (constants on three sub-intervals, lines on five) and algorithm.
pub(super) fn search_of(form: &str, algorithm: &str) -> Option<ReferenceSearch> {
    match (form, algorithm) {
        ("3 constants", "cooperation") => search(0.829, [(429.0, 9.0), (886.0, 8.0), (1351.0, 6.0)]),
        ("3 constants", "genetic") => search(1.524, [(407.5, 10.0), (703.0, 7.0), (2097.0, 3.0)]),
        ("3 constants", "particle-swarm") => search(0.452, [(357.5, 10.0), (588.0, 9.0), (1012.5, 8.0)]),
        ("3 constants", "ant-colony") => search(0.227, [(398.0, 10.0), (1049.0, 10.0), (1206.0, 9.0)]),
        ("5 lines", "cooperation") => search(0.989, [(596.5, 10.0), (1537.5, 10.0), (3986.5, 6.0)]),
        ("5 lines", "genetic") => search(1.763, [(1031.0, 10.0), (2151.0, 6.0), (5393.5, 2.0)]),
        ("5 lines", "particle-swarm") => search(0.891, [(558.0, 10.0), (1562.0, 10.0), (3843.0, 7.0)]),
        ("5 lines", "ant-colony") => search(0.753, [(864.5, 10.0), (2028.0, 10.0), (3475.5, 10.0)]),
        _ => None,
    }
}

/// Lander: start of the burn, landing, impulse.
pub(super) const LANDER: [f64; 3] = [1.4154037504, 4.1641408342, 8.2462112513];
