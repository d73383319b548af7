//! The first layer: the best control profile of a seeded search.

use std::error::Error;
use std::fmt::Debug;
use std::time::{Duration, Instant};

use apsides_iteration::{Flow, Observer, SearchProgress};
use apsides_metaheuristics::{Algorithm, Evaluation, Progress, Run, Search, SearchSpace, StopReason};
use apsides_ocp::Ocp;
use apsides_ocp::method::{SearchEnd, SearchRecord};
use apsides_shooting::profile::{
    FlightRules, ProfileScore, ProfileShape, ProfileShooting, ProfileStart, Stop,
};

use crate::error::TwoLayerError;
use crate::settings::{ProfileModel, Ranking, TwoLayerSettings};

/// Time between two checkpoints at least.
const CHECKPOINT_INTERVAL: Duration = Duration::from_millis(200);

/// Where the state of a search is kept between two generations, so that it goes on after its program was ended. It goes on to the same bits.
pub trait Checkpoint: Debug + Send + Sync {
    /// The search so far, if there is one.
    ///
    /// # Errors
    /// When it cannot be read, or belongs to another search.
    fn load(&self) -> Result<Option<Run>, Box<dyn Error + Send + Sync>>;

    /// Keeps the search. What is there already stays whole where this fails.
    ///
    /// # Errors
    /// When it cannot be written; the search goes on then.
    fn save(&self, run: &Run) -> Result<(), Box<dyn Error + Send + Sync>>;
}

/// The best start of a search, and how it was found.
#[derive(Debug)]
pub struct Found {
    /// The best flight; none where all flights failed.
    pub start: Option<ProfileStart>,
    /// The record of the search.
    pub record: SearchRecord,
}

/// Searches the control profiles of a problem.
///
/// # Errors
/// When the request is ill-posed or the checkpoint cannot be used.
pub fn search(
    ocp: &Ocp,
    profile: &ProfileModel,
    settings: &TwoLayerSettings,
    checkpoint: Option<&dyn Checkpoint>,
    observer: &mut dyn Observer,
) -> Result<Found, TwoLayerError> {
    let begin = Instant::now();
    let shooting = ProfileShooting::new(ocp, rules(ocp, profile, settings)?)?;
    let score = score(&shooting, profile, settings);
    let (lower, upper) = shooting.space();
    let space = SearchSpace::new(lower.to_vec(), upper.to_vec())?;
    let evaluate = |x: &[f64]| {
        let flown = shooting.flown(x, |flight| {
            let (objective, violation) = score.separate(flight);
            match settings.ranking {
                Ranking::FeasibilityFirst => Evaluation { objective, violation },
                Ranking::Penalty => Evaluation::from(objective + violation),
            }
        });
        // Settings have been checked: what is left is a flight that failed.
        flown.unwrap_or(Evaluation::FAILED)
    };
    let saved = checkpoint.map(|c| c.load().map_err(TwoLayerError::Checkpoint)).transpose()?.flatten();
    let mut run = match saved {
        Some(run) => continued(run, &settings.search),
        None => Run::new(&settings.search, &space)?,
    };
    let mut last_saved = Instant::now();
    let mut not_saved = None;
    let end = loop {
        let stop = run.step(&evaluate)?;
        let progress = progress(&run.progress(), settings.search.budget);
        let interrupted = observer.generation(&progress) == Flow::Stop;
        let ended = interrupted || stop.is_some();
        if let Some(checkpoint) = checkpoint
            && (ended || last_saved.elapsed() > CHECKPOINT_INTERVAL)
        {
            // What is computed is worth more than the file.
            if let Err(e) = checkpoint.save(&run) {
                not_saved = Some(e);
            }
            last_saved = Instant::now();
        }
        if ended {
            break stop.map_or(SearchEnd::Interrupted, end_of);
        }
    };
    let report = run.report();
    let start = match &report.best {
        Some(best) => Some(shooting.start(&best.x, settings.mesh)?),
        None => None,
    };
    let record = SearchRecord {
        variables: lower.len(),
        evaluations: report.evaluations,
        generations: report.generations,
        failures: report.failures,
        end,
        objective: start.as_ref().map(|s| s.flight.objective),
        miss: start.as_ref().map(|s| profile.miss(&s.flight.state_misses)),
        time: begin.elapsed(),
        history: report.history.iter().map(|h| [h.evaluations as f64, h.objective]).collect(),
        not_saved,
    };
    Ok(Found { start, record })
}

/// A search that goes on, on as many threads as there are now, and beyond the time that it had before.
fn continued(mut run: Run, search: &Search) -> Run {
    run.set_threads(search.threads);
    run.reopen();
    run
}

fn rules(ocp: &Ocp, profile: &ProfileModel, s: &TwoLayerSettings) -> Result<FlightRules, TwoLayerError> {
    let shape = ProfileShape {
        least_intervals: s.least_intervals,
        free_lengths: s.free_lengths,
        continuous: s.continuous && s.degree > 0,
        most_degree: s.most_degree.unwrap_or(s.degree),
        ..ProfileShape::new(s.degree, s.most_intervals, profile.bounds.clone())
    };
    let stop = Stop::at_end(&ocp.phases[0], &profile.stop)?;
    let rules = FlightRules::new(shape).steered(profile.steering.clone()).until(stop);
    Ok(rules.of(profile.independent.clone()))
}

fn score(shooting: &ProfileShooting<'_>, profile: &ProfileModel, s: &TwoLayerSettings) -> ProfileScore {
    ProfileScore {
        miss_weights: profile.distance_per_unit.iter().map(|d| s.price_of_miss * d).collect(),
        excess_weight: s.price_of_excess,
        ..ProfileScore::new(shooting, s.price_of_excess)
    }
}

fn progress(p: &Progress<'_>, budget: usize) -> SearchProgress {
    SearchProgress {
        generation: p.generation,
        evaluations: p.evaluations,
        budget,
        best: p.best.map(|c| c.evaluation.objective),
        spread: p.engine.spread(),
    }
}

fn end_of(stop: StopReason) -> SearchEnd {
    match stop {
        StopReason::Budget => SearchEnd::Budget,
        StopReason::TimeLimit => SearchEnd::TimeLimit,
        StopReason::Stopped => SearchEnd::Interrupted,
        StopReason::AllFailed => SearchEnd::AllFailed,
        _ => SearchEnd::Converged,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::sync::Mutex;

    use apsides_ad::{Dynamics, Scalar};
    use apsides_ocp::{At, Bounds, Phase, State, Variable};
    use apsides_shooting::profile::{Independent, Steering};

    use super::*;

    /// Height and speed of a fall that a thrust slows down.
    struct Fall;

    impl Dynamics<2, 1> for Fall {
        fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
            [x[1], u[0] - 10.0]
        }
    }

    /// A checkpoint in memory.
    #[derive(Debug, Default)]
    struct Memory(Mutex<Option<String>>);

    impl Checkpoint for Memory {
        fn load(&self) -> Result<Option<Run>, Box<dyn Error + Send + Sync>> {
            Ok(self.0.lock().unwrap().as_deref().map(serde_json::from_str).transpose()?)
        }

        fn save(&self, run: &Run) -> Result<(), Box<dyn Error + Send + Sync>> {
            *self.0.lock().unwrap() = Some(serde_json::to_string(run)?);
            Ok(())
        }
    }

    fn searched(search: Search, checkpoint: Option<&dyn Checkpoint>) -> SearchRecord {
        let phase = Phase::new("fall", Fall)
            .states([
                State::new("height", "m").within(-1.0, 200.0).starts_at(100.0).ends_at(0.0),
                State::new("speed", "m/s").within(-60.0, 60.0).starts_at(0.0).ends_at(0.0),
            ])
            .controls([Variable::new("thrust", "m/s2").within(0.0, 20.0)])
            .final_time(Bounds::new(1.0, 20.0));
        let ocp =
            Ocp::builder("fall").phase(phase).minimize("time", "s", At::FinalTime("fall")).build().unwrap();
        let profile = ProfileModel {
            independent: Independent::Time,
            bounds: vec![Bounds::new(0.0, 20.0)],
            steering: Steering::Controls,
            stop: "height".into(),
            distance_per_unit: vec![1.0, 1.0],
        };
        let settings = TwoLayerSettings { search, ..TwoLayerSettings::default() };
        super::search(&ocp, &profile, &settings, checkpoint, &mut ()).unwrap().record
    }

    #[test]
    fn a_search_goes_on_with_the_time_and_the_threads_of_today() {
        let search = Search { budget: 300, threads: 1, ..Search::default() };
        let whole = searched(search.clone(), None);
        assert_eq!(whole.end, SearchEnd::Budget);
        // One generation at a time.
        let limited = Search { time_limit: Some(Duration::ZERO), ..search };
        let memory = Memory::default();
        let first = searched(limited.clone(), Some(&memory));
        assert_eq!((first.end, first.generations), (SearchEnd::TimeLimit, 1));
        let on_two = Search { threads: 2, ..limited };
        let second = searched(on_two.clone(), Some(&memory));
        assert_eq!((second.end, second.generations), (SearchEnd::TimeLimit, 2));
        let kept: serde_json::Value =
            serde_json::from_str(memory.0.lock().unwrap().as_deref().unwrap()).unwrap();
        assert_eq!(kept["search"]["threads"], 2);
        let rest = (second.generations..whole.generations).map(|_| searched(on_two.clone(), Some(&memory)));
        let last = rest.last().unwrap();
        assert_eq!((last.end, last.generations), (SearchEnd::Budget, whole.generations));
        assert_eq!((last.objective, last.miss), (whole.objective, whole.miss));
    }
}
