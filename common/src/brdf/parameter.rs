//! The parameters of a model: names, bounds, units, and roles in a search.
//!
//! A parameter vector is flat: colours take three consecutive entries (red, green, blue), scalars one, in the order of
//! [`Model::parameters`](super::Model::parameters).

use thiserror::Error;

/// Scalar or colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channels {
    /// One value.
    Scalar,
    /// Linear Rec. 709 red, green, blue.
    Rgb,
}

impl Channels {
    /// Entries in the flat parameter vector.
    #[must_use]
    pub fn count(self) -> usize {
        match self {
            Self::Scalar => 1,
            Self::Rgb => 3,
        }
    }
}

/// How a search treats the parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Role {
    /// The weights are affine in it while all other parameters are held.
    Linear,
    /// The width of the main lobe: radiance depends on it through the table's knots.
    Width,
    /// It multiplies other parameters, or is the width of a lobe other than the main one. The scan tries these values and solves for the
    /// linear parameters.
    Scanned(&'static [f64]),
}

/// The coordinate in which a search moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// The value itself.
    Linear,
    /// Its logarithm; the lower bound is positive.
    Logarithmic,
}

/// One parameter of a model.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// The name in `fit.json` and `--params`.
    pub name: &'static str,
    /// What it means, with its unit.
    pub meaning: &'static str,
    /// Scalar or colour.
    pub channels: Channels,
    /// Smallest value.
    pub lower: f64,
    /// Largest value.
    pub upper: f64,
    /// Start of the paper's pattern search (design section 10, `--preset paper`).
    pub start: f64,
    /// How a search treats it.
    pub role: Role,
    /// Whether the upper bound is a kind of surface, such as a metal, and not a limit of the model.
    pub upper_is_kind: bool,
    /// The value of a material for which none is given; `None` if it must be given.
    pub usual: Option<f64>,
    /// The coordinate of pattern search. Least squares always uses the logarithm of the main lobe's width.
    pub scale: Scale,
}

impl Parameter {
    /// A colour from 0 to 1 that the weights are affine in.
    #[must_use]
    pub const fn colour(name: &'static str, meaning: &'static str) -> Self {
        Self { channels: Channels::Rgb, ..Self::scalar(name, meaning, Role::Linear) }
    }

    /// A scalar from 0 to 1.
    #[must_use]
    pub const fn scalar(name: &'static str, meaning: &'static str, role: Role) -> Self {
        let (channels, scale) = (Channels::Scalar, Scale::Linear);
        Self {
            name,
            meaning,
            channels,
            lower: 0.0,
            upper: 1.0,
            start: 0.3,
            role,
            upper_is_kind: false,
            usual: None,
            scale,
        }
    }

    /// The same with another upper bound.
    #[must_use]
    pub const fn up_to(self, upper: f64) -> Self {
        Self { upper, ..self }
    }

    /// The same with a value for materials for which none is given.
    #[must_use]
    pub const fn usually(self, value: f64) -> Self {
        Self { usual: Some(value), ..self }
    }

    /// The share of one kind of surface in a mixture of two: the scan tries these values.
    #[must_use]
    pub const fn blend(name: &'static str, meaning: &'static str, values: &'static [f64]) -> Self {
        Self { upper_is_kind: true, ..Self::scalar(name, meaning, Role::Scanned(values)) }
    }

    /// The width of the main lobe, from 0.005 to 1.
    #[must_use]
    pub const fn width(name: &'static str, meaning: &'static str) -> Self {
        Self { lower: 0.005, ..Self::scalar(name, meaning, Role::Width) }
    }
}

impl Parameter {
    /// Its entries in the flat vector from the values given: one per channel, or one for grey.
    ///
    /// # Errors
    /// [`ParameterError::Count`].
    pub fn entries(&self, values: &[f64]) -> Result<Vec<f64>, ParameterError> {
        let expected = self.channels.count();
        match values {
            [grey] => Ok(vec![*grey; expected]),
            _ if values.len() == expected => Ok(values.to_vec()),
            _ => Err(ParameterError::Count { name: self.name, expected, found: values.len() }),
        }
    }
}

/// Invalid parameters of a model.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ParameterError {
    /// A model of that name has become another one.
    #[error("the model '{name}' is now {now}")]
    Renamed {
        /// As given.
        name: &'static str,
        /// What to use instead.
        now: &'static str,
    },
    /// No model of that name.
    #[error("unknown model '{name}': expected one of {known}")]
    UnknownModel {
        /// As given.
        name: String,
        /// The known names, separated by commas.
        known: String,
    },
    /// The model has no such parameter.
    #[error("model {model} has no parameter '{name}': it has {known}")]
    UnknownParameter {
        /// The model.
        model: &'static str,
        /// As given.
        name: String,
        /// The known names, separated by commas.
        known: String,
    },
    /// A parameter was left out.
    #[error("parameter '{name}' of model {model} is missing: give {name}={example}")]
    Missing {
        /// The model.
        model: &'static str,
        /// The parameter.
        name: &'static str,
        /// An example of its value.
        example: &'static str,
    },
    /// A wrong number of values: a scalar takes one, a colour three, or one for grey.
    #[error("parameter '{name}' takes {expected} number(s), found {found}")]
    Count {
        /// The parameter.
        name: &'static str,
        /// Entries it takes.
        expected: usize,
        /// Entries given.
        found: usize,
    },
    /// Held or narrowed twice.
    #[error("parameter '{name}' is given twice: name it once, in --fix or in --bounds")]
    Twice {
        /// The parameter.
        name: &'static str,
    },
    /// A range without values.
    #[error("parameter '{name}' has an empty range: {lower} is above {upper}")]
    EmptyRange {
        /// The parameter.
        name: &'static str,
        /// The lower bound given.
        lower: f64,
        /// The upper bound given.
        upper: f64,
    },
    /// Outside its bounds, or not a number.
    #[error("parameter '{name}' is {found}: expected a value in [{lower}, {upper}]")]
    OutOfBounds {
        /// The parameter.
        name: &'static str,
        /// The value given.
        found: f64,
        /// Smallest value.
        lower: f64,
        /// Largest value.
        upper: f64,
    },
}

/// Entries of the flat vector of these parameters.
#[must_use]
pub fn flat_len(parameters: &[Parameter]) -> usize {
    parameters.iter().map(|p| p.channels.count()).sum()
}

/// The first entry of a named parameter in the flat vector.
#[must_use]
pub fn offset_of(parameters: &[Parameter], name: &str) -> Option<usize> {
    let index = parameters.iter().position(|p| p.name == name)?;
    Some(flat_len(&parameters[..index]))
}

/// Lower and upper bounds of every entry of the flat vector.
#[must_use]
pub fn flat_bounds(parameters: &[Parameter]) -> (Vec<f64>, Vec<f64>) {
    let spread = |f: fn(&Parameter) -> f64| {
        parameters.iter().flat_map(|p| std::iter::repeat_n(f(p), p.channels.count())).collect()
    };
    (spread(|p| p.lower), spread(|p| p.upper))
}

/// A name for every entry of the flat vector: `kd.r`, `kd.g`, `kd.b`, `alpha`.
#[must_use]
pub fn flat_names(parameters: &[Parameter]) -> Vec<String> {
    parameters
        .iter()
        .flat_map(|p| match p.channels {
            Channels::Scalar => vec![p.name.to_owned()],
            Channels::Rgb => ["r", "g", "b"].map(|c| format!("{}.{c}", p.name)).to_vec(),
        })
        .collect()
}
