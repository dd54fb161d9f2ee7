//! Portable float maps (Debevec 2001; Netpbm's `pfm(5)`): `PF` (colour) or `Pf` (grey), width and height, then a scale
//! whose sign gives the byte order (negative: little-endian), then raw 32-bit floats, bottom row first.
//!
//! The samples are multiplied by the magnitude of the scale, their unit. A magnitude other than 1 is a warning, because
//! some writers store an unrelated number.

use super::Image;
use super::decoded::{Decoded, Encoding, Format};
use super::error::ImageError;
use super::source::Source;
use crate::math::to_f32;

/// Decodes a portable float map. Linear Rec. 709 is assumed, because the format does not state a colour space.
pub(super) fn decode(source: &Source<'_>) -> Result<Decoded, ImageError> {
    let header = Header::read(source)?;
    let mut warnings = Vec::new();
    if header.scale != 1.0 {
        warnings.push(format!("samples multiplied by the file's scale of {}", header.scale));
    }
    let row_bytes = header.width * header.channels * 4;
    let mut pixels = Vec::with_capacity(header.width * header.height);
    for row in header.raster.chunks_exact(row_bytes).rev() {
        for pixel in row.chunks_exact(header.channels * 4) {
            let first = header.sample(pixel, 0);
            let grey = header.channels == 1;
            pixels.push(if grey { [first; 3] } else { [first, header.sample(pixel, 1), header.sample(pixel, 2)] });
        }
    }
    Ok(Decoded {
        image: Image::from_pixels(header.width, header.height, pixels),
        alpha: None,
        clipped: None,
        encoding: Encoding::Linear,
        format: FORMAT,
        metadata: Vec::new(),
        warnings,
    })
}

/// The bytes of a colour map of `image`: little-endian, scale 1. NaN and infinities are kept. The format has no
/// metadata.
///
/// # Errors
/// If the image is empty.
pub fn write(image: &Image) -> Result<Vec<u8>, ImageError> {
    let (width, height) = (image.width(), image.height());
    if width == 0 || height == 0 {
        let (expected, found) = ("at least one pixel".to_owned(), format!("{width} x {height}"));
        return Err(ImageError::Unwritable { format: FORMAT, expected, found });
    }
    let mut bytes = format!("PF\n{width} {height}\n-1.0\n").into_bytes();
    for row in image.pixels().chunks_exact(width).rev() {
        bytes.extend(row.iter().flatten().flat_map(|value| value.to_le_bytes()));
    }
    Ok(bytes)
}

#[derive(Debug)]
struct Header<'a> {
    channels: usize,
    width: usize,
    height: usize,
    scale: f64,
    little_endian: bool,
    raster: &'a [u8],
}

impl<'a> Header<'a> {
    fn read(source: &Source<'a>) -> Result<Self, ImageError> {
        let fault = |detail: String| source.malformed(FORMAT, detail);
        let mut rest = source.bytes;
        let mut word = |what: &str| {
            let (word, tail) = next_word(rest).ok_or_else(|| fault(format!("expected {what} in the header")))?;
            rest = tail;
            Ok(word)
        };
        let channels = if word("`PF` or `Pf`")? == "PF" { 3 } else { 1 };
        let (width, height) = (word("the width")?, word("the height")?);
        let scale_word = word("the scale")?;
        let side = |word: &str| word.parse::<u64>().map_err(|_| fault(format!("expected a size, found `{word}`")));
        let (width, height) = source.check_size(side(width)?, side(height)?, FORMAT)?;
        let scale: f64 =
            scale_word.parse().ok().filter(|s: &f64| s.is_normal()).ok_or_else(|| {
                fault(format!("expected a scale such as -1.0, found `{}`", scale_word.escape_debug()))
            })?;
        let expected = width * height * channels * 4;
        // One white-space character ends the header. Some writers in text mode write two, a carriage return and a line
        // feed.
        let raster = match rest {
            [b'\n', tail @ ..] if scale_ended_with_return(source.bytes, rest) && tail.len() >= expected => tail,
            _ => rest,
        };
        let found = raster.len();
        let raster = raster
            .get(..expected)
            .ok_or_else(|| fault(format!("expected {expected} bytes of samples, found {found}")))?;
        Ok(Self { channels, width, height, scale: scale.abs(), little_endian: scale < 0.0, raster })
    }

    /// Sample `channel` of a pixel's bytes, scaled.
    fn sample(&self, pixel: &[u8], channel: usize) -> f32 {
        let mut bytes = [0; 4];
        bytes.copy_from_slice(&pixel[channel * 4..channel * 4 + 4]);
        let value = if self.little_endian { f32::from_le_bytes(bytes) } else { f32::from_be_bytes(bytes) };
        if self.scale == 1.0 { value } else { to_f32(f64::from(value) * self.scale) }
    }
}

/// The next word of the header, and the bytes after the one white-space character that ends it.
fn next_word(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let start = bytes.iter().take(MAX_WORD).position(|byte| !byte.is_ascii_whitespace())?;
    let length = bytes[start..].iter().take(MAX_WORD).position(u8::is_ascii_whitespace)?;
    let word = std::str::from_utf8(&bytes[start..start + length]).ok()?;
    Some((word, &bytes[start + length + 1..]))
}

fn scale_ended_with_return(bytes: &[u8], rest: &[u8]) -> bool {
    bytes[..bytes.len() - rest.len()].last() == Some(&b'\r')
}

const FORMAT: Format = Format::Pfm;

/// A limit above the length of any number in a header.
const MAX_WORD: usize = 64;
