//! Errors in the inputs of a search.

/// Inputs with which a search cannot start.
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
    #[error("the bounds have no coordinates, expected at least one: give bounds for each parameter")]
    NoParameters,
    /// A lower bound above its upper bound, or not a number.
    #[error("bounds of parameter {index} are [{lower}, {upper}], expected lower <= upper: swap or correct them")]
    EmptyRange {
        /// Index of the parameter, from 0.
        index: usize,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
    /// A range that its scale cannot map to the unit interval.
    #[error(
        "bounds of parameter {index} are [{lower}, {upper}], expected {expected}: correct them or choose another scale"
    )]
    UnscalableRange {
        /// Index of the parameter, from 0.
        index: usize,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
        /// The bounds that the scale requires.
        expected: &'static str,
    },
    /// A start outside the box, or not a number.
    #[error("start of parameter {index} is {value}, expected a value in [{lower}, {upper}]: start inside the bounds")]
    StartOutside {
        /// Index of the parameter, from 0.
        index: usize,
        /// Its value.
        value: f64,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
    /// The objective or its derivative is not finite at the start.
    #[error("{what} at the start {point:?} is not finite, expected a finite number: choose another start")]
    NotFinite {
        /// The quantity.
        what: &'static str,
        /// The start.
        point: Vec<f64>,
    },
    /// Normal equations that contain NaN or infinity.
    #[error(
        "the normal equations contain a value that is not finite: check the residuals and their derivatives for NaN"
    )]
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

/// Returns an error if `what` has a number of coordinates other than that of the box, `expected`.
pub(super) fn check_dimension(what: &'static str, expected: usize, found: usize) -> Result<(), SearchError> {
    if expected == found { Ok(()) } else { Err(SearchError::Dimension { what, expected, found }) }
}

/// Returns an error if an option's value is not `valid`.
pub(super) fn check_option(
    name: &'static str,
    found: f64,
    valid: bool,
    expected: &'static str,
) -> Result<(), SearchError> {
    if valid { Ok(()) } else { Err(SearchError::Option { name, expected, found }) }
}
