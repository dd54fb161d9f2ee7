//! `--model` and `--params`: which BRDF, and with which values.

use anyhow::{Context, bail};
use clap::{
    Arg, Command, ValueEnum,
    builder::{EnumValueParser, PossibleValue, TypedValueParser},
    error::ErrorKind,
};
use lookalike::{
    brdf::{self, DEFAULT_MODEL, MODELS, Model, ParameterError},
    fit::Methods,
};
use std::{ffi::OsStr, fmt, str::FromStr, sync::LazyLock};

/// A BRDF model of the registry (design section 4).
#[derive(Debug, Clone, Copy)]
pub struct ModelName(&'static dyn Model);

impl ModelName {
    /// The name as it is written in settings and outputs.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        self.0.name()
    }

    /// The model.
    #[must_use]
    pub fn model(self) -> &'static dyn Model {
        self.0
    }
}

impl Default for ModelName {
    fn default() -> Self {
        Self(DEFAULT_MODEL)
    }
}

impl PartialEq for ModelName {
    fn eq(&self, other: &Self) -> bool {
        self.as_str() == other.as_str()
    }
}

impl Eq for ModelName {}

impl ValueEnum for ModelName {
    fn value_variants<'a>() -> &'a [Self] {
        static ALL: LazyLock<Vec<ModelName>> = LazyLock::new(|| MODELS.iter().map(|model| ModelName(*model)).collect());
        &ALL
    }

    /// The name; its help is the model's summary and the names of its parameters.
    fn to_possible_value(&self) -> Option<PossibleValue> {
        let parameters: Vec<&str> = self.0.parameters().iter().map(|parameter| parameter.name).collect();
        let help = format!("{}. Parameters: {}", self.0.summary(), parameters.join(", "));
        Some(PossibleValue::new(self.as_str()).help(help))
    }
}

impl fmt::Display for ModelName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// Parses `--model`. The name of a model that has become another one is refused with what to use instead.
#[derive(Debug, Clone, Copy)]
pub struct ModelParser;

impl TypedValueParser for ModelParser {
    type Value = ModelName;

    fn parse_ref(&self, command: &Command, flag: Option<&Arg>, value: &OsStr) -> Result<ModelName, clap::Error> {
        if let Some(Err(error @ ParameterError::Renamed { .. })) = value.to_str().map(brdf::model) {
            return Err(command.clone().error(ErrorKind::InvalidValue, error));
        }
        EnumValueParser::new().parse_ref(command, flag, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(ModelName::value_variants().iter().filter_map(ValueEnum::to_possible_value)))
    }
}

/// The models that a fit tries.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FitModels {
    /// Those of [`AUTO`](brdf::AUTO).
    Auto,
    /// These, from simple to rich.
    List(Vec<ModelName>),
}

/// The name of [`FitModels::Auto`].
const AUTO: &str = "auto";

impl fmt::Display for FitModels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str(AUTO),
            Self::List(models) => f.write_str(&models.iter().map(|model| model.as_str()).collect::<Vec<_>>().join(",")),
        }
    }
}

/// Parses `--model` of a fit: `auto`, or the names of models, separated by commas.
#[derive(Debug, Clone, Copy)]
pub struct FitModelsParser;

impl TypedValueParser for FitModelsParser {
    type Value = FitModels;

    fn parse_ref(&self, command: &Command, flag: Option<&Arg>, value: &OsStr) -> Result<FitModels, clap::Error> {
        let text = value.to_str().unwrap_or_default();
        if text == AUTO {
            return Ok(FitModels::Auto);
        }
        let mut models = Vec::new();
        for name in text.split(',').map(str::trim) {
            if name == AUTO {
                let text = "auto stands alone: name the models of a list, separated by commas\n";
                return Err(command.clone().error(ErrorKind::InvalidValue, text));
            }
            if brdf::model(name).is_err_and(|error| matches!(error, ParameterError::UnknownModel { .. })) {
                let known: Vec<&str> = std::iter::once(AUTO).chain(MODELS.iter().map(|model| model.name())).collect();
                let flag = flag.map_or_else(String::new, |flag| format!(" for '{flag}'"));
                let text = format!("invalid value '{name}'{flag}\n  [possible values: {}]\n", known.join(", "));
                return Err(command.clone().error(ErrorKind::InvalidValue, text));
            }
            models.push(ModelParser.parse_ref(command, flag, OsStr::new(name))?);
        }
        Ok(FitModels::List(models))
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let models = Methods::default();
        let labels: Vec<String> = models.iter().map(|method| models.label(method)).collect();
        let help = format!("The simplest of these that matches as well as the best: {}", labels.join("; "));
        let auto = std::iter::once(PossibleValue::new(AUTO).help(help));
        Some(Box::new(auto.chain(ModelParser.possible_values().into_iter().flatten())))
    }
}

/// Ranges of a model's parameters by name, in the order given; the model checks names and bounds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ModelBounds(Vec<(String, f64, f64)>);

impl ModelBounds {
    /// Names, lower and upper bounds.
    #[must_use]
    pub fn entries(&self) -> &[(String, f64, f64)] {
        &self.0
    }
}

impl FromStr for ModelBounds {
    type Err = anyhow::Error;

    /// `name=lower:upper,name=...`.
    fn from_str(text: &str) -> anyhow::Result<Self> {
        let range = |part: &str| {
            let (name, range) = part.split_once('=')?;
            let (lower, upper) = range.split_once(':')?;
            let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
            Some((name.trim().to_owned(), number(lower)?, number(upper)?))
        };
        let ranges = text.split(',').map(|part| {
            range(part).with_context(|| format!("expected NAME=LOWER:UPPER, such as alpha=.05:.3, found {part:?}"))
        });
        ranges.collect::<anyhow::Result<_>>().map(Self)
    }
}

/// Values of a model's parameters by name, in the order given; the model checks names, counts and bounds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ModelParams(Vec<(String, Vec<f64>)>);

impl ModelParams {
    /// Names and values: one value for a scalar or a grey colour, three for a colour.
    #[must_use]
    pub fn entries(&self) -> &[(String, Vec<f64>)] {
        &self.0
    }
}

impl FromStr for ModelParams {
    type Err = anyhow::Error;

    /// `name=v[,v,v],name=...`: a part without `=` continues the value before it, so a colour is `kd=.5,.4,.3`.
    fn from_str(text: &str) -> anyhow::Result<Self> {
        let mut entries: Vec<(String, Vec<f64>)> = Vec::new();
        for part in text.split(',') {
            let number = match part.split_once('=') {
                Some((name, number)) => {
                    let name = name.trim();
                    if name.is_empty() {
                        bail!("a value has no name; expected NAME=VALUE");
                    }
                    if entries.iter().any(|(known, _)| known == name) {
                        bail!("{name} is given twice");
                    }
                    entries.push((name.into(), Vec::new()));
                    number
                }
                None => part,
            };
            let (name, values) = entries.last_mut().context("expected NAME=VALUE[,NAME=VALUE...]")?;
            match number.trim().parse::<f64>() {
                Ok(value) if value.is_finite() => values.push(value),
                _ => bail!("{name} must be a number or three numbers, found {:?}", number.trim()),
            }
        }
        match entries.iter().find(|(_, values)| values.len() != 1 && values.len() != 3) {
            Some((name, values)) => bail!("{name} has {} values; expected one or three", values.len()),
            None => Ok(Self(entries)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_model_is_a_value_whose_help_names_its_parameters() {
        for model in MODELS {
            let value = <ModelName as ValueEnum>::from_str(model.name(), false).unwrap();
            assert_eq!(value.model().name(), model.name());
            let help = value.to_possible_value().unwrap().get_help().unwrap().to_string();
            assert!(model.parameters().iter().all(|parameter| help.contains(parameter.name)), "{help}");
        }
        assert_eq!(ModelName::default().as_str(), DEFAULT_MODEL.name());
        assert!(<ModelName as ValueEnum>::from_str("phong", false).is_err());
    }

    #[test]
    fn parameters_are_scalars_or_colours() {
        let params: ModelParams = "kd=.5,.4,0.3,f0=.04, alpha = 1e-1".parse().unwrap();
        let expected = [("kd", vec![0.5, 0.4, 0.3]), ("f0", vec![0.04]), ("alpha", vec![0.1])];
        assert_eq!(params.entries(), expected.map(|(name, values)| (name.to_owned(), values)));
    }

    #[test]
    fn ranges_have_two_ends() {
        let bounds: ModelBounds = "alpha=.05:.3, kd = 0:1e-1".parse().unwrap();
        assert_eq!(bounds.entries(), [("alpha".to_owned(), 0.05, 0.3), ("kd".to_owned(), 0.0, 0.1)]);
        for text in ["", "alpha", "alpha=.1", "alpha=.1:", "alpha=.1:wide", "alpha=.1:inf", "alpha=.1:.2,"] {
            let message = text.parse::<ModelBounds>().unwrap_err().to_string();
            assert!(message.starts_with("expected NAME=LOWER:UPPER"), "{text}: {message}");
        }
    }

    #[test]
    fn errors_of_parameters_say_which_one() {
        for (text, phrase) in [
            ("kd=1,2", "kd has 2 values"),
            ("kd=1,kd=2", "kd is given twice"),
            ("alpha=wide", "alpha must be a number"),
            ("alpha=nan", "alpha must be a number"),
            ("alpha=", "alpha must be a number"),
            ("=1", "no name"),
            ("1,2,3", "expected NAME=VALUE"),
            ("", "expected NAME=VALUE"),
        ] {
            let message = text.parse::<ModelParams>().unwrap_err().to_string();
            assert!(message.contains(phrase), "{text}: {message}");
        }
    }
}
