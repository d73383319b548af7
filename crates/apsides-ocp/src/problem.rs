//! The problem: phases, static parameters, endpoint constraints, objective. Built once, checked once.

use std::sync::Arc;

use apsides_ad::{NodeFunction, VectorFunction, vector_node};

use crate::endpoint::{At, EndpointConstraint, EndpointInput, Names};
use crate::phase::unique;
use crate::{OcpError, Phase, Variable};

/// The direction in which the objective is optimised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sense {
    /// Smallest value wanted.
    Minimize,
    /// Largest value wanted.
    Maximize,
}

impl Sense {
    /// The sign of the objective in a cost to be minimised.
    #[must_use]
    pub fn sign(self) -> f64 {
        match self {
            Self::Minimize => 1.0,
            Self::Maximize => -1.0,
        }
    }
}

/// The objective: a weighted sum of end quantities, integrals and functions of end quantities.
#[derive(Clone)]
pub struct Objective {
    /// Name, as in the results.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Direction.
    pub sense: Sense,
    /// End quantities and their weights.
    pub linear: Vec<(EndpointInput, f64)>,
    /// Phase, integral and weight.
    pub integrals: Vec<(usize, usize, f64)>,
    /// Functions of end quantities; each has one output, which is added.
    pub functions: Vec<(Vec<EndpointInput>, Arc<dyn NodeFunction>)>,
    /// Typical size; 1 when absent.
    pub scale: Option<f64>,
}

impl Objective {
    /// The weight of an integral of a phase in the objective; zero when it takes no part.
    #[must_use]
    pub fn integral_weight(&self, phase: usize, integral: usize) -> f64 {
        self.integrals.iter().filter(|w| (w.0, w.1) == (phase, integral)).map(|w| w.2).sum()
    }
}

/// A term of the objective, by names.
pub enum Term<'a> {
    /// An end quantity times a weight.
    End(At<'a>, f64),
    /// Phase and integral, times a weight.
    Integral(&'a str, &'a str, f64),
    /// A function with one output of the listed end quantities.
    Function(Vec<At<'a>>, Arc<dyn NodeFunction>),
}

impl<'a> Term<'a> {
    /// A function with one output of the listed end quantities (Mayer cost).
    pub fn function<F, const N: usize>(inputs: [At<'a>; N], function: F) -> Self
    where
        F: VectorFunction<N, 1> + 'static,
    {
        Self::Function(inputs.into(), vector_node(function))
    }
}

/// A multi-phase optimal control problem that has passed every check of [`OcpBuilder::build`].
#[derive(Clone)]
pub struct Ocp {
    /// Name.
    pub name: String,
    /// Phases.
    pub phases: Vec<Phase>,
    /// Static parameters, shared by all phases.
    pub parameters: Vec<Variable>,
    /// Boundary and linkage constraints.
    pub constraints: Vec<EndpointConstraint>,
    /// Objective.
    pub objective: Objective,
}

impl Ocp {
    /// Starts a problem.
    #[must_use]
    pub fn builder(name: impl Into<String>) -> OcpBuilder {
        OcpBuilder {
            name: name.into(),
            phases: Vec::new(),
            parameters: Vec::new(),
            constraints: Vec::new(),
            objective: None,
            failure: None,
        }
    }

    /// Index of a phase by name.
    #[must_use]
    pub fn phase_index(&self, name: &str) -> Option<usize> {
        self.phases.iter().position(|p| p.name == name)
    }
}

/// Collects a problem; the first mistake is reported by [`build`](Self::build).
pub struct OcpBuilder {
    name: String,
    phases: Vec<Phase>,
    parameters: Vec<Variable>,
    constraints: Vec<EndpointConstraint>,
    objective: Option<Objective>,
    failure: Option<OcpError>,
}

impl OcpBuilder {
    /// Adds a phase; constraints and objective may refer to it afterwards.
    #[must_use]
    pub fn phase(mut self, phase: Phase) -> Self {
        self.phases.push(phase);
        self
    }

    /// Adds a static parameter, an unknown constant of the whole problem.
    #[must_use]
    pub fn parameter(mut self, parameter: Variable) -> Self {
        self.parameters.push(parameter);
        self
    }

    /// Adds a constraint on end quantities; one row per output of the function.
    #[must_use]
    pub fn constrain<F, const N: usize, const M: usize>(
        self,
        name: impl Into<String>,
        rows: [Variable; M],
        inputs: [At<'_>; N],
        function: F,
    ) -> Self
    where
        F: VectorFunction<N, M> + 'static,
    {
        self.constrain_node(name, rows.into(), &inputs, vector_node(function))
    }

    /// Adds a constraint on end quantities by a node function; one row per output of the function.
    #[must_use]
    pub fn constrain_node(
        mut self,
        name: impl Into<String>,
        rows: Vec<Variable>,
        inputs: &[At<'_>],
        function: Arc<dyn NodeFunction>,
    ) -> Self {
        let name = name.into();
        let place = format!("constraint `{name}`");
        match self.resolve(&place, inputs) {
            Ok(inputs) => self.constraints.push(EndpointConstraint { name, rows, inputs, function }),
            Err(e) => self.fail(e),
        }
        self
    }

    /// Makes time and every state that two phases share by name continuous from the end of `from` to the start of `to`.
    #[must_use]
    pub fn link(self, from: &str, to: &str) -> Self {
        self.link_with_jumps(from, to, |_| Some(0.0))
    }

    /// Joins two phases in time, and in every state that they share by name: at the start of `to` it is `jump` of the state's name, in
    /// the state's unit, more than at the end of `from`. A state without a jump is not joined.
    #[must_use]
    pub fn link_with_jumps(mut self, from: &str, to: &str, jump: impl Fn(&str) -> Option<f64>) -> Self {
        match self.shared_quantities(from, to, jump) {
            Ok(links) => self.constraints.extend(links),
            Err(e) => self.fail(e),
        }
        self
    }

    /// States the objective.
    #[must_use]
    pub fn objective<'a>(
        mut self,
        sense: Sense,
        name: impl Into<String>,
        unit: impl Into<String>,
        terms: impl IntoIterator<Item = Term<'a>>,
    ) -> Self {
        let mut objective = Objective {
            name: name.into(),
            unit: unit.into(),
            sense,
            linear: Vec::new(),
            integrals: Vec::new(),
            functions: Vec::new(),
            scale: None,
        };
        for term in terms {
            if let Err(e) = self.add_term(&mut objective, term) {
                self.fail(e);
            }
        }
        self.objective = Some(objective);
        self
    }

    /// Typical size of the objective in its unit.
    #[must_use]
    pub fn objective_scale(mut self, scale: f64) -> Self {
        if let Some(o) = &mut self.objective {
            o.scale = Some(scale);
        }
        self
    }

    /// Minimises an end quantity, for instance a final time.
    #[must_use]
    pub fn minimize(self, name: &str, unit: &str, at: At<'_>) -> Self {
        self.objective(Sense::Minimize, name, unit, [Term::End(at, 1.0)])
    }

    /// Maximises an end quantity, for instance a final mass.
    #[must_use]
    pub fn maximize(self, name: &str, unit: &str, at: At<'_>) -> Self {
        self.objective(Sense::Maximize, name, unit, [Term::End(at, 1.0)])
    }

    /// Minimises the integral `integral` of `phase` (Lagrange cost).
    #[must_use]
    pub fn minimize_integral(self, phase: &str, integral: &str) -> Self {
        let unit = self
            .phases
            .iter()
            .find(|p| p.name == phase)
            .and_then(|p| p.integrals.iter().find(|q| q.variable.name == integral))
            .map_or_else(|| "-".to_owned(), |q| q.variable.unit.clone());
        self.objective(Sense::Minimize, integral, unit, [Term::Integral(phase, integral, 1.0)])
    }

    /// Checks everything and gives the problem.
    ///
    /// # Errors
    /// The first mistake found: sizes, names, bounds, scales, missing parts.
    pub fn build(self) -> Result<Ocp, OcpError> {
        if let Some(e) = self.failure {
            return Err(e);
        }
        if self.phases.is_empty() {
            return Err(OcpError::NoPhase { problem: self.name });
        }
        let place = format!("problem `{}`", self.name);
        unique(&place, "phase", self.phases.iter().map(|p| &p.name))?;
        unique(&place, "parameter", self.parameters.iter().map(|p| &p.name))?;
        for p in &self.phases {
            p.check(self.parameters.len())?;
        }
        for p in &self.parameters {
            p.check(&place, "parameter")?;
        }
        for c in &self.constraints {
            c.check()?;
        }
        let Some(objective) = self.objective else {
            return Err(OcpError::NoObjective { problem: self.name });
        };
        for (inputs, f) in &objective.functions {
            let place = format!("objective `{}`", objective.name);
            let sizes = [("inputs of its function", f.inputs(), inputs.len()), ("outputs", 1, f.outputs())];
            for (what, expected, found) in sizes {
                if expected != found {
                    return Err(OcpError::Dimension { place, what, expected, found });
                }
            }
        }
        if let Some(value) = objective.scale.filter(|s| !(*s > 0.0 && s.is_finite())) {
            let place = format!("objective `{}`", objective.name);
            return Err(OcpError::Scale { place, what: "scale", value });
        }
        Ok(Ocp {
            name: self.name,
            phases: self.phases.into_iter().map(Phase::with_accumulated_states).collect::<Result<_, _>>()?,
            parameters: self.parameters,
            constraints: self.constraints,
            objective,
        })
    }

    fn fail(&mut self, e: OcpError) {
        self.failure.get_or_insert(e);
    }

    fn names(&self) -> Names<'_> {
        Names { phases: &self.phases, parameters: &self.parameters }
    }

    fn resolve(&mut self, place: &str, inputs: &[At<'_>]) -> Result<Vec<EndpointInput>, OcpError> {
        inputs.iter().map(|at| self.input(place, at)).collect()
    }

    fn input(&mut self, place: &str, at: &At<'_>) -> Result<EndpointInput, OcpError> {
        if let At::Integral(phase, integral) = *at {
            let phase = self.names().phase(place, phase)?;
            let integral = self.names().integral(place, phase, integral)?;
            self.phases[phase].accumulate(integral);
        }
        self.names().input(place, at)
    }

    fn add_term(&mut self, objective: &mut Objective, term: Term<'_>) -> Result<(), OcpError> {
        let place = format!("objective `{}`", objective.name);
        match term {
            // A weighted integral needs no state.
            Term::End(At::Integral(phase, integral), weight) => {
                return self.add_term(objective, Term::Integral(phase, integral, weight));
            }
            Term::End(at, weight) => objective.linear.push((self.input(&place, &at)?, weight)),
            Term::Integral(phase, integral, weight) => {
                let p = self.names().phase(&place, phase)?;
                objective.integrals.push((p, self.names().integral(&place, p, integral)?, weight));
            }
            Term::Function(inputs, f) => {
                objective.functions.push((self.resolve(&place, &inputs)?, f));
            }
        }
        Ok(())
    }

    fn shared_quantities(
        &self,
        from: &str,
        to: &str,
        jump: impl Fn(&str) -> Option<f64>,
    ) -> Result<Vec<EndpointConstraint>, OcpError> {
        let name = format!("link {from}-{to}");
        let place = format!("constraint `{name}`");
        let (a, b) = (self.names().phase(&place, from)?, self.names().phase(&place, to)?);
        let mut links = vec![EndpointConstraint::difference(
            name.clone(),
            Variable::new("time", self.phases[a].time_unit.clone()).equal_to(0.0),
            EndpointInput::FinalTime { phase: a },
            EndpointInput::InitialTime { phase: b },
        )];
        for (i, s) in self.phases[a].states.iter().enumerate() {
            if let Some(j) = self.phases[b].state_index(&s.variable.name)
                && let Some(jump) = jump(&s.variable.name)
            {
                // A zero without its sign.
                let row =
                    Variable::new(s.variable.name.clone(), s.variable.unit.clone()).equal_to(0.0 - jump);
                links.push(EndpointConstraint::difference(
                    name.clone(),
                    Variable { scale: s.variable.scale, ..row },
                    EndpointInput::FinalState { phase: a, state: i },
                    EndpointInput::InitialState { phase: b, state: j },
                ));
            }
        }
        Ok(links)
    }
}
