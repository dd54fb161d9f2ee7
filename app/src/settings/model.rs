//! `--model` and `--params`: which BRDF, and with which values.

use anyhow::{Context, bail};
use lookalike::brdf;
use std::{fmt, str::FromStr};

/// The name of a BRDF model that can be fitted (design section 4).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ModelName(String);

impl ModelName {
    /// The name as it is written in settings and outputs.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl Default for ModelName {
    fn default() -> Self {
        Self("ggx".into())
    }
}

impl FromStr for ModelName {
    type Err = anyhow::Error;

    /// One of the models' names; those of the design that do not exist yet are told apart from those that never will.
    fn from_str(text: &str) -> anyhow::Result<Self> {
        if brdf::model(text).is_ok() {
            return Ok(Self(text.into()));
        }
        if PLANNED.contains(&text) {
            bail!("the model {text} is not there yet: this version fits {}", fitted().join(", "));
        }
        bail!("no such model; possible values: {}", fitted().join(", "))
    }
}

impl fmt::Display for ModelName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// The models of the registry.
fn fitted() -> Vec<&'static str> {
    brdf::MODELS.iter().map(|m| m.name()).collect()
}
/// Models of the design that this version does not have.
const PLANNED: [&str; 1] = ["merl"];

/// Values of a model's parameters by name, in the order given; names, counts and bounds are the model's to check.
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
    fn models_are_known_planned_or_unknown() {
        assert_eq!("ggx".parse::<ModelName>().unwrap(), ModelName::default());
        let planned = "merl".parse::<ModelName>().unwrap_err().to_string();
        assert!(
            planned.contains("not there yet")
                && planned.contains("ggx, ggx-f90, cook-torrance, ward, blinn-phong, ashikhmin-shirley, disney"),
            "{planned}"
        );
        let unknown = "phong".parse::<ModelName>().unwrap_err().to_string();
        assert!(unknown.contains("possible values: ggx, ggx-f90, cook-torrance"), "{unknown}");
    }

    #[test]
    fn parameters_are_scalars_or_colours() {
        let params: ModelParams = "kd=.5,.4,0.3,f0=.04, alpha = 1e-1".parse().unwrap();
        let expected = [("kd", vec![0.5, 0.4, 0.3]), ("f0", vec![0.04]), ("alpha", vec![0.1])];
        assert_eq!(params.entries(), expected.map(|(name, values)| (name.to_owned(), values)));
    }

    #[test]
    fn malformed_parameters_say_which_one() {
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
