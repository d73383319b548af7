//! The commands of README.md, so that what is documented is what is tested.

/// The first documented command.
pub(crate) fn first_command(readme: &str) -> Result<String, String> {
    commands(readme)
        .into_iter()
        .next()
        .ok_or_else(|| "README.md has no fenced block with a cargo command".into())
}

/// The documented command that runs the tests.
pub(crate) fn test_command(readme: &str) -> Result<String, String> {
    commands(readme)
        .into_iter()
        .find(|c| c == "cargo test" || c.starts_with("cargo test "))
        .ok_or_else(|| "README.md has no fenced block with a `cargo test` command".into())
}

/// All lines in fenced shell blocks that run cargo, without prompt and comment.
fn commands(readme: &str) -> Vec<String> {
    let is_shell = |language: &str| matches!(language, "" | "sh" | "bash" | "shell" | "console" | "text");
    let command = |line: &str| {
        let command = line.strip_prefix("$ ").unwrap_or(line);
        command.split(" #").next().unwrap_or(command).trim_end().to_owned()
    };
    fenced_lines(readme, is_shell).map(command).filter(|command| command.starts_with("cargo ")).collect()
}

/// The lines inside fenced blocks of some languages, trimmed.
pub(crate) fn fenced_lines(page: &str, is_wanted: impl Fn(&str) -> bool) -> impl Iterator<Item = &str> {
    let mut wanted = None; // inside a block: whether it is one of these
    page.lines().map(str::trim).filter(move |line| match line.strip_prefix("```") {
        Some(language) => {
            wanted = match wanted {
                None => Some(is_wanted(language.trim())),
                Some(_) => None,
            };
            false
        }
        None => wanted == Some(true),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const README: &str = "\
# apsides
Run `cargo install` some day.

```toml
cargo = 1
```

```sh
$ cargo run --release -p apsides-cli -- solve x --out results   # a minute
cargo test --workspace
```
";

    #[test]
    fn commands_come_from_shell_blocks() {
        assert_eq!(
            first_command(README).unwrap(),
            "cargo run --release -p apsides-cli -- solve x --out results"
        );
        assert_eq!(test_command(README).unwrap(), "cargo test --workspace");
    }

    #[test]
    fn absent_commands_are_errors() {
        assert!(first_command("cargo test").is_err());
        assert!(test_command("```\ncargo run\ncargo testing\n```").is_err());
    }
}
