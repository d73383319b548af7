//! A second start, where the first mesh could not be solved from a guess.
//!
//! Far from a solution an objective leads astray: a least time pulls to times that no control can meet, and Newton's method wanders
//! among stationary points of the discretised problem. An easier problem has the same constraints, and asks for the controls and times
//! closest to the guess. Its solution is a start that meets all constraints.

use apsides_ad::{FormulaBuilder, formula_node};
use apsides_ocp::{
    EndpointInput, Guess, Integral, Objective, Ocp, OcpError, PhaseGuess, Scaling, Sense, Trajectory,
    Variable,
};

/// The problem with the mean square distance of its controls from the constant ones in the middle of the guess, in their scales, and the
/// squares of relative changes of final times as objective; none where it has neither.
pub(crate) fn easier(ocp: &Ocp, guess: &Guess) -> Option<Ocp> {
    let scaling = Scaling::new(ocp, guess);
    let mut easier = Ocp { objective: distance(), ..ocp.clone() };
    for (k, (phase, guess)) in easier.phases.iter_mut().zip(&guess.phases).enumerate() {
        let duration = guess.final_time - guess.initial_time;
        let first = phase.states.len();
        let mut middle = vec![0.0; phase.controls.len()];
        guess.control(0.5, &mut middle);
        let mut formula = FormulaBuilder::new(first + middle.len() + 1);
        let mut parts = Vec::new();
        for ((c, middle), scale) in middle.iter().enumerate().zip(&scaling.phases[k].controls) {
            let control = formula.input(first + c);
            parts.push(square_of_change(&mut formula, control, *middle, *scale));
        }
        if let Some(sum) = parts.into_iter().reduce(|a, b| formula.add(a, b)) {
            let variable =
                Variable::new("distance of the controls", phase.time_unit.clone()).scaled_by(duration);
            phase
                .integrals
                .push(Integral { variable, function: formula_node(formula.formula(&[sum]).ok()?) });
            easier.objective.integrals.push((k, phase.integrals.len() - 1, 1.0 / duration));
        }
        if !phase.final_time.is_fixed() {
            let mut formula = FormulaBuilder::new(1);
            let end = formula.input(0);
            let change = square_of_change(&mut formula, end, guess.final_time, duration);
            let function = formula_node(formula.formula(&[change]).ok()?);
            easier.objective.functions.push((vec![EndpointInput::FinalTime { phase: k }], function));
        }
    }
    let has_any = !(easier.objective.integrals.is_empty() && easier.objective.functions.is_empty());
    has_any.then_some(easier)
}

fn square_of_change(
    formula: &mut FormulaBuilder,
    value: apsides_ad::Value,
    from: f64,
    scale: f64,
) -> apsides_ad::Value {
    let (from, weight) = (formula.constant(from), formula.constant(1.0 / scale));
    let change = formula.sub(value, from);
    let change = formula.mul(change, weight);
    formula.square(change)
}

fn distance() -> Objective {
    Objective {
        name: "distance from the guess".into(),
        unit: "-".into(),
        sense: Sense::Minimize,
        linear: Vec::new(),
        integrals: Vec::new(),
        functions: Vec::new(),
        scale: None,
    }
}

/// A guess with the states and controls of a trajectory, and nothing else.
///
/// # Errors
/// [`OcpError::Guess`] when a value is not finite.
pub(crate) fn along(trajectory: &Trajectory) -> Result<Guess, OcpError> {
    let phase = |t: &apsides_ocp::PhaseTrajectory| {
        let mut times: Vec<f64> = t.nodes().map(|(time, _)| time).collect();
        times.dedup_by(|next, before| *next <= *before);
        let states = times.iter().map(|time| t.state_at(*time)).collect();
        let controls = times.iter().map(|time| t.control_at(*time)).collect();
        PhaseGuess::samples(&times, states, controls)
    };
    Ok(Guess {
        phases: trajectory.phases.iter().map(phase).collect::<Result<_, _>>()?,
        parameters: trajectory.parameters.clone(),
        constraint_multipliers: None,
    })
}
