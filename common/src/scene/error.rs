//! Errors of a photo, its mask and its geometry.

use super::PixelCounts;

/// A fault in the description of a scene.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The photo is smaller than the minimum size.
    #[error("the photo is {width} x {height}: expected at least {least} x {least} pixels", least = super::limits::LEAST_SIDE)]
    TooSmall {
        /// Columns found.
        width: usize,
        /// Rows found.
        height: usize,
    },
    /// An input that must have the size of the photo has another size.
    #[error(
        "the {what} is {found_width} x {found_height}, the photo is {width} x {height}: expected the same size; \
         resample the {what} to the photo"
    )]
    Size {
        /// The input: "mask", "normal map".
        what: &'static str,
        /// Columns expected.
        width: usize,
        /// Rows expected.
        height: usize,
        /// Columns found.
        found_width: usize,
        /// Rows found.
        found_height: usize,
    },
    /// Not a circle.
    #[error("`{found}` is not a circle: expected CX,CY,R in pixels with R above 0, for example --sphere 128,128,120")]
    Circle {
        /// The text that was given.
        found: String,
    },
    /// Not a camera.
    #[error("`{found}` is not a camera: expected orthographic, or perspective:FOV_DEG with a vertical field of view between {least} and {most} degrees",
        least = super::limits::LEAST_FOV_DEG, most = super::limits::MOST_FOV_DEG)]
    Camera {
        /// The text that was given.
        found: String,
    },
    /// The sphere lies outside the photo.
    #[error(
        "the circle at ({x}, {y}) with radius {radius} lies outside the photo of {width} x {height} pixels: check \
         --sphere CX,CY,R (pixels, from the top left corner)"
    )]
    CircleOutside {
        /// Centre, pixels from the left.
        x: f64,
        /// Centre, pixels from the top.
        y: f64,
        /// Radius in pixels.
        radius: f64,
        /// Columns of the photo.
        width: usize,
        /// Rows of the photo.
        height: usize,
    },
    /// A mask value outside \[0, 1\].
    #[error(
        "the mask has the value {found} at column {column}, row {row}: expected 0 (background) to 1 (object); rescale it"
    )]
    MaskValue {
        /// Column from 0.
        column: usize,
        /// Row from 0.
        row: usize,
        /// The value found.
        found: f32,
    },
    /// The mask covers too little for fitting a circle.
    #[error(
        "the mask covers {covered:.1} pixels: expected at least {least}; make the object white and the background black",
        least = super::limits::LEAST_AREA
    )]
    EmptyMask {
        /// Sum of the mask.
        covered: f64,
    },
    /// A normal is not finite.
    #[error("the normal map has ({}, {}, {}) at column {column}, row {row}: expected finite unit vectors, or 0 for the background; export it again",
        found[0], found[1], found[2])]
    Normal {
        /// Column from 0.
        column: usize,
        /// Row from 0.
        row: usize,
        /// The value found.
        found: [f32; 3],
    },
    /// Too many vectors of a normal map are not unit vectors.
    #[error(
        "{count} of {total} vectors of the normal map are neither 0 nor of length 1, the first at column {column}, row \
         {row} with length {length:.3}: expected world-space unit normals in [-1, 1]; if the file holds colours, decode \
         them by 2 c - 1"
    )]
    NormalLength {
        /// Their number.
        count: usize,
        /// The number of all vectors that are not 0.
        total: usize,
        /// Column of the first.
        column: usize,
        /// Row of the first.
        row: usize,
        /// Its length.
        length: f64,
    },
    /// No normal of the map faces the camera.
    #[error(
        "the normal map has no normal that faces the camera: expected world-space normals with the camera on +Z; those of \
         visible points have z above 0"
    )]
    NoSurface,
    /// The description of a normal-map geometry was given without its map.
    #[error(
        "the geometry is a normal map of {width} x {height} pixels, but its pixels are missing: expected the map beside the description"
    )]
    MissingNormals {
        /// Columns expected.
        width: usize,
        /// Rows expected.
        height: usize,
    },
    /// Too many pixels of the photo are not finite.
    #[error(
        "{count} of the {total} object pixels of the photo are not finite, the first at column {column}, row {row}: \
         expected at most half; check how the photo was written"
    )]
    NotFinite {
        /// Their number.
        count: usize,
        /// The number of all pixels of the object.
        total: usize,
        /// Column of the first.
        column: usize,
        /// Row of the first.
        row: usize,
    },
    /// No pixel is usable.
    #[error("the photo has no usable pixel: {0}; check --sphere, the mask and the exposure")]
    NothingUsable(PixelCounts),
    /// The object is black.
    #[error(
        "the photo is black over the whole object ({count} pixels): expected some light; check the file and --sphere"
    )]
    Black {
        /// The number of usable pixels.
        count: usize,
    },
}
