//! Keywords of text chunks. Those that PNG registers are spelled differently from the keys in [`metadata`].

use super::super::metadata;

/// The PNG keyword of a key.
pub(super) fn to_png(key: &str) -> &str {
    REGISTERED.iter().find(|(ours, _)| *ours == key).map_or(key, |(_, png)| *png)
}

/// The key of a PNG keyword.
pub(super) fn from_png(keyword: &str) -> &str {
    REGISTERED.iter().find(|(_, png)| *png == keyword).map_or(keyword, |(ours, _)| *ours)
}

/// Each key with the keyword that PNG registers for it.
const REGISTERED: [(&str, &str); 2] = [(metadata::SOFTWARE, "Software"), (metadata::COMMENTS, "Comment")];
