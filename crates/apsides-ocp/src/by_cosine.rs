//! Controls that occur in one cosine or sine alone, by its value.
//!
//! ```text
//! x' = f(x, cos(u)),   0 <= u <= pi        is with v = cos(u)        x' = f(x, v),   -1 <= v <= 1
//! ```
//!
//! A bank angle of which only the vertical part of the lift counts goes from one of its bounds to the other (A. Busemann, N. X. Vinh,
//! R. D. Culp, Optimum Three-Dimensional Atmospheric Entry, Acta Astronautica 2 (1975) 5, doi 10.1016/0094-5765(75)90044-5). Both are stationary
//! points of the cosine, where a bound pushes nothing: nothing tells that it is active, nor that the angle jumps where the other one becomes
//! better. Over the value of the cosine the equations are linear, with bounds that push. Only angles with a stationary point between their bounds,
//! or at one, have that difficulty and that cure. Where the bounds allow several angles of the same cosine, such as a bank to either side, the
//! trajectory has those from zero to a half turn if they are allowed.

use std::f64::consts::PI;

use apsides_ad::{FormulaBuilder, Value, formula_node};

use crate::angles::{ROUNDING, angles};
use crate::rewrite::rewrite;
use crate::{Bounds, Guess, Ocp, Phase, PhaseTrajectory, Trajectory, Variable};

/// Points at which a guess is taken.
const SAMPLES: usize = 65;

/// A problem in which angles of which only a cosine or a sine counts are stated by its value.
pub struct ByCosine {
    /// The problem with cosines.
    pub ocp: Ocp,
    /// Per phase and control, the cosine that it occurs in, if its value is the control.
    cosines: Vec<Vec<Option<Cosine>>>,
}

/// A function `cos(slope u + offset)` of a control, on angles between which it is monotone and has all its values.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cosine {
    slope: f64,
    offset: f64,
    /// The multiple of pi below those angles.
    turn: f64,
    /// The controls of those angles.
    bounds: Bounds,
    /// Least and largest value.
    values: [f64; 2],
}

impl ByCosine {
    /// The problem with cosines; none where no control occurs in one cosine or sine alone.
    #[must_use]
    pub fn of(ocp: &Ocp) -> Option<Self> {
        let found: Vec<Vec<Option<Cosine>>> = ocp.phases.iter().map(of_controls).collect();
        if found.iter().flatten().all(Option::is_none) {
            return None;
        }
        let mut by_cosine = ocp.clone();
        let mut cosines = Vec::new();
        for (phase, found) in by_cosine.phases.iter_mut().zip(found) {
            let split = found.iter().any(Option::is_some).then(|| with_values(phase, &found)).flatten();
            cosines.push(match split {
                Some(split) => {
                    *phase = split;
                    found
                }
                None => vec![None; phase.controls.len()],
            });
        }
        cosines.iter().flatten().any(Option::is_some).then_some(Self { ocp: by_cosine, cosines })
    }

    /// A guess of the problem as it was posed, as one of the problem with cosines.
    #[must_use]
    pub fn guess(&self, guess: &Guess) -> Guess {
        let phases = guess.phases.iter().zip(&self.cosines).map(|(guess, cosines)| {
            if cosines.iter().all(Option::is_none) {
                return guess.clone();
            }
            guess.with_samples(SAMPLES, |_, _, u| over(cosines, u, Cosine::value))
        });
        Guess { phases: phases.collect(), ..guess.clone() }
    }

    /// A trajectory of the problem with cosines as one of the problem as it was posed.
    #[must_use]
    pub fn as_posed(&self, solved: &Trajectory) -> Trajectory {
        self.map(solved, Cosine::angle)
    }

    /// A trajectory of the problem as it was posed as one of the problem with cosines.
    #[must_use]
    pub fn with_values(&self, posed: &Trajectory) -> Trajectory {
        self.map(posed, Cosine::value)
    }

    fn map(&self, trajectory: &Trajectory, f: impl Fn(&Cosine, f64) -> f64 + Copy) -> Trajectory {
        let phase = |(found, cosines): (&PhaseTrajectory, &Vec<Option<Cosine>>)| {
            if cosines.iter().all(Option::is_none) {
                return found.clone();
            }
            let control = found.control.map_nodes(cosines.len(), |u, other| {
                other.copy_from_slice(u);
                over(cosines, other, f);
            });
            // An arc at a bound of the one is none of the other.
            PhaseTrajectory { control, mesh: found.mesh.clone().without_arcs(), ..found.clone() }
        };
        let phases = trajectory.phases.iter().zip(&self.cosines).map(phase).collect();
        Trajectory { phases, ..trajectory.clone() }
    }
}

/// Puts a function of the controls that have a cosine in their places.
fn over(cosines: &[Option<Cosine>], u: &mut [f64], f: impl Fn(&Cosine, f64) -> f64) {
    for (u, cosine) in u.iter_mut().zip(cosines) {
        if let Some(cosine) = cosine {
            *u = f(cosine, *u);
        }
    }
}

impl Cosine {
    /// The cosine over the bounds of a control; none where it has no stationary point there.
    fn new([slope, offset]: [f64; 2], bounds: Bounds) -> Option<Self> {
        let ends = [bounds.lower, bounds.upper].map(|u| slope * u + offset);
        let (least, largest) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        let first = ((least + ROUNDING) / PI).floor();
        let is_stationary = |angle: f64| (angle / PI - (angle / PI).round()).abs() <= ROUNDING;
        if !(is_stationary(least) || largest >= PI * (first + 1.0) - ROUNDING) {
            return None;
        }
        // Between multiples of pi: one of the first three has all values, angles from zero on where they have.
        let parts = [0.0, first, first + 1.0, first + 2.0].map(|multiple| {
            let turn = PI * multiple;
            [least.max(turn), largest.min(turn + PI)]
        });
        let values = |[a, b]: [f64; 2]| [a.cos().min(b.cos()), a.cos().max(b.cos())];
        let is_part = |part: &[f64; 2]| part[1] > part[0] + ROUNDING;
        let (lower, upper) = parts
            .iter()
            .filter(|p| is_part(p))
            .map(|p| values(*p))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lower, upper), [least, largest]| {
                (lower.min(least), upper.max(largest))
            });
        let has_all = |part: &&[f64; 2]| {
            let [least, largest] = values(**part);
            is_part(part) && least <= lower + ROUNDING && largest >= upper - ROUNDING
        };
        let part = parts.iter().find(has_all)?;
        let turn = PI * ((part[0] + ROUNDING) / PI).floor();
        let controls = part.map(|angle| bounds.clamp((angle - offset) / slope));
        let bounds = Bounds::new(controls[0].min(controls[1]), controls[0].max(controls[1]));
        let snapped = |v: f64| if 1.0 - v.abs() <= ROUNDING { v.round() } else { v };
        Some(Self { slope, offset, turn, bounds, values: [lower, upper].map(snapped) })
    }

    /// True if the cosine falls as the angle grows.
    fn falls(&self) -> bool {
        (self.turn / PI).round().rem_euclid(2.0) == 0.0
    }

    fn value(&self, u: f64) -> f64 {
        (self.slope * u + self.offset).cos().clamp(self.values[0], self.values[1])
    }

    fn angle(&self, value: f64) -> f64 {
        let value = if self.falls() { value } else { -value };
        self.bounds.clamp((value.clamp(-1.0, 1.0).acos() + self.turn - self.offset) / self.slope)
    }

    /// The value of the cosine as a control.
    fn variable(&self, control: &Variable) -> Variable {
        let [lower, upper] = self.values;
        let [a, b] = control.guards;
        let grows = self.value(self.bounds.lower) < self.value(self.bounds.upper);
        Variable {
            name: format!("cosine of {}", control.name),
            unit: "-".to_owned(),
            bounds: Bounds::new(lower, upper),
            scale: None,
            guards: if grows { [a, b] } else { [b, a] },
        }
    }
}

/// Per control of a phase, the cosine that all its functions have of it, and nothing else.
fn of_controls(phase: &Phase) -> Vec<Option<Cosine>> {
    let none = vec![None; phase.controls.len()];
    let is_between =
        |control: &Variable| control.bounds.lower.is_finite() && control.bounds.upper.is_finite();
    if !phase.controls.iter().any(is_between) {
        return none;
    }
    let Ok(formulas) = phase.functions().map(|f| f.formula()).collect::<Result<Vec<_>, _>>() else {
        return none;
    };
    let nx = phase.states.len();
    let of_control = |(j, control): (usize, &Variable)| {
        let mut one = None;
        for formula in &formulas {
            for angle in angles(formula, nx + j)?.into_iter().flatten() {
                if *one.get_or_insert(angle) != angle {
                    return None;
                }
            }
        }
        one.filter(|_| is_between(control)).and_then(|angle| Cosine::new(angle, control.bounds))
    };
    phase.controls.iter().enumerate().map(of_control).collect()
}

/// The phase with the values of cosines as controls.
fn with_values(phase: &Phase, found: &[Option<Cosine>]) -> Option<Phase> {
    let nx = phase.states.len();
    let mut split = phase.clone();
    for (control, cosine) in split.controls.iter_mut().zip(found) {
        if let Some(cosine) = cosine {
            *control = cosine.variable(control);
        }
    }
    let path = split.path.iter_mut().map(|c| &mut c.function);
    let integrals = split.integrals.iter_mut().map(|q| &mut q.function);
    for function in std::iter::once(&mut split.dynamics).chain(path).chain(integrals) {
        let formula = function.formula().ok()?;
        let mut places: Vec<Option<usize>> = vec![None; formula.operations().len()];
        for j in (0..found.len()).filter(|j| found[*j].is_some()) {
            let cosines = angles(&formula, nx + j).into_iter().flatten();
            for (place, cosine) in places.iter_mut().zip(cosines) {
                *place = place.or(cosine.map(|_| nx + j));
            }
        }
        let mut b = FormulaBuilder::new(formula.inputs());
        let replace = |b: &mut FormulaBuilder, k: usize, _: &[Value]| places[k].map(|input| b.input(input));
        let values = rewrite(&formula, &mut b, |b, i| b.input(i), replace);
        let outputs: Vec<Value> = formula.outputs().iter().map(|k| values[*k]).collect();
        *function = formula_node(b.formula(&outputs).ok()?);
    }
    Some(split)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_those_from_zero_on_where_they_are_allowed() {
        let of_degrees = [PI / 180.0, 0.0];
        let angle = |lower: f64, upper: f64| {
            Cosine::new(of_degrees, Bounds::new(lower, upper)).map(|cosine| cosine.angle(0.5))
        };
        let cases =
            [(-1000.0, 1000.0, 60.0), (-180.0, 180.0, 60.0), (-90.0, 0.0, -60.0), (200.0, 560.0, 420.0)];
        for (lower, upper, expected) in cases {
            assert!(angle(lower, upper).is_some_and(|a| (a - expected).abs() < ROUNDING), "{lower} {upper}");
        }
        assert_eq!(angle(10.0, 170.0), None);
    }
}
