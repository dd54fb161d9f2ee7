//! OpenEXR (*OpenEXR File Layout*), by the `exr` crate: half, float and unsigned-integer channels (integers above 2^24
//! are rounded), scan lines or tiles, one or more parts, all compressions except JPEG 2000 and Zstandard.
//!
//! - The image is the display window. The data window is placed in it. Pixels outside the data window are 0, and pixels
//!   outside the display window are dropped; both are warnings.
//! - The unnamed layer with `R G B` is read, else one that is named like a picture (`Combined`, `beauty`), else another one, else one that
//!   is named like data; a layer may be asked for. If no part has `R G B`, `Y` is read as grey. Pixels that are not square are refused.
//! - `chromaticities` other than Rec. 709 are converted.
//! - Colours with alpha are premultiplied, as the format requires, and are kept so.
//! - Of several resolution levels the largest is read. Deep data and chroma-subsampled channels are refused.

mod block;
mod channels;
mod header;
mod raster;
#[cfg(test)]
mod tests;
mod write;

pub use write::write;

use channels::{Layer, Wanted};
use header::FORMAT;
use raster::Raster;

use super::Image;
use super::decoded::{Decoded, Encoding};
use super::error::ImageError;
use super::mask_channels::Channels;
use super::primaries::{Primaries, convert};
use super::source::Source;
use crate::math::Mat3;

/// Decodes the colours of an OpenEXR file.
pub(super) fn decode(source: &Source<'_>) -> Result<Decoded, ImageError> {
    let (layer, mut raster) = Raster::read(source, |parts| channels::select(parts, Wanted::Colours, source.layer))?;
    let mut warnings = std::mem::take(&mut raster.warnings);
    warnings.extend(layer.warning.clone());
    let mut pixels = raster.pixels(&layer);
    if let Some(matrix) = to_rec709(source, &raster)? {
        warnings.push("colours converted from the file's chromaticities to Rec. 709".to_owned());
        convert(&mut pixels, matrix);
    }
    Ok(Decoded {
        image: Image::from_pixels(raster.width, raster.height, pixels),
        alpha: layer.alpha.map(|_| raster.planes.swap_remove(layer.colours.len())),
        clipped: None,
        encoding: Encoding::Linear,
        format: FORMAT,
        metadata: raster.metadata,
        warnings,
    })
}

/// The channels of an OpenEXR file that may hold a mask: its colours, else its only channel.
pub(super) fn mask_channels(source: &Source<'_>) -> Result<Channels, ImageError> {
    let (layer, mut raster) = Raster::read(source, |parts| channels::select(parts, Wanted::Mask, None))?;
    let colours = raster.pixels(&layer);
    let alpha = layer.alpha.map(|_| raster.planes.swap_remove(layer.colours.len()));
    Ok(Channels { width: raster.width, height: raster.height, alpha, colours })
}

/// The normals of an OpenEXR file, unchecked.
pub(super) fn normal_channels(source: &Source<'_>) -> Result<Image, ImageError> {
    let (layer, raster) = Raster::read(source, |parts| channels::select(parts, Wanted::Normals, None))?;
    Ok(Image::from_pixels(raster.width, raster.height, raster.pixels(&layer)))
}

/// The conversion from the file's chromaticities to Rec. 709; `None` if they are those of Rec. 709 or missing.
fn to_rec709(source: &Source<'_>, raster: &Raster) -> Result<Option<Mat3>, ImageError> {
    let Some(numbers) = raster.chromaticities else { return Ok(None) };
    Primaries::from_array(numbers)
        .to_rec709()
        .map_err(|_| source.malformed(FORMAT, format!("chromaticities {numbers:?} are not colour primaries")))
}

impl Raster {
    /// The planes of a layer as pixels; a single plane is grey.
    fn pixels(&self, layer: &Layer) -> Vec<[f32; 3]> {
        let [first, rest @ ..] = self.planes.as_slice() else { return Vec::new() };
        match (layer.colours.len(), rest) {
            (3, [green, blue, ..]) => first.iter().zip(green).zip(blue).map(|((&r, &g), &b)| [r, g, b]).collect(),
            _ => first.iter().map(|&grey| [grey; 3]).collect(),
        }
    }
}
