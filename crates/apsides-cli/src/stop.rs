//! Signals and time limits end work before its end without losing it.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use apsides::pipeline::Cancellation;
use apsides::pipeline::lock::release_all;
use apsides::pipeline::whole_file::discard_unfinished;
use apsides_nlp::Flow;

use crate::exit::{Exit, Refusal};

/// Longest time limit, s: a thousand years.
pub(crate) const LONGEST: f64 = 3.2e10;

/// A signal came.
static ASKED: AtomicBool = AtomicBool::new(false);
/// The command looks at the flag, so that a signal need not end it at once.
static LOOKED_AT: AtomicBool = AtomicBool::new(false);
/// The command ended its work because of a signal.
static HEEDED: AtomicBool = AtomicBool::new(false);
/// The command ended its work because of its time limit.
static EXPIRED: AtomicBool = AtomicBool::new(false);
static DEADLINE: OnceLock<Instant> = OnceLock::new();

/// Catches Ctrl-C, SIGTERM and SIGHUP: the first asks a command that looks at its [`StopFlag`] to end, the next ends the program at once, and so does the
/// first where nobody looks.
pub(crate) fn catch_signals() {
    // Without a handler a signal ends the program at once, which is the fallback.
    let _ = ctrlc::set_handler(|| {
        if ASKED.swap(true, Ordering::SeqCst) || !LOOKED_AT.load(Ordering::SeqCst) {
            discard_unfinished();
            release_all();
            std::process::exit(i32::from(Exit::Interrupted as u8));
        }
    });
}

/// The status of a command whose work ended before its end; that of its result else.
pub(crate) fn status_of(exit: Exit) -> Exit {
    if HEEDED.load(Ordering::SeqCst) {
        return exit.or(Exit::Interrupted);
    }
    if !EXPIRED.load(Ordering::SeqCst) {
        return exit;
    }
    // What is refused after the end of the time lacks what there was no time for.
    if exit == Exit::BadInput { Exit::NotSolved } else { exit.or(Exit::NotSolved) }
}

/// The reason for which the work ended before its end.
pub(crate) fn reason() -> &'static str {
    if EXPIRED.load(Ordering::SeqCst) && !HEEDED.load(Ordering::SeqCst) {
        "the time limit (--time-limit) is over"
    } else {
        "interrupted"
    }
}

/// The sentence of a refusal, with the reason for which the work ended where it did before its end.
pub(crate) fn with_reason(sentence: String) -> String {
    let ended = HEEDED.load(Ordering::SeqCst) || EXPIRED.load(Ordering::SeqCst);
    if ended && !sentence.starts_with(reason()) { format!("{}: {sentence}", reason()) } else { sentence }
}

/// The sentence of work that ended without a result.
pub(crate) fn stopped(what: &str) -> Refusal {
    let exit = status_of(Exit::NotSolved);
    Refusal { exit, sentence: format!("{}: {what}", reason()) }
}

/// Set once a signal or the time limit asks to stop.
#[derive(Clone, Copy)]
pub(crate) struct StopFlag;

impl StopFlag {
    /// The flag of a command that looks at it.
    pub(crate) fn install() -> Self {
        LOOKED_AT.store(true, Ordering::SeqCst);
        Self
    }

    /// The flag of work that leaves nothing behind when a signal ends it at once.
    pub(crate) fn of_short_work() -> Self {
        Self
    }

    /// As [`install`](Self::install), set also after so many seconds.
    pub(crate) fn within(limit: Option<f64>) -> Self {
        if let Some(limit) = limit {
            let _ = DEADLINE.set(Instant::now() + Duration::from_secs_f64(limit.clamp(0.0, LONGEST)));
        }
        Self::install()
    }

    pub(crate) fn is_set(self) -> bool {
        if ASKED.load(Ordering::SeqCst) {
            HEEDED.store(true, Ordering::SeqCst);
            return true;
        }
        self.is_late()
    }

    /// Returns true once a signal came, which is not heeded by that yet.
    pub(crate) fn was_asked(self) -> bool {
        ASKED.load(Ordering::SeqCst)
    }

    /// Returns true once a signal came; the time limit does not count.
    pub(crate) fn is_interrupted(self) -> bool {
        ASKED.load(Ordering::SeqCst) && self.is_set()
    }

    /// The same for work that no observer sees.
    pub(crate) fn cancellation(self) -> Cancellation {
        Cancellation::when(move || self.is_set())
    }

    fn is_late(self) -> bool {
        let late = DEADLINE.get().is_some_and(|end| Instant::now() >= *end);
        if late {
            EXPIRED.store(true, Ordering::SeqCst);
        }
        late
    }

    /// As [`flow`](Self::flow), but what a signal stops then is only a part of the work: the rest goes on until the next one.
    pub(crate) fn flow_of_part(self) -> Flow {
        if ASKED.swap(false, Ordering::SeqCst) || self.is_late() { Flow::Stop } else { Flow::Continue }
    }

    pub(crate) fn flow(self) -> Flow {
        if self.is_set() { Flow::Stop } else { Flow::Continue }
    }
}
