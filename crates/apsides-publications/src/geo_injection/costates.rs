//! Costates at ignition of single burns from circle to circle by the six stages, and the analytic guesses beside them.

use super::analytic::AnalyticGuess;
use super::circles::{Circles, Point};
use super::stage::{Solver, Stage, Stop, keep};
use crate::sheet::{Graph, GraphSeries, Sheet, median};

/// Vehicles of Table 1 with their names.
pub(super) const STAGES: [(&str, &str); 6] = [
    ("breeze-m", "Breeze-M"),
    ("block-dm", "Block DM"),
    ("fregat", "Fregat"),
    ("fregat-sb", "Fregat-SB"),
    ("centaur-d", "Centaur D"),
    ("yastreb", "Yastreb"),
];
/// Ratios of the radii in the table, as far as the propellant goes.
const RATIOS: [f64; 10] = [1.01, 1.02, 1.05, 1.1, 1.15, 1.2, 1.3, 1.4, 1.5, 1.75];
/// Equally spaced ratios up to the limit, for curves and for the quality of the guesses.
const RADII: usize = 25;

/// A way to make a guess.
struct Method {
    name: &'static str,
    guess: fn(&Circles<'_>, f64) -> AnalyticGuess,
    /// Figures of burn time and both costates.
    files: [&'static str; 3],
}

const METHODS: [Method; 2] = [
    Method {
        name: "constant mass",
        guess: |c, ratio| c.constant_mass(ratio),
        files: ["burn-time-constant-mass.svg", "lambda-u-constant-mass.svg", "lambda-v-constant-mass.svg"],
    },
    Method {
        name: "mean acceleration",
        guess: |c, ratio| c.mean_acceleration(ratio),
        files: [
            "burn-time-mean-acceleration.svg",
            "lambda-u-mean-acceleration.svg",
            "lambda-v-mean-acceleration.svg",
        ],
    },
];

const QUANTITIES: [(&str, &str); 3] =
    [("burn time", "s"), ("lambda u at ignition", "-"), ("lambda v at ignition", "-")];

/// Burn time (s) and costates.
fn triple(circles: &Circles<'_>, guess: &AnalyticGuess) -> [f64; 3] {
    [circles.seconds(guess), guess.costates[0], guess.costates[1]]
}

fn solved(point: &Point) -> [f64; 3] {
    [point.time, point.costates[0], point.costates[1]]
}

/// The quality of the guesses by a stage's solutions.
struct Quality {
    /// Largest relative error of the burn time, by guess.
    time: [f64; 2],
    /// True if the costate of the horizontal speed has the sign of the guess anywhere.
    same_sign: bool,
}

/// The table of costates with its figures, and that of the guesses.
pub(super) fn tables(solver: &mut Solver<'_>) -> Result<[Sheet; 2], Stop> {
    let columns = [
        ("burn_time_s", 2),
        ("lambda_u", 4),
        ("lambda_v", 4),
        ("constant_mass_time_s", 1),
        ("constant_mass_lambda_u", 3),
        ("constant_mass_lambda_v", 3),
        ("mean_acceleration_time_s", 1),
        ("mean_acceleration_lambda_u", 3),
        ("mean_acceleration_lambda_v", 3),
    ];
    let title = "Single burns from the parking orbit to a circle: costates at ignition, canonical units, lambda_r = -1";
    let mut costates = Sheet::new("costates", title, "stage, ratio of the radii", &columns);
    let columns = [
        ("largest_ratio", 4),
        ("radii", 0),
        ("constant_mass_converged", 0),
        ("constant_mass_median_iterations", 1),
        ("constant_mass_largest_time_error", 3),
        ("mean_acceleration_converged", 0),
        ("mean_acceleration_median_iterations", 1),
        ("mean_acceleration_largest_time_error", 3),
    ];
    let title = "Newton iterations from the analytic guesses, at radii equally spaced up to the limit of the propellant";
    let mut guesses = Sheet::new("guesses", title, "stage", &columns);
    let mut graphs = graphs();
    let mut qualities = Vec::new();
    for (vehicle, name) in STAGES {
        let stage = Stage::of(vehicle, None)?;
        let circles = Circles::of(&stage);
        let Some(limit) = keep(&mut guesses, circles.limit(solver))? else { continue };
        let step = (limit.ratio - 1.0) / RADII as f64;
        let even: Vec<f64> = (1..RADII).map(|k| 1.0 + step * k as f64).chain([limit.ratio]).collect();
        let listed: Vec<f64> =
            RATIOS.iter().copied().filter(|r| *r < limit.ratio).chain([limit.ratio]).collect();
        let mut ratios: Vec<f64> = even.iter().chain(&listed).copied().collect();
        ratios.sort_by(f64::total_cmp);
        ratios.dedup();
        let Some(points) = keep(&mut guesses, circles.at(&ratios, solver))? else { continue };
        for point in points.iter().filter(|p| listed.contains(&p.ratio)) {
            let triples = METHODS.iter().map(|m| triple(&circles, &(m.guess)(&circles, point.ratio)));
            let values = [solved(point)].into_iter().chain(triples).flatten().map(Some).collect();
            let ratio = format!("{:.4}", point.ratio);
            costates.push(format!("{name}, {}", ratio.trim_end_matches('0')), values);
        }
        draw(&mut graphs, name, &circles, &points);
        let points: Vec<Point> = points.into_iter().filter(|p| even.contains(&p.ratio)).collect();
        let (values, quality) = quality(&circles, &points, solver)?;
        guesses.push(name, [Some(limit.ratio), Some(RADII as f64)].into_iter().chain(values).collect());
        qualities.push(quality);
    }
    costates.graphs = graphs;
    if !qualities.is_empty() && qualities.iter().all(|q| !q.same_sign) {
        costates.findings.push(
            "the costate of the horizontal speed has the opposite sign of the guess with constant mass, for every stage and radius: \
             the optimal thrust begins with a forward component, that of the guess with a backward one"
                .into(),
        );
    }
    let worst = |k: usize| qualities.iter().fold(0.0_f64, |m, q| m.max(q.time[k]));
    costates.findings.push(format!(
        "the mean acceleration over the burn in place of that at ignition takes the largest error of the guessed burn time from \
         {:.0} % to {:.1} %",
        100.0 * worst(0),
        100.0 * worst(1)
    ));
    Ok([costates, guesses])
}

fn graphs() -> Vec<Graph> {
    let of = |m: &Method| {
        let graph = |((name, unit), file): ((&'static str, &'static str), &'static str)| Graph {
            file,
            title: format!("Single burns: {name} (lines) and the guess with {} (dots)", m.name),
            x: ("ratio of the radii", "-"),
            y: (name, unit),
            series: Vec::new(),
        };
        QUANTITIES.into_iter().zip(m.files).map(graph).collect::<Vec<_>>()
    };
    METHODS.iter().flat_map(of).collect()
}

fn draw(graphs: &mut [Graph], name: &str, circles: &Circles<'_>, points: &[Point]) {
    for (k, graph) in graphs.iter_mut().enumerate() {
        let (method, quantity) = (&METHODS[k / QUANTITIES.len()], k % QUANTITIES.len());
        let guess = |p: &Point| triple(circles, &(method.guess)(circles, p.ratio))[quantity];
        graph.series.push(GraphSeries {
            label: name.to_owned(),
            line: points.iter().map(|p| [p.ratio, solved(p)[quantity]]).collect(),
            dots: points.iter().map(|p| [p.ratio, guess(p)]).collect(),
        });
    }
}

/// For each guess: how many solves converge, the median of their iterations, the largest relative error of the burn time.
fn quality(
    circles: &Circles<'_>,
    points: &[Point],
    solver: &mut Solver<'_>,
) -> Result<(Vec<Option<f64>>, Quality), Stop> {
    let mut values = Vec::new();
    let mut time = [0.0; 2];
    for (k, method) in METHODS.iter().enumerate() {
        let mut counts: Vec<usize> = Vec::new();
        for p in points {
            let guess = (method.guess)(circles, p.ratio);
            counts.extend(circles.iterations(p, &guess, solver)?);
            time[k] = f64::max(time[k], (circles.seconds(&guess) / p.time - 1.0).abs());
        }
        values.extend([Some(counts.len() as f64), median(counts.iter().map(|c| *c as f64)), Some(time[k])]);
    }
    let sign = |p: &Point| p.costates[1] * circles.constant_mass(p.ratio).costates[1] > 0.0;
    Ok((values, Quality { time, same_sign: points.iter().any(sign) }))
}
