//! Gain, phase and delay margins of a loop.
//!
//! With the loop transfer function `L` and negative feedback: the gain margin is `1 / |L|` where the phase is -180 deg, the phase margin
//! is the angle from -180 deg where `|L| = 1`, the delay margin that angle over the frequency. They are those of a closed loop that
//! is stable; [`Margins::stable`] says whether it is.

use std::f64::consts::{PI, TAU};

use nalgebra::Complex;

use crate::error::{ControlError, ordered, positive};
use crate::response::Response;
use crate::state_space::StateSpace;

/// A point of the frequency response of a loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResponsePoint {
    /// Frequency, rad/s.
    pub frequency: f64,
    /// `|L|`.
    pub magnitude: f64,
    /// Phase, rad, without jumps along the grid; the first is in (-2 pi, 0].
    pub phase: f64,
}

/// A margin with the frequency where it is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Frequency, rad/s.
    pub frequency: f64,
    /// The margin.
    pub margin: f64,
}

/// Margins of one loop; `None` where the response has no such crossing in the range of frequencies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// Says whether the closed loop is stable; judged without the additional delay of a continuous loop.
    pub stable: bool,
    /// Least factor above 1 on the loop that reaches -1.
    pub gain: Option<Crossing>,
    /// Largest factor below 1 on the loop that reaches -1: how far the gain of a conditionally stable loop may fall.
    pub gain_reduction: Option<Crossing>,
    /// Least turn of the loop, either way, that reaches -1, rad.
    pub phase: Option<Crossing>,
    /// Least additional delay that reaches -1, s.
    pub delay: Option<Crossing>,
}

/// A loop of one input and one output for the analysis of its response.
#[derive(Clone, Debug)]
pub struct LoopAnalysis {
    system: StateSpace,
    response: Response,
    delay: f64,
    range: [f64; 2],
    points: usize,
}

impl LoopAnalysis {
    /// The loop over a range of frequencies (rad/s) with a number of points, evenly by logarithm, between which at most one crossing of a
    /// kind is seen. Sampled loops are cut at the Nyquist frequency `pi / T`. A continuous loop may have a delay (s) besides its states.
    ///
    /// # Errors
    /// [`ControlError::Dimension`] where the loop has several channels or fewer than two points, [`ControlError::Limits`] and
    /// [`ControlError::Parameter`] where the range is not positive and in order or the delay negative, or a sampled loop has one: that goes
    /// into [`StateSpace::sampled`].
    pub fn new(
        system: &StateSpace,
        delay: f64,
        range: [f64; 2],
        points: usize,
    ) -> Result<Self, ControlError> {
        let [_, inputs, outputs] = system.size();
        for (what, found) in [("inputs of one loop", inputs), ("outputs of one loop", outputs)] {
            if found != 1 {
                return Err(ControlError::Dimension { what, expected: 1, found });
            }
        }
        if points < 2 {
            return Err(ControlError::Dimension { what: "points of a response", expected: 2, found: points });
        }
        crate::error::not_negative("delay in s", delay)?;
        if delay > 0.0 && system.sample_time().is_some() {
            let allowed = "0 of a sampled loop, whose delay is in its states";
            return Err(ControlError::Parameter { what: "delay in s", value: delay, allowed });
        }
        positive("least frequency", range[0])?;
        let nyquist = system.sample_time().map_or(f64::INFINITY, |t| PI / t);
        let range = ordered("frequencies of a response", [range[0], range[1].min(nyquist)])?;
        positive("largest frequency", range[1])?;
        Ok(Self { system: system.clone(), response: Response::new(system, 0, 0), delay, range, points })
    }

    fn at(&self, frequency: f64) -> Complex<f64> {
        let l = self.response.at(frequency);
        match self.system.sample_time() {
            // Real at the Nyquist frequency, but for round-off.
            Some(time) if frequency == PI / time => Complex::new(l.re, 0.0),
            Some(_) => l,
            None => l * Complex::new(0.0, -frequency * self.delay).exp(),
        }
    }

    fn frequency(&self, k: usize) -> f64 {
        let w = k as f64 / (self.points - 1) as f64;
        if k + 1 == self.points {
            return self.range[1];
        }
        self.range[0] * (self.range[1] / self.range[0]).powf(w)
    }

    /// The response on the grid.
    #[must_use]
    pub fn response(&self) -> Vec<ResponsePoint> {
        let mut points: Vec<ResponsePoint> = Vec::with_capacity(self.points);
        for k in 0..self.points {
            let frequency = self.frequency(k);
            let l = self.at(frequency);
            let (magnitude, mut phase) = (l.norm(), l.arg());
            match points.last() {
                Some(before) => phase += TAU * ((before.phase - phase) / TAU).round(),
                None if phase > 0.0 => phase -= TAU,
                None => {}
            }
            points.push(ResponsePoint { frequency, magnitude, phase });
        }
        points
    }

    /// The margins.
    ///
    /// # Errors
    /// As [`StateSpace::closed`] and [`StateSpace::is_stable`].
    pub fn margins(&self) -> Result<Margins, ControlError> {
        let stable = self.system.closed(1.0)?.is_stable()?;
        let mut margins = Margins { stable, gain: None, gain_reduction: None, phase: None, delay: None };
        let mut before = (self.frequency(0), self.at(self.frequency(0)));
        for k in 1..self.points {
            let now = (self.frequency(k), self.at(self.frequency(k)));
            // The negative real axis is crossed where the imaginary part changes sign to the left of zero.
            let turned = |f: f64| self.at(f).im;
            if before.1.im * now.1.im < 0.0 || now.1.im == 0.0 {
                let frequency = if now.1.im == 0.0 { now.0 } else { bisect(before.0, now.0, turned) };
                let l = self.at(frequency);
                if l.re < 0.0 && l.im.abs() <= 1e-6 * l.re.abs() {
                    let found = Crossing { frequency, margin: -1.0 / l.re };
                    if found.margin >= 1.0 {
                        keep(&mut margins.gain, found, |new, old| new < old);
                    } else {
                        keep(&mut margins.gain_reduction, found, |new, old| new > old);
                    }
                }
            }
            let excess = |f: f64| self.at(f).norm() - 1.0;
            if (before.1.norm() - 1.0) * (now.1.norm() - 1.0) <= 0.0 && now.1.norm() != 1.0 {
                let frequency = bisect(before.0, now.0, excess);
                // Angle from -1 against the sense of a delay, in [0, 2 pi).
                let lead = (self.at(frequency).arg() + PI).rem_euclid(TAU);
                let turn = lead.min(TAU - lead);
                keep(&mut margins.phase, Crossing { frequency, margin: turn }, |new, old| new < old);
                let delay = Crossing { frequency, margin: lead / frequency };
                keep(&mut margins.delay, delay, |new, old| new < old);
            }
            before = now;
        }
        Ok(margins)
    }
}

fn keep(place: &mut Option<Crossing>, found: Crossing, better: impl Fn(f64, f64) -> bool) {
    if place.is_none_or(|old| better(found.margin, old.margin)) {
        *place = Some(found);
    }
}

/// A zero between two points of different sign.
fn bisect(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let start = f(low);
    if start == 0.0 {
        return low;
    }
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        if f(middle) * start > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bisection to the last bits of the frequency.
    const ROUNDING: f64 = 1e-12;

    /// Discretisation: the phase at the ends of the grid against its limits, rad.
    const ASYMPTOTE: f64 = 0.01;

    fn margins(system: &StateSpace, delay: f64) -> Margins {
        LoopAnalysis::new(system, delay, [1e-3, 1e3], 600).unwrap().margins().unwrap()
    }

    fn check(found: Option<Crossing>, frequency: f64, margin: f64) {
        let found = found.unwrap();
        assert!((found.frequency / frequency - 1.0).abs() < ROUNDING, "{found:?} {frequency}");
        assert!((found.margin / margin - 1.0).abs() < ROUNDING, "{found:?} {margin}");
    }

    #[test]
    fn three_lags() {
        // 1 / (s (s + 1) (s + 2)): gain margin 6 at sqrt 2 rad/s. |L| = 1 where w^2 (w^2 + 1) (w^2 + 4) = 1, which is
        // w^2 = 0.1989..., the positive root of v^3 + 5 v^2 + 4 v - 1.
        let open = StateSpace::of_transfer(&[1.0], &[1.0, 3.0, 2.0, 0.0], None).unwrap();
        let found = margins(&open, 0.0);
        assert!(found.stable && found.gain_reduction.is_none());
        check(found.gain, 2.0_f64.sqrt(), 6.0);
        let w = found.phase.unwrap().frequency;
        let v = w * w;
        assert!((v.powi(3) + 5.0 * v * v + 4.0 * v - 1.0).abs() < ROUNDING);
        let phase = PI / 2.0 - w.atan() - (w / 2.0).atan();
        check(found.phase, w, phase);
        check(found.delay, w, phase / w);
        let fast = StateSpace::of_transfer(&[7.0], &[1.0, 3.0, 2.0, 0.0], None).unwrap();
        assert!(!margins(&fast, 0.0).stable);
    }

    #[test]
    fn integrator_with_delay() {
        // k exp(-s tau) / s: gain margin pi / (2 k tau) at pi / (2 tau), phase margin pi/2 - k tau, delay margin pi/(2k) - tau.
        let (k, tau) = (2.0, 0.1);
        let open = StateSpace::of_transfer(&[k], &[1.0, 0.0], None).unwrap();
        let found = margins(&open, tau);
        check(found.gain, PI / (2.0 * tau), PI / (2.0 * k * tau));
        check(found.phase, k, PI / 2.0 - k * tau);
        check(found.delay, k, PI / (2.0 * k) - tau);
    }

    #[test]
    fn sampled_integrator() {
        // k T / (z - 1): closed pole 1 - k T, so gain margin 2 / (k T), at the Nyquist frequency, the end of the grid.
        let (k, t) = (1.0, 0.5);
        let open = StateSpace::of_transfer(&[k], &[1.0, 0.0], None).unwrap().sampled(t, 0.0).unwrap();
        check(margins(&open, 0.0).gain, PI / t, 2.0 / (k * t));
        // |L| = 1 where 2 sin(w T / 2) = k T; its phase is -pi/2 - w T / 2.
        let w = 2.0 / t * (0.5 * k * t).asin();
        let found = margins(&open, 0.0);
        assert!(found.stable);
        check(found.phase, w, PI / 2.0 - 0.5 * w * t);
        // With one sample of delay k T / (z (z - 1)): z^2 - z + g leaves the disk at g = 1, a margin of 2, with z = exp(i pi/3).
        let open = StateSpace::of_transfer(&[k], &[1.0, 0.0], None).unwrap().sampled(t, t).unwrap();
        check(margins(&open, 0.0).gain, PI / 3.0 / t, 2.0);
    }

    #[test]
    fn conditionally_stable_loop() {
        // 2 / (s - 1): stable for gains above 1/2, phase margin 60 deg at sqrt 3 rad/s.
        let open = StateSpace::of_transfer(&[2.0], &[1.0, -1.0], None).unwrap();
        let found = margins(&open, 0.0);
        assert!(found.stable);
        check(found.phase, 3.0_f64.sqrt(), PI / 3.0);
        // 2 (s + 1)^2 / s^3: s^3 + k (s + 1)^2 is stable for k > 1/2.
        let open = StateSpace::of_transfer(&[2.0, 4.0, 2.0], &[1.0, 0.0, 0.0, 0.0], None).unwrap();
        let found = margins(&open, 0.0);
        assert!(found.stable && found.gain.is_none());
        check(found.gain_reduction, 1.0, 0.25);
    }

    #[test]
    fn response_without_jumps() {
        let open = StateSpace::of_transfer(&[1.0], &[1.0, 3.0, 2.0, 0.0], None).unwrap();
        let response = LoopAnalysis::new(&open, 0.0, [1e-3, 1e3], 50).unwrap().response();
        assert!((response[0].phase + PI / 2.0).abs() < ASYMPTOTE);
        assert!((response[49].phase + 1.5 * PI).abs() < ASYMPTOTE);
        assert!((response[49].frequency, response.len()) == (1e3, 50));
    }

    #[test]
    fn refusals() {
        let g = StateSpace::of_transfer(&[1.0], &[1.0, 1.0], None).unwrap();
        let two = g.beside(&g).unwrap();
        assert!(LoopAnalysis::new(&two, 0.0, [0.1, 1.0], 10).is_err());
        assert!(LoopAnalysis::new(&g, -1.0, [0.1, 1.0], 10).is_err());
        assert!(matches!(
            LoopAnalysis::new(&g, 0.0, [1.0, 0.1], 10),
            Err(ControlError::Limits { lower: 1.0, upper: 0.1, .. })
        ));
        assert!(LoopAnalysis::new(&g, 0.0, [0.0, 0.1], 10).is_err());
        assert!(LoopAnalysis::new(&g, 0.0, [0.1, 1.0], 1).is_err());
        let sampled = g.sampled(0.1, 0.0).unwrap();
        assert!(LoopAnalysis::new(&sampled, 0.1, [0.1, 1.0], 10).is_err());
    }
}
