//! Controls between the values beyond which more of them changes nothing, such as the command to an actuator that saturates.
//!
//! ```text
//! x' = f(x, clamp(u, -1, 1))        has with -1 <= u <= 1 the trajectories and costs that it has with any u
//! ```
//!
//! Beyond the kinks there is no slope, and Newton's method does not find back. Where equations of motion, path constraints and integrals do not
//! depend on a control beyond a kink, but for costs that rise outward, its bounds are put there: every trajectory has one
//! between them of at most its cost. That nothing depends on it is proved by bounds of the formulas over all that the problem allows
//! (interval arithmetic, as in [`Formula::enclosure`]).

use apsides_ad::formula::{Binary, Operation, Unary};
use apsides_ad::{
    AdError, Condition, Derivatives, Expansion, Formula, FormulaBuilder, FormulaKink, Value, formula_node,
};

use crate::rewrite::rewrite;
use crate::{Bounds, Guess, Ocp, Phase};

/// Points at which a guess is taken.
const SAMPLES: usize = 65;

/// The problem with its controls between the values beyond which they have no effect but to cost more, and without the minima, maxima
/// and conditions that are decided there; none where all bounds stay as they are. The new bounds are guards.
#[must_use]
pub fn within_effect(ocp: &Ocp) -> Option<Ocp> {
    let mut within = ocp.clone();
    let mut any = false;
    for k in 0..within.phases.len() {
        // A kink within another one shows once that one is decided.
        while let Some(narrower) = Range::of(&within, k).and_then(Range::narrowed) {
            (within.phases[k], any) = (narrower, true);
        }
    }
    any.then_some(within)
}

/// The guess with the controls of its samples between the bounds of a problem.
#[must_use]
pub fn guess_within(ocp: &Ocp, guess: &Guess) -> Guess {
    let phases = guess.phases.iter().zip(&ocp.phases).map(|(guess, phase)| {
        let mut is_beyond = false;
        let within = guess.with_samples(SAMPLES, |_, _, u| {
            for (u, control) in u.iter_mut().zip(&phase.controls) {
                is_beyond |= control.bounds.excess(*u) > 0.0;
                *u = control.bounds.clamp(*u);
            }
        });
        if is_beyond { within } else { guess.clone() }
    });
    Guess { phases: phases.collect(), ..guess.clone() }
}

/// The functions of a phase over all that it allows.
struct Range<'a> {
    ocp: &'a Ocp,
    phase: usize,
    formulas: Vec<Formula>,
    /// Least and largest values of states, controls, parameters and time.
    inputs: Vec<[f64; 2]>,
}

impl<'a> Range<'a> {
    /// None where a function is no formula, or no control has a kink of its own.
    fn of(ocp: &'a Ocp, phase: usize) -> Option<Self> {
        let posed = &ocp.phases[phase];
        let formulas: Vec<Formula> = posed.functions().map(|f| f.formula()).collect::<Result<_, _>>().ok()?;
        let (start, end) = posed.time_bounds();
        let states = posed.states.iter().map(|s| s.variable.bounds);
        let bounds = states
            .chain(posed.controls.iter().map(|c| c.bounds))
            .chain(ocp.parameters.iter().map(|p| p.bounds))
            .chain([Bounds::new(start.lower, end.upper)]);
        let inputs = bounds.map(|b| [b.lower, b.upper]).collect();
        let range = Self { ocp, phase, formulas, inputs };
        (0..posed.controls.len()).any(|c| !range.kinks(c).is_empty()).then_some(range)
    }

    /// The values at which a control alone switches a function without a jump, ascending.
    fn kinks(&self, control: usize) -> Vec<f64> {
        let input = self.ocp.phases[self.phase].states.len() + control;
        let mut numbers = Vec::new();
        for formula in &self.formulas {
            for kink in formula.kinks() {
                let number = kink.input.filter(|(i, _)| *i == input).map(|(_, number)| number);
                numbers
                    .extend(number.filter(|n| !kink.jumps || self.is_continuous(formula, &kink, input, *n)));
            }
        }
        numbers.sort_by(f64::total_cmp);
        numbers.dedup();
        numbers
    }

    /// True if all that is chosen by a condition has the same value on both sides where the control has the number at which it switches.
    fn is_continuous(&self, formula: &Formula, kink: &FormulaKink, input: usize, number: f64) -> bool {
        let mut inputs = self.inputs.clone();
        inputs[input] = [number; 2];
        let Ok(ranges) = self.ranges(formula, &inputs) else { return false };
        formula.operations().iter().all(|operation| match *operation {
            Operation::Select(value, a, b)
                if kink.condition == (Condition::Number { value, number: 0.0 }) =>
            {
                ranges[a] == ranges[b] && ranges[a][0] == ranges[a][1]
            }
            Operation::Unary(Unary::Sign, value) => {
                kink.condition != (Condition::Number { value, number: 0.0 })
            }
            _ => true,
        })
    }

    /// Bounds of all inputs and operations of a formula.
    fn ranges(&self, formula: &Formula, inputs: &[[f64; 2]]) -> Result<Vec<[f64; 2]>, AdError> {
        let n = formula.inputs();
        let tables = formula.tables().iter().map(|t| (**t).clone()).collect();
        let all = (0..n + formula.operations().len()).collect();
        let of_all = Formula::new(n, formula.operations().to_vec(), tables, all)?;
        Ok(of_all.enclosure(&self.taken(formula, inputs)))
    }

    /// The phase with the bounds of controls where their effect ends; none where all stay as they are.
    fn narrowed(mut self) -> Option<Phase> {
        let mut phase = self.ocp.phases[self.phase].clone();
        let first = phase.states.len();
        let mut moved = false;
        for (c, control) in phase.controls.iter_mut().enumerate() {
            let kinks = self.kinks(c);
            let Bounds { lower, upper } = control.bounds;
            let least =
                kinks.iter().rev().find(|k| **k > lower && **k < upper && self.is_idle(c, [lower, **k]));
            let least = least.copied();
            let above = least.unwrap_or(lower);
            let most = kinks.iter().find(|k| **k > above && **k < upper && self.is_idle(c, [**k, upper]));
            if let Some(least) = least {
                (control.bounds.lower, control.guards[0], moved) = (least, true, true);
            }
            if let Some(most) = most {
                (control.bounds.upper, control.guards[1], moved) = (*most, true, true);
            }
            self.inputs[first + c] = [control.bounds.lower, control.bounds.upper];
        }
        (moved && self.decide(&mut phase).is_ok()).then_some(phase)
    }

    /// True if nothing depends on a control in an open interval on one side of a kink, but for costs that rise away from the kink.
    fn is_idle(&self, control: usize, [least, most]: [f64; 2]) -> bool {
        let phase = &self.ocp.phases[self.phase];
        let input = phase.states.len() + control;
        let mut inputs = self.inputs.clone();
        let is_above = most == inputs[input][1];
        inputs[input] = if is_above { [least.next_up(), most] } else { [least, most.next_down()] };
        let integrals = self.formulas.len() - phase.integrals.len();
        let slopes = self.formulas.iter().map(|formula| {
            let mut expansion = Expansion::new(formula.clone());
            expansion.set_to(Derivatives::Slopes, &self.taken(formula, &inputs));
            let depends = |output: usize| expansion.inputs_of(output).contains(&input);
            let of =
                |output: usize| if depends(output) { expansion.gradient(output)[input] } else { [0.0; 2] };
            (0..formula.outputs().len()).map(of).collect::<Vec<_>>()
        });
        slopes.enumerate().all(|(k, slopes)| {
            let cost = k.checked_sub(integrals).and_then(|q| {
                let limits = phase.integrals[q].variable.bounds;
                let objective = &self.ocp.objective;
                let weight = objective.sense.sign() * objective.integral_weight(self.phase, q);
                (limits.lower.is_infinite() && limits.upper.is_infinite()).then_some(weight)
            });
            slopes.iter().all(|slope| match cost {
                _ if *slope == [0.0; 2] => true,
                Some(0.0) => true,
                Some(weight) if (weight > 0.0) == is_above => slope[0] >= 0.0,
                Some(_) => slope[1] <= 0.0,
                None => false,
            })
        })
    }

    /// Those of the inputs that a formula takes.
    fn taken(&self, formula: &Formula, inputs: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let parameters = self.ocp.parameters.len();
        let mut taken = inputs.to_vec();
        if formula.inputs() < taken.len() {
            let time = taken.len() - 1;
            taken.drain(time - parameters..time);
        }
        taken
    }

    /// Writes the functions of a phase without the minima, maxima and conditions that are decided between its bounds.
    fn decide(&self, phase: &mut Phase) -> Result<(), AdError> {
        let mut functions = Vec::new();
        for formula in &self.formulas {
            functions.push(formula_node(self.decided(formula)?));
        }
        let mut functions = functions.into_iter();
        phase.dynamics = functions.next().unwrap_or_else(|| phase.dynamics.clone());
        let path = phase.path.iter_mut().map(|c| &mut c.function);
        for (old, new) in path.chain(phase.integrals.iter_mut().map(|i| &mut i.function)).zip(functions) {
            *old = new;
        }
        Ok(())
    }

    fn decided(&self, formula: &Formula) -> Result<Formula, AdError> {
        let ranges = self.ranges(formula, &self.inputs)?;
        let mut builder = FormulaBuilder::new(formula.inputs());
        let values = rewrite(formula, &mut builder, FormulaBuilder::input, |_, place, values| {
            let (a, b, is_min) = match formula.operations()[place] {
                Operation::Select(c, a, _) if ranges[c][0] >= 0.0 => return Some(values[a]),
                Operation::Select(c, _, b) if ranges[c][1] < 0.0 => return Some(values[b]),
                Operation::Binary(Binary::Min, a, b) => (a, b, true),
                Operation::Binary(Binary::Max, a, b) => (a, b, false),
                _ => return None,
            };
            let is_below = |a: usize, b: usize| ranges[a][1] <= ranges[b][0];
            match (is_below(a, b), is_below(b, a)) {
                (true, _) => Some(values[if is_min { a } else { b }]),
                (_, true) => Some(values[if is_min { b } else { a }]),
                _ => None,
            }
        });
        let outputs: Vec<Value> = formula.outputs().iter().map(|k| values[*k]).collect();
        builder.formula(&outputs)
    }
}

#[cfg(test)]
mod tests {
    use apsides_ad::{Dynamics, PathFunction, Scalar};

    use super::*;
    use crate::{At, State, Variable};

    /// A cart pushed by an actuator that saturates at `-1` and at `2`, by the formula `how`.
    struct Cart {
        by_conditions: bool,
        leak: f64,
    }

    impl Dynamics<2, 1> for Cart {
        fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
            let (least, most) = (S::from(-1.0), S::from(2.0));
            let push = if self.by_conditions {
                let below_most = (most - u[0]).select(u[0], most);
                (u[0] - least).select(below_most, least)
            } else {
                u[0].max(least).min(most)
            };
            [x[1], push + u[0] * self.leak]
        }
    }

    struct Effort(f64);

    impl PathFunction<2, 1, 1> for Effort {
        fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
            [(u[0] - self.0).square()]
        }
    }

    fn cart(cart: Cart, dearest: Option<f64>) -> Ocp {
        let phase = Phase::new("push", cart)
            .states([
                State::new("x", "m").starts_at(0.0).ends_at(1.0),
                State::new("v", "m/s").starts_at(0.0).ends_at(0.0),
            ])
            .controls([Variable::new("u", "m/s2").at_most(7.0)])
            .final_time(Bounds::new(0.1, 10.0))
            .integral(Variable::new("j", "-"), Effort(dearest.unwrap_or(0.0)));
        let builder = Ocp::builder("cart").phase(phase);
        let builder = match dearest {
            Some(_) => builder.minimize_integral("push", "j"),
            None => builder.minimize("time", "s", At::FinalTime("push")),
        };
        builder.build().unwrap()
    }

    fn bounds(ocp: &Ocp) -> Option<(Bounds, [bool; 2])> {
        let within = within_effect(ocp)?;
        assert!(within_effect(&within).is_none());
        let formula = within.phases[0].dynamics.formula().unwrap();
        assert!(formula.kinks().is_empty(), "{:?}", formula.kinks());
        let u = &within.phases[0].controls[0];
        Some((u.bounds, u.guards))
    }

    #[test]
    fn a_saturating_actuator_takes_commands_up_to_its_limits() {
        for by_conditions in [false, true] {
            let found = bounds(&cart(Cart { by_conditions, leak: 0.0 }, None));
            assert_eq!(found, Some((Bounds::new(-1.0, 2.0), [true; 2])), "{by_conditions}");
        }
    }

    #[test]
    fn what_costs_less_beyond_the_limit_is_allowed() {
        let sides = |dearest| bounds(&cart(Cart { by_conditions: false, leak: 0.0 }, Some(dearest)));
        assert_eq!(sides(0.0), Some((Bounds::new(-1.0, 2.0), [true; 2])));
        let within = within_effect(&cart(Cart { by_conditions: false, leak: 0.0 }, Some(3.0))).unwrap();
        assert_eq!(within.phases[0].controls[0].bounds, Bounds::new(-1.0, 7.0));
    }

    #[test]
    fn what_has_an_effect_beyond_the_limit_is_allowed() {
        assert!(within_effect(&cart(Cart { by_conditions: false, leak: 0.01 }, None)).is_none());
    }
}
