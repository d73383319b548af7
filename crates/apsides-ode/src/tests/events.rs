use std::f64::consts::{PI, TAU};
use std::ops::ControlFlow;

use proptest::prelude::*;

use super::*;
use crate::{Direction, Event, EventLog, FnSystem, Observer, Occurrence, Status, Step};

/// Round-off of the arithmetic.
const ROUND_OFF: f64 = 1e-14;

/// Discretisation: errors of 1e-11 of the radius by its rate, which is small near the apsides.
const GRAZING: f64 = 1e-7;

/// Discretisation: the tolerances of the integration and what its steps add up to.
const INTEGRATION: f64 = 1e-12;

fn run<S: OdeSystem>(
    system: &S,
    method: Method,
    x0: &[f64],
    t1: f64,
    events: &[Event<'_>],
) -> (crate::Summary, Vec<f64>, EventLog) {
    let mut integrator = integrator(x0.len(), method, 1e-12);
    let (mut x1, mut log) = (vec![0.0; x0.len()], EventLog::default());
    let summary = integrator.integrate_observed(system, 0.0, x0, t1, &mut x1, events, &mut log).unwrap();
    (summary, x1, log)
}

/// Radial velocity times radius of a planar orbit: zero at the apsides.
fn radial(_t: f64, x: &[f64]) -> f64 {
    x[0] * x[2] + x[1] * x[3]
}

#[test]
fn apsides_are_passed_at_half_periods() {
    let kepler = Kepler { axes: 2, mu: 1.0 };
    for method in METHODS {
        let all = Event::new(&radial);
        let apoapsis = all.directed(Direction::Falling);
        let (summary, _, log) = run(&kepler, method, &periapsis(0.3), 4.25 * TAU, &[all, apoapsis]);
        assert_eq!(summary.status, Status::Completed);
        // The start, at periapsis, is none of them.
        let times = |event| log.records.iter().filter(move |r| r.event == event).map(|r| r.time);
        assert_eq!((times(0).count(), times(1).count()), (8, 4));
        for (k, time) in times(0).enumerate() {
            close(time, (k + 1) as f64 * PI, 1e3 * INTEGRATION);
        }
        for (k, time) in times(1).enumerate() {
            close(time, (k as f64 + 0.5) * TAU, 1e3 * INTEGRATION);
        }
        for record in &log.records {
            let radius = record.state[0].hypot(record.state[1]);
            close(radius, if record.rising { 0.7 } else { 1.3 }, 1e3 * INTEGRATION);
        }
        assert!(log.records.windows(2).all(|p| p[0].time <= p[1].time));
    }
}

#[test]
fn terminal_event_ends_the_run_and_a_restart_does_not_repeat_it() {
    let kepler = Kepler { axes: 2, mu: 1.0 };
    let mut integrator = integrator(4, Method::Dop853, 1e-12);
    let mut x = periapsis(0.3).to_vec();
    let mut x1 = vec![0.0; 4];
    let mut t = 0.0;
    for k in 1..=6 {
        let mut last = f64::NAN;
        let mut observer = |step: &Step<'_>| {
            last = step.end();
            ControlFlow::Continue(())
        };
        let events = [Event::new(&radial).terminal()];
        let summary =
            integrator.integrate_observed(&kepler, t, &x, 1000.0, &mut x1, &events, &mut observer).unwrap();
        assert_eq!(summary.status, Status::Event(0));
        close(summary.time, f64::from(k) * PI, 1e3 * INTEGRATION);
        assert_eq!(last, summary.time);
        t = summary.time;
        x.copy_from_slice(&x1);
    }
}

#[test]
fn backward_integration_turns_the_directions_round() {
    let oscillator = Oscillator { frequency: 1.0 };
    let x = |_: f64, x: &[f64]| x[0];
    let rising = Event::new(&x).directed(Direction::Rising);
    let falling = Event::new(&x).directed(Direction::Falling);
    let (_, _, log) = run(&oscillator, Method::Dop853, &[1.0, 0.0], -8.0, &[rising, falling]);
    let found: Vec<(usize, f64)> = log.records.iter().map(|r| (r.event, r.time)).collect();
    // cos t seen backward falls through zero at -pi/2 and rises at -3 pi/2.
    assert_eq!(found.iter().map(|f| f.0).collect::<Vec<_>>(), [1, 0, 1]);
    for (k, f) in found.iter().enumerate() {
        close(f.1, -(k as f64 + 0.5) * PI, 10.0 * INTEGRATION);
    }
}

#[test]
fn grazing_passages_give_both_zeros_or_none() {
    let oscillator = Oscillator { frequency: 1.0 };
    for method in METHODS {
        for depth in [1e-3, 1e-6, 1e-9] {
            let above = move |_: f64, x: &[f64]| x[0] + 1.0 + depth;
            let below = move |_: f64, x: &[f64]| x[0] + 1.0 - depth;
            let events = [Event::new(&above), Event::new(&below)];
            let (_, _, log) = run(&oscillator, method, &[1.0, 0.0], 12.0, &events);
            let half = (1.0 - depth).acos();
            let expected = [PI - half, PI + half, 3.0 * PI - half, 3.0 * PI + half];
            assert_eq!(log.records.len(), 4, "{method:?} depth {depth}: {:?}", log.records);
            for (record, t) in log.records.iter().zip(expected) {
                assert_eq!(record.event, 1);
                // The zero of cos t + 1 - depth feels an error of the state divided by the slope.
                close(record.time, t, 1e-11 / half);
            }
        }
    }
}

#[test]
fn bouncing_ball() {
    let ball = FnSystem::new(2, |_t, x: &[f64], dx: &mut [f64]| (dx[0], dx[1]) = (x[1], -1.0));
    let height = |_: f64, x: &[f64]| x[0];
    for direction in [Direction::Falling, Direction::Any] {
        let mut integrator = integrator(2, Method::Dop853, 1e-12);
        let (mut t, mut x, mut x1) = (0.0, [0.5, 0.0], [0.0; 2]);
        // Dropped from 1/2 with restitution 0.8: speeds 1, 0.8, 0.64, ..., flights of twice the speed.
        let (mut speed, mut expected) = (1.0, 1.0);
        for _ in 0..20 {
            let ground = [Event::new(&height).directed(direction).terminal()];
            let summary =
                integrator.integrate_observed(&ball, t, &x, 100.0, &mut x1, &ground, &mut ()).unwrap();
            assert_eq!(summary.status, Status::Event(0));
            close(summary.time, expected, INTEGRATION);
            close(x1[1], -speed, INTEGRATION);
            speed *= 0.8;
            expected += 2.0 * speed;
            t = summary.time;
            x = [x1[0], -0.8 * x1[1]];
        }
    }
}

#[test]
fn several_events_in_one_step_come_in_time_order() {
    // A free fall is one exact step, however long.
    let fall = FnSystem::new(1, |_t, _x: &[f64], dx: &mut [f64]| dx[0] = 1.0);
    let levels = [7.0, 3.0, 5.0, 3.0];
    let functions = levels.map(|level| move |_: f64, x: &[f64]| x[0] - level);
    let events = functions.each_ref().map(|f| Event::new(f));
    let settings = OdeSettings { initial_step: Some(10.0), ..OdeSettings::default() };
    let mut integrator = Integrator::new(1, settings).unwrap();
    let (mut x1, mut log) = ([0.0], EventLog::default());
    let summary =
        integrator.integrate_observed(&fall, 0.0, &[0.0], 10.0, &mut x1, &events, &mut log).unwrap();
    assert_eq!((summary.status, summary.statistics.accepted), (Status::Completed, 1));
    let found: Vec<usize> = log.records.iter().map(|r| r.event).collect();
    assert_eq!(found, [1, 3, 2, 0]);
    for record in &log.records {
        close(record.time, levels[record.event], ROUNDING);
    }
    // A terminal event hides what comes after it.
    let mut events = events;
    events[2] = events[2].terminal();
    let mut log = EventLog::default();
    let summary =
        integrator.integrate_observed(&fall, 0.0, &[0.0], 10.0, &mut x1, &events, &mut log).unwrap();
    assert_eq!(summary.status, Status::Event(2));
    assert_eq!(log.records.iter().map(|r| r.event).collect::<Vec<_>>(), [1, 3, 2]);
    close(x1[0], 5.0, ROUNDING);
}

#[test]
fn the_observer_may_stop_at_the_third_event() {
    struct Third(usize);
    impl Observer for Third {
        const OBSERVES_STEPS: bool = false;
        fn event(&mut self, occurrence: &Occurrence<'_>) -> ControlFlow<()> {
            assert!(occurrence.rising || occurrence.state[1] < 0.0);
            self.0 += 1;
            if self.0 == 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        }
    }
    let x = |_: f64, x: &[f64]| x[0];
    let mut x1 = [0.0; 2];
    let summary = integrator(2, Method::Dop853, 1e-12)
        .integrate_observed(
            &Oscillator { frequency: 1.0 },
            0.0,
            &[1.0, 0.0],
            100.0,
            &mut x1,
            &[Event::new(&x)],
            &mut Third(0),
        )
        .unwrap();
    assert_eq!(summary.status, Status::Event(0));
    close(summary.time, 2.5 * PI, 10.0 * INTEGRATION);
}

#[test]
fn an_event_at_the_very_end_and_odd_functions() {
    let fall = FnSystem::new(1, |_t, _x: &[f64], dx: &mut [f64]| dx[0] = 1.0);
    let at_end = |_: f64, x: &[f64]| x[0] - 4.0;
    let nan = |_: f64, _: &[f64]| f64::NAN;
    let zero = |_: f64, _: &[f64]| 0.0;
    let jump = |t: f64, _: &[f64]| if t < 2.5 { -1.0 } else { 1.0 };
    let events = [&at_end as &dyn Fn(f64, &[f64]) -> f64, &nan, &zero, &jump].map(Event::new);
    let (summary, _, log) = run(&fall, Method::Dop853, &[0.0], 4.0, &events);
    assert_eq!(summary.status, Status::Completed);
    let found: Vec<usize> = log.records.iter().map(|r| r.event).collect();
    assert_eq!(found, [3, 0]);
    close(log.records[0].time, 2.5, ROUND_OFF);
    close(log.records[1].time, 4.0, INTEGRATION);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// Every crossing of a level by a sine is found, at its analytic time.
    #[test]
    fn level_crossings_of_a_sine(level in -0.999f64..0.999, frequency in 0.2f64..5.0) {
        let system = Oscillator { frequency };
        let function = move |_: f64, x: &[f64]| x[0] - level;
        let (_, _, log) = run(&system, Method::Dop853, &[0.0, frequency], 20.0, &[Event::new(&function)]);
        let mut expected: Vec<f64> = (0..40)
            .flat_map(|k| {
                let turn = TAU * f64::from(k);
                [level.asin() + turn, PI - level.asin() + turn]
            })
            .map(|phase| phase / frequency)
            .filter(|&t| t > 1e-6 && t < 20.0)
            .collect();
        expected.sort_by(f64::total_cmp);
        let found: Vec<f64> = log.records.iter().map(|r| r.time).filter(|&t| t > 1e-6).collect();
        prop_assert_eq!(found.len(), expected.len());
        for (f, e) in found.iter().zip(&expected) {
            prop_assert!((f - e).abs() < 1e4 * INTEGRATION);
        }
    }
}

/// A function that keeps away from zero costs no evaluation: the dense output is for steps that may have an event.
#[test]
fn steps_without_events_have_no_dense_output() {
    let kepler = Kepler { axes: 2, mu: 1.0 };
    for (method, dense) in METHODS.into_iter().zip([3, 0]) {
        let evaluations = |events: &[Event<'_>]| {
            run(&kepler, method, &periapsis(0.3), 4.25 * TAU, events).0.statistics.evaluations
        };
        let far = |_: f64, x: &[f64]| x[0] + 20.0;
        let plain = evaluations(&[]);
        assert_eq!(evaluations(&[Event::new(&far)]), plain, "{method:?}");
        // Nine apsides are near few steps.
        let steps = (evaluations(&[Event::new(&radial)]) - plain) / dense.max(1);
        assert!(steps <= 9 * 8, "{method:?}: {steps}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Levels anywhere between the apsides are passed twice a revolution, also close to them, where both passages are in one step.
    #[test]
    fn levels_are_passed_twice_a_revolution(eccentricity in 0.05..0.7_f64, part in -9.0..9.0_f64) {
        let kepler = Kepler { axes: 2, mu: 1.0 };
        // From 1e-4 of the way above the periapsis to 1e-4 below the apoapsis.
        let part = 1.0 / (1.0 + part.exp());
        let level = 1.0 - eccentricity + 2.0 * eccentricity * part;
        let above = |_: f64, x: &[f64]| x[0].hypot(x[1]) - level;
        for method in METHODS {
            let (_, _, log) = run(&kepler, method, &periapsis(eccentricity), 3.0 * TAU, &[Event::new(&above)]);
            prop_assert_eq!(log.records.len(), 6, "{:?}", method);
            // Kepler's equation at the radius.
            let anomaly = ((1.0 - level) / eccentricity).acos();
            let time = anomaly - eccentricity * anomaly.sin();
            prop_assert!((log.records[0].time - time).abs() < GRAZING, "{:?} {}", method, time);
        }
    }
}
