//! Readable results on stdout.

use std::fmt::Write as _;
use std::io::{IsTerminal, Write as _};
use std::sync::OnceLock;

use apsides::pipeline::unit_ending::{name_of, unit_of};
use apsides::{Outcome, Price, SearchSummary};
use apsides_report::{Answer, answers, headline_beside_objective};
use apsides_verify::{Certificate, Check, Verdict};
use serde::Serialize;

use crate::exit::{Exit, Refusal, refusal};

use crate::sentence::{fitted, readable, wrapped};
use crate::speech::{bad, good, is_json, is_verbose, title, warned};

/// Numbers outside these have an exponent.
const SMALL: f64 = 1e-9;
const HUGE: f64 = 1e16;

/// The first failure of stdout, which is an output like any other.
static LOST: OnceLock<String> = OnceLock::new();

/// Prints text, its colours where they are wanted. A reader that went away is not an error of the solve; anything else that keeps text from
/// its place is one ([`lost`]).
pub(crate) fn print(text: &str) {
    let mut out = anstream::stdout().lock();
    if let Err(e) = out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        unprinted(&e);
    }
}

/// Prints words, their lines no longer than those of a terminal where there is one: what goes on to another program has a line for each.
pub(crate) fn print_words(text: &str) {
    if std::io::stdout().is_terminal() { print(&fitted(text)) } else { print(text) }
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

/// Prints one JSON object.
pub(crate) fn print_json(value: &impl Serialize) -> Result<(), Refusal> {
    print(&format!("{}\n", serde_json::to_string_pretty(value).map_err(refusal)?));
    Ok(())
}

/// A failure on stderr, in the program's name.
pub(crate) fn say(text: &str) {
    tell("error", &bad("apsides:"), text, None);
}

/// The failure that ends the program, with its status.
pub(crate) fn say_last(text: &str, exit: Exit) {
    tell("error", &bad("apsides:"), text, Some(exit));
}

/// A warning on stderr; nobody there to read it is not an error of what follows.
pub(crate) fn warn(text: &str) {
    tell("warning", &warned("warning:"), text, None);
}

/// A line on stderr: words, or an object with a member of this name.
fn tell(member: &str, head: &str, text: &str, exit: Option<Exit>) {
    let mut err = anstream::stderr().lock();
    if !is_json() {
        let line = format!("{head} {}\n", readable(text));
        let line = if std::io::stderr().is_terminal() { fitted(&line) } else { line };
        let _ = err.write_all(line.as_bytes());
        return;
    }
    let mut object = serde_json::Map::new();
    object.insert(member.into(), readable(text).into());
    if let Some(exit) = exit {
        object.insert("status".into(), (exit as u8).into());
    }
    let _ = writeln!(err, "{}", serde_json::Value::Object(object));
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

/// Least width of a column of numbers, and that of a count.
const NARROWEST: usize = 9;
const COUNT: usize = 4;

/// The width of a column whose name stands in words below each other.
fn width_of(name: &str) -> usize {
    let least = if matches!(name, "site" | "row" | "col") { COUNT } else { NARROWEST };
    name.split('_').map(|word| word.chars().count()).max().unwrap_or(0).max(least)
}

/// Names above columns of numbers, their words below each other so that many columns fit a terminal; `last` ends the last line.
pub(crate) fn heads(names: &[String], last: &str) -> String {
    let words: Vec<Vec<&str>> = names.iter().map(|name| name.split('_').collect()).collect();
    let lines = words.iter().map(Vec::len).max().unwrap_or(0);
    let mut text = String::new();
    for line in 0..lines {
        for (name, words) in names.iter().zip(&words) {
            // The last words stand in the last line.
            let word = (line + words.len()).checked_sub(lines).and_then(|k| words.get(k)).copied();
            let _ = write!(text, " {:>width$}", word.unwrap_or_default(), width = width_of(name));
        }
        text += if line + 1 == lines { last } else { "" };
        text.push('\n');
    }
    text
}

/// Cells below [`heads`].
pub(crate) fn columns(names: &[String], cells: &[String]) -> String {
    let cell = |(name, cell): (&String, &String)| format!(" {cell:>width$}", width = width_of(name));
    names.iter().zip(cells).map(cell).collect()
}

/// Files that were written, one a line.
pub(crate) fn written(files: &[std::path::PathBuf]) -> String {
    let lines = files.iter().map(|f| format!("  {}\n", f.display()));
    format!("\nwritten:\n{}", lines.collect::<String>())
}

/// The outcome as text.
pub(crate) fn outcome(o: &Outcome) -> String {
    let s = &o.summary;
    let status = if s.status == "optimal" { good(&s.status) } else { warned(&s.status) };
    let mut text = format!("mission {} by {}: {status}\n", s.mission, s.method);
    if s.solved_by != s.method {
        text += &format!("what follows is the solution by {}\n", s.solved_by);
    }
    if let Some(why) = &o.explanation {
        text += &format!("{why}\n");
    }
    for warning in &s.warnings {
        text += &format!("{} {warning}\n", warned("warning:"));
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
    let value = in_few_digits(s.objective.value);
    let objective = format!("{} = {value} {}", s.objective.name, s.objective.unit);
    text += &format!("\n{}\n", title(&objective));
    let width = s.results.keys().map(String::len).max().unwrap_or(0);
    for (key, value) in &s.results {
        let _ = writeln!(text, "  {key:<width$}  {value:>16.6}");
    }
    text.push('\n');
    if is_verbose() {
        text += &work(o);
    }
    let of =
        if s.solved_by == s.method { String::new() } else { format!(" of the solution by {}", s.solved_by) };
    text + &titled_certificate(&of, &s.certificate)
}

/// The work that a solve took.
fn work(o: &Outcome) -> String {
    let (c, t) = (&o.summary.counters, &o.summary.timing_ms);
    format!(
        "{} iterations, {} factorisations, {} mesh{}\n{} variables, {} constraints\n\
         build {:.1} ms, solve {:.1} ms, verify {:.1} ms\n\n",
        c.iterations,
        c.factorisations,
        c.mesh_iterations,
        if c.mesh_iterations == 1 { "" } else { "es" },
        c.variables,
        c.constraints,
        t.build,
        t.solve,
        t.verify
    )
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
        for key in headline_beside_objective(o) {
            if let Some(change) = p.results.get(key) {
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

/// The certificate: its verdict, one answer a line, and each check that failed; all checks with `--verbose`.
pub(crate) fn certificate(c: &Certificate) -> String {
    titled_certificate("", c)
}

fn titled_certificate(of: &str, c: &Certificate) -> String {
    let verdict = match c.verdict {
        Verdict::Rejected => bad(c.verdict.word()),
        Verdict::Feasible if !c.is_verified() => warned(c.verdict.word()),
        _ => good(c.verdict.word()),
    };
    let mut text = format!("{}{verdict}\n", title(&format!("certificate{of}: ")));
    text += &wrapped("  ", c.verdict.meaning());
    if let Some(claim) = &c.claim {
        text += &wrapped("  ", &format!("claim: {}", claim.words()));
    }
    for remark in &c.remarks {
        text += &wrapped("  ", remark);
    }
    text += &answered(&c.checks);
    if let Some(claim) = &c.claim {
        text += &wrapped("", &format!("claim: {}", claim.words()));
        text += &answered(&claim.checks);
    }
    text
}

/// One answer a line, and the checks that failed; all checks with `--verbose`.
fn answered(checks: &[Check]) -> String {
    let mut text = String::new();
    for answer in answers(checks) {
        text += &headed(answer.passed(), &answer.sentence());
        text += &details(&answer);
    }
    if !is_verbose() && !checks.is_empty() {
        let passed = checks.iter().filter(|c| c.passed).count();
        let _ = writeln!(text, "  {passed} of {} checks passed; each of them with --verbose", checks.len());
    }
    text
}

/// The checks behind an answer that are worth a line.
fn details(answer: &Answer<'_>) -> String {
    let mut text = String::new();
    for check in answer.checks.iter().filter(|check| is_verbose() || !check.passed) {
        let head = if check.passed { good("    ok    ") } else { bad("    FAIL  ") };
        text += &wrapped("          ", &check.name).replacen("          ", &head, 1);
        let numbers = format!("{} of {} {}", scientific(check.value), scientific(check.limit), check.unit);
        let place = if check.at.is_empty() { String::new() } else { format!("; {}", check.at) };
        text += &wrapped("          ", &format!("{numbers}{place}"));
        if let Some(meaning) = check.meaning().filter(|_| !check.passed) {
            text += &wrapped("          ", meaning);
        }
    }
    text
}

/// All digits of a number, with an exponent where it would have many zeros.
fn in_few_digits(value: f64) -> String {
    let has_zeros = value != 0.0 && !(SMALL..HUGE).contains(&value.abs());
    if has_zeros { format!("{value:e}") } else { format!("{value}") }
}

/// A sentence behind the word of its verdict.
fn headed(passed: bool, sentence: &str) -> String {
    let head = if passed { good("  ok    ") } else { bad("  FAIL  ") };
    wrapped("        ", sentence).replacen("        ", &head, 1)
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
    use super::{columns, heads, scientific, significant};

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
    fn heads_stand_above_their_columns() {
        let names = ["perilune_altitude_km".to_owned(), "flight_time_s".to_owned()];
        let cells = ["15".to_owned(), "997.376".to_owned()];
        let text = heads(&names, "  certificate") + &columns(&names, &cells);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines,
            [
                "  perilune    flight",
                "  altitude      time",
                "        km         s  certificate",
                "        15   997.376",
            ]
        );
    }

    #[test]
    fn exponents_have_a_sign_and_two_digits() {
        assert_eq!(scientific(0.0), "0.00e+00");
        assert_eq!(scientific(-1.234e-5), "-1.23e-05");
        assert_eq!(scientific(6.5e120), "6.50e+120");
        assert_eq!(scientific(f64::NAN), "NaN");
    }
}
