//! Typical sizes of every quantity, from stated scales, else bounds, else the guess.

use crate::{Guess, Ocp, Phase, Variable};

/// Scales of one phase.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseScaling {
    /// Per state.
    pub states: Vec<f64>,
    /// Per control.
    pub controls: Vec<f64>,
    /// Time.
    pub time: f64,
}

/// Scales of a problem: a quantity divided by its scale is of the order of one.
#[derive(Clone, Debug, PartialEq)]
pub struct Scaling {
    /// Per phase.
    pub phases: Vec<PhaseScaling>,
    /// Per static parameter.
    pub parameters: Vec<f64>,
    /// Objective, where its scale is stated.
    pub objective: Option<f64>,
}

/// Points at which the guess is looked at for quantities without bounds.
const SAMPLES: usize = 11;

impl Scaling {
    /// Scales of a problem with a guess that fits it (see [`Guess::check`]).
    #[must_use]
    pub fn new(ocp: &Ocp, guess: &Guess) -> Self {
        let phases = ocp
            .phases
            .iter()
            .zip(&guess.phases)
            .map(|(phase, g)| {
                let (mut x, mut u) = (vec![0.0; phase.states.len()], vec![0.0; phase.controls.len()]);
                let (mut largest_x, mut largest_u) = (x.clone(), u.clone());
                for k in 0..SAMPLES {
                    let fraction = k as f64 / (SAMPLES - 1) as f64;
                    g.state(fraction, &mut x);
                    g.control(fraction, &mut u);
                    enlarge(&mut largest_x, &x);
                    enlarge(&mut largest_u, &u);
                }
                PhaseScaling {
                    states: (phase.states.iter().map(|s| &s.variable))
                        .zip(&largest_x)
                        .map(|(v, &g)| size(v, g))
                        .collect(),
                    controls: phase.controls.iter().zip(&largest_u).map(|(v, &g)| size(v, g)).collect(),
                    time: time_size(phase, g.final_time - g.initial_time),
                }
            })
            .collect();
        let parameters = ocp.parameters.iter().zip(&guess.parameters).map(|(v, &g)| size(v, g.abs()));
        Self { phases, parameters: parameters.collect(), objective: ocp.objective.scale }
    }
}

fn enlarge(largest: &mut [f64], values: &[f64]) {
    for (l, v) in largest.iter_mut().zip(values) {
        *l = l.max(v.abs());
    }
}

/// Stated scale, else width of the bounds, else the guess; one if all are zero or infinite.
fn size(variable: &Variable, guess: f64) -> f64 {
    let width = variable.bounds.upper - variable.bounds.lower;
    let usable = |s: &f64| *s > 0.0 && s.is_finite();
    variable.scale.or(Some(width).filter(usable)).or(Some(guess).filter(usable)).unwrap_or(1.0)
}

/// The guess, or what the bounds allow where that is less.
fn time_size(phase: &Phase, guess: f64) -> f64 {
    let longest = (phase.final_time.upper - phase.initial_time.lower).min(phase.duration.upper);
    if longest > 0.0 { longest.min(guess) } else { guess }
}
