//! Settings of the splines and of the method.

use apsides_basis::MAX_ORDER;
use apsides_nlp::{NlpSettings, ScalingMethod};

use crate::FlatnessError;

/// Ends of the polynomial pieces of a phase, on its normalised time from 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub enum Breaks {
    /// So many equal segments with simple knots: as smooth as the order allows.
    Uniform(usize),
    /// So many equal segments, joined no more smoothly than the states must be: with the order less the highest derivative of the
    /// outputs as `s`, output `i` of highest derivative `q_i` has order `s + q_i` and knots of multiplicity `s`. With `s` points of
    /// [`Placement::GaussPerSegment`] this is orthogonal collocation.
    Collocation(usize),
    /// Given breaks from 0 to 1, and the multiplicity of each inner one.
    At {
        /// Ends of the segments, increasing from 0 to 1.
        fractions: Vec<f64>,
        /// Per inner break, 1 (smoothest) to the order less the highest derivative of the outputs (continuous states).
        multiplicities: Vec<usize>,
    },
}

/// Where bounds, path constraints and residuals are collocated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Placement {
    /// Equally spaced, both ends included.
    Uniform,
    /// One Legendre-Gauss rule over the phase.
    Gauss,
    /// One Legendre-Gauss-Lobatto rule over the phase.
    Lobatto,
    /// Chebyshev extreme points over the phase, both ends included.
    Chebyshev,
    /// Greville abscissae of the splines; of splines with as many coefficients as points, on equal segments, where these numbers
    /// differ.
    Greville,
    /// A Legendre-Gauss rule in each segment; `points` are those of one segment.
    GaussPerSegment,
}

/// Splines and points of one phase.
#[derive(Clone, Debug, PartialEq)]
pub struct SplineSettings {
    /// Order of the splines, their degree plus one: above the highest derivative of the outputs, at most 32. None: that derivative
    /// plus 4; none.
    pub order: Option<usize>,
    /// Segments; 4 equal ones for collocation.
    pub breaks: Breaks,
    /// Collocation points; 4.
    pub points: usize,
    /// Their places in each segment.
    pub placement: Placement,
    /// True if the phase is refined until the error estimate meets the tolerance; true.
    pub refine: bool,
}

impl Default for SplineSettings {
    fn default() -> Self {
        Self {
            order: None,
            breaks: Breaks::Collocation(4),
            points: 4,
            placement: Placement::GaussPerSegment,
            refine: true,
        }
    }
}

/// Orders above the highest derivative of the outputs where none is stated.
pub(crate) const SPARE_ORDERS: usize = 4;

/// The choice of bounds and path constraints that become rows of the discretised problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoundRows {
    /// All that are finite, at every collocation point.
    Everywhere,
    /// None at first; those that a solution exceeds are added, and the problem is solved again. For problems that are well posed
    /// without their bounds.
    WhereExceeded,
}

/// Settings of the method.
#[derive(Clone, Debug)]
pub struct FlatnessSettings {
    /// Splines of every phase.
    pub spline: SplineSettings,
    /// Bounds along the phases; everywhere.
    pub bounds: BoundRows,
    /// True if splines other than those of orthogonal collocation start from a solution on a few segments of it, which converges
    /// from poorer guesses and leads to the local minimum nearest to the solution; true.
    pub presolve: bool,
    /// Largest estimated error of a state over one segment, relative to its size; 1e-10.
    pub tolerance: f64,
    /// Largest relative change of the objective that a further refinement is expected to make, and of integrals by a finer rule; 1e-8.
    pub objective_tolerance: f64,
    /// Largest excess between the points of a bound on a state or of a path constraint without controls, relative to its scale;
    /// 5e-7.
    pub path_tolerance: f64,
    /// Highest order of refined splines; 12. Beyond it segments are halved.
    pub max_order: usize,
    /// Most intervals of a phase; 400.
    pub max_intervals: usize,
    /// Most discretised problems after the first one; 0 switches refinement off; 15.
    pub max_refinements: usize,
    /// Settings of the interior-point method; problem scaling, tolerance 1e-9, monotone barrier from 1e-3: there
    /// are few bounds.
    pub nlp: NlpSettings,
}

impl Default for FlatnessSettings {
    fn default() -> Self {
        Self {
            spline: SplineSettings::default(),
            bounds: BoundRows::Everywhere,
            presolve: true,
            tolerance: 1e-10,
            objective_tolerance: 1e-8,
            path_tolerance: 5e-7,
            max_order: 12,
            max_intervals: 400,
            max_refinements: 15,
            nlp: NlpSettings {
                tolerance: 1e-9,
                scaling: ScalingMethod::UserThenGradient { max: 100.0 },
                initial_barrier: 1e-3,
                initial_bound_multiplier: 1e-3,
                ..NlpSettings::default()
            },
        }
    }
}

impl FlatnessSettings {
    pub(crate) fn check(&self) -> Result<(), FlatnessError> {
        let fail = |name, value, allowed: String| {
            Err(FlatnessError::Setting { place: "method".into(), name, value, allowed })
        };
        for (name, value) in [
            ("tolerance", self.tolerance),
            ("objective_tolerance", self.objective_tolerance),
            ("path_tolerance", self.path_tolerance),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return fail(name, value, "a positive number".into());
            }
        }
        for (name, value, least, most) in [
            ("max_order", self.max_order, 2, MAX_ORDER),
            ("max_intervals", self.max_intervals, 1, 100_000),
            ("max_refinements", self.max_refinements, 0, 999),
        ] {
            if !(least..=most).contains(&value) {
                return fail(name, value as f64, format!("a whole number from {least} to {most}"));
            }
        }
        Ok(())
    }
}
