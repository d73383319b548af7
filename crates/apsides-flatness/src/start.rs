//! Where a solve starts: splines, times and parameters, from a guess or from an earlier solve.

use apsides_ocp::{Bounds, Guess, Ocp, Phase, PhaseGuess, Scaling};

use crate::curve::PhaseSplines;
use crate::flat_point::FlatPoint;
use crate::layout::Layout;
use crate::spline_mesh::SplineMesh;
use crate::{FlatSystem, FlatnessError};

/// Passes of the interpolation; each reduces what a spline of moderate order misses by about a half.
const PASSES: usize = 40;

/// Points of the fit, per coefficient of an output.
const FIT_POINTS: usize = 2;
/// Most steps of the fit, those that are refused included.
const FIT_STEPS: usize = 25;
/// Relative fall of the sum of squares below which the fit ends.
const LEAST_GAIN: f64 = 3e-3;
/// Damping of the first step, and the one at which no step is left to try.
const FIRST_DAMPING: f64 = 1e-6;
const LAST_DAMPING: f64 = 1e6;
/// Weights of what is known exactly, states fixed at an end and residuals, against states of the guess, one after the other.
const EXACT_WEIGHTS: [f64; 3] = [1.0, 10.0, 100.0];
/// Weight of the highest derivatives on normalised time.
const SMOOTHNESS: f64 = 1e-2;
/// Weight of the times of the guess.
const TIME_WEIGHT: f64 = 0.1;
/// Share of the largest diagonal entry that is added to the diagonal: coefficients that nothing depends on stay.
const RIDGE: f64 = 1e-12;

/// Values of all unknowns.
#[derive(Clone, Debug)]
pub(crate) struct Start {
    /// Per phase and output.
    pub(crate) coefficients: Vec<Vec<Vec<f64>>>,
    /// Start and end time per phase.
    pub(crate) times: Vec<(f64, f64)>,
    /// Static parameters.
    pub(crate) parameters: Vec<f64>,
}

impl Start {
    /// Splines through the outputs of a guess.
    pub(crate) fn from_guess(
        ocp: &Ocp,
        systems: &[FlatSystem],
        meshes: &[SplineMesh],
        guess: &Guess,
    ) -> Result<Self, FlatnessError> {
        let times = guess.phases.iter().map(|g| (g.initial_time, g.final_time)).collect();
        let coefficients = through(ocp, systems, meshes, |k, fraction, y| {
            let (phase, g) = (&ocp.phases[k], &guess.phases[k]);
            let (mut x, mut u) = (vec![0.0; phase.states.len()], vec![0.0; phase.controls.len()]);
            g.state(fraction, &mut x);
            g.control(fraction, &mut u);
            let t = (1.0 - fraction) * g.initial_time + fraction * g.final_time;
            systems[k].outputs_at(t, &x, &u, &guess.parameters, y);
        })?;
        Ok(Self { coefficients, times, parameters: guess.parameters.clone() })
    }

    /// The same on other splines.
    pub(crate) fn on(
        &self,
        ocp: &Ocp,
        systems: &[FlatSystem],
        meshes: &[SplineMesh],
        curves: &[PhaseSplines],
    ) -> Result<Self, FlatnessError> {
        let coefficients = through(ocp, systems, meshes, |k, fraction, y| {
            for ((basis, c), y) in curves[k].bases.iter().zip(&curves[k].coefficients).zip(y) {
                basis.evaluate(c, 0, fraction, std::slice::from_mut(y));
            }
        })?;
        Ok(Self { coefficients, times: self.times.clone(), parameters: self.parameters.clone() })
    }

    /// Moves splines and free times so that the states of the flat map, rates of the outputs among them, are close to those of the
    /// guess, its residuals small all along the phase, and the outputs smooth: least squares, by the method of Levenberg and
    /// Marquardt.
    ///
    /// A guess by straight lines is no trajectory, and far from the residuals the interior-point method often loses its way.
    pub(crate) fn fit(
        &mut self,
        ocp: &Ocp,
        systems: &[FlatSystem],
        meshes: &[SplineMesh],
        guess: &Guess,
        scaling: &Scaling,
    ) {
        let layout = Layout::new(ocp, meshes);
        let mut x = self.vector(&layout);
        let sizes = self.scales(&layout, scaling);
        for (k, mesh) in meshes.iter().enumerate() {
            let p = &layout.phases[k];
            let count = FIT_POINTS * p.lengths.iter().max().unwrap_or(&1);
            let fractions = (0..=count).map(|j| j as f64 / count as f64);
            let mut fit = Fit {
                flat_points: fractions.map(|f| FlatPoint::new(&systems[k], mesh, &layout, k, f)).collect(),
                targets: Vec::new(),
                inputs: Vec::new(),
                exact_weight: 1.0,
                first: p.outputs[0],
                lengths: &p.lengths,
                coefficients: p.lengths.iter().sum(),
                times: p.own_times().collect(),
                guess: x.clone(),
                sizes: &sizes,
            };
            fit.aim(&ocp.phases[k], &guess.phases[k], &scaling.phases[k].states, &x);
            fit.smooth(&systems[k], guess.phases[k].final_time - guess.phases[k].initial_time);
            // What is known exactly comes into force little by little: ends may bend the outputs a long way.
            for weight in EXACT_WEIGHTS {
                fit.exact_weight = weight;
                fit.solve(&mut x);
            }
        }
        *self = Self::from_vector(&layout, &x);
    }

    /// The unknowns in the order of the layout.
    pub(crate) fn vector(&self, layout: &Layout) -> Vec<f64> {
        let mut x = vec![0.0; layout.variables];
        for ((p, curves), times) in layout.phases.iter().zip(&self.coefficients).zip(&self.times) {
            for (&first, c) in p.outputs.iter().zip(curves) {
                x[first..first + c.len()].copy_from_slice(c);
            }
            for (time, value) in [(p.initial_time, times.0), (p.final_time, times.1)] {
                if let Some(c) = time.column()
                    && p.own_times().any(|own| own == c)
                {
                    x[c] = value;
                }
            }
        }
        x[layout.first_parameter..].copy_from_slice(&self.parameters);
        x
    }

    /// From a vector in the order of the layout.
    pub(crate) fn from_vector(layout: &Layout, x: &[f64]) -> Self {
        let curves = layout.phases.iter().map(|p| {
            p.outputs.iter().zip(&p.lengths).map(|(&first, n)| x[first..first + n].to_vec()).collect()
        });
        Self {
            coefficients: curves.collect(),
            times: layout.phases.iter().map(|p| (p.initial_time.value(x), p.final_time.value(x))).collect(),
            parameters: x[layout.first_parameter..].to_vec(),
        }
    }

    /// Typical sizes of the unknowns: of coefficients the range of their output, else its size.
    pub(crate) fn scales(&self, layout: &Layout, scaling: &Scaling) -> Vec<f64> {
        let mut scales = vec![1.0; layout.variables];
        for ((p, curves), s) in layout.phases.iter().zip(&self.coefficients).zip(&scaling.phases) {
            for (&first, c) in p.outputs.iter().zip(curves) {
                let (least, most) =
                    c.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
                let size = least.abs().max(most.abs());
                let range = most - least;
                let scale = if range > 1e-6 * size { range } else { size };
                scales[first..first + c.len()].fill(if scale > 0.0 && scale.is_finite() {
                    scale
                } else {
                    1.0
                });
            }
            for c in p.own_times() {
                scales[c] = s.time;
            }
        }
        scales[layout.first_parameter..].copy_from_slice(&scaling.parameters);
        scales
    }
}

/// Splines through `outputs(phase, fraction, y)` at their Greville abscissae.
///
/// The coefficients begin as the outputs themselves, which keeps straight lines straight, and are corrected by what the spline
/// misses: the collocation matrix is totally positive with eigenvalues in (0, 1], so that this converges.
fn through(
    ocp: &Ocp,
    systems: &[FlatSystem],
    meshes: &[SplineMesh],
    outputs: impl Fn(usize, f64, &mut [f64]),
) -> Result<Vec<Vec<Vec<f64>>>, FlatnessError> {
    let mut coefficients = Vec::with_capacity(meshes.len());
    for (k, (phase, mesh)) in ocp.phases.iter().zip(meshes).enumerate() {
        let mut y = vec![0.0; systems[k].outputs];
        let mut curves = Vec::with_capacity(y.len());
        for (i, basis) in mesh.bases.iter().enumerate() {
            let named = |source| FlatnessError::Basis { place: format!("phase `{}`", phase.name), source };
            let abscissae = basis.greville().map_err(named)?;
            let mut target = |s: &f64| {
                outputs(k, *s, &mut y);
                y[i]
            };
            let targets: Vec<f64> = abscissae.iter().map(&mut target).collect();
            // One row of the collocation matrix per abscissa: what is not zero, from a first function on.
            let width = basis.order();
            let mut matrix = vec![0.0; abscissae.len() * width];
            let rows = abscissae.iter().zip(matrix.chunks_mut(width));
            let firsts: Vec<usize> = rows.map(|(s, row)| basis.values(*s, row)).collect();
            let mut c = targets.clone();
            let mut missed = targets.clone();
            for _ in 0..PASSES {
                for ((m, target), (row, first)) in
                    missed.iter_mut().zip(&targets).zip(matrix.chunks(width).zip(&firsts))
                {
                    let value: f64 = row.iter().zip(&c[*first..]).map(|(b, c)| b * c).sum();
                    *m = target - value;
                }
                c.iter_mut().zip(&missed).for_each(|(c, m)| *c += m);
            }
            curves.push(c);
        }
        coefficients.push(curves);
    }
    Ok(coefficients)
}

/// A least-squares problem for the unknowns of one phase.
struct Fit<'a> {
    flat_points: Vec<FlatPoint>,
    /// Per point: wanted value of each state, then of each residual.
    targets: Vec<Vec<Target>>,
    /// Inputs of the flat map that shall be small, and their weights.
    inputs: Vec<(usize, f64)>,
    /// Weight of what is known exactly, states fixed at an end and residuals, against states of the guess.
    exact_weight: f64,
    first: usize,
    /// Coefficients of each output, and of all.
    lengths: &'a [usize],
    coefficients: usize,
    times: Vec<usize>,
    guess: Vec<f64>,
    sizes: &'a [f64],
}

/// The value that a quantity shall have.
struct Target {
    quantity: usize,
    value: f64,
    weight: f64,
    exact: bool,
}

impl Target {
    /// The distance from that value, and the factor of its derivatives.
    fn miss(&self, flat_point: &FlatPoint, exact_weight: f64) -> (f64, f64) {
        let weight = if self.exact { self.weight * exact_weight } else { self.weight };
        (weight * (flat_point.values[self.quantity] - self.value), weight)
    }
}

impl Fit<'_> {
    /// Number of unknowns.
    fn unknowns(&self) -> usize {
        self.coefficients + self.times.len()
    }

    /// Column of an unknown: coefficients, which stand together, then the phase's own times.
    fn column(&self, unknown: usize) -> usize {
        match unknown.checked_sub(self.coefficients) {
            Some(time) => self.times[time],
            None => self.first + unknown,
        }
    }

    /// Sets the targets: states of the guess, or what is fixed at an end, and residuals of zero relative to their change.
    fn aim(&mut self, phase: &Phase, guess: &PhaseGuess, scales: &[f64], x: &[f64]) {
        for flat_point in &mut self.flat_points {
            flat_point.set_derivatives(x);
            let mut wanted = vec![0.0; phase.states.len()];
            guess.state(flat_point.fraction, &mut wanted);
            let mut targets = Vec::with_capacity(wanted.len() + flat_point.quantities.residuals);
            for (q, (state, (value, scale))) in phase.states.iter().zip(wanted.iter().zip(scales)).enumerate()
            {
                let stated = match flat_point.fraction {
                    0.0 => state.initial,
                    1.0 => state.terminal,
                    _ => Bounds::FREE,
                };
                let exact = stated.is_fixed();
                let value = if exact { stated.lower } else { *value };
                targets.push(Target { quantity: q, value, weight: scale.recip(), exact });
            }
            for k in 0..flat_point.quantities.residuals {
                let quantity = flat_point.quantities.residual(k);
                let changes = flat_point.gradient(quantity).map(|(c, v)| (v * self.sizes[c]).abs());
                let size = changes.fold(flat_point.values[quantity].abs(), f64::max);
                let weight = if size > 0.0 && size.is_finite() { size.recip() } else { 0.0 };
                targets.push(Target { quantity, value: 0.0, weight, exact: true });
            }
            self.targets.push(targets);
        }
    }

    /// Wants a small highest derivative of each output.
    fn smooth(&mut self, system: &FlatSystem, duration: f64) {
        let mut first = self.first;
        for (i, &d) in system.highest.iter().enumerate() {
            let weight = SMOOTHNESS * duration.powi(d as i32) / self.sizes[first];
            self.inputs.push((i * system.jet_rows + d, weight));
            first += self.lengths[i];
        }
    }

    /// Steps of Levenberg and Marquardt (D. Marquardt, *J. SIAM* 11 (1963) 431, doi 10.1137/0111030).
    fn solve(&mut self, x: &mut [f64]) {
        let n = self.unknowns();
        let mut best = self.sum(x);
        let mut damping = FIRST_DAMPING;
        let mut normal = (vec![0.0; n * n], vec![0.0; n]);
        self.normal_equations(x, &mut normal);
        let (mut matrix, mut step, mut trial) = (vec![0.0; n * n], vec![0.0; n], x.to_vec());
        for _ in 0..FIT_STEPS {
            matrix.copy_from_slice(&normal.0);
            (0..n).for_each(|i| matrix[i * n + i] *= 1.0 + damping);
            step.copy_from_slice(&normal.1);
            if !cholesky_solve(&mut matrix, &mut step) {
                return;
            }
            trial.copy_from_slice(x);
            for (k, d) in step.iter().enumerate() {
                let column = self.column(k);
                trial[column] -= d * self.sizes[column];
            }
            let sum = self.sum(&trial);
            if sum < best {
                let gain = (best - sum) / best;
                best = sum;
                x.copy_from_slice(&trial);
                if gain < LEAST_GAIN {
                    return;
                }
                self.normal_equations(x, &mut normal);
                damping *= 0.1;
            } else {
                damping *= 10.0;
                if damping > LAST_DAMPING {
                    return;
                }
            }
        }
    }

    /// Relative changes of the times, which count as a state of its scale at every point of a few.
    fn time_changes(&self, x: &[f64]) -> impl Iterator<Item = f64> {
        let change = |c: &usize| TIME_WEIGHT * (x[*c] - self.guess[*c]) / self.sizes[*c];
        self.times.iter().map(change).collect::<Vec<_>>().into_iter()
    }

    fn sum(&mut self, x: &[f64]) -> f64 {
        let mut sum: f64 = self.time_changes(x).map(|c| c * c).sum();
        for (flat_point, targets) in self.flat_points.iter_mut().zip(&self.targets) {
            flat_point.set_values(x);
            sum += targets.iter().map(|t| t.miss(flat_point, self.exact_weight).0.powi(2)).sum::<f64>();
            sum += self.inputs.iter().map(|&(k, w)| (w * flat_point.input(k).0).powi(2)).sum::<f64>();
        }
        sum
    }

    /// Lower triangle of `J'J` (row-major) and `J'` times the misses, in unknowns relative to their size.
    fn normal_equations(&mut self, x: &[f64], (matrix, gradient): &mut (Vec<f64>, Vec<f64>)) {
        let n = self.unknowns();
        matrix.fill(0.0);
        gradient.fill(0.0);
        for (k, change) in self.time_changes(x).enumerate() {
            let i = self.coefficients + k;
            gradient[i] += TIME_WEIGHT * change;
            matrix[i * n + i] += TIME_WEIGHT * TIME_WEIGHT;
        }
        let &mut Self { exact_weight, sizes, .. } = self;
        let mut unknowns = vec![None; x.len()];
        (0..n).for_each(|k| unknowns[self.column(k)] = Some(k));
        let relative = |weight: f64, (c, v): (usize, f64)| unknowns[c].map(|k| (k, weight * v * sizes[c]));
        let mut row = Vec::new();
        let mut add = |row: &[(usize, f64)], miss: f64| {
            // The lower triangle is all that the factorisation reads. Columns ascend along a row.
            for (k, &(i, a)) in row.iter().enumerate() {
                gradient[i] += a * miss;
                let line = &mut matrix[i * n..=i * n + i];
                for &(j, b) in &row[..=k] {
                    line[j] += a * b;
                }
            }
        };
        for (flat_point, targets) in self.flat_points.iter_mut().zip(&self.targets) {
            flat_point.set_derivatives(x);
            let flat_point = &*flat_point;
            for t in targets {
                let (miss, weight) = t.miss(flat_point, exact_weight);
                row.clear();
                row.extend(flat_point.gradient(t.quantity).filter_map(|e| relative(weight, e)));
                add(&row, miss);
            }
            for &(k, weight) in &self.inputs {
                let (value, slopes) = flat_point.input(k);
                row.clear();
                row.extend(slopes.filter_map(|e| relative(weight, e)));
                add(&row, weight * value);
            }
        }
        let largest = (0..n).map(|i| matrix[i * n + i]).fold(0.0, f64::max);
        (0..n).for_each(|i| matrix[i * n + i] += RIDGE * largest);
    }
}

/// Solves a symmetric system in place; false where the matrix is not positive definite.
fn cholesky_solve(a: &mut [f64], b: &mut [f64]) -> bool {
    let n = b.len();
    // What each column takes from those after it, at once: contiguous along the rows.
    let mut column = vec![0.0; n];
    for j in 0..n {
        let pivot = a[j * n + j];
        if pivot.is_nan() || pivot <= 0.0 {
            return false;
        }
        let root = pivot.sqrt();
        a[j * n + j] = root;
        for i in j + 1..n {
            let (done, rest) = a[i * n..=i * n + i].split_at_mut(j + 1);
            let entry = done[j] / root;
            (done[j], column[i]) = (entry, entry);
            rest.iter_mut().zip(&column[j + 1..]).for_each(|(r, c)| *r -= entry * c);
        }
    }
    for i in 0..n {
        let sum: f64 = (0..i).map(|k| a[i * n + k] * b[k]).sum();
        b[i] = (b[i] - sum) / a[i * n + i];
    }
    for i in (0..n).rev() {
        let sum: f64 = (i + 1..n).map(|k| a[k * n + i] * b[k]).sum();
        b[i] = (b[i] - sum) / a[i * n + i];
    }
    true
}
