//! Actuators that follow a command within travel, rate and acceleration, late and with play; two masses on one rim.
//!
//! The state advances once per control step `T`. The position that is given back is that at the end of the step; the plant holds it over the
//! step. With an acceleration limit `a` the speed is the largest from which the drive stops at the target in whole steps: with
//! `D = distance / (a T^2)` and `n` the whole part of `(sqrt(1 + 8 D) - 1) / 2` it is `a T (D / (n + 1) + n / 2)`. So the drive neither
//! overshoots a resting command nor leaves its travel.

use std::f64::consts::TAU;

use crate::error::{ControlError, finite, limit, not_negative, ordered, positive, steps_of};

/// Settings of an actuator; lengths in m, or rad of one that turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActuatorSettings {
    /// Least and greatest position; infinite ones are allowed. Default: no limits.
    pub travel: [f64; 2],
    /// Largest speed, 1/s; default infinite.
    pub rate: f64,
    /// Largest acceleration, 1/s^2; default infinite.
    pub acceleration: f64,
    /// Time from a command to its effect, s; it acts at the first control step that is not earlier. Default 0.
    pub delay: f64,
    /// Full width of the play between drive and load; default 0.
    pub backlash: f64,
    /// Position at the start; default 0.
    pub start: f64,
}

impl Default for ActuatorSettings {
    fn default() -> Self {
        Self {
            travel: [f64::NEG_INFINITY, f64::INFINITY],
            rate: f64::INFINITY,
            acceleration: f64::INFINITY,
            delay: 0.0,
            backlash: 0.0,
            start: 0.0,
        }
    }
}

/// The limits that an actuator met in a control step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Saturation {
    /// The command was beyond the travel.
    pub travel: bool,
    /// The drive was slower than the command asked for.
    pub rate: bool,
}

/// An actuator with its state.
#[derive(Clone, Debug, PartialEq)]
pub struct Actuator {
    settings: ActuatorSettings,
    step: f64,
    drive: f64,
    speed: f64,
    load: f64,
    /// Commands on their way; the place of the oldest.
    waiting: Vec<f64>,
    oldest: usize,
    saturation: Saturation,
}

impl Actuator {
    /// An actuator at rest that advances by control steps of this length (s).
    ///
    /// # Errors
    /// [`ControlError::Parameter`], [`ControlError::Limits`]: control step not positive, limits not positive, travel not in order, delay or
    /// play negative, start not in the travel.
    pub fn new(settings: ActuatorSettings, control_step: f64) -> Result<Self, ControlError> {
        positive("control step in s", control_step)?;
        ordered("travel of the actuator", settings.travel)?;
        limit("rate of the actuator", settings.rate)?;
        limit("acceleration of the actuator", settings.acceleration)?;
        not_negative("delay of the actuator in s", settings.delay)?;
        not_negative("backlash of the actuator", settings.backlash)?;
        finite("start of the actuator", settings.start)?;
        if !(settings.travel[0]..=settings.travel[1]).contains(&settings.start) {
            let what = "start of the actuator";
            return Err(ControlError::Parameter {
                what,
                value: settings.start,
                allowed: "within its travel",
            });
        }
        let steps = steps_of("delay of the actuator in s", settings.delay, control_step)?;
        Ok(Self {
            settings,
            step: control_step,
            drive: settings.start,
            speed: 0.0,
            load: settings.start,
            waiting: vec![settings.start; steps],
            oldest: 0,
            saturation: Saturation { travel: false, rate: false },
        })
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &ActuatorSettings {
        &self.settings
    }

    /// Position of the load.
    #[must_use]
    pub fn position(&self) -> f64 {
        self.load
    }

    /// Speed of the drive over the last step.
    #[must_use]
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// The limits met in the last step.
    #[must_use]
    pub fn saturation(&self) -> Saturation {
        self.saturation
    }

    /// Advances by one control step toward a command and gives the position of the load. A command that is not finite gives NaN and
    /// leaves the state as it was.
    pub fn advance(&mut self, command: f64) -> f64 {
        if !command.is_finite() {
            return f64::NAN;
        }
        let command = if self.waiting.is_empty() {
            command
        } else {
            let old = std::mem::replace(&mut self.waiting[self.oldest], command);
            self.oldest = (self.oldest + 1) % self.waiting.len();
            old
        };
        let [lower, upper] = self.settings.travel;
        let target = command.clamp(lower, upper);
        let distance = target - self.drive;
        let speed = self.reachable_speed(distance);
        let wanted = distance / self.step;
        self.saturation = Saturation { travel: target != command, rate: speed != wanted };
        // At the target exactly, not but for round-off.
        self.drive =
            if speed == wanted { target } else { (self.drive + speed * self.step).clamp(lower, upper) };
        self.speed = speed;
        let play = 0.5 * self.settings.backlash;
        self.load = self.load.clamp(self.drive - play, self.drive + play);
        self.load
    }

    /// Speed of this step toward a target at a distance.
    fn reachable_speed(&self, distance: f64) -> f64 {
        let ActuatorSettings { rate, acceleration, .. } = self.settings;
        let mut magnitude = (distance.abs() / self.step).min(rate);
        if acceleration == f64::INFINITY {
            return magnitude.copysign(distance);
        }
        let change = acceleration * self.step;
        // Largest speed from which the drive stops in whole steps: n T a below it in n steps, and the rest of the way in one.
        let ways = distance.abs() / (change * self.step);
        let n = (0.5 * ((1.0 + 8.0 * ways).sqrt() - 1.0)).floor();
        let stopping = change * (ways / (n + 1.0) + 0.5 * n);
        if stopping.is_finite() {
            magnitude = magnitude.min(stopping);
        }
        magnitude.copysign(distance).clamp(self.speed - change, self.speed + change)
    }

    /// Puts drive and load to a position, at rest: a contact.
    fn stop_at(&mut self, position: f64) {
        self.load = position;
        let play = 0.5 * self.settings.backlash;
        self.drive = self.drive.clamp(position - play, position + play);
        self.speed = 0.0;
    }

    /// Sets it back to what it was before the first step.
    pub fn reset(&mut self) {
        (self.drive, self.speed, self.load) = (self.settings.start, 0.0, self.settings.start);
        self.waiting.fill(self.settings.start);
        self.oldest = 0;
        self.saturation = Saturation { travel: false, rate: false };
    }
}

/// Two masses on one rim that cannot pass each other.
#[derive(Clone, Debug, PartialEq)]
pub struct RimPair {
    actuators: [Actuator; 2],
    least_distance: f64,
    met: bool,
}

impl RimPair {
    /// Two actuators in rad, the first ahead of the second by less than a turn, and the least angle between them (rad).
    ///
    /// # Errors
    /// [`ControlError::Parameter`] where the angle is negative or the masses start closer than it.
    pub fn new(actuators: [Actuator; 2], least_distance: f64) -> Result<Self, ControlError> {
        not_negative("least angle between the masses in rad", least_distance)?;
        let distance = actuators[0].load - actuators[1].load;
        if !(least_distance..=TAU - least_distance).contains(&distance) {
            let what = "angle between the masses at the start in rad";
            let allowed = "from the least angle to a turn less the least angle";
            return Err(ControlError::Parameter { what, value: distance, allowed });
        }
        Ok(Self { actuators, least_distance, met: false })
    }

    /// The actuators.
    #[must_use]
    pub fn actuators(&self) -> &[Actuator; 2] {
        &self.actuators
    }

    /// Tells whether the masses touched in the last step.
    #[must_use]
    pub fn met(&self) -> bool {
        self.met
    }

    /// Advances both by one control step; where they would touch on the way, they stop there.
    pub fn advance(&mut self, command: &[f64; 2]) -> [f64; 2] {
        self.met = false;
        if !command.iter().all(|c| c.is_finite()) {
            return [f64::NAN; 2];
        }
        let before = [self.actuators[0].load, self.actuators[1].load];
        let after: [f64; 2] = std::array::from_fn(|k| self.actuators[k].advance(command[k]));
        let (old, new) = (before[0] - before[1], after[0] - after[1]);
        let allowed = new.clamp(self.least_distance, TAU - self.least_distance);
        if new == allowed {
            return after;
        }
        self.met = true;
        // The part of the step until the contact, on straight ways.
        let part = if new == old { 0.0 } else { ((allowed - old) / (new - old)).clamp(0.0, 1.0) };
        for k in 0..2 {
            self.actuators[k].stop_at(before[k] + part * (after[k] - before[k]));
        }
        [self.actuators[0].load, self.actuators[1].load]
    }

    /// Sets it back to what it was before the first step.
    pub fn reset(&mut self) {
        self.actuators.iter_mut().for_each(Actuator::reset);
        self.met = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Sums of some hundred steps.
    const ROUNDING: f64 = 1e-12;

    /// Discretisation: a share of a turn, counted in whole steps.
    const WHOLE_STEPS: f64 = 0.02;

    fn actuator(change: impl Fn(&mut ActuatorSettings)) -> Result<Actuator, ControlError> {
        let mut settings = ActuatorSettings::default();
        change(&mut settings);
        Actuator::new(settings, 0.1)
    }

    #[test]
    fn ideal_one_follows_at_once() {
        let mut ideal = actuator(|_| {}).unwrap();
        for command in [0.3, -5.0, 0.1 + 0.2] {
            assert_eq!(ideal.advance(command), command);
        }
    }

    #[test]
    fn rate_limit() {
        let mut slow = actuator(|s| s.rate = 0.5).unwrap();
        for k in 1..=19 {
            assert!((slow.advance(0.97) - 0.05 * f64::from(k)).abs() < ROUNDING);
            assert!(slow.saturation().rate);
        }
        assert_eq!(slow.advance(0.97), 0.97);
        assert!(!slow.saturation().rate);
    }

    #[test]
    fn travel() {
        let mut short = actuator(|s| s.travel = [-0.7, 0.5]).unwrap();
        assert_eq!(short.advance(2.0), 0.5);
        assert!(short.saturation().travel);
        assert_eq!(short.advance(-2.0), -0.7);
        assert_eq!(short.advance(0.2), 0.2);
        assert!(!short.saturation().travel);
    }

    #[test]
    fn delay_in_whole_steps() {
        for (delay, steps) in [(0.0, 0), (0.3, 3), (0.25, 3), (0.1 + 0.2, 3)] {
            let mut late = actuator(|s| s.delay = delay).unwrap();
            for k in 0..10 {
                let expected = f64::from((k - steps).max(0));
                assert_eq!(late.advance(f64::from(k)), expected, "{delay} {k}");
            }
        }
    }

    #[test]
    fn acceleration_limit_neither_overshoots_nor_dawdles() {
        let mut heavy = actuator(|s| {
            s.rate = 1.0;
            s.acceleration = 0.5;
            s.travel = [-1.0, 4.0];
        })
        .unwrap();
        let (mut speed, mut arrival) = (0.0, 0);
        for k in 1..=200 {
            let position = heavy.advance(4.0);
            assert!(position <= 4.0 && heavy.speed() <= 1.0);
            assert!((heavy.speed() - speed).abs() <= 0.05 + ROUNDING);
            speed = heavy.speed();
            if arrival == 0 && position == 4.0 {
                arrival = k;
            }
        }
        // The optimum of speeds that are held over a step: 20 steps up (1.05), 19 at full speed (1.9), 20 down (1.05); the last may
        // be left to the next step by round-off.
        assert!((59..=60).contains(&arrival), "{arrival}");
        // A command that turns back at full speed: the travel holds all the same.
        heavy.reset();
        let mut lowest = 0.0_f64;
        for k in 0..400 {
            lowest = lowest.min(heavy.advance(if k % 40 < 25 { -9.0 } else { -0.9 }));
        }
        assert!(lowest >= -1.0);
    }

    #[test]
    fn backlash_loop() {
        // A sine through a play of 0.4: the load lags by half the play on both branches and rests at each turn.
        let mut loose = actuator(|s| s.backlash = 0.4).unwrap();
        let mut rests = 0;
        let (mut before, mut drive_before) = (0.0, 0.0);
        for k in 0..400 {
            let t = 0.02 * std::f64::consts::PI * f64::from(k);
            let (drive, load) = (t.sin(), loose.advance(t.sin()));
            if k > 100 {
                if load == before {
                    rests += 1;
                    assert!((drive - load).abs() <= 0.2 + ROUNDING);
                } else {
                    let expected = drive - 0.2_f64.copysign(drive - drive_before);
                    assert!((load - expected).abs() < ROUNDING, "{k} {load} {expected}");
                }
                assert!(load.abs() <= 0.8 + ROUNDING);
            }
            (before, drive_before) = (load, drive);
        }
        // It rests while the sine falls from 1 to 0.6: acos(0.6) of each half turn, 29.5 %.
        let share = f64::from(rests) / 299.0;
        assert!((share - 0.6_f64.acos() / std::f64::consts::PI).abs() < WHOLE_STEPS, "{share}");
    }

    fn pair(least: f64) -> RimPair {
        let on_rim = |start| actuator(|s| (s.start, s.rate) = (start, 1.0)).unwrap();
        RimPair::new([on_rim(1.0), on_rim(0.0)], least).unwrap()
    }

    #[test]
    fn masses_on_the_rim_stop_where_they_touch() {
        let mut masses = pair(0.25);
        for _ in 0..3 {
            masses.advance(&[0.0, 1.0]);
            assert!(!masses.met());
        }
        let found = masses.advance(&[0.0, 1.0]);
        assert!(masses.met());
        assert!((found[0] - 0.625).abs() < ROUNDING && (found[1] - 0.375).abs() < ROUNDING);
        assert_eq!(masses.actuators()[0].speed(), 0.0);
        // Around the other way they meet behind.
        let mut masses = pair(0.25);
        let mut steps = 0;
        while !masses.met() {
            masses.advance(&[9.0, -9.0]);
            steps += 1;
        }
        let [first, second] = [masses.actuators()[0].position(), masses.actuators()[1].position()];
        assert!((first - second - (TAU - 0.25)).abs() < ROUNDING);
        assert_eq!(steps, ((TAU - 0.25 - 1.0) / 0.2_f64).ceil() as i32);
    }

    #[test]
    fn refusals_and_nan() {
        assert!(actuator(|s| s.travel = [0.5, -0.5]).is_err());
        assert!(actuator(|s| s.rate = 0.0).is_err());
        assert!(actuator(|s| s.acceleration = f64::NAN).is_err());
        assert!(actuator(|s| s.delay = -1.0).is_err() && actuator(|s| s.delay = 1e300).is_err());
        assert!(actuator(|s| s.backlash = -1.0).is_err());
        assert!(actuator(|s| (s.travel, s.start) = ([0.0, 1.0], 2.0)).is_err());
        assert!(Actuator::new(ActuatorSettings::default(), 0.0).is_err());
        let ends = [actuator(|_| {}).unwrap(), actuator(|_| {}).unwrap()];
        assert!(RimPair::new(ends, 0.1).is_err());
        let mut masses = pair(0.1);
        let before = masses.clone();
        assert!(masses.advance(&[f64::NAN, 0.0])[1].is_nan());
        assert_eq!(masses, before);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn limits_hold_under_any_commands(
            commands in proptest::collection::vec(-3.0..3.0_f64, 1..200),
            rate in 0.01..20.0_f64,
            acceleration in 0.01..50.0_f64,
            backlash in 0.0..0.5_f64,
        ) {
            let settings = ActuatorSettings {
                travel: [-1.0, 0.7],
                rate,
                acceleration,
                backlash,
                delay: 0.2,
                start: 0.1,
            };
            let mut limited = Actuator::new(settings, 0.1).unwrap();
            let (mut position, mut speed) = (0.1, 0.0);
            for command in commands {
                limited.advance(command);
                prop_assert!((-1.0..=0.7).contains(&limited.drive) && (-1.0..=0.7).contains(&limited.load));
                prop_assert!((limited.drive - limited.load).abs() <= 0.5 * backlash + ROUNDING);
                let moved = (limited.drive - position) / 0.1;
                prop_assert!((moved - limited.speed()).abs() <= ROUNDING && moved.abs() <= rate + ROUNDING);
                prop_assert!((moved - speed).abs() <= 0.1 * acceleration + ROUNDING);
                (position, speed) = (limited.drive, moved);
            }
        }
    }
}
