//! Flights that deviate at the start: by the sizes of the reference, and by the 5 % of the paper.

use apsides_dynamics::frames::{BodyFixed, Local};
use apsides_dynamics::powered_descent::MOON_ROTATION_RATE;
use apsides_metaheuristics::Generator;

use super::case::{BRAKING, outcome};
use super::comparison::{self, Compared, Known, row, to};
use super::orbit::RADIUS;
use crate::sheet::{Graph, GraphSeries, Sheet};
use crate::stop::Stop;
use crate::workers::Workers;
use crate::{Error, Outcome, Pipeline};
use apsides_pipeline::dispersion::Deviations;
use apsides_pipeline::dispersion::{Dispersed, Guidance, Onboard, Replanning};
use apsides_pipeline::montecarlo::{MonteCarlo, Sample};

/// The deviating flights of a planned braking.
pub(super) fn flights(mission: &Pipeline, plan: &Outcome) -> Result<Box<dyn Dispersed>, Error> {
    let flights = mission.mission().dispersed(&plan.trajectory)?;
    flights.ok_or_else(|| Error::in_mission("the mission has no deviating flights"))
}

/// Flights with this steering, of one thread and without deviations.
pub(super) fn steered(guidance: Guidance) -> MonteCarlo {
    let (dispersions, onboard) = (Deviations::default(), Onboard::default());
    MonteCarlo { samples: 0, seed: SEED, threads: 1, dispersions, guidance, onboard }
}

const SEED: u64 = 8;
/// One third of 1 km and of 3 m/s.
pub(super) const SIGMA_M: f64 = 1000.0 / 3.0;
pub(super) const SIGMA_M_S: f64 = 1.0;
/// Sampling error of the 600 flights of the reference, relative.
const SAMPLING: f64 = 0.05;

/// Component, standard deviation of the flights of the reference, and by its state-transition matrix.
const SPREADS: [(&str, &str, f64, f64); 6] = [
    ("up_m", "upwards, m", 602.9219, 593.3052),
    ("along_m", "along, m", 492.3205, 515.6662),
    ("across_m", "across, m", 487.9940, 514.3924),
    ("up_speed_m_s", "upwards, m/s", 1.214_649, 1.201_086),
    ("along_speed_m_s", "along, m/s", 0.904_155, 0.927_618),
    ("across_speed_m_s", "across, m/s", 0.892_073, 0.926_647),
];
/// Dots of a figure.
const DOTS: usize = 1500;

/// Open loop with the deviations of the reference, and planned anew from the start.
pub(super) fn near(flights: usize, replanned: usize, workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let (mission, plan) = outcome(BRAKING, &[], &mut *workers.observer)?;
    let dispersions =
        Deviations { position_m: [SIGMA_M; 3], velocity_m_s: [SIGMA_M_S; 3], ..Deviations::default() };
    let run = |samples, guidance| {
        let run = MonteCarlo { samples, threads: workers.threads, dispersions, ..steered(guidance) };
        run.run(&mission, &plan, Vec::new(), |_| true)
    };
    let (samples, open) = run(flights, Guidance::OpenLoop)?;
    let (_, anew) = run(replanned, Guidance::Replanned(Replanning::at_start()))?;
    let relative = |value: f64, part: f64| to(value, part * value.abs());
    let mut labels = Vec::new();
    for (key, words, sampled, linear) in SPREADS {
        let Some(found) = open.spread(key) else { continue };
        labels.push((format!("sigma {words}"), found.sigma, relative(sampled, SAMPLING)));
        let by_matrix = found.linear_sigma.unwrap_or(f64::NAN);
        labels.push((format!("sigma by the matrix, {words}"), by_matrix, relative(linear, 1e-4)));
    }
    if let Some(miss) = open.spread("horizontal_miss_m") {
        labels.push(("horizontal miss, median, m".into(), miss.percentiles[1], relative(585.260, SAMPLING)));
        labels.push(("horizontal miss, 99 %, m".into(), miss.percentiles[2], relative(1_476.692, SAMPLING)));
    }
    labels.push((
        "planned anew at the start: within 1 m, %".into(),
        100.0 * anew.within_1_m.unwrap_or(f64::NAN),
        to(100.0, 0.0),
    ));
    if let Some(mass) = anew.spread("final_mass_kg") {
        // Twice the standard error of the difference of two sets of 150.
        labels.push((
            "planned anew: sigma of the final mass, kg".into(),
            mass.sigma,
            relative(0.463_366, 0.15),
        ));
    }
    let mut sheet = comparison::sheet(
        "deviations",
        "Main braking with deviations of 1 km and 3 m/s (3 sigma) on each axis of the start: where the flights end relative to the plan",
        rows(&labels),
    );
    let error = |count: f64| 100.0 / (2.0 * count).sqrt();
    let worst = |of: &dyn Fn(f64, f64, f64) -> f64| {
        let parts = SPREADS
            .iter()
            .filter_map(|(key, _, sampled, linear)| Some(of(open.spread(key)?.sigma, *sampled, *linear)));
        parts.fold(0.0, f64::max)
    };
    sheet.findings.push(format!(
        "Standard error of a sigma: {:.1} % of the {flights} flights here, {:.1} % of the 600 of the reference. From the state-transition \
         matrix, the same in both, the sigmas here differ by {:.1} % at most, those of the reference by {:.1} %; {replanned} flights are \
         planned anew.",
        error(flights as f64),
        error(600.0),
        worst(&|found, _, linear| 100.0 * (found / linear - 1.0).abs()),
        worst(&|_, sampled, linear| 100.0 * (sampled / linear - 1.0).abs()),
    ));
    sheet.graphs = vec![ends(&samples)];
    Ok(sheet)
}

fn rows(labels: &[(String, f64, Option<Known>)]) -> Vec<Compared<'_>> {
    labels.iter().map(|(label, found, reference)| row(label, None, *found, *reference, "")).collect()
}

fn ends(samples: &[Sample]) -> Graph {
    // In the order of the mission's columns: up, along, across.
    let place = |s: &Sample| Some([*s.results.get(2)?, *s.results.get(1)?]);
    let dots =
        samples.iter().take(DOTS).filter_map(place).filter(|p| p.iter().all(|v| v.is_finite())).collect();
    Graph {
        file: "deviations.svg",
        title: "Ends with the thrust of the plan, 3 sigma of 1 km and 3 m/s".into(),
        x: ("across the course", "m"),
        y: ("along the course", "m"),
        series: vec![GraphSeries { label: "flights".into(), line: Vec::new(), dots }],
    }
}

/// Every component of position and velocity in inertial axes changed by up to this part, as in the paper.
const PART: f64 = 0.05;

/// A start of the paper: its deviations along the local axes, and the altitude, m.
struct Far {
    deviations: Deviations,
    altitude: f64,
}

fn far_starts(plan: &Outcome, count: usize) -> Vec<Far> {
    let Some(phase) = plan.trajectory.phases.first() else { return Vec::new() };
    let state = phase.state_at(phase.initial_time);
    let &[radius, longitude, latitude, upward, eastward, northward, _mass] = &state[..] else {
        return Vec::new();
    };
    let local = Local::at(longitude, latitude);
    // Inertial axes are those of the Moon at the start.
    let frame = BodyFixed { rotation_rate: MOON_ROTATION_RATE, epoch_angle: 0.0 };
    let position = local.up.map(|c| c * radius);
    let (p, v) = frame.to_inertial(0.0, position, local.vector([upward, eastward, northward]));
    let mut random = Generator::new(SEED);
    let mut start = || {
        let mut off = |v: [f64; 3]| v.map(|c| c * random.between(-PART, PART));
        let (dp, dv) = (off(p), off(v));
        // Northwards: along is north, across to the right is east.
        let axes = |[up, east, north]: [f64; 3]| [up, north, east];
        let radius = (0..3).map(|k| (p[k] + dp[k]).powi(2)).sum::<f64>().sqrt();
        let deviations = Deviations {
            position_m: axes(local.components(dp)),
            velocity_m_s: axes(local.components(dv)),
            ..Deviations::default()
        };
        Far { deviations, altitude: radius - RADIUS }
    };
    (0..count).map(|_| start()).collect()
}

/// The 5 % of the paper: open loop, and planned anew where the start is above the ground.
pub(super) fn far(count: usize, replanned: usize, workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let (mission, plan) = outcome(BRAKING, &[], &mut *workers.observer)?;
    let flights = flights(&mission, &plan)?;
    let starts = far_starts(&plan, count);
    let below = starts.iter().filter(|s| s.altitude < 0.0).count();
    let fly = |starts: &[&Far], guidance, workers: &mut Workers<'_>| {
        let run = steered(guidance);
        workers.all(starts, |s, _| Ok(flights.fly(&s.deviations, &run.guidance, &run.onboard)))
    };
    let all: Vec<&Far> = starts.iter().collect();
    let open: Vec<Vec<f64>> =
        fly(&all, Guidance::OpenLoop, workers)?.into_iter().filter_map(|r| r.ok()?).collect();
    let above: Vec<&Far> = starts.iter().take(replanned).filter(|s| s.altitude > 0.0).collect();
    let tried = above.len();
    let anew: Vec<Vec<f64>> = fly(&above, Guidance::Replanned(Replanning::at_start()), workers)?
        .into_iter()
        .filter_map(|r| r.ok()?)
        .collect();
    let mut miss: Vec<f64> = open.iter().map(|r| r[6] / 1e3).collect();
    miss.sort_unstable_by(f64::total_cmp);
    let at = |part: f64| {
        miss.get((part * (miss.len() as f64 - 1.0)).round() as usize).copied().unwrap_or(f64::NAN)
    };
    let hits = anew.iter().filter(|r| r[0].hypot(r[6]) < 1.0).count();
    let share = 100.0 * below as f64 / count as f64;
    let distance = PART * (RADIUS + 15e3) / 1e3;
    let labels = [
        // Twice the standard error of the difference of two sets of 400.
        ("starts below the ground, %".to_owned(), share, to(38.75, 7.0)),
        ("5 % of the distance from the centre, km".to_owned(), distance, to(87.600_65, 1e-5)),
        ("horizontal miss, median, km".to_owned(), at(0.5), to(29.444, 4.0)),
        ("horizontal miss, 99 %, km".to_owned(), at(0.99), to(80.808, 12.0)),
    ];
    let mut sheet = comparison::sheet(
        "five-percent",
        "The deviations of the paper: each component of position and velocity in inertial axes changed by up to 5 %",
        rows(&labels),
    );
    let masses = anew.iter().map(|r| r[7]);
    let (least, most) =
        (masses.clone().fold(f64::INFINITY, f64::min), masses.fold(f64::NEG_INFINITY, f64::max));
    sheet.findings.push(format!(
        "5 % of the position are up to {distance:.0} km: {below} of {count} starts are below the ground, and the others are another \
         mission. \"Robust within 5 %\" cannot be a statement on following the planned flight: with its thrust the median miss is {:.0} km.",
        at(0.5)
    ));
    sheet.findings.push(format!(
        "Planned anew from the starts above the ground, {hits} of {tried} reach the gate, with {least:.0} to {most:.0} kg; in the reference \
         all 31 of 31, with 1160 to 1372 kg. So what can be robust is planning anew, for another final mass each time."
    ));
    Ok(sheet)
}
