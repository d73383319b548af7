//! One burn from the parking orbit to a circle above it in minimum time, by indirect shooting: solved at any radius by continuation.

use apsides_dynamics::planar::{
    ConstantThrust, HORIZONTAL_SPEED, PlanarFlight, RADIAL_SPEED, RADIUS, STATES, THRUST_ANGLE,
};
use apsides_ocp::{At, Bounds, Direction, Guess, Ocp, OcpError, Phase, PhaseGuess, State, Variable};
use apsides_shooting::indirect::{ContinuationSettings, IndirectSettings, IndirectShooting, IndirectStart};

use super::analytic::AnalyticGuess;
use super::stage::{Solver, Stage, Stop, ended};
use crate::Error;

/// Tolerance of the integration and of Newton's method: costates to seven digits.
const INTEGRATION: f64 = 1e-10;
const CORRECTION: f64 = 1e-8;
/// Most Newton iterations.
const MOST_ITERATIONS: usize = 30;
/// Ratio of the radii where a family starts: a short burn, which the analytic guess fits.
const FIRST_RATIO: f64 = 1.005;
/// Relative accuracy of the burn time at the limit of the propellant.
const LIMIT: f64 = 1e-8;
const MOST_SECANTS: usize = 20;
/// Relative difference of burn times that are of one solution.
const SAME: f64 = 1e-6;

/// A solution.
#[derive(Clone, Debug)]
pub(super) struct Point {
    /// Ratio of the radii.
    pub(super) ratio: f64,
    /// Burn time, s.
    pub(super) time: f64,
    /// Costates of the radial and horizontal speed at ignition, canonical, that of the radius being -1.
    pub(super) costates: [f64; 2],
    nodes: IndirectStart,
}

/// Burns of one stage.
pub(super) struct Circles<'a> {
    stage: &'a Stage,
    method: IndirectShooting,
}

impl<'a> Circles<'a> {
    pub(super) fn of(stage: &'a Stage) -> Self {
        let settings = IndirectSettings {
            integration_tolerance: INTEGRATION,
            tolerance: CORRECTION,
            max_iterations: MOST_ITERATIONS,
            ..IndirectSettings::default()
        };
        Self { stage, method: IndirectShooting { settings } }
    }

    /// Acceleration at ignition and mass flow in canonical units.
    fn canonical(&self) -> (f64, f64) {
        let (speed, time) = self.stage.canonical();
        let s = self.stage;
        (s.flight.engine.thrust / s.mass * time / speed, s.mass_flow() * time / s.mass)
    }

    pub(super) fn constant_mass(&self, ratio: f64) -> AnalyticGuess {
        AnalyticGuess::constant_mass(ratio, self.canonical().0)
    }

    pub(super) fn mean_acceleration(&self, ratio: f64) -> AnalyticGuess {
        let (acceleration, flow) = self.canonical();
        AnalyticGuess::mean_acceleration(ratio, acceleration, flow)
    }

    /// The burn time of a guess, s.
    pub(super) fn seconds(&self, guess: &AnalyticGuess) -> f64 {
        guess.time * self.stage.canonical().1
    }

    fn ocp(&self, ratio: f64) -> Result<Ocp, OcpError> {
        let s = self.stage;
        let (speed, time) = s.canonical();
        let radius = ratio * s.parking_radius;
        let begin = [Some(s.parking_radius), Some(0.0), Some(speed), Some(0.0), Some(s.mass)];
        let end = [Some(radius), None, Some((s.mu() / radius).sqrt()), Some(0.0), None];
        let size = [s.parking_radius, 1.0, speed, speed, s.mass];
        let fixed = |value: Option<f64>| value.map_or(Bounds::FREE, Bounds::fixed);
        let states = STATES.iter().zip(begin).zip(end).zip(size).map(|(((q, begin), end), size)| {
            let mut state = State::new(q.name, q.unit).scaled_by(size);
            (state.initial, state.terminal) = (fixed(begin), fixed(end));
            state
        });
        let flight = PlanarFlight::new(s.flight.body, s.flight.engine);
        let phase = Phase::new("burn", ConstantThrust(flight))
            .states(states)
            .controls([Variable::new(THRUST_ANGLE.name, THRUST_ANGLE.unit)])
            .direction(Direction::InPlane { angle: 0 })
            .initial_time(Bounds::fixed(0.0))
            .final_time(Bounds::at_least(0.0));
        Ocp::builder(format!("from circle to circle, radii 1 to {ratio}"))
            .phase(phase)
            .minimize("burn time", "s", At::FinalTime("burn"))
            .objective_scale(time)
            .build()
    }

    /// A start whose states and costates follow from those of the guess at ignition. No guess burns longer than the propellant lasts.
    fn start(&self, ocp: &Ocp, ratio: f64, guess: &AnalyticGuess) -> Result<IndirectStart, Stop> {
        let s = self.stage;
        let (speed, unit) = s.canonical();
        let time = self.seconds(guess).min(s.longest_burn());
        let radius = ratio * s.parking_radius;
        let angle = 0.5 * time * (speed / s.parking_radius + (s.mu() / radius).sqrt() / radius);
        let begin = vec![s.parking_radius, 0.0, speed, 0.0, s.mass];
        let end = vec![radius, angle, (s.mu() / radius).sqrt(), 0.0, s.mass - time * s.mass_flow()];
        let [u, v] = guess.costates;
        let controls = vec![vec![(-u).atan2(-v)], vec![u.atan2(-v)]];
        let trajectory = PhaseGuess::samples(&[0.0, time], vec![begin, end], controls)?;
        // Those of the time in seconds; that of the mass falls to zero at the rate that the first thrust gives it.
        let scale = guess.scale * unit;
        let of_mass = scale / speed * u.hypot(v) * s.flight.engine.thrust / (s.mass * s.mass) * time;
        let costates = |u: f64, of_mass: f64| {
            let list = [-1.0 / s.parking_radius, 0.0, v / speed, u / speed];
            list.iter().map(|c| c * scale).chain([of_mass]).collect::<Vec<f64>>()
        };
        let both = [[costates(u, of_mass), costates(-u, 0.0)]];
        let guess = Guess::from_phases(ocp, vec![trajectory]);
        Ok(IndirectStart::from_guess(ocp, &guess, &both, 1)?.chained())
    }

    fn point(&self, ratio: f64, nodes: IndirectStart) -> Point {
        let (speed, _) = self.stage.canonical();
        let phase = &nodes.phases[0];
        let at = |name: &str| {
            STATES.iter().position(|q| q.name == name).map_or(f64::NAN, |i| phase.costates[0][i])
        };
        let of_radius = -at(RADIUS.name) * self.stage.parking_radius;
        let costates = [at(RADIAL_SPEED.name), at(HORIZONTAL_SPEED.name)].map(|c| c * speed / of_radius);
        Point { ratio, time: phase.final_time - phase.initial_time, costates, nodes }
    }

    /// The burn to the first circle.
    fn first(&self, solver: &mut Solver<'_>) -> Result<Point, Stop> {
        let ocp = self.ocp(FIRST_RATIO)?;
        let start = self.start(&ocp, FIRST_RATIO, &self.mean_acceleration(FIRST_RATIO))?;
        let (solution, _) = solver.shoot(&self.method, &ocp, &start)?;
        Ok(self.point(FIRST_RATIO, solution.nodes))
    }

    /// By continuation from a neighbour.
    fn next(&self, from: &Point, ratio: f64, solver: &mut Solver<'_>) -> Result<Point, Stop> {
        let family = |s: f64| Ok::<_, Error>(self.ocp(from.ratio + s * (ratio - from.ratio))?);
        let settings = ContinuationSettings { first_step: 1.0, ..ContinuationSettings::default() };
        let done = self.method.follow(family, &from.nodes, &settings, &mut *solver.observer)?;
        if !done.reached() {
            let status = done.records.last().map_or(done.solution.status, |r| r.status);
            ended(&format!("from circle to circle, radii 1 to {ratio}"), "continuation", status)?;
        }
        Ok(self.point(ratio, done.solution.nodes))
    }

    /// The largest ratio of the radii that the propellant suffices for: secants of the ratio over the burn time.
    pub(super) fn limit(&self, solver: &mut Solver<'_>) -> Result<Point, Stop> {
        let most = self.stage.longest_burn();
        let mut before = self.first(solver)?;
        let mut last = self.next(&before, 1.0 + 2.0 * (FIRST_RATIO - 1.0), solver)?;
        for _ in 0..MOST_SECANTS {
            if (last.time - most).abs() <= LIMIT * most {
                break;
            }
            let slope = (last.ratio - before.ratio) / (last.time - before.time);
            let ratio = last.ratio + slope * (most - last.time);
            let next = self.next(&last, ratio, solver)?;
            before = std::mem::replace(&mut last, next);
        }
        Ok(last)
    }

    /// Solutions at increasing ratios.
    pub(super) fn at(&self, ratios: &[f64], solver: &mut Solver<'_>) -> Result<Vec<Point>, Stop> {
        let mut last = self.first(solver)?;
        let mut points = Vec::new();
        for &ratio in ratios {
            last = self.next(&last, ratio, solver)?;
            points.push(last.clone());
        }
        Ok(points)
    }

    /// Newton iterations from an analytic guess to the solution, if they lead there.
    pub(super) fn iterations(
        &self,
        solution: &Point,
        guess: &AnalyticGuess,
        solver: &mut Solver<'_>,
    ) -> Result<Option<usize>, Stop> {
        let ocp = self.ocp(solution.ratio)?;
        let start = self.start(&ocp, solution.ratio, guess)?;
        match solver.shoot(&self.method, &ocp, &start) {
            Ok((found, trajectory)) => {
                let same = (trajectory.objective - solution.time).abs() <= SAME * solution.time;
                Ok(same.then_some(found.iterations))
            }
            Err(Stop::NotSolved(_)) => Ok(None),
            Err(stop) => Err(stop),
        }
    }
}
