//! iCID, the successor of CID: Preiss, Fernandes & Urban, *Color-Image Quality Assessment: From Prediction to
//! Optimization* (IEEE TIP 23(3), 2014).
//!
//! Differences from CID:
//! - large images are first averaged down (in encoded values) by f = max(1, round(min(width, height) / 256));
//! - iCAM's filter replaces S-CIELAB;
//! - windows have sigma 2, and the constants of contrast and structure are 10;
//! - the structure maps use |covariance|, and that of lightness is cubed;
//! - chroma contrast and chroma structure are included;
//! - the features are multiplied per window, and the product is averaged.

use super::cid::{check_pair, working};
use super::dispatch::Lanes;
use super::display::{DisplayImage, check_coverage};
use super::features::{contrast_deficit, mean_deficit, row_sum, structure_deficit};
use super::maps::ErrorMap;
use super::region::Region;
use super::window::{
    MEAN_CHROMA, MEAN_LIGHTNESS, RADIUS, RowStatistics, SIZE, Statistics, VARIANCE_CHROMA, VARIANCE_LIGHTNESS, Window,
};
use super::working::{Pipeline, SpatialFilter};
use super::{Lab2000hl, MetricError};

/// The intent for which iCID is minimised: the weights of chroma and hue.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Intent {
    /// Overall appearance: the default.
    #[default]
    Perceptual,
    /// Hue has ten times the weight.
    HuePreserving,
    /// Chroma and hue have ten times the weight.
    Chromatic,
}

/// Settings of [`icid`]. The default is the authors'.
#[derive(Debug, Clone)]
pub struct IcidOptions {
    /// Default perceptual.
    pub intent: Intent,
    /// The spatial filter, a model of the viewer's acuity. Default iCAM.
    pub filter: SpatialFilter,
    /// Viewing distance: half the pixels per degree of visual angle, in [1, 500]. Default 20.
    pub cycles_per_degree: f64,
    /// Whether to include chroma contrast and chroma structure. Default yes.
    pub chroma_maps: bool,
    /// Whether large images are averaged down first. Default yes.
    pub downsample: bool,
    /// The working space. Default `fit00`.
    pub space: Lab2000hl,
}

impl Default for IcidOptions {
    fn default() -> Self {
        Self {
            intent: Intent::Perceptual,
            filter: SpatialFilter::Icam,
            cycles_per_degree: 20.0,
            chroma_maps: true,
            downsample: true,
            space: Lab2000hl::fit00(),
        }
    }
}

/// The result of [`icid`].
#[derive(Debug, Clone, PartialEq)]
pub struct IcidScore {
    /// iCID over all windows: 0 if identical, larger is worse.
    pub icid: f64,
    /// iCID over the windows whose centre pixel has a coverage above 0.
    pub icid_object: f64,
    /// The error of every window, at the size after averaging down. Its mean is `icid`.
    pub error: ErrorMap,
}

/// The improved colour-image difference of two displayed images.
///
/// `coverage`: one value in [0, 1] per pixel. It only selects the windows of `icid_object`; the images must already be
/// multiplied by it, see [`DisplayImage::from_linear`].
///
/// # Errors
/// [`MetricError::SizeMismatch`]; [`MetricError::TooSmall`]; [`MetricError::Length`], [`MetricError::Coverage`];
/// [`MetricError::NoObject`] if no window is centred on a covered pixel; [`MetricError::CyclesPerDegree`].
pub fn icid(
    reference: &DisplayImage,
    image: &DisplayImage,
    coverage: &[f32],
    options: &IcidOptions,
) -> Result<IcidScore, MetricError> {
    check_pair(reference, image, SIZE, 1)?;
    check_coverage(coverage, reference.width(), reference.height())?;
    let step = if options.downsample { averaging_step(reference.width().min(reference.height())) } else { 1 };
    let lanes = Lanes::Detected;
    let pipeline = Pipeline::new(options.filter, options.cycles_per_degree, options.space.clone(), lanes)?;
    let statistics = Statistics { window: Window::new(SIGMA), chroma: options.chroma_maps, lanes };
    let [first, second] = [reference, image].map(|displayed| working(&pipeline, &average_down(displayed, step)));
    let (width, height) = (first.width(), first.height());
    let prepared = statistics.prepare(first);
    let weights = options.intent.weights();
    let rows = statistics.compare(&prepared, &second, |_, row| {
        (0..width - 2 * RADIUS).map(|x| window_error(row, x, weights, options.chroma_maps)).collect::<Vec<_>>()
    });
    let covered = |x: usize, y: usize| coverage[(y + RADIUS) * step * reference.width() + (x + RADIUS) * step] > 0.0;
    let object: Vec<Vec<f64>> = rows
        .iter()
        .enumerate()
        .map(|(y, row)| row.iter().enumerate().filter(|&(x, _)| covered(x, y)).map(|(_, &error)| error).collect())
        .collect();
    let icid_object = mean(&object).ok_or(MetricError::NoObject)?;
    let icid = mean(&rows).unwrap_or(0.0);
    Ok(IcidScore { icid, icid_object, error: ErrorMap { width, height, error: rows.concat() } })
}

impl Intent {
    /// Weights of the squared differences of lightness, chroma and hue.
    fn weights(self) -> [f64; 3] {
        match self {
            Self::Perceptual => [0.002, 0.002, 0.002],
            Self::HuePreserving => [0.002, 0.002, 0.02],
            Self::Chromatic => [0.002, 0.02, 0.02],
        }
    }
}

/// Standard deviation of the window in pixels.
const SIGMA: f64 = 2.0;
/// Constant of the contrast and structure maps.
const CONSTANT: f64 = 10.0;

/// 1 minus the product of a window's features; exactly 0 if both windows are equal.
fn window_error(statistics: &RowStatistics<'_>, x: usize, weights: [f64; 3], chroma_maps: bool) -> f64 {
    let of = |plane: usize| (statistics.reference[plane][x], statistics.image[plane][x]);
    let difference = |plane: usize| of(plane).0 - of(plane).1;
    let contrast_and_structure = |variance: usize, covariance: f64| {
        let (v1, v2) = of(variance);
        let product = (v1 * v2).sqrt();
        let contrast = 1.0 - contrast_deficit(CONSTANT, v1 + v2, product);
        (contrast, 1.0 - structure_deficit(CONSTANT, covariance.abs(), product))
    };
    let (contrast, structure) = contrast_and_structure(VARIANCE_LIGHTNESS, statistics.covariance_lightness[x]);
    let mut product = (1.0 - mean_deficit(weights[0], difference(MEAN_LIGHTNESS)))
        * contrast
        * (structure * structure * structure)
        * (1.0 - mean_deficit(weights[1], difference(MEAN_CHROMA)))
        * (1.0 - mean_deficit(weights[2], statistics.hue_difference[x]));
    if chroma_maps {
        let (contrast, structure) = contrast_and_structure(VARIANCE_CHROMA, statistics.covariance_chroma[x]);
        product *= contrast * structure;
    }
    1.0 - product
}

fn mean(rows: &[Vec<f64>]) -> Option<f64> {
    let count: usize = rows.iter().map(Vec::len).sum();
    (count > 0).then(|| rows.iter().map(|row| row_sum(row)).sum::<f64>() / count as f64)
}

/// max(1, round(side / 256)).
fn averaging_step(side: usize) -> usize {
    ((side + 128) / 256).max(1)
}

/// Means of `step x step` encoded pixels at every `step`-th pixel, with half-sample reflection. The mean extends
/// `(step - 1) / 2` pixels to the left and up, and `step / 2` to the right and down (as MATLAB's `imfilter`).
fn average_down(displayed: &DisplayImage, step: usize) -> DisplayImage {
    if step == 1 {
        return displayed.clone();
    }
    let (width, height) = (displayed.width(), displayed.height());
    let whole = Region::whole(width, height);
    let (columns, rows) = (whole.columns(step), whole.rows(step));
    let (small_width, small_height) = (width.div_ceil(step), height.div_ceil(step));
    // Position `step` of the reflected axis is pixel 0.
    let first = step - (step - 1) / 2;
    let mean = |i: usize| {
        let (x, y) = (i % small_width * step + first, i / small_width * step + first);
        let mut sum = [0.0; 3];
        for row in rows[y..y + step].iter().flatten() {
            for column in columns[x..x + step].iter().flatten() {
                let pixel = displayed.pixels()[row * width + column];
                (0..3).for_each(|channel| sum[channel] += pixel[channel]);
            }
        }
        sum.map(|x| x / (step * step) as f64)
    };
    displayed.resized(small_width, small_height, (0..small_width * small_height).map(mean).collect())
}
