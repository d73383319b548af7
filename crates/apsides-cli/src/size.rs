//! `apsides size`.

use std::fmt::Write as _;

use apsides::missions::moving_mass::{MassRow, SizeStudy, Sizing, case};
use apsides_report::{Axis, Figure, Series, replace, stacked_svg};

use crate::arguments::SizeArguments;
use crate::commands::{claim, probe_directory};
use crate::exit::{Exit, Refusal, refusal};
use crate::output::{print, written};
use crate::speech::is_json;

pub(crate) fn size(a: &SizeArguments) -> Result<Exit, Refusal> {
    let mission = a.mission.load()?;
    let case = case(&mission).map_err(refusal)?;
    let positive = |what: &str, value: f64| {
        let holds = value > 0.0 && value.is_finite();
        if holds { Ok(value) } else { Err(format!("{what} is {value}: a positive number is needed")) }
    };
    let margin = positive("--margin", a.margin)?;
    let offsets = a.offsets_cm.iter().map(|cm| Ok(1e-2 * positive("--offsets-cm", *cm)?));
    let offsets = offsets.collect::<Result<Vec<_>, Refusal>>()?;
    if let Some(dir) = &a.out {
        probe_directory(dir)?;
    }
    let _lock = a.out.as_deref().map(claim).transpose()?;
    let study = Sizing::default().study(&case, &offsets, margin).map_err(refusal)?;
    let json = serde_json::to_string_pretty(&study).map_err(refusal)? + "\n";
    print(if is_json() { &json } else { "" });
    if !is_json() {
        print(&text(mission.name(), case.moving_mass(), &study));
    }
    if let Some(dir) = &a.out {
        let svg = stacked_svg(&[figure(&study)]);
        let items = [("size.json", Some(json.into_bytes())), ("size.svg", Some(svg.into_bytes()))];
        let files = replace(dir, &items)?;
        if !is_json() {
            print(&written(&files));
        }
    }
    Ok(Exit::Verified)
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "-".into(), |v| format!("{v:.4}"))
}

fn text(name: &str, moving_mass: f64, study: &SizeStudy) -> String {
    let (statics, simulated) = study.initial_mass_kg;
    let mut text = format!(
        "{name}: masses of {moving_mass} kg hold a vehicle of at most {statics:.1} kg by statics, {} kg by simulation\n\n\
         both masses together, offset in the worst of eight directions\n  {:<7}  {:>9}  {:>10}  {:>12}\n  {:<7}  {:>9}  {:>10}  {:>12}\n",
        number(simulated),
        "layout",
        "offset",
        "statics",
        "simulation",
        "",
        "cm",
        "kg",
        "kg"
    );
    for row in &study.masses {
        let _ = writeln!(
            text,
            "  {:<7}  {:>9.3}  {:>10.4}  {:>12}",
            row.layout,
            1e2 * row.offset_m,
            row.static_kg,
            number(row.simulated_kg)
        );
    }
    let _ = writeln!(
        text,
        "\nleast rate limits, offset {} cm, masses {} times those of statics\n  {:<7}  {:>9}  {:>12}  {:>12}  gains\n  {:<7}  {:>9}  {:>12}  {:>12}",
        1e2 * study.offset_m,
        study.margin,
        "layout",
        "masses",
        "law's own",
        "tuned",
        "",
        "kg",
        "m/s",
        "m/s"
    );
    for row in &study.rates {
        let _ = writeln!(
            text,
            "  {:<7}  {:>9.4}  {:>12}  {:>12}  {:.4?}",
            row.layout,
            row.masses_kg,
            number(row.rate_m_s),
            number(row.tuned_rate_m_s),
            row.tuned_gains
        );
    }
    text
}

fn figure(study: &SizeStudy) -> Figure {
    let points = |layout: &str, of: fn(&MassRow) -> Option<f64>| {
        let rows = study.masses.iter().filter(|row| row.layout == layout);
        rows.filter_map(|row| Some([row.offset_m, of(row)?])).collect::<Vec<_>>()
    };
    let title = "least moving masses in the worst direction";
    let axes = [Axis::new("offset of the centre of mass", "m"), Axis::new("both masses together", "kg")];
    let [x, y] = axes;
    ["cross", "radial"].into_iter().enumerate().fold(Figure::new(title, x, y), |figure, (k, layout)| {
        figure
            .with(
                Series::line(format!("{layout}, statics"), points(layout, |r| Some(r.static_kg))).colored(k),
            )
            .with(Series::dots(format!("{layout}, simulated"), points(layout, |r| r.simulated_kg)).colored(k))
    })
}
