//! A solution as a flight.

use std::ops::Range;

use apsides_ephemeris::{About, Column, Flight, Instant, Motion, Span};
use apsides_ocp::{Ocp, Phase, PhaseTrajectory, PiecewisePolynomial, Trajectory};

/// A change of a control at an end of an interval above this part of its range along the phase is a jump, if it changes the motion.
const JUMP: f64 = 0.02;
/// Rates that differ by less over the duration of a phase, relative to the largest value of their state or to themselves, are those of one motion.
const SAME_MOTION: f64 = 1e-9;
/// Phases whose ends are apart by less than this part of the time follow each other.
const SAME_TIME: f64 = 1e-12;

/// The trajectory of a problem: states and controls at any time from their polynomials, and the motion that a mission makes of them.
///
/// Where a control jumps a part of the flight ends. At another end of an interval of the mesh the controls are those of the later one, at the
/// end of a part those of its last.
pub struct SolvedFlight<'a> {
    trajectory: &'a Trajectory,
    arcs: Vec<Arc>,
    motion: Option<Box<dyn Motion + 'a>>,
    columns: Vec<Column>,
    /// Columns of the states and of the controls of each phase.
    places: Vec<[Vec<usize>; 2]>,
}

impl<'a> SolvedFlight<'a> {
    /// A trajectory of `ocp`, with the motion of a mission if it has one.
    #[must_use]
    pub fn new(ocp: &Ocp, trajectory: &'a Trajectory, motion: Option<Box<dyn Motion + 'a>>) -> Self {
        let mut columns: Vec<Column> = Vec::new();
        let mut place = |name: &str, unit: &str| {
            let column = Column::new(name, unit);
            columns.iter().position(|known| *known == column).unwrap_or_else(|| {
                columns.push(column);
                columns.len() - 1
            })
        };
        let mut of_phase = |phase: &Phase| {
            let states = phase.states.iter().map(|s| place(&s.variable.name, &s.variable.unit)).collect();
            let controls = phase.controls.iter().map(|u| place(&u.name, &u.unit)).collect();
            [states, controls]
        };
        let places = ocp.phases.iter().map(&mut of_phase).collect();
        Self { trajectory, arcs: arcs(ocp, trajectory), motion, columns, places }
    }

    fn control_at(&self, arc: &Arc, time: f64) -> Vec<f64> {
        let control = &self.trajectory.phases[arc.phase].control;
        let segment = control.segment_at(time).max(arc.segments.start).min(arc.segments.end - 1);
        let mut values = vec![0.0; control.dimension()];
        control.evaluate_in(segment, time, &mut values);
        values
    }
}

/// A part of a phase along which no control jumps: intervals of its controls, never none.
struct Arc {
    phase: usize,
    segments: Range<usize>,
    times: [f64; 2],
}

fn arcs(ocp: &Ocp, trajectory: &Trajectory) -> Vec<Arc> {
    let mut arcs: Vec<Arc> = Vec::new();
    for (k, (phase, found)) in ocp.phases.iter().zip(&trajectory.phases).enumerate() {
        let (breaks, count) = (found.control.breaks(), found.control.segments().len());
        let jumps = jumps(phase, found, &trajectory.parameters);
        let starts = std::iter::once(0).chain(jumps.iter().copied());
        for (first, last) in starts.zip(jumps.iter().copied().chain([count])) {
            let time = |at: usize| match at {
                0 => found.initial_time,
                at if at == count => found.final_time,
                at => breaks[at],
            };
            // What follows at a time that is the same but for rounding begins there.
            let before = arcs.last().map(|arc| arc.times[1]);
            let is_same = |end: &f64| (time(first) - end).abs() <= SAME_TIME * end.abs();
            let start = before.filter(is_same).unwrap_or(time(first));
            arcs.push(Arc { phase: k, segments: first..last, times: [start, time(last)] });
        }
    }
    arcs
}

/// The ends of intervals, but for those of the phase, at which a control jumps, and the rates of states with it.
fn jumps(phase: &Phase, found: &PhaseTrajectory, parameters: &[f64]) -> Vec<usize> {
    let (control, nu) = (&found.control, phase.controls.len());
    let widths: Vec<f64> = ranges(control).iter().map(|[low, high]| high - low).collect();
    let sizes: Vec<f64> = ranges(&found.state).iter().map(|[low, high]| low.abs().max(high.abs())).collect();
    let duration = found.final_time - found.initial_time;
    let rates = |time: f64, values: &[f64]| {
        let mut inputs = found.state_at(time);
        inputs.extend_from_slice(values);
        if phase.takes_parameters(phase.dynamics.as_ref()) {
            inputs.extend_from_slice(parameters);
        }
        inputs.push(time);
        let mut rates = vec![0.0; phase.dynamics.outputs()];
        phase.dynamics.value(&inputs, &mut rates);
        rates
    };
    let (mut before, mut after) = (vec![0.0; nu], vec![0.0; nu]);
    let mut is_jump = |k: &usize| {
        let time = control.breaks()[*k];
        control.evaluate_in(k - 1, time, &mut before);
        control.evaluate_in(*k, time, &mut after);
        let mut changes = before.iter().zip(&after).zip(&widths);
        let changes_motion = || {
            let rates = rates(time, &before).into_iter().zip(rates(time, &after));
            rates
                .zip(&sizes)
                .any(|((a, b), size)| (a - b).abs() * duration > SAME_MOTION * size.max(duration * a.abs()))
        };
        changes.any(|((a, b), width)| (a - b).abs() > JUMP * width) && changes_motion()
    };
    (1..control.segments().len()).filter(|k| is_jump(k)).collect()
}

/// The least and the largest value of each quantity at the nodes.
fn ranges(polynomials: &PiecewisePolynomial) -> Vec<[f64; 2]> {
    let n = polynomials.dimension();
    let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; n];
    for values in polynomials.segments().iter().flat_map(|s| s.values.chunks(n.max(1))) {
        for ([low, high], value) in ranges.iter_mut().zip(values) {
            (*low, *high) = (low.min(*value), high.max(*value));
        }
    }
    ranges
}

impl Flight for SolvedFlight<'_> {
    fn spans(&self) -> Vec<Span> {
        let name = |arc: &Arc| self.trajectory.phases[arc.phase].name.clone();
        self.arcs.iter().map(|arc| Span { name: name(arc), times: arc.times }).collect()
    }

    fn about(&self) -> Option<About> {
        self.motion.as_ref().map(|motion| motion.about())
    }

    fn own(&self) -> Vec<Column> {
        self.columns.clone()
    }

    fn at(&self, span: usize, time: f64) -> Instant {
        let mut own = vec![f64::NAN; self.columns.len()];
        let Some(arc) = self.arcs.get(span) else { return Instant { point: None, own } };
        let (phase, [of_states, of_controls]) = (arc.phase, &self.places[arc.phase]);
        let state = self.trajectory.phases[phase].state_at(time);
        let control = self.control_at(arc, time);
        let columns = of_states.iter().zip(&state).chain(of_controls.iter().zip(&control));
        columns.for_each(|(column, value)| own[*column] = *value);
        let point = self.motion.as_ref().and_then(|motion| motion.point(phase, time, &state, &control));
        Instant { point, own }
    }
}
