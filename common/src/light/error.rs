//! What can be wrong with an environment map.

/// A fault in an environment map or its description.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LightError {
    /// The map has no texels, or a number of columns that cannot continue across a pole.
    #[error(
        "the environment map is {width} x {height}: expected at least 2 x 1 texels and an even width, so that the map \
         can continue across its poles at half a turn; resample it"
    )]
    Size {
        /// Columns found.
        width: usize,
        /// Rows found.
        height: usize,
    },
    /// A texel is negative, infinite or not a number.
    #[error(
        "the environment map has the radiance ({}, {}, {}) at column {column}, row {row}: expected finite values of at \
         least 0; repair the map, for example by replacing such texels with their neighbours' mean",
        found[0], found[1], found[2]
    )]
    Texel {
        /// Column of the texel, from 0 at the left.
        column: usize,
        /// Row of the texel, from 0 at the top.
        row: usize,
        /// Linear red, green, blue.
        found: [f32; 3],
    },
    /// Every texel is black.
    #[error("the environment map is black everywhere: expected some light; check that the right file was given")]
    Black,
    /// The layout cannot be told from the shape of the image.
    #[error(
        "cannot tell the layout of the environment map from its size {width} x {height}: only 2:1 (latlong) and 3:4 \
         (cross) are recognised; give --env-mapping latlong, cross, angular or mirror-ball"
    )]
    UnknownLayout {
        /// Columns found.
        width: usize,
        /// Rows found.
        height: usize,
    },
    /// The image does not have the shape its layout asks for.
    #[error(
        "an environment map in the layout {mapping} must be {expected}, found {width} x {height}: crop or resample it, \
         or give another --env-mapping"
    )]
    Shape {
        /// The layout asked for.
        mapping: &'static str,
        /// The shape it asks for.
        expected: &'static str,
        /// Columns found.
        width: usize,
        /// Rows found.
        height: usize,
    },
    /// The name of a layout is not known.
    #[error("unknown environment layout `{found}`: expected latlong, cross, angular or mirror-ball")]
    UnknownName {
        /// What was given.
        found: String,
    },
}
