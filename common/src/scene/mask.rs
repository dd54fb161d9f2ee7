//! The part of the photo that is the object.

use super::SceneError;
use crate::image::Image;

/// The object's coverage of every pixel: `height x width`, row-major, 0 (background) to 1 (object).
#[derive(Debug, Clone, PartialEq)]
pub struct Mask {
    width: usize,
    height: usize,
    coverage: Vec<f32>,
}

impl Mask {
    /// A mask from its values.
    ///
    /// # Errors
    /// [`SceneError::MaskValue`] for a value outside \[0, 1\] or not a number.
    ///
    /// # Panics
    /// If `coverage.len() != width * height`.
    pub fn new(width: usize, height: usize, coverage: Vec<f32>) -> Result<Self, SceneError> {
        assert_eq!(coverage.len(), width * height, "value count of a {width} x {height} mask");
        if let Some(index) = coverage.iter().position(|value| !(0.0..=1.0).contains(value)) {
            let (column, row) = (index % width, index / width);
            return Err(SceneError::MaskValue { column, row, found: coverage[index] });
        }
        Ok(Self { width, height, coverage })
    }

    /// A mask from the mean of an image's channels, as linear coverage (no transfer function).
    ///
    /// # Errors
    /// As [`Mask::new`].
    pub fn from_image(image: &Image) -> Result<Self, SceneError> {
        // Equal channels keep their exact value, which a mean would round.
        let mean = |[r, g, b]: &[f32; 3]| if r == g && g == b { *r } else { (r + g + b) / 3.0 };
        Self::new(image.width(), image.height(), image.pixels().iter().map(mean).collect())
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

    /// All values, row-major.
    #[must_use]
    pub fn coverage(&self) -> &[f32] {
        &self.coverage
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_outside_the_range_are_named_with_their_place() {
        let with = |bad: f32| Mask::new(3, 2, vec![0.0, 1.0, 0.5, 0.0, bad, 1.0]);
        assert!(with(1.0).is_ok());
        assert_eq!(with(1.5), Err(SceneError::MaskValue { column: 1, row: 1, found: 1.5 }));
        assert!(with(f32::NAN).unwrap_err().to_string().contains("column 1, row 1"));
    }

    #[test]
    fn grey_images_keep_their_exact_values() {
        let image = Image::from_pixels(2, 1, vec![[0.1; 3], [0.0, 0.0, 0.75]]);
        assert_eq!(Mask::from_image(&image).unwrap().coverage(), &[0.1, 0.25]);
    }
}
