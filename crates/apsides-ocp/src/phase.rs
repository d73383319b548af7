//! One phase: its equations of motion, states, controls, times, path constraints and integrals.

use std::sync::Arc;

use apsides_ad::{Dynamics, NodeFunction, PathFunction, dynamics_node, path_node};

use crate::{Bounds, OcpError, State, Variable};

/// Rows of a path constraint `lower <= g(t, x, u, p) <= upper` that share one function.
#[derive(Clone)]
pub struct PathConstraint {
    /// Name, unit, bounds and scale of each output of the function.
    pub rows: Vec<Variable>,
    /// `g`, with inputs `[x, u, p, t]`.
    pub function: Arc<dyn NodeFunction>,
}

/// The integral over the phase of `g(t, x, u, p)`, available to the objective and to boundary conditions by name.
#[derive(Clone)]
pub struct Integral {
    /// Name, unit of the integral, bounds on its value, scale.
    pub variable: Variable,
    /// `g`, with inputs `[x, u, p, t]` and one output.
    pub function: Arc<dyn NodeFunction>,
}

/// Controls that are the angles of a direction, such as that of a thrust, which equations of motion and integrands are linear in and
/// nothing else depends on. Methods that minimise the Hamiltonian then know its minimum in closed form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// `(cos(a), sin(a))`.
    InPlane {
        /// Index of the control `a`.
        angle: usize,
    },
    /// `(cos(a) cos(b), sin(a) cos(b), sin(b))`.
    InSpace {
        /// Index of the control `a`.
        in_plane: usize,
        /// Index of the control `b`.
        out_of_plane: usize,
    },
}

impl Direction {
    /// Returns true if a control is one of its angles.
    #[must_use]
    pub fn has(&self, control: usize) -> bool {
        match *self {
            Self::InPlane { angle } => angle == control,
            Self::InSpace { in_plane, out_of_plane } => in_plane == control || out_of_plane == control,
        }
    }
}

/// The equations of a phase have a kink, a jump of a derivative, where a state or the time passes a value, such as the altitude at the
/// boundary of two layers of an atmosphere. Methods may put an end of an interval there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kink {
    /// A state passes a value; the equations are continuous there.
    State {
        /// Index of the state.
        state: usize,
        /// Its value there.
        value: f64,
    },
    /// The time passes a value; the equations may jump there.
    Time(f64),
}

/// One phase of a problem.
///
/// ```
/// use apsides_ad::{Dynamics, Scalar};
/// use apsides_ocp::{Bounds, Phase, State, Variable};
///
/// struct Cart;
/// impl Dynamics<2, 1> for Cart {
///     fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
///         [x[1], u[0]]
///     }
/// }
///
/// let phase = Phase::new("push", Cart)
///     .states([State::new("position", "m").starts_at(0.0).ends_at(1.0), State::new("speed", "m/s").starts_at(0.0)])
///     .controls([Variable::new("acceleration", "m/s2").within(-1.0, 1.0)])
///     .final_time(Bounds::new(0.1, 10.0));
/// assert_eq!(phase.states.len(), 2);
/// ```
#[derive(Clone)]
pub struct Phase {
    /// Name, unique in the problem.
    pub name: String,
    /// States in the order of the equations of motion.
    pub states: Vec<State>,
    /// Controls in the order of the equations of motion.
    pub controls: Vec<Variable>,
    /// Allowed start times; fixed at zero unless stated.
    pub initial_time: Bounds,
    /// Allowed end times.
    pub final_time: Bounds,
    /// Allowed durations; not below zero unless stated.
    pub duration: Bounds,
    /// Unit of time, for labels.
    pub time_unit: String,
    /// `dx/dt = f`, with inputs `[x, u, p, t]`.
    pub dynamics: Arc<dyn NodeFunction>,
    /// Path constraints.
    pub path: Vec<PathConstraint>,
    /// Integrals.
    pub integrals: Vec<Integral>,
    /// Controls that are angles of directions.
    pub directions: Vec<Direction>,
    /// The kinks of the equations.
    pub kinks: Vec<Kink>,
    /// The integrals that are the last states, since boundary conditions or functions of the objective take them; see
    /// [`accumulated`](crate::accumulated).
    pub accumulated: Vec<usize>,
}

impl Phase {
    /// A phase that starts at time zero and has no states described yet.
    pub fn new<D, const NX: usize, const NU: usize, const NP: usize>(
        name: impl Into<String>,
        model: D,
    ) -> Self
    where
        D: Dynamics<NX, NU, NP> + 'static,
    {
        Self {
            name: name.into(),
            states: Vec::new(),
            controls: Vec::new(),
            initial_time: Bounds::fixed(0.0),
            final_time: Bounds::at_least(0.0),
            duration: Bounds::at_least(0.0),
            time_unit: "s".into(),
            dynamics: dynamics_node(model),
            path: Vec::new(),
            integrals: Vec::new(),
            directions: Vec::new(),
            kinks: Vec::new(),
            accumulated: Vec::new(),
        }
    }

    /// Describes the states, in the order of the model.
    #[must_use]
    pub fn states(self, states: impl IntoIterator<Item = State>) -> Self {
        Self { states: states.into_iter().collect(), ..self }
    }

    /// Describes the controls, in the order of the model.
    #[must_use]
    pub fn controls(self, controls: impl IntoIterator<Item = Variable>) -> Self {
        Self { controls: controls.into_iter().collect(), ..self }
    }

    /// Allowed start times.
    #[must_use]
    pub fn initial_time(self, bounds: Bounds) -> Self {
        Self { initial_time: bounds, ..self }
    }

    /// Allowed end times.
    #[must_use]
    pub fn final_time(self, bounds: Bounds) -> Self {
        Self { final_time: bounds, ..self }
    }

    /// Allowed durations.
    #[must_use]
    pub fn duration(self, bounds: Bounds) -> Self {
        Self { duration: bounds, ..self }
    }

    /// Unit of time for labels, `-` for problems without dimension.
    #[must_use]
    pub fn time_unit(self, unit: impl Into<String>) -> Self {
        Self { time_unit: unit.into(), ..self }
    }

    /// Adds path constraints; one row per output of the function.
    #[must_use]
    pub fn path<F, const NX: usize, const NU: usize, const NF: usize, const NP: usize>(
        mut self,
        rows: [Variable; NF],
        function: F,
    ) -> Self
    where
        F: PathFunction<NX, NU, NF, NP> + 'static,
    {
        self.path.push(PathConstraint { rows: rows.into(), function: path_node(function) });
        self
    }

    /// Adds an integral; the bounds of `variable` limit its value.
    #[must_use]
    pub fn integral<F, const NX: usize, const NU: usize, const NP: usize>(
        mut self,
        variable: Variable,
        integrand: F,
    ) -> Self
    where
        F: PathFunction<NX, NU, 1, NP> + 'static,
    {
        self.integrals.push(Integral { variable, function: path_node(integrand) });
        self
    }

    /// Says that controls are the angles of a direction.
    #[must_use]
    pub fn direction(mut self, direction: Direction) -> Self {
        self.directions.push(direction);
        self
    }

    /// Says where the equations have kinks.
    #[must_use]
    pub fn kinks(mut self, kinks: impl IntoIterator<Item = Kink>) -> Self {
        self.kinks.extend(kinks);
        self
    }

    /// The functions of the phase: equations of motion, path constraints, integrals.
    pub fn functions(&self) -> impl Iterator<Item = &Arc<dyn NodeFunction>> {
        std::iter::once(&self.dynamics)
            .chain(self.path.iter().map(|p| &p.function))
            .chain(self.integrals.iter().map(|q| &q.function))
    }

    /// Returns true if neither start nor end time is free.
    #[must_use]
    pub fn has_fixed_times(&self) -> bool {
        self.initial_time.is_fixed() && self.final_time.is_fixed()
    }

    /// Index of a state by name.
    #[must_use]
    pub fn state_index(&self, name: &str) -> Option<usize> {
        self.states.iter().position(|s| s.variable.name == name)
    }

    /// Index of an integral by name.
    #[must_use]
    pub fn integral_index(&self, name: &str) -> Option<usize> {
        self.integrals.iter().position(|s| s.variable.name == name)
    }

    /// Number of path constraint rows.
    #[must_use]
    pub fn path_rows(&self) -> usize {
        self.path.iter().map(|p| p.rows.len()).sum()
    }

    /// Returns true if a node function of this phase takes the static parameters (see [`NodeFunction::inputs`]).
    #[must_use]
    pub fn takes_parameters(&self, function: &dyn NodeFunction) -> bool {
        function.inputs() > self.states.len() + self.controls.len() + 1
    }

    /// Says whether controls enter a path constraint of this phase nonlinearly, as they do in a direction of length one.
    #[must_use]
    pub fn binds_controls(&self, constraint: &PathConstraint) -> bool {
        let controls = self.states.len()..self.states.len() + self.controls.len();
        let mut entries = constraint.function.pattern().hessian.iter();
        entries.any(|(i, j)| controls.contains(i) && controls.contains(j))
    }

    /// Bounds on start and end time, with those on the duration where one of the times is fixed.
    #[must_use]
    pub fn time_bounds(&self) -> (Bounds, Bounds) {
        let (mut start, mut end) = (self.initial_time, self.final_time);
        if start.is_fixed() {
            let t = start.lower;
            end = end.intersect(&Bounds::new(t + self.duration.lower, t + self.duration.upper));
        } else if end.is_fixed() {
            let t = end.lower;
            start = start.intersect(&Bounds::new(t - self.duration.upper, t - self.duration.lower));
        }
        (start, end)
    }

    /// The longest duration that the bounds allow, infinite without any.
    #[must_use]
    pub fn longest(&self) -> f64 {
        self.duration.upper.min(self.final_time.upper - self.initial_time.lower)
    }

    /// Returns true if the bounds on the duration say more than [`time_bounds`](Self::time_bounds).
    #[must_use]
    pub fn needs_duration_row(&self) -> bool {
        let fixed_end = self.initial_time.is_fixed() || self.final_time.is_fixed();
        let implied = self.duration.lower <= self.final_time.lower - self.initial_time.upper
            && self.duration.upper >= self.final_time.upper - self.initial_time.lower;
        !fixed_end && !implied
    }

    pub(crate) fn check(&self, parameters: usize) -> Result<(), OcpError> {
        let place = format!("phase `{}`", self.name);
        let dimension = |what, expected, found| {
            if expected == found {
                Ok(())
            } else {
                Err(OcpError::Dimension { place: place.clone(), what, expected, found })
            }
        };
        dimension("states (one per equation of motion)", self.dynamics.outputs(), self.states.len())?;
        let base = self.states.len() + self.controls.len() + 1;
        for f in self.functions() {
            if f.inputs() != base {
                dimension(
                    "inputs (states, controls, all parameters or none, time) of its functions",
                    base + parameters,
                    f.inputs(),
                )?;
            }
        }
        for d in &self.directions {
            let known = (0..self.controls.len()).filter(|&c| d.has(c)).count();
            let wanted = match d {
                Direction::InPlane { .. } => 1,
                Direction::InSpace { .. } => 2,
            };
            dimension("controls that are the angles of a direction", wanted, known)?;
        }
        for k in &self.kinks {
            let states = self.states.len();
            let (value, unit) = match *k {
                Kink::State { state, .. } if state >= states => {
                    return dimension("states at least, since one has a kink", state + 1, states);
                }
                Kink::State { state, value } => (value, &self.states[state].variable.unit),
                Kink::Time(value) => (value, &self.time_unit),
            };
            let finite = if value.is_finite() { value } else { f64::NAN };
            Bounds::fixed(finite).check(|| format!("{place}, kink"), unit)?;
        }
        for s in &self.states {
            s.check(&place)?;
        }
        for c in &self.controls {
            c.check(&place, "control")?;
        }
        for row in self.path.iter().flat_map(|p| &p.rows) {
            row.check(&place, "path constraint")?;
        }
        for q in &self.integrals {
            q.variable.check(&place, "integral")?;
        }
        unique(&place, "state", self.states.iter().map(|s| &s.variable.name))?;
        unique(&place, "control", self.controls.iter().map(|s| &s.name))?;
        unique(&place, "path constraint", self.path.iter().flat_map(|p| &p.rows).map(|s| &s.name))?;
        unique(&place, "integral", self.integrals.iter().map(|s| &s.variable.name))?;
        self.check_times(&place)
    }

    fn check_times(&self, place: &str) -> Result<(), OcpError> {
        for (b, what) in [
            (self.initial_time, "initial time"),
            (self.final_time, "final time"),
            (self.duration, "duration"),
        ] {
            b.check(|| format!("{place}, {what}"), &self.time_unit)?;
        }
        let longest = self.final_time.upper - self.initial_time.lower;
        let shortest = self.final_time.lower - self.initial_time.upper;
        if longest < self.duration.lower || shortest > self.duration.upper || longest <= 0.0 {
            return Err(OcpError::Contradiction {
                place: format!("{place}, times"),
                reason: format!(
                    "start in [{}, {}], end in [{}, {}] and duration in [{}, {}] {} have no solution of positive length",
                    self.initial_time.lower,
                    self.initial_time.upper,
                    self.final_time.lower,
                    self.final_time.upper,
                    self.duration.lower,
                    self.duration.upper,
                    self.time_unit
                ),
            });
        }
        Ok(())
    }
}

pub(crate) fn unique<'a>(
    place: &str,
    kind: &'static str,
    names: impl Iterator<Item = &'a String>,
) -> Result<(), OcpError> {
    let mut seen = std::collections::HashSet::new();
    for name in names {
        if !seen.insert(name) {
            return Err(OcpError::DuplicateName { place: place.into(), kind, name: name.clone() });
        }
    }
    Ok(())
}
