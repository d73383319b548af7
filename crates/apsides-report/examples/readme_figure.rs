//! Draws the picture of the README: `cargo run -p apsides-report --example readme_figure > docs/landing.svg`.
#![allow(clippy::print_stdout)]

use apsides_report::{Axis, Figure, Series, stacked_svg};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut figure = Figure::new(
        "Landings from lunar orbit in minimum time",
        Axis::new("downrange distance", "m"),
        Axis::new("altitude", "m"),
    );
    for name in ["lunar-direct", "lunar-perilune", "lunar-two-phase"] {
        let outcome = apsides_missions::registry().load(name, &[])?.solve(None, &mut ())?;
        let points = outcome.curves.iter().flat_map(|c| &c.series).flat_map(|(_, points)| points.clone());
        figure = figure.with(Series::line(name, points.collect()));
    }
    print!("{}", stacked_svg(&[figure]));
    Ok(())
}
