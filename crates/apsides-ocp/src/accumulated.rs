//! Integrals that boundary conditions or functions of the objective take: each is a state of its phase.
//!
//! ```text
//! dq/dt = g(t, x, u, p),   q = 0 at the start,   the integral of g over the phase = q at the end
//! ```
//!
//! Both problems have the same controls, states and costs, so that an answer to one, and whatever is proved of it, is one to the other
//! (L. Cesari, Optimization - Theory and Applications, Springer 1983, section 1.9). The costate of `q` is constant: the derivative of
//! the end terms by the integral. [`OcpBuilder::build`](crate::OcpBuilder::build) adds the states, after those of the model.

use std::sync::Arc;

use apsides_ad::formula::Operation;
use apsides_ad::{AdError, Formula, NodeFunction, Table, formula_node};

use crate::{Guess, Ocp, OcpError, Phase, PhaseGuess, State, Variable};

impl Phase {
    /// Says that an integral is going to be a state.
    pub(crate) fn accumulate(&mut self, integral: usize) {
        if !self.accumulated.contains(&integral) {
            self.accumulated.push(integral);
        }
    }

    /// The index of the state that an accumulated integral is going to be.
    pub(crate) fn state_to_be(&self, integral: usize) -> usize {
        self.states.len() + self.accumulated.iter().take_while(|q| **q != integral).count()
    }

    /// The number of states of the model itself.
    #[must_use]
    pub fn model_states(&self) -> usize {
        self.states.len() - self.accumulated.len()
    }

    /// The rates of the integrals that are states, at states of the model, controls, static parameters and a time.
    #[must_use]
    pub fn integral_rates(
        &self,
        states: &[f64],
        controls: &[f64],
        parameters: &[f64],
        time: f64,
    ) -> Vec<f64> {
        let taken = if self.takes_parameters(self.dynamics.as_ref()) { parameters } else { &[] };
        let mut z = states.to_vec();
        z.resize(self.states.len(), 0.0);
        z.extend_from_slice(controls);
        z.extend_from_slice(taken);
        z.push(time);
        let mut rates = vec![0.0; self.states.len()];
        self.dynamics.value(&z, &mut rates);
        rates.split_off(self.model_states())
    }

    /// The phase with its accumulated integrals as states.
    pub(crate) fn with_accumulated_states(mut self) -> Result<Self, OcpError> {
        if self.accumulated.is_empty() {
            return Ok(self);
        }
        let wide = Widening::of(&self);
        let integrand = |q: &usize| &self.integrals[*q];
        let rates: Vec<_> = std::iter::once((self.dynamics.as_ref(), "its equations of motion"))
            .chain(self.accumulated.iter().map(integrand).map(|q| (q.function.as_ref(), "an integrand")))
            .collect();
        let dynamics = wide.joined(&self, &rates)?;
        let widened = |f: &Arc<dyn NodeFunction>, what| wide.joined(&self, &[(f.as_ref(), what)]);
        let path: Vec<_> =
            self.path.iter().map(|c| widened(&c.function, "a path constraint")).collect::<Result<_, _>>()?;
        let integrals: Vec<_> =
            self.integrals.iter().map(|q| widened(&q.function, "an integrand")).collect::<Result<_, _>>()?;
        let states: Vec<State> =
            self.accumulated.iter().map(|q| self.state_of(&self.integrals[*q].variable)).collect();
        self.dynamics = dynamics;
        self.path.iter_mut().zip(path).for_each(|(c, f)| c.function = f);
        self.integrals.iter_mut().zip(integrals).for_each(|(q, f)| q.function = f);
        self.states.extend(states);
        Ok(self)
    }

    /// The state that an integral is. Its bounds, which are those of its end alone, stay with the integral.
    fn state_of(&self, integral: &Variable) -> State {
        let name = match self.state_index(&integral.name) {
            Some(_) => format!("integral of {}", integral.name),
            None => integral.name.clone(),
        };
        let variable = Variable { scale: integral.scale, ..Variable::new(name, integral.unit.clone()) };
        State { variable, ..State::new("", "") }.starts_at(0.0)
    }
}

/// The sizes of a phase before and after states are added.
struct Widening {
    states: usize,
    controls: usize,
    added: usize,
}

impl Widening {
    fn of(phase: &Phase) -> Self {
        Self { states: phase.states.len(), controls: phase.controls.len(), added: phase.accumulated.len() }
    }

    /// The outputs of functions with inputs `[x, u, p, t]`, one after the other, as a function of `[x, q, u, p, t]`.
    fn joined(
        &self,
        phase: &Phase,
        functions: &[(&dyn NodeFunction, &str)],
    ) -> Result<Arc<dyn NodeFunction>, OcpError> {
        let named = &phase.integrals[phase.accumulated[0]].variable.name;
        let fail = |what: &str, reason: String| OcpError::Contradiction {
            place: format!("phase `{}`, integral `{named}`", phase.name),
            reason: format!(
                "a condition on ends, or a function of the objective, makes it a state, for which {what} must be a formula: {reason}"
            ),
        };
        let mut formulas = Vec::new();
        for (function, what) in functions {
            formulas.push(function.formula().map_err(|e| fail(what, e.to_string()))?);
        }
        self.join(&formulas).map(formula_node).map_err(|e| fail(functions[0].1, e.to_string()))
    }

    fn join(&self, formulas: &[Formula]) -> Result<Formula, AdError> {
        let base = self.states + self.controls + 1;
        let most = formulas.iter().map(Formula::inputs).max().unwrap_or(base);
        let inputs = most + self.added;
        let (mut operations, mut outputs): (Vec<Operation>, Vec<usize>) = (Vec::new(), Vec::new());
        let mut tables: Vec<Table> = Vec::new();
        for formula in formulas {
            let (own, first, first_table) = (formula.inputs(), inputs + operations.len(), tables.len());
            let value = |v: usize| match v {
                v if v >= own => first + v - own,
                v if v + 1 == own => inputs - 1,
                v if v < self.states => v,
                v => v + self.added,
            };
            operations
                .extend(formula.operations().iter().map(|o| o.with_operands(value, |t| first_table + t)));
            outputs.extend(formula.outputs().iter().map(|v| value(*v)));
            tables.extend(formula.tables().iter().map(|t| (**t).clone()));
        }
        Formula::new(inputs, operations, tables, outputs)
    }
}

/// Intervals of a guess along which integrals are summed, at least.
const INTERVALS: usize = 64;

impl Guess {
    /// The guess with the values of integrals that are states of their phases, which no user has to guess; an earlier trajectory has them.
    #[must_use]
    pub fn with_accumulated(mut self, ocp: &Ocp) -> Self {
        for (phase, guess) in ocp.phases.iter().zip(&mut self.phases) {
            let (states, controls) = guess.widths();
            let fits = self.parameters.len() == ocp.parameters.len()
                && [phase.model_states(), phase.states.len()].contains(&states)
                && controls == phase.controls.len();
            if fits && !phase.accumulated.is_empty() && guess.as_trajectory().is_none() {
                *guess = accumulated(phase, guess, &self.parameters);
            }
        }
        self
    }
}

/// Sums the integrands by Simpson's rule between the samples.
fn accumulated(phase: &Phase, guess: &PhaseGuess, parameters: &[f64]) -> PhaseGuess {
    let (model, controls) = (phase.model_states(), phase.controls.len());
    let duration = guess.final_time - guess.initial_time;
    let (mut q, mut before) = (vec![0.0; phase.accumulated.len()], None);
    guess.refined(INTERVALS, model, controls, |fraction, x| {
        let rates = |fraction: f64| {
            let (mut x, mut u) = (vec![0.0; model], vec![0.0; controls]);
            guess.state(fraction, &mut x);
            guess.control(fraction, &mut u);
            phase.integral_rates(&x, &u, parameters, guess.initial_time + fraction * duration)
        };
        let here = rates(fraction);
        if let Some((place, there)) = &before {
            let place: f64 = *place;
            let there: &Vec<f64> = there;
            let between = rates(0.5 * (place + fraction));
            let step = (fraction - place) * duration / 6.0;
            for (k, q) in q.iter_mut().enumerate() {
                let share = step * (there[k] + 4.0 * between[k] + here[k]);
                // A guess at which an integrand has no value still is one.
                *q += if share.is_finite() { share } else { 0.0 };
            }
        }
        x.extend_from_slice(&q);
        before = Some((fraction, here));
    })
}
