//! The identity of a run: a resumed run must have the same inputs and settings.

use std::collections::BTreeMap;
use std::fmt;

use serde_json::{Map, Value};

/// The inputs (by content) and the settings that determine the result of a run, by name. Other settings, such as the number of
/// workers, are not part of it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RunIdentity {
    parts: Vec<(String, String)>,
}

/// A difference between two identities.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The flag or the input that differs.
    pub name: String,
    /// Its value in the existing run; `None` if it had no value.
    pub there: Option<String>,
    /// Its value in this run; `None` if it has no value.
    pub here: Option<String>,
}

impl RunIdentity {
    /// This identity with one more entry.
    #[must_use]
    pub fn with(mut self, name: impl Into<String>, value: impl Into<String>) -> Self {
        self.parts.push((name.into(), value.into()));
        self
    }

    /// The differences from the identity of an existing run, in the order of this one.
    #[must_use]
    pub fn differences(&self, there: &Self) -> Vec<Difference> {
        let by_name = |of: &Self| of.parts.iter().cloned().collect::<BTreeMap<String, String>>();
        let (in_here, in_there) = (by_name(self), by_name(there));
        let only_there = there.parts.iter().filter(|(name, _)| !in_here.contains_key(name));
        let names = self.parts.iter().chain(only_there).map(|(name, _)| name);
        let difference = |name: &String| {
            let (there, here) = (in_there.get(name).cloned(), in_here.get(name).cloned());
            (there != here).then(|| Difference { name: name.clone(), there, here })
        };
        names.filter_map(difference).collect()
    }

    /// The stored form.
    pub(super) fn to_json(&self) -> String {
        let parts = self.parts.iter().map(|(name, value)| (name.clone(), Value::from(value.as_str())));
        Value::Object(parts.collect::<Map<_, _>>()).to_string()
    }

    /// Parse the stored form; `None` for anything else.
    pub(super) fn from_json(text: &str) -> Option<Self> {
        let Ok(Value::Object(parts)) = serde_json::from_str(text) else { return None };
        let part = |(name, value): (String, Value)| Some((name, value.as_str()?.to_owned()));
        Some(Self { parts: parts.into_iter().map(part).collect::<Option<_>>()? })
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let or_not_given = |value: &Option<String>| value.clone().unwrap_or_else(|| "not given".into());
        write!(formatter, "{} is {} there and {} here", self.name, or_not_given(&self.there), or_not_given(&self.here))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn difference_is_named_with_both_values() {
        let there = RunIdentity::default().with("photo", "12ab").with("--mask", "77").with("--seed", "0");
        let here = RunIdentity::default().with("photo", "34cd").with("--seed", "0").with("--normals", "99");
        let told: Vec<_> = here.differences(&there).iter().map(ToString::to_string).collect();
        let expected = [
            "photo is 12ab there and 34cd here",
            "--normals is not given there and 99 here",
            "--mask is 77 there and not given here",
        ];
        assert_eq!(told, expected);
        assert_eq!(here.differences(&here.clone()), []);
        assert_eq!(RunIdentity::from_json(&here.to_json()), Some(here));
        assert_eq!(RunIdentity::from_json("[]"), None);
    }
}
