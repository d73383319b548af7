//! Masses whose momentum and inertia the capsule feels.
//!
//! Drives tell where the masses are at the samples of the law. Over a sample of the length `T`, from the position `p` with the speed `v` to the
//! position `p + w T`, a mass moves by the cubic that ends with the speed `w`,
//!
//! ```text
//! p(t) = p + v T s + (w - v) T (2 s^2 - s^3),     s = (t - t_k) / T
//! ```
//!
//! so that positions and speeds are continuous and the equations of the full masses
//! ([`MovingMassVehicle`] with six controls) apply. A mass that a drive stops within one sample swings out of its place by at most 4/27 of its way
//! in the sample before. A quasi-static mass is where it is to be from the start of the sample on: half a sample earlier.

use apsides_ad::{Dynamics, Scalar};
use apsides_control::controller::{Actuation, Controller};
use apsides_control::record::Sample;
use apsides_dynamics::MovingMassVehicle;

use super::drives::Drives;
use super::steering::SteeringLaw;

/// Controls over a sample: positions at its end, positions and speeds at its start, time of its start.
pub(super) type Stroke = [f64; 7];

/// Positions, speeds and accelerations at a time of a stroke.
fn motion<S: Scalar>(t: S, u: &[S; 7], sample_time: f64) -> [S; 6] {
    let [to_1, to_2, from_1, from_2, speed_1, speed_2, start] = *u;
    let s = (t - start) / sample_time;
    let one = |to: S, from: S, speed: S| {
        let gain = (to - from) / sample_time - speed;
        [
            from + (speed * s + gain * s * s * (S::from(2.0) - s)) * sample_time,
            speed + gain * s * (S::from(4.0) - s * 3.0),
            gain * (S::from(4.0) - s * 6.0) / sample_time,
        ]
    };
    let ([a, b, c], [d, e, f]) = (one(to_1, from_1, speed_1), one(to_2, from_2, speed_2));
    [a, d, b, e, c, f]
}

/// Positions at the end of a stroke.
pub(super) fn stroke_end(&[first, second, ..]: &Stroke) -> [f64; 2] {
    [first, second]
}

/// A sample with the positions of the masses at its time.
pub(super) fn positions_at(sample: &Sample<13, 7>, sample_time: f64) -> Sample<13, 2> {
    let [first, second, ..] = motion(sample.time, &sample.control, sample_time);
    let command = stroke_end(&sample.command);
    Sample { time: sample.time, state: sample.state, command, control: [first, second] }
}

/// The full model under strokes.
pub(super) struct FullMasses<'a> {
    vehicle: &'a MovingMassVehicle,
    sample_time: f64,
}

impl<'a> FullMasses<'a> {
    pub(super) fn new(vehicle: &'a MovingMassVehicle, sample_time: f64) -> Self {
        Self { vehicle, sample_time }
    }
}

impl Dynamics<13, 7> for FullMasses<'_> {
    fn rate<S: Scalar>(&self, t: S, x: &[S; 13], u: &[S; 7], p: &[S; 0]) -> [S; 13] {
        Dynamics::<13, 6>::rate(self.vehicle, t, x, &motion(t, u, self.sample_time), p)
    }
}

/// A law whose commands carry the time of their sample.
pub(super) struct StrokeLaw<L>(L);

impl<'a> StrokeLaw<SteeringLaw<'a>> {
    pub(super) fn new(law: SteeringLaw<'a>) -> Self {
        Self(law)
    }
}

impl<L: Controller<13, 2>> Controller<13, 7> for StrokeLaw<L> {
    fn command(&mut self, t: f64, measured: &[f64; 13]) -> Stroke {
        let [first, second] = self.0.command(t, measured);
        [first, second, 0.0, 0.0, 0.0, 0.0, t]
    }

    fn reached(&mut self, stroke: &Stroke) {
        self.0.reached(&stroke_end(stroke));
    }
}

/// Drives with the motion of the masses between samples.
pub(super) struct MovedDrives {
    drives: Drives,
    sample_time: f64,
    place: [f64; 2],
    speed: [f64; 2],
}

impl MovedDrives {
    /// Masses at rest where the drives are.
    pub(super) fn new(drives: Drives, sample_time: f64) -> Self {
        Self { place: drives.positions(), drives, sample_time, speed: [0.0; 2] }
    }
}

impl Actuation<7> for MovedDrives {
    fn advance(&mut self, &[first, second, .., start]: &Stroke) -> Stroke {
        let to = self.drives.advance(&[first, second]);
        let (from, speed) = (self.place, self.speed);
        self.place = to;
        self.speed = [0, 1].map(|k: usize| (to[k] - from[k]) / self.sample_time);
        [to[0], to[1], from[0], from[1], speed[0], speed[1], start]
    }

    fn saturated(&self) -> bool {
        self.drives.saturated()
    }

    fn met(&self) -> bool {
        self.drives.met()
    }
}

#[cfg(test)]
mod tests;
