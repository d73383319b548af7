//! Readable results on stdout.

use std::fmt::Write as _;
use std::io::Write as _;
use std::sync::OnceLock;

use apsides::pipeline::key::{name_of, unit_of};
use apsides::{Outcome, Price, SearchSummary};
use apsides_verify::{Certificate, Check};

use crate::sentence::readable;

/// The first failure of stdout, which is an output like any other.
static LOST: OnceLock<String> = OnceLock::new();

/// Prints text. A reader that went away is not an error of the solve; anything else that keeps text from its place is one ([`lost`]).
pub(crate) fn print(text: &str) {
    let mut out = std::io::stdout().lock();
    if let Err(e) = out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        unprinted(&e);
    }
}

/// Takes note of a failure of stdout.
pub(crate) fn unprinted(e: &std::io::Error) {
    if e.kind() != std::io::ErrorKind::BrokenPipe {
        let _ = LOST.set(e.to_string());
    }
}

/// Says what kept text from stdout.
pub(crate) fn lost() -> Option<&'static str> {
    LOST.get().map(String::as_str)
}

/// A failure on stderr, in the program's name.
pub(crate) fn say(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "apsides: {}", readable(text));
}

/// A warning on stderr; nobody there to read it is not an error of what follows.
pub(crate) fn warn(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "warning: {}", readable(text));
}

/// Four decimals, or an exponent where these say little.
pub(crate) fn number(v: f64) -> String {
    if v == 0.0 || (1e-2..1e6).contains(&v.abs()) { format!("{v:.4}") } else { format!("{v:.4e}") }
}

/// Names with their titles, one a line.
pub(crate) fn titles<'a>(list: impl Iterator<Item = (&'a str, &'a str)>) -> String {
    let list: Vec<_> = list.collect();
    let width = list.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    list.iter().map(|(name, title)| format!("{name:<width$}  {title}\n")).collect()
}

/// Files that were written, one a line.
pub(crate) fn written(files: &[std::path::PathBuf]) -> String {
    let lines = files.iter().map(|f| format!("  {}\n", f.display()));
    format!("\nwritten:\n{}", lines.collect::<String>())
}

/// The outcome as text.
pub(crate) fn outcome(o: &Outcome) -> String {
    let s = &o.summary;
    let mut text = format!("mission {} by {}: {}\n", s.mission, s.method, s.status);
    if s.solved_by != s.method {
        text += &format!("what follows is the solution by {}\n", s.solved_by);
    }
    if let Some(why) = &o.explanation {
        text += &format!("{why}\n");
    }
    for warning in &s.warnings {
        text += &format!("warning: {warning}\n");
    }
    if let Some(search) = &s.search {
        text += &searched(search, &s.objective.unit);
    }
    for site in &s.sites {
        text += &format!("{site}\n");
    }
    for switch in &s.switches {
        text += &format!("switch: {switch}\n");
    }
    text += &format!("\n{} = {} {}\n", s.objective.name, s.objective.value, s.objective.unit);
    let width = s.results.keys().map(String::len).max().unwrap_or(0);
    for (key, value) in &s.results {
        let _ = writeln!(text, "  {key:<width$}  {value:>16.6}");
    }
    let c = &s.counters;
    let _ = writeln!(
        text,
        "\n{} iterations, {} factorisations, {} mesh{}, {} variables, {} constraints; \
         build {:.1} ms, solve {:.1} ms, verify {:.1} ms\n",
        c.iterations,
        c.factorisations,
        c.mesh_iterations,
        if c.mesh_iterations == 1 { "" } else { "es" },
        c.variables,
        c.constraints,
        s.timing_ms.build,
        s.timing_ms.solve,
        s.timing_ms.verify
    );
    let of =
        if s.solved_by == s.method { String::new() } else { format!(" of the solution by {}", s.solved_by) };
    text + &titled_certificate(&of, &s.certificate)
}

/// One sentence on the search that a solve began with.
fn searched(s: &SearchSummary, unit: &str) -> String {
    let start = match (s.objective, s.miss_km) {
        (Some(objective), Some(miss)) => format!("start {objective:.6} {unit}, {miss:.3} km off"),
        _ => "every flight failed".into(),
    };
    let remark = s.remark.as_ref().map_or(String::new(), |r| format!("; {r}"));
    format!(
        "search by {} over {} variables: {start}; {} flights in {} generations, {:.1} ms, {}{remark}\n",
        s.algorithm, s.variables, s.evaluations, s.generations, s.time_ms, s.stop
    )
}

/// The reason that a key has no price.
const NOT_UNIQUE: &str = "requirements that depend on each other are active, and the key moves some of them; more and less of it differ, \
                          or one of the two is not feasible";

/// Change of the objective for one more unit of each key; empty if it was not asked for.
pub(crate) fn prices(o: &Outcome) -> String {
    let Some(prices) = &o.summary.sensitivity else { return String::new() };
    let objective = &o.summary.objective;
    let mut text = String::from("\nsensitivity: one more unit of a key changes\n");
    let head = |p: &Price| {
        if p.unit.is_empty() { format!("+1 {}", p.key) } else { format!("+1 {} of {}", p.unit, p.key) }
    };
    let width = prices.iter().map(|p| head(p).len() + 1).max().unwrap_or(0);
    for p in prices {
        let Some(change) = p.objective.map(significant) else {
            let _ = writeln!(text, "  {:<width$} not unique: {NOT_UNIQUE}", head(p) + ":");
            continue;
        };
        let _ = write!(text, "  {:<width$} {change} {} {}", head(p) + ":", objective.unit, objective.name);
        for key in &o.headline {
            // The objective is often among them.
            if name_of(key) != objective.name
                && let Some(change) = p.results.get(key)
            {
                let _ = write!(text, ", {} {} {}", significant(*change), unit_of(key), name_of(key));
            }
        }
        text.push('\n');
    }
    text
}

/// A change with its sign and four significant digits.
pub(crate) fn significant(v: f64) -> String {
    match v.abs() {
        size if size >= 1e6 || (size < 1e-4 && size > 0.0) => format!("{v:+.3e}"),
        size if size > 0.0 => {
            let decimals = (3.0 - size.log10().floor()).clamp(0.0, 8.0) as usize;
            format!("{v:+.decimals$}")
        }
        _ => format!("{v:+}"),
    }
}

/// The certificate as a table.
pub(crate) fn certificate(c: &Certificate) -> String {
    titled_certificate("", c)
}

fn titled_certificate(of: &str, c: &Certificate) -> String {
    let mut text = format!("certificate{of}: {}\n  {}\n", c.verdict, c.verdict.meaning());
    if let Some(claim) = &c.claim {
        let _ = writeln!(text, "  claim: {}", claim.words());
    }
    for remark in &c.remarks {
        let _ = writeln!(text, "  {remark}");
    }
    text += &table_of(&c.checks);
    if let Some(claim) = &c.claim {
        let _ = writeln!(text, "claim: {}\n{}", claim.words(), table_of(&claim.checks).trim_end());
    }
    let failed: Vec<_> = c.failures().filter_map(|c| Some((&c.name, c.meaning()?))).collect();
    if !failed.is_empty() {
        text += "what failed:\n";
    }
    for (name, meaning) in failed {
        let _ = writeln!(text, "  {name}: {meaning}");
    }
    text
}

/// Checks, one a line.
fn table_of(checks: &[Check]) -> String {
    let mut text = String::new();
    let width = checks.iter().map(|c| c.name.chars().count()).max().unwrap_or(0);
    let _ =
        writeln!(text, "  {:<width$}  {:>9}  {:>9}  {:<5}       where", "check", "value", "limit", "unit");
    for c in checks {
        let verdict = if c.passed { "ok  " } else { "FAIL" };
        let _ = writeln!(
            text,
            "  {:<width$}  {:>9}  {:>9}  {:<5} {verdict}  {}",
            c.name,
            scientific(c.value),
            scientific(c.limit),
            c.unit,
            c.at
        );
    }
    text
}

/// Three significant digits with a two-digit exponent, so that columns line up.
pub(crate) fn scientific(v: f64) -> String {
    let text = format!("{v:.2e}");
    match text.split_once('e') {
        Some((digits, exponent)) => {
            let (sign, size) = exponent.strip_prefix('-').map_or(('+', exponent), |size| ('-', size));
            format!("{digits}e{sign}{size:0>2}")
        }
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::{scientific, significant};

    #[test]
    fn changes_have_four_digits() {
        let cases = [
            (-2.844_72, "-2.845"),
            (0.005_912_34, "+0.005912"),
            (42.4834, "+42.48"),
            (123_456.0, "+123456"),
            (2.976_1e-9, "+2.976e-9"),
            (0.0, "+0"),
        ];
        for (v, text) in cases {
            assert_eq!(significant(v), text);
        }
        assert_eq!(significant(f64::NAN), "NaN");
    }

    #[test]
    fn exponents_have_a_sign_and_two_digits() {
        assert_eq!(scientific(0.0), "0.00e+00");
        assert_eq!(scientific(-1.234e-5), "-1.23e-05");
        assert_eq!(scientific(6.5e120), "6.50e+120");
        assert_eq!(scientific(f64::NAN), "NaN");
    }
}
