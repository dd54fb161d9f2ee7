//! Keys identify the computation of a node, independently of its number.

use std::fmt;

use super::BlobHash;

/// Identifies the computation of a node: the BLAKE3 hash of its kind, its parameters and the hashes of its inputs, in order.
///
/// Nodes are pure functions, so nodes of equal key have equal outputs, in any run and in any order of addition. Label, number and
/// placement are not part of the key.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeKey(pub [u8; 32]);

/// Prefix of the hashed bytes; another layout of keys would need another tag.
const TAG: &[u8] = b"lookalike node 1\0";

impl NodeKey {
    /// The key of a node of this kind, with these parameters and inputs.
    #[must_use]
    pub fn of(kind: &str, parameters: &[u8], inputs: impl IntoIterator<Item = BlobHash>) -> Self {
        let mut hasher = blake3::Hasher::new();
        hasher.update(TAG);
        for part in [kind.as_bytes(), parameters] {
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part);
        }
        for input in inputs {
            hasher.update(&input.0);
        }
        Self(*hasher.finalize().as_bytes())
    }
}

/// The first eight hexadecimal digits: enough to tell keys apart in a log.
impl fmt::Debug for NodeKey {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0[..4].iter().try_for_each(|byte| write!(formatter, "{byte:02x}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn key_depends_on_every_part_and_on_the_boundaries_between_parts() {
        let [a, b] = [BlobHash([1; 32]), BlobHash([2; 32])];
        let key = |kind: &str, parameters: &[u8], inputs: &[BlobHash]| NodeKey::of(kind, parameters, inputs.to_vec());
        let keys = [
            key("search", b"x", &[a, b]),
            key("search", b"x", &[b, a]),
            key("search", b"x", &[a]),
            key("search", b"", &[a, b]),
            key("searchx", b"", &[a, b]),
            key("select", b"x", &[a, b]),
            key("search", &[&b"x"[..], &a.0].concat(), &[b]),
        ];
        for (index, one) in keys.iter().enumerate() {
            assert!(keys[..index].iter().all(|other| other != one), "{index}");
        }
        assert_eq!(keys[0], key("search", b"x", &[a, b]));
    }
}
