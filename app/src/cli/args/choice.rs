//! Flags whose values are names that the library defines, such as models.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use lookalike::choice::Choice;
use std::str::FromStr;

/// A parser whose help and errors list the names of a choice.
pub(super) fn choice<T>() -> impl TypedValueParser<Value = T>
where
    T: Choice + FromStr<Err: Into<Box<dyn std::error::Error + Send + Sync>>> + Send + Sync,
{
    let names = T::TABLE.iter().map(|(_, name, help)| PossibleValue::new(*name).help(*help));
    PossibleValuesParser::new(names).try_map(|name| name.parse::<T>())
}
