//! Files that are read: regular ones alone, since a pipe or a device may never end.

use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::Path;

/// Most bytes of a file that is read as a whole, 1 GiB.
const MOST_BYTES: u64 = 1 << 30;

/// Opens a file.
///
/// # Errors
/// The system's; for a directory, a device, a socket or a pipe one that names it.
pub fn open(path: &Path) -> io::Result<File> {
    // Before it is opened: to open a pipe waits for its other end.
    let found = fs::metadata(path)?;
    if found.is_file() { File::open(path) } else { Err(refused(kind_of(&found))) }
}

/// Reads a file as a whole.
///
/// # Errors
/// As of [`open`]; for a file of more than 1 GiB one that says so.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let file = open(path)?;
    let too_many = || refused("has more than 1 GiB, which no file of this kind has");
    if file.metadata()?.len() > MOST_BYTES {
        return Err(too_many());
    }
    let mut bytes = Vec::new();
    // What the system says of its length need not be true.
    file.take(MOST_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MOST_BYTES {
        return Err(too_many());
    }
    Ok(bytes)
}

/// Reads a text as a whole.
///
/// # Errors
/// As of [`read`]; for bytes that are no UTF-8 one that says so.
pub fn read_text(path: &Path) -> io::Result<String> {
    text(read(path)?).map_err(|reason| refused(&reason))
}

/// Bytes as text, or the line of the first one that is none.
pub(crate) fn text(bytes: Vec<u8>) -> Result<String, String> {
    String::from_utf8(bytes).map_err(|e| {
        let good = &e.as_bytes()[..e.utf8_error().valid_up_to()];
        let line = good.iter().filter(|b| **b == b'\n').count() + 1;
        let byte = e.as_bytes().get(good.len()).map_or(0, |b| *b);
        format!("is not UTF-8 text: line {line} has the byte 0x{byte:02X}; write it again in UTF-8")
    })
}

/// True if an open file still has the name by which it was opened.
#[must_use]
pub fn is_at(file: &File, path: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt as _;
        let identity = |m: fs::Metadata| (m.dev(), m.ino());
        match (file.metadata().map(identity), fs::metadata(path).map(identity)) {
            (Ok(open), Ok(named)) => open == named,
            _ => false,
        }
    }
    #[cfg(not(unix))]
    {
        let _ = file;
        path.is_file()
    }
}

pub(crate) fn refused(reason: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, reason)
}

/// The kind of what is no regular file, and what to do.
pub(crate) fn kind_of(found: &fs::Metadata) -> &'static str {
    if found.is_dir() {
        return "is a directory; give a file";
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt as _;
        let kind = found.file_type();
        if kind.is_char_device() || kind.is_block_device() {
            return "is a device; give a file";
        }
        if kind.is_fifo() {
            return "is a pipe; give a file";
        }
        if kind.is_socket() {
            return "is a socket; give a file";
        }
    }
    "is no regular file; give one"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_read_and_nothing_else_is() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("a.txt");
        fs::write(&file, "text").unwrap();
        assert_eq!(read_text(&file).unwrap(), "text");
        fs::write(&file, b"one\ntwo\xe4").unwrap();
        let refused = read_text(&file).unwrap_err().to_string();
        assert_eq!(refused, "is not UTF-8 text: line 2 has the byte 0xE4; write it again in UTF-8");
        assert_eq!(read(dir.path()).unwrap_err().to_string(), "is a directory; give a file");
        assert_eq!(read(&dir.path().join("none")).unwrap_err().kind(), io::ErrorKind::NotFound);
    }

    #[cfg(unix)]
    #[test]
    fn a_file_that_was_removed_or_replaced_is_not_at_its_name() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.csv");
        let file = File::create(&path).unwrap();
        assert!(is_at(&file, &path));
        fs::remove_file(&path).unwrap();
        assert!(!is_at(&file, &path));
        // Two files at a time have two identities.
        fs::write(&path, "another").unwrap();
        assert!(!is_at(&file, &path));
    }

    #[cfg(unix)]
    #[test]
    fn a_device_that_never_ends_is_refused() {
        assert_eq!(read(Path::new("/dev/zero")).unwrap_err().to_string(), "is a device; give a file");
    }

    /// A file of holes takes no room on the disk.
    #[cfg(unix)]
    #[test]
    fn a_file_without_measure_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("holes");
        File::create(&path).unwrap().set_len(MOST_BYTES + 1).unwrap();
        assert!(read(&path).unwrap_err().to_string().starts_with("has more than 1 GiB"));
    }
}
