//! What can be wrong with the inputs of a search.

/// A search that cannot start, or bounds that make no box.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SearchError {
    /// A vector has the wrong length.
    #[error("{what} has {found} coordinates, expected {expected}: give one value per parameter")]
    Dimension {
        /// The vector.
        what: &'static str,
        /// Coordinates of the box.
        expected: usize,
        /// Coordinates of the vector.
        found: usize,
    },
    /// A box without parameters.
    #[error("the bounds have no coordinates, expected at least one parameter to search")]
    NoParameters,
    /// A lower bound above its upper bound, or not a number.
    #[error("bounds of parameter {index} are [{lower}, {upper}], expected lower <= upper: swap or correct them")]
    EmptyRange {
        /// Which parameter, from 0.
        index: usize,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
    /// A range that its scale cannot map to the unit interval.
    #[error("bounds of parameter {index} are [{lower}, {upper}], expected {expected} for its scale")]
    UnscalableRange {
        /// Which parameter, from 0.
        index: usize,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
        /// What the scale needs.
        expected: &'static str,
    },
    /// A start outside the box, or not a number.
    #[error("start of parameter {index} is {value}, expected a value in [{lower}, {upper}]: move it inside")]
    StartOutside {
        /// Which parameter, from 0.
        index: usize,
        /// Its value.
        value: f64,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
    /// The objective, or its derivative, is not finite where the search starts.
    #[error("{what} at the start {point:?} is not finite, expected a number: start elsewhere")]
    NotFinite {
        /// The quantity.
        what: &'static str,
        /// Where.
        point: Vec<f64>,
    },
    /// Normal equations with NaN or infinity.
    #[error("the normal equations hold a value that is not finite, expected numbers: look for NaN among the residuals")]
    NormalNotFinite,
    /// An option outside its range.
    #[error("search option {name} is {found}, expected {expected}")]
    Option {
        /// The option's field.
        name: &'static str,
        /// Its range.
        expected: &'static str,
        /// Its value.
        found: f64,
    },
}

/// The error for `found` coordinates of `what` where the box has `expected`.
pub(super) fn check_dimension(what: &'static str, expected: usize, found: usize) -> Result<(), SearchError> {
    if expected == found { Ok(()) } else { Err(SearchError::Dimension { what, expected, found }) }
}

/// The error for an option whose value is not `valid`.
pub(super) fn check_option(
    name: &'static str,
    found: f64,
    valid: bool,
    expected: &'static str,
) -> Result<(), SearchError> {
    if valid { Ok(()) } else { Err(SearchError::Option { name, expected, found }) }
}
