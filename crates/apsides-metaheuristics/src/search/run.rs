//! A search in progress: generation by generation, with a state that can be saved and resumed.

use crate::evaluator::{Evaluator, seen};
use crate::history::History;
use crate::{
    Algorithm, Candidate, Engine, Evaluation, HistoryPoint, Noise, Objective, Points, Progress, Search,
    SearchError, SearchReport, SearchSpace, StopReason, Task,
};
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// The whole state of a search between two generations.
///
/// Saved in any format of serde that keeps all digits of a number, and read again, it goes on as if nothing had happened: the result
/// is the same to the last bit. With `serde_json` that needs its feature `float_roundtrip`.
#[derive(Debug, Serialize, Deserialize)]
pub struct Run {
    search: Search,
    space: SearchSpace,
    engine: Engine,
    points: Points,
    generations: usize,
    evaluations: usize,
    failures: usize,
    /// The best point with its result as the objective gave it.
    best: Option<Candidate>,
    /// Its result as the algorithm sees it.
    rank: Evaluation,
    /// Last result that counted as an improvement, and its generation.
    improved: (Evaluation, usize),
    history: History,
    stop: Option<StopReason>,
    elapsed: Duration,
    #[serde(skip)]
    buffers: Buffers,
}

/// Memory that is used again, and threads.
#[derive(Debug, Default)]
struct Buffers {
    evaluator: Option<Evaluator>,
    results: Vec<Evaluation>,
    seen: Vec<Evaluation>,
    confirmed: Vec<bool>,
    copies: Option<Points>,
    repeats: Vec<Evaluation>,
}

impl Run {
    /// A search before its first generation.
    ///
    /// # Errors
    /// An ill-posed request.
    pub fn new(search: &Search, space: &SearchSpace) -> Result<Self, SearchError> {
        search.check(space)?;
        let mut start = Points::new(space.dimension());
        search.start.iter().for_each(|x| start.push(x));
        let task = Task { space, start: &start, seed: search.seed, budget: search.budget };
        Ok(Self {
            engine: search.method.start(&task)?,
            search: search.clone(),
            space: space.clone(),
            points: Points::new(space.dimension()),
            generations: 0,
            evaluations: 0,
            failures: 0,
            best: None,
            rank: Evaluation::FAILED,
            improved: (Evaluation::FAILED, 0),
            history: History::new(),
            stop: None,
            elapsed: Duration::ZERO,
            buffers: Buffers::default(),
        })
    }

    /// Generations to the end. An observer sees each, and may end the search.
    ///
    /// # Errors
    /// Threads that cannot be started.
    pub fn finish<O: Objective + ?Sized>(
        &mut self,
        objective: &O,
        observer: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
    ) -> Result<StopReason, SearchError> {
        loop {
            let stop = self.step(objective)?;
            let asked = observer(&self.progress()).is_break();
            if let Some(stop) = stop {
                return Ok(stop);
            }
            if asked {
                self.stop = Some(StopReason::Stopped);
                return Ok(StopReason::Stopped);
            }
        }
    }

    /// One generation, and why the search ended, if it did. Nothing happens after the end.
    ///
    /// # Errors
    /// Threads that cannot be started.
    pub fn step<O: Objective + ?Sized>(&mut self, objective: &O) -> Result<Option<StopReason>, SearchError> {
        if self.stop.is_some() {
            return Ok(self.stop);
        }
        let begin = Instant::now();
        if self.buffers.evaluator.is_none() {
            self.buffers.evaluator = Some(Evaluator::new(self.search.threads)?);
        }
        self.engine.ask(&mut self.points);
        let asked = self.points.len();
        let samples = self.search.noise.samples() as usize;
        self.points.truncate(asked.min(self.remaining() / samples));
        self.evaluate(objective);
        if self.confirm(objective) {
            self.keep_best();
        }
        // An algorithm is told whole generations alone; after a part of one there is no next.
        if self.points.len() == asked {
            self.engine.tell(&self.points, &self.buffers.seen);
        }
        self.generations += 1;
        self.elapsed += begin.elapsed();
        self.record();
        self.stop = self.reason(samples);
        Ok(self.stop)
    }

    /// Evaluations that are left.
    fn remaining(&self) -> usize {
        self.search.budget.saturating_sub(self.evaluations)
    }

    fn evaluate<O: Objective + ?Sized>(&mut self, objective: &O) {
        let Buffers { evaluator, results, seen: told, .. } = &mut self.buffers;
        let Some(evaluator) = evaluator else { return };
        evaluator.evaluate(objective, &self.points, self.search.noise, self.evaluations as u64, results);
        self.evaluations += results.len() * self.search.noise.samples() as usize;
        self.failures += results.iter().filter(|r| r.is_failed()).count();
        told.clear();
        told.extend(results.iter().map(|&r| seen(r, self.search.constraints)));
    }

    /// Evaluates again what seems better than the best so far. Says whether the best of this generation is to be trusted: at the
    /// end of the budget it may stay unconfirmed.
    fn confirm<O: Objective + ?Sized>(&mut self, objective: &O) -> bool {
        let Noise::ConfirmBest { repeats } = self.search.noise else { return true };
        let Buffers { evaluator, results, seen: told, confirmed, copies, repeats: again } = &mut self.buffers;
        let Some(evaluator) = evaluator else { return true };
        let copies = copies.get_or_insert_with(|| Points::new(self.space.dimension()));
        confirmed.clear();
        confirmed.resize(results.len(), false);
        while let Some(k) = first(told).filter(|&k| !confirmed[k] && told[k].is_better_than(&self.rank)) {
            let count = repeats.min(self.search.budget.saturating_sub(self.evaluations));
            if count < repeats && self.best.is_some() {
                return false;
            }
            copies.clear();
            (0..count).for_each(|_| copies.push(self.points.row(k)));
            evaluator.evaluate(objective, copies, Noise::None, self.evaluations as u64, again);
            self.evaluations += count;
            self.failures += again.iter().filter(|r| r.is_failed()).count();
            again.push(results[k]);
            results[k] = Evaluation::mean(again.iter().copied());
            told[k] = seen(results[k], self.search.constraints);
            confirmed[k] = true;
        }
        true
    }

    fn keep_best(&mut self) {
        let Some(k) = first(&self.buffers.seen) else { return };
        let rank = self.buffers.seen[k];
        if !rank.is_better_than(&self.rank) {
            return;
        }
        let (x, evaluation) = (self.points.row(k), self.buffers.results[k]);
        self.rank = rank;
        match &mut self.best {
            Some(best) => {
                best.x.copy_from_slice(x);
                best.evaluation = evaluation;
            }
            None => self.best = Some(Candidate { x: x.to_vec(), evaluation }),
        }
        let (old, least) = (self.improved.0, self.search.stagnation.map_or(0.0, |s| s.improvement));
        let clearly =
            old.is_failed() || rank.violation < old.violation || old.objective - rank.objective > least;
        if clearly {
            self.improved = (rank, self.generations);
        }
    }

    fn record(&mut self) {
        let Some(best) = &self.best else { return };
        let Self { engine, generations, evaluations, .. } = self;
        self.history.push(|| history_point(*generations, *evaluations, best, engine));
    }

    fn reason(&self, samples: usize) -> Option<StopReason> {
        let search = &self.search;
        let result = self.best.as_ref().map(|b| b.evaluation);
        if let (Some(target), Some(result)) = (search.target, result)
            && result.is_feasible()
            && result.objective <= target
        {
            return Some(StopReason::Target);
        }
        if self.best.is_none() && (self.evaluations >= search.patience || self.remaining() < samples) {
            return Some(StopReason::AllFailed);
        }
        if let Some(convergence) = self.engine.converged() {
            return Some(StopReason::Converged(convergence));
        }
        if let Some(s) = search.stagnation
            && self.best.is_some()
            && self.generations - self.improved.1 > s.generations
        {
            return Some(StopReason::Stagnation);
        }
        if self.remaining() < samples {
            return Some(StopReason::Budget);
        }
        search.time_limit.filter(|&limit| self.elapsed >= limit).map(|_| StopReason::TimeLimit)
    }

    /// The state of the search as an observer sees it.
    pub fn progress(&self) -> Progress<'_> {
        Progress {
            generation: self.generations,
            evaluations: self.evaluations,
            best: self.best.as_ref(),
            failures: self.failures,
            engine: &self.engine,
        }
    }

    /// The best point so far with its result as the objective gave it.
    pub fn best(&self) -> Option<&Candidate> {
        self.best.as_ref()
    }

    /// The reason why the search ended, `None` while it goes on.
    pub fn stop(&self) -> Option<StopReason> {
        self.stop
    }

    /// The algorithm with its state.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// Lets a search go on that the observer or the time limit ended; its time starts again.
    pub fn reopen(&mut self) {
        if matches!(self.stop, Some(StopReason::Stopped | StopReason::TimeLimit)) {
            self.stop = None;
            self.elapsed = Duration::ZERO;
        }
    }

    /// Changes the number of threads, for a search that is resumed on another machine. Results stay the same.
    pub fn set_threads(&mut self, threads: usize) {
        self.search.threads = threads;
        self.buffers.evaluator = None;
    }

    /// The best point so far and the work spent; a search that goes on is reported as stopped.
    pub fn report(&self) -> SearchReport {
        SearchReport {
            best: self.best.clone(),
            evaluations: self.evaluations,
            generations: self.generations,
            stop: self.stop.unwrap_or(StopReason::Stopped),
            history: self.history.with_last(
                self.best
                    .as_ref()
                    .map(|b| history_point(self.generations, self.evaluations, b, &self.engine)),
            ),
            failures: self.failures,
            elapsed: self.elapsed,
        }
    }
}

fn history_point(generation: usize, evaluations: usize, best: &Candidate, engine: &Engine) -> HistoryPoint {
    let Evaluation { objective, violation } = best.evaluation;
    HistoryPoint {
        generation,
        evaluations,
        objective,
        violation: violation.max(0.0),
        spread: engine.spread(),
    }
}

/// The first of the best results.
fn first(results: &[Evaluation]) -> Option<usize> {
    (0..results.len()).min_by(|&i, &j| results[i].order(&results[j]))
}
