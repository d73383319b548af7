//! Events: zeros of functions of time and state, located on the dense output.
//!
//! Each step is sampled at its ends, at three points between and close to the ends. A change of sign brackets a
//! zero; where a function comes nearest to zero between samples without changing sign, the extremum is sought, so that
//! a pair of zeros of a grazing passage is found too. Zeros are located to the rounding of time.
//!
//! Where an interpolant is not at hand, the samples are taken from the cubic through the ends and their rates first, which costs no
//! evaluation of the rate: steps on which every function keeps well away from zero need no more.

use std::fmt;
use std::ops::ControlFlow;

use crate::step::{Observer, Occurrence, Step};

/// Relative times at which a step is sampled; those next to the ends show the slope there.
const SAMPLES: [f64; 7] = [0.0, 1e-4, 0.25, 0.5, 0.75, 1.0 - 1e-4, 1.0];
/// Samples and the extrema between them.
const MAX_POINTS: usize = 2 * SAMPLES.len();
/// A function that varies by less than this part of its least value over a step is far from zero.
const FAR: f64 = 0.1;
/// Zeros nearer to the start of the integration than this part of the first step are the start's own.
const START_GUARD: f64 = 1e-9;

/// The crossings of zero that count, seen in the direction of integration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Direction {
    /// Crossings from negative to positive.
    Rising,
    /// Crossings from positive to negative.
    Falling,
    /// Both.
    #[default]
    Any,
}

/// A function of time and state whose zeros are sought.
///
/// A zero at the start of the integration is no event, so one can restart from the state of an event. A touch without
/// crossing is an event only if rounding makes it one. Where the function is NaN there is no event.
#[derive(Clone, Copy)]
pub struct Event<'a> {
    /// The function `g(t, x)`, continuous along the solution.
    pub function: &'a dyn Fn(f64, &[f64]) -> f64,
    /// The crossings that count; default both.
    pub direction: Direction,
    /// True if the integration ends there; default false.
    pub terminal: bool,
}

impl<'a> Event<'a> {
    /// Every zero of `function`, not terminal.
    pub fn new(function: &'a dyn Fn(f64, &[f64]) -> f64) -> Self {
        Self { function, direction: Direction::Any, terminal: false }
    }

    /// The same, zeros of one direction only.
    pub fn directed(self, direction: Direction) -> Self {
        Self { direction, ..self }
    }

    /// The same, ending the integration.
    pub fn terminal(self) -> Self {
        Self { terminal: true, ..self }
    }
}

impl fmt::Debug for Event<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Event")
            .field("direction", &self.direction)
            .field("terminal", &self.terminal)
            .finish_non_exhaustive()
    }
}

/// A crossing found in a step.
#[derive(Debug, Clone, Copy)]
struct Crossing {
    event: usize,
    time: f64,
    rising: bool,
}

/// State of the events between steps, and room for those of a step.
#[derive(Debug, Clone, Default)]
pub(crate) struct EventTracker {
    /// Sign of each function at the last sample; 0 where unknown.
    signs: Vec<i8>,
    /// Values at the samples of the step, one row per event.
    values: Vec<[f64; SAMPLES.len()]>,
    crossings: Vec<Crossing>,
    state: Vec<f64>,
    /// Zeros up to this time belong to the start.
    guard: Option<f64>,
}

/// The time at which a step ended early, and the event that ended it.
pub(crate) struct Terminal {
    pub(crate) event: usize,
    pub(crate) time: f64,
}

impl EventTracker {
    pub(crate) fn new(dimension: usize) -> Self {
        Self { state: vec![0.0; dimension], ..Self::default() }
    }

    pub(crate) fn start(&mut self, events: &[Event<'_>], t: f64, x: &[f64]) {
        self.signs.clear();
        self.signs.extend(events.iter().map(|e| sign((e.function)(t, x))));
        self.values.resize(events.len(), [0.0; SAMPLES.len()]);
        self.crossings.clear();
        self.crossings.reserve(MAX_POINTS * events.len());
        self.guard = None;
    }

    /// State at the last event delivered.
    pub(crate) fn state(&self) -> &[f64] {
        &self.state
    }

    /// Values of all functions at the samples of a step.
    fn sample(&mut self, step: &Step<'_>, next: &[f64], events: &[Event<'_>]) {
        for (k, &s) in SAMPLES.iter().enumerate() {
            let t = time_of(step, s);
            // The true ends, so that neighbouring steps see the same values.
            let state = if s == 0.0 {
                step.start_state()
            } else if s == 1.0 {
                next
            } else {
                step.evaluate(t, &mut self.state);
                &self.state
            };
            for (values, event) in self.values.iter_mut().zip(events) {
                values[k] = (event.function)(t, state);
            }
        }
    }

    /// Returns true if, by a rough interpolant of a step that ends at `next`, no function comes near zero: the samples have one sign and vary
    /// by little of the least of them, or by less than it without turning towards zero between the ends.
    pub(crate) fn quiet(&mut self, step: &Step<'_>, next: &[f64], events: &[Event<'_>]) -> bool {
        self.guard.get_or_insert(step.start + START_GUARD * (step.end - step.start));
        self.sample(step, next, events);
        self.values.iter().zip(&self.signs).all(|(values, &before)| {
            let side = f64::from(before);
            let least = values.iter().fold(f64::INFINITY, |least, v| least.min(side * v));
            let most = values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
            let turns = values.windows(3).any(|v| side * (v[1] - v[0]) < 0.0 && side * (v[2] - v[1]) >= 0.0);
            // A sum is NaN where a value is.
            let known = values.iter().sum::<f64>().is_finite();
            known && before != 0 && (most - least < FAR * least || (2.0 * least > most && !turns))
        })
    }

    /// Finds the events of a step that ends at `next` and delivers them in time order, up to a terminal one.
    pub(crate) fn scan<O: Observer>(
        &mut self,
        step: &Step<'_>,
        next: &[f64],
        events: &[Event<'_>],
        observer: &mut O,
    ) -> Option<Terminal> {
        let direction = (step.end - step.start).signum();
        let guard = *self.guard.get_or_insert(step.start + START_GUARD * (step.end - step.start));
        let time = |s: f64| time_of(step, s);
        self.sample(step, next, events);
        self.crossings.clear();
        for (index, event) in events.iter().enumerate() {
            let state = &mut self.state;
            let mut g = |t: f64| {
                step.evaluate(t, state);
                (event.function)(t, state)
            };
            let (points, count) = bracketing_points(&self.values[index], time, &mut g);
            let before = &mut self.signs[index];
            for pair in 0..count {
                let (t, value) = points[pair];
                let now = sign(value);
                let crossed = *before != 0 && now != *before && !value.is_nan();
                let rising = *before < 0;
                let wanted = match event.direction {
                    Direction::Any => true,
                    Direction::Rising => rising,
                    Direction::Falling => !rising,
                };
                if crossed && wanted && pair > 0 {
                    let time = if now == 0 { t } else { locate(points[pair - 1], points[pair], &mut g) };
                    if (time - guard) * direction > 0.0 {
                        self.crossings.push(Crossing { event: index, time, rising });
                    }
                }
                *before = now;
            }
        }
        self.crossings.sort_unstable_by(|a, b| {
            (direction * a.time).total_cmp(&(direction * b.time)).then(a.event.cmp(&b.event))
        });
        for &Crossing { event, time, rising } in &self.crossings {
            if time == step.end {
                self.state.copy_from_slice(next);
            } else {
                step.evaluate(time, &mut self.state);
            }
            let flow = observer.event(&Occurrence { event, time, state: &self.state, rising });
            if events[event].terminal || flow == ControlFlow::Break(()) {
                return Some(Terminal { event, time });
            }
        }
        None
    }
}

/// Time at a relative time of a step.
fn time_of(step: &Step<'_>, s: f64) -> f64 {
    if s == 1.0 { step.end } else { step.start + s * (step.end - step.start) }
}

/// -1, 0 or 1; 0 for NaN.
fn sign(value: f64) -> i8 {
    i8::from(value > 0.0) - i8::from(value < 0.0)
}

/// The samples as pairs (time, value), with the extremum put in where one reaches the other side of zero.
fn bracketing_points(
    values: &[f64; SAMPLES.len()],
    time: impl Fn(f64) -> f64,
    g: &mut impl FnMut(f64) -> f64,
) -> ([(f64, f64); MAX_POINTS], usize) {
    let mut points = [(0.0, 0.0); MAX_POINTS];
    let mut count = 0;
    let mut push = |point| {
        points[count] = point;
        count += 1;
    };
    let sample = |k: usize| (time(SAMPLES[k]), values[k]);
    push(sample(0));
    for k in 1..SAMPLES.len() {
        let (before, here) = (sample(k - 1), sample(k));
        if k + 1 < SAMPLES.len() {
            let after = sample(k + 1);
            let same = sign(here.1) != 0 && sign(before.1) == sign(here.1) && sign(after.1) == sign(here.1);
            if same && here.1.abs() < before.1.abs() && here.1.abs() <= after.1.abs() {
                let found = reach_zero(before, here, after, g);
                if let Some(found) = found.filter(|found| (found.0 - before.0) / (here.0 - before.0) < 1.0) {
                    push(found);
                    push(here);
                } else {
                    push(here);
                    found.into_iter().for_each(&mut push);
                }
                continue;
            }
        }
        push(here);
    }
    (points, count)
}

/// Follows a function of one sign, smaller in magnitude at `b` than at `a` and `c`, toward its extremum by golden
/// section with parabolic steps (Brent 1973, chapter 5); the first point found on or beyond zero.
fn reach_zero(
    a: (f64, f64),
    b: (f64, f64),
    c: (f64, f64),
    g: &mut impl FnMut(f64) -> f64,
) -> Option<(f64, f64)> {
    const GOLDEN: f64 = 0.381_966_011_250_105_1;
    let side = b.1.signum();
    let (mut a, mut b, mut c) = ((a.0, side * a.1), (b.0, side * b.1), (c.0, side * c.1));
    let width = (c.0 - a.0).abs();
    for round in 0..60 {
        // Beyond the square root of the precision a smooth minimum does not go lower.
        let resolution = 1e-9 * width + 4.0 * f64::EPSILON * b.0.abs();
        if (c.0 - a.0).abs() <= 4.0 * resolution {
            return None;
        }
        let (r, q) = ((b.0 - a.0) * (b.1 - c.1), (b.0 - c.0) * (b.1 - a.1));
        let mut t = b.0 - ((b.0 - c.0) * q - (b.0 - a.0) * r) / (2.0 * (q - r));
        let longer = if (c.0 - b.0).abs() > (b.0 - a.0).abs() { c.0 } else { a.0 };
        let inside = (t - a.0) * (c.0 - t) > 0.0;
        // Every third round golden section, so that the bracket shrinks from both sides.
        if !inside || round % 3 == 2 {
            t = b.0 + GOLDEN * (longer - b.0);
        } else if (t - b.0).abs() < resolution {
            t = b.0 + resolution * (longer - b.0).signum();
        }
        let value = side * g(t);
        if value.is_nan() {
            return None;
        }
        if value <= 0.0 {
            return Some((t, side * value));
        }
        let after = (t - b.0) * (c.0 - b.0) > 0.0;
        match (value < b.1, after) {
            (true, true) => (a, b) = (b, (t, value)),
            (true, false) => (c, b) = (b, (t, value)),
            (false, true) => c = (t, value),
            (false, false) => a = (t, value),
        }
    }
    None
}

/// Locates a change of sign by Chandrupatla's method (*Adv. Eng. Software* 28 (1997) 145,
/// doi:10.1016/S0965-9978(96)00051-8); returns the side beyond the zero, seen from `start`.
fn locate(start: (f64, f64), end: (f64, f64), g: &mut impl FnMut(f64) -> f64) -> f64 {
    let before = sign(start.1);
    let (mut a, mut b) = (end, start);
    let mut fraction: f64 = 0.5;
    for _ in 0..200 {
        let near = if a.1.abs() < b.1.abs() { a.0 } else { b.0 };
        let resolution = 2.0 * f64::EPSILON * near.abs() / (b.0 - a.0).abs();
        if resolution >= 0.5 || (b.0 - a.0).abs() <= f64::MIN_POSITIVE {
            break;
        }
        let t = a.0 + fraction.clamp(resolution, 1.0 - resolution) * (b.0 - a.0);
        let point = (t, g(t));
        if sign(point.1) == 0 {
            return t;
        }
        let c = if sign(point.1) == sign(a.1) { a } else { std::mem::replace(&mut b, a) };
        a = point;
        // Inverse quadratic interpolation where it is safe, else bisection.
        let xi = (a.0 - b.0) / (c.0 - b.0);
        let phi = (a.1 - b.1) / (c.1 - b.1);
        fraction = if phi * phi < xi && (1.0 - phi).powi(2) < 1.0 - xi {
            a.1 / (b.1 - a.1) * c.1 / (b.1 - c.1)
                + (c.0 - a.0) / (b.0 - a.0) * a.1 / (c.1 - a.1) * b.1 / (c.1 - b.1)
        } else {
            0.5
        };
    }
    if sign(a.1) == before { b.0 } else { a.0 }
}
