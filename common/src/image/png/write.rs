//! Writes display images: 8-bit sRGB with the metadata as text.

use std::io::Cursor;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

use super::chunks;
use crate::image::error::ImageError;
use crate::image::{Format, Image, srgb};

/// The bytes of an 8-bit PNG of `image`: values clamped to [0, 1], sRGB-encoded and rounded to the nearest code (apply the
/// display exposure before). `metadata` becomes text chunks, in order; keys as in [`crate::image::metadata`]. The same
/// input gives the same bytes.
///
/// # Errors
/// If a value is NaN, a side is 0 or above 2^31 - 1, or a key is no PNG keyword (1 to 79 printable ASCII characters).
pub fn write(image: &Image, metadata: &[(String, String)]) -> Result<Vec<u8>, ImageError> {
    let unwritable = |expected: &str, found: String| ImageError::Unwritable {
        format: Format::Png,
        expected: expected.to_owned(),
        found,
    };
    if let Some(at) = image.pixels().iter().position(|pixel| pixel.iter().any(|value| value.is_nan())) {
        let (column, row) = (at % image.width(), at / image.width());
        return Err(unwritable("numbers", format!("NaN at column {column}, row {row}")));
    }
    let mut extra = chunks::build(*b"sRGB", &[RELATIVE_COLORIMETRIC]);
    for (key, value) in metadata {
        let chunk = chunks::from_text(key, value);
        extra.extend(chunk.ok_or_else(|| unwritable("keys of 1 to 79 printable characters", format!("`{key}`")))?);
    }
    let side = |n: usize| u32::try_from(n).ok().filter(|&n| n > 0 && n < 1 << 31);
    let (Some(width), Some(height)) = (side(image.width()), side(image.height())) else {
        return Err(unwritable("a size from 1 to 2^31 - 1", format!("{} x {}", image.width(), image.height())));
    };
    let codes: Vec<u8> = image.pixels().iter().flatten().map(|&value| srgb::to_code(f64::from(value))).collect();
    let mut bytes = Cursor::new(Vec::new());
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Default, FilterType::Adaptive)
        .write_image(&codes, width, height, ExtendedColorType::Rgb8)
        .map_err(|error| unwritable("an image", error.to_string()))?;
    let mut bytes = bytes.into_inner();
    bytes.splice(HEADER_END..HEADER_END, extra);
    Ok(bytes)
}

/// `sRGB` rendering intent.
const RELATIVE_COLORIMETRIC: u8 = 1;

/// Signature (8), then the header chunk: length, kind, 13 bytes, checksum.
const HEADER_END: usize = 8 + 4 + 4 + 13 + 4;
