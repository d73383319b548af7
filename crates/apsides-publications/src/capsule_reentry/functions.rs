//! The two test functions of the paper (Haupt and Haupt, Practical Genetic Algorithms, appendix I), their least values, and how well
//! searches find them.
//!
//! ```text
//! (5)  (x^2 + y^2)^p sin(30 ((x + 0.5)^2 + y^2)^0.1) + |x| + |y|,   p = 0.25 or 0.5
//! (6)  J0(x^2 + y^2) + 0.1 |1 - x| + 0.1 |1 - y|
//! ```
//!
//! The digits of `p` are lost in the text at hand.

use std::f64::consts::PI;

use apsides_metaheuristics::{Search, SearchSpace, StopReason};
use libm::{j0, j1};

use super::contours::contour;
use super::{ALGORITHMS, algorithm};
use crate::sheet::{Graph, GraphSeries, Sheet, median};
use crate::stop::Stop;
use crate::workers::Workers;

/// Largest size of both variables.
const BOUND: f64 = 10.0;
/// A value this near to the least one is a success.
const NEAR: f64 = 1e-6;
/// Steps that bring a bracket down to rounding.
const BISECTIONS: usize = 200;

#[derive(Clone, Copy, PartialEq)]
enum Function {
    /// (5) with this exponent.
    Waves(f64),
    /// (6).
    Rings,
}

const FUNCTIONS: [(&str, Function); 3] = [
    ("(6)", Function::Rings),
    ("(5), exponent 0.25", Function::Waves(0.25)),
    ("(5), exponent 0.5", Function::Waves(0.5)),
];

impl Function {
    fn value(self, [x, y]: [f64; 2]) -> f64 {
        let square = x * x + y * y;
        match self {
            Self::Waves(p) => {
                let inner = (x + 0.5).powi(2) + y * y;
                square.powf(p) * (30.0 * inner.powf(0.1)).sin() + x.abs() + y.abs()
            }
            Self::Rings => j0(square) + 0.1 * (1.0 - x).abs() + 0.1 * (1.0 - y).abs(),
        }
    }

    /// A global minimiser; where there are several, one of them.
    fn minimiser(self) -> [f64; 2] {
        match self {
            // On x = 1, where one roof has its ridge: -2 y J1(1 + y^2) + 0.1 = 0.
            Self::Rings => [1.0, root([1.5, 1.8], |y| 0.1 - 2.0 * y * j1(1.0 + y * y))],
            // r <= |x| + |y| makes it not negative.
            Self::Waves(0.5) => [0.0, 0.0],
            // On y = 0, where |y| has its ridge, at x = -a: derivative by a of a^p' sin(w) + a with p' = 2 p, w = 30 (0.5 - a)^0.2.
            Self::Waves(p) => {
                let slope = |a: f64| {
                    let w = 30.0 * (0.5 - a).powf(0.2);
                    let of_w = -6.0 * (0.5 - a).powf(-0.8);
                    2.0 * p * a.powf(2.0 * p - 1.0) * w.sin() + a.powf(2.0 * p) * w.cos() * of_w + 1.0
                };
                [-root([0.19, 0.21], slope), 0.0]
            }
        }
    }

    /// The point that the paper calls the exact minimiser.
    fn printed(self) -> [f64; 2] {
        if self == Self::Rings { [1.0, 1.6606] } else { [0.0, 0.0] }
    }
}

/// The argument at which a function changes its sign from minus to plus.
fn root([mut a, mut b]: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (a + b);
        if f(middle) < 0.0 { a = middle } else { b = middle }
    }
    0.5 * (a + b)
}

/// Another point of the value zero of (5) with the exponent 0.5: on the axis where the sine is -1.
fn second_zero() -> f64 {
    (9.5 * PI / 30.0).powi(5) - 0.5
}

/// Least values and where they are, beside what the paper calls exact.
pub(super) fn optima() -> Sheet {
    let mut sheet = Sheet::new(
        "functions",
        "Test functions: global minima, and the minimisers that the paper calls exact",
        "function",
        &[
            ("least_value", 12),
            ("x", 12),
            ("y", 12),
            ("printed_x", 4),
            ("printed_y", 4),
            ("value_at_printed", 12),
        ],
    );
    for (name, f) in FUNCTIONS {
        let ([x, y], printed) = (f.minimiser(), f.printed());
        let values = [f.value([x, y]), x, y, printed[0], printed[1], f.value(printed)];
        sheet.push(name, values.into_iter().map(Some).collect());
    }
    let [rings, waves, linear] = FUNCTIONS.map(|(_, f)| f);
    let ([x, y], [_, z]) = (waves.minimiser(), rings.minimiser());
    sheet.findings = vec![
        format!(
            "(0, 0), printed as the exact minimiser of (5), is no global minimiser with the exponent 0.25: the value there is {:.0}, \
             that at ({x:.8}, {y:.0}) is {:.9}.",
            waves.value([0.0, 0.0]),
            waves.value([x, y]),
        ),
        format!(
            "With the exponent 0.5 the function (5) is nowhere negative and (0, 0) is a global minimiser, but not the only one: the \
             value at ({:.8}, 0) is {:.9}.",
            second_zero(),
            linear.value([second_zero(), 0.0]),
        ),
        format!(
            "(6) has two global minimisers, (1, {z:.12}) and ({z:.12}, 1); the printed one is the first."
        ),
    ];
    sheet.graphs = contours();
    sheet
}

/// Squares along a side of the figures.
const CELLS: usize = 160;

/// Figs 1 and 2: contour lines, with the global minimiser and the printed one as dots. The paper prints neither levels nor numbers; (6) is drawn where its
/// rings are wide enough to be seen.
fn contours() -> Vec<Graph> {
    let drawn = [
        (1, "figure_01.svg", "Fig. 1", BOUND, [0.0, 2.0, 5.0, 10.0, 15.0]),
        (2, "figure_01_half.svg", "Fig. 1", BOUND, [0.5, 2.0, 5.0, 10.0, 20.0]),
        (0, "figure_02.svg", "Fig. 2", 3.0, [-0.2, 0.0, 0.2, 0.4, 0.8]),
    ];
    let graph = |(index, file, number, size, levels): (usize, &'static str, &str, f64, [f64; 5])| {
        let (name, f) = FUNCTIONS[index];
        let lines = levels.map(|level| GraphSeries {
            label: format!("level {level}"),
            line: contour(|at| f.value(at), size, CELLS, level),
            dots: Vec::new(),
        });
        let points = [("global minimum", f.minimiser()), ("printed minimum", f.printed())];
        let dots =
            points.map(|(label, at)| GraphSeries { label: label.into(), line: Vec::new(), dots: vec![at] });
        Graph {
            file,
            title: format!("{number}: contours of test function {name}"),
            x: ("x", "-"),
            y: ("y", "-"),
            series: lines.into_iter().chain(dots).collect(),
        }
    };
    drawn.map(graph).into()
}

/// Rate and speed at which each algorithm finds the least value.
pub(super) fn searches(seeds: u64, budget: usize, workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "function-searches",
        format!(
            "Test functions: {seeds} searches of at most {budget} evaluations, to {NEAR:e} of the least value"
        ),
        "function, algorithm",
        &[("successes", 0), ("median_evaluations", 0), ("median_value_found", 9)],
    );
    let space = SearchSpace::cube(2, -BOUND, BOUND)?;
    for (name, f) in FUNCTIONS {
        let least = f.value(f.minimiser());
        let mut counts = Vec::new();
        for (word, label) in ALGORITHMS {
            let base = algorithm(word, budget)?;
            let jobs: Vec<u64> = (0..seeds).collect();
            let found = workers.all(&jobs, |&seed, _| {
                let search = Search { seed, target: Some(least + NEAR), ..base.clone() };
                let report = search.minimize(&space, &|x: &[f64]| f.value([x[0], x[1]]))?;
                let value = report.best.map_or(f64::NAN, |b| b.evaluation.objective);
                Ok((report.stop == StopReason::Target, report.evaluations as f64, value))
            })?;
            let found: Vec<_> = found.into_iter().flatten().collect();
            let reached = || found.iter().filter(|r| r.0);
            let values = [
                Some(reached().count() as f64),
                median(reached().map(|r| r.1)),
                median(found.iter().map(|r| r.2)),
            ];
            counts.push((label, values));
            sheet.push(format!("{name}, {label}"), values.to_vec());
        }
        sheet.findings.extend(sentence(name, &counts, seeds));
    }
    Ok(sheet)
}

/// A sentence that says where the cooperation is ahead.
fn sentence(name: &str, counts: &[(&str, [Option<f64>; 3])], seeds: u64) -> Option<String> {
    let (_, own) = counts.iter().find(|c| c.0 == "cooperation")?;
    // More successes, or as many with fewer evaluations.
    let order = |v: &[Option<f64>; 3]| (-v[0].unwrap_or(0.0), v[1].unwrap_or(f64::INFINITY));
    let others = || counts.iter().filter(|c| c.0 != "cooperation");
    let list = |ahead: bool| {
        let names: Vec<&str> =
            others().filter(|c| (order(own) < order(&c.1)) == ahead).map(|c| c.0).collect();
        if names.is_empty() { "none".into() } else { names.join(", ") }
    };
    Some(format!(
        "{name}: the cooperation finds the least value in {:.0} of {seeds} searches; it is ahead of: {}; behind: {}.",
        own[0]?,
        list(true),
        list(false)
    ))
}
