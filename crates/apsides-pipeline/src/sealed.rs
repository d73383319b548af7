//! Files that only this program reads again, with the digest of their content: one that was altered is none.

use crate::digest::sha256;

/// Beginning of the first line, which has the digest.
const SEAL: &str = "sha256 ";

/// The content of a file with the digest of the text in its first line.
pub(crate) fn seal(text: &str) -> String {
    format!("{SEAL}{}\n{text}", sha256(text.as_bytes()))
}

/// The text of a file, unless it is not the one that was sealed.
pub(crate) fn unseal(content: &[u8]) -> Option<&str> {
    let line = content.iter().position(|byte| *byte == b'\n')?;
    let (line, text) = (&content[..line], &content[line + 1..]);
    let stated = line.strip_prefix(SEAL.as_bytes())?;
    (stated == sha256(text).as_bytes()).then(|| std::str::from_utf8(text).ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_altered_byte_breaks_the_seal() {
        let sealed = seal("{\"a\": [1, 2]}\n").into_bytes();
        assert_eq!(unseal(&sealed), Some("{\"a\": [1, 2]}\n"));
        for at in 0..sealed.len() {
            let mut altered = sealed.clone();
            altered[at] ^= 1;
            assert_eq!(unseal(&altered), None, "byte {at}");
            assert_eq!(unseal(&sealed[..at]), None, "cut at {at}");
        }
        assert_eq!(unseal(&[sealed, b" ".to_vec()].concat()), None);
        assert_eq!(unseal(seal("").as_bytes()), Some(""));
    }
}
