//! Where everything stands in the decision vector.
//!
//! Per phase the coefficients of the outputs, one output after the other, then start and end time where they are free; the static
//! parameters come last.

use apsides_ocp::{Ocp, Phase};

use crate::grid::Grid;

/// A time that is a variable or fixed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Time {
    /// Column of the variable.
    Column(usize),
    /// Its value.
    Fixed(f64),
}

impl Time {
    pub(crate) fn value(self, x: &[f64]) -> f64 {
        match self {
            Self::Column(c) => x[c],
            Self::Fixed(t) => t,
        }
    }

    pub(crate) fn column(self) -> Option<usize> {
        match self {
            Self::Column(c) => Some(c),
            Self::Fixed(_) => None,
        }
    }
}

/// Placement of one phase.
pub(crate) struct PhaseLayout {
    /// First coefficient of each output.
    pub(crate) outputs: Vec<usize>,
    /// Number of coefficients of each output.
    pub(crate) lengths: Vec<usize>,
    pub(crate) initial_time: Time,
    pub(crate) final_time: Time,
}

/// Placement of a whole problem.
pub(crate) struct Layout {
    pub(crate) phases: Vec<PhaseLayout>,
    pub(crate) first_parameter: usize,
    pub(crate) variables: usize,
}

impl Layout {
    pub(crate) fn new(ocp: &Ocp, grids: &[Grid]) -> Self {
        let mut variables = 0;
        let mut phases = Vec::with_capacity(grids.len());
        for (phase, grid) in ocp.phases.iter().zip(grids) {
            let lengths: Vec<usize> = grid.bases.iter().map(apsides_basis::Bspline::len).collect();
            let outputs = lengths.iter().map(|n| {
                variables += n;
                variables - n
            });
            let outputs = outputs.collect();
            let (initial_time, final_time) = times(phase, &mut variables);
            phases.push(PhaseLayout { outputs, lengths, initial_time, final_time });
        }
        let first_parameter = variables;
        Self { phases, first_parameter, variables: variables + ocp.parameters.len() }
    }
}

fn times(phase: &Phase, variables: &mut usize) -> (Time, Time) {
    let (start, end) = phase.time_bounds();
    let mut place = |bounds: apsides_ocp::Bounds| {
        if bounds.is_fixed() {
            return Time::Fixed(bounds.lower);
        }
        *variables += 1;
        Time::Column(*variables - 1)
    };
    (place(start), place(end))
}
