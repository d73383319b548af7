//! Files with mistakes: each is refused with a sentence and its place, and none panics or hangs.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use apsides_problem_file::{ProblemError, ProblemFile};

/// Longest time of an answer.
const IN_TIME: Duration = Duration::from_secs(1);

/// A file with every part of the language.
const WHOLE: &str = r#"kind = "problem"
name = "whole"
title = "Every part of a file"

[constants]
mu = "398600.4418 km3/s2"
thrust = { value = 20, unit = "kN", min = 1, max = 100, meaning = "full thrust" }
isp = "320 s"
area = 3

[definitions]
exhaust_velocity = "isp*g0"
"drag(h, v)" = { value = "0.5*density(h)*v^2*area*1 [m2]", unit = "N" }
radius = "6378 [km] + h"

[tables.density]
x = [0, 20, 40, 80, 120]
x_unit = "km"
values = [1.225, 0.088, 0.004, 2e-5, 1e-8]
unit = "kg/m3"

[parameters]
payload = { unit = "kg", min = 10, max = 500, guess = 100 }

[phase.ascent]
time = { end = [50, 400], unit = "s" }
directions = ["pitch"]
kinks = { h = "11 km" }

[phase.ascent.states]
h = { unit = "km", min = 0, max = 200, start = 0 }
v = { unit = "km/s", min = 0, max = 9, start = "1 m/s", scale = 1 }
m = { unit = "kg", min = 500, max = 20_000, start = [1000, 12_000], guard = "min", tolerance = 0.1 }

[phase.ascent.controls]
throttle = [0, 1]
pitch = { unit = "deg", min = -90, max = 90 }

[phase.ascent.dynamics]
h = "v*sin(pitch)"
v = "(throttle*thrust - drag(h, v))/(m + payload) - mu/radius^2*sin(pitch)"
m = "-throttle*thrust/exhaust_velocity"

[phase.ascent.path]
pressure = "0.5*density(h)*v^2 <= 40 [kPa]"
load = { value = "throttle*thrust/m", max = "5 g0", scale = "1 g0" }

[phase.ascent.integrals]
loss = { value = "mu/radius^2*sin(pitch)", unit = "m/s", max = 4000 }

[phase.coast]
time = { end = [60, 2000], duration = [1, 1500] }

[phase.coast.states]
h = { unit = "km", min = 0, max = 500, end = [100, 300] }
v = { unit = "km/s", min = 0, max = 9 }

[phase.coast.dynamics]
h = "v"
v = "-mu/radius^2"

[links]
ascent = { to = "coast", jump = { v = "0 m/s" } }

[boundary]
enough = "ascent.end.m >= 600 [kg]"
high = { value = "coast.end.h + 0.5*coast.end.v^2*radius_of_earth^2/mu", min = "50 km" }

[objective]
maximize = "coast.end.h + 1e-3*ascent.end.m*1 [km/kg] - 0.1*ascent.loss*1 [s]"
unit = "km"
scale = 100

[guess.ascent]
time = [0, 100, 200]
h = [0, 30, 100]
v = "8 [m/s2]*time"
pitch = 45

[guess.coast]
h = 120
"#;

fn whole() -> String {
    WHOLE.replace(
        "radius = \"6378 [km] + h\"",
        "radius = \"radius_of_earth + h\"\nradius_of_earth = \"6378 [km]\"",
    )
}

fn pose(text: &str) -> Result<(), ProblemError> {
    let files = |_: &str| Err(std::io::ErrorKind::NotFound.into());
    let file = ProblemFile::parse(text, "p.toml", &files, &["method", "radau"])?;
    let values: Vec<f64> = file.statement().constants().iter().map(|c| c.value).collect();
    file.statement().pose(&values)?;
    Ok(())
}

/// Checks the sentence of a mistake and returns it.
fn sentence(text: &str, what: &str) -> Option<String> {
    let begin = Instant::now();
    let posed = pose(text);
    assert!(begin.elapsed() < IN_TIME, "{what}: {:?}", begin.elapsed());
    let error = posed.err()?;
    let sentence = error.to_string();
    assert!(sentence.starts_with("p.toml"), "{what}: {sentence}");
    assert!(sentence.len() < 5000, "{what}: {} bytes", sentence.len());
    let has_place =
        sentence.starts_with("p.toml, line ") && sentence.contains(", column ") && sentence.contains('^');
    let is_whole = matches!(error, ProblemError::Missing { .. });
    assert!(has_place || is_whole, "{what}: {sentence}");
    Some(sentence)
}

/// A sequence of numbers that looks random and is the same in each run (D. Knuth, The Art of Computer Programming 2, MMIX).
struct Sequence(u64);

impl Sequence {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % n.max(1)
    }
}

#[test]
fn the_file_itself_has_no_mistake() {
    assert_eq!(sentence(&whole(), "whole"), None);
}

/// A constant that follows from others is a definition of it.
#[test]
fn constants_may_follow_from_others() {
    let text = whole().replace("isp = \"320 s\"", "isp = \"2*half\"\nhalf = \"160 [s]\"");
    pose(&text).unwrap();
    let circular = whole().replace("isp = \"320 s\"", "isp = \"2*half\"\nhalf = \"isp/2\"");
    assert!(pose(&circular).unwrap_err().to_string().contains("isp"));
}

#[test]
fn hundreds_of_mistakes_each_have_a_sentence_and_a_place() {
    let whole = whole();
    let lines: Vec<&str> = whole.lines().collect();
    let mut refused = BTreeSet::new();
    let mut tried = 0;
    let mut attempt = |text: String, what: &str| {
        tried += 1;
        if let Some(sentence) = sentence(&text, what) {
            refused.insert((text, sentence));
        }
    };
    // Each line left away, doubled, cut in the middle.
    for k in 0..lines.len() {
        let with = |replaced: &str| {
            let mut lines = lines.clone();
            lines[k] = replaced;
            lines.join("\n")
        };
        attempt(with(""), &format!("without line {}", k + 1));
        attempt(with(&format!("{0}\n{0}", lines[k])), &format!("line {} doubled", k + 1));
        attempt(with(&lines[k][..lines[k].len() / 2]), &format!("line {} cut", k + 1));
        if let Some((key, value)) = lines[k].split_once(" = ") {
            for other in [
                "nan",
                "\"\"",
                "[]",
                "{}",
                "[1, 2, 3]",
                "true",
                "1979-05-27",
                "\"1 +\"",
                "\"3 m/kg s\"",
                "-inf",
            ] {
                attempt(with(&format!("{key} = {other}")), &format!("line {}: {other}", k + 1));
            }
            attempt(with(&format!("{key}x = {value}")), &format!("line {}: another key", k + 1));
        }
    }
    // Characters replaced, left away or put in, anywhere.
    let mut sequence = Sequence(23);
    let characters: Vec<char> = "+-*/^()[]{}<>=,.\"'#0159eamx_ \n\\\u{e9}".chars().collect();
    let text: Vec<char> = whole.chars().collect();
    for _ in 0..600 {
        let mut changed = text.clone();
        let at = sequence.below(changed.len());
        let other = characters[sequence.below(characters.len())];
        match sequence.below(3) {
            0 => changed[at] = other,
            1 => changed.insert(at, other),
            _ => drop(changed.remove(at)),
        }
        attempt(changed.into_iter().collect(), &format!("character {at}, {other:?}"));
    }
    assert!(refused.len() >= 500, "{} of {tried} are refused", refused.len());
}

#[test]
fn each_sort_of_mistake_says_what_to_do() {
    let cases = [
        (
            "h = \"v*sin(pitch)\"",
            "h = \"v*sin(ptch)\"",
            "line 41, column 12: no quantity is named `ptch`; the nearest is `pitch`",
        ),
        (
            "h = \"v*sin(pitch)\"",
            "h = \"v*sin(h)\"",
            "the argument of `sin` is a number or an angle, this is m",
        ),
        ("h = \"v*sin(pitch)\"", "h = \"m\"", "the rate of `h` has the unit m/s, this is kg"),
        ("h = \"v*sin(pitch)\"", "h = \"sin(pitch)\"", "state `check_units = false` at the top of the file"),
        ("h = \"v*sin(pitch)\"", "g = \"v*sin(pitch)\"", "the rate of `h` in phase `ascent`"),
        ("isp = \"320 s\"", "isp = \"320 secs\"", "no unit is named `secs`"),
        ("isp = \"320 s\"", "isp = \"320*2\"", "the rate of `m` has the unit kg/s, this is kg"),
        ("isp = \"320 s\"", "mu = \"320 s\"", "`mu` stands twice in this table"),
        ("isp = \"320 s\"", "sin = \"320 s\"", "`sin` has a meaning in formulas"),
        ("area = 3", "payload = 3", "`payload` is a constant already and cannot be a parameter, too"),
        ("value = 20, unit = \"kN\"", "value = 200, unit = \"kN\"", "allowed is a number from 1 to 100"),
        (
            "x = [0, 20, 40, 80, 120]",
            "x = [0, 20, 40, 30, 120]",
            "table `density`: the knots must be finite and increase",
        ),
        (
            "x = [0, 20, 40, 80, 120]",
            "x = [0, 20, nan, 80, 120]",
            "tables.density.x is nan, allowed is a number",
        ),
        (
            "x = [0, 20, 40, 80, 120]",
            "x = [0, 20, 40, 80]",
            "5 rows, allowed is one row for each of the 4 `x`",
        ),
        ("start = \"1 m/s\"", "start = \"1 m\"", "the start of state `v` has the unit m/s, this is m"),
        ("start = \"1 m/s\"", "start = 20", "outside its bounds"),
        ("min = 500, max = 20_000", "min = 50_000, max = 20_000", "the smaller one stands first"),
        ("throttle = [0, 1]", "throttle = [0, 1, 2]", "a list of 3, allowed is [least, most]"),
        ("<= 40 [kPa]", "<= 40 [km]", "takes quantities of one unit"),
        ("<= 40 [kPa]", "", "a formula without a comparison"),
        ("end = [50, 400]", "ends = [50, 400]", "has no key `ends`; the nearest is `end`"),
        ("[phase.coast.dynamics]", "[phase.coasts.dynamics]", "missing are"),
        ("to = \"coast\"", "to = \"cost\"", "no phase is named `cost`; the nearest is `coast`"),
        (
            "ascent.end.m >= 600 [kg]",
            "ascent.end.q >= 600 [kg]",
            "no quantity is named `ascent.end.q`; the nearest is `ascent.end.",
        ),
        (
            "ascent.end.m >= 600 [kg]",
            "ascent.end.throttle >= 0.5",
            "an integral, `integrals.NAME = \"a formula\"` of the phase, which the objective names",
        ),
        (
            "throttle = [0, 1]",
            "throttle = { min = 0, max = 1, end = 0 }",
            "control `throttle` has `end`, but a control may jump at any time and has no value at an end: limit its rate",
        ),
        (
            "throttle = [0, 1]",
            "throttle = { min = 0, max = 1, rate = 0.1 }",
            "phase.ascent.controls.throttle.rate is 0.1, allowed is a list in brackets",
        ),
        (
            "throttle = [0, 1]",
            "throttle = { min = 0, max = 1, rate = [\"-1 m/s\", 1] }",
            "control `throttle_rate` has the unit 1/s, this is m/s",
        ),
        ("ascent.end.m >= 600 [kg]", "end.m >= 600 [kg]", "there are several phases"),
        (
            "ascent.end.m >= 600 [kg]",
            "ascent.los >= 600 [m/s]",
            "no quantity is named `ascent.los`; the nearest is `ascent.loss`",
        ),
        (
            "ascent.end.m >= 600 [kg]",
            "coast.loss >= 600 [m/s]",
            "no quantity is named `coast.loss`; the nearest is `ascent.loss`",
        ),
        ("ascent.end.m >= 600 [kg]", "ascent.loss >= 600 [kg]", "these are m/s and kg"),
        ("maximize =", "minimise =", "has no key `minimise`; the nearest is `minimize`"),
        ("h = [0, 30, 100]", "q = [0, 30, 100]", "has no state and no control `q`"),
        ("time = [0, 100, 200]", "time = [0, 100, 50]", "two times that increase"),
        ("[guess.coast]", "[guess.cost]", "no phase is named `cost`"),
        ("directions = [\"pitch\"]", "directions = [\"yaw\"]", "has no control `yaw`"),
        ("kinks = { h = \"11 km\" }", "kinks = { z = \"11 km\" }", "has no state `z`"),
        ("radius = \"radius_of_earth + h\"", "radius = \"radius\"", "the definition `radius` needs itself"),
    ];
    let whole = whole();
    let mut wrong = Vec::new();
    for (part, changed, expected) in cases {
        assert!(whole.contains(part), "{part}");
        let text = whole.replacen(part, changed, 1);
        let sentence = sentence(&text, changed).unwrap_or_else(|| "accepted".into());
        if !sentence.contains(expected) {
            wrong.push(format!("{changed}: {sentence}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn what_is_missing_is_one_message() {
    let text =
        "kind = \"problem\"\n[phase.go]\nstates = { x = \"m\", v = \"m/s\" }\ndynamics = { x = \"v\" }\n";
    let message = pose(text).unwrap_err().to_string();
    let parts = [
        "missing are",
        "the end time of phase `go`",
        "the start of `x`",
        "the start of `v`",
        "the rate of `v`",
        "the objective",
    ];
    for part in parts {
        assert!(message.contains(part), "{part}: {message}");
    }
    assert_eq!(message.lines().count(), 6, "{message}");
}

#[test]
fn long_and_deep_formulas_are_posed_or_refused() {
    let long = format!("v{}", " + 0.001*v*sin(h/1 [m])".repeat(20_000));
    let with = |formula: &str| whole().replacen("v*sin(pitch)", formula, 1);
    assert!(pose(&with(&long)).is_ok());
    for deep in ["(", "-", "sin(", "2^", "if("] {
        let text = with(&deep.repeat(100_000));
        let sentence = sentence(&text, deep).unwrap();
        assert!(sentence.contains("line 41, column "), "{sentence}");
    }
    // A definition that uses another twice doubles with each, but is made once.
    let mut doubled = String::from("d0 = \"0.5\"\n");
    for k in 1..90 {
        doubled.push_str(&format!("d{k} = \"d{0}*d{0} - d{0}/{k}\"\n", k - 1));
    }
    assert_eq!(
        sentence(
            &whole().replacen("[definitions]\n", &format!("[definitions]\n{doubled}"), 1).replacen(
                "v*sin(pitch)",
                "v*sin(pitch)*d89",
                1
            ),
            "doubled"
        ),
        None
    );
    let nested = "[".repeat(100_000);
    assert!(sentence(&format!("kind = \"problem\"\nlinks = {nested}"), "lists in lists").is_some());
}
