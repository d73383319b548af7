//! One process for a directory of results.
//!
//! The lock is the system's, on a hidden file that says who holds it: it ends with the process however that ends, so that one left behind by a
//! process that was killed holds nobody off.

use std::fs::{self, File, TryLockError};
use std::io::{self, Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};

/// Name of the file in its directory.
const NAME: &str = ".apsides-lock";

/// Times that a lock is tried whose file is taken away at that moment.
const TRIES: usize = 100;

/// A directory that is ours until this is dropped.
#[derive(Debug)]
pub struct DirectoryLock {
    file: PathBuf,
    /// Open as long as the lock is held.
    _held: File,
    /// Directories that were made for it, the innermost first.
    made: Vec<PathBuf>,
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
            return Ok(Self { file, _held: held, made });
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
        let _ = fs::remove_file(&self.file);
        for dir in &self.made {
            // Only those in which nothing was written.
            let _ = fs::remove_dir(dir);
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
