//! Coverage masks: 1 on the object, 0 outside, in between on the silhouette. Values are linear as stored: the code of a
//! PNG or JPEG divided by its maximum, without sRGB decoding.

use super::decoded::Format;
use super::error::ImageError;
use super::mask_channels::Channels;
use super::source::Source;
use super::{Plane, jpeg, openexr, pfm, png, rgbe, tiff};

/// Decodes a mask, see [`super::decode_mask`].
pub(super) fn decode(source: &Source<'_>) -> Result<Plane<f32>, ImageError> {
    let channels = match source.format()? {
        Format::OpenExr => openexr::mask_channels(source)?,
        Format::RadianceHdr => Channels::from_decoded(rgbe::decode(source)?),
        Format::Pfm => Channels::from_decoded(pfm::decode(source)?),
        Format::Png => Channels::from_codes(&png::read(source)?.0),
        Format::Tiff => tiff::mask_channels(source)?,
        Format::Jpeg => Channels::from_codes(&jpeg::read(source)?.0),
    };
    channels.into_plane(source)
}
