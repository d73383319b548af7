//! Root loci of the loops of a simulated flight as figures.

use std::f64::consts::PI;

use apsides_control::linear::Eigenvalue;
use apsides_control::state_space::LocusPoint;
use apsides_pipeline::simulation::RootLocus;

use crate::{Axis, Figure, Series};

/// Half widths of the figures as parts of the Nyquist frequency `pi / T`: beyond it poles decay within a sample.
const WINDOWS: [(&str, f64); 2] = [("", 1.0), (", near the origin", 0.1)];
/// Colours of branches, after that of the dots.
const BRANCH_COLORS: usize = 6;

/// Two figures of each loop.
pub(crate) fn figures(locus: &RootLocus) -> Vec<Figure> {
    ["angle of attack", "sideslip"]
        .iter()
        .zip(&locus.loops)
        .flat_map(|(name, points)| {
            WINDOWS.map(|(part, window)| {
                figure(format!("root locus of the {name}{part}"), points, window * PI / locus.sample_time)
            })
        })
        .collect()
}

fn figure(title: String, locus: &[LocusPoint], window: f64) -> Figure {
    let axis = |name: &str| Axis::new(name, "1/s");
    let place = |pole: &Eigenvalue| {
        let seen = pole.re.abs() <= window && pole.im.abs() <= window;
        if seen { [pole.re, pole.im] } else { [f64::NAN; 2] }
    };
    let branches = locus.first().map_or(0, |point| point.poles.len());
    let mut figure = Figure::new(title, axis("real part"), axis("imaginary part"))
        .vertical("limit of stability", 0.0)
        .to_scale(1.0);
    for k in 0..branches {
        let branch = locus.iter().filter_map(|point| point.poles.get(k)).map(place).collect();
        figure = figure.with(Series::line("", branch).colored(1 + k % BRANCH_COLORS));
    }
    let nominal = locus.iter().filter(|point| point.gain == 1.0).flat_map(|point| &point.poles).map(place);
    figure.with(Series::dots("nominal gain", nominal.collect()).colored(0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SeriesStyle;

    #[test]
    fn branches_and_nominal_poles_within_the_frequencies_of_samples() {
        let pole = |re: f64, im: f64| Eigenvalue { re, im };
        let point = |gain: f64, poles: Vec<Eigenvalue>| LocusPoint { gain, poles };
        let slow = vec![
            point(0.1, vec![pole(-1.0, 0.0), pole(-40.0, 0.0), pole(f64::NEG_INFINITY, 0.0)]),
            point(1.0, vec![pole(-2.0, 1.0), pole(-30.0, 0.0), pole(-500.0, 0.0)]),
            point(10.0, vec![pole(0.5, 3.0), pole(-20.0, 0.0), pole(-350.0, 314.0)]),
        ];
        let locus = RootLocus {
            altitude: 25e3,
            time: 70.0,
            dynamic_pressure: 11e3,
            sample_time: 0.01,
            loops: [slow.clone(), slow],
        };
        let found = figures(&locus);
        let titles: Vec<&str> = found.iter().map(|f| f.title.as_str()).collect();
        assert_eq!(
            titles,
            [
                "root locus of the angle of attack",
                "root locus of the angle of attack, near the origin",
                "root locus of the sideslip",
                "root locus of the sideslip, near the origin"
            ]
        );
        let [whole, near, ..] = &found[..] else { panic!("figures") };
        assert_eq!(whole.series.len(), 4);
        assert_eq!(whole.series[0].points, [[-1.0, 0.0], [-2.0, 1.0], [0.5, 3.0]]);
        assert!(whole.series[2].points.iter().flatten().all(|v| v.is_nan()));
        assert_eq!(whole.series[3].style, SeriesStyle::Dots);
        assert_eq!(whole.series[3].points[..2], [[-2.0, 1.0], [-30.0, 0.0]]);
        // A tenth of pi / T = 314 1/s.
        assert!(near.series[1].points[0][0].is_nan() && near.series[1].points[1] == [-30.0, 0.0]);
        assert!(whole.to_svg().contains("real part (1/s)"));
    }
}
