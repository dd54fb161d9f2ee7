//! What can be wrong with an image file, with its name, what was expected, what was found and what to do.

use super::decoded::Format;

/// An image file that cannot be used as it is.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// The bytes are of no format that is read.
    #[error(
        "{name}: expected OpenEXR, Radiance HDR, PFM, PNG or JPEG, found {found}; convert the file to one of these"
    )]
    UnknownFormat {
        /// The file, as named by the caller.
        name: String,
        /// What the first bytes look like.
        found: String,
    },

    /// The file breaks the rules of its format, or ends early.
    #[error("{name}: not a complete {format} file: {detail}; copy or export it again")]
    Malformed {
        /// The file, as named by the caller.
        name: String,
        /// The format its first bytes promise.
        format: Format,
        /// What was expected and found.
        detail: String,
    },

    /// The file is valid, but uses a feature that is not read.
    #[error("{name}: {feature} in a {format} file is not read; {advice}")]
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
        /// Columns the header claims.
        width: u64,
        /// Rows the header claims.
        height: u64,
        /// The limit per side.
        max_side: usize,
        /// The limit of all pixels.
        max_pixels: usize,
    },

    /// None of the channels that are needed is there.
    #[error("{name}: expected {expected}, found channels {found}; export the file with these channels")]
    Channels {
        /// The file, as named by the caller.
        name: String,
        /// The channels that would do.
        expected: &'static str,
        /// The channels there are.
        found: String,
    },

    /// A mask that is no coverage.
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
        /// The value there.
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
        /// The length there.
        length: f64,
    },

    /// Something that the output format cannot hold.
    #[error("cannot write {format}: expected {expected}, found {found}")]
    Unwritable {
        /// The output format.
        format: Format,
        /// What the format can hold.
        expected: String,
        /// What it was asked to hold.
        found: String,
    },
}
