//! The [states](apsides_dynamics::rigid_body::STATES) of a rigid body by name.

/// A state of a rigid body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodyState<S> {
    /// Position of the centre of mass in the axes of the ground, m.
    pub(crate) position: [S; 3],
    /// Velocity relative to the ground in its axes, m/s.
    pub(crate) velocity: [S; 3],
    /// Quaternion from body axes to those of the ground.
    pub(crate) attitude: [S; 4],
    /// Roll, pitch and yaw rate: the angular velocity relative to inertial space in body axes, rad/s.
    pub(crate) spin: [S; 3],
}

impl<S: Copy> BodyState<S> {
    /// The state of an array.
    #[inline(always)]
    pub(crate) fn of(&[x, y, z, u, v, w, q0, q1, q2, q3, roll, pitch, yaw]: &[S; 13]) -> Self {
        Self {
            position: [x, y, z],
            velocity: [u, v, w],
            attitude: [q0, q1, q2, q3],
            spin: [roll, pitch, yaw],
        }
    }

    /// The array of the state.
    #[inline(always)]
    pub(crate) fn array(&self) -> [S; 13] {
        let ([x, y, z], [u, v, w]) = (self.position, self.velocity);
        let ([q0, q1, q2, q3], [roll, pitch, yaw]) = (self.attitude, self.spin);
        [x, y, z, u, v, w, q0, q1, q2, q3, roll, pitch, yaw]
    }
}
