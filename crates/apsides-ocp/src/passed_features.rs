//! Features of states that a trajectory passes between its nodes: thin layers, walls and wells, which neither the points of a method nor the
//! steps of a re-simulation would see.
//!
//! Bounds of the formulas and of their slopes over the box of a short time ([`Expansion`]) tell what its ends cannot hide. Where they may hide
//! more, the time is halved, until nothing is hidden or a value in the middle is far from what the nodes tell. What depends on time alone is
//! the subject of [`explicit_time`](crate::explicit_time). Functions without a formula tell nothing.

use apsides_ad::{Derivatives, Expansion, NodeFunction};

use crate::{Bounds, Guess, Ocp, OcpError, Phase, PhaseScaling, PhaseTrajectory, Scaling, Trajectory};

/// Part of the size of a value that may stay hidden, and that the nodes may miss.
const HIDDEN: f64 = 1e-3;
/// Intervals that are looked at in a phase, at most, for each function: beyond, what is hidden stays hidden.
const MOST_LOOKS: usize = 4000;
/// Halvings of the interval between two nodes, at most.
const MOST_HALVINGS: usize = 30;
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
    /// Its values at the nodes.
    Value,
    /// The bounds of a path constraint, and their size.
    Row(Bounds, f64),
}

/// One function of the phase.
struct Function<'a> {
    function: &'a dyn NodeFunction,
    expansion: Expansion,
    kinds: Vec<Kind>,
    /// Largest magnitude of each output at the nodes.
    sizes: Vec<f64>,
    /// Work space: the inputs at the samples of a time, one after the other, and the intervals of their values and slopes.
    samples: Vec<f64>,
    values: Vec<Interval>,
    slopes: Vec<Interval>,
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
        let values = |f: &dyn NodeFunction| (0..f.outputs()).map(|_| Kind::Value).collect::<Vec<_>>();
        let mut scales = self.scaling.path.iter();
        let rows = phase.path.iter().map(move |c| {
            let kinds = c.rows.iter().zip(scales.by_ref()).map(|(row, scale)| {
                let finite = |b: f64| if b.is_finite() { b.abs() } else { 0.0 };
                let bound = finite(row.bounds.lower).max(finite(row.bounds.upper));
                Kind::Row(row.bounds, if bound > 0.0 { bound } else { *scale })
            });
            (c.function.as_ref(), kinds.collect::<Vec<_>>())
        });
        let integrands = phase.integrals.iter().map(|q| q.function.as_ref());
        let others = std::iter::once(phase.dynamics.as_ref()).chain(integrands).map(|f| (f, values(f)));
        others
            .filter(|_| self.among == Among::All)
            .chain(rows)
            .filter_map(|(function, kinds)| {
                let formula = function.formula().ok()?;
                let is_linear = function.pattern().hessian.is_empty() && formula.kinks().is_empty();
                let sizes = self.sizes(function);
                let n = function.inputs();
                (!is_linear).then(|| Function {
                    function,
                    expansion: Expansion::new(formula),
                    kinds,
                    sizes,
                    samples: vec![0.0; SAMPLES * n],
                    values: vec![[0.0; 2]; n],
                    slopes: vec![[0.0; 2]; n],
                })
            })
            .collect()
    }

    fn sizes(&self, function: &dyn NodeFunction) -> Vec<f64> {
        let (mut z, mut out) = (vec![0.0; function.inputs()], vec![0.0; function.outputs()]);
        let mut sizes = out.clone();
        for (t, segment) in self.found.nodes() {
            self.inputs(segment, t, &mut z);
            function.value(&z, &mut out);
            sizes.iter_mut().zip(&out).for_each(|(size, v)| *size = size.max(v.abs()));
        }
        sizes
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
        let told = Told::new(self, f.function, segment, &nodes);
        for w in nodes.windows(2) {
            let mut left = vec![([w[0], w[1]], 0)];
            let mut missed: Vec<(Interval, f64)> = Vec::new();
            while let Some(([a, b], halvings)) = left.pop() {
                let middle = 0.5 * (a + b);
                if *looks >= MOST_LOOKS || halvings > MOST_HALVINGS || middle <= a || middle >= b {
                    continue;
                }
                *looks += 1;
                if !self.may_hide(f, segment, [a, b]) {
                    continue;
                }
                let miss = told.miss(self, f, segment, middle);
                if miss > HIDDEN {
                    missed.push(([a, b], miss));
                }
                left.extend([([middle, b], halvings + 1), ([a, middle], halvings + 1)]);
            }
            let Some(worst) = missed.iter().max_by(|a, b| a.1.total_cmp(&b.1)) else { continue };
            let at = 0.5 * (worst.0[0] + worst.0[1]);
            // The shortest that miss something enclose the feature; those they came from begin far away.
            let shortest = missed.iter().map(|m| m.0[1] - m.0[0]).fold(f64::INFINITY, f64::min);
            let close = missed.iter().filter(|m| m.0[1] - m.0[0] <= 4.0 * shortest);
            let (first, last) =
                close.fold((at, at), |(first, last), m| (first.min(m.0[0]), last.max(m.0[1])));
            times.extend(
                [first, at, last].into_iter().filter(|t| *t > nodes[0] && *t < nodes[nodes.len() - 1]),
            );
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
                Kind::Value => HIDDEN * size,
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
            let is_monotone = slope[0] >= 0.0 || slope[1] <= 0.0;
            let from_chord = 0.25 * (b - a) * (slope[1] - slope[0]);
            // Not known counts as hidden.
            let hidden = if from_chord.is_nan() { f64::INFINITY } else { from_chord };
            !is_monotone && hidden.min(value[1] - value[0]) > least
        })
    }
}

/// The values of a function that the nodes of a piece tell.
struct Told<'a> {
    nodes: &'a [f64],
    outputs: usize,
    values: Vec<f64>,
}

impl<'a> Told<'a> {
    fn new(search: &Passing<'_>, function: &dyn NodeFunction, segment: usize, nodes: &'a [f64]) -> Self {
        let (mut z, outputs) = (vec![0.0; function.inputs()], function.outputs());
        let mut values = vec![0.0; nodes.len() * outputs];
        for (t, out) in nodes.iter().zip(values.chunks_exact_mut(outputs)) {
            search.inputs(segment, *t, &mut z);
            function.value(&z, out);
        }
        Self { nodes, outputs, values }
    }

    /// The largest difference at a time, relative to the sizes: of a value from the polynomial through the nodes, of a row from its bounds.
    fn miss(&self, search: &Passing<'_>, f: &Function<'_>, segment: usize, t: f64) -> f64 {
        let (mut z, mut out) = (vec![0.0; f.function.inputs()], vec![0.0; self.outputs]);
        search.inputs(segment, t, &mut z);
        f.function.value(&z, &mut out);
        let mut told = vec![0.0; self.outputs];
        search.found.state.segments()[segment].basis.evaluate_all(&self.values, self.place(t), &mut told);
        let outputs = out.iter().zip(&told).zip(&f.kinds).zip(&f.sizes);
        let misses = outputs.map(|(((v, told), kind), size)| match kind {
            Kind::Value if *size > 0.0 => (v - told).abs() / size,
            Kind::Value => 0.0,
            Kind::Row(bounds, size) => bounds.excess(*v) / size,
        });
        misses.filter(|m| m.is_finite()).fold(0.0, f64::max)
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
