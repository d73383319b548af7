use std::fs;

use super::*;
use crate::sheet_text::sheet_text;
use crate::{Column, Finding, FindingKind, Graph, GraphSeries, Sheet, SheetRow};

fn comparison(key: &'static str, paper: f64, computed: Option<f64>) -> Comparison {
    let findings = vec![Finding { kind: FindingKind::Note, text: "said, \"so\"".into() }];
    Comparison { key, paper, paper_nlp: None, flatness: computed, radau: computed, findings }
}

fn reproduction(rows: usize) -> Reproduction {
    let row = |k: usize| Row {
        parameter: 10.0 * k as f64,
        quantities: vec![
            comparison("flight_time_s", 997.303, Some(997.375_848_8)),
            comparison("final_mass_kg", 153.747, None),
        ],
        miss: (k == 0).then_some(Miss {
            radius_m: 15.618,
            horizontal_speed_m_s: 0.745,
            radial_speed_m_s: -0.898,
        }),
        size: (k == 0).then_some((31, 22)),
        solved: true,
        verified: true,
    };
    let table = |id, figure, rows| Table {
        id,
        figure,
        title: "Table",
        parameter: "gate_altitude_km",
        rows: (0..rows).map(row).collect(),
        remarks: &["of all rows"],
    };
    Reproduction {
        name: "paper",
        title: "A paper",
        source: "Somebody, 2017",
        tables: vec![table("table-1", "table-1.svg", rows), table("table-2", "table-2.svg", 0)],
        sheets: Vec::new(),
        remarks: vec!["misprint".into()],
        complete: false,
    }
}

#[test]
fn numbers_as_text() {
    let q = comparison("flight_time_s", 997.303, Some(997.375_848_8));
    assert_eq!(comparison_columns(&q), ["997.303", "-", "997.375849", "997.375849", "-0.0728", "-", "+0e0"]);
    assert_eq!(quantity_label("gate_radial_velocity_m_s"), "gate radial velocity (m/s)");
    let rows = &reproduction(2).tables[0].rows;
    assert_eq!(
        miss_sentence(&rows[0]),
        "the paper's NLP (31 variables, 22 constraints), flown again, misses by +15.6 m, +0.74 m/s horizontally, -0.90 m/s radially"
    );
    assert_eq!(miss_sentence(&rows[1]), "the paper's NLP does not converge");
}

#[test]
fn files_of_a_reproduction() {
    let dir = tempfile::tempdir().unwrap();
    // Of an earlier one that reached the second table.
    fs::write(dir.path().join("table-2.svg"), "stale").unwrap();
    let written = write_reproduction(dir.path(), &reproduction(2)).unwrap();
    assert_eq!(
        written,
        ["reproduction.md", "reproduction.html", "reproduction.csv", "table-1.svg"]
            .map(|f| dir.path().join(f))
    );
    assert!(!dir.path().join("table-2.svg").exists());
    let read = |file: &str| fs::read_to_string(dir.path().join(file)).unwrap();
    let text = read("reproduction.md");
    for part in [
        "Source of the printed values: Somebody, 2017.",
        "Interrupted: rows are missing.",
        "(table-1.svg)",
        "| 0 | flight time (s) | 997.303 | - | 997.375849 | 997.375849 | -0.0728 | - | +0e0 | +15.6, +0.74, -0.90 | said, \"so\" |",
        "* of all rows",
        "* misprint",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(!text.contains("table-2"), "{text}");
    let mut reader = csv::Reader::from_reader(fs::File::open(dir.path().join("reproduction.csv")).unwrap());
    let head = reader.headers().unwrap().clone();
    let records: Vec<_> = reader.records().map(Result::unwrap).collect();
    assert_eq!(records.len(), 4);
    let cell = |k: usize, name: &str| &records[k][head.iter().position(|h| h == name).unwrap()];
    assert_eq!(
        (cell(0, "radau"), cell(0, "paper_nlp"), cell(0, "findings")),
        ("997.3758488", "", "said, \"so\"")
    );
    assert_eq!((cell(2, "value"), cell(2, "miss_radius_m"), cell(1, "radau")), ("10.0", "", ""));
    assert!(read("table-1.svg").starts_with("<svg"));
}

fn sheet() -> Sheet {
    Sheet {
        id: "table-7",
        title: "Table 7".into(),
        heading: "flight",
        columns: vec![
            Column { key: "semi_major_axis_km", decimals: 1, is_flag: false },
            Column { key: "eccentricity", decimals: 4, is_flag: false },
        ],
        rows: vec![
            SheetRow { label: "printed".into(), values: vec![Some(24_588.04), None] },
            SheetRow { label: "second burn".into(), values: vec![Some(9.0), Some(0.714_23)] },
        ],
        findings: vec!["as printed".into()],
        graphs: vec![Graph {
            file: "curve.svg",
            title: "A curve".into(),
            x: ("ratio", "-"),
            y: ("burn time", "s"),
            series: vec![GraphSeries {
                label: "Fregat".into(),
                line: vec![[1.0, 2.0], [2.0, 3.0]],
                dots: vec![[1.0, 2.5]],
            }],
        }],
        failures: vec!["one".into()],
        unverified: Vec::new(),
        seconds: 1.25,
    }
}

#[test]
fn sheets_as_text() {
    assert_eq!(sheet().value("second burn", "eccentricity"), Some(0.714_23));
    assert_eq!(sheet().value("printed", "eccentricity"), None);
    let expected = "
Table 7

               semi major
  flight        axis (km)  eccentricity
  printed         24588.0             -
  second burn         9.0        0.7142
  * as printed
  * not solved: one
  (table-7, 1.2 s)
";
    assert_eq!(sheet_text(&sheet()), expected);
}

#[test]
fn files_of_sheets() {
    let dir = tempfile::tempdir().unwrap();
    let done = Reproduction { tables: Vec::new(), sheets: vec![sheet()], ..reproduction(0) };
    let written = write_reproduction(dir.path(), &done).unwrap();
    assert_eq!(
        written,
        ["reproduction.md", "reproduction.html", "reproduction.csv", "curve.svg"].map(|f| dir.path().join(f))
    );
    let read = |file: &str| fs::read_to_string(dir.path().join(file)).unwrap();
    let text = read("reproduction.md");
    for part in [
        "| flight | semi major axis (km) | eccentricity |",
        "| printed | 24588.0 | - |",
        "\n* as printed\n* not solved: one\n",
        "![A curve](curve.svg)\n\nA curve: Fregat blue.",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(!text.contains("flatness"), "{text}");
    let csv = "table,row,quantity,value\ntable-7,printed,semi_major_axis_km,24588.04\ntable-7,printed,eccentricity,\n\
               table-7,second burn,semi_major_axis_km,9.0\ntable-7,second burn,eccentricity,0.71423\n";
    assert_eq!(read("reproduction.csv"), csv);
}

#[test]
fn a_page_has_tables_and_sheets_and_figures_inside() {
    let dir = tempfile::tempdir().unwrap();
    let done = Reproduction { sheets: vec![sheet()], ..reproduction(1) };
    let written = write_reproduction(dir.path(), &done).unwrap();
    assert!(written.contains(&dir.path().join("sheets.csv")), "{written:?}");
    let page = fs::read_to_string(dir.path().join("reproduction.html")).unwrap();
    for part in [
        "<h1>A paper</h1>",
        "Interrupted: rows are missing.",
        "<td class=\"number\">997.303</td>",
        "<td>second burn</td>",
        "<li>not solved: one</li>",
        "Sheet table-7, computed in 1.2 s.",
        "<figcaption>A curve</figcaption>",
        "<li>misprint</li>",
    ] {
        assert!(page.contains(part), "{part}: {page}");
    }
}

#[test]
fn the_missions_of_a_publication_stand_beside_its_page() {
    for publication in crate::PUBLICATIONS {
        assert_eq!(mission_files(publication.name).len(), publication.missions.len(), "{}", publication.name);
    }
    assert!(mission_files("paper").is_empty());
}

/// A mission under a law has no solve.
#[test]
fn a_page_names_the_command_of_each_mission() {
    for (name, command) in [
        ("moving-mass", "apsides simulate moving-mass-cross.toml"),
        ("geo-injection", "apsides solve geo-2-burn.toml"),
    ] {
        let page = page::html(&Reproduction { name, ..reproduction(0) }, &mission_files(name));
        assert!(page.contains(&format!("<code>{command}</code>")), "{page}");
    }
}

#[test]
fn a_series_without_points_keeps_its_colour_free() {
    let [graph] = &sheet().graphs[..] else { panic!("one figure") };
    let empty = GraphSeries { label: "coast".into(), line: Vec::new(), dots: Vec::new() };
    let series = std::iter::once(empty).chain(graph.series.clone()).collect();
    let figure = sheet::figure(&Graph { series, ..graph.clone() });
    assert_eq!(figure.legend(), "Fregat vermilion");
}
