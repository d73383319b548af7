//! The workspace of a solve: one entry per stage, owned by the caller.

use crate::cone::Scaling;

/// Variables, multipliers of the states and of the rows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Direction<const NX: usize, const NW: usize, const NR: usize> {
    pub(crate) w: [f64; NW],
    pub(crate) y: [f64; NX],
    pub(crate) z: [f64; NR],
}

impl<const NX: usize, const NW: usize, const NR: usize> Direction<NX, NW, NR> {
    pub(crate) const ZERO: Self = Self { w: [0.0; NW], y: [0.0; NX], z: [0.0; NR] };
}

/// The workspace of one stage, and its part of the solution.
#[derive(Clone, Copy, Debug)]
pub struct StageWork<const NX: usize, const NW: usize, const NR: usize, const NE: usize> {
    pub(crate) point: Direction<NX, NW, NR>,
    pub(crate) slack: [f64; NR],
    pub(crate) scaling: Scaling<NR>,
    /// Upper triangle of the condensed Hessian; after the factorisation controls have rows of its Cholesky factor, inverse on the diagonal, and of their
    /// gains, states the whole cost to go.
    pub(crate) factor: [[f64; NW]; NW],
    /// The same of the multipliers of the end equations.
    pub(crate) ends: [[f64; NE]; NW],
    /// Residuals of the dual constraints, of the state and of the rows.
    pub(crate) residual: Direction<NX, NW, NR>,
    /// Solution for the data as the right-hand side.
    pub(crate) constant: Direction<NX, NW, NR>,
    pub(crate) right: Direction<NX, NW, NR>,
    pub(crate) step: Direction<NX, NW, NR>,
    pub(crate) correction: Direction<NX, NW, NR>,
    pub(crate) slack_step: [f64; NR],
}

impl<const NX: usize, const NW: usize, const NR: usize, const NE: usize> Default
    for StageWork<NX, NW, NR, NE>
{
    fn default() -> Self {
        Self::ZERO
    }
}

impl<const NX: usize, const NW: usize, const NR: usize, const NE: usize> StageWork<NX, NW, NR, NE> {
    /// Room for a stage.
    pub const ZERO: Self = Self {
        point: Direction::ZERO,
        slack: [0.0; NR],
        scaling: Scaling::IDENTITY,
        factor: [[0.0; NW]; NW],
        ends: [[0.0; NE]; NW],
        residual: Direction::ZERO,
        constant: Direction::ZERO,
        right: Direction::ZERO,
        step: Direction::ZERO,
        correction: Direction::ZERO,
        slack_step: [0.0; NR],
    };

    /// Variables of the last solve, controls first; of an unbounded program a ray.
    #[must_use]
    pub fn variables(&self) -> &[f64; NW] {
        &self.point.w
    }

    /// Multipliers of the state: the change of the objective per change of what the state is set to, with opposite sign; of an infeasible
    /// program part of the certificate.
    #[must_use]
    pub fn state_multipliers(&self) -> &[f64; NX] {
        &self.point.y
    }

    /// Multipliers of the rows, in the cones; zero beyond the rows of the stage. Of an infeasible program part of the certificate.
    #[must_use]
    pub fn multipliers(&self) -> &[f64; NR] {
        &self.point.z
    }

    /// `rows w + constants`, in the cones; zero beyond the rows of the stage.
    #[must_use]
    pub fn slack(&self) -> &[f64; NR] {
        &self.slack
    }
}
