//! The tables: figures, oscillation, authority, speed of the masses.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use apsides_control::pid::PidGains;

use super::cases::{Claim, Figure, figures as cases};
use crate::Error;
use crate::sheet::{Graph, GraphSeries, Sheet};
use crate::stop::Stop;
use apsides_missions::moving_mass::{Case, DampingSet, Descent, Law, Metrics, Record};

/// Root mean square that counts as held, deg: the angles are to be near zero, not within a swing of the entry.
const HELD: f64 = 0.2;
/// Directions of the offset.
pub(super) const DIRECTIONS: usize = 8;

/// Flies cases on several threads, in their order.
pub(super) fn fly_all<C: Sync, R: Send>(
    cases: &[C],
    threads: usize,
    fly: impl Fn(&C, &mut Record) -> Result<R, Error> + Sync,
) -> Result<Vec<R>, Error> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut record = Record::every(1);
        let mut done = Vec::new();
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            let Some(case) = cases.get(k) else { return done };
            done.push((k, fly(case, &mut record)));
        }
    };
    let mut found: Vec<(usize, Result<R, Error>)> = thread::scope(|scope| {
        let spawned: Vec<_> = (0..threads.max(1)).map(|_| scope.spawn(work)).collect();
        // A thread that panicked would have shown a defect: its cases are missing below.
        spawned.into_iter().flat_map(|t| t.join().unwrap_or_default()).collect()
    });
    found.sort_by_key(|(k, _)| *k);
    found.into_iter().map(|(_, flight)| flight).collect()
}

fn fly(cases: &[Case], threads: usize) -> Result<Vec<Metrics>, Error> {
    fly_all(cases, threads, |case, record| Descent::new(case)?.fly(record))
}

/// A case with its offset of 1 cm in a direction: number of eighths of a turn from y towards z.
pub(super) fn towards(case: &Case, direction: usize) -> Case {
    let (sin, cos) = (std::f64::consts::TAU * direction as f64 / DIRECTIONS as f64).sin_cos();
    let mut case = case.clone();
    case.vehicle.offset = [0.01 * cos, 0.01 * sin];
    case
}

fn degrees(values: Option<[f64; 2]>) -> [Option<f64>; 2] {
    match values {
        Some([a, b]) => [Some(a.to_degrees()), Some(b.to_degrees())],
        None => [None; 2],
    }
}

/// The worst peak of several flights, deg; none where one failed.
fn worst_peak(flights: &[Metrics]) -> Option<f64> {
    let worst = flights.iter().map(Metrics::worst_peak).fold(0.0, f64::max).to_degrees();
    worst.is_finite().then_some(worst)
}

/// Returns true if angles are held in a flight.
pub(super) fn held(metrics: &Metrics) -> bool {
    metrics.worst_rms().to_degrees() < HELD
}

/// Cases of the figures with a verdict on each.
pub(super) fn figures(threads: usize) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "figures",
        "Figs 2 to 21 as cases: 500 kg, offset 1 cm along y and z, angles from 20 to 3 km",
        "case",
        &[
            ("attack_rms_deg", 5),
            ("sideslip_rms_deg", 5),
            ("reference_attack_rms_deg", 5),
            ("reference_sideslip_rms_deg", 5),
            ("peak_deg", 4),
            ("peak_entry_10_deg", 4),
            ("worst_peak_of_8_directions_deg", 4),
            ("saturation_time_s", 1),
        ],
    );
    let figures = cases();
    let of = |figure: &Figure| {
        let mut steep = figure.case.clone();
        steep.entry.attack = 10_f64.to_radians();
        let has_offset = figure.case.vehicle.offset != [0.0; 2];
        let directions = (0..DIRECTIONS).filter(|_| has_offset).map(|d| towards(&figure.case, d));
        [figure.case.clone(), steep].into_iter().chain(directions).collect::<Vec<_>>()
    };
    let flown: Vec<Vec<Case>> = figures.iter().map(of).collect();
    let all: Vec<Case> = flown.iter().flatten().cloned().collect();
    let mut metrics = fly(&all, threads)?.into_iter();
    for (figure, cases) in figures.iter().zip(&flown) {
        let found: Vec<Metrics> = metrics.by_ref().take(cases.len()).collect();
        let (nominal, steep, directions) = (&found[0], &found[1], &found[2..]);
        let [a, b] = degrees(nominal.window.map(|w| w.rms));
        let finite = |v: f64| v.is_finite().then(|| v.to_degrees());
        sheet.push(
            figure.label,
            vec![
                a,
                b,
                Some(figure.reference[0]),
                Some(figure.reference[1]),
                finite(nominal.worst_peak()),
                finite(steep.worst_peak()),
                worst_peak(directions).filter(|_| !directions.is_empty()),
                Some(nominal.saturated_time),
            ],
        );
        sheet.findings.push(finding(figure, nominal, steep, directions));
    }
    Ok(sheet)
}

fn finding(figure: &Figure, nominal: &Metrics, steep: &Metrics, directions: &[Metrics]) -> String {
    let everywhere = held(steep) && directions.iter().all(held);
    let seen = match (held(nominal), everywhere) {
        (true, true) => "held, also from 10 deg and in all directions of the offset",
        (true, false) => "held in its own case, not from 10 deg or not in all directions of the offset",
        (false, _) => "not held",
    };
    let verdict = match (figure.claim, held(nominal), everywhere) {
        (Claim::None, ..) => "not in the paper",
        (Claim::Holds, true, true) | (Claim::Swings, true, _) | (Claim::Fails, false, _) => "reproduced",
        (Claim::Holds, true, false) => "partly",
        (Claim::Holds | Claim::Swings, false, _) | (Claim::Fails, true, _) => "not reproduced",
    };
    format!("{}: {verdict}; {seen}; {}", figure.label, figure.why)
}

/// Heights between which the frequency of the oscillation is counted, m.
const COUNTED: [f64; 2] = [8e3, 12e3];

/// Claim (i): what an offset does to amplitude and frequency of the oscillation.
pub(super) fn oscillation() -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "oscillation",
        "Claim (i): an offset of the centre of mass raises amplitude and frequency of the oscillation; no law",
        "offset along y and z",
        &[
            ("attack_rms_deg", 4),
            ("attack_peak_deg", 4),
            ("frequency_at_10_km_hz", 3),
            ("frequency_by_formula_hz", 3),
            ("largest_frequency_by_formula_hz", 3),
            ("height_of_that_km", 1),
        ],
    );
    let mut graph = Graph {
        file: "oscillation.svg",
        title: "angle of attack without law".into(),
        x: ("altitude", "m"),
        y: ("angle of attack", "rad"),
        series: Vec::new(),
    };
    let mut rms = Vec::new();
    for (label, offset) in [("none", 0.0), ("1 cm", 0.01)] {
        let case = Case { law: Law::None, ..Case::cross(10.0) };
        let mut case = case;
        case.vehicle.offset = [offset; 2];
        let descent = Descent::new(&case)?;
        let mut record = Record::every(1);
        let metrics = descent.fly(&mut record)?;
        let (mut turns, mut first, mut last) = (0_usize, None, 0.0);
        let (mut angles, mut largest, mut at_10_km) = (Vec::new(), [0.0, 0.0], None);
        let mut before = [0.0; 2];
        for (k, sample) in record.samples().iter().enumerate() {
            let (height, [attack, _]) = descent.angles(&sample.state);
            let turned = (attack - before[1]) * (before[1] - before[0]) < 0.0;
            if turned && (COUNTED[0]..=COUNTED[1]).contains(&height) {
                turns += usize::from(first.is_some());
                first = first.or(Some(sample.time));
                last = sample.time;
            }
            before = [before[1], attack];
            if k.is_multiple_of(20) {
                angles.push([height, attack]);
                let c = descent.condition(&sample.state);
                let frequency = descent.vehicle().body().static_frequency(c.mach, c.dynamic_pressure);
                if let Some(f) = frequency.filter(|f| *f > largest[0]) {
                    largest = [f, height / 1e3];
                }
                if height <= 10e3 && at_10_km.is_none() {
                    at_10_km = frequency;
                }
            }
        }
        let counted = first.filter(|_| turns > 0).map(|first| 0.5 * turns as f64 / (last - first));
        let window = metrics.window.map(|w| (w.rms[0].to_degrees(), w.peak[0].to_degrees()));
        rms.push(window.map_or(f64::NAN, |w| w.0));
        sheet.push(
            label,
            vec![
                window.map(|w| w.0),
                window.map(|w| w.1),
                counted,
                at_10_km,
                Some(largest[0]),
                Some(largest[1]),
            ],
        );
        graph.series.push(GraphSeries { label: format!("offset {label}"), line: angles, dots: Vec::new() });
    }
    let ratio = rms[1] / rms[0];
    sheet.findings.push(format!(
        "amplitude: reproduced; the root mean square is {ratio:.0} times as large, most of it a trim angle and not an oscillation"
    ));
    sheet.findings.push(
        "higher frequency: not reproduced; sqrt(q S D |Cm_alpha| / I) / 2 pi does not depend on the offset but through the slope at the trim angle"
            .into(),
    );
    sheet.graphs.push(graph);
    Ok(sheet)
}

/// Gains of the reference for the search of thresholds.
fn steep_gains() -> Law {
    Law::pid(PidGains::new(30.0, 30.0, 10.0))
}

/// Cases of the reference by mass of the vehicle: label, case, mass, root mean square of the reference (deg).
const BY_MASS: [(&str, f64, bool, f64, f64); 12] = [
    ("cross 5 kg", 5.0, true, 350.0, 9.956707737771451e-05),
    ("cross 5 kg", 5.0, true, 400.0, 0.24334787195388044),
    ("cross 5 kg", 5.0, true, 500.0, 0.5976585362412664),
    ("cross 5 kg", 5.0, true, 700.0, 1.1108238118112643),
    ("cross 10 kg", 10.0, true, 500.0, 1.7287920301794488e-06),
    ("cross 10 kg", 10.0, true, 700.0, 0.00013704958989925272),
    ("cross 10 kg", 10.0, true, 800.0, 0.29970789879352416),
    ("radial 5 kg by inversion", 5.0, false, 500.0, 3.4035602996531433e-06),
    ("radial 5 kg by inversion", 5.0, false, 525.0, 3.7114805993573674e-06),
    ("radial 5 kg by inversion", 5.0, false, 550.0, 0.16475666507686096),
    ("radial 5 kg by inversion", 5.0, false, 600.0, 0.3131026081214003),
    ("radial 5 kg by inversion", 5.0, false, 700.0, 0.6126672633659324),
];

/// Claims (ii) to (iv): the mass of the vehicle decides.
pub(super) fn authority(threads: usize) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "authority",
        "Claims (ii) to (iv): PID (30, 30, 10), offset 1 cm along y and z, by the mass of the vehicle",
        "masses, vehicle",
        &[
            ("reach_cm", 3),
            ("needed_cm", 3),
            ("attack_rms_deg", 5),
            ("sideslip_rms_deg", 5),
            ("reference_attack_rms_deg", 5),
        ],
    );
    let cases: Vec<Case> = BY_MASS
        .iter()
        .map(|&(_, mass, cross, vehicle, _)| {
            let mut case = if cross { Case::cross(mass) } else { Case::radial(mass) };
            (case.vehicle.mass, case.law) = (vehicle, steep_gains());
            case
        })
        .collect();
    let flights = fly(&cases, threads)?;
    for (((label, _, cross, vehicle, reference), case), metrics) in BY_MASS.iter().zip(&cases).zip(&flights) {
        let [y, z] = case.vehicle.offset;
        let needed = if *cross { y.abs().max(z.abs()) } else { y.hypot(z) };
        let [a, b] = degrees(metrics.window.map(|w| w.rms));
        let row = vec![Some(case.authority() * 100.0), Some(needed * 100.0), a, b, Some(*reference)];
        sheet.push(format!("{label}, {vehicle} kg"), row);
        // The static law: held where the reach is not less than the offset.
        if (case.authority() >= needed * (1.0 - 1e-9)) != (metrics.worst_rms().to_degrees() < 0.01) {
            sheet.findings.push(format!("{label}, {vehicle} kg: the static law says otherwise"));
        }
    }
    if sheet.findings.is_empty() {
        sheet.findings.push(
            "held exactly where the reach is not less than the offset: m 0.70 m / M an axis of a cross, 2 m 0.75 m / M on a rim".into(),
        );
    }
    sheet.findings.push(
        "claim (ii), a cross of 10 kg under PID holds: reproduced for a travel to both sides, vehicles up to 700 kg and ideal actuators".into(),
    );
    sheet.findings.push(
        "claim (iii), PID on a rim fails: reproduced where the law drives the angles; by inversion the linear law holds, so that the failure is \
         of the allocation"
            .into(),
    );
    sheet.findings.push(
        "claim (iv), a cross of 5 kg fails: reproduced above 350 kg of vehicle; that a rim of 5 kg holds under nonlinear PID: partly, for the \
         case it was tuned for; what a rim buys is its reach"
            .into(),
    );
    Ok(sheet)
}

/// Largest speeds of the masses, m/s, with gains that the reference found for each: damped set, driven set.
const RATES: [(f64, Option<[[f64; 3]; 2]>); 5] = [
    (1.0, None),
    (
        0.5,
        Some([
            [0.1603937182542225, 6.169943992813842, 5.15446767404193],
            [34.45294856173914, 21.19118945704602, 30.501774303461346],
        ]),
    ),
    (
        0.2,
        Some([
            [1.7249398417493524, 2.8545196158869044, 10.860345106216773],
            [6.18446180915577, 2.521919578195056, 24.139179649668893],
        ]),
    ),
    (
        0.1,
        Some([
            [0.028358546682171255, 1.6299603671460237, 1.1472519781579233],
            [0.4286048766335166, 1.0822408748712042, 3.4897800665953773],
        ]),
    ),
    (
        0.05,
        Some([
            [0.0018403221672238154, 1.3619964457278964, 0.49838851684920915],
            [0.030875596174782242, 1.018037742771459, 1.169671945339389],
        ]),
    ),
];

/// A case that the paper leaves out: masses that move no faster than their drives.
pub(super) fn rates(threads: usize) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "rates",
        "Beyond the paper: cross of 10 kg whose masses have a largest speed; worst of eight directions of 1 cm",
        "gains, damping, speed",
        &[
            ("attack_rms_deg", 5),
            ("sideslip_rms_deg", 5),
            ("worst_rms_of_8_deg", 5),
            ("worst_peak_of_8_deg", 4),
        ],
    );
    let mut labels = Vec::new();
    let mut cases = Vec::new();
    for (k, (damping, name)) in
        [(DampingSet::Constant, "damped"), (DampingSet::Unstable, "driven")].into_iter().enumerate()
    {
        for (rate, tuned) in RATES {
            let sets = [("(10, 5, 5)", Some([10.0, 5.0, 5.0])), ("of the reference", tuned.map(|t| t[k]))];
            for (gains, set) in sets {
                let Some([p, i, d]) = set else { continue };
                let mut case = Case { law: Law::pid(PidGains::new(p, i, d)), ..Case::cross(10.0) };
                case.vehicle.damping = damping;
                case.actuators.rate = Some(rate);
                labels.push(format!("{gains}, {name}, {rate} m/s"));
                cases.push(case.clone());
                cases.extend((0..DIRECTIONS).map(|d| towards(&case, d)));
            }
        }
    }
    let flights = fly(&cases, threads)?;
    let mut all_held = true;
    for (label, found) in labels.iter().zip(flights.chunks(DIRECTIONS + 1)) {
        let [a, b] = degrees(found[0].window.map(|w| w.rms));
        let rms = found[1..].iter().map(Metrics::worst_rms).fold(0.0, f64::max).to_degrees();
        let rms = rms.is_finite().then_some(rms);
        all_held &= !label.starts_with("of") || rms.is_some_and(|rms| rms < 0.01);
        sheet.push(label.clone(), vec![a, b, rms, worst_peak(&found[1..])]);
    }
    sheet.findings.push(
        "missing numbers are flights that failed: the capsule tumbles. Gains that ideal actuators bear make it swing or tumble with masses \
         of 0.2 m/s, more than without a law (2 deg)"
            .into(),
    );
    if all_held {
        sheet.findings.push(
            "with gains for each speed all eight directions are held below 0.01 deg, down to 0.05 m/s".into(),
        );
    }
    Ok(sheet)
}
