//! Guesses around what path constraints of states forbid, such as obstacles.
//!
//! A straight line through an obstacle, or between two that overlap, has no way out by small steps: to either side the one moves deeper where
//! the other moves out, and a method of Newton's kind says that they conflict. A line that is bent around all of them has none of
//! them to leave. Bends are chosen by the values of the constraints alone, which takes no solve.

use std::cell::RefCell;
use std::f64::consts::PI;

use crate::bow::bow;
use crate::guess::stationary::Along;
use crate::spread::Spread;
use crate::{Guess, Ocp, PathConstraint, Phase, PhaseGuess, PhaseScaling, Scaling};

/// Points of a guess at which constraints are looked at, and of a bent one.
const POINTS: usize = 65;
/// Excess, relative to the scale of a row, from which on a guess is inside of what it forbids.
const INSIDE: f64 = 1e-3;
/// Bends that are tried: a single wave, and where none of these is clear of all, with a second one.
const BENDS: [usize; 2] = [150, 600];
/// Least and largest bend, relative to the way from the one end of the guess to the other.
const BEND: [f64; 2] = [0.05, 3.0];

impl Guess {
    /// True if the guess is inside of what path constraints of states and time alone forbid.
    #[must_use]
    pub fn is_blocked(&self, ocp: &Ocp) -> bool {
        let scaling = Scaling::new(ocp, self);
        let mut phases = ocp.phases.iter().zip(&self.phases).zip(&scaling.phases);
        phases.any(|((phase, guess), scales)| {
            Blocked::new(phase, guess, &self.parameters, scales, (true, true)).is_some()
        })
    }

    /// The guess, bent around what path constraints of states and time alone forbid along it: the least bend that is clear of all of them, and
    /// the least one to the other side, in one or two times each. None where nothing is forbidden along the guess, or nothing is found that is clear.
    #[must_use]
    pub fn around(&self, ocp: &Ocp) -> Vec<Self> {
        let scaling = Scaling::new(ocp, self);
        let mut ways: Vec<Vec<PhaseGuess>> = Vec::with_capacity(ocp.phases.len());
        let mut is_blocked = false;
        for (k, ((phase, guess), scales)) in
            ocp.phases.iter().zip(&self.phases).zip(&scaling.phases).enumerate()
        {
            let ends = (k == 0, k + 1 == ocp.phases.len());
            let Some(blocked) = Blocked::new(phase, guess, &self.parameters, scales, ends) else {
                ways.push(vec![guess.clone()]);
                continue;
            };
            is_blocked = true;
            let around = blocked.ways_around();
            if around.is_empty() {
                return Vec::new();
            }
            ways.push(around);
        }
        let most = if is_blocked { ways.iter().map(Vec::len).max().unwrap_or(0) } else { 0 };
        let way = |number: usize| {
            let phases = ways.iter().map(|of_phase| of_phase[number.min(of_phase.len() - 1)].clone());
            Self {
                phases: phases.collect(),
                parameters: self.parameters.clone(),
                constraint_multipliers: None,
            }
        };
        (0..most).map(way).collect()
    }
}

/// A path constraint, and those of its rows that take no control.
struct Forbidding<'a> {
    constraint: &'a PathConstraint,
    rows: Vec<usize>,
    scales: &'a [f64],
}

/// A phase with a guess that is inside of what rows of its path constraints forbid.
struct Blocked<'a> {
    phase: &'a Phase,
    guess: &'a PhaseGuess,
    parameters: &'a [f64],
    forbidding: Vec<Forbidding<'a>>,
    /// The states that violated rows take, each with the size of a bend.
    movable: Vec<(usize, f64)>,
    ends: (bool, bool),
    /// Inputs and values of a function, of which many are taken.
    work: RefCell<(Vec<f64>, Vec<f64>)>,
}

impl<'a> Blocked<'a> {
    /// None where the guess is clear.
    fn new(
        phase: &'a Phase,
        guess: &'a PhaseGuess,
        parameters: &'a [f64],
        scales: &'a PhaseScaling,
        ends: (bool, bool),
    ) -> Option<Self> {
        let mut first = 0;
        let mut forbidding = Vec::new();
        for constraint in &phase.path {
            let last = first + constraint.rows.len();
            let rows = rows_of_states(phase, constraint);
            if !rows.is_empty() {
                forbidding.push(Forbidding { constraint, rows, scales: &scales.path[first..last] });
            }
            first = last;
        }
        let work = RefCell::default();
        let mut blocked = Self { phase, guess, parameters, forbidding, movable: Vec::new(), ends, work };
        let inside = blocked.inside();
        if !inside.contains(&true) {
            return None;
        }
        let moves = (0..phase.states.len()).filter(|s| inside[*s]);
        blocked.movable = moves.clone().map(|s| (s, blocked.way_of(s, moves.clone(), scales))).collect();
        Some(blocked)
    }

    /// The states that rows take which are violated along the guess.
    fn inside(&self) -> Vec<bool> {
        let mut inside = vec![false; self.phase.states.len()];
        for f in &self.forbidding {
            for row in &f.rows {
                let alone = std::slice::from_ref(row);
                if fractions().any(|fraction| self.excess(f, alone, fraction, &[]) > INSIDE) {
                    let entries = f.constraint.function.pattern().jacobian_entries();
                    for (_, column) in entries.filter(|(r, _)| r == row) {
                        inside.get_mut(column).into_iter().for_each(|state| *state = true);
                    }
                }
            }
        }
        inside
    }

    /// The size of a bend of a state: the longest way of the guess among the states that move and have its unit, or where there is none, its
    /// scale.
    fn way_of(&self, state: usize, among: impl Iterator<Item = usize>, scales: &PhaseScaling) -> f64 {
        let unit = &self.phase.states[state].variable.unit;
        let (mut start, mut end) = (vec![0.0; self.phase.states.len()], vec![0.0; self.phase.states.len()]);
        self.guess.state(0.0, &mut start);
        self.guess.state(1.0, &mut end);
        let way = among
            .filter(|s| self.phase.states[*s].variable.unit == *unit)
            .map(|s| (end[s] - start[s]).abs())
            .fold(0.0, f64::max);
        if way > 0.0 { way } else { scales.states[state] }
    }

    /// The largest excess of some rows of a constraint at a part of the phase, relative to their scales, with a bend of the movable states.
    fn excess(&self, f: &Forbidding<'_>, rows: &[usize], fraction: f64, bend: &[f64]) -> f64 {
        let function = f.constraint.function.as_ref();
        let (z, values) = &mut *self.work.borrow_mut();
        z.resize(function.inputs(), 0.0);
        values.resize(f.constraint.rows.len(), 0.0);
        Along::new(self.phase, self.guess, self.parameters, function).point(fraction, z);
        self.bend(fraction, bend, z);
        function.value(z, values);
        let excess = |row: &usize| f.constraint.rows[*row].bounds.excess(values[*row]) / f.scales[*row];
        rows.iter()
            .map(excess)
            .fold(0.0, |most, next| if next.is_nan() { f64::INFINITY } else { most.max(next) })
    }

    /// Bends the movable states by a wave each, and by a second one where so many numbers are given.
    fn bend(&self, fraction: f64, bend: &[f64], x: &mut [f64]) {
        let (is_first, is_last) = self.ends;
        let second = (2.0 * PI * fraction).sin();
        for (k, (s, way)) in self.movable.iter().enumerate() {
            let state = &self.phase.states[*s];
            let wave = bow(state, is_first, is_last, fraction);
            let by = |k: usize| bend.get(k).copied().unwrap_or(0.0);
            let moved = x[*s] + way * (by(k) * wave + by(k + self.movable.len()) * second);
            x[*s] = state.variable.bounds.clamp(moved);
        }
    }

    fn is_clear(&self, bend: &[f64]) -> bool {
        let is_met = |f: &Forbidding<'_>| {
            fractions().all(|fraction| self.excess(f, &f.rows, fraction, bend) <= INSIDE)
        };
        self.forbidding.iter().all(is_met)
    }

    /// The guess with the least bend that is clear, and with the least one to the other side: in the time of their ways, and in that of the guess where
    /// it is another one.
    fn ways_around(&self) -> Vec<PhaseGuess> {
        let mut clear: Vec<(f64, Vec<f64>)> = Vec::new();
        for (waves, most) in (1..).zip(BENDS) {
            if !clear.is_empty() {
                break;
            }
            let dimension = waves * self.movable.len();
            clear = Spread::of(dimension + 1)
                .take(most)
                .map(|point| bend_at(&point))
                .filter(|bend| self.is_clear(bend))
                .map(|bend| (bend.iter().map(|b| b * b).sum(), bend))
                .collect();
        }
        clear.sort_by(|a, b| a.0.total_cmp(&b.0));
        let least = clear.first().map(|(_, bend)| bend);
        let is_other = |bend: &&Vec<f64>| {
            least.is_some_and(|least| bend.iter().zip(least).map(|(a, b)| a * b).sum::<f64>() < 0.0)
        };
        let other = clear.iter().map(|(_, bend)| bend).find(is_other);
        let bent =
            |bend: &Vec<f64>| self.guess.with_samples(POINTS, |fraction, x, _| self.bend(fraction, bend, x));
        let sides: Vec<PhaseGuess> = least.into_iter().chain(other).map(bent).collect();
        let sooner: Vec<PhaseGuess> = sides.iter().cloned().map(|side| self.in_time(side)).collect();
        let changed = |(side, sooner): &(PhaseGuess, &PhaseGuess)| side.final_time != sooner.final_time;
        let late: Vec<PhaseGuess> =
            sides.into_iter().zip(&sooner).filter(changed).map(|(side, _)| side).collect();
        sooner.into_iter().chain(late).collect()
    }

    /// A bent guess in the time that its way takes at the speed that the equations of motion have along it, where the time is free and that is
    /// shorter: with more time a vehicle that cannot stop makes loops.
    fn in_time(&self, mut bent: PhaseGuess) -> PhaseGuess {
        let (nx, f) = (self.phase.states.len(), self.phase.dynamics.as_ref());
        let along = Along::new(self.phase, &bent, self.parameters, f);
        let (mut z, mut rates, mut before) = (vec![0.0; f.inputs()], vec![0.0; nx], vec![0.0; nx]);
        bent.state(0.0, &mut before);
        let (mut way, mut speed) = (0.0, 0.0);
        let length = |change: &dyn Fn(usize) -> f64| {
            self.movable.iter().map(|(s, size)| (change(*s) / size).powi(2)).sum::<f64>().sqrt()
        };
        for fraction in fractions() {
            along.point(fraction, &mut z);
            f.value(&z, &mut rates);
            way += length(&|s| z[s] - before[s]);
            speed += length(&|s| rates[s]) / POINTS as f64;
            before.copy_from_slice(&z[..nx]);
        }
        let duration = self.phase.duration.clamp(way / speed);
        let final_time = self.phase.final_time.clamp(bent.initial_time + duration);
        if final_time > bent.initial_time && final_time < bent.final_time {
            bent.final_time = final_time;
        }
        bent
    }
}

/// The rows of a path constraint that take states and no control.
fn rows_of_states(phase: &Phase, constraint: &PathConstraint) -> Vec<usize> {
    let (nx, nu) = (phase.states.len(), phase.controls.len());
    let takes = |row: usize, of: std::ops::Range<usize>| {
        let mut entries = constraint.function.pattern().jacobian_entries();
        entries.any(|(r, column)| r == row && of.contains(&column))
    };
    (0..constraint.rows.len()).filter(|row| takes(*row, 0..nx) && !takes(*row, nx..nx + nu)).collect()
}

fn fractions() -> impl Iterator<Item = f64> {
    (0..POINTS).map(|k| k as f64 / (POINTS - 1) as f64)
}

/// The bend of a point of the unit cube: its size by the first number, evenly by its logarithm, its direction by the others.
fn bend_at(point: &[f64]) -> Vec<f64> {
    let [least, most] = BEND;
    let size = least * (most / least).powf(point[0]);
    let direction: Vec<f64> = point[1..].iter().map(|p| 2.0 * p - 1.0).collect();
    let largest = direction.iter().fold(0.0, |most: f64, d| most.max(d.abs()));
    if largest > 0.0 { direction.iter().map(|d| size * d / largest).collect() } else { direction }
}

#[cfg(test)]
mod tests {
    use apsides_ad::{Dynamics, PathFunction, Scalar};

    use super::*;
    use crate::{At, Bounds, State, Variable};

    /// Round-off of a guess.
    const LAST_BITS: f64 = 1e-12;

    struct Point;
    impl Dynamics<2, 2> for Point {
        fn rate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 2], _p: &[S; 0]) -> [S; 2] {
            *u
        }
    }

    /// Squares of the distances from centres on a line across the way.
    struct Discs(Vec<f64>);
    impl PathFunction<2, 2, 2> for Discs {
        fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 2], _u: &[S; 2], _p: &[S; 0]) -> [S; 2] {
            [0, 1].map(|k| (x[0] - S::from(2.0)).square() + (x[1] - S::from(self.0[k])).square())
        }
    }

    /// From (0, 0) to (4, 0) past two discs of a radius, at x = 2 and these heights.
    fn past(heights: [f64; 2], radius: f64) -> Ocp {
        let disc = |name: &str| Variable::new(name, "m2").at_least(radius * radius);
        let phase = Phase::new("way", Point)
            .states([
                State::new("x", "m").starts_at(0.0).ends_at(4.0),
                State::new("y", "m").starts_at(0.0).ends_at(0.0),
            ])
            .controls([
                Variable::new("u", "m/s").within(-1.0, 1.0),
                Variable::new("v", "m/s").within(-1.0, 1.0),
            ])
            .final_time(Bounds::new(0.1, 10.0))
            .path([disc("one"), disc("two")], Discs(heights.to_vec()));
        let ocp = Ocp::builder("past").phase(phase).minimize("time", "s", At::FinalTime("way")).build();
        ocp.expect("a problem")
    }

    #[test]
    fn bends_lead_around_discs_that_overlap_to_either_side() {
        let ocp = past([0.5, -0.4], 0.6);
        let ways = Guess::linear(&ocp).around(&ocp);
        let mut sides = Vec::new();
        for way in &ways {
            let mut x = [0.0; 2];
            for fraction in fractions() {
                way.phases[0].state(fraction, &mut x);
                for height in [0.5, -0.4] {
                    assert!((x[0] - 2.0).hypot(x[1] - height) > 0.599, "{x:?}");
                }
            }
            way.phases[0].state(0.5, &mut x);
            sides.push(x[1].signum());
            way.phases[0].state(1.0, &mut x);
            assert!((x[0] - 4.0).abs() + x[1].abs() < LAST_BITS, "{x:?}");
        }
        sides.sort_by(f64::total_cmp);
        assert_eq!(sides, [-1.0, 1.0]);
    }

    /// Along straight lines of constant rates the way takes the time of its length: 4 m at the 1 m/s of the guess, and what the bend adds.
    #[test]
    fn a_bent_guess_takes_the_time_of_its_way() {
        let ocp = past([0.5, -0.4], 0.6);
        let mut guess = Guess::linear(&ocp);
        guess.phases[0] =
            PhaseGuess::samples(&[0.0, 9.0], vec![vec![0.0, 0.0], vec![4.0, 0.0]], vec![vec![1.0, 0.0]; 2])
                .expect("a guess");
        let times: Vec<f64> = guess.around(&ocp).iter().map(|way| way.phases[0].final_time).collect();
        assert!(times.len() == 4 && times[..2].iter().all(|time| (4.0..8.0).contains(time)), "{times:?}");
        assert_eq!(times[2..], [9.0; 2]);
        // Where nothing moves the time is that of the guess.
        guess.phases[0] =
            PhaseGuess::samples(&[0.0, 9.0], vec![vec![0.0, 0.0], vec![4.0, 0.0]], vec![vec![0.0, 0.0]; 2])
                .expect("a guess");
        assert!(guess.around(&ocp).iter().all(|way| way.phases[0].final_time == 9.0));
    }

    #[test]
    fn what_is_clear_is_not_bent() {
        let ocp = past([1.0, -1.0], 0.6);
        assert!(Guess::linear(&ocp).around(&ocp).is_empty());
    }

    /// The end itself is inside: no bend that keeps it is clear.
    #[test]
    fn nothing_leads_out_of_an_end() {
        let ocp = past([0.0, 0.0], 2.5);
        assert!(Guess::linear(&ocp).around(&ocp).is_empty());
    }
}
