//! Pixel buffers, and readers and writers of image files. Readers take bytes, not paths; writers return bytes.
//!
//! - [`decode`] reads a photograph or a light probe: OpenEXR, Radiance HDR, PFM, PNG, JPEG or TIFF, recognised by content;
//! - [`decode_mask`] reads a coverage mask, [`decode_normals`] a normal map;
//! - [`openexr::write`], [`pfm::write`] and [`png::write`] write results; [`metadata`] has the keys of the text in
//!   them;
//! - [`content_hash`] identifies an image by its decoded pixels.
//!
//! All pixels are converted to linear Rec. 709, top left first. A conversion that is not exact, or an assumption, is
//! reported in [`Decoded::warnings`]. A file that cannot be converted is an [`ImageError`].

mod decode;
mod decoded;
mod error;
mod hash;
mod icc;
mod jpeg;
mod ldr;
mod mask;
mod mask_channels;
pub mod metadata;
mod normals;
pub mod openexr;
pub mod pfm;
mod plane;
pub mod png;
mod primaries;
mod rgbe;
mod source;
pub mod srgb;
#[cfg(test)]
mod tests;
mod tiff;

pub use decode::{decode, decode_mask, decode_normals};
pub use decoded::{Decoded, Encoding, Format};
pub use error::ImageError;
pub use hash::content_hash;
pub use plane::Plane;
pub use source::{Limits, Source};

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

    /// All pixels, mutable.
    #[must_use]
    pub fn pixels_mut(&mut self) -> &mut [[f32; 3]] {
        &mut self.pixels
    }

    /// The pixel in column `column` of row `row`.
    ///
    /// # Panics
    /// If the pixel is outside the image.
    #[must_use]
    pub fn pixel(&self, column: usize, row: usize) -> [f32; 3] {
        assert!(column < self.width, "column {column} of an image {} wide", self.width);
        self.pixels[row * self.width + column]
    }
}
