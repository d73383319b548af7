//! A flight time with its reference of mass: what the conic program is made of, in typical sizes.

use super::problem::{DescentProblem, difference, norm};
use super::settings::{DescentSettings, LowerBound};
use super::transition::{Hold, Transition};

/// Position, velocity, logarithm of mass.
pub(super) const STATES: usize = 7;
pub(super) const LOG_MASS: usize = 6;
/// Price of a miss on the horizontal plane, in multiples of the propellant that its speed would take in the typical time; that of height and
/// velocity is ten times as high.
const MISS_PRICE: f64 = 100.0;

/// Typical sizes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Units {
    pub(super) length: f64,
    pub(super) speed: f64,
    pub(super) acceleration: f64,
    pub(super) time: f64,
}

impl Units {
    fn of(p: &DescentProblem) -> Self {
        let acceleration = p.thrust[1] / p.mass;
        let change = norm(&difference(&p.target_velocity, &p.velocity));
        let length = norm(&difference(&p.target, &p.position)).max(change * change / acceleration).max(1.0);
        let speed = (length * acceleration).sqrt();
        Self { length, speed, acceleration, time: speed / acceleration }
    }

    pub(super) fn state(&self, s: usize) -> f64 {
        match s {
            0..3 => self.length,
            3..6 => self.speed,
            _ => 1.0,
        }
    }
}

/// Problem, discretisation, reference and flight time.
#[derive(Clone, Debug)]
pub(crate) struct Posed {
    pub(super) problem: DescentProblem,
    pub(super) units: Units,
    pub(super) intervals: usize,
    pub(super) hold: Hold,
    pub(super) lower_bound: LowerBound,
    /// True if rotation couples the axes.
    pub(super) coupled: bool,
    /// Reference of the logarithm of mass at the nodes.
    pub(super) reference: Vec<f64>,
    pub(super) duration: f64,
    /// Propellant per speed, of the typical sizes.
    pub(super) miss_price: f64,
}

impl Posed {
    pub(super) fn new(problem: &DescentProblem, settings: &DescentSettings) -> Self {
        let units = Units::of(problem);
        Self {
            problem: *problem,
            units,
            intervals: settings.intervals,
            hold: settings.hold,
            lower_bound: settings.lower_bound,
            coupled: problem.rotation != [0.0; 3],
            reference: vec![0.0; settings.intervals + 1],
            duration: 0.0,
            miss_price: MISS_PRICE * units.speed / problem.exhaust_velocity,
        }
    }

    /// Reference of the paper: full thrust from the start, until the propellant is gone.
    pub(super) fn reset_reference(&mut self, duration: f64) {
        let p = &self.problem;
        let flow = p.thrust[1] / p.exhaust_velocity;
        for (k, r) in self.reference.iter_mut().enumerate() {
            let t = duration * k as f64 / self.intervals as f64;
            *r = ((p.mass - flow * t).max(p.dry_mass) / p.mass).ln();
        }
    }

    /// Control points.
    pub(super) fn inputs(&self) -> usize {
        match self.hold {
            Hold::Zero => self.intervals,
            Hold::First => self.intervals + 1,
        }
    }

    /// Length of an interval, s.
    pub(super) fn step(&self) -> f64 {
        self.duration / self.intervals as f64
    }

    /// An interval, in units.
    pub(super) fn transition(&self) -> Transition {
        let w = self.problem.rotation.map(|w| w * self.units.time);
        Transition::new(&w, self.step() / self.units.time, self.hold)
    }

    /// Change of the logarithm of mass over an interval per unit of `s`.
    pub(super) fn mass_share(&self) -> f64 {
        self.units.acceleration * self.duration / self.intervals as f64 / self.problem.exhaust_velocity
    }

    /// Acceleration of a thrust, in units.
    pub(super) fn specific(&self, thrust: f64, log_mass: f64) -> f64 {
        thrust / (self.problem.mass * log_mass.exp() * self.units.acceleration)
    }

    /// The acceleration that the second-order bound is expanded about, in units.
    pub(super) fn quadratic_limit(&self, reference: f64) -> f64 {
        // A least thrust of zero gives |(e, -1/2 + s)| <= s + 1/2 of harmless size.
        self.specific(self.problem.thrust[0].max(1e-6 * self.problem.thrust[1]), reference)
    }

    /// Most change of the thrust over an interval, per mass at the start, in units.
    pub(super) fn thrust_change(&self, rate: f64) -> f64 {
        rate * self.step() / (self.problem.mass * self.units.acceleration)
    }

    /// Node where the least thrust holds: with constant controls the mass is least at the end of the interval.
    pub(super) fn lower_node(&self, input: usize) -> usize {
        if self.hold == Hold::Zero { input + 1 } else { input }
    }

    /// Component of the target, in units.
    pub(super) fn goal(&self, s: usize) -> f64 {
        let p = &self.problem;
        let goal = if s < 3 { p.target[s] } else { p.target_velocity[s - 3] };
        goal / self.units.state(s)
    }

    pub(super) fn least_log_mass(&self) -> f64 {
        (self.problem.dry_mass / self.problem.mass).ln()
    }
}
