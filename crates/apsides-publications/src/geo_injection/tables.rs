//! Tables 2 to 6: every burn by its own rule beside the burns of the joint optimum, and what the sequences cost.

use std::collections::BTreeMap;

use super::burns::{Apsis, Between, Burn, Flown, Goal, flight_time, sequence};
use super::printed::{BurnTable, REFERENCE_20, STATED_MASS, USED_MASS};
use super::stage::{Solver, Stage, Stop, keep};
use crate::Outcome;
use crate::change::{number, word};
use crate::sheet::Sheet;
use apsides_pipeline::method::MethodName;

/// One printed table computed with one initial mass.
pub(super) struct Case {
    /// Burns by the printed rule.
    pub(super) burns: Vec<Option<Flown>>,
    /// Results of the joint optimum by collocation.
    optimum: Option<BTreeMap<String, f64>>,
    /// Its propellant by indirect shooting, kg.
    indirect: Option<f64>,
}

/// The parts of one printed table that later tables need.
pub(super) struct Sequence {
    pub(super) printed: &'static BurnTable,
    pub(super) used: Case,
    pub(super) stated: Case,
    /// Propellant with free orbits between the burns, by the printed rule otherwise, kg.
    class: Option<f64>,
}

impl Case {
    fn of(
        printed: &BurnTable,
        stage: &Stage,
        solver: &mut Solver<'_>,
        sheet: &mut Sheet,
    ) -> Result<Self, Stop> {
        let n = printed.burns.len();
        let burns = if printed.has_orbits() {
            rows(printed, stage, solver, sheet)?
        } else {
            let found = keep(sheet, sequence(stage, &printed.guess(stage), Between::Sizes, solver))?;
            found.map_or_else(|| vec![None; n], |burns| burns.into_iter().map(Some).collect())
        };
        let mut joint = |method: MethodName| {
            let method = method.word();
            let (name, mass) = (format!("geo-{n}-burn"), stage.mass);
            let changes = [number("initial_mass_kg", mass), word("method", method)];
            let Some(outcome) = keep(sheet, solver.mission(&name, &changes, None))? else {
                return Ok(None);
            };
            if !outcome.summary.certificate.is_verified() {
                sheet.unverified.push(format!("{name} with {mass} kg by the method `{method}`"));
            }
            Ok::<_, Stop>(Some(outcome.summary.results))
        };
        let optimum = joint(MethodName::Radau)?;
        let indirect = joint(MethodName::Indirect)?.and_then(|results| results.get("propellant_kg").copied());
        Ok(Self { burns, optimum, indirect })
    }

    fn optimum(&self, key: &str) -> Option<f64> {
        self.optimum.as_ref()?.get(key).copied()
    }

    fn propellant(&self) -> Option<f64> {
        self.optimum("propellant_kg")
    }

    fn time(&self, burn: usize) -> Option<f64> {
        Some(self.burns[burn]?.time)
    }

    /// Sum of the burn times by the rule, s.
    fn total(&self) -> Option<f64> {
        (0..self.burns.len()).map(|k| self.time(k)).sum()
    }
}

fn less(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    Some(a? - b?)
}

/// The shortest burn of each row, from the printed orbit and with the printed mass before it.
fn rows(
    printed: &BurnTable,
    stage: &Stage,
    solver: &mut Solver<'_>,
    sheet: &mut Sheet,
) -> Result<Vec<Option<Flown>>, Stop> {
    let mut flown = Vec::new();
    for (k, (from, mass)) in printed.ignitions(stage).into_iter().enumerate() {
        let row = &printed.burns[k];
        let Some(orbit) = row.orbit() else { break };
        let burn = Burn { from, mass, apsis: Apsis::of(k, printed.burns.len()), goal: Goal::Orbit(orbit) };
        flown.push(keep(sheet, burn.solve(stage, row.time, solver))?);
    }
    Ok(flown)
}

const COLUMNS: &[(&str, usize)] = &[
    ("printed_semi_major_axis_km", 1),
    ("printed_eccentricity", 4),
    ("printed_propellant_kg", 2),
    ("printed_time_s", 1),
    ("time_of_propellant_s", 3),
    ("rule_22170_s", 3),
    ("printed_less_rule_22170_s", 3),
    ("rule_22100_s", 3),
    ("printed_less_rule_22100_s", 3),
    ("optimum_22170_s", 3),
    ("optimum_semi_major_axis_km", 1),
    ("optimum_eccentricity", 4),
];

pub(super) const TOTAL: &str = "sum";

/// One of Tables 2 to 6 for the initial masses that were used and stated.
pub(super) fn table(
    printed: &'static BurnTable,
    [used, stated]: &[Stage; 2],
    solver: &mut Solver<'_>,
) -> Result<(Sheet, Sequence), Stop> {
    let n = printed.burns.len();
    let title = format!(
        "Table {}: {n} burns as printed, by the printed rule with {USED_MASS} and {STATED_MASS} kg, and in the joint optimum",
        printed.number
    );
    let mut sheet = Sheet::new(printed.id, title, "burn", COLUMNS);
    let found = Sequence {
        printed,
        used: Case::of(printed, used, solver, &mut sheet)?,
        stated: Case::of(printed, stated, solver, &mut sheet)?,
        class: keep(&mut sheet, sequence(used, &printed.guess(used), Between::Orbits, solver))?
            .map(|burns| burns.iter().map(|b| b.time).sum::<f64>() * used.mass_flow()),
    };
    for (k, row) in printed.burns.iter().enumerate() {
        let exact = Some(row.time_of_propellant(used));
        let optimum = |what: &str| {
            found.used.optimum(&format!(
                "{}_{}_{what}",
                if what == "time_s" { "burn" } else { "orbit" },
                k + 1
            ))
        };
        let (a, b) = (found.used.time(k), found.stated.time(k));
        sheet.push(
            format!("{}", k + 1),
            vec![
                row.axis_km,
                Some(row.eccentricity),
                Some(row.propellant),
                Some(row.time),
                exact,
                a,
                less(exact, a),
                b,
                less(exact, b),
                optimum("time_s"),
                optimum("semi_major_axis_km"),
                optimum("eccentricity"),
            ],
        );
    }
    let exact = Some(printed.burns.iter().map(|b| b.time_of_propellant(used)).sum());
    let (a, b) = (found.used.total(), found.stated.total());
    let best = found.used.optimum("burn_time_s");
    let (propellant, time) = (Some(printed.propellant.0), Some(printed.time.0));
    sheet.push(
        TOTAL,
        vec![None, None, propellant, time, exact, a, less(exact, a), b, less(exact, b), best, None, None],
    );
    sheet.findings = findings(&found, used);
    Ok((sheet, found))
}

fn findings(found: &Sequence, stage: &Stage) -> Vec<String> {
    let printed = found.printed;
    let mut text = Vec::new();
    let (total, digit) = printed.propellant;
    if let (Some(best), Some(class)) = (found.used.propellant(), found.class) {
        text.push(format!(
            "the joint optimum takes {best:.3} kg, {:.1} kg less than the printed {total} kg: {:.1} kg for the choice of the \
             orbits between the burns, {:.2} kg for ignition half the burn time before the apsis and a fixed line of apses",
            total - best,
            total - class,
            class - best
        ));
    }
    if let (Some(best), Some(limit)) =
        (found.stated.propellant(), found.stated.optimum("impulsive_propellant_kg"))
    {
        text.push(format!(
            "with the {STATED_MASS} kg of Table 1 the optimum takes {best:.3} kg; impulses would take {limit:.3} kg"
        ));
    }
    if let Some(time) = found.used.total().filter(|_| !printed.has_orbits()) {
        text.push(format!(
            "no semi-major axes are printed, so that the rows cannot be computed one by one: the burns by the rule are those with the \
             printed eccentricities and the least propellant together, {:.1} kg, {:.1} kg less than printed",
            time * stage.mass_flow(),
            total - time * stage.mass_flow()
        ));
    }
    let flow = stage.mass_flow();
    for (k, b) in printed.burns.iter().enumerate() {
        let product = b.time * flow;
        if (product - b.propellant).abs() > 1.0 {
            text.push(format!(
                "burn {}: {} s at {flow} kg/s are {product:.1} kg, printed {} kg, which take {:.2} s",
                k + 1,
                b.time,
                b.propellant,
                b.time_of_propellant(stage)
            ));
        }
    }
    let sum: f64 = printed.burns.iter().map(|b| b.time).sum();
    if (sum - printed.time.0).abs() > printed.time.1 + 1e-9 {
        text.push(format!("the printed burn times add to {sum:.1} s, printed {} s", printed.time.0));
    }
    let sum: f64 = printed.burns.iter().map(|b| b.propellant).sum();
    if (sum - total).abs() > digit - 1e-9 {
        text.push(format!("the printed propellants add to {sum:.2} kg, printed {total} kg"));
    }
    text
}

fn range(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &v| (a.min(v), b.max(v)))
}

/// Agreement of the printed burn times with the rule, by initial mass.
pub(super) fn agreement(sequences: &[Sequence], stage: &Stage) -> Sheet {
    let columns = [("burns", 0), ("rms_s", 3), ("bias_s", 3), ("largest_s", 3)];
    let title = "Burn times of Tables 2 to 5 less those by the rule";
    let mut sheet = Sheet::new("burn-times", title, "initial mass (kg)", &columns);
    let whole = || sequences.iter().filter(|s| s.printed.has_orbits());
    let misses = |case: fn(&Sequence) -> &Case| -> Vec<f64> {
        whole()
            .flat_map(|s| s.printed.burns.iter().zip(&case(s).burns))
            .filter_map(|(b, flown)| Some(b.time_of_propellant(stage) - flown.as_ref()?.time))
            .collect()
    };
    let (used, stated) = (misses(|s| &s.used), misses(|s| &s.stated));
    for (mass, misses) in [(USED_MASS, &used), (STATED_MASS, &stated)] {
        let count = misses.len() as f64;
        let rms = (misses.iter().map(|d| d * d).sum::<f64>() / count).sqrt();
        let bias = misses.iter().sum::<f64>() / count;
        let largest = misses.iter().fold(0.0_f64, |m, d| m.max(d.abs()));
        sheet.push(format!("{mass}"), [count, rms, bias, largest].map(Some).to_vec());
    }
    if used.len() == stated.len() && !used.is_empty() {
        // Burn times are nearly linear in the mass: least squares between the two.
        let slopes: Vec<f64> =
            stated.iter().zip(&used).map(|(s, u)| (s - u) / (USED_MASS - STATED_MASS)).collect();
        let share = used.iter().zip(&slopes).map(|(d, s)| d * s).sum::<f64>()
            / slopes.iter().map(|s| s * s).sum::<f64>();
        let fitted = USED_MASS + share;
        sheet.findings.push(format!(
            "the tables were computed with {USED_MASS} kg, not with the {STATED_MASS} kg of Table 1: least squares over the burn \
             times give {fitted:.1} kg"
        ));
    }
    let methods = whole()
        .flat_map(|s| s.used.burns.iter().chain(&s.stated.burns).flatten())
        .fold(0.0_f64, |m, b| m.max((b.time - b.radau_time).abs()));
    sheet.findings.push(format!("collocation and indirect shooting agree to {methods:.0e} s in all burns"));
    sheet
}

/// Propellant of the sequences by number of burns.
pub(super) fn totals(
    sequences: &[Sequence],
    stages: &[Stage; 2],
    solver: &mut Solver<'_>,
) -> Result<Sheet, Stop> {
    let columns = [
        ("printed_kg", 1),
        ("rule_22170_kg", 3),
        ("free_orbits_22170_kg", 3),
        ("optimum_22170_kg", 3),
        ("impulses_22170_kg", 3),
        ("printed_less_optimum_kg", 2),
        ("choice_of_orbits_kg", 2),
        ("fixed_apses_kg", 2),
        ("optimum_22100_kg", 3),
        ("impulses_22100_kg", 3),
        ("along_velocity_22170_kg", 3),
        ("velocity_penalty_22170_kg", 3),
        ("velocity_penalty_22100_kg", 3),
        ("flight_time_printed_h", 3),
        ("flight_time_optimum_h", 3),
    ];
    let title = "Propellant of the sequences: printed, by the rule, with free orbits, optimal, thrust along the velocity";
    let mut sheet = Sheet::new("sequences", title, "burns", &columns);
    let mut order: Vec<&Sequence> = sequences.iter().collect();
    order.sort_by_key(|s| s.printed.burns.len());
    for s in &order {
        let n = s.printed.burns.len();
        let velocity = along_velocity(n, stages, solver, &mut sheet)?;
        let printed = Some(s.printed.propellant.0);
        let (best, stated) = (s.used.propellant(), s.stated.propellant());
        let flown: Option<Vec<Flown>> = s.used.burns.iter().copied().collect();
        sheet.push(
            format!("{n}"),
            vec![
                printed,
                s.used.total().map(|t| t * stages[0].mass_flow()),
                s.class,
                best,
                s.used.optimum("impulsive_propellant_kg"),
                less(printed, best),
                less(printed, s.class),
                less(s.class, best),
                stated,
                s.stated.optimum("impulsive_propellant_kg"),
                velocity[0],
                less(velocity[0], best),
                less(velocity[1], stated),
                flown.map(|burns| flight_time(&stages[0], &burns) / 3600.0),
                s.used.optimum("flight_time_h"),
            ],
        );
    }
    let apart = |case: &Case| less(case.indirect, case.propellant()).map(f64::abs);
    let apart =
        sequences.iter().flat_map(|s| [apart(&s.used), apart(&s.stated)]).flatten().fold(0.0, f64::max);
    sheet.findings = comparisons(&sheet);
    sheet
        .findings
        .push(format!("collocation and indirect shooting agree to {apart:.0e} kg in all joint optima"));
    Ok(sheet)
}

/// Propellant of `n` burns with thrust along the velocity, for both masses. There are several local optima: the least of those reached
/// from the mission's guess and from the solution with the other mass.
fn along_velocity(
    n: usize,
    stages: &[Stage; 2],
    solver: &mut Solver<'_>,
    sheet: &mut Sheet,
) -> Result<[Option<f64>; 2], Stop> {
    let name = format!("geo-{n}-burn");
    let changes = |k: usize| [number("initial_mass_kg", stages[k].mass), word("steering", "velocity")];
    let mut own = Vec::new();
    for k in 0..2 {
        own.push(keep(sheet, solver.mission(&name, &changes(k), None))?);
    }
    let propellant = |outcome: &Outcome| outcome.summary.results.get("propellant_kg").copied();
    let mut least = [0, 1].map(|k: usize| own[k].as_ref().and_then(propellant));
    for k in 0..2 {
        let Some(other) = &own[1 - k] else { continue };
        let again = keep(sheet, solver.mission(&name, &changes(k), Some(other.solved().1)))?;
        if let Some(found) = again.as_ref().and_then(propellant) {
            least[k] = Some(least[k].map_or(found, |l| l.min(found)));
        }
    }
    Ok(least)
}

fn comparisons(sheet: &Sheet) -> Vec<String> {
    let mut text = Vec::new();
    let of = |burns: &str, key: &str| sheet.value(burns, key);
    if let (Some(three), Some(four), Some(six)) =
        (of("3", "optimum_22170_kg"), of("4", "optimum_22170_kg"), of("6", "printed_kg"))
    {
        text.push(format!(
            "three burns, jointly optimal, take {:.1} kg {} than the printed six; four take {:.1} kg {}",
            (three - six).abs(),
            more(three - six),
            (four - six).abs(),
            more(four - six)
        ));
    }
    if let (Some(velocity), Some(printed)) = (of("2", "along_velocity_22170_kg"), of("2", "printed_kg")) {
        text.push(format!(
            "two burns along the velocity, jointly optimal, take {:.1} kg {} than the printed two with optimal steering",
            (velocity - printed).abs(),
            more(velocity - printed)
        ));
    }
    if let (Some(velocity), Some(printed)) = (of("5", "along_velocity_22170_kg"), of("5", "printed_kg")) {
        text.push(format!(
            "five burns along the velocity, jointly optimal, take {velocity:.1} kg: the {REFERENCE_20} kg of the text's reference [20], \
             {:.0} kg more than its Table 6, are those of a heavier stage (sheet reference-20)",
            REFERENCE_20 - printed
        ));
    }
    let costs: Vec<f64> = sheet.rows.iter().filter_map(|r| of(&r.label, "choice_of_orbits_kg")).collect();
    if !costs.is_empty() {
        let (least, most) = range(&costs);
        text.push(format!(
            "the printed orbits between the burns, chosen by hand, cost {least:.0} to {most:.0} kg"
        ));
    }
    text
}

fn more(difference: f64) -> &'static str {
    if difference > 0.0 { "more" } else { "less" }
}

/// Burns that raise the apogee: how much sooner it could be reached with another perigee.
pub(super) fn detours(sequences: &[Sequence], stage: &Stage, solver: &mut Solver<'_>) -> Result<Sheet, Stop> {
    let columns = [
        ("time_of_propellant_s", 3),
        ("shortest_to_apogee_s", 3),
        ("excess_s", 3),
        ("excess_kg", 2),
        ("printed_perigee_km", 1),
        ("perigee_of_shortest_km", 1),
    ];
    let title = "Burns of Tables 2 to 5 beside the shortest ones to the same apogee, 22170 kg";
    let mut sheet = Sheet::new("detours", title, "table and burn", &columns);
    let mut worst: Option<(String, f64)> = None;
    for s in sequences {
        for (k, (row, (from, mass))) in s.printed.burns.iter().zip(s.printed.ignitions(stage)).enumerate() {
            let Some(orbit) = row.orbit().filter(|o| o.eccentricity > 0.0) else { break };
            let burn = Burn { from, mass, apsis: Apsis::Perigee, goal: Goal::Apogee(orbit.apogee()) };
            let shortest = keep(&mut sheet, burn.solve(stage, row.time, solver))?;
            let time = row.time_of_propellant(stage);
            let excess = shortest.map(|b| time - b.time);
            let label = format!("{}, burn {}", s.printed.number, k + 1);
            sheet.push(
                label.clone(),
                vec![
                    Some(time),
                    shortest.map(|b| b.time),
                    excess,
                    excess.map(|t| t * stage.mass_flow()),
                    Some(orbit.perigee() / 1e3),
                    shortest.map(|b| b.orbit.perigee() / 1e3),
                ],
            );
            if let Some(e) = excess
                && worst.as_ref().is_none_or(|(_, w)| e > *w)
            {
                worst = Some((label, e));
            }
        }
    }
    if let Some((label, excess)) = worst {
        sheet.findings.push(format!(
            "the printed orbit costs most in Table {label}: the same apogee can be reached {excess:.1} s sooner, with {:.0} kg \
             less, if the perigee is left free",
            excess * stage.mass_flow()
        ));
    }
    Ok(sheet)
}
