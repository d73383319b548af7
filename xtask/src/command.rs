//! Processes: cargo and others, run in the workspace root.

use std::ffi::OsStr;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

/// The cargo that runs this program, or the one in the path.
pub(crate) fn cargo_program() -> std::ffi::OsString {
    std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into())
}

/// Cargo with arguments, in the root of the workspace.
pub(crate) fn cargo<A: AsRef<OsStr>>(root: &Path, arguments: impl IntoIterator<Item = A>) -> Command {
    let mut command = Command::new(cargo_program());
    command.current_dir(root).args(arguments);
    command
}

/// A command as it is written in a document: words between blanks, no shell.
pub(crate) fn written(root: &Path, line: &str) -> Result<Command, String> {
    const SHELL: &[char] = &['"', '\'', '`', '|', '&', ';', '<', '>', '$', '*', '\\'];
    if line.contains(SHELL) {
        return Err(format!("`{line}` needs a shell; documented commands must do without"));
    }
    let mut words = line.split_whitespace();
    let mut command = match words.next() {
        None => return Err("an empty command".into()),
        Some("cargo") => Command::new(cargo_program()),
        Some(program) => Command::new(program),
    };
    command.current_dir(root).args(words);
    Ok(command)
}

/// Runs to the end with the terminal's output; an exit code other than zero is an error.
pub(crate) fn run(command: &mut Command) -> Result<(), String> {
    let line = describe(command);
    println!("$ {line}");
    let status = command.status().map_err(|e| format!("`{line}` does not start: {e}"))?;
    if status.success() { Ok(()) } else { Err(format!("`{line}` failed ({status})")) }
}

/// As [`run`], but shows the standard output line by line and returns the lines that are wanted.
pub(crate) fn run_keeping(
    command: &mut Command,
    wanted: impl Fn(&str) -> bool,
) -> Result<Vec<String>, String> {
    let line = describe(command);
    println!("$ {line}");
    let mut child =
        command.stdout(Stdio::piped()).spawn().map_err(|e| format!("`{line}` does not start: {e}"))?;
    let mut kept = Vec::new();
    if let Some(output) = child.stdout.take() {
        for text in BufReader::new(output).split(b'\n') {
            let text = text.map_err(|e| format!("`{line}`: output: {e}"))?;
            let text = String::from_utf8_lossy(&text);
            println!("{text}");
            if wanted(&text) {
                kept.push(text.into_owned());
            }
        }
    }
    let status = child.wait().map_err(|e| format!("`{line}`: {e}"))?;
    if status.success() { Ok(kept) } else { Err(format!("`{line}` failed ({status})")) }
}

/// The standard output of a command; its standard error goes to the terminal.
pub(crate) fn output(command: &mut Command) -> Result<String, String> {
    let line = describe(command);
    let out =
        command.stderr(Stdio::inherit()).output().map_err(|e| format!("`{line}` does not start: {e}"))?;
    if !out.status.success() {
        return Err(format!("`{line}` failed ({})", out.status));
    }
    String::from_utf8(out.stdout).map_err(|_| format!("`{line}`: output is not UTF-8"))
}

/// Returns true if a command runs and succeeds; its output is dropped.
pub(crate) fn succeeds(command: &mut Command) -> bool {
    command.stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|s| s.success())
}

/// Program name and arguments.
fn describe(command: &Command) -> String {
    let program = Path::new(command.get_program());
    let name = program.file_stem().unwrap_or(program.as_os_str());
    std::iter::once(name).chain(command.get_args()).map(OsStr::to_string_lossy).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn written_commands_are_plain_words() {
        let root = Path::new(".");
        let command = written(root, "cargo test --workspace").unwrap();
        assert_eq!(command.get_args().collect::<Vec<_>>(), ["test", "--workspace"]);
        assert!(written(root, "cargo test | tail").unwrap_err().contains("needs a shell"));
        assert!(written(root, " ").is_err());
    }
}
