//! The chunks of a PNG file: walking them, reading text out of them, and building them.

use super::super::metadata;

/// One chunk.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chunk<'a> {
    pub(super) kind: [u8; 4],
    pub(super) data: &'a [u8],
}

/// The chunks of a file up to its end or the first that is cut off. Checksums are left to the decoder.
pub(super) fn of(bytes: &[u8]) -> impl Iterator<Item = Chunk<'_>> {
    let mut rest = bytes.get(8..).unwrap_or_default();
    std::iter::from_fn(move || {
        let (length, tail) = rest.split_first_chunk::<4>()?;
        let length = usize::try_from(u32::from_be_bytes(*length)).ok()?;
        let (kind, tail) = tail.split_first_chunk::<4>()?;
        let data = tail.get(..length)?;
        rest = tail[length..].get(4..)?;
        Some(Chunk { kind: *kind, data })
    })
}

/// Uncompressed `tEXt` and `iTXt` chunks as (key, text); PNG's registered keywords become ours.
pub(super) fn text(bytes: &[u8]) -> Vec<(String, String)> {
    of(bytes).filter_map(text_of).collect()
}

fn text_of(chunk: Chunk<'_>) -> Option<(String, String)> {
    let end = chunk.data.iter().position(|&byte| byte == 0)?;
    let (key, value) = (latin1(&chunk.data[..end]), &chunk.data[end + 1..]);
    let value = match &chunk.kind {
        b"tEXt" => latin1(value),
        b"iTXt" => {
            // Compression flag and method, language, translated keyword, text.
            let [0, _, tail @ ..] = value else { return None };
            let text = tail.splitn(3, |&byte| byte == 0).nth(2)?;
            std::str::from_utf8(text).ok()?.to_owned()
        }
        _ => return None,
    };
    let ours = REGISTERED.iter().find(|(_, png)| *png == key).map_or(key.clone(), |(ours, _)| (*ours).to_owned());
    Some((ours, value))
}

/// A text chunk of a key and value: `tEXt` where Latin-1 holds the value, else `iTXt`. `None` if the key is no keyword.
pub(super) fn from_text(key: &str, value: &str) -> Option<Vec<u8>> {
    let keyword = REGISTERED.iter().find(|(ours, _)| *ours == key).map_or(key, |(_, png)| *png);
    let printable = keyword.bytes().all(|byte| (0x20..0x7f).contains(&byte));
    if !printable || !(1..=79).contains(&keyword.len()) || keyword.trim() != keyword || value.contains('\0') {
        return None;
    }
    let mut data = [keyword.as_bytes(), b"\0"].concat();
    let latin1: Option<Vec<u8>> = value.chars().map(|c| u8::try_from(u32::from(c)).ok()).collect();
    Some(if let Some(latin1) = latin1 {
        data.extend(latin1);
        build(*b"tEXt", &data)
    } else {
        data.extend([0, 0, 0, 0]);
        data.extend(value.as_bytes());
        build(*b"iTXt", &data)
    })
}

/// A whole chunk: length, kind, data, checksum.
pub(super) fn build(kind: [u8; 4], data: &[u8]) -> Vec<u8> {
    let length = u32::try_from(data.len()).unwrap_or(u32::MAX);
    debug_assert!(length as usize == data.len(), "chunk data are far below 4 GB");
    let body = [&kind, data].concat();
    [&length.to_be_bytes()[..], &body, &crc32(&body).to_be_bytes()].concat()
}

/// PNG's checksum (ISO 3309), bit by bit: the chunks built here are short.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 })
    })
}

fn latin1(bytes: &[u8]) -> String {
    bytes.iter().copied().map(char::from).collect()
}

/// Our key and the keyword that PNG registers for it.
const REGISTERED: [(&str, &str); 2] = [(metadata::SOFTWARE, "Software"), (metadata::COMMENTS, "Comment")];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crc_of_the_end_chunk_is_the_known_one() {
        assert_eq!(build(*b"IEND", &[]), b"\0\0\0\0IEND\xae\x42\x60\x82");
    }

    #[test]
    fn keywords_are_checked() {
        assert!(from_text("", "x").is_none());
        assert!(from_text(" key", "x").is_none());
        assert!(from_text(&"k".repeat(80), "x").is_none());
        assert!(from_text("key", "a\0b").is_none());
        assert!(from_text("key", "").is_some());
    }
}
