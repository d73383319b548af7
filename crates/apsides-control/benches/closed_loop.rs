//! One closed-loop run of 300 s at 10 ms, thirteen states, by the classical method of order four: 120,000 evaluations of the rate. The
//! time of these evaluations alone is measured beside it.

use std::hint::black_box;

use apsides_ad::{Dynamics, Scalar};
use apsides_control::actuator::{Actuator, ActuatorSettings};
use apsides_control::pid::{Pid, PidGains, PidSettings};
use apsides_control::record::Recording;
use apsides_control::sensor::{Sensor, SensorSettings};
use apsides_control::simulation::{Simulation, SimulationSettings};
use apsides_ode::Direction;
use criterion::{Criterion, criterion_group, criterion_main};

/// Quaternion, rates, position and velocity of a body that falls through an exponential atmosphere; torque as control.
struct Body;

impl Dynamics<13, 3> for Body {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 13], u: &[S; 3], _p: &[S; 0]) -> [S; 13] {
        let [q0, q1, q2, q3] = [x[0], x[1], x[2], x[3]];
        let [a, b, c] = [x[4], x[5], x[6]];
        let speed = (x[10] * x[10] + x[11] * x[11] + x[12] * x[12] + 1e-6).sqrt();
        let density = (x[9] * (-1.0 / 7000.0)).exp() * 1.2;
        let drag = density * speed * -0.002;
        let damping = density * speed * -0.1;
        [
            (q1 * a + q2 * b + q3 * c) * -0.5,
            (q0 * a + q2 * c - q3 * b) * 0.5,
            (q0 * b - q1 * c + q3 * a) * 0.5,
            (q0 * c + q1 * b - q2 * a) * 0.5,
            (u[0] + b * c * 5.0 + damping * a) * 0.01,
            (u[1] - c * a * 20.0 + damping * b) * 0.012,
            (u[2] + a * b * 15.0 + damping * c) * 0.0125,
            x[10],
            x[11],
            x[12],
            drag * x[10],
            drag * x[11],
            drag * x[12] - 9.8,
        ]
    }
}

const START: [f64; 13] = [1.0, 0.0, 0.0, 0.0, 0.3, -0.2, 0.5, 0.0, 0.0, 1e5, 100.0, 0.0, -500.0];

fn run(c: &mut Criterion) {
    let settings = SimulationSettings { time_limit: 300.0, ..Default::default() };
    let simulation = Simulation::new(&Body, settings)
        .expect("invariant: settings in range")
        .projection(|x| {
            let length = x[..4].iter().map(|q| q * q).sum::<f64>().sqrt();
            x[..4].iter_mut().for_each(|q| *q /= length);
        })
        .stop("ground", Direction::Falling, |_, x| x[9] + 1e6);
    let limits = ActuatorSettings { rate: 10.0, delay: 0.02, ..Default::default() };
    let noise = SensorSettings { noise: [1e-6; 13], ..Default::default() };
    let pid = Pid::new(PidSettings::new(PidGains::new(50.0, 1.0, 0.0), 0.01)).expect("invariant: in range");
    let mut record = Recording::every(10);
    let mut group = c.benchmark_group("300 s at 10 ms");
    group.sample_size(20);
    for (name, with_sensor) in [("with sensor noise", true), ("without sensor", false)] {
        group.bench_function(name, |b| {
            b.iter(|| {
                let mut actuators: [Actuator; 3] =
                    std::array::from_fn(|_| Actuator::new(limits, 0.01).expect("invariant: limits in range"));
                let mut sensor = Sensor::new(noise).expect("invariant: noise in range");
                let mut laws = [pid; 3];
                let mut law = |_t: f64, x: &[f64; 13]| std::array::from_fn(|k| laws[k].update(-x[4 + k]));
                let sensor = with_sensor.then_some(&mut sensor);
                simulation.fly(black_box(&START), &mut law, &mut actuators, sensor, &mut record)
            });
        });
    }
    group.bench_function("rates alone", |b| {
        b.iter(|| {
            let mut x = START;
            for _ in 0..120_000 {
                let rate = black_box(Body.rate(0.0, black_box(&x), &[0.1, 0.2, 0.3], &[]));
                x[4] += 1e-9 * rate[4];
            }
            x
        });
    });
    group.finish();
}

criterion_group!(benches, run);
criterion_main!(benches);
