//! CSSIM: the colour-image-difference measure CID of Lissner, Preiss, Urban, Scheller Lichtenauer & Zolliker,
//! *Image-Difference Prediction: From Grayscale to Color* (IEEE TIP 22(2), 2013), with the authors' defaults.
//!
//! Both images are multiplied by the coverage, exposed and clipped to the display range. They are filtered by S-CIELAB
//! at 20 cycles per degree, converted to LAB2000HL, and compared in 11 x 11 Gaussian windows by five features:
//! lightness, contrast, structure, chroma and hue. Each feature is averaged over all windows, and
//!
//! CSSIM = 1 - mean(l_L) mean(c_L) mean(s_L) mean(l_C) mean(l_H): 0 for identical images, above 1 for inverted ones.
//!
//! [`Judge`] scores many images against one reference. It omits encoding to sRGB and decoding, which cancel (scores
//! agree with [`super::cid`] to 1e-12). Sums run in a fixed order: the bits do not depend on the number of threads, the
//! vector instructions or the size of the black border around the object.

use super::blocks::Blocks;
use super::differences::{Differences, Reference};
use super::dispatch::Lanes;
use super::display::{check_coverage, check_covered_finite, check_exposure, expose};
use super::features::{FEATURES, row_sum, weighted_row_sum};
use super::maps::{ErrorMap, Maps};
use super::planes::Planes;
use super::region::Region;
use super::row_math::RowMath;
use super::spans::Spans;
use super::window::{RADIUS, SIZE, Window};
use super::working::{Pipeline, SpatialFilter};
use super::{Lab2000hl, MetricError};
use crate::image::Image;
use std::{
    ops::Range,
    sync::{Mutex, MutexGuard, PoisonError},
};

/// Settings of a [`Judge`].
#[derive(Debug, Clone)]
pub struct JudgeOptions {
    /// Viewing distance: half the pixels per degree of visual angle, in [1, 500]. Default 20, the authors'.
    pub cycles_per_degree: f64,
    /// The working space. Default `fit00`.
    pub space: Lab2000hl,
    /// The vector instructions to use. They do not change the result.
    pub lanes: Lanes,
}

impl Default for JudgeOptions {
    fn default() -> Self {
        Self { cycles_per_degree: 20.0, space: Lab2000hl::fit00(), lanes: Lanes::Detected }
    }
}

/// The difference of an image from the reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// CSSIM over all windows of the image, as in the paper. 0 for identical images; larger is worse.
    pub cssim: f64,
    /// CSSIM over the windows whose centre pixel has a coverage above 0.
    pub cssim_object: f64,
    /// Means over the image of the features l_L, c_L, s_L, l_C, l_H; 1 is equal.
    pub features: [f64; 5],
    /// Means over the object of the same features.
    pub features_object: [f64; 5],
}

/// A reference, prepared to score many images against it. Reported scores are computed in `f64`; a judge in `f32` is for searches.
#[derive(Debug)]
pub struct Judge<R = f64> {
    region: Region,
    spans: Spans,
    coverage: Vec<f32>,
    /// Exposure times coverage for every pixel of the region.
    gain: Planes<R, 1>,
    /// 1 for windows of the region whose centre is covered, else 0.
    object: Planes<R, 1>,
    object_windows: usize,
    pipeline: Pipeline<R>,
    reference: Reference<R>,
    /// Buffers of finished comparisons: new pages of memory would take up to a third of a score.
    buffers: Mutex<Vec<Buffers<R>>>,
}

/// Planes of the filter's space, and the differences.
type Buffers<R> = (Planes<R, 3>, Differences<R>);

impl Judge {
    /// Prepares a reference.
    ///
    /// `reference`: linear Rec. 709. `coverage`: one value in [0, 1] per pixel, row-major; both images are multiplied
    /// by it, and values of pixels with coverage 0 are ignored. `exposure`: factor of the display transform, the same
    /// for both images.
    ///
    /// # Errors
    /// [`MetricError::TooSmall`] below 11 x 11 pixels; [`MetricError::Length`], [`MetricError::Coverage`],
    /// [`MetricError::NotFinite`] and [`MetricError::Exposure`] for bad values; [`MetricError::NoObject`] if no window
    /// is centred on a covered pixel; [`MetricError::CyclesPerDegree`].
    pub fn new(
        reference: &Image,
        coverage: &[f32],
        exposure: f64,
        options: &JudgeOptions,
    ) -> Result<Self, MetricError> {
        Self::over(reference, coverage, exposure, options, around)
    }
}

impl Judge<f32> {
    /// As [`Judge::new`], in single precision: scores differ from those in double precision by at most 2e-6, and take about half the time.
    ///
    /// # Errors
    /// As [`Judge::new`].
    pub fn single(
        reference: &Image,
        coverage: &[f32],
        exposure: f64,
        options: &JudgeOptions,
    ) -> Result<Self, MetricError> {
        Self::over(reference, coverage, exposure, options, around)
    }
}

#[allow(private_bounds, reason = "`f64` and `f32`, made by `new` and `single`")]
impl<R: RowMath> Judge<R> {
    /// As [`Judge::new`], over the region and spans that `region` returns for (coverage, width, height, reach of the filter).
    fn over(
        reference: &Image,
        coverage: &[f32],
        exposure: f64,
        options: &JudgeOptions,
        region: impl Fn(&[f32], usize, usize, usize) -> Option<(Region, Spans)>,
    ) -> Result<Self, MetricError> {
        let (width, height) = (reference.width(), reference.height());
        check_size(width, height)?;
        check_exposure(exposure)?;
        check_coverage(coverage, width, height)?;
        check_covered_finite("reference", reference, coverage)?;
        let space = options.space.clone();
        let pipeline = Pipeline::new(SpatialFilter::Scielab, options.cycles_per_degree, space, options.lanes)?;
        let reach = pipeline.reach().unwrap_or(width.max(height));
        let (region, spans) = region(coverage, width, height, reach).ok_or(MetricError::NoObject)?;
        let (object, object_windows) = object_windows(coverage, &region);
        if object_windows == 0 {
            return Err(MetricError::NoObject);
        }
        let gain = gains(coverage, &region, exposure);
        let working = pipeline.convert(&region, |y, rgb| exposed_row(&region, &gain, reference, y, 0, rgb));
        let reference = Reference::new(working, Window::new(SIGMA), options.lanes);
        let (coverage, buffers) = (coverage.to_vec(), Mutex::default());
        Ok(Self { region, spans, coverage, gain, object, object_windows, pipeline, reference, buffers })
    }

    /// Scores an image that is not multiplied by the coverage.
    ///
    /// # Errors
    /// [`MetricError::SizeMismatch`]; [`MetricError::NotFinite`] if a covered pixel is NaN or infinite.
    pub fn score(&self, image: &Image) -> Result<Score, MetricError> {
        let (windows, _) = self.region.windows();
        let rows = self.compare(
            image,
            #[inline(always)]
            |y, span, deficits| {
                let object = &self.object.row_of(0, y)[span.start..span.end.min(windows)];
                let mut sums = [(0.0, 0.0); FEATURES];
                for (sum, row) in sums.iter_mut().zip(deficits) {
                    let row = &row[..object.len()];
                    *sum = (row_sum(row), weighted_row_sum(row, object));
                }
                sums
            },
        )?;
        let mut sums = [(0.0, 0.0); FEATURES];
        for row in &rows {
            for (sum, (all, object)) in sums.iter_mut().zip(row) {
                *sum = (sum.0 + all, sum.1 + object);
            }
        }
        Ok(self.combine(sums.map(|sum| sum.0), sums.map(|sum| sum.1)))
    }

    /// The features and the error of every window, for a picture.
    ///
    /// # Errors
    /// As [`Judge::score`].
    pub fn maps(&self, image: &Image) -> Result<Maps, MetricError> {
        let (columns, _) = self.region.windows();
        let rows = self.compare(image, |_, span, deficits| {
            (span.start, deficits.map(|row| row[..span.end.min(columns) - span.start].to_vec()))
        })?;
        let (width, height) = (self.region.image_width, self.region.image_height);
        let mut maps = Maps::equal(width, height);
        for (y, (first, row)) in rows.iter().enumerate() {
            let start = (self.region.y0 + y) * (width - 2 * RADIUS) + self.region.x0 + first;
            for (map, deficits) in maps.features.iter_mut().zip(row) {
                let features = map[start..].iter_mut().zip(deficits);
                features.for_each(|(feature, d)| *feature = 1.0 - d.widen());
            }
        }
        Ok(maps)
    }

    /// The error of every window, for a picture.
    ///
    /// # Errors
    /// As [`Judge::score`].
    pub fn error_map(&self, image: &Image) -> Result<ErrorMap, MetricError> {
        Ok(self.maps(image)?.error())
    }

    /// The windows of an image's [`maps`](Self::maps) in blocks around the object; with `object`, only those centred on the object.
    #[must_use]
    pub fn blocks(&self, maps: &Maps, object: bool) -> Blocks {
        let Region { x0, y0, image_width, .. } = self.region;
        let (columns, rows) = self.region.windows();
        let is_centred = |x: usize, y: usize| self.coverage[(y + RADIUS) * image_width + x + RADIUS] > 0.0;
        Blocks::new(maps, x0..x0 + columns, y0..y0 + rows, |x, y| !object || is_centred(x, y))
    }

    /// As [`Reference::compare`].
    fn compare<T: Send>(
        &self,
        image: &Image,
        measure: impl Fn(usize, Range<usize>, [&[R]; FEATURES]) -> T + Sync + Send,
    ) -> Result<Vec<T>, MetricError> {
        let (expected, found) = ((self.region.image_width, self.region.image_height), (image.width(), image.height()));
        if expected != found {
            return Err(MetricError::SizeMismatch { expected, found });
        }
        check_covered_finite("image", image, &self.coverage)?;
        let (width, height) = (self.region.width, self.region.height);
        let kept = self.kept().pop();
        let (mut buffer, mut differences) =
            kept.unwrap_or_else(|| (Planes::new(width, height), Planes::new(width, height)));
        self.pipeline.run(
            (&self.region, &self.spans),
            #[inline(always)]
            |y, span, rgb| exposed_row(&self.region, &self.gain, image, y, span.start, rgb),
            (&mut buffer, &mut differences),
            #[inline(always)]
            |y, span, working, out| self.reference.difference_row(y, span, working, out),
        );
        let rows = self.reference.compare(&differences, &self.spans, measure);
        self.kept().push((buffer, differences));
        Ok(rows)
    }

    /// Frees the memory that scores keep for the next ones.
    pub fn free_buffers(&self) {
        self.kept().clear();
    }

    fn kept(&self) -> MutexGuard<'_, Vec<Buffers<R>>> {
        self.buffers.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn combine(&self, all: [f64; FEATURES], object: [f64; FEATURES]) -> Score {
        let windows = (self.region.image_width - 2 * RADIUS) * (self.region.image_height - 2 * RADIUS);
        let features = all.map(|sum| 1.0 - sum / windows as f64);
        let features_object = object.map(|sum| 1.0 - sum / self.object_windows as f64);
        let score = |features: [f64; FEATURES]| 1.0 - features.iter().product::<f64>();
        Score { cssim: score(features), cssim_object: score(features_object), features, features_object }
    }
}

/// Standard deviation of CID's window, in pixels.
pub(super) const SIGMA: f64 = 1.5;

pub(super) fn check_size(width: usize, height: usize) -> Result<(), MetricError> {
    if width.min(height) < SIZE { Err(MetricError::TooSmall { width, height, needed: SIZE }) } else { Ok(()) }
}

fn around(coverage: &[f32], width: usize, height: usize, reach: usize) -> Option<(Region, Spans)> {
    let region = Region::around(coverage, width, height, reach)?;
    let spans = Spans::around(coverage, &region, reach);
    Some((region, spans))
}

/// Fills row `y` of the region, from column `first` on, with exposed radiance.
#[inline(always)]
fn exposed_row<R: RowMath>(
    region: &Region,
    gain: &Planes<R, 1>,
    image: &Image,
    y: usize,
    first: usize,
    [r, g, b]: [&mut [R]; 3],
) {
    let start = (region.y0 + y) * region.image_width + region.x0;
    let end = region.width.min(first + r.len());
    let (pixels, gains) = (&image.pixels()[start + first..start + end], &gain.row_of(0, y)[first..end]);
    for (i, (&[red, green, blue], &gain)) in pixels.iter().zip(gains).enumerate() {
        r[i] = expose(R::of_single(red), gain);
        g[i] = expose(R::of_single(green), gain);
        b[i] = expose(R::of_single(blue), gain);
    }
}

fn gains<R: RowMath>(coverage: &[f32], region: &Region, exposure: f64) -> Planes<R, 1> {
    let mut gain = Planes::new(region.width, region.height);
    gain.fill_rows(
        || (),
        |(), y, [row]| {
            let start = (region.y0 + y) * region.image_width + region.x0;
            let covered = &coverage[start..start + region.width];
            row.iter_mut().zip(covered).for_each(|(gain, &c)| *gain = R::of(f64::from(c) * exposure));
        },
    );
    gain
}

/// The windows of the region that are centred on a covered pixel, and their number.
fn object_windows<R: RowMath>(coverage: &[f32], region: &Region) -> (Planes<R, 1>, usize) {
    let (columns, rows) = region.windows();
    let mut object = Planes::<R, 1>::new(columns, rows);
    let centre = |x: usize, y: usize| (region.y0 + y + RADIUS) * region.image_width + region.x0 + x + RADIUS;
    object.fill_rows(
        || (),
        |(), y, [row]| {
            (0..columns).for_each(|x| row[x] = if coverage[centre(x, y)] > 0.0 { R::ONE } else { R::ZERO });
        },
    );
    let count = (0..rows).map(|y| object.row_of(0, y).iter().filter(|&&x| x > R::ZERO).count()).sum();
    (object, count)
}

#[cfg(test)]
mod tests;
