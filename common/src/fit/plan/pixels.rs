//! What a plan asks of the photo: which pixels there are, with which values.

use super::index;
use crate::{
    math::{luminance, widen},
    render::{
        subset::{self, PixelSubset},
        transport::{Pixel, tile_order},
    },
    scene::Capture,
};

/// The photo's values at the pixels of a subset, in its order.
pub(super) fn photo_at(capture: &Capture, subset: &PixelSubset) -> Vec<[f32; 3]> {
    subset.pixels.iter().map(|p| capture.photo().pixel(p[0] as usize, p[1] as usize)).collect()
}

/// The usable pixels with their luminance.
pub(super) fn intensities(capture: &Capture) -> Vec<subset::Candidate> {
    let (photo, width) = (capture.photo(), capture.photo().width());
    let candidate = |i: usize| subset::Candidate {
        pixel: [index(i % width), index(i / width)],
        intensity: luminance(widen(photo.pixels()[i])).max(0.0),
    };
    capture.usable().map(candidate).collect()
}

/// The pixels that count for the score, tile by tile, so that neighbours share cuts of the light.
pub(super) fn covered_pixels(capture: &Capture) -> Vec<Pixel> {
    let width = capture.photo().width();
    let coverage = capture.scoring_coverage();
    let covered = coverage.iter().enumerate().filter(|(_, c)| **c > 0.0);
    let mut pixels: Vec<Pixel> = covered.map(|(i, _)| [index(i % width), index(i / width)]).collect();
    pixels.sort_by_key(|pixel| tile_order(*pixel));
    pixels
}
