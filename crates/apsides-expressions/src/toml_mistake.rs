//! Mistakes in the syntax of TOML files, in words for those who write them.

/// A sentence in place of the parser's message about a text that is not TOML; `at` is the byte of the mistake.
#[must_use]
pub fn plain_words(message: &str, text: &str, at: usize) -> String {
    let text = text.trim_start_matches('\u{feff}');
    let at = (0..=at.min(text.len())).rev().find(|k| text.is_char_boundary(*k)).unwrap_or_default();
    let (before, behind) = text.split_at(at);
    let start = before.rfind('\n').map_or(0, |k| k + 1);
    let end = behind.find(['\n', '\r']).map_or(text.len(), |k| at + k);
    let line = text.get(start..end).unwrap_or_default().trim();
    let shown = shortened(line);
    let value = line.split_once('=').map_or("", |(_, value)| value).trim();
    let key = shortened(line.split_once('=').map_or(line, |(key, _)| key).trim().trim_matches(['[', ']']));
    let of_number =
        ["mantissa", "fraction", "exponent", "hexadecimal", "octal", "binary", "integer", "float"];
    let has = |part: &str| message.contains(part);
    if has("duplicate key") {
        return format!("`{key}` stands twice in this table: leave one of them");
    }
    if has("must be quoted") || has("invalid value") || has("invalid boolean") {
        return match value {
            "" => format!("`{key}` has no value: a number, a text in quotes, true or false is expected"),
            _ => format!(
                "`{}` is no value: a number, a text in quotes, true or false is expected",
                shortened(value)
            ),
        };
    }
    if has("may only go between digits") || of_number.iter().any(|word| has(&format!("invalid {word}"))) {
        return format!("`{}` is no number: numbers are written as 12, -0.5 or 1.5e3", shortened(value));
    }
    if has("key with no value") || has("invalid key-value pair") {
        return format!("`{shown}` is neither `key = value` nor the name of a table in brackets, `[table]`");
    }
    if has("unexpected key or value") {
        let more = shortened(text.get(at..end).unwrap_or_default().trim());
        return format!(
            "`{more}` stands behind a value that is complete: one `key = value` goes on a line, numbers have a point"
        );
    }
    if has("cannot extend value") {
        return format!(
            "`{key}` goes on a key that has a value above: make that one a table, or leave one of them"
        );
    }
    if has("escaped value") {
        return "a backslash in a text between double quotes begins an escape: write it twice, or take single quotes"
            .into();
    }
    message.to_owned()
}

/// Most characters of a file in a sentence.
const SHOWN: usize = 40;

fn shortened(text: &str) -> String {
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}..", &text[..end]),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mistake_is_told_in_words_of_the_file() {
        for (message, text, at, sentence) in [
            ("duplicate key", "a = 1\na = 2\n", 6, "`a` stands twice in this table: leave one of them"),
            ("duplicate key", "[a]\n[a]\n", 4, "`a` stands twice in this table: leave one of them"),
            (
                "string values must be quoted, expected literal string",
                "a =\n",
                3,
                "`a` has no value: a number, a text in quotes, true or false is expected",
            ),
            (
                "string values must be quoted, expected literal string",
                "\na = lunar # one\n",
                5,
                "`lunar # one` is no value: a number, a text in quotes, true or false is expected",
            ),
            (
                "invalid mantissa, expected digits",
                "a = .5",
                4,
                "`.5` is no number: numbers are written as 12, -0.5 or 1.5e3",
            ),
            (
                "key with no value, expected `=`",
                "a 4",
                2,
                "`a 4` is neither `key = value` nor the name of a table in brackets, `[table]`",
            ),
            (
                "unexpected key or value, expected newline, `#`",
                "a = 1,5",
                5,
                "`,5` stands behind a value that is complete: one `key = value` goes on a line, numbers have a point",
            ),
            (
                "cannot extend value of type integer with a dotted key",
                "a = 1\na.b = 2\n",
                6,
                "`a.b` goes on a key that has a value above: make that one a table, or leave one of them",
            ),
            ("unclosed array, expected `]`", "a = [", 5, "unclosed array, expected `]`"),
        ] {
            assert_eq!(plain_words(message, text, at), sentence);
        }
        // Any place, also one behind the end or within a character.
        let text = format!("a = \"{}\" x", "\u{e4}".repeat(60));
        for at in 0..text.len() + 9 {
            let told = plain_words("invalid value", &text, at);
            assert!(told.len() < 200, "{told}");
        }
    }
}
