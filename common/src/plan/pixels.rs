//! The pixels of the photo that a plan uses, with their values.

use super::encode::index;
use crate::{
    image::Image,
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

/// The pixels that count for the score, tile by tile, so that neighbours share cuts of the light pyramid.
pub(super) fn covered_pixels(capture: &Capture) -> Vec<Pixel> {
    let width = capture.photo().width();
    let coverage = capture.scoring_coverage();
    let covered = coverage.iter().enumerate().filter(|(_, c)| **c > 0.0);
    let mut pixels: Vec<Pixel> = covered.map(|(i, _)| [index(i % width), index(i / width)]).collect();
    pixels.sort_by_key(|pixel| tile_order(*pixel));
    pixels
}

/// Every pixel of a photo, or the middle pixel of every square of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Grid(u32);

impl Grid {
    /// Every pixel.
    pub(super) const FULL: Self = Self(1);

    /// The coarsest grid on which the bounding box of these pixels still has `size` columns and rows; every pixel if the box is smaller
    /// than that. The grid is coarser if it would hold more than `most` of the pixels.
    pub(super) fn around(pixels: &[Pixel], size: u32, most: usize) -> Self {
        let extent = |axis: usize| {
            let (low, high) = pixels.iter().fold((u32::MAX, 0), |(low, high), p| (low.min(p[axis]), high.max(p[axis])));
            high.saturating_sub(low).saturating_add(1)
        };
        let mut grid = Self((extent(0).min(extent(1)) / size).max(1));
        while pixels.iter().filter(|pixel| grid.holds(**pixel)).count() > most {
            grid.0 += 1;
        }
        grid
    }

    /// Columns or rows of the grid along `length` pixels.
    pub(super) fn count(self, length: usize) -> usize {
        self.places(length).count()
    }

    /// Side of a square, in pixels.
    pub(super) fn stride(self) -> u32 {
        self.0
    }

    /// The places of the grid along `length` pixels.
    fn places(self, length: usize) -> impl Iterator<Item = usize> + Clone {
        let stride = self.0 as usize;
        (stride / 2..length).step_by(stride)
    }

    /// Whether a pixel is on the grid.
    pub(super) fn holds(self, [column, row]: Pixel) -> bool {
        column % self.0 == self.0 / 2 && row % self.0 == self.0 / 2
    }

    /// The photo's pixels on the grid.
    pub(super) fn image(self, photo: &Image) -> Image {
        let (columns, rows) = (self.places(photo.width()), self.places(photo.height()));
        let pixels: Vec<[f32; 3]> =
            rows.clone().flat_map(|r| columns.clone().map(move |c| photo.pixel(c, r))).collect();
        Image::from_pixels(columns.count(), rows.count(), pixels)
    }

    /// The values, row by row of `width`, on the grid.
    pub(super) fn values(self, values: &[f32], width: usize) -> Vec<f32> {
        let columns = self.places(width);
        self.places(values.len() / width).flat_map(|r| columns.clone().map(move |c| values[r * width + c])).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_takes_the_middle_of_every_square_and_drops_incomplete_squares() {
        let photo = Image::from_pixels(7, 5, (0..35u8).map(|i| [f32::from(i); 3]).collect());
        let grid = Grid(3);
        let image = grid.image(&photo);
        assert_eq!((image.width(), image.height()), (2, 2));
        assert_eq!(image.pixels().iter().map(|p| p[0]).collect::<Vec<_>>(), [8.0, 11.0, 29.0, 32.0]);
        let values: Vec<f32> = (0..35u8).map(f32::from).collect();
        assert_eq!(grid.values(&values, 7), [8.0, 11.0, 29.0, 32.0]);
        assert!(grid.holds([4, 1]) && !grid.holds([3, 1]));
        assert_eq!(Grid::FULL.image(&photo), photo);
        let square = |side: u32| (0..side * side).map(|i| [100 + i % side, 7 + i / side]).collect::<Vec<Pixel>>();
        assert_eq!(Grid::around(&square(64), 16, 1000), Grid(4));
        assert_eq!(Grid::around(&square(64), 96, 10_000), Grid::FULL);
        assert_eq!(Grid::around(&square(64), 96, 1100), Grid(2));
    }
}
