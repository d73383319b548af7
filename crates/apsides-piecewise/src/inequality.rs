//! Inequalities along the phases: what they are, how far they are missed, and the problem with their integrals instead.

use std::sync::Arc;

use apsides_ocp::{Bounds, Guess, Integral, Ocp, Phase, Scaling, Trajectory, Variable};

use crate::smoothing::{SmoothedRow, Subject};

/// Places per segment at which constraints are looked at, ends included.
const PLACES: usize = 25;

/// An inequality of a phase.
pub(crate) struct Inequality {
    pub(crate) phase: usize,
    name: String,
    subject: Subject,
    bounds: Bounds,
    scale: f64,
}

/// The largest violation along a trajectory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Excess {
    /// Relative to the scale of the constraint; 0 if all hold.
    pub amount: f64,
    /// Phase and constraint.
    pub place: String,
    /// The time at which it is exceeded most.
    pub time: f64,
}

/// Path constraints that are no equalities, and bounds on states along the phase.
pub(crate) fn inequalities(ocp: &Ocp, guess: &Guess) -> Vec<Inequality> {
    let scaling = Scaling::new(ocp, guess);
    let mut all = Vec::new();
    for (index, phase) in ocp.phases.iter().enumerate() {
        let base = phase.states.len() + phase.controls.len();
        let states = phase.states.iter().enumerate().zip(&scaling.phases[index].states);
        for ((k, state), &scale) in states.filter(|((_, s), _)| s.variable.bounds != Bounds::FREE) {
            let subject = Subject::State { index: k, base };
            let (name, bounds) = (state.variable.name.clone(), state.variable.bounds);
            all.push(Inequality { phase: index, name, subject, bounds, scale });
        }
        for c in &phase.path {
            for (output, row) in c.rows.iter().enumerate().filter(|(_, r)| is_inequality(r)) {
                let subject = Subject::Row { function: Arc::clone(&c.function), output };
                let scale = row.size().unwrap_or_else(|| size_along(phase, &subject, guess, index));
                let (name, bounds) = (row.name.clone(), row.bounds);
                all.push(Inequality { phase: index, name, subject, bounds, scale });
            }
        }
    }
    all
}

fn is_inequality(row: &Variable) -> bool {
    !row.bounds.is_fixed() && row.bounds != Bounds::FREE
}

/// Largest value along the guess, one where that is no size.
fn size_along(phase: &Phase, subject: &Subject, guess: &Guess, index: usize) -> f64 {
    let mut point = Point::new(phase, &guess.parameters);
    let g = &guess.phases[index];
    let largest = (0..PLACES).fold(0.0_f64, |largest, k| {
        let fraction = k as f64 / (PLACES - 1) as f64;
        g.state(fraction, &mut point.x);
        g.control(fraction, &mut point.u);
        let time = (1.0 - fraction) * g.initial_time + fraction * g.final_time;
        largest.max(point.value(subject, time).abs())
    });
    if largest > 0.0 && largest.is_finite() { largest } else { 1.0 }
}

/// A place of a phase, and storage for functions there.
struct Point<'a> {
    phase: &'a Phase,
    parameters: &'a [f64],
    x: Vec<f64>,
    u: Vec<f64>,
    z: Vec<f64>,
    values: Vec<f64>,
}

impl<'a> Point<'a> {
    fn new(phase: &'a Phase, parameters: &'a [f64]) -> Self {
        Self {
            x: vec![0.0; phase.states.len()],
            u: vec![0.0; phase.controls.len()],
            z: Vec::new(),
            values: vec![0.0; phase.path.iter().map(|c| c.rows.len()).max().unwrap_or(0)],
            phase,
            parameters,
        }
    }

    fn value(&mut self, subject: &Subject, time: f64) -> f64 {
        self.z.clear();
        self.z.extend_from_slice(&self.x);
        self.z.extend_from_slice(&self.u);
        let values = match subject {
            Subject::State { .. } => &mut [][..],
            Subject::Row { function, .. } => {
                if self.phase.takes_parameters(function.as_ref()) {
                    self.z.extend_from_slice(self.parameters);
                }
                &mut self.values[..function.outputs()]
            }
        };
        self.z.push(time);
        subject.value(&self.z, values)
    }
}

/// The largest violation along a trajectory, at 25 places of each segment.
pub(crate) fn excess(ocp: &Ocp, inequalities: &[Inequality], trajectory: &Trajectory) -> Excess {
    let mut worst = Excess::default();
    for (index, (phase, t)) in ocp.phases.iter().zip(&trajectory.phases).enumerate() {
        let mut point = Point::new(phase, &trajectory.parameters);
        for (k, ends) in t.control.breaks().windows(2).enumerate() {
            for place in 0..PLACES {
                let time = ends[0] + (ends[1] - ends[0]) * place as f64 / (PLACES - 1) as f64;
                t.state.evaluate_in(k, time, &mut point.x);
                t.control.evaluate_in(k, time, &mut point.u);
                for i in inequalities.iter().filter(|i| i.phase == index) {
                    let amount = i.bounds.excess(point.value(&i.subject, time)) / i.scale;
                    if amount > worst.amount || amount.is_nan() {
                        let place = format!("phase `{}`, `{}`", phase.name, i.name);
                        worst = Excess { amount, place, time };
                    }
                }
            }
        }
    }
    worst
}

/// The problem with `int L_eps dt <= tau` in place of each inequality along its phase, after the integrals of the problem; `tau` is
/// relative to `eps` times the duration of the guess.
pub(crate) fn transcribed(
    ocp: &Ocp,
    inequalities: &[Inequality],
    guess: &Guess,
    epsilon: f64,
    tau: f64,
) -> Ocp {
    let scaling = Scaling::new(ocp, guess);
    let mut smooth = ocp.clone();
    for (phase, scaling) in smooth.phases.iter_mut().zip(&scaling.phases) {
        for (state, scale) in phase.states.iter_mut().zip(&scaling.states) {
            let along = std::mem::take(&mut state.variable.bounds);
            state.initial = along.intersect(&state.initial);
            state.terminal = along.intersect(&state.terminal);
            state.variable.scale = Some(*scale);
        }
        phase.path.retain(|c| !c.rows.iter().all(is_inequality));
        let rows = phase.path.iter_mut().flat_map(|c| &mut c.rows);
        rows.filter(|r| is_inequality(r)).for_each(|r| r.bounds = Bounds::FREE);
    }
    for i in inequalities {
        let size = epsilon * scaling.phases[i.phase].time;
        let name = format!("violation of {}", i.name);
        let variable = Variable::new(name, smooth.phases[i.phase].time_unit.clone());
        let function = SmoothedRow::new(i.subject.clone(), i.bounds, i.scale, epsilon);
        smooth.phases[i.phase].integrals.push(Integral {
            variable: variable.at_most(tau * size).scaled_by(size),
            function: Arc::new(function),
        });
    }
    smooth
}
