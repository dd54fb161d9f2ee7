//! CID on two displayed images, with the variants of the authors' program (`CID_advanced.m`).
//!
//! The default equals [`super::Judge`] with full coverage. Variants: no spatial filter or iCAM's, another viewing
//! distance, the sixth feature c_C (chroma contrast), and 3 or 5 scales. With several scales, contrast and structure
//! are computed at every scale with the exponents of MS-SSIM, lightness only at the coarsest, chroma and hue only at
//! the finest.

use super::colour::{A, B, LIGHTNESS};
use super::cssim::{SIGMA, check_size};
use super::dispatch::Lanes;
use super::display::{DisplayImage, decode_srgb};
use super::features::{FEATURES, chroma_contrast_row, deficit_rows, row_sum};
use super::planes::Planes;
use super::region::Region;
use super::window::{SIZE, Statistics, Window};
use super::working::{Pipeline, SpatialFilter};
use super::{Lab2000hl, MetricError};
use crate::math::elementary::{pow, sin_cos};

/// Scales of [`cid`]; each halves the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scales {
    /// The image itself: the default.
    #[default]
    One,
    /// The image and two smaller ones; both axes need 41 pixels.
    Three,
    /// The image and four smaller ones; both axes need 161 pixels.
    Five,
}

/// Settings of [`cid`]. The default is the authors'.
#[derive(Debug, Clone)]
pub struct CidOptions {
    /// The spatial filter, a model of the viewer's acuity. Default S-CIELAB.
    pub filter: SpatialFilter,
    /// Viewing distance: half the pixels per degree of visual angle, in [1, 500]. Default 20.
    pub cycles_per_degree: f64,
    /// Default one.
    pub scales: Scales,
    /// Whether to include the sixth feature, chroma contrast. Default no.
    pub chroma_contrast: bool,
    /// The working space. Default `fit00`.
    pub space: Lab2000hl,
}

impl Default for CidOptions {
    fn default() -> Self {
        Self {
            filter: SpatialFilter::Scielab,
            cycles_per_degree: 20.0,
            scales: Scales::One,
            chroma_contrast: false,
            space: Lab2000hl::fit00(),
        }
    }
}

/// The colour-image difference of two displayed images: 0 if identical, larger is worse, above 1 if inverted.
///
/// # Errors
/// [`MetricError::SizeMismatch`]; [`MetricError::TooSmall`] if the coarsest scale is smaller than 11 x 11 pixels;
/// [`MetricError::CyclesPerDegree`].
pub fn cid(reference: &DisplayImage, image: &DisplayImage, options: &CidOptions) -> Result<f64, MetricError> {
    let exponents = options.scales.exponents();
    check_pair(reference, image, SIZE, exponents.len())?;
    let pipeline = Pipeline::new(options.filter, options.cycles_per_degree, options.space.clone(), Lanes::Detected)?;
    let statistics = Statistics { window: Window::new(SIGMA), chroma: options.chroma_contrast, lanes: Lanes::Detected };
    let [mut first, mut second] = [reference, image].map(|displayed| working(&pipeline, displayed));
    let mut product = Power { magnitude: 1.0, half_turns: 0.0 };
    for (scale, &exponent) in exponents.iter().enumerate() {
        if scale > 0 {
            [first, second] = [&first, &second].map(halve);
        }
        let [l_l, c_l, s_l, l_c, l_h, c_c] = means(&statistics, &first, &second);
        let at_every_scale = if options.chroma_contrast { &[c_l, s_l, c_c][..] } else { &[c_l, s_l] };
        at_every_scale.iter().for_each(|&mean| product.multiply(mean, exponent));
        if scale == 0 {
            product.magnitude *= l_c * l_h;
        }
        if scale + 1 == exponents.len() {
            product.multiply(l_l, exponent);
        }
    }
    Ok(1.0 - product.real())
}

impl Scales {
    /// MS-SSIM's exponents (Wang, Simoncelli & Bovik 2003), finest scale first, cut to the scales used and normalised.
    fn exponents(self) -> Vec<f64> {
        let used = match self {
            Self::One => return vec![1.0],
            Self::Three => &EXPONENTS[..3],
            Self::Five => &EXPONENTS[..],
        };
        let sum: f64 = used.iter().sum();
        used.iter().map(|x| x / sum).collect()
    }
}

const EXPONENTS: [f64; 5] = [0.0448, 0.2856, 0.3001, 0.2363, 0.1333];

/// A product of real powers of real numbers. A fractional power of a negative mean is complex; the score is 1 minus the
/// real part of the product, as in the authors' program.
struct Power {
    magnitude: f64,
    /// Argument of the product divided by pi.
    half_turns: f64,
}

impl Power {
    fn multiply(&mut self, base: f64, exponent: f64) {
        self.magnitude *= if exponent == 1.0 { base.abs() } else { pow(base.abs(), exponent) };
        self.half_turns += if base < 0.0 { exponent } else { 0.0 };
    }

    fn real(&self) -> f64 {
        match self.half_turns {
            0.0 => self.magnitude,
            1.0 => -self.magnitude,
            half_turns => self.magnitude * sin_cos(std::f64::consts::PI * half_turns).1,
        }
    }
}

/// Fails unless both images have the same size and the coarsest of `scales` scales holds a window of side `needed`.
pub(super) fn check_pair(
    reference: &DisplayImage,
    image: &DisplayImage,
    needed: usize,
    scales: usize,
) -> Result<(), MetricError> {
    let (width, height) = (reference.width(), reference.height());
    if (width, height) != (image.width(), image.height()) {
        return Err(MetricError::SizeMismatch { expected: (width, height), found: (image.width(), image.height()) });
    }
    check_size(width, height)?;
    let needed = ((needed - 1) << (scales - 1)) + 1;
    if width.min(height) < needed { Err(MetricError::TooSmall { width, height, needed }) } else { Ok(()) }
}

/// The working space of a displayed image.
pub(super) fn working(pipeline: &Pipeline<f64>, displayed: &DisplayImage) -> Planes<f64, 4> {
    let (width, height) = (displayed.width(), displayed.height());
    pipeline.convert(&Region::whole(width, height), |y, [r, g, b]| {
        for (x, &pixel) in displayed.pixels()[y * width..(y + 1) * width].iter().enumerate() {
            [r[x], g[x], b[x]] = pixel.map(decode_srgb);
        }
    })
}

/// Means over all windows of l_L, c_L, s_L, l_C, l_H and c_C (1 if it is not included).
pub(super) fn means(
    statistics: &Statistics,
    reference: &Planes<f64, 4>,
    image: &Planes<f64, 4>,
) -> [f64; FEATURES + 1] {
    let reference = statistics.prepare(reference.clone());
    let (columns, stride) = (reference.moments.width(), reference.moments.stride());
    let rows = statistics.compare(&reference, image, |_, row| {
        let mut deficits = std::array::from_fn(|_| vec![0.0; stride]);
        deficit_rows(row, &mut deficits);
        let mut contrast = vec![0.0; stride];
        if statistics.chroma {
            chroma_contrast_row(row, &mut contrast);
        }
        let [l_l, c_l, s_l, l_c, l_h] = deficits.each_ref().map(|row| row_sum(&row[..columns]));
        [l_l, c_l, s_l, l_c, l_h, row_sum(&contrast[..columns])]
    });
    let windows = (columns * rows.len()) as f64;
    std::array::from_fn(|feature| 1.0 - rows.iter().map(|row| row[feature]).sum::<f64>() / windows)
}

/// Halves the size of an image in the working space: low-pass of the biorthogonal 9/7 wavelet with half-sample
/// reflection, then every second pixel.
fn halve(planes: &Planes<f64, 4>) -> Planes<f64, 4> {
    let (width, height) = (planes.width(), planes.height());
    let mut half = Planes::<f64, 4>::new(width.div_ceil(2), height.div_ceil(2));
    let sum = LOW_PASS[0] + 2.0 * LOW_PASS[1..].iter().sum::<f64>();
    let taps = LOW_PASS.map(|tap| tap / sum);
    let (rows, columns) = (Region::whole(width, height).rows(4), Region::whole(width, height).columns(4));
    half.fill_rows(
        || vec![0.0; width],
        |smoothed, y, out| {
            let [l, a, b, chroma] = out;
            for (channel, out) in [(LIGHTNESS, l), (A, &mut *a), (B, &mut *b)] {
                let source = |k: usize| rows[2 * y + k].map_or(&[][..], |row| planes.row_of(channel, row));
                smoothed.iter_mut().enumerate().for_each(|(x, sum)| {
                    *sum = low_pass(&taps, |k| source(k)[x]);
                });
                (0..width.div_ceil(2)).for_each(|x| {
                    out[x] = low_pass(&taps, |k| columns[2 * x + k].map_or(0.0, |column| smoothed[column]));
                });
            }
            chroma.iter_mut().zip(a.iter().zip(b.iter())).for_each(|(chroma, (a, b))| *chroma = (a * a + b * b).sqrt());
        },
    );
    half
}

/// The weighted sum of nine values, symmetric around value 4.
fn low_pass(taps: &[f64; 5], value: impl Fn(usize) -> f64) -> f64 {
    (1..5).fold(taps[0] * value(4), |sum, k| sum + taps[k] * (value(4 - k) + value(4 + k)))
}

/// Half of the low-pass of the biorthogonal 9/7 wavelet, from its centre (`CID_advanced.m`).
const LOW_PASS: [f64; 5] = [
    0.852_698_679_008_890,
    0.377_402_855_612_830,
    -0.110_624_404_418_440,
    -0.023_849_465_019_560,
    0.037_828_455_507_260,
];
