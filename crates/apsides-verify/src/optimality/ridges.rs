//! Kinks and jumps of functions of end quantities, at the point.
//!
//! The functions are smooth on each of the cells that their kinks cut the space of end quantities into. A minimum has no cell into which
//! cost and multipliers times constraints fall to first order, and none behind a jump where they are less: on each cell they are as good as
//! linear, and fall in some direction of it where the projection of the steepest descent onto it is not zero. The cells are found one from the
//! other, across one kink at a time, so that a narrow one is not missed.
//!
//! The derivative of a magnitude is taken as zero at its kink, which suits a magnitude that is to be small. Where it is to be large the kink is
//! a ridge, and both of its sides are better.

use std::collections::HashSet;
use std::sync::Arc;

use apsides_ad::{NodeFunction, formula_node};
use apsides_ocp::{EndpointInput, Ocp};
use nalgebra::DVector;

use super::cone;
use crate::ends::{EndScales, Ends, allowed};
use crate::worst::{Worst, relative};
use crate::{Check, CheckKind, VerifySettings};

/// An argument of a kink is zero at the point if it is less than this, over quantities in their scales.
const MET: f64 = 1e-7;
/// Distance from the point at which a cell is looked at, in scales; what is linear in it is taken off.
const STEP: f64 = 1e-5;
/// A direction inside a cell keeps each argument away from zero by this part of the step.
const INSIDE: f64 = 1e-3;
/// Directions in which cells are looked for first.
const DIRECTIONS: usize = 64;
/// Most cells that are looked at.
const MOST: usize = 512;
/// Values that differ by less, relative to the parts of the objective, are the same.
const SAME_VALUE: f64 = 1e-7;
/// Second derivatives that differ by less, relative to them and to the slopes, are the same.
const SAME_CURVATURE: f64 = 1e-4;
/// Parts of a direction that are rounding.
const ROUNDING: f64 = 1e-9;
/// Irrational multiples of which the parts fill a cube evenly (H. Weyl 1916).
const SPREAD: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];

/// The findings at the kinks of end functions.
#[derive(Default)]
pub(super) struct Ridges {
    /// End quantities whose first-order condition is that of the cells.
    pub(super) inputs: Vec<EndpointInput>,
    pub(super) check: Option<Check>,
    /// True if the second derivatives at the point are not those of all cells.
    pub(super) hides_curvature: bool,
}

/// The part that all else has in the first-order conditions at the ends.
pub(super) struct Others<'a> {
    /// The slope of all else in an end quantity, smooth functions of the ends included; none where it is not known.
    pub(super) slope: &'a dyn Fn(EndpointInput) -> Option<f64>,
    /// The size against which slopes, times the scale of their quantities, are held.
    pub(super) size: f64,
}

/// A function with kinks that are met at the point.
pub(super) struct KinkedEnd {
    function: Arc<dyn NodeFunction>,
    inputs: Vec<EndpointInput>,
    /// Weight of each output in cost and multipliers times constraints.
    weights: Vec<f64>,
    /// The arguments that are zero at kinks.
    arguments: Arc<dyn NodeFunction>,
    /// Those that are zero at the point.
    met: Vec<usize>,
}

/// Values and slopes at a point beside the one that is judged.
struct Beside {
    value: f64,
    gradient: DVector<f64>,
    /// Value and gradient of each argument that is zero at the point.
    arguments: Vec<(f64, DVector<f64>)>,
}

/// A cell.
struct Cell {
    /// A direction into it.
    direction: DVector<f64>,
    /// The edges, as `gradient d >= 0`, of unit length.
    edges: Vec<DVector<f64>>,
    /// Cost and multipliers times constraints, and their slopes, as the point is come to from the cell.
    value: f64,
    gradient: DVector<f64>,
    /// True if the second derivatives along a direction into the cell are those at the point.
    has_curvature_of_point: bool,
}

/// Looks at all cells around the point that functions with kinks make.
pub(super) fn look(
    ocp: &Ocp,
    ends: &Ends,
    scales: &EndScales<'_>,
    settings: &VerifySettings,
    kinked: Vec<KinkedEnd>,
    others: &Others<'_>,
) -> Ridges {
    let mut inputs: Vec<EndpointInput> = Vec::new();
    for input in kinked.iter().flat_map(|k| &k.inputs) {
        let is_free = !allowed(ocp, *input).is_fixed() && (others.slope)(*input).is_some();
        if is_free && !inputs.contains(input) {
            inputs.push(*input);
        }
    }
    if inputs.is_empty() {
        return Ridges::default();
    }
    let around = Around::new(ocp, ends, scales, settings, kinked, inputs);
    let cells = around.cells();
    if cells.is_empty() {
        // The conditions stay those of the derivatives at the point, and say nothing of the sides that were not seen.
        return Ridges { hides_curvature: true, ..Ridges::default() };
    }
    let rest = around.rest(others);
    let here = around.beside(&DVector::zeros(around.inputs.len()), 0.0).value;
    let mut worst = Worst::default();
    for cell in &cells {
        let scale = ocp.objective.scale.unwrap_or(0.0).max(here.abs()).max(cell.value.abs());
        let jump = relative(cell.value - here, scale);
        let all: Vec<DVector<f64>> = cell.edges.iter().chain(&around.bounds).cloned().collect();
        let way = cone::projection(&all, &-(&rest + &cell.gradient));
        let fall = relative(way.norm(), others.size.max(cell.gradient.amax()).max(rest.amax()));
        // Behind a jump upwards nothing is lost.
        let (residual, way) = match jump {
            _ if jump < -SAME_VALUE => (-jump, &cell.direction),
            _ if jump > SAME_VALUE => (0.0, &cell.direction),
            _ => (fall, &way),
        };
        worst.consider(residual, settings.stationarity_tolerance, "-", || {
            let moved = around.inputs.iter().zip(way.iter()).filter(|(_, d)| d.abs() > ROUNDING * way.amax());
            let words: Vec<String> = moved.map(|(input, d)| words(ocp, *input, *d)).collect();
            format!("less with {}", words.join(" and "))
        });
    }
    let hides_curvature = cells.len() >= MOST || !cells.iter().all(|cell| cell.has_curvature_of_point);
    let check = worst.into_check("ridges of functions of the ends", CheckKind::Curvature);
    Ridges { inputs: around.inputs, check, hides_curvature }
}

/// The functions of the objective, and those of constraints with multipliers, with kinks that are met.
pub(super) fn kinked(
    ocp: &Ocp,
    ends: &Ends,
    scales: &EndScales<'_>,
    multipliers: Option<&Vec<Vec<f64>>>,
) -> Vec<KinkedEnd> {
    let sign = ocp.objective.sense.sign();
    let of_objective = ocp.objective.functions.iter().map(|(inputs, f)| (inputs, f, vec![sign]));
    let of_constraints = ocp.constraints.iter().enumerate().filter_map(|(k, c)| {
        let weights = multipliers?.get(k)?.clone();
        Some((&c.inputs, &c.function, weights))
    });
    let all = of_objective.chain(of_constraints).filter(|(.., weights)| weights.iter().any(|w| *w != 0.0));
    all.filter_map(|(inputs, function, weights)| {
        let formula = function.formula().ok()?;
        let arguments = formula_node(formula.arguments_of(&formula.kinks()));
        let (function, inputs) = (function.clone(), inputs.clone());
        let mut kinked = KinkedEnd { function, inputs, weights, arguments, met: Vec::new() };
        kinked.keep_met(ends, scales);
        (!kinked.met.is_empty()).then_some(kinked)
    })
    .collect()
}

impl KinkedEnd {
    /// Values and dense Jacobian of a function of its inputs, at the point with these moved.
    fn at(
        &self,
        f: &dyn NodeFunction,
        ends: &Ends,
        moved: impl Fn(usize) -> f64,
    ) -> (Vec<f64>, Vec<Vec<f64>>) {
        let z: Vec<f64> = self.inputs.iter().enumerate().map(|(k, i)| ends.value(*i) + moved(k)).collect();
        let (mut values, mut entries) = (vec![0.0; f.outputs()], vec![0.0; f.pattern().jacobian_len()]);
        f.jacobian(&z, &mut values, &mut entries);
        let mut jacobian = vec![vec![0.0; z.len()]; values.len()];
        for ((row, column), v) in f.pattern().jacobian_entries().zip(entries) {
            jacobian[row][column] = v;
        }
        (values, jacobian)
    }

    /// Finds the arguments that are zero at the point.
    fn keep_met(&mut self, ends: &Ends, scales: &EndScales<'_>) {
        let scale: Vec<f64> = self.inputs.iter().map(|input| scales.scale(*input)).collect();
        let (values, _) = self.at(self.arguments.as_ref(), ends, |_| 0.0);
        // At the point itself an argument may have no slope.
        let (_, slopes) = self.at(self.arguments.as_ref(), ends, |k| STEP * spread(1, k) * scale[k]);
        let size = |k: usize| slopes[k].iter().zip(&scale).map(|(g, s)| (g * s).abs()).sum::<f64>();
        self.met = (0..values.len()).filter(|k| values[*k].abs() <= MET * size(*k)).collect();
    }
}

/// A number from -1 to 1, one for each direction and quantity.
fn spread(direction: usize, quantity: usize) -> f64 {
    let [a, b] = SPREAD;
    2.0 * (direction as f64 * a + (direction + quantity * direction + quantity) as f64 * b).fract() - 1.0
}

/// The surroundings of the point.
struct Around<'a> {
    ends: &'a Ends,
    kinked: Vec<KinkedEnd>,
    /// All quantities that are free, and their scales.
    inputs: Vec<EndpointInput>,
    scales: Vec<f64>,
    /// Bounds that are met, as directions `row d >= 0`.
    bounds: Vec<DVector<f64>>,
}

impl<'a> Around<'a> {
    fn new(
        ocp: &Ocp,
        ends: &'a Ends,
        scales: &EndScales<'_>,
        settings: &VerifySettings,
        kinked: Vec<KinkedEnd>,
        inputs: Vec<EndpointInput>,
    ) -> Self {
        let scales: Vec<f64> = inputs.iter().map(|input| scales.scale(*input)).collect();
        let mut bounds = Vec::new();
        for (k, (input, scale)) in inputs.iter().zip(&scales).enumerate() {
            let (value, allowed) = (ends.value(*input), allowed(ocp, *input));
            let near = settings.activity_tolerance * scale;
            let mut unit = DVector::zeros(inputs.len());
            unit[k] = if value - allowed.lower <= near { 1.0 } else { -1.0 };
            if value - allowed.lower <= near || allowed.upper - value <= near {
                bounds.push(unit);
            }
        }
        Self { ends, kinked, inputs, scales, bounds }
    }

    fn place(&self, input: EndpointInput) -> Option<usize> {
        self.inputs.iter().position(|i| *i == input)
    }

    /// The slopes of all else.
    fn rest(&self, others: &Others<'_>) -> DVector<f64> {
        let slope = |(input, scale): (&EndpointInput, &f64)| (others.slope)(*input).unwrap_or(0.0) * scale;
        let mut rest =
            DVector::from_iterator(self.inputs.len(), self.inputs.iter().zip(&self.scales).map(slope));
        // Those of the functions with kinks are in it, as the point has them.
        rest -= self.beside(&DVector::zeros(self.inputs.len()), 0.0).gradient;
        rest
    }

    fn beside(&self, direction: &DVector<f64>, step: f64) -> Beside {
        let n = self.inputs.len();
        let mut beside = Beside { value: 0.0, gradient: DVector::zeros(n), arguments: Vec::new() };
        for kinked in &self.kinked {
            let places: Vec<Option<usize>> = kinked.inputs.iter().map(|i| self.place(*i)).collect();
            let moved = |k: usize| places[k].map_or(0.0, |p| step * direction[p] * self.scales[p]);
            let (values, jacobian) = kinked.at(kinked.function.as_ref(), self.ends, moved);
            let over_all = |slopes: &[f64]| {
                let mut gradient = DVector::zeros(n);
                for (place, slope) in places.iter().zip(slopes) {
                    if let Some(p) = place {
                        gradient[*p] += slope * self.scales[*p];
                    }
                }
                gradient
            };
            for (output, weight) in kinked.weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
                beside.value += weight * values[output];
                beside.gradient += over_all(&jacobian[output]) * *weight;
            }
            let (values, jacobian) = kinked.at(kinked.arguments.as_ref(), self.ends, moved);
            beside.arguments.extend(kinked.met.iter().map(|k| (values[*k], over_all(&jacobian[*k]))));
        }
        beside
    }

    /// Second derivatives at the point along a direction.
    fn curvature_along(&self, direction: &DVector<f64>) -> DVector<f64> {
        let mut change = DVector::zeros(self.inputs.len());
        for kinked in &self.kinked {
            for (a, b, v) in self.ends.hessian(kinked.function.as_ref(), &kinked.inputs, &kinked.weights) {
                let (Some(a), Some(b)) = (self.place(a), self.place(b)) else { continue };
                let v = v * self.scales[a] * self.scales[b];
                change[a] += v * direction[b];
                if a != b {
                    change[b] += v * direction[a];
                }
            }
        }
        change
    }

    /// The cells, each found from a direction or from its neighbour across an edge.
    fn cells(&self) -> Vec<Cell> {
        let n = self.inputs.len();
        let mut open: Vec<DVector<f64>> = (1..=DIRECTIONS)
            .map(|k| {
                let mut direction = DVector::from_fn(n, |i, _| spread(k, i));
                for row in &self.bounds {
                    let excess = row.dot(&direction).min(0.0);
                    direction -= row * (2.0 * excess);
                }
                direction
            })
            .collect();
        let (mut cells, mut known) = (Vec::new(), HashSet::new());
        while let Some(direction) = open.pop() {
            if cells.len() >= MOST {
                break;
            }
            let Some((sides, cell)) = self.cell(&direction) else { continue };
            if !known.insert(sides) {
                continue;
            }
            for k in 0..cell.edges.len() {
                let mut beyond = cell.edges.clone();
                beyond[k] = -&beyond[k];
                open.extend(cone::inside(&beyond, &self.bounds));
            }
            cells.push(cell);
        }
        cells
    }

    /// The cell that a direction leads into, by the signs of the arguments; none where it leads along an edge.
    fn cell(&self, direction: &DVector<f64>) -> Option<(Vec<bool>, Cell)> {
        let direction = direction / direction.amax();
        let (near, far) = (self.beside(&direction, STEP), self.beside(&direction, 2.0 * STEP));
        let (mut sides, mut edges) = (Vec::new(), Vec::new());
        for (value, gradient) in &near.arguments {
            let size = gradient.norm();
            if size == 0.0 && *value == 0.0 {
                continue;
            }
            let is_clear = value.abs() >= INSIDE * STEP * size;
            if !is_clear {
                return None;
            }
            sides.push(*value > 0.0);
            if size > 0.0 {
                edges.push(gradient * (value.signum() / size));
            }
        }
        let change = (&far.gradient - &near.gradient) / STEP;
        let expected = self.curvature_along(&direction);
        let size = near.gradient.amax().max(expected.amax()).max(f64::MIN_POSITIVE);
        let cell = Cell {
            direction,
            edges,
            value: 2.0 * near.value - far.value,
            gradient: &near.gradient * 2.0 - far.gradient,
            has_curvature_of_point: (change - expected).amax() <= SAME_CURVATURE * size,
        };
        let is_finite = cell.value.is_finite() && cell.gradient.iter().all(|v| v.is_finite());
        is_finite.then_some((sides, cell))
    }
}

/// The words for a change of an end quantity.
fn words(ocp: &Ocp, input: EndpointInput, change: f64) -> String {
    let change = if change > 0.0 { "larger" } else { "smaller" };
    let (end, quantity, phase) = match input {
        EndpointInput::InitialTime { phase } => ("initial", "time", phase),
        EndpointInput::FinalTime { phase } => ("final", "time", phase),
        EndpointInput::InitialState { phase, state } => {
            ("initial", ocp.phases[phase].states[state].variable.name.as_str(), phase)
        }
        EndpointInput::FinalState { phase, state } => {
            ("final", ocp.phases[phase].states[state].variable.name.as_str(), phase)
        }
        EndpointInput::Parameter { index } => return format!("{change} {}", ocp.parameters[index].name),
    };
    format!("{change} {end} {quantity}, phase `{}`", ocp.phases[phase].name)
}
