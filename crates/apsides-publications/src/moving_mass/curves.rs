//! A figure for each figure of the paper, and the largest angles beside its criterion of 5 %.

use std::f64::consts::FRAC_PI_2;

use super::cases::{RIM_NONLINEAR, fixed, nonlinear_on_angles, on_angles};
use super::sheets::fly_all;
use crate::sheet::{Graph, GraphSeries, Sheet};
use crate::stop::Stop;
use apsides_missions::moving_mass::{Case, Descent, Law};

/// Overshoot that the paper allows.
const CRITERION_PERCENT: f64 = 5.0;
/// The larger angle of attack at the entry of Figs 12 to 14, which is not printed, deg.
const LARGER_DEG: f64 = 10.0;
/// Every so many samples are drawn.
const EVERY: usize = 10;

/// A quantity over time.
#[derive(Clone, Copy)]
enum Quantity {
    Attack,
    Sideslip,
    Altitude,
    Rates,
    Masses,
}

/// A case with its figures: files, numbers, quantities.
struct Drawn {
    label: &'static str,
    case: Case,
    figures: &'static [(&'static str, &'static str, Quantity)],
}

fn drawn() -> Vec<Drawn> {
    let straight = |mut case: Case| {
        (case.entry.attack, case.entry.sideslip, case.entry.path) = (0.0, 0.0, -FRAC_PI_2);
        case
    };
    let with = |mut case: Case, law: Law, offset: f64| {
        (case.law, case.vehicle.offset) = (law, [offset; 2]);
        case
    };
    let larger = |mut case: Case| {
        case.entry.attack = LARGER_DEG.to_radians();
        case
    };
    let pid = || Law::pid(fixed());
    use Quantity::{Altitude, Attack, Masses, Rates, Sideslip};
    vec![
        Drawn {
            label: "Figs 2, 3: no law, no offset, straight down",
            case: straight(with(Case::cross(10.0), Law::None, 0.0)),
            figures: &[("figure_02.svg", "Fig. 2", Attack), ("figure_03.svg", "Fig. 3", Sideslip)],
        },
        Drawn {
            label: "Figs 4 to 6: no law, 1 cm, straight down",
            case: straight(with(Case::cross(10.0), Law::None, 0.01)),
            figures: &[
                ("figure_04.svg", "Fig. 4", Attack),
                ("figure_05.svg", "Fig. 5", Sideslip),
                ("figure_06.svg", "Fig. 6", Altitude),
            ],
        },
        Drawn {
            label: "Figs 10, 11: cross 10 kg, PID, straight down",
            case: straight(with(Case::cross(10.0), pid(), 0.0)),
            figures: &[("figure_10.svg", "Fig. 10", Attack), ("figure_11.svg", "Fig. 11", Sideslip)],
        },
        Drawn {
            label: "Figs 12 to 16: cross 10 kg, PID, 1 cm, 10 deg",
            case: larger(with(Case::cross(10.0), pid(), 0.01)),
            figures: &[
                ("figure_12.svg", "Fig. 12", Attack),
                ("figure_13.svg", "Fig. 13", Sideslip),
                ("figure_14.svg", "Fig. 14", Rates),
                ("figure_15_16.svg", "Figs 15, 16", Masses),
            ],
        },
        Drawn {
            label: "Fig. 17: rim 10 kg, PID on angles, 1 cm",
            case: on_angles(10.0, pid()),
            figures: &[("figure_17.svg", "Fig. 17", Attack)],
        },
        Drawn {
            label: "Figs 18, 19: cross 5 kg, PID, 1 cm",
            case: Case::cross(5.0),
            figures: &[("figure_18.svg", "Fig. 18", Attack), ("figure_19.svg", "Fig. 19", Sideslip)],
        },
        Drawn {
            label: "Figs 20, 21: rim 5 kg, nonlinear PID on angles, 1 cm",
            case: on_angles(5.0, nonlinear_on_angles(&RIM_NONLINEAR)),
            figures: &[("figure_20.svg", "Fig. 20", Attack), ("figure_21.svg", "Fig. 21", Sideslip)],
        },
    ]
}

impl Quantity {
    const fn ordinate(self) -> (&'static str, &'static str) {
        match self {
            Self::Attack => ("angle of attack", "rad"),
            Self::Sideslip => ("sideslip", "rad"),
            Self::Altitude => ("altitude", "m"),
            Self::Rates => ("angular rate", "rad/s"),
            Self::Masses => ("position of a mass", "m"),
        }
    }

    const fn labels(self) -> &'static [&'static str] {
        match self {
            Self::Rates => &["roll", "pitch", "yaw"],
            Self::Masses => &["along y", "along z"],
            _ => &[""],
        }
    }
}

/// One flight: times with angles, altitude, rates and masses, and largest angles between the heights that are judged.
struct Flight {
    points: Vec<(f64, [f64; 8])>,
    rms: Option<[f64; 2]>,
    peak: f64,
    held: bool,
}

/// Values of a point by quantity.
fn values(quantity: Quantity, point: &[f64; 8]) -> Vec<f64> {
    let [attack, sideslip, altitude, roll, pitch, yaw, first, second] = *point;
    match quantity {
        Quantity::Attack => vec![attack],
        Quantity::Sideslip => vec![sideslip],
        Quantity::Altitude => vec![altitude],
        Quantity::Rates => vec![roll, pitch, yaw],
        Quantity::Masses => vec![first, second],
    }
}

pub(super) fn sheet(threads: usize) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "paper-figures",
        "Figs 2 to 21, one by one: angles between 20 and 3 km, and the largest of them by the angle at the entry or, without one, by the trim angle \
         of the offset without a law",
        "figures",
        &[
            ("entry_attack_deg", 1),
            ("offset_cm", 1),
            ("attack_rms_deg", 5),
            ("sideslip_rms_deg", 5),
            ("peak_deg", 4),
            ("peak_percent", 2),
        ],
    );
    let cases = drawn();
    let flights = fly_all(&cases, threads, |drawn, record| {
        let descent = Descent::new(&drawn.case)?;
        let metrics = descent.fly(record)?;
        let points = record.samples().iter().step_by(EVERY).map(|s| {
            let (altitude, [attack, sideslip]) = descent.angles(&s.state);
            let [roll, pitch, yaw] = [10, 11, 12].map(|k: usize| s.state.get(k).copied().unwrap_or(f64::NAN));
            (s.time, [attack, sideslip, altitude, roll, pitch, yaw, s.control[0], s.control[1]])
        });
        Ok(Flight {
            points: points.collect(),
            rms: metrics.window.map(|w| w.rms),
            peak: metrics.window.map_or(f64::INFINITY, |w| w.peak[0].max(w.peak[1])),
            held: metrics.held(),
        })
    })?;
    // Without a law the offset alone trims the capsule at this angle.
    let trim = flights.get(1).and_then(|f| f.rms).map_or(f64::NAN, |rms| rms[0]);
    for (drawn, flight) in cases.iter().zip(&flights) {
        let offset = drawn.case.vehicle.offset[0];
        let entry = drawn.case.entry.attack;
        let by = if entry > 0.0 { entry } else { trim };
        let percent = 100.0 * flight.peak / by;
        let degrees = |k: usize| flight.rms.map(|rms| rms[k].to_degrees());
        sheet.push(
            drawn.label,
            vec![
                Some(entry.to_degrees()),
                Some(100.0 * offset),
                degrees(0),
                degrees(1),
                Some(flight.peak.to_degrees()).filter(|v| v.is_finite()),
                Some(percent).filter(|v| v.is_finite()),
            ],
        );
        let verdict = match (flight.held, percent <= CRITERION_PERCENT) {
            (true, true) => "within the criterion of 5 %",
            (true, false) => "beyond the criterion of 5 %",
            (false, _) => "it tumbles",
        };
        sheet.findings.push(format!("{}: {verdict}, {percent:.2} %", drawn.label));
        for (file, number, quantity) in drawn.figures {
            let series = quantity.labels().iter().enumerate().map(|(k, label)| {
                let point = |(time, p): &(f64, [f64; 8])| Some([*time, *values(*quantity, p).get(k)?]);
                GraphSeries {
                    label: (*label).into(),
                    line: flight.points.iter().filter_map(point).collect(),
                    dots: Vec::new(),
                }
            });
            sheet.graphs.push(Graph {
                file,
                title: format!("{number}: {}", drawn.label.split(": ").nth(1).unwrap_or_default()),
                x: ("time", "s"),
                y: quantity.ordinate(),
                series: series.collect(),
            });
        }
    }
    Ok(sheet)
}
