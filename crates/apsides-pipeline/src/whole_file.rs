//! The one writer of files: what it writes is there whole or not at all.
//!
//! A file is made beside its place under a hidden name (`.apsides-*`), flushed to the disk, and only then renamed into its place. A reader sees
//! the old file or the new one, never a part; a full disk or an interrupt leaves the old one. A symbolic link stays and its target is replaced.
//! A hidden file is locked while its process lives, so that those of killed ones are known and removed by the next that writes beside them.
//! Devices, sockets and pipes are refused by name, since a rename would take their place.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::regular_file::{kind_of, refused};

/// Links to links that are followed.
const LONGEST_CHAIN: usize = 40;

/// Hidden files that are not in their places yet. The lock is held while files are moved, so that a program does not end halfway.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Directories in which what killed processes left was looked for.
static TIDIED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

static NEXT: AtomicU64 = AtomicU64::new(0);

/// Beginning of the names of hidden files.
const HIDDEN: &str = ".apsides-";

fn unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    // A set of paths has no state that a panic could leave behind.
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes the hidden files of this process that are not in their places, for a program that is about to end. Files that are just being moved
/// are moved before.
pub fn discard_unfinished() {
    for path in std::mem::take(&mut *unfinished()) {
        let _ = fs::remove_file(path);
    }
}

/// True for an error that is a mistake in the request (a device, a directory, a missing directory), not a failure to write.
#[must_use]
pub fn is_refusal(e: &io::Error) -> bool {
    e.kind() == io::ErrorKind::InvalidInput
}

/// The place of a file with all symbolic links followed.
///
/// # Errors
/// Of [`is_refusal`] for a directory, a device, a socket, a pipe, a file without write permission, or a place in no directory.
pub fn place(path: &Path) -> io::Result<PathBuf> {
    match fs::metadata(path) {
        Ok(found) if found.is_file() => {
            if found.permissions().readonly() {
                return Err(refused("is write-protected: name another file, or allow writing"));
            }
        }
        Ok(found) => return Err(refused(kind_of(&found))),
        Err(e) if e.kind() == io::ErrorKind::NotFound => {}
        Err(e) if e.kind() == io::ErrorKind::NotADirectory => {
            return Err(refused("a file is in the place of its directory"));
        }
        Err(e) => return Err(e),
    }
    let mut at = path.to_owned();
    for _ in 0..LONGEST_CHAIN {
        let Ok(next) = fs::read_link(&at) else {
            let home = directory(&at);
            return match home.is_dir() {
                true => Ok(at),
                false => Err(refused("its directory does not exist")),
            };
        };
        at = directory(&at).join(next);
    }
    Err(refused("is a chain of symbolic links without an end"))
}

fn directory(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if parent.as_os_str().is_empty() => Path::new("."),
        Some(parent) => parent,
        None => path,
    }
}

/// A file in the making.
#[derive(Debug)]
pub struct WholeFile {
    place: PathBuf,
    hidden: PathBuf,
    writer: BufWriter<File>,
}

impl WholeFile {
    /// Begins a file; nothing is at `path` before [`publish`](Self::publish).
    ///
    /// # Errors
    /// As of [`place`]; the system's.
    pub fn create(path: &Path) -> io::Result<Self> {
        let place = place(path)?;
        let (hidden, file) = hidden_beside(&place)?;
        let made = Self { writer: BufWriter::new(file), hidden, place };
        if let Ok(earlier) = fs::metadata(&made.place) {
            fs::set_permissions(&made.hidden, earlier.permissions())?;
        }
        Ok(made)
    }

    /// Writes all that is buffered to the disk.
    fn settle(&mut self) -> io::Result<()> {
        self.writer.flush()?;
        self.writer.get_ref().sync_all()
    }

    /// Puts the file into its place.
    ///
    /// # Errors
    /// The system's; what was there before is there then.
    pub fn publish(self) -> io::Result<()> {
        publish_together(vec![self], &[]).map_err(|(_, e)| e)
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

impl Read for WholeFile {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.writer.flush()?;
        self.writer.get_mut().read(bytes)
    }
}

impl Seek for WholeFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.writer.seek(to)
    }
}

impl Drop for WholeFile {
    fn drop(&mut self) {
        let mut unfinished = unfinished();
        if unfinished.remove(&self.hidden) {
            let _ = fs::remove_file(&self.hidden);
        }
    }
}

/// A new hidden file beside a place.
fn hidden_beside(place: &Path) -> io::Result<(PathBuf, File)> {
    let process = std::process::id();
    if TIDIED.lock().unwrap_or_else(PoisonError::into_inner).insert(directory(place).to_owned()) {
        remove_abandoned(directory(place));
    }
    loop {
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let hidden = directory(place).join(format!("{HIDDEN}{process}-{number}"));
        let mut unfinished = unfinished();
        match File::options().read(true).write(true).create_new(true).open(&hidden) {
            Ok(file) => {
                // Where a file system has no locks, what a killed process leaves stays.
                let _ = file.try_lock();
                unfinished.insert(hidden.clone());
                return Ok((hidden, file));
            }
            // A killed process had this number.
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
            Err(e) => return Err(e),
        }
    }
}

/// Removes the hidden files of a directory whose processes were killed before they had moved them into their places.
fn remove_abandoned(directory: &Path) {
    let Ok(entries) = fs::read_dir(directory) else { return };
    for entry in entries.filter_map(Result::ok) {
        let name = entry.file_name();
        let process = name.to_str().and_then(|name| name.strip_prefix(HIDDEN)).and_then(process_of);
        if process.is_some_and(|process| !is_alive(process)) {
            let path = entry.path();
            // Its process is dead, unless it is one that this machine does not see: then it has the lock.
            if File::open(&path).is_ok_and(|file| file.try_lock().is_ok()) {
                let _ = fs::remove_file(path);
            }
        }
    }
}

/// The process that made a hidden file, by the rest of its name; none for what else begins so.
fn process_of(rest: &str) -> Option<u32> {
    let (process, number) = rest.split_once('-')?;
    number.parse::<u64>().ok()?;
    process.parse().ok()
}

/// False for a process that is known to have ended.
fn is_alive(process: u32) -> bool {
    let processes = Path::new("/proc/self");
    process == std::process::id() || (processes.exists() && Path::new(&format!("/proc/{process}")).exists())
}

/// Puts files into their places and removes the `stale` ones, all or none.
///
/// # Errors
/// The path that failed and the reason; all is as it was before then.
pub fn publish_together(mut files: Vec<WholeFile>, stale: &[PathBuf]) -> Result<(), (PathBuf, io::Error)> {
    for file in &mut files {
        file.settle().map_err(|e| (file.place.clone(), e))?;
    }
    // Nothing is set aside for a single file: its rename is done or not.
    let alone = files.len() + stale.len() == 1;
    let mut unfinished = unfinished();
    let mut moves = Moves::default();
    let moved = files.iter().try_for_each(|file| moves.replace(&file.hidden, &file.place, alone));
    let moved = moved.and_then(|()| stale.iter().try_for_each(|path| moves.remove(path)));
    match moved {
        Ok(()) => {
            for file in &files {
                unfinished.remove(&file.hidden);
                // Where a directory cannot be flushed, the rename is in the hands of the system.
                let _ = File::open(directory(&file.place)).and_then(|d| d.sync_all());
            }
            moves.forget();
            drop(unfinished);
            Ok(())
        }
        Err(e) => {
            moves.undo();
            drop(unfinished);
            Err(e)
        }
    }
}

/// Renames that can be undone.
#[derive(Default)]
struct Moves {
    /// Hidden name of a new file, and its place.
    placed: Vec<(PathBuf, PathBuf)>,
    /// Place of an earlier file, and the hidden name under which it is kept.
    kept: Vec<(PathBuf, PathBuf)>,
}

impl Moves {
    fn replace(&mut self, new: &Path, place: &Path, alone: bool) -> Result<(), (PathBuf, io::Error)> {
        if !alone {
            self.keep(place, false)?;
        }
        fs::rename(new, place).map_err(|e| (place.to_owned(), e))?;
        self.placed.push((new.to_owned(), place.to_owned()));
        Ok(())
    }

    fn remove(&mut self, place: &Path) -> Result<(), (PathBuf, io::Error)> {
        self.keep(place, true)
    }

    /// Keeps what is at a place under a hidden name, and takes it away from there if need be.
    fn keep(&mut self, place: &Path, take: bool) -> Result<(), (PathBuf, io::Error)> {
        match fs::symlink_metadata(place) {
            Ok(found) if found.is_dir() => return Err((place.to_owned(), refused(kind_of(&found)))),
            Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(()),
            _ => {}
        }
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        // Another name than that of a file in the making: it may be all that there is of the earlier one.
        let aside = directory(place).join(format!("{HIDDEN}{}-{number}.earlier", std::process::id()));
        let _ = fs::remove_file(&aside);
        // A second name leaves the place filled all the time; some file systems have none.
        let linked = !take && fs::hard_link(place, &aside).is_ok();
        if !linked {
            fs::rename(place, &aside).map_err(|e| (place.to_owned(), e))?;
        }
        self.kept.push((place.to_owned(), aside));
        Ok(())
    }

    fn undo(&self) {
        for (new, place) in self.placed.iter().rev() {
            let _ = fs::rename(place, new);
        }
        for (place, aside) in self.kept.iter().rev() {
            // Two names of the same file: the rename does nothing then.
            let _ = fs::rename(aside, place);
            let _ = fs::remove_file(aside);
        }
    }

    fn forget(&self) {
        for (_, aside) in &self.kept {
            let _ = fs::remove_file(aside);
        }
    }
}

/// Writes a file, whole or not at all.
///
/// # Errors
/// As of [`place`]; the system's.
pub fn write_whole(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut file = WholeFile::create(path)?;
    file.write_all(content)?;
    file.publish()
}

/// Says whether a file can be written at `path`, and leaves nothing there.
///
/// # Errors
/// As of [`place`]; the system's.
pub fn check_file(path: &Path) -> io::Result<()> {
    WholeFile::create(path).map(drop)
}

/// Says whether files can be written into a directory, which need not exist, and leaves nothing there.
///
/// # Errors
/// Of [`is_refusal`] where a file is in its place; the system's.
pub fn check_directory(dir: &Path) -> io::Result<()> {
    match fs::metadata(dir) {
        Ok(found) if found.is_dir() => hidden_beside(&dir.join("file")).map(|(hidden, file)| {
            drop(WholeFile { place: hidden.clone(), hidden, writer: BufWriter::new(file) });
        }),
        Ok(_) => Err(refused("is a file; give a directory")),
        Err(e) if e.kind() == io::ErrorKind::NotFound => {
            if fs::symlink_metadata(dir).is_ok() {
                return Err(refused("is a symbolic link to nothing"));
            }
            check_directory(directory(dir))
        }
        Err(e) if e.kind() == io::ErrorKind::NotADirectory => {
            Err(refused("a file is in the place of one of its directories"))
        }
        Err(e) => Err(e),
    }
}

#[cfg(test)]
mod tests;
