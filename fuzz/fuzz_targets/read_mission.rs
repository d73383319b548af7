//! Any text is read as a mission file, and as a value of one: an error in one sentence or a mission, never a panic.

#![no_main]

use std::sync::LazyLock;

use apsides_missions::registry;
use apsides_pipeline::Registry;
use libfuzzer_sys::fuzz_target;

static REGISTRY: LazyLock<Registry> = LazyLock::new(registry);

fuzz_target!(|text: &str| {
    let _ = REGISTRY.parse(text, "fuzz.toml", &[]);
    for (name, _) in REGISTRY.files().take(3) {
        // A line of `--set`.
        let _ = REGISTRY.load(name, &[text.to_owned()]);
    }
});
