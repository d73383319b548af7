//! Features of states that a trajectory passes between its nodes: thin layers, walls and wells, which neither the points of a method nor the
//! steps of a re-simulation would see.
//!
//! Bounds of the formulas and of their slopes over the box of a short time ([`Expansion`]) tell what its ends cannot hide. Where they may hide
//! more, the time is halved, until nothing is hidden or a value in the middle is far from what the nodes tell. What depends on time alone is
//! the subject of [`explicit_time`](crate::explicit_time). Functions without a formula tell nothing.
//!
//! Besides the values of equations of motion and integrands, those of their operations that may be peaks are looked at: along the trajectory a
//! product may be nothing since its other factor is, which it would not be along a trajectory beside it, or with another control.

use apsides_ad::formula::{Binary, Operation, Unary};
use apsides_ad::{Derivatives, Expansion, Formula, NodeFunction};

use crate::{Bounds, Guess, Ocp, OcpError, Phase, PhaseScaling, PhaseTrajectory, Scaling, Trajectory};

/// Part of the size of a value that may stay hidden, and that the nodes may miss.
const HIDDEN: f64 = 1e-3;
/// Intervals that are looked at in a phase, at most, for each function: beyond, what is hidden stays hidden.
const MOST_LOOKS: usize = 4000;
/// Ends within a feature, at most: of more, the first and the last alone are taken.
const MOST_ENDS: usize = 128;
/// Bisections for the end of a feature.
const BISECTIONS: usize = 8;
/// Halvings of the interval between two nodes, at most.
const MOST_HALVINGS: usize = 30;
/// Values that are less than this part of their scales at all nodes are nothing there.
const NOTHING: f64 = 1e-9;
/// Samples of the polynomials over an interval: both ends, the middle and two between.
const SAMPLES: usize = 5;

type Interval = [f64; 2];

/// The functions whose features are looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Among {
    /// Equations of motion, integrands and path constraints.
    All,
    /// Path constraints, which hold at the points of a mesh: with points there nothing passes.
    PathConstraints,
}

/// Times in each phase, in increasing order, at which pieces of a trajectory need ends for all that it passes to be seen.
#[must_use]
pub fn passed_unseen(ocp: &Ocp, trajectory: &Trajectory, among: Among) -> Vec<Vec<f64>> {
    let scaling = Scaling::new(ocp, &Guess::earlier(trajectory));
    let phases = ocp.phases.iter().zip(&trajectory.phases).zip(&scaling.phases);
    let parameters = &trajectory.parameters[..];
    let passing = |((phase, found), scaling)| Passing { phase, found, parameters, scaling, among };
    phases.map(passing).map(|passing| passing.times()).collect()
}

/// The trajectory with ends of its pieces at the features that it passes unseen; none where there are none. The polynomials are the same.
///
/// # Errors
/// [`OcpError::Mesh`] when polynomials and meshes do not fit.
pub fn divided_trajectory(ocp: &Ocp, trajectory: &Trajectory) -> Result<Option<Trajectory>, OcpError> {
    let times = passed_unseen(ocp, trajectory, Among::All);
    if times.iter().all(Vec::is_empty) {
        return Ok(None);
    }
    let phases = trajectory.phases.iter().zip(&times);
    let phases = phases.map(|(phase, times)| phase.divided_at(times)).collect::<Result<_, _>>()?;
    Ok(Some(Trajectory { phases, ..trajectory.clone() }))
}

/// One phase of a trajectory.
struct Passing<'a> {
    phase: &'a Phase,
    found: &'a PhaseTrajectory,
    parameters: &'a [f64],
    scaling: &'a PhaseScaling,
    among: Among,
}

/// The measure of an output of a function.
enum Kind {
    /// Its values at the nodes, or this where they are less.
    Value(f64),
    /// Its values, where a change that the nodes do not tell is a feature even if it is monotone.
    Step,
    /// The bounds of a path constraint, and their size.
    Row(Bounds, f64),
}

/// One function of the phase.
struct Function<'a> {
    function: &'a dyn NodeFunction,
    /// The formula, with the operations that may be peaks as further outputs.
    expansion: Expansion,
    kinds: Vec<Kind>,
    /// Largest magnitude of each output that was met.
    sizes: Vec<f64>,
    /// Work space: the inputs at the samples of a time, one after the other, and the intervals of their values and slopes.
    samples: Vec<f64>,
    values: Vec<Interval>,
    slopes: Vec<Interval>,
}

impl Function<'_> {
    fn evaluate(&self, z: &[f64], out: &mut [f64]) {
        if out.len() == self.function.outputs() {
            self.function.value(z, out);
        } else {
            out.copy_from_slice(&self.expansion.formula().evaluate(z));
        }
    }
}

/// The measure of the result of an operation that makes something narrow of wide ranges of its operands; none of others.
fn part(operation: Operation) -> Option<Kind> {
    match operation {
        // The square of a step is a peak.
        Operation::Unary(Unary::Tanh, _) => Some(Kind::Step),
        Operation::Unary(Unary::Exp | Unary::Recip, _)
        | Operation::Binary(Binary::Div | Binary::Pow, ..)
        | Operation::Curve(..)
        | Operation::Surface(..) => Some(Kind::Value(f64::MIN_POSITIVE)),
        Operation::Powi(_, exponent) if exponent < 0 => Some(Kind::Value(f64::MIN_POSITIVE)),
        Operation::Powf(_, exponent) if exponent < 0.0 => Some(Kind::Value(f64::MIN_POSITIVE)),
        _ => None,
    }
}

impl Passing<'_> {
    fn times(&self) -> Vec<f64> {
        let (state, control) = (&self.found.state, &self.found.control);
        // Where states and controls have pieces of their own, their nodes say nothing of each other.
        if state.breaks() != control.breaks() {
            return Vec::new();
        }
        let mut times = Vec::new();
        for mut function in self.functions() {
            let mut looks = 0;
            for segment in 0..state.segments().len() {
                self.look_along(&mut function, segment, &mut looks, &mut times);
            }
        }
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }

    /// The functions that are not linear, and have a formula.
    fn functions(&self) -> Vec<Function<'_>> {
        let phase = self.phase;
        let duration = self.found.final_time - self.found.initial_time;
        let values = |scales: &[f64]| {
            scales.iter().map(|scale| Kind::Value(NOTHING * scale / duration)).collect::<Vec<_>>()
        };
        let mut scales = self.scaling.path.iter();
        let rows = phase.path.iter().map(move |c| {
            let kinds = c.rows.iter().zip(scales.by_ref()).map(|(row, scale)| {
                let finite = |b: f64| if b.is_finite() { b.abs() } else { 0.0 };
                let bound = finite(row.bounds.lower).max(finite(row.bounds.upper));
                Kind::Row(row.bounds, if bound > 0.0 { bound } else { *scale })
            });
            (c.function.as_ref(), kinds.collect::<Vec<_>>())
        });
        let scales = self.scaling.integrals.chunks(1);
        let integrands =
            phase.integrals.iter().zip(scales).map(|(q, scale)| (q.function.as_ref(), values(scale)));
        let motion = (phase.dynamics.as_ref(), values(&self.scaling.states));
        let others = std::iter::once(motion).chain(integrands);
        others
            .filter(|_| self.among == Among::All)
            .chain(rows)
            .filter_map(|(function, kinds)| {
                let formula = function.formula().ok()?;
                let is_linear = function.pattern().hessian.is_empty() && formula.kinks().is_empty();
                (!is_linear).then(|| self.function(function, formula, kinds))
            })
            .collect()
    }

    fn function<'f>(
        &self,
        function: &'f dyn NodeFunction,
        formula: Formula,
        mut kinds: Vec<Kind>,
    ) -> Function<'f> {
        let formula = if self.among == Among::All {
            kinds.extend(formula.operations().iter().filter_map(|operation| part(*operation)));
            formula.with_results_of(|operation| part(operation).is_some())
        } else {
            formula
        };
        let n = function.inputs();
        let mut function = Function {
            function,
            sizes: vec![0.0; kinds.len()],
            expansion: Expansion::new(formula),
            kinds,
            samples: vec![0.0; SAMPLES * n],
            values: vec![[0.0; 2]; n],
            slopes: vec![[0.0; 2]; n],
        };
        for (size, kind) in function.sizes.iter_mut().zip(&function.kinds) {
            if let Kind::Value(least) = kind {
                *size = *least;
            }
        }
        let (mut z, mut out) = (vec![0.0; n], vec![0.0; function.kinds.len()]);
        for (t, segment) in self.found.nodes() {
            self.inputs(segment, t, &mut z);
            function.evaluate(&z, &mut out);
            function.sizes.iter_mut().zip(&out).for_each(|(size, v)| *size = size.max(v.abs()));
        }
        function
    }

    /// The inputs of a function at a time of a piece.
    fn inputs(&self, segment: usize, t: f64, z: &mut [f64]) {
        let (nx, nu) = (self.phase.states.len(), self.phase.controls.len());
        let (x, rest) = z.split_at_mut(nx);
        let (u, rest) = rest.split_at_mut(nu);
        let (p, time) = rest.split_at_mut(rest.len() - 1);
        self.found.state.evaluate_in(segment, t, x);
        self.found.control.evaluate_in(segment, t, u);
        p.copy_from_slice(&self.parameters[..p.len()]);
        time[0] = t;
    }

    /// Looks between the nodes of a piece; adds the ends of what they do not see, and where it is largest.
    fn look_along(&self, f: &mut Function<'_>, segment: usize, looks: &mut usize, times: &mut Vec<f64>) {
        let nodes: Vec<f64> = self.found.state.node_times(segment).collect();
        let told = Told::new(self, f, segment, &nodes);
        for w in nodes.windows(2) {
            let mut left = vec![([w[0], w[1]], 0)];
            let mut missed: Vec<(Interval, f64)> = Vec::new();
            let mut seen: Vec<Interval> = Vec::new();
            while let Some(([a, b], halvings)) = left.pop() {
                let middle = 0.5 * (a + b);
                if *looks >= MOST_LOOKS || halvings > MOST_HALVINGS || middle <= a || middle >= b {
                    continue;
                }
                *looks += 1;
                if !self.may_hide(f, segment, [a, b]) {
                    seen.push([a, b]);
                    continue;
                }
                let miss = told.miss(self, f, segment, middle);
                if miss > HIDDEN {
                    missed.push(([a, b], miss));
                }
                left.extend([([middle, b], halvings + 1), ([a, middle], halvings + 1)]);
            }
            if self.among == Among::All {
                // Relative to the sizes met since.
                for ([a, b], miss) in &mut missed {
                    *miss = told.miss(self, f, segment, 0.5 * (*a + *b));
                }
            }
            let Some(worst) = missed.iter().max_by(|a, b| a.1.total_cmp(&b.1)) else { continue };
            let at = 0.5 * (worst.0[0] + worst.0[1]);
            let ends = match self.among {
                Among::All => {
                    let mut ends = flanks(seen, |t| told.miss(self, f, segment, t) > HIDDEN);
                    if ends.len() > MOST_ENDS {
                        ends.drain(1..ends.len() - 1);
                    }
                    ends.push(at);
                    ends
                }
                Among::PathConstraints => {
                    // The shortest that miss something enclose the feature; those they came from begin far away.
                    let shortest = missed.iter().map(|m| m.0[1] - m.0[0]).fold(f64::INFINITY, f64::min);
                    let close = missed.iter().filter(|m| m.0[1] - m.0[0] <= 4.0 * shortest);
                    let (first, last) =
                        close.fold((at, at), |(first, last), m| (first.min(m.0[0]), last.max(m.0[1])));
                    vec![first, at, last]
                }
            };
            times.extend(ends.into_iter().filter(|t| *t > nodes[0] && *t < nodes[nodes.len() - 1]));
        }
    }

    /// Says whether something may be hidden between the ends of a short time.
    fn may_hide(&self, f: &mut Function<'_>, segment: usize, [a, b]: Interval) -> bool {
        let n = f.function.inputs();
        let step = (b - a) / (SAMPLES - 1) as f64;
        for (k, z) in f.samples.chunks_exact_mut(n).enumerate() {
            self.inputs(segment, a + k as f64 * step, z);
        }
        for (i, (value, slope)) in f.values.iter_mut().zip(&mut f.slopes).enumerate() {
            let at = |k: usize| f.samples[k * n + i];
            let differences = (1..SAMPLES).map(|k| at(k) - at(k - 1));
            let bends = (2..SAMPLES).map(|k| (at(k) - 2.0 * at(k - 1) + at(k - 2)).abs());
            let bend = bends.fold(0.0, f64::max);
            // Between samples a polynomial leaves their range by an eighth of its second difference or so, its slope by half.
            *value = widened(range((0..SAMPLES).map(at)), 0.25 * bend);
            *slope = widened(range(differences), bend).map(|d| d / step);
        }
        f.expansion.set_to(Derivatives::Slopes, &f.values);
        (f.kinds.iter().zip(&f.sizes).enumerate()).any(|(output, (kind, size))| {
            let value = f.expansion.value(output);
            let least = match kind {
                Kind::Value(_) | Kind::Step => HIDDEN * size,
                Kind::Row(bounds, size) => {
                    let excess = bounds.excess(value[0]).max(bounds.excess(value[1]));
                    let allowed = HIDDEN * size;
                    if excess <= allowed {
                        return false;
                    }
                    allowed
                }
            };
            let slope = f.expansion.gradient(output).iter().zip(&f.slopes).fold([0.0; 2], |sum, (g, v)| {
                let term = product(*g, *v);
                [sum[0] + term[0], sum[1] + term[1]]
            });
            let shows_at_ends = !matches!(kind, Kind::Step) && (slope[0] >= 0.0 || slope[1] <= 0.0);
            let from_chord = 0.25 * (b - a) * (slope[1] - slope[0]);
            // Not known counts as hidden.
            let hidden = if from_chord.is_nan() { f64::INFINITY } else { from_chord };
            !shows_at_ends && hidden.min(value[1] - value[0]) > least
        })
    }
}

/// The ends of the intervals, in increasing order, over which something is missed: with the whole feature between them, and its flanks.
fn flanks(intervals: Vec<Interval>, mut is_missed: impl FnMut(f64) -> bool) -> Vec<f64> {
    let mut ends = Vec::new();
    for [a, b] in intervals {
        match [is_missed(a), is_missed(b)] {
            [true, true] => ends.extend([a, b]),
            [true, false] => ends.extend([a, nearest(b, a, &mut is_missed)]),
            [false, true] => ends.extend([nearest(a, b, &mut is_missed), b]),
            [false, false] => {}
        }
    }
    ends.dedup();
    ends
}

/// The time nearest to one at which something is missed at which nothing is, by bisection from another.
fn nearest(mut seen: f64, mut missed: f64, is_missed: &mut impl FnMut(f64) -> bool) -> f64 {
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (seen + missed);
        *(if is_missed(middle) { &mut missed } else { &mut seen }) = middle;
    }
    seen
}

/// The values of a function that the nodes of a piece tell.
struct Told<'a> {
    nodes: &'a [f64],
    outputs: usize,
    values: Vec<f64>,
}

impl<'a> Told<'a> {
    fn new(search: &Passing<'_>, f: &Function<'_>, segment: usize, nodes: &'a [f64]) -> Self {
        let (mut z, outputs) = (vec![0.0; f.function.inputs()], f.kinds.len());
        let mut values = vec![0.0; nodes.len() * outputs];
        for (t, out) in nodes.iter().zip(values.chunks_exact_mut(outputs)) {
            search.inputs(segment, *t, &mut z);
            f.evaluate(&z, out);
        }
        Self { nodes, outputs, values }
    }

    /// The largest difference at a time, relative to the sizes: of a value from the polynomial through the nodes, of a row from its bounds.
    /// Values that are larger than at any node so far are the sizes from then on.
    fn miss(&self, search: &Passing<'_>, f: &mut Function<'_>, segment: usize, t: f64) -> f64 {
        let (mut z, mut out) = (vec![0.0; f.function.inputs()], vec![0.0; self.outputs]);
        search.inputs(segment, t, &mut z);
        f.evaluate(&z, &mut out);
        let mut told = vec![0.0; self.outputs];
        search.found.state.segments()[segment].basis.evaluate_all(&self.values, self.place(t), &mut told);
        let outputs = out.iter().zip(&told).zip(&f.kinds).zip(&f.sizes);
        let misses = outputs.map(|(((v, told), kind), size)| match kind {
            Kind::Value(_) | Kind::Step => (v - told).abs() / size,
            Kind::Row(bounds, size) => bounds.excess(*v) / size,
        });
        let largest = misses.filter(|m| m.is_finite()).fold(0.0, f64::max);
        f.sizes.iter_mut().zip(&out).for_each(|(size, v)| *size = size.max(v.abs()));
        largest
    }

    /// The place of a time on [-1, 1].
    fn place(&self, t: f64) -> f64 {
        let (first, last) = (self.nodes[0], self.nodes[self.nodes.len() - 1]);
        2.0 * (t - first) / (last - first) - 1.0
    }
}

fn range(values: impl Iterator<Item = f64>) -> Interval {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
}

fn widened([low, high]: Interval, by: f64) -> Interval {
    [low - by, high + by]
}

fn product(a: Interval, b: Interval) -> Interval {
    if a == [0.0; 2] || b == [0.0; 2] {
        return [0.0; 2];
    }
    range([a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]].into_iter())
}
