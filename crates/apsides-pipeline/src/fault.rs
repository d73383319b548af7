//! Panics of one case among many: an outcome of that case, not the end of all.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use serde::{Deserialize, Serialize};

/// A sample whose computation panicked: a fault of the program, not of the flight.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fault {
    /// Index of the sample.
    pub index: usize,
    /// Seed of the run; both together make the sample again.
    pub seed: u64,
    /// The message of the panic.
    pub message: String,
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { index, seed, message } = self;
        write!(
            f,
            "sample {index} of seed {seed} has no result by a fault of the program ({message}): please report it"
        )
    }
}

/// Does work whose panic is an outcome: its message. What the work was changing must not be used after that.
///
/// # Errors
/// The message of the panic.
pub fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|payload| message(&*payload))
}

fn message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().copied();
    let text = text.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("a panic without a message").to_owned()
}
