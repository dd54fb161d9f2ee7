//! The names under which the users of a program know parts and scores.

use std::mem;

use serde_json::Value;

/// Names in the JSON of a [`Status`](super::status::Status), and of the view of the table `parts`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Names {
    /// The list of parts, and the view.
    pub parts: &'static str,
    /// The score of a part.
    pub score: &'static str,
    /// The best score of the run.
    pub best_score: &'static str,
}

/// The names that the fields of [`Status`](super::status::Status) have in its own encoding. A view cannot have the name of a table.
const FIELDS: Names = Names { parts: "part_list", score: "score", best_score: "best_score" };

impl Default for Names {
    fn default() -> Self {
        FIELDS
    }
}

impl Names {
    /// Give these names to the fields of a status.
    pub(super) fn give(self, status: Value) -> Value {
        renamed(status, FIELDS, self)
    }

    /// Restore the fields of a status with these names.
    pub(super) fn restore(self, status: Value) -> Value {
        renamed(status, self, FIELDS)
    }

    /// The statement that creates the view of the table `parts`.
    pub(super) fn view(self) -> String {
        let Self { parts, score, .. } = self;
        format!(
            "CREATE VIEW {parts} AS
    SELECT name, number, state, score AS {score}, seconds, error, outputs FROM parts;
"
        )
    }
}

fn renamed(mut status: Value, from: Names, to: Names) -> Value {
    rename(&mut status, from.best_score, to.best_score);
    rename(&mut status, from.parts, to.parts);
    if let Some(Value::Array(parts)) = status.get_mut(to.parts) {
        parts.iter_mut().for_each(|part| rename(part, from.score, to.score));
    }
    status
}

/// Rename a field of an object. The order of the fields stays.
fn rename(object: &mut Value, from: &str, to: &str) {
    if let Value::Object(fields) = object {
        let named = |name: String| if name == from { to.to_owned() } else { name };
        *fields = mem::take(fields).into_iter().map(|(name, value)| (named(name), value)).collect();
    }
}
