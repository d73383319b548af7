//! The certificate on a page: its verdict, one answer a line in plain words, all checks behind each on demand.

use std::fmt::Write as _;

use apsides_verify::{Certificate, Check};

use crate::answers::answers;
use crate::markup::escape;
use crate::number::readable;
use crate::units::pretty;

// Writing into a `String` cannot fail, hence the discarded results.

/// Writes the section of a certificate.
pub(crate) fn certificate(page: &mut String, certificate: &Certificate) {
    let failed = certificate.checks.iter().filter(|c| !c.passed).count();
    let _ = writeln!(
        page,
        "<h2>Certificate</h2>\n<p class=\"note\">Verdict: <strong>{}</strong>. {} {} of {} checks passed. Each line opens to its checks; \
         a check passes when its value does not exceed its limit.</p>",
        certificate.verdict,
        certificate.verdict.meaning(),
        certificate.checks.len() - failed,
        certificate.checks.len()
    );
    for remark in &certificate.remarks {
        let _ = writeln!(page, "<p class=\"note\">{}.</p>", escape(remark));
    }
    folded(page, &certificate.checks);
    if let Some(claim) = &certificate.claim {
        let _ = writeln!(page, "<h3>Claim: {}</h3>", escape(&claim.words()));
        folded(page, &claim.checks);
    }
}

/// One line for each answer, which opens to its checks; those that fail are open.
fn folded(page: &mut String, checks: &[Check]) {
    let answers = answers(checks);
    if answers.is_empty() {
        return;
    }
    page.push_str("<div class=\"card answers\">\n");
    for answer in &answers {
        let (class, word, open) =
            if answer.passed() { ("good", "passed", "") } else { ("bad", "failed", " open=\"\"") };
        let _ = writeln!(
            page,
            "<details{open}>\n<summary><span class=\"{class}\">{word}</span><span>{}</span></summary>",
            escape(&answer.sentence())
        );
        page.push_str(
            "<table>\n<thead><tr><th>Result</th><th>Check, and where it is largest</th><th class=\"number\">Value</th>\
             <th class=\"number\">Limit</th><th>Unit</th><th class=\"wide\">Used</th></tr></thead>\n<tbody>\n",
        );
        answer.checks.iter().for_each(|c| check(page, c));
        page.push_str("</tbody>\n</table>\n</details>\n");
    }
    page.push_str("</div>\n");
}

fn check(page: &mut String, check: &Check) {
    let used = 100.0 * check.value / check.limit;
    let used = if used.is_finite() {
        format!(
            "<span class=\"used\"><span class=\"bar\"><i{} style=\"width:{:.1}%\"></i></span>{}</span>",
            if check.passed { "" } else { " class=\"over\"" },
            used.clamp(0.0, 100.0),
            if used > 0.0 && used < 0.01 {
                "under 0.01 %".to_owned()
            } else {
                format!("{} %", readable(used, 3))
            },
        )
    } else {
        "-".to_owned()
    };
    let (class, word) = if check.passed { ("good", "passed") } else { ("bad", "failed") };
    let meaning = check.meaning().map(|m| format!("<small>{}</small>", escape(m)));
    let _ = writeln!(
        page,
        "<tr><td class=\"{class}\">{word}</td><td>{}<small>{}</small>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td>\
         <td>{}</td><td class=\"wide\">{used}</td></tr>",
        escape(&check.name),
        escape(&check.at),
        meaning.unwrap_or_default(),
        readable(check.value, 3),
        readable(check.limit, 3),
        escape(&pretty(&check.unit))
    );
}
