//! Images of 8 or 16-bit codes (PNG, JPEG, TIFF), and their conversion to linear radiance or to coverage.

use image::{DynamicImage, ImageDecoder};

use super::decoded::{Decoded, Encoding, Format};
use super::error::ImageError;
use super::source::Source;
use super::{Image, srgb};
use crate::math::to_f32;

/// Codes as stored, after Exif orientation.
#[derive(Debug)]
pub(super) struct Codes {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Colour channels: 1 or 3.
    pub(super) colours: usize,
    pub(super) has_alpha: bool,
    /// All channels of a pixel, alpha last; row-major, top left first.
    pub(super) samples: Vec<u16>,
    /// The largest code: 255 or 65535.
    pub(super) max: u16,
    /// Whether an Exif orientation other than upright was applied.
    pub(super) is_reoriented: bool,
}

impl Codes {
    /// Decodes all pixels. Checks the size in the header first.
    pub(super) fn read(
        source: &Source<'_>,
        format: Format,
        mut decoder: impl ImageDecoder,
    ) -> Result<Self, ImageError> {
        let (width, height) = decoder.dimensions();
        source.check_size(width.into(), height.into(), format)?;
        let fault = |error: image::ImageError| source.malformed(format, error.to_string());
        let orientation = decoder.orientation().map_err(fault)?;
        let mut image = DynamicImage::from_decoder(decoder).map_err(fault)?;
        image.apply_orientation(orientation);
        Self::from_image(image, orientation != image::metadata::Orientation::NoTransforms)
            .ok_or_else(|| source.unsupported(format, "this pixel type", "convert it to 8 or 16 bits per channel"))
    }

    fn from_image(image: DynamicImage, is_reoriented: bool) -> Option<Self> {
        let (width, height) = (image.width() as usize, image.height() as usize);
        let colour = image.color();
        let has_alpha = colour.has_alpha();
        let colours = usize::from(colour.channel_count()) - usize::from(has_alpha);
        let widen = |bytes: Vec<u8>| (bytes.into_iter().map(u16::from).collect(), 255);
        let (samples, max) = match image {
            DynamicImage::ImageLuma8(buffer) => widen(buffer.into_raw()),
            DynamicImage::ImageLumaA8(buffer) => widen(buffer.into_raw()),
            DynamicImage::ImageRgb8(buffer) => widen(buffer.into_raw()),
            DynamicImage::ImageRgba8(buffer) => widen(buffer.into_raw()),
            DynamicImage::ImageLuma16(buffer) => (buffer.into_raw(), u16::MAX),
            DynamicImage::ImageLumaA16(buffer) => (buffer.into_raw(), u16::MAX),
            DynamicImage::ImageRgb16(buffer) => (buffer.into_raw(), u16::MAX),
            DynamicImage::ImageRgba16(buffer) => (buffer.into_raw(), u16::MAX),
            _ => return None,
        };
        Some(Self { width, height, colours, has_alpha, samples, max, is_reoriented })
    }

    /// The pixels, each with all its channels, alpha last.
    pub(super) fn pixels(&self) -> std::slice::ChunksExact<'_, u16> {
        self.samples.chunks_exact(self.colours + usize::from(self.has_alpha))
    }

    /// The code as a fraction of the largest code, in [0, 1].
    pub(super) fn fraction(&self, code: u16) -> f32 {
        to_f32(f64::from(code) / f64::from(self.max))
    }

    /// Decodes from sRGB. A pixel with a code within `clip_margin` of the largest is marked as clipped.
    pub(super) fn into_decoded(self, format: Format, clip_margin: u16) -> Decoded {
        let linear: Vec<f32> =
            (0..=self.max).map(|code| to_f32(srgb::to_linear(f64::from(code) / f64::from(self.max)))).collect();
        let limit = self.max - clip_margin;
        let colour = |pixel: &[u16]| if self.colours == 1 { [pixel[0]; 3] } else { [pixel[0], pixel[1], pixel[2]] };
        let pixels = self.pixels().map(|pixel| colour(pixel).map(|code| linear[usize::from(code)])).collect();
        let clipped = self.pixels().map(|pixel| colour(pixel).iter().any(|&code| code >= limit)).collect();
        let alpha = self.has_alpha.then(|| self.pixels().map(|pixel| self.fraction(pixel[self.colours])).collect());
        let mut warnings = Vec::new();
        if self.is_reoriented {
            warnings
                .push("rotated or mirrored by its Exif orientation: pixel coordinates are those after it".to_owned());
        }
        Decoded {
            image: Image::from_pixels(self.width, self.height, pixels),
            alpha,
            clipped: Some(clipped),
            encoding: Encoding::Srgb,
            format,
            metadata: Vec::new(),
            warnings,
        }
    }
}
