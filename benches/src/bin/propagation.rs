//! Times propagations for a peer: ten lunar orbits, and an entry down to an altitude, by both schemes of `apsides-ode` and by `ode_solvers`.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::io::{Write, stdout};

use apsides_ad::{Dynamics, Scalar, dynamics_node};
use apsides_benches::CpuTime;
use apsides_benches::landing::Failure;
use apsides_ode::{Direction, Event, Integrator, OdeSettings, OdeSystem, Status, TaylorIntegrator};
use clap::Parser;
use ode_solvers::{Dop853, OutputType, SVector, System};
use serde::Serialize;

/// Flies each problem again and again at some tolerances, relative and absolute ones alike. One JSON object.
#[derive(Debug, Parser)]
#[command(name = "propagation")]
struct Arguments {
    /// Timed flights of each row; the least time counts.
    #[arg(long, default_value_t = 300, value_parser = clap::value_parser!(u32).range(1..))]
    repeat: u32,
    /// Tolerances.
    #[arg(long, value_delimiter = ',', default_values_t = [1e-10, 1e-11, 1e-12, 1e-13, 1e-14])]
    tolerances: Vec<f64>,
}

/// A flight: equations of six states, and where it starts.
trait Flight: OdeSystem + Dynamics<6, 0> + System<f64, SVector<f64, 6>> + Copy + 'static {
    const NAME: &'static str;
    fn start() -> [f64; 6];
    /// Latest time, s.
    fn end() -> f64;
    /// The function at whose fall through zero the flight ends, if it does not end by the time.
    fn event() -> Option<fn(&[f64]) -> f64>;
}

/// Ten circular orbits of 100 km about the Moon, m and m/s.
#[derive(Clone, Copy)]
struct Orbits;

const MOON: f64 = 4.9048695e12;
const RADIUS: f64 = 1.838e6;

/// An entry with lift over a sphere: radius, longitude, latitude, speed, path angle, azimuth; exponential atmosphere, bank of 37 deg.
#[derive(Clone, Copy)]
struct Entry;

const EARTH: f64 = 3.986004418e14;
const SURFACE: f64 = 6.371e6;
const LOWEST: f64 = SURFACE + 10e3;
const SCALE_HEIGHT: f64 = 7200.0;
const SURFACE_DENSITY: f64 = 1.225;
/// Mass by the area of drag, kg/m2, and lift by drag.
const BALLISTIC: f64 = 400.0;
const GLIDE: f64 = 0.3;
/// Cosine and sine of the bank angle.
const BANK: [f64; 2] = [0.8, 0.6];

impl Dynamics<6, 0> for Orbits {
    #[inline(always)]
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 6], _u: &[S; 0], _p: &[S; 0]) -> [S; 6] {
        let r2 = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
        let factor = S::from(-MOON) / (r2 * r2.sqrt());
        [x[3], x[4], x[5], x[0] * factor, x[1] * factor, x[2] * factor]
    }
}

impl Dynamics<6, 0> for Entry {
    #[inline(always)]
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 6], _u: &[S; 0], _p: &[S; 0]) -> [S; 6] {
        let [r, _, latitude, v, path, azimuth] = *x;
        let [(sin, cos), (east, north), (sin_latitude, cos_latitude)] =
            [path, azimuth, latitude].map(|a| a.sin_cos());
        let density = ((-r + SURFACE) * (1.0 / SCALE_HEIGHT)).exp() * SURFACE_DENSITY;
        let drag = density * v * v * (0.5 / BALLISTIC);
        let lift = drag * GLIDE;
        let gravity = S::from(EARTH) / (r * r);
        let level = v * cos;
        let turn = level * east / (r * cos_latitude);
        [
            v * sin,
            turn,
            level * north / r,
            -drag - gravity * sin,
            lift * BANK[0] / v + (v / r - gravity / v) * cos,
            lift * BANK[1] / level + turn * sin_latitude,
        ]
    }
}

impl Flight for Orbits {
    const NAME: &'static str = "ten lunar orbits";

    fn start() -> [f64; 6] {
        [RADIUS, 0.0, 0.0, 0.0, (MOON / RADIUS).sqrt(), 0.0]
    }

    fn end() -> f64 {
        10.0 * TAU * (RADIUS.powi(3) / MOON).sqrt()
    }

    fn event() -> Option<fn(&[f64]) -> f64> {
        None
    }
}

impl Flight for Entry {
    const NAME: &'static str = "entry to 10 km";

    fn start() -> [f64; 6] {
        [SURFACE + 120e3, 0.0, 0.3, 7700.0, -0.035, 1.2]
    }

    fn end() -> f64 {
        2000.0
    }

    fn event() -> Option<fn(&[f64]) -> f64> {
        Some(|x| x[0] - LOWEST)
    }
}

macro_rules! systems {
    ($($flight:ty),*) => {$(
        impl OdeSystem for $flight {
            fn dimension(&self) -> usize {
                6
            }

            #[inline]
            fn rate(&self, t: f64, x: &[f64], dx: &mut [f64]) {
                let x = std::array::from_fn(|k| x[k]);
                dx.copy_from_slice(&Dynamics::<6, 0>::rate(self, t, &x, &[], &[]));
            }
        }

        impl System<f64, SVector<f64, 6>> for $flight {
            fn system(&self, t: f64, y: &SVector<f64, 6>, dy: &mut SVector<f64, 6>) {
                dy.copy_from_slice(&Dynamics::<6, 0>::rate(self, t, &y.data.0[0], &[], &[]));
            }

            fn solout(&mut self, _t: f64, y: &SVector<f64, 6>, _dy: &SVector<f64, 6>) -> bool {
                <$flight as Flight>::event().is_some_and(|g| g(y.as_slice()) < 0.0)
            }
        }
    )*};
}
systems!(Orbits, Entry);

/// A flight by one scheme.
#[derive(Serialize)]
struct Row {
    problem: &'static str,
    scheme: &'static str,
    tolerance: f64,
    /// Least CPU time, us.
    microseconds: f64,
    steps: usize,
    time: f64,
    state: [f64; 6],
}

fn main() -> Result<(), Failure> {
    let arguments = Arguments::parse();
    let mut rows = Vec::new();
    measure(&arguments, Orbits, &mut rows)?;
    measure(&arguments, Entry, &mut rows)?;
    writeln!(stdout(), "{}", serde_json::to_string(&rows)?)?;
    Ok(())
}

fn measure<F: Flight>(arguments: &Arguments, flight: F, rows: &mut Vec<Row>) -> Result<(), Failure> {
    let formula = dynamics_node(flight).formula()?;
    let function = |_: f64, x: &[f64]| F::event().map_or(1.0, |g| g(x));
    let event = [Event::new(&function).directed(Direction::Falling).terminal()];
    let events = if F::event().is_some() { &event[..] } else { &[] };
    let expected = if F::event().is_some() { Status::Event(0) } else { Status::Completed };
    for &tolerance in &arguments.tolerances {
        let settings = OdeSettings::with_tolerance(tolerance);
        let row = |scheme, microseconds, steps, time, state| Row {
            problem: F::NAME,
            scheme,
            tolerance,
            microseconds,
            steps,
            time,
            state,
        };
        let start = F::start();
        let mut state = start;
        let mut taylor = TaylorIntegrator::new(&formula, settings.clone())?;
        let (time, summary) = least(arguments.repeat, || {
            taylor.integrate_observed(0.0, black_box(&start), &[], F::end(), &mut state, events, &mut ())
        });
        let summary = summary?;
        assert_eq!(summary.status, expected, "the flight ends elsewhere");
        rows.push(row("apsides Taylor", time, summary.statistics.accepted, summary.time, state));
        let mut pair = Integrator::new(6, settings)?;
        let (time, summary) = least(arguments.repeat, || {
            pair.integrate_observed(&flight, 0.0, black_box(&start), F::end(), &mut state, events, &mut ())
        });
        let summary = summary?;
        assert_eq!(summary.status, expected, "the flight ends elsewhere");
        rows.push(row("apsides DOP853", time, summary.statistics.accepted, summary.time, state));
        // It locates no events: it ends with the step after the event.
        let (time, found) = least(arguments.repeat, || {
            let start = SVector::from(black_box(start));
            let mut solver = Dop853::from_param(
                flight,
                0.0,
                F::end(),
                F::end(),
                start,
                tolerance,
                tolerance,
                0.9,
                0.0,
                0.333,
                6.0,
                F::end(),
                0.0,
                100_000,
                1000,
                OutputType::Sparse,
            );
            solver.integrate().map(|statistics| {
                let last = solver.y_out().last().map_or([f64::NAN; 6], |y| y.data.0[0]);
                (statistics.accepted_steps as usize, solver.x_out().last().copied().unwrap_or(f64::NAN), last)
            })
        });
        let (steps, end, state) = found.map_err(|e| e.to_string())?;
        rows.push(row("ode_solvers DOP853", time, steps, end, state));
    }
    Ok(())
}

/// Least CPU time of some runs, us, and what the last one found.
fn least<R>(turns: u32, mut run: impl FnMut() -> R) -> (f64, R) {
    let mut timed = || {
        let clock = CpuTime::start();
        let found = black_box(run());
        (1e3 * clock.milliseconds(), found)
    };
    let (mut best, mut found) = timed();
    for _ in 1..turns {
        let (time, again) = timed();
        (best, found) = (best.min(time), again);
    }
    (best, found)
}
