//! Parameters that a fit holds, and ranges narrower than those of the model (`--fix`, `--bounds`).

use crate::brdf::{self, Model, Parameter, ParameterError, flat_bounds};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

/// The ranges of some parameters of a model in a fit; all others have those of the model.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Ranges(Vec<Range>);

/// The range of one parameter: one lower and one upper value per channel, equal if the parameter is held.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Range {
    name: String,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl Range {
    fn is_held(&self) -> bool {
        self.lower == self.upper
    }
}

impl Ranges {
    /// Holds a parameter of `model` at these values: one, or three of a colour.
    ///
    /// # Errors
    /// If the model has no such parameter, it is given already, or a value is outside the model's range.
    pub fn hold(&mut self, model: &dyn Model, name: &str, values: &[f64]) -> Result<(), ParameterError> {
        let (parameter, _) = brdf::parameter(model, name)?;
        let values = parameter.entries(values)?;
        self.add(parameter, values.clone(), values)
    }

    /// Narrows the range of a parameter of `model`, the same in all channels.
    ///
    /// # Errors
    /// As [`Self::hold`], or if `lower` is above `upper`.
    pub fn narrow(&mut self, model: &dyn Model, name: &str, lower: f64, upper: f64) -> Result<(), ParameterError> {
        let (parameter, _) = brdf::parameter(model, name)?;
        let count = parameter.channels.count();
        self.add(parameter, vec![lower; count], vec![upper; count])
    }

    /// Refuses ranges from a peer that are not those of `model`.
    ///
    /// # Errors
    /// As [`Self::hold`] and [`Self::narrow`].
    pub(crate) fn check(&self, model: &dyn Model) -> Result<(), ParameterError> {
        let mut checked = Self::default();
        for Range { name, lower, upper } in &self.0 {
            let (parameter, _) = brdf::parameter(model, name)?;
            let expected = parameter.channels.count();
            if let Some(found) = [lower.len(), upper.len()].into_iter().find(|found| *found != expected) {
                return Err(ParameterError::Count { name: parameter.name, expected, found });
            }
            checked.add(parameter, lower.clone(), upper.clone())?;
        }
        Ok(())
    }

    /// Whether a parameter of this name has a range.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.0.iter().any(|range| range.name == name)
    }

    /// Whether a flat parameter vector of `model` is within the ranges.
    #[must_use]
    pub(crate) fn contain(&self, model: &dyn Model, point: &[f64]) -> bool {
        let (lower, upper) = self.bounds(model);
        point.len() == lower.len() && point.iter().zip(lower.iter().zip(&upper)).all(|(x, (l, u))| (l..=u).contains(&x))
    }

    fn add(&mut self, parameter: &Parameter, lower: Vec<f64>, upper: Vec<f64>) -> Result<(), ParameterError> {
        let &Parameter { name, lower: least, upper: most, .. } = parameter;
        if self.has(name) {
            return Err(ParameterError::Twice { name });
        }
        if let Some(&found) = lower.iter().chain(&upper).find(|x| !(least..=most).contains(*x)) {
            return Err(ParameterError::OutOfBounds { name, found, lower: least, upper: most });
        }
        if let Some((&lower, &upper)) = lower.iter().zip(&upper).find(|(lower, upper)| lower > upper) {
            return Err(ParameterError::EmptyRange { name, lower, upper });
        }
        self.0.push(Range { name: name.to_owned(), lower, upper });
        // The order in which they are given makes no difference to a run.
        self.0.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(())
    }

    /// Lower and upper bounds of every entry of the flat vector of `model`.
    #[must_use]
    pub fn bounds(&self, model: &dyn Model) -> (Vec<f64>, Vec<f64>) {
        let (mut lower, mut upper) = flat_bounds(model.parameters());
        for range in &self.0 {
            if let Ok((_, first)) = brdf::parameter(model, &range.name) {
                lower[first..].iter_mut().zip(&range.lower).for_each(|(bound, x)| *bound = *x);
                upper[first..].iter_mut().zip(&range.upper).for_each(|(bound, x)| *bound = *x);
            }
        }
        (lower, upper)
    }

    /// Whether the range of an entry of the flat vector of `model` is not that of the model.
    pub(crate) fn restrict(&self, model: &dyn Model, entry: usize) -> bool {
        let (lower, upper) = self.bounds(model);
        let (least, most) = flat_bounds(model.parameters());
        lower[entry] != least[entry] || upper[entry] != most[entry]
    }

    /// Whether every entry of the flat vector is held.
    #[must_use]
    pub fn holds_everything(&self, model: &dyn Model) -> bool {
        let (lower, upper) = self.bounds(model);
        lower == upper
    }

    /// The values of the parameters that are held, by name.
    #[must_use]
    pub fn held(&self) -> Value {
        let value = |range: &Range| match range.lower[..] {
            [scalar] => json!(scalar),
            _ => json!(range.lower),
        };
        self.by_name(true, value)
    }

    /// The lower and the upper bound of the other parameters, by name.
    #[must_use]
    pub fn narrowed(&self) -> Value {
        self.by_name(false, |range| json!([range.lower[0], range.upper[0]]))
    }

    fn by_name(&self, held: bool, value: impl Fn(&Range) -> Value) -> Value {
        let of = self.0.iter().filter(|range| range.is_held() == held);
        Value::Object(of.map(|range| (range.name.clone(), value(range))).collect::<Map<_, _>>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{CookTorrance, Ggx};

    #[test]
    fn held_and_narrowed_parameters_replace_the_bounds_of_the_model() {
        let mut ranges = Ranges::default();
        ranges.hold(&Ggx, "f90", &[1.0]).unwrap();
        ranges.hold(&Ggx, "kd", &[0.1, 0.2, 0.3]).unwrap();
        ranges.narrow(&Ggx, "f0", 0.02, 0.08).unwrap();
        let (lower, upper) = ranges.bounds(&Ggx);
        assert_eq!(lower, [0.1, 0.2, 0.3, 0.02, 0.02, 0.02, 1.0, 0.005]);
        assert_eq!(upper, [0.1, 0.2, 0.3, 0.08, 0.08, 0.08, 1.0, 1.0]);
        assert!(!ranges.holds_everything(&Ggx));
        assert_eq!(ranges.held(), json!({ "f90": 1.0, "kd": [0.1, 0.2, 0.3] }));
        assert_eq!(ranges.narrowed(), json!({ "f0": [0.02, 0.08] }));
        assert_eq!(Ranges::default().bounds(&Ggx), flat_bounds(Ggx.parameters()));
    }

    #[test]
    fn wrong_ranges_are_refused_with_the_name() {
        let mut ranges = Ranges::default();
        ranges.hold(&Ggx, "f90", &[1.0]).unwrap();
        let mut hold =
            |model: &dyn Model, name: &str, values: &[f64]| ranges.hold(model, name, values).unwrap_err().to_string();
        assert_eq!(hold(&Ggx, "f90", &[0.5]), "parameter 'f90' is given twice: name it once, in --fix or in --bounds");
        assert!(
            hold(&CookTorrance, "f90", &[1.0]).contains("model cook-torrance has no parameter 'f90': it has kd, ks")
        );
        assert!(hold(&Ggx, "alpha", &[0.001]).contains("'alpha' is 0.001: expected a value in [0.005, 1]"));
        assert!(hold(&Ggx, "alpha", &[f64::NAN]).contains("'alpha' is NaN"));
        assert!(hold(&Ggx, "kd", &[0.1, 0.2]).contains("'kd' takes 3 number(s), found 2"));
        let empty = ranges.narrow(&Ggx, "alpha", 0.5, 0.2).unwrap_err().to_string();
        assert_eq!(empty, "parameter 'alpha' has an empty range: 0.5 is above 0.2");
        // From a peer.
        let range = |name: &str, lower: &[f64], upper: &[f64]| {
            Ranges(vec![Range { name: name.to_owned(), lower: lower.to_vec(), upper: upper.to_vec() }]).check(&Ggx)
        };
        assert!(range("alpha", &[0.1], &[0.2]).is_ok());
        assert!(range("alpha", &[0.1; 2], &[0.2; 2]).is_err() && range("kd", &[0.1; 3], &[0.2]).is_err());
        assert!(range("alpha", &[0.3], &[0.2]).is_err() && range("alpha", &[f64::NAN], &[0.2]).is_err());
        assert!(range("alpha", &[0.001], &[0.2]).is_err() && range("m", &[0.1], &[0.2]).is_err());
    }
}
