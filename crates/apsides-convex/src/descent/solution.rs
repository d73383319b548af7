//! The solution of a powered descent.

use apsides_conic::{ConicReport, Status};

use super::problem::{DescentProblem, difference, norm};
use super::program::DescentProgram;

/// The end of a descent: the target is reached, or something is lacking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome {
    /// The target is reached.
    Landed,
    /// Height and velocity of the target are reached beside it: least landing error, m.
    OutOfReach {
        /// Distance from the target on the horizontal plane, m.
        distance: f64,
    },
    /// Height and velocity of the target are not reached either.
    NoArrival {
        /// Distance from the target on the horizontal plane, m.
        distance: f64,
        /// Height above the target, m.
        height: f64,
        /// Difference from the velocity at the target, m/s.
        speed: f64,
    },
    /// The target would be reached with more propellant.
    TooLittlePropellant {
        /// Propellant needed, kg.
        needed: f64,
        /// Propellant on board, kg.
        available: f64,
        /// Least distance from the target with it, m; NaN when there is no flight with it at all.
        distance: f64,
    },
    /// The target is reached by the relaxation alone, in which the thrust may be below its least value: this is no flight, and the propellant
    /// is a lower bound of that of any. At isolated control points, such as a switch, it may be so in a flight, too.
    Relaxed {
        /// Start of the first arc along which the thrust is below its least value, s.
        from: f64,
        /// End of that arc, s.
        until: f64,
        /// Largest part of the least thrust that lacks along it.
        gap: f64,
    },
    /// No flight at all keeps the limits, or the conic solver gave up.
    NoFlight(Status),
}

impl std::fmt::Display for Outcome {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Landed => write!(f, "landed"),
            Self::OutOfReach { distance } => write!(f, "target out of reach by {distance:.2} m"),
            Self::NoArrival { distance, height, speed } => {
                write!(f, "no arrival: misses by {distance:.2} m, height {height:.2} m, {speed:.3} m/s")
            }
            Self::TooLittlePropellant { needed, available, distance } => {
                write!(f, "needs {needed:.3} kg of propellant, has {available:.3} kg, with which it ")?;
                if distance.is_nan() {
                    write!(f, "cannot fly")
                } else {
                    write!(f, "misses by {distance:.2} m")
                }
            }
            Self::Relaxed { from, until, gap } => write!(
                f,
                "no flight: from {from:.2} to {until:.2} s the thrust is below the least one by up to {:.1} %; the propellant is a lower \
                 bound (the relaxation of the thrust bounds is not tight: change the pointing limit or the flight time)",
                100.0 * gap
            ),
            Self::NoFlight(status) => {
                write!(f, "no flight keeps thrust bounds, propellant and limits ({status:?})")
            }
        }
    }
}

/// Limits of the thrust and along the flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// Least thrust.
    LeastThrust,
    /// Largest thrust.
    MostThrust,
    /// Angle between thrust and vertical.
    Pointing,
    /// Elevation above the target.
    GlideSlope,
    /// Speed.
    Speed,
    /// Rate of the thrust vector.
    ThrustRate,
}

/// An arc along which a limit is active.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActiveArc {
    /// The limit.
    pub limit: Limit,
    /// First node time of the arc, s.
    pub from: f64,
    /// Last node time of the arc, s.
    pub until: f64,
}

/// A powered descent at nodes of equal distance; numbers are NaN when there is no flight.
#[derive(Clone, Debug, PartialEq)]
pub struct DescentSolution {
    /// The outcome.
    pub outcome: Outcome,
    /// Flight time, s.
    pub flight_time: f64,
    /// Propellant, kg.
    pub propellant: f64,
    /// Node times, s.
    pub times: Vec<f64>,
    /// Positions at the nodes, m.
    pub positions: Vec<[f64; 3]>,
    /// Velocities at the nodes, m/s.
    pub velocities: Vec<[f64; 3]>,
    /// Masses at the nodes, kg.
    pub masses: Vec<f64>,
    /// Thrust vectors at the control points, N: the nodes with linear controls, the starts of the intervals with constant ones.
    pub thrusts: Vec<[f64; 3]>,
    /// Bounds on the thrust at the control points, `m s`, N.
    pub throttles: Vec<f64>,
    /// Largest `1 - |u| / s`: zero when the relaxation is lossless.
    pub relaxation_gap: f64,
    /// Change of the logarithm of mass in the last pass: what the thrust bounds may be off, relatively.
    pub mass_change: f64,
    /// Active limits.
    pub active: Vec<ActiveArc>,
    /// Conic programs solved, and their iterations in all.
    pub solves: usize,
    /// Iterations of all conic programs.
    pub iterations: u32,
    /// Figures of the last conic program.
    pub report: Option<ConicReport>,
}

/// Part of a limit within which it counts as active.
const ACTIVE: f64 = 1e-4;
/// Part of the least thrust that a thrust at it may lack, as conic programs are solved.
const TIGHT: f64 = 1e-3;
/// Largest gap of the relaxation, and largest change of the logarithm of mass in the last pass, with which a solution is a global optimum.
const GLOBAL: f64 = 1e-6;

impl DescentSolution {
    pub(crate) fn of(program: &DescentProgram, outcome: Outcome) -> Self {
        let p = program.problem();
        let part = |x: &[f64; 7], first: usize| -> [f64; 3] { std::array::from_fn(|c| x[first + c]) };
        let masses: Vec<f64> = program.states.iter().map(|x| p.mass * x[6].exp()).collect();
        let controls = program.controls.iter().zip(&masses);
        let thrusts: Vec<[f64; 3]> =
            controls.clone().map(|(u, m)| std::array::from_fn(|c| m * u[c])).collect();
        let gap = program.controls.iter().map(|u| 1.0 - norm(&[u[0], u[1], u[2]]) / u[3]);
        let mut solution = Self {
            outcome,
            flight_time: program.node_time(program.states.len() - 1),
            propellant: p.mass - masses[masses.len() - 1],
            times: (0..masses.len()).map(|k| program.node_time(k)).collect(),
            positions: program.states.iter().map(|x| part(x, 0)).collect(),
            velocities: program.states.iter().map(|x| part(x, 3)).collect(),
            throttles: controls.map(|(u, m)| m * u[3]).collect(),
            thrusts,
            masses,
            relaxation_gap: gap.fold(0.0, |a, g| if g > a || g.is_nan() { g } else { a }),
            mass_change: 0.0,
            active: Vec::new(),
            solves: 0,
            iterations: 0,
            report: program.report(),
        };
        solution.find_active(p);
        solution
    }

    /// True if the relaxation is tight and its reference mass has settled: no flight of the same duration, with controls on the same nodes,
    /// needs less propellant (Acikmese and Ploen 2007, doi 10.2514/1.27553, lemma 2).
    #[must_use]
    pub fn is_global_optimum(&self) -> bool {
        let settled = self.mass_change <= GLOBAL && self.relaxation_gap <= GLOBAL;
        self.outcome == Outcome::Landed && settled
    }

    /// The first arc of two or more control points at which the thrust is below its least value.
    pub(crate) fn relaxed(&self, least: f64) -> Option<Outcome> {
        let lacks: Vec<f64> = self.thrusts.iter().map(|thrust| 1.0 - norm(thrust) / least).collect();
        let first = lacks.windows(2).position(|w| w.iter().all(|lack| *lack > TIGHT))?;
        let arc = lacks[first..].iter().take_while(|lack| **lack > TIGHT);
        let (count, gap) = arc.fold((0, 0.0_f64), |(count, gap), lack| (count + 1, gap.max(*lack)));
        Some(Outcome::Relaxed { from: self.times[first], until: self.times[first + count - 1], gap })
    }

    fn find_active(&mut self, p: &DescentProblem) {
        let [least, most] = p.thrust;
        let l = p.limits;
        let (thrusts, throttles) = (self.thrusts.clone(), self.throttles.clone());
        let step = self.times[1] - self.times[0];
        let (positions, velocities) = (self.positions.clone(), self.velocities.clone());
        self.arcs(Limit::LeastThrust, throttles.iter().map(|s| s - least < ACTIVE * most));
        self.arcs(Limit::MostThrust, throttles.iter().map(|s| most - s < ACTIVE * most));
        if let Some(angle) = l.pointing {
            let margin = |t: &[f64; 3]| t[2] - angle.cos() * norm(t) < ACTIVE * most;
            self.arcs(Limit::Pointing, thrusts.iter().map(margin));
        }
        if let Some(elevation) = l.glide_slope {
            let size = norm(&difference(&p.position, &p.target));
            let margin = |r: &[f64; 3]| {
                let d = difference(r, &p.target);
                d[2] - elevation.tan() * d[0].hypot(d[1]) < ACTIVE * size
            };
            // The vertex itself is always reached.
            let inner = positions.len() - 1;
            self.arcs(Limit::GlideSlope, positions[..inner].iter().map(margin));
        }
        if let Some(speed) = l.speed {
            self.arcs(Limit::Speed, velocities.iter().map(|v| speed - norm(v) < ACTIVE * speed));
        }
        if let Some(rate) = l.thrust_rate {
            let margin = |w: &[[f64; 3]]| rate - norm(&difference(&w[1], &w[0])) / step < ACTIVE * rate;
            self.arcs(Limit::ThrustRate, thrusts.windows(2).map(margin));
        }
    }

    fn arcs(&mut self, limit: Limit, active: impl Iterator<Item = bool>) {
        let mut open: Option<ActiveArc> = None;
        for (k, is_active) in active.enumerate() {
            let t = self.times[k];
            match (&mut open, is_active) {
                (Some(arc), true) => arc.until = t,
                (None, true) => open = Some(ActiveArc { limit, from: t, until: t }),
                (_, false) => self.active.extend(open.take()),
            }
        }
        self.active.extend(open);
    }
}
