//! Writes display images: 8-bit sRGB with metadata as text.

use png::text_metadata::{ITXtChunk, TEXtChunk};
use png::{BitDepth, ColorType, Compression, Encoder, Filter, SrgbRenderingIntent};

use super::keyword;
use crate::image::error::ImageError;
use crate::image::{Format, Image, srgb};

/// The bytes of an 8-bit PNG of `image`: values are clamped to [0, 1], sRGB-encoded and rounded to the nearest code.
/// The caller applies the display exposure. `metadata` becomes text chunks, in order; keys as in
/// [`crate::image::metadata`]. The same input gives the same bytes.
///
/// # Errors
/// If a value is NaN, a side is 0 or above 2^31 - 1, or a key is not a PNG keyword (1 to 79 printable ASCII
/// characters).
pub fn write(image: &Image, metadata: &[(String, String)]) -> Result<Vec<u8>, ImageError> {
    if let Some(at) = image.pixels().iter().position(|pixel| pixel.iter().any(|value| value.is_nan())) {
        let (column, row) = (at % image.width(), at / image.width());
        return Err(unwritable("numbers", format!("NaN at column {column}, row {row}")));
    }
    if let Some((key, _)) = metadata.iter().find(|(key, value)| !is_text(keyword::to_png(key), value)) {
        return Err(unwritable("keys of 1 to 79 printable characters", format!("`{key}`")));
    }
    let side = |n: usize| u32::try_from(n).ok().filter(|&n| n > 0 && n < 1 << 31);
    let (Some(width), Some(height)) = (side(image.width()), side(image.height())) else {
        return Err(unwritable("a size from 1 to 2^31 - 1", format!("{} x {}", image.width(), image.height())));
    };
    let codes: Vec<u8> = image.pixels().iter().flatten().map(|&value| srgb::to_code(f64::from(value))).collect();
    encode(width, height, &codes, metadata).map_err(|error| unwritable("an image", error.to_string()))
}

fn encode(width: u32, height: u32, codes: &[u8], metadata: &[(String, String)]) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::Fast);
    encoder.set_filter(Filter::Adaptive);
    encoder.set_source_srgb(SrgbRenderingIntent::RelativeColorimetric);
    let mut writer = encoder.write_header()?;
    for (key, value) in metadata {
        let key = keyword::to_png(key);
        if value.chars().all(|c| u32::from(c) < 256) {
            writer.write_text_chunk(&TEXtChunk::new(key, value))?;
        } else {
            writer.write_text_chunk(&ITXtChunk::new(key, value))?;
        }
    }
    writer.write_image_data(codes)?;
    writer.finish()?;
    Ok(bytes)
}

/// Whether a text chunk can hold the keyword and the value. The `png` crate checks only the keyword's length.
fn is_text(keyword: &str, value: &str) -> bool {
    let printable = keyword.bytes().all(|byte| (0x20..0x7f).contains(&byte));
    printable && (1..=79).contains(&keyword.len()) && keyword.trim() == keyword && !value.contains('\0')
}

fn unwritable(expected: &str, found: String) -> ImageError {
    ImageError::Unwritable { format: Format::Png, expected: expected.to_owned(), found }
}
