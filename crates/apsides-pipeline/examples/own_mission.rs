//! A kind of mission of one's own: a sounding rocket that climbs as high as it can, without drag in uniform gravity.
//!
//! ```text
//! h' = v,   v' = k T / m - g,   m' = -k T / c,   0 <= k <= 1
//! ```
//!
//! Full thrust until the propellant is burnt is best. With the mass ratio `R` and the burn time `t = (propellant) c / T`,
//!
//! ```text
//! v_1 = c ln R - g t,   h_1 = c t (1 - ln R / (R - 1)) - g t^2 / 2,   apogee = h_1 + v_1^2 / (2 g)
//! ```
#![allow(clippy::print_stdout)]

use apsides_ad::{Dynamics, Scalar};
use apsides_ocp::{At, Bounds, Guess, Ocp, Phase, PhaseGuess, State, Trajectory, Variable};
use apsides_pipeline::key::{Key, Range};
use apsides_pipeline::method::MethodName;
use apsides_pipeline::values::Values;
use apsides_pipeline::{Error, Kind, Mission, Posed, Registry, Scalars};

/// Standard gravity, m/s2, which also is the unit of the specific impulse.
const GRAVITY: f64 = 9.80665;

const KEYS: &[Key] = &[
    Key::number("initial_mass_kg", 300.0, Range::POSITIVE, "mass on the pad"),
    Key::number("propellant_kg", 120.0, Range::POSITIVE, "propellant on the pad"),
    Key::number("thrust_n", 12_000.0, Range::POSITIVE, "full thrust"),
    Key::number("isp_s", 230.0, Range::POSITIVE, "specific impulse"),
];

/// The mission in SI units.
#[derive(Clone, Copy, Debug)]
struct SoundingRocket {
    initial_mass: f64,
    propellant: f64,
    thrust: f64,
    exhaust_velocity: f64,
}

impl SoundingRocket {
    /// Time (s), altitude (m) and speed (m/s) at burn-out after full thrust.
    fn burn_out(&self) -> [f64; 3] {
        let (c, t) = (self.exhaust_velocity, self.propellant * self.exhaust_velocity / self.thrust);
        let ratio = self.initial_mass / (self.initial_mass - self.propellant);
        let altitude = c * t * (1.0 - ratio.ln() / (ratio - 1.0)) - 0.5 * GRAVITY * t * t;
        [t, altitude, c * ratio.ln() - GRAVITY * t]
    }

    /// Highest altitude, m.
    fn apogee(&self) -> f64 {
        let [_, altitude, speed] = self.burn_out();
        altitude + speed * speed / (2.0 * GRAVITY)
    }
}

/// Flight with the engine on; states altitude, speed, mass, control throttle.
impl Dynamics<3, 1> for SoundingRocket {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], u: &[S; 1], _p: &[S; 0]) -> [S; 3] {
        let ([_, speed, mass], thrust) = (*x, u[0] * self.thrust);
        [speed, thrust / mass - GRAVITY, -thrust / self.exhaust_velocity]
    }
}

/// Flight without thrust; states altitude, speed.
struct Coast;

impl Dynamics<2, 0> for Coast {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], _u: &[S; 0], _p: &[S; 0]) -> [S; 2] {
        [x[1], S::from(-GRAVITY)]
    }
}

impl Mission for SoundingRocket {
    fn kind() -> Kind {
        Kind::new::<Self>("sounding-rocket", "Highest flight of a sounding rocket without drag", &[KEYS])
    }

    fn read(values: &Values) -> Result<Self, Error> {
        let mission = Self {
            initial_mass: values.number("initial_mass_kg")?,
            propellant: values.number("propellant_kg")?,
            thrust: values.number("thrust_n")?,
            exhaust_velocity: values.number("isp_s")? * GRAVITY,
        };
        let weight = mission.initial_mass * GRAVITY;
        if mission.thrust <= weight {
            let thrust = mission.thrust;
            let reason = format!("`thrust_n` is {thrust}, but the rocket weighs {weight:.1} N on the pad");
            return Err(values.conflict(reason));
        }
        if mission.propellant >= mission.initial_mass {
            return Err(values.conflict("`propellant_kg` must be below `initial_mass_kg`"));
        }
        Ok(mission)
    }

    fn pose(&self, _method: MethodName) -> Result<Posed, Error> {
        let (apogee, [time, altitude, speed]) = (self.apogee(), self.burn_out());
        let (full, dry) = (self.initial_mass, self.initial_mass - self.propellant);
        // States begin and end away from bounds that they do not cross: a multiplier there would disturb the costates.
        let climb = State::new("altitude", "m").within(-apogee, 2.0 * apogee);
        let fast = State::new("speed", "m/s").within(-speed, 2.0 * speed);
        let mass = State::new("mass", "kg").within(0.5 * dry, 1.1 * full);
        let mass = mass.starts_at(full).ends_within(dry, full);
        let times = Bounds::new(0.1 * time, 10.0 * (time + speed / GRAVITY));
        let burn = Phase::new("burn", *self)
            .states([climb.clone().starts_at(0.0), fast.clone().starts_at(0.0), mass])
            .controls([Variable::new("throttle", "-").within(0.0, 1.0)])
            .final_time(times);
        let coast = Phase::new("coast", Coast).states([climb, fast.ends_at(0.0)]);
        let ocp = Ocp::builder("sounding rocket")
            .phase(burn)
            .phase(coast.initial_time(times).final_time(times))
            .link("burn", "coast")
            .maximize("apogee", "m", At::FinalState("coast", "altitude"))
            .build()?;
        // A longer burn at half thrust.
        let [ignition, burn_out] = [vec![0.0, 0.0, full], vec![altitude, speed, dry]];
        let turning = vec![vec![altitude, speed], vec![apogee, 0.0]];
        let guesses = vec![
            PhaseGuess::samples(&[0.0, 2.0 * time], vec![ignition, burn_out], vec![vec![0.5]; 2])?,
            PhaseGuess::samples(&[2.0 * time, 2.0 * time + speed / GRAVITY], turning, vec![vec![]; 2])?,
        ];
        Ok(Posed::new(ocp.clone(), Guess::from_phases(&ocp, guesses)))
    }

    fn results(&self, solution: &Trajectory) -> Scalars {
        let [burn, coast] = solution.phases.as_slice() else { return Scalars::new() };
        let height = coast.final_state().first().map(|h| ("apogee_km".to_owned(), h / 1e3));
        height.into_iter().chain([("burn_time_s".to_owned(), burn.final_time)]).collect()
    }
}

fn main() -> Result<(), Error> {
    let text = "mission = \"sounding-rocket\"\nthrust_n = 15000.0\n";
    let pipeline = Registry::new().with::<SoundingRocket>().parse(text, "text", &[])?;
    let outcome = pipeline.solve(None, &mut ())?;
    let summary = &outcome.summary;
    println!("{}: {}, {}", summary.mission, summary.status, summary.certificate.verdict);
    summary.results.iter().for_each(|(key, value)| println!("{key} = {value:.6}"));
    assert!(summary.certificate.is_verified(), "{:#?}", summary.certificate);
    let expected = pipeline.mission_as::<SoundingRocket>().map(|m| m.apogee() / 1e3).unwrap_or_default();
    let found = summary.results["apogee_km"];
    assert!((found / expected - 1.0).abs() < 1e-8, "{found} km instead of {expected} km");
    Ok(())
}
