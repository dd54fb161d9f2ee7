//! TIFF 6.0 by the `tiff` crate, its first image: grey, or colour with or without straight alpha, strips or tiles, without compression or with LZW, deflate
//! or PackBits. An ICC profile is compared with sRGB, as that of a PNG.
//!
//! Float and half samples are radiance: Photoshop, Hugin and PTGui write HDR images so. Integer samples are decoded from sRGB, as those of PNG.

use super::Image;
use super::decoded::{Decoded, Encoding, Format};
use super::error::ImageError;
use super::icc;
use super::ldr::Codes;
use super::mask_channels::Channels;
use super::source::{Source, check_pixel_aspect};
use std::io::Cursor;
use tiff::{
    ColorType, TiffError,
    decoder::{Decoder, DecodingResult, Limits, ifd::Value},
    tags::Tag,
};

/// Decodes a TIFF image.
pub(super) fn decode(source: &Source<'_>) -> Result<Decoded, ImageError> {
    let mut decoded = match read(source)? {
        Content::Codes(codes) => codes.into_decoded(FORMAT, 0),
        Content::Radiance(decoded) => decoded,
    };
    let profile = profile(source);
    let contradiction = profile.as_deref().and_then(icc::contradiction);
    match (decoded.encoding, contradiction) {
        (Encoding::Srgb, Some(found)) => {
            decoded.warnings.push(format!("decoded from sRGB, but {found}: convert it to sRGB first"));
        }
        (Encoding::Linear, _) if profile.is_some() => {
            decoded.warnings.push("its ICC profile is ignored: floats are taken as linear Rec. 709".to_owned());
        }
        _ => {}
    }
    Ok(decoded)
}

/// The bytes of the ICC profile.
fn profile(source: &Source<'_>) -> Option<Vec<u8>> {
    let mut decoder = Decoder::new(Cursor::new(source.bytes)).ok()?;
    decoder.find_tag(Tag::IccProfile).ok()??.into_u8_vec().ok()
}

/// The channels of a TIFF image that may hold a mask.
pub(super) fn mask_channels(source: &Source<'_>) -> Result<Channels, ImageError> {
    Ok(match read(source)? {
        Content::Codes(codes) => Channels::from_codes(&codes),
        Content::Radiance(decoded) => Channels::from_decoded(decoded),
    })
}

/// What an image holds by the type of its samples.
enum Content {
    Codes(Codes),
    Radiance(Decoded),
}

fn read(source: &Source<'_>) -> Result<Content, ImageError> {
    let (samples, shape) = samples(source)?;
    Ok(match samples {
        DecodingResult::U8(codes) => {
            Content::Codes(shape.codes(codes.into_iter().map(u16::from).collect(), u16::from(u8::MAX)))
        }
        DecodingResult::U16(codes) => Content::Codes(shape.codes(codes, u16::MAX)),
        DecodingResult::F16(halves) => {
            Content::Radiance(shape.radiance(&halves.into_iter().map(f32::from).collect::<Vec<_>>()))
        }
        DecodingResult::F32(floats) => Content::Radiance(shape.radiance(&floats)),
        _ => {
            let advice = "write it with 32-bit floats or 16 bits per channel";
            return Err(source.unsupported(FORMAT, "this type of samples", advice));
        }
    })
}

/// Size and channels of an image.
struct Shape {
    width: usize,
    height: usize,
    colours: usize,
    has_alpha: bool,
}

impl Shape {
    fn channels(&self) -> usize {
        self.colours + usize::from(self.has_alpha)
    }

    fn radiance(&self, samples: &[f32]) -> Decoded {
        let pixels = || samples.chunks_exact(self.channels());
        let colour = |pixel: &[f32]| if self.colours == 1 { [pixel[0]; 3] } else { [pixel[0], pixel[1], pixel[2]] };
        Decoded {
            image: Image::from_pixels(self.width, self.height, pixels().map(colour).collect()),
            alpha: self.has_alpha.then(|| pixels().map(|pixel| pixel[self.colours]).collect()),
            clipped: None,
            encoding: Encoding::Linear,
            format: FORMAT,
            metadata: Vec::new(),
            warnings: Vec::new(),
        }
    }

    fn codes(self, samples: Vec<u16>, max: u16) -> Codes {
        let Self { width, height, colours, has_alpha } = self;
        Codes { width, height, colours, has_alpha, samples, max, is_reoriented: false }
    }
}

/// The samples, row by row, as many as the shape has.
fn samples(source: &Source<'_>) -> Result<(DecodingResult, Shape), ImageError> {
    let fault = |error: TiffError| match error {
        TiffError::UnsupportedError(what) => source.unsupported(
            FORMAT,
            what.to_string(),
            "write it without compression, with 32-bit floats or 16 bits per channel",
        ),
        other => source.malformed(FORMAT, other.to_string()),
    };
    // The mark of Canon's raw files.
    if source.bytes.get(8..12) == Some(b"CR\x02\0") {
        return Err(raw(source));
    }
    let mut decoder = Decoder::new(Cursor::new(source.bytes)).map_err(fault)?;
    let (width, height) = decoder.dimensions().map_err(fault)?;
    let (width, height) = source.check_size(width.into(), height.into(), FORMAT)?;
    check_tags(source, &mut decoder).map_err(|error| match error {
        TagError::Tiff(error) => fault(error),
        TagError::Image(error) => error,
    })?;
    let colour = decoder.colortype().map_err(fault)?;
    let (colours, has_alpha) = match colour {
        ColorType::Gray(_) => (1, false),
        ColorType::RGB(_) => (3, false),
        ColorType::RGBA(_) => (3, true),
        other => {
            return Err(source.unsupported(FORMAT, format!("colours of type {other:?}"), "convert it to RGB"));
        }
    };
    let bits = usize::from(colour.bit_depth());
    if ![8, 16, 32].contains(&bits) {
        let advice = "write it with 32-bit floats or 8 or 16 bits per channel";
        return Err(source.unsupported(FORMAT, format!("{bits} bits per channel"), advice));
    }
    let shape = Shape { width, height, colours, has_alpha };
    let stored = decoder.find_tag_unsigned::<u16>(Tag::SamplesPerPixel).map_err(fault)?.unwrap_or(1);
    if usize::from(stored) != shape.channels() {
        return Err(source.unsupported(FORMAT, "channels beside colour and alpha", "save it without them"));
    }
    // The sizes are known: nothing larger is decoded.
    let mut limits = Limits::default();
    limits.decoding_buffer_size = width * height * shape.channels() * bits / 8;
    limits.intermediate_buffer_size = limits.decoding_buffer_size.max(limits.intermediate_buffer_size);
    let mut decoder = decoder.with_limits(limits);
    let samples = decoder.read_image().map_err(fault)?;
    let (expected, found) = (width * height * shape.channels(), count(&samples));
    if found != expected {
        return Err(source.unsupported(
            FORMAT,
            format!("{found} samples (expected {expected})"),
            "write its channels interleaved, as one image",
        ));
    }
    Ok((samples, shape))
}

/// An error of the crate, or of what a tag says.
enum TagError {
    Tiff(TiffError),
    Image(ImageError),
}

impl From<TiffError> for TagError {
    fn from(error: TiffError) -> Self {
        Self::Tiff(error)
    }
}

/// Refuses raw files of cameras, whose first image is a small preview, images that are not upright, and pixels that are not square.
fn check_tags(source: &Source<'_>, decoder: &mut Decoder<Cursor<&[u8]>>) -> Result<(), TagError> {
    let refused = |feature: &str, advice: &str| Err(TagError::Image(source.unsupported(FORMAT, feature, advice)));
    let is_preview = decoder.find_tag_unsigned::<u32>(Tag::NewSubfileType)?.is_some_and(|kind| kind & 1 != 0);
    if is_preview || decoder.find_tag(Tag::Unknown(DNG_VERSION))?.is_some() {
        return Err(TagError::Image(raw(source)));
    }
    let extra = decoder.find_tag_unsigned_vec::<u16>(Tag::ExtraSamples)?.unwrap_or_default();
    if extra.first() == Some(&ASSOCIATED_ALPHA) {
        return refused(
            "colours that are multiplied by alpha",
            "save it with straight alpha, or over black without alpha",
        );
    }
    if decoder.find_tag_unsigned::<u16>(Tag::Orientation)?.is_some_and(|orientation| orientation > 1) {
        return refused("an image that is not stored upright", "open it and save it upright");
    }
    let mut resolution = |tag| {
        Ok::<_, TiffError>(match decoder.find_tag(tag)? {
            Some(Value::Rational(n, d)) if n > 0 && d > 0 => Some(f64::from(n) / f64::from(d)),
            _ => None,
        })
    };
    if let Some((x, y)) = resolution(Tag::XResolution)?.zip(resolution(Tag::YResolution)?) {
        check_pixel_aspect(source, FORMAT, y / x).map_err(TagError::Image)?;
    }
    Ok(())
}

fn raw(source: &Source<'_>) -> ImageError {
    source.unsupported(FORMAT, "a camera's raw image", "develop it to linear OpenEXR, without a tone curve")
}

/// Of `ExtraSamples`: alpha by which the colours are multiplied.
const ASSOCIATED_ALPHA: u16 = 1;

/// The tag that every DNG has (Adobe, *Digital Negative Specification*).
const DNG_VERSION: u16 = 50706;

fn count(samples: &DecodingResult) -> usize {
    match samples {
        DecodingResult::U8(samples) => samples.len(),
        DecodingResult::U16(samples) => samples.len(),
        DecodingResult::F16(samples) => samples.len(),
        DecodingResult::F32(samples) => samples.len(),
        _ => 0,
    }
}

const FORMAT: Format = Format::Tiff;
