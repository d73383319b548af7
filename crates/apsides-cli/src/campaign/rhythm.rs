//! The times of looks at work that others do: a hundredth of the time that it has taken between two of them, so that neither a file system nor a
//! queue has much to do with them, within bounds.

use std::time::{Duration, Instant};

const PART: u32 = 100;
const SHORTEST: Duration = Duration::from_millis(200);
const LONGEST: Duration = Duration::from_secs(30);

/// Says when the next look is due.
#[derive(Debug)]
pub(crate) struct Rhythm {
    begun: Instant,
    next: Instant,
}

impl Rhythm {
    /// The first look is due at once.
    pub(crate) fn start() -> Self {
        let begun = Instant::now();
        Self { begun, next: begun }
    }

    /// Returns true if a look is due, which the caller takes.
    pub(crate) fn is_due(&mut self) -> bool {
        let now = Instant::now();
        let due = now >= self.next;
        if due {
            self.next = now + pause(now - self.begun);
        }
        due
    }
}

/// The pause after work of some time.
fn pause(taken: Duration) -> Duration {
    (taken / PART).clamp(SHORTEST, LONGEST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looks_become_rare() {
        let seconds = Duration::from_secs;
        assert_eq!([0, 5, 100, 86_400].map(|s| pause(seconds(s))), [SHORTEST, SHORTEST, seconds(1), LONGEST]);
        let mut rhythm = Rhythm::start();
        assert!(rhythm.is_due() && !rhythm.is_due());
    }
}
