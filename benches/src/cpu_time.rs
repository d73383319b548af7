//! CPU time of the calling thread: what a solve costs, whatever else the machine does.

use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

/// A running stopwatch on the CPU time of the thread that started it.
#[derive(Clone, Copy, Debug)]
pub struct CpuTime(Duration);

impl CpuTime {
    /// Starts.
    #[must_use]
    pub fn start() -> Self {
        Self(now())
    }

    /// CPU time since the start, ms.
    #[must_use]
    pub fn milliseconds(self) -> f64 {
        now().saturating_sub(self.0).as_secs_f64() * 1e3
    }
}

fn now() -> Duration {
    let t = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(t.tv_sec.unsigned_abs(), u32::try_from(t.tv_nsec).unwrap_or(0))
}
