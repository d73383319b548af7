//! The main braking: ends at the gate, datums, plane and space.

use apsides_dynamics::planar;

use super::case::{BRAKING, PLANE, SolvedCase, solve, solve_from};
use crate::Observer;
use crate::change::{Change, number, word};
use crate::sheet::{Graph, GraphSeries, Sheet};
use crate::stop::Stop;
use crate::workers::Workers;

/// A case with what the reference found for it: propellant (kg), time (s), central angle (deg).
struct BrakingCase {
    label: &'static str,
    changes: &'static [Change<'static>],
    /// The case whose solution it starts from: without one it ends in another local optimum.
    from: Option<&'static [Change<'static>]>,
    reference: [f64; 3],
}

const HORIZONTAL: Change<'static> = word("gate_direction", "horizontal");
/// Altitudes above the perilune of 15 x 100 km over the mean radius, the gate over the site.
const MIXED: [Change<'static>; 3] = [
    number("site_altitude_m", -2641.0),
    number("perilune_altitude_km", 17.641),
    number("apolune_altitude_km", 102.641),
];

impl BrakingCase {
    const fn new(label: &'static str, changes: &'static [Change<'static>], reference: [f64; 3]) -> Self {
        Self { label, changes, from: None, reference }
    }

    const fn from(self, from: &'static [Change<'static>]) -> Self {
        Self { from: Some(from), ..self }
    }
}

const ROWS: [BrakingCase; 15] = [
    BrakingCase::new("plane, 57 m/s", &[PLANE], [1_054.168_327_758, 424.955_306, 13.323_735]),
    BrakingCase::new(
        "plane, 57 m/s down",
        &[PLANE, word("gate_direction", "down")],
        [1_071.642_258_191, 439.365_003, 13.693_924],
    ),
    BrakingCase::new(
        "plane, 57 m/s horizontal",
        &[PLANE, HORIZONTAL],
        [1_057.206_553_882, 534.523_578, 19.153_172],
    ),
    BrakingCase::new(
        "plane, at rest",
        &[PLANE, number("gate_speed_m_s", 0.0)],
        [1_083.627_316_859, 446.772_169, 13.909_219],
    ),
    BrakingCase::new(
        "plane, start at 1692.528 m/s",
        &[PLANE, number("start_speed_m_s", f64::INFINITY)],
        [1_054.402_023_468, 425.175_092, 13.337_961],
    ),
    BrakingCase::new(
        "plane, full thrust all along",
        &[PLANE, number("min_thrust_n", 7499.999)],
        [1_054.170_037_370, 413.234_655, 12.677_526],
    ),
    BrakingCase::new(
        "plane, altitudes from the site",
        &[PLANE, number("site_altitude_m", -2641.0), number("start_speed_m_s", f64::INFINITY)],
        [1_055.159_831_712, 425.619_190, 13.385_516],
    ),
    BrakingCase::new(
        "plane, perilune over the mean radius, gate over the site",
        &[PLANE, MIXED[0], MIXED[1], MIXED[2]],
        [1_056.321_950_905, 514.972_066, 18.120_741],
    )
    .from(&[PLANE, HORIZONTAL]),
    BrakingCase::new("space, northwards", &[], [1_054.169_143_737, 424.956_432, 13.323_826]),
    BrakingCase::new(
        "space, northwards, indirect shooting",
        &[word("method", "indirect")],
        [1_054.169_143_737, 424.956_432, 13.323_826],
    ),
    BrakingCase::new(
        "space, start at 1692.528 m/s",
        &[number("start_speed_m_s", f64::INFINITY)],
        [1_054.402_838_737, 425.176_229, 13.338_052],
    ),
    BrakingCase::new(
        "space, southwards",
        &[number("orbit_azimuth_deg", 180.0)],
        [1_054.170_233_288, 424.955_702, 13.323_758],
    ),
    BrakingCase::new(
        "space, altitudes from the site",
        &[number("site_altitude_m", -2641.0), number("start_speed_m_s", f64::INFINITY)],
        [1_055.160_640_922, 425.620_315, 13.385_607],
    ),
    BrakingCase::new(
        "space, perilune over the mean radius, gate over the site",
        &[MIXED[0], MIXED[1], MIXED[2], number("start_speed_m_s", f64::INFINITY)],
        [1_056.555_994_888, 515.319_582, 18.141_659],
    )
    .from(&[HORIZONTAL]),
    // The reference has none.
    BrakingCase::new("space, oblate Moon (J2, C22)", &[word("gravity", "degree-2")], [f64::NAN; 3]),
];

const COLUMNS: &[(&str, usize)] = &[
    ("propellant_kg", 6),
    ("reference_kg", 6),
    ("found_less_reference_kg", 6),
    ("flight_time_s", 4),
    ("reference_s", 4),
    ("central_angle_deg", 4),
    ("reference_deg", 4),
    ("first_switch_s", 4),
    ("second_switch_s", 4),
    ("perilune_latitude_deg", 4),
    ("perilune_longitude_deg", 4),
    ("verified", 0),
];

/// A row that is nearer to the reference than this agrees with it; kg.
const AGREEMENT_KG: f64 = 1e-4;

pub(super) fn sheet(workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "braking",
        "Main braking from the perilune to 3 km: least propellant beside the reference (indirect shooting, residual below 1e-10)",
        "case",
        COLUMNS,
    )
    .with_flags(&["verified"]);
    let solved = workers.all(&ROWS, solve_row)?;
    let mut graph = Vec::new();
    let mut found = Vec::new();
    for (row, solved) in ROWS.iter().zip(solved) {
        match solved {
            Ok(s) => {
                sheet.push(row.label, values(row, Some(&s)));
                s.check(row.label, &mut sheet);
                if row.changes.contains(&PLANE) {
                    graph.push(GraphSeries { label: row.label.into(), line: profile(&s), dots: Vec::new() });
                }
                found.push((row, s));
            }
            Err(why) => {
                sheet.push(row.label, values(row, None));
                sheet.failures.push(why);
            }
        }
    }
    sheet.findings = findings(&found);
    sheet.graphs = vec![Graph {
        file: "braking_profile.svg",
        title: "Main braking in the plane: altitude over the way on the ground".into(),
        x: ("way on the ground", "m"),
        y: ("altitude over the mean radius", "m"),
        series: graph,
    }];
    Ok(sheet)
}

fn solve_row(row: &BrakingCase, observer: &mut dyn Observer) -> Result<SolvedCase, Stop> {
    let start = match row.from {
        Some(from) => Some(solve(BRAKING, from, observer)?.trajectory),
        None => None,
    };
    solve_from(BRAKING, row.changes, start.as_ref(), observer).map(|(_, o)| SolvedCase::of(o))
}

fn values(row: &BrakingCase, solved: Option<&SolvedCase>) -> Vec<Option<f64>> {
    let of = |key: &str| solved.map(|s| s.get(key)).filter(|v| v.is_finite());
    let [propellant, time, angle] = row.reference.map(|v| Some(v).filter(|v| v.is_finite()));
    let switches = solved.map(SolvedCase::switches).unwrap_or_default();
    vec![
        of("propellant_kg"),
        propellant,
        of("propellant_kg").zip(propellant).map(|(a, b)| a - b),
        of("flight_time_s"),
        time,
        of("central_angle_deg"),
        angle,
        switches.first().copied(),
        switches.get(1).copied(),
        of("perilune_latitude_deg"),
        of("perilune_longitude_deg"),
        solved.map(|s| f64::from(u8::from(s.verified()))),
    ]
}

fn findings(found: &[(&BrakingCase, SolvedCase)]) -> Vec<String> {
    let of = |label: &str| found.iter().find(|(r, _)| r.label == label).map(|(_, s)| s.get("propellant_kg"));
    let known = found.iter().filter(|(r, _)| r.reference[0].is_finite());
    let off = |(r, s): &&(&BrakingCase, SolvedCase)| s.get("propellant_kg") - r.reference[0];
    let (near, far): (Vec<_>, Vec<_>) = known.partition(|f| off(f).abs() <= AGREEMENT_KG);
    let mut findings = vec![format!("{} rows are within {AGREEMENT_KG} kg of the reference.", near.len())];
    for f in far {
        let (row, _) = f;
        let sense =
            if off(&f) < 0.0 { "less: another extremal, better than that of the reference" } else { "more" };
        findings.push(format!("{}: {:.1} g {sense}.", row.label, 1e3 * off(&f).abs()));
    }
    let cost = |a: &str, b: &str| Some(of(a)? - of(b)?);
    if let Some(rotation) = cost("space, northwards", "plane, 57 m/s") {
        findings.push(format!("The rotation of the Moon costs {:.2} g.", 1e3 * rotation));
    }
    if let Some(down) = cost("plane, perilune over the mean radius, gate over the site", "plane, 57 m/s") {
        findings.push(format!(
            "Altitudes over two datums cost {down:.3} kg. The thrust begins at its largest there; a braking with full thrust all along is \
             another local optimum, some 0.03 kg above."
        ));
    }
    if let Some(full) = cost("plane, full thrust all along", "plane, 57 m/s") {
        findings.push(format!("Full thrust from the start, without the switch, costs {:.2} g.", 1e3 * full));
    }
    findings
}

const SAMPLES: usize = 300;
/// Places of the angle and the radius among the states of a flight in the plane.
const ANGLE_AT: usize = planar::POLAR_ANGLE.index_in(&planar::STATES);
const RADIUS_AT: usize = planar::RADIUS.index_in(&planar::STATES);

fn profile(solved: &SolvedCase) -> Vec<[f64; 2]> {
    let Some(phase) = solved.trajectory.phases.first() else { return Vec::new() };
    let radius = super::orbit::RADIUS;
    let point = |k: usize| {
        let x = phase.state_at(phase.time_at(k as f64 / SAMPLES as f64));
        [x[ANGLE_AT] * radius, x[RADIUS_AT] - radius]
    };
    (0..=SAMPLES).map(point).collect()
}
