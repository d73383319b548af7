//! The next division of the phases from what the last solution lacks.
//!
//! A segment whose steps are not accurate gets more of them; one with a control that is too poor is divided, in a phase that began
//! with a single segment given more control points instead. Where a polynomial of higher degree oversteps bounds on controls between
//! its points, at a kink or a jump, it is replaced by a straight line, which cannot. Bounds on states that are overstepped become
//! rows at the control points inside the segment first.

use apsides_ocp::PhaseMesh;

use super::estimate::SegmentEstimate;
use super::plan::PhasePlan;
use super::settings::MultipleShootingSettings;
use crate::error::ShootingError;

/// Margin of the number of steps, since the order holds in the limit alone.
const STEP_MARGIN: f64 = 1.1;
/// Steps of a segment grow by at most this factor at once.
const MOST_GROWTH: f64 = 4.0;
/// An error so far below the tolerance lets half of the steps be saved.
const SPARE: f64 = 1e-6;
/// Most parts of a segment at once.
const MOST_PARTS: usize = 4;
/// Least width of a segment as a fraction of its phase: in a shorter one the tolerance of the solver leaves the control open.
const LEAST_WIDTH: f64 = 1e-6;
/// The same where bounds on controls are overstepped and nothing else: what the solver leaves open there oversteps, too.
const LEAST_OVERSTEPPED: f64 = 1e-4;
/// Control points of a straight line.
const LINE: usize = 2;

/// The reasons for the next solve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Wants {
    /// A condition of an accurate solution is not met.
    pub(crate) accuracy: bool,
    /// Bounds on controls are overstepped between control points.
    pub(crate) overstepped: bool,
}

/// The next plan of a phase, which started from a mesh; `share` is the gain that a segment may leave.
pub(crate) fn refine(
    plan: &PhasePlan,
    estimates: &[SegmentEstimate],
    settings: &MultipleShootingSettings,
    order: i32,
    first: &PhaseMesh,
    share: f64,
) -> Result<(PhasePlan, Wants), ShootingError> {
    let single = first.intervals() == 1 && settings.max_points > 1;
    let first_points = first.points().iter().copied().fold(1, usize::max);
    let mut wants = Wants::default();
    let (mut fractions, mut points) = (vec![0.0], Vec::new());
    let (mut steps, mut inner_bounds) = (Vec::new(), Vec::new());
    for (k, e) in estimates.iter().enumerate() {
        let (start, end) = (plan.mesh.fractions()[k], plan.mesh.fractions()[k + 1]);
        let mut count = plan.mesh.points()[k];
        let tolerance = settings.path_tolerance;
        let mut poor = exceeds(e.gain, share) || exceeds(e.equality_excess, tolerance);
        wants.accuracy |= poor || exceeds(e.integration, settings.integration_tolerance);
        let mut inner = plan.inner_bounds[k];
        if exceeds(e.state_excess, tolerance) {
            wants.accuracy = true;
            poor |= inner || settings.constraint_points.unwrap_or(count) < 3;
            inner = true;
        }
        let overstepped = [e.control_excess, e.mixed_excess].map(|excess| exceeds(excess, tolerance));
        if overstepped.contains(&true) {
            wants.overstepped = true;
            let wide = end - start > 2.0 * LEAST_OVERSTEPPED;
            poor |= wide && (single || count <= LINE || overstepped[1]);
        }
        if !single && (overstepped[0] || (overstepped[1] && e.junction)) {
            count = count.min(LINE);
        } else if poor && !e.junction {
            // A line that was put to a junction which is elsewhere now.
            count = count.max(first_points);
        }
        let needed = needed_steps(plan.steps[k], e, settings, order);
        let parts = if !poor || (!single && end - start < 2.0 * LEAST_WIDTH) {
            1
        } else if single {
            count = (count + count.div_ceil(2)).min(settings.max_points.max(count));
            1
        } else {
            // A smooth control of d points costs h^(2 d + 1) and oversteps a row by h^d.
            let by_gain = (e.gain / share).max(1.0).powf(1.0 / (2 * count + 1) as f64);
            let by_excess = (e.mixed_excess / tolerance).max(1.0).powf(1.0 / count as f64);
            let ratio = by_gain.max(by_excess);
            if ratio.is_finite() { (ratio.ceil() as usize).clamp(2, MOST_PARTS) } else { 2 }
        };
        for j in 1..=parts {
            fractions.push(if j == parts { end } else { start + (end - start) * j as f64 / parts as f64 });
            points.push(count);
            steps.push(needed.div_ceil(parts).max(settings.least_steps));
            inner_bounds.push(inner);
        }
    }
    let mesh = PhaseMesh::new(fractions, points)?;
    Ok((PhasePlan { mesh, steps, inner_bounds }, wants))
}

impl PhasePlan {
    /// The same division with as many steps as each segment needs.
    pub(crate) fn with_steps(
        &self,
        estimates: &[SegmentEstimate],
        settings: &MultipleShootingSettings,
        order: i32,
    ) -> Self {
        let steps = self.steps.iter().zip(estimates);
        Self { steps: steps.map(|(s, e)| needed_steps(*s, e, settings, order)).collect(), ..self.clone() }
    }
}

fn needed_steps(
    steps: usize,
    estimate: &SegmentEstimate,
    settings: &MultipleShootingSettings,
    order: i32,
) -> usize {
    next_steps(steps, estimate.integration / settings.integration_tolerance, order).max(settings.least_steps)
}

/// Says whether a value exceeds a limit; one that is not a number exceeds every limit.
fn exceeds(value: f64, limit: f64) -> bool {
    value > limit || value.is_nan()
}

/// Steps that bring an error, as a multiple of what is allowed, within its tolerance. They are made longer with reluctance: where a
/// control is hardly determined, as along a singular arc, the next solve uses what error there is to its advantage.
fn next_steps(steps: usize, excess: f64, order: i32) -> usize {
    let factor = excess.powf(1.0 / f64::from(order));
    if excess > 1.0 || excess.is_nan() {
        let factor = if factor.is_nan() { MOST_GROWTH } else { (STEP_MARGIN * factor).min(MOST_GROWTH) };
        ((steps as f64 * factor).ceil() as usize).max(steps + 1)
    } else if excess < SPARE {
        steps.div_ceil(2)
    } else {
        steps
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan() -> PhasePlan {
        PhasePlan::new(PhaseMesh::uniform(3, 4).unwrap(), 2)
    }

    fn refined(estimates: [SegmentEstimate; 3]) -> (PhasePlan, Wants) {
        let plan = plan();
        refine(&plan, &estimates, &MultipleShootingSettings::default(), 8, &plan.mesh, 1e-10).unwrap()
    }

    #[test]
    fn what_is_met_stays() {
        let met = SegmentEstimate { integration: 1e-11, ..SegmentEstimate::default() };
        assert_eq!(refined([met.clone(), met.clone(), met]), (plan(), Wants::default()));
    }

    #[test]
    fn each_lack_has_its_remedy() {
        let steps = SegmentEstimate { integration: 1e-10 * 2f64.powi(8), ..SegmentEstimate::default() };
        let gain = SegmentEstimate { integration: 1e-11, gain: 1e-7, ..SegmentEstimate::default() };
        let line = SegmentEstimate { integration: 1e-11, control_excess: 1e-2, ..SegmentEstimate::default() };
        let (next, wants) = refined([steps, gain, line]);
        assert_eq!(next.mesh.points(), [4, 4, 4, 4, 2]);
        assert_eq!(next.steps, [5, 1, 1, 1, 2]);
        assert_eq!(wants, Wants { accuracy: true, overstepped: true });
        let bound = SegmentEstimate { integration: 1e-11, state_excess: 1e-3, ..SegmentEstimate::default() };
        let (next, _) = refined([bound.clone(), bound.clone(), bound]);
        assert_eq!(next.inner_bounds, [true; 3]);
        assert_eq!(next.mesh.intervals(), 3);
    }

    #[test]
    fn a_single_segment_gets_control_points() {
        let gain = SegmentEstimate { integration: 1e-11, gain: 1e-7, ..SegmentEstimate::default() };
        let plan = PhasePlan::new(PhaseMesh::uniform(1, 4).unwrap(), 2);
        let settings = MultipleShootingSettings::default();
        let (next, _) = refine(&plan, &[gain], &settings, 8, &plan.mesh, 1e-10).unwrap();
        assert_eq!(next.mesh, PhaseMesh::uniform(1, 6).unwrap());
    }

    #[test]
    fn steps_follow_the_order() {
        assert_eq!(next_steps(10, 2f64.powi(5), 5), 22);
        assert_eq!(next_steps(10, f64::INFINITY, 8), 40);
        assert_eq!(next_steps(10, f64::NAN, 8), 40);
        assert_eq!(next_steps(10, 0.5, 8), 10);
        assert_eq!(next_steps(10, 1e-5, 8), 10);
        assert_eq!(next_steps(9, 1e-7, 8), 5);
        assert_eq!(next_steps(1, 0.0, 8), 1);
    }
}
