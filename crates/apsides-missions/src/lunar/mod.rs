//! Planar lunar soft landings, from those of Jamilnia 2017 (constant thrust in minimum time) on.
//!
//! Strategies: from a circular orbit ([`DirectLanding`]); from the perilune of a Hohmann transfer ([`PeriluneLanding`]); from that
//! perilune with horizontal braking to a gate above the site, then a vertical descent ([`TwoPhaseLanding`]); the whole transfer with its
//! deorbit burn and coast ([`LunarTransfer`]). All end with zero horizontal speed and a given radial speed. The throttle may be free, the
//! rate of the thrust angle limited. All share a [`LunarLander`].

use apsides_dynamics::Hohmann;
use apsides_dynamics::planar::{HORIZONTAL_SPEED, MASS, RADIAL_SPEED, RADIUS};
use apsides_ephemeris::Motion;
use apsides_ocp::{At, Bounds, Guess, Ocp, OcpBuilder, Phase, PhaseGuess, Sense, Term, Trajectory, Variable};
use apsides_pipeline::dispersion::Dispersed;
use apsides_pipeline::method::{MethodName, Methods};
use apsides_pipeline::placing::Whereabouts;
use apsides_pipeline::values::Values;
use apsides_pipeline::{Cancellation, Curve, Error, Kind, Mission, Offers, Posed, Scalars};
use apsides_radau::Explanation;

use crate::Refuse;
use crate::data::point_about;
use crate::deviating_flight::COLUMNS;
use dispersed::{PlannedLanding, begun};
use ignition::Ignition;
use motion::LandingMotion;
use phases::{COAST, DESCENT, PeriluneAltitude, Target};

mod departure;
mod dispersed;
#[cfg(feature = "flatness")]
mod flat;
mod guess;
mod ignition;
mod keys;
mod lander;
mod motion;
mod phases;
mod results;

pub use departure::FreeDeparture;
pub use lander::{LunarLander, Objective, Throttle, TouchdownThrust};

/// A soft landing from a circular lunar orbit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectLanding {
    /// Vehicle, orbit and engine.
    pub lander: LunarLander,
}

/// A soft landing from the perilune of a Hohmann transfer, which an impulse begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PeriluneLanding {
    /// Vehicle, orbit and engine.
    pub lander: LunarLander,
    /// Altitude of the perilune above the surface, m.
    pub perilune_altitude: f64,
    /// Impulse against the motion with which the perilune is left, m/s.
    pub departure_impulse: f64,
    /// Its bound where its size is optimised; the flight then has the largest final mass.
    pub free_departure: Option<FreeDeparture>,
}

/// Braking from a perilune to a gate with no horizontal speed, then a vertical descent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoPhaseLanding {
    /// Vehicle, orbit and engine.
    pub lander: LunarLander,
    /// Altitude of the perilune above the surface, m.
    pub perilune_altitude: f64,
    /// Altitude of the gate above the surface, m.
    pub gate_altitude: f64,
}

/// The whole way from a circular lunar orbit to the surface: deorbit burn, coast and braking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LunarTransfer {
    /// Vehicle, orbit and engine.
    pub lander: LunarLander,
    /// Least altitude of the perilune of the coast above the surface, m.
    pub perilune_floor: f64,
}

/// Scalars and curves of a landing, which are those of its lander, and the keys of the results that name it.
macro_rules! results_of_its_lander {
    ($headline:expr) => {
        fn results(&self, solution: &Trajectory) -> Scalars {
            self.lander.results(solution)
        }

        fn whereabouts(&self) -> Whereabouts {
            point_about(self.lander.flight.body.gravitational_parameter)
        }

        fn motion<'a>(&'a self, solution: &'a Trajectory) -> Option<Box<dyn Motion + 'a>> {
            LandingMotion::of(&self.lander, solution).map(|motion| Box::new(motion) as Box<dyn Motion>)
        }

        fn dispersed(&self, plan: &Trajectory) -> Result<Option<Box<dyn Dispersed>>, Error> {
            let mission = *self;
            let rest = move |lander: &LunarLander, first: usize, time: f64, state: &[f64]| {
                mission.rest(lander, first, time, state)
            };
            Ok(Some(Box::new(PlannedLanding::new(&self.lander, plan, Box::new(rest))?)))
        }

        fn datum(&self) -> Option<f64> {
            Some(self.lander.flight.body.radius)
        }

        fn missing(
            &self,
            _methods: &Methods,
            explanation: &Explanation,
            _cancellation: &Cancellation,
        ) -> Option<String> {
            self.lander.missing_thrust(explanation)
        }

        fn undetermined(&self, solution: &Trajectory) -> Option<String> {
            self.lander.without_direction(solution)
        }

        fn headline(&self) -> Vec<&str> {
            $headline.to_vec()
        }

        fn curves(&self, solution: &Trajectory) -> Vec<Curve> {
            self.lander.curves(solution)
        }
    };
}

/// Landings have a place about their body, and deviating flights.
const PLACED: Offers = Offers {
    simulated_only: false,
    simulation: false,
    footprint: false,
    ephemeris: true,
    dispersed: COLUMNS,
};

impl DirectLanding {
    fn ignition(&self, refuse: Refuse<'_>) -> Result<Ignition, Error> {
        Ignition::in_orbit(&self.lander, refuse)
    }
}

impl DirectLanding {
    /// The rest of the landing of a lander from a state in one of its phases on.
    fn rest(&self, lander: &LunarLander, first: usize, time: f64, state: &[f64]) -> Result<Ocp, Error> {
        let ignition = Ignition::in_orbit(lander, &|reason| Error::in_mission(reason))?;
        let phases = ignition.landing(ignition.touchdown());
        rest_of_landing(phases, &ignition, first, time, state)
    }
}

impl Mission for DirectLanding {
    fn kind() -> Kind {
        Kind::new::<Self>(
            "lunar-direct",
            "Soft landing from a circular lunar orbit: full thrust in minimum time, or throttled with least propellant",
            &[keys::COMMON, keys::THROTTLE_IN_ORBIT, keys::TOUCHDOWN, keys::PITCH_RATE, keys::OBJECTIVES],
        )
        .offering(PLACED)
    }

    fn read(values: &Values) -> Result<Self, Error> {
        let mission = Self { lander: throttled_lander(values)? };
        mission.ignition(&|reason| values.conflict(reason))?;
        Ok(mission)
    }

    fn pose(&self, _method: MethodName) -> Result<Posed, Error> {
        single(&self.ignition(&|reason| Error::in_mission(reason))?)
    }

    results_of_its_lander!(HEADLINE);
}

impl PeriluneLanding {
    /// The perilune as the transfer passes it.
    fn perilune(&self, refuse: Refuse<'_>) -> Result<Ignition, Error> {
        Ignition::at_perilune(&self.lander, self.perilune_altitude, keys::PERILUNE_ALTITUDE, refuse)
    }

    fn ignition(&self, refuse: Refuse<'_>) -> Result<Ignition, Error> {
        self.perilune(refuse)?.after_impulse(self.departure_impulse, refuse)
    }

    /// The landing with the size of its impulse as an unknown. No description in flat outputs has it.
    fn with_free_departure(&self, departure: FreeDeparture) -> Result<Posed, Error> {
        let refuse: Refuse<'_> = &|reason| Error::in_mission(reason);
        let perilune = self.perilune(refuse)?;
        let mut phases = perilune.landing(perilune.touchdown());
        phases[0] = departure.opened(phases[0].clone());
        let [first, last] = [&phases[0], &phases[phases.len() - 1]].map(|p| p.name.clone());
        let ocp = departure.posed(chain("lunar landing after an impulse", phases), &first, &perilune);
        let ocp = objective(ocp, &last, &perilune).build()?;
        let start = self.ignition(refuse)?;
        let (guesses, _) = landing_guess(&start, start.touchdown(), self.lander.touchdown_radial_speed)?;
        let guess = Guess { parameters: vec![self.departure_impulse], ..Guess::from_phases(&ocp, guesses) };
        Ok(Posed::new(ocp, guess))
    }
}

impl PeriluneLanding {
    /// The rest of the landing of a lander from a state in one of its phases on.
    fn rest(&self, lander: &LunarLander, first: usize, time: f64, state: &[f64]) -> Result<Ocp, Error> {
        let ignition = Self { lander: *lander, ..*self }.ignition(&|reason| Error::in_mission(reason))?;
        let phases = ignition.landing(ignition.touchdown());
        rest_of_landing(phases, &ignition, first, time, state)
    }
}

impl Mission for PeriluneLanding {
    fn kind() -> Kind {
        Kind::new::<Self>(
            "lunar-perilune",
            "Soft landing from the perilune of a Hohmann transfer: full thrust in minimum time, or throttled with least propellant",
            &[
                keys::COMMON,
                keys::PERILUNE,
                keys::DEPARTURE,
                keys::THROTTLE,
                keys::TOUCHDOWN,
                keys::PITCH_RATE,
                keys::OBJECTIVES,
            ],
        )
        .offering(PLACED)
    }

    fn read(values: &Values) -> Result<Self, Error> {
        let mut mission = Self {
            lander: throttled_lander(values)?,
            perilune_altitude: values.number(keys::PERILUNE_ALTITUDE)? * 1e3,
            departure_impulse: values.number(keys::DEPARTURE_IMPULSE)?,
            free_departure: None,
        };
        if values.flag(keys::FREE_DEPARTURE)? {
            mission.lander.objective = Objective::FinalMass;
            mission.free_departure = Some(free_departure(values, &mission)?);
        }
        mission.ignition(&|reason| values.conflict(reason))?;
        Ok(mission)
    }

    fn pose(&self, _method: MethodName) -> Result<Posed, Error> {
        match self.free_departure {
            Some(departure) => self.with_free_departure(departure),
            None => single(&self.ignition(&|reason| Error::in_mission(reason))?),
        }
    }

    results_of_its_lander!(HEADLINE);
}

impl TwoPhaseLanding {
    /// Ignition at a perilune that is above the gate. With a limited pitch rate the thrust is upright at the gate, where the descent
    /// takes over.
    fn ignition(&self, refuse: Refuse<'_>) -> Result<Ignition, Error> {
        let lander = self.lander.upright_where_it_pitches();
        let ignition =
            Ignition::at_perilune(&lander, self.perilune_altitude, keys::PERILUNE_ALTITUDE, refuse)?;
        if self.gate_altitude >= self.perilune_altitude {
            return Err(refuse(format!(
                "`{}` is {}, it must be below the perilune (`{}` = {})",
                keys::GATE_ALTITUDE,
                self.gate_altitude / 1e3,
                keys::PERILUNE_ALTITUDE,
                self.perilune_altitude / 1e3
            )));
        }
        Ok(ignition)
    }
}

impl TwoPhaseLanding {
    /// The rest of the landing of a lander from a state in one of its phases on.
    fn rest(&self, lander: &LunarLander, first: usize, time: f64, state: &[f64]) -> Result<Ocp, Error> {
        let ignition = Self { lander: *lander, ..*self }.ignition(&|reason| Error::in_mission(reason))?;
        let target = Target { radius: ignition.body_radius() + self.gate_altitude, radial_speed: None };
        let mut phases = ignition.landing(target);
        phases.push(ignition.descent(self.gate_altitude));
        rest_of_landing(phases, &ignition, first, time, state)
    }
}

impl Mission for TwoPhaseLanding {
    fn kind() -> Kind {
        Kind::new::<Self>(
            "lunar-two-phase",
            "Horizontal braking from perilune to a gate, then vertical descent: full thrust in minimum time, or throttled with least propellant",
            &[keys::COMMON, keys::PERILUNE, keys::GATE, keys::THROTTLE, keys::PITCH_RATE, keys::OBJECTIVES],
        )
        .offering(PLACED)
    }

    fn read(values: &Values) -> Result<Self, Error> {
        let mission = Self {
            lander: LunarLander {
                throttle: Throttle::read(values)?,
                objective: Objective::read(values)?,
                ..LunarLander::read(values)?
            },
            perilune_altitude: values.number(keys::PERILUNE_ALTITUDE)? * 1e3,
            gate_altitude: values.number(keys::GATE_ALTITUDE)? * 1e3,
        };
        mission.ignition(&|reason| values.conflict(reason))?;
        Ok(mission)
    }

    fn pose(&self, _method: MethodName) -> Result<Posed, Error> {
        let ignition = self.ignition(&|reason| Error::in_mission(reason))?;
        let (lander, gate) = (ignition.lander, self.gate_altitude);
        let target = Target { radius: ignition.body_radius() + gate, radial_speed: None };
        let mut phases = ignition.landing(target);
        phases.push(ignition.descent(self.gate_altitude));
        let ocp = chain("lunar landing in two phases", phases);
        let ocp = objective(ocp, DESCENT, &ignition).build()?;
        // At constant deceleration from twice the mean speed; half of lunar gravity is a usual net deceleration.
        let speed = -(gate * lander.flight.body.surface_gravity()).sqrt();
        let (mut guesses, (begin, mass)) = landing_guess(&ignition, target, speed)?;
        let time = 2.0 * gate / speed.abs();
        let final_mass = (mass - time * lander.flight.engine.mass_flow()).max(lander.dry_mass);
        guesses.push(PhaseGuess::samples(
            &[begin, begin + time],
            vec![
                vec![target.radius, speed, mass],
                vec![ignition.body_radius(), lander.touchdown_radial_speed, final_mass],
            ],
            vec![vec![1.0; usize::from(lander.throttles())]; 2],
        )?);
        let guess = Guess::from_phases(&ocp, guesses);
        let posed = Posed::new(ocp, guess);
        #[cfg(feature = "flatness")]
        let posed = ignition.with_flat_two_phase_landing(posed);
        Ok(posed)
    }

    results_of_its_lander!(&[
        "flight_time_s",
        "braking_time_s",
        "descent_time_s",
        "gate_radial_velocity_m_s",
        "final_mass_kg"
    ]);
}

impl LunarTransfer {
    /// Parking orbit, Hohmann transfer to the floor, ignition there.
    fn legs(&self, refuse: Refuse<'_>) -> Result<(Ignition, Hohmann, Ignition), Error> {
        let parking = Ignition::in_orbit(&self.lander, refuse)?;
        let (transfer, arrival) =
            parking.after_transfer(self.perilune_floor, keys::PERILUNE_FLOOR, refuse)?;
        Ok((parking, transfer, arrival))
    }
}

impl LunarTransfer {
    /// The rest of the flight of a lander from a state in one of its phases on; the coast has its floor as long as it is ahead.
    fn rest(&self, lander: &LunarLander, first: usize, time: f64, state: &[f64]) -> Result<Ocp, Error> {
        let (parking, _, arrival) =
            Self { lander: *lander, ..*self }.legs(&|reason| Error::in_mission(reason))?;
        let phases = begun_from(transfer_phases(&parking), first, time, state);
        let last = phases.last().map(|p| p.name.clone()).unwrap_or_default();
        let mut ocp = chain("rest of a lunar transfer", phases);
        if first == 0 {
            ocp = self.above_floor(ocp, &arrival);
        }
        Ok(ocp
            .maximize("final_mass", "kg", At::FinalState(&last, MASS.name))
            .objective_scale(parking.mass)
            .build()?)
    }

    /// The limit on the perilune of the coast.
    fn above_floor(&self, ocp: OcpBuilder, arrival: &Ignition) -> OcpBuilder {
        let altitude = Variable::new("perilune altitude", "m")
            .at_least(self.perilune_floor)
            .scaled_by(arrival.body_radius());
        let at_coast = |q: apsides_dynamics::Quantity| At::InitialState(COAST, q.name);
        ocp.constrain(
            "clearance of the coast",
            [altitude],
            [RADIUS, HORIZONTAL_SPEED, RADIAL_SPEED].map(at_coast),
            PeriluneAltitude(self.lander.flight),
        )
    }
}

impl Mission for LunarTransfer {
    fn kind() -> Kind {
        Kind::new::<Self>(
            "lunar-transfer",
            "The whole way from a circular lunar orbit to the surface: deorbit burn, coast and braking with least propellant",
            &[keys::COMMON, keys::FLOOR, keys::TOUCHDOWN, keys::PITCH_RATE],
        )
        .offering(PLACED)
    }

    fn read(values: &Values) -> Result<Self, Error> {
        let lander =
            LunarLander { touchdown_thrust: TouchdownThrust::read(values)?, ..LunarLander::read(values)? };
        let mission = Self { lander, perilune_floor: values.number(keys::PERILUNE_FLOOR)? * 1e3 };
        mission.legs(&|reason| values.conflict(reason))?;
        Ok(mission)
    }

    fn pose(&self, _method: MethodName) -> Result<Posed, Error> {
        let (parking, hohmann, arrival) = self.legs(&|reason| Error::in_mission(reason))?;
        let (target, phases) = (parking.touchdown(), transfer_phases(&parking));
        let last = phases[phases.len() - 1].name.clone();
        let ocp = self
            .above_floor(chain("lunar transfer and landing", phases), &arrival)
            .maximize("final_mass", "kg", At::FinalState(&last, MASS.name))
            .objective_scale(parking.mass)
            .build()?;
        let [deorbit, coast] = parking.transfer_points(&hohmann, &arrival);
        let begin = guess::end(&coast);
        let braking = arrival.braking_points(target, self.lander.touchdown_radial_speed, begin);
        let mut guesses =
            vec![guess::powered(&deorbit, &self.lander.at_full_thrust())?, guess::coasting(&coast)?];
        for points in &braking {
            guesses.push(guess::powered(points, &self.lander)?);
        }
        let guess = Guess::from_phases(&ocp, guesses);
        Ok(Posed::new(ocp, guess))
    }

    results_of_its_lander!(&[
        "final_mass_kg",
        "deorbit_time_s",
        "coast_time_s",
        "braking_time_s",
        "perilune_altitude_km"
    ]);
}

const HEADLINE: &[&str] = &["flight_time_s", "final_mass_kg", "final_thrust_angle_deg"];

/// The lander with the keys of the throttle and of the thrust at touchdown.
fn throttled_lander(values: &Values) -> Result<LunarLander, Error> {
    Ok(LunarLander {
        throttle: Throttle::read(values)?,
        objective: Objective::read(values)?,
        touchdown_thrust: TouchdownThrust::read(values)?,
        ..LunarLander::read(values)?
    })
}

/// The bound of an impulse whose size is optimised: from the one given on, below the speed at the perilune.
fn free_departure(values: &Values, mission: &PeriluneLanding) -> Result<FreeDeparture, Error> {
    let largest = values.number(keys::LARGEST_DEPARTURE)?;
    if mission.departure_impulse > largest {
        return Err(values.conflict(format!(
            "`{}` is {}, it must not be above `{}` = {largest}",
            keys::DEPARTURE_IMPULSE,
            mission.departure_impulse,
            keys::LARGEST_DEPARTURE
        )));
    }
    let speed = mission.perilune(&|reason| values.conflict(reason))?.horizontal_speed;
    if largest >= speed {
        return Err(values.conflict(format!(
            "`{}` is {largest}, it must be below the speed at the perilune, {speed:.1} m/s",
            keys::LARGEST_DEPARTURE
        )));
    }
    Ok(FreeDeparture { largest })
}

/// Time where the thrust is full, for it is the propellant then, unless the mass is asked for; else the final mass.
fn objective(ocp: OcpBuilder, last: &str, ignition: &Ignition) -> OcpBuilder {
    if ignition.lander.saves_propellant() || ignition.lander.objective == Objective::FinalMass {
        ocp.maximize("final_mass", "kg", At::FinalState(last, MASS.name)).objective_scale(ignition.mass)
    } else {
        ocp.objective(Sense::Minimize, "flight_time", "s", [Term::End(At::FinalTime(last), 1.0)])
            .objective_scale(ignition.expected_time())
    }
}

/// Phases in their order, each linked to the next.
fn chain(name: &str, phases: Vec<Phase>) -> OcpBuilder {
    let names: Vec<String> = phases.iter().map(|p| p.name.clone()).collect();
    let ocp = phases.into_iter().fold(Ocp::builder(name), OcpBuilder::phase);
    names.windows(2).fold(ocp, |ocp, pair| ocp.link(&pair[0], &pair[1]))
}

/// Deorbit burn, coast and braking.
fn transfer_phases(parking: &Ignition) -> Vec<Phase> {
    let times = Bounds::new(0.0, parking.longest_burn() + parking.longest_coast());
    let mut phases = vec![parking.deorbit(times), parking.coast(times)];
    phases.extend(parking.braking(parking.touchdown(), parking.longest_angle(true), times));
    phases
}

/// The phases from one of them on, which begins at a time in a state.
fn begun_from(phases: Vec<Phase>, first: usize, time: f64, state: &[f64]) -> Vec<Phase> {
    let mut phases: Vec<Phase> = phases.into_iter().skip(first).collect();
    if !phases.is_empty() {
        let begin = phases.remove(0);
        phases.insert(0, begun(begin, time, state));
    }
    phases
}

/// The rest of a landing as a problem.
fn rest_of_landing(
    phases: Vec<Phase>,
    ignition: &Ignition,
    first: usize,
    time: f64,
    state: &[f64],
) -> Result<Ocp, Error> {
    let last = phases.last().map(|p| p.name.clone()).unwrap_or_default();
    let ocp = chain("rest of a lunar landing", begun_from(phases, first, time, state));
    Ok(objective(ocp, &last, ignition).build()?)
}

/// From the ignition to the surface.
fn single(ignition: &Ignition) -> Result<Posed, Error> {
    let lander = &ignition.lander;
    let phases = ignition.landing(ignition.touchdown());
    let last = phases[phases.len() - 1].name.clone();
    let ocp = objective(chain("lunar landing", phases), &last, ignition).build()?;
    let (guesses, _) = landing_guess(ignition, ignition.touchdown(), lander.touchdown_radial_speed)?;
    let guess = Guess::from_phases(&ocp, guesses);
    let posed = Posed::new(ocp, guess);
    #[cfg(feature = "flatness")]
    let posed = ignition.with_flat_landing(posed);
    Ok(posed)
}

/// Guesses of the phases of a landing with a guessed radial speed at the target, and time and mass there.
fn landing_guess(
    ignition: &Ignition,
    target: Target,
    radial_speed: f64,
) -> Result<(Vec<PhaseGuess>, (f64, f64)), Error> {
    let mut guesses = Vec::new();
    let mut begin = (0.0, 0.0);
    if ignition.lander.throttle == Throttle::Coast {
        let coast = ignition.coast_points();
        begin = guess::end(&coast);
        guesses.push(guess::coasting(&coast)?);
    }
    let mut end = (begin.0, ignition.mass);
    for points in ignition.braking_points(target, radial_speed, begin) {
        guesses.push(guess::powered(&points, &ignition.lander)?);
        end = points.last().map_or(end, |p| (p.time, p.mass));
    }
    Ok((guesses, end))
}
