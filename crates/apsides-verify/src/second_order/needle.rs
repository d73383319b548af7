//! A short time at the opposite bound of a control, where that costs nothing to first order.
//!
//! ```text
//! x+ = x + [f] d,      2 dJ  gains  2 ([H_x] x + [H_t] t + [H_p] p) d + ([H_x] [f] + |d[H]/dt|) d^2
//! ```
//!
//! `[.]` is the change from the control of the trajectory to the other one, `d` the time, and the last term is there at an end of the phase alone, where `[H]`
//! vanishes with a rate. It is the quadratic form in switching times (N. P. Osmolovskii and H. Maurer, Applications to Regular and Bang-Bang
//! Control, SIAM 2012, doi 10.1137/1.9781611972368, chapter 5) with an arc that has no length. Since the Hamiltonians are the same to a tolerance alone, a negative
//! direction shows no better trajectory, and a positive form is needed for a strict minimum.

use nalgebra::DMatrix;

use super::activity::Activity;
use super::arcs::Span;
use super::interval::Interval;
use super::stage::Coordinates;
use crate::optimality::{PhaseConditions, Place, Touch};

/// The interval without length of a touch, beside another one.
pub(super) fn interval(
    conditions: &mut PhaseConditions<'_>,
    parameters: &[f64],
    touch: &Touch,
    beside: &Interval,
    duration: f64,
) -> Interval {
    let ([own, other], costate_rates) = conditions.both_at(touch);
    let (nx, nu, np) = (conditions.equations.nx, conditions.equations.nu, conditions.equations.np);
    let change =
        |(a, b): (&Vec<f64>, &Vec<f64>)| -> Vec<f64> { b.iter().zip(a).map(|(b, a)| b - a).collect() };
    let (gradient, rates) = (change((&own.gradient, &other.gradient)), change((&own.rates, &other.rates)));
    let mut control_rates = vec![0.0; nu];
    conditions.found.control.derivative_in(touch.segment, touch.time, &mut control_rates);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let others = gradient[nx..nx + nu].iter().zip(&control_rates).enumerate();
    let through_controls: f64 =
        others.filter(|(j, _)| *j != touch.control).map(|(_, (g, rate))| g * rate).sum();
    let rate = dot(&gradient[..nx], &own.rates)
        + dot(&costate_rates, &rates[..nx])
        + through_controls
        + gradient.last().copied().unwrap_or(f64::NAN);
    let by_rate = match touch.part {
        Place::Start => rate.max(0.0),
        Place::Inside => 0.0,
        Place::End => (-rate).max(0.0),
    };
    // The other interval begins or ends here.
    let time = touch.time;
    let span = Span { segment: touch.segment, start: time, end: time, ..beside.span };
    let coordinates = Coordinates::new(conditions, parameters, span, time, duration);
    let slopes = coordinates.gradient(0.0, &gradient, false);
    let width = nx + 3 + np;
    let mut curvature = DMatrix::zeros(width, width);
    let without_controls = (0..slopes.len()).filter(|k| !(nx..nx + nu).contains(k));
    for (place, k) in (0..nx).chain(nx + 1..width).zip(without_controls) {
        curvature[(place, nx)] = slopes[k] * duration;
        curvature[(nx, place)] = slopes[k] * duration;
    }
    curvature[(nx, nx)] = (dot(&gradient[..nx], &rates) + by_rate) * duration * duration;
    let mut step = DMatrix::zeros(nx, width);
    step.view_mut((0, 0), (nx, nx)).fill_with_identity();
    for i in 0..nx {
        step[(i, nx)] = rates[i] * duration / conditions.scaling.states[i];
    }
    let mut integrals = DMatrix::zeros(rates.len() - nx, width);
    for (q, rate) in rates[nx..].iter().enumerate() {
        integrals[(q, nx)] = rate * duration;
    }
    Interval {
        span,
        curvature,
        instants: Vec::new(),
        step,
        rows: Vec::new(),
        integrals,
        controls: vec![Activity::Weak],
        weights: vec![1.0],
        legendre: f64::INFINITY,
        at_bounds: beside.at_bounds.clone(),
    }
}
