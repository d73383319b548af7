//! `apsides reproduce lunar-landing`: every row of Tables 2 and 3 of R. Jamilnia, Modares Mechanical Engineering
//! 17(10), 2017, three ways.
//!
//! Reference numbers. Optima: indirect shooting of the same equations (DOP853, 1e-13). The paper's own nonlinear program: the same
//! discretisation in CasADi, solved by Ipopt from many starts, flown again by DOP853 with restarts at the knots.
#![allow(clippy::unwrap_used)]

use std::sync::OnceLock;

use apsides_publications::{Comparison, FindingKind, Part, Reproduction, Row, Sheet, Table, reproduce};
use apsides_tests::Patience;
use apsides_tests::tolerance::{FLIGHT_TIME_S, GATE_SPEED_M_S, TWO_PHASE_TIME_S};

/// Flight times by refined flatness against shooting, s: one phase.
const FLATNESS_TIME_S: f64 = 1e-6;
/// The same with two phases, s.
const FLATNESS_TWO_PHASE_TIME_S: f64 = 1e-3;
/// Half of the last digit of the reference for times of the paper's own NLP with one phase, s.
const NLP_TIME_S: f64 = 5e-5;
/// The same with two phases, s.
const NLP_TWO_PHASE_TIME_S: f64 = 5e-4;

/// Published: half of the last digit of the reference for thrust angles of that program, deg.
const NLP_ANGLE_DEG: f64 = 5e-4;
/// Published: half of the last digit of the reference for thrust angles of the optimum, deg.
const ANGLE_DEG: f64 = 5e-5;
/// Published: half of the last digit of the reference for misses in speed, m/s.
const MISS_M_S: f64 = 5e-3;
/// Published: half of the last digit of differences from the paper, deg.
const PAPER_ANGLE_DEG: f64 = 5e-3;
/// Published: the last digit of the times of the paper, s.
const PAPER_TIME_S: f64 = 1e-3;

fn reproduction() -> &'static Reproduction {
    static DONE: OnceLock<Reproduction> = OnceLock::new();
    DONE.get_or_init(|| reproduce("lunar-landing", 1, &mut (), |_| true).unwrap())
}

fn sheet(id: &str) -> &'static Sheet {
    reproduction().sheets.iter().find(|s| s.id == id).unwrap()
}

fn table(id: &str) -> &'static Table {
    reproduction().tables.iter().find(|t| t.id == id).unwrap()
}

fn quantity<'a>(row: &'a Row, key: &str) -> &'a Comparison {
    row.quantities.iter().find(|q| q.key == key).unwrap()
}

fn near(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((found - expected).abs() < tolerance, "{what}: found {found}, expected {expected}");
}

/// Parameters of the rows with a finding of this kind about this quantity.
fn rows_with(id: &str, key: &str, kind: FindingKind) -> Vec<f64> {
    let has = |row: &&Row| quantity(row, key).findings.iter().any(|f| f.kind == kind);
    table(id).rows.iter().filter(has).map(|row| row.parameter).collect()
}

fn finding(id: &str, parameter: f64, key: &str, kind: FindingKind) -> &'static str {
    let row = table(id).rows.iter().find(|r| r.parameter == parameter).unwrap();
    &quantity(row, key).findings.iter().find(|f| f.kind == kind).unwrap().text
}

/// Altitude, then optimal time and mass.
const OPTIMA_2: [(f64, f64, f64); 7] = [
    (100.0, 1037.2005909330594, 149.8872563012772),
    (50.0, 1012.291947788343, 152.37822362745808),
    (25.0, 1001.3902427828095, 153.38599494117895),
    (20.0, 999.3569839960355, 153.56519464235802),
    (15.0, 997.3758488117479, 153.73649062922414),
    (10.0, 995.4480792466301, 153.89970137117336),
    (5.0, 993.5748653764407, 154.0546528425521),
];

/// Altitude, optimal thrust angle at touchdown; of the paper's own NLP: time less the optimum, that angle, and by how much it misses
/// in radius, horizontal and radial speed.
const OWN_2: [(f64, f64, f64, f64, [f64; 3]); 7] = [
    (100.0, 121.9762, -0.3277, 122.783, [1156.0, 1.40, 0.70]),
    (50.0, 126.6767, -0.2508, 127.521, [275.0, 1.00, -0.59]),
    (25.0, 129.3800, -0.2125, 130.230, [59.8, 0.80, -0.86]),
    (20.0, 129.9497, -0.2053, 130.800, [35.0, 0.77, -0.89]),
    (15.0, 130.5290, -0.1983, 131.378, [15.6, 0.75, -0.90]),
    (10.0, 131.1179, -0.1917, 131.966, [1.4, 0.72, -0.90]),
    (5.0, 131.7163, -0.1853, 132.563, [-8.2, 0.70, -0.89]),
];

/// Unknowns and constraints with flat outputs and without (R. Jamilnia 2017: 2 n + 1 and 5 n + 1, 15 + 7 and 4 x 15 + 7, with n = 15).
#[test]
fn programs_with_and_without_flatness() {
    let sheet = sheet("without-flatness");
    let size = |row: &str| ["variables", "constraints"].map(|key| sheet.value(row, key));
    for landing in ["from 100 km", "from a perilune at 15 km"] {
        assert_eq!(size(&format!("{landing}, flat outputs")), [Some(31.0), Some(22.0)]);
        let all = size(&format!("{landing}, all states"));
        assert!(all == [Some(76.0), Some(67.0)] || all == [None; 2], "{all:?}");
    }
}

/// Both objectives of the paper have one optimum, and an impulse removes the rise.
#[test]
fn objectives_and_the_rise_of_the_path() {
    let objectives = sheet("objectives");
    for landing in ["from 100 km", "from a perilune at 15 km", "to a gate at 2 km"] {
        let of = |objective: &str| {
            objectives.value(&format!("{landing}, collocation, {objective}"), "flight_time_s").unwrap()
        };
        near(of("flight time"), of("final mass"), FLIGHT_TIME_S, landing);
    }
    let rise = sheet("rise");
    // The optimum from 15 km reaches 20.998 km.
    assert!((rise.value("15", "rise_m").unwrap() - 5998.0).abs() < 1.0);
    for perilune in ["5", "15", "25"] {
        assert!(
            rise.value(perilune, "impulse_m_s").unwrap() > 0.0
                && rise.value(perilune, "price_kg").unwrap() < 0.0
        );
        // Its size as an unknown: larger yet, with less propellant, and proved.
        let of = |key: &str| rise.value(perilune, key).unwrap();
        assert!(of("best_impulse_m_s") > of("impulse_m_s") && of("best_is_verified") == 1.0, "{perilune}");
        assert!(of("propellant_with_best_impulse_kg") < of("propellant_with_impulse_kg"));
    }
}

/// The thrust of the plan does not land a deviating flight; new plans do, at rest up to what the navigation does not see.
#[test]
fn dispersed_landings() {
    let sheet = sheet("dispersion");
    for landing in ["perilune at 15 km (Fig. 2)", "gate at 2 km (Fig. 3)"] {
        let of = |steering: &str, key: &str| sheet.value(&format!("{landing}, {steering}"), key).unwrap();
        assert!(of("thrust of the plan", "up_m") > 100.0 && of("planned anew", "up_m") < 100.0);
        assert_eq!(of("planned anew", "failed"), 0.0);
    }
}

#[test]
fn table_2_optimum() {
    let rows = &table("table-2").rows;
    assert_eq!(rows.len(), OPTIMA_2.len());
    for (row, (altitude, time, mass)) in rows.iter().zip(OPTIMA_2) {
        assert_eq!(row.parameter, altitude);
        assert!(row.solved && row.verified, "{altitude} km");
        let (t, m) = (quantity(row, "flight_time_s"), quantity(row, "final_mass_kg"));
        near(t.flatness.unwrap(), time, FLATNESS_TIME_S, "time by flatness");
        near(t.radau.unwrap(), time, FLIGHT_TIME_S, "time by Radau");
        near(m.flatness.unwrap(), mass, FLATNESS_TIME_S, "mass by flatness");
    }
}

#[test]
fn table_2_by_the_paper_s_own_nlp() {
    for (row, (altitude, angle, difference, own_angle, [radius, horizontal, radial])) in
        table("table-2").rows.iter().zip(OWN_2)
    {
        assert_eq!((row.parameter, row.size), (altitude, Some((31, 22))));
        let (t, a) = (quantity(row, "flight_time_s"), quantity(row, "final_thrust_angle_deg"));
        near(t.paper_nlp_difference().unwrap(), difference, NLP_TIME_S, "time less the optimum");
        near(a.paper_nlp.unwrap(), own_angle, NLP_ANGLE_DEG, "thrust angle");
        near(a.radau.unwrap(), angle, ANGLE_DEG, "optimal thrust angle");
        // Half of the last digit of the reference.
        let miss = row.miss.unwrap();
        near(miss.radius_m, radius, if radius > 100.0 { 0.5 } else { 0.05 }, "miss in radius");
        near(miss.horizontal_speed_m_s, horizontal, MISS_M_S, "miss in horizontal speed");
        near(miss.radial_speed_m_s, radial, MISS_M_S, "miss in radial speed");
    }
}

#[test]
fn table_3() {
    // Gate; optimal braking and descent time, gate speed, total, mass; total of the paper's own NLP.
    let cases = [
        (5.0, 951.40735, 84.93899, -109.64264, 1036.346337936439, 148.096341, 1036.222),
        (4.0, 956.01968, 75.71077, -98.20081, 1031.730449948327, 148.764392, 1031.600),
        (3.0, 961.41222, 65.18720, -85.20649, 1026.5994207858944, 149.507000, 1026.461),
        (2.0, 968.00827, 52.64708, -69.77252, 1020.6553452674615, 150.367278, 1020.506),
        (1.0, 976.89249, 36.23780, -49.61514, 1013.1302850041927, 151.456371, 1012.967),
    ];
    let rows = &table("table-3").rows;
    assert_eq!(rows.len(), cases.len());
    for (row, (gate, braking, descent, speed, time, mass, own)) in rows.iter().zip(cases) {
        assert_eq!(row.parameter, gate);
        assert!(row.solved && row.verified, "{gate} km");
        let total = quantity(row, "flight_time_s");
        near(total.flatness.unwrap(), time, FLATNESS_TWO_PHASE_TIME_S, "time by flatness");
        near(total.radau.unwrap(), time, TWO_PHASE_TIME_S, "time by Radau");
        near(total.paper_nlp.unwrap(), own, NLP_TWO_PHASE_TIME_S, "time by the paper's own NLP");
        let optimum = |key: &str| quantity(row, key).radau.unwrap();
        near(optimum("braking_time_s"), braking, TWO_PHASE_TIME_S, "braking");
        near(optimum("descent_time_s"), descent, TWO_PHASE_TIME_S, "descent");
        near(optimum("gate_radial_velocity_m_s"), speed, GATE_SPEED_M_S, "speed at the gate");
        near(optimum("final_mass_kg"), mass, FLIGHT_TIME_S, "mass");
        // Tens of metres: no trajectory either.
        assert!(row.miss.unwrap().radius_m.abs() > 10.0);
    }
}

#[test]
fn findings_name_the_rows_that_cannot_be() {
    use FindingKind::{AboveMinimum, BelowMinimum, Contradiction, ImpossibleMass, NotSolved, NotVerified};
    let six = [100.0, 50.0, 25.0, 20.0, 15.0, 10.0];
    assert_eq!(rows_with("table-2", "flight_time_s", BelowMinimum), six);
    assert_eq!(rows_with("table-2", "final_mass_kg", ImpossibleMass), six);
    assert_eq!(rows_with("table-2", "flight_time_s", AboveMinimum), [5.0]);
    assert_eq!(rows_with("table-2", "final_mass_kg", Contradiction), [100.0]);
    assert_eq!(rows_with("table-3", "flight_time_s", BelowMinimum), [2.0, 1.0]);
    assert_eq!(rows_with("table-3", "final_mass_kg", ImpossibleMass), [2.0, 1.0]);
    assert_eq!(rows_with("table-3", "flight_time_s", AboveMinimum), [5.0, 4.0, 3.0]);
    assert!(rows_with("table-3", "final_mass_kg", Contradiction).is_empty());
    for id in ["table-2", "table-3"] {
        for kind in [NotSolved, NotVerified] {
            assert!(rows_with(id, "flight_time_s", kind).is_empty());
        }
    }
    assert_eq!(
        finding("table-2", 15.0, "flight_time_s", BelowMinimum),
        "printed time below the minimum by 0.073 s: not a feasible trajectory"
    );
    assert_eq!(
        finding("table-3", 1.0, "final_mass_kg", ImpossibleMass),
        "printed mass above the largest possible by 0.249 kg"
    );
}

#[test]
fn printed_rows_that_contradict_themselves() {
    let mass = finding("table-2", 100.0, "final_mass_kg", FindingKind::Contradiction);
    assert!(mass.contains("after 1036.891 s") && mass.contains("the time is likely misprinted"), "{mass}");
    // Where the printed descent ends when it is flown: hundreds of metres above the ground.
    let ends = [
        (5.0, "120 m", "-4.75"),
        (4.0, "296 m", "-4.77"),
        (3.0, "273 m", "-4.97"),
        (2.0, "415 m", "-4.97"),
        (1.0, "387 m", "-4.98"),
    ];
    for (gate, altitude, speed) in ends {
        let text = finding("table-3", gate, "descent_time_s", FindingKind::Contradiction);
        assert!(text.contains(&format!("is {altitude} above the ground at {speed} m/s")), "{text}");
    }
}

/// The trends of the notes, from the numbers.
#[test]
fn notes_follow_from_the_numbers() {
    let rows = &table("table-2").rows;
    let (last, others) = rows.split_last().unwrap();
    let excess = |row: &Row| quantity(row, "final_thrust_angle_deg").paper_difference().unwrap();
    assert!(others.iter().all(|row| (0.795..0.885).contains(&excess(row))));
    near(excess(last), 1.81, PAPER_ANGLE_DEG, "5 km");
    let shortfall = |row: &Row| -quantity(row, "flight_time_s").paper_difference().unwrap();
    assert!(others[1..].iter().all(|row| (0.035..0.085).contains(&shortfall(row))));
    let noted = |id, key| rows_with(id, key, FindingKind::Note);
    assert_eq!(noted("table-2", "flight_time_s"), [5.0]);
    assert_eq!(noted("table-2", "final_thrust_angle_deg"), [5.0]);
    assert_eq!(noted("table-3", "flight_time_s"), [2.0]);
    let near_optimum = &table("table-3").rows[3];
    let differences =
        ["braking_time_s", "descent_time_s"].map(|k| quantity(near_optimum, k).paper_difference().unwrap());
    near(differences[0], 6.196, PAPER_TIME_S, "braking");
    near(differences[1], -6.256, PAPER_TIME_S, "descent");
    let orbit = &reproduction().remarks[0];
    assert!(orbit.contains("1633.98 m/s") && orbit.contains("1680.36 m/s"), "{orbit}");
}

#[test]
fn an_interruption_keeps_the_rows_done() {
    let stopped = reproduce("lunar-landing", 1, &mut Patience(120), |_| true).unwrap();
    assert!(!stopped.complete);
    let rows = &stopped.tables[0].rows;
    assert!((1..7).contains(&rows.len()), "{}", rows.len());
    assert_eq!(rows[..], table("table-2").rows[..rows.len()]);
    let two =
        reproduce("lunar-landing", 1, &mut (), |p| !matches!(p, Part::Row(t) if t.rows.len() >= 2)).unwrap();
    let rows: Vec<usize> = two.tables.iter().map(|t| t.rows.len()).collect();
    assert_eq!((two.complete, rows), (false, vec![2, 0]));
    assert!(reproduction().complete);
}

#[test]
fn unknown_names_are_refused_with_the_known_ones() {
    let message = reproduce("lunar", 1, &mut (), |_| true).unwrap_err().to_string();
    assert_eq!(
        message,
        "reproduce: `name` is \"lunar\", allowed is \"lunar-landing\" or \"geo-injection\" or \"capsule-reentry\" or \"chang-e-3\" or \"moving-mass\" or \"powered-descent\""
    );
}

/// The page of all items is the one in the documentation.
#[test]
fn the_page_of_items_is_up_to_date() {
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/papers.md")).unwrap();
    assert!(
        page == apsides_publications::items_markdown(),
        "run `apsides reproduce --items > docs/papers.md`"
    );
}
