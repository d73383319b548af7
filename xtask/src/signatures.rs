//! Types of hidden dependencies in public signatures, found in the text.
//!
//! The check reads `pub` items, fields and trait implementations of public look, and knows names imported by
//! `use`. It does not see types behind aliases or macros.

use crate::finding::Finding;
use crate::source::{code, has_word, is_word};

/// Public signatures of a file that name a type of these crates.
pub(crate) fn check(path: &str, text: &str, hidden: &[&str]) -> Vec<Finding> {
    let code = code(text);
    let imported = imported_names(&code, hidden);
    let mut findings = Vec::new();
    for (line, signature) in public_signatures(&code) {
        let by_path = hidden.iter().copied().find(|c| has_word(signature, c));
        let by_name = || imported.iter().map(String::as_str).find(|n| has_word(signature, n));
        if let Some(name) = by_path.or_else(by_name) {
            let what = signature.split_whitespace().take(6).collect::<Vec<_>>().join(" ");
            findings.push(Finding::at(path, line, format!("a public signature names `{name}`: `{what} ..`")));
        }
    }
    findings
}

/// Names that `use` brings from these crates, renamings included.
fn imported_names(code: &str, hidden: &[&str]) -> Vec<String> {
    let mut names = Vec::new();
    for statement in code.split(';') {
        let Some(at) = statement.rfind("use ") else { continue };
        let path = statement[at + 4..].trim_start().trim_start_matches("::");
        let root = path.split(|c: char| !is_word(c)).next().unwrap_or_default();
        if statement[..at].ends_with(is_word) || !hidden.contains(&root) {
            continue;
        }
        // The last name of each leaf: `a::B`, `a::{B, C as D}`.
        for leaf in path.split([',', '{', '}']) {
            let name = leaf.trim_end().rsplit(|c: char| !is_word(c)).next().unwrap_or_default();
            if !name.is_empty() && name != "self" {
                names.push(name.to_owned());
            }
        }
    }
    names
}

/// Text from each `pub` to the end of the signature or field, with its line.
fn public_signatures(code: &str) -> Vec<(usize, &str)> {
    let mut found = Vec::new();
    for (at, _) in code.match_indices("pub ") {
        if code[..at].ends_with(is_word) {
            continue;
        }
        let rest = &code[at..];
        let item = rest["pub ".len()..].trim_start();
        // Public fields are items of their own; variants and methods of a trait are public with it.
        let end = if item.starts_with("type ") || item.starts_with("const ") && !item.starts_with("const fn")
        {
            rest.find('=').filter(|_| !item.starts_with("type ")).or_else(|| rest.find(';'))
        } else if ["fn ", "const fn", "async fn", "struct ", "enum ", "trait ", "use ", "mod ", "union "]
            .iter()
            .any(|k| item.starts_with(k))
        {
            if item.starts_with("enum ") || item.starts_with("trait ") {
                body_end(rest)
            } else if item.starts_with("struct ") {
                rest.find(['{', '(', ';'])
            } else if item.starts_with("use ") {
                rest.find(';')
            } else {
                rest.find(['{', ';'])
            }
        } else {
            rest.find(['\n', '}'])
        };
        let line = code[..at].matches('\n').count() + 1;
        found.push((line, &rest[..end.unwrap_or(rest.len())]));
    }
    found
}

/// Place at which the braces that open first are closed.
fn body_end(text: &str) -> Option<usize> {
    let mut depth = 0;
    for (k, c) in text.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => {
                depth -= 1;
                if depth == 0 {
                    return Some(k);
                }
            }
            _ => {}
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    const HIDDEN: &[&str] = &["faer", "glam"];

    fn lines(text: &str) -> Vec<usize> {
        check("a.rs", text, HIDDEN).into_iter().map(|f| f.line).collect()
    }

    #[test]
    fn paths_in_signatures_are_found() {
        assert_eq!(lines("pub fn f(a: faer::Mat<f64>) {}"), [1]);
        assert_eq!(lines("\npub fn f(\n    a: &glam::DVec3,\n) -> f64 {}"), [2]);
        assert_eq!(lines("pub struct A {\n    pub b: glam::DVec3,\n    c: glam::DVec3,\n}"), [2]);
        assert_eq!(lines("pub type M = faer::Mat<f64>;"), [1]);
        assert_eq!(lines("pub enum E {\n    A(glam::DVec3),\n}"), [1]);
        assert_eq!(lines("pub use faer::Mat;"), [1]);
        assert_eq!(lines("pub struct W(pub glam::DVec3, glam::DVec3);"), [1]);
    }

    #[test]
    fn imported_names_are_found() {
        let text = "use faer::{Mat, sparse::{SparseColMat as Sparse}};\npub fn f() -> Sparse { }\npub fn g() -> Mat {}";
        assert_eq!(lines(text), [2, 3]);
    }

    #[test]
    fn private_use_is_free() {
        let text = "use faer::Mat;\n/// Not a `faer::Mat`.\npub fn f(x: &[f64]) -> f64 { faer::inner(x) }\n\
                    pub(crate) fn g() -> Mat {}\nfn h(m: Mat) {}\npub struct S { m: Mat }\npub struct T(Mat);\npub const N: usize = faer::N;";
        assert_eq!(lines(text), Vec::<usize>::new());
    }

    #[test]
    fn other_crates_are_free() {
        assert_eq!(
            lines("use std::mem;\nuse nalgebra::Mat;\npub fn f(m: Mat) -> f64 {}"),
            Vec::<usize>::new()
        );
    }
}
