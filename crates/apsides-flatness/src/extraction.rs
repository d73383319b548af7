//! From splines to a trajectory: states and controls as piecewise polynomials that follow the flat map to rounding.
//!
//! Between two breaks the states are smooth functions of the splines, though no polynomials. They are interpolated at Radau
//! points; a piece is halved while the interpolant misses the map by more than [`INTERPOLATION`].

use std::sync::Arc;

use apsides_basis::{Barycentric, Lgr};
use apsides_ocp::{PhaseMesh, PhaseTrajectory, PiecewisePolynomial, Segment};

use crate::curve::{Curve, PhaseSplines};
use crate::{FlatSystem, FlatnessError};

/// Largest difference between interpolant and map, relative to the largest value of the quantity in the phase.
const INTERPOLATION: f64 = 1e-12;
/// Radau points of a piece.
const POINTS: usize = 12;
/// Halvings of a segment at most.
const DEPTH: usize = 8;
/// Halving must reduce the error to this part, else rounding is seen, or a kink.
const GAIN: f64 = 0.25;
/// Points between the nodes at which a piece is checked, on [-1, 1].
const PROBES: [f64; 5] = [-0.97, -0.51, 0.03, 0.55, 0.98];

/// Values of one piece at the nodes.
struct Piece {
    fractions: (f64, f64),
    segment: usize,
    states: Vec<f64>,
    controls: Vec<f64>,
}

struct Sampler<'a> {
    curve: Curve<'a>,
    state_basis: Arc<Barycentric>,
    control_basis: Arc<Barycentric>,
    nx: usize,
    nu: usize,
    /// Largest value of each state and control in the phase.
    sizes: Vec<f64>,
}

impl Sampler<'_> {
    fn piece(&mut self, fractions: (f64, f64), segment: usize) -> Piece {
        let (nx, nu) = (self.nx, self.nu);
        let (mut states, mut controls) = (Vec::new(), Vec::new());
        // The nodes of the states are those of the controls, and the end.
        let inner = self.control_basis.nodes().len();
        for (k, &node) in self.state_basis.nodes().iter().enumerate() {
            let quantities = self.curve.quantities(segment, at(fractions, node));
            states.extend_from_slice(&quantities[..nx]);
            if k < inner {
                controls.extend_from_slice(&quantities[nx..nx + nu]);
            }
        }
        Piece { fractions, segment, states, controls }
    }

    /// Largest relative difference of the interpolants from the map.
    fn error(&mut self, piece: &Piece) -> f64 {
        let (nx, nu) = (self.nx, self.nu);
        let mut found = vec![0.0; nx + nu];
        let mut worst = 0.0_f64;
        for probe in PROBES {
            self.state_basis.evaluate_all(&piece.states, probe, &mut found[..nx]);
            self.control_basis.evaluate_all(&piece.controls, probe, &mut found[nx..]);
            let exact = self.curve.quantities(piece.segment, at(piece.fractions, probe));
            for ((a, b), size) in found.iter().zip(exact).zip(&self.sizes) {
                worst = worst.max((a - b).abs() / size);
            }
        }
        worst
    }

    /// Pieces of one segment, in order.
    fn divide(&mut self, fractions: (f64, f64), segment: usize, pieces: &mut Vec<Piece>) {
        // Pieces that wait, the earliest last, with their depth and the error of what they are a half of.
        let mut waiting = vec![(fractions, 0, f64::INFINITY)];
        while let Some((fractions, depth, above)) = waiting.pop() {
            let piece = self.piece(fractions, segment);
            let error = self.error(&piece);
            if error <= INTERPOLATION || depth == DEPTH || error > GAIN * above {
                pieces.push(piece);
                continue;
            }
            let middle = 0.5 * (fractions.0 + fractions.1);
            waiting.push(((middle, fractions.1), depth + 1, error));
            waiting.push(((fractions.0, middle), depth + 1, error));
        }
    }
}

fn at(fractions: (f64, f64), node: f64) -> f64 {
    // Exact at both ends.
    0.5 * ((1.0 - node) * fractions.0 + (1.0 + node) * fractions.1)
}

/// The trajectory of one phase; `errors` are those of the segments.
pub(crate) fn trajectory(
    name: &str,
    system: &FlatSystem,
    splines: &PhaseSplines,
    times: (f64, f64),
    parameters: &[f64],
    errors: &[f64],
) -> Result<PhaseTrajectory, FlatnessError> {
    let named = |source| FlatnessError::Basis { place: format!("phase `{name}`"), source };
    let rule = Lgr::shared(POINTS).map_err(named)?;
    let mut sampler = Sampler {
        curve: Curve::new(system, splines, times, parameters),
        state_basis: Arc::new(rule.support_basis().clone()),
        control_basis: Arc::new(Barycentric::new(rule.nodes()).map_err(named)?),
        nx: system.states,
        nu: system.controls,
        sizes: vec![0.0; system.states + system.controls],
    };
    let segments: Vec<(f64, f64)> = splines.breaks.windows(2).map(|w| (w[0], w[1])).collect();
    for (k, &fractions) in segments.iter().enumerate() {
        for probe in PROBES {
            let q = sampler.curve.quantities(k, at(fractions, probe));
            sampler.sizes.iter_mut().zip(q).for_each(|(s, v)| *s = s.max(v.abs()));
        }
    }
    sampler.sizes.iter_mut().filter(|s| **s == 0.0).for_each(|s| *s = 1.0);
    let mut pieces = Vec::new();
    for (k, &fractions) in segments.iter().enumerate() {
        sampler.divide(fractions, k, &mut pieces);
    }
    let mut fractions = vec![0.0];
    fractions.extend(pieces.iter().map(|p| p.fractions.1));
    let mesh = PhaseMesh::new(fractions, vec![POINTS; pieces.len()])?;
    let breaks: Vec<f64> = mesh.fractions().iter().map(|f| (1.0 - f) * times.0 + f * times.1).collect();
    let interval_errors = pieces.iter().map(|p| errors.get(p.segment).copied().unwrap_or(f64::NAN));
    let interval_errors = interval_errors.collect();
    let (mut state, mut control) = (Vec::new(), Vec::new());
    for p in pieces {
        state.push(Segment { basis: Arc::clone(&sampler.state_basis), values: p.states });
        control.push(Segment { basis: Arc::clone(&sampler.control_basis), values: p.controls });
    }
    Ok(PhaseTrajectory {
        name: name.into(),
        initial_time: times.0,
        final_time: times.1,
        mesh,
        state: PiecewisePolynomial::new(system.states, breaks.clone(), state)?,
        control: PiecewisePolynomial::new(system.controls, breaks, control)?,
        costate: None,
        path_multipliers: None,
        contacts: Vec::new(),
        integral_multipliers: None,
        interval_errors,
    })
}
