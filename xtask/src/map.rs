//! The map of ARCHITECTURE.md against the table of layers: a row for each crate, and the arrows as they are.

use std::collections::{BTreeMap, BTreeSet};

use crate::finding::Finding;

/// The text that holds the map.
pub(crate) const FILE: &str = "ARCHITECTURE.md";

/// Words of the map for a crate that depends on none of ours, and for one that may depend on any.
const NONE: &str = "(nothing of ours)";
const ANY: &str = "any";

/// Differences between the map and the arrows of crates, names without the prefix `apsides-`; none as arrows means any.
pub(crate) fn check(text: &str, arrows: &[(&str, Option<&[&str]>)]) -> Vec<Finding> {
    let mut drawn = BTreeMap::<&str, &str>::new();
    for line in text.lines() {
        let Some((names, targets)) = line.split_once(" -> ") else { continue };
        for name in names.split(',').map(str::trim) {
            drawn.insert(name, targets.trim());
        }
    }
    let mut findings = Vec::new();
    for (name, targets) in arrows {
        let row = match *name {
            "apsides" => "`apsides`".to_owned(),
            name => format!("`apsides-{name}`"),
        };
        if !text.lines().any(|l| l.starts_with('|') && l.contains(&row)) {
            findings.push(Finding::of(FILE, format!("the map has no row of {row}")));
        }
        let wanted = match targets {
            None => ANY.to_owned(),
            Some([]) => NONE.to_owned(),
            Some(targets) => {
                targets.iter().copied().collect::<BTreeSet<_>>().into_iter().collect::<Vec<_>>().join(", ")
            }
        };
        match drawn.get(name) {
            Some(found) if **found == wanted => {}
            found => findings.push(Finding::of(
                FILE,
                format!(
                    "the arrows of `{name}` are \"{}\", and should be \"{wanted}\"",
                    found.unwrap_or(&"missing")
                ),
            )),
        }
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_and_arrows_are_compared() {
        let arrows: &[(&str, Option<&[&str]>)] =
            &[("ad", Some(&[])), ("ocp", Some(&["basis", "ad"])), ("cli", None)];
        let text = "| 0 | `apsides-ad` |\n| 1 | `apsides-ocp` |\n| 2 | `apsides-cli` |\nad -> (nothing of ours)\nocp  -> ad, basis\ncli -> any\n";
        assert!(check(text, arrows).is_empty());
        let stale = text.replace("ad, basis", "ad").replace("`apsides-cli`", "the program");
        let messages: Vec<String> = check(&stale, arrows).into_iter().map(|f| f.message).collect();
        assert_eq!(
            messages,
            [
                "the arrows of `ocp` are \"ad\", and should be \"ad, basis\"",
                "the map has no row of `apsides-cli`"
            ]
        );
    }
}
