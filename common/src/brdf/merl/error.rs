//! Errors of reading a measured table.

/// The file is not a usable MERL table.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MerlError {
    /// The header names other dimensions.
    #[error(
        "{name}: expected a MERL table, whose first three little-endian integers are 90, 90, 180, found {}, {}, {}; check \
         that this is an isotropic .binary file of the MERL database, uncompressed",
        found[0], found[1], found[2]
    )]
    Dimensions {
        /// The file, as named by the caller.
        name: String,
        /// The first three integers.
        found: [i32; 3],
    },
    /// The file is too short or too long.
    #[error("{name}: expected a MERL table of {expected} bytes, found {found}; copy or download the file again")]
    Length {
        /// The file, as named by the caller.
        name: String,
        /// Bytes of a whole table.
        expected: usize,
        /// Bytes found.
        found: usize,
    },
    /// A value is infinite, not a number, or beyond single precision.
    #[error(
        "{name}: expected finite values, found {value} in channel {channel} at theta_h {theta_h}, theta_d {theta_d}, \
         phi_d {phi_d}; copy or download the file again, or mark the cell as not measured with -1"
    )]
    NotFinite {
        /// The file, as named by the caller.
        name: String,
        /// 0 red, 1 green, 2 blue.
        channel: usize,
        /// Cell along `theta_h`, 0 to 89.
        theta_h: usize,
        /// Cell along `theta_d`, 0 to 89.
        theta_d: usize,
        /// Cell along `phi_d`, 0 to 179.
        phi_d: usize,
        /// The number as stored.
        value: f64,
    },
    /// All cells are negative.
    #[error(
        "{name}: expected measurements, found only negative cells, which mean no measurement; check how the file was written"
    )]
    Empty {
        /// The file, as named by the caller.
        name: String,
    },
}
