//! The files of a fabricated outcome: contents, reading back, structure of the page.

mod lander;
mod reading;
mod well_formed;

use std::fs;
use std::path::Path;

use apsides_pipeline::Summary;
use apsides_report::{
    Axis, Figure, Presentation, ReportError, Series, read_outcome_trajectory, write_outcome,
};

fn flight_path() -> Figure {
    let outcome = lander::outcome();
    let path = |k: usize| {
        let phase = &outcome.trajectory.phases[0];
        let t = phase.time_at(k as f64 / 100.0);
        let x = phase.state_at(t);
        [1_737_400.0 * x[1], x[0] - 1_737_400.0]
    };
    Figure::new("flight path", Axis::new("downrange", "m"), Axis::new("altitude", "m"))
        .with(Series::line("solution", (0..=100).map(path).collect()))
        .with(Series::dots("gates", vec![[100e3, 13e3], [300e3, 8e3]]))
        .horizontal("descent gate 2 km", 2_000.0)
        .vertical("hill", 250e3)
}

#[test]
fn a_result_directory_has_all_files() {
    // Kept below the target directory: the page is there to be looked at after a test run.
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join("lander");
    let outcome = lander::outcome();
    let written = write_outcome(&dir, &outcome, &[flight_path()]).unwrap();
    let names: Vec<_> = written.iter().map(|p| p.file_name().unwrap().to_str().unwrap()).collect();
    assert_eq!(
        names,
        ["summary.json", "certificate.json", "trajectory.csv", "mission.toml", "report.html", "digests.json"]
    );
    assert_eq!(fs::read_dir(&dir).unwrap().count(), names.len(), "nothing else is left behind");
    assert_eq!(fs::read_to_string(dir.join("mission.toml")).unwrap(), outcome.mission_file);

    let csv = fs::read_to_string(dir.join("trajectory.csv")).unwrap();
    let header = csv.lines().next().unwrap();
    assert_eq!(
        header,
        "phase,interval,time_s,radius_m,downrange_angle_rad,horizontal_speed_m_per_s,radial_speed_m_per_s,mass_kg,\
         thrust_angle_rad,thrust_N,costate_radius_kg_per_m,costate_downrange_angle_kg_per_rad,\
         costate_horizontal_speed_kg_s_per_m,costate_radial_speed_kg_s_per_m,costate_mass,\
         parameter_site_longitude_rad,objective_final_mass_kg,interval_relative_error,collocated"
    );
    // 18 and 7 collocation points, the ends of two phases, the header.
    assert_eq!(csv.lines().count(), 18 + 7 + 2 + 1);
    let last: Vec<&str> = csv.lines().last().unwrap().split(',').collect();
    assert_eq!((last[0], last[1], last[2], last[3]), ("descent <final>", "1", "1000.0", "1737400.0"));
    assert_eq!(last[4], "", "the second phase has no downrange angle");

    let trajectory = read_outcome_trajectory(&dir, &outcome.ocp).unwrap();
    assert_eq!(trajectory.phases[1].final_state(), outcome.trajectory.phases[1].final_state());
}

#[test]
fn a_summary_of_finite_numbers_reads_back() {
    let dir = tempfile::tempdir().unwrap();
    let mut outcome = lander::outcome();
    outcome.summary.results.remove("undefined_deg");
    outcome.summary.certificate.checks.retain(|c| c.value.is_finite());
    write_outcome(dir.path(), &outcome, &[]).unwrap();
    let text = fs::read_to_string(dir.path().join("summary.json")).unwrap();
    assert_eq!(serde_json::from_str::<Summary>(&text).unwrap(), outcome.summary);
}

#[test]
fn a_refused_outcome_leaves_the_earlier_result() {
    let dir = tempfile::tempdir().unwrap();
    let mut outcome = lander::outcome();
    write_outcome(dir.path(), &outcome, &[]).unwrap();
    let read = |name: &str| fs::read_to_string(dir.path().join(name)).unwrap();
    let before = (read("summary.json"), read("report.html"));
    outcome.summary.status = "changed".into();
    outcome.trajectory.parameters.clear();
    let error = write_outcome(dir.path(), &outcome, &[]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "trajectory of problem `lander`: expected 1 parameters, found 0",
        "the reason names the place"
    );
    assert!(matches!(error, ReportError::Shape { .. }));
    assert_eq!((read("summary.json"), read("report.html")), before);
}

#[test]
fn the_page_is_well_formed_and_self_contained() {
    let mut outcome = lander::outcome();
    outcome.explanation = Some("thrust < weight & \"late\"".into());
    let page = apsides_report::render_html(&outcome, &[flight_path()]).unwrap();
    let svgs = well_formed::svg_elements(&page);
    // Five states, two controls, five costates, two of the mesh, one of the mission; legends have small ones.
    let figures: Vec<_> = svgs.iter().filter(|s| s.contains("role=\"img\"")).collect();
    assert_eq!(figures.len(), 5 + 2 + 5 + 2 + 1);
    for svg in &svgs {
        well_formed::check(svg).unwrap_or_else(|e| panic!("{e}\n{svg}"));
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }
    well_formed::check(&well_formed::body(&page)).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(page.matches("<script type=\"module\">").count(), 1, "the page's own");
    assert_eq!(page.matches("<script").count(), 1);
    for outside in ["<link", "src=", "href=", "url(", "@import"] {
        assert!(!page.contains(outside), "{outside}");
    }
    for expected in [
        "<h1>lunar landing &lt;test&gt; &amp; more</h1>",
        "thrust &lt; weight &amp; &quot;late&quot;",
        "name = &quot;lunar landing &lt;test&gt; &amp; more&quot;",
        "descent &lt;final&gt;, 850 s",
        "<td class=\"number\">not a number</td>",
        "<td>touchdown speed</td><td class=\"number\">2.3 × 10⁻⁹</td><td>m/s</td>",
        "4 of 6 checks passed",
        "Limits and margins",
        "final mass ",
        "<summary>Costates</summary>",
        "Farthest beyond its limit",
        "84 %",
        "320 %",
        "altitude (km)",
        "radius (km)",
        "thrust angle (deg)",
        "bounds 150 to 1500 N",
        "<td>site longitude</td>",
    ] {
        assert!(page.contains(expected), "{expected}");
    }
    assert!(!page.contains("<test>") && !page.contains("<final>"));
}

/// A control that the mission draws over time, too, has one figure; what only bears its name, or compares it, stays.
#[test]
fn a_control_is_drawn_once() {
    let outcome = lander::outcome();
    let drawn = |title: &str, y: (&str, &str), series: &[&str]| {
        let empty = Figure::new(title, Axis::new("time", "s"), Axis::new(y.0, y.1));
        let line = |name: &&str| Series::line(*name, vec![[0.0, 0.0], [1.0, 1.0]]);
        series.iter().map(line).fold(empty, Figure::with)
    };
    let histories = vec![
        drawn("angle of the mission", ("thrust angle", "deg"), &["braking"]),
        drawn("thrust in kilopond", ("thrust", "kp"), &["braking"]),
        drawn("thrust of both", ("thrust", "N"), &["flown", "planned"]),
    ];
    let shown = Presentation { histories, ..Presentation::default() };
    let page = apsides_report::render_page(&outcome, &shown).unwrap();
    let is_drawn = |title: &str| page.contains(&format!("<figcaption>{title}</figcaption>"));
    assert_eq!(
        ["angle of the mission", "thrust in kilopond", "thrust of both", "thrust angle"].map(is_drawn),
        [false, true, true, true]
    );
}

#[test]
fn a_trajectory_with_gaps_is_drawn() {
    let mut outcome = lander::outcome();
    let phase = &mut outcome.trajectory.phases[0];
    let mut segments = phase.state.segments().to_vec();
    segments[1].values.iter_mut().for_each(|v| *v = f64::NAN);
    phase.state = apsides_ocp::PiecewisePolynomial::new(5, phase.state.breaks().to_vec(), segments).unwrap();
    phase.interval_errors[2] = f64::INFINITY;
    let page = apsides_report::render_html(&outcome, &[]).unwrap();
    for svg in well_formed::svg_elements(&page) {
        well_formed::check(svg).unwrap();
        assert!(!svg.contains("NaN"));
    }
}

#[test]
fn a_fine_mesh_gives_a_page_of_moderate_size() {
    let mut outcome = lander::outcome();
    let breaks: Vec<f64> = (0..=1000).map(|k| 0.8 * f64::from(k)).collect();
    let curve = |t: f64, c: usize| (t / 40.0 + c as f64).sin();
    outcome.trajectory.phases[0] = lander::phase("braking", &breaks, &[4; 1000], (5, &curve), (1, &curve));
    let page = apsides_report::render_html(&outcome, &[]).unwrap();
    assert!(page.len() < 1_500_000, "{} bytes", page.len());
    fs::write(Path::new(env!("CARGO_TARGET_TMPDIR")).join("fine.html"), page).unwrap();
}
