//! Errors of environment maps.

/// A fault in an environment map or its description.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LightError {
    /// The map has no texels or an odd number of columns.
    #[error(
        "the environment map is {width} x {height}: expected at least 2 x 1 texels and an even width, because the map \
         continues across its poles half a width away; resample it"
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
         least 0; repair the map, for example replace such texels by the mean of their neighbours",
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
    #[error("the environment map is black everywhere: expected some light; check that this is the right file")]
    Black,
    /// The shape of the image does not determine the layout.
    #[error(
        "the size {width} x {height} of the environment map does not determine its layout: only 2:1 (latlong) and 3:4 \
         (cross) are recognised; give --env-mapping latlong, cross, angular or mirror-ball"
    )]
    UnknownLayout {
        /// Columns found.
        width: usize,
        /// Rows found.
        height: usize,
    },
    /// The image does not have the shape that its layout requires.
    #[error(
        "an environment map in the layout {mapping} must be {expected}, found {width} x {height}: crop or resample it, \
         or give another --env-mapping"
    )]
    Shape {
        /// The layout.
        mapping: &'static str,
        /// The shape that the layout requires.
        expected: &'static str,
        /// Columns found.
        width: usize,
        /// Rows found.
        height: usize,
    },
    /// Not the name of a layout.
    #[error("unknown environment layout `{found}`: expected latlong, cross, angular or mirror-ball")]
    UnknownName {
        /// The name that was given.
        found: String,
    },
}
