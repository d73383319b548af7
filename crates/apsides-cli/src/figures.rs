//! Figures: the page of a mission, prices of a sweep.

use apsides::pipeline::sweep::{Axis as Swept, Case};
use apsides::pipeline::unit_ending::in_words;
use apsides::{ObjectiveValue, Outcome, Pipeline, Price};
use apsides_report::{Axis, Figure, Presentation, Series};

/// All that the page of a solved mission shows beside its outcome, with name and title of the file of this name where there is one.
pub(crate) fn presentation(name: &str, mission: &Pipeline, outcome: &Outcome) -> Presentation {
    let registry = apsides::registry();
    match registry.files().find(|(file, _)| *file == name) {
        Some((file, title)) => {
            Presentation { heading: file.into(), ..Presentation::of_mission(title, mission, outcome) }
        }
        None => Presentation::of_mission(mission.title(), mission, outcome),
    }
}

/// Length of a stroke as a part of the range of the swept number.
const STROKE: f64 = 0.05;

/// Objective and price of each case of a sweep over its first key with a price.
pub(crate) struct PriceCurves {
    /// Place of the swept number among the axes, and its key.
    swept: Option<(usize, String)>,
    /// True for each axis with more than one value.
    varied: Vec<bool>,
    objective: Option<ObjectiveValue>,
    lines: Vec<PriceLine>,
}

/// Cases that differ in the swept number only.
struct PriceLine {
    /// The other values that were set.
    label: String,
    /// Number, objective, price.
    points: Vec<[f64; 3]>,
    /// Objectives of cases whose number is infinite.
    unlimited: Vec<f64>,
}

impl PriceCurves {
    pub(crate) fn new(axes: &[Swept], priced: &[bool]) -> Self {
        let swept = axes.iter().zip(priced).position(|(_, priced)| *priced);
        let swept = swept.and_then(|k| Some((k, axes.get(k)?.key.clone())));
        let varied = axes.iter().map(|a| a.values.len() > 1).collect();
        Self { swept, varied, objective: None, lines: Vec::new() }
    }

    pub(crate) fn add(&mut self, case: &Case, solved: &Outcome, prices: &[Option<Price>]) {
        let Some((place, _)) = self.swept else { return };
        let number = case.overrides.get(place).and_then(|o| o.split_once('=')?.1.parse::<f64>().ok());
        let Some(number) = number.filter(|_| solved.status.is_success()) else { return };
        let others = case.overrides.iter().zip(&self.varied).enumerate();
        let others = others.filter(|(k, (_, varied))| *k != place && **varied).map(|(_, (o, _))| o.as_str());
        let label = others.collect::<Vec<_>>().join(", ");
        let k = self.lines.iter().position(|l| l.label == label).unwrap_or_else(|| {
            self.lines.push(PriceLine { label, points: Vec::new(), unlimited: Vec::new() });
            self.lines.len() - 1
        });
        let objective = &solved.summary.objective;
        let Some(line) = self.lines.get_mut(k) else { return };
        if number.is_finite() {
            let price =
                prices.get(place).and_then(Option::as_ref).and_then(|p| p.objective).unwrap_or(f64::NAN);
            line.points.push([number, objective.value, price]);
            line.points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        } else {
            line.unlimited.push(objective.value);
        }
        self.objective = Some(objective.clone());
    }

    /// The objective with strokes as steep as the prices, and the prices.
    pub(crate) fn figures(&self) -> Vec<Figure> {
        let (Some((_, key)), Some(objective)) = (&self.swept, &self.objective) else { return Vec::new() };
        let (name, unit) = in_words(key);
        let x = || Axis::new(name.clone(), unit.clone());
        let what = objective.name.replace('_', " ");
        let mut values =
            Figure::new(format!("{what} over {name}"), x(), Axis::new(what.clone(), objective.unit.clone()));
        let per =
            if unit.is_empty() { objective.unit.clone() } else { format!("{} per {unit}", objective.unit) };
        let mut prices = Figure::new(format!("price of {name}"), x(), Axis::new("price", per).including(0.0));
        let numbers = || self.lines.iter().flat_map(|l| l.points.iter().map(|p| p[0]));
        let range = numbers().fold(f64::NEG_INFINITY, f64::max) - numbers().fold(f64::INFINITY, f64::min);
        let half = if range > 0.0 { 0.5 * STROKE * range } else { 0.0 };
        for (k, line) in self.lines.iter().enumerate() {
            let of =
                |pick: fn(&[f64; 3]) -> f64| line.points.iter().map(|p| [p[0], pick(p)]).collect::<Vec<_>>();
            values = values.with(Series::dots(line.label.clone(), of(|p| p[1])).colored(k));
            for [number, objective, price] in line.points.iter().filter(|p| p[2].is_finite()) {
                let end = |side: f64| [number + side * half, objective + side * half * price];
                values = values.with(Series::line("", vec![end(-1.0), end(1.0)]).colored(k));
            }
            for objective in &line.unlimited {
                values = values.horizontal("unlimited", *objective);
            }
            prices = prices.with(Series::line(line.label.clone(), of(|p| p[2])).colored(k));
            prices = prices.with(Series::dots("", of(|p| p[2])).colored(k));
        }
        vec![values, prices]
    }

    /// The other values that were set, with their colours.
    pub(crate) fn legend(&self) -> String {
        self.figures().first().map_or(String::new(), Figure::legend)
    }
}
