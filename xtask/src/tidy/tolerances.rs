//! Tolerances of tests: named constants, so that each says what limits the agreement.

use crate::finding::Finding;
use crate::source::{code, is_test_file, lines_before_tests};

/// Comparisons of a size with a small number that has no name, in the tests of a Rust file.
pub(crate) fn check(path: &str, text: &str) -> Vec<Finding> {
    let production = if is_test_file(path) { 0 } else { lines_before_tests(text) };
    let code = code(text);
    let unnamed = code.match_indices(".abs()").filter_map(|(at, size)| {
        let number = unnamed(&code[at + size.len()..])?;
        let line = code[..at].matches('\n').count();
        (line >= production).then(|| {
            let message =
                format!("`{number}`: a tolerance is a constant named after its class (CONTRIBUTING.md)");
            Finding::at(path, line + 1, message)
        })
    });
    unnamed.collect()
}

/// The small number that stands after `<` or `<=`, unless a constant is multiplied by it or added to it.
fn unnamed(after: &str) -> Option<&str> {
    let right = after.trim_start().strip_prefix('<')?;
    let right = right.strip_prefix('=').unwrap_or(right).trim_start();
    let end = right.find(|c: char| !c.is_ascii_alphanumeric() && !"._-".contains(c)).unwrap_or(right.len());
    let number = &right[..end];
    let is_small = number.starts_with("0.0")
        || number.starts_with(|c: char| c.is_ascii_digit()) && number.contains("e-");
    let other = right[end..].trim_start().strip_prefix(['*', '+']).map_or("", str::trim_start);
    let with_constant = other.len() > 1 && other.bytes().take(2).all(|b| b.is_ascii_uppercase());
    (is_small && !with_constant).then_some(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(path: &str, text: &str) -> Vec<usize> {
        check(path, text).into_iter().map(|f| f.line).collect()
    }

    #[test]
    fn small_numbers_need_a_name() {
        let text = "a.abs() < 1e-9;\nb.abs()\n    <= 0.01 * b;\nc.abs() < 5_0.0e-3 && d.abs() < 0.5;\n";
        assert_eq!(lines("crates/apsides-kkt/tests/kkt.rs", text), [1, 2, 4]);
        let found = check("crates/apsides-kkt/tests/kkt.rs", text);
        assert!(found[1].message.starts_with("`0.01`: a tolerance is a constant"), "{}", found[1]);
    }

    #[test]
    fn names_and_what_is_no_tolerance_pass() {
        let text = "a.abs() < ROUNDING && a.abs() < 1e-3 * SOLVER && a.abs() < 0.05 + SOLVER && a.abs() > 1e-9 && a < 1e-9;\n// a.abs() < 1e-9\n";
        assert_eq!(lines("crates/apsides-kkt/tests/kkt.rs", text), [0; 0]);
    }

    #[test]
    fn code_that_is_no_test_is_left_alone() {
        let text = "fn f(a: f64) -> bool { a.abs() < 1e-9 }\n#[cfg(test)]\nmod tests {\n    const A: bool = b.abs() < 1e-9;\n}\n";
        assert_eq!(lines("crates/apsides-kkt/src/kkt.rs", text), [4]);
    }
}
