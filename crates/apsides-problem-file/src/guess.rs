//! The start of a solve: what the file states, and straight lines for the rest; a flight where it states nothing and the ends are free.

use apsides_ad::{Formula, Table};
use apsides_expressions::suggestion::suggested_name;
use apsides_expressions::{Dimension, Expression, Quantity, Unit, Value};
use apsides_ocp::{Guess, Ocp, PhaseGuess};

use crate::amounts::Amounts;
use crate::error::ProblemError;
use crate::model::{self, Phase, Profile, Variable};
use crate::pose::{TIME, time_unit};
use crate::program::Program;

/// Points at which a formula of time is taken.
const POINTS: usize = 21;

/// Name of the part of the phase that has passed, from 0 to 1, in formulas of a guess.
const FRACTION: &str = "fraction";

/// The guess of a problem.
pub(crate) fn guess(amounts: &mut Amounts<'_>, tables: &[Table], ocp: &Ocp) -> Result<Guess, ProblemError> {
    let model = amounts.model;
    let mut guess = Guess::linear(ocp);
    for (k, parameter) in model.parameters.iter().enumerate() {
        let role = format!("the guess of parameter `{}`", parameter.name);
        if let Some(stated) = amounts.optional(parameter.guess.as_ref(), &parameter.unit, &role)? {
            guess.parameters[k] = stated;
        }
    }
    guess = guess.with_starts_that_meet(ocp);
    if model.guess.is_empty() {
        guess = guess.in_motion(ocp);
    }
    for stated in &model.guess {
        let phase = match &stated.phase {
            Some(name) => model.phases.iter().position(|p| p.name == *name).ok_or_else(|| {
                let names: Vec<&str> = model.phases.iter().map(|p| p.name.as_str()).collect();
                let suggestion = suggested_name(name, "phases", &names);
                amounts.conflict(&stated.at, format!("no phase is named `{name}`{suggestion}"))
            })?,
            None if model.phases.len() == 1 => 0,
            None => {
                let reason = "there are several phases: a guess stands in [guess.PHASE] with the name of one";
                return Err(amounts.conflict(&stated.at, reason));
            }
        };
        let usual = &guess.phases[phase];
        guess.phases[phase] = of_phase(amounts, tables, &model.phases[phase], stated, usual)?;
    }
    let stated = |phase: usize, state: usize| {
        let Phase { name, states, .. } = &model.phases[phase];
        let name_of_state = states.get(state).map(|s| &s.name);
        let own = model.guess.iter().filter(|g| g.phase.as_ref().is_none_or(|of| of == name));
        own.flat_map(|g| &g.profiles).any(|(of, _, _)| Some(of) == name_of_state)
    };
    let guess = guess.with_free_states_moving(ocp, stated).with_accumulated(ocp);
    guess.check(ocp).map_err(|source| ProblemError::Problem { file: amounts.source.name.clone(), source })?;
    Ok(guess)
}

/// Values of one quantity, as a function of time and of the part of the phase.
enum GuessCurve {
    /// Parts of the phase and the values there.
    Samples(Vec<f64>, Vec<f64>),
    Formula(Formula),
}

impl GuessCurve {
    fn at(&self, time: f64, fraction: f64) -> f64 {
        match self {
            Self::Samples(fractions, values) => interpolate(fractions, values, fraction),
            Self::Formula(formula) => formula.evaluate(&[time, fraction])[0],
        }
    }
}

fn of_phase(
    amounts: &mut Amounts<'_>,
    tables: &[Table],
    phase: &Phase,
    stated: &model::Guess,
    usual: &PhaseGuess,
) -> Result<PhaseGuess, ProblemError> {
    let unit = time_unit(amounts, phase);
    let times = match &stated.times {
        None => vec![usual.initial_time, usual.final_time],
        Some(times) => {
            let role = format!("a time in the guess of phase `{}`", phase.name);
            times.iter().map(|t| amounts.amount(t, &unit, &role)).collect::<Result<_, _>>()?
        }
    };
    if times.len() < 2 || times.windows(2).any(|w| w[0] >= w[1]) || !times.iter().all(|t| t.is_finite()) {
        return Err(
            amounts.conflict(&stated.at, "`time` of a guess is a list of at least two times that increase")
        );
    }
    let (first, last) = (times[0], times[times.len() - 1]);
    let fractions: Vec<f64> = times.iter().map(|t| (t - first) / (last - first)).collect();
    let named: Vec<&Variable> = phase.states.iter().chain(&phase.controls).collect();
    let mut shapes: Vec<Option<GuessCurve>> = named.iter().map(|_| None).collect();
    let mut points = fractions.clone();
    for (name, at, profile) in &stated.profiles {
        let Some(k) = named.iter().position(|v| v.name == *name) else {
            let mut names: Vec<&str> = named.iter().map(|v| v.name.as_str()).collect();
            names.push(TIME);
            let suggestion = suggested_name(name, "known", &names);
            let reason = format!("phase `{}` has no state and no control `{name}`{suggestion}", phase.name);
            return Err(amounts.conflict(at, reason));
        };
        let role = format!("the guess of `{name}`");
        let shape = match profile {
            Profile::Formula(formula) => match amounts.constant(formula) {
                // A formula of constants has its unit checked as any amount.
                Some(_) => {
                    let amount =
                        model::Stated { amount: model::Amount::Formula(formula.clone()), at: at.clone() };
                    let value = amounts.amount(&amount, &named[k].unit, &role)?;
                    GuessCurve::Samples(vec![0.0], vec![value])
                }
                None => {
                    points.extend((0..POINTS).map(|k| k as f64 / (POINTS - 1) as f64));
                    GuessCurve::Formula(program(amounts, tables, formula, &named[k].unit, &unit, &role)?)
                }
            },
            Profile::Samples(samples) => {
                let values = samples.iter().map(|s| amounts.amount(s, &named[k].unit, &role));
                let values: Vec<f64> = values.collect::<Result<_, _>>()?;
                if values.is_empty() || !values.iter().all(|v| v.is_finite()) {
                    return Err(amounts.conflict(at, format!("{role} takes finite numbers, at least one")));
                }
                let places = if values.len() == fractions.len() {
                    fractions.clone()
                } else {
                    let last = (values.len() - 1).max(1) as f64;
                    (0..values.len()).map(|k| k as f64 / last).collect()
                };
                points.extend(&places);
                GuessCurve::Samples(places, values)
            }
        };
        shapes[k] = Some(shape);
    }
    points.sort_by(f64::total_cmp);
    points.dedup_by(|a, b| (*a - *b).abs() <= f64::EPSILON);
    let count = phase.states.len();
    let row = |fraction: &f64| {
        let time = first + fraction * (last - first);
        let (mut x, mut u) = (vec![0.0; count], vec![0.0; named.len() - count]);
        usual.state(*fraction, &mut x);
        usual.control(*fraction, &mut u);
        for (k, shape) in shapes.iter().enumerate() {
            if let Some(shape) = shape {
                let value = shape.at(time, *fraction);
                if k < count { x[k] = value } else { u[k - count] = value }
            }
        }
        (x, u)
    };
    let (states, controls) = points.iter().map(row).unzip();
    let times: Vec<f64> = points.iter().map(|f| first + f * (last - first)).collect();
    PhaseGuess::samples(&times, states, controls).map_err(|e| {
        amounts.conflict(&stated.at, format!("the guess of phase `{}` has no finite values: {e}", phase.name))
    })
}

/// A formula of the time and of the part of the phase.
fn program(
    amounts: &Amounts<'_>,
    tables: &[Table],
    formula: &Expression,
    unit: &Unit,
    time: &Unit,
    role: &str,
) -> Result<Formula, ProblemError> {
    let mut compiler = amounts.compiler(Program::new(2, tables));
    for (k, (name, dimension)) in
        [(TIME, time.dimension), (FRACTION, Dimension::NONE)].into_iter().enumerate()
    {
        let input = compiler.recorder().builder.input(k);
        compiler.name(name, Quantity::new(Value::Recorded(input), dimension));
    }
    let found =
        compiler.compile(formula, Some(unit.dimension), role).map_err(|e| amounts.formula_error(e))?;
    let output = compiler.recorded(found);
    let at = amounts.source.place(&amounts.texts.bytes(&formula.at()));
    compiler.recorder().builder.formula(&[output]).map_err(|source| ProblemError::Program { at, source })
}

fn interpolate(places: &[f64], values: &[f64], at: f64) -> f64 {
    if values.len() == 1 {
        return values[0];
    }
    let k = places.partition_point(|p| *p <= at).clamp(1, places.len() - 1);
    let part = (at - places[k - 1]) / (places[k] - places[k - 1]);
    values[k - 1] + part * (values[k] - values[k - 1])
}
