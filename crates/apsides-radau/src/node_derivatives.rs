//! The entries of Jacobian and Hessian that a node function has at each node, as formulas of what is known at the node: found once.

use apsides_ad::NodePattern;
use apsides_transcription::write_next;

/// The time of an end of the arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum End {
    Start,
    Final,
}

/// A first derivative of an output.
#[derive(Clone, Copy, Debug)]
pub(crate) enum FirstDerivative {
    /// By an input that is no time, with its Jacobian entry.
    ByInput { output: usize, entry: usize, input: usize },
    /// By the time of an end, with the entry of the time, if the output depends on it.
    ByTime { output: usize, entry: Option<usize>, end: End },
}

/// A second derivative of the weighted sum of the outputs.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SecondDerivative {
    /// By two inputs that are no time, with the Hessian entry.
    ByInputs { entry: usize, inputs: [usize; 2] },
    /// By an input and, through the time of the node, the time of an end.
    AlongTime { entry: usize, input: usize, end: End },
    /// By an input and, through the duration, the time of an end.
    ThroughDuration { input: usize, end: End },
    /// By the times of two ends, with the Hessian entry of the time, if there is one.
    ByTimes { entry: Option<usize>, ends: [End; 2] },
}

/// A node of an arc: first column of its `[x, u]`, its part of the duration of the arc, and the factor of the term there.
#[derive(Clone, Copy)]
pub(crate) struct Point {
    pub(crate) column: usize,
    pub(crate) fraction: f64,
    pub(crate) factor: f64,
}

/// The quantities that are known at consecutive nodes: their points, the duration of the arc or one, and what the function does there, node
/// after node.
#[derive(Clone, Copy)]
pub(crate) struct NodeValues<'a> {
    pub(crate) points: &'a [Point],
    pub(crate) duration: f64,
    pub(crate) values: &'a [f64],
    pub(crate) entries: &'a [f64],
}

/// Number `k` of each node, of those that have `width` numbers each.
pub(crate) fn of_each(numbers: &[f64], width: usize, k: usize) -> impl Iterator<Item = &f64> {
    numbers.iter().skip(k).step_by(width.max(1))
}

/// The derivatives of one function on an arc, in the order of their entries.
pub(crate) struct NodeDerivatives {
    is_rate: bool,
    time_input: usize,
    pub(crate) first: Vec<FirstDerivative>,
    pub(crate) second: Vec<SecondDerivative>,
    /// True if second derivatives take the gradient of the weighted sum of the outputs: where times are free.
    uses_slope: bool,
    /// Output and input of each Jacobian entry of the function.
    places: Vec<(usize, usize)>,
    outputs: usize,
    hessian_len: usize,
}

impl NodeDerivatives {
    /// The derivatives of a function with the time as its last input; of the times of both ends some are fixed.
    pub(crate) fn new(
        pattern: &NodePattern,
        time_input: usize,
        is_rate: bool,
        time_fixed: (bool, bool),
    ) -> Self {
        let ends: Vec<End> = [(End::Start, time_fixed.0), (End::Final, time_fixed.1)]
            .into_iter()
            .filter_map(|(end, fixed)| (!fixed).then_some(end))
            .collect();
        let places: Vec<(usize, usize)> = pattern.jacobian_entries().collect();
        let mut first = Vec::new();
        for (output, bounds) in pattern.row_offsets.windows(2).enumerate() {
            // Time is the last input, so its entry is the last of a row.
            let by_time = (bounds[0]..bounds[1]).last().filter(|k| places[*k].1 == time_input);
            for entry in bounds[0]..by_time.unwrap_or(bounds[1]) {
                first.push(FirstDerivative::ByInput { output, entry, input: places[entry].1 });
            }
            if is_rate || by_time.is_some() {
                first.extend(ends.iter().map(|&end| FirstDerivative::ByTime { output, entry: by_time, end }));
            }
        }
        let mut second = Vec::new();
        let mut by_time_twice = None;
        for (entry, &(i, j)) in pattern.hessian.iter().enumerate() {
            if i != time_input {
                second.push(SecondDerivative::ByInputs { entry, inputs: [i, j] });
            } else if j != time_input {
                second.extend(ends.iter().map(|&end| SecondDerivative::AlongTime { entry, input: j, end }));
            } else {
                by_time_twice = Some(entry);
            }
        }
        if is_rate {
            let mut inputs: Vec<usize> =
                pattern.columns.iter().copied().filter(|input| *input != time_input).collect();
            inputs.sort_unstable();
            inputs.dedup();
            for input in inputs {
                second.extend(ends.iter().map(|&end| SecondDerivative::ThroughDuration { input, end }));
            }
        }
        if pattern.columns.contains(&time_input) {
            let entry = by_time_twice;
            second.extend(ends.iter().map(|&end| SecondDerivative::ByTimes { entry, ends: [end, end] }));
            if ends.len() == 2 {
                second.push(SecondDerivative::ByTimes { entry, ends: [End::Final, End::Start] });
            }
        }
        let takes_slope = |second: &SecondDerivative| {
            use SecondDerivative::{ByTimes, ThroughDuration};
            matches!(second, ThroughDuration { .. } | ByTimes { .. })
        };
        let uses_slope = second.iter().any(takes_slope);
        Self {
            is_rate,
            time_input,
            first,
            second,
            uses_slope,
            places,
            outputs: pattern.row_offsets.len() - 1,
            hessian_len: pattern.hessian_len(),
        }
    }

    /// Calls `take` with each value of a first derivative, node after node; one derivative at all nodes at a time, so that its formula is chosen once.
    pub(crate) fn first_values(
        &self,
        first: &FirstDerivative,
        at: NodeValues<'_>,
        take: &mut impl FnMut(f64),
    ) {
        let NodeValues { points, duration, values, entries } = at;
        let [outputs, width] = [self.outputs, self.places.len()];
        match *first {
            FirstDerivative::ByInput { entry, .. } => {
                for (p, v) in points.iter().zip(of_each(entries, width, entry)) {
                    take(p.factor * duration * v);
                }
            }
            FirstDerivative::ByTime { output, entry, end } => {
                for (k, p) in points.iter().enumerate() {
                    let by_time = entry.map_or(0.0, |entry| duration * entries[k * width + entry]);
                    let direct = if self.is_rate { values[k * outputs + output] } else { 0.0 };
                    let along = share(p.share_of(end), by_time);
                    take(p.factor * if end == End::Start { along - direct } else { along + direct });
                }
            }
        }
    }

    /// Writes all first derivatives of each node.
    pub(crate) fn fill_first(&self, at: NodeValues<'_>, target: &mut [f64]) {
        let width = self.first.len();
        for (k, first) in self.first.iter().enumerate() {
            let mut entries = target[k..].iter_mut().step_by(width);
            self.first_values(first, at, &mut |v| write_next(&mut entries, v));
        }
    }

    /// Writes all second derivatives of each node, from the Hessian entries of the weighted sums of the outputs and their gradients.
    pub(crate) fn fill_second(
        &self,
        at: NodeValues<'_>,
        hessians: &[f64],
        slopes: &[f64],
        target: &mut [f64],
    ) {
        let NodeValues { points, duration, .. } = at;
        let hessian = |entry| of_each(hessians, self.hessian_len, entry);
        let slope = |input| of_each(slopes, self.inputs(), input);
        let width = self.second.len();
        for (k, second) in self.second.iter().enumerate() {
            let entries = target[k..].iter_mut().step_by(width);
            match *second {
                SecondDerivative::ByInputs { entry, .. } => {
                    entries.zip(hessian(entry)).for_each(|(e, v)| *e = duration * v);
                }
                SecondDerivative::AlongTime { entry, end, .. } => {
                    for ((e, p), v) in entries.zip(points).zip(hessian(entry)) {
                        *e = share(p.share_of(end), duration * v);
                    }
                }
                SecondDerivative::ThroughDuration { input, end } => {
                    let sign = if end == End::Start { -1.0 } else { 1.0 };
                    entries.zip(slope(input)).for_each(|(e, v)| *e = sign * v);
                }
                SecondDerivative::ByTimes { entry, ends } => {
                    for (k, (e, p)) in entries.zip(points).enumerate() {
                        let twice =
                            entry.map_or(0.0, |entry| duration * hessians[k * self.hessian_len + entry]);
                        let s = if self.is_rate { slopes[k * self.inputs() + self.time_input] } else { 0.0 };
                        let (a, b) = (p.share_of(End::Start), p.share_of(End::Final));
                        *e = match ends {
                            [End::Start, End::Start] => share(a * a, twice) - 2.0 * a * s,
                            [End::Final, End::Final] => share(b * b, twice) + 2.0 * b * s,
                            _ => share(a * b, twice) + (a - b) * s,
                        };
                    }
                }
            }
        }
    }

    /// Inputs of the function: the time is the last.
    fn inputs(&self) -> usize {
        self.time_input + 1
    }

    /// Writes the gradients of the weighted sums of the outputs by the inputs, from the Jacobian entries at the nodes, if second derivatives take
    /// them.
    pub(crate) fn fill_slopes(&self, entries: &[f64], weights: &[f64], slopes: &mut [f64]) {
        if !self.uses_slope {
            return;
        }
        slopes.fill(0.0);
        for (k, &(output, input)) in self.places.iter().enumerate() {
            let slopes = slopes[input..].iter_mut().step_by(self.inputs());
            let weights = of_each(weights, self.outputs, output);
            for ((slope, v), weight) in slopes.zip(of_each(entries, self.places.len(), k)).zip(weights) {
                *slope += weight * v;
            }
        }
    }
}

impl Point {
    /// The part of the time of an end in that of the point.
    fn share_of(&self, end: End) -> f64 {
        if end == End::Start { 1.0 - self.fraction } else { self.fraction }
    }
}

/// The part of a derivative by time that a time of an end has. At the other end it has none, even of an infinite one, as that of
/// `t^1.5` is at zero.
fn share(weight: f64, derivative: f64) -> f64 {
    if weight == 0.0 { 0.0 } else { weight * derivative }
}
