//! Any text is read as a mission file and as a problem of its own: an error in one sentence or a mission, never a panic.

#![no_main]

use apsides_missions::registry;
use apsides_problem_file::ProblemFile;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let registry = registry();
    for (name, _) in registry.files().take(3) {
        // A line of `--set`.
        let _ = registry.load(name, &[text.to_owned()]);
    }
    let no_files = |_: &str| Err(std::io::ErrorKind::NotFound.into());
    let _ = ProblemFile::parse(text, "fuzz.toml", &no_files, &[]);
});
