//! A photo with its geometry and its light: which pixels show the object, and which of them a fit may use.

use super::{Geometry, Mask, PixelCounts, PixelStatus, SceneError, limits::LEAST_SIDE, plateau};
use crate::image::Image;
use crate::light::Environment;
use crate::math::{luminance, widen};
use rayon::prelude::*;
use std::sync::Arc;

/// A photo, its geometry and its light, checked against each other.
#[derive(Debug, Clone)]
pub struct Capture {
    photo: Image,
    geometry: Geometry,
    environment: Arc<Environment>,
    coverage: Vec<f32>,
    status: Vec<PixelStatus>,
    counts: PixelCounts,
    has_background: bool,
    clipped_at: Option<f32>,
    warnings: Vec<String>,
}

/// The parts of a [`Capture`].
#[derive(Debug, Clone)]
pub struct CaptureInput {
    /// The photo: linear Rec. 709.
    pub photo: Image,
    /// Whether each pixel is clipped, if the file format limits values.
    pub clipped: Option<Vec<bool>>,
    /// The part of the photo that is the object; given for photos with a background.
    pub mask: Option<Mask>,
    /// The object's shape and place.
    pub geometry: Geometry,
    /// The light.
    pub environment: Arc<Environment>,
}

impl Capture {
    /// Checks the parts against each other and classifies every pixel.
    ///
    /// Pixels of the photo that are not finite are excluded from fit and score: their coverage is 0. They are stored as
    /// black, because NaN times a coverage of 0 would still be NaN.
    ///
    /// # Errors
    /// [`SceneError::TooSmall`], [`SceneError::Size`] when mask or geometry have another size than the photo,
    /// [`SceneError::NotFinite`] when more than half of the object's pixels are not finite,
    /// [`SceneError::NothingUsable`] and [`SceneError::Black`].
    ///
    /// # Panics
    /// If `clipped` has another length than the photo has pixels.
    pub fn new(input: CaptureInput) -> Result<Self, SceneError> {
        let CaptureInput { mut photo, clipped, mask, geometry, environment } = input;
        let (width, height) = (photo.width(), photo.height());
        if width < LEAST_SIDE || height < LEAST_SIDE {
            return Err(SceneError::TooSmall { width, height });
        }
        check_size("geometry", &photo, [geometry.width(), geometry.height()])?;
        if let Some(mask) = &mask {
            check_size("mask", &photo, [mask.width(), mask.height()])?;
        }
        if let Some(clipped) = &clipped {
            assert_eq!(clipped.len(), width * height, "clipping flags of a {width} x {height} photo");
        }
        let (mut coverage, mut status) = classify(&photo, clipped.as_deref(), mask.as_ref(), &geometry);
        let clipped_at = clip(&photo, &mut status);
        check_finite(&photo, &coverage, &status)?;
        for (index, pixel) in photo.pixels_mut().iter_mut().enumerate() {
            if !is_finite(*pixel) {
                *pixel = [0.0; 3];
                coverage[index] = 0.0;
            }
        }
        let counts = PixelCounts::of(&status);
        if counts.usable == 0 {
            return Err(SceneError::NothingUsable(counts));
        }
        let means = Means::of(&photo, &status);
        if means.is_black {
            return Err(SceneError::Black { count: counts.usable });
        }
        let is_lit_outside = mask.is_none() && means.outside > BACKGROUND * means.usable;
        let has_background = mask.is_some() || is_lit_outside;
        let mut capture = Self {
            photo,
            geometry,
            environment,
            coverage,
            status,
            counts,
            has_background,
            clipped_at,
            warnings: Vec::new(),
        };
        capture.warnings = capture.collect_warnings(is_lit_outside);
        Ok(capture)
    }

    /// The photo: linear Rec. 709, with black where it was not finite.
    #[must_use]
    pub fn photo(&self) -> &Image {
        &self.photo
    }

    /// The object's shape and place.
    #[must_use]
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The light.
    #[must_use]
    pub fn environment(&self) -> &Arc<Environment> {
        &self.environment
    }

    /// The fraction of each pixel that the object covers, in \[0, 1\]: geometric coverage times mask, 0 where the photo
    /// is not finite; `height x width`, row-major.
    #[must_use]
    pub fn coverage(&self) -> &[f32] {
        &self.coverage
    }

    /// The status of each pixel; `height x width`, row-major.
    #[must_use]
    pub fn status(&self) -> &[PixelStatus] {
        &self.status
    }

    /// How many pixels have each status.
    #[must_use]
    pub fn counts(&self) -> PixelCounts {
        self.counts
    }

    /// The row-major indices of the usable pixels, ascending.
    pub fn usable(&self) -> impl Iterator<Item = usize> + '_ {
        self.status.iter().enumerate().filter(|(_, status)| **status == PixelStatus::Usable).map(|(index, _)| index)
    }

    /// Whether the photo has a background other than black: a mask was given, or the photo is not black outside the
    /// object.
    #[must_use]
    pub fn has_background(&self) -> bool {
        self.has_background
    }

    /// The factor of each pixel of photo and rendering before they are scored (design section 6); a pixel of factor 0
    /// is not scored. For a photo over black it is the coverage. For a photo with a background it is 1 where the
    /// coverage is full and 0 elsewhere, because an edge pixel also shows the background.
    #[must_use]
    pub fn scoring_coverage(&self) -> Vec<f32> {
        let kept = |&coverage: &f32| if !self.has_background || coverage == 1.0 { coverage } else { 0.0 };
        self.coverage.iter().map(kept).collect()
    }

    /// The lowest level, of any channel, at which the photo's values were cut off: 1 for formats that limit values, if any pixel is at the limit.
    #[must_use]
    pub fn clipped_at(&self) -> Option<f32> {
        self.clipped_at
    }

    /// Warnings about the photo that the user should read before trusting a fit.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    fn collect_warnings(&self, is_lit_outside: bool) -> Vec<String> {
        let counts = self.counts;
        let mut warnings = self.geometry.normal_map().map_or_else(Vec::new, |map| map.warnings().to_vec());
        let mut warn = |applies: bool, text: String| {
            if applies {
                warnings.push(text);
            }
        };
        let cut = self.geometry.circle().is_some_and(|circle| !circle.fits(self.photo.width(), self.photo.height()));
        warn(cut, "a part of the sphere lies outside the photo: only the visible part is fitted".to_owned());
        warn(
            is_lit_outside,
            "the photo is not black around the object: edge pixels are excluded from the score; give --mask to mark the \
             pixels of the object"
                .to_owned(),
        );
        warn(
            counts.not_finite > 0,
            format!("{} not finite: excluded from fit and score", object_pixels(counts.not_finite)),
        );
        warn(
            counts.clipped > 0,
            format!(
                "{} clipped (the photo ends at {}): excluded from the fit, kept in the score",
                object_pixels(counts.clipped),
                self.clipped_at.unwrap_or(1.0)
            ),
        );
        warn(
            counts.usable < FEW_PIXELS,
            format!("usable pixels: {}; a reliable fit needs at least {FEW_PIXELS}", counts.usable),
        );
        let too_bright = self.count_brighter_than_light();
        warn(
            1000 * too_bright > counts.usable,
            format!(
                "{} brighter than the brightest light of the map, which is impossible for a material: if photo and map \
                 have different exposures, scale one of them to the exposure of the other",
                object_pixels(too_bright)
            ),
        );
        warnings
    }

    /// The number of usable pixels that are brighter, in any channel, than a perfect mirror could be.
    fn count_brighter_than_light(&self) -> usize {
        let limit = self.environment.max_radiance() * 1.01;
        self.usable().filter(|&index| widen(self.photo.pixels()[index]).cmpgt(limit).any()).count()
    }
}

/// Coverage and status of every pixel. The coverage still includes pixels that are not finite.
fn classify(
    photo: &Image,
    clipped: Option<&[bool]>,
    mask: Option<&Mask>,
    geometry: &Geometry,
) -> (Vec<f32>, Vec<PixelStatus>) {
    let width = photo.width();
    let one = |index: usize| {
        let (column, row) = (index % width, index / width);
        let shape = geometry.coverage(column, row);
        let mask = mask.map_or(1.0, |mask| mask.coverage()[index]);
        let status = if shape == 0.0 {
            PixelStatus::Outside
        } else if mask == 0.0 {
            PixelStatus::Masked
        } else if !is_finite(photo.pixels()[index]) {
            PixelStatus::NotFinite
        } else if shape < 1.0 || geometry.normal_map().is_some_and(|map| !map.is_interior(column, row)) {
            PixelStatus::Silhouette
        } else if mask < 1.0 {
            PixelStatus::Masked
        } else if clipped.is_some_and(|clipped| clipped[index]) {
            PixelStatus::Clipped
        } else {
            PixelStatus::Usable
        };
        (shape * mask, status)
    };
    (0..photo.pixels().len()).into_par_iter().with_min_len(width).map(one).unzip()
}

/// Marks usable pixels as clipped where a channel is at the level at which it was cut off; returns the lowest of these levels, and of those of pixels
/// that were marked before.
fn clip(photo: &Image, status: &mut [PixelStatus]) -> Option<f32> {
    let values = |c: usize| {
        let usable = photo.pixels().iter().zip(&*status).filter(|(_, status)| **status == PixelStatus::Usable);
        usable.map(move |(pixel, _)| pixel[c])
    };
    let mut levels = [0, 1, 2].map(|c| plateau(values(c)));
    // The even reflection of a lamp has other levels in each channel.
    let found: Vec<f32> = levels.into_iter().flatten().collect();
    if found.iter().any(|level| (level / found[0] - 1.0).abs() > SAME_LEVEL) {
        levels = [None; 3];
    }
    let was_marked = status.contains(&PixelStatus::Clipped);
    let is_cut_off =
        |pixel: &[f32; 3]| levels.iter().zip(pixel).any(|(level, x)| level.is_some_and(|level| *x >= level));
    for (status, pixel) in status.iter_mut().zip(photo.pixels()) {
        if *status == PixelStatus::Usable && is_cut_off(pixel) {
            *status = PixelStatus::Clipped;
        }
    }
    levels.into_iter().flatten().chain(was_marked.then_some(1.0)).reduce(f32::min)
}

/// Levels of channels that differ by up to this share are one level.
const SAME_LEVEL: f32 = 1e-3;

/// "1 pixel of the object is", "2 pixels of the object are".
fn object_pixels(count: usize) -> String {
    if count == 1 { "1 pixel of the object is".to_owned() } else { format!("{count} pixels of the object are") }
}

fn is_finite(pixel: [f32; 3]) -> bool {
    pixel.iter().all(|x| x.is_finite())
}

fn check_size(what: &'static str, photo: &Image, [found_width, found_height]: [usize; 2]) -> Result<(), SceneError> {
    let (width, height) = (photo.width(), photo.height());
    if (found_width, found_height) == (width, height) {
        Ok(())
    } else {
        Err(SceneError::Size { what, width, height, found_width, found_height })
    }
}

fn check_finite(photo: &Image, coverage: &[f32], status: &[PixelStatus]) -> Result<(), SceneError> {
    let total = coverage.iter().filter(|&&coverage| coverage > 0.0).count();
    let is_bad = |status: &&PixelStatus| **status == PixelStatus::NotFinite;
    let count = status.iter().filter(is_bad).count();
    match status.iter().position(|status| is_bad(&status)) {
        Some(first) if 2 * count > total => {
            let (column, row) = (first % photo.width(), first / photo.width());
            Err(SceneError::NotFinite { count, total, column, row })
        }
        _ => Ok(()),
    }
}

/// Mean luminances of parts of the photo.
struct Means {
    usable: f64,
    outside: f64,
    /// Whether every channel of every usable pixel is 0 or less.
    is_black: bool,
}

impl Means {
    fn of(photo: &Image, status: &[PixelStatus]) -> Self {
        let mean = |wanted: PixelStatus| {
            let (mut sum, mut count) = (0.0, 0.0);
            for (pixel, status) in photo.pixels().iter().zip(status) {
                if *status == wanted {
                    sum += luminance(widen(*pixel));
                    count += 1.0;
                }
            }
            sum / f64::max(count, 1.0)
        };
        let is_lit = |(pixel, status): (&[f32; 3], &PixelStatus)| {
            *status == PixelStatus::Usable && pixel.iter().any(|&x| x > 0.0)
        };
        Self {
            usable: mean(PixelStatus::Usable),
            outside: mean(PixelStatus::Outside),
            is_black: !photo.pixels().iter().zip(status).any(is_lit),
        }
    }
}

/// Mean luminance outside the object, relative to the object, above which the photo has a background.
const BACKGROUND: f64 = 0.01;

/// The number of pixels that the paper draws for stage one.
const FEW_PIXELS: usize = 256;

#[cfg(test)]
mod tests;
