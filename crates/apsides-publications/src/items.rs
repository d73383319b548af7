//! Items of a publication, each with the command that shows it.

use std::fmt::Write as _;

use crate::{Error, PUBLICATIONS, Sheet, find};

/// An equation, table, figure or claim of a publication.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PaperItem {
    /// Number and subject.
    pub item: &'static str,
    /// The command that shows it.
    pub shown: Shown,
    /// The outcome, or the reason for which it cannot be computed.
    pub verdict: &'static str,
}

/// The place of the numbers of an item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// A table or sheet of the reproduction, by its short name.
    Sheet(&'static str),
    /// A sheet, and findings that are the verdict once they are there.
    Findings {
        /// Its short name.
        sheet: &'static str,
        /// The sheet of the findings, the same or another one.
        of: &'static str,
        /// The first words of the findings.
        start: &'static str,
    },
    /// A command of the program, without its name.
    Command(&'static str),
    /// It cannot be computed; the verdict says why.
    Nowhere,
}

/// An item that a sheet shows.
pub(super) const fn sheet(item: &'static str, id: &'static str, verdict: &'static str) -> PaperItem {
    PaperItem { item, shown: Shown::Sheet(id), verdict }
}

/// An item that a sheet shows and whose verdict is found with the numbers of a sheet, from findings that begin so; before that, the one given.
pub(super) const fn found(
    item: &'static str,
    sheet: &'static str,
    (of, start): (&'static str, &'static str),
    verdict: &'static str,
) -> PaperItem {
    PaperItem { item, shown: Shown::Findings { sheet, of, start }, verdict }
}

/// An item that a command shows.
pub(super) const fn command(item: &'static str, words: &'static str, verdict: &'static str) -> PaperItem {
    PaperItem { item, shown: Shown::Command(words), verdict }
}

/// An item that cannot be computed.
pub(super) const fn nowhere(item: &'static str, why: &'static str) -> PaperItem {
    PaperItem { item, shown: Shown::Nowhere, verdict: why }
}

impl PaperItem {
    /// The command in full; none where the item cannot be computed.
    #[must_use]
    pub fn command(&self, publication: &str) -> Option<String> {
        match self.shown {
            Shown::Sheet(id) | Shown::Findings { sheet: id, .. } => {
                Some(format!("apsides reproduce {publication} ({id})"))
            }
            Shown::Command(words) => Some(format!("apsides {words}")),
            Shown::Nowhere => None,
        }
    }

    /// The verdict by the sheets that are computed: findings where the item has some, else the one that is stated.
    #[must_use]
    pub fn verdict_by(&self, sheets: &[Sheet]) -> String {
        let stated = || self.verdict.to_owned();
        let Shown::Findings { of, start, .. } = self.shown else { return stated() };
        let findings = sheets.iter().filter(|s| s.id == of).flat_map(|s| &s.findings);
        let found: Vec<&str> =
            findings.filter_map(|f| Some(f.strip_prefix(start)?.trim_start_matches([':', ' ']))).collect();
        match found.split_last() {
            None => stated(),
            Some((last, others)) => {
                let others = others.iter().map(|finding| finding.trim_end_matches('.'));
                others.chain([*last]).collect::<Vec<_>>().join("; ")
            }
        }
    }
}

/// The items of a publication.
///
/// # Errors
/// [`Error::Value`] when there is no publication of this name.
pub fn items(name: &str) -> Result<&'static [PaperItem], Error> {
    Ok(find(name)?.items)
}

/// All items of all publications as a page in Markdown.
#[must_use]
pub fn items_markdown() -> String {
    let mut text = String::from(
        "# Published results, item by item\n\nWhat each publication states, the command that shows it, and the outcome. A name in brackets is that of a table \
         or sheet on the page that `apsides reproduce NAME --out DIR` writes. This page is the output of `apsides reproduce --items`.\n",
    );
    for publication in PUBLICATIONS {
        let _ = write!(
            text,
            "\n## {}\n\n{}.\n\n| item | command | verdict |\n| --- | --- | --- |\n",
            publication.title, publication.source
        );
        for item in publication.items {
            let command = item.command(publication.name).map_or_else(|| "-".into(), |c| format!("`{c}`"));
            let _ = writeln!(text, "| {} | {command} | {} |", item.item, item.verdict);
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_item_is_shown_or_says_why_not() {
        for publication in PUBLICATIONS {
            assert!(!publication.items.is_empty(), "{}", publication.name);
            for item in publication.items {
                assert!(!item.item.is_empty() && !item.verdict.is_empty(), "{item:?}");
                match item.shown {
                    Shown::Sheet(id) | Shown::Findings { sheet: id, .. } => {
                        if let Shown::Findings { of, .. } = item.shown {
                            assert!(
                                publication.sheets.contains(&of),
                                "{}: no sheet `{of}`",
                                publication.name
                            );
                        }
                        let known =
                            publication.sheets.contains(&id) || publication.tables.iter().any(|t| t.id == id);
                        assert!(known, "{}: no sheet `{id}`", publication.name);
                    }
                    Shown::Command(words) => {
                        let (verb, rest) = words.split_once(' ').unwrap_or((words, ""));
                        assert!(
                            [
                                "solve",
                                "montecarlo",
                                "sweep",
                                "tune",
                                "hazard",
                                "simulate",
                                "verify",
                                "convert",
                                "sensitivity"
                            ]
                            .contains(&verb),
                            "{words}"
                        );
                        let mission = rest.split(' ').next().unwrap_or("");
                        let known = verb == "hazard"
                            || apsides_missions::registry().files().any(|(name, _)| name == mission);
                        assert!(known, "{words}: no mission `{mission}`");
                    }
                    Shown::Nowhere => {}
                }
            }
        }
    }

    #[test]
    fn every_sheet_belongs_to_an_item() {
        for publication in PUBLICATIONS {
            let of = |i: &PaperItem, id: &str| match i.shown {
                Shown::Sheet(sheet) | Shown::Findings { sheet, .. } => sheet == id,
                _ => false,
            };
            let shown = |id: &str| publication.items.iter().any(|i| of(i, id));
            for id in publication.sheets {
                assert!(shown(id), "{}: no item has the sheet `{id}`", publication.name);
            }
        }
    }

    /// Findings take the place of the stated verdict, those of the item alone.
    #[test]
    fn verdicts_come_from_findings() {
        let item = found("Figs 2 and 3", "drawings", ("figures", "Figs 2, 3"), "reproduced");
        assert_eq!(item.verdict_by(&[]), "reproduced");
        let mut sheet = Sheet::new("figures", "cases", "case", &[]);
        sheet.findings = vec!["Figs 2, 3: beyond the criterion".into(), "Figs 20, 21: held".into()];
        assert_eq!(item.verdict_by(&[sheet.clone()]), "beyond the criterion");
        // Several stand in one sentence.
        sheet.findings = vec!["Figs 2, 3: held.".into(), "Figs 2, 3: damped.".into()];
        assert_eq!(item.verdict_by(&[sheet.clone()]), "held; damped.");
        sheet.id = "another";
        assert_eq!(item.verdict_by(&[sheet]), "reproduced");
    }
}
