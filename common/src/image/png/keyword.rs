//! Keywords of text chunks: PNG registers some, which have another spelling in [`metadata`].

use super::super::metadata;

/// The PNG keyword of one of our keys.
pub(super) fn to_png(key: &str) -> &str {
    REGISTERED.iter().find(|(ours, _)| *ours == key).map_or(key, |(_, png)| *png)
}

/// Our key of a PNG keyword.
pub(super) fn from_png(keyword: &str) -> &str {
    REGISTERED.iter().find(|(_, png)| *png == keyword).map_or(keyword, |(ours, _)| *ours)
}

/// Our key and the keyword that PNG registers for it.
const REGISTERED: [(&str, &str); 2] = [(metadata::SOFTWARE, "Software"), (metadata::COMMENTS, "Comment")];
