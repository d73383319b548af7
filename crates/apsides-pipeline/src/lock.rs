//! One process for a directory of results.
//!
//! The lock is the system's, on a hidden file that says who holds it: it ends with the process however that ends, so that one left behind by a
//! process that was killed holds nobody off.

use std::fs::{self, File, TryLockError};
use std::io::{self, Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Name of the file in its directory.
const NAME: &str = ".apsides-lock";

/// Times that a lock is tried whose file is taken away at that moment.
const TRIES: usize = 100;

/// Locks of this process, for [`release_all`].
static HELD: Mutex<Vec<Traces>> = Mutex::new(Vec::new());

/// The traces of a lock on the disk: its file, and directories that were made for it, the innermost first.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Traces {
    file: PathBuf,
    made: Vec<PathBuf>,
}

impl Traces {
    fn remove(&self) {
        let _ = fs::remove_file(&self.file);
        for dir in &self.made {
            // Only those in which nothing was written.
            let _ = fs::remove_dir(dir);
        }
    }
}

fn held() -> MutexGuard<'static, Vec<Traces>> {
    // A list of paths has no state that a panic could leave behind.
    HELD.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Gives up all locks of this process, for a program that is about to end.
pub fn release_all() {
    std::mem::take(&mut *held()).iter().for_each(Traces::remove);
}

/// A directory that is ours until this is dropped.
#[derive(Debug)]
pub struct DirectoryLock {
    traces: Traces,
    /// Open as long as the lock is held.
    _held: File,
}

impl DirectoryLock {
    /// Takes a directory, which is made when missing. `who` says what it is taken for.
    ///
    /// # Errors
    /// [`io::ErrorKind::InvalidInput`] where another process has it, which is named; the system's.
    pub fn take(dir: &Path, who: &str) -> io::Result<Self> {
        let missing = dir.ancestors().take_while(|d| !d.as_os_str().is_empty() && !d.exists());
        let made = missing.map(Path::to_owned).collect();
        fs::create_dir_all(dir)?;
        let file = dir.join(NAME);
        for _ in 0..TRIES {
            let mut held = File::options().read(true).write(true).create(true).truncate(false).open(&file)?;
            match held.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    let mut holder = String::new();
                    let _ = held.read_to_string(&mut holder);
                    let reason = format!(
                        "is in use by {}: wait for its end, or name another directory",
                        holder.trim()
                    );
                    return Err(io::Error::new(io::ErrorKind::InvalidInput, reason));
                }
                // A file system without locks.
                Err(TryLockError::Error(_)) => {}
            }
            if !is_at(&held, &file) {
                // Its holder took it away between our opening and locking it.
                continue;
            }
            held.set_len(0)?;
            held.rewind()?;
            write!(held, "process {} ({who})", std::process::id())?;
            held.flush()?;
            let traces = Traces { file, made };
            self::held().push(traces.clone());
            return Ok(Self { traces, _held: held });
        }
        Err(io::Error::other("its lock changes hands all the time"))
    }
}

#[cfg(unix)]
fn is_at(held: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    let number = |m: fs::Metadata| (m.dev(), m.ino());
    match (held.metadata().map(number), fs::metadata(path).map(number)) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    }
}

#[cfg(not(unix))]
fn is_at(_held: &File, path: &Path) -> bool {
    path.exists()
}

impl Drop for DirectoryLock {
    fn drop(&mut self) {
        let mut held = held();
        if let Some(place) = held.iter().position(|traces| *traces == self.traces) {
            held.swap_remove(place).remove();
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_directory_is_held_once_and_a_stale_lock_holds_nobody() {
        let dir = tempfile::tempdir().unwrap();
        let inner = dir.path().join("a/b");
        let first = DirectoryLock::take(&inner, "solve one").unwrap();
        let reason = DirectoryLock::take(&inner, "solve two").unwrap_err().to_string();
        assert!(reason.starts_with("is in use by process ") && reason.contains("(solve one)"), "{reason}");
        drop(first);
        // What was made for nothing is gone.
        assert!(!dir.path().join("a").exists());
        fs::write(dir.path().join(NAME), "process 1 (killed long ago)").unwrap();
        let second = DirectoryLock::take(dir.path(), "solve three").unwrap();
        assert!(fs::read_to_string(dir.path().join(NAME)).unwrap().contains("solve three"));
        drop(second);
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
    }
}
