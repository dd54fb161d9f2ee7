//! Pixel buffers and the file formats they come from and go to. Readers take bytes, never paths.

/// A colour image: `height x width x 3`, row-major, top left first, linear Rec. 709.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    width: usize,
    height: usize,
    pixels: Vec<[f32; 3]>,
}

impl Image {
    /// A black image.
    #[must_use]
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![[0.0; 3]; width * height] }
    }

    /// An image from its pixels.
    ///
    /// # Panics
    /// If `pixels.len() != width * height`.
    #[must_use]
    pub fn from_pixels(width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Self {
        assert_eq!(pixels.len(), width * height, "pixel count of a {width} x {height} image");
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

    /// All pixels, row-major, top left first.
    #[must_use]
    pub fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }

    /// All pixels, to write to.
    #[must_use]
    pub fn pixels_mut(&mut self) -> &mut [[f32; 3]] {
        &mut self.pixels
    }

    /// The pixel in column `column` of row `row`.
    ///
    /// # Panics
    /// If outside the image.
    #[must_use]
    pub fn pixel(&self, column: usize, row: usize) -> [f32; 3] {
        assert!(column < self.width, "column {column} of an image {} wide", self.width);
        self.pixels[row * self.width + column]
    }
}
