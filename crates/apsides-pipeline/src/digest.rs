//! SHA-256 digests in hexadecimal digits.

use sha2::{Digest as _, Sha256};

/// The digest of a content.
#[must_use]
pub fn sha256(content: &[u8]) -> String {
    digits(&Sha256::digest(content))
}

/// Bytes in hexadecimal digits, two each.
#[must_use]
pub fn digits(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::sha256;

    /// FIPS 180-4, the example of one block.
    #[test]
    fn the_digest_of_the_standard() {
        assert_eq!(sha256(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    }
}
