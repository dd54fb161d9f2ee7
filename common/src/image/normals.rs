//! Normal maps: world-space unit normals (right-handed, +Y up), exactly 0 on the background.

use super::decoded::Format;
use super::error::ImageError;
use super::source::Source;
use super::{Plane, openexr, pfm};
use crate::math::{Vec3, widen};

/// Decodes a normal map, see [`super::decode_normals`].
pub(super) fn decode(source: &Source<'_>) -> Result<Plane<Vec3>, ImageError> {
    let image = match source.format()? {
        Format::OpenExr => openexr::normal_channels(source)?,
        Format::Pfm => pfm::decode(source)?.image,
        other => return Err(source.unsupported(other, "a normal map", "export the normals as OpenEXR or PFM")),
    };
    let unit = |(at, pixel): (usize, &[f32; 3])| {
        let normal = widen(*pixel);
        let length = normal.length();
        if length == 0.0 {
            return Ok(Vec3::ZERO);
        }
        // Written so that NaN fails too.
        if (length - 1.0).abs() <= LENGTH_TOLERANCE {
            return Ok(normal / length);
        }
        let (column, row) = (at % image.width(), at / image.width());
        Err(ImageError::Normal { name: source.name.to_owned(), column, row, length })
    };
    let normals: Result<Vec<Vec3>, ImageError> = image.pixels().iter().enumerate().map(unit).collect();
    Ok(Plane::from_values(image.width(), image.height(), normals?))
}

/// The largest accepted difference of a normal's length from 1. The error is 0.0005 for half floats and 0.007 for
/// unpacked 8-bit normals. It is larger for normals that were filtered across an edge or are still packed into [0, 1].
pub(super) const LENGTH_TOLERANCE: f64 = 1e-2;
