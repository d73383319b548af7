//! The page of a Monte Carlo run.

use std::fmt::Write as _;

use apsides_pipeline::montecarlo::{Extreme, Spread, Statistics};
use apsides_pipeline::shard::Shard;
use apsides_pipeline::unit_ending::in_words;

use crate::Figure;
use crate::html;
use crate::markup::escape;
use crate::number::readable;
use crate::units::pretty;

/// Significant digits of a number.
const DIGITS: usize = 4;

/// A spread below this part of the mean is rounding.
const ROUNDING: f64 = 1e-13;

/// Numbers of a result and their classes: a narrow page has those that say most.
const COLUMNS: [(&str, &str); 8] = [
    ("Mean", "number"),
    ("Sigma", "number"),
    ("Linear sigma", "number wide"),
    ("Least", "number"),
    ("1 %", "number wide"),
    ("50 %", "number"),
    ("99 %", "number wide"),
    ("Greatest", "number"),
];

// Writing into a `String` cannot fail, hence the discarded results.

/// The page: counts, the spread of each result, the figure.
pub(crate) fn page(shard: &Shard, statement: &str, s: &Statistics, figure: &Figure) -> String {
    let mut page = html::begin(&shard.mission);
    let range = match shard.count == shard.total {
        true => String::new(),
        false => {
            format!(", indices {} to {} of {}", shard.first, shard.indices().end.max(1) - 1, shard.total)
        }
    };
    let _ = writeln!(
        page,
        "<p class=\"lead\">Monte Carlo, seed {}{range}: {}.</p>",
        shard.seed,
        shard.state.words()
    );
    let percent = |part: f64| format!("{} %", readable(100.0 * part, DIGITS));
    let interval = |[low, high]: [f64; 2]| format!("{} to {}", percent(low), percent(high));
    let mut facts = vec![
        ("flights", s.samples.to_string()),
        ("without a result", s.failed.to_string()),
        ("ended, with 95 % confidence", interval(s.success.interval)),
    ];
    if let (Some(part), Some(within)) = (s.within_1_m, s.within_1_m_interval) {
        facts.push(("within 1 m of the planned end", percent(part)));
        facts.push(("that, with 95 % confidence", interval(within)));
    }
    page.push_str("<dl class=\"facts\">\n");
    for (name, value) in facts {
        let _ = writeln!(page, "<div><dt>{name}</dt><dd>{value}</dd></div>");
    }
    page.push_str("</dl>\n");
    for fault in &s.faults {
        let _ = writeln!(page, "<p class=\"explanation\">{}</p>", escape(&fault.to_string()));
    }
    table(&mut page, &s.spreads);
    html::section(&mut page, "Samples", None, std::slice::from_ref(figure));
    html::end(
        &mut page,
        statement,
        "The samples are in montecarlo.csv, the numbers with the covariance in montecarlo.json.",
    );
    page
}

fn table(page: &mut String, spreads: &[Spread]) {
    page.push_str(
        "<h2>Results</h2>\n<p class=\"note\">Of the flights that ended; the least and the greatest with the index of their sample.</p>\n\
         <div class=\"card\"><table>\n<thead><tr><th>Quantity</th><th>Unit</th>",
    );
    for (head, class) in COLUMNS {
        let _ = write!(page, "<th class=\"{class}\">{head}</th>");
    }
    page.push_str("</tr></thead>\n<tbody>\n");
    let extreme = |e: &Extreme| match e.sample {
        Some(sample) => format!("{}<small>of {sample}</small>", readable(e.value, DIGITS)),
        None => "-".into(),
    };
    for s in spreads {
        let (name, unit) = in_words(&s.name);
        let _ = write!(page, "<tr><td>{}</td><td>{}</td>", escape(&name), escape(&pretty(&unit)));
        let linear = s.linear_sigma.map_or_else(|| "-".into(), |v| readable(v, DIGITS));
        let [low, middle, high] = s.percentiles.map(|v| readable(v, DIGITS));
        // Flights that all have one value differ by the rounding of sums.
        let sigma = if s.sigma < ROUNDING * s.mean.abs() { 0.0 } else { s.sigma };
        let (mean, sigma) = (readable(s.mean, DIGITS), readable(sigma, DIGITS));
        let values = [mean, sigma, linear, extreme(&s.least), low, middle, high, extreme(&s.greatest)];
        for (value, (_, class)) in values.into_iter().zip(COLUMNS) {
            let _ = write!(page, "<td class=\"{class}\">{value}</td>");
        }
        page.push_str("</tr>\n");
    }
    page.push_str("</tbody>\n</table></div>\n");
}
