//! The thrust laws of section 5.3.5, with corrections of the angles by errors of the start, beside other steering.

use apsides_control::guidance::feed_forward::FeedForward;
use apsides_pipeline::dispersion::{Deviations, Guidance, Replanning};
use apsides_pipeline::montecarlo::{MonteCarlo, Sample, Spread, Statistics};

use super::case::{BRAKING, MASS, outcome};
use super::deviations::{SIGMA_M, SIGMA_M_S, steered};
use crate::sheet::{Graph, GraphSeries, Sheet};
use crate::stop::Stop;
use crate::workers::Workers;
use crate::{Error, Outcome, Pipeline};

/// Flights from which gains are found, and those with which each steering is judged; their seeds differ.
pub(super) const FITTED: usize = 40;
pub(super) const FLIGHTS: usize = 60;
/// Flights of the steering whose every flight solves optima.
pub(super) const PLANNED_ANEW: usize = 40;
const FITTED_SEED: u64 = 35;
const SEED: u64 = 36;
/// Time between plans, s.
const PERIOD_S: f64 = 60.0;
/// Corrections of the trial that shows what an angle does, rad by m and by m/s: a degree by a standard deviation.
const TRIAL: [f64; 2] = [0.0175 / SIGMA_M, 0.0175 / SIGMA_M_S];
/// Steps of the least squares; the first leaves a few metres.
const STEPS: usize = 3;

/// Places of what is wanted among the deviations and the results of a sample.
const START: Axes = Axes { along: [1, 4], across: [2, 5] };
const ALONG: usize = 1;
const ACROSS: usize = 2;

/// Places of position and speed along the course and across it among the deviations.
struct Axes {
    along: [usize; 2],
    across: [usize; 2],
}

fn start_errors() -> Deviations {
    Deviations { position_m: [SIGMA_M; 3], velocity_m_s: [SIGMA_M_S; 3], ..Deviations::default() }
}

/// Errors of the engine besides, which are known in flight.
fn with_engine() -> Deviations {
    Deviations { thrust: 0.003, exhaust_velocity: 0.002, ..start_errors() }
}

/// A planned braking whose flights are steered.
struct Steered<'a> {
    mission: &'a Pipeline,
    plan: &'a Outcome,
    threads: usize,
}

impl Steered<'_> {
    fn fly(
        &self,
        guidance: Guidance,
        d: Deviations,
        samples: usize,
        seed: u64,
    ) -> Result<(Vec<Sample>, Statistics), Error> {
        let run = MonteCarlo { samples, seed, threads: self.threads, dispersions: d, ..steered(guidance) };
        run.run(self.mission, self.plan, Vec::new(), |_| true)
    }

    /// The gains for which the ends of flights depend least on the errors of their starts: least squares, by what a correction does.
    fn gains(&self, flights: usize) -> Result<FeedForward, Error> {
        let fly = |law| {
            let run = self.fly(Guidance::LinearRadial(law), start_errors(), flights, FITTED_SEED);
            run.map(|(samples, _)| samples)
        };
        let mut law = FeedForward::default();
        let before = fly(law)?;
        let trial = fly(from_gains(TRIAL, TRIAL))?;
        // Errors of the start are the negative of the deviations.
        let effect = |axes: [usize; 2], end: usize| {
            let pairs = before.iter().zip(&trial).filter(|(a, b)| ended(a) && ended(b));
            let (mut with, mut square) = (0.0, 0.0);
            for (a, b) in pairs {
                let correction = -(TRIAL[0] * a.deviations[axes[0]] + TRIAL[1] * a.deviations[axes[1]]);
                with += correction * (b.results[end] - a.results[end]);
                square += correction * correction;
            }
            with / square
        };
        let effects = [effect(START.along, ALONG), effect(START.across, ACROSS)];
        let mut flown = before;
        for step in 0..STEPS {
            if step > 0 {
                flown = fly(law)?;
            }
            let along = regression(&flown, START.along, ALONG).map(|slope| slope / effects[0]);
            let across = regression(&flown, START.across, ACROSS).map(|slope| slope / effects[1]);
            law = from_gains(
                [law.along + along[0], law.along_speed + along[1]],
                [law.across + across[0], law.across_speed + across[1]],
            );
        }
        Ok(law)
    }
}

fn from_gains([along, along_speed]: [f64; 2], [across, across_speed]: [f64; 2]) -> FeedForward {
    FeedForward { along, along_speed, across, across_speed }
}

fn ended(s: &Sample) -> bool {
    s.results.iter().all(|v| v.is_finite())
}

/// Slopes of a result over two deviations by least squares, with a constant.
fn regression(samples: &[Sample], at: [usize; 2], result: usize) -> [f64; 2] {
    let rows: Vec<[f64; 3]> = samples
        .iter()
        .filter(|s| ended(s))
        .map(|s| [s.deviations[at[0]], s.deviations[at[1]], s.results[result]])
        .collect();
    let mean: [f64; 3] = std::array::from_fn(|k| rows.iter().map(|r| r[k]).sum::<f64>() / rows.len() as f64);
    let moment = |i: usize, j: usize| rows.iter().map(|r| (r[i] - mean[i]) * (r[j] - mean[j])).sum::<f64>();
    let (aa, ab, bb, ay, by) = (moment(0, 0), moment(0, 1), moment(1, 1), moment(0, 2), moment(1, 2));
    let determinant = aa * bb - ab * ab;
    [(bb * ay - ab * by) / determinant, (aa * by - ab * ay) / determinant]
}

const COLUMNS: &[(&str, usize)] = &[
    ("flights", 0),
    ("not_ended", 0),
    ("along_mean_m", 1),
    ("along_sigma_m", 1),
    ("across_mean_m", 1),
    ("across_sigma_m", 1),
    ("largest_altitude_error_m", 2),
    ("largest_speed_error_m_s", 3),
    ("propellant_mean_kg", 3),
    ("propellant_sigma_kg", 3),
];

/// Gains by `fitted` flights; `flights` of each steering, `planned_anew` of those by new plans.
pub(super) fn sheet(
    [fitted, flights, planned_anew]: [usize; 3],
    workers: &mut Workers<'_>,
) -> Result<Sheet, Stop> {
    let (mission, plan) = outcome(BRAKING, &[], &mut *workers.observer)?;
    let steered = Steered { mission: &mission, plan: &plan, threads: workers.threads };
    let gains = steered.gains(fitted)?;
    let mut sheet = Sheet::new(
        "guidance",
        "Thrust laws of 5.3.5 beside other steering: where the main braking ends relative to the plan, and its propellant",
        "deviations, steering",
        COLUMNS,
    );
    let steerings = [
        ("laws of 5.3.5", Guidance::LinearRadial(FeedForward::default()), flights),
        ("with feed-forward", Guidance::LinearRadial(gains), flights),
        ("E-guidance", Guidance::Polynomial, flights),
        ("planned anew at the start", Guidance::Replanned(Replanning::at_start()), planned_anew),
        (
            "planned anew every 60 s",
            Guidance::Replanned(Replanning { at_s: vec![0.0], every_s: Some(PERIOD_S) }),
            planned_anew,
        ),
    ];
    let mut series = Vec::new();
    for (deviations, sizes) in [("start", start_errors()), ("start and engine", with_engine())] {
        for (label, guidance, samples) in &steerings {
            let (flown, statistics) = steered.fly(guidance.clone(), sizes, *samples, SEED)?;
            sheet.push(format!("{deviations}: {label}"), values(&flown, &statistics));
            if deviations == "start" {
                let dots = flown.iter().filter(|s| ended(s)).map(|s| [s.results[ACROSS], s.results[ALONG]]);
                series.push(GraphSeries { label: (*label).into(), line: Vec::new(), dots: dots.collect() });
            }
        }
    }
    sheet.findings = findings(&sheet, &gains);
    sheet.graphs = vec![Graph {
        file: "guidance.svg",
        title: "Ends of the main braking with errors of the start (3 sigma of 1 km and 3 m/s)".into(),
        x: ("across the course", "m"),
        y: ("along the course", "m"),
        series,
    }];
    Ok(sheet)
}

fn values(samples: &[Sample], statistics: &Statistics) -> Vec<Option<f64>> {
    let of = |name: &str, pick: fn(&Spread) -> f64| statistics.spread(name).map_or(f64::NAN, pick);
    let speed = |s: &Sample| s.results[3..6].iter().map(|v| v * v).sum::<f64>().sqrt();
    [
        statistics.samples as f64,
        statistics.failed as f64,
        of("along_m", |s| s.mean),
        of("along_m", |s| s.sigma),
        of("across_m", |s| s.mean),
        of("across_m", |s| s.sigma),
        of("up_m", |s| s.largest),
        samples.iter().filter(|s| ended(s)).map(speed).fold(0.0, f64::max),
        MASS - of("final_mass_kg", |s| s.mean),
        of("final_mass_kg", |s| s.sigma),
    ]
    .map(|v| Some(v).filter(|v| v.is_finite()))
    .to_vec()
}

fn findings(sheet: &Sheet, gains: &FeedForward) -> Vec<String> {
    let of = |row: &str, key: &str| sheet.value(row, key).unwrap_or(f64::NAN);
    let FeedForward { along, along_speed, across, across_speed } = *gains;
    let km = |k: f64| 1e3 * k.to_degrees();
    let (law, corrected) = ("start: laws of 5.3.5", "start: with feed-forward");
    vec![
        format!(
            "Gains by least squares over flights, which the paper does not print: Kx {:.4} deg/km, KU {:.4} deg s/m, Ky {:.4} deg/km, KV {:.4} deg s/m. \
             Flown by `apsides montecarlo chang-e-3-braking --guidance linear-radial --feed-forward {:.4},{:.4},{:.4},{:.4}`.",
            km(along),
            along_speed.to_degrees(),
            km(across),
            across_speed.to_degrees(),
            km(along),
            along_speed.to_degrees(),
            km(across),
            across_speed.to_degrees()
        ),
        format!(
            "The laws alone meet altitude and velocity; errors of the start stay as {:.0} m along the course and {:.0} m across it (sigma). With \
             feed-forward {:.0} m and {:.0} m are left, for {:+.3} kg of propellant: errors of altitude and climb, which its equations leave out, \
             and what is not linear.",
            of(law, "along_sigma_m"),
            of(law, "across_sigma_m"),
            of(corrected, "along_sigma_m"),
            of(corrected, "across_sigma_m"),
            of(corrected, "propellant_mean_kg") - of(law, "propellant_mean_kg"),
        ),
        format!(
            "Both end {:.1} km beyond the plan: their steering is not that of the optimum, and the start of the braking is. Moving the start back takes that \
             away.",
            of(law, "along_mean_m") / 1e3
        ),
        format!(
            "Feed-forward knows nothing of the engine: with 0.3 % of thrust and 0.2 % of exhaust velocity (sigma) it leaves {:.0} m along the course, where \
             E-guidance leaves {:.1} m.",
            of("start and engine: with feed-forward", "along_sigma_m"),
            of("start and engine: E-guidance", "along_sigma_m"),
        ),
        format!(
            "E-guidance ends at the planned place for {:+.3} kg beside a new plan at the start; that has the speed of the gate, its direction is free.",
            of("start: E-guidance", "propellant_mean_kg")
                - of("start: planned anew at the start", "propellant_mean_kg"),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-12;

    /// A plane through four points, and a flight that did not end.
    #[test]
    fn slopes_of_a_plane() {
        let row = |x: f64, y: f64, z: f64| Sample {
            index: 0,
            deviations: vec![0.0, x, 0.0, 0.0, y],
            results: vec![0.0, z],
            fault: None,
        };
        let plane = |x: f64, y: f64| row(x, y, 5.0 + 2.0 * x - 3.0 * y);
        let samples =
            [plane(0.0, 0.0), plane(1.0, 0.0), plane(0.0, 2.0), plane(-1.0, 1.5), row(9.0, 9.0, f64::NAN)];
        let [a, b] = regression(&samples, [1, 4], 1);
        assert!((a - 2.0).abs() < ROUNDING && (b + 3.0).abs() < ROUNDING, "{a} {b}");
    }
}
