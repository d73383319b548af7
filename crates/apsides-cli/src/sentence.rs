//! Sentences for a terminal: without control characters, no word longer than a line.

use apsides::pipeline::lines::commented;
pub(crate) use apsides::pipeline::lines::{WIDTH, wrapped};

/// Longest word that is shown as it is, characters.
const LONGEST: usize = 120;
/// Characters that are left of each end of a longer one.
const ENDS: usize = 40;
/// Most digits of a number.
const DIGITS: usize = 25;

/// The text with control characters escaped, long words and long numbers shortened.
pub(crate) fn readable(text: &str) -> String {
    let mut shown = String::with_capacity(text.len().min(4096));
    for (k, line) in text.split('\n').enumerate() {
        if k > 0 {
            shown.push('\n');
        }
        for (k, word) in line.split(' ').enumerate() {
            if k > 0 {
                shown.push(' ');
            }
            shown += &shortened(&number(word).unwrap_or_else(|| word.to_owned()));
        }
    }
    shown
}

/// The text of a TOML file whose comments fit a terminal: those of long lines stand above what they belong to. The values stay as they are.
pub(crate) fn with_fitting_comments(file: &str) -> String {
    // A comment within texts of several lines is none.
    if file.contains("\"\"\"") || file.contains("'''") {
        return file.to_owned();
    }
    let line = |line: &str| {
        let (value, comment) = line.split_at(comment_of(line).unwrap_or(line.len()));
        if line.trim_end().chars().count() <= WIDTH || comment.is_empty() {
            return line.to_owned();
        }
        let (value, comment) = (value.trim_end(), comment.trim_start_matches('#').trim());
        if value.is_empty() { wrapped("# ", comment) } else { commented(value, comment) }
    };
    file.split_inclusive('\n').map(line).collect()
}

/// The byte at which the comment of a line begins, outside of texts.
fn comment_of(line: &str) -> Option<usize> {
    let (mut quote, mut escaped) = (None, false);
    line.char_indices().find_map(|(at, c)| {
        match (quote, c) {
            (None, '#') => return Some(at),
            (None, '"' | '\'') => quote = Some(c),
            (Some('"'), '\\') if !escaped => {
                escaped = true;
                return None;
            }
            (Some(begun), _) if begun == c && !escaped => quote = None,
            _ => {}
        }
        escaped = false;
        None
    })
}

/// The text with its long lines broken where words end, further lines as far in as the second column of a list, or a little. Lines of
/// more columns are those of a table, and stay.
pub(crate) fn fitted(text: &str) -> String {
    let line = |line: &str| if width(line.trim_end()) > WIDTH { broken(line) } else { line.to_owned() };
    text.split_inclusive('\n').map(line).collect()
}

/// Characters that stand on a terminal: those without the colours.
fn width(text: &str) -> usize {
    anstream::adapter::strip_str(text).to_string().chars().count()
}

/// Columns by which lines below a wide first column are further in than it.
const DEEPER: usize = 4;

fn broken(line: &str) -> String {
    let bare = line.trim_end();
    let words = bare.trim_start();
    let words = words.split_once("  ").map_or(words, |(_, rest)| rest.trim_start());
    let head = bare.strip_suffix(words).unwrap_or_default();
    if words.contains("  ") {
        return line.to_owned();
    }
    let indent = width(bare) - width(bare.trim_start());
    let hanging = match width(head) {
        head if head == indent => head + 2,
        // Behind a wide first column there is no room for words.
        head if head > WIDTH / 2 => indent + DEEPER,
        head => head,
    };
    let (mut text, mut length) = (head.to_owned(), width(head));
    for (k, word) in words.split(' ').enumerate() {
        let wide = width(word);
        if k > 0 && length + 1 + wide > WIDTH {
            text += &format!("\n{}", " ".repeat(hanging));
            length = hanging;
        } else if k > 0 {
            text.push(' ');
            length += 1;
        }
        text += word;
        length += wide;
    }
    text.push('\n');
    text
}

/// A name of a file or a key on one line.
pub(crate) fn name(text: &str) -> String {
    readable(&text.replace('\n', "\\n"))
}

/// A number with more digits than anyone reads, with an exponent.
fn number(word: &str) -> Option<String> {
    let bare = word.trim_end_matches([',', ';', ':', '.']);
    let digits = bare.chars().filter(char::is_ascii_digit).count();
    let plain = bare.chars().all(|c| c.is_ascii_digit() || matches!(c, '-' | '.'));
    let value = (digits > DIGITS && plain).then(|| bare.parse::<f64>().ok())??;
    Some(format!("{value:e}{}", word.strip_prefix(bare).unwrap_or_default()))
}

fn shortened(word: &str) -> String {
    let escaped = |text: &str| -> String {
        let escape = |c: char| if c.is_control() { c.escape_default().to_string() } else { c.to_string() };
        text.chars().map(escape).collect()
    };
    let count = word.chars().count();
    if count <= LONGEST {
        return escaped(word);
    }
    let start: String = word.chars().take(ENDS).collect();
    let end: String = word.chars().skip(count - ENDS).collect();
    format!("{}..({count} characters)..{}", escaped(&start), escaped(&end))
}

/// The sentence of a refusal with the values that were set, where it names none of their keys.
pub(crate) fn with_set(sentence: String, set: &[String]) -> String {
    let key = |text: &String| text.split_once('=').map_or(text.clone(), |(key, _)| key.trim().to_owned());
    if set.is_empty() || set.iter().any(|text| sentence.contains(&key(text))) {
        return sentence;
    }
    format!("{sentence} (with --set {})", set.join(" --set "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lines_hang_below_their_column() {
        let words = "word ".repeat(30);
        let wide = format!("  +1 km3/s2 of {}:  ", "key".repeat(12));
        for (line, hanging) in [("name      ", 10), ("  key:  ", 8), ("", 2), ("    ", 6), (wide.as_str(), 6)]
        {
            let text = fitted(&format!("{line}{}\n", words.trim_end()));
            let lines: Vec<&str> = text.lines().collect();
            assert!(lines.len() > 1 && lines.iter().all(|l| l.chars().count() <= WIDTH), "{text}");
            assert!(lines[0].starts_with(line), "{text}");
            assert_eq!(lines[1].len() - lines[1].trim_start().len(), hanging, "{text}");
            assert_eq!(text.split_whitespace().filter(|w| *w == "word").count(), 30);
        }
        // Tables, and what fits, are as they were.
        for same in
            [format!("{:>50}  {:>50}  1\n", 1, 2), "short\n".to_owned(), format!("{}\n", "x".repeat(100))]
        {
            assert_eq!(fitted(&same), same);
        }
        let painted = format!("\u{1b}[1m{}\u{1b}[0m\n", "x".repeat(WIDTH));
        assert_eq!(fitted(&painted), painted);
    }

    #[test]
    fn what_no_terminal_should_get_is_escaped_or_shortened() {
        assert_eq!(readable("file `a\u{1b}[31m\tb`: no"), "file `a\\u{1b}[31m\\tb`: no");
        assert_eq!(name("a\nb"), "a\\nb");
        let long = "k".repeat(1_000_000);
        let text = readable(&format!("no key `{long}` here"));
        assert!(text.len() < 150 && text.contains("..(1000002 characters).."), "{text}");
        let huge = format!("{:.1}", 2e300);
        assert_eq!(readable(&format!("is -{huge} kg")), "is -2e300 kg");
        assert_eq!(readable("is 153.751306834322 kg, line 12"), "is 153.751306834322 kg, line 12");
    }

    #[test]
    fn comments_of_long_lines_stand_above() {
        let long = "word ".repeat(30);
        let long = long.trim_end();
        let file = format!(
            "short = 1 # said\n[table]\ntext = \"a # \\\" # b\" # {long}\nliteral = '\\' # {long}\n# {long}\nlist = [\"{long}\"]\n"
        );
        let shown = with_fitting_comments(&file);
        let read = |text: &str| text.parse::<toml::Table>().unwrap();
        assert_eq!(read(&shown), read(&file));
        let (kept, fits): (Vec<&str>, Vec<&str>) = shown.lines().partition(|l| l.chars().count() > WIDTH);
        assert_eq!(kept, [format!("list = [\"{long}\"]")]);
        assert!(fits.contains(&"short = 1 # said") && fits.contains(&"text = \"a # \\\" # b\""), "{shown}");
        assert_eq!(shown.matches("word").count(), 120, "{shown}");
        let several = format!("text = \"\"\"\n{long} # {long}\n\"\"\"\n");
        assert_eq!(with_fitting_comments(&several), several);
    }

    #[test]
    fn the_key_that_was_set_is_named() {
        let set = ["isp_s=1e300".to_owned()];
        assert_eq!(with_set("`isp_s` is bad".into(), &set), "`isp_s` is bad");
        assert_eq!(with_set("`thrust_n` is bad".into(), &set), "`thrust_n` is bad (with --set isp_s=1e300)");
        assert_eq!(with_set("bad".into(), &[]), "bad");
    }
}
