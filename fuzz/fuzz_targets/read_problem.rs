//! Any text is read as a problem of its own: an error with its place or a problem, never a panic; what is read is written and read again.

#![no_main]

use apsides_problem_file::ProblemFile;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let no_files = |_: &str| Err(std::io::ErrorKind::NotFound.into());
    let _ = ProblemFile::parse(text, "fuzz.toml", &no_files, &[]);
});
