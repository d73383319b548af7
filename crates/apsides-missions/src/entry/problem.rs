//! The re-entry as an optimal control problem.

use apsides_ad::{PathFunction, Scalar, VectorFunction};
use apsides_dynamics::Quantity;
use apsides_dynamics::entry::{
    ALTITUDE, BANK, BANK_COSINE, BANK_SINE, BankVector, BankVectorNorm, Banked, EntryModel,
    FLIGHT_PATH_ANGLE, HeatRate, LATITUDE, LONGITUDE, SPEED, STATES,
};
use apsides_dynamics::heating::HEAT_LOAD;
use apsides_ocp::{
    At, Bounds, Direction, Kink, Ocp, OcpBuilder, OcpError, Phase, Sense, State, Term, Variable,
};

use super::capsule::{CapsuleEntry, Goal};
use super::keys::SHORTEST_FLIGHT_S;
use super::load::LoadOf;
use super::steering::Steering;

/// Name of the phase.
pub(super) const PHASE: &str = "entry";
/// Static parameters: a peak that is to be least, in units of its scale, and the length of the bank vector.
const PEAK: &str = "peak";
const LIFT_FACTOR: &str = "factor on the lift";

/// Guards that no sensible flight reaches.
const LOWEST_M: f64 = -2e3;
const ABOVE_ENTRY_M: f64 = 50e3;
const LEAST_SPEED_M_S: f64 = 10.0;
const STEEPEST_DEG: f64 = 89.0;
const MOST_LATITUDE_DEG: f64 = 89.0;
/// Longest component of the bank vector: some freedom above the length one for the iterates.
const LONGEST_COMPONENT: f64 = 1.2;
pub(super) const LARGEST_FACTOR: f64 = 3.0;

/// Sizes that make the variables numbers near one.
const ALTITUDE_SCALE_M: f64 = 1e5;
const SPEED_SCALE_M_S: f64 = 1e3;
const HEAT_LOAD_SCALE: f64 = 1e8;

/// Misses that count as none.
const LENGTH_MISS_M: f64 = 1.0;
const SPEED_MISS_M_S: f64 = 1e-2;
const ANGLE_MISS_RAD: f64 = 1e-6;

/// A load minus the peak, which is a parameter in units of the load's scale.
struct AbovePeak<M>(LoadOf<M>);

impl<M: EntryModel<NU>, const NU: usize> PathFunction<6, NU, 1, 1> for AbovePeak<M> {
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; 6], u: &[S; NU], p: &[S; 1]) -> [S; 1] {
        let [load] = self.0.evaluate(t, x, u, &[]);
        let [peak] = *p;
        [load - peak * self.0.load.scale()]
    }
}

/// The square of the bank vector's length minus that of the factor on the lift, a parameter.
struct AboveFactor;

impl PathFunction<6, 2, 1, 1> for AboveFactor {
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; 6], u: &[S; 2], p: &[S; 1]) -> [S; 1] {
        let [norm] = BankVectorNorm.evaluate(t, x, u, &[]);
        let [factor] = p;
        [norm - factor.square()]
    }
}

/// Square of the straight distance from the target, in km2, from longitude and latitude at the end.
struct SquaredMiss {
    place: [f64; 2],
    radius: f64,
}

impl VectorFunction<2, 1> for SquaredMiss {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
        let ([longitude, latitude], [to_longitude, to_latitude]) = (*z, self.place);
        let half = |difference: S| (difference * 0.5).sin().square();
        let square = half(latitude - to_latitude)
            + latitude.cos() * half(longitude - to_longitude) * to_latitude.cos();
        [square * (2.0 * self.radius / KILO).powi(2)]
    }
}

/// Distances of the end from the target along a bearing and to the left of it, in km on a map that is true to scale at the target.
struct Along {
    place: [f64; 2],
    radius: f64,
    bearing: f64,
}

impl VectorFunction<2, 2> for Along {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 2] {
        let ([longitude, latitude], [from_longitude, from_latitude]) = (*z, self.place);
        let east = (longitude - from_longitude) * (from_latitude.cos() * self.radius / KILO);
        let north = (latitude - from_latitude) * (self.radius / KILO);
        let (sin, cos) = self.bearing.sin_cos();
        [east * sin + north * cos, north * sin - east * cos]
    }
}

/// The first of two results.
struct First<F>(F);

impl<F: VectorFunction<2, 2>> VectorFunction<2, 1> for First<F> {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
        [self.0.evaluate(z)[0]]
    }
}

/// The second of two results.
struct Second<F>(F);

impl<F: VectorFunction<2, 2>> VectorFunction<2, 1> for Second<F> {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
        [self.0.evaluate(z)[1]]
    }
}

const KILO: f64 = 1e3;
const MEGA: f64 = 1e6;

/// Longitude and latitude at the end.
fn place<'a>() -> [At<'a>; 2] {
    [LONGITUDE, LATITUDE].map(|q| At::FinalState(PHASE, q.name))
}

impl CapsuleEntry {
    /// The problem in one of its two forms.
    pub(super) fn problem(&self, steering: Steering) -> Result<Ocp, OcpError> {
        let phase = match steering {
            Steering::Angle => self.angle_phase(),
            Steering::Vector => self.vector_phase(),
        };
        self.with_objective(Ocp::builder("capsule-reentry").phase(phase)).build()
    }

    fn angle_phase(&self) -> Phase {
        let phase = self.phase(Banked(self.flight.clone()));
        phase
            .controls([Variable::new(BANK.name, BANK.unit)
                .within(-std::f64::consts::PI, std::f64::consts::PI)
                .guarded()])
            .direction(Direction::InPlane { angle: 0 })
    }

    fn vector_phase(&self) -> Phase {
        let most = if self.goal == Goal::LeastLift { LARGEST_FACTOR } else { LONGEST_COMPONENT };
        let component = |q: Quantity| Variable::new(q.name, q.unit).within(-most, most).guarded();
        let phase = self
            .phase(BankVector(self.flight.clone()))
            .controls([component(BANK_COSINE), component(BANK_SINE)]);
        let norm = |value| Variable::new("length of the bank vector", "-").equal_to(value);
        if self.goal == Goal::LeastLift {
            phase.path([norm(0.0)], AboveFactor)
        } else {
            phase.path([norm(1.0)], BankVectorNorm)
        }
    }

    /// The phase of a model without its controls. The rows of the loads come first.
    fn phase<M, const NU: usize>(&self, model: M) -> Phase
    where
        M: EntryModel<NU> + Clone + 'static,
    {
        let states = self.states();
        let altitude = states.iter().position(|s| s.variable.name == ALTITUDE.name);
        let kinks = altitude.into_iter().flat_map(|state| {
            self.flight.planet.atmosphere.kinks().into_iter().map(move |value| Kink::State { state, value })
        });
        let mut phase = Phase::new(PHASE, model.clone())
            .states(states)
            .final_time(Bounds::new(SHORTEST_FLIGHT_S, self.longest_flight))
            .integral(
                Variable::new(HEAT_LOAD.name, HEAT_LOAD.unit).scaled_by(HEAT_LOAD_SCALE),
                HeatRate(model.clone()),
            )
            .kinks(kinks);
        for (load, limit) in self.limits() {
            let q = load.quantity();
            let row = Variable::new(q.name, q.unit).at_most(limit).scaled_by(load.scale());
            phase = phase.path([row], LoadOf::new(&model, load));
        }
        if let Goal::Peak(load) = self.goal {
            let row =
                Variable::new("above the peak", load.quantity().unit).at_most(0.0).scaled_by(load.scale());
            phase = phase.path([row], AbovePeak(LoadOf::new(&model, load)));
        }
        phase
    }

    fn states(&self) -> Vec<State> {
        let bounds = |q: Quantity| match q {
            ALTITUDE => Bounds::new(LOWEST_M, self.start.altitude + ABOVE_ENTRY_M),
            LATITUDE => symmetric(MOST_LATITUDE_DEG),
            SPEED => Bounds::new(LEAST_SPEED_M_S, 2.0 * self.start.speed),
            FLIGHT_PATH_ANGLE => symmetric(STEEPEST_DEG),
            _ => Bounds::FREE,
        };
        let (scale, miss) = (
            |q: Quantity| match q {
                ALTITUDE => ALTITUDE_SCALE_M,
                SPEED => SPEED_SCALE_M_S,
                _ => 1.0,
            },
            |q: Quantity| match q {
                ALTITUDE => LENGTH_MISS_M,
                SPEED => SPEED_MISS_M_S,
                _ => ANGLE_MISS_RAD,
            },
        );
        let [longitude, latitude] = self.target;
        let end = |q: Quantity| match q {
            ALTITUDE => Some(self.target_altitude),
            LONGITUDE if self.must_reach_target() => Some(longitude),
            LATITUDE if self.must_reach_target() => Some(latitude),
            _ => None,
        };
        let state = |(q, start): (Quantity, f64)| {
            let mut state =
                State::new(q.name, q.unit).miss_below(miss(q)).scaled_by(scale(q)).starts_at(start).guarded();
            state.variable.bounds = bounds(q);
            state.terminal = end(q).map_or(Bounds::FREE, Bounds::fixed);
            state
        };
        STATES.into_iter().zip(self.start.array()).map(state).collect()
    }

    fn with_objective(&self, ocp: OcpBuilder) -> OcpBuilder {
        let radius = self.flight.planet.body.radius;
        let least = |ocp: OcpBuilder, name: &str, unit: &str, term| {
            ocp.objective(Sense::Minimize, name, unit, [term])
        };
        match self.goal {
            Goal::HeatLoad => {
                least(ocp, "heat_load", "MJ/m2", Term::Integral(PHASE, HEAT_LOAD.name, 1.0 / MEGA))
                    .objective_scale(HEAT_LOAD_SCALE / MEGA)
            }
            Goal::Peak(load) => {
                let peak = Variable::new(PEAK, "-").within(0.0, f64::INFINITY).scaled_by(1.0);
                let q = load.quantity();
                let term = Term::End(At::Parameter(PEAK), load.scale());
                least(ocp.parameter(peak), &format!("peak {}", q.name), q.unit, term)
                    .objective_scale(load.scale())
            }
            Goal::LeastLift => {
                let factor = Variable::new(LIFT_FACTOR, "-").within(0.0, LARGEST_FACTOR).scaled_by(1.0);
                let term = Term::End(At::Parameter(LIFT_FACTOR), 1.0);
                least(ocp.parameter(factor), LIFT_FACTOR, "-", term).objective_scale(1.0)
            }
            Goal::Miss => {
                let miss = SquaredMiss { place: self.target, radius };
                least(ocp, "squared miss", "km2", Term::function(place(), miss)).objective_scale(1e4)
            }
            Goal::Reach { bearing, half_width } => {
                let along = || Along { place: self.target, radius, bearing };
                let ocp = match half_width.map(|metres| metres / KILO) {
                    Some(half_width) => {
                        let row = Variable::new("off the line through the target", "km")
                            .within(-half_width, half_width)
                            .scaled_by(100.0);
                        ocp.constrain("line through the target", [row], place(), Second(along()))
                    }
                    None => ocp,
                };
                ocp.objective(Sense::Maximize, "reach", "km", [Term::function(place(), First(along()))])
                    .objective_scale(100.0)
            }
        }
    }
}

fn symmetric(degrees: f64) -> Bounds {
    Bounds::new(-degrees.to_radians(), degrees.to_radians())
}
