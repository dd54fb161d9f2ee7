//! The content of a decoded file.

use std::fmt;

use super::Image;

/// A decoded image file.
#[derive(Debug, Clone, PartialEq)]
pub struct Decoded {
    /// The pixels: linear Rec. 709, top left first. NaN and infinities are kept, for the caller to handle. Colours are
    /// multiplied by [`Self::alpha`] or not, as stored; see [`Self::is_premultiplied`].
    pub image: Image,
    /// Opacity as stored, one value per pixel, nominally in [0, 1]; `None` if the file has none.
    pub alpha: Option<Vec<f32>>,
    /// For PNG, JPEG and integer TIFF, whether each pixel is overexposed: its red, green or blue is at the largest code. For JPEG
    /// within two codes of it, because quantised DCT coefficients move a clipped value by as much. Black pixels are not
    /// marked: the error of code 0 is at most half a step, whereas that of the largest code is unlimited.
    pub clipped: Option<Vec<bool>>,
    /// The encoding of the pixels in the file (in `image` they are linear).
    pub encoding: Encoding,
    /// The file's format.
    pub format: Format,
    /// Text of the file, with keys as in [`super::metadata`]. It is in the file's order; OpenEXR: sorted by key; PNG:
    /// Latin-1 texts before UTF-8 texts.
    pub metadata: Vec<(String, String)>,
    /// What the reader assumed, ignored or converted, in words for the user.
    pub warnings: Vec<String>,
}

impl Decoded {
    /// Whether the colours are multiplied by [`Self::alpha`]: in OpenEXR they are, in PNG and TIFF they are not.
    #[must_use]
    pub fn is_premultiplied(&self) -> bool {
        self.format == Format::OpenExr
    }
}

/// The encoding of the pixels in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// Proportional to radiance.
    Linear,
    /// Encoded by the sRGB transfer function (IEC 61966-2-1), 8 or 16 bits.
    Srgb,
}

/// The supported formats.
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
    /// TIFF, `.tif`.
    Tiff,
}

impl Format {
    /// The format by the first bytes; `None` if they match no supported format.
    #[must_use]
    pub fn sniff(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [0x76, 0x2f, 0x31, 0x01, ..] => Some(Self::OpenExr),
            [b'#', b'?', ..] => Some(Self::RadianceHdr),
            [b'P', b'F' | b'f', b' ' | b'\t' | b'\r' | b'\n', ..] => Some(Self::Pfm),
            [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n', ..] => Some(Self::Png),
            [0xff, 0xd8, 0xff, ..] => Some(Self::Jpeg),
            [b'I', b'I', 0x2a, 0, ..] | [b'M', b'M', 0, 0x2a, ..] => Some(Self::Tiff),
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
            Self::Tiff => "TIFF",
        })
    }
}
