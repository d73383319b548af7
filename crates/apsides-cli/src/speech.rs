//! The voice of the program: what the flags of all commands ask for, and the colours of words.

use std::sync::OnceLock;

use anstream::ColorChoice as Choice;
use clap::ColorChoice;
use clap::builder::styling::{AnsiColor, Style};

use crate::arguments::Speech;

/// The voice of this run; without one the program speaks as by default.
static SPEECH: OnceLock<Speech> = OnceLock::new();

/// Speaks so from now on; the first time counts.
pub(crate) fn speak(speech: Speech) {
    color(speech.color);
    let _ = SPEECH.set(speech);
}

/// Colours of what is written from now on.
fn color(choice: ColorChoice) {
    match choice {
        ColorChoice::Auto => Choice::Auto,
        ColorChoice::Always => Choice::Always,
        ColorChoice::Never => Choice::Never,
    }
    .write_global();
}

/// Speaks as a command line asks that cannot be parsed.
pub(crate) fn speak_as_asked(words: impl Iterator<Item = std::ffi::OsString>) {
    let words: Vec<String> = words.map(|word| word.to_string_lossy().into_owned()).collect();
    let apart = words.iter().position(|word| word == "--color").and_then(|k| words.get(k + 1));
    let color = words.iter().find_map(|word| word.strip_prefix("--color=")).or(apart.map(String::as_str));
    let color = match color {
        Some("always") => ColorChoice::Always,
        Some("never") => ColorChoice::Never,
        _ => ColorChoice::Auto,
    };
    let json = words.iter().any(|word| word == "--json");
    speak(Speech { json, quiet: false, verbose: false, color });
}

/// Returns true if one JSON object is asked for.
pub(crate) fn is_json() -> bool {
    SPEECH.get().is_some_and(|speech| speech.json)
}

/// Returns true if nobody wants to see how far the work is.
pub(crate) fn is_quiet() -> bool {
    SPEECH.get().is_some_and(|speech| speech.quiet || speech.json)
}

/// Returns true if all is to be said.
pub(crate) fn is_verbose() -> bool {
    SPEECH.get().is_some_and(|speech| speech.verbose)
}

const GOOD: Style = AnsiColor::Green.on_default().bold();
const WARN: Style = AnsiColor::Yellow.on_default().bold();
const BAD: Style = AnsiColor::Red.on_default().bold();
const TITLE: Style = Style::new().bold();

fn painted(style: Style, text: &str) -> String {
    format!("{style}{text}{style:#}")
}

/// A word of what is as it should be.
pub(crate) fn good(text: &str) -> String {
    painted(GOOD, text)
}

/// A word of what is to be looked at.
pub(crate) fn warned(text: &str) -> String {
    painted(WARN, text)
}

/// A word of what is not as it should be.
pub(crate) fn bad(text: &str) -> String {
    painted(BAD, text)
}

/// Words that stand above others.
pub(crate) fn title(text: &str) -> String {
    painted(TITLE, text)
}
