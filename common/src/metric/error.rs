//! Errors in the inputs of the metric.

/// The reason why two images cannot be compared.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MetricError {
    /// An axis is shorter than the window, at the coarsest scale.
    #[error(
        "an image of {width} x {height} pixels is too small: the metric's windows need at least {needed} x {needed}; \
         use a larger image or fewer scales"
    )]
    TooSmall {
        /// Columns found.
        width: usize,
        /// Rows found.
        height: usize,
        /// Pixels needed along each axis.
        needed: usize,
    },
    /// The two images have different sizes.
    #[error(
        "images to compare must have the same size: expected {} x {} pixels, found {} x {}; resample one of them",
        expected.0, expected.1, found.0, found.1
    )]
    SizeMismatch {
        /// Columns and rows of the reference.
        expected: (usize, usize),
        /// Columns and rows of the other image.
        found: (usize, usize),
    },
    /// The coverage, or a pixel buffer, does not have one value per pixel.
    #[error(
        "the {what} must have one value per pixel: expected {expected} values, found {found}; use one of the same image"
    )]
    Length {
        /// The buffer.
        what: &'static str,
        /// Pixels of the image.
        expected: usize,
        /// Values found.
        found: usize,
    },
    /// A coverage value outside [0, 1], or NaN.
    #[error("coverage must lie in [0, 1]: found {value} at column {column}, row {row}; rescale the mask")]
    Coverage {
        /// Column of the pixel, from the left.
        column: usize,
        /// Row of the pixel, from the top.
        row: usize,
        /// The value found.
        value: f32,
    },
    /// A channel is NaN or infinite where the coverage is not 0.
    #[error(
        "the {what} must be finite: found {value} in channel {channel} at column {column}, row {row}; \
         exclude the pixel with a mask or repair it"
    )]
    NotFinite {
        /// The image.
        what: &'static str,
        /// Column of the pixel, from the left.
        column: usize,
        /// Row of the pixel, from the top.
        row: usize,
        /// 0 red, 1 green, 2 blue.
        channel: usize,
        /// The value found.
        value: f64,
    },
    /// The display exposure is not a positive finite number.
    #[error("the display exposure must be finite and above 0, found {0}; give a positive number")]
    Exposure(f64),
    /// No automatic exposure: no pixel is fully covered, or the percentile is not positive.
    #[error(
        "cannot choose a display exposure: the 97th percentile of {pixels} pixels of full coverage is {percentile}, \
         expected a positive radiance; check the mask or give the exposure as a number"
    )]
    NoAutoExposure {
        /// Pixels whose coverage is 1.
        pixels: usize,
        /// The percentile found; 0 if there are no pixels.
        percentile: f64,
    },
    /// No window has its centre on the object.
    #[error(
        "the metric has no window on the object: expected a covered pixel at least 5 pixels from the image's border; \
         check the mask"
    )]
    NoObject,
    /// A viewing distance for which the spatial filters are not defined.
    #[error("cycles per degree must lie in [{}, {}], found {found}", range.0, range.1)]
    CyclesPerDegree {
        /// Smallest and largest accepted.
        range: (f64, f64),
        /// The value found.
        found: f64,
    },
    /// A LAB2000HL table has the wrong length or holds a value that is not finite.
    #[error(
        "a LAB2000HL table must be 257 x 257 x 2 finite little-endian f64 ({expected} bytes), found {found} bytes{}",
        not_finite.map_or(String::new(), |i| format!(" with value {i} not finite"))
    )]
    Table {
        /// Bytes expected.
        expected: usize,
        /// Bytes found.
        found: usize,
        /// Index of the first value that is not finite.
        not_finite: Option<usize>,
    },
}
