//! The paper's Table 2: the optimum under limits, beside the reference; and each with and without the search layer.

use std::collections::BTreeMap;

use super::model::{Begin, Limits, Model, SolveNumbers, label, solve, solve_twice};
use super::reference::{BASE, FINER_E, MESH, ReferenceRow};
use crate::sheet::{Graph, GraphSeries, Sheet, median};
use crate::stop::Stop;
use crate::workers::Workers;

const NONE: f64 = f64::INFINITY;

/// Optima nearer to each other than this are one; MJ/m2.
const ACCURACY: f64 = 1e-4;

/// A row with what was found for it.
pub(super) struct Found<'a> {
    pub(super) reference: &'a ReferenceRow,
    pub(super) solved: Option<SolveNumbers>,
    /// The start of the solve that succeeded: with the search only where straight lines fail.
    pub(super) begin: Begin,
}

const COLUMNS: &[(&str, usize)] = &[
    ("heat_load_mj_m2", 5),
    ("reference_mj_m2", 5),
    ("difference_mj_m2", 5),
    ("tolerance_mj_m2", 3),
    ("on_60_intervals_mj_m2", 5),
    ("flight_time_s", 2),
    ("reference_time_s", 2),
    ("pressure_by_limit", 5),
    ("load_by_limit", 5),
    ("heat_rate_by_limit", 5),
    ("verified", 0),
    ("first_mesh_iterations", 0),
    ("iterations", 0),
    ("meshes", 0),
    ("time_of_solve_s", 2),
];

/// Rows of one model.
pub(super) fn table<'a>(
    model: Model,
    rows: &'a [ReferenceRow],
    workers: &mut Workers<'_>,
) -> Result<(Sheet, Vec<Found<'a>>), Stop> {
    let (_, tolerance, _) = model.reference();
    let id = match model {
        Model::E => "limits-e",
        Model::U => "limits-u",
    };
    let title = format!(
        "Limits, model {}: least heat load, beside the reference on 60 elements (Table 2 of the paper)",
        model.name()
    );
    let mut sheet = Sheet::new(id, title, "limits (kPa / m/s2 / kW/m2)", COLUMNS).with_flags(&["verified"]);
    let results = workers.all(rows, |row, observer| {
        match solve_twice(model, row.limits, Begin::Straight, observer) {
            Err(Stop::NotSolved(_)) => {
                Ok((solve_twice(model, row.limits, Begin::Search, observer)?, Begin::Search))
            }
            other => Ok((other?, Begin::Straight)),
        }
    })?;
    let mut found = Vec::new();
    let mut unverified: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (reference, result) in rows.iter().zip(results) {
        let name = label(reference.limits);
        let (solved, begin) = match result {
            Ok((solved, begin)) => (Some(solved), begin),
            Err(why) => {
                sheet.failures.push(why);
                (None, Begin::Search)
            }
        };
        sheet.push(name.clone(), values(reference, solved.as_ref(), tolerance));
        if let Some(s) = solved.as_ref().filter(|s| !s.verified) {
            unverified.entry(s.failed_checks.join(", ")).or_default().push(name);
        }
        found.push(Found { reference, solved, begin });
    }
    sheet.unverified =
        unverified.iter().map(|(checks, rows)| format!("{}: {checks}", rows.join("; "))).collect();
    sheet.findings = findings(model, &found);
    sheet.graphs = graphs(model, &found);
    Ok((sheet, found))
}

fn first_mesh(solved: &SolveNumbers) -> Option<f64> {
    solved.first_mesh_iterations.map(|iterations| iterations as f64)
}

fn values(reference: &ReferenceRow, solved: Option<&SolveNumbers>, tolerance: f64) -> Vec<Option<f64>> {
    let of = |value: fn(&SolveNumbers) -> f64| solved.map(value);
    let by_limit = |k: usize| solved.and_then(|s| s.by_limit[k]);
    vec![
        of(|s| s.heat_load),
        Some(reference.heat_load),
        solved.map(|s| s.heat_load - reference.heat_load),
        Some(tolerance),
        solved.and_then(|s| s.same_mesh),
        of(|s| s.flight_time),
        Some(reference.flight_time),
        by_limit(0),
        by_limit(1),
        by_limit(2),
        of(|s| f64::from(u8::from(s.verified))),
        solved.and_then(first_mesh),
        of(|s| s.iterations as f64),
        of(|s| s.meshes as f64),
        of(|s| s.times[1]),
    ]
}

fn findings(model: Model, found: &[Found<'_>]) -> Vec<String> {
    let (_, tolerance, fine) = model.reference();
    let rows: Vec<(&ReferenceRow, &SolveNumbers)> =
        found.iter().filter_map(|f| Some((f.reference, f.solved.as_ref()?))).collect();
    let off = |r: &(&ReferenceRow, &SolveNumbers)| (r.1.heat_load - r.0.heat_load).abs();
    let outside: Vec<_> = rows.iter().filter(|r| off(r) > tolerance).collect();
    let mut findings = vec![format!(
        "{} of {} rows are within {tolerance} MJ/m2 of the reference.",
        rows.len() - outside.len(),
        found.len()
    )];
    if let (Some(least), Some(most)) =
        (outside.iter().map(|r| off(r)).reduce(f64::min), outside.iter().map(|r| off(r)).reduce(f64::max))
    {
        let names: Vec<String> = outside.iter().map(|r| label(r.0.limits)).collect();
        findings.push(format!("The others differ by {least:.4} to {most:.4} MJ/m2: {}.", names.join("; ")));
    }
    let coarse = rows.iter().filter_map(|r| Some((r.1.same_mesh? - r.1.heat_load).abs())).reduce(f64::max);
    let [intervals, points] = MESH;
    findings.extend(coarse.map(|most| {
        format!(
            "On {intervals} intervals of {points} points, the mesh of the reference, the limits hold at the points alone and are \
             exceeded between them: the heat loads there differ by up to {most:.4} MJ/m2 from those found here, where they hold between \
             the points too."
        )
    }));
    let finer = FINER_E.iter().filter(|_| model == Model::E);
    let finer: Vec<String> = finer
        .filter_map(|(limits, value)| {
            let (_, s) = rows.iter().find(|r| r.0.limits == *limits)?;
            Some(format!("{}: {value:.5} ({:+.5})", label(*limits), s.heat_load - value))
        })
        .collect();
    if !finer.is_empty() {
        findings.push(format!(
            "On 120 to 240 intervals the program of the reference comes nearer; found here less that, MJ/m2: {}.",
            finer.join("; ")
        ));
    }
    let searched: Vec<String> = found
        .iter()
        .filter(|f| f.begin == Begin::Search && f.solved.is_some())
        .map(|f| label(f.reference.limits))
        .collect();
    if !searched.is_empty() {
        findings.push(format!(
            "Not solved from straight lines, solved from the best flight of a search: {}.",
            searched.join("; ")
        ));
    }
    let names = [([NONE; 3], "Without limits", fine.none), (BASE, "With the limits of the paper", fine.base)];
    for (limits, name, [expected, error]) in names {
        if let Some((_, s)) = rows.iter().find(|r| r.0.limits == limits) {
            findings.push(format!(
                "{name}: {:.5} MJ/m2; the reference on its finest mesh: {expected:.4} +- {error} MJ/m2.",
                s.heat_load
            ));
        }
    }
    let differ: Vec<String> =
        rows.iter().filter(|r| r.1.active() != r.0.active).map(|r| label(r.0.limits)).collect();
    findings.push(if differ.is_empty() {
        "The active limits are those of the reference in every row.".into()
    } else {
        format!("The active limits differ from those of the reference at: {}.", differ.join("; "))
    });
    findings.extend(relaxation(&rows));
    let verified = rows.iter().filter(|r| r.1.verified).count();
    findings.push(format!("The certificate verifies {verified} of {} rows as local optima.", found.len()));
    findings
}

/// Says whether a looser limit ever costs heat load, and how far all of them spread it.
fn relaxation(rows: &[(&ReferenceRow, &SolveNumbers)]) -> Option<String> {
    let looser = |a: &Limits, b: &Limits| a.iter().zip(b).all(|(a, b)| a >= b);
    let worse = |a: &SolveNumbers, b: &SolveNumbers| a.heat_load > b.heat_load + ACCURACY;
    let pairs = rows.iter().flat_map(|a| rows.iter().map(move |b| (a, b)));
    let against = pairs.filter(|(a, b)| looser(&a.0.limits, &b.0.limits) && worse(a.1, b.1)).count();
    let heat = || rows.iter().map(|r| r.1.heat_load);
    let (least, most) = (heat().reduce(f64::min)?, heat().reduce(f64::max)?);
    let verdict =
        if against == 0 { "holds in every pair of rows" } else { "does not hold in every pair of rows" };
    Some(format!(
        "The paper's statement that looser limits lower the heat load {verdict}; between the extremes are {:.2} MJ/m2, {:.1} %.",
        most - least,
        100.0 * (most / least - 1.0)
    ))
}

/// Heat load over each limit, alone and with the others as in the paper: lines for what was found, dots for the reference.
fn graphs(model: Model, found: &[Found<'_>]) -> Vec<Graph> {
    let files = match model {
        Model::E => ["limit_pressure_e.svg", "limit_load_e.svg", "limit_heat_rate_e.svg"],
        Model::U => ["limit_pressure_u.svg", "limit_load_u.svg", "limit_heat_rate_u.svg"],
    };
    let names = [("dynamic pressure", "kPa"), ("acceleration", "m/s2"), ("heat rate", "kW/m2")];
    let graph = |k: usize| {
        let series = |label: &str, others: Limits| {
            let of = |f: &&Found<'_>| (0..3).all(|i| i == k || f.reference.limits[i] == others[i]);
            let mut rows: Vec<&Found<'_>> =
                found.iter().filter(of).filter(|f| f.reference.limits[k].is_finite()).collect();
            rows.sort_by(|a, b| a.reference.limits[k].total_cmp(&b.reference.limits[k]));
            let point = |f: &&Found<'_>| Some([f.reference.limits[k], f.solved.as_ref()?.heat_load]);
            GraphSeries {
                label: label.into(),
                line: rows.iter().filter_map(point).collect(),
                dots: rows.iter().map(|f| [f.reference.limits[k], f.reference.heat_load]).collect(),
            }
        };
        Graph {
            file: files[k],
            title: format!(
                "Model {}: heat load over the limit on the {} (lines) and the reference (dots)",
                model.name(),
                names[k].0
            ),
            x: (names[k].0, names[k].1),
            y: ("heat load", "MJ/m2"),
            series: vec![series("alone", [NONE; 3]), series("with the other limits of the paper", BASE)],
        }
    };
    (0..3).map(graph).collect()
}

/// Limits for which the search layer is tried.
pub(super) const COMBINATIONS: [Limits; 8] = [
    [NONE, NONE, NONE],
    [11.0, NONE, NONE],
    [NONE, 37.0, NONE],
    [NONE, NONE, 780.0],
    [NONE, NONE, 850.0],
    BASE,
    [13.0, 40.0, 800.0],
    [12.0, 34.0, 780.0],
];

/// Each combination of limits from straight lines and from the best flight of a search.
pub(super) fn layers(
    tables: &[(Model, &[Found<'_>])],
    combinations: &[Limits],
    workers: &mut Workers<'_>,
) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "layers",
        "The search layer: Radau from straight lines, and from the best of 3000 flights of the cooperation",
        "model, limits",
        &[
            ("straight_solved", 0),
            ("straight_first_mesh_iterations", 0),
            ("straight_iterations", 0),
            ("straight_time_s", 2),
            ("two_layer_solved", 0),
            ("two_layer_first_mesh_iterations", 0),
            ("two_layer_iterations", 0),
            ("two_layer_time_s", 2),
            ("of_it_search_time_s", 2),
            ("heat_loads_differ_by_mj_m2", 7),
        ],
    )
    .with_flags(&["straight_solved", "two_layer_solved"]);
    let jobs: Vec<(Model, Limits)> =
        tables.iter().flat_map(|(m, _)| combinations.iter().map(move |l| (*m, *l))).collect();
    let searched =
        workers.all(&jobs, |&(model, limits), observer| solve(model, limits, Begin::Search, observer))?;
    let mut pairs = Vec::new();
    for ((model, limits), two) in jobs.iter().zip(searched) {
        let rows = tables.iter().find(|t| t.0 == *model).map_or(&[][..], |t| t.1);
        // Every combination is a row of its table.
        let known = rows.iter().find(|f| f.reference.limits == *limits && f.begin == Begin::Straight);
        let straight = known.and_then(|f| f.solved.clone());
        let two = match two {
            Ok(solved) => Some(solved),
            Err(why) => {
                sheet.failures.push(why);
                None
            }
        };
        let flag = |s: &Option<SolveNumbers>| Some(f64::from(u8::from(s.is_some())));
        let of = |s: &Option<SolveNumbers>, value: fn(&SolveNumbers) -> f64| s.as_ref().map(value);
        let difference = straight.as_ref().zip(two.as_ref()).map(|(a, b)| (b.heat_load - a.heat_load).abs());
        sheet.push(
            format!("{}, {}", model.name(), label(*limits)),
            vec![
                flag(&straight),
                straight.as_ref().and_then(first_mesh),
                of(&straight, |s| s.iterations as f64),
                of(&straight, |s| s.times[1]),
                flag(&two),
                two.as_ref().and_then(first_mesh),
                of(&two, |s| s.iterations as f64),
                of(&two, |s| s.times[0] + s.times[1]),
                of(&two, |s| s.times[0]),
                difference,
            ],
        );
        pairs.push([straight, two]);
    }
    sheet.findings = buys(&pairs);
    Ok(sheet)
}

/// Says what the search layer buys.
fn buys(pairs: &[[Option<SolveNumbers>; 2]]) -> Vec<String> {
    let count = |k: usize| pairs.iter().filter(|p| p[k].is_some()).count();
    let of = |k: usize, value: fn(&SolveNumbers) -> Option<f64>| {
        median(pairs.iter().filter_map(|p| p[k].as_ref()).filter_map(value)).unwrap_or(f64::NAN)
    };
    let [straight, two] = [0, 1].map(|k| {
        [of(k, first_mesh), of(k, |s| Some(s.iterations as f64)), of(k, |s| Some(s.times[0] + s.times[1]))]
    });
    let same = pairs.iter().filter_map(|[a, b]| Some((a.as_ref()?.heat_load - b.as_ref()?.heat_load).abs()));
    vec![
        format!(
            "Solved from straight lines: {} of {}; with the search layer: {} of {}. The heat loads differ by {:.0e} MJ/m2 at most.",
            count(0),
            pairs.len(),
            count(1),
            pairs.len(),
            same.fold(0.0, f64::max)
        ),
        format!(
            "Medians from straight lines: {:.0} iterations on the first mesh, {:.0} on all, {:.2} s; with the search layer: {:.0}, \
             {:.0}, {:.2} s with the search. The search saves iterations on the first mesh; refinement takes the rest either way.",
            straight[0], straight[1], straight[2], two[0], two[1], two[2]
        ),
    ]
}
