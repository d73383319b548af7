//! Generated documents: `docs/gallery.md` from the example `gallery_table` of the workspace tests.

use crate::command::{cargo, output};
use crate::workspace::Workspace;

const PACKAGE: &str = "apsides-tests";
const EXAMPLE: &str = "gallery_table";
const DOCUMENT: &str = "docs/gallery.md";

/// Headings of columns that hold measured times, which differ from run to run.
const TIMES: &[&str] = &["time", "wall time", "cpu time", "solve time", "run time", "ms"];

/// Decimal numbers agree when they differ by less than this, relative to the larger, or are both smaller: the last
/// digits depend on the vector instructions of the processor. Whole numbers agree when they are equal.
const ROUNDING: f64 = 1e-6;

/// Writes the document.
pub(crate) fn write(workspace: &Workspace) -> Result<(), String> {
    let text = generate(workspace)?;
    let path = workspace.root.join(DOCUMENT);
    let folder = path.parent().unwrap_or(&workspace.root);
    std::fs::create_dir_all(folder)
        .and_then(|()| std::fs::write(&path, text))
        .map_err(|e| format!("{DOCUMENT}: {e}"))?;
    println!("wrote {DOCUMENT}");
    Ok(())
}

/// Fails when the document differs from what would be written, measured times and rounding aside.
pub(crate) fn check(workspace: &Workspace) -> Result<(), String> {
    require_example(workspace)?;
    let path = workspace.root.join(DOCUMENT);
    let present = std::fs::read_to_string(&path)
        .map_err(|e| format!("{DOCUMENT}: {e}; `cargo xtask table` writes it"))?;
    match difference(&present, &generate(workspace)?) {
        None => Ok(()),
        Some(lines) => Err(format!("{DOCUMENT} is out of date; `cargo xtask table` writes it\n{lines}")),
    }
}

fn require_example(workspace: &Workspace) -> Result<(), String> {
    if workspace.package(PACKAGE)?.examples.iter().any(|e| e == EXAMPLE) {
        return Ok(());
    }
    Err(format!("{DOCUMENT} cannot be made: {PACKAGE} has no example `{EXAMPLE}`"))
}

fn generate(workspace: &Workspace) -> Result<String, String> {
    require_example(workspace)?;
    let mut example =
        cargo(&workspace.root, ["run", "--quiet", "--release", "-p", PACKAGE, "--example", EXAMPLE]);
    let text = output(&mut example)?;
    if text.trim().is_empty() { Err(format!("the example `{EXAMPLE}` printed nothing")) } else { Ok(text) }
}

/// The first line that differs, old and new.
fn difference(old: &str, new: &str) -> Option<String> {
    let (old, new) = (cells(old), cells(new));
    let longest = old.len().max(new.len());
    (0..longest)
        .find(|k| match (old.get(*k), new.get(*k)) {
            (Some(a), Some(b)) => a.len() != b.len() || a.iter().zip(b).any(|(a, b)| !agree(a, b)),
            _ => true,
        })
        .map(|k| {
            let line = |lines: &[Vec<String>]| lines.get(k).map_or("(end)".into(), |l| l.join(" | "));
            format!("line {}\n- {}\n+ {}", k + 1, line(&old), line(&new))
        })
}

/// Returns true if two cells agree.
fn agree(a: &str, b: &str) -> bool {
    let decimal = |s: &str| s.contains(['.', 'e']).then(|| s.parse::<f64>().ok()).flatten();
    match (decimal(a), decimal(b)) {
        (Some(x), Some(y)) => {
            let size = x.abs().max(y.abs());
            a == b || size < ROUNDING || (x - y).abs() < ROUNDING * size
        }
        _ => a == b,
    }
}

/// The cells of each line without padding, those of time columns masked; a line outside tables is one cell.
fn cells(text: &str) -> Vec<Vec<String>> {
    let mut times: Option<Vec<bool>> = None; // of the table that the line is in
    text.lines()
        .map(|line| {
            let Some(inner) = line.trim().strip_prefix('|') else {
                times = None;
                return vec![line.trim_end().to_owned()];
            };
            let cells: Vec<&str> = inner.trim_end_matches('|').split('|').map(str::trim).collect();
            let masked = times.get_or_insert_with(|| cells.iter().map(|c| is_time(c)).collect());
            let shown = cells.iter().enumerate().map(|(k, cell)| match cell {
                _ if cell.contains("--") && cell.chars().all(|c| matches!(c, '-' | ':')) => "-",
                _ if masked.get(k) == Some(&true) && !is_time(cell) => "(time)",
                _ => cell,
            });
            shown.map(str::to_owned).collect()
        })
        .collect()
}

/// Returns true if a heading names a measured time: `time`, `CPU time [ms]`, `solve time, s`.
fn is_time(heading: &str) -> bool {
    let plain = heading.trim_matches('*').to_lowercase();
    let name = plain.split(['[', '(', ',', '/']).next().unwrap_or_default().trim();
    TIMES.contains(&name)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: &str = "\
# Gallery

| problem | objective | time [ms] |
| --- | ---: | ---: |
| landing | 1005.4 | 20.8 |

End.
";

    #[test]
    fn times_and_padding_do_not_matter() {
        let other = TABLE
            .replace("20.8", "9131.25")
            .replace("| landing |", "| landing    |")
            .replace("---:", "-----:");
        assert_eq!(difference(TABLE, &other), None);
    }

    #[test]
    fn values_and_lines_matter() {
        let other = TABLE.replace("1005.4", "1005.5");
        let lines = difference(TABLE, &other).unwrap();
        assert!(lines.starts_with("line 5\n- landing | 1005.4 |"), "{lines}");
        assert!(difference(TABLE, &TABLE.replace("End.", "The end.")).unwrap().contains("+ The end."));
        assert!(difference(TABLE, &format!("{TABLE}more\n")).unwrap().contains("- (end)"));
    }

    #[test]
    fn rounding_does_not_matter() {
        assert!(agree("1005.4091", "1005.4090"));
        assert!(agree("-3.1e-13", "2.2e-12"));
        assert!(!agree("1005.41", "1005.42"));
        assert!(!agree("1.0e-4", "2.0e-13"));
        assert!(!agree("12", "13"));
        assert!(!agree("NaN", "1.0") && agree("NaN", "NaN"));
    }

    #[test]
    fn each_table_has_its_own_columns() {
        let text = "| time |\n| --- |\n| 1 |\n\n| flight time [s] |\n| --- |\n| 1 |\n";
        assert!(difference(text, &text.replace("| 1 |", "| 2 |")).unwrap().starts_with("line 7"));
    }

    #[test]
    fn headings_of_times() {
        for heading in ["time", "Time [ms]", "**CPU time**", "solve time, ms", "wall time", "ms"] {
            assert!(is_time(heading), "{heading}");
        }
        for heading in ["flight time [s]", "timeline", "final time"] {
            assert!(!is_time(heading), "{heading}");
        }
    }
}
