//! Independent solves on several threads, seen by one observer.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{self, SyncSender};
use std::thread;

use apsides_nlp::{Flow, IterationRecord};

use super::stop::Stop;
use crate::{Observer, SearchProgress};

/// Reports that solves may be ahead of the observer: one that wants an end is heard after as many at most.
const MOST_AHEAD: usize = 64;

/// Threads with the observer of all their solves.
pub(super) struct Workers<'a> {
    pub(super) threads: usize,
    pub(super) observer: &'a mut dyn Observer,
}

enum Event {
    Iteration(IterationRecord),
    Generation(SearchProgress),
}

/// The observer of a solve on another thread, which passes its reports on.
struct Relay<'a> {
    events: SyncSender<Event>,
    stopped: &'a AtomicBool,
}

impl Relay<'_> {
    fn pass(&self, event: Event) -> Flow {
        // The receiver outlives all threads.
        let _ = self.events.send(event);
        if self.stopped.load(Ordering::Relaxed) { Flow::Stop } else { Flow::Continue }
    }
}

impl Observer for Relay<'_> {
    fn iteration(&mut self, record: &IterationRecord) -> Flow {
        self.pass(Event::Iteration(*record))
    }

    fn generation(&mut self, search: &SearchProgress) -> Flow {
        self.pass(Event::Generation(*search))
    }
}

impl Workers<'_> {
    /// One result per job, in the order of the jobs; those that are not solved say why.
    pub(super) fn all<J: Sync, R: Send>(
        &mut self,
        jobs: &[J],
        work: impl Fn(&J, &mut dyn Observer) -> Result<R, Stop> + Sync,
    ) -> Result<Vec<Result<R, String>>, Stop> {
        let (next, stopped) = (AtomicUsize::new(0), AtomicBool::new(false));
        let (events, inbox) = mpsc::sync_channel(MOST_AHEAD);
        let mut done: Vec<(usize, Result<R, Stop>)> = thread::scope(|scope| {
            let (next, stopped, work) = (&next, &stopped, &work);
            let spawn = |_| {
                let mut relay = Relay { events: events.clone(), stopped };
                scope.spawn(move || {
                    let mut done = Vec::new();
                    while !stopped.load(Ordering::Relaxed) {
                        let k = next.fetch_add(1, Ordering::Relaxed);
                        let Some(job) = jobs.get(k) else { break };
                        let result = work(job, &mut relay);
                        if matches!(result, Err(Stop::Refused(_) | Stop::Interrupted)) {
                            stopped.store(true, Ordering::Relaxed);
                        }
                        done.push((k, result));
                    }
                    done
                })
            };
            let threads: Vec<_> = (0..self.threads.clamp(1, jobs.len().max(1))).map(spawn).collect();
            drop(events);
            for event in inbox {
                let flow = match event {
                    Event::Iteration(record) => self.observer.iteration(&record),
                    Event::Generation(search) => self.observer.generation(&search),
                };
                if flow == Flow::Stop {
                    stopped.store(true, Ordering::Relaxed);
                }
            }
            let join = |t: thread::ScopedJoinHandle<'_, Vec<_>>| {
                t.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            };
            threads.into_iter().flat_map(join).collect()
        });
        done.sort_by_key(|d| d.0);
        let missing = done.len() < jobs.len();
        let mut results = Vec::with_capacity(jobs.len());
        for (_, result) in done {
            match result {
                Err(Stop::NotSolved(why)) => results.push(Err(why)),
                other => results.push(Ok(other?)),
            }
        }
        if missing { Err(Stop::Interrupted) } else { Ok(results) }
    }

    /// The results of jobs that are all needed.
    pub(super) fn each<J: Sync, R: Send, const N: usize>(
        &mut self,
        jobs: &[J; N],
        work: impl Fn(&J, &mut dyn Observer) -> Result<R, Stop> + Sync,
    ) -> Result<[R; N], Stop> {
        let results = self.all(jobs, work)?.into_iter().collect::<Result<Vec<R>, String>>();
        let results: Result<[R; N], _> = results.map_err(Stop::NotSolved)?.try_into();
        results.map_err(|_| Stop::Interrupted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(k: &usize, observer: &mut dyn Observer) -> Result<usize, Stop> {
        let search = SearchProgress { generation: *k, evaluations: 0, budget: 0, best: None, spread: 0.0 };
        match observer.generation(&search) {
            Flow::Stop => Err(Stop::Interrupted),
            Flow::Continue if *k == 3 => Err(Stop::NotSolved("three".into())),
            Flow::Continue => Ok(k * k),
        }
    }

    struct Count(usize, usize);

    impl Observer for Count {
        fn iteration(&mut self, _: &IterationRecord) -> Flow {
            Flow::Continue
        }

        fn generation(&mut self, _: &SearchProgress) -> Flow {
            self.0 += 1;
            if self.0 >= self.1 { Flow::Stop } else { Flow::Continue }
        }
    }

    #[test]
    fn results_keep_the_order_of_the_jobs() {
        let jobs: Vec<usize> = (0..50).collect();
        for threads in [1, 2, 5] {
            let mut seen = Count(0, usize::MAX);
            let mut workers = Workers { threads, observer: &mut seen };
            let found = workers.all(&jobs, square).ok().unwrap_or_default();
            assert_eq!(found.len(), 50);
            for (k, result) in found.iter().enumerate() {
                let expected = if k == 3 { Err("three".into()) } else { Ok(k * k) };
                assert_eq!(*result, expected);
            }
            assert_eq!(seen.0, 50);
        }
    }

    #[test]
    fn the_observer_ends_the_work() {
        let jobs: Vec<usize> = (4..100_000).collect();
        let mut seen = Count(0, 10);
        let found = Workers { threads: 2, observer: &mut seen }.all(&jobs, square);
        assert!(matches!(found, Err(Stop::Interrupted)));
    }
}
