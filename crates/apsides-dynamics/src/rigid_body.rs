//! Flight of a rigid body in six degrees of freedom, without thrust.
//!
//! States: position and velocity of the centre of mass relative to the ground, in the axes of the [`Ground`]; the attitude as a
//! [quaternion](crate::attitude) from body axes to the axes of the ground; the angular velocity relative to inertial space, in body axes.
//!
//! ```text
//! r' = v
//! v' = g(r, v) + R F / m
//! q' = q (0, w - R^T W) / 2
//! w' = I^-1 (M - w x I w)
//! ```
//!
//! with the angular velocity `W` of the ground, gravity `g` with the accelerations of its rotation, and the air's force `F` and moment `M`
//! about the centre of mass (B. L. Stevens, F. L. Lewis and E. N. Johnson, Aircraft Control and Simulation, 3rd ed., 2016, section 1.7).
//! The torque of the gradient of gravity is left out.
//!
//! The origin of the body axes is a point on the axis of the aerodynamic shape; the centre of mass is where the vehicle says.

use apsides_ad::vector::{cross, dot};
use apsides_ad::{Dynamics, Scalar};

use crate::aerodynamics::axisymmetric::transferred;
use crate::aerodynamics::{AirLoads, AxisymmetricAerodynamics, RangeLeft};
use crate::atmosphere::Atmosphere;
use crate::attitude;
use crate::error::{finite, positive};
use crate::{DynamicsError, Quantity};

mod ground;
mod inertia;
mod outputs;

pub use ground::{FlatEarth, Ground, Start, Wind};
pub use inertia::Inertia;
pub(crate) use inertia::solve_symmetric;
pub use outputs::FlightCondition;

/// States: position, velocity, attitude, angular velocity.
pub const STATES: [Quantity; 13] = [
    Quantity::new("position x", "m"),
    Quantity::new("position y", "m"),
    Quantity::new("position z", "m"),
    Quantity::new("velocity x", "m/s"),
    Quantity::new("velocity y", "m/s"),
    Quantity::new("velocity z", "m/s"),
    Quantity::new("attitude 0", "-"),
    Quantity::new("attitude 1", "-"),
    Quantity::new("attitude 2", "-"),
    Quantity::new("attitude 3", "-"),
    Quantity::new("roll rate", "rad/s"),
    Quantity::new("pitch rate", "rad/s"),
    Quantity::new("yaw rate", "rad/s"),
];

/// A rigid body of a mass and an inertia with the air and the ground that it flies over.
#[derive(Clone, Debug, PartialEq)]
pub struct RigidBody {
    /// The ground and its gravity.
    pub ground: Ground,
    /// The atmosphere, at rest relative to the ground but for the wind.
    pub atmosphere: Atmosphere,
    /// The wind, if any.
    pub wind: Option<Wind>,
    aerodynamics: AxisymmetricAerodynamics,
    mass: f64,
    inertia: Inertia,
    centre: [f64; 3],
}

/// The terms that all equations of motion share, whatever moves inside the body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Motion<S> {
    /// Rates of position, of velocity without the air, of attitude.
    position: [S; 3],
    fall: [S; 3],
    attitude: [S; 4],
    /// Rows of the matrix from body axes to those of the ground.
    axes: [[S; 3]; 3],
    /// Angular velocity.
    pub(crate) spin: [S; 3],
    /// Force and moment of the air.
    pub(crate) loads: AirLoads<S>,
}

impl RigidBody {
    /// A body of a mass (kg) and an inertia about its centre of mass, which is at `centre` (m) in body axes.
    ///
    /// # Errors
    /// When the mass is not positive and finite or the centre not finite.
    pub fn new(
        ground: Ground,
        atmosphere: Atmosphere,
        aerodynamics: AxisymmetricAerodynamics,
        mass: f64,
        inertia: Inertia,
        centre: [f64; 3],
    ) -> Result<Self, DynamicsError> {
        let mass = positive("mass of the vehicle", mass, "kg")?;
        for value in centre {
            finite("centre of mass", value, "m")?;
        }
        Ok(Self { ground, atmosphere, wind: None, aerodynamics, mass, inertia, centre })
    }

    /// The same in a wind.
    #[must_use]
    pub fn in_wind(self, wind: Wind) -> Self {
        Self { wind: Some(wind), ..self }
    }

    /// Mass, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// Inertia about the centre of mass.
    #[must_use]
    pub fn inertia(&self) -> &Inertia {
        &self.inertia
    }

    /// Centre of mass in body axes, m.
    #[must_use]
    pub fn centre(&self) -> [f64; 3] {
        self.centre
    }

    /// Aerodynamics of the shape.
    #[must_use]
    pub fn aerodynamics(&self) -> &AxisymmetricAerodynamics {
        &self.aerodynamics
    }

    /// Height and velocity relative to the air in the axes of the ground.
    #[inline(always)]
    fn wind<S: Scalar>(&self, x: &[S; 13]) -> (S, [S; 3]) {
        let (place, velocity) = ([x[0], x[1], x[2]], [x[3], x[4], x[5]]);
        match &self.wind {
            None => (self.ground.altitude(&place), velocity),
            Some(wind) => {
                let local = self.ground.local(&place);
                let [north, east] = wind.at(local.altitude);
                let carried = |k: usize| local.north[k] * north + local.east[k] * east;
                (local.altitude, std::array::from_fn(|k| velocity[k] - carried(k)))
            }
        }
    }

    /// Height, m, and velocity relative to the air in body axes, m/s, at a state.
    #[inline]
    pub fn air<S: Scalar>(&self, x: &[S; 13]) -> (S, [S; 3]) {
        let (altitude, air) = self.wind(x);
        (altitude, attitude::turned_back(&attitude::rotation(&[x[6], x[7], x[8], x[9]]), &air))
    }

    /// Motion and loads at a state.
    #[inline(always)]
    pub(crate) fn motion<S: Scalar>(&self, x: &[S; 13]) -> Motion<S> {
        let (place, velocity) = ([x[0], x[1], x[2]], [x[3], x[4], x[5]]);
        let (q, spin) = ([x[6], x[7], x[8], x[9]], [x[10], x[11], x[12]]);
        // What follows from the place comes first: a processor is done with it when the velocity is there, and little has to wait in
        // memory while it calls functions.
        let (altitude, air) = self.wind(x);
        let [density, sound] = self.atmosphere.density_and_sound(altitude);
        let fall = self.ground.gravity(&place, &velocity);
        let axes = attitude::rotation(&q);
        let square = dot(&air, &air);
        let air = attitude::turned_back(&axes, &air);
        let loads = match &self.atmosphere {
            Atmosphere::Vacuum => AirLoads { force: [S::from(0.0); 3], moment: [S::from(0.0); 3] },
            _ => self.aerodynamics.loads_at_speed(density, sound, square, &air, &spin),
        };
        let relative = match self.ground.rotation_rate() {
            None => spin,
            Some(rate) => std::array::from_fn(|k| spin[k] - axes[2][k] * rate),
        };
        Motion { position: velocity, fall, attitude: attitude::rate(&q, &relative), axes, spin, loads }
    }

    /// Rates of all states from a motion and an angular acceleration.
    #[inline(always)]
    pub(crate) fn assembled<S: Scalar>(&self, motion: &Motion<S>, angular: &[S; 3]) -> [S; 13] {
        let pushed = attitude::turned(&motion.axes, &motion.loads.force);
        let (r, q, w) = (motion.position, motion.attitude, angular);
        let by_mass = 1.0 / self.mass;
        let v: [S; 3] = std::array::from_fn(|k| motion.fall[k] + pushed[k] * by_mass);
        [r[0], r[1], r[2], v[0], v[1], v[2], q[0], q[1], q[2], q[3], w[0], w[1], w[2]]
    }

    /// Rates with the centre of mass at a point of the body axes (m), with the body's own inertia about it.
    #[inline(always)]
    pub(crate) fn rates_about<S: Scalar>(&self, x: &[S; 13], centre: &[S; 3]) -> [S; 13] {
        let motion = self.motion(x);
        let moment = transferred(&motion.loads, centre);
        let gyroscopic = cross(&motion.spin, &self.inertia.times(&motion.spin));
        let angular = self.inertia.solve(&std::array::from_fn(|k| moment[k] - gyroscopic[k]));
        self.assembled(&motion, &angular)
    }

    /// Flight condition at a state.
    #[must_use]
    pub fn condition(&self, x: &[f64; 13]) -> FlightCondition {
        let (altitude, air) = self.air(x);
        let loads = self.motion(x).loads;
        let [density, sound] = self.atmosphere.density_and_sound(altitude);
        FlightCondition::new(altitude, &air, [density, sound], loads.force.map(|f| f / self.mass))
    }

    /// Tells whether the coefficients at a state are those of the table.
    ///
    /// # Errors
    /// The quantity that has left the table. In vacuum nothing does.
    pub fn range_left(&self, x: &[f64; 13]) -> Result<(), RangeLeft> {
        if self.atmosphere == Atmosphere::Vacuum {
            return Ok(());
        }
        let condition = self.condition(x);
        self.aerodynamics.table().range_left(condition.mach, condition.total_attack)
    }

    /// The total angle of attack, rad, that the offset of the centre of mass from the axis trims at a Mach number, if the table has one.
    #[must_use]
    pub fn trim_angle(&self, mach: f64) -> Option<f64> {
        self.aerodynamics.trim_angle(mach, self.centre[1].hypot(self.centre[2]))
    }

    /// Frequency of the oscillation in pitch, Hz, at a Mach number and a dynamic pressure (Pa), by
    /// [`AxisymmetricAerodynamics::static_frequency`].
    #[must_use]
    pub fn static_frequency(&self, mach: f64, dynamic_pressure: f64) -> Option<f64> {
        self.aerodynamics.static_frequency(mach, dynamic_pressure, self.inertia.matrix()[1][1])
    }
}

/// The body alone: nothing is steered.
impl Dynamics<13, 0> for RigidBody {
    #[inline]
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 13], _u: &[S; 0], _p: &[S; 0]) -> [S; 13] {
        self.rates_about(x, &self.centre.map(S::from))
    }
}
