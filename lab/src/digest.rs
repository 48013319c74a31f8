//! Digests as text: how every digest of the lab is written, and the digest of many.
//!
//! What goes into a digest is its owner's business and never decided here.

use sha2::{Digest, Sha256};

/// Two lower-case hexadecimal digits a byte.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// SHA-256, in hexadecimal digits, over the digests of several runs in their order.
pub(crate) fn of_runs<'a>(digests: impl IntoIterator<Item = &'a str>) -> String {
    let mut hash = Sha256::new();
    digests.into_iter().for_each(|digest| hash.update(digest));
    hex(&hash.finalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_digests_are_one_as_if_written_one_after_the_other() {
        // FIPS 180-2, appendix B.1: SHA-256 of "abc"
        let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(of_runs(["a", "bc"]), abc);
        assert_ne!(of_runs(["bc", "a"]), abc);
        assert_eq!(hex(&[0x00, 0x0f, 0xff]), "000fff");
    }
}
