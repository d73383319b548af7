//! Burns that are symmetric in time to an apsis of the orbit before, on a fixed line of apses: one to a given orbit, or several with the
//! orbits between them free.
//!
//! The line of apses is the first axis. Ignition is half the burn time before the apsis, by Kepler's equation:
//!
//! ```text
//! t(p, f, g, L at ignition -> apsis) = t_b / 2
//! ```

use std::f64::consts::PI;

use apsides_ad::{Scalar, VectorFunction};
use apsides_dynamics::Quantity;
use apsides_dynamics::elements::PlanarEquinoctial;
use apsides_dynamics::equinoctial::{
    ECCENTRICITY_F, ECCENTRICITY_G, MASS, PLANAR_STATES, PlanarThrust, SEMI_LATUS_RECTUM, THRUST_ANGLE,
    TRUE_LONGITUDE,
};
use apsides_dynamics::kepler::{coast_duration, longitude_after};
use apsides_ocp::{
    At, Bounds, Direction, Guess, Ocp, OcpBuilder, OcpError, Phase, PhaseGuess, PhaseTrajectory, State,
    Variable,
};

use super::stage::{Orbit, Solver, Stage, Stop};

/// The place of the middle of a burn on the orbit before: its true longitude.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Apsis {
    Perigee,
    Apogee,
}

impl Apsis {
    /// The apsis of burn `k` of `n`: the last one is at apogee.
    pub(super) fn of(k: usize, n: usize) -> Self {
        if k + 1 == n { Self::Apogee } else { Self::Perigee }
    }

    pub(super) fn longitude(self) -> f64 {
        match self {
            Self::Perigee => 0.0,
            Self::Apogee => PI,
        }
    }
}

/// The target of a burn, on the line of apses of the orbit before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Goal {
    Orbit(Orbit),
    /// An apogee radius (m), with any perigee.
    Apogee(f64),
}

/// One burn by the rule.
#[derive(Clone, Copy, Debug)]
pub(super) struct Burn {
    pub(super) from: Orbit,
    /// Mass at ignition, kg.
    pub(super) mass: f64,
    pub(super) apsis: Apsis,
    pub(super) goal: Goal,
}

/// The shortest burn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flown {
    /// By indirect shooting, s.
    pub(super) time: f64,
    /// By collocation, s.
    pub(super) radau_time: f64,
    pub(super) orbit: Orbit,
    /// True longitude at cut-off, rad.
    pub(super) cut_off: f64,
}

/// Places among the states.
const LATUS_RECTUM_AT: usize = SEMI_LATUS_RECTUM.index_in(&PLANAR_STATES);
const ECCENTRICITY_AT: usize = ECCENTRICITY_F.index_in(&PLANAR_STATES);
const TRUE_LONGITUDE_AT: usize = TRUE_LONGITUDE.index_in(&PLANAR_STATES);

impl Flown {
    fn of(indirect: &PhaseTrajectory, radau: &PhaseTrajectory) -> Self {
        let end = indirect.final_state();
        Self {
            time: indirect.final_time - indirect.initial_time,
            radau_time: radau.final_time - radau.initial_time,
            orbit: Orbit::of_latus_rectum(end[LATUS_RECTUM_AT], end[ECCENTRICITY_AT]),
            cut_off: end[TRUE_LONGITUDE_AT],
        }
    }
}

impl Burn {
    /// `time` (s) is a guess of its duration.
    pub(super) fn solve(&self, stage: &Stage, time: f64, solver: &mut Solver<'_>) -> Result<Flown, Stop> {
        let both = solver.both(&self.ocp(stage)?, &self.guess(stage, time)?)?;
        Ok(Flown::of(&both.indirect.phases[0], &both.radau.phases[0]))
    }

    fn ocp(&self, stage: &Stage) -> Result<Ocp, OcpError> {
        const NAME: &str = "burn";
        let end = match self.goal {
            Goal::Orbit(orbit) => [Some(orbit.latus_rectum()), Some(orbit.eccentricity)],
            Goal::Apogee(_) => [None, None],
        };
        let from = [Some(self.from.latus_rectum()), Some(self.from.eccentricity)];
        let phase = phase(stage, NAME, from, Some(self.mass), end);
        let mut ocp = ignition(Ocp::builder("one burn").phase(phase), stage, NAME, self.apsis);
        if let Goal::Apogee(radius) = self.goal {
            let row = Variable::new("apogee radius", "m").equal_to(radius).scaled_by(radius);
            let of =
                [At::FinalState(NAME, SEMI_LATUS_RECTUM.name), At::FinalState(NAME, ECCENTRICITY_F.name)];
            ocp = ocp.constrain("apogee", [row], of, ApogeeRadius);
        }
        ocp.minimize("burn time", "s", At::FinalTime(NAME)).build()
    }

    fn guess(&self, stage: &Stage, time: f64) -> Result<Guess, Stop> {
        let end = match self.goal {
            Goal::Orbit(orbit) => orbit,
            Goal::Apogee(radius) => between_apses(self.from.perigee(), radius),
        };
        let phase = phase_guess(stage, self.apsis, [self.from, end], self.mass, time)?;
        Ok(Guess::from_phases(&self.ocp(stage)?, vec![phase]))
    }
}

/// An orbit of given perigee and apogee radius, m.
fn between_apses(perigee: f64, apogee: f64) -> Orbit {
    Orbit { axis: 0.5 * (perigee + apogee), eccentricity: (apogee - perigee) / (apogee + perigee) }
}

/// The quantities that are free between the burns of a sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Between {
    /// The orbits.
    Orbits,
    /// Their size; the eccentricities are those of the guess.
    Sizes,
}

/// All burns of a sequence by the rule, with the least propellant, from a guess of the orbits after them and of the burn times (s).
pub(super) fn sequence(
    stage: &Stage,
    guess: &[(Orbit, f64)],
    between: Between,
    solver: &mut Solver<'_>,
) -> Result<Vec<Flown>, Stop> {
    let n = guess.len();
    let name = |k: usize| format!("burn-{}", k + 1);
    let fixed = |orbit: Orbit| [Some(orbit.latus_rectum()), Some(orbit.eccentricity)];
    let (parking, target) = (Orbit::circle(stage.parking_radius), Orbit::circle(stage.target_radius));
    let mut ocp = Ocp::builder(format!("sequence of {n} burns"));
    for (k, (orbit, _)) in guess.iter().enumerate() {
        let from = if k == 0 { fixed(parking) } else { [None; 2] };
        let to = match between {
            _ if k + 1 == n => fixed(target),
            Between::Orbits => [None; 2],
            Between::Sizes => [None, Some(orbit.eccentricity)],
        };
        let burn = phase(stage, &name(k), from, (k == 0).then_some(stage.mass), to);
        ocp = ignition(ocp.phase(burn), stage, &name(k), Apsis::of(k, n));
    }
    for k in 1..n {
        let (from, to) = (name(k - 1), name(k));
        for q in [SEMI_LATUS_RECTUM, ECCENTRICITY_F, MASS] {
            let row = Variable::new(q.name, q.unit).equal_to(0.0).scaled_by(size(stage, q));
            let ends = [At::FinalState(&from, q.name), At::InitialState(&to, q.name)];
            ocp = ocp.constrain(format!("{} from {from} to {to}", q.name), [row], ends, Loss);
        }
    }
    let ocp = ocp
        .maximize("final mass", "kg", At::FinalState(&name(n - 1), MASS.name))
        .objective_scale(stage.mass)
        .build()?;
    let (mut from, mut mass) = (parking, stage.mass);
    let mut phases = Vec::new();
    for (k, &(orbit, time)) in guess.iter().enumerate() {
        phases.push(phase_guess(stage, Apsis::of(k, n), [from, orbit], mass, time)?);
        (from, mass) = (orbit, mass - time * stage.mass_flow());
    }
    let both = solver.both(&ocp, &Guess::from_phases(&ocp, phases))?;
    Ok(both.indirect.phases.iter().zip(&both.radau.phases).map(|(p, radau)| Flown::of(p, radau)).collect())
}

/// One burn; the orbits' `[p, e]` and the mass at ignition are fixed where they are given, perigee on the first axis.
fn phase(
    stage: &Stage,
    name: &str,
    from: [Option<f64>; 2],
    mass: Option<f64>,
    to: [Option<f64>; 2],
) -> Phase {
    let [p, e] = from;
    let begin = [p, e, Some(0.0), None, mass];
    let [p, e] = to;
    let end = [p, e, Some(0.0), None, None];
    let fixed = |value: Option<f64>| value.map_or(Bounds::FREE, Bounds::fixed);
    let states = PLANAR_STATES.iter().zip(begin).zip(end).map(|((q, begin), end)| {
        let mut state = State::new(q.name, q.unit).scaled_by(size(stage, *q));
        if *q == SEMI_LATUS_RECTUM {
            // Only a trajectory without sense would come here: it keeps the iterates on orbits.
            state.variable.bounds = Bounds::at_least(0.1 * stage.parking_radius);
        }
        (state.initial, state.terminal) = (fixed(begin), fixed(end));
        state
    });
    Phase::new(name, PlanarThrust(stage.flight))
        .states(states)
        .controls([Variable::new(THRUST_ANGLE.name, THRUST_ANGLE.unit)])
        .direction(Direction::InPlane { angle: 0 })
        .initial_time(Bounds::fixed(0.0))
        .final_time(Bounds::new(1.0, stage.mass / stage.mass_flow()))
}

fn size(stage: &Stage, q: Quantity) -> f64 {
    match q {
        SEMI_LATUS_RECTUM => stage.target_radius,
        MASS => stage.mass,
        _ => 1.0,
    }
}

fn ignition(ocp: OcpBuilder, stage: &Stage, name: &str, apsis: Apsis) -> OcpBuilder {
    let row = Variable::new("time to the apsis less half the burn time", "s").equal_to(0.0).scaled_by(1e3);
    let at = |q: Quantity| At::InitialState(name, q.name);
    let ends = [
        at(SEMI_LATUS_RECTUM),
        at(ECCENTRICITY_F),
        at(ECCENTRICITY_G),
        at(TRUE_LONGITUDE),
        At::FinalTime(name),
    ];
    let rule = Ignition { mu: stage.mu(), apsis: apsis.longitude() };
    ocp.constrain(format!("ignition of {name}"), [row], ends, rule)
}

/// Orbits before and after the burn.
fn phase_guess(
    stage: &Stage,
    apsis: Apsis,
    [from, to]: [Orbit; 2],
    mass: f64,
    time: f64,
) -> Result<PhaseGuess, Stop> {
    let longitude = |orbit: Orbit, t: f64| {
        let start =
            PlanarEquinoctial::new([orbit.latus_rectum(), orbit.eccentricity, 0.0, apsis.longitude()]);
        longitude_after(stage.mu(), &start, t).map_err(|e| Stop::NotSolved(e.to_string()))
    };
    let state = |orbit: Orbit, t: f64, mass: f64| {
        Ok::<_, Stop>(vec![orbit.latus_rectum(), orbit.eccentricity, 0.0, longitude(orbit, t)?, mass])
    };
    let states =
        vec![state(from, -0.5 * time, mass)?, state(to, 0.5 * time, mass - time * stage.mass_flow())?];
    Ok(PhaseGuess::samples(&[0.0, time], states, vec![vec![0.0]; 2])?)
}

/// From the first ignition to the last cut-off with coasts to the next perigee, the last one to apogee, s.
pub(super) fn flight_time(stage: &Stage, burns: &[Flown]) -> f64 {
    let mut time: f64 = burns.iter().map(|b| b.time).sum();
    for (k, pair) in burns.windows(2).enumerate() {
        let [before, after] = pair else { continue };
        let apsis = match Apsis::of(k + 1, burns.len()) {
            // The next passage.
            Apsis::Perigee => 2.0 * PI,
            Apsis::Apogee => PI,
        };
        let (p, e) = (before.orbit.latus_rectum(), before.orbit.eccentricity);
        time += coast_duration(stage.mu(), p, e, 0.0, before.cut_off, apsis) - 0.5 * after.time;
    }
    time
}

/// Time from ignition to the apsis less half the burn time: `[p, f, g, L, burn time]`.
struct Ignition {
    mu: f64,
    apsis: f64,
}

impl VectorFunction<5, 1> for Ignition {
    fn evaluate<S: Scalar>(&self, z: &[S; 5]) -> [S; 1] {
        let [p, f, g, longitude, time] = *z;
        [coast_duration(self.mu, p, f, g, longitude, S::from(self.apsis)) - time * 0.5]
    }
}

/// The apogee radius of an orbit with its perigee on the first axis, `[p, f]`.
struct ApogeeRadius;

impl VectorFunction<2, 1> for ApogeeRadius {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
        [z[0] / (-z[1] + 1.0)]
    }
}

/// The first minus the second.
struct Loss;

impl VectorFunction<2, 1> for Loss {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
        [z[0] - z[1]]
    }
}
