//! Pages of tables, sentences and figures: one file with style and figures inside.

use std::fmt::Write as _;

use crate::figure::Figure;
use crate::html;
use crate::map_picture::MapPicture;
use crate::markup::escape;

/// A page that grows from the top down.
///
/// ```
/// use apsides_report::Page;
///
/// let mut page = Page::new("A table");
/// page.heading("Times");
/// page.table(&["case", "time (s)"], &[vec!["a".into(), "72.2".into()]]);
/// page.list(["72 s are printed"]);
/// assert!(page.finish().contains("<td class=\"number\">72.2</td>"));
/// ```
#[derive(Clone, Debug)]
pub struct Page {
    text: String,
}

impl Page {
    /// A page with a title.
    #[must_use]
    pub fn new(title: &str) -> Self {
        Self { text: html::begin(title) }
    }

    /// A sentence below the title.
    pub fn lead(&mut self, sentence: &str) {
        let _ = writeln!(self.text, "<p class=\"lead\">{}</p>", escape(sentence));
    }

    /// A sentence that a reader has to know before trusting the page.
    pub fn warning(&mut self, sentence: &str) {
        let _ = writeln!(self.text, "<p class=\"explanation\">Warning: {}</p>", escape(sentence));
    }

    /// A heading of a section.
    pub fn heading(&mut self, title: &str) {
        let _ = writeln!(self.text, "<h2>{}</h2>", escape(title));
    }

    /// A note in small letters.
    pub fn note(&mut self, sentence: &str) {
        let _ = writeln!(self.text, "<p class=\"note\">{}</p>", escape(sentence));
    }

    /// Key figures: names with values.
    pub fn facts(&mut self, facts: &[(&str, String)]) {
        let facts: Vec<(String, &str, String)> =
            facts.iter().map(|(name, value)| (escape(name), "", escape(value))).collect();
        html::facts(&mut self.text, &facts);
    }

    /// A picture of a map in its frame, with its title.
    pub fn map(&mut self, title: &str, picture: MapPicture<'_>) {
        html::map(&mut self.text, title, picture);
    }

    /// A table under its heads. Columns of numbers stand to the right, those with a word to the left. Cells beyond the heads are left out.
    pub fn table(&mut self, heads: &[&str], rows: &[Vec<String>]) {
        let class = if heads.len() > DENSE { " class=\"dense\"" } else { "" };
        let _ = write!(self.text, "<div class=\"card\"><table{class}>\n<thead><tr>");
        let classes: Vec<&str> = (0..heads.len())
            .map(|k| {
                let cells = || rows.iter().filter_map(|row| row.get(k)).filter(|cell| *cell != MISSING);
                let is_numeric = cells().next().is_some() && cells().all(|cell| is_number(cell));
                if is_numeric { " class=\"number\"" } else { "" }
            })
            .collect();
        for (head, class) in heads.iter().zip(&classes) {
            // Names of keys and results are broken where a word of theirs ends.
            let head = escape(head).replace('_', "_<wbr>");
            let _ = write!(self.text, "<th{class}>{head}</th>");
        }
        self.text.push_str("</tr></thead>\n<tbody>\n");
        for row in rows {
            self.text.push_str("<tr>");
            for (cell, class) in row.iter().zip(&classes) {
                let _ = write!(self.text, "<td{class}>{}</td>", escape(cell));
            }
            self.text.push_str("</tr>\n");
        }
        self.text.push_str("</tbody>\n</table></div>\n");
    }

    /// A list of sentences; nothing without any.
    pub fn list<T: AsRef<str>>(&mut self, sentences: impl IntoIterator<Item = T>) {
        let mut any = false;
        for sentence in sentences {
            self.text.push_str(if any { "" } else { "<ul>\n" });
            any = true;
            let _ = writeln!(self.text, "<li>{}</li>", escape(sentence.as_ref()));
        }
        self.text.push_str(if any { "</ul>\n" } else { "" });
    }

    /// A list of links: the file beside the page, and what is said of it.
    pub fn links(&mut self, links: &[(&str, String)]) {
        self.text.push_str("<ul>\n");
        for (file, text) in links {
            let file = escape(file);
            let _ =
                writeln!(self.text, "<li><a href=\"{file}\">{file}</a>: <code>{}</code></li>", escape(text));
        }
        self.text.push_str("</ul>\n");
    }

    /// Figures with their legends.
    pub fn figures(&mut self, figures: &[Figure]) {
        html::figures(&mut self.text, figures);
    }

    /// The whole page.
    #[must_use]
    pub fn finish(mut self) -> String {
        let _ = write!(
            self.text,
            "<footer>Written by apsides {}.</footer>\n</main>\n</body>\n</html>\n",
            env!("CARGO_PKG_VERSION")
        );
        self.text
    }
}

/// Columns from which a table has small letters.
const DENSE: usize = 9;

/// Stands for what is missing.
const MISSING: &str = "-";

/// True of a number with or without a sign.
fn is_number(cell: &str) -> bool {
    cell.replace('\u{2212}', "-").parse::<f64>().is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::{Axis, Series};

    #[test]
    fn what_is_written_stands_for_itself() {
        let mut page = Page::new("a < b");
        page.lead("\"so\"");
        let rows = [["<b>", "-1.5", "-", "-"], ["3", "-", "1 to 2", "-"]];
        page.table(&["x & y", "z", "u", "v"], &rows.map(|row| row.map(String::from).to_vec()));
        page.list(Vec::<String>::new());
        page.links(&[("a.toml", "apsides solve a".into())]);
        let curve = Figure::new("curve", Axis::new("x", "m"), Axis::new("y", "m"));
        page.figures(&[curve.with(Series::line("one", vec![[0.0, 1.0], [1.0, 2.0]]))]);
        let text = page.finish();
        for part in [
            "<h1>a &lt; b</h1>",
            "&quot;so&quot;",
            "<th>x &amp; y</th>",
            "<td>&lt;b&gt;</td><td class=\"number\">-1.5</td><td>-</td><td>-</td>",
            "<td>3</td><td class=\"number\">-</td><td>1 to 2</td><td>-</td>",
            "<a href=\"a.toml\">a.toml</a>: <code>apsides solve a</code>",
            "<figcaption>curve</figcaption>",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert!(text.ends_with("</html>\n") && text.matches("<ul>").count() == 1, "{text}");
    }
}
