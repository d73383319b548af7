//! Import circles between modules of a crate: siblings, their own modules included, that lead to each other by `use`
//! or by paths from `crate`, `self` and `super`. A module and the one that declares it may know each other.

use std::collections::{BTreeMap, BTreeSet};

use crate::finding::Finding;
use crate::source::{code, is_test_file, is_word, lines_before_tests};

/// Crates whose circles are not dissolved yet, without the prefix `apsides-`. A crate leaves the list and never joins
/// it again.
const PENDING: &[&str] = &[];

/// Circles that stay, with the reason: crate, module that declares them ("" for the root), modules.
const ALLOWED: &[(&str, &str, &[&str])] = &[];

/// A module by the names that lead to it; the root is empty.
type Place = Vec<String>;

/// Imports and paths of a module.
#[derive(Debug, Default)]
struct Module {
    /// Paths that begin with `crate`, `self` or `super`.
    references: Vec<Vec<String>>,
    /// Every `use`, by the name it gives.
    imports: Vec<(String, Vec<String>)>,
}

/// The modules of a crate from their files.
#[derive(Debug, Default)]
struct Modules(BTreeMap<Place, Module>);

/// Circles of one crate, where `files` are paths and texts under `src/` and `name` is without the prefix `apsides-`.
pub(crate) fn check<'a>(
    name: &str,
    source: &str,
    files: impl Iterator<Item = (&'a str, String)>,
) -> Vec<Finding> {
    if PENDING.contains(&name) {
        return Vec::new();
    }
    let modules = Modules::read(source, files);
    let mut findings = Vec::new();
    for (parent, arrows) in modules.arrows() {
        for circle in circles(&arrows) {
            let allowed = ALLOWED.iter().any(|(n, p, members)| {
                *n == name && *p == parent.join("::") && circle.iter().all(|m| members.contains(m))
            });
            if !allowed {
                findings.push(Finding::of(source, message(&parent, &circle, &arrows)));
            }
        }
    }
    findings
}

/// Modules that lead to each other, with one path for each step.
fn message(parent: &[String], circle: &[&str], arrows: &Arrows) -> String {
    let steps: Vec<String> = arrows
        .iter()
        .filter(|((from, to), _)| circle.contains(&from.as_str()) && circle.contains(&to.as_str()))
        .map(|((from, _), path)| format!("`{from}` names `{path}`"))
        .collect();
    let root = if parent.is_empty() { String::new() } else { format!(" of `{}`", parent.join("::")) };
    format!("an import circle of the modules {}{root}: {}", circle.join(", "), steps.join("; "))
}

/// Pairs of siblings of which the first names the second, with a path that it names.
type Arrows = BTreeMap<(String, String), String>;

impl Modules {
    fn read<'a>(source: &str, files: impl Iterator<Item = (&'a str, String)>) -> Self {
        let mut modules = BTreeMap::<Place, Module>::new();
        for (path, text) in files {
            let Some(inner) = path.strip_prefix(source).and_then(|p| p.strip_suffix(".rs")) else { continue };
            if is_test_file(path) {
                continue;
            }
            let mut place: Place =
                inner.split('/').filter(|part| !part.is_empty()).map(str::to_owned).collect();
            let is_folder = place.last().is_some_and(|last| last == "mod");
            let is_root = place.len() == 1 && (place[0] == "lib" || place[0] == "main");
            if is_folder || is_root {
                place.pop();
            }
            let production: String =
                text.lines().take(lines_before_tests(&text)).flat_map(|l| [l, "\n"]).collect();
            modules.entry(place).or_default().scan(&code(&production));
        }
        Self(modules)
    }

    /// The module that a path leads to from `at`: through modules, then through what the last of them imports.
    fn resolve(&self, at: &[String], path: &[String], depth: usize) -> Place {
        let mut place = at.to_vec();
        let mut rest = path;
        while let [first, after @ ..] = rest {
            match first.as_str() {
                "crate" => place.clear(),
                "self" => {}
                "super" => drop(place.pop()),
                _ => {
                    place.push(first.clone());
                    if !self.0.contains_key(&place) {
                        place.pop();
                        break;
                    }
                }
            }
            rest = after;
        }
        let Some(item) = rest.first() else { return place };
        let imports = self.0.get(&place).map_or(&[][..], |m| &m.imports);
        let import = imports.iter().find(|(name, _)| name == item).map(|(_, path)| path);
        match import {
            Some(path) if depth > 0 && path != rest => self.resolve(&place, path, depth - 1),
            _ => place,
        }
    }

    /// The arrows between siblings, by the module that declares them.
    fn arrows(&self) -> BTreeMap<Place, Arrows> {
        let mut arrows = BTreeMap::<Place, Arrows>::new();
        for (place, module) in &self.0 {
            for path in &module.references {
                let target = self.resolve(place, path, 8);
                let common = place.iter().zip(&target).take_while(|(a, b)| a == b).count();
                if let (Some(from), Some(to)) = (place.get(common), target.get(common)) {
                    arrows
                        .entry(place[..common].to_vec())
                        .or_default()
                        .entry((from.clone(), to.clone()))
                        .or_insert_with(|| path.join("::"));
                }
            }
        }
        arrows
    }
}

impl Module {
    /// Adds the paths and imports of code without comments and literals.
    fn scan(&mut self, code: &str) {
        let tokens = tokens(code);
        for (k, token) in tokens.iter().enumerate() {
            let begins = !matches!(k.checked_sub(1).map(|before| tokens[before]), Some("::" | "use"));
            if *token == "use" {
                let mut leaves = Vec::new();
                tree(&tokens, k + 1, &[], &mut leaves);
                let internal = |p: &[String]| matches!(p[0].as_str(), "crate" | "self" | "super");
                self.references
                    .extend(leaves.iter().map(|(_, p)| p.clone()).filter(|p| !p.is_empty() && internal(p)));
                self.imports.extend(leaves);
            } else if begins
                && matches!(*token, "crate" | "self" | "super")
                && tokens.get(k + 1) == Some(&"::")
            {
                let mut leaves = Vec::new();
                tree(&tokens, k, &[], &mut leaves);
                self.references.extend(leaves.into_iter().map(|(_, path)| path));
            }
        }
    }
}

/// Words, `::` and single characters.
fn tokens(code: &str) -> Vec<&str> {
    let mut found = Vec::new();
    let mut rest = code.trim_start();
    while let Some(first) = rest.chars().next() {
        let length = match first {
            _ if is_word(first) => rest.find(|c| !is_word(c)).unwrap_or(rest.len()),
            ':' if rest.starts_with("::") => 2,
            _ => first.len_utf8(),
        };
        found.push(&rest[..length]);
        rest = rest[length..].trim_start();
    }
    found
}

/// Leaves of a path with braces that begins at token `k`, each with the name it gives; returns the token behind it.
fn tree(tokens: &[&str], mut k: usize, prefix: &[String], leaves: &mut Vec<(String, Vec<String>)>) -> usize {
    let mut path = prefix.to_vec();
    loop {
        match tokens.get(k) {
            Some(&"{") => {
                k += 1;
                while tokens.get(k).is_some_and(|t| *t != "}") {
                    k = if tokens[k] == "," { k + 1 } else { tree(tokens, k, &path, leaves).max(k + 1) };
                }
                return k + 1;
            }
            Some(&"*") => k += 1,
            // `self` in braces is the module itself.
            Some(&"self") if !path.is_empty() => k += 1,
            Some(word) if word.starts_with(is_word) => {
                path.push((*word).to_owned());
                k += 1;
            }
            _ => {}
        }
        if tokens.get(k) == Some(&"::") {
            k += 1;
            continue;
        }
        let mut name = path.last().cloned().unwrap_or_default();
        if tokens.get(k) == Some(&"as") {
            name = tokens.get(k + 1).copied().unwrap_or_default().to_owned();
            k += 2;
        }
        leaves.push((name, path));
        return k;
    }
}

/// Largest sets of modules that all lead to each other.
fn circles(arrows: &Arrows) -> Vec<Vec<&str>> {
    let reached = |from: &str| {
        let mut found = BTreeSet::<&str>::new();
        let mut open = vec![from.to_owned()];
        while let Some(at) = open.pop() {
            for (_, to) in arrows.keys().filter(|(a, b)| *a == at && a != b) {
                if found.insert(to) {
                    open.push(to.clone());
                }
            }
        }
        found
    };
    let names: BTreeSet<&str> = arrows.keys().flat_map(|(a, b)| [a.as_str(), b.as_str()]).collect();
    let reach: BTreeMap<&str, BTreeSet<&str>> = names.iter().map(|n| (*n, reached(n))).collect();
    let mut circles: Vec<Vec<&str>> = Vec::new();
    for name in &names {
        let known = circles.iter().any(|c| c.contains(name));
        if !known && reach[name].contains(name) {
            circles.push(
                names
                    .iter()
                    .copied()
                    .filter(|n| reach[name].contains(n) && reach[n].contains(name))
                    .collect(),
            );
        }
    }
    circles
}

#[cfg(test)]
mod tests {
    use super::*;

    fn messages(files: &[(&str, &str)]) -> Vec<String> {
        let files = files.iter().map(|(path, text)| (*path, (*text).to_owned()));
        check("kkt", "src", files).into_iter().map(|f| f.message).collect()
    }

    #[test]
    fn two_files_that_import_each_other_are_found() {
        let found = messages(&[
            ("src/lib.rs", "mod a;\nmod b;\nmod c;\n"),
            ("src/a.rs", "use crate::b::{self, B};\npub struct A;\n"),
            ("src/b.rs", "use super::c;\nfn f() -> crate::a::A {}\n"),
            ("src/c.rs", "fn f() {}\n"),
        ]);
        assert_eq!(
            found,
            ["an import circle of the modules a, b: `a` names `crate::b`; `b` names `crate::a::A`"]
        );
    }

    #[test]
    fn names_of_the_root_are_followed_to_their_module() {
        let found = messages(&[
            ("src/lib.rs", "mod a;\nmod b;\npub use a::{A as First, inner::Deep};\npub use b::B;\n"),
            ("src/a.rs", "mod inner;\nuse crate::B;\n"),
            ("src/a/inner.rs", "pub struct Deep;\n"),
            ("src/b.rs", "use crate::{Deep};\n"),
        ]);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].contains("modules a, b:"), "{found:?}");
    }

    #[test]
    fn siblings_in_a_folder_are_checked_too() {
        let found = messages(&[
            ("src/a.rs", "mod x;\nmod y;\nmod z;\n"),
            ("src/a/x.rs", "use super::y::Y;\n"),
            ("src/a/y.rs", "use super::z;\n"),
            ("src/a/z.rs", "use crate::a::x::X;\n"),
        ]);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].contains("modules x, y, z of `a`:"), "{found:?}");
    }

    #[test]
    fn tests_comments_and_parents_are_no_circles() {
        let found = messages(&[
            ("src/lib.rs", "mod a;\nmod b;\n"),
            ("src/a.rs", "use crate::b::B;\n// crate::a::A\nmod inner;\nuse inner::Inner;\n"),
            ("src/a/inner.rs", "use super::A;\n"),
            ("src/b.rs", "pub struct B;\n#[cfg(test)]\nmod tests {\n    use crate::a::A;\n}\n"),
            ("src/b/tests.rs", "use crate::a::A;\n"),
        ]);
        assert_eq!(found, Vec::<String>::new());
    }
}
