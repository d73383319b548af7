//! Typical sizes of every quantity, from stated scales, else bounds, else the guess.
//!
//! Bounds that are far apart beside what is known of a quantity, from its fixed ends and the guess, are there to keep it from going astray
//! and say nothing of its size ([`Variable::size_within_bounds`]).

use apsides_ad::NodeFunction;

use crate::{Bounds, EndpointInput, Guess, Ocp, Phase, PhaseGuess, Variable, linkage};

/// Scales of one phase.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseScaling {
    /// Per state.
    pub states: Vec<f64>,
    /// Per control.
    pub controls: Vec<f64>,
    /// Time.
    pub time: f64,
    /// Per row of the path constraints.
    pub path: Vec<f64>,
    /// Per integral.
    pub integrals: Vec<f64>,
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

/// A guess below is rounding and says nothing of a size.
const ROUNDING: f64 = 1e-12;

/// A scale this many times a size is coarse.
const COARSE: f64 = 1e3;

/// A guess below this part of the largest of a quantity with the same unit, or of what its rates move a state by, is rounding, too.
const NOTHING_BESIDE: f64 = 1e-9;

/// A scale below this part of that of the linked state is rounding, too.
const NOTHING_BESIDE_SOURCE: f64 = 1e-6;

impl Scaling {
    /// Scales of a problem with a guess that fits it (see [`Guess::check`]).
    #[must_use]
    pub fn new(ocp: &Ocp, guess: &Guess) -> Self {
        let parameters = ocp.parameters.iter().zip(&guess.parameters).map(|(v, &g)| size(v, g.abs()));
        let parameters: Vec<f64> = parameters.collect();
        let phases: Vec<PhaseScaling> = ocp
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
                for (largest, state) in largest_x.iter_mut().zip(&phase.states) {
                    for end in [state.initial, state.terminal].into_iter().filter(Bounds::is_fixed) {
                        *largest = largest.max(end.lower.abs());
                    }
                }
                let states: Vec<&Variable> = phase.states.iter().map(|s| &s.variable).collect();
                let controls: Vec<&Variable> = phase.controls.iter().collect();
                let scaling = PhaseScaling {
                    states: sizes(&states, &largest_x),
                    controls: sizes(&controls, &largest_u),
                    time: time_size(phase, g.final_time - g.initial_time),
                    path: Vec::new(),
                    integrals: Vec::new(),
                };
                let of_parameters = (&guess.parameters[..], &parameters[..]);
                scaling.without_rest(phase, g, of_parameters, &largest_x).with_functions(
                    phase,
                    g,
                    of_parameters,
                )
            })
            .collect();
        Self { phases, parameters, objective: ocp.objective.scale }.with_links(ocp)
    }

    /// A state that is almost nothing in a phase, beside what it is in the one that it comes from, has the scale that it has there.
    fn with_links(mut self, ocp: &Ocp) -> Self {
        if ocp.phases.len() == 1 {
            return self;
        }
        for (k, sources) in linkage::sources(ocp).into_iter().enumerate() {
            for (state, source) in sources.into_iter().enumerate() {
                let Some(source) = source else { continue };
                let before = self.phases[source.phase].states[source.state];
                let scale = &mut self.phases[k].states[state];
                let is_stated = ocp.phases[k].states[state].variable.scale.is_some();
                if !is_stated && *scale < NOTHING_BESIDE_SOURCE * before {
                    *scale = before;
                }
            }
        }
        self
    }

    /// The scale of a quantity at an end of a phase, or of a static parameter.
    #[must_use]
    pub fn of_end(&self, input: EndpointInput) -> f64 {
        match input {
            EndpointInput::InitialTime { phase } | EndpointInput::FinalTime { phase } => {
                self.phases[phase].time
            }
            EndpointInput::InitialState { phase, state } | EndpointInput::FinalState { phase, state } => {
                self.phases[phase].states[state]
            }
            EndpointInput::Parameter { index } => self.parameters[index],
        }
    }

    /// True if quantities between two bounds are much smaller by `other`, which knows more of them.
    #[must_use]
    pub fn is_coarse_beside(&self, ocp: &Ocp, other: &Self) -> bool {
        let is_coarse = |(variable, own, other): (&Variable, &f64, &f64)| {
            variable.scale.is_none() && variable.size_within_bounds(0.0).is_some() && *own > COARSE * other
        };
        let coarse = |variables: Vec<&Variable>, own: &[f64], other: &[f64]| {
            variables.into_iter().zip(own).zip(other).any(|((v, a), b)| is_coarse((v, a, b)))
        };
        let mut phases = ocp.phases.iter().zip(&self.phases).zip(&other.phases);
        phases.any(|((phase, a), b)| {
            let states = phase.states.iter().map(|s| &s.variable).collect();
            let integrals = phase.integrals.iter().map(|i| &i.variable).collect();
            coarse(states, &a.states, &b.states)
                || coarse(phase.controls.iter().collect(), &a.controls, &b.controls)
                || coarse(integrals, &a.integrals, &b.integrals)
        }) || coarse(ocp.parameters.iter().collect(), &self.parameters, &other.parameters)
    }
}

impl PhaseScaling {
    /// Without the scales that are rounding of a state at rest: those from a guess that moves far less than the state does when every input
    /// of its rate moves by its scale.
    fn without_rest(
        mut self,
        phase: &Phase,
        guess: &PhaseGuess,
        parameters: (&[f64], &[f64]),
        largest: &[f64],
    ) -> Self {
        if !self.states.iter().zip(largest).any(|(scale, found)| *found > 0.0 && scale == found) {
            return self;
        }
        let rates = self.changes(phase, phase.dynamics.as_ref(), guess, parameters);
        let states = self.states.iter_mut().zip(&phase.states);
        for (((scale, state), rate), &found) in states.zip(rates).zip(largest) {
            if found > 0.0 && *scale == found && found < NOTHING_BESIDE * rate * self.time {
                *scale = size(&state.variable, 0.0);
            }
        }
        self
    }

    /// Adds the scales of path constraints and integrals: stated, else from the bounds, else what the functions change by along the
    /// guess when every input moves by its scale. No value of the constraint itself enters: it is to vanish where the bound is zero.
    fn with_functions(self, phase: &Phase, guess: &PhaseGuess, parameters: (&[f64], &[f64])) -> Self {
        let change = |function: &dyn NodeFunction| self.changes(phase, function, guess, parameters);
        let mut path = Vec::new();
        for c in &phase.path {
            let changes = change(c.function.as_ref());
            path.extend(c.rows.iter().zip(changes).map(|(row, change)| row_size(row, change)));
        }
        let integrals = phase.integrals.iter().map(|q| {
            let rate = change(q.function.as_ref()).into_iter().fold(0.0, f64::max);
            row_size(&q.variable, rate * self.time)
        });
        let integrals = integrals.collect();
        Self { path, integrals, ..self }
    }

    /// The largest change of each output along the guess when every input moves by its scale.
    fn changes(
        &self,
        phase: &Phase,
        function: &dyn NodeFunction,
        guess: &PhaseGuess,
        (parameters, scales): (&[f64], &[f64]),
    ) -> Vec<f64> {
        let (nx, nu) = (phase.states.len(), phase.controls.len());
        let mut z = vec![0.0; function.inputs()];
        let mut size = vec![0.0; function.inputs()];
        let time = z.len() - 1;
        size[..nx].copy_from_slice(&self.states);
        size[nx..nx + nu].copy_from_slice(&self.controls);
        if phase.takes_parameters(function) {
            z[nx + nu..time].copy_from_slice(parameters);
            size[nx + nu..time].copy_from_slice(scales);
        }
        size[time] = self.time;
        let mut values = vec![0.0; function.outputs()];
        let mut entries = vec![0.0; function.pattern().jacobian_len()];
        let mut largest = vec![0.0_f64; function.outputs()];
        for k in 0..SAMPLES {
            let fraction = k as f64 / (SAMPLES - 1) as f64;
            guess.state(fraction, &mut z[..nx]);
            guess.control(fraction, &mut z[nx..nx + nu]);
            z[time] = (1.0 - fraction) * guess.initial_time + fraction * guess.final_time;
            function.jacobian(&z, &mut values, &mut entries);
            let mut change = vec![0.0; largest.len()];
            for ((row, column), v) in function.pattern().jacobian_entries().zip(&entries) {
                change[row] += v.abs() * size[column];
            }
            enlarge(&mut largest, &change);
        }
        largest
    }
}

fn enlarge(largest: &mut [f64], values: &[f64]) {
    for (l, v) in largest.iter_mut().zip(values) {
        *l = l.max(v.abs());
    }
}

/// The size of each, where guesses that are rounding beside others count as zero, and a quantity of which nothing is known has the largest
/// size with its unit, if it has one: what starts and ends in a plane of motion may leave it as far as the motion in it goes.
fn sizes(variables: &[&Variable], guesses: &[f64]) -> Vec<f64> {
    let pairs = || variables.iter().zip(guesses);
    let largest = |unit: &str| pairs().filter(|(v, _)| v.unit == unit).map(|(_, g)| *g).fold(0.0, f64::max);
    let beside = |v: &Variable, g: f64| if g < NOTHING_BESIDE * largest(&v.unit) { 0.0 } else { g };
    let known: Vec<Option<f64>> = pairs().map(|(v, &g)| known_size(v, beside(v, g))).collect();
    let with_unit = |unit: &str| {
        let same = variables.iter().zip(&known).filter(|(v, _)| v.unit == unit && !is_number(unit));
        same.filter_map(|(_, size)| *size).reduce(f64::max)
    };
    let size = |(v, size): (&&Variable, &Option<f64>)| size.or_else(|| with_unit(&v.unit)).unwrap_or(1.0);
    variables.iter().zip(&known).map(size).collect()
}

/// True for the units of plain numbers, which need not be of one kind.
fn is_number(unit: &str) -> bool {
    ["", "-", "1"].contains(&unit)
}

/// The [`known_size`]; one if there is none.
fn size(variable: &Variable, guess: f64) -> f64 {
    known_size(variable, guess).unwrap_or(1.0)
}

/// Stated scale, else that from two bounds, else the guess, else the only bound; none if all are zero or infinite.
fn known_size(variable: &Variable, guess: f64) -> Option<f64> {
    let usable = |s: &f64| *s > ROUNDING && s.is_finite();
    let within = variable.size_within_bounds(guess);
    variable.scale.or(within).or(Some(guess).filter(usable)).or(variable.size())
}

/// Stated scale, else that from the bounds, else the larger finite bound, else the given change; one if all are zero or infinite.
fn row_size(row: &Variable, change: f64) -> f64 {
    let usable = |s: &f64| *s > 0.0 && s.is_finite();
    let within = row.size_within_bounds(change);
    row.scale.or(within).or(row.size()).or(Some(change).filter(usable)).unwrap_or(1.0)
}

/// The guess, or what the bounds allow where that is less.
fn time_size(phase: &Phase, guess: f64) -> f64 {
    let longest = phase.longest();
    if longest > 0.0 { longest.min(guess) } else { guess }
}
