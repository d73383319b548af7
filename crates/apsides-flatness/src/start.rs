//! Where a solve starts: splines, times and parameters, from a guess or from an earlier solve.

use apsides_ocp::{Bounds, Guess, Ocp, Scaling};

use crate::grid::Grid;
use crate::layout::Layout;
use crate::station::Station;
use crate::{FlatSystem, FlatnessError};

/// Passes of the interpolation; each reduces what a spline of moderate order misses by about a half.
const PASSES: usize = 40;

/// Points of the fit to the states, per coefficient.
const FIT_POINTS: usize = 2;
/// Most steps of that fit.
const FIT_STEPS: usize = 5;
/// Weight of states that are fixed at an end.
const END_WEIGHT: f64 = 30.0;
/// Share of the largest diagonal entry that is added to the diagonal: coefficients that no state depends on stay.
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
    /// Splines through the outputs of a guess at the Greville abscissae.
    ///
    /// The coefficients begin as the outputs themselves, which keeps straight lines straight, and are corrected by what the spline
    /// misses: the collocation matrix is totally positive with eigenvalues in (0, 1], so that this converges.
    pub(crate) fn from_guess(
        ocp: &Ocp,
        systems: &[FlatSystem],
        grids: &[Grid],
        guess: &Guess,
    ) -> Result<Self, FlatnessError> {
        let mut coefficients = Vec::with_capacity(grids.len());
        for (k, (phase, grid)) in ocp.phases.iter().zip(grids).enumerate() {
            let (system, g) = (&systems[k], &guess.phases[k]);
            let (mut x, mut u) = (vec![0.0; phase.states.len()], vec![0.0; phase.controls.len()]);
            let mut y = vec![0.0; system.outputs];
            let mut curves = Vec::with_capacity(system.outputs);
            for (i, basis) in grid.bases.iter().enumerate() {
                let named =
                    |source| FlatnessError::Basis { place: format!("phase `{}`", phase.name), source };
                let abscissae = basis.greville().map_err(named)?;
                let targets: Vec<f64> = abscissae
                    .iter()
                    .map(|&s| {
                        g.state(s, &mut x);
                        g.control(s, &mut u);
                        let t = (1.0 - s) * g.initial_time + s * g.final_time;
                        system.outputs_at(t, &x, &u, &guess.parameters, &mut y);
                        y[i]
                    })
                    .collect();
                let mut c = targets.clone();
                for _ in 0..PASSES {
                    let missed: Vec<f64> = abscissae
                        .iter()
                        .zip(&targets)
                        .map(|(s, target)| {
                            let mut value = [0.0];
                            basis.evaluate(&c, 0, *s, &mut value);
                            target - value[0]
                        })
                        .collect();
                    c.iter_mut().zip(missed).for_each(|(c, m)| *c += m);
                }
                curves.push(c);
            }
            coefficients.push(curves);
        }
        let times = guess.phases.iter().map(|g| (g.initial_time, g.final_time)).collect();
        Ok(Self { coefficients, times, parameters: guess.parameters.clone() })
    }

    /// Moves the splines so that the states of the flat map, rates of the outputs among them, are close to those of the guess:
    /// least squares, each state relative to its scale, by the method of Gauss and Newton.
    ///
    /// A guess by straight lines is no trajectory. What the outputs alone would miss are the velocities.
    pub(crate) fn fit_states(
        &mut self,
        ocp: &Ocp,
        systems: &[FlatSystem],
        grids: &[Grid],
        guess: &Guess,
        scaling: &Scaling,
    ) {
        let layout = Layout::new(ocp, grids);
        for (k, (phase, grid)) in ocp.phases.iter().zip(grids).enumerate() {
            let count = FIT_POINTS * grid.bases.iter().map(apsides_basis::Bspline::len).max().unwrap_or(1);
            let fractions = (0..=count).map(|j| j as f64 / count as f64);
            let mut stations: Vec<Station> =
                fractions.map(|f| Station::new(&systems[k], grid, &layout, k, f)).collect();
            let mut targets = Vec::with_capacity(stations.len());
            for s in &stations {
                let mut x = vec![0.0; phase.states.len()];
                guess.phases[k].state(s.fraction, &mut x);
                let mut weights: Vec<f64> = scaling.phases[k].states.iter().map(|s| s.recip()).collect();
                for ((x, w), state) in x.iter_mut().zip(&mut weights).zip(&phase.states) {
                    let stated = match s.fraction {
                        0.0 => state.initial,
                        1.0 => state.terminal,
                        _ => Bounds::FREE,
                    };
                    if stated.is_fixed() {
                        (*x, *w) = (stated.lower, *w * END_WEIGHT);
                    }
                }
                targets.push((x, weights));
            }
            let first = layout.phases[k].outputs[0];
            let n: usize = layout.phases[k].lengths.iter().sum();
            let mut best = f64::INFINITY;
            for _ in 0..FIT_STEPS {
                let x = self.vector(&layout);
                let (sum, matrix, gradient) = normal_equations(&mut stations, &targets, &x, first, n);
                if !(sum < best) {
                    break;
                }
                best = sum;
                let Some(step) = cholesky_solve(matrix, gradient) else { break };
                let before = self.coefficients[k].clone();
                let moved = self.coefficients[k].iter_mut().flatten().zip(&step);
                moved.for_each(|(c, d)| *c -= d);
                let after = self.vector(&layout);
                let (next, ..) = normal_equations(&mut stations, &targets, &after, first, n);
                if !(next < best) {
                    self.coefficients[k] = before;
                    break;
                }
            }
        }
    }

    /// The unknowns in the order of the layout.
    pub(crate) fn vector(&self, layout: &Layout) -> Vec<f64> {
        let mut x = vec![0.0; layout.variables];
        for ((p, curves), times) in layout.phases.iter().zip(&self.coefficients).zip(&self.times) {
            for (&first, c) in p.outputs.iter().zip(curves) {
                x[first..first + c.len()].copy_from_slice(c);
            }
            for (time, value) in [(p.initial_time, times.0), (p.final_time, times.1)] {
                if let Some(c) = time.column() {
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
                scales[first..first + c.len()].fill(if scale > 0.0 && scale.is_finite() { scale } else { 1.0 });
            }
            for c in [p.initial_time, p.final_time].into_iter().filter_map(crate::layout::Time::column) {
                scales[c] = s.time;
            }
        }
        scales[layout.first_parameter..].copy_from_slice(&scaling.parameters);
        scales
    }
}

/// Sum of squares of `weight (state - target)`, its matrix `J'J` (row-major) and `J'` times the misses, for `n` columns from `first`.
fn normal_equations(
    stations: &mut [Station],
    targets: &[(Vec<f64>, Vec<f64>)],
    x: &[f64],
    first: usize,
    n: usize,
) -> (f64, Vec<f64>, Vec<f64>) {
    let (mut sum, mut matrix, mut gradient) = (0.0, vec![0.0; n * n], vec![0.0; n]);
    for (station, (target, weights)) in stations.iter_mut().zip(targets) {
        station.set_derivatives(x);
        for (q, (target, w)) in target.iter().zip(weights).enumerate() {
            let miss = w * (station.values[q] - target);
            sum += miss * miss;
            let own = |(c, _): &(usize, f64)| (first..first + n).contains(c);
            for (i, a) in station.gradient(q).filter(own) {
                gradient[i - first] += w * a * miss;
                for (j, b) in station.gradient(q).filter(own) {
                    matrix[(i - first) * n + j - first] += w * w * a * b;
                }
            }
        }
    }
    let largest = (0..n).map(|i| matrix[i * n + i]).fold(0.0, f64::max);
    (0..n).for_each(|i| matrix[i * n + i] += RIDGE * largest);
    (sum, matrix, gradient)
}

/// Solves a symmetric system; none where the matrix is not positive definite.
fn cholesky_solve(mut a: Vec<f64>, mut b: Vec<f64>) -> Option<Vec<f64>> {
    let n = b.len();
    for j in 0..n {
        for i in j..n {
            let sum: f64 = (0..j).map(|k| a[i * n + k] * a[j * n + k]).sum();
            let rest = a[i * n + j] - sum;
            if i > j {
                a[i * n + j] = rest / a[j * n + j];
            } else if rest > 0.0 {
                a[j * n + j] = rest.sqrt();
            } else {
                return None;
            }
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
    Some(b)
}
