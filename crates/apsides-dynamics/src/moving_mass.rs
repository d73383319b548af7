//! A rigid body steered by two masses that move inside it.
//!
//! The whole, of mass `m`, has its centre of mass at `c` when both masses `m_i` are on the axis at their station `b`. At the distances `d_i` from
//! the axis they move it to `c + sum m_i d_i / m`.
//!
//! Quasi-static model (two controls: the positions): the centre of mass is where the masses are, inertia and momentum do not know that they
//! move. This is the model of the moving-mass reference.
//!
//! Full model (six controls: positions, speeds, accelerations): linear and angular momentum of body and masses together. With `s_i = r_i - c` from
//! the instantaneous centre of mass, the inertia `J` about it and `h = sum m_i s_i x r_i'`,
//!
//! ```text
//! H = J w + h,   H' + w x H = M   =>   J w' = M - w x (J w + h) - J' w - sum m_i s_i x r_i''
//! ```
//!
//! where the dots are derivatives in body axes; body and masses push each other, which does not move their centre of mass, whose position and
//! velocity are the states (D. T. Greenwood, Principles of Dynamics, 2nd ed., 1988, chapters 4 and 8; C. Petsopoulos, F. J. Regan and J. Barlow,
//! Moving-mass roll control system for fixed-trim re-entry vehicle, J. Spacecraft and Rockets 33, 1996, 54). The air meets the body at the
//! velocity of the centre of mass.

use apsides_ad::vector::{add, cross, dot};
use apsides_ad::{Dynamics, Scalar};

use crate::aerodynamics::RangeLeft;
use crate::aerodynamics::axisymmetric::transferred;
use crate::error::{finite, positive};
use crate::rigid_body::{FlightCondition, Inertia, RigidBody, solve_symmetric};
use crate::{DynamicsError, Quantity};

/// The paths of the two masses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Layout {
    /// The first along y, the second along z, both across the axis. Positions in m.
    Cross {
        /// Largest distance from the axis to both sides, m.
        travel: f64,
    },
    /// Both on a rim about the axis, `d = radius (0, sin theta, cos theta)`: from z towards y. Positions in rad.
    Radial {
        /// Radius of the rim, m.
        radius: f64,
    },
}

impl Layout {
    /// The cross of the reference: slides of 0.70 m to both sides.
    pub const CROSS: Self = Self::Cross { travel: 0.70 };
    /// The rim of the reference: 0.75 m.
    pub const RADIAL: Self = Self::Radial { radius: 0.75 };

    /// Positions of the masses.
    #[must_use]
    pub fn positions(&self) -> [Quantity; 2] {
        match self {
            Self::Cross { .. } => [Quantity::new("mass along y", "m"), Quantity::new("mass along z", "m")],
            Self::Radial { .. } => {
                [Quantity::new("angle of mass 1", "rad"), Quantity::new("angle of mass 2", "rad")]
            }
        }
    }

    /// Tells whether positions are within the travel.
    ///
    /// # Errors
    /// The position that is not. On a rim all angles are, if finite.
    pub fn range_left(&self, positions: [f64; 2]) -> Result<(), RangeLeft> {
        let limit = match self {
            Self::Cross { travel } => *travel,
            Self::Radial { .. } => f64::MAX,
        };
        for (quantity, value) in self.positions().into_iter().zip(positions) {
            let inside = value.abs() <= limit;
            if !inside {
                return Err(RangeLeft { quantity, value, range: [-limit, limit] });
            }
        }
        Ok(())
    }

    /// Distances from the axis, in body axes, m.
    #[inline]
    pub fn displacements<S: Scalar>(&self, [a, b]: &[S; 2]) -> [[S; 3]; 2] {
        let o = S::from(0.0);
        match self {
            Self::Cross { .. } => [[o, *a, o], [o, o, *b]],
            Self::Radial { radius } => [on_rim(*radius, *a), on_rim(*radius, *b)],
        }
    }

    /// Distances from the axis with their first and second derivatives in time, in body axes, from positions, speeds and accelerations.
    #[inline]
    fn motions<S: Scalar>(&self, u: &[S; 6]) -> [[[S; 3]; 3]; 2] {
        let o = S::from(0.0);
        let one = |k: usize| {
            let (position, speed, acceleration) = (u[k], u[k + 2], u[k + 4]);
            match self {
                Self::Cross { .. } => [position, speed, acceleration].map(|c| {
                    let mut v = [o; 3];
                    v[1 + k] = c;
                    v
                }),
                Self::Radial { radius } => {
                    let (sin, cos) = position.sin_cos();
                    let (sin, cos) = (sin * *radius, cos * *radius);
                    let inward = speed.square();
                    [
                        [o, sin, cos],
                        [o, cos * speed, -sin * speed],
                        [o, cos * acceleration - sin * inward, -sin * acceleration - cos * inward],
                    ]
                }
            }
        };
        [one(0), one(1)]
    }
}

/// A vehicle with two moving masses.
///
/// As [`Dynamics`] with 2 controls it is the quasi-static model, with 6 the full one, both of the [states](crate::rigid_body::STATES) of a rigid
/// body.
#[derive(Clone, Debug, PartialEq)]
pub struct MovingMassVehicle {
    body: RigidBody,
    layout: Layout,
    masses: [f64; 2],
    /// The same by the mass of the whole.
    shares: [f64; 2],
    station: f64,
    /// Inertia about the origin of the body axes without the masses.
    shell: [[f64; 3]; 3],
}

/// Centre of mass and inertia of the whole at one time, with their rates, in body axes.
struct Whole<S> {
    centre: [S; 3],
    /// Per mass: place from the centre of mass, speed, acceleration.
    parts: [[[S; 3]; 3]; 2],
    /// Speed and acceleration of the centre of mass.
    drift: [[S; 3]; 2],
    inertia: [[S; 3]; 3],
    inertia_rate: [[S; 3]; 3],
}

impl MovingMassVehicle {
    /// A body of which two masses (kg) are part, whose station is `station` (m) along its axis. Mass, inertia and centre of mass of the body are
    /// those with both masses on the axis.
    ///
    /// # Errors
    /// When a mass is negative or not finite, both together are not less than the body, a length is not finite or not positive, or when without
    /// the masses no body remains: its inertia must be possible.
    pub fn new(
        body: RigidBody,
        layout: Layout,
        masses: [f64; 2],
        station: f64,
    ) -> Result<Self, DynamicsError> {
        match layout {
            Layout::Cross { travel } => positive("travel of the masses", travel, "m")?,
            Layout::Radial { radius } => positive("radius of the rim", radius, "m")?,
        };
        for value in masses {
            if !(0.0..f64::INFINITY).contains(&value) {
                let (what, allowed) = ("moving mass", "a finite number not below 0");
                return Err(DynamicsError::Parameter { what, value, unit: "kg", allowed });
            }
        }
        let station = finite("station of the masses", station, "m")?;
        let rest = positive("mass without the moving masses", body.mass() - masses[0] - masses[1], "kg")?;
        let at = [station, 0.0, 0.0];
        let [held, moved] = [spread(&body.centre()), spread(&at)];
        let sum = masses[0] + masses[1];
        let shell: [[f64; 3]; 3] = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                body.inertia().matrix()[i][j] + body.mass() * held[i][j] - sum * moved[i][j]
            })
        });
        // The rest about its own centre of mass.
        let own: [f64; 3] = std::array::from_fn(|k| (body.mass() * body.centre()[k] - sum * at[k]) / rest);
        let own = spread(&own);
        Inertia::new(std::array::from_fn(|i| std::array::from_fn(|j| shell[i][j] - rest * own[i][j])))?;
        let shares = masses.map(|m| m / body.mass());
        Ok(Self { body, layout, masses, shares, station, shell })
    }

    /// The body with both masses on the axis.
    #[must_use]
    pub fn body(&self) -> &RigidBody {
        &self.body
    }

    /// The paths of the masses.
    #[must_use]
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// The moving masses, kg.
    #[must_use]
    pub fn masses(&self) -> [f64; 2] {
        self.masses
    }

    /// Station of the masses along the axis, m.
    #[must_use]
    pub fn station(&self) -> f64 {
        self.station
    }

    /// Centre of mass of the whole, in body axes (m), with the masses at positions.
    #[inline]
    pub fn centre<S: Scalar>(&self, positions: &[S; 2]) -> [S; 3] {
        let [first, second] = self.shares;
        let [x, y, z] = self.body.centre();
        match self.layout {
            Layout::Cross { .. } => {
                let [a, b] = *positions;
                [S::from(x), a * first + y, b * second + z]
            }
            Layout::Radial { .. } => {
                let [a, b] = self.layout.displacements(positions);
                [S::from(x), a[1] * first + b[1] * second + y, a[2] * first + b[2] * second + z]
            }
        }
    }

    /// Flight condition at a state.
    #[must_use]
    pub fn condition(&self, x: &[f64; 13]) -> FlightCondition {
        self.body.condition(x)
    }

    /// Tells whether the coefficients at a state are those of the table and the positions of the masses within their travel.
    ///
    /// # Errors
    /// The quantity that has left its range.
    pub fn range_left(&self, x: &[f64; 13], positions: [f64; 2]) -> Result<(), RangeLeft> {
        self.layout.range_left(positions)?;
        self.body.range_left(x)
    }

    /// The total angle of attack, rad, that the centre of mass trims at a Mach number with the masses at positions, if the table has one.
    #[must_use]
    pub fn trim_angle(&self, mach: f64, positions: [f64; 2]) -> Option<f64> {
        let [_, y, z] = self.centre(&positions);
        self.body.aerodynamics().trim_angle(mach, y.hypot(z))
    }

    #[inline]
    fn whole<S: Scalar>(&self, u: &[S; 6]) -> Whole<S> {
        let motions = self.layout.motions(u);
        let mass = self.body.mass();
        let moved = |order: usize| -> [S; 3] {
            std::array::from_fn(|k| {
                motions[0][order][k] * (self.masses[0] / mass)
                    + motions[1][order][k] * (self.masses[1] / mass)
            })
        };
        let centre = add(&moved(0), &self.body.centre().map(S::from));
        let drift = [moved(1), moved(2)];
        let places = motions.map(|[d, ..]| [d[0] + self.station, d[1], d[2]]);
        let mut inertia = self.shell.map(|row| row.map(S::from));
        let mut inertia_rate = [[S::from(0.0); 3]; 3];
        let terms = [
            (self.masses[0], &places[0], &motions[0][1]),
            (self.masses[1], &places[1], &motions[1][1]),
            (-mass, &centre, &drift[0]),
        ];
        for (mass, place, speed) in terms {
            let (here, change) = (spread(place), spread_rate(place, speed));
            for i in 0..3 {
                for j in 0..3 {
                    inertia[i][j] += here[i][j] * mass;
                    inertia_rate[i][j] += change[i][j] * mass;
                }
            }
        }
        let parts = std::array::from_fn(|i| {
            [std::array::from_fn(|k| places[i][k] - centre[k]), motions[i][1], motions[i][2]]
        });
        Whole { centre, parts, drift, inertia, inertia_rate }
    }

    /// Inertia of the whole about its centre of mass (kg m2), in body axes, with the masses at positions.
    #[must_use]
    pub fn inertia(&self, [a, b]: [f64; 2]) -> [[f64; 3]; 3] {
        self.whole(&[a, b, 0.0, 0.0, 0.0, 0.0]).inertia
    }

    /// Forces, N, in body axes, with which the body moves the masses in the full model, at a state and controls. Those along the slide or rim
    /// are what actuators do; the rest is held by the guides.
    #[must_use]
    pub fn forces_on_masses(&self, x: &[f64; 13], u: &[f64; 6]) -> [[f64; 3]; 2] {
        let whole = self.whole(u);
        let rate = Dynamics::<13, 6>::rate(self, 0.0, x, u, &[]);
        let (spin, change) = ([x[10], x[11], x[12]], [rate[10], rate[11], rate[12]]);
        let push = self.body.motion(x).loads.force.map(|f| f / self.body.mass());
        std::array::from_fn(|i| {
            let [place, speed, acceleration] = whole.parts[i];
            let speed: [f64; 3] = std::array::from_fn(|k| speed[k] - whole.drift[0][k]);
            let (turned, carried) = (cross(&change, &place), cross(&spin, &cross(&spin, &place)));
            let coriolis = cross(&spin, &speed);
            std::array::from_fn(|k| {
                let relative = acceleration[k] - whole.drift[1][k];
                self.masses[i] * (push[k] + relative + 2.0 * coriolis[k] + turned[k] + carried[k])
            })
        })
    }

    /// Power of the actuators, W: the forces on the masses times their speeds in the body.
    ///
    /// # Examples
    /// ```
    /// use apsides_dynamics::aerodynamics::{AxisymmetricAerodynamics, Damping, Interpolation};
    /// use apsides_dynamics::moving_mass::Layout;
    /// use apsides_dynamics::rigid_body::{FlatEarth, Ground, Inertia};
    /// use apsides_dynamics::{Atmosphere, MovingMassVehicle, RigidBody};
    ///
    /// // A mass of 10 kg in a vehicle of 500 kg in free fall, at 0.2 m/s, speeding up by 0.5 m/s2.
    /// let capsule = RigidBody::new(
    ///     Ground::Flat(FlatEarth::wgs84(0.6)?),
    ///     Atmosphere::Vacuum,
    ///     AxisymmetricAerodynamics::capsule(Interpolation::Smooth, Damping::constant())?,
    ///     500.0,
    ///     Inertia::principal([100.0, 85.0, 85.0])?,
    ///     [0.0; 3],
    /// )?;
    /// let vehicle = MovingMassVehicle::new(capsule, Layout::CROSS, [10.0; 2], 0.0)?;
    /// let mut state = [0.0; 13];
    /// (state[2], state[6]) = (-50e3, 1.0);
    /// let power = vehicle.actuator_power(&state, &[0.0, 0.0, 0.2, 0.0, 0.5, 0.0]);
    /// // The rest of the vehicle gives way.
    /// assert!((power - 10.0 * 0.5 * (1.0 - 10.0 / 500.0) * 0.2).abs() < 1e-12);
    /// # Ok::<(), apsides_dynamics::DynamicsError>(())
    /// ```
    #[must_use]
    pub fn actuator_power(&self, x: &[f64; 13], u: &[f64; 6]) -> f64 {
        let motions = self.layout.motions(u);
        let forces = self.forces_on_masses(x, u);
        dot(&forces[0], &motions[0][1]) + dot(&forces[1], &motions[1][1])
    }
}

/// A point of a rim. Not inlined: its sine and cosine would be made for masses on a cross too, before a loop.
#[inline(never)]
fn on_rim<S: Scalar>(radius: f64, angle: S) -> [S; 3] {
    let (sin, cos) = angle.sin_cos();
    [S::from(0.0), sin * radius, cos * radius]
}

/// `|a|^2 1 - a a^T`: the inertia of a unit mass at a place.
#[inline]
fn spread<S: Scalar>([x, y, z]: &[S; 3]) -> [[S; 3]; 3] {
    let (xx, yy, zz) = (*x * *x, *y * *y, *z * *z);
    let (xy, xz, yz) = (-*x * *y, -*x * *z, -*y * *z);
    [[yy + zz, xy, xz], [xy, xx + zz, yz], [xz, yz, xx + yy]]
}

/// Its rate at a speed of the place.
#[inline]
fn spread_rate<S: Scalar>([x, y, z]: &[S; 3], [u, v, w]: &[S; 3]) -> [[S; 3]; 3] {
    let (xx, yy, zz) = (*x * *u * 2.0, *y * *v * 2.0, *z * *w * 2.0);
    let (xy, xz, yz) = (-(*x * *v + *y * *u), -(*x * *w + *z * *u), -(*y * *w + *z * *v));
    [[yy + zz, xy, xz], [xy, xx + zz, yz], [xz, yz, xx + yy]]
}

/// The quasi-static model: positions of the masses.
impl Dynamics<13, 2> for MovingMassVehicle {
    #[inline(always)]
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 13], u: &[S; 2], _p: &[S; 0]) -> [S; 13] {
        self.body.rates_about(x, &self.centre(u))
    }
}

/// The full model: positions, speeds and accelerations of the masses.
impl Dynamics<13, 6> for MovingMassVehicle {
    #[inline]
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 13], u: &[S; 6], _p: &[S; 0]) -> [S; 13] {
        let motion = self.body.motion(x);
        let whole = self.whole(u);
        let spin = &motion.spin;
        let times = |m: &[[S; 3]; 3]| [dot(&m[0], spin), dot(&m[1], spin), dot(&m[2], spin)];
        let mut momentum = times(&whole.inertia);
        let mut torque = transferred(&motion.loads, &whole.centre);
        let lost = times(&whole.inertia_rate);
        for (mass, [place, speed, acceleration]) in self.masses.iter().zip(&whole.parts) {
            let (carried, reaction) = (cross(place, speed), cross(place, acceleration));
            for k in 0..3 {
                momentum[k] += carried[k] * *mass;
                torque[k] -= reaction[k] * *mass;
            }
        }
        let gyroscopic = cross(spin, &momentum);
        let sum = std::array::from_fn(|k| torque[k] - gyroscopic[k] - lost[k]);
        self.body.assembled(&motion, &solve_symmetric(&whole.inertia, &sum))
    }
}
