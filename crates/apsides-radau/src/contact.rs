//! Contacts: path constraint rows without controls that touch their bounds in one instant.
//!
//! There the multiplier of the row is an impulse and the costates jump, which no polynomial follows. A few active nodes between
//! inactive ones are taken for a contact: the next mesh has an interval end at the extremum of the row, where the row is held at
//! its bound, and the solution is smooth on both sides. The end stands in the right place when the rate of the row vanishes
//! there. A row that is held too early or too late has its extremum farther on than that place, so that a half of its distance
//! is a first step; the secant method for the rate follows.

use apsides_ad::NodeFunction;
use apsides_nlp::SolveReport;
use apsides_ocp::{Contact, Ocp, Phase, PhaseTrajectory, PiecewisePolynomial, TouchPoint, Trajectory};

use crate::activity::{COLLAPSED, CROSSING, Class, Kind, Quantity, Sample, Solution, rows_without_controls, samples};
use crate::transcription::Transcription;
use crate::{RadauError, RadauSettings};

/// A rate of the row at its contact, times the duration of the phase and relative to its scale, below which the contact is in
/// the right place.
const SETTLED: f64 = 1e-6;

/// A contact that moves by less than this part of the phase leaves the errors beside it meaningful.
const SMALL_MOVE: f64 = 1e-4;

/// Most meshes for the sake of contacts.
const MOST_MOVES: usize = 12;

/// The nodes that were no contact are looked at again when they are closer than this part of what they were.
const CLOSER: f64 = 0.25;

/// Inactive nodes on both sides of a contact, at least: closer ones belong to an arc.
const APART: usize = 3;

/// Looks per collocation point for extrema along an interval.
const LOOKS: usize = 4;

/// Multipliers of the wrong sign, times the scale of the row and relative to that of the objective, from which on there is no
/// contact.
const WRONG_SIGN: f64 = 1e-6;

/// Secant steps are at most this part of the distance to the extremum.
const LONGEST_STEP: f64 = 1.5;

/// Relative multipliers below are no evidence of a contact.
const NO_EVIDENCE: f64 = 1e-5;

/// Bisections between two looks.
const BISECTIONS: usize = 60;

/// A touch point of a mesh to be.
#[derive(Clone, Copy)]
pub(crate) struct Touch {
    /// Normalised time.
    pub(crate) at: f64,
    pub(crate) row: usize,
    pub(crate) upper: bool,
}

/// A contact on the mesh to be solved next.
#[derive(Clone, Copy)]
struct Tracked {
    phase: usize,
    touch: Touch,
    /// Distance of the nodes around it when it was found.
    gap: f64,
    /// Normalised time on an earlier mesh, and rate of the row there.
    before: Option<(f64, f64)>,
}

/// What was taken for a contact and is none.
struct Refuted {
    phase: usize,
    row: usize,
    at: f64,
    gap: f64,
}

/// The contacts of a solve from mesh to mesh.
pub(crate) struct Contacts {
    tracked: Vec<Tracked>,
    refuted: Vec<Refuted>,
    moves: usize,
}

/// What follows for the next mesh.
pub(crate) struct NextContacts {
    /// Whether the contacts of the mesh are those of the trajectory and stand where they should.
    pub(crate) settled: bool,
    /// Per phase, in order.
    pub(crate) touch_points: Vec<Vec<Touch>>,
    /// Phase and interval of errors that come from a contact in the wrong place.
    spared: Vec<(usize, usize)>,
    /// Impulses of new contacts, and the nodes that they were spread over.
    new: Vec<New>,
}

struct New {
    phase: usize,
    contact: Contact,
    /// Interval and index within it.
    nodes: Vec<(usize, usize)>,
}

impl Contacts {
    pub(crate) fn new(enabled: bool) -> Self {
        Self { tracked: Vec::new(), refuted: Vec::new(), moves: if enabled { MOST_MOVES } else { 0 } }
    }

    /// Looks for no more contacts.
    pub(crate) fn give_up(&mut self) {
        *self = Self::new(false);
    }

    /// Compares the contacts of the mesh with the trajectory on it, and looks for new ones.
    pub(crate) fn step(
        &mut self,
        ocp: &Ocp,
        nlp: &Transcription,
        report: &SolveReport,
        trajectory: &Trajectory,
        settings: &RadauSettings,
    ) -> NextContacts {
        let mut next = NextContacts {
            settled: true,
            touch_points: vec![Vec::new(); ocp.phases.len()],
            spared: Vec::new(),
            new: Vec::new(),
        };
        if self.moves == 0 {
            for (touch_points, t) in next.touch_points.iter_mut().zip(&trajectory.phases) {
                let fractions = t.mesh.fractions();
                let touch = |c: &TouchPoint| Touch { at: fractions[c.end], row: c.row, upper: c.upper };
                touch_points.extend(t.mesh.touch_points().iter().map(touch));
            }
            return next;
        }
        let past = std::mem::take(&mut self.tracked);
        let solution = Solution { report, curvatures: &[], objective: nlp.scaling.objective.abs() };
        for (k, (phase, t)) in ocp.phases.iter().zip(&trajectory.phases).enumerate() {
            for q in rows_without_controls(phase) {
                let Some(mut course) = RowCourse::new(phase, t, &trajectory.parameters, &q) else { continue };
                let past: Vec<&Tracked> =
                    past.iter().filter(|c| c.phase == k && c.touch.row == course.row).collect();
                let largest_wrong = WRONG_SIGN * solution.objective / course.scale;
                self.known(k, &past, &mut course, (settings, largest_wrong), &mut next);
                let (samples, _) = samples(&q, &nlp.layout.phases[k], t, &solution);
                self.found(k, &samples, &mut course, report, nlp, &mut next);
            }
        }
        self.moves -= usize::from(!next.settled);
        self.tracked.sort_by(|a, b| a.touch.at.total_cmp(&b.touch.at));
        for c in &self.tracked {
            next.touch_points[c.phase].push(c.touch);
        }
        next
    }

    /// The contacts of a row that the mesh has.
    fn known(
        &mut self,
        phase: usize,
        past: &[&Tracked],
        course: &mut RowCourse<'_>,
        (settings, largest_wrong): (&RadauSettings, f64),
        next: &mut NextContacts,
    ) {
        let (row, t) = (course.row, course.trajectory);
        let duration = t.final_time - t.initial_time;
        let touch_points = t.mesh.touch_points().iter().filter(|c| c.row == row);
        for (k, &TouchPoint { end, upper, .. }) in touch_points.enumerate() {
            let at = t.mesh.fractions()[end];
            let earlier = past.get(k).copied();
            let gap = earlier.map_or(f64::INFINITY, |c| c.gap);
            let beside = [end - 1, end];
            let peak = course.only_peak(beside, upper, settings.path_tolerance * course.scale);
            let wrong = |c: &Contact| if upper { -c.multiplier } else { c.multiplier };
            let contact = t.contacts.iter().find(|c| c.end == end && c.row == row);
            let is_wrong = contact.is_some_and(|c| wrong(c) > largest_wrong);
            let Some(peak) = peak.filter(|_| !is_wrong) else {
                self.refuted.push(Refuted { phase, row, at, gap });
                next.settled = false;
                continue;
            };
            let mut tracked = Tracked { phase, touch: Touch { at, row, upper }, gap, before: None };
            let rate = course.excess(end, t.control.breaks()[end], upper).rate * duration / course.scale;
            if rate.abs() > SETTLED {
                next.settled = false;
                tracked.touch.at = at + step(at, rate, peak - at, earlier.and_then(|c| c.before));
                tracked.before = Some((at, rate));
                if (peak - at).abs() > SMALL_MOVE {
                    next.spared.extend(beside.map(|interval| (phase, interval)));
                }
            }
            self.tracked.push(tracked);
        }
    }

    /// New contacts of a row: a few active nodes between inactive ones.
    fn found(
        &mut self,
        phase: usize,
        samples: &[Sample],
        course: &mut RowCourse<'_>,
        report: &SolveReport,
        nlp: &Transcription,
        next: &mut NextContacts,
    ) {
        let (p, t, row) = (&nlp.layout.phases[phase], course.trajectory, course.row);
        let known: Vec<usize> =
            p.mesh.touch_points().iter().filter(|c| c.row == row).map(|c| p.touch_node(c)).collect();
        let mut first = 1;
        while first + 1 < samples.len() {
            let class = samples[first].class;
            let count = samples[first..].iter().take_while(|s| s.class == class).count();
            let run = first..first + count;
            first = run.end;
            let inner = run.end < samples.len() && samples[run.start - 1].class != class;
            let around = run.start.saturating_sub(APART)..(run.end + APART).min(samples.len());
            let is_alone = around.filter(|i| !run.contains(i)).all(|i| samples[i].class == Class::Between);
            let evident = samples[run.clone()].iter().any(|s| s.slope.abs() > NO_EVIDENCE);
            let is_known = samples[run.clone()].iter().any(|s| known.contains(&s.node));
            if class == Class::Between || count > CROSSING || !inner || !is_alone || !evident || is_known {
                continue;
            }
            let upper = class == Class::Upper;
            let (before, after) = (&samples[run.start - 1], &samples[run.end]);
            let gap = after.fraction - before.fraction;
            let Some(at) = course.largest_peak(before, after, upper) else { continue };
            let again = |r: &Refuted| {
                r.phase == phase && r.row == row && (r.at - at).abs() < r.gap && gap > CLOSER * r.gap
            };
            if !(COLLAPSED..1.0 - COLLAPSED).contains(&at) || self.refuted.iter().any(again) {
                continue;
            }
            next.settled = false;
            next.spared.extend((before.interval..=after.interval).map(|k| (phase, k)));
            self.tracked.push(Tracked { phase, touch: Touch { at, row, upper }, gap, before: None });
            let nodes = samples[run].iter().map(|s| s.node);
            let multiplier =
                nodes.clone().map(|n| report.constraint_multipliers[p.path_row(n) + row]).sum();
            let end = nearest(t.mesh.fractions(), at);
            let nodes = nodes.map(|n| (p.nodes[n].interval, p.nodes[n].local)).collect();
            next.new.push(New { phase, contact: Contact { end, row, multiplier }, nodes });
        }
    }
}

impl NextContacts {
    /// The trajectory without errors that a better place of the contacts removes.
    pub(crate) fn spared(&self, mut trajectory: Trajectory) -> Trajectory {
        for &(phase, interval) in &self.spared {
            trajectory.phases[phase].interval_errors[interval] = 0.0;
        }
        trajectory
    }

    /// The trajectory with the impulses of new contacts instead of the multipliers at their nodes, to start from.
    ///
    /// # Errors
    /// None: the polynomials keep their sizes.
    pub(crate) fn start(&self, mut trajectory: Trajectory) -> Result<Trajectory, RadauError> {
        for new in &self.new {
            let t = &mut trajectory.phases[new.phase];
            t.contacts.push(new.contact);
            let Some(path) = &t.path_multipliers else { continue };
            let mut segments = path.segments().to_vec();
            for (interval, local) in &new.nodes {
                segments[*interval].values[local * path.dimension() + new.contact.row] = 0.0;
            }
            let path = PiecewisePolynomial::new(path.dimension(), path.breaks().to_vec(), segments)?;
            t.path_multipliers = Some(path);
        }
        Ok(trajectory)
    }
}

/// Change of the time of a contact at `at` where the row has this rate and its extremum is `miss` later.
fn step(at: f64, rate: f64, miss: f64, before: Option<(f64, f64)>) -> f64 {
    let secant =
        before.map_or(f64::NAN, |(at_before, rate_before)| rate * (at - at_before) / (rate_before - rate));
    let is_plausible = (0.0..LONGEST_STEP).contains(&(secant / miss));
    if is_plausible { secant } else { 0.5 * miss }
}

fn nearest(fractions: &[f64], at: f64) -> usize {
    let distance = |k: &usize| (fractions[*k] - at).abs();
    (0..fractions.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
}

/// A path constraint row along the polynomials of a phase.
struct RowCourse<'a> {
    trajectory: &'a PhaseTrajectory,
    parameters: &'a [f64],
    function: &'a dyn NodeFunction,
    /// Index among the rows of the phase, and among the outputs of the function.
    row: usize,
    output: usize,
    bounds: apsides_ocp::Bounds,
    scale: f64,
    inputs: Vec<f64>,
    rates: Vec<f64>,
    values: Vec<f64>,
    entries: Vec<f64>,
}

/// Value and rate of a row, positive towards and beyond its bound.
#[derive(Clone, Copy)]
struct Excess {
    value: f64,
    rate: f64,
}

impl<'a> RowCourse<'a> {
    fn new(phase: &'a Phase, trajectory: &'a PhaseTrajectory, parameters: &'a [f64], q: &Quantity<'a>) -> Option<Self> {
        let Kind::Row(row) = q.kind else { return None };
        let mut first = 0;
        let path = phase.path.iter().find(|c| {
            first += c.rows.len();
            row < first
        })?;
        let function = path.function.as_ref();
        Some(Self {
            trajectory,
            parameters,
            function,
            row,
            output: row + path.rows.len() - first,
            bounds: q.variable.bounds,
            scale: q.variable.size().unwrap_or(1.0),
            inputs: vec![0.0; function.inputs()],
            rates: vec![0.0; phase.states.len()],
            values: vec![0.0; function.outputs()],
            entries: vec![0.0; function.pattern().jacobian_len()],
        })
    }

    fn excess(&mut self, interval: usize, time: f64, upper: bool) -> Excess {
        let t = self.trajectory;
        let (x, rest) = self.inputs.split_at_mut(self.rates.len());
        let (u, rest) = rest.split_at_mut(t.control.dimension());
        t.state.evaluate_in(interval, time, x);
        t.state.derivative_in(interval, time, &mut self.rates);
        t.control.evaluate_in(interval, time, u);
        let count = rest.len() - 1;
        rest[..count].copy_from_slice(&self.parameters[..count]);
        rest[count] = time;
        self.function.jacobian(&self.inputs, &mut self.values, &mut self.entries);
        let pattern = self.function.pattern();
        let mut rate = 0.0;
        for ((r, c), v) in pattern.jacobian_entries().zip(&self.entries) {
            if r == self.output {
                let of_input = self.rates.get(c).copied();
                rate += v * of_input.unwrap_or(if c + 1 == self.inputs.len() { 1.0 } else { 0.0 });
            }
        }
        let value = self.values[self.output];
        if upper {
            Excess { value: value - self.bounds.upper, rate }
        } else {
            Excess { value: self.bounds.lower - value, rate: -rate }
        }
    }

    /// Times of the maxima of the excess along intervals, and its values there; the values at both ends.
    fn peaks(&mut self, intervals: std::ops::RangeInclusive<usize>, upper: bool) -> (Vec<(f64, f64)>, [f64; 2]) {
        let mut peaks = Vec::new();
        let mut ends = [f64::NAN; 2];
        let mut before: Option<(f64, Excess)> = None;
        for k in intervals {
            let (start, end) = (self.trajectory.state.breaks()[k], self.trajectory.state.breaks()[k + 1]);
            let looks = LOOKS * self.trajectory.mesh.points()[k].max(2);
            for i in 0..=looks {
                let share = i as f64 / looks as f64;
                let time = if i == looks { end } else { start + share * (end - start) };
                let here = self.excess(k, time, upper);
                if let Some((low, earlier)) = before.filter(|(_, e)| e.rate > 0.0 && here.rate <= 0.0) {
                    let (mut low, mut high, mut value) = (low, time, earlier.value.max(here.value));
                    for _ in 0..BISECTIONS {
                        let middle = 0.5 * (low + high);
                        let e = self.excess(k, middle, upper);
                        value = e.value;
                        if e.rate > 0.0 { low = middle } else { high = middle }
                    }
                    peaks.push((0.5 * (low + high), value));
                }
                if before.is_none() {
                    ends[0] = here.value;
                }
                ends[1] = here.value;
                before = Some((time, here));
            }
        }
        (peaks, ends)
    }

    /// Normalised time of the extremum beside a contact, if there is one alone that counts.
    fn only_peak(&mut self, beside: [usize; 2], upper: bool, tolerance: f64) -> Option<f64> {
        let (peaks, ends) = self.peaks(beside[0]..=beside[1], upper);
        let beyond = peaks.iter().filter(|(_, value)| *value > tolerance).count();
        let largest = peaks.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let is_only = beyond <= 1 && ends.iter().all(|e| *e <= tolerance) && largest.1 >= -tolerance;
        is_only.then(|| self.fraction(largest.0))
    }

    /// Normalised time of the largest extremum between two nodes.
    fn largest_peak(&mut self, before: &Sample, after: &Sample, upper: bool) -> Option<f64> {
        let (peaks, _) = self.peaks(before.interval..=after.interval, upper);
        let inside = peaks
            .into_iter()
            .map(|(time, value)| (self.fraction(time), value))
            .filter(|(f, _)| (before.fraction..=after.fraction).contains(f));
        inside.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(f, _)| f)
    }

    fn fraction(&self, time: f64) -> f64 {
        let t = self.trajectory;
        (time - t.initial_time) / (t.final_time - t.initial_time)
    }
}
