//! Writes results: 32-bit float scan lines, zip compression, Rec. 709 chromaticities.

use std::io::Cursor;

use exr::math::Vec2;
use exr::meta::attribute::{AttributeValue, Chromaticities, IntegerBounds, LineOrder, Text};
use exr::meta::header::{ImageAttributes, LayerAttributes};
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image as ExrImage, Layer, WritableImage,
};

use super::header::{self, FORMAT};
use crate::image::error::ImageError;
use crate::image::{Image, metadata as keys};

/// The bytes of an OpenEXR file of `image`: channels `R G B` and, with `coverage` (one value per pixel, row-major),
/// `A`, all as 32-bit floats. With coverage the caller must premultiply the colours by it, as the format requires.
/// `metadata` becomes string attributes, sorted by key; keys as in [`crate::image::metadata`]. The same input gives the
/// same bytes. NaN and infinities are kept.
///
/// # Errors
/// If the image is empty, `coverage` has another size, or a key is empty, given twice, longer than 31 bytes, or the
/// name of one of the format's own attributes.
pub fn write(image: &Image, coverage: Option<&[f32]>, metadata: &[(String, String)]) -> Result<Vec<u8>, ImageError> {
    let pixels = image.pixels();
    if pixels.is_empty() {
        return Err(unwritable("at least one pixel", format!("{} x {}", image.width(), image.height())));
    }
    if let Some(found) = coverage.map(<[f32]>::len).filter(|&n| n != pixels.len()) {
        return Err(unwritable(&format!("{} coverage values", pixels.len()), found.to_string()));
    }
    let channel = |index: usize| FlatSamples::F32(pixels.iter().map(|pixel| pixel[index]).collect());
    let mut channels = vec![("B", channel(2)), ("G", channel(1)), ("R", channel(0))];
    channels.extend(coverage.map(|coverage| ("A", FlatSamples::F32(coverage.to_vec()))));
    let channels = channels.into_iter().map(|(name, samples)| AnyChannel::new(name, samples)).collect();

    let size = Vec2(image.width(), image.height());
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let layer = Layer::new(size, attributes(metadata)?, encoding, AnyChannels::sort(channels));
    let shared =
        ImageAttributes { chromaticities: Some(REC_709), ..ImageAttributes::new(IntegerBounds::from_dimensions(size)) };
    let mut bytes = Cursor::new(Vec::new());
    ExrImage::new(shared, layer)
        .write()
        .to_buffered(&mut bytes)
        .map_err(|error| unwritable("an image with its metadata", error.to_string()))?;
    let mut bytes = bytes.into_inner();
    header::sort_attributes(&mut bytes);
    Ok(bytes)
}

/// The metadata as attributes: the format's own attribute if there is one, else a custom attribute.
fn attributes(metadata: &[(String, String)]) -> Result<LayerAttributes, ImageError> {
    let mut attributes = LayerAttributes::default();
    for (key, value) in metadata {
        let value = encode(value);
        let fault = || unwritable("new keys of 1 to 31 bytes", format!("`{key}`"));
        let name = Text::new_or_none(key).filter(|_| (1..=31).contains(&key.len())).ok_or_else(fault)?;
        let earlier = match key.as_str() {
            keys::SOFTWARE => attributes.software_name.replace(value).is_some(),
            keys::COMMENTS => attributes.comments.replace(value).is_some(),
            _ => attributes.other.insert(name, AttributeValue::Text(value)).is_some(),
        };
        if earlier {
            return Err(fault());
        }
    }
    Ok(attributes)
}

/// Stores UTF-8, because `Text::from` panics on characters outside Latin-1.
fn encode(value: &str) -> Text {
    Text::from_slice_unchecked(value.as_bytes())
}

fn unwritable(expected: &str, found: String) -> ImageError {
    ImageError::Unwritable { format: FORMAT, expected: expected.to_owned(), found }
}

/// ITU-R BT.709 with white D65.
const REC_709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.30, 0.60),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};
