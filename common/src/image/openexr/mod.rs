//! OpenEXR (*OpenEXR File Layout*), through the `exr` crate: half, float and unsigned-integer channels (integers above
//! 2^24 round), scan lines or tiles, one or more parts, every compression but the JPEG 2000 and Zstandard ones.
//!
//! - The image is the display window. The data window is placed in it: outside it is 0, and pixels beyond the display
//!   window are dropped; both are warnings.
//! - The first part with `R G B` is read, its unnamed layer before named ones; without any, the first `Y` as grey.
//! - `chromaticities` other than Rec. 709 are converted.
//! - Colours with alpha are premultiplied, as the format demands, and stay so.
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
    let (layer, mut raster) = Raster::read(source, |parts| channels::select(parts, Wanted::Colours))?;
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

/// What an OpenEXR file offers for a mask: its colours, else its only channel.
pub(super) fn mask_channels(source: &Source<'_>) -> Result<Channels, ImageError> {
    let (layer, mut raster) = Raster::read(source, |parts| channels::select(parts, Wanted::Mask))?;
    let colours = raster.pixels(&layer);
    let alpha = layer.alpha.map(|_| raster.planes.swap_remove(layer.colours.len()));
    Ok(Channels { width: raster.width, height: raster.height, alpha, colours })
}

/// The normals of an OpenEXR file, as they are.
pub(super) fn normal_channels(source: &Source<'_>) -> Result<Image, ImageError> {
    let (layer, raster) = Raster::read(source, |parts| channels::select(parts, Wanted::Normals))?;
    Ok(Image::from_pixels(raster.width, raster.height, raster.pixels(&layer)))
}

/// The conversion that the file's chromaticities call for.
fn to_rec709(source: &Source<'_>, raster: &Raster) -> Result<Option<Mat3>, ImageError> {
    let Some(numbers) = raster.chromaticities else { return Ok(None) };
    Primaries::from_array(numbers)
        .to_rec709()
        .map_err(|_| source.malformed(FORMAT, format!("chromaticities {numbers:?} are no colour primaries")))
}

impl Raster {
    /// The planes of a layer as pixels, one plane as grey.
    fn pixels(&self, layer: &Layer) -> Vec<[f32; 3]> {
        let [first, rest @ ..] = self.planes.as_slice() else { return Vec::new() };
        match (layer.colours.len(), rest) {
            (3, [green, blue, ..]) => first.iter().zip(green).zip(blue).map(|((&r, &g), &b)| [r, g, b]).collect(),
            _ => first.iter().map(|&grey| [grey; 3]).collect(),
        }
    }
}
