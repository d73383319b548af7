//! Flights of any solved mission that deviate at the start and in numbers of the mission, with the controls of the plan as functions of time.
//!
//! Nothing has to be known of the kind of mission: its equations of motion are those of its problem, posed anew with the numbers of a sample, and
//! the flight is the re-simulation of a certificate from another start. What such a flight does beyond the bounds of the problem is not asked.
//! The deviations of a sample depend on seed and index alone.

use std::ops::Range;

use apsides_ephemeris::header;
use apsides_metaheuristics::Generator;
use apsides_ocp::{Ocp, Phase};
use apsides_verify::{VerifySettings, open_loop_end};

use crate::Error;
use crate::covariance::{Transition, along};
use crate::dispersion::sample_seed;
use crate::montecarlo::{Batch, LinearCovariance, Sample, check_sizes, fly_all};
use crate::outcome::Outcome;
use crate::pipeline::Pipeline;

/// Accuracy of the integrations: their error is far below any spread that is of interest.
const ACCURACY: f64 = 1e-10;

/// A run of flights in open loop.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenLoop {
    /// Seed of the deviations.
    pub seed: u64,
    /// Threads; the results do not depend on it.
    pub threads: usize,
    /// States of the first phase by their names, with the standard deviations of their initial values, in the units of the problem.
    pub states: Vec<(String, f64)>,
    /// Keys of the mission, with standard deviations in their units.
    pub keys: Vec<(String, f64)>,
}

impl OpenLoop {
    /// Names of the deviations, in their order.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        let states = self.states.iter().map(|(name, _)| header(&format!("start {name}"), ""));
        states.chain(self.keys.iter().map(|(key, _)| key.clone())).collect()
    }

    /// Standard deviations, in the same order.
    #[must_use]
    pub fn sizes(&self) -> Vec<f64> {
        self.states.iter().chain(&self.keys).map(|(_, sigma)| *sigma).collect()
    }

    /// Names of the results: the states at the end less those of the plan.
    #[must_use]
    pub fn columns(plan: &Outcome) -> Vec<String> {
        let end = plan.ocp.phases.last();
        let states = end.map(|phase| phase.states.as_slice()).unwrap_or_default();
        states.iter().map(|s| header(&format!("end {}", s.variable.name), &s.variable.unit)).collect()
    }

    /// The deviations of a sample.
    #[must_use]
    pub fn deviations(&self, index: usize) -> Vec<f64> {
        let mut random = Generator::new(sample_seed(self.seed, index));
        self.sizes().iter().map(|sigma| sigma * random.normal()).collect()
    }

    /// Refuses, before anything is solved, keys that are no numbers, states that are not there, sizes that are negative or infinite.
    ///
    /// # Errors
    /// The first mistake.
    pub fn check(&self, mission: &Pipeline) -> Result<(), Error> {
        mission.optimised()?;
        for (key, _) in &self.keys {
            mission.values().key(key, "--vary")?;
            mission.values().number(key)?;
        }
        self.places(mission.pose()?.flight())?;
        let names = self.names();
        check_sizes(&names.iter().map(String::as_str).collect::<Vec<_>>(), &self.sizes())
    }

    /// Places of the states that deviate.
    fn places(&self, ocp: &Ocp) -> Result<Vec<usize>, Error> {
        let states = ocp.phases.first().map(|phase| phase.states.as_slice()).unwrap_or_default();
        let place = |(name, _): &(String, f64)| {
            states.iter().position(|s| s.variable.name == *name).ok_or_else(|| {
                let known = states.iter().map(|s| format!("`{}` ({})", s.variable.name, s.variable.unit));
                let known = known.collect::<Vec<_>>().join(", ");
                let reason = format!("no state is named `{name}`; states of the first phase: {known}");
                Error::Conflict { place: "--state".into(), reason }
            })
        };
        self.states.iter().map(place).collect()
    }

    /// Flies the samples of some indices, in order; `each` takes every one and says whether to go on. A flight that breaks off has no results, nor
    /// has one with numbers that the mission does not take, or that make a problem with other phases or states.
    ///
    /// # Errors
    /// As of [`check`](Self::check); a plan that cannot be flown.
    pub fn fly(
        &self,
        mission: &Pipeline,
        plan: &Outcome,
        indices: Range<usize>,
        each: impl FnMut(Sample) -> bool,
    ) -> Result<LinearCovariance, Error> {
        self.check(mission)?;
        let decided = mission.clone().with_threads(1).decided(&plan.decisions)?;
        let nominal = decided.pose_decided()?;
        let flight = nominal.flight();
        let places = self.places(flight)?;
        let settings = VerifySettings { integration_tolerance: ACCURACY, ..VerifySettings::default() };
        let trajectory = &plan.trajectory;
        let begin = trajectory.phases.first().map(|p| p.state_at(p.initial_time)).unwrap_or_default();
        let broken =
            || Error::in_mission("the plan itself breaks off in open loop: there is nothing to deviate from");
        let end = open_loop_end(flight, trajectory, &begin, &settings)?.ok_or_else(broken)?;
        let fly = |deviations: &[f64]| -> Option<Vec<f64>> {
            let (of_states, of_keys) = deviations.split_at(places.len());
            let mut start = begin.clone();
            let flown = if self.keys.is_empty() {
                for (place, deviation) in places.iter().zip(of_states) {
                    start[*place] += deviation;
                }
                open_loop_end(flight, trajectory, &start, &settings)
            } else {
                let mut case = decided.clone();
                for ((key, _), deviation) in self.keys.iter().zip(of_keys) {
                    let value = case.values().number(key).ok()?;
                    case = case.with(key, value + deviation).ok()?;
                }
                let posed = case.pose_decided().ok()?;
                let ocp = posed.flight();
                move_start(&mut start, flight.phases.first()?, ocp.phases.first()?)?;
                for (place, deviation) in places.iter().zip(of_states) {
                    start[*place] += deviation;
                }
                open_loop_end(ocp, trajectory, &start, &settings)
            };
            Some(flown.ok()??.iter().zip(&end).map(|(found, planned)| found - planned).collect())
        };
        let columns = end.len();
        let of = Batch { indices, threads: self.threads, columns };
        fly_all(of, |index| self.deviations(index), || (), |(), index| fly(&self.deviations(index)), each);
        Ok(self.linear(flight, plan, &places))
    }

    /// Covariance of the end by the state-transition matrix, for deviations of the start alone, where every phase goes on from the one before.
    fn linear(&self, flight: &Ocp, plan: &Outcome, places: &[usize]) -> Option<Vec<f64>> {
        if !self.keys.is_empty() || !is_a_chain(flight) {
            return None;
        }
        let n = flight.phases.first()?.states.len();
        let mut total: Option<Transition> = None;
        for phase in 0..flight.phases.len() {
            let leg = along(flight, &plan.trajectory, phase, ACCURACY).ok()?.transitions.pop()?;
            // Errors of controls and parameters are none.
            let phi = leg.phi;
            total =
                Some(total.map_or_else(|| Transition::identity(n, 0).then(&phi, &[]), |t| t.then(&phi, &[])));
        }
        let mut start = vec![0.0; n * n];
        for (place, (_, sigma)) in places.iter().zip(&self.states) {
            start[place * n + place] += sigma * sigma;
        }
        total?.covariance(&start, &[]).ok().filter(|all| all.iter().all(|v| v.is_finite()))
    }
}

/// Moves initial values that the problem states to those that another problem states; none if these have other states.
fn move_start(start: &mut [f64], from: &Phase, to: &Phase) -> Option<()> {
    let alike = from.states.len() == to.states.len()
        && from.states.iter().zip(&to.states).all(|(a, b)| a.variable.name == b.variable.name);
    if !alike {
        return None;
    }
    for (x, (a, b)) in start.iter_mut().zip(from.states.iter().zip(&to.states)) {
        if a.initial.is_fixed() && b.initial.is_fixed() {
            *x += b.initial.lower - a.initial.lower;
        }
    }
    Some(())
}

/// True if each state of each phase behind the first is that of the phase before.
fn is_a_chain(ocp: &Ocp) -> bool {
    let sources = apsides_ocp::linkage::sources(ocp);
    sources.iter().enumerate().skip(1).all(|(k, sources)| {
        sources.len() == ocp.phases[k - 1].states.len()
            && sources.iter().enumerate().all(|(state, source)| {
                source.is_some_and(|source| source.phase + 1 == k && source.state == state)
            })
    })
}
