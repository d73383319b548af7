//! The figures of every result: states, controls, costates against time, and the mesh.

use apsides_ocp::{Bounds, Ocp, PhaseTrajectory, PiecewisePolynomial, Trajectory, Variable};

use crate::ReportError;
use crate::axis_layout::FLAT;
use crate::figure::{Axis, Figure, Series, Span};
use crate::number::readable;
use crate::trajectory_csv::check_sizes;
use crate::units::{display_unit, quotient};

/// More nodes than this are not drawn one by one.
const MOST_DOTS: usize = 240;

/// Points at which a curve is drawn over all phases, about: two per pixel of a figure.
const SAMPLES: f64 = 1200.0;

/// Limits of the steps of one interval: a short one may be steep, a long one is smooth.
const STEPS: (usize, usize) = (3, 100);

/// Figures by subject.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StandardFigures {
    /// One per state, all phases on one axis.
    pub states: Vec<Figure>,
    /// One per control, with its bounds.
    pub controls: Vec<Figure>,
    /// One per costate; empty when the trajectory has none.
    pub costates: Vec<Figure>,
    /// Error estimate and points of every interval.
    pub mesh: Vec<Figure>,
}

impl StandardFigures {
    /// Figures of a trajectory of `ocp`.
    ///
    /// # Errors
    /// [`ReportError::Shape`] when the trajectory does not have the sizes of the problem.
    pub fn new(ocp: &Ocp, trajectory: &Trajectory) -> Result<Self, ReportError> {
        check_sizes(ocp, trajectory)?;
        let duration: f64 = trajectory.phases.iter().map(|p| p.final_time - p.initial_time).sum();
        let view = View { ocp, trajectory, density: SAMPLES / duration };
        Ok(Self {
            states: view.figures(
                |p| ocp.phases[p].states.iter().map(|s| (&s.variable, s.variable.unit.clone())).collect(),
                |t| Some(&t.state),
                Quantity { prefix: "", with_bounds: true },
                // A re-simulation may miss the state by as much.
                &|p, k| ocp.phases[p].states[k].tolerance.unwrap_or(0.0),
            ),
            controls: view.figures(
                |p| ocp.phases[p].controls.iter().map(|v| (v, v.unit.clone())).collect(),
                |t| Some(&t.control),
                Quantity { prefix: "", with_bounds: true },
                &|p, k| {
                    let control = &ocp.phases[p].controls[k];
                    let width = control.bounds.upper - control.bounds.lower;
                    if control.guards == [false; 2] && width.is_finite() { FLAT * width } else { 0.0 }
                },
            ),
            costates: view.figures(
                |p| {
                    let states = ocp.phases[p].states.iter().map(|s| &s.variable);
                    states.map(|v| (v, quotient(&ocp.objective.unit, &v.unit))).collect()
                },
                |t| t.costate.as_ref(),
                Quantity { prefix: "costate of ", with_bounds: false },
                &|_, _| 0.0,
            ),
            mesh: view.mesh(),
        })
    }
}

#[derive(Clone, Copy)]
struct Quantity {
    prefix: &'static str,
    with_bounds: bool,
}

struct View<'a> {
    ocp: &'a Ocp,
    trajectory: &'a Trajectory,
    /// Samples per unit time.
    density: f64,
}

impl View<'_> {
    fn axes(&self, title: String, y: Axis) -> Figure {
        // Phases of one problem share a time axis; different units are named side by side.
        let mut units: Vec<&str> = self.ocp.phases.iter().map(|p| p.time_unit.as_str()).collect();
        units.dedup();
        let mut figure = Figure::new(title, Axis::new("time", units.join(", ")), y);
        figure.spans = (self.trajectory.phases.iter())
            .map(|p| Span {
                label: if self.ocp.phases.len() > 1 { p.name.clone() } else { String::new() },
                range: p.initial_time..p.final_time,
            })
            .collect();
        figure
    }

    /// One figure per distinct name and unit among the phases; `resolution` has the differences that are none of a component of a phase.
    fn figures<'o>(
        &self,
        variables: impl Fn(usize) -> Vec<(&'o Variable, String)>,
        polynomial: impl Fn(&PhaseTrajectory) -> Option<&PiecewisePolynomial>,
        quantity: Quantity,
        resolution: &dyn Fn(usize, usize) -> f64,
    ) -> Vec<Figure> {
        let mut keys: Vec<(String, String)> = Vec::new();
        let mut parts: Vec<Vec<Part>> = Vec::new();
        let total: usize = self.trajectory.phases.iter().map(|p| p.mesh.total_points() + 1).sum();
        for (index, phase) in self.trajectory.phases.iter().enumerate() {
            let Some(polynomial) = polynomial(phase) else { continue };
            let curves = Curves::new(phase, polynomial, self.density);
            for (component, (variable, unit)) in variables(index).into_iter().enumerate() {
                let key = (variable.name.clone(), unit);
                let slot = keys.iter().position(|k| *k == key).unwrap_or_else(|| {
                    keys.push(key);
                    parts.push(Vec::new());
                    keys.len() - 1
                });
                parts[slot].push(Part {
                    bounds: variable.bounds,
                    guards: variable.guards,
                    resolution: resolution(index, component),
                    span: phase.initial_time..phase.final_time,
                    line: curves.line(component),
                    dots: if total <= MOST_DOTS { curves.dots(component) } else { Vec::new() },
                });
            }
        }
        let draw = |((name, unit), parts): ((String, String), Vec<Part>)| {
            let name = format!("{}{name}", quantity.prefix);
            let resolution = parts.iter().map(|part| part.resolution).fold(0.0, f64::max);
            let axis = Axis::new(name.clone(), unit.clone()).resolved_to(resolution);
            let mut figure = self.axes(name, axis);
            // A quantity of some phases has their time alone.
            figure.spans.retain(|span| parts.iter().any(|part| part.span == span.range));
            let figure = if quantity.with_bounds { with_bounds(figure, &parts, &unit) } else { figure };
            let joined = |pick: fn(&Part) -> &Vec<[f64; 2]>| {
                // A gap between phases: states may jump there.
                let pieces: Vec<&[[f64; 2]]> = parts.iter().map(|p| pick(p).as_slice()).collect();
                pieces.join(&[f64::NAN; 2])
            };
            figure
                .with(Series::line("", joined(|p| &p.line)).colored(0))
                .with(Series::dots("", joined(|p| &p.dots)).colored(0))
        };
        keys.into_iter().zip(parts).map(draw).collect()
    }

    /// Steps over the intervals, with a dot at the start of each.
    fn steps(&self, figure: Figure, value: &dyn Fn(&PhaseTrajectory, usize) -> f64) -> Figure {
        let (mut line, mut dots) = (Vec::new(), Vec::new());
        for phase in &self.trajectory.phases {
            for (k, ends) in phase.control.breaks().windows(2).enumerate() {
                let y = value(phase, k);
                line.extend([[ends[0], y], [ends[1], y]]);
                dots.push([ends[0], y]);
            }
            line.push([f64::NAN; 2]);
        }
        dots.truncate(if dots.len() <= MOST_DOTS { dots.len() } else { 0 });
        figure.with(Series::line("", line).colored(0)).with(Series::dots("", dots).colored(0))
    }

    fn mesh(&self) -> Vec<Figure> {
        let mut figures = Vec::new();
        if self.trajectory.phases.iter().any(|p| !p.interval_errors.is_empty()) {
            let axis = Axis::new("estimated relative error", "-").logarithmic();
            let figure = self.axes("error estimate of each interval".into(), axis);
            let error = |p: &PhaseTrajectory, k: usize| p.interval_errors.get(k).copied().unwrap_or(f64::NAN);
            figures.push(self.steps(figure, &error));
        }
        let axis = Axis::new("points", "-").including(0.0);
        let figure = self.axes("collocation points of each interval".into(), axis);
        figures.push(self.steps(figure, &|p, k| p.mesh.points()[k] as f64));
        figures
    }
}

/// One phase of a figure.
struct Part {
    bounds: Bounds,
    /// Ends of the bounds that no solution is meant to reach, which are not drawn.
    guards: [bool; 2],
    /// Differences below this are none.
    resolution: f64,
    span: std::ops::Range<f64>,
    line: Vec<[f64; 2]>,
    dots: Vec<[f64; 2]>,
}

fn with_bounds(figure: Figure, parts: &[Part], unit: &str) -> Figure {
    let mut points = Vec::new();
    for part in parts {
        for (value, is_guard) in [part.bounds.lower, part.bounds.upper].into_iter().zip(part.guards) {
            if value.is_finite() && !is_guard {
                points.extend([[part.span.start, value], [part.span.end, value], [f64::NAN; 2]]);
            }
        }
    }
    if points.is_empty() {
        return figure;
    }
    let first = parts[0].bounds;
    let label = if parts.iter().any(|p| p.bounds != first) {
        "bounds".to_owned()
    } else {
        let values = parts.iter().flat_map(|p| &p.line).map(|p| p[1].abs()).filter(|v| v.is_finite());
        let ends = [first.lower.abs(), first.upper.abs()].into_iter().filter(|v| v.is_finite());
        let shown = display_unit(unit, values.chain(ends).fold(0.0, f64::max));
        let number = |v: f64| readable(v * shown.factor, 5);
        let [lower, upper] = parts[0].guards;
        let text = match (first.lower.is_finite() && !lower, first.upper.is_finite() && !upper) {
            (true, true) => format!("bounds {} to {}", number(first.lower), number(first.upper)),
            (true, false) => format!("lower bound {}", number(first.lower)),
            _ => format!("upper bound {}", number(first.upper)),
        };
        format!("{text} {}", shown.name).trim_end().to_owned()
    };
    figure.with(Series::bound(label, points))
}

/// All components of a polynomial at many times and at its nodes.
struct Curves {
    line: Vec<(f64, Vec<f64>)>,
    nodes: Vec<(f64, Vec<f64>)>,
}

impl Curves {
    fn new(phase: &PhaseTrajectory, polynomial: &PiecewisePolynomial, density: f64) -> Self {
        let value = |interval: usize, time: f64| {
            let mut x = vec![0.0; polynomial.dimension()];
            polynomial.evaluate_in(interval, time, &mut x);
            (time, x)
        };
        let line = polynomial
            .breaks()
            .windows(2)
            .enumerate()
            .flat_map(|(k, ends)| {
                let (start, width) = (ends[0], ends[1] - ends[0]);
                // A width that is not a number gives zero steps, hence the fewest.
                let steps = ((density * width) as usize).clamp(STEPS.0, STEPS.1);
                (0..=steps).map(move |j| (k, start + width * j as f64 / steps as f64))
            })
            .map(|(k, time)| value(k, time))
            .collect();
        let nodes = phase.nodes().map(|(time, interval)| value(interval, time)).collect();
        Self { line, nodes }
    }

    fn line(&self, component: usize) -> Vec<[f64; 2]> {
        self.line.iter().map(|(t, x)| [*t, x[component]]).collect()
    }

    fn dots(&self, component: usize) -> Vec<[f64; 2]> {
        self.nodes.iter().map(|(t, x)| [*t, x[component]]).collect()
    }
}
