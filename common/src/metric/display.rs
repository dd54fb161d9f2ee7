//! The display transform, from an HDR image to an image on an sRGB display.
//!
//! displayed = encode(clip(exposure x coverage x radiance, 0, 1)), where encode is the sRGB transfer function of IEC
//! 61966-2-1. The coverage is applied before encoding, because a pixel that the object covers by half shows half the
//! object's radiance over a black background.

use super::MetricError;
use crate::image::Image;
use crate::math::elementary::pow;
use crate::math::{cell, real::Real, widen};

/// An sRGB-encoded image in double precision: `height x width x 3`, row-major, top left first.
#[derive(Debug, Clone, PartialEq)]
pub struct DisplayImage {
    width: usize,
    height: usize,
    pixels: Vec<[f64; 3]>,
}

impl DisplayImage {
    /// An image from encoded values, nominally in [0, 1] (the metric does not clip them).
    ///
    /// # Errors
    /// [`MetricError::Length`] if `pixels.len() != width * height`; [`MetricError::NotFinite`].
    #[cfg(test)]
    pub(super) fn from_encoded(width: usize, height: usize, pixels: Vec<[f64; 3]>) -> Result<Self, MetricError> {
        if pixels.len() != width * height {
            return Err(MetricError::Length { what: "pixel buffer", expected: width * height, found: pixels.len() });
        }
        check_finite("image", width, pixels.iter().copied())?;
        Ok(Self { width, height, pixels })
    }

    /// The display transform of a linear Rec. 709 image at `exposure`, after multiplication by `coverage` (one value in
    /// [0, 1] per pixel). Pixels of coverage 0 become black, whatever their value.
    ///
    /// # Errors
    /// [`MetricError::Exposure`], [`MetricError::Length`], [`MetricError::Coverage`], [`MetricError::NotFinite`].
    pub fn from_linear(image: &Image, coverage: &[f32], exposure: f64) -> Result<Self, MetricError> {
        let (width, height) = (image.width(), image.height());
        check_exposure(exposure)?;
        check_coverage(coverage, width, height)?;
        check_covered_finite("image", image, coverage)?;
        let shown = |(&pixel, &covered): (&[f32; 3], &f32)| {
            let gain = f64::from(covered) * exposure;
            widen(pixel).to_array().map(|x| encode_srgb(expose(x, gain)))
        };
        let pixels = image.pixels().iter().zip(coverage).map(shown).collect();
        Ok(Self { width, height, pixels })
    }

    /// An image of another size. `pixels` must be finite and have one entry per pixel.
    pub(super) fn resized(&self, width: usize, height: usize, pixels: Vec<[f64; 3]>) -> Self {
        debug_assert_eq!(pixels.len(), width * height);
        Self { width, height, pixels }
    }

    /// Columns.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// All pixels, sRGB-encoded, row-major, top left first.
    #[must_use]
    pub fn pixels(&self) -> &[[f64; 3]] {
        &self.pixels
    }
}

/// The exposure that brings the 97th percentile of the object's largest channel to 0.9 (linear, before encoding).
///
/// The percentile is by nearest rank: the n pixels of coverage 1 are sorted by the largest of red, green and blue, and
/// number `ceil(0.97 n)`, counted from 1, is taken.
///
/// # Errors
/// [`MetricError::Length`], [`MetricError::Coverage`]; [`MetricError::NotFinite`] in a covered pixel;
/// [`MetricError::NoAutoExposure`] if no pixel is fully covered or the percentile is not positive.
pub fn auto_exposure(photo: &Image, coverage: &[f32]) -> Result<f64, MetricError> {
    check_coverage(coverage, photo.width(), photo.height())?;
    check_covered_finite("photo", photo, coverage)?;
    let object = photo.pixels().iter().zip(coverage).filter(|&(_, &covered)| covered >= 1.0);
    let mut largest: Vec<f64> = object.map(|(&pixel, _)| widen(pixel).max_element()).collect();
    largest.sort_by(f64::total_cmp);
    let rank = cell((AUTO_PERCENTILE * largest.len() as f64).ceil() - 1.0, largest.len());
    let percentile = largest.get(rank).copied().unwrap_or(0.0);
    if percentile > 0.0 {
        Ok(AUTO_TARGET / percentile)
    } else {
        Err(MetricError::NoAutoExposure { pixels: largest.len(), percentile })
    }
}

/// Fraction of the object's pixels that automatic exposure keeps at or below [`AUTO_TARGET`].
const AUTO_PERCENTILE: f64 = 0.97;
/// Linear display value of the percentile after automatic exposure.
const AUTO_TARGET: f64 = 0.9;

/// sRGB value in [0, 1] of a linear value in [0, 1].
#[must_use]
pub fn encode_srgb(linear: f64) -> f64 {
    if linear <= ENCODE_THRESHOLD { 12.92 * linear.max(0.0) } else { 1.055 * pow(linear, 1.0 / 2.4) - 0.055 }
}

/// Linear value of an sRGB value. The linear part continues below 0.
#[must_use]
pub fn decode_srgb(encoded: f64) -> f64 {
    if encoded <= DECODE_THRESHOLD { encoded / 12.92 } else { pow((encoded + 0.055) / 1.055, 2.4) }
}

/// The end of the linear part in the authors' program (`colorspace.m`): 0.0404482... encoded, where the standard has
/// 0.04045.
const DECODE_THRESHOLD: f64 = 0.040_448_236_277_107_6;
const ENCODE_THRESHOLD: f64 = 0.003_130_668_442_500_588_3;

/// A linear display value: exposed and clipped. A gain of 0 gives 0, also for NaN.
#[inline(always)]
pub(super) fn expose<R: Real>(radiance: R, gain: R) -> R {
    let exposed = if gain > R::ZERO { radiance * gain } else { R::ZERO };
    exposed.clamped(0.0, 1.0)
}

pub(super) fn check_exposure(exposure: f64) -> Result<(), MetricError> {
    if exposure.is_finite() && exposure > 0.0 { Ok(()) } else { Err(MetricError::Exposure(exposure)) }
}

pub(super) fn check_coverage(coverage: &[f32], width: usize, height: usize) -> Result<(), MetricError> {
    if coverage.len() != width * height {
        return Err(MetricError::Length { what: "coverage", expected: width * height, found: coverage.len() });
    }
    match coverage.iter().position(|c| !(0.0..=1.0).contains(c)) {
        Some(i) => Err(MetricError::Coverage { column: i % width, row: i / width, value: coverage[i] }),
        None => Ok(()),
    }
}

/// Fails on the first covered pixel with a channel that is NaN or infinite.
pub(super) fn check_covered_finite(what: &'static str, image: &Image, coverage: &[f32]) -> Result<(), MetricError> {
    // Most images are finite everywhere: one pass that becomes vector code.
    let exponents = image.pixels().as_flattened().iter().map(|x| x.to_bits() & f32::INFINITY.to_bits());
    if exponents.max() < Some(f32::INFINITY.to_bits()) {
        return Ok(());
    }
    let covered = image.pixels().iter().zip(coverage);
    let seen = covered.map(|(&pixel, &c)| if c > 0.0 { widen(pixel).to_array() } else { [0.0; 3] });
    check_finite(what, image.width(), seen)
}

fn check_finite(what: &'static str, width: usize, pixels: impl Iterator<Item = [f64; 3]>) -> Result<(), MetricError> {
    for (i, pixel) in pixels.enumerate() {
        if let Some(channel) = pixel.iter().position(|x| !x.is_finite()) {
            let value = pixel[channel];
            return Err(MetricError::NotFinite { what, column: i % width, row: i / width, channel, value });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoding_and_decoding_are_inverse() {
        for i in 0..=1000 {
            let linear = f64::from(i) / 1000.0;
            assert!((decode_srgb(encode_srgb(linear)) - linear).abs() < 1e-15, "{linear}");
        }
        assert_eq!((encode_srgb(0.0), encode_srgb(-1.0), decode_srgb(0.0)), (0.0, 0.0, 0.0));
        assert!((encode_srgb(1.0) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn auto_exposure_uses_the_nearest_rank_of_the_largest_channel_over_the_object() {
        // 100 object pixels hold 1..=100 in alternating channels: rank 97 is 97. A partly covered pixel is not counted.
        let mut pixels = vec![[1e6, 0.0, 0.0]; 102];
        for (i, pixel) in pixels.iter_mut().take(100).enumerate() {
            *pixel = [0.5; 3];
            pixel[i % 3] = 100.0 - f32::from(u8::try_from(i).unwrap());
        }
        let mut coverage = vec![1.0; 102];
        coverage[100..].copy_from_slice(&[0.5, 0.0]);
        let exposure = auto_exposure(&Image::from_pixels(102, 1, pixels), &coverage).unwrap();
        assert_eq!(exposure, 0.9 / 97.0);
    }

    #[test]
    fn auto_exposure_without_light_is_an_error() {
        let black = Image::new(3, 2);
        let none = auto_exposure(&black, &[0.5; 6]).unwrap_err();
        assert_eq!(none, MetricError::NoAutoExposure { pixels: 0, percentile: 0.0 });
        assert!(auto_exposure(&black, &[1.0; 6]).unwrap_err().to_string().contains("of 6 pixels of full coverage"));
    }

    #[test]
    fn a_display_image_is_covered_exposed_and_clipped() {
        let image = Image::from_pixels(2, 2, vec![[0.5, -1.0, 9.0], [f32::NAN; 3], [0.5; 3], [0.25; 3]]);
        let shown = DisplayImage::from_linear(&image, &[1.0, 0.0, 0.5, 1.0], 2.0).unwrap();
        assert_eq!(shown.pixels()[..2], [[encode_srgb(1.0), 0.0, encode_srgb(1.0)], [0.0; 3]]);
        assert_eq!(shown.pixels()[2], shown.pixels()[3]);
    }

    #[test]
    fn invalid_pixels_are_reported_with_their_coordinates() {
        let mut image = Image::new(3, 2);
        image.pixels_mut()[5][1] = f32::INFINITY;
        let message = DisplayImage::from_linear(&image, &[1.0; 6], 1.0).unwrap_err().to_string();
        assert!(message.contains("found inf in channel 1 at column 2, row 1"), "{message}");
        let message = DisplayImage::from_linear(&image, &[1.0, 1.0, 1.0, 1.5, 1.0, 1.0], 1.0).unwrap_err().to_string();
        assert!(message.contains("found 1.5 at column 0, row 1"), "{message}");
        assert!(DisplayImage::from_linear(&image, &[0.0; 6], f64::NAN).is_err());
    }
}
