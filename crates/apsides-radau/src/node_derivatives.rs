//! The entries of Jacobian and Hessian that a node function has at each node, as formulas of what is known at the node: found once.

use apsides_ad::NodePattern;

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

/// The quantities that are known at a node: its share of the arc, its factor, the duration of the arc or one, and what the function does there.
#[derive(Clone, Copy)]
pub(crate) struct NodeValues<'a> {
    pub(crate) fraction: f64,
    pub(crate) factor: f64,
    pub(crate) duration: f64,
    pub(crate) values: &'a [f64],
    pub(crate) entries: &'a [f64],
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
        Self { is_rate, time_input, first, second, uses_slope, places }
    }

    /// The value of a first derivative.
    #[inline]
    pub(crate) fn first_value(&self, first: &FirstDerivative, at: &NodeValues<'_>) -> f64 {
        match *first {
            FirstDerivative::ByInput { entry, .. } => at.factor * at.duration * at.entries[entry],
            FirstDerivative::ByTime { output, entry, end } => {
                let by_time = entry.map_or(0.0, |k| at.duration * at.entries[k]);
                let direct = if self.is_rate { at.values[output] } else { 0.0 };
                at.factor
                    * match end {
                        End::Start => share(1.0 - at.fraction, by_time) - direct,
                        End::Final => share(at.fraction, by_time) + direct,
                    }
            }
        }
    }

    /// The value of a second derivative, from the Hessian entries of the weighted sum of the outputs and its gradient.
    #[inline]
    pub(crate) fn second_value(
        &self,
        second: &SecondDerivative,
        (fraction, duration): (f64, f64),
        hessian: &[f64],
        slope: &[f64],
    ) -> f64 {
        match *second {
            SecondDerivative::ByInputs { entry, .. } => duration * hessian[entry],
            SecondDerivative::AlongTime { entry, end, .. } => {
                let weight = if end == End::Start { 1.0 - fraction } else { fraction };
                share(weight, duration * hessian[entry])
            }
            SecondDerivative::ThroughDuration { input, end } => {
                if end == End::Start {
                    -slope[input]
                } else {
                    slope[input]
                }
            }
            SecondDerivative::ByTimes { entry, ends } => {
                let twice = entry.map_or(0.0, |k| duration * hessian[k]);
                let s = if self.is_rate { slope[self.time_input] } else { 0.0 };
                let (a, b) = (1.0 - fraction, fraction);
                match ends {
                    [End::Start, End::Start] => share(a * a, twice) - 2.0 * a * s,
                    [End::Final, End::Final] => share(b * b, twice) + 2.0 * b * s,
                    _ => share(a * b, twice) + (a - b) * s,
                }
            }
        }
    }

    /// Writes the gradient of the weighted sum of the outputs by the inputs, from the Jacobian entries at a node, if second derivatives take it.
    pub(crate) fn fill_slope(&self, entries: &[f64], weights: &[f64], slope: &mut [f64]) {
        if !self.uses_slope {
            return;
        }
        slope.fill(0.0);
        for (&(output, input), v) in self.places.iter().zip(entries) {
            slope[input] += weights[output] * v;
        }
    }
}

/// The part of a derivative by time that a time of an end has. At the other end it has none, even of an infinite one, as that of
/// `t^1.5` is at zero.
fn share(weight: f64, derivative: f64) -> f64 {
    if weight == 0.0 { 0.0 } else { weight * derivative }
}
