//! Maps of the difference of two images, one value per window, and a picture of them.

use super::colour::linear_from_lab;
use super::features::FEATURES;
use super::window::RADIUS;
use crate::image::Image;
use crate::math::{cell, narrow};

/// The features of every window of an image.
#[derive(Debug, Clone, PartialEq)]
pub struct Maps {
    /// Columns of the image.
    pub width: usize,
    /// Rows of the image.
    pub height: usize,
    /// l_L, c_L, s_L, l_C, l_H, each `(height - 10) x (width - 10)`, row-major; entry (0, 0) belongs to the window
    /// centred on pixel (5, 5). 1 is equal; s_L can be negative.
    pub features: [Vec<f64>; 5],
}

/// The local error of every window of an image.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorMap {
    /// Columns of the image.
    pub width: usize,
    /// Rows of the image.
    pub height: usize,
    /// 1 minus the product of the features: `(height - 10) x (width - 10)`, row-major, in the layout of
    /// [`Maps::features`]. 0 is equal; values above 1 mean inverted structure.
    pub error: Vec<f64>,
}

impl Maps {
    /// The maps of two equal images.
    pub(super) fn equal(width: usize, height: usize) -> Self {
        let windows = (width - 2 * RADIUS) * (height - 2 * RADIUS);
        Self { width, height, features: std::array::from_fn(|_| vec![1.0; windows]) }
    }

    /// The local error: 1 minus the product of the five features of a window.
    ///
    /// Its mean is not CSSIM, which averages each feature before the multiplication.
    #[must_use]
    pub fn error(&self) -> ErrorMap {
        let error = (0..self.features[0].len())
            .map(|i| 1.0 - (0..FEATURES).map(|feature| self.features[feature][i]).product::<f64>())
            .collect();
        ErrorMap { width: self.width, height: self.height, error }
    }
}

impl ErrorMap {
    /// A picture of the map at the image's size, linear Rec. 709 (encode it to sRGB for display).
    ///
    /// Colours go from black at 0 through purple, red and orange to pale yellow at `full_scale` and above. Lightness is
    /// linear in the error. The border of 5 pixels, which has no windows, is neutral grey.
    #[must_use]
    pub fn picture(&self, full_scale: f64) -> Image {
        let mut pixels = vec![[BORDER_GREY; 3]; self.width * self.height];
        let columns = self.width - 2 * RADIUS;
        for (y, row) in self.error.chunks_exact(columns).enumerate() {
            let start = (y + RADIUS) * self.width + RADIUS;
            let out = &mut pixels[start..start + columns];
            out.iter_mut().zip(row).for_each(|(pixel, error)| *pixel = heat(error / full_scale));
        }
        Image::from_pixels(self.width, self.height, pixels)
    }
}

/// Linear value of the grey border, middle grey on a display.
const BORDER_GREY: f32 = 0.2;

/// The colour map: a path through CIELAB from black to pale yellow in segments of equal length, so that equal steps of
/// `t` look equal. `t` is clamped to [0, 1]; NaN (an error of 0 with a full scale of 0) counts as 0.
fn heat(t: f64) -> [f32; 3] {
    let position = t.clamp(0.0, 1.0) * HEAT_STEPS as f64;
    let i = cell(position, HEAT_STEPS);
    let f = if position > 0.0 { position - i as f64 } else { 0.0 };
    let [(a0, b0), (a1, b1)] = [HEAT[i], HEAT[i + 1]];
    let lightness = HEAT_LIGHTNESS * (i as f64 + f) / HEAT_STEPS as f64;
    let lab = [lightness, a0 + f * (a1 - a0), b0 + f * (b1 - b0)];
    narrow(linear_from_lab(lab).into())
}

/// CIELAB (a, b) of the points of the path; the lightness rises in equal steps to [`HEAT_LIGHTNESS`].
const HEAT: [(f64, f64); HEAT_STEPS + 1] =
    [(0.0, 0.0), (25.0, -25.0), (51.0, -1.0), (56.0, 34.0), (33.0, 61.0), (-1.0, 71.0), (-8.0, 35.0)];
const HEAT_STEPS: usize = 6;
const HEAT_LIGHTNESS: f64 = 94.0;

#[cfg(test)]
mod tests {
    use super::super::colour::lab_from_linear;
    use super::*;
    use crate::math::widen;

    #[test]
    fn the_colour_map_stays_in_gamut_and_steps_evenly() {
        let count = 600;
        let colours: Vec<[f64; 3]> =
            (0..=count).map(|i| widen(heat(f64::from(i) / f64::from(count))).to_array()).collect();
        // Rounding to single precision moves black slightly below 0.
        assert!(colours.iter().flatten().all(|x| (-1e-7..=1.0).contains(x)));
        let steps: Vec<f64> = colours
            .windows(2)
            .map(|pair| {
                let [p, q] = [lab_from_linear(pair[0]), lab_from_linear(pair[1])];
                (0..3).map(|i| (p[i] - q[i]) * (p[i] - q[i])).sum::<f64>().sqrt()
            })
            .collect();
        let (least, most) = (steps.iter().copied().fold(9.0, f64::min), steps.iter().copied().fold(0.0, f64::max));
        assert!(most / least < 1.05, "steps from {least} to {most}");
    }

    #[test]
    fn the_picture_has_the_images_size_a_grey_border_and_black_where_equal() {
        let mut maps = Maps::equal(14, 13);
        maps.features[2][4 + 1] = -0.5;
        let picture = maps.error().picture(0.5);
        assert_eq!((picture.width(), picture.height()), (14, 13));
        assert_eq!(picture.pixel(4, 5), [BORDER_GREY; 3]);
        assert_eq!(picture.pixel(9, 7), [BORDER_GREY; 3]);
        assert!(picture.pixel(5, 5).iter().all(|x| x.abs() < 1e-6), "{:?}", picture.pixel(5, 5));
        assert_eq!(picture.pixel(6, 6), heat(1.0));
        assert!(ErrorMap { width: 11, height: 11, error: vec![0.0] }.picture(0.0).pixel(5, 5)[0].abs() < 1e-6);
    }
}
