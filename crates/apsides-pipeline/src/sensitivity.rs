//! Prices: what one more unit of a key is worth at the solution of a mission.
//!
//! The data of the discretised problem (functions, gradient of the Lagrangian, bounds) are differenced between two
//! missions whose key differs a little, at the same point; nothing is solved again, unless bounds of states were path constraints of the solve. The derivative of the objective then
//! follows from the multipliers (envelope theorem), that of the solution from one solve with the factorised optimality
//! conditions ([`apsides_nlp::Sensitivity`]), and that of the results from the trajectory moved along it.
//!
//! A price holds as long as the solution keeps its active bounds, and on the mesh of the solution. Where requirements that depend on each other are
//! active and a key moves some of them, it has none: their multipliers may be shared in any way, and the objective has one price for more
//! of the key, another one for less, or nothing is feasible on one side.

use std::borrow::Cow;
use std::collections::BTreeMap;

use apsides_nlp::{
    ActiveConstraints, InteriorPoint, Nlp, NlpError, Perturbation, Sensitivity, SolutionDerivative,
    SolveReport,
};
use apsides_ocp::{Guess, Mesh, Ocp, Sense, Trajectory, WithoutKinks};
use apsides_radau::{RadauError, Transcription};

use crate::Error;
use crate::key::{Key, KeyKind};
use crate::method::MethodName;
use crate::outcome::{Outcome, Price};
use crate::pipeline::Pipeline;
use crate::posed::Posed;

/// Half the width of a difference relative to the value, near the cube root of the rounding error.
const RELATIVE_STEP: f64 = 1e-5;

impl Pipeline {
    /// The keys with a price: the numbers of vehicle and flight, but not a limit that is infinite, nor a zero that leaves something
    /// out of the problem.
    pub fn priced_keys(&self) -> impl Iterator<Item = &Key> {
        self.kind().priced_keys(self.values())
    }

    /// Derivatives of the objective and of the results of this mission's solution with respect to `keys`, in their
    /// order.
    ///
    /// At an end of its range a key is differenced to the other side only, to first order.
    ///
    /// # Errors
    /// An outcome that is not a solution of this mission's kind, a key without a price.
    pub fn sensitivities(&self, outcome: &Outcome, keys: &[&str]) -> Result<Vec<Price>, Error> {
        let keys = keys.iter().map(|path| self.priced_key(path)).collect::<Result<Vec<_>, _>>()?;
        self.check_prices()?;
        let Some(report) = outcome.report.as_ref().filter(|report| report.status.is_success()) else {
            return Err(conflict(format!("the mission is not solved ({})", outcome.summary.status)));
        };
        // What was decided stays so.
        let decided = self.decided(&outcome.decisions)?;
        let mut solution = Solution::new(&decided, outcome, report)?;
        keys.into_iter().map(|key| solution.price(key)).collect()
    }

    /// Refuses a mission whose solution can have no prices.
    ///
    /// # Errors
    /// When its method gives none.
    pub fn check_prices(&self) -> Result<(), Error> {
        match self.methods().name {
            MethodName::Radau => Ok(()),
            other => Err(conflict(format!(
                "prices come from a solution by collocation: set `method` = \"{}\" instead of \"{}\"",
                MethodName::Radau.word(),
                other.word()
            ))),
        }
    }

    fn priced_key(&self, path: &str) -> Result<&Key, Error> {
        let keys: Vec<_> = self.priced_keys().collect();
        let found = keys.iter().copied().find(|k| k.path == path);
        found.ok_or_else(|| self.values().unknown(path, &keys, PLACE))
    }

    /// The mission with another value of a number, if it can be posed.
    fn posed_with(&self, key: &Key, value: f64) -> Result<(Self, Posed), Error> {
        let changed = self.clone().with(&key.path, value)?;
        let posed = changed.pose()?;
        Ok((changed, posed))
    }
}

const PLACE: &str = "sensitivity";

fn conflict(reason: String) -> Error {
    Error::Conflict { place: PLACE.into(), reason }
}

fn method(e: NlpError) -> Error {
    RadauError::from(e).into()
}

/// The problem without kinks of controls, which has derivatives where they have none.
fn without_kinks(ocp: &Ocp) -> Cow<'_, Ocp> {
    WithoutKinks::of(ocp).map_or(Cow::Borrowed(ocp), |smooth| Cow::Owned(smooth.ocp))
}

/// The data that all prices of a solution share.
struct Solution<'a> {
    mission: &'a Pipeline,
    ocp: Cow<'a, Ocp>,
    /// The problem without kinks of controls, where it has some: `ocp` is that one then.
    smooth: Option<WithoutKinks>,
    report: Cow<'a, SolveReport>,
    mesh: Mesh,
    guess: Guess,
    transcription: Transcription,
    /// None when the solution is not an isolated optimum.
    sensitivity: Option<Sensitivity>,
    active: ActiveConstraints,
}

impl<'a> Solution<'a> {
    fn new(mission: &'a Pipeline, outcome: &'a Outcome, report: &'a SolveReport) -> Result<Self, Error> {
        let (ocp, trajectory) = outcome.solved();
        let mesh = Mesh { phases: trajectory.phases.iter().map(|p| p.mesh.clone()).collect() };
        let smooth = WithoutKinks::of(ocp);
        let earlier = Guess::earlier(trajectory);
        let guess = smooth.as_ref().map_or_else(|| earlier.clone(), |smooth| smooth.guess(&earlier));
        let ocp = smooth.as_ref().map_or(Cow::Borrowed(ocp), |smooth| Cow::Owned(smooth.ocp.clone()));
        let mut transcription = Transcription::new(&ocp, &mesh, &guess)?;
        let settings = &mission.methods().radau.settings.nlp;
        let is_of_mesh = report.x.len() == transcription.variables()
            && report.constraint_multipliers.len() == transcription.constraints();
        // A report of the problem with bounds of states as path constraints is none of the one that was posed.
        let report = if is_of_mesh {
            Cow::Borrowed(report)
        } else {
            Cow::Owned(transcription.solve(&ocp, &guess, settings, &mut ()).map_err(method)?)
        };
        let solver = InteriorPoint::new(settings.clone());
        let sensitivity = match solver.sensitivity(&mut transcription, &report) {
            Ok(sensitivity) => Some(sensitivity),
            Err(NlpError::NoDerivative { .. }) => None,
            Err(e) => return Err(method(e)),
        };
        let active = solver.active_constraints(&mut transcription, &report).map_err(method)?;
        Ok(Self { mission, ocp, smooth, report, mesh, guess, transcription, sensitivity, active })
    }

    fn price(&mut self, key: &Key) -> Result<Price, Error> {
        let value = self.mission.values().number(&key.path)?;
        let default = match key.kind {
            KeyKind::Number(default, _) if default.is_finite() => default.abs(),
            _ => 0.0,
        };
        let size = value.abs().max(default);
        let step = RELATIVE_STEP * if size > 0.0 { size } else { 1.0 };
        let side =
            |value| self.mission.posed_with(key, value).map(|(mission, posed)| (mission, posed, value));
        let middle = || side(value);
        let (below, above) = match (side(value - step), side(value + step)) {
            (Ok(below), Ok(above)) => (below, above),
            (Ok(below), Err(_)) => (below, middle()?),
            (Err(_), Ok(above)) => (middle()?, above),
            (Err(refused), Err(_)) => return Err(refused),
        };
        let width = above.2 - below.2;
        let transcribe =
            |posed: &Posed| Transcription::new(&without_kinks(&posed.ocp), &self.mesh, &self.guess);
        let (mut a, mut b) = (transcribe(&below.1)?, transcribe(&above.1)?);
        let perturbation = Perturbation::between(&mut a, &mut b, &self.report, width).map_err(method)?;
        let objective = perturbation.objective_derivative(&self.report).map_err(method)?;
        let is_unique = self.active.follow(&perturbation, step).map_err(method)?;
        let derivative = match &mut self.sensitivity {
            Some(sensitivity) if is_unique => match sensitivity.solve(&perturbation) {
                Ok(derivative) => Some(derivative),
                Err(NlpError::NoDerivative { .. }) => None,
                Err(e) => return Err(method(e)),
            },
            _ => None,
        };
        let mut results = BTreeMap::new();
        if let Some(derivative) = derivative {
            let moved = |(mission, posed, at): &(Pipeline, Posed, f64)| -> Result<_, Error> {
                Ok(mission.results(&posed.expand(&self.moved(&derivative, at - value)?)?))
            };
            let (low, high) = (moved(&below)?, moved(&above)?);
            results = low
                .into_iter()
                .filter_map(|(name, low)| high.get(&name).map(|high| (name, (high - low) / width)))
                .collect();
        }
        let sign = match self.ocp.objective.sense {
            Sense::Minimize => 1.0,
            Sense::Maximize => -1.0,
        };
        Ok(Price {
            key: key.path.clone().into_owned(),
            value,
            unit: key.unit().into(),
            objective: is_unique.then_some(sign * objective),
            results,
        })
    }

    /// The trajectory moved along its derivative.
    fn moved(&self, derivative: &SolutionDerivative, change: f64) -> Result<Trajectory, Error> {
        let mut report = self.report.clone().into_owned();
        report.objective += change * derivative.objective;
        for (x, dx) in report.x.iter_mut().zip(&derivative.x) {
            *x += change * dx;
        }
        let moved = self.transcription.trajectory(&self.ocp, &report)?;
        Ok(match &self.smooth {
            Some(smooth) => smooth.as_posed(moved),
            None => moved,
        })
    }
}
