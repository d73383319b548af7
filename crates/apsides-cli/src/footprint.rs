//! `apsides footprint`.

use std::fmt::Write as _;

use apsides::pipeline::footprint::{FEWEST_BEARINGS, Footprint, FootprintCase, count, footprint as compute};
use apsides_report::{footprint_map, write_footprint};

use crate::arguments::FootprintArguments;
use crate::commands::KeptWork;
use crate::exit::{Exit, Refusal, refusal};
use crate::output::{print, print_json, print_words, written};
use crate::progress::Progress;
use crate::speech::is_json;

pub(crate) fn footprint(a: &FootprintArguments) -> Result<Exit, Refusal> {
    let mission = a.mission.load_for(&a.run)?;
    mission.check_footprint().map_err(refusal)?;
    let kept = KeptWork::open(a.out.as_deref())?;
    let stop = a.run.limit.stop();
    let bearings = a.bearings as usize;
    let mut progress = Progress::line(stop, count(bearings) as u64);
    let ticker = progress.clone();
    if !is_json() {
        print(&format!("footprint of {} along {bearings} bearings\n\n{HEAD}", a.mission.mission));
    }
    let found = compute(&mission, bearings, &mut progress, |case| {
        if !is_json() {
            ticker.above(&row(case));
        }
        ticker.step();
        !stop.is_set()
    })
    .map_err(refusal)?;
    if is_json() {
        print_json(&found)?;
    } else {
        print(&text(&found));
    }
    if let Some(dir) = &a.out {
        let files = write_footprint(dir, &found)?;
        if !is_json() {
            print(&written(&files));
            print_words(&format!("\ncolours of the map: {}\n", footprint_map(&found).legend()));
        }
    }
    let exit = if !found.complete || !found.failures.is_empty() {
        Exit::NotSolved
    } else if found.verified < found.points.len() {
        Exit::NotVerified
    } else {
        Exit::Verified
    };
    Ok(kept.settle(found.complete, exit))
}

const HEAD: &str = "\
case                             longitude latitude   time certificate
                                       deg      deg      s
";

fn row(case: &FootprintCase<'_>) -> String {
    let Some(p) = case.point else { return format!("{:<58} {}\n", case.name, case.status) };
    let verdict = if case.status == "optimal" {
        p.verdict.to_string()
    } else {
        format!("{}, {}", case.status, p.verdict)
    };
    format!(
        "{:<32}{:>10.4}{:>9.4}{:>7.1} {verdict}\n",
        case.name, p.longitude_deg, p.latitude_deg, p.flight_time_s
    )
}

fn text(f: &Footprint) -> String {
    let mut text = String::from("\n");
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<24}{value}");
    };
    if f.points.len() < FEWEST_BEARINGS {
        line("no outline", format!("{} ends were found", f.points.len()));
    } else {
        let [along, across] = [f.along_course_km, f.across_course_km];
        line("area", format!("{:.0} km2 at {} km altitude", f.area_km2, f.altitude_km));
        line(
            "along the entry course",
            format!("{:.1} km, from {:.1} to {:.1} km", f.length_km(), along[0], along[1]),
        );
        line(
            "across it",
            format!("{:.1} km, from {:.1} to {:.1} km to the right", f.width_km(), across[0], across[1]),
        );
        let [longitude, latitude] = f.centre_deg;
        line("centre", format!("longitude {longitude:.4} deg, latitude {latitude:.4} deg"));
        let side = if f.target_inside { "inside" } else { "outside" };
        line("target", format!("{side}, {:.3} km from the boundary", f.target_margin_km.abs()));
    }
    line("verified", format!("{} of {} points; {} problems solved", f.verified, f.points.len(), f.cases));
    for failure in &f.failures {
        line("no point", failure.clone());
    }
    if !f.complete {
        text += "interrupted: bearings are missing\n";
    }
    text
}
