//! The models that one fit compares.

use super::{
    method::{Method, MethodError, Setting},
    ranges::Ranges,
};
use crate::brdf::{AUTO, HeldModel, Model, ParameterError};
use serde_json::{Map, Value, json};

/// A method with one or several models, from simple to rich: equal methods but for the model and the ranges of its parameters.
#[derive(Debug, Clone)]
pub struct Methods {
    first: Method,
    others: Vec<Method>,
}

impl Default for Methods {
    /// The defaults, with the models of [`AUTO`].
    fn default() -> Self {
        let auto = Self::auto(&Ranges::default()).unwrap_or_default();
        Self::new(Method::default(), auto)
    }
}

impl From<Method> for Methods {
    fn from(method: Method) -> Self {
        Self { first: method, others: Vec::new() }
    }
}

impl Methods {
    /// The method with each of these models instead of its own, which stays if there are none. Equal ones count once.
    #[must_use]
    pub fn new(method: Method, models: Vec<(&'static dyn Model, Ranges)>) -> Self {
        let mut methods: Vec<Method> = Vec::new();
        for (model, ranges) in models {
            if !methods.iter().any(|known| known.model.name() == model.name() && known.ranges == ranges) {
                methods.push(Method { model, ranges, ..method.clone() });
            }
        }
        let mut methods = methods.into_iter();
        Self { first: methods.next().unwrap_or(method), others: methods.collect() }
    }

    /// The models of [`AUTO`] with the user's ranges, which count instead of those of the list.
    ///
    /// # Errors
    /// If a model has no parameter of that name, or a range does not fit it.
    pub fn auto(ranges: &Ranges) -> Result<Vec<(&'static dyn Model, Ranges)>, ParameterError> {
        let of_model = |&(model, held): &HeldModel| {
            ranges.check(model)?;
            let mut all = ranges.clone();
            for (name, value) in held.iter().filter(|(name, _)| !ranges.has(name)) {
                all.hold(model, name, &[*value])?;
            }
            Ok((model, all))
        };
        AUTO.iter().map(of_model).collect()
    }

    /// The methods, from simple to rich.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &Method> + Clone {
        let count = 1 + self.others.len();
        (0..count).map(|i| self.get(i))
    }

    /// One of the methods, the last one if there are fewer.
    #[must_use]
    pub fn get(&self, index: usize) -> &Method {
        let last = self.others.last().unwrap_or(&self.first);
        if index == 0 { &self.first } else { self.others.get(index - 1).unwrap_or(last) }
    }

    /// The first, for the settings that all have in common.
    #[must_use]
    pub fn common(&self) -> &Method {
        &self.first
    }

    /// Checks the settings that their types do not check.
    ///
    /// # Errors
    /// Names the setting that is out of range.
    pub fn check(&self) -> Result<(), MethodError> {
        self.iter().try_for_each(Method::check)
    }

    /// The name of the models together: of a single one its own, `auto` for those of [`AUTO`], in any ranges.
    #[must_use]
    pub fn name(&self) -> String {
        let mut names: Vec<&str> = self.iter().map(|method| method.model.name()).collect();
        let mut auto: Vec<&str> = AUTO.iter().map(|(model, _)| model.name()).collect();
        names.dedup();
        auto.dedup();
        if names == auto { "auto".to_owned() } else { names.join("+") }
    }

    /// The parameters that one of the methods holds and another one does not, by name.
    #[must_use]
    pub fn held_by(&self, method: &Method) -> Map<String, Value> {
        let common =
            |name: &String, value: &Value| self.iter().all(|other| other.ranges.held().get(name) == Some(value));
        let Value::Object(held) = method.ranges.held() else { return Map::new() };
        held.into_iter().filter(|(name, value)| !common(name, value)).collect()
    }

    /// The model of one of the methods, and what tells it from the others: `ggx, f90 = 1`.
    #[must_use]
    pub fn label(&self, method: &Method) -> String {
        // 1, not 1.0.
        let text = |value: Value| value.as_f64().map_or_else(|| value.to_string(), |number| number.to_string());
        let held = self.held_by(method).into_iter().map(|(name, value)| format!(", {name} = {}", text(value)));
        std::iter::once(method.model.name().to_owned()).chain(held).collect()
    }

    /// Every setting, as [`Method::settings`], for the identity of a run.
    #[must_use]
    pub fn settings(&self) -> Vec<Setting> {
        let mut settings = self.first.settings();
        if self.others.is_empty() {
            return settings;
        }
        let labels: Vec<String> = self.iter().map(|method| self.label(method)).collect();
        let own = self.held_by(&self.first);
        for setting in &mut settings {
            match setting.flag {
                "--model" => setting.text = labels.join("; "),
                "--fix" => {
                    let Value::Object(held) = self.first.ranges.held() else { continue };
                    let common: Map<_, _> = held.into_iter().filter(|(name, _)| !own.contains_key(name)).collect();
                    setting.text = json!(common).to_string();
                }
                _ => {}
            }
        }
        settings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(methods: &Methods) -> Vec<String> {
        methods.iter().map(|method| methods.label(method)).collect()
    }

    #[test]
    fn default_is_from_simple_to_rich() {
        let methods = Methods::default();
        assert_eq!(labels(&methods), ["ggx, f90 = 1", "ggx", "ggx-haze"]);
        assert_eq!(labels(&Methods::from(Method::default())), ["ggx"]);
        methods.check().unwrap();
        let text = |flag: &str| methods.settings().into_iter().find(|s| s.flag == flag).unwrap().text;
        assert_eq!((text("--model").as_str(), text("--fix").as_str()), ("ggx, f90 = 1; ggx; ggx-haze", "{}"));
    }

    #[test]
    fn ranges_of_the_user_count_instead_of_those_of_the_list() {
        let mut ranges = Ranges::default();
        ranges.hold(AUTO[0].0, "f90", &[0.8]).unwrap();
        let methods = Methods::new(Method::default(), Methods::auto(&ranges).unwrap());
        assert_eq!(labels(&methods), ["ggx", "ggx-haze"]);
        assert!(methods.iter().all(|method| method.ranges.held() == json!({ "f90": 0.8 })));
        let text = methods.settings().into_iter().find(|s| s.flag == "--fix").unwrap().text;
        assert_eq!(text, r#"{"f90":0.8}"#);
        let mut haze = Ranges::default();
        haze.hold(AUTO[2].0, "haze", &[0.2]).unwrap();
        let refused = Methods::auto(&haze).unwrap_err().to_string();
        assert!(refused.contains("model ggx has no parameter 'haze'"), "{refused}");
    }
}
