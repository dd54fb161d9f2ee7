//! What a decoded file gives.

use std::fmt;

use super::Image;

/// A decoded image file.
#[derive(Debug, Clone, PartialEq)]
pub struct Decoded {
    /// The pixels: linear Rec. 709, top left first. NaN and infinities are kept as the file has them; the caller
    /// decides. Colours are as stored with regard to [`Self::alpha`], see [`Self::is_premultiplied`].
    pub image: Image,
    /// Opacity as stored, one value per pixel, nominally in [0, 1], where the file has it.
    pub alpha: Option<Vec<f32>>,
    /// For PNG and JPEG, the pixels that are overexposed: one of red, green and blue is at the largest code (JPEG: less
    /// than three codes below it, because quantised DCT coefficients move a clipped value by as much). Black is not
    /// counted: the largest error of code 0 is half a step, that of the largest code has no bound.
    pub clipped: Option<Vec<bool>>,
    /// How the file stored the pixels (they are linear now).
    pub encoding: Encoding,
    /// The file's format.
    pub format: Format,
    /// Text that the file carries, in the file's order (OpenEXR: by key; PNG: Latin-1 before UTF-8). Keys as in
    /// [`super::metadata`].
    pub metadata: Vec<(String, String)>,
    /// What the reader assumed, ignored or converted. Sentences for people.
    pub warnings: Vec<String>,
}

impl Decoded {
    /// Whether the colours are already multiplied by [`Self::alpha`]: OpenEXR stores them so, PNG does not.
    #[must_use]
    pub fn is_premultiplied(&self) -> bool {
        self.format == Format::OpenExr
    }
}

/// How a file stores its pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// Proportional to radiance.
    Linear,
    /// Through the sRGB transfer function (IEC 61966-2-1), 8 or 16 bits.
    Srgb,
}

/// The formats that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR, `.exr`.
    OpenExr,
    /// Radiance RGBE, `.hdr` or `.pic`.
    RadianceHdr,
    /// Portable float map, `.pfm`.
    Pfm,
    /// Portable network graphics, `.png`.
    Png,
    /// JPEG, `.jpg`.
    Jpeg,
}

impl Format {
    /// The format that the first bytes promise.
    #[must_use]
    pub fn sniff(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [0x76, 0x2f, 0x31, 0x01, ..] => Some(Self::OpenExr),
            [b'#', b'?', ..] => Some(Self::RadianceHdr),
            [b'P', b'F' | b'f', b' ' | b'\t' | b'\r' | b'\n', ..] => Some(Self::Pfm),
            [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n', ..] => Some(Self::Png),
            [0xff, 0xd8, 0xff, ..] => Some(Self::Jpeg),
            _ => None,
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::OpenExr => "OpenEXR",
            Self::RadianceHdr => "Radiance HDR",
            Self::Pfm => "PFM",
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
        })
    }
}
