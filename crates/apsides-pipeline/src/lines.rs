//! Lines that fit a terminal.

/// Longest line of what is wrapped, characters.
pub const WIDTH: usize = 80;

/// The text in lines that fit a terminal, each behind `indent`. A word that is longer than a line is not broken.
///
/// ```
/// assert_eq!(apsides_pipeline::lines::wrapped("# ", "mass without propellant"), "# mass without propellant\n");
/// ```
#[must_use]
pub fn wrapped(indent: &str, text: &str) -> String {
    let mut lines = String::new();
    let mut line = String::new();
    for word in text.split_whitespace() {
        let length = indent.chars().count() + line.chars().count() + 1 + word.chars().count();
        if !line.is_empty() && length > WIDTH {
            lines += &format!("{indent}{line}\n");
            line.clear();
        }
        line += if line.is_empty() { "" } else { " " };
        line += word;
    }
    if line.is_empty() { lines } else { lines + &format!("{indent}{line}\n") }
}

/// A line of a TOML file with a comment: beside it where both fit a terminal, above it where they do not.
#[must_use]
pub fn commented(line: &str, comment: &str) -> String {
    let beside = format!("{line} # {comment}\n");
    let fits = !line.contains('\n') && beside.trim_end().chars().count() <= WIDTH;
    if fits { beside } else { format!("{}{line}\n", wrapped("# ", comment)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_fit_a_terminal() {
        let text = "word ".repeat(100) + &"w".repeat(90);
        let lines = wrapped("    ", &text);
        let (others, last) = lines.trim_end().rsplit_once('\n').unwrap();
        assert!(others.lines().all(|l| l.chars().count() <= WIDTH && l.starts_with("    word")), "{lines}");
        assert_eq!(last.trim().len(), 90, "a word is not broken");
        assert_eq!(lines.split_whitespace().count(), 101);
        assert_eq!(wrapped("  ", " "), "");
    }

    #[test]
    fn a_long_comment_stands_above() {
        assert_eq!(commented("a = 1", "short"), "a = 1 # short\n");
        let line = format!("{} = 1", "k".repeat(60));
        // The last character that fits, and one more.
        let comment = "c".repeat(WIDTH - line.len() - 3);
        assert_eq!(commented(&line, &comment), format!("{line} # {comment}\n"));
        assert_eq!(commented(&line, &format!("{comment}c")), format!("# {comment}c\n{line}\n"));
        let long = "word ".repeat(30);
        let text = commented("a = 1", &long);
        assert!(text.lines().count() == 3 && text.lines().all(|l| l.chars().count() <= WIDTH), "{text}");
        assert!(text.ends_with("\na = 1\n"), "{text}");
        let several = "a = \"\"\"\nb\"\"\"";
        assert_eq!(commented(several, "short"), format!("# short\n{several}\n"));
    }
}
