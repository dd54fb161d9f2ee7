//! Errors of image files. Each has the file's name, what was expected and found, and what to do.

use super::decoded::Format;

/// The reason why an image file cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// The format is not supported.
    #[error(
        "{name}: expected OpenEXR, Radiance HDR, PFM, PNG, JPEG or TIFF, found {found}; convert the file to one of these"
    )]
    UnknownFormat {
        /// The file, as named by the caller.
        name: String,
        /// A description of the first bytes.
        found: String,
    },

    /// The file violates its format or is truncated.
    #[error("{name}: not a valid {format} file: {detail}; copy or export it again")]
    Malformed {
        /// The file, as named by the caller.
        name: String,
        /// The format by the first bytes.
        format: Format,
        /// What was expected and found.
        detail: String,
    },

    /// The file is valid, but uses a feature that is not supported.
    #[error("{name}: {feature} in a {format} file is not supported; {advice}")]
    Unsupported {
        /// The file, as named by the caller.
        name: String,
        /// Its format.
        format: Format,
        /// The feature.
        feature: String,
        /// How to convert the file.
        advice: String,
    },

    /// The image is larger than the limits allow.
    #[error(
        "{name}: expected at most {max_side} pixels per side and {max_pixels} pixels in all, found {width} x {height}; scale the image down"
    )]
    TooLarge {
        /// The file, as named by the caller.
        name: String,
        /// Columns by the header.
        width: u64,
        /// Rows by the header.
        height: u64,
        /// The limit per side.
        max_side: usize,
        /// The limit of the number of pixels.
        max_pixels: usize,
    },

    /// The needed channels are missing.
    #[error("{name}: expected {expected}, found channels {found}; export the file with these channels")]
    Channels {
        /// The file, as named by the caller.
        name: String,
        /// The channels that are needed.
        expected: String,
        /// The channels of the file.
        found: String,
    },

    /// A mask whose colour channels differ.
    #[error(
        "{name}: expected a mask (alpha, one channel, or equal channels), found different colours at column {column}, row {row}; export the mask as grey"
    )]
    ColouredMask {
        /// The file, as named by the caller.
        name: String,
        /// Column of the first coloured pixel.
        column: usize,
        /// Row of the first coloured pixel.
        row: usize,
    },

    /// A mask value outside [0, 1].
    #[error("{name}: expected coverage from 0 to 1, found {value} at column {column}, row {row}; rescale the mask")]
    Coverage {
        /// The file, as named by the caller.
        name: String,
        /// Column of the pixel.
        column: usize,
        /// Row of the pixel.
        row: usize,
        /// Its value.
        value: f32,
    },

    /// A normal that is neither of unit length nor zero.
    #[error(
        "{name}: expected normals of length 1, or 0 for the background, found length {length} at column {column}, row {row}; export world-space normals with components from -1 to 1, not packed into colours"
    )]
    Normal {
        /// The file, as named by the caller.
        name: String,
        /// Column of the pixel.
        column: usize,
        /// Row of the pixel.
        row: usize,
        /// Its length.
        length: f64,
    },

    /// Content that the output format cannot represent.
    #[error("cannot write {format}: expected {expected}, found {found}")]
    Unwritable {
        /// The output format.
        format: Format,
        /// What the format can represent.
        expected: String,
        /// What was to be written.
        found: String,
    },
}
