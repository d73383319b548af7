//! Angles that may turn on past their bounds.
//!
//! ```text
//! x' = f(x, cos(u), sin(u)),   -pi <= u <= pi
//! ```
//!
//! has all directions, but not all ways from one to the next: a thrust against the motion, which turns through the direction of pi, has to jump to
//! -pi there, and no smooth change of a trajectory leads across. Where only cosines and sines of a control count and its bounds leave it a full
//! turn, they keep it from nothing, and it may go on as far again on either side; the trajectory is brought back between the bounds afterwards, with
//! an end of an interval where it passes one.

use std::f64::consts::TAU;

use crate::angles::{ROUNDING, angles};
use crate::{Bounds, Ocp, OcpError, Phase, PhaseTrajectory, Trajectory, Variable};

/// Distance from a bound, relative to a turn, that a barrier leaves.
const AT_BOUND: f64 = 1e-6;
/// Part of a phase within which an angle leaps, and the least part of a turn by which.
const SHORT: f64 = 0.02;
const LEAP: f64 = 0.75;
/// Points between two nodes at which a passage is looked for.
const BETWEEN: usize = 4;
/// Bisections of a passage, to rounding.
const BISECTIONS: usize = 60;

/// A problem in which angles of a full turn may go on past their bounds.
pub struct Turns {
    /// The problem with wider bounds.
    pub ocp: Ocp,
    /// Per phase and control.
    angles: Vec<Vec<Option<Angle>>>,
}

/// An angle, its full turn and its bounds as they were posed.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Angle {
    turn: f64,
    bounds: Bounds,
}

impl Turns {
    /// The problem with wider bounds; none where no angle has a full turn.
    #[must_use]
    pub fn of(ocp: &Ocp) -> Option<Self> {
        let angles: Vec<Vec<Option<Angle>>> = ocp.phases.iter().map(of_controls).collect();
        if angles.iter().flatten().all(Option::is_none) {
            return None;
        }
        let mut wider = ocp.clone();
        for (phase, angles) in wider.phases.iter_mut().zip(&angles) {
            for (control, angle) in phase.controls.iter_mut().zip(angles) {
                if let Some(Angle { turn, bounds }) = angle {
                    control.scale = control.size();
                    control.bounds = Bounds::new(bounds.lower - turn, bounds.upper + turn);
                }
            }
        }
        Some(Self { ocp: wider, angles })
    }

    /// True if a trajectory of the problem as it was posed has such an angle at one of its bounds, or one that leaps by most of a turn: an angle
    /// that would pass a bound may do so before it comes there.
    #[must_use]
    pub fn are_stopped(&self, posed: &Trajectory) -> bool {
        posed.phases.iter().zip(&self.angles).any(|(found, angles)| {
            let angles = angles.iter().enumerate().filter_map(|(j, angle)| Some((j, (*angle)?)));
            let mut of_angles = angles.map(|(j, angle)| (course(found, j), angle));
            of_angles.any(|(course, angle)| {
                let is_at_bound = |u: f64| angle.bounds.excess(u) >= -AT_BOUND * angle.turn;
                course.iter().any(|(_, u)| is_at_bound(*u)) || leaps(&course, angle.turn)
            })
        })
    }

    /// A trajectory with wider bounds as one of the problem as it was posed.
    ///
    /// # Errors
    /// [`OcpError::Mesh`] when polynomials and meshes do not fit.
    pub fn as_posed(&self, wider: &Trajectory) -> Result<Trajectory, OcpError> {
        let phases = wider.phases.iter().zip(&self.angles).map(|(found, angles)| {
            let mut times = Vec::new();
            for (j, angle) in angles.iter().enumerate() {
                if let Some(angle) = angle {
                    add_passages(found, j, angle, &mut times);
                }
            }
            times.sort_by(f64::total_cmp);
            let mut phase = if times.is_empty() { found.clone() } else { found.divided_at(&times)? };
            back_between_bounds(&mut phase, angles);
            Ok(phase)
        });
        let phases = phases.collect::<Result<_, OcpError>>()?;
        Ok(Trajectory { phases, ..wider.clone() })
    }
}

impl Angle {
    /// Full turns by which an angle is off its bounds, by more than rounding.
    fn turns_off(&self, u: f64, rounding: f64) -> f64 {
        match u {
            _ if u > self.bounds.upper + rounding => ((u - self.bounds.upper) / self.turn).ceil(),
            _ if u < self.bounds.lower - rounding => -((self.bounds.lower - u) / self.turn).ceil(),
            _ => 0.0,
        }
    }
}

/// Adds the times at which an angle comes to be another number of turns off its bounds.
fn add_passages(found: &PhaseTrajectory, control: usize, angle: &Angle, times: &mut Vec<f64>) {
    let (breaks, nu) = (found.control.breaks(), found.control.dimension());
    let mut u = vec![0.0; nu];
    for (k, segment) in found.control.segments().iter().enumerate() {
        let mut off = |t: f64, rounding: f64| {
            found.control.evaluate_in(k, t, &mut u);
            angle.turns_off(u[control], rounding)
        };
        let points = BETWEEN * segment.values.len() / nu.max(1);
        let [begin, length] = [breaks[k], breaks[k + 1] - breaks[k]];
        for p in 0..points {
            let at = |p: usize| begin + length * p as f64 / points as f64;
            let [mut a, mut b] = [at(p), at(p + 1)];
            let rounding = ROUNDING * angle.turn;
            if off(a, rounding) == off(b, rounding) {
                continue;
            }
            let first = off(a, 0.0);
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (a + b);
                if off(middle, 0.0) == first { a = middle } else { b = middle }
            }
            let room = ROUNDING * length;
            if b > begin + room && b < breaks[k + 1] - room {
                times.push(b);
            }
        }
    }
}

/// Takes full turns off the angles of each piece until they are between their bounds.
fn back_between_bounds(phase: &mut PhaseTrajectory, angles: &[Option<Angle>]) {
    let nu = angles.len();
    let mut middle = vec![0.0; nu];
    let mut turns = Vec::new();
    for (k, ends) in phase.control.breaks().windows(2).enumerate() {
        phase.control.evaluate_in(k, 0.5 * (ends[0] + ends[1]), &mut middle);
        let off = |(u, angle): (&f64, &Option<Angle>)| {
            angle.as_ref().map_or(0.0, |a| a.turn * a.turns_off(*u, ROUNDING * a.turn))
        };
        let off: Vec<f64> = middle.iter().zip(angles).map(off).collect();
        let nodes = phase.control.segments()[k].values.len() / nu.max(1);
        turns.extend(std::iter::repeat_n(off, nodes));
    }
    let mut turns = turns.into_iter();
    phase.control = phase.control.map_nodes(nu, |wider, posed| {
        posed.copy_from_slice(wider);
        for ((u, off), angle) in posed.iter_mut().zip(turns.next().unwrap_or_default()).zip(angles) {
            if let Some(angle) = angle {
                *u -= off;
                // The end of an interval is at the bound to rounding.
                if angle.bounds.excess(*u) <= ROUNDING * angle.turn {
                    *u = angle.bounds.clamp(*u);
                }
            }
        }
    });
}

/// Per control of a phase, the full turn of what has cosines and sines of it alone, if its bounds leave that.
fn of_controls(phase: &Phase) -> Vec<Option<Angle>> {
    let is_between = |control: &Variable| (control.bounds.upper - control.bounds.lower).is_finite();
    if !phase.controls.iter().any(is_between) {
        return vec![None; phase.controls.len()];
    }
    let formulas = phase.functions().map(|f| f.formula()).collect::<Result<Vec<_>, _>>();
    let turn = |control: usize| {
        let mut found: Vec<[f64; 2]> = Vec::new();
        for formula in formulas.as_ref().ok()? {
            found.extend(angles(formula, phase.states.len() + control)?.into_iter().flatten());
        }
        // A cosine alone goes back the way it came: see `by_cosine`.
        if found.iter().all(|of| *of == found[0]) {
            return None;
        }
        let least = found.iter().map(|[slope, _]| slope.abs()).fold(f64::INFINITY, f64::min);
        let is_multiple = |slope: f64| (slope / least - (slope / least).round()).abs() <= ROUNDING;
        found.iter().all(|[slope, _]| is_multiple(slope.abs())).then_some(TAU / least)
    };
    let controls = phase.controls.iter().enumerate();
    let angle = controls.map(|(j, control)| {
        let Bounds { lower, upper } = control.bounds;
        let turn = turn(j).filter(|_| is_between(control))?;
        (upper - lower >= (1.0 - ROUNDING) * turn).then_some(Angle { turn, bounds: control.bounds })
    });
    angle.collect()
}

/// A control at its nodes, with their places in the phase.
fn course(found: &PhaseTrajectory, control: usize) -> Vec<(f64, f64)> {
    let (start, duration) = (found.initial_time, found.final_time - found.initial_time);
    let width = found.control.dimension();
    let segments = found.control.segments().iter().enumerate();
    let nodes = segments.flat_map(|(k, s)| {
        let values = s.values.iter().skip(control).step_by(width.max(1));
        found.control.node_times(k).zip(values).map(|(t, u)| ((t - start) / duration, *u))
    });
    nodes.collect()
}

/// Says whether an angle changes by most of a turn within a short part of its course.
fn leaps(course: &[(f64, f64)], turn: f64) -> bool {
    course.iter().enumerate().any(|(k, (from, u))| {
        let mut near = course[k..].iter().take_while(|(to, _)| to - from <= SHORT);
        near.any(|(_, other)| (other - u).abs() >= LEAP * turn)
    })
}
