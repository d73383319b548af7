//! The assessment of a map while a user and a time limit look on.

use std::sync::atomic::{AtomicU64, Ordering};

use apsides::terrain::Geometry;

use crate::exit::Refusal;
use crate::progress::Progress;
use crate::stop::{StopFlag, stopped};

/// Assessment as long as the user and the time limit let it go on.
pub(crate) struct Watched {
    stop: StopFlag,
    progress: Progress,
    /// Pixels of the hazard map.
    assessed: AtomicU64,
}

impl Watched {
    /// Shows how far it is of so many pixels, several passes together.
    pub(crate) fn new(stop: StopFlag, pixels: u64) -> Self {
        let progress = Progress::counted(stop, pixels, "pixels");
        Self { stop, progress, assessed: AtomicU64::new(0) }
    }

    /// Shows that pixels are done.
    pub(crate) fn advance(&self, pixels: usize) {
        self.progress.advance(pixels as u64);
    }

    /// Takes the display away.
    pub(crate) fn finish(&self) {
        self.progress.finish();
    }

    /// Lets the next pixels pass.
    pub(crate) fn goes_on(&self, pixels: usize) -> bool {
        if self.stop.is_set() {
            return false;
        }
        self.advance(pixels);
        true
    }

    /// The same, of the hazard map.
    pub(crate) fn assesses(&self, pixels: usize) -> bool {
        let goes_on = self.goes_on(pixels);
        if goes_on {
            self.assessed.fetch_add(pixels as u64, Ordering::Relaxed);
        }
        goes_on
    }

    /// Part of the hazard map that was assessed.
    pub(crate) fn fraction(&self, geometry: &Geometry) -> f64 {
        self.assessed.load(Ordering::Relaxed) as f64 / geometry.pixels() as f64
    }

    /// A signal leaves the files of before as they were.
    pub(crate) fn unless_interrupted(&self) -> Result<(), Refusal> {
        if self.stop.is_interrupted() { Err(stopped("no file is written")) } else { Ok(()) }
    }
}
