//! Photographs, other images, and masks.

use super::file::{InputFile, cannot_use, read_with};
use anyhow::Context;
use lookalike::{
    image::{Decoded, Encoding, Image, Plane, Source, decode_mask},
    math::{narrow, widen},
    scene::Mask,
};
use std::path::Path;

/// An image with its origin.
#[derive(Debug, Clone)]
pub struct LoadedPhoto {
    /// The pixels: linear Rec. 709, composited over black where they are transparent.
    pub image: Image,
    /// Opacity of every pixel, if the file has it.
    pub alpha: Option<Vec<f32>>,
    /// For PNG, JPEG and integer TIFF, which pixels are clipped.
    pub clipped: Option<Vec<bool>>,
    /// Whether the file held radiance or display values.
    pub encoding: Encoding,
    /// Text that the file carries; keys as in [`lookalike::image::metadata`].
    pub metadata: Vec<(String, String)>,
    /// The file, with the hash of [`Self::image`].
    pub source: InputFile,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}

/// Reads the photo of a fit. NaN and infinities are kept; the capture excludes such pixels.
///
/// # Errors
/// If the file cannot be read or decoded.
pub fn load_photo(path: &Path, layer: Option<&str>) -> anyhow::Result<LoadedPhoto> {
    load_layer(path, layer, "photo")
}

/// Reads an image. Errors name its `role`, such as "reference".
///
/// # Errors
/// If the file cannot be read or decoded.
pub fn load_image(path: &Path, role: &str) -> anyhow::Result<LoadedPhoto> {
    load_layer(path, None, role)
}

fn load_layer(path: &Path, layer: Option<&str>, role: &str) -> anyhow::Result<LoadedPhoto> {
    let mut decoded = read_with(path, role, |name, bytes| Source::new(name, bytes).with_layer(layer).decode())?;
    let is_blended = blend_over_black(&mut decoded);
    let mut warnings = decoded.warnings;
    if is_blended {
        warnings.push("transparent pixels are composited over black".to_owned());
    }
    Ok(LoadedPhoto {
        source: InputFile::of_image(path, &decoded.image),
        image: decoded.image,
        alpha: decoded.alpha,
        clipped: decoded.clipped,
        encoding: decoded.encoding,
        metadata: decoded.metadata,
        warnings: warnings.iter().map(|text| format!("{}: {text}", path.display())).collect(),
    })
}

/// Multiplies colours by their opacity unless the file stored them multiplied; returns whether a pixel changed.
fn blend_over_black(decoded: &mut Decoded) -> bool {
    let is_premultiplied = decoded.is_premultiplied();
    let Some(alpha) = decoded.alpha.as_ref().filter(|alpha| !is_premultiplied && alpha.iter().any(|&a| a != 1.0))
    else {
        return false;
    };
    for (pixel, &opacity) in decoded.image.pixels_mut().iter_mut().zip(alpha) {
        *pixel = narrow(widen(*pixel) * f64::from(opacity));
    }
    true
}

/// A mask with its origin.
#[derive(Debug, Clone)]
pub struct LoadedMask {
    /// 1 on the object, 0 outside.
    pub mask: Mask,
    /// The file, with the hash of the mask as a grey image.
    pub source: InputFile,
}

/// Reads a mask: alpha, one channel, or equal channels, linear in \[0, 1\].
///
/// # Errors
/// If the file cannot be read or decoded, is coloured, or holds a value outside \[0, 1\].
pub fn load_mask(path: &Path) -> anyhow::Result<LoadedMask> {
    let plane: Plane<f32> = read_with(path, "mask", decode_mask)?;
    let (width, height) = (plane.width(), plane.height());
    let grey = Image::from_pixels(width, height, plane.values().iter().map(|&value| [value; 3]).collect());
    let source = InputFile::of_image(path, &grey);
    let mask = Mask::new(width, height, plane.into_values()).with_context(|| cannot_use(path, "mask"))?;
    Ok(LoadedMask { mask, source })
}
