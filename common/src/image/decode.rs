//! The entry points: the bytes of one file to pixels, by the reader of its format.

use super::decoded::{Decoded, Format};
use super::error::ImageError;
use super::source::Source;
use super::{Plane, jpeg, mask, normals, openexr, pfm, png, rgbe};
use crate::math::Vec3;

/// Decodes a colour image of any format that is read. `name` only appears in errors; the format is told by content.
///
/// - OpenEXR: the first part with `R G B` (the unnamed layer before named ones), else `Y` as grey; placed in the display
///   window, black where the data window leaves it, cropped where it exceeds it; `chromaticities` converted to Rec. 709.
/// - Radiance HDR: divided by `EXPOSURE` and `COLORCORR`, `PRIMARIES` converted to Rec. 709.
/// - PFM: multiplied by the magnitude of the scale.
/// - PNG, JPEG: decoded from sRGB, whatever the file says of its colours (a contradiction is a warning); Exif orientation
///   is applied.
///
/// # Errors
/// If the file is of no known format, broken, unsupported, without colours, or larger than [`super::Limits::default`].
pub fn decode(name: &str, bytes: &[u8]) -> Result<Decoded, ImageError> {
    Source::new(name, bytes).decode()
}

/// Decodes a coverage mask, linear in [0, 1] (no sRGB decoding), from any format that is read: the alpha channel where
/// there is one that is not 1 everywhere, else the only channel, else equal red, green and blue.
///
/// # Errors
/// As [`decode`], and if the colours differ or a value lies outside [0, 1].
pub fn decode_mask(name: &str, bytes: &[u8]) -> Result<Plane<f32>, ImageError> {
    Source::new(name, bytes).mask()
}

/// Decodes a normal map: world-space unit normals, exactly zero on the background. OpenEXR (channels `X Y Z` or
/// `R G B`, also of a named layer) or PFM. Normals whose length is within 0.01 of 1 are
/// renormalised.
///
/// # Errors
/// As [`decode`], and with the pixel's coordinates if a normal is neither zero nor of unit length.
pub fn decode_normals(name: &str, bytes: &[u8]) -> Result<Plane<Vec3>, ImageError> {
    Source::new(name, bytes).normals()
}

impl Source<'_> {
    /// See [`decode`].
    ///
    /// # Errors
    /// See [`decode`].
    pub fn decode(&self) -> Result<Decoded, ImageError> {
        match self.format()? {
            Format::OpenExr => openexr::decode(self),
            Format::RadianceHdr => rgbe::decode(self),
            Format::Pfm => pfm::decode(self),
            Format::Png => png::decode(self),
            Format::Jpeg => jpeg::decode(self),
        }
    }

    /// See [`decode_mask`].
    ///
    /// # Errors
    /// See [`decode_mask`].
    pub fn mask(&self) -> Result<Plane<f32>, ImageError> {
        mask::decode(self)
    }

    /// See [`decode_normals`].
    ///
    /// # Errors
    /// See [`decode_normals`].
    pub fn normals(&self) -> Result<Plane<Vec3>, ImageError> {
        normals::decode(self)
    }
}
