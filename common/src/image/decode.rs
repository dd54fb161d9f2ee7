//! The entry points, from the bytes of one file to pixels. The reader is chosen by the format.

use super::decoded::{Decoded, Format};
use super::error::ImageError;
use super::source::Source;
use super::{Plane, jpeg, mask, normals, openexr, pfm, png, rgbe, tiff};
use crate::math::Vec3;

/// Decodes a colour image of any supported format. The format is recognised by content; `name` is used only in errors.
///
/// - OpenEXR: `R G B` of the unnamed layer or of one that is named like a picture, else `Y` as grey. The data window is
///   placed in the display window: black where it does not cover it, cropped where it exceeds it. `chromaticities` are
///   converted to Rec. 709.
/// - Radiance HDR: divided by `EXPOSURE` and `COLORCORR`; `PRIMARIES` are converted to Rec. 709.
/// - PFM: multiplied by the magnitude of the scale.
/// - TIFF: float and half as radiance, integers as PNG.
/// - PNG, JPEG: decoded from sRGB, even if the file declares other colours, which gives a warning. Exif orientation is
///   applied.
///
/// # Errors
/// If the format is unknown or unsupported, the file is broken, has no colours, or is larger than
/// [`super::Limits::default`].
pub fn decode(name: &str, bytes: &[u8]) -> Result<Decoded, ImageError> {
    Source::new(name, bytes).decode()
}

/// Decodes a coverage mask, linear in [0, 1] (no sRGB decoding), from any supported format. The mask is the alpha
/// channel if there is one that is not 1 everywhere, else the only channel, else red, green and blue, which must be
/// equal.
///
/// # Errors
/// As [`decode`], and if the colours differ or a value lies outside [0, 1].
pub fn decode_mask(name: &str, bytes: &[u8]) -> Result<Plane<f32>, ImageError> {
    Source::new(name, bytes).mask()
}

/// Decodes a normal map: world-space unit normals, exactly 0 on the background. The file is OpenEXR (channels `X Y Z`
/// or `R G B`, also of a named layer) or PFM. Normals whose length is within 0.01 of 1 are normalised.
///
/// # Errors
/// As [`decode`], and if a normal is neither 0 nor of unit length; the error has the pixel's coordinates.
pub fn decode_normals(name: &str, bytes: &[u8]) -> Result<Plane<Vec3>, ImageError> {
    Source::new(name, bytes).normals()
}

impl Source<'_> {
    /// See [`decode`].
    ///
    /// # Errors
    /// See [`decode`].
    pub fn decode(&self) -> Result<Decoded, ImageError> {
        let format = self.format()?;
        if let Some(layer) = self.layer.filter(|_| format != Format::OpenExr) {
            return Err(self.unsupported(
                format,
                format!("a layer ({layer:?})"),
                "leave out --layer, which is for OpenEXR",
            ));
        }
        match format {
            Format::OpenExr => openexr::decode(self),
            Format::RadianceHdr => rgbe::decode(self),
            Format::Pfm => pfm::decode(self),
            Format::Png => png::decode(self),
            Format::Jpeg => jpeg::decode(self),
            Format::Tiff => tiff::decode(self),
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
