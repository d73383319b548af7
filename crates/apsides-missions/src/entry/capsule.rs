//! The re-entry of a capsule: planet, vehicle, start, target, limits, goal and what steers it.

use apsides_dynamics::aerodynamics::AxisymmetricAerodynamics;
use apsides_dynamics::entry::{EntryFlight, EntryState};
use apsides_dynamics::great_circle::{central_angle, initial_course};
use apsides_ephemeris::Epoch;

use super::load::Load;
use super::steering::Steering;

/// The objective: what is to be least or largest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// Least heat load.
    HeatLoad,
    /// Least peak of a load.
    Peak(Load),
    /// Least factor on the lift that still reaches the target.
    LeastLift,
    /// Least distance of the end from the target.
    Miss,
    /// Largest distance of the end past the target along a bearing.
    Reach {
        /// The bearing at the target, rad from north towards east.
        bearing: f64,
        /// Largest distance of the end from the line through the target, m; none where it is free.
        half_width: Option<f64>,
    },
}

/// Re-entry of a capsule to a target under limits on its loads, steered by the bank angle. Altitudes are above the sphere of the planet's
/// radius; longitude and geocentric latitude are those on the rotating planet.
#[derive(Clone, Debug)]
pub struct CapsuleEntry {
    /// Planet with its atmosphere, capsule, convention of the azimuth and law of heating.
    pub flight: EntryFlight,
    /// State at the start.
    pub start: EntryState,
    /// Instant of the start where a message states it.
    pub epoch: Option<Epoch>,
    /// Altitude at the end, m.
    pub target_altitude: f64,
    /// Longitude and latitude at the end, rad; the goals [`Goal::Miss`] and [`Goal::Reach`] count from there.
    pub target: [f64; 2],
    /// The acceleration that is limited and reported: [`Load::TotalAcceleration`] or [`Load::NormalAcceleration`].
    pub acceleration: Load,
    /// Largest dynamic pressure, Pa; none where it is not limited.
    pub dynamic_pressure_limit: Option<f64>,
    /// Largest acceleration, m/s2; none where it is not limited.
    pub acceleration_limit: Option<f64>,
    /// Largest stagnation heat rate, W/m2; none where it is not limited.
    pub heat_rate_limit: Option<f64>,
    /// Longest time from start to end, s.
    pub longest_flight: f64,
    /// The quantity that is optimised.
    pub goal: Goal,
    /// The control of direct methods.
    pub steering: Steering,
    /// If true, the least factor on the lift that reaches the target is found too, which takes a solve of its own.
    pub margins: bool,
    /// The shape whose coefficients the capsule has in trim; none where its lift and drag are those of no shape.
    pub shape: Option<TrimmedShape>,
    /// The masses that point the lift in six degrees of freedom.
    pub steered: SteeredMasses,
}

/// A shape in the trim of a centre of mass off its axis.
#[derive(Clone, Debug)]
pub struct TrimmedShape {
    /// Coefficients of the shape.
    pub aerodynamics: AxisymmetricAerodynamics,
    /// Distance of the centre of mass from the axis, m.
    pub offset: f64,
}

/// Two masses on a rim that point the lift of a capsule in six degrees of freedom, and their law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SteeredMasses {
    /// Radii of gyration about the roll axis and across it, m, with the masses on the axis.
    pub gyration: [f64; 2],
    /// Mass of each of the two, kg.
    pub moving_mass: f64,
    /// Radius of their rim, m.
    pub rim_radius: f64,
    /// Largest speed along the rim, m/s; none where it is not limited.
    pub rate_limit: Option<f64>,
    /// Largest acceleration along the rim, m/s2; none where it is not limited.
    pub acceleration_limit: Option<f64>,
    /// Offset of the centre of mass along y and z that the law does not know, m.
    pub unknown_offset: [f64; 2],
    /// Frequency of the law's poles by that of the capsule's own oscillation.
    pub bandwidth: f64,
    /// Time between samples of the law, s, which is the step of the integration.
    pub sample_time: f64,
}

impl CapsuleEntry {
    /// The same capsule with another goal.
    #[must_use]
    pub fn with_goal(&self, goal: Goal) -> Self {
        Self { goal, ..self.clone() }
    }

    /// The loads that are limited, with their limits in SI.
    pub(super) fn limits(&self) -> impl Iterator<Item = (Load, f64)> + use<> {
        let limits = [self.dynamic_pressure_limit, self.acceleration_limit, self.heat_rate_limit];
        self.loads().into_iter().zip(limits).filter_map(|(load, limit)| Some((load, limit?)))
    }

    /// The loads that are reported.
    pub(super) fn loads(&self) -> [Load; 3] {
        [Load::DynamicPressure, self.acceleration, Load::HeatRate]
    }

    /// Returns true if the flight must end at the target.
    pub(super) fn must_reach_target(&self) -> bool {
        !matches!(self.goal, Goal::Miss | Goal::Reach { .. })
    }

    /// Great-circle distance (m) over the surface from a place, as longitude and latitude, to the target.
    pub(super) fn distance_to_target(&self, from: [f64; 2]) -> f64 {
        central_angle(from, self.target) * self.flight.planet.body.radius
    }

    /// Lift by drag at entry.
    pub(super) fn lift_to_drag(&self) -> f64 {
        self.flight.vehicle.lift_to_drag(self.flight.mach(self.start.altitude, self.start.speed))
    }

    /// Azimuth of the great circle from the start to the target, near that of the start.
    pub(super) fn course_to_target(&self) -> f64 {
        let course = initial_course(self.start.place(), self.target);
        let azimuth = self.flight.heading.of_course(course);
        let turns = ((self.start.azimuth - azimuth) / std::f64::consts::TAU).round();
        azimuth + turns * std::f64::consts::TAU
    }

    /// Speed (m/s) at which the drag carries the weight at the end.
    pub(super) fn terminal_speed(&self) -> f64 {
        let planet = &self.flight.planet;
        let [_, latitude] = self.target;
        let (sin, cos) = latitude.sin_cos();
        let (gravity, _) = planet.gravity(planet.body.radius + self.target_altitude, sin, cos);
        let density = planet.atmosphere.density(self.target_altitude);
        (2.0 * gravity * self.flight.vehicle.ballistic_coefficient(1.0) / density).sqrt()
    }
}
