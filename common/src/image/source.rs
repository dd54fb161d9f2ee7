//! The bytes of one file, its size limits, and the errors common to all readers.

use super::decoded::Format;
use super::error::ImageError;

/// The bytes of one file, its name for errors, and its size limits.
#[derive(Debug, Clone, Copy)]
pub struct Source<'a> {
    pub(super) name: &'a str,
    pub(super) bytes: &'a [u8],
    pub(super) limits: Limits,
    /// The layer to read, if the user asks for one.
    pub(super) layer: Option<&'a str>,
}

/// Size limits, checked before allocation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Pixels per side.
    pub max_side: usize,
    /// Pixels in all.
    pub max_pixels: usize,
}

impl Default for Limits {
    /// 32768 pixels per side, 2^28 in all (3 GB as an [`super::Image`]).
    fn default() -> Self {
        Self { max_side: 1 << 15, max_pixels: 1 << 28 }
    }
}

impl<'a> Source<'a> {
    /// The file `name` with content `bytes`, with the default limits.
    #[must_use]
    pub fn new(name: &'a str, bytes: &'a [u8]) -> Self {
        Self { name, bytes, limits: Limits::default(), layer: None }
    }

    /// The same source with other limits.
    #[must_use]
    pub fn with_limits(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }

    /// The same source, of which this layer is read: its name, the last component of it, or the name of a part. Only OpenEXR has layers.
    #[must_use]
    pub fn with_layer(self, layer: Option<&'a str>) -> Self {
        Self { layer, ..self }
    }

    /// The format by content.
    pub(super) fn format(&self) -> Result<Format, ImageError> {
        Format::sniff(self.bytes)
            .ok_or_else(|| ImageError::UnknownFormat { name: self.name.to_owned(), found: describe(self.bytes) })
    }

    /// Checks the size in a header and returns it.
    pub(super) fn check_size(&self, width: u64, height: u64, format: Format) -> Result<(usize, usize), ImageError> {
        if width == 0 || height == 0 {
            return Err(self.malformed(format, format!("expected at least one pixel, found {width} x {height}")));
        }
        let Limits { max_side, max_pixels } = self.limits;
        let too_large = || ImageError::TooLarge { name: self.name.to_owned(), width, height, max_side, max_pixels };
        let side = |n: u64| usize::try_from(n).ok().filter(|&n| n <= max_side).ok_or_else(too_large);
        let (columns, rows) = (side(width)?, side(height)?);
        if columns.checked_mul(rows).is_none_or(|pixels| pixels > max_pixels) {
            return Err(too_large());
        }
        Ok((columns, rows))
    }

    /// The error for a file that violates `format`.
    pub(super) fn malformed(&self, format: Format, detail: impl Into<String>) -> ImageError {
        ImageError::Malformed { name: self.name.to_owned(), format, detail: detail.into() }
    }

    /// The error for a file with a `feature` that is not supported.
    pub(super) fn unsupported(&self, format: Format, feature: impl Into<String>, advice: &str) -> ImageError {
        ImageError::Unsupported {
            name: self.name.to_owned(),
            format,
            feature: feature.into(),
            advice: advice.to_owned(),
        }
    }
}

/// Refuses pixels that are not square (`aspect` is their width over their height): a sphere would be an ellipse.
pub(super) fn check_pixel_aspect(source: &Source<'_>, format: Format, aspect: f64) -> Result<(), ImageError> {
    // Some programs round.
    const SQUARE: f64 = 0.005;
    if (aspect - 1.0).abs() <= SQUARE {
        return Ok(());
    }
    let feature = format!("pixels that are not square (width over height {aspect})");
    Err(source.unsupported(format, feature, "resample it to square pixels, or correct the value in its header"))
}

/// A description of a file of unknown format.
fn describe(bytes: &[u8]) -> String {
    let starts = |text: &[u8]| bytes.starts_with(text);
    match bytes {
        [] => "an empty file".to_owned(),
        _ if starts(b"version https://git-lfs.github.com/") => {
            "a pointer of Git LFS, not the file itself (`git lfs pull` fetches it)".to_owned()
        }
        _ if starts(b"/annex/objects/") || starts(b"../.git/annex/") || starts(b".git/annex/") => {
            "a pointer of git-annex, not the file itself (`git annex get` fetches it)".to_owned()
        }
        _ if is_html(bytes) => "an HTML page (the download was a web page, not the file)".to_owned(),
        _ if starts(b"tensor_file") => {
            "a tensor file, such as a `.bsdf` of the RGL database: a measured material, not an image".to_owned()
        }
        [0x1f, 0x8b, ..] => "a gzip file (unpack it first)".to_owned(),
        [b'P', b'K', 3, 4, ..] => "a zip archive (unpack it first)".to_owned(),
        [b'B', b'Z', b'h', ..] => "a bzip2 file (unpack it first)".to_owned(),
        [0xfd, b'7', b'z', b'X', b'Z', ..] => "an xz file (unpack it first)".to_owned(),
        [0x28, 0xb5, 0x2f, 0xfd, ..] => "a Zstandard file (unpack it first)".to_owned(),
        [b'8', b'B', b'P', b'S', ..] => "a Photoshop document".to_owned(),
        [b'%', b'P', b'D', b'F', ..] => "a PDF document".to_owned(),
        [0xff, 0x0a, ..] | [0, 0, 0, 12, b'J', b'X', b'L', b' ', ..] => "JPEG XL".to_owned(),
        [b'I', b'I', 0x2b, 0, ..] | [b'M', b'M', 0, 0x2b, ..] => "BigTIFF".to_owned(),
        [_, _, _, _, b'f', b't', b'y', b'p', b'c', b'r', b'x', ..] => "a camera's raw file".to_owned(),
        [b'G', b'I', b'F', b'8', ..] => "GIF".to_owned(),
        [b'B', b'M', ..] => "BMP".to_owned(),
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => "WebP".to_owned(),
        [_, _, _, _, b'f', b't', b'y', b'p', ..] => "HEIF or AVIF".to_owned(),
        [b'P', b'F', b'4', ..] => "PFM with an alpha channel (PF4)".to_owned(),
        [b'P', b'1'..=b'7', b' ' | b'\t' | b'\r' | b'\n', ..] => "a Netpbm file with integer samples".to_owned(),
        _ => {
            let start: Vec<String> = bytes.iter().take(8).map(|byte| format!("{byte:02x}")).collect();
            format!("a file that starts with the bytes {}", start.join(" "))
        }
    }
}

/// Whether the first words are those of a web page.
fn is_html(bytes: &[u8]) -> bool {
    let text: Vec<u8> =
        bytes.iter().skip_while(|byte| byte.is_ascii_whitespace()).take(14).map(u8::to_ascii_lowercase).collect();
    [&b"<!doctype html"[..], b"<html", b"<head"].iter().any(|start| text.starts_with(start))
}
