//! Places in the decision vector.
//!
//! Per phase the coefficients of the outputs, one output after the other, then start and end time where they are free; the static
//! parameters come last. The start of a phase that a linkage makes equal to the end of an earlier one has no variable of its own.

use apsides_ocp::{Bounds, EndpointConstraint, EndpointInput, Ocp, Phase};

use crate::spline_mesh::SplineMesh;

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
    /// True if the start time is the end time of an earlier phase.
    pub(crate) shared: bool,
}

impl PhaseLayout {
    /// Columns of the times that are this phase's own.
    pub(crate) fn own_times(&self) -> impl Iterator<Item = usize> {
        let start = if self.shared { None } else { self.initial_time.column() };
        start.into_iter().chain(self.final_time.column())
    }
}

/// Placement of a whole problem.
pub(crate) struct Layout {
    pub(crate) phases: Vec<PhaseLayout>,
    pub(crate) first_parameter: usize,
    pub(crate) variables: usize,
}

impl Layout {
    pub(crate) fn new(ocp: &Ocp, meshes: &[SplineMesh]) -> Self {
        let mut variables = 0;
        let mut phases = Vec::with_capacity(meshes.len());
        for (k, (phase, mesh)) in ocp.phases.iter().zip(meshes).enumerate() {
            let lengths: Vec<usize> = mesh.bases.iter().map(apsides_basis::Bspline::len).collect();
            let outputs = lengths.iter().map(|n| {
                variables += n;
                variables - n
            });
            let outputs = outputs.collect();
            let earlier = ocp.constraints.iter().find_map(|c| predecessor(c, k));
            let earlier = earlier.and_then(|p| phases.get(p)).map(|p: &PhaseLayout| p.final_time);
            let (initial_time, final_time, shared) = times(phase, earlier, &mut variables);
            phases.push(PhaseLayout { outputs, lengths, initial_time, final_time, shared });
        }
        let first_parameter = variables;
        Self { phases, first_parameter, variables: variables + ocp.parameters.len() }
    }
}

fn times(phase: &Phase, earlier: Option<Time>, variables: &mut usize) -> (Time, Time, bool) {
    let (start, end) = phase.time_bounds();
    let mut place = |bounds: Bounds| {
        if bounds.is_fixed() {
            return Time::Fixed(bounds.lower);
        }
        *variables += 1;
        Time::Column(*variables - 1)
    };
    match earlier {
        Some(Time::Column(c)) if !start.is_fixed() => (Time::Column(c), place(end), true),
        _ => (place(start), place(end), false),
    }
}

/// The phase whose end time a constraint makes the start time of `phase`.
fn predecessor(c: &EndpointConstraint, phase: usize) -> Option<usize> {
    let (EndpointInput::FinalTime { phase: from }, EndpointInput::InitialTime { phase: to }) =
        (*c.inputs.first()?, *c.inputs.get(1)?)
    else {
        return None;
    };
    let alone = c.inputs.len() == 2 && c.rows.len() == 1 && c.rows[0].bounds == Bounds::fixed(0.0);
    if !alone || to != phase || from >= to || c.function.pattern().hessian_len() > 0 {
        return None;
    }
    // A linear function: a multiple of the difference where it is zero at equal times and not elsewhere.
    let value = |z: [f64; 2]| {
        let mut out = [0.0];
        c.function.value(&z, &mut out);
        out[0]
    };
    let difference = value([0.0, 0.0]) == 0.0 && value([1.0, 1.0]) == 0.0 && value([1.0, 0.0]) != 0.0;
    difference.then_some(from)
}
