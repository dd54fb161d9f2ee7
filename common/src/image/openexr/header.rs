//! A check of the header before the `exr` crate reads it: reports compressions that the crate does not support, by
//! name, and limits what it would allocate. Also sorts the attributes of a written header.

use std::ops::Range;

use crate::image::decoded::Format;
use crate::image::error::ImageError;
use crate::image::source::Source;

/// Checks versions, windows, tiles and compressions of all parts.
pub(super) fn check(source: &Source<'_>) -> Result<(), ImageError> {
    let cut = || source.malformed(FORMAT, "its header is truncated or broken");
    let flags = u32_at(source.bytes, 4).ok_or_else(cut)?;
    if flags & DEEP != 0 {
        return Err(source.unsupported(FORMAT, "deep data", "flatten it in the program that rendered it"));
    }
    let mut rest = 8..source.bytes.len();
    loop {
        let mut samples = Samples::default();
        while let Some(attribute) = attribute(source.bytes, rest.clone()).ok_or_else(cut)? {
            check_attribute(source, &attribute, &mut samples)?;
            rest.start = attribute.whole.end;
        }
        if samples.pixels.saturating_mul(samples.channels) > source.limits.max_pixels.saturating_mul(MAX_CHANNELS) {
            return Err(source.unsupported(
                FORMAT,
                format!("{} channels at this size", samples.channels),
                "remove channels that are not needed",
            ));
        }
        // An empty name ends a part. In a multi-part file, a second one ends the list of parts.
        rest.start += 1;
        if flags & MULTI_PART == 0 || source.bytes.get(rest.start) == Some(&0) {
            return Ok(());
        }
    }
}

/// The size of a part.
#[derive(Debug, Default)]
struct Samples {
    pixels: usize,
    channels: usize,
}

fn check_attribute(source: &Source<'_>, attribute: &Attribute, samples: &mut Samples) -> Result<(), ImageError> {
    let bytes = source.bytes;
    let value = &bytes[attribute.value.clone()];
    let broken = || source.malformed(FORMAT, "its header has a broken attribute");
    match &bytes[attribute.name.clone()] {
        b"compression" => match value.first() {
            Some(0..=9) => Ok(()),
            Some(&number) => Err(unknown_compression(source, number)),
            None => Err(broken()),
        },
        b"dataWindow" | b"displayWindow" => {
            let edge = |at| i32_at(value, at).map(i64::from).ok_or_else(broken);
            let (width, height) = (edge(8)? - edge(0)? + 1, edge(12)? - edge(4)? + 1);
            let size = |n: i64| u64::try_from(n).map_err(|_| broken());
            let (width, height) = source.check_size(size(width)?, size(height)?, FORMAT)?;
            samples.pixels = samples.pixels.max(width * height);
            Ok(())
        }
        b"tiles" => {
            let side = |at| u32_at(value, at).map(u64::from).ok_or_else(broken);
            source.check_size(side(0)?, side(4)?, FORMAT).map(|_| ())
        }
        // Each entry is a name, its 0, and 16 bytes.
        b"channels" => {
            samples.channels = value.len() / 18;
            Ok(())
        }
        _ => Ok(()),
    }
}

fn unknown_compression(source: &Source<'_>, number: u8) -> ImageError {
    let name = match number {
        10 => "HTJ2K256 (high-throughput JPEG 2000)".to_owned(),
        11 => "HTJ2K32 (high-throughput JPEG 2000)".to_owned(),
        12 => "LJ2K (JPEG 2000)".to_owned(),
        13 => "ZSTD (Zstandard)".to_owned(),
        _ => format!("number {number}"),
    };
    let advice = "convert it, for example with `oiiotool in.exr --compression zip -o out.exr`";
    source.unsupported(FORMAT, format!("compression {name}"), advice)
}

/// The byte ranges of an attribute and its fields in the file.
#[derive(Debug, Clone)]
struct Attribute {
    name: Range<usize>,
    value: Range<usize>,
    whole: Range<usize>,
}

/// The attribute at the start of `rest`; `Some(None)` at the end of a header, `None` if it is truncated.
fn attribute(bytes: &[u8], rest: Range<usize>) -> Option<Option<Attribute>> {
    let text = |start: usize| {
        let length = bytes.get(start..rest.end)?.iter().take(MAX_NAME).position(|&byte| byte == 0)?;
        Some(start..start + length)
    };
    let name = text(rest.start)?;
    if name.is_empty() {
        return Some(None);
    }
    let kind = text(name.end + 1)?;
    let size = usize::try_from(i32_at(bytes, kind.end + 1)?).ok()?;
    let start = kind.end + 5;
    let value = start..start.checked_add(size).filter(|&end| end <= rest.end)?;
    Some(Some(Attribute { whole: rest.start..value.end, name, value }))
}

/// Sorts the attributes of a single-part file by name, so that equal content has equal bytes. The `exr` crate writes
/// custom attributes in the order of a hash map. Sorting does not change lengths, so offsets stay valid.
pub(super) fn sort_attributes(bytes: &mut [u8]) {
    let mut attributes = Vec::new();
    let mut end = 8;
    while let Some(Some(found)) = attribute(bytes, end..bytes.len()) {
        end = found.whole.end;
        attributes.push(found);
    }
    attributes.sort_by(|a, b| bytes[a.name.clone()].cmp(&bytes[b.name.clone()]));
    let sorted: Vec<u8> = attributes.iter().flat_map(|attribute| bytes[attribute.whole.clone()].to_vec()).collect();
    bytes[8..end].copy_from_slice(&sorted);
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

fn i32_at(bytes: &[u8], at: usize) -> Option<i32> {
    Some(i32::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

/// The format, for errors.
pub(super) const FORMAT: Format = Format::OpenExr;

/// Flags of the version field.
const DEEP: u32 = 1 << 11;
const MULTI_PART: u32 = 1 << 12;

/// The limit of a name with its terminating 0; long names have up to 255 bytes.
const MAX_NAME: usize = 256;

/// The limit of channels per pixel at the largest size; smaller images may have more.
const MAX_CHANNELS: usize = 64;
