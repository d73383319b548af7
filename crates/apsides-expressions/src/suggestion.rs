//! The name that may be meant by one that is not known.

/// The end of the sentence that refuses a name: it says the nearest one, or all of them, which are `what`, where none is near.
#[must_use]
pub fn suggested_name(name: &str, what: &str, names: &[&str]) -> String {
    match nearest(name, names.iter().copied()) {
        Some(name) => format!("; the nearest is `{name}`"),
        None if names.is_empty() => String::new(),
        None => format!("; {what}: {}", quoted(names)),
    }
}

/// Names in quotes, one after the other.
#[must_use]
pub fn quoted(names: &[&str]) -> String {
    names.iter().map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", ")
}

/// Longest name that is compared: more is no slip of the hand, and comparing takes the product of the lengths.
const LONGEST: usize = 200;

/// The number of letters to insert, remove, replace or swap that makes one word another.
#[must_use]
pub fn distance(a: &str, b: &str) -> usize {
    if a.len().max(b.len()) > LONGEST { a.len().max(b.len()) } else { strsim::damerau_levenshtein(a, b) }
}

/// Returns true if two words differ by no more than a slip of the hand: two letters, and less than a third of the shorter one.
#[must_use]
pub fn is_slip(a: &str, b: &str) -> bool {
    let distance = distance(a, b);
    distance <= 2 && 3 * distance < a.len().min(b.len())
}

/// The word that differs least from another, unless half of it or more differs.
#[must_use]
pub fn nearest<'a>(word: &str, among: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    if word.len() > LONGEST {
        return None;
    }
    let distances = among.map(|other| (distance(word, other), other));
    distances.min().filter(|(distance, other)| *distance <= other.len() / 2).map(|(_, other)| other)
}
