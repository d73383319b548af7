//! Momentum and inertia of the moving masses, which the paper neglects.

use std::f64::consts::FRAC_PI_2;

use super::cases::{RIM_NONLINEAR, fixed, nonlinear_on_angles, on_angles};
use super::sheets::{fly_all, held};
use crate::sheet::{Graph, GraphSeries, Sheet};
use crate::stop::Stop;
use apsides_control::pid::PidGains;
use apsides_missions::moving_mass::{
    ActuatorLimits, Case, Descent, Law, MassModel, Metrics, RATE_LIMITED_GAINS, ending_word,
};

/// Stations of the masses ahead of the centre of mass, m: in its plane, and a fifth of a metre to either side.
const STATIONS: [f64; 3] = [0.0, 0.2, -0.2];
/// Drives that a mass can have: 1 m/s, 10 m/s2.
const LIMITED: ActuatorLimits =
    ActuatorLimits { rate: Some(1.0), acceleration: Some(10.0), ..ActuatorLimits::IDEAL };
/// Steps of the integration per sample: masses that ideal drives move at once push hard.
const SUBSTEPS: usize = 4;
/// Every so many samples are drawn.
const EVERY: usize = 10;

/// A case with the file of its figure.
struct ComparedModels {
    label: String,
    file: &'static str,
    case: Case,
}

/// Slow drives with gains for them.
const SLOW: f64 = 0.1;

fn compared() -> Vec<ComparedModels> {
    let straight = |mut case: Case| {
        (case.entry.attack, case.entry.sideslip, case.entry.path) = (0.0, 0.0, -FRAC_PI_2);
        case.vehicle.offset = [0.0; 2];
        case
    };
    let rim = on_angles(5.0, nonlinear_on_angles(&RIM_NONLINEAR));
    let cases = [
        (
            "Figs 10, 11: cross 10 kg, straight down",
            straight(Case::cross(10.0)),
            ["full_10.svg", "full_10_limited.svg"],
        ),
        ("cross 10 kg, 1 cm", Case::cross(10.0), ["full_cross_10.svg", "full_cross_10_limited.svg"]),
        ("Figs 18, 19: cross 5 kg, 1 cm", Case::cross(5.0), ["full_18.svg", "full_18_limited.svg"]),
        ("rim 5 kg by inversion, 1 cm", Case::radial(5.0), ["full_rim_5.svg", "full_rim_5_limited.svg"]),
        ("Figs 20, 21: rim 5 kg, nonlinear law, 1 cm", rim, ["full_20.svg", "full_20_limited.svg"]),
    ];
    let drives = [("ideal drives", ActuatorLimits::IDEAL), ("1 m/s and 10 m/s2", LIMITED)];
    let mut all = Vec::new();
    for (label, case, files) in cases {
        for ((drive, actuators), file) in drives.iter().zip(files) {
            let case = Case { actuators: *actuators, ..case.clone() };
            all.push(ComparedModels { label: format!("{label}, {drive}"), file, case });
        }
    }
    if let Some((rate, [p, i, d])) = RATE_LIMITED_GAINS.iter().find(|(rate, _)| *rate == SLOW) {
        let law = Law::pid(PidGains::new(*p, *i, *d));
        let actuators = ActuatorLimits { rate: Some(*rate), ..ActuatorLimits::IDEAL };
        let label = format!("cross 10 kg, 1 cm, {rate} m/s with gains for it");
        all.push(ComparedModels {
            label,
            file: "full_slow.svg",
            case: Case { law, actuators, ..Case::cross(10.0) },
        });
    }
    for compared in &mut all {
        compared.case.run.substeps = SUBSTEPS;
    }
    all
}

/// A flight: its metrics, and time with height and both angles at every sample.
struct ComparedFlight {
    metrics: Metrics,
    angles: Vec<(f64, f64, [f64; 2])>,
}

/// Largest difference of both angles at the same times, deg: over the flight, and where the heights of the first are judged.
fn differences(quasi: &ComparedFlight, full: &ComparedFlight, [lower, upper]: [f64; 2]) -> [f64; 2] {
    let mut largest = [0.0_f64; 2];
    for ((time, height, a), (other, _, b)) in quasi.angles.iter().zip(&full.angles) {
        if time != other {
            continue;
        }
        let here = (a[0] - b[0]).abs().max((a[1] - b[1]).abs()).to_degrees();
        largest[0] = largest[0].max(here);
        if (lower..=upper).contains(height) {
            largest[1] = largest[1].max(here);
        }
    }
    largest
}

pub(super) fn sheet(threads: usize) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "full-masses",
        "Beyond the paper: masses whose momentum and inertia the capsule feels beside quasi-static ones; root mean squares of the worse angle \
         from 20 to 3 km, largest differences of the angles at the same time; nothing where the flight fails",
        "case, drives, plane of the masses ahead of the centre of mass",
        &[
            ("station_m", 1),
            ("quasi_static_rms_deg", 5),
            ("full_rms_deg", 5),
            ("difference_deg", 5),
            ("difference_20_to_3_km_deg", 5),
        ],
    );
    let cases = compared();
    let models =
        || [MassModel::QuasiStatic].into_iter().chain(STATIONS.map(|station| MassModel::Full { station }));
    let flown: Vec<Case> =
        cases.iter().flat_map(|c| models().map(|mass_model| Case { mass_model, ..c.case.clone() })).collect();
    let flights = fly_all(&flown, threads, |case, record| {
        let descent = Descent::new(case)?;
        let metrics = descent.fly(record)?;
        let angles = record.samples().iter().map(|s| {
            let (height, angles) = descent.angles(&s.state);
            (s.time, height, angles)
        });
        Ok(ComparedFlight { metrics, angles: angles.collect() })
    })?;
    let (mut changed, mut alike, mut matters) = (Vec::new(), [0_usize; 2], [0_usize; 2]);
    for (compared, flights) in cases.iter().zip(flights.chunks(1 + STATIONS.len())) {
        let [quasi, full @ ..] = flights else { continue };
        let degrees =
            |flight: &ComparedFlight| Some(flight.metrics.worst_rms().to_degrees()).filter(|d| d.is_finite());
        for (station, flight) in STATIONS.iter().zip(full) {
            let label = format!("{}, {station} m", compared.label);
            let [all, judged] = match flight.metrics.held() {
                true => differences(quasi, flight, compared.case.run.window).map(Some),
                false => [None; 2],
            };
            let row = vec![Some(*station), degrees(quasi), degrees(flight), all, judged];
            sheet.push(label.clone(), row);
            let word = |flight: &ComparedFlight| match (flight.metrics.held(), held(&flight.metrics)) {
                (false, _) => ending_word(&flight.metrics.ending),
                (true, true) => "held",
                (true, false) => "not held",
            };
            let (before, after) = (word(quasi), word(flight));
            if before == after {
                alike[usize::from(*station != 0.0)] += 1;
            } else {
                matters[usize::from(*station != 0.0)] += 1;
                changed.push(format!("{label}: {before} with quasi-static masses, {after} with full ones"));
            }
        }
        let names = STATIONS.map(|station| match station {
            0.0 => "full, in the plane of the centre of mass".to_owned(),
            ahead if ahead > 0.0 => format!("full, {ahead} m ahead"),
            behind => format!("full, {} m behind", -behind),
        });
        let series = flights.iter().zip(["quasi-static".to_owned()].into_iter().chain(names));
        sheet.graphs.push(Graph {
            file: compared.file,
            title: format!("angle of attack, {}", compared.label),
            x: ("time", "s"),
            y: ("angle of attack", "rad"),
            series: series
                .map(|(flight, label)| GraphSeries {
                    label,
                    line: flight
                        .angles
                        .iter()
                        .step_by(EVERY)
                        .map(|(t, _, [attack, _])| [*t, *attack])
                        .collect(),
                    dots: Vec::new(),
                })
                .collect(),
        });
    }
    let verdict = |k: usize| match matters[k] {
        0 => format!("it changes none of {} verdicts", alike[k]),
        n => format!("it changes {n} of {} verdicts", n + alike[k]),
    };
    sheet.findings.push(format!(
        "what the neglect does: with the masses in the plane of the centre of mass {}; with the plane 0.2 m off {}",
        verdict(0),
        verdict(1)
    ));
    let case = Case::cross(10.0);
    let inertia = case.vehicle.mass * case.vehicle.gyration[1].powi(2);
    let fed_back = 10.0 * STATIONS[1] * fixed().derivative / (inertia * case.run.sample_time);
    sheet.findings.push(format!(
        "off the plane, by b, a mass m that moves by s turns a capsule of the inertia J back by m b s / J: a derivative gain k that is sampled every T \
         feeds itself with m b k / (J T), {fed_back:.1} for the cross of 10 kg, where no more than 1 can be stable; slow drives with gains for them hold"
    ));
    if changed.iter().any(|c| c.contains("step-too-long")) {
        sheet.findings.push(
            "step-too-long: ideal drives throw the masses so far within a sample that steps of a fraction of it cannot follow".into(),
        );
    }
    sheet.findings.extend(changed);
    Ok(sheet)
}
