//! Rust text without comments and literals.

use std::iter::Peekable;
use std::str::Chars;

/// The text with comments and the contents of literals replaced by blanks; lines stay where they are.
///
/// Good enough for checks by words: it knows nested block comments, raw and byte strings, and tells lifetimes
/// from characters.
pub(crate) fn code(text: &str) -> String {
    let mut blank = Blanking { input: text.chars().peekable(), output: String::with_capacity(text.len()) };
    let mut previous = ' ';
    while let Some(c) = blank.input.next() {
        match c {
            '/' if blank.input.peek() == Some(&'/') => blank.line_comment(),
            '/' if blank.input.peek() == Some(&'*') => blank.block_comment(),
            '"' => blank.string(),
            'r' if !is_word(previous) || previous == 'b' => blank.raw_string_or_word(),
            '\'' => blank.character_or_lifetime(),
            _ => blank.output.push(c),
        }
        previous = c;
    }
    blank.output
}

struct Blanking<'a> {
    input: Peekable<Chars<'a>>,
    output: String,
}

impl Blanking<'_> {
    fn hide(&mut self, c: char) {
        self.output.push(if c == '\n' { '\n' } else { ' ' });
    }

    fn line_comment(&mut self) {
        self.hide('/');
        while let Some(c) = self.input.next_if(|c| *c != '\n') {
            self.hide(c);
        }
    }

    fn block_comment(&mut self) {
        self.hide('/');
        self.input.next();
        self.hide('*');
        let mut depth = 1;
        while depth > 0 {
            let Some(c) = self.input.next() else { return };
            self.hide(c);
            let (partner, change) = match c {
                '*' => ('/', -1),
                '/' => ('*', 1),
                _ => continue,
            };
            if let Some(second) = self.input.next_if_eq(&partner) {
                self.hide(second);
                depth += change;
            }
        }
    }

    fn string(&mut self) {
        self.output.push('"');
        while let Some(c) = self.input.next() {
            match c {
                '"' => return self.output.push('"'),
                '\\' => {
                    self.hide(c);
                    if let Some(escaped) = self.input.next() {
                        self.hide(escaped);
                    }
                }
                _ => self.hide(c),
            }
        }
    }

    /// After an `r` that begins a word.
    fn raw_string_or_word(&mut self) {
        self.output.push('r');
        let mut hashes = 0;
        while self.input.next_if_eq(&'#').is_some() {
            self.output.push('#');
            hashes += 1;
        }
        if self.input.next_if_eq(&'"').is_none() {
            return; // a word, or a raw identifier
        }
        self.output.push('"');
        let mut closing = None; // hashes seen since a quote
        while let Some(c) = self.input.next() {
            closing = match (c, closing) {
                ('"', _) => Some(0),
                ('#', Some(seen)) => Some(seen + 1),
                _ => None,
            };
            if closing == Some(hashes) {
                return self.output.push('"');
            }
            self.hide(c);
        }
    }

    fn character_or_lifetime(&mut self) {
        self.output.push('\'');
        let mut ahead = self.input.clone();
        let (first, second) = (ahead.next(), ahead.next());
        if first != Some('\\') && second != Some('\'') {
            return; // a lifetime
        }
        while let Some(c) = self.input.next() {
            match c {
                '\'' => return self.output.push('\''),
                '\\' => {
                    self.hide(c);
                    if let Some(escaped) = self.input.next() {
                        self.hide(escaped);
                    }
                }
                _ => self.hide(c),
            }
        }
    }
}

/// Returns true if a character can stand in an identifier.
pub(crate) fn is_word(c: char) -> bool {
    c == '_' || c.is_alphanumeric()
}

/// Returns true if a word occurs in a text as a whole word.
pub(crate) fn has_word(text: &str, word: &str) -> bool {
    text.match_indices(word)
        .any(|(i, _)| !text[..i].ends_with(is_word) && !text[i + word.len()..].starts_with(is_word))
}

/// Returns true if a path holds tests alone: under a `tests` folder of a package or module, or a file `tests.rs`.
pub(crate) fn is_test_file(path: &str) -> bool {
    // The package `tests/` of the workspace is not a tests folder itself; its own `tests/` is.
    let inner = path.strip_prefix("tests/").unwrap_or(path);
    inner.ends_with("/tests.rs") || inner.starts_with("tests/") || inner.contains("/tests/")
}

/// Lines before the unit tests at the end of a file.
pub(crate) fn lines_before_tests(text: &str) -> usize {
    let lines: Vec<&str> = text.lines().collect();
    let begins_tests = |k: usize| {
        lines[k] == "#[cfg(test)]"
            && lines[k + 1..]
                .iter()
                .find(|l| !l.starts_with("#["))
                .is_some_and(|l| l.starts_with("mod ") && l.ends_with('{'))
    };
    (0..lines.len()).find(|k| begins_tests(*k)).unwrap_or(lines.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_literals_are_blanked() {
        let cases = [
            ("a // todo!()\nb", "a           \nb"),
            ("a /* x /* y */ z */ b", "a                   b"),
            ("a /*/ x */ b", "a          b"),
            (r#"f("dbg!(\"x\")", y)"#, r#"f("           ", y)"#),
            (r##"r#"a "quoted" b"#; c"##, r##"r#"             "; c"##),
            (r#"br"x" for"#, r#"br" " for"#),
            ("'\"' + '\\'' + b'x'", "' ' + '  ' + b' '"),
            ("fn f<'a>(x: &'a str)", "fn f<'a>(x: &'a str)"),
            ("let r#type = number;", "let r#type = number;"),
        ];
        for (text, expected) in cases {
            assert_eq!(code(text), expected, "{text}");
        }
    }

    #[test]
    fn lines_are_kept() {
        let text = "/* a\n b */ \"c\nd\" // e\n";
        assert_eq!(code(text).lines().count(), text.lines().count());
    }

    #[test]
    fn words_are_whole() {
        assert!(has_word("use faer::Mat;", "faer"));
        assert!(!has_word("use faers::Mat;", "faer"));
        assert!(!has_word("let my_faer = 1", "faer"));
    }

    #[test]
    fn test_files_are_told_apart() {
        assert!(is_test_file("crates/apsides-kkt/tests/kkt.rs"));
        assert!(is_test_file("crates/apsides-ad/src/node/tests.rs"));
        assert!(is_test_file("tests/tests/literature.rs"));
        assert!(!is_test_file("tests/src/lib.rs"));
        assert!(!is_test_file("crates/apsides-ad/src/node.rs"));
    }

    #[test]
    fn unit_tests_are_not_counted() {
        assert_eq!(lines_before_tests("a\nb\n#[cfg(test)]\nmod tests {\n}\n"), 2);
        assert_eq!(lines_before_tests("a\n#[cfg(test)]\nmod tests;\nb\n"), 4);
        assert_eq!(lines_before_tests("a\n#[cfg(test)]\nuse x;\nb\n"), 4);
    }
}
